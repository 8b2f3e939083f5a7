#include "colmap_graphmatch/graph/image_priors.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "colmap_graphmatch/base/random.h"

namespace colmap_graphmatch {
namespace {

using ::testing::ElementsAre;
using ::testing::Eq;
using ::testing::IsEmpty;

using System = PositionPrior::System;

std::vector<ImageRecord> Images(const std::vector<std::string>& names) {
  std::vector<ImageRecord> images;
  for (const std::string& name : names) {
    images.push_back({static_cast<ImageId>(10 + images.size()), name, 1, 1});
  }
  return images;
}

// By vertex, of images whose names are no sequence.
ImagePriors PriorsAt(const std::vector<PositionPrior>& positions) {
  std::vector<std::string> names;
  std::map<ImageId, PositionPrior> by_id;
  for (std::size_t i = 0; i < positions.size(); ++i) {
    names.emplace_back(i + 1, 'x');
    by_id[static_cast<ImageId>(10 + i)] = positions[i];
  }
  ThreadPool threads(2);
  return ImagePriors(Images(names), by_id, threads);
}

PositionPrior Geographic(double latitude, double longitude, double altitude = 0) {
  return {System::kGeographic, {latitude, longitude, altitude}};
}

PositionPrior Cartesian(double x) { return {System::kCartesian, {x, 0, 0}}; }

TEST(ImagePriors, KnowNothingOfImagesWithoutPositionsAndNumbers) {
  EXPECT_THAT(ImagePriors().Of(0, 1), ElementsAre(0, 0, 0, 0));
  EXPECT_THAT(ImagePriors().Near(0), ElementsAre(IsEmpty(), IsEmpty()));
  ThreadPool threads(1);
  const ImagePriors none(Images({"a.jpg", "b.jpg", "c.jpg"}), {}, threads);
  EXPECT_THAT(none.Of(0, 1), ElementsAre(0, 0, 0, 0));
  EXPECT_THAT(none.Near(0), ElementsAre(IsEmpty(), IsEmpty()));
}

TEST(ImagePriors, DistancesAreThoseOnTheEarth) {
  // A degree of latitude is 110.6 km at the equator and 111.7 km at the poles; of longitude 111.3
  // km at the equator and half of that at 60 degrees. Altitudes do not count.
  const double meter = 1 / 111320.0;
  const ImagePriors priors =
      PriorsAt({Geographic(60, 10, 3000), Geographic(60, 10 + 200 * meter),
                Geographic(60, 10 + 400 * meter), Geographic(60, 10 - 100 * meter)});
  // 100, 200 and 50 m. The farthest is what is usual: with so few none is the fifth.
  const auto cues = priors.Of(0, 1);
  EXPECT_EQ(cues[0], 1);
  const double usual = std::sqrt(200.0 * 150.0);
  EXPECT_NEAR(cues[1], std::log1p(100 / usual), 0.01);
  EXPECT_THAT(priors.Of(1, 0), Eq(cues));
  EXPECT_GT(priors.Of(0, 2)[1], cues[1]);
  EXPECT_LT(priors.Of(0, 3)[1], cues[1]);
  EXPECT_THAT(priors.Near(0)[1], ElementsAre(3, 1, 2));
}

TEST(ImagePriors, DistancesWithinTheAccuracySayLittle) {
  const auto cue = [](double accuracy) {
    PositionPrior a = Cartesian(0);
    PositionPrior b = Cartesian(10);
    a.accuracy = b.accuracy = accuracy;
    return PriorsAt({a, b, Cartesian(5)}).Of(0, 1)[1];
  };
  EXPECT_DOUBLE_EQ(cue(0), std::log1p(1));
  EXPECT_DOUBLE_EQ(cue(40), std::log1p(10.0 / 40));
}

TEST(ImagePriors, PositionsThatAreNoneCountForNothing) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const double infinity = std::numeric_limits<double>::infinity();
  const ImagePriors priors =
      PriorsAt({Geographic(1, 1), Geographic(0, 0, 5), Geographic(nan, 1), Geographic(91, 1),
                Cartesian(infinity), Cartesian(1), Geographic(1, 1.1)});
  for (Vertex vertex = 1; vertex < 6; ++vertex) {
    EXPECT_THAT(priors.Of(0, vertex), ElementsAre(0, 0, 0, 0)) << vertex;
  }
  EXPECT_EQ(priors.Of(0, 6)[0], 1);
  EXPECT_THAT(priors.Near(0)[1], ElementsAre(6));
}

TEST(ImagePriors, ImagesAtOnePlaceAndFarAwayHaveNumbers) {
  const ImagePriors priors = PriorsAt({Cartesian(0), Cartesian(0), Cartesian(0), Cartesian(0),
                                       Cartesian(0), Cartesian(0), Cartesian(1e300)});
  for (Vertex a = 0; a < 7; ++a) {
    for (Vertex b = 0; b < 7; ++b) {
      if (a != b) {
        EXPECT_TRUE(std::isfinite(priors.Of(a, b)[1]));
      }
    }
  }
  EXPECT_LT(priors.Of(0, 1)[1], priors.Of(0, 6)[1]);
}

TEST(ImagePriors, TheNearestAreThoseOfTheDefinition) {
  Random random({6});
  std::vector<PositionPrior> positions(200);
  for (PositionPrior& prior : positions) {
    prior = Cartesian(random.Uniform());
    prior.position[1] = random.Uniform();
    prior.position[2] = random.Uniform();
  }
  const ImagePriors priors = PriorsAt(positions);
  for (std::size_t i = 0; i < positions.size(); ++i) {
    std::vector<std::pair<double, Vertex>> others;
    for (std::size_t j = 0; j < positions.size(); ++j) {
      const auto& a = positions[i].position;
      const auto& b = positions[j].position;
      if (j != i) others.emplace_back(std::hypot(a[0] - b[0], a[1] - b[1], a[2] - b[2]), j);
    }
    std::sort(others.begin(), others.end());
    std::vector<Vertex> nearest;
    for (std::size_t k = 0; k < 8; ++k) nearest.push_back(others[k].second);
    EXPECT_EQ(priors.Near(static_cast<Vertex>(i))[1], nearest) << i;
  }
}

// Where many images are at one point, the others are nearer and farther still.
TEST(ImagePriors, ACameraThatStandsKeepsDistances) {
  std::vector<PositionPrior> positions(10, Cartesian(0));
  for (int i = 1; i <= 20; ++i) positions.push_back(Cartesian(100 * i));
  // Those without a position, and GPS, have no say.
  positions.insert(positions.end(), 50, Cartesian(std::numeric_limits<double>::quiet_NaN()));
  for (int i = 0; i < 50; ++i) positions.push_back(Geographic(48 + i * 1e-6, 11));
  const ImagePriors priors = PriorsAt(positions);
  EXPECT_EQ(priors.Of(0, 1)[1], 0);
  EXPECT_LT(priors.Of(0, 10)[1], 0.5);
  EXPECT_GT(priors.Of(0, 29)[1], 3 * priors.Of(0, 10)[1]);
  EXPECT_THAT(priors.Near(20)[1], ::testing::UnorderedElementsAre(16, 17, 18, 19, 21, 22, 23, 24));
}

TEST(ImagePriors, SequencesAreNamesThatDifferInTheirLastNumber) {
  ThreadPool threads(1);
  const ImagePriors priors(
      Images({"a/frame 9.jpg", "a/frame 100.jpg", "a/frame 010.jpg", "b/frame 9.jpg",
              "b/frame 10.jpg", "IMG_1_x.jp2", "IMG_2_x.jp2", "IMG_3_x.jp2", "7/a.jpg", "8/a.jpg",
              "9/a.jpg", "99999999999999999999999.png"}),
      {}, threads);
  EXPECT_THAT(priors.Of(0, 2), ElementsAre(0, 0, 1, 1));
  EXPECT_THAT(priors.Of(0, 1), ElementsAre(0, 0, 1, 0.5));  // Numbers may have gaps.
  EXPECT_THAT(priors.Of(0, 3), ElementsAre(0, 0, 0, 0));
  EXPECT_THAT(priors.Of(3, 4), ElementsAre(0, 0, 0, 0));  // Two are none.
  EXPECT_THAT(priors.Of(5, 7), ElementsAre(0, 0, 1, 0.5));
  EXPECT_THAT(priors.Of(8, 9), ElementsAre(0, 0, 0, 0));  // Directories are not counted.
  EXPECT_THAT(priors.Near(2)[0], ElementsAre(1, 0));
}

}  // namespace
}  // namespace colmap_graphmatch
