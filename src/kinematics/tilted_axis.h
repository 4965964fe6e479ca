// Axes that are almost, but not quite, parallel: a typing slip that freezes a planar loop.
#pragma once

#include <optional>

#include "mechanism/mechanism.h"

namespace mbv {

struct TiltedAxis {
  int joint = -1;  ///< its axis is tilted
  int other = -1;  ///< against that of this joint
  int body = 0;    ///< that carries both
  double angle_rad = kNan;
  int freedoms = 0;          ///< of the mechanism as it is
  int freedoms_aligned = 0;  ///< with the two axes parallel (perpendicular: slide and hinge)
};

/// Looks for a joint whose axis misses those beside it by a small angle, where aligning it closes
/// loops that do not close at home, or gives freedom to a mechanism that has too little for its
/// drives. Nothing if aligning changes neither: then the angle is meant.
[[nodiscard]] std::optional<TiltedAxis> FindTiltedAxis(const Mechanism& mechanism,
                                                       bool closed_at_home);

}  // namespace mbv
