#include "comparison/energy_audit.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "comparison/force_scale.h"

namespace mbv {
namespace {

// The energy scale is never below what the force scale does over this share of the
// characteristic length.
constexpr double kShortest = 1e-3;
// A part explains the drift if what is left of it, RMS, is below this share; two parts that do so
// equally well (within the second factor) are both named.
constexpr double kExplained = 0.3, kTie = 2.0;

struct Curve {
  std::string name;
  bool stored = false;  // a change of energy; otherwise work
  VecX values;          // [J], 0 at the start
};

// ∫ P dt by the cubics through four samples each.
VecX Integral(const VecX& P, double h) {
  const Eigen::Index n = P.size();
  VecX work = VecX::Zero(n);
  for (Eigen::Index i = 0; i + 1 < n; ++i) {
    double sum = 0.0;
    if (i == 0) {
      sum = 9 * P[0] + 19 * P[1] - 5 * P[2] + P[3];
    } else if (i + 2 < n) {
      sum = -P[i - 1] + 13 * P[i] + 13 * P[i + 1] - P[i + 2];
    } else {
      sum = P[i - 2] - 5 * P[i - 1] + 19 * P[i] + 9 * P[i + 1];
    }
    work[i + 1] = work[i] + h / 24.0 * sum;
  }
  return work;
}

std::optional<VecX> Column(const Trace& trace, Quantity quantity, const std::string& subject = "") {
  const int column = trace.Find(quantity, subject);
  if (column < 0) return {};
  return trace.values.col(column);
}

// Works of drives, base, loads and dampers: integrated by the witness, or from its powers.
bool AddWorks(const Mechanism& mechanism, const Trace& trace, std::vector<Curve>* curves) {
  const double h = trace.time_s[1] - trace.time_s[0];
  bool integrated = true;
  const auto add = [&](const std::string& title, const std::optional<VecX>& work,
                       const VecX& power) {
    if (work) {
      curves->push_back({title, false, *work});
      return;
    }
    integrated = false;
    if (power.size() > 0) curves->push_back({title, false, Integral(power, h)});
  };
  const VecX none;
  for (const Drive& drive : mechanism.drives) {
    const auto force = Column(trace, Quantity::kForce, drive.name);
    const auto velocity = Column(trace, Quantity::kVelocity, drive.name);
    add(drive.name, Column(trace, Quantity::kWork, drive.name),
        force && velocity ? VecX(force->cwiseProduct(*velocity)) : none);
  }
  for (const Prescribed& base : mechanism.prescribed) {
    if (const auto work = Column(trace, Quantity::kBaseWork, base.name)) {
      curves->push_back({base.name, false, *work});
    }
  }
  if (!mechanism.prescribed.empty() && !integrated) {
    add("base motion", {}, Column(trace, Quantity::kBasePower).value_or(none));
  }
  add("loads", Column(trace, Quantity::kLoadWork),
      Column(trace, Quantity::kLoadPower).value_or(none));
  add("dampers", Column(trace, Quantity::kDamperWork),
      Column(trace, Quantity::kDamperPower).value_or(none));
  return integrated;
}

// A base that moves bodies which no drive carries turns over energy of its own, which must not hide
// what the drives do: the energy turned over counts up to what the carried bodies can take in this
// time, or the drives have done. Of the rest the integration of the base's work leaves a share:
// 4e-9 at 1 ms on a vehicle of 1e9 kg that goes to and fro.
struct EnergySize {
  double scale_J = 0.0, leaves_J = 0.0;
};
EnergySize SizeOfEnergy(const ComparisonInput& input, const Trace& trace,
                        const std::vector<Curve>& curves, double turned_over_J) {
  constexpr double kLeft = 1e-8;
  const ForceScale force = ForceScaleOf(input, trace);
  const double least = kShortest * force.length_m * force.force_N;
  if (input.mechanism->prescribed.empty()) return {std::max(turned_over_J, least), 0.0};
  double carried = force.power_W * (trace.time_s.back() - trace.time_s.front());
  for (const Curve& curve : curves) {
    if (input.mechanism->FindDrive(curve.name) < 0) continue;
    carried = std::max(carried, curve.values.cwiseAbs().maxCoeff());
  }
  return {std::max(std::min(turned_over_J, carried), least),
          turned_over_J > carried ? kLeft * turned_over_J : 0.0};
}

// The parts that the drift is proportional to: drift = share · part.
void NameCulprit(const std::vector<Curve>& curves, const VecX& drift, EnergyAudit* audit) {
  const double size = drift.norm();
  double best = kExplained;
  std::vector<std::pair<double, const Curve*>> fits;
  for (const Curve& curve : curves) {
    const double norm2 = curve.values.squaredNorm();
    if (!(norm2 > 0.0)) continue;
    const double left = (drift - drift.dot(curve.values) / norm2 * curve.values).norm() / size;
    fits.emplace_back(left, &curve);
    best = std::min(best, left);
  }
  std::string text;
  for (const auto& [left, curve] : fits) {
    if (left > kExplained || left > kTie * best) continue;
    const double share = drift.dot(curve->values) / curve->values.squaredNorm();
    if (audit->culprit.empty()) {
      audit->culprit = curve->name;
      audit->share = share;
    }
    // Work that is stated too large is energy that is missing.
    const double excess = curve->stored ? share : -share;
    text += fmt::format("{}{} of {} that is {:.2g} % too {}", text.empty() ? "" : " or ",
                        curve->stored ? "a change" : "work", curve->name, 100.0 * std::abs(excess),
                        excess > 0.0 ? "large" : "small");
  }
  audit->text += text.empty() ? "; it follows no single part" : "; it looks like " + text;
}

}  // namespace

std::optional<EnergyAudit> AuditEnergy(const ComparisonInput& input, const Trace& trace,
                                       std::optional<double> limit) {
  const auto kinetic = Column(trace, Quantity::kKineticEnergy);
  const auto gravity = Column(trace, Quantity::kGravityEnergy);
  const auto springs = Column(trace, Quantity::kSpringEnergy);
  const auto n = static_cast<Eigen::Index>(trace.time_s.size());
  if (!kinetic || !gravity || !springs || n < 4) return {};
  std::vector<Curve> curves;
  for (const auto& [name, energy] :
       {std::pair{"kinetic energy", &*kinetic}, std::pair{"gravity", &*gravity},
        std::pair{"springs", &*springs}}) {
    curves.push_back({name, true, (energy->array() - (*energy)[0]).matrix()});
  }
  EnergyAudit audit;
  audit.witness = trace.witness;
  audit.integrated = AddWorks(*input.mechanism, trace, &curves);
  // Work from samples has their error: it is not judged, and nothing is to blame.
  if (!audit.integrated) limit.reset();
  VecX drift = VecX::Zero(n), work = VecX::Zero(n);
  for (const Curve& curve : curves) {
    drift += curve.stored ? curve.values : VecX(-curve.values);
    if (!curve.stored) work += curve.values;
    audit.parts.push_back(
        {curve.name, curve.stored, curve.values[n - 1], curve.values.cwiseAbs().maxCoeff()});
  }
  const EnergySize size =
      SizeOfEnergy(input, trace, curves, std::max(kinetic->maxCoeff(), work.cwiseAbs().maxCoeff()));
  audit.scale_J = drift.allFinite() ? size.scale_J : kNan;
  for (Eigen::Index i = 0; i < n; ++i) {
    const double value = std::max(0.0, std::abs(drift[i]) - size.leaves_J) / audit.scale_J,
                 t_s = trace.time_s[static_cast<size_t>(i)];
    KeepWorst(&audit.drift, value, t_s, "energy");
    if (limit && value > *limit && std::isnan(audit.from_s)) audit.from_s = t_s;
  }
  audit.drift_J = drift.cwiseAbs().maxCoeff();
  audit.end_drift_J = drift[n - 1];
  if (std::isnan(audit.from_s)) return audit;
  audit.text = fmt::format(
      "energy drifts by {:.2g} J, {:.1e} of the energy turned over, from t = {:.4g} s on",
      audit.drift_J, audit.drift.value, audit.from_s);
  NameCulprit(curves, drift, &audit);
  return audit;
}

}  // namespace mbv
