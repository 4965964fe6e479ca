// Numbers written as expressions of named parameters: "sqrt(q_home^2 - (b-a)^2)".
//
// The language is muParser's: + - * / ^, comparisons, ?:, && ||, and its functions (sin, atan2,
// sqrt, min, …); angles are radians; `pi` is known. Parameters may refer to each other in any
// order; cycles are errors.
#pragma once

#include <map>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "model_file/yaml/units.h"

namespace mbv {

/// A value, or why there is none. `error` is empty when the cause is a parameter whose own error is
/// reported at its own place.
struct ExpressionResult {
  std::optional<double> value;
  std::string error;
  std::string hint;
};

/// An expression of variables, compiled once.
class Formula {
 public:
  virtual ~Formula() = default;
  /// Its value; not finite where it has none. `variables` as they were named, in order.
  [[nodiscard]] virtual double At(std::span<const double> variables) const = 0;

  // Where a comparison, abs, sign, min, max or rint decides between formulas, each is smooth on one
  // branch and may have a corner or a jump to the next.

  /// True if a variable decides.
  [[nodiscard]] virtual bool has_branches() const = 0;
  /// Number of the branch that holds there, >= 0.
  [[nodiscard]] virtual int BranchAt(std::span<const double> variables) const = 0;
  /// By the formula of this branch, also where another one holds; by that one where the first has
  /// no finite value.
  [[nodiscard]] virtual double OnBranch(int branch, std::span<const double> variables) const = 0;
};
/// A formula, or why there is none (as ExpressionResult).
struct FormulaResult {
  std::shared_ptr<const Formula> formula;
  std::string error;
  std::string hint;
};

/// Parameters of one level: of the model, or of an instance of a part (which also sees outwards).
class Scope {
 public:
  explicit Scope(Scope* outer = nullptr) : outer_(outer) {}

  /// Defines the name as the value of an expression, which is in `unit`, evaluated when first asked
  /// for. Replaces an earlier definition.
  void Define(const std::string& name, std::string expression, const UnitSuffix& unit = kPlain);
  void Set(const std::string& name, double value);

  /// Value of a parameter of this level or further out. A failed parameter gives its error the
  /// first time it is asked for by Lookup and no text when an expression refers to it.
  ExpressionResult Lookup(const std::string& name);
  ExpressionResult Evaluate(const std::string& expression);
  /// An expression of parameters, which are constants, and of variables, which hide parameters.
  FormulaResult Compile(const std::string& expression, const std::vector<std::string>& variables);

  /// All visible names, for "did you mean".
  [[nodiscard]] std::vector<std::string> Names() const;
  [[nodiscard]] bool Has(const std::string& name) const { return entries_.count(name) > 0; }

 private:
  enum class State { kWaiting, kEvaluating, kDone, kFailed };
  struct Entry {
    std::string expression;
    UnitSuffix unit = kPlain;
    State state = State::kWaiting;
    ExpressionResult result;
  };
  // The parameters that an expression uses, by name; `variables` are none.
  struct Constants {
    std::map<std::string, double> values;
    ExpressionResult failed;  // without a value: what hinders
    bool good = false;
  };
  Constants ConstantsOf(const std::string& expression, const std::vector<std::string>& variables);
  // The value of a name that an expression uses; kFailed entries stay silent.
  ExpressionResult Use(const std::string& name);
  void EvaluateEntry(const std::string& name, Entry* entry);

  Scope* outer_;
  std::map<std::string, Entry> entries_;
  std::vector<std::string> evaluating_;  // chain of names, to find cycles
};

/// True where an expression refers to no parameter: a number, or "pi/3".
[[nodiscard]] bool IsWrittenOut(const std::string& expression);

/// Products of a few larger numbers overflow.
inline constexpr double kLargestNumber = 1e30;
/// Empty if a model may contain this number, else why not ("is not a finite number").
[[nodiscard]] std::string NotANumberReason(double value);

/// Empty if `name` may name a parameter, else why not ("'2a' is not a name: …").
[[nodiscard]] std::string InvalidNameReason(const std::string& name);

}  // namespace mbv
