/// Mostly changes bytes in place: the records of a bag point at each other, the parts of a model have their lengths in
/// front, and one byte more is the end of all of it.
#include <cstdint>
#include <random>

extern "C" std::size_t LLVMFuzzerMutate(std::uint8_t* data, std::size_t size, std::size_t max_size);

extern "C" std::size_t LLVMFuzzerCustomMutator(std::uint8_t* data, std::size_t size, std::size_t max_size,
                                               unsigned int seed) {
  constexpr std::size_t kLongest = 64;
  std::minstd_rand random(seed);
  if (size <= kLongest || random() % 8 == 0) return LLVMFuzzerMutate(data, size, max_size);
  const std::size_t length = 1 + random() % kLongest;
  LLVMFuzzerMutate(data + random() % (size - length + 1), length, length);
  return size;
}
