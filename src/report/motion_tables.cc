#include "report/motion_tables.h"

#include <fmt/format.h>

#include "report/page.h"

namespace mbv {
namespace {

using Json = nlohmann::ordered_json;

// Of the second derivative's mean square: 1 % of its RMS is reported unasked.
constexpr double kReportedShare = 1e-4;

std::string SmoothingText(const MotionTable& table) {
  if (!table.smoothed()) return "none";
  return fmt::format("{}, deviation {:.2g} {}", table.smoothing, table.deviation, table.unit);
}

std::string KindText(const MotionTable& table) {
  return fmt::format("{} rows{}, {:.6g} … {:.6g} s{}", table.rows,
                     table.with_rates ? " with rates" : "", table.from_s, table.to_s,
                     table.periodic ? ", repeated" : "");
}

std::string ChangeText(double rms, double max, const std::string& unit) {
  return fmt::format("RMS {:.2e}, at most {:.2e} {}", rms, max, unit);
}

std::string ForceText(const SmoothedForce& force) {
  return fmt::format("RMS {:.3e} of {:.6g} {}, at most {:.3e} {}", force.change_rms, force.rms,
                     force.unit, force.change_max, force.unit);
}

Table TablesTable(const Report& report) {
  Table html{.caption = "Tables and their splines",
             .head = {Text("of"), Text("file"), Text("column"), Text("rows"), Text("smoothing"),
                      Digits("smoothing changes by"), Digits("its second derivative by"),
                      Digits("which is (RMS)")},
             .rows = {}};
  for (const MotionTable& table : report.tables) {
    html.rows.push_back({Text(table.name), Text(table.file), Text(table.column),
                         Text(KindText(table)), Text(SmoothingText(table)),
                         Digits(ChangeText(table.change_rms, table.change_max, table.unit)),
                         Digits(ChangeText(table.acceleration_change_rms,
                                           table.acceleration_change_max, table.unit + "/s²")),
                         Digits(fmt::format("{:.5g} {}/s²", table.acceleration_rms, table.unit))});
  }
  return html;
}

Table ForcesTable(const Report& report) {
  Table html{.caption = "What smoothing takes out of the drive forces",
             .head = {Text("drive"), Digits("force, RMS"), Digits("change, RMS"),
                      Digits("change, largest")},
             .rows = {}};
  for (const SmoothedForce& force : report.smoothed_forces) {
    html.rows.push_back({Text(force.drive), Digits(fmt::format("{:.6g} {}", force.rms, force.unit)),
                         Digits(fmt::format("{:.3e} {}", force.change_rms, force.unit)),
                         Digits(fmt::format("{:.3e} {}", force.change_max, force.unit))});
  }
  return html;
}

}  // namespace

std::vector<std::string> MotionTableLines(const Report& report, bool verbose) {
  std::vector<std::string> lines;
  for (const MotionTable& table : report.tables) {
    lines.push_back(fmt::format("{} follows column '{}' of {}: {}; smoothing: {}", table.name,
                                table.column, table.file, KindText(table), SmoothingText(table)));
    if (table.moves && (verbose || table.smoothed() || table.noise_share() > kReportedShare)) {
      lines.push_back(
          fmt::format("  {} by {}, the second derivative by {} (RMS of all: {:.4g})",
                      table.smoothed() ? "smoothing changes it" : "smoothing: auto would change it",
                      ChangeText(table.change_rms, table.change_max, table.unit),
                      ChangeText(table.acceleration_change_rms, table.acceleration_change_max,
                                 table.unit + "/s²"),
                      table.acceleration_rms));
    }
    if (!verbose) continue;
    for (const std::string& note : table.notes) lines.push_back("  " + note);
  }
  for (const SmoothedForce& force : report.smoothed_forces) {
    lines.push_back(
        fmt::format("smoothing changes the force of {}: {}", force.drive, ForceText(force)));
  }
  return lines;
}

std::string MotionTableHtml(const Report& report) {
  if (report.tables.empty()) return "";
  std::string html = ToHtml(TablesTable(report));
  html += Note(
      "Quintic splines through all rows, or as near as their noise allows. Without smoothing, the "
      "changes are those that smoothing: auto would make: they are what noise and rounding of the "
      "rows add to the second derivative, which drive forces follow.");
  if (!report.smoothed_forces.empty()) html += ToHtml(ForcesTable(report));
  return html;
}

Json MotionTableJson(const Report& report) {
  Json tables = Json::array(), forces = Json::array();
  for (const MotionTable& table : report.tables) {
    tables.push_back({{"of", table.name},
                      {"file", table.file},
                      {"column", table.column},
                      {"unit", table.unit},
                      {"rows", table.rows},
                      {"from_s", Number(table.from_s)},
                      {"to_s", Number(table.to_s)},
                      {"periodic", table.periodic},
                      {"with_rates", table.with_rates},
                      {"smoothing", table.smoothing},
                      {"deviation", Number(table.deviation)},
                      {"change_rms", Number(table.change_rms)},
                      {"change_max", Number(table.change_max)},
                      {"acceleration_change_rms", Number(table.acceleration_change_rms)},
                      {"acceleration_change_max", Number(table.acceleration_change_max)},
                      {"acceleration_rms", Number(table.acceleration_rms)},
                      {"noise_share", Number(table.noise_share())},
                      {"notes", table.notes}});
  }
  for (const SmoothedForce& force : report.smoothed_forces) {
    forces.push_back({{"drive", force.drive},
                      {"unit", force.unit},
                      {"rms", Number(force.rms)},
                      {"change_rms", Number(force.change_rms)},
                      {"change_max", Number(force.change_max)}});
  }
  return {{"tables", std::move(tables)}, {"smoothed_forces", std::move(forces)}};
}

}  // namespace mbv
