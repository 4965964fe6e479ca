// In how many ways mechanisms close, against polynomial homotopies of a program of its own, PHCpack
// [Verschelde 1999] (Debian: phcpack): it finds all isolated complex solutions, the real ones of
// which are poses.
#include "features/workspace/joint_space.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <complex>
#include <cstdlib>
#include <map>
#include <numbers>
#include <sstream>

#include "model_file/load_model.h"
#include "tests/support/run_program.h"
#include "tests/support/source_dir.h"

namespace mbv {
namespace {

using std::numbers::pi;

// Monomials, exponents by variable, with their factors.
class Polynomial {
 public:
  Polynomial(double constant = 0.0) {  // NOLINT(google-explicit-constructor): a number is one
    if (constant != 0.0) terms_[{}] = constant;
  }
  explicit Polynomial(const std::string& variable) { terms_[{{variable, 1}}] = 1.0; }

  friend Polynomial operator+(Polynomial a, const Polynomial& b) {
    for (const auto& [powers, factor] : b.terms_) a.terms_[powers] += factor;
    return a;
  }
  friend Polynomial operator*(const Polynomial& a, const Polynomial& b) {
    Polynomial product;
    for (const auto& [p, f] : a.terms_) {
      for (const auto& [q, g] : b.terms_) {
        auto powers = p;
        for (const auto& [variable, power] : q) powers[variable] += power;
        product.terms_[powers] += f * g;
      }
    }
    return product;
  }
  [[nodiscard]] Polynomial By(const std::string& variable) const {
    Polynomial derivative;
    for (const auto& [of, factor] : terms_) {
      auto powers = of;
      const auto at = powers.find(variable);
      if (at == powers.end()) continue;
      const int power = at->second--;
      if (power == 1) powers.erase(at);
      derivative.terms_[powers] += power * factor;
    }
    return derivative;
  }
  friend Polynomial operator-(const Polynomial& a, const Polynomial& b) { return a + -1.0 * b; }

  [[nodiscard]] std::string Text() const {
    std::string text;
    for (const auto& [powers, factor] : terms_) {
      if (factor == 0.0) continue;
      text += fmt::format("{:+.17e}", factor);
      for (const auto& [variable, power] : powers) text += fmt::format("*{}^{}", variable, power);
      text += "\n";
    }
    return text + ";\n";
  }

