#include <algorithm>
#include <array>
#include <cmath>
#include <ctime>
#include <filesystem>
#include <iomanip>
#include <ostream>
#include <sstream>
#include <vector>

#include "apps/app_support.h"
#include "apps/map_export.h"
#include "base/numbers.h"
#include "base/text.h"
#include "visual_localization/map/map_file.h"

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

/// "name:" as wide as every key of the report.
std::string key(const std::string& name) {
  std::string text = name.empty() ? "" : name + ":";
  text.resize(kKeyWidth, ' ');
  return text;
}

std::string nameOf(const TrainingMap& map, int session) {
  return oneLine(map.header().sessions[static_cast<std::size_t>(session)].name, kLongestName);
}

/// UTC; the end on the same day needs no date.
std::string spanOf(const SessionSurvey& session) {
  const char* const date = "%Y-%m-%d";
  const bool same_day = timeOf(session.first_ns, date) == timeOf(session.last_ns, date);
  return timeOf(session.first_ns, "%Y-%m-%d %H:%M:%S") + " to " +
         timeOf(session.last_ns, same_day ? "%H:%M:%S" : "%Y-%m-%d %H:%M:%S");
}

/// "12.3 m"
std::string metres(double length_m, int decimals = 0) {
  // A little below zero is zero.
  const double shown_m = std::abs(length_m) < 0.5 * std::pow(10.0, -decimals) ? 0.0 : length_m;
  std::ostringstream text;
  text << std::fixed << std::setprecision(decimals) << shown_m << " m";
  return text.str();
}

/// "45 %"
std::string percent(double part, double whole) {
  std::ostringstream text;
  text << std::fixed << std::setprecision(0) << (whole > 0.0 ? 100.0 * part / whole : 0.0) << " %";
  return text.str();
}

/// "(12.3, -4.5)": where an image was taken.
std::string positionText(const TrainingMap& map, std::size_t image) {
  // To a tenth, and without the sign of zero.
  const Eigen::Vector2d tenths = (10.0 * map.position_m(image)).array().round() / 10.0 + 0.0;
  std::ostringstream text;
  text << std::fixed << std::setprecision(1) << '(' << tenths.x() << ", " << tenths.y() << ')';
  return text.str();
}

constexpr std::size_t kMostSessions = 40;
constexpr std::size_t kMostStretches = 8;
constexpr std::array<const char*, kOctants> kCompass{"east", "north-east", "north", "north-west",
                                                     "west", "south-west", "south", "south-east"};

/// Unless told otherwise.
std::string whereItsFeaturesAre(double file_bytes) {
  return file_bytes <= static_cast<double>(MapLoading().cache_bytes)
             ? "features are read at start"
             : "features are read when needed (map_cache_mb: " + std::to_string(kDefaultMapCache_mb) + ")";
}

void printFile(std::ostream& out, const std::string& path, const TrainingMap& map) {
  const MapHeader& header = map.header();
  const auto bytes = static_cast<double>(std::filesystem::file_size(path));
  out << key("map") << oneLine(path) << ", version " << kMapSchemaVersion << ", written by visual_localization "
      << packageVersionOf(path) << '\n'
      << key("size") << humanSize(bytes) << " on disk, " << whereItsFeaturesAre(bytes) << '\n'
      << key("datum") << std::setprecision(9) << header.datum.latitude_deg << " deg, " << header.datum.longitude_deg
      << " deg, " << header.datum.altitude_m << " m; positions below are metres (east, north) from it\n"
      << key("images") << map.size() << " of " << header.image_size.width << 'x' << header.image_size.height << " px\n"
      << key("features") << header.kind->name() << ", " << header.kind->form().dimension << " elements";
  for (const auto& [name, value] : header.kind->parameters()) {
    out << ", " << name.substr(name.find('/') + 1) << ' ' << parameters::toString(value);
  }
  out << '\n';
}

void printHistory(std::ostream& out, const std::vector<std::string>& history) {
  constexpr std::size_t kMostShown = 10;
  const std::size_t first = history.size() - std::min(history.size(), kMostShown);
  for (std::size_t i = first; i < history.size(); ++i) out << key("edited") << oneLine(history[i]) << '\n';
  if (first > 0) out << key("") << "and " << first << " times before\n";
}

