// Engines side by side: how far each one's drive forces are from the reference's, and what a sample
// costs it.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "base/diagnostics.h"
#include "base/types.h"
#include "cli/options.h"
#include "external/motion_text.h"
#include "report/report.h"
#include "scenario/load_scenario.h"
#include "simulation/engine/row_survey.h"
#include "verify/run_witnesses.h"

namespace mbv {

/// One engine on one scenario.
struct CrosscheckRow {
  std::string mechanism, scenario;
  std::string engine;         ///< "closed form", "MuJoCo, default softness, …", "simbody"
  std::string program;        ///< of a foreign witness, as it calls itself: "Simbody 3.7"
  double force_nrmse = kNan;  ///< of all drive forces, against the generic reference
  double pose_m = kNan;       ///< outputs' origins, against the generic reference
  double loop_gap_m = kNan;   ///< its own largest; NaN if it reports none
  /// Processor time by samples, of its computation or of its whole run; NaN where it is not timed
  /// alone.
  double sample_us = kNan;
  std::string why;  ///< why there is no value; "" if there is
};

/// `witnesses:` of engines NAME=COMMAND, in place of the scenarios' own; empty where one is not
/// written so.
[[nodiscard]] std::optional<SetValue> WitnessesOf(const std::vector<std::string>& engines);

/// Every engine of a run but the reference itself.
[[nodiscard]] std::vector<CrosscheckRow> CrosscheckRows(const Report& report);

[[nodiscard]] std::string ToText(const std::vector<CrosscheckRow>& rows);
/// Forces' and poses' differences, loop gaps and cost: a table each, with a row per scenario and a
/// column per engine.
[[nodiscard]] std::string ToMarkdown(const std::vector<CrosscheckRow>& rows);
[[nodiscard]] std::string ToCsv(const std::vector<CrosscheckRow>& rows);
/// A page with a table per scenario: all numbers of every engine.
[[nodiscard]] std::string ToHtml(const std::vector<CrosscheckRow>& rows);
/// `schema: mbverify.crosscheck/1`.
[[nodiscard]] std::string ToJson(const std::vector<CrosscheckRow>& rows);

// What another version of MuJoCo changes for a scenario's model (docs/how-to/upgrade_mujoco.md):
// the equality rows at states of its motion, and the drive forces and loop gaps of stepping it as
// it is.

// What another version of MuJoCo makes of a generated model: rows, forces, loop gaps, and the known
// changes that explain them.

/// The equality rows of one kind, over all states that were looked at.
struct RowChange {
  std::string kind;                                  ///< "connect", "weld", "joint" or "tendon"
  int rows = 0;                                      ///< of one state
  double softness_least = 1.0, softness_most = 1.0;  ///< R new / R old
  double velocity_term = 0.0;                        ///< largest |J̇q̇| [m/s², rad/s²]
  double left_out_old = 0.0, left_out_new = 0.0;     ///< largest |J̇q̇ − β| of each version
  std::string why =
      {};  ///< the changes behind it, by version; "nothing changed"; or "not explained"
};

/// The drive forces and loops of one way to run the model.
struct ForceChange {
  std::string how;  ///< "mj_forward at consistent states", "best recipe from outside", …
  double nrmse_old = kNan, nrmse_new = kNan;  ///< of all drive forces, against the reference
  double gap_old_m = kNan, gap_new_m = kNan;  ///< largest loop gap
  std::string why_old = {}, why_new = {};     ///< why there is no value; "" if there is
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

/// What `crosscheck --newest` is asked.
struct UpgradeArguments {
  std::vector<std::string> scenarios, set;
  std::string program;
  JsonOption json;
};
/// Its exit code.
[[nodiscard]] int RunUpgrade(const UpgradeArguments& arguments);

/// Of commanded motions, by the reference's forces.
[[nodiscard]] UpgradeOutcome Upgrade(const std::string& file, const UpgradeOptions& options);

// The equality rows of a model in two versions of MuJoCo, and the known changes behind differences.

/// One entry per kind of row, in the order in which they come. The answer's rows must be the
/// survey's, by name and number; else empty.
[[nodiscard]] std::vector<RowChange> CompareRows(const RowSurvey& survey, const RowAnswer& answer);

}  // namespace mbv