 private:
  std::map<std::map<std::string, int>, double> terms_;
};
Polynomial Square(const Polynomial& p) { return p * p; }

using Solution = std::map<std::string, std::complex<double>>;

std::vector<Solution> SolveByPhc(const std::vector<Polynomial>& equations) {
  const Program files("phc");
  const std::string in = (files.folder() / "in").string(), out = (files.folder() / "out").string();
  {
    std::ofstream stream(in);
    stream << equations.size() << " " << equations.size() << "\n";
    for (const Polynomial& equation : equations) stream << equation.Text();
  }
  EXPECT_EQ(std::system(fmt::format("phc -04711 -b '{}' '{}' > /dev/null", in, out).c_str()), 0);
  // The solutions stand behind the equations: blocks of " x :  re  im".
  std::vector<Solution> solutions;
  std::istringstream text(ReadAll(in));
  Solution next;
  for (std::string line; std::getline(text, line);) {
    if (line.starts_with("the solution for t")) next.clear();
    std::istringstream words(line);
    std::string name, colon;
    double re = 0.0, im = 0.0;
    if (line.starts_with(" ") && (words >> name >> colon >> re >> im) && colon == ":") {
      next[name] = {re, im};
    }
    const size_t residual = line.find("res :");
    if (line.starts_with("==") && residual != std::string::npos &&
        std::stod(line.substr(residual + 5)) < 1e-8) {
      solutions.push_back(next);
    }
  }
  return solutions;
}
// |q|² times the rotation of a quaternion.
std::array<std::array<Polynomial, 3>, 3> TurnedBy(const Polynomial& q0, const Polynomial& q1,
                                                  const Polynomial& q2, const Polynomial& q3) {
  return {{{Square(q0) + Square(q1) - Square(q2) - Square(q3), 2 * (q1 * q2 - q0 * q3),
            2 * (q1 * q3 + q0 * q2)},
           {2 * (q1 * q2 + q0 * q3), Square(q0) - Square(q1) + Square(q2) - Square(q3),
            2 * (q2 * q3 - q0 * q1)},
           {2 * (q1 * q3 - q0 * q2), 2 * (q2 * q3 + q0 * q1),
            Square(q0) - Square(q1) - Square(q2) + Square(q3)}}};
}
bool IsReal(const Solution& solution) {
  return std::ranges::all_of(solution,
                             [](const auto& v) { return std::abs(v.second.imag()) < 1e-7; });
}
#define MBV_NEEDS_PHC()                                   \
  ASSERT_EQ(std::system("command -v phc > /dev/null"), 0) \
      << "scripts/setup --tests installs phcpack"

Mechanism FromModelText(const std::string& text) {
  LoadResult result = LoadModelText(text, "modes.yaml");
  EXPECT_TRUE(result.mechanism.has_value()) << result.diagnostics.Text();
  return result.mechanism.value_or(Mechanism());
}
Mechanism FromModelFile(const std::string& path) {
  LoadResult result = LoadModel(SourcePath(path));
  EXPECT_TRUE(result.mechanism.has_value()) << result.diagnostics.Text();
  return result.mechanism.value_or(Mechanism());
}
std::vector<NamedCoordinate> DrivesOf(const Mechanism& m) {
  std::vector<NamedCoordinate> drives;
  for (size_t d = 0; d < m.drives.size(); ++d) {
    drives.push_back({m.drives[d].name, {Coordinate::Kind::kDrive, static_cast<int>(d), 0}});
  }
  return drives;
}
AssemblyModes ModesFor(const Mechanism& m, const std::vector<double>& drives, bool curves = true) {
  const VecX values =
      Eigen::Map<const VecX>(drives.data(), static_cast<Eigen::Index>(drives.size()));
  return FindModes(m, DrivesOf(m), values, {.curves = curves, .threads = 2});
}

// Three telescopic legs in a plane [Innocenti, Parenti-Castelli 1998].
std::string PlanarRobot() {
  std::string text = R"(
name: planar
gravity: [0, 0, 0]
)";
  const double bx = (17.04 * 17.04 + 20.84 * 20.84 - 16.54 * 16.54) / (2 * 17.04);
  const double by = std::sqrt(20.84 * 20.84 - bx * bx);
  const std::array<std::array<double, 4>, 3> legs = {
      {{0, 0, 0, 0}, {15.91, 0, 17.04, 0}, {0, 10, bx, by}}};
  std::string joints = "joints:\n", drives = "drives:\n", world, platform, bodies;
  for (int i = 0; i < 3; ++i) {
    const auto& [ax, ay, px, py] = legs.at(static_cast<size_t>(i));
    world += fmt::format("A{}: [{}, {}, 0], ", i, ax, ay);
    platform += fmt::format("B{}: [{:.17g}, {:.17g}, 0], ", i, px, py);
    bodies += fmt::format(
        "  cyl{0}: {{mass: 1, inertia: [1, 1, 1]}}\n"
        "  rod{0}: {{mass: 1, inertia: [1, 1, 1]}}\n",
        i);
    // A pose of the robot: B1 = (−8.7, 12.2), −0.987 rad.
    const double x = -8.7 + std::cos(-0.987) * px - std::sin(-0.987) * py;
    const double y = 12.2 + std::sin(-0.987) * px + std::cos(-0.987) * py;
    const double angle = std::atan2(y - ay, x - ax), length = std::hypot(x - ax, y - ay);
    joints += fmt::format(
        "  A{0}: {{kind: revolute, parent: world.A{0}, child: cyl{0}, axis: z, guess: {1}}}\n"
        "  P{0}: {{kind: prismatic, parent: cyl{0}, child: rod{0}, axis: x, guess: {2}, range: "
        "[0.5, 100]}}\n"
        "  B{0}: {{kind: revolute, parent: rod{0}, child: platform.B{0}, axis: z, guess: {3}}}\n",
        i, angle, length, -0.987 - angle);
    drives += fmt::format("  rho{0}: {{kind: joint, joint: P{0}}}\n", i);
  }
  text += fmt::format(
      "world: {{frames: {{{}}}}}\nbodies:\n  platform: {{mass: 1, inertia: [1, 1, 1], frames: "
      "{{{}}}}}\n{}",
      world, platform, bodies);
  return text + joints + drives + "outputs: {platform: platform}\n";
}

TEST(Modes, APlanarRobotHasThoseOfItsPolynomials) {
  MBV_NEEDS_PHC();
  const Mechanism robot = FromModelText(PlanarRobot());
  const double bx = (17.04 * 17.04 + 20.84 * 20.84 - 16.54 * 16.54) / (2 * 17.04);
  const double by = std::sqrt(20.84 * 20.84 - bx * bx);
  const Polynomial x("x"), y("y"), c("c"), s("s");
  for (const auto& [rho, real] : {std::pair(std::vector{14.98, 15.38, 12.0}, 6u),
                                  std::pair(std::vector{14.98, 20.0, 15.0}, 4u)}) {
    const std::vector<Solution> all = SolveByPhc(
        {Square(x) + Square(y) - rho[0] * rho[0],
         Square(x + 17.04 * c - 15.91) + Square(y + 17.04 * s) - rho[1] * rho[1],
         Square(x + bx * c - by * s) + Square(y + bx * s + by * c - 10.0) - rho[2] * rho[2],
         Square(c) + Square(s) - 1.0});
    EXPECT_EQ(all.size(), 6u);
    const AssemblyModes modes = ModesFor(robot, rho);
    EXPECT_TRUE(modes.settled);
    ASSERT_EQ(modes.modes.size(), real) << modes.starts;
    size_t matched = 0;
    for (const Solution& solution : all) {
      if (!IsReal(solution)) continue;
      for (const AssemblyMode& mode : modes.modes) {
        const double yaw = std::atan2(solution.at("s").real(), solution.at("c").real());
        if (std::abs(mode.outputs(0, 0) - solution.at("x").real()) < 1e-8 &&
            std::abs(mode.outputs(0, 1) - solution.at("y").real()) < 1e-8 &&
            std::abs(std::remainder(mode.outputs(0, 5) - yaw, 2 * pi)) < 1e-9) {
          ++matched;
        }
      }
    }
    EXPECT_EQ(matched, real);
    // A leg that is longer by a thousandth is another problem.
    const AssemblyModes other = ModesFor(robot, {rho[0] * 1.001, rho[1], rho[2]});
    for (const AssemblyMode& mode : other.modes) {
      for (const Solution& solution : all) {
        EXPECT_GT(std::hypot(mode.outputs(0, 0) - solution.at("x").real(),
                             mode.outputs(0, 1) - solution.at("y").real()),
                  1e-4);
      }
    }
  }
}

// Poses of a platform on six legs of given lengths: p = 2 g q*, |q|² = 1 [Study; Wampler 1996].
struct Hexapod {
  std::array<Vec3, 6> base, top;
  explicit Hexapod(double lopsided = 0.0) {
    const double R = 0.48, r = 0.30, gap = pi / 3 - std::acos(0.8);
    const std::array<double, 6> b = {gap / 2,
                                     2 * pi / 3 - gap / 2,
                                     2 * pi / 3 + gap / 2,
                                     4 * pi / 3 - gap / 2,
                                     4 * pi / 3 + gap / 2,
                                     -gap / 2};
    const std::array<double, 6> t = {pi / 3 - gap / 2, pi / 3 + gap / 2,     pi - gap / 2,
                                     pi + gap / 2,     5 * pi / 3 - gap / 2, -pi / 3 + gap / 2};
    for (size_t i = 0; i < 6; ++i) {
      base.at(i) = R * Vec3(std::cos(b.at(i)), std::sin(b.at(i)), 0.0);
      top.at(i) = r * Vec3(std::cos(t.at(i)), std::sin(t.at(i)), 0.0);
      const auto k = static_cast<double>(i);
      base.at(i) += lopsided * Vec3(std::sin(2 * k), std::cos(3 * k), std::sin(5 * k + 1));
      top.at(i) += lopsided * Vec3(std::cos(k), std::sin(4 * k), std::cos(2 * k + 2));
    }
  }
  [[nodiscard]] std::vector<Solution> Solve(const std::vector<double>& legs) const {
    std::array<Polynomial, 4> q, g;
    for (size_t k = 0; k < 4; ++k) {
      q.at(k) = Polynomial("q" + std::to_string(k));
      g.at(k) = Polynomial("g" + std::to_string(k));
    }
    const auto& [q0, q1, q2, q3] = q;
    const auto& [g0, g1, g2, g3] = g;
    const std::array<Polynomial, 3> p = {2 * (q0 * g1 - g0 * q1 - g2 * q3 + g3 * q2),
                                         2 * (q0 * g2 - g0 * q2 - g3 * q1 + g1 * q3),
                                         2 * (q0 * g3 - g0 * q3 - g1 * q2 + g2 * q1)};
    // Rᵀ p.
    const std::array<Polynomial, 3> w = {2 * (q0 * g1 - g0 * q1 - q2 * g3 + q3 * g2),
                                         2 * (q0 * g2 - g0 * q2 - q3 * g1 + q1 * g3),
                                         2 * (q0 * g3 - g0 * q3 - q1 * g2 + q2 * g1)};
    const Polynomial n = Square(q0) + Square(q1) + Square(q2) + Square(q3);
    const std::array<std::array<Polynomial, 3>, 3> R = TurnedBy(q0, q1, q2, q3);
    std::vector<Polynomial> equations;
    for (size_t i = 0; i < 6; ++i) {
      const Vec3 &a = base.at(i), &b = top.at(i);
      // |p + R b − a|² = l², homogeneous in (q, g).
      Polynomial equation = 4 * (Square(g0) + Square(g1) + Square(g2) + Square(g3)) +
                            (a.squaredNorm() + b.squaredNorm() - legs[i] * legs[i]) * n;
      for (int k = 0; k < 3; ++k) {
        equation = equation + 2 * b[k] * w.at(static_cast<size_t>(k)) -
                   2 * a[k] * p.at(static_cast<size_t>(k));
        for (int j = 0; j < 3; ++j) {
          equation =
              equation - 2 * a[k] * b[j] * R.at(static_cast<size_t>(k)).at(static_cast<size_t>(j));
        }
      }
      equations.push_back(equation);
    }
    equations.push_back(q0 * g0 + q1 * g1 + q2 * g2 + q3 * g3);
    equations.push_back(0.81 * q0 + 0.63 * q1 - 0.47 * q2 + 0.93 * q3 - 1.0);
    std::vector<Solution> poses;
    for (const Solution& s : SolveByPhc(equations)) {
      std::complex<double> norm = 0.0;
      for (const char* k : {"q0", "q1", "q2", "q3"}) norm += s.at(k) * s.at(k);
      if (std::abs(norm) > 1e-6) poses.push_back(s);
    }
    return poses;
  }
};

// The six lengths at a pose of the platform.
std::vector<double> LegsAt(const Hexapod& hexapod, const Vec3& p, const Mat3& R) {
  std::vector<double> legs;
  for (size_t i = 0; i < 6; ++i) {
    legs.push_back((p + R * hexapod.top.at(i) - hexapod.base.at(i)).norm());
  }
  return legs;
}

// Legs without mass between points.
std::string HexapodModel(const Hexapod& hexapod, double height) {
  std::string base, top, legs;
  const std::vector<double> lengths = LegsAt(hexapod, Vec3(0, 0, height), Mat3::Identity());
  for (size_t i = 0; i < 6; ++i) {
    const Vec3 &a = hexapod.base.at(i), &b = hexapod.top.at(i);
    base += fmt::format("B{}: [{:.17g}, {:.17g}, {:.17g}], ", i, a[0], a[1], a[2]);
    top += fmt::format("A{}: [{:.17g}, {:.17g}, {:.17g}], ", i, b[0], b[1], b[2]);
    legs += fmt::format("  leg{0}: {{kind: distance, from: world.B{0}, to: platform.A{0}}}\n", i);
  }
  return fmt::format(R"(
name: hexapod
world: {{frames: {{{}}}}}
bodies: {{platform: {{mass: 1, inertia: [1, 1, 1], frames: {{{}}}}}}}
joints:
  float: {{kind: free, parent: world, child: platform, guess: [0, 0, {}, 0, 0, 0], closure: false}}
drives:
{}
outputs: {{platform: platform}}
)",
                     base, top, height, legs);
}

