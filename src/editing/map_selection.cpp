#include "editing/map_selection.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <set>
#include <string_view>
#include <tuple>
#include <utility>

#include "base/numbers.h"
#include "base/text.h"
#include "map/map_geometry.h"
#include "map/map_writer.h"
#include "visual_localization/map/map_file.h"

namespace visual_localization {
namespace {

constexpr const char* kHeader = "stamp_ns,poses,landmarks";
constexpr int kDirections = 4;  ///< of view that are told apart at a place

using Place = std::tuple<std::int64_t, std::int64_t, int>;

Place placeOf(const TrainingMap& map, std::size_t image) {
  const Eigen::Vector2d cell = map.position_m(image) / kPlace_m;
  const double turn = map.yaw_rad(image) / (2.0 * kPi) * kDirections;
  const auto direction = static_cast<int>(std::llround(turn - std::floor(turn / kDirections) * kDirections));
  return {std::llround(std::floor(cell.x())), std::llround(std::floor(cell.y())), direction % kDirections};
}

[[noreturn]] void refuse(std::size_t line, const std::string& reason) {
  throw UsageFileError("line " + std::to_string(line) + ": " + reason);
}

/// Up to `separator`, or all of it; what follows is left.
std::string_view takeField(std::string_view& text, char separator) {
  const std::size_t end = std::min(text.find(separator), text.size());
  const std::string_view field = text.substr(0, end);
  text.remove_prefix(std::min(end + 1, text.size()));
  return field;
}

template <class Integer>
Integer takeNumber(std::string_view& text, char separator, std::size_t line) {
  const std::string_view field = takeField(text, separator);
  Integer number = 0;
  const auto read = std::from_chars(field.data(), field.data() + field.size(), number);
  if (read.ec != std::errc() || read.ptr != field.data() + field.size()) {
    refuse(line, "'" + oneLine(std::string(field), 40) + "' is not a valid number");
  }
  return number;
}

}  // namespace

void MapUsage::add(const TrainingMap& map, const MatchedLandmarks& matched) {
  OfImage& image = images_[map.pose(matched.training_image).stamp_ns];
  ++image.poses;
  for (const MatchedLandmark& landmark : matched.landmarks) {
    if (landmark.inlier) ++image.landmarks[landmark.training_feature];
  }
}

void MapUsage::add(const MapUsage& other) {
  for (const auto& [stamp_ns, used] : other.images_) {
    OfImage& image = images_[stamp_ns];
    image.poses += used.poses;
    for (const auto& [feature, count] : used.landmarks) image.landmarks[feature] += count;
  }
}

const MapUsage::OfImage* MapUsage::find(std::int64_t stamp_ns) const {
  const auto found = images_.find(stamp_ns);
  return found == images_.end() ? nullptr : &found->second;
}

std::string MapUsage::toCsv() const {
  std::string text = std::string(kHeader) + '\n';
  for (const auto& [stamp_ns, image] : images_) {
    text += std::to_string(stamp_ns) + ',' + std::to_string(image.poses) + ',';
    for (const auto& [feature, count] : image.landmarks) {
      if (text.back() != ',') text += ' ';
      text += std::to_string(feature) + ':' + std::to_string(count);
    }
    text += '\n';
  }
  return text;
}

MapUsage MapUsage::fromCsv(const std::string& text) {
  std::string_view left = text;
  if (takeField(left, '\n') != kHeader) refuse(1, std::string("must be '") + kHeader + "'");
  MapUsage usage;
  for (std::size_t line = 2; !left.empty(); ++line) {
    std::string_view row = takeField(left, '\n');
    const auto stamp_ns = takeNumber<std::int64_t>(row, ',', line);
    if (usage.images_.count(stamp_ns) != 0) refuse(line, "stamp " + std::to_string(stamp_ns) + " was there before");
    OfImage& image = usage.images_[stamp_ns];
    image.poses = takeNumber<std::uint64_t>(row, ',', line);
    while (!row.empty()) {
      std::string_view landmark = takeField(row, ' ');
      const auto feature = takeNumber<std::uint32_t>(landmark, ':', line);
      image.landmarks[feature] += takeNumber<std::uint64_t>(landmark, ':', line);
    }
  }
  return usage;
}

std::vector<bool> summary(const TrainingMap& map, const MapUsage& usage, const SummaryConfig& config) {
  std::map<Place, std::vector<std::size_t>> places;
  for (std::size_t i = 0; i < map.size(); ++i) places[placeOf(map, i)].push_back(i);
  const auto posesOf = [&](std::size_t image) {
    const MapUsage::OfImage* used = usage.find(map.pose(image).stamp_ns);
    return used == nullptr ? 0 : used->poses;
  };
  std::vector<bool> keep(map.size(), false);
  for (auto& [place, images] : places) {
    std::stable_sort(images.begin(), images.end(),
                     [&](std::size_t a, std::size_t b) { return posesOf(a) > posesOf(b); });
    if (!config.unused_places && posesOf(images.front()) == 0) {
      for (const std::size_t image : images) keep[image] = true;
      continue;
    }
    std::set<int> sessions;
    std::size_t kept = 0;
    for (const std::size_t image : images) {  // the best of each session
      if (!sessions.insert(map.pose(image).session).second) continue;
      keep[image] = true;
      ++kept;
    }
    for (const std::size_t image : images) {
      if (kept >= config.images_per_place) break;
      if (keep[image]) continue;
      keep[image] = true;
      ++kept;
    }
  }
  return keep;
}

void dropUnusedLandmarks(TrainingImage& image, const MapUsage& usage, const SummaryConfig& config) {
  const MapUsage::OfImage* used = usage.find(image.stamp_ns);
  if (used == nullptr || !image.geometry) return;
  std::vector<SeenLandmark>& landmarks = image.geometry->landmarks;
  const auto countOf = [&](const SeenLandmark& landmark) {
    const auto found = used->landmarks.find(landmark.feature);
    return found == used->landmarks.end() ? std::uint64_t{0} : found->second;
  };
  std::stable_sort(landmarks.begin(), landmarks.end(),
                   [&](const SeenLandmark& a, const SeenLandmark& b) { return countOf(a) > countOf(b); });
  const auto unused =
      std::find_if(landmarks.begin(), landmarks.end(), [&](const SeenLandmark& of) { return countOf(of) == 0; });
  const std::size_t kept = std::max(static_cast<std::size_t>(unused - landmarks.begin()), config.landmarks_per_image);
  if (kept < landmarks.size()) landmarks.resize(kept);
  std::sort(landmarks.begin(), landmarks.end(),
            [](const SeenLandmark& a, const SeenLandmark& b) { return a.feature < b.feature; });
}

namespace {

/// With the sessions that are left, and the new number of each.
std::pair<MapHeader, std::vector<int>> remaining(const TrainingMap& map, const std::vector<bool>& keep) {
  std::vector<bool> used(map.header().sessions.size(), false);
  for (std::size_t i = 0; i < map.size(); ++i) {
    if (keep[i]) used[static_cast<std::size_t>(map.pose(i).session)] = true;
  }
  MapHeader header = map.header();
  header.sessions.clear();
  std::vector<int> numbers(used.size(), 0);
  for (std::size_t s = 0; s < used.size(); ++s) {
    numbers[s] = static_cast<int>(header.sessions.size());
    if (used[s]) header.sessions.push_back(map.header().sessions[s]);
  }
  return {std::move(header), std::move(numbers)};
}

}  // namespace

void writeSelection(const TrainingMap& map, const std::vector<bool>& keep, const std::string& edit,
                    const std::string& path, const Progress& progress,
                    const std::function<void(TrainingImage&)>& change) {
  if (std::find(keep.begin(), keep.end(), true) == keep.end()) throw MapEditError("no image would be left");
  auto [header, numbers] = remaining(map, keep);
  if (!edit.empty()) header.history.push_back(edit);
  std::vector<std::size_t> kept;
  for (std::size_t i = 0; i < map.size(); ++i) {
    if (keep[i]) kept.push_back(i);
  }
  // Words of other images find less: half as much in the map of another place.
  header.vocabulary = VladVocabulary::learn(
      kept.size(), [&](std::size_t i) { return map.local(kept[i]); }, header.image_size);
  MapWriter writer(path, header.kind);
  for (std::size_t i = 0; i < map.size(); ++i) {
    if (keep[i]) {
      TrainingImage image = map.image(i);
      image.session = numbers[static_cast<std::size_t>(image.session)];
      if (change) change(image);
      image.vlad = header.vocabulary ? header.vocabulary->describe(image.local) : VladDescriptor();
      writer.append(image);
    }
    if (progress) progress(i + 1, map.size());
  }
  writer.finish(header);
}

std::vector<bool> withoutSession(const TrainingMap& map, const std::string& name) {
  const std::vector<Session>& sessions = map.header().sessions;
  std::vector<std::string> names;
  for (const Session& session : sessions) names.push_back("'" + session.name + "'");
  const bool known = std::any_of(sessions.begin(), sessions.end(), [&](const Session& s) { return s.name == name; });
  if (!known) throw MapEditError("has no session '" + name + "', but " + joined(names, ", "));
  std::vector<bool> keep(map.size());
  for (std::size_t i = 0; i < map.size(); ++i) {
    keep[i] = sessions[static_cast<std::size_t>(map.pose(i).session)].name != name;
  }
  return keep;
}

std::vector<bool> spaced(const TrainingMap& map, double spacing_m) {
  std::vector<SpacingFilter> filters(map.header().sessions.size(), SpacingFilter(spacing_m));
  std::vector<bool> keep(map.size());
  for (std::size_t i = 0; i < map.size(); ++i) {
    keep[i] = filters[static_cast<std::size_t>(map.pose(i).session)].keeps(map.position_m(i));
  }
  return keep;
}

}  // namespace visual_localization
