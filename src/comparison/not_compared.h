// What a comparison leaves out, and why.
#pragma once

#include "comparison/comparison.h"

namespace mbv {

/// Notes what one would expect to be judged and is not; of pairs and witnesses as measured so far.
void AddNotCompared(const ComparisonInput& input, Comparison* comparison);

}  // namespace mbv
