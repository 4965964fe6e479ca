#include "kinematics/singularity.h"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <Eigen/SVD>
#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

#include "kinematics/command_rank.h"
#include "kinematics/constraints.h"
#include "kinematics/row_stack.h"
#include "kinematics/tree_motion.h"
#include "math/sparse.h"
#include "mechanism/idle_spins.h"
#include "mechanism/reach.h"

namespace mbv {
namespace {

constexpr double kLost = 1e-5;     // singular values below this share of the first are none
constexpr size_t kRankPoses = 5;   // that the rank is found at
constexpr size_t kCoarse = 100;    // poses that are measured first
constexpr size_t kMostMinima = 5;  // of these, that are looked at closely
constexpr double kNearby = 0.02;   // of the duration: "near" in time
constexpr double kNoForce = 1e-9;  // of the largest median of a unit's drives
constexpr size_t kKinds = 3;

BodyStates StatesAt(const std::vector<Pose>& X_WB) {
  BodyStates states;
  states.Resize(X_WB.size());
  states.X_WB = X_WB;
  return states;
}

// The middle of a body's joints.
std::vector<Vec3> JointCentres(const Mechanism& m) {
  std::vector<Vec3> sum(m.bodies.size(), Vec3::Zero());
  std::vector<int> count(m.bodies.size(), 0);
  for (const Joint& joint : m.joints) {
    if (joint.kind == JointKind::kFree) continue;
    sum[static_cast<size_t>(joint.parent)] += joint.X_PF.translation();
    sum[static_cast<size_t>(joint.child)] += joint.X_CM.translation();
    ++count[static_cast<size_t>(joint.parent)];
    ++count[static_cast<size_t>(joint.child)];
  }
  for (size_t b = 0; b < sum.size(); ++b) {
    sum[b] = count[b] > 0 ? Vec3(sum[b] / count[b]) : m.bodies[b].p_BoBcm_B;
  }
  return sum;
}

bool IsDriven(const Coordinate& coordinate) {
  return coordinate.kind == Coordinate::Kind::kDrive ||
         coordinate.kind == Coordinate::Kind::kPrescribed;
}

bool OfDrives(const std::vector<Command>& commands) {
  return std::ranges::all_of(commands, [](const Command& command) {
    return std::ranges::all_of(command.terms,
                               [](const Command::Term& t) { return IsDriven(t.coordinate); });
  });
}

// What is commanded; where only drives are, coordinates of the outputs.
std::vector<Command> WhatIsAsked(const Mechanism& m, const Motion& motion) {
  if (!OfDrives(motion.commands)) return motion.commands;
  std::vector<NamedCoordinate> candidates;
  for (NamedCoordinate& named : NamedCommandCoordinates(m)) {
    if (named.coordinate.kind == Coordinate::Kind::kOutput) candidates.push_back(std::move(named));
  }
  std::vector<Coordinate> of;
  of.reserve(candidates.size());
  for (const NamedCoordinate& named : candidates) of.push_back(named.coordinate);
  const CoordinateChoice choice = ChooseCoordinates(m, of, of.size());
  std::vector<Command> commands;
  if (of.empty() || choice.left() > 0) return commands;
  for (const size_t k : choice.chosen) {
    commands.push_back({candidates[k].name, {{candidates[k].coordinate, 1.0}}, {}});
  }
  return commands;
}

// Columns of unit length; what is zero stays.
SparseLu::Matrix OfUnitLength(SparseLu::Matrix columns) {
  for (Eigen::Index c = 0; c < columns.cols(); ++c) {
    const double length = columns.col(c).norm();
    if (length == 0.0) continue;
    for (SparseLu::Matrix::InnerIterator entry(columns, c); entry; ++entry) {
      entry.valueRef() /= length;
    }
  }
  return columns;
}

SparseLu::Matrix Chosen(const SparseLu::Matrix& columns, const std::vector<int>& which) {
  std::vector<Eigen::Triplet<double>> entries;
  for (size_t k = 0; k < which.size(); ++k) {
    for (SparseLu::Matrix::InnerIterator entry(columns, which[k]); entry; ++entry) {
      entries.emplace_back(entry.row(), static_cast<int>(k), entry.value());
    }
  }
  SparseLu::Matrix some(columns.rows(), static_cast<Eigen::Index>(which.size()));
  some.setFromTriplets(entries.begin(), entries.end());
  return some;
}

}  // namespace

const char* ToText(SingularityKind kind) {
  constexpr std::array<const char*, kKinds> kWords = {"inverse", "forward", "constraint"};
  return kWords.at(static_cast<size_t>(kind));
}

struct SingularityMeter::Impl {
  Impl(const Mechanism& mechanism, const std::vector<Command>& x)
      : m(mechanism),
        asked(x),
        length(CharacteristicLength(m)),
        tree(m, std::vector<bool>(m.joints.size(), false)),
        spins(IdleSpins(m)),
        centres(JointCentres(m)) {
    const auto drive = [&](Coordinate::Kind kind, size_t index) {
      driven.push_back({"", {{{kind, static_cast<int>(index), 0}, 1.0}}, {}});
    };
    for (size_t d = 0; d < m.drives.size(); ++d) drive(Coordinate::Kind::kDrive, d);
    for (size_t p = 0; p < m.prescribed.size(); ++p) {
      drive(Coordinate::Kind::kPrescribed, p);
      // Held at home where nothing else is said.
      const bool known = std::ranges::any_of(asked, [&](const Command& command) {
        return std::ranges::any_of(command.terms, [&](const Command::Term& term) {
          return term.coordinate == driven.back().terms[0].coordinate;
        });
      });
      if (!known && !asked.empty()) asked.push_back(driven.back());
    }
  }

