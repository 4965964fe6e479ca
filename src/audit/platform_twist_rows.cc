// Equations (8)–(16): twists of the platforms, limb lengths and their rates.
#include "analytic/stabilizing_platform/equivalent_limb.h"
#include "audit/platform_audit.h"
#include "audit/row_meter.h"

namespace mbv::platform_audit {
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

}  // namespace mbv::platform_audit
