// Checked reading of YAML: a small tree with places, and readers that report instead of throwing.
//
// Every finding carries file:line:column, the path of the key ("bodies.link1.mass"), the value and
// the broken rule. Typical use:
//
//   YamlReader reader(file);
//   YamlNodePtr root = reader.Parse(text);                 // null after a syntax error
//   YamlMap map(&reader, root.get(), "", {"name", "motion"});  // reports unknown and wrong keys
//   if (const YamlNode* node = map.Required("name")) name = reader.Text(*node, map.PathOf("name"));
//   return reader.diagnostics();
#pragma once

#include <initializer_list>
#include <list>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "base/diagnostics.h"
#include "model_file/yaml/units.h"

namespace mbv {

struct YamlNode;
using YamlNodePtr = std::shared_ptr<const YamlNode>;

struct YamlEntry {
  std::string key;
  int line = 0, column = 0;  ///< of the key
  YamlNodePtr value;         ///< never null (a left-out value is a kNull node)
};

/// A value in a YAML document. Aliases are already replaced; keys are unique.
struct YamlNode {
  enum class Kind { kNull, kScalar, kSequence, kMap };
  Kind kind = Kind::kNull;
  int line = 0, column = 0;        ///< 1-based
  std::string text;                ///< scalar only
  bool quoted = false;             ///< scalar only
  std::vector<YamlNodePtr> items;  ///< sequence only
  std::vector<YamlEntry> entries;  ///< map only, in file order
  size_t size = 1;                 ///< nodes below and including this one, aliases expanded

  [[nodiscard]] const YamlNode* Find(std::string_view key) const;  ///< null when there is none
  [[nodiscard]] bool is_scalar() const { return kind == Kind::kScalar; }
  [[nodiscard]] bool is_sequence() const { return kind == Kind::kSequence; }
  [[nodiscard]] bool is_map() const { return kind == Kind::kMap; }
  [[nodiscard]] bool is_null() const { return kind == Kind::kNull; }
};

/// "the number 3", "a list", … for messages.
[[nodiscard]] std::string Describe(const YamlNode& node);

/// The value of `text` if it is a plain decimal number ("0.2", "1e-3", "-4", also ".inf", ".nan").
[[nodiscard]] std::optional<double> PlainNumber(std::string_view text);

/// Offset of the first byte that is not UTF-8 text (control characters included), or npos.
[[nodiscard]] size_t FindNonText(const std::string& text);

/// Parses and reads one file; collects its findings (each once, at most kMaxFindings).
class YamlReader {
 public:
  static constexpr int kMaxFindings = 100;
  static constexpr int kMaxDepth = 64;            ///< nesting
  static constexpr size_t kMaxNodes = 1'000'000;  ///< aliases expanded
  static constexpr size_t kMaxBytes = 16'000'000;

  explicit YamlReader(std::string file) : file_(std::move(file)) {}

  /// The document's root; null after a finding that leaves nothing to read (syntax, not text,
  /// empty, too deep, too large). Duplicate keys, merge keys and odd keys are findings, too.
  [[nodiscard]] YamlNodePtr Parse(const std::string& text);
  /// Reads the file named in the constructor; null (and a finding) when it cannot be read.
  [[nodiscard]] std::optional<std::string> ReadFile();

  void Error(const YamlNode& at, const std::string& message, const std::string& hint = "");
  void Error(const YamlEntry& at, const std::string& message, const std::string& hint = "");
  void Warn(const YamlNode& at, const std::string& message, const std::string& hint = "");
  void AddAt(Severity severity, int line, int column, const std::string& message,
             const std::string& hint = "");
  /// A finding of this file, whatever its `file` says.
  void Add(Finding finding);
  /// The only finding of a file of another kind, which may hold what must not be shown: those
  /// before and after it are dropped.
  void RefuseForeign(const YamlNode& root, const std::string& message, const std::string& hint);
  /// Appended to later messages: " (in limb2)". The same message at the same place is given only
  /// once, whatever the note.
  void SetNote(std::string note) { note_ = std::move(note); }

