#include "features/standin/standin.h"

#include <fmt/format.h>
#include <Eigen/LU>
#include <Eigen/SVD>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <optional>
#include <random>

#include "base/text.h"
#include "kinematics/command_rank.h"
#include "mechanism/reach.h"
#include "reference/reduced_model.h"

namespace mbv {
namespace {

constexpr double kHalfRange = std::numbers::pi / 6.0;  // where neither user nor joint states one
constexpr double kMostPoses = 200000.0;
constexpr int kSamples = 400;    // of a period
constexpr double kShort = 1e-3;  // [rad, or of the range] before a dead centre, where the
                                 // reference may stop
constexpr size_t kCounted = 11;  // poses along a joint whose drives' joint poses are counted
// Singular values below this share of the largest, there or at home, are round-off.
constexpr double kRegular = 1e-9;
constexpr double kMost = std::numeric_limits<double>::max();
constexpr double kNoLimit = std::numeric_limits<double>::infinity();

size_t At(Eigen::Index k) { return static_cast<size_t>(k); }

// A part of the transmission's forces. Rods that are massless there spin without need of a
// coordinate (mechanism/idle_spins.h): what holds such a spin in the robot is left out.
struct Part {
  Part(const Mechanism& mechanism, const std::vector<Coordinate>& coordinates)
      : Part(mechanism, coordinates, Independent(mechanism, coordinates)) {}
  Part(const Mechanism& mechanism, const std::vector<Coordinate>& coordinates,
       std::vector<Eigen::Index> independent)
      : taken(std::move(independent)), model(mechanism, Chosen(coordinates, taken)) {}

  static std::vector<Eigen::Index> Independent(const Mechanism& mechanism,
                                               const std::vector<Coordinate>& coordinates) {
    std::vector<Coordinate> candidates;
    for (size_t p = 0; p < mechanism.prescribed.size(); ++p) {
      candidates.push_back({Coordinate::Kind::kPrescribed, static_cast<int>(p), 0});
    }
    const size_t first = candidates.size();
    candidates.insert(candidates.end(), coordinates.begin(), coordinates.end());
    std::vector<Eigen::Index> independent;
    for (const size_t k : ChooseCoordinates(mechanism, candidates, candidates.size()).chosen) {
      if (k >= first) independent.push_back(static_cast<Eigen::Index>(k - first));
    }
    return independent;
  }
  static std::vector<Coordinate> Chosen(const std::vector<Coordinate>& coordinates,
                                        const std::vector<Eigen::Index>& taken) {
    std::vector<Coordinate> chosen;
    chosen.reserve(taken.size());
    for (const Eigen::Index k : taken) chosen.push_back(coordinates[At(k)]);
    return chosen;
  }

  // Of all coordinates.
  RunSummary Move(const VecX& q, const VecX& v, const VecX& a) {
    return model.Move(q(taken), v(taken), a(taken));
  }

  const std::vector<Eigen::Index> taken;
  ReducedModel model;
};

// The parts at one state.
class Parts {
 public:
  explicit Parts(const Transmission& transmission)
      : transmission_(transmission),
        n_(static_cast<Eigen::Index>(transmission.joints.size())),
        full_part_(transmission.full, transmission.coordinates()),
        without_rotors_part_(transmission.without_rotors, transmission.coordinates()),
        serial_part_(transmission.serial, transmission.coordinates()),
        loop_part_(transmission.loop_inertia, transmission.coordinates()),
        home_(HomeOf(transmission)) {}

  [[nodiscard]] VecX home() const { return home_.head(n_); }

  // From the pose before, else from home. `q` … of the chosen joints; the others rest at home.
  // `all`: else J and drives alone are known afterwards.
  RunSummary Move(const VecX& q, const VecX& v, const VecX& a, bool all = true) {
    RunSummary summary = MoveParts(q, v, a, all);
    if (!summary.ok() && !at_home_) {
      Restart();
      summary = MoveParts(q, v, a, all);
    }
    // What stays open is searched once where many poses stay open one after the other.
    full_.Explain(summary.ok());
    if (summary.ok()) where_.clear();
    if (summary.where.empty()) summary.where = where_;
    where_ = summary.where;
    at_home_ = !summary.ok();
    if (!summary.ok()) Restart();
    return summary;
  }

  [[nodiscard]] const MatX& J() const { return J_; }
  [[nodiscard]] VecX drives() const { return ChosenDrives(full_.sample().driven.position); }
  [[nodiscard]] MatX MassMatrix() const { return full_.MassMatrix(T_); }
  [[nodiscard]] MatX RotorMatrix() const {
    return full_.MassMatrix(T_) - without_rotors_.MassMatrix(T_);
  }

