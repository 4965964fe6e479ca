// Type-2 curves over two drives, the others held, and their cusps: where three ways to close for
// the same drives fall together, so that a path around one leads from one to another without a
// singular pose [Innocenti, Parenti-Castelli 1998; Zein, Wenger, Chablat 2008].
//
// Poses with the other drives held are a surface; with N its tangents, D the rates of the two
// drives along them and f = det D, the surface folds over the drives where f = 0. On such a curve
//   D v = 0,  h = ∇f·v,  h = 0 at a cusp                                                     (1)
// (there the curve runs along v, and rests in the space of drives). Curves are found where long
// straight walks on the surface change the sign of f, each is followed until it closes or leaves
// the ranges, and h is taken along it. The surface is that part within the ranges which hangs
// together with the ways to close that are found for the drives' values (modes.h).
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "features/workspace/modes.h"

namespace mbv {

struct JointCurve {
  std::vector<Eigen::Vector2d> points;  ///< of the two drives [m or rad]
  bool closed = false;
  bool rests = false;  ///< in a part of it, in the space of drives: a self-motion
};
struct Cusp {
  VecX drives;  ///< all, of the mechanism
  MatX outputs;
  std::vector<Pose> X_WB;
  size_t curve = 0;  ///< on which it is
};
struct JointSpaceCurves {
  RunSummary summary;
  std::vector<std::string> over, units;
  size_t ways = 0;  ///< that walks began at
  std::vector<JointCurve> curves;
  std::vector<Cusp> cusps;
};

/// `drives` are all, the two that are free first; `values` of all, where the search begins.
[[nodiscard]] JointSpaceCurves TraceJointSpace(const Mechanism& mechanism,
                                               const std::vector<NamedCoordinate>& drives,
                                               const VecX& values, int threads,
                                               const std::function<void(double)>& progress = {});

/// Of the pose that a question over two drives starts at.
[[nodiscard]] JointSpaceCurves JointSpaceOf(const SetQuestion& question, int threads,
                                            const std::function<void(double)>& progress,
                                            Diagnostics* diagnostics);
[[nodiscard]] std::string ToText(const Mechanism& mechanism, const JointSpaceCurves& curves,
                                 const TextStyle& style);
[[nodiscard]] nlohmann::ordered_json ToJson(const Mechanism& mechanism,
                                            const JointSpaceCurves& curves);
[[nodiscard]] std::vector<std::pair<std::string, std::string>> JointSpaceFiles(
    const Mechanism& mechanism, const JointSpaceCurves& curves);

}  // namespace mbv
