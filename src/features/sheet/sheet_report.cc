#include <fmt/format.h>
#include <algorithm>
#include <cmath>
#include <sstream>

#include "base/json_text.h"
#include "base/text.h"
#include "features/sheet/sheet.h"
#include "plot/draw.h"
#include "plot/layout.h"
#include "report/document.h"
#include "report/page.h"

namespace mbv {
namespace {

constexpr const char* kTitle = "Credibility sheet";
constexpr const char* kAbout =
    "Filled from what was run, and from nothing else. Levels are what this evidence supports at "
    "most: a level counts from 0 as far as its evidence passed. Whether it suffices for a decision "
    "is another question.";
constexpr const char* kSources =
    "NASA-STD-7009 (2008), credibility assessment scale; ASME V&V 10-2019; ASME V&V 20-2009.";

Mark MarkOf(SheetStatus status) {
  switch (status) {
    case SheetStatus::kDone:
      return Mark::kOk;
    case SheetStatus::kFailed:
      return Mark::kFail;
    case SheetStatus::kStale:
      return Mark::kWarn;
    case SheetStatus::kNotDone:
    case SheetStatus::kNotApplicable:
    case SheetStatus::kStated:
      return Mark::kOff;
  }
  return Mark::kNone;
}
std::string LevelText(const SheetFactor& factor) {
  return factor.level < 0 ? "–" : fmt::format("{} of 4", factor.level);
}
// What is done to get it, where something is missing.
std::string CommandText(const SheetRow& row) {
  if (row.status != SheetStatus::kNotDone && row.status != SheetStatus::kStale) return "";
  std::string text;
  for (const SheetCommand& command : row.commands) {
    text += (text.empty() ? "" : " && ") + ToText(command);
  }
  return text;
}

Table FactorTable(const Sheet& sheet) {
  Table table{.name = "factors",
              .columns = {Text("factor"), Text("level"), Wide("the evidence shows"),
                          Spare(Wide("the next level asks for"))}};
  for (const SheetFactor& factor : sheet.factors) {
    table.rows.push_back({factor.name, LevelText(factor), factor.meaning, factor.next});
  }
  return table;
}
Table EvidenceTable(const Sheet& sheet) {
  Table table{.name = "evidence",
              .columns = {Wide("matter"), Text("status"), Wide("result"),
                          Wide("from, or the command that does it")}};
  for (const SheetRow& row : sheet.rows) {
    const std::string command = CommandText(row);
    table.rows.push_back({row.title + " (" + row.standard + ")",
                          Cell(ToText(row.status), MarkOf(row.status)), row.result,
                          Code(command.empty() ? row.evidence : command)});
  }
  return table;
}

std::string VersionText(const Sheet& sheet) {
  std::vector<std::string> names;
  for (const auto& [name, version] : sheet.versions) names.push_back(name + " " + version);
  return Joined(names);
}

// Paper of A4, filled from top to bottom.
class Paper {
 public:
  static constexpr double kWidth = 595.0, kHeight = 842.0, kMargin = 42.0;

  Paper(const Canvas& canvas, double font_pt) : canvas_(canvas), row_(1.35 * font_pt) {}

  void Line(const std::string& text, double scale = 1.0) {
    for (const std::string& line : Broken(text, kWidth - 2 * kMargin, scale)) {
      Room(row_ * scale);
      canvas_.Text(AsPlainText(line), {.x = kMargin, .y = y_}, scale);
      y_ += row_ * scale;
    }
  }
  void Gap(double rows) { y_ += rows * row_; }

  // Columns as wide as their texts, as far as there is room; the widest share the rest.
  void Add(const Table& table) {
    const std::vector<double> widths = Widths(table);
    std::vector<Cell> head;
    for (const Column& column : table.columns) head.emplace_back(column.title);
    Row(head, widths);
    Rule();
    for (const std::vector<Cell>& row : table.rows) Row(row, widths);
    Rule();
  }

 private:
  static constexpr double kGap = 12.0, kStatus = 3.0;

  void Room(double height) {
    if (y_ + height <= kHeight - kMargin) return;
    canvas_.NextPage();
    y_ = kMargin;
  }
  void Rule() {
    canvas_.Line({{kMargin, y_}, {kWidth - kMargin, y_}}, "#000000", 0.5);
    y_ += 0.3 * row_;
  }

