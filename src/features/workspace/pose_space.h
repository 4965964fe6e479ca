// Poses of any mechanism as points of a manifold: what closes near a pose that closes.
//
//   A(p) δ = −r(p)        closures, couplings, idle spins: rows that always hold               (1)
//   N: A N = 0, NᵀN = 1   all motions at a pose, as many as degrees of freedom d               (2)
//   G = C N, D = B N      rates of d coordinates and of the drives per unit of these motions    (3)
//
// δ are the coordinates' steps of the spanning tree's joints, lengths by the characteristic length.
// The d coordinates are those of a set (`over`, free) and those that are held. det G = 0: the
// mechanism moves while the coordinates rest, type 1; det D = 0: it moves while the drives rest,
// type 2 [Gosselin, Angeles 1990]; A loses rank: a constraint singularity [Zlatanov 2002]. N
// carries its orientation from pose to pose, so that both determinants change their signs there.
//
// Neither way to a set of poses (flood.h, trace.h) uses more of the other than this file.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "base/types.h"
#include "features/workspace/interference.h"
#include "kinematics/tree_motion.h"
#include "mechanism/idle_spins.h"
#include "mechanism/mechanism.h"
#include "mechanism/motion.h"

namespace mbv {

/// A root of f between a and b, where it has other signs (the Illinois rule, now and then the
/// middle). `f(c, &f_c)` is false where it has no value: so is this then, and after sixty values;
/// `enough(f_c, width)` ends the search, at the value asked for last.
template <typename Function, typename Enough>
[[nodiscard]] bool FindCrossing(double a, double f_a, double b, double f_b, const Function& f,
                                const Enough& enough) {
  for (int i = 0; i < 60; ++i) {
    double c = b - f_b * (b - a) / (f_b - f_a);
    if (!std::isfinite(c) || i % 16 == 15) c = 0.5 * (a + b);
    double f_c = 0.0;
    if (!f(c, &f_c)) return false;
    if (enough(f_c, std::abs(b - a))) return true;
    if ((f_c < 0.0) != (f_b < 0.0)) {
      a = b;
      f_a = f_b;
    } else {
      f_a *= 0.5;
    }
    b = c;
    f_b = f_c;
  }
  return false;
}

/// What may end a set of poses: its margin is positive inside, zero there [SI, or 1].
struct SetBound {
  enum class Kind { kDrive, kJoint, kCone, kBox, kShapes, kConstraint, kType1, kType2 };
  Kind kind = Kind::kDrive;
  std::string name;     ///< "leg1 at 0.75 m": of drive, joint and side, to read
  std::string subject;  ///< of drive, joint or coordinate; "" of singularities
  bool upper = false;
  double limit = 0.0;      ///< [m or rad]
  int watched = -1;        ///< of SpacePose::watched; kBox: a coordinate, kCone: one of the cones,
                           ///< kShapes: a pair
  std::string unit = "1";  ///< of its margin: "m", "rad", "1"
};
[[nodiscard]] const char* WordOf(SetBound::Kind kind);
[[nodiscard]] inline bool IsSingularity(SetBound::Kind kind) {
  return kind >= SetBound::Kind::kConstraint;
}

/// The rate of the margin is known without differences.
[[nodiscard]] inline bool HasRate(SetBound::Kind kind) {
  return kind < SetBound::Kind::kCone || kind == SetBound::Kind::kBox;
}

/// The axis a of M in a joint stays within an angle of the same axis in F; without an axis: the
/// rotation as a whole does.
struct JointCone {
  int joint = -1;
  Vec3 axis = Vec3::UnitZ();  ///< unit, in F and in M; or 0
  double angle = kNan;        ///< [rad], 0 … π
};

/// A held coordinate that is asked for a range of values instead.
struct RangedCoordinate {
  int coordinate = -1;    ///< of SpaceSettings::coordinates
  CoordinateRange range;  ///< finite [m or rad]
};

struct SpaceSettings {
  std::vector<NamedCoordinate> coordinates;  ///< d, independent at home: the free ones first
  int over = 0;                              ///< number of those that are free, 1 … 3
  VecX held;                                 ///< values of the others [m or rad]
  std::vector<CoordinateRange> box;          ///< per free coordinate
  std::vector<JointCone> cones;
  double clearance = kNan;               ///< of bodies' shapes [m]; NaN: they may touch
  bool cross_type2 = false;              ///< drives that lose their hold end nothing
  std::vector<RangedCoordinate> ranged;  ///< fibre.h
  bool for_all = false;                  ///< of them, or for some
};

/// A pose that closes. Poses of one PoseSpace and of its sections are alike.
struct SpacePose {
  std::vector<Pose> X_FM;       ///< by joint, of the tree
  std::vector<double> coupled;  ///< BodyStates::coupled
  VecX at;                      ///< the d coordinates [m or rad], turns counted
  VecX watched;                 ///< bounded drives and joints, turns counted
  VecX margin;                  ///< per bound
  double side = 1.0;            ///< orientation of N
};

/// See math/bytes.h.
template <typename Visit>
void VisitMembers(Visit& visit, typename Visit::template Of<SpacePose>& pose) {
  visit(pose.X_FM), visit(pose.coupled), visit(pose.at), visit(pose.watched), visit(pose.margin);
  visit(pose.side);
}

/// A pose with its motions.
struct PlacedPose {
  SpacePose pose;
  MatX N;               ///< n × d, (2)
  MatX N_free;          ///< n × over: those of N that leave the held coordinates
  MatX G;               ///< d × d, (3): scaled by UnitOf()
  MatX C_free;          ///< over × over: rates of the free coordinates [m or rad] along N_free
  MatX watched_free;    ///< watched × over
  double type1 = kNan;  ///< det G, 1 at home
  double type2 = kNan;  ///< det D by the product of its rows at home, > 0 there; NaN: not as many
                        ///< drives as degrees of freedom
  double type2_size = kNan;  ///< product of the rows of D
  double least = kNan;       ///< of A: its last pivot by its first
};

class PoseSpace {
 public:
  /// The mechanism outlives it.
  PoseSpace(const Mechanism& mechanism, SpaceSettings settings);

