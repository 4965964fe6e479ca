// Mechanism: a closed-loop mechanism as data, resolved to numbers.
//
// The description is what all witnesses share. It is made by the loader (load_model.h) and then
// only read. Bodies are rigid; joints connect a frame F on the parent body to a frame M on the
// child body; F and M coincide when all joint coordinates are zero.
// The joint kinds and their coordinates: joint_kinds.h.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "base/types.h"
#include "math/triangle_mesh.h"
#include "mechanism/joint_kinds.h"

// Motors: what moves a drive, as its data sheet says. No witness knows them: they say what of the
// computed drive forces and speeds a motor can give.
//
//   n    gear ratio: motor speed / drive speed (a spindle of lead h: 2π/h per metre)
//   ω_m = n v                                                                               (1)
//   τ_m = F/(n η) where the motor drives, F v >= 0;  η F/n where it brakes                  (2)
//         + J_r n v̇                                                                         (3)
//
// Limits are symmetric: they hold for magnitudes of speed and torque, but for `least` and `most`,
// which have the sign of τ_m. A motor that turns has rad/s and N m, one that slides has m/s and N
// ("torque" and "speed" below stand for both).

namespace mbv {

/// A point of a torque–speed curve, at the motor.
struct CurvePoint {
  double speed = 0.0, torque = 0.0;
};

inline constexpr double kUnlimited = std::numeric_limits<double>::infinity();

/// The winding, which copper losses heat, in a housing: two bodies, as data sheets state them.
struct MotorThermal {
  double winding_to_housing = kNan;  ///< thermal resistance R1 [K/W]
  double housing_to_ambient = kNan;  ///< R2 [K/W]
  double winding_time = kNan;        ///< time constant τ1 [s]: heat capacity τ1/R1
  double housing_time = kNan;        ///< τ2 [s]: heat capacity τ2/R2
  double ambient_C = 25.0;           ///< [°C]
  double max_winding_C = kNan;       ///< [°C], > ambient_C
  double resistance_at_C = 25.0;     ///< winding temperature of Motor::resistance [°C]
  double resistance_growth = 0.0;    ///< of it per kelvin, copper: 0.0039 [1/K]
};

/// Limits of a gearbox: torque at its output, before a spindle; speed at its input.
struct MotorGearbox {
  double mean_torque = kUnlimited;       ///< mean of power `exponent` over revolutions
  double peak_torque = kUnlimited;       ///< repeatable: starting and stopping
  double emergency_torque = kUnlimited;  ///< momentary: emergency stops
  double mean_speed = kUnlimited, max_speed = kUnlimited;
  double exponent = 3.0;  ///< of the mean torque
};

/// A holding brake on the motor's shaft.
struct MotorBrake {
  double torque = kNan;        ///< static
  double energy = kUnlimited;  ///< of one emergency stop [J]
};

/// The DC link that all motors share: it takes what they feed back into its capacitor, and burns
/// the rest in a resistor.
struct DcLink {
  double efficiency = 1.0;         ///< of the inverters, in both directions; <= 1
  double capacitance = 0.0;        ///< [F]
  double voltage = kNan;           ///< of the supply, idle [V]
  double brake_voltage = kNan;     ///< at which the resistor is switched on, > voltage [V]
  double resistance = kNan;        ///< of the resistor [Ω]: it takes brake_voltage²/resistance
  double mean_power = kUnlimited;  ///< that the resistor bears for ever [W]
  double peak_power = kUnlimited;  ///< for short [W]
};

struct Motor {
  static constexpr double kNoLimit = kUnlimited;