// Each real solution is a mode, and each mode one of them.
void ExpectSamePoses(const AssemblyModes& modes, const std::vector<Solution>& all) {
  size_t matched = 0, real = 0;
  for (const Solution& solution : all) {
    if (!IsReal(solution)) continue;
    ++real;
    const auto at = [&](const char* k) { return solution.at(k).real(); };
    const Eigen::Quaterniond q(at("q0"), at("q1"), at("q2"), at("q3"));
    Vec3 p = Vec3::Zero();
    if (solution.contains("g0")) {
      const Eigen::Quaterniond g(at("g0"), at("g1"), at("g2"), at("g3"));
      p = 2 * (g * q.conjugate()).vec() / q.squaredNorm();
    }
    for (const AssemblyMode& mode : modes.modes) {
      const Vec3 rpy = mode.outputs.row(0).tail<3>();
      const Mat3 R =
          (Eigen::AngleAxisd(rpy[2], Vec3::UnitZ()) * Eigen::AngleAxisd(rpy[1], Vec3::UnitY()) *
           Eigen::AngleAxisd(rpy[0], Vec3::UnitX()))
              .toRotationMatrix();
      if ((Vec3(mode.outputs.row(0).head<3>()) - p).norm() < 1e-7 &&
          (R - q.normalized().toRotationMatrix()).norm() < 1e-7) {
        ++matched;
      }
    }
  }
  EXPECT_EQ(matched, real);
  EXPECT_EQ(modes.modes.size(), real);
}

