// What a serial model costs that stands in for joints driven through loops (ankles and knees with
// rods): maps from joints to motors, limits, reflected inertia, singularities, and by how much the
// serial model's motor torques are wrong.
//
//   ṁ = J q̇,  J = ∂m/∂q;   τ_q = Jᵀ τ_m                                                     (1)
//   full loop    τ_m = J⁻ᵀ (f_s + f_l + f_r)                                                  (2)
//   serial model τ_s = J₀⁻ᵀ (f_s + A q̈)                                                       (3)
//
// q: the n chosen joints; m: their n drives; forces along q: f_s of the links that the serial model
// has, f_l = M_l q̈ + c_l + g_l of the loop bodies and what acts at them, f_r = R q̈ + c_r of the
// rotors, c quadratic in q̇. J₀: at home. A: the diagonal nearest to R over the grid. The difference
// of (2) and (3) has four causes:
//
//   ratio     (J⁻ᵀ − J₀⁻ᵀ) (f_s + A q̈)        rotors   J⁻ᵀ (R − A) q̈                          (4)
//   velocity  J⁻ᵀ (c_l + c_r)                  bodies   J⁻ᵀ (M_l q̈ + g_l)
//
// Singularities as [Gosselin, Angeles 1990]: type 2 where J is singular and the drives do not hold
// the joints, type 1 where J⁻¹ is and the drives, at a dead centre, do not move them.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "base/diagnostics.h"
#include "base/json_text.h"
#include "features/code/code.h"
#include "mechanism/mechanism.h"
#include "mechanism/motion.h"
#include "report/document.h"

namespace mbv {

// Which drives move chosen joints of a robot through its loops, and the parts that forces are
// counted in: what a serial model of these joints has, and what it leaves out.

struct Transmission {
  std::vector<NamedCoordinate> joints;  ///< n, as chosen
  std::vector<int> drives;              ///< n that move them, by index into Mechanism::drives
  std::vector<CoordinateRange> ranges;  ///< per drive: its own, and that of its joint
  std::vector<NamedCoordinate> held;    ///< the other degrees of freedom, which stay at home
  std::vector<int> loop_bodies;         ///< that a serial model does not have: cranks and rods
  std::vector<int> toward_world;        ///< per body: joint on its way to the world, -1: none
  std::vector<bool> kept;               ///< per body: a serial model has it, or it is the world
  std::vector<std::string> notes;       ///< what is left out or taken otherwise

  /// The robot, rotors of its motors included as elements (RotorLaw) on their drives.
  Mechanism full;
  Mechanism without_rotors;  ///< the same without rotors of elements and motors
  /// Without what the loops add: loop bodies have no mass, and springs, dampers and friction act
  /// only where no loop body or drive of `drives` in a loop takes part. Along the joints it needs
  /// the forces that the robot needs with the loops cut away [virtual work].
  Mechanism serial;
  Mechanism loop_inertia;  ///< the loop bodies' masses alone: no gravity, no other forces

