#include <map>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "base/text.h"
#include "evaluation/evaluator.h"
#include "test/evaluation/small_experiment.h"
#include "test/support/refusal.h"

namespace visual_localization {
namespace {

using ::testing::HasSubstr;
using ::testing::StartsWith;

using Row = std::map<std::string, std::string>;

class ResultTables : public ::testing::Test {
 protected:
  ResultTables() {
    for (std::size_t pair = 0; pair < 4; ++pair) {
      for (std::size_t method = 0; method < 3; ++method) results_.save(pair, method, test::unitOf(4, 4, 2.0));
    }
  }

  std::vector<Row> rowsOf(const std::string& name, const std::string& method) const {
    writeResultTables(test::smallExperiment(), results_);
    std::istringstream lines(test::readAll(results_.path() + "/" + name));
    std::string line;
    std::getline(lines, line);
    const std::vector<std::string> columns = csvFields(line);
    std::vector<Row> rows;
    while (std::getline(lines, line)) {
      const std::vector<std::string> fields = csvFields(line);
      EXPECT_EQ(fields.size(), columns.size()) << line;
      Row row;
      for (std::size_t i = 0; i < fields.size(); ++i) row[columns[i]] = fields[i];
      if (row["method"] == method) rows.push_back(row);
    }
    return rows;
  }

