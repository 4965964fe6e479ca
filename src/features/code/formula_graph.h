// Formulas as a graph: simplified as they are built, each once, then differentiated, evaluated with
// numbers or intervals, and printed as statements that C99 and Python share.
#pragma once

#include <cmath>
#include <cstdint>
#include <string>
#include <unordered_map>
#include <utility>
#include <vector>

#include "base/types.h"

namespace mbv {

/// A formula of the graph that is open; a number by itself.
class Expr {
 public:
  Expr() : Expr(0.0) {}
  Expr(double value);  // NOLINT(google-explicit-constructor): a number is a formula
  [[nodiscard]] int id() const { return id_; }
  bool operator==(const Expr& other) const { return id_ == other.id_; }

 private:
  friend class FormulaGraph;
  struct ById {};
  Expr(ById /*tag*/, int id) : id_(id) {}
  int id_;
};

enum class FormulaOp : std::uint8_t {
  kNumber,
  kInput,
  kAdd,
  kSubtract,
  kMultiply,
  kDivide,
  kNegate,
  kRoot,
  kSine,
  kCosine,
  kAngle,  ///< atan2
  kExponential,
  kDirection  ///< sign of a, 0 where |a| <= b
};

/// One is open at a time in a thread, from its construction to its destruction; Expr are its.
class FormulaGraph {
 public:
  FormulaGraph();
  ~FormulaGraph();
  FormulaGraph(const FormulaGraph&) = delete;
  FormulaGraph& operator=(const FormulaGraph&) = delete;
  [[nodiscard]] static FormulaGraph& Open();

  /// A new one; `name` as printed: "x[3]".
  [[nodiscard]] Expr Input(const std::string& name);
  [[nodiscard]] Expr Number(double value);
  [[nodiscard]] Expr Make(FormulaOp op, Expr a, Expr b = Expr(0.0));

  [[nodiscard]] bool IsNumber(Expr of, double value) const {
    const Node& node = At(of);
    return node.op == FormulaOp::kNumber && node.value == value;
  }
  [[nodiscard]] bool IsZero(Expr of) const { return IsNumber(of, 0.0); }
  [[nodiscard]] size_t inputs() const { return names_.size(); }
  /// Which input it is.
  [[nodiscard]] size_t InputOf(Expr input) const { return static_cast<size_t>(At(input).a); }

  /// Σ ∂of/∂input · rate, for inputs with a rate; all others are constant.
  [[nodiscard]] std::vector<Expr> Derivatives(const std::vector<Expr>& of,
                                              const std::vector<std::pair<Expr, Expr>>& rates);
  /// The largest parts of formulas that do not contain `moving` inputs, but for numbers.
  [[nodiscard]] std::vector<Expr> FixedParts(const std::vector<Expr>& of,
                                             const std::vector<Expr>& moving) const;
  /// Sines and cosines of inputs in them.
  [[nodiscard]] std::vector<Expr> WavesOf(const std::vector<Expr>& of) const;

 private:
  friend class FormulaTape;
  friend class FormulaText;
  struct Node {
    FormulaOp op = FormulaOp::kNumber;
    int a = -1, b = -1;
    double value = 0.0;
  };
  struct Hash {
    size_t operator()(const Node& node) const;
  };
  struct Same {
    bool operator()(const Node& a, const Node& b) const;
  };
  [[nodiscard]] const Node& At(Expr of) const { return nodes_[static_cast<size_t>(of.id_)]; }
  [[nodiscard]] Expr Find(const Node& node);
  /// True per node that the formulas are made of.
  [[nodiscard]] std::vector<bool> Needed(const std::vector<Expr>& of) const;

  std::vector<Node> nodes_;
  std::vector<std::string> names_;  ///< of inputs
  std::unordered_map<Node, int, Hash, Same> known_;
};

inline Expr operator+(Expr a, Expr b) { return FormulaGraph::Open().Make(FormulaOp::kAdd, a, b); }
inline Expr operator-(Expr a, Expr b) {
  return FormulaGraph::Open().Make(FormulaOp::kSubtract, a, b);
}
inline Expr operator*(Expr a, Expr b) {
  return FormulaGraph::Open().Make(FormulaOp::kMultiply, a, b);
}
inline Expr operator/(Expr a, Expr b) {
  return FormulaGraph::Open().Make(FormulaOp::kDivide, a, b);
}
inline Expr operator-(Expr a) { return FormulaGraph::Open().Make(FormulaOp::kNegate, a); }
inline Expr& operator+=(Expr& a, Expr b) { return a = a + b; }
inline Expr& operator-=(Expr& a, Expr b) { return a = a - b; }
inline Expr& operator*=(Expr& a, Expr b) { return a = a * b; }
inline Expr& operator/=(Expr& a, Expr b) { return a = a / b; }
inline Expr sqrt(Expr a) { return FormulaGraph::Open().Make(FormulaOp::kRoot, a); }
inline Expr sin(Expr a) { return FormulaGraph::Open().Make(FormulaOp::kSine, a); }
inline Expr cos(Expr a) { return FormulaGraph::Open().Make(FormulaOp::kCosine, a); }
inline Expr exp(Expr a) { return FormulaGraph::Open().Make(FormulaOp::kExponential, a); }
inline Expr atan2(Expr s, Expr c) { return FormulaGraph::Open().Make(FormulaOp::kAngle, s, c); }

/// Formulas to evaluate many times. T: double, or an interval type with these functions.
class FormulaTape {
 public:
  explicit FormulaTape(const std::vector<Expr>& of);
  /// `inputs` and `results` in order; `work` is kept between calls. No formula may contain
  /// kDirection where T is an interval.
  template <typename T>
  void Evaluate(const std::vector<T>& inputs, std::vector<T>* work, std::vector<T>* results) const;