  // (2), (3) and (4) at the state; why all forces together have no answer, or "".
  std::string Evaluate(const MatX& J_home, const VecX& armature, StandinState* state) {
    state->v = v_;
    state->a = a_;
    const VecX f_serial = serial_.Forces(T_, {});
    const VecX f_bare = without_rotors_.Forces(T_, {});
    const VecX rotors = full_.Forces(T_, {}) - f_bare;
    const VecX c_loop = loop_.Forces(T_, {}) - loop_.MassMatrix(T_) * a_;
    const MatX R = RotorMatrix();
    const Eigen::PartialPivLU<MatX> to_joint(J_.transpose()), to_joint_home(J_home.transpose());
    const VecX f_model = f_serial + armature.cwiseProduct(a_);
    state->serial = to_joint_home.solve(f_model);
    state->errors[0] = to_joint.solve(f_model) - state->serial;
    state->errors[1] = to_joint.solve(R * a_ - armature.cwiseProduct(a_));
    state->errors[2] = to_joint.solve(rotors - R * a_ + c_loop);
    state->errors[3] = to_joint.solve(f_bare - f_serial - c_loop);
    const RunSummary balance = full_.AllForces({});
    state->full =
        balance.ok() ? ChosenDrives(full_.drive_force()) : VecX(to_joint.solve(f_bare + rotors));
    state->errors[kWhole] = state->full - state->serial;
    if (!balance.ok()) return balance.message;
    VecX sum = -state->errors[kWhole];
    VecX size = state->full.cwiseAbs().cwiseMax(state->serial.cwiseAbs());
    for (size_t c = 0; c < kCauses; ++c) {
      sum += state->errors[c];
      size = size.cwiseMax(state->errors[c].cwiseAbs());
    }
    state->sum_off = size.maxCoeff() > 0.0 ? sum.cwiseAbs().maxCoeff() / size.maxCoeff() : 0.0;
    return "";
  }

 private:
  void Restart() {
    for (ReducedModel* part : {&full_, &without_rotors_, &serial_, &loop_}) part->Restart();
    at_home_ = true;
  }

  RunSummary MoveParts(const VecX& q, const VecX& v, const VecX& a, bool all) {
    VecX at = home_, rates = VecX::Zero(home_.size()), accelerations = rates;
    at.head(n_) = q;
    rates.head(n_) = v;
    accelerations.head(n_) = a;
    for (Part* part : {&full_part_, &without_rotors_part_, &serial_part_, &loop_part_}) {
      if (part != &full_part_ && !all) break;
      if (RunSummary summary = part->Move(at, rates, accelerations); !summary.ok()) return summary;
    }
    MatX T;
    RunSummary summary = full_.Motions(&T);
    if (!summary.ok()) return summary;
    T_ = T.leftCols(n_);
    v_ = v;
    a_ = a;
    const MatX rates_of_all = full_.DriveRates(T_);
    J_.resize(n_, n_);
    for (Eigen::Index k = 0; k < n_; ++k) J_.row(k) = rates_of_all.row(transmission_.drives[At(k)]);
    return summary;
  }

  [[nodiscard]] VecX ChosenDrives(const VecX& of_all) const {
    VecX chosen(n_);
    for (Eigen::Index k = 0; k < n_; ++k) chosen[k] = of_all[transmission_.drives[At(k)]];
    return chosen;
  }

  static VecX HomeOf(const Transmission& transmission) {
    const std::vector<Coordinate> coordinates = transmission.coordinates();
    VecX home(static_cast<Eigen::Index>(coordinates.size()));
    for (Eigen::Index k = 0; k < home.size(); ++k) {
      home[k] = HomeValue(transmission.full, coordinates[At(k)]);
    }
    return home;
  }

  const Transmission& transmission_;
  const Eigen::Index n_;
  Part full_part_, without_rotors_part_, serial_part_, loop_part_;
  ReducedModel &full_ = full_part_.model, &without_rotors_ = without_rotors_part_.model,
               &serial_ = serial_part_.model, &loop_ = loop_part_.model;
  const VecX home_;
  bool at_home_ = true;
  std::string where_;  // of the pose before, if it was open
  MatX T_, J_;
  VecX v_, a_;
};

// Singular values and errors of maps in one unit: where units differ, lengths are measured in a
// characteristic length, else nothing is scaled.
struct UnitScale {
  VecX drives, joints;

  [[nodiscard]] MatX Scaled(const MatX& J) const {
    return drives.cwiseInverse().asDiagonal() * J * joints.asDiagonal();
  }
};

class StandinComputer {
 public:
  StandinComputer(const Mechanism& mechanism, const StandinSettings& settings,
                  const std::function<void(double)>& progress)
      : robot_(mechanism), settings_(settings), progress_(progress) {}

