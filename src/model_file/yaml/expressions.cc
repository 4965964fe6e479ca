#include "model_file/yaml/expressions.h"

#include <fmt/format.h>
#include <muParser.h>

#include <algorithm>
#include <bit>
#include <cctype>
#include <cmath>
#include <cstdint>
#include <memory>
#include <mutex>
#include <numbers>
#include <unordered_map>

#include "base/diagnostics.h"
#include "base/text.h"
#include "model_file/yaml/yaml_reader.h"

namespace mbv {
namespace {

constexpr size_t kMaxExpression = 2000;  // characters
constexpr size_t kMaxChain = 200;        // parameters that refer to each other

bool IsNameStart(char c) { return std::isalpha(static_cast<unsigned char>(c)) != 0 || c == '_'; }
bool IsNamePart(char c) { return std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '_'; }

mu::Parser& TheParser() {
  thread_local mu::Parser parser;
  return parser;
}

struct UsedName {
  std::string name;
  bool is_call = false;
};

// Names in an expression, numbers such as 1e-3 skipped.
std::vector<UsedName> NamesIn(const std::string& text) {
  std::vector<UsedName> names;
  size_t i = 0;
  while (i < text.size()) {
    if (std::isdigit(static_cast<unsigned char>(text[i])) != 0 || text[i] == '.') {
      while (i < text.size() &&
             (IsNamePart(text[i]) || text[i] == '.' ||
              ((text[i] == '-' || text[i] == '+') && (text[i - 1] == 'e' || text[i - 1] == 'E')))) {
        ++i;
      }
    } else if (IsNameStart(text[i])) {
      const size_t start = i;
      while (i < text.size() && IsNamePart(text[i])) ++i;
      const size_t next = text.find_first_not_of(' ', i);
      names.push_back(
          {text.substr(start, i - start), next != std::string::npos && text[next] == '('});
    } else {
      ++i;
    }
  }
  return names;
}

std::vector<std::string> FunctionNames() {
  std::vector<std::string> names;
  for (const auto& [name, callback] : TheParser().GetFunDef()) names.push_back(name);
  return names;
}

// Assignments and lists would be accepted by muParser and mean something else.
bool HasForeignOperator(const std::string& text) {
  if (text.find('"') != std::string::npos) return true;
  for (size_t i = 0; i < text.size(); ++i) {
    if (text[i] != '=') continue;
    if (i + 1 < text.size() && text[i + 1] == '=') {
      ++i;
    } else if (i == 0 || std::string("<>!").find(text[i - 1]) == std::string::npos) {
      return true;
    }
  }
  return false;
}

constexpr const char* kSeveralValues = "gives several values";

std::string NoExpression(const std::string& why) { return "is not an expression: " + why; }

void Prepare(const std::string& text, const std::map<std::string, double>& constants,
             mu::Parser* parser) {
  parser->ClearConst();
  parser->DefineConst("pi", std::numbers::pi);
  for (const auto& [name, value] : constants) parser->DefineConst(name, value);
  parser->SetExpr(text);
}

ExpressionResult Parse(const std::string& text, const std::map<std::string, double>& values) {
  mu::Parser& parser = TheParser();
  try {
    Prepare(text, values, &parser);
    int count = 0;
    const double* results = parser.Eval(count);
    if (count != 1) return {.value = {}, .error = kSeveralValues, .hint = ""};
    const double value = results[0];
    if (!std::isfinite(value)) {
      return {.value = {},
              .error = fmt::format("gives {}, a finite number is needed", value),
              .hint = "look for a root of a negative number or a division by zero"};
    }
    if (const std::string why = NotANumberReason(value); !why.empty()) {
      return {.value = {}, .error = fmt::format("gives {}, which {}", value, why), .hint = ""};
    }
    return {.value = value, .error = "", .hint = ""};
  } catch (const mu::ParserError& e) {
    return {.value = {}, .error = NoExpression(e.GetMsg()), .hint = ""};
  } catch (const std::exception& e) {
    return {.value = {}, .error = NoExpression(e.what()), .hint = ""};
  }
}

// What an expression's text alone shows, and its parsed form. Models are read again and again with
// other numbers but the same texts, so that both are kept by the text.
class Expression {
 public:
  explicit Expression(const std::string& text) : text_(text), names_(NamesIn(text)) {
    written_out_ = std::ranges::all_of(
        names_, [](const UsedName& used) { return used.is_call || used.name == "pi"; });
  }

