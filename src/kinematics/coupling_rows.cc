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

double RateOf(const ScalarRow& row, const BodyStates& states) {
  return row.J_parent.dot(states.V_WB[row.parent]) + row.J_child.dot(states.V_WB[row.child]);
}

// Index in BodyStates::coupled of a coupling's first term.
size_t FirstTerm(const Mechanism& mechanism, const Coupling& coupling) {
  size_t first = 0;
  for (const Coupling& other : mechanism.couplings) {
    if (&other == &coupling) break;
    first += other.terms.size();
  }
  return first;
}

double NearValue(const Mechanism& mechanism, const Coupling::Term& term, const BodyStates& states,
                 size_t index) {
  if (index < states.coupled.size()) return states.coupled[index];
  return mechanism.joints[term.joint].home[term.coordinate];
}

template <typename Value>
std::vector<double> PerTerm(const Mechanism& mechanism, const Value& value) {
  std::vector<double> values;
  for (const Coupling& coupling : mechanism.couplings) {
    for (const Coupling::Term& term : coupling.terms) values.push_back(value(term, values.size()));
  }
  return values;
}

}  // namespace

double CouplingRow::LargestPiece() const {
  double largest = 0.0;
  for (const ScalarRow& piece : pieces) largest = std::max(largest, std::abs(piece.value));
  return largest;
}

CouplingRow RowOf(const Mechanism& mechanism, const Coupling& coupling, const BodyStates& states) {
  CouplingRow out;
  size_t index = FirstTerm(mechanism, coupling);
  out.value = coupling.constant;
  for (const Coupling::Term& term : coupling.terms) {
    const Joint& joint = mechanism.joints[term.joint];
    ScalarRow row = JointCoordinateRow(joint, term.coordinate, states,
                                       NearValue(mechanism, term, states, index++));
    const double rate = RateOf(row, states);
    const PolynomialJet P = PolynomialAt(term.polynomial, row.value);
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

void FollowCouplings(const Mechanism& mechanism, BodyStates* states) {
  if (mechanism.couplings.empty()) return;
  states->coupled = PerTerm(mechanism, [&](const Coupling::Term& term, size_t index) {
    return JointCoordinateRow(mechanism.joints[term.joint], term.coordinate, *states,
                              NearValue(mechanism, term, *states, index))
        .value;
  });
}

std::vector<double> CoupledGuesses(const Mechanism& mechanism) {
  return PerTerm(mechanism, [&](const Coupling::Term& term, size_t) {
    return mechanism.joints[term.joint].guess[term.coordinate];
  });
}

std::string CoupledJoints(const Mechanism& mechanism, const Coupling& coupling) {
  std::vector<std::string> names;
  for (const Coupling::Term& term : coupling.terms) {
    names.push_back(mechanism.joints[term.joint].name);
  }
  return Joined(names);
}

}  // namespace mbv
