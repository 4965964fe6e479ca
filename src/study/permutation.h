// A random permutation of 0 … n − 1 that is evaluated where it is asked for, without a table.
#pragma once

#include <cstdint>

namespace mbv {

/// Where `index` < `count` goes: a Feistel network on the next larger even number of bits, walked
/// until it is below `count` [Black, Rogaway 2002, "Ciphers with arbitrary finite domains"].
[[nodiscard]] std::uint64_t Permuted(std::uint64_t index, std::uint64_t count, std::uint64_t key);

}  // namespace mbv
