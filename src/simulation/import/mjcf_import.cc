// Bodies and joints of an MJCF file.

#include "simulation/import/mjcf_import.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <optional>
#include <tuple>
#include <utility>

#include "base/demand.h"
#include "base/text.h"
#include "math/spatial.h"
#include "mechanism/joint_pose.h"
#include "simulation/mjcf/foreign_rows.h"

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
        const CoordinateRange range{in->m.jnt_range[2 * j] - in->m.qpos0[at] + margin,
                                    in->m.jnt_range[2 * j + 1] - in->m.qpos0[at] - margin};
        if (range.lower < range.upper) {
          joint.range[0] = range;
        } else {
          in->without_room.push_back(joint.name);
        }
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
      if (in->m.jnt_limited[j] != 0 && !in->LimitsAreOff()) {
        // MuJoCo takes the larger of both numbers as the largest angle of rotation.
        const double most =
            std::max(in->m.jnt_range[2 * j], in->m.jnt_range[2 * j + 1]) - in->m.jnt_margin[j];
        if (most > 0.0) {
          joint.max_rotation = most;
        } else {
          in->without_room.push_back(joint.name);
        }
      }
      break;
    }
    default: {  // free
      const std::string& body = in->mechanism.bodies[static_cast<size_t>(ends.outboard)].name;
      const Pose X_WB = PoseAt(in->qpos + at, in->qpos + at + 3);
      if (in->moves[static_cast<size_t>(j)]) {
        joint.kind = JointKind::kFree;
        joint.home = CoordinatesOf(joint, X_WB);
        if (!Contains(in->floating, body)) in->carried.push_back(body);
      } else {
        joint.kind = JointKind::kFixed;
        joint.X_PF = X_WB;
        in->held.push_back(body);
      }
      break;
    }
  }
  joint.guess = joint.home;
  in->joint_of[static_cast<size_t>(j)] = static_cast<int>(in->mechanism.joints.size());
  in->mechanism.joints.push_back(joint);
}

// The top joint of a tree in which another body is held carries nothing.
bool IsHeldInside(const MjcfImport& in, int b) {
  return in.held_inside >= 0 && in.m.body_rootid[in.held_inside] == b;
}

