#include "apps/map_report_text.h"

#include <array>
#include <cmath>
#include <ctime>
#include <iomanip>
#include <sstream>

#include "base/text.h"

namespace visual_localization::apps {
namespace {

constexpr std::size_t kLongestName = 40;
constexpr int kKeyWidth = 13;

/// "2010-06-01 10:20:30", UTC.
std::string timeOf(std::int64_t stamp_ns, const char* format) {
  const auto seconds = static_cast<std::time_t>(stamp_ns / 1'000'000'000);
  std::tm parts{};
  std::array<char, 64> text{};
  if (gmtime_r(&seconds, &parts) == nullptr) return "?";
  std::strftime(text.data(), text.size(), format, &parts);
  return text.data();
}

}  // namespace

std::string key(const std::string& name) {
  std::string text = name.empty() ? "" : name + ":";
  text.resize(kKeyWidth, ' ');
  return text;
}

std::string nameOf(const TrainingMap& map, int session) {
  return oneLine(map.header().sessions[static_cast<std::size_t>(session)].name, kLongestName);
}

std::string spanOf(const SessionSurvey& session) {
  const char* const date = "%Y-%m-%d";
  const bool same_day = timeOf(session.first_ns, date) == timeOf(session.last_ns, date);
  return timeOf(session.first_ns, "%Y-%m-%d %H:%M:%S") + " to " +
         timeOf(session.last_ns, same_day ? "%H:%M:%S" : "%Y-%m-%d %H:%M:%S");
}

std::string metres(double length_m, int decimals) {
  // A little below zero is zero.
  const double shown_m = std::abs(length_m) < 0.5 * std::pow(10.0, -decimals) ? 0.0 : length_m;
  std::ostringstream text;
  text << std::fixed << std::setprecision(decimals) << shown_m << " m";
  return text.str();
}

std::string percent(double part, double whole) {
  std::ostringstream text;
  text << std::fixed << std::setprecision(0) << (whole > 0.0 ? 100.0 * part / whole : 0.0) << " %";
  return text.str();
}

std::string positionText(const TrainingMap& map, std::size_t image) {
  // To a tenth, and without the sign of zero.
  const Eigen::Vector2d tenths = (10.0 * map.position_m(image)).array().round() / 10.0 + 0.0;
  std::ostringstream text;
  text << std::fixed << std::setprecision(1) << '(' << tenths.x() << ", " << tenths.y() << ')';
  return text.str();
}

}  // namespace visual_localization::apps
