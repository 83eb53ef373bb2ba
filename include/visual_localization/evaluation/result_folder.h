#pragma once

#include <cstddef>
#include <stdexcept>
#include <string>

#include "visual_localization/evaluation/experiment.h"
#include "visual_localization/evaluation/unit_result.h"

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
  /// report, and `provenance` identify what the results were made with. Throws ResultError when the folder holds
  /// results of something else.
  ResultFolder(std::string path, const std::string& yaml, const std::string& provenance);

  const std::string& path() const { return path_; }
  bool has(std::size_t pair, std::size_t method) const;
  void save(std::size_t pair, std::size_t method, const UnitResult& unit) const;
  /// Throws ResultError when the result is missing or damaged.
  UnitResult load(std::size_t pair, std::size_t method) const;

 private:
  std::string unitPath(std::size_t pair, std::size_t method) const;

  std::string path_;
};

/// Copies the results that `to` does not have from the folder of another shard. Throws ResultError when that folder
/// holds results of something else. Returns how many were copied.
std::size_t mergeResults(const ResultFolder& from, const ResultFolder& to, const Experiment& experiment);

}  // namespace visual_localization
