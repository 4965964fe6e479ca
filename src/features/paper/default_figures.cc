#include "features/paper/figures.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <optional>
#include <utility>

#include "features/paper/signals.h"
#include "plot/layout.h"
#include "plot/style.h"
#include "report/load_figures.h"

namespace mbv {
namespace {

constexpr double kSmallPanel = 0.6;  // of differences, against the panel above
constexpr size_t kMarkerStep = 8;    // of the spans of differences

bool Turns(const std::string& force_unit) { return force_unit == "N m"; }

// The curves of one trace, in SI.
PlotPoints OverTime(const Trace& trace, const VecX& values) {
  PlotPoints points;
  for (size_t i = 0; i < trace.time_s.size(); ++i) {
    points.emplace_back(trace.time_s[i], values[static_cast<Eigen::Index>(i)]);
  }
  return points;
}

double LargestOf(const std::vector<PlotPoints>& curves) {
  double largest = 0;
  for (const PlotPoints& curve : curves) {
    for (const auto& [t, v] : curve) {
      if (std::isfinite(v)) largest = std::max(largest, std::abs(v));
    }
  }
  return largest;
}

class FigureMaker {
 public:
  FigureMaker(const Report& report, Language language)
      : report_(report), language_(language), line_(LineWitness(report)) {}

  FigureSet Make() {
    if (line_ == nullptr) return {{}, {"no witness ran: there is nothing to draw"}};
    time_ = UsualUnit("s", line_->trace.time_s.back());
    ForceFigures();
    MotionFigures();
    Reactions();
    PowerEnergy();
    ForceOverSpeed();
    return std::move(set_);
  }

 private:
  [[nodiscard]] std::string In(FigureWord word) const { return WordFor(word, language_); }
  [[nodiscard]] FigureAxis TimeAxis() const {
    return {.label = AxisLabel(In(FigureWord::kTime), "*t*", time_.shown)};
  }
  void LeaveOut(const std::string& text) { set_.left_out.push_back(text); }

  // One figure for at most kMostCurves of the subjects.
  void ForEachPart(
      const std::string& name, const std::vector<std::string>& subjects,
      const std::function<void(const std::string&, const std::vector<std::string>&)>& make) {
    const size_t parts = (subjects.size() + kMostCurves - 1) / kMostCurves;
    for (size_t k = 0; k < parts; ++k) {
      const auto from = subjects.begin() + static_cast<ptrdiff_t>(k * kMostCurves);
      const auto to = subjects.begin() +
                      static_cast<ptrdiff_t>(std::min(subjects.size(), (k + 1) * kMostCurves));
      make(parts == 1 ? name : fmt::format("{}_{}", name, k + 1), {from, to});
    }
  }

  // "*F*_{1}" of a drive that has a symbol, else its name.
  [[nodiscard]] std::string NameOf(const std::string& drive, const std::string& letter) const {
    for (size_t d = 0; d < report_.symbols.size(); ++d) {
      if (report_.drives[d] == drive && !report_.symbols[d].empty()) {
        return letter + report_.symbols[d];
      }
    }
    return AsPlainText(drive);
  }

  // A quantity of drives over time: lines of one witness, markers of the others.
  FigurePanel DrivePanel(Quantity quantity, const std::string& letter,
                         const std::vector<std::string>& drives, const ShownUnit& unit,
                         bool legend) const {
    FigurePanel panel{.x = TimeAxis()};
    std::vector<SignalRow> rows;
    rows.reserve(drives.size());
    for (const std::string& drive : drives) {
      rows.push_back({ChannelName(quantity, drive), NameOf(drive, letter)});
    }
    AddOverTime(rows, ShownWitnesses(report_), line_, {time_, unit, language_, legend}, &panel);
    return panel;
  }

  // |difference| of all drives together, for each pair that was compared, and the limit.
  FigurePanel DifferencePanel(const std::vector<std::string>& drives, const ShownUnit& unit) const {
    FigurePanel panel{.x = TimeAxis(), .y = {.log = true}, .share = kSmallPanel};
    std::optional<double> limit;  // of the first pair that states one
    for (const PairComparison& pair : report_.comparison.pairs) {
      const Trace* measured = TraceOf(report_, pair.measured);
      const Trace* truth = TraceOf(report_, pair.truth);
      if (!pair.compared || measured == nullptr || truth == nullptr) continue;
      const PlotPoints points = LargestDifferences(*measured, *truth, drives);
      const bool any = std::ranges::any_of(points, [](const auto& p) { return p.second > 0; });
      if (!any) continue;
      FigureCurve curve{
          .label = SayWitness(pair.measured, language_) + " − " + SayWitness(pair.truth, language_),
          .points = Scaled(Envelope(points, kDifferenceSpans), time_, unit),
          .look = static_cast<int>(panel.curves.size())};
      // Where two witnesses agree far better, the third differs from both by the same.
      if (panel.curves.size() >= 2) AsMarkers(&curve);
      panel.curves.push_back(std::move(curve));
      if (!limit) limit = LimitIn(pair, points, drives);
    }
    if (limit) {
      const std::vector<double>& times = line_->trace.time_s;
      panel.curves.push_back(
          {.label = In(FigureWord::kLimit),
           .points = Scaled({{times.front(), *limit}, {times.back(), *limit}}, time_, unit),
           .look = -1});
    }
    return panel;
  }

