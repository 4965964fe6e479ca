// What a run asks of the motors that a model states: for a terminal, report.html and summary.json.
#pragma once

#include <string>
#include <vector>

#include "base/json_text.h"
#include "report/report.h"

namespace mbv {

/// The loads of the witness that a reader looks at first; by motor.
[[nodiscard]] std::vector<const MotorLoad*> MainMotorLoads(const Report& report);

/// Lines for a terminal: a line per motor, with `details` several; empty without motors.
[[nodiscard]] std::vector<std::string> SizingLines(const Report& report, bool details);
/// Section of report.html: figures, and each motor's torque over speed against its curves.
[[nodiscard]] std::string SizingHtml(const Report& report);
/// `motors` of summary.json: of every witness.
[[nodiscard]] nlohmann::ordered_json SizingJson(const Report& report);

/// One motor over several runs: what is hardest, and where.
struct MotorEnvelope {
  struct Most {
    double value = 0.0;
    std::string scenario = {};
  };
  std::string drive = {}, torque_unit = {}, speed_unit = {};
  Most peak_torque = {}, rms_torque = {}, peak_speed = {};  ///< magnitudes
  Most peak_power = {}, brake_power = {}, use = {};
  std::string limited_by = {};  ///< of the largest use
  bool limited = false;         ///< the motor states a limit
  std::string unresolved = {};  ///< scenarios whose samples do not resolve the motion, and why

  [[nodiscard]] double margin() const { return 1.0 / use.value; }
};

/// Adds a run to the envelopes of its mechanism.
void Widen(const Report& report, std::vector<MotorEnvelope>* envelopes);
/// A table for a terminal, and as JSON (`schema: mbverify.sizing/1`).
[[nodiscard]] std::string ToText(const std::vector<MotorEnvelope>& envelopes);
[[nodiscard]] std::string ToJson(const std::vector<MotorEnvelope>& envelopes,
                                 const std::vector<std::string>& scenarios);

}  // namespace mbv
