#pragma once

#include <cstdint>
#include <filesystem>
#include <string>

#include "colmap_graphmatch/base/enum_words.h"
#include "colmap_graphmatch/encoding/gmm_options.h"

namespace colmap_graphmatch {

struct ImageVectorOptions {
  // kAsmk: visual words of all features, compared by an aggregated selective match kernel. kFisher:
  // Fisher vectors of the features of largest scale, as in the paper. For comparison kVlad: VLAD
  // under the same mixture, kGist: GIST of the photos, kFile: vectors that another program made.
  // (State files have the numbers.)
  enum class Descriptor { kFisher, kVlad, kGist, kFile, kAsmk };
  Descriptor descriptor = Descriptor::kAsmk;

  // Where the photos are, for kGist.
  std::filesystem::path image_path;

  // Where the vectors are, for kFile: a NumPy file (.npy) of a row for each image, with the images'
  // names in the file of the same name with .txt, one a line.
  std::filesystem::path vectors_path;

  // PCA of the features to so many dimensions before the mixture, at most 128; 0: none. The paper
  // has none, and 16 components: with as many entries a vector, 64 components in 32 dimensions find
  // more edges in as many tests (docs/evaluation.md).
  int pca_dim = 32;

  GmmOptions gmm;

  // Descriptors that the mixture is learnt from, the same number from every image (at least one,
  // all if it has fewer), drawn at random. More cost proportionally more time and 512 bytes each.
  int num_training_descriptors = 100000;

  // Descriptors an image that are encoded at most: those of the largest scales. Paper: 1,000.
  int max_num_features = 1000;

  // Names the seed and the values of all fields that have a say, but the paths: their contents
  // count, not where they are. The state files of users keep mixture and vectors under it, and
  // under another key all are made anew. So a new field is written only where it differs from its
  // default: what earlier versions wrote stays valid.
  std::string Key(std::uint64_t seed) const;

  // Throws OptionsError.
  void Check() const;
};

inline constexpr EnumWords<ImageVectorOptions::Descriptor, 5> kDescriptorWords = {
    {{ImageVectorOptions::Descriptor::kAsmk, "asmk"},
     {ImageVectorOptions::Descriptor::kFisher, "fisher"},
     {ImageVectorOptions::Descriptor::kVlad, "vlad"},
     {ImageVectorOptions::Descriptor::kGist, "gist"},
     {ImageVectorOptions::Descriptor::kFile, "file"}}};

// For messages, e.g. "Fisher vectors".
const char* NameOfVectors(ImageVectorOptions::Descriptor descriptor);

// What they are made with, for messages: "mixture" or "vocabulary".
const char* NameOfModel(ImageVectorOptions::Descriptor descriptor);

struct ImageRankingOptions {
  ImageVectorOptions vectors;

  // Writes the vectors that are made to this file, which vectors_path can name, unless it is empty.
  std::filesystem::path export_path;

  // Takes the ranked lists from this file (docs/formats.md) instead of making vectors, unless it
  // is empty.
  std::filesystem::path ranking_path;

  // Throws OptionsError.
  void Check() const;
};

}  // namespace colmap_graphmatch
