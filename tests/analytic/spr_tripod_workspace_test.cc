// The 3-SPR mechanism's workspace: meshes of known solids, tabulated measures, independent methods.
#include "analytic/spr_tripod/workspace.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <numbers>
#include <regex>

#include "math/spatial.h"

namespace mbv::spr_tripod {
namespace {

using std::numbers::pi;

constexpr double kDegWorkspace = pi / 180.0;
constexpr double kVolume = 0.01243676143457;  // m³
constexpr double kVolumeDigit = 5e-15;        // half of its last one

TriangleMesh UnitTetrahedron() {
  return {{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}},
          {{0, 2, 1}, {0, 1, 3}, {0, 3, 2}, {1, 2, 3}}};
}

WorkspaceOptions Coarse(std::vector<int> mesh_intervals, int voxels) {
  WorkspaceOptions options;
  options.mesh_intervals = std::move(mesh_intervals);
  options.voxels = voxels;
  options.section_azimuths = 12;
  return options;
}

TEST(TriangleMesh, TetrahedronHasItsVolumeAreaAndCentroid) {
  const TriangleMesh mesh = UnitTetrahedron();
  ASSERT_TRUE(IsClosed(mesh));
  const SolidProperties p = PropertiesOf(mesh);
  EXPECT_NEAR(p.volume, 1.0 / 6, kEps);
  EXPECT_NEAR(p.area, 1.5 + std::sqrt(3.0) / 2, 4 * kEps);
  EXPECT_LT((p.centroid - Vec3::Constant(0.25)).norm(), 2 * kEps);
}

TEST(TriangleMesh, HolesAndFlippedTrianglesAreNotClosed) {
  TriangleMesh mesh = UnitTetrahedron();
  std::swap(mesh.triangles[1][0], mesh.triangles[1][1]);
  EXPECT_FALSE(IsClosed(mesh));
  mesh = UnitTetrahedron();
  mesh.triangles.pop_back();
  EXPECT_FALSE(IsClosed(mesh));
  EXPECT_FALSE(IsClosed({}));
}

TEST(TriangleMesh, FilesHaveTheirFormatsLayout) {
  const TriangleMesh mesh = UnitTetrahedron();
  const std::string stl = ToStl(mesh, "tetrahedron");
  ASSERT_EQ(stl.size(), 84u + 50u * 4);
  EXPECT_EQ(stl.substr(0, 11), "tetrahedron");
  EXPECT_EQ(static_cast<int>(stl[80]), 4);
  float normal[3];
  std::memcpy(normal, stl.data() + 84, sizeof normal);
  EXPECT_EQ(normal[2], -1.0f);  // the first triangle lies in z = 0
  const std::string ply = ToPly(mesh, "tetrahedron");
  EXPECT_EQ(ply.substr(0, 4), "ply\n");
  EXPECT_NE(ply.find("element vertex 4\n"), std::string::npos);
  EXPECT_NE(ply.find("\n3 1 2 3\n"), std::string::npos);
}

TEST(SprTripodWorkspace, CornersMatchTabulatedPositionsAndTilts) {
  const double c = 0.5, l = 0.75;
  struct Row {
    PerLeg<double> q;
    Vec3 r;
    double tilt_deg;
  };
  for (const Row& row : {Row{{c, c, c}, {0, 0, 0.435861216}, 0},
                         Row{{c, c, l}, {-0.208686034, 0, 0.491301623}, 25.369519},
                         Row{{c, l, c}, {0.104343017, 0.180727407, 0.491301623}, 25.369519},
                         Row{{l, c, c}, {0.104343017, -0.180727407, 0.491301623}, 25.369519},
                         Row{{l, l, c}, {0.243485992, 0, 0.576544400}, 21.452270},
                         Row{{c, l, l}, {-0.121742996, 0.210865054, 0.576544400}, 21.452270},
                         Row{{l, c, l}, {-0.121742996, -0.210865054, 0.576544400}, 21.452270},
                         Row{{l, l, l}, {0, 0, 0.708854710}, 0}}) {
    Posture p;
    ASSERT_TRUE(SolveForward(PaperGeometry(), row.q, &p).ok());
    EXPECT_LT((p.r - row.r).cwiseAbs().maxCoeff(), 6e-10) << p.r.transpose();
    EXPECT_NEAR(p.tilt.Angle() / kDegWorkspace, row.tilt_deg, 6e-7);
  }
}

TEST(SprTripodWorkspace, VolumeIsTheSameByFacesAndByInteriorAtEveryOrder) {
  const Geometry g = PaperGeometry();
  for (int n : {8, 16, 32}) EXPECT_NEAR(IntegrateFaces(g, n).solid.volume, kVolume, 1e-14) << n;
  for (int n : {6, 10, 16}) EXPECT_NEAR(VolumeByInterior(g, n), kVolume, 1e-12) << n;
  // A stroke 10 µm longer is seen: 0.065 m² · 3 · 10 µm is 1e-6 of the volume.
  Geometry longer = g;
  longer.q_max += 1e-5;
  EXPECT_GT(VolumeByInterior(longer, 10) - kVolume, 1e-6 * kVolume);
}

TEST(SprTripodWorkspace, FacesHaveTheTabulatedAreasAndCentroid) {
  const FaceIntegrals f = IntegrateFaces(PaperGeometry(), 16);
  for (int leg = 0; leg < 3; ++leg) {
    EXPECT_NEAR(f.face_area[2 * leg], 0.052099321, 6e-10);
    EXPECT_NEAR(f.face_area[2 * leg + 1], 0.064872147, 6e-10);
  }
  EXPECT_NEAR(f.solid.area, 0.350914404, 3e-9);  // a sum of six rounded numbers
  EXPECT_LT((f.solid.centroid - Vec3(0, 0, 0.570061813)).cwiseAbs().maxCoeff(), 6e-10);
}

TEST(SprTripodWorkspace, TriangulatedVolumesMatchTabulatedOnesAndConvergeQuadratically) {
  const Geometry g = PaperGeometry();
  double previous = kNan;
  for (const auto& [intervals, tabulated] :
       {std::pair{5, 0.012420032}, {10, 0.012432581}, {25, 0.012436093}, {50, 0.012436594}}) {
    const WorkspaceMesh faces = TriangulateFaces(g, intervals);
    ASSERT_TRUE(faces.summary.ok());
    EXPECT_TRUE(IsClosed(faces.mesh));
    EXPECT_EQ(faces.mesh.triangles.size(), 12u * intervals * intervals);
    EXPECT_EQ(faces.mesh.vertices.size(), 6u * intervals * intervals + 2);  // Euler's formula
    const double volume = PropertiesOf(faces.mesh).volume;
    EXPECT_NEAR(volume, tabulated, 6e-10);
    const double step = 0.25 / intervals;
    EXPECT_NEAR((volume - kVolume) / (step * step), -6.7e-3, 0.05e-3);
    previous = volume;
  }
  EXPECT_LT(std::abs(previous - kVolume), 2e-7);
}

TEST(SprTripodWorkspace, MeshFaceAreasAddUp) {
  const WorkspaceMesh faces = TriangulateFaces(PaperGeometry(), 25);
  double sum = 0.0;
  for (int face = 0; face < kFaces; ++face) {
    sum += faces.FaceArea(face);
    EXPECT_NEAR(faces.FaceArea(face), face % 2 ? 0.064872147 : 0.052099321, 1e-5);
  }
  EXPECT_NEAR(sum, PropertiesOf(faces.mesh).area, 1e-12);
}

TEST(SprTripodWorkspace, VoxelCountsMatchTabulatedOnes) {
  const Geometry g = PaperGeometry();
  EXPECT_NEAR(CountVoxels(g, 40).volume, 0.01244772, 6e-9);
  EXPECT_NEAR(CountVoxels(g, 80).volume, 0.01244285, 6e-9);
}

TEST(SprTripodWorkspace, SectionLimitsMatchTabulatedOnes) {
  struct Row {
    double z, x_min, x_max, y;
  };
  const Geometry g = PaperGeometry();
  for (const Row& row :
       {Row{0.45, -0.02943, 0.01414, 0.01639}, Row{0.50, -0.20383, 0.07555, 0.09005},
        Row{0.54, -0.17845, 0.14420, 0.18301}, Row{0.57, -0.15595, 0.22041, 0.17473},
        Row{0.60, -0.13016, 0.21322, 0.14619}, Row{0.66, -0.06691, 0.11693, 0.07590},
        Row{0.69, -0.02787, 0.05202, 0.03191}}) {
    const AxialLimits along_x = AxialSection(g, 0.0, {row.z})[0];
    const AxialLimits along_y = AxialSection(g, pi / 2, {row.z})[0];
    EXPECT_NEAR(along_x.rho_min, row.x_min, 6e-6) << row.z;
    EXPECT_NEAR(along_x.rho_max, row.x_max, 6e-6) << row.z;
    EXPECT_NEAR(along_y.rho_min, -row.y, 6e-6) << row.z;
    EXPECT_NEAR(along_y.rho_max, row.y, 6e-6) << row.z;
  }
  EXPECT_TRUE(std::isnan(ReachAt(g, 0.43, 0.0)));
}

TEST(SprTripodWorkspace, SectionsStackUpToTheVolume) {
  // Shares the inverse position with nothing above but the voxels; trapezoid over azimuth (kinks at
  // the cube's edges) and midpoint over height leave about 1e-3.
  const Geometry g = PaperGeometry();
  const double z_low = 0.435861216, z_high = 0.708854710;
  constexpr int kHeights = 100, kAzimuths = 144;
  double volume = 0.0;
  for (int k = 0; k < kHeights; ++k) {
    const double z = z_low + (z_high - z_low) * (k + 0.5) / kHeights;
    for (const Vec3& p : HorizontalSection(g, z, kAzimuths)) {
      volume += 0.5 * p.head<2>().squaredNorm() * 2 * pi / kAzimuths;
    }
  }
  volume *= (z_high - z_low) / kHeights;
  EXPECT_NEAR(volume / kVolume, 1.0, 2e-3);
}

TEST(SprTripodWorkspace, HorizontalSectionsAreThreefoldAndMirrorSymmetric) {
  const Geometry g = PaperGeometry();
  for (double azimuth : {0.1, 0.7}) {
    const double reach = ReachAt(g, 0.55, azimuth);
    EXPECT_NEAR(ReachAt(g, 0.55, azimuth + 2 * pi / 3), reach, 1e-12);
    EXPECT_NEAR(ReachAt(g, 0.55, -azimuth), reach, 1e-12);
    EXPECT_GT(std::abs(ReachAt(g, 0.55, azimuth + pi / 3) - reach), 1e-3);
  }
}

TEST(SprTripodWorkspace, VolumeScalesWithTheCubeOfTheSize) {
  Geometry twice = PaperGeometry(0.42, 0.91);
  twice.q_min = 1.0;
  twice.q_max = 1.5;
  EXPECT_NEAR(VolumeByInterior(twice, 8) / (8 * kVolume), 1.0, 1e-10);
}

TEST(SprTripodWorkspace, RangesMatchTabulatedExtremes) {
  const WorkspaceRanges r = RangesOf(PaperGeometry(), 10);
  const auto expect = [](const Range& range, double lower, double upper, double tolerance) {
    EXPECT_NEAR(range.lower, lower, tolerance);
    EXPECT_NEAR(range.upper, upper, tolerance);
  };
  expect(r.x, -0.2087, 0.2435, 1e-4);
  expect(r.y, -0.2109, 0.2109, 1e-4);
  expect(r.z, 0.43586, 0.70885, 1e-5);
  expect(r.det, 0.903750, 1.875482, 1e-6);
  EXPECT_NEAR(r.sigma.lower, 0.743, 1e-3);
  expect(r.cond, 1.35, 2.20, 0.01);
  expect(r.det_c, 0.224574, 0.593988, 1e-6);
  EXPECT_NEAR(r.cond_c.upper, 1.551, 1e-3);
  // At home poses (12) has singular values z √1.5 (twice) and b √3: condition 1 at z = b √2.
  EXPECT_GE(r.cond_c.lower, 1.0);
  EXPECT_LT(r.cond_c.lower, 1.02);
  EXPECT_NEAR(r.ball_swing.upper / kDegWorkspace, 21.24, 0.01);
  EXPECT_NEAR(r.ball_twist.upper / kDegWorkspace, 9.80, 0.01);
  EXPECT_NEAR(r.ball_twist.lower / kDegWorkspace, -9.80, 0.01);
  expect({r.lean.lower / kDegWorkspace, r.lean.upper / kDegWorkspace}, -9.26, 6.26, 0.01);
}

TEST(SprTripodWorkspace, ReportNamesVolumeOrderAndSections) {
  const WorkspaceReport report = ReportWorkspace(PaperGeometry(), Coarse({5, 10, 20}, 40));
  ASSERT_TRUE(report.summary.ok());
  EXPECT_NEAR(report.exact.volume, kVolume, 1e-14);
  ASSERT_EQ(report.volumes.size(), 4u);
  for (const VolumeEstimate& v : report.volumes) {
    EXPECT_LE(std::abs(v.value - kVolume), v.error + kVolumeDigit) << v.way;
    EXPECT_LT(v.error, 2e-2 * kVolume) << v.way;
  }
  EXPECT_TRUE(report.contradictions.empty()) << report.text;
  EXPECT_NE(report.text.find("AGREE: 4 ways"), std::string::npos) << report.text;
  EXPECT_NEAR(report.convergence_order, 2.0, 0.01);
  EXPECT_NE(report.text.find("0.01243676143457"), std::string::npos) << report.text;
  EXPECT_EQ(report.faces.intervals, 20);
  EXPECT_EQ(std::count(report.sections_csv.begin(), report.sections_csv.end(), '\n'),
            1 + 12 * static_cast<int>(report.heights.size()));
}

// Below z = b/2 several upright assemblies share a position; only the one that the legs' lengths
// lead to from the untilted pose counts.
TEST(SprTripodWorkspace, StrokesThatReachBelowHalfTheBaseAreCountedWhole) {
  Geometry low = PaperGeometry();
  low.q_min = 0.30;
  low.q_max = 0.40;
  const WorkspaceReport report = ReportWorkspace(low, Coarse({5, 10, 20}, 40));
  ASSERT_TRUE(report.summary.ok()) << report.summary.message;
  EXPECT_LT(AxisRange(low).lower, 0.5 * low.b);
  EXPECT_TRUE(report.contradictions.empty()) << report.text;
  EXPECT_NEAR(report.volumes.back().value / report.exact.volume, 1.0, 0.02) << report.text;
}

TEST(SprTripodWorkspace, TwoWaysThatDifferAreAContradiction) {
  WorkspaceReport report;
  report.volumes = {
      {"smooth faces", 1.0, 1e-9}, {"mesh", 1.0 - 1e-4, 2e-4}, {"voxels", 0.29, 0.01}};
  report.mesh_error = -1e-4;
  report.convergence_order = 2.01;
  const Range regular{0.9, 1.9};
  std::vector<std::string> found = Contradictions(report, regular);
  ASSERT_EQ(found.size(), 1u);
  EXPECT_EQ(found[0], "the volume by voxels is 71 % smaller than that by smooth faces");
  report.volumes[2].value = 0.995;
  EXPECT_TRUE(Contradictions(report, regular).empty());
  report.convergence_order = 0.47;
  EXPECT_EQ(Contradictions(report, regular).size(), 1u);
  report.convergence_order = kNan;  // what the meshes are off by cannot be reported
  EXPECT_TRUE(Contradictions(report, regular).empty());
  EXPECT_EQ(Contradictions(report, {-0.1, 1.9}).size(), 1u);
  report.volumes[1].value = kNan;
  EXPECT_EQ(Contradictions(report, regular).size(), 1u);
}

// Legs that come near to where the faces fold: these are integrated worse than the meshes are.
TEST(SprTripodWorkspace, AnOrderThatTheFacesCannotShowIsNotStated) {
  Geometry wide = PaperGeometry(0.4, 0.455);
  wide.q_min = 0.30;
  wide.q_max = 0.75;
  const WorkspaceReport report = ReportWorkspace(wide, Coarse({25, 50}, 0));
  ASSERT_TRUE(report.summary.ok()) << report.summary.message;
  EXPECT_GT(report.volumes.front().error, std::abs(report.mesh_error));
  EXPECT_TRUE(std::isnan(report.convergence_order)) << report.convergence_order;
  EXPECT_NE(report.text.find("order of convergence not measurable"), std::string::npos);
  EXPECT_TRUE(report.contradictions.empty()) << report.text;
}

TEST(SprTripodWorkspace, DigitsFollowTheErrorAndSectionsTheDimensions) {
  Geometry twice = PaperGeometry(0.42, 0.91);
  twice.q_min = 1.0;
  twice.q_max = 1.5;
  const WorkspaceReport report = ReportWorkspace(twice, Coarse({5, 10}, 20));
  ASSERT_TRUE(report.summary.ok());
  EXPECT_TRUE(report.contradictions.empty()) << report.text;
  EXPECT_EQ(report.text.find("nan"), std::string::npos) << report.text;
  ASSERT_GE(report.heights.size(), 4u);
  for (const double z : report.heights) EXPECT_TRUE(IsReachable(twice, {0, 0, z})) << z;
  // Twenty voxels along a side know two digits and print no more than three.
  const size_t at = report.text.find("volume by voxels");
  ASSERT_NE(at, std::string::npos);
  const std::string line = report.text.substr(at, report.text.find('\n', at) - at);
  EXPECT_NE(line.find(" m3 (error "), std::string::npos) << line;
  EXPECT_LT(line.find(" m3") - line.find("0."), 6u) << line;
}

// Every number after `key` of the report's text with its decimals.
std::vector<std::pair<double, int>> NumbersAfter(const std::string& text, const std::string& key) {
  std::vector<std::pair<double, int>> numbers;
  const size_t at = text.find(key);
  if (at == std::string::npos) return numbers;
  const std::string line =
      text.substr(at + key.size(), text.find('\n', at + key.size()) - at - key.size());
  const std::regex number(R"([-+]?\d+(\.(\d+))?(?![\de.]))");
  for (std::sregex_iterator it(line.begin(), line.end(), number), end; it != end; ++it) {
    numbers.emplace_back(std::stod(it->str()), static_cast<int>((*it)[2].length()));
  }
  return numbers;
}

// The last digit of areas and centroid is right to two units, also where the faces nearly fold and
// the rule converges slowly.
TEST(SprTripodWorkspace, NoDigitOfAreaAndCentroidIsWrong) {
  for (const auto& [a, b, q_min, q_max] :
       {std::array{0.21, 0.455, 0.5, 0.75}, std::array{0.4, 0.455, 0.30, 0.75},
        std::array{0.21, 0.455, 0.30, 0.75}, std::array{0.42, 0.91, 1.0, 1.5}}) {
    Geometry g = PaperGeometry(a, b);
    g.q_min = q_min;
    g.q_max = q_max;
    const FaceIntegrals truth = IntegrateFaces(g, 80);
    const WorkspaceReport report = ReportWorkspace(g, Coarse({5}, 0));
    ASSERT_TRUE(report.summary.ok()) << report.summary.message;
    const auto expect = [&](const std::pair<double, int>& shown, double exact) {
      EXPECT_LE(std::abs(shown.first - exact), 2.0 * std::pow(10.0, -shown.second))
          << shown.first << " " << exact << "\n"
          << report.text;
    };
    const auto area = NumbersAfter(report.text, "\narea ");
    ASSERT_GE(area.size(), 1u + kFaces) << report.text;
    expect(area[0], truth.solid.area);
    for (size_t k = 0; k < kFaces; ++k) {
      expect(area[area.size() - kFaces + k], truth.face_area[k]);
    }
    const auto centroid = NumbersAfter(report.text, "centroid (");
    ASSERT_GE(centroid.size(), 3u);
    for (int k = 0; k < 3; ++k) expect(centroid[static_cast<size_t>(k)], truth.solid.centroid[k]);
    EXPECT_LE(std::abs(report.exact.area - truth.solid.area), report.area_error);
    EXPECT_LE((report.exact.centroid - truth.solid.centroid).norm(), report.centroid_error);
    // Extremes: against a grid that is four times finer.
    const WorkspaceRanges fine = RangesOf(g, 80);
    const auto range = [&](const std::string& key, const Range& exact, double unit) {
      const auto shown = NumbersAfter(report.text, "\n" + key);
      ASSERT_EQ(shown.size(), 2u) << key << report.text;
      expect(shown[0], exact.lower / unit);
      expect(shown[1], exact.upper / unit);
    };
    range("x_m", fine.x, 1.0);
    range("y_m", fine.y, 1.0);
    range("z_m", fine.z, 1.0);
    range("tilt_deg", fine.tilt, kDegWorkspace);
    range("det J", fine.det, 1.0);
    range("singular values of J", fine.sigma, 1.0);
    range("condition of J", fine.cond, 1.0);
    range("condition of (12)", fine.cond_c, 1.0);
    range("ball swing_deg", fine.ball_swing, kDegWorkspace);
    range("ball twist_deg", fine.ball_twist, kDegWorkspace);
    range("change of lean_deg", fine.lean, kDegWorkspace);
  }
}

TEST(SprTripodWorkspace, LegsThatNeverMeetGiveAReasonInsteadOfANumber) {
  Geometry far = PaperGeometry(0.1, 2.0);
  const WorkspaceReport report = ReportWorkspace(far, {.mesh_intervals = {5}, .voxels = 0});
  EXPECT_FALSE(report.summary.ok());
  EXPECT_TRUE(std::isnan(report.exact.volume));
  EXPECT_NE(report.text.find("no workspace"), std::string::npos);
}

}  // namespace
}  // namespace mbv::spr_tripod