  // Some of its points, through which what lies below is seen.
  static void AsMarkers(FigureCurve* curve) {
    FigurePoints some;
    for (size_t i = kMarkerStep / 2; i < curve->points.size(); i += kMarkerStep) {
      some.push_back(curve->points[i]);
    }
    curve->points = std::move(some);
    curve->line = false;
    curve->marker = curve->look - 2;
  }

  // The limit of the largest difference [N or N m]: the check has it as a share, and its worst
  // sample shows of what.
  [[nodiscard]] std::optional<double> LimitIn(const PairComparison& pair, const PlotPoints& points,
                                              const std::vector<std::string>& drives) const {
    const CheckResult* check = report_.comparison.FindCheck(pair.name() + ".force_max");
    const auto worst = pair.metrics.find(Metric::kForceMax);
    if (check == nullptr || !check->limit || worst == pair.metrics.end()) return std::nullopt;
    const bool here = std::ranges::any_of(drives, [&](const std::string& drive) {
      return ChannelName(Quantity::kForce, drive) == worst->second.channel;
    });
    if (!here || !(worst->second.value > 0.0)) return std::nullopt;
    double largest = 0.0;
    for (const auto& [t, difference] : points) largest = std::fmax(largest, difference);
    return *check->limit * largest / worst->second.value;
  }

  static PlotPoints LargestDifferences(const Trace& measured, const Trace& truth,
                                       const std::vector<std::string>& drives) {
    PlotPoints largest;
    for (const std::string& drive : drives) {
      const int a = measured.Find(Quantity::kForce, drive);
      const int b = truth.Find(Quantity::kForce, drive);
      if (a < 0 || b < 0) continue;
      const PlotPoints own = DifferencesOf(measured, a, truth, b);
      if (largest.empty()) largest = own;
      for (size_t i = 0; i < own.size(); ++i) {
        largest[i].second = std::fmax(largest[i].second, own[i].second);
      }
    }
    return largest;
  }

  void ForceFigures() {
    for (const SharedAxis& axis : ByUnit(line_->trace, Quantity::kForce, report_.drives)) {
      const bool turns = Turns(axis.unit);
      ForEachPart(turns ? "drive_torques" : "drive_forces", axis.subjects,
                  [&](const std::string& name, const std::vector<std::string>& drives) {
                    ForceFigure(name, drives, axis.unit);
                  });
    }
    if (set_.figures.empty()) LeaveOut("drive forces: no witness gives any");
  }

  void ForceFigure(const std::string& name, const std::vector<std::string>& drives,
                   const std::string& si) {
    double largest = 0;
    for (const std::string& drive : drives) {
      largest = std::max(largest, mbv::LargestOf(report_, ChannelName(Quantity::kForce, drive)));
    }
    const ShownUnit unit = UsualUnit(si, largest);
    const std::string symbol = Turns(si) ? "τ" : "F";
    Figure figure{.name = name, .common_x = true};
    figure.panels.push_back(DrivePanel(Quantity::kForce, "*" + symbol + "*", drives, unit, true));
    figure.panels[0].y.label =
        AxisLabel(In(Turns(si) ? FigureWord::kDriveTorque : FigureWord::kDriveForce),
                  "*" + symbol + "*", unit.shown);
    const ShownUnit plain = UsualUnit(si, 1.0);
    FigurePanel differences = DifferencePanel(drives, plain);
    differences.y.label = AxisLabel("", "max |Δ*" + symbol + "*|", plain.shown);
    if (differences.curves.empty()) {
      LeaveOut(name + ": no difference to show, all are zero or no pair was compared");
    } else {
      figure.panels.push_back(std::move(differences));
    }
    set_.figures.push_back(std::move(figure));
  }

  void MotionFigures() {
    for (const SharedAxis& axis : ByUnit(line_->trace, Quantity::kPosition, report_.drives)) {
      const bool turns = axis.unit == "rad";
      ForEachPart(turns ? "drive_angles" : "drive_strokes", axis.subjects,
                  [&](const std::string& name, const std::vector<std::string>& drives) {
                    MotionFigure(name, drives, turns);
                  });
    }
  }

