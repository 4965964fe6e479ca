// What a mechanism cannot express of an MJCF file.
#include "core/text.h"
#include "simulation/mjcf_import.h"

namespace mbv::simulation {
namespace {

constexpr size_t kMost = 6;  // names that are told
constexpr const char* kForces = "drive forces are computed without it";

// Joints of which a number that acts on forces is not zero and has become no force element.
std::vector<std::string> JointsWith(const MjcfImport& in, const mjtNum* per_dof) {
  std::vector<std::string> names;
  for (int d = 0; d < in.m.nv; ++d) {
    const std::string name = in.JointNameOf(in.m.dof_jntid[d]);
    const bool held = in.m.jnt_type[in.m.dof_jntid[d]] == mjJNT_FREE;
    const bool taken = IsScalar(in.m, in.m.dof_jntid[d]);
    if (per_dof[d] != 0.0 && !held && !taken && (names.empty() || names.back() != name)) {
      names.push_back(name);
    }
  }
  return names;
}

std::vector<std::string> SprungJoints(const MjcfImport& in) {
  std::vector<std::string> names;
  for (int j = 0; j < in.m.njnt; ++j) {
    if (in.m.jnt_stiffness[j] != 0.0 && !IsScalar(in.m, j)) names.push_back(in.JointNameOf(j));
  }
  return names;
}

void TellLost(const MjcfImport& in, const char* what, const std::vector<std::string>& joints) {
  if (joints.empty()) return;
  in.Say(fmt::format("{} of {} joint{} is left out: {}", what, joints.size(),
                     joints.size() == 1 ? "" : "s", Joined(joints, kMost)),
         kForces);
}

void TellNames(const MjcfImport& in, const char* text, const std::vector<std::string>& names,
               const char* hint = "") {
  if (!names.empty()) in.Say(text + Joined(names, kMost), hint);
}

}  // namespace

void TellWhatIsLost(const MjcfImport& in) {
  TellLost(in, "armature", JointsWith(in, in.m.dof_armature));
  TellLost(in, "damping", JointsWith(in, in.m.dof_damping));
  TellLost(in, "friction loss", JointsWith(in, in.m.dof_frictionloss));
  TellLost(in, "stiffness", SprungJoints(in));
  const size_t tendons = static_cast<size_t>(in.m.ntendon) - in.coupling_tendons.size();
  if (tendons > 0) in.Say(fmt::format("{} tendons are left out", tendons), kForces);
  TellNames(in, "the gears of these actuators are left out: ", in.geared,
            "positions and forces are those of the joint, not of the motor");
  TellNames(in, "free bodies are held where they are, fixed to the world: ", in.held);
  TellNames(in, "positions of these joints count from the file's reference (ref): ", in.shifted);
  TellNames(in, "zero is beyond the range of these joints, the loops are closed from inside it: ",
            in.moved);
  if (in.touching) in.Say("there are no contacts here: geoms do not touch");
  if (in.m.nkey > 0) {
    in.Say(fmt::format("the loops are closed from the keyframe '{}'",
                       in.NameOf(mjOBJ_KEY, 0, "keyframe")));
  }
}

}  // namespace mbv::simulation
