#include "features/code/code.h"

#include <fmt/format.h>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <cstring>
#include <random>

#include "base/files.h"
#include "base/json_text.h"
#include "base/sha256.h"
#include "base/text.h"
#include "base/worker_pool.h"
#include "kinematics/command_rank.h"

namespace mbv {
namespace {

constexpr size_t kTests = 5;  // in the files
constexpr size_t kPythonStates = 300;
constexpr int kHalvings = 6;  // of the states' spread
constexpr double kLeastReached = 0.7;
constexpr size_t kNamed = 12;
constexpr size_t kWarnings = 6;  // lines of the compiler

std::string CName(const std::string& text) {
  std::string name;
  for (const char c : text) {
    name += std::isalnum(static_cast<unsigned char>(c)) != 0 ? c : '_';
  }
  if (name.empty() || std::isdigit(static_cast<unsigned char>(name[0])) != 0) name = "m_" + name;
  return name;
}

// How far coordinates are moved to either side of home.
struct Spread {
  VecX low, high;
};

class CodeMaker {
 public:
  CodeMaker(const Mechanism& mechanism, const CodeTask& task, const CodeSettings& settings,
            const std::function<void(double)>& progress)
      : m_(mechanism), task_(task), settings_(settings), progress_(progress) {}

  CodeResult Make() {
    result_.name = settings_.name.empty() ? CName(m_.name) : CName(settings_.name);
    result_.coordinates = NamesOf(task_.coordinates);
    result_.actuators = NamesOf(task_.actuators);
    formulas_ =
        MakeFormulas(m_, task_.coordinates, task_.held, task_.actuators, &result_.diagnostics);
    if (!formulas_) return std::move(result_);
    for (const ClosureBlock& block : formulas_->closure.blocks) {
      ++result_.blocks;
      result_.unknowns += block.rates.size();
      result_.largest_block = std::max(result_.largest_block, block.rates.size());
    }
    AddNotes();
    if (!FindSpread() || !FindStates()) return std::move(result_);
    options_.name = result_.name;
    options_.tolerance = CodeClosureTolerance(*formulas_);
    for (size_t i = 0; i < std::min(kTests, states_.size()); ++i)
      options_.tests.push_back(states_[i]);
    if (!settings_.ranges.empty() && !MakeTable()) return std::move(result_);
    Head();
    const std::string header = CHeader(*formulas_, options_);
    const std::string python = PythonModule(*formulas_, options_);
    result_.files = {{result_.name + ".h", header},
                     {result_.name + ".py", python},
                     {result_.name + "_test.c", CheckProgram(*formulas_, options_)}};
    if (options_.table && settings_.check.empty()) AddLookup();
    if (settings_.compile) Judge(header, python);
    return std::move(result_);
  }

 private:
  [[nodiscard]] double UnitOf(size_t k) const {
    return IsLength(m_, task_.coordinates[k].coordinate) ? formulas_->length : 1.0;
  }
  void Report(double share) const {
    if (progress_) progress_(share);
  }

  void AddNotes() {
    if (!formulas_->no_forces.empty()) {
      result_.notes.push_back("no forces: " + formulas_->no_forces);
    } else if (task_.actuators.size() != task_.coordinates.size()) {
      result_.notes.push_back(fmt::format(
          "no forces of actuators: {} for {} coordinates; forces along the coordinates are given",
          task_.actuators.size(), task_.coordinates.size()));
    }
    if (!task_.held.empty()) {
      result_.notes.push_back("held at home: " + Joined(NamesOf(task_.held), kNamed));
    }
    if (!formulas_->from_actuators) {
      result_.notes.emplace_back(
          "no way back from actuators to coordinates: they alone do not hold it at home");
    }
  }

