#include "geometry/lens_correction.h"

#include <gtest/gtest.h>

namespace visual_localization {
namespace {

const Intrinsics kPinhole{{640, 480}, 450.0, 452.0, 320.0, 238.0, Distortion::kPlumbBob, {}};
const Intrinsics kPlumbBob{
    {640, 480}, 450.0, 452.0, 320.0, 238.0, Distortion::kPlumbBob, {-0.3, 0.1, 1e-3, -2e-3, 0.0}};
const Intrinsics kRational{{640, 480},
                           450.0,
                           452.0,
                           320.0,
                           238.0,
                           Distortion::kRationalPolynomial,
                           {0.2, 0.1, 1e-3, -2e-3, 0.01, 0.4, 0.1, 0.02}};
const Intrinsics kFisheye{
    {640, 480}, 250.0, 251.0, 320.0, 238.0, Distortion::kEquidistant, {0.02, -0.01, 0.003, -0.001}};

class LensCorrectionTest : public testing::TestWithParam<Intrinsics> {
 protected:
  static LensCorrection someCorrection() {
    LensCorrection correction;
    correction << 0.02, 0.003, 0.01, -0.008, 0.015, -0.01;
    return correction;
  }
};

TEST_P(LensCorrectionTest, ProjectsAsTheCorrectedCameraDoes) {
  const CameraModel camera(corrected(GetParam(), someCorrection()));
  const LensProjection lens(GetParam(), someCorrection());
  for (const Eigen::Vector2d& ray :
       {Eigen::Vector2d(0.0, 0.0), Eigen::Vector2d(0.3, -0.2), Eigen::Vector2d(-0.6, 0.4)}) {
    EXPECT_LT((lens.project(ray) - camera.distort(ray)).norm(), 1e-9) << ray.transpose();
  }
}

TEST_P(LensCorrectionTest, HasTheDerivativesOfItsProjection) {
  constexpr double kStep = 1e-6;
  const LensCorrection correction = someCorrection();
  const Eigen::Vector2d ray(0.4, -0.25);
  Eigen::Matrix2d by_ray;
  Eigen::Matrix<double, 2, 6> by_correction;
  LensProjection(GetParam(), correction).project(ray, &by_ray, &by_correction);
  for (int i = 0; i < 2; ++i) {
    const Eigen::Vector2d step = kStep * Eigen::Vector2d::Unit(i);
    const LensProjection lens(GetParam(), correction);
    const Eigen::Vector2d slope = (lens.project(ray + step) - lens.project(ray - step)) / (2.0 * kStep);
    EXPECT_LT((slope - by_ray.col(i)).norm(), 1e-4) << i;
  }
  for (int i = 0; i < 6; ++i) {
    const LensCorrection step = kStep * LensCorrection::Unit(i);
    const Eigen::Vector2d slope = (LensProjection(GetParam(), correction + step).project(ray) -
                                   LensProjection(GetParam(), correction - step).project(ray)) /
                                  (2.0 * kStep);
    EXPECT_LT((slope - by_correction.col(i)).norm(), 1e-4) << i;
  }
}

TEST_P(LensCorrectionTest, OfNothingIsThePublishedCalibration) {
  EXPECT_EQ(CameraModel(corrected(GetParam(), LensCorrection::Zero())), CameraModel(GetParam()));
}

INSTANTIATE_TEST_SUITE_P(Lenses, LensCorrectionTest, testing::Values(kPinhole, kPlumbBob, kRational, kFisheye));

}  // namespace
}  // namespace visual_localization
