#include "visual_localization/localizer/image_look.h"

#include <algorithm>
#include <cstdint>

namespace visual_localization {

bool areIdentical(const cv::Mat& a, const cv::Mat& b) {
  if (a.size() != b.size() || a.type() != b.type()) return false;
  for (int row = 0; row < a.rows; ++row) {
    const auto* pixels = a.ptr<std::uint8_t>(row);
    if (!std::equal(pixels, pixels + a.cols, b.ptr<std::uint8_t>(row))) return false;
  }
  return true;
}

}  // namespace visual_localization
