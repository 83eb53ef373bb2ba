#pragma once

#include <cstdint>

#include <gtest/gtest.h>
#include <hwy/highway.h>

namespace visual_localization::test {

/// Vectors of `targets` alone are used from here on; of 0: all that the CPU has.
inline void useTargets(std::int64_t targets) {
  hwy::SetSupportedTargetsForTest(targets);
  hwy::GetChosenTarget().Update(hwy::SupportedTargets());
}

/// Calls `use` with each kind of vectors that this CPU has.
template <class Use>
void forEachTarget(Use use) {
  useTargets(0);
  const std::int64_t supported = hwy::SupportedTargets();
  for (int bit = 0; bit < 62; ++bit) {
    const std::int64_t target = std::int64_t{1} << bit;
    if ((supported & target) == 0) continue;
    SCOPED_TRACE(hwy::TargetName(target));
    useTargets(target);
    use();
  }
  useTargets(0);
}

}  // namespace visual_localization::test
