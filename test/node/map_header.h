#pragma once

#include <ros/time.h>
#include <std_msgs/Header.h>

namespace visual_localization::test {

inline std_msgs::Header mapHeader(const ros::Time& stamp) {
  std_msgs::Header header;
  header.frame_id = "map";
  header.stamp = stamp;
  return header;
}

}  // namespace visual_localization::test
