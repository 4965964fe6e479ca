// Checks on elastic bodies: beams that hold together, and joints on beam ends.
#include <fmt/format.h>

#include <algorithm>
#include <numeric>

#include "model_file/model_reader.h"

namespace mbv {
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

}  // namespace

void ModelReader::CheckBeams() {
  yaml_.SetNote("");
  if (!beams_good_) return;
  for (size_t b = 0; b < mechanism_.bodies.size(); ++b) CheckFrameOfBeams(static_cast<int>(b));
  CheckEndsOnBeams();
}

void ModelReader::CheckFrameOfBeams(int body) {
  std::vector<size_t> own;
  for (size_t i = 0; i < mechanism_.beams.size(); ++i) {
    if (mechanism_.beams[i].body == body) own.push_back(i);
  }
  if (own.empty()) return;
  const auto& beams = mechanism_.beams;
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
  const std::string& name = mechanism_.bodies[body].name;
  for (const size_t i : own) {
    for (const size_t other : own) {
      for (const Vec3& end : {beams[i].p_from, beams[i].p_to}) {
        if (!IsWithin(beams[other], end)) continue;
        yaml_.Error(*beam_places_[i],
                    fmt::format("beam '{}' ends at {} within beam '{}'", beams[i].name, Shown(end),
                                beams[other].name),
                    fmt::format("cut '{}' there: beams meet at their ends", beams[other].name));
      }
    }
    if (std::find(reached.begin(), reached.end(), i) != reached.end()) continue;
    yaml_.Error(*beam_places_[i],
                fmt::format("beam '{}' is not connected with the other beams of body '{}'",
                            beams[i].name, name),
                "beams of one body meet at their ends; two pieces are two bodies");
  }
}

bool ModelReader::IsOnBeamEnd(int body, const Vec3& p) const {
  bool elastic = false;
  for (const Beam& beam : mechanism_.beams) {
    if (beam.body != body) continue;
    elastic = true;
    if (Same(p, beam.p_from) || Same(p, beam.p_to)) return true;
  }
  return !elastic;
}

// Joints, legs and springs move with a beam end or with a rigid body.
void ModelReader::CheckEndsOnBeams() {
  const auto check = [&](const YamlEntry* at, const std::string& what, int body, const Vec3& p) {
    if (IsOnBeamEnd(body, p)) return;
    yaml_.AddAt(Severity::kError, at ? at->line : 0, at ? at->column : 0,
                fmt::format("{} sits at {} of body '{}', where no beam ends", what, Shown(p),
                            mechanism_.bodies[body].name),
                "a body with beams is elastic: what holds it sits on ends of its beams");
  };
  for (size_t j = 0; j < mechanism_.joints.size(); ++j) {
    const Joint& joint = mechanism_.joints[j];
    const std::string what = fmt::format("joint '{}'", joint.name);
    check(joint_places_[j], what, joint.parent, joint.X_PF.translation());
    check(joint_places_[j], what, joint.child, joint.X_CM.translation());
  }
  for (const Drive& drive : mechanism_.drives) {
    const auto* leg = std::get_if<DistanceDrive>(&drive.kind);
    if (leg == nullptr) continue;
    const YamlEntry* at = signal_places_[drive.name].front().entry;
    check(at, fmt::format("drive '{}'", drive.name), leg->body_from, leg->p_from);
    check(at, fmt::format("drive '{}'", drive.name), leg->body_to, leg->p_to);
  }
  for (const SpringDamper& spring : mechanism_.springs) {
    check(nullptr, fmt::format("spring '{}'", spring.name), spring.body_from, spring.p_from);
    check(nullptr, fmt::format("spring '{}'", spring.name), spring.body_to, spring.p_to);
  }
}

}  // namespace mbv