  [[nodiscard]] const std::vector<UsedName>& names() const { return names_; }
  [[nodiscard]] bool written_out() const { return written_out_; }

  // With the values of the parameters that it uses, which are always the same ones. The last result
  // is kept; at the second set of values the expression gets a parser of its own, in which
  // parameters are variables: what fails there fails once more in words of the first one.
  ExpressionResult At(const std::map<std::string, double>& values) {
    const auto same = [](const auto& entry, double slot) {  // zeros with their signs
      return std::bit_cast<std::uint64_t>(entry.second) == std::bit_cast<std::uint64_t>(slot);
    };
    if (result_ && std::ranges::equal(values, slots_, same)) return *result_;
    if (result_ && !parser_ && !refused_) MakeParser(values);
    slots_.clear();
    for (const auto& [name, value] : values) slots_.push_back(value);
    if (const std::optional<double> value = Again()) {
      result_ = {.value = value, .error = "", .hint = ""};
    } else {
      result_ = Parse(text_, values);
    }
    return *result_;
  }

 private:
  // Without the parser's rearrangements of variables (x^3 to x*x*x), which change last digits.
  void MakeParser(const std::map<std::string, double>& values) {
    parser_ = std::make_unique<mu::Parser>();
    parser_->EnableOptimizer(false);
    parser_->ClearConst();
    parser_->DefineConst("pi", std::numbers::pi);
    size_t slot = 0;
    for (const auto& [name, value] : values) parser_->DefineVar(name, &slots_[slot++]);
    parser_->SetExpr(text_);
  }

  std::optional<double> Again() {
    if (!parser_) return {};
    try {
      int count = 0;
      const double* results = parser_->Eval(count);
      if (count == 1 && NotANumberReason(results[0]).empty()) return results[0];
    } catch (const mu::ParserError&) {  // no std::exception
      refused_ = true;
    } catch (const std::exception&) {
      refused_ = true;
    }
    if (refused_) parser_.reset();  // evaluated once more, it would run what it has of a program
    return {};
  }

  std::string text_;
  std::vector<UsedName> names_;
  bool written_out_ = false;
  std::vector<double> slots_;  // values of the last result; of one length, so that they stay put
  std::optional<ExpressionResult> result_;
  std::unique_ptr<mu::Parser> parser_;
  bool refused_ = false;  // by the parser: it takes the text with no numbers
};

std::shared_ptr<Expression> ExpressionOf(const std::string& text) {
  constexpr size_t kMostKept = 4'000;
  thread_local std::unordered_map<std::string, std::shared_ptr<Expression>> kept;
  if (text.size() > kMaxExpression) return std::make_shared<Expression>(text);
  if (const auto found = kept.find(text); found != kept.end()) return found->second;
  if (kept.size() >= kMostKept) kept.clear();
  return kept.emplace(text, std::make_shared<Expression>(text)).first->second;
}

// What decides between branches, and the ways in which it can.
struct Decision {
  enum class Kind {
    kTruth,    // 0, 1
    kNotLess,  // of abs: by its sign, −1 and 1
    kSign,     // −1, 0, 1
    kLeast,    // which of the texts
    kLargest,
    kRounded,  // the whole number that is closest
  };
  Kind kind = Kind::kTruth;
  std::vector<std::string> texts;

