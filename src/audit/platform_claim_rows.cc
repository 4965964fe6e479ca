// What the paper states about data, validation, design and figures: errata E9–E12.
#include <algorithm>
#include <cmath>

#include "audit/platform_audit.h"
#include "audit/row_meter.h"

namespace mbv::platform_audit {
namespace {

// E9: a link cannot have more inertia than its whole mass at its far end.
void InertiaRows(const Case& c, std::vector<AuditRow>* rows) {
  RowMeter link({.equation = "section 4 data, I_1, I_1'",
                 .erratum = "E9",
                 .printed = "I_1 = diag(4.3e4, 1.9e3, 4.28e4), I_1' = diag(4.53e4, 2.6e3, 4.57e4)",
                 .corrected = "a tenth of it (a slipped exponent); the print stays the default",
                 .limit = 0,
                 .unit = "kg m²",
                 .note = "excess over m L1², the whole mass at the far end"});
  for (int k : {sp::kLink1, sp::kLink1p}) {
    const sp::LinkInertia& inertia = c.parameters.links[k];
    const double most = inertia.mass * c.parameters.L1 * c.parameters.L1;
    for (int axis : {0, 2}) {
      const double I = inertia.moments[axis];
      link.Add(most, most + std::max(0.0, I - most), most + std::max(0.0, I / 10 - most));
    }
  }
  rows->push_back(link.Finish());
  rows->push_back({.equation = "section 4 data, I_p",
                   .erratum = "E9",
                   .printed = "I_p = diag(4.76e5, 8.36e5, 4.3e5)",
                   .corrected = "y and z probably exchanged; the print stays the default",
                   .unit = "",
                   .verdict = AuditVerdict::kNotTestable,
                   .note = "a flat plate's largest moment is about its normal z: 4.76e5 + 4.3e5 is "
                           "near 8.36e5"});
}

// E10, E11: what 12 s of the reference say about the claimed agreement and the cylinders.
void TrajectoryRows(const Case& full, const Case& massless, std::vector<AuditRow>* rows) {
  RowMeter claim({.equation = "section 4, Figs. 11 and 13",
                  .erratum = "E10",
                  .printed = "massless program and simulation with link masses agree to 0.1 kN",
                  .corrected = "equal masses in both agree",
                  .limit = 100,
                  .unit = "N",
                  .note = "reference with link masses against massless equations, and against "
                          "equations with link masses"});
  double shortest = INFINITY, longest = 0;
  for (size_t n = 0; n < full.truth.size(); ++n) {
    for (int i = 0; i < 3; ++i) {
      for (int j = 0; j < 2; ++j) {
        const LimbTruth& limb = full.truth[n].limbs[i];
        claim.Add(limb.drive[j], massless.closed[n].forces[i].drive[j],
                  full.closed[n].forces[i].drive[j]);
        shortest = std::min(shortest, limb.side[j].R.value);
        longest = std::max(longest, limb.side[j].R.value);
      }
    }
  }
  rows->push_back(claim.Finish());
  RowMeter stroke({.equation = "design, drives",
                   .erratum = "E11",
                   .printed = "one-stage cylinder between the drive's balls",
                   .corrected = "two-stage cylinder",
                   .limit = 0,
                   .unit = "m",
                   .note =
                       "stroke beyond what the shortest length can house (one or two times it); "
                       "drive lengths of the reference"});
  const double needed = longest - shortest;
  auto excess = [&](int stages) { return std::max(0.0, needed - stages * shortest); };
  stroke.Add(needed, needed + excess(1), needed + excess(2));
  rows->push_back(stroke.Finish());
}

// E12: which links touch the cross at the tip.
void FigureRow(const Case& c, std::vector<AuditRow>* rows) {
  RowMeter members({.equation = "text to Fig. 7",
                    .erratum = "E12",
                    .printed = "links 1 and 1' load the cross",
                    .corrected = "links 2 and 2' load the cross",
                    .limit = kPositionLimit,
                    .unit = "m",
                    .note = "distance of the link's end from the cross at B in the reference"});
  for (const Truth& t : c.truth) {
    for (const LimbTruth& limb : t.limbs) {
      const Vec3 B = limb.R_oA.transpose() * (limb.p_oB - limb.p_oA);
      for (const SideTruth& side : limb.side) {
        const double s = &side == &limb.side[0] ? 1.0 : -1.0;
        const Vec3 end_2 =
            side.elbow_A + c.parameters.L3 * Vec3(0, s * std::cos(side.q2), std::sin(side.q2));
        members.Add(limb.l, limb.l + (side.elbow_A - B).norm(), limb.l + (end_2 - B).norm());
      }
    }
  }
  rows->push_back(members.Finish());
}

}  // namespace

std::vector<AuditRow> ClaimRows(const Case& full, const Case& massless) {
  std::vector<AuditRow> rows;
  InertiaRows(full, &rows);
  TrajectoryRows(full, massless, &rows);
  FigureRow(full, &rows);
  return rows;
}

}  // namespace mbv::platform_audit
