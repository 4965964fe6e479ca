#include "analytic/coverage.h"

#include <fmt/format.h>
#include <algorithm>
#include <cmath>

namespace mbv {

double ParameterReader::operator()(const std::string& name) const {
  if (mechanism_.HasParameter(name)) return mechanism_.ParameterValue(name);
  auto& missing = coverage_->missing;
  if (std::find(missing.begin(), missing.end(), name) == missing.end()) missing.push_back(name);
  return kNan;
}

double ParameterReader::operator()(const std::string& name, double fallback) const {
  return mechanism_.HasParameter(name) ? mechanism_.ParameterValue(name) : fallback;
}

Vec3 ParameterReader::Vector(const std::string& stem) const {
  return {(*this)(stem + "_x"), (*this)(stem + "_y"), (*this)(stem + "_z")};
}

Vec3 ParameterReader::Vector(const std::string& stem, double fallback) const {
  return {(*this)(stem + "_x", fallback), (*this)(stem + "_y", fallback),
          (*this)(stem + "_z", fallback)};
}

Vec3 HomeAxis(const Mechanism& mechanism, const std::string& body, int axis) {
  const int index = mechanism.FindBody(body);
  if (index < 0 || mechanism.X_WB_home.size() != mechanism.bodies.size()) return kAnyVector;
  return mechanism.X_WB_home[static_cast<size_t>(index)].linear().col(axis);
}

void StateBranch(const std::string& subject, double value, const std::string& why,
                 Coverage* coverage) {
  if (std::isnan(value)) return;
  coverage->numbers.push_back({.subject = subject,
                               .quantity = "branch at home",
                               .actual = value > 0.0 ? 1.0 : -1.0,
                               .assumed = 1.0,
                               .why = why});
}

std::vector<Finding> FindUncoveredLoads(const Coverage& coverage, const Mechanism& mechanism,
                                        const Motion& motion) {
  std::string takers;
  for (const AssumedBody& body : coverage.bodies) {
    if (body.takes_loads) takers += (takers.empty() ? "" : ", ") + body.name;
  }
  std::vector<Finding> findings;
  for (const Switch& one : motion.switches) {
    if (one.body < 0) continue;
    findings.push_back({.severity = Severity::kWarning,
                        .message = fmt::format("the mass of {} changes over time", one.name),
                        .hint = coverage.form + " takes constant masses"});
  }
  for (const Load& load : motion.loads) {
    const std::string& name = mechanism.bodies[size_t(load.body)].name;
    const bool taken =
        std::any_of(coverage.bodies.begin(), coverage.bodies.end(),
                    [&](const AssumedBody& body) { return body.name == name && body.takes_loads; });
    if (!load.following.empty()) {
      findings.push_back(
          {.severity = Severity::kWarning,
           .message = fmt::format("load {} follows the mechanism's state", load.name),
           .hint = coverage.form + " takes loads as functions of time"});
      continue;
    }
    if (taken) continue;
    findings.push_back({.severity = Severity::kWarning,
                        .message = fmt::format("load {} acts on {}", load.name, name),
                        .hint = fmt::format("{} takes loads on {}", coverage.form, takers)});
  }
  return findings;
}

std::string ReasonNotApplicable(std::span<const Finding> uncovered) {
  if (uncovered.empty()) return {};
  std::string text = fmt::format("outside what the equations cover: {}; {}", uncovered[0].message,
                                 uncovered[0].hint);
  if (uncovered.size() > 1) text += fmt::format(" (and {} more)", uncovered.size() - 1);
  return text;
}

namespace {

// Relative deviation that changes no result beyond the round-off of typed and exported numbers.
constexpr double kNegligible = 1e-9;

constexpr const char* kAxes[] = {"x", "y", "z"};

bool SameDirection(const Vec3& a, const Vec3& b, bool any_sense) {
  if (any_sense) return a.cross(b).norm() <= kNegligible;
  return (a - b).norm() <= kNegligible;
}

std::string TextOf(const Vec3& v) {
  return fmt::format("({:.6g}, {:.6g}, {:.6g})", v.x(), v.y(), v.z());
}

template <typename Named>
const Named* Find(const std::vector<Named>& all, const std::string& name) {
  const auto found =
      std::find_if(all.begin(), all.end(), [&](const Named& one) { return one.name == name; });
  return found == all.end() ? nullptr : &*found;
}

class Checker {
 public:
  Checker(const Coverage& coverage, const Mechanism& mechanism, Concern concern)
      : coverage_(coverage), mechanism_(mechanism), concern_(concern) {
    for (const AssumedJoint& joint : coverage.joints) {
      for (const Vec3* p : {&joint.p_parent, &joint.p_child}) {
        if (p->allFinite()) length_ = std::max(length_, p->norm());
      }
    }
    if (length_ == 0.0) length_ = 1.0;
  }