void printFeatures(std::ostream& out, const TrainingMap& map) {
  std::vector<std::size_t> counts;
  std::size_t total = 0;
  for (std::size_t i = 0; i < map.size(); ++i) {
    counts.push_back(map.featureCount(i));
    total += map.featureCount(i);
  }
  const std::size_t least = *std::min_element(counts.begin(), counts.end());
  const std::size_t most = *std::max_element(counts.begin(), counts.end());
  out << key("features") << total << ", per image min " << least << ", median " << upperMedian(counts) << ", max "
      << most << '\n';
}

void printLandmarks(std::ostream& out, const TrainingMap& map, const LandmarkSurvey& survey) {
  out << key("landmarks");
  if (survey.images == 0) {
    out << "none: the map recognises places, but measures no poses\n";
    return;
  }
  const auto count = [](std::size_t images) { return static_cast<double>(images); };
  out << "in " << survey.images << " of " << map.size() << " images ("
      << percent(count(survey.images), count(map.size())) << "), ";
  if (survey.landmarks) out << *survey.landmarks << " different ones, ";
  out << "per image median " << survey.median << "; " << humanSize(count(survey.bytes));
  if (!survey.landmarks) out << " in the " << survey.images_read << " images looked at (--check: all)";
  out << '\n';
}

void printSessions(std::ostream& out, const TrainingMap& map, const MapSurvey& survey) {
  out << '\n' << key("sessions") << survey.sessions.size() << "; times are UTC\n";
  const std::size_t shown = std::min(survey.sessions.size(), kMostSessions);
  std::size_t width = 0;
  for (std::size_t s = 0; s < shown; ++s) width = std::max(width, nameOf(map, static_cast<int>(s)).size());
  for (std::size_t s = 0; s < shown; ++s) {
    const SessionSurvey& session = survey.sessions[s];
    out << std::setw(4) << s << "  " << std::left << std::setw(static_cast<int>(width))
        << nameOf(map, static_cast<int>(s)) << std::right << std::setw(8) << session.images << " images  "
        << std::setw(8) << metres(session.path_m);
    if (survey.sessions.size() > 1) {
      out << std::setw(8) << percent(session.shared_m, session.driven_m) << " shared with others";
    }
    if (session.images != 0) out << "   " << spanOf(session);
    out << '\n';
  }
  if (shown < survey.sessions.size()) out << "      and " << survey.sessions.size() - shown << " more\n";
}

std::string cameraText(const Session& session) {
  std::string text = session.camera ? describe(*session.camera) : "no calibration: places only";
  if (!session.mask.empty()) text += "; mask uses " + percent(session.mask.usedShare(), 1.0) + " of the image";
  return text;
}

/// One line for all sessions in a row with the same camera.
void printCameras(std::ostream& out, const TrainingMap& map) {
  const std::vector<Session>& sessions = map.header().sessions;
  const std::size_t shown = std::min(sessions.size(), kMostSessions);
  for (std::size_t first = 0; first < shown;) {
    std::size_t last = first;
    const auto is_same = [&](const Session& other) {
      return other.camera == sessions[first].camera && other.mask == sessions[first].mask;
    };
    while (last + 1 < shown && is_same(sessions[last + 1])) ++last;
    out << key(first == 0 ? "cameras" : "");
    if (sessions.size() > 1) out << first << (last > first ? " to " + std::to_string(last) : "") << ": ";
    out << cameraText(sessions[first]) << '\n';
    first = last + 1;
  }
}

/// The worst stretches of a session, in order.
void printErrorStretches(std::ostream& out, std::vector<ErrorStretch> stretches) {
  std::vector<double> errors_m;
  for (const ErrorStretch& stretch : stretches) errors_m.push_back(stretch.most_m);
  std::sort(errors_m.rbegin(), errors_m.rend());
  const double least_m = errors_m.size() > kMostStretches ? errors_m[kMostStretches - 1] : 0.0;
  for (const ErrorStretch& stretch : stretches) {
    if (stretch.most_m < least_m) continue;
    out << key("") << std::setw(8) << metres(stretch.from_m) << " to " << std::setw(8) << metres(stretch.to_m) << ": "
        << metres(stretch.most_m, 2) << '\n';
  }
  if (least_m > 0.0) out << key("") << "and " << stretches.size() - kMostStretches << " better stretches\n";
}

