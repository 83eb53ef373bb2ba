#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include <Eigen/Core>
#include <opencv2/core.hpp>

#include "visual_localization/features/feature_matcher.h"
#include "visual_localization/features/front_end.h"
#include "visual_localization/features/global_features.h"
#include "visual_localization/features/local_feature_kind.h"
#include "visual_localization/features/local_features.h"
#include "visual_localization/features/sift.h"
#include "visual_localization/map/training_map.h"
#include "visual_localization/parameters/parameters.h"

namespace visual_localization {

class Random;

/// Which features images are compared by.
enum class FeatureKind : std::uint8_t { kLocal = 0, kGlobal = 1 };

/// How alike two images are, and on how much evidence.
struct Score {
  double similarity = 0.0;  ///< m in [0, 1]
  double weight = 0.0;      ///< what counts for a particle, [0, 1]: m, sharpened for votes and global features
  std::size_t matches = 0;  ///< matched local features behind it; 0 for global features
  bool recognised = false;  ///< m is good enough to be no accident
  double scale = 1.0;       ///< median size of the matched features, share of their size in training; 1 without any
};

/// What a similarity means, for each kind of features.
struct SimilarityConfig {
  double sift_recognised = 0.05;
  double votes_recognised = 0.016;  ///< no parameter, nor is what follows
  double votes_exponent = 2.0;      ///< a share of votes is raised to this to become a weight
  double global_recognised = 0.6;
  double global_exponent = 20.0;  ///< the same of a global similarity (Weiss et al., section IV.A)

  /// The least similarity that is no accident.
  double recognised(FeatureKind features, const MatchConfig& match) const {
    if (features == FeatureKind::kGlobal) return global_recognised;
    return match.isByVotes() ? votes_recognised : sift_recognised;
  }
  void declare(ParameterVisitor& visitor);
};

/// Thresholds of the hybrid choice (Weiss et al., section IV.B).
struct HybridConfig {
  double sift_below_m = 7.0;
  double global_above_m = 5.5;
  bool sift_in_doubt = true;
  int sift_every = 10;

  void declare(ParameterVisitor& visitor);
};

/// Share of local features that match (Kronfeld et al. (journal), section 4; one-way: Weiss et al., section III).
/// Stateless, so that one may serve several threads.
class LocalSimilarity {
 public:
  /// `image_width_px`: the map's, like `kind`.
  LocalSimilarity(const MatchConfig& match, const SimilarityConfig& config, int image_width_px = 640,
                  std::shared_ptr<const LocalFeatureKind> kind = std::make_shared<Sift>());
  /// 0 when either image has fewer than two features.
  Score compare(const LocalFeatures& current, const LocalFeatures& training) const;
  /// The score of a similarity that is known already.
  Score scoreOf(double similarity, std::size_t matches, double scale) const;

 private:
  std::shared_ptr<const LocalFeatureKind> kind_;
  MatchConfig match_;
  double recognised_;
  double exponent_;
  double image_width_px_;
};

/// Product of the normalised intersections of the WGOH and of the WGII histograms (Weiss et al., section II.C).
/// Stateless, so that one may serve several threads.
class GlobalSimilarity {
 public:
  explicit GlobalSimilarity(const SimilarityConfig& config) : config_(config) {}
  Score compare(const GlobalFeatures& current, const GlobalFeatures& training) const;
  /// The score of a similarity that is known already.
  Score scoreOf(double similarity) const;

 private:
  SimilarityConfig config_;
};

/// Which features the next image is compared by: always the same ones, or by how far the cloud is spread (Weiss et
/// al., section IV.B). Works on any tracker's cloud. Of the swarm all particles count, by their fitness: the quantum
/// particles are its feelers, and a rival position that one of them finds widens the cloud. (Measured against the
/// others alone, sunny to cloudy: 2.40 m at 5.4 % SIFT against 2.46 m at 4.2 %; the same trade.)
class FeatureChoice {
 public:
  /// `features`: "global", "hybrid", or the name of a kind of local features.
  FeatureChoice(const std::string& features, const HybridConfig& config);

  /// Other features or thresholds. The next image is compared as it would have been, unless the features are others.
  void configure(const std::string& features, const HybridConfig& config);
  /// The position is unknown: the hybrid choice begins with local features.
  void reset();
  FeatureKind next() const { return next_; }
  /// After an image that was compared by next(): `spread_m` is sigma_x, sigma_y of the cloud (Eq. 2). `confirmed`: the
  /// image confirms the position. `doubtful`: the last images look more like another place than like this one, which a
  /// small cloud at the wrong place cannot see.
  void update(const Eigen::Vector2d& spread_m, bool confirmed, bool doubtful);

 private:
  bool isLocalDue(bool confirmed) const;

  bool hybrid_;
  HybridConfig config_;
  FeatureKind first_;
  FeatureKind next_;
  int since_local_ = 0;  ///< images since the last one that was compared by local features
};

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
  double match_ms_ = 0.0;  ///< without the extraction that comparisons bring about
};