  StandinResult Compute(const std::vector<std::string>& joints) {
    auto found = FindTransmission(robot_, joints, &result_.diagnostics);
    if (!found) return std::move(result_);
    transmission_ = *std::move(found);
    result_.held = NamesOf(transmission_.held);
    result_.notes = transmission_.notes;
    mechanism_ = MovingPart(robot_, transmission_);
    if (Diagnostics unseen; auto moving = FindTransmission(mechanism_, joints, &unseen)) {
      moving->held = InPart(transmission_.held, std::move(moving->held));
      transmission_ = *std::move(moving);
    } else {
      mechanism_ = robot_;
    }
    n_ = static_cast<Eigen::Index>(joints.size());
    parts_.emplace(transmission_);
    branches_.emplace(mechanism_, transmission_);
    Describe();
    ReadRanges();
    if (result_.diagnostics.has_errors() || !AtHome()) return std::move(result_);
    MakeGrid();
    do {
      doubted_ = false;
      WalkGrid([this](StandinPose* pose) { Look(pose); }, 0.0, 0.4);
    } while (doubted_);
    if (result_.usable() == 0) {
      const bool home = BeyondRange(result_.drives_home).empty();
      Error("no pose of the range can be used: " + FirstTrouble(),
            home ? "another --range" : "another home pose (guesses of the model)");
      return std::move(result_);
    }
    FitArmature();
    FindWorst();
    FindBranches();
    FindEnds();
    std::mt19937_64 random(settings_.seed);
    WalkGrid([&](StandinPose* pose) { Load(pose, &random); }, 0.4, 0.9);
    AddScenes();
    return std::move(result_);
  }

 private:
  void Error(std::string message, std::string hint) {
    result_.diagnostics.AddError(robot_.file, std::move(message), std::move(hint));
  }

  // Where a rod's spin can be held by one coordinate or another: by the same one in the part.
  [[nodiscard]] std::vector<NamedCoordinate> InPart(const std::vector<NamedCoordinate>& held,
                                                    std::vector<NamedCoordinate> otherwise) const {
    std::vector<NamedCoordinate> there;
    for (NamedCoordinate named : held) {
      int& index = named.coordinate.index;
      index = named.coordinate.kind == Coordinate::Kind::kDrive
                  ? mechanism_.FindDrive(named.name)
                  : mechanism_.FindJoint(robot_.joints[static_cast<size_t>(index)].name);
      if (index >= 0) there.push_back(std::move(named));
    }
    return there.size() == otherwise.size() ? there : otherwise;
  }

  void Describe() {
    result_.joints = NamesOf(transmission_.joints);
    for (const NamedCoordinate& joint : transmission_.joints) {
      result_.joint_units.push_back(CoordinateUnit(mechanism_, joint.coordinate));
    }
    for (const int d : transmission_.drives) {
      const Drive& drive = mechanism_.drives[static_cast<size_t>(d)];
      result_.drives.push_back(drive.name);
      result_.drive_units.push_back(PositionUnit(mechanism_, drive));
    }
    for (const int b : transmission_.loop_bodies) {
      result_.loop_bodies.push_back(mechanism_.bodies[static_cast<size_t>(b)].name);
    }
    result_.amplitude = settings_.amplitude;
    result_.frequency_hz = settings_.frequency_hz;
    result_.home = parts_->home();
    ReadMotors();
    const auto differ = [](const std::vector<std::string>& units) {
      return std::ranges::any_of(units, [&](const std::string& unit) { return unit != units[0]; });
    };
    joints_differ_ = differ(result_.joint_units);
    scale_ = {VecX::Ones(n_), VecX::Ones(n_)};
    const std::string &drive = result_.drive_units[0], &joint = result_.joint_units[0];
    result_.unit = drive == joint ? "1" : drive + "/" + joint;
    if (!joints_differ_ && !differ(result_.drive_units)) return;
    const double length = CharacteristicLength(robot_);
    result_.unit = fmt::format("1, lengths in {:.4g} m", length);
    for (Eigen::Index k = 0; k < n_; ++k) {
      if (result_.drive_units[At(k)] == "m") scale_.drives[k] = length;
      if (result_.joint_units[At(k)] == "m") scale_.joints[k] = length;
    }
  }

