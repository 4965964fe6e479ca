// Counts heap allocations of the whole test program, to prove that a loop makes none.
#pragma once

#include <cstddef>

namespace mbv {

/// Allocations from the heap since the program started: operator new, and Eigen's calls of malloc.
[[nodiscard]] std::size_t AllocationCount();

}  // namespace mbv
