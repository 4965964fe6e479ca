// Every element and attribute of MJCF: taken, without a force, or a caveat.
#include "simulation/mjcf/foreign.h"

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <mujoco/mujoco.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <map>
#include <numbers>
#include <set>
#include <sstream>

#include "model_file/load_model.h"
#include "model_file/mesh/read_mesh.h"
#include "model_file/write_model.h"
#include "simulation/engine/engine_model.h"
#include "simulation/import/read_mjcf.h"
#include "simulation/mjcf/foreign_rows.h"
#include "simulation/mjcf/mjcf.h"
#include "tests/support/test_folder.h"

namespace mbv {
namespace {

using mjcf::Fate;
using mjcf::ForeignRow;

// An arm of two bodies on hinges and one on a ball. Each part of the file takes more text.
struct Parts {
  std::string head = {}, arm = {}, joint = {}, in_arm = {}, in_world = {}, tail = {};
};
std::string Arm(const Parts& p = {}) {
  return R"(<mujoco model="arm"><compiler angle="radian"/>)" + p.head + "<worldbody>" + p.in_world +
         R"(<body name="upper" )" + p.arm + R"(><joint name="A" axis="0 1 0" )" + p.joint +
         R"(/><inertial pos="0 0 0.2" mass="2" diaginertia="0.02 0.02 0.001"/>)" + p.in_arm +
         R"(<body name="lower" pos="0 0 0.4"><joint name="B" axis="0 1 0"/>)"
         R"(<inertial pos="0 0 0.1" mass="1" diaginertia="0.01 0.01 0.001"/>)" +
         R"(<site name="tip" pos="0 0 0.2"/></body></body>)" +
         R"(<body name="bob" pos="1 0 0"><joint name="S" type="ball" )"
         R"(/><inertial pos="0 0 -0.1" mass="1" diaginertia="0.01 0.01 0.001"/>)"
         R"(<geom name="shell" type="sphere" size="0.05" contype="0" conaffinity="0" )"
         "/></body></worldbody>" +
         p.tail + "</mujoco>\n";
}

struct Read {
  std::optional<MjcfModel> model;
  Diagnostics diagnostics;
};
Read ReadText(const std::string& text) {
  Read read;
  read.model = ReadMjcf(text, "arm.xml", {}, &read.diagnostics);
  return read;
}

std::set<std::string> Sources(const Read& read) {
  std::set<std::string> sources;
  if (!read.model) return sources;
  for (const ModelCaveat& caveat : read.model->left_out) sources.insert(caveat.source);
  return sources;
}

// Of each row that is left out: a file in which it acts, and one in which it does nothing.
struct Sample {
  std::string acts, neutral;
};
std::map<std::string, Sample> Samples() {
  const std::string tendons =
      "<tendon><spatial name='t' {}><site site='tip'/><site site='base'/><site site='far'/>"
      "</spatial></tendon>";
  const std::string fixed =
      "<tendon><fixed name='t' {}><joint joint='A' coef='1'/></fixed></tendon>";
  const std::string base = "<site name='base' pos='0.3 0 0'/><site name='far' pos='1 0 0'/>";
  const auto spatial = [&](const std::string& with) {
    return Arm({.in_world = base, .tail = fmt::format(fmt::runtime(tendons), with)});
  };
  const auto of_fixed = [&](const std::string& with) {
    return Arm({.tail = fmt::format(fmt::runtime(fixed), with)});
  };
  const auto option = [](const std::string& with) {
    return Arm({.head = "<option " + with + "/>"});
  };
  const auto joint = [](const std::string& with) { return Arm({.joint = with}); };
  const auto actuator = [](const std::string& with) {
    return Arm({.tail = "<actuator>" + with + "</actuator>"});
  };
  const std::string mesh = "<asset><mesh name='m' vertex='0 0 0 1 0 0 0 1 0 0 0 1' {}/></asset>";
  const auto of_mesh = [&](const std::string& with) {
    return Arm({.head = fmt::format(fmt::runtime(mesh), with),
                .in_world = "<body name='solid'><joint/><geom type='mesh' mesh='m'/></body>"});
  };
  const auto composite = [](const std::string& with) {
    return Arm({.in_arm = "<body name='c'><composite type='particle' count='2 2 1' spacing='0.1' " +
                          with + "><geom size='0.01'/></composite></body>"});
  };
  const auto equality = [](const std::string& with) {
    return Arm({.tail = "<equality>" + with + "</equality>"});
  };
  std::map<std::string, Sample> samples = {
      {"option density", {option("density='1.2'"), option("density='0'")}},
      {"option viscosity", {option("viscosity='1e-3'"), option("viscosity='0'")}},
      {"option wind", {option("density='1.2' wind='1 0 0'"), option("wind='1 0 0'")}},
      {"asset/mesh inertia", {of_mesh("inertia='shell'"), of_mesh("inertia='legacy'")}},
      {"limit without room range",
       {joint("limited='true' range='-0.1 0.1' margin='0.2'"),
        joint("limited='true' range='-0.1 0.1' margin='0.01'")}},
      {"any joint damping", {joint("damping='-0.1'"), joint("damping='0.1'")}},
      {"stiffness 2nd", {joint("stiffness='3 1 2'"), joint("stiffness='3 0 0'")}},
      {"springlength 2nd",
       {spatial("stiffness='3' springlength='0.1 0.2'"), spatial("springlength='0.2'")}},
      {"damping 2nd", {joint("damping='3 1 2'"), joint("damping='3 0'")}},
      {"body/freejoint",
       {Arm({.in_world = "<body name='loose' pos='5 0 0'><freejoint/><inertial pos='0 0 0' "
                         "mass='1' diaginertia='1 1 1'/></body>"}),
        Arm()}},
      {"body/plugin", {Arm({.in_arm = "<plugin plugin='p'/>"}), Arm()}},
      {"geom/plugin",
       {Arm({.in_arm = "<geom name='g' size='0.1' contype='0' conaffinity='0'><plugin "
                       "plugin='p'/></geom>"}),
        Arm({.in_arm = "<geom name='g' size='0.1' contype='0' conaffinity='0'/>"})}},
      {"composite/plugin",
       {composite("").insert(composite("").find("<geom size"), "<plugin plugin='p'/>"),
        composite("")}},
      {"body/flexcomp", {Arm({.in_arm = "<flexcomp name='f' type='grid'/>"}), Arm()}},
      {"deformable/flex",
       {Arm({.tail = "<deformable><flex name='f' body='upper' element='0 1'/></deformable>"}),
        Arm({.tail = "<deformable/>"})}},
      {"contact",
       {Arm({.in_arm = "<geom name='hit' type='sphere' size='0.2' pos='0 0 0.3'/>",
             .in_world = "<geom name='floor' type='plane' size='1 1 1' pos='0 0 0.2'/>"}),
        Arm({.in_arm = "<geom name='hit' type='sphere' size='0.05' pos='0 0 0.3'/>",
             .in_world = "<geom name='floor' type='plane' size='1 1 1' pos='0 0 -2'/>"})}},
      {"equality/joint",
       {equality("<joint name='e' joint1='B' polycoef='0.1 0 0 0 0'/>"),
        equality("<joint name='e' joint1='B' joint2='A' polycoef='0.1 1 0 0 0'/>")}},
      {"equality/tendon",
       {Arm({.tail = "<tendon><fixed name='t'><joint joint='A' coef='1'/></fixed><fixed name='u'>"
                     "<joint joint='B' coef='1'/></fixed></tendon><equality><tendon name='e' "
                     "tendon1='t' tendon2='u' polycoef='0 0.5 1 0 0'/></equality>"}),
        Arm({.tail = "<tendon><fixed name='t'><joint joint='A' coef='1'/><joint joint='B' "
                     "coef='2'/></fixed></tendon><equality><tendon name='e' tendon1='t' "
                     "polycoef='0.1 0 0 0 0'/></equality>"})}},
      {"actuator of a ball joint",
       {actuator("<motor name='m' joint='S'/>"), actuator("<motor name='m' joint='A'/>")}},
      {"actuator/orientation", {actuator("<orientation name='m' joint='S'/>"), Arm()}},
      {"actuator/pid", {actuator("<pid name='m' joint='A'/>"), Arm()}},
      {"actuator/dcmotor", {actuator("<dcmotor name='m' joint='A'/>"), Arm()}},
      {"actuator/plugin", {actuator("<plugin name='m' joint='A' plugin='p'/>"), Arm()}},
  };
  for (const char* attribute : {"builtin='sphere'", "params='1'"}) {
    const std::string name = std::string(attribute).substr(0, std::string(attribute).find('='));
    samples["asset/mesh " + name] = {of_mesh(attribute), of_mesh("")};
  }
  samples["mesh/plugin"] = {
      Arm({.head = "<asset><mesh name='m' vertex='0 0 0 1 0 0 0 1 0 0 0 1'><plugin plugin='p'/>"
                   "</mesh></asset>",
           .in_world = "<body name='solid'><joint/><geom type='mesh' mesh='m'/></body>"}),
      of_mesh("")};
  for (const char* attribute : {"vertex", "initial", "curve", "size", "quat"}) {
    samples["body/composite " + std::string(attribute)] = {
        composite(fmt::format("{}='1'", attribute)), composite("")};
  }
  for (const char* attribute : {"stiffness", "damping", "frictionloss"}) {
    const auto with = [&](int value) { return fmt::format("{}='{}'", attribute, value); };
    samples["tendon/spatial " + std::string(attribute)] = {spatial(with(2)), spatial(with(0))};
    samples["tendon/fixed " + std::string(attribute)] = {of_fixed(with(2)), of_fixed(with(0))};
  }
  samples["tendon/spatial armature"] = {spatial("armature='1'"), spatial("armature='0'")};
  samples["tendon/fixed armature"] = {of_fixed("armature='1'"), of_fixed("armature='0'")};
  for (const char* attribute : {"limited", "range"}) {
    const std::string on = "limited='true' range='0 1'", off = "limited='false' range='0 1'";
    samples["tendon/spatial " + std::string(attribute)] = {spatial(on), spatial(off)};
    samples["tendon/fixed " + std::string(attribute)] = {of_fixed(on), of_fixed(off)};
  }
  for (const char* attribute : {"damping", "armature"}) {
    const auto with = [&](const char* value) {
      return actuator(fmt::format("<motor name='m' joint='A' {}='{}'/>", attribute, value));
    };
    samples["actuator/* " + std::string(attribute)] = {with("1"), with("0")};
  }
  const std::string on_joint = actuator("<motor name='m' joint='A'/>");
  samples["actuator/* tendon"] = {
      Arm({.tail = "<tendon><fixed name='t'><joint joint='A' coef='1'/><joint joint='B' coef='1'/>"
                   "</fixed></tendon><actuator><motor name='m' tendon='t'/></actuator>"}),
      on_joint};
  for (const char* attribute : {"site", "refsite"}) {
    samples["actuator/* " + std::string(attribute)] = {
        Arm({.in_world = base,
             .tail = "<actuator><motor name='m' site='tip' refsite='base'/></actuator>"}),
        on_joint};
  }
  for (const char* attribute : {"slidersite", "cranksite"}) {
    samples["actuator/* " + std::string(attribute)] = {
        Arm({.in_world = base,
             .tail = "<actuator><motor name='m' slidersite='base' cranksite='tip' "
                     "cranklength='1'/></actuator>"}),
        on_joint};
  }
  samples["actuator/* body"] = {actuator("<adhesion name='m' body='upper' ctrlrange='0 1' "
                                         "gain='1'/>"),
                                on_joint};
  return samples;
}

// Whether a caveat is about a row's attribute.
bool Names(const std::set<std::string>& sources, const std::string& element,
           const std::string& attribute) {
  if (element == "actuator/*") {
    return std::ranges::any_of(
        sources, [&](const std::string& source) { return source.starts_with("actuator/"); });
  }
  // One caveat reports of a tendon's limit, whichever kind the tendon is.
  if (element.starts_with("tendon/") && attribute != "armature") {
    return sources.contains("tendon/spatial " + (attribute == "limited" ? "range" : attribute));
  }
  return sources.contains(element + (attribute.empty() ? "" : " ") + attribute);
}

TEST(ForeignMjcf, WhateverActsOnForcesAndIsLeftOutIsACaveatUnlessItDoesNothing) {
  const std::map<std::string, Sample> samples = Samples();
  std::set<std::string> walked;
  for (const ForeignRow& row : mjcf::ForeignRows()) {
    if (row.fate != Fate::kLeftOut) continue;
    std::istringstream words(row.attributes);
    std::vector<std::string> attributes{std::istream_iterator<std::string>(words), {}};
    if (attributes.empty()) attributes = {""};
    for (const std::string& attribute : attributes) {
      const std::string key = std::string(row.element) + (attribute.empty() ? "" : " ") + attribute;
      const auto sample = samples.find(key);
      ASSERT_NE(sample, samples.end()) << "no sample of " << key;
      walked.insert(key);
      const Read acts = ReadText(sample->second.acts);
      // MuJoCo may refuse a file without what was left out; never is it taken in silence.
      if (acts.model) {
        EXPECT_TRUE(Names(Sources(acts), row.element, attribute)) << key << "\n"
                                                                  << acts.diagnostics.Text();
      } else {
        EXPECT_TRUE(acts.diagnostics.has_errors()) << key;
      }
      EXPECT_NE(acts.diagnostics.Text().find(row.effect), std::string::npos)
          << key << "\n"
          << acts.diagnostics.Text();
      if (sample->second.neutral.empty()) continue;
      const Read neutral = ReadText(sample->second.neutral);
      ASSERT_TRUE(neutral.model) << key << neutral.diagnostics.Text();
      EXPECT_TRUE(Sources(neutral).empty()) << key << "\n" << neutral.diagnostics.Text();
    }
  }
  for (const auto& [key, sample] : samples) EXPECT_TRUE(walked.contains(key)) << key;
}

// The elements and attributes of MuJoCo 2.2, as it lists them itself, are all known.
TEST(ForeignMjcf, EveryElementAndAttributeOfTheInstalledMuJoCoHasARow) {
  std::string text(200'000, '\0');
  mj_printSchema("", text.data(), static_cast<int>(text.size()), 0, 0);
  std::istringstream lines(text.c_str());
  std::vector<std::string> path;
  std::string element;
  int attributes = 0;
  for (std::string line; std::getline(lines, line);) {
    std::istringstream words(line);
    std::string word, kind;
    std::vector<std::string> names;
    if (const size_t mark = line.find(" ("); mark != std::string::npos && mark < 30) {
      const size_t indent = line.find_first_not_of(' ');
      words >> word >> kind;
      if (word == "(world)body") word = "body";
      path.resize(std::min(path.size(), indent / 3));
      path.push_back(word);
      element = mjcf::ForeignElement(path.size() > 1 ? path[path.size() - 2] : "", word);
      EXPECT_TRUE(mjcf::IsForeignElement(element) || element == "actuator" || element == "tendon" ||
                  element == "equality")
          << element;
    }
    while (words >> word) {
      EXPECT_NE(mjcf::FindForeignRow(element, word), nullptr) << element << " " << word;
      ++attributes;
    }
  }
  EXPECT_GT(attributes, 800);
}

// Each name of a row once, or two rows could contradict each other.
TEST(ForeignMjcf, NoAttributeStandsInTwoRows) {
  std::set<std::string> seen;
  for (const ForeignRow& row : mjcf::ForeignRows()) {
    std::istringstream words(row.attributes);
    std::vector<std::string> names{std::istream_iterator<std::string>(words), {}};
    if (names.empty()) names = {""};
    for (const std::string& name : names) {
      EXPECT_TRUE(seen.insert(std::string(row.element) + " " + name).second)
          << row.element << " " << name;
    }
    if (row.fate == Fate::kLeftOut || row.fate == Fate::kRefused) {
      EXPECT_STRNE(row.effect, "") << row.element;
    }
  }
}

TEST(ForeignMjcf, WhatNoVersionKnowsIsACaveat) {
  const Read attribute = ReadText(Arm({.arm = "antigravity='1'"}));
  EXPECT_TRUE(Sources(attribute).contains("body antigravity")) << attribute.diagnostics.Text();
  const Read element = ReadText(Arm({.tail = "<magnets><magnet force='3'/></magnets>"}));
  EXPECT_TRUE(Sources(element).contains("magnets")) << element.diagnostics.Text();
  EXPECT_TRUE(Sources(ReadText(Arm())).empty());
}

// What a file switches off is off in the mechanism, too.
TEST(ForeignMjcf, FlagsThatSwitchForcesOffAreTaken) {
  const std::string acting =
      "damping='2' stiffness='3' frictionloss='0.1' limited='true' range='-1 1'";
  const std::string loop =
      "<equality><connect name='c' body1='upper' body2='lower' anchor='0 0 0.4'/></equality>";
  const auto read = [&](const std::string& flag) {
    Read r = ReadText(Arm({.head = "<option density='1'><flag " + flag + "/></option>",
                           .joint = acting,
                           .tail = loop}));
    EXPECT_TRUE(r.model) << r.diagnostics.Text();
    return r;
  };
  const auto laws = [](const Read& r) {
    std::string text;
    for (const ForceElement& e : r.model->mechanism.elements) text += std::string(WordOf(e)) + " ";
    return text;
  };
  const auto loops = [](const Read& r) {
    return std::ranges::count_if(r.model->mechanism.joints, &Joint::closure);
  };
  const Read all = read("gravity='enable'");
  EXPECT_EQ(all.model->mechanism.gravity_W, Vec3(0, 0, -9.81));
  EXPECT_EQ(laws(all), "damping spring friction ");
  EXPECT_EQ(loops(all), 1);
  EXPECT_EQ(all.model->mechanism.joints[0].range[0].upper, 1.0);
  EXPECT_EQ(Sources(all), std::set<std::string>{"option density"});

  EXPECT_EQ(read("gravity='disable'").model->mechanism.gravity_W, Vec3(0, 0, 0));
  const Read passive = read("passive='disable'");
  EXPECT_EQ(laws(passive), "friction ");
  EXPECT_TRUE(Sources(passive).empty());
  EXPECT_EQ(laws(read("spring='disable'")), "damping friction ");
  EXPECT_EQ(laws(read("damper='disable'")), "spring friction ");
  EXPECT_EQ(laws(read("spring='disable' damper='disable'")), "friction ");
  EXPECT_EQ(laws(read("frictionloss='disable'")), "damping spring ");
  EXPECT_EQ(loops(read("equality='disable'")), 0);
  const Read none = read("constraint='disable'");
  EXPECT_EQ(loops(none), 0);
  EXPECT_EQ(laws(none), "damping spring ");
  EXPECT_TRUE(std::isinf(read("limit='disable'").model->mechanism.joints[0].range[0].upper));
}

// MuJoCo 3 takes it from the body, and whether an actuator exerts it from the joint or its class.
TEST(ForeignMjcf, GravityCompensationIsTakenWithTheDrivesThatExertIt) {
  const auto drive_of = [](const std::string& joint) {
    return Arm({.head = "<default><default class='c'><joint actuatorgravcomp='true'/></default>"
                        "</default><size nuser_body='3'/>",
                .arm = "gravcomp='0.75' user='1 2 3'",
                .joint = joint,
                .in_world = "<body name='float' pos='3 0 0' gravcomp='-0.5'><joint/><inertial "
                            "pos='0 0 0' mass='1' diaginertia='1 1 1'/></body>",
                .tail = "<actuator><motor name='a' joint='A'/><motor name='b' joint='B'/>"
                        "</actuator>"});
  };
  for (const auto& [joint, exerts] : {std::pair("", false),
                                      {"class='c'", true},
                                      {"actuatorgravcomp='true'", true},
                                      {"class='c' actuatorgravcomp='false'", false}}) {
    const Read read = ReadText(drive_of(joint));
    ASSERT_TRUE(read.model) << read.diagnostics.Text();
    const Mechanism& m = read.model->mechanism;
    EXPECT_EQ(m.bodies[static_cast<size_t>(m.FindBody("upper"))].gravity_compensation, 0.75);
    EXPECT_EQ(m.bodies[static_cast<size_t>(m.FindBody("lower"))].gravity_compensation, 0.0);
    EXPECT_EQ(m.bodies[static_cast<size_t>(m.FindBody("float"))].gravity_compensation, -0.5);
    EXPECT_EQ(m.drives[0].compensates_gravity, exerts) << joint;
    EXPECT_FALSE(m.drives[1].compensates_gravity);
    EXPECT_TRUE(Sources(read).empty());
  }
}

// Not where passive forces are off, nor where no body's is positive.
TEST(ForeignMjcf, GravityCompensationOfNothingIsNone) {
  const Parts off{.head = "<option><flag passive='disable'/></option>", .arm = "gravcomp='1'"};
  for (const Parts& parts : {off, Parts{.arm = "gravcomp='-1'"}, Parts{.arm = "gravcomp='0'"}}) {
    const Read read = ReadText(Arm(parts));
    ASSERT_TRUE(read.model) << read.diagnostics.Text();
    EXPECT_FALSE(HasGravityCompensation(read.model->mechanism));
    EXPECT_TRUE(Sources(read).empty()) << read.diagnostics.Text();
  }
}

TEST(ForeignMjcf, AnInactiveEqualityClosesNothing) {
  const auto closures = [](const char* active) {
    const Read read = ReadText(Arm(
        {.tail = fmt::format("<equality><connect name='c' body1='upper' body2='lower' anchor='0 "
                             "0 0.4' active='{}'/><joint name='j' joint1='A' joint2='B' "
                             "polycoef='0 1 0 0 0' active='{}'/></equality>",
                             active, active)}));
    EXPECT_TRUE(read.model) << read.diagnostics.Text();
    const Mechanism& m = read.model->mechanism;
    return std::pair(std::ranges::count_if(m.joints, &Joint::closure), m.couplings.size());
  };
  EXPECT_EQ(closures("true"), (std::pair<std::ptrdiff_t, size_t>(1, 1)));
  EXPECT_EQ(closures("false"), (std::pair<std::ptrdiff_t, size_t>(0, 0)));
}

// Both ends of a range count from the file's reference; the margin is where its limit begins.
TEST(ForeignMjcf, ARangeCountsFromTheReferenceAndEndsAtItsMargin) {
  const auto range = [](const std::string& more) {
    const Read read = ReadText(Arm({.joint = "limited='true' range='-0.4 1.5' ref='0.3'" + more}));
    EXPECT_TRUE(read.model) << read.diagnostics.Text();
    return read.model->mechanism.joints[0].range[0];
  };
  EXPECT_NEAR(range("").lower, -0.7, 1e-15);
  EXPECT_NEAR(range("").upper, 1.2, 1e-15);
  EXPECT_NEAR(range(" margin='0.1'").lower, -0.6, 1e-15);
  EXPECT_NEAR(range(" margin='0.1'").upper, 1.1, 1e-15);
}

// As MuJoCo 3.14 reads ranges without room (lower ≥ upper): none where `limited` is auto or false,
// refused where it is true, but for a ball, which is then pushed back at any rotation.
TEST(ForeignMjcf, ARangeWithoutRoomIsNoneUnlessTheFileLimitsIt) {
  for (const char* range : {"0 0", "1 -1", "0 -1"}) {
    for (const char* limited : {"", "auto", "true", "false"}) {
      const bool holds = std::string_view(limited) == "true";
      const auto stated = [&](const char* prefix) {
        const std::string text = fmt::format(" {}range='{}'", prefix, range);
        return *limited == '\0' ? text : text + fmt::format(" {}limited='{}'", prefix, limited);
      };
      for (const char* type : {"hinge", "slide", "ball"}) {
        if (std::string_view(type) == "ball" && holds && *range == '1') continue;  // refused, too
        const Read read = ReadText(Arm({.joint = fmt::format("type='{}'", type) + stated("")}));
        const bool ball = std::string_view(type) == "ball";
        ASSERT_EQ(read.model.has_value(), !holds || ball)
            << type << range << limited << read.diagnostics.Text();
        if (!read.model) continue;
        const Joint& joint = read.model->mechanism.joints[0];
        EXPECT_TRUE(std::isinf(joint.range[0].upper) && std::isinf(joint.max_rotation));
        EXPECT_EQ(Sources(read).contains("limit without room range"), holds) << type << limited;
        EXPECT_EQ(read.diagnostics.Text().find("without `limited` hold"), std::string::npos);
      }
      for (const char* of : {"ctrl", "force", "actuatorfrc"}) {
        const bool on_joint = std::string_view(of) == "actuatorfrc";
        const Read read = ReadText(Arm({.joint = on_joint ? stated(of) : "",
                                        .tail = "<actuator><motor joint='A' gear='2'" +
                                                (on_joint ? "" : stated(of)) + "/></actuator>"}));
        ASSERT_EQ(read.model.has_value(), !holds)
            << of << range << limited << read.diagnostics.Text();
        if (!read.model) continue;
        ASSERT_EQ(read.model->mechanism.motors.size(), 1u) << of << range << limited;
        EXPECT_EQ(read.model->mechanism.motors[0].peak, Motor::kNoLimit);
      }
    }
  }
}

// Limits of a default class are the element's own: nothing is left open.
TEST(ForeignMjcf, LimitsThatAClassStatesAreStated) {
  const Read read = ReadText(
      Arm({.head = "<default><default class='c'><joint limited='true'/></default></default>",
           .joint = "class='c' range='-1 1'"}));
  ASSERT_TRUE(read.model) << read.diagnostics.Text();
  EXPECT_EQ(read.diagnostics.Text().find("without `limited`"), std::string::npos);
  EXPECT_NEAR(read.model->mechanism.joints[0].range[0].upper, 1.0, 1e-15);
}

// A frame is what stands in it, posed; written out by hand it is the same mechanism.
TEST(ForeignMjcf, FramesAreWhatStandsInThem) {
  const std::string in_frame = R"(<mujoco model="f"><compiler angle="degree"/>
<default><default class="heavy"><geom density="500" contype="0" conaffinity="0"/></default></default><worldbody>
<frame name="mount" pos="0 0 1" euler="90 0 0"><body name="a" pos="0 0.2 0" euler="0 0 90">
<frame pos="0.1 0 0" zaxis="0 1 0" childclass="heavy"><joint name="j" axis="0 0 1" pos="0.05 0 0"/>
<geom type="capsule" fromto="0 0 0 0 0 0.3" size="0.02"/><geom type="box" size="0.1 0.2 0.3" pos="0 0 1"/>
<frame axisangle="0 0 1 90"><site name="s" pos="0.3 0 0"/></frame></frame>
<body name="b"><joint name="k"/><frame quat="0 0 0 1"><inertial pos="0.1 0 0" mass="1" fullinertia="1 2 2.5 0.1 0.2 0.3"/></frame></body></body></frame></worldbody></mujoco>)";
  // zaxis="0 1 0" is a turn by -90° about x; then 90° about z.
  const std::string by_hand = R"(<mujoco model="f"><compiler angle="degree"/><worldbody>
<body name="mount" pos="0 0 1" euler="90 0 0"><body name="a" pos="0 0.2 0" euler="0 0 90">
<joint name="j" axis="0 1 0" pos="0.15 0 0"/>
<geom type="capsule" fromto="0.1 0 0 0.1 0.3 0" size="0.02" density="500" contype="0" conaffinity="0"/>
<geom type="box" size="0.1 0.2 0.3" pos="0.1 1 0" euler="-90 0 0" density="500" contype="0" conaffinity="0"/>
<site name="s" pos="0.1 0 -0.3"/>
<body name="b"><joint name="k"/><inertial pos="-0.1 0 0" mass="1" fullinertia="1 2 2.5 0.1 -0.2 -0.3"/></body></body></body></worldbody></mujoco>)";
  const Read framed = ReadText(in_frame), plain = ReadText(by_hand);
  ASSERT_TRUE(framed.model) << framed.diagnostics.Text();
  ASSERT_TRUE(plain.model) << plain.diagnostics.Text();
  EXPECT_TRUE(framed.model->left_out.empty()) << framed.diagnostics.Text();
  const Mechanism &m = framed.model->mechanism, &n = plain.model->mechanism;
  ASSERT_EQ(m.bodies.size() + 1, n.bodies.size());  // "mount" is a body by hand
  for (const char* name : {"a", "b"}) {
    const Body &x = m.bodies[m.FindBody(name)], &y = n.bodies[n.FindBody(name)];
    EXPECT_NEAR(x.mass, y.mass, 1e-12) << name;
    EXPECT_TRUE(x.p_BoBcm_B.isApprox(y.p_BoBcm_B, 1e-9)) << name;
    EXPECT_TRUE(x.I_Bcm_B.isApprox(y.I_Bcm_B, 1e-9)) << name << "\n"
                                                     << x.I_Bcm_B << "\n"
                                                     << y.I_Bcm_B;
  }
  const Joint &j = m.joints[m.FindJoint("j")], &h = n.joints[n.FindJoint("j")];
  EXPECT_TRUE(j.axis.isApprox(h.axis, 1e-9)) << j.axis.transpose();
  EXPECT_TRUE(j.X_CM.translation().isApprox(h.X_CM.translation(), 1e-9));
  const Pose X_mount = n.joints[n.FindJoint("mount_fixed")].X_PF;
  EXPECT_TRUE(j.X_PF.isApprox(X_mount * h.X_PF, 1e-9));
  EXPECT_TRUE(m.FindFrame(m.FindBody("a"), "s")
                  ->X_BF.translation()
                  .isApprox(n.FindFrame(n.FindBody("a"), "s")->X_BF.translation(), 1e-9));
}

// Three arms around a circle, with their drives and couplings.
TEST(ForeignMjcf, ReplicatesAreWrittenOutWithWhatRefersToThem) {
  const Read read = ReadText(R"(<mujoco model="r"><compiler angle="degree"/><worldbody>
<replicate count="3" euler="0 0 120" offset="0 0 0.1"><body name="arm" pos="1 0 0"><joint name="j" axis="0 1 0"/>
<inertial pos="0 0 0" mass="2" diaginertia="1 1 1"/></body></replicate></worldbody>
<actuator><motor name="m" joint="j"/></actuator>
<equality><joint name="e" joint1="j" polycoef="0 0 0 0 0" active="false"/></equality></mujoco>)");
  ASSERT_TRUE(read.model) << read.diagnostics.Text();
  EXPECT_TRUE(read.model->left_out.empty()) << read.diagnostics.Text();
  const Mechanism& m = read.model->mechanism;
  ASSERT_EQ(m.bodies.size(), 4u);
  ASSERT_EQ(m.drives.size(), 3u);
  double mass = 0.0;
  for (const Body& body : m.bodies) mass += body.mass;
  EXPECT_EQ(mass, 6.0);
  for (int i = 0; i < 3; ++i) {
    const double turn = i * 2.0 * std::numbers::pi / 3.0;
    const Joint& joint = m.joints[m.FindJoint(fmt::format("j{}", i))];
    const Vec3 place(std::cos(turn), std::sin(turn), 0.1 * i);
    EXPECT_TRUE(joint.X_PF.translation().isApprox(place, 1e-9)) << joint.X_PF.translation();
  }
}

// A hand in degrees, "zyx" and classes of its own, on an arm in radians with others.
const char* const kHand =
    R"(<mujoco model="hand"><compiler angle="degree" eulerseq="zyx" meshdir="meshes"/>
<option gravity="0 0 -5"/>
<default><geom density="500" contype="0" conaffinity="0"/><joint damping="0.2" range="-90 45"/>
<default class="finger"><joint damping="0.3" range="-30 60"/><general gear="3"/></default></default>
<asset><mesh file="tip.obj"/></asset>
<worldbody><body name="wrist" childclass="finger"><body name="palm" pos="0 0 0.1" euler="30 40 50">
<joint name="yaw" axis="0 0 1"/><geom type="box" size="0.1 0.2 0.3"/>
<body name="thumb" pos="0.1 0 0"><joint name="flex" class="main" ref="10"/><geom size="0.1"/><site name="pad" euler="0 90 90"/>
<geom type="mesh" mesh="tip" mass="0"/></body>
<body name="slider" pos="0 0 0.2"><joint name="out" type="slide" range="-0.1 0.2"/><geom size="0.1"/></body></body></body></worldbody>
<tendon><fixed name="sum"><joint joint="yaw" coef="1"/><joint joint="flex" coef="2"/></fixed></tendon>
<equality><joint name="gear" joint1="flex" joint2="yaw" polycoef="0 2 0 0 0"/><tendon name="held" tendon1="sum"/>
<connect name="outside" body1="palm" body2="wrist" anchor="0 0 0"/></equality>
<actuator><motor name="m" joint="out" class="finger"/></actuator>
<keyframe><key name="grip" qpos="0.1 0.2 0.15"/></keyframe></mujoco>)";

