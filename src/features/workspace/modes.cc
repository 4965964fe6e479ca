#include "features/workspace/modes.h"

#include <fmt/format.h>
#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <numbers>
#include <random>
#include <thread>

#include "base/text.h"
#include "kinematics/assembly.h"
#include "kinematics/constraints.h"
#include "kinematics/home.h"
#include "mechanism/joint_pose.h"
#include "mechanism/reach.h"
#include "report/page.h"
#include "verify/ranges.h"

namespace mbv {

VecX DriveValues(const Mechanism& mechanism, const BodyStates& states) {
  VecX values(static_cast<Eigen::Index>(mechanism.drives.size()));
  for (Eigen::Index d = 0; d < values.size(); ++d) {
    const Coordinate at{Coordinate::Kind::kDrive, static_cast<int>(d), 0};
    values[d] = CoordinateRow(mechanism, at, states, HomeValue(mechanism, at)).value;
  }
  return values;
}

MatX OutputValues(const Mechanism& mechanism, const BodyStates& states) {
  MatX values(static_cast<Eigen::Index>(mechanism.outputs.size()), 6);
  for (Eigen::Index o = 0; o < values.rows(); ++o) {
    for (int c = 0; c < 6; ++c) {
      values(o, c) = OutputRow(mechanism.outputs[static_cast<size_t>(o)], c, states).value;
    }
  }
  return values;
}

namespace {

using std::numbers::pi;

constexpr double kModeClosed = 1e-11;  // norm of the residual [rad, characteristic lengths]
constexpr double kSameMode = 1e-5;     // [rad, characteristic lengths]
constexpr int kBatch = 32;             // starts between two looks at the rule
constexpr int kHitsOfEach = 5;
constexpr double kCurveStep = 0.05, kLongestCurveStep = 0.15, kLeastCurveStep = 1e-6;
constexpr int kMostCurveSteps = 6000;
constexpr double kSingularPose = 1e-10;  // determinants of orthonormal motions below it are zero
constexpr double kReachOfStarts = 2.0;   // of slides without a range [characteristic lengths]

double Turned(double angle) { return std::remainder(angle, 2 * pi); }

class ModeSearch {
 public:
  ModeSearch(const Mechanism& mechanism, const std::vector<NamedCoordinate>& held,
             const VecX& values)
      : m_(mechanism),
        held_(held),
        values_(values),
        length_(CharacteristicLength(m_)),
        tree_(m_, std::vector<bool>(m_.joints.size(), false)),
        spinning_(m_.bodies.size(), false) {
    for (const Spin& spin : IdleSpins(m_)) {
      for (const int body : spin.bodies) spinning_[static_cast<size_t>(body)] = true;
    }
    unit_.resize(tree_.dofs());
    for (int c = 0; c < tree_.dofs(); ++c) unit_[c] = tree_.angular()[c] ? 1.0 : length_;
    for (size_t k = 0; k < held_.size(); ++k) {
      Coordinate at = held_[k].coordinate;
      if (at.kind == Coordinate::Kind::kDrive) {
        const auto* drive = std::get_if<JointDrive>(&m_.drives[static_cast<size_t>(at.index)].kind);
        if (drive != nullptr) at = {Coordinate::Kind::kJoint, drive->joint, drive->coordinate};
      }
      if (at.kind == Coordinate::Kind::kJoint) {
        fixed_.emplace_back(at, values_[static_cast<Eigen::Index>(k)]);
      }
    }
    for (const Joint& joint : m_.joints) home_.push_back(JointPose(joint, joint.home));
  }

  // Whether this start closes; the poses of the tree's joints.
  bool Run(unsigned start, std::vector<Pose>* X_FM) const {
    *X_FM = Start(start);
    const auto evaluate = [&](std::vector<Pose>* at, MatX* J) {
      const VecX r = Residual(*at, J);
      *J = *J * unit_.asDiagonal();
      return r;
    };
    const auto move = [&](const VecX& s, std::vector<Pose>* at) {
      tree_.Step(unit_.cwiseProduct(s), at);
    };
    internal::StallRule enough{.done = kModeClosed, .share = 1e-3, .most = 8};
    constexpr internal::DampingRule kDamping{.most_steps = 120,
                                             .largest_step = 0.7,
                                             .first = 1e-2,
                                             .least = 1e-15,
                                             .most = 8e8,
                                             .easier = 0.2,
                                             .stronger = 8.0};
    return internal::DampedSearch(kDamping, X_FM, evaluate, move, enough).norm() < kModeClosed;
  }

