#include "features/code/code_text.h"

#include <fmt/format.h>
#include <algorithm>
#include <map>

#include "base/text.h"

namespace mbv {
namespace {

constexpr size_t kColumns = 98;

// A comma-separated list in lines of bearable length.
std::string List(const std::vector<std::string>& items, const std::string& indent) {
  std::string text, line = indent;
  for (size_t i = 0; i < items.size(); ++i) {
    const std::string item = items[i] + (i + 1 < items.size() ? ", " : "");
    if (line.size() + item.size() > kColumns && line.size() > indent.size()) {
      text += line.substr(0, line.find_last_not_of(' ') + 1) + "\n";
      line = indent;
    }
    line += item;
  }
  return text + line + "\n";
}

std::vector<std::string> Numbers(const VecX& values) {
  std::vector<std::string> items;
  for (const double value : values) items.push_back(NumberText(value));
  return items;
}
std::vector<std::string> Numbers(const std::vector<int>& values) {
  std::vector<std::string> items;
  items.reserve(values.size());
  for (const int value : values) items.push_back(std::to_string(value));
  return items;
}
template <typename T>
void Append(const std::vector<T>& more, std::vector<T>* to) {
  to->insert(to->end(), more.begin(), more.end());
}

// Eight cells a byte.
std::vector<int> BytesOf(const std::vector<bool>& cells) {
  std::vector<int> bytes((cells.size() + 7) / 8, 0);
  for (size_t i = 0; i < cells.size(); ++i) {
    if (cells[i]) bytes[i / 8] |= 1 << (i % 8);
  }
  return bytes;
}

// '@' in fixed texts stands for the prefix of names.
std::string Named(std::string text, const std::string& prefix) {
  std::string named;
  for (const char c : text) {
    if (c == '@') {
      named += prefix;
    } else {
      named += c;
    }
  }
  return named;
}

// What every header has.
constexpr const char* kCAlgebra = R"code(
static inline double @sign(double a, double least) {
  return a > least ? 1.0 : (a < -least ? -1.0 : 0.0);
}

/* a = L U of a matrix by rows, with row exchanges; 0 where it is singular. */
static inline int @factor(double a[], int n, int pivot[]) {
  double largest = 0.0;
  int i, j, k;
  for (i = 0; i < n * n; ++i) {
    if (fabs(a[i]) > largest) largest = fabs(a[i]);
  }
  for (k = 0; k < n; ++k) {
    int p = k;
    for (i = k + 1; i < n; ++i) {
      if (fabs(a[i * n + k]) > fabs(a[p * n + k])) p = i;
    }
    pivot[k] = p;
    if (!(fabs(a[p * n + k]) > 1e-12 * largest)) return 0;
    if (p != k) {
      for (j = 0; j < n; ++j) {
        const double t = a[k * n + j];
        a[k * n + j] = a[p * n + j];
        a[p * n + j] = t;
      }
    }
    for (i = k + 1; i < n; ++i) {
      const double f = a[i * n + k] / a[k * n + k];
      a[i * n + k] = f;
      for (j = k + 1; j < n; ++j) a[i * n + j] -= f * a[k * n + j];
    }
  }
  return 1;
}

/* b becomes the solution of a y = b. */
static inline void @solve(const double lu[], const int pivot[], int n, double b[]) {
  int i, j;
  for (i = 0; i < n; ++i) {
    const double t = b[pivot[i]];
    b[pivot[i]] = b[i];
    b[i] = t;
  }
  for (i = 1; i < n; ++i) {
    for (j = 0; j < i; ++j) b[i] -= lu[i * n + j] * b[j];
  }
  for (i = n - 1; i >= 0; --i) {
    for (j = i + 1; j < n; ++j) b[i] -= lu[i * n + j] * b[j];
    b[i] /= lu[i * n + i];
  }
}

/* A unit quaternion w, x, y, z turned by a small rotation vector in its own axes. */
static inline void @turn(double q[], double a, double b, double c) {
  const double w = q[0] - 0.5 * (q[1] * a + q[2] * b + q[3] * c);
  const double x = q[1] + 0.5 * (q[0] * a + q[2] * c - q[3] * b);
  const double y = q[2] + 0.5 * (q[0] * b + q[3] * a - q[1] * c);
  const double z = q[3] + 0.5 * (q[0] * c + q[1] * b - q[2] * a);
  const double s = 1.0 / sqrt(w * w + x * x + y * y + z * z);
  q[0] = s * w;
  q[1] = s * x;
  q[2] = s * y;
  q[3] = s * z;
}
)code";

constexpr const char* kPythonAlgebra = R"code(
def _sign(a, least):
    return 1.0 if a > least else (-1.0 if a < -least else 0.0)

def _factor(a, n):
    """L U of a matrix by rows, in place: the row exchanges, or None where it is singular."""
    largest = max(abs(value) for value in a)
    pivot = []
    for k in range(n):
        p = max(range(k, n), key=lambda i: abs(a[i * n + k]))
        pivot.append(p)
        if not abs(a[p * n + k]) > 1e-12 * largest:
            return None
        if p != k:
            for j in range(n):
                a[k * n + j], a[p * n + j] = a[p * n + j], a[k * n + j]
        for i in range(k + 1, n):
            f = a[i * n + k] / a[k * n + k]
            a[i * n + k] = f
            for j in range(k + 1, n):
                a[i * n + j] -= f * a[k * n + j]
    return pivot

def _solve(lu, pivot, n, b):
    """b becomes the solution of a y = b."""
    for i in range(n):
        b[i], b[pivot[i]] = b[pivot[i]], b[i]
    for i in range(1, n):
        for j in range(i):
            b[i] -= lu[i * n + j] * b[j]
    for i in reversed(range(n)):
        for j in range(i + 1, n):
            b[i] -= lu[i * n + j] * b[j]
        b[i] /= lu[i * n + i]

def _turn(x, at, a, b, c):
    """The unit quaternion w, x, y, z from x[at] on, turned by a small rotation in its own axes."""
    w, i, j, k = x[at:at + 4]
    turned = [w - 0.5 * (i * a + j * b + k * c), i + 0.5 * (w * a + j * c - k * b),
              j + 0.5 * (w * b + k * a - i * c), k + 0.5 * (w * c + i * b - j * a)]
    size = sqrt(sum(part * part for part in turned))
    x[at:at + 4] = [part / size for part in turned]
)code";

// One input array of a function.
struct Argument {
  std::string name;
  const std::vector<Expr>* inputs;
};
struct Result {
  std::string name;
  std::vector<Expr> values;
};

class CodeWriter {
 public:
  CodeWriter(const MechanismFormulas& formulas, const CodeTextOptions& options, bool python)
      : f_(formulas), o_(options), python_(python), prefix_(python ? "" : options.name + "_") {}

  std::string Text() {
    FindWaves();
    python_ ? PythonHead() : CHead();
    text_ += python_ ? kPythonAlgebra : Named(kCAlgebra, prefix_);
    Closure(f_.closure, "");
    if (f_.from_actuators) Closure(*f_.from_actuators, "d");
    Function("waves", {{"x", &f_.x}}, {{"t", waves_}});
    PoseFunction("gaps", {{"q", &f_.closure.q}}, {{"r", f_.closure.gaps}});
    if (f_.from_actuators) PoseFunction("coordinates", {}, {{"q", f_.closure.values}});
    ActuatorFunctions();
    if (!f_.forces.empty()) {
      PoseFunction("tree_forces", {{"u", &f_.u}, {"du", &f_.du}}, {{"f", f_.forces}});
    }
    for (size_t o = 0; o < f_.outputs.size(); ++o) {
      PoseFunction(fmt::format("output_{}", o), {}, {{"pose", f_.outputs[o].pose}});
    }
    python_ ? PythonBody() : CBody();
    return std::move(text_);
  }