TEST(Modes, AHexapodHasThoseOfItsPolynomials) {
  MBV_NEEDS_PHC();
  const Hexapod hexapod(0.05);
  const std::vector<double> legs = LegsAt(hexapod, Vec3(0, 0, 0.35), Mat3::Identity());
  const std::vector<Solution> all = hexapod.Solve(legs);
  EXPECT_EQ(all.size(), 40u);
  const AssemblyModes modes = ModesFor(FromModelText(HexapodModel(hexapod, 0.35)), legs);
  EXPECT_TRUE(modes.settled);
  EXPECT_GE(modes.modes.size(), 8u);
  ExpectSamePoses(modes, all);
}

TEST(Modes, AShippedHexapodWithManyJointsHasAsMany) {
  // Its legs' joints change nothing; the mirror image below the base is one way of each pair.
  const AssemblyModes modes = ModesFor(FromModelFile("/models/stewart/model.yaml"),
                                       LegsAt(Hexapod(), Vec3(0, 0, 0.4), Mat3::Identity()));
  EXPECT_TRUE(modes.settled);
  EXPECT_EQ(modes.modes.size(), 8u);
}

// Three limbs whose axes meet in one point; home has all coordinates zero.
TEST(Modes, ASphericalWristHasThoseOfItsPolynomials) {
  MBV_NEEDS_PHC();
  const std::array<Vec3, 3> u = {Vec3(1, 0.1, 0).normalized(), Vec3(-0.1, 1, 0.2).normalized(),
                                 Vec3(0.1, -0.2, 1).normalized()};
  std::array<Vec3, 3> w, v;
  for (size_t i = 0; i < 3; ++i) {
    w.at(i) = Mat3(Eigen::AngleAxisd(1.4, u.at((i + 1) % 3))) * u.at(i);
    v.at(i) = Mat3(Eigen::AngleAxisd(1.5, u.at(i))) *
              Mat3(Eigen::AngleAxisd(0.2, u.at((i + 2) % 3))) * w.at(i);
  }
  std::string bodies = "  platform: {mass: 1, com: [0, 0, 0.1], inertia: [1, 1, 1]}\n", joints,
              drives;
  const auto axis = [](const Vec3& a) {
    return fmt::format("[{:.17g}, {:.17g}, {:.17g}]", a[0], a[1], a[2]);
  };
  for (size_t i = 0; i < 3; ++i) {
    bodies += fmt::format(
        "  near{0}: {{mass: 1, com: [0.1, 0, 0], inertia: [1, 1, 1]}}\n"
        "  far{0}: {{mass: 1, com: [0, 0.1, 0], inertia: [1, 1, 1]}}\n",
        i);
    joints += fmt::format(
        "  A{0}: {{kind: revolute, parent: world, child: near{0}, axis: {1}}}\n"
        "  B{0}: {{kind: revolute, parent: near{0}, child: far{0}, axis: {2}}}\n"
        "  C{0}: {{kind: revolute, parent: far{0}, child: platform, axis: {3}}}\n",
        i, axis(u.at(i)), axis(w.at(i)), axis(v.at(i)));
    drives += fmt::format("  m{0}: {{kind: joint, joint: A{0}}}\n", i);
  }
  const Mechanism wrist =
      FromModelText("name: wrist\ngravity: [0, 0, 0]\nbodies:\n" + bodies + "joints:\n" + joints +
                    "drives:\n" + drives + "outputs: {platform: platform}\n");
  const std::vector<double> drives_at = {0.1, -0.2, 0.15};
  // wᵢ(θᵢ)·R vᵢ = wᵢ·vᵢ, homogeneous in q.
  std::array<Polynomial, 4> q;
  for (size_t k = 0; k < 4; ++k) q.at(k) = Polynomial("q" + std::to_string(k));
  const auto& [q0, q1, q2, q3] = q;
  const std::array<std::array<Polynomial, 3>, 3> R = TurnedBy(q0, q1, q2, q3);
  std::vector<Polynomial> equations = {0.81 * q0 + 0.63 * q1 - 0.47 * q2 + 0.93 * q3 - 1.0};
  for (size_t i = 0; i < 3; ++i) {
    const Vec3 turned = Mat3(Eigen::AngleAxisd(drives_at[i], u.at(i))) * w.at(i);
    Polynomial equation =
        -w.at(i).dot(v.at(i)) * (Square(q0) + Square(q1) + Square(q2) + Square(q3));
    for (int j = 0; j < 3; ++j) {
      for (int k = 0; k < 3; ++k) {
        equation = equation +
                   turned[j] * v.at(i)[k] * R.at(static_cast<size_t>(j)).at(static_cast<size_t>(k));
      }
    }
    equations.push_back(equation);
  }
  const std::vector<Solution> all = SolveByPhc(equations);
  EXPECT_EQ(all.size(), 8u);
  const AssemblyModes modes = ModesFor(wrist, drives_at);
  EXPECT_TRUE(modes.settled);
  ExpectSamePoses(modes, all);
}

