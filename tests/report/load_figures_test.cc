// What drives and joints bear, by numbers that can be computed by hand.
#include "report/load_figures.h"

#include <gtest/gtest.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "report/html_report.h"

namespace mbv {
namespace {

// d1: 1, 3, -5 N at 2, 2, 4 m/s, on 0.1, 0.4, 0.2 m; joint j: forces of 3-4-5 triangles.
Report LoadedReport() {
  Report report;
  report.drives = {"d1", "d2"};
  WitnessRecord record{"simulated", RunSummary::Done(), {}};
  record.trace.Reset(
      {0.0, 1.0, 3.0},
      {MakeChannel(Quantity::kPosition, "m", "d1"), MakeChannel(Quantity::kVelocity, "m/s", "d1"),
       MakeChannel(Quantity::kForce, "N", "d1"), MakeChannel(Quantity::kReaction, "N", "j", "j", 0),
       MakeChannel(Quantity::kReaction, "N", "j", "j", 1),
       MakeChannel(Quantity::kReaction, "N", "j", "j", 2),
       MakeChannel(Quantity::kReaction, "N m", "j", "j", 3)});
  record.trace.values << 0.1, 2, 1, 3, 4, 0, 7,  //
      0.4, 2, 3, 0, -6, 8, 7,                    //
      0.2, 4, -5, 0, 0, 0, 7;
  report.witnesses = {record};
  return report;
}

// d1 rests at 3 s, within 2 N: −7 N may be asked for.
TEST(LoadFigures, AtRestTheEndFartherFromZeroCounts) {
  Report report = LoadedReport();
  Trace& trace = report.witnesses[0].trace;
  trace.channels.push_back(MakeChannel(Quantity::kForceBand, "N", "d1"));
  trace.values.conservativeResize(Eigen::NoChange, trace.values.cols() + 1);
  trace.values.rightCols(1) << 0.0, 0.0, 2.0;
  EXPECT_EQ(LoadFiguresOf(report).drives.at(0).force.peak, -7.0);
}

TEST(LoadFigures, OfADriveAreThoseComputedByHand) {
  const LoadFigures loads = LoadFiguresOf(LoadedReport());
  ASSERT_EQ(loads.drives.size(), 1U) << "nothing is known of d2";
  const DriveLoad& d1 = loads.drives[0];
  EXPECT_EQ(d1.drive, "d1");
  EXPECT_EQ(d1.witness, "simulated");
  // Over 1 s and 2 s: (2 - 2) / 3, and (5 + 34) / 3 of the squares.
  EXPECT_EQ(d1.force.unit, "N");
  EXPECT_EQ(d1.force.peak, -5.0);
  EXPECT_EQ(d1.force.time_s, 3.0);
  EXPECT_DOUBLE_EQ(d1.force.mean, 0.0);
  EXPECT_DOUBLE_EQ(d1.force.rms, std::sqrt(13.0));
  // 2, 6, -20 W: (4 - 14) / 3, and (20 + 436) / 3.
  EXPECT_EQ(d1.power.unit, "W");
  EXPECT_EQ(d1.power.peak, -20.0);
  EXPECT_EQ(d1.power.time_s, 3.0);
  EXPECT_DOUBLE_EQ(d1.power.mean, -10.0 / 3.0);
  EXPECT_DOUBLE_EQ(d1.power.rms, std::sqrt(152.0));
  EXPECT_DOUBLE_EQ(d1.stroke, 0.4 - 0.1);
  EXPECT_EQ(d1.stroke_unit, "m");
  EXPECT_EQ(d1.speed.unit, "m/s");
  EXPECT_EQ(d1.speed.peak, 4.0);
  EXPECT_DOUBLE_EQ(d1.speed.mean, 8.0 / 3.0);
}

TEST(LoadFigures, OfAJointAreMagnitudesOfWholeVectors) {
  const LoadFigures loads = LoadFiguresOf(LoadedReport());
  ASSERT_EQ(loads.joints.size(), 1U);
  const JointLoad& j = loads.joints[0];
  EXPECT_EQ(j.joint, "j");
  EXPECT_EQ(j.force.peak, 10.0);  // 5, 10, 0 N
  EXPECT_EQ(j.force.time_s, 1.0);
  EXPECT_DOUBLE_EQ(j.force.mean, (7.5 + 10.0) / 3.0);
  EXPECT_DOUBLE_EQ(j.force.rms, std::sqrt((62.5 + 100.0) / 3.0));
  EXPECT_TRUE(std::isnan(j.moment.peak)) << "one component is not a magnitude";
  EXPECT_FALSE(j.not_unique);
}

TEST(LoadFigures, APerturbedSampleChangesThem) {
  const LoadFigures straight = LoadFiguresOf(LoadedReport());
  for (const char* channel : {"d1.force", "d1.velocity", "d1.position", "j.reaction.fz"}) {
    Report perturbed = LoadedReport();
    Trace& trace = perturbed.witnesses[0].trace;
    trace.values(1, trace.Find(channel)) *= 1.01;
    const LoadFigures loads = LoadFiguresOf(perturbed);
    const DriveLoad &a = straight.drives[0], &b = loads.drives[0];
    const bool same = a.force.rms == b.force.rms && a.power.mean == b.power.mean &&
                      a.stroke == b.stroke &&
                      straight.joints[0].force.peak == loads.joints[0].force.peak;
    EXPECT_FALSE(same) << channel;
  }
}

TEST(LoadFigures, SamplesThatAreNoNumbersAreLeftOut) {
  VecX values(4);
  values << 2.0, kNan, 4.0, 6.0;
  const Figures figures = FiguresOf({0.0, 1.0, 2.0, 3.0}, values, "N");
  EXPECT_EQ(figures.peak, 6.0);
  EXPECT_DOUBLE_EQ(figures.mean, 5.0) << "of the one interval between numbers";
  VecX single(1);
  single << -3.0;
  EXPECT_EQ(FiguresOf({0.0}, single, "N").mean, -3.0);
  EXPECT_EQ(FiguresOf({0.0}, single, "N").rms, 3.0);
  EXPECT_TRUE(std::isnan(FiguresOf({}, VecX(), "").rms));
}

TEST(LoadFigures, AreInSummaryAndPageByNameAndUnit) {
  Report report = LoadedReport();
  report.reactions_not_unique = {"j.reaction.fy"};
  WitnessRecord other = report.witnesses[0];
  other.name = "reference";
  report.witnesses.push_back(other);
  const auto loads = nlohmann::json::parse(ToJson(report)).at("loads");
  ASSERT_EQ(loads.at("drives").size(), 2U) << "one for each witness";
  const auto& drive = loads.at("drives")[0];
  EXPECT_EQ(drive.at("drive"), "d1");
  EXPECT_EQ(drive.at("power").at("unit"), "W");
  EXPECT_EQ(drive.at("power").at("peak"), -20.0);
  EXPECT_EQ(drive.at("power").at("peak_time_s"), 3.0);
  EXPECT_DOUBLE_EQ(drive.at("stroke").at("value"), 0.4 - 0.1);
  EXPECT_EQ(drive.at("speed").at("peak"), 4.0);
  const auto& joint = loads.at("joints")[0];
  EXPECT_EQ(joint.at("joint"), "j");
  EXPECT_EQ(joint.at("force").at("peak"), 10.0);
  EXPECT_EQ(joint.at("unique"), false);
  EXPECT_FALSE(joint.contains("moment"));
  const std::string html = LoadsHtml(report);
  for (const char* part : {"Drives, simulated", "-20 W", "-5 N", "0.3 m", "4 m/s", "10 N",
                           "not unique", "Drives, reference", "power, peak"}) {
    EXPECT_NE(html.find(part), std::string::npos) << part;
  }
}

TEST(LoadFigures, AWitnessThatFailedHasNone) {
  Report report = LoadedReport();
  report.witnesses[0].summary = {};
  EXPECT_TRUE(LoadFiguresOf(report).drives.empty());
  EXPECT_EQ(LoadsHtml(report), "");
}

}  // namespace
}  // namespace mbv