  [[nodiscard]] std::vector<Coordinate> coordinates() const;  ///< joints, then held
};

/// Coordinates of joints called `names`; nothing after an error: unknown, chosen twice, dependent
/// on each other, or not as many as the drives that move them. Drives too many that also move
/// joints on the way from the world to the chosen ones (a knee above an ankle) are held.
[[nodiscard]] std::optional<Transmission> FindTransmission(const Mechanism& mechanism,
                                                           const std::vector<std::string>& names,
                                                           Diagnostics* diagnostics);

/// The same robot with all that stays still, while the chosen joints move and the other degrees of
/// freedom are held, as part of the world: other legs, and the leg above an ankle. Maps, inertias
/// and forces along the joints are the same. Without outputs, contacts and beams.
[[nodiscard]] Mechanism MovingPart(const Mechanism& mechanism, const Transmission& transmission);

/// [rad or m] of a chosen joint.
struct StandinRange {
  std::string joint;
  double low = kNan, high = kNan;
};

/// A motion of the chosen joints to compare along.
struct StandinMotion {
  std::string name, text = {};     ///< of the scene
  std::vector<VecX> q, v, a = {};  ///< per sample, in the joints' order [rad or m, per s, s²]
};

struct StandinSettings {
  std::vector<StandinRange> ranges;  ///< others: the joint's limits, else home ± 30°
  int resolution = 0;                ///< poses along each joint; 0: by the number of joints
  double amplitude = 0.5;            ///< of the motion, by half the range
  double frequency_hz = 1.0;
  std::uint64_t seed = 1;
  std::vector<StandinMotion> motions = {};  ///< further scenes
};

enum class PoseStatus {
  kUsable,
  kOpen,        ///< the loops cannot be closed, or a matrix is singular
  kDriveRange,  ///< a drive is beyond its range
  kBeyond       ///< type 2: det J has another sign than at home
};
[[nodiscard]] const char* WordOf(PoseStatus status);

/// Causes in this order, then all together.
inline constexpr size_t kCauses = 4, kWhole = 4;
inline constexpr std::array<const char*, kCauses + 1> kCauseNames = {
    "constant ratio", "rotors", "velocity", "loop bodies", "all"};

/// One state. Per drive [N or N m].
struct StandinState {
  VecX v, a;                             ///< rates and accelerations of the joints
  VecX full;                             ///< (2), by the reference's balance of all bodies
  VecX serial;                           ///< (3)
  std::array<VecX, kCauses + 1> errors;  ///< (4); [kWhole]: full − serial, not their sum
  /// |sum of the causes − whole| by the largest term; NaN: the balance of all bodies has no
  /// answer, `full` is by (2).
  double sum_off = kNan;
};

struct StandinPose {
  VecX q;
  PoseStatus status = PoseStatus::kOpen;
  std::string where;    ///< drive or joint that ends the range
  VecX drives;          ///< m [m or rad]
  MatX J, M, R;         ///< of (1); n × n inertia of all, part of the rotors
  double least = kNan;  ///< singular values of J, scaled as `unit` says
  double largest = kNan;
  double map_error = kNan;  ///< |J⁻ᵀ J₀ᵀ − 1|, spectral, forces in one unit
  VecX torque_alone,
      speed_alone;  ///< per joint, the others without torque or speed; NaN: no limits
  double torque_any = kNan, speed_any = kNan;  ///< in every direction; NaN: units differ
  StandinState rest, moving;                   ///< at rest; with a velocity and acceleration drawn
  /// Positions of the drives that put the limbs together, all drives together; -1: not known.
  int ways = -1;
  int joint_poses =
      -1;  ///< poses of the joints over a turn that have these drives; -1: not counted
};

/// What puts a chosen joint's drive and the joints together.
struct StandinLimb {
  std::string kind;          ///< of StandinBranches::KindOf()
  double other_home = kNan;  ///< the drive's other position at home; NaN: there is none
  double apart = kNan;       ///< least distance of both ways at usable poses [rad or m]
  size_t apart_at = 0;       ///< its index in `poses`
  size_t other_way = 0;      ///< usable poses where the drive is on the way that it is not at home
};

/// How far a joint moves from home while the others stay there: to the first end.
struct StandinEnd {
  enum class Kind { kNone, kDriveRange, kDeadCentre, kOpen, kType2 };
  size_t joint = 0;
  bool up = false;
  double at = kNan;  ///< [rad or m]
  Kind kind = Kind::kNone;
  std::string where = {};  ///< drive or joint
};
[[nodiscard]] const char* WordOf(StandinEnd::Kind kind);

/// Median, 95th percentile (nearest rank) and worst of magnitudes.
struct Spread {
  double median = kNan, p95 = kNan, worst = kNan;
  size_t at = 0;  ///< index of the worst
};
[[nodiscard]] Spread SpreadOf(const std::vector<double>& magnitudes);

/// Errors over some states.
struct StandinScene {
  std::string name, text;
  size_t states = 0, left_out = 0;
  /// Per drive: 95th percentile of what the full loop needs, which errors are related to.
  std::vector<double> full_p95 = {};
  std::vector<std::array<Spread, kCauses + 1>> errors = {};  ///< per drive
  std::vector<VecX> worst_at = {};                           ///< per drive: q of the worst `all`
  double sum_off = 0.0;                                      ///< the largest; NaN: a state has none
};

struct StandinResult {
  std::vector<std::string> joints, drives, held, loop_bodies, notes;
  std::vector<std::string> joint_units, drive_units;  ///< "rad" or "m"
  std::vector<StandinRange> ranges;
  std::vector<std::string> range_of;  ///< per joint: where the range is from
  int resolution = 0;
  double amplitude = 0.0, frequency_hz = 0.0;
  VecX home, drives_home;
  MatX J_home;
  std::string unit;                               ///< of the singular values
  double least_home = kNan, largest_home = kNan;  ///< singular values of J_home, scaled
  std::vector<StandinPose> poses;                 ///< the last joint runs fastest
  VecX armature;                                  ///< A [kg m² or kg] per joint
  Spread inertia_off;                             ///< |R_ii − A_i| / A_i, all joints
  Spread coupling;                                ///< |R_ij| / √(R_ii R_jj)
  Spread map_error;                               ///< at usable poses; `at`: index in `poses`
  /// Poses of the least torque_any, speed_any; the first usable one where joints differ in unit.
  size_t worst_torque = 0, worst_speed = 0;
  VecX drive_forces, drive_speeds;  ///< limits by the motors, per drive; infinite: none
  bool torque_limits = false, speed_limits = false;  ///< of all drives
  std::vector<StandinScene> scenes;
  std::vector<StandinLimb> limbs;  ///< per drive
  std::vector<StandinEnd> ends;    ///< per joint: down, up
  /// Poses of the joints over a turn with the drives at home, that of home first; empty: not known.
  std::vector<VecX> poses_at_home;
  Diagnostics diagnostics;  ///< errors: nothing was computed

