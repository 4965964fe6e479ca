#include "kinematics/coupling_rows.h"

#include <algorithm>
#include <cmath>

#include "core/text.h"
#include "mechanism/joint_pose.h"

namespace mbv {
namespace {

// P(q) without constant, P′ and P″ by Horner's rule.
struct PolynomialJet {
  double value = 0.0, slope = 0.0, curvature = 0.0;
};

PolynomialJet PolynomialAt(const std::vector<double>& coefficients, double q) {
  PolynomialJet at;
  for (size_t i = coefficients.size(); i-- > 0;) {
    at.curvature = at.curvature * q + 2.0 * at.slope;
    at.slope = at.slope * q + at.value;
    at.value = at.value * q + coefficients[i];
  }
  // So far of P(q)/q.
  return {.value = at.value * q,
          .slope = at.slope * q + at.value,
          .curvature = at.curvature * q + 2.0 * at.slope};
}

// `near`: per term a value within half a turn.
CouplingRow RowOf(const Mechanism& mechanism, const Coupling& coupling, const BodyStates& states,
                  const double* near) {
  CouplingRow out;
  out.value = coupling.constant;
  for (const Coupling::Term& term : coupling.terms) {
    const Joint& joint = mechanism.joints[term.joint];
    ScalarRow row = JointCoordinateRow(joint, term.coordinate, states,
                                       near == nullptr ? joint.home[term.coordinate] : *near++);
    const double rate = RateOf(row, states.V_WB);
    const PolynomialJet P = PolynomialAt(term.polynomial, row.value);
    out.coordinates.push_back(row.value);
    row.value = P.value;
    row.bias = P.slope * row.bias + P.curvature * rate * rate;
    row.J_parent *= P.slope;
    row.J_child *= P.slope;
    out.value += row.value;
    out.angular = out.angular && !IsLength(joint.kind, term.coordinate);
    out.pieces.push_back(row);
  }
  if (!out.pieces.empty()) out.pieces.front().value += coupling.constant;
  return out;
}

}  // namespace

double CouplingRow::LargestPiece() const {
  double largest = 0.0;
  for (const ScalarRow& piece : pieces) largest = std::max(largest, std::abs(piece.value));
  return largest;
}

std::vector<CouplingRow> CouplingRows(const Mechanism& mechanism, const BodyStates& states) {
  std::vector<CouplingRow> rows;
  const double* near = states.coupled.empty() ? nullptr : states.coupled.data();
  for (const Coupling& coupling : mechanism.couplings) {
    rows.push_back(RowOf(mechanism, coupling, states, near));
    if (near != nullptr) near += coupling.terms.size();
  }
  return rows;
}

std::vector<CouplingRow> FollowCouplings(const Mechanism& mechanism, BodyStates* states) {
  std::vector<CouplingRow> rows = CouplingRows(mechanism, *states);
  states->coupled.clear();
  for (const CouplingRow& row : rows) {
    states->coupled.insert(states->coupled.end(), row.coordinates.begin(), row.coordinates.end());
  }
  return rows;
}

std::vector<ScalarRow> CoupledCoordinates(const Mechanism& mechanism, const BodyStates& states) {
  std::vector<ScalarRow> rows;
  for (const Coupling& coupling : mechanism.couplings) {
    for (const Coupling::Term& term : coupling.terms) {
      const Joint& joint = mechanism.joints[term.joint];
      const double near =
          states.coupled.empty() ? joint.home[term.coordinate] : states.coupled[rows.size()];
      rows.push_back(JointCoordinateRow(joint, term.coordinate, states, near));
    }
  }
  return rows;
}

std::vector<double> CoupledGuesses(const Mechanism& mechanism) {
  std::vector<double> guesses;
  for (const Coupling& coupling : mechanism.couplings) {
    for (const Coupling::Term& term : coupling.terms) {
      guesses.push_back(mechanism.joints[term.joint].guess[term.coordinate]);
    }
  }
  return guesses;
}

namespace {

// x near `start` with P(x) = value; `start` where Newton finds none.
double SolutionNear(const std::vector<double>& polynomial, double value, double start) {
  if (polynomial.size() == 1) return value / polynomial[0];
  constexpr int kMostSteps = 60;
  double x = start;
  for (int i = 0; i < kMostSteps; ++i) {
    const PolynomialJet P = PolynomialAt(polynomial, x);
    const double step = (value - P.value) / P.slope;
    if (!std::isfinite(step)) return start;
    x += step;
    if (std::abs(step) <= 4 * kEps * std::max(1.0, std::abs(x))) return x;
  }
  return start;
}

}  // namespace

void SolveFollowers(const Mechanism& mechanism, CoordinateSet* known,
                    std::vector<std::array<double, 6>>* q) {
  for (bool any = true; any;) {
    any = false;
    for (const Coupling& coupling : mechanism.couplings) {
      const Coupling::Term* unknown = nullptr;
      int count = 0;
      double sum = coupling.constant;
      for (const Coupling::Term& term : coupling.terms) {
        if (!known->contains({term.joint, term.coordinate})) {
          unknown = &term;
          ++count;
        } else {
          sum += PolynomialAt(term.polynomial, (*q)[term.joint][term.coordinate]).value;
        }
      }
      if (count != 1) continue;
      double& follower = (*q)[unknown->joint][unknown->coordinate];
      follower = SolutionNear(unknown->polynomial, -sum, follower);
      known->insert({unknown->joint, unknown->coordinate});
      any = true;
    }
  }
}

std::string CoupledJoints(const Mechanism& mechanism, const Coupling& coupling) {
  std::vector<std::string> names;
  for (const Coupling::Term& term : coupling.terms) {
    names.push_back(mechanism.joints[term.joint].name);
  }
  return Joined(names);
}

}  // namespace mbv
