// What `--json` and the result files hold is what docs/reference/schemas/ states.
#include <gtest/gtest.h>

#include <fstream>
#include <nlohmann/json.hpp>
#include <regex>
#include <set>

#include "base/text.h"
#include "tests/support/commands.h"
#include "tests/support/json_schemas.h"
#include "tests/support/run_program.h"
#include "tests/support/source_dir.h"

namespace mbv {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::json;

struct Call {
  const char* arguments;  // OUT: a folder that is there
  int exit_code;
};

// In this order: the later ones read what the earlier ones left. Of each command what it answers
// when all is well; of those that write JSON then, too, a disagreement, no answer and bad input.
constexpr Call kCalls[] = {
    {"run four_bar/turn_inverse --no-pictures --out OUT/x", 0},
    {"run four_bar/turn_inverse machine_five_bar/draw bricard/fall --derivatives=3 --no-pictures "
     "--no-report --out OUT/x",
     0},
    {"run four_bar/turn_inverse machine_five_bar/draw bricard/fall --certify=3 --no-pictures "
     "--no-report --out OUT/x",
     0},
    {"run four_bar/static four_bar/turn four_bar/table_excel --no-pictures --no-report --out OUT/x",
     0},
    {"run stabilizing_platform/must_fail/analytic_mass --no-pictures --no-report --out OUT/x", 1},
    {"run four_bar/must_fail/out_of_reach --no-pictures --no-report --out OUT/x", 3},
    {"run OUT/bad.yaml --no-pictures --no-report --out OUT/x", 2},
    {"run scara_robot/stiffness slider_crank/buffer --no-pictures --no-report --out OUT/x", 0},
    {"run OUT/servo.xml --no-pictures --no-report --out OUT/x", 0},
    {"stiffness scara_robot --out OUT/x", 0},
    {"converge four_bar/turn --out OUT/x", 0},
    {"study four_bar/study_by_hand --count 16 --out OUT/x", 0},
    {"study four_bar/study_validation --out OUT/x", 0},
    {"sensitivity four_bar/turn_inverse --parameter rho", 0},
    {"sensitivity four_bar/static --no-search --out OUT/x", 0},
    {"sheet four_bar/turn_inverse --out OUT/x", 0},
    {"crosscheck four_bar/turn", 0},
    {"crosscheck --newest four_bar/turn", 0},
    {"benchmark benchmark/damped_pendulum --engine reference --out OUT/x", 0},
    {"workspace spr_tripod --no-pictures --out OUT/x", 0},
    {"workspace four_bar --out OUT/x", 0},
    {"workspace four_bar --modes all --out OUT/x", 0},
    {"workspace friction_five_bar --joint-space --over motor1,motor2 --out OUT/x", 0},
    {"linearise four_bar --out OUT/x", 0},
    {"linearise spr_tripod/tool_load --time 0.2 --data mat --out OUT/x", 0},
    {"audit spr_tripod", 0},
    {"model four_bar", 0},
    {"model stabilizing_platform", 0},
    {"check four_bar/foreign", 0},
    {"check OUT/bad.yaml", 2},
    {"list", 0},
    {"inertia OUT/robots/box.urdf", 1},
    {"survey OUT/robots", 0},
    {"log four_bar OUT/x/four_bar/turn_inverse/traces.csv --no-pictures --out OUT/x", 0},
    {"log four_bar OUT/robots/box.obj --no-pictures --out OUT/x", 2},
    {"standin tests/mechanisms/parallel_ankle.yaml --joints ankle.0,ankle.1 --resolution 3 "
     "--range ankle.0_deg=-2:2 --range ankle.1_deg=-2:2 --export --out OUT/y",
     0},
    {"code tests/mechanisms/parallel_ankle.yaml --coordinates ankle.0,ankle.1 --states 20 "
     "--range ankle.0_deg=-2:2 --range ankle.1_deg=-2:2 --cells 8 --out OUT/x",
     0},
    {"standin tests/mechanisms/parallel_ankle.yaml --joints ankle.0,ankle.1 --resolution 3 "
     "--out OUT/x",
     0},
    {"size slider_crank/buffer", 0},
    {"size slider_crank/press --choose scenarios/slider_crank/catalogue.yaml --out OUT/size", 0},
    {"size four_bar/turn", 2},
    {"figures four_bar/turn --only drive_torques --out OUT/figures", 0},
    {"figures OUT/bad.yaml --out OUT/figures", 2},
    {"figures --paper list", 0},
    {"figures --paper spr_tripod fig3 --out OUT/figures", 0},
    {"tables four_bar/turn --out OUT/tables", 0},
    {"package four_bar/static -o OUT/paper.zip", 0},
    {"package OUT/bad.yaml -o OUT/bad.zip", 2},
    {"package --check OUT/paper.zip", 0},
    {"package --check OUT/robots/box.urdf", 2},
    {"regress four_bar/static four_bar/must_fail OUT/wrong.yaml OUT/bad.yaml --no-pictures "
     "--no-reports --out OUT/regress",
     2},
    {"regress four_bar/static --no-pictures --no-reports --history OUT/regress/history.sqlite "
     "--out OUT/again",
     0},
    {"merge OUT/again --out OUT/merged --no-history", 0},
    {"history list --history OUT/regress/history.sqlite", 0},
    {"history compare last~1 last --history OUT/regress/history.sqlite", 0}};

constexpr const char* kBox = R"(<robot name="box">
  <link name="base"/>
  <joint name="j" type="revolute"><parent link="base"/><child link="box"/><axis xyz="0 0 1"/>
    <limit lower="-1" upper="1" effort="1" velocity="1"/></joint>
  <link name="box">
    <inertial><mass value="6"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial>
    <visual><geometry><mesh filename="box.obj"/></geometry></visual>
  </link>
</robot>
)";

