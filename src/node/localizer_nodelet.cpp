#include "node/localizer_nodelet.h"

#include <cmath>
#include <exception>
#include <utility>

#include <nodelet/exception.h>
#include <pluginlib/class_list_macros.hpp>

#include "node/localizer_diagnostics.h"
#include "node/message_conversions.h"
#include "node/node_config.h"
#include "node/parameter_server.h"
#include "node/shared_localizer.h"
#include "visual_localization/map/map_file.h"
#include "visual_localization/parameters/parameters.h"

namespace visual_localization {
namespace {

constexpr double kTimerPeriod_s = 1.0;  ///< of diagnostics, and of the status while there is no map

/// In 64 bits: differences of ros::Time throw when they are longer than 68 years.
double millisecondsBetween(const ros::Time& from, const ros::Time& to) {
  const auto difference_ns = static_cast<std::int64_t>(to.toNSec()) - static_cast<std::int64_t>(from.toNSec());
  return static_cast<double>(difference_ns) * 1e-6;
}

}  // namespace

LocalizerNodelet::~LocalizerNodelet() { stop(); }

void LocalizerNodelet::onInit() {
  try {
    start();
  } catch (const std::exception& error) {
    // The loader frees the callback queues of a nodelet that fails before it frees the nodelet itself.
    stop();
    NODELET_FATAL_STREAM(getName() << " does not start: " << error.what());
    throw nodelet::Exception(error.what());
  }
}

void LocalizerNodelet::stop() {
  // First nothing new comes in, then the last image is finished, then the rest goes.
  timer_.stop();
  service_spinner_.reset();
  services_.clear();
  reconfigure_.reset();
  initial_pose_.shutdown();
  if (images_) images_->shutdown();
  queue_.close();
  if (worker_.joinable()) worker_.join();
  images_.reset();
  diagnostics_.reset();
  transform_publisher_.reset();
  publisher_.reset();
}

void LocalizerNodelet::start() {
  ros::NodeHandle& node = getNodeHandle();
  ros::NodeHandle& private_node = getPrivateNodeHandle();
  parameters_ = loadParameters(private_node);
  localizer_ = std::make_unique<SharedLocalizer>(parameters_.localizer);
  publisher_ = std::make_unique<LocalizerPublisher>(private_node, parameters_.node);
  transform_publisher_ = std::make_unique<TransformPublisher>(parameters_.node, node);
  diagnostics_ = std::make_unique<LocalizerDiagnostics>(node, private_node, getName(), parameters_.node,
                                                        [this] { return images_->description(); });
  images_ = std::make_unique<ImageSource>(node, private_node, parameters_.node.image_transport,
                                          [this](ReceivedImage image) { onImage(std::move(image)); });
  if (!parameters_.node.map.empty()) {
    try {
      useMap(parameters_.node.map);
    } catch (const std::exception& error) {
      throw ParameterError("parameter 'map' is not allowed: must be a map file: " + std::string(error.what()));
    }
  }
  initial_pose_ = node.subscribe("initialpose", 1, &LocalizerNodelet::onInitialPose, this);
  offerServices();
  timer_ = node.createWallTimer(ros::WallDuration(kTimerPeriod_s), &LocalizerNodelet::onTimer, this);
  worker_ = std::thread(&LocalizerNodelet::work, this);
  NODELET_INFO_STREAM(getName() << " listens to " << images_->topic());
}

void LocalizerNodelet::offerServices() {
  // Loading a map takes a while and must not hold up the images. The multi-threaded queue of the nodelet is of no
  // use: the loader may free it while a callback of the other queue still holds the nodelet.
  ros::NodeHandle node = getNodeHandle();
  ros::NodeHandle private_node = getPrivateNodeHandle();
  node.setCallbackQueue(&service_queue_);
  private_node.setCallbackQueue(&service_queue_);
  services_.push_back(private_node.advertiseService("relocalize", &LocalizerNodelet::onRelocalize, this));
  services_.push_back(private_node.advertiseService("load_map", &LocalizerNodelet::onLoadMap, this));
  services_.push_back(node.advertiseService("global_localization", &LocalizerNodelet::onGlobalLocalization, this));
  reconfigure_ = std::make_unique<ReconfigureServer>(
      private_node, parameters_,
      [this](const NodeParameters& parameters, const ParameterValues& changed) { configure(parameters, changed); },
      [this](const std::string& reason) { NODELET_WARN_STREAM("Parameters: " << reason); });
  service_spinner_ = std::make_unique<ros::AsyncSpinner>(1, &service_queue_);
  service_spinner_->start();
}

void LocalizerNodelet::onImage(ReceivedImage image) {
  diagnostics_->imageArrived();
  queue_.push(std::move(image));
}

void LocalizerNodelet::onInitialPose(const geometry_msgs::PoseWithCovarianceStampedConstPtr& pose) {
  try {
    const SharedLocalizer::Guess guess = guessFrom(*pose, parameters_.node.global_frame_id);
    const bool started = localizer_->relocalizeAt(guess);
    NODELET_INFO_STREAM((started ? "Searching around" : "No map is loaded yet: will search around")
                        << " x = " << guess.mean_m.x() << " m, y = " << guess.mean_m.y()
                        << " m; the heading comes from the training images");
  } catch (const std::exception& error) {
    if (initial_pose_throttle_.ready()) NODELET_WARN_STREAM("Initial pose refused: " << error.what());
  }
}

bool LocalizerNodelet::onRelocalize(Relocalize::Request& request, Relocalize::Response& response) {
  try {
    const Eigen::Vector2d centre_m(request.centre.x, request.centre.y);
    response.success =
        request.use_centre ? localizer_->relocalizeAround(centre_m, request.radius) : localizer_->relocalizeAnywhere();
    response.message = !response.success    ? "no map is loaded"
                       : request.use_centre ? "searching in the disc"
                                            : "searching anywhere in the map";
  } catch (const std::exception& error) {
    response.success = false;
    response.message = error.what();
  }
  return true;
}

bool LocalizerNodelet::onGlobalLocalization(std_srvs::Empty::Request&, std_srvs::Empty::Response&) {
  if (!localizer_->relocalizeAnywhere()) NODELET_WARN("No map is loaded: nowhere to search");
  return true;
}

bool LocalizerNodelet::onLoadMap(LoadMap::Request& request, LoadMap::Response& response) {
  try {
    response.images = static_cast<std::uint32_t>(useMap(request.path));
    reconfigure_->setMap(request.path);
    response.success = true;
    response.message = "loaded " + request.path;
  } catch (const std::exception& error) {
    const auto map = localizer_->map();
    response.images = map ? static_cast<std::uint32_t>(map->size()) : 0;
    response.success = false;
    response.message = error.what();
    NODELET_WARN_STREAM("Map not loaded: " << error.what());
  }
  return true;
}

void LocalizerNodelet::configure(const NodeParameters& parameters, const ParameterValues& changed) {
  localizer_->configure(parameters.localizer);
  diagnostics_->setImageTimeout(parameters.node.image_timeout_s);
  transform_publisher_->setTolerance(parameters.node.transform_tolerance_s);
  std::string all;
  for (const auto& [name, value] : changed)
    all += (all.empty() ? "" : ", ") + name + " = " + parameters::toString(value);
  NODELET_INFO_STREAM("Parameters changed: " << all);
}

void LocalizerNodelet::onTimer(const ros::WallTimerEvent&) {
  if (!localizer_->hasMap()) publisher_->publishState(LocalizationState::kNoMap, counts());
  watchCamera();
  diagnostics_->publish();
}

/// A robot that sees nothing may be anywhere by now: nobody must go on to trust the last state.
void LocalizerNodelet::watchCamera() {
  const auto silence_s = diagnostics_->silence_s();
  if (silence_s && !camera_silent_)
    NODELET_ERROR_STREAM("No image for " << *silence_s << " s on " << images_->description());
  if (!silence_s && camera_silent_) NODELET_INFO("Images arrive again");
  camera_silent_ = silence_s.has_value();
  if (!camera_silent_) return;
  const auto state = localizer_->doubt();
  if (!state) return;
  diagnostics_->stateIs(*state);
  publisher_->publishState(*state, counts());
}

std::size_t LocalizerNodelet::useMap(const std::string& path) {
  const std::string file = mapFileBelow(parameters_.node.map_directory, path);
  const auto map = loadMap(file, parameters_.node.mapLoading([name = getName()](const std::string& reason) {
    ROS_WARN_STREAM_NAMED(name, "Map " << reason);  // the map may outlive the nodelet
  }));
  localizer_->setMap(map);
  publisher_->publishMap(*map);
  diagnostics_->mapLoaded(path, map->size());
  NODELET_INFO_STREAM("Map " << path << " with " << map->size() << " training images");
  return map->size();
}

void LocalizerNodelet::work() {
  while (const auto image = queue_.pop()) {
    try {
      process(*image);
    } catch (const std::exception& error) {
      refuse(error.what());
    }
  }
}

void LocalizerNodelet::process(const ReceivedImage& image) {
  const cv::Mat grey = image.decode();
  if (!localizer_->hasMap() || !isInOrder(image.header.stamp)) return;
  const ros::Time stamp = usableStamp(image.header.stamp);
  const auto result = localizer_->process(static_cast<std::int64_t>(stamp.toNSec()), grey);
  if (!result) return;
  ++processed_;
  if (!isFinite(result->estimate)) {
    if (finite_throttle_.ready()) NODELET_ERROR("The estimate is not finite and is not published");
    return;
  }
  reportTrouble(result->estimate);
  publish(*result, stamp, !image.header.stamp.isZero());
  std_msgs::Header header = image.header;
  header.stamp = stamp;
  publisher_->publishMatches(*result, grey, header);
}

void LocalizerNodelet::publish(const SharedLocalizer::Result& result, const ros::Time& stamp, bool stamp_is_usable) {
  const double latency_ms = stamp_is_usable ? millisecondsBetween(stamp, ros::Time::now()) : -1.0;
  publisher_->publish(result, stamp, latency_ms, counts());
  diagnostics_->imageProcessed(result.estimate, latency_ms, counts());
  if (result.estimate.frozen) {  // the pose is of long ago
    diagnostics_->transformMissing("the camera is frozen");
    return;
  }
  const std::string missing = transform_publisher_->publish(result.estimate.pose, stamp);
  diagnostics_->transformMissing(missing);
  if (!missing.empty() && transform_throttle_.ready()) NODELET_WARN_STREAM("Nothing broadcast on tf: " << missing);
}

void LocalizerNodelet::reportTrouble(const Estimate& estimate) {
  const std::string trouble = imageTrouble(estimate);
  if (!trouble.empty() && trouble_throttle_.ready()) NODELET_WARN_STREAM(trouble << " (" << images_->topic() << ")");
}

bool LocalizerNodelet::isInOrder(const ros::Time& stamp) {
  if (stamp.isZero()) return true;
  const auto verdict = stamps_.judge(static_cast<std::int64_t>(stamp.toNSec()));
  if (verdict == StampMonitor::Verdict::kInOrder) return true;
  if (verdict == StampMonitor::Verdict::kWentBack) {
    if (jump_throttle_.ready()) {
      NODELET_WARN_STREAM("Time went back by " << stamps_.lag_s()
                                               << " s, as when a bag begins anew: goes on from there");
    }
    transform_publisher_->forget();
    return true;
  }
  ++late_;
  if (order_throttle_.ready()) {
    NODELET_WARN_STREAM("An image is " << stamps_.lag_s() << " s older than one before it and is left out; "
                                       << images_->topic());
  }
  return false;
}

ros::Time LocalizerNodelet::usableStamp(const ros::Time& stamp) {
  if (!stamp.isZero()) return stamp;
  if (stamp_throttle_.ready()) NODELET_WARN("Images without a stamp: the time of processing is used");
  return ros::Time::now();
}

void LocalizerNodelet::refuse(const std::string& reason) {
  ++refused_;
  diagnostics_->imageRefused(counts(), reason);
  if (refusal_throttle_.ready()) NODELET_WARN_STREAM("Image refused: " << reason);
}

ImageCounts LocalizerNodelet::counts() const { return {processed_, queue_.dropped(), late_, refused_}; }

}  // namespace visual_localization

PLUGINLIB_EXPORT_CLASS(visual_localization::LocalizerNodelet, nodelet::Nodelet)