  int drive = -1;                 ///< index into Mechanism::drives
  bool turns = true;              ///< else it slides
  double continuous = kNoLimit;   ///< torque that it can bear for ever (RMS)
  double peak = kNoLimit;         ///< torque that it can give for short
  double least = -kNoLimit;       ///< torque that it can give for short, with its sign: at a cable,
  double most = kNoLimit;         ///< which pulls only, one of both is 0; least < most
  double rated_speed = kNoLimit;  ///< up to it, `continuous` may be used
  double max_speed = kNoLimit;    ///< never faster
  double rotor_inertia = 0.0;     ///< J_r [kg m²], or mass of the slider [kg]
  double gear_ratio = 1.0;        ///< n > 0
  double spindle = 1.0;           ///< of n: 2π/lead behind the gearbox [1/m]; 1 without a lead
  double efficiency = 1.0;        ///< η of the gear, 0 < η <= 1
  double torque_constant = kNan;  ///< k_t [N m/A]; [N/A]
  double resistance = kNan;       ///< of the winding [Ω]
  double voltage = kNoLimit;      ///< of the supply [V]
  double continuous_current = kNoLimit, peak_current = kNoLimit;  ///< [A]
  /// Instead of `continuous` and `peak` constant over speed: increasing speeds, straight lines
  /// between; beyond the last point nothing is left.
  std::vector<CurvePoint> continuous_curve = {}, peak_curve = {};
  std::optional<MotorThermal> thermal = {};  ///< with torque_constant and resistance
  std::optional<MotorGearbox> gearbox = {};
  std::optional<MotorBrake> brake = {};

