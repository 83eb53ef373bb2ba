#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "evaluation/run.h"

namespace visual_localization {

/// Summary of localisation errors: distances between estimated and true positions, metres.
struct ErrorStatistics {
  std::size_t count = 0;
  double mean_m = 0.0;
  double median_m = 0.0;
  double within_5m = 0.0;  ///< share of errors below kRight_m, 5 m
};

ErrorStatistics summarise(std::vector<double> errors_m);

/// One answer of a place recogniser and whether it was right.
struct Decision {
  double confidence = 0.0;
  bool correct = false;
};

/// The largest share of all decisions, in [0, 1], that are accepted and correct when only those above some threshold of
/// confidence are accepted and at least the share `precision` of these is correct. 0 when no threshold is good enough.
/// Throws std::invalid_argument for a `precision` outside [0, 1] and for a confidence that is NaN.
double recallAtPrecision(std::vector<Decision> decisions, double precision);

/// How far a tracker's states can be trusted: counts of judged images. "Lost" is every state but TRACKING, and truly
/// lost an estimate that is not right (kRight_m).
struct Trust {
  std::size_t tracking_right = 0;
  std::size_t tracking_wrong = 0;
  std::size_t lost_right = 0;     ///< called lost, and truly lost
  std::size_t lost_wrong = 0;     ///< called lost, but right
  std::size_t off_map_right = 0;  ///< OFF_MAP, and farther than kOffMap_m from all of the map
  std::size_t off_map_wrong = 0;
  std::size_t off_map_missed = 0;  ///< that far, and another state

  /// Images without a true position and methods without states are left out.
  void add(const StepRecord& step);
  Trust& operator+=(const Trust& other);

  // NaN when there is nothing to divide by.
  double trackingShare() const;
  double wrongTracking() const;  ///< share of the TRACKING claims that are wrong
  double lostPrecision() const;  ///< share of the images called lost that truly are
  double lostRecall() const;     ///< share of the truly lost images that are called so
  double offMapPrecision() const;
  double offMapRecall() const;
};

/// How often a method is right and how likely it says it is, by the accuracy of the true positions: counts of judged
/// images.
struct Claims {
  struct Bin {
    std::size_t images = 0;
    std::size_t wrong = 0;
    double probability = 0.0;  ///< sum
  };
  /// Where the bins of the probability begin; the last one is what TRACKING asks for by default.
  static constexpr std::array<double, 11> kBins{0.0, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 0.97};

  std::size_t images = 0;
  std::size_t right = 0;
  std::size_t tracking = 0;  ///< of a method with states
  std::size_t tracking_wrong = 0;
  std::array<Bin, kBins.size()> bins{};

  /// Images without a true position are left out.
  void add(const StepRecord& step);
  Claims& operator+=(const Claims& other);

  // NaN when there is nothing to divide by.
  double rightShare() const;
  double wrongClaims() const;  ///< share of the TRACKING claims
};

/// An error within both is a success of the long-term localisation benchmark (Sattler et al., 2018).
struct RecallThreshold {
  double position_m;
  double heading_deg;
};
constexpr std::array<RecallThreshold, 3> kRecall{{{0.25, 2.0}, {0.5, 5.0}, {5.0, 10.0}}};

/// Errors of poses against one truth: the true poses themselves, or these moved by the map's own error.
struct PoseErrors {
  std::size_t positions = 0;  ///< images whose error is known
  double position_m = 0.0;    ///< sum
  std::size_t headings = 0;   ///< images whose error of heading is known as well
  double heading_deg = 0.0;   ///< sum
  std::array<std::size_t, kRecall.size()> recalled{};
  std::size_t claims = 0;     ///< images that say how accurate they are
  std::size_t inside_95 = 0;  ///< of these, with the truth inside the 95 % ellipse
  double nees = 0.0;          ///< sum of the squared errors in units of their covariance, two degrees of freedom

  void add(const StepErrors& errors);
  PoseErrors& operator+=(const PoseErrors& other);

  double meanPosition_m() const;
  double meanHeading_deg() const;
  double recall(std::size_t threshold) const;
  double insideShare() const;
  double meanNees() const;
};

/// What the poses of a method come to over judged images.
struct PoseFigures {
  std::size_t images = 0;    ///< judged, of a method with states
  std::size_t metric = 0;    ///< solved from landmarks
  std::size_t wrong_1m = 0;  ///< TRACKING, and farther from the truth
  std::size_t wrong_5m = 0;
  PoseErrors absolute;
  PoseErrors relative;  ///< to the map
  PoseErrors filtered;  ///< see StepRecord
  PoseErrors relative_filtered;

  /// Images without a true position are left out.
  void add(const StepRecord& step);
  PoseFigures& operator+=(const PoseFigures& other);

  double metricShare() const;
  double wrong1mShare() const;
  double wrong5mShare() const;
};

/// Kalman filter for positions in the plane, with constant velocity and white acceleration: what a user would put
/// behind the localizer. Takes the errors of successive positions for independent.
class VelocityFilter {
 public:
  /// Metres, covariance of east and north. Begins anew after a pause, when time goes back, and with a position that is
  /// no continuation.
  void add(std::int64_t stamp_ns, const Eigen::Vector2d& position_m, const Eigen::Matrix2d& covariance_m2);

  Eigen::Vector2d position_m() const { return state_.head<2>(); }
  Eigen::Matrix2d covariance_m2() const { return covariance_.topLeftCorner<2, 2>(); }

 private:
  void begin(const Eigen::Vector2d& position_m, const Eigen::Matrix2d& covariance_m2);
  void predict(double elapsed_s);

  std::optional<std::int64_t> stamp_ns_;
  Eigen::Vector4d state_ = Eigen::Vector4d::Zero();  ///< position, velocity (m/s)
  Eigen::Matrix4d covariance_ = Eigen::Matrix4d::Zero();
};

/// Writes into `step` how far heading and claims of an estimate are from the truth (map frame), and what of that is not
/// the map's own error. `map_error`: none when not known.
void judgePose(const Estimate& estimate, const Eigen::Vector2d& truth_m, const std::optional<double>& true_yaw_rad,
               const std::optional<MapError>& map_error, StepRecord& step);

/// Of METRIC poses while TRACKING only.
void judgeFiltered(const Estimate& estimate, const Eigen::Vector2d& truth_m, const std::optional<MapError>& map_error,
                   VelocityFilter& filter, StepRecord& step);

/// "stamp tx ty tz qx qy qz qw", x ahead, y left, z up in the map frame. Level and at height 0 but for metric poses.
std::string tumLine(const Estimate& estimate);
/// A heading that is not known is 0.
std::string tumLine(std::int64_t stamp_ns, const Eigen::Vector2d& position_m, double yaw_rad);

}  // namespace visual_localization
