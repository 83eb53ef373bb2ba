#include "visual_localization/evaluation/place_recogniser_factory.h"

#include <stdexcept>

#include "visual_localization/evaluation/best_single_image.h"
#include "visual_localization/parameters/parameters.h"

namespace visual_localization {

void PlaceRecogniserConfig::declare(ParameterVisitor& visitor) {
  sequence.declare(visitor);
  bayes.declare(visitor);
}

std::vector<std::string> PlaceRecogniserConfig::violations() const {
  std::vector<std::string> wrong = rangeViolations(*this);
  for (const auto& violation : sequence.violations()) wrong.push_back(violation);
  for (const auto& violation : bayes.violations()) wrong.push_back(violation);
  return wrong;
}

const std::vector<std::string>& placeRecogniserNames() {
  static const std::vector<std::string> kNames = {"exhaustive", "sequence", "topological"};
  return kNames;
}

std::unique_ptr<PlaceRecogniser> makePlaceRecogniser(const std::string& name, const PlaceRecogniserConfig& config,
                                                     bool closed) {
  const std::vector<std::string> wrong = config.violations();
  if (!wrong.empty()) throw std::invalid_argument(wrong.front());
  if (name == "exhaustive") return std::make_unique<BestSingleImage>();
  if (name == "sequence") return std::make_unique<SequenceMatcher>(config.sequence, closed);
  if (name == "topological") return std::make_unique<TopologicalBayesFilter>(config.bayes, closed);
  std::string allowed;
  for (const auto& known : placeRecogniserNames()) allowed += (allowed.empty() ? "" : ", ") + known;
  throw std::invalid_argument("place recogniser '" + name + "' is unknown; known are " + allowed);
}

}  // namespace visual_localization
