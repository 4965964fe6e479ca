#include "model_file/model_report.h"

#include <fmt/format.h>

namespace mbv::internal {

void ModelReport::At(Place place, Severity severity, const std::string& message,
                     const std::string& hint) {
  yaml_.AddAt(severity, place.line, place.column, message, hint);
}

void ModelReport::AtBody(const Mechanism& mechanism, size_t body, Severity severity,
                         const std::string& message, const std::string& hint) {
  const BodyPlace& at = places_.bodies[body];
  if (at.place.line == 0) {
    others_.Add({severity, at.path, 0, 0,
                 fmt::format("link '{}': {}", mechanism.bodies[body].name, message), hint});
    return;
  }
  yaml_.SetNote(at.note);
  At(at.place, severity, at.path + ": " + message, hint);
  yaml_.SetNote("");
}

void ModelReport::AtJoint(size_t joint, Severity severity, const std::string& message,
                          const std::string& hint) {
  At(places_.joints[joint], severity, message, hint);
}

void ModelReport::AtFile(Severity severity, const std::string& message, const std::string& hint) {
  At({}, severity, message, hint);
}

const Finding* ModelReport::InUrdf(const Mechanism& mechanism, int joint) const {
  if (places_.joints[joint].line > 0) return nullptr;
  const auto found = places_.urdf_joints.find(mechanism.joints[joint].name);
  return found == places_.urdf_joints.end() ? nullptr : &found->second;
}

}  // namespace mbv::internal
