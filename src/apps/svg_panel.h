#pragma once

#include <iosfwd>
#include <string>

#include <Eigen/Core>

#include "visual_localization/map/training_map.h"

namespace visual_localization::apps {

/// As text of an SVG file; control characters and what is no UTF-8 become question marks.
std::string escapedForXml(const std::string& text);

/// One decimal is a tenth of a pixel.
std::string svgNumber(double value);

/// `text` is escaped, `attributes` are not.
void drawText(std::ostream& out, const Eigen::Vector2d& at_px, const std::string& text,
              const std::string& attributes = "");

/// A rectangle of an SVG picture that shows a part of the map frame: one scale on both axes, north up.
class SvgPanel {
 public:
  /// Shows `area` in a panel of this width below and right of `corner_px`; as high as the area needs.
  SvgPanel(const Eigen::Vector2d& corner_px, double width_px, const Area& area);

  double width() const { return size_px_.x(); }
  double height() const { return size_px_.y(); }
  /// Pixels; what lies outside is put on the border.
  Eigen::Vector2d at(const Eigen::Vector2d& position_m) const;
  /// "12.3,45.6", for lists of points.
  std::string pointAt(const Eigen::Vector2d& position_m) const;
  /// Frame, grid and ticks in metres, a bar for the scale and an arrow to the north.
  void drawAxes(std::ostream& out) const;

 private:
  void drawTicks(std::ostream& out, double step_m) const;
  void drawScaleBar(std::ostream& out, double length_m) const;
  void drawNorth(std::ostream& out) const;

  Eigen::Vector2d corner_px_;
  Eigen::Vector2d size_px_;
  Area area_;
  double scale_ = 1.0;  ///< pixels a metre
};

}  // namespace visual_localization::apps
