// The numbers of a model file that may be wrong.
#pragma once

#include <string>
#include <vector>

#include "model_file/load_model.h"
#include "pipeline/mutation_bench.h"
#include "report/mutation_report.h"

namespace mbv {

/// A number of the model and what an error of 1 adds to it.
struct Bendable {
  std::string name, unit;
  NumberKind kind = NumberKind::kParameter;
  double value = kNan;
  double relative_to = kNan;  ///< the value; the largest one of its unit if that is zero

  /// With a relative error.
  [[nodiscard]] Replacement At(double error) const {
    return {name, kind == NumberKind::kLiteral, value + relative_to * error};
  }
  /// "10 % wrong", "10 % of 0.75 m instead of 0"
  [[nodiscard]] std::string Text(double error) const;
};

/// The model's own parameters, those of instances, and what the file writes out where masses,
/// places, axes, springs and gravity are stated. A literal 0, and 1 of an axis, are structure (an
/// axis, a plane) and no measured numbers; pictures, ranges, guesses and beams act on no force.
[[nodiscard]] std::vector<Bendable> BendablesOf(const Mechanism& mechanism,
                                                const std::vector<Literal>& literals);

}  // namespace mbv
