#include "features/regress/accuracy.h"

#include "base/json_text.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <sstream>

namespace mbv {
namespace {

using Json = nlohmann::ordered_json;

constexpr const char* kBegin = "<!-- accuracy: written by mbverify regress --tables -->";
constexpr const char* kEnd = "<!-- accuracy: end -->";
constexpr const char* kNothing = "–";

// A heading and the places in summary.json where its number may stand, the first that has one.
struct AccuracyColumn {
  const char* heading;
  std::vector<const char*> places;  // JSON pointers, or CHECK:value, CHECK:limit
  const char* unit = "";
  bool count = false;  // a whole number
};

const std::vector<AccuracyColumn>& AccuracyColumns() {
  static const std::vector<AccuracyColumn> kColumns = {
      {"reference vs analytic", {"/metrics/reference_vs_analytic/force_nrmse"}},
      {"simulation vs analytic", {"/metrics/simulated_vs_analytic/force_nrmse"}},
      {"largest error", {"/metrics/simulated_vs_analytic/force_max_rel"}},
      {"simulation vs reference", {"/metrics/simulated_vs_reference/force_nrmse"}},
      {"on the motion reached", {"/metrics/simulated_vs_reached/force_nrmse"}},
      {"loop gap", {"/metrics/simulated_vs_analytic/closure_max_m"}, " m"},
      {"default MuJoCo", {"/engine_error/defaults/force_nrmse"}},
      {"default, from 0.1 s", {"/engine_error/defaults/force_nrmse_later"}},
      {"best recipe", {"/engine_error/stock/force_nrmse"}},
      {"best, from 0.1 s", {"/engine_error/stock/force_nrmse_later"}},
      {"best recipe, loop gap", {"/engine_error/stock/closure_max_m"}, " m"},
      {"horizon", {"/duration_s"}, " s"},
      {"motion error",
       {"simulated_vs_analytic.pose_m:value", "simulated_vs_reference.pose_m:value",
        "simulated_vs_analytic.position_m:value"},
       " m"},
      {"perturbed forces lead",
       {"simulated_vs_analytic.pose_m:limit", "simulated_vs_reference.pose_m:limit",
        "simulated_vs_analytic.position_m:limit"},
       " m"},
      {"tracking error", {"/metrics/simulated_vs_analytic/position_max_m"}, " m"},
      {"random cases", {"/points"}, "", true},
      {"no result", {"/failures/points"}, "", true},
      {"worst of all pairs", {"/quantities/0/most"}},
      {"worst, each drive's own scale", {"/quantities/1/most"}},
      {"tracking error, angles", {"/metrics/simulated_vs_analytic/position_max_rad"}, " rad"},
  };
  return kColumns;
}

std::string Trimmed(const std::string& text) {
  const size_t first = text.find_first_not_of(' ');
  if (first == std::string::npos) return "";
  return text.substr(first, text.find_last_not_of(' ') - first + 1);
}

// "| a | b |" → {"a", "b"}; empty for other lines.
std::vector<std::string> CellsOf(const std::string& line) {
  std::vector<std::string> cells;
  if (!line.starts_with("|")) return cells;
  std::istringstream stream(line.substr(1));
  for (std::string cell; std::getline(stream, cell, '|');) cells.push_back(Trimmed(cell));
  return cells;
}

// "`spr_tripod/default` (…)" → "spr_tripod/default".
std::string ScenarioOf(const std::string& cell) {
  const size_t first = cell.find('`');
  if (first == std::string::npos) return "";
  return cell.substr(first + 1, cell.find('`', first + 1) - first - 1);
}

double NumberAt(const Json& summary, const std::string& place) {
  if (place.starts_with("/")) {
    const Json::json_pointer pointer(place);
    if (!summary.contains(pointer) || !summary[pointer].is_number()) return NAN;
    return summary[pointer].get<double>();
  }
  const size_t colon = place.find(':');
  for (const Json& check : summary.value("checks", Json::array())) {
    if (check.value("name", "") != place.substr(0, colon)) continue;
    const Json value = check.value(place.substr(colon + 1), Json());
    return value.is_number() ? value.get<double>() : NAN;
  }
  return NAN;
}

std::string StepText(const Json& summary) {
  const Json simulation = summary.value("simulation", Json::object());
  if (simulation.value("mode", "") == "inverse") return "inverse";
  const double step_s = NumberAt(summary, "/simulation/step_s");
  return std::isnan(step_s) ? kNothing : fmt::format("{:g} ms", 1e3 * step_s);
}

// Calls `row` with the headings and the cells of every row of the document's tables, line by line;
// what it returns replaces the line.
std::string ForEachRow(const std::string& document,
                       const std::function<std::string(const std::vector<std::string>& headings,
                                                       const std::vector<std::string>& cells,
                                                       const std::string& line)>& row) {
  std::istringstream stream(document);
  std::string text;
  std::vector<std::string> headings;
  bool inside = false;
  for (std::string line; std::getline(stream, line);) {
    if (line == kBegin || line == kEnd) {
      inside = line == kBegin;
      headings.clear();
    }
    const std::vector<std::string> cells = inside ? CellsOf(line) : std::vector<std::string>();
    if (!cells.empty() && headings.empty()) {
      headings = cells;
    } else if (!cells.empty() && !ScenarioOf(cells[0]).empty()) {
      line = row(headings, cells, line);
    }
    text += line + "\n";
  }
  return text;
}

}  // namespace

std::vector<AccuracyCell> AccuracyCells(const std::string& document) {
  std::vector<AccuracyCell> all;
  ForEachRow(document, [&](const auto& headings, const auto& cells, const std::string& line) {
    for (size_t k = 1; k < cells.size() && k < headings.size(); ++k) {
      all.push_back({ScenarioOf(cells[0]), headings[k], cells[k]});
    }
    return line;
  });
  return all;
}

std::optional<std::string> AccuracyText(const std::string& heading, const std::string& summary) {
  const Json json = ParseIfJson<Json>(summary);
  if (!json.is_object()) return {};
  if (heading == "step") return StepText(json);
  const auto& columns = AccuracyColumns();
  const auto column = std::find_if(columns.begin(), columns.end(),
                                   [&](const AccuracyColumn& c) { return heading == c.heading; });
  if (column == columns.end()) return {};
  for (const char* place : column->places) {
    const double number = NumberAt(json, place);
    if (std::isnan(number)) continue;
    if (column->count) return fmt::format("{:.0f}", number);
    return fmt::format(
        "{}{}", number >= 0.01 ? fmt::format("{:.2g}", number) : fmt::format("{:.1e}", number),
        column->unit);
  }
  return kNothing;
}

std::string FillAccuracyTables(const std::string& document, const SummaryOf& summary) {
  return ForEachRow(
      document,
      [&](const auto& headings, const auto& cells, const std::string& line) -> std::string {
        const std::optional<std::string> json = summary(ScenarioOf(cells[0]));
        if (!json) return line;
        std::string filled = "| " + cells[0] + " |";
        for (size_t k = 1; k < cells.size() && k < headings.size(); ++k) {
          filled += " " + AccuracyText(headings[k], *json).value_or(cells[k]) + " |";
        }
        return filled;
      });
}

bool SameAccuracy(const std::string& a, const std::string& b) {
  constexpr double kRoundoff = 1e-11, kFactor = 2.0;
  if (a == b) return true;
  char *end_a = nullptr, *end_b = nullptr;
  const double x = std::strtod(a.c_str(), &end_a), y = std::strtod(b.c_str(), &end_b);
  if (end_a == a.c_str() || end_b == b.c_str() || std::string(end_a) != end_b) return false;
  if (std::max(x, y) <= kRoundoff) return true;
  return x <= kFactor * y && y <= kFactor * x;
}

}  // namespace mbv