  [[nodiscard]] const char* torque_unit() const { return turns ? "N m" : "N"; }
  [[nodiscard]] const char* speed_unit() const { return turns ? "rad/s" : "m/s"; }
};

/// The torque that is left at a speed (its magnitude counts): the curve if there is one, else the
/// constant up to its highest speed, and zero beyond.
[[nodiscard]] double ContinuousTorque(const Motor& motor, double speed);
[[nodiscard]] double PeakTorque(const Motor& motor, double speed);
/// Whether `least` or `most` is a limit.
[[nodiscard]] bool HasSides(const Motor& motor);
/// Share of the motor's peak torque that a torque is, of the side on which it lies: infinite where
/// the motor gives none there.
[[nodiscard]] double PeakShare(const Motor& motor, double torque, double speed);

// What verdicts on a model name, whatever the witnesses say: exceptions to the loader's rules that
// the model allows, and what its source has and it has not.

struct ModelCaveat {
  enum class Kind {
    kAllowed,  ///< `allow:`, `closure_tolerance:`
    kLeftOut   ///< acts on forces in a robot's file (`left_out:`)
  };
  Kind kind = Kind::kLeftOut;
  std::string text;         ///< a sentence without its subject's file
  std::string source = {};  ///< of kLeftOut: element and attribute, "body gravcomp"; may be empty
};

/// The texts of one kind, each once.
[[nodiscard]] inline std::vector<std::string> TextsOf(const std::vector<ModelCaveat>& caveats,
                                                      ModelCaveat::Kind kind) {
  std::vector<std::string> texts;
  for (const ModelCaveat& caveat : caveats) {
    bool known = caveat.kind != kind;
    for (const std::string& text : texts) known = known || text == caveat.text;
    if (!known) texts.push_back(caveat.text);
  }
  return texts;
}

/// See math/bytes.h.
template <typename Visit>
void VisitMembers(Visit& visit, typename Visit::template Of<ModelCaveat>& caveat) {
  visit(caveat.kind), visit(caveat.text), visit(caveat.source);
}

/// Where a parameter's number comes from.
enum class Source { kUnstated, kPrinted, kAssumed, kCorrected };

struct Parameter {
  std::string name;
  double value = kNan;
  std::string unit;
  Source source = Source::kUnstated;
  std::string note;
  bool written_out = false;  ///< the model file states a number, not an expression of others
};

struct NamedFrame {
  std::string name;
  Pose X_BF = Pose::Identity();  ///< pose of the frame in its body
};

// Shapes are for pictures only.
struct Capsule {
  Vec3 p_from = Vec3::Zero(), p_to = Vec3::Zero();  ///< end points in the body frame [m]
  double radius = 0.01;                             ///< [m]
};
struct Cylinder {
  Vec3 p_from = Vec3::Zero(), p_to = Vec3::Zero();
  double radius = 0.01;
};
struct Box {
  Pose X_BG = Pose::Identity();  ///< pose of the box centre in the body frame
  Vec3 size = Vec3::Ones();      ///< full edge lengths [m]
};
struct Ball {
  Vec3 p_centre = Vec3::Zero();
  double radius = 0.01;
};
/// A surface from a file.
struct Mesh {
  Pose X_BG = Pose::Identity();  ///< pose of the file's frame in the body frame
  std::string file;              ///< as found
  Vec3 scale = Vec3::Ones();     ///< of the file's numbers, metres per unit; negative mirrors
  std::shared_ptr<const TriangleMesh> surface = {};  ///< scaled [m], in the file's frame; not null
};
struct Shape {
  std::variant<Capsule, Cylinder, Box, Ball, Mesh> geometry;
  std::string color = "steel";  ///< material name ("steel", "accent", …) or "#rrggbb[aa]"
};

struct Body {
  std::string name;
  double mass = 0.0;              ///< [kg], >= 0; 0 is a massless connecting piece
  Vec3 p_BoBcm_B = Vec3::Zero();  ///< centre of mass [m]
  Mat3 I_Bcm_B = Mat3::Zero();    ///< about the centre of mass, body axes [kg m²]
  /// Share of the weight that a force at the centre of mass carries, whoever exerts it; it counts
  /// as a load. Beyond 1 it lifts, below 0 it pulls down.
  double gravity_compensation = 0.0;
  std::vector<NamedFrame> frames;
  std::vector<Shape> shapes;
};

/// Cross section of a beam. Beam axes: x along the beam, y and z principal axes of the section.
struct Section {
  double area = kNan;     ///< A [m²]
  double I_y = kNan;      ///< ∫ z² dA [m⁴], bending in the x–z plane
  double I_z = kNan;      ///< ∫ y² dA [m⁴], bending in the x–y plane
  double torsion = kNan;  ///< St Venant's constant [m⁴]
};

/// A straight, uniform Euler–Bernoulli beam between two points of a body. A body with beams is
/// elastic: its joints sit on beam ends, which move with the beams; a body without is rigid. Beams
/// count in stiffness computations only (`mbverify stiffness`), never in dynamics.
struct Beam {
  std::string name;  ///< "BODY.BEAM", or the body's name if it has one beam only
  int body = 0;
  Vec3 p_from = Vec3::Zero(), p_to = Vec3::Zero();  ///< in the body frame [m]
  Mat3 R_BE = Mat3::Identity();                     ///< beam axes in the body: x from → to
  Section section;
  double youngs_modulus = kNan;  ///< E [Pa]
  double shear_modulus = kNan;   ///< G [Pa]

