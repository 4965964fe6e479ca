#include "equations/formula.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <numbers>

#include "base/diagnostics.h"
#include "base/text.h"
#include "base/types.h"

namespace mbv {
namespace {

constexpr int kDeepest = 200;  // nesting

// f(x) with f' and f'' at x.
Jet Chain(const Jet& x, double f, double f1, double f2) {
  return {f, f1 * x.rate, f1 * x.acceleration + f2 * x.rate * x.rate};
}
Jet Add(const Jet& x, const Jet& y, double sign) {
  return {x.value + sign * y.value, x.rate + sign * y.rate, x.acceleration + sign * y.acceleration};
}
Jet Multiply(const Jet& x, const Jet& y) {
  return {x.value * y.value, x.rate * y.value + x.value * y.rate,
          x.acceleration * y.value + 2.0 * x.rate * y.rate + x.value * y.acceleration};
}
Jet Invert(const Jet& x) {
  const double r = 1.0 / x.value;
  return Chain(x, r, -r * r, 2.0 * r * r * r);
}
bool IsConstant(const Jet& x) { return x.rate == 0.0 && x.acceleration == 0.0; }

Jet Power(const Jet& x, const Jet& n) {
  const double p = n.value;
  if (IsConstant(n)) {
    if (p == 0.0) return {1.0, 0.0, 0.0};
    if (p == 1.0) return x;
    if (p == 2.0) return Multiply(x, x);
    return Chain(x, std::pow(x.value, p), p * std::pow(x.value, p - 1.0),
                 p * (p - 1.0) * std::pow(x.value, p - 2.0));
  }
  const double log = std::log(x.value);
  const Jet exponent = Multiply(n, Chain(x, log, 1.0 / x.value, -1.0 / (x.value * x.value)));
  const double f = std::exp(exponent.value);
  return Chain(exponent, f, f, f);
}

// Of one argument: f, f', f'' at x.
struct Derivatives {
  double f, f1, f2;
};
struct OneFunction {
  const char* name;
  Derivatives (*at)(double x);
};
Derivatives Arc(double f, double first, double x) { return {f, first, first * x / (1.0 - x * x)}; }
const OneFunction kOne[] = {
    {"sin",
     [](double x) {
       return Derivatives{std::sin(x), std::cos(x), -std::sin(x)};
     }},
    {"cos",
     [](double x) {
       return Derivatives{std::cos(x), -std::sin(x), -std::cos(x)};
     }},
    {"tan",
     [](double x) {
       const double t = std::tan(x);
       return Derivatives{t, 1 + t * t, 2 * t * (1 + t * t)};
     }},
    {"asin", [](double x) { return Arc(std::asin(x), 1 / std::sqrt(1 - x * x), x); }},
    {"acos", [](double x) { return Arc(std::acos(x), -1 / std::sqrt(1 - x * x), x); }},
    {"atan",
     [](double x) {
       const double r = 1 / (1 + x * x);
       return Derivatives{std::atan(x), r, -2 * x * r * r};
     }},
    {"sinh",
     [](double x) {
       return Derivatives{std::sinh(x), std::cosh(x), std::sinh(x)};
     }},
    {"cosh",
     [](double x) {
       return Derivatives{std::cosh(x), std::sinh(x), std::cosh(x)};
     }},
    {"tanh",
     [](double x) {
       const double t = std::tanh(x);
       return Derivatives{t, 1 - t * t, -2 * t * (1 - t * t)};
     }},
    {"exp",
     [](double x) {
       return Derivatives{std::exp(x), std::exp(x), std::exp(x)};
     }},
    {"ln",
     [](double x) {
       return Derivatives{std::log(x), 1 / x, -1 / (x * x)};
     }},
    {"log",
     [](double x) {
       return Derivatives{std::log(x), 1 / x, -1 / (x * x)};
     }},
    {"sqrt",
     [](double x) {
       const double s = std::sqrt(x);
       return Derivatives{s, 0.5 / s, -0.25 / (x * s)};
     }},
    {"abs",
     [](double x) {
       return Derivatives{std::abs(x), x < 0 ? -1.0 : 1.0, 0};
     }},
    {"sign",
     [](double x) {
       return Derivatives{double((x > 0) - (x < 0)), 0, 0};
     }},
};
constexpr const char* kTwo[] = {"atan2", "min", "max", "hypot"};

Jet AtTwo(size_t which, const Jet& y, const Jet& x) {
  switch (which) {
    case 0: {
      const Jet quotient =
          std::abs(x.value) >= std::abs(y.value) ? Multiply(y, Invert(x)) : Multiply(x, Invert(y));
      const double r = 1 / (1 + quotient.value * quotient.value);
      const double sense = std::abs(x.value) >= std::abs(y.value) ? 1.0 : -1.0;
      return Chain(quotient, std::atan2(y.value, x.value), sense * r,
                   -2 * sense * quotient.value * r * r);
    }
    case 1:
      return y.value <= x.value ? y : x;
    case 2:
      return y.value >= x.value ? y : x;
    default: {
      const Jet square = Add(Multiply(x, x), Multiply(y, y), 1.0);
      const double s = std::sqrt(square.value);
      return Chain(square, s, 0.5 / s, -0.25 / (square.value * s));
    }
  }
}

bool IsLetter(char c) { return std::isalpha(static_cast<unsigned char>(c)) != 0 || c == '_'; }
bool IsDigit(char c) { return c >= '0' && c <= '9'; }

}  // namespace

// Recursive descent; the first error ends it.
class FormulaParser {
 public:
  using Op = DifferentiableFormula::Op;

