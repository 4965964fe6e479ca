// What drives and joints bear, as tables of report.html.
#include <fmt/format.h>

#include <cmath>

#include "report/html_tables.h"
#include "report/html_text.h"
#include "report/load_figures.h"

namespace mbv {
namespace {

constexpr size_t kOpenRows = 12;  // longer tables are folded

std::string Figure(double value, const std::string& unit) {
  return std::isfinite(value) ? fmt::format("{:.5g} {}", value, unit) : "–";
}

std::string PeakTime(double time_s) {
  return std::isfinite(time_s) ? fmt::format("{:.4g} s", time_s) : "";
}

void AddFigures(const Figures& figures, std::vector<Cell>* row) {
  row->push_back(Digits(Figure(figures.peak, figures.unit)));
  row->push_back(Digits(PeakTime(figures.time_s)));
  row->push_back(Digits(Figure(figures.rms, figures.unit)));
  row->push_back(Digits(Figure(figures.mean, figures.unit)));
}

Table DriveTable(const std::vector<DriveLoad>& loads, const std::string& witness) {
  Table table{
      .caption = "Drives, " + witness,
      .head = {Text("drive"), Digits("force, peak"), Digits("at"), Digits("RMS"), Digits("mean"),
               Digits("power, peak"), Digits("at"), Digits("RMS"), Digits("mean"), Digits("stroke"),
               Digits("speed, peak"), Digits("speed, RMS")},
      .rows = {}};
  for (const DriveLoad& load : loads) {
    if (load.witness != witness) continue;
    std::vector<Cell> row = {Text(load.drive)};
    AddFigures(load.force, &row);
    AddFigures(load.power, &row);
    row.push_back(Digits(Figure(load.stroke, load.stroke_unit)));
    row.push_back(Digits(Figure(load.speed.peak, load.speed.unit)));
    row.push_back(Digits(Figure(load.speed.rms, load.speed.unit)));
    table.rows.push_back(std::move(row));
  }
  return table;
}

Table JointTable(const std::vector<JointLoad>& loads, const std::string& witness) {
  Table table{
      .caption = "Joint reactions, magnitudes, " + witness,
      .head = {Text("joint"), Digits("force, peak"), Digits("at"), Digits("RMS"), Digits("mean"),
               Digits("moment, peak"), Digits("at"), Digits("RMS"), Digits("mean")},
      .rows = {}};
  for (const JointLoad& load : loads) {
    if (load.witness != witness) continue;
    std::vector<Cell> row = {
        Markup(Escape(load.joint) + (load.not_unique ? " " + Pill("warn", "not unique") : ""))};
    AddFigures(load.force, &row);
    AddFigures(load.moment, &row);
    table.rows.push_back(std::move(row));
  }
  return table;
}

std::string Shown(const Table& table, bool open) {
  if (table.rows.empty()) return "";
  return open ? ToHtml(table) : Folded(table.caption, ToHtml(table));
}

// What the others are measured against the main pair's first witness; else the first that ran.
std::string MainWitness(const Report& report, const LoadFigures& loads) {
  const PairComparison* pair = MainPair(report.comparison);
  return pair != nullptr ? pair->measured : loads.drives.front().witness;
}

}  // namespace

std::string LoadsHtml(const Report& report) {
  const LoadFigures loads = LoadFiguresOf(report);
  if (loads.drives.empty() && loads.joints.empty()) return "";
  const std::string main =
      loads.drives.empty() ? loads.joints.front().witness : MainWitness(report, loads);
  std::string html = Shown(DriveTable(loads.drives, main), true);
  const Table joints = JointTable(loads.joints, main);
  html += Shown(joints, joints.rows.size() <= kOpenRows);
  bool open = false;
  for (const WitnessRecord& record : report.witnesses) {
    if (record.name == main) continue;
    html += Shown(DriveTable(loads.drives, record.name), false);
    html += Shown(JointTable(loads.joints, record.name), false);
  }
  for (const JointLoad& load : loads.joints) open = open || load.not_unique;
  return html +
         Note(std::string("Peak: the value of largest magnitude. RMS and mean are over time. "
                          "Power is force times speed, positive into the mechanism. Reactions "
                          "are what joints transmit, drive forces excluded") +
              (open ? "; where statics leaves them open, one choice of many." : "."));
}

}  // namespace mbv
