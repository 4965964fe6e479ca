// Meshes in the generated MJCF: drawn where they are, without any effect on the motion.
#include <gtest/gtest.h>

#include "model_file/mesh/mass_properties.h"
#include "simulation/engine/engine_model.h"
#include "simulation/mjcf/mjcf.h"
#include "tests/mechanisms/simulated.h"
#include "tests/support/solids.h"

namespace mbv {
namespace {

using simulation::EngineSession;

Mechanism FourBarWithMesh(const TriangleMesh& surface) {
  Mechanism m = fixtures::MakeFourBar();
  const Mat3 R = Eigen::AngleAxisd(0.8, Vec3(1, 1, -2).normalized()).toRotationMatrix();
  const Mesh mesh{.X_BG = test::At(Vec3(0.1, 0.2, -0.3), R),
                  .file = "part.stl",
                  .surface = std::make_shared<const TriangleMesh>(surface)};
  m.bodies[1].shapes = {{mesh, "steel"}, {mesh, "steel"}};
  return m;
}

// Vertices of all mesh geoms in the world, as MuJoCo draws them.
std::vector<Vec3> DrawnVertices(const mjModel& m, const mjData& d) {
  std::vector<Vec3> vertices;
  for (int g = 0; g < m.ngeom; ++g) {
    if (m.geom_type[g] != mjGEOM_MESH) continue;
    const Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>> R(d.geom_xmat + 9L * g);
    const Eigen::Map<const Vec3> p(d.geom_xpos + 3L * g);
    const int id = m.geom_dataid[g];
    for (int v = m.mesh_vertadr[id]; v < m.mesh_vertadr[id] + m.mesh_vertnum[id]; ++v) {
      const Eigen::Map<const Eigen::Vector3f> q(m.mesh_vert + 3L * v);
      vertices.push_back(p + R * q.cast<double>());
    }
  }
  return vertices;
}

TEST(MjcfMeshes, AreDrawnWhereTheyAre) {
  const TriangleMesh bracket = test::BracketMesh(0.2, 0.12, 0.03, 0.06);
  const Mechanism m = FourBarWithMesh(bracket);
  std::vector<std::string> warnings;
  const EngineSession session(&warnings);
  const std::string text = WriteMjcf(m);
  const simulation::ModelHandle model = simulation::CompileMjcf(text);
  const simulation::DataHandle data = simulation::MakeData(*model);
  mj_kinematics(model.get(), data.get());
  const std::vector<Vec3> drawn = DrawnVertices(*model, *data);
  ASSERT_EQ(drawn.size(), 2 * bracket.vertices.size());  // one asset, shown twice
  EXPECT_EQ(model->nmesh, 1);
  const Pose X_WG = m.X_WB_home[1] * std::get<Mesh>(m.bodies[1].shapes[0].geometry).X_BG;
  // Vertices have seven digits, and are kept in single precision.
  for (size_t v = 0; v < bracket.vertices.size(); ++v) {
    EXPECT_LT((drawn[v] - X_WG * bracket.vertices[v]).norm(), 2e-6) << v;
  }
  EXPECT_TRUE(warnings.empty()) << warnings.front();
}

TEST(MjcfMeshes, HaveNoMassAndTouchNothing) {
  const Mechanism m = FourBarWithMesh(test::BracketMesh(0.2, 0.12, 0.03, 0.06));
  const EngineSession session(nullptr);
  const simulation::ModelHandle with = simulation::CompileMjcf(WriteMjcf(m));
  const simulation::ModelHandle without =
      simulation::CompileMjcf(WriteMjcf(m, {.pictures = false}));
  EXPECT_EQ(without->nmesh, 0);
  ASSERT_EQ(with->nbody, without->nbody);
  for (int i = 0; i < with->nbody; ++i) EXPECT_EQ(with->body_mass[i], without->body_mass[i]);
  for (int i = 0; i < 3 * with->nbody; ++i) {
    EXPECT_EQ(with->body_inertia[i], without->body_inertia[i]);
    EXPECT_EQ(with->body_ipos[i], without->body_ipos[i]);
  }
  for (int g = 0; g < with->ngeom; ++g) {
    EXPECT_EQ(with->geom_contype[g], 0);
    EXPECT_EQ(with->geom_conaffinity[g], 0);
  }
}

TEST(MjcfMeshes, LargeFlatAndOpenOnesCompile) {
  TriangleMesh open = test::BoxMesh(1, 1, 1);
  open.triangles.resize(3);
  const TriangleMesh ball = test::EllipsoidMesh(Vec3(1, 2, 3), 200);
  ASSERT_GT(ball.triangles.size(), 150000U);
  const TriangleMesh flat{{Vec3(0, 0, 0), Vec3(1, 0, 0), Vec3(0, 1, 0), Vec3(1, 1, 0)},
                          {{0, 1, 2}, {2, 1, 3}}};
  const TriangleMesh one{{Vec3(0, 0, 0), Vec3(1, 0, 0), Vec3(0, 1, 0)}, {{0, 1, 2}}};
  const EngineSession session(nullptr);
  for (const TriangleMesh& surface : {open, ball, flat, one, TriangleMesh{}}) {
    const simulation::ModelHandle model =
        simulation::CompileMjcf(WriteMjcf(FourBarWithMesh(surface)));
    EXPECT_LE(model->nmeshface, 20000);
    EXPECT_EQ(model->nmesh, surface.vertices.size() >= 4 ? 1 : 0);
  }
}

}  // namespace
}  // namespace mbv
