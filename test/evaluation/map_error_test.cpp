#include <gtest/gtest.h>

#include "base/numbers.h"
#include "evaluation/run.h"
#include "test/support/synthetic.h"

namespace visual_localization {
namespace {

/// A map along the east axis whose images were truly taken 1 m farther north, and 0.1 rad to the left of its headings.
class MapErrors : public ::testing::Test {
 protected:
  MapErrors() {
    for (std::size_t i = 0; i < map_->size(); ++i) {
      const Eigen::Vector2d true_m = map_->position_m(i) + Eigen::Vector2d(0.0, 1.0);
      truth_.push_back(TruePose{map_->frame().toGeodetic(true_m), map_->yaw_rad(i) + 0.1});
    }
  }

  /// Of a drive of one image at a true pose.
  std::optional<MapError> at(const Eigen::Vector2d& position_m, std::optional<double> yaw_rad,
                             const PartialMap& part) const {
    Drive drive;
    drive.images.resize(1);
    drive.images[0].truth = TruePose{map_->frame().toGeodetic(position_m), yaw_rad};
    return mapErrors(part, truth_, drive).at(0);
  }

  std::shared_ptr<const TrainingMap> map_ = test::mapAt({{0.0, 0.0}, {5.0, 0.0}, {10.0, 0.0}, {15.0, 0.0}});
  std::vector<std::optional<TruePose>> truth_;
};

TEST_F(MapErrors, AreThoseOfTheNearestTrainingImage) {
  truth_[2]->position = map_->frame().toGeodetic({10.0, -3.0});
  const auto error = at({9.0, 0.0}, std::nullopt, {map_, {}});
  ASSERT_TRUE(error);
  EXPECT_NEAR((error->position_m - Eigen::Vector2d(0.0, 3.0)).norm(), 0.0, 1e-6);
  EXPECT_NEAR(error->yaw_rad.value(), -0.1, 1e-9);
}

TEST_F(MapErrors, AreThoseOfAnImageThatFacesAlike) {
  truth_[2]->yaw_rad = *truth_[2]->yaw_rad + kPi;
  truth_[2]->position = map_->frame().toGeodetic({10.0, -3.0});
  const auto error = at({10.5, 0.0}, truth_[1]->yaw_rad, {map_, {}});
  ASSERT_TRUE(error);
  EXPECT_NEAR((error->position_m - Eigen::Vector2d(0.0, -1.0)).norm(), 0.0, 1e-6);
}

TEST_F(MapErrors, KnowWhichImagesAPartOfTheMapHas) {
  truth_[3]->position = map_->frame().toGeodetic({15.0, 7.0});
  const PartialMap part = partOf(map_, 0.0, 12.0);  // the first and the last
  ASSERT_EQ(part.images, (std::vector<std::size_t>{0, 3}));
  const auto error = at({14.0, 5.0}, std::nullopt, part);
  ASSERT_TRUE(error);
  EXPECT_NEAR(error->position_m.y(), -7.0, 1e-6);
}

TEST_F(MapErrors, AreThoseOfImagesWithLandmarks) {
  std::vector<TrainingImage> images;
  for (std::size_t i = 0; i < map_->size(); ++i) images.push_back(map_->image(i));
  for (const std::size_t i : {0, 1, 3}) images[i].geometry.emplace();
  truth_[2]->position = map_->frame().toGeodetic({10.0, -3.0});
  const auto error =
      at({10.5, 0.0}, std::nullopt, {std::make_shared<TrainingMap>(map_->header(), std::move(images)), {}});
  ASSERT_TRUE(error);
  EXPECT_NEAR((error->position_m - Eigen::Vector2d(0.0, -1.0)).norm(), 0.0, 1e-6);
}

TEST_F(MapErrors, AreNotKnownWithoutTruth) {
  truth_.assign(map_->size(), std::nullopt);
  EXPECT_FALSE(at({0.0, 0.0}, std::nullopt, {map_, {}}));
  truth_.clear();
  EXPECT_FALSE(at({0.0, 0.0}, std::nullopt, {map_, {}}));
  Drive drive;
  drive.images.resize(1);
  EXPECT_FALSE(mapErrors({map_, {}}, truth_, drive).at(0));
}

}  // namespace
}  // namespace visual_localization
