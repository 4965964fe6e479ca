#include "pipeline/smoothed_forces.h"

#include <algorithm>
#include <cmath>

#include "reference/reference.h"

namespace mbv {
namespace {

bool IsSmoothed(const MotionTable& table) { return table.moves && table.smoothed(); }

// The same motion through all rows.
Motion ThroughAllRows(Motion motion) {
  for (Command& command : motion.commands) {
    for (ProfileTerm& term : command.profile.terms) {
      auto* pieces = std::get_if<PiecewiseTerm>(&term);
      if (pieces == nullptr) continue;
      for (const MotionTable& table : motion.tables) {
        if (pieces->pieces == table.spline) pieces->pieces = table.interpolated;
      }
    }
  }
  return motion;
}

SmoothedForce Difference(const Trace& smooth, const Trace& rough, const Drive& drive) {
  const int a = smooth.Find(Quantity::kForce, drive.name);
  const int b = rough.Find(Quantity::kForce, drive.name);
  const VecX change = smooth.values.col(a) - rough.values.col(b);
  const double samples = std::sqrt(static_cast<double>(change.size()));
  return {.drive = drive.name,
          .unit = smooth.channels[static_cast<size_t>(a)].unit,
          .rms = smooth.values.col(a).norm() / samples,
          .change_rms = change.norm() / samples,
          .change_max = change.cwiseAbs().maxCoeff()};
}

}  // namespace

std::vector<SmoothedForce> SmoothedForces(const Mechanism& mechanism, const Motion& motion) {
  if (motion.free() || std::none_of(motion.tables.begin(), motion.tables.end(), IsSmoothed)) {
    return {};
  }
  const ReferenceRun smooth = RunReference(mechanism, motion);
  const ReferenceRun rough = RunReference(mechanism, ThroughAllRows(motion));
  if (!smooth.summary.ok() || !rough.summary.ok()) return {};
  std::vector<SmoothedForce> forces;
  for (const Drive& drive : mechanism.drives) {
    forces.push_back(Difference(smooth.trace, rough.trace, drive));
  }
  return forces;
}

}  // namespace mbv
