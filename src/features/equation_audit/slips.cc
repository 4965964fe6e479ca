#include "features/equation_audit/slips.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <set>
#include <string_view>

#include "base/text.h"

namespace mbv {
namespace {

constexpr double kDegree = std::numbers::pi / 180.0;

struct Factor {
  double value;
  const char* text;
};
const Factor kFactors[] = {{-1.0, "−1"},
                           {0.5, "1/2"},
                           {2.0, "2"},
                           {-0.5, "−1/2"},
                           {-2.0, "−2"},
                           {kDegree, "π/180"},
                           {1 / kDegree, "180/π"},
                           {1e-3, "1/1000"},
                           {1e3, "1000"},
                           {std::numbers::pi, "π"},
                           {1 / std::numbers::pi, "1/π"},
                           {0.25, "1/4"},
                           {4.0, "4"}};

double Difference(const AuditValues& a, const AuditValues& b,
                  const std::function<double(size_t row, size_t k)>& value) {
  double largest = 0.0;
  for (size_t row = 0; row < a.size(); ++row) {
    for (size_t k = 0; k < b[row].size(); ++k) {
      const double difference = std::abs(value(row, k) - b[row][k]);
      if (!(difference <= largest)) largest = difference;
      if (std::isnan(difference)) return difference;
    }
  }
  return largest;
}

bool SameShape(const AuditValues& a, const AuditValues& b) {
  if (a.size() != b.size()) return false;
  for (size_t row = 0; row < a.size(); ++row) {
    if (a[row].size() != b[row].size()) return false;
  }
  return true;
}

bool IsRight(const AuditValues& values, const AuditValues& truth, double limit) {
  if (values.size() > truth.size()) return false;
  for (size_t row = 0; row < values.size(); ++row) {
    if (values[row].size() != truth[row].size()) return false;
    for (size_t k = 0; k < values[row].size(); ++k) {
      if (!(std::abs(values[row][k] - truth[row][k]) <= limit)) return false;
    }
  }
  return true;
}

std::string Element(size_t k, int columns) {
  if (columns <= 0) return fmt::format("element {}", k + 1);
  const auto n = static_cast<size_t>(columns);
  return fmt::format("element ({}, {})", k / n + 1, k % n + 1);
}

// Of the numbers that an equation gave.
class NumberSlips {
 public:
  explicit NumberSlips(const SlipSearch& search) : s_(search) {}

  std::vector<Slip> Run() {
    if (!SameShape(s_.printed, s_.truth) || s_.truth.empty()) return {};
    n_ = s_.truth.front().size();
    for (const auto& row : s_.truth) {
      if (row.size() != n_) return {};
    }
    TryFactors();
    TryTransposed();
    TryExchanged();
    TryElements();
    TryTerms();
    return std::move(found_);
  }

 private:
  bool Right(const std::function<double(size_t, size_t)>& value) const {
    return Difference(s_.printed, s_.truth, value) <= s_.limit;
  }
  void Add(std::string what) { found_.push_back({std::move(what), ""}); }

  void TryFactors() {
    for (const Factor& factor : kFactors) {
      if (Right([&](size_t row, size_t k) { return factor.value * s_.printed[row][k]; })) {
        Add(factor.value == -1.0 ? "the opposite sign"
                                 : fmt::format("the whole times {}", factor.text));
      }
    }
    if (Right([&](size_t row, size_t k) { return s_.printed[row][k] * s_.printed[row][k]; })) {
      Add("the square of the whole");
    }
    if (Right([&](size_t row, size_t k) { return std::sqrt(s_.printed[row][k]); })) {
      Add("the root of the whole");
    }
  }

  void TryTransposed() {
    const auto columns = static_cast<size_t>(std::max(s_.columns, 0));
    if (columns < 2 || columns * columns != n_) return;
    if (Right([&](size_t row, size_t k) {
          return s_.printed[row][(k % columns) * columns + k / columns];
        })) {
      Add("the transposed matrix");
    }
  }