void AddBody(int b, MjcfImport* in) {
  const std::string name = in->NameOf(mjOBJ_BODY, b, "body");
  const int first = in->m.body_jntadr[b];
  const int count = IsHeldInside(*in, b) ? 0 : in->m.body_jntnum[b];
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
  if (IsHeldInside(*in, b)) {
    inboard = NewBody(in, name);
  } else if (count == 0) {
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

// In the pose of the file.
void HoldInside(MjcfImport* in) {
  const DataHandle data = MakeData(in->m);
  std::copy(in->qpos, in->qpos + in->m.nq, data->qpos);
  mj_kinematics(&in->m, data.get());
  const int b = in->held_inside;
  Joint weld;
  weld.name = in->NameOf(mjOBJ_BODY, b, "body") + "_held";
  weld.child = in->body_of[static_cast<size_t>(b)];
  weld.X_PF = PoseAt(data->xpos + 3 * b, data->xquat + 4 * b);
  in->mechanism.joints.push_back(weld);
  in->held.push_back(in->BodyOf(b).name);
}

bool IsFree(const mjModel& m, int b) {
  return m.body_jntnum[b] > 0 && m.jnt_type[m.body_jntadr[b]] == mjJNT_FREE;
}

// The sites of a tendon that is a straight line between two sites on different bodies of MuJoCo.
std::optional<std::pair<int, int>> LegSites(const mjModel& m, int tendon) {
  const int first = m.tendon_adr[tendon];
  if (m.tendon_num[tendon] != 2 || m.wrap_type[first] != mjWRAP_SITE ||
      m.wrap_type[first + 1] != mjWRAP_SITE) {
    return std::nullopt;
  }
  const int from = m.wrap_objid[first], to = m.wrap_objid[first + 1];
  if (m.site_bodyid[from] == m.site_bodyid[to]) return std::nullopt;
  return std::pair(from, to);
}

// Pairs of bodies that a leg whose length is driven, or a spring, ties together.
std::vector<std::pair<int, int>> LegTies(const MjcfImport& in) {
  const mjModel& m = in.m;
  std::vector<std::pair<int, int>> ties;
  for (int t = 0; t < m.ntendon; ++t) {
    bool acts = m.tendon_stiffness[t] != 0.0 && !in.IsOff(mjDSBL_PASSIVE);
    for (int u = 0; u < m.nu; ++u) {
      acts = acts || (m.actuator_trntype[u] == mjTRN_TENDON && m.actuator_trnid[2 * u] == t);
    }
    const auto sites = LegSites(m, t);
    if (acts && sites) ties.emplace_back(m.site_bodyid[sites->first], m.site_bodyid[sites->second]);
  }
  return ties;
}

// Per body, the first root of the trees that closures tie to its own, and `more` pairs of bodies;
// 0 where they tie it to what does not float.
std::vector<int> TiedTo(const MjcfImport& in, std::vector<std::pair<int, int>> more) {
  const mjModel& m = in.m;
  std::vector<int> group(static_cast<size_t>(m.nbody));
  for (int b = 0; b < m.nbody; ++b) {
    const int root = m.body_rootid[b];
    group[static_cast<size_t>(b)] = IsFree(m, root) ? root : 0;
  }
  for (int e = 0; e < m.neq && !in.EqualitiesAreOff(); ++e) {
    const bool ties = m.eq_type[e] == mjEQ_CONNECT || m.eq_type[e] == mjEQ_WELD;
    if (ties && m.eq_active[e] != 0) more.emplace_back(m.eq_obj1id[e], m.eq_obj2id[e]);
  }
  for (const auto& [one, other] : more) {
    const int a = group[static_cast<size_t>(one)], b = group[static_cast<size_t>(other)];
    std::ranges::replace(group, std::max(a, b), std::min(a, b));
  }
  return group;
}

}  // namespace

void ChooseHeld(MjcfImport* in) {
  const mjModel& m = in->m;
  // What legs carry may be held all the same, but only on demand.
  const std::vector<int> closed_to = TiedTo(*in, {}), tied_to = TiedTo(*in, LegTies(*in));
  in->moves.assign(static_cast<size_t>(m.njnt), false);
  int base = -1;  // by option
  if (!in->base.held.empty()) {
    std::vector<std::string> names;
    for (int b = 1; b < m.nbody; ++b) {
      names.push_back(in->NameOf(mjOBJ_BODY, b, "body"));
      if (names.back() == in->base.held) base = b;
    }
    if (base < 0) {
      in->Refuse(fmt::format("base {}: there is no body of this name", in->base.held),
                 DidYouMean(in->base.held, names));
    } else if (closed_to[static_cast<size_t>(base)] == 0) {
      in->Refuse(fmt::format("base {}: the body does not float, its joints or loops hold it in the "
                             "world",
                             in->base.held),
                 "only what hangs together on free joints needs a base");
      base = -1;
    }
  }
  for (int j = 0; j < m.njnt; ++j) {
    if (m.jnt_type[j] != mjJNT_FREE) continue;
    const int body = m.jnt_bodyid[j], first = tied_to[static_cast<size_t>(body)];
    const bool chosen =
        base >= 0 && closed_to[static_cast<size_t>(base)] == closed_to[static_cast<size_t>(body)];
    const int held = chosen ? m.body_rootid[base] : first;
    in->moves[static_cast<size_t>(j)] = body != held || in->base.free;
    // A tree of its own that no loop carries.
    if (in->base.free && body == held && first != 0) {
      in->floating.push_back(in->NameOf(mjOBJ_BODY, body, "body"));
    }
    if (chosen && body == held && base != body) in->held_inside = base;
  }
}

void AddTree(MjcfImport* in) {
  in->qpos = in->m.nkey > 0 ? in->m.key_qpos : in->m.qpos0;
  in->body_of.assign(static_cast<size_t>(in->m.nbody), 0);
  in->joint_of.assign(static_cast<size_t>(in->m.njnt), -1);
  (void)NewBody(in, "world");
  for (int b = 1; b < in->m.nbody; ++b) AddBody(b, in);
  if (in->held_inside >= 0) HoldInside(in);
}

// Drives of an MJCF file.

namespace {

// Of a tendon that is a straight line between two sites on different bodies; empty for others.
std::optional<DistanceDrive> LegOf(int tendon, const MjcfImport& in) {
  const mjModel& m = in.m;
  const auto sites = LegSites(m, tendon);
  if (!sites) return std::nullopt;
  const auto [from, to] = *sites;
  const DistanceDrive leg{.body_from = in.body_of[static_cast<size_t>(m.site_bodyid[from])],
                          .p_from = VecAt(m.site_pos + 3 * from),
                          .body_to = in.body_of[static_cast<size_t>(m.site_bodyid[to])],
                          .p_to = VecAt(m.site_pos + 3 * to)};
  return leg.body_from == leg.body_to ? std::nullopt : std::optional(leg);
}

// A hinge or slide of MuJoCo, and how much something else moves for one unit of it.
struct Lever {
  int joint = -1;  ///< -1: none
  double ratio = 0.0;
};

// The joint that a joint follows by equalities, linearly; itself where it follows none.
Lever LeaderOf(int joint, const MjcfImport& in) {
  const mjModel& m = in.m;
  Lever lever{joint, 1.0};
  for (int step = 0; step < m.njnt && !in.EqualitiesAreOff(); ++step) {
    int next = -1;
    for (int e = 0; e < m.neq; ++e) {
      const mjtNum* a = m.eq_data + mjNEQDATA * e;
      const bool linear = m.eq_type[e] == mjEQ_JOINT && m.eq_active[e] != 0 &&
                          m.eq_obj2id[e] >= 0 && a[2] == 0.0 && a[3] == 0.0 && a[4] == 0.0;
      if (linear && m.eq_obj1id[e] == lever.joint) next = e;
    }
    if (next < 0) return lever;
    lever = {m.eq_obj2id[next], lever.ratio * m.eq_data[mjNEQDATA * next + 1]};
  }
  return in.EqualitiesAreOff() ? lever : Lever{};  // they follow each other in a circle
}

// The hinge or slide on which an actuator acts, by itself or through a fixed tendon of joints that
// follow one of them; the ratio is without its gear.
Lever LeverOf(int u, const MjcfImport& in) {
  const mjModel& m = in.m;
  const int type = m.actuator_trntype[u], target = m.actuator_trnid[2 * u];
  if (type == mjTRN_JOINT || type == mjTRN_JOINTINPARENT) {
    return IsScalar(m, target) ? Lever{target, 1.0} : Lever{};
  }
  if (type != mjTRN_TENDON) return {};
  Lever sum;
  const int first = m.tendon_adr[target];
  for (int w = first; w < first + m.tendon_num[target]; ++w) {
    if (m.wrap_type[w] != mjWRAP_JOINT || !IsScalar(m, m.wrap_objid[w])) return {};
    const Lever leader = LeaderOf(m.wrap_objid[w], in);
    if (leader.joint < 0 || (sum.joint >= 0 && sum.joint != leader.joint)) return {};
    sum = {leader.joint, sum.ratio + m.wrap_prm[w] * leader.ratio};
  }
  return sum.ratio == 0.0 ? Lever{} : sum;
}

void AddDrive(int u, MjcfImport* in) {
  const mjModel& m = in->m;
  const std::string name = in->NameOf(mjOBJ_ACTUATOR, u, "actuator");
  const int tendon = m.actuator_trntype[u] == mjTRN_TENDON ? m.actuator_trnid[2 * u] : -1;
  if (const auto leg = tendon >= 0 ? LegOf(tendon, *in) : std::nullopt) {
    if (!in->driven_tendons.insert(tendon).second) return;
    Drive drive{.name = name, .kind = *leg, .range = {}};
    if (m.tendon_limited[tendon] != 0 && !in->LimitsAreOff()) {
      drive.range = {m.tendon_range[2 * tendon], m.tendon_range[2 * tendon + 1]};
    }
    in->mechanism.drives.push_back(drive);
    return;
  }
  const int type = m.actuator_trntype[u], joint = LeverOf(u, *in).joint;
  const int j = joint < 0 ? -1 : in->joint_of[static_cast<size_t>(joint)];
  if (j < 0) {
    constexpr std::pair<int, const char*> kOthers[] = {{mjTRN_SLIDERCRANK, "slidersite"},
                                                       {mjTRN_TENDON, "tendon"},
                                                       {mjTRN_SITE, "site"},
                                                       {mjTRN_BODY, "body"}};
    const char* attribute = "joint";  // of a ball or free body
    for (const auto& [other, word] : kOthers) {
      if (type == other) attribute = word;
    }
    const bool on_joint = type == mjTRN_JOINT || type == mjTRN_JOINTINPARENT;
    in->LeaveOut(on_joint ? "actuator of a ball" : "actuator/general", attribute,
                 fmt::format("actuator '{}', which does not act on a hinge or slide,", name));
    return;
  }
  if (tendon >= 0 && m.tendon_limited[tendon] == 0) in->driven_tendons.insert(tendon);
  std::vector<Drive>& drives = in->mechanism.drives;
  const bool second = std::ranges::any_of(drives, [j](const Drive& drive) {
    const auto* on = std::get_if<JointDrive>(&drive.kind);
    return on != nullptr && on->joint == j;
  });
  if (second) return;
  drives.push_back({.name = name,
                    .kind = JointDrive{j, 0},
                    .range = in->mechanism.joints[static_cast<size_t>(j)].range[0]});
}

}  // namespace

void AddDrives(MjcfImport* in) {
  for (int u = 0; u < in->m.nu; ++u) AddDrive(u, in);
}

// Motors of an MJCF file: what its actuators can give at most.
//
//   F = Σ_u g_u f_u along the joint or tendon, g the gear, f the actuator's force (1) f = k c of a
//   motor (a gain k, no bias), c its control                                        (2)
//
// (of a fixed tendon L = Σ c_i q_i of joints q_i = r_i q, its gear times Σ c_i r_i)
//
// f is limited by forcerange, c by ctrlrange, and F by the joint's actuatorfrcrange. A position or
// velocity servo pushes as its error asks: only forcerange limits it. One actuator is the motor
// behind a gear n = |g|; several are one on the joint.

namespace {

constexpr double kUnlimited = Motor::kNoLimit;

// What pushes along a coordinate, with its sign.
struct Sides {
  double least = -kUnlimited, most = kUnlimited;

  [[nodiscard]] Sides Within(const Sides& other) const {
    return {std::max(least, other.least), std::min(most, other.most)};
  }
  [[nodiscard]] Sides Times(double factor) const {
    if (factor == 0.0) return {0.0, 0.0};
    return factor > 0.0 ? Sides{factor * least, factor * most}
                        : Sides{factor * most, factor * least};
  }
};

Sides SidesOf(const mjtNum* range) { return {range[0], range[1]}; }

// Of one actuator, ahead of its gear.
Sides LimitOf(const mjModel& m, int u) {
  Sides limit;
  if (m.actuator_forcelimited[u] != 0) limit = SidesOf(m.actuator_forcerange + 2 * u);
  const mjtNum* bias = m.actuator_biasprm + mjNBIAS * u;
  const bool no_bias =
      m.actuator_biastype[u] == mjBIAS_NONE || (m.actuator_biastype[u] == mjBIAS_AFFINE &&
                                                bias[0] == 0.0 && bias[1] == 0.0 && bias[2] == 0.0);
  const bool direct = m.actuator_dyntype[u] == mjDYN_NONE || m.actuator_dyntype[u] == mjDYN_FILTER;
  if (no_bias && direct && m.actuator_gaintype[u] == mjGAIN_FIXED &&
      m.actuator_ctrllimited[u] != 0) {
    const double gain = m.actuator_gainprm[mjNGAIN * u];
    limit = limit.Within(SidesOf(m.actuator_ctrlrange + 2 * u).Times(gain));
  }
  return limit;
}

// What moves a drive.
struct Movers {
  std::vector<std::pair<int, double>> actuators;  ///< each with its gear to the drive
  int joint = -1;                                 ///< MuJoCo's
};

Movers MoversOf(const Drive& drive, const MjcfImport& in) {
  const mjModel& m = in.m;
  Movers movers;
  const auto* on = std::get_if<JointDrive>(&drive.kind);
  int tendon = -1;
  for (int u = 0; u < m.nu && on == nullptr; ++u) {
    if (in.NameOf(mjOBJ_ACTUATOR, u, "actuator") == drive.name) tendon = m.actuator_trnid[2 * u];
  }
  for (int u = 0; u < m.nu; ++u) {
    const double gear = m.actuator_gear[6 * u];
    if (on == nullptr) {
      const bool moves = m.actuator_trntype[u] == mjTRN_TENDON && m.actuator_trnid[2 * u] == tendon;
      if (moves) movers.actuators.emplace_back(u, gear);
    } else if (const Lever lever = LeverOf(u, in);
               lever.joint >= 0 && in.joint_of[static_cast<size_t>(lever.joint)] == on->joint) {
      movers.actuators.emplace_back(u, gear * lever.ratio);
      movers.joint = lever.joint;
    }
  }
  return movers;
}

void AddMotor(size_t d, MjcfImport* in) {
  const mjModel& m = in->m;
  const Drive& drive = in->mechanism.drives[d];
  const Movers movers = MoversOf(drive, *in);
  Sides sides{0.0, 0.0};  // along the drive
  for (const auto& [u, gear] : movers.actuators) {
    if (gear == 0.0) continue;
    const Sides of = LimitOf(m, u).Times(gear);
    sides = {sides.least + of.least, sides.most + of.most};
  }
  if (movers.joint >= 0 && in->JointNumber(movers.joint, mjcf::UserNumber::kForceLimited) != 0.0) {
    sides = sides.Within({in->JointNumber(movers.joint, mjcf::UserNumber::kForceLower),
                          in->JointNumber(movers.joint, mjcf::UserNumber::kForceUpper)});
  }
  const bool alone = movers.actuators.size() == 1 && movers.actuators[0].second != 0.0;
  const double n = alone ? std::abs(movers.actuators[0].second) : 1.0;
  const bool unlimited = std::isinf(sides.least) && std::isinf(sides.most);
  if (!(sides.least < sides.most) || (unlimited && n == 1.0)) return;
  const auto* on = std::get_if<JointDrive>(&drive.kind);
  Motor motor;
  motor.drive = static_cast<int>(d);
  motor.turns = on != nullptr &&
                in->mechanism.joints[static_cast<size_t>(on->joint)].kind == JointKind::kRevolute;
  motor.gear_ratio = n;
  if (sides.least == -sides.most) {
    motor.peak = sides.most / n;
  } else {
    motor.least = sides.least / n;
    motor.most = sides.most / n;
  }
  in->mechanism.motors.push_back(std::move(motor));
}

}  // namespace

void AddMotors(MjcfImport* in) {
  for (size_t d = 0; d < in->mechanism.drives.size(); ++d) AddMotor(d, in);
}

// Force elements of an MJCF file.

namespace {

// Where the forces of one joint go: a hinge's or slide's coordinate, a ball's rotation, or a free
// joint's three coordinates and rotation.
void AddLaw(int j, const char* what, const auto& law, MjcfImport* in) {
  ForceElement element{
      .name = in->JointNameOf(j) + what, .joint = in->joint_of[static_cast<size_t>(j)], .law = law};
  std::vector<ForceElement>& elements = in->mechanism.elements;
  const JointKind kind = in->mechanism.joints[static_cast<size_t>(element.joint)].kind;
  if (!HasBall(kind)) {
    elements.push_back(std::move(element));
    return;
  }
  AddOfBall(element, kind, &elements);
  for (int k = 0; k < FirstOfBall(kind); ++k) {
    elements.push_back(element);
    elements.back().name += std::array{"_x", "_y", "_z"}.at(static_cast<size_t>(k));
    elements.back().coordinate = k;
  }
}

// Of a ball, between its frames; of a free joint, between the world and its body where the file
// places it. MuJoCo's moment is −k log R, as a bushing's of three equal stiffnesses.
void AddRoundSpring(int j, MjcfImport* in) {
  const mjModel& m = in->m;
  const bool free = m.jnt_type[j] == mjJNT_FREE;
  const mjtNum* spring = m.qpos_spring + m.jnt_qposadr[j];
  const Joint& joint =
      in->mechanism.joints[static_cast<size_t>(in->joint_of[static_cast<size_t>(j)])];
  in->mechanism.bushings.push_back({.name = joint.name + "_spring",
                                    .parent = joint.parent,
                                    .X_PF = free ? PoseAt(spring, spring + 3) : joint.X_PF,
                                    .child = joint.child,
                                    .X_CM = joint.X_CM});
  for (int k = free ? 0 : 3; k < 6; ++k) {
    ForceElement element{.name = joint.name + "_spring.",
                         .coordinate = k,
                         .bushing = static_cast<int>(in->mechanism.bushings.size()) - 1,
                         .law = SpringLaw{.polynomial = {m.jnt_stiffness[j]}}};
    element.name += BushingWord(element);
    in->mechanism.elements.push_back(std::move(element));
  }
}

void AddElementsOf(int j, MjcfImport* in) {
  const mjModel& m = in->m;
  const int dof = m.jnt_dofadr[j], at = m.jnt_qposadr[j];
  const bool passive = !in->IsOff(mjDSBL_PASSIVE);
  if (passive && m.dof_damping[dof] > 0.0) {
    AddLaw(j, "_damping", DampingLaw{m.dof_damping[dof]}, in);
  }
  if (passive && m.dof_damping[dof] < 0.0) in->driving.push_back(in->JointNameOf(j));
  if (passive && m.jnt_stiffness[j] != 0.0) {
    if (IsScalar(m, j)) {
      const double free = m.qpos_spring[at] - m.qpos0[at];
      AddLaw(j, "_spring", SpringLaw{.polynomial = {m.jnt_stiffness[j]}, .free = free}, in);
    } else {
      AddRoundSpring(j, in);
    }
  }
  if (const double loss = m.dof_frictionloss[dof]; loss > 0.0 && !in->FrictionIsOff()) {
    AddLaw(j, "_friction", FrictionLaw{.coulomb = loss, .breakaway = loss}, in);
  }
  if (m.dof_armature[dof] > 0.0) AddLaw(j, "_rotor", RotorLaw{.inertia = m.dof_armature[dof]}, in);
}

}  // namespace

// A spring and damper between two sites.
void AddSpring(int tendon, MjcfImport* in) {
  const mjModel& m = in->m;
  const auto leg = LegOf(tendon, *in);
  const double stiffness = m.tendon_stiffness[tendon], damping = m.tendon_damping[tendon];
  const bool acts = stiffness != 0.0 || damping != 0.0;
  if (!leg || !acts || in->IsOff(mjDSBL_PASSIVE)) return;
  in->sprung_tendons.insert(tendon);
  in->mechanism.springs.push_back({.name = in->NameOf(mjOBJ_TENDON, tendon, "tendon"),
                                   .body_from = leg->body_from,
                                   .p_from = leg->p_from,
                                   .body_to = leg->body_to,
                                   .p_to = leg->p_to,
                                   .stiffness = stiffness,
                                   .damping = damping,
                                   .free_length_m = m.tendon_lengthspring[tendon]});
}

void AddElements(MjcfImport* in) {
  for (int t = 0; t < in->m.ntendon; ++t) AddSpring(t, in);
  for (int j = 0; j < in->m.njnt; ++j) {
    // What a held body's free joint has does nothing.
    if (in->m.jnt_type[j] != mjJNT_FREE || in->moves[static_cast<size_t>(j)]) AddElementsOf(j, in);
  }
}

// MuJoCo 3 computes it if some body's is positive, and as long as it computes passive forces at
// all. A joint's actuator exerts the joint's part of it whatever else acts there.
void AddCompensation(MjcfImport* in) {
  const mjModel& m = in->m;
  const auto of = [in](int b) { return in->BodyNumber(b, mjcf::UserNumber::kGravityCompensation); };
  bool acts = false;
  for (int b = 1; b < m.nbody; ++b) acts = acts || of(b) > 0.0;
  if (!acts || in->IsOff(mjDSBL_PASSIVE)) return;
  for (int b = 1; b < m.nbody; ++b) in->BodyOf(b).gravity_compensation = of(b);
  for (int j = 0; j < m.njnt; ++j) {
    const bool exerted = in->JointNumber(j, mjcf::UserNumber::kExertedByActuator) != 0.0;
    if (!exerted || !IsScalar(m, j)) continue;
    for (Drive& drive : in->mechanism.drives) {
      const auto* on = std::get_if<JointDrive>(&drive.kind);
      if (on == nullptr || on->joint != in->joint_of[static_cast<size_t>(j)]) continue;
      drive.compensates_gravity = true;
    }
  }
}

// Closures and couplings of an MJCF file.

namespace {

Pose SitePose(const mjModel& m, const std::string& name) {
  const int s = IdOf(m, mjOBJ_SITE, name);
  return PoseAt(m.site_pos + 3 * s, m.site_quat + 4 * s);
}

void AddClosure(int e, const std::string& name, MjcfImport* in) {
  const mjModel& m = in->m;
  const mjtNum* data = m.eq_data + mjNEQDATA * e;
  const bool connect = m.eq_type[e] == mjEQ_CONNECT;
  Joint joint;
  joint.name = name;
  joint.closure = true;
  joint.kind = connect ? JointKind::kSpherical : JointKind::kFixed;
  joint.parent = in->body_of[static_cast<size_t>(m.eq_obj1id[e])];
  joint.child = in->body_of[static_cast<size_t>(m.eq_obj2id[e])];
  const auto sites = in->foreign.closures_by_sites().find(name);
  if (sites != in->foreign.closures_by_sites().end()) {
    joint.X_PF = SitePose(m, sites->second.first);
    joint.X_CM = SitePose(m, sites->second.second);
  } else if (connect) {
    joint.X_PF = Shifted(VecAt(data));
    joint.X_CM = Shifted(VecAt(data + 3));
  } else {
    joint.X_PF = PoseAt(data + 3, data + 6);
    joint.X_CM = Shifted(VecAt(data));
  }
  if (joint.parent == joint.child) {
    in->Say(fmt::format("equality '{}' connects a body with itself and is left out", name));
    return;
  }
  in->closure_of[static_cast<size_t>(e)] = static_cast<int>(in->mechanism.joints.size());
  in->mechanism.joints.push_back(joint);
}

// Adds P(q) of a joint; false if it has no such coordinate, or stands in the coupling twice.
bool AddTerm(const MjcfImport& in, int joint, const std::vector<double>& polynomial,
             Coupling* coupling) {
  const int type = in.m.jnt_type[joint];
  if (type != mjJNT_HINGE && type != mjJNT_SLIDE) return false;
  const int at = in.joint_of[static_cast<size_t>(joint)];
  const bool twice = std::ranges::any_of(
      coupling->terms, [at](const Coupling::Term& term) { return term.joint == at; });
  coupling->terms.push_back({.joint = at, .coordinate = 0, .polynomial = polynomial});
  return !twice;
}

// Adds c Σ c_k q_k of a fixed tendon.
bool AddTendon(int tendon, double factor, Coupling* coupling, MjcfImport* in) {
  const mjModel& m = in->m;
  const int first = m.tendon_adr[tendon];
  for (int w = first; w < first + m.tendon_num[tendon]; ++w) {
    if (m.wrap_type[w] != mjWRAP_JOINT) return false;
    if (!AddTerm(*in, m.wrap_objid[w], {factor * m.wrap_prm[w]}, coupling)) return false;
  }
  if (m.tendon_stiffness[tendon] == 0.0 && m.tendon_damping[tendon] == 0.0) {
    in->coupling_tendons.insert(tendon);
  }
  return true;
}

// q_1 = Σ_i a_i q_2^i of two joints or fixed tendons, all counted from the reference pose; of
// tendons only where it is linear.
bool AddSides(int e, Coupling* coupling, MjcfImport* in) {
  const mjModel& m = in->m;
  const mjtNum* a = m.eq_data + mjNEQDATA * e;
  const auto add = [&](int object, const std::vector<double>& polynomial) {
    if (m.eq_type[e] == mjEQ_JOINT) return AddTerm(*in, object, polynomial, coupling);
    return m.eq_type[e] == mjEQ_TENDON && polynomial.size() == 1 &&
           AddTendon(object, polynomial[0], coupling, in);
  };
  std::vector<double> polynomial(a + 1, a + 5);
  while (!polynomial.empty() && polynomial.back() == 0.0) polynomial.pop_back();
  coupling->constant = a[0];
  return add(m.eq_obj1id[e], {-1.0}) &&
         (m.eq_obj2id[e] < 0 || polynomial.empty() || add(m.eq_obj2id[e], polynomial));
}

void AddCoupling(int e, const std::string& name, MjcfImport* in) {
  Coupling coupling{.name = name};
  const mjModel& m = in->m;
  if (m.eq_type[e] == mjEQ_TENDON && m.eq_obj2id[e] < 0 &&
      in->driven_tendons.contains(m.eq_obj1id[e])) {
    in->Say(
        fmt::format("equality '{}', which holds tendon '{}' alone, is left out: its drive holds "
                    "the tendon",
                    name, in->NameOf(mjOBJ_TENDON, m.eq_obj1id[e], "tendon")));
  } else if (!AddSides(e, &coupling, in)) {
    const char* element = in->m.eq_type[e] == mjEQ_JOINT ? "equality/joint" : "equality/tendon";
    in->LeaveOut(element, "",
                 fmt::format("equality '{}' (couplings are known of hinges and slides, by a "
                             "polynomial or by linear fixed tendons)",
                             name));
  } else if (coupling.terms.size() == 1) {
    // A drive holds it as well; without one it is another mechanism.
    const int joint = coupling.terms[0].joint;
    const std::string text = fmt::format("equality '{}', which holds joint '{}' alone,", name,
                                         in->mechanism.joints[static_cast<size_t>(joint)].name);
    bool driven = false;
    for (int u = 0; u < in->m.nu; ++u) {
      const int type = in->m.actuator_trntype[u];
      if (type != mjTRN_JOINT && type != mjTRN_JOINTINPARENT) continue;
      driven = driven || in->joint_of[static_cast<size_t>(in->m.actuator_trnid[2 * u])] == joint;
    }
    if (driven) {
      in->Say(text + " is left out: its drive holds the joint");
    } else {
      in->LeaveOut("equality/joint", "", text);
    }
  } else {
    in->mechanism.couplings.push_back(coupling);
  }
}

}  // namespace

void AddEqualities(MjcfImport* in) {
  const mjModel& m = in->m;
  in->closure_of.assign(static_cast<size_t>(m.neq), -1);
  for (int e = 0; e < m.neq; ++e) {
    const std::string name = in->NameOf(mjOBJ_EQUALITY, e, "equality");
    if (m.eq_active[e] == 0 || in->EqualitiesAreOff()) {
      in->Say(fmt::format("equality '{}' is switched off in the file, and left out", name));
    } else if (m.eq_type[e] == mjEQ_CONNECT || m.eq_type[e] == mjEQ_WELD) {
      AddClosure(e, name, in);
    } else {
      AddCoupling(e, name, in);
    }
  }
}

// What a mechanism cannot express of an MJCF file.

namespace {

constexpr size_t kMost = 6;  // names that are reported

void LeaveOutOf(const char* element, const char* attribute, const char* what,
                const std::vector<std::string>& joints, MjcfImport* in) {
  if (joints.empty()) return;
  in->LeaveOut(element, attribute,
               fmt::format("{} of {} joint{} ({})", what, joints.size(),
                           joints.size() == 1 ? "" : "s", Joined(joints, kMost)));
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
  int tendons = 0;  // that do nothing
  for (int t = 0; t < m.ntendon; ++t) {
    for (const auto* used : {&in->coupling_tendons, &in->driven_tendons, &in->sprung_tendons}) {
      if (used->contains(t)) --tendons;
    }
    ++tendons;
  }
  bool acts = false;
  for (int t = 0; t < m.ntendon; ++t) {
    const bool passive = !in->IsOff(mjDSBL_PASSIVE) && !in->sprung_tendons.contains(t);
    const std::pair<const char*, bool> kinds[] = {
        {"stiffness", passive && m.tendon_stiffness[t] != 0.0},
        {"damping", passive && m.tendon_damping[t] != 0.0},
        {"frictionloss", !in->FrictionIsOff() && m.tendon_frictionloss[t] != 0.0},
        {"range",
         !in->LimitsAreOff() && m.tendon_limited[t] != 0 && !in->driven_tendons.contains(t)}};
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

void WarnNames(const MjcfImport& in, const char* text, const std::vector<std::string>& names,
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

void WarnWhatIsLost(MjcfImport* in) {
  LeaveOutFluid(in);
  LeaveOutOf("any joint", "damping", "the negative damping", in->driving, in);
  LeaveOutOf("limit without room", "range", "the limit", in->without_room, in);
  LeaveOutTendons(in);
  if (!in->held.empty()) {
    in->LeaveOut("body/freejoint", "", "the free joint of " + Joined(in->held, kMost));
  }
  if (!in->carried.empty()) {
    in->Say(fmt::format("{} free to move: loops or tendons carry what the file has on {}",
                        Joined(in->carried, kMost) + (in->carried.size() == 1 ? " is" : " are"),
                        in->carried.size() == 1 ? "a free joint" : "free joints"));
  }
  WarnNames(*in, "positions of these joints count from the file's reference (ref): ", in->shifted);
  WarnNames(*in, "zero is beyond the range of these joints, home is inside it: ", in->moved);
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

// Frames and shapes of an MJCF file.

namespace {

// "" for MuJoCo's default grey.
std::string ColorOf(const float* rgba) {
  if (rgba[0] == 0.5F && rgba[1] == 0.5F && rgba[2] == 0.5F) return "";
  const auto byte = [](float x) {
    return static_cast<int>(std::lround(255.0 * std::clamp(double{x}, 0.0, 1.0)));
  };
  return fmt::format("#{:02x}{:02x}{:02x}{:02x}", byte(rgba[0]), byte(rgba[1]), byte(rgba[2]),
                     byte(rgba[3]));
}

void AddMesh(int g, const mjcf::ForeignMesh& mesh, MjcfImport* in) {
  constexpr int kHidden = 3;  // groups from here on are switched off in MuJoCo's viewer
  const mjModel& m = in->m;
  const Mesh geometry{.X_BG = PoseAt(m.geom_pos + 3 * g, m.geom_quat + 4 * g) * mesh.X_GF,
                      .file = mesh.file,
                      .scale = mesh.scale,
                      .surface = std::make_shared<const TriangleMesh>()};
  std::vector<Shape>& shapes = in->BodyOf(m.geom_bodyid[g]).shapes;
  // The same mesh once more, to be touched.
  const bool again = std::ranges::any_of(shapes, [&](const Shape& other) {
    const auto* known = std::get_if<Mesh>(&other.geometry);
    return known != nullptr && known->file == geometry.file && known->scale == geometry.scale &&
           known->X_BG.isApprox(geometry.X_BG, 1e-12);
  });
  if (again || m.geom_group[g] >= kHidden) return;
  Shape shape{.geometry = geometry};
  if (const std::string color = ColorOf(m.geom_rgba + 4 * g); !color.empty()) shape.color = color;
  shapes.push_back(shape);
}

// Of a geom that MuJoCo draws by itself; empty for planes and others.
std::optional<Shape> SolidOf(const mjModel& m, int g) {
  const Pose X = PoseAt(m.geom_pos + 3 * g, m.geom_quat + 4 * g);
  const mjtNum* size = m.geom_size + 3 * g;
  const Vec3 half(0, 0, size[1]);
  switch (m.geom_type[g]) {
    case mjGEOM_SPHERE:
      return Shape{.geometry = Ball{X.translation(), size[0]}};
    case mjGEOM_CAPSULE:
      return Shape{.geometry = Capsule{X * Vec3(-half), X * half, size[0]}};
    case mjGEOM_CYLINDER:
      return Shape{.geometry = Cylinder{X * Vec3(-half), X * half, size[0]}};
    case mjGEOM_BOX:
      return Shape{.geometry = Box{X, 2.0 * VecAt(size)}};
    default:
      return std::nullopt;
  }
}

}  // namespace

void AddSites(MjcfImport* in) {
  const mjModel& m = in->m;
  for (int s = 0; s < m.nsite; ++s) {
    in->BodyOf(m.site_bodyid[s])
        .frames.push_back(
            {in->NameOf(mjOBJ_SITE, s, "site"), PoseAt(m.site_pos + 3 * s, m.site_quat + 4 * s)});
  }
}

void AddShapes(MjcfImport* in) {
  const mjModel& m = in->m;
  for (int g = 0; g < m.ngeom; ++g) {
    if (m.geom_contype[g] != 0 || m.geom_conaffinity[g] != 0) in->touching = true;
    const auto mesh = in->foreign.meshes().find(in->NameOf(mjOBJ_GEOM, g, "geom"));
    if (mesh != in->foreign.meshes().end()) {
      AddMesh(g, mesh->second, in);
      continue;
    }
    if (m.geom_bodyid[g] == 0) continue;  // floors
    if (auto solid = SolidOf(m, g)) in->BodyOf(m.geom_bodyid[g]).shapes.push_back(*solid);
  }
}

}  // namespace mbv::simulation
