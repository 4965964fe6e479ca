// Files of another kind, some of which hold secrets: whatever command is given one, or reaches one
// through another file, shows nothing of it.
#include <gtest/gtest.h>

#include <string>
#include <utility>
#include <vector>

#include "base/text.h"
#include "tests/support/run_program.h"

namespace mbv {
namespace {

const std::string kSecret = "hunter2SECRET";

// As they lie in home folders; several have keys that our files have, too.
const std::vector<std::pair<std::string, std::string>>& SecretFiles() {
  static const std::string s = kSecret;
  static const std::vector<std::pair<std::string, std::string>> files = {
      {"shadow.yaml", "root:$6$" + s + ":19000:0:99999:7:::\nname: x\n"},
      {"aws.yaml", "version: 1\naws_access_key_id: " + s + "\n" + s + ": 1\n"},
      {"kube.yaml", "apiVersion: v1\nkind: Secret\nmetadata:\n  name: db\ndata:\n  " + s + ": " +
                        s + "\ntype: Opaque\n" + s + ": 1\n"},
      {"compose.yaml",
       "version: '3'\nname: shop\nservices: {db: {PASSWORD: " + s + "}}\n" + s + ": 1\n"},
      {"hosts.yaml", "name: me\ngithub.com: {oauth_token: " + s + "}\n" + s + ": 1\n"},
      {"sasl.yaml", "mechanism: " + s + "\nusername: u\npassword: " + s + "\n" + s + ": 1\n"},
      {"vault.yaml", "$ANSIBLE_VAULT;1.1;AES256\n" + s + "\n"},
      {"alias.yaml", "*" + s + "\n"},
      {"tag.yaml", "!" + s + "\nname: a\n" + s + ": 1\n" + s + ": 2\n"},
      {"twice.yaml", s + ": 1\n" + s + ": 2\nname: [\n"},
      {"env.yaml", "PASSWORD=" + s + "\n"},
      {"account.json", R"({"type": "account", "name": ")" + s + R"(", ")" + s + R"(": 1})"},
      {"schema.json", R"({"schema": ")" + s + R"(", "version": "1", ")" + s + R"(": 2})"},
      {"damaged.json", R"({"schema": "mbverify/mechanism/1", )" + s + "}"},
      {"settings.xml", "<settings><password>" + s + "</password></settings>"},
      {"damaged.xml", "<" + s + "><a></" + s + ">"},
      {"damaged.urdf", "<" + s + "><a></" + s + ">"},
      {"settings.urdf", "<settings name='" + s + "'><link name='" + s + "'/></settings>"},
      {"key.pem", "-----BEGIN PRIVATE KEY-----\n" + s + "\n-----END PRIVATE KEY-----\n"},
      {"key.zip", "PK" + s},
      {"key.sqlite", s + "\n" + s + "\n"}};
  return files;
}

class ForeignFilesTest : public testing::Test {
 protected:
  std::string Write(const std::string& name, const std::string& text) const {
    std::ofstream(mbverify.folder() / name, std::ios::binary) << text;
    return (mbverify.folder() / name).string();
  }
  // Files that are refused before work begins: a fork of the test will do.
  void ExpectSilent(const std::string& call) const {
    const ProgramResult result = mbverify.Forked(call);
    EXPECT_TRUE(result.exit_code >= 0 && result.exit_code <= 3) << call;
    EXPECT_EQ((result.out + result.err).find(kSecret), std::string::npos)
        << call << "\n"
        << Printable(result.out + result.err);
  }

  Program mbverify{std::string("foreign_") +
                   testing::UnitTest::GetInstance()->current_test_info()->name()};
};

TEST_F(ForeignFilesTest, AreShownByNoCommand) {
  const std::string out = " --out " + mbverify.Out();
  for (const auto& [name, text] : SecretFiles()) {
    const std::string file = " " + Write(name, text);
    for (const std::string& command :
         {std::string("check"), std::string("model"), "run --no-pictures" + out, "study" + out,
          std::string("stiffness"), std::string("inertia"), std::string("crosscheck"),
          std::string("verify"), "regress" + out, std::string("history list --history"),
          "merge" + out, "study merge" + out}) {
      ExpectSilent(command + file);
    }
  }
}

TEST_F(ForeignFilesTest, AreShownByNoFileThatNamesThem) {
  const std::string body =
      "joints: {pivot: {kind: revolute, parent: world, child: bar, axis: y}}\n"
      "drives: {motor: {kind: joint, joint: pivot}}\n";
  for (const auto& [name, text] : SecretFiles()) {
    Write(name, text);
    for (const char* mesh : {".stl", ".obj", ".dae", ".ply"}) Write(name + mesh, text);
    std::vector<std::string> files = {
        Write("scenario.yaml", "mechanism: ./" + name + "\nmotion: {duration_s: 1}\n"),
        Write("from.yaml", "name: a\nparameters_from: " + name +
                               "\nbodies: {bar: {mass: 1, inertia: [1, 1, 1]}}\n" + body),
        Write("urdf.yaml", "name: a\nurdf: " + name + "\n"),
        Write("study.yaml", "study: a\nscenario: " + name + "\nquantities: {a: {channel: b}}\n")};
    for (const char* mesh : {".stl", ".obj", ".dae", ".ply"}) {
      files.push_back(Write(
          "mesh" + std::string(mesh) + ".yaml",
          "name: a\nbodies: {bar: {mass: 1, inertia: [1, 1, 1], shapes: [{mesh: {file: " + name +
              mesh + "}}]}}\n" + body));
    }
    std::string all = "check";
    for (const std::string& file : files) all += " " + file;
    ExpectSilent(all);
  }
}

// A file of ours with a mistake is shown: the rule does not hide what its author looks for.
TEST_F(ForeignFilesTest, AFileOfOursIsQuoted) {
  const std::string file =
      Write("model.yaml",
            "name: a\nbodis: {bar: {mass: 1, inertia: [1, 1, 1]}}\nelse_where: 1\n"
            "joints: {pivot: {kind: revolute, parent: world, child: bar, axis: y}}\n");
  const ProgramResult result = mbverify("check '" + file + "'");
  const std::string said = result.out + result.err;
  EXPECT_EQ(result.exit_code, 2);
  EXPECT_NE(said.find("unknown key 'bodis'"), std::string::npos) << said;
  EXPECT_NE(said.find("did you mean 'bodies'?"), std::string::npos) << said;
  EXPECT_NE(said.find("unknown key 'else_where'"), std::string::npos) << said;
}

}  // namespace
}  // namespace mbv
