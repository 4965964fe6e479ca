#include "base/text.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>

namespace mbv {
namespace {

namespace fs = std::filesystem;

TEST(DidYouMean, SaysSomethingElseWhereNothingIsNear) {
  EXPECT_EQ(DidYouMean("massa", {"mass", "com"}, "known: mass, com"), "did you mean 'mass'?");
  EXPECT_EQ(DidYouMean("velocity", {"mass", "com"}, "known: mass, com"), "known: mass, com");
}

TEST(DidYouMeanPath, CorrectsEveryFolderAndTheFile) {
  const fs::path root = fs::temp_directory_path() / ("mbv_hints_" + std::to_string(getpid()));
  fs::create_directories(root / "scenarios" / "spr_tripod");
  std::ofstream(root / "scenarios" / "spr_tripod" / "default.yaml") << "a";
  const std::string right = (root / "scenarios/spr_tripod/default.yaml").string();
  for (const char* wrong : {"scenarios/spr_tripd/default.yaml", "scenario/spr_tripod/defalt.yaml",
                            "scenarios/spr_tripod/default.yml"}) {
    EXPECT_EQ(DidYouMeanPath((root / wrong).string()), "did you mean '" + right + "'?") << wrong;
  }
  EXPECT_EQ(DidYouMeanPath((root / "nothing/like/it.yaml").string(), "check the name"),
            "check the name");
  EXPECT_EQ(DidYouMeanPath(right, "it is there"), "it is there");
  fs::remove_all(root);
}

TEST(DidYouMean, LongWordsHaveHintsToo) {
  const std::string name(90, 'a');
  EXPECT_EQ(DidYouMean(name + "x", {name, "b"}), "did you mean '" + name + "'?");
  EXPECT_EQ(DidYouMean(std::string(20'000, 'a'), {name}), "");
}

}  // namespace
}  // namespace mbv
