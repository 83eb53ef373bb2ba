// Runs the benchmarks of a program, and says which vectors they are of. Memory is kept, not given back to the system
// and taken anew for each image: so OpenCV is at its best.
#include <cstdio>
#include <exception>

#include <benchmark/benchmark.h>
#include <malloc.h>

#include "features/vector_target.h"

int main(int argc, char** argv) {
  try {
    benchmark::AddCustomContext("vector_target", visual_localization::vectorTarget());
  } catch (const std::exception& error) {
    std::fprintf(stderr, "%s\n", error.what());
    return 2;
  }
  constexpr int kMost = 1 << 30;
  mallopt(M_MMAP_THRESHOLD, kMost);
  mallopt(M_TRIM_THRESHOLD, kMost);
  benchmark::Initialize(&argc, argv);
  if (benchmark::ReportUnrecognizedArguments(argc, argv)) return 2;
  benchmark::RunSpecifiedBenchmarks();
  return 0;
}