  [[nodiscard]] double length() const { return (p_to - p_from).norm(); }
};

struct CoordinateRange {
  double lower = -std::numeric_limits<double>::infinity();
  double upper = std::numeric_limits<double>::infinity();
};

struct Joint {
  std::string name;
  JointKind kind = JointKind::kFixed;
  int parent = 0;                ///< body index; 0 is the world
  Pose X_PF = Pose::Identity();  ///< joint frame on the parent
  int child = 0;
  Pose X_CM = Pose::Identity();          ///< joint frame on the child
  Vec3 axis = Vec3::UnitZ();             ///< unit; see joint_kinds.h
  Vec3 axis2 = Vec3::UnitX();            ///< unit; universal only
  std::array<double, 6> guess{};         ///< coordinates to start the home solution from
  std::array<double, 6> home{};          ///< coordinates at the solved home pose
  std::array<CoordinateRange, 6> range;  ///< limits, for reports and range checks
  /// Limit of a spherical joint's rotation angle, |log R_FM| [rad], for the same.
  double max_rotation = std::numeric_limits<double>::infinity();
  bool closure = false;  ///< true: cut by the spanning tree (a loop closure)
  /// Isostatic rule: this revolute/universal joint transmits a force only (as a ball would), which
  /// makes the reactions of an overconstrained loop definite. Kinematics of the mechanism must not
  /// change by it; the loader checks that by rank.
  bool transmits_force_only = false;
};

/// A drive on one coordinate of a joint: force/torque positive along the positive coordinate,
/// exerted by the parent on the child.
struct JointDrive {
  int joint = -1;
  int coordinate = 0;
};
/// A massless S-P-S leg between two points; position is their distance; positive force is thrust
/// (the leg pushes its ends apart).
struct DistanceDrive {
  int body_from = 0;
  Vec3 p_from = Vec3::Zero();  ///< in body_from's frame
  int body_to = 0;
  Vec3 p_to = Vec3::Zero();
};

struct Drive {
  std::string name;
  std::variant<JointDrive, DistanceDrive> kind;
  CoordinateRange range;
  double radius = 0.0;  ///< for pictures [m]; 0: chosen by the renderer
  /// Of the servo that holds the drive [N/m or N m/rad]; infinite: locked. Stiffness only.
  double stiffness = std::numeric_limits<double>::infinity();
  /// Its force contains what the gravity compensation of the bodies beyond its joint
  /// (BodiesBeyond()) does along the joint's axis: the drive exerts it. Revolute and prismatic tree
  /// joints only.
  bool compensates_gravity = false;
  /// What stands behind the letter of a quantity in figures, markup (plot/figure.h): "_{1}".
  std::string symbol = {};
};

/// A single-DOF joint whose motion is given (a ship's roll); it is driven, but its force is base
/// reaction and not compared as a drive.
struct Prescribed {
  std::string name;
  int joint = -1;
};

/// A frame whose pose is commanded or compared: components x, y, z, roll, pitch, yaw of X_RO.
struct Output {
  std::string name;
  int body = 0;
  Pose X_BO = Pose::Identity();
  int reference_body = 0;  ///< frame R lies on this body (0: the world)
  Pose X_RbR = Pose::Identity();
};

/// A linear spring-damper between two points (free length) — for users' own mechanisms.
struct SpringDamper {
  std::string name;
  int body_from = 0;
  Vec3 p_from = Vec3::Zero();
  int body_to = 0;
  Vec3 p_to = Vec3::Zero();
  double stiffness = 0.0;  ///< [N/m]
  double damping = 0.0;    ///< [N s/m]
  double free_length_m = 0.0;
};

/// A gear pair, belt, differential or mimic joint: Σ_k P_k(q_k) = 0 between joint coordinates, each
/// P_k a polynomial. It holds without play, loss or mass; its force λ acts on coordinate k as
/// λ dP_k/dq_k, exerted by the joint's parent on its child.
struct Coupling {
  struct Term {
    int joint = -1;
    int coordinate = 0;
    std::vector<double> polynomial;  ///< coefficients of q, q², …; at least one
  };
  std::string name;
  std::vector<Term> terms = {};  ///< at least two
  double constant = 0.0;         ///< of the sum
};

/// Viscous damping: force −c q̇.
struct DampingLaw {
  double damping = 0.0;  ///< c [N s/m or N m s/rad], >= 0
};
/// A spring: force −(F0 + k x + k2 x² + …), x = q − free.
struct SpringLaw {
  std::vector<double> polynomial;  ///< k, k2, … [N/m, N/m², … or N m/rad, …]; at least one
  double free = 0.0;               ///< [m or rad]
  double preload = 0.0;            ///< F0 [N or N m]
};
/// The axis of a rotor in the body that carries its bearings.
struct RotorAxis {
  int body = 0;
  Vec3 axis_B = Vec3::UnitZ();  ///< unit; the rotor turns about it with n q̇, seen from the body
};
/// A motor's rotor behind a gear: force −J n² q̈, known as armature. Without a carrier its axis
/// keeps its direction. With one, the rotor has the angular momentum J n q̇ a beyond that of a body
/// at rest in the carrier, whose inertia contains it: kinetic energy ½ J (n q̇)² + J n q̇ a·ω.
struct RotorLaw {
  double inertia = 0.0;  ///< J about the rotor's axis [kg m²], >= 0
  double ratio = 1.0;    ///< n: the rotor's rate by that of the coordinate [1 or rad/m], not 0
  std::optional<RotorAxis> carrier = std::nullopt;

