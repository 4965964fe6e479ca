// The mechanism once more, in any number type: a specification to read. Internal to
// features/certify.
//
// It shares the mechanism's description and commands with the other witnesses and no equation:
//   pose      p_B, R_B of every body from the coordinates q of the spanning tree's joints, each
//   joint
//             a product of elementary slides and turns (joint_kinds.h)
//   closure   φ(q) = 0: what cut joints lock and couplings keep, as functions of the relative pose
//             (d, R) of the joint's frames; commands Σ factor·coordinate(q) − profile(t) = 0
//   rates     the same formulas in truncated series in time: value, rate, acceleration
//   inertia   force m (p̈_cm − g), moment about the centre of mass
//             vee(R̈ Σ Rᵀ − R Σ R̈ᵀ), Σ = ½ tr(I) 1 − I: no angular velocity occurs              (1)
//   forces    virtual work: for every virtual coordinate j
//             s_j · Σ (required − applied wrenches beyond j) = Σ_k λ_k ∂φ_k/∂q_j               (2)
//             with unit twists s_j about the world's origin; λ: drive forces and what cut joints
//             and couplings transmit
//   reactions of a tree's joint: the sum in (2) less what the λ beyond it do
//
// Frames' axes are made orthonormal from the description's doubles, x first; axes have length 1.
#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <type_traits>
#include <utility>
#include <variant>
#include <vector>

#include "base/types.h"
#include "features/certify/exact_numbers.h"
#include "mechanism/idle_spins.h"
#include "mechanism/joint_pose.h"
#include "mechanism/mechanism.h"
#include "mechanism/motion.h"
#include "mechanism/spanning_tree.h"

