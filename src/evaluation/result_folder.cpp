#include "evaluation/result_folder.h"

#include <filesystem>
#include <system_error>
#include <utility>

#include "base/files.h"
#include "parameters/yaml_map.h"

namespace visual_localization {
namespace {

namespace fs = std::filesystem;

const char* const kExperiment = "/experiment.yaml";
const char* const kProvenance = "/provenance.csv";

/// The part of an experiment's YAML that decides about results: no comments, no words for the report.
std::string decisivePart(const std::string& yaml, const std::string& path) {
  try {
    return parameters::withoutKeys(yaml, {"title", "source", "discussion"});
  } catch (const ParameterError&) {
    throw ResultError(path + ": is damaged: not an experiment");
  }
}

}  // namespace

ResultFolder::ResultFolder(Existing, std::string path, const std::string& yaml, const std::string& provenance)
    : path_(std::move(path)), yaml_(yaml), provenance_(provenance) {}

ResultFolder::ResultFolder(std::string path, const std::string& yaml, const std::string& provenance)
    : ResultFolder(Existing{}, std::move(path), yaml, provenance) {
  if (path_.empty()) throw ResultError("'': is no name of a folder");
  std::error_code error;
  fs::create_directories(path_ + "/units", error);
  if (error) throw ResultError(path_ + ": cannot be created: " + error.message());
  if (isUnused()) {  // but for an attempt that failed, perhaps for a mistake that the YAML no longer has
    writeFile(path_ + kProvenance, provenance_);
  } else {
    requireSameOrigin();
  }
  writeFile(path_ + kExperiment, yaml_);
}

ResultFolder ResultFolder::open(std::string path, const std::string& yaml, const std::string& provenance) {
  ResultFolder folder(Existing{}, std::move(path), yaml, provenance);
  folder.requireSameOrigin();
  return folder;
}

bool ResultFolder::isUnused() const { return fs::is_empty(path_ + "/units"); }

void ResultFolder::requireSameOrigin() const {
  for (const char* name : {kExperiment, kProvenance}) {
    if (fs::exists(path_ + name)) continue;
    throw ResultError(path_ + ": is not a folder of results (" + (name + 1) + " is missing); choose another folder");
  }
  const std::string experiment = path_ + kExperiment;
  if (decisivePart(readFile(experiment), experiment) != decisivePart(yaml_, experiment)) {
    throw ResultError(path_ +
                      ": holds results of another configuration (experiment.yaml differs); choose another folder");
  }
  if (readFile(path_ + kProvenance) != provenance_) {
    throw ResultError(
        path_ + ": holds results of other rounds or another version (provenance.csv differs); choose another folder");
  }
}

std::string ResultFolder::unitPath(std::size_t pair, std::size_t method) const {
  return path_ + "/units/pair" + std::to_string(pair) + "_method" + std::to_string(method) + ".csv";
}

bool ResultFolder::has(std::size_t pair, std::size_t method) const { return fs::exists(unitPath(pair, method)); }

bool ResultFolder::hasWhole(std::size_t pair, std::size_t method) const {
  if (!has(pair, method)) return false;
  try {
    load(pair, method);
    return true;
  } catch (const ResultError&) {
    return false;
  }
}

void ResultFolder::save(std::size_t pair, std::size_t method, const UnitResult& unit) const {
  requireSameOrigin();
  writeFile(unitPath(pair, method), serialise(unit));
}

UnitResult ResultFolder::load(std::size_t pair, std::size_t method) const {
  const std::string path = unitPath(pair, method);
  try {
    return parseUnit(readFile(path));
  } catch (const FileError& error) {
    throw ResultError(error.what());
  } catch (const std::runtime_error& error) {
    throw ResultError(path + ": is damaged: " + error.what() + "; it is made anew when its shard is run again");
  }
}

std::size_t mergeResults(const ResultFolder& from, const ResultFolder& to, const Experiment& experiment) {
  std::size_t copied = 0;
  for (std::size_t pair = 0; pair < experiment.pairs.size(); ++pair) {
    for (std::size_t method = 0; method < experiment.methods.size(); ++method) {
      if (to.hasWhole(pair, method) || !from.has(pair, method)) continue;
      to.save(pair, method, from.load(pair, method));
      ++copied;
    }
  }
  return copied;
}

}  // namespace visual_localization