  // Two elements in each other's place, with their signs.
  void TryExchanged() {
    for (size_t i = 0; i < n_; ++i) {
      for (size_t j = i + 1; j < n_; ++j) {
        for (const double sign : {1.0, -1.0}) {
          if (Right([&](size_t row, size_t k) {
                const auto& printed = s_.printed[row];
                return k == i ? sign * printed[j] : k == j ? sign * printed[i] : printed[k];
              })) {
            Add(fmt::format("{} and {} exchanged{}", Element(i, s_.columns), Element(j, s_.columns),
                            sign < 0 ? ", with the opposite signs" : ""));
          }
        }
      }
    }
  }

  // Single elements that are wrong by a factor: an axis' direction, a row of a matrix.
  void TryElements() {
    if (n_ < 2) return;
    std::map<std::string, std::vector<size_t>> wrong;
    for (size_t k = 0; k < n_; ++k) {
      const auto is = [&](double factor) {
        for (size_t row = 0; row < s_.truth.size(); ++row) {
          if (!(std::abs(factor * s_.printed[row][k] - s_.truth[row][k]) <= s_.limit)) return false;
        }
        return true;
      };
      if (is(1.0)) continue;
      const auto* factor = std::ranges::find_if(
          kFactors, [&](const Factor& candidate) { return is(candidate.value); });
      if (factor == std::end(kFactors)) return;
      wrong[factor->text].push_back(k);
    }
    if (wrong.size() != 1 || wrong.begin()->second.size() == n_) return;
    std::vector<std::string> elements;
    for (const size_t k : wrong.begin()->second) elements.push_back(Element(k, s_.columns));
    Add(fmt::format("{} times {}", Joined(elements), wrong.begin()->first));
  }

  // What is missing is a known term.
  void TryTerms() {
    for (const KnownTerm& term : s_.terms) {
      if (!SameShape(term.values, s_.truth)) continue;
      double size = 0.0, missing = 0.0;
      for (size_t row = 0; row < s_.truth.size(); ++row) {
        for (size_t k = 0; k < n_; ++k) {
          size += term.values[row][k] * term.values[row][k];
          missing += term.values[row][k] * (s_.truth[row][k] - s_.printed[row][k]);
        }
      }
      if (!(size > 0.0)) continue;
      const double fitted = missing / size;
      for (const double factor : {1.0, -1.0, 0.5, -0.5, 2.0, -2.0}) {
        if (std::abs(fitted - factor) > 1e-4 * std::abs(factor)) continue;
        if (!Right([&](size_t row, size_t k) {
              return s_.printed[row][k] + factor * term.values[row][k];
            })) {
          continue;
        }
        Add(factor == 1.0    ? fmt::format("plus {}, which is missing", term.name)
            : factor == -1.0 ? fmt::format("minus {}", term.name)
                             : fmt::format("plus {:g} times {}", factor, term.name));
      }
    }
  }

  const SlipSearch& s_;
  size_t n_ = 0;
  std::vector<Slip> found_;
};

// Tokens of an equation's text.

struct Token {
  enum class Kind { kName, kNumber, kSign, kOpen, kClose, kComma, kOther };
  Kind kind = Kind::kOther;
  size_t at = 0, size = 0;
  int line = 0, depth = 0;
};

bool IsLetter(char c) {
  return std::isalpha(static_cast<unsigned char>(c)) != 0 || c == '_' ||
         (static_cast<unsigned char>(c) & 0x80u) != 0;
}
bool IsDigit(char c) { return c >= '0' && c <= '9'; }

class Editor {
 public:
  explicit Editor(const SlipSearch& search) : s_(search), text_(search.text) {
    python_ = s_.language == ".py";
    octave_ = s_.language == ".m";
    FindRegion();
    Tokenize();
  }

