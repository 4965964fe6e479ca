#include "base/roles.h"

#include <gtest/gtest.h>

#include <set>
#include <vector>

namespace mbv {
namespace {

TEST(Roles, PairsStandInTheOrderInWhichTheyAreShown) {
  std::vector<std::string> names;
  for (const auto& [measured, truth] : kRolePairs) names.push_back(PairName(*measured, *truth));
  EXPECT_EQ(names, (std::vector<std::string>{"simulated_vs_analytic", "reference_vs_analytic",
                                             "simulated_vs_reference", "simulated_vs_solver",
                                             "reference_vs_solver", "simulated_vs_reached"}));
}

TEST(Roles, ARowIsFoundByItsName) {
  std::set<std::string> names;
  for (const Role* role : kRoles) {
    EXPECT_TRUE(names.insert(role->name).second) << role->name;
    EXPECT_EQ(FindRole(role->name), role);
    EXPECT_EQ(IsEngine(role->name), role->is_engine());
  }
  EXPECT_EQ(FindRole("printed"), nullptr);
  EXPECT_FALSE(IsEngine(""));
}

TEST(Roles, NoRoleIsComparedWithItself) {
  for (const auto& [measured, truth] : kRolePairs) EXPECT_NE(measured, truth);
  for (const auto& [measured, truth] : kMainPairs) {
    EXPECT_TRUE(measured->IsHeldAgainst(*truth)) << PairName(*measured, *truth);
  }
}

TEST(Roles, OnlyEnginesFollowAndOnlyClosedFormsHaveNoBodies) {
  EXPECT_TRUE(role::kSimulated.is_engine());
  EXPECT_TRUE(role::kPerturbed.is_engine());
  for (const Role* role : {&role::kAnalytic, &role::kReference, &role::kSolver, &role::kReached}) {
    EXPECT_FALSE(role->is_engine()) << role->name;
    EXPECT_EQ(role->has_bodies(), role != &role::kAnalytic) << role->name;
    EXPECT_EQ(role->judged_alone(), role != &role::kReached) << role->name;
  }
}

}  // namespace
}  // namespace mbv
