#include "visual_localization/localization/scores.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include "base/numbers.h"
#include "base/text.h"
#include "base/time.h"
#include "visual_localization/localization/particles.h"

namespace visual_localization {

void SimilarityConfig::declare(ParameterVisitor& visitor) {
  visitor.real({"similarity/sift_recognised", "1",
                "a best match below this share of the features is a bad one (journal, section 5)"},
               sift_recognised, 0.0, 1.0);
}

LocalSimilarity::LocalSimilarity(const MatchConfig& match, const SimilarityConfig& config, int image_width_px,
                                 std::shared_ptr<const LocalFeatureKind> kind)
    : kind_(std::move(kind)),
      match_(match),
      recognised_(config.recognised(FeatureKind::kLocal, match)),
      exponent_(match.isByVotes() ? config.votes_exponent : 1.0),
      image_width_px_(image_width_px) {}

Score LocalSimilarity::compare(const LocalFeatures& current, const LocalFeatures& training) const {
  if (current.size() < 2 || training.size() < 2) return {};
  static thread_local std::vector<FeatureMatch> matches;
  kind_->match(match_, current, training, image_width_px_, matches);
  const std::size_t possible = match_.isOneWay() ? current.size() : std::min(current.size(), training.size());
  return scoreOf(static_cast<double>(matches.size()) / static_cast<double>(possible), matches.size(),
                 medianScale(current, training, matches));
}

Score LocalSimilarity::scoreOf(double similarity, std::size_t matches, double scale) const {
  return {similarity, std::pow(similarity, exponent_), matches, similarity >= recognised_, scale};
}

Score GlobalSimilarity::compare(const GlobalFeatures& current, const GlobalFeatures& training) const {
  return scoreOf(histogramIntersection(current.wgoh, training.wgoh) *
                 histogramIntersection(current.wgii, training.wgii));
}

Score GlobalSimilarity::scoreOf(double similarity) const {
  return {similarity, std::pow(similarity, config_.global_exponent), 0, similarity >= config_.global_recognised};
}

void HybridConfig::declare(ParameterVisitor& visitor) {
  visitor.real(
      {"hybrid/sift_below", "m", "after SIFT, global features follow when the cloud's sigmas are below (d_SIFT)"},
      sift_below_m, 0.0, 10000.0);
  visitor.real({"hybrid/global_above", "m", "after global features, SIFT follows when a sigma is above (d_global)"},
               global_above_m, 0.0, 10000.0);
  visitor.flag({"hybrid/sift_in_doubt", "", "SIFT also while the images look more like another place"}, sift_in_doubt);
  visitor.integer(
      {"hybrid/sift_every", "1",
       "SIFT at least once in this number of images, and until an image confirms the position; 0: no such check"},
      sift_every, 0, 1000000);
}

FeatureChoice::FeatureChoice(const std::string& features, const HybridConfig& config)
    : hybrid_(features == "hybrid"),
      config_(config),
      first_(features == "global" ? FeatureKind::kGlobal : FeatureKind::kLocal),
      next_(first_) {}

void FeatureChoice::configure(const std::string& features, const HybridConfig& config) {
  FeatureChoice changed(features, config);
  if (changed.hybrid_ == hybrid_ && changed.first_ == first_) {
    changed.next_ = next_;
    changed.since_local_ = since_local_;
  }
  *this = changed;
}

void FeatureChoice::reset() {
  next_ = first_;
  since_local_ = 0;
}

void FeatureChoice::update(const Eigen::Vector2d& spread_m, bool confirmed, bool doubtful) {
  if (!hybrid_) return;
  since_local_ = next_ == FeatureKind::kLocal ? 0 : since_local_ + 1;
  if (isLocalDue(confirmed) || (doubtful && config_.sift_in_doubt)) {
    next_ = FeatureKind::kLocal;
    return;
  }
  const double largest_m = spread_m.maxCoeff();
  if (next_ == FeatureKind::kLocal && largest_m < config_.sift_below_m) {
    next_ = FeatureKind::kGlobal;
  } else if (next_ == FeatureKind::kGlobal && largest_m > config_.global_above_m) {
    next_ = FeatureKind::kLocal;
  }
}

bool FeatureChoice::isLocalDue(bool confirmed) const {
  if (config_.sift_every == 0) return false;
  return since_local_ + 1 >= config_.sift_every || (next_ == FeatureKind::kLocal && !confirmed);
}

LiveImage::LiveImage(const TrainingMap& map, const FrontEndConfig& front_end, const SimilarityConfig& similarity)
    : map_(map),
      name_(upperCase(map.header().kind->name())),
      front_end_(front_end),
      local_similarity_(front_end.match, similarity, map.header().image_size.width, map.header().kind),
      global_similarity_(similarity) {}

void LiveImage::set(std::int64_t stamp_ns, const cv::Mat& grey) {
  front_end_.setImage(stamp_ns, grey);
  match_ms_ = 0.0;
}

Score LiveImage::compare(FeatureKind kind, std::size_t training_image) {
  // What the map must read from its file counts as comparing: without the comparison there would be no need.
  if (kind == FeatureKind::kLocal) {
    const LocalFeatures& current = front_end_.local();
    const Stopwatch stopwatch;
    const Score score = local_similarity_.compare(current, *map_.local(training_image));
    match_ms_ += stopwatch.elapsed_ms();
    return score;
  }
  const GlobalFeatures& current = front_end_.global();
  const Stopwatch stopwatch;
  const Score score = global_similarity_.compare(current, *map_.global(training_image));
  match_ms_ += stopwatch.elapsed_ms();
  return score;
}

ImageReport LiveImage::report() const {
  return {front_end_.statistics(), name_,    front_end_.localExtracted(), local() == nullptr ? 0 : local()->size(),
          front_end_.extract_ms(), match_ms_};
}

void LiveImage::configure(const FrontEndConfig& front_end, const SimilarityConfig& similarity) {
  front_end_.configure(front_end);
  local_similarity_ = LocalSimilarity(front_end.match, similarity, map_.header().image_size.width, map_.header().kind);
  global_similarity_ = GlobalSimilarity(similarity);
}

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

std::size_t Scores::swept() const { return global_.size() - (kind_ == FeatureKind::kGlobal ? comparisons_ : 0); }

MapSweep::MapSweep(const TrainingMap& map, std::size_t max_images, std::size_t max_kept)
    : map_(map), max_kept_(max_kept) {
  configure(max_images);
}

void MapSweep::configure(std::size_t max_images) {
  stride_ = strideFor(map_.size(), max_images);
  const std::size_t swept = (map_.size() + stride_ - 1) / stride_;
  offsets_ = std::clamp<std::size_t>(max_kept_ / swept, 1, stride_);
  startImage();
}

void MapSweep::sweep(Scores& scores) {
  if (!cumulated_.empty()) return;
  offset_ = (offset_ + 1) % offsets_;
  first_ = offset_ * stride_ / offsets_;
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
  sweep(scores);
  std::vector<std::pair<double, std::size_t>> order;
  for (std::size_t i = first_; i < map_.size(); i += stride_) order.emplace_back(-scores.global(i).similarity, i);
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

namespace {

constexpr std::size_t kMostSteps = 10;
constexpr double kFarthest_m = 10.0;      ///< between neighbours on a path; beyond a gap another one begins
constexpr std::size_t kLeastMatches = 8;  ///< for a median of their ratios

/// The next image of the session, ahead or behind.
std::optional<std::size_t> neighbourOf(const TrainingMap& map, std::size_t image, bool ahead) {
  if (ahead ? image + 1 >= map.size() : image == 0) return std::nullopt;
  const std::size_t next = ahead ? image + 1 : image - 1;
  if (map.pose(next).session != map.pose(image).session) return std::nullopt;
  if ((map.position_m(next) - map.position_m(image)).norm() > kFarthest_m) return std::nullopt;
  return next;
}

/// Positive when the image was taken ahead of the training image.
std::optional<double> leadOf(const Score& score) {
  if (!score.recognised || score.matches < kLeastMatches || !(score.scale > 0.0)) return std::nullopt;
  return std::log(score.scale);
}

}  // namespace

Eigen::Vector2d interpolateOnPath(const TrainingMap& map, Scores& scores, std::size_t image) {
  std::optional<double> lead = leadOf(scores[image]);
  const bool ahead = lead.value_or(0.0) > 0.0;
  std::size_t nearest = image;
  for (std::size_t step = 0; lead && *lead != 0.0 && step < kMostSteps; ++step) {
    const auto next = neighbourOf(map, nearest, ahead);
    const auto next_lead = next ? leadOf(scores[*next]) : std::nullopt;
    if (!next_lead) break;
    if ((*next_lead > 0.0) != ahead) {
      const double share = *lead / (*lead - *next_lead);
      return map.position_m(nearest) + share * (map.position_m(*next) - map.position_m(nearest));
    }
    if (std::abs(*next_lead) >= std::abs(*lead)) break;
    nearest = *next;
    lead = next_lead;
  }
  return map.position_m(nearest);
}

}  // namespace visual_localization
