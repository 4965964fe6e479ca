// mechanism.json: what is written passes, what is perturbed is reported with its path.
#include "external/mechanism_json.h"

#include <gtest/gtest.h>

#include <functional>
#include <nlohmann/json.hpp>

#include "mechanism/joint_kinds.h"
#include "model_file/load_model.h"
#include "tests/support/shipped.h"

namespace mbv {
namespace {

using Edited = nlohmann::json;

std::string WrittenModel(const std::string& name) {
  LoadResult result = LoadModel(SourcePath("/models/" + name + "/model.yaml"));
  EXPECT_TRUE(result.mechanism) << result.diagnostics.Text();
  return MechanismJson(*result.mechanism);
}

// "path: message" of all findings, one per line.
std::string Findings(const std::string& text) {
  std::string all;
  for (const JsonFinding& finding : CheckMechanismJson(text)) {
    all += PathText(finding.path) + ": " + finding.message +
           (finding.hint.empty() ? "" : " (" + finding.hint + ")") + "\n";
  }
  return all;
}

TEST(MechanismCheck, PassesWhatIsWritten) {
  for (const std::string& name : ShippedModelNames()) {
    EXPECT_EQ(Findings(WrittenModel(name)), "") << name;
  }
}

// A JSON file of something else may hold a secret: none of its keys and values is shown.
TEST(MechanismCheck, QuotesNothingOfAnotherKind) {
  for (const char* text :
       {R"({"token": "AKIASECRET", "SECRET": 1})", R"({"schema": "SECRET", "SECRET": {}})",
        R"({"schema": ["SECRET"]})", R"({"SECRET": tru})", "[\"SECRET\"]", "SECRET"}) {
    const std::string findings = Findings(text);
    EXPECT_NE(findings, "") << text;
    EXPECT_EQ(findings.find("SECRET"), std::string::npos) << findings;
  }
}

TEST(MechanismCheck, TheSchemaKnowsAllJointKinds) {
  const Edited schema = Edited::parse(MechanismSchemaText());
  Edited words = Edited::array();
  for (const JointKindRow& row : kJointKindRows) words.push_back(std::string(row.word));
  EXPECT_EQ(schema["definitions"]["joint"]["properties"]["kind"]["enum"], words);
}

struct Perturb {
  const char* what;
  std::function<void(Edited*)> edit;
  std::string reported;
};

TEST(MechanismCheck, ReportsWhatIsPerturbed) {
  const std::string written = WrittenModel("four_bar");
  const Perturb perturbations[] = {
      {"no mass", [](Edited* m) { (*m)["bodies"][1].erase("mass"); }, "bodies[1]: "},
      {"a word", [](Edited* m) { (*m)["bodies"][1]["mass"] = "2"; }, "bodies[1].mass: "},
      {"below zero", [](Edited* m) { (*m)["bodies"][1]["mass"] = -2; }, "bodies[1].mass: "},
      {"a key", [](Edited* m) { (*m)["joints"][0]["axes"] = 1; }, "joints[0]: "},
      {"a kind", [](Edited* m) { (*m)["joints"][0]["kind"] = "hinge"; }, "joints[0].kind: "},
      {"a version", [](Edited* m) { (*m)["schema"] = "mbverify/mechanism/2"; }, "schema: "},
      {"a short vector",
       [](Edited* m) {
         (*m)["gravity"] = {0, 0};
       },
       "gravity: "},
      {"twice", [](Edited* m) { (*m)["bodies"][2]["name"] = (*m)["bodies"][1]["name"]; },
       "bodies[2].name: 'crank' is there twice"},
      {"absent", [](Edited* m) { (*m)["joints"][0]["child"]["body"] = "cranck"; },
       "joints[0].child.body: there is no body 'cranck' (did you mean 'crank'?)"},
      {"a mirror",
       [](Edited* m) {
         for (auto& x : (*m)["bodies"][1]["home"]["R"][2]) x = -x.get<double>();
       },
       "bodies[1].home.R: is not a rotation: R Rᵀ − 1 is up to"},
      {"long",
       [](Edited* m) {
         (*m)["joints"][0]["axis"] = {0, 2, 0};
       },
       "joints[0].axis: has the length 2 instead of 1"},
      {"a plate", [](Edited* m) { (*m)["bodies"][1]["inertia"][0][0] = 1e6; },
       "bodies[1].inertia: has the moments"},
      {"no tree",
       [](Edited* m) {
         for (auto& joint : (*m)["joints"]) joint["closure"] = false;
       },
       "joints: 4 of them close no loop, where 3 make a tree"},
      {"loose",
       [](Edited* m) {
         for (auto& joint : (*m)["joints"]) joint["closure"] = true;
       },
       "bodies[1]: 'crank' is not joined to the world"}};
  for (const Perturb& perturb : perturbations) {
    Edited edited = Edited::parse(written);
    perturb.edit(&edited);
    const std::string found = Findings(edited.dump());
    EXPECT_NE(found.find(perturb.reported), std::string::npos) << perturb.what << "\n" << found;
  }
  EXPECT_NE(Findings("{").find("the file ends before its JSON does"), std::string::npos);
  EXPECT_NE(Findings("[]"), "");
}

// Whatever single value is taken out or is another, the finding is in words of ours.
TEST(MechanismCheck, EveryRefusalHasAReasonAndNoLibrarysWords) {
  const Edited written = Edited::parse(WrittenModel("four_bar"));
  const Edited flat = written.flatten();
  size_t refused = 0;
  for (const auto& [pointer, value] : flat.items()) {
    for (const Edited& other : {Edited("x"), Edited(-1.5), Edited(nullptr), Edited::array()}) {
      Edited edited = written;
      edited[Edited::json_pointer(pointer)] = other;
      const std::string found = Findings(edited.dump());
      refused += found.empty() ? 0 : 1;
      for (const char* words :
           {"does not fit the schema", "constraint", "validate", "schema node"}) {
        EXPECT_EQ(found.find(words), std::string::npos) << pointer << " " << other << "\n" << found;
      }
    }
  }
  EXPECT_GT(refused, flat.size());
  Edited edited = written;
  edited["bodies"][1]["mass"] = -2;
  edited["joints"][0]["axes"] = 1;
  edited["joints"][0]["kind"] = "revolut";
  edited["gravity"] = {0, "x"};
  edited["bodies"][2].erase("mass");
  const std::string found = Findings(edited.dump());
  for (const char* part :
       {"bodies[1].mass: is -2, at least 0 is needed",
        "joints[0]: has the unknown key 'axes' (did you mean 'axis'?)",
        "joints[0].kind: is \"revolut\", not one of:", "(did you mean 'revolute'?)",
        "gravity: has 2 entries, needed: 3", "gravity[1]: is a text where a number is needed",
        "bodies[2]: has no 'mass'"}) {
    EXPECT_NE(found.find(part), std::string::npos) << part << "\n" << found;
  }
}

}  // namespace
}  // namespace mbv
