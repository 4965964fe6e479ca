#include "model_file/yaml/yaml_reader.h"

#include <fmt/format.h>
#include <yaml-cpp/eventhandler.h>
#include <yaml-cpp/exceptions.h>
#include <yaml-cpp/mark.h>
#include <yaml-cpp/parser.h>
#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <map>
#include <sstream>
#include <string_view>
#include <utility>
#include <vector>

#include "base/inputs.h"
#include "base/text.h"

namespace mbv {

const YamlNode* YamlNode::Find(std::string_view key) const {
  for (const YamlEntry& entry : entries) {
    if (entry.key == key) return entry.value.get();
  }
  return nullptr;
}

std::string JoinPath(std::string_view path, std::string_view key) {
  std::string joined;
  joined.reserve(path.size() + 1 + key.size());
  if (!path.empty()) joined.append(path).append(1, '.');
  return joined.append(key);
}

std::optional<double> PlainNumber(std::string_view text) {
  if (!text.empty() && text.front() == '+') text.remove_prefix(1);
  // YAML's words for what is not finite.
  for (const std::string_view word : {".inf", ".Inf", ".INF", "-.inf", "-.Inf", "-.INF"}) {
    if (text == word) return text.front() == '-' ? -HUGE_VAL : HUGE_VAL;
  }
  if (text == ".nan" || text == ".NaN" || text == ".NAN") return std::nan("");
  double value = 0.0;
  const char* end = text.data() + text.size();
  const auto [stop, error] = std::from_chars(text.data(), end, value);
  if (error == std::errc::result_out_of_range) return HUGE_VAL;
  if (error != std::errc() || stop != end) return std::nullopt;
  return value;
}

namespace {

// Long or many-line values are cut in messages.
std::string ShortValue(const std::string& text) {
  std::string line = text.substr(0, text.find('\n'));
  if (line.size() > 60) {
    size_t end = 57;
    while (end > 0 && (line[end] & 0xC0) == 0x80) --end;  // whole characters only
    line.resize(end);
  }
  return line.size() < text.size() ? line + "..." : line;
}

bool IsControl(char c) {
  const auto byte = static_cast<unsigned char>(c);
  return byte < 0x20 || byte == 0x7F;
}

// Where the text of a pipe (`<(…)`, /dev/stdin) is kept, which gives it only once although a
// scenario is read for its kind, for its values and for each witness; null for files and folders.
std::optional<std::string>* KeptText(const std::string& file) {
  static std::map<std::string, std::optional<std::string>> texts;
  std::error_code error;
  const auto type = std::filesystem::status(file, error).type();
  const bool pipe = type == std::filesystem::file_type::fifo ||
                    type == std::filesystem::file_type::socket ||
                    type == std::filesystem::file_type::character;
  return pipe ? &texts[file] : nullptr;
}

}  // namespace

std::string Describe(const YamlNode& node) {
  switch (node.kind) {
    case YamlNode::Kind::kNull:
      return "nothing";
    case YamlNode::Kind::kScalar:
      return fmt::format("'{}'", ShortValue(node.text));
    case YamlNode::Kind::kSequence:
      return fmt::format("a list of {}", node.items.size());
    case YamlNode::Kind::kMap:
      return "a map";
  }
  return "";
}

std::optional<std::string> YamlReader::ReadFile() {
  // Results are named after files, in folders, pages and terminals.
  if (std::any_of(file_.begin(), file_.end(), IsControl)) {
    AddAt(Severity::kError, 0, 0, "the name of the file holds control characters", "rename it");
    return std::nullopt;
  }
  std::optional<std::string>* kept = KeptText(file_);
  if (kept != nullptr && *kept) {
    NoteInput(file_, **kept);
    return **kept;
  }
  std::ifstream stream(file_, std::ios::binary);
  std::string text;
  // Piece by piece: a buffer for the longest file costs more than reading the usual one.
  std::array<char, 1 << 14> piece;
  while (stream && text.size() <= kMaxBytes) {
    stream.read(piece.data(), static_cast<std::streamsize>(piece.size()));
    text.append(piece.data(), static_cast<size_t>(stream.gcount()));
  }
  // A folder opens but cannot be read.
  if (!stream && !stream.eof()) {
    AddAt(Severity::kError, 0, 0, "the file cannot be read",
          DidYouMeanPath(file_, "check the name; paths are relative to the current folder"));
    return std::nullopt;
  }
  if (kept != nullptr) *kept = text;
  NoteInput(file_, text);
  return text;
}

void YamlReader::AddAt(Severity severity, int line, int column, const std::string& message,
                       const std::string& hint) {
  Add({severity, file_, line, column, message, hint});
}

void YamlReader::RefuseForeign(const YamlNode& root, const std::string& message,
                               const std::string& hint) {
  diagnostics_ = {};
  given_.clear();
  Error(root, message, hint);
  foreign_ = true;
}

void YamlReader::Add(Finding finding) {
  if (foreign_) return;
  if (!given_.insert(fmt::format("{}:{}:{}", finding.line, finding.column, finding.message))
           .second) {
    return;
  }
  const auto count = static_cast<int>(diagnostics_.findings().size());
  if (count > kMaxFindings) return;
  if (count == kMaxFindings) {
    diagnostics_.Add({.severity = Severity::kError,
                      .file = file_,
                      .message = "more findings are left out",
                      .hint = ""});
    return;
  }
  finding.file = file_;
  finding.message += note_;
  diagnostics_.Add(std::move(finding));
}

void YamlReader::Error(const YamlNode& at, const std::string& message, const std::string& hint) {
  AddAt(Severity::kError, at.line, at.column, message, hint);
}

void YamlReader::Error(const YamlEntry& at, const std::string& message, const std::string& hint) {
  AddAt(Severity::kError, at.line, at.column, message, hint);
}

void YamlReader::Warn(const YamlNode& at, const std::string& message, const std::string& hint) {
  AddAt(Severity::kWarning, at.line, at.column, message, hint);
}

std::optional<std::string> YamlReader::Text(const YamlNode& node, const std::string& path) {
  if (node.is_scalar() && !node.text.empty()) return node.text;
  Error(node, fmt::format("{} is {}, a word is needed", path, Describe(node)));
  return std::nullopt;
}

std::optional<bool> YamlReader::Flag(const YamlNode& node, const std::string& path) {
  if (node.is_scalar() && node.text == "true") return true;
  if (node.is_scalar() && node.text == "false") return false;
  Error(node, fmt::format("{} = {} is neither true nor false", path, Describe(node)));
  return std::nullopt;
}

std::optional<double> YamlReader::Number(const YamlNode& node, const std::string& path) {
  const auto value = node.is_scalar() ? PlainNumber(node.text) : std::nullopt;
  if (!value) {
    Error(node, fmt::format("{} is {}, a number is needed", path, Describe(node)));
    return std::nullopt;
  }
  if (!std::isfinite(*value)) {
    Error(node, fmt::format("{} = {} is not a finite number", path, Describe(node)));
    return std::nullopt;
  }
  return value;
}

std::optional<int> YamlReader::Integer(const YamlNode& node, const std::string& path) {
  const auto value = Number(node, path);
  if (!value) return std::nullopt;
  if (*value == std::floor(*value) && std::abs(*value) < 1e9) return static_cast<int>(*value);
  Error(node, fmt::format("{} = {} is not a whole number", path, node.text));
  return std::nullopt;
}

std::optional<int> YamlReader::Choice(const YamlNode& node, const std::string& path,
                                      const std::vector<std::string>& words) {
  const auto text = Text(node, path);
  if (!text) return std::nullopt;
  for (size_t i = 0; i < words.size(); ++i) {
    if (words[i] == *text) return static_cast<int>(i);
  }
  std::string list;
  for (const std::string& word : words) list += (list.empty() ? "" : ", ") + word;
  Error(node, fmt::format("{} = {} is not one of: {}", path, Describe(node), list),
        DidYouMean(*text, words));
  return std::nullopt;
}

std::optional<std::vector<const YamlNode*>> YamlReader::Items(const YamlNode& node,
                                                              const std::string& path, int count) {
  if (!node.is_sequence() || (count >= 0 && node.items.size() != static_cast<size_t>(count))) {
    const std::string needed = count < 0 ? "a list" : fmt::format("a list of {}", count);
    Error(node, fmt::format("{} is {}, {} is needed", path, Describe(node), needed));
    return std::nullopt;
  }
  std::vector<const YamlNode*> items;
  for (const YamlNodePtr& item : node.items) items.push_back(item.get());
  return items;
}

const std::vector<YamlEntry>& YamlReader::Entries(const YamlNode& node, const std::string& path) {
  static const std::vector<YamlEntry> none;
  if (node.is_map()) return node.entries;
  if (!node.is_null()) {
    Error(node, fmt::format("{} is {}, a map of names is needed", path, Describe(node)));
  }
  return none;
}

namespace {

// What files of many kinds have.
constexpr std::array kCommonKeys = {"name",   "description", "title",  "version", "kind",
                                    "type",   "parameters",  "source", "license", "date",
                                    "author", "units",       "label",  "notes",   "schema"};

// Of a key of this many letters, how many may be wrong.
bool IsNear(const std::string& key, const std::vector<std::string>& keys) {
  constexpr size_t kShortest = 4;
  return key.size() >= kShortest && !ClosestWord(key, keys).empty();
}

struct KeyCounts {
  size_t known = 0, telling = 0;  // telling: known, and not common
};

KeyCounts CountKnown(const std::vector<YamlEntry>& entries, const std::vector<std::string>& keys) {
  KeyCounts counts;
  for (const YamlEntry& entry : entries) {
    if (!Contains(keys, entry.key) && !IsNear(entry.key, keys)) continue;
    ++counts.known;
    const bool common = std::ranges::find(kCommonKeys, entry.key) != kCommonKeys.end();
    counts.telling += common ? 0 : 1;
  }
  return counts;
}

}  // namespace

YamlMap::YamlMap(YamlReader* reader, const YamlNode* node, std::string path,
                 const std::vector<std::string>& keys)
    : reader_(reader), node_(node), path_(std::move(path)) {
  Check(keys);
}

YamlMap::YamlMap(YamlReader* reader, const YamlNode* node, std::string path,
                 std::initializer_list<std::string_view> keys)
    : reader_(reader), node_(node), path_(std::move(path)) {
  const auto is_known = [&](const YamlEntry& entry) {
    return std::ranges::find(keys, entry.key) != keys.end();
  };
  // The usual case, for which no list of texts is made.
  valid_ = node_ == nullptr || node_->is_null() ||
           (node_->is_map() && !path_.empty() && std::ranges::all_of(node_->entries, is_known));
  if (!valid_) Check({keys.begin(), keys.end()});
}

void YamlMap::Check(const std::vector<std::string>& keys) {
  if (node_ == nullptr || node_->is_null()) {
    valid_ = true;
    return;
  }
  const std::string shown = path_.empty() ? "the file" : path_;
  const auto is_known = [&](const std::string& key) {
    return std::find(keys.begin(), keys.end(), key) != keys.end();
  };
  if (!node_->is_map()) {
    const size_t dot = path_.rfind('.');
    const std::string own = dot == std::string::npos ? "" : path_.substr(dot + 1);
    if (path_.empty() && node_->is_scalar()) {
      reader_->RefuseForeign(*node_, "the file is a text, a map is needed", "");
      return;
    }
    reader_->Error(*node_, fmt::format("{} is {}, a map is needed", shown, Describe(*node_)),
                   is_known(own) ? fmt::format("'{}' belongs into an entry of {}: indent it deeper",
                                               own, path_.substr(0, dot))
                                 : "");
    return;
  }
  valid_ = true;
  const KeyCounts counts = path_.empty() ? CountKnown(node_->entries, keys) : KeyCounts{};
  const size_t all = node_->entries.size();
  if (path_.empty() && all > counts.known && (counts.telling == 0 || all > 2 * counts.known)) {
    valid_ = false;
    reader_->RefuseForeign(
        *std::exchange(node_, nullptr),
        counts.known == 0
            ? fmt::format("the file is of another kind: none of its {} keys is known", all)
            : fmt::format("the file is of another kind: {} of its {} keys {} known", counts.known,
                          all, counts.known == 1 ? "is" : "are"),
        "known keys: " + Joined(keys));
    return;
  }
  const YamlEntry* before = nullptr;
  for (const YamlEntry& entry : node_->entries) {
    const YamlEntry* above = std::exchange(before, &entry);
    if (is_known(entry.key)) continue;
    const std::string near = DidYouMean(entry.key, keys);
    const std::vector<YamlEntry>& inner = entry.value->entries;
    const bool like_this = !inner.empty() && !path_.empty() &&
                           std::all_of(inner.begin(), inner.end(),
                                       [&](const YamlEntry& e) { return is_known(e.key); });
    std::string hint;
    if (entry.value->is_null() && entry.key.find(' ') != std::string::npos) {
      hint = "inside { } a text with a comma needs quotes";
    } else if (like_this) {
      hint = "it looks like another entry of the level above: indent it less";
    } else if (near.empty() && above != nullptr && above->value->is_null()) {
      hint = fmt::format("if it belongs into '{}', indent it deeper", ShortValue(above->key));
    } else if (!near.empty()) {
      hint = near;
    } else {
      for (const std::string& key : keys) hint += (hint.empty() ? "known keys: " : ", ") + key;
    }
    reader_->Add({.line = entry.line,
                  .column = entry.column,
                  .message = fmt::format("{}: unknown key '{}'", shown, QuotedValue(entry.key)),
                  .hint = hint,
                  .code = FindingCode::kUnknownKey,
                  .subject = PathOf(entry.key)});
  }
}

const YamlNode* YamlMap::Find(std::string_view key) const {
  const YamlNode* node = node_ == nullptr ? nullptr : node_->Find(key);
  return node == nullptr || node->is_null() ? nullptr : node;
}

const YamlNode* YamlMap::Required(const std::string& key) const {
  const YamlNode* found = Find(key);
  if (found == nullptr && valid_ && node_ != nullptr) {
    reader_->Error(*node_,
                   fmt::format("{}: '{}' is missing", path_.empty() ? "the file" : path_, key));
  }
  return found;
}

std::string YamlMap::PathOf(std::string_view key) const { return JoinPath(path_, key); }

YamlMap::InUnit YamlMap::FindInUnit(const std::string& key,
                                    std::initializer_list<UnitSuffix> units) const {
  InUnit found;
  for (const UnitSuffix& unit : units) {
    const std::string name = key + std::string(unit.suffix);
    const YamlNode* node = Find(name);
    if (node == nullptr) continue;
    if (found.node != nullptr) {
      reader_->Error(*node, fmt::format("{} and {} are both given", PathOf(found.key), name),
                     "keep one of them");
      continue;
    }
    found = {node, name, unit};
  }
  return found;
}

}  // namespace mbv

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
      AddFinding(quote_line_, quote_column_, fmt::format("the quote {} is never closed", quote_));
    }
    if (!cause_ && !open_.empty()) {
      AddFinding(open_.back().line, open_.back().column,
                 fmt::format("the bracket {} is never closed", open_.back().sign));
    }
    return cause_;
  }

 private:
  struct Bracket {
    char sign;
    int line, column;
  };

  void AddFinding(int line, int column, std::string message, std::string hint = "") {
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
      AddFinding(line_, static_cast<int>(line.find('\t')) + 1, "the line is indented by a tab",
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
          AddFinding(
              line_, indent + 1,
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
    AddFinding(
        line_, indent + 1,
        fmt::format("the line is indented by {} spaces, the lines above it by {}", indent, fitting),
        "lines of one level start in the same column");
    return false;
  }

  void NoKey(std::string_view content, int line, int indent) {
    const size_t colon = content.find(':');
    if (colon != std::string_view::npos && colon > 0) {
      AddFinding(line, indent + static_cast<int>(colon) + 1, "there is no space after the colon",
                 "write KEY: VALUE");
    } else {
      AddFinding(line, indent + 1, "the line has no ': '",
                 "write KEY: VALUE, or - VALUE in a list");
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
    AddFinding(line_, column,
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

// YamlReader::Parse: yaml-cpp's events → YamlNode tree, refusing what the formats do not allow.

namespace mbv {
namespace {

using Kind = YamlNode::Kind;

// Ends parsing at a place where the rest of the file cannot be read sensibly.
struct Refused {
  YAML::Mark mark;
  std::string message;
};

class TreeBuilder : public YAML::EventHandler {
 public:
  explicit TreeBuilder(YamlReader* reader) : reader_(reader) {}
  [[nodiscard]] YamlNodePtr root() const { return root_; }
  /// Where the last text in quotes starts; null when there is none.
  [[nodiscard]] const YAML::Mark& last_quoted() const { return last_quoted_; }

  void OnDocumentStart(const YAML::Mark&) override {}
  void OnDocumentEnd() override {}
  void OnNull(const YAML::Mark& mark, YAML::anchor_t anchor) override {
    Leaf(MakeNode(Kind::kNull, mark), anchor);
  }
  void OnScalar(const YAML::Mark& mark, const std::string& tag, YAML::anchor_t anchor,
                const std::string& value) override {
    auto node = MakeNode(Kind::kScalar, mark);
    node->text = value;
    node->quoted = tag == "!";
    if (node->quoted) last_quoted_ = mark;
    CheckTag(mark, tag);
    CheckText(mark, value);
    Leaf(node, anchor);
  }
  void OnAlias(const YAML::Mark& mark, YAML::anchor_t anchor) override {
    const auto found = anchors_.find(anchor);
    if (found == anchors_.end()) throw Refused{mark, "an alias refers to the value it stands in"};
    Add(found->second);
  }
  void OnSequenceStart(const YAML::Mark& mark, const std::string& tag, YAML::anchor_t anchor,
                       YAML::EmitterStyle::value) override {
    Open(Kind::kSequence, mark, tag, anchor);
  }
  void OnSequenceEnd() override { Close(); }
  void OnMapStart(const YAML::Mark& mark, const std::string& tag, YAML::anchor_t anchor,
                  YAML::EmitterStyle::value) override {
    Open(Kind::kMap, mark, tag, anchor);
  }
  void OnMapEnd() override { Close(); }

 private:
  struct Level {
    std::shared_ptr<YamlNode> node;
    YAML::anchor_t anchor = 0;
    YamlNodePtr key;                  // waiting for its value
    std::map<std::string, int> keys;  // of a map: where each key's entry is
  };

  static std::shared_ptr<YamlNode> MakeNode(Kind kind, const YAML::Mark& mark) {
    auto node = std::make_shared<YamlNode>();
    node->kind = kind;
    node->line = mark.line + 1;
    node->column = mark.column + 1;
    return node;
  }

  void CheckTag(const YAML::Mark& mark, const std::string& tag) {
    if (tag.empty() || tag == "?" || tag == "!") return;
    reader_->AddAt(Severity::kError, mark.line + 1, mark.column + 1,
                   fmt::format("the tag {} is not part of this format", tag), "leave the tag out");
  }

  // Escapes in quotes ("\\e") can write what the file itself must not hold.
  void CheckText(const YAML::Mark& mark, const std::string& value) {
    const size_t at = FindNonText(value);
    if (at == std::string::npos) return;
    reader_->AddAt(Severity::kError, mark.line + 1, mark.column + 1,
                   fmt::format("the value holds the control character 0x{:02x}",
                               static_cast<unsigned char>(value[at])));
  }

  void Leaf(const std::shared_ptr<YamlNode>& node, YAML::anchor_t anchor) {
    if (anchor != 0) anchors_[anchor] = node;
    Add(node);
  }

  void Open(Kind kind, const YAML::Mark& mark, const std::string& tag, YAML::anchor_t anchor) {
    CheckTag(mark, tag);
    if (levels_.size() >= YamlReader::kMaxDepth) {
      throw Refused{mark, fmt::format("nested deeper than {} levels", YamlReader::kMaxDepth)};
    }
    levels_.push_back({MakeNode(kind, mark), anchor, nullptr, {}});
  }

  void Close() {
    const Level level = std::move(levels_.back());
    levels_.pop_back();
    if (level.anchor != 0) anchors_[level.anchor] = level.node;
    Add(level.node);
  }

  // Puts a complete node where it belongs.
  void Add(const YamlNodePtr& node) {
    if (levels_.empty()) {
      root_ = node;
      return;
    }
    Level& level = levels_.back();
    level.node->size += node->size;
    if (level.node->size > YamlReader::kMaxNodes) {
      throw Refused{YAML::Mark::null_mark(), "the file has too many values (aliases expanded)"};
    }
    if (level.node->kind == Kind::kSequence) {
      level.node->items.push_back(node);
    } else if (level.key == nullptr) {
      level.key = node;
    } else {
      AddEntry(&level, *level.key, node);
      level.key = nullptr;
    }
  }

  void AddEntry(Level* level, const YamlNode& key, const YamlNodePtr& value) {
    std::vector<YamlEntry>& entries = level->node->entries;
    if (!key.is_scalar() || key.text.empty()) {
      reader_->Error(key, fmt::format("a key is {}, a word is needed", Describe(key)));
      return;
    }
    if (key.text == "<<" && !key.quoted) {
      reader_->Error(key, "merge keys (<<) are not part of this format",
                     "write equal groups once under 'parts' and place them by 'instances'");
      return;
    }
    const auto [known, added] = level->keys.emplace(key.text, static_cast<int>(entries.size()));
    if (!added) {
      reader_->Error(key, fmt::format("the key {} is already given in line {}", Describe(key),
                                      entries[known->second].line));
      return;
    }
    entries.push_back({key.text, key.line, key.column, value});
  }

  YamlReader* reader_;
  YamlNodePtr root_;
  YAML::Mark last_quoted_ = YAML::Mark::null_mark();
  std::vector<Level> levels_;
  std::map<YAML::anchor_t, YamlNodePtr> anchors_;
};

// An open quote takes the rest of the file as its text, and yaml-cpp does not mind.
bool IsNeverClosed(const std::string& text, const YAML::Mark& start) {
  if (start.is_null() || static_cast<size_t>(start.pos) >= text.size()) return false;
  const auto at = static_cast<size_t>(start.pos);
  const char quote = text[at];
  if (quote != '"' && quote != '\'') return false;
  for (size_t i = at + 1; i < text.size(); ++i) {
    const bool escaped = quote == '"' ? text[i] == '\\' : text.compare(i, 2, "''") == 0;
    if (escaped) {
      ++i;
    } else if (text[i] == quote) {
      return false;
    }
  }
  return true;
}

// False after a finding.
bool IsText(const std::string& text, YamlReader* reader) {
  if (text.size() > YamlReader::kMaxBytes) {
    reader->AddAt(Severity::kError, 0, 0,
                  fmt::format("the file is larger than {} bytes", YamlReader::kMaxBytes));
    return false;
  }
  const size_t at = FindNonText(std::string_view(text));
  if (at == std::string::npos) return true;
  const auto line = 1 + std::count(text.begin(), text.begin() + static_cast<long>(at), '\n');
  const size_t start = at == 0 ? std::string::npos : text.rfind('\n', at - 1);
  reader->AddAt(
      Severity::kError, static_cast<int>(line),
      static_cast<int>(start == std::string::npos ? at + 1 : at - start),
      fmt::format("byte 0x{:02x} is not UTF-8 text", static_cast<unsigned char>(text[at])),
      "save the file as UTF-8 text");
  return false;
}

}  // namespace

size_t FindNonText(const std::string& text) { return FindNonText(std::string_view(text)); }

YamlNodePtr YamlReader::Parse(const std::string& text) {
  if (YamlNodePtr known = ParsedDocuments::Find(text)) return known;
  if (!IsText(text, this)) return nullptr;
  TreeBuilder builder(this);
  // Without a root nothing says of which kind the file is: findings that quote it are dropped.
  const auto refuse = [&](int line, int column, const std::string& message,
                          const std::string& hint = "") {
    diagnostics_ = {};
    given_.clear();
    AddAt(Severity::kError, line, column, message, hint);
    return nullptr;
  };
  try {
    std::istringstream stream(text);
    YAML::Parser parser(stream);
    if (!parser.HandleNextDocument(builder) || builder.root() == nullptr) {
      return refuse(1, 1, "the file is empty");
    }
    if (const YAML::Mark& mark = builder.last_quoted(); IsNeverClosed(text, mark)) {
      return refuse(mark.line + 1, mark.column + 1,
                    fmt::format("YAML syntax: the quote {} is never closed",
                                text[static_cast<size_t>(mark.pos)]));
    }
    if (parser) AddAt(Severity::kWarning, 0, 0, "only the first YAML document is read");
  } catch (const YAML::Exception& e) {
    if (const auto cause = internal::FindSyntaxCause(text)) {
      return refuse(cause->line, cause->column, "YAML syntax: " + cause->message, cause->hint);
    }
    return refuse(e.mark.line + 1, e.mark.column + 1,
                  "YAML syntax: what stands here cannot be read",
                  "look at quotes, escapes in them, brackets, anchors (&) and aliases (*)");
  } catch (const Refused& stop) {
    return refuse(stop.mark.line + 1, stop.mark.column + 1, stop.message);
  } catch (const std::exception&) {
    return refuse(0, 0, "YAML syntax: the file cannot be read");
  }
  if (diagnostics_.findings().empty()) ParsedDocuments::Keep(text, builder.root());
  return builder.root();
}

namespace {

thread_local ParsedDocuments* parsed = nullptr;

}  // namespace

// The outermost one keeps the documents, so that they outlive each part of a command.
ParsedDocuments::ParsedDocuments() : outer_(parsed) {
  if (outer_ == nullptr) parsed = this;
}

ParsedDocuments::~ParsedDocuments() {
  if (outer_ == nullptr) parsed = nullptr;
}

YamlNodePtr ParsedDocuments::Find(const std::string& text) {
  if (parsed == nullptr) return nullptr;
  auto& kept = parsed->kept_;
  const auto found = std::find_if(kept.begin(), kept.end(),
                                  [&](const auto& document) { return document.first == text; });
  if (found == kept.end()) return nullptr;
  kept.splice(kept.begin(), kept, found);
  return found->second;
}

void ParsedDocuments::Keep(const std::string& text, const YamlNodePtr& root) {
  if (parsed == nullptr) return;
  parsed->kept_.emplace_front(text, root);
  if (parsed->kept_.size() > kMostDocuments) parsed->kept_.pop_back();
}

}  // namespace mbv
