// mbverify size
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <memory>
#include <optional>

#include "base/json_text.h"
#include "base/output_folder.h"
#include "base/text.h"
#include "cli/cli.h"
#include "cli/files.h"
#include "cli/options.h"
#include "cli/terminal.h"
#include "features/run/default_setup.h"
#include "features/run/run_scenario.h"
#include "model_file/catalogue.h"
#include "model_file/load_model.h"
#include "report/html_report.h"
#include "report/sizing.h"

namespace mbv {
namespace {

struct SizeArguments {
  std::vector<std::string> scenarios, set;
  JsonOption json;
  double margin = 1.0;
  std::string catalogue, by = "mass", out;
  bool trust = false;
};

// The envelopes of one mechanism over its scenarios.
struct Sized {
  std::string mechanism;
  std::vector<std::string> scenarios;
  std::vector<MotorEnvelope> envelopes;
  std::optional<LinkEnvelope> link;
  std::vector<Report> reports;  ///< kept where motors are chosen
  nlohmann::ordered_json refused = nlohmann::ordered_json::array();
};

// A scenario that says nothing about motors: the reason is kept for --json.
int RefuseScenario(const std::string& file, const std::string& reason, const std::string& hint,
                   Sized* sized) {
  sized->refused.push_back({{"scenario_file", file}, {"exit_code", 2}, {"reason", reason}});
  return hint.empty() ? 2 : Refuse(reason, hint);
}

std::string FirstError(const RunOutcome& outcome) {
  for (const Finding& finding : outcome.diagnostics.findings()) {
    if (finding.severity == Severity::kError) return finding.message;
  }
  return "";
}

// Runs a scenario without files; its exit code.
int AddScenario(const std::string& file, const RunOptions& options, bool keep, Sized* sized) {
  RunOutcome outcome = RunScenario(file, options);
  SayText(stderr, outcome.diagnostics.Text());
  if (!outcome.report) {
    if (outcome.exit_code == 2) return RefuseScenario(file, FirstError(outcome), "", sized);
    return RefuseScenario(file, file + " is not a motion", "size takes scenarios with a motion",
                          sized);
  }
  const Report& report = *outcome.report;
  if (!sized->mechanism.empty() && sized->mechanism != report.mechanism) {
    return RefuseScenario(file,
                          fmt::format("{} is about {}, the others about {}", file, report.mechanism,
                                      sized->mechanism),
                          "size compares scenarios of one mechanism", sized);
  }
  if (report.motors.empty()) {
    return RefuseScenario(
        file, fmt::format("{} has no motors", report.mechanism),
        keep ? "name the drives that get one in the model: motors: {DRIVE: {}}"
             : "state them in the model: motors: {DRIVE: {continuous: …, peak: …}}",
        sized);
  }
  sized->mechanism = report.mechanism;
  sized->scenarios.push_back(report.scenario);
  Widen(report, &sized->envelopes);
  if (const LinkLoad* link = MainLinkLoad(report)) Widen(*link, report.scenario, &sized->link);
  if (outcome.exit_code != 0) Say(stderr, "{}: {}\n", file, report.comparison.reason);
  const int exit_code = outcome.exit_code;
  if (keep) sized->reports.push_back(*std::move(outcome.report));
  return exit_code;
}

// Motors from a catalogue. The mechanism's forces stay, what a rotor and a gear make of them is
// computed anew for each combination.

struct Candidate {
  const CatalogueMotor* motor = nullptr;
  const CatalogueGearbox* gearbox = nullptr;  ///< null: none
  double amount = kNan;                       ///< mass or cost of both
  double use = kNan, inertia_ratio = kNan;    ///< use: largest of all scenarios; NaN: none
  std::string limited_by = {}, scenario = {};
  bool keeps = false;

