#include "features/sheet/sheet.h"

#include <fmt/format.h>
#include <algorithm>
#include <cmath>
#include <functional>
#include <map>
#include <set>
#include <utility>

#include "base/demand.h"
#include "base/files.h"
#include "base/inputs.h"
#include "base/json_document.h"
#include "base/json_text.h"
#include "base/roles.h"
#include "base/sha256.h"
#include "base/text.h"
#include "cli/files.h"
#include "mechanism/mechanism.h"
#include "scenario/load_scenario.h"
#include "verify/check_file.h"
#include "verify/version.h"

namespace mbv {
namespace {

namespace fs = std::filesystem;

std::string Short(double value) { return fmt::format("{:.2g}", value); }
std::string Counted(size_t n, const char* what) {
  return fmt::format("{} {}{}", n, what, n == 1 ? "" : "s");
}
std::string Called(const std::string& witness) {
  const Role* role = FindRole(witness);
  return role == nullptr ? witness : role->called;
}

/// The files of the scenario as they are now.
struct Present {
  std::string scenario_file;
  std::vector<InputFile> inputs;

  [[nodiscard]] bool Has(const std::string& fingerprint) const {
    return std::ranges::any_of(
        inputs, [&](const InputFile& input) { return input.fingerprint == fingerprint; });
  }
  [[nodiscard]] const std::string& scenario() const {
    const auto at = std::ranges::find(inputs, scenario_file, &InputFile::file);
    MBV_DEMAND(at != inputs.end(), scenario_file);
    return at->fingerprint;
  }
};

constexpr const char* kOtherState = "made from another state of ";

// Why what inputs.json belongs to says nothing about the files as they are; "" if it does.
std::string StaleReason(const JsonValue& made, const Present& present) {
  const std::string program = made.value("program", std::string());
  const std::string here = fmt::format("mbverify {}", kVersion);
  if (program != here) {
    return fmt::format("made by {}, this is {}", program.empty() ? "another version" : program,
                       here);
  }
  if (made.contains("set")) {
    for (const auto& [key, value] : made.at("set").items()) {
      return fmt::format("made with --set {}={}", key, value.get<std::string>());
    }
  }
  std::set<std::string> known;
  for (const JsonValue& input : made.at("inputs").list()) {
    const std::string file = input.at("file"), fingerprint = input.at("fingerprint");
    known.insert(fingerprint);
    if (present.Has(fingerprint)) continue;
    const std::optional<std::string> text = ReadWholeFile(file);
    if (!text) return fmt::format("{}{}, which is not there", kOtherState, file);
    if (ContentFingerprint(*text) != fingerprint) return kOtherState + file;
  }
  for (const InputFile& input : present.inputs) {
    if (!known.contains(input.fingerprint)) return kOtherState + input.file;
  }
  return "";
}

using Fill = std::function<void(const JsonValue& document, SheetRow* row)>;

// What a document says, if it is there and about the files as they are. `origin`: StaleReason() of
// it.
void ReadEvidence(const fs::path& document,
                  const std::function<std::string(const JsonValue& document)>& origin,
                  const Fill& fill, SheetRow* row) {
  const std::optional<std::string> text = ReadWholeFile(document);
  if (!text) return;
  SheetRow filled = *row;
  filled.evidence = document.string();
  const auto read = ReadJson(*text, [&](const JsonValue& json) {
    const std::string why = origin(json);
    if (why.empty()) fill(json, &filled);
    return why;
  });
  if (read && read.value->empty()) {
    *row = std::move(filled);
    return;
  }
  row->evidence = document.string();
  row->status = SheetStatus::kStale;
  row->result = read ? "refused: " + *read.value : "cannot be read: " + read.refusal.Text();
}
// With inputs.json beside it.
void ReadResult(const fs::path& document, const Present& present, const Fill& fill, SheetRow* row) {
  ReadEvidence(
      document,
      [&](const JsonValue& /*json*/) -> std::string {
        const fs::path file = document.parent_path() / "inputs.json";
        const std::optional<std::string> text = ReadWholeFile(file);
        if (!text) return "there is no " + file.string();
        const auto read =
            ReadJson(*text, [&](const JsonValue& made) { return StaleReason(made, present); });
        return read ? *read.value : file.string() + ": " + read.refusal.Text();
      },
      fill, row);
}

void Judge(bool pass, SheetRow* row) {
  row->status = pass ? SheetStatus::kDone : SheetStatus::kFailed;
}

// Of `run`.

void FillAgreement(const JsonValue& json, SheetRow* row) {
  const std::string verdict = json.at("verdict"), reason = json.at("reason");
  const JsonValue counts = json.at("counts");
  const size_t checks = counts.at("checks"), verified = counts.at("checks_verified"),
               witnesses = counts.at("witnesses_ran"), pairs = counts.at("pairs_compared");
  size_t failed = 0;
  for (const JsonValue& check : json.at("checks").list()) failed += check.at("pass") ? 0 : 1;
  row->values = {{"verdict", verdict}, {"checks", checks},       {"verified", verified},
                 {"failed", failed},   {"witnesses", witnesses}, {"pairs_compared", pairs}};
  Judge(verdict == "agree" && verified > 0 && pairs > 0, row);
  std::vector<std::string> names;
  for (const JsonValue& witness : json.at("witnesses").list()) {
    if (witness.at("ran")) names.push_back(Called(witness.at("name")));
  }
  row->result = fmt::format("{}: {} computed it, {} compared; {} of {} verify something. {}.",
                            verdict, Joined(names), Counted(pairs, "pair"), verified,
                            Counted(checks, "check"), reason);
}

void FillProof(const JsonValue& json, SheetRow* row) {
  if (!json.contains("certificate")) {
    row->status = SheetStatus::kNotDone;
    row->result = "the run was made without --certify";
    row->evidence.clear();
    return;
  }
  const JsonValue certificate = json.at("certificate");
  if (certificate.contains("why_not") && !std::string(certificate.at("why_not")).empty()) {
    row->status = SheetStatus::kNotApplicable;
    row->result = std::string(certificate.at("why_not"));
    return;
  }
  const size_t proved = certificate.at("proved_samples"),
               samples = certificate.at("samples").list().size();
  const double duration = json.at("duration_s").NumberOrNan(),
               sample = json.at("sample_s").NumberOrNan();
  const auto all = static_cast<size_t>(std::llround(duration / sample)) + 1;
  bool wrong = false;
  std::vector<std::string> digits;
  row->values = {{"proved_samples", proved}, {"samples", samples}, {"samples_of_motion", all}};
  for (const JsonValue& witness : certificate.at("witnesses").list()) {
    const std::string name = witness.at("witness");
    const double error = witness.at("force_error").NumberOrNan();
    const bool off = witness.at("wrong");
    wrong = wrong || off;
    row->values["force_error"][name] = Number(error);
    digits.push_back(fmt::format("{} {}{}", Called(name), Short(error), off ? " (wrong)" : ""));
  }
  Judge(proved == samples && samples > 0 && !wrong, row);
  row->result = fmt::format(
      "drive forces enclosed in interval arithmetic at {} of {} chosen samples ({} in the motion); "
      "numerical error, at most, of the largest drive force: {}.",
      proved, samples, all, Joined(digits));
}

void FillTable(const JsonValue& json, SheetRow* row) {
  if (!json.contains("reference_table") || json.at("reference_table").is_null()) {
    row->status = SheetStatus::kNotDone;
    row->evidence.clear();
    row->result =
        "the scenario compares with no table of measured or published values; it would be "
        "'reference: {csv: FILE}' in it";
    return;
  }
  const JsonValue table = json.at("reference_table");
  const std::string name = table.at("name");
  bool pass = true;
  size_t checks = 0;
  for (const JsonValue& check : json.at("checks").list()) {
    if (std::string(check.at("name")).find(role::kReference.name) == std::string::npos) continue;
    ++checks;
    pass = pass && check.at("pass").get<bool>();
  }
  std::vector<std::string> errors;
  row->values = {{"table", name}, {"checks", checks}, {"columns", nlohmann::ordered_json::array()}};
  for (const JsonValue& column : table.at("columns").list()) {
    for (const auto& [pair, judged] : column.at("judged").items()) {
      const double rms = judged.at("rms").NumberOrNan(), E = judged.at("error_rms").NumberOrNan(),
                   u = judged.at("standard").NumberOrNan();
      const std::string signal = column.at("signal"), unit = column.at("unit");
      pass = pass && judged.at("inside").get<bool>();
      row->values["columns"].push_back({{"signal", signal},
                                        {"pair", pair},
                                        {"unit", unit},
                                        {"rms", Number(rms)},
                                        {"error_rms", Number(E)},
                                        {"u_data", Number(u)}});
      if (errors.size() < 6) {
        errors.push_back(fmt::format("{} ({}) E = {} of {} {}, u_D = {}", signal, pair, Short(E),
                                     Short(rms), unit, Short(u)));
      }
    }
  }
  Judge(pass && checks > 0, row);
  row->result = fmt::format(
      "compared with the table {}: {}. Whether it was measured, and on what, the program does not "
      "know.",
      name, errors.empty() ? Counted(checks, "check") : Joined(errors));
}

// Of `converge`.

void FillOrder(const JsonValue& json, SheetRow* row) {
  const std::string verdict = json.at("verdict");
  size_t judged = 0, all = 0;
  std::vector<std::string> found;
  for (const JsonValue& series : json.at("series").list()) {
    ++all;
    if (!series.at("judged").get<bool>()) continue;
    ++judged;
    if (series.at("finding").get<bool>()) {
      found.push_back(std::string(series.at("title")) + ": " + std::string(series.at("text")));
    }
  }
  row->values = {{"verdict", verdict}, {"series", all}, {"judged", judged}};
  if (judged == 0) {
    row->status = SheetStatus::kNotApplicable;
    row->result = "no series of refined steps could be judged";
    return;
  }
  Judge(verdict == "as_expected", row);
  row->result = fmt::format(
      "step and time constant of the forward simulation refined: {} of {} series judged, orders "
      "{}{}.",
      judged, all, verdict == "as_expected" ? "as the schemes promise" : "not as promised",
      found.empty() ? "" : " (" + Joined(found) + ")");
}

void FillGrid(const JsonValue& json, SheetRow* row) {
  const JsonValue e = json.at("extrapolation");
  const double index = e.at("grid_convergence_index").NumberOrNan(),
               error = e.at("error").NumberOrNan(), allowed = e.at("allowed").NumberOrNan();
  if (std::isnan(index)) {
    row->status = SheetStatus::kNotApplicable;
    row->result = "forces could not be extrapolated to step zero";
    return;
  }
  row->values = {{"grid_convergence_index", Number(index)},
                 {"safety", Number(e.at("safety").NumberOrNan())},
                 {"order", Number(e.at("order").NumberOrNan())},
                 {"error", Number(error)},
                 {"allowed", Number(allowed)},
                 {"u_num", nlohmann::ordered_json::object()}};
  std::vector<std::string> drives;
  for (const JsonValue& drive : e.at("drives").list()) {
    const std::string name = drive.at("drive"), unit = drive.at("unit");
    const double u = drive.at("uncertainty").NumberOrNan();
    row->values["u_num"][name] = Number(u);
    drives.push_back(fmt::format("{} {} {}", name, Short(u), unit));
  }
  Judge(e.at("pass"), row);
  row->result = fmt::format(
      "grid convergence index {} of the RMS force (steps {:g} s and {:g} s, observed order {:.2f}, "
      "safety factor {:g}); U_num: {}. Step zero is {} off inverse dynamics, allowed {}.",
      Short(index), e.at("coarse_step_s").NumberOrNan(), e.at("fine_step_s").NumberOrNan(),
      e.at("order").NumberOrNan(), e.at("safety").NumberOrNan(), Joined(drives), Short(error),
      Short(allowed));
}

// Of `sensitivity`.

void FillRobustness(const JsonValue& json, SheetRow* row) {
  const int exit_code = json.at("exit_code");
  const double size = json.at("size").NumberOrNan();
  size_t numbers = 0, detected = 0, literals = 0, faults = 0, seen = 0;
  std::vector<std::string> most;
  for (const JsonValue& number : json.at("numbers").list()) {
    ++numbers;
    literals += std::string(number.at("kind")) == "literal" ? 1 : 0;
    detected += number.at("own").at("detected").get<bool>() ? 1 : 0;
    const double change = number.at("own").at("force_nrmse").NumberOrNan();
    if (most.size() < 3 && change > 0.0) {
      most.push_back(
          fmt::format("{} ({} of the force)", std::string(number.at("name")), Short(change)));
    }
  }
  for (const JsonValue& fault : json.at("faults").list()) {
    if (!fault.at("applicable").get<bool>()) continue;
    ++faults;
    seen += fault.at("own").at("detected").get<bool>() ? 1 : 0;
  }
  row->values = {{"size", Number(size)},  {"numbers", numbers}, {"detected", detected},
                 {"literals", literals},  {"faults", faults},   {"faults_detected", seen},
                 {"exit_code", exit_code}};
  Judge(exit_code == 0 && numbers > 0, row);
  row->result = fmt::format(
      "each number of the model {:g} % too large and too small: {} of {} detected by the "
      "comparison, {} of {}{}.{}",
      100.0 * size, detected, numbers, seen, Counted(faults, "structural fault"),
      exit_code == 0 ? "; what is not detected has no influence" : "; some that matter are missed",
      most.empty() ? "" : " Most sensitive: " + Joined(most) + ".");
}

// Of `study`.

void FillStudy(const JsonValue& json, SheetRow* row) {
  const std::string study = json.at("study"), verdict = json.at("verdict"),
                    reason = json.at("reason");
  const size_t points = json.at("points");
  std::vector<std::string> varied, intervals;
  for (const JsonValue& number : json.at("varied").list()) varied.push_back(number.at("name"));
  auto quantities = nlohmann::ordered_json::object();
  for (const JsonValue& q : json.at("quantities").list()) {
    if (!q.contains("p5")) continue;
    const std::string name = q.at("name");
    const double low = q.at("p5").NumberOrNan(), high = q.at("p95").NumberOrNan();
    quantities[name] = {{"nominal", Number(q.at("nominal").NumberOrNan())},
                        {"p5", Number(low)},
                        {"p95", Number(high)},
                        {"standard_deviation", Number(q.at("standard_deviation").NumberOrNan())}};
    if (intervals.size() < 6) {
      intervals.push_back(fmt::format("{} {:.4g} … {:.4g}", name, low, high));
    }
  }
  row->values = {{"study", study},
                 {"verdict", verdict},
                 {"points", points},
                 {"varied", varied.size()},
                 {"quantities", std::move(quantities)}};
  Judge(json.at("exit_code").get<int>() == 0 && points > 0, row);
  row->result = fmt::format("{}: {} varied ({}), {}; intervals from 5 % to 95 %: {}.", study,
                            Counted(varied.size(), "number"), Joined(varied), reason,
                            intervals.empty() ? "none" : Joined(intervals));
  if (!json.contains("validation")) return;
  const JsonValue validation = json.at("validation");
  row->values["validation"] = {{"table", std::string(validation.at("table"))},
                               {"pass", validation.at("pass").get<bool>()},
                               {"drives", nlohmann::ordered_json::array()}};
  for (const JsonValue& drive : validation.at("drives").list()) {
    row->values["validation"]["drives"].push_back(
        {{"drive", std::string(drive.at("drive"))},
         {"unit", std::string(drive.at("unit"))},
         {"error_rms", Number(drive.at("error_rms").NumberOrNan())},
         {"u_val", Number(drive.at("u_val").NumberOrNan())},
         {"outside", drive.at("outside").get<size_t>()},
         {"samples", drive.at("samples").get<size_t>()}});
  }
}

class SheetMaker {
 public:
  SheetMaker(Sheet* sheet, Present present, const fs::path& out, const ScenarioResult& loaded)
      : sheet_(*sheet),
        present_(std::move(present)),
        out_(out),
        loaded_(loaded),
        home_(out / loaded.mechanism->name) {}