std::string WithHand(const std::string& attach) {
  return R"(<mujoco model="arm"><compiler angle="radian"/><default><geom density="7" contype="0" conaffinity="0"/>
<joint damping="9"/></default><asset><model file="hand.xml"/></asset><worldbody>
<body name="upper" euler="0.1 0.2 0.3"><joint name="A" axis="0 1 0" range="-1 1"/><geom size="0.1"/>
<frame pos="0 0 0.4" euler="0.5 0 0">)" +
         attach + R"(</frame></body></worldbody>
<actuator><motor name="a" joint="A"/><motor name="t" joint="l_yaw"/></actuator></mujoco>)";
}

// Joints without names get some for their keyframes, which nothing in either file has.
TEST(ForeignMjcf, JointsOfAttachedModelsGetNamesThatAreFree) {
  const test::TestFolder folder("attach_names");
  const std::string inertial = "<inertial pos='0 0 0' mass='1' diaginertia='1 1 1'/>";
  std::string bodies, numbers;
  for (int k = 0; k < 12; ++k) {
    bodies += fmt::format("<body name='b{}'><joint{}/>{}</body>", k,
                          k == 3 ? " name='joint1_'" : "", inertial);
    numbers += fmt::format(" {}", 0.01 * k);
  }
  folder.Write("hand.xml", fmt::format("<mujoco model='hand'><worldbody><body name='palm'>{}{}"
                                       "</body></worldbody><keyframe><key name='k' qpos='{}'/>"
                                       "</keyframe></mujoco>",
                                       inertial, bodies, numbers));
  const std::string arm = fmt::format(
      "<mujoco><compiler angle='radian'/><asset><model file='hand.xml'/></asset><worldbody><body "
      "name='arm'><joint name='joint2_7'/>{}<attach model='hand' body='palm' prefix=''/></body>"
      "</worldbody></mujoco>",
      inertial);
  Diagnostics said;
  const auto model = ReadMjcf(arm, folder.Write("arm.xml", arm), {}, &said);
  ASSERT_TRUE(model) << said.Text();
  const Mechanism& m = model->mechanism;
  for (int k = 0; k < 12; ++k) {
    const int body = m.FindBody(fmt::format("b{}", k));
    const auto joint = std::ranges::find(m.joints, body, &Joint::child);
    ASSERT_NE(joint, m.joints.end());
    EXPECT_NEAR(joint->home[0], 0.01 * k, 1e-12) << joint->name;
  }
}

