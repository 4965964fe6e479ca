// Inertias that no distribution of mass has.
#pragma once

#include <string>

#include "mechanism/mechanism.h"

namespace mbv {

/// "principal inertias 1, 2, 4 kg m² violate I1 + I2 >= I3", or "" if the body's inertia obeys the
/// triangle inequality (to 1e-9: laminae are on its bound).
[[nodiscard]] std::string TriangleViolation(const Body& body);

/// "principal inertias 1, 2, 4 kg m²".
[[nodiscard]] std::string PrincipalInertiaText(const Vec3& principal);

}  // namespace mbv
