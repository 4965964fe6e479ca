// Ten thousand random cases: what 240 bits give lies in what 113 bits enclose.
#include <fmt/format.h>
#include <gtest/gtest.h>
#include <random>
#include <string>

#include "features/certify/certify.h"
#include "features/certify/exact_numbers.h"
#include "model_file/load_model.h"

namespace mbv {
namespace {

class Random {
 public:
  explicit Random(std::uint64_t seed) : engine_(seed) {}
  double Between(double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(engine_);
  }
  int Below(int n) { return std::uniform_int_distribution<int>(0, n - 1)(engine_); }
  Vec3 Point() { return {Between(-0.6, 0.6), Between(-0.6, 0.6), Between(-0.6, 0.6)}; }
  Vec3 Axis() {
    const Vec3 v = Point();
    return v.norm() < 0.1 ? Axis() : v.normalized();
  }

 private:
  std::mt19937_64 engine_;
};

std::string Words(const Vec3& v) {
  return fmt::format("[{:.17g}, {:.17g}, {:.17g}]", v.x(), v.y(), v.z());
}

// Random mass, centre and inertia: of point masses on three axes, I1 + I2 > I3.
std::string BodyText(const std::string& name, const std::string& frames, Random* random) {
  const double m = random->Between(0.1, 5.0), a = random->Between(0.01, 0.1),
               b = random->Between(0.01, 0.1), c = random->Between(0.01, 0.1);
  return fmt::format("  {}: {{mass: {:.17g}, com: {}, inertia: {}, frames: {{{}}}}}\n", name, m,
                     Words(random->Point()), Words(m * Vec3(b + c, a + c, a + b)), frames);
}

// Bodies that hang on the world or on earlier ones by joints of random kinds, all driven.
std::string Tree(Random* random) {
  std::string bodies, joints, drives;
  const int n = 2 + random->Below(3);
  for (int k = 0; k < n; ++k) {
    const int parent = random->Below(k + 1);
    bodies += BodyText(fmt::format("b{}", k),
                       fmt::format("m: {{position: {}, rotation: {{rpy: {}}}}}",
                                   Words(random->Point()), Words(random->Point())),
                       random);
    constexpr std::array kKinds = {"revolute", "prismatic", "cylindrical", "universal"};
    const std::string kind = kKinds[static_cast<size_t>(random->Below(4))];
    const Vec3 axis = random->Axis(), axis2 = axis.unitOrthogonal();
    joints += fmt::format("  j{0}: {{kind: {1}, parent: {2}, child: b{0}, axis: {3}{4}}}\n", k,
                          kind, parent == 0 ? "world.f" : fmt::format("b{}.m", parent - 1),
                          Words(axis), kind == "universal" ? ", axis2: " + Words(axis2) : "");
    const int coordinates = kind == "cylindrical" || kind == "universal" ? 2 : 1;
    for (int c = 0; c < coordinates; ++c) {
      drives += fmt::format("  d{0}_{1}: {{kind: joint, joint: j{0}, coordinate: {1}}}\n", k, c);
    }
  }
  return fmt::format("world: {{frames: {{f: {}}}}}\nbodies:\n{}joints:\n{}drives:\n{}",
                     Words(random->Point()), bodies, joints, drives);
}

// A loop in space of hinge, ball, universal joint and hinge, with one degree of freedom.
std::string SpatialLoop(Random* random) {
  const Vec3 P0 = random->Point(), A = P0 + random->Axis() * random->Between(0.1, 0.3),
             B = A + random->Axis() * random->Between(0.4, 0.8),
             P3 = B + random->Axis() * random->Between(0.3, 0.6);
  const Vec3 axis = random->Axis();
  return fmt::format(
      "world: {{frames: {{P0: {}, P3: {}}}}}\nbodies:\n{}{}{}joints:\n"
      "  a: {{kind: revolute, parent: world.P0, child: b1, axis: {}}}\n"
      "  b: {{kind: spherical, parent: b1.end, child: b2}}\n"
      "  d: {{kind: revolute, parent: world.P3, child: b3, axis: {}}}\n"
      "  c: {{kind: universal, parent: b3.end, child: b2.end, axis: {}, axis2: {}, closure: "
      "true}}\n"
      "drives:\n  d0_0: {{kind: joint, joint: a}}\n",
      Words(P0), Words(P3), BodyText("b1", "end: " + Words(A - P0), random),
      BodyText("b2", "end: " + Words(B - A), random),
      BodyText("b3", "end: " + Words(B - P3), random), Words(random->Axis()), Words(random->Axis()),
      Words(axis), Words(axis.unitOrthogonal()));
}

// A body on six legs of variable length between random points.
std::string Hexapod(Random* random) {
  std::string feet, tops, drives;
  for (int k = 0; k < 6; ++k) {
    const double angle = 1.05 * k;
    const Vec3 around(std::cos(angle), std::sin(angle), 0.0),
        other(std::cos(angle + 0.5), std::sin(angle + 0.5), 0.0);
    feet += fmt::format("{}f{}: {}", k == 0 ? "" : ", ", k, Words(around + 0.2 * random->Point()));
    tops += fmt::format("{}t{}: {}", k == 0 ? "" : ", ", k,
                        Words(0.5 * (k % 2 == 0 ? other : around) + 0.2 * random->Point()));
    drives += fmt::format("  d{0}_0: {{kind: distance, from: world.f{0}, to: b.t{0}}}\n", k);
  }
  return fmt::format(
      "world: {{frames: {{{}, up: [0, 0, 1]}}}}\nbodies:\n{}joints:\n"
      "  j: {{kind: free, parent: world.up, child: b}}\ndrives:\n{}",
      feet, BodyText("b", tops, random), drives);
}

struct RandomCase {
  Mechanism mechanism;
  Motion motion;
};

// All drives about home, with random amplitudes, frequencies and phases; loads of random
// directions.
std::optional<RandomCase> Draw(std::uint64_t seed) {
  Random random(seed);
  const std::string parts = seed % 4 == 0   ? Hexapod(&random)
                            : seed % 4 == 1 ? SpatialLoop(&random)
                                            : Tree(&random);
  LoadResult loaded =
      LoadModelText(fmt::format("name: drawn\ngravity: {}\n{}", Words(9.81 * random.Axis()), parts),
                    "drawn.yaml");
  EXPECT_TRUE(loaded.mechanism.has_value()) << seed << "\n" << parts << loaded.diagnostics.Text();
  if (!loaded.mechanism) return {};
  RandomCase drawn{*std::move(loaded.mechanism),
                   {.duration_s = 1.0, .sample_s = 0.5, .commands = {}, .loads = {}}};
  for (size_t d = 0; d < drawn.mechanism.drives.size(); ++d) {
    const Coordinate coordinate{Coordinate::Kind::kDrive, static_cast<int>(d), 0};
    Profile profile = Constant(HomeValue(drawn.mechanism, coordinate));
    profile.terms.emplace_back(
        SineTerm{random.Between(0.01, 0.03), random.Between(0.2, 2.0), random.Between(-3.0, 3.0)});
    drawn.motion.commands.push_back({drawn.mechanism.drives[d].name, {{coordinate, 1.0}}, profile});
  }
  return drawn;
}

// The finer value lies in the coarser enclosure, moved by `off` radii.
bool Holds(const ProvedValue& coarse, const ProvedValue& fine, double off = 0.0) {
  const exact::Finest middle =
      exact::Finest(coarse.text.c_str()) + exact::Finest(off) * exact::Finest(coarse.radius);
  return boost::multiprecision::lower(abs(middle - exact::Finest(fine.text.c_str()))) <=
         coarse.radius + fine.radius;
}

TEST(CertifyRandom, TenThousandFineValuesLieInCoarseEnclosures) {
  size_t values = 0, held = 0, moved = 0, mechanisms = 0, refused = 0;
  for (std::uint64_t seed = 0; mechanisms < 200 || values < 10000; ++seed) {
    ASSERT_LT(seed, 400u) << values;
    const std::optional<RandomCase> drawn = Draw(seed);
    ASSERT_TRUE(drawn.has_value());
    const Certificate a = Certify(drawn->mechanism, drawn->motion, {}, {.samples = 0}),
                      b = Certify(drawn->mechanism, drawn->motion, {},
                                  {.samples = 0, .least_bits = 240});
    ASSERT_EQ(a.samples.size(), b.samples.size()) << seed;
    size_t of_it = 0;
    for (size_t i = 0; i < a.samples.size(); ++i) {
      const SampleProof &coarse = a.samples[i], &fine = b.samples[i];
      // Commands that a mechanism cannot follow, or singular poses.
      if (!coarse.proved() || coarse.bits != 113 || !fine.proved()) {
        ++refused;
        continue;
      }
      ASSERT_EQ(fine.bits, 240);
      ASSERT_EQ(coarse.values.size(), fine.values.size());
      for (size_t k = 0; k < coarse.values.size(); ++k) {
        const ProvedValue &x = coarse.values[k], &y = fine.values[k];
        ASSERT_EQ(x.channel, y.channel);
        ++of_it;
        held += Holds(x, y) ? 1 : 0;
        moved += Holds(x, y, 3.0) && Holds(x, y, -3.0) ? 1 : 0;
        EXPECT_TRUE(Holds(x, y)) << "seed " << seed << " " << x.channel << " " << x.text << " ± "
                                 << x.radius << " " << y.text;
      }
    }
    values += of_it;
    mechanisms += of_it > 0 ? 1 : 0;
  }
  fmt::print("{} of {} values of {} mechanisms; {} samples without\n", held, values, mechanisms,
             refused);
  EXPECT_EQ(held, values);
  EXPECT_GE(values, 10000u);
  EXPECT_GE(mechanisms, 200u);
  EXPECT_LT(refused, mechanisms / 10);
  // An enclosure that is off by three of its radii holds none, but what is exact (radius 0).
  EXPECT_LT(moved, values / 10);
}

}  // namespace
}  // namespace mbv
