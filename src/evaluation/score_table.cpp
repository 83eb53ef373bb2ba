#include "evaluation/score_table.h"

#include "base/parallel.h"
#include "base/time.h"

namespace visual_localization {
namespace {

/// Times of one row, so that no two threads write to the same memory.
struct RowTimes {
  double sift_ms = 0.0;
  double global_ms = 0.0;
};

RowTimes fillRow(const DriveImage& image, const TrainingMap& map, const SiftSimilarity& sift,
                 const GlobalSimilarity& global, ScoreTable::Entry* row) {
  RowTimes times;
  const CpuStopwatch sift_watch;
  for (std::size_t i = 0; i < map.size(); ++i) {
    const Score score = sift.compare(image.sift, *map.sift(i));
    row[i].sift = score.similarity;
    row[i].matches = static_cast<std::uint32_t>(score.matches);
    row[i].scale = static_cast<float>(score.scale);
  }
  times.sift_ms = sift_watch.elapsed_ms();
  const CpuStopwatch global_watch;
  for (std::size_t i = 0; i < map.size(); ++i) row[i].global = global.compare(image.global, *map.global(i)).similarity;
  times.global_ms = global_watch.elapsed_ms();
  return times;
}

}  // namespace

ScoreTable::ScoreTable(const Drive& drive, const TrainingMap& map, const MatchConfig& match, std::size_t threads)
    : training_images_(map.size()), entries_(drive.images.size() * map.size()) {
  const SimilarityConfig config;  // what a similarity means is each method's own; the similarity itself is not
  const SiftSimilarity sift(match, config);
  const GlobalSimilarity global(config);
  for (const DriveImage& image : drive.images) sift_features_.push_back(image.sift.size());
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

void RecordedImage::show(std::size_t drive_image, bool covered, const SiftFeatures* unpruned) {
  drive_image_ = drive_image;
  covered_ = covered;
  unpruned_ = unpruned;
  pose_was_asked_ = false;
  sift_comparisons_ = 0;
  global_comparisons_ = 0;
}

const SiftFeatures* RecordedImage::unprunedSift() {
  pose_was_asked_ = true;
  return covered_ ? nullptr : unpruned_;
}

void RecordedImage::configure(const FrontEndConfig& front_end, const SimilarityConfig& similarity) {
  sift_ = SiftSimilarity(front_end.match, similarity);
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
  if (kind == FeatureKind::kSift) {
    ++sift_comparisons_;
    return sift_.scoreOf(known.sift, known.matches, static_cast<double>(known.scale));
  }
  ++global_comparisons_;
  return global_.scoreOf(known.global);
}

void RecordedImage::row(FeatureKind kind, std::vector<double>& similarities) {
  similarities.resize(trainingImages());
  for (std::size_t i = 0; i < similarities.size(); ++i) {
    similarities[i] = kind == FeatureKind::kSift ? entry(i).sift : entry(i).global;
  }
  (kind == FeatureKind::kSift ? sift_comparisons_ : global_comparisons_) += similarities.size();
}

}  // namespace visual_localization
