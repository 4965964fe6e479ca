// Exports of models with every kind of joint and force element, read back.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <map>

#include "model_file/element_text.h"
#include "model_file/load_model.h"
#include "model_file/urdf/urdf_import.h"
#include "model_file/write_model.h"
#include "tests/support/test_folder.h"
#include "verify/model_text.h"

namespace mbv {
namespace {

struct Kind {
  const char* joint;     ///< behind "kind: "
  const char* elements;  ///< of joint j
};

constexpr const char* kOfOneCoordinate =
    "  d: {kind: damping, joint: j, damping: 0.3}\n"
    "  s: {kind: spring, joint: j, stiffness: 4, free: 0.2}\n"
    "  p: {kind: spring, joint: j, stiffness: 2, free: 0.1, preload: 0.6}\n"
    "  q: {kind: spring, joint: j, polynomial: [1.5, -0.4, 0.9]}\n"
    "  r: {kind: rotor, joint: j, inertia: 2e-5, ratio: 40}\n"
    "  f: {kind: friction, joint: j, coulomb: 0.2}\n"
    "  g: {kind: friction, joint: j, coulomb: 0.2, breakaway: 0.32, stribeck_rate: 0.4}\n";
constexpr const char* kOfCoordinate0 =
    "  d: {kind: damping, joint: j, coordinate: 0, damping: 0.3}\n"
    "  s: {kind: spring, joint: j, coordinate: 0, stiffness: 4, free: 0.02}\n"
    "  r: {kind: rotor, joint: j, coordinate: 0, inertia: 2e-5, ratio: 40}\n"
    "  f: {kind: friction, joint: j, coordinate: 0, coulomb: 0.2}\n";
constexpr const char* kOfBall =
    "  d: {kind: damping, joint: j, damping: 0.3}\n"
    "  r: {kind: rotor, joint: j, inertia: 2e-5, ratio: 40}\n"
    "  f: {kind: friction, joint: j, coulomb: 0.2}\n"
    "  k: {kind: bushing, parent: a.tip, child: b, stiffness: [9, 8, 7, 6, 5, 4], damping: [1, 2, "
    "3, 4, 5, 6]}\n";

const std::map<std::string, Kind> kKinds = {
    {"revolute", {"revolute, axis: [0, 0.6, 0.8]", kOfOneCoordinate}},
    {"prismatic", {"prismatic, axis: [0, 0.6, 0.8]", kOfOneCoordinate}},
    {"cylindrical", {"cylindrical, axis: x", kOfCoordinate0}},
    {"helical", {"helical, axis: x, lead: 0.01", kOfCoordinate0}},
    {"universal", {"universal, axis: x, axis2: y", kOfCoordinate0}},
    {"planar", {"planar, axis: z", kOfCoordinate0}},
    {"point_on_line", {"point_on_line, axis: x", kOfCoordinate0}},
    {"point_on_plane", {"point_on_plane, axis: z", kOfCoordinate0}},
    {"spherical", {"spherical", kOfBall}},
    {"free", {"free", "  d: {kind: damping, joint: j, coordinate: 1, damping: 0.3}\n"}},
    {"journal",
     {"revolute, axis: y",
      "  h: {kind: friction, joint: j, coefficient: 0.08, radius: 0.012}\n"
      "  fly: {kind: rotor, joint: j, inertia: 2e-5, ratio: 40, axis_on: a, axis: x}\n"}},
};

std::string ModelOf(const std::string& name) {
  const Kind& kind = kKinds.at(name);
  return fmt::format(
      "name: {}\nbodies:\n"
      "  a: {{mass: 2, com: [0.1, 0.02, 0.03], inertia: [0.02, 0.03, 0.04], frames: {{tip: [0.3, "
      "0.1, 0.05]}}}}\n"
      "  b: {{mass: 1, com: [0.05, 0.01, 0.02], inertia: [0.01, 0.012, 0.014]}}\n"
      "joints:\n  first: {{kind: revolute, parent: world, child: a, axis: y}}\n"
      "  j: {{parent: a.tip, child: b, kind: {}}}\n"
      "drives: {{m: {{kind: joint, joint: first}}}}\nelements:\n{}",
      name, kind.joint, kind.elements);
}

// What acts along one direction, by kind of law, whoever states it.
struct Sums {
  double damping = 0.0, stiffness = 0.0, at_zero = 0.0, reflected = 0.0, coulomb = 0.0;
  size_t others = 0;
};
Sums SumsOf(const Mechanism& mechanism) {
  Sums sums;
  for (const ForceElement& element : mechanism.elements) {
    const auto* spring = std::get_if<SpringLaw>(&element.law);
    const auto* rotor = std::get_if<RotorLaw>(&element.law);
    const auto* friction = std::get_if<FrictionLaw>(&element.law);
    if (const auto* damping = std::get_if<DampingLaw>(&element.law)) {
      sums.damping += damping->damping;
    } else if (spring != nullptr && spring->polynomial.size() == 1) {
      sums.stiffness += spring->polynomial[0];
      sums.at_zero += spring->polynomial[0] * spring->free - spring->preload;
    } else if (rotor != nullptr && !rotor->carrier) {
      sums.reflected += rotor->reflected();
    } else if (friction != nullptr && friction->breakaway == friction->coulomb &&
               friction->per_load() == 0.0) {
      sums.coulomb += friction->coulomb;
    } else {
      ++sums.others;
    }
  }
  return sums;
}

class RoundTripOf : public testing::TestWithParam<std::string> {
 protected:
  [[nodiscard]] Mechanism Model() const {
    LoadResult loaded = LoadModelText(ModelOf(GetParam()), "model.yaml");
    EXPECT_TRUE(loaded.mechanism) << loaded.diagnostics.Text();
    return loaded.mechanism ? *loaded.mechanism : Mechanism();
  }
  const test::TestFolder folder_{"round_trip_" + GetParam()};
};

// The same elements with the same numbers, in the words of a model file.
void ExpectSameElements(const Mechanism& a, const Mechanism& b) {
  ASSERT_EQ(a.elements.size(), b.elements.size());
  const auto texts = [](const Mechanism& m) {
    std::vector<std::string> all;
    for (const ForceElement& element : m.elements) {
      const bool bushing = element.bushing >= 0;
      all.push_back(bushing ? element.name : ElementText(element, "", false));
    }
    std::ranges::sort(all);
    return all;
  };
  EXPECT_EQ(texts(a), texts(b));
  const Sums x = SumsOf(a), y = SumsOf(b);
  EXPECT_DOUBLE_EQ(x.damping, y.damping);
  EXPECT_DOUBLE_EQ(x.stiffness, y.stiffness);
  EXPECT_DOUBLE_EQ(x.reflected, y.reflected);
  EXPECT_DOUBLE_EQ(x.coulomb, y.coulomb);
}

TEST_P(RoundTripOf, AModelFileHasAllElements) {
  const Mechanism m = Model();
  const LoadResult back = LoadModelText(WriteModel(m), "written.yaml");
  ASSERT_TRUE(back.mechanism) << back.diagnostics.Text();
  ExpectSameElements(m, *back.mechanism);
}

TEST_P(RoundTripOf, AUrdfAndItsCompanionHaveAllElements) {
  const Mechanism m = Model();
  const std::string urdf = folder_.Write("model.urdf", WriteUrdf(m));
  (void)folder_.Write("model.mbverify.yaml", WriteUrdfCompanion(m, urdf));
  const LoadResult back = LoadRobot(CompletedModel(urdf));
  ASSERT_TRUE(back.mechanism) << back.diagnostics.Text();
  ASSERT_EQ(m.elements.size(), back.mechanism->elements.size());
  const Sums x = SumsOf(m), y = SumsOf(*back.mechanism);
  EXPECT_DOUBLE_EQ(x.damping, y.damping);
  EXPECT_DOUBLE_EQ(x.stiffness, y.stiffness);
  EXPECT_DOUBLE_EQ(x.at_zero, y.at_zero);
  EXPECT_DOUBLE_EQ(x.reflected, y.reflected);
  EXPECT_DOUBLE_EQ(x.coulomb, y.coulomb);
  EXPECT_EQ(x.others, y.others);
}

// MuJoCo 2.2 has damping, linear springs, rotors and dry friction of hinges and slides. What it has
// no word for the file's comment names.
TEST_P(RoundTripOf, AnMjcfHasWhatMuJoCoHasWordsForAndNamesTheRest) {
  const Mechanism m = Model();
  const MjcfText written = MjcfFor(m, ModelDrives::kHeld);
  ASSERT_TRUE(written.trouble.empty()) << written.trouble;
  const LoadResult back = LoadRobot(folder_.Write("model.xml", written.text));
  ASSERT_TRUE(back.mechanism) << back.diagnostics.Text();
  Mechanism there = m;  // what must come back
  std::erase_if(there.elements, [&](const ForceElement& element) {
    return written.text.find(fmt::format("\n   {}: ", element.name)) != std::string::npos;
  });
  const Sums x = SumsOf(there), y = SumsOf(*back.mechanism);
  EXPECT_NEAR(x.damping, y.damping, 1e-15);
  EXPECT_NEAR(x.stiffness, y.stiffness, 1e-15);
  EXPECT_NEAR(x.at_zero, y.at_zero, 1e-15);
  EXPECT_NEAR(x.reflected, y.reflected, 1e-15);
  EXPECT_NEAR(x.coulomb, y.coulomb, 1e-15);
  EXPECT_EQ(x.others, 0U);
  EXPECT_EQ(y.others, 0U);
  // Of one coordinate nothing that has a word is among what is left out.
  const std::string& kind = GetParam();
  if (kind == "revolute" || kind == "prismatic") {
    EXPECT_EQ(there.elements.size(), 5U);
    EXPECT_DOUBLE_EQ(y.coulomb, 0.2);
    EXPECT_DOUBLE_EQ(y.reflected, 0.032);
  }
}

std::vector<std::string> Names() {
  std::vector<std::string> names;
  for (const auto& [name, kind] : kKinds) names.push_back(name);
  return names;
}
INSTANTIATE_TEST_SUITE_P(Kinds, RoundTripOf, testing::ValuesIn(Names()),
                         [](const auto& name) { return name.param; });

}  // namespace
}  // namespace mbv
