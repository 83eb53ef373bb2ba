#pragma once

#include <cstddef>
#include <vector>

#include "evaluation/place_recogniser.h"

namespace visual_localization {

/// A discrete Bayes filter whose states are the training images, in the manner of the topological filter of Xu,
/// Suenderhauf and Milford ("Probabilistic Visual Place Recognition for Hierarchical Localization", RA-L 2021).
///
/// Moves between images are uniform in [min_step, max_step]; the likelihood is exp(-lambda d) with d = 1 - similarity.
/// As there, the first image calibrates lambda = ln(delta) / (q_97.5 - q_2.5), quantiles of its differences d. Ours
/// are the reset, so that kidnapping is survived; calibration by the first image that tells places apart, with the
/// whole range of d where the quantiles coincide; and the answer: the most probable state of the window with the most
/// posterior mass. The confidence is the mass of the window around that state. An image that is alike to all training
/// images, as a dark one is, leaves the prediction as it is.
class TopologicalBayesFilter final : public PlaceRecogniser {
 public:
  /// `config` must be without violations. `closed`: the first training image follows the last.
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
