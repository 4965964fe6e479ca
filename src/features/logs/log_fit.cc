#include "features/logs/log_fit.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace mbv {
namespace {

using Kind = LogTerm::Kind;

constexpr size_t kFewestFitRows = 30;
constexpr size_t kScanRows = 2000;      // by which the delay is searched for
constexpr int kMostLags = 400;          // on either side
constexpr double kRests = 1e-6;         // of the way's size, of a drive that holds still
constexpr double kNearRest = 0.01;      // of the fastest rate: the sign is not known there
constexpr double kChanges = 1e-4;       // of the log, by the longest delay
constexpr double kAlike = 1e-3;         // what is left of a column that others explain
constexpr double kSure = 3.0;           // standard errors
constexpr double kMatters = 5e-3;       // of the log's RMS
constexpr Eigen::Index kLagShare = 10;  // of the rows: longer correlations count as this one
constexpr int kMostSteps = 30;          // of Gauss and Newton

double RootMean(double sum2, size_t count) {
  return count == 0 ? kNan : std::sqrt(sum2 / static_cast<double>(count));
}

class LogFitter {
 public:
  LogFitter(const LogForce& force, double most_delay_s)
      : force_(force), most_delay_s_(std::min(most_delay_s, 0.1 * force.end_s)) {
    for (size_t k = 0; k < fit_.terms.size(); ++k) fit_.terms[k].kind = static_cast<Kind>(k);
  }

  LogFit Fit() {
    Compare();
    // First away from every reversal that a delay could move, so that every sign is certain.
    const double step_s =
        force_.end_s / static_cast<double>(std::max<size_t>(force_.log.size(), 1));
    ChooseRows(0.0, most_delay_s_);
    if (rows_.size() < std::max(kFewestFitRows, force_.log.size() / 5)) ChooseRows(0.0, step_s);
    if (rows_.size() < kFewestFitRows || !(fit_.rms_log > 0.0)) return fit_;
    const double delay_s = Refine(Scan(step_s));
    ChooseRows(delay_s, step_s);
    if (rows_.size() >= kFewestFitRows) (void)Refine(delay_s);
    return fit_;
  }

 private:
  [[nodiscard]] double Model(size_t row, double delay_s) const {
    return Evaluate(*force_.model, force_.time_s[row] - delay_s).value;
  }

  void Compare() {
    const size_t n = force_.log.size();
    fit_.rows = n;
    double y2 = 0, m2 = 0, d2 = 0, y1 = 0, m1 = 0, ym = 0;
    for (size_t i = 0; i < n; ++i) {
      const double y = force_.log[i], m = Model(i, 0.0);
      y1 += y;
      m1 += m;
      y2 += y * y;
      m2 += m * m;
      ym += y * m;
      d2 += (y - m) * (y - m);
    }
    fit_.rms_log = RootMean(y2, n);
    fit_.rms_model = RootMean(m2, n);
    fit_.rms_difference = RootMean(d2, n);
    const auto count = static_cast<double>(n);
    fit_.bias = n == 0 ? kNan : (y1 - m1) / count;
    const double spread = (y2 - y1 * y1 / count) * (m2 - m1 * m1 / count);
    if (spread > 0.0) fit_.correlation = (ym - y1 * m1 / count) / std::sqrt(spread);
  }

  // Rows whose model is known for every delay, and whose direction is known and stays the same for
  // `window_s` on either side.
  void ChooseRows(double delay_s, double window_s) {
    double fastest = 0.0;
    for (const double t : force_.time_s) {
      fastest = std::max(fastest, std::abs(Evaluate(*force_.velocity, t).value));
    }
    moves_ = fastest * force_.end_s > kRests * force_.size;
    const auto rate = [&](double t) { return Evaluate(*force_.velocity, t - delay_s).value; };
    rows_.clear();
    double d2 = 0.0;
    for (size_t i = 0; i < force_.time_s.size(); ++i) {
      const double t = force_.time_s[i];
      if (t < most_delay_s_ || t > force_.end_s - most_delay_s_) continue;
      if (moves_) {
        const double now = rate(t);
        if (std::abs(now) < kNearRest * fastest || now * rate(t - window_s) < 0.0 ||
            now * rate(t + window_s) < 0.0) {
          continue;
        }
      }
      rows_.push_back(i);
      const double difference = force_.log[i] - Model(i, 0.0);
      d2 += difference * difference;
    }
    fit_.fit_rows = rows_.size();
    fit_.rms_before = RootMean(d2, rows_.size());
  }