  void Make() {
    const std::string to = out_.string();
    const SheetCommand run = {"run", File(), "--certify", "--out", to},
                       converge = {"converge", File(), "--out", to};
    const fs::path ran = home_ / Name() / "summary.json",
                   refined = home_ / "convergence" / Name() / "converge.json";
    Add({.key = "code_version",
         .title = "Code: what computed it",
         .standard = "ASME V&V 10",
         .status = SheetStatus::kStated,
         .result = VersionText()});
    Result({.key = "code_agreement",
            .title = "Code verification: independent computations",
            .standard = "ASME V&V 10; 7009 Verification",
            .commands = {run}},
           ran, FillAgreement);
    ForceResult({.key = "code_order",
                 .title = "Code verification: observed order of accuracy",
                 .standard = "ASME V&V 10; 7009 Verification",
                 .commands = {converge}},
                refined, FillOrder);
    ForceResult({.key = "solution_grid",
                 .title = "Solution verification: discretization error",
                 .standard = "ASME V&V 20: u_num; 7009 Verification",
                 .commands = {converge}},
                refined, FillGrid);
    Result({.key = "solution_proof",
            .title = "Solution verification: proved bounds",
            .standard = "ASME V&V 20: u_num; 7009 Verification",
            .commands = {run}},
           ran, FillProof);
    Add(Pedigree());
    Study();
    ForceResult({.key = "robustness",
                 .title = "Robustness: errors of the model that would be noticed",
                 .standard = "7009 Results robustness",
                 .commands = {{"sensitivity", File(), "--out", to}}},
                home_ / "sensitivity" / Name() / "sensitivity.json", FillRobustness);
    Validation(ran, run);
    Reproduction();
    Add({.key = "qualification",
         .title = "Use history, management, qualification",
         .standard = "7009 Supporting evidence",
         .status = SheetStatus::kStated,
         .result = "not assessed: no run shows it."});
  }

