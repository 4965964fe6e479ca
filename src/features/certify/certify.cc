#include "features/certify/certify.h"

#include <fmt/format.h>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <tuple>
#include <utility>

#include "base/roles.h"
#include "features/certify/exact_model.h"
#include "features/certify/exact_numbers.h"
#include "math/ridders.h"
#include "mechanism/channels.h"
#include "mechanism/reach.h"
#include "reference/reference.h"

namespace mbv {
namespace {

namespace mp = boost::multiprecision;
using exact::Equation;
using exact::Frame;
using exact::Model;
using exact::Series;
using exact::Six;
using exact::Wrench;

constexpr double kInfinity = std::numeric_limits<double>::infinity();

// A dual number is what it is.
double Below(const exact::Dual& x) { return x.x; }
double Above(const exact::Dual& x) { return x.x; }
double Nearest(const exact::Dual& x) { return x.x; }
exact::Dual Middle(const exact::Dual& x) { return x; }
exact::Dual Around(const exact::Dual& middle, double /*radius*/) { return middle; }
exact::Dual Hull(const exact::Dual& x, const exact::Dual& /*y*/) { return x; }
template <typename T>
T Hull(const T& x, const T& y) {
  return mp::hull(x, y);
}
template <typename T>
constexpr bool kIsDual = std::is_same_v<T, exact::Dual>;
// The part that depends on what was varied.
double Slope(const exact::Dual& x) { return x.d; }
template <typename T>
double Slope(const T& /*x*/) {
  return 0.0;
}
// Slopes follow values one correction later; each takes their errors to round-off.
constexpr int kDualPasses = 4;

// Doubles that bound what intervals hold.
template <typename T>
double Below(const T& x) {
  return std::nextafter(mp::lower(x).template convert_to<double>(), -kInfinity);
}
template <typename T>
double Above(const T& x) {
  return std::nextafter(mp::upper(x).template convert_to<double>(), kInfinity);
}
template <typename T>
double Size(const T& x) {
  return std::max(-Below(x), Above(x));
}
// |x|, at least.
template <typename T>
double AtLeast(const T& x) {
  return std::max({0.0, Below(x), -Above(x)});
}
template <typename T>
T Middle(const T& x) {
  return T(mp::median(x));
}
template <typename T>
double Nearest(const T& x) {
  return mp::median(x).template convert_to<double>();
}
template <typename T>
T Around(const T& middle, double radius) {
  const T r(radius);
  return mp::hull(T(middle - r), T(middle + r));
}

// A sum of n products of positive doubles is computed with less than this relative error.
double Slack(Eigen::Index n) { return 1.0 + 4.0 * static_cast<double>(n + 4) * kEps; }

// Square systems, scaled by powers of two.
template <typename T>
class ProvedSystem {
 public:
  struct Entry {
    int column;
    T value;
  };

  ProvedSystem(std::vector<double> row_scale, std::vector<double> column_scale)
      : row_scale_(std::move(row_scale)), column_scale_(std::move(column_scale)) {}

  void Set(std::vector<std::vector<Entry>> rows) { rows_ = std::move(rows); }

  // An approximate inverse; false where there is none.
  bool Invert() {
    const MatX middle = Scaled(nullptr);
    const Eigen::PartialPivLU<MatX> lu(middle);
    if (middle.size() == 0) return true;
    inverse_ = lu.inverse();
    inverse_size_ = inverse_.cwiseAbs();
    return inverse_.allFinite();
  }
  // ‖1 − R A‖ per row, at most.
  void Check() {
    const auto n = static_cast<Eigen::Index>(rows_.size());
    MatX radius;
    const MatX middle = Scaled(&radius);
    const MatX size = middle.cwiseAbs();
    MatX rest = (inverse_ * middle - MatX::Identity(n, n)).cwiseAbs();
    // Rounding of the product and of the difference.
    const double rounding = 2.0 * static_cast<double>(n + 2) * kEps;
    rest += inverse_size_ * (radius + rounding * size) * Slack(n);
    contraction_ = rest.rowwise().sum() * Slack(n);
    contraction_.array() += 4.0 * kEps;
  }
  [[nodiscard]] double contraction() const {
    return contraction_.size() == 0 ? 0.0 : contraction_.maxCoeff();
  }
  [[nodiscard]] bool regular() const { return contraction() < 1.0; }
  [[nodiscard]] double distance_low() const { return (1.0 - contraction()) / Norm() / Slack(2); }
  [[nodiscard]] double distance_high() const { return (1.0 + contraction()) / Norm() * Slack(2); }

  // |R x|, row by row, at most; scaled.
  [[nodiscard]] VecX Reached(const std::vector<T>& x) const {
    VecX size(static_cast<Eigen::Index>(x.size()));
    for (size_t i = 0; i < x.size(); ++i) {
      size[static_cast<Eigen::Index>(i)] = Size(x[i]) * row_scale_[i];
    }
    return inverse_size_ * size * Slack(size.size());
  }
  // Bounds of the error of a solution with this |R residual|; scaled.
  [[nodiscard]] VecX Errors(const VecX& reached) const {
    if (reached.size() == 0) return reached;
    const double share = reached.maxCoeff() / (1.0 - contraction()) * Slack(2);
    return (reached + contraction_ * share) * Slack(2);
  }
  // Takes R residual away from x.
  void Correct(const std::vector<T>& residual, std::vector<T>* x) const {
    VecX scaled(static_cast<Eigen::Index>(residual.size())), slope(scaled.size());
    for (size_t i = 0; i < residual.size(); ++i) {
      scaled[static_cast<Eigen::Index>(i)] = Nearest(residual[i]) * row_scale_[i];
      slope[static_cast<Eigen::Index>(i)] = Slope(residual[i]) * row_scale_[i];
    }
    const VecX step = inverse_ * scaled;
    for (size_t i = 0; i < x->size(); ++i) {
      (*x)[i] = Middle(T((*x)[i] - T(step[static_cast<Eigen::Index>(i)] * column_scale_[i])));
    }
    if constexpr (kIsDual<T>) {
      const VecX slopes = inverse_ * slope;
      for (size_t i = 0; i < x->size(); ++i) {
        (*x)[i].d -= slopes[static_cast<Eigen::Index>(i)] * column_scale_[i];
      }
    }
  }
  [[nodiscard]] T Widened(const T& x, size_t i, double scaled_error) const {
    return Around(x, scaled_error * column_scale_[i]);
  }
  // Encloses A x = b.
  [[nodiscard]] std::vector<T> Solve(const std::vector<T>& b) const {
    std::vector<T> x(b.size(), T(0)), residual(b.size());
    VecX reached;
    double last = kInfinity;
    for (int k = 0;; ++k) {
      for (size_t i = 0; i < b.size(); ++i) {
        residual[i] = -b[i];
        for (const Entry& entry : rows_[i]) {
          residual[i] += entry.value * x[static_cast<size_t>(entry.column)];
        }
      }
      reached = Reached(residual);
      const double now = reached.size() == 0 ? 0.0 : reached.maxCoeff();
      const bool done =
          kIsDual<T> ? k == kDualPasses : !(now < 0.5 * last) || now == 0.0 || k == 12;
      if (done) break;
      last = now;
      Correct(residual, &x);
    }
    const VecX errors = Errors(reached);
    for (size_t i = 0; i < x.size(); ++i) {
      x[i] = Widened(x[i], i, errors[static_cast<Eigen::Index>(i)]);
    }
    return x;
  }

 private:
  [[nodiscard]] double Norm() const {
    return inverse_.size() == 0 ? 1.0 : inverse_size_.rowwise().sum().maxCoeff();
  }
  [[nodiscard]] MatX Scaled(MatX* radius) const {
    const auto n = static_cast<Eigen::Index>(rows_.size());
    MatX middle = MatX::Zero(n, n);
    if (radius != nullptr) *radius = MatX::Zero(n, n);
    for (size_t i = 0; i < rows_.size(); ++i) {
      for (const Entry& entry : rows_[i]) {
        const auto r = static_cast<Eigen::Index>(i);
        const double scale = row_scale_[i] * column_scale_[static_cast<size_t>(entry.column)];
        const double low = Below(entry.value), high = Above(entry.value), at = 0.5 * (low + high);
        middle(r, entry.column) = at * scale;
        if (radius == nullptr) continue;
        (*radius)(r, entry.column) =
            std::nextafter(std::max(high - at, at - low) * scale, kInfinity);
      }
    }
    return middle;
  }

  std::vector<double> row_scale_, column_scale_;
  std::vector<std::vector<Entry>> rows_;
  MatX inverse_, inverse_size_;
  VecX contraction_;
};

double PowerOfTwo(double x) { return std::exp2(std::round(std::log2(x))); }

// Indices of independent rows, groups in their order, within one by what is left of each; the
// others depend on them to 1e-9 of the group's largest row.
constexpr double kDependent = 1e-9;
class RowChoice {
 public:
  explicit RowChoice(Eigen::Index columns) : columns_(columns) {}

