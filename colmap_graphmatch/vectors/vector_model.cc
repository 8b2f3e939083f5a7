#include "colmap_graphmatch/vectors/vector_model.h"

#include <array>
#include <cstdint>
#include <cstring>
#include <utility>

#include "colmap_graphmatch/base/types.h"
#include "colmap_graphmatch/vectors/asmk_blobs.h"

namespace colmap_graphmatch {
namespace {

// K, D and the dimension of the PCA's input, 0 without one.
using Header = std::array<std::int64_t, 3>;

// The matrices in their order in the blob.
template <typename Model, typename Visit>
void ForEachMatrix(Model& model, const Visit& visit) {
  visit(model.mixture.weights);
  visit(model.mixture.means);
  visit(model.mixture.variances);
  visit(model.pca.mean);
  visit(model.pca.basis);
}

std::size_t SizeInBytes(const VectorModel& model) {
  std::size_t size = sizeof(Header);
  ForEachMatrix(model, [&size](const auto& matrix) {
    size += static_cast<std::size_t>(matrix.size()) * sizeof(double);
  });
  return size;
}

}  // namespace

sqlite::Blob Serialize(const VectorModel& model) {
  if (model.vocabulary.words.rows() > 0) return Serialize(model.vocabulary);
  const Header header = {model.mixture.NumComponents(), model.mixture.Dim(), model.pca.mean.size()};
  sqlite::Blob blob(SizeInBytes(model));
  std::uint8_t* target = blob.data();
  const auto put = [&target](const void* data, std::size_t size) {
    if (size > 0) std::memcpy(target, data, size);
    target += size;
  };
  put(header.data(), sizeof(header));
  ForEachMatrix(model, [&put](const auto& matrix) {
    put(matrix.data(), static_cast<std::size_t>(matrix.size()) * sizeof(double));
  });
  return blob;
}

std::optional<VectorModel> Deserialize(const sqlite::Blob& blob, const VectorModelShape& shape) {
  if (shape.is_vocabulary) {
    std::optional<Vocabulary> vocabulary = DeserializeVocabulary(blob, VocabularyOptions());
    if (!vocabulary) return std::nullopt;
    return VectorModel{{}, {}, std::move(*vocabulary)};
  }
  Header header = {};
  if (blob.size() < sizeof(header)) return std::nullopt;
  std::memcpy(header.data(), blob.data(), sizeof(header));
  const auto [num_components, dim, pca_input] = header;
  const std::int64_t expected_dim = shape.max_num_components == 0 ? 0
                                    : shape.pca_dim > 0           ? shape.pca_dim
                                                                  : kDescriptorDim;
  const bool has_components = num_components >= 1 && num_components <= shape.max_num_components;
  if ((shape.max_num_components == 0 ? num_components != 0 : !has_components) ||
      dim != expected_dim || pca_input != (shape.pca_dim > 0 ? kDescriptorDim : 0)) {
    return std::nullopt;
  }
  VectorModel model;
  model.mixture.weights.resize(num_components);
  model.mixture.means.resize(num_components, dim);
  model.mixture.variances.resize(num_components, dim);
  if (pca_input > 0) {
    model.pca.mean.resize(pca_input);
    model.pca.basis.resize(dim, pca_input);
  }
  if (blob.size() != SizeInBytes(model)) return std::nullopt;
  const std::uint8_t* source = blob.data() + sizeof(header);
  bool is_finite = true;
  ForEachMatrix(model, [&](auto& matrix) {
    const std::size_t size = static_cast<std::size_t>(matrix.size()) * sizeof(double);
    if (size > 0) std::memcpy(matrix.data(), source, size);
    source += size;
    is_finite = is_finite && matrix.allFinite();
  });
  const GaussianMixture& mixture = model.mixture;
  const bool is_model =
      is_finite && (mixture.weights.array() > 0).all() && (mixture.variances.array() > 0).all();
  return is_model ? std::optional<VectorModel>(std::move(model)) : std::nullopt;
}

}  // namespace colmap_graphmatch
