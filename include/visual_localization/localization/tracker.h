#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include <Eigen/Core>

#include "visual_localization/localization/likelihood.h"
#include "visual_localization/localization/motion.h"
#include "visual_localization/localization/particles.h"
#include "visual_localization/localization/similarity.h"
#include "visual_localization/localization/tracker_config.h"
#include "visual_localization/map/training_map.h"

namespace visual_localization {

/// What a tracker tells of itself, for people to see: a few numbers, each by its name.
class TrackerReport {
 public:
  /// Another value of `key`, which must live for ever. Throws std::length_error for more than kMost of them.
  void set(const char* key, double value);
  /// 0 where the tracker does not tell it.
  double value(std::string_view key) const;

 private:
  static constexpr std::size_t kMost = 12;  // an image takes no memory from the heap
  struct Entry {
    const char* key = nullptr;
    double value = 0.0;
  };
  std::array<Entry, kMost> entries_{};
  std::size_t size_ = 0;
};

/// What a tracker believes after an image.
struct TrackerEstimate {
  Eigen::Vector2d position_m = Eigen::Vector2d::Zero();           ///< east, north in the map frame
  Eigen::Matrix2d mode_covariance_m2 = Eigen::Matrix2d::Zero();   ///< of the mode of the cloud around `position_m`
  Eigen::Matrix2d cloud_covariance_m2 = Eigen::Matrix2d::Zero();  ///< of the whole cloud, unweighted, about it
  Eigen::Vector2d spread_m = Eigen::Vector2d::Zero();             ///< sigma_x, sigma_y (Weiss et al., Eq. 2)
  std::size_t training_image = 0;                                 ///< nearest to `position_m`
  Score best;                                                     ///< best score among the training images compared
  std::size_t best_image = 0;                                     ///< the training image of `best`
  double best_distance_m = 0.0;                                   ///< from `position_m` to `best_image`
  bool recovering = false;                                        ///< the position is taken to be lost
  TrackerReport report;
};

class PlaceFilter;

/// Follows the position from image to image. A new kind of tracker is a class of its own and one line in tracker.cpp,
/// or a call of registerTracker().
class Tracker {
 public:
  virtual ~Tracker() = default;
  /// Forgets the past; the robot is where `prior` says.
  virtual void reset(const Prior& prior) = 0;
  /// The next image, and what is known of the motion up to it; the first one after a reset comes without any.
  virtual void predict(const Motion& motion) = 0;
  /// What is known of where that image was taken. Several likelihoods of one image may follow each other.
  virtual void update(Likelihood& likelihood) = 0;
  /// After the last update.
  virtual const TrackerEstimate& belief() const = 0;
  /// Goes on with other parameters from the next image on. False if it cannot: then nothing has changed, and a new one
  /// must take its place.
  virtual bool configure(const TrackerConfig& config) = 0;
  /// Where it believes the robot to be, as samples: for people to see, and for its successor to begin with.
  virtual const std::vector<Particle>& particles() const = 0;
  /// How likely each training image is, where it keeps a posterior over them; null otherwise.
  virtual const PlaceFilter* posterior() const { return nullptr; }
};

/// Makes a tracker that may be anywhere in the map, which must outlive it.
using MakeTracker =
    std::function<std::unique_ptr<Tracker>(const TrainingMap& map, const TrackerConfig& config, std::uint32_t seed)>;

/// A kind of tracker.
struct TrackerKind {
  std::string name;       ///< the value of the parameter `tracker`
  std::string particles;  ///< the parameter that says how many particles it has; empty: none
  MakeTracker make;
  std::vector<std::string> parameters = {};  ///< how the names of those begin that it alone uses
};

/// Beside those of this library; before any localizer is made. Throws std::invalid_argument for a name that is taken.
void registerTracker(const TrackerKind& kind);
/// Throws ParameterError for a name that nobody registered.
const TrackerKind& trackerKind(const std::string& name);
std::vector<std::string> trackerNames();
/// Whether a parameter is one of other trackers only.
bool isOfOtherTrackers(const std::string& parameter, const std::string& tracker);

/// The chosen tracker. `map` must outlive it.
std::unique_ptr<Tracker> makeTracker(const TrainingMap& map, const TrackerConfig& config, std::uint32_t seed);

}  // namespace visual_localization
