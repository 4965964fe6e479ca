// Report: everything one run gave, and its writers (value → text).
//
// The formats are described in docs/reference/scenario_file.md; summary.json carries its version in
// `schema`.
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "base/inputs.h"
#include "base/run_summary.h"
#include "comparison/comparison.h"
#include "comparison/contact_load.h"
#include "comparison/motor_load.h"
#include "kinematics/singularity.h"
#include "math/trace.h"
#include "mechanism/mechanism.h"
#include "mechanism/motion.h"
#include "report/document.h"
#include "report/result.h"

namespace mbv {

struct SourceModelAudit;  // report/source_model_report.h

/// One witness' part in a run.
struct WitnessRecord {
  std::string name;                              ///< of its role (base/roles.h)
  RunSummary summary;                            ///< kNotRun with the reason if it was switched off
  Trace trace;                                   ///< empty if it did not run
  std::optional<Witness::Foreign> foreign = {};  ///< of a program outside
  WitnessGap gap = WitnessGap::kNone;            ///< why it gave nothing though it was asked
  bool required = false;                         ///< by the scenario
};

/// One engine's error against the truth that all are judged by.
struct EngineError {
  std::string engine;  ///< "defaults", "stock" or "corrected"
  double force_nrmse = kNan, force_max_rel = kNan, closure_max_m = kNan;
  double force_nrmse_later = kNan;  ///< without the first EngineComparison::later_s
  std::string failure = {};         ///< why it gave nothing; "" if it ran
};
/// How far a free motion with dry friction is off where MuJoCo's own frictionloss does all of it.
struct FrictionError {
  double step_s = kNan;
  std::string check = {}, unit = {};  ///< of the motion: what it misses farthest, as a share of …
  double value = kNan, limit = kNan;  ///< … its limit
  std::string failure = {};           ///< why it gave nothing; "" if it ran

  [[nodiscard]] bool within() const { return failure.empty() && value <= limit; }
};

/// The simulator's own modelling error: MuJoCo as it is, by default and by the best recipe from
/// outside, and with the corrections, judged against another witness.
struct EngineComparison {
  std::string truth;     ///< witness by which all are judged
  double later_s = 0.1;  ///< when soft constraints have taken up the load
  std::vector<EngineError> engines;
  std::vector<FrictionError> friction = {};  ///< from the scenario's step to smaller ones
  bool coulomb_alone = false;                ///< there: breakaway and Stribeck's curve left out

  /// Of `friction`: the error at the scenario's step, and which step tried is within the limit.
  [[nodiscard]] std::string FrictionText() const;
  /// What a report calls an engine.
  [[nodiscard]] static const char* NameOf(const std::string& engine);
};

/// What smoothing the tables of a motion changes of one drive's force, by the reference.
struct SmoothedForce {
  std::string drive, unit;
  double rms = kNan;                            ///< of the force along the smooth motion
  double change_rms = kNan, change_max = kNan;  ///< against the motion through all rows
};

/// A part of the motion with the same feet on the ground. Rows of the joined traces at the instant
/// between two phases are those of the phase that begins; both were judged there.
struct PhaseLine {
  std::string name = {};
  double from_s = kNan, to_s = kNan;
  std::vector<std::string> contacts = {};
  Verdict verdict = Verdict::kNotRun;
  std::string reason = {};
  std::string worst_check = {};  ///< of those with a limit; "" without one
  double worst_use = kNan;       ///< its value over its limit
};

/// What a product adds to a run.
struct ReportPart {
  std::string key;  ///< in summary.json
  ReportSection section;
  std::string json;
};

/// Of a motion.
struct Report : ResultFrame {
  std::vector<std::string> drives;   ///< model order
  std::vector<std::string> symbols;  ///< of the drives; "": they have none (Drive::symbol)
  std::string simulation;            ///< one line: mode, step, engine
  std::string mode;                  ///< "forward", "inverse", "force_driven", "servo", "off"
  std::string engine = "corrected";  ///< or "stock"
  double step_s = kNan;
  double duration_s = kNan, sample_s = kNan;
  double start_window_s = 0.0;  ///< left out of the force metrics
  std::string driven_by;
  std::vector<std::string> drives_not_unique;  ///< they share their forces by least norm
  /// Drives and prescribed joints whose force MuJoCo finds not unique; one choice is recorded.
  std::vector<std::string> simulated_not_unique;
  /// Channels of reactions that statics leaves open.
  std::vector<std::string> reactions_not_unique;
  std::vector<WitnessRecord> witnesses;
  Comparison comparison;
  std::vector<SignalSheet> sheets;
  std::vector<MotionTable> tables;             ///< that command the motion
  std::vector<SmoothedForce> smoothed_forces;  ///< empty where none is smoothed
  std::vector<Motor> motors;                   ///< of the model
  std::vector<MotorLoad> motor_loads;          ///< by witness that ran, then by motor
  std::vector<DriveFacts> drive_facts;         ///< by motor
  std::optional<DcLink> dc_link;               ///< of the model
  std::vector<LinkLoad> link_loads;            ///< of it, by witness that ran
  std::optional<EngineComparison> engine_comparison;
  std::shared_ptr<const SourceModelAudit> source_model;  ///< of a robot's MJCF; null without one
  std::vector<ReportPart> parts = {};
  std::vector<std::string> pictures;  ///< file names below snapshots/
  SingularApproaches singular;        ///< of the motion
  /// By phase, by witness that ran, then by contact, then all.
  std::vector<ContactLoad> contact_loads;
  std::vector<PhaseLine> phases = {};  ///< empty of a motion without
};

/// summary.json.
[[nodiscard]] std::string ToJson(const Report& report);

/// traces.csv: time_s; per drive the four channels of each witness; then each witness' further
/// channels. 17 significant digits, "nan" for missing values.
[[nodiscard]] std::string ToCsv(const Report& report);

/// The verdict table for a terminal.
[[nodiscard]] std::string ToTable(const Report& report, const TableOptions& options);

[[nodiscard]] ResultView ViewOf(const Report& report);

/// What a witness recorded; null if it did not run.
[[nodiscard]] const Trace* TraceOf(const Report& report, const std::string& witness);

/// Says of the main pair how many samples are bands, and how they count; "" if none.
[[nodiscard]] std::string AtRestText(const Comparison& comparison);

/// mechanisms' force signals and the reactions that were compared.
[[nodiscard]] std::vector<SignalSheet> SheetsOf(const Mechanism& mechanism,
                                                const Comparison& comparison);

// traces.csv in pieces.

/// ToCsv() piece by piece, in their order: the whole text may be larger than all that it is made
/// of.
void WriteCsv(const Report& report, const std::function<void(std::string_view)>& write);

/// What the columns of traces.csv are, as CSV on the Web [W3C 2015] has it: name, unit, quantity,
/// subject and frame of each.
[[nodiscard]] std::string CsvMetadata(const Report& report);
inline constexpr const char* kCsvMetadataFile = "traces.csv-metadata.json";

}  // namespace mbv
