#include "colmap_graphmatch/database/shard_features.h"

#include <algorithm>
#include <cstddef>
#include <utility>

namespace colmap_graphmatch {
namespace {

// The keypoints of these features, if the row can be: rows, columns and data in columns 0 to 2.
std::optional<sqlite::Blob> Select(const sqlite::Statement& row,
                                   const std::vector<std::uint32_t>& features) {
  const std::int64_t num = row.Int(0);
  const std::int64_t size = static_cast<std::int64_t>(row.Size(2));
  if (num <= 0 || row.Int(1) <= 0 || size % num != 0) return std::nullopt;
  const auto row_size = static_cast<std::size_t>(size / num);
  const bool is_sound = row_size % sizeof(float) == 0 &&
                        static_cast<std::int64_t>(row_size / sizeof(float)) == row.Int(1) &&
                        (features.empty() || features.back() < num);
  if (!is_sound) return std::nullopt;
  const std::uint8_t* data = row.Data(2);
  sqlite::Blob selected;
  selected.reserve(features.size() * row_size);
  for (const std::uint32_t feature : features) {
    const std::uint8_t* begin = data + feature * row_size;
    selected.insert(selected.end(), begin, begin + row_size);
  }
  return selected;
}

// Calls change(list of the image, &number) for every feature of an image that is listed.
template <typename Change>
FeatureMatches Renumber(const ImagePair& pair, FeatureMatches matches,
                        const ShardFeatures& features, const Change& change) {
  const auto first = features.find(pair.id1);
  const auto second = features.find(pair.id2);
  for (FeatureMatch& match : matches) {
    if (first != features.end()) change(first->second, &match.feature1);
    if (second != features.end()) change(second->second, &match.feature2);
  }
  return matches;
}

}  // namespace

ShardFeatures FeaturesOf(const std::vector<ShardPair>& pairs) {
  ShardFeatures features;
  for (const ShardPair& pair : pairs) {
    std::vector<std::uint32_t>& first = features[pair.pair.id1];
    std::vector<std::uint32_t>& second = features[pair.pair.id2];
    for (const FeatureMatch& match : pair.matches.value()) {
      first.push_back(match.feature1);
      second.push_back(match.feature2);
    }
  }
  for (auto& [image, numbers] : features) {
    std::sort(numbers.begin(), numbers.end());
    numbers.erase(std::unique(numbers.begin(), numbers.end()), numbers.end());
  }
  return features;
}

void CopyKeypoints(sqlite::Connection& shard, ShardFeatures* features) {
  sqlite::Statement select(shard,
                           "SELECT rows, cols, data FROM source.keypoints WHERE image_id = ?1");
  sqlite::Statement insert(
      shard, "INSERT INTO main.keypoints(image_id, rows, cols, data) VALUES(?1, ?2, ?3, ?4)");
  sqlite::Statement copy(shard,
                         "INSERT INTO main.keypoints(image_id, rows, cols, data) SELECT image_id, "
                         "rows, cols, data FROM source.keypoints WHERE image_id = ?1");
  for (auto image = features->begin(); image != features->end();) {
    const std::int64_t id = image->first;
    const bool is_there = select.Bind(1, id).Step();
    const std::optional<sqlite::Blob> selected =
        is_there ? Select(select, image->second) : std::nullopt;
    if (selected) {
      const auto num = static_cast<std::int64_t>(image->second.size());
      insert.Bind(1, id).Bind(2, num).Bind(3, select.Int(1)).Bind(4, *selected).Run();
      ++image;
    } else {
      copy.Bind(1, id).Run();
      image = features->erase(image);
    }
    select.Reset();
  }
}

FeatureMatches ToShard(const ImagePair& pair, FeatureMatches matches,
                       const ShardFeatures& features) {
  return Renumber(pair, std::move(matches), features,
                  [](const std::vector<std::uint32_t>& numbers, std::uint32_t* feature) {
                    const auto place = std::lower_bound(numbers.begin(), numbers.end(), *feature);
                    *feature = static_cast<std::uint32_t>(place - numbers.begin());
                  });
}

FeatureMatches FromShard(const ImagePair& pair, FeatureMatches matches,
                         const ShardFeatures& features) {
  return Renumber(pair, std::move(matches), features,
                  [](const std::vector<std::uint32_t>& numbers, std::uint32_t* feature) {
                    *feature = numbers[*feature];
                  });
}

}  // namespace colmap_graphmatch
