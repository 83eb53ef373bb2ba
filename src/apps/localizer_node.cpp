#include <functional>
#include <iostream>
#include <map>
#include <stdexcept>
#include <string>
#include <vector>

#include <boost/function.hpp>
#include <boost/make_shared.hpp>
#include <nodelet/loader.h>
#include <ros/init.h>
#include <ros/names.h>
#include <ros/spinner.h>
#include <ros/this_node.h>

#include "features/vector_target.h"
#include "node/localizer_nodelet.h"
#include "node/node_config.h"

namespace {

constexpr int kFailed = 1;
constexpr int kBadUsage = 2;

const char* const kHelp =
    "Usage: localizer_node [image:=TOPIC] [_map:=FILE] [_PARAMETER:=VALUE ...]\n"
    "Localises with one camera in a map of training images: the nodelet\n"
    "visual_localization/LocalizerNodelet, running alone. Needs a roscore.\n\n"
    "  --help                this text\n"
    "  --version             the version\n"
    "  --parameters          every parameter with its default, range and meaning, in Markdown\n"
    "  --localizer-config    config/localizer.yaml: every parameter of the localizer with its default\n"
    "  --map-builder-config  config/map_builder.yaml, the same for the map builder\n\n"
    "Topics, services and parameters: doc/node.md and config/localizer.yaml.\n";

/// Not for ROS, without the program's name.
std::vector<std::string> ownArguments(int argc, char** argv) {
  std::vector<std::string> arguments;
  ros::removeROSArgs(argc, argv, arguments);
  arguments.erase(arguments.begin());
  return arguments;
}

int answer(const std::string& argument) {
  const std::map<std::string, std::function<std::string()>> answers = {
      {"--help", [] { return kHelp; }},
      {"-h", [] { return kHelp; }},
      {"--version",
       [] { return "localizer_node " VISUAL_LOCALIZATION_VERSION " (" + visual_localization::vectorTarget() + ")\n"; }},
      {"--parameters", visual_localization::parametersPage},
      {"--localizer-config", visual_localization::localizerYaml},
      {"--map-builder-config", visual_localization::mapBuilderYaml},
  };
  const auto found = answers.find(argument);
  if (found == answers.end()) {
    std::cerr << "localizer_node: unknown argument '" << argument << "'; see --help\n";
    return kBadUsage;
  }
  try {
    std::cout << found->second();
  } catch (const std::invalid_argument& error) {
    std::cerr << "localizer_node: " << error.what() << "\n";
    return kBadUsage;
  }
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  const auto arguments = ownArguments(argc, argv);
  if (!arguments.empty()) return answer(arguments.front());

  ros::init(argc, argv, "localizer");
  ros::NodeHandle keep_alive;
  const boost::function<boost::shared_ptr<nodelet::Nodelet>(const std::string&)> make = [](const std::string&) {
    return boost::make_shared<visual_localization::LocalizerNodelet>();
  };
  nodelet::Loader loader(make);
  if (!loader.load(ros::this_node::getName(), "visual_localization/LocalizerNodelet", ros::names::getRemappings(),
                   {})) {
    return kFailed;
  }
  ros::spin();
  return 0;
}
