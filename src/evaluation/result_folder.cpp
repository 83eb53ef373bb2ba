#include "visual_localization/evaluation/result_folder.h"

#include <filesystem>
#include <fstream>
#include <sstream>
#include <utility>

#include <yaml-cpp/yaml.h>

#include "visual_localization/io/partial_file.h"

namespace visual_localization {
namespace {

namespace fs = std::filesystem;

std::string readFile(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  std::ostringstream text;
  text << file.rdbuf();
  if (!file) throw ResultError(path + ": cannot be read");
  return text.str();
}

/// The part of an experiment's YAML that decides about results: no comments, no words for the report.
std::string decisivePart(const std::string& yaml) {
  YAML::Node node = YAML::Load(yaml);
  for (const char* words : {"title", "source", "discussion"}) node.remove(words);
  return YAML::Dump(node);
}

void requireSameConfiguration(const std::string& folder, const std::string& yaml) {
  const std::string path = folder + "/experiment.yaml";
  if (fs::exists(path) && decisivePart(readFile(path)) != decisivePart(yaml)) {
    throw ResultError(folder +
                      ": holds results of another configuration (experiment.yaml differs); choose another "
                      "folder");
  }
  writeFile(path, yaml);
}

/// Keeps `text` as the file `name`, or finds the same text there.
void requireSame(const std::string& folder, const std::string& name, const std::string& text, const std::string& what) {
  const std::string path = folder + "/" + name;
  if (!fs::exists(path)) {
    writeFile(path, text);
  } else if (readFile(path) != text) {
    throw ResultError(folder + ": holds results of " + what + " (" + name + " differs); choose another folder");
  }
}

}  // namespace

ResultFolder::ResultFolder(std::string path, const std::string& yaml, const std::string& provenance)
    : path_(std::move(path)) {
  std::error_code error;
  fs::create_directories(path_ + "/units", error);
  if (error) throw ResultError(path_ + ": cannot be created: " + error.message());
  requireSameConfiguration(path_, yaml);
  requireSame(path_, "provenance.csv", provenance, "other rounds or another version");
}

std::string ResultFolder::unitPath(std::size_t pair, std::size_t method) const {
  return path_ + "/units/pair" + std::to_string(pair) + "_method" + std::to_string(method) + ".csv";
}

bool ResultFolder::has(std::size_t pair, std::size_t method) const { return fs::exists(unitPath(pair, method)); }

void ResultFolder::save(std::size_t pair, std::size_t method, const UnitResult& unit) const {
  writeFile(unitPath(pair, method), serialise(unit));
}

UnitResult ResultFolder::load(std::size_t pair, std::size_t method) const {
  const std::string path = unitPath(pair, method);
  try {
    return parseUnit(readFile(path));
  } catch (const ResultError&) {
    throw;
  } catch (const std::runtime_error& error) {
    throw ResultError(path + ": is damaged: " + error.what() + "; remove it and run again");
  }
}

std::size_t mergeResults(const ResultFolder& from, const ResultFolder& to, const Experiment& experiment) {
  std::size_t copied = 0;
  for (std::size_t pair = 0; pair < experiment.pairs.size(); ++pair) {
    for (std::size_t method = 0; method < experiment.methods.size(); ++method) {
      if (to.has(pair, method) || !from.has(pair, method)) continue;
      to.save(pair, method, from.load(pair, method));
      ++copied;
    }
  }
  return copied;
}

}  // namespace visual_localization
