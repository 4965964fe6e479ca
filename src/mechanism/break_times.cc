#include "mechanism/break_times.h"

#include <algorithm>

namespace mbv {

std::vector<double> BreakTimes(const Motion& motion) {
  std::vector<double> breaks;
  const auto add = [&breaks](const Profile& profile) {
    const std::vector<double> times = BreakTimes(profile);
    breaks.insert(breaks.end(), times.begin(), times.end());
  };
  for (const Command& command : motion.commands) add(command.profile);
  for (const DriveForce& force : motion.forces) add(force.force);
  for (const Load& load : motion.loads) {
    for (int c = 0; c < 3; ++c) {
      add(load.force[c]);
      add(load.moment[c]);
    }
  }
  std::sort(breaks.begin(), breaks.end());
  return breaks;
}

}  // namespace mbv
