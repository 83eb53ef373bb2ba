#include "apps/report_page.h"

#include <algorithm>
#include <cmath>
#include <sstream>
#include <utility>

#include <boost/archive/iterators/base64_from_binary.hpp>
#include <boost/archive/iterators/transform_width.hpp>
#include <nlohmann/json.hpp>

#include "apps/report_template.h"
#include "survey/map_survey.h"

namespace visual_localization::apps {
namespace {

using nlohmann::json;

std::string base64(const std::vector<std::uint8_t>& bytes) {
  namespace iterators = boost::archive::iterators;
  using Characters =
      iterators::base64_from_binary<iterators::transform_width<std::vector<std::uint8_t>::const_iterator, 6, 8>>;
  std::string text(Characters(bytes.begin()), Characters(bytes.end()));
  text.append((3 - bytes.size() % 3) % 3, '=');
  return text;
}

json positionOf(const Eigen::Vector2d& position_m) {
  return {pageNumber(position_m.x(), 2), pageNumber(position_m.y(), 2)};
}

json landmarksOf(const TrainingMap& map) {
  constexpr std::size_t kMostImages = 2000;
  constexpr std::size_t kMostLandmarks = 20000;
  json landmarks = json::array();
  for (const LandmarkPoint& landmark : landmarkPoints(map, kMostImages, kMostLandmarks)) {
    landmarks.push_back(positionOf(landmark.position_m.head<2>()));
  }
  return landmarks;
}

json stretchesOf(const std::vector<Stretch>& stretches) {
  json all = json::array();
  for (const Stretch& stretch : stretches) {
    all.push_back({{"session", stretch.session}, {"first", stretch.first}, {"last", stretch.last}});
  }
  return all;
}

json gapsOf(const MapFindings& findings) {
  json all = json::array();
  for (const Step& step : findings.survey.longest_steps) {
    if (step.length_m <= findings.config.gap_m) continue;
    all.push_back({{"session", step.session}, {"first", step.from}, {"last", step.to}});
  }
  return all;
}

json errorsOf(const std::vector<ErrorStretch>& stretches) {
  json all = json::array();
  for (const ErrorStretch& stretch : stretches) {
    all.push_back({{"session", stretch.session},
                   {"from_m", stretch.from_m},
                   {"to_m", stretch.to_m},
                   {"most_m", pageNumber(stretch.most_m, 3)}});
  }
  return all;
}

json doubtsOf(const std::vector<Session>& sessions) {
  json all = json::array();
  for (std::size_t s = 0; s < sessions.size(); ++s) {
    for (const DoubtfulStretch& stretch : sessions[s].doubtful) {
      all.push_back({{"session", s}, {"from_m", stretch.from_m}, {"to_m", stretch.to_m}});
    }
  }
  return all;
}

json previewsOf(const TrainingMap& map) {
  constexpr std::size_t kMost_bytes = 12'000'000;
  PagePictures previews(kMost_bytes);
  for (std::size_t i = 0; i < map.size(); ++i) {
    if (previews.wants(i)) previews.add(i, map.preview(i));
  }
  return previews.toJson();
}

}  // namespace

void PagePictures::add(std::size_t image, std::vector<std::uint8_t> jpeg) {
  if (!wants(image) || jpeg.empty()) return;
  bytes_ += jpeg.size();
  jpegs_.emplace(image, std::move(jpeg));
  while (bytes_ > most_bytes_ && jpegs_.size() > 1) {
    stride_ *= 2;
    for (auto kept = jpegs_.begin(); kept != jpegs_.end();) {
      const bool stays = kept->first % stride_ == 0;
      if (!stays) bytes_ -= kept->second.size();
      kept = stays ? std::next(kept) : jpegs_.erase(kept);
    }
  }
}

json PagePictures::toJson() const {
  json jpegs = json::object();
  for (const auto& [image, jpeg] : jpegs_) jpegs[std::to_string(image)] = base64(jpeg);
  return {{"stride", stride_}, {"jpeg", std::move(jpegs)}};
}

json pageNumber(double value, int decimals) {
  const double factor = std::pow(10.0, decimals);
  return std::isfinite(value) ? json(std::round(value * factor) / factor) : json();
}

json pageMap(const std::string& path, const TrainingMap& map) {
  constexpr std::size_t kMostImages = 20000;
  const std::size_t stride = (map.size() + kMostImages - 1) / kMostImages;
  json east = json::array();
  json north = json::array();
  json session = json::array();
  for (std::size_t i = 0; i < map.size(); i += stride) {
    east.push_back(pageNumber(map.position_m(i).x(), 2));
    north.push_back(pageNumber(map.position_m(i).y(), 2));
    session.push_back(map.pose(i).session);
  }
  json sessions = json::array();
  for (const Session& one : map.header().sessions) sessions.push_back(one.name);
  return {{"path", path},
          {"size", map.size()},
          {"stride", stride},
          {"sessions", std::move(sessions)},
          {"east", std::move(east)},
          {"north", std::move(north)},
          {"session", std::move(session)},
          {"landmarks", landmarksOf(map)}};
}

void addFindings(const std::string& path, const TrainingMap& map, const MapFindings& findings, json& page_map) {
  std::ostringstream report;
  printMapReport(report, path, map, findings);
  page_map["report"] = report.str();
  page_map["previews"] = previewsOf(map);
  page_map["findings"] = {
      {"weak", stretchesOf(findings.survey.weak)},
      {"one_way", stretchesOf(findings.survey.one_way)},
      {"ambiguous", stretchesOf(findings.ambiguity ? findings.ambiguity->stretches : std::vector<Stretch>())},
      {"gaps", gapsOf(findings)},
      {"errors", errorsOf(findings.errors)},
      {"doubtful", doubtsOf(map.header().sessions)}};
}

void addBuild(const std::vector<PlottedSession>& sessions, const LocalFrame& frame, json& page_map) {
  json build = json::parse(mapPlotJson(sessions, frame));
  for (std::size_t s = 0; s < sessions.size(); ++s) {
    json& remarks = build["sessions"][s]["remarks"] = json::array();
    for (const Remark& remark : sessions[s].remarks) remarks.push_back(remark.text);
  }
  page_map["build"] = std::move(build);
}

std::string reportPage(json data) {
  data["version"] = VISUAL_LOCALIZATION_VERSION;
  // A name need not be UTF-8. ASCII alone, and no '<': no text can end the script that holds it.
  const std::string text = data.dump(-1, ' ', true, json::error_handler_t::replace);
  static const std::string kMark = "@DATA@";
  const std::string page = kReportTemplate;
  const std::size_t at = page.find(kMark);
  std::string whole = page.substr(0, at);
  for (const char c : text) c == '<' ? whole.append("\\u003c") : whole.append(1, c);
  return whole += page.substr(at + kMark.size());
}

}  // namespace visual_localization::apps
