#include "input/yaml_reader.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <map>
#include <utility>

#include "core/inputs.h"
#include "core/word_hints.h"

namespace mbv {

const YamlNode* YamlNode::Find(std::string_view key) const {
  for (const YamlEntry& entry : entries) {
    if (entry.key == key) return entry.value.get();
  }
  return nullptr;
}

std::string JoinPath(std::string_view path, std::string_view key) {
  if (path.empty()) return std::string(key);
  return fmt::format("{}.{}", path, key);
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
std::string Shortened(const std::string& text) {
  std::string line = text.substr(0, text.find('\n'));
  if (line.size() > 60) {
    size_t end = 57;
    while (end > 0 && (line[end] & 0xC0) == 0x80) --end;  // whole characters only
    line.resize(end);
  }
  return line.size() < text.size() ? line + "..." : line;
}

}  // namespace

namespace {

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
      return fmt::format("'{}'", Shortened(node.text));
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
  if (!given_.insert(fmt::format("{}:{}:{}", line, column, message)).second) return;
  const auto count = static_cast<int>(diagnostics_.findings().size());
  if (count > kMaxFindings) return;
  if (count == kMaxFindings) {
    diagnostics_.Add({.severity = Severity::kError,
                      .file = file_,
                      .message = "more findings are left out",
                      .hint = ""});
    return;
  }
  diagnostics_.Add({severity, file_, line, column, message + note_, hint});
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
        DidYouMean(Shortened(*text), words));
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

YamlMap::YamlMap(YamlReader* reader, const YamlNode* node, std::string path,
                 const std::vector<std::string>& keys)
    : reader_(reader), node_(node), path_(std::move(path)) {
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
    // What is no model or scenario at all may hold what must not be shown.
    const bool foreign = path_.empty() && node_->is_scalar();
    const std::string what = foreign ? "a text" : Describe(*node_);
    reader_->Error(*node_, fmt::format("{} is {}, a map is needed", shown, what),
                   is_known(own) ? fmt::format("'{}' belongs into an entry of {}: indent it deeper",
                                               own, path_.substr(0, dot))
                                 : "");
    return;
  }
  valid_ = true;
  const YamlEntry* before = nullptr;
  for (const YamlEntry& entry : node_->entries) {
    const YamlEntry* above = std::exchange(before, &entry);
    if (is_known(entry.key)) continue;
    const std::string near = DidYouMean(Shortened(entry.key), keys);
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
      hint = fmt::format("if it belongs into '{}', indent it deeper", Shortened(above->key));
    } else if (!near.empty()) {
      hint = near;
    } else {
      for (const std::string& key : keys) hint += (hint.empty() ? "known keys: " : ", ") + key;
    }
    reader_->Error(entry, fmt::format("{}: unknown key '{}'", shown, Shortened(entry.key)), hint);
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
