#pragma once

#include <set>
#include <string>
#include <utility>

#include "evaluation/unit_result.h"
#include "visual_localization/localization/estimate.h"

namespace visual_localization {

/// The column names of a track, with line end.
std::string trackCsvHeader();
/// One image of a track in full precision: every value reads back as the same double.
std::string trackCsvRow(const Estimate& estimate);

/// Writes the traced runs of an experiment as TUM trajectories, for evo and the like:
/// trajectories/METHOD__MAP__DRIVE__START.tum, and what is true beside it, ending in .truth.tum.
class TrajectoryFiles {
 public:
  /// `folder`: of the results.
  explicit TrajectoryFiles(std::string folder) : folder_(std::move(folder) + "/trajectories") {}

  /// Nothing for a method that has no trace. Throws FileError.
  void write(const std::string& method, const std::string& map, const std::string& drive, const UnitResult& unit);

 private:
  std::string nameFor(const std::string& method, const std::string& map, const std::string& drive,
                      const std::string& start);

  std::string folder_;
  std::set<std::string> taken_;
};

}  // namespace visual_localization
