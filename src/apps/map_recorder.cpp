#include "node/map_recorder.h"

#include <exception>
#include <iostream>
#include <string>
#include <vector>

#include <ros/init.h>
#include <ros/spinner.h>

#include "base/process.h"
#include "base/text.h"
#include "features/vector_target.h"

namespace {

using visual_localization::ChildProcess;
using visual_localization::MapRecorder;
using visual_localization::programOfPackage;
using visual_localization::RecordedSession;

constexpr int kFailed = 1;
constexpr int kBadUsage = 2;
constexpr int kNiceness = 10;  ///< of what writes a map, while the robot drives

const char* const kHelp =
    "Usage: map_recorder _folder:=FOLDER [image:=TOPIC] [fix:=TOPIC] [odom:=TOPIC] [_map:=FILE] [_PARAMETER:=VALUE "
    "...]\n"
    "Records a session while somebody drives the robot, shows what will be weak in its map, and writes\n"
    "the map on a call of ~write_map. Needs a roscore.\n\n"
    "  --help     this text\n"
    "  --version  the version\n\n"
    "Topics, services and parameters: doc/recording.md.\n";

int answer(const std::string& argument, const std::string& version) {
  if (argument == "--help" || argument == "-h") {
    std::cout << kHelp;
  } else if (argument == "--version") {
    std::cout << version << "\n";
  } else {
    std::cerr << "map_recorder: unknown argument '" << argument << "'; see --help\n";
    return kBadUsage;
  }
  return 0;
}

void buildMap(const RecordedSession& session) {
  std::vector<std::string> arguments{"--bag",       session.bag,       "--image-topic", session.image_topic,
                                     "--fix-topic", session.fix_topic, "--output",      session.output};
  if (!session.config.empty()) arguments.insert(arguments.end(), {"--config", session.config});
  if (session.map.empty()) {
    std::cerr << ChildProcess(kNiceness).run(programOfPackage("map_builder"), arguments);  // warnings
    return;
  }
  arguments.insert(arguments.begin(), {"add", "--map", session.map});
  std::cerr << ChildProcess(kNiceness).run(programOfPackage("map_edit"), arguments);
}

}  // namespace

int main(int argc, char** argv) {
  std::vector<std::string> arguments;
  ros::removeROSArgs(argc, argv, arguments);
  try {
    const std::string version =
        "map_recorder " VISUAL_LOCALIZATION_VERSION " (" + visual_localization::vectorTarget() + ")";
    if (arguments.size() > 1) return answer(arguments[1], version);
    ros::init(argc, argv, "map_recorder");
    MapRecorder recorder(ros::NodeHandle(), ros::NodeHandle("~"), buildMap);
    ros::spin();
  } catch (const std::exception& error) {
    std::cerr << "map_recorder: " << visual_localization::oneLine(error.what(), 10000) << std::endl;
    return kFailed;
  }
  return 0;
}
