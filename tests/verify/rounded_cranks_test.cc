// Rounded loops of which two are one too many: a locomotive's three cranks with their rod, as a
// URDF exporter prints it.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <map>
#include <numbers>
#include <random>
#include <string>

#include "features/robots/survey.h"
#include "kinematics/mobility.h"
#include "tests/support/test_folder.h"
#include "verify/model_text.h"

namespace mbv {
namespace {

// In a frame that is turned at random, all link frames with z along the hinges; `digits` decimals.
// The last crank is longer by `spoilt`.
class Cranks {
 public:
  Cranks(int digits, unsigned seed, double spoilt) : digits_(digits), random_(seed) {
    R_ = Turn();
    const Vec3 arm(0.08, 0, 0.1);
    const std::array<Vec3, 3> feet = {Vec3(0, 0, 0), Vec3(0.3, 0, 0), Vec3(0.7, 0, 0)};
    Link("base", "crank0", feet[0]);
    Link("base", "crank1", feet[1]);
    Link("base", "crank2", feet[2]);
    Link("crank0", "rod", feet[0] + arm);
    for (const int i : {1, 2}) {
      const Vec3 at = feet[i] + arm + Vec3(0, 0, i == 2 ? spoilt : 0.0);
      Frame("rod", fmt::format("pin{}_a", i), feet[i] + arm, "continuous");
      Frame(fmt::format("crank{}", i), fmt::format("pin{}_b", i), at, "fixed");
    }
  }
  [[nodiscard]] std::string Text() const {
    return "<robot name='cranks'><link name='base'/>" + text_ + "</robot>";
  }

 private:
  struct Placed {
    Mat3 R = Mat3::Identity();
    Vec3 p = Vec3::Zero();
  };

  Mat3 Turn() {
    std::normal_distribution<double> normal;
    const Eigen::Quaterniond q(normal(random_), normal(random_), normal(random_), normal(random_));
    return q.normalized().toRotationMatrix();
  }
  [[nodiscard]] std::string Print(const Vec3& x) const {
    return fmt::format("{:.{}f} {:.{}f} {:.{}f}", x.x(), digits_, x.y(), digits_, x.z(), digits_);
  }
  void Joint(const std::string& parent, const std::string& name, const Placed& at,
             const char* type) {
    const Placed& from = placed_[parent];
    const Mat3 R = from.R.transpose() * at.R;
    const Vec3 rpy(std::atan2(R(2, 1), R(2, 2)), -std::asin(R(2, 0)), std::atan2(R(1, 0), R(0, 0)));
    text_ += fmt::format(
        "<joint name='{0}_j' type='{1}'><parent link='{2}'/><child link='{0}'/><origin xyz='{3}' "
        "rpy='{4}'/><axis xyz='0 0 1'/></joint>",
        name, type, parent, Print(from.R.transpose() * (at.p - from.p)), Print(rpy));
    placed_[name] = at;
  }
  // z along the hinges, turned about it at random; ends of a closure alike.
  [[nodiscard]] Placed At(const Vec3& p, double angle) const {
    const Mat3 along = Eigen::AngleAxisd(-0.5 * std::numbers::pi, Vec3::UnitX()).toRotationMatrix();
    return {R_ * along * Eigen::AngleAxisd(angle, Vec3::UnitZ()).toRotationMatrix(), R_ * p};
  }
  void Link(const std::string& parent, const std::string& name, const Vec3& p) {
    std::uniform_real_distribution<double> angle(-3.0, 3.0);
    const Placed at = At(p, angle(random_));
    const Vec3 centre = at.R.transpose() * (R_ * Vec3(0.04, 0, 0.05));
    text_ += fmt::format(
        "<link name='{}'><inertial><origin xyz='{}'/><mass value='1'/><inertia ixx='0.01' "
        "iyy='0.012' izz='0.014' ixy='0' ixz='0' iyz='0'/></inertial></link>",
        name, Print(centre));
    Joint(parent, name, at, "continuous");
  }
  void Frame(const std::string& parent, const std::string& name, const Vec3& p, const char* type) {
    text_ += fmt::format("<link name='{}'/>", name);
    Joint(parent, name, At(p, 0.3), type);
  }

  const int digits_;
  std::mt19937_64 random_;
  Mat3 R_;
  std::map<std::string, Placed> placed_ = {{"base", {}}};
  std::string text_;
};

const char kClosures[] =
    "closed_loop: [[pin1_a, pin1_b], [pin2_a, pin2_b]]\ntype: [6d, 6d]\nname_mot: [crank0_j]\n";

TEST(RoundedCranks, MoveUpToTheDeadPoint) {
  const test::TestFolder folder("rounded_cranks");
  folder.Write("cranks.yaml", kClosures);
  for (const int digits : {5, 6, 9}) {
    for (const unsigned seed : {1U, 2U, 3U}) {
      const std::string file = folder.Write("cranks.urdf", Cranks(digits, seed, 0.0).Text());
      const LoadResult loaded = LoadRobot(file);
      ASSERT_TRUE(loaded.mechanism) << digits << " " << seed << loaded.diagnostics.Text();
      EXPECT_EQ(AnalyseMobility(*loaded.mechanism).dofs, 1) << digits << " " << seed;
      EXPECT_EQ(AnalyseMobility(*loaded.mechanism).redundant, 7) << digits << " " << seed;
      EXPECT_THAT(loaded.diagnostics.Text(), testing::HasSubstr("joint frames moved by up to"));
      // Longer by more than digits explain.
      const std::string spoilt = folder.Write("cranks.urdf", Cranks(digits, seed, 2e-2).Text());
      const LoadResult other = LoadRobot(spoilt);
      EXPECT_TRUE(!other.mechanism || AnalyseMobility(*other.mechanism).dofs == 0)
          << digits << " " << seed;
    }
  }
}

// Axes that fit but for their eighth digit let the moments that nothing determines reach the
// others.
TEST(RoundedCranks, AgreeWhereAxesFitToSevenDigits) {
  const test::TestFolder folder("rounded_cranks_run");
  folder.Write("cranks.yaml", kClosures);
  for (const unsigned seed : {1U, 2U}) {
    const SurveyRow row = SurveyFile(folder.Write("cranks.urdf", Cranks(7, seed, 0.0).Text()),
                                     folder.PathOf("scratch"));
    EXPECT_EQ(row.status, "ok") << seed << row.message;
  }
}

}  // namespace
}  // namespace mbv
