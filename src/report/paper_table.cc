#include "report/paper_table.h"

#include <algorithm>
#include <string_view>

#include "base/markup.h"
#include "base/names.h"

namespace mbv {
namespace {

// What LaTeX takes in a label.
std::string Label(std::string name) {
  std::ranges::replace_if(
      name,
      [](char c) {
        return !(IsName(std::string("a") + c) ||
                 std::string_view("-:.+").find(c) != std::string_view::npos);
      },
      '-');
  return "tab:" + name;
}

const std::string& CellOf(const std::vector<std::string>& row, size_t column) {
  static const std::string none;
  return column < row.size() ? row[column] : none;
}

// Of a page at 10 pt, and of a column 0.42 lines wide.
constexpr size_t kPageLines = 40, kWideLetters = 34;

// Lines that LaTeX needs for the rows, where texts of several lines are broken.
size_t LinesOf(const PaperTable& table) {
  size_t lines = 0;
  for (const auto& row : table.rows) {
    size_t own = 1;
    for (size_t k = 0; k < table.columns.size(); ++k) {
      if (!table.columns[k].wide) continue;
      own = std::max(own, (CellOf(row, k).size() + kWideLetters - 1) / kWideLetters);
    }
    lines += own;
  }
  return lines;
}

// Head and foot of a table on one page, or over several: then the head stands on each.
struct LatexFrame {
  std::string head, foot;
};

LatexFrame OnOnePage(const PaperTable& table, const std::string& columns,
                     const std::string& titles) {
  return {"% needs \\usepackage{booktabs}\n\\begin{table}\n  \\centering\n  \\caption{" +
              TexText(table.caption) + "}\n  \\label{" + Label(table.name) +
              "}\n  \\begin{tabular}{" + columns + "}\n    \\toprule\n" + titles +
              "    \\midrule\n",
          "    \\bottomrule\n  \\end{tabular}\n\\end{table}\n"};
}

LatexFrame OverPages(const PaperTable& table, const std::string& columns,
                     const std::string& titles) {
  const std::string all = std::to_string(table.columns.size());
  const std::string head = "    \\toprule\n" + titles + "    \\midrule\n";
  return {
      "% needs \\usepackage{booktabs,longtable}, and a page of one column\n"
      "\\begin{longtable}{" +
          columns + "}\n    \\caption{" + TexText(table.caption) + "}\n    \\label{" +
          Label(table.name) + "} \\\\\n" + head + "    \\endfirsthead\n    \\multicolumn{" + all +
          "}{l}{Table \\thetable, continued} \\\\\n" + head +
          "    \\endhead\n    \\midrule\n    \\endfoot\n    \\bottomrule\n"
          "    \\endlastfoot\n",
      "\\end{longtable}\n"};
}

}  // namespace

std::string ToLatex(const PaperTable& table) {
  std::string columns;
  for (const PaperTableColumn& column : table.columns) {
    columns += column.number ? "r" : column.wide ? "p{0.42\\linewidth}" : "l";
  }
  const auto line = [&](const auto& cell) {
    std::string text = "    ";
    for (size_t k = 0; k < table.columns.size(); ++k) {
      text += (k > 0 ? " & " : "") + TexText(cell(k));
    }
    return text + " \\\\\n";
  };
  const std::string titles = line([&](size_t k) { return table.columns[k].title; });
  const LatexFrame frame = LinesOf(table) > kPageLines ? OverPages(table, columns, titles)
                                                       : OnOnePage(table, columns, titles);
  std::string text = frame.head;
  for (const auto& row : table.rows) text += line([&](size_t k) { return CellOf(row, k); });
  return text + frame.foot;
}

std::string ToMarkdown(const PaperTable& table) {
  const auto line = [&](const auto& cell) {
    std::string text = "|";
    for (size_t k = 0; k < table.columns.size(); ++k) text += " " + cell(k) + " |";
    return text + "\n";
  };
  std::string text = table.caption.empty() ? "" : MarkdownText(table.caption) + "\n\n";
  text += line([&](size_t k) { return MarkdownText(table.columns[k].title); }) + "|";
  for (const PaperTableColumn& column : table.columns) text += column.number ? "---:|" : "---|";
  text += "\n";
  for (const auto& row : table.rows) {
    text += line([&](size_t k) { return MarkdownText(CellOf(row, k)); });
  }
  return text;
}

}  // namespace mbv
