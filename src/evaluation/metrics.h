#pragma once

#include <cstddef>
#include <vector>

namespace visual_localization {

/// Summary of localisation errors: distances between estimated and true positions, metres.
struct ErrorStatistics {
  std::size_t count = 0;
  double mean_m = 0.0;
  double median_m = 0.0;
  double within_5m = 0.0;  ///< share of errors below 5 m
};

/// All fields zero when there is no error to summarise.
ErrorStatistics summarise(std::vector<double> errors_m);

/// One answer of a place recogniser and whether it was right.
struct Decision {
  double confidence = 0.0;
  bool correct = false;
};

/// The largest share of all decisions, in [0, 1], that are accepted and correct when only those above some threshold of
/// confidence are accepted and at least the share `precision` of these is correct. Equal confidences are accepted
/// together. 0 when no threshold is good enough. Throws std::invalid_argument for a `precision` outside [0, 1] and for
/// a confidence that is NaN.
double recallAtPrecision(std::vector<Decision> decisions, double precision);

}  // namespace visual_localization
