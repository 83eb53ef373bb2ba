#pragma once

#include <stdexcept>
#include <string>

namespace visual_localization {

/// A bag whose records do not fit together. One line, without the path.
class DamagedBag : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// Checks every length, offset and number in a bag (format 2.0) that rosbag_storage goes by without checking it:
/// that library reads beyond its buffers when they are wrong. Reads the file once (message contents only in
/// compressed chunks, which are unpacked one at a time, 256 MiB at most). Throws DamagedBag, also for bags without
/// index and for other versions of the format.
void validateBag(const std::string& path);

}  // namespace visual_localization