 private:
  [[nodiscard]] size_t n() const { return f_.size(); }
  [[nodiscard]] size_t actuators() const { return f_.actuators.size(); }
  [[nodiscard]] bool square() const { return n() == actuators() && !f_.forces.empty(); }
  template <typename... T>
  void Line(fmt::format_string<T...> line, T&&... values) {
    text_ += fmt::format(line, std::forward<T>(values)...) + "\n";
  }
  void Fixed(const char* text) { text_ += Named(text, prefix_); }

  // Sines and cosines that functions of a pose share.
  void FindWaves() {
    std::vector<Expr> all = f_.closure.gaps;
    for (const ClosureBlock& block : f_.closure.blocks) {
      Append(block.others, &all);
      Append(block.bias, &all);
    }
    for (const ActuatorFormula& actuator : f_.actuators) {
      all.push_back(actuator.value);
      all.push_back(actuator.bias);
      for (const auto& [rate, factor] : actuator.rates) all.push_back(factor);
    }
    Append(f_.forces, &all);
    for (const OutputFormula& output : f_.outputs) Append(output.pose, &all);
    waves_ = f_.graph.WavesOf(all);
  }
  // Of x and its waves t.
  void PoseFunction(const std::string& name, std::vector<Argument> arguments,
                    const std::vector<Result>& results) {
    arguments.insert(arguments.begin(), {{"x", &f_.x}, {"t", &waves_}});
    Function(name, arguments, results, waves_, "t");
  }
  // Straight-line code; `given` parts have values in an argument.
  void Function(const std::string& name, const std::vector<Argument>& arguments,
                const std::vector<Result>& results, const std::vector<Expr>& given = {},
                const std::string& given_name = "") {
    std::vector<Expr> all;
    for (const Result& result : results) Append(result.values, &all);
    const std::string sign = (python_ ? "_" : prefix_) + std::string("sign");
    const FormulaText formulas(all, sign, given, given_name);
    std::vector<std::string> parameters;
    parameters.reserve(arguments.size() + results.size());
    for (const Argument& argument : arguments) {
      parameters.push_back(python_ ? argument.name : "const double " + argument.name + "[]");
    }
    if (python_) {
      Line("\n\ndef _{}({}):", name, Joined(parameters));
      for (const auto& [left, right] : formulas.statements()) Line("    {} = {}", left, right);
      std::vector<std::string> lists;
      size_t at = 0;
      for (const Result& result : results) {
        std::vector<std::string> items;
        for (size_t k = 0; k < result.values.size(); ++k) items.push_back(formulas.results()[at++]);
        Line("    {} = [", result.name);
        text_ += List(items, "        ");
        Line("    ]");
        lists.push_back(result.name);
      }
      Line("    return {}", Joined(lists));
      return;
    }
    for (const Result& result : results) parameters.push_back("double " + result.name + "[]");
    Line("\nstatic inline void {}{}({}) {{", prefix_, name, Joined(parameters));
    for (const auto& [left, right] : formulas.statements()) {
      Line("  const double {} = {};", left, right);
    }
    size_t at = 0;
    for (const Result& result : results) {
      for (size_t k = 0; k < result.values.size(); ++k) {
        Line("  {}[{}] = {};", result.name, k, formulas.results()[at++]);
      }
      if (result.values.empty()) Line("  (void){};", result.name);
    }
    for (const Argument& argument : arguments) {
      if (!formulas.Uses(*argument.inputs)) Line("  (void){};", argument.name);
    }
    Line("}}");
  }

  void IntArray(const std::string& name, const std::vector<int>& values) {
    const std::vector<std::string> items = Numbers(values.empty() ? std::vector<int>{0} : values);
    if (python_) {
      Line("{} = [{}]", name, Joined(values.empty() ? std::vector<std::string>{} : items));
    } else {
      Line("static const int {}{}[] = {{{}}};", prefix_, name, Joined(items));
    }
  }

  // Rows, columns and one step of Newton's method, for each block.
  void Closure(const ClosureFormulas& closure, const std::string& tag) {
    const char* array = tag.empty() ? "q" : "d";
    for (size_t b = 0; b < closure.blocks.size(); ++b) {
      const ClosureBlock& block = closure.blocks[b];
      // What stays while the block is searched comes first.
      std::vector<Expr> all = block.residual, moving;
      Append(block.columns, &all);
      for (const int k : block.rates) {
        const TreeRate& rate = f_.rates[static_cast<size_t>(k)];
        const int parts = rate.ball < 0 ? 1 : 4;
        for (int part = 0; part < parts; ++part) {
          moving.push_back(f_.x[static_cast<size_t>(rate.x) + static_cast<size_t>(part)]);
        }
      }
      const std::vector<Expr> fixed = f_.graph.FixedParts(all, moving);
      most_fixed_ = std::max(most_fixed_, fixed.size());
      Function(fmt::format("fixed{}_{}", tag, b), {{"x", &f_.x}, {array, &closure.q}},
               {{"k", fixed}});
      Function(fmt::format("rows{}_{}", tag, b), {{"x", &f_.x}, {"k", &fixed}},
               {{"r", block.residual}, {"J", block.columns}}, fixed, "k");
      if (tag.empty()) {
        PoseFunction(fmt::format("others_{}", b), {{"q", &closure.q}}, {{"c", block.others}});
        PoseFunction(fmt::format("bias_{}", b), {{"u", &f_.u}, {"q", &closure.q}},
                     {{"r", block.bias}});
      }
      StepFunction(block, tag, b);
    }
    if (tag.empty()) {
      text_ += python_ ? "\n\n" : "\n";
      for (size_t b = 0; b < closure.blocks.size(); ++b) {
        IntArray(fmt::format("{}rates_{}", python_ ? "_" : "", b), closure.blocks[b].rates);
        IntArray(fmt::format("{}known_{}", python_ ? "_" : "", b), closure.blocks[b].known);
      }
    }
    ReachFunction(closure, tag, array);
  }

  void StepFunction(const ClosureBlock& block, const std::string& tag, size_t b) {
    const size_t m = block.rates.size();
    if (python_) {
      Line("\n\ndef _step{}_{}(x, k):", tag, b);
      Line("    \"\"\"One step of Newton's method: its size, or None where it is singular.\"\"\"");
      Line("    r, J = _rows{}_{}(x, k)", tag, b);
      Line("    pivot = _factor(J, {})", m);
      Line("    if pivot is None:\n        return None");
      Line("    _solve(J, pivot, {}, r)", m);
    } else {
      Line("\nstatic inline int {}step{}_{}(double x[], const double k[], double* size) {{",
           prefix_, tag, b);
      Line("  double r[{}], J[{}];\n  int pivot[{}];", m, m * m, m);
      Line("  {}rows{}_{}(x, k, r, J);", prefix_, tag, b);
      Line("  if (!{}factor(J, {}, pivot)) return 0;", prefix_, m);
      Line("  {}solve(J, pivot, {}, r);", prefix_, m);
    }
    const char* in = python_ ? "    " : "  ";
    const char* end = python_ ? "" : ";";
    std::map<int, std::array<std::string, 3>> balls;  // by place in x
    std::vector<std::string> sizes;
    for (size_t i = 0; i < m; ++i) {
      const TreeRate& rate = f_.rates[static_cast<size_t>(block.rates[i])];
      const std::string part = fmt::format("r[{}]", i);
      sizes.push_back(rate.length ? part + "/" + NumberText(f_.length) : part);
      if (rate.ball < 0) {
        Line("{}x[{}] -= {}{}", in, rate.x, part, end);
      } else {
        auto& turn = balls.try_emplace(rate.x, std::array<std::string, 3>{"0.0", "0.0", "0.0"})
                         .first->second;
        turn[static_cast<size_t>(rate.ball)] = "-" + part;
      }
    }
    for (const auto& [x, turn] : balls) {
      if (python_) {
        Line("    _turn(x, {}, {}, {}, {})", x, turn[0], turn[1], turn[2]);
      } else {
        Line("  {}turn(&x[{}], {}, {}, {});", prefix_, x, turn[0], turn[1], turn[2]);
      }
    }
    if (python_) {
      std::vector<std::string> magnitudes;
      magnitudes.reserve(sizes.size());
      for (const std::string& size : sizes) magnitudes.push_back("abs(" + size + ")");
      Line("    return max([");
      text_ += List(magnitudes, "        ");
      Line("    ])");
      return;
    }
    Line("  *size = 0.0;");
    for (const std::string& size : sizes) {
      Line("  if (!(fabs({}) <= *size)) *size = fabs({});", size, size);
    }
    Line("  return 1;\n}}");
  }