  bool operator==(const Decision&) const = default;
};

// An expression that muParser takes, with a name in place of what each decision gives.
class BranchedText {
 public:
  /// `varies`: whether a part has variables; only such parts decide.
  BranchedText(const std::string& text, std::function<bool(const std::string&)> varies)
      : varies_(std::move(varies)), text_(Rewritten(text)) {}

  [[nodiscard]] const std::vector<Decision>& decisions() const { return decisions_; }
  [[nodiscard]] const std::string& text() const { return text_; }
  [[nodiscard]] static std::string NameOf(size_t decision) {
    return fmt::format("decided${}", decision);
  }

 private:
  static constexpr std::string_view kComparing = "<>=!", kJoining = "?:,&|";

  // A comparison binds looser than arithmetic, and tighter than && || ?: and commas.
  std::string Rewritten(const std::string& text) {
    if (!varies_(text)) return text;
    std::string out;
    for (size_t from = 0; from <= text.size();) {
      size_t end = from;
      bool compares = false;
      for (int depth = 0; end < text.size(); ++end) {
        const char c = text[end];
        depth += c == '(' ? 1 : c == ')' ? -1 : 0;
        if (depth == 0 && kJoining.find(c) != std::string_view::npos) break;
        compares = compares || (depth == 0 && kComparing.find(c) != std::string_view::npos);
      }
      const std::string side = text.substr(from, end - from);
      if (!varies_(side)) {
        out += side;
      } else {
        out += compares ? " " + Decide(Decision::Kind::kTruth, {side}) + " " : Arithmetic(side);
      }
      if (end < text.size()) out += text[end];
      from = end + 1;
    }
    return out;
  }

  // Without comparisons outside parentheses.
  std::string Arithmetic(const std::string& text) {
    std::string out, name;
    for (size_t i = 0; i < text.size(); ++i) {
      if (text[i] != '(') {
        if (IsNamePart(text[i])) {
          const bool goes_on = i > 0 && IsNamePart(text[i - 1]);
          name = (goes_on ? name : "") + text[i];
        } else if (text[i] != ' ') {
          name.clear();
        }
        out += text[i];
        continue;
      }
      std::vector<std::string> arguments(1);
      int depth = 0;
      for (++i; i < text.size() && (text[i] != ')' || depth > 0); ++i) {
        depth += text[i] == '(' ? 1 : text[i] == ')' ? -1 : 0;
        if (depth == 0 && text[i] == ',') {
          arguments.emplace_back();
        } else {
          arguments.back() += text[i];
        }
      }
      const bool decides = std::ranges::any_of(arguments, varies_);
      const std::string call = decides ? Call(name, arguments) : "";
      if (!call.empty()) {
        out.resize(out.rfind(name));
        out += call;
      } else {
        for (std::string& argument : arguments) argument = Rewritten(argument);
        out += "(" + Joined(arguments) + ")";
      }
      name.clear();
    }
    return out;
  }

  // What stands for a call of one of the functions that decide; empty for others.
  std::string Call(const std::string& function, const std::vector<std::string>& arguments) {
    if (function == "abs") {
      const std::string sign = Decide(Decision::Kind::kNotLess, arguments);
      return "(" + sign + "*(" + Rewritten(arguments.front()) + "))";
    }
    if (function == "sign") return "(" + Decide(Decision::Kind::kSign, arguments) + ")";
    if (function == "rint") return "(" + Decide(Decision::Kind::kRounded, arguments) + ")";
    if (function != "min" && function != "max") return "";
    const std::string which =
        Decide(function == "min" ? Decision::Kind::kLeast : Decision::Kind::kLargest, arguments);
    std::string out = "(";
    for (size_t k = 0; k + 1 < arguments.size(); ++k) {
      out += fmt::format("{}=={}?({}):", which, k, Rewritten(arguments[k]));
    }
    return out + "(" + Rewritten(arguments.back()) + "))";
  }

