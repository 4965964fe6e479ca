// Results made by hand. Each number in them is another one, so that a writer that takes the wrong
// one is found out.
#pragma once

#include <string>

#include "features/stiffness/stiffness_report.h"
#include "report/html_report.h"
#include "report/report.h"
#include "tests/comparison/synthetic.h"

namespace mbv::test {

/// Two sliders; the simulation 1 % off on d1 only; the reference was switched off; one check is
/// off.
inline synthetic::Case PerturbedCase() {
  synthetic::Case c;
  c.column = LimitColumn::kForward;
  c.limits[Metric::kForceMax].forward.reset();
  synthetic::Stretch(&c.simulated, "d1.force", 1.01);
  c.simulated.values(40, c.simulated.Find("plate.x")) = kNan;
  c.reference_summary = {.message = "switched off in the scenario", .where = {}, .unit = {}};
  for (const char* component : {"fx", "fy", "fz", "mx", "my", "mz"}) {
    c.reactions_not_unique.push_back(std::string("slide2.reaction.") + component);
  }
  return c;
}

/// The first three samples.
inline Trace Shortened(Trace trace) {
  trace.time_s.resize(3);
  trace.values = trace.values.topRows(3).eval();
  return trace;
}

inline Finding Warning(const std::string& message) {
  Finding finding;
  finding.severity = Severity::kWarning;
  finding.message = message;
  return finding;
}

inline Report MakeReport(const synthetic::Case& c) {
  Report report;
  report.scenario = "perturbed";
  report.scenario_file = "scenarios/two_sliders/perturbed.yaml";
  report.mechanism = "two_sliders";
  report.model_file = "models/two_sliders/model.yaml";
  report.description = "Two sliders carry a plate";
  report.drives = {"d1", "d2"};
  report.simulation = "forward simulation, step 1 ms, corrected engine";
  report.mode = "forward";
  report.step_s = 1e-3;
  report.duration_s = 1.0;
  report.sample_s = 0.01;
  report.driven_by = "analytic";
  report.comparison = c.Run();
  report.exit_code = 1;
  report.witnesses = {{"analytic", c.analytic_summary, Shortened(c.analytic)},
                      {"reference", c.reference_summary, {}},
                      {"simulated", c.simulated_summary, Shortened(c.simulated)}};
  report.findings.Add(Warning("MuJoCo: a warning"));
  report.sheets = SheetsOf(c.mechanism, report.comparison);
  report.engine_comparison =
      EngineComparison{.truth = "analytic",
                       .engines = {{"defaults", kNan, kNan, kNan, kNan, "it diverged"},
                                   {"stock", 1.5e-3, 2e-3, 2.1e-6, 3.4e-6},
                                   {"corrected", 4.2e-8, 5e-8, 1.7e-9, 4.1e-8}}};
  report.timing = {.analytic_s = 0.001,
                   .reference_s = 0.0,
                   .simulation_s = 0.5,
                   .stock_s = 0.25,
                   .render_s = 0.125,
                   .total_s = 1.0,
                   .loop_s = 0.4,
                   .steps = 1000};
  report.versions = {{"mbverify", "0.1.0"}};
  report.pictures = {"t_0.000s.png"};
  return report;
}

/// What a check of the two sliders says when it is not one of the usual ones.
inline CheckResult OddCheck(const std::string& witness, Metric metric, double value) {
  CheckResult check;
  check.name = witness + "." + RowOf(metric).key;
  check.subject = witness;
  check.metric = metric;
  check.value = value;
  check.limit = 1e-4;
  check.pass = value <= 1e-4;
  check.channel = "d2.force";
  check.time_s = 0.375;
  return check;
}

inline TableColumn Column(const std::string& channel, const std::string& heading, double factor,
                          double shift) {
  TableColumn column;
  column.channel = {channel, "N", ""};
  column.heading = heading;
  column.unit = "kN";
  column.factor = factor;
  column.shift = shift;
  return column;
}

/// A motion with everything that a page can show: caveats, an odd one out, a start-up window,
/// checks of all ends, a table in the reference's place, energies, errors of engines, reactions.
inline Report FullReport() {
  Report report = MakeReport(PerturbedCase());
  report.scenario = "full";
  report.description = "Plates <b>&</b> \"sliders\"";
  report.start_window_s = 0.05;
  report.timing.reference_s = 0.0625;
  report.drives_not_unique = {"d2"};
  report.simulated_not_unique = {"slide1"};
  report.reactions_not_unique = {"slide1.reaction.fy"};
  Comparison& comparison = report.comparison;
  comparison.reason = "the masses differ";
  comparison.driving = "the simulation follows the closed form";
  comparison.caveats = {
      {.kind = CaveatKind::kFewSamples, .of = {"d1"}, .text = "only 3 samples were compared"},
      {.kind = CaveatKind::kWitnessMissing,
       .of = {"planar"},
       .text = "forces < 1 N are all there is.",
       .gap = WitnessGap::kTimedOut}};
  comparison.attribution = {"simulated", "analytic & reference agree; simulated does not"};
  CheckResult tube = OddCheck("simulated_vs_reference", Metric::kTableTube, 5e-5);
  tube.stated_limit = 2e-6;
  tube.limit_by = "the table's digits";
  CheckResult insensitive_check = OddCheck("reference", Metric::kPower, 6e-5);
  insensitive_check.insensitive = "nothing moves";
  CheckResult floored = OddCheck("reference", Metric::kClosureM, 7e-5);
  floored.floored = true;
  CheckResult exact = OddCheck("reference", Metric::kEnergy, 0.0);
  exact.channel.clear();
  for (const CheckResult& check : {tube, insensitive_check, floored, exact}) {
    comparison.checks.push_back(check);
  }
  comparison.table = TableVerdict{
      .name = "forces.csv",
      .grid = "3 rows meet 3 samples",
      .notes = {"column 4 <unused> is left out"},
      .columns = {Column("d1.force", "F1 (kN)", 1000.0, 0.5),
                  Column("d2.force", "F2 (kN)", -1000.0, 0.25)},
      .uncertainty = {{.digits = 0.01, .noise = 0.02, .stamps = 0.03, .interpolation = 0.04},
                      {.stated = true}},
      .coverage = 2.5,
      .judged_against = "simulated",
      .judged = true,
      .too_coarse = "the table's noise hides it",
      .diagnoses = {"the signs of F2 are the other way round"}};
  PairComparison pair;
  pair.measured = "simulated";
  pair.truth = "reference";
  pair.compared = true;
  pair.columns = {{.channel = "d1.force",
                   .column = 0,
                   .samples = 3,
                   .rms = 70.5,
                   .standard = 0.11,
                   .bound = 0.12,
                   .error_rms = 0.13,
                   .error_max = 0.14,
                   .time_s = 0.015,
                   .tube_rms = 0.16,
                   .tube_max = 0.17},
                  {.channel = "d2.force",
                   .column = 1,
                   .samples = 2,
                   .rms = 28.5,
                   .standard = 0.21,
                   .bound = 0.22,
                   .error_rms = 0.73,
                   .error_max = 0.74,
                   .time_s = 0.025,
                   .tube_rms = 0.26,
                   .tube_max = 0.27}};
  std::erase_if(comparison.pairs, [&](const PairComparison& p) { return p.name() == pair.name(); });
  comparison.pairs.push_back(pair);
  report.witnesses[1].summary = RunSummary::Done();
  report.witnesses[1].trace = report.witnesses[0].trace;
  report.witnesses[1].trace.witness = "reference";
  WitnessMetrics reference{.witness = "reference", .metrics = {}};
  EnergyAudit energy;
  energy.witness = "reference";
  energy.integrated = true;
  energy.parts = {{"kinetic energy", true, 1.25, 1.5},
                  {"gravity", true, -2.25, 2.5},
                  {"d1", false, 3.25, 3.5},
                  {"dampers", false, 0.0, 0.0}};
  energy.scale_J = 4.25;
  energy.drift.value = 0.75;
  energy.drift.time_s = 0.65;
  energy.drift_J = 0.55;
  energy.end_drift_J = 0.45;
  energy.from_s = 0.35;
  energy.culprit = "d1";
  energy.share = 0.24;
  energy.text = "the drift is 24 % of what d1 does";
  reference.energy = energy;
  comparison.witnesses.push_back(reference);
  for (WitnessMetrics& witness : comparison.witnesses) {
    if (witness.witness != "simulated") continue;
    energy.witness = "simulated";
    energy.integrated = false;
    energy.parts[0].end_J = 1.125;
    energy.parts[2].end_J = 3.125;
    energy.end_drift_J = 0.4375;
    energy.drift_J = 0.5375;
    energy.drift.value = 0.7375;
    energy.text.clear();
    witness.energy = energy;
  }
  return report;
}

/// The page of that: two pictures, an audit, arguments, parameters.
struct FullPage {
  Mechanism mechanism = synthetic::TwoSliders();
  Report report = FullReport();

