// What a run asks of the motors that a model states: for a terminal, report.html and summary.json.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "base/json_text.h"
#include "report/document.h"
#include "report/report.h"

namespace mbv {

/// The loads of the witness that a reader looks at first; by motor.
[[nodiscard]] std::vector<const MotorLoad*> MainMotorLoads(const Report& report);

/// The same of the DC link; null without one.
[[nodiscard]] const LinkLoad* MainLinkLoad(const Report& report);

/// What a witness asks of a mechanism's motors and their DC link, with the report's `drive_facts`.
void AddMotorLoads(const Mechanism& mechanism, const WitnessRecord& record,
                   const std::string& unresolved, Report* report);

/// Lines for a terminal: a line per motor and for the DC link, with `details` several; empty
/// without motors.
[[nodiscard]] std::vector<std::string> SizingLines(const Report& report, bool details);
/// Section of report.html: figures, and each motor's torque over speed against its curves.
[[nodiscard]] std::string SizingHtml(const Report& report);
/// `motors` of summary.json, and its `dc_link`: of every witness.
[[nodiscard]] nlohmann::ordered_json SizingJson(const Report& report);
[[nodiscard]] nlohmann::ordered_json LinkJson(const Report& report);

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

/// The DC link over several runs.
struct LinkEnvelope {
  MotorEnvelope::Most fed_back_J = {}, resistor_mean = {}, resistor_peak = {}, use = {};
  std::string limited_by = {};
  bool limited = false;

  [[nodiscard]] double margin() const { return 1.0 / use.value; }
};

/// Adds a run to the envelopes of its mechanism.
void Widen(const Report& report, std::vector<MotorEnvelope>* envelopes);
void Widen(const LinkLoad& load, const std::string& scenario,
           std::optional<LinkEnvelope>* envelope);
/// A table for terminals and pages; the link as a line; and as JSON (`schema: mbverify.sizing/1`).
[[nodiscard]] Table EnvelopeTable(const std::vector<MotorEnvelope>& envelopes);
[[nodiscard]] std::string ToText(const std::vector<MotorEnvelope>& envelopes);
[[nodiscard]] std::string ToText(const LinkEnvelope& link);
[[nodiscard]] std::string ToJson(const std::vector<MotorEnvelope>& envelopes,
                                 const std::optional<LinkEnvelope>& link,
                                 const std::vector<std::string>& scenarios);

}  // namespace mbv
