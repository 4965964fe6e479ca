#include "pipeline/mutate.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "pipeline/run_scenario.h"
#include "scenario/load_scenario.h"

namespace mbv {
namespace {

// A value counts as an effect of the parameter when it is clearly above what the unbent run gives.
constexpr double kRoundoff = 1e-12;
constexpr double kAboveBase = 5.0;

double Visible(double base) { return std::max(kRoundoff, kAboveBase * base); }

RunOptions OptionsFor(const std::string& parameter, double value) {
  RunOptions options;
  options.pictures = false;
  options.scenario.set = {{"simulation.mode", "inverse"}, {"reference", "off"}};
  if (!parameter.empty()) {
    options.scenario.set.emplace_back("simulation.parameters." + parameter,
                                      fmt::format("{:.17g}", value));
  }
  return options;
}

constexpr const char* kForceCheck = "simulated_vs_analytic.force_nrmse";

double ValueOf(const Report& report, const std::string& check_name) {
  const CheckResult* check = report.comparison.FindCheck(check_name);
  return check == nullptr ? 0.0 : check->value;
}

// What the checks of a bent run say; `base` is the unbent run.
void Judge(const Report& bent, const Report& base, double size, Mutation* m) {
  double best = std::numeric_limits<double>::infinity();
  m->force_change = ValueOf(bent, kForceCheck);
  for (const CheckResult& check : bent.comparison.checks) {
    if (!check.limit || check.value <= Visible(ValueOf(base, check.name))) continue;
    // A check that fails shows the error; NaN fails too.
    if (!check.pass) {
      m->detected = true;
      m->by_force = m->by_force || IsDriveForce(check.metric);
    }
    const double smallest = size * *check.limit / check.value;
    if (smallest < best) {
      best = smallest;
      m->best_check = check.name;
    }
  }
  if (m->detected) m->smallest = best;
}

std::string WhyUnseen(const Mutation& m, const Report& base, const std::string& note) {
  if (!(m.force_change > Visible(ValueOf(base, kForceCheck)))) {
    return "the simulated motion and drive forces do not depend on it" +
           (note.empty() ? "" : " (" + note + ")");
  }
  return fmt::format("its effect on the drive forces ({:.1e}) is below the limit", m.force_change);
}

Mutation Bend(const std::string& file, const Parameter& parameter, const Report& base,
              double size) {
  Mutation m;
  m.parameter = parameter.name;
  m.unit = parameter.unit;
  m.value = parameter.value;
  const RunOutcome outcome =
      RunScenario(file, OptionsFor(parameter.name, parameter.value * (1 + size)));
  if (!outcome.report) {
    // The bent model contradicts itself (a loop that does not close, an inertia that is not
    // physical): found before any force was compared.
    m.detected = true;
    m.reason = outcome.diagnostics.findings().empty()
                   ? "the bent model could not be loaded"
                   : outcome.diagnostics.findings().front().message;
    return m;
  }
  m.ran = outcome.report->comparison.verdict != Verdict::kNotRun;
  if (!m.ran) {
    m.detected = true;
    m.reason = outcome.report->comparison.reason;
    return m;
  }
  Judge(*outcome.report, base, size, &m);
  if (!m.detected) m.reason = WhyUnseen(m, base, parameter.note);
  return m;
}

bool Wanted(const MutationOptions& options, const Parameter& parameter) {
  // An instance's parameter ("limb2.azimuth") follows from the model's.
  const bool of_instance = parameter.name.find('.') != std::string::npos;
  if (options.parameters.empty()) return parameter.value != 0.0 && !of_instance;
  return std::find(options.parameters.begin(), options.parameters.end(), parameter.name) !=
         options.parameters.end();
}

std::string Row(const Mutation& m, bool markdown) {
  const std::string seen = !m.detected  ? "no"
                           : m.by_force ? "drive forces"
                           : m.ran      ? "yes"
                                        : "refused";
  const std::string change =
      std::isnan(m.force_change) ? "-" : fmt::format("{:.1e}", m.force_change);
  const std::string smallest = std::isnan(m.smallest) ? "-" : fmt::format("{:.0e}", m.smallest);
  const std::string note = m.reason.empty() ? m.best_check : m.reason;
  if (markdown) {
    return fmt::format("| `{}` | {:g} {} | {} | {} | {} | {} |\n", m.parameter, m.value, m.unit,
                       seen, change, smallest, note);
  }
  return fmt::format("  {:<22}{:>12g} {:<7}{:<14}{:>9}  {:>8}  {}\n", m.parameter, m.value, m.unit,
                     seen, change, smallest, note);
}

}  // namespace

MutationReport MutateScenario(const std::string& file, const MutationOptions& options) {
  MutationReport report;
  report.scenario = file;
  report.size = options.size;
  const ScenarioResult scenario = LoadScenario(file);
  if (!scenario.scenario) {  // bad input, or no motion
    report.diagnostics = scenario.diagnostics;
    report.exit_code = 2;
    return report;
  }
  const RunOutcome base = RunScenario(file, OptionsFor("", 0.0));
  report.diagnostics = base.diagnostics;
  report.exit_code = base.exit_code;
  if (base.exit_code != 0) return report;  // an unbent disagreement would detect everything

  std::vector<Parameter> parameters;
  for (const Parameter& parameter : scenario.mechanism->parameters) {
    if (Wanted(options, parameter)) parameters.push_back(parameter);
  }
  for (size_t i = 0; i < parameters.size(); ++i) {
    if (options.progress) {
      options.progress(parameters[i].name, static_cast<double>(i) / parameters.size());
    }
    report.mutations.push_back(Bend(file, parameters[i], *base.report, options.size));
  }
  std::stable_sort(report.mutations.begin(), report.mutations.end(),
                   [](const Mutation& a, const Mutation& b) {
                     const auto key = [](const Mutation& m) {
                       return std::isnan(m.force_change) ? -1.0 : m.force_change;
                     };
                     return key(a) > key(b);
                   });
  const bool missed =
      std::any_of(report.mutations.begin(), report.mutations.end(), [&](const Mutation& m) {
        return !m.detected && m.force_change > Visible(ValueOf(*base.report, kForceCheck));
      });
  report.exit_code = missed ? 1 : 0;
  return report;
}

std::string ToText(const MutationReport& report, bool markdown) {
  const auto count = [&](auto predicate) {
    return std::count_if(report.mutations.begin(), report.mutations.end(), predicate);
  };
  const auto detected = count([](const Mutation& m) { return m.detected; });
  const auto by_force = count([](const Mutation& m) { return m.by_force; });
  std::string text = fmt::format(
      "{}: {} of {} parameters, each {:g} % wrong on the simulated side, turn the verdict; {} of "
      "them "
      "by the drive forces\n\n",
      report.scenario, detected, report.mutations.size(), 100 * report.size, by_force);
  text += markdown
              ? "| parameter | value | detected | force NRMSE | smallest relative error | seen "
                "first by, or why not |\n|---|---|---|---|---|---|\n"
              : fmt::format("  {:<22}{:>12} {:<7}{:<14}{:>9}  {:>8}  {}\n", "parameter", "value",
                            "", "detected", "force", "smallest", "seen first by, or why not");
  for (const Mutation& m : report.mutations) text += Row(m, markdown);
  return text;
}

}  // namespace mbv