  [[nodiscard]] double reflected() const { return ratio * ratio * inertia; }  ///< [kg m² or kg]
};

/// Dry friction: force −(Fc + (Fs − Fc) exp(−(q̇/vs)²) + S) sign q̇, S by what the joint bears
/// [Armstrong-Hélouvry 1991]; viscous friction beside it is damping. At rest the force lies
/// anywhere in ±(Fs + S), and with it drive forces within a band. With F the joint's reaction
/// force, F_n its part across the axis a, M its moment about M's origin,
///   S = μ (r |F_n| + r_t |a·F|),  with two bearings at ±ℓ/2 along a, which share F_n and M,
///   S = μ (r |F_n/2 + M × a/ℓ| + r |F_n/2 − M × a/ℓ| + r_t |a·F|);                            (1)
/// of a ball S = μ r |F| about each axis; of a coupling S = μ |Q|, Q its force along the
/// coordinate, beside which ε Q acts at any rate: what drives the coupling gives (1 + μ + ε) |Q|,
/// what it drives gets (1 − μ + ε) |Q|. A freewheel resists one sign of the rate only: the other
/// feels nothing, and at rest the force lies between 0 and Fs against that sign.
struct FrictionLaw {
  double coulomb = 0.0;        ///< Fc [N or N m], >= 0
  double breakaway = 0.0;      ///< Fs, >= Fc
  double stribeck_rate = 1.0;  ///< vs [m/s or rad/s] >= 0; 0: all that slides feels Fc
  double coefficient = 0.0;    ///< μ >= 0; 0: no friction by load
  double skew = 0.0;           ///< ε of a coupling, |ε| <= μ
  double radius = 1.0;         ///< r of a journal or ball [m], > 0; 1 along lengths
  double length = std::numeric_limits<double>::infinity();  ///< ℓ [m], > 0
  double thrust_radius = 0.0;  ///< r_t of the collar that bears the thrust [m], >= 0
  int coupling = -1;           ///< whose force it follows instead, index
  int resists = 0;             ///< sign of the only rate that it resists; 0: both

  [[nodiscard]] bool by_load() const { return coefficient > 0.0; }
  /// The most that S grows with a force [m or 1].
  [[nodiscard]] double per_load() const {
    return coefficient * (coupling >= 0 ? 1.0 : std::max(radius, thrust_radius));
  }
  /// What of Fc and Fs acts at a sign of the rate, towards smaller coordinates; at rest the middle
  /// of what may act.
  [[nodiscard]] double sense(int sign) const {
    return resists == 0 ? sign : sign == 0 ? 0.5 * resists : sign == resists ? sign : 0;
  }
  /// Half the width of what may act at rest, by Fs alone.
  [[nodiscard]] double half_band() const { return resists == 0 ? breakaway : 0.5 * breakaway; }
};

/// What acts beyond the ends of a way, and pushes back only: with the depth δ = q − upper (or lower
/// − q), e = k δⁿ and either damping c or dissipation a
///   N = e + c δ̇, c δ̇ within ±e [Modelica Standard Library, ElastoGap], (1) N = e (1 + a δ̇), at
///   least 0 [Hunt, Crossley 1975, eq. 2];  F = −N beyond upper, N below lower
struct StopLaw {
  double lower = -std::numeric_limits<double>::infinity();
  double upper = std::numeric_limits<double>::infinity();  ///< at least one is finite
  double stiffness = 0.0;                                  ///< k [N/mⁿ or N m/radⁿ], > 0
  double exponent = 1.0;                                   ///< n, >= 1
  double damping = 0.0;                                    ///< c [N s/m or N m s/rad], >= 0
  double dissipation = 0.0;                                ///< a [s/m or s/rad], >= 0
  /// ε of a rigid stop, 0 … 1: it exerts no force, and what meets it with the rate q̇ has −ε q̇
  /// afterwards. NaN: elastic.
  double restitution = kNan;