  // Of a term in a command's row: angles count by the length.
  [[nodiscard]] double ScaleOf(const Command::Term& term) const {
    return (IsLength(m, term.coordinate) ? 1.0 : length) * term.factor;
  }
  [[nodiscard]] MatX Rates(const std::vector<Command>& commands, const BodyStates& states,
                           const MatX& J) const {
    MatX C = MatX::Zero(static_cast<Eigen::Index>(commands.size()), J.cols());
    for (size_t k = 0; k < commands.size(); ++k) {
      for (const Command::Term& term : commands[k].terms) {
        C.row(static_cast<Eigen::Index>(k)) +=
            ScaleOf(term) * internal::RowAlong(CoordinateRow(m, term.coordinate, states), J);
      }
    }
    return C;
  }

  // A pose in rates y = R q̇ with |y| = V.
  struct Here {
    MatX J;                   // twists per rate of the tree
    Eigen::LLT<MatX> metric;  // RᵀR
    MatX V;                   // of A R⁻¹: right singular vectors, least first
    VecX sigma;               // its singular values, least first; as many as columns
    [[nodiscard]] MatX InRates(const MatX& C) const {
      return metric.matrixL().solve(C.transpose()).transpose();
    }
  };
  [[nodiscard]] Here Place(const BodyStates& states) const {
    Here here;
    here.J = tree.Jacobian(states);
    MatX S = here.J.bottomRows(here.J.rows() - 6);
    const auto bodies = static_cast<Eigen::Index>(m.bodies.size()) - 1;
    for (Eigen::Index b = 0; b < bodies; ++b) {
      const auto body = static_cast<size_t>(b + 1);
      const Vec3 c = states.X_WB[body].linear() * centres[body];
      for (Eigen::Index k = 0; k < S.cols(); ++k) {
        const Vec3 w = S.col(k).segment<3>(6 * b);
        S.col(k).segment<3>(6 * b + 3) += w.cross(c);
      }
      S.middleRows<3>(6 * b) *= length;
    }
    here.metric.compute(S.transpose() * S / static_cast<double>(bodies));
    const MatX B = here.InRates(internal::LoopRows(m, spins, states, here.J, length));
    const Eigen::SelfAdjointEigenSolver<MatX> eigen(B.transpose() * B);
    here.V = eigen.eigenvectors();
    here.sigma = eigen.eigenvalues().cwiseMax(0.0).cwiseSqrt();
    return here;
  }