 private:
  [[nodiscard]] const std::string& File() const { return present_.scenario_file; }
  [[nodiscard]] const std::string& Name() const { return loaded_.scenario->name; }

  void Add(SheetRow row) { sheet_.rows.push_back(std::move(row)); }
  void Result(SheetRow row, const fs::path& document, const Fill& fill) {
    ReadResult(document, present_, fill, &row);
    Add(std::move(row));
  }
  // What asks for drive forces, which are given in a free motion.
  void ForceResult(SheetRow row, const fs::path& document, const Fill& fill) {
    if (!loaded_.scenario->motion.free()) return Result(std::move(row), document, fill);
    row.status = SheetStatus::kNotApplicable;
    row.result = "forces are given and the motion follows from them";
    row.commands.clear();
    Add(std::move(row));
  }

  [[nodiscard]] std::string VersionText() const {
    std::vector<std::string> names;
    for (const auto& [name, version] : sheet_.versions) names.push_back(name + " " + version);
    std::string program;
    if (const auto bytes = ReadWholeFile(ProgramFile())) {
      program = fmt::format(" (program file SHA-256 {})", Sha256Hex(*bytes).substr(0, 16));
    }
    return fmt::format("{}{}. The program's own tests are not run by this command.", Joined(names),
                       program);
  }

