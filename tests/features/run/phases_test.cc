// Scenarios in phases: a biped that steps, its feet changing.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "base/files.h"
#include "comparison/contact_load.h"
#include "features/run/run_scenario.h"
#include "report/report.h"
#include "tests/support/source_dir.h"
#include "tests/support/test_folder.h"
#include "verify/check_file.h"
#include "verify/prepare.h"

namespace mbv {
namespace {

using Limit = ContactLoad::Limit;

constexpr double kWeight = 48.0 * 9.81;  // of tests/mechanisms/biped.yaml [N]

// A step of the right foot by 0.1 m: shift to the left, swing, stand.
struct Step {
  std::string pelvis_y =
      "[home, {poly345: {start_s: 0, duration_s: 0.5, delta: 0.1}}, "
      "{poly345: {start_s: 0.9, duration_s: 0.5, delta: -0.1}}]";
  std::string pelvis_z = "home";
  std::string swing_z = "[home, {bump: {start_s: 0.5, duration_s: 0.4, height: 0.04}}]";
  std::string swing_x = "[home, {poly345: {start_s: 0.5, duration_s: 0.4, delta: 0.1}}]";
  std::string phases = "";
  std::string more = "";

  [[nodiscard]] std::string Text() const {
    const std::string swing = fmt::format(
        "{{right_foot.x: {}, right_foot.y: home, right_foot.z: {}, right_foot.roll: home, "
        "right_foot.pitch: home, right_foot.yaw: home}}",
        swing_x, swing_z);
    const std::string usual = fmt::format(
        "  - {{until_s: 0.5, contacts: [left.sole, right.sole]}}\n"
        "  - {{name: swing, until_s: 0.9, contacts: [left.sole], commands: {}}}\n"
        "  - {{name: landed, contacts: [left.sole, right.sole]}}\n",
        swing);
    return fmt::format(
        "mechanism: ./biped.yaml\nmotion:\n  duration_s: 1.4\n  sample_s: 0.02\n  commands:\n"
        "    pelvis.x: home\n    pelvis.y: {}\n    pelvis.z: {}\n    pelvis.roll: home\n"
        "    pelvis.pitch: home\n    pelvis.yaw: home\nphases:\n{}{}",
        pelvis_y, pelvis_z, phases.empty() ? usual : phases, more);
  }
};

class Phases : public testing::Test {
 protected:
  [[nodiscard]] std::string Write(const std::string& text) const {
    (void)folder_.Write("biped.yaml",
                        ReadWholeFile(SourcePath("/tests/mechanisms/biped.yaml")).value_or(""));
    return folder_.Write("step.yaml", text);
  }
  [[nodiscard]] RunOutcome Run(const std::string& text,
                               std::vector<SetValue> set = {{"simulation.mode", "inverse"}}) const {
    RunOptions options;
    options.pictures = false;
    options.out_dir = "";
    options.scenario.set = std::move(set);
    return RunScenario(Write(text), options);
  }
  [[nodiscard]] std::string Refused(const std::string& text) const {
    const RunOutcome outcome = Run(text, {});
    EXPECT_EQ(outcome.exit_code, 2);
    return outcome.diagnostics.Text();
  }

