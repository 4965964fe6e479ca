// What another version of MuJoCo makes of a generated model: rows, forces, loop gaps, and the known
// changes that explain them.
#pragma once

#include <string>
#include <vector>

#include "core/types.h"

namespace mbv {

/// The equality rows of one kind, over all states that were looked at.
struct RowChange {
  std::string kind;                                  ///< "connect", "weld", "joint" or "tendon"
  int rows = 0;                                      ///< of one state
  double softness_least = 1.0, softness_most = 1.0;  ///< R new / R old
  double velocity_term = 0.0;                        ///< largest |J̇q̇| [m/s², rad/s²]
  double left_out_old = 0.0, left_out_new = 0.0;     ///< largest |J̇q̇ − β| of each version
  std::string why;  ///< the changes behind it, by version; "nothing changed"; or "not explained"
};

/// The drive forces and loops of one way to run the model.
struct ForceChange {
  std::string how;  ///< "mj_forward at consistent states", "best recipe from outside", …
  double nrmse_old = kNan, nrmse_new = kNan;  ///< of all drive forces, against the reference
  double gap_old_m = kNan, gap_new_m = kNan;  ///< largest loop gap
  std::string why_old, why_new;               ///< why there is no number; "" if there is
};

struct UpgradeReport {
  std::string mechanism, scenario;
  std::string version_old, version_new;
  std::string unavailable;            ///< why the other version did not answer; "" if it did
  std::vector<std::string> messages;  ///< what it says of the file that it loads
  size_t states = 0;
  std::vector<RowChange> rows;
  std::vector<ForceChange> forces;
};

[[nodiscard]] std::string ToText(const UpgradeReport& report);
/// `schema: mbverify.upgrade/1`.
[[nodiscard]] std::string ToJson(const std::vector<UpgradeReport>& reports);

}  // namespace mbv
