#include "evaluation/evaluator.h"

#include <algorithm>
#include <set>
#include <utility>

#include "base/parallel.h"
#include "evaluation/drive_order.h"

namespace visual_localization {
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
    std::set<std::pair<std::size_t, bool>> roles;  // round, as a map
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
    return startImages(drive.images.size(), experiment_.closed, experiment_.starts);
  }
  std::size_t runsOf(std::size_t pair) const { return startsOf(pair).size(); }

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
                               mapErrors(partial, rounds_[spec.map].map_truth, drive)};
      results_.save(pair, method, summariseRuns(runMethod(context, how, startsOf(pair)), costs));
    }
  }

  std::vector<RunRecord> runMethod(const RunContext& context, const MethodSpec& method,
                                   const std::vector<std::size_t>& starts) {
    std::vector<RunRecord> runs(starts.size());
    const std::size_t traced = std::min(experiment_.trace_start, context.drive.images.size() - 1);
    const auto nearest = std::min_element(starts.begin(), starts.end(), [traced](std::size_t a, std::size_t b) {
      const auto distance = [traced](std::size_t start) { return start > traced ? start - traced : traced - start; };
      return distance(a) < distance(b);
    });
    parallelFor(
        starts.size(), threads_,
        [&](std::size_t i) { runs[i] = visual_localization::run(context, method, starts[i], starts[i] == *nearest); },
        [&](std::size_t done, std::size_t) { progress_("running", done_ + done, total_); });
    done_ += starts.size();
    progress_("running", done_, total_);
    return runs;
  }

  const Experiment& experiment_;
  const RoundSource& source_;
  const ResultFolder& results_;
  std::size_t threads_;
  const StageProgress& progress_;
  std::vector<RecordedRound> rounds_;
  std::size_t done_ = 0;   ///< runs
  std::size_t total_ = 0;  ///< runs
};

}  // namespace

void evaluate(const Experiment& experiment, const RoundSource& source, const ResultFolder& results, const Shard& shard,
              std::size_t threads, const StageProgress& progress) {
  Evaluation(experiment, source, results, threads, progress).run(shard);
}

}  // namespace visual_localization
