// What a mutation run found, and its writers.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "base/diagnostics.h"
#include "base/types.h"
#include "mechanism/mechanism.h"

namespace mbv {

// Structural faults: models of the simulated side with one thing wrong that is not a number.

/// One fault put into a copy of the model, or why the mechanism cannot have it.
struct StructuralFault {
  std::string kind;        ///< "swapped drives", "flipped axis", …
  std::string where = {};  ///< "limb1.drive and limb1.drive_p"; "" if not applicable
  /// Empty if not applicable. Of an assembly several candidates: the first that moves differently
  /// is the fault, the others are the same assembly after all.
  std::vector<Mechanism> wrong = {};
  std::string not_applicable = {};      ///< the reason, where there is no `wrong`
  std::string first = {}, second = {};  ///< the drives of a swap
  size_t alike = 0;  ///< further places that are the same by symmetry of parts, left out
};

/// Every fault of the list that applies, one per place (equal parts once), the others with reasons:
/// swapped drives, flipped axis of a drive, exchanged universal-joint axes, sign of products of
/// inertia, wrong assembly (elbow branch), missing closure, 9.80665 for 9.81.
[[nodiscard]] std::vector<StructuralFault> StructuralFaults(const Mechanism& mechanism);

/// What one way of running the scenario (its own mode, or inverse dynamics) shows of a number that
/// is wrong, larger and smaller by the same relative error. Where both ways run, the one that shows
/// less counts.
struct Detection {
  bool ran = false;            ///< false: neither way could be simulated; `reason` says why
  bool detected = false;       ///< both ways: a check failed, or the perturbed model could not run
  bool by_force = false;       ///< a drive-force check failed
  double force_change = kNan;  ///< drive-force error caused, relative (the NRMSE of the check)
  /// The smallest relative error from which on both ways were detected; one `resolution` smaller
  /// was not. NaN: not searched for, or nothing up to kLargestPerturbation was detected.
  double smallest = kNan;
  std::string best_check;  ///< the check that fails at `smallest` (or sees it first); "model" when
                           ///< the perturbed model is refused
  std::string only;        ///< "larger" or "smaller": the other way does not run
  std::string reason;      ///< why it did not run, or is not detected
};

/// Where a number stands in the model file.
enum class NumberKind { kParameter, kInstance, kLiteral };

/// One number of the model, perturbed on the simulated side only.
struct Mutation {
  std::string name, unit;  ///< "m_p", "limb2.azimuth", "parts.leg.bodies.rod.mass"
  NumberKind kind = NumberKind::kParameter;
  double value = kNan;
  /// What relative errors are relative to: the value, or if that is zero the largest one of its
  /// unit (1 if there is none).
  double relative_to = kNan;
  Detection own;                     ///< in the scenario's mode and by its limits
  std::optional<Detection> inverse;  ///< by inverse dynamics, where that is not its mode
  double proved_to = kNan;           ///< unseen: the largest relative error tried
  double sensitivity = kNan;         ///< unseen: largest drive-force change there, relative to the
                                     ///< RMS force
  std::string reason;                ///< why it is not detected
};

/// What one way of running shows of a structural fault.
struct FaultDetection {
  bool ran = false, detected = false;
  std::string check;                  ///< the failed check that is farthest beyond its limit
  double value = kNan, limit = kNan;  ///< of it
  std::string reason;                 ///< could not run, or why not detected
};

/// One structural fault.
struct FaultResult {
  std::string kind, where;
  bool applicable = false;  ///< false: `reason` says why the mechanism cannot have it
  size_t alike = 0;         ///< equal places by symmetry of parts that were not run
  FaultDetection own;
  std::optional<FaultDetection> inverse;
  std::string reason;  ///< not applicable
};

struct MutationReport {
  int exit_code = 4;  ///< 0 all detected or explained by no influence, 1 some missed, 2, 3 as run
  Diagnostics diagnostics;
  std::string scenario;
  std::string mode;  ///< of the scenario, "forward" or "inverse"
  double size = kNan, resolution = kNan;
  std::vector<Mutation> mutations;  ///< most sensitive first
  std::vector<FaultResult> faults;  ///< in the order of StructuralFaults()
  long runs = 0;                    ///< simulations
  double wall_s = 0.0;
};

/// Most sensitive numbers first.
void SortBySensitivity(MutationReport* report);

/// Tables, most sensitive first; Markdown when `markdown`.
[[nodiscard]] std::string ToText(const MutationReport& report, bool markdown);

/// The same for programs, schema "mbverify.mutate/2".
[[nodiscard]] std::string ToJson(const MutationReport& report);
/// Reads that back; empty if `text` is something else.
[[nodiscard]] std::optional<MutationReport> MutationReportOf(const std::string& text);

/// The reports of workers that shared the numbers and faults of one run, in their order: numbers
/// and faults k, k + n, k + 2n … come from part k of n. The worst exit code counts.
[[nodiscard]] MutationReport MergeParts(std::vector<MutationReport> parts);

}  // namespace mbv