  void MotionFigure(const std::string& name, const std::vector<std::string>& drives, bool turns) {
    Figure figure{.name = name, .common_x = true};
    const auto add = [&](Quantity quantity, const std::string& si, FigureWord word,
                         const char* symbol) {
      double largest = 0;
      for (const std::string& drive : drives) {
        largest = std::max(largest, mbv::LargestOf(report_, ChannelName(quantity, drive)));
      }
      const ShownUnit unit = UsualUnit(si, largest);
      FigurePanel panel = DrivePanel(quantity, symbol, drives, unit, figure.panels.empty());
      panel.y.label = AxisLabel(In(word), symbol, unit.shown);
      panel.share = 0.8;
      figure.panels.push_back(std::move(panel));
    };
    add(Quantity::kPosition, turns ? "rad" : "m",
        turns ? FigureWord::kDriveAngle : FigureWord::kDriveStroke, turns ? "*φ*" : "*q*");
    add(Quantity::kVelocity, turns ? "rad/s" : "m/s",
        turns ? FigureWord::kDriveRate : FigureWord::kDriveSpeed, turns ? "*ω*" : "*v*");
    set_.figures.push_back(std::move(figure));
  }

  // Joints whose reactions are largest, among those that statics leaves nothing open of.
  std::vector<const JointLoad*> LargestJoints(const std::vector<JointLoad>& loads) {
    std::vector<const JointLoad*> joints;
    size_t open = 0;
    for (const JointLoad& load : loads) {
      if (load.witness != loads.front().witness) continue;
      open += load.not_unique ? 1 : 0;
      if (!load.not_unique && std::isfinite(load.force.peak)) joints.push_back(&load);
    }
    std::ranges::stable_sort(joints, [](const JointLoad* a, const JointLoad* b) {
      return std::abs(a->force.peak) > std::abs(b->force.peak);
    });
    const size_t known = joints.size();
    joints.resize(std::min(known, kMostCurves - 2));
    if (open > 0) LeaveOut(fmt::format("reactions: {} joints that statics leaves open", open));
    if (joints.size() < known) {
      LeaveOut(
          fmt::format("reactions: the {} largest of {} joints are shown", joints.size(), known));
    }
    return joints;
  }

  void Reactions() {
    const LoadFigures loads = LoadFiguresOf(report_);
    if (loads.joints.empty()) return LeaveOut("reactions: none is recorded");
    const std::vector<const JointLoad*> joints = LargestJoints(loads.joints);
    if (joints.empty()) return;
    const Trace* trace = TraceOf(report_, joints.front()->witness);
    Figure figure{.name = "reactions", .common_x = true};
    for (const int first : {0, 3}) {
      std::vector<PlotPoints> curves;
      for (const JointLoad* load : joints) {
        const VecX values = ReactionMagnitude(*trace, load->joint, first).values;
        curves.push_back(values.size() > 0 ? OverTime(*trace, values) : PlotPoints());
      }
      const double largest = LargestOf(curves);
      // Moments of ball joints are nothing but round-off.
      if (first == 3 && largest < 1e-9 * largest_force_) continue;
      if (first == 0) largest_force_ = largest;
      const ShownUnit unit = UsualUnit(first == 0 ? "N" : "N m", largest);
      FigurePanel panel{.x = TimeAxis(), .share = 0.8};
      for (size_t j = 0; j < joints.size(); ++j) {
        panel.curves.push_back({.label = first == 0 ? AsPlainText(joints[j]->joint) : "",
                                .points = Scaled(Thinned(curves[j], kFigureBins), time_, unit),
                                .look = static_cast<int>(j)});
      }
      panel.y.label =
          AxisLabel(In(first == 0 ? FigureWord::kReactionForce : FigureWord::kReactionMoment),
                    first == 0 ? "|*F*|" : "|*M*|", unit.shown);
      figure.panels.push_back(std::move(panel));
    }
    set_.figures.push_back(std::move(figure));
  }

  // Curves in one unit, with the axis' label.
  FigurePanel Together(const std::vector<PlotPoints>& curves, const std::vector<std::string>& names,
                       const std::string& si, FigureWord word, const char* symbol) const {
    const ShownUnit unit = UsualUnit(si, LargestOf(curves));
    FigurePanel panel{.x = TimeAxis(), .share = 0.8};
    for (size_t k = 0; k < curves.size(); ++k) {
      panel.curves.push_back({.label = names[k],
                              .points = Scaled(Thinned(curves[k], kFigureBins), time_, unit),
                              .look = static_cast<int>(k)});
    }
    panel.y.label = AxisLabel(In(word), symbol, unit.shown);
    return panel;
  }

