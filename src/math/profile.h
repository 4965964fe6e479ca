// Time profiles: scalar functions of time with two exact derivatives.
#pragma once

#include <array>
#include <memory>
#include <variant>
#include <vector>

// Polynomials on consecutive intervals of time, with their two exact derivatives.

namespace mbv {

/// A value with its first and second time derivative.
struct Jet {
  double value = 0.0, rate = 0.0, acceleration = 0.0;
};

/// On [knots[i], knots[i+1]]: Σ_k coefficients[i][k] (t − knots[i])^k.
struct Piecewise {
  static constexpr int kDegree = 5;
  using Polynomial = std::array<double, kDegree + 1>;
  enum class Outside {
    kHold,    ///< rests at its first and its last value
    kExtend,  ///< the first and the last polynomial go on
    kRepeat,  ///< begins again; each round adds `advance`
  };

  std::vector<double> knots;             ///< increasing, one more than polynomials [s]
  std::vector<Polynomial> coefficients;  ///< at least one
  Outside outside = Outside::kHold;
  double advance = 0.0;        ///< kRepeat: a crank's turns
  std::vector<double> breaks;  ///< where acceleration or jerk jump, increasing [s]

  [[nodiscard]] double start_s() const { return knots.front(); }
  [[nodiscard]] double end_s() const { return knots.back(); }
};

[[nodiscard]] Jet Evaluate(const Piecewise& pieces, double t_s);

/// The polynomial Σ_k c[k] x^k.
[[nodiscard]] Jet Evaluate(const Piecewise::Polynomial& c, double x);

/// c
struct ConstantTerm {
  double value = 0.0;
};
/// c·t
struct RampTerm {
  double rate = 0.0;
};
/// amplitude · sin(2π·frequency·t + phase)
struct SineTerm {
  double amplitude = 0.0, frequency_hz = 1.0, phase_rad = 0.0;
};
/// delta · σ((t − start)/duration), σ(s) = 10s³ − 15s⁴ + 6s⁵, held at 0 before and delta after.
struct PolyStepTerm {
  double start_s = 0.0, duration_s = 1.0, delta = 0.0;
};
/// delta · σ((t − start)/duration), σ(s) = 35s⁴ − 84s⁵ + 70s⁶ − 20s⁷, held at 0 before and delta
/// after: jerk is continuous, too.
struct Poly4567StepTerm {
  double start_s = 0.0, duration_s = 1.0, delta = 0.0;
};
/// delta · σ((t − start)/duration), σ(s) = s − sin(2πs)/(2π), held at 0 before and delta after.
struct CycloidStepTerm {
  double start_s = 0.0, duration_s = 1.0, delta = 0.0;
};
/// height · sin⁴(π (t − start)/duration) inside the interval, 0 outside.
struct BumpTerm {
  double start_s = 0.0, duration_s = 1.0, height = 0.0;
};
/// Half of a 3-4-5 ramp, cruise at constant speed, second half of the ramp: a path of length
/// `length` run from rest to rest with at most v_max and a_max, scaled by delta/length.
/// [Mei 2012, Eqs. 21, 22]; a pure 3-4-5 polynomial when the length is too short to cruise.
struct RampCruiseTerm {
  double start_s = 0.0;
  double length = 0.0;  ///< path length S [m], > 0
  double v_max = 0.0;   ///< [m/s], > 0
  double a_max = 0.0;   ///< [m/s²], > 0
  double delta = 0.0;   ///< change of this coordinate over the whole segment
};

/// delta · σ((t − start)/duration), held at 0 before and delta after, with Neklutin's modified sine
///   (4 + π) σ(s) = π s − sin(4πs)/4               s <= 1/8
///                  2 + π s − 9/4 sin((4πs + π)/3) s <= 7/8
///                  4 + π s − sin(4πs)/4           s <= 1
struct ModifiedSineTerm {
  double start_s = 0.0, duration_s = 1.0, delta = 0.0;
};
/// offset + Σ_k a_k/(kω) sin(kωt) − b_k/(kω) cos(kωt), ω = 2π·frequency, k = 1, 2, …
/// [Swevers 1997, Eq. 13]: its rate is Σ_k a_k cos(kωt) + b_k sin(kωt).
struct FourierTerm {
  double offset = 0.0, frequency_hz = 1.0;
  std::vector<double> a, b;  ///< amplitudes of the rate; as many b as a
};
/// Polynomials on intervals: what math/profile.h makes, and tables.
struct PiecewiseTerm {
  std::shared_ptr<const Piecewise> pieces;
};

/// 0 before at_s, delta from there on: what is switched, forces only.
struct JumpTerm {
  double at_s = 0.0, delta = 0.0;
};

using ProfileTerm =
    std::variant<ConstantTerm, RampTerm, SineTerm, PolyStepTerm, Poly4567StepTerm, CycloidStepTerm,
                 BumpTerm, RampCruiseTerm, ModifiedSineTerm, FourierTerm, PiecewiseTerm, JumpTerm>;

/// The sum of its terms, which are functions of t + from_s.
struct Profile {
  std::vector<ProfileTerm> terms;
  double from_s = 0.0;  ///< where on the terms' own time axis t = 0 is [s]
};

[[nodiscard]] Jet Evaluate(const ProfileTerm& term, double t_s);
[[nodiscard]] Jet Evaluate(const Profile& profile, double t_s);

/// Duration of a ramp–cruise–ramp segment [s].
[[nodiscard]] double Duration(const RampCruiseTerm& term);

/// Times at which some derivative of the profile jumps (ascending, without repetition) [s]: an
/// integrator should step onto them.
[[nodiscard]] std::vector<double> BreakTimes(const Profile& profile);

/// Times at which its value jumps, ascending, without repetition [s]. There and a round-off before
/// it has its value after the jump, and at BeforeJump() of such a time the one before.
[[nodiscard]] std::vector<double> JumpTimes(const Profile& profile);
[[nodiscard]] double BeforeJump(double t_s);

[[nodiscard]] inline Profile Constant(double value) { return {.terms = {ConstantTerm{value}}}; }

// Laws of motion made of polynomials: point to point within limits, and through given points.

/// What a motion from rest to rest may reach.
struct MotionLimits {
  double v_max = 0.0;  ///< > 0
  double a_max = 0.0;  ///< > 0
  double j_max = 0.0;  ///< > 0; S-curve only
};

/// Shortest motion by `delta` with |rate| <= v_max and |acceleration| <= a_max: constant
/// acceleration, cruise, the same deceleration; no cruise where v_max is not reached
/// (|delta| <= v_max²/a_max). Breaks: where the acceleration jumps.
[[nodiscard]] Piecewise Trapezoid(double start_s, double delta, const MotionLimits& limits);

/// The same with |jerk| <= j_max: seven intervals of constant jerk +j 0 −j | 0 | −j 0 +j. With
/// T_j the time of each jerk and T_a that of the whole acceleration,
///   v_max reached:  T_j = min(a_max/j, √(v_max/j)),  T_a = T_j + v_max/(j T_j),
///                   T_v = |delta|/v_max − T_a >= 0
///   not reached:    T_v = 0, T_j = min(a_max/j, ∛(|delta|/2j)),
///                   T_a = T_j/2 + √(T_j²/4 + |delta|/(j T_j))
/// [Biagiotti 2008, §3.4]. Intervals that come to nothing are left out.
[[nodiscard]] Piecewise SCurve(double start_s, double delta, const MotionLimits& limits);

/// Through values[i] at time_s[i] (two at least) with four continuous derivatives between rests;
/// at rest (rate and acceleration zero) at the first and the last, and where `rest` says so.
[[nodiscard]] Piecewise Via(const std::vector<double>& time_s, const std::vector<double>& values,
                            const std::vector<bool>& rest);

}  // namespace mbv
