#pragma once

#include <exception>
#include <string>

#include <ros/time.h>

#include "node/throttled_log.h"

namespace visual_localization {

/// The latest stamp that may be passed on while ROS and the computer have these times. Whoever adds a time to a stamp
/// near the end of its 32 bits, as every tf2 listener does, ends by an exception; and the difference of stamps more
/// than 68 years apart is one too.
ros::Time latestStamp(const ros::Time& now, const ros::Time& wall_now);

/// Why nobody should be handed this stamp now; empty for one that is well. An old one is: bags are replayed.
std::string stampTrouble(const ros::Time& stamp);

/// Throws std::invalid_argument with stampTrouble(), if there is any.
void requireUsableStamp(const ros::Time& stamp);

/// `stamp` so many seconds later, or the latest stamp there is.
ros::Time later(const ros::Time& stamp, double seconds);

/// Runs what roscpp calls, where an exception would end the process: `task` names it in the log.
template <class Run>
void guarded(ThrottledLog& log, const char* task, Run run) {
  try {
    run();
  } catch (const std::exception& error) {
    log.error(task, std::string(task) + ": " + error.what());
  }
}

}  // namespace visual_localization