// A tetrahedron.
constexpr const char* kMesh = R"(v 0 0 0
v 1 0 0
v 0 1 0
v 0 0 1
f 1 3 2
f 1 2 4
f 1 4 3
f 2 3 4
)";

class JsonSchemaTest : public testing::Test {
 protected:
  struct Document {
    std::string from;
    Json json;
  };

  void Write(const std::string& name, const std::string& text) const {
    std::ofstream(mbverify.folder() / "in" / name) << text;
  }
  [[nodiscard]] std::string Placed(std::string text) const {
    const std::string folder = (mbverify.folder() / "in").string();
    for (size_t at = 0; (at = text.find("OUT", at)) != std::string::npos; at += folder.size()) {
      text.replace(at, 3, folder);
    }
    return text;
  }

  // What every call prints, and the files that they leave.
  std::vector<Document> Documents() {
    fs::create_directories(mbverify.folder() / "in" / "robots");
    Write("bad.yaml", "scenario: bad\nmodel: four_bar\nmotoin: {}\n");
    Write("wrong.yaml", std::string("model: four_bar\nparameters: {rho: 1}\n") +
                            "motion: {duration_s: 0.1, commands: {motor: 0.5}}\n" +
                            "reference: {parameters: {rho: 2}}\nexpect: {verdict: agree}\n");
    Write("robots/box.urdf", kBox);
    Write("robots/box.obj", kMesh);
    const ProgramResult servo =
        mbverify(Placed("model four_bar --format mjcf --drives servo "
                        "--out OUT/servo.xml"));
    EXPECT_EQ(servo.exit_code, 0) << servo.err;
    std::vector<Document> documents;
    for (const Call& call : kCalls) {
      const ProgramResult result = mbverify(Placed(call.arguments) + " --json -");
      EXPECT_EQ(result.exit_code, call.exit_code) << call.arguments << "\n" << result.err;
      EXPECT_TRUE(result.out.starts_with("{\n  \"schema\": \"mbverify.") &&
                  result.out.find("\n  \"program\": \"mbverify ") < 80)
          << call.arguments << "\n"
          << result.out.substr(0, 200) << result.err;
      documents.push_back({call.arguments, Json::parse(result.out, nullptr, false)});
    }
    EXPECT_EQ(
        mbverify.Script("cd " + (mbverify.folder() / "in").string() + " && unzip -q paper.zip")
            .exit_code,
        0);
    for (const auto& entry : fs::recursive_directory_iterator(mbverify.folder() / "in")) {
      if (entry.path().extension() != ".json") continue;
      Json json = Json::parse(ReadAll(entry.path()), nullptr, false);
      // States of a run in progress, RO-Crates and CSVW have no schema of ours.
      if (json.is_object() && json.contains("schema")) {
        documents.push_back({entry.path().string(), std::move(json)});
      }
    }
    return documents;
  }

  // A renamed, retyped or missing key of any document.
  void RefuseChanged(const std::vector<Document>& documents) {
    const auto other = [](const Json& value) {
      return value.is_string() ? Json(17) : value.is_object() ? Json::array() : Json("text");
    };
    size_t refused = 0;
    const auto perturb = [&](const Document& document, const Json::json_pointer& place) {
      const Json object = document.json[place];
      for (const auto& [key, value] : object.items()) {
        Json renamed = document.json, typed = document.json;
        renamed[place].erase(key);
        renamed[place][key + "_"] = value;
        typed[place][key] = other(value);
        EXPECT_NE(schemas.Misfit(renamed), "") << document.from << ": " << place << " " << key;
        EXPECT_NE(schemas.Misfit(typed), "") << document.from << ": " << place << " " << key;
        refused += 2;
      }
    };
    std::set<std::string> seen;
    for (const Document& document : documents) {
      if (!document.json.is_object()) continue;
      // One of a kind is enough, and all that commands print.
      const std::string id = document.json.value("schema", "");
      if (!seen.insert(id).second && document.from.starts_with("/")) continue;
      const Json::json_pointer top;
      perturb(document, top);
      for (const auto& [key, value] : document.json.items()) {
        if (!value.is_array() || value.empty() || !value[0].is_object()) continue;
        if (key == "indices") continue;  // its keys are names of witnesses
        perturb(document, top / key / 0);
      }
      // What is required may not be missing.
      for (const auto& [file, schema] : schemas.texts()) {
        if (schema["$id"] != id || !schema.contains("required")) continue;
        for (const std::string key : schema["required"]) {
          Json less = document.json;
          less.erase(key);
          EXPECT_NE(schemas.Misfit(less), "") << document.from << " without " << key;
          ++refused;
        }
      }
    }
    EXPECT_GT(refused, 800u);
  }