  // Of the model's numbers, as the scenario sets them.
  [[nodiscard]] SheetRow Pedigree() const {
    SheetRow row{.key = "input_pedigree",
                 .title = "Input pedigree: sources of parameters",
                 .standard = "7009 Input pedigree",
                 .status = SheetStatus::kStated};
    size_t printed = 0, corrected = 0, assumed = 0, unstated = 0, set = 0;
    std::vector<std::string> without;
    for (const Parameter& parameter : loaded_.mechanism->parameters) {
      const bool replaced = loaded_.scenario->parameters.contains(parameter.name);
      if (!parameter.written_out && !replaced) continue;
      if (replaced) {
        ++set;
      } else if (parameter.source == Source::kPrinted) {
        ++printed;
      } else if (parameter.source == Source::kCorrected) {
        ++corrected;
      } else if (parameter.source == Source::kAssumed) {
        ++assumed;
      } else {
        ++unstated;
      }
      if (replaced || parameter.source == Source::kUnstated) without.push_back(parameter.name);
    }
    const size_t all = printed + corrected + assumed + unstated + set;
    row.values = {{"parameters", all},  {"printed", printed},   {"corrected", corrected},
                  {"assumed", assumed}, {"unstated", unstated}, {"set_by_scenario", set}};
    row.result = fmt::format(
        "of {} with a number, {} have a source (printed {}, corrected {}, assumed {}), {} have none"
        "{}. Numbers that stand in place, outside of 'parameters', have no source and are not "
        "counted.",
        Counted(all, "parameter"), printed + corrected + assumed, printed, corrected, assumed,
        unstated + set, without.empty() ? "" : ": " + Joined(without));
    return row;
  }

