// Runs of a user's file on their way out of a child process.
#include "features/mjcf_audit/source_audit.h"

#include <gtest/gtest.h>

#include <cmath>

namespace mbv {
namespace {

SourceModelRun ExampleRun() {
  SourceModelRun run;
  run.summary = {.stop = Stop::kEngineFailure,
                 .message = "it\nended at C",
                 .time_s = 0.5,
                 .where = "C",
                 .amount = 2.0,
                 .unit = "m",
                 .wall_s = 9.0,
                 .names_where = true,
                 .states_time = true};
  run.facts.step_s = 0.002;
  run.facts.closures = {"C", ""};
  run.facts.held_by = {DriveHold::kServo, DriveHold::kAdded};
  run.facts.rough_solver = true;
  run.trace.Reset({0.0, 0.01}, {MakeChannel(Quantity::kForce, "N m", "m")});
  run.trace.values << 1.5, kNan;
  run.gaps = {{.position_m = 1.0, .position_at_s = 2.0, .rotation_rad = 3.0, .rotation_at_s = 4.0}};
  run.notes = {"a limit pushes"};
  run.cost_ms = 7.0;
  return run;
}

TEST(SourceModelRunBytes, ComeBackAsTheyWere) {
  const SourceModelRun run = ExampleRun();
  const auto back = FromBytes<SourceModelRun>(ToBytes(run));
  ASSERT_TRUE(back);
  EXPECT_EQ(back->summary.stop, run.summary.stop);
  EXPECT_EQ(back->summary.message, run.summary.message);
  EXPECT_EQ(back->summary.time_s, 0.5);
  EXPECT_EQ(back->summary.where, "C");
  EXPECT_EQ(back->summary.amount, 2.0);
  EXPECT_EQ(back->summary.unit, "m");
  EXPECT_EQ(back->summary.wall_s, 9.0);
  EXPECT_TRUE(back->summary.names_where);
  EXPECT_TRUE(back->summary.states_time);
  EXPECT_EQ(back->facts.closures, run.facts.closures);
  EXPECT_EQ(back->facts.held_by, run.facts.held_by);
  EXPECT_TRUE(back->facts.rough_solver);
  EXPECT_EQ(back->trace.time_s, run.trace.time_s);
  EXPECT_EQ(back->trace.channels[0].name, "m.force");
  EXPECT_EQ(back->trace.values(0, 0), 1.5);
  EXPECT_TRUE(std::isnan(back->trace.values(1, 0)));
  EXPECT_EQ(back->gaps[0].rotation_at_s, 4.0);
  EXPECT_EQ(back->notes, run.notes);
  EXPECT_EQ(back->cost_ms, 7.0);
}

// A child that dies while it writes, or writes too much.
TEST(SourceModelRunBytes, PartsAreNoRun) {
  const std::string bytes = ToBytes(ExampleRun());
  for (size_t size = 0; size < bytes.size(); ++size) {
    EXPECT_FALSE(FromBytes<SourceModelRun>(bytes.substr(0, size))) << size;
  }
  EXPECT_FALSE(FromBytes<SourceModelRun>(bytes + "x"));
  EXPECT_FALSE(FromBytes<SourceModelRun>(std::string(1000, '\xff')));
}

}  // namespace
}  // namespace mbv
