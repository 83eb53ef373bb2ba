#include "evaluation/unit_result.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <locale>
#include <optional>
#include <sstream>
#include <stdexcept>
#include <string>
#include <utility>

#include "base/numbers.h"
#include "base/text.h"
#include "base/time.h"
#include "evaluation/metrics.h"

namespace visual_localization {
namespace {

constexpr double kPrecision = 0.99;
constexpr double kMost = 0.95;

std::ostringstream numbers() { return numberStream(std::numeric_limits<double>::digits10); }

RunFigures figuresOf(const RunRecord& run, const StageCosts& costs) {
  RunFigures figures;
  figures.start = run.start;
  figures.images = run.steps.size();
  figures.steps_to_localise = run.steps_to_localise;
  figures.steps_to_relocalise = run.steps_to_relocalise;
  for (const StepRecord& step : run.steps) {
    figures.comparisons_per_image += step.comparisons;
    figures.sift_share += step.sift ? 1.0 : 0.0;
    if (std::isnan(step.error_m)) continue;
    ++figures.judged;
    figures.mean_err_m += static_cast<double>(step.error_m);
    figures.within_5m += static_cast<double>(step.error_m) < kRight_m ? 1.0 : 0.0;
  }
  const auto images = static_cast<double>(figures.images);
  const auto judged = static_cast<double>(std::max<std::size_t>(1, figures.judged));
  figures.mean_err_m /= judged;
  figures.within_5m /= judged;
  figures.comparisons_per_image /= images;
  figures.sift_share /= images;
  figures.extract_ms = (static_cast<double>(run.sift_extractions) * costs.sift_extraction_ms +
                        static_cast<double>(run.global_extractions) * costs.global_extraction_ms) /
                       images;
  figures.match_ms = (static_cast<double>(run.sift_comparisons) * costs.sift_comparison_ms +
                      static_cast<double>(run.global_comparisons) * costs.global_comparison_ms) /
                     images;
  figures.update_ms = run.method_ms / images;
  return figures;
}

void add(const StepRecord& step, StepSums& sums) {
  ++sums.runs;
  sums.comparisons += step.comparisons;
  sums.sift += step.sift ? 1 : 0;
  if (std::isnan(step.error_m)) return;
  ++sums.judged;
  sums.err_m += static_cast<double>(step.error_m);
}

TracedPose tracedPose(const TraceRecord& trace) {
  TracedPose pose{tumLine(trace.estimate), ""};
  if (trace.truth_m) pose.truth = tumLine(trace.estimate.stamp_ns, *trace.truth_m, trace.true_yaw_rad.value_or(0.0));
  return pose;
}

/// 0 of none.
double mostOf(std::vector<double> errors_m) {
  if (errors_m.empty()) return 0.0;
  std::sort(errors_m.begin(), errors_m.end());
  return quantile(errors_m, kMost);
}

/// m/s; nothing where a true position is missing or time goes back.
std::optional<double> robotSpeed_mps(const TraceRecord& before, const TraceRecord& now) {
  const double seconds = secondsBetween(before.estimate.stamp_ns, now.estimate.stamp_ns);
  if (!before.truth_m || !now.truth_m || seconds <= 0.0) return std::nullopt;
  return (*now.truth_m - *before.truth_m).norm() / seconds;
}

std::string traceRow(const RunRecord& run, std::size_t step) {
  const TraceRecord& trace = run.trace[step];
  const Estimate& estimate = trace.estimate;
  const TrackerReport& tracker = estimate.tracked.report;
  std::ostringstream out = numbers();
  out << run.start << ',' << step << ',' << trace.image << ',';
  if (!std::isnan(run.steps[step].error_m)) out << run.steps[step].error_m;
  for (const char* key : {"v0", "speed_ema", "quantum_share", "phi2"}) {
    out << ',';
    if (tracker.value("v0") > 0.0) out << tracker.value(key);  // others have nothing to tune
  }
  out << ',' << (estimate.tracked.recovering ? 1 : 0) << ',' << estimate.tracked.spread_m.x() << ','
      << estimate.tracked.spread_m.y() << ',' << trace.diversity_m << ',' << estimate.tracked.best.similarity << ','
      << estimate.comparisons << ',' << estimate.featuresName() << ',';
  if (tracker.value("speed_mps") > 0.0) out << tracker.value("speed_mps");
  out << ',';
  const auto robot_mps = step > 0 ? robotSpeed_mps(run.trace[step - 1], trace) : std::nullopt;
  if (robot_mps) out << *robot_mps;
  return out.str();
}

}  // namespace

const char* const kTraceColumns =
    "start,step,image,err_m,v0,speed_ema,quantum_share,phi2,recovering,spread_x_m,spread_y_m,diversity_m,similarity,"
    "comparisons,features,swarm_mps,robot_mps";

UnitResult summariseRuns(const std::vector<RunRecord>& runs, const StageCosts& costs) {
  UnitResult unit;
  std::vector<double> errors_m;
  std::vector<double> relative_m;
  std::vector<Decision> decisions;
  for (const RunRecord& run : runs) {
    unit.runs.push_back(figuresOf(run, costs));
    if (unit.steps.size() < run.steps.size()) unit.steps.resize(run.steps.size());
    for (std::size_t i = 0; i < run.steps.size(); ++i) {
      const StepRecord& step = run.steps[i];
      add(step, unit.steps[i]);
      unit.trust.add(step);
      unit.claims.add(step);
      unit.poses.add(step);
      if (!std::isnan(step.relative.position_m)) relative_m.push_back(static_cast<double>(step.relative.position_m));
      if (std::isnan(step.error_m)) continue;
      errors_m.push_back(static_cast<double>(step.error_m));
      decisions.push_back({static_cast<double>(step.confidence), errors_m.back() < kRight_m});
    }
    for (std::size_t i = 0; i < run.trace.size(); ++i) {
      unit.trace.push_back(traceRow(run, i));
      unit.trajectory.push_back(tracedPose(run.trace[i]));
    }
  }
  unit.p95_err_m = mostOf(errors_m);
  unit.p95_relative_err_m = mostOf(std::move(relative_m));
  unit.median_err_m = summarise(std::move(errors_m)).median_m;
  unit.recall_at_p99 = recallAtPrecision(std::move(decisions), kPrecision);
  return unit;
}

namespace {

/// Reads lines of a section until an empty one.
class SectionReader {
 public:
  explicit SectionReader(const std::string& text) : in_(text) {}