  [[nodiscard]] size_t CountOf(PoseStatus status) const;
  [[nodiscard]] size_t usable() const { return CountOf(PoseStatus::kUsable); }
};

/// The ways to put limbs together, in closed form: a crank, slider or cylinder on a drive, and one
/// rod (branches.cc, eq. 1). Limbs of other kinds are unknown.
class StandinBranches {
 public:
  /// Both outlive the object.
  StandinBranches(const Mechanism& mechanism, const Transmission& transmission);
  ~StandinBranches();

  /// "crank and rod", "slider and rod", "cylinder", "leg", "the joint itself"; "": unknown.
  [[nodiscard]] std::string KindOf(Eigen::Index drive) const;
  /// The limb of a drive counts as unknown from here on.
  void Recheck(Eigen::Index drive);
  /// (1) holds; true of unknown ones.
  [[nodiscard]] bool Fits(Eigen::Index drive, const VecX& q, double m) const;
  /// All positions of a drive at a pose of the joints: two, one or none. `apart`: of two of them.
  /// Of a known limb.
  [[nodiscard]] std::vector<double> Ways(Eigen::Index drive, const VecX& q, double* apart) const;
  /// All poses of the joints over a turn for positions of the drives; nothing with more than two
  /// joints, joints that slide, or unknown limbs. Two of them less than half a degree apart may be
  /// missed.
  [[nodiscard]] std::optional<std::vector<VecX>> Poses(const VecX& drives) const;

 private:
  struct Limb;
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// `progress` gets the share that is done.
[[nodiscard]] StandinResult ComputeStandin(const Mechanism& mechanism,
                                           const std::vector<std::string>& joints,
                                           const StandinSettings& settings,
                                           const std::function<void(double)>& progress = {});

// What replaces a hand-written stand-in, each with its verdict: code of the transmission and of
// what the serial model leaves out, a lookup table with bounds, and the serial robot as MJCF and
// URDF.
//
//   τ_m = J⁻ᵀ (τ_s + f_l + f_r)                                                             (1)
// τ_s: forces along the joints that the serial model needs; f_l + f_r: of loop bodies and rotors,
// in the code. With (1) nothing is left out.

/// A file of the serial robot, read back as its users would.
struct SerialFile {
  std::string name;
  std::string not_judged = {};  ///< why; "": it was
  /// Largest difference of the forces along the joints from the serial model's with the best
  /// constant armature, by their largest value.
  double difference = kNan;

  static constexpr double kLimit = 1e-9;
  [[nodiscard]] bool agrees() const { return not_judged.empty() && difference <= kLimit; }
};

struct StandinExport {
  CodeResult code;  ///< its judgements are those of (1) against the full loop
  std::vector<SerialFile> serial;
  std::vector<std::pair<std::string, std::string>> files;  ///< name, content

  [[nodiscard]] bool agrees() const;
};

/// The robot without its loop bodies: the chosen joints are driven, with `armature` [kg m² or kg]
/// each.
[[nodiscard]] Mechanism SerialRobot(const Transmission& transmission, const VecX& armature);

/// `name`: of the files.
[[nodiscard]] StandinExport ExportStandin(const Mechanism& mechanism, const StandinResult& result,
                                          const std::string& name,
                                          const std::function<void(double)>& progress = {});

[[nodiscard]] std::string ToText(const StandinExport& made);
[[nodiscard]] nlohmann::ordered_json ToJson(const StandinExport& made, const std::string& model);

// What mbverify standin found, for terminal, page and programs.

/// One sentence: how wrong a serial model is, and what helps most.
[[nodiscard]] std::string VerdictOf(const StandinResult& result);

/// Sentences to act on, the most important first.
[[nodiscard]] std::vector<std::string> AdviceOf(const StandinResult& result);

[[nodiscard]] std::string ToText(const StandinResult& result, const TextStyle& style);

/// Without `schema` and `program`.
[[nodiscard]] nlohmann::ordered_json ToJson(const StandinResult& result,
                                            const std::string& mechanism);

/// A row per pose, in the units of the headings.
[[nodiscard]] std::string StandinCsv(const StandinResult& result);

[[nodiscard]] std::string StandinPage(const StandinResult& result, const std::string& mechanism);

}  // namespace mbv