// F = g f: limits of an actuator are those of a motor behind its gear, on either side.
TEST(ForeignMjcf, LimitsOfActuatorsAreMotors) {
  struct Case {
    std::string actuator, joint;
    double n, peak;  // no peak: no motor
  };
  const double none = Motor::kNoLimit;
  for (const Case& c : std::vector<Case>{
           {"<motor joint='A' gear='5' ctrllimited='true' ctrlrange='-2 2'/>", "", 5, 2},
           {"<motor joint='A' gear='-5' ctrlrange='-2 2'/>", "", 5, 2},
           {"<motor joint='A' gear='5' ctrllimited='false' ctrlrange='-2 2'/>", "", 5, none},
           {"<motor joint='A' ctrlrange='-2 2' forcerange='-1.5 1.5'/>", "", 1, 1.5},
           {"<general joint='A' gainprm='30' gear='2' ctrlrange='-2 2'/>", "", 2, 60},
           {"<general joint='A' gainprm='30' biastype='affine' biasprm='0 -30 0' ctrlrange='-2 2' "
            "forcerange='-7 7'/>",
            "", 1, 7},
           {"<position joint='A' kp='100' ctrlrange='-2 2'/>", "", 1, none},
           {"<position joint='A' kp='100' ctrlrange='-2 2' forcerange='-40 40'/>", "", 1, 40},
           {"<velocity joint='A' kv='10' forcerange='-4 4'/><position joint='A' kp='100' gear='3' "
            "forcerange='-2 2'/>",
            "", 1, 10},
           {"<motor joint='A' gear='5' ctrlrange='-2 2'/>", "actuatorfrcrange='-6 6'", 5, 1.2},
           {"<motor joint='A' gear='5'/>", "actuatorfrcrange='-6 6'", 5, 1.2},
           {"<motor joint='A'/>", "actuatorfrcrange='-6 6' actuatorfrclimited='false'", 1, none},
           {"<motor joint='A'/>", "class='c'", 1, 8},
           {"<motor joint='A'/>", "", 1, none}}) {
    const Read read = ReadText(
        Arm({.head = "<default><default class='c'><joint actuatorfrcrange='-8 8'/></default>"
                     "</default>",
             .joint = c.joint,
             .tail = "<actuator>" + c.actuator + "</actuator>"}));
    ASSERT_TRUE(read.model) << c.actuator << read.diagnostics.Text();
    const Mechanism& m = read.model->mechanism;
    ASSERT_EQ(m.drives.size(), 1u);
    const bool motor = std::isfinite(c.peak) || c.n != 1.0;
    ASSERT_EQ(m.motors.size(), motor ? 1u : 0u) << c.actuator << c.joint;
    if (!motor) continue;
    EXPECT_NEAR(m.motors[0].gear_ratio, c.n, 1e-15) << c.actuator;
    EXPECT_TRUE(m.motors[0].peak == c.peak || std::abs(m.motors[0].peak - c.peak) < 1e-12)
        << c.actuator;
    EXPECT_TRUE(m.motors[0].turns);
  }
}

