#include "features/equation_audit/cabin_robot_audit.h"

#include <array>
#include <cmath>

#include "analytic/cabin_robot/position.h"
#include "analytic/cabin_robot/stiffness.h"
#include "base/demand.h"
#include "features/equation_audit/audit.h"
#include "features/equation_audit/stiffness_truth.h"
#include "model_file/load_model.h"

namespace mbv::cabin_audit {

Pins Close(const Lengths& l, const SliderMotion& motion, double t) {
  const Vec3 x = motion.x + motion.v * t + 0.5 * motion.a * t * t;
  Pins p = motion.start;
  p.A = {x[0], 0.0};
  p.D = {x[1], 0.0};
  p.F = {x[2], 0.0};
  // Unknowns B, C; four squared rod lengths.
  for (int iteration = 0; iteration < 20; ++iteration) {
    p.E = 0.5 * (p.A + p.B);
    const Vec2 AB = p.B - p.A, FE = p.E - p.F, BC = p.C - p.B, DC = p.C - p.D;
    const Eigen::Vector4d r(AB.squaredNorm() - l.L1 * l.L1, FE.squaredNorm() - l.L4 * l.L4,
                            BC.squaredNorm() - l.L2 * l.L2, DC.squaredNorm() - l.L3 * l.L3);
    Eigen::Matrix4d J = Eigen::Matrix4d::Zero();
    J.row(0).head<2>() = 2.0 * AB.transpose();
    J.row(1).head<2>() = FE.transpose();
    J.row(2) << -2.0 * BC.transpose(), 2.0 * BC.transpose();
    J.row(3).tail<2>() = 2.0 * DC.transpose();
    const Eigen::Vector4d step = J.partialPivLu().solve(r);
    p.B -= step.head<2>();
    p.C -= step.tail<2>();
    if (step.cwiseAbs().maxCoeff() < 2 * kEps) break;
  }
  p.E = 0.5 * (p.A + p.B);
  return p;
}

std::vector<SliderMotion> RandomMotions(const Lengths& l, int count) {
  std::mt19937_64 random(20250201);
  std::uniform_real_distribution<double> unit(-1.0, 1.0);
  std::vector<SliderMotion> motions;
  while (static_cast<int>(motions.size()) < count) {
    // A pose: platform centre and tilt, then the rods by Pythagoras.
    const Vec2 K(0.08 * unit(random), 0.35 + 0.06 * unit(random));
    const double tilt = 0.15 * unit(random);
    const Vec2 half(0.5 * l.L2 * std::cos(tilt), 0.5 * l.L2 * std::sin(tilt));
    SliderMotion m;
    m.start.B = K - half;
    m.start.C = K + half;
    const auto foot = [](const Vec2& from, double length, double side) {
      return from.x() + side * std::sqrt(length * length - from.y() * from.y());
    };
    m.x[0] = foot(m.start.B, l.L1, -1.0);
    m.x[1] = foot(m.start.C, l.L3, 1.0);
    m.start.E = 0.5 * (Vec2(m.x[0], 0.0) + m.start.B);
    m.x[2] = foot(m.start.E, l.L4, 1.0);
    for (int i = 0; i < 3; ++i) {
      m.v[i] = 0.2 * unit(random);
      m.a[i] = 0.5 * unit(random);
    }
    m.start = Close(l, m, 0.0);
    motions.push_back(m);
  }
  return motions;
}

}  // namespace mbv::cabin_audit

namespace mbv {
namespace cabin_audit {

Lengths LengthsOf(const Mechanism& m) {
  const auto value = [&](const char* name) { return m.ParameterValue(name); };
  return {value("L1"), value("L2"), value("L3"), value("L4"), value("a2"),
          value("d3"), value("a3"), value("a4"), value("d6")};
}

}  // namespace cabin_audit

AuditTable AuditCabinRobot(const std::string& models_dir) {
  const LoadResult model = LoadModel(models_dir + "/cabin_robot/model.yaml");
  MBV_DEMAND(model.mechanism.has_value(), model.diagnostics.Text());
  const cabin_audit::Lengths lengths = cabin_audit::LengthsOf(*model.mechanism);
  const Mechanism elastic = stiffness_audit::LoadElastic(models_dir, "cabin_robot");
  AuditTable table;
  table.mechanism = "cabin_robot";
  table.source =
      "Liu Yi, Yao Jiantao, Guo Yutong, Yi Wangmin, Zhao Yongsheng, Design and analysis of hybrid "
      "cabin assembly attitude adjustment robot system, J. of National University of Defense "
      "Technology 47(2), 2025 (kinematics, dynamics and stiffness; directions of the figures are "
      "inferred from the equations)";
  for (auto rows :
       {cabin_audit::PositionRows(lengths, lengths), cabin_audit::WristRows(lengths, lengths),
        cabin_audit::VelocityRows(lengths, lengths),
        cabin_audit::DynamicsRows(*model.mechanism, *model.mechanism),
        cabin_audit::StiffnessRows(models_dir, cabin_robot::StiffnessParametersOf(elastic))}) {
    for (AuditRow& row : rows) table.rows.push_back(std::move(row));
  }
  return table;
}

}  // namespace mbv