  [[nodiscard]] bool rigid() const { return !std::isnan(restitution); }
};

/// A characteristic curve: force over the coordinate or over its rate, continuous, cubic between
/// knots and straight beyond them; positive as a drive's force.
struct CurveLaw {
  struct Knot {
    double at = 0.0, force = 0.0;
    double slope_before = 0.0, slope_after = 0.0;  ///< of the force; beyond the ends, all the way
  };
  bool of_rate = false;     ///< over the rate, else over the coordinate
  std::vector<Knot> knots;  ///< at least two, `at` increasing
};

/// Curves over the coordinate at several rates: force over both, straight from rate to rate.
struct CurvesLaw {
  std::vector<double> rates;     ///< at least two, increasing [m/s or rad/s]
  std::vector<CurveLaw> curves;  ///< one per rate, over the coordinate, with knots at equal places
  bool held = false;             ///< beyond the first and the last rate; else straight on
};

/// Where no branch of an expression is fixed.
inline constexpr int kAnyBranch = -1;

/// A force that an expression gives, positive as a drive's.
struct ExpressionLaw {
  std::string text;  ///< of x, the coordinate, and v, its rate, with the values of parameters
  std::function<double(double position, double rate)> force;
  /// Where comparisons, abs, min … decide between formulas: the number of the branch that holds
  /// there, and the force by a branch wherever it is taken; empty where nothing decides.
  std::function<int(double position, double rate)> branch = {};
  std::function<double(int branch, double position, double rate)> on_branch = {};