  void ReadRanges() {
    for (const StandinRange& range : settings_.ranges) {
      if (!Contains(result_.joints, range.joint)) {
        Error("--range of '" + range.joint + "', which is not chosen",
              DidYouMean(range.joint, result_.joints, "chosen: " + Joined(result_.joints)));
      }
    }
    for (Eigen::Index k = 0; k < n_; ++k) {
      const std::string& name = result_.joints[At(k)];
      const Coordinate& coordinate = transmission_.joints[At(k)].coordinate;
      const CoordinateRange& limits = mechanism_.joints[static_cast<size_t>(coordinate.index)]
                                          .range[static_cast<size_t>(coordinate.component)];
      const auto stated = std::ranges::find(settings_.ranges, name, &StandinRange::joint);
      StandinRange range{.joint = name, .low = limits.lower, .high = limits.upper};
      std::string of = "the joint's limits";
      if (stated != settings_.ranges.end()) {
        range = *stated;
        of = "--range";
      } else if (const bool turns = result_.joint_units[At(k)] == "rad";
                 !(range.high - range.low <= (turns ? 2.0 * std::numbers::pi : kMost))) {
        if (!turns) Error("'" + name + "' has no limits", "--range " + name + "_mm=-20:20");
        if (std::isfinite(range.high - range.low)) {
          result_.notes.push_back("the limits of '" + name + "' are more than a turn apart");
        }
        range.low = result_.home[k] - kHalfRange;
        range.high = result_.home[k] + kHalfRange;
        of = "home ± 30°";
      }
      if (!(range.low < range.high) || !std::isfinite(range.low) || !std::isfinite(range.high)) {
        Error(fmt::format("the range {:.6g} … {:.6g} {} of '{}' is empty", range.low, range.high,
                          result_.joint_units[At(k)], name),
              "--range " + name + "_deg=-50:30: the lower end first");
      }
      result_.ranges.push_back(range);
      result_.range_of.push_back(of);
    }
    result_.resolution = settings_.resolution > 0 ? settings_.resolution
                         : n_ == 1                ? 201
                         : n_ == 2                ? 41
                         : n_ == 3                ? 11
                                                  : 5;
    if (const double poses = std::pow(result_.resolution, static_cast<double>(n_));
        poses > kMostPoses) {
      Error(fmt::format("{:.3g} poses are too many (at most {:.3g})", poses, kMostPoses),
            "a smaller --resolution");
    }
  }

  bool AtHome() {
    const VecX still = VecX::Zero(n_);
    const RunSummary summary = parts_->Move(result_.home, still, still);
    if (!summary.ok()) {
      Error("at home: " + summary.message, "another home pose (guesses of the model)");
      return false;
    }
    result_.J_home = parts_->J();
    result_.drives_home = parts_->drives();
    const Eigen::JacobiSVD<MatX> svd(scale_.Scaled(result_.J_home));
    const VecX& values = svd.singularValues();
    if (!(values[n_ - 1] > kRegular * values[0])) {
      Error("the drives do not hold the joints at home: the neutral ratio is singular",
            "another home pose (guesses of the model)");
      return false;
    }
    for (Eigen::Index k = 0; k < n_; ++k) CheckLimb(k, result_.home, result_.drives_home[k]);
    result_.least_home = values[n_ - 1];
    result_.largest_home = values[0];
    sign_ = result_.J_home.determinant() > 0.0;
    return true;
  }

  void MakeGrid() {
    size_t count = 1;
    for (Eigen::Index k = 0; k < n_; ++k) count *= static_cast<size_t>(result_.resolution);
    result_.poses.resize(count);
    for (size_t i = 0; i < count; ++i) {
      VecX q(n_);
      size_t rest = i;
      for (Eigen::Index k = n_; k-- > 0;) {
        const auto step = static_cast<double>(rest % static_cast<size_t>(result_.resolution));
        rest /= static_cast<size_t>(result_.resolution);
        const StandinRange& range = result_.ranges[At(k)];
        q[k] = result_.resolution == 1
                   ? 0.5 * (range.low + range.high)
                   : range.low + (range.high - range.low) * step / (result_.resolution - 1);
      }
      result_.poses[i].q = q;
    }
  }

  // To and fro along the last joint, so that neighbours follow each other.
  template <typename Visit>
  void WalkGrid(const Visit& visit, double from, double to) {
    const auto row = static_cast<size_t>(result_.resolution);
    const size_t rows = result_.poses.size() / row;
    for (size_t r = 0; r < rows; ++r) {
      for (size_t k = 0; k < row; ++k) {
        visit(&result_.poses[r * row + (r % 2 == 0 ? k : row - 1 - k)]);
      }
      if (progress_) {
        progress_(from + (to - from) * static_cast<double>(r + 1) / static_cast<double>(rows));
      }
    }
  }

  // The drive that is beyond its range, or "".
  [[nodiscard]] std::string BeyondRange(const VecX& drives) const {
    for (Eigen::Index k = 0; k < n_; ++k) {
      const CoordinateRange& range = transmission_.ranges[At(k)];
      if (drives[k] < range.lower || drives[k] > range.upper) return result_.drives[At(k)];
    }
    return "";
  }

  // What the reference finds decides whether a limb is what it was taken for.
  void CheckLimb(Eigen::Index k, const VecX& q, double drive) {
    if (branches_->Fits(k, q, drive)) return;
    branches_->Recheck(k);
    doubted_ = true;
  }

  // The first drive whose limb cannot be put together, or "".
  [[nodiscard]] std::string OutOfReach(const VecX& q) const {
    double apart = kNan;
    for (Eigen::Index k = 0; k < n_; ++k) {
      if (!branches_->KindOf(k).empty() && branches_->Ways(k, q, &apart).empty()) {
        return result_.drives[At(k)];
      }
    }
    return "";
  }