  // Rows of `group`; their numbers within it, increasing.
  std::vector<size_t> Choose(MatX group) {
    std::vector<size_t> chosen;
    VecX size = group.rowwise().norm();
    if (size.size() > 0) size.setConstant(size.maxCoeff());
    for (const VecX& q : basis_) group -= (group * q) * q.transpose();
    while (static_cast<Eigen::Index>(basis_.size()) < columns_ && group.rows() > 0) {
      Eigen::Index best = 0;
      VecX share(group.rows());
      for (Eigen::Index i = 0; i < group.rows(); ++i) {
        share[i] = size[i] > 0.0 ? group.row(i).norm() / size[i] : 0.0;
      }
      if (share.maxCoeff(&best) < kDependent) break;
      VecX q = group.row(best).transpose();
      for (const VecX& other : basis_) q -= other.dot(q) * other;
      q.normalize();
      group -= (group * q) * q.transpose();
      group.row(best).setZero();
      basis_.push_back(q);
      chosen.push_back(static_cast<size_t>(best));
    }
    std::sort(chosen.begin(), chosen.end());
    return chosen;
  }

 private:
  Eigen::Index columns_;
  std::vector<VecX> basis_;
};

// What the reference found, as a start.
struct Start {
  double time_s = 0.0;
  std::vector<Pose> X_WB;
  std::vector<double> coupled, turns;
  CommandSample command;
  /// What is varied, of dual numbers.
  int varied = -1;  ///< a command
  enum class Of { kPosition, kVelocity, kAcceleration } of = Of::kPosition;
};

template <typename T>
ProvedValue Proved(const std::string& channel, const std::string& unit, const T& x) {
  ProvedValue value{channel, unit, "", Nearest(x), kNan};
  const double radius = Size(T(x - Middle(x))), size = Size(x);
  int digits = 17;
  if (size > 0.0 && radius > 0.0) {
    digits = static_cast<int>(std::clamp(std::log10(size / radius) + 2.0, 1.0, 70.0));
  }
  value.text = mp::median(x).str(digits, std::ios_base::scientific);
  // Of the text as it stands.
  value.radius = Size(T(x - T(value.text.c_str())));
  return value;
}

// The words of SampleProof::why_not.
constexpr const char* kSingular =
    "not provable: the closure equations are singular here as far as can be seen";
constexpr const char* kForcesSingular =
    "not provable: the drives lose control here as far as can be seen";

template <typename T>
class Prover {
 public:
  /// `along_commands`: forces that act along the commands instead of those of drives.
  Prover(const Mechanism& mechanism, const Motion& motion, double contradiction,
         bool along_commands = false)
      : model_(mechanism),
        motion_(motion),
        contradiction_(contradiction),
        along_commands_(along_commands),
        length_(PowerOfTwo(CharacteristicLength(mechanism))) {}

  /// Whether reactions of what was proved are left open by statics.
  [[nodiscard]] bool reactions_open() const { return !columns_.empty() && !reactions_unique_; }
  /// Whether drives share their forces.
  [[nodiscard]] bool shared() const { return shared_; }

  /// Of dual numbers, with commands as coordinates: the force along each, or of each drive and
  /// prescribed joint, and joints · 6 of reactions; or why there are none.
  std::string Evaluate(const Start& start, std::vector<T>* forces, std::vector<T>* reactions) {
    SampleProof proof;
    model_.StartFrom(start.X_WB, &q_);
    MakeEquations(start);
    std::string trouble = Prove(start, &proof);
    if (trouble.empty() && shared_) trouble = "drives share their forces";
    if (!trouble.empty()) return trouble;
    std::vector<T> all(forces_.size(), T(0));
    for (size_t k = 0; k < columns_.size(); ++k) all[columns_[k]] = force_[k];
    const size_t acting = along_commands_ ? motion_.commands.size() : driven_.size();
    const auto first = all.begin() + static_cast<std::ptrdiff_t>(transmitting_);
    forces->assign(first, first + static_cast<std::ptrdiff_t>(acting));
    reactions->clear();
    const std::vector<Six<T>> on_child = ReactionsOf(carried_, all);
    for (size_t j = 0; j < on_child.size(); ++j) {
      const std::array<T, 6> parts = model_.InJoint(mechanism().joints[j], on_child[j], bodies_);
      reactions->insert(reactions->end(), parts.begin(), parts.end());
    }
    return "";
  }

  SampleProof Prove(const Start& start) {
    SampleProof proof;
    proof.time_s = start.time_s;
    proof.bits = std::is_same_v<T, exact::Fine> ? 113 : 240;
    model_.StartFrom(start.X_WB, &q_);
    MakeEquations(start);
    const bool chosen_before = !rows_.empty();
    proof.why_not = Prove(start, &proof);
    if (!proof.proved() && chosen_before) {
      // Equations that were independent at one pose may not be so at another one.
      rows_.clear(), columns_.clear();
      model_.StartFrom(start.X_WB, &q_);
      proof.left_open = 0.0;
      proof.why_not = Prove(start, &proof);
    }
    if (proof.proved()) Report(&proof);
    return proof;
  }

 private:
  using System = ProvedSystem<T>;
  using Rows = std::vector<std::vector<typename System::Entry>>;
  using Virtual = typename Model<T>::Virtual;

  const Mechanism& mechanism() const { return model_.mechanism(); }

  struct Asked {
    Equation<T> equation;
    T value = T(0), rate = T(0), acceleration = T(0);
  };

  std::string Prove(const Start& start, SampleProof* proof) {
    std::string trouble = ChooseRows();
    if (trouble.empty()) trouble = FindPose(proof);
    if (!trouble.empty()) return trouble;
    if (trouble = FindRates(); !trouble.empty()) return trouble;
    return FindForces(start, proof);
  }

  void MakeEquations(const Start& start) {
    // What cut joints lock is the same for all samples, couplings count turns.
    if (asked_.empty() || !mechanism().couplings.empty()) {
      asked_.clear();
      for (Equation<T>& equation : model_.Closures(start.coupled)) {
        asked_.push_back({std::move(equation)});
      }
      closures_ = asked_.size();
    }
    asked_.resize(closures_);
    driven_.clear();
    const size_t drives = mechanism().drives.size(), elements = mechanism().elements.size();
    const auto turn = [&](size_t k) {
      return elements + k < start.turns.size() ? start.turns[elements + k] : 0.0;
    };
    for (size_t k = 0; k < motion_.commands.size(); ++k) {
      const Command& command = motion_.commands[k];
      const auto at = static_cast<Eigen::Index>(k);
      Asked asked;
      asked.value = T(start.command.position[at]);
      asked.rate = T(start.command.velocity[at]);
      asked.acceleration = T(start.command.acceleration[at]);
      if constexpr (kIsDual<T>) {
        if (start.varied == static_cast<int>(k)) {
          (start.of == Start::Of::kPosition   ? asked.value
           : start.of == Start::Of::kVelocity ? asked.rate
                                              : asked.acceleration)
              .d = 1.0;
        }
      }
      for (const Command::Term& term : command.terms) {
        const Coordinate& c = term.coordinate;
        const auto i = static_cast<size_t>(c.index);
        double near = c.kind == Coordinate::Kind::kDrive        ? turn(i)
                      : c.kind == Coordinate::Kind::kPrescribed ? turn(drives + i)
                                                                : HomeValue(mechanism(), c);
        if (command.terms.size() == 1) near = start.command.position[at] / term.factor;
        Equation<T> part = model_.CoordinateEquation(c, near);
        part.terms.front().polynomial.front() = T(term.factor);
        asked.equation.terms.push_back(std::move(part.terms.front()));
      }
      asked_.push_back(std::move(asked));
    }
    for (size_t s = 0; s < model_.spins().size(); ++s) {
      asked_.push_back({Model<T>::SpinEquation(static_cast<int>(s))});
    }
    for (size_t d = 0; d < drives; ++d) {
      driven_.push_back(
          model_.CoordinateEquation({Coordinate::Kind::kDrive, static_cast<int>(d), 0}, turn(d)));
    }
    for (size_t p = 0; p < mechanism().prescribed.size(); ++p) {
      driven_.push_back(model_.CoordinateEquation(
          {Coordinate::Kind::kPrescribed, static_cast<int>(p), 0}, turn(drives + p)));
    }
    element_equations_.clear();
    for (size_t e = 0; e < elements; ++e) {
      const ForceElement& element = mechanism().elements[e];
      const double near = e < start.turns.size() ? start.turns[e] : 0.0;
      // Of a ball's rotation the coordinates are not used.
      element_equations_.push_back(
          ActsOnBall(mechanism(), element) ? Equation<T>() : model_.ElementEquation(element, near));
    }
  }

  [[nodiscard]] double RowScale(const Equation<T>& equation) const {
    return equation.length() ? 1.0 / length_ : 1.0;
  }
  [[nodiscard]] double ColumnScale(size_t j) const {
    return model_.IsLengthCoordinate(static_cast<int>(j)) ? length_ : 1.0;
  }