// A fixed tendon whose joints follow one of them drives this one, by Σ c_i r_i of its gear.
TEST(ForeignMjcf, AnActuatorOfCoupledJointsDrivesTheOneThatTheyFollow) {
  const auto fingers = [](const std::string& coefficients, const std::string& equality) {
    return ReadText(
        "<mujoco><worldbody><body><joint name='A' axis='0 0 1'/><inertial pos='0 0 0' mass='1' "
        "diaginertia='1 1 1'/></body><body><joint name='B' axis='0 0 1'/><inertial pos='0 0 0' "
        "mass='1' diaginertia='1 1 1'/></body></worldbody><tendon><fixed name='both'>" +
        coefficients + "</fixed></tendon><equality>" + equality +
        "</equality><actuator><motor name='grip' tendon='both' gear='4' forcerange='-2 2'/>"
        "</actuator></mujoco>");
  };
  const std::string both = "<joint joint='A' coef='0.5'/><joint joint='B' coef='0.25'/>";
  const std::string follows = "<joint joint1='A' joint2='B' polycoef='0.1 -2 0 0 0'/>";
  for (const auto& [coefficients, equality, drive, gear] :
       {std::tuple(both, follows, "B", 3.0),
        {"<joint joint='A' coef='0.5'/>", "", "A", 2.0},
        {both, "", "", 0.0},
        {both, "<joint joint1='A' joint2='B' polycoef='0 -2 1 0 0'/>", "", 0.0},
        {both, "<joint joint1='A' joint2='B' polycoef='0 -0.5 0 0 0'/>", "", 0.0},
        {both, "<joint joint1='A' joint2='B' polycoef='0 -2 0 0 0' active='false'/>", "", 0.0},
        {both, follows + "<joint joint1='B' joint2='A' polycoef='0 1 0 0 0'/>", "", 0.0}}) {
    const Read read = fingers(coefficients, equality);
    ASSERT_TRUE(read.model) << read.diagnostics.Text();
    const Mechanism& m = read.model->mechanism;
    const std::string what = std::string(coefficients) + std::string(equality);
    ASSERT_EQ(m.drives.size(), *drive == '\0' ? 0u : 1u) << what;
    EXPECT_EQ(read.model->left_out.size(), 1u - m.drives.size()) << what;
    if (m.drives.empty()) continue;
    const auto* on = std::get_if<JointDrive>(&m.drives[0].kind);
    ASSERT_NE(on, nullptr);
    EXPECT_EQ(m.joints[static_cast<size_t>(on->joint)].name, drive) << what;
    ASSERT_EQ(m.motors.size(), 1u);
    EXPECT_EQ(m.motors[0].gear_ratio, gear) << what;
    EXPECT_EQ(m.motors[0].peak, 2.0) << what;
  }
}

