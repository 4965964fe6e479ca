// The commands package and verify: an archive runs wherever it is unpacked, and whatever a third
// party changes in it is reported.
#include <gtest/gtest.h>

#include <filesystem>

#include "tests/support/run_program.h"
#include "tests/support/sanitized.h"

namespace mbv {
namespace {

namespace fs = std::filesystem;

bool Has(const std::string& text, const std::string& words) {
  return text.find(words) != std::string::npos;
}

// An archive of one scenario, and what becomes of edited copies of it.
class Packed {
 public:
  Packed(const std::string& name, const std::string& scenarios, const std::string& results)
      : mbverify_("package_" + name), results_(results) {
    made_ = mbverify_("package " + scenarios + " --no-report --no-figures -o " + Zip());
  }

  [[nodiscard]] const Program& program() const { return mbverify_; }
  [[nodiscard]] const ProgramResult& made() const { return made_; }
  [[nodiscard]] std::string Zip() const { return (mbverify_.folder() / "paper.zip").string(); }
  [[nodiscard]] ProgramResult Verify(const std::string& words) const {
    return mbverify_("package --check " + Zip() + " " + words);
  }
  // After an edit in the words of edit_archive.py, where RESULTS stands for the folder of results.
  [[nodiscard]] ProgramResult Edited(std::string words, const std::string& options = "") const {
    for (size_t at = 0; (at = words.find("RESULTS")) != std::string::npos;) {
      words.replace(at, 7, results_);
    }
    const std::string other = (mbverify_.folder() / "edited.zip").string();
    const ProgramResult edit = mbverify_.Script("python3 tests/features/paper/edit_archive.py " +
                                                Zip() + " " + other + " " + words);
    EXPECT_EQ(edit.exit_code, 0) << edit.err;
    return mbverify_("package --check " + other + " " + options);
  }

