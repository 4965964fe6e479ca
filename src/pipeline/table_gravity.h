// Was a table made with another value of g than the model has?
#pragma once

#include <string>

#include "mechanism/mechanism.h"
#include "mechanism/motion.h"
#include "table/table.h"

namespace mbv {

/// A sentence if the table's forces fit 9.80665, 9.81 or 9.8 m/s² clearly better than the model's
/// own, near value of g; "" otherwise. The reference is computed again with each. Such a table
/// differs by 3e-4 of the weight only, which tolerances of tables hide.
[[nodiscard]] std::string GravityDoubt(const Mechanism& mechanism, const Motion& motion,
                                       const AlignedTable& table, double start_window_s);

}  // namespace mbv