  std::vector<Finding> Run() {
    if (!Parameters()) return std::move(findings_);
    for (const AssumedNumber& number : coverage_.numbers) {
      if (!number.inertial || Masses()) Number(number);
    }
    for (const AssumedJoint& joint : coverage_.joints) CheckJoint(joint);
    for (const AssumedBody& body : coverage_.bodies) CheckBody(body);
    for (const AssumedDrive& drive : coverage_.drives) CheckDrive(drive);
    for (const AssumedDrive& drive : coverage_.prescribed) CheckPrescribed(drive);
    for (const AssumedOutput& output : coverage_.outputs) CheckOutput(output);
    if (concern_ == Concern::kStiffness) {
      for (const AssumedBeam& beam : coverage_.beams) CheckBeam(beam);
    }
    CheckExtraParts();
    return std::move(findings_);
  }

 private:
  [[nodiscard]] bool Masses() const { return concern_ == Concern::kDynamics; }

  void Add(const std::string& fact, const std::string& assumption) {
    findings_.push_back({.severity = Severity::kWarning,
                         .message = fact,
                         .hint = fmt::format("{} {}", coverage_.form, assumption)});
  }

  bool Parameters() {
    for (const std::string& name : coverage_.missing) {
      Add(fmt::format("parameter {} is missing", name), "reads it by this name");
    }
    return coverage_.missing.empty();
  }

  void Number(const AssumedNumber& n) {
    if (std::isnan(n.assumed) || std::abs(n.actual - n.assumed) <= kNegligible * n.scale) return;
    const std::string unit = n.unit.empty() ? "" : " " + n.unit;
    Add(fmt::format("{}: {} is {:.6g}{}", n.subject, n.quantity, n.actual, unit),
        fmt::format("takes {:.6g}{}{}", n.assumed, unit, n.why.empty() ? "" : ": " + n.why));
  }

  void Vector(const std::string& subject, const std::string& quantity, const Vec3& actual,
              const Vec3& assumed, double scale, const char* unit, const std::string& why) {
    for (int c = 0; c < 3; ++c) {
      Number({.subject = subject,
              .quantity = fmt::format("{} {}", quantity, kAxes[c]),
              .actual = actual[c],
              .assumed = assumed[c],
              .scale = scale,
              .unit = unit,
              .why = why});
    }
  }

  void CheckBody(const AssumedBody& assumed) {
    const int index = mechanism_.FindBody(assumed.name);
    const std::string subject = "body " + assumed.name;
    if (index < 0) {
      Add(subject + " is missing", "moves it");
      return;
    }
    if (!Masses()) return;
    const Body& body = mechanism_.bodies[size_t(index)];
    Number({.subject = subject,
            .quantity = "mass",
            .actual = body.mass,
            .assumed = assumed.mass,
            .scale = std::max(std::abs(body.mass), std::abs(assumed.mass)),
            .unit = "kg",
            .why = assumed.why});
    // The centre of mass of nothing is nowhere.
    if (body.mass > 0.0 || assumed.mass > 0.0) {
      Vector(subject, "centre of mass", body.p_BoBcm_B, assumed.com, length_, "m", assumed.why);
    }
    CheckInertia(subject, body, assumed);
  }

