#include <vector>

#include <gtest/gtest.h>

#include "base/numbers.h"
#include "geometry/rays.h"
#include "geometry/reconstruction.h"
#include "geometry/relative_rotation.h"
#include "test/geometry/recorded_street.h"

namespace visual_localization {
namespace {

constexpr std::size_t kFirstAside = 18;
constexpr std::size_t kBehindAside = 22;

bool isAside(std::size_t image) { return image >= kFirstAside && image < kBehindAside; }

/// The truth, but for four cameras in the middle that start 3 m beside it and turned by 30 degrees.
class ResectionTest : public testing::Test {
 protected:
  ResectionTest() {
    std::vector<KeypointRays> rays;
    AveragedRotations rotations;
    FeatureSets sets;
    for (std::size_t i = 0; i < drive_.truth.size(); ++i) {
      rays.push_back(raysOf(*drive_.views[i], drive_.camera));
      sets.addImage(rays.back().normalised.size());
      Eigen::Quaterniond rotation = drive_.truth[i].camera.rotation;
      session_.images[i].position_m = drive_.truth[i].camera.position_m.head<2>();
      if (isAside(i)) {
        session_.images[i].position_m += Eigen::Vector2d(3.0, 0.0);
        rotation = Eigen::AngleAxisd(toRadians(30.0), Eigen::Vector3d::UnitZ()) * rotation;
      }
      rotations.camera_in_map.push_back(rotation);
    }
    for (std::uint32_t a = 0; a < drive_.truth.size(); ++a) {
      for (std::uint32_t b = a + 1; b < drive_.truth.size() && b <= a + 8; ++b) {
        ImagePair pair{a, b, {}};
        session_.kind->correspond(*drive_.views[a], *drive_.views[b], PairRule::kMatchRatio, pair.matches);
        sets.join(pair);
      }
    }
    reconstruction_.add(session_, std::move(rays), rotations, {}, std::vector<double>(drive_.truth.size(), 1.0), sets);
    reconstruction_.triangulateAll(20.0, 20);
  }

  double farthest_m() const {
    double farthest_m = 0.0;
    for (std::size_t i = kFirstAside; i < kBehindAside; ++i) {
      const Eigen::Vector3d off_m = reconstruction_.camera(i).position_m - drive_.truth[i].camera.position_m;
      farthest_m = std::max(farthest_m, off_m.norm());
    }
    return farthest_m;
  }

  const GeometryConfig config_;
  const test::RecordedDrive drive_ = test::recorded({}, 71);
  UnadjustedSession session_ = drive_.unadjusted();
  Reconstruction reconstruction_{config_};
};

TEST_F(ResectionTest, PutsCamerasWhereTheLandmarksOfOthersHaveThem) {
  ASSERT_GT(farthest_m(), 2.9);
  reconstruction_.resect(20.0, 20);
  EXPECT_LT(farthest_m(), 0.1);
}

TEST_F(ResectionTest, LeavesCamerasAloneWhereMostFits) {
  reconstruction_.resect(20.0, 20);
  std::vector<CameraPose> before;
  for (std::size_t i = 0; i < reconstruction_.size(); ++i) before.push_back(reconstruction_.camera(i));
  reconstruction_.resect(20.0, 20);
  for (std::size_t i = 0; i < before.size(); ++i) {
    EXPECT_EQ(reconstruction_.camera(i).position_m, before[i].position_m) << i;
  }
}

}  // namespace
}  // namespace visual_localization
