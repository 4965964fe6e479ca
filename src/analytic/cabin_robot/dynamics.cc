#include "analytic/cabin_robot/dynamics.h"

#include <cmath>
#include <numbers>

#include "math/spatial.h"
#include "mechanism/channels.h"

namespace mbv::cabin_robot {
namespace {

using Row8 = Eigen::Matrix<double, 1, kDrives>;

// Spreads a row over the sliders (Ẋ1, Ẋ2, Ẋ3) to all eight drives.
Row8 Spread(const Vec3& row) {
  Row8 full = Row8::Zero();
  full.segment<3>(kX1) = row.transpose();
  return full;
}

// A frame that turns about world z by `angle` (with rates) around a point moving with a slider.
FrameMotion PlanarFrame(double x_slider, const Motion1& slider, int column, const Motion1& rail,
                        const Motion1& angle, const Row8& angle_row) {
  FrameMotion f;
  f.R = RotZ(angle.p);
  f.p = Vec3(x_slider, 0.0, rail.p);
  f.w = Vec3(0, 0, angle.v);
  f.e = Vec3(0, 0, angle.a);
  f.v = Vec3(slider.v, 0.0, rail.v);
  f.a = Vec3(slider.a, 0.0, rail.a);
  f.Jv(0, column) = 1.0;
  f.Jv(2, kRail) = 1.0;
  f.Jw.row(2) = angle_row;
  return f;
}

// Moves the origin by r (fixed in the frame, world axes).
void Shift(const Vec3& r, FrameMotion* f) {
  f->p += r;
  f->Jv -= Skew(r) * f->Jw;
  f->v += f->w.cross(r);
  f->a += f->e.cross(r) + f->w.cross(f->w.cross(r));
}

// Turns the frame about its own new z axis: R ← R Rx(twist) Rz(θ).
void Turn(double twist, const Motion1& theta, int column, FrameMotion* f) {
  f->R = f->R * RotX(twist) * RotZ(theta.p);
  const Vec3 z = f->R.col(2);
  f->e += f->w.cross(z) * theta.v + z * theta.a;
  f->w += z * theta.v;
  f->Jw.col(column) += z;
}

struct ComMotion {
  Vec3 a;
  Jac Jv;
  Mat3 I_W;
};

ComMotion ComOf(const BodyData& body, const FrameMotion& f) {
  const Vec3 r = f.R * body.com;
  return {f.a + f.e.cross(r) + f.w.cross(f.w.cross(r)), f.Jv - Skew(r) * f.Jw,
          f.R * body.inertia * f.R.transpose()};
}

void PlanarFrames(const CabinGeometry& geometry, const PlanarState& s, const OuterDrives& outer,
                  std::array<FrameMotion, kBodies>* frames) {
  const AngleRates D = RatesOf(geometry.planar, s);
  const Motion1 still;
  auto& f = *frames;
  f[kCarriage] = FrameMotion{};
  f[kCarriage].p = Vec3(0, 0, outer.d1.p);
  f[kCarriage].v = Vec3(0, 0, outer.d1.v);
  f[kCarriage].a = Vec3(0, 0, outer.d1.a);
  f[kCarriage].Jv(2, kRail) = 1.0;
  f[kSliderA] = PlanarFrame(s.X1.p, s.X1, kX1, outer.d1, still, Row8::Zero());
  f[kSliderD] = PlanarFrame(s.X2.p, s.X2, kX2, outer.d1, still, Row8::Zero());
  f[kSliderF] = PlanarFrame(s.X3.p, s.X3, kX3, outer.d1, still, Row8::Zero());
  // World angles: AB α, CD π − β, EF π − ε.
  const Motion1 cd{std::numbers::pi - s.beta.p, -s.beta.v, -s.beta.a};
  const Motion1 ef{std::numbers::pi - s.epsilon.p, -s.epsilon.v, -s.epsilon.a};
  f[kAB] = PlanarFrame(s.X1.p, s.X1, kX1, outer.d1, s.alpha, Spread(D.alpha));
  f[kCD] = PlanarFrame(s.X2.p, s.X2, kX2, outer.d1, cd, -Spread(D.beta));
  f[kEF] = PlanarFrame(s.X3.p, s.X3, kX3, outer.d1, ef, -Spread(D.epsilon));
  // The platform's origin K = A + L1 u(α) + (L2/2) u(γ).
  FrameMotion at_B = f[kAB];
  Shift(f[kAB].R.col(0) * geometry.planar.L1, &at_B);
  FrameMotion& K = f[kPlatform];
  K = at_B;
  K.R = RotZ(s.gamma.p);
  K.w = Vec3(0, 0, s.gamma.v);
  K.e = Vec3(0, 0, s.gamma.a);
  K.Jw.setZero();
  K.Jw.row(2) = Spread(D.gamma);
  Shift(K.R.col(0) * (geometry.planar.L2 / 2.0), &K);
}

}  // namespace

void ComputeFrames(const CabinGeometry& geometry, const PlanarState& planar,
                   const OuterDrives& outer, std::array<FrameMotion, kBodies>* frames) {
  PlanarFrames(geometry, planar, outer, frames);
  auto& f = *frames;
  const WristGeometry& g = geometry.wrist;
  constexpr double kQuarter = -std::numbers::pi / 2.0;  // α2 … α5 of Table 1

  // {3}: yaw of the support frame.
  FrameMotion w = f[kPlatform];
  Shift(w.R * Vec3(g.a2, g.d3, 0.0), &w);
  Turn(kQuarter, outer.th3, kTh3, &w);
  f[kSupport] = w;
  // {4}: pitch of the flip frame.
  Shift(w.R * Vec3(g.a3, 0.0, 0.0), &w);
  Turn(kQuarter, outer.th4, kTh4, &w);
  f[kFlip] = w;
  // {5}: the slide along y4; θ5 = −90° is fixed, so {5} turns with {4}.
  const Vec3 y4 = w.R.col(1);
  Shift(w.R * Vec3(g.a4, outer.d5.p, 0.0), &w);
  w.v += y4 * outer.d5.v;
  w.a += y4 * outer.d5.a + 2.0 * w.w.cross(y4) * outer.d5.v;
  w.Jv.col(kD5) += y4;
  w.R = w.R * RotX(kQuarter) * RotZ(kQuarter);
  f[kTable] = w;
  // {6}: the slewing bearing with the payload.
  Shift(w.R * Vec3(0.0, g.d6, 0.0), &w);
  Turn(kQuarter, outer.th6, kTh6, &w);
  f[kSlewing] = w;
  f[kPayload] = w;
}

Vec8 DriveForces(const CabinGeometry& geometry, const std::array<FrameMotion, kBodies>& frames) {
  Vec8 tau = Vec8::Zero();
  for (int b = 0; b < kBodies; ++b) {
    const BodyData& body = geometry.bodies[b];
    const FrameMotion& f = frames[b];
    const ComMotion com = ComOf(body, f);
    tau += com.Jv.transpose() * (body.mass * (com.a - geometry.gravity));
    tau += f.Jw.transpose() * (com.I_W * f.e + f.w.cross(com.I_W * f.w));
  }
  return tau;
}

Vec8 DriveForcesOf(const std::array<FrameMotion, kBodies>& frames, const BodyWrench& wrench) {
  const FrameMotion& f = frames[wrench.body];
  const Jac Jq = f.Jv - Skew(f.R * wrench.p_BoQ_B) * f.Jw;
  return -(Jq.transpose() * wrench.force_W + f.Jw.transpose() * wrench.moment_W);
}

Eigen::Matrix<double, kDrives, kDrives> MassMatrix(const CabinGeometry& geometry,
                                                   const std::array<FrameMotion, kBodies>& frames) {
  Eigen::Matrix<double, kDrives, kDrives> M;
  M.setZero();
  for (int b = 0; b < kBodies; ++b) {
    const ComMotion com = ComOf(geometry.bodies[b], frames[b]);
    M += geometry.bodies[b].mass * com.Jv.transpose() * com.Jv +
         frames[b].Jw.transpose() * com.I_W * frames[b].Jw;
  }
  return M;
}

namespace {

double Planar(const Vec3& a, const Vec3& b) { return a.x() * b.y() - a.y() * b.x(); }

// The planar F with a × F = m and b × F = n.
Vec3 ForceOf(const Vec3& a, double m, const Vec3& b, double n) {
  return (m * b - n * a) / Planar(a, b);
}

// Of everything that a body carries, from it outwards along the chain of BodyIndex; about p.
BodyDemand Beyond(int first, const std::array<FrameMotion, kBodies>& frames, const Demands& demands,
                  const Vec3& p) {
  BodyDemand sum;
  for (int b = first; b < kBodies; ++b) {
    sum.force += demands[b].force;
    sum.moment += demands[b].moment + (frames[b].p - p).cross(demands[b].force);
  }
  return sum;
}

}  // namespace

Demands DemandsOf(const CabinGeometry& geometry, const std::array<FrameMotion, kBodies>& frames) {
  Demands demands;
  for (int b = 0; b < kBodies; ++b) {
    const BodyData& body = geometry.bodies[b];
    const FrameMotion& f = frames[b];
    const Vec3 r = f.R * body.com;
    const Mat3 I_W = f.R * body.inertia * f.R.transpose();
    const Vec3 a = f.a + f.e.cross(r) + f.w.cross(f.w.cross(r));
    demands[b].force = body.mass * (a - geometry.gravity);
    demands[b].moment = I_W * f.e + f.w.cross(I_W * f.w) + r.cross(demands[b].force);
  }
  return demands;
}

void TakeOff(const BodyWrench& wrench, const std::array<FrameMotion, kBodies>& frames,
             Demands* demands) {
  BodyDemand& demand = (*demands)[wrench.body];
  demand.force -= wrench.force_W;
  demand.moment -= wrench.moment_W + (frames[wrench.body].R * wrench.p_BoQ_B).cross(wrench.force_W);
}

HingeForces HingeForcesOf(const CabinGeometry& geometry,
                          const std::array<FrameMotion, kBodies>& frames, const Demands& demands) {
  const PlanarGeometry& g = geometry.planar;
  const auto &AB = frames[kAB], &CD = frames[kCD], &EF = frames[kEF], &K = frames[kPlatform];
  const Vec3 u = AB.R.col(0), half = g.L2 / 2.0 * K.R.col(0);
  const Vec3 p_B = AB.p + g.L1 * u;
  const BodyDemand P = Beyond(kPlatform, frames, demands, p_B);
  const Vec3 CB = 2.0 * half, DC = g.L3 * CD.R.col(0), FE = g.L4 * EF.R.col(0);
  HingeForces h;
  h.C = ForceOf(DC, -demands[kCD].moment.z(), CB, P.moment.z());  // (R1)
  h.B = P.force - h.C;                                            // (R2)
  h.E = ForceOf(FE, -demands[kEF].moment.z(), g.L1 / 2.0 * u,     // (R3)
                demands[kAB].moment.z() + Planar(g.L1 * u, h.B));
  h.A = demands[kAB].force + h.B - h.E;  // (R4)
  h.D = demands[kCD].force + h.C;
  h.F = demands[kEF].force + h.E;
  return h;
}

JointReactions::JointReactions(const Mechanism& mechanism) {
  Add(mechanism, "A", kSliderA, kAB, &HingeForces::A);
  Add(mechanism, "B", kAB, kPlatform, &HingeForces::B);
  Add(mechanism, "C", kCD, kPlatform, &HingeForces::C);
  Add(mechanism, "D", kSliderD, kCD, &HingeForces::D);
  Add(mechanism, "E", kEF, kAB, &HingeForces::E);
  Add(mechanism, "F", kSliderF, kEF, &HingeForces::F);
  Add(mechanism, "d1", -1, kCarriage, nullptr);
  Add(mechanism, "th3", kPlatform, kSupport, nullptr);
  Add(mechanism, "th4", kSupport, kFlip, nullptr);
  Add(mechanism, "d5", kFlip, kTable, nullptr);
  Add(mechanism, "th6", kTable, kSlewing, nullptr);
  Add(mechanism, "payload_mount", kSlewing, kPayload, nullptr);
}

void JointReactions::Add(const Mechanism& mechanism, const char* joint, int parent, int child,
                         Vec3 HingeForces::*hinge) {
  const int index = mechanism.FindJoint(joint);
  if (index < 0) return;
  const Joint& found = mechanism.joints[static_cast<size_t>(index)];
  const int parent_body = parent < 0 ? 0 : mechanism.FindBody(kBodyNames[parent]);
  if (found.parent != parent_body || found.child != mechanism.FindBody(kBodyNames[child])) return;
  Entry entry{.hinge = hinge, .child = child, .parent = parent, .R_PF = found.X_PF.linear()};
  const std::vector<Channel> all = ReactionChannels(found);
  for (int c = 0; c < 6; ++c) {
    if (hinge != nullptr) {
      // Along the hinge's axis the loop is redundant.
      entry.component[c] = c < 3 && std::abs(found.axis[c]) < 1e-9;
    } else {
      // The drive's own component is not a reaction.
      const bool drive = found.kind == JointKind::kPrismatic  ? c < 3
                         : found.kind == JointKind::kRevolute ? c >= 3
                                                              : false;
      entry.component[c] = !(drive && std::abs(found.axis[c % 3]) > 1e-9);
    }
    if (entry.component[c]) channels_.push_back(all[static_cast<size_t>(c)]);
  }
  entries_.push_back(entry);
}

void JointReactions::Write(const CabinGeometry& geometry,
                           const std::array<FrameMotion, kBodies>& frames, const Demands& demands,
                           double* values) const {
  const HingeForces hinges = HingeForcesOf(geometry, frames, demands);
  for (const Entry& entry : entries_) {
    BodyDemand wrench;
    if (entry.hinge != nullptr) {
      wrench.force = hinges.*entry.hinge;
    } else {
      wrench = Beyond(entry.child, frames, demands, frames[entry.child].p);
    }
    const Mat3 R_WP = entry.parent < 0 ? Mat3(Mat3::Identity()) : frames[entry.parent].R;
    const Mat3 R_FW = (R_WP * entry.R_PF).transpose();
    const Vec3 f = R_FW * wrench.force, m = R_FW * wrench.moment;
    for (int c = 0; c < 6; ++c) {
      if (entry.component[c]) *values++ = c < 3 ? f[c] : m[c - 3];
    }
  }
}

}  // namespace mbv::cabin_robot