  const test::TestFolder folder_{"phases"};
};

const ContactLoad* LoadInPhase(const RunOutcome& outcome, const std::string& phase,
                               const std::string& contact,
                               const std::string& witness = "reference") {
  for (const ContactLoad& load : outcome.report->contact_loads) {
    if (load.witness == witness && load.contact == contact && load.phase == phase) return &load;
  }
  return nullptr;
}

std::vector<std::string> PhaseCaveatsOf(const RunOutcome& outcome) {
  std::vector<std::string> texts;
  for (const Caveat& caveat : outcome.report->comparison.caveats) {
    if (caveat.kind == CaveatKind::kContact) texts.push_back(caveat.text);
  }
  return texts;
}

bool AnyHas(const std::vector<std::string>& texts, const std::string& part) {
  return std::ranges::any_of(
      texts, [&](const std::string& text) { return text.find(part) != std::string::npos; });
}

double ValueAt(const Trace& trace, const std::string& channel, double t_s) {
  const auto at = std::ranges::find_if(
      trace.time_s, [&](double time_s) { return std::abs(time_s - t_s) < 1e-9; });
  const int column = trace.Find(channel);
  if (at == trace.time_s.end() || column < 0) return kNan;
  return trace.values(at - trace.time_s.begin(), column);
}

TEST_F(Phases, AStepIsOneResultOverTime) {
  for (const char* mode : {"inverse", "forward"}) {
    const RunOutcome run = Run(Step().Text(), {{"simulation.mode", mode}});
    ASSERT_TRUE(run.report) << run.diagnostics.Text();
    const Report& report = *run.report;
    EXPECT_EQ(run.exit_code, 0) << ToTable(report, {});
    ASSERT_EQ(report.phases.size(), 3U);
    EXPECT_EQ(report.phases[0].name, "1");
    EXPECT_EQ(report.phases[1].name, "swing");
    EXPECT_DOUBLE_EQ(report.phases[1].from_s, 0.5);
    EXPECT_DOUBLE_EQ(report.phases[2].to_s, 1.4);
    EXPECT_DOUBLE_EQ(report.duration_s, 1.4);
    for (const char* witness : {"reference", "simulated"}) {
      const Trace& trace = *TraceOf(report, witness);
      ASSERT_EQ(trace.time_s.size(), 71U) << witness;
      for (size_t i = 0; i < trace.time_s.size(); ++i) {
        EXPECT_EQ(trace.time_s[i], static_cast<double>(i) * 0.02) << witness;
      }
      // In the swing phase the left foot bears all, and the right one has no reaction: at the first
      // instant of the phase, too, and no more at the last, where the foot has landed.
      EXPECT_NEAR(ValueAt(trace, "left.sole.reaction.fz", 0.5), kWeight, 1e-3) << mode;
      EXPECT_TRUE(std::isnan(ValueAt(trace, "right.sole.reaction.fz", 0.5)));
      EXPECT_TRUE(std::isnan(ValueAt(trace, "right.sole.reaction.fz", 0.88)));
      for (const double t : {0.48, 0.9, 1.38}) {
        const double left = ValueAt(trace, "left.sole.reaction.fz", t),
                     right = ValueAt(trace, "right.sole.reaction.fz", t);
        EXPECT_GT(std::min(left, right), 10.0) << t;
        EXPECT_NEAR(left + right, kWeight, 1e-2 * kWeight) << t;
      }
      // It stays where it landed.
      EXPECT_NEAR(ValueAt(trace, "right_foot.x", 1.4) - ValueAt(trace, "right_foot.x", 0.0), 0.1,
                  1e-6);
    }
    // In double support one share of many is judged; in the swing nothing is exceeded, no impact.
    EXPECT_FALSE(AnyHas(PhaseCaveatsOf(run), "phase 'swing'"));
    EXPECT_FALSE(AnyHas(PhaseCaveatsOf(run), "velocities jump"));
    const ContactLoad* swing = LoadInPhase(run, "swing", "left.sole");
    ASSERT_NE(swing, nullptr);
    EXPECT_TRUE(swing->unique());
    EXPECT_EQ(LoadInPhase(run, "swing", "right.sole"), nullptr);
    EXPECT_NE(LoadInPhase(run, "landed", "right.sole", "simulated"), nullptr);
  }
}

// The same feet in both phases: where the cut is changes nothing.
TEST_F(Phases, ACutWithoutAChangeOfFeetChangesNoForce) {
  Step step{.swing_z = "home"};
  step.phases = "  - {contacts: [left.sole, right.sole]}\n";
  const RunOutcome whole = Run(step.Text());
  step.phases =
      "  - {name: a, until_s: 0.42, contacts: [left.sole, right.sole]}\n"
      "  - {name: b, until_s: 1, contacts: [left.sole, right.sole]}\n"
      "  - {name: c, contacts: [left.sole, right.sole]}\n";
  const RunOutcome cut = Run(step.Text());
  ASSERT_TRUE(whole.report && cut.report) << cut.diagnostics.Text();
  EXPECT_EQ(whole.exit_code + cut.exit_code, 0) << ToTable(*cut.report, {});
  for (const char* witness : {"reference", "simulated"}) {
    const Trace &a = *TraceOf(*whole.report, witness), &b = *TraceOf(*cut.report, witness);
    ASSERT_EQ(a.values.rows(), b.values.rows());
    for (const std::string& drive : whole.report->drives) {
      const auto x = a.values.col(a.Find(Quantity::kForce, drive));
      const auto y = b.values.col(b.Find(Quantity::kForce, drive));
      EXPECT_LT((x - y).cwiseAbs().maxCoeff(), 1e-8) << witness << drive;
    }
  }
}

TEST_F(Phases, AFootThatWouldPullIsNamedWithPhaseAndTime) {
  // The pelvis and what hangs on it falls faster than g, in the swing alone.
  for (const double amplitude : {0.0002, 0.02}) {
    Step step;
    step.pelvis_z =
        fmt::format("[home, {{bump: {{start_s: 0.6, duration_s: 0.2, height: {}}}}}]", amplitude);
    const RunOutcome run = Run(step.Text());
    ASSERT_TRUE(run.report) << run.diagnostics.Text();
    EXPECT_EQ(run.exit_code, 0) << ToTable(*run.report, {});  // a caveat, no disagreement
    const bool pulls = amplitude > 0.001;
    EXPECT_EQ(AnyHas(PhaseCaveatsOf(run), "phase 'swing': left.sole lifts"), pulls);
    EXPECT_FALSE(AnyHas(PhaseCaveatsOf(run), "phase 'landed': left.sole lifts"));
    const ContactLoad::Use* lift = LoadInPhase(run, "swing", "left.sole")->Find(Limit::kLift);
    EXPECT_EQ(lift->exceeded(), pulls);
    EXPECT_EQ(lift->from_s >= 0.6 && lift->from_s < 0.8, pulls) << lift->from_s;
  }
}

// Without the shift the robot would tip over its left foot.
TEST_F(Phases, ATipIsNamedInItsPhaseOnly) {
  Step step;
  step.pelvis_y = "home";
  const RunOutcome run = Run(step.Text());
  ASSERT_TRUE(run.report) << run.diagnostics.Text();
  EXPECT_TRUE(AnyHas(PhaseCaveatsOf(run), "phase 'swing': left.sole tips"));
  EXPECT_FALSE(AnyHas(PhaseCaveatsOf(run), "all feet together tip"));
}

TEST_F(Phases, AFootThatLandsInMotionIsAnImpact) {
  for (const bool lands_at_rest : {true, false}) {
    Step step;
    if (!lands_at_rest) {
      step.swing_z = "[home, {sine: {amplitude: 0.001, frequency_hz: 1.25, phase_deg: -225}}]";
    }
    const RunOutcome run = Run(step.Text());
    ASSERT_TRUE(run.report) << run.diagnostics.Text();
    const auto caveats = PhaseCaveatsOf(run);
    EXPECT_EQ(AnyHas(caveats, "at 0.9 s, where phase 'landed' begins, velocities jump"),
              !lands_at_rest)
        << (caveats.empty() ? "" : caveats.front());
  }
}

TEST_F(Phases, AWrongMassDisagreesInThePhasesThatShowIt) {
  const RunOutcome run = Run(
      Step().Text(), {{"simulation.mode", "inverse"},
                      {"simulation.parameters.m_pelvis", fmt::format("{}", 30.0 * (1 + 1e-6))}});
  ASSERT_TRUE(run.report) << run.diagnostics.Text();
  EXPECT_EQ(run.exit_code, 1);
  EXPECT_TRUE(run.report->comparison.reason.starts_with("phase '"))
      << run.report->comparison.reason;
  for (const PhaseLine& phase : run.report->phases) {
    EXPECT_EQ(phase.verdict, Verdict::kDisagree) << phase.name;
    EXPECT_GT(phase.worst_use, 1.0);
  }
}

TEST_F(Phases, FaultsAreFoundBeforeAnythingRuns) {
  Step jump;
  jump.swing_x = "0.5";
  EXPECT_NE(Refused(jump.Text())
                .find("phases[1]: right_foot.x is commanded to 0.5 m at 0.5 s, "
                      "where the phase before leaves it at 0"),
            std::string::npos)
      << Refused(jump.Text());
  const std::pair<const char*, const char*> cases[] = {
      {"  - {until_s: 0.5}\n  - {contacts: []}\n", "'contacts' is missing"},
      {"  - {contacts: [left.sole]}\n  - {contacts: []}\n", "'until_s' is missing"},
      {"  - {until_s: 0.5, contacts: [left.sol]}\n  - {contacts: []}\n", "no contact 'left.sol'"},
      {"  - {until_s: 0.51, contacts: [left.sole, right.sole]}\n  - {contacts: [left.sole]}\n",
       "violates until_s = n"},
      {"  - {until_s: 2, contacts: [left.sole, right.sole]}\n  - {contacts: []}\n",
       "does not fit motion.duration_s = 1.4"},
      {"  - {until_s: 0.5, contacts: [left.sole, right.sole]}\n  - {until_s: 0.4, contacts: []}\n",
       "violates until_s > 0.5"},
      {"  - {until_s: 0.5, contacts: [left.sole, right.sole]}\n  - {contacts: [left.sole]}\n",
       "motion gives 6 commands, but biped has 12 degrees of freedom"},
      {"  - {until_s: 1.4, contacts: [left.sole, right.sole], stands: yes}\n", "stands"},
      {"  - {until_s: 0.5, contacts: [left.sole, right.sole]}\n  - {name: 1, contacts: []}\n",
       "there is a phase '1' before"}};
  for (const auto& [phases, finding] : cases) {
    Step step;
    step.phases = phases;
    const std::string text = Refused(step.Text());
    EXPECT_NE(text.find(finding), std::string::npos) << finding << "\n" << text;
    EXPECT_NE(CheckFile(Write(step.Text())).Text().find(finding), std::string::npos) << finding;
  }
  EXPECT_NE(Refused(Step{.more = "contacts: [left.sole]\n"}.Text()).find("not taken together"),
            std::string::npos);
  EXPECT_NE(Refused(Step{.more = "simulation: {mode: force_driven}\n"}.Text())
                .find("phases run along the commanded motion"),
            std::string::npos);
  // Commands that cannot join phases say so.
  Diagnostics found;
  EXPECT_FALSE(Prepare(Write(Step().Text()), {}, &found));
  EXPECT_NE(found.Text().find("phases: each is a mechanism of its own"), std::string::npos);
  EXPECT_EQ(CheckFile(Write(Step().Text())).Text(), "");
}

// A foot whose place on the ground the model states must land there.
TEST_F(Phases, AStatedPlaceMustBeReached) {
  for (const double place : {0.13, 0.14}) {
    std::string model = ReadWholeFile(SourcePath("/tests/mechanisms/biped.yaml")).value_or("");
    model += fmt::format(
        "contacts:\n  there: {{on: right.foot, at: [0.03, 0, -ankle], to: world.stone, kind: sole, "
        "length: length, width: 0.1}}\nworld: {{frames: {{stone: [{}, -hip, 0.85 - (thigh + "
        "shank)*cos(knee_angle) - ankle]}}}}\n",
        place);
    Step step;
    std::string text = step.Text();
    for (const char* phase : {"name: landed, contacts: [left.sole, right.sole]"}) {
      const size_t at = text.find(phase);
      ASSERT_NE(at, std::string::npos);
      text.replace(at, std::string(phase).size(), "name: landed, contacts: [left.sole, there]");
    }
    const std::string file = Write(text);
    (void)folder_.Write("biped.yaml", model);
    RunOptions options;
    options.pictures = false;
    options.out_dir = "";
    options.scenario.set = {{"simulation.mode", "inverse"}};
    const RunOutcome run = RunScenario(file, options);
    if (place == 0.13) {
      ASSERT_TRUE(run.report) << run.diagnostics.Text();
      EXPECT_EQ(run.exit_code, 0) << ToTable(*run.report, {});
    } else {
      EXPECT_EQ(run.exit_code, 2);
      EXPECT_NE(run.diagnostics.Text().find("from its place on the ground (contacts.there.to)"),
                std::string::npos)
          << run.diagnostics.Text();
    }
  }
}

}  // namespace
}  // namespace mbv
