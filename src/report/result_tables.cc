#include "report/result_tables.h"

#include <fmt/format.h>
#include <algorithm>
#include <cmath>

#include "base/json_text.h"
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

namespace {

using Json = nlohmann::ordered_json;

std::string ByBlanks(const std::vector<std::string>& words) {
  std::string text;
  for (const std::string& word : words) text += (text.empty() ? "" : " ") + word;
  return text;
}

std::string Count(int n, const std::string& one, const std::string& many) {
  return fmt::format("{} {}", n, n == 1 ? one : many);
}

std::string HeadText(const Mechanism& mechanism, const Mobility& m) {
  const auto closures = std::count_if(mechanism.joints.begin(), mechanism.joints.end(),
                                      [](const Joint& joint) { return joint.closure; });
  std::string text =
      fmt::format("{}: {}\n  file: {}\n", mechanism.name, mechanism.description, mechanism.file);
  text += fmt::format("  {}, {} ({} {}), {}, {}\n",
                      Count(static_cast<int>(mechanism.bodies.size()) - 1, "body", "bodies"),
                      Count(static_cast<int>(mechanism.joints.size()), "joint", "joints"), closures,
                      closures == 1 ? "closes a loop" : "close loops",
                      Count(m.drives, "drive", "drives"),
                      Count(m.prescribed, "prescribed joint", "prescribed joints"));
  for (const Coupling& coupling : mechanism.couplings) {
    std::vector<std::string> joints;
    for (const Coupling::Term& term : coupling.terms) {
      joints.push_back(mechanism.joints[term.joint].name);
    }
    text += fmt::format("  coupling {}: {}\n", coupling.name, Joined(joints));
  }
  for (const ForceElement& element : mechanism.elements) {
    text += fmt::format("  element {}: {}\n", element.name, Described(mechanism, element));
  }
  return text;
}

std::string DofsText(const MobilityReport& report, bool coupled) {
  const Mobility& m = report.home;
  std::string text = fmt::format(
      "  degrees of freedom: {} = {} body coordinates - rank {} of {} joint{} constraints{}\n",
      m.dofs, m.body_coordinates, m.constraint_rank, m.constraint_rows,
      coupled ? " and coupling" : "",
      m.idle_spins.empty()
          ? ""
          : " - " + Count(static_cast<int>(m.idle_spins.size()), "idle spin", "idle spins"));
  double kept = m.smallest_kept, dropped = m.largest_dropped;
  for (const Mobility& near : report.nearby) {
    kept = std::min(kept, near.smallest_kept);
    dropped = std::max(dropped, near.largest_dropped);
  }
  if (report.home_singular()) {
    text += fmt::format(
        "  the home pose is singular: {} at home, {} at {} random poses nearby; choose guesses for "
        "another home\n",
        Count(m.dofs, "degree of freedom", "degrees of freedom"), report.dofs(),
        report.nearby.size());
  } else if (report.nearby.empty()) {
    text += "    by numerical rank at home";
  } else {
    text += fmt::format(
        "    by numerical rank at home and, with the same result, at {} random poses nearby",
        report.nearby.size());
  }
  if (!report.home_singular()) {
    text += fmt::format(";\n    smallest singular value kept {:.1e}, largest dropped {:.1e}\n",
                        kept, dropped);
  }
  return text;
}

// What turns between two balls.
std::string SpinText(const MobilityReport& report) {
  std::string text;
  for (const std::string& name : report.home.idle_spins) {
    text += fmt::format("  spin of {}, idle: no force turns it, and no command needs to\n", name);
  }
  for (const std::string& spin : report.spins_not_idle) {
    text +=
        fmt::format("  spin between two spherical joints that is a degree of freedom: {}\n", spin);
  }
  return text;
}

// Joints, then couplings.
std::vector<std::string> SharersOf(const StressGroup& group) {
  std::vector<std::string> names = group.joints;
  names.insert(names.end(), group.couplings.begin(), group.couplings.end());
  return names;
}

std::string RedundancyText(const MobilityReport& report) {
  const Mobility& m = report.home;
  std::string text = fmt::format(
      "  redundant constraints: {}; Kutzbach's count, which cannot see them, gives {} degrees of "
      "freedom\n",
      m.redundant, m.kutzbach);
  if (m.redundant == 0) {
    text = fmt::format("  redundant constraints: 0; Kutzbach's count is right\n");
  }
  for (const StressGroup& group : report.redundant) {
    text += fmt::format("    {} shared by {}\n", group.count, Joined(SharersOf(group)));
  }
  for (const LoopCount& loop : report.loops) {
    text +=
        fmt::format("  loop {}: {}, screws of rank {}{}\n", ByBlanks(loop.joints),
                    Count(loop.joint_dofs, "joint degree of freedom", "joint degrees of freedom"),
                    loop.screw_rank, loop.screw_rank == 3 ? " (planar or spherical)" : "");
  }
  return text;
}

std::string DrivenText(const MobilityReport& report) {
  const Mobility& m = report.home;
  if (m.undriven == 0) return "  drives and prescribed joints determine the motion\n";
  std::string text =
      fmt::format("  {} left when drives and prescribed joints are locked; {} can still move\n",
                  Count(m.undriven, "degree of freedom is", "degrees of freedom are"),
                  Joined(report.free_bodies));
  if (report.drives_singular()) {
    text += fmt::format(
        "  only at home: nearby the drives leave {}; the home pose is singular for these drives\n",
        Count(report.undriven(), "degree of freedom", "degrees of freedom"));
  }
  return text;
}

// Why the forces of a group are not unique.
std::string ReasonText(const StressGroup& group) {
  std::vector<std::string> all = group.drives;
  all.insert(all.end(), group.prescribed.begin(), group.prescribed.end());
  if (!all.empty()) {
    return fmt::format(
        "    {} hold each other: {} more than the degrees of freedom they share (through {})\n",
        Joined(all), Count(group.count, "drive", "drives"),
        SharersOf(group).empty() ? "no joint" : Joined(SharersOf(group)));
  }
  return fmt::format("    {} share {}: forces can act there against each other without any load\n",
                     Joined(SharersOf(group)),
                     Count(group.count, "redundant constraint", "redundant constraints"));
}

std::string ForcesText(const Mechanism& mechanism, const MobilityReport& report) {
  const std::vector<std::string>& drives = report.home.drives_not_unique;
  std::string text =
      drives.empty() ? "  drive forces: all determined by statics\n"
                     : "  drive forces: not determined by statics alone: " + Joined(drives) + "\n";
  if (report.home.reactions_not_unique.empty())
    return text + "  joint reactions: all determined by statics\n";
  text += fmt::format("  joint reactions: {} of {} joints not determined by statics alone\n",
                      report.home.reactions_not_unique.size(), mechanism.joints.size());
  for (const UndeterminedReaction& reaction : report.home.reactions_not_unique) {
    text += fmt::format("    {}: {}\n", reaction.joint, ByBlanks(reaction.components));
  }
  text += "  because\n";
  for (const StressGroup& group : report.undetermined) text += ReasonText(group);
  text +=
      "    `transmits: force` on a joint leaves its moments out and can make the rest definite\n";
  return text;
}

Json GroupsJson(const std::vector<StressGroup>& groups) {
  Json list = Json::array();
  for (const StressGroup& group : groups) {
    list.push_back({{"count", group.count},
                    {"joints", group.joints},
                    {"couplings", group.couplings},
                    {"drives", group.drives},
                    {"prescribed", group.prescribed}});
  }
  return list;
}

Json PoseJson(const Mobility& m) {
  return {{"dof", m.dofs},
          {"redundant", m.redundant},
          {"undriven", m.undriven},
          {"smallest_kept", m.smallest_kept},
          {"largest_dropped", m.largest_dropped},
          {"drives_not_unique", m.drives_not_unique},
          {"joints_not_unique", m.joints_not_unique}};
}

}  // namespace

