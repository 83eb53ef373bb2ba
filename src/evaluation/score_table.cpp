#include "evaluation/score_table.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <locale>
#include <sstream>
#include <stdexcept>
#include <utility>
#include <vector>

#include "base/files.h"
#include "base/numbers.h"
#include "base/parallel.h"
#include "base/text.h"
#include "base/time.h"
#include "visual_localization/features/feature_matcher.h"

namespace visual_localization {
namespace {

constexpr std::size_t kLargestFile_bytes = 100'000'000;
constexpr double kLongestGap_s = 2.0;  ///< between poses; in a longer one nothing is known

/// The columns that count, in the order of PoseRow.
const std::array<const char*, 4> kColumns{"stamp_ns", "east_m", "north_m", "yaw_rad"};

std::vector<std::string> fieldsOf(std::string line) {
  if (!line.empty() && line.back() == '\r') line.pop_back();
  return csvFields(line);
}

template <class Number>
Number numberOf(const std::string& column, const std::string& text) {
  std::istringstream in(text);
  in.imbue(std::locale::classic());
  Number number{};
  const bool whole = (in >> number) && in.peek() == std::istringstream::traits_type::eof();
  if (!whole) throw std::runtime_error(column + " = '" + oneLine(text, 40) + "' is not a finite number");
  return number;
}

/// Reads rows by the names of their columns.
class PoseTable {
 public:
  explicit PoseTable(const std::string& header) {
    const std::vector<std::string> names = fieldsOf(header);
    columns_ = names.size();
    for (std::size_t i = 0; i < kColumns.size(); ++i) {
      const auto found = std::find(names.begin(), names.end(), kColumns[i]);
      if (found == names.end()) throw std::runtime_error(std::string("has no column ") + kColumns[i]);
      at_[i] = static_cast<std::size_t>(found - names.begin());
    }
  }

  TrajectoryPoint row(const std::string& line) const {
    const std::vector<std::string> fields = fieldsOf(line);
    if (fields.size() != columns_) {
      throw std::runtime_error("has " + std::to_string(fields.size()) + " fields, the header " +
                               std::to_string(columns_));
    }
    const auto real = [&](std::size_t i) { return numberOf<double>(kColumns[i], fields[at_[i]]); };
    return {numberOf<std::int64_t>(kColumns[0], fields[at_[0]]), {real(1), real(2)}, real(3)};
  }

