#pragma once

#include <memory>
#include <optional>
#include <vector>

#include <Eigen/Core>

#include "evaluation/drive_order.h"
#include "evaluation/score_table.h"
#include "evaluation/true_pose.h"

namespace visual_localization {

/// What a map has wrong at one of its training images: its pose there minus the true one.
struct MapError {
  Eigen::Vector2d position_m = Eigen::Vector2d::Zero();
  std::optional<double> yaw_rad = {};  ///< none: the true heading is not known
};

/// For each image of `drive`, the error of the map at the training image that was taken nearest to it and faces alike,
/// if headings are known. `truth`: of the images of the whole map; nothing where they are not known.
std::vector<std::optional<MapError>> mapErrors(const PartialMap& part,
                                               const std::vector<std::optional<TruePose>>& truth, const Drive& drive);

}  // namespace visual_localization
