#include "simulation/engine/loads.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include "math/spatial.h"
#include "mechanism/motion.h"
#include "mechanism/spanning_tree.h"
#include "simulation/engine/recorder.h"

namespace mbv::simulation {
namespace {

struct Value {
  double position = 0.0, rate = 0.0;
};

// Joint and coordinate that an input stands for; no joint: a distance drive or an output.
JointDrive JointOf(const Mechanism& mechanism, const Coordinate& coordinate) {
  const auto index = static_cast<size_t>(coordinate.index);
  if (coordinate.kind == Coordinate::Kind::kJoint) {
    return {coordinate.index, coordinate.component};
  }
  if (coordinate.kind == Coordinate::Kind::kPrescribed) {
    return {mechanism.prescribed[index].joint, 0};
  }
  const auto* driven = coordinate.kind == Coordinate::Kind::kDrive
                           ? std::get_if<JointDrive>(&mechanism.drives[index].kind)
                           : nullptr;
  return driven == nullptr ? JointDrive{} : *driven;
}

int JointId(const EngineModel& engine, const JointDrive& at) {
  const Joint& joint = engine.mechanism->joints[static_cast<size_t>(at.joint)];
  return mj_name2id(engine.m.get(), mjOBJ_JOINT, mjcf::JointName(joint, at.coordinate).c_str());
}

// A tendon's rate from its Jacobian: MuJoCo's own is not evaluated here.
Value OfTendon(const EngineModel& engine, const mjData& d, const std::string& name) {
  const int tendon = IdOf(*engine.m, mjOBJ_TENDON, name), nv = engine.m->nv;
  const Eigen::Map<const VecX> J(d.ten_J + tendon * nv, nv), qvel(d.qvel, nv);
  return {d.ten_length[tendon], J.dot(qvel)};
}

Value OfOutput(const EngineModel& engine, const mjData& d, const Coordinate& coordinate) {
  const Output& output = engine.mechanism->outputs[static_cast<size_t>(coordinate.index)];
  const auto pose = [&](int body) {
    return PoseOf(d, engine.body_id[static_cast<size_t>(engine.PlannedOf(body))]);
  };
  const Pose X_WR = pose(output.reference_body) * output.X_RbR;
  const Pose X_RO = X_WR.inverse(Eigen::Isometry) * pose(output.body) * output.X_BO;
  Vec6 position;
  position << X_RO.translation(), RpyOf(X_RO.linear());
  return {position[coordinate.component],
          OutputRatesOf(engine, d, output).velocity[coordinate.component]};
}

Value ValueOf(const EngineModel& engine, const mjData& d, const Coordinate& coordinate) {
  if (coordinate.kind == Coordinate::Kind::kOutput) return OfOutput(engine, d, coordinate);
  const JointDrive at = JointOf(*engine.mechanism, coordinate);
  if (at.joint < 0) {
    return OfTendon(engine, d,
                    engine.mechanism->drives[static_cast<size_t>(coordinate.index)].name);
  }
  const int id = JointId(engine, at);
  return {d.qpos[engine.m->jnt_qposadr[id]], d.qvel[engine.m->jnt_dofadr[id]]};
}

bool IsKnown(const EngineModel& engine, const Coordinate& coordinate) {
  if (coordinate.kind == Coordinate::Kind::kOutput) {
    return HasOutputRates(engine, engine.mechanism->outputs[static_cast<size_t>(coordinate.index)]);
  }
  const JointDrive at = JointOf(*engine.mechanism, coordinate);
  return at.joint < 0 || JointId(engine, at) >= 0;
}

}  // namespace

namespace {

RunSummary CheckInputs(const EngineModel& engine, const StateFunction& function,
                       const std::string& path) {
  for (const StateFunction::Input& input : function.inputs) {
    if (IsKnown(engine, input.coordinate)) continue;
    return {.stop = Stop::kUnsupported,
            .message = "the expression of " + path +
                       " follows a coordinate that MuJoCo does not have; the other witnesses take "
                       "it as it is",
            .where = path,
            .names_where = true};
  }
  return RunSummary::Done();
}

}  // namespace

FollowingLoads::FollowingLoads(const EngineModel& engine, const Motion& motion)
    : engine_(engine),
      motion_(motion),
      branching_(BranchingFunctions(*engine.mechanism, motion)),
      evaluated_(branching_.size()) {
  const auto add = [&](const StateFunction& function, std::vector<Angle>* angles) {
    for (const StateFunction::Input& input : function.inputs) {
      angles->push_back({.value = StartAngle(*engine.mechanism, motion, input.coordinate)});
    }
  };
  for (const Load& load : motion.loads) {
    std::vector<Angle>& angles = angles_.emplace_back();
    for (const Load::Following& part : load.following) add(part.function, &angles);
  }
  for (const DriveForce& force : motion.forces) {
    std::vector<Angle>& angles = angles_.emplace_back();
    if (force.following) add(*force.following, &angles);
  }
}

double FollowingLoads::Read(const StateFunction::Input& input, const mjData& d, double t_s,
                            Angle* angle) const {
  const Value value = ValueOf(engine_, d, input.coordinate);
  if (input.rate) return value.rate;
  const bool counts = input.coordinate.kind != Coordinate::Kind::kOutput;
  if (counts || IsLength(*engine_.mechanism, input.coordinate)) return value.position;
  // From there by the mean of the rates.
  double near = angle->value;
  if (!std::isnan(angle->time_s)) {
    near += 0.5 * (angle->rate + value.rate) * (t_s - angle->time_s);
  }
  const double turned = near + std::remainder(value.position - near, 2.0 * std::numbers::pi);
  if (std::isfinite(turned) && std::isfinite(value.rate)) *angle = {t_s, turned, value.rate};
  return turned;
}

double FollowingLoads::FunctionAt(const StateFunction& function, const std::string& path,
                                  const mjData& d, double t_s, Angle* angle) {
  std::vector<double> inputs;
  for (const StateFunction::Input& input : function.inputs) {
    inputs.push_back(Read(input, d, t_s, angle++));
  }
  int branch = kAnyBranch;
  Evaluated* last = nullptr;
  if (function.branch) {
    const auto of = std::ranges::find(branching_, &function, &BranchingFunction::function);
    const auto at = static_cast<size_t>(of - branching_.begin());
    last = &evaluated_[at];
    if (!fixed_.empty()) branch = fixed_[at];
  }
  double value = function.At(t_s, inputs, branch);
  if (!std::isfinite(value)) {  // left out: the run ends, and MuJoCo gets numbers until then
    if (trouble_.ok()) {
      trouble_ = HasNoValue(*engine_.mechanism, path, function, t_s, inputs, value);
    }
    value = 0.0;
  }
  if (last != nullptr) *last = {t_s, std::move(inputs)};
  return value;
}

std::vector<int> FollowingLoads::Branches() const {
  std::vector<int> branches;
  for (size_t k = 0; k < branching_.size(); ++k) {
    branches.push_back(branching_[k].function->branch(evaluated_[k].time_s, evaluated_[k].inputs));
  }
  return branches;
}

Vec6 FollowingLoads::PartOf(size_t l, const mjData& d, double t_s) {
  Vec6 sum = Vec6::Zero();
  Angle* angle = angles_[l].data();
  const Load& load = motion_.loads[l];
  for (const Load::Following& part : load.following) {
    sum[part.component] += FunctionAt(part.function, PathOf(load, part), d, t_s, angle);
    angle += part.function.inputs.size();
  }
  return sum;
}

double FollowingLoads::ForceOf(size_t k, const mjData& d, double t_s) {
  const DriveForce& force = motion_.forces[k];
  if (!force.following) return 0.0;
  return FunctionAt(*force.following, PathOf(*engine_.mechanism, force), d, t_s,
                    angles_[motion_.loads.size() + k].data());
}

RunSummary CheckLoads(const EngineModel& engine, const Motion& motion) {
  for (const DriveForce& force : motion.forces) {
    if (!force.following) continue;
    RunSummary summary = CheckInputs(engine, *force.following, PathOf(*engine.mechanism, force));
    if (!summary.ok()) return summary;
  }
  for (const Load& load : motion.loads) {
    if (engine.PlannedOf(load.body) >= 0) {
      for (const Load::Following& part : load.following) {
        RunSummary summary = CheckInputs(engine, part.function, PathOf(load, part));
        if (!summary.ok()) return summary;
      }
      continue;
    }
    return {.stop = Stop::kUnsupported,
            .message = "load '" + load.name + "' acts on the massless body '" +
                       engine.mechanism->bodies[load.body].name + "'",
            .where = load.name,
            .names_where = true};
  }
  return RunSummary::Done();
}

void Loads::Evaluate(double t_s, const mjData& d) {
  world_.resize(motion_.loads.size());
  for (size_t i = 0; i < world_.size(); ++i) {
    const Load& load = motion_.loads[i];
    WorldLoad& out = world_[i];
    out.body_id = engine_.body_id[engine_.PlannedOf(load.body)];
    const Pose X_WB = PoseOf(d, out.body_id);
    out.p_WQ = X_WB * load.p_BoQ_B;
    for (int c = 0; c < 3; ++c) {
      out.force[c] = mbv::Evaluate(load.force[c], t_s).value;
      out.moment[c] = mbv::Evaluate(load.moment[c], t_s).value;
    }
    if (!load.following.empty()) {
      const Vec6 part = following_.PartOf(i, d, t_s);
      out.force += part.head<3>();
      out.moment += part.tail<3>();
    }
    if (!load.in_body_axes) continue;
    out.force = X_WB.linear() * out.force;
    out.moment = X_WB.linear() * out.moment;
  }
  given_.resize(motion_.forces.size());
  for (size_t k = 0; k < given_.size(); ++k) {
    given_[k] = mbv::Evaluate(motion_.forces[k].force, t_s).value + following_.ForceOf(k, d, t_s);
  }
  if (compensates_) AddCompensation(d);
}

Loads::Loads(const EngineModel& engine, const Motion& motion)
    : engine_(engine),
      motion_(motion),
      following_(engine, motion),
      compensates_(HasGravityCompensation(*engine.mechanism)) {
  const Mechanism& mechanism = *engine.mechanism;
  for (size_t d = 0; d < mechanism.drives.size() && compensates_; ++d) {
    if (!mechanism.drives[d].compensates_gravity) continue;
    const int joint = std::get<JointDrive>(mechanism.drives[d].kind).joint;
    const auto at = std::ranges::find(mechanism.tree_joints, joint);
    const bool reversed =
        mechanism.tree_reversed[static_cast<size_t>(at - mechanism.tree_joints.begin())];
    exerted_by_drives_.push_back({.joint_id = engine.driven[d].object,
                                  .sign = reversed ? -1.0 : 1.0,
                                  .beyond = BodiesBeyond(mechanism, joint)});
    joint_forces_.push_back({.driven = d, .dof = engine.driven[d].dof});
  }
}

// MuJoCo has it since 3.0 as gravcomp; here it acts as loads on bodies. What a drive exerts of it
// is taken away along the joint's axis, which points against the mechanism's where the joint is
// reversed.
void Loads::AddCompensation(const mjData& d) {
  const Mechanism& mechanism = *engine_.mechanism;
  const Vec3 g(engine_.m->opt.gravity);
  std::vector<WorldLoad> of(mechanism.bodies.size());
  for (size_t b = 1; b < of.size(); ++b) {
    const Body& body = mechanism.bodies[b];
    const double carried = body.gravity_compensation * body.mass;
    if (carried == 0.0) continue;
    of[b].body_id = engine_.body_id[static_cast<size_t>(engine_.PlannedOf(static_cast<int>(b)))];
    of[b].p_WQ = Vec3(d.xipos + 3 * of[b].body_id);
    of[b].force = -carried * g;
    world_.push_back(of[b]);
  }
  for (size_t k = 0; k < exerted_by_drives_.size(); ++k) {
    const ExertedByDrive& drive = exerted_by_drives_[k];
    const Vec3 axis(d.xaxis + 3 * drive.joint_id), anchor(d.xanchor + 3 * drive.joint_id);
    const bool slides = engine_.m->jnt_type[drive.joint_id] == mjJNT_SLIDE;
    double sum = 0.0;
    for (const int b : drive.beyond) {
      const WorldLoad& load = of[static_cast<size_t>(b)];
      sum += axis.dot(slides ? load.force : Vec3((load.p_WQ - anchor).cross(load.force)));
    }
    joint_forces_[k].force = -drive.sign * sum;
  }
}

bool Loads::follow() const {
  const auto is_following = [](const DriveForce& force) { return force.following.has_value(); };
  const auto has_following = [](const Load& load) { return !load.following.empty(); };
  return compensates_ || std::ranges::any_of(motion_.loads, has_following) ||
         std::ranges::any_of(motion_.forces, is_following);
}

void Loads::AddGeneralized(mjData* d, double* qfrc) const {
  for (const WorldLoad& load : world_) {
    mj_applyFT(engine_.m.get(), d, load.force.data(), load.moment.data(), load.p_WQ.data(),
               load.body_id, qfrc);
  }
  for (const JointForce& force : joint_forces_) qfrc[force.dof] += force.force;
}

}  // namespace mbv::simulation
