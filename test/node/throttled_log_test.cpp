#include "node/throttled_log.h"

#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace visual_localization {
namespace {

using testing::ElementsAre;
using Severity = ThrottledLog::Severity;

/// Keeps what is written.
struct Lines {
  ThrottledLog::Write writer() {
    return [this](Severity severity, const std::string& text) {
      texts.push_back((severity == Severity::kError ? "E " : "W ") + text);
    };
  }

  std::vector<std::string> texts;
};

TEST(ThrottledLog, WritesTheFirstOfAKindAndThenOnePerPeriod) {
  Lines lines;
  ThrottledLog log(lines.writer(), std::chrono::hours(1));
  log.warn("late", "an image is 1 s older");
  log.warn("late", "an image is 2 s older");
  EXPECT_THAT(lines.texts, ElementsAre("W an image is 1 s older"));
  Lines all;
  ThrottledLog never_quiet(all.writer(), std::chrono::milliseconds(0));
  never_quiet.warn("late", "one");
  never_quiet.warn("late", "two");
  EXPECT_THAT(all.texts, ElementsAre("W one", "W two"));
}

TEST(ThrottledLog, KindsDoNotSilenceEachOther) {
  Lines lines;
  ThrottledLog log(lines.writer(), std::chrono::hours(1));
  log.warn("late", "one");
  log.error("not finite", "two");
  log.warn("late", "three");
  log.error("not finite", "four");
  EXPECT_THAT(lines.texts, ElementsAre("W one", "E two"));
}

TEST(ThrottledLog, TwoDoNotSilenceEachOther) {
  Lines lines;
  ThrottledLog left(lines.writer(), std::chrono::hours(1));
  ThrottledLog right(lines.writer(), std::chrono::hours(1));
  left.warn("late", "left");
  right.warn("late", "right");
  EXPECT_THAT(lines.texts, ElementsAre("W left", "W right"));
}

}  // namespace
}  // namespace visual_localization