  FormulaParser(std::string_view text, const std::vector<std::string>& names,
                const std::vector<std::string>& variables, std::vector<FormulaError>* errors)
      : text_(text), names_(names), variables_(variables), errors_(errors) {}

  DifferentiableFormula Run() {
    formula_.root_ = Choice();
    Skip();
    if (!failed_ && at_ < text_.size()) {
      Fail(fmt::format("'{}' is not expected here", text_.substr(at_, 1)),
           text_[at_] == '=' ? "a formula has no '='; comparisons are ==" : "");
    }
    return std::move(formula_);
  }

 private:
  int Make(Op op, int a = -1, int b = -1, int c = -1, double number = 0.0) {
    formula_.nodes_.push_back({op, a, b, c, number});
    return static_cast<int>(formula_.nodes_.size()) - 1;
  }
  int Fail(std::string message, std::string hint = "") {
    if (!failed_) errors_->push_back({at_, std::move(message), std::move(hint)});
    failed_ = true;
    at_ = text_.size();
    return Make(Op::kNumber);
  }
  void Skip() {
    while (at_ < text_.size() && std::isspace(static_cast<unsigned char>(text_[at_])) != 0) ++at_;
  }
  bool Take(std::string_view sign) {
    Skip();
    if (text_.substr(at_, sign.size()) != sign) return false;
    at_ += sign.size();
    return true;
  }
  [[nodiscard]] bool Sees(std::string_view sign) {
    Skip();
    return text_.substr(at_, sign.size()) == sign;
  }