  void Look(StandinPose* pose) {
    pose->status = PoseStatus::kOpen;
    if (const std::string drive = OutOfReach(pose->q); !drive.empty()) {
      pose->where = "limb of " + drive;
      if (trouble_.empty()) trouble_ = pose->where + " is out of reach";
      return;
    }
    const VecX still = VecX::Zero(n_);
    if (const RunSummary summary = parts_->Move(pose->q, still, still); !summary.ok()) {
      pose->where = summary.where.empty() ? ToText(summary.stop) : summary.where;
      if (trouble_.empty()) trouble_ = summary.message;
      return;
    }
    pose->drives = parts_->drives();
    for (Eigen::Index k = 0; k < n_; ++k) CheckLimb(k, pose->q, pose->drives[k]);
    pose->J = parts_->J();
    const Eigen::JacobiSVD<MatX> svd(scale_.Scaled(pose->J));
    pose->least = svd.singularValues()[n_ - 1];
    pose->largest = svd.singularValues()[0];
    pose->M = parts_->MassMatrix();
    pose->R = parts_->RotorMatrix();
    pose->where = BeyondRange(pose->drives);
    pose->status = pose->where.empty() ? PoseStatus::kUsable : PoseStatus::kDriveRange;
    if ((pose->J.determinant() > 0.0) != sign_ ||
        !(pose->least > kRegular * std::max(pose->largest, result_.largest_home))) {
      pose->status = PoseStatus::kBeyond;
      pose->where = "type 2 singularity";
    }
    if (pose->status != PoseStatus::kUsable) return;
    // Forces of drives in one unit: τ scaled by the drive's length.
    const MatX back = pose->J.transpose().partialPivLu().inverse();
    const MatX map = scale_.drives.asDiagonal() * back * result_.J_home.transpose() *
                     scale_.drives.cwiseInverse().asDiagonal();
    pose->map_error = Eigen::JacobiSVD<MatX>(map - MatX::Identity(n_, n_)).singularValues()[0];
    AddLimits(back, pose);
  }

  // |τ_k| ≤ F_k, |ṁ_k| ≤ V_k at the drives, behind gears; torques driving at standstill.
  void ReadMotors() {
    VecX &force = result_.drive_forces, &speed = result_.drive_speeds;
    force = speed = VecX::Constant(n_, kNoLimit);
    for (const Motor& motor : mechanism_.motors) {
      const auto at = std::ranges::find(transmission_.drives, motor.drive);
      if (at == transmission_.drives.end()) continue;
      const auto k = at - transmission_.drives.begin();
      force[k] = std::min({PeakTorque(motor, 0.0), motor.most, -motor.least}) * motor.gear_ratio *
                 motor.efficiency;
      double fastest = motor.max_speed;
      if (!motor.peak_curve.empty()) fastest = std::min(fastest, motor.peak_curve.back().speed);
      speed[k] = fastest / motor.gear_ratio;
    }
    result_.torque_limits = force.allFinite();
    result_.speed_limits = speed.allFinite();
  }

  void AddLimits(const MatX& back, StandinPose* pose) {
    const auto limit = [&](const VecX& most, const MatX& map, VecX* alone, double* any) {
      alone->setConstant(n_, kNan);
      if (!most.allFinite()) return;
      for (Eigen::Index i = 0; i < n_; ++i) {
        (*alone)[i] = (most.array() / map.col(i).array().abs()).minCoeff();
      }
      if (!joints_differ_) *any = (most.array() / map.rowwise().norm().array()).minCoeff();
    };
    limit(result_.drive_forces, back, &pose->torque_alone, &pose->torque_any);
    limit(result_.drive_speeds, pose->J, &pose->speed_alone, &pose->speed_any);
  }

  // Both ways of every limb, and the poses of the joints at some of the drives' positions.
  void FindBranches() {
    result_.limbs.resize(At(n_));
    std::vector<size_t> home_way(At(n_));
    double apart = kNan;
    // Index of the way that a drive is on.
    const auto way_of = [](const std::vector<double>& ways, double drive) {
      const auto off = [&](double way) {
        return std::abs(std::remainder(way - drive, 2.0 * std::numbers::pi));
      };
      return ways.size() > 1 && off(ways[1]) < off(ways[0]) ? size_t{1} : size_t{0};
    };
    for (Eigen::Index k = 0; k < n_; ++k) {
      StandinLimb& limb = result_.limbs[At(k)];
      limb.kind = branches_->KindOf(k);
      if (limb.kind.empty()) continue;
      const std::vector<double> ways = branches_->Ways(k, result_.home, &apart);
      home_way[At(k)] = way_of(ways, result_.drives_home[k]);
      if (ways.size() > 1) limb.other_home = ways[1 - home_way[At(k)]];
    }
    const auto row = static_cast<size_t>(result_.resolution);
    const size_t stride = (row + kCounted - 1) / kCounted;
    for (size_t i = 0; i < result_.poses.size(); ++i) {
      StandinPose& pose = result_.poses[i];
      if (pose.status != PoseStatus::kUsable) continue;
      pose.ways = 1;
      for (Eigen::Index k = 0; k < n_; ++k) {
        StandinLimb& limb = result_.limbs[At(k)];
        if (limb.kind.empty()) {
          pose.ways = -1;
          continue;
        }
        const std::vector<double> ways = branches_->Ways(k, pose.q, &apart);
        if (pose.ways > 0) pose.ways *= static_cast<int>(ways.size());
        if (way_of(ways, pose.drives[k]) != home_way[At(k)]) ++limb.other_way;
        if (std::isnan(apart) || apart >= limb.apart) continue;
        limb.apart = apart;
        limb.apart_at = i;
      }
      if (i % row % stride != 0 || i / row % stride != 0) continue;
      if (const auto poses = branches_->Poses(pose.drives)) {
        pose.joint_poses = static_cast<int>(poses->size());
      }
    }
    if (auto poses = branches_->Poses(result_.drives_home)) {
      result_.poses_at_home = *std::move(poses);
      std::ranges::sort(result_.poses_at_home, {},
                        [&](const VecX& q) { return (q - result_.home).squaredNorm(); });
    }
  }

