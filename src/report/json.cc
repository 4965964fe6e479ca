#include "report/report.h"

#include "base/json_text.h"
#include "report/load_figures.h"
#include "report/result.h"
#include "report/sections.h"
#include "report/sizing.h"
#include "report/source_model_report.h"

namespace mbv {

namespace {

using Json = nlohmann::ordered_json;

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
    json["samples_at_rest"] = pair.samples_at_rest;
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

Json WitnessesJson(const Report& report, const ResultView& view) {
  Json witnesses = Json::array();
  for (const WitnessRecord& record : report.witnesses) {
    Json json = WitnessHead(record.name, record.summary);
    AddBreakdown(view, record.summary, &json);
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
  Json unresolved = Json::object();
  for (const auto& [witness, why] : loads.unresolved) unresolved[witness] = why;
  return {{"drives", std::move(drives)},
          {"joints", std::move(joints)},
          {"unresolved", std::move(unresolved)}};
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
  if (engine.friction.empty()) return json;
  json["coulomb_alone"] = engine.coulomb_alone;
  json["friction_text"] = engine.FrictionText();
  for (const FrictionError& e : engine.friction) {
    Json& row = json["friction"].emplace_back();
    row = {{"step_s", Number(e.step_s)}, {"check", e.check},         {"unit", e.unit},
           {"value", Number(e.value)},   {"limit", Number(e.limit)}, {"within", e.within()}};
    if (!e.failure.empty()) row["failure"] = e.failure;
  }
  return json;
}

}  // namespace

std::string ToJson(const Report& report) {
  const ResultView view = ViewOf(report);
  Json json = SummaryHead(view);
  json["drives"] = report.drives;
  json["drives_not_unique"] = report.drives_not_unique;
  json["metrics"] = MetricsJson(report.comparison);
  json["witnesses"] = WitnessesJson(report, view);
  json["not_compared"] = NotComparedJson(view);
  json["counts"] = CountsJson(view);
  json["simulation"] = {{"mode", report.mode},
                        {"engine", report.engine},
                        {"step_s", Number(report.step_s)},
                        {"driven_by", report.driven_by},
                        {"driving", report.comparison.driving},
                        {"forces_not_unique", report.simulated_not_unique}};
  json["duration_s"] = Number(report.duration_s);
  json["sample_s"] = Number(report.sample_s);
  json["start_window_s"] = report.start_window_s;
  if (report.comparison.table) json["reference_table"] = ReferenceTableJson(report.comparison);
  if (!report.tables.empty()) json["motion_tables"] = MotionTableJson(report);
  if (report.engine_comparison) json["engine_error"] = EngineJson(*report.engine_comparison);
  if (report.source_model != nullptr) json["source_model"] = SourceModelJson(*report.source_model);
  for (const ReportPart& part : report.parts) {
    json[part.key] = ParseJson<nlohmann::ordered_json>(part.json);
  }
  json["loads"] = LoadsJson(report);
  if (!report.motors.empty()) json["motors"] = SizingJson(report);
  if (!report.link_loads.empty()) json["dc_link"] = LinkJson(report);
  if (!report.phases.empty()) json["phases"] = PhasesJson(report);
  if (!report.contact_loads.empty()) json["contacts"] = ContactsJson(report);
  if (auto events = EventsJson(report); !events.empty()) json["events"] = std::move(events);
  if (!report.singular.of.empty()) json["singularity"] = SingularityJson(report);
  json["findings"] = FindingsJson(report.findings);
  json["signals"] = SheetsJson(report.sheets);
  json["pictures"] = report.pictures;
  AddSummaryEnd(view, &json);
  return Dump(json);
}

}  // namespace mbv