  int Choice() {
    const int condition = Or();
    if (!Take("?")) return condition;
    const int yes = Choice();
    if (!Take(":")) return Fail("':' is missing behind '?'");
    return Make(Op::kChoose, condition, yes, Choice());
  }
  int Or() {
    int left = And();
    while (Take("||")) left = Make(Op::kOr, left, And());
    return left;
  }
  int And() {
    int left = Comparison();
    while (Take("&&")) left = Make(Op::kAnd, left, Comparison());
    return left;
  }
  int Comparison() {
    int left = Sum();
    while (true) {
      if (Take("<=")) {
        left = Make(Op::kLessEqual, left, Sum());
      } else if (Take(">=")) {
        left = Make(Op::kGreaterEqual, left, Sum());
      } else if (Take("==")) {
        left = Make(Op::kEqual, left, Sum());
      } else if (Take("!=")) {
        left = Make(Op::kNotEqual, left, Sum());
      } else if (Take("<")) {
        left = Make(Op::kLess, left, Sum());
      } else if (Take(">")) {
        left = Make(Op::kGreater, left, Sum());
      } else {
        return left;
      }
    }
  }
  int Sum() {
    int left = Product();
    while (true) {
      if (Take("+")) {
        left = Make(Op::kAdd, left, Product());
      } else if (Take("-")) {
        left = Make(Op::kSubtract, left, Product());
      } else {
        return left;
      }
    }
  }
  int Product() {
    int left = Sign();
    while (true) {
      if (Sees("**")) return Fail("'**' is no operator", "a power is written a^b");
      if (Take("*")) {
        left = Make(Op::kMultiply, left, Sign());
      } else if (Take("/")) {
        left = Make(Op::kDivide, left, Sign());
      } else {
        return left;
      }
    }
  }
  int Sign() {
    if (++depth_ > kDeepest) return Fail("is nested too deeply");
    int node = -1;
    if (Take("-")) {
      node = Make(Op::kNegate, Sign());
    } else if (Take("+")) {
      node = Sign();
    } else {
      node = PowerOf();
    }
    --depth_;
    return node;
  }
  // a^b^c is a^(b^c), −a^b is −(a^b).
  int PowerOf() {
    const int base = Primary();
    return Take("^") ? Make(Op::kPower, base, Sign()) : base;
  }
  int Primary() {
    Skip();
    if (at_ >= text_.size()) return Fail("ends too early");
    if (Take("(")) {
      const int inner = Choice();
      return Take(")") ? inner : Fail("')' is missing");
    }
    if (IsDigit(text_[at_]) || text_[at_] == '.') return Number();
    if (IsLetter(text_[at_])) return Word();
    return Fail(fmt::format("'{}' is not expected here", text_.substr(at_, 1)));
  }
  int Number() {
    double value = 0.0;
    const char* begin = text_.data() + at_;
    const auto [end, error] = std::from_chars(begin, text_.data() + text_.size(), value);
    if (error != std::errc()) return Fail("is not a number");
    at_ += static_cast<size_t>(end - begin);
    return Make(Op::kNumber, -1, -1, -1, value);
  }
  [[nodiscard]] static int IndexOf(const std::vector<std::string>& words, std::string_view word) {
    const auto found = std::ranges::find(words, word);
    return found == words.end() ? -1 : static_cast<int>(found - words.begin());
  }
  int Refer(Op op, int name, int variable = -1) {
    if (std::ranges::find(formula_.used_, name) == formula_.used_.end()) {
      formula_.used_.push_back(name);
    }
    return Make(op, name, variable);
  }
  std::string_view TakeWord() {
    Skip();
    const size_t begin = at_;
    while (at_ < text_.size() && (IsLetter(text_[at_]) || (at_ > begin && IsDigit(text_[at_])))) {
      ++at_;
    }
    return text_.substr(begin, at_ - begin);
  }
  int Word() {
    const size_t begin = at_;
    const std::string word(TakeWord());
    if (Sees("(")) return Call(word, begin);
    if (const int name = IndexOf(names_, word); name >= 0) return Refer(Op::kName, name);
    for (const auto& [suffix, op] :
         {std::pair{"_dd", Op::kAcceleration}, std::pair{"_d", Op::kRate}}) {
      if (!word.ends_with(suffix)) continue;
      const int name =
          IndexOf(names_, std::string_view(word).substr(0, word.size() - std::strlen(suffix)));
      if (name >= 0) return Refer(op, name);
    }
    if (word == "pi" || word == "_pi") return Make(Op::kNumber, -1, -1, -1, std::numbers::pi);
    at_ = begin;
    return Fail(fmt::format("'{}' is not known", word), DidYouMean(word, names_));
  }
  int Call(const std::string& word, size_t begin) {
    (void)Take("(");
    if (word == "d") return Partial();
    std::vector<int> arguments;
    do {
      arguments.push_back(Choice());
    } while (Take(","));
    if (!Take(")")) return Fail("')' is missing");
    for (size_t k = 0; k < std::size(kOne); ++k) {
      if (word != kOne[k].name) continue;
      if (arguments.size() == 1) return Make(Op::kCall, static_cast<int>(k), arguments[0]);
      at_ = begin;
      return Fail(fmt::format("{} takes one number, not {}", word, arguments.size()));
    }
    for (size_t k = 0; k < std::size(kTwo); ++k) {
      if (word != kTwo[k]) continue;
      if (arguments.size() == 2) {
        return Make(Op::kCall, static_cast<int>(std::size(kOne) + k), arguments[0], arguments[1]);
      }
      at_ = begin;
      return Fail(fmt::format("{} takes two numbers, not {}", word, arguments.size()));
    }
    at_ = begin;
    std::vector<std::string> known = {"d"};
    for (const OneFunction& function : kOne) known.emplace_back(function.name);
    for (const char* name : kTwo) known.emplace_back(name);
    return Fail(fmt::format("there is no function '{}'", word), DidYouMean(word, known));
  }
  // d(NAME, VARIABLE)
  int Partial() {
    const std::string of(TakeWord());
    const int name = IndexOf(names_, of);
    if (name < 0) return Fail(fmt::format("'{}' is not known", of), DidYouMean(of, names_));
    if (!Take(",")) return Fail("d takes a name and a command: d(NAME, COMMAND)");
    const std::string by(TakeWord());
    const int variable = IndexOf(variables_, by);
    if (variable < 0) {
      return Fail(fmt::format("'{}' is no command", by), DidYouMean(by, variables_));
    }
    if (!Take(")")) return Fail("')' is missing");
    return Refer(Op::kPartial, name, variable);
  }

