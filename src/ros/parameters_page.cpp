#include "visual_localization/ros/parameters_page.h"

#include "visual_localization/map/map_builder.h"
#include "visual_localization/parameters/parameters.h"
#include "visual_localization/ros/node_config.h"

namespace visual_localization {
namespace {

const char* const kIntroduction =
    "# Parameters\n\n"
    "Made from the code by `localizer_node --parameters`; a test keeps this page and the code the same.\n\n"
    "## Localizer\n"
    "In the node's private namespace, in `config/localizer.yaml` and behind `localize --config`. What says yes under\n"
    "*while running* can be changed with `rosrun dynamic_reconfigure dynparam` or rqt_reconfigure between two images; "
    "the\n"
    "track goes on. The rest is read when the node starts. A unit of 1 is a pure number.\n\n";

const char* const kMapBuilder =
    "\n## Map builder\n"
    "In `config/map_builder.yaml`, behind `map_builder --config`. The map keeps what live images must be treated "
    "with.\n\n";

template <class Config>
std::string tableOf(bool with_run_time) {
  Config defaults;
  return parameters::markdownTable([&defaults](ParameterVisitor& visitor) { defaults.declare(visitor); },
                                   with_run_time);
}

}  // namespace

std::string parametersPage() {
  return kIntroduction + tableOf<NodeParameters>(true) + kMapBuilder + tableOf<MapBuilderConfig>(false);
}

}  // namespace visual_localization
