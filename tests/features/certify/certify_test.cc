// Proved digits: against exact fractions, finer intervals and slips; where nothing is proved.
#include "features/certify/certify.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <cmath>
#include <filesystem>
#include <functional>

#include "features/certify/exact_numbers.h"
#include "features/run/run_scenario.h"
#include "model_file/load_model.h"
#include "reference/reference.h"
#include "tests/support/source_dir.h"
#include "verify/prepare.h"

namespace mbv {
namespace {

using testing::HasSubstr;

Mechanism FromText(const std::string& text) {
  LoadResult loaded = LoadModelText(text, "proof.yaml");
  EXPECT_TRUE(loaded.mechanism.has_value()) << loaded.diagnostics.Text();
  return loaded.mechanism.value_or(Mechanism());
}

// A mass of 1 kg on a vertical guide, carried by a leg from a point 3 m beside it: 3, 4, 5.
const char kLeaning[] = R"(name: leaning
gravity: [0, 0, -10]
world: {frames: {foot: [-3, 0, 0]}}
bodies:
  block: {mass: 1, inertia: [1, 1, 1]}
joints:
  guide: {kind: prismatic, parent: world, child: block, axis: z, guess: 4}
drives:
  leg: {kind: distance, from: world.foot, to: block}
)";

Motion LegMotion(Profile profile, double duration_s = 0.5) {
  return {.duration_s = duration_s,
          .sample_s = duration_s,
          .commands = {{"leg", {{{Coordinate::Kind::kDrive, 0, 0}, 1.0}}, std::move(profile)}},
          .loads = {}};
}

const ProvedValue& ValueOf(const SampleProof& sample, const std::string& channel) {
  for (const ProvedValue& value : sample.values) {
    if (value.channel == channel) return value;
  }
  ADD_FAILURE() << "no " << channel;
  static const ProvedValue none;
  return none;
}

TEST(Certify, EnclosesExactFractions) {
  // L = 5 + t: z = 4, ż = L L̇/z = 5/4, z̈ = (1 − 25/16)/4 = −9/64 at the start;
  // F = (10 + z̈) 5/4 = 3155/256, and the guide bears F 3/5 = 1893/256.
  const Mechanism mechanism = FromText(kLeaning);
  Motion motion = LegMotion({{ConstantTerm{5.0}, RampTerm{1.0}}});
  const Certificate certificate = Certify(mechanism, motion, {});
  ASSERT_EQ(certificate.samples.size(), 2u) << certificate.why_not;
  const SampleProof& start = certificate.samples.front();
  ASSERT_TRUE(start.proved()) << start.why_not;
  const auto holds = [&](const std::string& channel, double exact) {
    const ProvedValue& value = ValueOf(start, channel);
    EXPECT_LE(value.radius, 1e-28) << channel;
    EXPECT_NEAR(value.value, exact, value.radius) << channel << " " << value.text;
  };
  holds("leg.position", 5.0);
  holds("leg.velocity", 1.0);
  holds("leg.acceleration", 0.0);
  holds("leg.force", 3155.0 / 256.0);
  // Of the parent on the child: against the leg's push along x.
  holds("guide.reaction.fx", -1893.0 / 256.0);
  EXPECT_THAT(ValueOf(start, "leg.force").text, HasSubstr("1.2324218750000000000000000"));
}

std::vector<std::string> InverseScenarios() {
  std::vector<std::string> files;
  for (const auto& entry :
       std::filesystem::recursive_directory_iterator(SourcePath("/scenarios"))) {
    if (entry.path().extension() != ".yaml" ||
        entry.path().string().find("must_fail") != std::string::npos) {
      continue;
    }
    const ScenarioHead head = ReadScenarioHead(entry.path().string());
    if (head.is_scenario && !head.HasKey("study")) files.push_back(entry.path().string());
  }
  std::sort(files.begin(), files.end());
  return files;
}

// All samples of every shipped motion that is commanded, to twelve digits.
TEST(CertifyShipped, ProvesTwelveDigits) {
  size_t proved = 0;
  for (const std::string& file : InverseScenarios()) {
    Diagnostics found;
    const std::optional<Prepared> prepared = Prepare(file, {}, &found);
    if (!prepared) continue;
    const Motion& motion = prepared->scenario.motion;
    const ReferenceRun run = RunReference(prepared->mechanisms.reference, motion);
    const Certificate certificate =
        Certify(prepared->mechanisms.reference, motion, {{"reference", &run.trace}});
    EXPECT_EQ(certificate.why_not.empty(), !motion.free()) << file << ": " << certificate.why_not;
    if (motion.free()) continue;
    ASSERT_FALSE(certificate.samples.empty()) << file;
    EXPECT_EQ(certificate.proved(), certificate.samples.size()) << file;
    ASSERT_EQ(certificate.witnesses.size(), 1u) << file;
    const WitnessProof& reference = certificate.witnesses.front();
    EXPECT_GE(reference.digits(), 12.0) << file;
    EXPECT_LE(reference.reaction_error, 1e-11) << file;
    EXPECT_LE(reference.motion_error, 1e-9) << file;
    EXPECT_FALSE(reference.wrong) << file;
    ++proved;
  }
  EXPECT_GE(proved, 100u);
}

// What the shipped models have too little of, on a hexapod's balls, guides and bodies.
struct Slip {
  const char* what;
  std::function<void(Mechanism*)> change;
};
void AddEverything(Mechanism* m) {
  int balls = 0, guides = 0;
  for (size_t j = 0; j < m->joints.size(); ++j) {
    const JointKind kind = m->joints[j].kind;
    const auto joint = static_cast<int>(j);
    if (kind == JointKind::kSpherical) {
      const auto add = [&](const char* word, auto law) {
        ForceElement element{.name = fmt::format("{}.{}", m->joints[j].name, word),
                             .joint = joint,
                             .coordinate = 0,
                             .law = law};
        AddOfBall(element, kind, &m->elements);
      };
      if (balls == 0) add("oil", DampingLaw{.damping = 3.0});
      if (balls == 1) add("rotor", RotorLaw{.inertia = 0.02});
      if (balls == 2)
        add("dry", FrictionLaw{.coulomb = 0.7, .breakaway = 0.9, .stribeck_rate = 0.2});
      ++balls;
    }
    if (kind == JointKind::kPrismatic) {
      const auto add = [&](const char* word, auto law) {
        m->elements.push_back({.name = fmt::format("{}.{}", m->joints[j].name, word),
                               .joint = joint,
                               .coordinate = 0,
                               .law = law});
      };
      if (guides == 0) {
        add("rotor", RotorLaw{.inertia = 1e-4,
                              .ratio = 600.0,
                              .carrier = RotorAxis{m->joints[j].parent, Vec3(0.6, 0.0, 0.8)}});
      }
      if (guides == 1)
        add("spring", SpringLaw{.polynomial = {900.0, 50.0, 4e3}, .free = 0.4, .preload = 7.0});
      if (guides == 2)
        add("dry", FrictionLaw{
                       .coulomb = 4.0, .breakaway = 4.0, .stribeck_rate = 0.0, .coefficient = 0.1});
      if (guides == 3)
        add("dry",
            FrictionLaw{
                .coulomb = 2.0, .breakaway = 3.0, .stribeck_rate = 0.05, .coefficient = 0.2});
      ++guides;
    }
  }
  ASSERT_EQ(balls, 6);
  ASSERT_EQ(guides, 6);
  for (size_t b = 1; b < m->bodies.size(); ++b) {
    m->bodies[b].gravity_compensation = 0.1 * static_cast<double>(b);
  }
  m->drives[4].compensates_gravity = true;
}

TEST(Certify, KnowsEveryForceElement) {
  Diagnostics found;
  auto prepared = Prepare(SourcePath("/scenarios/stewart/pose.yaml"), {}, &found);
  ASSERT_TRUE(prepared.has_value()) << found.Text();
  Mechanism mechanism = prepared->mechanisms.reference;
  AddEverything(&mechanism);
  const Motion& motion = prepared->scenario.motion;
  const ReferenceRun run = RunReference(mechanism, motion);
  ASSERT_TRUE(run.summary.ok()) << run.summary.message;
  const auto off = [&](const Mechanism& m) {
    const Certificate certificate = Certify(m, motion, {{"reference", &run.trace}});
    EXPECT_EQ(certificate.proved(), certificate.samples.size());
    return certificate.witnesses.empty() ? WitnessProof() : certificate.witnesses.front();
  };
  EXPECT_GE(off(mechanism).digits(), 13.0);
  EXPECT_LE(off(mechanism).reaction_error, 1e-12);
  const double share = 1.0 + 1e-6;
  const auto law = [&](size_t e, auto change) {
    return [e, change](Mechanism* m) { std::visit(change, m->elements[e].law); };
  };
  std::vector<Slip> slips;
  for (size_t e = 0; e < mechanism.elements.size(); ++e) {
    slips.push_back({mechanism.elements[e].name.c_str(), law(e, [share](auto& of) {
                       using Law = std::decay_t<decltype(of)>;
                       if constexpr (std::is_same_v<Law, DampingLaw>) of.damping *= share;
                       if constexpr (std::is_same_v<Law, RotorLaw>) of.inertia *= share;
                       if constexpr (std::is_same_v<Law, SpringLaw>) of.polynomial[2] *= share;
                       if constexpr (std::is_same_v<Law, FrictionLaw>) of.coulomb *= share;
                     })});
    if (const auto* dry = std::get_if<FrictionLaw>(&mechanism.elements[e].law)) {
      if (dry->coefficient == 0.0) continue;
      slips.push_back({"load", law(e, [share](auto& of) {
                         if constexpr (std::is_same_v<std::decay_t<decltype(of)>, FrictionLaw>) {
                           of.coefficient *= share;
                         }
                       })});
    }
  }
  slips.push_back(
      {"compensation", [](Mechanism* m) { m->bodies[1].gravity_compensation *= 1.0 + 1e-6; }});
  slips.push_back({"whose it is", [](Mechanism* m) { m->drives[4].compensates_gravity = false; }});
  slips.push_back({"carrier", [](Mechanism* m) {
                     for (ForceElement& element : m->elements) {
                       auto* rotor = std::get_if<RotorLaw>(&element.law);
                       if (rotor != nullptr && rotor->carrier)
                         rotor->carrier->axis_B = Vec3::UnitZ();
                     }
                   }});
  for (const Slip& slip : slips) {
    Mechanism other = mechanism;
    slip.change(&other);
    EXPECT_GT(off(other).force_error_at_least, 1e-12) << slip.what;
  }
}

// 240 bits against 113: each value of the finer one lies in the coarser enclosure.
// Where friction rests, the middle of the band is proved. A program that states a number has any of
// the band; one beside it is wrong by what it is beside it.
TEST(Certify, ANumberInTheBandOfRestingFrictionIsRight) {
  Mechanism mechanism = FromText(kLeaning);
  mechanism.elements.push_back({.name = "dry",
                                .joint = 0,
                                .coordinate = 0,
                                .law = FrictionLaw{.coulomb = 2.0, .breakaway = 2.0}});
  const Motion motion = LegMotion({{ConstantTerm{5.0}}});
  const ReferenceRun run = RunReference(mechanism, motion);
  ASSERT_TRUE(run.summary.ok()) << run.summary.message;
  const int band = run.trace.Find("leg.force.band"), force = run.trace.Find("leg.force");
  ASSERT_GE(band, 0);
  const double half = run.trace.values(0, band);
  EXPECT_NEAR(half, 2.0 * 5.0 / 4.0, 1e-12);  // 2 N along the guide
  const auto off = [&](double share) {
    Trace other;
    other.time_s = run.trace.time_s;
    other.channels = {run.trace.channels[static_cast<size_t>(force)]};
    other.values = run.trace.values.col(force).array() + share * half;
    const Certificate certificate =
        Certify(mechanism, motion, {{"reference", &run.trace}, {"other", &other}});
    EXPECT_EQ(certificate.proved(), certificate.samples.size());
    EXPECT_EQ(certificate.witnesses.size(), 2u);
    return certificate.witnesses.back();
  };
  for (const double share : {-0.999, 0.0, 0.7}) {
    EXPECT_FALSE(off(share).wrong) << share;
    EXPECT_GE(off(share).digits(), 13.0) << share;
  }
  for (const double share : {-1.001, 1.001}) {
    EXPECT_TRUE(off(share).wrong) << share;
    EXPECT_GT(off(share).force_error_at_least, 1e-5) << share;
  }
}

TEST(CertifyShipped, CoarseIntervalsHoldFineValues) {
  size_t values = 0;
  for (const char* name :
       {"spr_tripod/random", "cabin_robot/random", "scara_robot/random",
        "stabilizing_platform/random", "stabilizing_platform/sea_state", "spr_tripod/default",
        "scara_robot/default", "stewart/legs", "machine_five_bar/draw"}) {
    Diagnostics found;
    const auto prepared = Prepare(SourcePath(fmt::format("/scenarios/{}.yaml", name)), {}, &found);
    ASSERT_TRUE(prepared.has_value()) << found.Text();
    CertifyOptions coarse{.samples = 25}, fine{.samples = 25, .least_bits = 240};
    const Mechanism& mechanism = prepared->mechanisms.reference;
    const Certificate a = Certify(mechanism, prepared->scenario.motion, {}, coarse);
    const Certificate b = Certify(mechanism, prepared->scenario.motion, {}, fine);
    ASSERT_EQ(a.samples.size(), b.samples.size());
    for (size_t i = 0; i < a.samples.size(); ++i) {
      ASSERT_TRUE(a.samples[i].proved() && b.samples[i].proved()) << name;
      EXPECT_EQ(a.samples[i].bits, 113);
      EXPECT_EQ(b.samples[i].bits, 240);
      ASSERT_EQ(a.samples[i].values.size(), b.samples[i].values.size());
      for (size_t k = 0; k < a.samples[i].values.size(); ++k) {
        const ProvedValue &x = a.samples[i].values[k], &y = b.samples[i].values[k];
        const exact::Finest far =
            abs(exact::Finest(x.text.c_str()) - exact::Finest(y.text.c_str()));
        EXPECT_LE(boost::multiprecision::lower(far), x.radius + y.radius) << x.channel;
        EXPECT_LE(y.radius, x.radius) << x.channel;
        ++values;
      }
    }
  }
  EXPECT_GT(values, 10000u);
}

// Instants of the IFToMM library's problems A01 to A05 (docs/results/proofs.md): what is published,
// or follows from the conservation of energy, within the digits that the commands have.
TEST(CertifyShipped, ProvesPublishedInstants) {
  const struct {
    const char *scenario, *channel;
    double published, digits;
  } kInstants[] = {{"pendulum/instant", "pin.reaction.fy", 3.0 * 9.81, 1e-13},
                   {"n_four_bar/instant", "motor.force", 0.0, 1e-13},
                   {"andrews_squeezer/instant", "motor.force", 0.033, 1e-15},
                   {"andrews_squeezer/end", "motor.force", 0.033, 1e-8},
                   {"bricard/turn", "motor.force", -9.81, 1e-13},
                   {"flyball_governor/instant", "slider.force", 0.0, 1e-9},
                   {"flyball_governor/instant", "rod1.force", 0.0, 1e-9},
                   {"flyball_governor/instant", "rod2.force", 0.0, 1e-9}};
  for (const auto& instant : kInstants) {
    Diagnostics found;
    const auto prepared =
        Prepare(SourcePath(fmt::format("/scenarios/{}.yaml", instant.scenario)), {}, &found);
    ASSERT_TRUE(prepared.has_value()) << found.Text();
    const auto off = [&](const Mechanism& mechanism) {
      const Certificate certificate =
          Certify(mechanism, prepared->scenario.motion, {}, {.samples = 1});
      const SampleProof& start = certificate.samples.front();
      EXPECT_TRUE(start.proved()) << start.why_not;
      const ProvedValue& value = ValueOf(start, instant.channel);
      return std::abs(value.value - instant.published) + value.radius;
    };
    Mechanism mechanism = prepared->mechanisms.reference;
    EXPECT_LE(off(mechanism), instant.digits) << instant.scenario << " " << instant.channel;
    mechanism.gravity_W *= 1.0 + 1e-5;
    for (Body& body : mechanism.bodies) body.p_BoBcm_B *= 1.0 + 1e-5;
    EXPECT_GT(off(mechanism), instant.digits) << instant.scenario << " " << instant.channel;
  }
}

struct Case {
  Mechanism mechanism;
  Motion motion;
  Trace trace;
};
Case FourBar() {
  Diagnostics found;
  auto prepared = Prepare(SourcePath("/scenarios/four_bar/turn_inverse.yaml"), {}, &found);
  EXPECT_TRUE(prepared.has_value()) << found.Text();
  Case made{prepared->mechanisms.reference, prepared->scenario.motion, {}};
  made.trace = RunReference(made.mechanism, made.motion).trace;
  return made;
}
WitnessProof ProofOf(const Case& of, const Mechanism& mechanism) {
  const Certificate certificate = Certify(mechanism, of.motion, {{"analytic", &of.trace}});
  EXPECT_EQ(certificate.proved(), certificate.samples.size());
  EXPECT_EQ(certificate.witnesses.size(), 1u);
  return certificate.witnesses.empty() ? WitnessProof() : certificate.witnesses.front();
}

TEST(Certify, RefutesTheThirteenthDigit) {
  Case c = FourBar();
  const int force = c.trace.Find(Quantity::kForce, c.mechanism.drives[0].name);
  ASSERT_GE(force, 0);
  EXPECT_LT(ProofOf(c, c.mechanism).force_error, 1e-13);
  c.trace.values.col(force) *= 1.0 + 1e-12;
  const WitnessProof off = ProofOf(c, c.mechanism);
  EXPECT_GT(off.force_error_at_least, 0.5e-12);
  EXPECT_LT(off.force_error, 1.5e-12);
  EXPECT_FALSE(off.wrong);
  c.trace.values.col(force) *= 1.0 + 1e-8;
  EXPECT_TRUE(ProofOf(c, c.mechanism).wrong);
}

TEST(Certify, SeesEveryMassAndLength) {
  const Case c = FourBar();
  Mechanism heavier = c.mechanism;
  heavier.bodies[1].mass *= 1.0 + 1e-9;
  EXPECT_GT(ProofOf(c, heavier).force_error_at_least, 1e-11);
  Mechanism longer = c.mechanism;
  longer.joints[1].X_PF.translation() *= 1.0 + 1e-9;
  EXPECT_GT(ProofOf(c, longer).force_error_at_least, 1e-11);
  Mechanism turned = c.mechanism;
  turned.bodies[2].I_Bcm_B *= 1.0 + 1e-6;
  EXPECT_GT(ProofOf(c, turned).force_error_at_least, 1e-11);
}

TEST(Certify, ProvesNothingAtSingularPosesOrBeyondReach) {
  // The block at the foot's height: the leg lies across the guide, and cannot move it.
  const Mechanism mechanism = FromText(kLeaning);
  for (const double leg : {3.0, 2.9}) {
    const Certificate certificate = Certify(mechanism, LegMotion(Constant(leg)), {});
    EXPECT_EQ(certificate.proved(), 0u) << leg;
    ASSERT_FALSE(certificate.samples.empty());
    EXPECT_THAT(certificate.samples.front().why_not, HasSubstr("not provable"));
  }
  // Hardly away from it is proved, with the distance: z = 1e-4 of 3 m.
  const double near = std::sqrt(9.0 + 1e-8);
  const Certificate certificate = Certify(mechanism, LegMotion(Constant(near)), {});
  ASSERT_EQ(certificate.proved(), certificate.samples.size()) << certificate.samples[0].why_not;
  EXPECT_NEAR(certificate.samples[0].closure_distance_low, 1e-4 / 3.0, 1e-5);
  EXPECT_LE(certificate.samples[0].closure_distance_low,
            certificate.samples[0].closure_distance_high);
}

// A hinge that is tilted in space freezes a planar loop. So little that the reference follows the
// command nevertheless, the equations out of the plane contradict it by as much.
TEST(Certify, SeesEquationsThatContradictTheCommand) {
  Case c = FourBar();
  c.mechanism.joints[1].X_PF.rotate(Eigen::AngleAxisd(1e-10, Vec3::UnitX()));
  const Certificate allowed = Certify(c.mechanism, c.motion, {});
  ASSERT_EQ(allowed.proved(), allowed.samples.size()) << allowed.samples.back().why_not;
  EXPECT_GT(allowed.samples.back().left_open, 1e-12);
  const Certificate refused = Certify(c.mechanism, c.motion, {}, {.contradiction = 1e-13});
  EXPECT_LT(refused.proved(), refused.samples.size());
  EXPECT_THAT(refused.samples[refused.samples.size() / 2].why_not, HasSubstr("contradict"));
  c.mechanism.joints[1].X_PF.rotate(Eigen::AngleAxisd(1e-7, Vec3::UnitX()));
  EXPECT_EQ(Certify(c.mechanism, c.motion, {}).proved(), 0u);
}

TEST(Certify, TakesAnAgreementAway) {
  RunOptions options;
  options.after_judgement = [](const Prepared& prepared, Report* report) {
    ASSERT_EQ(report->comparison.verdict, Verdict::kAgree);
    // Both computed witnesses, wrong alike.
    for (WitnessRecord& record : report->witnesses) {
      for (const Drive& drive : prepared.base.drives) {
        const int column = record.trace.Find(Quantity::kForce, drive.name);
        if (column >= 0) record.trace.values.col(column) *= 1.0 + 1e-7;
      }
    }
    AddCertificate(prepared, {}, report);
  };
  const RunOutcome outcome =
      RunScenario(SourcePath("/scenarios/spr_tripod/default_inverse.yaml"), options);
  EXPECT_EQ(outcome.exit_code, 1);
  ASSERT_TRUE(outcome.report.has_value());
  EXPECT_THAT(outcome.report->comparison.attribution.text,
              HasSubstr("proved: analytic is off by 9."));
  EXPECT_EQ(outcome.report->comparison.attribution.odd_one_out, "analytic");
}

Comparison Certified(const std::string& scenario) {
  RunOptions options;
  options.after_judgement = [](const Prepared& prepared, Report* report) {
    AddCertificate(prepared, {}, report);
  };
  const RunOutcome outcome = RunScenario(SourcePath("/scenarios/") + scenario + ".yaml", options);
  EXPECT_TRUE(outcome.report.has_value()) << scenario;
  return outcome.report ? outcome.report->comparison : Comparison();
}

TEST(Certify, NamesTheCulpritAlsoOfTwo) {
  const Comparison three = Certified("stabilizing_platform/must_fail/analytic_mass");
  EXPECT_EQ(three.verdict, Verdict::kDisagree);
  EXPECT_THAT(three.attribution.text, HasSubstr("proved: analytic is off by"));
  const Comparison two = Certified("four_bar/must_fail/wrong_mass");
  EXPECT_EQ(two.verdict, Verdict::kDisagree);
  EXPECT_THAT(two.attribution.text, HasSubstr("proved: reference is off by"));
}

// An exported table has the digits that were printed, and the limits that follow from them.
TEST(Certify, LeavesTablesTheirOwnLimits) {
  const Comparison table = Certified("four_bar/table_adams");
  EXPECT_EQ(table.verdict, Verdict::kAgree);
  EXPECT_THAT(table.reason, HasSubstr("; reference is right to"));
}

TEST(Certify, LeavesAgreementsAndShowsDigits) {
  RunOptions options;
  options.after_judgement = [](const Prepared& prepared, Report* report) {
    AddCertificate(prepared, {}, report);
  };
  const RunOutcome outcome =
      RunScenario(SourcePath("/scenarios/spr_tripod/default_inverse.yaml"), options);
  EXPECT_EQ(outcome.exit_code, 0);
  ASSERT_TRUE(outcome.report.has_value());
  EXPECT_THAT(ToTable(*outcome.report, {}), HasSubstr("Drive forces proved to 1"));
  EXPECT_THAT(outcome.report->comparison.reason, HasSubstr("; drive forces proved to 1"));
  EXPECT_THAT(ToJson(*outcome.report), HasSubstr("\"certificate\""));
}

}  // namespace
}  // namespace mbv
