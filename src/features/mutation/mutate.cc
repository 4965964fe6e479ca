#include "features/mutation/mutate.h"

#include <fmt/format.h>
#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <functional>
#include <limits>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "base/text.h"
#include "comparison/force_band.h"
#include "features/mutation/mutation_bench.h"
#include "features/mutation/mutation_report.h"
#include "mechanism/motion.h"
#include "model_file/element_text.h"
#include "model_file/load_model.h"
#include "model_file/yaml/units.h"
#include "model_file/yaml/yaml_reader.h"
#include "reference/reference.h"
#include "verify/drive_by.h"

namespace mbv {
namespace {

// The numbers of a model file that may be wrong.

/// A number of the model and what an error of 1 adds to it.
struct Perturbable {
  std::string name, unit;
  NumberKind kind = NumberKind::kParameter;
  double value = kNan;
  double relative_to = kNan;  ///< the value; the largest one of its unit if that is zero

  /// With a relative error.
  [[nodiscard]] Replacement At(double error) const {
    return {name, kind == NumberKind::kLiteral, value + relative_to * error};
  }
  /// "10 % wrong", "10 % of 0.75 m instead of 0"
  [[nodiscard]] std::string Text(double error) const;
};

// One number of the model perturbed on one bench: is the error seen, and from which size on?

/// What is known of errors of one sign.
struct Direction {
  double sign = 1.0;  ///< of the relative error
  PerturbedRun run;   ///< at the size asked for, then the largest that was not seen
  bool ran = false;   ///< at the size asked for
  bool detected = false, by_force = false;  ///< the same; not running is noticed, too
  double force_change = kNan;               ///< the same
  double unseen = 0.0;                      ///< largest error known not to be seen
  double smallest = kNan;                   ///< smallest error known to be seen
  std::string check = {};                   ///< that saw it; "model" where it was refused
};

class PerturbationSearch {
 public:
  /// `count` is called before each simulation with what is perturbed.
  PerturbationSearch(const MutationOptions& options, const MutationBench& bench,
                     std::function<void(const std::string& what)> count)
      : options_(options), bench_(bench), count_(std::move(count)) {}

  /// Both directions at the size asked for; with the smallest errors if these are asked for. What
  /// is not seen is made worse up to kLargestPerturbation, if `further`.
  [[nodiscard]] Detection Look(const Perturbable& number, bool further);

  /// After Look(): the direction that shows less, of those that ran.
  [[nodiscard]] const Direction& Weaker() const;

 private:
  PerturbedRun RunAt(const Perturbable& number, double error);
  Direction Try(const Perturbable& number, double sign);
  void PerturbFurther(const Perturbable& number, Direction* way);
  void FindSmallest(const Perturbable& number, double seen, double ratio, double guess,
                    Direction* way);
  [[nodiscard]] Detection Join() const;