  // Columns of (1) at a delay: gain, offset, delay (to first order), friction, inertia.
  [[nodiscard]] MatX Columns(const std::vector<size_t>& rows, double delay_s, double gain) const {
    MatX columns(static_cast<Eigen::Index>(rows.size()), 6);
    for (size_t k = 0; k < rows.size(); ++k) {
      const double t = force_.time_s[rows[k]] - delay_s;
      const Jet m = Evaluate(*force_.model, t);
      const Jet v = moves_ ? Evaluate(*force_.velocity, t) : Jet{};
      const auto i = static_cast<Eigen::Index>(k);
      columns(i, static_cast<int>(Kind::kGain)) = m.value;
      columns(i, static_cast<int>(Kind::kOffset)) = 1.0;
      columns(i, static_cast<int>(Kind::kDelay)) = -gain * m.rate;
      columns(i, static_cast<int>(Kind::kCoulomb)) = v.value > 0 ? 1.0 : v.value < 0 ? -1.0 : 0.0;
      columns(i, static_cast<int>(Kind::kViscous)) = v.value;
      columns(i, static_cast<int>(Kind::kInertia)) = v.rate;
    }
    return columns;
  }

  [[nodiscard]] VecX LogOf(const std::vector<size_t>& rows) const {
    VecX y(static_cast<Eigen::Index>(rows.size()));
    for (size_t k = 0; k < rows.size(); ++k) y[static_cast<Eigen::Index>(k)] = force_.log[rows[k]];
    return y;
  }

  // Those that the ones before do not explain, in this order.
  static std::vector<int> Separable(const MatX& columns, const std::vector<Kind>& wanted) {
    std::vector<int> taken;
    MatX basis(columns.rows(), 0);
    for (const Kind kind : wanted) {
      VecX column = columns.col(static_cast<int>(kind));
      const double whole = column.norm();
      if (!(whole > 0.0) || !std::isfinite(whole)) continue;
      // Twice: once leaves round-off.
      for (int k = 0; k < 2; ++k) column -= basis * (basis.transpose() * column);
      const double left = column.norm();
      if (left * left < kAlike * whole * whole) continue;
      basis.conservativeResize(Eigen::NoChange, basis.cols() + 1);
      basis.rightCols(1) = column / left;
      taken.push_back(static_cast<int>(kind));
    }
    return taken;
  }

  static MatX Chosen(const MatX& columns, const std::vector<int>& taken) {
    MatX chosen(columns.rows(), static_cast<Eigen::Index>(taken.size()));
    for (size_t k = 0; k < taken.size(); ++k) {
      chosen.col(static_cast<Eigen::Index>(k)) = columns.col(taken[k]);
    }
    return chosen;
  }

  // The delay at which gain, offset and friction leave least.
  [[nodiscard]] double Scan(double step_s) const {
    const size_t stride = std::max<size_t>(1, rows_.size() / kScanRows);
    std::vector<size_t> rows;
    for (size_t k = 0; k < rows_.size(); k += stride) rows.push_back(rows_[k]);
    const VecX y = LogOf(rows);
    const int steps = std::max(1, static_cast<int>(most_delay_s_ / step_s));
    const int lag_steps = 1 + (steps - 1) / kMostLags;
    const int lags = steps / lag_steps;
    double best_s = 0.0, least = std::numeric_limits<double>::infinity();
    for (int lag = -lags; lag <= lags; ++lag) {
      const double delay_s = step_s * lag_steps * lag;
      const MatX columns = Columns(rows, delay_s, 1.0);
      const std::vector<int> taken =
          Separable(columns, {Kind::kOffset, Kind::kGain, Kind::kCoulomb, Kind::kViscous});
      const MatX chosen = Chosen(columns, taken);
      const VecX c = chosen.colPivHouseholderQr().solve(y);
      const double left = (y - chosen * c).norm();
      // Of equal ones the smallest delay.
      if (left < least * (1.0 - 1e-9) ||
          (left <= least * (1.0 + 1e-9) && std::abs(delay_s) < std::abs(best_s))) {
        least = left;
        best_s = delay_s;
      }
    }
    return best_s;
  }

