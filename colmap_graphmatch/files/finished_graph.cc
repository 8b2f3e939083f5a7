#include "colmap_graphmatch/files/finished_graph.h"

#include <algorithm>
#include <boost/algorithm/string/classification.hpp>
#include <boost/algorithm/string/split.hpp>
#include <boost/lexical_cast/try_lexical_convert.hpp>
#include <memory>
#include <utility>

#include "colmap_graphmatch/base/errors.h"
#include "colmap_graphmatch/base/input_file.h"
#include "colmap_graphmatch/files/text_file.h"

namespace colmap_graphmatch {
namespace {

class Reader {
 public:
  Reader(const std::vector<ImageRecord>& images, int min_num_inliers)
      : ids_(IdsByName(images)), min_num_inliers_(static_cast<std::size_t>(min_num_inliers)) {}

  void Add(const std::string& name1, const std::string& name2, std::size_t num_inliers, int config,
           std::size_t num_matches) {
    const auto id1 = ids_.find(name1);
    const auto id2 = ids_.find(name2);
    if (id1 == ids_.end() || id2 == ids_.end() || id1->second == id2->second) {
      if (graph_.num_skipped++ == 0) graph_.first_skipped = name1 + "\t" + name2;
      return;
    }
    ReplayedPair replayed;
    replayed.num_inliers = static_cast<std::uint32_t>(num_inliers);
    replayed.is_edge = IsEdge(num_inliers, config, min_num_inliers_);
    replayed.is_verified = num_matches >= min_num_inliers_;
    graph_.pairs[ImagePair(id1->second, id2->second)] = replayed;
  }

  void SetInliers(std::function<FeatureMatches(const ImagePair&)> read_inliers) {
    graph_.read_inliers = std::move(read_inliers);
  }

  FinishedGraph Finish() {
    for (const auto& [pair, replayed] : graph_.pairs) graph_.num_edges += replayed.is_edge ? 1 : 0;
    return std::move(graph_);
  }

 private:
  std::unordered_map<std::string, ImageId> ids_;
  std::size_t min_num_inliers_;
  FinishedGraph graph_;
};

void ReadDatabase(const std::filesystem::path& path, const sqlite::LockPatience& patience,
                  const std::vector<ImageRecord>& images, Reader* reader) {
  const auto database = std::make_shared<Database>(path, sqlite::Access::kRead, patience);
  const std::vector<ImageRecord> replayed_images = database->ReadImages();
  std::unordered_map<ImageId, std::string> names;
  for (const ImageRecord& image : replayed_images) names[image.id] = image.name;
  const std::unordered_map<std::string, ImageId> replayed_ids = IdsByName(replayed_images);
  const std::unordered_map<ImagePair, std::size_t> num_matches = database->ReadNumMatches();
  for (const TestedPair& tested : database->ReadTestedPairs()) {
    const auto name1 = names.find(tested.pair.id1);
    const auto name2 = names.find(tested.pair.id2);
    if (name1 == names.end() || name2 == names.end()) continue;
    const auto matches = num_matches.find(tested.pair);
    reader->Add(name1->second, name2->second, tested.num_inliers, tested.config,
                matches == num_matches.end() ? tested.num_inliers : matches->second);
  }
  // By the ids of the images here, which may have another order there.
  std::unordered_map<ImageId, ImageId> ids;
  for (const ImageRecord& image : images) {
    const auto replayed = replayed_ids.find(image.name);
    if (replayed != replayed_ids.end()) ids[image.id] = replayed->second;
  }
  reader->SetInliers([database, ids = std::move(ids)](const ImagePair& pair) -> FeatureMatches {
    const auto id1 = ids.find(pair.id1);
    const auto id2 = ids.find(pair.id2);
    if (id1 == ids.end() || id2 == ids.end()) return {};
    FeatureMatches inliers = database->ReadInliers(ImagePair(id1->second, id2->second));
    if (id1->second > id2->second) {
      for (FeatureMatch& match : inliers) std::swap(match.feature1, match.feature2);
    }
    return inliers;
  });
}

void ReadList(const std::filesystem::path& path, const StopRequest* stop, Reader* reader) {
  constexpr int kUncalibrated = 2;  // Any configuration that an edge may have.
  bool may_be_header = true;
  for (const Line& line :
       ReadLines(path, "edges", "lines of two image names and the number of inliers", stop)) {
    std::vector<std::string> fields;
    boost::split(fields, line.text, boost::is_any_of("\t"));
    std::uint32_t num_inliers = 0;
    int config = kUncalibrated;
    const auto read = [&fields](std::size_t field, auto* value) {
      // lexical_cast takes -2 for a great number.
      return fields.size() <= field ||
             (fields[field].find('-') == std::string::npos &&
              boost::conversion::try_lexical_convert(fields[field], *value));
    };
    bool readable = fields.size() >= 3 && read(2, &num_inliers) && read(3, &config);
    std::uint32_t num_matches = num_inliers;
    readable = readable && read(4, &num_matches);
    if (!readable && !may_be_header) {
      throw FileError("Line " + std::to_string(line.number) + " of " + path.string() +
                      " is not \"image1<tab>image2<tab>inliers\", with COLMAP's configuration and "
                      "the number of matches after it if they are known: \"" +
                      line.text + "\".");
    }
    may_be_header = false;
    if (readable) reader->Add(fields[0], fields[1], num_inliers, config, num_matches);
  }
}

}  // namespace

FinishedGraph ReadFinishedGraph(const std::filesystem::path& path,
                                const std::vector<ImageRecord>& images, int min_num_inliers,
                                const sqlite::LockPatience& patience) {
  Reader reader(images, min_num_inliers);
  if (IsSqliteFile(path)) {
    ReadDatabase(path, patience, images, &reader);
  } else {
    ReadList(path, patience.stop, &reader);
  }
  FinishedGraph graph = reader.Finish();
  if (graph.num_edges == 0) {
    throw FileError("Nothing in " + path.string() + " is an edge between images of this database" +
                    (graph.num_skipped > 0 ? "; the first pair is \"" + graph.first_skipped +
                                                 "\". Are these names as in the table `images`?"
                                           : std::string(". Has it been matched?")));
  }
  return graph;
}

}  // namespace colmap_graphmatch
