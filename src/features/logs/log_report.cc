#include "features/logs/log_report.h"

#include <fmt/format.h>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "base/roles.h"
#include "base/text.h"
#include "plot/svg_plot.h"
#include "report/plot_points.h"
#include "scenario/tables/table_spline.h"

namespace mbv {
namespace {

using Json = nlohmann::ordered_json;
using Kind = LogTerm::Kind;

constexpr size_t kNamed = 8;          // in a note at most
constexpr size_t kFewestSamples = 6;  // that a spline takes
constexpr double kNoisy = 0.03;       // of the accelerations: the model's forces follow it
constexpr double kAboutOne = 0.3;     // a sign, and what else is wrong
constexpr size_t kScatter = 800;      // points of a drawing without time

// The witness whose forces are the model's: the reference, else a closed form, else the simulation.
const WitnessRecord* ModelOf(const Report& report) {
  for (const Role* role : {&role::kReference, &role::kAnalytic, &role::kSimulated}) {
    for (const WitnessRecord& record : report.witnesses) {
      if (record.name == role->name && record.summary.ok() &&
          record.trace.time_s.size() >= kFewestSamples) {
        return &record;
      }
    }
  }
  return nullptr;
}

class LogComparer {
 public:
  LogComparer(const RobotLog& log, const std::vector<LogAxis>& axes,
              const std::vector<std::string>& names, const std::vector<bool>& shaping,
              const Report& report, double most_delay_s)
      : log_(log),
        axes_(axes),
        names_(names),
        shaping_(shaping),
        report_(report),
        most_delay_s_(most_delay_s) {}

  LogComparison Compare() {
    result_.file = log_.file;
    result_.name = log_.name;
    result_.rows = log_.time_s.size();
    result_.begin_s = log_.begin_s;
    result_.duration_s = log_.time_s.back();
    result_.step_s = log_.step_s;
    result_.even = log_.even;
    result_.notes = log_.notes;
    result_.tables = report_.tables;
    result_.smoothed_forces = report_.smoothed_forces;
    for (const LogSeries& series : log_.series) {
      result_.columns.push_back(
          {SignalOf(series.column), series.column.heading, series.column.unit});
    }
    NoteNoise();
    const WitnessRecord* model = ModelOf(report_);
    if (model == nullptr) return std::move(result_);
    result_.witness = model->name;
    for (const LogSeries& series : log_.series) {
      if (series.column.quantity == LogQuantity::kEffort) {
        AddDrive(series, model->trace);
      } else if (series.column.quantity != LogQuantity::kPosition) {
        AddRate(series, model->trace);
      }
    }
    return std::move(result_);
  }

 private:
  // Least squares takes the model for exact: its noise biases what is fitted.
  void NoteNoise() {
    std::vector<std::string> noisy;
    for (const MotionTable& table : report_.tables) {
      const double share = AccelerationNoise(table) / table.acceleration_rms;
      if (share > kNoisy) noisy.push_back(fmt::format("{} {:.0f} %", table.name, 100.0 * share));
    }
    if (noisy.empty()) return;
    result_.notes.push_back(
        fmt::format("noise is left in the accelerations that the model's forces follow ({}): "
                    "delay, friction and "
                    "inertia may be off by more than their standard errors; smooth more (--cutoff)",
                    Joined(noisy, kNamed)));
  }

  [[nodiscard]] std::string SignalOf(const LogColumn& column) const {
    return axes_[column.axis].name() + "." + kLogQuantities[static_cast<size_t>(column.quantity)];
  }

  // Between samples by a quintic spline through all of them; at samples it has their values.
  static Piecewise SplineOf(const Trace& trace, int column) {
    SplineRows rows{.time_s = trace.time_s};
    const VecX values = trace.values.col(column);
    rows.values.assign(values.begin(), values.end());
    return Interpolated(rows);
  }

  static bool IsFinite(const Trace& trace, int column) {
    return column >= 0 && trace.values.col(column).allFinite();
  }

