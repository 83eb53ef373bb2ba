#include "visual_localization/localization/scores.h"

#include <algorithm>
#include <utility>

#include "base/numbers.h"
#include "visual_localization/localization/particles.h"

namespace visual_localization {

Scores::Cache::Entry& Scores::Cache::at(FeatureKind kind, std::size_t training_image, const Compare& compare) {
  std::uint32_t& entry = entry_of_.at(training_image);
  if (entry < entries_.size() && entries_[entry].training_image == training_image) return entries_[entry];
  const Score score = compare(kind, training_image);
  entry = static_cast<std::uint32_t>(entries_.size());
  entries_.push_back({training_image, score, false});
  return entries_.back();
}

void Scores::startImage(FeatureKind kind, Compare compare) {
  kind_ = kind;
  compare_ = std::move(compare);
  local_.clear();
  global_.clear();
  vlad_.clear();
  comparisons_ = 0;
  counted_ = 0;
}

Score Scores::operator[](std::size_t training_image) {
  Cache& cache = kind_ == FeatureKind::kLocal ? local_ : global_;
  Cache::Entry& entry = cache.at(kind_, training_image, compare_);
  if (!entry.counted) ++comparisons_;
  entry.counted = true;
  return entry.score;
}

Score Scores::global(std::size_t training_image) {
  return global_.at(FeatureKind::kGlobal, training_image, compare_).score;
}

Score Scores::vlad(std::size_t training_image) { return vlad_.at(FeatureKind::kVlad, training_image, compare_).score; }

std::vector<Scores::Compared> Scores::compared() const {
  std::vector<Compared> compared;
  for (const Cache::Entry& entry : (kind_ == FeatureKind::kLocal ? local_ : global_).entries()) {
    if (entry.counted) compared.push_back({entry.training_image, entry.score});
  }
  return compared;
}

std::vector<std::size_t> Scores::mostSimilar() const {
  std::vector<std::pair<double, std::size_t>> order;
  for (const Cache::Entry& entry : (kind_ == FeatureKind::kLocal ? local_ : global_).entries()) {
    if (entry.counted) order.emplace_back(-entry.score.similarity, entry.training_image);
  }
  std::sort(order.begin(), order.end());
  std::vector<std::size_t> images;
  for (const auto& [similarity, image] : order) images.push_back(image);
  return images;
}

void Scores::count(const std::vector<std::size_t>& training_images) {
  const std::vector<std::size_t> known = kind_ == FeatureKind::kLocal ? mostSimilar() : std::vector<std::size_t>();
  counted_ = 0;
  for (const std::size_t image : training_images) {
    if (std::find(known.begin(), known.end(), image) == known.end()) ++counted_;
  }
}

std::size_t Scores::swept() const {
  return global_.size() - (kind_ == FeatureKind::kGlobal ? comparisons_ : 0) + vlad_.size();
}

MapSweep::MapSweep(const TrainingMap& map, std::size_t max_images, std::size_t max_kept, bool by_vlad)
    : map_(map), max_kept_(max_kept) {
  configure(max_images, by_vlad);
}

void MapSweep::configure(std::size_t max_images, bool by_vlad) {
  by_vlad_ = by_vlad && map_.header().vocabulary != nullptr;
  stride_ = strideFor(map_.size(), max_images);
  const std::size_t swept = (map_.size() + stride_ - 1) / stride_;
  offsets_ = std::clamp<std::size_t>(max_kept_ / swept, 1, stride_);
  startImage();
}

void MapSweep::startImage() {
  cumulated_.clear();
  has_begun_ = false;
}

/// With other images than for the image before.
void MapSweep::begin() {
  if (std::exchange(has_begun_, true)) return;
  offset_ = (offset_ + 1) % offsets_;
  first_ = offset_ * stride_ / offsets_;
}

void MapSweep::sweep(Scores& scores) {
  if (!cumulated_.empty()) return;
  begin();
  double total = 0.0;
  for (std::size_t i = first_; i < map_.size(); i += stride_) {
    total += scores.global(i).weight;
    cumulated_.push_back(total);
  }
  if (total > 0.0) return;
  for (std::size_t i = 0; i < cumulated_.size(); ++i) cumulated_[i] = static_cast<double>(i + 1);
}

std::size_t MapSweep::draw(Scores& scores, Random& random) {
  sweep(scores);
  const double target = random.uniform(0.0, cumulated_.back());
  const auto found = std::upper_bound(cumulated_.begin(), cumulated_.end(), target);
  return imageAt(std::min(cumulated_.size() - 1, static_cast<std::size_t>(found - cumulated_.begin())));
}

std::vector<std::size_t> MapSweep::mostSimilar(Scores& scores, std::size_t count) {
  begin();
  const bool by_vlad = by_vlad_ && scores.kind() == FeatureKind::kLocal;
  std::vector<std::pair<double, std::size_t>> order;
  for (std::size_t i = first_; i < map_.size(); i += stride_) {
    order.emplace_back(-(by_vlad ? scores.vlad(i) : scores.global(i)).similarity, i);
  }
  const auto end = order.begin() + static_cast<std::ptrdiff_t>(std::min(count, order.size()));
  std::partial_sort(order.begin(), end, order.end());
  std::vector<std::size_t> images;
  for (auto entry = order.begin(); entry != end; ++entry) images.push_back(entry->second);
  return images;
}

double MapSweep::ratio(Scores& scores, const Eigen::Vector2d& position_m, double near_m) {
  constexpr std::size_t kNeighbours = 32;  // these are always asked; more of them when the sweep reaches them
  double here = 0.0;
  map_.nearest(position_m, kNeighbours, neighbours_);
  for (const Neighbour& neighbour : neighbours_) {
    if (neighbour.distance_m <= near_m) here = std::max(here, scores.global(neighbour.image).similarity);
  }
  double anywhere = here;
  sweep(scores);
  for (std::size_t i = first_; i < map_.size(); i += stride_) {
    const double similarity = scores.global(i).similarity;
    anywhere = std::max(anywhere, similarity);
    // With several sessions there are more than kNeighbours here, and those are no rivals.
    if ((map_.position_m(i) - position_m).norm() <= near_m) here = std::max(here, similarity);
  }
  return anywhere > 0.0 ? here / anywhere : 1.0;
}

}  // namespace visual_localization
