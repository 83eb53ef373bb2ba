#include "evaluation/evaluator.h"

#include <filesystem>
#include <stdexcept>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "test/evaluation/small_experiment.h"
#include "test/support/refusal.h"

namespace visual_localization {
namespace {

using ::testing::HasSubstr;

constexpr int kPairs = 4;
constexpr int kMethods = 3;

std::size_t unitsIn(const ResultFolder& results) {
  std::size_t units = 0;
  for (int pair = 0; pair < kPairs; ++pair) {
    for (int method = 0; method < kMethods; ++method)
      units += std::filesystem::exists(test::unitFile(results, pair, method));
  }
  return units;
}

const std::string& expectedTables() {
  static const std::string kTables = [] {
    const test::TemporaryFolder folder;
    const ResultFolder results = test::smallResults(folder.path());
    test::runSmall(results, {}, 1);
    return test::tablesOf(results);
  }();
  return kTables;
}

class Evaluator : public ::testing::Test {
 protected:
  test::TemporaryFolder folder_;
  ResultFolder results_ = test::smallResults(folder_ / "out");
};

TEST_F(Evaluator, FindsEveryPlaceThatLooksTheSameAgain) {
  test::runSmall(results_);
  const UnitResult best = results_.load(0, 2);
  ASSERT_EQ(best.runs.size(), 3U);
  EXPECT_EQ(best.runs[1].start, 8U);
  EXPECT_EQ(best.runs[1].images, 24U);
  EXPECT_NEAR(best.runs[1].mean_err_m, 0.0, 1e-3);
  EXPECT_EQ(best.runs[1].comparisons_per_image, 24.0);
  EXPECT_EQ(best.runs[1].steps_to_localise, 1U);
  EXPECT_EQ(best.recall_at_p99, 1.0);
}

TEST_F(Evaluator, GivesTheSameTablesWithAnyNumberOfThreads) {
  test::runSmall(results_, {}, 5);
  EXPECT_EQ(test::tablesOf(results_), expectedTables());
}

TEST_F(Evaluator, GivesTheSameTablesFromShards) {
  for (const std::size_t index : {3, 1, 2}) {
    const ResultFolder part = test::smallResults(folder_ / ("part" + std::to_string(index)));
    test::runSmall(part, {index, 3});
    EXPECT_EQ(unitsIn(part), index == 1 ? 6U : 3U);
    EXPECT_EQ(mergeResults(part, results_, test::smallExperiment()), unitsIn(part));
  }
  EXPECT_EQ(test::tablesOf(results_), expectedTables());
}

TEST_F(Evaluator, LeavesAShardWithoutPairsEmpty) {
  test::runSmall(results_, {5, 5});
  EXPECT_EQ(unitsIn(results_), 0U);
}

TEST_F(Evaluator, GoesOnWhereItWasInterrupted) {
  test::SyntheticRounds rounds;
  const auto interrupt = [](const std::string& stage, std::size_t done, std::size_t total) {
    if (stage == "running" && done > total / 3) throw std::runtime_error("interrupted");
  };
  EXPECT_THROW(evaluate(test::smallExperiment(), rounds.source(), results_, {}, 2, interrupt), std::runtime_error);
  EXPECT_GE(unitsIn(results_), 3U);
  EXPECT_LT(unitsIn(results_), 12U);
  const std::string kept = test::readAll(test::unitFile(results_, 0, 0));
  test::runSmall(results_);
  EXPECT_EQ(test::readAll(test::unitFile(results_, 0, 0)), kept);  // its times would differ
  EXPECT_EQ(test::tablesOf(results_), expectedTables());
}

TEST_F(Evaluator, ComputesOnlyWhatIsMissing) {
  test::runSmall(results_);
  std::filesystem::remove(test::unitFile(results_, 1, 2));
  std::filesystem::remove(test::unitFile(results_, 1, 0));
  test::SyntheticRounds rounds;
  std::size_t runs = 0;
  evaluate(test::smallExperiment(), rounds.source(), results_, {}, 2,
           [&runs](const std::string& stage, std::size_t, std::size_t total) {
             if (stage == "running") runs = total;
           });
  EXPECT_EQ(rounds.reads, 2);  // a map and a drive
  EXPECT_EQ(runs, 6U);
  EXPECT_EQ(test::tablesOf(results_), expectedTables());
}

TEST_F(Evaluator, ReadsNoRoundWhenAllIsDone) {
  test::runSmall(results_);
  test::SyntheticRounds rounds;
  evaluate(test::smallExperiment(), rounds.source(), results_, {}, 2, test::ignoreProgress);
  EXPECT_EQ(rounds.reads, 0);
}

TEST_F(Evaluator, MakesDamagedResultsAnew) {
  test::runSmall(results_);
  const std::string whole = test::readAll(test::unitFile(results_, 0, 0));
  test::writeAll(test::unitFile(results_, 0, 0), whole.substr(0, whole.size() / 2));
  test::writeAll(test::unitFile(results_, 0, 1), "");
  test::writeAll(test::unitFile(results_, 3, 2), std::string(1000, '\0'));
  test::runSmall(results_);
  EXPECT_EQ(test::tablesOf(results_), expectedTables());
}

TEST_F(Evaluator, NamesRoundsWhoseImagesCannotBeCompared) {
  test::SyntheticRounds rounds;
  rounds.drive()->image_size = {640, 480};
  EXPECT_THAT(test::refusalOf<ResultError>(
                  [&] { evaluate(test::smallExperiment(), rounds.source(), results_, {}, 2, test::ignoreProgress); }),
              HasSubstr("round a1 has images of 320x240 pixels, round b1 of 640x480"));
  EXPECT_EQ(unitsIn(results_), 0U);
}

TEST_F(Evaluator, PassesOnWhatIsWrongWithARound) {
  test::SyntheticRounds rounds;
  RoundSource source = rounds.source();
  source.drive = [](const RoundSpec& round) -> std::shared_ptr<const Drive> {
    throw std::runtime_error(round.bag + " is broken");
  };
  EXPECT_THROW(evaluate(test::smallExperiment(), source, results_, {}, 4, test::ignoreProgress), std::runtime_error);
  EXPECT_EQ(unitsIn(results_), 0U);
}

TEST_F(Evaluator, RunsWithTheLargestSeed) {
  const std::string yaml = test::smallYamlWith("recovery: paper", "recovery: paper, seed: 2147483647");
  const ResultFolder results(folder_ / "seed", yaml, "rounds");
  test::SyntheticRounds rounds;
  evaluate(parseExperiment(yaml, "small.yaml"), rounds.source(), results, {}, 2, test::ignoreProgress);
  EXPECT_EQ(unitsIn(results), 12U);
}

TEST_F(Evaluator, RunsOverARoundOfOneImage) {
  test::SyntheticRounds rounds(1);
  evaluate(test::smallExperiment(), rounds.source(), results_, {}, 2, test::ignoreProgress);
  EXPECT_EQ(results_.load(0, 0).runs.size(), 1U);
}

}  // namespace
}  // namespace visual_localization