  void AddDrive(const LogSeries& series, const Trace& trace) {
    const LogAxis& axis = axes_[series.column.axis];
    const bool drive = axis.coordinate.kind == Coordinate::Kind::kDrive;
    const std::string& name = names_[series.column.axis];
    const int force =
        drive ? trace.Find(Quantity::kForce, name) : trace.Find(Quantity::kBaseForce, name);
    const int velocity = trace.Find(Quantity::kVelocity, name);
    if (axis.coordinate.kind == Coordinate::Kind::kJoint) {
      result_.notes.push_back(fmt::format("'{}' is not compared: no drive acts on {}",
                                          series.column.heading, axis.name()));
      return;
    }
    if (!IsFinite(trace, force) || !IsFinite(trace, velocity)) {
      result_.notes.push_back(fmt::format(
          "'{}' is not compared: the model has no force or rate of it", series.column.heading));
      return;
    }
    const Piecewise model = SplineOf(trace, force), rate = SplineOf(trace, velocity);
    const Piecewise band = BandOf(trace, name);
    LogDrive result{.name = axis.name(), .unit = axis.force_unit, .heading = series.column.heading};
    size_t resting = 0;
    const double end_s = trace.time_s.back();
    for (size_t i = 0; i < log_.time_s.size(); ++i) {
      const double t = log_.time_s[i];
      if (std::isnan(series.values[i]) || t > end_s + 1e-9) continue;
      if (!band.knots.empty() && Evaluate(band, t).value > 0.0) {
        ++resting;
        continue;
      }
      result.time_s.push_back(t);
      result.log.push_back(series.values[i]);
      result.model.push_back(Evaluate(model, t).value);
      result.velocity.push_back(Evaluate(rate, t).value);
    }
    if (resting > 0) {
      result_.notes.push_back(fmt::format("{}: {} rows at which friction rests are not compared",
                                          axis.name(), resting));
    }
    result.fit = FitLogForce({.time_s = result.time_s,
                              .log = result.log,
                              .model = &model,
                              .velocity = &rate,
                              .end_s = end_s,
                              .size = axis.size},
                             most_delay_s_);
    result_.drives.push_back(std::move(result));
  }

  // Half-widths of what friction at rest leaves open, held from sample to sample; without knots
  // where there is none.
  static Piecewise BandOf(const Trace& trace, const std::string& name) {
    Piecewise band;
    const int column = trace.Find(Quantity::kForceBand, name);
    if (column < 0 || !(trace.values.col(column).maxCoeff() > 0.0)) return band;
    band.knots = trace.time_s;
    for (size_t i = 0; i + 1 < trace.time_s.size(); ++i) {
      const auto row = static_cast<Eigen::Index>(i);
      band.coefficients.push_back(
          {std::max(trace.values(row, column), trace.values(row + 1, column)), 0, 0, 0, 0, 0});
    }
    return band;
  }

  void AddRate(const LogSeries& series, const Trace& trace) {
    const bool velocity = series.column.quantity == LogQuantity::kVelocity;
    const std::string& name = names_[series.column.axis];
    int column = trace.Find(velocity ? Quantity::kVelocity : Quantity::kAcceleration, name);
    if (column < 0) {
      column = trace.Find(velocity ? Quantity::kJointVelocity : Quantity::kJointAcceleration, name);
    }
    if (!IsFinite(trace, column)) return;
    const Piecewise model = SplineOf(trace, column);
    double own = 0.0, difference = 0.0;
    size_t count = 0;
    for (size_t i = 0; i < log_.time_s.size(); ++i) {
      const double value = series.values[i];
      if (std::isnan(value) || log_.time_s[i] > trace.time_s.back() + 1e-9) continue;
      const double off = value - Evaluate(model, log_.time_s[i]).value;
      own += value * value;
      difference += off * off;
      ++count;
    }
    const auto n = static_cast<double>(count);
    result_.rates.push_back({.signal = SignalOf(series.column),
                             .unit = axes_[series.column.axis].UnitOf(series.column.quantity),
                             .rms = std::sqrt(own / n),
                             .rms_difference = std::sqrt(difference / n),
                             .shapes = velocity && shaping_[series.column.axis]});
  }

