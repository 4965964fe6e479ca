// What a mechanism cannot express of an MJCF file.
#include <algorithm>
#include <memory>
#include <utility>

#include "core/demand.h"
#include "core/text.h"
#include "mjcf/foreign_rows.h"
#include "simulation/mjcf_import.h"

namespace mbv::simulation {
namespace {

constexpr size_t kMost = 6;  // names that are told

// Joints with several coordinates of which a number that acts on forces is not zero.
std::vector<std::string> BallsWith(const MjcfImport& in, const mjtNum* per_dof) {
  std::vector<std::string> names;
  for (int d = 0; d < in.m.nv; ++d) {
    const int j = in.m.dof_jntid[d];
    const std::string name = in.JointNameOf(j);
    const bool is_ball = in.m.jnt_type[j] == mjJNT_BALL;
    if (per_dof[d] != 0.0 && is_ball && (names.empty() || names.back() != name)) {
      names.push_back(name);
    }
  }
  return names;
}

std::vector<std::string> BallsWhere(const MjcfImport& in, const auto& applies) {
  std::vector<std::string> names;
  for (int j = 0; j < in.m.njnt; ++j) {
    if (in.m.jnt_type[j] == mjJNT_BALL && applies(j)) names.push_back(in.JointNameOf(j));
  }
  return names;
}

void LeaveOutOf(const char* element, const char* attribute, const char* what,
                const std::vector<std::string>& joints, MjcfImport* in) {
  if (joints.empty()) return;
  in->LeaveOut(element, attribute,
               fmt::format("{} of {} joint{} ({})", what, joints.size(),
                           joints.size() == 1 ? "" : "s", Joined(joints, kMost)));
}

void LeaveOutBalls(MjcfImport* in) {
  const mjModel& m = in->m;
  LeaveOutOf("ball", "armature", "armature", BallsWith(*in, m.dof_armature), in);
  if (!in->FrictionIsOff()) {
    LeaveOutOf("ball", "frictionloss", "friction loss", BallsWith(*in, m.dof_frictionloss), in);
  }
  if (!in->IsOff(mjDSBL_PASSIVE)) {
    LeaveOutOf("ball", "damping", "damping", BallsWith(*in, m.dof_damping), in);
    LeaveOutOf("ball", "stiffness", "stiffness",
               BallsWhere(*in, [&](int j) { return m.jnt_stiffness[j] != 0.0; }), in);
  }
  if (!in->LimitsAreOff()) {
    LeaveOutOf("ball", "range", "the range",
               BallsWhere(*in, [&](int j) { return m.jnt_limited[j] != 0; }), in);
  }
}

void LeaveOutFluid(MjcfImport* in) {
  const mjOption& option = in->m.opt;
  if (in->IsOff(mjDSBL_PASSIVE) || (option.density == 0.0 && option.viscosity == 0.0)) return;
  for (const auto& [name, value] :
       {std::pair("density", option.density), {"viscosity", option.viscosity}}) {
    if (value != 0.0) in->LeaveOut("option", name, fmt::format("the fluid's {} {:g}", name, value));
  }
  const Vec3 wind = VecAt(option.wind);
  if (wind.norm() > 0.0) {
    in->LeaveOut("option", "wind", fmt::format("the fluid's wind of {:g} m/s", wind.norm()));
  }
}

void LeaveOutTendons(MjcfImport* in) {
  const mjModel& m = in->m;
  const size_t tendons = static_cast<size_t>(m.ntendon) - in->coupling_tendons.size();
  bool acts = false;
  for (int t = 0; t < m.ntendon; ++t) {
    const bool passive = !in->IsOff(mjDSBL_PASSIVE);
    const std::pair<const char*, bool> kinds[] = {
        {"stiffness", passive && m.tendon_stiffness[t] != 0.0},
        {"damping", passive && m.tendon_damping[t] != 0.0},
        {"frictionloss", !in->FrictionIsOff() && m.tendon_frictionloss[t] != 0.0},
        {"range", !in->LimitsAreOff() && m.tendon_limited[t] != 0}};
    for (const auto& [attribute, is_there] : kinds) {
      if (!is_there) continue;
      acts = true;
      in->LeaveOut(
          "tendon/spatial", attribute,
          fmt::format("{} of tendon '{}'", attribute, in->NameOf(mjOBJ_TENDON, t, "tendon")));
    }
  }
  if (tendons > 0 && !acts)
    in->Say(fmt::format("{} tendons are left out: they exert no force", tendons));
}

// Geoms that touch in the pose of the file; the balls in the place of meshes do not count.
std::string TouchingGeoms(const MjcfImport& in) {
  const std::unique_ptr<mjModel, void (*)(mjModel*)> copy(mj_copyModel(nullptr, &in.m),
                                                          [](mjModel* m) { mj_deleteModel(m); });
  for (int g = 0; g < copy->ngeom; ++g) {
    if (!in.foreign.meshes().contains(in.NameOf(mjOBJ_GEOM, g, "geom"))) continue;
    copy->geom_contype[g] = copy->geom_conaffinity[g] = 0;
  }
  const DataHandle data = MakeData(*copy);
  std::copy(in.qpos, in.qpos + copy->nq, data->qpos);
  mj_kinematics(copy.get(), data.get());
  mj_comPos(copy.get(), data.get());
  mj_collision(copy.get(), data.get());
  for (int c = 0; c < data->ncon; ++c) {
    const mjContact& contact = data->contact[c];
    if (contact.dist > 0.0) continue;
    return fmt::format("contact of '{}' with '{}'", in.NameOf(mjOBJ_GEOM, contact.geom1, "geom"),
                       in.NameOf(mjOBJ_GEOM, contact.geom2, "geom"));
  }
  return "";
}

void TellNames(const MjcfImport& in, const char* text, const std::vector<std::string>& names,
               const char* hint = "") {
  if (!names.empty()) in.Say(text + Joined(names, kMost), hint);
}

}  // namespace

void MjcfImport::LeaveOut(const char* element, const char* attribute, const std::string& what) {
  const mjcf::ForeignRow* row = mjcf::FindForeignRow(element, attribute);
  MBV_DEMAND(row != nullptr && row->fate == mjcf::Fate::kLeftOut, element);
  left_out.push_back(
      {.kind = ModelCaveat::Kind::kLeftOut,
       .text = fmt::format("{} is left out: {}", what, row->effect),
       .source = fmt::format("{}{}{}", row->element, *attribute == '\0' ? "" : " ", attribute)});
  Say(left_out.back().text, "forces are computed without it");
}

void TellWhatIsLost(MjcfImport* in) {
  LeaveOutFluid(in);
  LeaveOutBalls(in);
  LeaveOutOf("hinge or slide", "damping", "the negative damping", in->driving, in);
  LeaveOutTendons(in);
  if (!in->held.empty()) {
    in->LeaveOut("body/freejoint", "", "the free joint of " + Joined(in->held, kMost));
  }
  TellNames(*in, "the gears of these actuators are left out: ", in->geared,
            "positions and forces are those of the joint, not of the motor");
  TellNames(*in, "positions of these joints count from the file's reference (ref): ", in->shifted);
  TellNames(*in, "zero is beyond the range of these joints, the loops are closed from inside it: ",
            in->moved);
  if (in->touching && !in->ContactsAreOff()) {
    const std::string contact = TouchingGeoms(*in);
    if (contact.empty()) {
      in->Say("there are no contacts here: geoms do not touch");
    } else {
      in->LeaveOut("contact", "", contact);
    }
  }
  if (in->m.nkey > 0) {
    in->Say(fmt::format("the loops are closed from the keyframe '{}'",
                        in->NameOf(mjOBJ_KEY, 0, "keyframe")));
  }
}

}  // namespace mbv::simulation