// A side on which the actuators push less, or not at all, keeps it; a gear below 0 turns sides
// round.
TEST(ForeignMjcf, LimitsOfOneSideAreThatSides) {
  struct Case {
    std::string actuators, joint;
    double n, least, most;
  };
  const double none = Motor::kNoLimit;
  for (const Case& c : std::vector<Case>{
           {"<motor joint='A' ctrllimited='true' ctrlrange='-2 1'/>", "", 1, -2, 1},
           {"<motor joint='A' ctrlrange='0 100'/>", "", 1, 0, 100},
           {"<motor joint='A' gear='-4' ctrlrange='0 100'/>", "", 4, -100, 0},
           {"<motor joint='A' gear='4' ctrlrange='-1 1' forcerange='-0.5 3'/>", "", 4, -0.5, 1},
           {"<position joint='A' kp='100' forcerange='0 30'/>", "", 1, 0, 30},
           {"<motor joint='A' gear='2' ctrlrange='0 3'/>", "actuatorfrcrange='-1 4'", 2, 0, 2},
           {"<motor joint='A' ctrlrange='0 3'/><motor joint='A' gear='-1' ctrlrange='0 5'/>", "", 1,
            -5, 3},
           {"<motor joint='A'/><motor joint='A' gear='-1' ctrlrange='0 5'/>", "", 1, -none, none},
           {"<motor joint='A' ctrlrange='5 9'/>", "", 1, 5, 9}}) {
    const Read read =
        ReadText(Arm({.joint = c.joint, .tail = "<actuator>" + c.actuators + "</actuator>"}));
    ASSERT_TRUE(read.model) << c.actuators << read.diagnostics.Text();
    const Mechanism& m = read.model->mechanism;
    const bool limited = std::isfinite(c.least) || std::isfinite(c.most);
    ASSERT_EQ(m.motors.size(), limited ? 1u : 0u) << c.actuators;
    if (!limited) continue;
    EXPECT_EQ(m.motors[0].peak, none);
    EXPECT_DOUBLE_EQ(m.motors[0].gear_ratio, c.n) << c.actuators;
    EXPECT_DOUBLE_EQ(m.motors[0].least, c.least) << c.actuators;
    EXPECT_DOUBLE_EQ(m.motors[0].most, c.most) << c.actuators;
  }
}

