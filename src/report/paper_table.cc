#include "report/paper_table.h"

#include <algorithm>
#include <string_view>
#include <utility>

#include "core/tex_text.h"

namespace mbv {
namespace {

using Replacement = std::pair<char, std::string_view>;

constexpr Replacement kMarkdownTexts[] = {
    {'\\', "\\\\"}, {'|', "\\|"}, {'*', "\\*"},  {'_', "\\_"},  {'`', "\\`"},
    {'[', "\\["},   {']', "\\]"}, {'<', "&lt;"}, {'>', "&gt;"}, {'&', "&amp;"},
    {'\n', " "},    {'\r', " "},  {'\t', " "},
};

const std::string& CellOf(const std::vector<std::string>& row, size_t column) {
  static const std::string none;
  return column < row.size() ? row[column] : none;
}

}  // namespace

std::string MarkdownText(const std::string& text) {
  std::string out;
  for (const char c : text) {
    const auto* row = std::ranges::find(kMarkdownTexts, c, &Replacement::first);
    out += row != std::end(kMarkdownTexts) ? row->second : std::string_view(&c, 1);
  }
  return out;
}

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
  std::string text = "% needs \\usepackage{booktabs}\n\\begin{table}\n  \\centering\n  \\caption{" +
                     TexText(table.caption) + "}\n  \\label{tab:" + table.name +
                     "}\n  \\begin{tabular}{" + columns + "}\n    \\toprule\n" +
                     line([&](size_t k) { return table.columns[k].title; }) + "    \\midrule\n";
  for (const auto& row : table.rows) text += line([&](size_t k) { return CellOf(row, k); });
  return text + "    \\bottomrule\n  \\end{tabular}\n\\end{table}\n";
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
