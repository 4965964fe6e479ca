#include "report/result_tables.h"

#include <fmt/format.h>

#include <cmath>

#include "base/text.h"
#include "report/result.h"
#include "report/sizing.h"

namespace mbv {
namespace {

constexpr const char* kDash = "–";
constexpr size_t kMostDigits = 9;  // of a number in full; a longer one is rounded

std::string SourceText(Source source) {
  const std::string word = SourceWord(source);
  return word.empty() ? kDash : word;
}

// As short as it is, or six digits.
std::string Short(double value) {
  const std::string full = fmt::format("{}", value);
  return full.size() <= kMostDigits ? full : fmt::format("{:.6g}", value);
}

std::string Significant(double value, int digits = 3) {
  return std::isfinite(value) ? fmt::format("{:.{}g}", value, digits) : kDash;
}

std::string InUnit(double value, const std::string& unit) {
  return std::isfinite(value) ? Significant(value) + " " + unit : kDash;
}

// "kg m^2" → "kg m²".
std::string PrintedUnit(std::string unit) {
  if (unit == "1") return "";
  for (const auto& [plain, printed] : {std::pair{"^2", "²"}, {"^3", "³"}}) {
    const size_t at = unit.find(plain);
    if (at != std::string::npos) unit.replace(at, 2, printed);
  }
  return unit;
}

std::string NoneOr(const std::vector<std::string>& names) {
  return names.empty() ? "none" : Joined(names);
}

}  // namespace

Table ParameterTable(const std::vector<Parameter>& parameters,
                     const std::map<std::string, StatedNumber>& stated) {
  Table table;
  table.name = "parameters";
  table.caption = "Parameters";
  table.columns = {Text("Parameter"), Digits("Value"), Text("Unit"), Text("Source"),
                   Wide("Meaning")};
  for (const Parameter& parameter : parameters) {
    const auto at = stated.find(parameter.name);
    const bool written = at != stated.end() && at->second.value == parameter.value;
    const std::string unit = PrintedUnit(written ? at->second.unit : parameter.unit);
    // A number of the file that another one replaced is no longer the source's.
    const bool replaced = at != stated.end() && !written;
    table.rows.push_back({parameter.name, written ? at->second.text : Short(parameter.value), unit,
                          replaced ? "set" : SourceText(parameter.source), parameter.note});
  }
  return table;
}

Table MobilityTable(const Mechanism& mechanism, const MobilityReport& report) {
  Table table;
  table.name = "mobility";
  table.caption = "Mobility of " + mechanism.name;
  table.columns = {Text("Quantity"), Wide("Value")};
  const Mobility& m = report.home;
  const auto add = [&](const char* what, const std::string& value) {
    table.rows.push_back({what, value});
  };
  add("moving bodies", std::to_string(mechanism.bodies.size() - 1));
  add("joints", std::to_string(mechanism.joints.size()));
  add("loops", std::to_string(report.loops.size()));
  add("constraints, rank", fmt::format("{}, {}", m.constraint_rows, m.constraint_rank));
  add("degrees of freedom", std::to_string(report.dofs()));
  if (!m.idle_spins.empty()) add("idle spins", std::to_string(m.idle_spins.size()));
  add("Kutzbach's count", std::to_string(m.kutzbach));
  add("redundant constraints", std::to_string(report.redundant_count()));
  add("drives", std::to_string(m.drives));
  add("prescribed joints", std::to_string(m.prescribed));
  add("degrees of freedom with all of these locked", std::to_string(report.undriven()));
  add("drive forces that statics leaves open", NoneOr(m.drives_not_unique));
  add("joints with reactions left open", NoneOr(m.joints_not_unique));
  if (report.home_singular()) add("home pose", "singular");
  return table;
}

Table CheckTable(const ResultView& view) {
  Table table;
  table.name = "checks";
  table.caption = fmt::format("Checks of {}: {}", view.frame->title(), ToText(view.verdict));
  table.columns = {Text("Compared"), Text("Check"), Digits("Value"), Digits("Limit"),
                   Text("Result")};
  for (const ShownCheck& check : view.checks) {
    if (!check.limit) continue;
    table.rows.push_back({check.subject, check.title,
                          std::isnan(check.value) ? kDash : fmt::format("{:.1e}", check.value),
                          fmt::format("{:.1e}", *check.limit), EndCell(check).text});
  }
  return table;
}

Table SizingTable(const Report& report) {
  Table table;
  table.name = "sizing";
  table.caption = fmt::format("Motors in {}", report.title());
  table.columns = {
      Text("Drive"),         Digits("Torque, peak"), Digits("RMS"), Digits("Speed, peak"),
      Digits("Power, peak"), Digits("Largest use"),  Text("of")};
  for (const MotorLoad* load : MainMotorLoads(report)) {
    const double use = load->largest_use();
    table.rows.push_back({load->drive, InUnit(load->peak_torque, load->torque_unit),
                          InUnit(load->rms_torque, load->torque_unit),
                          InUnit(load->peak_speed, load->speed_unit), InUnit(load->peak_power, "W"),
                          std::isfinite(use) ? Significant(100 * use) + " %" : kDash,
                          std::isfinite(use) ? load->limited_by() : kDash});
    if (table.rows.size() == 1) table.caption += ", " + load->witness;
  }
  return table;
}

}  // namespace mbv