  [[nodiscard]] std::string gear() const { return gearbox == nullptr ? "none" : gearbox->name; }
};

struct DriveChoice {
  std::string drive = {};
  std::vector<Candidate> candidates = {};  ///< smallest first
  const Candidate* chosen = nullptr;       ///< one of them; moving keeps it
  Motor motor = {};                        ///< that is chosen
};

// One amount of every motor and gearbox that may be chosen.
Diagnostics CheckAmounts(const std::string& file, const Catalogue& catalogue,
                         const std::string& by) {
  Diagnostics diagnostics;
  const auto need = [&](const char* section, const auto& item) {
    if (!std::isnan(by == "mass" ? item.mass : item.cost)) return;
    diagnostics.AddError(file, fmt::format("{}.{} has no {}", section, item.name, by),
                         fmt::format("state it, or choose by {}", by == "mass" ? "cost" : "mass"));
  };
  for (const CatalogueMotor& motor : catalogue.motors) need("motors", motor);
  for (const CatalogueGearbox& gearbox : catalogue.gearboxes) need("gearboxes", gearbox);
  return diagnostics;
}

// The witness that a reader looks at first.
const Trace* MainTrace(const Report& report) {
  const std::vector<const MotorLoad*> loads = MainMotorLoads(report);
  return loads.empty() ? nullptr : TraceOf(report, loads.front()->witness);
}

MotorLoad LoadIn(const Report& report, size_t k, const Motor& motor) {
  const Trace* trace = MainTrace(report);
  const std::string& drive = report.drives[static_cast<size_t>(motor.drive)];
  if (trace == nullptr) return {.drive = drive};
  MotorLoad load = MotorLoadOf(drive, motor, *trace, report.drive_facts[k]);
  load.unresolved = MainMotorLoads(report).front()->unresolved;
  return load;
}

void Judge(const std::vector<Report>& reports, size_t k, double margin, Candidate* candidate) {
  const Motor& model = reports.front().motors[k];
  if (candidate->motor->motor.turns != model.turns) {
    candidate->limited_by =
        model.turns ? "it slides, the model's turns" : "it turns, the model's slides";
    return;
  }
  const Motor motor = InPlaceOf(model, *candidate->motor, candidate->gearbox);
  candidate->limited_by = "it states no limit";
  for (const Report& report : reports) {
    const MotorLoad load = LoadIn(report, k, motor);
    candidate->inertia_ratio = load.inertia_ratio;
    const double use = load.largest_use();
    if (std::isnan(use) || use <= candidate->use) continue;
    candidate->use = use, candidate->limited_by = load.limited_by();
    candidate->scenario = report.scenario;
  }
  candidate->keeps = 1.0 / candidate->use >= margin;
}

DriveChoice Choose(const std::vector<Report>& reports, size_t k, const Catalogue& catalogue,
                   const SizeArguments& arguments) {
  const Motor& model = reports.front().motors[k];
  DriveChoice choice{.drive = reports.front().drives[static_cast<size_t>(model.drive)]};
  const auto amount = [&](const auto& item) {
    return arguments.by == "mass" ? item.mass : item.cost;
  };
  for (const CatalogueMotor& motor : catalogue.motors) {
    for (const int g : motor.gearboxes) {
      Candidate candidate{.motor = &motor};
      if (g >= 0) candidate.gearbox = &catalogue.gearboxes[static_cast<size_t>(g)];
      candidate.amount = amount(motor) + (g < 0 ? 0.0 : amount(*candidate.gearbox));
      Judge(reports, k, arguments.margin, &candidate);
      choice.candidates.push_back(std::move(candidate));
    }
  }
  // Of equal ones that with the larger margin; those without any last.
  const auto order = [](const Candidate& c) {
    return std::pair(c.amount, std::isnan(c.use) ? Motor::kNoLimit : c.use);
  };
  std::ranges::stable_sort(choice.candidates, {}, order);
  const auto chosen = std::ranges::find(choice.candidates, true, &Candidate::keeps);
  if (chosen == choice.candidates.end()) return choice;
  choice.chosen = &*chosen;
  choice.motor = InPlaceOf(model, *chosen->motor, chosen->gearbox);
  return choice;
}

// The DC link with the chosen motors instead of the model's.
std::optional<LinkEnvelope> LinkOf(const std::vector<Report>& reports,
                                   const std::vector<DriveChoice>& choices) {
  std::optional<LinkEnvelope> envelope;
  for (const Report& report : reports) {
    if (!report.dc_link) continue;
    std::vector<MotorLoad> loads;
    for (size_t k = 0; k < choices.size(); ++k) {
      if (choices[k].chosen != nullptr) loads.push_back(LoadIn(report, k, choices[k].motor));
    }
    const auto link = LinkLoadOf(*report.dc_link, loads);
    if (link) Widen(*link, report.scenario, &envelope);
  }
  return envelope;
}

Table ChoiceTable(const DriveChoice& choice, const std::string& by, bool all) {
  Table table{.name = "choice_" + choice.drive,
              .caption = "Motors for " + choice.drive,
              .columns = {Text("motor"), Text("gearbox"), Digits(by), Digits("margin"), Text("by"),
                          Digits("inertia ratio"), Text("")}};
  for (const Candidate& c : choice.candidates) {
    const bool chosen = &c == choice.chosen;
    table.rows.push_back(
        {c.motor->name,
         c.gear(),
         fmt::format("{:.4g}", c.amount),
         NumberOrDash(1.0 / c.use, "{:.3g}"),
         c.scenario.empty() ? c.limited_by : fmt::format("{}, {}", c.limited_by, c.scenario),
         NumberOrDash(c.inertia_ratio, "{:.3g}"),
         {chosen    ? "chosen"
          : c.keeps ? "larger"
                    : "fails",
          chosen    ? Mark::kOk
          : c.keeps ? Mark::kNone
                    : Mark::kFail}});
    if (chosen && !all) break;
  }
  return table;
}

// `motors` of a model file.
std::string ModelText(const std::vector<DriveChoice>& choices) {
  std::string text = "motors:\n";
  for (const DriveChoice& choice : choices) {
    if (choice.chosen == nullptr) continue;
    text += fmt::format("  {}: {{{}}}\n", choice.drive, MotorText(choice.motor));
  }
  return text;
}

std::string ChoiceText(const DriveChoice& choice, const std::string& by, const Catalogue& catalogue,
                       double margin) {
  std::string text = fmt::format("\n{}: ", choice.drive);
  if (choice.chosen != nullptr) {
    const Candidate& c = *choice.chosen;
    text += fmt::format("{} with gearbox {}, {} {:.4g}\n", c.motor->name, c.gear(), by, c.amount);
  } else {
    text += fmt::format("nothing in '{}' has the margin {:g}\n", catalogue.name, margin);
  }
  text += ToText(ChoiceTable(choice, by, false));
  if (choice.chosen == nullptr) return text;
  const auto larger = &choice.candidates.back() - choice.chosen;
  return larger == 0 ? text : text + fmt::format("  {} larger combinations not shown\n", larger);
}

nlohmann::ordered_json ChoiceJson(const std::vector<DriveChoice>& choices,
                                  const Catalogue& catalogue, const SizeArguments& arguments) {
  auto drives = nlohmann::ordered_json::array();
  for (const DriveChoice& choice : choices) {
    auto candidates = nlohmann::ordered_json::array();
    for (const Candidate& c : choice.candidates) {
      candidates.push_back({{"motor", c.motor->name},
                            {"gearbox", c.gear()},
                            {"amount", Number(c.amount)},
                            {"margin", Number(1.0 / c.use)},
                            {"limited_by", c.limited_by},
                            {"scenario", c.scenario},
                            {"inertia_ratio", Number(c.inertia_ratio)},
                            {"keeps", c.keeps},
                            {"chosen", &c == choice.chosen}});
    }
    drives.push_back({{"drive", choice.drive},
                      {"motor", choice.chosen ? choice.chosen->motor->name : ""},
                      {"gearbox", choice.chosen ? choice.chosen->gear() : ""},
                      {"candidates", std::move(candidates)}});
  }
  return {{"catalogue", catalogue.name},
          {"by", arguments.by},
          {"margin", arguments.margin},
          {"drives", std::move(drives)},
          {"model_text", ModelText(choices)}};
}

// A row per combination, 17 significant digits.
std::string ChoiceCsv(const std::vector<DriveChoice>& choices) {
  std::string text =
      "drive,motor,gearbox,mass,cost,margin,limited_by,scenario,inertia_ratio,keeps,chosen\n";
  for (const DriveChoice& choice : choices) {
    for (const Candidate& c : choice.candidates) {
      const double more_mass = c.gearbox == nullptr ? 0.0 : c.gearbox->mass;
      const double more_cost = c.gearbox == nullptr ? 0.0 : c.gearbox->cost;
      text += fmt::format("{},{},{},{:.17g},{:.17g},{:.17g},{},{},{:.17g},{:d},{:d}\n",
                          CsvCell(choice.drive), CsvCell(c.motor->name), CsvCell(c.gear()),
                          c.motor->mass + more_mass, c.motor->cost + more_cost, 1.0 / c.use,
                          CsvCell(c.limited_by), CsvCell(c.scenario), c.inertia_ratio, c.keeps,
                          &c == choice.chosen);
    }
  }
  return text;
}

std::string SizePage(const Sized& sized, const std::vector<DriveChoice>& choices,
                     const std::string& by) {
  Page page;
  ReportSection motors{.title = "What the scenarios ask of the model's motors", .link = "Motors"};
  motors.Add(EnvelopeTable(sized.envelopes));
  if (sized.link) motors.Note(ToText(*sized.link));
  page.Add(motors);
  if (!choices.empty()) {
    ReportSection chosen{.title = "Choice from the catalogue", .link = "Choice"};
    for (const DriveChoice& choice : choices) chosen.Add(ChoiceTable(choice, by, true));
    chosen.Add(Verbatim{ModelText(choices)});
    page.Add(chosen);
  }
  return page.Write({.kicker = "mbverify size",
                     .title = sized.mechanism,
                     .lead = "Scenarios: " + Joined(sized.scenarios),
                     .judges = false});
}

bool TooSmall(const Sized& sized, double margin) {
  bool small = sized.link && sized.link->limited && !(sized.link->margin() >= margin);
  if (!sized.reports.empty()) return small;
  for (const MotorEnvelope& e : sized.envelopes)
    small = small || (e.limited && !(e.margin() >= margin));
  return small;
}

bool IsUnknown(const Sized& sized) {
  return std::any_of(sized.envelopes.begin(), sized.envelopes.end(),
                     [](const MotorEnvelope& e) { return !e.unresolved.empty(); });
}

// What the model's motors lack does not count where others are chosen.
int PrintSized(const SizeArguments& arguments, const Catalogue& catalogue, Sized* sized,
               int exit_code) {
  std::vector<DriveChoice> choices;
  if (!sized->reports.empty() && !MainMotorLoads(sized->reports.front()).empty()) {
    for (size_t k = 0; k < sized->reports.front().motors.size(); ++k) {
      choices.push_back(Choose(sized->reports, k, catalogue, arguments));
    }
    sized->link = LinkOf(sized->reports, choices);
  }
  std::FILE* to = arguments.json.text();
  if (!sized->envelopes.empty()) SayText(to, ToText(sized->envelopes));
  if (sized->link) SayText(to, ToText(*sized->link));
  for (const DriveChoice& choice : choices) {
    SayText(to, ChoiceText(choice, arguments.by, catalogue, arguments.margin));
    if (choice.chosen == nullptr) exit_code = WorseExit(exit_code, 1);
  }
  if (!choices.empty()) SayText(to, "\n" + ModelText(choices));
  if (TooSmall(*sized, arguments.margin)) exit_code = WorseExit(exit_code, 1);
  if (IsUnknown(*sized)) exit_code = WorseExit(exit_code, 3);
  auto json =
      ParseJson<nlohmann::ordered_json>(ToJson(sized->envelopes, sized->link, sized->scenarios));
  json["choice"] =
      choices.empty() ? nlohmann::ordered_json() : ChoiceJson(choices, catalogue, arguments);
  json["refused"] = sized->refused;
  json["exit_code"] = exit_code;
  if (!arguments.out.empty() && !sized->mechanism.empty()) {
    std::vector<std::pair<std::string, std::string>> files = {
        {"size.html", SizePage(*sized, choices, arguments.by)}};
    if (!choices.empty()) files.emplace_back("size.csv", ChoiceCsv(choices));
    OutputFolder folder(arguments.out, sized->mechanism + "/size");
    const std::string trouble = folder.WriteAll(files);
    if (!trouble.empty()) return NotWritten(trouble, "choose another folder with --out");
    Say(stderr, "results in {}\n", folder.target().string());
  }
  return WorseExit(exit_code, arguments.json.Write(json, {}));
}

// A robot's file is sized by a first motion, which is left to go on from.
bool SetUpRobot(const SizeArguments& arguments, std::string* file) {
  const DefaultSetupResult made = MakeDefaultSetup(*file, "", "./model.yaml");
  SayText(stderr, made.diagnostics.Text());
  if (!made.setup) return false;
  std::string scenario;
  const std::string trouble =
      WriteSetup(*made.setup, arguments.out.empty() ? "out" : arguments.out, &scenario);
  if (!trouble.empty()) {
    Say(stderr, "error: {}\n", trouble);
    return false;
  }
  Say(stderr, "{} is sized by {}; go on from there\n", *file, scenario);
  *file = scenario;
  return true;
}

int RunSize(const SizeArguments& arguments) {
  RunOptions options;
  options.out_dir.clear();
  options.pictures = options.page = false;
  if (!ReadAssignments(arguments.set, "--set", "simulation.step_s=0.002", &options.scenario.set))
    return 2;
  Catalogue catalogue;
  if (!arguments.catalogue.empty()) {
    Diagnostics diagnostics;
    auto loaded = LoadCatalogue(arguments.catalogue, &diagnostics);
    if (loaded) diagnostics.Append(CheckAmounts(arguments.catalogue, *loaded, arguments.by));
    SayText(stderr, diagnostics.Text());
    if (diagnostics.has_errors()) return 2;
    catalogue = *std::move(loaded);
    const int refused = RefuseInput(arguments.json.path(), arguments.catalogue);
    if (refused != 0) return refused;
  }
  std::vector<std::string> scenarios = arguments.scenarios;
  for (std::string& file : scenarios) {
    if (IsRobotFile(file) && !SetUpRobot(arguments, &file)) return 2;
  }
  int exit_code = 0;
  const std::vector<std::string> files = FilesToRun(scenarios, {arguments.json.path()}, &exit_code);
  if (exit_code == 0) {
    exit_code = AskForPrograms(files, options.scenario, arguments.trust, false, &options.programs);
  }
  if (exit_code != 0) return exit_code;
  Sized sized;
  for (const std::string& file : files) {
    exit_code =
        WorseExit(exit_code, AddScenario(file, options, !arguments.catalogue.empty(), &sized));
  }
  return PrintSized(arguments, catalogue, &sized, exit_code);
}

}  // namespace

void AddSizeCommand(CLI::App* app, int* exit_code) {
  auto arguments = std::make_shared<SizeArguments>();
  CLI::App* size = app->add_subcommand(
      "size", "What several scenarios ask of the motors: the largest of each, and the margin");
  size->add_option("scenarios", arguments->scenarios,
                   "scenario files or folders of one mechanism, or a robot's file")
      ->required();
  size->add_option("--margin", arguments->margin, "smaller ones end with exit code 1")
      ->check(Positive())
      ->capture_default_str();
  size->add_option("--choose", arguments->catalogue,
                   "catalogue of motors and gearboxes: the smallest that keep --margin, by drive");
  size->add_option("--by", arguments->by, "with --choose: what is smallest")
      ->check(CLI::IsMember({"mass", "cost"}))
      ->capture_default_str();
  size->add_option("--out", arguments->out, "folder for size.html and, with --choose, size.csv");
  AddTrustOption(size, &arguments->trust);
  arguments->json.AddTo(size);
  size->add_option("--set", arguments->set,
                   "key=value: overrides a value of the scenarios (repeatable)")
      ->allow_extra_args(false);
  SetFooter(
      size,
      {"size scenarios/slider_crank", "size slow.yaml fast.yaml --margin 1.2 --json size.json",
       "size scenarios/slider_crank --choose scenarios/slider_crank/catalogue.yaml --out out"},
      "0 agree and margins are kept, 1 disagree or a margin is smaller, 2 bad input, 3 could "
      "not run, 4 internal error");
  size->callback([arguments, exit_code] { *exit_code = RunSize(*arguments); });
}

}  // namespace mbv
