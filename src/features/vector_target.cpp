#include "features/vector_target.h"

#include <cstdint>
#include <cstdlib>
#include <stdexcept>
#include <utility>
#include <vector>

#ifdef VISUAL_LOCALIZATION_HIGHWAY
#include <hwy/highway.h>
#endif

namespace visual_localization {
namespace {

constexpr const char* kVariable = "VISUAL_LOCALIZATION_TARGET";

/// What may be asked for on this processor, and Highway's bits of it.
std::vector<std::pair<std::string, std::int64_t>> choices() {
#ifdef VISUAL_LOCALIZATION_HIGHWAY
  std::vector<std::pair<std::string, std::int64_t>> all{{"portable", HWY_STATIC_TARGET}};
#if HWY_ARCH_X86
  // Not as Highway finds them: it asks for instructions that are not used here, and that Valgrind does not have.
  if (__builtin_cpu_supports("sse4.2")) all.emplace_back("SSE4", HWY_SSE4);
  if (__builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma") && __builtin_cpu_supports("bmi2")) {
    all.emplace_back("AVX2", HWY_AVX2);
  }
  const std::int64_t wider = hwy::SupportedTargets() & (HWY_AVX2 - 1);
  if (wider != 0) all.emplace_back("AVX-512", wider);
#elif HWY_ARCH_ARM
  if ((hwy::SupportedTargets() & HWY_NEON) != 0) all.emplace_back("NEON", HWY_NEON);
#endif
  return all;
#else
  return {{"portable", 0}};
#endif
}

/// Forces the target that the variable names, once; returns what is wrong with it.
std::string forceTarget() {
  const char* wanted = std::getenv(kVariable);
  if (wanted == nullptr) return "";
  std::string names;
  for (const auto& [name, targets] : choices()) {
    if (name == wanted) {
#ifdef VISUAL_LOCALIZATION_HIGHWAY
      hwy::SetSupportedTargetsForTest(targets);
#endif
      return "";
    }
    names += (names.empty() ? "" : ", ") + name;
  }
  return std::string(kVariable) + ": '" + wanted + "' is not one of " + names + ", which this processor has";
}

const std::string wrong_target = forceTarget();  // when the library is loaded: before any loop runs

}  // namespace

std::string vectorTarget() {
  if (!wrong_target.empty()) throw std::invalid_argument(wrong_target);
#ifdef VISUAL_LOCALIZATION_HIGHWAY
  const auto targets = hwy::SupportedTargets();
  const auto best = targets & -targets;  // the lowest bit
  return best == HWY_EMU128 || best == HWY_SCALAR ? "portable" : hwy::TargetName(best);
#else
  return "portable";
#endif
}

}  // namespace visual_localization
