#include "features/equation_audit/stiffness_truth.h"

#include <algorithm>

#include "base/demand.h"
#include "model_file/load_model.h"
#include "reference/frame_stiffness.h"
#include "reference/reference.h"

namespace mbv::stiffness_audit {
namespace {

Coordinate CoordinateOf(const Mechanism& mechanism, const std::string& name) {
  if (const int drive = mechanism.FindDrive(name); drive >= 0) {
    return {Coordinate::Kind::kDrive, drive, 0};
  }
  const size_t dot = name.rfind('.');
  const int output = mechanism.FindOutput(name.substr(0, dot));
  const auto component =
      std::find(kPoseComponents.begin(), kPoseComponents.end(), name.substr(dot + 1));
  MBV_DEMAND(output >= 0 && component != kPoseComponents.end(), name);
  return {Coordinate::Kind::kOutput, output, static_cast<int>(component - kPoseComponents.begin())};
}

Joint& JointOf(Mechanism* mechanism, const std::string& name) {
  const auto found = std::find_if(mechanism->joints.begin(), mechanism->joints.end(),
                                  [&](const Joint& joint) { return joint.name == name; });
  MBV_DEMAND(found != mechanism->joints.end(), name);
  return *found;
}

StiffnessResult FrameAt(Mechanism mechanism, const std::vector<Pose>& X_WB, const std::string& body,
                        const Vec3& p_BoQ_B) {
  Output output;
  output.name = "audited";
  output.body = mechanism.FindBody(body);
  MBV_DEMAND(output.body > 0, body);
  output.X_BO = Pose::Identity();
  output.X_BO.translation() = p_BoQ_B;
  mechanism.outputs.push_back(output);
  return FrameStiffness(mechanism, X_WB, static_cast<int>(mechanism.outputs.size()) - 1);
}

StiffnessResult Cantilever(const Beam& like, double length) {
  Mechanism mechanism;
  mechanism.name = "cantilever";
  mechanism.bodies.resize(2);
  mechanism.bodies[0].name = "world";
  mechanism.bodies[1].name = "beam";
  Joint clamp;
  clamp.name = "clamp";
  clamp.kind = JointKind::kFixed;
  clamp.child = 1;
  mechanism.joints.push_back(clamp);
  Beam beam = like;
  beam.body = 1;
  beam.p_from = Vec3::Zero();
  beam.p_to = Vec3(length, 0, 0);
  beam.R_BE = Mat3::Identity();
  mechanism.beams.push_back(beam);
  const std::vector<Pose> X_WB(2, Pose::Identity());
  return FrameAt(mechanism, X_WB, "beam", beam.p_to);
}

}  // namespace

Mechanism LoadElastic(const std::string& models_dir, const std::string& name,
                      const std::map<std::string, double>& parameters) {
  LoadOptions options;
  for (const auto& [parameter, value] : parameters) options.overrides[parameter] = value;
  LoadResult model = LoadModel(models_dir + "/" + name + "/elastic.yaml", options);
  MBV_DEMAND(model.mechanism.has_value(), model.diagnostics.Text());
  return *std::move(model.mechanism);
}

std::vector<Pose> PosesAt(const Mechanism& mechanism, const std::map<std::string, double>& pose) {
  Motion motion;
  for (const auto& [name, value] : pose) {
    Command command;
    command.name = name;
    command.terms = {{CoordinateOf(mechanism, name), 1.0}};
    command.profile = Constant(value);
    motion.commands.push_back(command);
  }
  CommandSample command;
  EvaluateMotion(motion, 0.0, &command);
  ReferenceSample sample;
  const RunSummary summary = ReferenceSolver(mechanism, motion).Kinematics(command, &sample);
  MBV_DEMAND(summary.ok(), summary.message);
  return sample.states.X_WB;
}

Mechanism Opened(Mechanism mechanism, const std::vector<std::string>& joints) {
  for (const std::string& name : joints) JointOf(&mechanism, name).kind = JointKind::kFree;
  return mechanism;
}

Mechanism Clamped(Mechanism mechanism, const std::string& name, const std::vector<Pose>& X_WB) {
  Joint& joint = JointOf(&mechanism, name);
  joint.kind = JointKind::kFixed;
  joint.parent = 0;
  joint.X_PF = X_WB[static_cast<size_t>(joint.child)] * joint.X_CM;
  return mechanism;
}

Mat6 StiffnessAt(const Mechanism& mechanism, const std::vector<Pose>& X_WB, const std::string& body,
                 const Vec3& p_BoQ_B) {
  return FrameAt(mechanism, X_WB, body, p_BoQ_B).K;
}

Mat6 ComplianceAt(const Mechanism& mechanism, const std::vector<Pose>& X_WB,
                  const std::string& body, const Vec3& p_BoQ_B) {
  return FrameAt(mechanism, X_WB, body, p_BoQ_B).C;
}

Mat6 CantileverStiffness(const Beam& like, double length) { return Cantilever(like, length).K; }
Mat6 CantileverCompliance(const Beam& like, double length) { return Cantilever(like, length).C; }

Mat6 InAxes(const Mat6& M_W, const Mat3& R_WE) {
  Mat6 R = Mat6::Zero();
  R.topLeftCorner<3, 3>() = R.bottomRightCorner<3, 3>() = R_WE;
  return R.transpose() * M_W * R;
}

void AddMatrix(RowMeter* meter, MatrixKind kind, double length, const Mat6& truth,
               const Mat6& printed, const Mat6& corrected) {
  Vec6 scale = Vec6::Ones();
  scale.head<3>().setConstant(kind == MatrixKind::kStiffness ? 1.0 / length : length);
  for (int r = 0; r < 6; ++r) {
    for (int c = 0; c < 6; ++c) {
      const double unit = scale[r] * scale[c];
      meter->Add(unit * truth(r, c), unit * printed(r, c), unit * corrected(r, c));
    }
  }
}

}  // namespace mbv::stiffness_audit
