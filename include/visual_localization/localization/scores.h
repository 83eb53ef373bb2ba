#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <vector>

#include <Eigen/Core>

#include "visual_localization/localization/similarity.h"
#include "visual_localization/map/training_map.h"

namespace visual_localization {

class Random;

/// The scores of the current image against the training images, by both kinds of features: computed when first asked
/// for, each at most once, and counted.
class Scores {
 public:
  using Compare = std::function<Score(FeatureKind kind, std::size_t training_image)>;

  explicit Scores(std::size_t training_images)
      : local_(training_images), global_(training_images), vlad_(training_images) {}

  /// Forgets everything and takes scores from `compare` from now on. `kind`: what particles are compared by.
  void startImage(FeatureKind kind, Compare compare);
  FeatureKind kind() const { return kind_; }
  /// The score that counts for a particle. Throws std::out_of_range for an index beyond the map, as global() does.
  Score operator[](std::size_t training_image);
  /// The score by global features, whatever particles are compared by.
  Score global(std::size_t training_image);
  /// The score by VLAD, of a map with a vocabulary.
  Score vlad(std::size_t training_image);

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
  /// Distinct training images compared beside these, by global features or VLAD: see MapSweep.
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
  Cache vlad_;
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
  /// `by_vlad`: what proposals are made by, where the map has a vocabulary.
  MapSweep(const TrainingMap& map, std::size_t max_images, std::size_t max_kept, bool by_vlad = false);

  /// Another number of images at most.
  void configure(std::size_t max_images, bool by_vlad);
  /// Forgets what is known of the image before.
  void startImage();
  /// Where a lost robot may be: a training image, in proportion to its score's weight; any when nothing has weight.
  std::size_t draw(Scores& scores, Random& random);
  /// The `count` training images that look most alike, the best first; by VLAD, or by global features where there is no
  /// vocabulary or particles are compared by them.
  std::vector<std::size_t> mostSimilar(Scores& scores, std::size_t count);
  /// Best global similarity within `near_m` of `position_m`, as a share of the best in the whole map, in [0, 1]. One
  /// when nothing looks alike anywhere. A swarm that has settled at the wrong position compares only what is there,
  /// and never sees that another position fits better.
  double ratio(Scores& scores, const Eigen::Vector2d& position_m, double near_m);

 private:
  void begin();
  void sweep(Scores& scores);
  std::size_t imageAt(std::size_t i) const { return first_ + stride_ * i; }

  const TrainingMap& map_;
  std::size_t max_kept_;
  bool by_vlad_ = false;
  std::size_t stride_ = 1;
  std::size_t offsets_ = 1;  ///< after this many images it begins with the same training image again
  std::size_t offset_ = 0;
  std::size_t first_ = 0;              ///< of the training images that are swept
  bool has_begun_ = false;             ///< with the current image
  std::vector<double> cumulated_;      ///< weights up to and including each swept image; empty until needed
  std::vector<Neighbour> neighbours_;  ///< of the last position
};

}  // namespace visual_localization