  void ReachFunction(const ClosureFormulas& closure, const std::string& tag, const char* array) {
    if (python_) {
      Line("\n\ndef _reach{}(x, {}):", tag, array);
      Line("    \"\"\"Newton's method from x.\"\"\"");
    } else {
      Line("\n/* Newton's method from x. */");
      Line("static inline int {}reach{}(double x[], const double {}[]) {{", prefix_, tag, array);
      if (!closure.blocks.empty()) {
        Line("  double size = 1.0, k[{}];\n  int i;", std::max<size_t>(1, most_fixed_));
      }
    }
    const char* in = python_ ? "    " : "  ";
    const char* end = python_ ? "" : ";";
    bool used = !closure.blocks.empty();
    for (size_t k = 0; k < closure.direct.size(); ++k) {
      if (closure.direct[k] < 0) continue;
      used = true;
      Line("{}x[{}] = {}[{}]{}", in, f_.rates[static_cast<size_t>(closure.direct[k])].x, array, k,
           end);
    }
    for (size_t b = 0; b < closure.blocks.size(); ++b) {
      if (python_) {
        Line("    k = _fixed{}_{}(x, {})", tag, b, array);
        Line("    for _ in range(STEPS):");
        Line("        size = _step{}_{}(x, k)", tag, b);
        Line("        if size is None:\n            return SINGULAR");
        Line("        if size < 1e-9 or not size < 0.7:\n            break");
        Line("    if not size < 1e-9:\n        return UNREACHABLE");
      } else {
        Line("  size = 1.0;\n  {}fixed{}_{}(x, {}, k);", prefix_, tag, b, array);
        Line("  for (i = 0; i < {}STEPS && size >= 1e-9; ++i) {{", prefix_);
        Line("    if (!{}step{}_{}(x, k, &size)) return {}SINGULAR;", prefix_, tag, b, prefix_);
        Line("    if (!(size < 0.7)) return {}UNREACHABLE;", prefix_);
        Line("  }}\n  if (!(size < 1e-9)) return {}UNREACHABLE;", prefix_);
      }
    }
    if (python_) {
      Line("    return OK");
    } else {
      if (!used) Line("  (void)x;\n  (void){};", array);
      Line("  return {}OK;\n}}", prefix_);
    }
  }

  void ActuatorFunctions() {
    std::vector<Expr> values, factors, bias;
    for (const ActuatorFormula& actuator : f_.actuators) {
      values.push_back(actuator.value);
      bias.push_back(actuator.bias);
      for (const auto& [rate, factor] : actuator.rates) factors.push_back(factor);
    }
    PoseFunction("actuator_positions", {}, {{"d", values}});
    PoseFunction("actuator_rates", {}, {{"c", factors}});
    PoseFunction("actuator_bias", {{"u", &f_.u}}, {{"b", bias}});
  }

  // "c[0]*G[3*n + k] + …" of an actuator.
  [[nodiscard]] std::string ActuatorSum(size_t actuator, const std::string& array,
                                        const std::string& index) const {
    size_t at = 0;
    for (size_t a = 0; a < actuator; ++a) at += f_.actuators[a].rates.size();
    std::vector<std::string> parts;
    for (const auto& [rate, factor] : f_.actuators[actuator].rates) {
      parts.push_back(fmt::format(
          "c[{}]*{}[{}]", at++, array,
          index.empty() ? std::to_string(rate) : fmt::format("{}*{} + {}", rate, n(), index)));
    }
    std::string sum;
    for (const std::string& part : parts) {
      sum += (sum.empty() ? "" : parts.size() > 3 ? "\n      + " : " + ") + part;
    }
    if (sum.empty()) return "0.0";
    return python_ && parts.size() > 3 ? "(" + sum + ")" : sum;
  }

  [[nodiscard]] size_t factors() const {
    size_t count = 0;
    for (const ActuatorFormula& actuator : f_.actuators) count += actuator.rates.size();
    return std::max<size_t>(1, count);
  }
  [[nodiscard]] size_t LargestBlock() const {
    size_t largest = 1;
    for (const ClosureBlock& block : f_.closure.blocks)
      largest = std::max(largest, block.rates.size());
    return largest;
  }

  void Heading(const char* start, const char* in, const char* end) {
    text_ += start;
    for (const std::string& line : o_.heading) text_ += line.empty() ? "\n" : in + line + "\n";
    text_ += end;
  }

  void CHead() {
    Heading("/*\n", " * ", " */\n");
    std::string guard = prefix_;
    std::ranges::transform(guard, guard.begin(), [](char c) {
      return static_cast<char>(std::toupper(static_cast<unsigned char>(c)));
    });
    Line("#ifndef {}H\n#define {}H\n\n#include <math.h>\n", guard, guard);
    size_t factors = 0, pivots = 0, others = 0;
    for (const ClosureBlock& block : f_.closure.blocks) {
      factors += block.rates.size() * block.rates.size();
      pivots += block.rates.size();
      others += block.others.size();
    }
    Line("enum {{");
    Line("  {}N = {},          /* coordinates q */", prefix_, n());
    Line("  {}ACTUATORS = {},  /* drives and prescribed joints */", prefix_, actuators());
    Line("  {}X = {},          /* coordinates of the joints' tree */", prefix_, f_.x.size());
    Line("  {}RATES = {},      /* and their rates */", prefix_, f_.rates.size());
    Line("  {}STEPS = 12       /* of Newton's method at most */", prefix_);
    Line("}};");
    Line("enum {{");
    Line("  {}OK = 0,", prefix_);
    Line("  {}UNREACHABLE = 1, /* the loops do not close there, or not on this branch */", prefix_);
    Line("  {}SINGULAR = 2,    /* the coordinates or the actuators do not hold it there */",
         prefix_);
    Line("  {}OUTSIDE = 3      /* of the range that is proved */", prefix_);
    Line("}};\n");
    Line("/* A pose and what belongs to it. Begin with {}home(); copies are free. */", prefix_);
    Line("typedef struct {{");
    Line("  double q[{}N];          /* coordinates */", prefix_);
    Line("  double x[{}];            /* of the joints' tree */", std::max<size_t>(1, f_.x.size()));
    Line("  double t[{}];            /* sines and cosines of these */",
         std::max<size_t>(1, waves_.size()));
    Line("  double G[{}];            /* its rates per rate of q, by rows */",
         std::max<size_t>(1, f_.rates.size() * n()));
    Line("  double lu[{}], c[{}];", std::max<size_t>(1, factors), std::max<size_t>(1, others));
    Line("  int pivot[{}];", std::max<size_t>(1, pivots));
    Line("}} {}pose;", prefix_);
  }

