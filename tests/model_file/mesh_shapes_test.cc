// Meshes of model files and URDF files: found, read, written back, or left out with one warning.
#include <gtest/gtest.h>

#include "model_file/load_model.h"
#include "model_file/mesh/mass_properties.h"
#include "model_file/urdf/urdf_import.h"
#include "model_file/write_model.h"
#include "tests/support/solids.h"
#include "tests/support/test_folder.h"

namespace mbv {
namespace {

std::string ModelWith(const std::string& shapes) {
  return "name: arm\nbodies:\n  arm:\n    mass: 1\n    com: [0.05, 0.1, 0.15]\n"
         "    inertia: {xx: 0.01, yy: 0.01, zz: 0.01}\n    shapes:\n" +
         shapes +
         "joints:\n  hinge: {kind: revolute, parent: world, child: arm, axis: z}\n"
         "drives:\n  turn: {kind: joint, joint: hinge}\n";
}

class MeshShapes : public testing::Test {
 protected:
  MeshShapes() {
    folder_.Write("robot/meshes/box.stl", ToStl(test::BoxMesh(100, 200, 300), "box"));
    folder_.Write("outside.stl", ToStl(test::BoxMesh(1, 1, 1), ""));
  }
  [[nodiscard]] LoadResult Load(const std::string& shapes) const {
    return LoadModel(folder_.Write("robot/model.yaml", ModelWith(shapes)));
  }
  test::TestFolder folder_{std::string("mesh_shapes_") +
                           testing::UnitTest::GetInstance()->current_test_info()->name()};
};

const Mesh& MeshOf(const Mechanism& m, const std::string& body, size_t index = 0) {
  return std::get<Mesh>(m.bodies[m.FindBody(body)].shapes.at(index).geometry);
}

TEST_F(MeshShapes, OfAModelAreScaledAndPlaced) {
  const LoadResult loaded = Load(
      "      - mesh: {file: meshes/box.stl, scale: 0.001, at: [1, 2, 3]}\n        color: accent\n"
      "      - mesh: {file: meshes/box.stl, scale: [-0.001, 0.001, 0.002]}\n");
  ASSERT_TRUE(loaded.mechanism) << loaded.diagnostics.Text();
  EXPECT_TRUE(loaded.diagnostics.empty()) << loaded.diagnostics.Text();
  const Mesh& mesh = MeshOf(*loaded.mechanism, "arm");
  EXPECT_EQ(mesh.X_BG.translation(), Vec3(1, 2, 3));
  EXPECT_EQ(mesh.file, folder_.PathOf("robot/meshes/box.stl"));
  EXPECT_NEAR(SolidShape(*mesh.surface).amount, 0.006, 1e-8);
  EXPECT_EQ(loaded.mechanism->bodies[1].shapes[0].color, "accent");
  const SolidProperties mirrored = PropertiesOf(*MeshOf(*loaded.mechanism, "arm", 1).surface);
  EXPECT_NEAR(mirrored.volume, 0.012, 1e-8);
  EXPECT_NEAR(mirrored.centroid.x(), -0.05, 1e-7);
}

TEST_F(MeshShapes, OutsideTheModelsFolderAreRefused) {
  for (const std::string& file : {std::string("../outside.stl"), folder_.PathOf("outside.stl")}) {
    const LoadResult loaded = Load("      - mesh: {file: " + file + "}\n");
    EXPECT_FALSE(loaded.mechanism);
    EXPECT_NE(
        loaded.diagnostics.Text().find("model.yaml:8:22: error: bodies.arm.shapes[0].mesh.file"),
        std::string::npos)
        << loaded.diagnostics.Text();
    EXPECT_NE(loaded.diagnostics.Text().find("lies outside the folder of this file"),
              std::string::npos);
  }
}

TEST_F(MeshShapes, BadKeysAndScalesAreFindings) {
  for (const auto& [keys, said] :
       {std::pair("{file: meshes/box.stl, scale: 0}", "violates scale != 0"),
        std::pair("{file: meshes/box.stl, scale: [1, 0, 1]}", "violates scale != 0"),
        std::pair("{scale: 2}", "'file' is missing"),
        std::pair("{file: meshes/box.stl, size: 2}", "size"),
        std::pair("{file: meshes/box.stl, at: nowhere}", "no such frame")}) {
    const LoadResult loaded = Load(std::string("      - mesh: ") + keys + "\n");
    EXPECT_FALSE(loaded.mechanism) << keys;
    EXPECT_NE(loaded.diagnostics.Text().find(said), std::string::npos)
        << keys << loaded.diagnostics.Text();
  }
}

TEST_F(MeshShapes, ThatCannotBeReadAreOneWarning) {
  folder_.Write("robot/broken.stl", "nothing");
  const LoadResult loaded = Load(
      "      - mesh: {file: gone.stl}\n      - mesh: {file: broken.stl}\n"
      "      - mesh: {file: model.yaml}\n      - mesh: {file: package://arm/a.stl}\n"
      "      - mesh: {file: meshes/box.stl, scale: 0.001}\n      - ball: {radius: 0.1}\n");
  ASSERT_TRUE(loaded.mechanism) << loaded.diagnostics.Text();
  EXPECT_EQ(loaded.mechanism->bodies[1].shapes.size(), 2U);
  ASSERT_EQ(loaded.diagnostics.findings().size(), 1U) << loaded.diagnostics.Text();
  EXPECT_NE(loaded.diagnostics.Text().find(
                "warning: 4 of 5 meshes are left out: 'gone.stl' is not there, for one"),
            std::string::npos)
      << loaded.diagnostics.Text();
  const std::string package =
      Load("      - mesh: {file: package://arm/a.stl}\n").diagnostics.Text();
  EXPECT_NE(package.find("--package arm=DIR"), std::string::npos) << package;
}

TEST_F(MeshShapes, AreWrittenBack) {
  const LoadResult loaded = Load(
      "      - mesh: {file: meshes/box.stl, scale: [0.001, 0.001, 0.002], at: {position: [1, 2, "
      "3], "
      "rotation: {axis: x, angle: 0.3}}}\n");
  ASSERT_TRUE(loaded.mechanism) << loaded.diagnostics.Text();
  const std::string text = WriteModel(*loaded.mechanism);
  EXPECT_NE(text.find("mesh: {file: \"meshes/box.stl\", scale: [0.001, 0.001, 0.002], at: "),
            std::string::npos)
      << text;
  const LoadResult back = LoadModel(folder_.Write("robot/back.yaml", text));
  ASSERT_TRUE(back.mechanism) << back.diagnostics.Text();
  const Mesh &a = MeshOf(*loaded.mechanism, "arm"), &b = MeshOf(*back.mechanism, "arm");
  EXPECT_EQ(a.X_BG.matrix(), b.X_BG.matrix());
  EXPECT_EQ(a.scale, b.scale);
  EXPECT_EQ(a.surface->vertices, b.surface->vertices);
}

TEST_F(MeshShapes, AreTakenAlongInFilesOfTheirOwn) {
  LoadResult loaded = Load(
      "      - mesh: {file: meshes/box.stl, scale: 0.001, at: [1, 2, 3]}\n"
      "      - mesh: {file: meshes/box.stl, scale: 0.001}\n"
      "      - mesh: {file: meshes/box.stl, scale: 0.002}\n");
  ASSERT_TRUE(loaded.mechanism) << loaded.diagnostics.Text();
  const auto files = TakeMeshesAlong(&*loaded.mechanism);
  ASSERT_EQ(files.size(), 2U);
  EXPECT_EQ(files[0].path, "meshes/box.stl");
  EXPECT_EQ(files[1].path, "meshes/box_2.stl");
  for (const ModelMeshFile& file : files) folder_.Write("new/" + file.path, file.content);
  const LoadResult back = LoadModel(folder_.Write("new/model.yaml", WriteModel(*loaded.mechanism)));
  ASSERT_TRUE(back.mechanism) << back.diagnostics.Text();
  EXPECT_TRUE(back.diagnostics.empty()) << back.diagnostics.Text();
  EXPECT_NEAR(SolidShape(*MeshOf(*back.mechanism, "arm").surface).amount, 0.006, 1e-8);
  EXPECT_NEAR(SolidShape(*MeshOf(*back.mechanism, "arm", 2).surface).amount, 0.048, 1e-7);
}

// A link with a mesh, and a frame on it that has one, too.
constexpr const char* kUrdf = R"(<robot name="arm"><link name="world"/>
<link name="arm"><inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial>
<visual><origin xyz="1 0 0" rpy="0 0 1.5707963267948966"/><geometry><mesh filename="meshes/box.stl" scale="0.001 0.001 0.001"/></geometry>
<material name="c"><color rgba="1 0 0 1"/></material></visual>
<visual><geometry><mesh filename="package://arm/gone.dae"/></geometry></visual></link>
<link name="tip"><visual><origin xyz="0 0 1"/><geometry><mesh filename="meshes/box.stl"/></geometry></visual></link>
<joint name="hinge" type="continuous"><parent link="world"/><child link="arm"/><axis xyz="0 0 1"/></joint>
<joint name="frame" type="fixed"><parent link="arm"/><child link="tip"/><origin xyz="0 5 0"/></joint></robot>)";

TEST_F(MeshShapes, OfUrdfLinksAreReadAndThoseOfFramesGoToTheirCarrier) {
  const LoadResult loaded = LoadModel(folder_.Write("robot/arm.urdf", kUrdf));
  ASSERT_TRUE(loaded.mechanism) << loaded.diagnostics.Text();
  EXPECT_NE(loaded.diagnostics.Text().find("1 of 3 meshes is left out: 'package://arm/gone.dae'"),
            std::string::npos)
      << loaded.diagnostics.Text();
  const Mesh& mesh = MeshOf(*loaded.mechanism, "arm");
  EXPECT_TRUE((mesh.X_BG * Vec3(1, 0, 0)).isApprox(Vec3(1, 1, 0), 1e-12));
  EXPECT_NEAR(SolidShape(*mesh.surface).amount, 0.006, 1e-8);
  EXPECT_EQ(loaded.mechanism->bodies[1].shapes[0].color, "#ff0000ff");
  EXPECT_EQ(MeshOf(*loaded.mechanism, "arm", 1).X_BG.translation(), Vec3(0, 5, 1));
}

TEST_F(MeshShapes, GoThroughUrdfAndBack) {
  const LoadResult loaded = LoadModel(folder_.Write("robot/arm.urdf", kUrdf));
  ASSERT_TRUE(loaded.mechanism) << loaded.diagnostics.Text();
  const std::string text = WriteUrdf(*loaded.mechanism);
  EXPECT_NE(text.find("<mesh filename=\"meshes/box.stl\" scale=\"0.001 0.001 0.001\"/>"),
            std::string::npos)
      << text;
  const LoadResult back = LoadModel(folder_.Write("robot/back.urdf", text));
  ASSERT_TRUE(back.mechanism) << back.diagnostics.Text();
  for (size_t k = 0; k < 2; ++k) {
    const Mesh &a = MeshOf(*loaded.mechanism, "arm", k), &b = MeshOf(*back.mechanism, "arm", k);
    EXPECT_LT((a.X_BG.matrix() - b.X_BG.matrix()).norm(), 1e-12);
    EXPECT_EQ(a.surface->vertices, b.surface->vertices);
  }
}

TEST_F(MeshShapes, BodiesAloneAreReadWhateverTheirMassesAndLoops) {
  std::string urdf = kUrdf;
  urdf.replace(urdf.find("izz=\"1\""), 7, "izz=\"-9\"");
  const std::string file = folder_.Write("robot/arm.urdf", urdf);
  EXPECT_FALSE(LoadModel(file).mechanism);
  const LoadedBodies loaded = LoadBodies(file);
  EXPECT_FALSE(loaded.diagnostics.has_errors()) << loaded.diagnostics.Text();
  ASSERT_EQ(loaded.bodies.size(), 2U);
  EXPECT_EQ(loaded.bodies[1].I_Bcm_B(2, 2), -9.0);
  EXPECT_TRUE(LoadBodies(folder_.PathOf("none.yaml")).diagnostics.has_errors());
}

}  // namespace
}  // namespace mbv
