#include "evaluation/track_files.h"

#include <cstddef>
#include <filesystem>
#include <system_error>

#include "base/files.h"
#include "base/text.h"
#include "base/time.h"

namespace visual_localization {

std::string trackCsvHeader() {
  return "stamp,east_m,north_m,yaw_rad,latitude_deg,longitude_deg,state,similarity,features,comparisons,extract_ms,"
         "match_ms,update_ms,source,inliers,reprojection_px,sigma_m,sigma_yaw_rad,swept\n";
}

std::string trackCsvRow(const Estimate& estimate) {
  std::ostringstream out = numberStream();
  const PoseEstimate& pose = estimate.pose;
  const std::optional<MetricPose>& metric = estimate.metric;
  out << secondsText(estimate.stamp_ns) << ',' << pose.position_m.x() << ',' << pose.position_m.y() << ','
      << pose.yaw_rad << ',' << pose.geodetic.latitude_deg << ',' << pose.geodetic.longitude_deg << ','
      << toString(estimate.state) << ',' << estimate.tracked.best.similarity << ','
      << toString(estimate.evidence.features) << ',' << estimate.comparisons << ',' << estimate.image.extract_ms << ','
      << estimate.image.match_ms << ',' << estimate.update_ms << ',' << toString(estimate.source) << ','
      << (metric ? metric->inliers : 0) << ',' << (metric ? metric->reprojection_px : 0.0) << ',' << estimate.sigma_m()
      << ',' << estimate.sigmaYaw_rad() << ',' << estimate.swept << '\n';
  return out.str();
}

namespace {

namespace fs = std::filesystem;

constexpr std::size_t kLongestPart = 60;  ///< of a file name, which has at most 255 bytes

/// A name as a part of a file name.
std::string plain(std::string name) {
  const auto isPlain = [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '-' || c == '.';
  };
  for (char& c : name) c = isPlain(c) ? c : '_';
  return name.substr(0, kLongestPart);
}

}  // namespace

std::string TrajectoryFiles::nameFor(const std::string& method, const std::string& map, const std::string& drive,
                                     const std::string& start) {
  const std::string rest = "__" + plain(map) + "__" + plain(drive) + "__" + start;
  std::string name = plain(method) + rest;
  for (int count = 2; !taken_.insert(name).second; ++count) name = plain(method) + "_" + std::to_string(count) + rest;
  return name;
}

void TrajectoryFiles::write(const std::string& method, const std::string& map, const std::string& drive,
                            const UnitResult& unit) {
  if (unit.trajectory.empty()) return;
  std::error_code error;
  fs::create_directories(folder_, error);
  if (error) throw FileError(folder_ + ": cannot be created: " + error.message());
  const std::string& row = unit.trace.front();
  const std::string path = folder_ + "/" + nameFor(method, map, drive, row.substr(0, row.find(',')));
  std::string estimates;
  std::string truths;
  for (const TracedPose& pose : unit.trajectory) {
    estimates += pose.estimate + '\n';
    if (!pose.truth.empty()) truths += pose.truth + '\n';
  }
  writeFile(path + ".tum", estimates);
  if (!truths.empty()) writeFile(path + ".truth.tum", truths);
}

}  // namespace visual_localization