  // Moves most, by the twists of the bodies.
  template <typename TwistOf>
  [[nodiscard]] int MovesMost(const TwistOf& twist_of) const {
    int most = -1;
    double largest = 0.0;
    for (size_t b = 1; b < m.bodies.size(); ++b) {
      const Vec6 V = twist_of(b);
      const double speed = std::hypot(length * V.head<3>().norm(), V.tail<3>().norm());
      if (!(speed > largest * (1.0 + 1e-9))) continue;
      largest = speed;
      most = static_cast<int>(b);
    }
    return most;
  }
  [[nodiscard]] int Body(const Here& here, const VecX& y) const {
    const VecX twists = here.J * here.metric.matrixU().solve(y);
    return MovesMost(
        [&](size_t b) -> Vec6 { return twists.segment<6>(6 * static_cast<Eigen::Index>(b)); });
  }
  // Least rate of the commands in motions N; of more motions than commands can hold none.
  [[nodiscard]] Distance Least(const std::vector<Command>& commands, const BodyStates& states,
                               const Here& here) const {
    const Eigen::Index n = tree.dofs() - rank;
    if (n == 0 || static_cast<Eigen::Index>(commands.size()) < n) return {};
    const MatX N = here.V.leftCols(n);
    const Eigen::JacobiSVD<MatX> svd(here.InRates(Rates(commands, states, here.J)) * N,
                                     Eigen::ComputeThinV);
    return {svd.singularValues()[n - 1], Body(here, N * svd.matrixV().col(n - 1))};
  }

  // The same sparse: what (2) leaves free is never written down.

  // Rows over y = [L ω; v_c] / √bodies of all moving bodies, |y| = V by (1); a row in each column.
  class RowsByBodies {
   public:
    RowsByBodies(const Mechanism& m, const std::vector<Vec3>& centres, const BodyStates& states,
                 double length)
        : length_(length), root_(std::sqrt(static_cast<double>(m.bodies.size()) - 1.0)) {
      for (size_t b = 0; b < centres.size(); ++b)
        c_.push_back(states.X_WB[b].linear() * centres[b]);
    }

    void Begin() { ++count_; }
    void Add(int body, const Vec6& J, double scale) {
      if (body == 0) return;
      Vec6 entry = scale * root_ * J;  // of v_Bo = v_c − ω × c
      const Vec3 f = entry.tail<3>();
      entry.head<3>() = (entry.head<3>() - c_[static_cast<size_t>(body)].cross(f)) / length_;
      // Without rounding of zeros, so that patterns stay from pose to pose.
      const double least = 16 * kEps * entry.norm();
      for (int k = 0; k < 6; ++k) {
        if (std::abs(entry[k]) > least)
          entries_.emplace_back(6 * (body - 1) + k, count_ - 1, entry[k]);
      }
    }
    void Add(const ScalarRow& row, double scale) {
      Add(row.parent, row.J_parent, scale);
      Add(row.child, row.J_child, scale);
    }
    void Add(const ConstraintRows& rows) {
      for (int i = 0; i < rows.rows; ++i) {
        Begin();
        const double scale = i < rows.translation_rows ? 1.0 : length_;
        Add(rows.parent, rows.J_parent.row(i), scale);
        Add(rows.child, rows.J_child.row(i), scale);
      }
    }
    [[nodiscard]] SparseLu::Matrix Columns() const {
      SparseLu::Matrix columns(6 * (static_cast<Eigen::Index>(c_.size()) - 1), count_);
      columns.setFromTriplets(entries_.begin(), entries_.end());
      return columns;
    }
    // Twists [ω; v_Bo] of a body.
    [[nodiscard]] Vec6 Twist(const VecX& y, size_t body) const {
      Vec6 V = root_ * y.segment<6>(6 * (static_cast<Eigen::Index>(body) - 1));
      V.head<3>() /= length_;
      V.tail<3>() -= V.head<3>().cross(c_[body]);
      return V;
    }

   private:
    double length_, root_;
    std::vector<Vec3> c_;
    std::vector<Eigen::Triplet<double>> entries_;
    int count_ = 0;
  };

