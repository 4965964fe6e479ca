#include "pipeline/inertia.h"

#include <algorithm>

#include "pipeline/load_robot.h"

namespace mbv {

bool InertiaCheck::sound() const {
  return std::all_of(bodies.begin(), bodies.end(),
                     [](const BodyInertia& body) { return body.findings.empty(); });
}

InertiaCheck CheckInertia(const std::string& file) {
  LoadedBodies loaded = LoadRobotBodies(file);
  InertiaCheck check{.bodies = {}, .diagnostics = std::move(loaded.diagnostics)};
  if (check.diagnostics.has_errors()) return check;
  for (const Body& body : loaded.bodies) {
    const bool has_mesh = std::any_of(body.shapes.begin(), body.shapes.end(), [](const Shape& s) {
      return std::holds_alternative<Mesh>(s.geometry);
    });
    if (has_mesh && body.name != "world") check.bodies.push_back(DiagnoseInertia(body));
  }
  if (check.bodies.empty()) {
    check.diagnostics.Add({Severity::kError, file, 0, 0,
                           "no body has a mesh to compare its mass properties with",
                           "meshes stand in <visual> of URDF, geoms of MJCF, `shapes` of models"});
  }
  return check;
}

}  // namespace mbv
