#include "pipeline/load_inertia.h"

#include <numbers>

#include "kinematics/command_rank.h"
#include "reference/reference.h"
#include "scenario/motion_reader.h"

namespace mbv {
namespace {

// All drives at home; one of them accelerates by 1 at t = 0: home + 1 − cos t.
Motion FromHome(const Mechanism& mechanism, int moving) {
  Motion motion{.duration_s = 1e-3, .sample_s = 1e-3, .commands = {}, .loads = {}};
  for (size_t d = 0; d < mechanism.drives.size(); ++d) {
    const Coordinate coordinate{Coordinate::Kind::kDrive, static_cast<int>(d), 0};
    Profile profile = Constant(HomeValue(mechanism, coordinate));
    if (static_cast<int>(d) == moving) {
      profile.terms.emplace_back(ConstantTerm{1.0});
      profile.terms.emplace_back(SineTerm{-1.0, 0.5 / std::numbers::pi, 0.5 * std::numbers::pi});
    }
    motion.commands.push_back({mechanism.drives[d].name, {{coordinate, 1.0}}, profile});
  }
  return motion;
}

// The drive's force at t = 0; NaN where the reference fails.
double ForceAtStart(const Mechanism& mechanism, int drive, int moving) {
  const ReferenceRun run = RunReference(mechanism, FromHome(mechanism, moving));
  const std::string& name = mechanism.drives[static_cast<size_t>(drive)].name;
  const int column = run.trace.Find(Quantity::kForce, name);
  return run.summary.ok() && column >= 0 ? run.trace.values(0, column) : kNan;
}

}  // namespace

double LoadInertia(const Mechanism& mechanism, int drive) {
  const CommandRank rank = RankCommands(mechanism, FromHome(mechanism, -1).commands);
  const auto drives = static_cast<int>(mechanism.drives.size());
  if (drives != rank.freedoms || rank.redundant > 0 || !mechanism.prescribed.empty()) return kNan;
  return ForceAtStart(mechanism, drive, drive) - ForceAtStart(mechanism, drive, -1);
}

}  // namespace mbv
