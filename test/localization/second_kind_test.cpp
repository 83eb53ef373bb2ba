#include <memory>
#include <stdexcept>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "evaluation/score_table.h"
#include "test/localization/wall_street.h"
#include "test/support/patch_features.h"
#include "test/support/temporary_folder.h"
#include "visual_localization/localization/localizer.h"
#include "visual_localization/map/map_builder.h"
#include "visual_localization/map/map_file.h"

namespace visual_localization {
namespace {

using testing::AllOf;
using testing::HasSubstr;

/// A kind of local features that the package does not have: floats, 64 long.
class SecondKind : public test::WallStreet {
 protected:
  static void SetUpTestSuite() { registerLocalFeatureKind(std::make_shared<test::PatchFeatures>()); }

  static std::vector<Fix> fixes() {
    std::vector<Fix> all;
    for (int i = 0; i < kImages; ++i) {
      Fix fix;
      fix.stamp_ns = i * test::kSecond;
      fix.position = LocalFrame({48.5, 9.0, 400.0}).toGeodetic({kMetresPerImage * i, 0.0});
      fix.has_fix = true;
      all.push_back(fix);
    }
    return all;
  }

  /// Written by the builder and read again.
  std::shared_ptr<const TrainingMap> builtMap() {
    MapBuilderConfig config;
    assignParameters(config, {{"map/features", "patches"}, {"patches/max_features", std::int64_t{150}}});
    MapBuilder builder(config);
    builder.beginSession("wall", fixes());
    for (int i = 0; i < kImages; ++i) builder.addImage(i * test::kSecond, viewAt(kMetresPerImage * i + 1e-9));
    builder.save(path_);
    return loadMap(path_);
  }

  const test::TemporaryFolder folder_;
  const std::string path_ = folder_ / "patches.map";
};

TEST_F(SecondKind, IsBuiltStoredAndLocalised) {
  const auto map = builtMap();
  EXPECT_EQ(map->header().kind->name(), "patches");
  EXPECT_EQ(map->local(0)->form(), test::PatchFeatures().form());
  LocalizerConfig config;
  config.features = "patches";
  Localizer localizer(map, config);
  Estimate estimate;
  for (int i = 0; i < 20; ++i) {
    const double at_m = 5.0 + 0.5 * i;
    estimate = localizer.process(1000 * test::kSecond + i * test::kSecond, noisy(viewAt(at_m), i));
    if (i < 5) continue;
    EXPECT_NEAR(estimate.pose.position_m.x(), at_m, 1.5) << i;
  }
  EXPECT_EQ(estimate.state, LocalizationState::kTracking);
  EXPECT_EQ(estimate.featuresName(), "PATCHES");
}

TEST_F(SecondKind, IsComparedByEverySimilarity) {
  const auto map = builtMap();
  for (const char* mode : {"votes", "symmetric", "one_way"}) {
    MatchConfig match;
    match.mode = mode;
    match.max_angle_ratio = 0.8;
    const LocalSimilarity similarity(match, SimilarityConfig(), 320, map->header().kind);
    EXPECT_GT(similarity.compare(*map->local(10), *map->local(11)).similarity,
              3.0 * similarity.compare(*map->local(10), *map->local(40)).similarity)
        << mode;
  }
}

TEST_F(SecondKind, IsComparedTheSameInAnEvaluation) {
  const auto map = builtMap();
  Drive drive;
  drive.image_size = map->header().image_size;
  drive.images.resize(1);
  drive.images.front().local = *map->local(11);
  const MatchConfig match;
  const ScoreTable table(drive, *map, match, 1);
  const LocalSimilarity similarity(match, SimilarityConfig(), 320, map->header().kind);
  for (const std::size_t i : {10, 40}) {
    EXPECT_DOUBLE_EQ(table.at(0, i).sift, similarity.compare(*map->local(11), *map->local(i)).similarity) << i;
  }
  EXPECT_GT(table.at(0, 10).sift, 0.1);
}

TEST_F(SecondKind, IsRefusedByALocalizerOfAnother) {
  const auto map = builtMap();
  try {
    const Localizer localizer(map, LocalizerConfig());
    FAIL() << "was taken for SIFT";
  } catch (const ParameterError& error) {
    EXPECT_THAT(error.what(), AllOf(HasSubstr("'sift'"), HasSubstr("'patches'")));
  }
}

TEST_F(SecondKind, CannotBeComparedWithAnother) {
  const auto map = builtMap();
  const LocalFeatures sift = makeSiftExtractor(SiftConfig())->extract(viewAt(3.0));
  std::vector<FeatureMatch> matches;
  EXPECT_THROW(matchMutual(*map->local(3), sift, 100.0, matches), std::invalid_argument);
}

}  // namespace
}  // namespace visual_localization
