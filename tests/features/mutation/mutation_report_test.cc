// What a mutation run found, in words, for a document and for programs; shared work put together.
#include "features/mutation/mutation_report.h"

#include <functional>

#include "tests/support/golden_file.h"

namespace mbv {
namespace {

Mutation Number(const std::string& name, double value, const std::string& unit) {
  Mutation m;
  m.name = name;
  m.unit = unit;
  m.value = m.relative_to = value;
  m.own.ran = true;
  return m;
}

FaultResult Fault(const std::string& kind, const std::string& where) {
  FaultResult fault;
  fault.kind = kind;
  fault.where = where;
  fault.applicable = true;
  return fault;
}

// Seen by forces; seen by a pose, one way only; refused; unseen with a reason; idle instances; a
// zero; a fault seen, one unseen, one that cannot be, one that could not run.
MutationReport Bench(bool inverse) {
  MutationReport report;
  report.exit_code = 1;
  report.scenario = "arm/lift";
  report.mode = "forward";
  report.size = 0.01;
  report.resolution = 0.1;
  report.runs = 37;
  report.wall_s = 12.5;
  Mutation mass = Number("m_p", 12.5, "kg");
  mass.own.detected = mass.own.by_force = true;
  mass.own.force_change = 0.015;
  mass.own.smallest = 2.5e-7;
  mass.own.best_check = "force_nrmse";
  Mutation length = Number("l", 0.75, "m");
  length.own.detected = true;
  length.own.force_change = 0.25;
  length.own.smallest = 3.5e-6;
  length.own.best_check = "pose_m";
  length.own.only = "smaller";
  Mutation refused = Number("parts.leg.bodies.rod.mass", 0.125, "kg");
  refused.kind = NumberKind::kLiteral;
  refused.own.ran = false;
  refused.own.detected = true;
  refused.own.best_check = "model";
  refused.own.reason = "mass | must be positive";
  Mutation zero = Number("offset", 0.0, "m");
  zero.relative_to = 0.5;
  zero.own.best_check = "closure_m";
  zero.proved_to = 0.02;
  zero.sensitivity = 1e-12;
  zero.reason = "no force knows it";
  Mutation idle = Number("limb2.azimuth", 2.0, "rad");
  idle.kind = NumberKind::kInstance;
  idle.proved_to = 0.03;
  if (inverse) {
    mass.inverse = mass.own;
    mass.inverse->smallest = 4.5e-11;
    zero.inverse = zero.own;
  }
  report.mutations = {mass, length, refused, zero, idle};
  FaultResult swapped = Fault("swapped drives", "d1, d2");
  swapped.alike = 3;
  swapped.own.ran = swapped.own.detected = true;
  swapped.own.check = "force_nrmse";
  swapped.own.value = 1.75;
  swapped.own.limit = 1e-7;
  if (inverse) swapped.inverse = swapped.own;
  FaultResult unseen = Fault("turned axis", "hinge");
  unseen.own.ran = true;
  unseen.own.reason = "it turns about itself";
  FaultResult impossible = Fault("elbow", "-");
  impossible.applicable = false;
  impossible.reason = "there is none";
  FaultResult broken = Fault("no gravity", "world");
  broken.own.reason = "it falls apart";
  report.faults = {swapped, unseen, impossible, broken};
  return report;
}

TEST(MutationReport, TablesAreAsWritten) {
  ExpectGolden("mutation.txt", ToText(Bench(false), false));
  ExpectGolden("mutation_inverse.txt", ToText(Bench(true), false));
  ExpectGolden("mutation.md", ToText(Bench(true), true));
}

TEST(MutationReport, JsonIsAsWrittenAndComesBack) {
  const std::string json = ToJson(Bench(true));
  ExpectGolden("mutation.json", json);
  const auto back = MutationReportOf(json);
  ASSERT_TRUE(back);
  EXPECT_EQ(ToJson(*back), json);
  EXPECT_EQ(ToText(*back, false), ToText(Bench(true), false));
}

TEST(MutationReport, OtherTextsAreNone) {
  EXPECT_FALSE(MutationReportOf(""));
  EXPECT_FALSE(MutationReportOf("{}"));
  std::string json = ToJson(Bench(false));
  json.replace(json.find("mutate/2"), 8, "mutate/1");
  EXPECT_FALSE(MutationReportOf(json));
}

TEST(MutationReport, PartsComeTogetherInTheirOrder) {
  const MutationReport whole = Bench(true);
  std::vector<MutationReport> parts(2, whole);
  for (size_t p = 0; p < 2; ++p) {
    parts[p].mutations.clear();
    parts[p].faults.clear();
    parts[p].runs = 10 + static_cast<long>(p);
    parts[p].wall_s = p == 0 ? 3.5 : 2.5;
    parts[p].exit_code = p == 0 ? 0 : 1;
    for (size_t k = p; k < whole.mutations.size(); k += 2) {
      parts[p].mutations.push_back(whole.mutations[k]);
    }
    for (size_t k = p; k < whole.faults.size(); k += 2) parts[p].faults.push_back(whole.faults[k]);
  }
  const MutationReport all = MergeParts(parts);
  EXPECT_EQ(all.runs, 21);
  EXPECT_EQ(all.wall_s, 3.5);
  EXPECT_EQ(all.exit_code, 1);
  ASSERT_EQ(all.faults.size(), 4U);
  for (size_t k = 0; k < 4; ++k) EXPECT_EQ(all.faults[k].kind, whole.faults[k].kind) << k;
  // The most sensitive first: those with a smallest error by it, then by the change of forces.
  std::vector<std::string> names;
  for (const Mutation& m : all.mutations) names.push_back(m.name);
  EXPECT_EQ(names, (std::vector<std::string>{"m_p", "l", "parts.leg.bodies.rod.mass", "offset",
                                             "limb2.azimuth"}));
}

// Where no smallest error was searched for, the one that changes the forces more comes first.
TEST(MutationReport, WithoutASearchTheLargerChangeComesFirst) {
  MutationReport report;
  for (const double change : {0.25, 4.0, 0.5}) {
    Mutation m = Number(std::to_string(change), 1.0, "");
    m.own.detected = true;
    m.own.force_change = change;
    report.mutations.push_back(m);
  }
  report.mutations.push_back(Number("unseen", 1.0, ""));
  std::swap(report.mutations[0], report.mutations[3]);
  SortBySensitivity(&report);
  EXPECT_EQ(report.mutations[0].own.force_change, 4.0);
  EXPECT_EQ(report.mutations[1].own.force_change, 0.5);
  EXPECT_EQ(report.mutations[2].own.force_change, 0.25);
  EXPECT_EQ(report.mutations[3].name, "unseen");
}

}  // namespace
}  // namespace mbv
