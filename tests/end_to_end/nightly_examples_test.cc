// The files of examples/nightly: they parse, hang together, and call the program as it is.
#include <gtest/gtest.h>
#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <filesystem>
#include <map>
#include <regex>
#include <set>

#include "tests/support/run_program.h"
#include "tests/support/sanitized.h"

namespace mbv {
namespace {

namespace fs = std::filesystem;

const std::string kNightly = SourcePath("/examples/nightly/");

std::vector<std::string> WordsOf(const std::string& text) {
  std::istringstream stream(text);
  return {std::istream_iterator<std::string>(stream), {}};
}

// A job, or all jobs: one name or a list of names (GitLab: or of {job: name}).
std::vector<std::string> NamesIn(const YAML::Node& node) {
  if (!node) return {};
  if (node.IsScalar()) return {node.as<std::string>()};
  std::vector<std::string> names;
  for (const YAML::Node& item : node) {
    names.push_back(item.IsMap() ? item["job"].as<std::string>() : item.as<std::string>());
  }
  return names;
}

std::string AllRunText(const YAML::Node& job) {
  std::string text;
  for (const YAML::Node& step : job["steps"]) text += step["run"].as<std::string>("") + "\n";
  return text;
}

// What is wrong with a workflow of GitHub, "" if nothing: as far as can be reported without it.
std::string GithubTrouble(const YAML::Node& workflow) {
  std::string trouble;
  std::set<std::string> jobs;
  for (const auto& entry : workflow["jobs"]) jobs.insert(entry.first.as<std::string>());
  if (jobs.empty() || !workflow["on"]) trouble += "no jobs or no trigger\n";
  for (const auto& entry : workflow["jobs"]) {
    const auto name = entry.first.as<std::string>();
    const YAML::Node job = entry.second;
    for (const std::string& needed : NamesIn(job["needs"])) {
      if (!jobs.contains(needed)) trouble += name + " needs " + needed + "\n";
    }
    if (!job["runs-on"] || !job["timeout-minutes"]) trouble += name + ": no machine or no limit\n";
    for (const YAML::Node& step : job["steps"]) {
      const auto uses = step["uses"].as<std::string>("");
      if (uses.empty() == step["run"].as<std::string>("").empty()) {
        trouble += name + ": a step runs nothing or two things\n";
      }
      if (!uses.empty() && !std::regex_match(uses, std::regex("[\\w./-]+@v\\d+"))) {
        trouble += name + ": " + uses + " has no version\n";
      }
      if (uses.starts_with("actions/upload-artifact") && !step["with"]["retention-days"]) {
        trouble += name + ": an artifact is kept for ever\n";
      }
    }
  }
  return trouble;
}

TEST(NightlyExamples, TheGithubWorkflowHangsTogether) {
  const YAML::Node workflow = YAML::LoadFile(kNightly + "github-nightly.yml");
  EXPECT_EQ(GithubTrouble(workflow), "");
  // One build for all of the regression, from kept objects; no other test compiles.
  const YAML::Node jobs = workflow["jobs"];
  EXPECT_NE(AllRunText(jobs["build"]).find("scripts/setup --target mbverify"), std::string::npos);
  for (const char* job : {"shard", "report"}) {
    EXPECT_EQ(AllRunText(jobs[job]).find("scripts/setup"), std::string::npos) << job;
    EXPECT_NE(AllRunText(jobs[job]).find("$RUNTIME"), std::string::npos) << job;
  }
  bool cached = false;
  for (const YAML::Node& step : jobs["build"]["steps"]) {
    cached = cached || (step["uses"].as<std::string>("").starts_with("actions/cache@") &&
                        step["with"]["path"].as<std::string>() == ".ccache");
  }
  EXPECT_TRUE(cached);
  EXPECT_NE(AllRunText(jobs["report"]).find("traces.csv -exec gzip"), std::string::npos);
  const size_t shards = jobs["shard"]["strategy"]["matrix"]["shard"].size();
  EXPECT_NE(AllRunText(jobs["shard"]).find("}}/" + std::to_string(shards) + " "), std::string::npos)
      << "as many shards as the matrix has";
}

TEST(NightlyExamples, ABrokenWorkflowIsNoticed) {
  const std::string text = ReadAll(kNightly + "github-nightly.yml");
  const std::map<std::string, std::string> perturbations = {
      {"needs: build\n", "needs: bulid\n"},
      {"actions/checkout@v4", "actions/checkout"},
      {"retention-days: 3\n", "compression: 3\n"},
      {"      - run: tar -czf", "      - name: tar -czf"}};
  for (const auto& [from, to] : perturbations) {
    std::string perturbed = text;
    const size_t at = perturbed.find(from);
    ASSERT_NE(at, std::string::npos) << from;
    perturbed.replace(at, from.size(), to);
    EXPECT_NE(GithubTrouble(YAML::Load(perturbed)), "") << from;
  }
}

TEST(NightlyExamples, TheGitlabPipelineHangsTogether) {
  const YAML::Node pipeline = YAML::LoadFile(kNightly + "gitlab-nightly.yml");
  const std::set<std::string> keywords = {"workflow", "stages", "default", "variables"};
  std::set<std::string> stages;
  for (const std::string& stage : NamesIn(pipeline["stages"])) stages.insert(stage);
  size_t jobs = 0;
  for (const auto& entry : pipeline) {
    const auto name = entry.first.as<std::string>();
    if (keywords.contains(name)) continue;
    ++jobs;
    const YAML::Node job = entry.second;
    EXPECT_TRUE(stages.contains(job["stage"].as<std::string>(""))) << name;
    EXPECT_GT(job["script"].size(), 0U) << name;
    EXPECT_TRUE(job["artifacts"]["expire_in"]) << name;
    for (const std::string& needed : NamesIn(job["needs"])) EXPECT_TRUE(pipeline[needed]) << needed;
  }
  EXPECT_EQ(jobs, 3U);
  EXPECT_EQ(pipeline["report"]["artifacts"]["reports"]["junit"].as<std::string>(),
            "regression/junit.xml");
  EXPECT_EQ(pipeline["report"]["when"].as<std::string>(), "always");
  EXPECT_TRUE(pipeline["build"]["cache"]);
}

TEST(NightlyExamples, TheJenkinsfileIsBalanced) {
  std::string open;
  const std::string text = ReadAll(kNightly + "Jenkinsfile");
  for (const char c : text) {
    if (c == '{' || c == '(' || c == '[') open += c;
    if (c != '}' && c != ')' && c != ']') continue;
    ASSERT_FALSE(open.empty());
    EXPECT_EQ(open.back(), c == '}' ? '{' : c == ')' ? '(' : '[');
    open.pop_back();
  }
  EXPECT_EQ(open, "");
  EXPECT_EQ(std::count(text.begin(), text.end(), '\'') % 2, 0);
  for (const char* part :
       {"junit testResults", "archiveArtifacts", "buildDiscarder", "-name traces.csv"}) {
    EXPECT_NE(text.find(part), std::string::npos) << part;
  }
}

// Each call of `command`: the words from there to the end of the shell command.
std::vector<std::string> CallsOf(const std::string& command, std::string text) {
  text = std::regex_replace(text, std::regex("\\\\\n *"), " ");
  text = std::regex_replace(text, std::regex("\n +(?=--|\\|\\|)"), " ");  // folded YAML
  std::vector<std::string> calls;
  const std::regex call("mbverify " + command + "\\b([^\n;|&]*)");
  for (std::sregex_iterator it(text.begin(), text.end(), call), end; it != end; ++it) {
    calls.push_back((*it)[1]);
  }
  return calls;
}

TEST(NightlyExamples, EveryCallUsesOptionsThatThereAre) {
  const Program mbverify("nightly_examples");
  std::map<std::string, std::string> help;
  size_t calls = 0;
  for (const auto& file : fs::directory_iterator(kNightly)) {
    const std::string text = ReadAll(file.path());
    for (const char* command : {"regress", "merge"}) {
      for (const std::string& call : CallsOf(command, text)) {
        ++calls;
        if (help[command].empty()) help[command] = mbverify(std::string(command) + " --help").out;
        const std::regex option("--[a-z][a-z-]*");
        for (std::sregex_iterator it(call.begin(), call.end(), option), end; it != end; ++it) {
          EXPECT_TRUE(std::regex_search(help[command], std::regex(it->str() + "\\b")))
              << file.path() << ": " << command << " " << it->str();
        }
      }
    }
  }
  EXPECT_GE(calls, 10U);
}

TEST(NightlyExamples, ALostScenarioFailsEveryRun) {
  for (const char* name : {"github-nightly.yml", "gitlab-nightly.yml", "Jenkinsfile", "crontab",
                           "mbverify-nightly.service", "slurm-array.sh"}) {
    const std::string text = ReadAll(kNightly + name);
    size_t judging = 0;
    for (const char* command : {"regress", "merge"}) {
      for (const std::string& call : CallsOf(command, text)) {
        if (call.find("--shard") != std::string::npos ||
            call.find("--partial") != std::string::npos) {
          continue;
        }
        ++judging;
        EXPECT_NE(call.find("--fail-on-missing"), std::string::npos) << name << ":" << call;
      }
    }
    EXPECT_EQ(judging, 1U) << name;
  }
}

// Libraries that the program is linked with come from the packages that the examples install.
TEST(NightlyExamples, TheProgramsPackagesAreAllInstalled) {
  if (test::kSanitized) GTEST_SKIP() << "is linked with more";
  const Program mbverify("nightly_packages");
  const ProgramResult found = mbverify.Script(
      "for l in $(objdump -p \"$mbverify\" | sed -n 's/.*NEEDED *//p'); do "
      "dpkg -S \"$(readlink -f \"$(ldconfig -p | sed -n \"s/.*[ \\t]$l .*=> //p\" | head -1)\")\" "
      "2>/dev/null | cut -d: -f1; done | sort -u");
  std::vector<std::string> needed = WordsOf(found.out);
  ASSERT_GE(needed.size(), 8U) << found.out << found.err;
  const std::set<std::string> everywhere = {"libc6", "libgcc-s1", "libstdc++6"};
  for (const char* file : {"github-nightly.yml", "gitlab-nightly.yml"}) {
    const YAML::Node yaml = YAML::LoadFile(kNightly + file);
    const YAML::Node variables = yaml["env"] ? yaml["env"] : yaml["variables"];
    const std::vector<std::string> installed = WordsOf(variables["RUNTIME"].as<std::string>());
    for (const std::string& package : needed) {
      if (everywhere.contains(package)) continue;
      EXPECT_NE(std::find(installed.begin(), installed.end(), package), installed.end())
          << file << " lacks " << package;
    }
  }
}

// What cron would mail: everything the line prints.
TEST(NightlyExamples, CronIsSilentWhenGreenOnly) {
  const Program mbverify("nightly_cron");
  std::string line;
  std::istringstream lines(ReadAll(kNightly + "crontab"));
  while (std::getline(lines, line) && line.find("mbverify regress") == std::string::npos) {
  }
  line = std::regex_replace(line, std::regex("^(\\S+ ){5}"), "");
  ASSERT_TRUE(line.starts_with("cd /srv/mbverify && ")) << line;
  line.replace(0, 16, "cd '" + mbverify.folder().string() + "'");
  line = std::regex_replace(line, std::regex("/usr/local/bin/mbverify"), "./regression");
  for (const int code : {0, 1, 3}) {
    std::ofstream(mbverify.folder() / "regression")
        << "#!/bin/sh\necho 'one drifted'\necho 'diagnostics' >&2\nexit " << code << "\n";
    fs::permissions(mbverify.folder() / "regression", fs::perms::owner_all);
    const ProgramResult result = mbverify.Script(line);
    EXPECT_EQ(result.err, "");
    EXPECT_EQ(result.out, code == 0 ? "" : "one drifted\ndiagnostics\n") << code;
  }
}

TEST(NightlyExamples, TheServiceReportsWhenItFailed) {
  const std::string service = ReadAll(kNightly + "mbverify-nightly.service");
  std::smatch failed;
  ASSERT_TRUE(std::regex_search(service, failed, std::regex("\nOnFailure=(\\S+)\n")));
  ASSERT_TRUE(fs::exists(kNightly + failed[1].str())) << failed[1];
  EXPECT_LT(service.find("OnFailure="), service.find("[Service]")) << "it belongs to [Unit]";
  for (const auto& file : fs::directory_iterator(kNightly)) {
    const std::string ending = file.path().extension();
    if (ending != ".service" && ending != ".timer") continue;
    std::istringstream lines(ReadAll(file.path()));
    const std::regex shape("|#.*|\\[(Unit|Service|Timer|Install)\\]|[A-Z][A-Za-z]*=.*");
    for (std::string line; std::getline(lines, line);) {
      EXPECT_TRUE(std::regex_match(line, shape)) << file.path() << ": " << line;
    }
  }
}

}  // namespace
}  // namespace mbv