  void CheckInertia(const std::string& subject, const Body& body, const AssumedBody& assumed) {
    double scale = body.I_Bcm_B.cwiseAbs().maxCoeff();
    for (int k = 0; k < 9; ++k) {
      const double entry = assumed.inertia.data()[k];
      if (std::isfinite(entry)) scale = std::max(scale, std::abs(entry));
    }
    for (int i = 0; i < 3; ++i) {
      for (int j = i; j < 3; ++j) {
        Number({.subject = subject,
                .quantity = fmt::format("inertia {}{}", kAxes[i], kAxes[j]),
                .actual = body.I_Bcm_B(i, j),
                .assumed = assumed.inertia(i, j),
                .scale = scale,
                .unit = "kg m^2",
                .why = assumed.why});
      }
    }
  }

  void CheckJoint(const AssumedJoint& assumed) {
    const std::string subject = "joint " + assumed.name;
    const int index = mechanism_.FindJoint(assumed.name);
    if (index < 0) {
      Add(subject + " is missing",
          fmt::format("has it between {} and {}", assumed.parent, assumed.child));
      return;
    }
    const Joint& joint = mechanism_.joints[size_t(index)];
    if (joint.kind != assumed.kind) {
      Add(fmt::format("{} is {}", subject, WordOf(joint.kind)),
          fmt::format("takes it as {}", WordOf(assumed.kind)));
      return;
    }
    const std::string& parent = mechanism_.bodies[size_t(joint.parent)].name;
    const std::string& child = mechanism_.bodies[size_t(joint.child)].name;
    const bool exchanged = parent == assumed.child && child == assumed.parent;
    if (!(parent == assumed.parent && child == assumed.child) &&
        !(exchanged && assumed.reversible)) {
      Add(fmt::format("{} leads from {} to {}", subject, parent, child),
          fmt::format("has it from {} to {}", assumed.parent, assumed.child));
      return;
    }
    CheckFrames(subject, joint, assumed, exchanged);
  }

  void CheckFrames(const std::string& subject, const Joint& joint, const AssumedJoint& assumed,
                   bool exchanged) {
    const Pose& X_P = exchanged ? joint.X_CM : joint.X_PF;
    const Pose& X_C = exchanged ? joint.X_PF : joint.X_CM;
    const bool universal = joint.kind == JointKind::kUniversal;
    const Vec3 first = joint.axis, second = universal ? joint.axis2 : joint.axis;
    Vector(subject, "centre on " + assumed.parent + ",", X_P.translation(), assumed.p_parent,
           length_, "m", "");
    Vector(subject, "centre on " + assumed.child + ",", X_C.translation(), assumed.p_child, length_,
           "m", "");
    CheckAxis(subject, assumed.parent, X_P.linear() * (exchanged ? second : first),
              assumed.axis_parent, assumed.reversible);
    CheckAxis(subject, assumed.child, X_C.linear() * (exchanged ? first : second),
              assumed.axis_child, assumed.reversible);
    if (!assumed.R_zero.allFinite()) return;
    const Mat3 R_zero = X_P.linear() * X_C.linear().transpose();
    const double angle = Eigen::AngleAxisd(assumed.R_zero.transpose() * R_zero).angle();
    Number({.subject = subject,
            .quantity = fmt::format("orientation of {} on {} at zero, off by", assumed.child,
                                    assumed.parent),
            .actual = angle,
            .assumed = 0.0,
            .unit = "rad"});
  }

  void CheckAxis(const std::string& subject, const std::string& body, const Vec3& actual,
                 const Vec3& assumed, bool any_sense) {
    if (!assumed.allFinite() || SameDirection(actual, assumed, any_sense)) return;
    Add(fmt::format("{}: the axis on {} is {}", subject, body, TextOf(actual)),
        fmt::format("has it along {}", TextOf(assumed)));
  }