namespace mbv::exact {

// Numbers over time and over relative motions.

/// Value, rate and acceleration.
template <typename T>
struct Series {
  T v = T(0), r = T(0), a = T(0);
  Series() = default;
  Series(const T& value) : v(value) {}  // NOLINT(google-explicit-constructor): a constant
  Series(T value, T rate, T acceleration)
      : v(std::move(value)), r(std::move(rate)), a(std::move(acceleration)) {}
};

template <typename T>
Series<T> operator+(const Series<T>& x, const Series<T>& y) {
  return {x.v + y.v, x.r + y.r, x.a + y.a};
}
template <typename T>
Series<T> operator-(const Series<T>& x, const Series<T>& y) {
  return {x.v - y.v, x.r - y.r, x.a - y.a};
}
template <typename T>
Series<T> operator-(const Series<T>& x) {
  return {-x.v, -x.r, -x.a};
}
template <typename T>
Series<T> operator*(const Series<T>& x, const Series<T>& y) {
  return {x.v * y.v, x.r * y.v + x.v * y.r, x.a * y.v + 2 * (x.r * y.r) + x.v * y.a};
}
template <typename T>
Series<T> operator*(const T& x, const Series<T>& y) {
  return {x * y.v, x * y.r, x * y.a};
}
template <typename T>
Series<T> operator*(const Series<T>& x, const T& y) {
  return y * x;
}

/// Value and derivatives by the twist [ω; v] of M against F, about M's origin in F's axes.
template <typename T>
struct Tangent {
  T v = T(0);
  std::array<T, 6> g{};
  Tangent() { g.fill(T(0)); }
  Tangent(const T& value) : v(value) { g.fill(T(0)); }  // NOLINT(google-explicit-constructor)
};

template <typename T>
Tangent<T> operator+(Tangent<T> x, const Tangent<T>& y) {
  x.v += y.v;
  for (size_t i = 0; i < 6; ++i) x.g[i] += y.g[i];
  return x;
}
template <typename T>
Tangent<T> operator-(Tangent<T> x, const Tangent<T>& y) {
  x.v -= y.v;
  for (size_t i = 0; i < 6; ++i) x.g[i] -= y.g[i];
  return x;
}
template <typename T>
Tangent<T> operator-(const Tangent<T>& x) {
  return Tangent<T>() - x;
}
template <typename T>
Tangent<T> operator*(const Tangent<T>& x, const Tangent<T>& y) {
  Tangent<T> z(x.v * y.v);
  for (size_t i = 0; i < 6; ++i) z.g[i] = x.g[i] * y.v + x.v * y.g[i];
  return z;
}
template <typename T>
Tangent<T> operator*(const T& x, Tangent<T> y) {
  y.v *= x;
  for (T& slope : y.g) slope *= x;
  return y;
}
template <typename T>
Tangent<T> operator*(const Tangent<T>& x, const T& y) {
  return y * x;
}

/// f(x) where f, f′ and f″ are known at x.
template <typename T>
T Chain(const T& /*x*/, const T& f, const T& /*f1*/, const T& /*f2*/) {
  return f;
}
template <typename T>
Series<T> Chain(const Series<T>& x, const T& f, const T& f1, const T& f2) {
  return {f, f1 * x.r, f1 * x.a + f2 * (x.r * x.r)};
}
template <typename T>
Tangent<T> Chain(const Tangent<T>& x, const T& f, const T& f1, const T& /*f2*/) {
  Tangent<T> y(f);
  for (size_t i = 0; i < 6; ++i) y.g[i] = f1 * x.g[i];
  return y;
}
template <typename T>
const T& ValueOf(const T& x) {
  return x;
}
template <typename T>
const T& ValueOf(const Series<T>& x) {
  return x.v;
}
template <typename T>
const T& ValueOf(const Tangent<T>& x) {
  return x.v;
}

template <typename S>
S Root(const S& x) {
  using std::sqrt;
  const auto root = sqrt(ValueOf(x));
  using T = std::decay_t<decltype(root)>;
  const T slope = T(1) / (2 * root);
  return Chain(x, root, slope, T(-slope / (2 * ValueOf(x))));
}
template <typename S>
S Reciprocal(const S& x) {
  using T = std::decay_t<decltype(ValueOf(x))>;
  const T y = T(1) / ValueOf(x), y2 = y * y;
  return Chain(x, y, T(-y2), T(2 * y2 * y));
}

/// An angle that a double is near to, with its sine and cosine.
template <typename T>
struct NearAngle {
  T angle = T(0), sine = T(0), cosine = T(1);
  NearAngle() = default;
  explicit NearAngle(double near) : angle(near) {
    using std::cos, std::sin;
    sine = sin(angle), cosine = cos(angle);
  }
};

/// atan2(s, c), in the turn of `near`, from which it is less than a right angle away.
template <typename S, typename T>
S Angle(const S& s, const S& c, const NearAngle<T>& near) {
  using std::atan;
  const S u = (s * near.cosine - c * near.sine) * Reciprocal(c * near.cosine + s * near.sine);
  const T slope = T(1) / (1 + ValueOf(u) * ValueOf(u));
  const S turn = Chain(u, T(atan(ValueOf(u))), slope, T(-2 * ValueOf(u) * slope * slope));
  return turn + S(near.angle);
}

/// θ/sin θ, |θ| < π: near 0 a series in z = sin²θ, whose rest from the N-th term on is below
/// N² z^(N−2) with two derivatives, else a function of c = cos θ.
template <typename S>
S AngleOverSine(const S& z, const S& c) {
  using std::acos, std::sqrt;
  using T = std::decay_t<decltype(ValueOf(z))>;
  const T& x = ValueOf(z);
  if (AtMost(x, 1.0 / 16.0) && AtMost(T(-ValueOf(c)), 0.0)) {
    constexpr int kTerms = 80;
    T f(0), f1(0), f2(0), a(1), power(1), power1(0), power2(0);  // a zⁿ: a = (2n)!/(4ⁿ n!² (2n+1))
    T binomial(1);
    for (int n = 0; n < kTerms; ++n) {
      a = binomial / (2 * n + 1);
      f += a * power, f1 += a * power1, f2 += a * power2;
      power2 = 2 * power1 + x * power2;
      power1 = power + x * power1;
      power = power * x;
      binomial = binomial * (2 * n + 1) / (2 * n + 2);
    }
    const T rest = Symmetric<T>(1e4 * std::pow(1.0 / 16.0, kTerms - 2));
    return Chain(z, T(f + rest), T(f1 + rest), T(f2 + rest));
  }
  const T &y = ValueOf(c), square = 1 - y * y;
  const T f = acos(y) / sqrt(square);
  const T f1 = (y * f - 1) / square;
  return Chain(c, f, f1, T((f + 3 * y * f1) / square));
}

// Vectors and matrices.

template <typename S>
struct Vector {
  std::array<S, 3> x{};
  const S& operator[](size_t i) const { return x[i]; }
  S& operator[](size_t i) { return x[i]; }
};
template <typename S>
struct Matrix {
  std::array<std::array<S, 3>, 3> m{};
  const S& operator()(size_t i, size_t j) const { return m[i][j]; }
  S& operator()(size_t i, size_t j) { return m[i][j]; }
};
template <typename A, typename B>
using ProductOf = std::decay_t<decltype(std::declval<A>() * std::declval<B>())>;

// x0 b0 + x1 b1 + x2 b2; of constants, many are 0.
template <typename A, typename B>
ProductOf<A, B> Combined(const A& x0, const A& x1, const A& x2, const Vector<B>& b) {
  if constexpr (std::is_same_v<B, std::decay_t<decltype(ValueOf(b[0]))>>) {
    const std::array<const A*, 3> x = {&x0, &x1, &x2};
    ProductOf<A, B> sum(B(0));
    for (size_t i = 0; i < 3; ++i) {
      if (!IsZero(b[i])) sum = sum + *x[i] * b[i];
    }
    return sum;
  } else {
    return x0 * b[0] + x1 * b[1] + x2 * b[2];
  }
}
template <typename A, typename B>
ProductOf<A, B> Dot(const Vector<A>& a, const Vector<B>& b) {
  if constexpr (std::is_same_v<A, std::decay_t<decltype(ValueOf(a[0]))>>) {
    return Combined(b[0], b[1], b[2], a);
  } else {
    return Combined(a[0], a[1], a[2], b);
  }
}
template <typename A, typename B>
Vector<ProductOf<A, B>> Cross(const Vector<A>& a, const Vector<B>& b) {
  return {{a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]}};
}
template <typename S>
Vector<S> operator+(const Vector<S>& a, const Vector<S>& b) {
  return {{a[0] + b[0], a[1] + b[1], a[2] + b[2]}};
}
template <typename S>
Vector<S> operator-(const Vector<S>& a, const Vector<S>& b) {
  return {{a[0] - b[0], a[1] - b[1], a[2] - b[2]}};
}
template <typename A, typename B>
Vector<ProductOf<A, B>> Times(const A& a, const Vector<B>& b) {
  return {{a * b[0], a * b[1], a * b[2]}};
}
template <typename A, typename B>
Vector<ProductOf<A, B>> operator*(const Matrix<A>& R, const Vector<B>& v) {
  Vector<ProductOf<A, B>> w;
  for (size_t i = 0; i < 3; ++i) {
    w[i] = Combined(R(i, 0), R(i, 1), R(i, 2), v);
  }
  return w;
}
template <typename A, typename B>
Matrix<ProductOf<A, B>> operator*(const Matrix<A>& R, const Matrix<B>& Q) {
  Matrix<ProductOf<A, B>> P;
  for (size_t i = 0; i < 3; ++i) {
    for (size_t j = 0; j < 3; ++j) {
      P(i, j) = R(i, 0) * Q(0, j) + R(i, 1) * Q(1, j) + R(i, 2) * Q(2, j);
    }
  }
  return P;
}
template <typename S>
Matrix<S> Transposed(const Matrix<S>& R) {
  Matrix<S> Q;
  for (size_t i = 0; i < 3; ++i) {
    for (size_t j = 0; j < 3; ++j) Q(i, j) = R(j, i);
  }
  return Q;
}
template <typename S>
Vector<S> Column(const Matrix<S>& R, size_t j) {
  return {{R(0, j), R(1, j), R(2, j)}};
}
/// Of the antisymmetric part of P, that of [w]× = P − Pᵀ halved twice: w of P = [w]×.
template <typename S>
Vector<S> Vee(const Matrix<S>& P) {
  return {{P(2, 1), P(0, 2), P(1, 0)}};
}
template <typename T>
Vector<T> Lifted(const Vec3& v) {
  return {{T(v.x()), T(v.y()), T(v.z())}};
}
template <typename T>
Vector<T> Unit(const Vector<T>& v) {
  using std::sqrt;
  return Times(T(1 / sqrt(Dot(v, v))), v);
}
/// A part of every element.
template <typename T, typename Part>
Matrix<T> Each(const Matrix<Series<T>>& R, Part part) {
  Matrix<T> P;
  for (size_t i = 0; i < 3; ++i) {
    for (size_t j = 0; j < 3; ++j) P(i, j) = R(i, j).*part;
  }
  return P;
}
template <typename T, typename Part>
Vector<T> Each(const Vector<Series<T>>& v, Part part) {
  return {{v[0].*part, v[1].*part, v[2].*part}};
}

