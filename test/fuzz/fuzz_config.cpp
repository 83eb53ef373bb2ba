/// Parameter files and experiments: YAML that somebody wrote.
#include <cstdint>
#include <string>
#include <vector>

#include "evaluation/experiment.h"
#include "parameters/yaml_map.h"
#include "test/fuzz/fuzz_support.h"
#include "visual_localization/localization/localizer_config.h"
#include "visual_localization/map/map_builder.h"
#include "visual_localization/parameters/parameters.h"

namespace visual_localization {
namespace {

template <class Config>
ParameterValues valuesOf(Config& config) {
  return parameters::values([&config](ParameterVisitor& visitor) { config.declare(visitor); });
}

/// What is accepted is valid, and its values are accepted again.
template <class Config>
void assign(const ParameterValues& values) {
  fuzz::expect<ParameterError>([&] {
    Config config;
    assignParameters(config, values);
    const std::vector<std::string> violations = violationsOf(config);
    if (!violations.empty()) fuzz::fail(violations.front());
    fuzz::mustNotThrow([&] {
      Config again;
      assignParameters(again, valuesOf(config));
      if (valuesOf(again) != valuesOf(config)) fuzz::fail("parameters that do not read back");
    });
    fuzz::countRead();
  });
}

void readParameters(const std::string& text) {
  ParameterValues values;
  if (!fuzz::expect<ParameterError>(
          [&] { values = parameters::YamlMap::parse(text, "parameters.yaml").parameters(); })) {
    return;
  }
  assign<MapBuilderConfig>(values);
  assign<LocalizerConfig>(values);
}

}  // namespace
}  // namespace visual_localization

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace visual_localization;
  const std::string text(reinterpret_cast<const char*>(data), size);
  fuzz::expect<ParameterError>([&] {
    parseExperiment(text, "experiment.yaml");
    fuzz::countRead();
  });
  readParameters(text);
  return 0;
}