  /// By this branch; kAnyBranch: by the one that holds.
  [[nodiscard]] double At(double position, double rate, int by_branch) const {
    const bool fixed = on_branch && by_branch != kAnyBranch;
    return fixed ? on_branch(by_branch, position, rate) : force(position, rate);
  }
  /// kAnyBranch where nothing decides.
  [[nodiscard]] int BranchAt(double position, double rate) const {
    return branch ? branch(position, rate) : kAnyBranch;
  }
};

/// Frames F on the parent and M on the child that a bushing joins. Its six coordinates are the
/// place of M's origin in F (0…2) [m] and the rotation vector log R_FM (3…5) [rad], both in F's
/// axes.
struct Bushing {
  std::string name;
  int parent = 0;
  Pose X_PF = Pose::Identity();
  int child = 0;
  Pose X_CM = Pose::Identity();
};

/// A foot on the ground. While it holds, a joint named as it ties its body to the ground: a ball in
/// a point, a hinge about a line, a weld of a sole. The joint's frame F has its origin in the
/// contact, z along the ground's normal and x along the line or the sole. Ground only pushes, and
/// friction is limited: witnesses compute with the joint, and what it bears is judged afterwards
/// (comparison/contact_load.h).
struct Contact {
  enum class Kind { kPoint, kLine, kSole };
  std::string name;
  Kind kind = Kind::kSole;
  int joint = -1;          ///< index; -1: the foot is lifted
  double friction = kNan;  ///< coefficient μ >= 0; NaN: not stated
  double torsion = kNan;   ///< moment about the normal per normal force that friction bears [m]
  /// What touches the ground in F's x, y [m]: of a sole a convex polygon, counter-clockwise, of a
  /// line its two ends; empty where it is not stated, and of points.
  std::vector<Eigen::Vector2d> outline;
};

/// Corners of the convex hull, counter-clockwise; fewer than three where it has no area.
[[nodiscard]] std::vector<Eigen::Vector2d> ConvexHull(std::vector<Eigen::Vector2d> points);

/// "point", "line", "sole".
[[nodiscard]] const char* WordOf(Contact::Kind kind);

/// What acts along one scalar coordinate q of a joint or a bushing or along the length q of a
/// distance drive or a spring; its force is positive as a drive's there, exerted by the joint's
/// parent on its child. Parts of the reactions are these forces no more than drive forces are.
///
/// A ball's rotation has no coordinates to act along: its three elements, of one law, have the
/// relative angular velocity about M's axes as rates (ActsOnBall()), and no position. With ω_FM of
/// M seen from F, a_k M's axes and ω_C, ω_P the bodies' angular velocities
///   q̇_k = a_k·ω_FM,  q̈_k = a_k·(ω̇_C − ω̇_P + ω_C × ω_P)                                         (1)
/// so that damping is the moment −c ω_FM, and a rotor (MuJoCo's armature) −J dω_FM/dt as M or F see
/// it; friction is limited about each axis by itself.
struct ForceElement {
  std::string name;
  int joint = -1, coordinate = 0;  ///< the coordinate, or …
  int drive = -1;                  ///< … the distance drive, or …
  int bushing = -1;                ///< … `coordinate` of this one, or …
  int spring = -1;                 ///< … the length of this one
  std::variant<DampingLaw, SpringLaw, RotorLaw, FrictionLaw, StopLaw, CurveLaw, CurvesLaw,
               ExpressionLaw>
      law;
};

/// What becomes of bodies in a robot's file that nothing ties to the world.
struct FloatingBase {
  std::string held = {};  ///< the body that is held; "": of those that hang together one, the root
  bool free = false;      ///< none is held: a free joint carries it
};

struct Mechanism {
  std::string name;
  std::string file;  ///< model.yaml it came from, as given
  std::string description;
  Vec3 gravity_W = Vec3(0, 0, -9.81);  ///< [m/s²]
  Vec3 up_W = Vec3::UnitZ();           ///< unit, for pictures: stated, or against gravity, or z
  std::vector<Parameter> parameters;   ///< with overrides applied
  std::vector<Body> bodies;            ///< bodies[0] is the world
  std::vector<Joint> joints;
  std::vector<Drive> drives;
  std::vector<Prescribed> prescribed;
  std::vector<Output> outputs;
  std::vector<SpringDamper> springs;
  std::vector<Coupling> couplings;
  std::vector<Bushing> bushings;
  std::vector<ForceElement> elements;
  std::vector<Motor> motors;      ///< at most one per drive; no witness reads them
  std::optional<DcLink> dc_link;  ///< of the motors
  std::vector<Beam> beams;        ///< of the elastic bodies; empty in most models

  std::vector<int> tree_joints;     ///< indices of the spanning tree's joints, parents first (every
                                    ///< non-world body is the outboard body of exactly one)
  std::vector<bool> tree_reversed;  ///< per tree joint: true if its child is the inboard body
  std::vector<Pose> X_WB_home;      ///< per body, the closed home pose

  std::vector<Contact> contacts;  ///< of which some may be joints above

