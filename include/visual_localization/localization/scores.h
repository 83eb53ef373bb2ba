#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <vector>

#include "visual_localization/features/front_end.h"
#include "visual_localization/features/global_features.h"
#include "visual_localization/features/sift_features.h"
#include "visual_localization/features/sift_matcher.h"
#include "visual_localization/localization/score.h"
#include "visual_localization/map/training_map.h"

namespace visual_localization {

/// The current image as the trackers see it: something that can be compared with every training image, by either
/// kind of features. A live one extracts its features when they are first asked for; a recorded one looks the
/// scores up.
class ComparableImage {
 public:
  virtual ~ComparableImage() = default;
  virtual Score compare(FeatureKind kind, std::size_t training_image) = 0;
  /// Number of SIFT features that it is compared by; extracts them if that has not been done.
  virtual std::size_t siftFeatures() = 0;
};

/// Share of SIFT features that match (Kronfeld et al. (journal), section 4; one-way: Weiss et al., section III).
/// Stateless, so that one may serve several threads.
class SiftSimilarity {
 public:
  SiftSimilarity(const MatchConfig& match, const SimilarityConfig& config);
  /// 0 when either image has fewer than two features.
  Score compare(const SiftFeatures& current, const SiftFeatures& training) const;
  /// What a similarity that is known already means.
  Score scoreOf(double similarity, std::size_t matches, double scale) const;

 private:
  double max_angle_ratio_;
  bool symmetric_;
  double recognised_;
};

/// Product of the normalised intersections of the WGOH and of the WGII histograms (Weiss et al., section II.C).
/// Stateless, so that one may serve several threads.
class GlobalSimilarity {
 public:
  explicit GlobalSimilarity(const SimilarityConfig& config) : config_(config) {}
  Score compare(const GlobalFeatures& current, const GlobalFeatures& training) const;
  /// What a similarity that is known already means.
  Score scoreOf(double similarity) const;

 private:
  SimilarityConfig config_;
};

/// Similarities of the current image to the training images, computed when first asked for and then shared by
/// all particles. Counts the comparisons, the papers' measure of cost.
class ScoreCache {
 public:
  using Compare = std::function<Score(std::size_t training_image)>;

  explicit ScoreCache(std::size_t training_images) : entry_of_(training_images) {}

  /// Forgets everything and takes scores from `compare` from now on.
  void startImage(Compare compare);
  /// The score of one training image; throws std::out_of_range for an index beyond the map.
  Score operator[](std::size_t training_image);
  /// Distinct training images compared since startImage.
  std::size_t comparisons() const { return entries_.size(); }

 private:
  struct Entry {
    std::size_t training_image;
    Score score;
  };

  // A sparse set (Briggs and Torczon, 1993): nothing of the size of the map is touched for a new image.
  std::vector<Entry> entries_;           ///< of the current image, in the order of comparison
  std::vector<std::uint32_t> entry_of_;  ///< of each training image; holds if the entry is there and says so too
  Compare compare_;
};

/// The image that a front end holds, compared with a map. All parts must outlive it.
class LiveImage final : public ComparableImage {
 public:
  LiveImage(FrontEnd& front_end, const TrainingMap& map, const SiftSimilarity& sift, const GlobalSimilarity& global)
      : front_end_(front_end), map_(map), sift_(sift), global_(global) {}

  Score compare(FeatureKind kind, std::size_t training_image) override;
  std::size_t siftFeatures() override { return front_end_.sift().size(); }
  /// Time spent on comparisons, without the extraction that they brought about.
  double match_ms() const { return match_ms_; }

 private:
  FrontEnd& front_end_;
  const TrainingMap& map_;
  const SiftSimilarity& sift_;
  const GlobalSimilarity& global_;
  double match_ms_ = 0.0;
};

}  // namespace visual_localization