// docs/results/ankles.md: with the cranks at home the foot has four poses, and for the foot level
// each crank two.
TEST(Modes, AnAnkleHasThoseThatAreKnown) {
  const Mechanism ankle = FromModelFile("/tests/mechanisms/servo_ankle.yaml");
  VecX home(static_cast<Eigen::Index>(ankle.drives.size()));
  for (Eigen::Index d = 0; d < home.size(); ++d) {
    home[d] = HomeValue(ankle, {Coordinate::Kind::kDrive, static_cast<int>(d), 0});
  }
  const AssemblyModes modes = FindModes(ankle, DrivesOf(ankle), home, {.threads = 2});
  EXPECT_TRUE(modes.settled);
  ASSERT_EQ(modes.modes.size(), 4u);
  // Of these, the one that is not home is the cranks' other way within half a turn.
  const double roll = modes.modes[1].outputs(0, 3), pitch = modes.modes[1].outputs(0, 4);
  EXPECT_NEAR(roll * 180 / pi, 128.7, 0.05);
  EXPECT_NEAR(pitch * 180 / pi, -66.9, 0.05);
  // With the foot's joint as at home, two ways for each crank.
  std::vector<NamedCoordinate> joint;
  for (NamedCoordinate& named : NamedJointCoordinates(ankle)) {
    if (named.name == "upper" || named.name == "lower") joint.push_back(std::move(named));
  }
  ASSERT_EQ(joint.size(), 2u);
  EXPECT_EQ(FindModes(ankle, joint, VecX::Zero(2), {.threads = 2}).modes.size(), 4u);
}

