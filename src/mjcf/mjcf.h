// Mechanism → MJCF text: a pure, deterministic function.
#pragma once

#include <string>

#include "mechanism/mechanism.h"

namespace mbv {

struct MjcfOptions {
  double step_s = 1e-3;          ///< <option timestep>
  bool pictures = true;          ///< geoms, lights and scene assets
};

/// The MJCF of a mechanism in its home pose: bodies along the spanning tree, `connect`/`weld`
/// equalities for the closures, `joint`/`tendon` equalities that guide drives and prescribed
/// joints, motors and sensors for stock tools. Numbers are written with 17 significant digits.
[[nodiscard]] std::string WriteMjcf(const Mechanism& mechanism, const MjcfOptions& options = {});

}  // namespace mbv