/// [moment about the world's origin; force], or a twist [ω; v there].
template <typename T>
struct Six {
  Vector<T> m{{T(0), T(0), T(0)}}, f{{T(0), T(0), T(0)}};
};
template <typename T>
Six<T> operator+(const Six<T>& a, const Six<T>& b) {
  return {a.m + b.m, a.f + b.f};
}
template <typename T>
Six<T> operator-(const Six<T>& a, const Six<T>& b) {
  return {a.m - b.m, a.f - b.f};
}
template <typename T>
Six<T> Times(const T& a, const Six<T>& b) {
  return {Times(a, b.m), Times(a, b.f)};
}
template <typename T>
T Dot(const Six<T>& twist, const Six<T>& wrench) {
  return Dot(twist.m, wrench.m) + Dot(twist.f, wrench.f);
}

template <typename S>
struct Frame {
  Vector<S> p;
  Matrix<S> R;
};
template <typename A, typename B>
Frame<ProductOf<A, B>> operator*(const Frame<A>& X, const Frame<B>& Y) {
  using S = ProductOf<A, B>;
  Vector<S> p = X.R * Y.p;
  for (size_t i = 0; i < 3; ++i) p[i] = p[i] + S(X.p[i]);
  return {p, X.R * Y.R};
}
template <typename S>
Frame<S> Inverse(const Frame<S>& X) {
  const Matrix<S> R = Transposed(X.R);
  const Vector<S> p = R * X.p;
  return {{{-p[0], -p[1], -p[2]}}, R};
}
template <typename T>
Frame<T> Lifted(const Pose& X) {
  const Vector<T> x = Unit(Lifted<T>(X.linear().col(0)));
  const Vector<T> y0 = Lifted<T>(X.linear().col(1));
  const Vector<T> y = Unit(y0 - Times(Dot(x, y0), x)), z = Cross(x, y);
  Frame<T> F{Lifted<T>(X.translation()), {}};
  for (size_t i = 0; i < 3; ++i) F.R(i, 0) = x[i], F.R(i, 1) = y[i], F.R(i, 2) = z[i];
  return F;
}