  // Ranges as stated, else 0.3 rad or 0.2 L to either side of home, within what the model allows.
  bool FindSpread() {
    const auto n = static_cast<Eigen::Index>(formulas_->size());
    spread_.low.resize(n);
    spread_.high.resize(n);
    for (size_t k = 0; k < formulas_->size(); ++k) {
      const Coordinate& at = task_.coordinates[k].coordinate;
      const double home = formulas_->closure.home[static_cast<Eigen::Index>(k)];
      const double to = IsLength(m_, at) ? 0.2 * formulas_->length : 0.3;
      CoordinateRange range = RangeOf(at);
      range.lower = std::max(range.lower, home - to);
      range.upper = std::min(range.upper, home + to);
      spread_.low[static_cast<Eigen::Index>(k)] = std::min(range.lower, home);
      spread_.high[static_cast<Eigen::Index>(k)] = std::max(range.upper, home);
    }
    if (settings_.ranges.empty()) return true;
    for (const CodeRange& range : settings_.ranges) {
      const auto at =
          std::ranges::find(task_.coordinates, range.coordinate, &NamedCoordinate::name);
      if (at == task_.coordinates.end()) {
        result_.diagnostics.AddError(
            m_.file, "a range is stated of '" + range.coordinate + "', which is no coordinate",
            DidYouMean(range.coordinate, result_.coordinates,
                       "the coordinates: " + Joined(result_.coordinates, kNamed)));
        return false;
      }
      if (!(range.low < range.high)) {
        result_.diagnostics.AddError(m_.file, "the range of '" + range.coordinate + "' is empty",
                                     "LOW:HIGH with LOW < HIGH");
        return false;
      }
      const auto k = at - task_.coordinates.begin();
      spread_.low[k] = range.low;
      spread_.high[k] = range.high;
    }
    if (settings_.ranges.size() == formulas_->size()) return true;
    result_.diagnostics.AddError(m_.file,
                                 fmt::format("ranges of {} of {} coordinates: a table needs all",
                                             settings_.ranges.size(), formulas_->size()),
                                 "--range of each of: " + Joined(result_.coordinates, kNamed));
    return false;
  }

  [[nodiscard]] CoordinateRange RangeOf(const Coordinate& at) const {
    const auto index = static_cast<size_t>(at.index);
    switch (at.kind) {
      case Coordinate::Kind::kDrive:
        return m_.drives[index].range;
      case Coordinate::Kind::kPrescribed:
        return m_.joints[static_cast<size_t>(m_.prescribed[index].joint)].range[0];
      case Coordinate::Kind::kJoint:
        return m_.joints[index].range[static_cast<size_t>(at.component)];
      case Coordinate::Kind::kOutput:
        break;
    }
    return {};
  }

  // Random ones, and what the reference finds there, each from home; less far from home until most
  // are reached.
  bool FindStates() {
    CodeReference reference(m_, task_);
    std::string why;
    for (int halving = 0; halving <= kHalvings; ++halving) {
      std::mt19937_64 random(settings_.seed);  // the same each time
      std::uniform_real_distribution<double> one(-1.0, 1.0);
      states_.clear();
      open_.clear();
      const VecX& home = formulas_->closure.home;
      const double share = std::pow(0.5, halving);
      for (size_t i = 0; i < settings_.states; ++i) {
        TestState state;
        const auto n = static_cast<Eigen::Index>(formulas_->size());
        state.q.resize(n), state.v.resize(n), state.a.resize(n);
        for (Eigen::Index k = 0; k < n; ++k) {
          const double unit = UnitOf(static_cast<size_t>(k)), at = 0.5 * (one(random) + 1.0);
          const double q = spread_.low[k] + at * (spread_.high[k] - spread_.low[k]);
          state.q[k] = home[k] + share * (q - home[k]);
          state.v[k] = unit * one(random);
          state.a[k] = 10.0 * unit * one(random);
        }
        if (reference.Find(&state, &why)) {
          states_.push_back(std::move(state));
        } else {
          open_.push_back(std::move(state));
        }
        if (i % 64 == 0)
          Report(0.4 * static_cast<double>(i) / static_cast<double>(settings_.states));
        if (i > 200 && settings_.ranges.empty() && halving < kHalvings &&
            static_cast<double>(states_.size()) < kLeastReached * static_cast<double>(i)) {
          break;
        }
      }
      const double reached =
          static_cast<double>(states_.size()) / static_cast<double>(states_.size() + open_.size());
      if (!settings_.ranges.empty() || reached >= kLeastReached) break;
    }
    if (states_.size() >= std::min<size_t>(kTests, settings_.states)) return true;
    result_.diagnostics.AddError(m_.file, "the reference reaches no states near home: " + why,
                                 "other coordinates, smaller ranges or another home pose");
    return false;
  }