  using Wrenches = std::vector<std::vector<Wrench<T>>>;
  // Of all equations, of those in `rows` alone.
  [[nodiscard]] Wrenches WrenchesOf(const std::vector<size_t>& rows,
                                    const typename Model<T>::Poses& bodies) const {
    Wrenches wrenches(asked_.size());
    typename Model<T>::Seeds seeds;
    for (const size_t i : rows) {
      wrenches[i] = model_.WrenchesAt(asked_[i].equation, bodies, &seeds);
    }
    return wrenches;
  }
  // Rows of equations by the tree's coordinates. `turned`: poses for which, of spins, also the
  // derivative of their turn counts; null: none.
  [[nodiscard]] Rows Jacobian(const std::vector<size_t>& rows, const std::vector<Virtual>& motions,
                              const Wrenches& wrenches,
                              const typename Model<T>::Poses* turned) const {
    Rows J(rows.size());
    for (size_t i = 0; i < rows.size(); ++i) {
      const Equation<T>& equation = asked_[rows[i]].equation;
      const std::vector<Wrench<T>>& exerted = wrenches[rows[i]];
      std::vector<Wrench<T>> turn;
      if (turned != nullptr && equation.spin >= 0) {
        turn = {model_.SpinTurnWrench(equation.spin, *turned)};
      }
      for (size_t j = 0; j < static_cast<size_t>(model_.coordinates()); ++j) {
        if (!Moves(motions[j], exerted)) continue;
        T slope = model_.Along(motions[j], exerted);
        if (!turn.empty()) slope = Hull(slope, model_.Along(motions[j], turn));
        J[i].push_back({static_cast<int>(j), std::move(slope)});
      }
    }
    return J;
  }
  [[nodiscard]] bool Moves(const Virtual& motion, const std::vector<Wrench<T>>& wrenches) const {
    return std::any_of(wrenches.begin(), wrenches.end(), [&](const Wrench<T>& wrench) {
      return model_.IsBeyond(wrench.child, motion.body) !=
             model_.IsBeyond(wrench.parent, motion.body);
    });
  }
  static MatX Approximate(const Rows& rows, Eigen::Index columns) {
    MatX A = MatX::Zero(static_cast<Eigen::Index>(rows.size()), columns);
    for (size_t i = 0; i < rows.size(); ++i) {
      for (const auto& entry : rows[i]) {
        A(static_cast<Eigen::Index>(i), entry.column) = Nearest(entry.value);
      }
    }
    return A;
  }

  // The equations that determine the pose, once for the motion.
  std::string ChooseRows() {
    if (!rows_.empty() || model_.coordinates() == 0) return "";
    std::vector<size_t> all(asked_.size());
    for (size_t i = 0; i < all.size(); ++i) all[i] = i;
    const auto columns = static_cast<Eigen::Index>(model_.coordinates());
    const typename Model<T>::Poses bodies = model_.PosesAt(q_);
    MatX J = Approximate(
        Jacobian(all, model_.VirtualAt(q_, bodies, false), WrenchesOf(all, bodies), nullptr),
        columns);
    for (size_t i = 0; i < all.size(); ++i) {
      J.row(static_cast<Eigen::Index>(i)) *= RowScale(asked_[i].equation);
    }
    for (Eigen::Index j = 0; j < columns; ++j) J.col(j) *= ColumnScale(static_cast<size_t>(j));
    RowChoice choice(columns);
    const auto split = static_cast<Eigen::Index>(closures_);
    std::vector<size_t> rows = choice.Choose(J.topRows(split));
    for (const size_t k : choice.Choose(J.bottomRows(J.rows() - split))) {
      rows.push_back(closures_ + k);
    }
    if (rows.size() != static_cast<size_t>(columns)) return kSingular;
    rows_ = std::move(rows);
    return "";
  }

  // (1)
  std::string FindPose(SampleProof* proof) {
    const size_t n = rows_.size();
    std::vector<double> row_scale, column_scale;
    for (size_t i = 0; i < n; ++i) {
      row_scale.push_back(RowScale(asked_[rows_[i]].equation));
      column_scale.push_back(ColumnScale(i));
    }
    system_.emplace(row_scale, column_scale);
    // The box lies around the start, which is within a small share of its radius of the solution.
    const std::vector<T> start = q_;
    VecX reached;
    bool proved = false;
    for (const double radius : {1e-6, 1e-8, 1e-10, 1e-12}) {
      std::vector<T> box = start;
      for (size_t j = 0; j < n; ++j) box[j] = system_->Widened(start[j], j, radius);
      const typename Model<T>::Poses bodies = model_.PosesAt(box);
      system_->Set(Jacobian(rows_, model_.VirtualAt(box, bodies, false), WrenchesOf(rows_, bodies),
                            &bodies));
      if (!system_->Invert()) return kSingular;
      system_->Check();
      if (!system_->regular()) continue;
      q_ = start;
      if (!Refine(&reached)) return kSingular;
      // What is left of the radius where the middle moved.
      proof->unique_within = radius - Moved(start) * Slack(2);
      const double step = reached.size() == 0 ? 0.0 : reached.maxCoeff();
      proved = step + system_->contraction() * proof->unique_within < proof->unique_within;
      if (proved) break;
    }
    if (!proved) return kSingular;
    const VecX errors = system_->Errors(reached);
    for (size_t j = 0; j < n; ++j) {
      q_[j] = system_->Widened(q_[j], j, errors[static_cast<Eigen::Index>(j)]);
    }
    bodies_ = model_.PosesAt(q_);
    const std::set<size_t> taken(rows_.begin(), rows_.end());
    for (size_t i = 0; i < asked_.size(); ++i) {
      if (taken.count(i) == 0) {
        const T open = model_.ValueAt(asked_[i].equation, bodies_) - asked_[i].value;
        proof->left_open = std::max(proof->left_open, Size(open));
      }
    }
    std::vector<size_t> needed = rows_;
    for (size_t k = 0; k < closures_; ++k) {
      if (taken.count(k) == 0) needed.push_back(k);
    }
    std::sort(needed.begin(), needed.end());
    wrenches_ = WrenchesOf(needed, bodies_);
    virtual_ = model_.VirtualAt(q_, bodies_, true);
    system_->Set(Jacobian(rows_, virtual_, wrenches_, nullptr));
    system_->Check();
    proof->closure_distance_low = system_->distance_low();
    proof->closure_distance_high = system_->distance_high();
    return system_->regular() ? "" : kSingular;
  }

  // Newton's method to the last digits but a few; |R residual| then.
  static constexpr double kEnough = kIsDual<T>                       ? 0.0
                                    : std::is_same_v<T, exact::Fine> ? 1e-31
                                                                     : 1e-69;
  bool Refine(VecX* reached) {
    double last = kInfinity;
    for (int k = 0;; ++k) {
      const std::vector<T> residual = Residuals(q_);
      *reached = system_->Reached(residual);
      const double now = reached->size() == 0 ? 0.0 : reached->maxCoeff();
      if (!std::isfinite(now)) return false;
      if (now < kEnough || !(now < 0.5 * last) || k == 20) break;
      last = now;
      system_->Correct(residual, &q_);
    }
    for (int k = 0; kIsDual<T> && k < kDualPasses; ++k) system_->Correct(Residuals(q_), &q_);
    return true;
  }
  // The largest scaled way from there.
  [[nodiscard]] double Moved(const std::vector<T>& start) const {
    double most = 0.0;
    for (size_t j = 0; j < q_.size(); ++j) {
      most = std::max(most, Size(T(q_[j] - start[j])) / ColumnScale(j));
    }
    return most;
  }

  [[nodiscard]] std::vector<T> Residuals(const std::vector<T>& q) const {
    const typename Model<T>::Poses bodies = model_.PosesAt(q);
    std::vector<T> residual;
    typename Model<T>::template Last<T> last;
    for (const size_t i : rows_) {
      residual.push_back(model_.ValueAt(asked_[i].equation, bodies, &last) - asked_[i].value);
    }
    return residual;
  }

  std::string FindRates() {
    std::vector<T> asked;
    for (const size_t i : rows_) asked.push_back(asked_[i].rate);
    const std::vector<T> rate = system_->Solve(asked);
    std::vector<Series<T>> q(q_.size());
    for (size_t j = 0; j < q_.size(); ++j) q[j] = Series<T>(q_[j], rate[j], T(0));
    motions_ = model_.MotionsAt(q);
    typename Model<T>::template Last<Series<T>> last;
    for (size_t k = 0; k < rows_.size(); ++k) {
      const Asked& of = asked_[rows_[k]];
      asked[k] = of.acceleration - (of.equation.spin >= 0
                                        ? model_.SpinAcceleration(of.equation.spin, motions_)
                                        : model_.ValueAt(of.equation, motions_, &last).a);
    }
    const std::vector<T> acceleration = system_->Solve(asked);
    model_.Accelerate(virtual_, acceleration, &motions_);
    return Contradiction(rate, acceleration);
  }

  // Equations that are not needed for the pose have to hold along the motion, too: at poses where
  // they touch what the others leave, they need not.
  [[nodiscard]] std::string Contradiction(const std::vector<T>& rate,
                                          const std::vector<T>& acceleration) const {
    double speed = 0.0, most = 0.0;
    for (size_t j = 0; j < rate.size(); ++j) {
      speed = std::max(speed, Size(rate[j]) / ColumnScale(j));
      most = std::max(most, Size(acceleration[j]) / ColumnScale(j));
    }
    for (const Asked& of : asked_) speed = std::max(speed, Size(of.rate) * RowScale(of.equation));
    const std::set<size_t> taken(rows_.begin(), rows_.end());
    for (size_t i = 0; i < asked_.size(); ++i) {
      const Asked& of = asked_[i];
      if (taken.count(i) > 0 || of.equation.spin >= 0) continue;
      const Series<T> x = model_.ValueAt(of.equation, motions_);
      const double scale = RowScale(of.equation);
      if (AtLeast(T(x.r - of.rate)) * scale > contradiction_ * speed ||
          AtLeast(T(x.a - of.acceleration)) * scale > contradiction_ * (most + speed * speed)) {
        return "not provable: the equations that determine the pose contradict others along the "
               "motion";
      }
    }
    return "";
  }

