#include <fmt/format.h>
#include <algorithm>
#include <cmath>
#include <filesystem>
#include <limits>
#include <set>

#include "base/files.h"
#include "base/inputs.h"
#include "base/text.h"
#include "cli/files.h"
#include "features/benchmark/benchmark.h"
#include "model_file/yaml/yaml_reader.h"
#include "scenario/tables/text.h"
#include "verify/check_file.h"

namespace mbv {
namespace {

namespace fs = std::filesystem;

constexpr const char* kNameLetters =
    "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789_-";
constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kMostUncertain = 0.2;  // of the largest value: wider tubes hold anything

// The numbers of a table's columns, by name.
struct PublishedTable {
  std::vector<std::string> names;
  std::vector<std::vector<double>> columns;

  [[nodiscard]] const std::vector<double>* Find(const std::string& name) const {
    const auto found = std::ranges::find(names, name);
    return found == names.end() ? nullptr : &columns[static_cast<size_t>(found - names.begin())];
  }
};

std::optional<PublishedTable> ReadPublishedTable(const std::string& file,
                                                 Diagnostics* diagnostics) {
  const auto text = ReadWholeFile(file);
  if (!text) {
    diagnostics->AddError(file, "cannot be read", "a published table lies beside its case");
    return {};
  }
  NoteInput(file, *text);
  const auto cut = CutTable(*text, file, {}, diagnostics);
  if (!cut) return {};
  if (!cut->has_names) {
    diagnostics->AddError(file, "has no heading", "its first line names the columns");
    return {};
  }
  PublishedTable table;
  for (const TableHeading& heading : cut->headings) table.names.push_back(heading.full);
  table.columns.resize(cut->columns);
  CutLine line;
  for (const TableLine& row : cut->rows) {
    CutCells(row.text, cut->delimiter, &line);
    for (size_t k = 0; k < cut->columns; ++k) {
      const CellNumber number =
          k < line.cells.size() ? ReadCell(line.cells[k].text, cut->decimal_comma) : CellNumber{};
      if (number.kind != CellNumber::Kind::kNumber) {
        const int place = k < line.cells.size() ? line.cells[k].column : 1;
        Finding finding{Severity::kError, file, row.number, place, "", "every cell is a number"};
        finding.message = fmt::format("column '{}' has no number here", table.names[k]);
        diagnostics->Add(std::move(finding));
        return {};
      }
      table.columns[k].push_back(number.value);
    }
  }
  return table;
}

class CaseReader {
 public:
  explicit CaseReader(const std::string& file) : yaml_(file) {}

  std::optional<BenchmarkCase> Read(Diagnostics* diagnostics) {
    const auto text = yaml_.ReadFile();
    const YamlNodePtr root = text ? yaml_.Parse(*text) : nullptr;
    if (root != nullptr) ReadCase(root.get());
    diagnostics->Append(yaml_.diagnostics());
    diagnostics->Append(table_findings_);
    if (root == nullptr || yaml_.has_errors() || table_findings_.has_errors()) return {};
    return std::move(case_);
  }

 private:
  void ReadCase(const YamlNode* root) {
    const YamlMap map(&yaml_, root, "",
                      {"benchmark", "title", "suite", "source", "scenario", "published",
                       "published_is_wrong", "not_expressible"});
    if (!map.valid()) return;
    case_.file = yaml_.file();
    case_.name = RequiredText(map, "benchmark");
    if (case_.name.find_first_not_of(kNameLetters) != std::string::npos) {
      yaml_.Error(*map.Find("benchmark"), fmt::format("benchmark: '{}' is no name", case_.name),
                  "it names files: letters, digits, _ and - only");
    }
    case_.title = RequiredText(map, "title");
    case_.suite = RequiredText(map, "suite");
    case_.published_is_wrong = OptionalText(map, "published_is_wrong");
    case_.not_expressible = OptionalText(map, "not_expressible");
    ReadSource(map);
    if (!case_.not_expressible.empty()) {
      for (const char* key : {"scenario", "published"}) {
        if (const YamlNode* node = map.Find(key)) {
          yaml_.Error(*node, fmt::format("{}: the case is not_expressible", key),
                      "leave one of the two out");
        }
      }
      return;
    }
    const std::string scenario = RequiredText(map, "scenario");
    case_.scenario = PathOf(scenario);
    if (!scenario.empty() && !fs::is_regular_file(case_.scenario)) {
      yaml_.Error(*map.Find("scenario"), fmt::format("scenario: there is no file '{}'", scenario),
                  "relative to the case's folder");
    }
    const YamlNode* published = map.Required("published");
    if (published == nullptr) return;
    const auto items = yaml_.Items(*published, "published");
    if (!items) return;
    if (items->empty()) yaml_.Error(*published, "published: is empty", "name a value or a column");
    for (size_t k = 0; k < items->size(); ++k) {
      ReadSeries(*(*items)[k], fmt::format("published[{}]", k));
    }
  }

