#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "colmap_graphmatch/base/stop_request.h"
#include "colmap_graphmatch/base/thread_pool.h"
#include "colmap_graphmatch/base/types.h"
#include "colmap_graphmatch/base/visual_words.h"
#include "colmap_graphmatch/ranking/ranking.h"

namespace colmap_graphmatch {

// By the aggregated selective match kernel with signs of residuals (Tolias, Avrithis and Jegou,
// ICCV 2013, sections 3 and 4):
//   s(a, b) = S(a, b) / sqrt(S(a, a) S(b, b)),
//   S(a, b) = sum over the words w of both of idf(w) u_w^3,
// u_w being the product of both vectors of signs over 128 where it is positive, else 0. Of N images
// n_w have word w, and idf(w) = ln((N + 1) / n_w), so that a word of all images counts a little,
// too. (idf(w)^2, which is common, finds fewer edges: docs/evaluation_record.md.)
//
// The distance is 1 - s, in [0, 1]: 0 for equal images, 1 for those without a common word, and for
// an image without words. Ties by ascending number. Sums are of whole numbers, so they are exact
// in any order: results are bitwise the same on any number of threads, and lists agree with
// distances computed one by one.
class AsmkRanking : public Ranking {
 public:
  // images: their words, which must be below 65,536. Memory: 28 bytes for each word of each image,
  // and the lists. Throws StoppedError if stop (may be null) asks for it.
  AsmkRanking(const RankingOptions& options, std::vector<VisualWords> images, ThreadPool& threads,
              const StopRequest* stop = nullptr);

  std::size_t NumVertices() const override { return words_.size(); }

  // O(list_length) if either is in the list of the other, else O(words of both).
  float Distance(Vertex a, Vertex b) const override;

  // At most list_length.
  const std::vector<Vertex>& NearestOf(Vertex vertex) const override { return lists_[vertex]; }

  // Computed on every call: O(images of each of its words).
  std::vector<Vertex> AllOf(Vertex vertex) const override;

 private:
  // A word of an image, and where the image is among those that have the word.
  struct WordOfImage {
    std::uint32_t word;
    std::uint32_t place;
  };

  void Invert(std::vector<VisualWords> images);
  std::size_t PlaceOf(const WordOfImage& word) const { return first_[word.word] + word.place; }
  Signs SignsAt(std::size_t place) const { return {low_[place], high_[place]}; }
  float DistanceByWords(Vertex a, Vertex b) const;
  // The negative distances of all to it.
  std::vector<float> NearnessToAll(Vertex vertex) const;
  float DistanceOf(std::uint64_t sum, Vertex a, Vertex b) const;

  std::vector<std::vector<WordOfImage>> words_;  // By image, ascending.
  std::vector<std::size_t> first_;               // By word: where its images begin. W + 1.
  std::vector<Vertex> vertices_;                 // The images of each word, ascending,
  std::vector<std::uint64_t> low_;               // and both halves of their signs.
  std::vector<std::uint64_t> high_;
  std::vector<std::uint64_t> weights_;  // By word: idf, in units of 2^-20.
  std::vector<std::uint64_t> self_;     // By image: S(a, a), in the units of S.
  std::vector<std::vector<Vertex>> lists_;
  std::vector<std::vector<float>> distances_;  // Of the elements of the lists.
};

}  // namespace colmap_graphmatch