  // (2) of exact_model.h.
  std::string FindForces(const Start& start, SampleProof* proof) {
    carried_ = model_.Required(motions_);
    loaded_.clear();
    std::string trouble = Apply(start);
    if (!trouble.empty()) return trouble;
    const std::vector<Virtual>& motions = virtual_;
    MakeColumns();
    const size_t n = motions.size();
    if (columns_.empty() && n > 0) {
      if (trouble = ChooseColumns(motions); !trouble.empty()) return trouble;
    }
    std::vector<double> row_scale, column_scale;
    for (size_t j = 0; j < n; ++j) {
      // A motion of length 1 does work by forces, one of an angle by moments.
      row_scale.push_back(IsSlide(j) ? 1.0 : 1.0 / length_);
    }
    for (const size_t k : columns_) column_scale.push_back(forces_[k].length ? 1.0 : length_);
    Rows A(n);
    std::map<int, Six<T>> beyond;
    std::vector<T> work(n);
    for (size_t j = 0; j < n; ++j) {
      const int body = motions[j].body;
      if (beyond.count(body) == 0) beyond[body] = model_.SumBeyond(body, carried_);
      work[j] = Dot(motions[j].twist, beyond[body]);
      for (size_t k = 0; k < columns_.size(); ++k) {
        const std::vector<Wrench<T>>& wrenches = forces_[columns_[k]].wrenches;
        if (!Moves(motions[j], wrenches)) continue;
        A[j].push_back({static_cast<int>(k), model_.Along(motions[j], wrenches)});
      }
    }
    if (shared_) Share(&A, &work, &row_scale, &column_scale);
    System system(row_scale, column_scale);
    system.Set(std::move(A));
    if (!system.Invert()) return kForcesSingular;
    system.Check();
    if (!system.regular()) return kForcesSingular;
    proof->force_distance_low = system.distance_low();
    proof->force_distance_high = system.distance_high();
    force_ = system.Solve(work);
    force_.resize(columns_.size());
    return loaded_.empty() ? "" : AddLoadFriction(system, motions);
  }

  using Bearings = std::array<exact::Vector<T>, 3>;
  // Friction F_d = −s_d c_d |n_d| + ε_d n_d by the loads n_e of bearings, (1) of FrictionLaw, c:
  // PerLoad(), or by the forces n_e of couplings. Forces depend on it linearly, so that with p_e
  // the load without it and P_ed of a unit force,
  //   n_e = |p_e + Σ_d F_d P_ed| =: g_e(n), |p|: the sum of the lengths of its parts, or p itself
  // which contracts by q = max_e Σ_d |P_ed| (c_d + |ε_d|): |n − ñ| ≤ |g(ñ) − ñ| / (1 − q) where
  // q < 1.
  struct Loaded {
    size_t element = 0;
    T slope, skew;  ///< F_d = slope |n_d| + skew n_d
    bool is_signed = false;
    std::vector<Wrench<T>> wrenches;

    [[nodiscard]] T Force(const T& n) const {
      return is_signed ? T(slope * abs(n) + skew * n) : T(slope * n);
    }
    [[nodiscard]] T Load(const Bearings& of) const { return is_signed ? of[2][0] : Norm(of); }
  };
  static double LargestRadius(const FrictionLaw& law) {
    return law.coupling >= 0 ? 1.0 : std::max(law.radius, law.thrust_radius);
  }
  static T PerLoad(const FrictionLaw& law) { return T(law.coefficient) * T(LargestRadius(law)); }
  std::string AddLoadFriction(const System& system, const std::vector<Virtual>& motions) {
    if (!reactions_unique_) {
      return "not provable: redundant constraints share the load of a joint with friction by load";
    }
    const size_t n = loaded_.size();
    std::vector<std::vector<T>> response(n);
    std::vector<std::vector<Six<T>>> exerted(n);
    std::vector<Bearings> p(n);
    std::vector<std::vector<Bearings>> P(n, std::vector<Bearings>(n));
    for (size_t e = 0; e < n; ++e) p[e] = BearingsOf(loaded_[e].element, carried_, force_);
    for (size_t d = 0; d < n; ++d) {
      std::vector<T> work;
      work.reserve(motions.size());
      for (const Virtual& motion : motions) {
        work.push_back(-model_.Along(motion, loaded_[d].wrenches));
      }
      response[d] = system.Solve(work);
      exerted[d].resize(carried_.size());
      Exert(T(1), loaded_[d].wrenches, &exerted[d]);
      for (size_t e = 0; e < n; ++e) {
        P[e][d] = BearingsOf(loaded_[e].element, exerted[d], response[d]);
      }
    }
    double contraction = 0.0;
    for (size_t e = 0; e < n; ++e) {
      T sum(0);
      for (size_t d = 0; d < n; ++d) {
        sum += Norm(P[e][d]) * (abs(loaded_[d].slope) + abs(loaded_[d].skew));
      }
      contraction = std::max(contraction, Size(sum));
    }
    if (!(contraction < 1.0)) return "not provable: friction and loads raise each other";
    const auto loads = [&](const std::vector<T>& of) {
      std::vector<T> next(n);
      for (size_t e = 0; e < n; ++e) {
        Bearings sum = p[e];
        for (size_t d = 0; d < n; ++d) {
          for (size_t k = 0; k < sum.size(); ++k) {
            sum[k] = sum[k] + exact::Times(loaded_[d].Force(of[d]), P[e][d][k]);
          }
        }
        next[e] = loaded_[e].Load(sum);
      }
      return next;
    };
    std::vector<T> load(n, T(0)), next;
    double step = kInfinity;
    // Slopes take the same number of passes again.
    const double passes = contraction > 0.0 ? 2.0 * std::log(kEps) / std::log(contraction) : 2.0;
    for (int k = 0; k < 1000; ++k) {
      next = loads(load);
      double now = 0.0;
      for (size_t e = 0; e < n; ++e) now = std::max(now, Size(T(next[e] - load[e])));
      if (kIsDual<T> ? k > passes : !(now < step)) break;
      step = now;
      for (size_t e = 0; e < n; ++e) load[e] = Middle(next[e]);
    }
    next = loads(load);
    step = 0.0;
    for (size_t e = 0; e < n; ++e) step = std::max(step, Size(T(next[e] - load[e])));
    for (size_t d = 0; d < n; ++d) {
      const T force = loaded_[d].Force(Around(load[d], step / (1.0 - contraction) * Slack(4)));
      for (size_t k = 0; k < force_.size(); ++k) force_[k] += force * response[d][k];
      Exert(force, loaded_[d].wrenches);
    }
    return "";
  }
  // λ dP/dq along the element's coordinate of the coupling whose force it follows; couplings are
  // the last of what transmits.
  [[nodiscard]] T CouplingForce(size_t e, const std::vector<T>& forces) const {
    const ForceElement& element = mechanism().elements[e];
    const auto c = static_cast<size_t>(std::get<FrictionLaw>(element.law).coupling);
    const T q = model_.ValueAt(element_equations_[e], bodies_);
    T slope(0);
    for (const Coupling::Term& term : mechanism().couplings[c].terms) {
      if (term.joint != element.joint || term.coordinate != element.coordinate) continue;
      for (size_t i = term.polynomial.size(); i-- > 0;) {
        slope = slope * q + T(static_cast<double>(i + 1)) * T(term.polynomial[i]);
      }
    }
    return slope * forces[transmitting_ - mechanism().couplings.size() + c];
  }

  static Bearings Nothing() {
    const exact::Vector<T> none{{T(0), T(0), T(0)}};
    return {none, none, none};
  }
  // Parts that are zero by how the joint is made have no slope.
  static T Norm(const Bearings& load) {
    T sum(0);
    for (const exact::Vector<T>& part : load) {
      const T square = Dot(part, part);
      if (!exact::IsZero(square)) sum += sqrt(square);
    }
    return sum;
  }
  // Of what a joint bears, in its frame, where bodies have to be carried so and the chosen forces
  // are these.
  [[nodiscard]] Bearings BearingsOf(size_t e, const std::vector<Six<T>>& carried,
                                    const std::vector<T>& forces) const {
    std::vector<T> all(forces_.size(), T(0));
    for (size_t k = 0; k < columns_.size(); ++k) all[columns_[k]] = forces[k];
    const ForceElement& element = mechanism().elements[e];
    const auto& law = std::get<FrictionLaw>(element.law);
    if (law.coupling >= 0) {
      Bearings force = Nothing();
      force[2][0] = CouplingForce(e, all);
      return force;
    }
    const auto j = static_cast<size_t>(element.joint);
    const Joint& joint = mechanism().joints[j];
    const std::array<T, 6> bears = model_.InJoint(joint, ReactionsOf(carried, all)[j], bodies_);
    const exact::Vector<T> f{{bears[0], bears[1], bears[2]}}, m{{bears[3], bears[4], bears[5]}};
    const T largest(LargestRadius(law)), radial = T(law.radius) / largest;
    Bearings load = Nothing();
    if (IsOfBall(joint.kind, element.coordinate)) {
      load[0] = exact::Times(radial, f);
      return load;
    }
    const exact::Vector<T> axis = model_.AxisInJoint(joint, element.coordinate, bodies_);
    const T thrust = Dot(axis, f);
    const exact::Vector<T> across = f - exact::Times(thrust, axis);
    load[0] = exact::Times(radial, across);
    load[2][0] = T(law.thrust_radius) / largest * thrust;
    if (std::isfinite(law.length)) {
      const exact::Vector<T> half = exact::Times(T(radial / T(2)), across);
      const exact::Vector<T> couple = exact::Times(T(radial / T(law.length)), Cross(m, axis));
      load[0] = half + couple;
      load[1] = half - couple;
    }
    return load;
  }

