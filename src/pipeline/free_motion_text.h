// What a report says about a free motion.
#pragma once

#include <string>
#include <vector>

#include "mechanism/motion.h"
#include "reference/forward.h"

namespace mbv {

/// "free motion of 2 freedoms from crank = 0.8, rocker at rest at home".
[[nodiscard]] std::string FreeMotionText(const Mechanism& mechanism, const Motion& motion);

/// How far the reference's trajectory can be trusted: its own error, and the growth of differences.
[[nodiscard]] std::string TrustLine(const ForwardRun& run);

/// One sentence for each singular pose passed, at most five.
[[nodiscard]] std::vector<std::string> PassageTexts(const ForwardRun& run, double duration_s);

}  // namespace mbv
