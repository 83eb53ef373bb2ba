#include <sstream>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "apps/svg_panel.h"
#include "apps/trajectory_plot.h"

namespace visual_localization::apps {
namespace {

using testing::HasSubstr;
using testing::Not;

TEST(Svg, EscapesWhatXmlWouldRead) {
  EXPECT_EQ(escapedForXml("a<b>&\"c'"), "a&lt;b&gt;&amp;\"c'");
  EXPECT_EQ(escapedForXml("a\nb\x1b\x7f"), "a?b??");
}

TEST(Svg, KeepsUtf8AndReplacesAnythingElse) {
  const std::string good = "T\xC3\xBC\xE2\x82\xAC\xF0\x9F\x9A\x97";
  EXPECT_EQ(escapedForXml(good), good);
  EXPECT_EQ(escapedForXml("\xBC"), "?");
  EXPECT_EQ(escapedForXml("\xC3"), "?");
  EXPECT_EQ(escapedForXml("\xC3<"), "?&lt;");
  EXPECT_EQ(escapedForXml("\xE2\x82"), "??");
  EXPECT_EQ(escapedForXml("\xEF\xBF\xBE"), "?") << "a character that XML has not";
}

TEST(Svg, TextIsEscapedWherever) {
  std::ostringstream out;
  drawText(out, {1.0, 2.0}, "a<b", "fill=\"red\"");
  EXPECT_EQ(out.str(), "<text x=\"1.0\" y=\"2.0\" fill=\"red\">a&lt;b</text>\n");
}

/// A round of 20 m due north; `name` may be too long for its place.
PlottedRound roundCalled(const std::string& name, const LocalFrame& frame) {
  PlottedRound round{name, {}, {}, {{0.0, 0.0}}};
  for (int i = 0; i <= 20; ++i) {
    Fix fix;
    fix.has_fix = true;
    fix.stamp_ns = i * 1'000'000'000LL;
    fix.position = frame.toGeodetic({0.0, static_cast<double>(i)});
    round.fixes.push_back(fix);
  }
  round.cleaned = cleanTrajectory(round.fixes, frame, {});
  return round;
}

TEST(TrajectoryPlot, CutsNamesBetweenCharacters) {
  const LocalFrame frame({48.5, 9.0, 0.0});
  for (std::size_t letters = 0; letters < 4; ++letters) {
    std::string name(letters, 'x');
    for (int i = 0; i < 60; ++i) name += "\xE2\x82\xAC";
    const std::string drawn = plotTrajectories({roundCalled(name, frame), roundCalled("y", frame)}, frame);
    EXPECT_THAT(drawn, HasSubstr(">...\xE2\x82\xAC"));
    EXPECT_THAT(drawn, Not(HasSubstr("?")));
  }
}

}  // namespace
}  // namespace visual_localization::apps
