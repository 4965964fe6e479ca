// Validation of a computed force against a measured one [ASME V&V 20-2009, sections 1 and 5].
//
//   E = S − D                                   comparison error of each sample
//   u_val² = u_num² + u_input² + u_D²           its standard uncertainty
//   E − k u_val ≤ δ_model ≤ E + k u_val         what the model's own error lies within
//
// u_val is the validation level: a model error that is smaller cannot be seen in these data.
#pragma once

#include <string>
#include <vector>

#include "base/types.h"
#include "features/study/design.h"

namespace mbv {

/// A drive's force over time in SI, with standard uncertainties of each sample.
struct ForceComparison {
  std::string drive, unit;
  std::vector<double> time_s, computed, measured;
  std::vector<double> u_input;  ///< of the computed force: deviation over all points
  std::vector<double> u_data;   ///< of the measured one
  double u_num = 0.0;           ///< of the computed force: of its scheme
};

struct DriveValidation {
  ForceComparison forces;
  std::vector<double> u_val;                                         ///< per sample
  double error_mean = kNan, error_rms = kNan, measured_rms = kNan;   ///< of E and D
  double u_num = kNan, u_input = kNan, u_data = kNan, level = kNan;  ///< RMS; level: of u_val
  size_t outside = 0;        ///< samples with |E| > k u_val, and those that are not a number
  const char* largest = "";  ///< which part makes most of u_val²
  double share = 0.0;        ///< that may be outside

  [[nodiscard]] size_t samples() const { return forces.time_s.size(); }
  [[nodiscard]] bool pass() const {
    return samples() > 0 && static_cast<double>(outside) <= share * static_cast<double>(samples());
  }
};

struct StudyValidationResult {
  std::vector<DriveValidation> drives = {};
  std::string table;      ///< file name of the measured forces
  std::string numerical;  ///< where u_num is from, to read
  std::string trouble;    ///< why there is no result; "" if there is one

  [[nodiscard]] bool pass() const;
};

/// Lists of the same length.
[[nodiscard]] DriveValidation Validate(ForceComparison forces, const StudyValidation& settings);

/// Standard deviations over all points at each time: `samples[p][t]`; NaN of fewer than two.
[[nodiscard]] std::vector<double> DeviationsOverPoints(
    const std::vector<std::vector<float>>& samples, size_t times);

}  // namespace mbv