  void ReadSource(const YamlMap& map) {
    const YamlNode* node = map.Required("source");
    if (node == nullptr) return;
    const YamlMap source(&yaml_, node, "source",
                         {"work", "item", "licence", "licence_file", "url", "sha256"});
    case_.source = {.work = RequiredText(source, "work"),
                    .item = OptionalText(source, "item"),
                    .licence = RequiredText(source, "licence"),
                    .url = OptionalText(source, "url"),
                    .sha256 = OptionalText(source, "sha256")};
    const std::string licence = OptionalText(source, "licence_file");
    if (licence.empty()) return;
    if (const auto text = ReadWholeFile(PathOf(licence))) {
      NoteInput(PathOf(licence), *text);
    } else {
      yaml_.Error(*source.Find("licence_file"),
                  fmt::format("source.licence_file: there is no file '{}'", licence),
                  "relative to the case's folder");
    }
  }

  [[nodiscard]] std::string PathOf(const std::string& file) const {
    return (fs::path(yaml_.file()).parent_path() / file).string();
  }

  // A column of a table, or a value at an instant.
  void ReadSeries(const YamlNode& node, const std::string& path) {
    const YamlMap map(
        &yaml_, &node, path,
        {"channel", "angular_velocity", "axis", "called", "table", "column", "value", "at_s",
         "uncertainty", "relative", "at_start", "until_s", "why", "proved", "scale"});
    if (!map.valid()) return;
    PublishedSeries series;
    if (map.Has("angular_velocity")) {
      ReadSpin(map, &series);
    } else {
      series.channel = RequiredText(map, "channel");
    }
    series.uncertainty_why = RequiredText(map, "why");
    if (const YamlNode* proved = map.Find("proved")) {
      series.proved = yaml_.Flag(*proved, map.PathOf("proved")).value_or(false);
    }
    const bool of_table = map.Has("table");
    if (of_table == map.Has("value")) {
      yaml_.Error(node, path + ": has " + (of_table ? "both table and value" : "no numbers"),
                  "either table and column, or value and at_s");
      return;
    }
    if (!of_table && map.Has("until_s")) {
      yaml_.Error(*map.Find("until_s"), map.PathOf("until_s") + ": is for columns of a table");
    }
    double factor = 1.0;
    if (const YamlNode* scale = map.Find("scale")) {
      factor = yaml_.Number(*scale, map.PathOf("scale")).value_or(kNan);
    }
    if (of_table) {
      ReadColumn(map, &series);
    } else {
      const double value = RequiredNumber(map, "value"), at_s = RequiredNumber(map, "at_s");
      series.values = {value};
      series.time_s = {at_s};
      series.called = OptionalText(map, "called");
    }
    for (double& value : series.values) value *= factor;
    ReadUncertainty(map, node, &series);
    if (series.called.empty()) series.called = series.channel;
    case_.published.push_back(std::move(series));
  }

  void ReadSpin(const YamlMap& map, PublishedSeries* series) {
    if (const YamlNode* channel = map.Find("channel")) {
      yaml_.Error(*channel, map.path() + " has both channel and angular_velocity");
    }
    series->spins = RequiredText(map, "angular_velocity");
    const YamlNode* axis = map.Required("axis");
    if (axis == nullptr) return;
    const auto choice = yaml_.Choice(*axis, map.PathOf("axis"), {"x", "y", "z"});
    if (!choice) return;
    series->axis = static_cast<int>(*choice);
    series->channel = fmt::format("{}: angular velocity about its {}", series->spins, axis->text);
  }

  void ReadColumn(const YamlMap& map, PublishedSeries* series) {
    const std::string name = RequiredText(map, "table"), column = RequiredText(map, "column");
    if (name.empty() || column.empty()) return;
    if (fs::path(name).has_parent_path()) {
      yaml_.Error(*map.Find("table"), fmt::format("{}: the table is '{}'", map.path(), name),
                  "it lies beside the case: a file name without folders");
      return;
    }
    const std::string file = PathOf(name);
    if (file != table_file_) {
      table_file_ = file;
      table_ = ReadPublishedTable(file, &table_findings_);
    }
    if (!table_) return;
    const std::vector<double>* time = table_->Find("time_s");
    const std::vector<double>* values = table_->Find(column);
    if (time == nullptr) {
      yaml_.Error(*map.Find("table"), fmt::format("{}: {} has no column time_s", map.path(), name));
    } else if (values == nullptr) {
      yaml_.Error(*map.Find("column"),
                  fmt::format("{}: {} has no column '{}'", map.path(), name, column),
                  DidYouMean(column, table_->names, "columns: " + Joined(table_->names)));
    } else {
      const YamlNode* until = map.Find("until_s");
      const double last =
          until == nullptr ? kInfinity : yaml_.Number(*until, map.PathOf("until_s")).value_or(kNan);
      for (size_t k = 0; k < time->size() && (*time)[k] <= last; ++k) {
        series->time_s.push_back((*time)[k]);
        series->values.push_back((*values)[k]);
      }
      if (series->values.empty() && !std::isnan(last)) {
        yaml_.Error(*until,
                    fmt::format("{} = {:g}: the table begins later", map.PathOf("until_s"), last));
      }
    }
    series->called = column;
  }

