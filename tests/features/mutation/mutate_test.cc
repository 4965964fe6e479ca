// Detection power on the shipped scenarios: which numbers may be 0.1 % wrong on the simulated side
// without anybody noticing? Every name below has a physical reason.
#include "features/mutation/mutate.h"
#include "tests/support/source_dir.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <set>

namespace mbv {
namespace {

using Names = std::set<std::string>;

MutationReport Mutate(const std::string& scenario, MutationOptions options = {}) {
  return MutateScenario(std::string(kSourceDir) + "/scenarios/" + scenario + ".yaml", options);
}

// Everything at one size, without searching for the smallest one.
MutationOptions WithFaults() {
  MutationOptions options;
  options.smallest = false;
  return options;
}

// The same without structural faults, by inverse dynamics.
MutationOptions Plain() {
  MutationOptions options = WithFaults();
  options.structural = false;
  options.modes = MutationModes::kInverse;
  return options;
}

// Of the parameters.
Names Undetected(const MutationReport& report) {
  Names names;
  for (const Mutation& m : report.mutations) {
    if (!m.own.detected && m.kind == NumberKind::kParameter) names.insert(m.name);
  }
  return names;
}

long CountOf(const MutationReport& report, NumberKind kind) {
  return std::count_if(report.mutations.begin(), report.mutations.end(),
                       [kind](const Mutation& m) { return m.kind == kind; });
}

const Mutation* FindMutation(const MutationReport& report, const std::string& name) {
  for (const Mutation& m : report.mutations) {
    if (m.name == name) return &m;
  }
  return nullptr;
}

TEST(Mutate, OnTheStabilizingPlatformOnlyWhatCannotActStaysUnseen) {
  const MutationReport report = Mutate("stabilizing_platform/sea_state", Plain());
  EXPECT_EQ(report.exit_code, 0) << report.diagnostics.Text();
  EXPECT_EQ(Undetected(report),
            (Names{
                "I_p_x", "I_p_y",    // the platform stays level: it only turns about z
                "m_ship", "I_ship",  // the ship's motion is prescribed
                "z_0",               // the height is commanded; in the model it starts the solver
                "l_0", "lambda_0", "D_0", "q1_0", "q2_0",  // where the home solution starts
            }));
  EXPECT_EQ(CountOf(report, NumberKind::kParameter), 55);
  EXPECT_EQ(CountOf(report, NumberKind::kInstance), 3);
}

TEST(Mutate, OnTheTripodOnlyWhatCannotActStaysUnseen) {
  const MutationReport report = Mutate("spr_tripod/default_inverse", Plain());
  EXPECT_EQ(report.exit_code, 0) << report.diagnostics.Text();
  EXPECT_EQ(Undetected(report),
            (Names{
                "I_platform_xx",  // the path lies in the plane of leg 3: no turn about x …
                "I_platform_zz",  // … nor about z
                "tool_z",         // the point of a load that this scenario does not have
            }));
  // Home and the strokes that define it turn the axes in which reactions are reported.
  for (const char* name : {"q_home", "z_home", "q_min", "q_max"}) {
    const Mutation* m = FindMutation(report, name);
    ASSERT_NE(m, nullptr) << name;
    EXPECT_FALSE(m->own.by_force) << name;
    EXPECT_EQ(m->own.best_check, "simulated_vs_analytic.reaction_nrmse") << name;
  }
}

TEST(Mutate, OnTheScaraRobotOnlyWhatCannotActStaysUnseen) {
  const MutationReport report = Mutate("scara_robot/pick_place", Plain());
  EXPECT_EQ(report.exit_code, 0) << report.diagnostics.Text();
  EXPECT_EQ(Undetected(report), (Names{
                                    "I_p_x",     "I_p_y",      "I_plate_x",
                                    "I_plate_y", "I_plate_xy",  // only turns about z
                                    "bar_com",   "I_bar_x",    "I_bar_y",
                                    "I_bar_z",    // the bars move without turning
                                    "ball_mass",  // moved between bodies that share the point
                                    "d",          // the width of a parallelogram
                                    "home_x",    "home_y",     "home_z",
                                    "home_phi",  "branch",  // where the solution starts
                                    "theta_min", "theta_max",  "shear_max",  // ranges
                                }));
  // A flat bar's inertias obey x = y + z; x alone may become smaller only, y alone hardly larger.
  for (const char* name : {"I_bar_x", "I_bar_y"}) {
    const Mutation* bar = FindMutation(report, name);
    ASSERT_NE(bar, nullptr) << name;
    EXPECT_TRUE(bar->own.ran) << name;
    EXPECT_EQ(bar->proved_to, kLargestPerturbation) << bar->reason;
  }
  EXPECT_EQ(FindMutation(report, "I_bar_x")->own.only, "smaller");
}

TEST(Mutate, OnTheCabinRobotOnlyWhatCannotActStaysUnseen) {
  const MutationReport report = Mutate("cabin_robot/zero_g", Plain());
  EXPECT_EQ(report.exit_code, 0) << report.diagnostics.Text();
  Names expected{
      "w",             // pictures
      "c_carriage_z",  // along the rail, which bears no moment about itself
      "I_AB_x",
      "I_AB_y",
      "I_CD_x",
      "I_CD_y",
      "I_EF_x",
      "I_EF_y",  // links turn about z only
      "I_platform_x",
      "I_platform_y",  // so does the platform
      "Y_home",
      "d1_home",
      "d5_home",
      "alpha_home",
      "beta_home",
      "epsilon_home",  // start
  };
  for (const char* body : {"carriage", "sliderA", "sliderD", "sliderF"}) {
    // They move without turning.
    for (const char* axis : {"_x", "_y", "_z"}) expected.insert("I_" + std::string(body) + axis);
  }
  EXPECT_EQ(Undetected(report), expected);
}

// Screw, gear, rotors, springs, oil and dry friction. At home alone statics determines more of the
// screw's reactions than along the motion. The bars turn about z only.
TEST(Mutate, OnAMachineWithItsElementsOnlyTheBarsRadiusStaysUnseen) {
  const MutationReport report = Mutate("machine_five_bar/draw_inverse", Plain());
  EXPECT_EQ(report.exit_code, 0) << report.diagnostics.Text();
  EXPECT_EQ(Undetected(report), Names{"bar"});
}

TEST(Mutate, ASmallErrorIsMissedAndSaysSo) {
  const MutationReport report = Mutate("spr_tripod/default_inverse",
                                       {.size = 1e-10, .numbers = {"I_rod_zz"}, .progress = {}});
  ASSERT_EQ(report.mutations.size(), 1u);
  EXPECT_FALSE(report.mutations[0].own.detected);
  EXPECT_FALSE(report.mutations[0].reason.empty());
}

TEST(Mutate, TheSmallestErrorIsDetectedAndOneResolutionSmallerIsNot) {
  for (const char* parameter : {"m_rod", "I_rod_zz", "b", "phi_3"}) {
    MutationOptions options{.size = 1e-3, .numbers = {parameter}, .progress = {}};
    const MutationReport report = Mutate("spr_tripod/default_inverse", options);
    ASSERT_EQ(report.mutations.size(), 1u);
    const double smallest = report.mutations[0].own.smallest;
    EXPECT_LT(smallest, 1e-5) << parameter;
    const auto detected_at = [&](double size) {
      options.size = size;
      options.smallest = false;
      return Mutate("spr_tripod/default_inverse", options).mutations[0].own.detected;
    };
    EXPECT_TRUE(detected_at(smallest)) << parameter;
    EXPECT_FALSE(detected_at(smallest / (1.0 + report.resolution))) << parameter;
  }
}

TEST(Mutate, AFinerResolutionNarrowsTheSearch) {
  const MutationReport report =
      Mutate("four_bar/turn_inverse",
             {.size = 1e-2, .numbers = {"rho"}, .progress = {}, .resolution = 1e-3});
  ASSERT_EQ(report.mutations.size(), 1u);
  // Forces are proportional to the density: the NRMSE is the relative error itself, its limit
  // 1e-10.
  EXPECT_NEAR(report.mutations[0].own.smallest, 1e-10, 1.1e-13);
  EXPECT_EQ(report.mutations[0].own.best_check, "simulated_vs_reference.force_nrmse");
}

TEST(Mutate, ParametersThatAreZeroArePerturbedByAShareOfTheirLike) {
  const MutationReport report = Mutate(
      "spr_tripod/default_inverse", {.size = 1e-3, .numbers = {"phi_3", "m_rod"}, .progress = {}});
  const Mutation* zero = FindMutation(report, "phi_3");
  ASSERT_NE(zero, nullptr);
  EXPECT_EQ(zero->value, 0.0);
  EXPECT_NEAR(zero->relative_to, 150.0 / 180.0 * 3.14159265358979, 1e-12);  // theta_2
  EXPECT_TRUE(zero->own.by_force);
  EXPECT_NE(ToText(report, false).find("relative to 2.61799 rad; "), std::string::npos);
  const Mutation* other = FindMutation(report, "m_rod");
  ASSERT_NE(other, nullptr);
  EXPECT_EQ(other->relative_to, other->value);
}

TEST(Mutate, WhatIsMissedAtTheSizeAskedForIsSearchedForAbove) {
  const MutationReport report =
      Mutate("four_bar/turn_inverse", {.size = 1e-11, .numbers = {"rho"}, .progress = {}});
  ASSERT_EQ(report.mutations.size(), 1u);
  EXPECT_FALSE(report.mutations[0].own.detected);
  EXPECT_NEAR(report.mutations[0].own.smallest, 1e-10, 1.1e-11);
  EXPECT_EQ(report.exit_code, 1);  // it matters and was missed
}

TEST(Mutate, WhatForcesCannotSeeIsProvedByPerturbationsOfTenPercent) {
  const MutationReport report = Mutate("spr_tripod/default_inverse", Plain());
  for (const Mutation& m : report.mutations) {
    if (m.own.detected) continue;
    EXPECT_EQ(m.proved_to, kLargestPerturbation) << m.name;
    EXPECT_LE(m.sensitivity, 1e-12) << m.name;
    EXPECT_NE(m.reason.find("10 % too large changes no drive force"), std::string::npos)
        << m.reason;
  }
  const Mutation* inertia = FindMutation(report, "I_platform_zz");
  ASSERT_NE(inertia, nullptr);
  EXPECT_NE(
      inertia->reason.find("it changes the inertia of platform; the motion calls for the same "
                           "inertia forces"),
      std::string::npos)
      << inertia->reason;
  const Mutation* tool = FindMutation(report, "tool_z");
  ASSERT_NE(tool, nullptr);
  EXPECT_NE(tool->reason.find("no mass, joint, drive or output depends on it"), std::string::npos);
}

TEST(Mutate, WhereAnUnseenEffectGoesIsNamed) {
  const MutationReport report =
      Mutate("stabilizing_platform/static", {.size = 1e-3, .numbers = {"m_ship"}, .progress = {}});
  ASSERT_EQ(report.mutations.size(), 1u) << report.diagnostics.Text();
  const std::string& reason = report.mutations[0].reason;
  EXPECT_NE(reason.find("the mass of ship"), std::string::npos) << reason;
  EXPECT_NE(reason.find("carried by the prescribed motion"), std::string::npos) << reason;
}

const FaultResult* FindFault(const MutationReport& report, const std::string& kind) {
  for (const FaultResult& fault : report.faults) {
    if (fault.kind == kind) return &fault;
  }
  return nullptr;
}

TEST(Mutate, StructuralFaultsAreDetectedInAMechanismWithoutClosedForm) {
  const MutationReport report = Mutate("stewart/wave", WithFaults());
  EXPECT_EQ(report.exit_code, 0) << report.diagnostics.Text();
  for (const FaultResult& fault : report.faults) {
    EXPECT_EQ(fault.own.detected, fault.applicable) << fault.kind << " " << fault.where;
    EXPECT_EQ(fault.applicable ? fault.own.reason.empty() : fault.reason.empty(), fault.own.ran)
        << fault.kind;
    if (fault.own.ran) {
      EXPECT_GT(fault.own.value, fault.own.limit) << fault.kind;
    }
  }
  const FaultResult* gravity = FindFault(report, "9.80665 for 9.81");
  ASSERT_NE(gravity, nullptr);
  // The forces are mostly weight: 3.4e-4 less of it.
  EXPECT_NEAR(gravity->own.value, 1.0 - 9.80665 / 9.81, 5e-5);
  EXPECT_FALSE(FindFault(report, "sign of products of inertia")->applicable);
}

TEST(Mutate, DrivesThatDoTheSameMayBeSwappedUnseenAndSaySo) {
  // The path lies in the symmetry plane of legs 1 and 2.
  const MutationReport report = Mutate("spr_tripod/default_inverse", WithFaults());
  const FaultResult* swap = FindFault(report, "swapped drives");
  ASSERT_NE(swap, nullptr);
  EXPECT_EQ(swap->where, "leg1 and leg2");
  EXPECT_FALSE(swap->own.detected);
  EXPECT_NE(swap->own.reason.find("leg1 and leg2 do the same"), std::string::npos)
      << swap->own.reason;
}

TEST(Mutate, AnotherAssemblyIsSeenByForcesNotOnlyByRanges) {
  const MutationReport report = Mutate("spr_tripod/default_inverse", WithFaults());
  const FaultResult* elbow = FindFault(report, "wrong elbow branch");
  ASSERT_NE(elbow, nullptr);
  EXPECT_TRUE(elbow->own.ran) << elbow->own.reason;
  EXPECT_EQ(elbow->own.check, "simulated_vs_analytic.force_nrmse");
  EXPECT_GT(elbow->own.value, 0.1);
}

TEST(Mutate, ATableOfFewDigitsSeesLessThanTheGenericSolver) {
  const MutationOptions options{.size = 1e-2, .numbers = {"rho"}, .progress = {}};
  const MutationReport table = Mutate("four_bar/table_excel", options);
  ASSERT_EQ(table.mutations.size(), 1u) << table.diagnostics.Text();
  // The solver beside the table still sees it; against the table alone it would be about 1e-3.
  EXPECT_EQ(table.mutations[0].own.best_check, "simulated_vs_solver.force_nrmse");
  EXPECT_NEAR(table.mutations[0].own.smallest, 1e-10, 1.1e-11);
}

TEST(Mutate, UnknownParametersAreBadInput) {
  const MutationReport report =
      Mutate("four_bar/turn_inverse", {.size = 1e-2, .numbers = {"roh"}, .progress = {}});
  EXPECT_EQ(report.exit_code, 2);
  EXPECT_NE(report.diagnostics.Text().find("did you mean 'rho'?"), std::string::npos);
}

TEST(Mutate, ResultsAreJsonToo) {
  const MutationReport report = Mutate("four_bar/turn_inverse");
  const auto json = nlohmann::json::parse(ToJson(report));
  EXPECT_EQ(json["schema"], "mbverify.mutate/2");
  EXPECT_EQ(json["size"], 1e-3);
  ASSERT_EQ(json["numbers"].size(), report.mutations.size());
  ASSERT_EQ(json["faults"].size(), report.faults.size());
  for (size_t i = 0; i < report.mutations.size(); ++i) {
    const Mutation& m = report.mutations[i];
    EXPECT_EQ(json["numbers"][i]["name"], m.name);
    EXPECT_EQ(json["numbers"][i]["own"]["smallest"].is_null(), std::isnan(m.own.smallest));
  }
  const auto back = MutationReportOf(ToJson(report));
  ASSERT_TRUE(back.has_value());
  EXPECT_EQ(ToJson(*back), ToJson(report));
  EXPECT_FALSE(MutationReportOf("{}").has_value());
}

TEST(Mutate, PartsOfWorkersMakeTheWhole) {
  MutationOptions options = WithFaults();
  MutationReport whole = Mutate("four_bar/turn_inverse", options);
  options.parts = 3;
  std::vector<MutationReport> parts;
  for (options.part = 0; options.part < 3; ++options.part) {
    parts.push_back(Mutate("four_bar/turn_inverse", options));
  }
  MutationReport merged = MergeParts(std::move(parts));
  whole.wall_s = merged.wall_s = 0.0;
  EXPECT_EQ(ToJson(merged), ToJson(whole));
}

TEST(Mutate, AForwardScenarioIsPerturbedInItsOwnModeAndLimitsAndInInverseMode) {
  MutationOptions options{.size = 1e-3, .numbers = {"rho"}, .progress = {}};
  const MutationReport report = Mutate("four_bar/turn", options);
  EXPECT_EQ(report.mode, "forward");
  ASSERT_EQ(report.mutations.size(), 1u) << report.diagnostics.Text();
  const Mutation& m = report.mutations[0];
  ASSERT_TRUE(m.inverse.has_value());
  // Forces are proportional to the density: the limits themselves are found.
  EXPECT_NEAR(m.inverse->smallest, 1e-10, 1.1e-11);
  EXPECT_GT(m.own.smallest, 10.0 * m.inverse->smallest);
  // Between the two, inverse mode sees what the scenario as it runs does not.
  options.size = std::sqrt(m.own.smallest * m.inverse->smallest);
  const MutationReport between = Mutate("four_bar/turn", options);
  EXPECT_FALSE(between.mutations[0].own.detected);
  EXPECT_TRUE(between.mutations[0].inverse->detected);
  EXPECT_EQ(between.exit_code, 1);
  EXPECT_NE(between.mutations[0].reason.find("below the limit"), std::string::npos);
}

// Pushed by the right forces a wrong mass goes elsewhere; servos need other forces on the way that
// they went. Held on its motion neither would be what the scenario does.
TEST(Mutate, PushedAndServoDrivesArePerturbedAsTheyAreDriven) {
  MutationOptions options = WithFaults();
  options.numbers = {"m_platform"};
  for (const MutationModes modes : {MutationModes::kBoth, MutationModes::kOwn}) {
    options.modes = modes;
    const MutationReport pushed = Mutate("spr_tripod/force_driven", options);
    ASSERT_EQ(pushed.mutations.size(), 1u) << pushed.diagnostics.Text();
    EXPECT_EQ(pushed.exit_code, 0) << pushed.diagnostics.Text();
    EXPECT_EQ(pushed.mode, "force_driven");
    const Mutation& m = pushed.mutations.front();
    EXPECT_TRUE(m.own.detected);
    EXPECT_FALSE(m.own.by_force) << "the forces are given";
    EXPECT_EQ(m.own.best_check.find("force"), std::string::npos) << m.own.best_check;
    ASSERT_TRUE(m.inverse);
    EXPECT_TRUE(m.inverse->by_force);
  }
  options.modes = MutationModes::kBoth;
  const MutationReport servo = Mutate("spr_tripod/servo_feedforward", options);
  ASSERT_EQ(servo.mutations.size(), 1u) << servo.diagnostics.Text();
  EXPECT_EQ(servo.mode, "servo");
  const Mutation& m = servo.mutations.front();
  EXPECT_TRUE(m.own.detected && m.own.by_force);
  EXPECT_NE(m.own.best_check.find("reached"), std::string::npos) << m.own.best_check;
}

TEST(Mutate, ForwardPickAndPlaceSeesWhatInverseModeSees) {
  MutationOptions options = WithFaults();
  options.structural = false;
  // Of each kind some: what acts, what does not, where home lies, the assembly, a range.
  options.numbers = {"l1", "l3", "e", "m_p", "I_p_x", "arm_com", "home_z", "branch", "theta_max"};
  const MutationReport report = Mutate("scara_robot/pick_place", options);
  EXPECT_EQ(report.exit_code, 0) << ToText(report, false);
  EXPECT_EQ(report.mutations.size(), options.numbers.size());
  for (const Mutation& m : report.mutations) {
    ASSERT_TRUE(m.inverse.has_value());
    EXPECT_EQ(m.own.by_force, m.inverse->by_force) << m.name << " " << m.reason;
  }
}

TEST(Mutate, NumbersOfInstancesAndNumbersWrittenInPlaceArePerturbed) {
  const MutationReport report = Mutate("stewart/wave", Plain());
  EXPECT_EQ(report.exit_code, 0) << ToText(report, false);
  for (const auto& [name, kind] :
       {std::pair{"m_rod", NumberKind::kParameter}, std::pair{"leg1.base", NumberKind::kInstance},
        std::pair{"leg6.top", NumberKind::kInstance},
        std::pair{"parts.leg.bodies.cyl.inertia[0]", NumberKind::kLiteral},
        std::pair{"parts.leg.bodies.rod.inertia[2]", NumberKind::kLiteral}}) {
    const Mutation* m = FindMutation(report, name);
    ASSERT_NE(m, nullptr) << name;
    EXPECT_EQ(m->kind, kind) << name;
    EXPECT_TRUE(m->own.by_force) << name;
  }
  EXPECT_EQ(FindMutation(report, "parts.leg.bodies.rod.inertia[2]")->unit, "kg m^2");
  // Ranges and pictures are not numbers that could act; zeros are structure.
  for (const Mutation& m : report.mutations) {
    EXPECT_EQ(m.name.find("range"), std::string::npos) << m.name;
    EXPECT_EQ(m.name.find("shapes"), std::string::npos) << m.name;
    EXPECT_TRUE(m.kind != NumberKind::kLiteral || m.value != 0.0) << m.name;
  }
}

TEST(Mutate, ErrorsOfBothSignsMustBeSeen) {
  // A motor's range that is too wide is never noticed, one that is much too narrow is.
  const MutationReport report = Mutate(
      "scara_robot/pick_place",
      {.size = 0.9, .numbers = {"theta_max"}, .progress = {}, .modes = MutationModes::kInverse});
  ASSERT_EQ(report.mutations.size(), 1u) << report.diagnostics.Text();
  const Detection& seen = report.mutations[0].own;
  EXPECT_TRUE(seen.ran);
  EXPECT_EQ(seen.only, "larger");
  EXPECT_FALSE(seen.detected);
}

TEST(Mutate, AScenarioThatDisagreesIsNotPerturbed) {
  const MutationReport report = Mutate("spr_tripod/must_fail/analytic_mass");
  EXPECT_EQ(report.exit_code, 1);
  EXPECT_TRUE(report.mutations.empty());
  EXPECT_EQ(report.runs, 0u) << "nothing is perturbed";
  EXPECT_NE(report.diagnostics.Text().find("does not agree before anything is perturbed"),
            std::string::npos)
      << report.diagnostics.Text();
}

}  // namespace
}  // namespace mbv
