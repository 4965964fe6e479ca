#include "report/paper_table.h"

#include <gtest/gtest.h>

namespace mbv {
namespace {

PaperTable TwoRows() {
  PaperTable table;
  table.name = "bars";
  table.caption = "Masses of a & b, 5 % apart";
  table.columns = {{"body_1"}, {"m (kg)", true}};
  table.rows = {{"a|b", "1.50"}, {"γ²", "−2"}};
  return table;
}

TEST(PaperTable, LatexIsABooktabsTable) {
  EXPECT_EQ(ToLatex(TwoRows()), R"(% needs \usepackage{booktabs}
\begin{table}
  \centering
  \caption{Masses of a \& b, 5 \% apart}
  \label{tab:bars}
  \begin{tabular}{lr}
    \toprule
    body\_1 & m (kg) \\
    \midrule
    a\ensuremath{|}b & 1.50 \\
    \ensuremath{\gamma}\ensuremath{^{2}} & \ensuremath{-}2 \\
    \bottomrule
  \end{tabular}
\end{table}
)");
}

TEST(PaperTable, MarkdownIsATableUnderItsCaption) {
  EXPECT_EQ(ToMarkdown(TwoRows()), R"(Masses of a &amp; b, 5 % apart

| body\_1 | m (kg) |
|---|---:|
| a\|b | 1.50 |
| γ² | −2 |
)");
}

TEST(PaperTable, ABentCellIsShown) {
  PaperTable table = TwoRows();
  table.rows[0][1] = "1.51";
  EXPECT_NE(ToLatex(table), ToLatex(TwoRows()));
  EXPECT_NE(ToMarkdown(table), ToMarkdown(TwoRows()));
}

TEST(PaperTable, ShortRowsAreFilledUpAndAnEmptyTableIsWhole) {
  PaperTable table = TwoRows();
  table.rows = {{"a"}};
  EXPECT_NE(ToLatex(table).find("    a &  \\\\\n"), std::string::npos);
  EXPECT_NE(ToMarkdown(table).find("| a |  |\n"), std::string::npos);
  table.rows.clear();
  EXPECT_NE(ToLatex(table).find("\\midrule\n    \\bottomrule"), std::string::npos);
}

}  // namespace
}  // namespace mbv
