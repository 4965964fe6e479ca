// SDF files as mechanisms: the same as URDF and as model files, element by element.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <filesystem>
#include <fstream>
#include <functional>
#include <map>
#include <set>
#include <sstream>

#include "base/text.h"
#include "kinematics/mobility.h"
#include "math/bytes.h"
#include "mechanism/joint_pose.h"
#include "model_file/load_model.h"
#include "model_file/mesh/read_mesh.h"
#include "model_file/sdf/read_sdf.h"
#include "model_file/write_model.h"
#include "tests/support/test_folder.h"

namespace mbv {
namespace {

using testing::Contains;
using testing::HasSubstr;

constexpr double kSame = 1e-12;

struct Read {
  std::optional<Mechanism> mechanism;
  std::vector<ModelCaveat> left_out;
  std::string text;  // of all findings
};

Read ReadFile(const std::string& file, const std::string& text, const std::string& base = "") {
  const ForeignModel model = ReadSdf(text, file, {.held = base});
  Read read{.mechanism = {}, .left_out = model.left_out, .text = {}};
  Diagnostics found;
  for (const Finding& finding : model.findings) found.Add(finding);
  if (!found.has_errors()) {
    LoadResult loaded = LoadModelText(model.model, file);
    found.Append(loaded.diagnostics);
    read.mechanism = std::move(loaded.mechanism);
  }
  read.text = found.Text();
  return read;
}

Read ReadText(const std::string& text, const std::string& base = "") {
  return ReadFile("robot.sdf", text, base);
}

std::set<std::string> SourcesOf(const Read& read) {
  std::set<std::string> sources;
  for (const ModelCaveat& caveat : read.left_out) sources.insert(caveat.source);
  return sources;
}

std::string Sdf(const std::string& content) {
  return "<sdf version='1.9'><model name='r'>" + content + "</model></sdf>";
}

constexpr const char* kInertia =
    "<inertia><ixx>0.03</ixx><iyy>0.04</iyy><izz>0.05</izz><ixy>0.001</ixy><ixz>0.002</ixz>"
    "<iyz>-0.003</iyz></inertia>";

// A base on a stand, an arm on it by a joint of a type, whose content is `axis`; a hand at its end.
struct Arm {
  std::string type = "revolute";
  std::string joint =
      "<axis><xyz>1 2 2</xyz><limit><lower>-1</lower><upper>2</upper></limit></axis>";
  std::string mass = "2", pose = "0.1 0.2 0.3 0.3 -0.2 0.5", arm = "", more = "", model = "";
};
std::string ArmText(const Arm& arm = {}) {
  return Sdf(
      arm.model +
      fmt::format(
          "<joint name='mount' type='fixed'><parent>world</parent><child>base</child></joint>"
          "<link name='base'><pose>0 0 0.5 0.1 0.2 0.3</pose><inertial><mass>3</mass>{0}"
          "</inertial></link>"
          "<joint name='j' type='{1}'><parent>base</parent><child>arm</child>{2}</joint>"
          "<link name='arm'><pose relative_to='base'>{3}</pose><inertial><pose>0.1 0 0.2 0.4 "
          "0.5 0.6</pose><mass>{4}</mass>{0}</inertial>{5}</link>"
          "<joint name='k' type='continuous'><parent>arm</parent><child>hand</child><axis>"
          "<xyz>0 1 0</xyz></axis></joint>"
          "<link name='hand'><pose relative_to='arm'>0 0 0.4 0 0 0</pose><inertial><mass>1"
          "</mass>{0}</inertial></link>",
          kInertia, arm.type, arm.joint, arm.pose, arm.mass, arm.arm) +
      arm.more);
}

// The same as URDF; `joint` is the content of the joint.
LoadResult LoadUrdf(const std::string& type, const std::string& joint, const std::string& k = "") {
  const std::string inertia =
      "<inertia ixx='0.03' iyy='0.04' izz='0.05' ixy='0.001' ixz='0.002' iyz='-0.003'/>";
  const test::TestFolder folder("sdf_urdf");
  return LoadModel(folder.Write(
      "r.urdf",
      fmt::format("<robot name='r'><link name='world'/>"
                  "<link name='base'><inertial><mass value='3'/>{0}</inertial></link>"
                  "<link name='arm'><inertial><origin xyz='0.1 0 0.2' rpy='0.4 0.5 0.6'/><mass "
                  "value='2'/>{0}</inertial></link>"
                  "<link name='hand'><inertial><mass value='1'/>{0}</inertial></link>"
                  "<joint name='mount' type='fixed'><parent link='world'/><child link='base'/>"
                  "<origin xyz='0 0 0.5' rpy='0.1 0.2 0.3'/></joint>"
                  "<joint name='j' type='{1}'><parent link='base'/><child link='arm'/><origin "
                  "xyz='0.1 0.2 0.3' rpy='0.3 -0.2 0.5'/>{2}</joint>"
                  "<joint name='k' type='continuous'><parent link='arm'/><child link='hand'/>"
                  "<origin xyz='0 0 0.4'/><axis xyz='0 1 0'/>{3}</joint></robot>",
                  inertia, type, joint, k)));
}

// Where two mechanisms differ by more than kSame; "" where nowhere.
std::string Difference(const Mechanism& a, const Mechanism& b) {
  const auto far = [](const auto& x, const auto& y) { return !((x - y).norm() <= kSame); };
  if (a.bodies.size() != b.bodies.size()) return "bodies";
  if (a.joints.size() != b.joints.size()) return "joints";
  if (far(a.gravity_W, b.gravity_W)) return "gravity";
  for (const Body& body : a.bodies) {
    const int k = b.FindBody(body.name);
    if (k < 0) return "no body " + body.name;
    const Body& other = b.bodies[static_cast<size_t>(k)];
    if (std::abs(body.mass - other.mass) > kSame) return "mass of " + body.name;
    if (far(body.p_BoBcm_B, other.p_BoBcm_B)) return "centre of " + body.name;
    if (far(body.I_Bcm_B, other.I_Bcm_B)) return "inertia of " + body.name;
    const auto& X = a.X_WB_home[static_cast<size_t>(a.FindBody(body.name))];
    if (far(X.matrix(), b.X_WB_home[static_cast<size_t>(k)].matrix()))
      return "pose of " + body.name;
  }
  for (const Joint& joint : a.joints) {
    const int k = b.FindJoint(joint.name);
    if (k < 0) return "no joint " + joint.name;
    const Joint& other = b.joints[static_cast<size_t>(k)];
    if (joint.kind != other.kind) return "kind of " + joint.name;
    for (const bool child : {false, true}) {
      const auto side = [&](const Mechanism& m, const Joint& of) {
        return child ? Pose(m.X_WB_home[static_cast<size_t>(of.child)] * of.X_CM)
                     : Pose(m.X_WB_home[static_cast<size_t>(of.parent)] * of.X_PF);
      };
      const Pose X = side(a, joint), Y = side(b, other);
      if (far(X.translation(), Y.translation())) return "place of " + joint.name;
      if (far(X.linear() * joint.axis, Y.linear() * other.axis)) return "axis of " + joint.name;
      if (far(X.linear() * joint.axis2, Y.linear() * other.axis2)) return "axis2 of " + joint.name;
    }
    for (int c = 0; c < DofsOf(joint.kind); ++c) {
      const auto same = [](double x, double y) { return x == y || std::abs(x - y) <= kSame; };
      if (!same(joint.range[c].lower, other.range[c].lower) ||
          !same(joint.range[c].upper, other.range[c].upper)) {
        return "range of " + joint.name;
      }
    }
  }
  // Laws and couplings as the model file has them.
  const auto rest = [](const Mechanism& m) {
    const std::string text = WriteModel(m);
    std::set<std::string> lines;
    const size_t from = std::min(text.find("couplings:"), text.find("elements:"));
    if (from == std::string::npos) return lines;
    std::istringstream stream(text.substr(from));
    for (std::string line; std::getline(stream, line);) lines.insert(line);
    return lines;
  };
  return rest(a) == rest(b) ? "" : "couplings or elements";
}

std::string Difference(const Read& a, const LoadResult& b) {
  if (!a.mechanism) return a.text;
  if (!b.mechanism) return b.diagnostics.Text();
  return Difference(*a.mechanism, *b.mechanism);
}

TEST(SdfImport, TheJointsOfUrdfAreTheSame) {
  const struct {
    const char *type, *sdf, *urdf;
  } kCases[] = {
      {"revolute", "<axis><xyz>1 2 2</xyz><limit><lower>-1</lower><upper>2</upper></limit></axis>",
       "<axis xyz='1 2 2'/><limit lower='-1' upper='2' effort='1' velocity='1'/>"},
      {"continuous", "<axis><xyz>1 2 2</xyz></axis>", "<axis xyz='1 2 2'/>"},
      {"prismatic",
       "<axis><xyz>0 0 1</xyz><limit><lower>0</lower><upper>0.2</upper></limit></axis>",
       "<axis xyz='0 0 1'/><limit lower='0' upper='0.2' effort='1' velocity='1'/>"},
      {"fixed", "", ""},
      {"continuous",
       "<axis><xyz>1 2 2</xyz><dynamics><damping>0.3</damping><friction>0.2</friction></dynamics>"
       "</axis>",
       "<axis xyz='1 2 2'/><dynamics damping='0.3' friction='0.2'/>"},
  };
  for (const auto& joint : kCases) {
    const Read read = ReadText(ArmText({.type = joint.type, .joint = joint.sdf}));
    EXPECT_EQ(Difference(read, LoadUrdf(joint.type, joint.urdf)), "") << joint.type << joint.sdf;
    EXPECT_EQ(read.text, "");
  }
}

// Drake's ball: the moment −c ω; friction is limited about each axis.
TEST(SdfImport, DampingAndFrictionOfABallActOnItsRotation) {
  const Read read = ReadText(ArmText(
      {.type = "ball",
       .joint = "<axis><xyz>0 0 1</xyz><dynamics><damping>0.3</damping><friction>0.2</friction>"
                "</dynamics></axis>"}));
  ASSERT_TRUE(read.mechanism) << read.text;
  EXPECT_EQ(read.text, "");
  const Mechanism& m = *read.mechanism;
  ASSERT_EQ(m.elements.size(), 6U);
  for (size_t k = 0; k < 3; ++k) {
    EXPECT_EQ(m.elements[k].name, std::string("j_damping.") + "xyz"[k]);
    EXPECT_EQ(std::get<DampingLaw>(m.elements[k].law).damping, 0.3);
    EXPECT_EQ(m.elements[k + 3].name, std::string("j_friction.") + "xyz"[k]);
    EXPECT_EQ(std::get<FrictionLaw>(m.elements[k + 3].law).coulomb, 0.2);
    EXPECT_TRUE(ActsOnBall(m, m.elements[k]) && ActsOnBall(m, m.elements[k + 3]));
  }
}

TEST(SdfImport, AMimicIsACoupling) {
  const LoadResult urdf =
      LoadUrdf("continuous", "<axis xyz='1 2 2'/>", "<mimic joint='j' multiplier='-2'/>");
  const std::string axis = "<axis><xyz>1 2 2</xyz></axis>";
  std::string text = ArmText({.type = "continuous", .joint = axis});
  const std::string of_hand = "<xyz>0 1 0</xyz>";
  const auto with = [&](const std::string& mimic) {
    std::string whole = text;
    whole.insert(whole.find(of_hand), mimic);
    return whole;
  };
  const std::string later =
      "<mimic joint='j'><multiplier>-2</multiplier><offset>{}</offset>"
      "<reference>-0.1</reference></mimic>";
  const std::string drake = "<drake:mimic joint='j' multiplier='-2' offset='{}'/>";
  const auto at = [&](const std::string& mimic, double offset) {
    return ReadText(with(fmt::format(fmt::runtime(mimic), offset)));
  };
  EXPECT_EQ(Difference(at(later, 0.2), urdf), "");
  EXPECT_EQ(Difference(at(drake, 0.0), urdf), "");
  // multiplier · (position − reference) + offset
  EXPECT_NEAR(at(later, 0.5).mechanism->couplings[0].constant, 0.3, kSame);
  EXPECT_NEAR(at(drake, 0.3).mechanism->couplings[0].constant, 0.3, kSame);
  EXPECT_THAT(ReadText(with("<mimic joint='i'/>")).text, HasSubstr("mimic of 'i'"));
}

// Kinds that URDF has not: the mechanism is changed, written and read as a model file.
LoadResult Changed(const std::function<void(Mechanism*, int)>& change) {
  Mechanism m = *LoadUrdf("continuous", "<axis xyz='1 2 2'/>").mechanism;
  change(&m, m.FindJoint("j"));
  return LoadModelText(WriteModel(m), "r.yaml");
}

TEST(SdfImport, TheJointsThatUrdfHasNotAreTheSame) {
  const auto kind = [](JointKind word) {
    return Changed([word](Mechanism* m, int j) {
      m->joints[static_cast<size_t>(j)].kind = word;
      m->joints[static_cast<size_t>(j)].axis2 = Vec3(2, 1, -2) / 3.0;
    });
  };
  const std::string two = "<axis><xyz>1 2 2</xyz></axis><axis2><xyz>2 1 -2</xyz></axis2>";
  Read ball = ReadText(ArmText({.type = "ball", .joint = ""}));
  ASSERT_TRUE(ball.mechanism) << ball.text;
  Joint& of_ball = ball.mechanism->joints[static_cast<size_t>(ball.mechanism->FindJoint("j"))];
  of_ball.axis = Vec3(1, 2, 2) / 3.0;  // has no meaning
  LoadResult model = kind(JointKind::kSpherical);
  Joint& of_model = model.mechanism->joints[static_cast<size_t>(model.mechanism->FindJoint("j"))];
  of_model.axis = of_ball.axis;
  of_model.axis2 = of_ball.axis2;
  EXPECT_EQ(Difference(ball, model), "");
  for (const char* type : {"universal", "revolute2"}) {
    EXPECT_EQ(
        Difference(ReadText(ArmText({.type = type, .joint = two})), kind(JointKind::kUniversal)),
        "")
        << type;
  }
  // Gazebo's thread_pitch: radians per metre, positive for left-handed threads; since SDF 1.10
  // metres per revolution, positive for right-handed ones.
  const LoadResult screw = Changed([](Mechanism* m, int j) {
    m->joints[static_cast<size_t>(j)].kind = JointKind::kCylindrical;
    m->couplings.push_back({.name = "j_screw", .terms = {{j, 0, {-1.0}}, {j, 1, {0.25}}}});
  });
  EXPECT_EQ(Difference(ReadText(ArmText({.type = "screw",
                                         .joint = "<thread_pitch>-4</thread_pitch><axis><xyz>1 2 2"
                                                  "</xyz></axis>"})),
                       screw),
            "");
  const Read newer = ReadText(ArmText(
      {.type = "screw",
       .joint = "<screw_thread_pitch>1.5707963267948966</screw_thread_pitch><axis><xyz>1 2 2</xyz>"
                "</axis>"}));
  EXPECT_EQ(Difference(newer, screw), "");
}

TEST(SdfImport, AxesThatAreNotPerpendicularStayOneJoint) {
  const Read read = ReadText(ArmText(
      {.type = "revolute2",
       .joint = "<axis><xyz>0 0 1</xyz><dynamics><damping>0.1</damping></dynamics></axis>"
                "<axis2><xyz>0 1 1</xyz><dynamics><damping>0.2</damping></dynamics></axis2>"}));
  ASSERT_TRUE(read.mechanism) << read.text;
  const Mechanism& m = *read.mechanism;
  ASSERT_GE(m.FindJoint("j"), 0);
  EXPECT_NEAR(m.joints[static_cast<size_t>(m.FindJoint("j"))].axis2.z(), std::sqrt(0.5), 1e-15);
  ASSERT_EQ(m.elements.size(), 2u);
  EXPECT_EQ(m.elements[1].coordinate, 1);
  EXPECT_THAT(ReadText(ArmText({.type = "universal",
                                .joint = "<axis><xyz>0 0 1</xyz></axis><axis2><xyz>0 0 -1</xyz>"
                                         "</axis2>"}))
                  .text,
              HasSubstr("its two axes are parallel"));
}

TEST(SdfImport, OneOtherNumberIsNoticed) {
  const LoadResult urdf = LoadUrdf(
      "revolute", "<axis xyz='1 2 2'/><limit lower='-1' upper='2' effort='1' velocity='1'/>");
  ASSERT_EQ(Difference(ReadText(ArmText()), urdf), "");
  EXPECT_EQ(Difference(ReadText(ArmText({.mass = "2.000000001"})), urdf), "mass of arm");
  EXPECT_EQ(Difference(ReadText(ArmText({.pose = "0.1 0.2 0.3 0.3 -0.2 0.500000001"})), urdf),
            "pose of arm");
  EXPECT_EQ(Difference(ReadText(ArmText({.joint = "<axis><xyz>1 2 2.000000001</xyz><limit><lower>-1"
                                                  "</lower><upper>2</upper></limit></axis>"})),
                       urdf),
            "axis of j");
  EXPECT_EQ(Difference(ReadText(ArmText({.joint = "<axis><xyz>1 2 2</xyz><limit><lower>-1</lower>"
                                                  "<upper>2.1</upper></limit></axis>"})),
                       urdf),
            "range of j");
}

TEST(SdfImport, FramesAreResolved) {
  // The same arm: its pose by a frame, its axis by the base's frame, its model moved as a whole.
  Arm arm;
  arm.pose = "0 0 0 0 0 0";
  std::string text = ArmText(arm);
  const std::string own = "<pose relative_to='base'>0 0 0 0 0 0</pose>";
  text.replace(text.find(own), own.size(), "<pose relative_to='f'>0 0 0.3 0 0 0</pose>");
  const std::string frames =
      "<frame name='f' attached_to='base'><pose>0.1 0.2 0 0 0 0</pose></frame>";
  text.insert(text.find("<joint name='mount'"), frames);
  text.replace(text.find("<xyz>1 2 2"), 10, "<xyz expressed_in='base'>1 2 2");
  const LoadResult urdf = [] {
    const test::TestFolder folder("sdf_frames");
    std::string same = WriteModel(*LoadUrdf("revolute",
                                            "<axis xyz='1 2 2'/><limit lower='-1' "
                                            "upper='2' effort='1' velocity='1'/>")
                                       .mechanism);
    return LoadModelText(same, "r.yaml");
  }();
  const Read read = ReadText(text);
  ASSERT_TRUE(read.mechanism) << read.text;
  const Mechanism& m = *read.mechanism;
  const Pose X_BA = m.X_WB_home[static_cast<size_t>(m.FindBody("base"))].inverse() *
                    m.X_WB_home[static_cast<size_t>(m.FindBody("arm"))];
  EXPECT_LT((X_BA.translation() - Vec3(0.1, 0.2, 0.3)).norm(), kSame);
  EXPECT_LT((X_BA.linear() - Mat3::Identity()).norm(), kSame);
  ASSERT_NE(m.FindFrame(m.FindBody("base"), "f"), nullptr);
  EXPECT_NE(Difference(read, urdf), "");
}

// A four-bar of sides 0.3, 0.5, 0.3, 0.5 m whose coupler and rocker have a common joint.
std::string FourBar(const std::string& more = "", const std::string& of_base = "") {
  const auto rod = [](const char* name, const char* pose, const char* centre, const char* I) {
    return fmt::format(
        "<link name='{}'><pose>{}</pose><inertial><pose>{}</pose><mass>1</mass>"
        "<inertia>{}</inertia></inertial></link>",
        name, pose, centre, I);
  };
  const auto hinge = [](const char* name, const char* parent, const char* child,
                        const std::string& content = "") {
    return fmt::format(
        "<joint name='{}' type='continuous'><parent>{}</parent><child>{}</child>"
        "<axis><xyz>0 1 0</xyz></axis>{}</joint>",
        name, parent, child, content);
  };
  const char* upright = "<ixx>0.01</ixx><iyy>0.01</iyy><izz>0.001</izz>";
  return Sdf(
      "<link name='base'><inertial><mass>2</mass><inertia><ixx>1</ixx><iyy>1</iyy><izz>1"
      "</izz></inertia></inertial>" +
      of_base + "</link>" + rod("crank", "0 0 0 0 0 0", "0 0 0.15 0 0 0", upright) +
      rod("coupler", "0 0 0.3 0 0 0", "0.25 0 0 0 0 0",
          "<ixx>0.001</ixx><iyy>0.02</iyy><izz>0.02</izz>") +
      rod("rocker", "0.5 0 0 0 0 0", "0 0 0.15 0 0 0", upright) + hinge("A", "base", "crank") +
      hinge("B", "crank", "coupler") + hinge("D", "base", "rocker") +
      hinge("C", "coupler", "rocker", "<pose>0 0 0.3 0 0 0</pose>") + more);
}

TEST(SdfImport, ALinkWithTwoParentsClosesALoop) {
  const Read read = ReadText(FourBar());
  ASSERT_TRUE(read.mechanism) << read.text;
  const Mechanism& m = *read.mechanism;
  EXPECT_EQ(AnalyseMobility(m).dofs, 1);
  EXPECT_EQ(std::ranges::count_if(m.joints, [](const Joint& j) { return j.closure; }), 1);
  // Which joint is cut can be said.
  std::string text = FourBar();
  text.insert(text.rfind("</joint>"),
              "<physics><simbody><must_be_loop_joint>true"
              "</must_be_loop_joint></simbody></physics>");
  const Read cut = ReadText(text);
  ASSERT_TRUE(cut.mechanism) << cut.text;
  EXPECT_TRUE(cut.mechanism->joints[static_cast<size_t>(cut.mechanism->FindJoint("C"))].closure);
}

TEST(SdfImport, TheBaseIsHeldWhereNothingHoldsIt) {
  EXPECT_THAT(SourcesOf(ReadText(FourBar())), Contains("floating"));
  const auto held = [](const Read& read) {
    for (const Joint& joint : read.mechanism->joints) {
      if (joint.parent == 0) return read.mechanism->bodies[static_cast<size_t>(joint.child)].name;
    }
    return std::string();
  };
  EXPECT_EQ(held(ReadText(FourBar())), "base");
  EXPECT_EQ(held(ReadText(FourBar(), "rocker")), "rocker");
  EXPECT_THAT(ReadText(FourBar(), "rockr").text, HasSubstr("did you mean 'rocker'?"));
  EXPECT_THAT(ReadText(ArmText(), "arm").text, HasSubstr("does not float"));
  std::string text = FourBar();
  text.replace(text.find("<model name='r'>"), 16, "<model name='r' canonical_link='crank'>");
  EXPECT_EQ(held(ReadText(text)), "crank");
}

TEST(SdfImport, AGearboxCouplesTwoHinges) {
  // Two wheels on a base, of which one counts its angle the other way, and from the base to it.
  const std::string text = Sdf(
      "<link name='base'/><link name='p'><pose>1 0 0 0 0 0</pose></link><link name='c'/>"
      "<joint name='w' type='fixed'><parent>world</parent><child>base</child></joint>"
      "<joint name='P' type='revolute'><parent>base</parent><child>p</child><axis><xyz>0 0 1</xyz>"
      "</axis></joint>"
      "<joint name='C' type='revolute'><parent>base</parent><child>c</child><axis><xyz>0 0 -1</xyz>"
      "</axis></joint>"
      "<joint name='g' type='gearbox'><parent>p</parent><child>c</child><gearbox_ratio>3"
      "</gearbox_ratio><gearbox_reference_body>base</gearbox_reference_body>"
      "<axis><xyz>0 0 1</xyz></axis><axis2><xyz>0 0 1</xyz></axis2></joint>");
  const Read read = ReadText(text);
  ASSERT_TRUE(read.mechanism) << read.text;
  ASSERT_EQ(read.mechanism->couplings.size(), 1u);
  const Coupling& gear = read.mechanism->couplings[0];
  // θ_c = −3 θ_p, θ_p = q_P, θ_c = −q_C: −q_C + 3 q_P = 0.
  double of_p = 0.0, of_c = 0.0;
  for (const Coupling::Term& term : gear.terms) {
    (term.joint == read.mechanism->FindJoint("P") ? of_p : of_c) = term.polynomial[0];
  }
  EXPECT_EQ(of_p / of_c, -3.0);
  EXPECT_EQ(AnalyseMobility(*read.mechanism).dofs, 1);
}

TEST(SdfImport, DrivesAreWherePluginsOrEffortsSaySo) {
  const auto effort = [](const char* e) {
    return fmt::format("<axis><xyz>1 2 2</xyz><limit><effort>{}</effort></limit></axis>", e);
  };
  const auto drives = [](const Read& read) { return NamesOf(read.mechanism->drives); };
  EXPECT_TRUE(drives(ReadText(ArmText({.joint = effort("5")}))).empty());
  EXPECT_EQ(drives(ReadText(ArmText({.joint = effort("0")}))), std::vector<std::string>{"k"});
  EXPECT_EQ(drives(ReadText(ArmText(
                {.more = "<plugin filename='ignition-gazebo-joint-position-controller-system' "
                         "name='c'><joint_name>j</joint_name></plugin>"}))),
            std::vector<std::string>{"j"});
}

TEST(SdfImport, LimitsThatLeaveNothingHold) {
  const Read read = ReadText(ArmText({.joint = "<axis><xyz>0 0 1</xyz><limit><lower>0.2</lower>"
                                               "<upper>0.2</upper></limit></axis>"}));
  ASSERT_TRUE(read.mechanism) << read.text;
  EXPECT_EQ(AnalyseMobility(*read.mechanism).dofs, 1);
  EXPECT_THAT(read.text, HasSubstr("joint 'j' is held at 0.2"));
}

TEST(SdfImport, LinksWithoutGravityAreCompensated) {
  for (const auto& [text, share] :
       {std::pair("", 0.0), {"<gravity>true</gravity>", 0.0}, {"<gravity>false</gravity>", 1.0}}) {
    const Read read = ReadText(ArmText({.arm = text}));
    ASSERT_TRUE(read.mechanism) << read.text;
    const int arm = read.mechanism->FindBody("arm");
    ASSERT_GT(arm, 0);
    EXPECT_EQ(read.mechanism->bodies[static_cast<size_t>(arm)].gravity_compensation, share);
  }
}

TEST(SdfImport, WorldsHaveGravityAndWhatIsStaticBelongsToThem) {
  std::string arm = ArmText();
  arm = arm.substr(arm.find("<model"), arm.find("</sdf>") - arm.find("<model"));
  const std::string world = "<sdf version='1.9'><world name='w'><gravity>0 0 -1.6</gravity>" + arm +
                            "<model name='floor'><static>true</static><link name='plane'/></model>"
                            "</world></sdf>";
  const Read read = ReadText(world);
  ASSERT_TRUE(read.mechanism) << read.text;
  EXPECT_EQ(read.mechanism->gravity_W, Vec3(0, 0, -1.6));
  EXPECT_EQ(read.mechanism->FindBody("plane"), -1);
  EXPECT_EQ(read.mechanism->bodies.size(), 4u);
  EXPECT_THAT(ReadText("<sdf version='1.9'><world name='a'/><world name='b'/></sdf>").text,
              HasSubstr("the file has 2 worlds"));
  // A static model in one that moves is not.
  EXPECT_THAT(SourcesOf(ReadText(ArmText({.more = "<model name='m'><static>true</static>"
                                                  "<link name='l'/></model>"}))),
              Contains("model static"));
}

TEST(SdfImport, ModelsInModelsAndIncludesArePartsOfTheRobot) {
  const test::TestFolder folder("sdf_include");
  folder.Write(
      "parts/hand.sdf",
      "<sdf version='1.9'><model name='hand'><link name='palm'><inertial><mass>0.5</mass>" +
          std::string(kInertia) + "</inertial></link></model></sdf>");
  const auto with = [](const std::string& uri) {
    return ArmText({.more = "<include><uri>" + uri +
                            "</uri><name>tool</name><pose relative_to='hand'>0 0 0.1 0 0 0</pose>"
                            "</include><joint name='grip' type='fixed'><parent>hand</parent>"
                            "<child>tool::palm</child></joint>"});
  };
  const std::string file = folder.PathOf("robot.sdf");
  const Read read = ReadFile(file, with("parts/hand.sdf"));
  ASSERT_TRUE(read.mechanism) << read.text;
  const int palm = read.mechanism->FindBody("tool__palm");
  ASSERT_GE(palm, 0) << testing::PrintToString(NamesOf(read.mechanism->bodies));
  EXPECT_EQ(read.mechanism->bodies[static_cast<size_t>(palm)].mass, 0.5);
  // A folder with its model.config.
  folder.Write("hand/model.config",
               "<model><sdf version='1.4'>old.sdf</sdf><sdf version='1.9'>"
               "model.sdf</sdf></model>");
  std::filesystem::copy_file(folder.PathOf("parts/hand.sdf"), folder.PathOf("hand/model.sdf"));
  EXPECT_TRUE(ReadFile(file, with("model://hand")).mechanism);
  // Nothing else is let in.
  folder.Write("inner/robot.sdf", "");
  const std::string inner = folder.PathOf("inner/robot.sdf");
  EXPECT_THAT(ReadFile(inner, with("../parts/hand.sdf")).text,
              HasSubstr("lies outside the folder of the file"));
  EXPECT_THAT(ReadFile(inner, with(folder.PathOf("parts/hand.sdf"))).text,
              HasSubstr("lies outside the folder of the file"));
  for (const char* uri : {"https://fuel.gazebosim.org/1.0/a/models/hand", "/etc/passwd", "none.sdf",
                          "file:///etc/passwd", ""}) {
    const Read refused = ReadFile(file, with(uri));
    EXPECT_THAT(refused.text, HasSubstr(uri)) << refused.text;
    EXPECT_THAT(refused.text, HasSubstr("robot.sdf:1:1: error: include")) << refused.text;
  }
  folder.Write("robot.sdf", with("robot.sdf"));
  EXPECT_THAT(ReadFile(file, with("robot.sdf")).text, HasSubstr("includes itself"));
}

// What is left out, each with a text that has it and one that has not.
struct Sample {
  std::string with, without;
};
std::map<std::string, Sample> Samples() {
  const auto of_arm = [](const std::string& text) { return ArmText({.arm = text}); };
  const auto of_model = [](const std::string& text) { return ArmText({.more = text}); };
  const auto dynamics = [](const std::string& type, const std::string& text) {
    return ArmText(
        {.type = type, .joint = "<axis><xyz>0 0 1</xyz><dynamics>" + text + "</dynamics></axis>"});
  };
  const auto ode = [](const std::string& text) {
    return ArmText(
        {.joint = "<axis><xyz>0 0 1</xyz></axis><physics><ode>" + text + "</ode></physics>"});
  };
  std::string world = ArmText();
  world = world.substr(world.find("<model"), world.find("</sdf>") - world.find("<model"));
  const auto in_world = [world](const std::string& text) {
    return "<sdf version='1.9'><world name='w'>" + text + world + "</world></sdf>";
  };
  std::map<std::string, Sample> samples = {
      {"world/state", {in_world("<state world_name='w'/>"), in_world("")}},
      {"world/population",
       {in_world("<population name='p'><model name='m'><link name='l'/></model></population>"),
        in_world("")}},
      {"world/joint",
       {in_world("<joint name='j' type='fixed'><parent>world</parent><child>r</child></joint>"),
        in_world("")}},
      {"model static", {of_model("<static>true</static>"), of_model("<static>false</static>")}},
      {"floating",
       {FourBar(), FourBar("<joint name='w' type='fixed'><parent>world</parent><child>"
                           "base</child></joint>")}},
      {"model/enable_wind text",
       {of_model("<enable_wind>true</enable_wind>"), of_model("<enable_wind>0</enable_wind>")}},
      {"model/gripper",
       {of_model("<gripper name='g'><gripper_link>hand</gripper_link><palm_link>"
                 "arm</palm_link></gripper>"),
        ArmText()}},
      {"include/experimental:params",
       {of_model("<include><uri>x.sdf</uri><experimental:params/></include>"), ArmText()}},
      {"plugin",
       {of_model("<plugin name='p' filename='libunheard.so'/>"),
        of_model("<plugin name='p' filename='libgazebo_ros_imu.so'/>")}},
      {"link/enable_wind text",
       {of_arm("<enable_wind>1</enable_wind>"), of_arm("<enable_wind>false</enable_wind>")}},
      {"link/kinematic text",
       {of_arm("<kinematic>true</kinematic>"), of_arm("<kinematic>0</kinematic>")}},
      {"link/inertial auto",
       {Sdf("<link name='l'><inertial auto='true'/></link>"),
        Sdf("<link name='l'><inertial auto='false'/></link>")}},
      {"inertial/fluid_added_mass",
       {Sdf("<link name='l'><inertial><fluid_added_mass><xx>1</xx></fluid_added_mass></inertial>"
            "</link>"),
        Sdf("<link name='l'><inertial/></link>")}},
      {"dynamics negative",
       {dynamics("revolute", "<damping>-0.1</damping>"),
        dynamics("revolute", "<damping>0.1</damping>")}},
      {"axis2/mimic",
       {ArmText({.type = "universal",
                 .joint = "<axis><xyz>0 0 1</xyz></axis><axis2><xyz>0 1 0</xyz><mimic joint='k'/>"
                          "</axis2>"}),
        ArmText({.type = "universal",
                 .joint = "<axis><xyz>0 0 1</xyz></axis><axis2><xyz>0 1 0</xyz></axis2>"})}},
      {"ode/max_force text", {ode("<max_force>3</max_force>"), ode("<max_force>0</max_force>")}},
      {"suspension/cfm text",
       {ode("<suspension><cfm>0.1</cfm></suspension>"),
        ode("<suspension><cfm>0.0</cfm></suspension>")}},
      {"gearbox",
       {of_model(
            "<joint name='g' type='gearbox'><parent>base</parent><child>hand</child><axis><xyz>"
            "0 0 1</xyz></axis><axis2><xyz>0 0 1</xyz></axis2><gearbox_reference_body>arm"
            "</gearbox_reference_body></joint>"),
        ArmText()}},
      {"link/drake:deformable_properties", {of_arm("<drake:deformable_properties/>"), ArmText()}},
  };
  for (const char* value : {"linear", "angular"}) {
    const auto decay = [&](const char* x) {
      return of_arm(fmt::format("<velocity_decay><{0}>{1}</{0}></velocity_decay>", value, x));
    };
    samples[fmt::format("velocity_decay/{} text", value)] = {decay("0.1"), decay("0")};
  }
  const auto ball = [&](const char* x) {
    return dynamics("ball", fmt::format("<spring_stiffness>{}</spring_stiffness>", x));
  };
  samples["ball spring_stiffness"] = {ball("0.1"), ball("0")};
  for (const char* element :
       {"joint", "linear_bushing_rpy", "linear_spring_damper", "ball_constraint", "weld_constraint",
        "distance_constraint", "tendon_constraint", "deformable_properties"}) {
    samples[fmt::format("drake:{}", element)] = {
        of_model(fmt::format("<drake:{} name='x'/>", element)), ArmText()};
  }
  return samples;
}

TEST(SdfElements, EachThatIsLeftOutOrRefusedIsNamed) {
  const std::map<std::string, Sample> samples = Samples();
  std::set<std::string> of_rows;
  for (const SdfRow& row : SdfRows()) {
    if (row.fate != SdfFate::kLeftOut && row.fate != SdfFate::kRefused) continue;
    const std::string source =
        fmt::format("{}{}{}", row.element, *row.values == '\0' ? "" : " ", row.values);
    of_rows.insert(source);
    const auto sample = samples.find(source);
    ASSERT_NE(sample, samples.end()) << source << " has no sample";
    const Read with = ReadText(sample->second.with), without = ReadText(sample->second.without);
    if (row.fate == SdfFate::kRefused) {
      EXPECT_FALSE(with.mechanism) << source;
      EXPECT_THAT(with.text, HasSubstr(std::string("is not read: ") + row.effect)) << source;
    } else {
      EXPECT_THAT(SourcesOf(with), Contains(source)) << with.text;
    }
    EXPECT_THAT(SourcesOf(without), testing::Not(Contains(source))) << source;
    EXPECT_THAT(without.text, testing::Not(HasSubstr("is not read"))) << source;
  }
  for (const auto& [source, sample] : samples) {
    EXPECT_TRUE(of_rows.contains(source)) << source << " is a sample of no row";
  }
}

TEST(SdfElements, UnknownElementsAreACaveat) {
  const Read read = ReadText(ArmText({.arm = "<levity>1</levity>"}));
  EXPECT_THAT(SourcesOf(read), Contains("link/levity"));
  EXPECT_THAT(read.text, HasSubstr("<levity> (1: arm) is left out: it is not known"));
  std::string text = ArmText();
  text.insert(text.find(" name='arm'"), " levity='1'");
  EXPECT_THAT(SourcesOf(ReadText(text)), Contains("model/link levity"));
}

// libsdformat's own description of SDF: no element of models is unknown.
TEST(SdfElements, AllOfTheFormatAreInTheTable) {
  const std::filesystem::path schemas = "/usr/share/sdformat12/1.9";
  ASSERT_TRUE(std::filesystem::exists(schemas))
      << schemas << " (package sdformat-sdf) is not there";
  const auto top_elements = [&](const std::string& name) {
    std::ifstream stream(schemas / (name + ".sdf"));
    std::vector<std::string> elements;
    int depth = 0;
    for (std::string line; std::getline(stream, line);) {
      const bool opens = line.find("<element name=") != std::string::npos;
      if (opens && depth == 1) {
        const size_t from = line.find('"') + 1;
        elements.push_back(line.substr(from, line.find('"', from) - from));
      }
      const size_t include = line.find("<include filename=\"");
      if (include != std::string::npos && depth == 1) {
        const size_t from = include + 19;
        elements.push_back(line.substr(from, line.find('.', from) - from));
      }
      if (line.find("<element ") != std::string::npos && line.find("/>") == std::string::npos) {
        ++depth;
      }
      if (line.find("</element>") != std::string::npos) --depth;
    }
    return elements;
  };
  int seen = 0;
  for (const char* parent : {"world", "model", "link", "joint", "inertial"}) {
    for (const std::string& element : top_elements(parent)) {
      ++seen;
      const bool known = std::ranges::any_of(SdfRows(), [&](const SdfRow& row) {
        const std::string full = std::string(parent) + "/" + element;
        return row.element == full || row.element == element;
      });
      EXPECT_TRUE(known) << parent << "/" << element;
    }
  }
  EXPECT_GT(seen, 50);
}

TEST(SdfImport, HostileFilesAreErrors) {
  const std::string good = ArmText();
  const auto changed = [&](const std::string& from, const std::string& to) {
    std::string text = good;
    text.replace(text.find(from), from.size(), to);
    return text;
  };
  std::string deep = "<sdf version='1.9'><model name='r'>";
  for (int k = 0; k < 150; ++k) deep += "<model name='m'>";
  const std::string bomb = "<!DOCTYPE b [<!ENTITY a 'aaaaaaaaaa'><!ENTITY b '&a;&a;&a;&a;'>]>" +
                           changed("<mass>2</mass>", "<mass>&b;</mass>");
  const std::map<std::string, std::string> texts = {
      {"nothing", ""},
      {"no XML", "name: r"},
      {"no SDF", "<robot name='r'/>"},
      {"no model", "<sdf version='1.9'/>"},
      {"no link", Sdf("")},
      {"no version", "<sdf><model name='r'><link name='a'/></model></sdf>"},
      {"NaN", changed("<mass>2</mass>", "<mass>nan</mass>")},
      {"NaN in a pose", changed("0.1 0.2 0.3 0.3", "nan 0.2 0.3 0.3")},
      {"infinite", changed("<ixx>0.03</ixx>", "<ixx>inf</ixx>")},
      {"huge", changed("<mass>2</mass>", "<mass>1e308</mass>")},
      {"huge pose", changed("0.1 0.2 0.3 0.3", "1e308 0.2 0.3 0.3")},
      {"beyond numbers", changed("<mass>2</mass>", "<mass>1e999</mass>")},
      {"negative mass", changed("<mass>2</mass>", "<mass>-2</mass>")},
      {"no direction", changed("<xyz>1 2 2</xyz>", "<xyz>0 0 0</xyz>")},
      {"two of a name", changed("<link name='arm'>", "<link name='base'>")},
      {"no such link", changed("<child>arm</child>", "<child>leg</child>")},
      {"no such frame", changed("relative_to='base'", "relative_to='bse'")},
      {"a circle of frames", changed("<pose>0 0 0.5", "<pose relative_to='arm'>0 0 0.5")},
      {"itself", changed("<parent>base</parent>", "<parent>arm</parent>")},
      {"no such type", changed("type='revolute'", "type='revolut'")},
      {"future", changed("version='1.9'", "version='9.9'")},
      {"control character", changed("name='arm'", "name='a\x01rm'")},
      {"deep", deep},
      {"entities", bomb},
  };
  for (const auto& [what, text] : texts) {
    const Read read = ReadText(text);
    EXPECT_FALSE(read.mechanism) << what;
    EXPECT_THAT(read.text, HasSubstr("error: ")) << what;
    EXPECT_THAT(read.text, testing::Not(HasSubstr("crashed"))) << what << read.text;
  }
  for (size_t length = 0; length < good.size(); length += 97) {
    EXPECT_FALSE(ReadText(good.substr(0, length)).mechanism) << length;
  }
  EXPECT_THAT(ReadText(changed("<mass>2</mass>", "\n<mass>nan</mass>")).text,
              HasSubstr("robot.sdf:2:1: error: <mass> 'nan' of 'arm' is not a finite number"));
}

TEST(SdfImport, ShapesAreForPictures) {
  const auto visual = [](const std::string& geometry) {
    return "<visual name='v'><pose>0 0 0.1 0 0 0</pose><geometry>" + geometry +
           "</geometry><material><diffuse>1 0 0 1</diffuse></material></visual>";
  };
  for (const auto& [geometry, index] :
       {std::pair("<capsule><radius>0.1</radius><length>0.2</length></capsule>", size_t{0}),
        {"<cylinder><radius>0.1</radius><length>0.2</length></cylinder>", size_t{1}},
        {"<box><size>1 2 3</size></box>", size_t{2}},
        {"<sphere><radius>0.1</radius></sphere>", size_t{3}}}) {
    const Read read = ReadText(ArmText({.arm = visual(geometry)}));
    ASSERT_TRUE(read.mechanism) << read.text;
    const Body& arm = read.mechanism->bodies[static_cast<size_t>(read.mechanism->FindBody("arm"))];
    ASSERT_EQ(arm.shapes.size(), 1u) << geometry;
    EXPECT_EQ(arm.shapes[0].geometry.index(), index) << geometry;
    EXPECT_EQ(arm.shapes[0].color, "#ff0000ff");
  }
  const test::TestFolder folder("sdf_mesh");
  folder.Write("meshes/m.obj",
               "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 1 4 3\n");
  const auto mesh = [&](const std::string& uri) {
    return ReadFile(
        folder.PathOf("robot.sdf"),
        ArmText({.arm = visual("<mesh><uri>" + uri + "</uri><scale>2 2 2</scale></mesh>")}));
  };
  for (const char* uri : {"meshes/m.obj", "model://meshes/m.obj", "package://meshes/m.obj"}) {
    const Read read = mesh(uri);
    ASSERT_TRUE(read.mechanism) << read.text;
    const Body& arm = read.mechanism->bodies[static_cast<size_t>(read.mechanism->FindBody("arm"))];
    ASSERT_EQ(arm.shapes.size(), 1u) << uri << read.text;
    EXPECT_EQ(std::get<Mesh>(arm.shapes[0].geometry).scale, Vec3(2, 2, 2));
  }
  EXPECT_THAT(mesh("meshes/n.obj").text, HasSubstr("'meshes/n.obj' is not there"));
  // Of an included file: as seen from there.
  folder.Write("meshes/tool.sdf",
               Sdf("<link name='tip'>" + visual("<mesh><uri>m.obj</uri></mesh>") + "</link>"));
  const Read read = ReadFile(
      folder.PathOf("robot.sdf"),
      ArmText({.more = "<include><uri>meshes/tool.sdf</uri><name>tool</name></include><joint "
                       "name='grip' type='fixed'><parent>hand</parent><child>tool::tip</child>"
                       "</joint>"}));
  ASSERT_TRUE(read.mechanism) << read.text;
  const int tip = read.mechanism->FindBody("tool__tip");
  ASSERT_GE(tip, 0);
  EXPECT_EQ(read.mechanism->bodies[static_cast<size_t>(tip)].shapes.size(), 1u) << read.text;
}

TEST(SdfImport, TheSourceGoesToTheReaderAsItIs) {
  Diagnostics diagnostics;
  const auto source =
      InspectSdf(ArmText({.arm = "<enable_wind>1</enable_wind>"}), "robot.sdf", &diagnostics);
  ASSERT_TRUE(source) << diagnostics.Text();
  const auto back = FromBytes<SdfSource>(ToBytes(*source));
  ASSERT_TRUE(back);
  EXPECT_EQ(ToBytes(*back), ToBytes(*source));
  EXPECT_EQ(back->left_out.size(), 1u);
  EXPECT_FALSE(FromBytes<SdfSource>(ToBytes(*source).substr(1)));
}

// libsdformat 12 refuses a file for any of these.
TEST(SdfImport, WhatNoForceNeedsMayBeFaulty) {
  const Read plain = ReadText(ArmText());
  ASSERT_TRUE(plain.mechanism) << plain.text;
  const std::string faulty[] = {
      "<sensor name='s' type='air_speed_of_tomorrow'/>",
      "<visual name='v'><geometry><box><size>1 1 1</size></box></geometry><material><script>"
      "<name>Grey</name></script></material></visual>",
      "<collision name='c'><geometry><box><size>1 1 1</size></box></geometry><surface><friction>"
      "<ode><mu>much</mu></ode></friction></surface></collision>",
      "<!-- <sensor> --><sensor name='s' type='none' note='a > b'><sensor/></sensor>"};
  for (const std::string& arm : faulty) {
    const Read read = ReadText(ArmText({.arm = arm}));
    ASSERT_TRUE(read.mechanism) << arm << "\n" << read.text;
    EXPECT_EQ(read.mechanism->bodies.size(), plain.mechanism->bodies.size()) << arm;
  }
  // Lines stay as they are.
  const Read wrong =
      ReadText(ArmText({.arm = "<sensor name='s'>\n\n</sensor>", .more = "\n<link/>"}));
  EXPECT_THAT(wrong.text, HasSubstr("robot.sdf:4:")) << wrong.text;
}

TEST(SdfImport, WhatIsMergedMayMergeOthers) {
  const test::TestFolder folder("sdf_merge");
  const auto merging = [](const std::string& name, const std::string& of) {
    return fmt::format(
        "<sdf version='1.9'><model name='{}'><include merge='true'><uri>{}</uri></include></model>"
        "</sdf>",
        name, of);
  };
  folder.Write("inner.sdf", ArmText({.pose = "0.123456789012345 0.2 0.3 0.3 -0.2 0.5"}));
  folder.Write("middle.sdf", merging("middle", "inner.sdf"));
  const std::string text = merging("outer", "middle.sdf");
  const Read read = ReadFile(folder.Write("outer.sdf", text), text);
  ASSERT_TRUE(read.mechanism) << read.text;
  const Joint& j = read.mechanism->joints[read.mechanism->FindJoint("j")];
  EXPECT_NEAR(j.X_PF.translation().x(), 0.123456789012345, 1e-15);
  // Gazebo's models by their names, beside the file's folder.
  folder.Write("models/part/model.config", "<model><sdf version='1.9'>part.sdf</sdf></model>");
  folder.Write("models/part/part.sdf", ArmText());
  for (const char* uri : {"model://part", "part"}) {
    const std::string whole = merging("whole", uri);
    const std::string file = folder.Write("models/whole/whole.sdf", whole);
    EXPECT_FALSE(ReadFile(file, whole).mechanism) << uri;
    UseMeshPackages({{"", folder.PathOf("models")}});
    const Read opened = ReadFile(file, whole);
    UseMeshPackages({});
    EXPECT_TRUE(opened.mechanism) << uri << opened.text;
  }
}

TEST(SdfImport, AnAxisOfTwoWhoseLimitsAreEqualIsHeld) {
  const auto joint = [](const std::string& first, const std::string& second) {
    return "<axis><xyz>0 0 1</xyz>" + first + "</axis><axis2><xyz>0 1 0</xyz>" + second +
           "</axis2>";
  };
  const std::string held = "<limit><lower>0.3</lower><upper>0.3</upper></limit>",
                    damped = "<dynamics><damping>0.7</damping></dynamics>";
  const Read both = ReadText(ArmText({.type = "universal", .joint = joint("", damped)}));
  ASSERT_TRUE(both.mechanism) << both.text;
  const Joint& universal = both.mechanism->joints[both.mechanism->FindJoint("j")];
  for (const int k : {0, 1}) {
    const std::string axes = k == 0 ? joint(held, damped) : joint(damped, held);
    const Read read = ReadText(ArmText({.type = "universal", .joint = axes}));
    ASSERT_TRUE(read.mechanism) << read.text;
    EXPECT_THAT(read.text, HasSubstr(fmt::format("axis {} of joint 'j' is held at 0.3", k + 1)));
    const Joint& hinge = read.mechanism->joints[read.mechanism->FindJoint("j")];
    ASSERT_EQ(hinge.kind, JointKind::kRevolute);
    const auto pose = [](const Joint& one, const std::array<double, 6>& q) {
      return (one.X_PF * JointPose(one, q) * one.X_CM.inverse()).matrix();
    };
    const std::array<double, 6> two =
        k == 0 ? std::array<double, 6>{0.3, 0.4} : std::array<double, 6>{0.4, 0.3};
    EXPECT_TRUE(pose(hinge, {0.4}).isApprox(pose(universal, two), kSame)) << k;
    ASSERT_EQ(read.mechanism->elements.size(), 1u);
    EXPECT_EQ(read.mechanism->elements[0].coordinate, 0);
  }
}

}  // namespace
}  // namespace mbv
