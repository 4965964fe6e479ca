// What a study says in numbers: against single runs, by hand, and against measured tables.
#include <gtest/gtest.h>

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <regex>

#include "tests/features/study/study_fixture.h"

namespace mbv {
namespace {

// Of the reference's column, summed as the study does.
double MeanForce(const std::string& traces) {
  std::istringstream lines(traces);
  std::string line;
  std::getline(lines, line);
  std::vector<std::string> names;
  std::istringstream heads(line);
  for (std::string name; std::getline(heads, name, ',');) names.push_back(name);
  const auto column = std::find(names.begin(), names.end(), "x.force.reference");
  EXPECT_NE(column, names.end()) << line;
  std::vector<double> values;
  while (std::getline(lines, line)) {
    std::istringstream cells(line);
    std::string cell;
    for (auto at = names.begin(); at <= column; ++at) std::getline(cells, cell, ',');
    values.push_back(std::stod(cell));
  }
  double sum = 0.0;
  for (const double value : values) sum += value;
  return sum / static_cast<double>(values.size());
}

TEST_F(StudyCommand, ValuesAreThoseOfTheScenarioWithTheNumbersSet) {
  WriteStudy("{one_at_a_time: true}");
  const ProgramResult result = Study("out", "--json " + File("study.json"));
  ASSERT_EQ(result.exit_code, 0) << result.err;
  const auto json = Summary("out");
  auto handed_out = nlohmann::json::parse(ReadAll(File("study.json")));
  EXPECT_EQ(handed_out.erase("program"), 1u);
  EXPECT_EQ(json, handed_out);
  const auto& force = json["quantities"][0];
  const double nominal = force["nominal"];
  EXPECT_EQ(json["points"], 5);
  EXPECT_EQ(force["one_at_a_time"][0]["varied"], "m");  // the wider swing comes first
  EXPECT_NEAR(force["one_at_a_time"][0]["most"].get<double>(), 1.5 * nominal, 1e-12 * nominal);
  EXPECT_NEAR(force["one_at_a_time"][1]["least"].get<double>(), nominal - 2.0, 1e-12 * nominal);
  // The command that is reported gives that value, to the last bit.
  const std::string command = force["worst"][0]["command"];
  ASSERT_TRUE(command.starts_with("mbverify run ")) << command;
  const ProgramResult run = mbverify(command.substr(9) + " --out " + File("run"));
  EXPECT_EQ(run.exit_code, 0) << run.err;
  const double value = force["worst"][0]["value"];
  EXPECT_NEAR(MeanForce(ReadAll(File("run/lift/hold/traces.csv"))), value, 1e-15 * value);
}

TEST_F(StudyCommand, ALimitThatTooManyPointsViolateEndsWithOne) {
  const std::string limit = "limits: {x.force.mean: {below: 25, share: ";
  WriteStudy("{latin_hypercube: 40}", limit + "0.5}}\n");
  ASSERT_EQ(Study("wide").exit_code, 0);
  const auto kept = Summary("wide")["limits"][0];
  const int violations = kept["violations"];
  EXPECT_GT(violations, 0);
  EXPECT_LT(kept["interval"][0].get<double>(), violations / 40.0);
  EXPECT_GT(kept["interval"][1].get<double>(), violations / 40.0);
  // Exactly as many as there are may violate it; one fewer is too few.
  WriteStudy("{latin_hypercube: 40}", limit + std::to_string(violations / 40.0) + "}}\n");
  EXPECT_EQ(Study("just").exit_code, 0);
  WriteStudy("{latin_hypercube: 40}", limit + std::to_string((violations - 0.5) / 40.0) + "}}\n");
  const ProgramResult violated = Study("less");
  EXPECT_EQ(violated.exit_code, 1);
  EXPECT_NE(violated.out.find("x.force.mean < 25  VIOLATED"), std::string::npos) << violated.out;
  EXPECT_NE(violated.out.find("mbverify run "), std::string::npos) << violated.out;
}

TEST_F(StudyCommand, IndicesOfAProductAreThoseByHand) {
  WriteStudy("{saltelli: 1024}");
  ASSERT_EQ(Study("out").exit_code, 0);
  const auto force = Summary("out")["quantities"][0];
  const double G = force["nominal"].get<double>() / 2.0, v = 1.0 / 3.0;
  const double variance = v * G * G + v * 4.0 + v * v;
  const auto indices = force["sobol"]["indices"];
  EXPECT_NEAR(force["sobol"]["variance"].get<double>(), variance, 0.05 * variance);
  EXPECT_NEAR(indices[0]["first"].get<double>(), v * G * G / variance, 0.02);
  EXPECT_NEAR(indices[1]["first"].get<double>(), v * 4.0 / variance, 0.02);
  EXPECT_NEAR(indices[1]["total"].get<double>(), (v * 4.0 + v * v) / variance, 0.02);
  EXPECT_LT(indices[0]["first_interval"][0], indices[0]["first"]);
}

TEST_F(StudyCommand, BandsArePercentilesOfEachDriveAtEachTime) {
  Write("model.yaml",
        "name: lifts\nparameters: {m: {value: 2, unit: kg}}\ngravity: [0, 0, -10]\n"
        "bodies: {a: {mass: m, inertia: [1, 1, 1]}, b: {mass: 3*m, inertia: [1, 1, 1]}}\n"
        "joints:\n  p: {kind: prismatic, parent: world, child: a, axis: z}\n"
        "  q: {kind: prismatic, parent: world, child: b, axis: z}\n"
        "drives: {x: {kind: joint, joint: p}, y: {kind: joint, joint: q}}\n");
  Write("hold.yaml",
        "mechanism: model.yaml\nmotion: {duration_s: 0.1, sample_s: 0.01, commands: {x: {sine: "
        "{amplitude: 0.1, period_s: 1}}, y: 0}}\nanalytic: none\nsimulation: off\n");
  Write("s.yaml",
        "study: s\nscenario: hold.yaml\nvary: {m: {uniform: {min: 1, max: 3}}}\n"
        "design: {sobol: 64}\nquantities: [x.force.mean]\n");
  const ProgramResult result = Study("out");
  ASSERT_EQ(result.exit_code, 0) << result.err;
  const auto bands = Summary("out")["force_bands"];
  ASSERT_EQ(bands.size(), 2u);
  EXPECT_EQ(bands[1]["drive"], "y");
  EXPECT_NEAR(bands[1]["nominal"][0].get<double>(), 60.0, 1e-5);
  for (const auto& band : bands) {
    ASSERT_EQ(band["points"], 64);
    ASSERT_EQ(band["time_s"].size(), 11u);
    for (size_t t = 0; t < 11; ++t) {
      const double nominal = band["nominal"][t];  // 2 kg
      EXPECT_NEAR(band["p5"][t].get<double>(), nominal * 0.55, 0.02 * nominal) << t;
      EXPECT_NEAR(band["p50"][t].get<double>(), nominal, 0.02 * nominal) << t;
      EXPECT_NEAR(band["p95"][t].get<double>(), nominal * 1.45, 0.02 * nominal) << t;
    }
  }
}

TEST_F(StudyCommand, PointsThatFailStayRowsWithTheirReason) {
  Write("list.csv", "m,g\n2,10\n-1,10\n2,11\n");
  Write("s.yaml",
        "study: s\nscenario: hold.yaml\nvary: {m: , g: }\ndesign: {list: list.csv}\n"
        "quantities: [x.force.mean]\nlimits: {x.force.mean: {below: 100}}\n");
  const ProgramResult result = Study("out");
  EXPECT_EQ(result.exit_code, 1) << result.out;  // a point without a value keeps no limit
  EXPECT_NE(Points("out").find("\n1,1,2,"), std::string::npos) << Points("out");
  const auto json = Summary("out");
  EXPECT_EQ(json["failures"]["points"], 1);
  EXPECT_EQ(json["limits"][0]["violations"], 1);
  EXPECT_EQ(json["force_bands"][0]["points"], 2);  // no NaN among what percentiles are taken of
  EXPECT_EQ(json["force_bands"][0]["left_out"], 1);
  EXPECT_NE(json["failures"]["reasons"][0]["reason"].get<std::string>().find("mass"),
            std::string::npos);
  Write("list.csv", "m,g\n-2,10\n");
  EXPECT_EQ(Study("none").exit_code, 3);
}

TEST_F(StudyCommand, PlotsAreFilesToo) {
  WriteStudy("{sobol: 16}");
  ASSERT_EQ(Study("out").exit_code, 0);
  const std::string page = ReadAll(File("out/s/report.html"));
  for (const char* name : {"histogram_x.force.mean", "band_x", "scatter_matrix"}) {
    const std::string svg = ReadAll(File(std::string("out/s/plots/") + name + ".svg"));
    EXPECT_EQ(svg.substr(0, 4), "<svg") << name;
    EXPECT_NE(page.find(svg.substr(svg.find('\n'), 200)), std::string::npos) << name;
  }
  const std::string scatter = ReadAll(File("out/s/plots/scatter_matrix.svg"));
  std::uint64_t dots = 0;
  for (size_t at = scatter.find("h0"); at != std::string::npos; at = scatter.find("h0", at + 1)) {
    ++dots;
  }
  EXPECT_EQ(dots, 16u * 4u);  // two numbers, two quantities
}

TEST_F(StudyCommand, AMeasuredTableIsValidatedAgainstTheBand) {
  std::string table = "time,x.force\n";
  std::minstd_rand random(7);
  for (int i = 0; i <= 100; ++i) {
    const double t = 0.001 * i, w = 2.0 * 3.14159265358979;
    const double force = 2.0 * (10.0 - 0.1 * w * w * std::sin(w * t));
    table += fmt::format("{},{:.9f}\n", t, force + 0.02 * (random() % 2001 / 1000.0 - 1.0));
  }
  Write("measured.csv", table);
  Write("hold.yaml",
        "mechanism: model.yaml\nmotion: {duration_s: 0.1, sample_s: 0.001, commands: {x: {sine: "
        "{amplitude: 0.1, period_s: 1}}}}\nanalytic: none\nsimulation: {mode: inverse}\n"
        "reference: {csv: measured.csv}\n");
  const auto with = [&](const std::string& mass) {
    Write("s.yaml",
          "study: s\nscenario: hold.yaml\nvary: {m: {normal: {sigma: 0.002}}}\n"
          "design: {latin_hypercube: 200}\nwitnesses: [inverse]\nquantities: [x.force.mean]\n"
          "validation: {}\n");
    Write("model.yaml", std::regex_replace(ReadAll(File("model.yaml")),
                                           std::regex("m: .value: [0-9.]+"), "m: {value: " + mass));
    return Study("out" + mass);
  };
  const ProgramResult same = with("2.0");
  ASSERT_EQ(same.exit_code, 0) << same.out << same.err;
  const nlohmann::json drive = Summary("out2.0")["validation"]["drives"][0];
  const double noise = 0.02 / std::sqrt(3.0);
  EXPECT_NEAR(drive["error_rms"].get<double>(), noise, 0.15 * noise);
  EXPECT_NEAR(drive["u_data"].get<double>(), noise, 0.3 * noise);  // as estimated
  const double input = 0.001 * drive["measured_rms"].get<double>();
  EXPECT_NEAR(drive["u_input"].get<double>(), input, 0.02 * input);
  EXPECT_EQ(drive["u_num"], 0.0);
  EXPECT_EQ(drive["largest"], "u_input");
  const ProgramResult heavier = with("2.1");
  EXPECT_EQ(heavier.exit_code, 1) << heavier.out << heavier.err;
  EXPECT_NE(heavier.out.find("x [N]  BEYOND"), std::string::npos) << heavier.out;
  EXPECT_NE(ReadAll(File("out2.1/s/report.html")).find("Not validated"), std::string::npos);
}

TEST_F(StudyCommand, AForwardStudyTakesUNumFromConvergence) {
  const ProgramResult result = mbverify.Script(
      "here=$PWD; cd " + mbverify.folder().string() +
      " && cp $here/scenarios/four_bar/tables/noisy.csv . && sed 's/inverse/forward/; "
      "s#tables/##' $here/scenarios/four_bar/table_noisy.yaml > f.yaml && "
      "sed 's/table_noisy/f/; s/inverse/forward/; s/64/4/' "
      "$here/scenarios/four_bar/study_validation.yaml > s.yaml && $mbverify study s.yaml");
  ASSERT_EQ(result.exit_code, 0) << result.out << result.err;
  const nlohmann::json validation =
      nlohmann::json::parse(ReadAll(File("out/four_bar_validation/summary.json")))["validation"];
  EXPECT_NE(validation["u_num_from"].get<std::string>().find("grid convergence index"),
            std::string::npos);
  EXPECT_GT(validation["drives"][0]["u_num"].get<double>(), 0.0);
  EXPECT_LT(validation["drives"][0]["u_num"].get<double>(), 1e-6);
}

TEST_F(StudyCommand, PointsAreJudgedByTheScenariosChecks) {
  const auto with = [&](const std::string& scale) {
    Write("hold.yaml",
          "mechanism: model.yaml\nmotion: {duration_s: 0.1, sample_s: 0.01, commands: {x: {sine: "
          "{amplitude: 0.1, period_s: 1}}}}\nanalytic: none\nsimulation: {mode: inverse, "
          "parameters: {g: " +
              scale + "}}\n");
    Write("s.yaml",
          "study: s\nscenario: hold.yaml\nvary: {m: {uniform: {min: 1, max: 3}}}\n"
          "design: {sobol: 4}\nwitnesses: [reference, inverse]\nquantities: [force_nrmse]\n");
    return Study("out" + scale);
  };
  EXPECT_EQ(with("10").exit_code, 0);
  const ProgramResult perturbed = with("10.00001");
  EXPECT_EQ(perturbed.exit_code, 1) << perturbed.out << perturbed.err;
  EXPECT_NE(perturbed.out.find("VIOLATED  witnesses disagree at 4 of 4 points"), std::string::npos)
      << perturbed.out;
  const nlohmann::json summary = Summary("out10.00001");
  EXPECT_EQ(summary["verdict"], "disagree");
  EXPECT_EQ(summary["disagreements"]["points"], 4);
  EXPECT_NEAR(summary["quantities"][0]["most"].get<double>(), 1e-6, 2e-7);
  EXPECT_NE(Points("out10.00001").find("\n0,1,1,,"), std::string::npos);
}

}  // namespace
}  // namespace mbv
