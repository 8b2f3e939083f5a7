#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>

#include "colmap_graphmatch/base/visual_words.h"
#include "colmap_graphmatch/database/sqlite.h"
#include "colmap_graphmatch/encoding/vocabulary.h"

// The bytes that are kept for the next run (docs/formats.md). What reads them gives nothing for
// bytes that cannot be what is asked for.

namespace colmap_graphmatch {

sqlite::Blob Serialize(const Vocabulary& vocabulary);
// Of SIFT descriptors, with no more cells and words than the options say.
std::optional<Vocabulary> DeserializeVocabulary(const sqlite::Blob& blob,
                                                const VocabularyOptions& options);

sqlite::Blob Serialize(const VisualWords& words);
// At least one, and all below num_words.
std::optional<VisualWords> DeserializeWords(const std::uint8_t* data, std::size_t size,
                                            std::size_t num_words);

}  // namespace colmap_graphmatch