  // Studies that vary this very scenario: those of the files as they are; else one of another
  // state.
  void Study() {
    SheetRow row{.key = "input_uncertainty",
                 .title = "Input uncertainty: intervals by a study",
                 .standard = "ASME V&V 20: u_input; 7009 Results uncertainty"};
    std::vector<SheetRow> done;
    std::error_code error;
    std::vector<fs::path> folders;
    for (const auto& entry : fs::directory_iterator(out_, error)) folders.push_back(entry.path());
    std::ranges::sort(folders);
    for (const fs::path& folder : folders) {
      if (!fs::exists(folder / "study.json", error) || !IsOfThis(folder / "inputs.json")) continue;
      SheetRow one = row;
      ReadResult(folder / "summary.json", present_, FillStudy, &one);
      if (one.status == SheetStatus::kStale) {
        row = one;
      } else if (one.status != SheetStatus::kNotDone) {
        done.push_back(std::move(one));
      }
    }
    if (!done.empty()) {
      row = done.front();
      auto studies = nlohmann::ordered_json::array({row.values});
      for (size_t k = 1; k < done.size(); ++k) {
        row.result += " " + done[k].result;
        row.evidence += ", " + done[k].evidence;
        studies.push_back(done[k].values);
        if (done[k].status == SheetStatus::kFailed) row.status = SheetStatus::kFailed;
      }
      row.values = {{"studies", std::move(studies)}};
    } else {
      for (const std::string& study : StudiesBeside()) {
        row.commands.push_back({"study", study, "--out", out_.string()});
      }
      if (row.commands.empty() && row.status == SheetStatus::kNotDone) {
        row.result =
            "no study beside the scenario varies it; a study file names its numbers and their "
            "intervals: mbverify study FILE.yaml";
      }
    }
    Add(std::move(row));
  }

