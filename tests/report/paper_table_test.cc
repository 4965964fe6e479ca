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

TEST(PaperTable, MoreLinesThanAPageAreALongtableThatRepeatsItsHead) {
  PaperTable table = TwoRows();
  while (table.rows.size() < 40) table.rows.push_back({"b", "1"});
  EXPECT_EQ(ToLatex(table).find("longtable"), std::string::npos);
  table.rows.push_back({"last", "2"});
  const std::string text = ToLatex(table);
  EXPECT_EQ(text.substr(0, text.find("    a\\ensuremath")),
            R"(% needs \usepackage{booktabs,longtable}, and a page of one column
\begin{longtable}{lr}
    \caption{Masses of a \& b, 5 \% apart}
    \label{tab:bars} \\
    \toprule
    body\_1 & m (kg) \\
    \midrule
    \endfirsthead
    \multicolumn{2}{l}{Table \thetable, continued} \\
    \toprule
    body\_1 & m (kg) \\
    \midrule
    \endhead
    \midrule
    \endfoot
    \bottomrule
    \endlastfoot
)");
  EXPECT_TRUE(text.ends_with("    last & 2 \\\\\n\\end{longtable}\n")) << text;
}

TEST(PaperTable, BrokenTextsCountTheirLines) {
  PaperTable table = TwoRows();
  table.columns[0].wide = true;
  table.rows.assign(20, {std::string(68, 'a'), "1"});
  EXPECT_EQ(ToLatex(table).find("longtable"), std::string::npos);
  table.rows[3][0] += "a";
  EXPECT_NE(ToLatex(table).find("longtable"), std::string::npos);
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
