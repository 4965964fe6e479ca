// A formula of named numbers that differentiates: "sqrt(l^2 - (r*sin(theta))^2)".
//
// The language is that of expressions in model files (model_file/yaml/expressions.h): + - * / ^,
// comparisons, && ||, ?:, and its functions; angles are radians. In addition NAME_d and NAME_dd are
// rate and acceleration of a name, and d(NAME, VARIABLE) is a partial derivative; what these give
// has no derivatives of its own.
#pragma once

#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include "math/profile.h"

namespace mbv {

/// Where a formula is no formula.
struct FormulaError {
  size_t at = 0;  ///< character, from 0
  std::string message, hint;
};

class DifferentiableFormula {
 public:
  /// Numbers that a formula refers to: by index of the names that Compile() got.
  struct Values {
    std::vector<Jet> names;                      ///< value, rate, acceleration
    std::vector<std::vector<double>> partial{};  ///< [name][variable]; may be empty
  };

  /// `names`: what it may refer to; `variables`: those of d(NAME, VARIABLE).
  [[nodiscard]] static DifferentiableFormula Compile(std::string_view text,
                                                     const std::vector<std::string>& names,
                                                     const std::vector<std::string>& variables,
                                                     std::vector<FormulaError>* errors);
  /// NaN outside of a function's domain.
  [[nodiscard]] Jet At(const Values& values) const;
  /// Names that it refers to, by index.
  [[nodiscard]] const std::vector<int>& used() const { return used_; }

 private:
  friend class FormulaParser;
  enum class Op {
    kNumber,
    kName,
    kRate,
    kAcceleration,
    kPartial,
    kAdd,
    kSubtract,
    kMultiply,
    kDivide,
    kPower,
    kNegate,
    kLess,
    kLessEqual,
    kGreater,
    kGreaterEqual,
    kEqual,
    kNotEqual,
    kAnd,
    kOr,
    kChoose,
    kCall
  };
  struct Node {
    Op op = Op::kNumber;
    int a = -1, b = -1, c = -1;  // operands (nodes); of names: name, variable; of calls: function
    double number = 0.0;
  };
  [[nodiscard]] Jet Evaluate(int node, const Values& values) const;

  std::vector<Node> nodes_;
  int root_ = -1;
  std::vector<int> used_;
};

}  // namespace mbv
