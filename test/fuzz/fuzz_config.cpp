/// Parameter files and experiments: YAML that somebody wrote.
#include <cstdint>
#include <stdexcept>
#include <string>

#include "evaluation/experiment.h"
#include "parameters/yaml_map.h"
#include "test/fuzz/fuzz_support.h"
#include "visual_localization/localization/localizer_config.h"
#include "visual_localization/map/map_builder.h"
#include "visual_localization/parameters/parameters.h"

namespace visual_localization {
namespace {

void readParameters(const std::string& text) {
  try {
    const ParameterValues values = parameters::YamlMap::parse(text, "parameters.yaml").parameters();
    MapBuilderConfig builder;
    fuzz::expect<ParameterError>([&] { assignParameters(builder, values); });
    LocalizerConfig localizer;
    assignParameters(localizer, values);
    for (const auto& violation : violationsOf(localizer)) fuzz::requireOneLine(violation);
  } catch (const ParameterError& error) {
    fuzz::requireOneLine(error.what());
  }
}

}  // namespace
}  // namespace visual_localization

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace visual_localization;
  const std::string text(reinterpret_cast<const char*>(data), size);
  fuzz::expect<ParameterError>([&] { parseExperiment(text, "experiment.yaml"); });
  readParameters(text);
  return 0;
}