  std::vector<TextEdit> Run() {
    if (begin_ >= end_) return {};
    for (size_t t = 0; t < tokens_.size(); ++t) {
      const Token& token = tokens_[t];
      if (token.kind == Token::Kind::kSign) Signs(t);
      if (token.kind == Token::Kind::kName) Names(t);
    }
    for (size_t t = 0; t < tokens_.size(); ++t) Factors(t);
    for (size_t t = 0; t < tokens_.size(); ++t) {
      Terms(t);
      Brackets(t);
      Products(t);
    }
    return std::move(edits_);
  }

 private:
  using Kind = Token::Kind;

  [[nodiscard]] std::string Word(const Token& token) const {
    return text_.substr(token.at, token.size);
  }

  // The body of the function, or the formula behind its key.
  void FindRegion() {
    std::vector<size_t> starts = {0};
    for (size_t k = 0; k < text_.size(); ++k) {
      if (text_[k] == '\n') starts.push_back(k + 1);
    }
    starts.push_back(text_.size());
    const auto at = [&](int line) {
      return starts[std::min(static_cast<size_t>(std::max(line, 1)) - 1, starts.size() - 1)];
    };
    begin_ = at(s_.line);
    end_ = at(std::max(s_.end, s_.line) + 1);
    for (first_line_ = s_.line; first_line_ <= s_.end; ++first_line_) {
      const std::string_view row =
          std::string_view(text_).substr(at(first_line_), at(first_line_ + 1) - at(first_line_));
      const size_t letter = row.find_first_not_of(" \t");
      if (letter == std::string_view::npos) continue;
      if (python_ && row.substr(letter).starts_with("def ")) {
        begin_ = BehindHead(at(first_line_));
        first_line_ += static_cast<int>(
            std::count(text_.begin() + static_cast<std::ptrdiff_t>(at(first_line_)),
                       text_.begin() + static_cast<std::ptrdiff_t>(begin_), '\n'));
        return;
      }
      if (octave_ && row.substr(letter).starts_with("function")) {
        begin_ = at(first_line_ + 1);
        ++first_line_;
        return;
      }
    }
    first_line_ = s_.line;
    begin_ = at(s_.line);
    if (!python_ && !octave_) {
      const size_t colon = text_.find(':', begin_);
      if (colon < end_) begin_ = colon + 1;
    }
  }

  // The body may begin in the line of the colon behind the arguments.
  [[nodiscard]] size_t BehindHead(size_t k) const {
    for (int depth = 0; k < end_; ++k) {
      const char c = text_[k];
      depth += c == '(' || c == '[' || c == '{' ? 1 : c == ')' || c == ']' || c == '}' ? -1 : 0;
      if (c == ':' && depth == 0) return k + 1;
    }
    return end_;
  }

  void Tokenize() {
    int line = first_line_, depth = 0;
    for (size_t k = begin_; k < end_;) {
      const char c = text_[k];
      if (c == '\n') {
        ++line;
        ++k;
        continue;
      }
      if ((python_ && c == '#') || (octave_ && c == '%')) {
        while (k < end_ && text_[k] != '\n') ++k;
        continue;
      }
      if (python_ && (c == '"' || c == '\'')) {
        const std::string quote =
            text_.compare(k, 3, std::string(3, c)) == 0 ? std::string(3, c) : std::string(1, c);
        const size_t close = text_.find(quote, k + quote.size());
        const size_t next = close == std::string::npos ? end_ : close + quote.size();
        line += static_cast<int>(
            std::count(text_.begin() + static_cast<std::ptrdiff_t>(k),
                       text_.begin() + static_cast<std::ptrdiff_t>(std::min(next, end_)), '\n'));
        k = next;
        continue;
      }
      Token token{.kind = Kind::kOther, .at = k, .size = 1, .line = line, .depth = depth};
      if (IsLetter(c)) {
        while (k + token.size < end_ &&
               (IsLetter(text_[k + token.size]) || IsDigit(text_[k + token.size]))) {
          ++token.size;
        }
        token.kind = Kind::kName;
      } else if (IsDigit(c) || (c == '.' && k + 1 < end_ && IsDigit(text_[k + 1]))) {
        while (k + token.size < end_) {
          const char d = text_[k + token.size];
          const bool exponent = (d == '+' || d == '-') && (text_[k + token.size - 1] == 'e' ||
                                                           text_[k + token.size - 1] == 'E');
          if (!IsDigit(d) && d != '.' && d != 'e' && d != 'E' && !exponent) break;
          ++token.size;
        }
        token.kind = Kind::kNumber;
      } else if (c == '(' || c == '[' || c == '{') {
        token.kind = Kind::kOpen;
        ++depth;
      } else if (c == ')' || c == ']' || c == '}') {
        token.kind = Kind::kClose;
        token.depth = --depth;
      } else if (c == '+' || c == '-') {
        token.kind = Kind::kSign;
      } else if (c == ',' || c == ';' || c == ':') {
        token.kind = Kind::kComma;
      } else if (c == ' ' || c == '\t' || c == '\r' || c == '\\') {
        ++k;
        continue;
      } else if (text_.compare(k, 2, "**") == 0) {
        token.size = 2;
      }
      tokens_.push_back(token);
      k += token.size;
    }
  }