  // More drives than are needed: of all forces x that A x = b allows, those of drives and
  // prescribed joints of least norm, moments divided by the characteristic length. With multipliers
  // μ,
  //   A x = b,  W x − Aᵀ μ = 0,  W: 1 (1/L² of moments) of what counts, 0 of what does not
  void Share(Rows* A, std::vector<T>* work, std::vector<double>* row_scale,
             std::vector<double>* column_scale) const {
    const size_t n = A->size(), forces = columns_.size();
    const T L(CharacteristicLength(mechanism()));
    Rows stationary(forces);
    for (size_t k = 0; k < forces; ++k) {
      const Force& force = forces_[columns_[k]];
      if (columns_[k] < transmitting_ || columns_[k] >= transmitting_ + driven_.size()) continue;
      stationary[k].push_back({static_cast<int>(k), force.length ? T(1) : T(1 / (L * L))});
    }
    for (size_t j = 0; j < n; ++j) {
      for (const auto& entry : (*A)[j]) {
        stationary[static_cast<size_t>(entry.column)].push_back(
            {static_cast<int>(forces + j), T(-entry.value)});
      }
    }
    A->insert(A->end(), stationary.begin(), stationary.end());
    work->resize(n + forces, T(0));
    for (size_t k = 0; k < forces; ++k) row_scale->push_back((*column_scale)[k]);
    for (size_t j = 0; j < n; ++j) column_scale->push_back((*row_scale)[j]);
  }

  [[nodiscard]] bool IsSlide(size_t virtual_motion) const {
    return virtual_motion < static_cast<size_t>(model_.coordinates()) &&
           model_.IsLengthCoordinate(static_cast<int>(virtual_motion));
  }

  // What may act: closures, drives and prescribed joints, moments about idle spins.
  struct Force {
    std::vector<Wrench<T>> wrenches;
    bool length = true;
  };
  void MakeColumns() {
    forces_.clear();
    const std::vector<bool> transmitting = model_.Transmitting();
    const auto add = [&](const Equation<T>& equation) {
      forces_.push_back({model_.WrenchesAt(equation, bodies_), equation.length()});
    };
    for (size_t k = 0; k < closures_; ++k) {
      if (transmitting[k]) forces_.push_back({wrenches_[k], asked_[k].equation.length()});
    }
    transmitting_ = forces_.size();
    if (along_commands_) {
      for (size_t k = 0; k < motion_.commands.size(); ++k) add(asked_[closures_ + k].equation);
    } else {
      for (const Equation<T>& equation : driven_) add(equation);
    }
    for (size_t s = 0; s < model_.spins().size(); ++s) {
      add(Model<T>::SpinEquation(static_cast<int>(s)));
    }
  }

  std::string ChooseColumns(const std::vector<Virtual>& motions) {
    const auto n = static_cast<Eigen::Index>(motions.size());
    MatX A = MatX::Zero(static_cast<Eigen::Index>(forces_.size()), n);
    for (size_t k = 0; k < forces_.size(); ++k) {
      for (size_t j = 0; j < motions.size(); ++j) {
        A(static_cast<Eigen::Index>(k), static_cast<Eigen::Index>(j)) =
            Nearest(model_.Along(motions[j], forces_[k].wrenches)) *
            (forces_[k].length ? 1.0 : length_) * (IsSlide(j) ? 1.0 : 1.0 / length_);
      }
    }
    const auto split = static_cast<Eigen::Index>(transmitting_);
    RowChoice choice(n);
    std::vector<size_t> columns = choice.Choose(A.topRows(split));
    reactions_unique_ = columns.size() == transmitting_;
    const std::vector<size_t> needed = choice.Choose(A.bottomRows(A.rows() - split));
    if (static_cast<Eigen::Index>(columns.size() + needed.size()) != n) return kForcesSingular;
    // All drives act, also those that are more than are needed.
    for (size_t k = transmitting_; k < forces_.size(); ++k) columns.push_back(k);
    shared_ = columns.size() > static_cast<size_t>(n);
    if (shared_) reactions_unique_ = false;
    columns_ = std::move(columns);
    return "";
  }

  void Exert(const T& force, const std::vector<Wrench<T>>& wrenches) {
    Exert(force, wrenches, &carried_);
  }
  static void Exert(const T& force, const std::vector<Wrench<T>>& wrenches,
                    std::vector<Six<T>>* carried) {
    for (const Wrench<T>& wrench : wrenches) {
      const Six<T> part = Times(force, wrench.on_child);
      Six<T>&child = (*carried)[static_cast<size_t>(wrench.child)],
      &parent = (*carried)[static_cast<size_t>(wrench.parent)];
      child = child - part;
      parent = parent + part;
    }
  }

  // An expression is a function of doubles: what it gives at the doubles nearest to its inputs
  // counts as exact, and its slopes are extrapolated differences.
  [[nodiscard]] T Followed(const StateFunction& function, const Start& start) const {
    std::vector<double> inputs, slopes;
    for (const StateFunction::Input& input : function.inputs) {
      const auto i = static_cast<size_t>(input.coordinate.index);
      const size_t drives = mechanism().drives.size();
      const bool drive = input.coordinate.kind == Coordinate::Kind::kDrive;
      const bool driven = drive || input.coordinate.kind == Coordinate::Kind::kPrescribed;
      const size_t turn = mechanism().elements.size() + (drive ? i : drives + i);
      const double near = driven && turn < start.turns.size() ? start.turns[turn] : input.near;
      const Series<T> x =
          model_.ValueAt(model_.CoordinateEquation(input.coordinate, near), motions_);
      inputs.push_back(Nearest(input.rate ? x.r : x.v));
      slopes.push_back(Slope(input.rate ? x.r : x.v));
    }
    T value(function.value(start.time_s, inputs));
    const int branch = function.branch ? function.branch(start.time_s, inputs) : kAnyBranch;
    for (size_t k = 0; k < inputs.size(); ++k) {
      if constexpr (kIsDual<T>) {
        if (slopes[k] == 0.0) continue;
        const double at = inputs[k];
        const bool length = IsLength(mechanism(), function.inputs[k].coordinate);
        value.d += slopes[k] * SlopeAt(
                                   [&](double x) {
                                     inputs[k] = x;
                                     return function.At(start.time_s, inputs, branch);
                                   },
                                   at, 0.1 * (length ? length_ : 1.0));
        inputs[k] = at;
      }
    }
    return value;
  }

  // Loads, springs and elements; gravity's compensation that drives exert.
  std::string Apply(const Start& start) {
    engaged_ = start.command.engaged;
    for (size_t b = 0; b < start.command.carried.size(); ++b) {
      carried_[b] = Times(T(start.command.carried[b]), carried_[b]);
    }
    for (const LoadSample& load : start.command.loads) {
      const auto b = static_cast<size_t>(load.body);
      exact::Vector<T> f = exact::Lifted<T>(load.force), m = exact::Lifted<T>(load.moment);
      if (load.load != nullptr) {
        for (const Load::Following& part : load.load->following) {
          const auto c = static_cast<size_t>(part.component);
          T& component = c < 3 ? f[c] : m[c - 3];
          component += Followed(part.function, start);
        }
      }
      if (load.in_body_axes) f = bodies_[b].R * f, m = bodies_[b].R * m;
      const exact::Vector<T> at = bodies_[b].p + bodies_[b].R * exact::Lifted<T>(load.p_BoQ_B);
      carried_[b] = carried_[b] - Six<T>{m + Cross(at, f), f};
    }
    for (const SpringDamper& spring : mechanism().springs) {
      const Equation<T> length = model_.LengthEquation(spring);
      const Series<T> x = model_.ValueAt(length, motions_);
      const T thrust =
          -T(spring.stiffness) * (x.v - T(spring.free_length_m)) - T(spring.damping) * x.r;
      Exert(thrust, model_.WrenchesAt(length, bodies_));
    }
    for (size_t d = 0; d < mechanism().drives.size(); ++d) {
      const Drive& drive = mechanism().drives[d];
      if (!drive.compensates_gravity) continue;
      Exert(T(-model_.CompensationAlong(drive, bodies_)), model_.WrenchesAt(driven_[d], bodies_));
    }
    for (size_t e = 0; e < mechanism().elements.size(); ++e) {
      const std::string trouble = ApplyElement(e);
      if (!trouble.empty()) return trouble;
    }
    return "";
  }

