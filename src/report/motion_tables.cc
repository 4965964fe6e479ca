#include "report/motion_tables.h"

#include <fmt/format.h>

#include <cmath>

#include "report/page.h"

namespace mbv {
namespace {

using Json = nlohmann::ordered_json;

// Of the second derivative's mean square: 1 % of its RMS is reported unasked.
constexpr double kReportedShare = 1e-4;

std::string SmoothingText(const MotionTable& table) {
  if (!table.smoothed()) return "none";
  return fmt::format(
      "{}, deviation {:.2g} {}{}", table.smoothing, table.deviation, table.unit,
      std::isfinite(table.cutoff_hz) ? fmt::format(", halves {:.3g} Hz", table.cutoff_hz) : "");
}

std::string KindText(const MotionTable& table) {
  return fmt::format("{} rows{}, {:.6g} … {:.6g} s{}", table.rows,
                     table.with_rates ? " with rates" : "", table.from_s, table.to_s,
                     table.periodic ? ", repeated" : "");
}

std::string ChangeText(double rms, double max, const std::string& unit) {
  return fmt::format("RMS {:.2e}, at most {:.2e} {}", rms, max, unit);
}

Table TablesTable(const Report& report) {
  Table html{
      .caption = "Tables and their splines",
      .columns = {Text("of"), Text("file"), Text("column"), Text("rows"), Text("smoothing"),
                  Digits("smoothing changes by"), Digits("its second derivative by"),
                  Digits("which is (RMS)")},
  };
  for (const MotionTable& table : report.tables) {
    html.rows.push_back({table.name, table.file, table.column, KindText(table),
                         SmoothingText(table),
                         ChangeText(table.change_rms, table.change_max, table.unit),
                         ChangeText(table.acceleration_change_rms, table.acceleration_change_max,
                                    table.unit + "/s²"),
                         fmt::format("{:.5g} {}/s²", table.acceleration_rms, table.unit)});
  }
  return html;
}

Table ForcesTable(const Report& report) {
  Table html{
      .caption = "What smoothing takes out of the drive forces",
      .columns = {Text("drive"), Digits("force, RMS"), Digits("change, RMS"),
                  Digits("change, largest")},
  };
  for (const SmoothedForce& force : report.smoothed_forces) {
    html.rows.push_back({force.drive, fmt::format("{:.6g} {}", force.rms, force.unit),
                         fmt::format("{:.3e} {}", force.change_rms, force.unit),
                         fmt::format("{:.3e} {}", force.change_max, force.unit)});
  }
  return html;
}

}  // namespace

ReportSection MotionTableSection(const Report& report, bool verbose) {
  ReportSection section{.title = "Tables that command the motion", .link = "Tables"};
  if (report.tables.empty()) return section;
  section.Add(TablesTable(report), On::kPage);
  Items lines;
  for (const MotionTable& table : report.tables) {
    lines.texts.push_back(fmt::format("{} follows column '{}' of {}: {}; smoothing: {}", table.name,
                                      table.column, table.file, KindText(table),
                                      SmoothingText(table)));
    if (table.moves && (verbose || table.smoothed() || table.noise_share() > kReportedShare)) {
      lines.texts.push_back(
          fmt::format("  {} by {}, the second derivative by {} (RMS of all: {:.4g})",
                      table.smoothed() ? "smoothing changes it" : "smoothing: auto would change it",
                      ChangeText(table.change_rms, table.change_max, table.unit),
                      ChangeText(table.acceleration_change_rms, table.acceleration_change_max,
                                 table.unit + "/s²"),
                      table.acceleration_rms));
    }
    if (!verbose) continue;
    for (const std::string& note : table.notes) lines.texts.push_back("  " + note);
  }
  section.Add(std::move(lines), On::kTerminal);
  section.Note(
      "Quintic splines through all rows, or as near as their noise allows. Without smoothing, the "
      "changes are those that smoothing: auto would make: they are what noise and rounding of the "
      "rows add to the second derivative, which drive forces follow.");
  section.Add(ForcesTable(report));
  return section;
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
                      {"cutoff_hz", Number(table.cutoff_hz)},
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
