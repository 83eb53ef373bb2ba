// What every file needs that is compiled once for each kind of CPU. It says which file it is, and includes this:
//   #undef HWY_TARGET_INCLUDE
//   #define HWY_TARGET_INCLUDE "folder/file.cpp"
//   #include "features/highway.h"
// foreach_target.h then includes that file for each kind of CPU, and HWY_DYNAMIC_DISPATCH takes the best one at run
// time. So this has no include guard: highway.h is read anew each time.

// Vectors whose length is not known to the compiler cannot be kept in arrays, as it is done here.
#define HWY_DISABLED_TARGETS (HWY_SVE | HWY_SVE2 | HWY_SVE_256 | HWY_SVE2_128 | HWY_RVV)
// VNNI for the files that ask for it; GCC 10 does not know all that Highway 1.0 asks for there.
#if defined(VISUAL_LOCALIZATION_WANT_VNNI) && (defined(__clang__) || !defined(__GNUC__) || __GNUC__ >= 11)
#define HWY_WANT_AVX3_DL
#endif

#include <hwy/aligned_allocator.h>
#include <hwy/cache_control.h>
#include <hwy/foreach_target.h>
#include <hwy/highway.h>
