#pragma once

#include <memory>
#include <string>
#include <vector>

#include "evaluation/place_recogniser.h"
#include "evaluation/sequence_matcher.h"
#include "evaluation/topological_bayes_filter.h"

namespace visual_localization {

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
