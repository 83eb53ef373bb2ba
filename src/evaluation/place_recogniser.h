#pragma once

#include <algorithm>
#include <cstddef>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "visual_localization/parameters/parameter_visitor.h"

namespace visual_localization {

/// The order of the training images along the drive; on a closed route the first follows the last.
class Route {
 public:
  Route(std::size_t images, bool closed) : images_(images), closed_(closed) {}

  std::size_t size() const { return images_; }
  /// The image `steps` after `from`, or before it when negative; nothing beyond the ends of an open route.
  std::optional<std::size_t> at(std::size_t from, std::ptrdiff_t steps) const;
  /// Images between two of them, the shorter way.
  std::size_t distance(std::size_t a, std::size_t b) const;
  /// Calls `visit(image)` once for every image at most `radius` from `centre`, along the route.
  template <class Visit>
  void forEachWithin(std::size_t radius, std::size_t centre, Visit visit) const;

 private:
  std::size_t images_;
  bool closed_;
};

template <class Visit>
void Route::forEachWithin(std::size_t radius, std::size_t centre, Visit visit) const {
  const std::size_t before = std::min(radius, closed_ ? (images_ - 1) / 2 : centre);
  const std::size_t after = std::min(radius, closed_ ? images_ / 2 : images_ - 1 - centre);
  std::size_t image = centre >= before ? centre - before : centre + images_ - before;
  for (std::size_t count = 0; count <= before + after; ++count) {
    visit(image);
    image = image + 1 == images_ ? 0 : image + 1;
  }
}

/// Where a place recogniser believes to be.
struct Recognition {
  std::size_t training_image = 0;
  double confidence = 0.0;  ///< the larger the surer; comparable only between images of the same recogniser
};

/// A method beside the papers' trackers: compares every image with the whole map.
class PlaceRecogniser {
 public:
  virtual ~PlaceRecogniser() = default;
  /// One image further. `similarities`: of the current image to every training image, in the map's order, in [0, 1].
  virtual Recognition update(const std::vector<double>& similarities) = 0;
};

/// Refuses what no place recogniser can judge: throws std::invalid_argument, naming the value, when a row of
/// similarities is empty, is not as long as the first one (`training_images`; 0 when there was none), or holds a
/// number outside [0, 1], NaN included.
void requireRow(const std::vector<double>& similarities, std::size_t training_images);

/// Exhaustive search without memory: the training image most similar to the current one, the first of equals.
/// Its similarity is the confidence.
class BestSingleImage final : public PlaceRecogniser {
 public:
  Recognition update(const std::vector<double>& similarities) override;

 private:
  std::size_t training_images_ = 0;  ///< of the first row; later ones must be as long
};

/// Parameters of sequence matching; symbols of Milford and Wyeth (ICRA 2012).
struct SequenceConfig {
  int length = 10;
  int normalisation_radius = 10;
  double min_contrast = 0.05;
  double min_speed = 0.8;
  double max_speed = 1.2;
  double speed_step = 0.1;
  int uniqueness_radius = 10;

  void declare(ParameterVisitor& visitor);
};

/// Parameters of the topological filter.
struct TopologicalBayesConfig {
  int min_step = -1;
  int max_step = 3;
  double reset = 0.001;
  double delta = 5.0;
  int window = 15;

  void declare(ParameterVisitor& visitor);
};

/// Parameters of all place recognisers; the exhaustive one has none.
struct PlaceRecogniserConfig {
  SequenceConfig sequence;
  TopologicalBayesConfig bayes;

  void declare(ParameterVisitor& visitor);
};

/// What makePlaceRecogniser knows: "exhaustive", "sequence", "topological".
const std::vector<std::string>& placeRecogniserNames();

/// The place recogniser called `name`. `closed`: the first training image follows the last. Throws
/// std::invalid_argument for another name, naming those allowed, and for a configuration with violations.
std::unique_ptr<PlaceRecogniser> makePlaceRecogniser(const std::string& name, const PlaceRecogniserConfig& config,
                                                     bool closed);

}  // namespace visual_localization
