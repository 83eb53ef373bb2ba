#include "node/localizer_nodelet.h"

#include <algorithm>
#include <cstdint>
#include <exception>
#include <filesystem>
#include <thread>
#include <utility>

#include <nodelet/exception.h>
#include <pluginlib/class_list_macros.hpp>

#include "base/process.h"
#include "base/text.h"
#include "features/vector_target.h"
#include "node/message_conversions.h"
#include "node/node_config.h"
#include "node/stamps.h"
#include "ros/message_readers.h"
#include "visual_localization/map/map_file.h"
#include "visual_localization/parameters/parameters.h"

namespace visual_localization {
namespace {

constexpr std::uint32_t kOdometryQueue = 200;  ///< two seconds at 100 Hz
constexpr std::size_t kLongestLine = 10'000;   ///< of the log: a refusal may list all parameters
constexpr double kTimerPeriod_s = 1.0;         ///< of diagnostics, and of the status while there is no map

/// On half of the cores: the other half is for the images.
void extendMap(const SessionExtension& extension, ChildProcess& map_edit) {
  const unsigned threads = std::max(1U, std::thread::hardware_concurrency() / 2);
  std::vector<std::string> arguments{"add",
                                     "--map",
                                     extension.map,
                                     "--bag",
                                     extension.bag,
                                     "--image-topic",
                                     extension.image_topic,
                                     "--fix-topic",
                                     extension.fix_topic,
                                     "--usage",
                                     extension.usage,
                                     "--output",
                                     extension.output};
  if (!extension.mask.empty()) arguments.insert(arguments.end(), {"--mask", extension.mask});
  arguments.insert(arguments.end(), {"--threads", std::to_string(threads)});
  const std::string warnings = map_edit.run(programOfPackage("map_edit"), arguments);
  if (!warnings.empty()) ROS_WARN_STREAM("map_edit: " << oneLine(warnings));
}

}  // namespace

LocalizerNodelet::LocalizerNodelet()
    : log_([this](ThrottledLog::Severity severity, const std::string& text) {
        if (severity == ThrottledLog::Severity::kError) {
          NODELET_ERROR_STREAM(text);
        } else {
          NODELET_WARN_STREAM(text);
        }
      }) {}

LocalizerNodelet::~LocalizerNodelet() { stop(); }

void LocalizerNodelet::onInit() {
  try {
    start();
  } catch (const std::exception& error) {
    // The loader frees the callback queues of a nodelet that does not start before the nodelet itself.
    stop();
    NODELET_FATAL_STREAM(getName() << " does not start: " << oneLine(error.what(), kLongestLine));
    throw nodelet::Exception(error.what());
  }
}

void LocalizerNodelet::stop() {
  // No more input; then the worker finishes its image; then the outputs go.
  timer_.stop();
  service_spinner_.reset();
  services_.clear();
  reconfigure_.reset();
  initial_pose_.shutdown();
  odometry_.shutdown();
  if (images_) images_->shutdown();
  worker_.reset();
  camera_.reset();
  images_.reset();
  usage_.reset();
  sessions_.reset();
  publisher_.reset();
  diagnostics_.reset();
}

void LocalizerNodelet::start() {
  ros::NodeHandle& node = getNodeHandle();
  ros::NodeHandle& private_node = getPrivateNodeHandle();
  NODELET_INFO_STREAM(getName() << " compares features by " << vectorTarget());
  parameters_ = loadParameters(private_node);
  localizer_ = std::make_unique<SharedLocalizer>(parameters_.localizer);
  diagnostics_ = std::make_unique<LocalizerDiagnostics>(
      node, private_node, getName(), parameters_.node, [this] { return images_->description(); },
      [this] { return worker_->counts(); });
  publisher_ = std::make_unique<LocalizerPublisher>(node, private_node, parameters_, *diagnostics_, log_);
  sessions_ = std::make_unique<SessionRecorder>(parameters_.node.session_folder, extendMap, log_);
  std::vector<ImageOutput*> outputs{publisher_.get(), sessions_.get()};
  if (!parameters_.node.usage_file.empty()) {
    usage_ = std::make_unique<UsageRecorder>(parameters_.node.usage_file, log_);
    outputs.push_back(usage_.get());
  }
  worker_ = std::make_unique<ImageWorker>(*localizer_, std::move(outputs), log_);
  camera_ = std::make_unique<CameraWatch>(node, parameters_.node, node.resolveName("image"), *localizer_, *diagnostics_,
                                          [this](bool warning, const std::string& text) {
                                            if (warning) {
                                              NODELET_WARN_STREAM(oneLine(text, kLongestLine));
                                            } else {
                                              NODELET_INFO_STREAM(oneLine(text, kLongestLine));
                                            }
                                          });
  images_ =
      std::make_unique<ImageSource>(node, private_node, parameters_.node.image_transport, [this](ReceivedImage image) {
        guarded(log_, "image", [&] {
          diagnostics_->imageArrived();
          camera_->imageFrameIs(image.header.frame_id);
          worker_->push(std::move(image));
        });
      });
  useFirstMap();
  initial_pose_ = node.subscribe("initialpose", 1, &LocalizerNodelet::onInitialPose, this);
  if (parameters_.node.use_odometry) {
    odometry_ = node.subscribe("odom", kOdometryQueue, &LocalizerNodelet::onOdometry, this);
    NODELET_INFO_STREAM(getName() << " uses odometry of " << odometry_.getTopic());
  }
  offerServices();
  timer_ = node.createWallTimer(ros::WallDuration(kTimerPeriod_s), &LocalizerNodelet::onTimer, this);
  worker_->start(images_->topic());
  NODELET_INFO_STREAM(getName() << " listens to " << images_->topic());
}

void LocalizerNodelet::useFirstMap() {
  if (parameters_.node.map.empty()) return;
  try {
    useMap(parameters_.node.map);
  } catch (const std::exception& error) {
    throw ParameterError("parameter 'map' is not allowed: must be a map file: " + std::string(error.what()));
  }
}

void LocalizerNodelet::offerServices() {
  // Loading a map must not hold up the images. Not the multi-threaded queue of the nodelet: the loader may free it
  // while a callback of the other queue still holds the nodelet.
  ros::NodeHandle node = getNodeHandle();
  ros::NodeHandle private_node = getPrivateNodeHandle();
  node.setCallbackQueue(&service_queue_);
  private_node.setCallbackQueue(&service_queue_);
  services_.push_back(private_node.advertiseService("relocalize", &LocalizerNodelet::onRelocalize, this));
  services_.push_back(private_node.advertiseService("load_map", &LocalizerNodelet::onLoadMap, this));
  services_.push_back(private_node.advertiseService("from_ll", &LocalizerNodelet::onFromLL, this));
  services_.push_back(private_node.advertiseService("to_ll", &LocalizerNodelet::onToLL, this));
  services_.push_back(node.advertiseService("global_localization", &LocalizerNodelet::onGlobalLocalization, this));
  reconfigure_ = std::make_unique<ReconfigureServer>(
      private_node, parameters_,
      [this](const NodeParameters& parameters, const ParameterValues& changed) { configure(parameters, changed); },
      [this](const std::string& reason) { NODELET_WARN_STREAM("Parameters: " << oneLine(reason, kLongestLine)); });
  service_spinner_ = std::make_unique<ros::AsyncSpinner>(1, &service_queue_);
  service_spinner_->start();
  sessions_->offer(getPrivateNodeHandle());
}

void LocalizerNodelet::onInitialPose(const geometry_msgs::PoseWithCovarianceStampedConstPtr& pose) {
  try {
    const SharedLocalizer::Guess guess = guessFrom(*pose, parameters_.node.global_frame_id);
    const bool started = localizer_->relocalizeAt(guess);
    NODELET_INFO_STREAM((started ? "Searching around" : "No map is loaded yet: will search around")
                        << " x = " << guess.mean_m.x() << " m, y = " << guess.mean_m.y()
                        << " m; the heading comes from the training images");
  } catch (const std::exception& error) {
    log_.warn("initial pose", std::string("Initial pose refused: ") + error.what());
  }
}

void LocalizerNodelet::onOdometry(const nav_msgs::OdometryConstPtr& odometry) {
  try {
    requireUsableStamp(odometry->header.stamp);
    const auto stamp_ns = static_cast<std::int64_t>(odometry->header.stamp.toNSec());
    localizer_->addOdometry(
        toReading(*odometry, stamp_ns, parameters_.node.base_frame_id, parameters_.node.global_frame_id));
  } catch (const std::exception& error) {
    log_.warn("odometry", "Odometry on " + odometry_.getTopic() + " refused: " + error.what());
  }
}

bool LocalizerNodelet::onRelocalize(Relocalize::Request& request, Relocalize::Response& response) {
  try {
    const Eigen::Vector2d centre_m(request.centre.x, request.centre.y);
    response.success =
        request.use_centre ? localizer_->relocalizeAround(centre_m, request.radius) : localizer_->relocalizeAnywhere();
    response.message = !response.success    ? "no map is loaded"
                       : request.use_centre ? "searching in the disc"
                                            : "searching the whole map";
  } catch (const std::exception& error) {
    response.success = false;
    response.message = oneLine(error.what());
  }
  return true;
}

bool LocalizerNodelet::onGlobalLocalization(std_srvs::Empty::Request&, std_srvs::Empty::Response&) {
  if (!localizer_->relocalizeAnywhere()) NODELET_WARN("No map is loaded: nothing to search");
  return true;
}

bool LocalizerNodelet::onLoadMap(LoadMap::Request& request, LoadMap::Response& response) {
  try {
    response.images = static_cast<std::uint32_t>(useMap(request.path));
    reconfigure_->setMap(request.path);
    response.success = true;
    response.message = oneLine("loaded " + request.path);
  } catch (const std::exception& error) {
    const auto map = localizer_->map();
    response.images = map ? static_cast<std::uint32_t>(map->size()) : 0;
    response.success = false;
    response.message = oneLine(error.what());
    NODELET_WARN_STREAM("Map not loaded: " << response.message);
  }
  return true;
}

bool LocalizerNodelet::onFromLL(FromLL::Request& request, FromLL::Response& response) {
  response = fromLL(localizer_->map().get(), request);
  return true;
}

bool LocalizerNodelet::onToLL(ToLL::Request& request, ToLL::Response& response) {
  response = toLL(localizer_->map().get(), request);
  return true;
}

void LocalizerNodelet::configure(const NodeParameters& parameters, const ParameterValues& changed) {
  localizer_->configure(parameters.localizer);
  diagnostics_->setImageTimeout(parameters.node.image_timeout_s);
  publisher_->configure(parameters);
  std::vector<std::string> settings;
  for (const auto& [name, value] : changed) settings.push_back(name + " = " + parameters::toString(value));
  NODELET_INFO_STREAM("Parameters changed: " << oneLine(joined(settings), kLongestLine));
}

void LocalizerNodelet::onTimer(const ros::WallTimerEvent&) {
  guarded(log_, "state", [this] {
    if (!localizer_->hasMap())
      publisher_->publishState(LocalizationState::kNoMap, {StateReason::kNoMap}, worker_->counts());
    watchCamera();
  });
  guarded(log_, "diagnostics", [this] { diagnostics_->publish(); });
}

/// Without images the robot may be anywhere by now.
void LocalizerNodelet::watchCamera() {
  const auto silence_s = diagnostics_->silence_s();
  if (silence_s && !camera_silent_)
    NODELET_ERROR_STREAM("No image for " << *silence_s << " s on " << images_->description());
  if (!silence_s && camera_silent_) NODELET_INFO("Images arrive again");
  camera_silent_ = silence_s.has_value();
  if (!camera_silent_) return;
  const auto state = localizer_->doubt();
  if (!state) return;
  const Why why{StateReason::kCameraSilent, *silence_s};
  diagnostics_->stateIs(*state, why);
  publisher_->publishState(*state, why, worker_->counts());
}

std::size_t LocalizerNodelet::useMap(const std::string& path) {
  const std::string below = mapFileBelow(parameters_.node.map_directory, path);
  const std::string file = below.empty() ? below : std::filesystem::absolute(below).string();
  const auto map = loadMap(file, parameters_.node.mapLoading([name = getName()](const std::string& reason) {
    ROS_WARN_STREAM_NAMED(name, "Map " << oneLine(reason, kLongestLine));  // the map may outlive the nodelet
  }));
  localizer_->setMap(map);
  camera_->mapIs(map->header());
  sessions_->mapIs(file, map);
  publisher_->publishMap(*map);
  diagnostics_->mapLoaded(path, map->size());
  NODELET_INFO_STREAM("Map " << oneLine(path) << " with " << map->size() << " training images");
  return map->size();
}

}  // namespace visual_localization

PLUGINLIB_EXPORT_CLASS(visual_localization::LocalizerNodelet, nodelet::Nodelet)
