// The closed-form stiffness as the stiffness command uses it: names, poses, models, shares,
// findings.
#include "analytic/stiffness_form.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <set>
#include <string>

#include "tests/analytic/scara_robot_stiffness_fixture.h"
#include "tests/support/allocation_counter.h"

namespace mbv {
namespace {

struct StiffnessCase {
  Mechanism mechanism;
  PoseCoordinates pose;
};

StiffnessCase ScaraCase() {
  StiffnessCase c{
      scara_robot::PaperMechanism(),
      {{"platform.x", -0.05}, {"platform.y", -0.05}, {"platform.z", -0.15}, {"platform.yaw", 0.2}}};
  for (const auto& [name, value] : {std::pair{"d", 0.05},
                                    {"E", 210e9},
                                    {"nu", 0.3},
                                    {"section_diameter", 0.008},
                                    {"K_act", 5000.0}}) {
    c.mechanism.parameters.push_back({name, value, "", Source::kUnstated, ""});
  }
  return c;
}

StiffnessCase CabinCase() {
  StiffnessCase c;
  c.mechanism.name = "cabin_robot";
  for (const auto& [name, value] :
       {std::pair{"L1", 0.52}, {"L2", 0.42},    {"L3", 0.5},        {"L4", 0.28},
        {"w", 0.24},           {"a2", 0.0},     {"d3", 0.261},      {"a3", 0.485},
        {"a4", 0.05},          {"d6", 0.01},    {"E", 71e9},        {"G", 26.7e9},
        {"b_AB", 0.08},        {"h_AB", 0.07},  {"b_CD", 0.06},     {"h_CD", 0.05},
        {"b_EF", 0.06},        {"h_EF", 0.05},  {"b_column", 0.32}, {"h_column", 0.12},
        {"b_arm", 0.32},       {"h_arm", 0.07}, {"b_rail", 0.3},    {"h_rail", 0.08},
        {"b_tool", 0.24},      {"h_tool", 0.2}, {"d5", -0.2},       {"torsion_printed", 0.0}}) {
    c.mechanism.parameters.push_back({name, value, "", Source::kUnstated, ""});
  }
  c.pose = {{"d1", 0.5},           {"platform.x", 0.0}, {"platform.y", 0.36},
            {"platform.yaw", 0.0}, {"th4", 0.0},        {"th3", std::numbers::pi / 2},
            {"th6", 0.0}};
  return c;
}

std::unique_ptr<StiffnessForm> Make(const StiffnessCase& c, const std::string& model,
                                    Diagnostics* diagnostics) {
  const StiffnessFormRow* row = FindStiffnessForm(c.mechanism.name);
  EXPECT_NE(row, nullptr);
  return row->factory(c.mechanism, c.pose, model, diagnostics);
}

/// Largest |A − B| in units of the rows' and columns' diagonal in B.
double ScaledDifference(const Mat6& A, const Mat6& B) {
  const Vec6 size = B.diagonal().cwiseSqrt().cwiseInverse();
  return (size.asDiagonal() * (A - B) * size.asDiagonal()).eval().cwiseAbs().maxCoeff();
}

void ExpectLaws(const StiffnessCase& c, const std::string& model, int elements) {
  Diagnostics diagnostics;
  const auto form = Make(c, model, &diagnostics);
  ASSERT_NE(form, nullptr) << diagnostics.Text();
  const StiffnessResult result = form->Evaluate(c.pose);
  ASSERT_TRUE(result.summary.ok()) << result.summary.message;
  EXPECT_EQ(result.rank, 6);
  EXPECT_LT(ScaledDifference(result.K, result.K.transpose()), 1e-15);
  EXPECT_LT(ScaledDifference(result.C.inverse(), result.K), 1e-9);
  ASSERT_EQ(static_cast<int>(result.shares.size()), elements);
  Mat6 sum = Mat6::Zero();
  std::set<std::string> names;
  for (const ComplianceShare& share : result.shares) {
    sum += share.C;
    names.insert(share.element);
    EXPECT_GE(share.C.diagonal().minCoeff(), 0.0) << share.element;
  }
  EXPECT_EQ(static_cast<int>(names.size()), elements);
  EXPECT_LT(ScaledDifference(sum, result.C), 1e-10);
  sum -= result.shares.front().C;  // a missing element is seen
  EXPECT_GT(ScaledDifference(sum, result.C), 1e-10);
  std::vector<double> indices(form->indices().size(), kNan);
  form->IndexValues(result, indices);
  EXPECT_TRUE(std::all_of(indices.begin(), indices.end(), [](double v) { return v > 0.0; }));
  const StiffnessResult matrices = form->EvaluateMatrices(c.pose);
  EXPECT_EQ(matrices.K, result.K);
  EXPECT_EQ(matrices.C, result.C);
  EXPECT_EQ(matrices.rank, result.rank);
  EXPECT_TRUE(matrices.shares.empty());
}

TEST(StiffnessForm, EveryMechanismHasTheDefaultModelFirst) {
  for (const StiffnessFormRow& row : StiffnessForms()) {
    ASSERT_GE(row.models.size(), 2u);
    EXPECT_EQ(row.models.front(), "corrected");
    EXPECT_NE(std::find(row.models.begin(), row.models.end(), "as_printed"), row.models.end());
    EXPECT_EQ(FindStiffnessForm(row.mechanism), &row);
  }
  EXPECT_EQ(FindStiffnessForm("spr_tripod"), nullptr);
}

TEST(StiffnessForm, SharesAddUpToTheCompliance) {
  ExpectLaws(ScaraCase(), "", 16);
  ExpectLaws(CabinCase(), "", 12);
}

TEST(StiffnessForm, EveryScaraModelIsWhole) {
  for (const std::string& model : FindStiffnessForm("scara_robot")->models) {
    ExpectLaws(ScaraCase(), model, 16);
  }
}

TEST(StiffnessForm, ServosSofteningIsTheirShare) {
  // C is linear in neither, but dC/dln(1/K_act) is the servos' share (Castigliano).
  StiffnessCase c = ScaraCase();
  Diagnostics diagnostics;
  const StiffnessResult result = Make(c, "", &diagnostics)->Evaluate(c.pose);
  Mat6 servos = Mat6::Zero();
  for (const ComplianceShare& share : result.shares) {
    if (share.element.ends_with("(servo)")) servos += share.C;
  }
  constexpr double h = 1e-4;
  const auto with = [&](double factor) {
    StiffnessCase softer = c;
    for (Parameter& p : softer.mechanism.parameters) {
      if (p.name == "K_act") p.value /= factor;
    }
    return Make(softer, "", &diagnostics)->Evaluate(c.pose).C;
  };
  const Mat6 derivative = (with(1 + h) - with(1 - h)) / (2 * h);
  // The difference of second order in h is 1e-8 of C.
  EXPECT_LT(ScaledDifference(derivative - servos + result.C, result.C), 1e-6);
  EXPECT_GT(ScaledDifference(derivative - 1.001 * servos + result.C, result.C), 1e-6);
}

TEST(StiffnessForm, RodsOfAParallelogramShareItsCompliance) {
  Diagnostics diagnostics;
  const StiffnessCase c = ScaraCase();
  const StiffnessResult result = Make(c, "", &diagnostics)->Evaluate(c.pose);
  const auto share = [&](const std::string& name) {
    const auto at = std::find_if(result.shares.begin(), result.shares.end(),
                                 [&](const ComplianceShare& s) { return s.element == name; });
    EXPECT_NE(at, result.shares.end()) << name;
    return at->C;
  };
  // The couple that levels the platform loads the rods unequally.
  EXPECT_GT((share("limb1.rod_a") - share("limb1.rod_b")).norm(),
            1e-4 * share("limb1.rod_a").norm());
}

TEST(StiffnessForm, CabinTakesTheSlideFromThePoseOrTheModel) {
  StiffnessCase c = CabinCase();
  Diagnostics diagnostics;
  const StiffnessResult from_model = Make(c, "", &diagnostics)->Evaluate(c.pose);
  c.pose["d5"] = -0.2;
  const StiffnessResult from_pose = Make(c, "", &diagnostics)->Evaluate(c.pose);
  EXPECT_EQ(from_model.K, from_pose.K);
  c.pose["d5"] = -0.3;
  EXPECT_GT((Make(c, "", &diagnostics)->Evaluate(c.pose).K - from_pose.K).norm(),
            0.01 * from_pose.K.norm());
  // Rail and bearing do not matter.
  c.pose["d5"] = -0.2;
  c.pose["d1"] = 1.7;
  c.pose["th6"] = 1.0;
  EXPECT_EQ(Make(c, "", &diagnostics)->Evaluate(c.pose).K, from_pose.K);
}

TEST(StiffnessForm, CabinIndicesAreTheDiagonalOfC) {
  Diagnostics diagnostics;
  const StiffnessCase c = CabinCase();
  const auto form = Make(c, "", &diagnostics);
  const StiffnessResult result = form->Evaluate(c.pose);
  std::vector<double> values(6);
  form->IndexValues(result, values);
  EXPECT_EQ(form->indices()[0].name, "c_x");
  EXPECT_EQ(values[0], result.C(3, 3));
  EXPECT_EQ(values[3], result.C(0, 0));
  EXPECT_NEAR(values[1], 1.26042e-7, 1e-12);  // exact torsion constant
}

TEST(StiffnessForm, PrintedCabinIsNotSymmetricAndHasNoShares) {
  Diagnostics diagnostics;
  const StiffnessCase c = CabinCase();
  const StiffnessResult result = Make(c, "as_printed", &diagnostics)->Evaluate(c.pose);
  EXPECT_TRUE(result.summary.ok());
  EXPECT_TRUE(result.shares.empty());
  EXPECT_GT(ScaledDifference(result.C, result.C.transpose()), 0.1);
}

TEST(StiffnessForm, FindingsNameWhatDoesNotSuit) {
  StiffnessCase c = ScaraCase();
  c.pose.erase("platform.yaw");
  c.pose["limb1.drive"] = 0.3;
  c.mechanism.parameters.back().value = -1.0;  // K_act
  Diagnostics diagnostics;
  EXPECT_EQ(Make(c, "wrong", &diagnostics), nullptr);
  const std::string text = diagnostics.Text();
  for (const char* part :
       {"platform.yaw is not given", "cannot take the coordinate \"limb1.drive\"",
        "K_act = -1 violates K_act > 0", "unknown model \"wrong\"", "corrected, as_printed"}) {
    EXPECT_NE(text.find(part), std::string::npos) << part << "\n" << text;
  }

  StiffnessCase cabin = CabinCase();
  cabin.pose.erase("th3");
  cabin.pose["tool.x"] = 0.0;
  std::erase_if(cabin.mechanism.parameters,
                [](const Parameter& p) { return p.name == "d5" || p.name == "h_rail"; });
  Drive servo;
  servo.name = "th3";
  servo.stiffness = 1e6;
  cabin.mechanism.drives.push_back(servo);
  Diagnostics cabin_findings;
  EXPECT_EQ(Make(cabin, "printed_rods", &cabin_findings), nullptr);
  const std::string cabin_text = cabin_findings.Text();
  for (const char* part : {"th3 is not given", "d5 is not given", "coordinate \"tool.x\"",
                           "no parameter \"h_rail\"", "servo of th3", "unknown model"}) {
    EXPECT_NE(cabin_text.find(part), std::string::npos) << part << "\n" << cabin_text;
  }
}

TEST(StiffnessForm, UnreachableAndSingularPosesAreInTheSummary) {
  StiffnessCase c = ScaraCase();
  Diagnostics diagnostics;
  const auto form = Make(c, "", &diagnostics);
  c.pose["platform.x"] = 0.3;
  EXPECT_EQ(form->Evaluate(c.pose).summary.stop, Stop::kUnreachable);
  const StiffnessResult centre = form->Evaluate(
      {{"platform.x", 0}, {"platform.y", 0}, {"platform.z", -0.165}, {"platform.yaw", 0}});
  EXPECT_EQ(centre.summary.stop, Stop::kSingular);
  EXPECT_EQ(centre.rank, 5);
  EXPECT_TRUE(centre.K.allFinite());
  EXPECT_TRUE(centre.shares.empty());
  std::vector<double> values(form->indices().size());
  form->IndexValues(centre, values);
  EXPECT_NEAR(values[0], 5519, 0.5);
}

TEST(StiffnessForm, SweepsTakeNoMemory) {
  for (StiffnessCase c : {ScaraCase(), CabinCase()}) {
    Diagnostics diagnostics;
    const auto form = Make(c, "", &diagnostics);
    std::vector<double> values(form->indices().size());
    double& x = c.pose["platform.x"];
    const double start = x;
    const std::size_t before = AllocationCount();
    for (int k = 0; k < 100; ++k) {
      x = start + 1e-5 * k;
      const StiffnessResult result = form->EvaluateMatrices(c.pose);
      if (!result.summary.ok()) break;
      form->IndexValues(result, values);
    }
    EXPECT_EQ(AllocationCount(), before) << c.mechanism.name;
    EXPECT_NEAR(x, start + 99e-5, 1e-12);
  }
}

}  // namespace
}  // namespace mbv
