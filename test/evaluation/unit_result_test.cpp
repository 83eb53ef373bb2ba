#include "evaluation/unit_result.h"

#include <algorithm>
#include <limits>
#include <map>
#include <stdexcept>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "base/text.h"
#include "test/support/refusal.h"

namespace visual_localization {
namespace {

using ::testing::HasSubstr;

constexpr float kUnknown = std::numeric_limits<float>::quiet_NaN();

RunRecord runWithErrors(std::size_t start, const std::vector<float>& errors_m) {
  RunRecord run;
  run.start = start;
  for (const float error_m : errors_m) run.steps.push_back({error_m, error_m < 5.0F ? 0.9F : 0.1F, 10, true});
  return run;
}

/// A run of a tracker with its course, and one whose last image has no true position.
UnitResult exampleUnit() {
  RunRecord traced = runWithErrors(3, {1.0F, 9.0F, 2.0F});
  traced.trace.resize(traced.steps.size());
  traced.trace[0].truth_m = Eigen::Vector2d(7.0, 8.0);
  traced.sift_extractions = 3;
  traced.sift_comparisons = 30;
  traced.method_ms = 0.3;
  return summariseRuns({traced, runWithErrors(0, {4.0F, kUnknown})}, {20.0, 2.0, 0.5, 0.01});
}

std::map<std::string, std::string> fieldsOf(const std::string& row) {
  const std::vector<std::string> names = csvFields(kTraceColumns);
  const std::vector<std::string> values = csvFields(row);
  EXPECT_EQ(names.size(), values.size());
  std::map<std::string, std::string> fields;
  for (std::size_t i = 0; i < std::min(names.size(), values.size()); ++i) fields[names[i]] = values[i];
  return fields;
}

std::string refusalOfUnit(const std::string& text) {
  return test::refusalOf<std::runtime_error>([&] { parseUnit(text); });
}

TEST(UnitResult, SumsUpKnownRuns) {
  const UnitResult unit = exampleUnit();
  ASSERT_EQ(unit.runs.size(), 2U);
  EXPECT_EQ(unit.runs[0].judged, 3U);
  EXPECT_DOUBLE_EQ(unit.runs[0].mean_err_m, 4.0);
  EXPECT_DOUBLE_EQ(unit.runs[0].within_5m, 2.0 / 3.0);
  EXPECT_DOUBLE_EQ(unit.runs[0].extract_ms, 20.0);
  EXPECT_DOUBLE_EQ(unit.runs[0].match_ms, 5.0);
  EXPECT_DOUBLE_EQ(unit.runs[0].update_ms, 0.1);
  EXPECT_DOUBLE_EQ(unit.runs[0].comparisons_per_image, 10.0);
  EXPECT_DOUBLE_EQ(unit.median_err_m, 3.0);
  EXPECT_DOUBLE_EQ(unit.recall_at_p99, 0.75);
  ASSERT_EQ(unit.steps.size(), 3U);
  EXPECT_EQ(unit.steps[0].runs, 2U);
  EXPECT_DOUBLE_EQ(unit.steps[0].err_m, 5.0);
  EXPECT_EQ(unit.steps[2].runs, 1U);
  EXPECT_EQ(unit.trace.size(), 3U);
}

TEST(UnitResult, AnImageWithoutTruePositionIsNotJudged) {
  const UnitResult unit = exampleUnit();
  EXPECT_EQ(unit.runs[1].images, 2U);
  EXPECT_EQ(unit.runs[1].judged, 1U);
  EXPECT_DOUBLE_EQ(unit.runs[1].mean_err_m, 4.0);
  EXPECT_EQ(unit.steps[1].runs, 2U);
  EXPECT_EQ(unit.steps[1].judged, 1U);
}

TEST(UnitResult, ReadsBackAsItWasWritten) {
  const std::string text = serialise(exampleUnit());
  EXPECT_EQ(serialise(parseUnit(text)), text);
  UnitResult claimed = exampleUnit();
  claimed.claims.tracking_wrong = 3;
  claimed.claims.bins[4] = {7, 2, 3.25};
  const Claims claims = parseUnit(serialise(claimed)).claims;
  EXPECT_EQ(claims.images, 4U);
  EXPECT_EQ(claims.tracking_wrong, 3U);
  EXPECT_EQ(claims.bins[4].wrong, 2U);
  EXPECT_DOUBLE_EQ(claims.bins[4].probability, 3.25);
  EXPECT_EQ(parseUnit(text).trace, exampleUnit().trace);
  const std::vector<TracedPose> trajectory = parseUnit(text).trajectory;
  ASSERT_EQ(trajectory.size(), 3U);
  EXPECT_EQ(trajectory[0].truth, "0.000000000 7 8 0 0 0 0 1");
  EXPECT_EQ(trajectory[1].estimate, "0.000000000 0 0 0 0 0 0 1");
  EXPECT_EQ(trajectory[1].truth, "");
}

TEST(UnitResult, RefusesATextThatIsCutOffAnywhere) {
  const std::string text = serialise(exampleUnit());
  for (std::size_t length = 0; length < text.size(); ++length) {
    EXPECT_NE(refusalOfUnit(text.substr(0, length)), "accepted") << length << " of " << text.size();
  }
}

TEST(UnitResult, RefusesATextThatLostALineOrHasOneTwice) {
  const std::string text = serialise(exampleUnit());
  for (std::size_t begin = 0; begin < text.size();) {
    const std::size_t end = text.find('\n', begin) + 1;
    const std::string line = text.substr(begin, end - begin);
    const bool is_trace = begin > text.find("trace\n") && begin < text.find("all\n") && line.find(',') != line.npos;
    if (!is_trace) {
      EXPECT_NE(refusalOfUnit(text.substr(0, begin) + text.substr(end)), "accepted") << "without " << line;
      EXPECT_NE(refusalOfUnit(text.substr(0, end) + text.substr(begin)), "accepted") << "twice " << line;
    }
    begin = end;
  }
}

TEST(UnitResult, ATraceHasTheSpeedsOfSwarmAndRobot) {
  RunRecord run = runWithErrors(0, {1.0F, 1.0F, 1.0F, 1.0F});
  run.trace.resize(run.steps.size());
  for (std::size_t i = 0; i < run.trace.size(); ++i) {
    run.trace[i].estimate.stamp_ns = static_cast<std::int64_t>(i) * 500'000'000;
    run.trace[i].truth_m = Eigen::Vector2d(0.3 * static_cast<double>(i), 0.0);
    run.trace[i].estimate.tracked.report.set("v0", 0.01);
    run.trace[i].estimate.tracked.report.set("speed_mps", 0.25 * static_cast<double>(i));
  }
  run.trace[2].truth_m.reset();
  const UnitResult unit = summariseRuns({run}, {});
  EXPECT_EQ(fieldsOf(unit.trace[0])["swarm_mps"], "") << "one image has no speed";
  EXPECT_EQ(fieldsOf(unit.trace[0])["robot_mps"], "");
  EXPECT_EQ(fieldsOf(unit.trace[1])["swarm_mps"], "0.25");
  EXPECT_DOUBLE_EQ(std::stod(fieldsOf(unit.trace[1])["robot_mps"]), 0.6);
  EXPECT_EQ(fieldsOf(unit.trace[2])["robot_mps"], "") << "no true position";
  EXPECT_EQ(fieldsOf(unit.trace[3])["robot_mps"], "") << "nor before";
  EXPECT_EQ(fieldsOf(unit.trace[3])["swarm_mps"], "0.75");
}

TEST(UnitResult, RefusesLinesThatAreNoNumbers) {
  const std::string good =
      "runs\n0,1,1,2,1,7,1,1,1,0,0,0\n\nsteps\n1,1,2,7,1\n\ntrace\n\ntrajectory\n\ntrust\n1,2,3,4,5,6,7\n\n"
      "claims\n4,3,2,1\n0,0,0\n0,0,0\n0,0,0\n0,0,0\n0,0,0\n0,0,0\n0,0,0\n0,0,0\n0,0,0\n0,0,0\n3,1,2.9\n\n"
      "poses\n9,8,6,5\n1,2,3,4,5,6,7,8,9,10\n0,0,0,0,0,0,0,0,0,0\n0,0,0,0,0,0,0,0,0,0\n0,0,0,0,0,0,0,0,0,0.5\n\n"
      "all\n2,1,3,0\n\n";
  ASSERT_EQ(refusalOfUnit(good), "accepted");
  const auto with = [&good](const std::string& part, const std::string& replacement) {
    return std::string(good).replace(good.find(part), part.size(), replacement);
  };
  for (const std::string& bad :
       {with("0,1,1,2", "0,x,1,2"), with("0,1,1,2", "0,1,nan,2"), with("0,1,1,2", "0;1,1,2"), with("0,0,0\n", "0,0\n"),
        with("0,0,0\n", "0,0,0,0\n"), with("7,1\n", "7,1 \n"), with("2,1,3,0\n", "2,1,3\n"),
        with("2,1,3,0\n", "2,1,3,0,4\n"), with("2,1,3,0\n", "1e999,1,3,0\n"), with("9,8,6,5\n", "9,8,6\n"),
        with("9,10\n", "9\n"), with("0.5\n", "nan\n"), with("1,2,3,4,5,6,7", "1,2,3,4,5,6"),
        with("0,1,1,2", "99999999999999999999999,1,1,2"), with("3,1,2.9", "3,1"), with("4,3,2,1", "4,3,2")}) {
    EXPECT_THAT(refusalOfUnit(bad), HasSubstr("no list of numbers")) << bad;
  }
  EXPECT_THAT(refusalOfUnit(with("trace\n", "trace\n1,2\n")), HasSubstr("trace that is not whole"));
  EXPECT_THAT(refusalOfUnit(good + "more"), HasSubstr("behind its end"));
  EXPECT_THAT(refusalOfUnit(with("1,1,2,7,1\n", "2,1,2,7,1\n")), HasSubstr("do not fit together"));
  EXPECT_THAT(refusalOfUnit(with("trajectory\n", "trajectory\n1 2 3 4 5 6 7\n")),
              HasSubstr("trajectory that is not whole"));
  EXPECT_THAT(refusalOfUnit(with("trajectory\n", "trajectory\n1 2 3 4 5 6 7 8\n")),
              HasSubstr("a trajectory that do not fit"));
  EXPECT_THAT(refusalOfUnit(with("9,8,6,5\n", "9,8,6,5\n1\n")), HasSubstr("no list of numbers"));
  EXPECT_THAT(refusalOfUnit(with("0.5\n", "0.5\n1\n")), HasSubstr("more than five lines of poses"));
  EXPECT_THAT(refusalOfUnit(with("0,1,1,2,1,7,1,1,1,0,0,0\n", "")), HasSubstr("has no run"));
  EXPECT_THAT(refusalOfUnit("something else\n"), HasSubstr("'runs' is missing"));
}

}  // namespace
}  // namespace visual_localization