  void Add(const std::string& what, int line, size_t at, size_t size, const std::string& with,
           TextEdit::Kind kind = TextEdit::Kind::kOther) {
    edits_.push_back({kind, fmt::format("line {}: {}", line, what), line, at, size, with});
  }

  [[nodiscard]] bool IsValue(size_t t) const {
    const Kind kind = tokens_[t].kind;
    return kind == Kind::kName || kind == Kind::kNumber || kind == Kind::kClose;
  }
  [[nodiscard]] bool IsWord(size_t t, std::string_view word) const {
    return t < tokens_.size() &&
           std::string_view(text_).substr(tokens_[t].at, tokens_[t].size) == word;
  }
  [[nodiscard]] bool IsAttribute(size_t t) const { return t > 0 && IsWord(t - 1, "."); }
  [[nodiscard]] bool IsCalled(size_t t) const { return IsWord(t + 1, "("); }
  // `x = …`, `return …`, keyword arguments.
  [[nodiscard]] bool IsAssigned(size_t t) const {
    return IsWord(t + 1, "=") && !IsWord(t + 2, "=");
  }
  [[nodiscard]] static bool IsKeyword(const std::string& word) {
    static const std::set<std::string> words = {
        "return", "if",  "else", "for",  "in", "lambda", "def",   "end",     "and",
        "or",     "not", "is",   "None", "p",  "elif",   "while", "function"};
    return words.contains(word);
  }

  // The text around an edit, to be found again.
  [[nodiscard]] std::string Around(const Token& token) const {
    size_t to = std::min(text_.find('\n', token.at), token.at + 24);
    while (to < text_.size() && (static_cast<unsigned char>(text_[to]) & 0xC0u) == 0x80u) ++to;
    return text_.substr(token.at, to - token.at);
  }

  void Signs(size_t t) {
    const Token& token = tokens_[t];
    const bool binary = t > 0 && IsValue(t - 1) && !IsKeyword(Word(tokens_[t - 1]));
    const char* other = text_[token.at] == '+' ? "-" : "+";
    const std::string before = t + 1 < tokens_.size() ? Around(tokens_[t + 1]) : "";
    Add(fmt::format("'{}' for '{}' in front of '{}'", other, text_[token.at], before), token.line,
        token.at, 1, binary || *other == '-' ? other : " ", TextEdit::Kind::kSign);
    if (!binary) return;
    Add(fmt::format("'*' for '{}' in front of '{}'", text_[token.at], before), token.line, token.at,
        1, "*");
  }

