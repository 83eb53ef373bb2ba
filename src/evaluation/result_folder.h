#pragma once

#include <cstddef>
#include <stdexcept>
#include <string>

#include "evaluation/experiment.h"
#include "evaluation/unit_result.h"

namespace visual_localization {

/// Results that cannot be stored or used. The text is one line and begins with the path.
class ResultError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// The results of an experiment on disk, one file for each method on each pair of rounds, so that interrupted work
/// resumes and several machines may share it. Belongs to one configuration of one set of rounds.
class ResultFolder {
 public:
  /// Creates the folder, or opens the one of an earlier call. `yaml`, but for its comments and the words for the
  /// report, and `provenance` identify what the results are made with. Throws ResultError when the folder holds
  /// results of something else.
  ResultFolder(std::string path, const std::string& yaml, const std::string& provenance);
  /// Opens an existing folder to read from. Throws ResultError also when it is not a folder of results.
  static ResultFolder open(std::string path, const std::string& yaml, const std::string& provenance);

  const std::string& path() const { return path_; }
  bool has(std::size_t pair, std::size_t method) const;
  /// Has it, and can load it.
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

/// Copies the results that `to` does not have whole from the folder of another shard. Throws ResultError when one of
/// them is damaged. Returns how many were copied.
std::size_t mergeResults(const ResultFolder& from, const ResultFolder& to, const Experiment& experiment);

/// Writes summary.csv, pairs.csv, methods.csv, steps.csv, traces.csv and trajectories/ of a complete experiment into
/// its folder. Throws ResultError naming the first result that is missing.
void writeResultTables(const Experiment& experiment, const ResultFolder& results);

}  // namespace visual_localization