/// Turn about a unit axis.
template <typename S, typename T>
Matrix<S> Turn(const Vector<T>& axis, const S& angle) {
  using std::cos, std::sin;
  const T sine = sin(ValueOf(angle)), cosine = cos(ValueOf(angle));
  const S s = Chain(angle, sine, cosine, T(-sine)), c = Chain(angle, cosine, T(-sine), T(-cosine));
  const S u = S(T(1)) - c;
  Matrix<S> R;
  for (size_t i = 0; i < 3; ++i) {
    for (size_t j = 0; j < 3; ++j) {
      R(i, j) = IsZero(axis[i]) || IsZero(axis[j]) ? S(T(0)) : u * T(axis[i] * axis[j]);
    }
    R(i, i) = R(i, i) + c;
  }
  for (size_t i = 0; i < 3; ++i) {
    if (IsZero(axis[i])) continue;
    const size_t k = (i + 1) % 3, l = (i + 2) % 3;
    R(l, k) = R(l, k) + s * axis[i];
    R(k, l) = R(k, l) - s * axis[i];
  }
  return R;
}

// What is computed between two frames: F on the parent, M on the child.

/// A function of the relative pose (d, R) of M in F, in F's axes.
template <typename T>
struct Scalar {
  enum class Kind {
    kSlide,
    kCosine,
    kDistance,
    kAngle,
    kRoll,
    kPitch,
    kYaw,
    kRotationVector,  ///< f·log R, |log R| < π
  };
  Kind kind = Kind::kSlide;
  size_t frames = 0;   ///< index of the pair
  Vector<T> f{}, m{};  ///< kSlide: f·d;  kCosine, and the sine of kAngle: f·R m
  Vector<T> g{}, n{};  ///< the cosine of kAngle: g·R n
  T less = T(0);       ///< kCosine: its value
  bool length = true;

