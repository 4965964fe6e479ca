#include "report/mutation_report.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

namespace mbv {
namespace {

using Json = nlohmann::ordered_json;

Json Number(double value) { return std::isfinite(value) ? Json(value) : Json(); }

std::string Cell(double value, const char* format) {
  return std::isnan(value) ? "-" : fmt::format(fmt::runtime(format), value);
}

// "|" would end a cell of a Markdown table.
std::string InCell(std::string text) {
  for (size_t at = 0; (at = text.find('|', at)) != std::string::npos; at += 2) {
    text.insert(at, "\\");
  }
  return text;
}

std::string SeenText(const Mutation& m) {
  return !m.detected ? "no" : m.by_force ? "drive forces" : m.ran ? "yes" : "refused";
}

std::string Row(const Mutation& m, bool markdown) {
  const std::string change = Cell(m.force_change, "{:.1e}");
  const std::string smallest = Cell(m.smallest, "{:.1e}");
  std::string relative;
  if (m.value == 0.0) {
    relative =
        fmt::format("relative to {:g}{}{}; ", m.relative_to, m.unit.empty() ? "" : " ", m.unit);
  } else if (m.relative_to / m.value < 0.0) {
    relative = "made smaller; ";
  }
  std::string note = m.best_check == "model" ? "the model is refused: " + m.reason : m.best_check;
  if (!m.detected)
    note = m.reason + (m.best_check.empty() ? "" : "; seen first by " + m.best_check);
  note = relative + note;
  if (markdown) {
    return fmt::format("| `{}` | {:g} {} | {} | {} | {} | {} |\n", m.parameter, m.value, m.unit,
                       SeenText(m), change, smallest, InCell(note));
  }
  return fmt::format("  {:<22}{:>12g} {:<7}{:<14}{:>9}  {:>8}  {}\n", m.parameter, m.value, m.unit,
                     SeenText(m), change, smallest, note);
}

std::string Row(const FaultResult& f, bool markdown) {
  const std::string seen = !f.applicable ? "not applicable" : f.detected ? "yes" : "no";
  std::string note = f.reason;
  if (f.applicable && f.ran && f.detected) {
    note = fmt::format("{} = {:.1e} (limit {:.0e})", f.check, f.value, f.limit);
  } else if (f.applicable && !f.ran) {
    note = "could not run: " + f.reason;
  }
  const std::string where = f.where + (f.alike > 0 ? fmt::format(" (and {} alike)", f.alike) : "");
  if (markdown) {
    return fmt::format("| {} | {} | {} | {} |\n", f.kind, where, seen, InCell(note));
  }
  return fmt::format("  {:<31}{:<38}{:<15}{}\n", f.kind, where, seen, note);
}

std::string Head(const MutationReport& report) {
  const auto count = [&](auto predicate) {
    return std::count_if(report.mutations.begin(), report.mutations.end(), predicate);
  };
  const auto detected = count([](const Mutation& m) { return m.detected; });
  const auto by_force = count([](const Mutation& m) { return m.by_force; });
  std::string text = fmt::format(
      "{}: {} of {} parameters, each {:g} % wrong on the simulated side, turn the verdict; {} of "
      "them by the drive forces",
      report.scenario, detected, report.mutations.size(), 100 * report.size, by_force);
  if (!report.faults.empty()) {
    size_t applicable = 0, seen = 0;
    for (const FaultResult& fault : report.faults) {
      applicable += fault.applicable ? 1 : 0;
      seen += fault.detected ? 1 : 0;
    }
    text += fmt::format("; so do {} of {} structural faults", seen, applicable);
  }
  return text + fmt::format(" ({} simulations in {:.1f} s)\n\n", report.runs, report.wall_s);
}

}  // namespace

std::string ToText(const MutationReport& report, bool markdown) {
  std::string text = Head(report);
  text += markdown
              ? "| parameter | value | detected | force NRMSE | smallest relative error | seen "
                "first by, or why not |\n|---|---|---|---|---|---|\n"
              : fmt::format("  {:<22}{:>12} {:<7}{:<14}{:>9}  {:>8}  {}\n", "parameter", "value",
                            "", "detected", "force", "smallest", "seen first by, or why not");
  for (const Mutation& m : report.mutations) text += Row(m, markdown);
  text += fmt::format(
      "\n{}The smallest relative error is the smallest one that was detected; one {:g} % smaller "
      "was not.\n",
      markdown ? "" : "  ", 100.0 * report.resolution);
  if (report.faults.empty()) return text;
  text += markdown
              ? "\n| structural fault | where | detected | how, or why not |\n|---|---|---|---|\n"
              : fmt::format("\n  {:<31}{:<38}{:<15}{}\n", "structural fault", "where", "detected",
                            "how, or why not");
  for (const FaultResult& fault : report.faults) text += Row(fault, markdown);
  return text;
}

std::string ToJson(const MutationReport& report) {
  Json json = {{"schema", "mbverify.mutate/1"},
               {"scenario", report.scenario},
               {"exit_code", report.exit_code},
               {"size", Number(report.size)},
               {"resolution", Number(report.resolution)},
               {"simulations", report.runs},
               {"wall_s", report.wall_s}};
  json["parameters"] = Json::array();
  for (const Mutation& m : report.mutations) {
    json["parameters"].push_back({{"parameter", m.parameter},
                                  {"unit", m.unit},
                                  {"value", Number(m.value)},
                                  {"relative_to", Number(m.relative_to)},
                                  {"ran", m.ran},
                                  {"detected", m.detected},
                                  {"by_force", m.by_force},
                                  {"force_nrmse", Number(m.force_change)},
                                  {"smallest", Number(m.smallest)},
                                  {"check", m.best_check},
                                  {"unseen_up_to", Number(m.proved_to)},
                                  {"force_sensitivity", Number(m.sensitivity)},
                                  {"reason", m.reason}});
  }
  json["faults"] = Json::array();
  for (const FaultResult& f : report.faults) {
    json["faults"].push_back({{"fault", f.kind},
                              {"where", f.where},
                              {"applicable", f.applicable},
                              {"ran", f.ran},
                              {"detected", f.detected},
                              {"check", f.check},
                              {"value", Number(f.value)},
                              {"limit", Number(f.limit)},
                              {"alike", f.alike},
                              {"reason", f.reason}});
  }
  return json.dump(2, ' ', false, Json::error_handler_t::replace) + "\n";
}

}  // namespace mbv
