// What a paper reports of a model and of a run, as tables.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "kinematics/mobility.h"
#include "mechanism/mechanism.h"
#include "report/document.h"
#include "report/report.h"

namespace mbv {

/// A number as its author wrote it.
struct StatedNumber {
  std::string text, unit;  ///< "10.2", "deg"
  double value = kNan;     ///< SI
};

/// Name, value, unit, source and meaning. A value that stands in `stated` is written with its
/// digits there; one that was computed or set from outside with six digits at most.
[[nodiscard]] Table ParameterTable(const std::vector<Parameter>& parameters,
                                   const std::map<std::string, StatedNumber>& stated);
/// Bodies, joints, DOFs, redundant constraints, what drives and statics determine.
[[nodiscard]] Table MobilityTable(const Mechanism& mechanism, const MobilityReport& report);
/// Every check that has a limit: what is compared, value, limit, how it ended.
[[nodiscard]] Table CheckTable(const ResultView& view);
/// What the run asks of each motor; no rows without motors.
[[nodiscard]] Table SizingTable(const Report& report);

// The mobility report of `mbverify model` as text and as JSON.

/// Lines for the terminal.
[[nodiscard]] std::string MobilityText(const Mechanism& mechanism, const MobilityReport& report);

/// JSON, schema "mbverify.model/1": name, file, bodies, joints, DOFs, loops, redundant
/// constraints, undetermined forces.
[[nodiscard]] std::string MobilityJson(const Mechanism& mechanism, const MobilityReport& report);

}  // namespace mbv