  [[nodiscard]] BodyStates States(const std::vector<Pose>& X_FM) const {
    BodyStates states = tree_.States(X_FM);
    if (!m_.couplings.empty()) FollowCouplings(m_, &states);
    return states;
  }

  // A way as a point: the middles of joints, how bodies of outputs are turned (without outputs, all
  // that does not spin idly), and the drives. What only turns about the line through its joints,
  // as a leg between a universal joint and a ball, is the same.
  [[nodiscard]] VecX Point(const BodyStates& states) const {
    std::vector<double> values;
    const auto add = [&](const auto& entries) {
      for (const double value : entries) values.push_back(value);
    };
    for (const Joint& joint : m_.joints) {
      if (joint.kind == JointKind::kFree) continue;
      add(Vec3(states.X_WB[static_cast<size_t>(joint.child)] * joint.X_CM.translation() / length_));
    }
    for (size_t b = 1; b < m_.bodies.size(); ++b) {
      const bool output = std::ranges::any_of(
          m_.outputs, [&](const Output& o) { return o.body == static_cast<int>(b); });
      if (!output && (!m_.outputs.empty() || spinning_[b])) continue;
      add(Vec3(states.X_WB[b].translation() / length_));
      add(states.X_WB[b].linear().reshaped());
    }
    const VecX drives = DriveValues(m_, states);
    for (Eigen::Index d = 0; d < drives.size(); ++d) {
      const bool length = PositionUnit(m_, m_.drives[static_cast<size_t>(d)]) == "m";
      if (length) add(std::array{drives[d] / length_});
      if (!length) add(std::array{std::cos(drives[d]), std::sin(drives[d])});
    }
    return Eigen::Map<const VecX>(values.data(), static_cast<Eigen::Index>(values.size()));
  }

