#include "input/yaml_syntax.h"

#include <fmt/format.h>

#include <algorithm>
#include <sstream>
#include <string_view>
#include <vector>

namespace mbv::internal {
namespace {

class Scanner {
 public:
  std::optional<SyntaxCause> Scan(const std::string& text) {
    std::istringstream stream(text);
    for (std::string line; std::getline(stream, line) && !cause_;) {
      ++line_;
      if (!line.empty() && line.back() == '\r') line.pop_back();
      Line(line);
    }
    if (!cause_ && quote_ != 0) {
      Tell(quote_line_, quote_column_, fmt::format("the quote {} is never closed", quote_));
    }
    if (!cause_ && !open_.empty()) {
      Tell(open_.back().line, open_.back().column,
           fmt::format("the bracket {} is never closed", open_.back().sign));
    }
    return cause_;
  }

 private:
  struct Bracket {
    char sign;
    int line, column;
  };

  void Tell(int line, int column, std::string message, std::string hint = "") {
    if (!cause_) cause_ = SyntaxCause{line, column, std::move(message), std::move(hint)};
  }

  void Line(const std::string& line) {
    const size_t indent = line.find_first_not_of(' ');
    if (block_indent_ >= 0) {  // text after | or >
      if (indent == std::string::npos || static_cast<int>(indent) > block_indent_) return;
      block_indent_ = -1;
    }
    const bool nested = quote_ != 0 || !open_.empty();
    if (nested) {
      Characters(line, 0);
      return;
    }
    const size_t first = line.find_first_not_of(" \t");
    if (first == std::string::npos || line[first] == '#') return;
    if (line.find('\t') < first) {
      Tell(line_, static_cast<int>(line.find('\t')) + 1, "the line is indented by a tab",
           "YAML takes spaces only");
      return;
    }
    if (first == 0 && (line.starts_with("---") || line[0] == '%')) return;
    Indented(line, first);
  }

  // A line outside brackets and quotes, with its content from `at` on.
  void Indented(const std::string& line, size_t at) {
    const auto indent = static_cast<int>(at);
    // "- " opens a level of its own; what follows it is one deeper.
    std::vector<int> levels = {indent};
    while (line[at] == '-' && (at + 1 == line.size() || line[at + 1] == ' ')) {
      at = line.find_first_not_of(' ', at + 1);
      if (at == std::string::npos) break;
      levels.push_back(static_cast<int>(at));
    }
    const std::string_view content =
        at == std::string::npos ? std::string_view() : std::string_view(line).substr(at);
    const bool item = levels.size() > 1 || content.empty();
    const size_t colon = KeyEnd(content);
    const bool has_key = colon != std::string_view::npos;
    if (has_key && lone_line_ > 0 && indent >= lone_indent_) {
      NoKey(lone_, lone_line_, lone_indent_);  // it was no value of the key above
      return;
    }
    lone_line_ = 0;
    if (!CheckLevel(indent, has_key || item)) return;
    for (size_t k = 1; k < levels.size(); ++k) levels_.push_back(levels[k]);
    if (!has_key && !item && !expects_value_ && !continues_) {
      NoKey(content, line_, indent);
      return;
    }
    if (!has_key && !item && expects_value_ && !content.starts_with('[') &&
        !content.starts_with('{')) {
      lone_ = content;
      lone_line_ = line_;
      lone_indent_ = indent;
    }
    Characters(line, at == std::string::npos ? line.size() : at);
    const std::string_view value =
        has_key ? WithoutComment(content.substr(colon + 1)) : std::string_view("x");
    expects_value_ = value.empty() || (item && content.empty());
    if (!value.empty() && (value.front() == '|' || value.front() == '>')) {
      block_indent_ = levels_.back();
    }
    last_line_ = line_;
  }

