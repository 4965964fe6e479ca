// What a model's joints and drives determine, in words and for programs.
#include "report/result_tables.h"

#include "tests/mechanisms/two_sliders.h"
#include "tests/support/golden_file.h"

namespace mbv {
namespace {

Mechanism Sliders() {
  Mechanism mechanism = test::DrivenSliders();
  mechanism.file = "models/two_sliders/model.yaml";
  mechanism.description = "two sliders in a row";
  mechanism.joints[1].closure = true;
  Output output;
  output.name = "plate";
  mechanism.outputs = {output};
  return mechanism;
}

// Numbers that no mechanism has, each another one.
MobilityReport Counts() {
  MobilityReport report;
  Mobility& home = report.home;
  home = {.body_coordinates = 12,
          .constraint_rows = 11,
          .constraint_rank = 9,
          .dofs = 3,
          .redundant = 2,
          .kutzbach = 1,
          .drives = 2,
          .prescribed = 1,
          .undriven = 1,
          .drives_not_unique = {"d2"},
          .joints_not_unique = {"slide1"},
          .reactions_not_unique = {{"slide1", {"fx", "mz"}}},
          .smallest_kept = 0.25,
          .largest_dropped = 3e-16};
  Mobility near = home;
  near.smallest_kept = 0.125;
  near.largest_dropped = 4e-16;
  report.nearby = {near, home};
  report.loops = {{"slide2", {"slide1", "slide2"}, 4, 3}, {"hinge", {"hinge"}, 1, 6}};
  report.redundant = {{2, {"slide1", "slide2"}, {}, {}}};
  report.undetermined = {{1, {"slide1"}, {"d2"}, {"base"}}, {5, {"slide2"}, {}, {}}};
  report.free_bodies = {"a", "b"};
  return report;
}

TEST(MobilityText, IsAsWritten) { ExpectGolden("mobility.txt", MobilityText(Sliders(), Counts())); }

TEST(MobilityText, JsonIsAsWritten) {
  ExpectGolden("mobility.json", MobilityJson(Sliders(), Counts()));
}

TEST(MobilityText, SpinsBetweenTwoBallsAreReported) {
  MobilityReport report = Counts();
  report.home.idle_spins = {"leg1", "leg2"};
  report.spins_not_idle = {"rod: output 'o' shows its turn"};
  const std::string text = MobilityText(Sliders(), report);
  for (const char* line : {"constraints - 2 idle spins\n",
                           "  spin of leg2, idle: no force turns it, and no command needs to\n",
                           "  spin between two spherical joints that is a degree of freedom: rod: "
                           "output 'o' shows its turn\n"}) {
    EXPECT_NE(text.find(line), std::string::npos) << line << text;
  }
}

TEST(MobilityText, ASingularHomeAndOnesThatHoldNothingAreReported) {
  MobilityReport report = Counts();
  report.home.dofs = 4;
  EXPECT_NE(MobilityText(Sliders(), report)
                .find("  the home pose is singular: 4 degrees of freedom at home, 3 at 2 random "
                      "poses nearby; "
                      "choose guesses for another home\n"),
            std::string::npos);
  report = Counts();
  for (Mobility& near : report.nearby) near.undriven = 0;
  EXPECT_NE(
      MobilityText(Sliders(), report)
          .find("  only at home: nearby the drives leave 0 degrees of freedom; the home pose is "
                "singular for these drives\n"),
      std::string::npos);
  report = Counts();
  report.home.undriven = report.home.redundant = 0;
  report.home.drives_not_unique.clear();
  report.home.reactions_not_unique.clear();
  report.nearby.clear();
  const std::string text = MobilityText(Sliders(), report);
  for (const char* line :
       {"  drives and prescribed joints determine the motion\n",
        "  redundant constraints: 0; Kutzbach's count is right\n",
        "  drive forces: all determined by statics\n",
        "  joint reactions: all determined by statics\n",
        "    by numerical rank at home;\n    smallest singular value kept 2.5e-01, largest dropped "
        "3.0e-16\n"}) {
    EXPECT_NE(text.find(line), std::string::npos) << line << text;
  }
}

}  // namespace
}  // namespace mbv