 private:
  // Joints at random within their ranges, held coordinates as they are to be.
  [[nodiscard]] std::vector<Pose> Start(unsigned start) const {
    std::mt19937_64 random(20260801 + start);
    std::uniform_real_distribution<double> uniform(-1.0, 1.0);
    std::normal_distribution<double> normal;
    std::vector<Pose> X_FM = home_;
    if (start == 0) return X_FM;
    for (const int j : m_.tree_joints) {
      const Joint& joint = m_.joints[static_cast<size_t>(j)];
      std::array<double, 6> q = joint.home;
      for (int c = 0; c < DofsOf(joint.kind); ++c) {
        const bool length = IsLength(joint.kind, c);
        const auto k = static_cast<size_t>(c);
        const CoordinateRange& range = joint.range[k];
        q[k] = length ? q[k] + kReachOfStarts * length_ * uniform(random) : pi * uniform(random);
        if (length && std::isfinite(range.lower) && std::isfinite(range.upper)) {
          q[k] = range.lower + 0.5 * (1.0 + uniform(random)) * (range.upper - range.lower);
        }
      }
      for (const auto& [at, value] : fixed_) {
        if (at.index == j) q[static_cast<size_t>(at.component)] = value;
      }
      X_FM[static_cast<size_t>(j)] = JointPose(joint, q);
      if (joint.kind == JointKind::kSpherical || joint.kind == JointKind::kFree) {
        Eigen::Quaterniond turn;
        turn.coeffs() << normal(random), normal(random), normal(random), normal(random);
        X_FM[static_cast<size_t>(j)].linear() = turn.normalized().toRotationMatrix();
      }
    }
    return X_FM;
  }
  [[nodiscard]] VecX Residual(const std::vector<Pose>& X_FM, MatX* J) const {
    const BodyStates states = States(X_FM);
    const MatX J_bodies = tree_.Jacobian(states);
    std::vector<Eigen::RowVectorXd> rows;
    std::vector<double> r;
    for (const Joint& joint : m_.joints) {
      if (!joint.closure) continue;
      const internal::ClosureGap gap =
          internal::AssemblyResidual(joint,
                                     {states.X_WB[static_cast<size_t>(joint.parent)],
                                      states.X_WB[static_cast<size_t>(joint.child)]},
                                     length_);
      for (Eigen::Index i = 0; i < gap.residual.size(); ++i) {
        r.push_back(gap.residual[i]);
        rows.emplace_back(gap.J_parent.row(i) * J_bodies.middleRows<6>(6 * joint.parent) +
                          gap.J_child.row(i) * J_bodies.middleRows<6>(6 * joint.child));
      }
    }
    for (const CouplingRow& coupling : CouplingRows(m_, states)) {
      const double scale = coupling.angular ? 1.0 : 1.0 / length_;
      Eigen::RowVectorXd row = Eigen::RowVectorXd::Zero(J_bodies.cols());
      for (const ScalarRow& piece : coupling.pieces) row += internal::RowAlong(piece, J_bodies);
      r.push_back(scale * coupling.value);
      rows.emplace_back(scale * row);
    }
    for (size_t k = 0; k < held_.size(); ++k) {
      const double value = values_[static_cast<Eigen::Index>(k)];
      const bool length = IsLength(m_, held_[k].coordinate);
      const ScalarRow row = CoordinateRow(m_, held_[k].coordinate, states, value);
      r.push_back(length ? (row.value - value) / length_ : Turned(row.value - value));
      rows.emplace_back(internal::RowAlong(row, J_bodies) / (length ? length_ : 1.0));
    }
    J->resize(static_cast<Eigen::Index>(rows.size()), J_bodies.cols());
    VecX residual(J->rows());
    for (Eigen::Index i = 0; i < residual.size(); ++i) {
      residual[i] = r[static_cast<size_t>(i)];
      J->row(i) = rows[static_cast<size_t>(i)];
    }
    return residual;
  }

  const Mechanism& m_;
  const std::vector<NamedCoordinate>& held_;
  const VecX& values_;
  double length_;
  internal::TreeMotion tree_;
  std::vector<bool> spinning_;
  std::vector<std::pair<Coordinate, double>> fixed_;  // of joints, that starts begin with
  std::vector<Pose> home_;
  VecX unit_;
};

// Poses on the curve of coordinate `free` through a mode at which it has its value again.
class CurveSearch {
 public:
  CurveSearch(const Mechanism& mechanism, std::vector<NamedCoordinate> held, VecX values,
              size_t free)
      : goal_(values[static_cast<Eigen::Index>(free)]),
        angular_(!IsLength(mechanism, held[free].coordinate)),
        space_(mechanism, Settings(std::move(held), std::move(values), free)) {
    ready_ = space_.Home(&home_);
  }

  [[nodiscard]] std::vector<std::vector<Pose>> Follow(const std::vector<Pose>& X_FM,
                                                      const std::vector<double>& coupled) const {
    std::vector<std::vector<Pose>> found;
    PlacedPose start;
    SpacePose pose = home_.pose;
    pose.X_FM = X_FM;
    pose.coupled = coupled;
    pose.watched.resize(0);
    if (!ready_ || !space_.Place(pose, &start)) return found;
    PlacedPose at = start;
    const VecX first = start.N_free.col(0);
    VecX way = first;
    double h = kCurveStep;
    for (int i = 0; i < kMostCurveSteps; ++i) {
      const double sign = at.N_free.col(0).dot(way) < 0.0 ? -1.0 : 1.0;
      PlacedPose next;
      while (!space_.Step(at, VecX::Constant(1, sign * h), &next)) {
        h *= 0.5;
        if (h < kLeastCurveStep) return found;
      }
      way = sign * at.N_free.col(0);
      const double before = Miss(at), after = Miss(next);
      const bool jumps = angular_ && std::abs(before) + std::abs(after) > pi;
      PlacedPose there;
      if (i > 0 && !jumps && (before < 0.0) != (after < 0.0) &&
          Between(at, sign * h, before, after, &there)) {
        // Back at the start, the same way: the curve is closed.
        if (Same(there, start) && first.dot(way) > 0.0) return found;
        found.push_back(there.pose.X_FM);
      }
      at = std::move(next);
      h = std::min(1.3 * h, kLongestCurveStep);
    }
    return found;
  }