  test::TemporaryFolder folder_;
  ResultFolder results_ = test::smallResults(folder_ / "out");
};

TEST_F(ResultTables, SummaryHasARowForEveryPairOfGroupsAndMethod) {
  std::vector<Row> rows = rowsOf("summary.csv", "swarm");
  ASSERT_EQ(rows.size(), 2U);
  EXPECT_EQ(rows[0]["experiment"], "small");
  EXPECT_EQ(rows[0]["train_group"] + rows[0]["test_group"], "ab");
  EXPECT_EQ(rows[1]["train_group"] + rows[1]["test_group"], "ba");
  EXPECT_EQ(rows[0]["runs"], "2");
  EXPECT_EQ(rows[0]["mean_err_m"], "2");
  EXPECT_EQ(rows[0]["std_err_m"], "0");
  EXPECT_EQ(rowsOf("pairs.csv", "swarm").size(), 4U);
}

TEST_F(ResultTables, MeansCountEveryJudgedImageOnce) {
  results_.save(0, 0, test::unitOf(10, 10, 1.0));
  results_.save(1, 0, test::unitOf(10, 5, 7.0));
  const Row row = rowsOf("summary.csv", "swarm").front();
  EXPECT_EQ(row.at("mean_err_m"), "3");
  EXPECT_EQ(row.at("within_5m"), "0.666667");
  EXPECT_EQ(row.at("std_err_m"), "3");
}

TEST_F(ResultTables, ARunWithoutTruePositionsIsNoPerfectRun) {
  results_.save(0, 0, test::unitOf(10, 10, 6.0));
  results_.save(1, 0, test::unitOf(10, 0, 0.0));
  const Row both = rowsOf("summary.csv", "swarm").front();
  for (const char* column : {"mean_err_m", "median_err_m"}) EXPECT_EQ(both.at(column), "6") << column;
  for (const char* column : {"std_err_m", "within_5m", "recall_at_p99"}) EXPECT_EQ(both.at(column), "0") << column;
  const Row unknown = rowsOf("pairs.csv", "swarm").at(1);
  for (const char* column : {"mean_err_m", "std_err_m", "median_err_m", "within_5m", "recall_at_p99"}) {
    EXPECT_EQ(unknown.at(column), "") << column;
  }
  EXPECT_EQ(unknown.at("runs"), "1");
}

TEST_F(ResultTables, PosesAreMeansOverTheImagesOfAllPairs) {
  UnitResult good = test::unitOf(4, 4, 2.0);
  good.poses.images = 4;
  good.poses.metric = 3;
  good.poses.wrong_1m = 2;
  good.poses.wrong_5m = 1;
  good.poses.absolute = {4, 8.0, 4, 10.0, {1, 2, 3}, 4, 3, 6.0};
  good.poses.relative = {2, 1.0, 2, 3.0, {2, 2, 2}, 2, 2, 5.0};
  good.p95_err_m = 3.0;
  good.p95_relative_err_m = 0.75;
  UnitResult bad = test::unitOf(4, 4, 2.0);
  bad.poses.images = 12;
  bad.poses.absolute = {12, 0.0, 12, 6.0, {0, 0, 1}, 0, 0, 0.0};
  bad.p95_err_m = 5.0;
  results_.save(0, 0, good);
  results_.save(1, 0, bad);
  Row row = rowsOf("summary.csv", "swarm").front();
  const std::map<std::string, std::string> expected{{"heading_err_deg", "1"},
                                                    {"wrong_1m_share", "0.125"},
                                                    {"wrong_5m_share", "0.0625"},
                                                    {"inside_95_share", "0.75"},
                                                    {"metric_share", "0.1875"},
                                                    {"p95_err_m", "4"},
                                                    {"recall_025m_2deg", "0.0625"},
                                                    {"recall_05m_5deg", "0.125"},
                                                    {"recall_5m_10deg", "0.25"},
                                                    {"nees", "1.5"},
                                                    {"relative_err_m", "0.5"},
                                                    {"relative_p95_err_m", "0.75"},
                                                    {"relative_heading_err_deg", "1.5"},
                                                    {"relative_recall_025m_2deg", "1"},
                                                    {"relative_nees", "2.5"}};
  for (const auto& [column, value] : expected) EXPECT_EQ(row[column], value) << column;
}

TEST_F(ResultTables, ClaimsAreCountedOverAllPairs) {
  UnitResult unit = test::unitOf(4, 4, 2.0);
  unit.claims = {};
  unit.claims.images = 4;
  unit.claims.right = 1;
  unit.claims.tracking = 2;
  unit.claims.tracking_wrong = 1;
  unit.claims.bins[10] = {2, 1, 1.96};
  for (const std::size_t pair : {0U, 1U}) results_.save(pair, 0, unit);
  Row row = rowsOf("summary.csv", "swarm").front();
  EXPECT_EQ(row["right_share"], "0.25");
  EXPECT_EQ(row["wrong_claims"], "0.5");
  const std::vector<Row> bins = rowsOf("reliability.csv", "swarm");
  ASSERT_EQ(bins.size(), 1U) << "bins without images are left out";
  row = bins.front();
  EXPECT_EQ(row["from"] + " " + row["images"], "0.97 4");
  EXPECT_EQ(row["mean_probability"] + " " + row["not_wrong_share"], "0.98 0.5");
}

TEST_F(ResultTables, MethodsWithoutPosesLeaveTheirFieldsEmpty) {
  Row row = rowsOf("summary.csv", "best").front();
  for (const char* column : {"heading_err_deg", "wrong_1m_share", "wrong_5m_share", "inside_95_share", "metric_share",
                             "recall_5m_10deg", "nees", "relative_err_m", "relative_p95_err_m", "relative_nees"}) {
    ASSERT_EQ(row.count(column), 1U) << column;
    EXPECT_EQ(row[column], "") << column;
  }
}

TEST_F(ResultTables, TracedRunsBecomeTrajectories) {
  UnitResult unit = test::unitOf(2, 2, 1.0);
  unit.trace = {"7,0,7,,,,,,0,1,1,1,1,1,SIFT,,", "7,1,8,,,,,,0,1,1,1,1,1,SIFT,,"};
  unit.trajectory = {{"1.5 1 2 0 0 0 0 1", "1.5 1 2.5 0 0 0 0 1"}, {"2.5 2 2 0 0 0 0 1", ""}};
  results_.save(0, 0, unit);
  writeResultTables(test::smallExperiment(), results_);
  const std::string path = results_.path() + "/trajectories/swarm__a1__b1__7";
  EXPECT_EQ(test::readAll(path + ".tum"), "1.5 1 2 0 0 0 0 1\n2.5 2 2 0 0 0 0 1\n");
  EXPECT_EQ(test::readAll(path + ".truth.tum"), "1.5 1 2.5 0 0 0 0 1\n");
  EXPECT_FALSE(std::filesystem::exists(results_.path() + "/trajectories/best__a1__b1__7.tum"));
}

TEST(TrajectoryFiles, NamesOfMethodsBecomeDifferentFileNames) {
  const test::TemporaryFolder folder;
  TrajectoryFiles files(folder.path());
  UnitResult unit;
  unit.trace = {"0,0"};
  unit.trajectory = {{"first", ""}};
  files.write("../swarm, 80", "a", "b", unit);
  unit.trajectory = {{"second", ""}};
  files.write("../swarm; 80", "a", "b", unit);
  files.write(std::string(500, 'x'), "a", "b", unit);
  EXPECT_EQ(test::readAll(folder / "trajectories/.._swarm__80__a__b__0.tum"), "first\n");
  EXPECT_EQ(test::readAll(folder / "trajectories/.._swarm__80_2__a__b__0.tum"), "second\n");
}

TEST_F(ResultTables, OnlyTheKidnappedRelocalise) {
  EXPECT_EQ(rowsOf("summary.csv", "swarm").front()["steps_to_relocalise"], "");
  EXPECT_EQ(rowsOf("summary.csv", "filter").front()["steps_to_relocalise"], "0");
}

TEST_F(ResultTables, StepsAreMeansOverTheRuns) {
  results_.save(0, 0, test::unitOf(2, 1, 4.0));
  std::vector<Row> rows = rowsOf("steps.csv", "swarm");
  ASSERT_EQ(rows.size(), 8U);
  EXPECT_EQ(rows[0]["mean_err_m"], "3");
  EXPECT_EQ(rows[1]["mean_err_m"], "2");
  EXPECT_EQ(rows[1]["comparisons"], "7");
}

TEST_F(ResultTables, NamesWithCommasAndQuotesStayOneField) {
  const std::string yaml = test::smallYamlWith("name: best", "name: 'best, \"single\"'");
  const ResultFolder results(folder_ / "quoted", yaml, "rounds");
  mergeResults(results_, results, test::smallExperiment());
  writeResultTables(parseExperiment(yaml, "small.yaml"), results);
  EXPECT_THAT(test::readAll(results.path() + "/summary.csv"), HasSubstr("small,a,b,\"best, \"\"single\"\"\",2,"));
}

TEST_F(ResultTables, NothingIsWrittenWhileAResultIsMissing) {
  std::filesystem::remove(test::unitFile(results_, 3, 1));
  const std::string refusal =
      test::refusalOf<ResultError>([&] { writeResultTables(test::smallExperiment(), results_); });
  EXPECT_THAT(refusal, StartsWith(results_.path()));
  EXPECT_THAT(refusal, HasSubstr("'filter' with map b1 and drive a2 is missing"));
  EXPECT_FALSE(std::filesystem::exists(results_.path() + "/methods.csv"));
}

}  // namespace
}  // namespace visual_localization
