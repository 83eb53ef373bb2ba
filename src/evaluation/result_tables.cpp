#include <algorithm>
#include <cmath>
#include <numeric>
#include <sstream>
#include <utility>

#include "base/files.h"
#include "base/numbers.h"
#include "base/text.h"
#include "evaluation/evaluator.h"

namespace visual_localization {
namespace {

const char* const kMeasures =
    "runs,mean_err_m,std_err_m,comparisons_per_image,ms_per_image,sift_share,median_err_m,within_5m,steps_to_localise,"
    "steps_to_relocalise,recall_at_p99,extract_ms,match_ms,update_ms,tracking_share,wrong_tracking,lost_precision,"
    "lost_recall,off_map_precision,off_map_recall,heading_err_deg,wrong_1m_share,wrong_5m_share,inside_95_share,"
    "metric_share,p95_err_m,recall_025m_2deg,recall_05m_5deg,recall_5m_10deg,nees,relative_err_m,relative_p95_err_m,"
    "relative_heading_err_deg,relative_recall_025m_2deg,relative_recall_05m_5deg,relative_recall_5m_10deg,"
    "relative_nees,filtered_err_m,filtered_inside_95_share,filtered_nees,relative_filtered_err_m,"
    "relative_filtered_inside_95_share,relative_filtered_nees,steps_to_localise_p95,steps_to_relocalise_p95,right_"
    "share,"
    "wrong_claims";

constexpr int kDigits = 6;
constexpr double kMostRuns = 0.95;

std::ostringstream table(const std::string& header) {
  std::ostringstream out = numberStream(kDigits);
  out << header << '\n';
  return out;
}

/// Each run counted by its images.
template <class Figure>
double meanOf(const std::vector<RunFigures>& runs, Figure figure) {
  double sum = 0.0;
  double images = 0.0;
  for (const RunFigures& run : runs) {
    sum += static_cast<double>(run.images) * figure(run);
    images += static_cast<double>(run.images);
  }
  return sum / images;
}

/// Of images with a true position only; NaN without any.
template <class Figure>
double meanOfJudged(const std::vector<RunFigures>& runs, Figure figure) {
  double sum = 0.0;
  double judged = 0.0;
  for (const RunFigures& run : runs) {
    sum += static_cast<double>(run.judged) * figure(run);
    judged += static_cast<double>(run.judged);
  }
  return sum / judged;
}

/// As in the papers' tables; NaN without any.
double deviationOf(const std::vector<RunFigures>& runs) {
  double sum = 0.0;
  double squares = 0.0;
  double count = 0.0;
  for (const RunFigures& run : runs) {
    if (run.judged == 0) continue;
    sum += run.mean_err_m;
    squares += run.mean_err_m * run.mean_err_m;
    count += 1.0;
  }
  const double variance = squares / count - sum * sum / (count * count);
  return variance < 0.0 ? 0.0 : std::sqrt(variance);
}

std::size_t judgedOf(const UnitResult& unit) {
  return std::accumulate(unit.runs.begin(), unit.runs.end(), std::size_t{0},
                         [](std::size_t sum, const RunFigures& run) { return sum + run.judged; });
}

/// Mean of a figure over the pairs that have a true position; NaN without any.
double meanOfPairs(const std::vector<UnitResult>& units, double UnitResult::*figure,
                   std::size_t (*imagesOf)(const UnitResult&) = judgedOf) {
  double sum = 0.0;
  double judged = 0.0;
  for (const UnitResult& unit : units) {
    if (imagesOf(unit) == 0) continue;
    sum += unit.*figure;
    judged += 1.0;
  }
  return sum / judged;
}

std::size_t relativeOf(const UnitResult& unit) { return unit.poses.relative.positions; }

/// A field for a number, empty when it is unknown.
struct Known {
  double number;
};
std::ostream& operator<<(std::ostream& out, Known known) {
  return std::isnan(known.number) ? out : out << known.number;
}

/// With a comma before each.
std::string poseMeasuresOf(const std::vector<UnitResult>& units) {
  PoseFigures poses;
  for (const UnitResult& unit : units) poses += unit.poses;
  const PoseErrors& absolute = poses.absolute;
  const PoseErrors& relative = poses.relative;
  std::ostringstream out = numberStream(kDigits);
  for (const double figure : {absolute.meanHeading_deg(),
                              poses.wrong1mShare(),
                              poses.wrong5mShare(),
                              absolute.insideShare(),
                              poses.metricShare(),
                              meanOfPairs(units, &UnitResult::p95_err_m),
                              absolute.recall(0),
                              absolute.recall(1),
                              absolute.recall(2),
                              absolute.meanNees(),
                              relative.meanPosition_m(),
                              meanOfPairs(units, &UnitResult::p95_relative_err_m, relativeOf),
                              relative.meanHeading_deg(),
                              relative.recall(0),
                              relative.recall(1),
                              relative.recall(2),
                              relative.meanNees(),
                              poses.filtered.meanPosition_m(),
                              poses.filtered.insideShare(),
                              poses.filtered.meanNees(),
                              poses.relative_filtered.meanPosition_m(),
                              poses.relative_filtered.insideShare(),
                              poses.relative_filtered.meanNees()}) {
    out << ',' << Known{figure};
  }
  return out.str();
}

Claims claimsOf(const std::vector<UnitResult>& units) {
  Claims claims;
  for (const UnitResult& unit : units) claims += unit.claims;
  return claims;
}

std::string measuresOf(const std::vector<UnitResult>& units, bool kidnapped) {
  std::vector<RunFigures> runs;
  for (const UnitResult& unit : units) runs.insert(runs.end(), unit.runs.begin(), unit.runs.end());
  std::vector<double> localised;
  std::vector<double> relocalised;
  for (const RunFigures& run : runs) {
    localised.push_back(static_cast<double>(run.steps_to_localise));
    relocalised.push_back(static_cast<double>(run.steps_to_relocalise));
  }
  const double extract_ms = meanOf(runs, [](const RunFigures& run) { return run.extract_ms; });
  const double match_ms = meanOf(runs, [](const RunFigures& run) { return run.match_ms; });
  const double update_ms = meanOf(runs, [](const RunFigures& run) { return run.update_ms; });
  std::ostringstream out = numberStream(kDigits);
  out << runs.size() << ',' << Known{meanOfJudged(runs, [](const RunFigures& run) { return run.mean_err_m; })} << ','
      << Known{deviationOf(runs)} << ','
      << meanOf(runs, [](const RunFigures& run) { return run.comparisons_per_image; }) << ','
      << extract_ms + match_ms + update_ms << ',' << meanOf(runs, [](const RunFigures& run) { return run.sift_share; })
      << ',' << Known{meanOfPairs(units, &UnitResult::median_err_m)} << ','
      << Known{meanOfJudged(runs, [](const RunFigures& run) { return run.within_5m; })} << ',' << upperMedian(localised)
      << ',';
  if (kidnapped) out << upperMedian(relocalised);
  out << ',' << Known{meanOfPairs(units, &UnitResult::recall_at_p99)} << ',' << extract_ms << ',' << match_ms << ','
      << update_ms;
  Trust trust;
  for (const UnitResult& unit : units) trust += unit.trust;
  for (const double share : {trust.trackingShare(), trust.wrongTracking(), trust.lostPrecision(), trust.lostRecall(),
                             trust.offMapPrecision(), trust.offMapRecall()}) {
    out << ',' << Known{share};
  }
  out << poseMeasuresOf(units) << ',' << nearestRank(localised, kMostRuns) << ',';
  if (kidnapped) out << nearestRank(relocalised, kMostRuns);
  const Claims claims = claimsOf(units);
  out << ',' << Known{claims.rightShare()} << ',' << Known{claims.wrongClaims()};
  return out.str();
}

using Groups = std::pair<std::string, std::string>;

/// In the order of the experiment.
std::vector<std::pair<Groups, std::vector<std::size_t>>> pairsByGroups(const Experiment& experiment) {
  std::vector<std::pair<Groups, std::vector<std::size_t>>> sorted;
  for (std::size_t i = 0; i < experiment.pairs.size(); ++i) {
    const Groups groups{experiment.rounds[experiment.pairs[i].map].group,
                        experiment.rounds[experiment.pairs[i].drive].group};
    const auto found =
        std::find_if(sorted.begin(), sorted.end(), [&groups](const auto& entry) { return entry.first == groups; });
    auto& entry = found == sorted.end() ? sorted.emplace_back(groups, std::vector<std::size_t>()) : *found;
    entry.second.push_back(i);
  }
  return sorted;
}

std::vector<StepSums> sumOfSteps(const std::vector<UnitResult>& units) {
  std::vector<StepSums> sums;
  for (const UnitResult& unit : units) {
    if (sums.size() < unit.steps.size()) sums.resize(unit.steps.size());
    for (std::size_t i = 0; i < unit.steps.size(); ++i) {
      sums[i].runs += unit.steps[i].runs;
      sums[i].judged += unit.steps[i].judged;
      sums[i].err_m += unit.steps[i].err_m;
      sums[i].comparisons += unit.steps[i].comparisons;
      sums[i].sift += unit.steps[i].sift;
    }
  }
  return sums;
}

void addSteps(const std::vector<StepSums>& steps, const std::string& prefix, std::ostringstream& out) {
  for (std::size_t i = 0; i < steps.size(); ++i) {
    const auto runs = static_cast<double>(steps[i].runs);
    out << prefix << ',' << i << ',';
    if (steps[i].judged > 0) out << steps[i].err_m / static_cast<double>(steps[i].judged);
    out << ',' << static_cast<double>(steps[i].comparisons) / runs << ',' << static_cast<double>(steps[i].sift) / runs
        << '\n';
  }
}

void addReliability(const Claims& claims, const std::string& prefix, std::ostringstream& out) {
  for (std::size_t i = 0; i < claims.bins.size(); ++i) {
    const Claims::Bin& bin = claims.bins[i];
    if (bin.images == 0) continue;
    const auto images = static_cast<double>(bin.images);
    out << prefix << ',' << Claims::kBins[i] << ',' << bin.images << ',' << bin.probability / images << ','
        << 1.0 - static_cast<double>(bin.wrong) / images << '\n';
  }
}

void writeGroupTables(const Experiment& experiment, const ResultFolder& results) {
  std::ostringstream summary = table(std::string("experiment,train_group,test_group,method,") + kMeasures);
  std::ostringstream steps = table("train_group,test_group,method,step,mean_err_m,comparisons,sift_share");
  std::ostringstream reliability = table("train_group,test_group,method,from,images,mean_probability,not_wrong_share");
  for (const auto& [groups, pairs] : pairsByGroups(experiment)) {
    for (std::size_t method = 0; method < experiment.methods.size(); ++method) {
      const MethodSpec& spec = experiment.methods[method];
      std::vector<UnitResult> units;
      for (const std::size_t pair : pairs) units.push_back(results.load(pair, method));
      const std::string prefix = csvField(groups.first) + ',' + csvField(groups.second) + ',' + csvField(spec.name);
      summary << csvField(experiment.name) << ',' << prefix << ',' << measuresOf(units, spec.kidnapped) << '\n';
      addSteps(sumOfSteps(units), prefix, steps);
      addReliability(claimsOf(units), prefix, reliability);
    }
  }
  writeFile(results.path() + "/steps.csv", steps.str());
  writeFile(results.path() + "/reliability.csv", reliability.str());
  writeFile(results.path() + "/summary.csv", summary.str());
}

void writePairTables(const Experiment& experiment, const ResultFolder& results) {
  std::ostringstream measures = table(std::string("train_round,test_round,train_group,test_group,method,") + kMeasures);
  std::ostringstream traces = table(std::string("train_round,test_round,method,") + kTraceColumns);
  TrajectoryFiles trajectories(results.path());
  for (std::size_t pair = 0; pair < experiment.pairs.size(); ++pair) {
    const RoundSpec& map = experiment.rounds[experiment.pairs[pair].map];
    const RoundSpec& drive = experiment.rounds[experiment.pairs[pair].drive];
    for (std::size_t method = 0; method < experiment.methods.size(); ++method) {
      const MethodSpec& spec = experiment.methods[method];
      const UnitResult unit = results.load(pair, method);
      measures << csvField(map.name) << ',' << csvField(drive.name) << ',' << csvField(map.group) << ','
               << csvField(drive.group) << ',' << csvField(spec.name) << ',' << measuresOf({unit}, spec.kidnapped)
               << '\n';
      const std::string prefix = csvField(map.name) + ',' + csvField(drive.name) + ',' + csvField(spec.name) + ',';
      for (const std::string& row : unit.trace) traces << prefix << row << '\n';
      trajectories.write(spec.name, map.name, drive.name, unit);
    }
  }
  writeFile(results.path() + "/pairs.csv", measures.str());
  writeFile(results.path() + "/traces.csv", traces.str());
}

void writeMethods(const Experiment& experiment, const ResultFolder& results) {
  std::ostringstream out = table("method,key,value");
  for (const MethodSpec& method : experiment.methods) {
    for (const auto& [key, value] : method.settings) {
      out << csvField(method.name) << ',' << csvField(key) << ',' << csvField(value) << '\n';
    }
  }
  writeFile(results.path() + "/methods.csv", out.str());
}

void requireComplete(const Experiment& experiment, const ResultFolder& results) {
  for (std::size_t pair = 0; pair < experiment.pairs.size(); ++pair) {
    for (std::size_t method = 0; method < experiment.methods.size(); ++method) {
      if (results.has(pair, method)) continue;
      throw ResultError(results.path() + ": the result of '" + experiment.methods[method].name + "' with map " +
                        experiment.rounds[experiment.pairs[pair].map].name + " and drive " +
                        experiment.rounds[experiment.pairs[pair].drive].name + " is missing");
    }
  }
}

}  // namespace

void writeResultTables(const Experiment& experiment, const ResultFolder& results) {
  requireComplete(experiment, results);
  writeMethods(experiment, results);
  writePairTables(experiment, results);
  writeGroupTables(experiment, results);
}

}  // namespace visual_localization
