#include <fmt/format.h>
#include <algorithm>
#include <cmath>
#include <functional>
#include <map>
#include <set>

#include "base/files.h"
#include "base/json_text.h"
#include "base/text.h"
#include "features/benchmark/benchmark.h"
#include "plot/svg_plot.h"
#include "report/document.h"
#include "report/page.h"
#include "verify/version.h"

namespace mbv {
namespace {

// Of the finite values; NaN without any.
double MedianOf(std::vector<double> values) {
  std::erase_if(values, [](double value) { return !std::isfinite(value); });
  if (values.empty()) return kNan;
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::ranges::nth_element(values, middle);
  return *middle;
}

// What is ranked: one number of an engine on a case, against the reference.
struct Ranked {
  const char* key;
  const char* title;
  double EngineOnCase::*value;
};
constexpr Ranked kRanked[] = {{"motion", "motion", &EngineOnCase::motion},
                              {"force", "drive force", &EngineOnCase::force},
                              {"reaction", "reaction", &EngineOnCase::reaction},
                              {"closure_m", "loop gap [m]", &EngineOnCase::closure_m},
                              {"energy", "energy drift", &EngineOnCase::energy}};

const EngineOnCase* FindEngine(const BenchmarkResult& result, const std::string& engine) {
  const auto found = std::ranges::find(result.engines, engine, &EngineOnCase::engine);
  return found == result.engines.end() ? nullptr : &*found;
}

// Over all cases.
struct Rank {
  size_t cases = 0, met = 0, series = 0;
  std::map<std::string, std::vector<double>> values = {};  ///< by Ranked::key
  std::vector<double> cost = {};                           ///< processor time over the reference's
};

Rank RankOf(const Benchmark& benchmark, const std::string& engine) {
  Rank rank;
  for (const BenchmarkResult& result : benchmark.results) {
    const EngineOnCase* row = FindEngine(result, engine);
    if (row == nullptr || !row->ran()) continue;
    ++rank.cases;
    for (const SeriesError& error : row->series) {
      if (std::isnan(error.largest)) continue;
      ++rank.series;
      if (error.inside()) ++rank.met;
    }
    for (const Ranked& ranked : kRanked) rank.values[ranked.key].push_back(row->*ranked.value);
    const EngineOnCase* reference = FindEngine(result, "reference");
    if (reference != nullptr && reference->ran())
      rank.cost.push_back(row->cpu_s / reference->cpu_s);
  }
  return rank;
}

std::string PageOf(const std::string& name) { return "cases/" + name + ".html"; }

// A cell that leads to the page of its case.
Cell ToCase(Cell cell, const std::string& name) {
  const std::string text = Escape(cell.text);
  cell.html = fmt::format("<a href=\"{}\">{}</a>", Escape(PageOf(name)),
                          cell.code ? "<code>" + text + "</code>" : text);
  return cell;
}

Table RankingTable(const Benchmark& benchmark) {
  Table table{.name = "engines",
              .caption =
                  "Engines over all cases: medians of the errors against the generic "
                  "reference, and of the processor time by that of the reference",
              .columns = {Text("engine"), Digits("cases"), Digits("published values met")}};
  for (const Ranked& ranked : kRanked) table.columns.push_back(Digits(ranked.title));
  table.columns.push_back(Digits("cost"));
  for (const BenchmarkEngine& engine : benchmark.engines) {
    const Rank rank = RankOf(benchmark, engine.name);
    std::vector<Cell>& row = table.rows.emplace_back();
    row = {engine.name, fmt::format("{}", rank.cases),
           rank.series == 0 ? "–" : fmt::format("{} of {}", rank.met, rank.series)};
    for (const Ranked& ranked : kRanked) {
      const auto values = rank.values.find(ranked.key);
      row.emplace_back(
          values == rank.values.end() ? "–" : NumberOrDash(MedianOf(values->second), "{:.1e}"));
    }
    row.emplace_back(NumberOrDash(MedianOf(rank.cost), "{:.3g}"));
  }
  return table;
}

Mark MarkOf(const BenchmarkCase& benchmark, const BenchmarkResult& result) {
  if (!AsStated(benchmark, result)) return Mark::kFail;
  return result.verdict == CaseVerdict::kConfirmed        ? Mark::kOk
         : result.verdict == CaseVerdict::kNotExpressible ? Mark::kOff
                                                          : Mark::kWarn;
}

Table CaseTable(const Benchmark& benchmark) {
  Table table{
      .name = "cases",
      .caption = "Cases, and what the judging engines say of the published numbers",
      .columns = {Text("case"), Text("suite"), Digits("series"), Text("verdict"), Wide("why")}};
  for (size_t k = 0; k < benchmark.results.size(); ++k) {
    const BenchmarkResult& result = benchmark.results[k];
    table.rows.push_back({ToCase(Code(result.name), result.name), result.suite,
                          fmt::format("{}", benchmark.cases[k].published.size()),
                          Cell(ToText(result.verdict), MarkOf(benchmark.cases[k], result)),
                          result.reason});
  }
  return table;
}

// A row a case, a column an engine.
Table ErrorTable(const Benchmark& benchmark, const std::string& caption,
                 const std::function<std::string(const EngineOnCase&)>& cell) {
  Table table{.caption = caption, .columns = {Text("case")}};
  for (const BenchmarkEngine& engine : benchmark.engines) {
    table.columns.push_back(Digits(engine.name));
  }
  for (const BenchmarkResult& result : benchmark.results) {
    if (result.engines.empty()) continue;
    std::vector<Cell>& row = table.rows.emplace_back();
    row.push_back(ToCase(Code(result.name), result.name));
    for (const BenchmarkEngine& engine : benchmark.engines) {
      const EngineOnCase* found = FindEngine(result, engine.name);
      row.push_back(found == nullptr || !found->ran() ? Cell("–")
                                                      : ToCase(cell(*found), result.name));
    }
  }
  return table;
}

double WorstRatio(const EngineOnCase& engine) {
  double worst = kNan;
  for (const SeriesError& error : engine.series) {
    if (!(error.ratio <= worst) && !std::isnan(error.ratio)) worst = error.ratio;
  }
  return worst;
}

std::vector<Table> ErrorTables(const Benchmark& benchmark) {
  std::vector<Table> tables = {
      ErrorTable(benchmark, "Largest difference to published numbers, by their uncertainty",
                 [](const EngineOnCase& one) { return NumberOrDash(WorstRatio(one), "{:.2g}"); })};
  tables.back().name = "published";
  for (const Ranked& ranked : kRanked) {
    tables.push_back(ErrorTable(
        benchmark, std::string("Error against the reference: ") + ranked.title,
        [&](const EngineOnCase& one) { return NumberOrDash(one.*ranked.value, "{:.1e}"); }));
    tables.back().name = ranked.key;
  }
  tables.push_back(
      ErrorTable(benchmark, "Processor time of the computation [ms]",
                 [](const EngineOnCase& one) { return NumberOrDash(1e3 * one.cpu_s, "{:.3g}"); }));
  tables.back().name = "cost";
  return tables;
}

// Why engines give nothing: each reason once, with its cases.
Table ReasonTable(const Benchmark& benchmark) {
  Table table{.name = "reasons",
              .caption = "What engines cannot compute",
              .columns = {Text("engine"), Wide("reason"), Wide("cases")}};
  for (const BenchmarkEngine& engine : benchmark.engines) {
    std::map<std::string, std::vector<std::string>> reasons;
    for (const BenchmarkResult& result : benchmark.results) {
      const EngineOnCase* row = FindEngine(result, engine.name);
      if (row != nullptr && !row->ran()) reasons[OneLine(row->why)].push_back(result.name);
    }
    for (const auto& [reason, cases] : reasons) {
      table.rows.push_back({engine.name, reason, JoinedAndMore(cases, 6)});
    }
  }
  return table;
}

Table SourceTable(const Benchmark& benchmark) {
  Table table{.name = "sources",
              .caption = "Where the published numbers are from",
              .columns = {Text("case"), Wide("title"), Wide("source"), Text("licence"),
                          Wide("uncertainty")}};
  for (const BenchmarkCase& one : benchmark.cases) {
    std::set<std::string> reasons;
    for (const PublishedSeries& series : one.published) reasons.insert(series.uncertainty_why);
    const std::string item = one.source.item.empty() ? "" : ", " + one.source.item;
    table.rows.push_back({Code(one.name), one.title, one.source.work + item, one.source.licence,
                          Joined({reasons.begin(), reasons.end()})});
  }
  return table;
}

// Of one case: a row a series, a column an engine.
Table SeriesTable(const BenchmarkCase& one, const BenchmarkResult& result) {
  Table table{.caption = "Largest difference to the published values",
              .columns = {Text("signal"), Text("channel"), Digits("values"),
                          Digits("uncertainty at the end")}};
  for (const EngineOnCase& engine : result.engines) {
    if (engine.ran()) table.columns.push_back(Digits(engine.engine));
  }
  for (size_t s = 0; s < one.published.size(); ++s) {
    const PublishedSeries& series = one.published[s];
    std::vector<Cell>& row = table.rows.emplace_back();
    row = {Code(series.called), Code(series.channel), fmt::format("{}", series.values.size()),
           fmt::format("{:.2g}", series.uncertainty.back())};
    for (const EngineOnCase& engine : result.engines) {
      if (!engine.ran()) continue;
      const SeriesError& error = engine.series[s];
      row.emplace_back(NumberOrDash(error.largest, "{:.2e}"),
                       error.inside() ? Mark::kOk : Mark::kNone);
    }
  }
  return table;
}

Table EnginesOfCase(const BenchmarkResult& result) {
  Table table{.caption = "Engines, and their errors against the generic reference",
              .columns = {Text("engine"), Wide("program or reason")}};
  for (const Ranked& ranked : kRanked) table.columns.push_back(Digits(ranked.title));
  table.columns.push_back(Digits("processor time [ms]"));
  for (const EngineOnCase& engine : result.engines) {
    std::vector<Cell>& row = table.rows.emplace_back();
    row = {engine.engine, engine.ran() ? engine.program : OneLine(engine.why)};
    for (const Ranked& ranked : kRanked) {
      row.emplace_back(NumberOrDash(engine.*ranked.value, "{:.1e}"));
    }
    row.emplace_back(NumberOrDash(1e3 * engine.cpu_s, "{:.3g}"));
  }
  return table;
}

// Difference by uncertainty over time, an engine a line: the largest one of all series.
LinePlot SharesOverTime(const BenchmarkCase& one, const BenchmarkResult& result) {
  LinePlot plot{.title = "differences to published values over time",
                .x_label = "time [s]",
                .y_label = "difference by uncertainty",
                .log_y = true};
  for (const EngineOnCase& engine : result.engines) {
    std::map<double, double> largest;
    for (size_t s = 0; s < engine.computed.size(); ++s) {
      const PublishedSeries& series = one.published[s];
      for (size_t k = 0; k < series.values.size(); ++k) {
        const double share =
            std::abs(engine.computed[s][k] - series.values[k]) / series.uncertainty[k];
        if (std::isfinite(share))
          largest[series.time_s[k]] = std::max(largest[series.time_s[k]], share);
      }
    }
    if (largest.empty()) continue;
    plot.lines.push_back({.label = engine.engine, .markers = true});
    plot.lines.back().points.assign(largest.begin(), largest.end());
  }
  return plot;
}

// Error over processor time by that of the reference, an engine a line: medians over the cases at
// each multiple of their steps.
LinePlot WorkPrecision(const Benchmark& benchmark) {
  LinePlot plot{.title = "work and precision",
                .x_label = "processor time by that of the reference",
                .y_label = "error of drive forces, of a free motion of its motion",
                .log_x = true,
                .log_y = true};
  for (const BenchmarkEngine& engine : benchmark.engines) {
    PlotLine line{.label = engine.name, .markers = true};
    const auto add = [&](const std::vector<BenchmarkResult>& results) {
      std::vector<double> errors, costs;
      for (size_t k = 0; k < results.size(); ++k) {
        const EngineOnCase* row = FindEngine(results[k], engine.name);
        const EngineOnCase* reference = FindEngine(benchmark.results[k], "reference");
        if (row == nullptr || !row->ran() || reference == nullptr || !reference->ran()) continue;
        errors.push_back(std::isfinite(row->force) ? row->force : row->motion);
        costs.push_back(row->cpu_s / reference->cpu_s);
      }
      const double error = MedianOf(errors), cost = MedianOf(costs);
      if (std::isfinite(error) && std::isfinite(cost)) line.points.emplace_back(cost, error);
    };
    add(benchmark.results);
    for (const auto& [multiple, results] : benchmark.at_steps) add(results);
    std::ranges::sort(line.points);
    if (!line.points.empty()) plot.lines.push_back(std::move(line));
  }
  return plot;
}

std::string CountsText(const Benchmark& benchmark) {
  return fmt::format(
      "{} cases, {} published series: {} confirmed, {} contradicted, {} disagree, {} not run, {} "
      "not expressible",
      benchmark.cases.size(), benchmark.series(), benchmark.Count(CaseVerdict::kConfirmed),
      benchmark.Count(CaseVerdict::kContradicted), benchmark.Count(CaseVerdict::kDisagree),
      benchmark.Count(CaseVerdict::kNotRun), benchmark.Count(CaseVerdict::kNotExpressible));
}

// Versions, programs outside, and the machine.
std::string MadeBy(const Benchmark& benchmark) {
  std::vector<std::string> parts;
  for (const auto& [name, version] : Versions()) parts.push_back(name + " " + version);
  for (const BenchmarkResult& result : benchmark.results) {
    for (const EngineOnCase& engine : result.engines) {
      if (!engine.program.empty() && !Contains(parts, engine.program)) {
        parts.push_back(engine.program);
      }
    }
  }
  const std::string machine = ReadWholeFile("/proc/cpuinfo").value_or("");
  const std::string key = "model name\t: ";
  const size_t at = machine.find(key);
  std::string text = "Made by " + Joined(parts);
  if (at != std::string::npos) {
    const size_t from = at + key.size();
    text += fmt::format("; processor {}", machine.substr(from, machine.find('\n', at) - from));
  }
  return text + ".";
}

}  // namespace

std::string ToText(const Benchmark& benchmark, bool color, size_t columns) {
  const TextStyle style{.indent = "  ", .color = color, .columns = columns};
  return fmt::format("{}\n\n{}\n\n{}", CountsText(benchmark), ToText(CaseTable(benchmark), style),
                     ToText(RankingTable(benchmark), style));
}

std::string ErrorsCsv(const Benchmark& benchmark) {
  std::string text = "suite,case,verdict,engine,signal,largest_error,uncertainty,at_s";
  for (const Ranked& ranked : kRanked) text += fmt::format(",{}", ranked.key);
  text += ",why\n";
  for (size_t k = 0; k < benchmark.results.size(); ++k) {
    const BenchmarkResult& result = benchmark.results[k];
    const auto start = [&](const std::string& engine) {
      return fmt::format("{},{},{},{}", CsvCell(result.suite), CsvCell(result.name),
                         ToText(result.verdict), CsvCell(engine));
    };
    if (result.engines.empty()) text += start("") + ",,,,,,,,," + CsvCell(result.reason) + "\n";
    for (const EngineOnCase& engine : result.engines) {
      if (!engine.ran()) {
        text += start(engine.engine) + ",,,,,,,,," + CsvCell(OneLine(engine.why)) + "\n";
        continue;
      }
      for (size_t s = 0; s < engine.series.size(); ++s) {
        const PublishedSeries& series = benchmark.cases[k].published[s];
        text +=
            start(engine.engine) + fmt::format(",{},{:.6g},{:.6g},{:.6g}", CsvCell(series.called),
                                               engine.series[s].largest, series.uncertainty.back(),
                                               engine.series[s].time_s);
        for (const Ranked& ranked : kRanked) text += fmt::format(",{:.6g}", engine.*ranked.value);
        text += ",\n";
      }
    }
  }
  return text;
}

std::string CostCsv(const Benchmark& benchmark) {
  std::string text = "case,engine,step_multiple,cpu_s,motion,force\n";
  const auto add = [&](double multiple, const std::vector<BenchmarkResult>& results) {
    for (const BenchmarkResult& result : results) {
      for (const EngineOnCase& engine : result.engines) {
        if (!engine.ran()) continue;
        text += fmt::format("{},{},{:g},{:.6g},{:.6g},{:.6g}\n", CsvCell(result.name),
                            CsvCell(engine.engine), multiple, engine.cpu_s, engine.motion,
                            engine.force);
      }
    }
  };
  add(1.0, benchmark.results);
  for (const auto& [multiple, results] : benchmark.at_steps) add(multiple, results);
  return text;
}

std::string ToLatex(const Benchmark& benchmark) {
  std::string text = ToLatex(RankingTable(benchmark)) + "\n" + ToLatex(CaseTable(benchmark));
  for (const Table& table : ErrorTables(benchmark)) text += "\n" + ToLatex(table);
  return text;
}

std::string ToMarkdown(const Benchmark& benchmark) {
  std::string text = CountsText(benchmark) + ".\n\n" + MadeBy(benchmark) + "\n\n## Engines\n\n" +
                     ToMarkdown(RankingTable(benchmark)) + "\n## Cases\n\n" +
                     ToMarkdown(CaseTable(benchmark)) + "\n## Errors\n";
  for (const Table& table : ErrorTables(benchmark)) text += "\n" + ToMarkdown(table);
  return text + "\n## What engines cannot compute\n\n" + ToMarkdown(ReasonTable(benchmark)) +
         "\n## Sources\n\n" + ToMarkdown(SourceTable(benchmark));
}

std::string ToHtml(const Benchmark& benchmark) {
  Page page;
  page.Add("Engines", "Engines", ToHtml(RankingTable(benchmark)) + Note(MadeBy(benchmark)));
  page.Add("Cases", "Cases", ToHtml(CaseTable(benchmark)));
  ReportSection errors{.title = "Errors", .link = "Errors"};
  for (const Table& table : ErrorTables(benchmark)) errors.Add(table);
  page.Add(errors);
  if (!benchmark.at_steps.empty()) {
    ReportSection work{.title = "Work and precision", .link = "Work"};
    work.Add(Drawing{ToSvg(WorkPrecision(benchmark))});
    work.Note("Medians over the cases, at multiples of each scenario's step.");
    page.Add(work);
  }
  page.Add("What engines cannot compute", "Reasons", ToHtml(ReasonTable(benchmark)));
  page.Add("Sources", "Sources", ToHtml(SourceTable(benchmark)));
  return page.Write({.kicker = "mbverify benchmark",
                     .title = "Closed-loop dynamics benchmark",
                     .lead = CountsText(benchmark),
                     .judges = false});
}

std::string CasePage(const Benchmark& benchmark, size_t index) {
  const BenchmarkCase& one = benchmark.cases[index];
  const BenchmarkResult& result = benchmark.results[index];
  ReportSection source{.title = "Source", .link = "Source"};
  source.Add(
      Items{{one.source.work, one.source.item, "licence: " + one.source.licence, one.source.url,
             one.source.sha256.empty() ? "" : "sha256 " + one.source.sha256}});
  ReportSection run{.title = "Run", .link = "Run"};
  run.Add(Verbatim{"mbverify benchmark " + one.file});
  run.Note(Sentence(result.settings));
  if (!result.engines.empty()) run.Add(EnginesOfCase(result));
  ReportSection published{.title = "Published values", .link = "Published"};
  if (!result.engines.empty()) {
    published.Add(SeriesTable(one, result));
    published.Add(Drawing{ToSvg(SharesOverTime(one, result))});
    published.Note(
        fmt::format("{}.csv has every published value with what engines computed.", one.name));
  }
  Page page;
  for (const ReportSection* section : {&source, &run, &published}) page.Add(*section);
  return page.Write({.kicker = "mbverify benchmark",
                     .title = one.title,
                     .lead = fmt::format("{}: {}", ToText(result.verdict), result.reason),
                     .judges = false});
}

std::string CaseCsv(const Benchmark& benchmark, size_t index) {
  const BenchmarkCase& one = benchmark.cases[index];
  const BenchmarkResult& result = benchmark.results[index];
  std::string text = "signal,time_s,published,uncertainty";
  for (const EngineOnCase& engine : result.engines) {
    if (engine.ran()) text += "," + CsvCell(engine.engine);
  }
  for (size_t s = 0; s < one.published.size(); ++s) {
    const PublishedSeries& series = one.published[s];
    for (size_t k = 0; k < series.values.size(); ++k) {
      text += fmt::format("\n{},{:.10g},{:.17g},{:.6g}", CsvCell(series.called), series.time_s[k],
                          series.values[k], series.uncertainty[k]);
      for (const EngineOnCase& engine : result.engines) {
        if (engine.ran()) text += fmt::format(",{:.17g}", engine.computed[s][k]);
      }
    }
  }
  return text + "\n";
}

nlohmann::ordered_json ToJson(const Benchmark& benchmark) {
  using Json = nlohmann::ordered_json;
  Json cases = Json::array();
  for (size_t k = 0; k < benchmark.results.size(); ++k) {
    const BenchmarkCase& one = benchmark.cases[k];
    const BenchmarkResult& result = benchmark.results[k];
    Json published = Json::array(), engines = Json::array();
    for (const PublishedSeries& series : one.published) {
      published.push_back({{"signal", series.called},
                           {"channel", series.channel},
                           {"values", series.values.size()},
                           {"uncertainty", Number(series.uncertainty.back())},
                           {"proved", series.proved}});
    }
    for (const EngineOnCase& engine : result.engines) {
      Json errors = Json::array();
      for (const SeriesError& error : engine.series) {
        errors.push_back({{"largest", Number(error.largest)},
                          {"at_s", Number(error.time_s)},
                          {"by_uncertainty", Number(error.ratio)}});
      }
      Json row = {{"engine", engine.engine}, {"program", engine.program}, {"why", engine.why}};
      row["published"] = std::move(errors);
      for (const Ranked& ranked : kRanked) row[ranked.key] = Number(engine.*ranked.value);
      row["cpu_s"] = Number(engine.cpu_s);
      engines.push_back(std::move(row));
    }
    cases.push_back({{"case", one.name},
                     {"suite", one.suite},
                     {"title", one.title},
                     {"source",
                      {{"work", one.source.work},
                       {"item", one.source.item},
                       {"licence", one.source.licence},
                       {"url", one.source.url}}},
                     {"page", PageOf(one.name)},
                     {"verdict", ToText(result.verdict)},
                     {"as_stated", AsStated(one, result)},
                     {"reason", result.reason},
                     {"published", std::move(published)},
                     {"engines", std::move(engines)}});
  }
  return {{"schema", "mbverify.benchmark/1"}, {"cases", std::move(cases)}};
}

}  // namespace mbv
