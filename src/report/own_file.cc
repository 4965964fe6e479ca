#include "report/own_file.h"

#include <fmt/format.h>

#include <cmath>

namespace mbv {

double Removed(double as_is, double without) { return 1.0 - without / as_is; }

// Mended by itself it takes most of the error with it, or left by itself it makes most of it: where
// causes hide each other only one of the two shows.
std::vector<const OwnCause*> OwnFileAudit::Culprits() const {
  constexpr double kMost = 0.5;
  std::vector<const OwnCause*> culprits;
  if (!as_is.sound()) return culprits;
  const double rest = mended.sound() ? mended.force : 0.0;
  for (const OwnCause& cause : causes) {
    const bool removes = cause.without.sound() && Removed(as_is.force, cause.without.force) > kMost;
    const bool makes = cause.alone.sound() && cause.alone.force * cause.alone.force - rest * rest >
                                                  kMost * kMost * as_is.force * as_is.force;
    if (removes || makes) culprits.push_back(&cause);
  }
  return culprits;
}

std::string OwnFileSentence(const OwnFileAudit& audit) {
  if (!audit.declined.empty()) return "your own file was not run: " + audit.declined;
  const OwnError& e = audit.as_is;
  if (!e.sound()) {
    return fmt::format("with its own settings your file gives no forces that could be compared: {}",
                       e.failure);
  }
  std::string gap = fmt::format("its loops open by at most {:.1e} m", e.gap_m);
  if (!e.joint.empty()) gap += fmt::format(" ({}, at {:.3g} s)", e.joint, e.gap_at_s);
  if (!e.twisted.empty()) {
    gap += fmt::format(" and twist by {:.1e} rad ({}, at {:.3g} s)", e.gap_rad, e.twisted,
                       e.gap_rad_at_s);
  }
  if (std::isnan(e.force)) return gap + "; no drive forces could be compared";
  if (audit.Good(e)) {
    return fmt::format(
        "nothing is wrong with your file's settings: on this motion its drive forces agree with "
        "the reference to {:.1e}, and {}",
        e.force, gap);
  }
  if (e.force <= OwnFileAudit::kGoodForce) {
    return fmt::format("with its own settings your file's drive forces agree to {:.1e}, but {}",
                       e.force, gap);
  }
  return fmt::format("with its own settings your file's drive forces are off by {:.2g} %, and {}",
                     100.0 * e.force, gap);
}

}  // namespace mbv
