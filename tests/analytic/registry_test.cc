// Rows from outside the source tree: they are found, and take the place of an older one.
#include <gtest/gtest.h>

#include <cstdlib>

#include "analytic/register_closed_form.h"

namespace mbv {
namespace {

WorkspaceForm Saying(const char* text) {
  WorkspaceForm form;
  form.text = text;
  return form;
}
WorkspaceForm FirstWorkspace(const Mechanism&, const WorkspaceRequest&) { return Saying("first"); }
WorkspaceForm SecondWorkspace(const Mechanism&, const WorkspaceRequest&) {
  return Saying("second");
}
std::unique_ptr<StiffnessForm> NoStiffness(const Mechanism&, const PoseCoordinates&,
                                           const std::string&, Diagnostics*) {
  return nullptr;
}

// Rows stay for the rest of a process, so each case has one of its own.
void ExpectInOwnProcess(bool (*holds)()) {
  EXPECT_EXIT(std::exit(holds() ? 0 : 1), testing::ExitedWithCode(0), "");
}

TEST(RegistrationDeathTest, OfAWorkspaceIsFoundAndReplaced) {
  ExpectInOwnProcess([] {
    if (FindWorkspaceForm("arm") != nullptr) return false;
    const size_t before = WorkspaceForms().size();
    const WorkspaceFormRegistration first({.mechanism = "arm", .compute = &FirstWorkspace});
    if (FindWorkspaceForm("arm")->compute({}, {}).text != "first") return false;
    const WorkspaceFormRegistration second({.mechanism = "arm", .compute = &SecondWorkspace});
    return FindWorkspaceForm("arm")->compute({}, {}).text == "second" &&
           WorkspaceForms().size() == before + 1;
  });
}

TEST(RegistrationDeathTest, OfAStiffnessBringsItsExamplePoseAndMaps) {
  ExpectInOwnProcess([] {
    if (FindStiffnessForm("arm") != nullptr) return false;
    const StiffnessFormRegistration mine({.mechanism = "arm",
                                          .output = "tool",
                                          .models = {"corrected"},
                                          .factory = &NoStiffness,
                                          .coverage = nullptr,
                                          .example_pose = {{"tool.x", 0.25}},
                                          .usual_maps = {"x=0:1:5,y=0:1:5"}});
    const StiffnessFormRow* row = FindStiffnessForm("arm");
    return row != nullptr && row->example_pose.at("tool.x") == 0.25 && row->usual_maps.size() == 1;
  });
}

TEST(Registration, WithoutAFunctionIsOurBug) {
  EXPECT_ANY_THROW(WorkspaceFormRegistration({.mechanism = "third_arm", .compute = nullptr}));
  EXPECT_EQ(FindWorkspaceForm("third_arm"), nullptr);
}

}  // namespace
}  // namespace mbv