  // Absolute, or of the largest magnitude; at_start: grows in proportion to time from there on.
  void ReadUncertainty(const YamlMap& map, const YamlNode& node, PublishedSeries* series) {
    const YamlNode* relative = map.Find("relative");
    const YamlNode* absolute = map.Find("uncertainty");
    if ((relative == nullptr) == (absolute == nullptr)) {
      yaml_.Error(node, map.path() + ": needs either uncertainty or relative",
                  "nothing is published without an uncertainty: say where it is from in why");
      return;
    }
    const YamlNode& stated = relative != nullptr ? *relative : *absolute;
    const std::string path = map.PathOf(relative != nullptr ? "relative" : "uncertainty");
    double largest = 0.0;
    for (const double value : series->values) largest = std::max(largest, std::abs(value));
    const double scale = relative != nullptr ? largest : 1.0;
    const double end = yaml_.Number(stated, path).value_or(kNan) * scale;
    double start = end;
    if (const YamlNode* at_start = map.Find("at_start")) {
      start = yaml_.Number(*at_start, map.PathOf("at_start")).value_or(kNan) * scale;
      if (!std::isnan(start) && !(start > 0.0)) {
        yaml_.Error(*at_start,
                    fmt::format("{} = {:g} violates > 0", map.PathOf("at_start"), start));
      }
    }
    if (std::isnan(end) || std::isnan(start) || series->values.empty()) return;
    if (!(end > 0.0)) {
      yaml_.Error(stated, fmt::format("{} = {:g} violates > 0", path, end),
                  relative != nullptr ? "of values that are all zero it is no uncertainty" : "");
    } else if (largest > 0.0 && !(std::max(start, end) < kMostUncertain * largest)) {
      yaml_.Error(stated,
                  fmt::format("{}: {:.3g} of values of at most {:.3g} verifies nothing", path,
                              std::max(start, end), largest),
                  fmt::format("below {:g} of the largest one; fewer instants may need less",
                              kMostUncertain));
    }
    const double last = std::max(series->time_s.back(), 1e-300);
    for (const double time : series->time_s) {
      series->uncertainty.push_back(start + (end - start) * time / last);
    }
  }

  std::string OptionalText(const YamlMap& map, const std::string& key) {
    const YamlNode* node = map.Find(key);
    return node == nullptr ? "" : yaml_.Text(*node, map.PathOf(key)).value_or("");
  }
  std::string RequiredText(const YamlMap& map, const std::string& key) {
    const YamlNode* node = map.Required(key);
    return node == nullptr ? "" : yaml_.Text(*node, map.PathOf(key)).value_or("");
  }
  double RequiredNumber(const YamlMap& map, const std::string& key) {
    const YamlNode* node = map.Required(key);
    return node == nullptr ? kNan : yaml_.Number(*node, map.PathOf(key)).value_or(kNan);
  }

  YamlReader yaml_;
  BenchmarkCase case_;
  std::string table_file_;
  std::optional<PublishedTable> table_;
  Diagnostics table_findings_;
};

}  // namespace

std::optional<BenchmarkCase> ReadBenchmarkCase(const std::string& file, Diagnostics* diagnostics) {
  return CaseReader(file).Read(diagnostics);
}

Diagnostics CheckBenchmarkCase(const std::string& file) {
  Diagnostics diagnostics;
  const auto read = ReadBenchmarkCase(file, &diagnostics);
  if (read && !read->scenario.empty()) diagnostics.Append(CheckFile(read->scenario));
  return diagnostics;
}

std::vector<BenchmarkCase> ReadBenchmarkCases(const std::vector<std::string>& paths,
                                              Diagnostics* diagnostics) {
  std::vector<std::string> files;
  for (const std::string& path : paths) {
    if (!fs::is_directory(path)) {
      files.push_back(path);
      continue;
    }
    std::vector<std::string> unread;
    for (const std::string& file : ExpandYaml(path, &unread)) {
      if (fs::path(file).filename() == "case.yaml") files.push_back(file);
    }
    for (const std::string& line : unread) diagnostics->AddError(path, line, "");
  }
  if (files.empty() && !diagnostics->has_errors()) {
    diagnostics->AddError(Joined(paths), "has no case.yaml",
                          "docs/how-to/benchmark_cases.md shows one");
  }
  std::vector<BenchmarkCase> cases;
  std::set<std::string> names;
  for (const std::string& file : files) {
    auto one = ReadBenchmarkCase(file, diagnostics);
    if (!one) continue;
    if (!names.insert(one->name).second) {
      diagnostics->AddError(file, fmt::format("benchmark: another case is called '{}'", one->name),
                            "names of cases differ");
    }
    cases.push_back(std::move(*one));
  }
  std::ranges::sort(cases, [](const BenchmarkCase& a, const BenchmarkCase& b) {
    return std::pair(a.suite, a.name) < std::pair(b.suite, b.name);
  });
  return cases;
}

}  // namespace mbv
