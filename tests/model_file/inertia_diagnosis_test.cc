// Six small parts with stated inertias, right or wrong in one way each: every mistake is named, and
// sound parts get no finding, not even with the differences of meshing and rounding.
#include "model_file/mesh/inertia_diagnosis.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <random>

#include "mechanism/reach.h"
#include "tests/support/solids.h"

namespace mbv {
namespace {

using test::At;
using test::Moved;
using test::SoundBody;
using testing::ElementsAre;

constexpr double kSteel = 7850.0, kAluminium = 2700.0;

Mat3 Turned() { return Eigen::AngleAxisd(0.6, Vec3(1, 2, -0.5).normalized()).toRotationMatrix(); }

// Away from the body's origin, as links are; the file's frame lies in the body's.
Body BoxPart() {
  return SoundBody(Moved(test::BoxMesh(0.30, 0.06, 0.04), At(Vec3(0.02, 0.03, 0.01))), kSteel);
}
// Products of inertia in one plane.
Body BracketPart() {
  return SoundBody(Moved(test::BracketMesh(0.2, 0.12, 0.03, 0.08), At(Vec3(0.05, 0.02, -0.04))),
                   kAluminium);
}
// All three products; its file is turned against the body.
Body TurnedBracketPart() {
  return SoundBody(test::BracketMesh(0.2, 0.12, 0.03, 0.06), kAluminium,
                   At(Vec3(0.05, 0.02, 0.08), Turned()));
}
Body CylinderPart() {
  return SoundBody(Moved(test::CylinderMesh(0.03, 0.2), At(Vec3(0, 0, 0.02))), kSteel);
}
Body EllipsoidPart() {
  return SoundBody(Moved(test::EllipsoidMesh(Vec3(0.15, 0.1, 0.06)), At(Vec3(0.1, -0.05, 0.02))),
                   1050.0);
}
Body TubePart() {
  return SoundBody(Moved(test::TubeMesh(0.04, 0.032, 0.25), At(Vec3(0.03, 0.06, 0))), kAluminium);
}

std::vector<Body> SoundParts() {
  return {BoxPart(),      BracketPart(),   TurnedBracketPart(),
          CylinderPart(), EllipsoidPart(), TubePart()};
}

std::vector<InertiaMistake> MistakesOf(const Body& body) {
  std::vector<InertiaMistake> mistakes;
  for (const InertiaFinding& finding : DiagnoseInertia(body).findings) {
    mistakes.push_back(finding.mistake);
  }
  return mistakes;
}

std::string TextOf(const Body& body) {
  std::string text;
  for (const InertiaFinding& finding : DiagnoseInertia(body).findings) {
    text += std::string(WordOf(finding.mistake)) + ": " + finding.text + "\n";
  }
  return text;
}

// The tensor that a mistake makes of the right one.
template <typename Change>
Body With(Body body, const Change& change) {
  change(&body);
  return body;
}
void AddSteiner(double times, Body* body) {
  body->I_Bcm_B += times * body->mass * PointInertia(body->p_BoBcm_B);
}

TEST(InertiaDiagnosis, FindsNothingOnSoundParts) {
  for (const Body& part : SoundParts()) {
    const BodyInertia result = DiagnoseInertia(part);
    EXPECT_TRUE(result.findings.empty()) << TextOf(part);
    EXPECT_LT(result.tensor_off, 1e-12);
    EXPECT_LT(result.centre_off, 1e-12);
  }
  EXPECT_NEAR(DiagnoseInertia(BoxPart()).density, kSteel, 1e-6);
}

TEST(InertiaDiagnosis, AMeshWithoutMassIsAFinding) {
  for (Body part : SoundParts()) {
    part.mass = 0.0;
    part.I_Bcm_B.setZero();
    EXPECT_EQ(MistakesOf(part), std::vector{InertiaMistake::kNoMass}) << TextOf(part);
  }
}

// Every number is 3 % off, in either direction: rounded, meshed coarsely, with screws or without.
TEST(InertiaDiagnosis, FindsNothingInDifferencesOfRoundingAndMeshing) {
  std::mt19937_64 random(2026);
  std::uniform_real_distribution<double> share(-0.03, 0.03);
  for (int round = 0; round < 20; ++round) {
    for (Body part : SoundParts()) {
      part.mass *= 1.0 + share(random);
      for (int k = 0; k < 3; ++k) part.p_BoBcm_B[k] *= 1.0 + share(random);
      Mat3 off;
      for (int i = 0; i < 3; ++i) {
        for (int j = i; j < 3; ++j) off(i, j) = off(j, i) = 1.0 + share(random);
      }
      part.I_Bcm_B = part.I_Bcm_B.cwiseProduct(off);
      // A slender part lies on the bound of what is possible, and rounding may cross it.
      std::vector<InertiaMistake> mistakes = MistakesOf(part);
      if (!TriangleViolation(part).empty()) {
        std::erase(mistakes, InertiaMistake::kImpossibleTensor);
      }
      EXPECT_TRUE(mistakes.empty()) << round << " " << TextOf(part);
    }
  }
}

// The limit reports: half of it passes, twice fails.
TEST(InertiaDiagnosis, ADifferenceOfTwiceTheLimitIsFound) {
  const auto perturbed = [](double times) {
    return With(BoxPart(), [&](Body* b) {
      b->I_Bcm_B(0, 1) += times * kInertiaLimit * b->I_Bcm_B.norm() / std::sqrt(2.0);
      b->I_Bcm_B(1, 0) = b->I_Bcm_B(0, 1);
    });
  };
  EXPECT_TRUE(MistakesOf(perturbed(0.5)).empty());
  EXPECT_FALSE(MistakesOf(perturbed(2.0)).empty());
  const auto shifted = [](double times) {
    return With(BoxPart(), [&](Body* b) {
      b->p_BoBcm_B.x() += times * kInertiaLimit * DiagnoseInertia(*b).r_m;
    });
  };
  EXPECT_TRUE(MistakesOf(shifted(0.5)).empty());
  EXPECT_THAT(MistakesOf(shifted(2.0)), ElementsAre(InertiaMistake::kUnexplained));
}

TEST(InertiaDiagnosis, NamesSteinersTermThatIsInTheTensor) {
  for (const Body& part : {BoxPart(), BracketPart(), EllipsoidPart(), TubePart()}) {
    EXPECT_THAT(MistakesOf(With(part, [](Body* b) { AddSteiner(1, b); })),
                ElementsAre(InertiaMistake::kSteinerAdded));
    EXPECT_THAT(MistakesOf(With(part, [](Body* b) { AddSteiner(2, b); })),
                ElementsAre(InertiaMistake::kSteinerTwice));
  }
}

TEST(InertiaDiagnosis, NamesSteinersTermThatIsMissing) {
  // Taken away from a tensor that was about the centre of mass already.
  const Body part =
      SoundBody(Moved(test::BoxMesh(0.30, 0.06, 0.04), At(Vec3(-0.11, -0.025, -0.02))), kSteel);
  EXPECT_THAT(MistakesOf(With(part, [](Body* b) { AddSteiner(-1, b); })),
              ElementsAre(InertiaMistake::kSteinerMissing));
  // Left out between two parts of a body.
  const TriangleMesh head = test::BoxMesh(0.06, 0.06, 0.06);
  Body dumbbell = SoundBody(test::Together(head, Moved(head, At(Vec3(0.2, 0.05, 0)))), kAluminium);
  EXPECT_TRUE(MistakesOf(dumbbell).empty());
  dumbbell.I_Bcm_B = dumbbell.mass * SolidShape(head).G_cm;
  EXPECT_THAT(MistakesOf(dumbbell), ElementsAre(InertiaMistake::kSteinerMissing));
}

TEST(InertiaDiagnosis, NamesProductsOfInertiaOfTheOtherSign) {
  for (const Body& part : {BracketPart(), TurnedBracketPart()}) {
    const Body wrong = With(part, [](Body* b) {
      b->I_Bcm_B = 2.0 * Mat3(b->I_Bcm_B.diagonal().asDiagonal()) - b->I_Bcm_B;
    });
    EXPECT_THAT(MistakesOf(wrong), ElementsAre(InertiaMistake::kProductSigns)) << TextOf(wrong);
  }
  const Body one = With(TurnedBracketPart(),
                        [](Body* b) { b->I_Bcm_B(0, 1) = b->I_Bcm_B(1, 0) = -b->I_Bcm_B(0, 1); });
  EXPECT_THAT(MistakesOf(one), ElementsAre(InertiaMistake::kProductSigns)) << TextOf(one);
  EXPECT_THAT(TextOf(one), testing::HasSubstr("(xy)"));
}

TEST(InertiaDiagnosis, NamesOtherAxes) {
  const Mat3 R = Turned();
  const Body in_file =
      With(TurnedBracketPart(), [&](Body* b) { b->I_Bcm_B = R.transpose() * b->I_Bcm_B * R; });
  EXPECT_THAT(MistakesOf(in_file), ElementsAre(InertiaMistake::kOtherAxes));
  EXPECT_THAT(TextOf(in_file), testing::HasSubstr("in the mesh's axes"));
  const Body principal = With(TurnedBracketPart(), [](Body* b) {
    b->I_Bcm_B =
        Eigen::SelfAdjointEigenSolver<Mat3>(b->I_Bcm_B).eigenvalues().reverse().asDiagonal();
  });
  EXPECT_THAT(MistakesOf(principal), ElementsAre(InertiaMistake::kOtherAxes));
  EXPECT_THAT(TextOf(principal), testing::HasSubstr("principal axes"));
  const Body exchanged = With(BracketPart(), [](Body* b) {
    Mat3 swap;
    swap << 0, 1, 0, 0, 0, 1, 1, 0, 0;
    b->I_Bcm_B = swap * b->I_Bcm_B * swap.transpose();
  });
  EXPECT_THAT(MistakesOf(exchanged), ElementsAre(InertiaMistake::kOtherAxes));
  const Mat3 any = Eigen::AngleAxisd(0.9, Vec3(0.2, -1, 0.4).normalized()).toRotationMatrix();
  const Body turned =
      With(BoxPart(), [&](Body* b) { b->I_Bcm_B = any * b->I_Bcm_B * any.transpose(); });
  EXPECT_THAT(MistakesOf(turned), ElementsAre(InertiaMistake::kOtherAxes));
  EXPECT_THAT(TextOf(turned), testing::HasSubstr("turned by"));
  // All of it in the file's frame.
  const Body whole = With(TurnedBracketPart(), [&](Body* b) {
    b->I_Bcm_B = R.transpose() * b->I_Bcm_B * R;
    b->p_BoBcm_B = R.transpose() * (b->p_BoBcm_B - Vec3(0.05, 0.02, 0.08));
  });
  EXPECT_THAT(MistakesOf(whole), ElementsAre(InertiaMistake::kOtherAxes)) << TextOf(whole);
}

TEST(InertiaDiagnosis, NamesUnits) {
  for (const Body& part : SoundParts()) {
    EXPECT_THAT(MistakesOf(With(part, [](Body* b) { b->I_Bcm_B *= 1e6; })),
                ElementsAre(InertiaMistake::kTensorUnits));
    EXPECT_THAT(MistakesOf(With(part, [](Body* b) { b->I_Bcm_B *= 1e-3; })),
                ElementsAre(InertiaMistake::kTensorUnits));
    EXPECT_THAT(MistakesOf(With(part, [](Body* b) { b->p_BoBcm_B *= 1e3; })),
                ElementsAre(InertiaMistake::kCentreMillimetres));
  }
}

TEST(InertiaDiagnosis, NamesAMeshInMillimetres) {
  for (Body part : SoundParts()) {
    auto& mesh = std::get<Mesh>(part.shapes[0].geometry);
    TriangleMesh large = *mesh.surface;
    for (Vec3& p : large.vertices) p *= 1e3;
    mesh.surface = std::make_shared<const TriangleMesh>(large);
    EXPECT_THAT(MistakesOf(part), ElementsAre(InertiaMistake::kMeshMillimetres)) << TextOf(part);
  }
}

TEST(InertiaDiagnosis, NamesDensities) {
  for (const Body& part : SoundParts()) {
    // Mass of steel, tensor of aluminium.
    const Body other = With(part, [](Body* b) { b->I_Bcm_B *= kAluminium / kSteel; });
    EXPECT_THAT(MistakesOf(other), ElementsAre(InertiaMistake::kOtherDensity)) << TextOf(other);
    // 7.85 or 2.7 taken as kg/m³.
    const Body light = With(part, [](Body* b) {
      b->mass *= 1e-3;
      b->I_Bcm_B *= 1e-3;
    });
    EXPECT_THAT(MistakesOf(light), ElementsAre(InertiaMistake::kImprobableDensity))
        << TextOf(light);
    // Mass in grams, tensor in kg m².
    const Body grams = With(part, [](Body* b) { b->mass *= 1e3; });
    EXPECT_THAT(MistakesOf(grams), ElementsAre(InertiaMistake::kImprobableDensity))
        << TextOf(grams);
  }
}

TEST(InertiaDiagnosis, NamesAShellInsteadOfASolid) {
  for (const Body& part : {BoxPart(), CylinderPart(), EllipsoidPart()}) {
    const TriangleMesh& mesh = *std::get<Mesh>(part.shapes[0].geometry).surface;
    const Body shell = With(part, [&](Body* b) { b->I_Bcm_B = b->mass * ShellShape(mesh).G_cm; });
    EXPECT_THAT(MistakesOf(shell), ElementsAre(InertiaMistake::kShell)) << TextOf(shell);
  }
}

TEST(InertiaDiagnosis, NamesAMirroredPart) {
  for (const Body& part : {BracketPart(), TurnedBracketPart()}) {
    for (int k = 0; k < 2; ++k) {
      const Body mirrored = With(part, [k](Body* b) {
        Mat3 M = Mat3::Identity();
        M(k, k) = -1.0;
        b->p_BoBcm_B = M * b->p_BoBcm_B;
        b->I_Bcm_B = M * b->I_Bcm_B * M;
      });
      EXPECT_THAT(MistakesOf(mirrored), ElementsAre(InertiaMistake::kMirrored))
          << k << TextOf(mirrored);
    }
  }
}

TEST(InertiaDiagnosis, NamesATensorThatNothingHas) {
  const Body part = With(BoxPart(), [](Body* b) { b->I_Bcm_B = Vec3(1, 1, 3).asDiagonal(); });
  EXPECT_THAT(MistakesOf(part), ElementsAre(InertiaMistake::kImpossibleTensor)) << TextOf(part);
  const Body negative = With(BoxPart(), [](Body* b) { b->I_Bcm_B = Vec3(-1, 1, 1).asDiagonal(); });
  EXPECT_THAT(TextOf(negative), testing::HasSubstr("below zero"));
}

TEST(InertiaDiagnosis, NamesACentreThatIsLeftOut) {
  const Body part = With(BoxPart(), [](Body* b) { b->p_BoBcm_B.setZero(); });
  EXPECT_THAT(MistakesOf(part), ElementsAre(InertiaMistake::kCentreAtOrigin));
}

TEST(InertiaDiagnosis, NamesAMeshThatIsNotClosed) {
  TriangleMesh open = test::BoxMesh(0.1, 0.1, 0.1);
  open.triangles.pop_back();
  Body part = BoxPart();
  std::get<Mesh>(part.shapes[0].geometry).surface = std::make_shared<const TriangleMesh>(open);
  EXPECT_THAT(MistakesOf(part), ElementsAre(InertiaMistake::kOpenMesh));
  EXPECT_THAT(TextOf(part), testing::HasSubstr("part.stl (3 open edges)"));
  // A sheet with two sides has no edges that are open, but no volume.
  const TriangleMesh sheet{{Vec3(0, 0, 0), Vec3(1, 0, 0), Vec3(0, 1, 0)}, {{0, 1, 2}, {0, 2, 1}}};
  for (const TriangleMesh& surface : {sheet, TriangleMesh{}}) {
    std::get<Mesh>(part.shapes[0].geometry).surface = std::make_shared<const TriangleMesh>(surface);
    EXPECT_THAT(MistakesOf(part), ElementsAre(InertiaMistake::kOpenMesh));
    EXPECT_THAT(TextOf(part), testing::HasSubstr("part.stl (no volume)"));
  }
}

TEST(InertiaDiagnosis, WhatNoMistakeExplainsIsReportedSo) {
  // A motor at one end.
  const Body part = With(EllipsoidPart(), [](Body* b) {
    b->I_Bcm_B(0, 0) *= 1.6;
    b->I_Bcm_B(2, 2) *= 1.25;
  });
  EXPECT_THAT(MistakesOf(part), ElementsAre(InertiaMistake::kUnexplained)) << TextOf(part);
  Body massless = BoxPart();
  massless.mass = 0.0;
  massless.I_Bcm_B.setZero();
  EXPECT_EQ(MistakesOf(massless), std::vector{InertiaMistake::kNoMass});
}

}  // namespace
}  // namespace mbv
