#include "apps/svg_panel.h"

#include <algorithm>
#include <cmath>
#include <iomanip>
#include <ostream>
#include <sstream>

#include "base/text.h"

namespace visual_localization::apps {
namespace {

/// 1, 2 or 5 times a power of ten: the largest that is not above `most`.
double roundBelow(double most) {
  const double power = std::pow(10.0, std::floor(std::log10(most)));
  return power * (most / power >= 5.0 ? 5.0 : most / power >= 2.0 ? 2.0 : 1.0);
}

/// With as many decimals as it needs.
std::string roundNumber(double value) {
  std::ostringstream text;
  text << std::setprecision(10) << (std::abs(value) < 1e-9 ? 0.0 : value);
  return text.str();
}

constexpr const char* kCentred = "text-anchor=\"middle\"";
constexpr const char* kFlushRight = "text-anchor=\"end\"";

/// XML has no place for two of the characters, U+FFFE and U+FFFF.
bool isXml(const std::string& character) {
  const bool is_control = character.size() == 1 && (character[0] < 32 || character[0] == 127);
  return !is_control && character != "\xEF\xBF\xBE" && character != "\xEF\xBF\xBF";
}

}  // namespace

std::string escapedForXml(const std::string& text) {
  std::string safe;
  for (std::size_t at = 0; at < text.size();) {
    const std::size_t bytes = characterBytes(text, at);
    const std::string character = text.substr(at, std::max<std::size_t>(1, bytes));
    if (bytes == 0 || !isXml(character)) {
      safe += '?';
    } else if (character == "&") {
      safe += "&amp;";
    } else if (character == "<") {
      safe += "&lt;";
    } else if (character == ">") {
      safe += "&gt;";
    } else {
      safe += character;
    }
    at += character.size();
  }
  return safe;
}

std::string svgNumber(double value) {
  std::ostringstream text;
  text << std::fixed << std::setprecision(1) << value;
  return text.str();
}

void drawText(std::ostream& out, const Eigen::Vector2d& at_px, const std::string& text, const std::string& attributes) {
  out << "<text x=\"" << svgNumber(at_px.x()) << "\" y=\"" << svgNumber(at_px.y()) << "\" " << attributes << '>'
      << escapedForXml(text) << "</text>\n";
}

SvgPanel::SvgPanel(const Eigen::Vector2d& corner_px, double width_px, const Area& area)
    : corner_px_(corner_px), area_(area), scale_(width_px / area.range().x()) {
  size_px_ = {width_px, scale_ * area.range().y()};
}

Eigen::Vector2d SvgPanel::at(const Eigen::Vector2d& position_m) const {
  const Eigen::Vector2d inside = position_m.cwiseMax(area_.min_m).cwiseMin(area_.max_m);
  return corner_px_ + scale_ * Eigen::Vector2d(inside.x() - area_.min_m.x(), area_.max_m.y() - inside.y());
}

std::string SvgPanel::pointAt(const Eigen::Vector2d& position_m) const {
  const Eigen::Vector2d point = at(position_m);
  return svgNumber(point.x()) + "," + svgNumber(point.y());
}

void SvgPanel::drawAxes(std::ostream& out) const {
  const double step_m = roundBelow(area_.range().maxCoeff() / 5.0);
  drawTicks(out, step_m);
  out << "<rect x=\"" << svgNumber(corner_px_.x()) << "\" y=\"" << svgNumber(corner_px_.y()) << "\" width=\""
      << svgNumber(size_px_.x()) << "\" height=\"" << svgNumber(size_px_.y())
      << "\" fill=\"none\" stroke=\"#888888\"/>\n";
  drawScaleBar(out, roundBelow(area_.range().x() / 4.0));
  drawNorth(out);
}

void SvgPanel::drawTicks(std::ostream& out, double step_m) const {
  out << "<g fill=\"#555555\" font-size=\"11\">\n<path stroke=\"#e8e8e8\" d=\"";
  const Eigen::Vector2d first = (area_.min_m / step_m).array().ceil() * step_m;
  for (double east = first.x(); east <= area_.max_m.x(); east += step_m) {
    out << 'M' << pointAt({east, area_.min_m.y()}) << 'L' << pointAt({east, area_.max_m.y()});
  }
  for (double north = first.y(); north <= area_.max_m.y(); north += step_m) {
    out << 'M' << pointAt({area_.min_m.x(), north}) << 'L' << pointAt({area_.max_m.x(), north});
  }
  out << "\"/>\n";
  for (double east = first.x(); east <= area_.max_m.x(); east += step_m) {
    drawText(out, at({east, area_.min_m.y()}) + Eigen::Vector2d(0.0, 15.0), roundNumber(east), kCentred);
  }
  for (double north = first.y(); north <= area_.max_m.y(); north += step_m) {
    drawText(out, at({area_.min_m.x(), north}) + Eigen::Vector2d(-6.0, 4.0), roundNumber(north), kFlushRight);
  }
  drawText(out, corner_px_ + Eigen::Vector2d(0.5 * width(), height() + 31.0), "east of the datum, m", kCentred);
  const Eigen::Vector2d middle = corner_px_ + Eigen::Vector2d(-38.0, 0.5 * height());
  out << "<g transform=\"translate(" << svgNumber(middle.x()) << ' ' << svgNumber(middle.y()) << ") rotate(-90)\">";
  drawText(out, {0.0, 0.0}, "north, m", kCentred);
  out << "</g>\n</g>\n";
}

void SvgPanel::drawScaleBar(std::ostream& out, double length_m) const {
  const Eigen::Vector2d end = corner_px_ + size_px_ - Eigen::Vector2d(12.0, 12.0);
  const double length_px = scale_ * length_m;
  out << "<path fill=\"none\" stroke=\"black\" stroke-width=\"1.5\" d=\"M" << svgNumber(end.x() - length_px) << ' '
      << svgNumber(end.y() - 5.0) << "v5h" << svgNumber(length_px) << "v-5\"/>\n";
  drawText(out, end + Eigen::Vector2d(-0.5 * length_px, -6.0), roundNumber(length_m) + " m", kCentred);
}

void SvgPanel::drawNorth(std::ostream& out) const {
  const Eigen::Vector2d tip = corner_px_ + Eigen::Vector2d(width() - 20.0, 10.0);
  out << "<path fill=\"black\" d=\"M" << svgNumber(tip.x()) << ' ' << svgNumber(tip.y()) << "l5 14l-5 -4l-5 4z\"/>\n";
  drawText(out, tip + Eigen::Vector2d(0.0, 28.0), "N", kCentred);
}

}  // namespace visual_localization::apps
