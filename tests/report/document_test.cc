#include "report/document.h"

#include <gtest/gtest.h>

namespace mbv {
namespace {

Table TwoRows() {
  Table table;
  table.name = "bars";
  table.caption = "Masses of a & b, 5 % apart";
  table.columns = {Text("body_1"), Digits("m (kg)")};
  table.rows = {{"a|b", "1.50"}, {"γ²", "−2"}};
  return table;
}

TEST(Table, LatexIsABooktabsTable) {
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

TEST(Table, MoreLinesThanAPageAreALongtableThatRepeatsItsHead) {
  Table table = TwoRows();
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

TEST(Table, BrokenTextsCountTheirLines) {
  Table table = TwoRows();
  table.columns[0].wide = true;
  table.rows.assign(20, {std::string(68, 'a'), "1"});
  EXPECT_EQ(ToLatex(table).find("longtable"), std::string::npos);
  table.rows[3][0].text += "a";
  EXPECT_NE(ToLatex(table).find("longtable"), std::string::npos);
}

TEST(Table, MarkdownIsATableUnderItsCaption) {
  EXPECT_EQ(ToMarkdown(TwoRows()), R"(Masses of a &amp; b, 5 % apart

| body_1 | m (kg) |
|---|---:|
| a\|b | 1.50 |
| γ² | −2 |
)");
}

TEST(Table, APerturbedCellIsShown) {
  Table table = TwoRows();
  table.rows[0][1] = "1.51";
  EXPECT_NE(ToLatex(table), ToLatex(TwoRows()));
  EXPECT_NE(ToMarkdown(table), ToMarkdown(TwoRows()));
}

TEST(Table, ShortRowsAreFilledUpAndAnEmptyTableIsWhole) {
  Table table = TwoRows();
  table.rows = {{"a"}};
  EXPECT_NE(ToLatex(table).find("    a &  \\\\\n"), std::string::npos);
  EXPECT_NE(ToMarkdown(table).find("| a |  |\n"), std::string::npos);
  table.rows.clear();
  EXPECT_NE(ToLatex(table).find("\\midrule\n    \\bottomrule"), std::string::npos);
}

// Cells, columns and blocks that only one of the writers shows, marks and remarks.
Table Marked() {
  Table table{.caption = "Checks <1>",
              .columns = {Text("check"), Digits("value"), Text("end"), Text("why", On::kPage),
                          Text("short", On::kTerminal)}};
  table.rows.push_back(
      {"gap", "1.5e-03", Cell("FAIL", Mark::kFail, "floored"), "long & true", "t"});
  table.rows.push_back({Code("a_b"), "2"});
  return table;
}

TEST(Table, ATerminalHasColumnsAsWideAsTheirWidestCell) {
  EXPECT_EQ(ToText(Marked()),
            "  check    value  end             short\n"
            "  gap    1.5e-03  FAIL (floored)  t\n"
            "  a_b          2\n");
  const std::vector<std::string> painted = TextLines(Marked(), {.indent = "", .color = true});
  ASSERT_EQ(painted.size(), 3U);
  EXPECT_EQ(painted[1], "gap    1.5e-03  \x1b[1;31mFAIL (floored)\x1b[0m  t");
}

TEST(Table, WidthsCountLettersAndARowIsOneLine) {
  Table table{.columns = {Text("µ"), Digits("°")}};
  table.rows = {{"a\nb", "–"}, {"…", "10"}};
  EXPECT_EQ(ToText(table, {.indent = ""}), "µ     °\na b   –\n…    10\n");
}

TEST(Table, APageHasPillsForMarksAndRemarks) {
  const std::string html = ToHtml(Marked());
  EXPECT_NE(html.find("<span class=\"pill fail\">FAIL</span> <span class=\"pill "
                      "warn\">floored</span>"),
            std::string::npos)
      << html;
  EXPECT_NE(html.find("<th scope=\"col\" class=\"n\">value</th>"), std::string::npos) << html;
  EXPECT_NE(html.find("<td class=\"n\">1.5e-03</td>"), std::string::npos) << html;
  EXPECT_NE(html.find("<th scope=\"row\"><code>a_b</code></th>"), std::string::npos) << html;
  EXPECT_NE(html.find("long &amp; true"), std::string::npos) << html;
  EXPECT_NE(html.find("Checks &lt;1&gt;"), std::string::npos) << html;
  EXPECT_EQ(html.find("short"), std::string::npos) << html;
}

TEST(Table, FilesShowWhatAPageDoes) {
  const std::string text = ToMarkdown(Marked());
  EXPECT_NE(text.find("| check | value | end | why |"), std::string::npos) << text;
  EXPECT_NE(text.find("| `a_b` | 2 |  |  |"), std::string::npos) << text;
}

TEST(Section, HasAWriterForPageAndTerminal) {
  ReportSection section{.title = "T", .link = "T"};
  section.Add(Paragraph{"said <so>", Paragraph::Look::kReason});
  section.Add(Items{{"one", "two"}});
  section.Add(Verbatim{"run it\nagain\n"});
  section.Add(Fold{"more", {{Paragraph{"inside"}}, {Paragraph{"page"}, On::kPage}}});
  section.Add(Drawing{"<svg></svg>"});
  section.Add(Marked());
  section.Note("faint");
  EXPECT_EQ(ToText(section),
            "\n  said <so>\n  one\n  two\n    run it\n    again\n  inside\n\n  Checks <1>\n" +
                ToText(Marked()));
  const std::string html = ToHtml(section);
  EXPECT_TRUE(html.starts_with("<p class=\"reason\">said &lt;so&gt;</p>\n<ul>\n<li>one</li>"))
      << html;
  EXPECT_NE(html.find("<code>run it\nagain\n</code>"), std::string::npos) << html;
  EXPECT_NE(html.find("<summary>more</summary><p>inside</p>\n<p>page</p>"), std::string::npos)
      << html;
  EXPECT_NE(html.find("<figure><svg></svg></figure>"), std::string::npos) << html;
  EXPECT_TRUE(html.ends_with("<p class=\"faint\">faint</p>\n")) << html;
}

TEST(Section, EmptyBlocksAreLeftOut) {
  ReportSection section;
  section.Add(Paragraph{});
  section.Add(Items{});
  section.Add(Table{.caption = "none"});
  section.Add(Fold{"none", {}});
  EXPECT_TRUE(section.blocks.empty());
  EXPECT_EQ(ToHtml(section), "");
}

}  // namespace
}  // namespace mbv