  const MutationOptions& options_;
  const MutationBench& bench_;
  std::function<void(const std::string&)> count_;
  std::array<Direction, 2> ways_;  // larger, smaller
};

/// The check that shows a perturbation best: largest value over limit among those that the
/// perturbation moves.
struct BestCheck {
  const CheckResult* check = nullptr;
  double ratio = 0.0;  ///< value over limit
};

// Its value; the largest one of its unit if that is zero.
double ScaleOf(const Parameter& parameter, const std::vector<Parameter>& all) {
  if (parameter.value != 0.0) return parameter.value;
  double largest = 0.0;
  for (const Parameter& other : all) {
    if (other.unit == parameter.unit) largest = std::max(largest, std::abs(other.value));
  }
  return largest > 0.0 ? largest : 1.0;
}

// The keys of a place, without indices: "parts", "leg", "bodies", "rod", "inertia".
std::vector<std::string> KeysOf(const std::string& place) {
  std::vector<std::string> keys(1);
  for (const char c : place) {
    if (c == '[') keys.back() += '\0';  // the rest of the key is an index
    if (c == '.') {
      keys.emplace_back();
    } else {
      keys.back() += c;
    }
  }
  for (std::string& key : keys) key = key.substr(0, key.find('\0'));
  return keys;
}

// A key of this word, whatever unit it is written in.
bool Has(const std::vector<std::string>& keys, const std::string& word) {
  return std::any_of(keys.begin(), keys.end(),
                     [&](const std::string& key) { return SplitUnit(key).name == word; });
}

bool CanAct(const Literal& literal) {
  const std::vector<std::string> keys = KeysOf(literal.place);
  static constexpr std::array kNoForce = {"shapes", "range",    "guess",     "up",       "radius",
                                          "beams",  "sections", "materials", "instances"};
  if (std::any_of(kNoForce.begin(), kNoForce.end(),
                  [&](const char* key) { return Has(keys, key); })) {
    return false;
  }
  if (Has(keys, "drives") && Has(keys, "stiffness")) return false;  // of a servo
  const bool axis = Has(keys, "axis") || Has(keys, "axis2") || Has(keys, "axes");
  return literal.value != 0.0 && !(axis && std::abs(literal.value) == 1.0);
}

// Of a bushing's list; the index of its number is the last character but one of its place.
std::string BushingUnit(const std::string& place, bool damping) {
  const char index = place.size() < 2 ? '0' : place[place.size() - 2];
  const bool length = index < '3';
  if (damping) return length ? "N s/m" : "N m s/rad";
  return length ? "N/m" : "N m/rad";
}

// Of a force element; `keys` end in what it is, behind the element's name.
std::string ElementUnit(const Mechanism& mechanism, const std::vector<std::string>& keys) {
  if (Has(keys, "inertia")) return "kg m^2";
  if (Has(keys, "radius")) return "m";
  for (const ForceElement& element : mechanism.elements) {
    const std::string file_name = FileName(mechanism, element);
    const std::string name = file_name.substr(file_name.rfind('.') + 1);
    if (keys.size() < 2 || keys[keys.size() - 2] != name) continue;
    const bool length = ActsOnLength(mechanism, element);
    if (Has(keys, "damping")) return length ? "N s/m" : "N m s/rad";
    if (Has(keys, "stiffness")) return length ? "N/m" : "N m/rad";
    if (Has(keys, "stribeck_rate")) return length ? "m/s" : "rad/s";
    if (Has(keys, "preload") || Has(keys, "coulomb") || Has(keys, "breakaway"))
      return length ? "N" : "N m";
    if (Has(keys, "free")) return length ? "m" : "rad";
  }
  return "";
}

std::string UnitOf(const Mechanism& mechanism, const Literal& literal) {
  const std::vector<std::string> keys = KeysOf(literal.place);
  const bool damping = Has(keys, "damping");
  if (Has(keys, "elements") && literal.place.ends_with("]") &&
      (damping || Has(keys, "stiffness"))) {
    return BushingUnit(literal.place, damping);
  }
  if (Has(keys, "elements")) return ElementUnit(mechanism, keys);
  if (Has(keys, "inertia")) return "kg m^2";
  if (Has(keys, "mass")) return "kg";
  if (Has(keys, "gravity")) return "m/s^2";
  if (Has(keys, "rpy") || Has(keys, "angle")) return "rad";
  if (Has(keys, "com") || Has(keys, "position") || Has(keys, "frames") || Has(keys, "attach") ||
      Has(keys, "origin") || Has(keys, "from") || Has(keys, "to") || Has(keys, "free_length")) {
    return "m";
  }
  if (Has(keys, "stiffness")) return "N/m";
  return Has(keys, "damping") ? "N s/m" : "";
}

std::string Perturbable::Text(double error) const {
  const std::string percent = fmt::format("{:.3g} %", 100.0 * std::abs(error));
  if (value != 0.0) return percent + (error > 0.0 ? " too large" : " too small");
  return fmt::format("{} of {:g}{}{} instead of 0", percent,
                     error > 0.0 ? relative_to : -relative_to, unit.empty() ? "" : " ", unit);
}

// The model's own parameters, those of instances, and what the file writes out where masses,
// places, axes, springs and gravity are stated. A literal 0, and 1 of an axis, are structure (an
// axis, a plane) and no measured numbers; pictures, ranges, guesses and beams act on no force.
std::vector<Perturbable> PerturbablesOf(const Mechanism& mechanism,
                                        const std::vector<Literal>& literals) {
  std::vector<Perturbable> all;
  const std::vector<Parameter>& parameters = mechanism.parameters;
  for (const bool instance : {false, true}) {
    for (const Parameter& p : parameters) {
      if ((p.name.find('.') != std::string::npos) != instance) continue;
      all.push_back({p.name, p.unit, instance ? NumberKind::kInstance : NumberKind::kParameter,
                     p.value, ScaleOf(p, parameters)});
    }
  }
  for (const Literal& literal : literals) {
    if (!CanAct(literal)) continue;
    all.push_back({literal.place, UnitOf(mechanism, literal), NumberKind::kLiteral, literal.value,
                   literal.value});
  }
  return all;
}

constexpr double kRatioRoundoff = 1.0 + 1e-9;  // of a ratio of sizes

bool FailsByForce(const PerturbedRun& run) {
  return std::any_of(run.comparison.checks.begin(), run.comparison.checks.end(),
                     [](const CheckResult& check) {
                       return check.limit && !check.pass && IsDriveForce(check.metric);
                     });
}

std::string NameOf(const BestCheck& best) {
  return best.check == nullptr ? "model" : best.check->name;
}

BestCheck BestOf(const MutationBench& bench, const PerturbedRun& run) {
  BestCheck best;
  for (const CheckResult& check : run.comparison.checks) {
    if (!check.limit) continue;
    if (check.value <= MutationBench::Visible(bench.base().ValueOf(check.name))) continue;
    const double ratio = std::isnan(check.value) ? std::numeric_limits<double>::infinity()
                                                 : check.value / *check.limit;
    if (best.check == nullptr || ratio > best.ratio) best = {&check, ratio};
  }
  return best;
}

PerturbedRun PerturbationSearch::RunAt(const Perturbable& number, double error) {
  count_(fmt::format("{} by {:+.1e}", number.name, error));
  return bench_.Run(number.At(error));
}

Direction PerturbationSearch::Try(const Perturbable& number, double sign) {
  Direction way{.sign = sign, .run = RunAt(number, sign * options_.size)};
  way.ran = way.run.ran;
  way.detected = way.run.detected();
  if (!way.ran) {
    way.check = "model";
    return way;
  }
  way.force_change = way.run.ValueOf(bench_.ForceCheck());
  way.by_force = FailsByForce(way.run);
  if (!way.detected) way.unseen = options_.size;
  return way;
}

Detection PerturbationSearch::Look(const Perturbable& number, bool further) {
  double guess = 0.0;  // what one direction shows, the other probably does
  for (size_t k = 0; k < 2; ++k) {
    Direction& way = ways_[k];
    way = Try(number, k == 0 ? 1.0 : -1.0);
    if (!way.detected) {
      if (further) PerturbFurther(number, &way);
    } else if (way.ran) {
      const BestCheck best = BestOf(bench_, way.run);
      way.check = NameOf(best);
      if (options_.smallest) {
        FindSmallest(number, options_.size, best.ratio, guess, &way);
      } else if (best.check != nullptr) {
        way.smallest = options_.size / best.ratio;
      }
      guess = way.smallest;
    }
  }
  return Join();
}

const Direction& PerturbationSearch::Weaker() const {
  const Direction &up = ways_[0], &down = ways_[1];
  if (up.ran != down.ran) return up.ran ? up : down;
  if (up.detected != down.detected) return up.detected ? down : up;
  if (!up.detected && std::isnan(up.smallest) && std::isnan(down.smallest)) {
    return down.unseen > up.unseen ? down : up;
  }
  return down.smallest > up.smallest ? down : up;
}

Detection PerturbationSearch::Join() const {
  const Direction &up = ways_[0], &down = ways_[1], &weaker = Weaker();
  Detection s;
  s.ran = weaker.ran;
  s.detected = up.detected && down.detected;
  s.by_force = s.ran && (up.by_force || !up.ran) && (down.by_force || !down.ran);
  s.force_change = std::fmin(up.force_change, down.force_change);
  s.smallest = weaker.smallest;
  s.best_check = weaker.check;
  if (up.ran != down.ran) s.only = up.ran ? "larger" : "smaller";
  if (!s.ran) s.reason = up.run.failure;
  return s;
}

// Not seen at the size asked for: perturbed by kLargestPerturbation, and if that is seen or
// refused, by ten times as much as before until it is.
void PerturbationSearch::PerturbFurther(const Perturbable& number, Direction* way) {
  if (way->unseen >= kLargestPerturbation) return;
  PerturbedRun largest = RunAt(number, way->sign * kLargestPerturbation);
  if (largest.ran && !largest.detected()) {
    way->unseen = kLargestPerturbation;
    way->run = std::move(largest);
    return;
  }
  for (double size = 10.0 * options_.size; way->unseen < kLargestPerturbation; size *= 10.0) {
    size = std::min(size, kLargestPerturbation);
    PerturbedRun run = size < kLargestPerturbation ? RunAt(number, way->sign * size) : largest;
    if (!run.ran) return;  // the model itself objects; forces have not seen it up to here
    if (run.detected()) {
      const BestCheck best = BestOf(bench_, run);
      way->check = NameOf(best);
      if (options_.smallest) FindSmallest(number, size, best.ratio, 0.0, way);
      return;
    }
    way->unseen = size;
    way->run = std::move(run);
  }
}

// Between way->unseen (0: not known) and `seen`; `ratio` is value over limit at `seen`. `known`: a
// size that may be the one, or 0.
void PerturbationSearch::FindSmallest(const Perturbable& number, double seen, double ratio,
                                      double known, Direction* way) {
  const double fine = 1.0 + options_.resolution;
  double unseen = way->unseen, step = fine;
  // Where proportion puts the limit, a little beyond; 0 where nothing is proportional.
  double guess = std::isfinite(ratio) && ratio > 1.0 ? seen / ratio * std::sqrt(fine) : 0.0;
  if (known > 0.0) guess = known;
  while ((unseen == 0.0 || seen / unseen > fine * kRatioRoundoff) && seen > kSmallestPerturbation) {
    double size = 0.0;
    if (guess > unseen && guess < seen) {
      size = guess;
    } else if (unseen == 0.0) {
      size = seen / step;
      step *= step;
    } else if (unseen * step * fine < seen) {
      size = unseen * step;
      step *= step;
    } else {
      size = std::sqrt(unseen * seen);
    }
    guess = 0.0;
    size = std::max(size, kSmallestPerturbation);
    const PerturbedRun run = RunAt(number, way->sign * size);
    if (!run.detected()) {
      unseen = size;
      continue;
    }
    seen = size;
    way->check = NameOf(BestOf(bench_, run));
  }
  way->smallest = seen;
}

}  // namespace
namespace {

// Why a perturbed parameter is not seen: what it changes in the model, and proof that this has no
// effect.

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
bool SameLaw(const StopLaw& a, const StopLaw& b) {
  return a.lower == b.lower && a.upper == b.upper && Same(a.stiffness, b.stiffness) &&
         Same(a.exponent, b.exponent) && Same(a.damping, b.damping) &&
         Same(a.dissipation, b.dissipation) && a.rigid() == b.rigid() &&
         (!a.rigid() || Same(a.restitution, b.restitution));
}
bool SameLaw(const CurveLaw& a, const CurveLaw& b) {
  const auto same = [](const CurveLaw::Knot& x, const CurveLaw::Knot& y) {
    return Same(x.at, y.at) && Same(x.force, y.force) && Same(x.slope_before, y.slope_before) &&
           Same(x.slope_after, y.slope_after);
  };
  return a.of_rate == b.of_rate && std::ranges::equal(a.knots, b.knots, same);
}
bool SameLaw(const CurvesLaw& a, const CurvesLaw& b) {
  const auto same_rate = [](double x, double y) { return Same(x, y); };
  const auto same_curve = [](const CurveLaw& x, const CurveLaw& y) { return SameLaw(x, y); };
  return a.held == b.held && std::ranges::equal(a.rates, b.rates, same_rate) &&
         std::ranges::equal(a.curves, b.curves, same_curve);
}
bool SameLaw(const ExpressionLaw& a, const ExpressionLaw& b) { return a.text == b.text; }
bool SameLaw(const RotorLaw& a, const RotorLaw& b) {
  const auto momentum = [](const RotorLaw& law) -> Vec3 {
    if (!law.carrier) return Vec3::Zero();
    return law.inertia * law.ratio * law.carrier->axis_B;
  };
  return Same(a.reflected(), b.reflected()) && Same(momentum(a), momentum(b));
}
bool SameLaw(const FrictionLaw& a, const FrictionLaw& b) {
  return Same(a.coulomb, b.coulomb) && Same(a.breakaway, b.breakaway) &&
         Same(a.stribeck_rate, b.stribeck_rate) && Same(a.coefficient, b.coefficient) &&
         Same(a.skew, b.skew) && a.resists == b.resists &&
         Same(a.coefficient * a.radius, b.coefficient * b.radius) &&
         Same(a.thrust_radius, b.thrust_radius) && a.coupling == b.coupling &&
         (a.length == b.length || Same(a.length, b.length));
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
    if (!Same(a.joints[j].max_rotation, b.joints[j].max_rotation)) return true;
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
double InertiaEffect(const MutationBench& bench, const Mechanism& perturbed) {
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
      const Vec6 as_perturbed =
          Needed(perturbed.bodies[b], s.X_WB[b], s.V_WB[b], s.A_WB[b], perturbed.gravity_W);
      change_moment = std::max(change_moment, (as_perturbed - as_is).head<3>().norm());
      change_force = std::max(change_force, (as_perturbed - as_is).tail<3>().norm());
      all_moment = std::max(all_moment, as_is.head<3>().norm());
      all_force = std::max(all_force, as_is.tail<3>().norm());
    }
  }
  const auto share = [](double change, double all) { return change == 0.0 ? 0.0 : change / all; };
  return std::max(share(change_force, all_force), share(change_moment, all_moment));
}

// Largest change of all channels of a quantity, relative to the largest value among them.
double ChannelChange(const Trace& base, const Trace& perturbed, Quantity quantity) {
  double change = 0.0, largest = 0.0;
  for (size_t c = 0; c < base.channels.size(); ++c) {
    const int other = perturbed.Find(base.channels[c].name);
    if (other < 0 || base.channels[c].quantity != quantity) continue;
    const VecX a = base.values.col(static_cast<Eigen::Index>(c)), b = perturbed.values.col(other);
    if (a.size() != b.size() || a.size() == 0) continue;
    change = std::max(change, (a - b).cwiseAbs().maxCoeff());
    largest = std::max(largest, a.cwiseAbs().maxCoeff());
  }
  return change == 0.0 ? 0.0 : change / largest;
}

// Largest change of any drive force against the unperturbed run, relative to the RMS force of all
// drives of its unit.
double ForceSensitivity(const MutationBench& bench, const Trace& perturbed) {
  const Trace& base = bench.base().trace;
  const Mechanism& m = bench.mechanism();
  std::map<std::string, std::pair<double, double>> sums;  // unit → Σ f², count
  std::map<std::string, double> changes;
  for (const Drive& drive : m.drives) {
    const std::string force = ChannelName(Quantity::kForce, drive.name);
    const int a = base.Find(force), b = perturbed.Find(force);
    if (a < 0 || b < 0 || base.values.rows() != perturbed.values.rows()) return kNan;
    const std::string unit = ForceUnit(m, drive);
    sums[unit].first += base.values.col(a).squaredNorm();
    sums[unit].second += static_cast<double>(base.values.rows());
    const ForceSignal before(base, a), after(perturbed, b);
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

// Why two exchanged drives are not distinguished: how much they differ in the unperturbed run.
std::string SwapUnseenReason(const MutationBench& bench, const std::string& a,
                             const std::string& b) {
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
      "in this motion {} and {} do the same: their positions and forces differ by {:.0e} at most",
      a, b, worst);
}

// What two versions of a model differ in: "the mass of ship; guesses and home pose".
std::string DescribeChange(const Mechanism& base, const Mechanism& perturbed) {
  std::vector<std::string> parts;
  const auto add = [&](const std::string& what, const std::vector<std::string>& names) {
    if (!names.empty()) parts.push_back(what + " " + JoinedAndMore(names));
  };
  if (base.bodies.size() != perturbed.bodies.size() ||
      base.joints.size() != perturbed.joints.size()) {
    return "the number of bodies or joints";
  }
  if (!Same(base.gravity_W, perturbed.gravity_W)) parts.emplace_back("gravity");
  add("the mass of", Which(base.bodies, perturbed.bodies,
                           [](const Body& a, const Body& b) { return !Same(a.mass, b.mass); }));
  add("the centre of mass of",
      Which(base.bodies, perturbed.bodies,
            [](const Body& a, const Body& b) { return !Same(a.p_BoBcm_B, b.p_BoBcm_B); }));
  // A mass that changes takes the inertia with it.
  add("the inertia of", Which(base.bodies, perturbed.bodies, [](const Body& a, const Body& b) {
        return Same(a.mass, b.mass) && !SameMoments(a, b);
      }));
  add("the gravity compensation of",
      Which(base.bodies, perturbed.bodies, [](const Body& a, const Body& b) {
        return !Same(a.gravity_compensation, b.gravity_compensation);
      }));
  add("joint frames or axes of",
      Which(base.joints, perturbed.joints, [](const Joint& a, const Joint& b) {
        return !Same(a.X_PF, b.X_PF) || !Same(a.X_CM, b.X_CM) || !Same(a.axis, b.axis) ||
               !Same(a.axis2, b.axis2);
      }));
  add("the ends of", Which(base.drives, perturbed.drives,
                           [](const Drive& a, const Drive& b) { return !SameDrive(a, b); }));
  add("the frame of output",
      Which(base.outputs, perturbed.outputs, [](const Output& a, const Output& b) {
        return !Same(a.X_BO, b.X_BO) || !Same(a.X_RbR, b.X_RbR);
      }));
  add("the spring",
      Which(base.springs, perturbed.springs, [](const SpringDamper& a, const SpringDamper& b) {
        return !Same(a.stiffness, b.stiffness) || !Same(a.damping, b.damping) ||
               !Same(a.free_length_m, b.free_length_m) || !Same(a.p_from, b.p_from) ||
               !Same(a.p_to, b.p_to);
      }));
  add("the coupling",
      Which(base.couplings, perturbed.couplings,
            [](const Coupling& a, const Coupling& b) { return !SameCoupling(a, b); }));
  add("the frames of bushing",
      Which(base.bushings, perturbed.bushings, [](const Bushing& a, const Bushing& b) {
        return !Same(a.X_PF, b.X_PF) || !Same(a.X_CM, b.X_CM);
      }));
  add("the element",
      Which(base.elements, perturbed.elements,
            [](const ForceElement& a, const ForceElement& b) { return !SameElement(a, b); }));
  if (RangesDiffer(base, perturbed)) parts.emplace_back("ranges of travel");
  if (StartDiffers(base, perturbed)) parts.emplace_back("where the home solution starts");
  std::string text;
  for (const std::string& part : parts) text += (text.empty() ? "" : "; ") + part;
  return text;
}

// One sentence with numbers: what the perturbation changes in the model, the largest change of any
// drive force over the run relative to its RMS, and where the effect goes instead (base reactions,
// joint reactions, inertia forces that the motion does not call for). `perturbation` is the subject
// of that sentence: "10 % wrong".
std::string UnseenReason(const MutationBench& bench, const Mechanism& perturbed,
                         const PerturbedRun& run, const std::string& perturbation) {
  const Mechanism& base = bench.mechanism();
  const std::string change = DescribeChange(base, perturbed);
  const double sensitivity = ForceSensitivity(bench, run.trace);
  const std::string proof =
      fmt::format("{} changes no drive force {}", perturbation, Bound(sensitivity));
  if (change.empty()) {
    return "no mass, joint, drive or output depends on it (pictures, or numbers that only other "
           "parameters use); " +
           proof;
  }
  std::string text = "it changes " + change;
  const bool inertia = !GeometryDiffers(base, perturbed) &&
                       Same(base.gravity_W, perturbed.gravity_W) &&
                       !Which(base.bodies, perturbed.bodies, [](const Body& a, const Body& b) {
                          return !SameInertia(a, b);
                        }).empty();
  if (inertia) {
    const double effect = InertiaEffect(bench, perturbed);
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

}  // namespace
namespace {

class Mutator {
 public:
  /// `exact`: inverse dynamics, which says what an error does; null where `own` is the only one.
  Mutator(const MutationOptions& options, const MutationBench& own, const MutationBench* exact,
          MutationReport* report)
      : options_(options), own_(own), exact_(exact == nullptr ? own : *exact), report_(*report) {}

  void PerturbNumbers(const std::vector<Perturbable>& numbers) {
    for (size_t i = options_.part; i < numbers.size(); i += options_.parts) {
      fraction_ = static_cast<double>(i) / static_cast<double>(numbers.size());
      report_.mutations.push_back(Perturb(numbers[i]));
    }
  }

  void PutFaults() {
    const std::vector<StructuralFault> faults = StructuralFaults(own_.mechanism());
    for (size_t i = options_.part; i < faults.size(); i += options_.parts) {
      fraction_ = static_cast<double>(i) / static_cast<double>(faults.size());
      report_.faults.push_back(Put(faults[i]));
    }
  }

  [[nodiscard]] bool missed() const { return missed_; }

 private:
  void Count(const std::string& what) {
    if (options_.progress) options_.progress(what, fraction_);
    ++report_.runs;
  }

  [[nodiscard]] PerturbationSearch SearchOn(const MutationBench& bench) {
    return {options_, bench, [this](const std::string& what) { Count(what); }};
  }

  [[nodiscard]] bool two_benches() const { return &own_ != &exact_; }

  Mutation Perturb(const Perturbable& number) {
    Mutation m;
    m.name = number.name;
    m.unit = number.unit;
    m.kind = number.kind;
    m.value = number.value;
    m.relative_to = number.relative_to;
    PerturbationSearch exact = SearchOn(exact_);
    const Detection seen = exact.Look(number, true);
    // What inverse dynamics proves to have no effect needs no search by a coarser method.
    const bool acts = seen.detected || !std::isnan(seen.smallest) || Changes(seen);
    m.own = two_benches() ? SearchOn(own_).Look(number, acts) : seen;
    if (two_benches()) m.inverse = seen;
    if (m.own.detected) return m;
    if (Changes(seen)) missed_ = true;
    if (acts) {
      m.reason = fmt::format("its effect ({:.1e} in the drive forces) is below the limit",
                             seen.force_change);
    } else {
      Prove(number, exact.Weaker(), &m);
    }
    return m;
  }

  [[nodiscard]] bool Changes(const Detection& seen) const {
    return seen.force_change > MutationBench::Visible(exact_.base().ValueOf(exact_.ForceCheck()));
  }

  void Prove(const Perturbable& number, const Direction& way, Mutation* m) const {
    const double error = way.sign * way.unseen;
    m->proved_to = way.unseen;
    m->sensitivity = ForceSensitivity(exact_, way.run.trace);
    std::string why;
    const auto perturbed = exact_.Perturb(number.At(error), &why);
    m->reason = perturbed ? UnseenReason(exact_, *perturbed, way.run, number.Text(error)) : why;
  }

  FaultResult Put(const StructuralFault& fault) {
    FaultResult result;
    result.kind = fault.kind;
    result.where = fault.where;
    result.alike = fault.alike;
    result.reason = fault.not_applicable;
    if (fault.wrong.empty()) return result;
    if (own_.scenario().simulation.extrapolate) {
      result.reason = "the scenario extrapolates over models that are loaded anew";
      return result;
    }
    const std::optional<Tried> exact = FirstThatMoves(fault);
    if (!exact) {
      result.reason = fmt::format(
          "the simulation brings all of {} random starts to the same assembly, or to none",
          fault.wrong.size());
      return result;
    }
    result.applicable = true;
    result.own = See(exact_, exact->run);
    if (two_benches()) {
      result.inverse = result.own;
      Count(fault.kind);
      result.own = See(own_, own_.Run(fault.wrong[exact->candidate]));
    }
    if (!result.own.detected) result.own.reason = FaultUnseenReason(fault, exact->run);
    return result;
  }

  struct Tried {
    size_t candidate = 0;
    PerturbedRun run;
  };
  // The fault; of several candidates the first that runs and moves differently; empty when none
  // does.
  std::optional<Tried> FirstThatMoves(const StructuralFault& fault) {
    for (size_t k = 0; k < fault.wrong.size(); ++k) {
      Count(fault.kind);
      PerturbedRun run = exact_.Run(fault.wrong[k]);
      if (fault.wrong.size() == 1 || (run.ran && run.detected())) return Tried{k, std::move(run)};
    }
    return {};
  }

  static FaultDetection See(const MutationBench& bench, const PerturbedRun& run) {
    FaultDetection seen;
    seen.ran = run.ran;
    seen.detected = run.detected();
    if (!run.ran) {
      seen.check = "model";
      seen.reason = run.failure;
      return seen;
    }
    const BestCheck best = BestOf(bench, run);
    if (best.check == nullptr) return seen;
    seen.check = best.check->name;
    seen.value = best.check->value;
    seen.limit = *best.check->limit;
    return seen;
  }

  std::string FaultUnseenReason(const StructuralFault& fault, const PerturbedRun& run) {
    const double change = ForceSensitivity(exact_, run.trace);
    if (change > MutationBench::Visible(0.0)) {
      missed_ = true;
    } else if (!fault.first.empty()) {
      return SwapUnseenReason(exact_, fault.first, fault.second);
    }
    return UnseenReason(exact_, fault.wrong.front(), run, "it");
  }

  const MutationOptions& options_;
  const MutationBench &own_, &exact_;
  MutationReport& report_;
  double fraction_ = 0.0;
  bool missed_ = false;
};

// Those that are asked for; unknown names are findings.
std::vector<Perturbable> Chosen(const MutationOptions& options, std::vector<Perturbable> all,
                                MutationReport* report) {
  if (options.numbers.empty()) return all;
  std::vector<Perturbable> chosen;
  std::vector<std::string> names;
  names.reserve(all.size());
  for (const Perturbable& number : all) names.push_back(number.name);
  for (const std::string& wanted : options.numbers) {
    const auto found = std::find(names.begin(), names.end(), wanted);
    if (found != names.end()) {
      chosen.push_back(all[static_cast<size_t>(found - names.begin())]);
      continue;
    }
    Finding finding;
    finding.file = report->scenario;
    finding.message = fmt::format("the model has no number '{}' to perturb", wanted);
    finding.hint = DidYouMean(wanted, names);
    report->diagnostics.Add(std::move(finding));
    report->exit_code = 2;
  }
  return chosen;
}

std::vector<Perturbable> NumbersOf(const MutationBench& bench) {
  std::vector<Perturbable> numbers = PerturbablesOf(bench.mechanism(), bench.literals());
  // Its models are loaded anew, by parameters only.
  if (bench.scenario().simulation.extrapolate) {
    std::erase_if(numbers, [](const Perturbable& b) { return b.kind == NumberKind::kLiteral; });
  }
  return numbers;
}

// In inverse mode, if the scenario has another one and allows it; a reason not to is a warning.
// Where drives are force-controlled or servos, their forces show no error by themselves: inverse
// dynamics does, whatever modes are asked for.
std::unique_ptr<MutationBench> InverseBench(const MutationBench& own, const std::string& file,
                                            const MutationOptions& options,
                                            Diagnostics* diagnostics) {
  const SimulationSettings& simulation = own.scenario().simulation;
  const bool held = PrescribesMotion(simulation.mode);
  if (!simulation.forward() || (options.modes != MutationModes::kBoth && held)) return nullptr;
  Diagnostics findings;
  int ignored = 0;
  auto bench = MutationBench::Make(file, BenchMode::kInverse, &findings, &ignored);
  if (bench != nullptr) return bench;
  for (Finding finding : findings.findings()) {
    finding.severity = Severity::kWarning;
    finding.message = "in inverse mode: " + finding.message;
    diagnostics->Add(std::move(finding));
  }
  return nullptr;
}

}  // namespace

MutationReport MutateScenario(const std::string& file, const MutationOptions& options) {
  const ParsedDocuments documents;
  const auto start = std::chrono::steady_clock::now();
  MutationReport report;
  report.scenario = file;
  report.size = options.size;
  report.resolution = options.resolution;
  const BenchMode mode =
      options.modes == MutationModes::kInverse ? BenchMode::kInverse : BenchMode::kAsIs;
  const auto own = MutationBench::Make(file, mode, &report.diagnostics, &report.exit_code);
  if (own == nullptr) return report;
  report.mode = ModeText(own->scenario().simulation);
  const std::vector<Perturbable> numbers = Chosen(options, NumbersOf(*own), &report);
  if (report.exit_code != 0) return report;
  const auto exact = InverseBench(*own, file, options, &report.diagnostics);
  Mutator mutator(options, *own, exact.get(), &report);
  mutator.PerturbNumbers(numbers);
  if (options.structural && options.numbers.empty()) mutator.PutFaults();
  if (options.parts == 1) SortBySensitivity(&report);
  report.exit_code = mutator.missed() ? 1 : 0;
  report.wall_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  return report;
}

}  // namespace mbv
