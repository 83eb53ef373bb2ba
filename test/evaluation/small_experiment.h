#pragma once

#include <atomic>
#include <memory>
#include <sstream>
#include <string>
#include <vector>

#include "base/text.h"
#include "evaluation/evaluator.h"
#include "test/support/synthetic.h"
#include "test/support/temporary_folder.h"

namespace visual_localization::test {

/// Three rounds, four pairs, three methods of each kind.
inline std::string smallYaml() {
  return R"(experiment: small
rounds:
  bags:
    - {name: a1, bag: a1.bag, group: a}
    - {name: a2, bag: a2.bag, group: a}
    - {name: b1, bag: b1.bag, group: b}
pairs: [[a, b], [b, a]]
starts: 3
parameters: {recovery: paper}
methods:
  - {name: swarm, tracker: dpso, parameters: {dpso/particles: 20}}
  - {name: filter, tracker: pf_gaussian, parameters: {pf/particles: 20}, kidnapped: true}
  - {name: best, tracker: exhaustive}
)";
}

/// The part must be there.
inline std::string smallYamlWith(const std::string& part, const std::string& replacement) {
  std::string yaml = smallYaml();
  return yaml.replace(yaml.find(part), part.size(), replacement);
}

inline Experiment smallExperiment() { return parseExperiment(smallYaml(), "small.yaml"); }

/// Rounds on a circle, every place with features of its own that do not change from round to round.
class SyntheticRounds {
 public:
  explicit SyntheticRounds(std::size_t images = 24) {
    const auto places = mapAt(circle(images, 12.0));
    std::vector<TrainingImage> trained;
    auto drive = std::make_shared<Drive>();
    drive->image_size = places->header().image_size;
    for (std::uint32_t i = 0; i < images; ++i) {
      trained.push_back(places->image(i));
      trained.back().local = randomFeatures(12, i);
      DriveImage image;
      image.stamp_ns = trained.back().stamp_ns;
      image.truth = TruePose{places->frame().toGeodetic(trained.back().position_m)};
      image.local = randomFeatures(12, i);
      drive->images.push_back(image);
    }
    map_ = std::make_shared<TrainingMap>(places->header(), std::move(trained));
    drive_ = drive;
  }

  RoundSource source() {
    return {[this](const RoundSpec&) {
              ++reads;
              return map_;
            },
            [this](const RoundSpec&) {
              ++reads;
              return drive_;
            }};
  }
  const std::shared_ptr<const TrainingMap>& map() const { return map_; }
  const std::shared_ptr<Drive>& drive() const { return drive_; }

  std::atomic<int> reads{0};

 private:
  std::shared_ptr<const TrainingMap> map_;
  std::shared_ptr<Drive> drive_;
};

inline void ignoreProgress(const std::string&, std::size_t, std::size_t) {}

inline ResultFolder smallResults(const std::string& path) { return ResultFolder(path, smallYaml(), "rounds"); }

inline void runSmall(const ResultFolder& results, const Shard& shard = {}, std::size_t threads = 2) {
  SyntheticRounds rounds;
  evaluate(smallExperiment(), rounds.source(), results, shard, threads, ignoreProgress);
}

/// Columns that no two runs agree on.
inline std::string withoutTimes(const std::string& table) {
  std::istringstream lines(table);
  std::vector<bool> is_time;
  std::string kept;
  for (std::string line; std::getline(lines, line);) {
    const std::vector<std::string> fields = csvFields(line);
    for (std::size_t column = 0; column < fields.size(); ++column) {
      const std::string& field = fields[column];
      if (kept.find('\n') == std::string::npos) {
        is_time.push_back(field == "ms_per_image" || field == "extract_ms" || field == "match_ms" ||
                          field == "update_ms");
      }
      if (!is_time[column]) kept += field + ',';
    }
    kept += '\n';
  }
  return kept;
}

/// In one text, without times.
inline std::string tablesOf(const ResultFolder& results) {
  writeResultTables(smallExperiment(), results);
  std::string text;
  for (const char* name : {"methods", "pairs", "steps", "summary", "traces"}) {
    text += withoutTimes(readAll(results.path() + "/" + name + ".csv"));
  }
  return text;
}

inline std::string unitFile(const ResultFolder& results, int pair, int method) {
  return results.path() + "/units/pair" + std::to_string(pair) + "_method" + std::to_string(method) + ".csv";
}

/// A result of one run of `images` images, the first `judged` of them with an error of `err_m`.
inline UnitResult unitOf(std::size_t images, std::size_t judged, double err_m) {
  UnitResult unit;
  RunFigures run;
  run.images = images;
  run.judged = judged;
  run.mean_err_m = judged == 0 ? 0.0 : err_m;
  run.within_5m = judged > 0 && err_m < 5.0 ? 1.0 : 0.0;
  unit.runs = {run};
  for (std::size_t i = 0; i < images; ++i)
    unit.steps.push_back({1, i < judged ? 1U : 0U, i < judged ? err_m : 0.0, 7, 1});
  unit.median_err_m = run.mean_err_m;
  unit.recall_at_p99 = run.within_5m;
  return unit;
}

}  // namespace visual_localization::test