 private:
  Program mbverify_;
  std::string results_;
  ProgramResult made_;
};

Packed FourBar(const std::string& name) {
  return {name, "scenarios/four_bar/turn_inverse.yaml", "results/four_bar/turn_inverse"};
}

TEST(PackageCommand, TheSameInputsGiveTheSameBytes) {
  const Program mbverify("package_same");
  const std::string paper = (mbverify.folder() / "a/paper.zip").string();
  const std::string again = (mbverify.folder() / "b/paper.zip").string();
  const std::string scenario = "scenarios/four_bar/turn_inverse.yaml ";
  ASSERT_EQ(mbverify("package " + scenario + "-o " + paper).exit_code, 0);
  const ProgramResult other =
      mbverify.Script("mkdir -p " + mbverify.Out() + " && TZ=Asia/Tokyo TMPDIR=" + mbverify.Out() +
                      " \"$mbverify\" package " + scenario + "-o " + again);
  ASSERT_EQ(other.exit_code, 0) << other.err;
  EXPECT_GT(ReadAll(paper).size(), 100'000U);
  EXPECT_TRUE(ReadAll(paper) == ReadAll(again));
  const ProgramResult verified = mbverify("package --check " + paper);
  EXPECT_EQ(verified.exit_code, 0) << verified.err;
  EXPECT_TRUE(Has(verified.out, "0 within their limits, 0 not judged, 0 differ: repeated"))
      << verified.out;
}

TEST(PackageCommand, RunsAsItIsUnpackedAndContainsNoUserPath) {
  const Program mbverify("package_home");
  const std::string home = (mbverify.folder() / "home/jane_doe").string();
  const std::string copied = "mkdir -p " + home + "/papers/mine " + home +
                             "/papers/models && cp -r models/four_bar " + home +
                             "/papers/models/ && cp scenarios/four_bar/turn_inverse.yaml " + home +
                             "/papers/mine/my.yaml";
  ASSERT_EQ(mbverify.Script(copied).exit_code, 0);
  const ProgramResult made = mbverify.Script(
      "cd " + home + " && export HOME=" + home +
      " USER=jane_doe && \"$mbverify\" package "
      "papers/mine/my.yaml -o ../paper.zip && cd .. && python3 -m zipfile -e paper.zip . && cd "
      "paper "
      "&& \"$mbverify\" run inputs/mine/my.yaml --quiet --no-pictures && ls inputs/models/four_bar "
      "&& ! grep -r -a -e jane_doe -e mbv_cli -e mbverify-package .");
  EXPECT_EQ(made.exit_code, 0) << made.out << made.err;
  EXPECT_TRUE(Has(made.out, "model.yaml")) << made.out;
}

TEST(PackageCommand, WhatNamesTheHomeFolderIsRefused) {
  const Program mbverify("package_names");
  const std::string home = (mbverify.folder() / "home").string();
  const ProgramResult made = mbverify.Script(
      "mkdir -p " + home + " && (cat scenarios/four_bar/turn_inverse.yaml; echo '# " + home +
      "/notes') >" + home + "/my.yaml && cd " + home + " && HOME=" + home +
      " \"$mbverify\" package my.yaml -o paper.zip");
  EXPECT_EQ(made.exit_code, 2);
  EXPECT_TRUE(Has(made.err, "my.yaml:12:1: error: contains the path of your home directory"))
      << made.err;
  EXPECT_FALSE(fs::exists(home + "/paper.zip"));
}

TEST(PackageCommand, ModelsFoundByNameAreTakenAlong) {
  const Program mbverify("package_by_name");
  const std::string folder = mbverify.folder().string();
  const ProgramResult made = mbverify.Script(
      "cp scenarios/four_bar/turn_inverse.yaml " + folder + "/my.yaml && cd " + folder +
      " && \"$mbverify\" package my.yaml --no-report --no-figures -o paper.zip --json - && "
      "\"$mbverify\" verify paper.zip");
  EXPECT_EQ(made.exit_code, 0) << made.err;
  EXPECT_TRUE(Has(made.out, "\"path\": \"inputs/models/four_bar/model.yaml\"")) << made.out;
  EXPECT_TRUE(Has(made.out, "\"path\": \"inputs/my.yaml\"")) << made.out;
}

TEST(PackageCommand, FilesWithoutAFolderInCommonAreRefused) {
  const Program mbverify("package_apart");
  const std::string folder = mbverify.folder().string();
  const ProgramResult made = mbverify.Script(
      "mkdir -p " + folder + "/users/jane " + folder + "/other && cp -r models/four_bar " + folder +
      "/other/ && sed 's,mechanism: .*,mechanism: ../../other/four_bar/model.yaml,' "
      "scenarios/four_bar/turn_inverse.yaml >" +
      folder + "/users/jane/my.yaml && cd " + folder + "/users/jane && HOME=" + folder +
      "/users/jane \"$mbverify\" package my.yaml -o paper.zip");
  EXPECT_EQ(made.exit_code, 2);
  EXPECT_TRUE(Has(made.err, "lies in no folder with")) << made.err;
}

TEST(PackageCommand, NothingIsOverwrittenUnasked) {
  const Packed packed = FourBar("force");
  ASSERT_EQ(packed.made().exit_code, 0) << packed.made().err;
  const std::string call = "package scenarios/four_bar/turn_inverse.yaml --no-report --no-figures ";
  const std::string before = ReadAll(packed.Zip());
  const ProgramResult again = packed.program()(call + "--date 2026-11-23 -o " + packed.Zip());
  EXPECT_EQ(again.exit_code, 2);
  EXPECT_TRUE(Has(again.err, "is there already")) << again.err;
  EXPECT_TRUE(ReadAll(packed.Zip()) == before);
  EXPECT_EQ(packed.program()(call + "--force --date 2026-11-23 -o " + packed.Zip()).exit_code, 0);
  EXPECT_FALSE(ReadAll(packed.Zip()) == before);
  const ProgramResult input =
      packed.program().Script("cp scenarios/four_bar/turn_inverse.yaml " + packed.program().Out() +
                              " && \"$mbverify\" "
                              "package " +
                              packed.program().Out() + " --force -o " + packed.program().Out());
  EXPECT_EQ(input.exit_code, 2);
  EXPECT_TRUE(Has(input.err, "which was read for it")) << input.err;
}

TEST(PackageCommand, BadInputLeavesNoArchive) {
  const Program mbverify("package_bad");
  const std::string zip = (mbverify.folder() / "paper.zip").string();
  const std::string turn = "scenarios/four_bar/turn_inverse.yaml ";
  for (const std::string& words :
       {"models/four_bar/model.yaml -o " + zip, "nowhere.yaml -o " + zip,
        turn + "-o " + mbverify.folder().string(), turn + "-o /dev/null/paper.zip",
        turn + "-o " + mbverify.folder().string() + "/.zip", turn + "--date 2026-02-30 -o " + zip,
        turn + "--date soon -o " + zip, turn + "-o " + zip + " --json " + zip}) {
    const ProgramResult made = mbverify("package " + words);
    const bool writable = words.find("/dev/null/") == std::string::npos;
    EXPECT_EQ(made.exit_code, writable ? 2 : 3) << words << made.out;
    EXPECT_FALSE(made.err.empty()) << words;
    if (words.find("--json") == std::string::npos) {
      EXPECT_FALSE(fs::exists(zip)) << words;
    }
  }
}

TEST(PackageCommand, TheDateIsThatOfTheSourceNeverOfTheClock) {
  const Program mbverify("package_date");
  const std::string call =
      "\"$mbverify\" package scenarios/four_bar/turn_inverse.yaml --no-report "
      "--no-figures --force --json - -o " +
      mbverify.Out() + ".zip";
  EXPECT_TRUE(Has(mbverify.Script(call).out, "\"date\": \"1980-01-01\""));
  const ProgramResult dated = mbverify.Script("SOURCE_DATE_EPOCH=1700000000 " + call);
  EXPECT_TRUE(Has(dated.out, "\"date\": \"2023-11-14\"")) << dated.out;
  EXPECT_EQ(mbverify.Script("SOURCE_DATE_EPOCH=soon " + call).exit_code, 2);
}

TEST(PackageCommand, PagesThatAuditAPapersEquationsArePackedToo) {
  const Program mbverify("package_page");
  const std::string paper = (mbverify.folder() / "paper.zip").string();
  const ProgramResult made = mbverify(
      "package scenarios/spr_tripod/default_inverse.yaml scenarios/slider_crank/turn.yaml "
      "--no-figures -o " +
      paper);
  ASSERT_EQ(made.exit_code, 0) << made.err;
  const ProgramResult verified = mbverify("package --check " + paper);
  EXPECT_EQ(verified.exit_code, 0) << verified.err;
  EXPECT_TRUE(Has(verified.out, "0 not judged, 0 differ: repeated")) << verified.out;
}

TEST(VerifyCommand, APerturbedNumberIsReportedWithItsSignal) {
  const Packed packed = FourBar("perturbed");
  ASSERT_EQ(packed.made().exit_code, 0) << packed.made().err;
  const ProgramResult perturbed =
      packed.Edited("scale RESULTS/traces.csv motor.force.simulated 1.001 honest");
  EXPECT_EQ(perturbed.exit_code, 1) << perturbed.err;
  EXPECT_TRUE(Has(perturbed.out, "motor.force.simulated by 0.00035")) << perturbed.out;
  EXPECT_TRUE(Has(perturbed.out, "NOT REPEATED")) << perturbed.out;
  // A last digit is round-off.
  const ProgramResult digit =
      packed.Edited("scale RESULTS/traces.csv motor.force.simulated 1.00000000000001 honest");
  EXPECT_EQ(digit.exit_code, 0) << digit.out;
  EXPECT_TRUE(Has(digit.out, "within its limits results/four_bar/turn_inverse/traces.csv"))
      << digit.out;
  const ProgramResult summary = packed.Edited(
      "replace RESULTS/summary.json '\"duration_s\": 2.0' '\"duration_s\": 2.002' honest");
  EXPECT_EQ(summary.exit_code, 1) << summary.out;
  EXPECT_TRUE(Has(summary.out, "duration_s: 2.002 in the archive, 2.0 now")) << summary.out;
}

TEST(VerifyCommand, AModelFileThatSaysSomethingElseDiffersThoughItsNumbersAreTheSame) {
  const Packed packed = FourBar("verify_page");
  const ProgramResult run = packed.Edited("replace RESULTS/model.xml 'four_bar' 'five_bar' honest");
  EXPECT_EQ(run.exit_code, 1) << run.out << run.err;
  EXPECT_NE(run.out.find("though the numbers that it is made of are the same"), std::string::npos)
      << run.out;
}

TEST(VerifyCommand, ChangedInputsGiveOtherResults) {
  const Packed packed = FourBar("input");
  const ProgramResult heavier = packed.Edited(
      "replace inputs/models/four_bar/model.yaml 'rho: {value: 2,' 'rho: {value: 2.002,' honest");
  EXPECT_EQ(heavier.exit_code, 1) << heavier.err;
  EXPECT_TRUE(Has(heavier.out, "DIFFERS           results/four_bar/turn_inverse/traces.csv"))
      << heavier.out;
  const ProgramResult longer = packed.Edited(
      "replace inputs/scenarios/four_bar/turn_inverse.yaml 'sample_s: 0.01' 'sample_s: 0.02' "
      "honest");
  EXPECT_EQ(longer.exit_code, 1);
  EXPECT_TRUE(Has(longer.out, "rows in the archive")) << longer.out;
}

TEST(VerifyCommand, WhatIsNotAnArchiveOfOursIsRefusedUnrun) {
  const Packed packed = FourBar("hostile");
  const std::pair<const char*, const char*> edits[] = {
      {"drop RESULTS/traces.csv", "lacks 'results/four_bar/turn_inverse/traces.csv'"},
      {"drop RESULTS/traces.csv drop RESULTS/summary.json drop RESULTS/model.xml drop "
       "RESULTS/inputs.json honest",
       "has no results of"},
      {"scale RESULTS/traces.csv motor.force.simulated 1.001", "was changed: it"},
      {"drop manifest.json", "has no paper/manifest.json"},
      {"add inputs/more.yaml", "which its manifest does not name"},
      {"add RESULTS/more.csv", "turn_inverse/more.csv', which its manifest does not name"},
      {"link inputs/passwd", "is a link"},
      {"twice README.md", "holds 'paper/README.md' twice"},
      {"slip ../evil.yaml", "leads outside"},
      {"slip other/evil.yaml", "does not hold one folder alone"},
      {"replace manifest.json mbverify.package/1 mbverify.package/7",
       "schema is 'mbverify.package/7'"}};
  for (const auto& [words, finding] : edits) {
    const ProgramResult verified = packed.Edited(words);
    EXPECT_EQ(verified.exit_code, 2) << words;
    EXPECT_TRUE(Has(verified.err, finding)) << words << "\n" << verified.err;
    EXPECT_FALSE(Has(verified.err, "repeats ")) << words;
  }
  EXPECT_EQ(packed.program()("package --check scenarios/four_bar/turn.yaml").exit_code, 2);
  EXPECT_EQ(packed.program()("package --check nowhere.zip").exit_code, 2);
}

// 300 MB that pack into 300 kB: beside the manifest, with another size than it says, and as it
// says.
TEST(VerifyCommand, WhatUnpacksToMuchNeedsNoMemory) {
  const Packed packed = FourBar("bomb");
  const fs::path folder = packed.program().folder();
  std::ofstream(folder / "bomb.py") << R"py(
import json, resource, subprocess, sys, zipfile
program, source, target, size, digest = sys.argv[1:]
with zipfile.ZipFile(source) as old, zipfile.ZipFile(target, 'w', zipfile.ZIP_DEFLATED) as new:
    for item in old.infolist():
        content = old.read(item)
        if item.filename == 'paper/manifest.json' and size != '-':
            manifest = json.loads(content)
            manifest['files'].append({'path': 'inputs/bomb', 'role': 'input', 'bytes': int(size), 'sha256': digest * 64})
            content = json.dumps(manifest)
        new.writestr(item, content)
    with new.open('paper/inputs/bomb', 'w') as bomb:
        for _ in range(300): bomb.write(bytes(1000000))
result = subprocess.run([program, 'package', '--check', target], stderr=subprocess.PIPE, text=True)
print(resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss // 1024, result.returncode, result.stderr)
)py";
  for (const auto& [arguments, finding] : {std::pair{"- 0", "which its manifest does not name"},
                                           {"299999999 0", "it has 300000000 bytes, 299999999 in"},
                                           {"300000000 0", "its SHA-256 is not that"}}) {
    const ProgramResult result = packed.program().Script(
        "python3 '" + (folder / "bomb.py").string() + "' \"$mbverify\" '" + packed.Zip() + "' '" +
        (folder / "bomb.zip").string() + "' " + arguments);
    std::istringstream said(result.out);
    int mib = 1000, exit_code = -1;
    said >> mib >> exit_code;
    EXPECT_EQ(exit_code, 2) << result.out << result.err;
    EXPECT_TRUE(Has(result.out, finding)) << result.out;
    EXPECT_LT(mib, test::kSanitized ? 290 : 150) << arguments;
  }
}

TEST(VerifyCommand, AnotherVersionIsReported) {
  const Packed packed = FourBar("version");
  const ProgramResult other =
      packed.Edited("replace manifest.json '\"mbverify\": \"' '\"mbverify\": \"9.'", "--json -");
  EXPECT_EQ(other.exit_code, 0) << other.err;
  EXPECT_TRUE(Has(other.err, "was written with mbverify 9.")) << other.err;
  EXPECT_TRUE(Has(other.out, "\"packed\": \"9.")) << other.out;
  EXPECT_TRUE(Has(other.out, "\"repeated\": true")) << other.out;
}

TEST(VerifyCommand, AManifestCannotChooseHowItsResultsAreJudged) {
  const Packed packed = FourBar("kind");
  const ProgramResult other = packed.Edited(
      "scale RESULTS/traces.csv motor.force.simulated 1.001 honest replace manifest.json "
      "'\"kind\": \"motion\"' '\"kind\": \"study\"' replace manifest.json '\"mbverify\": \"' "
      "'\"mbverify\": \"9.'");
  EXPECT_EQ(other.exit_code, 3) << other.out << other.err;
  EXPECT_TRUE(Has(other.out, "is of the kind 'motion', not 'study'")) << other.out;
}

TEST(PackageCommand, MeshesOfPackagesAndLicencesAreTakenAlong) {
  const Program mbverify("package_meshes");
  const std::string folder = mbverify.folder().string();
  // A tetrahedron stands for the crank.
  const ProgramResult made = mbverify.Script(
      "mkdir -p " + folder + "/mine/models/four_bar " + folder +
      "/elsewhere && "
      "python3 -c 'import itertools as i; P = [(0,0,0),(1,0,0),(0,1,0),(0,0,1)]; print(\"\".join("
      "\"v %g %g %g\\n\" % p for p in P) + \"f 1 3 2\\nf 1 2 4\\nf 1 4 3\\nf 2 3 4\")' >" +
      folder +
      "/elsewhere/part.obj && (echo 'license: CC-BY-4.0'; sed "
      "'s,shapes: .{capsule: {to: end.*,shapes: [{mesh: {file: \"package://arm/part.obj\"}}],' "
      "models/four_bar/model.yaml) >" +
      folder +
      "/mine/models/four_bar/model.yaml && "
      "cp scenarios/four_bar/turn_inverse.yaml " +
      folder + "/mine/ && cd " + folder +
      "/mine && \"$mbverify\" package turn_inverse.yaml --package arm=../elsewhere --no-report "
      "--no-figures -o paper.zip --json - && \"$mbverify\" verify paper.zip");
  EXPECT_EQ(made.exit_code, 0) << made.err;
  EXPECT_TRUE(Has(made.out, "\"path\": \"inputs/packages/arm/part.obj\"")) << made.out;
  EXPECT_TRUE(Has(made.out, "--package arm=inputs/packages/arm")) << made.out;
  EXPECT_TRUE(Has(made.out, "\"license\": \"CC-BY-4.0\"")) << made.out;
}

TEST(VerifyCommand, ProgramsOfStrangersRunOnlyWhereTheyAreTrusted) {
  const Packed packed("trust", "scenarios/four_bar/foreign.yaml", "results/four_bar/foreign");
  ASSERT_EQ(packed.made().exit_code, 0) << packed.made().err;
  const ProgramResult refused = packed.Verify("");
  EXPECT_EQ(refused.exit_code, 2);
  EXPECT_TRUE(Has(refused.err, "calls programs (planar: /")) << refused.err;
  EXPECT_TRUE(Has(refused.err, "not trusted: it comes from an archive")) << refused.err;
  const ProgramResult trusted = packed.Verify("--trust");
  EXPECT_EQ(trusted.exit_code, 0);
  EXPECT_TRUE(Has(trusted.err, "foreign.yaml runs programs as you")) << trusted.err;
  // A folder that is trusted says nothing of what is unpacked below it.
  const std::string folder = packed.program().folder().string();
  const ProgramResult below = packed.program().Script(
      "export XDG_CONFIG_HOME=" + folder + "/config TMPDIR=" + folder + " && \"$mbverify\" trust " +
      folder + " && \"$mbverify\" verify " + packed.Zip());
  EXPECT_EQ(below.exit_code, 2) << below.err;
}

// An archive may hold more than it is made of, and its manifest may name it.
TEST(VerifyCommand, ASurplusResultIsReported) {
  const Packed packed = FourBar("surplus");
  ASSERT_EQ(packed.made().exit_code, 0) << packed.made().err;
  const ProgramResult more = packed.Edited("add RESULTS/more.csv honest");
  EXPECT_EQ(more.exit_code, 1) << more.out << more.err;
  EXPECT_TRUE(Has(more.out, "results/four_bar/turn_inverse/more.csv")) << more.out;
  EXPECT_TRUE(Has(more.out, "is in the archive and is not made any more")) << more.out;
  const ProgramResult less = packed.Edited("drop RESULTS/model.xml honest");
  EXPECT_EQ(less.exit_code, 1) << less.out << less.err;
  EXPECT_TRUE(Has(less.out, "is made, but is not in the archive")) << less.out;
}

TEST(VerifyCommand, FilesOutsideOfTheArchiveAreNotRead) {
  const Packed packed = FourBar("outside");
  const ProgramResult outside = packed.Edited(
      "replace inputs/scenarios/four_bar/turn_inverse.yaml 'mechanism: four_bar' 'mechanism: " +
      std::string(kSourceDir) + "/models/four_bar/model.yaml' honest");
  EXPECT_EQ(outside.exit_code, 2) << outside.out;
  EXPECT_TRUE(Has(outside.err, "which is not in the archive")) << outside.err;
}

TEST(VerifyCommand, StiffnessesAreJudgedByTheirOwnMetrics) {
  const Packed packed("stiffness", "scenarios/scara_robot/stiffness.yaml",
                      "results/scara_robot/stiffness");
  ASSERT_EQ(packed.made().exit_code, 0) << packed.made().err;
  EXPECT_EQ(packed.Verify("").exit_code, 0);
  const ProgramResult perturbed = packed.Edited("scale RESULTS/stiffness.csv value 1.001 honest");
  EXPECT_EQ(perturbed.exit_code, 1) << perturbed.err;
  EXPECT_TRUE(Has(perturbed.out, "_entry")) << perturbed.out;
  const ProgramResult loaded = packed.Edited("scale RESULTS/loads.csv x_m.simulated 1.5 honest");
  EXPECT_EQ(loaded.exit_code, 1) << loaded.err;
  EXPECT_TRUE(Has(loaded.out, "simulated.displacement_")) << loaded.out;
}

TEST(VerifyCommand, StudiesAreJudgedPointByPoint) {
  const Packed packed("study", "scenarios/four_bar/study_by_hand.yaml", "results/four_bar_by_hand");
  ASSERT_EQ(packed.made().exit_code, 0) << packed.made().err;
  EXPECT_EQ(packed.Verify("").exit_code, 0);
  const ProgramResult perturbed =
      packed.Edited("scale RESULTS/points.csv motor.force.max 1.001 honest");
  EXPECT_EQ(perturbed.exit_code, 1) << perturbed.err;
  EXPECT_TRUE(Has(perturbed.out, "motor.force.max by ")) << perturbed.out;
  const ProgramResult digit =
      packed.Edited("scale RESULTS/points.csv motor.force.max 1.00000000000001 honest");
  EXPECT_EQ(digit.exit_code, 0) << digit.out;
}

TEST(PackageCommand, ACaseOfTheBenchmarkIsRepeated) {
  const Packed packed("benchmark", "scenarios/benchmark/adams_prismatic_2/case.yaml",
                      "results/benchmark/adams_prismatic_2");
  ASSERT_EQ(packed.made().exit_code, 0) << packed.made().err;
  EXPECT_TRUE(Has(packed.made().out, "confirmed")) << packed.made().out;
  const ProgramResult same = packed.Verify("-v");
  EXPECT_EQ(same.exit_code, 0) << same.out << same.err;
  EXPECT_TRUE(Has(same.out, "inputs/benchmark/adams_LICENSE.txt") ||
              Has(ReadAll(packed.Zip()), "adams_LICENSE.txt"));
  const ProgramResult other = packed.Edited("scale RESULTS/values.csv simulation 1.001 honest");
  EXPECT_EQ(other.exit_code, 1) << other.out;
  EXPECT_TRUE(Has(other.out, "values.csv")) << other.out;
  const ProgramResult rounded =
      packed.Edited("scale RESULTS/values.csv simulation 1.0000000000001 honest");
  EXPECT_EQ(rounded.exit_code, 0) << rounded.out;
}

}  // namespace
}  // namespace mbv
