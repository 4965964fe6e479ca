// Equations (11)–(20): velocities of platform, slides and legs.
#include "audit/row_meter.h"
#include "audit/spr_tripod_audit.h"
#include "core/spatial.h"

namespace mbv::spr_tripod_audit {
namespace {

using namespace spr_tripod;

void AddVector(RowMeter* meter, const Vec3& truth, const Vec3& printed) {
  for (int k = 0; k < 3; ++k) meter->Add(truth[k], printed[k]);
}

RowMeter Rate(const char* equation, const char* printed, const char* unit, const char* note) {
  return RowMeter(
      {.equation = equation, .printed = printed, .limit = kRateLimit, .unit = unit, .note = note});
}

// (11)–(14).
void SlideRows(const Case& c, std::vector<AuditRow>* rows) {
  RowMeter ball = Rate("(11)", "v_Bi = v_Ai + Ω × r_BiAi + v_rel = 0", "m/s",
                       "solved for v_Ai with the reference's Ω, q̇_i, w_i");
  RowMeter orientation = Rate("(12)", "ω = J_c v, J_c = −{[(r_i − q_i w_i) × c_i]ᵀ}⁻¹ c_iᵀ",
                              "rad/s", "r_i means a_i; against the reference's platform");
  RowMeter hinge = Rate("(13)", "v_Ai = v + ω × r_i", "m/s", "against the reference's rods");
  RowMeter letter({.equation = "(14) first form",
                   .printed = "q̇_i = v_Bi·w_i",
                   .corrected = "q̇_i = v_Ai·w_i",
                   .limit = kRateLimit,
                   .unit = "m/s",
                   .note = "v_Bi is zero; and J v is the vector of all q̇, not one q̇_i"});
  RowMeter matrix = Rate("(14) J", "J = [w_iᵀ] + [(r_i × w_i)ᵀ] J_c", "m/s",
                         "q̇ = J v against the reference's slides");
  for (size_t n = 0; n < c.truth.size(); ++n) {
    const Truth& t = c.truth[n];
    const Closed& k = c.closed[n];
    AddVector(&orientation, t.omega, k.j.J_c * t.v);
    const Vec3 q_dot = k.j.J * t.v;
    for (int i = 0; i < 3; ++i) {
      const LegTruth& leg = t.leg[i];
      AddVector(&ball, leg.v_A, leg.omega.cross(leg.q * leg.w) + leg.q_dot * leg.w);
      AddVector(&hinge, leg.v_A, t.v + t.omega.cross(k.p.a[i]));
      letter.Add(leg.q_dot, 0.0, leg.v_A.dot(k.p.w[i]));
      matrix.Add(leg.q_dot, q_dot[i]);
    }
  }
  for (RowMeter* meter : {&ball, &orientation, &hinge, &letter, &matrix}) {
    rows->push_back(meter->Finish());
  }
}

// (20) as printed: J_c behind the whole bracket.
Vec3 PrintedLegOmega(const Closed& k, int i, const Vec3& v) {
  const Vec3 &w = k.p.w[i], &a = k.p.a[i];
  const Mat3 bracket =
      Skew(w) + (w.dot(a) * Mat3::Identity() - a * w.transpose()) + k.p.q[i] * w * w.transpose();
  return bracket * k.j.J_c * v / k.p.q[i];
}

// (15)–(20).
void LegRows(const Case& c, std::vector<AuditRow>* rows) {
  RowMeter across = Rate("(15)", "v_Ai = v_Bi + ω_i × r_AiBi + (v_Ai·w_i) w_i", "m/s",
                         "with the reference's ω_i");
  RowMeter swing = Rate("(16)", "ω_ixy = [w_i × v + (w_iᵀr_i) ω − r_i (w_iᵀω)]/q_i", "rad/s",
                        "against the part of the reference's ω_i across w_i");
  RowMeter tip = Rate("(17)", "v_Ci = v + ω × (r_i + c_i)", "m/s",
                      "against the point C_i of the reference's rods");
  RowMeter tip_leg = Rate("(18) second form", "v_Ci = v + ω × r_i + ω_i × c_i", "m/s",
                          "against the point C_i of the reference's platform");
  RowMeter spin = Rate("(19)", "ω_iz = (w_iᵀω) w_i", "rad/s",
                       "against the part of the reference's ω_i along w_i");
  RowMeter sum({.equation = "(20)",
                .printed = "J_di = (1/q_i)[[w_i×] + ((w_iᵀr_i) E − r_i w_iᵀ) + q_i w_i w_iᵀ] J_c",
                .corrected = "J_di = (1/q_i){[w_i×] + [(w_iᵀr_i) E − r_i w_iᵀ + q_i w_i w_iᵀ] J_c}",
                .limit = kRateLimit,
                .unit = "rad/s",
                .note = "a bracket: [w_i×] acts on v itself, J_c belongs to the terms with ω"});
  for (size_t n = 0; n < c.truth.size(); ++n) {
    const Truth& t = c.truth[n];
    const Closed& k = c.closed[n];
    for (int i = 0; i < 3; ++i) {
      const LegTruth& leg = t.leg[i];
      const Vec3 &w = k.p.w[i], &a = k.p.a[i], &c_i = k.p.c[i];
      const Vec3 along = leg.w.dot(leg.omega) * leg.w;
      AddVector(&across, leg.v_A, leg.omega.cross(leg.q * w) + leg.v_A.dot(w) * w);
      AddVector(&swing, leg.omega - along,
                (w.cross(t.v) + w.dot(a) * t.omega - a * w.dot(t.omega)) / k.p.q[i]);
      AddVector(&tip, leg.v_A + leg.omega.cross(leg.c), t.v + t.omega.cross(a + c_i));
      AddVector(&tip_leg, t.v + t.omega.cross(leg.A - t.r + leg.c),
                t.v + t.omega.cross(a) + k.v.omega_leg[i].cross(c_i));
      AddVector(&spin, along, w.dot(t.omega) * w);
      const Vec3 printed = PrintedLegOmega(k, i, t.v);
      const Vec3 corrected = LegJacobian(k.p, k.j, i) * t.v;
      for (int m = 0; m < 3; ++m) sum.Add(leg.omega[m], printed[m], corrected[m]);
    }
  }
  rows->push_back(across.Finish());
  rows->push_back(swing.Finish());
  rows->push_back(tip.Finish());
  rows->push_back(
      {.equation = "(18) first form",
       .printed = "v_Ci = v_Ai + ω_Ai × r_CiAi",
       .corrected = "v_Ci = v_Ai + ω_i × r_CiAi",
       .unit = "",
       .verdict = AuditVerdict::kNotTestable,
       .note = "a misprint: a point has no angular velocity; its second form is right"});
  rows->push_back(tip_leg.Finish());
  rows->push_back(spin.Finish());
  rows->push_back(sum.Finish());
}

}  // namespace

std::vector<AuditRow> VelocityRows(const Case& c) {
  std::vector<AuditRow> rows;
  SlideRows(c, &rows);
  LegRows(c, &rows);
  return rows;
}

// The extension to accelerations and forces, against the same reference.
std::vector<AuditRow> DynamicsRows(const Case& c) {
  const auto row = [](const char* equation, const char* form, double limit, const char* unit) {
    return RowMeter({.equation = equation,
                     .printed = form,
                     .limit = limit,
                     .unit = unit,
                     .note = "not in the paper; against the reference"});
  };
  RowMeter omega_dot = row("(D1)", "ω̇ by differentiating (12)", kAccelerationLimit, "rad/s²");
  RowMeter q_ddot =
      row("(D3)", "q̈_i = a_Ai·w_i + |v_Ai − q̇_i w_i|²/q_i", kAccelerationLimit, "m/s²");
  RowMeter leg_dot =
      row("(D6)", "ω̇_i = [w_i × a_Ai − 2q̇_i ω_ixy]/q_i + d/dt ω_iz", kAccelerationLimit, "rad/s²");
  RowMeter force = row("(D9)", "f = J⁻ᵀ Σ (VᵀF + WᵀN)", kForceLimit, "N");
  RowMeter reaction =
      row("(D11)", "S_i from the balances of force, moment and each leg's hinge", kForceLimit, "N");
  RowMeter second = row("(D12)", "f_i = (S_i − F_cyl,i)·w_i", kForceLimit, "N");
  for (size_t n = 0; n < c.truth.size(); ++n) {
    const Truth& t = c.truth[n];
    const Closed& k = c.closed[n];
    AddVector(&omega_dot, t.omega_dot, k.a.omega_dot);
    for (int i = 0; i < 3; ++i) {
      q_ddot.Add(t.leg[i].q_ddot, k.a.q_ddot[i]);
      AddVector(&leg_dot, t.leg[i].omega_dot, k.a.omega_leg_dot[i]);
      force.Add(t.leg[i].f, k.f.f[i]);
      AddVector(&reaction, t.leg[i].S, k.f.S[i]);
      second.Add(t.leg[i].f, k.f.f_check[i]);
    }
  }
  std::vector<AuditRow> rows;
  for (RowMeter* meter : {&omega_dot, &q_ddot, &leg_dot, &force, &reaction, &second}) {
    rows.push_back(meter->Finish());
  }
  return rows;
}

}  // namespace mbv::spr_tripod_audit