  // False after a finding. Continued plain text may stand anywhere deeper.
  bool CheckLevel(int indent, bool opens) {
    continues_ = false;
    if (levels_.empty() || indent > levels_.back()) {
      if (!levels_.empty() && !expects_value_) {
        if (opens) {
          Tell(line_, indent + 1,
               fmt::format("the line is indented deeper than line {}, which has a value already",
                           last_line_),
               fmt::format("indent it by {} spaces as the line above", levels_.back()));
          return false;
        }
        continues_ = true;
        return true;
      }
      levels_.push_back(indent);
      return true;
    }
    const std::vector<int> above = levels_;
    while (!levels_.empty() && levels_.back() > indent) levels_.pop_back();
    if (!levels_.empty() && levels_.back() == indent) return true;
    std::string fitting;
    for (const int level : above) {
      fitting += (fitting.empty()         ? ""
                  : level == above.back() ? " or "
                                          : ", ") +
                 std::to_string(level);
    }
    Tell(
        line_, indent + 1,
        fmt::format("the line is indented by {} spaces, the lines above it by {}", indent, fitting),
        "lines of one level start in the same column");
    return false;
  }

  void NoKey(std::string_view content, int line, int indent) {
    const size_t colon = content.find(':');
    if (colon != std::string_view::npos && colon > 0) {
      Tell(line, indent + static_cast<int>(colon) + 1, "there is no space after the colon",
           "write KEY: VALUE");
    } else {
      Tell(line, indent + 1, "the line has no ': '", "write KEY: VALUE, or - VALUE in a list");
    }
  }

  // Position of the colon that ends a key, or npos.
  static size_t KeyEnd(std::string_view content) {
    char quote = 0;
    int depth = 0;
    for (size_t i = 0; i < content.size(); ++i) {
      const char c = content[i];
      if (quote != 0) {
        if (c == quote) quote = 0;
        continue;
      }
      if ((c == '"' || c == '\'') && (i == 0 || depth > 0)) quote = c;
      if (c == '[' || c == '{') ++depth;
      if (c == ']' || c == '}') --depth;
      if (c == '#' && i > 0 && content[i - 1] == ' ') break;
      if (c == ':' && depth == 0 && (i + 1 == content.size() || content[i + 1] == ' ')) return i;
    }
    return std::string_view::npos;
  }

  static std::string_view WithoutComment(std::string_view value) {
    const size_t first = value.find_first_not_of(" \t");
    if (first == std::string_view::npos || value[first] == '#') return {};
    value.remove_prefix(first);
    // An anchor or tag alone: the value follows.
    const bool mark = value.front() == '&' || value.front() == '!';
    return mark && value.find(' ') == std::string_view::npos ? std::string_view() : value;
  }

  // Follows brackets and quotes.
  void Characters(const std::string& line, size_t from) {
    for (size_t i = from; i < line.size() && !cause_; ++i) {
      const char c = line[i];
      if (quote_ != 0) {
        if (c == '\\' && quote_ == '"') {
          ++i;
        } else if (c == quote_) {
          quote_ = 0;
        }
        continue;
      }
      const char before = i == 0 ? ' ' : line[i - 1];
      const bool starts = before == ' ' || before == '\t' || before == '[' || before == '{' ||
                          before == ',' || before == ':';
      if (c == '#' && (before == ' ' || before == '\t')) return;
      if ((c == '"' || c == '\'') && starts) {
        quote_ = c;
        quote_line_ = line_;
        quote_column_ = static_cast<int>(i) + 1;
      } else if ((c == '[' || c == '{') && (starts || !open_.empty())) {
        open_.push_back({c, line_, static_cast<int>(i) + 1});
      } else if ((c == ']' || c == '}') && !open_.empty()) {
        Close(c, static_cast<int>(i) + 1);
      }
    }
  }

  void Close(char sign, int column) {
    const Bracket opened = open_.back();
    open_.pop_back();
    if ((opened.sign == '[') == (sign == ']')) return;
    Tell(line_, column,
         fmt::format("the bracket {} closes {} of line {}", sign, opened.sign, opened.line));
  }

  std::optional<SyntaxCause> cause_;
  int line_ = 0, last_line_ = 0;
  std::vector<int> levels_;  // columns at which the open levels start
  bool expects_value_ = false, continues_ = false;
  std::string lone_;  // a line without key where a value was expected
  int lone_line_ = 0, lone_indent_ = 0;
  int block_indent_ = -1;  // of the key whose text after | or > goes on; -1: none
  char quote_ = 0;
  int quote_line_ = 0, quote_column_ = 0;
  std::vector<Bracket> open_;
};

}  // namespace

std::optional<SyntaxCause> FindSyntaxCause(const std::string& text) { return Scanner().Scan(text); }

}  // namespace mbv::internal