  template <typename S>
  [[nodiscard]] S Of(const Vector<S>& d, const Matrix<S>& R, const NearAngle<T>& near) const {
    switch (kind) {
      case Kind::kSlide:
        return Dot(f, d);
      case Kind::kCosine:
        return Dot(f, R * m) - S(less);
      case Kind::kDistance:
        return Root(Dot(d, d));
      case Kind::kAngle:
        return Angle(Dot(f, R * m), Dot(g, R * n), near);
      case Kind::kRoll:
        return Angle(R(2, 1), R(2, 2), near);
      case Kind::kPitch:
        return Angle(S(-R(2, 0)), Root(R(0, 0) * R(0, 0) + R(1, 0) * R(1, 0)), near);
      case Kind::kYaw:
        return Angle(R(1, 0), R(0, 0), near);
      case Kind::kRotationVector: {
        const Vector<S> sine = Times(T(T(1) / 2), Vee(R) - Vee(Transposed(R)));
        const T half(T(1) / 2);
        const S cosine = half * (R(0, 0) + R(1, 1) + R(2, 2)) - S(half);
        return AngleOverSine(Dot(sine, sine), cosine) * Dot(f, sine);
      }
    }
    return S(T(0));
  }
};

/// Σ_k P_k(scalar_k), P_k without a constant term.
template <typename T>
struct Equation {
  struct Term {
    Scalar<T> scalar;
    std::vector<T> polynomial;  ///< coefficients of the first power, the second, …
    NearAngle<T> near;
  };
  std::vector<Term> terms;
  T constant = T(0);
  int spin = -1;  ///< instead of terms: the turn of an idle spin

  [[nodiscard]] bool length() const { return spin < 0 && terms.front().scalar.length; }
};

template <typename T, typename S>
S Polynomial(const std::vector<T>& c, const S& x) {
  S sum(T(0));
  for (size_t i = c.size(); i-- > 0;) sum = (sum + S(c[i])) * x;
  return sum;
}

/// Wrenches that an equation's multiplier 1 exerts on children; parents bear the opposite.
template <typename T>
struct Wrench {
  int parent = 0, child = 0;
  Six<T> on_child;
};

/// Values of a mechanism at one instant; everything about the world's origin and in its axes.
template <typename T>
class Model {
 public:
  using Poses = std::vector<Frame<T>>;
  using Motions = std::vector<Frame<Series<T>>>;

  /// The pair whose relative pose was asked for last, which several equations share.
  template <typename S>
  struct Last {
    size_t pair = static_cast<size_t>(-1);
    Frame<S> X_FM;
  };

  /// The same with what wrenches are made of.
  struct Seeds {
    size_t pair = static_cast<size_t>(-1);
    Frame<T> F, M;
    Vector<Tangent<T>> d;
    Matrix<Tangent<T>> R;
  };

  explicit Model(const Mechanism& mechanism);

  [[nodiscard]] int coordinates() const { return coordinates_; }
  [[nodiscard]] const Mechanism& mechanism() const { return mechanism_; }
  [[nodiscard]] const std::vector<Spin>& spins() const { return spins_; }
  [[nodiscard]] bool IsLengthCoordinate(int j) const { return lengths_[static_cast<size_t>(j)]; }

  /// Approximate body poses, from which the solution is sought: coordinates of balls count from
  /// there. The coordinates are filled in.
  void StartFrom(const std::vector<Pose>& X_WB, std::vector<T>* q);