/// The scores of the current image against the training images, by both kinds of features: computed when first asked
/// for, each at most once, and counted.
class Scores {
 public:
  using Compare = std::function<Score(FeatureKind kind, std::size_t training_image)>;

  explicit Scores(std::size_t training_images) : local_(training_images), global_(training_images) {}

  /// Forgets everything and takes scores from `compare` from now on. `kind`: what particles are compared by.
  void startImage(FeatureKind kind, Compare compare);
  FeatureKind kind() const { return kind_; }
  /// The score that counts for a particle. Throws std::out_of_range for an index beyond the map, as global() does.
  Score operator[](std::size_t training_image);
  /// The score by global features, whatever particles are compared by.
  Score global(std::size_t training_image);

  /// A training image and how it compares.
  struct Compared {
    std::size_t training_image = 0;
    Score score;
  };
  /// All that particles were compared with, in the order of comparison.
  std::vector<Compared> compared() const;
  /// The training images that particles were compared with, the most similar first.
  std::vector<std::size_t> mostSimilar() const;
  /// Training images that were compared otherwise, by local features.
  void count(const std::vector<std::size_t>& training_images);
  /// Distinct training images that particles were compared with, and those counted: the papers' measure of cost.
  std::size_t comparisons() const { return comparisons_ + counted_; }
  /// Distinct training images compared beside these, by global features: see MapSweep.
  std::size_t swept() const;

 private:
  /// A sparse set (Briggs and Torczon, 1993): nothing of the size of the map is touched for a new image.
  class Cache {
   public:
    struct Entry {
      std::size_t training_image = 0;
      Score score;
      bool counted = false;  ///< as a comparison
    };
    explicit Cache(std::size_t training_images) : entry_of_(training_images) {}
    void clear() { entries_.clear(); }
    std::size_t size() const { return entries_.size(); }
    const std::vector<Entry>& entries() const { return entries_; }
    Entry& at(FeatureKind kind, std::size_t training_image, const Compare& compare);

   private:
    std::vector<Entry> entries_;           ///< of the current image, in the order of comparison
    std::vector<std::uint32_t> entry_of_;  ///< of each training image; holds if the entry is there and says so too
  };

  Cache local_;
  Cache global_;
  FeatureKind kind_ = FeatureKind::kLocal;
  Compare compare_;
  std::size_t comparisons_ = 0;
  std::size_t counted_ = 0;  ///< beside those of the particles
};

/// Compares the whole map with the current image by global features, when somebody first asks. It tells a lost robot
/// where to look, and a robot that believes to know its position whether another one looks more alike. Of a map with
/// more than `max_images` every k-th training image is compared, beginning with another one for each image, so that k
/// images see all of it; or, when only `max_kept` of the global features can be kept in memory, as much of it as that.
class MapSweep {
 public:
  /// `map` must outlive it; `max_images` is positive. `max_kept`: see TrainingMap::globalsKept.
  MapSweep(const TrainingMap& map, std::size_t max_images, std::size_t max_kept);

  /// Another number of images at most.
  void configure(std::size_t max_images);
  /// Forgets what is known of the image before.
  void startImage() { cumulated_.clear(); }
  /// Where a lost robot may be: a training image, in proportion to its score's weight; any when nothing has weight.
  std::size_t draw(Scores& scores, Random& random);
  /// The `count` training images that look most alike, the best first.
  std::vector<std::size_t> mostSimilar(Scores& scores, std::size_t count);
  /// Best global similarity within `near_m` of `position_m`, as a share of the best in the whole map, in [0, 1]. One
  /// when nothing looks alike anywhere. A swarm that has settled at the wrong position compares only what is there,
  /// and never sees that another position fits better.
  double ratio(Scores& scores, const Eigen::Vector2d& position_m, double near_m);

 private:
  void sweep(Scores& scores);
  std::size_t imageAt(std::size_t i) const { return first_ + stride_ * i; }

  const TrainingMap& map_;
  std::size_t max_kept_;
  std::size_t stride_ = 1;
  std::size_t offsets_ = 1;  ///< after this many images it begins with the same training image again
  std::size_t offset_ = 0;
  std::size_t first_ = 0;              ///< of the training images that are swept
  std::vector<double> cumulated_;      ///< weights up to and including each swept image; empty until needed
  std::vector<Neighbour> neighbours_;  ///< of the last position
};

/// Where along the path of a session the current image was taken (east, north; metres): where the median ratio of the
/// sizes of matched features (Score::scale) is 1. That of a training image ahead is below 1, that of one behind above.
/// Begins at `image` and asks its neighbours on that side, a few at most. Without a change of sides there, the position
/// of the image whose ratio is nearest to 1. `scores` must be by local features.
Eigen::Vector2d interpolateOnPath(const TrainingMap& map, Scores& scores, std::size_t image);

}  // namespace visual_localization
