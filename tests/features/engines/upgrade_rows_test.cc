// Rows in two versions: which changes are known, and that any other is called unexplained.
#include "features/engines/crosscheck.h"

#include <gtest/gtest.h>

#include "simulation/engine/row_survey.h"
#include "tests/support/shipped.h"

namespace mbv {
namespace {

// One state with a row of each kind, in an old version that leaves the velocity term out.
RowSurvey OldRows() {
  RowSurvey survey;
  survey.summary = RunSummary::Done();
  survey.equalities = {"close:a", "close:b", "drive:c"};
  survey.kinds = {"connect", "weld", "tendon"};
  SurveyedState& state = survey.states.emplace_back();
  state.velocity_term = Vec3(0.5, -2.0, 0.1);
  state.present = {.R = Vec3(1e-7, 2e-7, 3e-7), .bias = Vec3::Zero(), .force = VecX::Ones(1)};
  return survey;
}

RowAnswer NewRows() {
  const RowSurvey old = OldRows();
  RowAnswer answer{.messages = {}, .equalities = old.equalities, .states = {old.states[0].present}};
  answer.states[0].bias = Vec3(0.5, -2.0, 0.0);
  answer.states[0].R[1] *= 4.0;
  return answer;
}

std::vector<std::string> Whys(const RowSurvey& survey, const RowAnswer& answer) {
  std::vector<std::string> whys;
  for (const RowChange& change : CompareRows(survey, answer)) whys.push_back(change.why);
  return whys;
}

TEST(UpgradeRows, NamesTheKnownChanges) {
  const auto changes = CompareRows(OldRows(), NewRows());
  ASSERT_EQ(changes.size(), 3U);
  EXPECT_EQ(changes[0].kind, "connect");
  EXPECT_EQ(changes[0].rows, 1);
  EXPECT_EQ(changes[0].velocity_term, 0.5);
  EXPECT_EQ(changes[0].left_out_old, 0.5);
  EXPECT_EQ(changes[0].left_out_new, 0.0);
  EXPECT_EQ(changes[0].why, "3.7.0: the velocity term is supplied");
  EXPECT_DOUBLE_EQ(changes[1].softness_most, 4.0);
  EXPECT_EQ(changes[1].why,
            "3.0: a weld's rotations are softened by their own inertia; 3.7.0: the velocity term "
            "is supplied");
  EXPECT_EQ(changes[2].why, "the velocity term is left out by both");
}

TEST(UpgradeRows, CallsOtherDifferencesUnexplained) {
  RowAnswer perturbed = NewRows();
  perturbed.states[0].R[0] *= 1.0 + 1e-5;
  EXPECT_EQ(Whys(OldRows(), perturbed)[0],
            "not explained: another softness; 3.7.0: the velocity term is supplied");
  RowAnswer tendon = NewRows();
  tendon.states[0].bias[2] = 0.1;
  EXPECT_EQ(Whys(OldRows(), tendon)[2], "not explained: another velocity term");
  RowSurvey right = OldRows();
  right.states[0].present.bias = right.states[0].velocity_term;
  EXPECT_EQ(Whys(right, NewRows())[2], "not explained: the velocity term was right before");
  EXPECT_EQ(Whys(right, NewRows())[0], "nothing changed");
}

// Of slides and of planes that stay what they are.
TEST(UpgradeRows, RoundOffIsNoVelocityTerm) {
  RowSurvey survey = OldRows();
  survey.states[0].state.qvel = Vec3(0.2, -1.0, 0.4);
  survey.states[0].velocity_term = Vec3(2.6e-14, -1e-14, 0.0);
  RowAnswer answer = NewRows();
  answer.states[0] = survey.states[0].present;
  for (const std::string& why : Whys(survey, answer)) EXPECT_EQ(why, "nothing changed");
}

TEST(UpgradeRows, AreComparedOnlyWhereTheyAreTheSame) {
  RowAnswer other = NewRows();
  other.equalities[0] = "close:z";
  EXPECT_TRUE(CompareRows(OldRows(), other).empty());
  EXPECT_EQ(CompareRows(OldRows(), NewRows()).size(), OldRows().states.empty() ? 0u : 3u);
}

}  // namespace
}  // namespace mbv
