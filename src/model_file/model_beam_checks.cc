// Checks on elastic bodies: beams that hold together, and joints on beam ends.
#include <fmt/format.h>

#include <algorithm>
#include <numeric>

#include "model_file/model_checks.h"

namespace mbv::internal {
namespace {

// Points nearer than this are one node [m].
constexpr double kSamePoint = 1e-9;

bool Same(const Vec3& a, const Vec3& b) { return (a - b).norm() < kSamePoint; }

// Whether p lies between the ends of the beam.
bool IsWithin(const Beam& beam, const Vec3& p) {
  if (Same(p, beam.p_from) || Same(p, beam.p_to)) return false;
  const double L = beam.length(), x = beam.R_BE.col(0).dot(p - beam.p_from);
  return x > 0.0 && x < L && Same(p, beam.p_from + x * beam.R_BE.col(0));
}

std::string Shown(const Vec3& p) {
  return fmt::format("[{:.6g}, {:.6g}, {:.6g}]", p.x() + 0.0, p.y() + 0.0, p.z() + 0.0);
}

void CheckFrameOfBeams(const Mechanism& mechanism, int body, ModelReport* report) {
  std::vector<size_t> own;
  for (size_t i = 0; i < mechanism.beams.size(); ++i) {
    if (mechanism.beams[i].body == body) own.push_back(i);
  }
  if (own.empty()) return;
  const auto& beams = mechanism.beams;
  std::vector<size_t> reached = {own.front()};  // grows from the first beam
  for (size_t k = 0; k < reached.size(); ++k) {
    const Beam& beam = beams[reached[k]];
    for (const size_t i : own) {
      if (std::find(reached.begin(), reached.end(), i) != reached.end()) continue;
      for (const Vec3& end : {beams[i].p_from, beams[i].p_to}) {
        if (!Same(end, beam.p_from) && !Same(end, beam.p_to)) continue;
        reached.push_back(i);
        break;
      }
    }
  }
  const std::string& name = mechanism.bodies[body].name;
  for (const size_t i : own) {
    for (const size_t other : own) {
      for (const Vec3& end : {beams[i].p_from, beams[i].p_to}) {
        if (!IsWithin(beams[other], end)) continue;
        report->At(report->places().beams[i], Severity::kError,
                   fmt::format("beam '{}' ends at {} within beam '{}'", beams[i].name, Shown(end),
                               beams[other].name),
                   fmt::format("cut '{}' there: beams meet at their ends", beams[other].name));
      }
    }
    if (std::find(reached.begin(), reached.end(), i) != reached.end()) continue;
    report->At(report->places().beams[i], Severity::kError,
               fmt::format("beam '{}' is not connected with the other beams of body '{}'",
                           beams[i].name, name),
               "beams of one body meet at their ends; two pieces are two bodies");
  }
}

bool IsOnBeamEnd(const Mechanism& mechanism, int body, const Vec3& p) {
  bool elastic = false;
  for (const Beam& beam : mechanism.beams) {
    if (beam.body != body) continue;
    elastic = true;
    if (Same(p, beam.p_from) || Same(p, beam.p_to)) return true;
  }
  return !elastic;
}

// Joints, legs and springs move with a beam end or with a rigid body.
void CheckEndsOnBeams(const Mechanism& mechanism, ModelReport* report) {
  const auto check = [&](Place at, const std::string& what, int body, const Vec3& p) {
    if (IsOnBeamEnd(mechanism, body, p)) return;
    report->At(at, Severity::kError,
               fmt::format("{} sits at {} of body '{}', where no beam ends", what, Shown(p),
                           mechanism.bodies[body].name),
               "a body with beams is elastic: what holds it sits on ends of its beams");
  };
  for (size_t j = 0; j < mechanism.joints.size(); ++j) {
    const Joint& joint = mechanism.joints[j];
    const std::string what = fmt::format("joint '{}'", joint.name);
    check(report->places().joints[j], what, joint.parent, joint.X_PF.translation());
    check(report->places().joints[j], what, joint.child, joint.X_CM.translation());
  }
  for (const Drive& drive : mechanism.drives) {
    const auto* leg = std::get_if<DistanceDrive>(&drive.kind);
    if (leg == nullptr) continue;
    const Place at = report->places().signals.Of(drive.name);
    check(at, fmt::format("drive '{}'", drive.name), leg->body_from, leg->p_from);
    check(at, fmt::format("drive '{}'", drive.name), leg->body_to, leg->p_to);
  }
  for (const SpringDamper& spring : mechanism.springs) {
    check({}, fmt::format("spring '{}'", spring.name), spring.body_from, spring.p_from);
    check({}, fmt::format("spring '{}'", spring.name), spring.body_to, spring.p_to);
  }
}

}  // namespace

void CheckBeams(const Mechanism& mechanism, ModelReport* report) {
  for (size_t b = 0; b < mechanism.bodies.size(); ++b) {
    CheckFrameOfBeams(mechanism, static_cast<int>(b), report);
  }
  CheckEndsOnBeams(mechanism, report);
}

}  // namespace mbv::internal
