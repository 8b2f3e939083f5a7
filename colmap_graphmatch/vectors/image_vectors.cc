#include "colmap_graphmatch/vectors/image_vectors.h"

#include <algorithm>
#include <future>
#include <string>
#include <system_error>
#include <utility>

#include "colmap_graphmatch/base/largest_scales.h"
#include "colmap_graphmatch/base/random.h"
#include "colmap_graphmatch/encoding/descriptor_selection.h"
#include "colmap_graphmatch/encoding/fisher_vector.h"
#include "colmap_graphmatch/encoding/gist.h"
#include "colmap_graphmatch/encoding/visual_word_encoder.h"
#include "colmap_graphmatch/encoding/vlad.h"

namespace colmap_graphmatch {
namespace {

static_assert(kDescriptorDim == 128, "encoding/descriptor_selection.h is written for SIFT");

// Images read at a time, and descriptors of them that are used (32 MB), unless one image has more.
// Twice as many are in memory.
constexpr std::size_t kImagesPerChunk = 64;
constexpr std::size_t kDescriptorsPerChunk = std::size_t{1} << 18;

// The selected descriptors of an image, one after the other.
struct SelectedDescriptors {
  std::size_t num = 0;
  std::vector<std::uint8_t> data;

  SelectedDescriptors(const Descriptors& all, const std::vector<std::size_t>& rows)
      : num(rows.size()), data(all.CopyRows(rows)) {}
  explicit SelectedDescriptors(Descriptors all) : num(all.num_rows), data(std::move(all.data)) {}
};

// On a thread of its own, or, if the system gives none, when it is asked for.
template <typename Function>
auto Start(Function function) -> std::future<decltype(function())> {
  try {
    return std::async(std::launch::async, function);
  } catch (const std::system_error&) {
    return std::async(std::launch::deferred, function);
  }
}

// Calls body(i, what select(image i) returned) for every image, in parallel, while the next images
// are read.
template <typename Select, typename Body>
void ForEachImage(const std::vector<ImageRecord>& images, ThreadPool& threads,
                  const StopRequest& stop, const Select& select, const Body& body) {
  const auto read_chunk = [&](std::size_t first) {
    std::vector<SelectedDescriptors> chunk;
    std::size_t num_descriptors = 0;
    for (std::size_t i = first; i < std::min(first + kImagesPerChunk, images.size()); ++i) {
      chunk.push_back(select(images[i]));
      num_descriptors += chunk.back().num;
      if (num_descriptors >= kDescriptorsPerChunk) break;
    }
    return chunk;
  };
  std::vector<SelectedDescriptors> chunk = read_chunk(0);
  for (std::size_t first = 0; first < images.size();) {
    stop.ThrowIfRequested();
    const std::size_t end = first + chunk.size();
    std::future<std::vector<SelectedDescriptors>> next = Start([&] { return read_chunk(end); });
    threads.ParallelFor(chunk.size(), [&](std::size_t i) { body(first + i, chunk[i]); });
    chunk = next.get();
    first = end;
  }
}

// The same number of every image's descriptors, drawn at random: num of them in all, or a few more,
// in the units that convert makes of them.
template <typename Convert>
RowMatrixXf DrawSamples(int num, std::uint64_t seed, Database& database,
                        const std::vector<ImageRecord>& images, ThreadPool& threads,
                        const StopRequest& stop, const Convert& convert) {
  const std::size_t per_image = (static_cast<std::size_t>(num) + images.size() - 1) / images.size();
  std::vector<Eigen::Index> first_rows = {0};
  for (const ImageRecord& image : images) {
    first_rows.push_back(first_rows.back() +
                         static_cast<Eigen::Index>(std::min(image.num_features, per_image)));
  }
  RowMatrixXf samples(first_rows.back(), kDescriptorDim);
  ForEachImage(
      images, threads, stop,
      [&](const ImageRecord& image) {
        const Descriptors descriptors = database.ReadDescriptors(image);
        const Random random(
            {seed, static_cast<std::uint64_t>(RandomStage::kTrainingSample), image.id});
        return SelectedDescriptors(descriptors,
                                   SelectRandom(descriptors.num_rows, per_image, random));
      },
      [&](std::size_t i, const SelectedDescriptors& selected) {
        samples.middleRows(first_rows[i], first_rows[i + 1] - first_rows[i]) =
            convert(selected.data.data(), selected.num);
      });
  return samples;
}

}  // namespace

bool HasMixture(ImageVectorOptions::Descriptor descriptor) {
  return descriptor == ImageVectorOptions::Descriptor::kFisher ||
         descriptor == ImageVectorOptions::Descriptor::kVlad;
}

VectorModelTraining LearnVectorModel(const ImageVectorOptions& options, std::uint64_t seed,
                                     Database& database, const std::vector<ImageRecord>& images,
                                     ThreadPool& threads, const StopRequest& stop) {
  VectorModelTraining training;
  if (options.descriptor == ImageVectorOptions::Descriptor::kAsmk) {
    const VocabularyOptions words;
    const RowMatrixXf samples = DrawSamples(words.num_training_descriptors, seed, database, images,
                                            threads, stop, RootSift);
    training.model.vocabulary = LearnVocabulary(words, seed, samples, threads, &stop);
    return training;
  }
  if (!HasMixture(options.descriptor)) return training;
  RowMatrixXf samples = DrawSamples(options.num_training_descriptors, seed, database, images,
                                    threads, stop, DescriptorsToFloat);
  if (options.pca_dim > 0) {
    training.model.pca = LearnPca(samples, options.pca_dim, threads);
    samples = training.model.pca.Project(samples);
  }
  GmmTraining gmm = TrainGmm(options.gmm, seed, samples, threads, &stop);
  training.model.mixture = std::move(gmm.mixture);
  training.num_iterations = gmm.log_likelihoods.size();
  training.converged = gmm.converged;
  return training;
}

std::size_t VectorDim(const ImageVectorOptions& options, const VectorModel& model) {
  const auto means = static_cast<std::size_t>(model.mixture.means.size());
  switch (options.descriptor) {
    case ImageVectorOptions::Descriptor::kFisher:
      return 2 * means;
    case ImageVectorOptions::Descriptor::kVlad:
      return means;
    case ImageVectorOptions::Descriptor::kGist:
      return kGistDim;
    case ImageVectorOptions::Descriptor::kFile:
    case ImageVectorOptions::Descriptor::kAsmk:
      break;
  }
  return 0;
}

std::vector<float> EncodeImages(const ImageVectorOptions& options, const VectorModel& model,
                                Database& database, const std::vector<ImageRecord>& images,
                                ThreadPool& threads, const StopRequest& stop) {
  const std::size_t dim = VectorDim(options, model);
  std::vector<float> vectors(images.size() * dim);
  const auto store = [&](std::size_t i, const Eigen::VectorXf& vector) {
    std::copy(vector.begin(), vector.end(), vectors.begin() + static_cast<std::ptrdiff_t>(i * dim));
  };
  if (options.descriptor == ImageVectorOptions::Descriptor::kGist) {
    threads.ParallelFor(images.size(), [&](std::size_t i) {
      stop.ThrowIfRequested();
      store(i, EncodeGistFile(options.image_path, images[i].name));
    });
    return vectors;
  }

  const auto max_num_features = static_cast<std::size_t>(options.max_num_features);
  const auto select = [&](const ImageRecord& image) {
    const Descriptors descriptors = database.ReadDescriptors(image);
    const std::vector<float> scales = database.ReadKeypoints(image.id).Scales(descriptors.num_rows);
    return SelectedDescriptors(descriptors, SelectLargestScales(scales, max_num_features));
  };
  const auto encode_with = [&](const auto& encoder) {
    ForEachImage(
        images, threads, stop, select, [&](std::size_t i, const SelectedDescriptors& selected) {
          const RowMatrixXf descriptors = DescriptorsToFloat(selected.data.data(), selected.num);
          store(i, model.pca.mean.size() > 0 ? encoder.Encode(model.pca.Project(descriptors))
                                             : encoder.Encode(descriptors));
        });
  };
  if (options.descriptor == ImageVectorOptions::Descriptor::kVlad) {
    encode_with(VladEncoder(model.mixture));
  } else {
    encode_with(FisherVectorEncoder(model.mixture));
  }
  return vectors;
}

std::vector<VisualWords> EncodeImagesAsWords(const VectorModel& model, Database& database,
                                             const std::vector<ImageRecord>& images,
                                             ThreadPool& threads, const StopRequest& stop) {
  const VisualWordEncoder encoder(model.vocabulary);
  std::vector<VisualWords> words(images.size());
  ForEachImage(
      images, threads, stop,
      [&](const ImageRecord& image) {
        return SelectedDescriptors(database.ReadDescriptors(image));
      },
      [&](std::size_t i, const SelectedDescriptors& selected) {
        words[i] = encoder.Encode(RootSift(selected.data.data(), selected.num));
      });
  return words;
}

}  // namespace colmap_graphmatch