  FullPage() {
    mechanism.parameters = {{"m_a", 1.5, "kg", Source::kPrinted, "Table 2"},
                            {"m_b", 2.5, "kg", Source::kAssumed, "a guess"},
                            {"l", 0.125, "m", Source::kCorrected, "a > b"},
                            {"n", 3.0, "", Source::kUnstated, ""}};
  }
  [[nodiscard]] HtmlInput input() const {
    HtmlInput input;
    input.report = &report;
    input.mechanism = &mechanism;
    input.pictures = {{"t_0.000s.png", "first"}, {"t 0.500s.png", "second"}};
    input.audit = HtmlAudit{
        .source = "A & B, 1999",
        .rows = {{"(1)", "", "right", "a = b", "", "seen", "≤ 1e-12 m", true, false},
                 {"(2)", "E7", "wrong as printed", "c = d", "c = -d", "sign", "0.5 N", false, true},
                 {"(3)", "", "no residual", "e", "", "a name", "", false, false}},
        .note = ""};
    input.arguments = {"--set 'parameters.m_a=1.5'"};
    return input;
  }
};

/// A stiffness in every direction, 2000 N m/rad … 1e5 N/m.
inline Mat6 SixSprings() {
  Mat6 K = Mat6::Zero();
  K.diagonal() << 2000, 1000, 500, 4e5, 2e5, 1e5;
  return K;
}

inline StiffnessWitness StiffWitness(const std::string& name, const Mat6& K,
                                     const std::vector<Vec6>& loads) {
  StiffnessWitness witness;
  witness.name = name;
  witness.result.K = K;
  witness.result.C = K.inverse();
  witness.result.rank = 6;
  witness.result.shares = {{"link <1>", 0.75 * witness.result.C},
                           {"d1 (servo)", 0.25 * witness.result.C}};
  witness.result.summary = RunSummary::Done();
  witness.displacements = Displacements(witness.result, loads);
  return witness;
}

/// The verdict on stiffnesses of a mechanism of which nothing else is known.
inline Comparison CompareAll(const std::vector<StiffnessWitness>& witnesses,
                             const CheckLimits& limits = {},
                             const std::map<std::string, Overrides>& own_parameters = {}) {
  const Mechanism mechanism;
  const Motion motion;
  ComparisonInput input;
  input.mechanism = &mechanism, input.motion = &motion;
  input.limits = limits;
  input.own_parameters = own_parameters;
  input.of_stiffness = true;
  for (const StiffnessWitness& witness : witnesses) input.witnesses.push_back(AsWitness(witness));
  return Compare(input);
}

/// An arm by three computations and the paper's own model; the simulation's x is 2 % too stiff,
/// which takes one check beyond its limit; another one is off.
inline StiffnessReport StiffArm() {
  StiffnessReport report;
  report.scenario = "held";
  report.scenario_file = "scenarios/arm/held.yaml";
  report.mechanism = "arm";
  report.model_file = "models/arm/elastic.yaml";
  report.description = "An arm <held> & loaded";
  report.output = "hand";
  report.pose = {{"x", 0.125, "m"}, {"yaw", 0.25, "rad"}};
  report.pose_note = "the usual pose";
  report.model = "corrected";
  report.p_WO = Vec3(0.15, 0.25, 0.35);
  Vec6 first, second;
  first << 1, 2, 3, 100, 200, 400;
  second << -2, 1, 0.5, -300, 50, 80;
  report.loads = {first, second};
  report.loads_text = "2 given wrenches";
  Mat6 stiff = SixSprings(), printed = SixSprings();
  stiff(3, 3) *= 1.02;
  printed(4, 4) *= 1.1;
  report.witnesses = {StiffWitness("analytic", SixSprings(), report.loads),
                      StiffWitness("reference", SixSprings(), report.loads),
                      StiffWitness("simulated", stiff, report.loads)};
  report.witnesses[2].result.shares.clear();
  report.witnesses[2].residual = 3e-11;
  report.witnesses[2].extrapolation_error = 4e-10;
  report.printed = {StiffWitness("printed", printed, report.loads)};
  report.printed_pairs = {
      CompareStiffnesses(AsWitness(report.printed[0]), AsWitness(report.witnesses[0]))};
  report.indices = {{"kappa", "N/m", "mean stiffness", {1.5, 2.5, 3.5}}};
  CheckLimits limits;
  limits[Metric::kComplianceEntry].forward.reset();
  report.comparison = CompareAll(report.witnesses, limits);
  report.exit_code = 1;
  report.findings.Add(Warning("a beam is short"));
  report.timing = {.analytic_s = 0.001,
                   .reference_s = 0.02,
                   .simulation_s = 0.3,
                   .render_s = 0.4,
                   .total_s = 0.75};
  report.versions = {{"mbverify", "0.1.0"}, {"MuJoCo", "2.2.2"}};
  report.parameters = {{"E", 2.1e11, "Pa", Source::kPrinted, "steel"}};
  report.command = "mbverify run scenarios/arm/held.yaml --set 'a=1'";
  return report;
}

}  // namespace mbv::test