  // Of a stop, where it is known which of its pieces acts; false where that is open.
  static bool PushOf(const StopLaw& law, const Series<T>& x, T* force) {
    using std::exp;
    using std::log;
    const bool above = Below(x.v) > law.upper, below = Above(x.v) < law.lower;
    if (!above && !below) return Above(x.v) <= law.upper && Below(x.v) >= law.lower;
    const T depth = above ? T(x.v - T(law.upper)) : T(T(law.lower) - x.v);
    const T rate = above ? x.r : T(-x.r), side = T(above ? -1.0 : 1.0);
    T e = T(law.stiffness) * depth;
    if (law.exponent != 1.0) e = T(law.stiffness) * exp(T(T(law.exponent) * log(depth)));
    const bool by_depth = law.dissipation > 0.0;
    const T damped = by_depth ? T(e * T(law.dissipation) * rate) : T(T(law.damping) * rate);
    const T least = e + damped, most = e - damped;  // without force, with twice the elastic one
    if (Above(least) < 0.0) return true;
    if (!(Below(least) >= 0.0)) return false;
    if (!by_depth && Above(most) < 0.0) {
      *force = side * (e + e);
      return true;
    }
    *force = side * least;
    return by_depth || Below(most) >= 0.0;
  }

  // On a curve, by Bernstein's polynomials between knots.
  static bool ForceOnCurve(const CurveLaw& law, const T& x, T* force) {
    const std::vector<CurveLaw::Knot>& knots = law.knots;
    size_t k = 0;
    while (k < knots.size() && Below(x) >= knots[k].at) ++k;
    if (k < knots.size() && Above(x) > knots[k].at) return false;
    if (k == 0 || k == knots.size()) {
      const CurveLaw::Knot& end = k == 0 ? knots.front() : knots.back();
      *force = T(end.force) + T(k == 0 ? end.slope_before : end.slope_after) * (x - T(end.at));
      return true;
    }
    const CurveLaw::Knot &a = knots[k - 1], &b = knots[k];
    const T h = T(b.at) - T(a.at), t = (x - T(a.at)) / h, s = T(1) - t, third = h / T(3);
    const T b1 = T(a.force) + third * T(a.slope_after);
    const T b2 = T(b.force) - third * T(b.slope_before);
    *force = s * s * (s * T(a.force) + T(3) * t * b1) + t * t * (T(3) * s * b2 + t * T(b.force));
    return true;
  }

  static bool ForceOnCurves(const CurvesLaw& law, const Series<T>& x, T* force) {
    size_t i = 0;
    while (i < law.rates.size() && Below(x.r) >= law.rates[i]) ++i;
    if (i < law.rates.size() && Above(x.r) > law.rates[i]) return false;
    const size_t last = law.rates.size() - 1, up = std::clamp<size_t>(i, 1, last);
    T low(0), high(0);
    if (!ForceOnCurve(law.curves[up - 1], x.v, &low)) return false;
    if (!ForceOnCurve(law.curves[up], x.v, &high)) return false;
    const T t = (x.r - T(law.rates[up - 1])) / (T(law.rates[up]) - T(law.rates[up - 1]));
    *force = T(T(1) - t) * low + t * high;
    if (law.held && i == 0) *force = low;
    if (law.held && i > last) *force = high;
    return true;
  }

  // As Followed().
  static T ForceBy(const ExpressionLaw& law, const Series<T>& x, double unit) {
    const double q = Nearest(x.v), v = Nearest(x.r);
    const int branch = law.BranchAt(q, v);
    T force(law.force(q, v));
    if constexpr (kIsDual<T>) {
      const double reach = 0.1 * unit;
      force.d += Slope(x.v) * SlopeAt([&](double at) { return law.At(at, v, branch); }, q, reach) +
                 Slope(x.r) * SlopeAt([&](double at) { return law.At(q, at, branch); }, v, reach);
    }
    return force;
  }

  std::string ApplyElement(size_t e) {
    using std::exp;
    const ForceElement& element = mechanism().elements[e];
    Series<T> x;
    std::vector<Wrench<T>> wrenches;
    if (ActsOnBall(mechanism(), element)) {
      std::tie(x, wrenches) = model_.BallMotion(element, bodies_, motions_);
    } else {
      x = model_.ValueAt(element_equations_[e], motions_);
      wrenches = model_.WrenchesAt(element_equations_[e], bodies_);
    }
    T force(0);
    const T share(e < engaged_.size() ? engaged_[e] : 1.0);
    if (const auto* damping = std::get_if<DampingLaw>(&element.law)) {
      force = -T(damping->damping) * x.r;
    } else if (const auto* spring = std::get_if<SpringLaw>(&element.law)) {
      std::vector<T> polynomial(spring->polynomial.begin(), spring->polynomial.end());
      force = -(T(spring->preload) + exact::Polynomial(polynomial, T(x.v - T(spring->free))));
    } else if (const auto* rotor = std::get_if<RotorLaw>(&element.law)) {
      const T n(rotor->ratio), J(rotor->inertia);
      force = -J * n * n * x.a;
      if (rotor->carrier) {
        const auto [along, moment] = model_.OnCarrier(*rotor->carrier, x, motions_);
        force -= J * n * along;
        const auto b = static_cast<size_t>(rotor->carrier->body);
        carried_[b].m = carried_[b].m + exact::Times(T(J * n), moment);
      }
    } else if (const auto* stop = std::get_if<StopLaw>(&element.law)) {
      if (!PushOf(*stop, x, &force)) {
        return fmt::format("not provable: on which side of a corner '{}' is, is open",
                           element.name);
      }
    } else if (const auto* curve = std::get_if<CurveLaw>(&element.law)) {
      if (!ForceOnCurve(*curve, curve->of_rate ? x.r : x.v, &force)) {
        return fmt::format("not provable: on which side of a knot '{}' is, is open", element.name);
      }
      force = share * force;
    } else if (const auto* curves = std::get_if<CurvesLaw>(&element.law)) {
      if (!ForceOnCurves(*curves, x, &force)) {
        return fmt::format("not provable: on which side of a knot '{}' is, is open", element.name);
      }
      force = share * force;
    } else if (const auto* expression = std::get_if<ExpressionLaw>(&element.law)) {
      const int branch = expression->BranchAt(Below(x.v), Below(x.r));
      if (branch != expression->BranchAt(Above(x.v), Above(x.r)) ||
          branch != expression->BranchAt(Below(x.v), Above(x.r)) ||
          branch != expression->BranchAt(Above(x.v), Below(x.r))) {
        return fmt::format("not provable: on which branch '{}' is, is open", element.name);
      }
      const double unit = ActsOnLength(mechanism(), element) ? length_ : 1.0;
      force = share * ForceBy(*expression, x, unit);
    } else if (const auto* friction = std::get_if<FrictionLaw>(&element.law)) {
      const double rest = RestRate(mechanism(), element, motion_.duration_s);
      const double low = Below(x.r), high = Above(x.r);
      int sign = 0;
      if (low > rest) {
        sign = 1;
      } else if (high < -rest) {
        sign = -1;
      } else if (!(low >= -rest && high <= rest)) {
        return fmt::format("not provable: whether '{}' slides or rests is open", element.name);
      }
      T size(sign == 0 ? friction->breakaway : friction->coulomb);
      if (sign != 0 && friction->stribeck_rate > 0.0) {
        const T slowness = x.r / T(friction->stribeck_rate);
        size += (T(friction->breakaway) - T(friction->coulomb)) * exp(T(-slowness * slowness));
      }
      force = T(-friction->sense(sign)) * share * size;
      if (friction->by_load() && (sign != 0 || friction->skew != 0.0)) {
        loaded_.push_back({e, T(-sign) * share * PerLoad(*friction), share * T(friction->skew),
                           friction->coupling >= 0, wrenches});
      }
    }
    Exert(force, wrenches);
    return "";
  }

  void Report(SampleProof* proof) {
    const size_t drives = mechanism().drives.size();
    std::vector<T> all(forces_.size(), T(0));
    for (size_t k = 0; k < columns_.size(); ++k) all[columns_[k]] = force_[k];
    for (size_t d = 0; d < drives; ++d) {
      const Drive& drive = mechanism().drives[d];
      const Series<T> x = model_.ValueAt(driven_[d], motions_);
      const std::string unit = PositionUnit(mechanism(), drive);
      const auto add = [&](Quantity quantity, const std::string& of, const T& value) {
        proof->values.push_back(Proved(ChannelName(quantity, drive.name), of, value));
      };
      add(Quantity::kPosition, unit, x.v);
      add(Quantity::kVelocity, unit + "/s", x.r);
      add(Quantity::kAcceleration, unit + "/s^2", x.a);
      add(Quantity::kForce, ForceUnit(mechanism(), drive), all[transmitting_ + d]);
      proof->values.back().force = true;
    }
    for (size_t p = 0; p < mechanism().prescribed.size(); ++p) {
      const Prescribed& prescribed = mechanism().prescribed[p];
      const bool slides =
          IsLength(mechanism().joints[static_cast<size_t>(prescribed.joint)].kind, 0);
      proof->values.push_back(Proved(ChannelName(Quantity::kBaseForce, prescribed.name),
                                     slides ? "N" : "N m", all[transmitting_ + drives + p]));
      proof->values.back().force = true;
    }
    if (reactions_unique_) ReportReactions(all, proof);
  }

