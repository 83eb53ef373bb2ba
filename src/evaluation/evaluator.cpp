#include "evaluation/evaluator.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <filesystem>
#include <limits>
#include <optional>
#include <set>
#include <system_error>
#include <utility>

#include "base/files.h"
#include "base/parallel.h"
#include "base/text.h"
#include "base/time.h"
#include "evaluation/run.h"
#include "parameters/yaml_map.h"

namespace visual_localization {
namespace {

namespace fs = std::filesystem;

const char* const kExperiment = "/experiment.yaml";
const char* const kProvenance = "/provenance.csv";
constexpr std::size_t kLargestResult_bytes = std::size_t{256} << 20U;

/// The part of an experiment's YAML that decides about results: no comments, no words for the report.
std::string decisivePart(const std::string& yaml, const std::string& path) {
  try {
    return parameters::withoutKeys(yaml, {"title", "source"});
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
  if (decisivePart(readFile(experiment, parameters::kLargestYaml_bytes), experiment) !=
      decisivePart(yaml_, experiment)) {
    throw ResultError(path_ +
                      ": holds results of another configuration (experiment.yaml differs); choose another folder");
  }
  if (readFile(path_ + kProvenance, kLargestResult_bytes) != provenance_) {
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
    return parseUnit(readFile(path, kLargestResult_bytes));
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

std::string trackCsvHeader() {
  return "stamp,east_m,north_m,yaw_rad,latitude_deg,longitude_deg,state,similarity,features,comparisons,extract_ms,"
         "match_ms,update_ms,source,inliers,reprojection_px,sigma_m,sigma_yaw_rad,swept,probability,off_map,reason,"
         "best_image,matches,features_kept,threshold,unconfirmed,rival_image,rival_east_m,rival_north_m,"
         "rival_probability,reason_figure,reason_east_m,reason_north_m,mean_grey,latency_ms,explanation\n";
}

namespace {

/// A field more; empty for what is not known.
void addKnown(std::ostringstream& out, double value) {
  out << ',';
  if (std::isfinite(value)) out << value;
}

void addReason(std::ostringstream& out, const Estimate& estimate) {
  constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();
  const ImageReport& image = estimate.image;
  addKnown(out, estimate.evidence.probability.value_or(kUnknown));
  addKnown(out, estimate.belief.off_map);
  out << ',' << textOf(estimate.why.reason).name << ',';
  if (estimate.comparisons > 0) out << estimate.tracked.best_image;
  out << ',' << estimate.tracked.best.matches << ',' << image.features_kept;
  addKnown(out, estimate.threshold.value_or(kUnknown));
  out << ',' << estimate.unconfirmed << ',';
  const std::optional<PlaceBelief::Place>& rival = estimate.belief.rival;
  if (rival) out << rival->training_image;
  addKnown(out, rival ? rival->position_m.x() : kUnknown);
  addKnown(out, rival ? rival->position_m.y() : kUnknown);
  addKnown(out, rival ? rival->probability : kUnknown);
  addKnown(out, estimate.why.figure);
  addKnown(out, estimate.why.position_m.x());
  addKnown(out, estimate.why.position_m.y());
  out << ',' << image.statistics.mean_grey << ',' << image.extract_ms + image.match_ms + estimate.update_ms << ','
      << csvField(describe(estimate.why));
}

}  // namespace

std::string trackCsvRow(const Estimate& estimate) {
  std::ostringstream out = numberStream();
  const PoseEstimate& pose = estimate.pose;
  const std::optional<MetricPose>& metric = estimate.metric;
  out << secondsText(estimate.stamp_ns) << ',' << pose.position_m.x() << ',' << pose.position_m.y() << ','
      << pose.yaw_rad << ',' << pose.geodetic.latitude_deg << ',' << pose.geodetic.longitude_deg << ','
      << toString(estimate.state) << ',' << estimate.tracked.best.similarity << ',' << estimate.featuresName() << ','
      << estimate.comparisons << ',' << estimate.image.extract_ms << ',' << estimate.image.match_ms << ','
      << estimate.update_ms << ',' << toString(estimate.source) << ',' << (metric ? metric->inliers : 0) << ','
      << (metric ? metric->reprojection_px : 0.0) << ',' << largerSigma(pose.covariance_m2) << ','
      << std::sqrt(pose.yaw_variance_rad2) << ',' << estimate.swept;
  addReason(out, estimate);
  out << '\n';
  return out.str();
}

namespace {

constexpr std::size_t kLongestPart = 60;  ///< of a file name, which has at most 255 bytes

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

namespace {

std::string shown(cv::Size size) { return std::to_string(size.width) + "x" + std::to_string(size.height); }

class Evaluation {
 public:
  Evaluation(const Experiment& experiment, const RoundSource& source, const ResultFolder& results, std::size_t threads,
             const StageProgress& progress)
      : experiment_(experiment),
        source_(source),
        results_(results),
        threads_(threads),
        progress_(progress),
        rounds_(experiment.rounds.size()) {}

  void run(const Shard& shard) {
    std::vector<std::size_t> pairs;
    for (std::size_t pair = 0; pair < experiment_.pairs.size(); ++pair) {
      if (shard.contains(pair) && !missingMethods(pair).empty()) pairs.push_back(pair);
    }
    readRounds(pairs);
    for (const std::size_t pair : pairs) total_ += runsOf(pair) * missingMethods(pair).size();
    for (const std::size_t pair : pairs) runPair(pair);
  }

 private:
  std::vector<std::size_t> missingMethods(std::size_t pair) const {
    std::vector<std::size_t> missing;
    for (std::size_t method = 0; method < experiment_.methods.size(); ++method) {
      if (!results_.hasWhole(pair, method)) missing.push_back(method);
    }
    return missing;
  }

  void readRounds(const std::vector<std::size_t>& pairs) {
    std::set<std::pair<std::size_t, bool>> roles;
    for (const std::size_t pair : pairs) {
      roles.insert({experiment_.pairs[pair].map, true});
      roles.insert({experiment_.pairs[pair].drive, false});
    }
    const std::vector<std::pair<std::size_t, bool>> tasks(roles.begin(), roles.end());
    parallelFor(
        tasks.size(), threads_,
        [&](std::size_t i) {
          const auto [round, is_map] = tasks[i];
          const RoundSpec& spec = experiment_.rounds[round];
          if (is_map) {
            rounds_[round].map = source_.map(spec);
            if (source_.map_truth) rounds_[round].map_truth = source_.map_truth(spec, *rounds_[round].map);
          } else {
            rounds_[round].drive = source_.drive(spec);
          }
        },
        [&](std::size_t done, std::size_t total) { progress_("reading rounds", done, total); });
  }

  std::vector<std::size_t> startsOf(std::size_t pair) const {
    const Drive& drive = *rounds_[experiment_.pairs[pair].drive].drive;
    if (experiment_.start_every > 0) {
      return startImagesEvery(drive.images.size(), experiment_.closed, experiment_.start_every, experiment_.run_images);
    }
    return startImages(drive.images.size(), experiment_.closed, experiment_.starts);
  }
  std::size_t runsOf(std::size_t pair) const { return startsOf(pair).size() * experiment_.seeds; }

  void runPair(std::size_t pair) {
    const PairSpec& spec = experiment_.pairs[pair];
    const auto& map = rounds_[spec.map].map;
    const Drive& drive = *rounds_[spec.drive].drive;
    if (map->header().image_size != drive.image_size) {
      throw ResultError("round " + experiment_.rounds[spec.map].name + " has images of " +
                        shown(map->header().image_size) + " pixels, round " + experiment_.rounds[spec.drive].name +
                        " of " + shown(drive.image_size) + ": they cannot be compared");
    }
    const ScoreTable table(drive, *map, experiment_.front_end.match, threads_);
    const StageCosts costs{drive.sift_ms, drive.global_ms, table.siftCompare_ms(), table.globalCompare_ms()};
    for (const std::size_t method : missingMethods(pair)) {
      const MethodSpec& how = experiment_.methods[method];
      const PartialMap partial = partOf(map, how.map_gap, how.map_spacing_m);
      const RunContext context{partial,
                               drive,
                               table,
                               experiment_.closed,
                               experiment_.found_within_m,
                               mapErrors(partial, rounds_[spec.map].map_truth, drive),
                               experiment_.rounds[spec.drive].accuracy,
                               experiment_.run_images,
                               experiment_.judge_from};
      results_.save(pair, method, summariseRuns(runMethod(context, how, startsOf(pair)), costs));
    }
  }

  std::vector<RunRecord> runMethod(const RunContext& context, const MethodSpec& method,
                                   const std::vector<std::size_t>& starts) {
    std::vector<RunRecord> runs(starts.size() * experiment_.seeds);
    const std::size_t traced = std::min(experiment_.trace_start, context.drive.images.size() - 1);
    const auto nearest = std::min_element(starts.begin(), starts.end(), [traced](std::size_t a, std::size_t b) {
      const auto distance = [traced](std::size_t start) { return start > traced ? start - traced : traced - start; };
      return distance(a) < distance(b);
    });
    parallelFor(
        runs.size(), threads_,
        [&](std::size_t i) {
          const std::size_t start = starts[i % starts.size()];
          const std::size_t repetition = i / starts.size();
          runs[i] = visual_localization::run(context, method, start, start == *nearest && repetition == 0, repetition);
        },
        [&](std::size_t done, std::size_t) { progress_("running", done_ + done, total_); });
    done_ += runs.size();
    progress_("running", done_, total_);
    return runs;
  }

  const Experiment& experiment_;
  const RoundSource& source_;
  const ResultFolder& results_;
  std::size_t threads_;
  const StageProgress& progress_;
  std::vector<RecordedRound> rounds_;
  std::size_t done_ = 0;
  std::size_t total_ = 0;
};

}  // namespace

void evaluate(const Experiment& experiment, const RoundSource& source, const ResultFolder& results, const Shard& shard,
              std::size_t threads, const StageProgress& progress) {
  Evaluation(experiment, source, results, threads, progress).run(shard);
}

}  // namespace visual_localization