  void PythonHead() {
    Heading("\"\"\"", "", "\"\"\"\n");
    Line("from math import atan2, cos, exp, sin, sqrt  # noqa: F401\n");
    Line("OK, UNREACHABLE, SINGULAR, OUTSIDE = range(4)");
    Line("N, ACTUATORS, X, RATES, STEPS = {}, {}, {}, {}, 12\n", n(), actuators(), f_.x.size(),
         f_.rates.size());
  }

  void CBody() {
    // Rates per rate of q, block by block.
    Line("\n/* The rates of a pose's x; lu, c and pivot. 0 where it is singular. */");
    Line("static inline int {}prepare({}pose* p) {{", prefix_, prefix_);
    if (!f_.closure.blocks.empty()) {
      Line("  double r[{}], fixed[{}];\n  int i, j, k;", LargestBlock(),
           std::max<size_t>(1, most_fixed_));
      Line("  for (i = 0; i < {}RATES * {}N; ++i) p->G[i] = 0.0;", prefix_, prefix_);
    } else {
      Line("  int i;\n  for (i = 0; i < {}RATES * {}N; ++i) p->G[i] = 0.0;", prefix_, prefix_);
    }
    for (size_t k = 0; k < n(); ++k) {
      if (f_.closure.direct[k] < 0) continue;
      Line("  p->G[{}] = 1.0;", f_.closure.direct[k] * static_cast<int>(n()) + static_cast<int>(k));
    }
    Line("  {}waves(p->x, p->t);", prefix_);
    size_t lu = 0, pivot = 0, c = 0;
    for (size_t b = 0; b < f_.closure.blocks.size(); ++b) {
      const ClosureBlock& block = f_.closure.blocks[b];
      const size_t m = block.rates.size(), known = block.known.size();
      Line("  {}fixed_{}(p->x, p->q, fixed);", prefix_, b);
      Line("  {}rows_{}(p->x, fixed, r, &p->lu[{}]);", prefix_, b, lu);
      Line("  if (!{}factor(&p->lu[{}], {}, &p->pivot[{}])) return 0;", prefix_, lu, m, pivot);
      if (known > 0) Line("  {}others_{}(p->x, p->t, p->q, &p->c[{}]);", prefix_, b, c);
      Line("  for (k = 0; k < {}N; ++k) {{", prefix_);
      Line("    for (i = 0; i < {}; ++i) {{", m);
      Line("      r[i] = 0.0;");
      if (known > 0) {
        Line(
            "      for (j = 0; j < {}; ++j) r[i] -= p->c[{} + i * {} + j] * p->G[{}known_{}[j] * "
            "{}N + k];",
            known, c, known, prefix_, b, prefix_);
      }
      Line("    }}");
      for (size_t i = 0; i < m; ++i) {
        if (block.commanded[i] < 0) continue;
        Line("    if (k == {}) r[{}] += {};", block.commanded[i], i, NumberText(block.weight[i]));
      }
      Line("    {}solve(&p->lu[{}], &p->pivot[{}], {}, r);", prefix_, lu, pivot, m);
      Line("    for (i = 0; i < {}; ++i) p->G[{}rates_{}[i] * {}N + k] = r[i];", m, prefix_, b,
           prefix_);
      Line("  }}");
      lu += m * m, pivot += m, c += block.others.size();
    }
    if (!f_.closure.blocks.empty()) Line("  (void)j;");
    Line("  return 1;\n}}");

    Line("\n/* 0 where a loop is open by more than {} (lengths by {} m). */",
         NumberText(o_.tolerance), NumberText(f_.length));
    Line("static inline int {}closed(const double x[], const double q[]) {{", prefix_);
    const size_t gaps = f_.closure.gaps.size();
    Line("  double r[{}], t[{}];\n  int i;", std::max<size_t>(1, gaps),
         std::max<size_t>(1, waves_.size()));
    Line("  {0}waves(x, t);\n  {0}gaps(x, t, q, r);", prefix_);
    Line("  for (i = 0; i < {}; ++i) {{", gaps);
    Line("    if (!(fabs(r[i]) <= {})) return 0;", NumberText(o_.tolerance));
    Line("  }}\n  return 1;\n}}");

    Line("\n/* The model's home. */");
    Line("static inline int {}home({}pose* p) {{", prefix_, prefix_);
    Line("  static const double q[] = {{\n{}  }};", List(Numbers(f_.closure.home), "    "));
    Line("  static const double x[] = {{\n{}  }};",
         List(f_.x.empty() ? std::vector<std::string>{"0.0"} : Numbers(f_.x_home), "    "));
    Fixed(R"code(  int i;
  for (i = 0; i < @N; ++i) p->q[i] = q[i];
  for (i = 0; i < @X; ++i) p->x[i] = x[i];
  return @prepare(p) ? @OK : @SINGULAR;
}
)code");
    CClose("", "", "the coordinates", "for (i = 0; i < @N; ++i) from[i] = p->q[i];",
           "for (i = 0; i < @N; ++i) next.q[i] = to[i];");
    Fixed(
        "\n/* Positions of the actuators. */\n"
        "static inline void @actuators(const @pose* p, double d[]) {\n"
        "  @actuator_positions(p->x, p->t, d);\n}\n");
    if (f_.from_actuators) {
      CClose("_by_actuators", "d", "the actuators' positions", "@actuators(p, from);",
             "@waves(next.x, next.t);\n  @coordinates(next.x, next.t, next.q);");
    }
    CMotion();
    if (o_.table) CTable();
    if (square()) CSelfTest();
    Line("\n#endif");
  }

  void CClose(const char* suffix, const char* tag, const char* what, const char* from,
              const char* take) {
    Line("\n/* To {} from the pose at hand, by a way so short that the branch is kept.", what);
    Line(" * Where that fails, p stays as it was. */");
    Line("static inline int {0}close{1}({0}pose* p, const double to[]) {{", prefix_, suffix);
    Line("  double from[{}N];\n  {}pose next = *p;", prefix_, prefix_);
    Line("  int i, k, parts, status = {}UNREACHABLE;", prefix_);
    Line("  {}", Named(from, prefix_));
    Line("  for (parts = 1; parts <= 64 && status != {}OK; parts *= 2) {{", prefix_);
    Line("    next = *p;\n    status = {}OK;", prefix_);
    Line("    for (k = 1; k <= parts && status == {}OK; ++k) {{", prefix_);
    Line("      double at[{}N];", prefix_);
    Line("      for (i = 0; i < {}N; ++i) {{", prefix_);
    Line("        at[i] = k == parts ? to[i] : from[i] + (to[i] - from[i]) * k / parts;\n      }}");
    Line("      status = {}reach{}(next.x, at);\n    }}\n  }}", prefix_, tag);
    Line("  if (status != {}OK) return status;", prefix_);
    Line("  {}", Named(take, prefix_));
    Fixed(R"code(  if (!@closed(next.x, next.q)) return @UNREACHABLE;
  if (!@prepare(&next)) return @SINGULAR;
  *p = next;
  return @OK;
}
)code");
  }

  void CMotion() {
    const auto& blocks = f_.closure.blocks;
    Fixed(
        "\n/* Rates u of x and their derivatives du, for rates v and accelerations a of q. */\n"
        "static inline void @motion(const @pose* p, const double v[], const double a[], double "
        "u[],\n"
        "                           double du[]) {\n");
    if (!blocks.empty()) Line("  double r[{}];\n  int j;", LargestBlock());
    Fixed(R"code(  int i, k;
  for (i = 0; i < @RATES; ++i) {
    u[i] = 0.0;
    du[i] = 0.0;
    for (k = 0; k < @N; ++k) u[i] += p->G[i * @N + k] * v[k];
  }
)code");
    for (size_t k = 0; k < n(); ++k) {
      if (f_.closure.direct[k] >= 0) Line("  du[{}] = a[{}];", f_.closure.direct[k], k);
    }
    size_t lu = 0, pivot = 0, c = 0;
    bool others = false;
    for (size_t b = 0; b < blocks.size(); ++b) {
      const size_t m = blocks[b].rates.size(), known = blocks[b].known.size();
      Line("  {}bias_{}(p->x, p->t, u, p->q, r);", prefix_, b);
      Line("  for (i = 0; i < {}; ++i) {{\n    r[i] = -r[i];", m);
      if (known > 0) {
        others = true;
        Line("    for (j = 0; j < {}; ++j) r[i] -= p->c[{} + i * {} + j] * du[{}known_{}[j]];",
             known, c, known, prefix_, b);
      }
      Line("  }}");
      for (size_t i = 0; i < m; ++i) {
        if (blocks[b].commanded[i] < 0) continue;
        Line("  r[{}] += {} * a[{}];", i, NumberText(blocks[b].weight[i]), blocks[b].commanded[i]);
      }
      Line("  {}solve(&p->lu[{}], &p->pivot[{}], {}, r);", prefix_, lu, pivot, m);
      Line("  for (i = 0; i < {}; ++i) du[{}rates_{}[i]] = r[i];", m, prefix_, b);
      lu += m * m, pivot += m, c += blocks[b].others.size();
    }
    if (!blocks.empty() && !others) Line("  (void)j;");
    Line("  (void)a;\n}}");

    Fixed(
        "\n/* Rates of the actuators per rate of q, ACTUATORS x N by rows. */\n"
        "static inline void @jacobian(const @pose* p, double J[]) {\n");
    Line("  double c[{}];\n  int k;\n  {}actuator_rates(p->x, p->t, c);", factors(), prefix_);
    Line("  for (k = 0; k < {}N; ++k) {{", prefix_);
    for (size_t i = 0; i < actuators(); ++i) {
      Line("    J[{} + k] = {};", i * n(), ActuatorSum(i, "p->G", "k"));
    }
    Line("  }}\n  (void)c;\n  (void)J;\n}}");

    Fixed(
        "\n/* Rates dd and accelerations ddd of the actuators. */\n"
        "static inline void @actuator_motion(const @pose* p, const double v[], const double a[],\n"
        "                                    double dd[], double ddd[]) {\n");
    Line("  double u[{0}], du[{0}], c[{1}];", std::max<size_t>(1, f_.rates.size()), factors());
    Fixed(
        "  @motion(p, v, a, u, du);\n  @actuator_rates(p->x, p->t, c);\n  @actuator_bias(p->x, "
        "p->t, u, "
        "ddd);\n");
    for (size_t i = 0; i < actuators(); ++i) {
      Line("  dd[{}] = {};", i, ActuatorSum(i, "u", ""));
      Line("  ddd[{}] += {};", i, ActuatorSum(i, "du", ""));
    }
    Line("  (void)c;\n  (void)dd;\n}}");

    Fixed(R"code(
/* Time derivative of the Jacobian at rates v, ACTUATORS x N by rows. */
static inline void @jacobian_rate(const @pose* p, const double v[], double Jd[]) {
  double w[@N], still[@N], dd[@ACTUATORS + 1], plus[@ACTUATORS + 1], minus[@ACTUATORS + 1];
  int i, k;
  for (k = 0; k < @N; ++k) {
    w[k] = v[k];
    still[k] = 0.0;
  }
  for (k = 0; k < @N; ++k) {
    w[k] = v[k] + 1.0;
    @actuator_motion(p, w, still, dd, plus);
    w[k] = v[k] - 1.0;
    @actuator_motion(p, w, still, dd, minus);
    w[k] = v[k];
    for (i = 0; i < @ACTUATORS; ++i) Jd[i * @N + k] = 0.25 * (plus[i] - minus[i]);
  }
}
)code");
    for (size_t o = 0; o < f_.outputs.size(); ++o) {
      Line("\n/* {}: x, y, z, roll, pitch, yaw in its reference frame. */",
           InComment(f_.outputs[o].name));
      Line("static inline void {0}pose_{1}(const {0}pose* p, double pose[]) {{", prefix_, o);
      Line("  {}output_{}(p->x, p->t, pose);\n}}", prefix_, o);
    }
    if (f_.forces.empty()) return;
    Fixed(
        "\n/* Forces that the motion needs along each coordinate. */\n"
        "static inline void @forces(const @pose* p, const double v[], const double a[],\n"
        "                           double f[]) {\n");
    Line("  double u[{0}], du[{0}], t[{0}];\n  int i, k;", std::max<size_t>(1, f_.rates.size()));
    Fixed(R"code(  @motion(p, v, a, u, du);
  @tree_forces(p->x, p->t, u, du, t);
  for (k = 0; k < @N; ++k) {
    f[k] = 0.0;
    for (i = 0; i < @RATES; ++i) f[k] += p->G[i * @N + k] * t[i];
  }
}
)code");
    if (!square()) return;
    Fixed(R"code(
/* Forces of the actuators. more: what is needed along each coordinate beyond the model's own,
 * or 0. */
static inline int @inverse_dynamics(const @pose* p, const double v[], const double a[],
                                    const double more[], double tau[]) {
  double J[@N * @N], A[@N * @N];
  int pivot[@N];
  int i, k;
  @forces(p, v, a, tau);
  if (more != 0) {
    for (k = 0; k < @N; ++k) tau[k] += more[k];
  }
  @jacobian(p, J);
  for (i = 0; i < @N; ++i) {
    for (k = 0; k < @N; ++k) A[k * @N + i] = J[i * @N + k];
  }
  if (!@factor(A, @N, pivot)) return @SINGULAR;
  @solve(A, pivot, @N, tau);
  return @OK;
}
)code");
  }

  // Positions of x that Newton's method searches.
  [[nodiscard]] std::vector<int> Searched() const {
    std::vector<int> searched;
    for (const ClosureBlock& block : f_.closure.blocks) {
      for (const int k : block.rates) {
        const TreeRate& rate = f_.rates[static_cast<size_t>(k)];
        for (int part = 0; part < (rate.ball == 0 ? 4 : rate.ball < 0 ? 1 : 0); ++part) {
          searched.push_back(rate.x + part);
        }
      }
    }
    std::ranges::sort(searched);
    return searched;
  }

  [[nodiscard]] std::vector<std::string> TableItems(const std::vector<int>& searched) const {
    std::vector<std::string> items;
    for (Eigen::Index i = 0; i < o_.table->x.rows(); ++i) {
      for (const int k : searched) {
        items.push_back(fmt::format("{:.7g}", o_.table->x(i, k)));
        if (items.back().find_first_of(".e") == std::string::npos) items.back() += ".0";
      }
    }
    return items;
  }

  void CTable() {
    const StartTable& table = *o_.table;
    const std::vector<int> searched = Searched();
    const std::vector<std::string> items = TableItems(searched);
    Line(
        "\n/* The pose at q, by {} steps of Newton's method from a table; the same for the same q.",
        table.steps);
    Line(
        " * Where it is not OUTSIDE, the branch is that of the home pose, and the joints' errors "
        "are");
    Line(" * below {} (angles, lengths by {} m) but for rounding. */", NumberText(table.bound),
         NumberText(f_.length));
    Line("static inline int {0}at({0}pose* p, const double q[]) {{", prefix_);
    Line("  static const double low[] = {{\n{}  }};", List(Numbers(table.low), "    "));
    Line("  static const double high[] = {{\n{}  }};", List(Numbers(table.high), "    "));
    Line("  static const int nodes[] = {{{}}}, cells[] = {{{}}};", Joined(Numbers(table.nodes)),
         Joined(Numbers(table.cells)));
    Line("  static const unsigned char proved[] = {{\n{}  }};",
         List(Numbers(BytesOf(table.proved)), "    "));
    if (!searched.empty()) {
      Line("  static const double table[] = {{\n{}  }};", List(items, "    "));
      Line("  static const int searched[] = {{{}}};", Joined(Numbers(searched)));
    }
    Line("  double part[{}N];\n  int first[{}N];", prefix_, prefix_);
    Line("  int i, k, corner, cell = 0;");
    Fixed(R"code(  for (k = 0; k < @N; ++k) {
    const double t = (q[k] - low[k]) / (high[k] - low[k]);
    if (!(t >= 0.0 && t <= 1.0)) return @OUTSIDE;
    i = (int)(t * cells[k]);
    if (i == cells[k]) --i;
    cell = cell * cells[k] + i;
    first[k] = (int)(t * (nodes[k] - 1));
    if (first[k] == nodes[k] - 1) --first[k];
    part[k] = t * (nodes[k] - 1) - first[k];
    p->q[k] = q[k];
  }
  if (((proved[cell >> 3] >> (cell & 7)) & 1) == 0) return @OUTSIDE;
  for (i = 0; i < @X; ++i) p->x[i] = 0.0;
  for (corner = 0; corner < (1 << @N); ++corner) {
    double weight = 1.0;
    int node = 0;
    for (k = 0; k < @N; ++k) {
      const int upper = (corner >> k) & 1;
      weight *= upper != 0 ? part[k] : 1.0 - part[k];
      node = node * nodes[k] + first[k] + upper;
    }
)code");
    if (!searched.empty()) {
      Line(
          "    for (i = 0; i < {}; ++i) {{\n      p->x[searched[i]] += weight * table[node * {} + "
          "i];\n    }}",
          searched.size(), searched.size());
    } else {
      Line("    (void)weight;\n    (void)node;");
    }
    Line("  }}");
    for (size_t k = 0; k < n(); ++k) {
      if (f_.closure.direct[k] < 0) continue;
      Line("  p->x[{}] = q[{}];", f_.rates[static_cast<size_t>(f_.closure.direct[k])].x, k);
    }
    for (const TreeRate& rate : f_.rates) {
      if (rate.ball == 0) Line("  {}turn(&p->x[{}], 0.0, 0.0, 0.0);", prefix_, rate.x);
    }
    if (!f_.closure.blocks.empty()) {
      Line("  {{\n    double size, fixed[{}];", std::max<size_t>(1, most_fixed_));
      for (size_t b = 0; b < f_.closure.blocks.size(); ++b) {
        Line("    {}fixed_{}(p->x, q, fixed);", prefix_, b);
        Line("    for (i = 0; i < {}; ++i) {{", table.steps);
        Line("      if (!{}step_{}(p->x, fixed, &size)) return {}SINGULAR;\n    }}", prefix_, b,
             prefix_);
      }
      Line("  }}");
    }
    Line("  return {0}prepare(p) ? {0}OK : {0}SINGULAR;\n}}", prefix_);
  }

  // Rows of q, v, a, actuators, forces.
  [[nodiscard]] std::string TestRows(const char* open, const char* close, const char* in) const {
    std::string rows;
    for (const TestState& test : o_.tests) {
      std::vector<std::string> items;
      for (const VecX* part :
           {&test.q, &test.v, &test.a, &test.more, &test.actuators, &test.forces}) {
        Append(Numbers(*part), &items);
      }
      rows +=
          fmt::format("{}{}\n{}{}{},\n", in, open, List(items, std::string(in) + "  "), in, close);
    }
    return rows;
  }

  void CSelfTest() {
    Line(
        "\n/* The largest difference from what the reference of mbverify found at some states, by "
        "the");
    Line(" * largest position and the largest force there; 1e300 where a state is not reached. */");
    Line("static inline double {}self_test(void) {{", prefix_);
    Line("  static const double tests[][6 * {}N] = {{ /* q, v, a, more, positions, forces */",
         prefix_);
    text_ += TestRows("{", "}", "    ");
    Line("  }};");
    Line("  double worst[2] = {{0.0, 0.0}}, largest[2] = {{1e-300, 1e-300}};");
    Line("  double d[{0}N], tau[{0}N];\n  int i, k;", prefix_);
    Line("  for (i = 0; i < {}; ++i) {{", o_.tests.size());
    Fixed(R"code(    const double* t = tests[i];
    @pose p;
    if (@home(&p) != @OK || @close(&p, t) != @OK) return 1e300;
    @actuators(&p, d);
    if (@inverse_dynamics(&p, t + @N, t + 2 * @N, t + 3 * @N, tau) != @OK) return 1e300;
    for (k = 0; k < @N; ++k) {
      const double position = t[4 * @N + k], force = t[5 * @N + k];
      if (!(fabs(d[k] - position) <= worst[0])) worst[0] = fabs(d[k] - position);
      if (!(fabs(tau[k] - force) <= worst[1])) worst[1] = fabs(tau[k] - force);
      if (fabs(position) > largest[0]) largest[0] = fabs(position);
      if (fabs(force) > largest[1]) largest[1] = fabs(force);
    }
  }
  worst[0] /= largest[0];
  worst[1] /= largest[1];
  return worst[0] >= worst[1] ? worst[0] : worst[1];
}
)code");
  }

  // Rates, known rates, places in lu and c, commanded rows of each block, as the functions below
  // take them.
  void PythonBlocks() {
    Line(
        "\n\n_BLOCKS = [  # fixed, rows, others, bias, rates, known rates, (row, coordinate, "
        "weight)");
    for (size_t b = 0; b < f_.closure.blocks.size(); ++b) {
      const ClosureBlock& block = f_.closure.blocks[b];
      std::vector<std::string> commanded;
      for (size_t i = 0; i < block.commanded.size(); ++i) {
        if (block.commanded[i] < 0) continue;
        commanded.push_back(
            fmt::format("({}, {}, {})", i, block.commanded[i], NumberText(block.weight[i])));
      }
      Line(
          "    (_fixed_{0}, _rows_{0}, _others_{0}, _bias_{0}, _rates_{0}, _known_{0},\n     "
          "[{1}]),",
          b, Joined(commanded));
    }
    Line("]");
    std::vector<std::string> direct;
    for (size_t k = 0; k < n(); ++k) {
      if (f_.closure.direct[k] >= 0)
        direct.push_back(fmt::format("({}, {})", f_.closure.direct[k], k));
    }
    Line("_DIRECT = [\n{}]", List(direct, "    "));
    Line("_ACTUATORS = [  # (entry of the rates, place of its factor)");
    size_t at = 0;
    for (const ActuatorFormula& actuator : f_.actuators) {
      std::vector<std::string> parts;
      for (const auto& [rate, factor] : actuator.rates) {
        parts.push_back(fmt::format("({}, {})", rate, at++));
      }
      Line("    [\n{}    ],", List(parts, "        "));
    }
    Line("]");
  }

  void PythonBody() {
    PythonBlocks();
    Fixed(R"code(

class Pose:
    """A pose and what belongs to it. Begins at home."""

    def __init__(self):
        self.q = [)code");
    text_ += Joined(Numbers(f_.closure.home)) + "]\n        self.x = [\n" +
             List(Numbers(f_.x_home), "            ") + "        ]\n";
    Line("        _prepare(self)\n");
    Line("    def copy(self):");
    Line("        other = Pose.__new__(Pose)");
    Line("        other.__dict__.update(self.__dict__)");
    Line("        other.q, other.x = list(self.q), list(self.x)\n        return other\n");
    Fixed(R"code(
def _prepare(p):
    """Rates of x per rate of q: G, RATES x N by rows."""
    p.G = [0.0] * (RATES * N)
    p.factors = []
    for rate, k in _DIRECT:
        p.G[rate * N + k] = 1.0
    p.t = _waves(p.x)
    for fixed, rows, others, _, rates, known, commanded in _BLOCKS:
        m = len(rates)
        _, lu = rows(p.x, fixed(p.x, p.q))
        pivot = _factor(lu, m)
        if pivot is None:
            return False
        c = others(p.x, p.t, p.q)
        p.factors.append((lu, pivot, c))
        for k in range(N):
            r = [-sum(c[i * len(known) + j] * p.G[rate * N + k] for j, rate in enumerate(known))
                 for i in range(m)]
            for i, coordinate, weight in commanded:
                if coordinate == k:
                    r[i] += weight
            _solve(lu, pivot, m, r)
            for i in range(m):
                p.G[rates[i] * N + k] = r[i]
    return True

def _close(p, to, start, reach, take):
    for halvings in range(7):
        parts, x, status = 2 ** halvings, list(p.x), OK
        for k in range(1, parts + 1):
            at = to if k == parts else [a + (b - a) * k / parts for a, b in zip(start, to)]
            status = reach(x, at)
            if status != OK:
                break
        if status == OK:
            break
    if status != OK:
        return status
    found = p.copy()
    found.x, found.q = x, take(x)
)code");
    Line("    if not all(abs(gap) <= {} for gap in _gaps(x, _waves(x), found.q)):",
         NumberText(o_.tolerance));
    Fixed(R"code(        return UNREACHABLE
    if not _prepare(found):
        return SINGULAR
    p.__dict__.update(found.__dict__)
    return OK

def close(p, q):
    """To the coordinates from the pose at hand, by a way so short that the branch is kept. Where
    that fails, p stays as it was."""
    return _close(p, list(q), p.q, _reach, lambda x: list(q))

def actuators(p):
    """Their positions."""
    return _actuator_positions(p.x, p.t)
)code");
    if (f_.from_actuators) {
      Fixed(R"code(

def close_by_actuators(p, d):
    """As close(), to positions of the actuators."""
    return _close(p, list(d), actuators(p), _reachd, lambda x: _coordinates(x, _waves(x)))
)code");
    }
    Fixed(R"code(

def _motion(p, v, a):
    u = [sum(p.G[i * N + k] * v[k] for k in range(N)) for i in range(RATES)]
    du = [0.0] * RATES
    for rate, k in _DIRECT:
        du[rate] = a[k]
    for (_, _, _, bias, rates, known, commanded), (lu, pivot, c) in zip(_BLOCKS, p.factors):
        r = [-value for value in bias(p.x, p.t, u, p.q)]
        for i in range(len(rates)):
            r[i] -= sum(c[i * len(known) + j] * du[rate] for j, rate in enumerate(known))
        for i, coordinate, weight in commanded:
            r[i] += weight * a[coordinate]
        _solve(lu, pivot, len(rates), r)
        for i, rate in enumerate(rates):
            du[rate] = r[i]
    return u, du

def jacobian(p):
    """Rates of the actuators per rate of q: a list per actuator."""
    c = _actuator_rates(p.x, p.t)
    return [[sum(c[at] * p.G[rate * N + k] for rate, at in parts) for k in range(N)]
            for parts in _ACTUATORS]

def actuator_motion(p, v, a):
    """Rates and accelerations of the actuators."""
    u, du = _motion(p, v, a)
    c, bias = _actuator_rates(p.x, p.t), _actuator_bias(p.x, p.t, u)
    return ([sum(c[at] * u[rate] for rate, at in parts) for parts in _ACTUATORS],
            [b + sum(c[at] * du[rate] for rate, at in parts) for b, parts in zip(bias, _ACTUATORS)])

def jacobian_rate(p, v):
    """Time derivative of the Jacobian at rates v."""
    still, columns = [0.0] * N, []
    for k in range(N):
        up, down = list(v), list(v)
        up[k] += 1.0
        down[k] -= 1.0
        columns.append([0.25 * (b - a) for a, b in zip(actuator_motion(p, down, still)[1],
                                                      actuator_motion(p, up, still)[1])])
    return [list(row) for row in zip(*columns)]
)code");
    for (size_t o = 0; o < f_.outputs.size(); ++o) {
      Line("\n\ndef pose_{}(p):", o);
      Line("    \"\"\"{}: x, y, z, roll, pitch, yaw in its reference frame.\"\"\"",
           InComment(f_.outputs[o].name));
      Line("    return _output_{}(p.x, p.t)", o);
    }
    if (!f_.forces.empty()) {
      Fixed(R"code(

def forces(p, v, a):
    """Forces that the motion needs along each coordinate."""
    u, du = _motion(p, v, a)
    t = _tree_forces(p.x, p.t, u, du)
    return [sum(p.G[i * N + k] * t[i] for i in range(RATES)) for k in range(N)]
)code");
    }
    if (square()) {
      Fixed(R"code(

def inverse_dynamics(p, v, a, more=None):
    """Forces of the actuators, or None where they do not hold it. more: what is needed along each
    coordinate beyond the model's own."""
    tau = forces(p, v, a)
    if more is not None:
        tau = [f + m for f, m in zip(tau, more)]
    J = jacobian(p)
    A = [J[i][k] for k in range(N) for i in range(N)]
    pivot = _factor(A, N)
    if pivot is None:
        return None
    _solve(A, pivot, N, tau)
    return tau
)code");
    }
    if (o_.table) PythonTable();
    if (square()) PythonSelfTest();
  }

  void PythonTable() {
    const StartTable& table = *o_.table;
    const std::vector<int> searched = Searched();
    Line("\n\n_LOW, _HIGH = [{}], [{}]", Joined(Numbers(table.low)), Joined(Numbers(table.high)));
    Line("_NODES, _CELLS = [{}], [{}]", Joined(Numbers(table.nodes)), Joined(Numbers(table.cells)));
    Line("_PROVED = bytes([\n{}])", List(Numbers(BytesOf(table.proved)), "    "));
    Line("_SEARCHED = [\n{}]", List(Numbers(searched), "    "));
    Line("_TABLE = [\n{}]", List(TableItems(searched), "    "));
    Line("\n\ndef at(p, q):");
    Line(
        "    \"\"\"The pose at q, by {} steps of Newton's method from a table. Where it is not "
        "OUTSIDE,",
        table.steps);
    Line("    the branch is that of the home pose, and the joints' errors are below {}",
         NumberText(table.bound));
    Line("    (angles, lengths by {} m) but for rounding.\"\"\"", NumberText(f_.length));
    Fixed(R"code(    cell, first, part = 0, [], []
    for k in range(N):
        t = (q[k] - _LOW[k]) / (_HIGH[k] - _LOW[k])
        if not 0.0 <= t <= 1.0:
            return OUTSIDE
        cell = cell * _CELLS[k] + min(int(t * _CELLS[k]), _CELLS[k] - 1)
        first.append(min(int(t * (_NODES[k] - 1)), _NODES[k] - 2))
        part.append(t * (_NODES[k] - 1) - first[k])
    if not _PROVED[cell >> 3] >> (cell & 7) & 1:
        return OUTSIDE
    p.q, p.x = list(q), [0.0] * X
    for corner in range(1 << N):
        weight, node = 1.0, 0
        for k in range(N):
            upper = corner >> k & 1
            weight *= part[k] if upper else 1.0 - part[k]
            node = node * _NODES[k] + first[k] + upper
        for i, place in enumerate(_SEARCHED):
            p.x[place] += weight * _TABLE[node * len(_SEARCHED) + i]
)code");
    for (size_t k = 0; k < n(); ++k) {
      if (f_.closure.direct[k] < 0) continue;
      Line("    p.x[{}] = q[{}]", f_.rates[static_cast<size_t>(f_.closure.direct[k])].x, k);
    }
    for (const TreeRate& rate : f_.rates) {
      if (rate.ball == 0) Line("    _turn(p.x, {}, 0.0, 0.0, 0.0)", rate.x);
    }
    if (!f_.closure.blocks.empty()) {
      for (size_t b = 0; b < f_.closure.blocks.size(); ++b) {
        Line("    fixed = _fixed_{}(p.x, q)", b);
        Line("    for _ in range({}):", table.steps);
        Line("        if _step_{}(p.x, fixed) is None:\n            return SINGULAR", b);
      }
    }
    Line("    return OK if _prepare(p) else SINGULAR");
  }

  void PythonSelfTest() {
    Line("\n\n_TESTS = [  # q, v, a, more, positions, forces");
    text_ += TestRows("[", "]", "    ");
    Fixed(R"code(]

def self_test():
    """The largest difference from what the reference of mbverify found at some states, by the
    largest position and the largest force there; infinite where a state is not reached."""
    worst, largest = [0.0, 0.0], [1e-300, 1e-300]
    for test in _TESTS:
        q, v, a, more, d, tau = (test[k * N:(k + 1) * N] for k in range(6))
        p = Pose()
        if close(p, q) != OK:
            return float("inf")
        found = inverse_dynamics(p, v, a, more)
        if found is None:
            return float("inf")
        for i, (has, wanted) in enumerate(((actuators(p), d), (found, tau))):
            worst[i] = max([worst[i]] + [abs(x - y) for x, y in zip(has, wanted)])
            largest[i] = max([largest[i]] + [abs(y) for y in wanted])
    return max(w / l for w, l in zip(worst, largest))
)code");
  }

  const MechanismFormulas& f_;
  const CodeTextOptions& o_;
  const bool python_;
  const std::string prefix_;
  std::string text_;
  std::vector<Expr> waves_;
  size_t most_fixed_ = 1;  ///< of the blocks so far
};

}  // namespace