  // On children, of all joints: what cut ones transmit, and what is left for the tree's.
  [[nodiscard]] std::vector<Six<T>> ReactionsOf(std::vector<Six<T>> carried,
                                                const std::vector<T>& all) const {
    for (size_t k = 0; k < forces_.size(); ++k) Exert(all[k], forces_[k].wrenches, &carried);
    std::vector<Six<T>> on_child(mechanism().joints.size());
    for (size_t t = 0; t < mechanism().tree_joints.size(); ++t) {
      const int outboard = model_.OutboardOf(t);
      const Six<T> sum = model_.SumBeyond(outboard, carried);
      on_child[static_cast<size_t>(mechanism().tree_joints[t])] =
          mechanism().tree_reversed[t] ? Six<T>() - sum : sum;
    }
    size_t at = 0, equation = 0;
    const std::vector<bool> transmitting = model_.Transmitting();
    for (size_t j = 0; j < mechanism().joints.size(); ++j) {
      if (!mechanism().joints[j].closure) continue;
      const auto locks = static_cast<size_t>(6 - DofsOf(mechanism().joints[j].kind));
      for (size_t k = 0; k < locks; ++k, ++equation) {
        if (!transmitting[equation]) continue;
        on_child[j] = on_child[j] + Times(all[at], forces_[at].wrenches.front().on_child);
        ++at;
      }
    }
    return on_child;
  }

  void ReportReactions(const std::vector<T>& all, SampleProof* proof) const {
    const std::vector<Six<T>> on_child = ReactionsOf(carried_, all);
    for (size_t j = 0; j < mechanism().joints.size(); ++j) {
      const Joint& joint = mechanism().joints[j];
      const std::array<T, 6> parts = model_.InJoint(joint, on_child[j], bodies_);
      for (int c = 0; c < 6; ++c) {
        proof->values.push_back(Proved(ChannelName(Quantity::kReaction, joint.name, c),
                                       c < 3 ? "N" : "N m", parts[static_cast<size_t>(c)]));
      }
    }
  }

  Model<T> model_;
  const Motion& motion_;
  const double contradiction_;
  const bool along_commands_;
  const double length_;
  std::vector<T> q_;
  std::vector<Asked> asked_;  ///< closures, commands, idle spins
  size_t closures_ = 0, transmitting_ = 0;
  std::vector<Equation<T>> driven_, element_equations_;
  std::vector<size_t> rows_, columns_;  ///< of asked_, of forces_
  bool reactions_unique_ = false, shared_ = false;
  std::optional<System> system_;
  typename Model<T>::Poses bodies_;
  Wrenches wrenches_;             ///< of asked_, there
  std::vector<Virtual> virtual_;  ///< of the tree's coordinates, then released ones
  typename Model<T>::Motions motions_;
  std::vector<double> engaged_;  ///< CommandSample::engaged
  std::vector<Six<T>> carried_;  ///< required less applied, per body
  std::vector<Force> forces_;
  std::vector<Loaded> loaded_;  ///< friction by load, of what slides
  std::vector<T> force_;
};

// Why a mechanism in motion is not served.
std::string NotServedReason(const Motion& motion) {
  if (motion.free()) return "not provable: forces are given, and the motion is integrated";
  return "";
}

// The sample at which drive forces of two witnesses differ most, by the largest force of the unit.
size_t WorstSample(const Mechanism& mechanism, const std::vector<CertifiedTrace>& traces) {
  size_t worst = 0;
  double most = -1.0;
  for (size_t a = 0; a < traces.size(); ++a) {
    for (size_t b = a + 1; b < traces.size(); ++b) {
      const Trace &x = *traces[a].trace, &y = *traces[b].trace;
      if (x.time_s != y.time_s) continue;
      for (const Drive& drive : mechanism.drives) {
        const int i = x.Find(Quantity::kForce, drive.name),
                  j = y.Find(Quantity::kForce, drive.name);
        if (i < 0 || j < 0) continue;
        const Eigen::Index n = std::min(x.values.rows(), y.values.rows());
        if (n == 0) continue;
        const double scale = x.values.col(i).head(n).cwiseAbs().maxCoeff();
        for (Eigen::Index s = 0; s < n; ++s) {
          const double off = std::abs(x.values(s, i) - y.values(s, j)) / scale;
          if (off > most) most = off, worst = static_cast<size_t>(s);
        }
      }
    }
  }
  return worst;
}

std::set<size_t> ChosenSamples(size_t count, size_t spread, size_t worst) {
  std::set<size_t> chosen;
  if (spread == 0 || spread >= count) {
    for (size_t i = 0; i < count; ++i) chosen.insert(i);
    return chosen;
  }
  for (size_t k = 0; k < spread; ++k) {
    chosen.insert(spread == 1 ? 0 : (k * (count - 1) + (spread - 1) / 2) / (spread - 1));
  }
  chosen.insert(worst);
  return chosen;
}

// The largest values of a witness' channels by quantity and unit, over the whole motion: errors
// relate to them. Positions are at least a share of a radian or of the characteristic length; rates
// and accelerations that a motion has not are as large as those of a motion over the same range, at
// least that share, in its time; forces by themselves at least a share of the weights and of the
// largest drive force, moments with the characteristic length; base forces and reactions are no
// smaller than drive forces.
constexpr double kLeastShare = 1e-6;
class Scales {
 public:
  Scales(const Trace& trace, const Mechanism& mechanism, double duration_s)
      : trace_(trace),
        length_(CharacteristicLength(mechanism)),
        least_{{"m", kLeastShare * length_},
               {"rad", kLeastShare},
               {"m/s", kLeastShare * length_ / duration_s},
               {"rad/s", kLeastShare / duration_s},
               {"m/s^2", kLeastShare * length_ / (duration_s * duration_s)},
               {"rad/s^2", kLeastShare / (duration_s * duration_s)}} {
    for (const Body& body : mechanism.bodies) force_ += body.mass * mechanism.gravity_W.norm();
    force_ *= kLeastShare;
    for (size_t c = 0; c < trace.channels.size(); ++c) {
      const Channel& channel = trace.channels[c];
      const auto column = trace.values.col(static_cast<Eigen::Index>(c));
      if (column.size() == 0 || !column.allFinite()) continue;
      double& largest = largest_[Key(channel.quantity, channel.unit)];
      const double size = column.cwiseAbs().maxCoeff();
      largest = std::max(largest, size);
      if (channel.quantity == Quantity::kForce) {
        force_ = std::max(force_, channel.unit == "N" ? size : size / length_);
      }
      if (channel.quantity != Quantity::kPosition) continue;
      const double range = column.maxCoeff() - column.minCoeff();
      for (const auto& [quantity, power, per] : {std::tuple(Quantity::kVelocity, 1, "/s"),
                                                 std::tuple(Quantity::kAcceleration, 2, "/s^2")}) {
        double& floor = largest_[Key(quantity, channel.unit + per)];
        floor = std::max(floor, range / std::pow(duration_s, power));
      }
    }
  }
  // Of a channel.
  [[nodiscard]] double Of(size_t column) const {
    const Channel& channel = trace_.channels[column];
    const auto at = largest_.find(Key(channel.quantity, channel.unit));
    const double largest = at == largest_.end() ? 0.0 : at->second;
    const double force = channel.unit == "N" ? force_ : force_ * length_;
    switch (channel.quantity) {
      case Quantity::kForce:
        return std::max(largest, kLeastShare * force);
      case Quantity::kBaseForce:
      case Quantity::kReaction:
        return std::max(largest, force);
      default: {
        const auto least = least_.find(channel.unit);
        return least == least_.end() ? largest : std::max(largest, least->second);
      }
    }
  }