  // What a named part decides stands wherever that is used: it is decided once.
  std::string Decide(Decision::Kind kind, const std::vector<std::string>& texts) {
    const Decision decision{kind, texts};
    const auto at =
        static_cast<size_t>(std::ranges::find(decisions_, decision) - decisions_.begin());
    if (at == decisions_.size()) decisions_.push_back(decision);
    return NameOf(at);
  }

  const std::function<bool(const std::string&)> varies_;
  std::vector<Decision> decisions_;
  const std::string text_;
};

// Witnesses may run at the same time: one at a time computes.
class MuFormula : public Formula {
 public:
  MuFormula(const std::string& text, const std::map<std::string, double>& constants,
            const std::vector<std::string>& variables)
      : variables_(variables.size(), 1.0) {
    Take(text, constants, variables, &parser_);
    const auto varies = [&](const std::string& part) {
      return std::ranges::any_of(NamesIn(part), [&](const UsedName& used) {
        return std::ranges::find(variables, used.name) != variables.end();
      });
    };
    const BranchedText branched(text, varies);
    double branches = 1.0;
    for (const Decision& decision : branched.decisions()) {
      Chooser& chooser = choosers_.emplace_back(Chooser{.kind = decision.kind, .values = {}});
      for (const std::string& part : decision.texts) {
        chooser.values.push_back(std::make_unique<mu::Parser>());
        Take(part, constants, variables, chooser.values.back().get());
      }
      branches *= chooser.ways();
    }
    if (choosers_.empty()) return;
    if (branches > kMostBranches) throw mu::ParserError("it decides between too many branches");
    decided_.assign(choosers_.size(), 0.0);
    on_branch_ = std::make_unique<mu::Parser>();
    on_branch_->DefineNameChars((std::string(parser_.ValidNameChars()) + "$").c_str());
    for (size_t k = 0; k < decided_.size(); ++k) {
      on_branch_->DefineVar(BranchedText::NameOf(k), &decided_[k]);
    }
    Take(branched.text(), constants, variables, on_branch_.get());
  }

  [[nodiscard]] double At(std::span<const double> variables) const override {
    const std::lock_guard lock(mutex_);
    Set(variables);
    return parser_.Eval();
  }

  [[nodiscard]] bool has_branches() const override { return !choosers_.empty(); }
  [[nodiscard]] int BranchAt(std::span<const double> variables) const override {
    const std::lock_guard lock(mutex_);
    Set(variables);
    int branch = 0;
    for (const Chooser& chooser : choosers_) branch = branch * chooser.ways() + chooser.Way();
    return branch;
  }
  [[nodiscard]] double OnBranch(int branch, std::span<const double> variables) const override {
    const std::lock_guard lock(mutex_);
    Set(variables);
    for (size_t k = choosers_.size(); k-- > 0; branch /= choosers_[k].ways()) {
      decided_[k] = choosers_[k].Decided(branch % choosers_[k].ways());
    }
    const double value = on_branch_->Eval();
    return std::isfinite(value) ? value : parser_.Eval();
  }

 private:
  static constexpr double kMostBranches = 1 << 30;

  struct Chooser {
    static constexpr int kRounded =
        1024;  // whole numbers are distinguished up to multiples of this
    Decision::Kind kind;
    std::vector<std::unique_ptr<mu::Parser>> values;

