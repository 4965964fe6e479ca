#include "report/upgrade.h"

#include <fmt/format.h>

#include <algorithm>

#include "core/json_text.h"
#include "report/text_table.h"

namespace mbv {
namespace {

// "1" where nothing but round-off differs, else the range of the ratio.
std::string RatioText(const RowChange& change) {
  const std::string least = fmt::format("{:.4g}", change.softness_least);
  const std::string most = fmt::format("{:.4g}", change.softness_most);
  return least == most ? least : least + " … " + most;
}

std::string LoadingText(const UpgradeReport& report) {
  if (report.messages.empty()) return "  loads without a message\n";
  std::string text = "  says while loading:\n";
  for (const std::string& message : report.messages) text += "    " + message + "\n";
  return text;
}

std::string RowsText(const UpgradeReport& report) {
  const TextTable table("  ", {{fmt::format("rows at {} states", report.states), -20},
                               {"rows", 5},
                               {"softness, new/old", 20},
                               {"|dJ/dt qdot|", 14},
                               {"left out, old", 15},
                               {"new", 9}});
  std::string text = table.Head() + "\n";
  for (const RowChange& change : report.rows) {
    text += table.Row({change.kind, fmt::format("{}", change.rows), RatioText(change),
                       fmt::format("{:.2g}", change.velocity_term),
                       fmt::format("{:.2g}", change.left_out_old),
                       fmt::format("{:.2g}", change.left_out_new)}) +
            "  " + change.why + "\n";
  }
  return text;
}

std::string NumberOr(double number, const char* unit, const std::string& why) {
  if (!why.empty() || std::isnan(number)) return "–";
  return fmt::format("{:.1e}{}", number, unit);
}

std::string ForcesText(const UpgradeReport& report) {
  const std::string heading = "RMS error of all drive forces";
  size_t width = heading.size();
  for (const ForceChange& change : report.forces) width = std::max(width, change.how.size());
  const TextTable table("  ", {{heading, -static_cast<int>(width)},
                               {report.version_old, 12},
                               {report.version_new, 12},
                               {"loop gap, old", 15},
                               {"new", 12}});
  std::string text = table.Head() + "\n";
  for (const ForceChange& change : report.forces) {
    text += table.Row({change.how, NumberOr(change.nrmse_old, "", change.why_old),
                       NumberOr(change.nrmse_new, "", change.why_new),
                       NumberOr(change.gap_old_m, " m", change.why_old),
                       NumberOr(change.gap_new_m, " m", change.why_new)}) +
            "\n";
    for (const std::string& why : {change.why_old, change.why_new}) {
      if (!why.empty()) text += "    " + why + "\n";
    }
  }
  return text;
}

nlohmann::ordered_json RowJson(const RowChange& change) {
  return {{"kind", change.kind},
          {"rows", change.rows},
          {"softness_ratio", {Number(change.softness_least), Number(change.softness_most)}},
          {"velocity_term", Number(change.velocity_term)},
          {"left_out", {Number(change.left_out_old), Number(change.left_out_new)}},
          {"why", change.why}};
}

nlohmann::ordered_json ForceJson(const ForceChange& change) {
  return {{"how", change.how},
          {"force_nrmse", {Number(change.nrmse_old), Number(change.nrmse_new)}},
          {"loop_gap_m", {Number(change.gap_old_m), Number(change.gap_new_m)}},
          {"why", {change.why_old, change.why_new}}};
}

}  // namespace

std::string ToText(const UpgradeReport& report) {
  std::string text = fmt::format("{}/{}: the generated model in MuJoCo {}", report.mechanism,
                                 report.scenario, report.version_old);
  if (!report.unavailable.empty()) {
    return text + ", and another version that did not answer: " + report.unavailable + "\n";
  }
  text += fmt::format(" and {}\n", report.version_new);
  return text + LoadingText(report) + RowsText(report) + ForcesText(report);
}

std::string ToJson(const std::vector<UpgradeReport>& reports) {
  auto list = nlohmann::ordered_json::array();
  for (const UpgradeReport& report : reports) {
    auto rows = nlohmann::ordered_json::array(), forces = nlohmann::ordered_json::array();
    for (const RowChange& change : report.rows) rows.push_back(RowJson(change));
    for (const ForceChange& change : report.forces) forces.push_back(ForceJson(change));
    list.push_back({{"mechanism", report.mechanism},
                    {"scenario", report.scenario},
                    {"versions", {report.version_old, report.version_new}},
                    {"unavailable", report.unavailable},
                    {"messages", report.messages},
                    {"states", report.states},
                    {"rows", std::move(rows)},
                    {"forces", std::move(forces)}});
  }
  return Dump({{"schema", "mbverify.upgrade/1"}, {"results", std::move(list)}});
}

}  // namespace mbv
