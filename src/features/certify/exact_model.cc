#include "features/certify/exact_model.h"

#include <array>
#include <cstdlib>
#include <new>

#include "features/certify/exact_numbers.h"

namespace mbv::exact {
namespace {

// Freed blocks by size, linked through their first bytes; numbers of 240 bits take 40.
constexpr size_t kLargestKept = 64;
thread_local std::array<void*, kLargestKept + 1> kept_blocks{};

bool IsKept(size_t size) { return size >= sizeof(void*) && size <= kLargestKept; }
void* NewBlock(size_t size) {
  if (IsKept(size) && kept_blocks[size] != nullptr) {
    return std::exchange(kept_blocks[size], *static_cast<void**>(kept_blocks[size]));
  }
  void* block = std::malloc(size);  // NOLINT: what GMP's other functions free
  if (block == nullptr) throw std::bad_alloc();
  return block;
}
void FreeBlock(void* block, size_t size) {
  if (IsKept(size) && block != nullptr) {
    *static_cast<void**>(block) = std::exchange(kept_blocks[size], block);
  } else {
    std::free(block);  // NOLINT
  }
}
void* ResizedBlock(void* block, size_t /*size*/, size_t size) {
  block = std::realloc(block, size);  // NOLINT
  if (block == nullptr) throw std::bad_alloc();
  return block;
}

}  // namespace

NumberPool::NumberPool() {
  mp_get_memory_functions(&allocate_, &reallocate_, &free_);
  mp_set_memory_functions(NewBlock, ResizedBlock, FreeBlock);
}

NumberPool::~NumberPool() {
  mp_set_memory_functions(allocate_, reallocate_, free_);
  for (void*& first : kept_blocks) {
    while (first != nullptr) {
      std::free(std::exchange(first, *static_cast<void**>(first)));  // NOLINT
    }
  }
}

namespace {

template <typename T>
Vector<T> Axis(size_t i) {
  Vector<T> e{{T(0), T(0), T(0)}};
  e[i] = T(1);
  return e;
}

// e1, e2 across a joint's axis, and the axis: the directions of planar joints' coordinates.
template <typename T>
std::array<Vector<T>, 3> Basis(const Joint& joint) {
  const Vector<T> a = Unit(Lifted<T>(joint.axis)), e0 = Lifted<T>(JointBasis(joint).col(0));
  const Vector<T> e1 = Unit(e0 - Times(Dot(a, e0), a));
  return {e1, Cross(a, e1), a};
}

// Of the k-th length among a joint's coordinates.
template <typename T>
Vector<T> SlideAxis(const Joint& joint, const std::array<Vector<T>, 3>& E, size_t k) {
  if (joint.kind == JointKind::kFree) return Axis<T>(k);
  const bool plane = joint.kind == JointKind::kPlanar || joint.kind == JointKind::kPointOnPlane;
  return E[plane ? k : 2];
}

}  // namespace

template <typename T>
Model<T>::Model(const Mechanism& mechanism) : mechanism_(mechanism), spins_(IdleSpins(mechanism_)) {
  for (const Joint& joint : mechanism_.joints) {
    joint_pair_.push_back(AddPair(joint.parent, joint.X_PF, joint.child, joint.X_CM));
  }
  const auto points = [&](int from, const Vec3& p_from, int to, const Vec3& p_to) {
    return AddPair(from, Pose(Eigen::Translation3d(p_from)), to, Pose(Eigen::Translation3d(p_to)));
  };
  for (const Drive& drive : mechanism_.drives) {
    const auto* leg = std::get_if<DistanceDrive>(&drive.kind);
    drive_pair_.push_back(
        leg == nullptr ? joint_pair_[static_cast<size_t>(std::get<JointDrive>(drive.kind).joint)]
                       : points(leg->body_from, leg->p_from, leg->body_to, leg->p_to));
  }
  for (const Output& output : mechanism_.outputs) {
    output_pair_.push_back(AddPair(output.reference_body, output.X_RbR, output.body, output.X_BO));
  }
  for (const SpringDamper& spring : mechanism_.springs) {
    spring_pair_.push_back(points(spring.body_from, spring.p_from, spring.body_to, spring.p_to));
  }
  for (const Bushing& bushing : mechanism_.bushings) {
    bushing_pair_.push_back(AddPair(bushing.parent, bushing.X_PF, bushing.child, bushing.X_CM));
  }
  const size_t bodies = mechanism_.bodies.size();
  beyond_.assign(bodies, std::vector<bool>(bodies, false));
  for (size_t t = 0; t < mechanism_.tree_joints.size(); ++t) {
    const auto j = static_cast<size_t>(mechanism_.tree_joints[t]);
    const Joint& joint = mechanism_.joints[j];
    TreeJoint tree;
    tree.reversed = mechanism_.tree_reversed[t];
    tree.inboard = tree.reversed ? joint.child : joint.parent;
    tree.outboard = tree.reversed ? joint.parent : joint.child;
    tree.pair = joint_pair_[j];
    const std::array<Vector<T>, 3> E = Basis<T>(joint);
    int turn = 0, slide = 0;
    for (int c = 0; c < DofsOf(joint.kind); ++c) {
      const bool slides = IsLength(joint.kind, c), ball = IsOfBall(joint.kind, c);
      Step step{!slides, {}, coordinates_++};
      lengths_.push_back(slides);
      if (slides) {
        const auto k = static_cast<size_t>(slide++);
        step.axis = SlideAxis(joint, E, k);
      } else if (ball) {
        step.axis = Axis<T>(static_cast<size_t>(turn++));
        tree.ball = true;
      } else {
        step.axis = turn++ == 0 ? E[2] : Unit(Lifted<T>(joint.axis2));
      }
      (slides ? tree.slides : tree.turns).push_back(step);
    }
    if (joint.transmits_force_only) {
      const std::vector<Scalar<T>> locks = Locks(joint, tree.pair, true);
      tree.locked.assign(locks.begin() + 3, locks.end());
    }
    // Parents come first.
    for (size_t b = 0; b < bodies; ++b) {
      if (beyond_[b][static_cast<size_t>(tree.inboard)]) {
        beyond_[b][static_cast<size_t>(tree.outboard)] = true;
      }
    }
    beyond_[static_cast<size_t>(tree.outboard)][static_cast<size_t>(tree.outboard)] = true;
    tree_.push_back(std::move(tree));
  }
  for (const Body& body : mechanism_.bodies) {
    mass_.emplace_back(body.mass);
    centre_.push_back(Lifted<T>(body.p_BoBcm_B));
    Matrix<T> S;
    const T half = T(T(body.I_Bcm_B(0, 0)) + T(body.I_Bcm_B(1, 1)) + T(body.I_Bcm_B(2, 2))) / 2;
    for (int i = 0; i < 3; ++i) {
      for (int k = 0; k < 3; ++k) {
        const T both = (T(body.I_Bcm_B(i, k)) + T(body.I_Bcm_B(k, i))) / 2;
        S(static_cast<size_t>(i), static_cast<size_t>(k)) = i == k ? T(half - both) : T(-both);
      }
    }
    second_moment_.push_back(S);
  }
}

template <typename T>
std::vector<Scalar<T>> Model<T>::Locks(const Joint& joint, size_t pair, bool rotations) const {
  using Kind = typename Scalar<T>::Kind;
  const std::array<Vector<T>, 3> E = Basis<T>(joint);
  std::vector<Scalar<T>> locks;
  const auto slide = [&](const Vector<T>& f) {
    Scalar<T> lock;
    lock.frames = pair, lock.f = f;
    locks.push_back(lock);
  };
  const auto cosine = [&](const Vector<T>& f, const Vector<T>& m) {
    Scalar<T> lock;
    lock.kind = Kind::kCosine, lock.length = false;
    lock.frames = pair, lock.f = f, lock.m = m, lock.less = Dot(f, m);
    locks.push_back(lock);
  };
  switch (joint.kind) {
    case JointKind::kFree:
      return locks;
    case JointKind::kPointOnPlane:
    case JointKind::kPlanar:
      slide(E[2]);
      break;
    case JointKind::kPointOnLine:
    case JointKind::kPrismatic:
    case JointKind::kCylindrical:
      slide(E[0]), slide(E[1]);
      break;
    default:
      for (size_t i = 0; i < 3; ++i) slide(Axis<T>(i));
  }
  if (!rotations) return locks;
  switch (joint.kind) {
    case JointKind::kFixed:
    case JointKind::kPrismatic:
      for (size_t i = 0; i < 3; ++i) cosine(Axis<T>(i), Axis<T>((i + 1) % 3));
      break;
    case JointKind::kRevolute:
    case JointKind::kCylindrical:
    case JointKind::kPlanar:
      cosine(E[0], E[2]), cosine(E[1], E[2]);
      break;
    case JointKind::kUniversal:
      cosine(E[2], Unit(Lifted<T>(joint.axis2)));
      break;
    default:
      break;
  }
  return locks;
}

template <typename T>
Scalar<T> Model<T>::JointScalar(size_t j, int coordinate) const {
  using Kind = typename Scalar<T>::Kind;
  const Joint& joint = mechanism_.joints[j];
  const std::array<Vector<T>, 3> E = Basis<T>(joint);
  Scalar<T> scalar;
  scalar.frames = joint_pair_[j];
  scalar.length = IsLength(joint.kind, coordinate);
  if (scalar.length) {
    scalar.f = SlideAxis(joint, E, static_cast<size_t>(coordinate));
  } else if (IsOfBall(joint.kind, coordinate)) {
    constexpr std::array kinds = {Kind::kRoll, Kind::kPitch, Kind::kYaw};
    scalar.kind = kinds[static_cast<size_t>(BallAxis(joint.kind, coordinate))];
  } else if (joint.kind == JointKind::kUniversal) {
    const Vector<T> a = E[2], b = Unit(Lifted<T>(joint.axis2));
    scalar.kind = Kind::kAngle;
    if (coordinate == 0) {  // of b about a, seen in F
      const Vector<T> e = Unit(b - Times(Dot(a, b), a));
      scalar.f = Cross(a, e), scalar.m = b, scalar.g = e, scalar.n = b;
    } else {  // of a about −b, seen in M
      const Vector<T> e = Unit(a - Times(Dot(a, b), b));
      scalar.f = a, scalar.m = Times(T(-1), Cross(b, e)), scalar.g = a, scalar.n = e;
    }
  } else {
    scalar.kind = Kind::kAngle;
    scalar.f = E[1], scalar.m = E[0], scalar.g = E[0], scalar.n = E[0];
  }
  return scalar;
}

template <typename T>
Scalar<T> Model<T>::DriveScalar(const Drive& drive, size_t d) const {
  if (const auto* on = std::get_if<JointDrive>(&drive.kind)) {
    return JointScalar(static_cast<size_t>(on->joint), on->coordinate);
  }
  Scalar<T> scalar;
  scalar.kind = Scalar<T>::Kind::kDistance;
  scalar.frames = drive_pair_[d];
  return scalar;
}

template <typename T>
Equation<T> Model<T>::CoordinateEquation(const Coordinate& coordinate, double near) const {
  using Kind = typename Scalar<T>::Kind;
  const auto i = static_cast<size_t>(coordinate.index);
  Scalar<T> scalar;
  switch (coordinate.kind) {
    case Coordinate::Kind::kPrescribed:
      scalar = JointScalar(static_cast<size_t>(mechanism_.prescribed[i].joint), 0);
      break;
    case Coordinate::Kind::kDrive:
      scalar = DriveScalar(mechanism_.drives[i], i);
      break;
    case Coordinate::Kind::kJoint:
      scalar = JointScalar(i, coordinate.component);
      break;
    case Coordinate::Kind::kOutput:
      scalar.frames = output_pair_[i];
      scalar.length = coordinate.component < 3;
      constexpr std::array kinds = {Kind::kRoll, Kind::kPitch, Kind::kYaw};
      if (scalar.length) {
        scalar.f = Axis<T>(static_cast<size_t>(coordinate.component));
      } else {
        scalar.kind = kinds[static_cast<size_t>(coordinate.component - 3)];
      }
  }
  Equation<T> equation;
  equation.terms.push_back({scalar, {T(1)}, NearAngle<T>(scalar.length ? 0.0 : near)});
  return equation;
}

template <typename T>
Equation<T> Model<T>::ElementEquation(const ForceElement& element, double near) const {
  if (element.drive >= 0) {
    return CoordinateEquation({Coordinate::Kind::kDrive, element.drive, 0}, near);
  }
  if (element.joint >= 0) {
    return CoordinateEquation({Coordinate::Kind::kJoint, element.joint, element.coordinate}, near);
  }
  if (element.spring >= 0) {
    return LengthEquation(mechanism_.springs[static_cast<size_t>(element.spring)]);
  }
  Scalar<T> scalar;
  scalar.frames = bushing_pair_[static_cast<size_t>(element.bushing)];
  scalar.length = element.coordinate < 3;
  if (!scalar.length) scalar.kind = Scalar<T>::Kind::kRotationVector;
  scalar.f = Axis<T>(static_cast<size_t>(element.coordinate % 3));
  Equation<T> equation;
  equation.terms.push_back({scalar, {T(1)}, NearAngle<T>()});
  return equation;
}

template <typename T>
Equation<T> Model<T>::LengthEquation(const SpringDamper& spring) const {
  Scalar<T> scalar;
  scalar.kind = Scalar<T>::Kind::kDistance;
  scalar.frames = spring_pair_[static_cast<size_t>(&spring - mechanism_.springs.data())];
  Equation<T> equation;
  equation.terms.push_back({scalar, {T(1)}, NearAngle<T>()});
  return equation;
}

template <typename T>
Equation<T> Model<T>::SpinEquation(int spin) {
  Equation<T> equation;
  equation.spin = spin;
  return equation;
}

template <typename T>
std::vector<Equation<T>> Model<T>::Closures(const std::vector<double>& turns) const {
  std::vector<Equation<T>> equations;
  for (size_t j = 0; j < mechanism_.joints.size(); ++j) {
    if (!mechanism_.joints[j].closure) continue;
    for (const Scalar<T>& lock : Locks(mechanism_.joints[j], joint_pair_[j], true)) {
      Equation<T> equation;
      equation.terms.push_back({lock, {T(1)}, NearAngle<T>()});
      equations.push_back(std::move(equation));
    }
  }
  size_t at = 0;
  for (const Coupling& coupling : mechanism_.couplings) {
    Equation<T> equation;
    equation.constant = T(coupling.constant);
    for (const Coupling::Term& term : coupling.terms) {
      const double near = at < turns.size() ? turns[at] : 0.0;
      ++at;
      const Scalar<T> scalar = JointScalar(static_cast<size_t>(term.joint), term.coordinate);
      equation.terms.push_back({scalar,
                                {term.polynomial.begin(), term.polynomial.end()},
                                NearAngle<T>(scalar.length ? 0.0 : near)});
    }
    equations.push_back(std::move(equation));
  }
  return equations;
}

template <typename T>
std::vector<bool> Model<T>::Transmitting() const {
  std::vector<bool> transmitting;
  for (size_t j = 0; j < mechanism_.joints.size(); ++j) {
    const Joint& joint = mechanism_.joints[j];
    if (!joint.closure) continue;
    const size_t slides = Locks(joint, joint_pair_[j], false).size();
    const size_t all = Locks(joint, joint_pair_[j], true).size();
    for (size_t k = 0; k < all; ++k) {
      transmitting.push_back(k < slides || !joint.transmits_force_only);
    }
  }
  transmitting.resize(transmitting.size() + mechanism_.couplings.size(), true);
  return transmitting;
}

template <typename T>
void Model<T>::StartFrom(const std::vector<Pose>& X_WB, std::vector<T>* q) {
  q->assign(static_cast<size_t>(coordinates_), T(0));
  for (size_t t = 0; t < tree_.size(); ++t) {
    TreeJoint& tree = tree_[t];
    const Joint& joint = mechanism_.joints[static_cast<size_t>(mechanism_.tree_joints[t])];
    const Pose X_WF = X_WB[static_cast<size_t>(joint.parent)] * joint.X_PF;
    const Pose X_WM = X_WB[static_cast<size_t>(joint.child)] * joint.X_CM;
    const std::array<double, 6> at = CoordinatesOf(joint, X_WF.inverse() * X_WM);
    size_t c = 0;
    for (const Step& step : tree.slides) (*q)[static_cast<size_t>(step.coordinate)] = T(at[c++]);
    if (tree.ball) {
      const std::array<T, 3> rpy = {T(at[c]), T(at[c + 1]), T(at[c + 2])};
      tree.start =
          Turn<T>(Axis<T>(2), rpy[2]) * Turn<T>(Axis<T>(1), rpy[1]) * Turn<T>(Axis<T>(0), rpy[0]);
      continue;
    }
    for (const Step& step : tree.turns) (*q)[static_cast<size_t>(step.coordinate)] = T(at[c++]);
  }
  spin_across_.clear(), spin_fixed_.clear();
  for (const Spin& spin : spins_) {
    const Vec3 across = spin.n_B.unitOrthogonal();
    const Mat3 R = X_WB[static_cast<size_t>(spin.bodies[0])].linear();
    spin_across_.push_back(Lifted<T>(across));
    // Across both, so that its product with the first grows with the turn.
    spin_fixed_.push_back(Lifted<T>(R * spin.n_B.cross(across)));
  }
}

template <typename T>
template <typename S>
Frame<S> Model<T>::JointFrame(const TreeJoint& joint, const std::vector<S>& q) const {
  Frame<S> X;
  for (size_t i = 0; i < 3; ++i) {
    X.p[i] = S(T(0));
    for (size_t k = 0; k < 3; ++k) X.R(i, k) = S(T(i == k ? 1 : 0));
  }
  for (const Step& step : joint.slides) {
    X.p = X.p + Times(q[static_cast<size_t>(step.coordinate)], step.axis);
  }
  bool first = true;
  if (joint.ball) {
    for (size_t i = 0; i < 3; ++i) {
      for (size_t k = 0; k < 3; ++k) X.R(i, k) = S(joint.start(i, k));
    }
    first = false;
  }
  for (const Step& step : joint.turns) {
    const Matrix<S> R = Turn<S>(step.axis, q[static_cast<size_t>(step.coordinate)]);
    X.R = first ? R : X.R * R;
    first = false;
  }
  return X;
}

template <typename T>
template <typename S>
std::vector<Frame<S>> Model<T>::Chained(const std::vector<S>& q) const {
  std::vector<Frame<S>> bodies(mechanism_.bodies.size());
  for (size_t i = 0; i < 3; ++i) {
    bodies[0].p[i] = S(T(0));
    for (size_t k = 0; k < 3; ++k) bodies[0].R(i, k) = S(T(i == k ? 1 : 0));
  }
  for (const TreeJoint& joint : tree_) {
    const Frame<S>& in = bodies[static_cast<size_t>(joint.inboard)];
    const Pair& at = pairs_[joint.pair];
    const Frame<S> X_FM = JointFrame(joint, q);
    Frame<S>& out = bodies[static_cast<size_t>(joint.outboard)];
    if (joint.reversed) {
      out = at.X_FP.Behind(at.X_CM.Behind(in) * Inverse(X_FM));
    } else {
      out = at.X_MC.Behind(at.X_PF.Behind(in) * X_FM);
    }
  }
  return bodies;
}

template <typename T>
template <typename S>
S Model<T>::ValueAt(const Equation<T>& equation, const std::vector<Frame<S>>& bodies,
                    Last<S>* last) const {
  if (equation.spin >= 0) {
    const auto s = static_cast<size_t>(equation.spin);
    const auto& R = bodies[static_cast<size_t>(spins_[s].bodies[0])].R;
    return Dot(R * spin_across_[s], spin_fixed_[s]);
  }
  S sum(equation.constant);
  Last<S> own;
  for (const auto& term : equation.terms) {
    const Frame<S>& X_FM = Shared(term.scalar.frames, bodies, last == nullptr ? &own : last);
    const S x = term.scalar.Of(X_FM.p, X_FM.R, term.near);
    sum = sum + Polynomial(term.polynomial, x);
  }
  return sum;
}

template <typename T>
void Model<T>::Seed(size_t pair, const Poses& bodies, Seeds* seeds) const {
  seeds->pair = pair;
  seeds->F = ParentFrame(pair, bodies), seeds->M = ChildFrame(pair, bodies);
  const Matrix<T> R_FW = Transposed(seeds->F.R);
  const Vector<T> d = R_FW * (seeds->M.p - seeds->F.p);
  const Matrix<T> R = R_FW * seeds->M.R;
  for (size_t i = 0; i < 3; ++i) {
    seeds->d[i] = Tangent<T>(d[i]);
    seeds->d[i].g[3 + i] = T(1);
    for (size_t k = 0; k < 3; ++k) seeds->R(i, k) = Tangent<T>(R(i, k));
  }
  // A turn about e_i takes a column c along e_i × c.
  for (size_t i = 0; i < 3; ++i) {
    const size_t j = (i + 1) % 3, k = (i + 2) % 3;
    for (size_t c = 0; c < 3; ++c) {
      seeds->R(j, c).g[i] = -R(k, c);
      seeds->R(k, c).g[i] = R(j, c);
    }
  }
}

template <typename T>
std::vector<Wrench<T>> Model<T>::WrenchesAt(const Equation<T>& equation, const Poses& bodies,
                                            Seeds* seeds) const {
  std::vector<Wrench<T>> wrenches;
  if (equation.spin >= 0) {
    const Spin& spin = spins_[static_cast<size_t>(equation.spin)];
    const int b = spin.bodies[0];
    Wrench<T> wrench{0, b, {}};
    wrench.on_child.m = bodies[static_cast<size_t>(b)].R * Unit(Lifted<T>(spin.n_B));
    wrenches.push_back(std::move(wrench));
    return wrenches;
  }
  Seeds own;
  if (seeds == nullptr) seeds = &own;
  for (const auto& term : equation.terms) {
    const size_t pair = term.scalar.frames;
    if (seeds->pair != pair) Seed(pair, bodies, seeds);
    Wrench<T> wrench{pairs_[pair].parent, pairs_[pair].child, {}};
    const Scalar<T>& scalar = term.scalar;
    // Those of most locks are simple: f·d has the slope f, and f·R m, by a turn ω, ω·(R m × f).
    if (scalar.kind == Scalar<T>::Kind::kSlide && term.polynomial.size() == 1) {
      wrench.on_child.f = seeds->F.R * Times(term.polynomial[0], scalar.f);
      wrench.on_child.m = Cross(seeds->M.p, wrench.on_child.f);
    } else if (scalar.kind == Scalar<T>::Kind::kCosine && term.polynomial.size() == 1) {
      wrench.on_child.m =
          Times(term.polynomial[0], Cross(seeds->M.R * scalar.m, seeds->F.R * scalar.f));
    } else {
      const Tangent<T> x = scalar.Of(seeds->d, seeds->R, term.near);
      const Tangent<T> y = Polynomial(term.polynomial, x);
      wrench.on_child.f = seeds->F.R * Vector<T>{{y.g[3], y.g[4], y.g[5]}};
      wrench.on_child.m =
          seeds->F.R * Vector<T>{{y.g[0], y.g[1], y.g[2]}} + Cross(seeds->M.p, wrench.on_child.f);
    }
    wrenches.push_back(std::move(wrench));
  }
  return wrenches;
}

template <typename T>
Wrench<T> Model<T>::SpinTurnWrench(int spin, const Poses& bodies) const {
  const auto s = static_cast<size_t>(spin);
  const int b = spins_[s].bodies[0];
  Wrench<T> wrench{0, b, {}};
  wrench.on_child.m = Cross(bodies[static_cast<size_t>(b)].R * spin_across_[s], spin_fixed_[s]);
  return wrench;
}

namespace {

// ω and its rate, in world axes.
template <typename T>
Vector<T> AngularVelocity(const Matrix<Series<T>>& R) {
  return Vee(Each(R, &Series<T>::r) * Transposed(Each(R, &Series<T>::v)));
}
// The part Ṙ Ṙᵀ of the derivative of Ṙ Rᵀ is symmetric, and adds nothing: half the antisymmetric
// part of R̈ Rᵀ.
template <typename T>
Vector<T> AngularAcceleration(const Matrix<Series<T>>& R) {
  const Matrix<T> P = Each(R, &Series<T>::a) * Transposed(Each(R, &Series<T>::v));
  return Times(T(T(1) / 2), Vee(P) - Vee(Transposed(P)));
}

}  // namespace

template <typename T>
T Model<T>::SpinAcceleration(int spin, const Motions& bodies) const {
  const Spin& of = spins_[static_cast<size_t>(spin)];
  const Matrix<Series<T>>& R = bodies[static_cast<size_t>(of.bodies[0])].R;
  return Dot(Each(R, &Series<T>::v) * Unit(Lifted<T>(of.n_B)), AngularAcceleration(R));
}

template <typename T>
std::vector<typename Model<T>::Virtual> Model<T>::VirtualAt(const std::vector<T>& q,
                                                            const Poses& bodies,
                                                            bool released) const {
  std::vector<Virtual> motions(static_cast<size_t>(coordinates_));
  std::vector<Virtual> more;
  for (const TreeJoint& joint : tree_) {
    const Frame<T> F = ParentFrame(joint.pair, bodies), M = ChildFrame(joint.pair, bodies);
    const T sign(joint.reversed ? -1 : 1);
    for (const Step& step : joint.slides) {
      Virtual& motion = motions[static_cast<size_t>(step.coordinate)];
      motion.body = joint.outboard;
      motion.twist.f = Times(sign, F.R * step.axis);
    }
    const auto turn = [&](Vector<T> axis, Virtual* motion) {
      motion->body = joint.outboard;
      motion->twist.m = Times(sign, axis);
      motion->twist.f = Cross(M.p, motion->twist.m);
    };
    Matrix<T> R = joint.ball ? F.R * joint.start : F.R;
    for (size_t k = 0; k < joint.turns.size(); ++k) {
      const Step& step = joint.turns[k];
      const auto c = static_cast<size_t>(step.coordinate);
      turn(R * step.axis, &motions[c]);
      if (k + 1 < joint.turns.size()) R = R * Turn<T>(step.axis, q[c]);
    }
    if (!released) continue;
    for (const Scalar<T>& lock : joint.locked) {
      Equation<T> equation;
      equation.terms.push_back({lock, {T(1)}, NearAngle<T>()});
      turn(Times(sign, WrenchesAt(equation, bodies)[0].on_child.m), &more.emplace_back());
    }
  }
  motions.insert(motions.end(), more.begin(), more.end());
  return motions;
}

template <typename T>
void Model<T>::Accelerate(const std::vector<Virtual>& motions, const std::vector<T>& accelerations,
                          Motions* bodies) const {
  std::vector<Six<T>> twists(bodies->size());
  for (const TreeJoint& joint : tree_) {
    const auto b = static_cast<size_t>(joint.outboard);
    Six<T>& twist = twists[b];
    twist = twists[static_cast<size_t>(joint.inboard)];
    for (const std::vector<Step>* steps : {&joint.slides, &joint.turns}) {
      for (const Step& step : *steps) {
        const auto c = static_cast<size_t>(step.coordinate);
        twist = twist + Times(accelerations[c], motions[c].twist);
      }
    }
    Frame<Series<T>>& X = (*bodies)[b];
    const Vector<T> p = twist.f + Cross(twist.m, Each(X.p, &Series<T>::v));
    const Matrix<T> R = Each(X.R, &Series<T>::v);
    for (size_t i = 0; i < 3; ++i) {
      X.p[i].a += p[i];
      const Vector<T> column = Cross(twist.m, Column(R, i));
      for (size_t k = 0; k < 3; ++k) X.R(k, i).a += column[k];
    }
  }
}

template <typename T>
T Model<T>::Along(const Virtual& motion, const std::vector<Wrench<T>>& wrenches) const {
  T sum(0);
  for (const Wrench<T>& wrench : wrenches) {
    const bool child = IsBeyond(wrench.child, motion.body);
    if (child == IsBeyond(wrench.parent, motion.body)) continue;
    const T work = Dot(motion.twist, wrench.on_child);
    sum += child ? work : T(-work);
  }
  return sum;
}

template <typename T>
std::vector<Six<T>> Model<T>::Required(const Motions& bodies) const {
  std::vector<Six<T>> wrenches(bodies.size());
  const Vector<T> g = Lifted<T>(mechanism_.gravity_W);
  for (size_t b = 1; b < bodies.size(); ++b) {
    if (mechanism_.bodies[b].mass == 0.0 && mechanism_.bodies[b].I_Bcm_B.isZero(0.0)) continue;
    const Frame<Series<T>>& X = bodies[b];
    const Vector<Series<T>> r = X.p + X.R * centre_[b];
    const T share = T(1) - T(mechanism_.bodies[b].gravity_compensation);
    wrenches[b].f = Times(mass_[b], Each(r, &Series<T>::a) - Times(share, g));
    const Matrix<T> P =
        Each(X.R, &Series<T>::a) * second_moment_[b] * Transposed(Each(X.R, &Series<T>::v));
    wrenches[b].m = (Vee(P) - Vee(Transposed(P))) + Cross(Each(r, &Series<T>::v), wrenches[b].f);
  }
  return wrenches;
}

template <typename T>
T Model<T>::CompensationAlong(const Drive& drive, const Poses& bodies) const {
  if (!drive.compensates_gravity) return T(0);
  const int j = std::get<JointDrive>(drive.kind).joint;
  const Joint& joint = mechanism_.joints[static_cast<size_t>(j)];
  const Frame<T> F = ParentFrame(joint_pair_[static_cast<size_t>(j)], bodies);
  const Vector<T> a = F.R * Unit(Lifted<T>(joint.axis));
  T sum(0);
  for (const int b : BodiesBeyond(mechanism_, j)) {
    const auto k = static_cast<size_t>(b);
    const T share = T(mechanism_.bodies[k].gravity_compensation) * mass_[k];
    const Vector<T> f = Times(T(-share), Lifted<T>(mechanism_.gravity_W));
    const Vector<T> arm = bodies[k].p + bodies[k].R * centre_[k] - F.p;
    sum += joint.kind == JointKind::kRevolute ? Dot(a, Cross(arm, f)) : Dot(a, f);
  }
  return sum;
}

template <typename T>
std::pair<Series<T>, std::vector<Wrench<T>>> Model<T>::BallMotion(const ForceElement& element,
                                                                  const Poses& bodies,
                                                                  const Motions& motions) const {
  const auto j = static_cast<size_t>(element.joint);
  const Joint& joint = mechanism_.joints[j];
  const Frame<Series<T>> X_FM = Between(joint_pair_[j], motions);
  const auto k = static_cast<size_t>(BallAxis(joint.kind, element.coordinate));
  const Vector<T> axis_F = Column(Each(X_FM.R, &Series<T>::v), k);
  const Series<T> x(T(0), Dot(axis_F, AngularVelocity(X_FM.R)),
                    Dot(axis_F, AngularAcceleration(X_FM.R)));
  const Pair& at = pairs_[joint_pair_[j]];
  Wrench<T> wrench{at.parent, at.child, {}};
  wrench.on_child.m = Column(ChildFrame(joint_pair_[j], bodies).R, k);
  return {x, {wrench}};
}

template <typename T>
std::pair<T, Vector<T>> Model<T>::OnCarrier(const RotorAxis& carrier, const Series<T>& x,
                                            const Motions& motions) const {
  const Matrix<Series<T>>& R = motions[static_cast<size_t>(carrier.body)].R;
  const Vector<T> a = Each(R, &Series<T>::v) * Unit(Lifted<T>(carrier.axis_B));
  return {Dot(a, AngularAcceleration(R)), Times(x.a, a) + Times(x.r, Cross(AngularVelocity(R), a))};
}

template <typename T>
Six<T> Model<T>::SumBeyond(int outboard, const std::vector<Six<T>>& wrenches) const {
  Six<T> sum;
  for (size_t b = 1; b < wrenches.size(); ++b) {
    if (IsBeyond(static_cast<int>(b), outboard)) sum = sum + wrenches[b];
  }
  return sum;
}

template <typename T>
std::array<T, 6> Model<T>::InJoint(const Joint& joint, const Six<T>& on_child,
                                   const Poses& bodies) const {
  const size_t pair = joint_pair_[static_cast<size_t>(&joint - mechanism_.joints.data())];
  const Matrix<T> R_FW = Transposed(ParentFrame(pair, bodies).R);
  const Frame<T> M = ChildFrame(pair, bodies);
  const Vector<T> f = R_FW * on_child.f, m = R_FW * (on_child.m - Cross(M.p, on_child.f));
  return {f[0], f[1], f[2], m[0], m[1], m[2]};
}

template <typename T>
Vector<T> Model<T>::AxisInJoint(const Joint& joint, int coordinate, const Poses& bodies) const {
  if (joint.kind != JointKind::kUniversal || coordinate == 0) return Unit(Lifted<T>(joint.axis));
  const size_t pair = joint_pair_[static_cast<size_t>(&joint - mechanism_.joints.data())];
  return Transposed(ParentFrame(pair, bodies).R) *
         (ChildFrame(pair, bodies).R * Unit(Lifted<T>(joint.axis2)));
}

template class Model<Fine>;
template Fine Model<Fine>::ValueAt(const Equation<Fine>&, const std::vector<Frame<Fine>>&,
                                   Last<Fine>*) const;
template Series<Fine> Model<Fine>::ValueAt(const Equation<Fine>&,
                                           const std::vector<Frame<Series<Fine>>>&,
                                           Last<Series<Fine>>*) const;
template class Model<Dual>;
template Dual Model<Dual>::ValueAt(const Equation<Dual>&, const std::vector<Frame<Dual>>&,
                                   Last<Dual>*) const;
template Series<Dual> Model<Dual>::ValueAt(const Equation<Dual>&,
                                           const std::vector<Frame<Series<Dual>>>&,
                                           Last<Series<Dual>>*) const;
template class Model<Finest>;
template Finest Model<Finest>::ValueAt(const Equation<Finest>&, const std::vector<Frame<Finest>>&,
                                       Last<Finest>*) const;
template Series<Finest> Model<Finest>::ValueAt(const Equation<Finest>&,
                                               const std::vector<Frame<Series<Finest>>>&,
                                               Last<Series<Finest>>*) const;

}  // namespace mbv::exact
