// Bodies and joints of an MJCF file.
#include "core/spatial.h"
#include "simulation/mjcf_import.h"

namespace mbv::simulation {
namespace {

struct Ends {
  int inboard, outboard;
};

int NewBody(MjcfImport* in, const std::string& name) {
  in->mechanism.bodies.push_back({.name = name, .frames = {}, .shapes = {}});
  return static_cast<int>(in->mechanism.bodies.size()) - 1;
}

// Without a pose of the file, the zero of a joint may be far from where it works: a stretched
// leg.
void StartInside(Joint* joint, MjcfImport* in) {
  constexpr double kShare = 0.2;  // of the range, from its near end
  const CoordinateRange& range = joint->range[0];
  const double width = range.upper - range.lower;
  if (joint->home[0] >= range.lower && joint->home[0] <= range.upper) return;
  joint->home[0] =
      joint->home[0] < range.lower ? range.lower + kShare * width : range.upper - kShare * width;
  in->moved.push_back(joint->name);
}

// `X_PB`: the body at the joint's reference position.
void AddJoint(int j, const Ends& ends, const Pose& X_PB, MjcfImport* in) {
  const Vec3 anchor = VecAt(in->m.jnt_pos + 3 * j);
  const int at = in->m.jnt_qposadr[j];
  Joint joint;
  joint.name = in->JointNameOf(j);
  joint.parent = ends.inboard;
  joint.child = ends.outboard;
  joint.axis = VecAt(in->m.jnt_axis + 3 * j).normalized();
  switch (in->m.jnt_type[j]) {
    case mjJNT_HINGE:
    case mjJNT_SLIDE:
      joint.kind = in->m.jnt_type[j] == mjJNT_HINGE ? JointKind::kRevolute : JointKind::kPrismatic;
      joint.X_PF = X_PB * Shifted(anchor);
      joint.X_CM = Shifted(anchor);
      joint.home[0] = in->qpos[at] - in->m.qpos0[at];
      if (in->m.jnt_limited[j] != 0 && !in->LimitsAreOff()) {
        // Its limit pushes from the margin on.
        const double margin = in->m.jnt_margin[j];
        joint.range[0] = {in->m.jnt_range[2 * j] - in->m.qpos0[at] + margin,
                          in->m.jnt_range[2 * j + 1] - in->m.qpos0[at] - margin};
      }
      if (in->m.qpos0[at] != 0.0) in->shifted.push_back(joint.name);
      if (in->m.nkey == 0) StartInside(&joint, in);
      break;
    case mjJNT_BALL: {
      joint.kind = JointKind::kSpherical;
      joint.X_PF = X_PB * Shifted(anchor);
      joint.X_CM = Shifted(anchor);
      const Mat3 R = RotationAt(in->m.qpos0 + at).transpose() * RotationAt(in->qpos + at);
      const Vec3 rpy = RpyOf(R);
      joint.home = {rpy.x(), rpy.y(), rpy.z(), 0, 0, 0};
      break;
    }
    default:  // free
      joint.kind = JointKind::kFixed;
      joint.X_PF = PoseAt(in->qpos + at, in->qpos + at + 3);
      in->held.push_back(in->mechanism.bodies[static_cast<size_t>(ends.outboard)].name);
      break;
  }
  joint.guess = joint.home;
  in->joint_of[static_cast<size_t>(j)] = static_cast<int>(in->mechanism.joints.size());
  in->mechanism.joints.push_back(joint);
}

void AddBody(int b, MjcfImport* in) {
  const std::string name = in->NameOf(mjOBJ_BODY, b, "body");
  const int first = in->m.body_jntadr[b], count = in->m.body_jntnum[b];
  int inboard = in->body_of[static_cast<size_t>(in->m.body_parentid[b])];
  Pose X_PB = PoseAt(in->m.body_pos + 3 * b, in->m.body_quat + 4 * b);
  // Each joint but the last carries a massless piece that lies where the body does.
  for (int k = 0; k < count; ++k) {
    const int j = first + k;
    const bool last = k + 1 == count;
    const int outboard = NewBody(in, last ? name : fmt::format("{}_{}", name, in->JointNameOf(j)));
    AddJoint(j, {inboard, outboard}, X_PB, in);
    inboard = outboard;
    X_PB = Pose::Identity();
  }
  if (count == 0) {
    const int outboard = NewBody(in, name);
    Joint weld;
    weld.name = name + "_fixed";
    weld.parent = inboard;
    weld.child = outboard;
    weld.X_PF = X_PB;
    in->mechanism.joints.push_back(weld);
    inboard = outboard;
  }
  in->body_of[static_cast<size_t>(b)] = inboard;
  Body& body = in->BodyOf(b);
  const Mat3 R = RotationAt(in->m.body_iquat + 4 * b);
  body.mass = in->m.body_mass[b];
  body.p_BoBcm_B = VecAt(in->m.body_ipos + 3 * b);
  body.I_Bcm_B = R * VecAt(in->m.body_inertia + 3 * b).asDiagonal() * R.transpose();
  body.I_Bcm_B = 0.5 * (body.I_Bcm_B + body.I_Bcm_B.transpose()).eval();
  if (body.mass == 0.0) body.I_Bcm_B.setZero();
}

}  // namespace

void AddTree(MjcfImport* in) {
  in->qpos = in->m.nkey > 0 ? in->m.key_qpos : in->m.qpos0;
  in->body_of.assign(static_cast<size_t>(in->m.nbody), 0);
  in->joint_of.assign(static_cast<size_t>(in->m.njnt), -1);
  (void)NewBody(in, "world");
  for (int b = 1; b < in->m.nbody; ++b) AddBody(b, in);
}

}  // namespace mbv::simulation
