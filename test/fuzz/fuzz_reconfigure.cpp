/// Requests of dynamic_reconfigure, as anyone on the network may send them.
#include <cstdint>

#include <dynamic_reconfigure/Config.h>

#include "node/node_config.h"
#include "node/reconfigure_server.h"
#include "test/fuzz/fuzz_support.h"

namespace visual_localization {
namespace {

dynamic_reconfigure::Config configOf(fuzz::Input input, const dynamic_reconfigure::Config& present) {
  dynamic_reconfigure::Config config;
  const auto change = [&input](const auto& all, auto& changed, auto value) {
    if (all.empty()) return;
    changed.push_back(all[input.number<std::uint8_t>() % all.size()]);
    if (input.number<std::uint8_t>() >= 250) changed.back().name = input.text();
    changed.back().value = value();
  };
  while (!input.isEmpty()) {
    switch (input.number<std::uint8_t>() % 4) {
      case 0:
        change(present.bools, config.bools,
               [&] { return static_cast<std::uint8_t>(input.number<std::uint8_t>() % 2); });
        break;
      case 1:
        change(present.ints, config.ints, [&] { return input.number<std::int32_t>(); });
        break;
      case 2:
        change(present.strs, config.strs, [&] { return input.text(); });
        break;
      default:
        change(present.doubles, config.doubles, [&] { return input.number<double>(); });
    }
  }
  return config;
}

void reconfigure(const fuzz::Input& input) {
  NodeParameters parameters;
  const parameters::Declaration declare = [&parameters](ParameterVisitor& visitor) { parameters.declare(visitor); };
  static const dynamic_reconfigure::Config present = toConfig(declare);
  const dynamic_reconfigure::Config config = configOf(input, present);
  fuzz::expect<ParameterError>([&] {
    const ParameterValues values = toValues(config, declare);
    assignParameters(parameters, values);
    if (!values.empty()) fuzz::countRead();
  });
  if (!violationsOf(parameters).empty()) fuzz::fail("parameters that are not allowed are in force");
}

}  // namespace
}  // namespace visual_localization

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace visual_localization;
  reconfigure(fuzz::Input(data, size));
  return 0;
}
