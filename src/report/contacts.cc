#include "report/contacts.h"

#include <fmt/format.h>
#include <algorithm>
#include <cmath>

#include "plot/svg_plot.h"

namespace mbv {
namespace {

using Json = nlohmann::ordered_json;
using Limit = ContactLoad::Limit;

// Of the witness that is shown first.
std::vector<const ContactLoad*> MainContactLoads(const Report& report) {
  const PairComparison* pair = report.comparison.MainPair();
  std::vector<const ContactLoad*> loads;
  for (const std::string& witness :
       {pair != nullptr ? pair->measured : "", pair != nullptr ? pair->truth : "",
        report.contact_loads.empty() ? "" : report.contact_loads.front().witness}) {
    for (const ContactLoad& load : report.contact_loads) {
      if (load.witness == witness) loads.push_back(&load);
    }
    if (!loads.empty()) break;
  }
  return loads;
}

Cell UseCell(const ContactLoad& load, Limit limit) {
  const ContactLoad::Use* use = load.Find(limit);
  if (use == nullptr) return "–";
  const Mark mark = use->exceeded() ? Mark::kWarn : Mark::kNone;
  switch (limit) {
    case Limit::kLift:
      return {fmt::format("{:.4g} N", use->worst), mark};
    case Limit::kSlip:
      return {std::isnan(use->allowed) ? fmt::format("{:.3g}", use->worst)
                                       : fmt::format("{:.3g} of {:.3g}", use->worst, use->allowed),
              mark};
    case Limit::kTip:
      return {fmt::format("{:.3g} mm", 1e3 * use->worst), mark};
    case Limit::kTwist:
      return {std::isnan(use->allowed)
                  ? fmt::format("{:.3g} mm", 1e3 * use->worst)
                  : fmt::format("{:.3g} of {:.3g} mm", 1e3 * use->worst, 1e3 * use->allowed),
              mark};
    case Limit::kFall:
      return {std::isinf(use->worst) ? "any fails" : fmt::format("{:.3g} × stated", use->worst),
              mark};
  }
  return "–";
}

std::string HoldText(const ContactLoad& load) {
  std::string text;
  for (const ContactLoad::Use& use : load.uses) {
    if (!use.exceeded()) continue;
    text += fmt::format("{}{}s from {:.4g} s on", text.empty() ? "" : ", ", ToText(use.limit),
                        use.from_s);
  }
  if (text.empty()) text = "holds";
  return load.unique() ? text : text + " (one share of many)";
}

// Lengths in millimetres.
std::string PressureSvg(const ContactLoad& load) {
  LinePlot plot{.title = load.name() + ": centre of pressure",
                .x_label = "x [mm]",
                .y_label = "y [mm]",
                .lines = {}};
  PlotLine outline{.label = "ground contact", .points = {}};
  for (const Eigen::Vector2d& p : load.outline) {
    outline.points.emplace_back(1e3 * p.x(), 1e3 * p.y());
  }
  if (outline.points.size() > 2) outline.points.push_back(outline.points.front());
  PlotLine path{.label = load.witness, .points = {}};
  const size_t stride = 1 + load.pressure.size() / 1500;
  for (size_t i = 0; i < load.pressure.size(); i += stride) {
    path.points.emplace_back(1e3 * load.pressure[i].x(), 1e3 * load.pressure[i].y());
  }
  plot.lines = {std::move(outline), std::move(path)};
  return ToSvg(plot);
}

}  // namespace

ReportSection ContactSection(const Report& report) {
  ReportSection section{.title = "Feet on the ground", .link = "Contacts"};
  const std::vector<const ContactLoad*> loads = MainContactLoads(report);
  if (loads.empty()) return section;
  Table table{.name = "contacts",
              .caption = "Feet on the ground, " + loads.front()->witness,
              .columns = {Text("foot"), Text("kind"), Digits("normal force, least"), Digits("most"),
                          Digits("friction needed"), Digits("centre of pressure inside by"),
                          Spare(Digits("twist")), Text("")}};
  for (const ContactLoad* load : loads) {
    const bool exceeded =
        std::ranges::any_of(load->uses, [](const ContactLoad::Use& use) { return use.exceeded(); });
    table.rows.push_back({load->name(), load->kind, UseCell(*load, Limit::kLift),
                          std::isnan(load->most_normal)
                              ? Cell("–")
                              : Cell(fmt::format("{:.4g} N", load->most_normal)),
                          UseCell(*load, load->Find(Limit::kFall) ? Limit::kFall : Limit::kSlip),
                          UseCell(*load, Limit::kTip), UseCell(*load, Limit::kTwist),
                          Cell(HoldText(*load), exceeded ? Mark::kWarn : Mark::kOk)});
  }
  section.Add(std::move(table));
  const bool shared =
      std::ranges::any_of(loads, [](const ContactLoad* load) { return !load->unique(); });
  const bool together = loads.back()->contact.empty();
  if (shared) {
    section.Note(
        fmt::format("Statics leaves open what the feet share of the forces: of all shares "
                    "the one with the least drive forces is shown.{}",
                    together ? " What all feet bear together follows from the motion." : ""),
        On::kAll);
  }
  if (loads.size() > 1 && !together) {
    section.Note(
        "What all feet bear together is not judged: something else ties the robot to the ground, "
        "or they do not stand on one plane and some state no friction or size.",
        On::kAll);
  }
  for (const ContactLoad* load : loads) {
    if (load->outline.size() > 2 && !load->pressure.empty()) {
      section.Add(Drawing{PressureSvg(*load)}, On::kPage);
    }
  }
  section.Note(
      "Both computations hold the feet; whether the ground can is judged here. Ground only pushes; "
      "friction needed is the tangential over the normal force; the centre of pressure must stay "
      "within what touches the ground.");
  return section;
}

Json ContactsJson(const Report& report) {
  Json contacts = Json::array();
  for (const ContactLoad& load : report.contact_loads) {
    Json limits = Json::array();
    for (const ContactLoad::Use& use : load.uses) {
      limits.push_back({{"of", ToText(use.limit)},
                        {"worst", Number(use.worst)},
                        {"time_s", Number(use.time_s)},
                        {"allowed", Number(use.allowed)},
                        {"exceeded", use.exceeded()},
                        {"unique", use.unique},
                        {"from_s", Number(use.from_s)},
                        {"samples", use.beyond}});
    }
    contacts.push_back({{"contact", load.contact},
                        {"kind", load.kind},
                        {"witness", load.witness},
                        {"most_normal_N", Number(load.most_normal)},
                        {"mean_normal_N", Number(load.mean_normal)},
                        {"limits", std::move(limits)}});
  }
  return contacts;
}

}  // namespace mbv
