// The skeleton of a page: one file of HTML with head, badge, navigation, sections and footer.
#pragma once

#include <string>

#include "comparison/comparison.h"

namespace mbv {

/// What stands around a page's sections. Texts; they are escaped here.
struct PageHead {
  std::string kicker = {};            ///< above the title: "mbverify report"
  std::string title = {}, lead = {};  ///< heading, and a sentence below it
  Verdict verdict = Verdict::kNotRun;
  std::string word = {};  ///< instead of the verdict's
  bool judges = true;     ///< false: a page of numbers, without a verdict
  bool sign = true;       ///< ✓, ✗ or ? before the verdict's word
  std::string footer = {};
  std::string script_source =
      {};                    ///< which scripts may run, as in a content security policy; "": none
  std::string scripts = {};  ///< HTML: the elements with data and script, behind the footer
};

class Page {
 public:
  /// A section with its link in the navigation: `link` in lower case is its anchor. Without content
  /// there is none.
  void Add(const std::string& title, const std::string& link, const std::string& content);

  /// The whole page. Its policy forbids every request: what is shown is in the file.
  [[nodiscard]] std::string Write(const PageHead& head) const;

 private:
  std::string navigation_, sections_;
};

}  // namespace mbv
