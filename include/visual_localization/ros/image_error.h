#pragma once

#include <stdexcept>

namespace visual_localization {

/// An image message that cannot be used. The text is the reason, in one line.
class ImageError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

}  // namespace visual_localization
