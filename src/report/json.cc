#include "report/json_number.h"
#include "report/load_figures.h"
#include "report/report.h"

namespace mbv {
namespace {

using Json = nlohmann::ordered_json;

constexpr const char* kSummarySchema = "mbverify.summary/1";

Json ChecksJson(const Comparison& comparison) {
  Json checks = Json::array();
  for (const CheckResult& check : comparison.checks) {
    if (!check.limit) continue;
    checks.push_back({{"name", check.name},
                      {"value", Number(check.value)},
                      {"limit", *check.limit},
                      {"pass", check.pass},
                      {"verifies", !check.follows},
                      {"time_s", Number(check.time_s)},
                      {"channel", check.channel}});
    if (check.stated_limit) {
      checks.back()["stated_limit"] = *check.stated_limit;
      checks.back()["limit_by"] = check.limit_by;
    }
    if (check.floored) checks.back()["floored"] = true;
    if (!check.blind.empty()) checks.back()["verifies_nothing"] = check.blind;
  }
  return checks;
}

Json TableColumnJson(const TableColumnResult& column) {
  return {{"standard", Number(column.standard)},
          {"bound", Number(column.bound)},
          {"rms", Number(column.rms)},
          {"error_rms", Number(column.error_rms)},
          {"error_max", Number(column.error_max)},
          {"time_s", Number(column.time_s)},
          {"tube_rms", Number(column.tube_rms)},
          {"tube_max", Number(column.tube_max)},
          {"samples", column.samples},
          {"inside", column.inside()}};
}

// The table in the reference's place: what it is, how sure it is, and how each column was judged by
// each witness. A tube that is switched off is null.
Json ReferenceTableJson(const Comparison& comparison) {
  const TableVerdict& table = *comparison.table;
  Json columns = Json::array();
  for (size_t c = 0; c < table.columns.size(); ++c) {
    const TableColumn& column = table.columns[c];
    const TableUncertainty& parts = table.uncertainty[c];
    Json json = {{"signal", column.channel.name},
                 {"unit", column.channel.unit},
                 {"column", column.heading},
                 {"file_unit", column.unit},
                 {"factor", Number(column.factor)},
                 {"shift", Number(column.shift)},
                 {"uncertainty",
                  {{"stated", parts.stated},
                   {"digits", Number(parts.digits)},
                   {"noise", Number(parts.noise)},
                   {"time_stamps", Number(parts.stamps)},
                   {"interpolation", Number(parts.interpolation)}}}};
    Json judged = Json::object();
    for (const PairComparison& pair : comparison.pairs) {
      for (const TableColumnResult& result : pair.columns) {
        if (result.column == c) judged[pair.name()] = TableColumnJson(result);
      }
    }
    json["judged"] = std::move(judged);
    columns.push_back(std::move(json));
  }
  return {{"name", table.name},
          {"grid", table.grid},
          {"coverage", Number(table.coverage)},
          {"judged_against", table.judged_against},
          {"too_coarse", table.too_coarse},
          {"diagnoses", table.diagnoses},
          {"notes", table.notes},
          {"columns", std::move(columns)}};
}

Json ChecksOffJson(const Comparison& comparison) {
  Json checks = Json::array();
  for (const CheckResult& check : comparison.checks) {
    if (!check.limit) checks.push_back({{"name", check.name}, {"value", Number(check.value)}});
  }
  return checks;
}

Json DrivesJson(const PairComparison& pair) {
  Json drives = Json::array();
  for (const DriveMetrics& drive : pair.drives) {
    drives.push_back({{"drive", drive.drive},
                      {"unit", drive.unit},
                      {"rms", Number(drive.rms_truth)},
                      {"rms_measured", Number(drive.rms_measured)},
                      {"nrmse", Number(drive.nrmse)},
                      {"max_error", Number(drive.max_error)},
                      {"max_rel", Number(drive.max_relative)},
                      {"matching_digits", Number(drive.digits)},
                      {"floored", drive.floored},
                      {"time_s", Number(drive.time_s)}});
  }
  return drives;
}

void AddMetrics(const std::map<Metric, Measured>& metrics, Json* json) {
  for (const auto& [metric, measured] : metrics) {
    (*json)[RowOf(metric).json] = Number(measured.value);
  }
}

// A pair's metrics, and with them what its first witness shows by itself (closure, power, …).
Json MetricsJson(const Comparison& comparison) {
  Json all = Json::object();
  for (const PairComparison& pair : comparison.pairs) {
    if (!pair.compared) continue;
    Json json = Json::object();
    AddMetrics(pair.metrics, &json);
    for (const WitnessMetrics& witness : comparison.witnesses) {
      if (witness.witness == pair.measured) AddMetrics(witness.metrics, &json);
    }
    json["matching_digits"] = Number(pair.digits);
    const auto nrmse = pair.metrics.find(Metric::kForceNrmse);
    json["floored"] = nrmse != pair.metrics.end() && nrmse->second.floored;
    json["samples"] = pair.samples;
    json["force_samples"] = pair.force_samples;
    const auto force = pair.metrics.find(Metric::kForceMax);
    if (force != pair.metrics.end()) {
      json["worst"] = {{"channel", force->second.channel},
                       {"time_s", Number(force->second.time_s)}};
    }
    json["drives"] = DrivesJson(pair);
    json["reactions"] = pair.reactions;
    all[pair.name()] = std::move(json);
  }
  return all;
}

Json EnergyJson(const EnergyAudit& audit) {
  Json parts = Json::array();
  for (const EnergyPart& part : audit.parts) {
    parts.push_back({{"name", part.name},
                     {"kind", part.stored ? "stored" : "work"},
                     {"end_J", Number(part.end_J)},
                     {"most_J", Number(part.most_J)}});
  }
  Json drift = {{"largest_J", Number(audit.drift_J)},    {"end_J", Number(audit.end_drift_J)},
                {"relative", Number(audit.drift.value)}, {"time_s", Number(audit.drift.time_s)},
                {"from_s", Number(audit.from_s)},        {"part", audit.culprit},
                {"share", Number(audit.share)},          {"text", audit.text}};
  return {{"parts", std::move(parts)},
          {"work_integrated", audit.integrated},
          {"turned_over_J", Number(audit.scale_J)},
          {"drift", std::move(drift)}};
}

Json WitnessesJson(const Report& report) {
  Json witnesses = Json::array();
  for (const WitnessRecord& record : report.witnesses) {
    Json json = {{"name", record.name},
                 {"ran", record.summary.ok()},
                 {"stop", ToText(record.summary.stop)},
                 {"message", record.summary.message}};
    if (!record.summary.ok() && record.summary.stop != Stop::kNotRun) {
      json["time_s"] = Number(record.summary.time_s);
      json["where"] = record.summary.where;
      json["amount"] = Number(record.summary.amount);
      json["unit"] = record.summary.unit;
    }
    for (const WitnessMetrics& metrics : report.comparison.witnesses) {
      if (metrics.witness != record.name) continue;
      AddMetrics(metrics.metrics, &json);
      if (metrics.energy) json["energy"] = EnergyJson(*metrics.energy);
    }
    witnesses.push_back(std::move(json));
  }
  return witnesses;
}

Json FiguresJson(const Figures& figures) {
  return {{"unit", figures.unit},
          {"peak", Number(figures.peak)},
          {"peak_time_s", Number(figures.time_s)},
          {"rms", Number(figures.rms)},
          {"mean", Number(figures.mean)}};
}

Json LoadsJson(const Report& report) {
  const LoadFigures loads = LoadFiguresOf(report);
  Json drives = Json::array(), joints = Json::array();
  for (const DriveLoad& load : loads.drives) {
    Json json = {
        {"drive", load.drive}, {"witness", load.witness}, {"force", FiguresJson(load.force)}};
    if (!load.power.unit.empty()) json["power"] = FiguresJson(load.power);
    if (!load.speed.unit.empty()) json["speed"] = FiguresJson(load.speed);
    if (!load.stroke_unit.empty()) {
      json["stroke"] = {{"unit", load.stroke_unit}, {"value", Number(load.stroke)}};
    }
    drives.push_back(std::move(json));
  }
  for (const JointLoad& load : loads.joints) {
    Json json = {{"joint", load.joint}, {"witness", load.witness}};
    if (!load.force.unit.empty()) json["force"] = FiguresJson(load.force);
    if (!load.moment.unit.empty()) json["moment"] = FiguresJson(load.moment);
    json["unique"] = !load.not_unique;
    joints.push_back(std::move(json));
  }
  return {{"drives", std::move(drives)}, {"joints", std::move(joints)}};
}

Json SheetsJson(const std::vector<SignalSheet>& sheets) {
  Json json = Json::array();
  for (const SignalSheet& sheet : sheets) {
    json.push_back({{"signal", sheet.signal},
                    {"unit", sheet.unit},
                    {"acts_on", sheet.acts_on},
                    {"exerted_by", sheet.exerted_by},
                    {"frame", sheet.frame},
                    {"positive", sheet.positive}});
  }
  return json;
}

Json EngineJson(const EngineComparison& engine) {
  Json json = {{"truth", engine.truth}, {"later_s", engine.later_s}};
  for (const EngineError& e : engine.engines) {
    json[e.engine] = {{"force_nrmse", Number(e.force_nrmse)},
                      {"force_nrmse_later", Number(e.force_nrmse_later)},
                      {"force_max_rel", Number(e.force_max_rel)},
                      {"closure_max_m", Number(e.closure_max_m)}};
    if (!e.failure.empty()) json[e.engine]["failure"] = e.failure;
  }
  return json;
}

Json FindingsJson(const Diagnostics& diagnostics) {
  Json json = Json::array();
  for (const Finding& finding : diagnostics.findings()) json.push_back(ToText(finding));
  return json;
}

Json NotComparedJson(const Comparison& comparison) {
  Json json = Json::array();
  for (const NotCompared& item : comparison.not_compared) {
    json.push_back({{"what", item.what}, {"why", item.why}});
  }
  return json;
}

Json CountsJson(const Report& report) {
  size_t ran = 0, compared = 0, limits = 0;
  for (const WitnessRecord& witness : report.witnesses) ran += witness.summary.ok() ? 1 : 0;
  for (const PairComparison& pair : report.comparison.pairs) compared += pair.compared ? 1 : 0;
  for (const CheckResult& check : report.comparison.checks) limits += check.limit ? 1 : 0;
  return {{"witnesses_ran", ran},
          {"pairs_compared", compared},
          {"checks", limits},
          {"checks_verified", report.comparison.verified()},
          {"checks_of_a_motion_with_itself", report.comparison.followed()},
          {"checks_blind", report.comparison.blind()},
          {"checks_off", report.comparison.checks.size() - limits}};
}

Json TimingJson(const Timing& timing) {
  Json json = {{"analytic_s", timing.analytic_s},
               {"reference_s", timing.reference_s},
               {"simulation_s", timing.simulation_s},
               {"render_s", timing.render_s},
               {"stock_s", timing.stock_s},
               {"total_s", timing.total_s},
               {"loop_s", timing.loop_s},
               {"steps", timing.steps}};
  if (timing.loop_s > 0.0) {
    json["steps_per_s"] = static_cast<double>(timing.steps) / timing.loop_s;
  }
  return json;
}

}  // namespace

std::string ToJson(const Report& report) {
  Json json = {{"schema", kSummarySchema},
               {"scenario", report.scenario},
               {"scenario_file", report.scenario_file},
               {"mechanism", report.mechanism},
               {"model_file", report.model_file},
               {"description", report.description},
               {"verdict", ToText(report.comparison.verdict)},
               {"reason", report.comparison.reason},
               {"exit_code", report.exit_code},
               {"reservations", report.comparison.reservations},
               {"attribution",
                {{"odd_one_out", report.comparison.attribution.odd_one_out},
                 {"text", report.comparison.attribution.text}}},
               {"checks", ChecksJson(report.comparison)},
               {"checks_off", ChecksOffJson(report.comparison)},
               {"drives", report.drives},
               {"drives_not_unique", report.drives_not_unique},
               {"metrics", MetricsJson(report.comparison)},
               {"witnesses", WitnessesJson(report)},
               {"not_compared", NotComparedJson(report.comparison)},
               {"counts", CountsJson(report)},
               {"simulation",
                {{"mode", report.mode},
                 {"engine", report.engine},
                 {"step_s", Number(report.step_s)},
                 {"driven_by", report.driven_by},
                 {"driving", report.comparison.driving},
                 {"forces_not_unique", report.simulated_not_unique}}},
               {"duration_s", Number(report.duration_s)},
               {"sample_s", Number(report.sample_s)},
               {"start_window_s", report.start_window_s}};
  if (report.comparison.table) json["reference_table"] = ReferenceTableJson(report.comparison);
  if (report.engine_comparison) json["engine_error"] = EngineJson(*report.engine_comparison);
  json["loads"] = LoadsJson(report);
  json["findings"] = FindingsJson(report.findings);
  json["signals"] = SheetsJson(report.sheets);
  json["pictures"] = report.pictures;
  json["timing"] = TimingJson(report.timing);
  json["versions"] = Json::object();
  for (const auto& [name, version] : report.versions) json["versions"][name] = version;
  return json.dump(2, ' ', false, Json::error_handler_t::replace) + "\n";
}

}  // namespace mbv
