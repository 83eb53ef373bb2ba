#include <filesystem>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "base/files.h"
#include "evaluation/evaluator.h"
#include "test/evaluation/small_experiment.h"
#include "test/support/refusal.h"

namespace visual_localization {
namespace {

namespace fs = std::filesystem;
using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;
using ::testing::StartsWith;

class ResultFolderTest : public ::testing::Test {
 protected:
  std::string refusalToOpen(const std::string& yaml, const std::string& provenance = "rounds") const {
    return test::refusalOf<ResultError>([&] { ResultFolder(path_, yaml, provenance); });
  }
  ResultFolder withAResult() const {
    ResultFolder results = test::smallResults(path_);
    results.save(0, 0, unit_);
    return results;
  }

  test::TemporaryFolder folder_;
  std::string path_ = folder_ / "out";
  UnitResult unit_ = test::unitOf(4, 4, 2.5);
};

TEST_F(ResultFolderTest, KeepsWhatIsSaved) {
  withAResult();
  const ResultFolder again = test::smallResults(path_);
  EXPECT_TRUE(again.hasWhole(0, 0));
  EXPECT_FALSE(again.has(0, 1));
  EXPECT_FALSE(again.has(1, 0));
  EXPECT_EQ(serialise(again.load(0, 0)), serialise(unit_));
}

TEST_F(ResultFolderTest, CommentsAndWordsForTheReportMayChange) {
  withAResult();
  const std::string other = "# a remark\n" + test::smallYaml() + "title: A title\nsource: A paper\n";
  EXPECT_EQ(refusalToOpen(other), "accepted");
  EXPECT_EQ(test::readAll(path_ + "/experiment.yaml"), other);
}

TEST_F(ResultFolderTest, RefusesResultsOfSomethingElse) {
  withAResult();
  EXPECT_THAT(refusalToOpen(test::smallYamlWith("starts: 3", "starts: 4")),
              AllOf(StartsWith(path_ + ": holds results of another configuration"), HasSubstr("experiment.yaml")));
  EXPECT_THAT(refusalToOpen(test::smallYaml(), "other rounds"),
              AllOf(StartsWith(path_ + ": holds results of other rounds"), HasSubstr("provenance.csv")));
  EXPECT_EQ(test::readAll(path_ + "/experiment.yaml"), test::smallYaml());
}

TEST_F(ResultFolderTest, AnAttemptWithoutResultsDoesNotBindTheFolder) {
  test::smallResults(path_);
  EXPECT_EQ(refusalToOpen(test::smallYamlWith("starts: 3", "starts: 4"), "other rounds"), "accepted");
  EXPECT_EQ(test::readAll(path_ + "/provenance.csv"), "other rounds");
}

TEST_F(ResultFolderTest, SavesNothingBesideTheResultsOfAnotherExperiment) {
  const ResultFolder results = test::smallResults(path_);
  const ResultFolder thief(path_, test::smallYamlWith("starts: 3", "starts: 4"), "rounds");
  EXPECT_THAT(test::refusalOf<ResultError>([&] { results.save(0, 0, unit_); }), HasSubstr("another configuration"));
  EXPECT_FALSE(results.has(0, 0));
}

TEST_F(ResultFolderTest, RefusesResultsOfUnknownOrigin) {
  for (const char* name : {"experiment.yaml", "provenance.csv"}) {
    fs::remove_all(path_);
    withAResult();
    fs::remove(path_ + "/" + name);
    EXPECT_THAT(refusalToOpen(test::smallYaml()), AllOf(StartsWith(path_ + ": "), HasSubstr(name)));
  }
}

TEST_F(ResultFolderTest, NamesADamagedExperiment) {
  withAResult();
  for (const char* content : {"a: {b: ", "[1, 2]", "", "word"}) {
    test::writeAll(path_ + "/experiment.yaml", content);
    EXPECT_THAT(refusalToOpen(test::smallYaml()), AllOf(StartsWith(path_), HasSubstr("experiment.yaml")));
  }
}

TEST_F(ResultFolderTest, RefusesWhatCannotBeAFolder) {
  EXPECT_THAT(test::refusalOf<ResultError>([] { ResultFolder("", test::smallYaml(), "rounds"); }),
              HasSubstr("no name of a folder"));
  test::writeAll(path_, "a file");
  EXPECT_THAT(refusalToOpen(test::smallYaml()), StartsWith(path_ + ": cannot be created"));
}

TEST_F(ResultFolderTest, NamesADamagedOrMissingResult) {
  const ResultFolder results = withAResult();
  test::writeAll(test::unitFile(results, 0, 0), serialise(unit_).substr(0, 40));
  EXPECT_TRUE(results.has(0, 0));
  EXPECT_FALSE(results.hasWhole(0, 0));
  EXPECT_THAT(test::refusalOf<ResultError>([&] { results.load(0, 0); }),
              StartsWith(test::unitFile(results, 0, 0) + ": is damaged: "));
  EXPECT_THAT(test::refusalOf<ResultError>([&] { results.load(0, 1); }),
              StartsWith(test::unitFile(results, 0, 1) + ": cannot be read"));
  fs::create_directory(test::unitFile(results, 0, 2));
  EXPECT_FALSE(results.hasWhole(0, 2));
}

class MergeResults : public ResultFolderTest {
 protected:
  std::size_t merge(const std::string& from) const {
    return mergeResults(ResultFolder::open(from, test::smallYaml(), "rounds"), results_, test::smallExperiment());
  }

