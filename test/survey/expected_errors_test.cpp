#include <gtest/gtest.h>

#include "survey/map_survey.h"
#include "test/support/example_map.h"

namespace visual_localization {
namespace {

/// Two sessions, an image each 10 m. The first has geometry, and these standard deviations.
TrainingMap mapWith(const std::vector<double>& sigmas_m, std::size_t places) {
  std::mt19937 random(1);
  std::vector<TrainingImage> images;
  for (std::size_t i = 0; i < sigmas_m.size() + places; ++i) {
    TrainingImage image;
    image.stamp_ns = static_cast<std::int64_t>(i);
    image.session = i < sigmas_m.size() ? 0 : 1;
    image.position_m = {0.0, 10.0 * static_cast<double>(i)};
    image.local = test::randomFeatures(3, random);
    if (image.session == 0) {
      image.geometry = ImageGeometry();
      image.geometry->covariance.diagonal().head<2>().setConstant(sigmas_m[i] * sigmas_m[i]);
    }
    images.push_back(image);
  }
  MapHeader header = test::exampleHeader();
  header.sessions[1].fixes = FixBudget{0.85, false, 0.5, 43.0, 404.0, 0.7};
  return TrainingMap(header, std::move(images));
}

TEST(ExpectedErrors, AreThoseOfStretchesThatAreAboutAsGood) {
  const auto found = expectedErrors(mapWith({0.2, 0.3, 0.2, 5.0, 6.0, 0.2}, 3), 100);
  ASSERT_EQ(found.size(), 4U);
  EXPECT_EQ(found[0].from_m, 0.0);
  EXPECT_EQ(found[0].to_m, 30.0) << "to where the next one begins";
  EXPECT_NEAR(found[0].most_m, 0.3, 1e-6);
  EXPECT_NEAR(found[0].least_m, 0.2, 1e-6);
  EXPECT_EQ(found[1].from_m, 30.0);
  EXPECT_NEAR(found[1].most_m, 6.0, 1e-6);
  EXPECT_NEAR(found[2].most_m, 0.2, 1e-6);
  EXPECT_EQ(found[3].session, 1);
  EXPECT_EQ(found[3].most_m, 0.7) << "places have that of their fixes";
  EXPECT_EQ(found[3].to_m, 20.0);
}

TEST(ExpectedErrors, OfALargeMapSomeImagesAreRead) {
  const auto found = expectedErrors(mapWith({0.2, 0.2, 5.0, 0.2, 0.2}, 0), 2);
  ASSERT_EQ(found.size(), 1U) << "images 0 and 3";
  EXPECT_EQ(found[0].to_m, 40.0);
}

}  // namespace
}  // namespace visual_localization