// What is attached is what MuJoCo 3 makes of it, here written by hand.
TEST(ForeignMjcf, AttachedModelsKeepTheirClassesUnitsAndKeyframes) {
  const std::string by_hand = R"(<mujoco model="arm"><compiler angle="radian"/><worldbody>
<body name="upper" euler="0.1 0.2 0.3"><joint name="A" axis="0 1 0" limited="true" range="-1 1" damping="9"/>
<geom size="0.1" density="7" contype="0" conaffinity="0"/><body name="turned" pos="0 0 0.4" euler="0.5 0 0">
<body name="first" pos="0 0 0.1" axisangle="0 0 1 0.5235987755982988"><body name="second" axisangle="0 1 0 0.6981317007977318">
<body name="l_palm" axisangle="1 0 0 0.8726646259971648"><joint name="l_yaw" axis="0 0 1" damping="0.3" limited="true"
 range="-0.5235987755982988 1.0471975511965976"/><geom type="box" size="0.1 0.2 0.3" density="500" contype="0" conaffinity="0"/>
<body name="l_thumb" pos="0.1 0 0"><joint name="l_flex" damping="0.2" limited="true" ref="0.17453292519943295"
 range="-1.5707963267948966 0.7853981633974483"/><geom size="0.1" density="500" contype="0" conaffinity="0"/>
<body name="padded" axisangle="0 1 0 1.5707963267948966"><site name="l_pad" axisangle="1 0 0 1.5707963267948966"/></body></body>
<body name="l_slider" pos="0 0 0.2"><joint name="l_out" type="slide" damping="0.3" limited="true" range="-0.1 0.2"/>
<geom size="0.1" density="500" contype="0" conaffinity="0"/></body></body></body></body></body></body></worldbody></mujoco>)";
  const test::TestFolder folder("attach");
  folder.Write("hand.xml", kHand);
  folder.Write("meshes/tip.obj",
               "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 1 4 3\n");
  const auto read_in = [&](const std::string& text) {
    Read read;
    read.model = ReadMjcf(text, folder.Write("arm.xml", text), {}, &read.diagnostics);
    return read;
  };
  const Read attached = read_in(WithHand("<attach model='hand' body='palm' prefix='l_'/>"));
  const Read plain = ReadText(by_hand);
  const std::string said = attached.diagnostics.Text();
  ASSERT_TRUE(attached.model) << said;
  ASSERT_TRUE(plain.model) << plain.diagnostics.Text();
  const Mechanism &m = attached.model->mechanism, &n = plain.model->mechanism;
  for (const char* name : {"upper", "l_palm", "l_thumb", "l_slider"}) {
    const Body &x = m.bodies[m.FindBody(name)], &y = n.bodies[n.FindBody(name)];
    EXPECT_NEAR(x.mass, y.mass, 1e-12) << name;
    EXPECT_TRUE(x.I_Bcm_B.isApprox(y.I_Bcm_B, 1e-9)) << name;
  }
  const Pose X_palm =
      n.joints[n.FindJoint("turned_fixed")].X_PF * n.joints[n.FindJoint("first_fixed")].X_PF *
      n.joints[n.FindJoint("second_fixed")].X_PF * n.joints[n.FindJoint("l_yaw")].X_PF;
  EXPECT_TRUE(m.joints[m.FindJoint("l_yaw")].X_PF.isApprox(X_palm, 1e-9));
  for (const char* name : {"A", "l_yaw", "l_flex", "l_out"}) {
    const Joint &x = m.joints[m.FindJoint(name)], &y = n.joints[n.FindJoint(name)];
    EXPECT_NEAR(x.range[0].lower, y.range[0].lower, 1e-12) << name;
    EXPECT_NEAR(x.range[0].upper, y.range[0].upper, 1e-12) << name;
    const std::string element = std::string(name) + "_damping";
    const auto damping = [&](const Mechanism& of) {
      for (const ForceElement& e : of.elements) {
        if (e.name == element) return std::get<DampingLaw>(e.law).damping;
      }
      return -1.0;
    };
    EXPECT_EQ(damping(m), damping(n)) << name;
  }
  const Pose X_pad =
      n.joints[n.FindJoint("padded_fixed")].X_PF * n.FindFrame(n.FindBody("padded"), "l_pad")->X_BF;
  EXPECT_TRUE(m.FindFrame(m.FindBody("l_thumb"), "l_pad")->X_BF.isApprox(X_pad, 1e-9));
  // What refers to the hand alone comes with it; keyframes count from the hand's joints.
  EXPECT_EQ(m.couplings.size(), 2u);
  EXPECT_EQ(std::ranges::count_if(m.joints, &Joint::closure), 0);
  ASSERT_EQ(m.drives.size(), 3u);
  EXPECT_NEAR(m.joints[m.FindJoint("l_yaw")].home[0], 0.1, 1e-12);
  EXPECT_NEAR(m.joints[m.FindJoint("l_flex")].home[0], 0.2 - std::numbers::pi / 18.0, 1e-12);
  EXPECT_NEAR(m.joints[m.FindJoint("l_out")].home[0], 0.15, 1e-12);
  EXPECT_NE(said.find("keyframe 'l_grip'"), std::string::npos) << said;
  EXPECT_NE(said.find("<connect> 'outside' is not attached"), std::string::npos) << said;
  EXPECT_NE(said.find("gravity = '0 0 -5' of the attached model is not taken"), std::string::npos);
  const auto& shapes = m.bodies[m.FindBody("l_thumb")].shapes;
  EXPECT_TRUE(std::ranges::any_of(shapes, [](const Shape& shape) {
    const auto* mesh = std::get_if<Mesh>(&shape.geometry);
    return mesh != nullptr && mesh->file.ends_with("meshes/tip.obj");
  }));

  // Twice, whole, and the model's own body once more.
  const Read twice =
      read_in(WithHand("<attach model='hand' body='thumb' prefix='l_'/><attach model='hand' "
                       "body='thumb' prefix='r_'/>"));
  EXPECT_FALSE(twice.model);  // 'l_yaw' of the drive is not there
  const Read whole =
      read_in(WithHand("<attach model='hand' prefix='l_'/><attach model='hand' prefix='r_'/>"));
  ASSERT_TRUE(whole.model) << whole.diagnostics.Text();
  EXPECT_EQ(whole.model->mechanism.couplings.size(), 4u);
  EXPECT_EQ(std::ranges::count_if(whole.model->mechanism.joints, &Joint::closure), 2);
  const Read own =
      read_in(WithHand("<attach model='hand' body='palm' prefix='l_'/><body name='o'><attach "
                       "body='l_palm' prefix='2'/></body>"));
  ASSERT_TRUE(own.model) << own.diagnostics.Text();
  EXPECT_EQ(own.model->mechanism.bodies[own.model->mechanism.FindBody("2l_palm")].mass,
            m.bodies[m.FindBody("l_palm")].mass);
  EXPECT_EQ(own.model->mechanism.couplings.size(), 4u);
  EXPECT_EQ(own.model->mechanism.drives.size(), 5u);

  // Models that multiply.
  for (int i = 0; i < 8; ++i) {
    const std::string next = fmt::format("m{}", i + 1);
    std::string ten;
    for (int k = 0; k < 10; ++k) ten += fmt::format("<attach model='{}' prefix='{}'/>", next, k);
    folder.Write(fmt::format("m{}.xml", i), "<mujoco><asset><model name='" + next + "' file='" +
                                                next + ".xml'/></asset><worldbody>" + ten +
                                                "</worldbody></mujoco>");
  }
  folder.Write("m8.xml", "<mujoco><worldbody><body><joint/></body></worldbody></mujoco>");
  // What cannot be expanded is an error at its place.
  folder.Write("loop.xml",
               "<mujoco><asset><model name='me' file='loop.xml'/></asset><worldbody>"
               "<attach model='me' prefix='x'/></worldbody></mujoco>");
  folder.Write("bound.xml", "<mujoco><compiler boundmass='0.1'/><worldbody/></mujoco>");
  folder.Write("keys.xml",
               "<mujoco><worldbody><body name='b'><joint/></body></worldbody>\n"
               "<keyframe><key name='k' qpos='1 2'/></keyframe></mujoco>");
  folder.Write("broken.xml", "<mujoco>\n<worldbody></mujoco>");
  for (const auto& [attach, expected] : std::vector<std::pair<std::string, std::string>>{
           {"model='hant' prefix='l'", "arm.xml:4:1: error: <attach> model 'hant': no <model>"},
           {"model='hant' prefix='l'", "did you mean 'hand'?"},
           {"model='hand' body='pal' prefix='l'", "the attached model has no such body"},
           {"model='hand' frame='pal' prefix='l'", "the attached model has no such frame"},
           {"model='hand' body='palm' frame='f' prefix='l'", "names both a body and a frame"},
           {"model='hand' body='palm'", "arm.xml:4:1: error: <attach> has no prefix"},
           {"prefix='l'", "names neither body nor frame"},
           {"body='upp' prefix='l'", "the model has no such body"},
           {"model='gone' prefix='l'", "file 'gone.xml' cannot be read"},
           {"model='out' prefix='l'", "file '../out.xml' cannot be read"},
           {"model='bound' prefix='l'", "compiled with boundmass = '0.1', the model with '0'"},
           {"model='keys' prefix='l'",
            "keys.xml:2:1: error: keyframe 'k' has 2 numbers in qpos, the model 1"},
           {"model='broken' prefix='l'", "broken.xml:2:1: error: the file is not well-formed"},
           {"model='m0' prefix='l'", "m4.xml:1:1: error: <attach> makes more than 20000 elements"},
           {"model='loop' prefix='l'",
            "loop.xml:1:1: error: <attach> model 'me': file 'loop.xml' "
            "attaches itself"}}) {
    std::string text = WithHand("<attach " + attach + "/>");
    std::string assets;
    for (const char* name : {"gone", "bound", "keys", "broken", "loop", "m0", "../out"}) {
      assets += fmt::format("<model name='{}' file='{}.xml'/>",
                            std::filesystem::path(name).stem().string(), name);
    }
    text.insert(text.find("<model "), assets);
    const Read read = read_in(text);
    EXPECT_FALSE(read.model) << attach;
    EXPECT_NE(read.diagnostics.Text().find(expected), std::string::npos) << attach << "\n"
                                                                         << read.diagnostics.Text();
  }
}