  void expect(const std::string& title) {
    std::string line;
    if (!std::getline(in_, line) || line != title) throw std::runtime_error("section '" + title + "' is missing");
  }
  bool next(std::string& line) {
    if (!std::getline(in_, line)) throw std::runtime_error("is cut off");
    return !line.empty();
  }
  bool atEnd() { return in_.peek() == std::istringstream::traits_type::eof(); }

 private:
  std::istringstream in_;
};

/// The numbers of one line, in the order in which they were written.
class NumberReader {
 public:
  explicit NumberReader(const std::string& line) : in_(line) { in_.imbue(std::locale::classic()); }

  template <class Number>
  NumberReader& operator>>(Number& number) {
    const bool follows = first_ || in_.get() == ',';
    first_ = false;
    if (!follows || !(in_ >> number)) refuse();
    return *this;
  }
  void finish() {
    if (in_.get() != std::istringstream::traits_type::eof()) refuse();
  }

 private:
  [[noreturn]] static void refuse() { throw std::runtime_error("has a line that is no list of numbers"); }

  std::istringstream in_;
  bool first_ = true;
};

void read(const std::string& line, RunFigures& run) {
  NumberReader numbers(line);
  numbers >> run.start >> run.images >> run.judged >> run.mean_err_m >> run.within_5m >> run.comparisons_per_image >>
      run.sift_share >> run.steps_to_localise >> run.steps_to_relocalise >> run.extract_ms >> run.match_ms >>
      run.update_ms;
  numbers.finish();
}

void read(const std::string& line, StepSums& step) {
  NumberReader numbers(line);
  numbers >> step.runs >> step.judged >> step.err_m >> step.comparisons >> step.sift;
  numbers.finish();
}

std::ptrdiff_t fieldsOf(const std::string& row) { return std::count(row.begin(), row.end(), ',') + 1; }

/// Where a line is lost, runs and steps disagree about the number of images.
void requireConsistent(const UnitResult& unit) {
  if (unit.runs.empty()) throw std::runtime_error("has no run");
  std::size_t images = 0;
  std::size_t judged = 0;
  for (const RunFigures& run : unit.runs) {
    images += run.images;
    judged += run.judged;
  }
  for (const StepSums& step : unit.steps) {
    images -= step.runs;
    judged -= step.judged;
  }
  if (images != 0 || judged != 0) throw std::runtime_error("has runs and steps that do not fit together");
  if (unit.trace.size() != unit.trajectory.size()) {
    throw std::runtime_error("has a trace and a trajectory that do not fit together");
  }
}

void write(const Claims& claims, std::ostringstream& out) {
  out << "\nclaims\n"
      << claims.images << ',' << claims.right << ',' << claims.tracking << ',' << claims.tracking_wrong << '\n';
  for (const Claims::Bin& bin : claims.bins) out << bin.images << ',' << bin.wrong << ',' << bin.probability << '\n';
}

void readClaims(SectionReader& sections, Claims& claims) {
  std::string line;
  sections.next(line);
  NumberReader counts(line);
  counts >> claims.images >> claims.right >> claims.tracking >> claims.tracking_wrong;
  counts.finish();
  for (Claims::Bin& bin : claims.bins) {
    sections.next(line);
    NumberReader numbers(line);
    numbers >> bin.images >> bin.wrong >> bin.probability;
    numbers.finish();
  }
  if (sections.next(line)) throw std::runtime_error("has more lines of claims than bins");
}

void write(const PoseErrors& errors, std::ostringstream& out) {
  out << errors.positions << ',' << errors.position_m << ',' << errors.headings << ',' << errors.heading_deg;
  for (const std::size_t recalled : errors.recalled) out << ',' << recalled;
  out << ',' << errors.claims << ',' << errors.inside_95 << ',' << errors.nees << '\n';
}

void read(const std::string& line, PoseErrors& errors) {
  NumberReader numbers(line);
  numbers >> errors.positions >> errors.position_m >> errors.headings >> errors.heading_deg;
  for (std::size_t& recalled : errors.recalled) numbers >> recalled;
  numbers >> errors.claims >> errors.inside_95 >> errors.nees;
  numbers.finish();
}

void write(const PoseFigures& poses, std::ostringstream& out) {
  out << "\nposes\n" << poses.images << ',' << poses.metric << ',' << poses.wrong_1m << ',' << poses.wrong_5m << '\n';
  for (const PoseErrors* errors : {&poses.absolute, &poses.relative, &poses.filtered, &poses.relative_filtered}) {
    write(*errors, out);
  }
}

void readPoses(SectionReader& sections, PoseFigures& poses) {
  std::string line;
  sections.next(line);
  NumberReader counts(line);
  counts >> poses.images >> poses.metric >> poses.wrong_1m >> poses.wrong_5m;
  counts.finish();
  for (PoseErrors* errors : {&poses.absolute, &poses.relative, &poses.filtered, &poses.relative_filtered}) {
    sections.next(line);
    read(line, *errors);
  }
  if (sections.next(line)) throw std::runtime_error("has more than five lines of poses");
}

/// One line of the trajectory and, behind it, of the true one.
TracedPose readTracedPose(const std::string& line) {
  constexpr std::ptrdiff_t kFields = 8;
  std::size_t end = 0;
  for (std::ptrdiff_t i = 0; i < kFields && end != std::string::npos; ++i) end = line.find(' ', end + 1);
  const auto fields = std::count(line.begin(), line.end(), ' ') + 1;
  if (fields == kFields) return {line, ""};
  if (fields != 2 * kFields) throw std::runtime_error("has a line of a trajectory that is not whole");
  return {line.substr(0, end), line.substr(end + 1)};
}

}  // namespace

std::string serialise(const UnitResult& unit) {
  std::ostringstream out = numberStream(std::numeric_limits<double>::digits10);
  out << "runs\n";
  for (const RunFigures& run : unit.runs) {
    out << run.start << ',' << run.images << ',' << run.judged << ',' << run.mean_err_m << ',' << run.within_5m << ','
        << run.comparisons_per_image << ',' << run.sift_share << ',' << run.steps_to_localise << ','
        << run.steps_to_relocalise << ',' << run.extract_ms << ',' << run.match_ms << ',' << run.update_ms << '\n';
  }
  out << "\nsteps\n";
  for (const StepSums& step : unit.steps) {
    out << step.runs << ',' << step.judged << ',' << step.err_m << ',' << step.comparisons << ',' << step.sift << '\n';
  }
  out << "\ntrace\n";
  for (const std::string& row : unit.trace) out << row << '\n';
  out << "\ntrajectory\n";
  for (const TracedPose& pose : unit.trajectory) {
    out << pose.estimate << (pose.truth.empty() ? "" : " ") << pose.truth << '\n';
  }
  const Trust& trust = unit.trust;
  out << "\ntrust\n"
      << trust.tracking_right << ',' << trust.tracking_wrong << ',' << trust.lost_right << ',' << trust.lost_wrong
      << ',' << trust.off_map_right << ',' << trust.off_map_wrong << ',' << trust.off_map_missed << '\n';
  write(unit.claims, out);
  write(unit.poses, out);
  out << "\nall\n"
      << unit.median_err_m << ',' << unit.recall_at_p99 << ',' << unit.p95_err_m << ',' << unit.p95_relative_err_m
      << "\n\n";
  return out.str();
}

UnitResult parseUnit(const std::string& text) {
  UnitResult unit;
  SectionReader sections(text);
  std::string line;
  sections.expect("runs");
  while (sections.next(line)) read(line, unit.runs.emplace_back());
  sections.expect("steps");
  while (sections.next(line)) read(line, unit.steps.emplace_back());
  sections.expect("trace");
  while (sections.next(line)) {
    if (fieldsOf(line) != fieldsOf(kTraceColumns)) throw std::runtime_error("has a line of a trace that is not whole");
    unit.trace.push_back(line);
  }
  sections.expect("trajectory");
  while (sections.next(line)) unit.trajectory.push_back(readTracedPose(line));
  sections.expect("trust");
  sections.next(line);
  Trust& trust = unit.trust;
  NumberReader trusted(line);
  trusted >> trust.tracking_right >> trust.tracking_wrong >> trust.lost_right >> trust.lost_wrong >>
      trust.off_map_right >> trust.off_map_wrong >> trust.off_map_missed;
  trusted.finish();
  if (sections.next(line)) throw std::runtime_error("has more than one line of trust");
  sections.expect("claims");
  readClaims(sections, unit.claims);
  sections.expect("poses");
  readPoses(sections, unit.poses);
  sections.expect("all");
  sections.next(line);
  NumberReader all(line);
  all >> unit.median_err_m >> unit.recall_at_p99 >> unit.p95_err_m >> unit.p95_relative_err_m;
  all.finish();
  if (sections.next(line) || !sections.atEnd()) throw std::runtime_error("goes on behind its end");
  requireConsistent(unit);
  return unit;
}

}  // namespace visual_localization
