#pragma once

#include <algorithm>
#include <cstddef>
#include <deque>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "visual_localization/parameters/parameters.h"

namespace visual_localization {

/// Training images along the drive; on a closed route the first follows the last.
class Route {
 public:
  Route(std::size_t images, bool closed) : images_(images), closed_(closed) {}

  std::size_t size() const { return images_; }
  /// Before it when `steps` is negative; nothing beyond the ends of an open route.
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
  /// `similarities` of the current image to every training image, in the map's order, in [0, 1].
  virtual Recognition update(const std::vector<double>& similarities) = 0;
};

/// Throws std::invalid_argument, naming the value, when a row of similarities is empty, is not as long as the first one
/// (`training_images`; 0 when there was none), or holds a number outside [0, 1].
void requireRow(const std::vector<double>& similarities, std::size_t training_images);

/// The most similar training image, the first of equals. Its similarity is the confidence.
class BestSingleImage final : public PlaceRecogniser {
 public:
  Recognition update(const std::vector<double>& similarities) override;

 private:
  std::size_t training_images_ = 0;
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

/// `closed`: the first training image follows the last. Throws std::invalid_argument for an unknown name or an invalid
/// configuration.
std::unique_ptr<PlaceRecogniser> makePlaceRecogniser(const std::string& name, const PlaceRecogniserConfig& config,
                                                     bool closed);

/// SeqSLAM (Milford and Wyeth, ICRA 2012), online: the answer is where the best straight line through the last images
/// ends. Beyond the paper: what leaves an open route, and an image that says nothing, counts as average difference;
/// chance similarities among zeros are kept from looking like perfect contrast (min_contrast). The confidence is 1 -
/// best / rival in [0, 1], by the mean differences of the best line and of the best one that ends elsewhere; 0 when the
/// map is too small for a rival.
class SequenceMatcher final : public PlaceRecogniser {
 public:
  /// `config` must be valid.
  SequenceMatcher(const SequenceConfig& config, bool closed);

  Recognition update(const std::vector<double>& similarities) override;

 private:
  void remember(const std::vector<double>& similarities);
  void addLines(const std::vector<std::ptrdiff_t>& line, std::vector<double>& sums) const;
  void scoreLines();
  double confidence(std::size_t best) const;

  SequenceConfig config_;
  bool closed_;
  std::vector<std::vector<std::ptrdiff_t>> lines_;  ///< per speed: training images back from the end, newest first
  Route route_;                                     ///< empty until the first image tells how long it is
  std::deque<std::vector<double>> columns_;         ///< locally normalised differences of the last images
  std::vector<double> sums_;                        ///< along the lines of one speed ending at each training image
  std::vector<double> scores_;                      ///< of the best line ending at each training image
};

/// Discrete Bayes filter over the training images, after Xu, Suenderhauf and Milford (RA-L 2021). Moves between images
/// are uniform in [min_step, max_step]; the likelihood is exp(-lambda d) with d = 1 - similarity, and the first image
/// that tells places apart calibrates lambda = ln(delta) / (q_97.5 - q_2.5). Beyond the paper: the reset, so that
/// kidnapping is survived, and the answer: the most probable state of the window with the most posterior mass, which is
/// the confidence. An image that is alike to all training images leaves the prediction as it is.
class TopologicalBayesFilter final : public PlaceRecogniser {
 public:
  TopologicalBayesFilter(const TopologicalBayesConfig& config, bool closed);

  Recognition update(const std::vector<double>& similarities) override;

 private:
  void predict();
  void calibrate(const std::vector<double>& similarities);
  void weigh(const std::vector<double>& similarities);
  double massAround(std::size_t image) const;
  Recognition mostProbablePlace() const;

  TopologicalBayesConfig config_;
  bool closed_;
  Route route_;                    ///< empty until the first image tells how long it is
  double lambda_ = 0.0;            ///< 0 until calibrated
  std::vector<double> posterior_;  ///< sums to one; empty before the first image
  std::vector<double> buffer_;     ///< scratch; kept to save the allocation
};

}  // namespace visual_localization
