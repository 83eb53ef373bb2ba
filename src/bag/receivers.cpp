#include <algorithm>
#include <cmath>
#include <functional>
#include <utility>

#include <GeographicLib/UTMUPS.hpp>

#include "bag/bag_messages.h"
#include "base/text.h"
#include "geo/coordinate_units.h"
#include "ros/message_readers.h"
#include "visual_localization/bag/bag_reader.h"

namespace visual_localization {
namespace {

/// An odometry does not say where its plane is on the earth: near latitude and longitude 0, but not there, which is
/// what receivers send that know nothing.
constexpr GeodeticPoint kNowhere{0.1, 0.1, 0.0};
constexpr int kSomeZone = 31;                 ///< of UTM, which the message does not tell
constexpr double kNorthernmost_m = 9.5e6;     ///< a larger northing is of the south, which counts from 1e7 down
constexpr double kLargestLocal_m = 50'000.0;  ///< a UTM northing is beyond it but for the equator

bool isUtm(double x_m, double y_m) {
  return x_m >= 1e5 && x_m <= 9e5 && y_m >= 0.0 && y_m <= 1e7 && std::max(x_m, y_m) > kLargestLocal_m;
}

Fix toFix(const nav_msgs::Odometry& message, std::int64_t stamp_ns) {
  const auto& position = message.pose.pose.position;
  Fix fix;
  fix.stamp_ns = stamp_ns;
  fix.has_fix = std::isfinite(position.x) && std::isfinite(position.y) && std::isfinite(position.z);
  if (!fix.has_fix) return fix;
  if (isUtm(position.x, position.y)) {
    GeographicLib::UTMUPS::Reverse(kSomeZone, position.y <= kNorthernmost_m, position.x, position.y,
                                   fix.position.latitude_deg, fix.position.longitude_deg);
  } else if (std::hypot(position.x, position.y) <= kLargestCoordinate_m) {
    fix.position = LocalFrame(kNowhere).toGeodetic({position.x, position.y});
  } else {
    fix.has_fix = false;
  }
  fix.position.altitude_m = position.z;
  const auto& variances_m2 = message.pose.covariance;
  fix.sigma_m = deviationOf(0.5 * (variances_m2[0] + variances_m2[7]));
  fix.sigma_up_m = deviationOf(variances_m2[14]);
  return fix;
}

std::string saidOf(const nav_msgs::Odometry& message) {
  const auto& position = message.pose.pose.position;
  const std::string frame = "positions of nav_msgs/Odometry in the frame '" + oneLine(message.header.frame_id) + "'";
  if (isUtm(position.x, position.y)) {
    return frame + ", taken for UTM of zone " + std::to_string(kSomeZone) +
           (position.y <= kNorthernmost_m ? " north" : " south") + ": metres are right, the longitude is not known";
  }
  return frame + ", laid about latitude 0.1, longitude 0.1: metres are right, where on the earth is not known";
}

template <class Message>
using ToReceiver = std::function<std::pair<std::string, Fix>(const Message& message, std::int64_t stamp_ns)>;

/// In the order in which the frames appear.
template <class Message>
std::vector<Receiver> receiversOf(bag::BagFile& file, const std::string& topic, const ToReceiver<Message>& toReceiver) {
  std::vector<Receiver> receivers;
  for (const bag::Message& message : messagesOf<Message>(file, topic)) {
    const auto read = deserialize<Message>(file.read(message));
    auto [frame, fix] = toReceiver(*read, stampOf(read->header, message));
    auto receiver = std::find_if(receivers.begin(), receivers.end(),
                                 [name = frame](const Receiver& one) { return one.frame == name; });
    if (receiver == receivers.end()) {
      if (receivers.size() == 100) throw std::runtime_error("more than 100 frames on topic '" + topic + "'");
      receiver = receivers.insert(receivers.end(), {frame, {}});
      if constexpr (std::is_same_v<Message, nav_msgs::Odometry>) receiver->said = saidOf(*read);
    }
    receiver->fixes.push_back(fix);
  }
  return receivers;
}

std::ptrdiff_t usable(const Receiver& receiver) {
  return std::count_if(receiver.fixes.begin(), receiver.fixes.end(), hasPosition);
}

std::string otherTypeOf(const bag::BagFile& file, const std::string& topic) {
  for (const auto& [id, connection] : file.connections()) {
    if (connection.topic != topic) continue;
    const std::string said = "topic '" + oneLine(topic) + "' has " + oneLine(connection.type) +
                             ", and fixes are sensor_msgs/NavSatFix or nav_msgs/Odometry";
    const bool gps_fix = connection.type == "gps_common/GPSFix";
    return said + (gps_fix ? ": record the NavSatFix of the driver, or convert it (fix_translator of gps_tools)" : "") +
           "; ";
  }
  return "no fix topic '" + oneLine(topic) + "'; ";
}

}  // namespace

std::vector<Receiver> BagReader::receivers(const std::string& topic) const {
  return withBag(path_, [&] {
    std::vector<Receiver> found;
    if (hasFixes(topic)) {
      found = receiversOf<sensor_msgs::NavSatFix>(*file_, topic, [](const auto& message, std::int64_t stamp_ns) {
        return std::pair(withoutSlash(message.header.frame_id), visual_localization::toFix(message, stamp_ns));
      });
    } else if (topicsOf<nav_msgs::Odometry>(*file_).count(topic) != 0) {
      found = receiversOf<nav_msgs::Odometry>(*file_, topic, [](const auto& message, std::int64_t stamp_ns) {
        return std::pair(withoutSlash(message.child_frame_id), toFix(message, stamp_ns));
      });
    } else {
      throw BagError(path_ + ": " + otherTypeOf(*file_, topic) +
                     "fix topics in this bag: " + listTopics<sensor_msgs::NavSatFix, nav_msgs::Odometry>(*file_));
    }
    for (Receiver& receiver : found) {
      if (receiver.said.empty()) receiver.said = joined(repairUnits(receiver.fixes), "; ");
    }
    std::stable_sort(found.begin(), found.end(),
                     [](const Receiver& a, const Receiver& b) { return usable(a) > usable(b); });
    return found;
  });
}

}  // namespace visual_localization