 private:
  static std::pair<int, std::string> Key(Quantity quantity, const std::string& unit) {
    return {static_cast<int>(quantity), unit};
  }
  const Trace& trace_;
  const double length_;
  const std::map<std::string, double> least_;  // by unit
  double force_ = 0.0;
  std::map<std::pair<int, std::string>, double> largest_;
};

// The row of a sample time; -1: the trace (a table's) has none there.
Eigen::Index RowAt(const Trace& trace, double time_s) {
  const auto at = std::lower_bound(trace.time_s.begin(), trace.time_s.end(), time_s - 1e-9);
  if (at == trace.time_s.end() || std::abs(*at - time_s) > 1e-9) return -1;
  return at - trace.time_s.begin();
}

// Half-width of the band that resting friction leaves a force, of which the middle is proved: the
// narrowest that a trace states. A witness that states none gives a number of the band.
double BandAt(const std::vector<CertifiedTrace>& traces, const Channel& force, double time_s) {
  double narrowest = kInfinity;
  for (const CertifiedTrace& trace : traces) {
    const Eigen::Index row = RowAt(*trace.trace, time_s);
    const int column = trace.trace->Find(force.name + ".band");
    if (row >= 0 && column >= 0) {
      narrowest = std::min(narrowest, trace.trace->values(row, column));
    }
  }
  return std::isfinite(narrowest) ? narrowest : 0.0;
}

void Compare(const CertifiedTrace& of, const Mechanism& mechanism, double duration_s,
             const std::vector<CertifiedTrace>& traces, const std::vector<SampleProof>& samples,
             double computed_limit, std::vector<WitnessProof>* proofs) {
  WitnessProof proof;
  proof.witness = of.witness;
  proof.engine = of.engine;
  proof.limit = of.engine ? of.limit : computed_limit;
  const Scales scales(*of.trace, mechanism, duration_s);
  for (const SampleProof& sample : samples) {
    const Eigen::Index row = RowAt(*of.trace, sample.time_s);
    if (row < 0) continue;
    for (const ProvedValue& value : sample.values) {
      const int column = of.trace->Find(value.channel);
      if (column < 0) continue;
      const double stated = of.trace->values(row, column);
      if (!std::isfinite(stated)) continue;
      const double largest = scales.Of(static_cast<size_t>(column));
      const Channel& channel = of.trace->channels[static_cast<size_t>(column)];
      const Quantity quantity = channel.quantity;
      const bool force = quantity == Quantity::kForce || quantity == Quantity::kBaseForce;
      double apart = std::abs(stated - value.value);
      if (force && of.trace->Find(channel.name + ".band") < 0) {
        apart = std::max(0.0, apart - BandAt(traces, channel, sample.time_s));
      }
      const double off = apart + value.radius + kEps * std::abs(value.value);
      const double error = largest > 0.0 ? off / largest : off > value.radius ? kInfinity : 0.0;
      ++proof.values;
      double& kind = force                             ? proof.force_error
                     : quantity == Quantity::kReaction ? proof.reaction_error
                                                       : proof.motion_error;
      if (quantity == Quantity::kReaction) ++proof.reactions;
      if (force && largest > 0.0) {
        const double least = (apart - value.radius - kEps * std::abs(value.value)) / largest;
        proof.force_error_at_least = std::max(proof.force_error_at_least, least);
      }
      if (!(error > kind)) continue;
      kind = error;
      if (force) proof.time_s = sample.time_s, proof.channel = value.channel;
    }
  }
  if (proof.values == 0) return;
  proof.wrong = std::isfinite(proof.limit) && proof.force_error_at_least > proof.limit;
  proofs->push_back(std::move(proof));
}

}  // namespace

double WitnessProof::digits() const { return -std::log10(force_error); }

size_t Certificate::proved() const {
  return static_cast<size_t>(std::count_if(samples.begin(), samples.end(),
                                           [](const SampleProof& s) { return s.proved(); }));
}

const WitnessProof* Certificate::FirstWrong() const {
  for (const WitnessProof& witness : witnesses) {
    if (witness.wrong) return &witness;
  }
  return nullptr;
}

std::string WitnessProof::Sentence() const {
  const Role* role = FindRole(witness);
  return fmt::format(
      "proved: {} is off by {:.1e} of the largest drive force at t = {:g} s ({}), limit {:.1e}",
      role == nullptr ? witness : role->called, force_error_at_least, time_s, channel, limit);
}

std::string Certificate::Sentence() const {
  if (!why_not.empty()) return "drive forces are not certified: " + why_not;
  double digits = kInfinity;
  std::string engines;
  for (const WitnessProof& w : witnesses) {
    if (w.engine) {
      const Role* role = FindRole(w.witness);
      engines += fmt::format("; {} is right to {:.1f}", role == nullptr ? w.witness : role->called,
                             w.digits());
    } else if (!w.wrong) {
      digits = std::min(digits, w.digits());
    }
  }
  std::string text =
      fmt::format("drive forces proved at {} of {} samples", proved(), samples.size());
  if (std::isfinite(digits)) {
    text = fmt::format("drive forces proved to {:.0f} digits at {} of {} samples",
                       std::floor(digits), proved(), samples.size());
  }
  return text + engines;
}

Certificate Certify(const Mechanism& mechanism, const Motion& motion,
                    const std::vector<CertifiedTrace>& traces, const CertifyOptions& options) {
  Certificate certificate;
  certificate.why_not = NotServedReason(motion);
  if (!certificate.why_not.empty()) return certificate;
  const exact::NumberPool pool;
  const std::vector<double> times = SampleTimes(motion.duration_s, motion.sample_s);
  const std::set<size_t> chosen =
      ChosenSamples(times.size(), options.samples, WorstSample(mechanism, traces));
  Prover<exact::Fine> fine(mechanism, motion, options.contradiction);
  std::unique_ptr<Prover<exact::Finest>> finest;
  ReferenceOptions quiet;
  quiet.explain_unreached = false;
  ReferenceSolver solver(mechanism, motion, quiet);
  ReferenceSample at;
  Start start;
  size_t done = 0;
  for (size_t i = 0; i <= *chosen.rbegin(); ++i) {
    EvaluateMotion(motion, times[i], &start.command);
    const RunSummary reached = solver.Kinematics(start.command, &at);
    if (chosen.count(i) == 0 && reached.ok()) continue;
    SampleProof proof;
    if (reached.ok()) {
      start.time_s = times[i];
      start.X_WB = at.states.X_WB;
      start.coupled = at.states.coupled, start.turns = at.states.turns;
      proof = fine.Prove(start);
      if (!proof.proved() || options.least_bits > proof.bits) {
        if (finest == nullptr) {
          finest =
              std::make_unique<Prover<exact::Finest>>(mechanism, motion, options.contradiction);
        }
        proof = finest->Prove(start);
      }
    } else {
      proof.why_not = "not provable: the reference found no pose to start from: " + reached.message;
    }
    proof.index = i, proof.time_s = times[i];
    certificate.samples.push_back(std::move(proof));
    if (options.progress) {
      options.progress(static_cast<double>(++done) / static_cast<double>(chosen.size()));
    }
    if (!reached.ok()) break;
  }
  for (const CertifiedTrace& trace : traces) {
    Compare(trace, mechanism, motion.duration_s, traces, certificate.samples, options.limit,
            &certificate.witnesses);
  }
  double open = 0.0;
  for (const SampleProof& sample : certificate.samples) open = std::max(open, sample.left_open);
  if (open > 1e-30) {
    certificate.left_out.push_back(fmt::format(
        "loops are closed more than once: as many equations are taken as are "
        "independent, the others are off by at most {:.1e} (m or direction cosines); so "
        "far do the model's doubles contradict each other, and about as much do the "
        "values depend on which are taken",
        open));
  }
  if (fine.reactions_open()) {
    certificate.left_out.emplace_back(
        "reactions are not proved: statics leaves a choice among those of redundant constraints");
  }
  if (fine.shared()) {
    certificate.left_out.emplace_back(
        "drives share their forces: those of least norm are proved, as the reference takes them");
  }
  for (const Load& load : motion.loads) {
    if (load.following.empty()) continue;
    certificate.left_out.push_back(fmt::format(
        "load '{}' is an expression: its own rounding, in doubles, is not in the bounds",
        load.name));
  }
  for (const ForceElement& element : mechanism.elements) {
    if (!std::holds_alternative<ExpressionLaw>(element.law)) continue;
    certificate.left_out.push_back(fmt::format(
        "element '{}' is an expression: its own rounding, in doubles, is not in the bounds",
        element.name));
  }
  certificate.left_out.emplace_back(
      "which of several assembly modes is meant: the one of the reference's pose is proved");
  return certificate;
}

std::string DifferentiateExactly(const Mechanism& mechanism, const Motion& motion,
                                 const BodyStates& near, const CommandSample& command,
                                 ExactDerivatives* out) {
  Prover<exact::Dual> prover(mechanism, motion, CertifyOptions().contradiction, !out->of_drives);
  Start start;
  start.time_s = command.time_s;
  start.X_WB = near.X_WB, start.coupled = near.coupled, start.turns = near.turns;
  start.command = command;
  const auto n = static_cast<Eigen::Index>(motion.commands.size());
  std::vector<exact::Dual> forces, reactions;
  for (const auto& [of, matrix] :
       {std::pair(Start::Of::kPosition, &ForceSlopes::by_position),
        std::pair(Start::Of::kVelocity, &ForceSlopes::by_velocity),
        std::pair(Start::Of::kAcceleration, &ForceSlopes::by_acceleration)}) {
    start.of = of;
    for (Eigen::Index k = 0; k < n; ++k) {
      start.varied = static_cast<int>(k);
      if (std::string trouble = prover.Evaluate(start, &forces, &reactions); !trouble.empty()) {
        return trouble;
      }
      for (const auto& [values, slopes] :
           {std::pair(&forces, static_cast<ForceSlopes*>(out)), {&reactions, &out->reactions}}) {
        const auto rows = static_cast<Eigen::Index>(values->size());
        slopes->force.resize(rows);
        MatX& by = slopes->*matrix;
        by.resize(rows, n);
        for (Eigen::Index i = 0; i < rows; ++i) {
          const exact::Dual& force = (*values)[static_cast<size_t>(i)];
          slopes->force[i] = force.x;
          by(i, k) = force.d;
        }
      }
    }
  }
  return "";
}

}  // namespace mbv
