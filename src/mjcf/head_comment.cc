#include "mjcf/head_comment.h"

#include <fmt/format.h>

#include "core/text.h"
#include "mjcf/plan.h"
#include "mjcf/writer.h"

namespace mbv {
namespace mjcf {
namespace {

// XML forbids two hyphens in a comment.
std::string InComment(const std::string& text) {
  std::string safe;
  for (const char c : Printable(text)) {
    if (c == '-' && !safe.empty() && safe.back() == '-') safe += ' ';
    safe += c;
  }
  return safe;
}

const char* StaticsText() {
  return "Statics only, not for stepping in time: there is no gravity, and every piece has a mass\n"
         "of 1 kg whatever its body weighs. Springs on joints and tendons are beams and servos.\n"
         "Two ways to use it:\n"
         "1. Apply a wrench (xfrc_applied) and look for the equilibrium, where the accelerations\n"
         "   of mj_forward vanish.\n"
         "2. Read the stiffness from the springs and the Jacobians of mj_forward in this pose.\n";
}

const char* DrivesText(const MjcfOptions& options) {
  if (!options.kp.empty()) {
    return "1. As it is: every drive has a position and a velocity servo and a motor. Load the "
           "key\n"
           "   \"home\" first: its ctrl has the servos' targets and what the motors must give.\n"
           "   Other targets in ctrl move the drives; without the key the targets are 0.\n"
           "2. Held instead: switch the equalities drive:NAME on (eq_active = 1) and leave ctrl "
           "0;\n"
           "   the first number of eq_data is then a drive's distance from home.\n";
  }
  if (!options.guided) {
    return "1. As it is: nothing holds the drives; ctrl of the motors is the drive force [N, N "
           "m].\n"
           "   With ctrl 0 the mechanism falls from the key \"home\".\n"
           "2. Held instead: switch the equalities drive:NAME on (eq_active = 1); the first "
           "number\n"
           "   of eq_data is then a drive's distance from home.\n";
  }
  return "1. As it is: the equalities drive:NAME hold the drives at home; the first number of\n"
         "   eq_data of one is its distance from home, to be changed while stepping. Their forces\n"
         "   are constraint forces (efc_force).\n"
         "2. Pushed instead: switch those equalities off (eq_active = 0); then ctrl of the motors\n"
         "   is the drive force [N, N m].\n";
}

// Force elements that MuJoCo has no word for.
std::string LackingText(const Mechanism& mechanism) {
  std::string names;
  for (const ForceElement& element : mechanism.elements) {
    if (IsPlanned(element)) continue;
    names += fmt::format("   {}: {}\n", InComment(element.name),
                         InComment(Described(mechanism, element)));
  }
  if (names.empty()) return "";
  return "Not in this file, as MuJoCo 2.2 has no word for them; qfrc_applied can stand for "
         "them:\n" +
         names;
}

}  // namespace

std::string HeadComment(const Mechanism& mechanism, const MjcfOptions& options) {
  std::string text = "\n" + InComment(mechanism.name);
  if (!mechanism.description.empty()) text += ": " + InComment(mechanism.description);
  text += "\nWritten by mbverify for MuJoCo 2.2.2 and later. SI units, radians.\n\n";
  if (options.statics) return text + StaticsText();
  if (mechanism.drives.empty()) {
    text += "Two ways to use it:\n1. Step it from the key \"home\".\n";
    text += "2. Push it: xfrc_applied on bodies, qfrc_applied on joints.\n";
  } else {
    text += std::string("Two ways to use it:\n") + DrivesText(options);
  }
  text += LackingText(mechanism);
  text +=
      "To look only: pause, and load a key; other keys than \"home\" are poses at rest.\n"
      "Loops are closed by the equalities close:JOINT; sensors JOINT.gap say how well.\n";
  return text;
}

}  // namespace mjcf

std::string WithKeys(const std::string& mjcf, const std::vector<MjcfKey>& keys) {
  const size_t end = mjcf.find("    </keyframe>");
  if (end == std::string::npos) return mjcf;
  const bool servos = mjcf.find(mjcf::kPositionServo) != std::string::npos;
  std::string lines;
  for (const MjcfKey& key : keys) {
    lines += fmt::format("        <key name=\"{}\" time=\"{}\" qpos=\"{}\"", key.name,
                         mjcf::NumberText(key.time_s), mjcf::NumbersText(key.qpos));
    if (servos) {
      std::vector<double> ctrl(key.drive_position.size(), 0.0);  // motors
      for (const double position : key.drive_position) ctrl.insert(ctrl.end(), {position, 0.0});
      lines += fmt::format(" ctrl=\"{}\"", mjcf::NumbersText(ctrl));
    }
    lines += "/>\n";
  }
  return mjcf.substr(0, end) + lines + mjcf.substr(end);
}

}  // namespace mbv
