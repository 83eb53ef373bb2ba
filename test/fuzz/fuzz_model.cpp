/// Models of local features, as ONNX files that anyone made; what is accepted extracts features.
#include <cmath>
#include <cstdint>
#include <memory>
#include <stdexcept>
#include <string>

#include <opencv2/core.hpp>
#include <pthread.h>
#ifdef VISUAL_LOCALIZATION_FUZZ
#include <sanitizer/common_interface_defs.h>
#endif

#include "test/fuzz/fuzz_support.h"
#include "visual_localization/features/learned.h"

namespace visual_localization {
namespace {

#ifdef VISUAL_LOCALIZATION_FUZZ
/// What ends the copy of the process in which a model is tried first is no finding.
[[maybe_unused]] const int copies_keep_nothing =
    ::pthread_atfork(nullptr, nullptr, [] { __sanitizer_set_death_callback(nullptr); });
#endif

cv::Mat checkerboard() {
  cv::Mat grey(40, 56, CV_8U);
  for (int y = 0; y < grey.rows; ++y) {
    for (int x = 0; x < grey.cols; ++x) grey.at<std::uint8_t>(y, x) = (x / 8 + y / 8) % 2 == 0 ? 40 : 200;
  }
  return grey;
}

void requireFeatures(const LocalFeatures& features, const Learned& kind, const cv::Mat& grey) {
  for (std::size_t i = 0; i < features.size(); ++i) {
    const Keypoint keypoint = features.keypoints()[i];
    const bool inside = keypoint.x_px >= 0.0F && keypoint.x_px < static_cast<float>(grey.cols) &&
                        keypoint.y_px >= 0.0F && keypoint.y_px < static_cast<float>(grey.rows);
    if (!inside) fuzz::fail("a keypoint outside the image");
  }
  for (const float element : features.floats()) {
    if (!std::isfinite(element)) fuzz::fail("a descriptor that is not finite");
  }
  if (kind.pack(features).size() != features.size() * kind.stored_bytes()) fuzz::fail("features that no map can hold");
}

}  // namespace
}  // namespace visual_localization

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace visual_localization;
  static const cv::Mat grey = checkerboard();
  const std::string model = fuzz::inMemoryFile(data, size);
  fuzz::expect<ParameterError>([&] {
    Learned kind;
    kind.adopt(model);
    const std::unique_ptr<LocalExtractor> extractor = kind.makeExtractor(model);
    fuzz::expect<std::runtime_error>([&] {
      requireFeatures(extractor->extract(grey), kind, grey);
      fuzz::countRead();
    });
  });
  return 0;
}