  struct SparseHere {
    RowsByBodies of_tree;
    SparseLu::Matrix tree, loops, held;  // held: rows of both that span all, of unit length
    SparseLeastNorm motions;             // factors of the rows held
  };
  [[nodiscard]] RowsByBodies NoRows(const BodyStates& states) const {
    return {m, centres, states, length};
  }
  [[nodiscard]] SparseHere PlaceSparse(const BodyStates& states) const {
    SparseHere here{.of_tree = NoRows(states), .tree = {}, .loops = {}, .held = {}, .motions = {}};
    RowsByBodies of_loops = NoRows(states);
    for (const Joint& joint : m.joints) {
      (joint.closure ? of_loops : here.of_tree).Add(RowsOf(joint, states, false, false));
    }
    for (const CouplingRow& coupling : CouplingRows(m, states)) {
      of_loops.Begin();
      for (const ScalarRow& piece : coupling.pieces) {
        of_loops.Add(piece, coupling.angular ? length : 1.0);
      }
    }
    for (const Spin& spin : spins) {
      of_loops.Begin();
      of_loops.Add(IdleRow(spin, states), length);
    }
    here.tree = OfUnitLength(here.of_tree.Columns());
    here.loops = of_loops.Columns();
    return here;
  }
  [[nodiscard]] static SparseLu::Matrix AllRows(const SparseHere& here) {
    return OfUnitLength(SideBySide({&here.tree, &here.loops}));
  }
  // Of all rows at a pose. Poses of simulations close to 1e-8 or so.
  [[nodiscard]] static SparseRank RankOf(const SparseLu::Matrix& all) {
    SparseRank ranks(all, internal::kRankTolerance);
    return ranks.clear() ? ranks : SparseRank(all, kLost);
  }
  // Factors the rows that the meter holds, or others of the pose. False where (2) is singular.
  [[nodiscard]] bool Hold(SparseHere* here) const {
    constexpr double kLeastPivot = 1e-11;  // about the square of a singular value
    const SparseLu::Matrix all = AllRows(*here);
    const auto factor = [&](const std::vector<int>& rows) {
      here->held = Chosen(all, rows);
      here->motions.Reset();
      return here->motions.Factor(SparseLu::Matrix(here->held.transpose()), kLeastPivot);
    };
    if (factor(held_rows)) return true;
    const SparseRank ranks = RankOf(all);
    return ranks.rank() == static_cast<int>(held_rows.size()) && factor(ranks.FirmlyIndependent());
  }
  [[nodiscard]] std::optional<Distance> Judged(const SparseHere& here,
                                               const SingularPair& pair) const {
    if (!pair.converged) return std::nullopt;
    return Distance{pair.value,
                    MovesMost([&](size_t b) { return here.of_tree.Twist(pair.vector, b); })};
  }
  // Nothing where factors fail: then the dense matrices decide.
  [[nodiscard]] std::optional<Distance> LeastSparse(const std::vector<Command>& commands,
                                                    const BodyStates& states,
                                                    const SparseHere& here) const {
    const Eigen::Index n = tree.dofs() - rank;
    if (n == 0 || static_cast<Eigen::Index>(commands.size()) < n) return Distance{};
    RowsByBodies rates = NoRows(states);
    for (const Command& command : commands) {
      rates.Begin();
      for (const Command::Term& term : command.terms) {
        rates.Add(CoordinateRow(m, term.coordinate, states), ScaleOf(term));
      }
    }
    return Judged(here, LeastSingular(rates.Columns(), here.held));
  }
  [[nodiscard]] std::optional<Distance> LeastOfLoops(const SparseHere& here) const {
    const auto without_motions = [&](VecX* y) { *y = here.held * here.motions.LeastSquares(*y); };
    return Judged(here, LeastSingular(here.loops, here.tree, without_motions));
  }
  // By SingularityKind.
  [[nodiscard]] std::optional<std::vector<Distance>> SparseAt(const BodyStates& states) const {
    SparseHere here = PlaceSparse(states);
    if (!Hold(&here)) return {};
    std::vector<std::optional<Distance>> found(kKinds, Distance{});
    found[0] = LeastSparse(asked, states, here);
    if (holds) found[1] = LeastSparse(driven, states, here);
    if (rank > 0) found[2] = LeastOfLoops(here);
    std::vector<Distance> distances;
    for (const std::optional<Distance>& one : found) {
      if (!one) return {};
      distances.push_back(*one);
    }
    return distances;
  }
  // The rank, rows of as many, and whether the drives hold every motion.
  void FindRows(const std::vector<BodyStates>& some) {
    std::vector<SparseHere> heres;
    std::optional<SparseRank> most;
    for (const BodyStates& states : some) {
      heres.push_back(PlaceSparse(states));
      SparseRank ranks = RankOf(AllRows(heres.back()));
      if (!most || ranks.rank() > most->rank()) most = std::move(ranks);
    }
    held_rows = most->FirmlyIndependent();
    rank = most->rank() - heres.front().tree.cols();
    for (size_t k = 0; k < some.size() && !holds; ++k) {
      if (!Hold(&heres[k])) continue;
      const std::optional<Distance> forward = LeastSparse(driven, some[k], heres[k]);
      holds = forward && forward->value > kLost;
    }
  }

