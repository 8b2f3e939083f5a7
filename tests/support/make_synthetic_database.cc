// make_synthetic_database FILE NUM_PLACES PHOTOS_A_PLACE: a COLMAP 3.8 database with made-up
// features, for end-to-end tests that do not need photos.

#include <cstdlib>
#include <iostream>

#include "tests/support/synthetic_database.h"

int main(int argc, char** argv) {
  if (argc != 4) {
    std::cerr << "make_synthetic_database FILE NUM_PLACES PHOTOS_A_PLACE\n";
    return 1;
  }
  namespace gm = colmap_graphmatch;
  gm::WriteSyntheticDatabase(argv[1], gm::Schema::kColmap38,
                             gm::MakePlaces(std::atoi(argv[2]), std::atoi(argv[3]), 60, 1));
  return 0;
}