namespace mbv::cabin_audit {
namespace {

// Lengths up to 1 m through a few square roots and inverse sines near 1.
constexpr double kLimit = 1e-13;
constexpr const char* kTruth = "pins closed by Newton on the rod lengths";

AuditRow Texts(const char* equation, const char* printed, const char* corrected, const char* unit,
               const char* note = kTruth) {
  return TextRow(equation, printed, corrected, unit, kLimit, note);
}

}  // namespace

std::vector<AuditRow> PositionRows(const Lengths& l, const Lengths& truth) {
  RowMeter alpha(Texts("(1) α, ε", "α = asin(s_B/L1), ε = asin(s_B/(2 L4)), s_B = Y − (L2/2) sin γ",
                       "", "rad"));
  RowMeter AF(Texts("(1) AF", "AF = (L1/2) cos α + L4 cos ε", "", "m"));
  RowMeter beta(Texts("(2) β", "β = asin(s_C/L3), s_C = Y + (L2/2) sin γ", "", "rad"));
  RowMeter AD(Texts("(2) AD", "AD = X_C + L3 cos β", "AD = X_C − X1 + L3 cos β", "m",
                    "right only with the origin at A; not used afterwards"));
  RowMeter sliders(Texts("(3), (4)", "X1 = X_B − AH, X2 = X_C + KD, X3 = X1 + AF", "", "m"));
  RowMeter forward(
      Texts("(9) α, β1, β2, γ",
            "cos α = (L1²/4 + AF² − L4²)/(L1 AF); sin β2 = L1 sin α/BD; cos β1 = (L3² + "
            "BD² − L2²)/(2 L3 BD); sin γ = (L3 sin β − L1 sin α)/L2",
            "", "rad", "with X1, X2 of (9) read as AF and AD, and β = β1 + β2"));
  RowMeter sum(Texts("(9) β", "not stated", "β = β1 + β2", "rad"));
  RowMeter C(Texts("after (9): C, G", "C = (L1 cos α + BM, L3 sin β), G = (L1 cos α + BM/2, …)",
                   "the same with X1 added to both abscissas", "m",
                   "right only with the origin at A"));
  for (const SliderMotion& m : RandomMotions(truth, 200)) {
    const Pins& p = m.start;
    const double ga = p.gamma(), s_B = p.B.y(), s_C = p.C.y();
    const double al = std::asin((p.K().y() - l.L2 / 2 * std::sin(ga)) / l.L1);
    const double ep = std::asin(s_B / (2 * l.L4)), be = std::asin(s_C / l.L3);
    alpha.Add(p.alpha(), al);
    alpha.Add(p.epsilon(), ep);
    const double AF_form = l.L1 / 2 * std::cos(al) + l.L4 * std::cos(ep);
    AF.Add(p.F.x() - p.A.x(), AF_form);
    beta.Add(p.beta(), be);
    AD.Add(p.D.x() - p.A.x(), p.C.x() + l.L3 * std::cos(be),
           p.C.x() - p.A.x() + l.L3 * std::cos(be));
    const double X1 = p.B.x() - l.L1 * std::cos(al);
    sliders.Add(m.x[0], X1);
    sliders.Add(m.x[1], p.C.x() + l.L3 * std::cos(be));
    sliders.Add(m.x[2], X1 + AF_form);

    const double AFx = m.x[2] - m.x[0], ADx = m.x[1] - m.x[0];
    const double a9 = std::acos((l.L1 * l.L1 / 4 + AFx * AFx - l.L4 * l.L4) / (l.L1 * AFx));
    const double BD = std::hypot(l.L1 * std::sin(a9), ADx - l.L1 * std::cos(a9));
    const double b2 = std::asin(l.L1 * std::sin(a9) / BD);
    const double b1 = std::acos((l.L3 * l.L3 + BD * BD - l.L2 * l.L2) / (2 * l.L3 * BD));
    const double g9 = std::asin((l.L3 * std::sin(b1 + b2) - l.L1 * std::sin(a9)) / l.L2);
    forward.Add(p.alpha(), a9);
    forward.Add(ga, g9);
    sum.Add(p.beta(), kNan, b1 + b2);
    const double rise = l.L3 * std::sin(b1 + b2) - l.L1 * std::sin(a9);
    const double BM = std::sqrt(l.L2 * l.L2 - rise * rise);
    const double Cx = l.L1 * std::cos(a9) + BM, Gx = l.L1 * std::cos(a9) + BM / 2;
    C.Add(p.C.x(), Cx, Cx + m.x[0]);
    C.Add(p.K().x(), Gx, Gx + m.x[0]);
  }
  AuditRow mapping = Texts("(8)", "ΔX1 = P, ΔX2 = X1, ΔX3 = X2",
                           "X1 of (3) is P; (9)'s X1, X2 are AF = X3 − X1 and AD = X2 − X1", "",
                           "a renaming that contradicts (3) when read literally");
  mapping.verdict = AuditVerdict::kNotTestable;
  return {alpha.Finish(), AF.Finish(),      beta.Finish(), AD.Finish(), sliders.Finish(),
          mapping,        forward.Finish(), sum.Finish(),  C.Finish()};
}

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
    cabin_robot::PlanarState s;
    s.X1 = {m.x[0], m.v[0], m.a[0]};
    s.X2 = {m.x[1], m.v[1], m.a[1]};
    s.X3 = {m.x[2], m.v[2], m.a[2]};
    const bool ok = cabin_robot::SolveForward({l.L1, l.L2, l.L3, l.L4}, &s).ok();
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