 private:
  static SpaceSettings Settings(std::vector<NamedCoordinate> held, VecX values, size_t free) {
    std::swap(held[0], held[free]);
    std::swap(values[0], values[static_cast<Eigen::Index>(free)]);
    SpaceSettings settings;
    settings.coordinates = std::move(held);
    settings.over = 1;
    settings.held = values.tail(values.size() - 1);
    return settings;
  }
  [[nodiscard]] double Miss(const PlacedPose& at) const {
    const double miss = at.pose.at[0] - goal_;
    return angular_ ? Turned(miss) : miss;
  }
  // The pose where the miss vanishes (Illinois).
  bool Between(const PlacedPose& at, double step, double f_a, double f_b, PlacedPose* to) const {
    const double tolerance = 1e-13 * space_.UnitOf(0);
    bool reached = true;
    const auto miss = [&](double c, double* f) {
      reached = space_.Step(at, VecX::Constant(1, c), to);
      *f = reached ? Miss(*to) : 0.0;
      return reached;
    };
    // What is as near as rounding lets it come counts, too.
    return FindCrossing(
               0.0, f_a, step, f_b, miss,
               [&](double f, double width) { return std::abs(f) < tolerance || width < 1e-15; }) ||
           reached;
  }
  [[nodiscard]] bool Same(const PlacedPose& a, const PlacedPose& b) const {
    double most = 0.0;
    for (size_t j = 0; j < a.pose.X_FM.size(); ++j) {
      most = std::max(most, (a.pose.X_FM[j].matrix() - b.pose.X_FM[j].matrix()).norm());
    }
    return most < kSameMode * (1.0 + space_.length());
  }