 private:
  std::size_t columns_ = 0;
  std::array<std::size_t, kColumns.size()> at_{};
};

Trajectory parsePoses(const std::string& text) {
  std::istringstream in(text);
  std::string line;
  if (!std::getline(in, line)) throw std::runtime_error("is empty");
  const PoseTable table(line);
  std::vector<TrajectoryPoint> points;
  for (std::size_t number = 2; std::getline(in, line); ++number) {
    try {
      points.push_back(table.row(line));
      if (points.size() > 1 && points.back().stamp_ns <= points[points.size() - 2].stamp_ns) {
        throw std::runtime_error("stamp_ns is not later than the one before");
      }
    } catch (const std::runtime_error& error) {
      throw std::runtime_error("line " + std::to_string(number) + ": " + error.what());
    }
  }
  if (points.empty()) throw std::runtime_error("holds no pose");
  return Trajectory(std::move(points), kLongestGap_s);
}

}  // namespace

Trajectory readPoses(const std::string& path) {
  const std::string text = readFile(path, kLargestFile_bytes);
  try {
    return parsePoses(text);
  } catch (const std::runtime_error& error) {
    throw FileError(path + ": " + error.what());
  }
}

Trajectory movedOnto(const Trajectory& positions, const Trajectory& poses) {
  std::vector<double> east_m;
  std::vector<double> north_m;
  for (const TrajectoryPoint& pose : poses.points()) {
    const std::optional<TrajectoryPoint> there = positions.at(pose.stamp_ns);
    if (!there) continue;
    east_m.push_back(there->position_m.x() - pose.position_m.x());
    north_m.push_back(there->position_m.y() - pose.position_m.y());
  }
  if (east_m.empty()) throw std::runtime_error("no pose is from the time of the true positions");
  const Eigen::Vector2d shift_m(median(std::move(east_m)), median(std::move(north_m)));
  std::vector<TrajectoryPoint> moved = poses.points();
  for (TrajectoryPoint& point : moved) point.position_m += shift_m;
  return Trajectory(std::move(moved), kLongestGap_s);
}

namespace {

/// Times of one row, so that no two threads write to the same memory.
struct RowTimes {
  double sift_ms = 0.0;
  double global_ms = 0.0;
};

RowTimes fillRow(const DriveImage& image, const TrainingMap& map, const LocalSimilarity& sift,
                 const GlobalSimilarity& global, ScoreTable::Entry* row) {
  RowTimes times;
  const CpuStopwatch sift_watch;
  for (std::size_t i = 0; i < map.size(); ++i) {
    const Score score = sift.compare(image.local, *map.local(i));
    row[i].sift = score.similarity;
    row[i].matches = static_cast<std::uint32_t>(score.matches);
    row[i].scale = static_cast<float>(score.scale);
  }
  times.sift_ms = sift_watch.elapsed_ms();
  const CpuStopwatch global_watch;
  for (std::size_t i = 0; i < map.size(); ++i) row[i].global = global.compare(image.global, *map.global(i)).similarity;
  times.global_ms = global_watch.elapsed_ms();
  if (map.header().vocabulary) {
    const VladDescriptor vlad = map.header().vocabulary->describe(image.local);
    for (std::size_t i = 0; i < map.size(); ++i) row[i].vlad = static_cast<float>(vladSimilarity(vlad, *map.vlad(i)));
  }
  return times;
}

bool isRepetition(const DriveImage& image, const DriveImage& before) {
  return image.unpruned->bytes() == before.unpruned->bytes();
}

}  // namespace

void pruneByBothNeighbours(std::vector<DriveImage>& images, double max_angle_ratio, double max_gap_s) {
  for (std::size_t i = 0; i < images.size(); ++i) {
    DriveImage& image = images[i];
    if (i > 0 && isRepetition(image, images[i - 1])) {
      image.local = images[i - 1].local;
      continue;
    }
    std::vector<const LocalFeatures*> neighbours;
    const auto add = [&](const DriveImage& other) {
      constexpr std::size_t kLeast = 2;  // an image without features confirms nothing
      const double gap_s = std::abs(secondsBetween(other.stamp_ns, image.stamp_ns));
      if (gap_s <= max_gap_s && other.unpruned->size() >= kLeast) neighbours.push_back(&*other.unpruned);
    };
    if (i > 0) add(images[i - 1]);
    std::size_t next = i + 1;
    while (next < images.size() && isRepetition(images[next], image)) ++next;
    if (next < images.size()) add(images[next]);
    image.local = neighbours.empty() ? *image.unpruned : keepSeenIn(*image.unpruned, neighbours, max_angle_ratio);
  }
}

ScoreTable::ScoreTable(const Drive& drive, const TrainingMap& map, const MatchConfig& match, std::size_t threads)
    : training_images_(map.size()), entries_(drive.images.size() * map.size()) {
  const SimilarityConfig config;  // what a similarity means is each method's own; the similarity itself is not
  const LocalSimilarity sift(match, config, map.header().image_size.width, map.header().kind);
  const GlobalSimilarity global(config);
  for (const DriveImage& image : drive.images) local_features_.push_back(image.local.size());
  std::vector<RowTimes> times(drive.images.size());
  parallelFor(drive.images.size(), threads, [&](std::size_t i) {
    times[i] = fillRow(drive.images[i], map, sift, global, &entries_[i * training_images_]);
  });
  for (const RowTimes& row : times) {
    sift_compare_ms_ += row.sift_ms / static_cast<double>(entries_.size());
    global_compare_ms_ += row.global_ms / static_cast<double>(entries_.size());
  }
}

RecordedImage::RecordedImage(const ScoreTable& table, const std::vector<std::size_t>& training_images,
                             const MatchConfig& match, const SimilarityConfig& similarity)
    : table_(table), training_images_(training_images), sift_(match, similarity), global_(similarity) {}

void RecordedImage::show(std::size_t drive_image, bool covered, const LocalFeatures* unpruned) {
  drive_image_ = drive_image;
  covered_ = covered;
  unpruned_ = unpruned;
  pose_was_asked_ = false;
  sift_comparisons_ = 0;
  global_comparisons_ = 0;
}

const LocalFeatures* RecordedImage::unprunedLocal() {
  pose_was_asked_ = true;
  return covered_ ? nullptr : unpruned_;
}

void RecordedImage::configure(const FrontEndConfig& front_end, const SimilarityConfig& similarity) {
  sift_ = LocalSimilarity(front_end.match, similarity);
  global_ = GlobalSimilarity(similarity);
}

std::size_t RecordedImage::trainingImages() const {
  return training_images_.empty() ? table_.trainingImages() : training_images_.size();
}

const ScoreTable::Entry& RecordedImage::entry(std::size_t training_image) const {
  static const ScoreTable::Entry kNothing;
  if (covered_) return kNothing;
  return table_.at(drive_image_, training_images_.empty() ? training_image : training_images_[training_image]);
}

Score RecordedImage::compare(FeatureKind kind, std::size_t training_image) {
  const ScoreTable::Entry& known = entry(training_image);
  if (kind == FeatureKind::kLocal) {
    ++sift_comparisons_;
    return sift_.scoreOf(known.sift, known.matches, static_cast<double>(known.scale));
  }
  if (kind == FeatureKind::kVlad) {  // costs next to nothing, once the local features are there
    const auto similarity = static_cast<double>(known.vlad);
    return {similarity, similarity};
  }
  ++global_comparisons_;
  return global_.scoreOf(known.global);
}

void RecordedImage::row(FeatureKind kind, std::vector<double>& similarities) {
  similarities.resize(trainingImages());
  for (std::size_t i = 0; i < similarities.size(); ++i) {
    similarities[i] = kind == FeatureKind::kLocal ? entry(i).sift : entry(i).global;
  }
  (kind == FeatureKind::kLocal ? sift_comparisons_ : global_comparisons_) += similarities.size();
}

}  // namespace visual_localization
