// Warnings about a model that is possible but hardly meant: lengths in millimetres, inertias in
// kg mm² or about another point than the centre of mass, gravity in mm/s², rotors in kg cm² or
// stated twice, friction in percent, leads in millimetres, couplings that lock. All are warnings.
//
// They are recognised by density. Nothing solid is denser than osmium (22 600 kg/m³), so a body
// whose lengths are millimetres taken for metres has less than 2.3e-5 kg per cubic metre of its
// extent, and one whose inertia is in kg mm² less than 1e-3 kg per cubic metre of its radius of
// gyration: ships and flywheels do not come near either.
#include <fmt/format.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "mechanism/reach.h"
#include "model_file/model_checks.h"

namespace mbv::internal {
namespace {

constexpr double kThinnest = 22600e-9;   // [kg/m³], mass / extent³
constexpr double kThinnestCloud = 1e-3;  // [kg/m³], mass / (radius of gyration)³
constexpr double kFarOut = 10.0;         // lengths of the body, or of the mechanism
constexpr double kNoMass = 1e-6;         // share of the heaviest body: stands in for nothing
constexpr double kTooWide = 1.05;        // second moment over the largest that the extent allows
// The same where the shift to the origin would explain it: bodies drawn with thick ends could be so
// wide, but then not by chance what an even body has about its origin, to this share.
constexpr double kHardlySoWide = 0.7, kExplained = 0.1;
constexpr size_t kMostNames = 4;

struct Points {
  std::vector<Vec3> p;