  /// Readers of one value: empty (after a finding) when it is of another type.
  std::optional<std::string> Text(const YamlNode& node, const std::string& path);
  std::optional<bool> Flag(const YamlNode& node, const std::string& path);
  /// A finite number, no expression.
  std::optional<double> Number(const YamlNode& node, const std::string& path);
  std::optional<int> Integer(const YamlNode& node, const std::string& path);
  /// Index into `words`; a finding with "did you mean" otherwise.
  std::optional<int> Choice(const YamlNode& node, const std::string& path,
                            const std::vector<std::string>& words);
  /// Items of a list; `count` < 0 takes any number.
  std::optional<std::vector<const YamlNode*>> Items(const YamlNode& node, const std::string& path,
                                                    int count = -1);
  /// Entries of a map with free keys; empty after a finding, and for null.
  const std::vector<YamlEntry>& Entries(const YamlNode& node, const std::string& path);

  [[nodiscard]] const std::string& file() const { return file_; }
  [[nodiscard]] const Diagnostics& diagnostics() const { return diagnostics_; }
  [[nodiscard]] bool has_errors() const { return diagnostics_.has_errors(); }

 private:
  std::string file_;
  std::string note_;
  Diagnostics diagnostics_;
  std::set<std::string> given_;  // place and message of each finding
  bool foreign_ = false;
};

/// A map whose keys are known.
class YamlMap {
 public:
  /// Reports a node that is not a map and every key that is not in `keys`. A null node is an empty
  /// map. `path` is the key's path for messages; "" for the whole file. A whole file is of another
  /// kind, and nothing of it is shown or read, if it has unknown keys and either more of them than
  /// known ones, or no known one that says more than `name`, `version` and the like.
  YamlMap(YamlReader* reader, const YamlNode* node, std::string path,
          const std::vector<std::string>& keys);
  YamlMap(YamlReader* reader, const YamlNode* node, std::string path,
          std::initializer_list<std::string_view> keys);

  /// The value, or null when the key is left out (or has no value).
  [[nodiscard]] const YamlNode* Find(std::string_view key) const;
  /// The same, with a finding when it is missing.
  [[nodiscard]] const YamlNode* Required(const std::string& key) const;
  [[nodiscard]] bool Has(std::string_view key) const { return Find(key) != nullptr; }
  [[nodiscard]] std::string PathOf(std::string_view key) const;
  [[nodiscard]] const std::string& path() const { return path_; }
  [[nodiscard]] const YamlNode* node() const { return node_; }
  [[nodiscard]] bool valid() const { return valid_; }

  /// A value that may be given in several units ("guess", "guess_deg").
  struct InUnit {
    const YamlNode* node = nullptr;
    std::string key;
    UnitSuffix unit = kPlain;
  };
  /// The one that is given (node null when none); a finding when two are.
  [[nodiscard]] InUnit FindInUnit(const std::string& key,
                                  std::initializer_list<UnitSuffix> units) const;

 private:
  void Check(const std::vector<std::string>& keys);

  YamlReader* reader_;
  const YamlNode* node_;
  std::string path_;
  bool valid_ = false;
};

/// "a.b" from "a" and "b"; "b" from "" and "b".
[[nodiscard]] std::string JoinPath(std::string_view path, std::string_view key);

}  // namespace mbv

// Why a text is not YAML, in the words of who wrote it. Internal to input/.

namespace mbv::internal {

struct SyntaxCause {
  int line = 0, column = 0;  ///< 1-based
  std::string message, hint;
};

/// The first thing in a text known to be no YAML that explains it: a tab, an indent that fits no
/// line above, a key without ": ", a bracket or quote that is never closed. Parsers name the place
/// where they give up instead, which may be the end of the file.
[[nodiscard]] std::optional<SyntaxCause> FindSyntaxCause(const std::string& text);

}  // namespace mbv::internal

// A document is parsed once for a whole command, however often it is loaded: for its kind, for its
// values, for each witness and for each number that is perturbed.

namespace mbv {

/// While one lives, YamlReader::Parse() of this thread takes a tree that it made of the same text
/// before. Trees of texts with findings are not kept, since findings name the reader's file.
class ParsedDocuments {
 public:
  static constexpr size_t kMostDocuments = 64;  ///< those used last

  ParsedDocuments();
  ~ParsedDocuments();
  ParsedDocuments(const ParsedDocuments&) = delete;
  ParsedDocuments& operator=(const ParsedDocuments&) = delete;

  /// The tree of this text, if some ParsedDocuments of this thread has it; else null.
  [[nodiscard]] static YamlNodePtr Find(const std::string& text);
  static void Keep(const std::string& text, const YamlNodePtr& root);

 private:
  std::list<std::pair<std::string, YamlNodePtr>> kept_;  // the one used last comes first
  ParsedDocuments* outer_;
};

}  // namespace mbv
