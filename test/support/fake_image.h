#pragma once

#include <cstddef>
#include <cstdint>

#include "visual_localization/localization/query_image.h"

namespace visual_localization::test {

/// An image without pixels: only how it compares matters.
class FakeImage : public QueryImage {
 public:
  void set(std::int64_t, const cv::Mat&) override {}
  bool isRepeated() const override { return false; }
  std::size_t localFeatures() override { return 100; }
  ImageReport report() const override { return {}; }
  const LocalFeatures* local() const override { return nullptr; }
  void configure(const FrontEndConfig&, const SimilarityConfig&) override {}
};

}  // namespace visual_localization::test