std::string InComment(const std::string& text) {
  std::string line = OneLine(text);
  for (const char* end : {"*/", "/*", "\"\"\"", "\\"}) {
    for (size_t at = line.find(end); at != std::string::npos; at = line.find(end)) line[at] = '_';
  }
  return line;
}

std::string CHeader(const MechanismFormulas& formulas, const CodeTextOptions& options) {
  return CodeWriter(formulas, options, false).Text();
}
std::string LookupHeader(const MechanismFormulas& formulas, const LookupTable& table,
                         const CodeTextOptions& options) {
  const std::string prefix = options.name + "_lookup";
  std::string guard = prefix;
  std::ranges::transform(guard, guard.begin(), [](char c) {
    return static_cast<char>(std::toupper(static_cast<unsigned char>(c)));
  });
  std::string text = "/*\n";
  for (const std::string& line : options.heading)
    text += line.empty() ? " *\n" : " * " + line + "\n";
  text +=
      " *\n * The actuators' positions by multilinear interpolation. Proved bounds of its "
      "errors:\n";
  for (size_t a = 0; a < formulas.actuators.size(); ++a) {
    const auto at = static_cast<Eigen::Index>(a);
    text += fmt::format(" *   {}: {:.2g} {}; of its slopes {:.2g}\n",
                        InComment(formulas.actuators[a].name), table.bound[at],
                        formulas.actuators[a].unit, table.slope_bound.row(at).maxCoeff());
  }
  text += fmt::format(" */\n#ifndef {0}_H\n#define {0}_H\n\n", guard);
  const auto n = static_cast<int>(formulas.size()), m = static_cast<int>(formulas.actuators.size());
  text += fmt::format(
      "/* m[{0}] and their slopes J[{0} x {1}] by rows at q[{1}]; 0 outside of what is proved. */\n"
      "static inline int {2}(const double q[], double m[], double J[]) {{\n",
      m, n, prefix);
  const VecX step =
      (table.high - table.low).cwiseQuotient(VecX::NullaryExpr(n, [&](Eigen::Index k) {
        return static_cast<double>(table.nodes[static_cast<size_t>(k)] - 1);
      }));

  std::vector<std::string> values;
  for (Eigen::Index i = 0; i < table.values.rows(); ++i) {
    for (const double value : VecX(table.values.row(i).transpose()))
      values.push_back(NumberText(value));
  }
  text += "  static const double low[] = {" + Joined(Numbers(table.low)) + "};\n";
  text += "  static const double step[] = {" + Joined(Numbers(step)) + "};\n";
  text += "  static const int nodes[] = {" + Joined(Numbers(table.nodes)) + "};\n";
  text += "  static const unsigned char proved[] = {\n" +
          List(Numbers(BytesOf(table.proved)), "    ") + "  };\n";
  text += "  static const double table[] = {\n" + List(values, "    ") + "  };\n";
  text += fmt::format(R"code(  double part[{0}];
  int first[{0}];
  int i, j, k, corner, cell = 0;
  for (k = 0; k < {0}; ++k) {{
    const double t = (q[k] - low[k]) / step[k];
    if (!(t >= 0.0 && t <= nodes[k] - 1)) return 0;
    first[k] = (int)t;
    if (first[k] == nodes[k] - 1) --first[k];
    part[k] = t - first[k];
    cell = cell * (nodes[k] - 1) + first[k];
  }}
  if (((proved[cell >> 3] >> (cell & 7)) & 1) == 0) return 0;
  for (i = 0; i < {1}; ++i) m[i] = 0.0;
  for (i = 0; i < {1} * {0}; ++i) J[i] = 0.0;
  for (corner = 0; corner < (1 << {0}); ++corner) {{
    double weight = 1.0;
    int node = 0;
    for (k = 0; k < {0}; ++k) {{
      const int upper = (corner >> k) & 1;
      weight *= upper != 0 ? part[k] : 1.0 - part[k];
      node = node * nodes[k] + first[k] + upper;
    }}
    for (i = 0; i < {1}; ++i) m[i] += weight * table[node * {1} + i];
    for (k = 0; k < {0}; ++k) {{
      double slope = ((corner >> k) & 1) != 0 ? 1.0 : -1.0;
      for (j = 0; j < {0}; ++j) {{
        if (j != k) slope *= ((corner >> j) & 1) != 0 ? part[j] : 1.0 - part[j];
      }}
      for (i = 0; i < {1}; ++i) J[i * {0} + k] += slope / step[k] * table[node * {1} + i];
    }}
  }}
  return 1;
}}

#endif
)code",
                      n, m);
  return text;
}
std::string PythonModule(const MechanismFormulas& formulas, const CodeTextOptions& options) {
  return CodeWriter(formulas, options, true).Text();
}

}  // namespace mbv
