// What a foreign witness gives back: witness.json and traces.csv (docs/how-to/external_solvers.md).
//
// Both are untrusted input: whatever is wrong with them is a sentence about the witness, never an
// error of the scenario.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "math/trace.h"
#include "mechanism/mechanism.h"

namespace mbv {

inline constexpr const char* kWitnessSchema = "mbverify/witness/1";

/// witness.json.
struct WitnessAnswer {
  std::string program, version;
  std::string method;   ///< what computes, one sentence; may be empty
  std::string refused;  ///< why it does not compute this case; "" if it does
  std::vector<std::pair<std::string, std::string>> left_out = {};  ///< what it leaves out, and why
  double compute_s = kNan;  ///< processor time of its computation alone; NaN: not stated
};

/// Empty, with one sentence of trouble, for what is no such file.
[[nodiscard]] std::optional<WitnessAnswer> ReadAnswer(std::string_view json, std::string* trouble);

/// traces.csv: a heading of `time_s` and channel names, then one row per sample of `times_s`, in
/// any columns' order. Empty, with one sentence of trouble, where names are unknown or twice,
/// samples are missing or elsewhere, or something is not a finite number.
[[nodiscard]] std::optional<Trace> ReadWitnessTrace(std::string_view csv,
                                                    const Mechanism& mechanism,
                                                    const std::vector<double>& times_s,
                                                    std::string* trouble);

}  // namespace mbv
