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

}  // namespace visual_localization
