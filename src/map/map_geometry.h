#pragma once

#include <cstddef>
#include <functional>
#include <optional>
#include <vector>

#include "geometry/session_geometry.h"
#include "visual_localization/map/map_builder.h"
#include "visual_localization/map/training_map.h"

namespace visual_localization {

/// The image is where the robot was by the pose of its camera.
void placeByCamera(TrainingImage& image, const SensorMount& mount, ImageGeometry geometry);

/// Landmarks and poses of the sessions that have a camera, from their pruned images, which follow each other session by
/// session. `fixes`: of each session.
std::vector<std::optional<SessionGeometry>> geometryOf(const TrainingMap& pruned, const std::vector<Session>& sessions,
                                                       const std::vector<std::vector<MapFix>>& fixes,
                                                       const GeometryConfig& config, std::size_t threads);

/// Cameras of the sessions that have none, by their images: see calibrateByImages() of a single one.
std::vector<std::optional<CameraModel>> calibrateByImages(const TrainingMap& pruned,
                                                          const std::vector<Session>& sessions,
                                                          const std::vector<std::vector<MapFix>>& fixes,
                                                          const GeometryConfig& config, std::size_t threads);

/// Gives the images to `sink` where the adjustment has the robot, but for those that are too close to the one before
/// (map/spacing, geometry/spacing); the number of these is returned.
std::size_t writeThinned(const TrainingMap& pruned, const std::vector<Session>& sessions,
                         std::vector<std::optional<SessionGeometry>> geometries, const MapBuilderConfig& config,
                         const std::function<void(const TrainingImage&)>& sink);

}  // namespace visual_localization
