#include <vector>

#include <gtest/gtest.h>

#include "evaluation/score_table.h"
#include "test/support/synthetic.h"

namespace visual_localization {
namespace {

using Descriptors = std::vector<std::vector<std::uint8_t>>;

constexpr double kRatio = 0.6;
constexpr double kLongestGap_s = 5.0;

/// What is seen of the world, thing by thing.
SiftFeatures view(const std::vector<std::uint32_t>& things) {
  Descriptors descriptors;
  for (const std::uint32_t thing : things) descriptors.push_back(test::randomFeatures(1, thing).descriptors());
  return test::featuresOf(descriptors);
}

DriveImage imageOf(double seconds, const std::vector<std::uint32_t>& things) {
  DriveImage image;
  image.stamp_ns = static_cast<std::int64_t>(1e9 * seconds);
  image.unpruned = view(things);
  return image;
}

void expectKept(const DriveImage& image, const std::vector<std::uint32_t>& things) {
  EXPECT_EQ(image.sift.descriptors(), view(things).descriptors());
}

TEST(PruningByBothNeighbours, KeepsWhatEitherNeighbourShows) {
  std::vector<DriveImage> images{imageOf(0.0, {1, 2, 3, 4}), imageOf(1.0, {1, 2, 5, 6}), imageOf(2.0, {5, 1, 7, 8})};
  pruneByBothNeighbours(images, kRatio, kLongestGap_s);
  expectKept(images[0], {1, 2});
  expectKept(images[1], {1, 2, 5});
  expectKept(images[2], {5, 1});
}

TEST(PruningByBothNeighbours, ARepetitionIsNoNeighbour) {
  std::vector<DriveImage> images{imageOf(0.0, {1, 2, 3}), imageOf(1.0, {1, 4, 5}), imageOf(2.0, {1, 4, 5}),
                                 imageOf(3.0, {1, 4, 5}), imageOf(4.0, {4, 6, 7})};
  pruneByBothNeighbours(images, kRatio, kLongestGap_s);
  expectKept(images[0], {1});
  for (int i = 1; i <= 3; ++i) expectKept(images[static_cast<std::size_t>(i)], {1, 4});
  expectKept(images[4], {4});
}

TEST(PruningByBothNeighbours, AnImageFarAwayIsNoNeighbour) {
  std::vector<DriveImage> images{imageOf(0.0, {1, 2, 3}), imageOf(5.0, {1, 4, 5}), imageOf(10.001, {4, 6, 7})};
  pruneByBothNeighbours(images, kRatio, kLongestGap_s);
  expectKept(images[0], {1});
  expectKept(images[1], {1});
  expectKept(images[2], {4, 6, 7});
}

TEST(PruningByBothNeighbours, AnImageThatShowsNothingIsNoNeighbour) {
  std::vector<DriveImage> images{imageOf(0.0, {}), imageOf(1.0, {1, 4, 5}), imageOf(2.0, {9}), imageOf(3.0, {4, 6, 7}),
                                 imageOf(4.0, {4, 8, 9})};
  pruneByBothNeighbours(images, kRatio, kLongestGap_s);
  EXPECT_TRUE(images[0].sift.empty());
  expectKept(images[1], {1, 4, 5});
  expectKept(images[3], {4});
}

}  // namespace
}  // namespace visual_localization
