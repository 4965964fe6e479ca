// A mechanism and its motion elsewhere, turned, or in another size. Physically similar: masses and
// times stay, lengths change by the factor s, so that forces change by s, moments and energies by
// s².
#pragma once

#include "mechanism/mechanism.h"
#include "mechanism/motion.h"

namespace mbv::laws {

/// New world: X_NW places the old one in it; lengths grow by `scale` after that.
struct Similarity {
  Pose X_NW = Pose::Identity();
  double scale = 1.0;
};

[[nodiscard]] Mechanism Similar(const Mechanism& mechanism, const Similarity& similarity);
/// Loads that are given in world axes turn with the world.
[[nodiscard]] Motion Similar(const Mechanism& mechanism, const Motion& motion,
                             const Similarity& similarity);

}  // namespace mbv::laws