  // Functions and names that look alike.
  void Names(size_t t) {
    const Token& token = tokens_[t];
    const std::string word = Word(token);
    if (IsKeyword(word) || IsAssigned(t)) return;
    std::set<std::string> others;
    if (IsCalled(t) && !IsAttribute(t)) {
      static const std::map<std::string, std::vector<std::string>> functions = {
          {"sin", {"cos", "tan"}},
          {"cos", {"sin", "tan"}},
          {"tan", {"sin", "cos"}},
          {"asin", {"acos", "atan"}},
          {"acos", {"asin", "atan"}},
          {"atan", {"asin", "acos"}},
          {"sinh", {"cosh"}},
          {"cosh", {"sinh"}},
          {"rot_x", {"rot_y", "rot_z"}},
          {"rot_y", {"rot_x", "rot_z"}},
          {"rot_z", {"rot_x", "rot_y"}}};
      const auto found = functions.find(word);
      if (found != functions.end()) others.insert(found->second.begin(), found->second.end());
    } else {
      for (const std::string& name : Candidates(t)) {
        if (LooksAlike(word, name) || OfOneUnit(word, name)) others.insert(name);
      }
      if (word == "x" || word == "y" || word == "z") others.insert({"x", "y", "z"});
      others.erase(word);
    }
    for (const std::string& other : others) {
      Add(fmt::format("'{}' for '{}' in '{}'", other, word, Around(token)), token.line, token.at,
          token.size, other, TextEdit::Kind::kName);
    }
  }

  // Names in the same place: parameters for a parameter, names of the function for a name.
  [[nodiscard]] std::vector<std::string> Candidates(size_t t) const {
    std::set<std::string> names;
    const bool attribute = IsAttribute(t);
    const bool parameter = attribute ? t > 1 && IsWord(t - 2, "p") : !python_ && !octave_;
    for (const auto& [name, unit] : s_.parameters) {
      if (parameter) names.insert(name);
    }
    if (!attribute) names.insert(s_.arguments.begin(), s_.arguments.end());
    for (size_t k = 0; k < tokens_.size(); ++k) {
      if (tokens_[k].kind != Kind::kName || IsAttribute(k) != attribute || IsCalled(k)) continue;
      if (!IsKeyword(Word(tokens_[k]))) names.insert(Word(tokens_[k]));
    }
    return {names.begin(), names.end()};
  }

  [[nodiscard]] bool OfOneUnit(const std::string& a, const std::string& b) const {
    const auto of_a = s_.parameters.find(a), of_b = s_.parameters.find(b);
    return of_a != s_.parameters.end() && of_b != s_.parameters.end() &&
           of_a->second == of_b->second;
  }

  // One letter or digit is another: c3 and c4, s3 and c3, L1 and L2, v_x and v_y; or one of two
  // parts is: I_rod and I_crank, I_rod and m_rod.
  static bool LooksAlike(const std::string& a, const std::string& b) {
    if (a == b) return false;
    // A rate for an acceleration.
    if (a == b + "d" || b == a + "d" || a == b + "_d" || b == a + "_d") return true;
    const size_t i = a.find('_'), k = b.find('_');
    if (i != std::string::npos && k != std::string::npos &&
        (a.substr(0, i) == b.substr(0, k) || a.substr(i) == b.substr(k))) {
      return true;
    }
    if (a.size() != b.size()) return false;
    int different = 0;
    for (size_t k = 0; k < a.size(); ++k) different += a[k] != b[k] ? 1 : 0;
    return different == 1;
  }

  // The last token of what begins at t as a value: a name with its attributes, calls and elements,
  // a number, a group in brackets. t itself where nothing does.
  [[nodiscard]] std::optional<size_t> EndOfValue(size_t t) const {
    size_t last = t;
    const Kind kind = tokens_[t].kind;
    if (kind == Kind::kOpen) {
      const auto close = Closing(t);
      if (!close) return {};
      last = *close;
    } else if (kind != Kind::kNumber &&
               (kind != Kind::kName || (IsKeyword(Word(tokens_[t])) && !IsWord(t, "p")))) {
      return {};
    }
    while (last + 1 < tokens_.size()) {
      const Token& next = tokens_[last + 1];
      if (next.kind == Kind::kOpen && text_[next.at] != '{' && Touches(last)) {
        const auto close = Closing(last + 1);
        if (!close) return {};
        last = *close;
      } else if (IsWord(last + 1, ".") && last + 2 < tokens_.size() &&
                 tokens_[last + 2].kind == Kind::kName) {
        last += 2;
      } else {
        break;
      }
    }
    return last;
  }
  [[nodiscard]] bool Touches(size_t t) const {
    return tokens_[t].at + tokens_[t].size == tokens_[t + 1].at;
  }
  [[nodiscard]] std::optional<size_t> Closing(size_t open) const {
    for (size_t k = open + 1; k < tokens_.size(); ++k) {
      if (tokens_[k].kind == Kind::kClose && tokens_[k].depth == tokens_[open].depth) return k;
    }
    return {};
  }
  [[nodiscard]] bool InTrigonometric(size_t t) const {
    if (t < 2 || !IsWord(t - 1, "(")) return false;
    const std::string word = Word(tokens_[t - 2]);
    return word == "sin" || word == "cos" || word == "tan";
  }

