#include <algorithm>
#include <cstdint>
#include <memory>
#include <utility>
#include <vector>

#include "base/numbers.h"
#include "survey/map_survey.h"
#include "visual_localization/localization/similarity.h"

namespace visual_localization {
namespace {

constexpr std::size_t kNearImages = 16;  ///< looked at
constexpr std::size_t kNearCompared = 4;

struct Alike {
  std::size_t image = 0;
  double similarity = 0.0;
};

bool isMoreAlike(const Alike& a, const Alike& b) {
  return a.similarity != b.similarity ? a.similarity > b.similarity : a.image < b.image;
}

/// Best first.
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
        global_(config.similarity),
        sift_(config.match, config.similarity, map.header().image_size.width),
        work_left_(config.most_work) {
    result_.stride = strideFor(map.size(), config.most_images);
    for (std::size_t i = 0; i < map.size(); i += result_.stride) globals_.push_back(map.global(i));
  }

  std::size_t images() const { return globals_.size(); }

  void ask(std::size_t number) {
    const std::size_t image = number * result_.stride;
    const std::vector<Alike> near = nearImages(image);
    if (near.empty()) {
      ++result_.unjudged;
      return;
    }
    const std::vector<Alike> far = farImages(number);
    if (!far.empty() && near.front().similarity > 0.0 &&
        far.front().similarity >= config_.global_nearly_as_good * near.front().similarity) {
      ++result_.global_only;
    }
    if (!takeWork(image, near, far)) {
      ++result_.unasked;
      return;
    }
    ++result_.asked;
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
    if (isAmbiguous(answer)) result_.images.push_back(answer);
  }

  AmbiguousPlaces result() && {
    const auto belongs = [this](std::size_t image) { return wasAmbiguous(image); };
    result_.stretches = stretchesOf(map_, config_.far_m, belongs);
    return std::move(result_);
  }

 private:
  std::vector<Alike> nearImages(std::size_t image) {
    std::vector<Alike> near;
    const auto global = map_.global(image);
    map_.nearestFacing(image, kNearImages, config_.near_m, neighbours_);
    for (const Neighbour& neighbour : neighbours_) {
      near.push_back({neighbour.image, globally(*global, *map_.global(neighbour.image))});
    }
    keepBest(kNearCompared, near);
    return near;
  }

  std::vector<Alike> farImages(std::size_t number) {
    std::vector<Alike> far;
    const Eigen::Vector2d here_m = map_.position_m(number * result_.stride);
    for (std::size_t other = 0; other < globals_.size(); ++other) {
      const std::size_t image = other * result_.stride;
      if ((map_.position_m(image) - here_m).norm() <= config_.far_m) continue;
      far.push_back({image, globally(*globals_[number], *globals_[other])});
    }
    keepBest(config_.shortlist, far);
    return far;
  }

  double globally(const GlobalFeatures& a, const GlobalFeatures& b) const { return global_.compare(a, b).similarity; }
  double bySift(std::size_t a, std::size_t b) const { return sift_.compare(*map_.local(a), *map_.local(b)).similarity; }

  /// Feature counts save reading what is too much.
  bool takeWork(std::size_t image, const std::vector<Alike>& near, const std::vector<Alike>& far) {
    const auto said = [this](std::size_t i) { return map_.featureCount(i); };
    if (workOf(image, near, far, said) > work_left_) return false;
    const std::uint64_t work = workOf(image, near, far, [this](std::size_t i) { return map_.local(i)->size(); });
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

  bool isAmbiguous(const AmbiguousImage& answer) const {
    return answer.similarity >= config_.least_similarity && answer.similarity > 0.0 &&
           answer.similarity >= config_.nearly_as_good * answer.near_similarity;
  }

  /// Images in between that were not asked about do not end a stretch.
  bool wasAmbiguous(std::size_t image) const {
    const std::size_t asked = image - image % result_.stride;
    const auto found = std::lower_bound(result_.images.begin(), result_.images.end(), asked,
                                        [](const AmbiguousImage& a, std::size_t b) { return a.image < b; });
    return found != result_.images.end() && found->image == asked &&
           map_.pose(asked).session == map_.pose(image).session;
  }

  const TrainingMap& map_;
  AmbiguityConfig config_;
  GlobalSimilarity global_;
  LocalSimilarity sift_;
  std::uint64_t work_left_;
  std::vector<std::shared_ptr<const GlobalFeatures>> globals_;  ///< of every stride_-th image
  std::vector<Neighbour> neighbours_;
  AmbiguousPlaces result_;
};

}  // namespace

AmbiguousPlaces findAmbiguousPlaces(const TrainingMap& map, const AmbiguityConfig& config, const Progress& progress) {
  Search search(map, config);
  for (std::size_t number = 0; number < search.images(); ++number) {
    search.ask(number);
    if (progress) progress(number + 1, search.images());
  }
  return std::move(search).result();
}

}  // namespace visual_localization
