#pragma once

#include <cstdint>
#include <vector>

#include <opencv2/imgproc.hpp>

#include "test/support/stamps.h"
#include "visual_localization/geo/trajectory.h"

namespace visual_localization::test {

/// Five fixes a second for eight seconds, eastwards at 0.7 m/s.
inline std::vector<Fix> straightRound() {
  const LocalFrame frame({48.5, 9.05, 0.0});
  constexpr int kFixes = 40;
  std::vector<Fix> fixes;
  for (int i = 0; i < kFixes; ++i) fixes.push_back({i * kSecond_ns / 5, frame.toGeodetic({0.14 * i, 0.0}), true});
  return fixes;
}

/// Blobs of random size and brightness; `shift_px` moves the scene.
inline cv::Mat scene(std::uint64_t seed, int shift_px) {
  cv::RNG random(seed);
  cv::Mat image(240, 320, CV_8UC1, cv::Scalar(128));
  for (int i = 0; i < 150; ++i) {
    const cv::Point centre(random.uniform(0, 400) - shift_px, random.uniform(0, 240));
    cv::circle(image, centre, random.uniform(2, 14), cv::Scalar(random.uniform(0, 255)), cv::FILLED, cv::LINE_AA);
  }
  return image;
}

}  // namespace visual_localization::test
