// Study files: what they mean, and every refusal with its place and what to do about it.
#include "features/study/study_file.h"

#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>

#include "scenario/load_scenario.h"
#include "tests/support/source_dir.h"
#include "tests/support/test_folder.h"

namespace mbv {
namespace {

class StudyFiles : public testing::Test {
 protected:
  StudyFiles() { std::filesystem::current_path(kSourceDir); }

  // The study's lines after its name and scenario (line 3 on).
  [[nodiscard]] static StudyResult Load(const std::string& rest, const StudyOptions& options = {}) {
    return LoadStudyText("study: s\nscenario: four_bar/static\n" + rest, "scenarios/s.yaml",
                         options);
  }
  // All findings of a study of these lines, as text.
  [[nodiscard]] static std::string Refusal(const std::string& vary, const std::string& design,
                                           const std::string& more = "quantities: [closure_m]\n") {
    const StudyResult result = Load("vary: " + vary + "\ndesign: " + design + "\n" + more);
    EXPECT_FALSE(result.study);
    return result.diagnostics.Text();
  }
  static void ExpectIn(const std::string& text, const std::string& part) {
    EXPECT_NE(text.find(part), std::string::npos) << text;
  }
};

TEST_F(StudyFiles, ReadDistributionsInTheUnitsOfTheirNumbers) {
  const StudyResult result = Load(
      "vary:\n"
      "  crank: {uniform: {plus_minus_mm: 0.05}}\n"
      "  rho: {normal: {sigma_percent: 0.5}}\n"
      "  motion.duration_s: {grid: [0.1, 0.2]}\n"
      "  parameters.coupler_mm: {uniform: {min: 100, max: 200}}\n"
      "design: {latin_hypercube: 500, seed: 7}\n"
      "quantities: [motor.force.max, closure_m]\n"
      "limits: {motor.force.max: {below: 1, share: 0.01}}\n");
  ASSERT_TRUE(result.study) << result.diagnostics.Text();
  const Study& study = *result.study;
  ASSERT_EQ(study.factors.size(), 4u);
  EXPECT_EQ(study.factors[0].key, "parameters.crank");
  const auto& crank = std::get<Uniform>(study.factors[0].axis.distribution);
  EXPECT_NEAR(crank.upper - crank.lower, 1e-4, 1e-16);
  EXPECT_NEAR(crank.lower + 5e-5, study.factors[0].axis.nominal, 1e-16);
  const auto& rho = std::get<Normal>(study.factors[1].axis.distribution);
  EXPECT_NEAR(rho.sigma, 0.005 * rho.mean, 1e-15);
  EXPECT_EQ(study.factors[2].key, "motion.duration_s");
  EXPECT_EQ(study.factors[2].axis.nominal, 0.1);
  EXPECT_EQ(study.factors[3].key, "parameters.coupler_mm");
  EXPECT_EQ(std::get<Uniform>(study.factors[3].axis.distribution).upper, 200.0);
  EXPECT_GT(study.factors[3].axis.nominal, 1.0);  // mm
  EXPECT_EQ(study.design.kind, DesignKind::kLatinHypercube);
  EXPECT_EQ(study.design.count, 500u);
  EXPECT_EQ(study.design.seed, 7u);
  EXPECT_EQ(study.witnesses, std::vector<std::string>{"reference"});
  EXPECT_EQ(study.quantities[0].channel, "motor.force");
  EXPECT_EQ(study.quantities[0].statistic, Statistic::kMax);
  EXPECT_TRUE(study.quantities[1].is_check());
  EXPECT_EQ(study.limits[0].share, 0.01);
}

// The same text gives the same points, however often it is read.
TEST_F(StudyFiles, APointIsAFunctionOfFileAndNumber) {
  const std::string text =
      "vary: {crank: {uniform: {plus_minus_mm: 1}}, rho: {normal: {sigma_percent: 1}}}\n"
      "design: {sobol: 64}\nquantities: [closure_m]\n";
  const DesignPoints once = Load(text).study->Points(), again = Load(text).study->Points();
  for (std::uint64_t i = 64; i-- > 0;) EXPECT_EQ(again.At(i), once.At(i)) << i;
}

TEST_F(StudyFiles, UnknownNamesHaveSuggestions) {
  const std::string text =
      Refusal("{crnk: {normal: {sigma_percent: 1}}}", "{sobol: 8}",
              "quantities: [motor.force.maxx, closure]\nwitnesses: [refrence]\n"
              "limits: {closure_n: {below: 1}}\n");
  ExpectIn(text, "scenarios/s.yaml:3:8: error: vary.crnk: four_bar has no parameter 'crnk'");
  ExpectIn(text, "did you mean 'crank'?");
  ExpectIn(text, "'motor.force.maxx' is neither a check nor a statistic of a channel");
  ExpectIn(text, "did you mean 'max'?");
  ExpectIn(text, "did you mean 'reference'?");
  ExpectIn(text, "limits: 'closure_n' is not one of the quantities");
}

TEST_F(StudyFiles, CountsOfSobolArePowersOfTwo) {
  const std::string vary = "{crank: {normal: {sigma_percent: 1}}}";
  ExpectIn(Refusal(vary, "{sobol: 1000}"), "design.sobol = 1000 is not a power of two");
  ExpectIn(Refusal(vary, "{sobol: 1000}"), "512 or 1024");
  ExpectIn(Refusal(vary, "{saltelli: 3}"), "design.saltelli = 3 is not a power of two");
  ExpectIn(Refusal(vary, "{sobol: 0}"), "design.sobol = 0 is not a whole number from 1 on");
  ExpectIn(Refusal(vary, "{latin_hypercube: 1.5}"), "is not a whole number from 1 on");
}

TEST_F(StudyFiles, MorePointsThanAnyoneMeansNeedAWord) {
  const std::string text =
      "vary: {crank: {normal: {sigma_percent: 1}}}\ndesign: {latin_hypercube: 10000001}\n"
      "quantities: [closure_m]\n";
  const StudyResult result = Load(text);
  ASSERT_FALSE(result.study);
  ExpectIn(result.diagnostics.Text(), "design.latin_hypercube: 1e+07 points, more than 1e+07");
  ExpectIn(result.diagnostics.Text(), "mbverify study --yes");
  EXPECT_TRUE(Load(text, {.many = true}).study);
  EXPECT_TRUE(Load("vary: {crank: {normal: {sigma_percent: 1}}}\n"
                   "design: {latin_hypercube: 10000000}\nquantities: [closure_m]\n")
                  .study);
}

TEST_F(StudyFiles, DesignsThatComputeNothingAreRefused) {
  const std::string vary = "{crank: {normal: {sigma_percent: 1}}}";
  ExpectIn(Refusal(vary, "{}"), "design: give one of sobol");
  ExpectIn(Refusal(vary, "{sobol: 8, grid: true}"), "design: give one of sobol");
  ExpectIn(Refusal(vary, "{grid: true}"), "design.grid: crank has no levels");
  ExpectIn(Refusal(vary, "{one_at_a_time: false}"), "nothing is computed");
  ExpectIn(Refusal(vary, "{one_at_a_time: true, seed: 3}"), "it has no seed");
  ExpectIn(Refusal("{}", "{sobol: 8}"), "vary: nothing is varied");
  ExpectIn(Refusal("{crank: {grid: []}}", "{grid: true}"), "vary.crank.grid: has no values");
}

TEST_F(StudyFiles, WrongNumbersAreRefusedWithTheirRule) {
  const auto vary = [](const std::string& text) { return Refusal(text, "{sobol: 8}"); };
  ExpectIn(vary("{crank: {normal: {sigma: -1}}}"), "vary.crank.normal.sigma = -1 violates > 0");
  ExpectIn(vary("{crank: {uniform: {min: 2, max: 1}}}"), "violate min < max");
  ExpectIn(vary("{crank: {uniform: {min: 2}}}"), "is incomplete");
  ExpectIn(vary("{crank: {normal: {}}}"), "vary.crank.normal: is empty");
  ExpectIn(vary("{crank: {normal: {sigma_deg: 1}}}"), "crank is in m");
  ExpectIn(vary("{crank: {normal: {sigma: x1}}}"), "x1");
  ExpectIn(vary("{crank: {norml: {sigma: 1}}}"), "did you mean 'normal'?");
  ExpectIn(vary("{crank: {normal: {sigma_percent: 1}, grid: [1]}}"), "give one of normal");
  ExpectIn(vary("{crank: {normal: {sigma_percent: 1}}, parameters.crank: {grid: [1]}}"),
           "parameters.crank is varied twice");
  ExpectIn(vary("{motion.nothing: {normal: {sigma_percent: 1}}}"), "has no nominal value");
  ExpectIn(vary("{motion.commands: {normal: {sigma_percent: 1}}}"), "no number");
}

TEST_F(StudyFiles, LimitsThatNothingKeepsAreRefused) {
  const auto limits = [](const std::string& text) {
    return Refusal("{crank: {normal: {sigma_percent: 1}}}", "{sobol: 8}",
                   "quantities: [closure_m]\nlimits: {closure_m: " + text + "}\n");
  };
  ExpectIn(limits("{share: 0.1}"), "says neither below nor above");
  ExpectIn(limits("{below: 1, above: 2}"), "nothing lies between");
  ExpectIn(limits("{below: 1, share: 1}"), "violates 0 <= share < 1");
}

TEST_F(StudyFiles, NeedAScenarioWithAMotion) {
  const auto named = [](const std::string& scenario) {
    return LoadStudyText("study: s\nscenario: " + scenario +
                             "\nvary: {}\ndesign: {}\nquantities: [closure_m]\n",
                         "scenarios/s.yaml")
        .diagnostics.Text();
  };
  ExpectIn(named("nowhere.yaml"), "there is no such file");
  ExpectIn(named("../models/four_bar/model.yaml"), "is a model");
  ExpectIn(named("cabin_robot/stiffness.yaml"), "is a stiffness");
  ExpectIn(LoadStudyText("study: 'a b'\n", "s.yaml").diagnostics.Text(), "'a b' is not a name");
  ExpectIn(LoadStudyText("[1]", "s.yaml").diagnostics.Text(), "error");
}

TEST_F(StudyFiles, ListsAreReadByTheirHeadings) {
  const test::TestFolder folder("study_list");
  const std::string scenario = SourcePath("/scenarios/four_bar/static.yaml");
  const auto load = [&](const std::string& csv) {
    folder.Write("points.csv", csv);
    return LoadStudyText("study: s\nscenario: " + scenario +
                             "\nvary: {rho: , crank: }\ndesign: {list: points.csv}\n"
                             "quantities: [closure_m]\n",
                         folder.PathOf("s.yaml"));
  };
  const StudyResult good = load("crank,other,rho\n0.1,9,2\n0.11,9,3\n");
  ASSERT_TRUE(good.study) << good.diagnostics.Text();
  EXPECT_EQ(good.study->Points().At(1), (std::vector<double>{3, 0.11}));
  ExpectIn(load("crank,rh\n0.1,2\n").diagnostics.Text(), "has no column 'rho'");
  ExpectIn(load("crank,rho\n0.1,2\n0.1,\n").diagnostics.Text(), "points.csv:3:");
  EXPECT_FALSE(load("").study);
}

TEST_F(StudyFiles, HeadsKnowTheKind) {
  const test::TestFolder folder("study_head");
  const ScenarioHead head = ReadScenarioHead(folder.Write("s.yaml", "study: s\nscenario: x\n"));
  EXPECT_TRUE(head.HasKey("study"));
  EXPECT_FALSE(head.is_scenario);
  EXPECT_FALSE(ReadScenarioHead(SourcePath("/scenarios/four_bar/static.yaml")).HasKey("study"));
}

TEST_F(StudyFiles, PatternsStandForWhatTheModelWritesOut) {
  const StudyResult result = Load(
      "vary:\n  '*': {uniform: {plus_minus_percent: 5}}\n  r*: {uniform: {plus_minus_percent: 1}}\n"
      "  ground: fixed\n  crank: {normal: {sigma: 0.001}}\n  motion.dur*: {grid: [0.1]}\n"
      "design: {sobol: 8}\nquantities: [closure_m]\n");
  ASSERT_TRUE(result.study) << result.diagnostics.Text();
  std::vector<std::string> keys;
  for (const Factor& f : result.study->factors) keys.push_back(f.key);
  EXPECT_EQ(keys,
            (std::vector<std::string>{"parameters.coupler", "parameters.rocker", "parameters.rho",
                                      "parameters.bar", "parameters.crank", "motion.duration_s"}));
  const auto width = [&](size_t k) {
    const auto& uniform = std::get<Uniform>(result.study->factors[k].axis.distribution);
    return (uniform.upper - uniform.lower) / result.study->factors[k].axis.nominal;
  };
  EXPECT_NEAR(width(0), 0.10, 1e-12);
  EXPECT_NEAR(width(1), 0.02, 1e-12);  // the last pattern wins
  EXPECT_NEAR(width(3), 0.10, 1e-12);
}

TEST_F(StudyFiles, PatternsPassByWhatIsComputedOrZero) {
  // l_home is an expression of others, c_y is 0, and a part's number is set where it is used.
  const test::TestFolder folder("study_patterns");
  folder.Write("model.yaml",
               "name: m\nparameters: {m: 2, I: 2*m, c_y: 0, g: {value: 9.81}}\n"
               "parts: {cart: {parameters: {mass: 1, k: 3}, bodies: {b: {mass: mass, com: [0, c_y, "
               "0], inertia: [I, I, I]}}, joints: {s: {kind: prismatic, parent: world, child: b, "
               "axis: z}}, drives: {x: {kind: joint, joint: s}}}}\n"
               "instances: {a: {part: cart, mass: m}}\ngravity: [0, 0, -g]\n");
  folder.Write(
      "hold.yaml",
      "mechanism: model.yaml\nmotion: {duration_s: 0.1, sample_s: 0.01, commands: {a.x: [0, "
      "{sine: {amplitude: 0.1, period_s: 1}}]}}\nanalytic: none\n");
  const auto keys = [&](const std::string& vary) {
    const StudyResult result = LoadStudyText("study: s\nscenario: hold.yaml\nvary: " + vary +
                                                 "\ndesign: {sobol: 2}\nquantities: [closure_m]\n",
                                             folder.PathOf("s.yaml"));
    EXPECT_TRUE(result.study) << result.diagnostics.Text();
    std::string text;
    for (const Factor& f : result.study->factors) text += f.key + " ";
    return text;
  };
  EXPECT_EQ(keys("{'*': {uniform: {plus_minus_percent: 5}}}"),
            "parameters.m parameters.g parameters.a.k ");
  EXPECT_EQ(keys("{motion.commands.*: {uniform: {plus_minus_percent: 5}}}"),
            "motion.commands.a.x.1.sine.amplitude motion.commands.a.x.1.sine.period_s ");
}

TEST_F(StudyFiles, PatternsThatFitNothingAreRefused) {
  ExpectIn(Refusal("{q_*: {uniform: {plus_minus_percent: 1}}}", "{sobol: 8}"),
           "vary.q_*: fits no parameter that four_bar writes out");
  ExpectIn(Refusal("{rho: {normal: {sigma: 1}}, cranc: fixed}", "{sobol: 8}"),
           "did you mean 'crank'");
}

TEST_F(StudyFiles, CorrelationsAreOfNormalNumbersThatCanHaveThem) {
  const std::string vary =
      "{rho: {normal: {sigma_percent: 1}}, crank: {normal: {sigma_mm: 1}}, rocker: {normal: "
      "{sigma_mm: 1}}, bar: {uniform: {plus_minus_mm: 1}}}";
  const auto with = [&](const std::string& text, const std::string& design = "{sobol: 8}") {
    return Refusal(vary, design, "quantities: [closure_m]\ncorrelations: " + text + "\n");
  };
  ExpectIn(with("[{of: [rho, crank], coefficient: 1}]"), "violates -1 < coefficient < 1");
  ExpectIn(with("[{of: [rho, cranc], coefficient: 0.1}]"), "did you mean 'crank'");
  ExpectIn(with("[{of: [rho, bar], coefficient: 0.1}]"), "bar is not normal");
  ExpectIn(with("[{of: [rho], coefficient: 0.1}]"), "name two numbers");
  ExpectIn(with("[{of: [rho, rho], coefficient: 0.1}]"), "rho with itself");
  ExpectIn(with("[{of: [rho, crank], coefficient: 0.1}]", "{saltelli: 8}"), "independent numbers");
  ExpectIn(with("[{of: [rho, crank], coefficient: 0.1}, {of: [crank, rho], coefficient: 0.2}]"),
           "is given twice");
  ExpectIn(with("[{of: [rho, crank], coefficient: 0.9}, {of: [crank, rocker], coefficient: 0.9}, "
                "{of: [rho, rocker], coefficient: -0.9}]"),
           "the smallest eigenvalue of their matrix is -0.8");
  const StudyResult good =
      Load("vary: " + vary +
           "\ndesign: {sobol: 8}\nquantities: [closure_m]\ncorrelations: [{of: [rho, rocker], "
           "coefficient: 0.5}]\n");
  ASSERT_TRUE(good.study) << good.diagnostics.Text();
  EXPECT_EQ(good.study->design.correlations[0].second, 2u);
}

TEST_F(StudyFiles, ValidationNeedsATableAndAnotherWitness) {
  const auto of = [](const std::string& scenario, const std::string& rest) {
    return LoadStudyText("study: s\nscenario: " + scenario +
                             "\nvary: {rho: {normal: {sigma_percent: 1}}}\nquantities: "
                             "[closure_m]\n" +
                             rest,
                         "scenarios/s.yaml");
  };
  const std::string table = "four_bar/table_noisy.yaml", sobol = "design: {sobol: 8}\n";
  const std::string inverse = "witnesses: [inverse]\n";
  const StudyResult good =
      of(table, sobol + inverse + "validation: {coverage: 3, share: 0.1, u_num: 0.001}\n");
  ASSERT_TRUE(good.study) << good.diagnostics.Text();
  EXPECT_EQ(good.study->validation->coverage, 3.0);
  EXPECT_EQ(good.study->validation->share, 0.1);
  EXPECT_EQ(good.study->validation->u_num, 0.001);
  const auto refused = [&](const std::string& scenario, const std::string& rest,
                           const std::string& part) {
    const StudyResult result = of(scenario, rest);
    EXPECT_FALSE(result.study) << rest;
    ExpectIn(result.diagnostics.Text(), part);
  };
  refused(table, sobol + "validation: {}\n", "the first witness is the table itself");
  refused("four_bar/static", sobol + inverse + "validation: {}\n", "has no table");
  refused(table, "design: {saltelli: 8}\n" + inverse + "validation: {}\n", "needs drawn points");
  refused(table, sobol + inverse + "validation: {u_num: -1}\n", "violates >= 0");
  refused(table, sobol + inverse + "validation: {share: 1}\n", "violates 0 <= share < 1");
  refused(table, sobol + inverse + "missing: 2\n", "missing = 2 violates");
}

TEST_F(StudyFiles, OthersMayAskForOtherPoints) {
  const std::string vary = "vary: {rho: {normal: {sigma_percent: 1}}}\nquantities: [closure_m]\n";
  const StudyResult more =
      Load(vary + "design: {sobol: 8, seed: 3}\n", {.drawn = {.count = 64, .seed = 5}});
  ASSERT_TRUE(more.study) << more.diagnostics.Text();
  EXPECT_EQ(more.study->design.count, 64u);
  EXPECT_EQ(more.study->design.seed, 5u);
  const StudyResult odd = Load(vary + "design: {sobol: 8}\n", {.drawn = {.count = 60}});
  EXPECT_FALSE(odd.study);
  ExpectIn(odd.diagnostics.Text(), "60 is not a power of two");
  const StudyResult grid =
      Load("vary: {rho: {grid: [1, 2]}}\nquantities: [closure_m]\ndesign: {grid: true}\n",
           {.drawn = {.count = 64}});
  EXPECT_FALSE(grid.study);
  ExpectIn(grid.diagnostics.Text(), "draws nothing");
}

TEST_F(StudyFiles, AValidationWithoutAWitnessThatIsKnownIsRefusedNotCrashedOn) {
  for (const auto& [witnesses, reported] : {std::pair{"[referense]", "witnesses = 'referense'"},
                                            {"[]", "witnesses: the list is empty"},
                                            {"[\"\"]", "witnesses is ''"},
                                            {"{}", "witnesses"},
                                            {"[[]]", "witnesses"}}) {
    ExpectIn(Refusal("{crank: {uniform: {plus_minus_mm: 0.2}}}", "{latin_hypercube: 8}",
                     std::string("quantities: [motor.force.max]\nvalidation: {}\nwitnesses: ") +
                         witnesses + "\n"),
             reported);
  }
}

}  // namespace
}  // namespace mbv