  bool MakeTable() {
    std::string why;
    options_.table =
        settings_.table != nullptr
            ? *settings_.table
            : MakeStartTable(*formulas_, spread_.low, spread_.high, settings_.cells, &why,
                             [this](double share) { Report(0.4 + 0.4 * share); });
    if (!why.empty()) {
      result_.diagnostics.AddError(m_.file, "no table that is proved: " + why,
                                   "without ranges, code starts from the pose at hand");
      return false;
    }
    result_.table = options_.table;
    size_t proved = 0;
    for (const bool cell : options_.table->proved) proved += cell ? 1 : 0;
    result_.table_bound = options_.table->bound;
    result_.table_share =
        static_cast<double>(proved) / static_cast<double>(options_.table->proved.size());
    if (proved > 0) return true;
    result_.diagnostics.AddError(m_.file, "nowhere in the ranges is the pose proved to be found",
                                 "smaller ranges, without singular poses");
    return false;
  }

  void AddLookup() {
    LookupTable table = MakeLookupTable(*formulas_, *options_.table);
    result_.lookup_share = static_cast<double>(std::ranges::count(table.proved, true)) /
                           static_cast<double>(table.proved.size());
    result_.lookup_error = VecX::Zero(static_cast<Eigen::Index>(formulas_->actuators.size()));
    VecX m;
    MatX slopes;
    for (const TestState& state : states_) {
      if (!table.At(state.q, &m, &slopes)) continue;
      result_.lookup_error = result_.lookup_error.cwiseMax((m - state.actuators).cwiseAbs());
    }
    result_.files.emplace_back(result_.name + "_lookup.h",
                               LookupHeader(*formulas_, table, options_));
    result_.lookup = std::move(table);
  }

  void Head() {
    std::vector<std::string>& head = options_.heading;
    head.push_back(
        fmt::format("Inverse kinematics, Jacobian{} of {}, made by mbverify; do not edit.",
                    formulas_->forces.empty() ? "" : " and inverse dynamics", m_.name));
    if (!settings_.origin.empty()) head.push_back("Model: " + settings_.origin);
    if (const std::optional<std::string> text = ReadWholeFile(m_.file)) {
      head.push_back("sha256 of its file: " + Sha256Hex(*text));
    }
    head.emplace_back();
    head.emplace_back("SI units and radians. Coordinates:");
    for (size_t k = 0; k < formulas_->size(); ++k) {
      head.push_back(fmt::format("  q[{}] {} [{}]", k, task_.coordinates[k].name,
                                 CoordinateUnit(m_, task_.coordinates[k].coordinate)));
    }
    head.emplace_back("Actuators, forces positive towards a larger position:");
    for (size_t k = 0; k < formulas_->actuators.size(); ++k) {
      head.push_back(fmt::format("  {} {} [{}]", k, formulas_->actuators[k].name,
                                 formulas_->actuators[k].unit));
    }
    for (const std::string& note : result_.notes) {
      head.push_back(static_cast<char>(std::toupper(note[0])) + note.substr(1) + ".");
    }
    for (std::string& line : head) line = InComment(line);
  }

  void Judge(const std::string& header, const std::string& python) {
    CodeCheck check(*formulas_, options_, states_, open_);
    std::string judged = header;
    if (!settings_.check.empty()) {
      const std::optional<std::string> text = ReadWholeFile(settings_.check);
      if (!text) {
        result_.diagnostics.AddError(settings_.check, "cannot be read",
                                     "a header that `code` wrote");
        return;
      }
      judged = *text;
    }
    result_.judgements.push_back(check.C(judged, false));
    Report(0.9);
    if (options_.table) result_.judgements.push_back(check.C(judged, true));
    for (CodeJudgement& judgement : result_.judgements) {
      if (judgement.not_judged.empty() && !judgement.agrees()) {
        CodeReference reference(m_, task_);
        judgement.slip = check.Slip(&reference);
      }
    }
    if (settings_.check.empty()) {
      result_.judgements.push_back(check.Python(python, kPythonStates));
    }
    Report(1.0);
  }