  void Add(const Vec3& point) {
    if (point.allFinite()) p.push_back(point);
  }
  void AddBall(const Vec3& centre, double radius) {
    Add(centre - Vec3::Constant(radius));
    Add(centre + Vec3::Constant(radius));
  }
  void Add(const Shape& shape) {
    if (const auto* box = std::get_if<Box>(&shape.geometry)) {
      const Vec3 half = 0.5 * (box->X_BG.linear().cwiseAbs() * box->size);
      Add(box->X_BG.translation() - half);
      Add(box->X_BG.translation() + half);
    } else if (const auto* ball = std::get_if<Ball>(&shape.geometry)) {
      AddBall(ball->p_centre, ball->radius);
    } else if (const auto* capsule = std::get_if<Capsule>(&shape.geometry)) {
      AddBall(capsule->p_from, capsule->radius);
      AddBall(capsule->p_to, capsule->radius);
    } else if (const auto* cylinder = std::get_if<Cylinder>(&shape.geometry)) {
      AddBall(cylinder->p_from, cylinder->radius);
      AddBall(cylinder->p_to, cylinder->radius);
    } else if (const auto* mesh = std::get_if<Mesh>(&shape.geometry)) {
      for (const Vec3& vertex : mesh->surface->vertices) Add(mesh->X_BG * vertex);
    }
  }
  [[nodiscard]] Vec3 low() const {
    Vec3 value = p.front();
    for (const Vec3& point : p) value = value.cwiseMin(point);
    return value;
  }
  [[nodiscard]] Vec3 high() const {
    Vec3 value = p.front();
    for (const Vec3& point : p) value = value.cwiseMax(point);
    return value;
  }
  /// Diagonal of the bounding box [m].
  [[nodiscard]] double extent() const { return p.empty() ? 0.0 : (high() - low()).norm(); }
};

// Everything that is known to be on a body: named frames, joints, ends of drives and springs,
// shapes.
Points PointsOf(const Mechanism& mechanism, int body) {
  Points points;
  const Body& described = mechanism.bodies[static_cast<size_t>(body)];
  for (const NamedFrame& frame : described.frames) points.Add(frame.X_BF.translation());
  for (const Shape& shape : described.shapes) points.Add(shape);
  for (const Joint& joint : mechanism.joints) {
    if (joint.parent == body) points.Add(joint.X_PF.translation());
    if (joint.child == body) points.Add(joint.X_CM.translation());
  }
  const auto add_ends = [&](const auto& line) {
    if (line.body_from == body) points.Add(line.p_from);
    if (line.body_to == body) points.Add(line.p_to);
  };
  for (const Drive& drive : mechanism.drives) {
    if (const auto* leg = std::get_if<DistanceDrive>(&drive.kind)) add_ends(*leg);
  }
  for (const SpringDamper& spring : mechanism.springs) add_ends(spring);
  for (const Bushing& bushing : mechanism.bushings) {
    if (bushing.parent == body) points.Add(bushing.X_PF.translation());
    if (bushing.child == body) points.Add(bushing.X_CM.translation());
  }
  return points;
}

struct PlausibilityWarning {
  std::string text, hint;
};

double Cubed(double x) { return x * x * x; }

std::optional<PlausibilityWarning> WarnCentreOfMass(const Body& body, const Points& points,
                                                    double length_m) {
  if (points.p.empty()) return {};
  const Vec3 c = body.p_BoBcm_B;
  const double away = (c - c.cwiseMax(points.low()).cwiseMin(points.high())).norm();
  if (away <= kFarOut * length_m || body.mass >= kThinnestCloud * Cubed(away)) return {};
  return PlausibilityWarning{
      fmt::format("its centre of mass is {:.4g} m away from the rest of it, which measures "
                  "{:.4g} m",
                  away, length_m),
      "lengths are in metres; is the centre of mass in millimetres?"};
}

std::optional<PlausibilityWarning> WarnInertia(const Body& body, double length_m) {
  const double largest =
      Eigen::SelfAdjointEigenSolver<Mat3>(body.I_Bcm_B, Eigen::EigenvaluesOnly).eigenvalues()[2];
  const double k = std::sqrt(largest / body.mass);
  if (!(k > kFarOut * length_m) || body.mass >= kThinnestCloud * Cubed(k)) return {};
  return PlausibilityWarning{
      fmt::format("its radius of gyration is {:.4g} m, the body measures {:.4g} m", k, length_m),
      "inertias are in kg m²; are they in kg mm² (1e-6 kg m²)?"};
}

// The second moments about the centre of mass, Σ m (p − c)², are largest when all mass sits at the
// ends of the body: m (high − c)(c − low) per axis. Inertias about the body's origin exceed that,
// and what is left without the share m |c|² of the shift does not, or is an even body's.
std::optional<PlausibilityWarning> WarnPoint(const Body& body, Points points) {
  const Vec3 c = body.p_BoBcm_B;
  points.Add(c);
  const double possible = body.mass * (points.high() - c).dot(c - points.low());
  const double given = 0.5 * body.I_Bcm_B.trace(), shift = body.mass * c.squaredNorm();
  const bool impossible = given > kTooWide * possible && given - shift < possible / kTooWide;
  // An even box of this extent, with and without the thickness of what is drawn.
  const Vec3 sides = points.high() - points.low();
  const Vec3 spine = (sides.array() - sides.minCoeff()).matrix();
  const bool explained =
      given > kHardlySoWide * possible &&
      given - shift > (1.0 - kExplained) * body.mass * spine.squaredNorm() / 12.0 &&
      given - shift < (1.0 + kExplained) * body.mass * sides.squaredNorm() / 12.0;
  if (!impossible && !explained) return {};
  const Mat3 moved =
      body.I_Bcm_B - body.mass * (c.squaredNorm() * Mat3::Identity() - c * c.transpose());
  const Vec3 principal =
      Eigen::SelfAdjointEigenSolver<Mat3>(moved, Eigen::EigenvaluesOnly).eigenvalues();
  if (!(principal[0] >= -1e-9 * principal[2])) return {};
  if (principal[0] + principal[1] < principal[2] * (1.0 - 1e-6)) return {};
  return PlausibilityWarning{
      fmt::format("its inertia about the centre of mass is {:.3g} times the largest that a body of "
                  "this extent can have",
                  given / possible),
      "inertias are about the centre of mass, in body axes; are these about the body's origin?"};
}

void WarnAboutLengths(const Mechanism& mechanism, const std::vector<int>& thin, double extent_m,
                      ModelReport* report) {
  if (thin.empty()) return;
  const Body& first = mechanism.bodies[static_cast<size_t>(thin.front())];
  std::string others;
  for (size_t k = 1; k < std::min(thin.size(), kMostNames); ++k) {
    others += (k == 1 ? "" : ", ") + mechanism.bodies[static_cast<size_t>(thin[k])].name;
  }
  if (thin.size() > kMostNames) others += fmt::format(" and {} more", thin.size() - kMostNames);
  report->AtBody(mechanism, static_cast<size_t>(thin.front()), Severity::kWarning,
                 fmt::format("it has {:.4g} kg and measures {:.4g} m, thinner than any solid{}",
                             first.mass, extent_m, others.empty() ? "" : "; so do " + others),
                 "lengths are in metres; are these millimetres?");
}

void WarnAboutGravity(const Mechanism& mechanism, ModelReport* report) {
  constexpr double kLeast = 500.0, kMost = 3e4;  // [m/s²]: 9810 mm/s², and less on the moon
  const double g = mechanism.gravity_W.norm();
  if (g < kLeast || g > kMost) return;
  report->AtFile(Severity::kWarning,
                 fmt::format("gravity is {:.6g} m/s², {:.3g} times that of the earth", g, g / 9.81),
                 "gravity is in m/s²; is it in mm/s²?");
}

// The joint coordinate that a drive moves; null for legs.
const JointDrive* JointOf(const Mechanism& mechanism, int drive) {
  return std::get_if<JointDrive>(&mechanism.drives[static_cast<size_t>(drive)].kind);
}

bool AreOnOneCoordinate(const Mechanism& mechanism, const Motor& motor,
                        const ForceElement& element) {
  if (element.drive >= 0) return element.drive == motor.drive;
  const JointDrive* at = JointOf(mechanism, motor.drive);
  return at != nullptr && element.bushing < 0 && element.joint == at->joint &&
         element.coordinate == at->coordinate;
}

// Forces of a mechanism with a rotor contain it, and a motor's torque adds its own once more.
void WarnAboutRotorsTwice(const Mechanism& mechanism, ModelReport* report) {
  constexpr double kSame = 0.05;
  for (const Motor& motor : mechanism.motors) {
    const double of_motor = motor.gear_ratio * motor.gear_ratio * motor.rotor_inertia;
    for (const ForceElement& element : mechanism.elements) {
      const auto* rotor = std::get_if<RotorLaw>(&element.law);
      if (rotor == nullptr || !AreOnOneCoordinate(mechanism, motor, element)) continue;
      if (!(std::abs(rotor->reflected() - of_motor) <= kSame * of_motor) || of_motor == 0.0) {
        continue;
      }
      const std::string& drive = mechanism.drives[static_cast<size_t>(motor.drive)].name;
      report->AtFile(
          Severity::kWarning,
          fmt::format("motors.{}: its rotor, {:.4g} behind the gear, is element '{}', too, and "
                      "counts twice in the motor's torque",
                      drive, of_motor, element.name),
          "under `elements` drive forces contain it; then leave out `rotor_inertia` of the motor");
    }
  }
}

// A rotor that is a multiple of the whole mechanism is hardly one: kg cm² are 1e-4 kg m².
void WarnAboutRotorSizes(const Mechanism& mechanism, ModelReport* report) {
  constexpr double kMostTurning = 10.0, kMostSliding = 1e3;  // of the mechanism's own
  double mass = 0.0;
  for (const Body& body : mechanism.bodies) mass += body.mass;
  const double length_m = CharacteristicLength(mechanism);
  const auto check = [&](const std::string& name, double inertia, double reflected, bool length) {
    const double own = length ? mass : mass * length_m * length_m;
    if (!(own > 0.0) || !(reflected > (length ? kMostSliding : kMostTurning) * own)) return;
    report->AtFile(Severity::kWarning,
                   fmt::format("{}: rotor inertia {:.4g} kg m² weighs {:.4g} {} behind its gear, "
                               "{:.3g} times the whole mechanism",
                               name, inertia, reflected, length ? "kg" : "kg m²", reflected / own),
                   "rotor inertias are in kg m²; is it in kg cm² (1e-4 kg m²)?");
  };
  for (const ForceElement& element : mechanism.elements) {
    const auto* rotor = std::get_if<RotorLaw>(&element.law);
    if (rotor == nullptr) continue;
    check("elements." + element.name, rotor->inertia, rotor->reflected(),
          ActsOnLength(mechanism, element));
  }
  for (const Motor& motor : mechanism.motors) {
    if (!motor.turns) continue;
    const Drive& drive = mechanism.drives[static_cast<size_t>(motor.drive)];
    check("motors." + drive.name, motor.rotor_inertia,
          motor.gear_ratio * motor.gear_ratio * motor.rotor_inertia,
          PositionUnit(mechanism, drive) == "m");
  }
}

void WarnAboutFriction(const Mechanism& mechanism, ModelReport* report) {
  constexpr double kMost = 2.0;  // rubber on rough ground stays below
  for (const ForceElement& element : mechanism.elements) {
    const auto* friction = std::get_if<FrictionLaw>(&element.law);
    if (friction == nullptr || friction->coupling >= 0) continue;
    if (!(friction->coefficient > kMost)) continue;
    report->AtFile(Severity::kWarning,
                   fmt::format("elements.{}: friction coefficient {:.4g}, more than any pair of "
                               "materials has",
                               element.name, friction->coefficient),
                   "it is friction force by normal force, 0.12 rather than 12 (percent)");
  }
}

// Screws: one coordinate of a joint is a length, the other an angle, and they follow each other.
void WarnAboutLeads(const Mechanism& mechanism, ModelReport* report) {
  constexpr double kMost_m = 1.0;
  const double length_m = CharacteristicLength(mechanism);
  const double most_m = length_m > 0.0 ? std::min(kMost_m, length_m) : kMost_m;
  for (const Coupling& coupling : mechanism.couplings) {
    if (coupling.terms.size() != 2 || coupling.terms[0].joint != coupling.terms[1].joint) continue;
    const Joint& joint = mechanism.joints[static_cast<size_t>(coupling.terms[0].joint)];
    double of_length = 0.0, of_angle = 0.0;
    for (const Coupling::Term& term : coupling.terms) {
      (IsLength(joint.kind, term.coordinate) ? of_length : of_angle) = term.polynomial.front();
    }
    if (of_length == 0.0 || of_angle == 0.0) continue;
    const double lead_m = 2.0 * std::numbers::pi * std::abs(of_angle / of_length);
    if (!(lead_m > most_m)) continue;
    report->AtFile(Severity::kWarning,
                   fmt::format("couplings.{}: joint '{}' moves {:.4g} m with each turn, in a "
                               "mechanism of {:.4g} m",
                               coupling.name, joint.name, lead_m, CharacteristicLength(mechanism)),
                   "leads are in metres; is it in millimetres (lead_mm)?");
  }
}

// Coordinates that couplings alone leave no DOF, wherever they are: gears in a circle. Slopes
// are taken away from home, where a cam may rest.
void WarnAboutLocks(const Mechanism& mechanism, ModelReport* report) {
  if (mechanism.couplings.size() < 2) return;
  std::vector<std::pair<int, int>> coordinates;
  const auto column_of = [&](const Coupling::Term& term) {
    const std::pair at(term.joint, term.coordinate);
    const auto found = std::ranges::find(coordinates, at);
    if (found == coordinates.end()) coordinates.push_back(at);
    return std::ranges::find(coordinates, at) - coordinates.begin();
  };
  for (const Coupling& coupling : mechanism.couplings) {
    for (const Coupling::Term& term : coupling.terms) (void)column_of(term);
  }
  MatX rows = MatX::Zero(static_cast<Eigen::Index>(mechanism.couplings.size()),
                         static_cast<Eigen::Index>(coordinates.size()));
  for (size_t c = 0; c < mechanism.couplings.size(); ++c) {
    for (const Coupling::Term& term : mechanism.couplings[c].terms) {
      const Eigen::Index k = column_of(term);
      const double q = 0.3 + 0.17 * static_cast<double>(k);
      double slope = 0.0, power = 1.0;
      for (size_t i = 0; i < term.polynomial.size(); ++i, power *= q) {
        slope += static_cast<double>(i + 1) * term.polynomial[i] * power;
      }
      rows(static_cast<Eigen::Index>(c), k) = slope;
    }
    rows.row(static_cast<Eigen::Index>(c)).normalize();
  }
  const Eigen::JacobiSVD<MatX> svd(rows, Eigen::ComputeFullV);
  const Eigen::Index rank = (svd.singularValues().array() > 1e-9).count();
  std::string locked;
  for (Eigen::Index k = 0; k < rows.cols(); ++k) {
    // A direction that no coupling forbids moves it.
    const MatX free = svd.matrixV().rightCols(rows.cols() - rank);
    if (free.cols() > 0 && free.row(k).norm() > 1e-9) continue;
    locked += fmt::format(
        "{}'{}'", locked.empty() ? "" : ", ",
        mechanism.joints[static_cast<size_t>(coordinates[static_cast<size_t>(k)].first)].name);
  }
  if (locked.empty()) return;
  report->AtFile(
      Severity::kWarning,
      fmt::format("the couplings lock joint {}: together they leave it no degree of freedom",
                  locked),
      "a joint that is held is fixed or prescribed; do ratios in a circle multiply to 1?");
}

}  // namespace

void CheckPlausible(const Mechanism& mechanism, ModelReport* report) {
  double heaviest_kg = 0.0;
  for (const Body& body : mechanism.bodies) heaviest_kg = std::max(heaviest_kg, body.mass);
  const double mechanism_m = CharacteristicLength(mechanism);
  std::vector<int> thin;
  double extent_m = 0.0;
  for (int b = 1; b < static_cast<int>(mechanism.bodies.size()); ++b) {
    const Body& body = mechanism.bodies[static_cast<size_t>(b)];
    if (!(body.mass > kNoMass * heaviest_kg)) continue;
    const Points points = PointsOf(mechanism, b);
    const double extent = points.extent();
    if (body.mass < kThinnest * Cubed(extent)) {
      if (thin.empty()) extent_m = extent;
      thin.push_back(b);
      continue;  // the rest would be its consequences
    }
    const double length_m = std::max(extent, extent > 0.0 ? 0.0 : mechanism_m);
    for (const auto& warning : {WarnCentreOfMass(body, points, length_m),
                                WarnInertia(body, length_m), WarnPoint(body, points)}) {
      if (!warning) continue;
      report->AtBody(mechanism, static_cast<size_t>(b), Severity::kWarning, warning->text,
                     warning->hint);
      break;
    }
  }
  WarnAboutLengths(mechanism, thin, extent_m, report);
  WarnAboutGravity(mechanism, report);
  WarnAboutRotorsTwice(mechanism, report);
  WarnAboutRotorSizes(mechanism, report);
  WarnAboutFriction(mechanism, report);
  WarnAboutLeads(mechanism, report);
  WarnAboutLocks(mechanism, report);
}

}  // namespace mbv::internal
