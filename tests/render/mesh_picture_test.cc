// Meshes in pictures: where they are, in whatever frame the renderer keeps them.
#include <gtest/gtest.h>

#include "render/scene.h"
#include "tests/mechanisms/rendered.h"
#include "tests/support/solids.h"

namespace mbv {
namespace {

using test::BallOnLeg;
using test::Quick;

// Share of pixels that differ visibly.
double Difference(const Picture& a, const Picture& b) {
  if (a.rgb.size() != b.rgb.size()) return 1.0;
  size_t different = 0;
  for (size_t i = 0; i < a.rgb.size(); i += 3) {
    int most = 0;
    for (size_t k = i; k < i + 3; ++k) most = std::max(most, std::abs(a.rgb[k] - b.rgb[k]));
    if (most > 40) ++different;
  }
  return 3.0 * static_cast<double>(different) / static_cast<double>(a.rgb.size());
}

// The ball as a mesh whose file has its frame elsewhere, turned.
Mechanism MeshOnLeg(const Vec3& shift = Vec3::Zero()) {
  Mechanism m = BallOnLeg();
  const Mat3 R = Eigen::AngleAxisd(1.1, Vec3(1, -2, 0.5).normalized()).toRotationMatrix();
  const Pose X_BG = test::At(Vec3(0.3, -0.2, 0.4), R);
  const TriangleMesh ball =
      test::Moved(test::EllipsoidMesh(Vec3(0.1, 0.1, 0.1)), X_BG.inverse() * test::At(shift));
  m.bodies[1].shapes[0].geometry =
      Mesh{.X_BG = X_BG, .file = "ball.stl", .surface = std::make_shared<const TriangleMesh>(ball)};
  return m;
}

TEST(MeshPictures, ShowAMeshOfABallWhereTheBallWouldBe) {
  PictureOptions options = Quick();
  options.joints = options.closures = options.output_frames = false;
  options.camera = {
      .azimuth_deg = -60.0, .elevation_deg = 16.0, .distance_m = 1.2, .lookat_W = Vec3(0, 0, 1)};
  const Picture ball = test::DrawnPicture(BallOnLeg(), options);
  // Outlines and facets differ in some pixels.
  EXPECT_LT(Difference(ball, test::DrawnPicture(MeshOnLeg(), options)), 0.005);
  EXPECT_GT(Difference(ball, test::DrawnPicture(MeshOnLeg(Vec3(0, 0.05, 0)), options)), 0.02);
}

TEST(MeshPictures, AreFittedToMeshes) {
  const Mechanism m = MeshOnLeg();
  const render::Scale scale = render::ScaleOf(m, {HomeFrame(m)});
  PictureOptions options = Quick();
  options.joints = options.closures = options.output_frames = options.drive_forces = false;
  bool found = false;
  for (const render::Item& item : MechanismItems(m, HomeFrame(m), scale, options)) {
    if (item.solid != render::Solid::kMesh) continue;
    found = true;
    Eigen::AlignedBox3d box;
    for (const Vec3& p : Corners(item)) box.extend(p);
    // The file's axes are turned: the box around the turned box is larger than the ball.
    EXPECT_TRUE(box.contains(Vec3(0.099, 0, 1)) && box.contains(Vec3(0, 0, 0.901)));
    EXPECT_LT(box.sizes().maxCoeff(), 0.2 * std::sqrt(3.0) + 1e-9);
    EXPECT_LT((box.center() - Vec3(0, 0, 1)).norm(), 1e-3);
  }
  EXPECT_TRUE(found);
}

TEST(MeshPictures, TakeFlatAndOpenMeshes) {
  Mechanism m = MeshOnLeg();
  auto& mesh = std::get<Mesh>(m.bodies[1].shapes[0].geometry);
  for (TriangleMesh surface :
       {TriangleMesh{{Vec3(0, 0, 0), Vec3(1, 0, 0), Vec3(0, 1, 0)}, {{0, 1, 2}}},
        TriangleMesh{{Vec3(0, 0, 0), Vec3(1, 0, 0), Vec3(2, 0, 0)}, {{0, 1, 2}}}}) {
    mesh.surface = std::make_shared<const TriangleMesh>(surface);
    (void)test::DrawnPicture(m, Quick());
  }
}

}  // namespace
}  // namespace mbv
