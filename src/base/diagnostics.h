// Findings about input files: all of them, each with place, value, rule and hint.
#pragma once

#include <string>
#include <utility>
#include <vector>

namespace mbv {

enum class Severity { kWarning, kError };

/// What a finding is about, where a caller decides by it: messages are for readers only.
enum class FindingCode {
  kOther,
  kOpenLoop,    ///< `subject`: the joint at which the loop stays open at home
  kUnknownKey,  ///< `subject`: the key, with those above it ("simulation.stp_s")
};

/// One finding. Printed as
///   file:line:column: error: message
///     hint: …
struct Finding {
  Severity severity = Severity::kError;
  std::string file = {};
  int line = 0;              ///< 1-based; 0 when the finding has no place in the file
  int column = 0;            ///< 1-based
  std::string message = {};  ///< names the key, the value and the broken rule
  std::string hint = {};     ///< how to fix it; may be empty
  FindingCode code = FindingCode::kOther;
  std::string subject = {};  ///< see FindingCode
  /// Key and value of the option --set that `file` shows; empty for files.
  std::pair<std::string, std::string> set = {};
};

/// A list of findings in the order found.
class Diagnostics {
 public:
  void Add(Finding finding) { findings_.push_back(std::move(finding)); }
  /// An error without a place in `file`.
  void AddError(const std::string& file, std::string message, std::string hint = {});
  void Append(const Diagnostics& other);
  [[nodiscard]] const std::vector<Finding>& findings() const { return findings_; }
  [[nodiscard]] bool empty() const { return findings_.empty(); }
  [[nodiscard]] bool has_errors() const;
  [[nodiscard]] std::string Text() const;  ///< every finding, one per line (hints indented below)

 private:
  std::vector<Finding> findings_;
};

[[nodiscard]] std::string ToText(const Finding& finding);

/// See math/bytes.h.
template <typename Visit>
void VisitMembers(Visit& visit, typename Visit::template Of<Finding>& finding) {
  visit(finding.severity), visit(finding.file), visit(finding.line), visit(finding.column);
  visit(finding.message), visit(finding.hint), visit(finding.code), visit(finding.subject);
  visit(finding.set.first), visit(finding.set.second);
}

/// The candidate closest to `word` by edit distance, or "" when none is near (for "did you mean").
[[nodiscard]] std::string ClosestWord(const std::string& word,
                                      const std::vector<std::string>& candidates);

/// "did you mean 'candidate'?", or "" when none is near.
[[nodiscard]] std::string DidYouMean(const std::string& word,
                                     const std::vector<std::string>& candidates);

}  // namespace mbv