  // Whether inputs.json names the scenario's file, or has its content.
  [[nodiscard]] bool IsOfThis(const fs::path& inputs) const {
    const std::optional<std::string> text = ReadWholeFile(inputs);
    if (!text) return false;
    const auto read = ReadJson(*text, [&](const JsonValue& made) {
      std::vector<InputFile> files;
      for (const JsonValue& input : made.at("inputs").list()) {
        files.push_back({input.at("file"), input.at("fingerprint")});
      }
      return files;
    });
    if (!read) return false;
    return std::ranges::any_of(
               *read.value,
               [&](const InputFile& input) { return input.fingerprint == present_.scenario(); }) ||
           !SameFile(File(), *read.value).empty();
  }
  [[nodiscard]] std::vector<std::string> StudiesBeside() const {
    std::vector<std::string> studies, unread;
    const fs::path folder = fs::path(File()).parent_path();
    for (const std::string& file : FilesBelow(folder.empty() ? "." : folder, ".yaml", &unread)) {
      if (fs::path(file).parent_path() != folder || KindOf(file).in_time) continue;
      if (KindOf(file).command != std::string("study")) continue;
      const std::vector<InputFile> inputs = InputsOf(file);
      if (!SameFile(File(), inputs).empty()) studies.push_back(file);
    }
    return studies;
  }

  // By a table in the scenario's run, or by a study with the table's uncertainty.
  void Validation(const fs::path& ran, const SheetCommand& run) {
    SheetRow row{.key = "validation",
                 .title = "Validation: measured or published data",
                 .standard = "ASME V&V 10, V&V 20: E, u_val; 7009 Validation"};
    if (loaded_.scenario->reference.table != nullptr) row.commands = {run};
    ReadResult(ran, present_, FillTable, &row);
    const SheetRow& studied = sheet_.Row("input_uncertainty");
    if (studied.values.contains("studies")) {
      for (const auto& study : studied.values.at("studies")) {
        if (!study.contains("validation")) continue;
        const auto& validation = study.at("validation");
        const bool pass = validation.at("pass");
        std::vector<std::string> drives;
        for (const auto& drive : validation.at("drives")) {
          drives.push_back(fmt::format(
              "{} E = {} {} RMS, U_val = {}, {} of {} samples outside",
              drive.at("drive").get<std::string>(),
              Short(drive.at("error_rms").is_number() ? drive.at("error_rms").get<double>() : kNan),
              drive.at("unit").get<std::string>(),
              Short(drive.at("u_val").is_number() ? drive.at("u_val").get<double>() : kNan),
              drive.at("outside").get<size_t>(), drive.at("samples").get<size_t>()));
        }
        if (row.status == SheetStatus::kNotDone) row.result.clear(), row.evidence.clear();
        row.result += fmt::format("{}{} against {}: {}.", row.result.empty() ? "" : " ",
                                  study.at("study").get<std::string>(),
                                  validation.at("table").get<std::string>(), Joined(drives));
        row.evidence += (row.evidence.empty() ? "" : ", ") + studied.evidence;
        row.values["studies"].push_back(validation);
        if (!pass) {
          row.status = SheetStatus::kFailed;
        } else if (row.status == SheetStatus::kNotDone) {
          row.status = SheetStatus::kDone;
        }
      }
    }
    Add(std::move(row));
  }

