#pragma once

#include <cstddef>

namespace visual_localization::test {

/// How often this test program has taken memory from the heap. A program that asks links allocation_counter.cpp, which
/// puts counting operators new in the place of the standard library's; OpenCV's images are not counted.
std::size_t allocations();

}  // namespace visual_localization::test
