#include "report/sizing.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "plot/svg_plot.h"
#include "report/page.h"

namespace mbv {
namespace {

using Json = nlohmann::ordered_json;

std::string Percent(double share) {
  return std::isfinite(share) ? fmt::format("{:.3g} %", 100.0 * share) : "–";
}

std::string WithUnit(double value, const std::string& unit) {
  return std::isfinite(value) ? fmt::format("{:.5g} {}", value, unit) : "–";
}

std::string MarginText(const MotorLoad& load) {
  const double use = load.largest_use();
  if (std::isnan(use)) {
    if (load.unresolved.empty()) return "no limit is stated";
    return "no limit is stated; torque, power and energy not known: " + load.unresolved;
  }
  if (use == 0.0 && load.unresolved.empty()) return "not used at all";
  const std::string margin = fmt::format("{:.3g} ({})", 1.0 / use, load.limited_by());
  if (load.unresolved.empty()) return "margin " + margin;
  return fmt::format("margin not known: {}; at the samples alone {}", load.unresolved, margin);
}

std::string UsesText(const std::vector<MotorLoad::Use>& uses) {
  std::string text;
  for (const MotorLoad::Use& use : uses) {
    text += fmt::format("{}{} {}", text.empty() ? "" : ", ", use.of, Percent(use.use));
  }
  return text.empty() ? "–" : text;
}

std::string AtRestText(const MotorLoad& load) {
  return fmt::format("friction rests at {} of {} samples: the worse end of the band counts",
                     load.samples_at_rest, load.time_s.size());
}

std::string Celsius(double value) {
  return std::isinf(value) ? "without end" : WithUnit(value, "°C");
}

std::string OverheatedText(const MotorLoad& load) {
  return fmt::format("repeated from ambient temperature, it is too hot after {}",
                     WithUnit(load.overheated_s, "s"));
}

// What winding, gearbox and brake bear, where the motor states them.
std::vector<std::string> MoreLines(const MotorLoad& load) {
  std::vector<std::string> lines;
  if (!std::isnan(load.winding_peak_C)) {
    lines.push_back(fmt::format("winding of the repeated motion: at most {}, housing {}",
                                Celsius(load.winding_peak_C), Celsius(load.housing_peak_C)));
    if (!std::isnan(load.overheated_s)) lines.back() += "; " + OverheatedText(load);
  }
  const std::string& t = load.torque_unit;
  if (!std::isnan(load.gear_torque)) {
    lines.push_back(fmt::format("gearbox, at its output: peak {}, mean {}, emergency {}",
                                WithUnit(load.gear_torque, t), WithUnit(load.gear_mean_torque, t),
                                WithUnit(load.gear_emergency_torque, t)));
  }
  if (!std::isnan(load.holding_torque)) {
    lines.push_back(fmt::format(
        "brake: holds {}, one stop {}", WithUnit(load.holding_torque, t),
        std::isinf(load.stop_energy_J) ? "is not possible" : WithUnit(load.stop_energy_J, "J")));
  }
  return lines;
}

std::string LinkText(const LinkLoad& load, bool details) {
  const MotorLoad::Use* use = LargestUse(load.uses);
  std::string text = use == nullptr    ? "no limit is stated"
                     : use->use == 0.0 ? "its resistor is not used"
                                       : fmt::format("margin {:.3g} ({})", 1.0 / use->use, use->of);
  if (!load.unresolved.empty()) text = "not known: " + load.unresolved;
  if (!details) return "DC link: " + text;
  return fmt::format(
      "DC link: {}\n  drawn {} per cycle, at most {}; fed back {}: capacitor {}, resistor {}\n"
      "  resistor: mean {}, peak {}; used: {}",
      text, WithUnit(load.drawn_J, "J"), WithUnit(load.peak_power, "W"),
      WithUnit(load.fed_back_J, "J"), WithUnit(load.capacitor_J, "J"),
      WithUnit(load.resistor_J, "J"), WithUnit(load.resistor_mean, "W"),
      WithUnit(load.resistor_peak, "W"), UsesText(load.uses));
}

PlotLine OverTime(const std::string& label, const std::vector<double>& time_s, const VecX& values) {
  PlotLine line{.label = label};
  const size_t rows = std::min(time_s.size(), static_cast<size_t>(values.size()));
  for (size_t i = 0; i < rows; ++i) {
    line.points.emplace_back(time_s[i], values[static_cast<Eigen::Index>(i)]);
  }
  return line;
}

std::string OverTimeHtml(const std::string& title, const std::string& y_label,
                         std::vector<PlotLine> lines) {
  return FigureHtml(ToSvg(LinePlot{
      .title = title, .x_label = "time [s]", .y_label = y_label, .lines = std::move(lines)}));
}

std::string WindingHtml(const MotorLoad& load) {
  return OverTimeHtml(load.drive + ": winding over a cycle of the repeated motion",
                      "temperature [°C]", {OverTime(load.witness, load.time_s, load.winding_C)});
}

// What the brake holds at each pose of the motion.
std::string HoldingHtml(const Motor& motor, const MotorLoad& load, const VecX& force) {
  const VecX holds = force.cwiseAbs() * (motor.efficiency / motor.gear_ratio);
  const VecX limit = VecX::Constant(holds.size(), motor.brake->torque);
  return OverTimeHtml(
      load.drive + ": torque that holds it at rest, at the brake",
      fmt::format("|torque| [{}]", load.torque_unit),
      {OverTime("needed", load.time_s, holds), OverTime("brake", load.time_s, limit)});
}

std::string ElectricHtml(const std::vector<const MotorLoad*>& loads, const LinkLoad& link) {
  std::vector<PlotLine> lines;
  lines.reserve(loads.size() + 1);
  for (const MotorLoad* load : loads) {
    lines.push_back(OverTime(load->drive, load->time_s, load->electric_W));
  }
  lines.push_back(OverTime("DC link", loads.front()->time_s, link.power));
  return OverTimeHtml("Electrical power of the drives and of their DC link", "power [W]",
                      std::move(lines));
}

Table FiguresTable(const std::vector<const MotorLoad*>& loads) {
  Table html{
      .caption = "Motors, " + loads.front()->witness,
      .columns = {Text("drive"), Digits("margin"), Text("share of each limit"),
                  Digits("torque, peak"), Digits("RMS"), Digits("mean"), Digits("continuous limit"),
                  Digits("speed, peak"), Digits("mean"), Digits("power, driving"),
                  Digits("braking"), Digits("energy per cycle"), Digits("braking"), Digits("duty"),
                  Digits("inertia ratio")},
  };
  for (const MotorLoad* load : loads) {
    const std::string &t = load->torque_unit, &s = load->speed_unit;
    html.rows.push_back({load->drive, NumberOrDash(load->margin(), "{:.3g}"), UsesText(load->uses),
                         WithUnit(load->peak_torque, t), WithUnit(load->rms_torque, t),
                         WithUnit(load->mean_torque, t), WithUnit(load->continuous_torque, t),
                         WithUnit(load->peak_speed, s), WithUnit(load->mean_speed, s),
                         WithUnit(load->peak_power, "W"), WithUnit(load->peak_brake_power, "W"),
                         WithUnit(load->energy_J, "J"), WithUnit(load->brake_energy_J, "J"),
                         Percent(load->duty), NumberOrDash(load->inertia_ratio, "{:.3g}")});
  }
  return html;
}

// A limit over speed: its curve, or the constant up to the highest speed.
PlotLine CurveOf(const Motor& motor, bool peak, double top_speed) {
  const std::vector<CurvePoint>& curve = peak ? motor.peak_curve : motor.continuous_curve;
  PlotLine line{.label = peak ? "peak" : "continuous"};
  if (!curve.empty()) {
    for (const CurvePoint& point : curve) line.points.emplace_back(point.speed, point.torque);
  } else if (const double torque = peak ? motor.peak : motor.continuous; std::isfinite(torque)) {
    const double end = std::isfinite(motor.max_speed) ? motor.max_speed : top_speed;
    line.points = {{0.0, torque}, {end, torque}};
    if (std::isfinite(motor.max_speed)) line.points.emplace_back(end, 0.0);
  }
  return line;
}

std::string CloudHtml(const Motor& motor, const MotorLoad& load) {
  LinePlot plot{.title = load.drive + ": torque over speed, at the motor",
                .x_label = "|speed| [" + load.speed_unit + "]",
                .y_label = "|torque| [" + load.torque_unit + "]"};
  PlotLine cloud{.label = load.witness};
  const Eigen::Index stride = 1 + load.torque.size() / 1500;
  for (Eigen::Index i = 0; i < load.torque.size(); i += stride) {
    cloud.points.emplace_back(std::abs(load.speed[i]), std::abs(load.torque[i]));
  }
  plot.lines = {std::move(cloud),
                {.label = "mean speed, RMS torque",
                 .points = {{load.mean_speed, load.rms_torque}},
                 .markers = true}};
  for (const bool peak : {false, true}) {
    PlotLine line = CurveOf(motor, peak, 1.05 * load.peak_speed);
    if (!line.points.empty()) plot.lines.push_back(std::move(line));
  }
  for (const auto& [label, torque] :
       {std::pair("peak, forward", motor.most), {"peak, backward", -motor.least}}) {
    if (!std::isfinite(torque)) continue;
    plot.lines.push_back(
        {.label = label, .points = {{0.0, torque}, {1.05 * load.peak_speed, torque}}});
  }
  return FigureHtml(ToSvg(plot));
}

const Motor* MotorOf(const Report& report, const MotorLoad& load) {
  for (const Motor& motor : report.motors) {
    if (report.drives[static_cast<size_t>(motor.drive)] == load.drive) return &motor;
  }
  return nullptr;
}

void Keep(double value, const std::string& scenario, MotorEnvelope::Most* most) {
  if (std::abs(value) > most->value) *most = {std::abs(value), scenario};
}

Json UsesJson(const std::vector<MotorLoad::Use>& given) {
  Json uses = Json::array();
  for (const MotorLoad::Use& use : given) {
    uses.push_back({{"of", use.of}, {"use", Number(use.use)}, {"time_s", Number(use.time_s)}});
  }
  return uses;
}

Json MostJson(const MotorEnvelope::Most& most) {
  return {{"value", Number(most.value)}, {"scenario", most.scenario}};
}

}  // namespace

std::vector<const MotorLoad*> MainMotorLoads(const Report& report) {
  const PairComparison* pair = report.comparison.MainPair();
  std::string witness = pair != nullptr ? pair->measured : "";
  if (witness.empty() && !report.motor_loads.empty()) witness = report.motor_loads.front().witness;
  std::vector<const MotorLoad*> loads;
  for (const MotorLoad& load : report.motor_loads) {
    if (load.witness == witness) loads.push_back(&load);
  }
  return loads;
}

void AddMotorLoads(const Mechanism& mechanism, const WitnessRecord& record,
                   const std::string& unresolved, Report* report) {
  std::vector<MotorLoad> loads = MotorLoadsOf(mechanism, record.trace, report->drive_facts);
  for (MotorLoad& load : loads) load.witness = record.name, load.unresolved = unresolved;
  if (mechanism.dc_link) {
    if (auto link = LinkLoadOf(*mechanism.dc_link, loads)) {
      report->link_loads.push_back(*std::move(link));
    }
  }
  std::ranges::move(loads, std::back_inserter(report->motor_loads));
}

const LinkLoad* MainLinkLoad(const Report& report) {
  const std::vector<const MotorLoad*> loads = MainMotorLoads(report);
  for (const LinkLoad& load : report.link_loads) {
    if (!loads.empty() && load.witness == loads.front()->witness) return &load;
  }
  return nullptr;
}

std::vector<std::string> SizingLines(const Report& report, bool details) {
  std::vector<std::string> lines;
  for (const MotorLoad* load : MainMotorLoads(report)) {
    const std::string &t = load->torque_unit, &s = load->speed_unit;
    lines.push_back(fmt::format("motor of {}: {}", load->drive, MarginText(*load)));
    if (!details) continue;
    if (!load->unresolved.empty()) {
      lines.push_back("  not known between the samples; at the samples alone:");
    }
    lines.push_back(fmt::format("  torque: peak {}, RMS {}, mean {}; continuous limit {}",
                                WithUnit(load->peak_torque, t), WithUnit(load->rms_torque, t),
                                WithUnit(load->mean_torque, t),
                                WithUnit(load->continuous_torque, t)));
    lines.push_back(
        fmt::format("  speed: peak {}, mean {}; in motion {} of the time, above the "
                    "continuous torque {}",
                    WithUnit(load->peak_speed, s), WithUnit(load->mean_speed, s),
                    Percent(load->duty), Percent(load->above_continuous)));
    lines.push_back(
        fmt::format("  power: driving {}, braking {}; energy per cycle {} and {}",
                    WithUnit(load->peak_power, "W"), WithUnit(load->peak_brake_power, "W"),
                    WithUnit(load->energy_J, "J"), WithUnit(load->brake_energy_J, "J")));
    if (std::isfinite(load->rms_current)) {
      lines.push_back(
          fmt::format("  current: peak {}, RMS {}; voltage {}; fed back per cycle {}",
                      WithUnit(load->peak_current, "A"), WithUnit(load->rms_current, "A"),
                      WithUnit(load->peak_voltage, "V"), WithUnit(load->fed_back_J, "J")));
    }
    if (std::isfinite(load->inertia_ratio)) {
      lines.push_back(
          fmt::format("  load inertia / rotor inertia at home: {:.3g}", load->inertia_ratio));
    }
    if (load->samples_at_rest > 0) lines.push_back("  " + AtRestText(*load));
    for (const std::string& line : MoreLines(*load)) lines.push_back("  " + line);
    lines.push_back("  used: " + UsesText(load->uses));
  }
  if (const LinkLoad* link = MainLinkLoad(report)) lines.push_back(LinkText(*link, details));
  return lines;
}

std::string SizingHtml(const Report& report) {
  const std::vector<const MotorLoad*> loads = MainMotorLoads(report);
  if (loads.empty()) return "";
  std::string html = ToHtml(FiguresTable(loads));
  for (const MotorLoad* load : loads) {
    const Motor* motor = MotorOf(report, *load);
    if (!load->unresolved.empty()) html += Note(load->drive + ": " + MarginText(*load) + ".");
    if (load->samples_at_rest > 0) html += Note(load->drive + ": " + AtRestText(*load) + ".");
    for (const std::string& line : MoreLines(*load)) html += Note(load->drive + ": " + line + ".");
    if (motor != nullptr && load->known()) html += CloudHtml(*motor, *load);
    if (load->winding_C.size() > 0) html += WindingHtml(*load);
    if (motor == nullptr || std::isnan(load->holding_torque)) continue;
    const auto k = static_cast<size_t>(motor - report.motors.data());
    if (k < report.drive_facts.size()) {
      html += HoldingHtml(*motor, *load, report.drive_facts[k].at_rest.force);
    }
  }
  if (const LinkLoad* link = MainLinkLoad(report)) {
    html += Note(LinkText(*link, true) + ".") + ElectricHtml(loads, *link);
  }
  return html +
         Note(
             "At the motor: behind gear and rotor. Continuous: RMS torque against what the motor "
             "bears at its mean speed; peak: every sample against the curve at its own speed. "
             "The margin is 1 over the largest share.");
}

Json SizingJson(const Report& report) {
  Json motors = Json::array();
  for (const MotorLoad& load : report.motor_loads) {
    motors.push_back(
        {{"drive", load.drive},
         {"witness", load.witness},
         {"torque",
          {{"unit", load.torque_unit},
           {"peak", Number(load.peak_torque)},
           {"rms", Number(load.rms_torque)},
           {"mean", Number(load.mean_torque)},
           {"continuous_limit", Number(load.continuous_torque)},
           {"above_continuous", Number(load.above_continuous)}}},
         {"speed",
          {{"unit", load.speed_unit},
           {"peak", Number(load.peak_speed)},
           {"mean", Number(load.mean_speed)},
           {"duty", Number(load.duty)}}},
         {"power_W",
          {{"peak", Number(load.peak_power)}, {"braking", Number(load.peak_brake_power)}}},
         {"energy_J",
          {{"driving", Number(load.energy_J)}, {"braking", Number(load.brake_energy_J)}}},
         {"current_A", {{"peak", Number(load.peak_current)}, {"rms", Number(load.rms_current)}}},
         {"voltage_V", Number(load.peak_voltage)},
         {"electric",
          {{"peak_W", Number(load.electric_W.size() > 0 ? load.electric_W.maxCoeff() : kNan)},
           {"least_W", Number(load.electric_W.size() > 0 ? load.electric_W.minCoeff() : kNan)},
           {"fed_back_J", Number(load.fed_back_J)}}},
         {"winding",
          {{"peak_C", Number(load.winding_peak_C)},
           {"housing_peak_C", Number(load.housing_peak_C)},
           {"overheated_s", Number(load.overheated_s)}}},
         {"gearbox",
          {{"peak", Number(load.gear_torque)},
           {"mean", Number(load.gear_mean_torque)},
           {"emergency", Number(load.gear_emergency_torque)}}},
         {"brake",
          {{"holding", Number(load.holding_torque)}, {"stop_J", Number(load.stop_energy_J)}}},
         {"inertia_ratio", Number(load.inertia_ratio)},
         {"samples_at_rest", load.samples_at_rest},
         {"unresolved", load.unresolved},
         {"uses", UsesJson(load.uses)},
         {"limited_by", load.limited_by()},
         {"margin", Number(load.margin())}});
  }
  return motors;
}

Json LinkJson(const Report& report) {
  Json links = Json::array();
  for (const LinkLoad& load : report.link_loads) {
    const MotorLoad::Use* use = LargestUse(load.uses);
    links.push_back({{"witness", load.witness},
                     {"peak_W", Number(load.peak_power)},
                     {"drawn_J", Number(load.drawn_J)},
                     {"fed_back_J", Number(load.fed_back_J)},
                     {"capacitor_J", Number(load.capacitor_J)},
                     {"resistor_J", Number(load.resistor_J)},
                     {"resistor_W",
                      {{"mean", Number(load.resistor_mean)}, {"peak", Number(load.resistor_peak)}}},
                     {"unresolved", load.unresolved},
                     {"uses", UsesJson(load.uses)},
                     {"limited_by", use == nullptr ? "" : use->of},
                     {"margin", Number(use == nullptr ? kNan : 1.0 / use->use)}});
  }
  return links;
}

void Widen(const Report& report, std::vector<MotorEnvelope>* envelopes) {
  const std::string& scenario = report.scenario;
  for (const MotorLoad* load : MainMotorLoads(report)) {
    auto found = std::find_if(envelopes->begin(), envelopes->end(),
                              [&](const MotorEnvelope& e) { return e.drive == load->drive; });
    if (found == envelopes->end()) {
      found = envelopes->insert(
          envelopes->end(),
          {.drive = load->drive, .torque_unit = load->torque_unit, .speed_unit = load->speed_unit});
    }
    if (!load->unresolved.empty()) {
      found->unresolved += fmt::format("{}{}: {}", found->unresolved.empty() ? "" : "; ", scenario,
                                       load->unresolved);
    }
    Keep(load->peak_torque, scenario, &found->peak_torque);
    Keep(load->rms_torque, scenario, &found->rms_torque);
    Keep(load->peak_speed, scenario, &found->peak_speed);
    Keep(load->peak_power, scenario, &found->peak_power);
    Keep(load->peak_brake_power, scenario, &found->brake_power);
    if (load->uses.empty()) continue;
    found->limited = true;
    if (load->largest_use() > found->use.value) found->limited_by = load->limited_by();
    Keep(load->largest_use(), scenario, &found->use);
  }
}

void Widen(const LinkLoad& load, const std::string& scenario,
           std::optional<LinkEnvelope>* envelope) {
  if (!*envelope) envelope->emplace();
  LinkEnvelope* e = &**envelope;
  Keep(load.fed_back_J, scenario, &e->fed_back_J);
  Keep(load.resistor_mean, scenario, &e->resistor_mean);
  Keep(load.resistor_peak, scenario, &e->resistor_peak);
  const MotorLoad::Use* use = LargestUse(load.uses);
  if (use == nullptr) return;
  e->limited = true;
  if (use->use > e->use.value) e->limited_by = use->of;
  Keep(use->use, scenario, &e->use);
}

Table EnvelopeTable(const std::vector<MotorEnvelope>& envelopes) {
  Table table{.columns = {Text("drive"), Digits("peak torque"), Digits("RMS torque"),
                          Digits("peak speed"), Digits("driving"), Digits("braking"),
                          Digits("margin"), Text("by")}};
  for (const MotorEnvelope& e : envelopes) {
    table.rows.push_back({e.drive, WithUnit(e.peak_torque.value, e.torque_unit),
                          WithUnit(e.rms_torque.value, e.torque_unit),
                          WithUnit(e.peak_speed.value, e.speed_unit),
                          WithUnit(e.peak_power.value, "W"), WithUnit(e.brake_power.value, "W"),
                          e.limited ? fmt::format("{:.3g}", e.margin()) : "–",
                          e.limited ? fmt::format("{}, {}", e.limited_by, e.use.scenario) : ""});
  }
  return table;
}

std::string ToText(const std::vector<MotorEnvelope>& envelopes) {
  std::string text = ToText(EnvelopeTable(envelopes), {.indent = ""});
  for (const MotorEnvelope& e : envelopes) {
    if (e.unresolved.empty()) continue;
    text += fmt::format("{}: torque, power and margin not known between the samples: {}\n", e.drive,
                        e.unresolved);
  }
  return text;
}

std::string ToText(const LinkEnvelope& link) {
  const auto most = [](const MotorEnvelope::Most& m, const char* unit) {
    return WithUnit(m.value, unit) + (m.scenario.empty() ? "" : " (" + m.scenario + ")");
  };
  return fmt::format(
      "DC link: fed back {}, resistor mean {}, peak {}; margin {}\n", most(link.fed_back_J, "J"),
      most(link.resistor_mean, "W"), most(link.resistor_peak, "W"),
      !link.limited ? "–"
      : link.limited_by.empty()
          ? "–, not used"
          : fmt::format("{:.3g} ({}, {})", link.margin(), link.limited_by, link.use.scenario));
}

std::string ToJson(const std::vector<MotorEnvelope>& envelopes,
                   const std::optional<LinkEnvelope>& link,
                   const std::vector<std::string>& scenarios) {
  Json motors = Json::array();
  for (const MotorEnvelope& e : envelopes) {
    motors.push_back({{"drive", e.drive},
                      {"torque_unit", e.torque_unit},
                      {"speed_unit", e.speed_unit},
                      {"peak_torque", MostJson(e.peak_torque)},
                      {"rms_torque", MostJson(e.rms_torque)},
                      {"peak_speed", MostJson(e.peak_speed)},
                      {"peak_power_W", MostJson(e.peak_power)},
                      {"brake_power_W", MostJson(e.brake_power)},
                      {"use", MostJson(e.use)},
                      {"limited_by", e.limited_by},
                      {"unresolved", e.unresolved},
                      {"margin", Number(e.limited ? e.margin() : kNan)}});
  }
  Json dc_link;
  if (link) {
    dc_link = {{"fed_back_J", MostJson(link->fed_back_J)},
               {"resistor_mean_W", MostJson(link->resistor_mean)},
               {"resistor_peak_W", MostJson(link->resistor_peak)},
               {"use", MostJson(link->use)},
               {"limited_by", link->limited_by},
               {"margin", Number(link->limited ? link->margin() : kNan)}};
  }
  const Json json = {{"schema", "mbverify.sizing/1"},
                     {"scenarios", scenarios},
                     {"motors", std::move(motors)},
                     {"dc_link", std::move(dc_link)}};
  return Dump(json);
}

}  // namespace mbv