  /// The same with only the first `over` coordinates free, more or less than here.
  [[nodiscard]] PoseSpace Section(int over) const;
  /// Another value of a held coordinate (index as in `coordinates`).
  void Hold(int coordinate, double value) { settings_.held[coordinate - settings_.over] = value; }

  [[nodiscard]] int over() const { return settings_.over; }
  [[nodiscard]] const SpaceSettings& settings() const { return settings_; }
  [[nodiscard]] const std::vector<SetBound>& bounds() const { return bounds_; }
  /// The bound of type 2, or −1.
  [[nodiscard]] int type2_bound() const { return type2_bound_; }
  [[nodiscard]] const Mechanism& mechanism() const { return *mechanism_; }
  [[nodiscard]] const ShapePairs* shapes() const { return shapes_.get(); }
  [[nodiscard]] double length() const { return length_; }
  [[nodiscard]] bool has_idle_spins() const { return !spins_.empty(); }
  /// A length that a free coordinate's unit counts as: the characteristic one, or 1 rad.
  [[nodiscard]] double UnitOf(int coordinate) const;
  /// Of a product of rows' sizes as determinants of type 2 count.
  [[nodiscard]] double MarginOfTypeTwo(double size) const { return size / std::abs(home_type2_); }
  /// Searches for a pose so far, by this object.
  [[nodiscard]] long closings() const { return closings_; }