// Elbows of a five-bar's limbs: beyond type 2 each working mode has the same set, the lens of two
// circles less the two inner ones, by drives of its own.
TEST(Modes, TheSetOfEachWorkingModeIsFound) {
  const Mechanism five_bar = FromModelFile("/models/friction_five_bar/model.yaml");
  SetArguments arguments;
  arguments.over = {"x", "y"};
  arguments.cross_singularities = true;
  arguments.flood.resolution = 40;
  Diagnostics diagnostics;
  const auto question = ReadQuestion(five_bar, arguments, &diagnostics);
  ASSERT_TRUE(question.has_value()) << diagnostics.Text();
  const ModesOfPose found = FindModesOfPose(*question, false, true, 2, {}, &diagnostics);
  ASSERT_EQ(found.of.size(), 1u) << diagnostics.Text();
  ASSERT_EQ(found.of[0].second.modes.size(), 4u);
  const double lens = 2 * 0.36 * std::acos(0.25) - 0.15 * std::sqrt(4 * 0.36 - 0.09);
  for (const AssemblyMode& mode : found.of[0].second.modes) {
    const Mechanism at_way = WithHomeAt(five_bar, mode);
    for (size_t d = 0; d < at_way.drives.size(); ++d) {
      const double value = HomeValue(at_way, {Coordinate::Kind::kDrive, static_cast<int>(d), 0});
      EXPECT_NEAR(std::remainder(value - mode.drives[static_cast<Eigen::Index>(d)], 2 * pi), 0.0,
                  1e-10);
    }
    const auto asked = ReadQuestion(at_way, arguments, &diagnostics);
    ASSERT_TRUE(asked.has_value()) << diagnostics.Text();
    const ReachableSet set = ComputeReachableSet(*asked, arguments);
    EXPECT_TRUE(set.agree) << set.verdict;
    EXPECT_NEAR(set.traced.measure, lens - 2 * pi * 0.01, 1e-9);
  }
}

