#include "kinematics/constraints.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <vector>

#include "base/demand.h"
#include "base/text.h"
#include "kinematics/frame_pair.h"
#include "kinematics/home.h"
#include "kinematics/mobility.h"
#include "math/spatial.h"
#include "mechanism/joint_pose.h"

namespace mbv {
namespace {

using internal::Along;
using internal::Cosine;
using internal::FramePair;
using internal::MakePair;
using internal::PairScalar;
using internal::VariedPair;
using internal::VariedScalar;

// What frames between two bodies are made by: their pair, or its variation.
struct Here {
  const BodyStates& states;
  bool biases = true;
  [[nodiscard]] FramePair Between(int parent, const Pose& X_PF, int child, const Pose& X_CM) const {
    return MakePair(states, parent, X_PF, child, X_CM, biases);
  }
};
struct Varied {
  const BodyStates& states;
  const std::vector<Vec6>& by;
  [[nodiscard]] VariedPair Between(int parent, const Pose& X_PF, int child,
                                   const Pose& X_CM) const {
    return MakePair(states, by, parent, X_PF, child, X_CM);
  }
};
const PairScalar& Asked(const PairScalar& scalar) { return scalar; }
const PairScalar& Asked(const VariedScalar& scalar) { return scalar.by; }
// Of a constant.
double Offset(const Here& /*frames*/, double offset) { return offset; }
double Offset(const Varied& /*frames*/, double /*offset*/) { return 0.0; }

// Collects scalars as rows; `offset` is what the scalar should be.
class RowWriter {
 public:
  explicit RowWriter(ConstraintRows* rows) : rows_(*rows) {}

  void Add(const PairScalar& scalar, double offset = 0.0) {
    const int i = rows_.rows++;
    rows_.residual[i] = scalar.value - offset;
    Copy(scalar.J_parent, rows_.J_parent.row(i).data());
    Copy(scalar.J_child, rows_.J_child.row(i).data());
    rows_.bias[i] = scalar.bias;
  }
  void Translation(const PairScalar& scalar) {
    Add(scalar);
    ++rows_.translation_rows;
  }

 private:
  // One by one, as they were written: pairs would wait for both stores.
  static void Copy(const Vec6& from, double* to) {
    for (int k = 0; k < 6; ++k) {
      const volatile double& x = from.data()[k];
      to[k] = x;
    }
  }