std::string MobilityText(const Mechanism& mechanism, const MobilityReport& report) {
  std::string text = HeadText(mechanism, report.home) +
                     DofsText(report, !mechanism.couplings.empty()) + SpinText(report) +
                     RedundancyText(report) + DrivenText(report) + ForcesText(mechanism, report);
  text += "  drives:";
  for (const Drive& drive : mechanism.drives) text += " " + drive.name;
  text += "\n  outputs:";
  for (const Output& output : mechanism.outputs) text += " " + output.name;
  return text + "\n";
}

std::string MobilityJson(const Mechanism& mechanism, const MobilityReport& report) {
  Json json = {{"schema", "mbverify.model/1"},
               {"name", mechanism.name},
               {"file", mechanism.file},
               {"description", mechanism.description},
               {"bodies", mechanism.bodies.size() - 1},
               {"joints", mechanism.joints.size()},
               {"body_coordinates", report.home.body_coordinates},
               {"joint_constraints", report.home.constraint_rows},
               {"constraint_rank", report.home.constraint_rank},
               {"kutzbach", report.home.kutzbach},
               {"dof", report.dofs()},
               {"home_singular", report.home_singular()},
               {"drives_singular_at_home", report.drives_singular()}};
  json["drives"] = Json::array();
  for (const Drive& drive : mechanism.drives) json["drives"].push_back(drive.name);
  json["couplings"] = Json::array();
  for (const Coupling& coupling : mechanism.couplings) json["couplings"].push_back(coupling.name);
  json["elements"] = Json::array();
  for (const ForceElement& element : mechanism.elements) json["elements"].push_back(element.name);
  json["outputs"] = Json::array();
  for (const Output& output : mechanism.outputs) json["outputs"].push_back(output.name);
  json["home"] = PoseJson(report.home);
  json["nearby"] = Json::array();
  for (const Mobility& near : report.nearby) json["nearby"].push_back(PoseJson(near));
  json["free_bodies"] = report.free_bodies;
  json["idle_spins"] = report.home.idle_spins;
  json["spins_not_idle"] = report.spins_not_idle;
  json["loops"] = Json::array();
  for (const LoopCount& loop : report.loops) {
    json["loops"].push_back({{"closure", loop.closure},
                             {"joints", loop.joints},
                             {"joint_dof", loop.joint_dofs},
                             {"screw_rank", loop.screw_rank}});
  }
  json["redundant_constraints"] = GroupsJson(report.redundant);
  json["undetermined_forces"] = GroupsJson(report.undetermined);
  json["undetermined_reactions"] = Json::array();
  for (const UndeterminedReaction& reaction : report.home.reactions_not_unique) {
    json["undetermined_reactions"].push_back(
        {{"joint", reaction.joint}, {"components", reaction.components}});
  }
  return Dump(json);
}

}  // namespace mbv