  [[nodiscard]] double WidthOf(const std::string& text, double scale = 1.0) const {
    return canvas_.Measure(AsPlainText(text), scale).width;
  }

  // At blanks; a word that is wider than a line, wherever it is full.
  [[nodiscard]] std::vector<std::string> Broken(const std::string& text, double width,
                                                double scale = 1.0) const {
    std::vector<std::string> lines(1);
    std::istringstream words(text);
    for (std::string word; words >> word;) {
      const std::string longer = lines.back().empty() ? word : lines.back() + " " + word;
      if (WidthOf(longer, scale) <= width) {
        lines.back() = longer;
        continue;
      }
      if (!lines.back().empty()) lines.emplace_back();
      while (WidthOf(word, scale) > width) {
        size_t fits = word.size();
        while (fits > 1 && WidthOf(word.substr(0, fits), scale) > width) {
          do --fits;
          while (fits > 1 && (static_cast<unsigned char>(word[fits]) & 0xC0U) == 0x80U);
        }
        lines.back() = word.substr(0, fits);
        word = word.substr(fits);
        lines.emplace_back();
      }
      lines.back() = word;
    }
    return lines;
  }

  [[nodiscard]] std::vector<double> Widths(const Table& table) const {
    const size_t n = table.columns.size();
    std::vector<double> wanted(n);
    for (size_t c = 0; c < n; ++c) {
      wanted[c] = WidthOf(table.columns[c].title);
      for (const std::vector<Cell>& row : table.rows) {
        if (c < row.size()) wanted[c] = std::max(wanted[c], WidthOf(row[c].text));
      }
      wanted[c] += kGap;
    }
    std::vector<double> widths(n, 0.0);
    double room = kWidth - 2 * kMargin;
    size_t open = n;
    for (bool changed = true; changed && open > 0;) {
      changed = false;
      for (size_t c = 0; c < n; ++c) {
        if (widths[c] > 0.0 || wanted[c] > room / static_cast<double>(open)) continue;
        widths[c] = wanted[c], room -= wanted[c], --open;
        changed = true;
      }
    }
    double sum = 0.0;
    for (size_t c = 0; c < n; ++c) sum += widths[c] > 0.0 ? 0.0 : std::sqrt(wanted[c]);
    for (size_t c = 0; c < n; ++c) {
      if (widths[c] == 0.0) widths[c] = room * std::sqrt(wanted[c]) / sum;
    }
    return widths;
  }

  void Row(const std::vector<Cell>& cells, const std::vector<double>& widths) {
    std::vector<std::vector<std::string>> texts;
    size_t lines = 1;
    for (size_t c = 0; c < cells.size(); ++c) {
      texts.push_back(Broken(cells[c].text, widths[c] - kGap));
      lines = std::max(lines, texts.back().size());
    }
    Room(static_cast<double>(lines) * row_ + 0.4 * row_);
    double x = kMargin;
    for (size_t c = 0; c < cells.size(); ++c) {
      if (cells[c].mark != Mark::kNone) {
        canvas_.Cells(x - kStatus - 3.0, y_ + 0.1 * row_, kStatus, 0.8 * row_, 1,
                      {ColorOf(cells[c].mark)});
      }
      for (size_t k = 0; k < texts[c].size(); ++k) {
        canvas_.Text(AsPlainText(texts[c][k]), {.x = x, .y = y_ + static_cast<double>(k) * row_});
      }
      x += widths[c];
    }
    y_ += static_cast<double>(lines) * row_ + 0.4 * row_;
  }

  static Rgb ColorOf(Mark mark) {
    switch (mark) {
      case Mark::kOk:
        return {46, 125, 50};
      case Mark::kFail:
        return {198, 40, 40};
      case Mark::kWarn:
        return {249, 168, 37};
      case Mark::kOff:
      case Mark::kNone:
        break;
    }
    return {176, 176, 176};
  }