  const Mechanism& m_;
  const CodeTask& task_;
  const CodeSettings& settings_;
  const std::function<void(double)>& progress_;
  CodeResult result_;
  std::unique_ptr<MechanismFormulas> formulas_;
  CodeTextOptions options_;
  Spread spread_;
  std::vector<TestState> states_, open_;
};

std::string JudgementText(const CodeJudgement& judgement) {
  if (!judgement.not_judged.empty()) {
    std::string text =
        fmt::format("{}: not judged: {}\n", judgement.language, judgement.not_judged);
    for (size_t i = 0; i < std::min<size_t>(kWarnings, judgement.warnings.size()); ++i) {
      text += "  " + OneLine(judgement.warnings[i]) + "\n";
    }
    return text;
  }
  std::string text = fmt::format("{}: {} at {} states", judgement.language,
                                 judgement.agrees() ? "agrees" : "DIFFERS", judgement.states);
  const char* before = ": ";
  const auto add = [&](const char* what, double difference) {
    if (std::isnan(difference)) return;
    text += fmt::format("{}{} {:.2g}", before, what, difference);
    before = ", ";
  };
  add("positions", judgement.position);
  add("rates and accelerations", judgement.jacobian);
  add("forces", judgement.force);
  add("forces along the coordinates", judgement.along);
  add("outputs", judgement.output);
  text += fmt::format(" (limit {:.0e} of the largest value)", CodeJudgement::kLimit);
  if (!std::isnan(judgement.nanoseconds)) {
    text += fmt::format("; {:.3g} µs a state", 1e-3 * judgement.nanoseconds);
  }
  text += "\n";
  if (judgement.back < 1.0) {
    text += fmt::format(
        "  the way back from the actuators' positions ends at the same coordinates in "
        "{:.1f} % of the states, else in another assembly or nowhere\n",
        100.0 * judgement.back);
  }
  if (judgement.only_one > 0) {
    text += fmt::format("  {} states that only one of the two reaches\n", judgement.only_one);
  }
  if (!judgement.agrees()) {
    text += judgement.slip.empty() ? "  no single slip explains it\n"
                                   : "  what explains it: " + judgement.slip + "\n";
  }
  for (size_t i = 0; i < std::min<size_t>(kWarnings, judgement.warnings.size()); ++i) {
    text += "  " + OneLine(judgement.warnings[i]) + "\n";
  }
  return text;
}

}  // namespace

std::string JudgementsText(const CodeResult& result) {
  std::string text;
  for (const CodeJudgement& judgement : result.judgements) text += JudgementText(judgement);
  return text;
}

std::string ToText(const CodeResult& result) {
  std::string text = fmt::format("coordinates: {}\nactuators: {}\n", Joined(result.coordinates),
                                 Joined(result.actuators));
  text += result.blocks == 0
              ? "the joints follow from the coordinates without equations to solve\n"
              : fmt::format("{} joints' coordinates are searched, in {} blocks of at most {}\n",
                            result.unknowns, result.blocks, result.largest_block);
  for (const std::string& note : result.notes) text += note + "\n";
  if (!std::isnan(result.table_bound)) {
    text += fmt::format("table: proved in {:.1f} % of the range, error left below {:.1g}\n",
                        100.0 * result.table_share, result.table_bound);
  }
  if (result.lookup) {
    text +=
        fmt::format("lookup table: proved in {:.1f} % of the range\n", 100.0 * result.lookup_share);
    for (size_t a = 0; a < result.actuators.size(); ++a) {
      const auto at = static_cast<Eigen::Index>(a);
      text +=
          fmt::format("  {}: error at most {:.2g}, {:.2g} found; of its slopes at most {:.2g}\n",
                      result.actuators[a], result.lookup->bound[at], result.lookup_error[at],
                      result.lookup->slope_bound.row(at).maxCoeff());
    }
  }
  return text + JudgementsText(result);
}

nlohmann::ordered_json ToJson(const CodeResult& result, const std::string& model) {
  nlohmann::ordered_json json = {{"model", model},
                                 {"name", result.name},
                                 {"coordinates", result.coordinates},
                                 {"actuators", result.actuators},
                                 {"notes", result.notes},
                                 {"blocks", result.blocks},
                                 {"largest_block", result.largest_block},
                                 {"searched", result.unknowns},
                                 {"limit", CodeJudgement::kLimit},
                                 {"agrees", result.agrees()}};
  if (!std::isnan(result.table_bound)) {
    json["table"] = {{"error", result.table_bound}, {"proved", result.table_share}};
  }
  if (result.lookup) {
    json["lookup"] = {
        {"proved", result.lookup_share},
        {"bound", std::vector<double>(result.lookup->bound.begin(), result.lookup->bound.end())},
        {"found", std::vector<double>(result.lookup_error.begin(), result.lookup_error.end())}};
  }
  json["judgements"] = nlohmann::ordered_json::array();
  for (const CodeJudgement& one : result.judgements) {
    json["judgements"].push_back({{"language", one.language},
                                  {"compiler", one.compiler},
                                  {"not_judged", one.not_judged},
                                  {"agrees", one.agrees()},
                                  {"states", one.states},
                                  {"only_one", one.only_one},
                                  {"position", Number(one.position)},
                                  {"rates", Number(one.jacobian)},
                                  {"force", Number(one.force)},
                                  {"along", Number(one.along)},
                                  {"output", Number(one.output)},
                                  {"back", Number(one.back)},
                                  {"nanoseconds", Number(one.nanoseconds)},
                                  {"slip", one.slip},
                                  {"warnings", one.warnings}});
  }
  json["files"] = nlohmann::ordered_json::array();
  for (const auto& [name, content] : result.files) json["files"].push_back(name);
  return json;
}

bool CodeJudgement::agrees() const {
  bool any = false, within = true;
  for (const double difference : {position, jacobian, force, along, output}) {
    any = any || !std::isnan(difference);
    within = within && (std::isnan(difference) || difference <= kLimit);
  }
  return not_judged.empty() && states > 0 && any && within &&
         static_cast<double>(only_one) <= 0.01 * static_cast<double>(states);
}

bool CodeResult::agrees() const {
  if (lookup && (lookup_error.array() > lookup->bound.array() * (1.0 + 1e-9)).any()) return false;
  return !diagnostics.has_errors() && std::ranges::all_of(judgements, [](const CodeJudgement& one) {
    return (!one.not_judged.empty() && !one.broken) || one.agrees();
  });
}

std::optional<CodeTask> ChooseCodeTask(const Mechanism& mechanism,
                                       const std::vector<std::string>& coordinates,
                                       Diagnostics* diagnostics) {
  std::vector<Coordinate> first;
  for (int c = 0; c < 6 && !mechanism.outputs.empty(); ++c) {
    first.push_back({Coordinate::Kind::kOutput, 0, c});
  }
  const auto chosen = ChooseNamedCoordinates(mechanism, coordinates, first, diagnostics);
  if (!chosen) return std::nullopt;
  CodeTask task;
  task.coordinates = chosen->coordinates;
  task.held = chosen->held;
  for (size_t d = 0; d < mechanism.drives.size(); ++d) {
    task.actuators.push_back(
        {mechanism.drives[d].name, {Coordinate::Kind::kDrive, static_cast<int>(d), 0}});
  }
  for (const NamedCoordinate& at : chosen->coordinates) {
    if (at.coordinate.kind == Coordinate::Kind::kPrescribed) task.actuators.push_back(at);
  }
  return task;
}

CodeResult MakeCode(const Mechanism& mechanism, const CodeTask& task, const CodeSettings& settings,
                    const std::function<void(double)>& progress) {
  return CodeMaker(mechanism, task, settings, progress).Make();
}

}  // namespace mbv
