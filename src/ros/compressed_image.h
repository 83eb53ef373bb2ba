#pragma once

#include <cstdint>
#include <vector>

#include <opencv2/core.hpp>

namespace visual_localization {

/// The size itself. Throws ImageError when an image of this size, pixels, is empty or too large to be taken.
cv::Size requireImageSize(std::uint64_t width, std::uint64_t height);

/// Size of a JPEG or a PNG by its header, pixels; nothing is decoded. Throws ImageError when it is neither, empty or
/// too large, and a JPEG that is cut off.
cv::Size compressedSize(const std::vector<std::uint8_t>& file);

/// 8-bit grey image of a JPEG or a PNG. Throws ImageError when it is neither, broken, cut off or too large. It takes no
/// memory for pixels before the decoder itself has read how many there are, and none for texts in the file.
cv::Mat decodedToGrey(const std::vector<std::uint8_t>& file);

}  // namespace visual_localization
