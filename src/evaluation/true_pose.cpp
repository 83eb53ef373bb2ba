#include "evaluation/true_pose.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <locale>
#include <sstream>
#include <stdexcept>
#include <utility>
#include <vector>

#include "base/files.h"
#include "base/statistics.h"
#include "base/text.h"

namespace visual_localization {
namespace {

constexpr std::size_t kLargestFile_bytes = 100'000'000;
constexpr double kLongestGap_s = 2.0;  ///< between poses; in a longer one nothing is known

/// The columns that count, in the order of PoseRow.
const std::array<const char*, 4> kColumns{"stamp_ns", "east_m", "north_m", "yaw_rad"};

std::vector<std::string> fieldsOf(std::string line) {
  if (!line.empty() && line.back() == '\r') line.pop_back();
  std::vector<std::string> fields(1);
  for (const char c : line) {
    if (c == ',') {
      fields.emplace_back();
    } else {
      fields.back() += c;
    }
  }
  return fields;
}

template <class Number>
Number numberOf(const std::string& column, const std::string& text) {
  std::istringstream in(text);
  in.imbue(std::locale::classic());
  Number number{};
  const bool whole = (in >> number) && in.peek() == std::istringstream::traits_type::eof();
  if (!whole) throw std::runtime_error(column + " = '" + oneLine(text, 40) + "' is not a finite number");
  return number;
}

/// Reads rows by the names of their columns.
class PoseTable {
 public:
  explicit PoseTable(const std::string& header) {
    const std::vector<std::string> names = fieldsOf(header);
    columns_ = names.size();
    for (std::size_t i = 0; i < kColumns.size(); ++i) {
      const auto found = std::find(names.begin(), names.end(), kColumns[i]);
      if (found == names.end()) throw std::runtime_error(std::string("has no column ") + kColumns[i]);
      at_[i] = static_cast<std::size_t>(found - names.begin());
    }
  }

  TrajectoryPoint row(const std::string& line) const {
    const std::vector<std::string> fields = fieldsOf(line);
    if (fields.size() != columns_) {
      throw std::runtime_error("has " + std::to_string(fields.size()) + " fields, the header " +
                               std::to_string(columns_));
    }
    const auto real = [&](std::size_t i) { return numberOf<double>(kColumns[i], fields[at_[i]]); };
    return {numberOf<std::int64_t>(kColumns[0], fields[at_[0]]), {real(1), real(2)}, real(3)};
  }

 private:
  std::size_t columns_ = 0;
  std::array<std::size_t, kColumns.size()> at_{};
};

Trajectory parsePoses(const std::string& text) {
  std::istringstream in(text);
  std::string line;
  if (!std::getline(in, line)) throw std::runtime_error("is empty");
  const PoseTable table(line);
  std::vector<TrajectoryPoint> points;
  for (std::size_t number = 2; std::getline(in, line); ++number) {
    try {
      points.push_back(table.row(line));
      if (points.size() > 1 && points.back().stamp_ns <= points[points.size() - 2].stamp_ns) {
        throw std::runtime_error("stamp_ns is not later than the one before");
      }
    } catch (const std::runtime_error& error) {
      throw std::runtime_error("line " + std::to_string(number) + ": " + error.what());
    }
  }
  if (points.empty()) throw std::runtime_error("holds no pose");
  return Trajectory(std::move(points), kLongestGap_s);
}

}  // namespace

Trajectory readPoses(const std::string& path) {
  const std::string text = readFile(path, kLargestFile_bytes);
  try {
    return parsePoses(text);
  } catch (const std::runtime_error& error) {
    throw FileError(path + ": " + error.what());
  }
}

Trajectory movedOnto(const Trajectory& positions, const Trajectory& poses) {
  std::vector<double> east_m;
  std::vector<double> north_m;
  for (const TrajectoryPoint& pose : poses.points()) {
    const std::optional<TrajectoryPoint> there = positions.at(pose.stamp_ns);
    if (!there) continue;
    east_m.push_back(there->position_m.x() - pose.position_m.x());
    north_m.push_back(there->position_m.y() - pose.position_m.y());
  }
  if (east_m.empty()) throw std::runtime_error("no pose is from the time of the true positions");
  const Eigen::Vector2d shift_m(median(std::move(east_m)), median(std::move(north_m)));
  std::vector<TrajectoryPoint> moved = poses.points();
  for (TrajectoryPoint& point : moved) point.position_m += shift_m;
  return Trajectory(std::move(moved), kLongestGap_s);
}

}  // namespace visual_localization