/// What the receivers leave in the positions, and where recordings contradict themselves.
void printErrors(std::ostream& out, const TrainingMap& map, const std::vector<ErrorStretch>& errors) {
  const std::vector<Session>& sessions = map.header().sessions;
  for (std::size_t s = 0; s < std::min(sessions.size(), kMostSessions); ++s) {
    out << key(s == 0 ? "errors" : "");
    if (sessions.size() > 1) out << s << ": ";
    out << (sessions[s].fixes ? describe(*sessions[s].fixes) : "not known") << '\n';
    std::vector<ErrorStretch> of_session;
    std::copy_if(errors.begin(), errors.end(), std::back_inserter(of_session),
                 [s](const ErrorStretch& stretch) { return stretch.session == static_cast<int>(s); });
    printErrorStretches(out, of_session);
    for (const DoubtfulStretch& stretch : sessions[s].doubtful) {
      out << key("") << "check before use: " << describe(stretch) << '\n';
    }
  }
}

void printCoverage(std::ostream& out, const TrainingMap& map, const MapSurvey& survey) {
  const Area& area = map.area();
  const double cell_m2 = SightGrid::kCell_m * SightGrid::kCell_m;
  out << '\n'
      << key("coverage") << metres(area.range().x()) << " from west to east (" << metres(area.min_m.x(), 1) << " to "
      << metres(area.max_m.x(), 1) << "), " << metres(area.range().y()) << " from south to north ("
      << metres(area.min_m.y(), 1) << " to " << metres(area.max_m.y(), 1) << ")\n"
      << key("") << "route " << metres(survey.route_m) << ", each direction counted separately; "
      << metres(survey.driven_m) << " driven\n"
      << key("") << metres(survey.shared_m) << " of the route (" << percent(survey.shared_m, survey.route_m)
      << ") seen by more than one session\n"
      << key("") << std::fixed << std::setprecision(0) << static_cast<double>(survey.cells) * cell_m2 << " m2 in "
      << survey.cells << " cells of " << metres(SightGrid::kCell_m, 1) << " with an image\n";
}

void printDensity(std::ostream& out, const TrainingMap& map, const MapFindings& findings) {
  const MapSurvey& survey = findings.survey;
  out << '\n' << key("density");
  if (survey.longest_steps.empty()) {
    out << "no session has two images\n";
    return;
  }
  if (survey.route_m > 0.0) {
    out << std::fixed << std::setprecision(1) << static_cast<double>(map.size()) / survey.route_m
        << " images per metre of route; ";
  }
  out << "step between images: median " << metres(survey.median_step_m, 2) << ", 95th percentile "
      << metres(survey.long_step_m, 2) << '\n'
      << key("") << survey.gaps << " gaps of more than " << metres(findings.config.gap_m) << "; the longest steps:\n";
  for (const Step& step : survey.longest_steps) {
    out << key("") << std::setw(8) << metres(step.length_m, 1) << "  from " << positionText(map, step.from) << " to "
        << positionText(map, step.to) << ", " << nameOf(map, step.session)
        << (step.length_m > findings.config.gap_m ? "  GAP" : "") << '\n';
  }
}

/// One a line, with whatever `more` says about them.
template <class More>
void printStretches(std::ostream& out, const TrainingMap& map, std::vector<Stretch> stretches, More more) {
  std::stable_sort(stretches.begin(), stretches.end(),
                   [](const Stretch& a, const Stretch& b) { return a.length_m > b.length_m; });
  const std::size_t shown = std::min(stretches.size(), kMostStretches);
  for (std::size_t s = 0; s < shown; ++s) {
    const Stretch& stretch = stretches[s];
    out << key("") << std::setw(8) << metres(stretch.length_m, 1) << "  from " << positionText(map, stretch.first)
        << " to " << positionText(map, stretch.last) << ", " << nameOf(map, stretch.session) << ", " << stretch.images
        << (stretch.images == 1 ? " image" : " images") << more(stretch) << '\n';
  }
  if (shown < stretches.size()) out << key("") << "and " << stretches.size() - shown << " shorter stretches\n";
}

