#include <map>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "evaluation/result_folder.h"
#include "test/evaluation/small_experiment.h"

namespace visual_localization {
namespace {

using ::testing::HasSubstr;
using ::testing::StartsWith;

using Row = std::map<std::string, std::string>;

std::vector<std::string> fieldsOf(const std::string& line) {
  std::vector<std::string> fields(1);
  for (const char c : line) {
    if (c == ',') {
      fields.emplace_back();
    } else {
      fields.back() += c;
    }
  }
  return fields;
}

class ResultTables : public ::testing::Test {
 protected:
  ResultTables() {
    for (std::size_t pair = 0; pair < 4; ++pair) {
      for (std::size_t method = 0; method < 3; ++method) results_.save(pair, method, test::unitOf(4, 4, 2.0));
    }
  }

  /// The rows of one method in a table.
  std::vector<Row> rowsOf(const std::string& name, const std::string& method) const {
    writeResultTables(test::smallExperiment(), results_);
    std::istringstream lines(test::readAll(results_.path() + "/" + name));
    std::string line;
    std::getline(lines, line);
    const std::vector<std::string> columns = fieldsOf(line);
    std::vector<Row> rows;
    while (std::getline(lines, line)) {
      const std::vector<std::string> fields = fieldsOf(line);
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
  try {
    writeResultTables(test::smallExperiment(), results_);
    ADD_FAILURE() << "written";
  } catch (const ResultError& error) {
    EXPECT_THAT(error.what(), StartsWith(results_.path()));
    EXPECT_THAT(error.what(), HasSubstr("'filter' with map b1 and drive a2 is missing"));
  }
  EXPECT_FALSE(std::filesystem::exists(results_.path() + "/methods.csv"));
}

}  // namespace
}  // namespace visual_localization
