#include "features/code/formula_graph.h"

#include <fmt/format.h>
#include <algorithm>
#include <bit>
#include <functional>

#include "base/demand.h"

namespace mbv {
namespace {

thread_local FormulaGraph* open_graph = nullptr;

constexpr size_t kLongest = 76;  // of a statement's formula, in signs

bool IsUnary(FormulaOp op) {
  return op == FormulaOp::kNegate || op == FormulaOp::kRoot || op == FormulaOp::kSine ||
         op == FormulaOp::kCosine || op == FormulaOp::kExponential;
}

double ValueOf(FormulaOp op, double a, double b) {
  switch (op) {
    case FormulaOp::kAdd:
      return a + b;
    case FormulaOp::kSubtract:
      return a - b;
    case FormulaOp::kMultiply:
      return a * b;
    case FormulaOp::kDivide:
      return a / b;
    case FormulaOp::kNegate:
      return -a;
    case FormulaOp::kRoot:
      return std::sqrt(a);
    case FormulaOp::kSine:
      return std::sin(a);
    case FormulaOp::kCosine:
      return std::cos(a);
    case FormulaOp::kAngle:
      return std::atan2(a, b);
    case FormulaOp::kExponential:
      return std::exp(a);
    case FormulaOp::kDirection:
      return a > b ? 1.0 : (a < -b ? -1.0 : 0.0);
    case FormulaOp::kNumber:
    case FormulaOp::kInput:
      break;
  }
  ThrowDemand("an operation of two numbers", __FILE__, __LINE__, "");
}

}  // namespace

Expr::Expr(double value) : id_(FormulaGraph::Open().Number(value).id_) {}

FormulaGraph::FormulaGraph() {
  MBV_DEMAND(open_graph == nullptr, "one graph at a time");
  open_graph = this;
}
FormulaGraph::~FormulaGraph() { open_graph = nullptr; }
FormulaGraph& FormulaGraph::Open() {
  MBV_DEMAND(open_graph != nullptr, "no graph is open");
  return *open_graph;
}

size_t FormulaGraph::Hash::operator()(const Node& node) const {
  size_t h = std::hash<std::uint64_t>()(std::bit_cast<std::uint64_t>(node.value));
  h = h * 1000003U + static_cast<size_t>(node.op);
  h = h * 1000003U + static_cast<size_t>(node.a + 1);
  return h * 1000003U + static_cast<size_t>(node.b + 1);
}
bool FormulaGraph::Same::operator()(const Node& a, const Node& b) const {
  return a.op == b.op && a.a == b.a && a.b == b.b &&
         std::bit_cast<std::uint64_t>(a.value) == std::bit_cast<std::uint64_t>(b.value);
}

Expr FormulaGraph::Find(const Node& node) {
  const auto [at, is_new] = known_.try_emplace(node, static_cast<int>(nodes_.size()));
  if (is_new) nodes_.push_back(node);
  return {Expr::ById(), at->second};
}

Expr FormulaGraph::Number(double value) {
  return Find({.op = FormulaOp::kNumber, .value = value == 0.0 ? 0.0 : value});  // no −0
}

Expr FormulaGraph::Input(const std::string& name) {
  names_.push_back(name);
  return Find({.op = FormulaOp::kInput, .a = static_cast<int>(names_.size()) - 1});
}

Expr FormulaGraph::Make(FormulaOp op, Expr a, Expr b) {
  const Node x = At(a), y = At(b);
  const bool unary = IsUnary(op);
  if (x.op == FormulaOp::kNumber && (unary || y.op == FormulaOp::kNumber)) {
    return Number(ValueOf(op, x.value, y.value));
  }
  const auto negated = [](const Node& of) { return Expr(Expr::ById(), of.a); };
  switch (op) {
    case FormulaOp::kAdd:
      if (IsZero(a)) return b;
      if (IsZero(b)) return a;
      if (y.op == FormulaOp::kNegate) return Make(FormulaOp::kSubtract, a, negated(y));
      if (x.op == FormulaOp::kNegate) return Make(FormulaOp::kSubtract, b, negated(x));
      if (a.id_ > b.id_) std::swap(a, b);
      break;
    case FormulaOp::kSubtract:
      if (a == b) return Number(0.0);
      if (IsZero(b)) return a;
      if (IsZero(a)) return Make(FormulaOp::kNegate, b);
      if (y.op == FormulaOp::kNegate) return Make(FormulaOp::kAdd, a, negated(y));
      break;
    case FormulaOp::kMultiply:
      if (IsZero(a) || IsZero(b)) return Number(0.0);
      if (IsNumber(a, 1.0)) return b;
      if (IsNumber(b, 1.0)) return a;
      if (IsNumber(a, -1.0)) return Make(FormulaOp::kNegate, b);
      if (IsNumber(b, -1.0)) return Make(FormulaOp::kNegate, a);
      if (x.op == FormulaOp::kNegate && y.op == FormulaOp::kNegate) {
        return Make(FormulaOp::kMultiply, negated(x), negated(y));
      }
      if (x.op == FormulaOp::kNegate && y.op == FormulaOp::kNumber) {
        return Make(FormulaOp::kMultiply, negated(x), Number(-y.value));
      }
      if (y.op == FormulaOp::kNegate && x.op == FormulaOp::kNumber) {
        return Make(FormulaOp::kMultiply, negated(y), Number(-x.value));
      }
      if (x.op == FormulaOp::kNegate) {
        return Make(FormulaOp::kNegate, Make(FormulaOp::kMultiply, negated(x), b));
      }
      if (y.op == FormulaOp::kNegate) {
        return Make(FormulaOp::kNegate, Make(FormulaOp::kMultiply, a, negated(y)));
      }
      if (a.id_ > b.id_) std::swap(a, b);
      break;
    case FormulaOp::kDivide:
      if (IsZero(a)) return a;
      if (IsNumber(b, 1.0)) return a;
      break;
    case FormulaOp::kNegate:
      if (x.op == FormulaOp::kNegate) return negated(x);
      if (x.op == FormulaOp::kSubtract) {
        return Make(FormulaOp::kSubtract, Expr(Expr::ById(), x.b), Expr(Expr::ById(), x.a));
      }
      break;
    default:
      break;
  }
  return Find({.op = op, .a = a.id_, .b = unary ? -1 : b.id_});
}

std::vector<bool> FormulaGraph::Needed(const std::vector<Expr>& of) const {
  std::vector<bool> needed(nodes_.size(), false);
  for (const Expr& e : of) needed[static_cast<size_t>(e.id_)] = true;
  for (size_t i = nodes_.size(); i-- > 0;) {
    const Node& node = nodes_[i];
    if (!needed[i] || node.op == FormulaOp::kInput) continue;
    if (node.a >= 0) needed[static_cast<size_t>(node.a)] = true;
    if (node.b >= 0) needed[static_cast<size_t>(node.b)] = true;
  }
  return needed;
}

std::vector<Expr> FormulaGraph::Derivatives(const std::vector<Expr>& of,
                                            const std::vector<std::pair<Expr, Expr>>& rates) {
  const std::vector<bool> needed = Needed(of);
  const Expr zero = Number(0.0);
  std::vector<Expr> d(needed.size(), zero);
  for (const auto& [input, rate] : rates) d[static_cast<size_t>(input.id_)] = rate;
  for (size_t i = 0; i < needed.size(); ++i) {
    if (!needed[i]) continue;
    const Node node = nodes_[i];
    if (node.op == FormulaOp::kNumber || node.op == FormulaOp::kInput) continue;
    const Expr self(Expr::ById(), static_cast<int>(i));
    const Expr a(Expr::ById(), node.a);
    const Expr b = node.b >= 0 ? Expr(Expr::ById(), node.b) : zero;
    const Expr da = d[static_cast<size_t>(node.a)];
    const Expr db = node.b >= 0 ? d[static_cast<size_t>(node.b)] : zero;
    if (IsZero(da) && IsZero(db)) continue;
    Expr& to = d[i];
    switch (node.op) {
      case FormulaOp::kAdd:
        to = da + db;
        break;
      case FormulaOp::kSubtract:
        to = da - db;
        break;
      case FormulaOp::kMultiply:
        to = da * b + a * db;
        break;
      case FormulaOp::kDivide:
        to = (da - self * db) / b;
        break;
      case FormulaOp::kNegate:
        to = -da;
        break;
      case FormulaOp::kRoot:
        to = da / (Expr(2.0) * self);
        break;
      case FormulaOp::kSine:
        to = cos(a) * da;
        break;
      case FormulaOp::kCosine:
        to = -(sin(a) * da);
        break;
      case FormulaOp::kAngle:
        to = (b * da - a * db) / (a * a + b * b);
        break;
      case FormulaOp::kExponential:
        to = self * da;
        break;
      default:
        break;  // kDirection: constant where it has a derivative
    }
  }
  std::vector<Expr> result;
  result.reserve(of.size());
  for (const Expr& e : of) result.push_back(d[static_cast<size_t>(e.id_)]);
  return result;
}

std::vector<Expr> FormulaGraph::FixedParts(const std::vector<Expr>& of,
                                           const std::vector<Expr>& moving) const {
  std::vector<bool> moves(nodes_.size(), false), wanted(nodes_.size(), false);
  for (const Expr& input : moving) moves[static_cast<size_t>(input.id())] = true;
  const auto moved = [&](int id) { return id >= 0 && moves[static_cast<size_t>(id)]; };
  const auto plain = [&](size_t i) {
    return nodes_[i].op == FormulaOp::kNumber || nodes_[i].op == FormulaOp::kInput;
  };
  for (size_t i = 0; i < nodes_.size(); ++i) {
    if (!plain(i)) moves[i] = moved(nodes_[i].a) || moved(nodes_[i].b);
  }
  for (const Expr& e : of) wanted[static_cast<size_t>(e.id())] = true;
  for (size_t i = nodes_.size(); i-- > 0;) {
    if (!wanted[i] || plain(i) || !moves[i]) continue;
    if (nodes_[i].a >= 0) wanted[static_cast<size_t>(nodes_[i].a)] = true;
    if (nodes_[i].b >= 0) wanted[static_cast<size_t>(nodes_[i].b)] = true;
  }
  std::vector<Expr> parts;
  for (size_t i = 0; i < nodes_.size(); ++i) {
    // Inputs that are fixed count, too: what is left is a function of `moving` and the parts.
    const bool input = nodes_[i].op == FormulaOp::kInput;
    if (wanted[i] && !moves[i] && (!plain(i) || input)) {
      parts.push_back(Expr(Expr::ById(), static_cast<int>(i)));
    }
  }
  return parts;
}

std::vector<Expr> FormulaGraph::WavesOf(const std::vector<Expr>& of) const {
  const std::vector<bool> needed = Needed(of);
  std::vector<Expr> waves;
  for (size_t i = 0; i < needed.size(); ++i) {
    const Node& node = nodes_[i];
    if (!needed[i] || (node.op != FormulaOp::kSine && node.op != FormulaOp::kCosine)) continue;
    if (nodes_[static_cast<size_t>(node.a)].op == FormulaOp::kInput) {
      waves.push_back(Expr(Expr::ById(), static_cast<int>(i)));
    }
  }
  return waves;
}

FormulaTape::FormulaTape(const std::vector<Expr>& of) {
  const FormulaGraph& graph = FormulaGraph::Open();
  const std::vector<bool> needed = graph.Needed(of);
  std::vector<size_t> at(needed.size(), 0);
  for (size_t i = 0; i < needed.size(); ++i) {
    if (!needed[i]) continue;
    const FormulaGraph::Node& node = graph.nodes_[i];
    at[i] = steps_.size();
    const bool input = node.op == FormulaOp::kInput;
    const auto place = [&](int id) { return id >= 0 ? at[static_cast<size_t>(id)] : 0; };
    steps_.push_back(
        {node.op, input ? static_cast<size_t>(node.a) : place(node.a), place(node.b), node.value});
  }
  for (const Expr& e : of) results_.push_back(at[static_cast<size_t>(e.id())]);
}

std::string NumberText(double value) {
  std::string text = fmt::format("{}", value);
  if (text.find_first_of(".en") == std::string::npos) text += ".0";
  return text;
}

namespace {
// How tight an operation binds, from sums to names.
enum Binding { kSum = 0, kProduct = 1, kFactor = 2, kName = 3 };
}  // namespace

FormulaText::FormulaText(const std::vector<Expr>& of, const std::string& call,
                         const std::vector<Expr>& given, const std::string& given_name)
    : graph_(FormulaGraph::Open()),
      call_(call),
      uses_(graph_.nodes_.size(), 0),
      named_(graph_.nodes_.size()) {
  for (size_t i = 0; i < given.size(); ++i) {
    named_[static_cast<size_t>(given[i].id())] = fmt::format("{}[{}]", given_name, i);
  }
  for (const Expr& e : of) ++uses_[static_cast<size_t>(e.id())];
  for (size_t i = uses_.size(); i-- > 0;) {
    const FormulaGraph::Node& node = graph_.nodes_[i];
    if (uses_[i] == 0 || node.op == FormulaOp::kInput || !named_[i].empty()) continue;
    if (node.a >= 0) ++uses_[static_cast<size_t>(node.a)];
    if (node.b >= 0) ++uses_[static_cast<size_t>(node.b)];
  }
  for (const Expr& e : of) results_.push_back(TextOf(e.id(), kSum));
}

std::string FormulaText::TextOf(int id, int binding) {
  const auto i = static_cast<size_t>(id);
  if (!named_[i].empty()) return named_[i];
  const FormulaGraph::Node& node = graph_.nodes_[i];
  if (node.op == FormulaOp::kInput) return graph_.names_[static_cast<size_t>(node.a)];
  if (node.op == FormulaOp::kNumber) {
    const std::string text = NumberText(node.value);
    return node.value < 0.0 && binding > kSum ? "(" + text + ")" : text;
  }
  std::string text;
  int own = kName;
  const auto function = [&](const std::string& name) { return name + "("; };
  switch (node.op) {
    case FormulaOp::kAdd:
      text = TextOf(node.a, kSum) + " + " + TextOf(node.b, kProduct);
      own = kSum;
      break;
    case FormulaOp::kSubtract:
      text = TextOf(node.a, kSum) + " - " + TextOf(node.b, kProduct);
      own = kSum;
      break;
    case FormulaOp::kMultiply:
      text = TextOf(node.a, kProduct) + "*" + TextOf(node.b, kFactor);
      own = kProduct;
      break;
    case FormulaOp::kDivide:
      text = TextOf(node.a, kProduct) + "/" + TextOf(node.b, kFactor);
      own = kProduct;
      break;
    case FormulaOp::kNegate:
      text = "-" + TextOf(node.a, kFactor);
      own = kSum;
      break;
    case FormulaOp::kRoot:
      text = function("sqrt") + TextOf(node.a, kSum) + ")";
      break;
    case FormulaOp::kSine:
      text = function("sin") + TextOf(node.a, kSum) + ")";
      break;
    case FormulaOp::kCosine:
      text = function("cos") + TextOf(node.a, kSum) + ")";
      break;
    case FormulaOp::kExponential:
      text = function("exp") + TextOf(node.a, kSum) + ")";
      break;
    case FormulaOp::kAngle:
      text = function("atan2") + TextOf(node.a, kSum) + ", " + TextOf(node.b, kSum) + ")";
      break;
    case FormulaOp::kDirection:
      text = function(call_) + TextOf(node.a, kSum) + ", " + TextOf(node.b, kSum) + ")";
      break;
    case FormulaOp::kNumber:
    case FormulaOp::kInput:
      break;
  }
  if (uses_[i] > 1 || text.size() > kLongest) {
    named_[i] = fmt::format("e{}", statements_.size() + 1);
    statements_.emplace_back(named_[i], text);
    return named_[i];
  }
  return own < binding ? "(" + text + ")" : text;
}

bool FormulaText::Uses(const std::vector<Expr>& parts) const {
  return std::ranges::any_of(
      parts, [this](const Expr& part) { return uses_[static_cast<size_t>(part.id())] > 0; });
}

}  // namespace mbv
