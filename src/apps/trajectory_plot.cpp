#include "apps/trajectory_plot.h"

#include <algorithm>
#include <array>
#include <cstddef>
#include <iomanip>
#include <optional>
#include <sstream>

#include "apps/svg_panel.h"
#include "base/text.h"

namespace visual_localization::apps {
namespace {

constexpr double kPanel_px = 620.0;
constexpr double kLeft_px = 60.0;
constexpr double kAbove_px = 34.0;  ///< of a panel, for its title
constexpr double kBelow_px = 50.0;
constexpr double kLegend_px = 256.0;
constexpr double kLegendLine_px = 21.0;
constexpr double kRoundLegend_px = 250.0;  ///< height

/// How the fixes of one verdict are drawn; `shape` is a relative SVG path about the position.
struct Style {
  FixVerdict verdict;
  const char* meaning;
  const char* paint;
  const char* shape;
};

constexpr std::array<Style, 5> kStyles{
    {{FixVerdict::kKept, "kept", "fill=\"#c4c4c4\"", "m-3 0a3 3 0 1 0 6 0a3 3 0 1 0 -6 0z"},
     {FixVerdict::kMultipath, "multipath (a bend)", "fill=\"#e69f00\"", "m0 -3.2l3 5.2h-6z"},
     {FixVerdict::kNoFix, "no fix, drawn on the path", "fill=\"none\" stroke=\"black\" stroke-width=\"0.7\"",
      "m-3.4 0a3.4 3.4 0 1 0 6.8 0a3.4 3.4 0 1 0 -6.8 0z"},
     {FixVerdict::kDisordered, "out of order", "fill=\"#9467bd\"", "m-3 -3h6v6h-6z"},
     {FixVerdict::kSpike, "spike (one outlier)", "fill=\"none\" stroke=\"#d62728\" stroke-width=\"2.2\"",
      "m-4 -4l8 8m-8 0l8 -8"}}};

constexpr const char* kRing = "m-1.5 0a1.5 1.5 0 1 0 3 0a1.5 1.5 0 1 0 -3 0z";  ///< a kept image

/// One a round, as in the rviz layout (Okabe and Ito).
constexpr std::array<const char*, 6> kColours{"#0073b2", "#d65e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e8"};

const char* colourOf(std::size_t round) { return kColours[round % kColours.size()]; }

/// Where a fix is drawn. One without usable coordinates is drawn where the robot was.
std::optional<Eigen::Vector2d> placeOf(const Fix& fix, FixVerdict verdict, const PlottedRound& round,
                                       const LocalFrame& frame) {
  if (verdict != FixVerdict::kNoFix && isValid(fix.position)) return frame.toEastNorth(fix.position);
  const auto place = round.cleaned.trajectory.at(fix.stamp_ns);
  return place ? std::optional<Eigen::Vector2d>(place->position_m) : std::nullopt;
}

void include(const Eigen::Vector2d& position_m, Area& area) {
  area.min_m = area.min_m.cwiseMin(position_m);
  area.max_m = area.max_m.cwiseMax(position_m);
}

/// All paths, with room for bends beside them; what lies farther off is drawn at the border.
Area areaOf(const std::vector<const PlottedRound*>& rounds, const LocalFrame& frame) {
  Area paths;
  bool first = true;
  for (const PlottedRound* round : rounds) {
    for (const TrajectoryPoint& point : round->cleaned.trajectory.points()) {
      if (first) paths = {point.position_m, point.position_m};
      first = false;
      include(point.position_m, paths);
    }
  }
  const double extent_m = std::max(paths.range().maxCoeff(), 5.0);
  const Eigen::Vector2d room_m = Eigen::Vector2d::Constant(0.2 * extent_m);
  Area shown = paths;
  for (const PlottedRound* round : rounds) {
    for (std::size_t i = 0; i < round->fixes.size(); ++i) {
      if (round->cleaned.verdicts[i] != FixVerdict::kMultipath) continue;
      const Eigen::Vector2d bend_m = frame.toEastNorth(round->fixes[i].position);
      include(bend_m.cwiseMax(paths.min_m - room_m).cwiseMin(paths.max_m + room_m), shown);
    }
  }
  shown.min_m.array() -= 0.06 * extent_m;
  shown.max_m.array() += 0.06 * extent_m;
  // A street that runs due east is no strip, and one that runs due north no tower.
  const Eigen::Vector2d least_m(1.1 * shown.range().y(), 0.35 * shown.range().x());
  const Eigen::Vector2d missing_m = (least_m - shown.range()).cwiseMax(0.0);
  shown.min_m -= 0.5 * missing_m;
  shown.max_m += 0.5 * missing_m;
  return shown;
}

/// Rounds of one place are shown alike; where they lie far apart each has its own part of the map.
Area areaFor(const PlottedRound& round, const Area& together, const LocalFrame& frame) {
  constexpr double kFarApart = 4.0;
  const Area alone = areaOf({&round}, frame);
  return together.range().maxCoeff() > kFarApart * alone.range().maxCoeff() ? alone : together;
}

/// Of a long name the end: that is where rounds of one place differ.
std::string shortened(const std::string& name, std::size_t most) {
  return name.size() <= most ? name : "..." + lastCharacters(name, most - 3);
}

void drawShape(std::ostream& out, const Style& style, const std::string& where) {
  out << "<path " << style.paint << " d=\"" << where << "\"/>\n";
}

std::string shapeAt(const Style& style, const Eigen::Vector2d& at_px) {
  return "M" + svgNumber(at_px.x()) + " " + svgNumber(at_px.y()) + style.shape;
}

void drawFixes(std::ostream& out, const Style& style, const PlottedRound& round, const LocalFrame& frame,
               const SvgPanel& panel) {
  std::string shapes;
  for (std::size_t i = 0; i < round.fixes.size(); ++i) {
    if (round.cleaned.verdicts[i] != style.verdict) continue;
    if (const auto place = placeOf(round.fixes[i], style.verdict, round, frame)) {
      shapes += shapeAt(style, panel.at(*place));
    }
  }
  if (!shapes.empty()) drawShape(out, style, shapes);
}

/// A line for each stretch: where the path was left open, nothing was driven as far as the map knows.
void drawPath(std::ostream& out, const PlottedRound& round, const char* colour, const SvgPanel& panel) {
  const std::vector<TrajectoryPoint>& points = round.cleaned.trajectory.points();
  out << "<path fill=\"none\" stroke=\"" << colour << "\" stroke-width=\"1.4\" d=\"";
  for (std::size_t i = 0; i < points.size(); ++i) {
    const bool joined = i > 0 && round.cleaned.trajectory.at(points[i - 1].stamp_ns +
                                                             (points[i].stamp_ns - points[i - 1].stamp_ns) / 2);
    out << (joined ? 'L' : 'M') << panel.pointAt(points[i].position_m);
  }
  out << "\"/>\n";
}

void drawImages(std::ostream& out, const PlottedRound& round, const char* colour, const SvgPanel& panel) {
  out << "<path fill=\"white\" stroke=\"" << colour << "\" stroke-width=\"0.8\" d=\"";
  for (const Eigen::Vector2d& position_m : round.images_m) {
    const Eigen::Vector2d at = panel.at(position_m);
    out << 'M' << svgNumber(at.x()) << ' ' << svgNumber(at.y()) << kRing;
  }
  out << "\"/>\n";
}

/// Reasons with their counts, and what the line and the rings are; from `y` down.
void drawLegend(std::ostream& out, const PlottedRound& round, const char* colour, double y) {
  const double x = kLeft_px + kPanel_px + 24.0;
  drawText(out, {x - 6.0, y}, std::to_string(round.fixes.size()) + " fixes", "font-weight=\"bold\"");
  for (const Style& style : kStyles) {
    y += kLegendLine_px;
    const auto count = std::count(round.cleaned.verdicts.begin(), round.cleaned.verdicts.end(), style.verdict);
    drawShape(out, style, shapeAt(style, {x, y - 4.0}));
    drawText(out, {x + 14.0, y}, std::to_string(count) + " " + style.meaning,
             count == 0 ? "fill=\"#999999\"" : "fill=\"#000000\"");
  }
  y += 34.0;
  std::ostringstream path;
  path << std::fixed << std::setprecision(0) << "cleaned path, " << round.cleaned.trajectory.length() << " m";
  out << "<path stroke=\"" << colour << "\" stroke-width=\"2\" d=\"M" << x - 6.0 << ' ' << y - 4.0 << "h14\"/>\n";
  drawText(out, {x + 14.0, y}, path.str());
  y += kLegendLine_px;
  out << "<path fill=\"white\" stroke=\"" << colour << "\" stroke-width=\"0.8\" d=\"M" << x << ' ' << y - 4.0 << kRing
      << "\"/>\n";
  drawText(out, {x + 14.0, y}, std::to_string(round.images_m.size()) + " kept images");
  y += kLegendLine_px;
  drawText(out, {x + 14.0, y}, std::to_string(round.cleaned.gaps_closed) + " gaps closed");
  y += 34.0;
  drawText(out, {x - 6.0, y}, "A mark on the frame lies farther off.", "fill=\"#555555\" font-size=\"11\"");
}

void drawRound(std::ostream& out, const PlottedRound& round, const LocalFrame& frame, const char* colour,
               const SvgPanel& panel, double top_px) {
  panel.drawAxes(out);
  drawText(out, {kLeft_px, top_px - 10.0}, shortened(round.name, 70), "font-size=\"15\" font-weight=\"bold\"");
  drawFixes(out, kStyles.front(), round, frame, panel);
  drawPath(out, round, colour, panel);
  drawImages(out, round, colour, panel);
  for (std::size_t s = 1; s < kStyles.size(); ++s) drawFixes(out, kStyles[s], round, frame, panel);
  drawLegend(out, round, colour, top_px + 14.0);
}

void drawTogether(std::ostream& out, const std::vector<PlottedRound>& rounds, const SvgPanel& panel, double top_px) {
  panel.drawAxes(out);
  drawText(out, {kLeft_px, top_px - 10.0}, "all rounds, cleaned paths", "font-size=\"15\" font-weight=\"bold\"");
  const double x = kLeft_px + kPanel_px + 24.0;
  double y = top_px + 14.0;
  for (std::size_t r = 0; r < rounds.size(); ++r) {
    drawPath(out, rounds[r], colourOf(r), panel);
    const Eigen::Vector2d start = panel.at(rounds[r].cleaned.trajectory.points().front().position_m);
    out << "<circle fill=\"" << colourOf(r) << "\" cx=\"" << svgNumber(start.x()) << "\" cy=\"" << svgNumber(start.y())
        << "\" r=\"3.5\"/>\n";
    out << "<path stroke=\"" << colourOf(r) << "\" stroke-width=\"3\" d=\"M" << x - 6.0 << ' ' << y - 4.0
        << "h14\"/>\n";
    drawText(out, {x + 14.0, y}, shortened(rounds[r].name, 28));
    y += kLegendLine_px;
  }
  drawText(out, {x - 6.0, y + 12.0}, "A dot is where a path begins.", "fill=\"#555555\" font-size=\"11\"");
}

}  // namespace

std::string plotTrajectories(const std::vector<PlottedRound>& rounds, const LocalFrame& frame) {
  std::ostringstream panels;
  double top_px = kAbove_px;
  const auto below = [&top_px](const SvgPanel& panel, double legend_px) {
    top_px += std::max(legend_px, panel.height() + kBelow_px) + kAbove_px;
  };
  std::vector<const PlottedRound*> all;
  for (const PlottedRound& round : rounds) all.push_back(&round);
  const Area together = areaOf(all, frame);
  for (std::size_t r = 0; r < rounds.size(); ++r) {
    const SvgPanel panel({kLeft_px, top_px}, kPanel_px, areaFor(rounds[r], together, frame));
    drawRound(panels, rounds[r], frame, colourOf(r), panel, top_px);
    below(panel, kRoundLegend_px);
  }
  if (rounds.size() > 1) {
    const SvgPanel panel({kLeft_px, top_px}, kPanel_px, together);
    drawTogether(panels, rounds, panel, top_px);
    below(panel, kLegendLine_px * static_cast<double>(rounds.size() + 2));
  }
  std::ostringstream out;
  out << "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"" << kLeft_px + kPanel_px + kLegend_px << "\" height=\""
      << svgNumber(top_px - kAbove_px)
      << "\" font-family=\"sans-serif\" font-size=\"13\">\n<rect width=\"100%\" height=\"100%\" fill=\"white\"/>\n"
      << panels.str() << "</svg>\n";
  return out.str();
}

}  // namespace visual_localization::apps