  // Everything of (1) from a first delay on; the delay.
  double Refine(double delay_s) {
    const VecX y = LogOf(rows_);
    double gain = 1.0;
    MatX columns = Columns(rows_, delay_s, gain);
    const std::vector<Kind> wanted = {Kind::kOffset,  Kind::kGain,  Kind::kCoulomb,
                                      Kind::kViscous, Kind::kDelay, Kind::kInertia};
    std::vector<int> taken = Separable(columns, wanted);
    // A force that hardly changes within the longest delay determines no delay.
    const double change = columns.col(static_cast<int>(Kind::kDelay)).norm() * most_delay_s_;
    const bool delays = change > kChanges * y.norm() &&
                        std::ranges::count(taken, static_cast<int>(Kind::kDelay)) > 0;
    if (!delays) {
      delay_s = 0.0;
      columns = Columns(rows_, delay_s, gain);
      taken = Separable(columns, wanted);
      std::erase(taken, static_cast<int>(Kind::kDelay));
    }
    VecX c;
    for (int step = 0; step < kMostSteps; ++step) {
      const MatX X = Chosen(columns, taken);
      c = X.colPivHouseholderQr().solve(y);
      const double slip_s = delays ? CoefficientOf(c, taken, Kind::kDelay, 0.0) : 0.0;
      gain = CoefficientOf(c, taken, Kind::kGain, 1.0);
      const double next_s = std::clamp(delay_s + slip_s, -most_delay_s_, most_delay_s_);
      const bool done = std::abs(next_s - delay_s) <= 1e-9 * most_delay_s_;
      delay_s = next_s;
      columns = Columns(rows_, delay_s, gain);
      if (done) break;
    }
    const MatX X = Chosen(columns, taken);
    c = X.colPivHouseholderQr().solve(y);
    const VecX e = y - X * c;
    fit_.rms_left = RootMean(e.squaredNorm(), rows_.size());
    const VecX errors = StandardErrors(X, e);
    for (size_t k = 0; k < taken.size(); ++k) {
      LogTerm& term = fit_.terms[static_cast<size_t>(taken[k])];
      const auto i = static_cast<Eigen::Index>(k);
      term.fitted = true;
      term.value = term.kind == Kind::kDelay ? delay_s : c[i];
      term.error = errors[i];
      const double from = term.kind == Kind::kGain ? 1.0 : 0.0;
      const double rms = X.col(i).norm() / std::sqrt(static_cast<double>(rows_.size()));
      term.effect = std::abs(term.value - from) * rms;
      term.named =
          std::abs(term.value - from) > kSure * term.error && term.effect > kMatters * fit_.rms_log;
    }
    return delays ? delay_s : 0.0;
  }

  static double CoefficientOf(const VecX& c, const std::vector<int>& taken, Kind kind,
                              double otherwise) {
    const auto at = std::ranges::find(taken, static_cast<int>(kind));
    return at == taken.end() ? otherwise : c[at - taken.begin()];
  }

  // [Newey 1987]: (XᵀX)⁻¹ S (XᵀX)⁻¹, S with Bartlett's weights.
  static VecX StandardErrors(const MatX& X, const VecX& e) {
    const Eigen::Index n = X.rows(), p = X.cols();
    const double power = e.squaredNorm();
    Eigen::Index lags = 0;
    const Eigen::Index most = n / kLagShare;
    while (lags < most) {
      const Eigen::Index k = lags + 1;
      if (e.head(n - k).dot(e.tail(n - k)) <= 0.0) break;
      ++lags;
    }
    if (!(power > 0.0)) lags = 0;
    // Columns of equal size: their units differ by orders of magnitude.
    VecX size(p);
    for (Eigen::Index k = 0; k < p; ++k) size[k] = X.col(k).norm();
    const MatX Z = (X * size.cwiseInverse().asDiagonal()).array().colwise() * e.array();
    MatX S = Z.transpose() * Z;
    for (Eigen::Index k = 1; k <= lags; ++k) {
      const double weight = 1.0 - static_cast<double>(k) / static_cast<double>(lags + 1);
      const MatX G = Z.topRows(n - k).transpose() * Z.bottomRows(n - k);
      S += weight * (G + G.transpose());
    }
    const MatX U = X * size.cwiseInverse().asDiagonal();
    const MatX A = (U.transpose() * U).ldlt().solve(MatX::Identity(p, p));
    const MatX V = A * S * A *
                   (static_cast<double>(n) / static_cast<double>(std::max<Eigen::Index>(n - p, 1)));
    VecX errors(p);
    for (Eigen::Index k = 0; k < p; ++k) errors[k] = std::sqrt(std::max(V(k, k), 0.0)) / size[k];
    return errors;
  }

  const LogForce& force_;
  const double most_delay_s_;
  bool moves_ = false;
  std::vector<size_t> rows_;
  LogFit fit_;
};

}  // namespace

const char* LogTerm::word() const {
  static constexpr const char* kWords[] = {
      "gain", "offset", "delay", "Coulomb friction", "viscous friction", "inertia"};
  return kWords[static_cast<size_t>(kind)];
}

LogFit FitLogForce(const LogForce& force, double most_delay_s) {
  return LogFitter(force, most_delay_s).Fit();
}

}  // namespace mbv
