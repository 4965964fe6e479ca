// What another version of MuJoCo changes for a scenario's model (docs/how-to/upgrade_mujoco.md):
// the equality rows at states of its motion, and the drive forces and loop gaps of stepping it as
// it is.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "core/diagnostics.h"
#include "pipeline/progress.h"
#include "report/upgrade.h"
#include "scenario/load_scenario.h"

namespace mbv {

struct UpgradeOptions {
  std::vector<std::string> command = {"mbverify-witness-mujoco"};  ///< runs the other version
  ScenarioOptions scenario = {};
  ProgressFunction progress = {};
};

struct UpgradeOutcome {
  int exit_code = 4;  ///< 0 compared, 2 bad input, 3 could not run
  Diagnostics diagnostics;
  std::string failure;                  ///< why it could not run; "" otherwise
  std::optional<UpgradeReport> report;  ///< with exit code 0, and with 3 if the program said why
};

/// Of commanded motions, by the reference's forces.
[[nodiscard]] UpgradeOutcome Upgrade(const std::string& file, const UpgradeOptions& options);

}  // namespace mbv
