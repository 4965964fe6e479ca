// Maps and searches that were interrupted go on, and end as if they had not been.
#include "math/resume.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <map>

#include "features/workspace/reachable_set.h"
#include "model_file/load_model.h"
#include "tests/support/run_program.h"
#include "tests/support/source_dir.h"

namespace mbv {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;

class Resume : public testing::Test {
 protected:
  // What a run of four results leaves in a log.
  void Fill(const std::string& identity = "0123") const {
    ResultLog log(file(), identity);
    for (int i = 0; i < 4; ++i) (void)log.Get<std::vector<double>>([&] { return Result(i); });
  }
  static std::vector<double> Result(int i) { return std::vector<double>(5, 0.1 * i); }
  // How many of the four results are computed again; all are as they were.
  [[nodiscard]] int Computed(const std::string& identity = "0123") const {
    ResultLog log(file(), identity);
    int computed = 0;
    for (int i = 0; i < 4; ++i) {
      EXPECT_EQ(log.Get<std::vector<double>>([&] {
        ++computed;
        return Result(i);
      }),
                Result(i));
    }
    return computed;
  }
  [[nodiscard]] fs::path file() const { return folder_.folder() / "a.log"; }

  Program folder_{testing::UnitTest::GetInstance()->current_test_info()->name()};
};

TEST_F(Resume, WhatIsKeptIsNotComputedAgain) {
  Fill();
  EXPECT_EQ(Computed(), 0);
  EXPECT_EQ(Computed("4567"), 4);  // another question
  EXPECT_EQ(Computed("4567"), 0);
}

TEST_F(Resume, WhatAKillCutOffIsComputedAgain) {
  Fill();
  const auto whole = fs::file_size(file());
  fs::resize_file(file(), whole - 1);
  EXPECT_EQ(Computed(), 1);
  EXPECT_EQ(fs::file_size(file()), whole);
  fs::resize_file(file(), whole / 2);
  EXPECT_EQ(Computed(), 3);
  fs::resize_file(file(), 2);
  EXPECT_EQ(Computed(), 4);
}

TEST_F(Resume, AResultWithAnotherByteIsNotTaken) {
  Fill();
  const std::string good = ReadAll(file());
  std::string bad = good;
  bad[good.size() / 2] = static_cast<char>(bad[good.size() / 2] ^ 1);
  std::ofstream(file(), std::ios::binary) << bad;
  EXPECT_EQ(Computed(), 3);
  EXPECT_EQ(ReadAll(file()), good);
}

TEST_F(Resume, OneProcessAtATimeUsesAFolderAndNothingIsLeft) {
  const fs::path folder = folder_.folder() / "out/model/workspace.part";
  {
    const ResumeFolder first(folder, "0123");
    EXPECT_FALSE(first.taken());
    EXPECT_FALSE(first.resumes());
    const ResumeFolder second(folder, "0123");
    EXPECT_TRUE(second.taken());
    ResultLog log = first.Log("a");
    EXPECT_EQ(log.Get<int>([] { return 3; }), 3);
    EXPECT_TRUE(fs::exists(folder / "a.log"));
  }
  EXPECT_FALSE(fs::exists(folder_.folder() / "out"));
}

// All that a set is, but for times.
std::string BytesOf(ReachableSet set) {
  set.traced.wall_s = 0.0;
  std::string bytes = ToBytes(set.traced);
  for (const FloodVertex& vertex : set.flooded.vertices) {
    bytes += ToBytes(std::pair(vertex.at, vertex.bound));
  }
  for (const FloodPoint& point : set.flooded.lattice) bytes += ToBytes(point.pose);
  return bytes + ToBytes(set.flooded.levels) + ToBytes(set.flooded.closings) + set.verdict;
}

// Sections of a volume, values of a range, a curve: the logs are cut in the middle of a result.
TEST_F(Resume, AnInterruptedSetEndsAsOneThatWasNot) {
  LoadResult loaded = LoadModel(SourcePath("/models/spr_tripod/model.yaml"));
  ASSERT_TRUE(loaded.mechanism.has_value());
  const std::vector<SetArguments> asked = [] {
    SetArguments solid, range, flat;
    solid.over = {"x_mm=-20:20", "y_mm=-20:20", "z_mm=560:600"};
    range.over = {"x"};
    range.at = {"y=0"};
    range.for_all = {"z_mm=560:580"};
    flat.over = {"x", "y"};
    solid.flood.resolution = 12;
    flat.flood.resolution = range.flood.resolution = 30;
    return std::vector{solid, range, flat};
  }();
  for (size_t k = 0; k < asked.size(); ++k) {
    Diagnostics diagnostics;
    const auto question = ReadQuestion(*loaded.mechanism, asked[k], &diagnostics);
    ASSERT_TRUE(question) << diagnostics.Text();
    const std::string whole = BytesOf(ComputeReachableSet(*question, asked[k]));
    const fs::path part = folder_.folder() / "part", left = folder_.folder() / "left";
    {
      const ResumeFolder folder(part, "0123");
      EXPECT_EQ(BytesOf(ComputeReachableSet(*question, asked[k], {}, &folder)), whole) << k;
      fs::copy(part, left);
    }
    for (const auto& log : fs::directory_iterator(left)) {
      fs::resize_file(log.path(), 2 * fs::file_size(log.path()) / 3);
    }
    const ResumeFolder folder(left, "0123");
    EXPECT_TRUE(folder.resumes());
    SetArguments many = asked[k];
    many.flood.threads = 3;  // nothing depends on it
    EXPECT_EQ(BytesOf(ComputeReachableSet(*question, many, {}, &folder)), whole) << k;
  }
}

std::map<std::string, std::string> FilesBelow(const fs::path& folder) {
  std::map<std::string, std::string> files;
  for (const auto& entry : fs::recursive_directory_iterator(folder)) {
    if (entry.is_regular_file()) {
      files[fs::relative(entry.path(), folder).string()] = ReadAll(entry.path());
    }
  }
  return files;
}

TEST_F(Resume, TheSameCommandGoesOnAfterAKillAndWritesTheSameBytes) {
  const std::string call =
      "workspace friction_five_bar --over x,y --resolution 250 --no-pictures --out ";
  const std::string cut = "'" + folder_.Out() + "/cut'", whole = "'" + folder_.Out() + "/whole'";
  ASSERT_EQ(folder_(call + whole).exit_code, 0);
  const ProgramResult killed = folder_.Script(
      "\"$mbverify\" " + call + cut + " & pid=$!; log=" + cut +
      "/friction_five_bar/workspace.part/lattice.log; i=0; while [ $i -lt 2000 ] && [ \"$(stat -c "
      "%s $log 2>/dev/null || echo 0)\" -lt 2000000 ]; do sleep 0.01; i=$((i+1)); done; kill -INT "
      "$pid; kill -KILL $pid; wait $pid");
  ASSERT_EQ(killed.exit_code, 137) << killed.err;
  const ProgramResult resumed = folder_(call + cut);
  ASSERT_EQ(resumed.exit_code, 0) << resumed.err;
  EXPECT_THAT(resumed.err, HasSubstr("goes on with what an interrupted run left"));
  EXPECT_EQ(FilesBelow(folder_.Out() + "/cut"), FilesBelow(folder_.Out() + "/whole"));
}

}  // namespace
}  // namespace mbv