  const Mechanism& m;
  std::vector<Command> asked, driven;
  double length;
  internal::TreeMotion tree;
  std::vector<Spin> spins;
  std::vector<Vec3> centres;
  Eigen::Index rank = 0;       // of (2), where it is regular
  bool holds = false;          // the drives hold every motion somewhere
  std::vector<int> held_rows;  // of tree and loops, that span all; sparse only
};

SingularityMeter::SingularityMeter(const Mechanism& mechanism, const std::vector<Command>& x,
                                   const std::vector<std::vector<Pose>>& poses, int most_dense)
    : impl_(std::make_unique<Impl>(mechanism, x)) {
  std::vector<BodyStates> some = {StatesAt(mechanism.X_WB_home)};
  const size_t count = std::min(kRankPoses, poses.size());
  for (size_t k = 0; k < count; ++k) {
    some.push_back(StatesAt(poses[(2 * k + 1) * poses.size() / (2 * count)]));
  }
  if (impl_->tree.dofs() == 0) return;
  if (impl_->tree.dofs() > most_dense) {
    impl_->FindRows(some);
    return;
  }
  for (const BodyStates& states : some) {
    const Impl::Here here = impl_->Place(states);
    const double least = kLost * here.sigma.maxCoeff();
    impl_->rank = std::max<Eigen::Index>(impl_->rank, (here.sigma.array() > least).count());
  }
  for (const BodyStates& states : some) {
    const Distance forward = impl_->Least(impl_->driven, states, impl_->Place(states));
    impl_->holds = impl_->holds || forward.value > kLost;
  }
}
SingularityMeter::~SingularityMeter() = default;

double SingularityMeter::length() const { return impl_->length; }

std::vector<SingularityMeter::Distance> SingularityMeter::At(const BodyStates& states) const {
  std::vector<Distance> distances(kKinds);
  if (impl_->tree.dofs() == 0) return distances;
  if (!impl_->held_rows.empty()) {
    if (auto sparse = impl_->SparseAt(states)) return *std::move(sparse);
  }
  const Impl::Here here = impl_->Place(states);
  distances[0] = impl_->Least(impl_->asked, states, here);
  if (impl_->holds) distances[1] = impl_->Least(impl_->driven, states, here);
  if (impl_->rank > 0) {
    const Eigen::Index k = impl_->tree.dofs() - impl_->rank;
    distances[2] = {here.sigma[k], impl_->Body(here, here.V.col(k))};
  }
  return distances;
}

namespace {

double Median(std::vector<double> values) {
  if (values.empty()) return kNan;
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

// What the drives' forces do there.
void AddForces(const Mechanism& mechanism, const Motion& motion, const Trace& trace,
               SingularApproach* approach) {
  double most = 0.0;
  const double window = std::max(kNearby * motion.duration_s, 1.5 * motion.sample_s);
  std::vector<double> medians(mechanism.drives.size(), kNan), near(medians);
  for (size_t d = 0; d < mechanism.drives.size(); ++d) {
    const int column = trace.Find(Quantity::kForce, mechanism.drives[d].name);
    if (column < 0) continue;
    std::vector<double> all;
    for (size_t i = 0; i < trace.time_s.size(); ++i) {
      const double force = std::abs(trace.values(static_cast<Eigen::Index>(i), column));
      if (!std::isfinite(force)) continue;
      all.push_back(force);
      if (std::abs(trace.time_s[i] - approach->time_s) > window) continue;
      if (!(near[d] >= force)) near[d] = force;
    }
    medians[d] = Median(std::move(all));
  }
  double largest = 0.0;
  for (const double median : medians)
    largest = std::max(largest, std::isnan(median) ? 0.0 : median);
  for (size_t d = 0; d < mechanism.drives.size(); ++d) {
    if (!(medians[d] > kNoForce * largest) || !(near[d] / medians[d] > most)) continue;
    most = near[d] / medians[d];
    approach->drive = mechanism.drives[d].name;
    approach->unit = ForceUnit(mechanism, mechanism.drives[d]);
    approach->force_near = near[d];
    approach->force_median = medians[d];
  }
}

}  // namespace

SingularApproaches ApproachesOf(const Mechanism& mechanism, const Motion& motion,
                                const std::vector<double>& time_s,
                                const std::vector<std::vector<Pose>>& X_WB, const Trace* forces) {
  SingularApproaches result;
  // A simulation that broke down has no more poses.
  size_t samples = 0;
  const auto good = [&](const std::vector<Pose>& poses) {
    return poses.size() == mechanism.bodies.size() &&
           std::ranges::all_of(poses, [](const Pose& X) { return X.matrix().allFinite(); });
  };
  while (samples < std::min(time_s.size(), X_WB.size()) && good(X_WB[samples])) ++samples;
  if (samples == 0 || mechanism.bodies.size() < 2) return result;
  const std::vector<Command> asked = WhatIsAsked(mechanism, motion);
  for (const Command& command : asked) result.inverse_of.push_back(command.name);
  const bool of_drives = OfDrives(motion.commands);
  const SingularityMeter meter(mechanism, asked, {X_WB.begin(), X_WB.begin() + samples});
  result.length_m = meter.length();

  // How many turns couplings count follows from sample to sample.
  std::vector<std::vector<double>> turns(mechanism.couplings.empty() ? 0 : samples);
  BodyStates states = StatesAt(mechanism.X_WB_home);
  for (size_t i = 0; i < turns.size(); ++i) {
    states.X_WB = X_WB[i];
    FollowCouplings(mechanism, &states);
    turns[i] = states.coupled;
  }
  std::vector<std::vector<SingularityMeter::Distance>> at(samples);
  const auto measure = [&](size_t i) {
    if (!at[i].empty()) return;
    states.X_WB = X_WB[i];
    if (!turns.empty()) states.coupled = turns[i];
    at[i] = meter.At(states);
    ++result.poses;
  };
  const size_t stride = 1 + (samples - 1) / kCoarse;
  std::vector<size_t> coarse;
  for (size_t i = 0; i < samples; i += stride) coarse.push_back(i);
  if (coarse.back() != samples - 1) coarse.push_back(samples - 1);
  for (const size_t i : coarse) measure(i);
  for (size_t kind = 0; kind < kKinds; ++kind) {
    std::vector<double> values;
    std::vector<std::pair<double, size_t>> minima;
    for (size_t k = 0; k < coarse.size(); ++k) {
      const double value = at[coarse[k]][kind].value;
      if (std::isnan(value)) continue;
      values.push_back(value);
      const bool below = k == 0 || !(at[coarse[k - 1]][kind].value < value);
      if (below && (k + 1 == coarse.size() || !(at[coarse[k + 1]][kind].value < value))) {
        minima.emplace_back(value, k);
      }
    }
    if (values.empty()) continue;
    std::ranges::sort(minima);
    if (minima.size() > kMostMinima) minima.resize(kMostMinima);
    for (const auto& [value, k] : minima) {
      const size_t from = coarse[k == 0 ? 0 : k - 1];
      const size_t to = coarse[std::min(k + 1, coarse.size() - 1)];
      for (size_t i = from; i <= to; ++i) measure(i);
    }
    SingularApproach approach;
    approach.kind = static_cast<SingularityKind>(kind);
    approach.median = Median(std::move(values));
    approach.asked = !motion.free() && (approach.kind != SingularityKind::kInverse || !of_drives);
    for (size_t i = 0; i < samples; ++i) {
      if (at[i].empty() || at[i][kind].value >= approach.distance) continue;
      if (std::isnan(at[i][kind].value)) continue;
      approach.distance = at[i][kind].value;
      approach.time_s = time_s[i];
      const int body = at[i][kind].body;
      if (body > 0) approach.body = mechanism.bodies[static_cast<size_t>(body)].name;
    }
    if (forces != nullptr) AddForces(mechanism, motion, *forces, &approach);
    result.of.push_back(std::move(approach));
  }
  return result;
}

}  // namespace mbv
