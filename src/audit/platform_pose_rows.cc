// Equations (1)–(7): screws of a limb, closure conditions, parasitic motion.
#include <cmath>
#include <numbers>

#include "analytic/stabilizing_platform/equivalent_limb.h"
#include "audit/platform_audit.h"
#include "audit/row_meter.h"

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

}  // namespace mbv::platform_audit