  void PowerEnergy() {
    Figure figure{.name = "power_energy", .common_x = true};
    std::vector<PlotPoints> powers;
    std::vector<std::string> names;
    VecX total = VecX::Zero(static_cast<Eigen::Index>(line_->trace.time_s.size()));
    for (const std::string& drive : report_.drives) {
      const int force = line_->trace.Find(Quantity::kForce, drive);
      const int rate = line_->trace.Find(Quantity::kVelocity, drive);
      if (force < 0 || rate < 0) continue;
      const VecX power = line_->trace.values.col(force).cwiseProduct(line_->trace.values.col(rate));
      total += power;
      powers.push_back(OverTime(line_->trace, power));
      names.push_back(NameOf(drive, "*P*"));
    }
    const bool sum_only = powers.size() >= kMostCurves;
    if (sum_only) {
      LeaveOut(fmt::format("power_energy: of {} drives the sum alone", powers.size()));
      powers.clear();
      names.clear();
    }
    if (powers.size() > 1 || sum_only) {
      powers.push_back(OverTime(line_->trace, total));
      names.push_back(In(FigureWord::kTotal));
    }
    if (!powers.empty()) {
      figure.panels.push_back(Together(powers, names, "W", FigureWord::kPower, "*P*"));
    }
    AddEnergies(&figure);
    if (!figure.panels.empty()) set_.figures.push_back(std::move(figure));
  }

  void AddEnergies(Figure* figure) const {
    for (const WitnessRecord* witness : ShownWitnesses(report_)) {
      if (witness->trace.Find(Quantity::kKineticEnergy) < 0) continue;
      std::vector<PlotPoints> energies;
      std::vector<std::string> names;
      for (const auto& [quantity, word] :
           {std::pair{Quantity::kKineticEnergy, FigureWord::kKinetic},
            {Quantity::kGravityEnergy, FigureWord::kGravity},
            {Quantity::kSpringEnergy, FigureWord::kSprings}}) {
        const int column = witness->trace.Find(quantity);
        if (column < 0) continue;
        VecX values = witness->trace.values.col(column);
        if (quantity == Quantity::kGravityEnergy) values.array() -= values[0];
        if (values.isZero(0)) continue;
        energies.push_back(OverTime(witness->trace, values));
        names.push_back(In(word));
      }
      if (energies.empty()) return;
      figure->panels.push_back(Together(energies, names, "J", FigureWord::kEnergy, "*E*"));
      return;
    }
  }

  void ForceOverSpeed() {
    for (const SharedAxis& axis : ByUnit(line_->trace, Quantity::kForce, report_.drives)) {
      ForEachPart(Turns(axis.unit) ? "torque_speed" : "force_speed", axis.subjects,
                  [&](const std::string& name, const std::vector<std::string>& drives) {
                    Cloud(name, drives, axis.unit);
                  });
    }
  }

  void Cloud(const std::string& name, const std::vector<std::string>& drives,
             const std::string& si) {
    const Trace& trace = line_->trace;
    double force = 0, speed = 0;
    for (const std::string& drive : drives) {
      force = std::max(force, mbv::LargestOf(report_, ChannelName(Quantity::kForce, drive)));
      speed = std::max(speed, mbv::LargestOf(report_, ChannelName(Quantity::kVelocity, drive)));
    }
    if (!(speed > 0)) return LeaveOut(name + ": nothing moves");
    const bool turns = Turns(si);
    const ShownUnit y = UsualUnit(si, force), x = UsualUnit(turns ? "rad/s" : "m/s", speed);
    FigurePanel panel;
    for (size_t d = 0; d < drives.size(); ++d) {
      const int f = trace.Find(Quantity::kForce, drives[d]);
      const int v = trace.Find(Quantity::kVelocity, drives[d]);
      if (f < 0 || v < 0) continue;
      FigurePoints points;
      const Eigen::Index stride = 1 + trace.values.rows() / static_cast<Eigen::Index>(kFigureBins);
      for (Eigen::Index i = 0; i < trace.values.rows(); i += stride) {
        points.emplace_back(x.factor * trace.values(i, v), y.factor * trace.values(i, f));
      }
      panel.curves.push_back(
          {.label = drives.size() > 1 ? NameOf(drives[d], turns ? "*τ*" : "*F*") : "",
           .points = points,
           .look = static_cast<int>(d)});
    }
    panel.x.label = AxisLabel(In(turns ? FigureWord::kDriveRate : FigureWord::kDriveSpeed),
                              turns ? "*ω*" : "*v*", x.shown);
    panel.y.label = AxisLabel(In(turns ? FigureWord::kDriveTorque : FigureWord::kDriveForce),
                              turns ? "*τ*" : "*F*", y.shown);
    set_.figures.push_back({.name = name, .panels = {std::move(panel)}});
  }

  const Report& report_;
  const Language language_;
  const WitnessRecord* line_;
  ShownUnit time_;
  double largest_force_ = 0;
  FigureSet set_;
};

}  // namespace

FigureSet DefaultFigures(const Report& report, Language language) {
  return FigureMaker(report, language).Make();
}

}  // namespace mbv