  // A factor, a square, a sign, degrees, a transposed matrix.
  void Factors(size_t t) {
    if (IsAttribute(t) || IsAssigned(t)) return;
    const auto last = EndOfValue(t);
    if (!last) return;
    const Token& first = tokens_[t];
    const size_t size = tokens_[*last].at + tokens_[*last].size - first.at;
    const std::string value = text_.substr(first.at, size);
    const char* power = python_ ? "**" : "^";
    const auto add = [&](const char* what, const std::string& with) {
      Add(fmt::format("'{}' {}", OneLine(value), what), first.line, first.at, size, with);
    };
    add("with the other sign", "(-" + value + ")");
    edits_.back().kind = TextEdit::Kind::kFactorSign;
    add("times 1/2", "(0.5*" + value + ")");
    add("times 2", "(2*" + value + ")");
    if (tokens_[t].kind != Kind::kNumber) add("squared", "(" + value + power + "2)");
    if (InTrigonometric(t)) {
      add("in degrees", fmt::format("({}*{:.17g})", value, kDegree));
      add("in radians", fmt::format("({}*{:.17g})", value, 1.0 / kDegree));
    }
    // A power or a factor too much.
    if (*last + 2 < tokens_.size() && IsWord(*last + 1, power)) {
      const Token& exponent = tokens_[*last + 2];
      Add(fmt::format("'{}' without its power", OneLine(value)), first.line, first.at,
          exponent.at + exponent.size - first.at, value);
    }
    if (python_ && value.ends_with(".T")) {
      add("not transposed", value.substr(0, value.size() - 2));
    } else if (python_) {
      add("transposed", "(" + value + ").T");
    } else if (octave_) {
      add("transposed", "(" + value + ").'");
    }
    for (const char* sign : {"*", "/"}) {
      if (t > 0 && IsWord(t - 1, sign)) {
        Add(fmt::format("without '{}{}'", sign, OneLine(value)), first.line, tokens_[t - 1].at,
            first.at + size - tokens_[t - 1].at, "");
        Add(fmt::format("'{}' for '{}' in front of '{}'", *sign == '*' ? "/" : "*", sign,
                        OneLine(value)),
            first.line, tokens_[t - 1].at, 1, *sign == '*' ? "/" : "*");
      }
      if (*sign == '*' && *last + 1 < tokens_.size() && IsWord(*last + 1, sign)) {
        Add(fmt::format("without '{}*'", OneLine(value)), first.line, first.at,
            tokens_[*last + 1].at + 1 - first.at, "");
      }
    }
  }