// Sections of the joint space of the planar robot over ρ₁ [Zein, Wenger, Chablat 2008].

// Of the platform's angle with all lengths: |p(α)|² Δ² = ρ₁² Δ², a trigonometric polynomial whose
// roots are the ways to close; with its first three derivatives.
std::array<double, 4> Characteristic(double rho1, double rho2, double rho3, double alpha) {
  const double bx = (17.04 * 17.04 + 20.84 * 20.84 - 16.54 * 16.54) / (2 * 17.04);
  const Eigen::Vector2d b2(17.04, 0), b3(bx, std::sqrt(20.84 * 20.84 - bx * bx));
  const auto value = [&](double angle) {
    const Eigen::Rotation2Dd R(angle);
    const Eigen::Vector2d m = R * b2 - Eigen::Vector2d(15.91, 0),
                          n = R * b3 - Eigen::Vector2d(0, 10);
    const double u = rho2 * rho2 - rho1 * rho1 - m.squaredNorm();
    const double w = rho3 * rho3 - rho1 * rho1 - n.squaredNorm();
    const Eigen::Vector2d p(u * n[1] - w * m[1], -u * n[0] + w * m[0]);  // 2 Δ p
    const double delta = m[0] * n[1] - m[1] * n[0];
    return p.squaredNorm() - 4 * rho1 * rho1 * delta * delta;
  };
  // By its Fourier coefficients, which end at 3.
  std::array<double, 4> derivatives{};
  constexpr int n = 16;
  for (int k = -3; k <= 3; ++k) {
    std::complex<double> c = 0.0;
    for (int i = 0; i < n; ++i) {
      c += value(2 * pi * i / n) * std::polar(1.0, -2 * pi * i * k / n) / double(n);
    }
    std::complex<double> term = c * std::polar(1.0, k * alpha);
    for (double& derivative : derivatives) {
      derivative += term.real();
      term *= std::complex<double>(0.0, k);
    }
  }
  return derivatives;
}

