#include "report/document.h"

#include <fmt/format.h>
#include <algorithm>
#include <string_view>

#include "base/demand.h"
#include "base/files.h"
#include "base/markup.h"
#include "base/text.h"
#include "report/page.h"

namespace mbv {
namespace {

// What a cell says where nothing is coloured.
std::string PlainText(const Cell& cell) {
  return cell.text + (cell.remark.empty() ? "" : " (" + cell.remark + ")");
}

const Cell& CellOf(const std::vector<Cell>& row, size_t column) {
  static const Cell none("");
  return column < row.size() ? row[column] : none;
}

// The columns that are shown there.
std::vector<size_t> ColumnsOf(const Table& table, On on) {
  std::vector<size_t> columns;
  for (size_t k = 0; k < table.columns.size(); ++k) {
    if (table.columns[k].on == On::kAll || table.columns[k].on == on) columns.push_back(k);
  }
  return columns;
}

Paint PaintOf(Mark mark) {
  static constexpr Paint kPaints[] = {Paint::kPlain, Paint::kGood, Paint::kWarning, Paint::kBad,
                                      Paint::kFaint};
  return kPaints[static_cast<size_t>(mark)];
}

// A row stays one line, whatever its cells hold.
std::string OnOneLine(std::string text) {
  std::ranges::replace_if(
      text, [](char c) { return c == '\n' || c == '\r' || c == '\t'; }, ' ');
  return text;
}

}  // namespace

std::vector<std::string> Texts(const std::vector<Cell>& row) {
  std::vector<std::string> texts;
  texts.reserve(row.size());
  for (const Cell& cell : row) texts.push_back(cell.text);
  return texts;
}

std::string Painted(const std::string& text, Paint paint, bool color) {
  if (!color || paint == Paint::kPlain || text.empty()) return text;
  static constexpr const char* kCodes[] = {"0", "1;32", "1;31", "1;33", "1", "2"};
  return fmt::format("\x1b[{}m{}\x1b[0m", kCodes[static_cast<int>(paint)], text);
}

namespace {

constexpr const char* kBetween = "  ";

size_t WidthOf(const Table& table, size_t column) {
  size_t width = PrintedWidth(OnOneLine(table.columns[column].title));
  for (const auto& row : table.rows) {
    width = std::max(width, PrintedWidth(OnOneLine(PlainText(CellOf(row, column)))));
  }
  return width;
}

// Without spare columns, from the right, as long as the rest is too wide.
std::vector<size_t> FittingColumns(const Table& table, const TextStyle& style) {
  std::vector<size_t> shown = ColumnsOf(table, On::kTerminal);
  const auto total = [&] {
    size_t width = style.indent.size();
    for (const size_t k : shown) width += WidthOf(table, k) + (k == shown.front() ? 0 : 2);
    return width;
  };
  while (style.columns > 0 && total() > style.columns) {
    const auto spare = std::find_if(shown.rbegin(), shown.rend(),
                                    [&](size_t k) { return table.columns[k].spare; });
    if (spare == shown.rend()) break;
    shown.erase(std::next(spare).base());
  }
  return shown;
}

}  // namespace

std::vector<std::string> TextLines(const Table& table, const TextStyle& style) {
  const std::vector<size_t> shown = FittingColumns(table, style);
  std::vector<std::string> lines(1 + table.rows.size(), style.indent);
  for (size_t c = 0; c < shown.size(); ++c) {
    const Column& column = table.columns[shown[c]];
    std::vector<std::string> texts = {OnOneLine(column.title)};
    for (const auto& row : table.rows) texts.push_back(OnOneLine(PlainText(CellOf(row, shown[c]))));
    const size_t width = WidthOf(table, shown[c]);
    for (size_t i = 0; i < lines.size(); ++i) {
      const std::string blanks(width - PrintedWidth(texts[i]), ' ');
      const Paint paint =
          i == 0 ? Paint::kFaint : PaintOf(CellOf(table.rows[i - 1], shown[c]).mark);
      const std::string painted = Painted(texts[i], paint, style.color);
      lines[i] += (c == 0 ? "" : kBetween) + (column.number ? blanks + painted : painted + blanks);
    }
  }
  for (std::string& line : lines) line.erase(line.find_last_not_of(' ') + 1);
  return lines;
}

std::string ToText(const Table& table, const TextStyle& style) {
  std::string text;
  for (const std::string& line : TextLines(table, style)) text += line + "\n";
  return text;
}

namespace {

const char* PillOf(Mark mark) {
  static constexpr const char* kKinds[] = {"", "ok", "warn", "fail", "off"};
  return kKinds[static_cast<size_t>(mark)];
}

std::string CellHtml(const Cell& cell, bool number, const char* tag, const char* scope) {
  std::string html = std::string("<") + tag + scope + (number ? " class=\"n\"" : "") + ">";
  if (!cell.html.empty()) {
    html += cell.html;
  } else if (cell.mark != Mark::kNone) {
    html += Pill(PillOf(cell.mark), cell.text);
  } else {
    html += cell.code ? "<code>" + Escape(cell.text) + "</code>" : Escape(cell.text);
  }
  if (!cell.remark.empty()) html += " " + Pill("warn", cell.remark);
  return html + "</" + tag + ">";
}

}  // namespace

std::string ToHtml(const Table& table) {
  const std::vector<size_t> shown = ColumnsOf(table, On::kPage);
  std::string html = "<div class=\"scroll\" tabindex=\"0\" role=\"region\" aria-label=\"" +
                     Escape(table.caption) + "\"><table><caption>" + Escape(table.caption) +
                     "</caption><thead><tr>";
  for (const size_t k : shown) {
    const Column& column = table.columns[k];
    // An empty heading names nothing.
    html += column.title.empty() ? "<td></td>"
                                 : CellHtml(column.title, column.number, "th", " scope=\"col\"");
  }
  html += "</tr></thead><tbody>\n";
  for (const std::vector<Cell>& row : table.rows) {
    MBV_DEMAND(row.size() <= table.columns.size(), row.size());
    html += "<tr>";
    for (size_t i = 0; i < shown.size(); ++i) {
      const bool number = table.columns[shown[i]].number;
      html += CellHtml(CellOf(row, shown[i]), number, i == 0 ? "th" : "td",
                       i == 0 ? " scope=\"row\"" : "");
    }
    html += "</tr>\n";
  }
  return html + "</tbody></table></div>\n";
}

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

// Of a page at 10 pt, and of a column 0.42 lines wide.
constexpr size_t kPageLines = 40, kWideLetters = 34;

// Lines that LaTeX needs for the rows, where texts of several lines are broken.
size_t LinesOf(const Table& table) {
  size_t lines = 0;
  for (const auto& row : table.rows) {
    size_t own = 1;
    for (size_t k = 0; k < table.columns.size(); ++k) {
      if (!table.columns[k].wide) continue;
      own = std::max(own, (PlainText(CellOf(row, k)).size() + kWideLetters - 1) / kWideLetters);
    }
    lines += own;
  }
  return lines;
}

// Head and foot of a table on one page, or over several: then the head stands on each.
struct LatexFrame {
  std::string head, foot;
};

LatexFrame OnOnePage(const Table& table, const std::string& columns, const std::string& titles) {
  return {"% needs \\usepackage{booktabs}\n\\begin{table}\n  \\centering\n  \\caption{" +
              TexText(table.caption) + "}\n  \\label{" + Label(table.name) +
              "}\n  \\begin{tabular}{" + columns + "}\n    \\toprule\n" + titles +
              "    \\midrule\n",
          "    \\bottomrule\n  \\end{tabular}\n\\end{table}\n"};
}

LatexFrame OverPages(const Table& table, const std::string& columns, const std::string& titles) {
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

std::string ToLatex(const Table& table) {
  const std::vector<size_t> shown = ColumnsOf(table, On::kPage);
  std::string columns;
  for (const size_t k : shown) {
    const Column& column = table.columns[k];
    columns += column.number ? "r" : column.wide ? "p{0.42\\linewidth}" : "l";
  }
  const auto line = [&](const auto& cell) {
    std::string text = "    ";
    for (const size_t k : shown) text += (k != shown[0] ? " & " : "") + TexText(cell(k));
    return text + " \\\\\n";
  };
  const std::string titles = line([&](size_t k) { return table.columns[k].title; });
  const LatexFrame frame = LinesOf(table) > kPageLines ? OverPages(table, columns, titles)
                                                       : OnOnePage(table, columns, titles);
  std::string text = frame.head;
  for (const auto& row : table.rows) {
    text += line([&](size_t k) { return PlainText(CellOf(row, k)); });
  }
  return text + frame.foot;
}

std::string ToMarkdown(const Table& table) {
  const std::vector<size_t> shown = ColumnsOf(table, On::kPage);
  std::string text = table.caption.empty() ? "" : MarkdownText(table.caption) + "\n\n";
  text += "|";
  for (const size_t k : shown) text += " " + MarkdownText(table.columns[k].title) + " |";
  text += "\n|";
  for (const size_t k : shown) text += table.columns[k].number ? "---:|" : "---|";
  text += "\n";
  for (const auto& row : table.rows) {
    text += "|";
    for (const size_t k : shown) {
      const Cell& cell = CellOf(row, k);
      text += " " + (cell.code ? MarkdownCode(cell.text) : MarkdownText(PlainText(cell))) + " |";
    }
    text += "\n";
  }
  return text;
}

void ReportSection::Add(std::variant<Paragraph, Items, Verbatim, Table, Drawing, Fold> what,
                        On on) {
  const bool empty = std::visit(
      [](const auto& block) {
        using T = std::decay_t<decltype(block)>;
        if constexpr (std::is_same_v<T, Items>)
          return block.texts.empty();
        else if constexpr (std::is_same_v<T, Table>)
          return block.rows.empty();
        else if constexpr (std::is_same_v<T, Drawing>)
          return block.svg.empty();
        else if constexpr (std::is_same_v<T, Fold>)
          return block.blocks.empty();
        else
          return block.text.empty();
      },
      what);
  if (!empty) blocks.push_back({std::move(what), on});
}

namespace {

std::string BlocksHtml(const std::vector<Block>& blocks);

struct HtmlWriter {
  std::string operator()(const Paragraph& paragraph) const {
    static constexpr const char* kClasses[] = {"", " class=\"reason\"",
                                               " class=\"attribution odd\"", " class=\"faint\""};
    return fmt::format("<p{}>{}</p>\n", kClasses[static_cast<size_t>(paragraph.look)],
                       Escape(paragraph.text));
  }
  std::string operator()(const Items& items) const {
    std::string html;
    for (const std::string& text : items.texts) html += "<li>" + Escape(text) + "</li>\n";
    return "<ul>\n" + html + "</ul>\n";
  }
  std::string operator()(const Verbatim& lines) const {
    return "<pre tabindex=\"0\"><code>" + Escape(lines.text) + "</code></pre>\n";
  }
  std::string operator()(const Table& table) const { return ToHtml(table); }
  std::string operator()(const Drawing& picture) const { return FigureHtml(picture.svg); }
  std::string operator()(const Fold& fold) const {
    return Folded(fold.title, BlocksHtml(fold.blocks));
  }
};

std::string BlocksHtml(const std::vector<Block>& blocks) {
  std::string html;
  const auto drawn = [&](size_t k) {
    return k < blocks.size() && std::holds_alternative<Drawing>(blocks[k].what);
  };
  for (size_t k = 0; k < blocks.size(); ++k) {
    if (blocks[k].on == On::kTerminal) continue;
    // Several drawings stand side by side where there is room.
    const bool opens = drawn(k) && !(k > 0 && drawn(k - 1)) && drawn(k + 1);
    const bool closes = drawn(k) && !drawn(k + 1) && k > 0 && drawn(k - 1);
    html += (opens ? "<div class=\"static-plots\">\n" : "") +
            std::visit(HtmlWriter{}, blocks[k].what) + (closes ? "</div>\n" : "");
  }
  return html;
}

std::string BlocksText(const std::vector<Block>& blocks, const TextStyle& style);

struct TerminalWriter {
  const TextStyle& style;

  std::string operator()(const Paragraph& paragraph) const {
    const Paint paint = paragraph.look == Paragraph::Look::kNote ? Paint::kFaint : Paint::kPlain;
    return style.indent + Painted(paragraph.text, paint, style.color) + "\n";
  }
  std::string operator()(const Items& items) const {
    std::string text;
    for (const std::string& item : items.texts) text += style.indent + item + "\n";
    return text;
  }
  std::string operator()(const Verbatim& lines) const {
    std::string text;
    for (size_t from = 0; from < lines.text.size();) {
      const size_t end = std::min(lines.text.find('\n', from), lines.text.size());
      text += style.indent + "  " + lines.text.substr(from, end - from) + "\n";
      from = end + 1;
    }
    return text;
  }
  std::string operator()(const Table& table) const {
    const std::string caption = table.caption.empty() ? "" : style.indent + table.caption + "\n";
    return "\n" + caption + ToText(table, style);
  }
  std::string operator()(const Drawing& /*picture*/) const { return ""; }
  std::string operator()(const Fold& fold) const { return BlocksText(fold.blocks, style); }
};

std::string BlocksText(const std::vector<Block>& blocks, const TextStyle& style) {
  std::string text;
  for (const Block& block : blocks) {
    if (block.on != On::kPage) text += std::visit(TerminalWriter{style}, block.what);
  }
  return text;
}

}  // namespace

std::string ToHtml(const ReportSection& section) { return BlocksHtml(section.blocks); }

std::string ToText(const ReportSection& section, const TextStyle& style) {
  const std::string text = BlocksText(section.blocks, style);
  return (text.empty() || text.starts_with('\n') ? "" : "\n") + text;
}

}  // namespace mbv
