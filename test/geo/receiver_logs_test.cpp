// Logs of real receivers, when VISUAL_LOCALIZATION_DATA names a folder with gnss/NAME.csv and gnss/NAME.truth.csv.

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "test/geo/recorded_round.h"

namespace visual_localization {
namespace {

namespace fs = std::filesystem;

/// Stamp, latitude, longitude and, of a receiver, its sigma.
std::vector<Fix> readLog(const fs::path& path) {
  std::ifstream file(path);
  std::vector<Fix> fixes;
  std::string line;
  std::getline(file, line);
  while (std::getline(file, line)) {
    std::vector<double> numbers;
    std::stringstream fields(line);
    for (std::string field; std::getline(fields, field, ',');) {
      numbers.push_back(field.empty() ? std::nan("") : std::stod(field));
    }
    numbers.resize(4, std::nan(""));
    const bool has_fix = std::isfinite(numbers[1]) && std::isfinite(numbers[2]);
    fixes.push_back({test::stampOf(numbers[0]), {numbers[1], numbers[2], 0.0}, has_fix});
    if (numbers[3] > 0.0) fixes.back().sigma_m = numbers[3];
  }
  return fixes;
}

Trajectory pathOf(const std::vector<Fix>& fixes, const LocalFrame& frame) {
  std::vector<TrajectoryPoint> points;
  for (const Fix& fix : fixes) {
    if (hasPosition(fix)) points.push_back({fix.stamp_ns, frame.toEastNorth(fix.position), 0.0});
  }
  return Trajectory(points);
}

struct Errors {
  double mean_m = 0.0;
  double most_m = 0.0;  ///< of 95 %
};

/// Twice a second, where `path` and `raw` are known.
Errors errorsOf(const Trajectory& path, const Trajectory& raw, const Trajectory& truth) {
  std::vector<double> errors_m;
  const std::int64_t end_ns = truth.points().back().stamp_ns;
  for (std::int64_t at_ns = truth.points().front().stamp_ns; at_ns <= end_ns; at_ns += 500'000'000) {
    if (!path.at(at_ns) || !raw.at(at_ns)) continue;
    errors_m.push_back((path.at(at_ns)->position_m - truth.at(at_ns)->position_m).norm());
  }
  std::sort(errors_m.begin(), errors_m.end());
  return {test::meanOf(errors_m), quantile(errors_m, 0.95)};
}

struct Log {
  const char* name;
  double most;        ///< error of the positions against that of the raw fixes
  double least_kept;  ///< share of the fixes
};

TEST(ReceiverLogs, PositionsAreNoWorseThanTheFixes) {
  const char* folder = std::getenv("VISUAL_LOCALIZATION_DATA");
  if (folder == nullptr) GTEST_SKIP() << "VISUAL_LOCALIZATION_DATA is not set";
  constexpr double kRounding_m = 0.02;
  int logs = 0;
  for (const Log& log :
       {Log{"comma_ublox", 1.05, 0.95}, Log{"comma_qcom", 1.05, 0.95}, Log{"phone_sjc_s20", 1.1, 0.7},
        Log{"rtk_stand_open", 1.05, 0.95}, Log{"semi_comma_jump", 0.5, 0.85}, Log{"semi_robot_gm1", 1.05, 0.95},
        Log{"semi_rtk_steps_decl", 0.9, 0.95}, Log{"smartloc_potsdam", 1.05, 0.9}}) {
    const fs::path gnss = fs::path(folder) / "gnss";
    const fs::path path = gnss / (std::string(log.name) + ".csv");
    if (!fs::exists(path)) continue;
    SCOPED_TRACE(log.name);
    const std::vector<Fix> fixes = readLog(path);
    const std::vector<Fix> true_fixes = readLog(gnss / (std::string(log.name) + ".truth.csv"));
    const LocalFrame frame({true_fixes.front().position.latitude_deg, true_fixes.front().position.longitude_deg, 0.0});
    const CleanedTrajectory cleaned = cleanTrajectory(fixes, frame, TrajectoryCleanerConfig());
    const Trajectory raw = pathOf(fixes, frame);
    const Trajectory truth = pathOf(true_fixes, frame);
    const Errors positions = errorsOf(cleaned.trajectory, raw, truth);
    const Errors of_fixes = errorsOf(raw, cleaned.trajectory, truth);
    EXPECT_LE(positions.mean_m, log.most * of_fixes.mean_m + kRounding_m);
    EXPECT_LE(positions.most_m, std::max(log.most, 0.5) * of_fixes.most_m + kRounding_m);
    EXPECT_GE(test::countOf(cleaned, FixVerdict::kKept), log.least_kept * static_cast<double>(fixes.size()));
    ++logs;
  }
  if (logs == 0) GTEST_SKIP() << "no gnss/*.csv in VISUAL_LOCALIZATION_DATA";
}

}  // namespace
}  // namespace visual_localization