  std::string_view text_;
  const std::vector<std::string>& names_;
  const std::vector<std::string>& variables_;
  std::vector<FormulaError>* errors_;
  DifferentiableFormula formula_;
  size_t at_ = 0;
  int depth_ = 0;
  bool failed_ = false;
};

DifferentiableFormula DifferentiableFormula::Compile(std::string_view text,
                                                     const std::vector<std::string>& names,
                                                     const std::vector<std::string>& variables,
                                                     std::vector<FormulaError>* errors) {
  return FormulaParser(text, names, variables, errors).Run();
}

Jet DifferentiableFormula::At(const Values& values) const { return Evaluate(root_, values); }

Jet DifferentiableFormula::Evaluate(int index, const Values& values) const {
  const Node& node = nodes_[static_cast<size_t>(index)];
  const auto at = [&](int operand) { return Evaluate(operand, values); };
  const auto number = [](double value) { return Jet{value, kNan, kNan}; };
  const auto truth = [](bool value) { return Jet{value ? 1.0 : 0.0, 0.0, 0.0}; };
  switch (node.op) {
    case Op::kNumber:
      return {node.number, 0.0, 0.0};
    case Op::kName:
      return values.names[static_cast<size_t>(node.a)];
    case Op::kRate:
      return number(values.names[static_cast<size_t>(node.a)].rate);
    case Op::kAcceleration:
      return number(values.names[static_cast<size_t>(node.a)].acceleration);
    case Op::kPartial:
      if (values.partial.empty()) return number(kNan);
      return number(values.partial[static_cast<size_t>(node.a)][static_cast<size_t>(node.b)]);
    case Op::kAdd:
      return Add(at(node.a), at(node.b), 1.0);
    case Op::kSubtract:
      return Add(at(node.a), at(node.b), -1.0);
    case Op::kMultiply:
      return Multiply(at(node.a), at(node.b));
    case Op::kDivide:
      return Multiply(at(node.a), Invert(at(node.b)));
    case Op::kPower:
      return Power(at(node.a), at(node.b));
    case Op::kNegate:
      return Add({}, at(node.a), -1.0);
    case Op::kLess:
      return truth(at(node.a).value < at(node.b).value);
    case Op::kLessEqual:
      return truth(at(node.a).value <= at(node.b).value);
    case Op::kGreater:
      return truth(at(node.a).value > at(node.b).value);
    case Op::kGreaterEqual:
      return truth(at(node.a).value >= at(node.b).value);
    case Op::kEqual:
      return truth(at(node.a).value == at(node.b).value);
    case Op::kNotEqual:
      return truth(at(node.a).value != at(node.b).value);
    case Op::kAnd:
      return truth(at(node.a).value != 0.0 && at(node.b).value != 0.0);
    case Op::kOr:
      return truth(at(node.a).value != 0.0 || at(node.b).value != 0.0);
    case Op::kChoose:
      return at(node.a).value != 0.0 ? at(node.b) : at(node.c);
    case Op::kCall:
      break;
  }
  const auto function = static_cast<size_t>(node.a);
  if (function >= std::size(kOne)) {
    return AtTwo(function - std::size(kOne), at(node.b), at(node.c));
  }
  const Jet x = at(node.b);
  const Derivatives f = kOne[function].at(x.value);
  return Chain(x, f.f, f.f1, f.f2);
}

}  // namespace mbv