  void CheckDrive(const AssumedDrive& assumed) {
    const std::string subject = "drive " + assumed.name;
    const Drive* drive = Find(mechanism_.drives, assumed.name);
    if (drive == nullptr) {
      Add(subject + " is missing", "computes its force");
      return;
    }
    if (concern_ == Concern::kStiffness) {
      Number({.subject = subject,
              .quantity = "compliance of the servo",
              .actual = 1.0 / drive->stiffness,
              .assumed = 1.0 / assumed.stiffness,
              .scale = 1.0 / std::min(drive->stiffness, assumed.stiffness),
              .unit = "per N or N m"});
    }
    if (const auto* on_joint = std::get_if<JointDrive>(&drive->kind)) {
      const std::string& joint = mechanism_.joints[size_t(on_joint->joint)].name;
      if (joint == assumed.joint) return;
      Add(fmt::format("{} acts on joint {}", subject, joint),
          assumed.joint.empty() ? "has it between two points" : "has it on " + assumed.joint);
      return;
    }
    const auto& between = std::get<DistanceDrive>(drive->kind);
    if (!assumed.joint.empty()) {
      Add(subject + " acts between two points", "has it on joint " + assumed.joint);
      return;
    }
    CheckEnds(subject, between, assumed);
  }

  void CheckEnds(const std::string& subject, const DistanceDrive& between,
                 const AssumedDrive& assumed) {
    const std::string& from = mechanism_.bodies[size_t(between.body_from)].name;
    const std::string& to = mechanism_.bodies[size_t(between.body_to)].name;
    const bool exchanged = from == assumed.body_to && to == assumed.body_from;
    if (!exchanged && (from != assumed.body_from || to != assumed.body_to)) {
      Add(fmt::format("{} leads from {} to {}", subject, from, to),
          fmt::format("has it from {} to {}", assumed.body_from, assumed.body_to));
      return;
    }
    Vector(subject, "end on " + assumed.body_from + ",", exchanged ? between.p_to : between.p_from,
           assumed.p_from, length_, "m", "");
    Vector(subject, "end on " + assumed.body_to + ",", exchanged ? between.p_from : between.p_to,
           assumed.p_to, length_, "m", "");
  }

  void CheckPrescribed(const AssumedDrive& assumed) {
    const std::string subject = "prescribed " + assumed.name;
    const Prescribed* prescribed = Find(mechanism_.prescribed, assumed.name);
    if (prescribed == nullptr) {
      Add(subject + " is missing", "follows it");
      return;
    }
    const std::string& joint = mechanism_.joints[size_t(prescribed->joint)].name;
    if (joint == assumed.joint) return;
    Add(fmt::format("{} moves joint {}", subject, joint), "moves " + assumed.joint + " by it");
  }

  void CheckOutput(const AssumedOutput& assumed) {
    const std::string subject = "output " + assumed.name;
    const Output* output = Find(mechanism_.outputs, assumed.name);
    if (output == nullptr) {
      Add(subject + " is missing", "gives its pose");
      return;
    }
    const std::string& body = mechanism_.bodies[size_t(output->body)].name;
    if (body != assumed.body || output->reference_body != 0) {
      Add(fmt::format("{} is on {}, seen from {}", subject, body,
                      mechanism_.bodies[size_t(output->reference_body)].name),
          fmt::format("gives the pose of {} in the world", assumed.body));
      return;
    }
    const auto offset = [&](const Pose& X, const char* of) {
      Vector(subject, std::string("origin of the ") + of + " frame,", X.translation(), Vec3::Zero(),
             length_, "m", "body frames");
      Number({.subject = subject,
              .quantity = std::string("turn of the ") + of + " frame",
              .actual = Eigen::AngleAxisd(X.linear()).angle(),
              .assumed = 0.0,
              .unit = "rad",
              .why = "body frames"});
    };
    offset(output->X_BO, "body's");
    offset(output->X_RbR, "world's");
  }