  ConstraintRows& rows_;
};

template <typename Scalar>
ScalarRow ToRow(const Scalar& scalar, int parent, int child) {
  const PairScalar& asked = Asked(scalar);
  return {.parent = parent,
          .child = child,
          .value = asked.value,
          .J_parent = asked.J_parent,
          .J_child = asked.J_child,
          .bias = asked.bias};
}

void TurnNear(double near_value, double* angle) {
  constexpr double kTurn = 2 * std::numbers::pi;
  *angle += kTurn * std::round((near_value - *angle) / kTurn);
}

Pose At(const Vec3& point) { return Pose(Eigen::Translation3d(point)); }

template <typename Frames>
ConstraintRows RowsBy(const Joint& joint, const Frames& frames, bool reactions) {
  const auto pair = frames.Between(joint.parent, joint.X_PF, joint.child, joint.X_CM);
  ConstraintRows rows;
  rows.parent = joint.parent;
  rows.child = joint.child;
  RowWriter out(&rows);
  Mat3 directions;
  const int locked = LockedDirections(joint, &directions);
  for (int i = 0; i < locked; ++i) out.Translation(Asked(Along(pair, directions.col(i))));
  if (reactions && joint.transmits_force_only) return rows;
  std::array<LockedCosine, 3> cosines;
  const int turns = LockedCosines(joint, &cosines);
  for (int i = 0; i < turns; ++i) {
    out.Add(Asked(Cosine(pair, cosines[i].f_F, cosines[i].m_M)), Offset(frames, cosines[i].value));
  }
  return rows;
}

template <typename Frames>
ScalarRow JointRowBy(const Joint& joint, int coordinate, const Frames& frames) {
  const auto pair = frames.Between(joint.parent, joint.X_PF, joint.child, joint.X_CM);
  return ToRow(internal::CoordinateBetween(joint, coordinate, pair), joint.parent, joint.child);
}

// Of a distance drive or a spring.
template <typename Leg, typename Frames>
ScalarRow LegRowBy(const Leg& leg, const Frames& frames) {
  const auto pair = frames.Between(leg.body_from, At(leg.p_from), leg.body_to, At(leg.p_to));
  return ToRow(Distance(pair), leg.body_from, leg.body_to);
}

template <typename Frames>
ScalarRow OutputRowBy(const Output& output, int component, const Frames& frames) {
  MBV_DEMAND(component >= 0 && component < 6, component);
  const auto pair = frames.Between(output.reference_body, output.X_RbR, output.body, output.X_BO);
  return ToRow(
      component < 3 ? Along(pair, Vec3::Unit(component)) : RollPitchYaw(pair, component - 3),
      output.reference_body, output.body);
}

template <typename Frames>
ScalarRow BushingRowBy(const Bushing& bushing, int coordinate, const Frames& frames) {
  MBV_DEMAND(coordinate >= 0 && coordinate < 6, coordinate);
  const auto pair = frames.Between(bushing.parent, bushing.X_PF, bushing.child, bushing.X_CM);
  return ToRow(
      coordinate < 3 ? Along(pair, Vec3::Unit(coordinate)) : RotationVector(pair, coordinate - 3),
      bushing.parent, bushing.child);
}

}  // namespace

ConstraintRows RowsOf(const Joint& joint, const BodyStates& states, bool reactions, bool biases) {
  return RowsBy(joint, Here{states, biases}, reactions);
}

ScalarRow JointCoordinateRow(const Joint& joint, int coordinate, const BodyStates& states,
                             double near_value) {
  ScalarRow row = JointRowBy(joint, coordinate, Here{states});
  if (!IsLength(joint.kind, coordinate)) TurnNear(near_value, &row.value);
  return row;
}

ScalarRow DriveRow(const Mechanism& mechanism, const Drive& drive, const BodyStates& states,
                   double near_value) {
  if (const auto* on_joint = std::get_if<JointDrive>(&drive.kind)) {
    return JointCoordinateRow(mechanism.joints[on_joint->joint], on_joint->coordinate, states,
                              near_value);
  }
  return LegRowBy(std::get<DistanceDrive>(drive.kind), Here{states});
}

ScalarRow OutputRow(const Output& output, int component, const BodyStates& states,
                    double near_value) {
  ScalarRow row = OutputRowBy(output, component, Here{states});
  if (component >= 3) TurnNear(near_value, &row.value);
  return row;
}

ScalarRow BushingRow(const Bushing& bushing, int coordinate, const BodyStates& states) {
  return BushingRowBy(bushing, coordinate, Here{states});
}

ScalarRow CoordinateRow(const Mechanism& mechanism, const Coordinate& coordinate,
                        const BodyStates& states, double near_value) {
  switch (coordinate.kind) {
    case Coordinate::Kind::kPrescribed:
      return JointCoordinateRow(mechanism.joints[mechanism.prescribed[coordinate.index].joint], 0,
                                states, near_value);
    case Coordinate::Kind::kDrive:
      return DriveRow(mechanism, mechanism.drives[coordinate.index], states, near_value);
    case Coordinate::Kind::kOutput:
      return OutputRow(mechanism.outputs[coordinate.index], coordinate.component, states,
                       near_value);
    case Coordinate::Kind::kJoint:
      return JointCoordinateRow(mechanism.joints[coordinate.index], coordinate.component, states,
                                near_value);
  }
  ThrowDemand("known coordinate kind", __FILE__, __LINE__, "?");
}

namespace {

// P(q) without constant, P′, P″ and P‴ by Horner's rule.
struct PolynomialJet {
  double value = 0.0, slope = 0.0, curvature = 0.0, third = 0.0;
};

PolynomialJet PolynomialAt(const std::vector<double>& coefficients, double q) {
  PolynomialJet at;
  for (size_t i = coefficients.size(); i-- > 0;) {
    at.third = at.third * q + 3.0 * at.curvature;
    at.curvature = at.curvature * q + 2.0 * at.slope;
    at.slope = at.slope * q + at.value;
    at.value = at.value * q + coefficients[i];
  }
  // So far of P(q)/q.
  return {.value = at.value * q,
          .slope = at.slope * q + at.value,
          .curvature = at.curvature * q + 2.0 * at.slope,
          .third = at.third * q + 3.0 * at.curvature};
}

// `near`: per term a value within half a turn.
void FillRow(const Mechanism& mechanism, const Coupling& coupling, const BodyStates& states,
             const double* near, CouplingRow* out) {
  out->pieces.clear();
  out->coordinates.clear();
  out->angular = true;
  out->value = coupling.constant;
  for (const Coupling::Term& term : coupling.terms) {
    const Joint& joint = mechanism.joints[term.joint];
    ScalarRow row = JointCoordinateRow(joint, term.coordinate, states,
                                       near == nullptr ? joint.home[term.coordinate] : *near++);
    const double rate = RateOf(row, states.V_WB);
    const PolynomialJet P = PolynomialAt(term.polynomial, row.value);
    out->coordinates.push_back(row.value);
    row.value = P.value;
    row.bias = P.slope * row.bias + P.curvature * rate * rate;
    row.J_parent *= P.slope;
    row.J_child *= P.slope;
    out->value += row.value;
    out->angular = out->angular && !IsLength(joint.kind, term.coordinate);
    out->pieces.push_back(row);
  }
  if (!out->pieces.empty()) out->pieces.front().value += coupling.constant;
}

void FillRows(const Mechanism& mechanism, const BodyStates& states,
              std::vector<CouplingRow>* rows) {
  rows->resize(mechanism.couplings.size());
  const double* near = states.coupled.empty() ? nullptr : states.coupled.data();
  for (size_t c = 0; c < rows->size(); ++c) {
    const Coupling& coupling = mechanism.couplings[c];
    FillRow(mechanism, coupling, states, near, &(*rows)[c]);
    if (near != nullptr) near += coupling.terms.size();
  }
}

}  // namespace

double CouplingRow::LargestPiece() const {
  double largest = 0.0;
  for (const ScalarRow& piece : pieces) largest = std::max(largest, std::abs(piece.value));
  return largest;
}

std::vector<CouplingRow> CouplingRows(const Mechanism& mechanism, const BodyStates& states) {
  std::vector<CouplingRow> rows;
  FillRows(mechanism, states, &rows);
  return rows;
}

void FollowCouplings(const Mechanism& mechanism, BodyStates* states,
                     std::vector<CouplingRow>* rows) {
  FillRows(mechanism, *states, rows);
  states->coupled.clear();
  for (const CouplingRow& row : *rows) {
    states->coupled.insert(states->coupled.end(), row.coordinates.begin(), row.coordinates.end());
  }
}

void FollowCouplings(const Mechanism& mechanism, BodyStates* states) {
  std::vector<CouplingRow> rows;
  FollowCouplings(mechanism, states, &rows);
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

namespace {

// Drives, then prescribed joints.
size_t CountDriven(const Mechanism& mechanism) {
  return mechanism.drives.size() + mechanism.prescribed.size();
}
Coordinate Driven(const Mechanism& mechanism, size_t k) {
  const size_t drives = mechanism.drives.size();
  if (k < drives) return {Coordinate::Kind::kDrive, static_cast<int>(k), 0};
  return {Coordinate::Kind::kPrescribed, static_cast<int>(k - drives), 0};
}

// Where nothing was followed yet, the poses lie within half a turn of home.
std::vector<double>* TurnsOf(const Mechanism& mechanism, BodyStates* states) {
  if (!states->turns.empty()) return &states->turns;
  for (const ForceElement& element : mechanism.elements) {
    const Coordinate on{Coordinate::Kind::kJoint, element.joint, element.coordinate};
    states->turns.push_back(element.joint < 0 ? 0.0 : HomeValue(mechanism, on));
  }
  for (size_t k = 0; k < CountDriven(mechanism); ++k) {
    states->turns.push_back(HomeValue(mechanism, Driven(mechanism, k)));
  }
  return &states->turns;
}

// c + ċ Δt + c̈ Δt²/2
double Later(const ScalarRow& row, const BodyStates& states, double dt_s) {
  return row.value +
         dt_s * (RateOf(row, states.V_WB) + 0.5 * dt_s * (RateOf(row, states.A_WB) + row.bias));
}

}  // namespace

namespace {

// (1) of ForceElement.
ScalarRow BallRow(const Joint& joint, int coordinate, const BodyStates& states) {
  const auto p = static_cast<size_t>(joint.parent), c = static_cast<size_t>(joint.child);
  const Vec3 a =
      states.X_WB[c].linear() * joint.X_CM.linear().col(BallAxis(joint.kind, coordinate));
  const Vec3 w_P = states.V_WB[p].head<3>(), w_C = states.V_WB[c].head<3>();
  ScalarRow row{.parent = joint.parent, .child = joint.child, .bias = a.dot(w_C.cross(w_P))};
  row.J_parent.head<3>() = -a;
  row.J_child.head<3>() = a;
  return row;
}

}  // namespace

ScalarRow ElementRow(const Mechanism& mechanism, size_t e, const BodyStates& states) {
  const ForceElement& element = mechanism.elements[e];
  if (element.drive >= 0) {
    return DriveRow(mechanism, mechanism.drives[static_cast<size_t>(element.drive)], states);
  }
  if (element.bushing >= 0) {
    return BushingRow(mechanism.bushings[static_cast<size_t>(element.bushing)], element.coordinate,
                      states);
  }
  if (element.spring >= 0) {
    return LegRowBy(mechanism.springs[static_cast<size_t>(element.spring)], Here{states});
  }
  const Joint& joint = mechanism.joints[static_cast<size_t>(element.joint)];
  if (IsOfBall(joint.kind, element.coordinate)) return BallRow(joint, element.coordinate, states);
  const double near =
      states.turns.empty() ? joint.home[static_cast<size_t>(element.coordinate)] : states.turns[e];
  return JointCoordinateRow(joint, element.coordinate, states, near);
}

std::vector<ScalarRow> ElementRows(const Mechanism& mechanism, const BodyStates& states) {
  std::vector<ScalarRow> rows;
  for (size_t e = 0; e < mechanism.elements.size(); ++e) {
    rows.push_back(ElementRow(mechanism, e, states));
  }
  return rows;
}

ScalarRow DrivenRow(const Mechanism& mechanism, size_t k, const BodyStates& states) {
  const Coordinate driven = Driven(mechanism, k);
  const double near = states.turns.empty() ? HomeValue(mechanism, driven)
                                           : states.turns[mechanism.elements.size() + k];
  return CoordinateRow(mechanism, driven, states, near);
}

void FollowElements(const Mechanism& mechanism, BodyStates* states) {
  if (mechanism.elements.empty()) return;
  std::vector<double>& turns = *TurnsOf(mechanism, states);
  for (size_t e = 0; e < mechanism.elements.size(); ++e) {
    turns[e] = ElementRow(mechanism, e, *states).value;
  }
}

void FollowDriven(const Mechanism& mechanism, BodyStates* states) {
  double* turns = TurnsOf(mechanism, states)->data() + mechanism.elements.size();
  for (size_t k = 0; k < CountDriven(mechanism); ++k) {
    turns[k] = DrivenRow(mechanism, k, *states).value;
  }
}

void PredictTurns(const Mechanism& mechanism, double dt_s, BodyStates* states) {
  std::vector<double>& turns = *TurnsOf(mechanism, states);
  const size_t elements = mechanism.elements.size();
  for (size_t e = 0; e < elements; ++e) {
    turns[e] = Later(ElementRow(mechanism, e, *states), *states, dt_s);
  }
  for (size_t k = 0; k < CountDriven(mechanism); ++k) {
    turns[elements + k] = Later(DrivenRow(mechanism, k, *states), *states, dt_s);
  }
  std::vector<double>& coupled = states->coupled;
  const bool at_home = coupled.empty();
  size_t at = 0;
  for (const Coupling& coupling : mechanism.couplings) {
    for (const Coupling::Term& term : coupling.terms) {
      const Joint& joint = mechanism.joints[term.joint];
      if (at_home) coupled.push_back(joint.home[term.coordinate]);
      coupled[at] =
          Later(JointCoordinateRow(joint, term.coordinate, *states, coupled[at]), *states, dt_s);
      ++at;
    }
  }
}

ConstraintRows VariedRowsOf(const Joint& joint, const BodyStates& states,
                            const std::vector<Vec6>& by, bool reactions) {
  return RowsBy(joint, Varied{states, by}, reactions);
}

ScalarRow VariedDriveRow(const Mechanism& mechanism, const Drive& drive, const BodyStates& states,
                         const std::vector<Vec6>& by) {
  if (const auto* on = std::get_if<JointDrive>(&drive.kind)) {
    return JointRowBy(mechanism.joints[on->joint], on->coordinate, Varied{states, by});
  }
  return LegRowBy(std::get<DistanceDrive>(drive.kind), Varied{states, by});
}

ScalarRow VariedRow(const Mechanism& mechanism, const Coordinate& coordinate,
                    const BodyStates& states, const std::vector<Vec6>& by) {
  const Varied frames{states, by};
  switch (coordinate.kind) {
    case Coordinate::Kind::kPrescribed:
      return JointRowBy(mechanism.joints[mechanism.prescribed[coordinate.index].joint], 0, frames);
    case Coordinate::Kind::kDrive:
      return VariedDriveRow(mechanism, mechanism.drives[coordinate.index], states, by);
    case Coordinate::Kind::kOutput:
      return OutputRowBy(mechanism.outputs[coordinate.index], coordinate.component, frames);
    case Coordinate::Kind::kJoint:
      return JointRowBy(mechanism.joints[coordinate.index], coordinate.component, frames);
  }
  ThrowDemand("known coordinate kind", __FILE__, __LINE__, "?");
}

std::vector<CouplingRow> VariedCouplingRows(const Mechanism& mechanism, const BodyStates& states,
                                            const std::vector<Vec6>& by) {
  std::vector<CouplingRow> rows;
  size_t at = 0;
  for (const Coupling& coupling : mechanism.couplings) {
    CouplingRow& out = rows.emplace_back();
    out.angular = true;
    for (const Coupling::Term& term : coupling.terms) {
      const Joint& joint = mechanism.joints[term.joint];
      const double near = states.coupled.empty() ? joint.home[term.coordinate] : states.coupled[at];
      ++at;
      const ScalarRow row = JointCoordinateRow(joint, term.coordinate, states, near);
      ScalarRow varied = JointRowBy(joint, term.coordinate, Varied{states, by});
      const PolynomialJet P = PolynomialAt(term.polynomial, row.value);
      const double rate = RateOf(row, states.V_WB), moved = varied.value;
      varied.bias = P.slope * varied.bias + P.curvature * moved * row.bias +
                    P.third * moved * rate * rate +
                    2.0 * P.curvature * rate * RateOf(varied, states.V_WB);
      varied.J_parent = P.slope * varied.J_parent + P.curvature * moved * row.J_parent;
      varied.J_child = P.slope * varied.J_child + P.curvature * moved * row.J_child;
      varied.value = P.slope * moved;
      out.value += varied.value;
      out.angular = out.angular && !IsLength(joint.kind, term.coordinate);
      out.pieces.push_back(varied);
    }
  }
  return rows;
}

ScalarRow VariedElementRow(const Mechanism& mechanism, size_t e, const BodyStates& states,
                           const std::vector<Vec6>& by) {
  const ForceElement& element = mechanism.elements[e];
  if (element.drive >= 0) {
    return VariedDriveRow(mechanism, mechanism.drives[static_cast<size_t>(element.drive)], states,
                          by);
  }
  if (element.bushing >= 0) {
    return BushingRowBy(mechanism.bushings[static_cast<size_t>(element.bushing)],
                        element.coordinate, Varied{states, by});
  }
  if (element.spring >= 0) {
    return LegRowBy(mechanism.springs[static_cast<size_t>(element.spring)], Varied{states, by});
  }
  const Joint& joint = mechanism.joints[static_cast<size_t>(element.joint)];
  if (!IsOfBall(joint.kind, element.coordinate)) {
    return JointRowBy(joint, element.coordinate, Varied{states, by});
  }
  ScalarRow row = BallRow(joint, element.coordinate, states);
  const auto p = static_cast<size_t>(row.parent), c = static_cast<size_t>(row.child);
  const Vec3 a = by[c].head<3>().cross(row.J_child.head<3>());
  row.bias = a.dot(states.V_WB[c].head<3>().cross(states.V_WB[p].head<3>()));
  row.J_parent.head<3>() = -a;
  row.J_child.head<3>() = a;
  return row;
}

namespace {

// Angles between these are suspected: round-off is smaller, a drawing has larger ones.
constexpr double kSmallest_rad = 1e-9, kLargest_rad = 0.1;

bool IsHinge(const Joint& joint) {
  return joint.kind == JointKind::kRevolute || joint.kind == JointKind::kCylindrical;
}
bool HasOneAxis(const Joint& joint) {
  return IsHinge(joint) || joint.kind == JointKind::kPrismatic;
}

// The axis of a joint in a body that it connects.
Vec3 AxisOn(const Joint& joint, int body) {
  return (joint.parent == body ? joint.X_PF : joint.X_CM).linear() * joint.axis;
}

// Where the axis of `joint` would be beside that of `other`: parallel, or perpendicular if one
// slides and one turns.
Vec3 AlignedAxis(const Joint& joint, const Joint& other, int body) {
  const Vec3 own = AxisOn(joint, body), near = AxisOn(other, body);
  const Vec3 along = near * near.dot(own);
  return (IsHinge(joint) == IsHinge(other) ? along : Vec3(own - along)).normalized();
}

struct Suspicion {
  int joint, other, body;
  double angle_rad;
};

std::vector<Suspicion> Suspicions(const Mechanism& mechanism) {
  std::vector<Suspicion> found;
  const auto count = static_cast<int>(mechanism.joints.size());
  for (int j = 0; j < count; ++j) {
    for (int k = 0; k < count; ++k) {
      const Joint &a = mechanism.joints[j], &b = mechanism.joints[k];
      if (j == k || !HasOneAxis(a) || !HasOneAxis(b)) continue;
      for (const int body : {a.parent, a.child}) {
        if (body != b.parent && body != b.child) continue;
        const Vec3 own = AxisOn(a, body);
        const double angle = std::asin(std::min(1.0, own.cross(AlignedAxis(a, b, body)).norm()));
        if (angle > kSmallest_rad && angle < kLargest_rad) found.push_back({j, k, body, angle});
      }
    }
  }
  // The culprit misses its neighbours on both of its bodies.
  const auto misses = [&](int joint) {
    return std::count_if(found.begin(), found.end(),
                         [&](const Suspicion& s) { return s.joint == joint; });
  };
  std::stable_sort(found.begin(), found.end(), [&](const Suspicion& a, const Suspicion& b) {
    return misses(a.joint) > misses(b.joint);
  });
  return found;
}

// The joint with its axis turned to its neighbours' on every body where it misses one.
Mechanism WithAligned(const Mechanism& mechanism, int joint, const std::vector<Suspicion>& all) {
  Mechanism aligned = mechanism;
  Joint& own = aligned.joints[joint];
  for (const int body : {own.parent, own.child}) {
    const auto found = std::find_if(all.begin(), all.end(), [&](const Suspicion& s) {
      return s.joint == joint && s.body == body;
    });
    if (found == all.end()) continue;
    const Vec3 to = AlignedAxis(own, aligned.joints[found->other], body);
    Pose& frame = own.parent == body ? own.X_PF : own.X_CM;
    frame.linear() = LeastRotation(AxisOn(own, body), to) * frame.linear();
  }
  return aligned;
}

int PassiveDofs(Mechanism mechanism) {
  mechanism.drives.clear();
  mechanism.prescribed.clear();
  return CountDofs(mechanism);
}

}  // namespace

std::optional<TiltedAxis> FindTiltedAxis(const Mechanism& mechanism, bool closed_at_home) {
  const std::vector<Suspicion> suspicions = Suspicions(mechanism);
  if (suspicions.empty()) return {};
  const int dofs = closed_at_home ? PassiveDofs(mechanism) : 0;
  const auto driven = static_cast<int>(mechanism.drives.size() + mechanism.prescribed.size());
  if (closed_at_home && dofs >= std::max(1, driven)) return {};
  int tried = -1;
  for (const Suspicion& s : suspicions) {
    if (s.joint == tried) continue;
    tried = s.joint;
    Mechanism aligned = WithAligned(mechanism, s.joint, suspicions);
    if (!SolveHome(&aligned).closed) continue;
    const int more = PassiveDofs(aligned);
    if (closed_at_home && more <= dofs) continue;
    return TiltedAxis{s.joint, s.other, s.body, s.angle_rad, dofs, more};
  }
  return {};
}

}  // namespace mbv

namespace mbv::internal {

Eigen::RowVectorXd RowAlong(const ScalarRow& row, const MatX& J) {
  return row.J_parent.transpose() * J.middleRows<6>(6 * row.parent) +
         row.J_child.transpose() * J.middleRows<6>(6 * row.child);
}

MatX LoopRows(const Mechanism& mechanism, const std::vector<Spin>& spins, const BodyStates& states,
              const MatX& J, double length) {
  std::vector<Eigen::RowVectorXd> rows;
  for (const Joint& joint : mechanism.joints) {
    if (!joint.closure) continue;
    const ConstraintRows closure = RowsOf(joint, states, false, false);
    for (int i = 0; i < closure.rows; ++i) {
      rows.emplace_back((i < closure.translation_rows ? 1.0 : length) *
                        (closure.J_parent.row(i) * J.middleRows<6>(6 * closure.parent) +
                         closure.J_child.row(i) * J.middleRows<6>(6 * closure.child)));
    }
  }
  for (const CouplingRow& coupling : CouplingRows(mechanism, states)) {
    Eigen::RowVectorXd row = Eigen::RowVectorXd::Zero(J.cols());
    for (const ScalarRow& piece : coupling.pieces) row += RowAlong(piece, J);
    rows.emplace_back((coupling.angular ? length : 1.0) * row);
  }
  for (const Spin& spin : spins) rows.emplace_back(length * RowAlong(IdleRow(spin, states), J));
  MatX A(static_cast<Eigen::Index>(rows.size()), J.cols());
  for (size_t r = 0; r < rows.size(); ++r) A.row(static_cast<Eigen::Index>(r)) = rows[r];
  return A;
}

}  // namespace mbv::internal