  // An archive with exactly these files, repeated.
  void Reproduction() {
    const fs::path archive = home_ / "package" / (Name() + ".zip"),
                   check = home_ / "package" / (Name() + ".json");
    SheetRow row{.key = "reproducibility",
                 .title = "Reproducibility: an archive, repeated",
                 .standard = "ASME V&V 10: documentation",
                 .commands = {{"package", File(), "--force", "-o", archive.string()},
                              {"package", "--check", archive.string(), "--json", check.string()}}};
    std::string packed;  // the scenario, in the archive
    ReadEvidence(
        check,
        [&](const JsonValue& json) -> std::string {
          const std::string here = fmt::format("mbverify {}", kVersion);
          if (const std::string by = json.at("program"); by != here) {
            return fmt::format("made by {}, this is {}", by, here);
          }
          std::map<std::string, std::string> paths;
          for (const JsonValue& input : json.at("inputs").list()) {
            paths[input.at("sha256")] = std::string(input.at("path"));
          }
          for (const InputFile& input : present_.inputs) {
            const auto text = ReadWholeFile(input.file);
            const auto at = text ? paths.find(Sha256Hex(*text)) : paths.end();
            if (at == paths.end()) return kOtherState + input.file;
            if (input.file == File()) packed = at->second;
          }
          return "";
        },
        [&](const JsonValue& json, SheetRow* filled) {
          size_t same = 0, within = 0, differ = 0;
          std::string failure = "the archive does not run it";
          bool agrees = false;
          for (const JsonValue& scenario : json.at("scenarios").list()) {
            if (std::string(scenario.at("file")) != packed) continue;
            failure = std::string(scenario.at("failure"));
            agrees =
                scenario.at("exit_code").get<int>() == scenario.at("packed_exit_code").get<int>();
            for (const JsonValue& file : scenario.at("files").list()) {
              const std::string outcome = file.at("outcome");
              same += outcome == "same" ? 1 : 0;
              within += outcome == "within" ? 1 : 0;
              differ += outcome == "differs" ? 1 : 0;
            }
          }
          filled->values = {{"same", same}, {"within", within}, {"differ", differ}};
          Judge(agrees && failure.empty() && differ == 0 && same + within > 0, filled);
          filled->result = fmt::format(
              "the archive {} was repeated: {} the same to the byte, {} within their limits, {} "
              "differ{}.",
              std::string(json.at("archive")), Counted(same, "file"), within, differ,
              failure.empty() ? "" : "; " + failure);
        },
        &row);
    Add(std::move(row));
  }

