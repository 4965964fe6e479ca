// Binary files of traces, read back by the programs that their users have.
#include "report/data/data_file.h"

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <matio.h>

#include <chrono>
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <memory>
#include <thread>

#include "tests/support/test_folder.h"

namespace mbv {
namespace {

// What a shell command prints to standard output.
std::string OutputOf(const std::string& command) {
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
  std::string bytes =
      DataBytes(*FindDataFormat(word),
                {{"mechanism", "four_bar"}, {"description", "größer"}, {"none", ""}, {"sign", "𝛼"}},
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
  EXPECT_EQ(OutputOf("cd " + folder.PathOf("") + " && octave-cli --no-init-file --quiet " + script),
            "four_bar|gr??er|0\n"
            "0 0.10000000000000001 0.25 0.33333333333333331 0.10000000000000001 "
            "12345.678901234567 -2.0000000000000001e-300 NaN 0 1 2 3 \n"
            "arm.motor.force|N m|force|arm.motor|\n"
            "hinge.reaction.fz|N|fz|hinge|hinge.F\n"
            "eigen ?||eigen ?||\n"
            "0 0.29999999999999999 arm.motor.force\n");
}

TEST(DataFile, OctaveReadsMatrices) {
  const test::TestFolder folder("matrices");
  std::string trouble;
  DataMatrices data{.about = {{"mechanism", "four_bar"}},
                    .matrices = {{"A", MatX(2, 3)}, {"empty", MatX(0, 2)}},
                    .names = {{"coordinates", {"a.x", "b"}}}};
  data.matrices[0].second << 1, 2, 3, 4, 0.1, -6;
  folder.Write("linear.mat", MatBytes(data, &trouble));
  EXPECT_EQ(trouble, "");
  const std::string script = folder.Write("read.m", R"(load linear.mat
printf('%s %s %s\n', info.mechanism, coordinates{1}, coordinates{2});
printf('%.17g ', A(1, :), A(2, :), size(empty)); printf('\n');
)");
  EXPECT_EQ(OutputOf("cd " + folder.PathOf("") + " && octave-cli --no-init-file --quiet " + script),
            "four_bar a.x b\n1 2 3 4 0.10000000000000001 -6 0 2 \n");
}

struct CloseMat {
  void operator()(mat_t* file) const { Mat_Close(file); }
};
struct FreeMatVariable {
  void operator()(matvar_t* variable) const { Mat_VarFree(variable); }
};

// The text of a field, or of one of its cells; letters beyond ASCII as numbers.
std::string TextOf(matvar_t* variable, const char* field, int cell = -1) {
  matvar_t* text = Mat_VarGetStructFieldByName(variable, field, 0);
  if (cell >= 0 && text != nullptr) text = Mat_VarGetCell(text, cell);
  if (text == nullptr || text->class_type != MAT_C_CHAR) return "(no text)";
  std::string letters;
  for (size_t k = 0; k < text->dims[0] * text->dims[1]; ++k) {
    const unsigned code = static_cast<const std::uint16_t*>(text->data)[k];
    letters += code < 0x80 ? std::string(1, static_cast<char>(code)) : fmt::format("<{:x}>", code);
  }
  return letters;
}

TEST(DataFile, MatioReadsTheMat73FileAsTheVersion5) {
  const test::TestFolder folder("mat73");
  const std::string path = folder.Write("traces_v73.mat", BytesOf("mat73"));
  const std::unique_ptr<mat_t, CloseMat> file(Mat_Open(path.c_str(), MAT_ACC_RDONLY));
  ASSERT_NE(file, nullptr);
  EXPECT_EQ(Mat_GetVersion(file.get()), MAT_FT_MAT73);
  EXPECT_EQ(std::string(Mat_GetHeader(file.get())).substr(0, 40),
            "MATLAB 7.3 MAT-file, written by mbverify");
  const auto read = [&](const char* name) {
    return std::unique_ptr<matvar_t, FreeMatVariable>(Mat_VarRead(file.get(), name));
  };
  const auto info = read("info"), reference = read("reference"), simulated = read("simulated");
  ASSERT_TRUE(info && reference && simulated);
  EXPECT_EQ(TextOf(info.get(), "mechanism"), "four_bar");
  EXPECT_EQ(TextOf(info.get(), "description"), "gr<f6><df>er");
  EXPECT_EQ(TextOf(info.get(), "none"), "");
  EXPECT_EQ(TextOf(info.get(), "sign"), "<d835><defc>");
  const matvar_t* values = Mat_VarGetStructFieldByName(reference.get(), "values", 0);
  ASSERT_NE(values, nullptr);
  ASSERT_EQ(values->dims[0] * 10 + values->dims[1], 33U);
  const Trace trace = Reference();
  EXPECT_EQ(std::memcmp(values->data, trace.values.data(), 9 * sizeof(double)), 0);
  const matvar_t* time = Mat_VarGetStructFieldByName(reference.get(), "time_s", 0);
  ASSERT_EQ(time->dims[0] * 10 + time->dims[1], 31U);
  EXPECT_EQ(static_cast<const double*>(time->data)[2], 0.25);
  const std::string second =
      TextOf(reference.get(), "names", 1) + "|" + TextOf(reference.get(), "units", 1) + "|" +
      TextOf(reference.get(), "quantities", 1) + "|" + TextOf(reference.get(), "subjects", 1) +
      "|" + TextOf(reference.get(), "frames", 1);
  EXPECT_EQ(second, "hinge.reaction.fz|N|fz|hinge|hinge.F");
  EXPECT_EQ(TextOf(reference.get(), "names", 2), "eigen <3bb>");
  EXPECT_EQ(TextOf(simulated.get(), "units", 0), "N m");
}

TEST(DataFile, H5dumpAndOctaveReadNumbersOfTheMat73File) {
  const test::TestFolder folder("mat73_programs");
  const std::string file = folder.Write("traces_v73.mat", BytesOf("mat73"));
  const std::string values = OutputOf("h5dump -m %.17g -d /reference/values " + file);
  EXPECT_NE(values.find("(0,2): 12345.678901234567"), std::string::npos) << values;
  EXPECT_NE(values.find("\"double\""), std::string::npos) << values;
  // Octave's reader of HDF5 knows no cells of MATLAB's; it says so and reads the rest.
  const std::string script = folder.Write("read.m",
                                          "load traces_v73.mat\n"
                                          "printf('%.17g ', reference.values(3, 1))");
  EXPECT_EQ(OutputOf("cd " + folder.PathOf("") + " && octave-cli --no-init-file --quiet " + script +
                     " 2>/dev/null"),
            "12345.678901234567 ");
}

TEST(DataFile, H5dumpReadsTheHdf5File) {
  const test::TestFolder folder("h5");
  const std::string file = folder.Write("traces.h5", BytesOf("h5"));
  const auto dump = [&](const std::string& what) {
    return OutputOf("h5dump " + what + " " + file);
  };
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

TEST(DataFile, WhatCannotBeWrittenIsReported) {
  const Trace trace = Simulated();
  for (const DataFormat& format : DataFormats()) {
    EXPECT_EQ(format.write("/nowhere/traces", {}, {&trace}), "cannot write /nowhere/traces");
  }
  EXPECT_EQ(FindDataFormat("xls"), nullptr);
}

}  // namespace
}  // namespace mbv
