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

std::string UsesText(const MotorLoad& load) {
  std::string text;
  for (const MotorLoad::Use& use : load.uses) {
    text += fmt::format("{}{} {}", text.empty() ? "" : ", ", use.of, Percent(use.use));
  }
  return text.empty() ? "–" : text;
}

std::string AtRestText(const MotorLoad& load) {
  return fmt::format("friction rests at {} of {} samples: the worse end of the band counts",
                     load.samples_at_rest, load.time_s.size());
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
    html.rows.push_back({load->drive, NumberOrDash(load->margin(), "{:.3g}"), UsesText(*load),
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
          fmt::format("  current: peak {}, RMS {}; voltage {}", WithUnit(load->peak_current, "A"),
                      WithUnit(load->rms_current, "A"), WithUnit(load->peak_voltage, "V")));
    }
    if (std::isfinite(load->inertia_ratio)) {
      lines.push_back(
          fmt::format("  load inertia / rotor inertia at home: {:.3g}", load->inertia_ratio));
    }
    if (load->samples_at_rest > 0) lines.push_back("  " + AtRestText(*load));
    lines.push_back("  used: " + UsesText(*load));
  }
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
    if (motor != nullptr && load->known()) html += CloudHtml(*motor, *load);
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
    Json uses = Json::array();
    for (const MotorLoad::Use& use : load.uses) {
      uses.push_back({{"of", use.of}, {"use", Number(use.use)}, {"time_s", Number(use.time_s)}});
    }
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
         {"inertia_ratio", Number(load.inertia_ratio)},
         {"samples_at_rest", load.samples_at_rest},
         {"unresolved", load.unresolved},
         {"uses", std::move(uses)},
         {"limited_by", load.limited_by()},
         {"margin", Number(load.margin())}});
  }
  return motors;
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

std::string ToText(const std::vector<MotorEnvelope>& envelopes) {
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
  std::string text = ToText(table, {.indent = ""});
  for (const MotorEnvelope& e : envelopes) {
    if (e.unresolved.empty()) continue;
    text += fmt::format("{}: torque, power and margin not known between the samples: {}\n", e.drive,
                        e.unresolved);
  }
  return text;
}

std::string ToJson(const std::vector<MotorEnvelope>& envelopes,
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
  const Json json = {
      {"schema", "mbverify.sizing/1"}, {"scenarios", scenarios}, {"motors", std::move(motors)}};
  return Dump(json);
}

}  // namespace mbv