  // A factor that belongs to a part of the sum in front of it: (A + B) C for A + B C.
  void Brackets(size_t t) {
    if (!IsWord(t, "(") || (t > 0 && IsValue(t - 1) && Touches(t - 1))) return;
    const auto close = Closing(t);
    if (!close || *close + 2 >= tokens_.size()) return;
    const bool product = IsWord(*close + 1, "*") || IsWord(*close + 1, "@");
    const auto last = product ? EndOfValue(*close + 2) : std::nullopt;
    if (!last) return;
    const size_t open = tokens_[t].at, end = tokens_[*last].at + tokens_[*last].size;
    const std::string factor =
        text_.substr(tokens_[*close].at + 1, end - tokens_[*close].at - 1);  // "* C"
    for (size_t k = t + 2; k < *close; ++k) {
      const Token& sign = tokens_[k];
      if (sign.kind != Kind::kSign || sign.depth != tokens_[t].depth + 1 || !IsValue(k - 1)) {
        continue;
      }
      const std::string left = text_.substr(open + 1, sign.at - open - 1);
      const std::string right = text_.substr(sign.at + 1, tokens_[*close].at - sign.at - 1);
      const std::string word(1, text_[sign.at]);
      const std::string of = OneLine(factor);
      // The minus of a sum belongs to its first term alone.
      if (word == "+") {
        Add(fmt::format("'{}' behind '{}' alone", of, OneLine(right)), sign.line, open, end - open,
            "(" + left + word + " (" + right + ")" + factor + ")");
      }
      Add(fmt::format("'{}' behind '{}' alone", of, OneLine(left)), sign.line, open, end - open,
          "((" + left + ")" + factor + word + right + ")");
    }
  }

  // Factors in the other order, and a matrix for its inverse.
  void Products(size_t t) {
    if (IsAttribute(t) || !python_) return;
    const auto end = EndOfValue(t);
    if (!end || *end + 2 >= tokens_.size() || !IsWord(*end + 1, "@")) return;
    const auto last = EndOfValue(*end + 2);
    if (!last) return;
    const size_t at = tokens_[t].at, middle = tokens_[*end + 2].at;
    const size_t size = tokens_[*last].at + tokens_[*last].size - at;
    const std::string left = text_.substr(at, tokens_[*end].at + tokens_[*end].size - at);
    const std::string right = text_.substr(middle, at + size - middle);
    const int line = tokens_[t].line;
    Add(fmt::format("'{}' and '{}' in the other order", OneLine(left), OneLine(right)), line, at,
        size, "(" + right + " @ " + left + ")");
    Add(fmt::format("the inverse of '{}'", OneLine(left)), line, at, size,
        "linear_solve(" + left + ", " + right + ")");
  }

  // A term of a sum that is too much.
  void Terms(size_t t) {
    const Token& sign = tokens_[t];
    if (sign.kind != Kind::kSign || t + 1 >= tokens_.size()) return;
    size_t last = t;
    for (size_t k = t + 1; k < tokens_.size(); ++k) {
      const Token& token = tokens_[k];
      const bool inside =
          token.depth > sign.depth || (token.kind == Kind::kClose && token.depth == sign.depth);
      if (!inside && (token.depth < sign.depth || token.kind == Kind::kSign ||
                      token.kind == Kind::kComma || token.line > tokens_[last].line)) {
        break;
      }
      last = k;
    }
    if (last == t) return;
    const size_t size = tokens_[last].at + tokens_[last].size - sign.at;
    if (t == 0 || !IsValue(t - 1)) return;
    Add(fmt::format("without '{}'", OneLine(text_.substr(sign.at, size))), sign.line, sign.at, size,
        "");
  }

  const SlipSearch& s_;
  const std::string& text_;
  bool python_ = false, octave_ = false;
  size_t begin_ = 0, end_ = 0;
  int first_line_ = 0;
  std::vector<Token> tokens_;
  std::vector<TextEdit> edits_;
};

std::string LineOf(const std::string& text, int line) {
  size_t at = 0;
  for (int k = 1; k < line; ++k) {
    at = text.find('\n', at);
    if (at == std::string::npos) return "";
    ++at;
  }
  std::string row = text.substr(at, text.find('\n', at) - at);
  row.erase(0, row.find_first_not_of(" \t"));
  return row;
}

AuditValues Head(const AuditValues& all, size_t count) {
  return {all.begin(), all.begin() + static_cast<std::ptrdiff_t>(std::min(count, all.size()))};
}

// Of the text: one edit, one edit with a factor of the whole, two edits of signs and names.
class TextSlips {
 public:
  TextSlips(const SlipSearch& search, size_t most) : s_(search), most_(most) {}

