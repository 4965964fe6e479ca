// The skeleton of a page: one file of HTML with head, badge, navigation, sections and footer.
#pragma once

#include <map>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "comparison/comparison.h"
#include "report/document.h"

namespace mbv {

// Pieces of HTML: escaped text, tables, base64.

/// Text that is safe between tags and in quoted attributes.
[[nodiscard]] std::string Escape(std::string_view text);

/// RFC 4648, with padding.
[[nodiscard]] std::string Base64(std::string_view bytes);
/// The values as little-endian 32-bit floats.
[[nodiscard]] std::string Base64(std::span<const float> values);

/// "–" for what is not a number.
[[nodiscard]] std::string NumberOrDash(double value, const char* format = "{:.2e}");

/// With a capital letter and a full stop.
[[nodiscard]] std::string Sentence(std::string text);

/// HTML that is seen when its title is clicked.
[[nodiscard]] std::string Folded(const std::string& title, const std::string& content);
/// A picture beside others.
[[nodiscard]] std::string FigureHtml(const std::string& svg);

/// A faint remark.
[[nodiscard]] std::string Note(const std::string& text);
/// A word on coloured ground: kind is ok, warn, fail or off.
[[nodiscard]] std::string Pill(const char* kind, const std::string& text);
/// A number with its title, and what it is about below.
[[nodiscard]] std::string Card(const std::string& title, const std::string& value,
                               const std::string& detail);
/// "force_nrmse" → "force nrmse".
[[nodiscard]] std::string Spaced(std::string text);

/// What stands around a page's sections. Texts; they are escaped here.
struct PageHead {
  std::string kicker = {};            ///< above the title: "mbverify report"
  std::string title = {}, lead = {};  ///< heading, and a sentence below it
  Verdict verdict = Verdict::kNotRun;
  std::string word = {};  ///< instead of the verdict's
  bool judges = true;     ///< false: a page of numbers, without a verdict
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
  void Add(const ReportSection& section) { Add(section.title, section.link, ToHtml(section)); }

  /// The whole page. Its policy forbids every request: what is shown is in the file.
  [[nodiscard]] std::string Write(const PageHead& head) const;

 private:
  std::string navigation_, sections_;
};

// The skeleton (page.html with {{places}} to fill), script and style of report.html, bundled from
// web/ when the program is built.

[[nodiscard]] std::string_view PageSkeleton();
[[nodiscard]] std::string_view PageScript();
[[nodiscard]] std::string_view PageStyle();

/// A skeleton with its {{places}} filled; each must have a value, which is HTML.
[[nodiscard]] std::string FillPage(std::string_view skeleton,
                                   const std::map<std::string_view, std::string_view>& values);

}  // namespace mbv