  const Canvas& canvas_;
  const double row_;
  double y_ = kMargin;
};

}  // namespace

std::string ToText(const Sheet& sheet, const TextStyle& style) {
  const auto painted = [&](SheetStatus status) {
    const Paint paint = status == SheetStatus::kDone     ? Paint::kGood
                        : status == SheetStatus::kFailed ? Paint::kBad
                        : status == SheetStatus::kStale  ? Paint::kWarning
                                                         : Paint::kFaint;
    return Painted(fmt::format("{:<14}", ToText(status)), paint, style.color);
  };
  std::string text = fmt::format("{} / {}: credibility\n\n{}\n", sheet.mechanism, sheet.scenario,
                                 ToText(FactorTable(sheet), style));
  for (const SheetRow& row : sheet.rows) {
    text += fmt::format("  {}  {}\n", painted(row.status), row.title);
    if (!row.result.empty()) text += fmt::format("                  {}\n", row.result);
    const std::string command = CommandText(row);
    if (!command.empty()) text += fmt::format("                  {}\n", command);
  }
  return text;
}

std::string SheetPage(const Sheet& sheet) {
  Page page;
  ReportSection levels{.title = "Levels of credibility", .link = "Levels"};
  levels.Add(Paragraph{kAbout});
  levels.Add(FactorTable(sheet));
  levels.Note(kSources);
  page.Add(levels);
  ReportSection evidence{.title = "Evidence", .link = "Evidence"};
  evidence.Add(EvidenceTable(sheet));
  page.Add(evidence);
  const size_t failed = sheet.Count(SheetStatus::kFailed), done = sheet.Count(SheetStatus::kDone);
  PageHead head{.kicker = "mbverify credibility sheet",
                .title = sheet.mechanism + " / " + sheet.scenario,
                .lead = sheet.description,
                .judges = false,
                .footer = VersionText(sheet)};
  if (failed > 0) {
    head.judges = true;
    head.verdict = Verdict::kDisagree;
    head.word = fmt::format("{} failed, {} done", failed, done);
  }
  return page.Write(head);
}

std::string SheetPdf(const Sheet& sheet) {
  FigureStyle style = *FindFigureStyle("plain");
  style.font_pt = 7.5;
  const std::string title = fmt::format("{}: {} / {}", kTitle, sheet.mechanism, sheet.scenario);
  return DrawPicture(PictureFormat::kPdf, style, Paper::kWidth, Paper::kHeight, title,
                     [&](const Canvas& canvas) {
                       Paper paper(canvas, style.font_pt);
                       paper.Line(title, 1.8);
                       paper.Line(sheet.description);
                       paper.Line(sheet.scenario_file);
                       paper.Gap(0.6);
                       paper.Line(kAbout);
                       paper.Gap(0.6);
                       paper.Add(FactorTable(sheet));
                       paper.Gap(1.0);
                       paper.Add(EvidenceTable(sheet));
                       paper.Gap(0.6);
                       paper.Line(kSources);
                       paper.Line(VersionText(sheet));
                     });
}

nlohmann::ordered_json ToJson(const Sheet& sheet) {
  using Json = nlohmann::ordered_json;
  Json rows = Json::array(), factors = Json::array(), versions = Json::object();
  for (const SheetRow& row : sheet.rows) {
    Json commands = Json::array();
    for (const SheetCommand& command : row.commands) commands.push_back(ToText(command));
    rows.push_back({{"key", row.key},
                    {"title", row.title},
                    {"standard", row.standard},
                    {"status", ToText(row.status)},
                    {"result", row.result},
                    {"evidence", row.evidence},
                    {"commands", std::move(commands)},
                    {"values", row.values}});
  }
  for (const SheetFactor& factor : sheet.factors) {
    factors.push_back({{"factor", factor.name},
                       {"level", factor.level < 0 ? Json() : Json(factor.level)},
                       {"meaning", factor.meaning},
                       {"next", factor.next}});
  }
  for (const auto& [name, version] : sheet.versions) versions[name] = version;
  return {{"scenario", sheet.scenario},     {"scenario_file", sheet.scenario_file},
          {"mechanism", sheet.mechanism},   {"description", sheet.description},
          {"exit_code", sheet.exit_code()}, {"factors", std::move(factors)},
          {"rows", std::move(rows)},        {"versions", std::move(versions)}};
}

}  // namespace mbv
