// mbverify inertia, and --package, as a user types them.
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "math/triangle_mesh.h"
#include "tests/support/run_program.h"
#include "tests/support/solids.h"

namespace mbv {
namespace {

// A box of 0.1 × 0.2 × 0.3 m from the origin, 6 kg at 1000 kg/m³; `xx` is 6 (0.2² + 0.3²) / 12.
std::string Robot(const std::string& mesh, const std::string& xx = "0.065") {
  return "<robot name=\"box\"><link name=\"world\"/><link name=\"box\"><inertial><origin "
         "xyz=\"0.05 "
         "0.1 0.15\"/><mass value=\"6\"/><inertia ixx=\"" +
         xx +
         "\" iyy=\"0.05\" izz=\"0.025\" ixy=\"0\" ixz=\"0\" "
         "iyz=\"0\"/></inertial><visual><geometry>"
         "<mesh filename=\"" +
         mesh +
         "\" scale=\"0.001 0.001 0.001\"/></geometry></visual></link><joint name=\"j\" "
         "type=\"continuous\"><parent link=\"world\"/><child link=\"box\"/><axis xyz=\"0 0 1\"/>"
         "</joint></robot>";
}

class InertiaCommand : public testing::Test {
 protected:
  InertiaCommand() { (void)Write("robot/box.stl", ToStl(test::BoxMesh(100, 200, 300), "")); }
  [[nodiscard]] std::string Write(const std::string& name, const std::string& text) const {
    const std::filesystem::path path = mbverify.folder() / name;
    std::filesystem::create_directories(path.parent_path());
    std::ofstream(path, std::ios::binary) << text;
    return path.string();
  }
  Program mbverify{std::string("inertia_") +
                   testing::UnitTest::GetInstance()->current_test_info()->name()};
};

TEST_F(InertiaCommand, FindsASoundRobotSound) {
  const ProgramResult result = mbverify("inertia " + Write("robot/r.urdf", Robot("box.stl")));
  EXPECT_EQ(result.exit_code, 0) << result.out << result.err;
  EXPECT_NE(result.out.find("1 of 1 bodies with meshes are sound"), std::string::npos)
      << result.out;
  EXPECT_NE(result.out.find(" 6000 "), std::string::npos) << result.out;  // cm³
  EXPECT_NE(result.out.find(" 1000 "), std::string::npos) << result.out;  // kg/m³
  EXPECT_EQ(result.err, "");
}

TEST_F(InertiaCommand, NamesAMistakeAndWritesTheNumbers) {
  // Steiner's term 6 (0.1² + 0.15²) and so on: about the origin.
  std::string text = Robot("box.stl", "0.26");
  text.replace(text.find("iyy=\"0.05\""), 10, "iyy=\"0.2\"");
  text.replace(text.find("izz=\"0.025\""), 11, "izz=\"0.1\"");
  text.replace(text.find("ixy=\"0\""), 7, "ixy=\"-0.03\"");
  text.replace(text.find("ixz=\"0\""), 7, "ixz=\"-0.045\"");
  text.replace(text.find("iyz=\"0\""), 7, "iyz=\"-0.09\"");
  const std::string json = (mbverify.folder() / "inertia.json").string();
  const ProgramResult result =
      mbverify("inertia " + Write("robot/r.urdf", text) + " --json " + json);
  EXPECT_EQ(result.exit_code, 1) << result.out << result.err;
  EXPECT_NE(result.out.find("box: steiner_added: the tensor is about the body's origin"),
            std::string::npos)
      << result.out;
  const auto data = nlohmann::json::parse(ReadAll(json));
  ASSERT_EQ(data["bodies"].size(), 1U);
  const auto& body = data["bodies"][0];
  EXPECT_EQ(body["name"], "box");
  EXPECT_EQ(body["closed"], true);
  EXPECT_NEAR(body["volume_m3"].get<double>(), 0.006, 1e-8);
  EXPECT_NEAR(body["density_kg_m3"].get<double>(), 1000.0, 1e-2);
  EXPECT_NEAR(body["mesh"]["inertia"][0].get<double>(), 0.065, 1e-7);
  EXPECT_NEAR(body["mesh"]["com_m"][2].get<double>(), 0.15, 1e-7);
  EXPECT_EQ(body["stated"]["inertia"][3], -0.03);
  EXPECT_EQ(body["findings"][0]["mistake"], "steiner_added");
}

TEST_F(InertiaCommand, BadInputIsCodeTwo) {
  EXPECT_EQ(mbverify("inertia " + (mbverify.folder() / "none.urdf").string()).exit_code, 2);
  const ProgramResult missing = mbverify("inertia " + Write("robot/r.urdf", Robot("gone.stl")));
  EXPECT_EQ(missing.exit_code, 2);
  EXPECT_NE(missing.err.find("'gone.stl' is not there"), std::string::npos) << missing.err;
  EXPECT_NE(missing.err.find("error: no body has a mesh"), std::string::npos) << missing.err;
  // The mesh is an input: it is not overwritten.
  const std::string mesh = (mbverify.folder() / "robot/box.stl").string();
  const ProgramResult over =
      mbverify("inertia " + Write("robot/r.urdf", Robot("box.stl")) + " --json " + mesh);
  EXPECT_EQ(over.exit_code, 2);
  EXPECT_NE(over.err.find("which was read for it"), std::string::npos) << over.err;
}

TEST_F(InertiaCommand, PackagesAreFoundWhereTheyAreReportedToBe) {
  const std::string robot = Write("urdf/r.urdf", Robot("package://box_description/box.stl"));
  const std::string folder = (mbverify.folder() / "robot").string();
  EXPECT_EQ(mbverify("inertia " + robot).exit_code, 2);
  EXPECT_EQ(mbverify("inertia " + robot + " --package box_description=" + folder).exit_code, 0);
  const ProgramResult wrong = mbverify("inertia " + robot + " --package box_description");
  EXPECT_EQ(wrong.exit_code, 2);
  EXPECT_NE(wrong.err.find("is not NAME=DIR with a folder DIR"), std::string::npos) << wrong.err;
}

TEST_F(InertiaCommand, RunAndInitTakeMeshesAlong) {
  const std::string robot = Write("robot/r.urdf", Robot("box.stl"));
  const ProgramResult run =
      mbverify("run " + robot + " --no-pictures --quiet --out " + mbverify.Out());
  EXPECT_EQ(run.exit_code, 0) << run.out << run.err;
  EXPECT_EQ(run.err.find("left out"), std::string::npos) << run.err;
  EXPECT_TRUE(std::filesystem::exists(mbverify.folder() / "out/box/setup/meshes/box.stl"));
  const std::string page = ReadAll(mbverify.folder() / "out/box/setup/first/report.html");
  EXPECT_NE(page.find("\"type\":\"mesh\""), std::string::npos);
  const ProgramResult init =
      mbverify("init my_box --from " + robot + " --into " + (mbverify.folder() / "new").string());
  ASSERT_EQ(init.exit_code, 0) << init.err;
  const std::string model = (mbverify.folder() / "new/models/my_box/model.yaml").string();
  const ProgramResult inertia = mbverify("inertia " + model);
  EXPECT_EQ(inertia.exit_code, 0) << inertia.out << inertia.err;
}

}  // namespace
}  // namespace mbv
