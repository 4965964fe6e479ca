#include <cmath>

#include "audit/cabin_audit.h"
#include "audit/cabin_planar_truth.h"
#include "audit/row_meter.h"

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

}  // namespace mbv::cabin_audit