// Options of the whole hold; where they are merged, what only the attached model states is taken.
// MuJoCo 2.2's own principal axes are right to six digits.
TEST(ForeignMjcf, AFullTensorIsTakenAsItStands) {
  const Read read = ReadText(
      "<mujoco><worldbody><body name='rod'><joint/><inertial pos='0.1 0 0' mass='1.3' fullinertia="
      "'0.000932 0.016409 0.016501 0.00061 0.000102 9e-06'/></body></worldbody></mujoco>");
  ASSERT_TRUE(read.model) << read.diagnostics.Text();
  const Mechanism& m = read.model->mechanism;
  Mat3 expected;
  expected << 0.000932, 0.00061, 0.000102, 0.00061, 0.016409, 9e-06, 0.000102, 9e-06, 0.016501;
  const Mat3 off = m.bodies[m.FindBody("rod")].I_Bcm_B - expected;
  EXPECT_LT(off.cwiseAbs().maxCoeff(), 1e-16);
}

// As MuJoCo 3 has it: each model keeps its own class of a name.
TEST(ForeignMjcf, AttachedModelsMayHaveClassesOfTheSameNameAndLieInOpenFolders) {
  const auto arm = [](double damping, const std::string& inside) {
    return fmt::format(
        "<mujoco model='m{0}'><default><default class='link'><joint damping='{0}'/></default>"
        "</default>{1}<worldbody><body name='b{0}'><joint name='j{0}' class='link' axis='0 1 0'/>"
        "<geom size='0.1'/>{2}</body></worldbody></mujoco>",
        damping,
        inside.empty() ? "" : "<asset><model name='part' file='../parts/part.xml'/></asset>",
        inside);
  };
  const test::TestFolder folder("attach_open");
  folder.Write("parts/part.xml", arm(0.25, ""));
  const std::string text =
      arm(0.5,
          "<attach model='part' prefix=''/><frame pos='1 0 0'><attach model='part' body='b0.25' "
          "prefix='again_'/></frame>");
  const std::string file = folder.Write("whole/whole.xml", text);
  const auto read_it = [&] {
    Read read;
    read.model = ReadMjcf(text, file, {}, &read.diagnostics);
    return read;
  };
  const Read closed = read_it();
  EXPECT_FALSE(closed.model);
  EXPECT_NE(closed.diagnostics.Text().find("--package NAME=DIR"), std::string::npos);
  UseMeshPackages({{"parts", folder.PathOf("parts")}});
  const Read open = read_it();
  UseMeshPackages({});
  ASSERT_TRUE(open.model) << open.diagnostics.Text();
  std::map<std::string, double> dampings;
  for (const auto& element : open.model->mechanism.elements) {
    dampings[element.name] = std::get<DampingLaw>(element.law).damping;
  }
  const std::map<std::string, double> expected = {
      {"j0.5_damping", 0.5}, {"j0.25_damping", 0.25}, {"again_j0.25_damping", 0.25}};
  EXPECT_EQ(dampings, expected);
}

TEST(ForeignMjcf, OptionsOfAttachedModelsAreMergedWhereTheModelSaysSo) {
  const test::TestFolder folder("merge");
  folder.Write("hand.xml",
               "<mujoco model='hand'><option gravity='0 0 -5'><flag damper='disable'/></option>"
               "<worldbody><body name='b'><joint damping='1'/><geom size='1'/></body></worldbody>"
               "</mujoco>");
  const auto gravity = [&](const std::string& compiler, const std::string& option) {
    const std::string text = "<mujoco><compiler " + compiler + "/>" + option +
                             "<asset><model file='hand.xml'/></asset><worldbody>"
                             "<attach model='hand' prefix=''/></worldbody></mujoco>";
    Diagnostics diagnostics;
    const auto model = ReadMjcf(text, folder.Write("arm.xml", text), {}, &diagnostics);
    return model ? std::pair(model->mechanism.gravity_W.z(), model->mechanism.elements.size())
                 : std::pair(0.0, size_t{0});
  };
  EXPECT_EQ(gravity("", ""), std::pair(-9.81, size_t{1}));
  EXPECT_EQ(gravity("conflict='merge'", ""), std::pair(-5.0, size_t{0}));
  EXPECT_EQ(gravity("", "<option gravity='0 0 -1'/>"), std::pair(-1.0, size_t{1}));
  EXPECT_EQ(gravity("conflict='error'", "<option gravity='0 0 -5'/>"), std::pair(-5.0, size_t{1}));
  EXPECT_EQ(gravity("conflict='error'", "<option gravity='0 0 -1'/>"), std::pair(0.0, size_t{0}));
}

TEST(ForeignMjcf, PairsOfBodiesOfASceneElsewhereAreNotNeeded) {
  const auto excluding = [](const std::string& body) {
    return ReadText(Arm({.tail = "<contact><exclude body1='upper' body2='" + body +
                                 "'/><exclude body1='upper' body2='lower'/></contact>"}));
  };
  for (const char* body : {"terrain", "world", "lower"}) {
    const Read read = excluding(body);
    EXPECT_TRUE(read.model) << body << read.diagnostics.Text();
    EXPECT_TRUE(Sources(read).empty()) << body;
  }
}

TEST(ForeignMjcf, BodiesThatNestTooDeeplyAreNamedSo) {
  std::string deep = "<mujoco><worldbody>";
  for (int i = 0; i < 150; ++i) deep += "<body>";
  const Read read = ReadText(deep);
  EXPECT_FALSE(read.model);
  const std::string text = read.diagnostics.Text();
  EXPECT_NE(text.find("arm.xml:1:1: error: elements are nested deeper than"), std::string::npos)
      << text;
  EXPECT_NE(text.find("hint:"), std::string::npos) << text;
  EXPECT_EQ(text.find("XML_"), std::string::npos) << text;
}