    [[nodiscard]] int ways() const {
      switch (kind) {
        case Decision::Kind::kTruth:
        case Decision::Kind::kNotLess:
          return 2;
        case Decision::Kind::kSign:
          return 3;
        case Decision::Kind::kRounded:
          return kRounded;
        default:
          return static_cast<int>(values.size());
      }
    }
    // Which one holds.
    [[nodiscard]] int Way() const {
      double value = values.front()->Eval();
      if (kind == Decision::Kind::kTruth) return value != 0.0 ? 1 : 0;
      if (kind == Decision::Kind::kNotLess) return value < 0.0 ? 0 : 1;
      if (kind == Decision::Kind::kSign) return value < 0.0 ? 0 : value > 0.0 ? 2 : 1;
      if (kind == Decision::Kind::kRounded) {
        const double rest = std::remainder(std::rint(value), kRounded);
        return std::isfinite(rest) ? (static_cast<int>(rest) + kRounded) % kRounded : 0;
      }
      int chosen = 0;
      for (size_t k = 1; k < values.size(); ++k) {
        const double other = values[k]->Eval();
        if (!(kind == Decision::Kind::kLeast ? other < value : other > value)) continue;
        value = other;
        chosen = static_cast<int>(k);
      }
      return chosen;
    }
    // What stands in the expression then.
    [[nodiscard]] double Decided(int way) const {
      if (kind == Decision::Kind::kNotLess) return way == 0 ? -1.0 : 1.0;
      if (kind == Decision::Kind::kSign) return way - 1.0;
      if (kind != Decision::Kind::kRounded) return way;
      return way + kRounded * std::rint((values.front()->Eval() - way) / kRounded);
    }
  };

  void Take(const std::string& text, const std::map<std::string, double>& constants,
            const std::vector<std::string>& variables, mu::Parser* parser) {
    for (size_t i = 0; i < variables.size(); ++i) parser->DefineVar(variables[i], &variables_[i]);
    Prepare(text, constants, parser);
    int count = 0;
    parser->Eval(count);  // parses it
    if (count != 1) throw mu::ParserError(kSeveralValues);
  }
  void Set(std::span<const double> variables) const {
    std::copy(variables.begin(), variables.end(), variables_.begin());
  }

