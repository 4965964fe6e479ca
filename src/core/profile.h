// Time profiles: scalar functions of time with two exact derivatives.
#pragma once

#include <memory>
#include <variant>
#include <vector>

#include "core/piecewise.h"

namespace mbv {

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
/// Polynomials on intervals: what core/motion_laws.h makes, and tables.
struct PiecewiseTerm {
  std::shared_ptr<const Piecewise> pieces;
};

using ProfileTerm =
    std::variant<ConstantTerm, RampTerm, SineTerm, PolyStepTerm, Poly4567StepTerm, CycloidStepTerm,
                 BumpTerm, RampCruiseTerm, ModifiedSineTerm, FourierTerm, PiecewiseTerm>;

/// The sum of its terms.
struct Profile {
  std::vector<ProfileTerm> terms;
};

[[nodiscard]] Jet Evaluate(const ProfileTerm& term, double t_s);
[[nodiscard]] Jet Evaluate(const Profile& profile, double t_s);

/// Duration of a ramp–cruise–ramp segment [s].
[[nodiscard]] double Duration(const RampCruiseTerm& term);

/// Times at which some derivative of the profile jumps (ascending, without repetition) [s]: an
/// integrator should step onto them.
[[nodiscard]] std::vector<double> BreakTimes(const Profile& profile);

[[nodiscard]] inline Profile Constant(double value) { return {{ConstantTerm{value}}}; }

}  // namespace mbv