  const RobotLog& log_;
  const std::vector<LogAxis>& axes_;
  const std::vector<std::string>& names_;
  const std::vector<bool>& shaping_;
  const Report& report_;
  const double most_delay_s_;
  LogComparison result_;
};

std::string Short(double value) {
  return std::isfinite(value) ? fmt::format("{:.4g}", value) : "–";
}

std::string UnitOfTerm(const LogTerm& term, const std::string& unit) {
  const bool turns = unit == "N m";
  switch (term.kind) {
    case Kind::kGain:
      return "";
    case Kind::kOffset:
    case Kind::kCoulomb:
      return unit;
    case Kind::kDelay:
      return "ms";
    case Kind::kViscous:
      return turns ? "N m s/rad" : "N s/m";
    case Kind::kInertia:
      return turns ? "kg m²" : "kg";
  }
  return "";
}

// "1.020 ± 0.001": the value down to its standard error's second digit.
std::string Estimate(double value, double error, double scale = 1.0) {
  if (!std::isfinite(value)) return "–";
  value *= scale;
  error *= scale;
  constexpr double kFinest = 1e-5;
  if (error < kFinest) {
    return fmt::format("{:.6g} ± {:.0e}", std::abs(value) < kFinest ? 0.0 : value, error);
  }
  int decimals = 4;
  if (error > 0.0 && std::isfinite(error)) {
    decimals = std::clamp(1 - static_cast<int>(std::floor(std::log10(error))), 0, 6);
  }
  return fmt::format("{:.{}f} ± {:.{}f}", value, decimals, error, decimals);
}

std::string TermText(const LogTerm& term, const std::string& unit) {
  const double scale = term.kind == Kind::kDelay ? 1e3 : 1.0;
  const std::string of = UnitOfTerm(term, unit);
  return Estimate(term.value, term.error, scale) + (of.empty() ? "" : " " + of);
}

Cell TermCell(const LogTerm& term) {
  if (!term.fitted) return Cell("–", Mark::kOff);
  const double scale = term.kind == Kind::kDelay ? 1e3 : 1.0;
  return Cell(Estimate(term.value, term.error, scale), term.named ? Mark::kWarn : Mark::kNone);
}

Table DriveTable(const LogComparison& comparison) {
  Table table{.name = "log",
              .caption = "Forces of the drives, by log and by model",
              .columns = {Text("drive"), Text("unit"), Digits("RMS log"), Digits("RMS model"),
                          Digits("RMS difference"), Digits("of the log"), Digits("bias"),
                          Spare(Digits("correlation")), Digits("left by the fit")}};
  for (const LogDrive& drive : comparison.drives) {
    const LogFit& fit = drive.fit;
    table.rows.push_back(
        {drive.name, drive.unit, Short(fit.rms_log), Short(fit.rms_model),
         Short(fit.rms_difference),
         std::isfinite(fit.share()) ? fmt::format("{:.2f} %", 100.0 * fit.share()) : "–",
         Short(fit.bias), Short(fit.correlation), Short(fit.rms_left)});
  }
  return table;
}

Table TermTable(const LogComparison& comparison) {
  Table table{.name = "log_fit",
              .caption = "What the log differs by (± standard error)",
              .columns = {Text("drive"), Digits("gain"), Digits("offset"), Digits("delay [ms]"),
                          Digits("Coulomb"), Digits("viscous"), Digits("inertia")}};
  for (const LogDrive& drive : comparison.drives) {
    std::vector<Cell> row = {drive.name};
    for (const LogTerm& term : drive.fit.terms) row.push_back(TermCell(term));
    table.rows.push_back(std::move(row));
  }
  return table;
}

// What a term means for who looks for the cause.
std::string Sentence(const LogDrive& drive, const LogTerm& term, double step_s) {
  const std::string text = TermText(term, drive.unit);
  switch (term.kind) {
    case Kind::kGain:
      if (std::abs(term.value + 1.0) < kAboutOne) {
        return fmt::format("gain {}: the log has the other sign", text);
      }
      if (term.value < 0.0) {
        return fmt::format("gain {}: the log does not follow the model (loads, parameters: --set)",
                           text);
      }
      return fmt::format(
          "gain {}: the log is this multiple of the model (torque constant, gear, masses)", text);
    case Kind::kOffset:
      return fmt::format("offset {}: zero of the torque sensor, or a weight or spring", text);
    case Kind::kDelay:
      return fmt::format("delay {} ({:.2f} rows): the log's torque comes {}", text,
                         term.value / step_s, term.value > 0.0 ? "late" : "early");
    case Kind::kCoulomb:
      return fmt::format(
          "hint: Coulomb friction {} {}", text,
          term.value > 0.0 ? "that the model does not have" : "less than the model's");
    case Kind::kViscous:
      return fmt::format(
          "hint: viscous friction {} {}", text,
          term.value > 0.0 ? "that the model does not have" : "less than the model's");
    case Kind::kInertia:
      return fmt::format(
          "hint: inertia {} {}", text,
          term.value > 0.0 ? "that the model does not have (a rotor?)" : "less than the model's");
  }
  return "";
}

Items Sentences(const LogComparison& comparison) {
  Items items;
  for (const LogDrive& drive : comparison.drives) {
    if (!std::isfinite(drive.fit.rms_left)) {
      items.texts.push_back(
          fmt::format("{}: no fit: {} rows away from rest and from the ends, or a log of zeros",
                      drive.name, drive.fit.fit_rows));
      continue;
    }
    std::vector<LogTerm> named;
    std::vector<std::string> alike;
    for (const LogTerm& term : drive.fit.terms) {
      if (term.named) named.push_back(term);
      if (!term.fitted) alike.emplace_back(term.word());
    }
    std::ranges::sort(named, std::greater(), &LogTerm::effect);
    for (const LogTerm& term : named) {
      items.texts.push_back(drive.name + ": " + Sentence(drive, term, comparison.step_s));
    }
    if (named.empty()) {
      items.texts.push_back(drive.name + ": nothing beyond 3 standard errors and 0.5 % of the log");
    }
    if (!alike.empty()) {
      items.texts.push_back(fmt::format("{}: this motion does not distinguish {} from the rest",
                                        drive.name, Joined(alike)));
    }
  }
  return items;
}

Table RateTable(const LogComparison& comparison) {
  Table table{.caption = "Rates of the log against those of the motion",
              .columns = {Text("signal"), Text("unit"), Digits("RMS log"), Digits("RMS difference"),
                          Text("the motion follows it")}};
  for (const LogRate& rate : comparison.rates) {
    table.rows.push_back({rate.signal, rate.unit, Short(rate.rms), Short(rate.rms_difference),
                          rate.shapes ? "yes" : "no"});
  }
  return table;
}

Table SmoothingTable(const LogComparison& comparison) {
  Table table{
      .caption = "How positions were made a motion",
      .columns = {Text("of"), Text("smoothing"), Digits("halves [Hz]"), Digits("noise [rad or m]"),
                  Digits("changes positions (RMS)"), Digits("changes accelerations (RMS)"),
                  Digits("noise left in them (RMS)"), Digits("accelerations (RMS)")}};
  for (const MotionTable& motion : comparison.tables) {
    table.rows.push_back({motion.name, motion.smoothing, Short(motion.cutoff_hz),
                          Short(motion.deviation), Short(motion.change_rms),
                          Short(motion.acceleration_change_rms), Short(AccelerationNoise(motion)),
                          Short(motion.acceleration_rms)});
  }
  return table;
}

Table SmoothedForceTable(const LogComparison& comparison) {
  Table table{.caption = "What smoothing takes out of the model's forces",
              .columns = {Text("drive"), Text("unit"), Digits("RMS"), Digits("change, RMS"),
                          Digits("change, largest")}};
  for (const SmoothedForce& force : comparison.smoothed_forces) {
    table.rows.push_back({force.drive, force.unit, Short(force.rms), Short(force.change_rms),
                          Short(force.change_max)});
  }
  return table;
}

Table ColumnTable(const LogComparison& comparison) {
  Table table{.caption = "Columns", .columns = {Text("signal"), Text("column"), Text("unit")}};
  for (const auto& [signal, heading, unit] : comparison.columns) {
    table.rows.push_back({signal, Code(heading), unit});
  }
  return table;
}

PlotPoints Points(const std::vector<double>& x, const std::vector<double>& y) {
  PlotPoints points;
  for (size_t i = 0; i < x.size(); ++i) points.emplace_back(x[i], y[i]);
  return points;
}

std::vector<double> DifferenceOf(const LogDrive& drive) {
  std::vector<double> difference(drive.log.size());
  for (size_t i = 0; i < difference.size(); ++i) difference[i] = drive.log[i] - drive.model[i];
  return difference;
}

void AddPlots(const LogDrive& drive, ReportSection* section) {
  LinePlot both{.title = drive.name + ": log and model",
                .x_label = "t [s]",
                .y_label = fmt::format("force [{}]", drive.unit),
                .lines = {{.label = "log", .points = Thinned(Points(drive.time_s, drive.log))},
                          {.label = "model",
                           .points = Thinned(Points(drive.time_s, drive.model)),
                           .dashed = true}}};
  section->Add(Drawing{ToSvg(both)}, On::kPage);
  const std::vector<double> difference = DifferenceOf(drive);
  LinePlot over_time{.title = drive.name + ": log less model",
                     .x_label = "t [s]",
                     .y_label = fmt::format("difference [{}]", drive.unit),
                     .lines = {{.label = "", .points = Thinned(Points(drive.time_s, difference))}}};
  section->Add(Drawing{ToSvg(over_time)}, On::kPage);
  // Against the rate friction is a step and a slope.
  PlotLine scatter{.label = "", .points = {}, .markers = true};
  const size_t stride = std::max<size_t>(1, difference.size() / kScatter);
  for (size_t i = 0; i < difference.size(); i += stride) {
    scatter.points.emplace_back(drive.velocity[i], difference[i]);
    scatter.points.emplace_back(kNan, kNan);
  }
  LinePlot over_rate{.title = drive.name + ": log less model over the rate",
                     .x_label = drive.unit == "N m" ? "rate [rad/s]" : "rate [m/s]",
                     .y_label = fmt::format("difference [{}]", drive.unit),
                     .lines = {std::move(scatter)}};
  section->Add(Drawing{ToSvg(over_rate)}, On::kPage);
}

std::string HeadLine(const LogComparison& comparison) {
  return fmt::format(
      "Log against model: {}, {} rows, {:.4g} s, {}{:.4g} s apart; model: {}; compared, "
      "not judged",
      comparison.name, comparison.rows, comparison.duration_s, comparison.even ? "" : "about ",
      comparison.step_s, comparison.witness.empty() ? "none ran" : comparison.witness);
}

ReportSection ForceSection(const LogComparison& comparison) {
  ReportSection section{.title = "Log against model", .link = "Log"};
  if (comparison.drives.empty()) {
    section.Add(
        Paragraph{comparison.witness.empty()
                      ? "No witness gave forces: nothing is compared."
                      : "The log has no forces that are compared: it gives the motion only."});
    return section;
  }
  section.Add(DriveTable(comparison));
  section.Add(TermTable(comparison));
  section.Add(Sentences(comparison));
  section.Note(
      "Fitted together by least squares: log = gain · model(t − delay) + offset + Coulomb · "
      "sign(v) "
      "+ viscous · v + inertia · a. Standard errors count the correlation of what is left in time. "
      "Rows near rest (1 % of the fastest rate) are left out of the fit. What is named changes at "
      "least 0.5 % of the log's RMS, by 3 standard errors. Friction and inertia are hints: wrong "
      "masses, a wrong zero or a slow sensor can look alike.");
  return section;
}

}  // namespace

double AccelerationNoise(const MotionTable& table) {
  if (table.with_rates || !std::isfinite(table.cutoff_hz)) return kNan;
  constexpr double kFilter = std::numbers::pi / 18.0;
  const double step_s = (table.to_s - table.from_s) / static_cast<double>(table.rows - 1);
  return table.deviation * std::sqrt(2.0 * step_s * kFilter) * std::pow(2.0 * std::numbers::pi, 2) *
         std::pow(table.cutoff_hz, 2.5);
}

LogComparison CompareLog(const RobotLog& log, const std::vector<LogAxis>& axes,
                         const std::vector<std::string>& names, const std::vector<bool>& shaping,
                         const Report& report, double most_delay_s) {
  return LogComparer(log, axes, names, shaping, report, most_delay_s).Compare();
}

double LargestShare(const LogComparison& comparison) {
  constexpr double kAll = std::numeric_limits<double>::infinity();
  double largest = comparison.drives.empty() ? kAll : 0.0;
  for (const LogDrive& drive : comparison.drives) {
    const double share = drive.fit.rms_difference == 0.0 ? 0.0 : drive.fit.share();
    largest = std::isnan(share) ? kAll : std::max(largest, share);
  }
  return largest;
}

std::string ToText(const LogComparison& comparison, const TextStyle& style) {
  std::string text = HeadLine(comparison) + ToText(ForceSection(comparison), style);
  if (!text.ends_with('\n')) text += "\n";
  for (const std::string& note : comparison.notes) text += style.indent + note + "\n";
  return text;
}

Json ToJson(const LogComparison& comparison) {
  Json drives = Json::array(), rates = Json::array(), columns = Json::array();
  for (const LogDrive& drive : comparison.drives) {
    const LogFit& fit = drive.fit;
    Json terms = Json::array();
    for (const LogTerm& term : fit.terms) {
      terms.push_back({{"term", term.word()},
                       {"value", Number(term.value)},
                       {"standard_error", Number(term.error)},
                       {"unit", term.kind == Kind::kDelay ? "s" : UnitOfTerm(term, drive.unit)},
                       {"effect_rms", Number(term.effect)},
                       {"fitted", term.fitted},
                       {"named", term.named}});
    }
    drives.push_back({{"drive", drive.name},
                      {"column", drive.heading},
                      {"unit", drive.unit},
                      {"rows", fit.rows},
                      {"rms_log", Number(fit.rms_log)},
                      {"rms_model", Number(fit.rms_model)},
                      {"rms_difference", Number(fit.rms_difference)},
                      {"share", Number(fit.share())},
                      {"bias", Number(fit.bias)},
                      {"correlation", Number(fit.correlation)},
                      {"fit_rows", fit.fit_rows},
                      {"rms_before_fit", Number(fit.rms_before)},
                      {"rms_left", Number(fit.rms_left)},
                      {"terms", std::move(terms)}});
  }
  for (const LogRate& rate : comparison.rates) {
    rates.push_back({{"signal", rate.signal},
                     {"unit", rate.unit},
                     {"rms", Number(rate.rms)},
                     {"rms_difference", Number(rate.rms_difference)},
                     {"motion_follows_it", rate.shapes}});
  }
  for (const auto& [signal, heading, unit] : comparison.columns) {
    columns.push_back({{"signal", signal}, {"column", heading}, {"unit", unit}});
  }
  return {{"file", comparison.file},
          {"rows", comparison.rows},
          {"begin_s", Number(comparison.begin_s)},
          {"duration_s", Number(comparison.duration_s)},
          {"step_s", Number(comparison.step_s)},
          {"even", comparison.even},
          {"model", comparison.witness},
          {"drives", std::move(drives)},
          {"rates", std::move(rates)},
          {"columns", std::move(columns)},
          {"notes", comparison.notes}};
}

std::vector<std::pair<std::string, std::string>> LogFiles(const LogComparison& comparison,
                                                          const Report& report) {
  Page page;
  page.Add(ForceSection(comparison));
  for (const LogDrive& drive : comparison.drives) {
    ReportSection section{.title = drive.name, .link = drive.name};
    AddPlots(drive, &section);
    page.Add(section);
  }
  ReportSection motion{.title = "The motion", .link = "Motion"};
  motion.Add(SmoothingTable(comparison), On::kPage);
  motion.Add(SmoothedForceTable(comparison), On::kPage);
  motion.Add(RateTable(comparison), On::kPage);
  motion.Note(
      "A quintic smoothing spline of each position has the rates and accelerations that all "
      "computations follow. It passes a sine of frequency f by 1/(1 + (f/f₀)⁶) without delay, f₀ "
      "the frequency that it halves.");
  page.Add(motion);
  ReportSection columns{.title = "The log", .link = "Columns"};
  columns.Add(Items{comparison.notes});
  columns.Add(ColumnTable(comparison), On::kPage);
  page.Add(columns);
  PageHead head{.kicker = "mbverify log",
                .title = report.title(),
                .lead = HeadLine(comparison),
                .judges = false,
                .footer = "report.html beside this page has the verdict on the model."};
  std::string csv = "time_s,drive,log,model,velocity\n";
  for (const LogDrive& drive : comparison.drives) {
    for (size_t i = 0; i < drive.time_s.size(); ++i) {
      csv += fmt::format("{:.17g},{},{:.17g},{:.17g},{:.17g}\n", drive.time_s[i],
                         CsvCell(drive.name), drive.log[i], drive.model[i], drive.velocity[i]);
    }
  }
  Json json = {{"schema", "mbverify.log_comparison/1"}};
  json.update(ToJson(comparison));
  return {{"log.html", page.Write(head)}, {"log.csv", std::move(csv)}, {"log.json", Dump(json)}};
}

}  // namespace mbv
