#include "visual_localization/evaluation/precision_recall.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <stdexcept>
#include <string>

namespace visual_localization {

double recallAtPrecision(std::vector<Decision> decisions, double precision) {
  if (!(precision >= 0.0 && precision <= 1.0)) {
    throw std::invalid_argument("precision " + std::to_string(precision) + " is not in [0, 1]");
  }
  const auto unsure = [](const Decision& decision) { return std::isnan(decision.confidence); };
  if (std::any_of(decisions.begin(), decisions.end(), unsure)) throw std::invalid_argument("a confidence is NaN");
  std::sort(decisions.begin(), decisions.end(),
            [](const Decision& a, const Decision& b) { return a.confidence > b.confidence; });
  const std::size_t all = decisions.size();
  std::size_t correct = 0;
  std::size_t recalled = 0;
  for (std::size_t accepted = 1; accepted <= all; ++accepted) {
    correct += decisions[accepted - 1].correct ? 1 : 0;
    const bool tied = accepted < all && decisions[accepted].confidence == decisions[accepted - 1].confidence;
    if (!tied && static_cast<double>(correct) / static_cast<double>(accepted) >= precision) recalled = correct;
  }
  return all == 0 ? 0.0 : static_cast<double>(recalled) / static_cast<double>(all);
}

}  // namespace visual_localization
