#pragma once

#include <exception>
#include <string>

#include <ros/time.h>

#include "node/throttled_log.h"

namespace visual_localization {

/// The latest stamp that may be passed on. A tf2 listener ends by an exception when it adds a time to one near the end
/// of its 32 bits, and the difference of stamps more than 68 years apart is one too.
ros::Time latestStamp(const ros::Time& now, const ros::Time& wall_now);

/// Empty for a usable stamp; an old one is: bags are replayed.
std::string stampTrouble(const ros::Time& stamp);

/// Throws std::invalid_argument with stampTrouble(), if there is any.
void requireUsableStamp(const ros::Time& stamp);

/// Or the latest stamp there is.
ros::Time later(const ros::Time& stamp, double seconds);

/// An exception would end the process that roscpp calls from; `task` names it in the log.
template <class Run>
void guarded(ThrottledLog& log, const char* task, Run run) {
  try {
    run();
  } catch (const std::exception& error) {
    log.error(task, std::string(task) + ": " + error.what());
  }
}

}  // namespace visual_localization
