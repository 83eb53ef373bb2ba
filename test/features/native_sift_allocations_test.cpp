// Counts what this test program takes from the heap.
#include <atomic>
#include <cstdlib>
#include <new>

#include <gtest/gtest.h>

#include "test/support/synthetic.h"
#include "visual_localization/features/native_sift_extractor.h"

namespace {

std::atomic<std::size_t> allocations{0};

void* counted(void* memory) {
  ++allocations;
  if (memory == nullptr) throw std::bad_alloc();
  return memory;
}

}  // namespace

void* operator new(std::size_t size) { return counted(std::malloc(size)); }
void* operator new(std::size_t size, std::align_val_t alignment) {
  const auto line = static_cast<std::size_t>(alignment);
  return counted(std::aligned_alloc(line, (size + line - 1) / line * line));
}
void operator delete(void* memory) noexcept { std::free(memory); }
void operator delete(void* memory, std::size_t) noexcept { std::free(memory); }
void operator delete(void* memory, std::align_val_t) noexcept { std::free(memory); }
void operator delete(void* memory, std::size_t, std::align_val_t) noexcept { std::free(memory); }

namespace visual_localization {
namespace {

TEST(NativeSift, AllocatesNothingOnceItHasSeenSuchImages) {
  const cv::Mat wall = test::wall(400, 240, 9);
  const cv::Mat images[] = {test::viewOf(wall, 0), test::viewOf(wall, 40), test::viewOf(wall, 80)};
  NativeSiftExtractor extractor{SiftConfig()};
  SiftFeatures features;
  for (int round = 0; round < 2; ++round) {  // there are two sets of buffers: the result's and the next result's
    for (const cv::Mat& image : images) extractor.extract(image, features);
  }
  const std::size_t before = allocations;
  for (const cv::Mat& image : images) extractor.extract(image, features);
  EXPECT_EQ(allocations, before);
  EXPECT_FALSE(features.empty());
  EXPECT_GT(before, 0U);
}

}  // namespace
}  // namespace visual_localization
