// What is reported, as values: tables and sections of any result, with one writer for each format.
#pragma once

#include <string>
#include <utility>
#include <variant>
#include <vector>

namespace mbv {

/// How a word is coloured, on a page and on a terminal.
enum class Mark { kNone, kOk, kWarn, kFail, kOff };

/// Where a part is shown; files (Markdown, LaTeX) show what a page does.
enum class On { kAll, kPage, kTerminal };

/// A text in a table. Texts are escaped by the writers.
struct Cell {
  // NOLINTBEGIN(google-explicit-constructor): a row is a list of texts
  Cell(std::string text_, Mark mark_ = Mark::kNone, std::string remark_ = {})
      : text(std::move(text_)), mark(mark_), remark(std::move(remark_)) {}
  Cell(const char* text_, Mark mark_ = Mark::kNone) : text(text_), mark(mark_) {}
  // NOLINTEND(google-explicit-constructor)
  friend bool operator==(const Cell&, const Cell&) = default;

  std::string text;
  Mark mark = Mark::kNone;
  std::string remark = {};  ///< a warning behind it: "floored"
  bool code = false;        ///< a name or a command
  std::string html = {};    ///< what a page shows in place of `text`; "": the text
};
[[nodiscard]] inline Cell Code(std::string text) {
  Cell cell(std::move(text));
  cell.code = true;
  return cell;
}

/// The cells' texts alone.
[[nodiscard]] std::vector<std::string> Texts(const std::vector<Cell>& row);

struct Column {
  std::string title;
  bool number = false;  ///< to the right
  bool wide = false;    ///< texts that LaTeX breaks into several lines
  On on = On::kAll;
  bool spare = false;  ///< a terminal that is too narrow for all columns does without it
};
[[nodiscard]] inline Column Spare(Column column) {
  column.spare = true;
  return column;
}
[[nodiscard]] inline Column Text(std::string title, On on = On::kAll) {
  return {.title = std::move(title), .on = on};
}
[[nodiscard]] inline Column Digits(std::string title, On on = On::kAll) {
  return {.title = std::move(title), .number = true, .on = on};
}
[[nodiscard]] inline Column Wide(std::string title) {
  return {.title = std::move(title), .wide = true};
}

struct Table {
  std::string name = {};  ///< of its files, and of LaTeX's label
  std::string caption = {};
  std::vector<Column> columns = {};          ///< the first one names the row
  std::vector<std::vector<Cell>> rows = {};  ///< a short row is filled up
};

/// How a terminal shows values.
struct TextStyle {
  std::string indent = "  ";
  bool color = false;
  size_t columns = 0;  ///< of the terminal; 0: as many as are needed
};

/// The headings, then a line a row, without line ends: columns as wide as their widest cell.
[[nodiscard]] std::vector<std::string> TextLines(const Table& table, const TextStyle& style = {});
/// The same as one text; the caption is left out.
[[nodiscard]] std::string ToText(const Table& table, const TextStyle& style = {});
/// A table that scrolls by itself where the page is narrow.
[[nodiscard]] std::string ToHtml(const Table& table);
/// With the caption above, if there is one.
[[nodiscard]] std::string ToMarkdown(const Table& table);
/// A table environment, for `\usepackage{booktabs}`; label "tab:NAME". With more lines than a page
/// has, a longtable that repeats its head (`\usepackage{longtable}`).
[[nodiscard]] std::string ToLatex(const Table& table);

enum class Paint { kPlain, kGood, kBad, kWarning, kTitle, kFaint };
/// As a terminal paints it; unchanged without `color`.
[[nodiscard]] std::string Painted(const std::string& text, Paint paint, bool color);

// Sections.

struct Paragraph {
  enum class Look { kPlain, kReason, kOdd, kNote };
  std::string text;
  Look look = Look::kPlain;
};
struct Items {
  std::vector<std::string> texts;
};
/// Lines as they are: settings, commands.
struct Verbatim {
  std::string text;
};
struct Drawing {
  std::string svg;
};
struct Block;
/// On a page seen when its title is clicked.
struct Fold {
  std::string title;
  std::vector<Block> blocks;
};

struct Block {
  std::variant<Paragraph, Items, Verbatim, Table, Drawing, Fold> what;
  On on = On::kAll;
};

struct ReportSection {
  std::string title, link;
  std::vector<Block> blocks = {};

  /// Empty texts, lists and tables are left out.
  void Add(std::variant<Paragraph, Items, Verbatim, Table, Drawing, Fold> what, On on = On::kAll);
  void Note(std::string text, On on = On::kPage) {
    Add(Paragraph{std::move(text), Paragraph::Look::kNote}, on);
  }
};

/// The section's content; "" without any.
[[nodiscard]] std::string ToHtml(const ReportSection& section);
/// Its paragraphs, lists and tables after a blank line; the title is left out, pictures have no
/// text.
[[nodiscard]] std::string ToText(const ReportSection& section, const TextStyle& style = {});

}  // namespace mbv
