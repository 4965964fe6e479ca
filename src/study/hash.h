// Random bits as a function of what they are for: no state, no order, the same on every machine.
#pragma once

#include <cstdint>

namespace mbv {

/// The output function of SplitMix64 [Steele, Lea, Flood 2014, "Fast splittable pseudorandom number
/// generators"].
[[nodiscard]] constexpr std::uint64_t MixBits(std::uint64_t x) {
  x += 0x9e3779b97f4a7c15ULL;
  x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9ULL;
  x = (x ^ (x >> 27)) * 0x94d049bb133111ebULL;
  return x ^ (x >> 31);
}
[[nodiscard]] constexpr std::uint64_t MixBits(std::uint64_t a, std::uint64_t b) {
  return MixBits(MixBits(a) ^ b);
}
[[nodiscard]] constexpr std::uint64_t MixBits(std::uint64_t a, std::uint64_t b, std::uint64_t c) {
  return MixBits(MixBits(a, b) ^ c);
}

/// The middle of one of 2^52 cells of (0, 1): never an end, where quantiles are infinite.
[[nodiscard]] constexpr double ShareOf(std::uint64_t bits) {
  return (static_cast<double>(bits >> 12) + 0.5) * 0x1p-52;
}

}  // namespace mbv