  // What is asked of the motion.
  /// What cut joints lock and couplings keep. `turns`: BodyStates::coupled.
  [[nodiscard]] std::vector<Equation<T>> Closures(const std::vector<double>& turns) const;
  /// Rows of cut joints and couplings that transmit: without the rotations of joints that transmit
  /// a force only.
  [[nodiscard]] std::vector<bool> Transmitting() const;
  [[nodiscard]] Equation<T> CoordinateEquation(const Coordinate& coordinate, double near) const;
  [[nodiscard]] Equation<T> ElementEquation(const ForceElement& element, double near) const;
  [[nodiscard]] Equation<T> LengthEquation(const SpringDamper& spring) const;
  [[nodiscard]] static Equation<T> SpinEquation(int spin);

  // Poses and what follows from them.
  [[nodiscard]] Poses PosesAt(const std::vector<T>& q) const { return Chained<T>(q); }
  [[nodiscard]] Motions MotionsAt(const std::vector<Series<T>>& q) const {
    return Chained<Series<T>>(q);
  }
  /// `last` is kept from one equation to the next one at the same poses.
  template <typename S>
  [[nodiscard]] S ValueAt(const Equation<T>& equation, const std::vector<Frame<S>>& bodies,
                          Last<S>* last = nullptr) const;
  [[nodiscard]] std::vector<Wrench<T>> WrenchesAt(const Equation<T>& equation, const Poses& bodies,
                                                  Seeds* seeds = nullptr) const;
  /// Of a spin the turn about its line, for the position: 0 at the start.
  [[nodiscard]] Wrench<T> SpinTurnWrench(int spin, const Poses& bodies) const;
  /// Rate of a spin's n·ω where accelerations are those of the motion.
  [[nodiscard]] T SpinAcceleration(int spin, const Motions& bodies) const;

  /// A virtual motion of everything beyond a joint of the tree.
  struct Virtual {
    Six<T> twist;
    int body = 0;  ///< the outboard body of the joint
  };
  /// Of the tree's coordinates in order; `released`: then of the rotations that joints that
  /// transmit a force only lock.
  [[nodiscard]] std::vector<Virtual> VirtualAt(const std::vector<T>& q, const Poses& bodies,
                                               bool released) const;
  /// Adds what accelerations of the tree's coordinates do.
  void Accelerate(const std::vector<Virtual>& motions, const std::vector<T>& accelerations,
                  Motions* bodies) const;
  /// s_j·(what an equation exerts): its derivative by the coordinate.
  [[nodiscard]] T Along(const Virtual& motion, const std::vector<Wrench<T>>& wrenches) const;
  [[nodiscard]] bool IsBeyond(int body, int outboard) const {
    return beyond_[static_cast<size_t>(outboard)][static_cast<size_t>(body)];
  }

  /// Wrench that each body requires beyond its weight, whatever carries of it counted as a load.
  [[nodiscard]] std::vector<Six<T>> Required(const Motions& bodies) const;
  /// What a drive exerts of the gravity compensation, along its coordinate.
  [[nodiscard]] T CompensationAlong(const Drive& drive, const Poses& bodies) const;
  /// Rate and acceleration of an element of a ball's rotation (no position), and its wrench.
  [[nodiscard]] std::pair<Series<T>, std::vector<Wrench<T>>> BallMotion(
      const ForceElement& element, const Poses& bodies, const Motions& motions) const;
  /// Of a rotor whose coordinate moves so: a·ε of the carrier, and q̈ a + q̇ ω × a.
  [[nodiscard]] std::pair<T, Vector<T>> OnCarrier(const RotorAxis& carrier, const Series<T>& x,
                                                  const Motions& motions) const;
  /// Sum over the bodies beyond a joint's outboard body.
  [[nodiscard]] Six<T> SumBeyond(int outboard, const std::vector<Six<T>>& wrenches) const;
  /// [f; m] about M's origin in F's axes of a wrench on the joint's child.
  [[nodiscard]] std::array<T, 6> InJoint(const Joint& joint, const Six<T>& on_child,
                                         const Poses& bodies) const;
  /// The axis that a joint's coordinate turns about or slides along, unit, in F's axes.
  [[nodiscard]] Vector<T> AxisInJoint(const Joint& joint, int coordinate,
                                      const Poses& bodies) const;
  [[nodiscard]] int OutboardOf(size_t tree_joint) const { return tree_[tree_joint].outboard; }

