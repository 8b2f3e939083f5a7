#include "colmap_graphmatch/ranking/asmk_ranking.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "colmap_graphmatch/ranking/hamming_distances.h"
#include "colmap_graphmatch/ranking/nearest.h"

namespace colmap_graphmatch {
namespace {

constexpr std::uint64_t kBits = 128;

// Images of a word that are scored at a time.
constexpr std::size_t kBlock = 256;

// Of idf. It is below 2^5 for as many images as there may be, and u^3, in units of 1 / 64^3, at
// most 2^18: so 65,536 words sum up to less than 2^59.
constexpr double kUnitsOfWeight = 1 << 20;

// u^3 by Hamming distance, u = (128 - 2 distance) / 128, in units of 1 / 64^3; 0 where u < 0.
constexpr std::array<std::uint64_t, kBits + 1> MakeCubes() {
  std::array<std::uint64_t, kBits + 1> cubes = {};
  for (std::uint64_t distance = 0; distance < kBits / 2; ++distance) {
    const std::uint64_t u = kBits / 2 - distance;
    cubes[distance] = u * u * u;
  }
  return cubes;
}
constexpr std::array<std::uint64_t, kBits + 1> kCubes = MakeCubes();

std::uint64_t WeightOf(std::size_t num_images, std::size_t num_with_word) {
  const double idf =
      std::log((static_cast<double>(num_images) + 1) / static_cast<double>(num_with_word));
  return static_cast<std::uint64_t>(std::llround(idf * kUnitsOfWeight));
}

}  // namespace

AsmkRanking::AsmkRanking(const RankingOptions& options, std::vector<VisualWords> images,
                         ThreadPool& threads, const StopRequest* stop)
    : words_(images.size()),
      self_(images.size()),
      lists_(images.size()),
      distances_(images.size()) {
  Invert(std::move(images));
  for (std::size_t i = 0; i < words_.size(); ++i) {
    for (const WordOfImage& word : words_[i]) self_[i] += weights_[word.word] * kCubes[0];
  }
  threads.ParallelFor(words_.size(), [&](std::size_t i) {
    if (stop != nullptr) stop->ThrowIfRequested();
    std::vector<float> nearness = NearnessToAll(static_cast<Vertex>(i));
    lists_[i] =
        Nearest(nearness.data(), nearness.size(), static_cast<Vertex>(i), options.list_length);
    for (const Vertex other : lists_[i]) distances_[i].push_back(-nearness[other]);
  });
}

void AsmkRanking::Invert(std::vector<VisualWords> images) {
  std::size_t num_words = 0;
  for (const VisualWords& image : images) {
    if (!image.words.empty()) num_words = std::max<std::size_t>(num_words, image.words.back() + 1);
  }
  first_.resize(num_words + 1);
  for (const VisualWords& image : images) {
    for (const std::uint32_t word : image.words) ++first_[word + 1];
  }
  for (std::size_t word = 0; word < num_words; ++word) {
    weights_.push_back(first_[word + 1] > 0 ? WeightOf(images.size(), first_[word + 1]) : 0);
    first_[word + 1] += first_[word];
  }
  vertices_.resize(first_.back());
  low_.resize(first_.back());
  high_.resize(first_.back());
  std::vector<std::uint32_t> places(num_words);
  for (std::size_t i = 0; i < images.size(); ++i) {
    // What is here twice for a moment is that of one image.
    const VisualWords image = std::move(images[i]);
    words_[i].reserve(image.words.size());
    for (std::size_t j = 0; j < image.words.size(); ++j) {
      const std::uint32_t word = image.words[j];
      const std::uint32_t place = places[word]++;
      words_[i].push_back({word, place});
      vertices_[first_[word] + place] = static_cast<Vertex>(i);
      low_[first_[word] + place] = image.signs[j][0];
      high_[first_[word] + place] = image.signs[j][1];
    }
  }
}

float AsmkRanking::DistanceOf(std::uint64_t sum, Vertex a, Vertex b) const {
  if (sum == 0) return 1;
  const double similarity = static_cast<double>(sum) / std::sqrt(static_cast<double>(self_[a]) *
                                                                 static_cast<double>(self_[b]));
  return static_cast<float>(1 - std::min(similarity, 1.0));
}

float AsmkRanking::Distance(Vertex a, Vertex b) const {
  for (const auto& [from, to] : {std::make_pair(a, b), std::make_pair(b, a)}) {
    const auto place = std::find(lists_[from].begin(), lists_[from].end(), to);
    if (place != lists_[from].end()) {
      return distances_[from][static_cast<std::size_t>(place - lists_[from].begin())];
    }
  }
  return DistanceByWords(a, b);
}

float AsmkRanking::DistanceByWords(Vertex a, Vertex b) const {
  const std::vector<WordOfImage>& words_a = words_[a];
  const std::vector<WordOfImage>& words_b = words_[b];
  std::uint64_t sum = 0;
  for (std::size_t i = 0, j = 0; i < words_a.size() && j < words_b.size();) {
    const std::uint32_t word_a = words_a[i].word;
    const std::uint32_t word_b = words_b[j].word;
    if (word_a == word_b) {
      const std::size_t place_b = PlaceOf(words_b[j]);
      std::uint64_t distance = 0;
      HammingDistances(SignsAt(PlaceOf(words_a[i])), &low_[place_b], &high_[place_b], 1, &distance);
      sum += weights_[word_a] * kCubes[distance];
    }
    // Without a branch that could not be foreseen.
    i += word_a <= word_b ? 1 : 0;
    j += word_b <= word_a ? 1 : 0;
  }
  return DistanceOf(sum, a, b);
}

std::vector<float> AsmkRanking::NearnessToAll(Vertex vertex) const {
  std::vector<std::uint64_t> sums(words_.size());
  std::array<std::uint64_t, kBlock> distances;
  for (const WordOfImage& word : words_[vertex]) {
    const std::uint64_t weight = weights_[word.word];
    const Signs signs = SignsAt(PlaceOf(word));
    const std::size_t end = first_[word.word + 1];
    for (std::size_t begin = first_[word.word]; begin < end; begin += kBlock) {
      const std::size_t count = std::min(kBlock, end - begin);
      HammingDistances(signs, &low_[begin], &high_[begin], count, distances.data());
      for (std::size_t i = 0; i < count; ++i) {
        sums[vertices_[begin + i]] += weight * kCubes[distances[i]];
      }
    }
  }
  std::vector<float> nearness(words_.size());
  for (std::size_t i = 0; i < nearness.size(); ++i) {
    nearness[i] = -DistanceOf(sums[i], vertex, static_cast<Vertex>(i));
  }
  return nearness;
}

std::vector<Vertex> AsmkRanking::AllOf(Vertex vertex) const {
  const std::vector<float> nearness = NearnessToAll(vertex);
  return Nearest(nearness.data(), nearness.size(), vertex, nearness.size());
}

}  // namespace colmap_graphmatch