  /// The home pose; false where it is singular in a way that leaves no motion to follow.
  [[nodiscard]] bool Home(PlacedPose* home);
  /// Makes the poses' determinants count from 1 here.
  void CountFrom(PlacedPose* home);
  /// A pose that was kept, with its motions again.
  [[nodiscard]] bool Place(const SpacePose& pose, PlacedPose* placed) const;
  /// The nearest pose beyond a step of `along` N_free [rad, characteristic lengths] that keeps the
  /// held coordinates; smooth in `along`. False where none is near.
  [[nodiscard]] bool Step(const PlacedPose& from, const VecX& along, PlacedPose* to) const;
  /// Of two free coordinates and a bound that HasRate(): the pose on it beyond a step τ N_free t,
  /// corrected across t only; smooth in τ. A few times as fast as a search by Step().
  [[nodiscard]] bool StepOn(int bound, const PlacedPose& from, double tau, const VecX& t,
                            PlacedPose* to) const;
  /// The pose with other values of all d coordinates, in steps so short that it is the same branch.
  /// False where it does not close, or a fold (type 1) lies between.
  [[nodiscard]] bool Close(const PlacedPose& from, const VecX& target, PlacedPose* to) const;
  /// The same in one step: false also where that is too long.
  [[nodiscard]] bool CloseNear(const PlacedPose& from, const VecX& target, PlacedPose* to) const {
    return CloseOnce(from, target, to) && to->type1 > 0.0;
  }
  /// Free coordinates `x`, the held ones as they are to be.
  [[nodiscard]] VecX Target(const VecX& x) const;

  /// Slope of a bound's margin along N_free.
  [[nodiscard]] VecX Slope(const PlacedPose& at, int bound) const;
  /// Twists [ω; v of Bo] of the moving bodies per unit of N: 6·(bodies − 1) × d.
  [[nodiscard]] MatX Twists(const PlacedPose& at, const BodyStates& states) const;
  /// Where all bodies are.
  [[nodiscard]] BodyStates States(const SpacePose& pose) const;

 private:
  struct Rows;
  struct Watched {
    Coordinate coordinate;
    double home = 0.0;
  };
  void AddBounds();
  void AddRange(const Coordinate& coordinate, SetBound::Kind kind, const std::string& subject,
                const CoordinateRange& range);
  /// Rows (1) and the coordinates at a pose.
  void Evaluate(SpacePose* pose, Rows* rows) const;
  [[nodiscard]] bool Factor(Rows* rows) const;
  /// Of a step on a bound: which one, and the direction in which corrections do not move.
  struct OnBound {
    int bound = -1;
    VecX along;
  };
  /// From a predicted pose to one that closes; `target` of all coordinates or, empty, of those
  /// held.
  [[nodiscard]] bool Correct(const PlacedPose& from, const VecX& target, double most,
                             PlacedPose* to, const OnBound* on = nullptr) const;
  /// A linear bound's margin at a pose, and its rate by scaled steps of the tree.
  [[nodiscard]] double MarginOf(int bound, const SpacePose& pose, const Rows& rows,
                                Eigen::RowVectorXd* rate) const;
  [[nodiscard]] bool Finish(const MatX& N_before, Rows* rows, PlacedPose* to) const;
  [[nodiscard]] bool CloseOnce(const PlacedPose& from, const VecX& target, PlacedPose* to) const;
  void Move(const VecX& scaled, SpacePose* pose) const;

  const Mechanism* mechanism_;
  SpaceSettings settings_;
  internal::TreeMotion tree_;
  double length_ = 1.0;
  VecX unit_;  ///< per tree coordinate: length_ or 1
  std::vector<Spin> spins_;
  std::vector<Watched> watched_;
  std::shared_ptr<const ShapePairs> shapes_;  ///< null without a clearance
  std::vector<SetBound> bounds_;
  int type2_bound_ = -1;
  std::vector<Coordinate> driven_;  ///< drives, prescribed joints
  int rank_ = 0;                    ///< of A at home
  double home_type1_ = 1.0, home_type2_ = 1.0, home_least_ = 1.0;
  mutable long closings_ = 0;
};

}  // namespace mbv
