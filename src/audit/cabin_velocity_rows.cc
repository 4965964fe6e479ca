#include <array>
#include <cmath>

#include "analytic/cabin_robot/planar_linkage.h"
#include "audit/cabin_audit.h"
#include "audit/cabin_planar_truth.h"
#include "audit/row_meter.h"

namespace mbv::cabin_audit {
namespace {

using Vec4 = Eigen::Vector4d;

// Differences of Newton poses: roundoff 2e-16 · 1.5/step, times 20 for the tilt near the smallest
// β + γ, times 5 for the Jacobian's unit speeds gives 6e-11 for rates; 490/180 · 2e-16/step² · 20 =
// 3e-9 for accelerations. The truncation, of order step⁶, is smaller.
constexpr double kRateStep = 5e-4, kAccelerationStep = 2e-3;
constexpr double kRateLimit = 2e-10, kAccelerationLimit = 1e-8;

AuditRow VelocityTexts(const char* equation, const char* printed, const char* corrected,
                       const char* unit, const char* note = "differences of Newton-closed pins",
                       double limit = kRateLimit) {
  return TextRow(equation, printed, corrected, unit, limit, note);
}

// Velocities relative to slider A, and the angles, of one state.
struct PlanarRates {
  double al, be, ga, ep;  // angles
  double V0, V2, V3;      // slider A; F and D relative to it
  Vec2 vB, vC, vE, vK;    // relative to A
  double w, w_CD;         // turning rates of BC; of CD, as β grows
};

PlanarRates RatesAt(const Lengths& l, const SliderMotion& m) {
  const Pins& p = m.start;
  const auto pins = [&](double t) {
    const Pins q = Close(l, m, t);
    Eigen::Matrix<double, 10, 1> v;
    v << q.B - q.A, q.C - q.A, q.E - q.A, q.K() - q.A, q.gamma(), q.beta();
    return v;
  };
  const auto rate = FirstDifference(pins, kRateStep);
  return {p.alpha(),
          p.beta(),
          p.gamma(),
          p.epsilon(),
          m.v[0],
          m.v[2] - m.v[0],
          m.v[1] - m.v[0],
          rate.segment<2>(0),
          rate.segment<2>(2),
          rate.segment<2>(4),
          rate.segment<2>(6),
          rate[8],
          rate[9]};
}

// Jacobian of (V_X, V_Y, W_γ) with respect to (V0, V2, V3) by differences.
Mat3 TrueJacobian(const Lengths& l, SliderMotion m) {
  // Columns: all sliders together; F alone; D alone.
  const std::array<Vec3, 3> speeds = {Vec3(1, 1, 1), Vec3(0, 0, 1), Vec3(0, 1, 0)};
  Mat3 J;
  m.a.setZero();
  for (int k = 0; k < 3; ++k) {
    m.v = 0.2 * speeds[k];
    const auto pose = [&](double t) {
      const Pins q = Close(l, m, t);
      return Vec3(q.K().x(), q.K().y(), q.gamma());
    };
    J.col(k) = 5.0 * FirstDifference(pose, kRateStep);
  }
  return J;
}

struct JacobianForms {
  Mat3 printed, corrected;
};

JacobianForms JacobianOf(const Lengths& l, const PlanarRates& s) {
  const double k = std::cos(s.ep) / std::sin(s.al + s.ep), S = std::sin(s.be + s.ga);
  const double cot = std::cos(s.be + s.ga) / S, sag = std::sin(s.al - s.ga);
  JacobianForms J;
  J.corrected << 1.0, k * (std::sin(s.al) + sag * std::sin(s.be) / S),
      std::cos(s.be) * std::sin(s.ga) / (2 * S), 0.0,
      k * (-std::cos(s.al) + sag * std::cos(s.be) / S), -std::cos(s.be) * std::cos(s.ga) / (2 * S),
      0.0, 2 * k * std::sin(s.al + s.be) / (l.L2 * S), -std::cos(s.be) / (l.L2 * S);
  J.printed << 1.0,
      std::cos(s.ep) * sag * (std::cos(s.ga) - cot * std::sin(s.ga)) / std::sin(s.al + s.be),
      std::cos(s.be) * std::sin(s.ga) / S, 0.0, -std::cos(s.be) * std::cos(s.ga) / (2 * S),
      k * sag * (std::sin(s.ga) + std::cos(s.ga) * cot), 0.0,
      2 * k * (std::cos(s.al - s.ga) - sag * cot) / l.L2, std::cos(s.be) / (l.L2 * S);
  return J;
}

std::vector<AuditRow> JacobianRows(const Lengths& l, const Lengths& truth,
                                   const std::vector<SliderMotion>& motions) {
  struct Element {
    int row, column;
    RowMeter meter;
  };
  std::vector<Element> elements = {
      {0, 0, RowMeter(VelocityTexts("(24), (25) J11", "1", "", "1", "needs V2, V3 relative to A"))},
      {0, 1,
       RowMeter(VelocityTexts("(25) J12",
                              "cos ε sin(α−γ) [cos λ − cot(γ+β) sin γ]/sin(α+β), λ undefined",
                              "cos ε/sin(α+ε) · [sin α + sin(α−γ) sin β/sin(β+γ)]", "1",
                              "print read with λ = γ; half of V_B is missing"))},
      {0, 2,
       RowMeter(VelocityTexts("(25) J13", "cos β sin γ/sin(γ+β)", "half of it", "1",
                              "factor 1/2 missing"))},
      {1, 1,
       RowMeter(VelocityTexts("(25) J22", "−cos β cos γ/(2 sin(γ+β))",
                              "cos ε/sin(α+ε) · [−cos α + sin(α−γ) cos β/sin(β+γ)]", "1",
                              "J22 and J23 are interchanged"))},
      {1, 2,
       RowMeter(VelocityTexts("(25) J23", "cos ε sin(α−γ)[sin γ + cos γ cot(γ+β)]/sin(α+ε)",
                              "−cos β cos γ/(2 sin(β+γ))", "1", "J22 and J23 are interchanged"))},
      {2, 1,
       RowMeter(VelocityTexts("(25) J32", "2 cos ε [cos(α−γ) − sin(α−γ) cot(β+γ)]/(L2 sin(α+ε))",
                              "the same with + in the bracket", "1/m", "sign"))},
      {2, 2,
       RowMeter(VelocityTexts("(25) J33", "cos β/(L2 sin(γ+β))", "−cos β/(L2 sin(β+γ))", "1/m",
                              "sense of rotation opposite to γ"))}};
  for (const SliderMotion& m : motions) {
    const Mat3 J = TrueJacobian(truth, m);
    const JacobianForms forms = JacobianOf(l, RatesAt(truth, m));
    for (Element& e : elements) {
      e.meter.Add(J(e.row, e.column), forms.printed(e.row, e.column),
                  forms.corrected(e.row, e.column));
    }
  }
  std::vector<AuditRow> rows;
  for (Element& e : elements) rows.push_back(e.meter.Finish());
  return rows;
}

AuditRow AccelerationRow(const Lengths& l, const Lengths& truth,
                         const std::vector<SliderMotion>& motions) {
  RowMeter meter(VelocityTexts(
      "(35), (36)", "A = J̇ V + J V̇ = q̇ᵀ H q̇ + G q̈", "", "m/s², rad/s²",
      "form, with the corrected J; second differences of Newton-closed pins", kAccelerationLimit));
  for (const SliderMotion& m : motions) {
    const auto pose = [&](double t) {
      const Pins q = Close(truth, m, t);
      return Vec3(q.K().x(), q.K().y(), q.gamma());
    };
    const Vec3 a = SecondDifference(pose, kAccelerationStep);
    cabin::PlanarState s;
    s.X1 = {m.x[0], m.v[0], m.a[0]};
    s.X2 = {m.x[1], m.v[1], m.a[1]};
    s.X3 = {m.x[2], m.v[2], m.a[2]};
    const bool ok = cabin::SolveForward({l.L1, l.L2, l.L3, l.L4}, &s).ok();
    const Vec3 form(s.X.a, s.Y.a, s.gamma.a);
    for (int c = 0; c < 3; ++c) meter.Add(a[c], ok ? form[c] : kNan);
  }
  return meter.Finish();
}

}  // namespace

std::vector<AuditRow> VelocityRows(const Lengths& l, const Lengths& truth) {
  RowMeter ep14(VelocityTexts("(14)", "ε = asin(L1 sin α/(2 L4))", "", "rad"));
  RowMeter ef15(
      VelocityTexts("(15)", "V_EF = V2 cos ε", "", "m/s", "V2 is the speed of F relative to A"));
  RowMeter e16(VelocityTexts("(16)", "V_E = V_EF/cos δ, δ = α + β − 90°", "δ = α + ε − 90°", "m/s",
                             "wrong index"));
  RowMeter b17(VelocityTexts("(17)", "V_E = V2 cos ε/sin(α+ε), V_B = 2 V_E", "", "m/s"));
  RowMeter bc18(
      VelocityTexts("(18), (19)", "V_BC^n = V_B sin(α−γ), V_BC^t = V_B cos(α−γ)", "", "m/s"));
  RowMeter cd20(VelocityTexts(
      "(20)", "V_CD^n = V3 cos β, V_CD^t = V3 sin β", "", "m/s",
      "the velocity of D relative to A, from that of C and the turning of the rigid CD"));
  RowMeter m20(
      VelocityTexts("below (20): m", "m⃗ = (m sin γ, m cos γ)", "m⃗ = (m sin γ, −m cos γ)", "m/s",
                    "the printed vector is not normal to BC; (21) uses the corrected one"));
  RowMeter m22(
      VelocityTexts("(21), (22)", "m = −V_B sin(α−γ) cot(β+γ) + V3 cos β/sin(β+γ)", "", "m/s"));
  RowMeter x23(VelocityTexts("(23) V_X", "½ (m sin γ + V_BC^n cos γ) + V0",
                             "V0 + V_BC^n cos γ + ½ (m + V_BC^t) sin γ", "m/s",
                             "half of the velocity of C instead of the mean of B and C"));
  RowMeter y23(VelocityTexts("(23) V_Y", "½ (V_BC^n sin γ − m cos γ)",
                             "V_BC^n sin γ − ½ (m + V_BC^t) cos γ", "m/s"));
  RowMeter w23(VelocityTexts("(23) W_γ", "(m − V_BC^t)/L2", "(V_BC^t − m)/L2", "rad/s",
                             "wrong sense of rotation"));
  const std::vector<SliderMotion> motions = RandomMotions(truth, 100);
  for (const SliderMotion& m : motions) {
    const PlanarRates s = RatesAt(truth, m);
    const Vec2 along_EF(std::cos(s.ep), -std::sin(s.ep)), along_CD(std::cos(s.be), -std::sin(s.be));
    const Vec2 across_AB(std::sin(s.al), -std::cos(s.al));
    const Vec2 along_BC(std::cos(s.ga), std::sin(s.ga)), across_BC(std::sin(s.ga), -std::cos(s.ga));
    ep14.Add(s.ep, std::asin(l.L1 * std::sin(s.al) / (2 * l.L4)));
    const double V_EF = s.V2 * std::cos(s.ep), S1 = std::sin(s.al + s.ep);
    ef15.Add(s.vE.dot(along_EF), V_EF);
    e16.Add(s.vE.dot(across_AB), V_EF / std::sin(s.al + s.be), V_EF / S1);
    const double V_B = 2 * V_EF / S1;
    b17.Add(s.vB.dot(across_AB), V_B);
    const double Vn = V_B * std::sin(s.al - s.ga), Vt = V_B * std::cos(s.al - s.ga);
    bc18.Add(s.vB.dot(along_BC), Vn);
    bc18.Add(s.vB.dot(across_BC), Vt);
    // C moves across CD by what CD turns about D, and with D.
    const Vec2 across_CD(std::sin(s.be), std::cos(s.be));
    cd20.Add(s.vC.dot(along_CD), s.V3 * std::cos(s.be));
    cd20.Add(s.vC.dot(across_CD) - l.L3 * s.w_CD, s.V3 * std::sin(s.be));
    const double S = std::sin(s.be + s.ga);
    const double mm = -Vn * std::cos(s.be + s.ga) / S + s.V3 * std::cos(s.be) / S;
    m22.Add(s.vC.dot(across_BC), mm);
    m20.Add(s.vC.y(), Vn * std::sin(s.ga) + mm * std::cos(s.ga),
            Vn * std::sin(s.ga) - mm * std::cos(s.ga));
    const Vec2 vK = s.vK + Vec2(s.V0, 0.0);
    x23.Add(vK.x(), 0.5 * (mm * std::sin(s.ga) + Vn * std::cos(s.ga)) + s.V0,
            s.V0 + Vn * std::cos(s.ga) + 0.5 * (mm + Vt) * std::sin(s.ga));
    y23.Add(vK.y(), 0.5 * (Vn * std::sin(s.ga) - mm * std::cos(s.ga)),
            Vn * std::sin(s.ga) - 0.5 * (mm + Vt) * std::cos(s.ga));
    w23.Add(s.w, (mm - Vt) / l.L2, (Vt - mm) / l.L2);
  }
  std::vector<AuditRow> rows = {ep14.Finish(), ef15.Finish(), e16.Finish(), b17.Finish(),
                                bc18.Finish(), cd20.Finish(), m20.Finish(), m22.Finish(),
                                x23.Finish(),  y23.Finish(),  w23.Finish()};
  for (AuditRow& row : JacobianRows(l, truth, motions)) rows.push_back(std::move(row));
  rows.push_back(AccelerationRow(l, truth, motions));
  AuditRow shapes =
      VelocityTexts("(37)–(40)", "rows and columns of ν, α_ij, H transposed at places",
                    "ν is 1×3, α_ij is 3×1, H is 3×3×3", "",
                    "definitions of the influence coefficients; only shapes to correct");
  shapes.verdict = AuditVerdict::kNotTestable;
  rows.push_back(shapes);
  return rows;
}

}  // namespace mbv::cabin_audit
