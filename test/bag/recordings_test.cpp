// Positions of whole recordings: the two that ship, and more when VISUAL_LOCALIZATION_DATA names a folder.

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <numeric>

#include <gtest/gtest.h>

#include "visual_localization/bag/bag_reader.h"
#include "visual_localization/geo/trajectory_cleaner.h"

namespace visual_localization {
namespace {

namespace fs = std::filesystem;

/// Against the exact positions at the image stamps.
void expectCleanTrajectory(const fs::path& path) {
  SCOPED_TRACE(path.filename());
  const BagReader bag(path.string());
  const std::vector<Fix> truth = bag.fixes("/ground_truth/fix");
  const LocalFrame frame(truth.front().position);
  const CleanedTrajectory cleaned = cleanTrajectory(bag.fixes("/gps/fix"), frame, TrajectoryCleanerConfig());
  std::vector<double> errors_m;
  for (const Fix& fix : truth) {
    const auto point = cleaned.trajectory.at(fix.stamp_ns);
    if (point) errors_m.push_back((point->position_m - frame.toEastNorth(fix.position)).norm());
  }
  ASSERT_GE(errors_m.size() + 5, truth.size());
  std::sort(errors_m.begin(), errors_m.end());
  const auto count = static_cast<double>(errors_m.size());
  EXPECT_LE(std::accumulate(errors_m.begin(), errors_m.end(), 0.0) / count, 0.5);
  EXPECT_LT(errors_m[static_cast<std::size_t>(0.99 * count)], 3.0);
}

TEST(Recordings, FixesOfTheSampleBecomeTheTruePath) {
  for (const char* name : {"campus_sunny_1.bag", "campus_cloudy_1.bag"}) {
    expectCleanTrajectory(fs::path(TEST_DATA_DIR) / "rounds" / name);
  }
}

TEST(Recordings, FixesOfEveryCampusRecordingBecomeTheTruePath) {
  const char* folder = std::getenv("VISUAL_LOCALIZATION_DATA");
  if (folder == nullptr) GTEST_SKIP() << "VISUAL_LOCALIZATION_DATA is not set";
  int recordings = 0;
  for (const auto& entry : fs::directory_iterator(folder)) {
    const std::string name = entry.path().filename().string();
    if (name.rfind("campus_a_", 0) != 0) continue;
    expectCleanTrajectory(entry.path());
    ++recordings;
  }
  EXPECT_GT(recordings, 0);
}

}  // namespace
}  // namespace visual_localization
