// A rotor in an arm that turns about three axes: as a law on the wrist's coordinate, and as a body
// of its own on a bearing, tied to the wrist by a coupling.
#pragma once

#include <string>

namespace mbv::fixtures {

/// Chain yaw (z), pitch (y), roll (x) with a drive on each. The rotor turns n times as fast as the
/// wrist about a = (0.6, 0, 0.8) of the arm, J = 0.004 about a, 0.0025 across, 0.3 kg, with its
/// centre of mass in the arm's. Of the law, the arm contains its mass and inertia.
struct CarriedRotor {
  double ratio = 14.0;
  std::string rotor_inertia = "0.004";
  std::string axis = "[0.6, 0, 0.8]";

  [[nodiscard]] std::string AsLaw() const {
    // Across (1 − a aᵀ) + J a aᵀ added to the arm's diagonal inertia.
    return Chain("2.3",
                 "{xx: 0.01 + 0.0025*0.64 + 0.004*0.36, yy: 0.03 + 0.0025,"
                 " zz: 0.02 + 0.0025*0.36 + 0.004*0.64, xz: (0.004 - 0.0025)*0.48}") +
           "elements:\n"
           "  fly: {kind: rotor, drive: m3, inertia: " +
           rotor_inertia + ", ratio: " + std::to_string(ratio) + ", axis_on: arm, axis: " + axis +
           "}\n";
  }

  [[nodiscard]] std::string AsBody() const {
    std::string text = Chain("2", "[0.01, 0.03, 0.02]");
    // The bearing's z axis is a.
    Insert(&text, "bodies:\n", "  fly: {mass: 0.3, inertia: [0.0025, 0.0025, 0.004]}\n");
    Insert(&text, "joints:\n",
           "  bearing: {kind: revolute, parent: arm.bearing, child: fly, axis: z}\n");
    return text +
           "couplings:\n  gear: {joint: bearing, follows: roll, ratio: " + std::to_string(ratio) +
           "}\n";
  }

 private:
  static void Insert(std::string* text, const std::string& behind, const std::string& line) {
    text->insert(text->find(behind) + behind.size(), line);
  }

  static std::string Chain(const std::string& mass, const std::string& inertia) {
    return "name: chain\n"
           "bodies:\n"
           "  base: {mass: 3, com: [0.02, 0, 0.1], inertia: [0.02, 0.02, 0.02],"
           " frames: {top: [0, 0, 0.3]}}\n"
           "  arm: {mass: " +
           mass + ", com: [0.2, 0.01, 0], inertia: " + inertia +
           ", frames: {end: [0.4, 0, 0], bearing: {position: [0.2, 0.01, 0],"
           " rotation: {axes: {z: [0.6, 0, 0.8], y: [0, 1, 0]}}}}}\n"
           "  hand: {mass: 0.7, com: [0.05, 0.02, -0.01], inertia: [0.001, 0.002, 0.002]}\n"
           "joints:\n"
           "  yaw: {kind: revolute, parent: world, child: base, axis: z}\n"
           "  pitch: {kind: revolute, parent: base.top, child: arm, axis: y}\n"
           "  roll: {kind: revolute, parent: arm.end, child: hand, axis: x}\n"
           "drives:\n"
           "  m1: {kind: joint, joint: yaw}\n"
           "  m2: {kind: joint, joint: pitch}\n"
           "  m3: {kind: joint, joint: roll}\n";
  }
};

}  // namespace mbv::fixtures
