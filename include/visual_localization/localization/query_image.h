#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>

#include <opencv2/core.hpp>

#include "visual_localization/features/front_end.h"
#include "visual_localization/features/local_features.h"
#include "visual_localization/features/vlad.h"
#include "visual_localization/localization/similarity.h"
#include "visual_localization/map/training_map.h"

namespace visual_localization {

/// What is known of an image beside its scores.
struct ImageReport {
  ImageStatistics statistics;
  std::string local_features = "SIFT";  ///< their kind
  std::size_t features_extracted = 0;   ///< local features before pruning; 0 when there was no need for them
  std::size_t features_kept = 0;        ///< after pruning
  double extract_ms = 0.0;              ///< wall-clock time of feature extraction and pruning
  double match_ms = 0.0;                ///< wall-clock time of comparisons with training images
};

/// The current image: something that can be compared with every training image, by either kind of features. A live
/// one extracts its features when they are first asked for; a recorded one looks its scores up.
class QueryImage {
 public:
  virtual ~QueryImage() = default;
  /// The next image. Throws std::invalid_argument for one that cannot be used, and then nothing has changed.
  virtual void set(std::int64_t stamp_ns, const cv::Mat& grey) = 0;
  /// Whether it repeats the one before to the last bit.
  virtual bool isRepeated() const = 0;
  /// Not cached: see Scores.
  virtual Score compare(FeatureKind kind, std::size_t training_image) = 0;
  /// Number of local features that it is compared by; extracts them if that has not been done.
  virtual std::size_t localFeatures() = 0;
  virtual ImageReport report() const = 0;
  /// Its local features after pruning, if there was a need for them; null otherwise.
  virtual const LocalFeatures* local() const = 0;
  /// All its local features, not pruned, extracted if that has not been done; null when it is known by its scores
  /// alone.
  virtual const LocalFeatures* unprunedLocal() { return nullptr; }
  /// Holds from the next image on.
  virtual void configure(const FrontEndConfig& front_end, const SimilarityConfig& similarity) = 0;
};

/// An image of the camera. `map` must outlive it.
class LiveImage final : public QueryImage {
 public:
  LiveImage(const TrainingMap& map, const FrontEndConfig& front_end, const SimilarityConfig& similarity);

  /// See FrontEnd::setImage.
  void set(std::int64_t stamp_ns, const cv::Mat& grey) override;
  bool isRepeated() const override { return front_end_.isRepeated(); }
  Score compare(FeatureKind kind, std::size_t training_image) override;
  std::size_t localFeatures() override { return front_end_.local().size(); }
  ImageReport report() const override;
  const LocalFeatures* local() const override { return front_end_.localIfExtracted(); }
  const LocalFeatures* unprunedLocal() override { return &front_end_.unprunedLocal(); }
  void configure(const FrontEndConfig& front_end, const SimilarityConfig& similarity) override;

 private:
  const TrainingMap& map_;
  std::string name_;  ///< of its local features
  FrontEnd front_end_;
  LocalSimilarity local_similarity_;
  GlobalSimilarity global_similarity_;
  std::optional<VladDescriptor> vlad_;  ///< of the image, once it was asked for
  double match_ms_ = 0.0;               ///< without the extraction that comparisons bring about
};

}  // namespace visual_localization
