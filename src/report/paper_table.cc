#include "report/paper_table.h"

#include <array>
#include <string_view>
#include <utility>

namespace mbv {
namespace {

using Replacement = std::pair<std::string_view, std::string_view>;

constexpr Replacement kLatexTexts[] = {
    {"\\", "\\textbackslash{}"},
    {"{", "\\{"},
    {"}", "\\}"},
    {"$", "\\$"},
    {"&", "\\&"},
    {"#", "\\#"},
    {"%", "\\%"},
    {"_", "\\_"},
    {"~", "\\textasciitilde{}"},
    {"^", "\\textasciicircum{}"},
    {"<", "$<$"},
    {">", "$>$"},
    {"|", "$|$"},
    {"\"", "''"},
    {"−", "$-$"},
    {"±", "$\\pm$"},
    {"×", "$\\times$"},
    {"·", "$\\cdot$"},
    {"°", "$^{\\circ}$"},
    {"≤", "$\\leq$"},
    {"≥", "$\\geq$"},
    {"≠", "$\\neq$"},
    {"≈", "$\\approx$"},
    {"→", "$\\rightarrow$"},
    {"∞", "$\\infty$"},
    {"√", "$\\surd$"},
    {"′", "$'$"},
    {"²", "$^{2}$"},
    {"³", "$^{3}$"},
    {"⁻", "$^{-}$"},
    {"¹", "$^{1}$"},
    {"₀", "$_{0}$"},
    {"₁", "$_{1}$"},
    {"₂", "$_{2}$"},
    {"₃", "$_{3}$"},
    {"₄", "$_{4}$"},
    {"∘", "$\\circ$"},
    {"–", "--"},
    {"—", "---"},
    {"…", "\\ldots{}"},
    {"“", "``"},
    {"”", "''"},
    {"’", "'"},
    {"µ", "$\\mu$"},
    {"α", "$\\alpha$"},
    {"β", "$\\beta$"},
    {"γ", "$\\gamma$"},
    {"δ", "$\\delta$"},
    {"ε", "$\\varepsilon$"},
    {"θ", "$\\theta$"},
    {"κ", "$\\kappa$"},
    {"λ", "$\\lambda$"},
    {"μ", "$\\mu$"},
    {"ν", "$\\nu$"},
    {"π", "$\\pi$"},
    {"ρ", "$\\rho$"},
    {"σ", "$\\sigma$"},
    {"τ", "$\\tau$"},
    {"φ", "$\\varphi$"},
    {"ψ", "$\\psi$"},
    {"ω", "$\\omega$"},
    {"Δ", "$\\Delta$"},
    {"Σ", "$\\Sigma$"},
    {"Ω", "$\\Omega$"},
    {"é", "\\'e"},
    {"ä", "\\\"a"},
    {"ö", "\\\"o"},
    {"ü", "\\\"u"},
    {"ß", "\\ss{}"},
    {"\n", " "},
    {"\r", " "},
    {"\t", " "},
};
constexpr Replacement kMarkdownTexts[] = {
    {"\\", "\\\\"}, {"|", "\\|"}, {"*", "\\*"},  {"_", "\\_"},  {"`", "\\`"},
    {"[", "\\["},   {"]", "\\]"}, {"<", "&lt;"}, {">", "&gt;"}, {"&", "&amp;"},
    {"\n", " "},    {"\r", " "},  {"\t", " "},
};

template <size_t N>
std::string Replaced(std::string_view text, const Replacement (&table)[N]) {
  std::string out;
  while (!text.empty()) {
    const Replacement* found = nullptr;
    for (const Replacement& row : table) {
      if (found == nullptr && text.starts_with(row.first)) found = &row;
    }
    out += found != nullptr ? found->second : text.substr(0, 1);
    text.remove_prefix(found != nullptr ? found->first.size() : 1);
  }
  return out;
}

const std::string& CellOf(const std::vector<std::string>& row, size_t column) {
  static const std::string none;
  return column < row.size() ? row[column] : none;
}

}  // namespace

std::string LatexText(const std::string& text) { return Replaced(text, kLatexTexts); }

std::string MarkdownText(const std::string& text) { return Replaced(text, kMarkdownTexts); }

std::string ToLatex(const PaperTable& table) {
  std::string columns;
  for (const PaperTableColumn& column : table.columns) columns += column.number ? 'r' : 'l';
  const auto line = [&](const auto& cell) {
    std::string text = "    ";
    for (size_t k = 0; k < table.columns.size(); ++k) {
      text += (k > 0 ? " & " : "") + LatexText(cell(k));
    }
    return text + " \\\\\n";
  };
  std::string text = "% needs \\usepackage{booktabs}\n\\begin{table}\n  \\centering\n  \\caption{" +
                     LatexText(table.caption) + "}\n  \\label{tab:" + table.name +
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