  Sheet& sheet_;
  const Present present_;
  const fs::path out_;
  const ScenarioResult& loaded_;
  const fs::path home_;  ///< of this mechanism's results
};

bool Passed(const Sheet& sheet, const char* key) {
  return sheet.Row(key).status == SheetStatus::kDone;
}
bool Failed(const Sheet& sheet, const char* key) {
  return sheet.Row(key).status == SheetStatus::kFailed;
}

bool HasDataUncertainty(const SheetRow& validation) {
  if (validation.values.contains("studies")) return true;
  if (!validation.values.contains("columns")) return false;
  return std::ranges::any_of(validation.values.at("columns"), [](const auto& column) {
    return column.at("u_data").is_number() && column.at("u_data").template get<double>() > 0.0;
  });
}

// Counts steps that hold, up to the first that does not.
struct LevelStep {
  bool holds;
  const char *meaning, *asks;
  int levels = 1;  ///< that it is worth
};
SheetFactor FactorOf(const char* name, const std::vector<LevelStep>& steps) {
  SheetFactor factor{name, 0, "insufficient evidence", ""};
  for (const LevelStep& step : steps) {
    if (!step.holds) {
      factor.next = step.asks;
      return factor;
    }
    factor.meaning = factor.level == 0 ? step.meaning : factor.meaning + "; " + step.meaning;
    factor.level += step.levels;
  }
  if (factor.level < 4) factor.next = "what no run shows";
  return factor;
}

}  // namespace

const char* ToText(SheetStatus status) {
  switch (status) {
    case SheetStatus::kDone:
      return "done";
    case SheetStatus::kFailed:
      return "failed";
    case SheetStatus::kStale:
      return "other state";
    case SheetStatus::kNotDone:
      return "not done";
    case SheetStatus::kNotApplicable:
      return "not applicable";
    case SheetStatus::kStated:
      return "stated";
  }
  return "";
}

const SheetRow& Sheet::Row(const std::string& key) const {
  const auto at = std::ranges::find(rows, key, &SheetRow::key);
  MBV_DEMAND(at != rows.end(), key);
  return *at;
}

size_t Sheet::Count(SheetStatus status) const {
  return static_cast<size_t>(std::ranges::count(rows, status, &SheetRow::status));
}

std::vector<SheetFactor> FactorsOf(const Sheet& sheet) {
  const auto& pedigree = sheet.Row("input_pedigree").values;
  const size_t all = pedigree.at("parameters"), assumed = pedigree.at("assumed"),
               none = pedigree.at("unstated").get<size_t>() +
                      pedigree.at("set_by_scenario").get<size_t>();
  const bool solved = Passed(sheet, "solution_grid") || Passed(sheet, "solution_proof"),
             unsolved = Failed(sheet, "solution_grid") || Failed(sheet, "solution_proof");
  const auto& proof = sheet.Row("solution_proof").values;
  const bool everywhere = Passed(sheet, "solution_proof") &&
                          proof.at("proved_samples") == proof.at("samples_of_motion");
  return {
      FactorOf("Verification",
               {{Passed(sheet, "code_agreement"), "independent computations of the model agree",
                 "a run in which independent computations agree"},
                {Passed(sheet, "code_order"), "the solver converges with its order",
                 "orders of convergence as the schemes promise"},
                {solved && !unsolved, "the numerical error is known",
                 "numerical uncertainty, estimated or proved, without a failure"},
                {everywhere && !unsolved, "and proved to be small at every sample",
                 "run --certify=all"}}),
      FactorOf("Validation",
               {{Passed(sheet, "validation"), "results agree with values of other origin",
                 "a table of measured or published values that results agree with"},
                {Passed(sheet, "validation") && HasDataUncertainty(sheet.Row("validation")),
                 "within the uncertainty of these values", "the uncertainty of these values"}}),
      FactorOf("Input pedigree",
               {{all > 0 && none == 0, "each parameter has a stated source",
                 "a source of each parameter (printed, corrected or assumed)"},
                {all > 0 && none == 0 && assumed == 0, "each parameter is from a document",
                 "documents instead of assumptions"}}),
      FactorOf(
          "Results uncertainty",
          {{Passed(sheet, "code_agreement"), "deterministic runs agree", "a run that agrees"},
           {solved && !unsolved, "their numerical uncertainty is known", "numerical uncertainty"},
           {Passed(sheet, "input_uncertainty"), "that of the inputs is propagated",
            "a study of the numbers' intervals that keeps its limits"}}),
      FactorOf("Results robustness",
               {{Passed(sheet, "robustness"),
                 "sensitivities to all numbers of the model are known, the key ones named",
                 "a sensitivity analysis that misses nothing", 4}}),
      {"Use history", -1, "not assessed", ""},
      {"M&S management", -1, "not assessed", ""},
      {"Qualification", -1, "not assessed", ""}};
}

std::vector<SheetCommand> Missing(const Sheet& sheet) {
  std::vector<SheetCommand> commands;
  for (const SheetRow& row : sheet.rows) {
    if (row.status != SheetStatus::kNotDone && row.status != SheetStatus::kStale) continue;
    for (const SheetCommand& command : row.commands) {
      if (std::ranges::find(commands, command) == commands.end()) commands.push_back(command);
    }
  }
  return commands;
}

std::string ToText(const SheetCommand& command) {
  std::string text = "mbverify";
  for (const std::string& word : command) text += " " + ShellWord(word);
  return text;
}

std::optional<Sheet> MakeSheet(const std::string& file, const fs::path& out,
                               Diagnostics* diagnostics) {
  const InputWatch watch;
  const ScenarioHead head = ReadScenarioHead(file);
  if (head.is_scenario && KindOf(file).timeless()) {
    diagnostics->AddError(file, "a sheet is about a scenario with a motion",
                          "of this one mbverify run says what is known");
    return {};
  }
  const ScenarioResult loaded = LoadScenario(file);
  diagnostics->Append(loaded.diagnostics);
  if (!loaded.scenario || !loaded.mechanism) return {};
  Sheet sheet{.scenario = loaded.scenario->name,
              .scenario_file = file,
              .mechanism = loaded.mechanism->name,
              .description = loaded.scenario->description,
              .versions = Versions()};
  SheetMaker(&sheet, {file, watch.files()}, out, loaded).Make();
  sheet.factors = FactorsOf(sheet);
  return sheet;
}

}  // namespace mbv
