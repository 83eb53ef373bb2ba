#pragma once

#include <cstddef>
#include <functional>
#include <memory>
#include <optional>
#include <set>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "evaluation/experiment.h"
#include "evaluation/score_table.h"
#include "evaluation/unit_result.h"
#include "visual_localization/localization/estimate.h"

namespace visual_localization {

/// Results that cannot be stored or used. The text is one line and begins with the path.
class ResultError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// The results of one configuration on disk, one file for each method on each pair of rounds, so that interrupted work
/// resumes and several machines may share it.
class ResultFolder {
 public:
  /// Creates or opens the folder. `yaml`, but for its comments and the words for the report, and `provenance` identify
  /// what the results are made with. Throws ResultError when the folder holds results of something else.
  ResultFolder(std::string path, const std::string& yaml, const std::string& provenance);
  /// Opens an existing folder to read from. Throws ResultError.
  static ResultFolder open(std::string path, const std::string& yaml, const std::string& provenance);

  const std::string& path() const { return path_; }
  bool has(std::size_t pair, std::size_t method) const;
  bool hasWhole(std::size_t pair, std::size_t method) const;
  /// Throws ResultError when another experiment has taken the folder in the meantime, and FileError.
  void save(std::size_t pair, std::size_t method, const UnitResult& unit) const;
  /// Throws ResultError when the result is missing or damaged.
  UnitResult load(std::size_t pair, std::size_t method) const;

 private:
  struct Existing {};
  ResultFolder(Existing, std::string path, const std::string& yaml, const std::string& provenance);
  void requireSameOrigin() const;
  bool isUnused() const;
  std::string unitPath(std::size_t pair, std::size_t method) const;

  std::string path_;
  std::string yaml_;
  std::string provenance_;
};

/// Copies what `to` does not have whole from the folder of another shard; returns how many results. Throws ResultError
/// when one is damaged.
std::size_t mergeResults(const ResultFolder& from, const ResultFolder& to, const Experiment& experiment);

/// Writes the tables and trajectories/ of a complete experiment. Throws ResultError naming the first result that is
/// missing.
void writeResultTables(const Experiment& experiment, const ResultFolder& results);

/// With line end.
std::string trackCsvHeader();
/// In full precision: every value reads back as the same double.
std::string trackCsvRow(const Estimate& estimate);

/// Writes the traced runs as TUM trajectories: trajectories/METHOD__MAP__DRIVE__START.tum, and the truth in .truth.tum.
class TrajectoryFiles {
 public:
  explicit TrajectoryFiles(std::string folder) : folder_(std::move(folder) + "/trajectories") {}

  /// Nothing for a method without a trace. Throws FileError.
  void write(const std::string& method, const std::string& map, const std::string& drive, const UnitResult& unit);

 private:
  std::string nameFor(const std::string& method, const std::string& map, const std::string& drive,
                      const std::string& start);

  std::string folder_;
  std::set<std::string> taken_;
};

/// Part `index` of `count`, from 1.
struct Shard {
  std::size_t index = 1;
  std::size_t count = 1;

  bool contains(std::size_t pair) const { return pair % count + 1 == index; }
};

/// Makes rounds of what was recorded. May be called from several threads.
struct RoundSource {
  std::function<std::shared_ptr<const TrainingMap>(const RoundSpec&)> map;
  std::function<std::shared_ptr<const Drive>(const RoundSpec&)> drive;
  /// True poses of the images of a round's map; may be missing or empty.
  std::function<std::vector<std::optional<TruePose>>(const RoundSpec&, const TrainingMap&)> map_truth = {};
};

using StageProgress = std::function<void(const std::string& stage, std::size_t done, std::size_t total)>;

/// Runs the part `shard` and stores what is not stored whole yet. Deterministic but for the times, whatever the number
/// of threads. Throws ResultError when rounds do not fit together.
void evaluate(const Experiment& experiment, const RoundSource& source, const ResultFolder& results, const Shard& shard,
              std::size_t threads, const StageProgress& progress);

}  // namespace visual_localization