  void FindEnds() {
    for (Eigen::Index joint = 0; joint < n_; ++joint) {
      for (const bool up : {false, true}) result_.ends.push_back(EndOf(joint, up));
    }
  }

  StandinEnd EndOf(Eigen::Index joint, bool up) {
    using Kind = StandinEnd::Kind;
    StandinEnd end{.joint = At(joint), .up = up};
    const StandinRange& range = result_.ranges[At(joint)];
    const double home = result_.home[joint];
    const double most = result_.joint_units[At(joint)] == "rad" ? std::numbers::pi
                        : up                                    ? range.high - home
                                                                : home - range.low;
    VecX q = result_.home;
    const VecX still = VecX::Zero(n_);
    const auto look = [&](double by) {
      q[joint] = home + (up ? by : -by);
      end.where = OutOfReach(q);
      if (!end.where.empty()) return Kind::kDeadCentre;
      if (const RunSummary moved = parts_->Move(q, still, still, false); !moved.ok()) {
        end.where = moved.where;
        return Kind::kOpen;
      }
      end.where = BeyondRange(parts_->drives());
      if (!end.where.empty()) return Kind::kDriveRange;
      return (parts_->J().determinant() > 0.0) == sign_ ? Kind::kNone : Kind::kType2;
    };
    (void)look(0.0);
    constexpr int kSteps = 180;
    double good = 0.0;
    for (int i = 1; i <= kSteps && end.kind == Kind::kNone; ++i) {
      double bad = most * i / kSteps;
      Kind kind = look(bad);
      for (int k = 0; k < (kind == Kind::kOpen ? 12 : 24) && kind != Kind::kNone; ++k) {
        const double middle = 0.5 * (good + bad);
        const std::string where = end.where;
        if (const Kind there = look(middle); there == Kind::kNone) {
          good = middle;
          end.where = where;
        } else {
          bad = middle;
          kind = there;
        }
      }
      if (kind == Kind::kNone) good = bad;
      end.kind = kind;
    }
    const auto place = [&](double by) { return home + (up ? by : -by); };
    end.at = place(good);
    if (end.kind != Kind::kOpen) return end;
    // The reference stops short of a dead centre, which limbs have in closed form.
    double reach = good,
           out = good + (result_.joint_units[At(joint)] == "rad" ? kShort : kShort * most);
    for (int k = 0; k < 30; ++k) {
      const double middle = 0.5 * (reach + out);
      q[joint] = place(middle);
      (OutOfReach(q).empty() ? reach : out) = middle;
    }
    q[joint] = place(out);
    if (const std::string drive = OutOfReach(q); !drive.empty()) {
      end.kind = Kind::kDeadCentre;
      end.where = drive;
      end.at = place(reach);
      return end;
    }
    // Of limbs of other kinds: a drive whose rate by the joint's grows without bound.
    constexpr double kUnbounded = 20.0;
    q[joint] = end.at;
    if (!parts_->Move(q, still, still, false).ok()) return end;
    const MatX rates = scale_.Scaled(parts_->J()).cwiseAbs();
    Eigen::Index drive = 0;
    if (rates.col(joint).maxCoeff(&drive) > kUnbounded * result_.largest_home) {
      end.kind = Kind::kDeadCentre;
      end.where = result_.drives[At(drive)];
    }
    return end;
  }

  [[nodiscard]] std::string FirstTrouble() const {
    if (const std::string drive = BeyondRange(result_.drives_home); !drive.empty()) {
      return "at home already, " + drive + " is beyond its range";
    }
    if (!trouble_.empty()) return trouble_;
    return result_.poses.front().where + ": " + WordOf(result_.poses.front().status);
  }

