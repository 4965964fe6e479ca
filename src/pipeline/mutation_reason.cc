#include "pipeline/mutation_reason.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <vector>

#include "comparison/force_band.h"
#include "mechanism/body_states.h"
#include "mechanism/channels.h"
#include "reference/reference.h"

namespace mbv {
namespace {

// Numbers of a model that differ by less come out of the same expressions.
constexpr double kSameNumber = 1e-14;
// Relative change of a force that counts as none.
constexpr double kNoChange = 1e-11;

template <typename A, typename B>
bool Same(const Eigen::MatrixBase<A>& a, const Eigen::MatrixBase<B>& b) {
  return (a - b).cwiseAbs().maxCoeff() <= kSameNumber * (1.0 + a.cwiseAbs().maxCoeff());
}
bool Same(const Pose& a, const Pose& b) { return Same(a.matrix(), b.matrix()); }
bool Same(double a, double b) {
  return a == b || std::abs(a - b) <= kSameNumber * (1.0 + std::abs(a));
}

bool SameMoments(const Body& a, const Body& b) {
  return (a.I_Bcm_B - b.I_Bcm_B).norm() <= kSameNumber * a.I_Bcm_B.norm();
}

bool SameInertia(const Body& a, const Body& b) {
  return Same(a.mass, b.mass) && Same(a.p_BoBcm_B, b.p_BoBcm_B) && SameMoments(a, b);
}

// "by more than 3e-16 of the RMS force", "at all".
std::string Bound(double change) {
  return change == 0.0 ? "at all" : fmt::format("by more than {:.0e} of the RMS force", change);
}

// "a, b, c and 4 more".
std::string Listed(const std::vector<std::string>& names) {
  std::string text;
  for (size_t i = 0; i < std::min<size_t>(names.size(), 3); ++i) {
    text += (i == 0 ? "" : ", ") + names[i];
  }
  if (names.size() > 3) text += fmt::format(" and {} more", names.size() - 3);
  return text;
}

// Names of the items for which `differ` holds.
template <typename T, typename F>
std::vector<std::string> Which(const std::vector<T>& a, const std::vector<T>& b, F differ) {
  std::vector<std::string> names;
  for (size_t i = 0; i < std::min(a.size(), b.size()); ++i) {
    if (differ(a[i], b[i])) names.push_back(a[i].name);
  }
  return names;
}

bool SameCoupling(const Coupling& a, const Coupling& b) {
  const auto same_term = [](const Coupling::Term& s, const Coupling::Term& t) {
    return s.joint == t.joint && s.coordinate == t.coordinate &&
           std::ranges::equal(s.polynomial, t.polynomial,
                              [](double x, double y) { return Same(x, y); });
  };
  return Same(a.constant, b.constant) && std::ranges::equal(a.terms, b.terms, same_term);
}

bool SameLaw(const DampingLaw& a, const DampingLaw& b) { return Same(a.damping, b.damping); }
bool SameLaw(const SpringLaw& a, const SpringLaw& b) {
  return Same(a.free, b.free) && Same(a.preload, b.preload) &&
         std::ranges::equal(a.polynomial, b.polynomial,
                            [](double x, double y) { return Same(x, y); });
}
bool SameLaw(const RotorLaw& a, const RotorLaw& b) {
  const auto momentum = [](const RotorLaw& law) -> Vec3 {
    if (!law.carrier) return Vec3::Zero();
    return law.inertia * law.ratio * law.carrier->axis_B;
  };
  return Same(a.reflected(), b.reflected()) && Same(momentum(a), momentum(b));
}
bool SameLaw(const FrictionLaw& a, const FrictionLaw& b) {
  return Same(a.coulomb, b.coulomb) && Same(a.breakaway, b.breakaway) &&
         Same(a.stribeck_rate, b.stribeck_rate) && Same(a.per_load(), b.per_load());
}

bool SameElement(const ForceElement& a, const ForceElement& b) {
  return std::visit(
      [&b](const auto& law) {
        const auto* other = std::get_if<std::decay_t<decltype(law)>>(&b.law);
        return other != nullptr && SameLaw(law, *other);
      },
      a.law);
}

bool SameDrive(const Drive& a, const Drive& b) {
  const auto* from = std::get_if<DistanceDrive>(&a.kind);
  const auto* to = std::get_if<DistanceDrive>(&b.kind);
  return from == nullptr || to == nullptr ||
         (Same(from->p_from, to->p_from) && Same(from->p_to, to->p_to));
}

bool SameRanges(const CoordinateRange& a, const CoordinateRange& b) {
  return Same(a.lower, b.lower) && Same(a.upper, b.upper);
}

bool GeometryDiffers(const Mechanism& a, const Mechanism& b) {
  const auto joints = Which(a.joints, b.joints, [](const Joint& x, const Joint& y) {
    return !Same(x.X_PF, y.X_PF) || !Same(x.X_CM, y.X_CM) || !Same(x.axis, y.axis) ||
           !Same(x.axis2, y.axis2);
  });
  return !joints.empty();
}

bool StartDiffers(const Mechanism& a, const Mechanism& b) {
  for (size_t j = 0; j < a.joints.size(); ++j) {
    for (size_t c = 0; c < 6; ++c) {
      if (!Same(a.joints[j].guess[c], b.joints[j].guess[c])) return true;
    }
  }
  return false;
}

bool RangesDiffer(const Mechanism& a, const Mechanism& b) {
  for (size_t j = 0; j < a.joints.size(); ++j) {
    for (size_t c = 0; c < 6; ++c) {
      if (!SameRanges(a.joints[j].range[c], b.joints[j].range[c])) return true;
    }
  }
  return !Which(a.drives, b.drives, [](const Drive& x, const Drive& y) {
            return !SameRanges(x.range, y.range);
          }).empty();
}

// The wrench about the body's origin that its motion and weight call for, world axes.
Vec6 Needed(const Body& body, const Pose& X_WB, const Vec6& V, const Vec6& A, const Vec3& gravity) {
  const Mat3 R = X_WB.linear();
  const Vec3 c = R * body.p_BoBcm_B, w = V.head<3>(), alpha = A.head<3>();
  const Vec3 a_cm = A.tail<3>() + alpha.cross(c) + w.cross(w.cross(c));
  const Mat3 I = R * body.I_Bcm_B * R.transpose();
  const Vec3 force = body.mass * (a_cm - gravity);
  Vec6 wrench;
  wrench << I * alpha + w.cross(I * w) + c.cross(force), force;
  return wrench;
}

// Largest change of what the bodies' motions call for, relative to the largest that the bodies
// that differ call for. The motion is the reference's.
double InertiaEffect(const MutationBench& bench, const Mechanism& bent) {
  const Mechanism& base = bench.mechanism();
  const Motion& motion = bench.scenario().motion;
  ReferenceSolver solver(base, motion);
  ReferenceSample sample;
  CommandSample command;
  double change_force = 0.0, change_moment = 0.0, all_force = 0.0, all_moment = 0.0;
  for (const double t : SampleTimes(motion.duration_s, motion.sample_s)) {
    EvaluateMotion(motion, t, &command);
    if (!solver.Kinematics(command, &sample).ok()) return kNan;
    for (size_t b = 1; b < base.bodies.size(); ++b) {
      const BodyStates& s = sample.states;
      const Vec6 as_is = Needed(base.bodies[b], s.X_WB[b], s.V_WB[b], s.A_WB[b], base.gravity_W);
      const Vec6 as_bent = Needed(bent.bodies[b], s.X_WB[b], s.V_WB[b], s.A_WB[b], bent.gravity_W);
      change_moment = std::max(change_moment, (as_bent - as_is).head<3>().norm());
      change_force = std::max(change_force, (as_bent - as_is).tail<3>().norm());
      all_moment = std::max(all_moment, as_is.head<3>().norm());
      all_force = std::max(all_force, as_is.tail<3>().norm());
    }
  }
  const auto share = [](double change, double all) { return change == 0.0 ? 0.0 : change / all; };
  return std::max(share(change_force, all_force), share(change_moment, all_moment));
}

// Largest change of all channels of a quantity, relative to the largest value among them.
double ChannelChange(const Trace& base, const Trace& bent, Quantity quantity) {
  double change = 0.0, largest = 0.0;
  for (size_t c = 0; c < base.channels.size(); ++c) {
    const int other = bent.Find(base.channels[c].name);
    if (other < 0 || base.channels[c].quantity != quantity) continue;
    const VecX a = base.values.col(static_cast<Eigen::Index>(c)), b = bent.values.col(other);
    if (a.size() != b.size() || a.size() == 0) continue;
    change = std::max(change, (a - b).cwiseAbs().maxCoeff());
    largest = std::max(largest, a.cwiseAbs().maxCoeff());
  }
  return change == 0.0 ? 0.0 : change / largest;
}

}  // namespace

double ForceSensitivity(const MutationBench& bench, const Trace& bent) {
  const Trace& base = bench.base().trace;
  const Mechanism& m = bench.mechanism();
  std::map<std::string, std::pair<double, double>> sums;  // unit → Σ f², count
  std::map<std::string, double> changes;
  for (const Drive& drive : m.drives) {
    const std::string force = ChannelName(Quantity::kForce, drive.name);
    const int a = base.Find(force), b = bent.Find(force);
    if (a < 0 || b < 0 || base.values.rows() != bent.values.rows()) return kNan;
    const std::string unit = ForceUnit(m, drive);
    sums[unit].first += base.values.col(a).squaredNorm();
    sums[unit].second += static_cast<double>(base.values.rows());
    const ForceSignal before(base, a), after(bent, b);
    for (Eigen::Index i = 0; i < base.values.rows(); ++i) {
      changes[unit] = std::max(changes[unit], std::abs(Difference(before.At(i), after.At(i))));
    }
  }
  double worst = 0.0;
  for (const auto& [unit, change] : changes) {
    const double rms = std::sqrt(sums[unit].first / sums[unit].second);
    worst = std::max(worst, change == 0.0 ? 0.0 : change / rms);
  }
  return worst;
}

std::string WhySwapUnseen(const MutationBench& bench, const std::string& a, const std::string& b) {
  const Trace& trace = bench.base().trace;
  double worst = 0.0;
  for (const Quantity quantity : {Quantity::kPosition, Quantity::kForce}) {
    const int i = trace.Find(quantity, a), j = trace.Find(quantity, b);
    if (i < 0 || j < 0) return "";
    const double largest = trace.values.col(i).cwiseAbs().maxCoeff();
    const double change = (trace.values.col(i) - trace.values.col(j)).cwiseAbs().maxCoeff();
    worst = std::max(worst, change == 0.0 ? 0.0 : change / largest);
  }
  return fmt::format(
      "in this motion {} and {} do the same: their positions and forces differ by "
      "{:.0e} at most",
      a, b, worst);
}

std::string DescribeChange(const Mechanism& base, const Mechanism& bent) {
  std::vector<std::string> parts;
  const auto add = [&](const std::string& what, const std::vector<std::string>& names) {
    if (!names.empty()) parts.push_back(what + " " + Listed(names));
  };
  if (base.bodies.size() != bent.bodies.size() || base.joints.size() != bent.joints.size()) {
    return "the number of bodies or joints";
  }
  if (!Same(base.gravity_W, bent.gravity_W)) parts.emplace_back("gravity");
  add("the mass of", Which(base.bodies, bent.bodies,
                           [](const Body& a, const Body& b) { return !Same(a.mass, b.mass); }));
  add("the centre of mass of", Which(base.bodies, bent.bodies, [](const Body& a, const Body& b) {
        return !Same(a.p_BoBcm_B, b.p_BoBcm_B);
      }));
  // A mass that changes takes the inertia with it.
  add("the inertia of", Which(base.bodies, bent.bodies, [](const Body& a, const Body& b) {
        return Same(a.mass, b.mass) && !SameMoments(a, b);
      }));
  add("joint frames or axes of",
      Which(base.joints, bent.joints, [](const Joint& a, const Joint& b) {
        return !Same(a.X_PF, b.X_PF) || !Same(a.X_CM, b.X_CM) || !Same(a.axis, b.axis) ||
               !Same(a.axis2, b.axis2);
      }));
  add("the ends of", Which(base.drives, bent.drives,
                           [](const Drive& a, const Drive& b) { return !SameDrive(a, b); }));
  add("the frame of output",
      Which(base.outputs, bent.outputs, [](const Output& a, const Output& b) {
        return !Same(a.X_BO, b.X_BO) || !Same(a.X_RbR, b.X_RbR);
      }));
  add("the spring",
      Which(base.springs, bent.springs, [](const SpringDamper& a, const SpringDamper& b) {
        return !Same(a.stiffness, b.stiffness) || !Same(a.damping, b.damping) ||
               !Same(a.free_length_m, b.free_length_m) || !Same(a.p_from, b.p_from) ||
               !Same(a.p_to, b.p_to);
      }));
  add("the coupling",
      Which(base.couplings, bent.couplings,
            [](const Coupling& a, const Coupling& b) { return !SameCoupling(a, b); }));
  add("the frames of bushing",
      Which(base.bushings, bent.bushings, [](const Bushing& a, const Bushing& b) {
        return !Same(a.X_PF, b.X_PF) || !Same(a.X_CM, b.X_CM);
      }));
  add("the element",
      Which(base.elements, bent.elements,
            [](const ForceElement& a, const ForceElement& b) { return !SameElement(a, b); }));
  if (RangesDiffer(base, bent)) parts.emplace_back("ranges of travel");
  if (StartDiffers(base, bent)) parts.emplace_back("where the home solution starts");
  std::string text;
  for (const std::string& part : parts) text += (text.empty() ? "" : "; ") + part;
  return text;
}

std::string WhyUnseen(const MutationBench& bench, const Mechanism& bent, const BentRun& run,
                      const std::string& bend) {
  const Mechanism& base = bench.mechanism();
  const std::string change = DescribeChange(base, bent);
  const double sensitivity = ForceSensitivity(bench, run.trace);
  const std::string proof = fmt::format("{} changes no drive force {}", bend, Bound(sensitivity));
  if (change.empty()) {
    return "no mass, joint, drive or output depends on it (pictures, or numbers that only other "
           "parameters use); " +
           proof;
  }
  std::string text = "it changes " + change;
  const bool inertia = !GeometryDiffers(base, bent) && Same(base.gravity_W, bent.gravity_W) &&
                       !Which(base.bodies, bent.bodies, [](const Body& a, const Body& b) {
                          return !SameInertia(a, b);
                        }).empty();
  if (inertia) {
    const double effect = InertiaEffect(bench, bent);
    if (effect <= kNoChange) {
      return text +
             fmt::format("; the motion calls for the same inertia forces as before (to {:.0e}); ",
                         effect) +
             proof;
    }
    text += fmt::format(", whose inertia forces change by {:.1e}", effect);
  }
  const Trace& trace = bench.base().trace;
  const double prescribed = ChannelChange(trace, run.trace, Quantity::kBaseForce);
  const double reactions = ChannelChange(trace, run.trace, Quantity::kReaction);
  if (prescribed > kNoChange) {
    text +=
        fmt::format(", carried by the prescribed motion (its forces change by {:.1e})", prescribed);
  } else if (reactions > kNoChange) {
    text += fmt::format(", carried by joints (reactions change by {:.1e})", reactions);
  } else if (inertia) {
    text += ", carried by joints whose reactions are not recorded";
  }
  return text + "; " + proof;
}

}  // namespace mbv