void printHeadings(std::ostream& out, const TrainingMap& map, const MapSurvey& survey) {
  constexpr double kBar = 40.0;
  const double most_m = *std::max_element(survey.heading_m.begin(), survey.heading_m.end());
  out << '\n' << key("headings") << "metres driven in each direction\n";
  for (std::size_t o = 0; o < survey.heading_m.size(); ++o) {
    const double length_m = survey.heading_m[o];
    const auto bar = static_cast<std::size_t>(most_m > 0.0 ? std::lround(kBar * length_m / most_m) : 0);
    out << key("") << std::left << std::setw(11) << kCompass[o] << std::right << std::setw(8) << metres(length_m)
        << (bar > 0 ? "  " : "") << std::string(bar, '#') << '\n';
  }
  out << key("") << metres(survey.one_way_m) << " of " << metres(survey.driven_m) << " ("
      << percent(survey.one_way_m, survey.driven_m) << ") driven in one direction only: not recognised in the other\n";
  const bool all = survey.one_way_m >= survey.driven_m;
  if (!all) printStretches(out, map, survey.one_way, [](const Stretch&) { return std::string(); });
}

void printWeak(std::ostream& out, const TrainingMap& map, const MapFindings& findings) {
  const MapSurvey& survey = findings.survey;
  out << '\n'
      << key("weak") << survey.weak_images << " of " << map.size() << " images with fewer than "
      << findings.config.few_features << " features (--few-features), in " << survey.weak.size()
      << (survey.weak.size() == 1 ? " stretch\n" : " stretches\n");
  printStretches(out, map, survey.weak, [&](const Stretch& stretch) {
    std::string text = ", min " + std::to_string(stretch.least_features) + " features";
    if (survey.sessions.size() < 2) return text;
    if (stretch.seen_elsewhere == stretch.images) return text + "; another session has enough there";
    if (stretch.seen_elsewhere == 0) return text + "; NO other session has enough there";
    return text + "; another session has enough at " + std::to_string(stretch.seen_elsewhere) + " of them";
  });
}

void printAmbiguity(std::ostream& out, const TrainingMap& map, const AmbiguousPlaces& found) {
  const AmbiguityConfig config;
  out << '\n'
      << key("ambiguous") << found.images.size() << " of " << found.asked << " images are at least "
      << percent(config.nearly_as_good, 1.0) << " as similar to one more than " << metres(config.far_m)
      << " away as to their neighbours\n";
  if (found.stride > 1) {
    out << key("") << "large map: one image in " << found.stride << " was compared with one in " << found.stride
        << '\n';
  }
  if (found.unjudged > 0) {
    out << key("") << found.unjudged << (found.unjudged == 1 ? " image has" : " images have") << " no neighbour within "
        << metres(config.near_m) << " and cannot be judged\n";
  }
  if (found.unasked > 0) out << key("") << found.unasked << " images were left out: too many features\n";
  out << key("") << found.global_only << " are ambiguous by global features alone (features: global)\n";
  printStretches(out, map, found.stretches, [&](const Stretch& stretch) {
    const auto first = std::find_if(found.images.begin(), found.images.end(), [&](const AmbiguousImage& image) {
      return image.image >= stretch.first && map.pose(image.image).session == stretch.session;
    });
    std::ostringstream text;
    text << std::fixed << std::setprecision(2);
    // After a gap a stretch begins with images that were not compared; it may hold no others.
    if (first == found.images.end() || first->image > stretch.last) return text.str();
    text << "; similarity " << first->similarity << " to " << positionText(map, first->twin) << ", "
         << first->near_similarity << " to the neighbours";
    return text.str();
  });
}

}  // namespace

void printMapReport(std::ostream& out, const std::string& path, const TrainingMap& map, const MapFindings& findings) {
  printFile(out, path, map);
  printHistory(out, map.header().history);
  printFeatures(out, map);
  printLandmarks(out, map, findings.landmarks);
  printSessions(out, map, findings.survey);
  printCameras(out, map);
  printErrors(out, map, findings.errors);
  printCoverage(out, map, findings.survey);
  printDensity(out, map, findings);
  printHeadings(out, map, findings.survey);
  printWeak(out, map, findings);
  if (findings.ambiguity) {
    printAmbiguity(out, map, *findings.ambiguity);
  } else {
    out << '\n' << key("ambiguous") << "not checked (--ambiguity)\n";
  }
}

}  // namespace visual_localization::apps
