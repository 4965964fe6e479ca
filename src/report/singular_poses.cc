#include "report/singular_poses.h"

#include <fmt/format.h>
#include <array>

#include "base/text.h"

namespace mbv {
namespace {

const char* Called(SingularityKind kind) {
  constexpr std::array<const char*, 3> kWords = {"inverse (type 1)", "forward (type 2)",
                                                 "constraint"};
  return kWords.at(static_cast<size_t>(kind));
}

const char* Consequence(SingularityKind kind) {
  constexpr std::array<const char*, 3> kWords = {
      "the mechanism moves while what is commanded rests: the command asks for high speeds",
      "the mechanism moves while the drives rest: drive forces grow",
      "the joints alone lose their hold: reactions grow"};
  return kWords.at(static_cast<size_t>(kind));
}

std::string ForceText(const SingularApproach& approach) {
  if (approach.drive.empty()) return "";
  return fmt::format("{}: {:.3g} {} near, median {:.3g} {}", approach.drive, approach.force_near,
                     approach.unit, approach.force_median, approach.unit);
}

}  // namespace

ReportSection SingularitySection(const Report& report, bool verbose) {
  ReportSection section{.title = "Singular poses", .link = "Singularities"};
  const SingularApproaches& approaches = report.singular;
  if (approaches.of.empty()) return section;
  bool any = verbose;
  Table table{.name = "singularities",
              .caption = "How near the motion comes to singular poses",
              .columns = {Text("kind"), Digits("least distance"), Digits("at"), Digits("median"),
                          Text("moves most"), Spare(Text("largest drive force"))}};
  for (const SingularApproach& approach : approaches.of) {
    const bool warns = approach.asked && approach.close();
    any = any || warns;
    table.rows.push_back(
        {Called(approach.kind),
         Cell(fmt::format("{:.3g}", approach.distance), warns ? Mark::kWarn : Mark::kNone),
         fmt::format("{:.4g} s", approach.time_s), fmt::format("{:.3g}", approach.median),
         approach.body, ForceText(approach)});
  }
  section.Add(std::move(table), any ? On::kAll : On::kPage);
  section.Note(fmt::format(
      "Least speed of coordinates (inverse{}), of the drives (forward), or with which loops "
      "would open (constraint), by that of the bodies: the root mean square over them of the speed "
      "at the middle of a body's joints and its rotation by the characteristic length {:.4g} m. 0 "
      "is singular, below {:g} is close. {} poses were measured.",
      approaches.inverse_of.empty() ? "" : ": " + Joined(approaches.inverse_of),
      approaches.length_m, kCloseToSingular, approaches.poses));
  return section;
}

nlohmann::ordered_json SingularityJson(const Report& report) {
  auto list = nlohmann::ordered_json::array();
  for (const SingularApproach& approach : report.singular.of) {
    nlohmann::ordered_json json = {{"kind", ToText(approach.kind)},
                                   {"distance", Number(approach.distance)},
                                   {"time_s", Number(approach.time_s)},
                                   {"median", Number(approach.median)},
                                   {"close", approach.close()},
                                   {"asked", approach.asked},
                                   {"body", approach.body}};
    if (!approach.drive.empty()) {
      json["force"] = {{"drive", approach.drive},
                       {"unit", approach.unit},
                       {"near", Number(approach.force_near)},
                       {"median", Number(approach.force_median)}};
    }
    list.push_back(std::move(json));
  }
  return {{"length_m", Number(report.singular.length_m)},
          {"close_below", kCloseToSingular},
          {"poses", report.singular.poses},
          {"inverse_of", report.singular.inverse_of},
          {"least", std::move(list)}};
}

std::vector<std::string> SingularityWarnings(const SingularApproaches& approaches) {
  std::vector<std::string> warnings;
  for (const SingularApproach& approach : approaches.of) {
    if (!approach.asked || !approach.close()) continue;
    const std::string forces = ForceText(approach);
    warnings.push_back(fmt::format(
        "close to a singular pose, {}, at t = {:.4g} s: distance {:.2g}, median {:.2g}; {}{}",
        Called(approach.kind), approach.time_s, approach.distance, approach.median,
        Consequence(approach.kind), forces.empty() ? "" : " (" + forces + ")"));
  }
  return warnings;
}

}  // namespace mbv