 private:
  struct Step {
    FormulaOp op;
    size_t a, b;
    double value;
  };
  std::vector<Step> steps_;
  std::vector<size_t> results_;
};

/// Statements "e1 = a*b" and what stands for each formula; a formula that is used twice has a name.
class FormulaText {
 public:
  /// `call`: the sign function. `given`: parts that have values already, as GIVEN[0] ….
  FormulaText(const std::vector<Expr>& of, const std::string& call,
              const std::vector<Expr>& given = {}, const std::string& given_name = "");
  [[nodiscard]] const std::vector<std::pair<std::string, std::string>>& statements() const {
    return statements_;
  }
  [[nodiscard]] const std::vector<std::string>& results() const { return results_; }
  /// Whether any of these inputs or given parts is in them.
  [[nodiscard]] bool Uses(const std::vector<Expr>& parts) const;

 private:
  [[nodiscard]] std::string TextOf(int id, int binding);
  const FormulaGraph& graph_;
  const std::string& call_;
  std::vector<int> uses_;  ///< per node
  std::vector<std::string> named_;
  std::vector<std::pair<std::string, std::string>> statements_;
  std::vector<std::string> results_;
};

/// With all digits and a point: "0.5", "1.0", "1e-05".
[[nodiscard]] std::string NumberText(double value);

template <typename T>
void FormulaTape::Evaluate(const std::vector<T>& inputs, std::vector<T>* work,
                           std::vector<T>* results) const {
  using std::atan2, std::cos, std::exp, std::sin, std::sqrt;
  work->resize(steps_.size());
  for (size_t i = 0; i < steps_.size(); ++i) {
    const Step& s = steps_[i];
    T& at = (*work)[i];
    switch (s.op) {
      case FormulaOp::kNumber:
        at = T(s.value);
        break;
      case FormulaOp::kInput:
        at = inputs[s.a];
        break;
      case FormulaOp::kAdd:
        at = (*work)[s.a] + (*work)[s.b];
        break;
      case FormulaOp::kSubtract:
        at = (*work)[s.a] - (*work)[s.b];
        break;
      case FormulaOp::kMultiply:
        at = (*work)[s.a] * (*work)[s.b];
        break;
      case FormulaOp::kDivide:
        at = (*work)[s.a] / (*work)[s.b];
        break;
      case FormulaOp::kNegate:
        at = -(*work)[s.a];
        break;
      case FormulaOp::kRoot:
        at = sqrt((*work)[s.a]);
        break;
      case FormulaOp::kSine:
        at = sin((*work)[s.a]);
        break;
      case FormulaOp::kCosine:
        at = cos((*work)[s.a]);
        break;
      case FormulaOp::kAngle:
        at = atan2((*work)[s.a], (*work)[s.b]);
        break;
      case FormulaOp::kExponential:
        at = exp((*work)[s.a]);
        break;
      case FormulaOp::kDirection:
        if constexpr (std::is_same_v<T, double>) {
          const double a = (*work)[s.a], b = (*work)[s.b];
          at = a > b ? 1.0 : (a < -b ? -1.0 : 0.0);
        }
        break;
    }
  }
  results->resize(results_.size());
  for (size_t k = 0; k < results_.size(); ++k) (*results)[k] = (*work)[results_[k]];
}

}  // namespace mbv

template <>
struct Eigen::NumTraits<mbv::Expr> : Eigen::NumTraits<double> {
  using Real = mbv::Expr;
  using NonInteger = mbv::Expr;
  using Nested = mbv::Expr;
  using Literal = double;
  enum {
    IsComplex = 0,
    IsInteger = 0,
    IsSigned = 1,
    RequireInitialization = 1,
    ReadCost = 1,
    AddCost = 1,
    MulCost = 1
  };
};

namespace mbv {
using Vec3E = Eigen::Matrix<Expr, 3, 1>;
using Mat3E = Eigen::Matrix<Expr, 3, 3>;
}  // namespace mbv
