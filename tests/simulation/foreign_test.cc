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
#include "model_file/write_model.h"
#include "simulation/engine/engine_model.h"
#include "simulation/import/read_mjcf.h"
#include "simulation/mjcf/foreign_rows.h"
#include "simulation/mjcf/mjcf.h"

namespace mbv {
namespace {

using mjcf::Fate;
using mjcf::ForeignRow;

// An arm of two bodies on hinges and one on a ball. Each part of the file takes more text.
struct Parts {
  std::string head = {}, arm = {}, joint = {}, in_arm = {}, in_world = {}, ball = {}, tail = {};
};
std::string Arm(const Parts& p = {}) {
  return R"(<mujoco model="arm"><compiler angle="radian"/>)" + p.head + "<worldbody>" + p.in_world +
         R"(<body name="upper" )" + p.arm + R"(><joint name="A" axis="0 1 0" )" + p.joint +
         R"(/><inertial pos="0 0 0.2" mass="2" diaginertia="0.02 0.02 0.001"/>)" + p.in_arm +
         R"(<body name="lower" pos="0 0 0.4"><joint name="B" axis="0 1 0"/>)"
         R"(<inertial pos="0 0 0.1" mass="1" diaginertia="0.01 0.01 0.001"/>)" +
         R"(<site name="tip" pos="0 0 0.2"/></body></body>)" +
         R"(<body name="bob" pos="1 0 0"><joint name="S" type="ball" )" + p.ball +
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
  read.model = ReadMjcf(text, "arm.xml", "", &read.diagnostics);
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
  const auto ball = [](const std::string& with) { return Arm({.ball = with}); };
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
  // A floating body that a closure carries.
  const auto carried = [](const std::string& with) {
    return Arm({.in_world = "<body name='loose' pos='5 0 0'><joint type='free' " + with +
                            "/><inertial pos='0 0 0' mass='1' diaginertia='1 1 1'/></body>",
                .tail = "<equality><weld body1='upper' body2='loose'/></equality>"});
  };
  std::map<std::string, Sample> samples = {
      {"option density", {option("density='1.2'"), option("density='0'")}},
      {"option viscosity", {option("viscosity='1e-3'"), option("viscosity='0'")}},
      {"option wind", {option("density='1.2' wind='1 0 0'"), option("wind='1 0 0'")}},
      {"asset/mesh inertia", {of_mesh("inertia='shell'"), of_mesh("inertia='legacy'")}},
      {"body gravcomp", {Arm({.arm = "gravcomp='1'"}), Arm({.arm = "gravcomp='0.0'"})}},
      {"ball stiffness", {ball("stiffness='3'"), ball("stiffness='0'")}},
      {"ball damping", {ball("damping='3'"), ball("damping='0'")}},
      {"ball frictionloss", {ball("frictionloss='3'"), ball("frictionloss='0'")}},
      {"ball armature", {ball("armature='3'"), ball("armature='0'")}},
      {"ball range", {ball("limited='true' range='0 1'"), ball("limited='false' range='0 1'")}},
      {"free armature", {carried("armature='3'"), carried("armature='0'")}},
      {"free frictionloss", {carried("frictionloss='3'"), carried("frictionloss='0'")}},
      {"free damping", {carried("damping='3'"), carried("damping='0'")}},
      {"free stiffness", {carried("stiffness='3'"), carried("stiffness='0'")}},
      {"hinge or slide damping", {joint("damping='-0.1'"), joint("damping='0.1'")}},
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
      Arm({.tail = fmt::format(fmt::runtime(fixed), "") +
                   "<actuator><motor name='m' tendon='t'/></actuator>"}),
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

TEST(ForeignMjcf, GravityCompensationOfNothingIsNone) {
  for (const char* off : {"<option gravity='0 0 0'/>", "<option><flag gravity='disable'/></option>",
                          "<option><flag passive='disable'/></option>"}) {
    const Read read = ReadText(Arm({.head = off, .arm = "gravcomp='1'"}));
    EXPECT_TRUE(Sources(read).empty()) << off << read.diagnostics.Text();
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

TEST(ForeignMjcf, BodiesOfOtherModelsAreNotLostInSilence) {
  const Read read = ReadText(Arm({.head = "<asset><model name='hand' file='hand.xml'/></asset>",
                                  .in_arm = "<attach model='hand' body='palm' prefix='h'/>"}));
  EXPECT_FALSE(read.model);
  EXPECT_NE(
      read.diagnostics.Text().find("<attach> (1: upper) is not read: bodies of another model"),
      std::string::npos)
      << read.diagnostics.Text();
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
TEST(ForeignMjcf, AChainThatIsTooDeepForMujocoIsNamedSo) {
  const auto chain = [](int bodies) {
    std::string text = "name: chain\nbodies:\n", joints = "joints:\n";
    for (int i = 0; i < bodies; ++i) {
      text +=
          fmt::format("  b{}: {{mass: 1, inertia: [1, 1, 1], frames: {{end: [0.1, 0, 0]}}}}\n", i);
      joints += fmt::format("  j{}: {{kind: revolute, parent: {}, child: b{}, axis: y}}\n", i,
                            i == 0 ? "world" : fmt::format("b{}.end", i - 1), i);
    }
    LoadResult loaded = LoadModelText(text + joints, "chain.yaml");
    EXPECT_TRUE(loaded.mechanism) << loaded.diagnostics.Text();
    return *std::move(loaded.mechanism);
  };
  std::vector<std::string> warnings;
  const simulation::EngineSession session(&warnings);
  for (const int bodies : {96, 97}) {
    const Mechanism m = chain(bodies);
    simulation::EngineModel engine;
    const std::string text = WriteMjcf(m, {.pictures = false});
    const RunSummary made = simulation::MakeEngineModel(m, text, &engine);
    if (bodies == 96) {
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
