#include "report/mobility_text.h"

#include <fmt/format.h>

#include <algorithm>

#include "base/json_text.h"

namespace mbv {
namespace {

using Json = nlohmann::ordered_json;

std::string Joined(const std::vector<std::string>& words, const char* between = ", ") {
  std::string text;
  for (const std::string& word : words) text += (text.empty() ? "" : between) + word;
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
        "    by numerical rank at home and, with the same result, at {} random "
        "poses nearby",
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
    text += fmt::format("  spin between two balls that is a degree of freedom: {}\n", spin);
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
        fmt::format("  loop {}: {}, screws of rank {}{}\n", Joined(loop.joints, " "),
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
    text += fmt::format("    {}: {}\n", reaction.joint, Joined(reaction.components, " "));
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
