#include <array>
#include <cmath>
#include <numbers>
#include <random>

#include "features/equation_audit/audit.h"
#include "features/equation_audit/cabin_robot_audit.h"
#include "math/spatial.h"

namespace mbv::cabin_audit {
namespace {

using WristRates = Eigen::Vector4d;
using Mat64 = Eigen::Matrix<double, 6, 4>;
constexpr double kQuarter = std::numbers::pi / 2;
constexpr double kStep = 1e-3;

constexpr double kPoseLimit = 1e-14, kWristRateLimit = 1e-11, kWristAccelerationLimit = 2e-8;
constexpr const char* kChain = "product of elementary rotations and translations";

// Modified Denavit–Hartenberg: Rx(α) Tx(a) Rz(θ) Tz(d).
Pose Link(double alpha, double a, double theta, double d) {
  Pose X = Pose::Identity();
  X.linear() = RotX(alpha) * RotZ(theta);
  X.translation() = Vec3(a, 0, 0) + RotX(alpha) * Vec3(0, 0, d);
  return X;
}

// The wrist from {3} at th3 = 0 without d3; q = (θ1, θ2, d2, θ3) of the paper's serial section.
Pose Wrist(const Lengths& l, const WristRates& q) {
  return Pose(RotZ(q[0])) * Link(-kQuarter, l.a3, q[1], 0) *
         Link(-kQuarter, l.a4, -kQuarter, q[2]) * Link(-kQuarter, 0, q[3], l.d6);
}

// The complete chain; `planar` = (d1, X, Y, γ).
Pose Chain(const Lengths& l, const WristRates& planar, const WristRates& q) {
  Pose X = Pose::Identity();
  X.linear() = RotZ(planar[3]);
  X.translation() = Vec3(planar[1], planar[2], planar[0]);
  return X * Link(-kQuarter, l.a2, 0, l.d3) * Wrist(l, q);
}

struct WristState {
  WristRates planar, planar_v, planar_a, q, v, a;
};

std::vector<WristState> RandomStates(int count) {
  std::mt19937_64 random(4711);
  std::uniform_real_distribution<double> unit(-1.0, 1.0);
  const double deg = std::numbers::pi / 180;
  std::vector<WristState> states(count);
  for (WristState& s : states) {
    s.planar << 0.5 + 0.4 * unit(random), 0.08 * unit(random), 0.35 + 0.06 * unit(random),
        20 * deg * unit(random);
    s.q << 105 * deg * unit(random), -35 * deg + 50 * deg * unit(random),
        -0.25 + 0.25 * unit(random), 180 * deg * unit(random);
    for (int i = 0; i < 4; ++i) {
      s.planar_v[i] = 0.3 * unit(random);
      s.planar_a[i] = 0.5 * unit(random);
      s.v[i] = 0.5 * unit(random);
      s.a[i] = 0.5 * unit(random);
    }
  }
  return states;
}

// Tool-frame twist [v; ω] of a pose function of time by differences.
template <typename F>
Vec6 ToolTwist(const F& pose) {
  const Mat3 R = pose(0.0).linear();
  const auto entries = [&](double t) {
    Eigen::Matrix<double, 3, 4> m;
    m << pose(t).translation(), pose(t).linear();
    return m;
  };
  const Eigen::Matrix<double, 3, 4> rate = FirstDifference(entries, kStep);
  const Mat3 W = R.transpose() * rate.rightCols<3>();  // [ω]× in the tool frame
  Vec6 twist;
  twist << R.transpose() * rate.col(0), W(2, 1), W(0, 2), W(1, 0);
  return twist;
}

// (32) corrected and as printed, in the tool frame.
Mat64 SerialJacobian(const Lengths& l, const WristRates& q, bool printed) {
  const double c2 = std::cos(q[1]), s2 = std::sin(q[1]), c3 = std::cos(q[3]), s3 = std::sin(q[3]);
  const double e = l.d6 + l.a4, d2 = q[2], H = l.a3 + c2 * e - d2 * s2;
  Mat64 J;
  J << c3 * H, -s3 * e, -s3, 0, -s3 * H, -c3 * e, -c3, 0, 0, -d2, 0, 0, s3 * c2, c3, 0, 0, c3 * c2,
      -s3, 0, 0, -s2, 0, 0, 1;
  if (printed) {
    J(0, 0) = c2 * c3 * e + l.a3 * c3;
    J(1, 0) = -c2 * s3 * e + l.a3 * s3;
    J(2, 1) = 0.0;
    J(3, 1) = c2;
  }
  return J;
}

void SerialPositionRows(const Lengths& l, const Lengths& truth,
                        const std::vector<WristState>& states, std::vector<AuditRow>* rows) {
  RowMeter m6(
      TextRow("(5), (6)", "elements of the wrist's transform", "", "1, m", kPoseLimit, kChain));
  RowMeter t2(TextRow("(7) θ2, d2", "θ2 = asin(−a_z), d2 = −(p_z + (a2+d3) sin θ2)/cos θ2", "",
                      "rad, m", 2e-13, "asin near its end costs digits"));
  RowMeter t3(TextRow("(7) θ3", "asin(n_z/cos θ2)", "atan2(n_z, o_z)", "rad", 1e-13,
                      "wrong quadrant for |θ6| > 90°"));
  RowMeter t1(TextRow("(7) θ1", "acos(a_x/cos θ2)", "atan2(a_y, a_x)", "rad", 1e-13,
                      "wrong sign for θ1 < 0"));
  for (const WristState& s : states) {
    const Pose X = Wrist(truth, s.q);
    const Mat3 R = X.linear();
    const Vec3 p = X.translation();
    const double c1 = std::cos(s.q[0]), s1 = std::sin(s.q[0]), c2 = std::cos(s.q[1]);
    const double s2 = std::sin(s.q[1]), c3 = std::cos(s.q[3]), s3 = std::sin(s.q[3]), d2 = s.q[2];
    Eigen::Matrix<double, 3, 4> form;
    form << c1 * s2 * s3 - c3 * s1, s1 * s3 + c1 * c3 * s2, c1 * c2,
        l.a3 * c1 + l.a4 * c1 * c2 + c1 * c2 * l.d6 - c1 * d2 * s2, c1 * c3 + s1 * s2 * s3,
        c3 * s1 * s2 - c1 * s3, c2 * s1, l.a3 * s1 + l.a4 * c2 * s1 + c2 * l.d6 * s1 - d2 * s1 * s2,
        c2 * s3, c2 * c3, -s2, -c2 * d2 - l.a4 * s2 - l.d6 * s2;
    for (int r = 0; r < 3; ++r) {
      for (int c = 0; c < 3; ++c) m6.Add(R(r, c), form(r, c));
      m6.Add(p[r], form(r, 3));
    }
    const double th2 = std::asin(-R(2, 2));
    t2.Add(s.q[1], th2);
    t2.Add(d2, -(p.z() + (l.a4 + l.d6) * std::sin(th2)) / std::cos(th2));
    const auto clamp = [](double x) { return std::max(-1.0, std::min(1.0, x)); };
    t3.Add(s.q[3], std::asin(clamp(R(2, 0) / std::cos(th2))), std::atan2(R(2, 0), R(2, 1)));
    t1.Add(s.q[0], std::acos(clamp(R(0, 2) / std::cos(th2))), std::atan2(R(1, 2), R(0, 2)));
  }
  for (RowMeter* m : {&m6, &t2, &t3, &t1}) rows->push_back(m->Finish());
}

// One printed element of (13) with its correction; the same text twice means "right".
struct Element {
  const char* name;
  const char* printed;
  const char* corrected;
  const char* unit;
  double value_printed, value_corrected;
};

std::array<Element, 12> ChainElements(const Lengths& l, const WristState& s) {
  const double ca = std::cos(s.planar[3]), sa = std::sin(s.planar[3]);
  const double c3 = std::cos(s.q[0]), s3 = std::sin(s.q[0]), c4 = std::cos(s.q[1]);
  const double s4 = std::sin(s.q[1]), c6 = std::cos(s.q[3]), s6 = std::sin(s.q[3]), d5 = s.q[2];
  const double nx = -s6 * (c4 * sa - ca * c3 * s4) - c6 * ca * s3;
  const double ny = s6 * (c4 * ca + sa * c3 * s4) - c6 * sa * s3;
  const double oy = c6 * (ca * c4 + c3 * s4 * sa) + sa * s3 * s6;
  const double oz = c3 * s6 - s3 * c6 * s4;
  const double ax = s4 * sa + ca * c3 * c4, ay = c4 * c3 * sa - ca * s4, az = -s3 * c4;
  const double px = s.planar[1] + l.a2 * ca - l.d3 * sa + (l.a4 + l.d6) * ax +
                    d5 * (c4 * sa - ca * c3 * s4) + l.a3 * ca * c3;
  const double py0 =
      s.planar[2] + l.d3 * ca + l.a2 * sa - d5 * (c4 * ca + sa * c3 * s4) + l.a3 * sa * c3;
  const double pz = s.planar[0] - l.a3 * s3 - (l.a4 + l.d6) * s3 * c4 + s3 * d5 * s4;
  return {{{"n_x", "as printed", "", "1", nx, nx},
           {"n_y", "as printed", "", "1", ny, ny},
           {"n_z", "−c3c6 − s4s6 − s3", "−c3c6 − s3s4s6", "1", -c3 * c6 - s4 * s6 - s3,
            -c3 * c6 - s3 * s4 * s6},
           {"o_x", "cosα s6s3 − sinα c6c4 − cosα c3c4", "s3s6 cosα − c4c6 sinα + c3s4c6 cosα", "1",
            ca * s6 * s3 - sa * c6 * c4 - ca * c3 * c4,
            s3 * s6 * ca - c4 * c6 * sa + c3 * s4 * c6 * ca},
           {"o_y", "as printed", "", "1", oy, oy},
           {"o_z", "as printed", "", "1", oz, oz},
           {"a_x", "as printed", "", "1", ax, ax},
           {"a_y", "as printed", "", "1", ay, ay},
           {"a_z", "as printed", "", "1", az, az},
           {"p_x", "as printed", "", "m", px, px},
           {"p_y", "… − a4[s4cosα − sinα c3s4] − d6[s4cosα + sinα c3c4] …",
            "… − (a4 + d6)[s4cosα − sinα c3c4] …", "m",
            py0 - l.a4 * (s4 * ca - sa * c3 * s4) - l.d6 * (s4 * ca + sa * c3 * c4),
            py0 - (l.a4 + l.d6) * (s4 * ca - sa * c3 * c4)},
           {"p_z", "as printed", "", "m", pz, pz}}};
}

void WristChainRows(const Lengths& l, const Lengths& truth, const std::vector<WristState>& states,
                    std::vector<AuditRow>* rows) {
  rows->push_back(TextRow("(10), (11)", "chain of transforms, ¹₂T = trans(X, Y, 0) rot(Z, α)", "",
                          "", 0.0,
                          "α here is the platform's tilt γ; tested element by element in (13)"));
  rows->back().verdict = AuditVerdict::kNotTestable;
  std::vector<RowMeter> meters;
  for (const Element& e : ChainElements(l, states.front())) {
    AuditRow row = TextRow("", e.printed, e.corrected, e.unit, kPoseLimit, kChain);
    row.equation = std::string("(12), (13) ") + e.name;
    meters.emplace_back(row);
  }
  for (const WristState& s : states) {
    const Pose X = Chain(truth, s.planar, s.q);
    const auto elements = ChainElements(l, s);
    for (int k = 0; k < 12; ++k) {
      const double value = k < 9 ? X.linear()(k % 3, k / 3) : X.translation()[k - 9];
      meters[k].Add(value, elements[k].value_printed, elements[k].value_corrected);
    }
  }
  for (RowMeter& meter : meters) rows->push_back(meter.Finish());
}

void WristJacobianRows(const Lengths& l, const Lengths& truth,
                       const std::vector<WristState>& states, std::vector<AuditRow>* rows) {
  constexpr const char* kTruth = "tool-frame twist from differences of the wrist's transform";
  RowMeter first(
      TextRow("(28), (29)", "(p×n)_z = c2c3(d3+a2) + a1c3, (p×o)_z = −c2s3(d3+a2) + a1s3",
              "c3 H, −s3 H with H = a1 + c2(a2+d3) − d2 s2", "m, 1", kWristRateLimit, kTruth));
  RowMeter second(TextRow("(30)", "[−s3(d3+a2), −c3(d3+a2), 0, c2, −s3, 0]", "third −d2, fourth c3",
                          "m, 1", kWristRateLimit, kTruth));
  RowMeter third(TextRow("(31)", "[−s3, −c3, 0, 0, 0, 0]", "", "1", kWristRateLimit, kTruth));
  RowMeter all(TextRow("(26), (27), (32)", "J2 with the columns (28)–(31)",
                       "J2 with corrected columns", "m, 1", kWristRateLimit,
                       "inherits the errors of (29) and (30)"));
  for (const WristState& s : states) {
    const Mat64 printed = SerialJacobian(l, s.q, true), corrected = SerialJacobian(l, s.q, false);
    for (int k = 0; k < 4; ++k) {
      const Vec6 twist =
          ToolTwist([&](double t) { return Wrist(truth, s.q + t * WristRates::Unit(k)); });
      RowMeter* own[] = {&first, &second, &third, nullptr};
      for (int r = 0; r < 6; ++r) {
        if (own[k] != nullptr && k == 2) own[k]->Add(twist[r], printed(r, k));
        if (own[k] != nullptr && k != 2) own[k]->Add(twist[r], printed(r, k), corrected(r, k));
        all.Add(twist[r], printed(r, k), corrected(r, k));
      }
    }
  }
  for (RowMeter* m : {&first, &second, &third, &all}) rows->push_back(m->Finish());
}

void HybridRows(const Lengths& l, const Lengths& truth, const std::vector<WristState>& states,
                std::vector<AuditRow>* rows) {
  RowMeter hybrid(TextRow(
      "(33), (34)", "J1 and J2 stacked (shapes do not fit; no rail, no rotation)",
      "v = ḋ1 e_z + (V_X, V_Y, 0) + W_γ e_z×r + R06 J2v q̇, ω = W_γ e_z + R06 J2ω q̇", "m/s, rad/s",
      kWristRateLimit, "print read as v = (V_X, V_Y, 0) + J2v q̇, ω = W_γ e_z + J2ω q̇"));
  RowMeter acceleration(TextRow("(41)–(46)", "J̇2 (θ1, θ2, d1, θ3) + J2 (θ̇1, θ̇2, ḋ1, θ̇3)",
                                "J̇2 q̇ + J2 q̈ + ω_tool × v_tool (translation)", "m/s²",
                                kWristAccelerationLimit,
                                "positions for rates, rates for accelerations"));
  for (const WristState& s : states) {
    const auto pose = [&](double t) {
      return Chain(truth, s.planar + t * s.planar_v + 0.5 * t * t * s.planar_a,
                   s.q + t * s.v + 0.5 * t * t * s.a);
    };
    const Mat3 R = pose(0.0).linear();
    const Vec6 tool = ToolTwist(pose);
    const Mat64 J2 = SerialJacobian(l, s.q, false);
    const Vec6 wrist = J2 * s.v;
    const Vec3 spin(0, 0, s.planar_v[3]), slide(s.planar_v[1], s.planar_v[2], 0);
    const Vec3 K(s.planar[1], s.planar[2], s.planar[0]);
    const Vec3 r = pose(0.0).translation() - K;
    Vec6 twist, printed, corrected;
    twist << R * tool.head<3>(), R * tool.tail<3>();
    printed << slide + wrist.head<3>(), spin + wrist.tail<3>();
    corrected << Vec3(0, 0, s.planar_v[0]) + slide + spin.cross(r) + R * wrist.head<3>(),
        spin + R * wrist.tail<3>();
    for (int c = 0; c < 6; ++c) hybrid.Add(twist[c], printed[c], corrected[c]);

    const auto q = [&](double t) { return WristRates(s.q + t * s.v + 0.5 * t * t * s.a); };
    const auto J = [&](double t) { return SerialJacobian(l, q(t), false); };
    const Mat64 Jdot = FirstDifference(J, kStep);
    const Mat3 Rw = Wrist(truth, s.q).linear();
    const Vec3 a_true =
        Rw.transpose() *
        SecondDifference([&](double t) { return Vec3(Wrist(truth, q(t)).translation()); }, kStep);
    const Vec6 literal = Jdot * s.q + J2 * s.v, rate = Jdot * s.v + J2 * s.a;
    const Vec3 full = rate.head<3>() + wrist.tail<3>().cross(wrist.head<3>());
    for (int c = 0; c < 3; ++c) acceleration.Add(a_true[c], literal[c], full[c]);
  }
  rows->push_back(hybrid.Finish());
  rows->push_back(acceleration.Finish());
}

}  // namespace

std::vector<AuditRow> WristRows(const Lengths& lengths, const Lengths& truth) {
  const std::vector<WristState> states = RandomStates(100);
  std::vector<AuditRow> rows;
  SerialPositionRows(lengths, truth, states, &rows);
  WristChainRows(lengths, truth, states, &rows);
  WristJacobianRows(lengths, truth, states, &rows);
  HybridRows(lengths, truth, states, &rows);
  return rows;
}

}  // namespace mbv::cabin_audit
