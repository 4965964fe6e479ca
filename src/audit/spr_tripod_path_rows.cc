// Equations (21), (22), the data of Table 1 and the workspace of section 3.
#include <cmath>

#include "analytic/spr_tripod/workspace.h"
#include "audit/row_meter.h"
#include "audit/spr_tripod_audit.h"
#include "core/profile.h"

namespace mbv::spr_tripod_audit {
namespace {

using namespace spr_tripod;

constexpr double kPrintedConstant = 5.7735;
constexpr double kAMax = 10.0;  // m/s²

// S(t) of (21) and its derivatives at ρ for duration T.
Jet PrintedLaw(double rho, double T) {
  const double k = kAMax * T * T / kPrintedConstant;
  return {k * rho * rho * rho * (10 - 15 * rho + 6 * rho * rho),
          k / T * 30 * rho * rho * (1 - rho) * (1 - rho),
          k / (T * T) * 60 * rho * (1 - rho) * (1 - 2 * rho)};
}

void LawRows(std::vector<AuditRow>* rows) {
  RowMeter law({.equation = "(21)",
                .printed = "S = a_max T²/5.7735 (10ρ³ − 15ρ⁴ + 6ρ⁵)",
                .limit = kAMax * 5e-5 / kPrintedConstant,
                .unit = "m/s²",
                .note = "peak acceleration against a_max = 10; 5.7735 is 10/√3 rounded, the limit "
                        "is half its last digit"});
  // Peak of the second derivative at ρ = (3 − √3)/6.
  law.Add(kAMax, PrintedLaw((3 - std::sqrt(3.0)) / 6, 0.3).acceleration);
  RowMeter speed({.equation = "(22)",
                  .printed = "v_max = a_max T/5.7735 (30ρ² − 60ρ³ + 30ρ⁴), ρ = 1/2",
                  .limit = 1e-9,
                  .unit = "m/s",
                  .note = "against differences of (21) over 1e-5 s; the peak speed, at ρ = 1/2, is "
                          "1.875 S/T"});
  const double T = 0.3, h = 1e-5;
  for (double rho : {0.2, 0.5, 0.8}) {
    const double difference =
        (8 * (PrintedLaw(rho + h / T, T).value - PrintedLaw(rho - h / T, T).value) -
         (PrintedLaw(rho + 2 * h / T, T).value - PrintedLaw(rho - 2 * h / T, T).value)) /
        (12 * h);
    const double r2 = rho * rho;
    speed.Add(difference, kAMax * T / kPrintedConstant * (30 * r2 - 60 * r2 * rho + 30 * r2 * r2));
  }
  rows->push_back(law.Finish());
  rows->push_back(speed.Finish());
}

// By how much the path P1 P2 P3 P4 with half width R and height h leaves the stroke, at its best
// start height.
double StrokeViolation(const Geometry& g, double R, double h) {
  double best = std::numeric_limits<double>::infinity();
  for (double z_c = 0.40; z_c < 0.701; z_c += 0.01) {
    double worst = 0.0;
    for (int k = 0; k <= 40; ++k) {
      for (double z : {z_c - 0.5 * h, z_c + 0.5 * h}) {
        if (z < z_c && k != 0 && k != 40) continue;  // the lower side is not on the path
        Posture p;
        if (!SolveInverse(g, {R * (k - 20) / 20.0, 0, z}, &p).ok()) {
          worst = std::numeric_limits<double>::infinity();
          continue;
        }
        for (double q : p.q) worst = std::max({worst, q - g.q_max, g.q_min - q});
      }
    }
    best = std::min(best, worst);
  }
  return best;
}

void ExampleRows(const Case& c, std::vector<AuditRow>* rows) {
  AuditRow path{.equation = "Table 1, R and h",
                .printed = "R = 0.400, h = 0.200",
                .corrected = "both scaled by 0.3: R = 0.120, h = 0.060",
                .residual_printed = StrokeViolation(c.geometry, 0.4, 0.2),
                .residual_corrected = StrokeViolation(c.geometry, 0.12, 0.06),
                .scale = c.geometry.q_max - c.geometry.q_min,
                .limit = 0.0,
                .unit = "m",
                .note =
                    "by how much the path leaves the stroke 0.5 … 0.75 m at its best height "
                    "(gamma = 0; heights in steps of 10 mm); the workspace is 0.45 m wide"};
  path.verdict = VerdictOf(path);
  rows->push_back(path);
  rows->push_back(
      {.equation = "section 4, v_max",
       .printed = "0.75 m/min",
       .corrected = "0.75 m/s",
       .unit = "",
       .verdict = AuditVerdict::kNotTestable,
       .note = "at 0.0125 m/s the ramp to full speed takes 3.8 ms over 26 µm and the printed path "
               "96.0 s, so that a_max = 10 m/s² means nothing; at 0.75 m/s it takes 1.92 s"});
}

void WorkspaceRow(const Case& c, std::vector<AuditRow>* rows) {
  RowMeter volume({.equation = "section 3, W1 … W6",
                   .printed = "six faces, one leg at q_min or q_max, bound the workspace",
                   .limit = 1e-12,
                   .unit = "m³",
                   .note = "volume inside the faces against ∫ dq/det J over the stroke, which "
                           "shares no boundary with it; det J > 0 throughout"});
  volume.Add(VolumeByInterior(c.geometry, 10), IntegrateFaces(c.geometry, 12).solid.volume);
  rows->push_back(volume.Finish());
}

}  // namespace

std::vector<AuditRow> PathRows(const Case& c) {
  std::vector<AuditRow> rows;
  WorkspaceRow(c, &rows);
  LawRows(&rows);
  ExampleRows(c, &rows);
  return rows;
}

}  // namespace mbv::spr_tripod_audit
