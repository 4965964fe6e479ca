// Equations (17)–(20) with rates, and the amplification's 0/0 rule.
#include <cmath>

#include "audit/platform_audit.h"
#include "audit/row_meter.h"

namespace mbv::platform_audit {
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