  mutable std::mutex mutex_;
  mutable std::vector<double> variables_, decided_;
  mu::Parser parser_;
  std::vector<Chooser> choosers_;
  std::unique_ptr<mu::Parser> on_branch_;  // none without branches
};

}  // namespace

bool IsWrittenOut(const std::string& expression) {
  return PlainNumber(expression) || ExpressionOf(expression)->written_out();
}

std::string InvalidNameReason(const std::string& name) {
  const bool is_name = !name.empty() && IsNameStart(name.front()) &&
                       std::all_of(name.begin(), name.end(), IsNamePart);
  if (!is_name) return "a parameter's name is made of letters, digits and _";
  if (name == "pi" || PlainNumber(name)) return "this name has a fixed meaning";
  if (TheParser().GetFunDef().count(name) > 0) return "this is the name of a function";
  return "";
}

void Scope::Define(const std::string& name, std::string expression, const UnitSuffix& unit) {
  entries_[name] = Entry{
      .expression = std::move(expression), .unit = unit, .state = State::kWaiting, .result = {}};
}

void Scope::Set(const std::string& name, double value) {
  entries_[name] = Entry{.expression = "",
                         .unit = kPlain,
                         .state = State::kDone,
                         .result = {.value = value, .error = "", .hint = ""}};
}

void Scope::EvaluateEntry(const std::string& name, Entry* entry) {
  entry->state = State::kEvaluating;
  evaluating_.push_back(name);
  ExpressionResult result =
      evaluating_.size() > kMaxChain
          ? ExpressionResult{.value = {},
                             .error = "is the end of a very long chain of parameters",
                             .hint = ""}
          : Evaluate(entry->expression);
  evaluating_.pop_back();
  if (result.value) result.value = entry->unit.to_si(*result.value);
  // A cycle has already marked this entry and holds its text.
  if (entry->state == State::kFailed) return;
  entry->state = result.value ? State::kDone : State::kFailed;
  entry->result = std::move(result);
}

ExpressionResult Scope::Lookup(const std::string& name) {
  const auto found = entries_.find(name);
  if (found == entries_.end()) {
    return {.value = {},
            .error = fmt::format("there is no parameter '{}'", name),
            .hint = DidYouMean(name, Names())};
  }
  if (found->second.state == State::kWaiting) EvaluateEntry(name, &found->second);
  return found->second.result;
}

ExpressionResult Scope::Use(const std::string& name) {
  const auto found = entries_.find(name);
  if (found == entries_.end()) {
    if (outer_ != nullptr) return outer_->Use(name);
    return {.value = {}, .error = fmt::format("has the unknown symbol '{}'", name), .hint = ""};
  }
  Entry& entry = found->second;
  if (entry.state == State::kWaiting) EvaluateEntry(name, &entry);
  if (entry.state == State::kEvaluating) {
    // Close the cycle: its first member carries the text.
    std::string text;
    const auto first = std::find(evaluating_.begin(), evaluating_.end(), name);
    for (auto it = first; it != evaluating_.end(); ++it) text += *it + " → ";
    entry.result = {.value = {}, .error = "is a cycle of parameters: " + text + name, .hint = ""};
    entry.state = State::kFailed;
  }
  if (entry.state == State::kFailed) return {};
  return entry.result;
}

ExpressionResult Scope::Evaluate(const std::string& expression) {
  if (const auto number = PlainNumber(expression)) {
    const std::string why = NotANumberReason(*number);
    if (why.empty()) return {.value = number, .error = "", .hint = ""};
    return {.value = {}, .error = why, .hint = ""};
  }
  const Constants constants = ConstantsOf(expression, {});
  return constants.good ? ExpressionOf(expression)->At(constants.values) : constants.failed;
}

Scope::Constants Scope::ConstantsOf(const std::string& expression,
                                    const std::vector<std::string>& variables) {
  const auto refuse = [](const std::string& error, const std::string& hint) {
    return Constants{.values = {}, .failed = {.value = {}, .error = error, .hint = hint}};
  };
  if (expression.size() > kMaxExpression) return refuse("is too long for an expression", "");
  if (HasForeignOperator(expression)) {
    return refuse("is not an expression: = and \" have no meaning here", "");
  }
  Constants constants;
  const std::shared_ptr<Expression> known = ExpressionOf(expression);
  for (const UsedName& used : known->names()) {
    if (used.name == "pi" || constants.values.count(used.name) > 0) continue;
    if (used.is_call) {
      if (TheParser().GetFunDef().count(used.name) > 0) continue;
      return refuse(fmt::format("has the unknown function '{}'", used.name),
                    DidYouMean(used.name, FunctionNames()));
    }
    if (std::ranges::find(variables, used.name) != variables.end()) continue;
    const ExpressionResult result = Use(used.name);
    if (!result.value) {
      return refuse(result.error, result.error.empty() ? "" : DidYouMean(used.name, Names()));
    }
    constants.values[used.name] = *result.value;
  }
  constants.good = true;
  return constants;
}

FormulaResult Scope::Compile(const std::string& expression,
                             const std::vector<std::string>& variables) {
  const Constants constants = ConstantsOf(expression, variables);
  if (!constants.good) {
    return {.formula = {}, .error = constants.failed.error, .hint = constants.failed.hint};
  }
  try {
    auto formula = std::make_shared<MuFormula>(expression, constants.values, variables);
    return {.formula = std::move(formula), .error = "", .hint = ""};
  } catch (const mu::ParserError& error) {
    return {.formula = {}, .error = NoExpression(error.GetMsg()), .hint = ""};
  }
}

std::vector<std::string> Scope::Names() const {
  std::vector<std::string> names =
      outer_ == nullptr ? std::vector<std::string>{"pi"} : outer_->Names();
  for (const auto& [name, entry] : entries_) names.push_back(name);
  return names;
}

std::string NotANumberReason(double value) {
  if (!std::isfinite(value)) return "is not a finite number";
  if (std::abs(value) <= kLargestNumber) return "";
  return fmt::format("violates |number| <= {:g}", kLargestNumber);
}

}  // namespace mbv
