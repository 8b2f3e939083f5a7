#include "colmap_graphmatch/vectors/asmk_blobs.h"

#include <array>
#include <cstring>
#include <utility>

#include "colmap_graphmatch/base/types.h"

namespace colmap_graphmatch {
namespace {

// C and W.
using VocabularyHeader = std::array<std::int64_t, 2>;

// first_words, cells and words, in their order in the blob.
template <typename AnyVocabulary, typename Visit>
void ForEachArray(AnyVocabulary& vocabulary, const Visit& visit) {
  visit(vocabulary.first_words.data(), vocabulary.first_words.size() * sizeof(std::uint32_t));
  visit(vocabulary.cells.data(), static_cast<std::size_t>(vocabulary.cells.size()) * sizeof(float));
  visit(vocabulary.words.data(), static_cast<std::size_t>(vocabulary.words.size()) * sizeof(float));
}

std::size_t VocabularySize(const Vocabulary& vocabulary) {
  std::size_t size = sizeof(VocabularyHeader);
  ForEachArray(vocabulary, [&size](const void*, std::size_t bytes) { size += bytes; });
  return size;
}

bool IsVocabulary(const Vocabulary& vocabulary) {
  const std::vector<std::uint32_t>& first = vocabulary.first_words;
  if (first.front() != 0 || first.back() != vocabulary.words.rows()) return false;
  for (std::size_t cell = 0; cell + 1 < first.size(); ++cell) {
    if (first[cell + 1] <= first[cell]) return false;
  }
  return vocabulary.cells.allFinite() && vocabulary.words.allFinite();
}

constexpr std::size_t kBytesPerWord = sizeof(std::uint32_t) + sizeof(Signs);

}  // namespace

sqlite::Blob Serialize(const Vocabulary& vocabulary) {
  const VocabularyHeader header = {vocabulary.cells.rows(), vocabulary.words.rows()};
  sqlite::Blob blob(VocabularySize(vocabulary));
  std::uint8_t* target = blob.data();
  const auto put = [&target](const void* data, std::size_t size) {
    std::memcpy(target, data, size);
    target += size;
  };
  put(header.data(), sizeof(header));
  ForEachArray(vocabulary, put);
  return blob;
}

std::optional<Vocabulary> DeserializeVocabulary(const sqlite::Blob& blob,
                                                const VocabularyOptions& options) {
  VocabularyHeader header = {};
  if (blob.size() < sizeof(header)) return std::nullopt;
  std::memcpy(header.data(), blob.data(), sizeof(header));
  const auto [num_cells, num_words] = header;
  if (num_cells < 1 || num_cells > options.num_cells || num_words < num_cells ||
      num_words > num_cells * options.num_words_per_cell) {
    return std::nullopt;
  }
  Vocabulary vocabulary;
  vocabulary.first_words.resize(static_cast<std::size_t>(num_cells) + 1);
  vocabulary.cells.resize(num_cells, kDescriptorDim);
  vocabulary.words.resize(num_words, kDescriptorDim);
  if (blob.size() != VocabularySize(vocabulary)) return std::nullopt;
  const std::uint8_t* source = blob.data() + sizeof(header);
  ForEachArray(vocabulary, [&source](void* data, std::size_t size) {
    std::memcpy(data, source, size);
    source += size;
  });
  if (!IsVocabulary(vocabulary)) return std::nullopt;
  return vocabulary;
}

sqlite::Blob Serialize(const VisualWords& words) {
  sqlite::Blob blob(words.words.size() * kBytesPerWord);
  if (blob.empty()) return blob;
  const std::size_t size_of_numbers = words.words.size() * sizeof(std::uint32_t);
  std::memcpy(blob.data(), words.words.data(), size_of_numbers);
  std::memcpy(blob.data() + size_of_numbers, words.signs.data(), blob.size() - size_of_numbers);
  return blob;
}

std::optional<VisualWords> DeserializeWords(const std::uint8_t* data, std::size_t size,
                                            std::size_t num_words) {
  if (size == 0 || size % kBytesPerWord != 0) return std::nullopt;
  VisualWords words;
  words.words.resize(size / kBytesPerWord);
  words.signs.resize(words.words.size());
  const std::size_t size_of_numbers = words.words.size() * sizeof(std::uint32_t);
  std::memcpy(words.words.data(), data, size_of_numbers);
  std::memcpy(words.signs.data(), data + size_of_numbers, size - size_of_numbers);
  for (std::size_t i = 0; i < words.words.size(); ++i) {
    const bool ascends = i == 0 || words.words[i - 1] < words.words[i];
    if (!ascends || words.words[i] >= num_words) return std::nullopt;
  }
  return words;
}

}  // namespace colmap_graphmatch
