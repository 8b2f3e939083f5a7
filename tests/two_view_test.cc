#include "colmap_graphmatch/geometry/two_view.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <hwy/targets.h>

#include <Eigen/LU>
#include <limits>

#include "colmap_graphmatch/geometry/inliers.h"
#include "colmap_graphmatch/geometry/watermark.h"
#include "tests/support/synthetic_views.h"

namespace colmap_graphmatch {
namespace {

using Configuration = TwoViewConfiguration;
using ::testing::Each;
using ::testing::Lt;

struct CalibratedRow {
  std::size_t f, e, h;
  Configuration configuration;
  InlierSource inliers;
};

TEST(Configuration, CalibratedIsColmapsTable) {
  constexpr Configuration kDegenerate = Configuration::kDegenerate;
  constexpr Configuration kCalibrated = Configuration::kCalibrated;
  constexpr Configuration kUncalibrated = Configuration::kUncalibrated;
  constexpr Configuration kPlanar = Configuration::kPlanarOrPanoramic;
  constexpr InlierSource kNone = InlierSource::kNone;
  constexpr InlierSource kF = InlierSource::kFundamental;
  constexpr InlierSource kE = InlierSource::kEssential;
  constexpr InlierSource kH = InlierSource::kHomography;
  const CalibratedRow rows[] = {
      {0, 0, 0, kDegenerate, kNone},
      {14, 14, 14, kDegenerate, kNone},
      {15, 15, 0, kCalibrated, kE},
      {100, 96, 50, kCalibrated, kF},    // E is believed; F fits more.
      {100, 95, 50, kUncalibrated, kF},  // Not more than 0.95.
      {100, 120, 50, kCalibrated, kE},
      {100, 100, 80, kCalibrated, kE},  // Not more than 0.8.
      {100, 100, 81, kPlanar, kE},
      {100, 100, 101, kPlanar, kH},
      {100, 100, 100, kPlanar, kE},
      {100, 50, 80, kUncalibrated, kF},
      {100, 50, 81, kPlanar, kF},
      {100, 50, 101, kPlanar, kH},
      {14, 14, 15, kPlanar, kH},
      {0, 0, 15, kPlanar, kH},
      {14, 15, 0, kCalibrated, kE},
      {0, 15, 0, kCalibrated, kE},
      {15, 14, 0, kUncalibrated, kF},
      {16, 15, 0, kUncalibrated, kF},
      {15, 0, 0, kUncalibrated, kF},
      {30, 0, 14, kUncalibrated, kF},
  };
  for (const CalibratedRow& row : rows) {
    const ConfigurationChoice choice = ChooseCalibrated(row.f, row.e, row.h, 15);
    EXPECT_EQ(choice.configuration, row.configuration) << row.f << ' ' << row.e << ' ' << row.h;
    EXPECT_EQ(choice.inliers, row.inliers) << row.f << ' ' << row.e << ' ' << row.h;
  }
}

TEST(Configuration, UncalibratedIsColmapsTable) {
  const struct {
    std::size_t f, h;
    Configuration configuration;
    InlierSource inliers;
  } rows[] = {
      {0, 0, Configuration::kDegenerate, InlierSource::kNone},
      {14, 14, Configuration::kDegenerate, InlierSource::kNone},
      {15, 0, Configuration::kUncalibrated, InlierSource::kFundamental},
      {15, 12, Configuration::kUncalibrated, InlierSource::kFundamental},
      {15, 13, Configuration::kPlanarOrPanoramic, InlierSource::kFundamental},
      {100, 80, Configuration::kUncalibrated, InlierSource::kFundamental},
      {100, 81, Configuration::kPlanarOrPanoramic, InlierSource::kFundamental},
      {100, 100, Configuration::kPlanarOrPanoramic, InlierSource::kHomography},
      {14, 15, Configuration::kPlanarOrPanoramic, InlierSource::kHomography},
      {0, 15, Configuration::kPlanarOrPanoramic, InlierSource::kHomography},
  };
  for (const auto& row : rows) {
    const ConfigurationChoice choice = ChooseUncalibrated(row.f, row.h, 15);
    EXPECT_EQ(choice.configuration, row.configuration) << row.f << ' ' << row.h;
    EXPECT_EQ(choice.inliers, row.inliers) << row.f << ' ' << row.h;
  }
  // COLMAP allows min_num_inliers 0.
  EXPECT_EQ(ChooseUncalibrated(0, 0, 0).configuration, Configuration::kDegenerate);
  EXPECT_EQ(ChooseCalibrated(0, 0, 0, 0).configuration, Configuration::kDegenerate);
}

Camera SyntheticCamera(bool has_prior_focal_length) {
  Camera camera;
  camera.model_id = 0;
  camera.width = static_cast<std::uint64_t>(SyntheticViews::kWidth);
  camera.height = static_cast<std::uint64_t>(SyntheticViews::kHeight);
  camera.params = {SyntheticViews::kFocalLength, SyntheticViews::kWidth / 2,
                   SyntheticViews::kHeight / 2};
  camera.has_prior_focal_length = has_prior_focal_length;
  return camera;
}

TwoViewVerdict Verify(const std::vector<PointPair>& matches, bool is_calibrated,
                      const TwoViewOptions& options = {}, ImagePair pair = {1, 2},
                      const std::vector<float>& promise = {}) {
  const Camera camera = SyntheticCamera(is_calibrated);
  return VerifyTwoViews({pair, camera, camera, matches, promise}, options);
}

TEST(TwoViews, ScenesGetTheirConfigurations) {
  for (std::uint64_t seed = 0; seed < 5; ++seed) {
    for (const double outliers : {0.0, 0.3, 0.6}) {
      const auto configuration = [&](SyntheticScene scene, bool is_calibrated) {
        return Verify(SyntheticViews(scene, 150, 0.5, outliers, seed).pairs, is_calibrated)
            .configuration;
      };
      for (const SyntheticScene scene :
           {SyntheticScene::kGeneral, SyntheticScene::kForward, SyntheticScene::kTranslation}) {
        EXPECT_EQ(configuration(scene, true), Configuration::kCalibrated);
        EXPECT_EQ(configuration(scene, false), Configuration::kUncalibrated);
      }
      for (const SyntheticScene scene : {SyntheticScene::kPlane, SyntheticScene::kRotation}) {
        EXPECT_EQ(configuration(scene, true), Configuration::kPlanarOrPanoramic);
        EXPECT_EQ(configuration(scene, false), Configuration::kPlanarOrPanoramic);
      }
    }
  }
}

TEST(TwoViews, InliersAreThoseThatWereMadeSo) {
  const SyntheticViews views(SyntheticScene::kGeneral, 200, 0.5, 0.4, 3);
  for (const bool is_calibrated : {false, true}) {
    const TwoViewVerdict geometry = Verify(views.pairs, is_calibrated);
    std::size_t num_true = 0;
    for (const std::size_t i : geometry.inliers) num_true += i < views.num_inliers ? 1 : 0;
    EXPECT_GE(num_true + 1, views.num_inliers);
    EXPECT_LE(geometry.inliers.size(), num_true + 8);  // Outliers may lie on their line.
    EXPECT_TRUE(std::is_sorted(geometry.inliers.begin(), geometry.inliers.end()));
    ASSERT_TRUE(geometry.fundamental && geometry.homography);
    EXPECT_EQ(geometry.essential.has_value(), is_calibrated);
  }
}

TEST(TwoViews, ThePoseIsTheOneThatTheViewsWereMadeWith) {
  TwoViewOptions options;
  options.compute_relative_pose = true;
  for (std::uint64_t seed = 0; seed < 10; ++seed) {
    for (const SyntheticScene scene : {SyntheticScene::kGeneral, SyntheticScene::kForward}) {
      const SyntheticViews views(scene, 200, 0.3, 0.3, seed);
      const TwoViewVerdict geometry = Verify(views.pairs, true, options);
      ASSERT_EQ(geometry.configuration, Configuration::kCalibrated);
      ASSERT_TRUE(geometry.pose);
      EXPECT_LT((geometry.pose->rotation - views.rotation).norm(), 0.02);
      EXPECT_LT((geometry.pose->translation - views.translation.normalized()).norm(), 0.1);
      const Eigen::Vector4d q = geometry.pose->Quaternion();
      EXPECT_NEAR(q.norm(), 1, 1e-12);
      const Eigen::Quaterniond again(q(0), q(1), q(2), q(3));
      EXPECT_LT((again.toRotationMatrix() - geometry.pose->rotation).norm(), 1e-9);
    }
  }
}

TEST(TwoViews, FewOrHostileMatchesAreDegenerate) {
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
  const SyntheticViews views(SyntheticScene::kGeneral, 40, 0.5, 0, 1);
  EXPECT_EQ(Verify({}, true).configuration, Configuration::kDegenerate);
  const std::vector<PointPair> few(views.pairs.begin(), views.pairs.begin() + 14);
  EXPECT_EQ(Verify(few, true).configuration, Configuration::kDegenerate);
  EXPECT_EQ(Verify(std::vector<PointPair>(50, {kNan, 1, 2, 3}), true).configuration,
            Configuration::kDegenerate);
  for (const bool is_calibrated : {false, true}) {
    Verify(std::vector<PointPair>(50, {1, 2, 3, 4}), is_calibrated);
    std::vector<PointPair> mixed = views.pairs;
    for (std::size_t i = 0; i < 40; ++i) {
      mixed.push_back(
          {i % 2 == 0 ? kNan : 1e300, -1e18, std::numeric_limits<double>::infinity(), 0});
    }
    const TwoViewVerdict geometry = Verify(mixed, is_calibrated);
    EXPECT_GE(geometry.inliers.size(), 38U);
    EXPECT_THAT(geometry.inliers, Each(Lt(40U)));
  }
  const SyntheticViews noise(SyntheticScene::kGeneral, 60, 0, 1, 1);
  EXPECT_EQ(Verify(noise.pairs, true).configuration, Configuration::kDegenerate);
}

TEST(TwoViews, UnusableCamerasCountAsUncalibrated) {
  const SyntheticViews views(SyntheticScene::kGeneral, 60, 0.5, 0, 1);
  Camera camera = SyntheticCamera(true);
  camera.params[0] = 0;
  const TwoViewVerdict geometry =
      VerifyTwoViews({{1, 2}, camera, camera, views.pairs, {}}, TwoViewOptions());
  EXPECT_EQ(geometry.configuration, Configuration::kUncalibrated);
}

bool IsSame(const TwoViewVerdict& a, const TwoViewVerdict& b) {
  return a.configuration == b.configuration && a.inliers == b.inliers &&
         a.fundamental == b.fundamental && a.essential == b.essential &&
         a.homography == b.homography && a.trials.fundamental == b.trials.fundamental &&
         a.trials.essential == b.trials.essential && a.trials.homography == b.trials.homography;
}

TEST(TwoViews, TheResultDependsOnThePairAlone) {
  const SyntheticViews views(SyntheticScene::kGeneral, 150, 1, 0.6, 7);
  const TwoViewVerdict geometry = Verify(views.pairs, true, {}, {3, 4});
  Verify(views.pairs, true, {}, {5, 6});
  EXPECT_TRUE(IsSame(geometry, Verify(views.pairs, true, {}, {4, 3})));
}

// With every instruction set of this processor, to the last bit.
TEST(TwoViews, TheResultDoesNotDependOnTheInstructionSet) {
  std::vector<TwoViewVerdict> expected;
  const auto verify_all = [] {
    std::vector<TwoViewVerdict> geometries;
    for (std::uint64_t seed = 0; seed < 6; ++seed) {
      const auto scene = seed % 2 == 0 ? SyntheticScene::kGeneral : SyntheticScene::kPlane;
      const SyntheticViews views(scene, 40 + 37 * seed, 1, 0.5, seed);
      geometries.push_back(Verify(views.pairs, seed % 3 != 0));
    }
    return geometries;
  };
  int num_targets = 0;
  for (const std::int64_t target : hwy::SupportedAndGeneratedTargets()) {
    hwy::SetSupportedTargetsForTest(target);
    const std::vector<TwoViewVerdict> geometries = verify_all();
    hwy::SetSupportedTargetsForTest(0);
    if (expected.empty()) expected = geometries;
    for (std::size_t i = 0; i < geometries.size(); ++i) {
      EXPECT_TRUE(IsSame(geometries[i], expected[i])) << hwy::TargetName(target) << ' ' << i;
    }
    ++num_targets;
  }
  EXPECT_GE(num_targets, 1);
}

TEST(TwoViews, APromiseChangesTheSearchAndNotWhatCounts) {
  const SyntheticViews views(SyntheticScene::kGeneral, 300, 0.5, 0.7, 2);
  std::vector<float> promise(views.pairs.size(), 0);
  for (std::size_t i = 0; i < views.num_inliers; ++i) promise[i] = 1;
  promise.back() = std::numeric_limits<float>::quiet_NaN();
  const TwoViewVerdict geometry = Verify(views.pairs, false, {}, {1, 2}, promise);
  EXPECT_GE(geometry.inliers.size() + 2, views.num_inliers);
  EXPECT_EQ(geometry.inliers,
            FindInliers(ErrorKind::kEpipolar, *geometry.fundamental, views.pairs, 4));
}

TEST(TwoViews, AScreenKeepsTheInliersAndFewOthers) {
  const SyntheticViews views(SyntheticScene::kGeneral, 300, 1, 0.5, 4);
  const Camera camera = SyntheticCamera(true);
  const ScreenedTwoViews screened =
      ScreenTwoViews({{1, 2}, camera, camera, views.pairs, {}}, TwoViewOptions());
  EXPECT_GE(screened.num_inliers + 2, views.num_inliers);
  ASSERT_EQ(screened.errors.size(), views.pairs.size());
  std::size_t num_true = 0;
  std::size_t num_others = 0;
  for (std::size_t i = 0; i < screened.errors.size(); ++i) {
    if (screened.errors[i] <= 1.5) ++(i < views.num_inliers ? num_true : num_others);
  }
  EXPECT_GE(num_true + 1, views.num_inliers);
  EXPECT_LE(num_others, 25U);
}

TEST(TwoViews, WhereThereIsNoModelEveryErrorIsInfinite) {
  const Camera camera = SyntheticCamera(true);
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const std::vector<PointPair> nowhere(20, PointPair{nan, nan, 7, 7});
  const ScreenedTwoViews screened =
      ScreenTwoViews({{1, 2}, camera, camera, nowhere, {}}, TwoViewOptions());
  EXPECT_EQ(screened.num_inliers, 0U);
  EXPECT_THAT(screened.errors, Each(std::numeric_limits<double>::infinity()));
}

TEST(Watermark, MarksOfBothImagesAreOne) {
  const Camera camera = SyntheticCamera(false);
  const auto is_watermark = [&](const std::vector<PointPair>& matches) {
    std::vector<std::size_t> inliers(matches.size());
    for (std::size_t i = 0; i < inliers.size(); ++i) inliers[i] = i;
    return IsWatermark(camera, camera, matches, inliers, 4);
  };
  Random random({5});
  std::vector<PointPair> mark;
  for (int i = 0; i < 40; ++i) {
    const double x = 20 + 200 * random.Uniform();
    const double y = 740 + 40 * random.Uniform();
    mark.push_back({x, y, x + 5 + 2 * random.Uniform(), y - 3});
  }
  EXPECT_TRUE(is_watermark(mark));
  std::vector<PointPair> partly = mark;
  for (std::size_t i = 0; i < 11; ++i) partly[i] = {500, 400, 500, 400};
  EXPECT_TRUE(is_watermark(partly));  // 29 of 40.
  partly[11] = partly[12] = {500, 400, 500, 400};
  EXPECT_FALSE(is_watermark(partly));  // 27 of 40 in the border.
  std::vector<PointPair> turned = mark;
  for (PointPair& pair : turned) pair.x2 = 250 - pair.x1;
  EXPECT_FALSE(is_watermark(turned));  // No shift.
  std::vector<PointPair> inside = mark;
  for (PointPair& pair : inside) pair.y2 -= 400;
  EXPECT_FALSE(is_watermark(inside));  // In the border of one image only.
  EXPECT_FALSE(is_watermark({}));
}

TEST(Watermark, NeedsTheSizesOfBothImages) {
  const Camera camera = SyntheticCamera(false);
  const std::vector<PointPair> mark(20, PointPair{20, 750, 25, 747});
  std::vector<std::size_t> inliers(mark.size());
  for (std::size_t i = 0; i < inliers.size(); ++i) inliers[i] = i;
  EXPECT_TRUE(IsWatermark(camera, camera, mark, inliers, 4));
  Camera no_width = camera;
  no_width.width = 0;
  Camera no_height = camera;
  no_height.height = -1;
  for (const Camera& unknown : {Camera(), no_width, no_height}) {
    EXPECT_FALSE(IsWatermark(unknown, camera, mark, inliers, 4));
    EXPECT_FALSE(IsWatermark(camera, unknown, mark, inliers, 4));
  }
}

TEST(Watermark, MakesThePairOne) {
  Random random({6});
  std::vector<PointPair> mark;
  for (int i = 0; i < 40; ++i) {
    const double x = 20 + 900 * random.Uniform();
    const double y = 740 + 40 * random.Uniform();
    mark.push_back({x, y, x, y});
  }
  EXPECT_EQ(Verify(mark, false).configuration, Configuration::kWatermark);
  TwoViewOptions options;
  options.detect_watermark = false;
  EXPECT_EQ(Verify(mark, false, options).configuration, Configuration::kPlanarOrPanoramic);
}

}  // namespace
}  // namespace colmap_graphmatch
