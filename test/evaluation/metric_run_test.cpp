#include <memory>
#include <random>

#include <gtest/gtest.h>

#include "evaluation/run.h"
#include "evaluation/unit_result.h"
#include "test/support/landmark_world.h"

namespace visual_localization {
namespace {

/// A street with landmarks, and a drive along it 0.3 m beside the training images, known by its features.
class RecordedStreet {
 public:
  RecordedStreet() {
    drive_.image_size = camera_.size();
    drive_.camera = camera_;
    for (std::size_t i = 0; i < poses_.size(); ++i) {
      CameraPose pose = poses_[i].camera;
      pose.position_m += pose.rotation * Eigen::Vector3d(0.3, 0.0, 0.0);
      DriveImage image;
      image.stamp_ns = map_->pose(i).stamp_ns;
      image.truth = TruePose{map_->frame().toGeodetic(pose.position_m.head<2>()), pose.yaw_rad()};
      image.unpruned = test::viewOf(world_, camera_, pose, test::kKeypointSigma_px, random_).features;
      image.local = *image.unpruned;
      drive_.images.push_back(image);
      truth_.push_back(
          TruePose{map_->frame().toGeodetic(poses_[i].camera.position_m.head<2>()), poses_[i].camera.yaw_rad()});
    }
  }

  RunRecord run(const std::string& pose_source, double covered = 0.0) const {
    MethodSpec method;
    method.tracker = "dpso";
    method.localizer.metric.pose_source = pose_source;
    method.localizer.state.place_check = false;  // there are no global features
    method.localizer.dpso.guided_start = false;
    method.covered = covered;
    const ScoreTable table(drive_, *map_, MatchConfig(), 1);
    const PartialMap whole = partOf(map_, 0.0);
    return visual_localization::run({whole, drive_, table, false, 5.0, mapErrors(whole, truth_, drive_)}, method, 0,
                                    true);
  }

  Drive& drive() { return drive_; }

 private:
  CameraModel camera_ = test::streetCamera();
  std::mt19937 random_{3};
  std::vector<test::DrivenPose> poses_ = test::drive({});
  std::vector<test::WorldPoint> world_ = test::pointsAlong(poses_, 6.0, random_);
  std::shared_ptr<const TrainingMap> map_ = test::mapOf(test::record(poses_, world_, 0.1, random_));
  std::vector<std::optional<TruePose>> truth_;
  Drive drive_;
};

PoseFigures figuresOf(const RunRecord& record) { return summariseRuns({record}, {}).poses; }

TEST(MetricRun, SolvesPosesOfRecordedImagesAsTheRobotDoes) {
  const RecordedStreet street;
  const RunRecord record = street.run("metric");
  const PoseFigures poses = figuresOf(record);
  EXPECT_GT(poses.metricShare(), 0.9);
  EXPECT_LT(poses.absolute.meanPosition_m(), 0.3);
  EXPECT_LT(poses.absolute.meanHeading_deg(), 1.0);
  EXPECT_LT(poses.relative.meanPosition_m(), 0.15);
  EXPECT_GT(poses.relative.recall(0), 0.9);
  EXPECT_EQ(poses.wrong_5m, 0U);
  ASSERT_EQ(record.trace.size(), record.steps.size());
  EXPECT_TRUE(record.trace.back().estimate.metric);
  EXPECT_TRUE(record.trace.back().truth_m);
}

TEST(MetricRun, PlacesTakeTheTrainingImagesPose) {
  const RecordedStreet street;
  const PoseFigures places = figuresOf(street.run("place"));
  EXPECT_EQ(places.metric, 0U);
  EXPECT_GT(places.relative.meanPosition_m(), figuresOf(street.run("metric")).relative.meanPosition_m());
  EXPECT_TRUE(std::isnan(places.relative.meanNees()));
}

TEST(MetricRun, ACoveredCameraShowsNoLandmarks) {
  const RecordedStreet street;
  const RunRecord record = street.run("metric", 0.2);
  const std::size_t from = record.steps.size() / 2;
  for (std::size_t i = from; i < from + record.steps.size() / 5; ++i) {
    EXPECT_NE(record.steps[i].source, PoseSource::kMetric) << i;
  }
}

TEST(MetricRun, WithoutAllFeaturesThereAreNoPoses) {
  RecordedStreet street;
  for (DriveImage& image : street.drive().images) image.unpruned.reset();
  EXPECT_EQ(figuresOf(street.run("metric")).metric, 0U);
}

}  // namespace
}  // namespace visual_localization
