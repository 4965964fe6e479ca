// Binary files of traces, read back by the programs that their users have.
#include "data/data_file.h"

#include <gtest/gtest.h>

#include <chrono>
#include <cstdio>
#include <memory>
#include <thread>

#include "tests/test_folder.h"

namespace mbv {
namespace {

// What a shell command prints to standard output.
std::string Output(const std::string& command) {
  const std::unique_ptr<FILE, int (*)(FILE*)> pipe(popen(command.c_str(), "r"), &pclose);
  std::string text;
  char piece[4096];
  while (pipe != nullptr && std::fgets(piece, sizeof piece, pipe.get()) != nullptr) text += piece;
  return text;
}

Trace Reference() {
  Trace trace;
  trace.witness = "reference";
  trace.Reset({0.0, 0.1, 0.25}, {MakeChannel(Quantity::kForce, "N m", "arm.motor"),
                                 MakeChannel(Quantity::kReaction, "N", "hinge", "hinge.F", 2),
                                 {.name = "eigen λ", .unit = "", .frame = {}}});
  trace.values << 1.0 / 3.0, -2e-300, 1, 0.1, kNan, 2, 12345.678901234567, 0.0, 3;
  return trace;
}

Trace Simulated() {
  Trace trace;
  trace.witness = "simulated";
  trace.Reset({0.0}, {MakeChannel(Quantity::kForce, "N m", "arm.motor")});
  trace.values << 0.3;
  return trace;
}

std::string BytesOf(const std::string& word) {
  const Trace reference = Reference(), simulated = Simulated();
  std::string trouble;
  std::string bytes = DataBytes(
      *FindDataFormat(word), {{"mechanism", "four_bar"}, {"description", "größer"}, {"none", ""}},
      {&reference, &simulated}, &trouble);
  EXPECT_EQ(trouble, "");
  return bytes;
}

TEST(DataFile, OctaveReadsTheMatFile) {
  const test::TestFolder folder("mat");
  folder.Write("traces.mat", BytesOf("mat"));
  const std::string script = folder.Write("read.m", R"(load traces.mat
printf('%s|%s|%d\n', info.mechanism, info.description, numel(info.none));
printf('%.17g ', reference.time_s, reference.values); printf('\n');
for k = 1:3
  printf('%s|%s|%s|%s|%s\n', reference.names{k}, reference.units{k}, reference.quantities{k}, ...
         reference.subjects{k}, reference.frames{k});
end
printf('%.17g %.17g %s\n', simulated.time_s, simulated.values, simulated.names{1});
)");
  EXPECT_EQ(Output("cd " + folder.PathOf("") + " && octave-cli --no-init-file --quiet " + script),
            "four_bar|gr??er|0\n"
            "0 0.10000000000000001 0.25 0.33333333333333331 0.10000000000000001 "
            "12345.678901234567 -2.0000000000000001e-300 NaN 0 1 2 3 \n"
            "arm.motor.force|N m|force|arm.motor|\n"
            "hinge.reaction.fz|N|fz|hinge|hinge.F\n"
            "eigen ?||eigen ?||\n"
            "0 0.29999999999999999 arm.motor.force\n");
}

TEST(DataFile, H5dumpReadsTheHdf5File) {
  const test::TestFolder folder("h5");
  const std::string file = folder.Write("traces.h5", BytesOf("h5"));
  const auto dump = [&](const std::string& what) { return Output("h5dump " + what + " " + file); };
  const std::string force = dump("-m %.17g -d /reference/arm.motor.force");
  EXPECT_NE(force.find("(0): 0.33333333333333331,\n   (1): 0.10000000000000001,\n"
                       "   (2): 12345.678901234567\n"),
            std::string::npos)
      << force;
  EXPECT_NE(force.find("ATTRIBUTE \"unit\""), std::string::npos) << force;
  EXPECT_NE(force.find("(0): \"N m\""), std::string::npos) << force;
  EXPECT_NE(dump("-a '/reference/hinge.reaction.fz/frame'").find("\"hinge.F\""), std::string::npos);
  EXPECT_NE(dump("-d '/reference/hinge.reaction.fz'").find("(0): -2e-300, nan, 0"),
            std::string::npos);
  EXPECT_NE(dump("-d /simulated/time_s").find("(0): 0\n"), std::string::npos);
  EXPECT_NE(dump("-a /mechanism").find("\"four_bar\""), std::string::npos);
  EXPECT_NE(dump("-a /description").find("CSET H5T_CSET_UTF8"), std::string::npos);
}

TEST(DataFile, TheSameValuesGiveTheSameBytesLater) {
  for (const DataFormat& format : DataFormats()) {
    const std::string before = BytesOf(format.word);
    std::this_thread::sleep_for(std::chrono::milliseconds(1100));  // dates count seconds
    EXPECT_EQ(before, BytesOf(format.word)) << format.word;
  }
}

TEST(DataFile, WhatCannotBeWrittenIsSaid) {
  const Trace trace = Simulated();
  for (const DataFormat& format : DataFormats()) {
    EXPECT_EQ(format.write("/nowhere/traces", {}, {&trace}), "cannot write /nowhere/traces");
  }
  EXPECT_EQ(FindDataFormat("xls"), nullptr);
}

}  // namespace
}  // namespace mbv
