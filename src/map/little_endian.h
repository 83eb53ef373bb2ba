#pragma once

#include <cstddef>
#include <cstdint>
#include <cstring>

/// Numbers as bytes, in one order on every machine.
namespace visual_localization::map_schema {

template <class Unsigned>
void putLittleEndian(Unsigned value, std::uint8_t* to) {
  for (std::size_t i = 0; i < sizeof(value); ++i) to[i] = static_cast<std::uint8_t>(value >> (8 * i));
}

template <class Unsigned>
Unsigned getLittleEndian(const std::uint8_t* from) {
  Unsigned value = 0;
  for (std::size_t i = 0; i < sizeof(value); ++i) value = static_cast<Unsigned>(value | Unsigned{from[i]} << (8 * i));
  return value;
}

inline void putFloat(float value, std::uint8_t* to) {
  std::uint32_t bits = 0;
  std::memcpy(&bits, &value, sizeof(bits));
  putLittleEndian(bits, to);
}

inline float getFloat(const std::uint8_t* from) {
  const auto bits = getLittleEndian<std::uint32_t>(from);
  float value = 0.0F;
  std::memcpy(&value, &bits, sizeof(value));
  return value;
}

inline void putDouble(double value, std::uint8_t* to) {
  std::uint64_t bits = 0;
  std::memcpy(&bits, &value, sizeof(bits));
  putLittleEndian(bits, to);
}

inline double getDouble(const std::uint8_t* from) {
  const auto bits = getLittleEndian<std::uint64_t>(from);
  double value = 0.0;
  std::memcpy(&value, &bits, sizeof(value));
  return value;
}

}  // namespace visual_localization::map_schema