  // Least squares: the mean of each R_ii.
  void FitArmature() {
    result_.armature = VecX::Zero(n_);
    const auto usable = static_cast<double>(result_.usable());
    for (const StandinPose& pose : result_.poses) {
      if (pose.status == PoseStatus::kUsable) result_.armature += pose.R.diagonal() / usable;
    }
    std::vector<double> off, coupled, map;
    std::vector<size_t> at;
    for (size_t i = 0; i < result_.poses.size(); ++i) {
      const StandinPose& pose = result_.poses[i];
      if (pose.status != PoseStatus::kUsable) continue;
      at.push_back(i);
      map.push_back(pose.map_error);
      for (Eigen::Index k = 0; k < n_; ++k) {
        if (!(result_.armature[k] > 0.0)) continue;
        off.push_back(std::abs(pose.R(k, k) / result_.armature[k] - 1.0));
        for (Eigen::Index j = 0; j < k; ++j) {
          const double size = std::sqrt(pose.R(k, k) * pose.R(j, j));
          if (size > 0.0) coupled.push_back(std::abs(pose.R(k, j)) / size);
        }
      }
    }
    result_.inertia_off = SpreadOf(off);
    result_.coupling = SpreadOf(coupled);
    result_.map_error = SpreadOf(map);
    result_.map_error.at = at[result_.map_error.at];
  }

  void FindWorst() {
    double torque = kNoLimit, speed = kNoLimit;
    result_.worst_torque = result_.worst_speed = static_cast<size_t>(
        std::ranges::find(result_.poses, PoseStatus::kUsable, &StandinPose::status) -
        result_.poses.begin());
    for (size_t i = 0; i < result_.poses.size(); ++i) {
      if (result_.poses[i].torque_any < torque) {
        torque = result_.poses[i].torque_any;
        result_.worst_torque = i;
      }
      if (result_.poses[i].speed_any < speed) {
        speed = result_.poses[i].speed_any;
        result_.worst_speed = i;
      }
    }
  }

  // Half-widths of the motion's rates, per order of derivative.
  [[nodiscard]] VecX Amplitude(int order) const {
    VecX amplitude(n_);
    const double omega = 2.0 * std::numbers::pi * settings_.frequency_hz;
    for (Eigen::Index k = 0; k < n_; ++k) {
      const StandinRange& range = result_.ranges[At(k)];
      amplitude[k] = 0.5 * settings_.amplitude * (range.high - range.low) * std::pow(omega, order);
    }
    return amplitude;
  }

  void Evaluate(StandinState* state) {
    const std::string trouble = parts_->Evaluate(result_.J_home, result_.armature, state);
    if (no_balance_.empty()) no_balance_ = trouble;
  }

  void Load(StandinPose* pose, std::mt19937_64* random) {
    if (pose->status != PoseStatus::kUsable) return;
    const auto drawn = [&](const VecX& most) {
      VecX value(n_);
      for (Eigen::Index k = 0; k < n_; ++k) {
        value[k] = most[k] * (2.0 * std::ldexp(static_cast<double>((*random)() >> 11U), -53) - 1.0);
      }
      return value;
    };
    const VecX still = VecX::Zero(n_), v = drawn(Amplitude(1)), a = drawn(Amplitude(2));
    const auto evaluate = [&](const VecX& rates, const VecX& accelerations, StandinState* state) {
      if (!parts_->Move(pose->q, rates, accelerations).ok()) return;
      Evaluate(state);
    };
    evaluate(still, still, &pose->rest);
    evaluate(v, a, &pose->moving);
  }

  void AddScenes() {
    std::vector<std::pair<VecX, const StandinState*>> rest, moving;
    for (const StandinPose& pose : result_.poses) {
      if (pose.status != PoseStatus::kUsable) continue;
      rest.emplace_back(pose.q, &pose.rest);
      moving.emplace_back(pose.q, &pose.moving);
    }
    AddScene("at rest", "gravity and springs at all usable poses", rest);
    AddMotion(Swing());
    for (const StandinMotion& motion : settings_.motions) AddMotion(motion);
    if (!no_balance_.empty()) {
      result_.notes.push_back("torques follow from the forces along the joints alone: " +
                              no_balance_);
    }
    AddScene(
        "any state",
        "each usable pose with a velocity and an acceleration drawn evenly within those of the "
        "motion",
        moving);
  }

  // q_k = centre + A sin(2π f t + k π/2).
  [[nodiscard]] StandinMotion Swing() const {
    StandinMotion motion{
        .name = "in motion",
        .text = fmt::format("all joints swing at {:.4g} Hz by {:.0f} % of their ranges' halves "
                            "about the middle, each a quarter period ahead of the one before, {} "
                            "samples of a period",
                            settings_.frequency_hz, 100.0 * settings_.amplitude, kSamples),
        .q = {},
        .v = {}};
    const VecX amplitude = Amplitude(0);
    const double omega = 2.0 * std::numbers::pi * settings_.frequency_hz;
    for (int i = 0; i < kSamples; ++i) {
      VecX q(n_), v(n_), a(n_);
      for (Eigen::Index k = 0; k < n_; ++k) {
        const StandinRange& range = result_.ranges[At(k)];
        const double phase =
            2.0 * std::numbers::pi * i / kSamples + static_cast<double>(k) * std::numbers::pi / 2.0;
        const double swing = amplitude[k] * std::sin(phase);
        q[k] = 0.5 * (range.low + range.high) + swing;
        v[k] = amplitude[k] * omega * std::cos(phase);
        a[k] = -omega * omega * swing;
      }
      motion.q.push_back(std::move(q));
      motion.v.push_back(std::move(v));
      motion.a.push_back(std::move(a));
    }
    return motion;
  }