  ResultFolder results_ = withAResult();
  ResultFolder shard_ = test::smallResults(folder_ / "shard");
};

TEST_F(MergeResults, TakesWhatIsNotThereYet) {
  shard_.save(0, 0, test::unitOf(4, 4, 99.0));
  shard_.save(3, 2, unit_);
  EXPECT_EQ(merge(shard_.path()), 1U);
  EXPECT_EQ(serialise(results_.load(0, 0)), serialise(unit_));
  EXPECT_EQ(serialise(results_.load(3, 2)), serialise(unit_));
}

TEST_F(MergeResults, ReplacesADamagedResult) {
  test::writeAll(test::unitFile(results_, 0, 0), "runs\n");
  shard_.save(0, 0, unit_);
  EXPECT_EQ(merge(shard_.path()), 1U);
  EXPECT_TRUE(results_.hasWhole(0, 0));
}

TEST_F(MergeResults, NamesADamagedResultOfTheShard) {
  test::writeAll(test::unitFile(shard_, 1, 1), "runs\n");
  EXPECT_THAT(test::refusalOf<ResultError>([&] { merge(shard_.path()); }),
              StartsWith(test::unitFile(shard_, 1, 1) + ": is damaged"));
}

TEST_F(MergeResults, OfAFolderWithItselfChangesNothing) {
  EXPECT_EQ(merge(results_.path()), 0U);
  EXPECT_TRUE(results_.hasWhole(0, 0));
}

TEST_F(MergeResults, RefusesAnotherExperimentsFolder) {
  const ResultFolder other(folder_ / "other", test::smallYamlWith("starts: 3", "starts: 4"), "rounds");
  EXPECT_THAT(test::refusalOf<ResultError>([&] { merge(other.path()); }),
              StartsWith(other.path() + ": holds results of another"));
}

TEST_F(MergeResults, LeavesAFolderAloneThatHoldsNoResults) {
  fs::create_directory(folder_ / "photos");
  EXPECT_THAT(test::refusalOf<ResultError>([&] { merge(folder_ / "photos"); }),
              StartsWith((folder_ / "photos") + ": is not a folder of results"));
  EXPECT_TRUE(fs::is_empty(folder_ / "photos"));
}

}  // namespace
}  // namespace visual_localization
