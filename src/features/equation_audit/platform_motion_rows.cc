// Equations (1)–(7): screws of a limb, closure conditions, parasitic motion.

#include <cmath>
#include <numbers>

#include "analytic/stabilizing_platform/position.h"
#include "features/equation_audit/audit.h"
#include "features/equation_audit/stabilizing_platform_audit.h"

namespace mbv::platform_audit {
namespace {

// (1): the relative twist of links 2 and 2' as a sum of the chain's first three screws.
void ScrewRows(const Case& c, std::vector<AuditRow>* rows) {
  RowMeter chain({.equation = "(1) $1, $2, $3",
                  .printed = "R12 at (0, b2, c2): (1 0 0; 0 c2 −b2)",
                  .limit = kRateLimit,
                  .unit = "m/s",
                  .note = "velocity of link 2 from tilt and joint rates, against the reference"});
  RowMeter primed({.equation = "(1) R12'",
                   .erratum = "E4",
                   .printed = "R12' at (0, −b2, −c2)",
                   .corrected = "R12' at (0, −b2, +c2), as its screw (1 0 0; 0 c2 b2) says",
                   .limit = kPositionLimit,
                   .unit = "m",
                   .note = "place of the elbow R12' in {A_i}; c2 is the elbow's height"});
  RowMeter equivalent({.equation = "(2)",
                       .printed = "equivalent RPS screws $e1 … $e5",
                       .limit = kRateLimit,
                       .unit = "m/s",
                       .note = "part of the platform's relative twist outside their span: the "
                               "velocity of B along Y; synchronous drives"});
  const double b1 = c.parameters.L5;
  for (size_t n = 0; n < c.truth.size(); ++n) {
    for (int i = 0; i < 3; ++i) {
      const LimbTruth& limb = c.truth[n].limbs[i];
      const Vec3 &E = limb.side[0].elbow_A, &E_p = limb.side[1].elbow_A;
      const auto screws = sp::LimbScrews(b1, E.y(), E.z(), limb.l);
      const Vec6 V = screws[1] * limb.tilt_rate + screws[0] * limb.side[0].q1_rate +
                     screws[2] * (limb.side[0].q2_rate - limb.side[0].q1_rate);
      for (int k = 0; k < 6; ++k) chain.Add(limb.link_twist_A[sp::kLink2][k], V[k]);
      primed.Add(E_p.z(), -E.z(), E.z());
      const Vec6& V_op = c.truth[n].V_op;
      const Vec3 B_rate = V_op.tail<3>() + V_op.head<3>().cross(limb.p_oB);
      equivalent.Add(B_rate.norm(), B_rate.norm() + limb.R_oA.col(1).dot(B_rate));
    }
  }
  rows->push_back(chain.Finish());
  rows->push_back(primed.Finish());
  rows->push_back({.equation = "(1) labels",
                   .erratum = "E4",
                   .printed = "labels $6 and $8 appear twice",
                   .corrected = "$1 … $9 in the printed order",
                   .unit = "",
                   .verdict = AuditVerdict::kNotTestable,
                   .note = "a label, no quantity"});
  rows->push_back(equivalent.Finish());
}

// (3), (4) and the azimuths of section 4.
void ClosureRows(const Case& c, std::vector<AuditRow>* rows) {
  RowMeter loop({.equation = "(3)",
                 .printed = "r_ep = r_es + R_es r_so + R_eo r_oB − R_ep r_pB",
                 .limit = kPositionLimit,
                 .unit = "m",
                 .note = "with the reference's tips B_i of links 2"});
  RowMeter planes({.equation = "(4)",
                   .erratum = "E1",
                   .printed = "y_B/x_B = 0, tan θ1, tan θ2 with θ1 = θ2 = 120°",
                   .corrected = "θ2 = 240°",
                   .limit = kPositionLimit,
                   .unit = "m",
                   .note = "distance of B_3 from the plane of limb 3, whose azimuth is 240°"});
  RowMeter azimuth({.equation = "section 4 data, in (5)",
                    .erratum = "E1",
                    .printed = "θ1 = θ2 = 120°: u1 = u2 = u3 = 0, γ = atan(0/0)",
                    .corrected = "θ2 = 240°",
                    .limit = kPositionLimit,
                    .unit = "rad",
                    .note = "yaw γ of the reference"});
  const double third = 2 * std::numbers::pi / 3;
  for (size_t n = 0; n < c.truth.size(); ++n) {
    const Truth& t = c.truth[n];
    for (int i = 0; i < 3; ++i) {
      const double psi = c.parameters.azimuth(i);
      const Vec3 B = c.parameters.r_b * Vec3(std::cos(psi), std::sin(psi), 0);
      const Vec3 r = t.X_eo * t.limbs[i].p_oB - t.X_ep.linear() * B;
      for (int k = 0; k < 3; ++k) loop.Add(t.X_ep.translation()[k], r[k]);
    }
    const Vec3& B3 = t.limbs[2].p_oB;
    auto off_plane = [&](double psi) { return -std::sin(psi) * B3.x() + std::cos(psi) * B3.y(); };
    const double r = B3.norm();
    planes.Add(r, r + off_plane(third), r + off_plane(c.parameters.theta_2));
    const double yaw = std::atan2(t.X_ep.linear()(1, 0), t.X_ep.linear()(0, 0));
    azimuth.Add(yaw, kNan, std::atan2(c.closed[n].upper.R_EB(1, 0), c.closed[n].upper.R_EB(0, 0)));
  }
  for (RowMeter* meter : {&loop, &planes, &azimuth}) rows->push_back(meter->Finish());
}

AuditRow Row(const char* equation, const char* printed, double limit, const char* unit) {
  return {.equation = equation,
          .printed = printed,
          .limit = limit,
          .unit = unit,
          .note = "against the reference's platform"};
}

AuditRow WrongRow(const char* equation, const char* erratum, const char* printed,
                  const char* corrected, double limit, const char* unit) {
  AuditRow row = Row(equation, printed, limit, unit);
  row.erratum = erratum;
  row.corrected = corrected;
  return row;
}

constexpr const char* kPrintedM = "M = … + r_b (sδ − sγ)[− cα tβ/(cβ tθ2) − (1 + tβ²) sα]";
constexpr const char* kCorrectedM = "[+ cα tβ/(cβ tθ2) − …]";

// (5)–(7).
void ParasiticRows(const Case& c, std::vector<AuditRow>* rows) {
  RowMeter yaw(Row("(5) γ", "γ = atan[…]", kPositionLimit, "rad"));
  RowMeter y(Row("(5) y", "y = −tα (z0 − h) − r_b sγ", kPositionLimit, "m"));
  RowMeter x(Row("(5) x", "x = tβ/cα (z0 − h) − r_b cδ + …", kPositionLimit, "m"));
  RowMeter yaw_rate(
      WrongRow("(6) γ'", "E3", "w4 in U is not defined", "w4 = u1² + u3²", kRateLimit, "rad/s"));
  RowMeter y_rate(Row("(6) y'", "y' = −(1 + tα²)(z0 − h) α' + …", kRateLimit, "m/s"));
  RowMeter dot(
      WrongRow("(6) x', first term", "", "L α (the dot is missing)", "L α'", kRateLimit, "m/s"));
  RowMeter x_rate(WrongRow("(6) M in x'", "E2", kPrintedM, kCorrectedM, kRateLimit, "m/s"));
  RowMeter yaw_2(Row("(7) γ''", "γ'' = […]/U² (with w4 as corrected)", kRateLimit, "rad/s²"));
  RowMeter y_2(Row("(7) y''", "y'' = …", kRateLimit, "m/s²"));
  RowMeter x_2(WrongRow("(7) M, M' in x''", "E2", kPrintedM, kCorrectedM, kRateLimit, "m/s²"));
  for (const Truth& t : c.truth) {
    const Jet &z = t.command.platform[2], &h = t.command.heave;
    const Jet height{z.value - h.value, z.rate - h.rate, z.acceleration - h.acceleration};
    sp::ParasiticMotion right, printed;
    for (auto [sign, out] :
         {std::pair{sp::SignInM::kCorrected, &right}, std::pair{sp::SignInM::kPrinted, &printed}}) {
      if (!sp::ComputeParasiticMotion(c.parameters, t.command.roll, t.command.pitch, height, sign,
                                      out)
               .ok()) {
        out->x.value = kNan;
      }
    }
    const Vec3 p = t.X_ep.translation();
    yaw.Add(std::atan2(t.X_ep.linear()(1, 0), t.X_ep.linear()(0, 0)), right.yaw.value);
    y.Add(p.y(), right.y.value);
    x.Add(p.x(), right.x.value);
    yaw_rate.Add(t.motion_p[2], kNan, right.yaw.rate);
    y_rate.Add(t.motion_p[4], right.y.rate);
    x_rate.Add(t.motion_p[3], printed.x.rate, right.x.rate);
    // L from the corrected form: x' is linear in α' for fixed γ'.
    const Jet &a = t.command.roll, &b = t.command.pitch;
    const double L =
        std::tan(a.value) * std::tan(b.value) * height.value / std::cos(a.value) +
        c.parameters.r_b *
            (std::sin(right.yaw.value + c.parameters.theta_2) - std::sin(right.yaw.value)) *
            (-std::sin(a.value) / (std::cos(b.value) * std::tan(c.parameters.theta_2)) -
             std::cos(a.value) * std::tan(b.value));
    dot.Add(t.motion_p[3], right.x.rate + L * (a.value - a.rate), right.x.rate);
    yaw_2.Add(t.acceleration_p[2], right.yaw.acceleration);
    y_2.Add(t.acceleration_p[4], right.y.acceleration);
    x_2.Add(t.acceleration_p[3], printed.x.acceleration, right.x.acceleration);
  }
  for (RowMeter* meter : {&yaw, &y, &x, &yaw_rate, &y_rate, &dot, &x_rate, &yaw_2, &y_2, &x_2}) {
    rows->push_back(meter->Finish());
  }
}

}  // namespace

std::vector<AuditRow> PoseRows(const Case& full) {
  std::vector<AuditRow> rows;
  ScrewRows(full, &rows);
  ClosureRows(full, &rows);
  ParasiticRows(full, &rows);
  return rows;
}

// Equations (8)–(16): twists of the platforms, limb lengths and their rates.

namespace {

RowMeter Meter(const char* equation, const char* printed, double limit, const char* unit,
               const char* note) {
  return RowMeter(
      {.equation = equation, .printed = printed, .limit = limit, .unit = unit, .note = note});
}

void AddAll(const Vec6& truth, const Vec6& printed, RowMeter* meter) {
  for (int k = 0; k < 6; ++k) meter->Add(truth[k], printed[k]);
}

void PlatformRows(const Case& c, std::vector<AuditRow>* rows) {
  constexpr const char* kTwist = "the reference's twist about the earth's origin";
  constexpr const char* kSpatial = "time differences of the reference's twist";
  RowMeter V_ep = Meter("(8)", "V_ep = [ω; v_p − ω × r_ep]", kRateLimit, "m/s", kTwist);
  RowMeter A_ep =
      Meter("(9)", "A_ep = [ε; a_p − ε × r_ep − ω × v_p]", kDifferenceLimit, "m/s²", kSpatial);
  RowMeter V_eo = Meter("(10)", "V_eo = [ω; v_o − ω × r_eo]", kRateLimit, "m/s", kTwist);
  RowMeter A_eo = Meter("(11)", "A_eo = [ε; a_o − ε × r_eo − ω × v_o]", kDifferenceLimit, "m/s²",
                        "time differences of the reference's twist; e_y once without its prime, "
                        "read as e_y'");
  RowMeter V_op = Meter("(12)", "V_ep = V_eo + Ad(g_eo) °V_op", kRateLimit, "m/s",
                        "the reference's platform relative to the lower one, in {o}");
  RowMeter A_op = Meter("(13)", "A_ep = A_eo + Ad(g_eo) °A_op + [V_eo, V_op]", kDifferenceLimit,
                        "m/s²", "time differences of the relative twist's components in {o}");
  for (size_t n = 0; n < c.truth.size(); ++n) {
    const Truth& t = c.truth[n];
    const sp::Evaluation& e = c.closed[n];
    AddAll(t.V_ep, sp::TwistOf(e.upper), &V_ep);
    AddAll(t.A_ep, sp::SpatialAccelerationOf(e.upper), &A_ep);
    AddAll(t.V_eo, sp::TwistOf(e.lower), &V_eo);
    AddAll(t.A_eo, sp::SpatialAccelerationOf(e.lower), &A_eo);
    AddAll(t.V_op, e.motion.V_op, &V_op);
    AddAll(t.A_op, e.motion.A_op, &A_op);
  }
  for (RowMeter* meter : {&V_ep, &A_ep, &V_eo, &A_eo, &V_op, &A_op}) {
    rows->push_back(meter->Finish());
  }
}

void LengthRows(const Case& c, std::vector<AuditRow>* rows) {
  RowMeter length = Meter("(14)", "l_i = |°r_op + R_op r_pB − r_oA|", kPositionLimit, "m",
                          "foot to tip of link 2 in the reference");
  RowMeter virtual_rate = Meter("(15)", "$1 … $6 of the virtual limb", kRateLimit, "rad/s",
                                "J⁻¹ °V_op: the virtual joint at rest, the tilt's rate as in the "
                                "reference");
  RowMeter rate = Meter("(16) l'", "q' = G V", kRateLimit, "m/s", "speed of the reference's tip");
  RowMeter acceleration = Meter("(16) l''", "q'' = G A − q'ᵀ H q'", kDifferenceLimit, "m/s²",
                                "time differences of the reference's l'");
  RowMeter rest = Meter("(16) φ''", "q'' = G A − q'ᵀ H q'", kDifferenceLimit, "rad/s²",
                        "the virtual joints stay at rest");
  std::array<sp::LimbPlace, 3> places;
  for (int i = 0; i < 3; ++i) {
    places[i] = sp::LimbPlace(c.parameters.azimuth(i), c.parameters.r_a, c.parameters.r_b);
  }
  for (size_t n = 0; n < c.truth.size(); ++n) {
    const Truth& t = c.truth[n];
    const sp::Evaluation& e = c.closed[n];
    const sp::EquivalentRates q =
        sp::RatesOf(sp::ComputeInfluence(places, e.limbs), e.motion.V_op, e.motion.A_op);
    for (int i = 0; i < 3; ++i) {
      const LimbTruth& limb = t.limbs[i];
      length.Add(limb.l, e.limbs[i].length.value);
      const Vec6 joint_rates =
          sp::VirtualLimbScrews(places[i], e.limbs[i]).partialPivLu().solve(e.motion.V_op);
      virtual_rate.Add(0, joint_rates[0]);
      virtual_rate.Add(limb.tilt_rate, joint_rates[1]);
      rate.Add(limb.l_rate, q.rate[i]);
      acceleration.Add(limb.l_acceleration, q.acceleration[i]);
      rest.Add(0, q.acceleration[3 + i]);
    }
  }
  for (RowMeter* meter : {&length, &virtual_rate, &rate, &acceleration, &rest}) {
    rows->push_back(meter->Finish());
  }
}

}  // namespace

std::vector<AuditRow> TwistRows(const Case& full) {
  std::vector<AuditRow> rows;
  PlatformRows(full, &rows);
  LengthRows(full, &rows);
  return rows;
}

// Equations (17)–(20) with rates, and the amplification's 0/0 rule.

namespace {

void TiltRow(const Case& c, std::vector<AuditRow>* rows) {
  RowMeter tilt({.equation = "(17)",
                 .erratum = "E5",
                 .printed = "λ_i = atan[(x_B − x_A)/(z_B − z_A)], x of {o}",
                 .corrected = "λ_i = atan[e_r · (B − A)/(z_B − z_A)]",
                 .limit = kPositionLimit,
                 .unit = "rad",
                 .note = "tilt of the reference's link 1; the print holds for limb 1 only"});
  for (size_t n = 0; n < c.truth.size(); ++n) {
    for (int i = 0; i < 3; ++i) {
      const sp::LimbMotion& limb = c.closed[n].limbs[i];
      const Vec3 AB = limb.p_oB - limb.p_oA;
      tilt.Add(c.truth[n].limbs[i].tilt, std::atan(AB.x() / AB.z()), limb.tilt.value);
    }
  }
  rows->push_back(tilt.Finish());
}

void PositionRows(const Case& c, std::vector<AuditRow>* rows) {
  const sp::PlatformParameters& p = c.parameters;
  RowMeter first({.equation = "(18)",
                  .printed = "foot – A – tip = foot – elbow – tip",
                  .limit = kPositionLimit,
                  .unit = "m",
                  .note = "residual with the reference's angles, both sides"});
  RowMeter second({.equation = "(19)",
                   .printed = "foot – base ball – rod ball = foot – rod ball",
                   .limit = kPositionLimit,
                   .unit = "m",
                   .note = "drive length from the reference's angle q1 + θ3"});
  RowMeter root({.equation = "(20) q1",
                 .erratum = "E6",
                 .printed = "2 atan[(A ± √(A² + B² − C²))/(B − C)], read with +, A, B not given",
                 .corrected = "A = l, B = L5, root with −",
                 .limit = kPositionLimit,
                 .unit = "rad",
                 .note = "the crossing assembly; the paper leaves the choice to the reader"});
  RowMeter drive({.equation = "(20) R",
                  .erratum = "E6",
                  .printed = "R = √[(L1 C1 − L2 − L2)² + (L2 S2)²]",
                  .corrected = "R = √[(L2 C2 − L5 − L4)² + (L2 S2)²]",
                  .limit = kPositionLimit,
                  .unit = "m",
                  .note = "drive lengths of the reference; subscripts damaged in the print"});
  for (size_t n = 0; n < c.truth.size(); ++n) {
    for (int i = 0; i < 3; ++i) {
      const LimbTruth& limb = c.truth[n].limbs[i];
      const sp::SideMotion& closed = c.closed[n].limbs[i].side[0];
      for (const SideTruth& side : limb.side) {
        first.Add(p.L5, p.L1 * std::cos(side.q1) + p.L3 * std::cos(side.q2));
        first.Add(limb.l, p.L1 * std::sin(side.q1) + p.L3 * std::sin(side.q2));
        const double q12 = side.q1 + p.theta_3;
        second.Add(side.R.value,
                   std::hypot(p.L2 * std::cos(q12) - p.L5 - p.L4, p.L2 * std::sin(q12)));
        const double A = limb.l, B = p.L5;
        const double C = -(B * B + p.L1 * p.L1 + A * A - p.L3 * p.L3) / (2 * p.L1);
        root.Add(side.q1, 2 * std::atan((A + std::sqrt(A * A + B * B - C * C)) / (B - C)),
                 closed.q1.value);
        drive.Add(side.R.value, std::hypot(p.L1 * closed.c1 - 2 * p.L2, p.L2 * closed.s12),
                  closed.R.value);
      }
    }
  }
  for (RowMeter* meter : {&first, &second, &root, &drive}) rows->push_back(meter->Finish());
}

void RateRows(const Case& c, std::vector<AuditRow>* rows) {
  RowMeter rate({.equation = "derivatives of (18), (19): R'",
                 .printed = "four linear systems, not written out",
                 .limit = kRateLimit,
                 .unit = "m/s",
                 .note = "solved in closed form; the reference's drive speeds"});
  RowMeter acceleration({.equation = "derivatives of (18), (19): R''",
                         .printed = "four linear systems, not written out",
                         .limit = kRateLimit,
                         .unit = "m/s²",
                         .note = "the reference's drive accelerations"});
  RowMeter ratio({.equation = "Fig. 10, ratio at 0/0",
                  .printed = "the neighbouring instant's value (0.01 s later)",
                  .corrected = "the limit dl/dR",
                  .approximation = 1e-2,  // of about 2.3: what a figure shows
                  .limit = 1e-9,
                  .unit = "1",
                  .note = "l'/R' of the reference in the neutral pose; the figure shows no "
                          "difference below 0.01"});
  for (size_t n = 0; n < c.truth.size(); ++n) {
    for (int i = 0; i < 3; ++i) {
      for (int j = 0; j < 2; ++j) {
        const Jet& R = c.closed[n].limbs[i].side[j].R;
        rate.Add(c.truth[n].limbs[i].side[j].R.rate, R.rate);
        acceleration.Add(c.truth[n].limbs[i].side[j].R.acceleration, R.acceleration);
      }
    }
  }
  const sp::Amplification amplification(c.parameters);
  const sp::PlatformEquations equations(c.parameters, sp::DrivePairs::kSynchronous);
  sp::Evaluation later;
  const bool ok = equations.EvaluateKinematics(SeaStateAt(0.01), &later).ok();
  for (int i = 0; i < 3; ++i) {
    const LimbTruth& neutral = c.truth[0].limbs[i];
    ratio.Add(neutral.l_rate / neutral.side[0].R.rate, ok ? amplification(later.limbs[i]) : kNan,
              amplification.neutral_ratio());
  }
  for (RowMeter* meter : {&rate, &acceleration, &ratio}) rows->push_back(meter->Finish());
}

}  // namespace

std::vector<AuditRow> LimbRows(const Case& full) {
  std::vector<AuditRow> rows;
  TiltRow(full, &rows);
  PositionRows(full, &rows);
  RateRows(full, &rows);
  return rows;
}

}  // namespace mbv::platform_audit
