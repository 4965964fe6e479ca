// Tables for papers: the same cells as LaTeX (booktabs) and as Markdown.
#pragma once

#include <string>
#include <vector>

namespace mbv {

struct PaperTableColumn {
  std::string title;
  bool number = false;  ///< to the right
  bool wide = false;    ///< texts of several lines
};

struct PaperTable {
  std::string name;  ///< of its files, and of LaTeX's label
  std::string caption;
  std::vector<PaperTableColumn> columns;
  std::vector<std::vector<std::string>> rows;  ///< plain text; a short row is filled up
};

/// A table environment, for `\usepackage{booktabs}`; label "tab:NAME". With more lines than a page
/// has, a longtable that repeats its head (`\usepackage{longtable}`).
[[nodiscard]] std::string ToLatex(const PaperTable& table);

[[nodiscard]] std::string ToMarkdown(const PaperTable& table);

}  // namespace mbv