// As files of MuJoCo 3 say them; MuJoCo 2.2 wants to be reported that ranges hold.
TEST(ForeignMjcf, RangesOfActuatorsHoldOfThemselves) {
  const Read read = ReadText(Arm({.tail = "<actuator><motor name='m' joint='A' ctrlrange='-1 1' "
                                          "forcerange='-2 2'/></actuator>"}));
  EXPECT_TRUE(read.model) << read.diagnostics.Text();
  EXPECT_TRUE(Sources(read).empty());
}

// MuJoCo's reader takes 96 nested bodies; the limit is its own, not an estimate.
// Free joints inside a tree are not cut.
TEST(ForeignMjcf, AChainThatIsTooDeepForMujocoIsNamedSo) {
  const auto chain = [](int bodies, const std::string& kind) {
    std::string text = "name: chain\nbodies:\n", joints = "joints:\n";
    for (int i = 0; i < bodies; ++i) {
      text +=
          fmt::format("  b{}: {{mass: 1, inertia: [1, 1, 1], frames: {{end: [0.1, 0, 0]}}}}\n", i);
      joints += fmt::format("  j{}: {{kind: {}, parent: {}, child: b{}}}\n", i, kind,
                            i == 0 ? "world" : fmt::format("b{}.end", i - 1), i);
    }
    LoadResult loaded = LoadModelText(text + joints, "chain.yaml");
    EXPECT_TRUE(loaded.mechanism) << loaded.diagnostics.Text();
    return *std::move(loaded.mechanism);
  };
  std::vector<std::string> warnings;
  const simulation::EngineSession session(&warnings);
  for (const auto& [bodies, kind] :
       {std::pair(96, "free"), std::pair(97, "free"), std::pair(97, "revolute, axis: y")}) {
    const Mechanism m = chain(bodies, kind);
    simulation::EngineModel engine;
    const std::string text = WriteMjcf(m, {.pictures = false});
    const RunSummary made = simulation::MakeEngineModel(m, text, &engine);
    if (bodies == 96 || kind != std::string("free")) {
      EXPECT_TRUE(made.ok()) << made.message;
    } else {
      EXPECT_EQ(made.stop, Stop::kUnsupported);
      EXPECT_NE(made.message.find("a chain of 97 bodies is too deep for MJCF"), std::string::npos)
          << made.message;
      EXPECT_THROW((void)simulation::CompileMjcf(text), simulation::EngineError);
    }
  }
}

// What is left out stays known in the model that is written.
TEST(ForeignMjcf, WordsOfNewerVersionsAreTranslatedOrLeftOutWhereNoForceDependsOnThem) {
  const Mechanism plain = ReadText(Arm()).model->mechanism;
  const std::pair<const char*, const char*> cases[] = {
      {"<option integrator='implicitfast'/>", "integrator 'implicitfast' is read as 'implicit'"},
      {"<option cone='of_tomorrow'/>", "cone 'of_tomorrow' of <option> is unknown"}};
  for (const auto& [head, finding] : cases) {
    const Read read = ReadText(Arm({.head = head}));
    ASSERT_TRUE(read.model) << read.diagnostics.Text();
    EXPECT_NE(read.diagnostics.Text().find(finding), std::string::npos) << read.diagnostics.Text();
    EXPECT_TRUE(Sources(read).empty());
    EXPECT_EQ(read.model->mechanism.bodies.size(), plain.bodies.size());
  }
  const Read filter = ReadText(Arm({.tail = "<actuator><general joint='A' dyntype='filterexact' "
                                            "dynprm='0.1'/></actuator>"}));
  ASSERT_TRUE(filter.model) << filter.diagnostics.Text();
  EXPECT_EQ(filter.model->mechanism.drives.size(), 1U);
  // A joint of an unknown type is no matter of taste.
  EXPECT_FALSE(ReadText(Arm({.joint = "type='of_tomorrow'"})).model);
}

// Terrain touches only: its file may be absent.
TEST(ForeignMjcf, TerrainNeedsNoFile) {
  for (const char* field :
       {"file='hills.png'", "name='hills' file='x/absent.png'", "name='hills' nrow='3' ncol='4'",
        "name='hills' nrow='2' ncol='3' elevation='0 1 0 1 0 1'"}) {
    const Read read =
        ReadText(Arm({.head = fmt::format("<asset><hfield size='5 4 0.2 0.1' {}/></asset>", field),
                      .tail = "<worldbody><geom type='hfield' hfield='hills'/></worldbody>"}));
    EXPECT_TRUE(read.model) << field << read.diagnostics.Text();
  }
  EXPECT_FALSE(
      ReadText(Arm({.tail = "<worldbody><geom type='hfield' hfield='hills'/></worldbody>"})).model);
}

// Three slides and a ball carry a robot as a free joint does: held, or let go as one.
TEST(ForeignMjcf, ABaseOnThreeSlidesAndABallFloats) {
  struct Base {
    std::string place = "", slide = "", joint = "", tail = "";
  };
  const auto text = [](const Base& base) {
    return fmt::format(
        R"(<mujoco><compiler angle="radian"/><worldbody><body name="pelvis" pos="0 0 1" {}>)"
        R"(<joint name="px" type="slide" axis="1 0 0" {}/><joint type="slide" axis="0 1 0"/>)"
        R"(<joint type="slide" axis="0 0 1" ref="1"/><joint type="ball" {}/>)"
        R"(<inertial pos="0 0 0" mass="10" diaginertia="0.1 0.1 0.1"/>)"
        R"(<body name="leg"><joint name="hip" axis="0 1 0"/>)"
        R"(<inertial pos="0 0 -0.2" mass="1" diaginertia="0.01 0.01 0.001"/></body>)"
        R"(<body name="arm"><joint axis="1 0 0"/>)"
        R"(<inertial pos="0 0 -0.2" mass="1" diaginertia="0.01 0.01 0.001"/></body>)"
        R"(</body></worldbody>{}</mujoco>)",
        base.place, base.slide, base.joint, base.tail);
  };
  const Read held = ReadText(text({}));
  ASSERT_TRUE(held.model) << held.diagnostics.Text();
  ASSERT_EQ(held.model->mechanism.joints.size(), 3U);
  EXPECT_EQ(held.model->mechanism.joints[0].kind, JointKind::kFixed);
  EXPECT_EQ(held.model->mechanism.joints[2].name, "joint_5");  // MuJoCo's number of the file
  EXPECT_NE(held.diagnostics.Text().find("three slides and a ball of 'pelvis' are read as one"),
            std::string::npos);
  EXPECT_TRUE(Sources(held).contains("body/freejoint"));
  const std::string key = "<keyframe><key qpos='0 0 {} 1 0 0 0 0.1 0'/></keyframe>";
  EXPECT_EQ(
      ReadText(text({.tail = fmt::format(fmt::runtime(key), 1)})).model->mechanism.joints.size(),
      3U);
  // What acts along one of them, or names it, keeps them.
  const Base kept[] = {{.slide = "damping='1'"},
                       {.slide = "armature='0.1'"},
                       {.slide = "stiffness='1'"},
                       {.slide = "frictionloss='1'"},
                       {.slide = "limited='true' range='-1 1'"},
                       {.joint = "damping='1'"},
                       {.joint = "pos='0 0 0.1'"},
                       {.tail = "<actuator><motor joint='px'/></actuator>"},
                       {.place = "euler='0 0 1'", .tail = fmt::format(fmt::runtime(key), 1)}};
  for (const Base& base : kept) {
    const Read read = ReadText(text(base));
    ASSERT_TRUE(read.model) << read.diagnostics.Text();
    EXPECT_EQ(read.model->mechanism.joints.size(), 6U)
        << base.place << base.slide << base.joint << base.tail;
  }
}

TEST(ForeignMjcf, AModelFileSaysWhatItsSourceLeftOut) {
  const Read read = ReadText(Arm({.head = "<option density='1.2'/>"}));
  ASSERT_TRUE(read.model) << read.diagnostics.Text();
  const std::string text = WriteModel(read.model->mechanism, read.model->left_out);
  const LoadResult loaded = LoadModelText(text, "m.yaml");
  ASSERT_TRUE(loaded.mechanism) << loaded.diagnostics.Text();
  ASSERT_EQ(loaded.caveats.size(), 1u);
  EXPECT_EQ(loaded.caveats[0].kind, ModelCaveat::Kind::kLeftOut);
  EXPECT_EQ(loaded.caveats[0].text, read.model->left_out[0].text);
  EXPECT_NE(loaded.diagnostics.Text().find("left_out: the fluid's density 1.2 is left out"),
            std::string::npos)
      << loaded.diagnostics.Text();
  EXPECT_TRUE(LoadModelText(WriteModel(read.model->mechanism), "m.yaml").caveats.empty());
}

}  // namespace
}  // namespace mbv