  [[nodiscard]] int FindBody(const std::string& body_name) const;  ///< index or -1
  [[nodiscard]] int FindJoint(const std::string& joint_name) const;
  [[nodiscard]] int FindDrive(const std::string& drive_name) const;
  [[nodiscard]] int FindOutput(const std::string& output_name) const;
  [[nodiscard]] const NamedFrame* FindFrame(int body, const std::string& frame_name) const;
  /// Value of a parameter; the name must exist (MBV_DEMAND).
  [[nodiscard]] double ParameterValue(const std::string& parameter_name) const;
  [[nodiscard]] bool HasParameter(const std::string& parameter_name) const;
};

/// Takes springs out for which `goes(spring)` holds, with the elements along them.
template <typename Goes>
void EraseSprings(Mechanism* mechanism, const Goes& goes) {
  std::vector<int> at;
  int kept = 0;
  std::vector<SpringDamper> left;
  for (SpringDamper& spring : mechanism->springs) {
    const bool stays = !goes(spring);
    at.push_back(stays ? kept++ : -1);
    if (stays) left.push_back(spring);
  }
  mechanism->springs = std::move(left);
  std::erase_if(mechanism->elements, [&](ForceElement& element) {
    if (element.spring >= 0) element.spring = at[static_cast<size_t>(element.spring)];
    return element.spring < 0 && element.joint < 0 && element.drive < 0 && element.bushing < 0;
  });
}

/// How to read a force signal: printed in every report.
struct SignalSheet {
  std::string signal;  ///< channel name without the witness
  std::string acts_on;
  std::string exerted_by;
  std::string frame;     ///< frame and axis of the components
  std::string positive;  ///< what a positive value means
  std::string unit;
};

/// True if a force carries a share of some body's weight.
[[nodiscard]] bool HasGravityCompensation(const Mechanism& mechanism);

/// Unit of a drive's position ("m" or "rad") and of its force ("N" or "N m").
[[nodiscard]] std::string PositionUnit(const Mechanism& mechanism, const Drive& drive);
[[nodiscard]] std::string ForceUnit(const Mechanism& mechanism, const Drive& drive);
[[nodiscard]] SignalSheet SheetOf(const Mechanism& mechanism, const Drive& drive);
/// Word of an element's kind in model files.
[[nodiscard]] const char* WordOf(const ForceElement& element);
/// True if an element's coordinate is a length, false if it is an angle.
[[nodiscard]] bool ActsOnLength(const Mechanism& mechanism, const ForceElement& element);
/// True for the elements of a ball's rotation.
[[nodiscard]] bool ActsOnBall(const Mechanism& mechanism, const ForceElement& element);
/// Adds the three of a ball's rotation, NAME.x, NAME.y, NAME.z, of a joint of this kind.
void AddOfBall(const ForceElement& element, JointKind kind, std::vector<ForceElement>* elements);
/// Which smooth piece of a law a motion is on: another number beyond a corner, where forces are
/// continuous and their derivatives are not. Integrators step onto corners by it; no force is
/// computed from it.
[[nodiscard]] int PieceOf(const ForceElement& element, double position, double rate);
/// True for laws that have more than one piece with corners between.
[[nodiscard]] bool HasCorners(const ForceElement& element);
/// "rotor of joint 'hip'", for messages; with the coordinate's number where there are several.
[[nodiscard]] std::string Described(const Mechanism& mechanism, const ForceElement& element);
/// Rate of the coordinate of an element up to which it counts as at rest in a motion of this
/// length: 1e-6 rad, or of the characteristic length, in the time.
[[nodiscard]] double RestRate(const Mechanism& mechanism, const ForceElement& element,
                              double duration_s);
/// True for a rotor that its carrier turns.
[[nodiscard]] bool IsGyroscopic(const ForceElement& element);
/// "kx", "krz", "cry": what an element of a bushing is.
[[nodiscard]] std::string BushingWord(const ForceElement& element);
/// True for a stop that exerts impulses and no elastic force.
[[nodiscard]] bool IsRigidStop(const ForceElement& element);
/// True for dry friction that is not zero.
[[nodiscard]] bool HasFriction(const ForceElement& element);
/// Name of the first element with dry friction, or "".
[[nodiscard]] std::string FirstFriction(const Mechanism& mechanism);
/// Sheet of a joint's reaction: the wrench that the parent exerts on the child through the joint,
/// about M's origin, expressed in F. Channels: JOINT.reaction.{fx,fy,fz,mx,my,mz}.
[[nodiscard]] SignalSheet SheetOf(const Mechanism& mechanism, const Joint& joint);

}  // namespace mbv