  void AddMotion(const StandinMotion& motion) {
    std::vector<StandinState> states(motion.q.size());
    std::vector<std::pair<VecX, const StandinState*>> scene;
    for (size_t i = 0; i < states.size(); ++i) {
      if (OutOfReach(motion.q[i]).empty() &&
          parts_->Move(motion.q[i], motion.v[i], motion.a[i]).ok() &&
          (parts_->J().determinant() > 0.0) == sign_ && BeyondRange(parts_->drives()).empty()) {
        Evaluate(&states[i]);
      }
      scene.emplace_back(motion.q[i], &states[i]);
    }
    AddScene(motion.name, motion.text, scene);
  }

  void AddScene(std::string name, std::string text,
                const std::vector<std::pair<VecX, const StandinState*>>& states) {
    StandinScene scene{.name = std::move(name), .text = std::move(text)};
    std::vector<std::pair<VecX, const StandinState*>> known;
    for (const auto& state : states) {
      if (state.second->full.size() > 0) known.push_back(state);
    }
    scene.states = known.size();
    scene.left_out = states.size() - known.size();
    for (Eigen::Index d = 0; d < n_; ++d) {
      std::array<std::vector<double>, kCauses + 1> errors;
      std::vector<double> full;
      for (size_t i = 0; i < known.size(); ++i) {
        const StandinState& state = *known[i].second;
        full.push_back(std::abs(state.full[d]));
        for (size_t c = 0; c <= kWhole; ++c) errors[c].push_back(std::abs(state.errors[c][d]));
        if (!(state.sum_off <= scene.sum_off)) scene.sum_off = state.sum_off;
      }
      scene.full_p95.push_back(SpreadOf(full).p95);
      scene.errors.emplace_back();
      for (size_t c = 0; c <= kWhole; ++c) scene.errors.back()[c] = SpreadOf(errors[c]);
      scene.worst_at.push_back(known.empty() ? VecX(n_)
                                             : known[scene.errors.back()[kWhole].at].first);
    }
    result_.scenes.push_back(std::move(scene));
  }

  const Mechanism& robot_;
  Mechanism mechanism_;  ///< its moving part
  const StandinSettings& settings_;
  const std::function<void(double)>& progress_;
  Transmission transmission_;
  std::optional<Parts> parts_;
  std::optional<StandinBranches> branches_;
  StandinResult result_;
  Eigen::Index n_ = 0;
  UnitScale scale_;
  bool joints_differ_ = false, sign_ = true, doubted_ = false;
  std::string no_balance_;  ///< of the first state without all forces
  std::string trouble_;     ///< of the first pose that cannot be closed
};

}  // namespace

const char* WordOf(PoseStatus status) {
  switch (status) {
    case PoseStatus::kUsable:
      return "usable";
    case PoseStatus::kOpen:
      return "open";
    case PoseStatus::kDriveRange:
      return "beyond a drive's range";
    case PoseStatus::kBeyond:
      return "beyond a singularity";
  }
  return "";
}

const char* WordOf(StandinEnd::Kind kind) {
  switch (kind) {
    case StandinEnd::Kind::kNone:
      return "no end";
    case StandinEnd::Kind::kDriveRange:
      return "end of a drive's range";
    case StandinEnd::Kind::kDeadCentre:
      return "type 1, dead centre";
    case StandinEnd::Kind::kOpen:
      return "not closed beyond";
    case StandinEnd::Kind::kType2:
      return "type 2";
  }
  return "";
}

Spread SpreadOf(const std::vector<double>& magnitudes) {
  Spread spread;
  if (magnitudes.empty()) return spread;
  spread.at = static_cast<size_t>(std::ranges::max_element(magnitudes) - magnitudes.begin());
  spread.worst = magnitudes[spread.at];
  std::vector<double> sorted = magnitudes;
  std::ranges::sort(sorted);
  const auto ranked = [&](double share) {
    const double rank = std::ceil(share * static_cast<double>(sorted.size()));
    return sorted[static_cast<size_t>(std::max(rank, 1.0)) - 1];
  };
  spread.median = ranked(0.5);
  spread.p95 = ranked(0.95);
  return spread;
}

size_t StandinResult::CountOf(PoseStatus status) const {
  return static_cast<size_t>(std::ranges::count(poses, status, &StandinPose::status));
}

StandinResult ComputeStandin(const Mechanism& mechanism, const std::vector<std::string>& joints,
                             const StandinSettings& settings,
                             const std::function<void(double)>& progress) {
  return StandinComputer(mechanism, settings, progress).Compute(joints);
}

}  // namespace mbv
