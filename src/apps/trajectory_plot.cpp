#include "trajectory_plot.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <iomanip>
#include <sstream>

namespace visual_localization::apps {
namespace {

constexpr double kWidth_px = 900.0;
constexpr double kMargin_px = 40.0;
constexpr double kLegend_px = 130.0;

struct Style {
  FixVerdict verdict;
  const char* colour;
  double radius_px;
};

// kNoFix comes without usable coordinates and is only counted.
constexpr std::array<Style, 4> kStyles{{{FixVerdict::kKept, "#9ecae1", 1.6},
                                        {FixVerdict::kBend, "#e6550d", 2.6},
                                        {FixVerdict::kSpike, "#d62728", 3.0},
                                        {FixVerdict::kDisordered, "#756bb1", 3.0}}};

/// Metres of the map frame to pixels of the picture: one scale on both axes, north up.
class Canvas {
 public:
  explicit Canvas(const std::vector<PlottedRound>& rounds) {
    bool first = true;
    for (const PlottedRound& round : rounds) {
      for (const TrajectoryPoint& point : round.cleaned.trajectory.points()) {
        min_m_ = first ? point.position_m : min_m_.cwiseMin(point.position_m).eval();
        max_m_ = first ? point.position_m : max_m_.cwiseMax(point.position_m).eval();
        first = false;
      }
    }
    // Room for outliers near the path; farther ones are drawn at the border.
    const double extent_m = std::max((max_m_ - min_m_).maxCoeff(), 1.0);
    min_m_.array() -= 0.08 * extent_m;
    max_m_.array() += 0.08 * extent_m;
    scale_ = (kWidth_px - 2.0 * kMargin_px) / (max_m_ - min_m_).maxCoeff();
  }

  double height() const { return kLegend_px + 2.0 * kMargin_px + scale_ * (max_m_ - min_m_).y(); }
  double pixelsPerMetre() const { return scale_; }
  std::string at(const Eigen::Vector2d& position_m, const char* between) const {
    const Eigen::Vector2d inside = position_m.cwiseMax(min_m_).cwiseMin(max_m_);
    std::ostringstream text;
    text << std::fixed << std::setprecision(1) << kMargin_px + scale_ * (inside.x() - min_m_.x()) << between
         << kLegend_px + kMargin_px + scale_ * (max_m_.y() - inside.y());
    return text.str();
  }

 private:
  Eigen::Vector2d min_m_ = Eigen::Vector2d::Zero();
  Eigen::Vector2d max_m_ = Eigen::Vector2d::Zero();
  double scale_ = 1.0;
};

std::string escaped(const std::string& text) {
  std::string safe;
  for (const char c : text) {
    if (c == '&')
      safe += "&amp;";
    else if (c == '<')
      safe += "&lt;";
    else if (c == '>')
      safe += "&gt;";
    else
      safe += c >= 0 && c < 32 ? '?' : c;
  }
  return safe;
}

void drawFixes(std::ostream& out, const PlottedRound& round, const LocalFrame& frame, const Canvas& canvas) {
  for (const Style& style : kStyles) {
    out << "<g fill=\"" << style.colour << "\">\n";
    for (std::size_t i = 0; i < round.fixes.size(); ++i) {
      if (round.cleaned.verdicts[i] != style.verdict || !isValid(round.fixes[i].position)) continue;
      out << "<circle cx=\"" << canvas.at(frame.toEastNorth(round.fixes[i].position), "\" cy=\"") << "\" r=\""
          << style.radius_px << "\"/>\n";
    }
    out << "</g>\n";
  }
}

void drawPath(std::ostream& out, const PlottedRound& round, const Canvas& canvas) {
  out << "<polyline fill=\"none\" stroke=\"#08306b\" stroke-width=\"1.2\" points=\"";
  for (const TrajectoryPoint& point : round.cleaned.trajectory.points()) out << canvas.at(point.position_m, ",") << ' ';
  out << "\"/>\n";
}

void drawText(std::ostream& out, double x, double y, const std::string& text) {
  out << "<text x=\"" << x << "\" y=\"" << y << "\">" << escaped(text) << "</text>\n";
}

std::size_t countOf(const std::vector<PlottedRound>& rounds, FixVerdict verdict) {
  std::size_t count = 0;
  for (const PlottedRound& round : rounds) {
    count +=
        static_cast<std::size_t>(std::count(round.cleaned.verdicts.begin(), round.cleaned.verdicts.end(), verdict));
  }
  return count;
}

void drawLegend(std::ostream& out, const std::vector<PlottedRound>& rounds) {
  double y = 30.0;
  for (const Style& style : kStyles) {
    out << "<circle cx=\"50\" cy=\"" << y - 4.0 << "\" r=\"5\" fill=\"" << style.colour << "\"/>\n";
    drawText(out, 62.0, y,
             "fix: " + toString(style.verdict) + " (" + std::to_string(countOf(rounds, style.verdict)) + ")");
    y += 20.0;
  }
  drawText(
      out, 62.0, y,
      "not drawn: " + toString(FixVerdict::kNoFix) + " (" + std::to_string(countOf(rounds, FixVerdict::kNoFix)) + ")");
  out << "<line x1=\"40\" x2=\"60\" y1=\"" << y + 16.0 << "\" y2=\"" << y + 16.0
      << "\" stroke=\"#08306b\" stroke-width=\"2\"/>\n";
  std::string names;
  for (const PlottedRound& round : rounds) names += (names.empty() ? "" : ", ") + round.name;
  drawText(out, 66.0, y + 20.0, "cleaned path: " + names);
}

/// A bar of 1, 2 or 5 times a power of ten metres, at most 200 pixels long.
void drawScale(std::ostream& out, const Canvas& canvas) {
  const double longest_m = 200.0 / canvas.pixelsPerMetre();
  const double power = std::pow(10.0, std::floor(std::log10(longest_m)));
  const double length_m = power * (longest_m / power >= 5.0 ? 5.0 : longest_m / power >= 2.0 ? 2.0 : 1.0);
  const double right = kWidth_px - kMargin_px;
  const double left = right - length_m * canvas.pixelsPerMetre();
  out << "<path fill=\"none\" stroke=\"black\" d=\"M" << left << " 34v8H" << right << "v-8\"/>\n";
  std::ostringstream text;
  text << length_m << " m";
  drawText(out, left, 28.0, text.str());
}

}  // namespace

std::string plotTrajectories(const std::vector<PlottedRound>& rounds, const LocalFrame& frame) {
  const Canvas canvas(rounds);
  std::ostringstream out;
  out << "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"" << kWidth_px << "\" height=\"" << canvas.height()
      << "\" font-family=\"sans-serif\" font-size=\"13\">\n<rect width=\"100%\" height=\"100%\" fill=\"white\"/>\n";
  for (const PlottedRound& round : rounds) drawFixes(out, round, frame, canvas);
  for (const PlottedRound& round : rounds) drawPath(out, round, canvas);
  drawLegend(out, rounds);
  drawScale(out, canvas);
  out << "</svg>\n";
  return out.str();
}

}  // namespace visual_localization::apps
