#pragma once

#include <string>

#include <geometry_msgs/PoseWithCovarianceStamped.h>

#include "visual_localization/geo/local_frame.h"
#include "visual_localization/ros/shared_localizer.h"

namespace visual_localization {

/// Position and its covariance from an initial pose. The heading is not used: the training images give it.
/// Throws std::invalid_argument with the reason in words when the frame is not `global_frame`, a number is not
/// finite or the covariance of x and y is not symmetric and positive semi-definite.
SharedLocalizer::Guess guessFrom(const geometry_msgs::PoseWithCovarianceStamped& pose, const std::string& global_frame);

/// Throws std::invalid_argument, with the reason in words, unless centre and radius are finite, on a local map and
/// the radius is positive.
void requireDisc(const Eigen::Vector2d& centre_m, double radius_m);

}  // namespace visual_localization
