#include "evaluation/place_recogniser.h"

#include <algorithm>
#include <stdexcept>
#include <string>

#include "base/text.h"
#include "evaluation/sequence_matcher.h"
#include "evaluation/topological_bayes_filter.h"
#include "visual_localization/parameters/parameters.h"

namespace visual_localization {

std::optional<std::size_t> Route::at(std::size_t from, std::ptrdiff_t steps) const {
  const auto images = static_cast<std::ptrdiff_t>(images_);
  const std::ptrdiff_t to = static_cast<std::ptrdiff_t>(from) + steps;
  if (to >= 0 && to < images) return static_cast<std::size_t>(to);
  if (!closed_) return std::nullopt;
  return static_cast<std::size_t>((to % images + images) % images);
}

std::size_t Route::distance(std::size_t a, std::size_t b) const {
  const std::size_t direct = a > b ? a - b : b - a;
  return closed_ ? std::min(direct, images_ - direct) : direct;
}

void requireRow(const std::vector<double>& similarities, std::size_t training_images) {
  constexpr double kMax = 1.0 + 1e-9;  // histograms that sum to one do so but for rounding
  if (similarities.empty()) throw std::invalid_argument("similarities to no training image at all");
  if (training_images != 0 && similarities.size() != training_images) {
    throw std::invalid_argument("similarities to " + std::to_string(similarities.size()) +
                                " training images after similarities to " + std::to_string(training_images));
  }
  for (std::size_t image = 0; image < similarities.size(); ++image) {
    if (similarities[image] >= 0.0 && similarities[image] <= kMax) continue;
    throw std::invalid_argument("similarity " + std::to_string(similarities[image]) + " to training image " +
                                std::to_string(image) + " is not in [0, 1]");
  }
}

Recognition BestSingleImage::update(const std::vector<double>& similarities) {
  requireRow(similarities, training_images_);
  training_images_ = similarities.size();
  const auto best = std::max_element(similarities.begin(), similarities.end());
  return {static_cast<std::size_t>(best - similarities.begin()), *best};
}

void PlaceRecogniserConfig::declare(ParameterVisitor& visitor) {
  sequence.declare(visitor);
  bayes.declare(visitor);
}

const std::vector<std::string>& placeRecogniserNames() {
  static const std::vector<std::string> kNames = {"exhaustive", "sequence", "topological"};
  return kNames;
}

std::unique_ptr<PlaceRecogniser> makePlaceRecogniser(const std::string& name, const PlaceRecogniserConfig& config,
                                                     bool closed) {
  const std::vector<std::string> wrong = violationsOf(config);
  if (!wrong.empty()) throw std::invalid_argument(wrong.front());
  if (name == "exhaustive") return std::make_unique<BestSingleImage>();
  if (name == "sequence") return std::make_unique<SequenceMatcher>(config.sequence, closed);
  if (name == "topological") return std::make_unique<TopologicalBayesFilter>(config.bayes, closed);
  throw std::invalid_argument("place recogniser '" + name + "' is unknown; known are " +
                              joined(placeRecogniserNames()));
}

}  // namespace visual_localization
