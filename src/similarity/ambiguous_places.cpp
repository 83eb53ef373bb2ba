#include "visual_localization/similarity/ambiguous_places.h"

#include <algorithm>
#include <cmath>
#include <memory>
#include <optional>

#include "visual_localization/geo/angles.h"
#include "visual_localization/similarity/global_similarity.h"
#include "visual_localization/similarity/sift_similarity.h"

namespace visual_localization {
namespace {

constexpr std::size_t kNearImages = 16;  ///< looked at
constexpr std::size_t kNearCompared = 4;
constexpr double kSameView_rad = 0.5 * kPi;

struct Alike {
  std::size_t image = 0;
  double similarity = 0.0;
};

bool isMoreAlike(const Alike& a, const Alike& b) {
  return a.similarity != b.similarity ? a.similarity > b.similarity : a.image < b.image;
}

/// Keeps the `count` most alike, best first.
void keepBest(std::size_t count, std::vector<Alike>& images) {
  const auto end = images.begin() + static_cast<std::ptrdiff_t>(std::min(count, images.size()));
  std::partial_sort(images.begin(), end, images.end(), isMoreAlike);
  images.erase(end, images.end());
}

class Search {
 public:
  Search(const TrainingMap& map, const AmbiguityConfig& config)
      : map_(map),
        config_(config),
        stride_(std::max<std::size_t>(1, (map.size() + config.most_images - 1) / config.most_images)),
        global_(config.similarity),
        sift_(config.match, config.similarity),
        work_left_(config.most_work) {
    for (std::size_t i = 0; i < map.size(); i += stride_) globals_.push_back(map.global(i));
  }

  std::size_t stride() const { return stride_; }
  std::size_t images() const { return globals_.size(); }

  /// About the image `number` of images(); nothing when no work is left for it.
  std::optional<AmbiguousImage> ask(std::size_t number) {
    const std::size_t image = number * stride_;
    const std::vector<Alike> near = nearImages(image);
    const std::vector<Alike> far = farImages(number);
    global_rivals_ += !near.empty() && !far.empty() && near.front().similarity > 0.0 &&
                      far.front().similarity >= config_.global_nearly_as_good * near.front().similarity;
    if (!takeWork(image, near, far)) return std::nullopt;
    AmbiguousImage answer{image, image, 0.0, 0.0};
    for (const Alike& other : near)
      answer.near_similarity = std::max(answer.near_similarity, bySift(image, other.image));
    for (const Alike& other : far) {
      const double similarity = bySift(image, other.image);
      if (similarity > answer.similarity) {
        answer.twin = other.image;
        answer.similarity = similarity;
      }
    }
    return answer;
  }

  bool isAmbiguous(const AmbiguousImage& answer) const {
    return answer.similarity >= config_.least_similarity && answer.similarity > 0.0 &&
           answer.similarity >= config_.nearly_as_good * answer.near_similarity;
  }

  std::size_t globalRivals() const { return global_rivals_; }

 private:
  std::vector<Alike> nearImages(std::size_t image) {
    std::vector<Alike> near;
    map_.nearest(map_.position_m(image), kNearImages, neighbours_);
    for (const Neighbour& neighbour : neighbours_) {
      const double turn_rad = angleDifference(map_.yaw_rad(image), map_.yaw_rad(neighbour.image));
      if (neighbour.image == image || neighbour.distance_m > config_.near_m || std::abs(turn_rad) > kSameView_rad) {
        continue;
      }
      near.push_back({neighbour.image, globally(*map_.global(image), *map_.global(neighbour.image))});
    }
    keepBest(kNearCompared, near);
    return near;
  }

  std::vector<Alike> farImages(std::size_t number) {
    std::vector<Alike> far;
    const Eigen::Vector2d here_m = map_.position_m(number * stride_);
    for (std::size_t other = 0; other < globals_.size(); ++other) {
      const std::size_t image = other * stride_;
      if ((map_.position_m(image) - here_m).norm() <= config_.far_m) continue;
      far.push_back({image, globally(*globals_[number], *globals_[other])});
    }
    keepBest(config_.shortlist, far);
    return far;
  }

  double globally(const GlobalFeatures& a, const GlobalFeatures& b) const { return global_.compare(a, b).similarity; }
  double bySift(std::size_t a, std::size_t b) const { return sift_.compare(*map_.sift(a), *map_.sift(b)).similarity; }

  /// What the places say saves reading what is too much; what the features are is what counts.
  bool takeWork(std::size_t image, const std::vector<Alike>& near, const std::vector<Alike>& far) {
    const auto said = [this](std::size_t i) { return map_.featureCount(i); };
    if (workOf(image, near, far, said) > work_left_) return false;
    const std::uint64_t work = workOf(image, near, far, [this](std::size_t i) { return map_.sift(i)->size(); });
    if (work > work_left_) return false;
    work_left_ -= work;
    return true;
  }

  /// Pairs of descriptors.
  template <class SizeOf>
  static std::uint64_t workOf(std::size_t image, const std::vector<Alike>& near, const std::vector<Alike>& far,
                              SizeOf sizeOf) {
    std::uint64_t others = 0;
    for (const Alike& other : near) others += sizeOf(other.image);
    for (const Alike& other : far) others += sizeOf(other.image);
    return others * sizeOf(image);
  }

  const TrainingMap& map_;
  AmbiguityConfig config_;
  std::size_t stride_;
  GlobalSimilarity global_;
  SiftSimilarity sift_;
  std::uint64_t work_left_;
  std::vector<std::shared_ptr<const GlobalFeatures>> globals_;  ///< of every stride_-th image
  std::vector<Neighbour> neighbours_;
  std::size_t global_rivals_ = 0;
};

}  // namespace

AmbiguousPlaces findAmbiguousPlaces(const TrainingMap& map, const AmbiguityConfig& config,
                                    const AmbiguityProgress& progress) {
  Search search(map, config);
  AmbiguousPlaces result;
  result.stride = search.stride();
  for (std::size_t number = 0; number < search.images(); ++number) {
    const std::optional<AmbiguousImage> answer = search.ask(number);
    ++(answer ? result.asked : result.unasked);
    if (answer && search.isAmbiguous(*answer)) result.images.push_back(*answer);
    if (progress) progress(number + 1, search.images());
  }
  result.global_only = search.globalRivals();
  // Images in between that were not asked about do not end a stretch, but for those of another session.
  const auto belongs = [&](std::size_t i) {
    const std::size_t asked = i - i % result.stride;
    const auto found = std::lower_bound(result.images.begin(), result.images.end(), asked,
                                        [](const AmbiguousImage& a, std::size_t image) { return a.image < image; });
    return found != result.images.end() && found->image == asked && map.place(asked).session == map.place(i).session;
  };
  result.stretches = stretchesOf(map, config.far_m, belongs);
  return result;
}

}  // namespace visual_localization
