#include "features/study/validation.h"

#include <algorithm>
#include <cmath>

#include "base/demand.h"

namespace mbv {
namespace {

double RmsOf(const std::vector<double>& values) {
  double sum = 0.0;
  for (const double value : values) sum += value * value;
  return std::sqrt(sum / static_cast<double>(values.size()));
}

const char* LargestOf(const DriveValidation& v) {
  if (v.u_data >= v.u_input && v.u_data >= v.u_num) return "u_D";
  return v.u_input >= v.u_num ? "u_input" : "u_num";
}

}  // namespace

bool StudyValidationResult::pass() const {
  return trouble.empty() && !drives.empty() &&
         std::all_of(drives.begin(), drives.end(),
                     [](const DriveValidation& drive) { return drive.pass(); });
}

DriveValidation Validate(ForceComparison forces, const StudyValidation& settings) {
  DriveValidation v;
  v.forces = std::move(forces);
  v.share = settings.share;
  const ForceComparison& f = v.forces;
  const size_t samples = f.time_s.size();
  MBV_DEMAND(samples > 0 && f.computed.size() == samples && f.measured.size() == samples, samples);
  MBV_DEMAND(f.u_input.size() == samples && f.u_data.size() == samples, samples);
  std::vector<double> errors;
  double sum = 0.0;
  for (size_t t = 0; t < samples; ++t) {
    const double error = f.computed[t] - f.measured[t];
    v.u_val.push_back(std::hypot(f.u_num, f.u_input[t], f.u_data[t]));
    if (!(std::abs(error) <= settings.coverage * v.u_val.back())) ++v.outside;
    errors.push_back(error);
    sum += error;
  }
  v.error_mean = sum / static_cast<double>(samples);
  v.error_rms = RmsOf(errors);
  v.measured_rms = RmsOf(f.measured);
  v.u_num = f.u_num;
  v.u_input = RmsOf(f.u_input);
  v.u_data = RmsOf(f.u_data);
  v.level = RmsOf(v.u_val);
  v.largest = LargestOf(v);
  return v;
}

std::vector<double> DeviationsOverPoints(const std::vector<std::vector<float>>& samples,
                                         size_t times) {
  std::vector<double> deviations(times, kNan);
  if (samples.size() < 2) return deviations;
  const auto count = static_cast<double>(samples.size());
  for (size_t t = 0; t < times; ++t) {
    double mean = 0.0, squares = 0.0;
    for (const auto& point : samples) mean += static_cast<double>(point[t]) / count;
    for (const auto& point : samples) {
      const double off = static_cast<double>(point[t]) - mean;
      squares += off * off;
    }
    deviations[t] = std::sqrt(squares / (count - 1.0));
  }
  return deviations;
}

}  // namespace mbv
