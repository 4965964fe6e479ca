// A model as text, and back.
#include "model_file/write_model.h"

#include <gtest/gtest.h>

#include "model_file/load_model.h"
#include "tests/support/shipped.h"
#include "tests/support/source_dir.h"

namespace mbv {
namespace {

void ExpectSameFrame(const Pose& a, const Pose& b, const std::string& what) {
  EXPECT_TRUE(a.matrix() == b.matrix()) << what;
}

class WriteModelOf : public testing::TestWithParam<std::string> {};

TEST_P(WriteModelOf, ReadsBackToTheLastBit) {
  const LoadResult first = LoadModel(SourcePath(fmt::format("/models/{}/model.yaml", GetParam())));
  ASSERT_TRUE(first.mechanism) << first.diagnostics.Text();
  const Mechanism& a = *first.mechanism;
  const std::string text = WriteModel(a);
  const LoadResult second = LoadModelText(text, "written.yaml");
  ASSERT_TRUE(second.mechanism) << second.diagnostics.Text() << text;
  const Mechanism& b = *second.mechanism;
  ASSERT_EQ(a.bodies.size(), b.bodies.size());
  ASSERT_EQ(a.joints.size(), b.joints.size());
  ASSERT_EQ(a.drives.size(), b.drives.size());
  EXPECT_EQ(a.tree_joints, b.tree_joints);
  EXPECT_EQ(a.gravity_W, b.gravity_W);
  for (size_t i = 0; i < a.bodies.size(); ++i) {
    const Body &x = a.bodies[i], &y = b.bodies[i];
    EXPECT_EQ(x.mass, y.mass) << x.name;
    EXPECT_EQ(x.p_BoBcm_B, y.p_BoBcm_B) << x.name;
    EXPECT_EQ(x.I_Bcm_B, y.I_Bcm_B) << x.name;
    EXPECT_EQ(x.shapes.size(), y.shapes.size()) << x.name;
    EXPECT_LT((a.X_WB_home[i].matrix() - b.X_WB_home[i].matrix()).norm(), 1e-11) << x.name;
  }
  for (size_t i = 0; i < a.joints.size(); ++i) {
    const Joint &x = a.joints[i], &y = b.joints[i];
    EXPECT_EQ(x.kind, y.kind) << x.name;
    EXPECT_EQ(x.parent, y.parent) << x.name;
    EXPECT_EQ(x.child, y.child) << x.name;
    ExpectSameFrame(x.X_PF, y.X_PF, x.name);
    ExpectSameFrame(x.X_CM, y.X_CM, x.name);
    EXPECT_EQ(x.axis, y.axis) << x.name;
    EXPECT_EQ(x.axis2, y.axis2) << x.name;
    EXPECT_EQ(x.home, y.guess) << x.name;
    EXPECT_EQ(x.transmits_force_only, y.transmits_force_only) << x.name;
    for (int k = 0; k < DofsOf(x.kind); ++k) {
      EXPECT_EQ(x.range[k].lower, y.range[k].lower) << x.name;
      EXPECT_EQ(x.range[k].upper, y.range[k].upper) << x.name;
    }
  }
  for (size_t i = 0; i < a.outputs.size(); ++i) {
    ExpectSameFrame(a.outputs[i].X_BO, b.outputs[i].X_BO, a.outputs[i].name);
    EXPECT_EQ(a.outputs[i].body, b.outputs[i].body);
  }
}
INSTANTIATE_TEST_SUITE_P(Shipped, WriteModelOf, testing::ValuesIn(ShippedModelNames()));

TEST(WriteModel, NamesBecomeSuchAsModelFilesTake) {
  Mechanism m;
  m.bodies.resize(4);
  m.bodies[0].name = "world";
  m.bodies[1].name = "a/b.c";
  m.bodies[2].name = "a_b_c";
  m.bodies[3].name = "null";
  const WrittenNames names = NamesInModel(m);
  EXPECT_EQ(names.bodies, (std::vector<std::string>{"world", "a_b_c", "a_b_c_2", "null_"}));
}

// What looks like a rotation but is none is refused.
TEST(WriteModel, AMatrixThatIsNotARotationIsRefused) {
  const auto load = [](const std::string& matrix) {
    return LoadModelText("name: m\nworld: {frames: {f: {rotation: {matrix: " + matrix + "}}}}\n",
                         "m.yaml");
  };
  EXPECT_TRUE(load("[[0, -1, 0], [1, 0, 0], [0, 0, 1]]").mechanism);
  for (const char* wrong : {"[[1, 0, 0], [0, 1, 0], [0, 0, -1]]",
                            "[[1, 0, 0], [0, 1, 1e-6], [0, 0, 1]]", "[[1, 0, 0], [0, 1, 0]]"}) {
    EXPECT_FALSE(load(wrong).mechanism) << wrong;
  }
}

}  // namespace
}  // namespace mbv