// `start`: ρ₂ and ρ₃ that close.
void ExpectAllCusps(double rho1, const Eigen::Vector2d& start, size_t curves) {
  const Mechanism robot = FromModelText(PlanarRobot());
  std::vector<NamedCoordinate> drives = DrivesOf(robot);
  std::rotate(drives.begin(), drives.begin() + 1, drives.end());
  const JointSpaceCurves found = TraceJointSpace(robot, drives, Vec3(start[0], start[1], rho1), 2);
  ASSERT_TRUE(found.summary.ok()) << found.summary.message;
  if (curves > 0) {
    EXPECT_EQ(found.curves.size(), curves);
  }
  for (const Cusp& cusp : found.cusps) {
    const double rho2 = cusp.drives[1], rho3 = cusp.drives[2], alpha = cusp.outputs(0, 5);
    const auto f = Characteristic(rho1, rho2, rho3, alpha);
    EXPECT_LT(std::abs(f[0]), 1e-9 * std::abs(f[3]));
    EXPECT_LT(std::abs(f[1]), 1e-9 * std::abs(f[3]));
    EXPECT_LT(std::abs(f[2]), 1e-9 * std::abs(f[3]));
    // A thousandth aside it is none.
    const auto aside = Characteristic(rho1, rho2 * 1.001, rho3, alpha);
    EXPECT_GT(std::abs(aside[0]) + std::abs(aside[1]), 1e-8 * std::abs(aside[3]));
  }
  // All cusps by polynomials: J's determinant vanishes, and its slope along the kernel.
  const Polynomial x("x"), y("y"), c("c"), s("s");
  const double bx = (17.04 * 17.04 + 20.84 * 20.84 - 16.54 * 16.54) / (2 * 17.04);
  const double by = std::sqrt(20.84 * 20.84 - bx * bx);
  const std::array<std::array<Polynomial, 2>, 3> foot = {
      {{x, y},
       {x + 17.04 * c - 15.91, y + 17.04 * s},
       {x + bx * c - by * s, y + bx * s + by * c - 10.0}}};
  const std::array<std::array<Polynomial, 2>, 3> turned = {
      {{0.0, 0.0}, {-17.04 * s, 17.04 * c}, {-bx * s - by * c, bx * c - by * s}}};
  std::array<std::array<Polynomial, 3>, 3> J;
  for (size_t i = 0; i < 3; ++i) {
    J.at(i) = {foot.at(i)[0], foot.at(i)[1],
               foot.at(i)[0] * turned.at(i)[0] + foot.at(i)[1] * turned.at(i)[1]};
  }
  const auto cross = [&](size_t i, size_t j) {
    const auto &a = J.at(i), &b = J.at(j);
    return std::array<Polynomial, 3>{a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2],
                                     a[0] * b[1] - a[1] * b[0]};
  };
  const auto kernel = cross(0, 1);
  const Polynomial D = kernel[0] * J[2][0] + kernel[1] * J[2][1] + kernel[2] * J[2][2];
  const Polynomial cusp =
      D.By("x") * kernel[0] + D.By("y") * kernel[1] + (D.By("s") * c - D.By("c") * s) * kernel[2];
  size_t real = 0;
  for (const Solution& solution :
       SolveByPhc({Square(x) + Square(y) - rho1 * rho1, Square(c) + Square(s) - 1.0, D, cusp})) {
    if (!IsReal(solution)) continue;
    const double X = solution.at("x").real(), Y = solution.at("y").real();
    const double C = solution.at("c").real(), S = solution.at("s").real();
    const double rho2 = std::hypot(X + 17.04 * C - 15.91, Y + 17.04 * S);
    const double rho3 = std::hypot(X + bx * C - by * S, Y + bx * S + by * C - 10.0);
    const auto f = Characteristic(rho1, rho2, rho3, std::atan2(S, C));
    const bool is_cusp = std::abs(f[0]) + std::abs(f[1]) + std::abs(f[2]) < 1e-6 * std::abs(f[3]);
    if (!is_cusp || std::min(rho2, rho3) < 0.5) continue;  // the model's ranges end curves there
    ++real;
    EXPECT_EQ(std::ranges::count_if(found.cusps,
                                    [&](const Cusp& k) {
                                      return std::hypot(k.drives[1] - rho2, k.drives[2] - rho3) <
                                             1e-6;
                                    }),
              1)
        << rho2 << " " << rho3;
  }
  EXPECT_EQ(found.cusps.size(), real);
}

TEST(JointSpace, CuspsOfAPlanarRobotAreTripleRootsAndAllOfThem) {
  MBV_NEEDS_PHC();
  ExpectAllCusps(14.98, {15.38, 12.0}, 4);
  for (const double rho1 : {1.0, 2.0, 3.0, 5.0, 8.0, 11.0, 17.0, 20.0, 30.0, 60.0}) {
    // Of a pose with that leg.
    const double bx = (17.04 * 17.04 + 20.84 * 20.84 - 16.54 * 16.54) / (2 * 17.04);
    const Eigen::Vector2d p = rho1 * Eigen::Vector2d(std::cos(0.6), std::sin(0.6));
    const Eigen::Rotation2Dd R(0.3);
    const Eigen::Vector2d b2 = p + R * Eigen::Vector2d(17.04, 0) - Eigen::Vector2d(15.91, 0);
    const Eigen::Vector2d b3 =
        p + R * Eigen::Vector2d(bx, std::sqrt(20.84 * 20.84 - bx * bx)) - Eigen::Vector2d(0, 10);
    ExpectAllCusps(rho1, {b2.norm(), b3.norm()}, 0);
  }
}

}  // namespace
}  // namespace mbv