  double goal_;
  bool angular_, ready_ = false;
  PoseSpace space_;
  PlacedPose home_;
};

// On all threads; by index.
template <typename Work>
void Share(size_t count, int threads, const Work& work) {
  std::atomic<size_t> next = 0;
  const auto run = [&] {
    for (size_t i = next++; i < count; i = next++) work(i);
  };
  std::vector<std::thread> others;
  for (int t = 1; t < threads; ++t) others.emplace_back(run);
  run();
  for (std::thread& other : others) other.join();
}

}  // namespace

AssemblyModes FindModes(const Mechanism& mechanism, const std::vector<NamedCoordinate>& held,
                        const VecX& values, const ModeSettings& settings,
                        const std::function<void(double)>& progress) {
  const auto begin = std::chrono::steady_clock::now();
  AssemblyModes result;
  result.values = values;
  for (const NamedCoordinate& named : held) {
    result.held.push_back(named.name);
    result.units.push_back(CoordinateUnit(mechanism, named.coordinate));
  }
  const ModeSearch search(mechanism, held, values);
  std::vector<VecX> known;  // points of the modes
  const auto add = [&](const std::vector<Pose>& X_FM, int starts) {
    const BodyStates states = search.States(X_FM);
    const VecX point = search.Point(states);
    for (size_t k = 0; k < known.size(); ++k) {
      if ((known[k] - point).cwiseAbs().maxCoeff() > kSameMode) continue;
      result.modes[k].starts += starts;
      return;
    }
    known.push_back(point);
    AssemblyMode mode;
    mode.pose.X_FM = X_FM;
    mode.pose.coupled = states.coupled;
    mode.starts = starts;
    result.by_curves += starts == 0 ? 1 : 0;
    result.modes.push_back(std::move(mode));
  };
  // The curves of a mode, once.
  size_t followed = 0;
  const auto follow = [&] {
    while (settings.curves && followed < result.modes.size()) {
      const size_t first = followed, d = held.size();
      followed = result.modes.size();
      std::vector<std::vector<std::vector<Pose>>> found((followed - first) * d);
      Share(found.size(), settings.threads, [&](size_t i) {
        const SpacePose& pose = result.modes[first + i / d].pose;
        const CurveSearch curve(mechanism, held, values, i % d);
        found[i] = curve.Follow(pose.X_FM, pose.coupled);
      });
      result.curves += static_cast<int>(found.size());
      for (const auto& poses : found) {
        for (const std::vector<Pose>& X_FM : poses) add(X_FM, 0);
      }
    }
  };
  while (result.starts < settings.most_starts && !result.settled) {
    std::vector<std::vector<Pose>> closed(kBatch);
    std::vector<char> ok(kBatch, 0);
    Share(kBatch, settings.threads, [&](size_t i) {
      ok[i] =
          search.Run(static_cast<unsigned>(result.starts) + static_cast<unsigned>(i), &closed[i])
              ? 1
              : 0;
    });
    result.starts += kBatch;
    for (size_t i = 0; i < closed.size(); ++i) {
      if (ok[i] == 0) continue;
      ++result.closed;
      add(closed[i], 1);
    }
    follow();
    const auto count = static_cast<int>(result.modes.size());
    result.once = static_cast<int>(
        std::ranges::count_if(result.modes, [](const AssemblyMode& m) { return m.starts == 1; }));
    result.settled = result.starts >= settings.least_starts && result.once == 0 && count > 0 &&
                     result.closed >= kHitsOfEach * count;
    if (progress) {
      progress(std::min(1.0, result.closed / std::max(1.0, 1.0 * kHitsOfEach * count)));
    }
  }
  // What else is of interest.
  std::vector<std::pair<double, size_t>> order;
  BodyStates home;
  home.Resize(mechanism.bodies.size());
  home.X_WB = mechanism.X_WB_home;
  const VecX at_home = search.Point(home);
  for (size_t k = 0; k < known.size(); ++k) {
    order.emplace_back((known[k] - at_home).norm(), k);
  }
  std::ranges::sort(order);
  std::vector<AssemblyMode> sorted;
  for (const auto& [distance, k] : order) {
    AssemblyMode& mode = result.modes[k];
    const BodyStates states = search.States(mode.pose.X_FM);
    mode.drives = DriveValues(mechanism, states);
    mode.outputs = OutputValues(mechanism, states);
    mode.within = IsWithinRanges(mechanism, states.X_WB);
    sorted.push_back(std::move(mode));
  }
  result.modes = std::move(sorted);
  result.wall_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  result.summary = RunSummary::Done();
  if (result.modes.empty()) {
    result.summary.stop = Stop::kUnreachable;
    result.summary.message =
        fmt::format("none of {} starts closes the loops with these values", result.starts);
  }
  return result;
}

namespace {

ReportSection ModesSection(const Mechanism& mechanism, const AssemblyModes& modes) {
  ReportSection section{.title = "Ways to close for the same " + Joined(modes.held, 6),
                        .link = "Modes"};
  Table table{.name = "modes", .columns = {Digits("way"), Text("ranges"), Spare(Digits("starts"))}};
  const auto number = [](double value, bool length) {
    return length ? fmt::format("{:.6g} m", value) : fmt::format("{:.5g}°", value * 180.0 / pi);
  };
  for (const Output& output : mechanism.outputs) {
    for (const char* c : {"x", "y", "z", "roll", "pitch", "yaw"}) {
      table.columns.push_back(Digits(output.name + "." + c));
    }
  }
  for (const Drive& drive : mechanism.drives) table.columns.push_back(Digits(drive.name));
  for (size_t k = 0; k < modes.modes.size(); ++k) {
    const AssemblyMode& mode = modes.modes[k];
    std::vector<Cell> row = {fmt::format("{}", k + 1),
                             mode.within ? Cell("within", Mark::kOk) : Cell("beyond", Mark::kOff),
                             fmt::format("{}", mode.starts)};
    for (Eigen::Index o = 0; o < mode.outputs.rows(); ++o) {
      for (Eigen::Index c = 0; c < 6; ++c) row.emplace_back(number(mode.outputs(o, c), c < 3));
    }
    for (Eigen::Index d = 0; d < mode.drives.size(); ++d) {
      const Drive& drive = mechanism.drives[static_cast<size_t>(d)];
      row.emplace_back(number(mode.drives[d], PositionUnit(mechanism, drive) == "m"));
    }
    table.rows.push_back(std::move(row));
  }
  const auto within = std::ranges::count_if(modes.modes, [](const auto& m) { return m.within; });
  section.Add(Paragraph{fmt::format("{} for the same {}, {} within the ranges.",
                                    modes.modes.size() == 1
                                        ? "1 way to close"
                                        : fmt::format("{} ways to close", modes.modes.size()),
                                    Joined(modes.held, 6), within)});
  section.Add(std::move(table));
  section.Note(
      fmt::format("{} starts, {} closed; {} curves on which one coordinate is free, which found {} "
                  "ways first. {}",
                  modes.starts, modes.closed, modes.curves, modes.by_curves,
                  modes.settled
                      ? "Starts found no way once only, and closed five times as often as "
                        "there are ways. This is what was found, not a proof."
                      : fmt::format("{} ways were found by one start only: there may be "
                                    "more.",
                                    modes.once)),
      On::kAll);
  return section;
}

const char* const kHowToRead =
    "assembly modes are for the same drives, working modes for the same coordinates of the output";

std::string ModesCsv(const Mechanism& mechanism, const ModesOfPose& modes) {
  std::string csv = "same,way,within_ranges,starts";
  for (const Output& output : mechanism.outputs) {
    for (const char* c : {"x_m", "y_m", "z_m", "roll_rad", "pitch_rad", "yaw_rad"}) {
      csv += "," + output.name + "." + c;
    }
  }
  for (const Drive& drive : mechanism.drives) {
    csv += "," + drive.name + "_" + PositionUnit(mechanism, drive);
  }
  csv += "\n";
  for (const auto& [same, found] : modes.of) {
    for (size_t k = 0; k < found.modes.size(); ++k) {
      const AssemblyMode& mode = found.modes[k];
      csv += fmt::format("{},{},{},{}", same, k + 1, mode.within ? 1 : 0, mode.starts);
      for (Eigen::Index o = 0; o < mode.outputs.rows(); ++o) {
        for (Eigen::Index c = 0; c < 6; ++c) csv += fmt::format(",{:.17g}", mode.outputs(o, c));
      }
      for (const double value : mode.drives) csv += fmt::format(",{:.17g}", value);
      csv += "\n";
    }
  }
  return csv;
}

}  // namespace

ModesOfPose FindModesOfPose(const SetQuestion& question, bool of_drives, bool of_output,
                            int threads, const ProgressFunction& progress,
                            Diagnostics* diagnostics) {
  ModesOfPose result;
  result.notes = question.notes;
  const Mechanism& m = question.mechanism;
  const std::vector<NamedCoordinate>& coordinates = question.settings.coordinates;
  const auto all = static_cast<int>(coordinates.size());
  PoseSpace space = PoseSpace(m, question.settings).Section(all);
  PlacedPose home, start;
  const bool regular = space.Home(&home) && std::abs(home.type1) > kSingularPose;
  if (regular) space.CountFrom(&home);
  if (!regular || !space.Close(home, question.start, &start)) {
    diagnostics->AddError(m.file, "the pose is not reached from home",
                          "hold other values by --at, or begin elsewhere by --from");
    return result;
  }
  const auto find = [&](const char* of, const std::vector<NamedCoordinate>& held,
                        const VecX& values) {
    result.of.emplace_back(of,
                           FindModes(m, held, values, {.threads = threads},
                                     StageOf(progress, std::string("ways for the same ") + of)));
  };
  if (of_drives) {
    std::vector<NamedCoordinate> drives;
    for (NamedCoordinate& named : NamedCommandCoordinates(m)) {
      if (named.coordinate.kind != Coordinate::Kind::kOutput) drives.push_back(std::move(named));
    }
    if (static_cast<int>(drives.size()) != all) {
      diagnostics->AddError(
          m.file,
          fmt::format("{} drives do not determine {} degrees of freedom", drives.size(), all),
          "--modes output");
      return result;
    }
    const BodyStates states = space.States(start.pose);
    VecX values(all);
    for (int k = 0; k < all; ++k) {
      const Coordinate& at = drives[static_cast<size_t>(k)].coordinate;
      values[k] = CoordinateRow(m, at, states, HomeValue(m, at)).value;
    }
    find("drives", drives, values);
  }
  if (of_output) find("output", coordinates, question.start);
  return result;
}

Mechanism WithHomeAt(const Mechanism& mechanism, const AssemblyMode& mode) {
  Mechanism result = mechanism;
  std::vector<std::array<double, 6>> near;
  for (const Joint& joint : mechanism.joints) near.push_back(joint.home);
  result.X_WB_home = ChainPoses(mechanism, mode.pose.X_FM);
  const auto at = JointCoordinatesAt(mechanism, result.X_WB_home, near);
  for (size_t j = 0; j < at.size(); ++j) result.joints[j].guess = result.joints[j].home = at[j];
  return result;
}

std::string ToText(const Mechanism& mechanism, const ModesOfPose& modes, const TextStyle& style) {
  std::string text;
  for (const auto& [of, found] : modes.of) text += ToText(ModesSection(mechanism, found), style);
  for (const std::string& note : modes.notes) text += style.indent + "note: " + note + "\n";
  return text;
}

nlohmann::ordered_json ToJson(const Mechanism& mechanism, const ModesOfPose& modes) {
  auto json = nlohmann::ordered_json::array();
  for (const auto& [same, found] : modes.of) {
    auto held = nlohmann::ordered_json::array();
    for (size_t k = 0; k < found.held.size(); ++k) {
      held.push_back({{"name", found.held[k]},
                      {"value", Number(found.values[static_cast<Eigen::Index>(k)])},
                      {"unit", found.units[k]}});
    }
    auto ways = nlohmann::ordered_json::array();
    for (const AssemblyMode& mode : found.modes) {
      auto outputs = nlohmann::ordered_json::object(), drives = nlohmann::ordered_json::object();
      for (size_t o = 0; o < mechanism.outputs.size(); ++o) {
        auto& pose = outputs[mechanism.outputs[o].name] = nlohmann::ordered_json::array();
        for (int c = 0; c < 6; ++c) {
          pose.push_back(Number(mode.outputs(static_cast<Eigen::Index>(o), c)));
        }
      }
      for (size_t d = 0; d < mechanism.drives.size(); ++d) {
        drives[mechanism.drives[d].name] = Number(mode.drives[static_cast<Eigen::Index>(d)]);
      }
      ways.push_back({{"within_ranges", mode.within},
                      {"starts", mode.starts},
                      {"outputs", std::move(outputs)},
                      {"drives", std::move(drives)}});
    }
    json.push_back({{"same", same},
                    {"held", std::move(held)},
                    {"count", found.modes.size()},
                    {"ways", std::move(ways)},
                    {"starts", found.starts},
                    {"closed", found.closed},
                    {"found_once", found.once},
                    {"settled", found.settled},
                    {"curves", found.curves},
                    {"by_curves", found.by_curves},
                    {"wall_s", Number(found.wall_s)}});
  }
  return json;
}

std::vector<std::pair<std::string, std::string>> ModeFiles(const Mechanism& mechanism,
                                                           const ModesOfPose& modes) {
  Page page;
  std::string lead;
  for (const auto& [of, found] : modes.of) {
    page.Add(ModesSection(mechanism, found));
    lead +=
        fmt::format("{}{} ways for the same {}", lead.empty() ? "" : ", ", found.modes.size(), of);
  }
  return {{"modes.html", page.Write({.kicker = "mbverify workspace",
                                     .title = mechanism.name,
                                     .lead = lead,
                                     .judges = false,
                                     .footer = kHowToRead})},
          {"modes.csv", ModesCsv(mechanism, modes)}};
}

}  // namespace mbv
