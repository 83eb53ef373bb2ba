#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include <opencv2/core.hpp>

#include "visual_localization/camera/camera_model.h"
#include "visual_localization/geo/trajectory.h"
#include "visual_localization/geometry/camera_pose.h"
#include "visual_localization/localization/odometry.h"
#include "visual_localization/ros/image_conversion.h"

namespace visual_localization {

class StaticTransforms;

namespace bag {
class BagFile;
class Bytes;
}  // namespace bag

/// A bag that cannot be read. The text is one line and begins with the path.
class BagError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// One image of a bag, not decoded yet.
struct BagImage {
  std::int64_t stamp_ns = 0;        ///< of the header, or when it was recorded if the header has none
  std::function<cv::Mat()> decode;  ///< 8-bit grey image; throws ImageError when the message is unusable
  cv::Size size = {};               ///< pixels, by the message's header; empty when the message is unusable
};

/// The images of one topic in the order of recording; each is read from the bag only when asked for. Keeps the bag
/// open, which it shares with its BagReader: use both in one thread.
class BagImages {
 public:
  std::size_t size() const;
  /// The topic that was found.
  const std::string& topic() const;
  /// Throws BagError when the bag is damaged there.
  BagImage read(std::size_t i) const;
  /// The size of most images, by the headers of at most a hundred, evenly spread; the smaller one of equals. Empty when
  /// none is usable. Throws like read().
  cv::Size usualSize() const;

 private:
  friend class BagReader;
  struct Content;
  explicit BagImages(std::shared_ptr<const Content> content) : content_(std::move(content)) {}

  std::shared_ptr<const Content> content_;
};

/// One source of positions.
struct Receiver {
  std::string frame;       ///< of its antenna, or whatever its positions are about; may be empty
  std::vector<Fix> fixes;  ///< in the order of recording, believable or not
  std::string said = {};   ///< how they became fixes, if that is worth a line
};

/// Reads images and fixes from a bag that may come from anyone: a damaged one gives a BagError. Damage within a
/// compressed chunk shows when its first message is read, all other on opening.
class BagReader {
 public:
  /// Throws BagError when there is no readable, indexed bag at `path`.
  explicit BagReader(const std::string& path);
  /// A bag in `bytes` (never null); `name` takes the place of the path.
  BagReader(std::string name, std::unique_ptr<const bag::Bytes> bytes);

  /// `topic` as sensor_msgs/Image, or `topic` or `<topic>/compressed` as sensor_msgs/CompressedImage, in this order.
  /// Throws BagError naming the image topics of the bag.
  BagImages images(const std::string& topic) const;

  /// Of sensor_msgs/NavSatFix or nav_msgs/Odometry, by the frames that the messages are about: those with the most
  /// usable fixes first. Throws BagError that names the topics of the bag, or the topic's own type.
  std::vector<Receiver> receivers(const std::string& topic) const;

  /// Of sensor_msgs/NavSatFix in the order of recording, believable or not. Throws BagError naming the fix topics of
  /// the bag.
  std::vector<Fix> fixes(const std::string& topic) const;

  /// Of nav_msgs/Odometry in the order of recording, of the robot's frame `base_frame`. Throws BagError naming the
  /// odometry topics of the bag, or why a message is none.
  std::vector<OdometryReading> odometry(const std::string& topic, const std::string& base_frame,
                                        const std::string& map_frame) const;

  bool hasFixes(const std::string& topic) const;

  /// The sensor_msgs/CameraInfo beside the images of `image_topic` (raw or compressed), by image_transport's naming.
  /// Nothing when there is none or the camera is not calibrated. Throws BagError when the calibration cannot be used,
  /// or changes within the bag.
  std::optional<CameraModel> camera(const std::string& image_topic) const;

  /// Of /tf_static; `published`: and what never changes in /tf.
  std::shared_ptr<const StaticTransforms> transforms(bool published) const;
  /// Of the first image, or of the calibration beside it; empty when neither names one.
  std::string imageFrame(const std::string& image_topic) const;

  const std::string& path() const { return path_; }

 private:
  std::string path_;
  std::shared_ptr<bag::BagFile> file_;
};

}  // namespace visual_localization
