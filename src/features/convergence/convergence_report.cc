#include "features/convergence/converge.h"

#include <fmt/format.h>
#include <cmath>

#include "base/json_text.h"
#include "base/text.h"
#include "plot/svg_plot.h"
#include "report/page.h"

namespace mbv {
namespace {

using Json = nlohmann::ordered_json;

constexpr const char* kConvergenceSchema = "mbverify.convergence/1";

Json PairJson(const ErrorPair& pair) {
  return {{"smooth", Number(pair.smooth)}, {"breaks", Number(pair.breaks)}};
}

Json FitJson(const OrderFit& fit) {
  Json pairwise = Json::array();
  for (const double order : fit.pairwise) pairwise.push_back(Number(order));
  return {{"order", Number(fit.order)},
          {"order_error", Number(fit.order_error)},
          {"pairwise", std::move(pairwise)},
          {"fitted", fit.fitted},
          {"floor", fit.floor}};
}

Json PointJson(const ConvergencePoint& p) {
  Json json = {{"step_s", p.step_s},
               {"time_constant_s", p.time_constant_s},
               {"steps", p.steps},
               {"cpu_s", Number(p.cpu_s)},
               {"closure_max_m", Number(p.closure_m)},
               {"pose_max_m", Number(p.pose_m)},
               {"error", PairJson(p.error)},
               {"change", PairJson(p.change)}};
  if (!p.failure.empty()) json["failure"] = p.failure;
  return json;
}

Json SeriesJson(const ConvergenceSeries& series) {
  Json points = Json::array();
  for (const ConvergencePoint& point : series.points) points.push_back(PointJson(point));
  return {
      {"name", series.name},
      {"title", series.title},
      {"judged", series.verdict.judged},
      {"finding", series.verdict.finding},
      {"text", series.verdict.text},
      {"notes", series.notes},
      {"order_of", series.by_changes ? "changes" : "errors"},
      {"samples", series.smooth ? "smooth" : "near breaks"},
      {"expected", {series.expected.lowest, series.expected.highest}},
      {"fit", FitJson(series.fit)},
      {"breaks_fit", FitJson(series.breaks_fit)},
      {"pose",
       {{"expected", {Number(series.expected_pose.lowest), Number(series.expected_pose.highest)}},
        {"finding", series.pose_verdict.finding},
        {"text", series.pose_verdict.text},
        {"fit", FitJson(series.pose_fit)}}},
      {"points", std::move(points)}};
}

Json ExtrapolationJson(const ForceExtrapolation& e) {
  Json drives = Json::array();
  for (const ExtrapolatedDrive& d : e.drives) {
    drives.push_back({{"drive", d.drive},
                      {"unit", d.unit},
                      {"rms", Number(d.rms)},
                      {"uncertainty", Number(d.uncertainty)},
                      {"error", Number(d.error)}});
  }
  return {{"coarse_step_s", Number(e.coarse_s)},
          {"fine_step_s", Number(e.fine_s)},
          {"order", Number(e.richardson.order)},
          {"safety", Number(e.richardson.safety)},
          {"grid_convergence_index", Number(e.index)},
          {"error", Number(e.error)},
          {"allowed", Number(e.allowed)},
          {"pass", e.pass},
          {"drives", std::move(drives)}};
}

using Abscissa = double (*)(const ConvergencePoint&);
double StepOf(const ConvergencePoint& p) { return p.step_s; }
double ConstantOf(const ConvergencePoint& p) { return p.time_constant_s; }
double CpuOf(const ConvergencePoint& p) { return p.cpu_s; }

// C x^order through the coarsest fitted point, over the range of the series.
PlotLine SlopeLine(const ConvergenceSeries& series, Abscissa x, double order,
                   const std::string& label) {
  PlotLine line{.label = label};
  const auto at = static_cast<size_t>(series.fit.first_fitted());
  const double error = JudgedErrors(series)[at];
  for (const ConvergencePoint* p : {&series.points.front(), &series.points.back()}) {
    line.points.emplace_back(x(*p), error * std::pow(x(*p) / x(series.points[at]), order));
  }
  return line;
}

void AddSeries(const ConvergenceSeries& series, Abscissa x, LinePlot* plot) {
  PlotLine line{.label = series.title, .markers = true};
  if (series.by_changes) line.label += " (changes)";
  const std::vector<double> errors = JudgedErrors(series);
  for (size_t i = 0; i < errors.size(); ++i)
    line.points.emplace_back(x(series.points[i]), errors[i]);
  plot->lines.push_back(std::move(line));
}

// Fitted and expected slopes; `sign` is −1 where the abscissa grows with finer steps.
void AddSlopes(const ConvergenceSeries& series, Abscissa x, double sign, LinePlot* plot) {
  if (series.fit.first_fitted() < 0) return;
  const char* engine = series.stock ? "stock" : "corrected";
  plot->lines.push_back(SlopeLine(series, x, sign * series.fit.order,
                                  fmt::format("{}: fitted {:.2f}", engine, series.fit.order)));
  plot->lines.push_back(SlopeLine(series, x, sign * series.expected.lowest,
                                  fmt::format("{}: expected {}", engine, ToText(series.expected))));
}

}  // namespace

std::string ToCsv(const ConvergenceReport& report) {
  std::string text =
      "series,engine,step_s,time_constant_s,steps,cpu_s,closure_max_m,pose_max_m,error_smooth,"
      "error_breaks,change_smooth,change_breaks,pairwise_order,fitted,floor\n";
  for (const ConvergenceSeries& series : report.series) {
    for (size_t i = 0; i < series.points.size(); ++i) {
      const ConvergencePoint& p = series.points[i];
      text += fmt::format("{},{},{:.17g},{:.17g},{},{:.6g},", CsvCell(series.name),
                          series.stock ? "stock" : "corrected", p.step_s, p.time_constant_s,
                          p.steps, p.cpu_s);
      for (const double value : {p.closure_m, p.pose_m, p.error.smooth, p.error.breaks,
                                 p.change.smooth, p.change.breaks, series.fit.pairwise[i]}) {
        text += fmt::format("{:.17g},", value);
      }
      text += fmt::format("{:d},{:d}\n", static_cast<bool>(series.fit.fitted[i]),
                          static_cast<bool>(series.fit.floor[i]));
    }
  }
  return text;
}

std::string ToJson(const ConvergenceReport& report) {
  Json series = Json::array();
  for (const ConvergenceSeries& s : report.series) series.push_back(SeriesJson(s));
  const Json json = {{"schema", kConvergenceSchema},
                     {"scenario", report.scenario},
                     {"mechanism", report.mechanism},
                     {"verdict", report.finding() ? "finding" : "as_expected"},
                     {"sample_s", Number(report.sample_s)},
                     {"duration_s", Number(report.duration_s)},
                     {"window_s", Number(report.window_s)},
                     {"breaks", report.breaks},
                     {"samples", report.samples},
                     {"smooth_samples", report.smooth_samples},
                     {"series", std::move(series)},
                     {"extrapolation", ExtrapolationJson(report.extrapolation)}};
  return Dump(json);
}

std::vector<std::pair<std::string, std::string>> ConvergencePlots(const ConvergenceReport& report) {
  const std::string name = report.mechanism + " / " + report.scenario;
  const auto plot = [&](const char* against, const char* x_label) {
    return LinePlot{.title = name + ": force error against " + against,
                    .x_label = x_label,
                    .y_label = "drive-force error, RMS / RMS force",
                    .log_x = true,
                    .log_y = true};
  };
  LinePlot step = plot("step", "step [s]"), cpu = plot("processor time", "processor time [s]"),
           constant = plot("constraint time constant", "time constant [s]");
  for (const ConvergenceSeries& series : report.series) {
    if (series.knob == Knob::kTimeConstant) {
      AddSeries(series, ConstantOf, &constant);
      AddSlopes(series, ConstantOf, 1.0, &constant);
      continue;
    }
    AddSeries(series, StepOf, &step);
    if (series.knob != Knob::kBoth) continue;
    AddSlopes(series, StepOf, 1.0, &step);
    AddSeries(series, CpuOf, &cpu);
    AddSlopes(series, CpuOf, -1.0, &cpu);
  }
  return {{"error_step.svg", ToSvg(step)},
          {"error_time_constant.svg", ToSvg(constant)},
          {"error_cpu.svg", ToSvg(cpu)}};
}

namespace {

const char* VerdictOf(const ConvergenceSeries& series) {
  if (series.verdict.finding || series.pose_verdict.finding) return "FINDING";
  return series.verdict.judged ? "ok" : "-";
}

std::string SeriesText(const ConvergenceSeries& series) {
  std::string text = fmt::format("\n{}: {}\n  {} (of the {})\n", series.title, VerdictOf(series),
                                 series.verdict.text, series.by_changes ? "changes" : "errors");
  if (!std::isnan(series.expected_pose.lowest)) {
    text += fmt::format("  {} (of the poses)\n", series.pose_verdict.text);
  }
  for (const std::string& note : series.notes) text += "  note: " + note + "\n";
  Table table{.columns = {Digits("step s"), Digits("constant s"), Digits("steps"), Digits("cpu s"),
                          Digits("smooth"), Digits("breaks"), Digits("change"), Digits("order"),
                          Digits("pose m"), Digits("gap m")}};
  for (size_t i = 0; i < series.points.size(); ++i) {
    const ConvergencePoint& p = series.points[i];
    std::vector<Cell>& row = table.rows.emplace_back();
    row = {fmt::format("{:.4g}", p.step_s), fmt::format("{:.4g}", p.time_constant_s)};
    if (!p.failure.empty()) {
      row.emplace_back("no result");
      continue;
    }
    row.emplace_back(fmt::format("{}", p.steps));
    row.emplace_back(fmt::format("{:.3f}", p.cpu_s));
    for (const double value : {p.error.smooth, p.error.breaks, p.change.smooth}) {
      row.emplace_back(NumberOrDash(value));
    }
    row.emplace_back(NumberOrDash(series.fit.pairwise[i], "{:.2f}"));
    row.emplace_back(NumberOrDash(p.pose_m));
    row.emplace_back(NumberOrDash(p.closure_m));
  }
  return text + ToText(table);
}

std::string ExtrapolationText(const ForceExtrapolation& e) {
  std::string text = "\nforces at step zero: ";
  if (std::isnan(e.fine_s)) {
    text += "nothing to extrapolate, the finest run is taken\n";
  } else {
    text += fmt::format(
        "from steps {:g} s and {:g} s with order {:.2f} and safety factor {:g}: grid convergence "
        "index {:.1e} of the RMS force\n",
        e.coarse_s, e.fine_s, e.richardson.order, e.richardson.safety, e.index);
    Table table{.columns = {Text("drive"), Digits("RMS force"), Digits("uncertainty"),
                            Digits("from inverse mode")}};
    for (const ExtrapolatedDrive& d : e.drives) {
      table.rows.push_back({d.drive, fmt::format("{:.9g} {}", d.rms, d.unit),
                            fmt::format("{:.1e}", d.uncertainty), fmt::format("{:.1e}", d.error)});
    }
    text += ToText(table);
  }
  return text + fmt::format("  inverse mode: {:.1e} off (allowed {:.1e}): {}\n", e.error, e.allowed,
                            e.pass ? "ok" : "FINDING");
}

}  // namespace

std::string ToText(const ConvergenceReport& report) {
  std::string text = fmt::format(
      "{} / {}: {}\n"
      "  drive forces against inverse mode, RMS over the RMS force, every {:g} s; {} of {} samples "
      "are smooth,\n  the others follow the start or one of {} breaks within {:g} s\n",
      report.mechanism, report.scenario, report.finding() ? "FINDING" : "ORDERS AS EXPECTED",
      report.sample_s, report.smooth_samples, report.samples, report.breaks, report.window_s);
  for (const ConvergenceSeries& series : report.series) text += SeriesText(series);
  return text + ExtrapolationText(report.extrapolation);
}

}  // namespace mbv
