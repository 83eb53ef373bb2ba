#pragma once

#include <cstddef>

namespace visual_localization::test {

/// Calls of operator new of this program, which must link allocation_counter.cpp; OpenCV's images are not counted.
std::size_t allocations();

}  // namespace visual_localization::test
