// YamlReader::Parse: yaml-cpp's events → YamlNode tree, refusing what the formats do not allow.
#include <fmt/format.h>
#include <yaml-cpp/eventhandler.h>
#include <yaml-cpp/exceptions.h>
#include <yaml-cpp/mark.h>
#include <yaml-cpp/parser.h>

#include <algorithm>
#include <map>
#include <sstream>

#include "core/text.h"
#include "input/parsed_documents.h"
#include "input/yaml_reader.h"
#include "input/yaml_syntax.h"

namespace mbv {
namespace {

using Kind = YamlNode::Kind;

// Ends parsing at a place where the rest of the file cannot be read sensibly.
struct Stop {
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
    if (found == anchors_.end()) throw Stop{mark, "an alias refers to the value it stands in"};
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
      throw Stop{mark, fmt::format("nested deeper than {} levels", YamlReader::kMaxDepth)};
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
      throw Stop{YAML::Mark::null_mark(), "the file has too many values (aliases expanded)"};
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

// A quote that nobody closes takes the rest of the file as its text, and yaml-cpp does not mind.
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
  try {
    std::istringstream stream(text);
    YAML::Parser parser(stream);
    if (!parser.HandleNextDocument(builder) || builder.root() == nullptr) {
      AddAt(Severity::kError, 1, 1, "the file is empty");
      return nullptr;
    }
    if (const YAML::Mark& mark = builder.last_quoted(); IsNeverClosed(text, mark)) {
      AddAt(Severity::kError, mark.line + 1, mark.column + 1,
            fmt::format("YAML syntax: the quote {} is never closed",
                        text[static_cast<size_t>(mark.pos)]));
      return nullptr;
    }
    if (parser) AddAt(Severity::kWarning, 0, 0, "only the first YAML document is read");
  } catch (const YAML::Exception& e) {
    if (const auto cause = internal::FindSyntaxCause(text)) {
      AddAt(Severity::kError, cause->line, cause->column, "YAML syntax: " + cause->message,
            cause->hint);
    } else {
      AddAt(Severity::kError, e.mark.line + 1, e.mark.column + 1, "YAML syntax: " + e.msg);
    }
    return nullptr;
  } catch (const Stop& stop) {
    AddAt(Severity::kError, stop.mark.line + 1, stop.mark.column + 1, stop.message);
    return nullptr;
  } catch (const std::exception& e) {
    AddAt(Severity::kError, 0, 0, std::string("YAML syntax: ") + e.what());
    return nullptr;
  }
  if (diagnostics_.findings().empty()) ParsedDocuments::Keep(text, builder.root());
  return builder.root();
}

}  // namespace mbv