 private:
  /// A frame fixed in a body; many are not turned.
  struct Fixed {
    Frame<T> X;
    bool turned = true;
    template <typename S>
    [[nodiscard]] Frame<S> Behind(const Frame<S>& X_WB) const {
      if (turned) return X_WB * X;
      Vector<S> p = X_WB.R * X.p;
      return {p + X_WB.p, X_WB.R};
    }
  };
  struct Pair {
    int parent, child;
    Fixed X_PF, X_CM, X_FP, X_MC;  ///< and their inverses
  };
  struct Step {
    bool turns = false;
    Vector<T> axis;
    int coordinate = 0;  ///< index into q
  };
  struct TreeJoint {
    int inboard = 0, outboard = 0;
    bool reversed = false;
    size_t pair = 0;
    std::vector<Step> slides, turns;
    Matrix<T> start;  ///< of a ball, before its turns
    bool ball = false;
    std::vector<Scalar<T>> locked;  ///< rotations, of one that transmits a force only
  };

  size_t AddPair(int parent, const Pose& X_PF, int child, const Pose& X_CM) {
    const auto fixed = [](const Frame<T>& X, const Pose& of) {
      return Fixed{X, !of.linear().isIdentity(0.0)};
    };
    const Frame<T> F = Lifted<T>(X_PF), M = Lifted<T>(X_CM);
    pairs_.push_back({parent, child, fixed(F, X_PF), fixed(M, X_CM), fixed(Inverse(F), X_PF),
                      fixed(Inverse(M), X_CM)});
    return pairs_.size() - 1;
  }
  [[nodiscard]] std::vector<Scalar<T>> Locks(const Joint& joint, size_t pair, bool rotations) const;
  [[nodiscard]] Scalar<T> JointScalar(size_t joint, int coordinate) const;
  [[nodiscard]] Scalar<T> DriveScalar(const Drive& drive, size_t d) const;
  template <typename S>
  [[nodiscard]] Frame<S> JointFrame(const TreeJoint& joint, const std::vector<S>& q) const;
  template <typename S>
  [[nodiscard]] std::vector<Frame<S>> Chained(const std::vector<S>& q) const;
  /// M in F, in F's axes.
  template <typename S>
  [[nodiscard]] Frame<S> Between(size_t pair, const std::vector<Frame<S>>& bodies) const {
    const Frame<S> F = ParentFrame(pair, bodies), M = ChildFrame(pair, bodies);
    const Matrix<S> R_FW = Transposed(F.R);
    return {R_FW * (M.p - F.p), R_FW * M.R};
  }
  template <typename S>
  [[nodiscard]] Frame<S> ParentFrame(size_t pair, const std::vector<Frame<S>>& bodies) const {
    return pairs_[pair].X_PF.Behind(bodies[static_cast<size_t>(pairs_[pair].parent)]);
  }
  template <typename S>
  [[nodiscard]] Frame<S> ChildFrame(size_t pair, const std::vector<Frame<S>>& bodies) const {
    return pairs_[pair].X_CM.Behind(bodies[static_cast<size_t>(pairs_[pair].child)]);
  }
  void Seed(size_t pair, const Poses& bodies, Seeds* seeds) const;
  template <typename S>
  const Frame<S>& Shared(size_t pair, const std::vector<Frame<S>>& bodies, Last<S>* last) const {
    if (last->pair != pair) last->X_FM = Between(pair, bodies), last->pair = pair;
    return last->X_FM;
  }

  const Mechanism mechanism_;
  std::vector<Spin> spins_;
  std::vector<Vector<T>> spin_across_, spin_fixed_;  ///< across the line in the body; in the world
  int coordinates_ = 0;
  std::vector<bool> lengths_;
  std::vector<TreeJoint> tree_;
  std::vector<Pair> pairs_;
  std::vector<size_t> joint_pair_, drive_pair_, output_pair_, spring_pair_, bushing_pair_;
  std::vector<std::vector<bool>> beyond_;  ///< [outboard][body]
  std::vector<T> mass_;
  std::vector<Vector<T>> centre_;
  std::vector<Matrix<T>> second_moment_;  ///< Σ of (1)
};

}  // namespace mbv::exact
