#include "analytic/cabin_robot/position.h"

#include <cmath>

namespace mbv::cabin_robot {
namespace {

// Below this sine a configuration counts as singular: forces grow as its inverse.
constexpr double kSingularSine = 1e-6;

RunSummary Trouble(Stop stop, const char* where, const char* message, double amount,
                   const char* unit, bool names_where = false) {
  RunSummary summary;
  summary.stop = stop;
  summary.message = message;
  summary.where = where;
  summary.names_where = names_where;
  summary.amount = amount;
  summary.unit = unit;
  return summary;
}

// φ with sin φ = s/L on (−π/2, π/2), and its derivatives from those of s.
Motion1 ArcSine(const Motion1& s, double length) {
  Motion1 angle;
  angle.p = std::asin(s.p / length);
  const double co = std::cos(angle.p);
  angle.v = s.v / (length * co);
  angle.a = (s.a / length + std::sin(angle.p) * angle.v * angle.v) / co;
  return angle;
}

// length · cos φ and length · sin φ with derivatives.
Motion1 Cosine(double length, const Motion1& f) {
  const double c = std::cos(f.p), s = std::sin(f.p);
  return {length * c, -length * s * f.v, -length * (c * f.v * f.v + s * f.a)};
}
Motion1 Sine(double length, const Motion1& f) {
  const double c = std::cos(f.p), s = std::sin(f.p);
  return {length * s, length * c * f.v, length * (c * f.a - s * f.v * f.v)};
}

Motion1 operator+(const Motion1& x, const Motion1& y) { return {x.p + y.p, x.v + y.v, x.a + y.a}; }
Motion1 operator-(const Motion1& x, const Motion1& y) { return {x.p - y.p, x.v - y.v, x.a - y.a}; }

// (9): the angles from AF = X3 − X1 and AD = X2 − X1.
RunSummary SolveAngles(const PlanarGeometry& g, PlanarState* s) {
  const double AF = s->X3.p - s->X1.p, AD = s->X2.p - s->X1.p;
  const double cos_alpha = (g.L1 * g.L1 / 4.0 + AF * AF - g.L4 * g.L4) / (g.L1 * AF);
  if (!(std::abs(cos_alpha) < 1.0)) {
    return Trouble(Stop::kUnreachable, "loop A-E-F", "the strut EF cannot close its loop",
                   std::max(AF - g.L1 / 2.0 - g.L4, std::abs(g.L1 / 2.0 - g.L4) - AF), "m");
  }
  s->alpha.p = std::acos(cos_alpha);
  const double By = g.L1 * std::sin(s->alpha.p), Bx = g.L1 * cos_alpha;
  s->epsilon.p = std::atan2(0.5 * By, AF - 0.5 * Bx);

  const double BD = std::hypot(By, AD - Bx);
  const double beta2 = std::atan2(By, AD - Bx);
  const double cos_beta1 = (g.L3 * g.L3 + BD * BD - g.L2 * g.L2) / (2.0 * g.L3 * BD);
  if (!(std::abs(cos_beta1) < 1.0)) {
    return Trouble(Stop::kUnreachable, "loop A-B-C-D",
                   "the links BC and CD cannot close their loop",
                   std::max(BD - g.L2 - g.L3, std::abs(g.L2 - g.L3) - BD), "m");
  }
  s->beta.p = beta2 + std::acos(cos_beta1);
  s->gamma.p = std::atan2(g.L3 * std::sin(s->beta.p) - By, AD - g.L3 * std::cos(s->beta.p) - Bx);
  return RunSummary::Done();
}

RunSummary CheckRegular(const PlanarState& s) {
  const double strut = std::sin(s.alpha.p + s.epsilon.p);
  if (std::abs(strut) < kSingularSine) {
    return Trouble(Stop::kSingular, "strut EF", "the strut EF lies in line with AB", strut, "sin",
                   true);
  }
  const double link = std::sin(s.beta.p + s.gamma.p);
  if (std::abs(link) < kSingularSine) {
    return Trouble(Stop::kSingular, "link CD", "the link CD lies in line with BC", link, "sin",
                   true);
  }
  return RunSummary::Done();
}

}  // namespace

RunSummary SolveInverse(const PlanarGeometry& g, PlanarState* s) {
  // s_B, s_C: heights of B and C over the sliders.
  const Motion1 half = Sine(g.L2 / 2.0, s->gamma);
  const Motion1 s_B = s->Y - half, s_C = s->Y + half;
  if (!(std::abs(s_B.p) < g.L1)) {
    return Trouble(Stop::kUnreachable, "link AB", "AB is too short for the height of B",
                   std::abs(s_B.p) - g.L1, "m");
  }
  if (!(std::abs(s_C.p) < g.L3)) {
    return Trouble(Stop::kUnreachable, "link CD", "CD is too short for the height of C",
                   std::abs(s_C.p) - g.L3, "m");
  }
  if (!(std::abs(s_B.p) < 2.0 * g.L4)) {
    return Trouble(Stop::kUnreachable, "strut EF", "EF is too short for the height of E",
                   std::abs(s_B.p) / 2.0 - g.L4, "m");
  }
  s->alpha = ArcSine(s_B, g.L1);          // (1)
  s->epsilon = ArcSine(s_B, 2.0 * g.L4);  // (1)
  s->beta = ArcSine(s_C, g.L3);           // (2)

  // (3), (4)
  const Motion1 half_x = Cosine(g.L2 / 2.0, s->gamma);
  s->X1 = s->X - half_x - Cosine(g.L1, s->alpha);
  s->X2 = s->X + half_x + Cosine(g.L3, s->beta);
  s->X3 = s->X1 + Cosine(g.L1 / 2.0, s->alpha) + Cosine(g.L4, s->epsilon);
  return CheckRegular(*s);
}

RunSummary SolveForward(const PlanarGeometry& g, PlanarState* s) {
  if (RunSummary summary = SolveAngles(g, s); !summary.ok()) return summary;
  if (RunSummary summary = CheckRegular(*s); !summary.ok()) return summary;

  // Angle rates, the corrected (14)–(23).
  const AngleRates D = RatesOf(g, *s);
  const Vec3 v(s->X1.v, s->X2.v, s->X3.v);
  s->alpha.v = D.alpha.dot(v);
  s->beta.v = D.beta.dot(v);
  s->epsilon.v = D.epsilon.dot(v);
  s->gamma.v = D.gamma.dot(v);

  // Angle accelerations in closed form, equivalent to the influence coefficients (35)–(46).
  const double A2 = s->X3.a - s->X1.a, A3 = s->X2.a - s->X1.a;
  const double al = s->alpha.p, be = s->beta.p, ep = s->epsilon.p, ga = s->gamma.p;
  const double al2 = s->alpha.v * s->alpha.v, be2 = s->beta.v * s->beta.v;
  const double ep2 = s->epsilon.v * s->epsilon.v, ga2 = s->gamma.v * s->gamma.v;
  const double S1 = std::sin(al + ep), S = std::sin(be + ga);
  s->alpha.a =
      -2.0 * (A2 * std::cos(ep) + g.L1 / 2.0 * al2 * std::cos(al + ep) + g.L4 * ep2) / (g.L1 * S1);
  s->epsilon.a =
      -(A2 * std::cos(al) + g.L1 / 2.0 * al2 + g.L4 * ep2 * std::cos(al + ep)) / (g.L4 * S1);
  const double tangential = s->alpha.a;
  s->gamma.a =
      -(A3 * std::cos(be) + g.L1 * (tangential * std::sin(al + be) + al2 * std::cos(al + be)) +
        g.L2 * ga2 * std::cos(be + ga) + g.L3 * be2) /
      (g.L2 * S);
  s->beta.a =
      -(A3 * std::cos(ga) + g.L1 * (tangential * std::sin(al - ga) + al2 * std::cos(al - ga)) +
        g.L2 * ga2 + g.L3 * be2 * std::cos(be + ga)) /
      (g.L3 * S);

  // Platform centre K = A + L1 u(α) + (L2/2) u(γ).
  s->X = s->X1 + Cosine(g.L1, s->alpha) + Cosine(g.L2 / 2.0, s->gamma);
  s->Y = Sine(g.L1, s->alpha) + Sine(g.L2 / 2.0, s->gamma);
  return RunSummary::Done();
}

AngleRates RatesOf(const PlanarGeometry& g, const PlanarState& s) {
  const double al = s.alpha.p, be = s.beta.p, ep = s.epsilon.p, ga = s.gamma.p;
  const double S1 = std::sin(al + ep), S = std::sin(be + ga);
  // With respect to V2 and V3.
  const double alpha_2 = -2.0 * std::cos(ep) / (g.L1 * S1);
  const double epsilon_2 = -std::cos(al) / (g.L4 * S1);
  const double gamma_2 = -g.L1 * alpha_2 * std::sin(al + be) / (g.L2 * S);
  const double gamma_3 = -std::cos(be) / (g.L2 * S);
  const double beta_2 = -g.L1 * alpha_2 * std::sin(al - ga) / (g.L3 * S);
  const double beta_3 = -std::cos(ga) / (g.L3 * S);
  // V2 = Ẋ3 − Ẋ1, V3 = Ẋ2 − Ẋ1.
  const auto absolute = [](double by_2, double by_3) { return Vec3(-by_2 - by_3, by_3, by_2); };
  return {absolute(alpha_2, 0.0), absolute(beta_2, beta_3), absolute(epsilon_2, 0.0),
          absolute(gamma_2, gamma_3)};
}

}  // namespace mbv::cabin_robot