  void Try(std::vector<Slip>* found) {
    const std::vector<TextEdit> edits = EditsOf(s_);
    std::set<std::string> tried;
    for (const TextEdit& edit : edits) {
      if (found->size() >= most_) return;
      const std::string text = edit.In(s_.text);
      if (!tried.insert(text).second) continue;
      // A sign that was found in front of a term is not found again in each of its factors.
      if (edit.kind == TextEdit::Kind::kFactorSign && !found->empty()) continue;
      if (TryOne(text)) {
        found->push_back({edit.what, LineOf(text, edit.line)});
      } else if (with_factor_.empty()) {
        TryFactor(edit, text);
      }
    }
    if (found->empty() && with_factor_.empty()) TryPairs(edits, found);
  }

  [[nodiscard]] std::vector<Slip> with_factor() const { return with_factor_; }

 private:
  static constexpr size_t kMostPairs = 1000;

  // Right at few states, then at all. What it gave at few stays in `few_`.
  bool TryOne(const std::string& text) {
    few_ = s_.evaluate(text, true);
    if (!few_ || !IsRight(*few_, s_.truth, s_.limit)) return false;
    const auto all = s_.evaluate(text, false);
    return all && all->size() == s_.truth.size() && IsRight(*all, s_.truth, s_.limit);
  }

  void TryFactor(const TextEdit& edit, const std::string& text) {
    const AuditValues truth = few_ ? Head(s_.truth, few_->size()) : AuditValues{};
    if (!few_ || !SameShape(*few_, truth)) return;
    for (const Factor& factor : kFactors) {
      const auto times = [&](const AuditValues& values) {
        return [&values, &factor](size_t row, size_t k) { return factor.value * values[row][k]; };
      };
      if (!(Difference(*few_, truth, times(*few_)) <= s_.limit)) continue;
      const auto all = s_.evaluate(text, false);
      if (!all || !SameShape(*all, s_.truth)) continue;
      if (!(Difference(*all, s_.truth, times(*all)) <= s_.limit)) continue;
      with_factor_.push_back({fmt::format("{}, and the whole times {}", edit.what, factor.text),
                              LineOf(text, edit.line)});
      return;
    }
  }

  void TryPairs(const std::vector<TextEdit>& edits, std::vector<Slip>* found) {
    std::vector<const TextEdit*> simple;
    for (const TextEdit& edit : edits) {
      if (edit.kind == TextEdit::Kind::kSign || edit.kind == TextEdit::Kind::kName) {
        simple.push_back(&edit);
      }
    }
    size_t pairs = 0;
    for (size_t i = 0; i < simple.size(); ++i) {
      for (size_t k = i + 1; k < simple.size(); ++k) {
        const TextEdit& first = simple[i]->at < simple[k]->at ? *simple[i] : *simple[k];
        const TextEdit& second = &first == simple[i] ? *simple[k] : *simple[i];
        if (first.at + first.size > second.at) continue;
        if (++pairs > kMostPairs || !found->empty()) return;
        // The later one first: places before it stay.
        const std::string text = first.In(second.In(s_.text));
        if (TryOne(text)) {
          found->push_back(
              {fmt::format("{}, and {}", first.what, second.what),
               LineOf(text, first.line) +
                   (first.line == second.line ? "" : " … " + LineOf(text, second.line))});
        }
      }
    }
  }

  const SlipSearch& s_;
  size_t most_;
  std::optional<AuditValues> few_;
  std::vector<Slip> with_factor_;
};

}  // namespace

std::vector<TextEdit> EditsOf(const SlipSearch& search) { return Editor(search).Run(); }

std::vector<Slip> FindSlips(const SlipSearch& search, size_t most) {
  std::vector<Slip> found = NumberSlips(search).Run();
  if (search.evaluate == nullptr) return found;
  TextSlips text(search, most);
  text.Try(&found);
  if (found.empty()) return text.with_factor();
  if (found.size() > most) found.resize(most);
  return found;
}

}  // namespace mbv