  void CheckBeam(const AssumedBeam& assumed) {
    const std::string subject = "beam " + assumed.name;
    const Beam* beam = Find(mechanism_.beams, assumed.name);
    if (beam == nullptr) {
      Add(subject + " is missing", "deforms it");
      return;
    }
    const auto compare = [&](const char* quantity, double actual, double value, const char* unit) {
      Number({.subject = subject,
              .quantity = quantity,
              .actual = actual,
              .assumed = value,
              .scale = std::max(std::abs(actual), std::abs(value)),
              .unit = unit});
    };
    compare("length", beam->length(), assumed.length, "m");
    compare("area", beam->section.area, assumed.section.area, "m^2");
    compare("I_y", beam->section.I_y, assumed.section.I_y, "m^4");
    compare("I_z", beam->section.I_z, assumed.section.I_z, "m^4");
    compare("torsion constant", beam->section.torsion, assumed.section.torsion, "m^4");
    compare("Young's modulus", beam->youngs_modulus, assumed.youngs_modulus, "Pa");
    compare("shear modulus", beam->shear_modulus, assumed.shear_modulus, "Pa");
  }

  // What else the mechanism has.
  void CheckExtraParts() {
    for (size_t b = 1; b < mechanism_.bodies.size(); ++b) {
      const Body& body = mechanism_.bodies[b];
      if (Find(coverage_.bodies, body.name) != nullptr || IsOrnament(static_cast<int>(b))) continue;
      Add(fmt::format("body {} of {:.6g} kg", body.name, body.mass), "does not know it");
    }
    for (const Joint& joint : mechanism_.joints) {
      if (joint.kind == JointKind::kFree || Find(coverage_.joints, joint.name) != nullptr) continue;
      if (IsOrnament(joint.child) || IsOrnament(joint.parent)) continue;
      Add(fmt::format("joint {} between {} and {}", joint.name,
                      mechanism_.bodies[size_t(joint.parent)].name,
                      mechanism_.bodies[size_t(joint.child)].name),
          "does not know it");
    }
    for (const SpringDamper& spring : mechanism_.springs) {
      Add(fmt::format("spring-damper {} of {:.6g} N/m and {:.6g} N s/m", spring.name,
                      spring.stiffness, spring.damping),
          "has no springs and dampers");
    }
    for (const Body& body : mechanism_.bodies) {
      if (body.gravity_compensation == 0.0) continue;
      Add(fmt::format("gravity compensation {:.6g} of body {}", body.gravity_compensation,
                      body.name),
          "has bodies whose whole weight acts");
    }
    for (const Coupling& coupling : mechanism_.couplings) {
      Add("coupling " + coupling.name, "has no couplings");
    }
    for (const ForceElement& element : mechanism_.elements) {
      Add(fmt::format("element {}, {}", element.name, Described(mechanism_, element)),
          "has no damping, springs, rotors, friction, stops and curves");
    }
    for (const Drive& drive : mechanism_.drives) {
      if (Find(coverage_.drives, drive.name) != nullptr) continue;
      Add("drive " + drive.name, "does not know it");
    }
    for (const Prescribed& prescribed : mechanism_.prescribed) {
      if (Find(coverage_.prescribed, prescribed.name) != nullptr) continue;
      Add("prescribed " + prescribed.name, "does not know it");
    }
    if (concern_ != Concern::kStiffness) return;
    for (const Beam& beam : mechanism_.beams) {
      if (Find(coverage_.beams, beam.name) != nullptr) continue;
      Add("beam " + beam.name, "does not know it");
    }
  }

  // A body without mass at the end of one joint: a place to look from.
  [[nodiscard]] bool IsOrnament(int index) const {
    const Body& body = mechanism_.bodies[size_t(index)];
    if (index == 0 || Find(coverage_.bodies, body.name) != nullptr) return false;
    if (body.mass != 0.0 || !body.I_Bcm_B.isZero(0.0)) return false;
    return std::count_if(mechanism_.joints.begin(), mechanism_.joints.end(), [&](const Joint& j) {
             return j.parent == index || j.child == index;
           }) == 1;
  }

  const Coverage& coverage_;
  const Mechanism& mechanism_;
  Concern concern_;
  double length_ = 0.0;  // size of the mechanism
  std::vector<Finding> findings_;
};

}  // namespace

std::vector<Finding> FindUncovered(const Coverage& coverage, const Mechanism& mechanism,
                                   Concern concern) {
  return Checker(coverage, mechanism, concern).Run();
}

}  // namespace mbv
