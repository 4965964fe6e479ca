// The text of a mechanism's equations in C99 and Python.
#pragma once

#include <string>
#include <vector>

#include "features/code/mechanism_formulas.h"

namespace mbv {

/// A state with what the reference finds there.
struct TestState {
  VecX q, v, a;
  VecX more;  ///< forces along the coordinates that are given beyond the mechanism's own
  VecX actuators, rates, accelerations,
      forces;    ///< per actuator; forces: none if they are no function
  VecX along;    ///< forces along the coordinates, without `more`
  VecX outputs;  ///< six each
};

/// Start values for Newton's method over a box of q, and where they are proved to do.
struct StartTable {
  VecX low, high;               ///< of the box [rad or m]
  std::vector<int> nodes = {};  ///< per coordinate, at least 2
  MatX x = {};  ///< nodes × positions that are searched; the last coordinate runs fastest
  std::vector<int> cells = {};    ///< per coordinate
  std::vector<bool> proved = {};  ///< per cell
  int steps = 0;                  ///< of Newton's method
  double bound = kNan;            ///< of the error of x that is left [rad, or L] at proved cells
};

/// The actuators' positions at nodes, multilinear between them, with bounds of the errors of this
/// by interval arithmetic, in the cells where they are proved:
///   |m − m_I| <= Σ_i h_i²/8 max|∂_i² m|,  |∂_i m − ∂_i m_I| <= Σ_j h_j/2 max|∂_i ∂_j m|     (1)
struct LookupTable {
  VecX low, high;                 ///< [rad or m]
  std::vector<int> nodes = {};    ///< per coordinate
  MatX values = {};               ///< nodes × actuators; the last coordinate runs fastest
  std::vector<bool> proved = {};  ///< per cell
  VecX bound = {};                ///< per actuator: of its position
  MatX slope_bound = {};          ///< actuators × coordinates: of ∂m/∂q

  /// m_I and its slopes at q; false outside of what is proved.
  [[nodiscard]] bool At(const VecX& q, VecX* m, MatX* slopes) const;
};

struct CodeTextOptions {
  std::string name;                  ///< before all names in C
  std::vector<std::string> heading;  ///< comment lines
  std::vector<TestState> tests;
  double tolerance = 1e-9;  ///< of the closed loops, as RowFormula::residual
  std::optional<StartTable> table;
};

/// A text as a part of a comment or docstring that it does not end, on one line.
[[nodiscard]] std::string InComment(const std::string& text);

/// A header without library (but math.h) and heap.
[[nodiscard]] std::string CHeader(const MechanismFormulas& formulas,
                                  const CodeTextOptions& options);
/// C99 of a lookup table: NAME_lookup(q, m, J), without library and heap.
[[nodiscard]] std::string LookupHeader(const MechanismFormulas& formulas, const LookupTable& table,
                                       const CodeTextOptions& options);
/// The same functions in Python without packages.
[[nodiscard]] std::string PythonModule(const MechanismFormulas& formulas,
                                       const CodeTextOptions& options);

}  // namespace mbv
