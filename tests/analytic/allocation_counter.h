// Counts heap allocations of the whole test program, to prove that a loop makes none.
#pragma once

#include <cstddef>

namespace mbv {

/// Calls of operator new since the program started.
[[nodiscard]] std::size_t AllocationCount();

}  // namespace mbv