  Program mbverify{testing::UnitTest::GetInstance()->current_test_info()->name()};
  test::JsonSchemas schemas;
};

TEST_F(JsonSchemaTest, DocumentsFitChangedOnesAreRefusedAndEverySchemaIsUsed) {
  const std::vector<Document> documents = Documents();
  RefuseChanged(documents);
  std::set<std::string> used;
  for (const Document& document : documents) {
    EXPECT_EQ(schemas.Misfit(document.json), "") << document.from;
    used.insert(document.json.value("schema", ""));
  }
  for (const auto& [file, schema] : schemas.texts()) {
    EXPECT_TRUE(used.contains(schema["$id"])) << file << ": no document of the test names it";
  }
  // Every command that has --json is among the calls.
  for (const std::string& command : test::AllCommands(mbverify)) {
    if (mbverify.Forked(command + " --help").out.find("\n  --json ") == std::string::npos) continue;
    EXPECT_TRUE(std::ranges::any_of(kCalls, [&](const Call& call) {
      return std::string(call.arguments).starts_with(command + " ") || call.arguments == command;
    })) << command;
  }
}

// A key that is new, gone or renamed and a value of another type are refused, at the top and in the
// first item of each list of objects.
TEST_F(JsonSchemaTest, EverySchemaNamedInTheSourceHasAFile) {
  // Lists of names, no JSON; and the data inside report.html, which web/ declares.
  std::set<std::string> ids = {"mbverify.stage/1", "mbverify.files/1", "mbverify.run_files/1",
                               "mbverify.page/1"};
  const std::regex pattern("mbverify\\.[a-z_]+/[0-9]+");
  size_t found = 0;
  for (const auto& entry : fs::recursive_directory_iterator(SourcePath("/src"))) {
    if (entry.path().extension() != ".cc" && entry.path().extension() != ".h") continue;
    const std::string text = ReadAll(entry.path());
    for (std::sregex_iterator it(text.begin(), text.end(), pattern), end; it != end; ++it) {
      ++found;
      EXPECT_TRUE(schemas.Has(it->str()) || ids.contains(it->str()))
          << entry.path() << " writes " << it->str() << " without a file in docs/reference/schemas";
    }
  }
  EXPECT_GT(found, 20u);
}

// Objects with a fixed set of keys allow no others, references stay in the file, and what two files
// define under one name is the same.
TEST_F(JsonSchemaTest, SchemasAreClosedSelfContainedAndConsistent) {
  std::map<std::string, std::pair<std::string, Json>> definitions;
  for (const auto& [file, schema] : schemas.texts()) {
    EXPECT_EQ(schema["$schema"], "http://json-schema.org/draft-07/schema#") << file;
    EXPECT_EQ(file.substr(file.find('.')), ".schema.json");
    EXPECT_NE(schema["description"].get<std::string>().find("are null"), std::string::npos) << file;
    std::set<std::string> unused;
    if (schema.contains("definitions")) {
      for (const auto& [name, definition] : schema["definitions"].items()) {
        unused.insert("#/definitions/" + name);
        const auto [known, is_new] = definitions.try_emplace(name, file, definition);
        EXPECT_EQ(known->second.second, definition)
            << name << " differs in " << file << " and " << known->second.first;
      }
    }
    const std::set<std::string> there = unused;
    const std::function<void(const Json&)> look = [&, &file = file](const Json& part) {
      if (part.is_object() && part.contains("properties") && part["properties"].is_object()) {
        EXPECT_TRUE(part.contains("additionalProperties")) << file << ": " << part.dump();
        EXPECT_NE(part.value("additionalProperties", Json(true)), Json(true)) << file;
      }
      if (part.is_object() && part.contains("$ref") && part["$ref"].is_string()) {
        EXPECT_TRUE(there.contains(part["$ref"])) << file << ": " << part["$ref"];
        unused.erase(part["$ref"].get<std::string>());
      }
      if (part.is_structured()) {
        for (const Json& inner : part) look(inner);
      }
    };
    look(schema);
    EXPECT_TRUE(unused.empty()) << file << ": unused " << *unused.begin();
  }
}

TEST_F(JsonSchemaTest, DocumentListsTheSchemas) {
  const std::string text = ReadAll(SourcePath("/docs/reference/json.md"));
  for (const auto& [file, schema] : schemas.texts()) {
    EXPECT_NE(text.find("(schemas/" + file + ")"), std::string::npos) << file;
    EXPECT_NE(text.find("`" + schema["$id"].get<std::string>() + "`"), std::string::npos) << file;
  }
}

}  // namespace
}  // namespace mbv
