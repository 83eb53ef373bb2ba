#pragma once

#include <stdexcept>
#include <string>

namespace visual_localization {

/// A bag whose records do not fit together. One line, without the path.
class DamagedBag : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// A bag that may be whole, but is none that can be read. One line, without the path.
class UnsupportedBag : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// Checks every length, offset and number in a bag (format 2.0) that rosbag_storage goes by without checking it:
/// that library reads beyond its buffers when they are wrong. Reads the file once (message contents only in
/// compressed chunks, which are unpacked one at a time, 256 MiB at most). Throws DamagedBag, or UnsupportedBag when
/// the bag has no index, is encrypted or is of another version of the format.
void validateBag(const std::string& path);

}  // namespace visual_localization
