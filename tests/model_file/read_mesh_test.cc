// Mesh files: what is read of each format, and where they are looked for.
#include "model_file/mesh/read_mesh.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <chrono>
#include <cmath>
#include <cstdlib>
#include <tuple>

#include "base/inputs.h"
#include "model_file/mesh/mass_properties.h"
#include "tests/support/sanitized.h"
#include "tests/support/solids.h"
#include "tests/support/test_folder.h"

namespace mbv {
namespace {

namespace fs = std::filesystem;

TEST(ReadMesh, BinaryStlKeepsASolidClosed) {
  const MeshText mesh = ReadMeshBytes(ToStl(test::BoxMesh(0.1, 0.2, 0.3), "box"), ".STL");
  ASSERT_EQ(mesh.trouble, "");
  EXPECT_EQ(mesh.surface.vertices.size(), 8U);
  EXPECT_EQ(OpenEdges(mesh.surface), 0U);
  EXPECT_NEAR(SolidShape(mesh.surface).amount, 0.006, 1e-8);
}

TEST(ReadMesh, ObjPolygonsBecomeTriangles) {
  const MeshText mesh = ReadMeshBytes(
      "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 0 0 2\nv 1 0 2\nv 1 1 2\nv 0 1 2\n"
      "f 4 3 2 1\nf 5 6 7 8\nf 1 2 6 5\nf 2 3 7 6\nf 3 4 8 7\nf 4 1 5 8\n",
      ".obj");
  ASSERT_EQ(mesh.trouble, "");
  EXPECT_EQ(mesh.surface.triangles.size(), 12U);
  EXPECT_EQ(OpenEdges(mesh.surface), 0U);
  EXPECT_NEAR(SolidShape(mesh.surface).amount, 2.0, 1e-6);
}

// A tetrahedron with edges of 1000 along the axes.
std::string Dae(const std::string& unit, const std::string& up) {
  return "<?xml version=\"1.0\"?><COLLADA xmlns=\"http://www.collada.org/2005/11/COLLADASchema\" "
         "version=\"1.4.1\"><asset>" +
         unit + "<up_axis>" + up +
         "</up_axis></asset><library_geometries><geometry id=\"g\"><mesh><source id=\"p\">"
         "<float_array id=\"a\" count=\"12\">0 0 0 1000 0 0 0 1000 0 0 0 1000</float_array>"
         "<technique_common><accessor source=\"#a\" count=\"4\" stride=\"3\">"
         "<param name=\"X\" type=\"float\"/><param name=\"Y\" type=\"float\"/>"
         "<param name=\"Z\" type=\"float\"/></accessor></technique_common></source>"
         "<vertices id=\"v\"><input semantic=\"POSITION\" source=\"#p\"/></vertices>"
         "<triangles count=\"4\"><input semantic=\"VERTEX\" source=\"#v\" offset=\"0\"/>"
         "<p>0 2 1 0 1 3 0 3 2 1 2 3</p></triangles></mesh></geometry></library_geometries>"
         "<library_visual_scenes><visual_scene id=\"s\"><node id=\"n\">"
         "<translate>0 0 500</translate><instance_geometry url=\"#g\"/></node></visual_scene>"
         "</library_visual_scenes><scene><instance_visual_scene url=\"#s\"/></scene></COLLADA>";
}

TEST(ReadMesh, DaeIsInItsUnitAndItsNodesPlaceButKeepsItsAxes) {
  for (const char* up : {"Z_UP", "Y_UP", "X_UP"}) {
    const MeshText mesh = ReadMeshBytes(Dae("<unit meter=\"0.001\" name=\"mm\"/>", up), ".dae");
    ASSERT_EQ(mesh.trouble, "") << up;
    const MassShape solid = SolidShape(mesh.surface);
    EXPECT_NEAR(solid.amount, 1.0 / 6.0, 1e-6) << up;
    EXPECT_TRUE(solid.p_cm.isApprox(Vec3(0.25, 0.25, 0.75), 1e-6)) << up << solid.p_cm.transpose();
  }
}

TEST(ReadMesh, WhatIsNotAMeshIsReported) {
  EXPECT_NE(ReadMeshBytes("solid", ".stl").trouble, "");
  EXPECT_NE(ReadMeshBytes("", ".obj").trouble, "");
  EXPECT_NE(ReadMeshBytes(std::string(200, '\xff'), ".stl").trouble, "");
  EXPECT_NE(ReadMeshBytes("<COLLADA/>", ".dae").trouble, "");
  EXPECT_TRUE(IsMeshFile("a/B.StL"));
  EXPECT_FALSE(IsMeshFile("a/b.blend"));
}

// Counts in a file's head that its bytes cannot hold are refused at once, whatever the format.
TEST(ReadMesh, CountsThatTheFileCannotHoldAreRefusedAtOnce) {
  const std::string xyz = "property float x\nproperty float y\nproperty float z\n";
  const std::string faces = "property list uchar int vertex_indices\n";
  const auto ply = [&](const char* format, const std::string& counts, const std::string& data) {
    return fmt::format("ply\nformat {} 1.0\n{}end_header\n{}", format, counts, data);
  };
  std::vector<std::pair<std::string, std::string>> files;
  for (const char* format : {"ascii", "binary_little_endian", "binary_big_endian"}) {
    for (const char* many : {"4000000000", "18446744073709551615"}) {
      files.emplace_back(".ply",
                         ply(format, fmt::format("element vertex {}\n", many) + xyz, "0 0 0"));
      files.emplace_back(".ply",
                         ply(format, fmt::format("element face {}\n", many) + faces, "3 0"));
      files.emplace_back(".ply", ply(format, fmt::format("element nothing {}\n", many), ""));
    }
    // The count of a list, among the data.
    const std::string list = "element face 1\nproperty list uint int vertex_indices\n";
    files.emplace_back(
        ".ply",
        ply(format, list, std::string(format) == "ascii" ? "4000000000 0 1" : "\x7f\xff\xff\xff "));
  }
  // A header that does not end, or that the library would read in another way.
  for (const char* damaged : {"end_head", "end_nan", "end_header2", ""}) {
    std::string file = ply("ascii", "element vertex 3\n" + xyz + "element face 1\n" + faces,
                           "0 0 0\n0 0 1\n0 1 0\n3 0 1 2\n");
    file.replace(file.find("end_header"), 10, damaged);
    files.emplace_back(".ply", file);
    files.emplace_back(".ply", "P" + file.substr(1));
  }
  files.emplace_back(".ply", ply("ascii", "element vertex\n" + xyz, "0 0 0\n"));
  files.emplace_back(".ply", ply("ascii", "element vertex 1\nproperty word x\n", "0\n"));
  files.emplace_back(".ply", "ply\n");
  files.emplace_back(".stl", std::string(80, 'x') + "\xff\xff\xff\xef" + std::string(50, '\0'));
  std::string dae = Dae("", "Z_UP");
  dae.replace(dae.find("count=\"12\""), 10, "count=\"4000000000\"");
  files.emplace_back(".dae", dae);
  for (const auto& [extension, bytes] : files) {
    const auto start = std::chrono::steady_clock::now();
    EXPECT_NE(ReadMeshBytes(bytes, extension).trouble, "") << extension << bytes.substr(0, 150);
    const std::chrono::duration<double> took = std::chrono::steady_clock::now() - start;
    EXPECT_LT(took.count(), 5.0) << extension << bytes.substr(0, 150);
  }
  // What holds its counts is read, in each way of writing it.
  const std::string counts = "element vertex 4\n" + xyz + "element face 4\n" + faces;
  const std::string text = "0 0 0\n1 0 0\n0 1 0\n0 0 1\n3 0 2 1\n3 0 1 3\n3 0 3 2\n3 1 2 3\n";
  EXPECT_NEAR(SolidShape(ReadMeshBytes(ply("ascii", counts, text), ".ply").surface).amount, 1.0 / 6,
              1e-6);
  std::string binary;
  const auto put = [&](const auto& value) {
    binary.append(reinterpret_cast<const char*>(&value), sizeof value);
  };
  for (const float x : {0.F, 0.F, 0.F, 1.F, 0.F, 0.F, 0.F, 1.F, 0.F, 0.F, 0.F, 1.F}) put(x);
  for (const auto& face : {std::array{0, 2, 1}, {0, 1, 3}, {0, 3, 2}, {1, 2, 3}}) {
    binary += '\3';
    for (const int index : face) put(index);
  }
  const MeshText solid = ReadMeshBytes(ply("binary_little_endian", counts, binary), ".ply");
  EXPECT_EQ(solid.trouble, "");
  EXPECT_NEAR(SolidShape(solid.surface).amount, 1.0 / 6, 1e-6);
}

// What a small file may ask for, in each format: without an end, with the square of its length, or
// more memory than it can need. The bounds are counts, so that no time is measured.
TEST(ReadMesh, SmallFilesThatAskForMuchAreRefused) {
  const test::TestFolder folder("read_mesh_much");
  const std::string text =
      "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float "
      "z\n"
      "element face 2\nproperty list uchar int vertex_indices\nend_header\n0 0 0\n1 0 0\n0 1 0\n";
  const std::string dae = Dae("", "Z_UP");
  const auto in_dae = [&](const std::string& from, const std::string& to) {
    std::string changed = dae;
    return changed.replace(changed.find(from), from.size(), to);
  };
  std::string polygon, corners;
  for (int k = 0; k < 16'000; ++k) {
    polygon += fmt::format("v {} {} 0\n", std::cos(k * 3.9e-4), std::sin(k * 3.9e-4));
    corners += fmt::format(" {}", k + 1);
  }
  // Each node has ten times the one below it.
  std::string nodes;
  for (int k = 0; k < 12; ++k) {
    nodes += fmt::format("<node id=\"x{}\">", k);
    for (int i = 0; i < 10; ++i) nodes += fmt::format("<instance_node url=\"#x{}\"/>", k + 1);
    nodes += "</node>";
  }
  nodes += "<node id=\"x12\"><instance_geometry url=\"#g\"/></node>";
  std::string laughs =
      in_dae("<library_visual_scenes>",
             "<library_nodes>" + nodes + "</library_nodes><library_visual_scenes>");
  const std::string placed = "0 0 500</translate><instance_geometry url=\"#g\"/>";
  laughs.replace(laughs.find(placed), placed.size(),
                 "0 0 500</translate><instance_node url=\"#x0\"/>");
  const std::vector<std::tuple<std::string, std::string, std::string>> files = {
      // A vertex is missing, and the library takes what follows for faces.
      {"list.ply", text + "3 0 1 2\n3000000000000 1 2 3\n", "promises more"},
      {"lines.ply", text + "0 1 1\n\n3 0 1 2\n3000000000000 1 2 3\n", "promises more"},
      {"polygon.ply", text + "0 0 1\n3 0 1 2\n20000" + corners + "\n", "promises"},
      {"word.dae", in_dae("<p>0 2 1", "<p>0 T 1"), "something else"},
      {"part.dae", in_dae("<p>0 2 1", "<p>0 0.999 1"), "something else"},
      {"data.dae", in_dae("<p>0 2 1", "<p><![CDATA[T]]>0 2 1"), "something else"},
      {"vcount.dae",
       in_dae("<triangles count=\"4\">", "<polylist count=\"4\"><vcount>3 a</vcount>"),
       "something else"},
      // Without a limit of memory the one of time ends it.
      {"nodes.dae", laughs, test::kSanitized ? "damaged|longer than" : "damaged|more memory"},
      {"polygon.obj", polygon + "f" + corners + "\n", "16000 corners"},
      {"index.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 2000000000\n", "damaged|not there"},
      {"count.stl", std::string(80, 'x') + "\xff\xff\xff\x7f" + std::string(100, '\0'), "damaged"}};
  for (const auto& [name, bytes, why] : files) {
    const MeshFile mesh = ReadMeshFiles({folder.Write(name, bytes)})[0];
    EXPECT_EQ(mesh.surface, nullptr) << name;
    EXPECT_THAT(mesh.trouble, testing::ContainsRegex(why)) << name;
    EXPECT_LT(bytes.size(), 800'000U) << name;
  }
}

// The library compares each name of an OBJ file with all others, and a part was looked for in all
// vertices: what does not make the surface is not read, and parts share one list.
TEST(ReadMesh, NamesOfObjFilesAreNotRead) {
  const test::TestFolder folder("read_mesh_names");
  std::string obj = "mtllib " + folder.Write("secret.mtl", "newmtl a\n") + "\n";
  for (int k = 0; k < 20'000; ++k) {
    obj += fmt::format(
        "o a{0}\ng b{0}\nusemtl c{0} \\\n d\nv 0 0 {0}\nv 1 0 {0}\nv 0 1 {0}\nf {1} {2} {3}\n", k,
        3 * k + 1, 3 * k + 2, 3 * k + 3);
  }
  const MeshText mesh = ReadMeshBytes(obj, ".obj");
  EXPECT_EQ(mesh.trouble, "");
  EXPECT_EQ(mesh.surface.triangles.size(), 20'000U);
  EXPECT_EQ(mesh.surface.vertices.size(), 60'000U);
  EXPECT_EQ(PartsOf(mesh.surface).size(), 20'000U);
  EXPECT_EQ(PartsOf(mesh.surface)[7].vertices.size(), 3U);
}

TEST(ReadMesh, FilesAreReadOnceAndAreInputs) {
  const test::TestFolder folder("read_mesh");
  const fs::path a = folder.Write("a.stl", ToStl(test::BoxMesh(1, 1, 1), ""));
  const fs::path b = folder.Write("b.stl", ToStl(test::BoxMesh(1, 1, 1), ""));
  const fs::path broken = folder.Write("c.stl", "nothing");
  const InputWatch inputs;
  const std::vector<MeshFile> files = ReadMeshFiles({a, b, broken, folder.PathOf("none.stl")});
  ASSERT_NE(files[0].surface, nullptr) << files[0].trouble;
  EXPECT_EQ(files[0].surface, files[1].surface);
  EXPECT_EQ(files[2].surface, nullptr);
  EXPECT_NE(files[2].trouble, "");
  EXPECT_EQ(files[3].trouble, "it cannot be read");
  EXPECT_EQ(ReadMeshFiles({b})[0].surface, files[0].surface);
  EXPECT_EQ(inputs.files().size(), 3U);
  // Other content under the same name is read anew.
  folder.Write("a.stl", ToStl(test::BoxMesh(2, 1, 1), ""));
  const auto changed = ReadMeshFiles({a})[0].surface;
  ASSERT_NE(changed, nullptr);
  EXPECT_NEAR(SolidShape(*changed).amount, 2.0, 1e-12);
}

TEST(ReadMesh, AMirroringScaleKeepsOutsideOutside) {
  const TriangleMesh mirrored = Scaled(test::BoxMesh(1, 2, 3), Vec3(-0.5, 1, 1));
  EXPECT_NEAR(PropertiesOf(mirrored).volume, 3.0, 1e-12);
  EXPECT_LT(PropertiesOf(mirrored).centroid.x(), 0.0);
}

class FindMeshFile : public testing::Test {
 protected:
  FindMeshFile() {
    folder_.Write("robot/meshes/arm.stl", "x");
    folder_.Write("outside.stl", "x");
    folder_.Write("ws/arm_description/meshes/arm.stl", "x");
    folder_.Write("prefix/share/leg_description/leg.stl", "x");
    unsetenv("ROS_PACKAGE_PATH");
    unsetenv("AMENT_PREFIX_PATH");
  }
  ~FindMeshFile() override {
    UseMeshPackages({});
    unsetenv("ROS_PACKAGE_PATH");
    unsetenv("AMENT_PREFIX_PATH");
  }
  [[nodiscard]] FoundMesh Find(const std::string& name) const {
    return FindMesh(name, folder_.PathOf("robot"));
  }
  test::TestFolder folder_{"find_mesh"};
};

TEST_F(FindMeshFile, LiesInTheFolderOfTheRobotOrBelow) {
  EXPECT_EQ(Find("meshes/arm.stl").path, folder_.PathOf("robot/meshes/arm.stl"));
  EXPECT_EQ(Find("file://" + folder_.PathOf("robot/meshes/arm.stl")).path,
            folder_.PathOf("robot/meshes/arm.stl"));
  EXPECT_EQ(Find("package:///meshes/arm.stl").path, folder_.PathOf("robot/meshes/arm.stl"));
  EXPECT_EQ(Find("meshes/none.stl").trouble, "is not there");
  EXPECT_EQ(Find("meshes").trouble, "is not there");
}

TEST_F(FindMeshFile, IsNotTakenFromOutsideUnlessThatIsAllowed) {
  for (const std::string& name :
       {std::string("../outside.stl"), folder_.PathOf("outside.stl"),
        "file://" + folder_.PathOf("outside.stl"), std::string("meshes/../../outside.stl")}) {
    EXPECT_TRUE(Find(name).outside) << name;
    EXPECT_TRUE(Find(name).path.empty()) << name;
  }
  fs::create_symlink(folder_.PathOf("outside.stl"), folder_.PathOf("robot/link.stl"));
  EXPECT_TRUE(Find("link.stl").outside);
  UseMeshPackages({{"any", folder_.PathOf("")}});
  EXPECT_EQ(Find("../outside.stl").path, folder_.PathOf("outside.stl"));
}

TEST_F(FindMeshFile, LiesInPackagesThatAreNamedOrListed) {
  const std::string arm = "package://arm_description/meshes/arm.stl";
  const std::string path = folder_.PathOf("ws/arm_description/meshes/arm.stl");
  EXPECT_EQ(Find(arm).trouble, "is not there");
  UseMeshPackages({{"arm_description", folder_.PathOf("ws/arm_description")}});
  EXPECT_EQ(Find(arm).path, path);
  UseMeshPackages({});
  for (const char* listed : {"ws", "ws/arm_description"}) {
    setenv("ROS_PACKAGE_PATH", ("/nowhere:" + folder_.PathOf(listed)).c_str(), 1);
    EXPECT_EQ(Find(arm).path, path) << listed;
  }
  setenv("AMENT_PREFIX_PATH", folder_.PathOf("prefix").c_str(), 1);
  EXPECT_EQ(Find("package://leg_description/leg.stl").path,
            folder_.PathOf("prefix/share/leg_description/leg.stl"));
  EXPECT_EQ(Find("package://arm_description/../../../outside.stl").path, "");
}

TEST_F(FindMeshFile, IsNamedRelativeToAFolderAbove) {
  EXPECT_EQ(PathSeenFrom(folder_.PathOf("robot"), folder_.PathOf("robot/meshes/arm.stl")),
            "meshes/arm.stl");
  EXPECT_EQ(PathSeenFrom(folder_.PathOf("robot"), folder_.PathOf("outside.stl")),
            folder_.PathOf("outside.stl"));
  EXPECT_EQ(PathSeenFrom("", "meshes/arm.stl"), "meshes/arm.stl");
}

}  // namespace
}  // namespace mbv
