#include "features/equation_audit/audit.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <mutex>
#include <random>

#include "base/files.h"
#include "base/text.h"
#include "equations/equations.h"
#include "features/equation_audit/quantities.h"
#include "features/equation_audit/slips.h"
#include "kinematics/command_rank.h"
#include "mechanism/reach.h"
#include "scenario/find_model.h"
#include "verify/model_text.h"

namespace mbv {
namespace {

namespace fs = std::filesystem;

constexpr std::uint64_t kSeed = 20120815;
constexpr int kTries = 50;                // states drawn for each that is wanted
constexpr double kRight = 1e-9;           // of the size of the quantity and of its terms
constexpr double kNearly = 1e-3;          // above: wrong
constexpr double kNudge = 1e-3;           // of arguments, to see what an equation depends on
constexpr double kVanishes = 1e-9;        // of the size of the terms
constexpr double kDefaultRange_m = 0.05;  // of the mechanism's size
constexpr double kDefaultRange_rad = 0.2;
constexpr const char* kOfVelocities = "the share of the velocities (Coriolis and centrifugal)";
constexpr double kRatesPerRange = 2.0, kAccelerationsPerRange = 8.0;  // [1/s, 1/s²]

std::string ShortName(const std::string& name) {
  const size_t dot = name.rfind('.');
  return dot == std::string::npos ? name : name.substr(dot + 1);
}

// `{i}` replaced by its value.
std::string Filled(std::string text, const std::map<std::string, std::string>& indices) {
  for (const auto& [name, value] : indices) {
    const std::string place = "{" + name + "}";
    for (size_t at = text.find(place); at != std::string::npos; at = text.find(place, at)) {
      text.replace(at, place.size(), value);
      at += value.size();
    }
  }
  return text;
}

std::vector<std::map<std::string, std::string>> Combinations(
    const std::map<std::string, std::vector<std::string>>& each) {
  std::vector<std::map<std::string, std::string>> all = {{}};
  for (const auto& [name, values] : each) {
    std::vector<std::map<std::string, std::string>> longer;
    for (const auto& known : all) {
      for (const std::string& value : values) {
        longer.push_back(known);
        longer.back()[name] = value;
      }
    }
    all = std::move(longer);
  }
  return all;
}

class FileAudit {
 public:
  FileAudit(const std::string& file, const FileAuditOptions& options, Diagnostics* diagnostics)
      : file_(file), options_(options), diagnostics_(diagnostics) {}

  std::optional<AuditTable> Run() {
    equations_ = OpenEquations(file_, diagnostics_);
    if (equations_ == nullptr) return {};
    const std::lock_guard lock(equations_->mutex());
    EquationResult<EquationsInfo> info = equations_->Load();
    if (!info) return Refused(info.failure);
    info_ = std::move(*info.value);
    if (info_.equations.empty() && info_.forms.empty()) {
      Error(0, "lists no numbered equations and no closed form to audit",
            "@equation(\"(1)\", gives=…)");
      return {};
    }
    // A closed form alone is audited in its own commands.
    if (info_.states.model.empty() && info_.equations.empty()) {
      info_.states.model = info_.forms.front().mechanism;
      info_.states.coordinates = info_.forms.front().commands;
    }
    if (!options_.model.empty()) info_.states.model = options_.model;
    is_formula_ = !IsEquationProgram(file_);
    if (!LoadMechanism() || !FindCoordinates() || !DrawStates()) return {};
    // Of formulas, arguments are known with the parameters.
    if (const auto again = equations_->Load()) {
      info_.forms = again.value->forms;
      info_.equations = again.value->equations;
    }
    AuditTable table{.mechanism = mechanism_.name,
                     .source = fmt::format("{}, at {} random states of {}", file_, states_.size(),
                                           mechanism_.file)};
    text_ = ReadWholeFile(file_).value_or("");
    for (size_t k = 0; k < info_.equations.size(); ++k) {
      if (options_.progress) {
        options_.progress(info_.equations[k].number,
                          static_cast<double>(k) / static_cast<double>(info_.equations.size()));
      }
      if (auto row = Audit(k)) table.rows.push_back(std::move(*row));
    }
    for (size_t k = 0; k < info_.forms.size(); ++k) AuditForm(k, &table);
    if (diagnostics_->has_errors()) return {};
    return table;
  }

 private:
  std::nullopt_t Refused(const EquationFailure& failure) {
    for (Finding finding : failure.Findings()) {
      if (finding.file.empty()) finding.file = file_;
      diagnostics_->Add(std::move(finding));
    }
    return std::nullopt;
  }
  void Error(int line, std::string message, std::string hint = "") {
    Finding finding;
    finding.file = file_;
    finding.line = line;
    finding.message = std::move(message);
    finding.hint = std::move(hint);
    diagnostics_->Add(std::move(finding));
  }

  bool LoadMechanism() {
    const StatesInfo& states = info_.states;
    if (states.model.empty()) {
      Error(0, "does not say at which states its equations are audited",
            "states(\"MODEL\", coordinates=[…])");
      return false;
    }
    const std::string folder = fs::path(file_).parent_path().string();
    auto model = FindModel(states.model, options_.model.empty() ? folder : ".");
    // Beside its own model.yaml, the file means that one.
    if (const fs::path beside = fs::path(folder) / "model.yaml"; fs::exists(beside)) {
      const LoadResult near = LoadRobot(beside.string(), {});
      if (near.mechanism && near.mechanism->name == states.model) model = beside.string();
    }
    if (!model) {
      Error(0, fmt::format("states: there is no model '{}'", states.model),
            ModelHint(states.model, folder) + "; --model FILE names one");
      return false;
    }
    LoadOptions load;
    load.overrides = states.parameters;
    load.gravity_W = states.gravity_W;
    LoadResult loaded = LoadRobot(*model, load);
    for (Finding finding : loaded.diagnostics.findings()) {
      if (finding.severity == Severity::kError) diagnostics_->Add(std::move(finding));
    }
    if (!loaded.mechanism) return false;
    mechanism_ = *std::move(loaded.mechanism);
    std::map<std::string, double> parameters;
    for (const Parameter& parameter : mechanism_.parameters) {
      parameters[parameter.name] = parameter.value;
      if (parameter.name.find('.') == std::string::npos) {
        parameter_units_[parameter.name] = parameter.unit;
      }
    }
    if (const auto failure = equations_->SetParameters(parameters)) {
      (void)Refused(*failure);
      return false;
    }
    for (const StatesInfo::Load& load_of : states.loads) {
      LoadSample sample{.body = mechanism_.FindBody(load_of.body),
                        .p_BoQ_B = load_of.point_B,
                        .force = load_of.force_W,
                        .moment = load_of.moment_W};
      if (sample.body < 0) {
        Error(0, fmt::format("states: {} has no body '{}'", mechanism_.name, load_of.body),
              DidYouMean(load_of.body, NamesOf(mechanism_.bodies)));
        return false;
      }
      loads_.push_back(sample);
    }
    return true;
  }

  bool FindCoordinates() {
    std::vector<NamedCoordinate> all = NamedCommandCoordinates(mechanism_);
    for (NamedCoordinate& joint : NamedJointCoordinates(mechanism_)) {
      all.push_back(std::move(joint));
    }
    const std::vector<std::string> names = NamesOf(all);
    for (const std::string& text : info_.states.coordinates) {
      Command command{.name = text};
      // "limb1.drive - limb1.drive_p"
      const size_t minus = text.find(" - ");
      for (const std::string& name :
           minus == std::string::npos
               ? std::vector<std::string>{text}
               : std::vector<std::string>{text.substr(0, minus), text.substr(minus + 3)}) {
        const auto found = std::ranges::find(all, name, &NamedCoordinate::name);
        if (found == all.end()) {
          Error(0, fmt::format("states: {} has no coordinate '{}'", mechanism_.name, name),
                DidYouMean(name, names));
          continue;
        }
        command.terms.push_back({found->coordinate, command.terms.empty() ? 1.0 : -1.0});
      }
      coordinates_.push_back(std::move(command));
    }
    for (const auto* named : {&info_.states.rates, &info_.states.accelerations}) {
      for (const auto& [name, value] : *named) CheckNamed(name);
    }
    for (const auto& [name, range] : info_.states.ranges) CheckNamed(name);
    if (diagnostics_->has_errors()) return false;
    // What arguments are by their names: x, x_d, x_dd.
    for (const std::string& name : info_.states.coordinates) {
      for (const auto& [suffix, what] :
           {std::pair{"", ""}, std::pair{"_d", ".velocity"}, std::pair{"_dd", ".acceleration"}}) {
        std::string reason, hint;
        if (const auto quantity = AuditQuantity::Parse(name + what, mechanism_, &reason, &hint)) {
          usual_.emplace(ShortName(name) + suffix, *quantity);
        }
      }
    }
    const CommandRank rank = RankCommands(mechanism_, coordinates_);
    if (rank.undriven == 0 && rank.redundant == 0) return true;
    Error(0,
          fmt::format("states: {} has {} degrees of freedom, and {} independent coordinates of "
                      "them are given",
                      mechanism_.name, rank.dofs,
                      static_cast<int>(coordinates_.size()) - rank.redundant),
          "coordinates are as many as there are degrees of freedom, and independent at home");
    return false;
  }

  void CheckNamed(const std::string& name) {
    if (Contains(info_.states.coordinates, name)) return;
    Error(0, fmt::format("states: '{}' is not one of the coordinates", name),
          DidYouMean(name, info_.states.coordinates));
  }

  [[nodiscard]] std::array<double, 2> RangeOf(size_t k) const {
    const std::string& name = info_.states.coordinates[k];
    if (const auto stated = info_.states.ranges.find(name); stated != info_.states.ranges.end()) {
      return stated->second;
    }
    const Command& command = coordinates_[k];
    const Coordinate& c = command.terms.front().coordinate;
    if (command.terms.size() == 1 && c.kind == Coordinate::Kind::kDrive) {
      const CoordinateRange& range = mechanism_.drives[static_cast<size_t>(c.index)].range;
      if (std::isfinite(range.lower) && std::isfinite(range.upper)) {
        return {range.lower, range.upper};
      }
    }
    const double half = IsLength(mechanism_, c) ? kDefaultRange_m * CharacteristicLength(mechanism_)
                                                : kDefaultRange_rad;
    double home = 0.0;
    for (const Command::Term& term : command.terms) {
      home += term.factor * HomeValue(mechanism_, term.coordinate);
    }
    return {home - half, home + half};
  }

  bool DrawStates() {
    std::mt19937_64 random(kSeed);
    // 53 random bits: the same states on every machine.
    const auto draw = [&] { return 2.0 * (static_cast<double>(random() >> 11) * 0x1p-53) - 1.0; };
    const auto n = static_cast<Eigen::Index>(coordinates_.size());
    ReducedModel model(mechanism_, coordinates_);
    const int wanted = options_.samples > 0 ? options_.samples : info_.states.samples;
    std::string last;
    for (int tries = 0; static_cast<int>(states_.size()) < wanted && tries < kTries * wanted;
         ++tries) {
      VecX q(n), v(n), a(n);
      for (Eigen::Index k = 0; k < n; ++k) {
        const auto [from, to] = RangeOf(static_cast<size_t>(k));
        const double half = 0.5 * (to - from);
        const auto size = [&](const std::map<std::string, double>& stated, double usual) {
          const auto found = stated.find(info_.states.coordinates[static_cast<size_t>(k)]);
          return found == stated.end() ? usual * half : found->second;
        };
        q[k] = 0.5 * (from + to) + half * draw();
        v[k] = size(info_.states.rates, kRatesPerRange) * draw();
        a[k] = size(info_.states.accelerations, kAccelerationsPerRange) * draw();
      }
      model.Restart();
      std::string trouble = Take(&model, q, v, a);
      if (!trouble.empty()) last = std::move(trouble);
    }
    if (static_cast<int>(states_.size()) == wanted) return true;
    Error(
        0,
        fmt::format("only {} of {} random states can be reached: {}", states_.size(), wanted, last),
        "states(…, ranges={…}) keeps them where the mechanism can be");
    return false;
  }

  // "" or why the state is none.
  std::string Take(ReducedModel* model, const VecX& q, const VecX& v, const VecX& a) {
    AuditState state;
    state.mechanism = &mechanism_;
    const auto n = q.size();
    // What acts at rest, and because of the velocities.
    RunSummary summary = model->Move(q, VecX::Zero(n), VecX::Zero(n));
    if (summary.ok()) summary = model->AllForces({});
    if (summary.ok()) summary = model->Motions(&state.T);
    if (!summary.ok()) return summary.message;
    state.mass = model->MassMatrix(state.T);
    state.drive_rates = model->DriveRates(state.T);
    state.gravity = model->Forces(state.T, {});
    const VecX gravity_force = model->drive_force();
    summary = model->Move(q, v, VecX::Zero(n));
    if (summary.ok()) summary = model->AllForces({});
    if (!summary.ok()) return summary.message;
    const VecX no_acceleration = model->drive_force();
    AuditState slow = state;
    slow.states = model->states();
    state.bias = model->Forces(state.T, {});
    summary = model->Move(q, v, a);
    if (summary.ok()) summary = model->AllForces({});
    if (!summary.ok()) return summary.message;
    const VecX no_loads = model->drive_force();
    summary = model->AllForces(loads_);
    if (!summary.ok()) return summary.message;
    state.states = model->states();
    state.sample = model->sample();
    state.drive_force = model->drive_force();
    form_states_.push_back({q, v, a});
    shares_.push_back({.gravity = gravity_force,
                       .velocity = no_acceleration - gravity_force,
                       .inertia = no_loads - no_acceleration,
                       .loads = state.drive_force - no_loads});
    slow.sample = state.sample;
    slow.drive_force = no_acceleration;
    slow.bias = state.bias;
    slow_.push_back(std::move(slow));
    states_.push_back(std::move(state));
    return "";
  }

  // What an argument or a result is; an error where it is nothing.
  std::optional<AuditQuantity> Quantity(const EquationInfo& equation, const std::string& text) {
    std::string reason, hint;
    auto quantity = AuditQuantity::Parse(text, mechanism_, &reason, &hint);
    if (!quantity) {
      Error(equation.line, fmt::format("{}: {}", equation.number, reason), hint);
      return {};
    }
    for (const double value : quantity->At(states_.front()).values) {
      if (std::isfinite(value)) continue;
      Error(equation.line, fmt::format("{}: '{}' has no such element, or no value there",
                                       equation.number, QuotedValue(text)));
      return {};
    }
    return quantity;
  }

  // The quantity that an argument stands for.
  std::string GivenAs(const EquationInfo& equation, const std::string& argument) {
    if (const auto given = equation.given.find(argument); given != equation.given.end()) {
      return given->second;
    }
    for (const auto& [suffix, what] :
         {std::pair{"", ""}, std::pair{"_dd", ".acceleration"}, std::pair{"_d", ".velocity"}}) {
      if (!argument.ends_with(suffix)) continue;
      const std::string name = argument.substr(0, argument.size() - std::string(suffix).size());
      for (const std::string& coordinate : info_.states.coordinates) {
        if (coordinate == name || ShortName(coordinate) == name) return coordinate + what;
      }
    }
    Error(equation.line,
          fmt::format("{}: nothing says what its argument '{}' is", equation.number, argument),
          "given={\"" + argument + "\": \"QUANTITY\"}");
    return "";
  }

  // Rows of one equation: arguments and truth at all states, of all indices.
  struct Case {
    // Of one combination of indices: what it gives, and what its arguments are.
    struct Part {
      AuditQuantity gives;
      std::vector<std::pair<std::string, AuditQuantity>> arguments;
    };
    std::vector<Part> parts;
    std::vector<ArgumentRow> rows;
    AuditValues truth;
    int columns = 0;
    bool vanishes = false;
  };

  std::optional<Case> MakeCase(const EquationInfo& equation) {
    Case made;
    const auto combinations = Combinations(equation.each);
    std::map<std::string, size_t> places;  // of terms
    for (const auto& indices : combinations) {
      const auto gives = Quantity(equation, Filled(equation.gives, indices));
      if (!gives) return {};
      made.vanishes = made.vanishes || gives->vanishes();
      std::vector<std::pair<std::string, AuditQuantity>> arguments;
      for (const std::string& argument : equation.arguments) {
        if (indices.contains(argument)) continue;
        const std::string text = GivenAs(equation, argument);
        const auto quantity =
            text.empty() ? std::nullopt : Quantity(equation, Filled(text, indices));
        if (quantity) arguments.emplace_back(argument, *quantity);
      }
      if (diagnostics_->has_errors()) return {};
      for (size_t k = 0; k < states_.size(); ++k) {
        ArgumentRow row;
        for (const auto& [name, quantity] : usual_) row[name] = quantity.At(states_[k]);
        for (const auto& [name, quantity] : arguments) row[name] = quantity.At(states_[k]);
        for (const auto& [name, value] : indices) {
          if (!Contains(equation.arguments, name)) continue;
          const auto number = ParsedNumber(value);
          row[name] = number
                          ? Argument{.whole = *number == std::floor(*number), .values = {*number}}
                          : Argument{.text = value};
        }
        const Argument truth = gives->At(states_[k]);
        made.columns = truth.columns;
        made.truth.push_back(truth.values);
        made.rows.push_back(std::move(row));
      }
      made.parts.push_back({*gives, std::move(arguments)});
    }
    return made;
  }

  static std::optional<double> ParsedNumber(const std::string& text) {
    try {
      size_t end = 0;
      const double value = std::stod(text, &end);
      return end == text.size() ? std::optional(value) : std::nullopt;
    } catch (const std::exception&) {
      return {};
    }
  }

  using Terms = std::vector<KnownTerm>;
  static void AddTerm(const std::string& name, std::vector<double> values, Terms* terms) {
    const auto known = std::ranges::find(*terms, name, &KnownTerm::name);
    KnownTerm& term = known != terms->end() ? *known : terms->emplace_back(KnownTerm{name, {}});
    term.values.push_back(std::move(values));
  }

  // Terms that may be missing, at all states.
  Terms TermsOf(const Case& made) {
    Terms terms;
    for (const Case::Part& part : made.parts) {
      for (size_t k = 0; k < states_.size(); ++k) AddTerms(part, k, &terms);
    }
    std::erase_if(terms,
                  [&](const KnownTerm& term) { return term.values.size() != made.truth.size(); });
    return terms;
  }

  // Shares of the quantity itself, vectors that are given and products of two of them.
  void AddTerms(const Case::Part& part, size_t k, Terms* terms) {
    if (const int drive = part.gives.drive_of_force(); drive >= 0) {
      const Shares& shares = shares_[k];
      AddTerm("the share of the weight", {shares.gravity[drive]}, terms);
      AddTerm(kOfVelocities, {shares.velocity[drive]}, terms);
      AddTerm("the share of the accelerations", {shares.inertia[drive]}, terms);
      if (!loads_.empty()) AddTerm("the share of the loads", {shares.loads[drive]}, terms);
    }
    if (part.gives.is_acceleration()) {
      AddTerm("the part of the velocities (J̇ q̇)", part.gives.At(slow_[k]).values, terms);
    }
    const size_t size = part.gives.At(states_[k]).values.size();
    std::vector<std::pair<std::string, Vec3>> vectors;
    for (const auto& [name, given] : part.arguments) {
      const Argument value = given.At(states_[k]);
      if (value.values.size() == size) AddTerm(name, value.values, terms);
      if (value.columns == 0 && value.rows == 3) {
        vectors.emplace_back(name, Vec3(value.values.data()));
      }
    }
    AddParameterTerms(k, size, part.arguments, terms);
    if (size != 3) return;
    for (size_t i = 0; i < vectors.size(); ++i) {
      for (size_t j = 0; j < vectors.size(); ++j) {
        const auto& [a, x] = vectors[i];
        const auto& [b, y] = vectors[j];
        if (i < j) AddVector(fmt::format("{} × {}", a, b), x.cross(y), terms);
        if (i != j) AddVector(fmt::format("{} × ({} × {})", a, a, b), x.cross(x.cross(y)), terms);
        AddVector(fmt::format("({}·{}) {}", a, b, a), x.dot(y) * x, terms);
      }
    }
  }

  // A parameter, and a parameter times what is given.
  void AddParameterTerms(size_t k, size_t size,
                         const std::vector<std::pair<std::string, AuditQuantity>>& arguments,
                         Terms* terms) {
    for (const Parameter& parameter : mechanism_.parameters) {
      if (parameter.value == 0.0 || parameter.value == 1.0) continue;
      if (size == 1) AddTerm(parameter.name, {parameter.value}, terms);
      for (const auto& [name, given] : arguments) {
        std::vector<double> values = given.At(states_[k]).values;
        if (values.size() != size) continue;
        for (double& value : values) value *= parameter.value;
        AddTerm(fmt::format("{} {}", parameter.name, name), std::move(values), terms);
      }
    }
  }
  static void AddVector(const std::string& name, const Vec3& value, Terms* terms) {
    AddTerm(name, {value[0], value[1], value[2]}, terms);
  }

  std::optional<AuditRow> Audit(size_t index) {
    const EquationInfo& equation = info_.equations[index];
    auto made = MakeCase(equation);
    if (!made) return {};
    AuditRow row{.equation = equation.number,
                 .erratum = equation.erratum,
                 .printed = equation.printed,
                 .corrected = equation.corrected,
                 .unit = equation.unit.empty() ? "1" : equation.unit,
                 .note = equation.note};
    if (row.printed.empty()) row.printed = "line " + std::to_string(equation.line);
    if (equation.has_corrected && row.corrected.empty()) row.corrected = "as corrected in the file";
    row.approximation = equation.approximation;
    auto printed = equations_->Evaluate(index, made->rows, false);
    if (printed && !SizesFit(equation, *printed.value, &*made)) return {};
    std::optional<AuditValues> corrected;
    if (equation.has_corrected) {
      auto values = equations_->Evaluate(index, made->rows, true);
      if (!values) {
        (void)Refused(values.failure);
        return {};
      }
      if (!SizesFit(equation, *values.value, &*made)) return {};
      corrected = std::move(*values.value);
    } else if (!printed) {
      (void)Refused(printed.failure);
      return {};
    }
    double terms =
        SizeOfTerms(index, *made, corrected ? *corrected : *printed.value, corrected.has_value());
    if (made->vanishes) {
      terms = std::max(terms, SizeBySigns(index, *made, corrected.has_value()));
    }
    Judge(equation, *made, printed ? &*printed.value : nullptr, corrected ? &*corrected : nullptr,
          terms, &row);
    if (!printed) {
      row.note += (row.note.empty() ? "" : "; ") +
                  fmt::format("as printed it cannot be evaluated: {}", printed.failure.Text());
    }
    if (options_.search && printed &&
        (row.verdict == AuditVerdict::kWrong || row.verdict == AuditVerdict::kWrongAsGiven ||
         row.verdict == AuditVerdict::kNearly)) {
      Search(index, *made, *printed.value, &row);
    }
    return row;
  }

  bool SizesFit(const EquationInfo& equation, const AuditValues& values, Case* made) {
    AuditValues& truth = made->truth;
    for (size_t k = 0; k < values.size() && k < truth.size(); ++k) {
      // As many numbers as there are must vanish.
      if (made->vanishes) truth[k].assign(std::max<size_t>(values[k].size(), 1), 0.0);
      if (values[k].size() == truth[k].size()) continue;
      Error(equation.line, fmt::format("{}: gives {} numbers, and {} has {}", equation.number,
                                       values[k].size(), equation.gives, truth[k].size()));
      return false;
    }
    return true;
  }

  // How large the terms are of which the equation is made: by how much it changes with its
  // arguments. 0 where it depends on none; NaN where that cannot be seen.
  double SizeOfTerms(size_t index, const Case& made, const AuditValues& at, bool corrected) {
    std::mt19937_64 random(kSeed + 1);
    const auto draw = [&] { return 2.0 * (static_cast<double>(random() >> 11) * 0x1p-53) - 1.0; };
    std::map<std::string, double> sizes;
    for (const ArgumentRow& row : made.rows) {
      for (const auto& [name, argument] : row) {
        for (const double value : argument.values) {
          sizes[name] = std::max(sizes[name], std::abs(value));
        }
      }
    }
    const EquationInfo& equation = info_.equations[index];
    std::vector<ArgumentRow> nudged = made.rows;
    for (ArgumentRow& row : nudged) {
      for (auto& [name, argument] : row) {
        if (equation.each.contains(name)) continue;
        for (double& value : argument.values) value += kNudge * sizes[name] * draw();
      }
    }
    const auto beside = equations_->Evaluate(index, nudged, corrected);
    if (!beside) return kNan;
    double largest = 0.0;
    for (size_t k = 0; k < nudged.size(); ++k) {
      for (size_t i = 0; i < at[k].size(); ++i) {
        const double change = std::abs((*beside.value)[k][i] - at[k][i]);
        if (change > largest) largest = change;
      }
    }
    return largest / kNudge;
  }

  // The same where the terms cancel whatever the arguments are: by how much it changes with the
  // signs in its text.
  double SizeBySigns(size_t index, const Case& made, bool corrected) {
    const EquationInfo& equation = info_.equations[index];
    SlipSearch search{.printed = {}, .truth = made.truth};
    search.text = text_;
    search.line = corrected ? equation.corrected_line : equation.line;
    search.end = corrected ? equation.corrected_end : equation.end;
    search.language = fs::path(file_).extension().string();
    double largest = 0.0;
    for (const TextEdit& edit : EditsOf(search)) {
      if (edit.kind != TextEdit::Kind::kSign) continue;
      const auto values = equations_->EvaluateEdited(edit.In(text_), index, made.rows, corrected);
      if (!values) continue;
      for (const auto& row : *values.value) {
        for (const double value : row) {
          if (std::abs(value) > largest) largest = std::abs(value);
        }
      }
    }
    return largest;
  }

  void Judge(const EquationInfo& equation, const Case& made, const AuditValues* printed,
             const AuditValues* corrected, double terms, AuditRow* row) {
    double size = 0.0;
    for (const auto& values : made.truth) {
      for (const double value : values) size = std::max(size, std::abs(value));
    }
    const auto residual = [&](const AuditValues* values) {
      double largest = 0.0;
      if (values == nullptr) return kNan;
      for (size_t k = 0; k < values->size(); ++k) {
        for (size_t i = 0; i < (*values)[k].size(); ++i) {
          const double difference = std::abs((*values)[k][i] - made.truth[k][i]);
          if (!(difference <= largest)) largest = difference;
          if (std::isnan(difference)) return difference;
        }
      }
      return largest;
    };
    row->residual_printed = residual(printed);
    row->residual_corrected = corrected != nullptr ? residual(corrected) : row->residual_printed;
    if (terms == 0.0 && (made.vanishes || size == 0.0)) {
      row->verdict = AuditVerdict::kNotTestable;
      row->note += (row->note.empty() ? "" : "; ") +
                   std::string("it does not depend on its arguments: nothing was verified");
      return;
    }
    const bool vanishing = made.vanishes || !(size > kVanishes * terms);
    row->scale = vanishing && std::isfinite(terms) ? terms : size;
    row->limit = kRight * std::max(size, std::isfinite(terms) ? terms : 0.0);
    // Terms that are much larger than their sum would hide an error of it.
    if (!vanishing) row->limit = std::min(row->limit, kNearly * size);
    row->digits = std::max(0.0, -std::log10(row->residual_printed / row->scale));
    if (corrected != nullptr || equation.approximation > 0.0) {
      row->verdict = VerdictOf(*row);
      if (corrected == nullptr && row->verdict == AuditVerdict::kWrongAndUnfixed) {
        row->verdict = row->residual_printed <= equation.approximation
                           ? AuditVerdict::kApproximation
                           : AuditVerdict::kWrongAsGiven;
      }
      return;
    }
    row->verdict = row->residual_printed <= row->limit             ? AuditVerdict::kOk
                   : row->residual_printed <= kNearly * row->scale ? AuditVerdict::kNearly
                                                                   : AuditVerdict::kWrongAsGiven;
  }

  void Search(size_t index, const Case& made, const AuditValues& printed, AuditRow* row) {
    const EquationInfo& equation = info_.equations[index];
    SlipSearch search{.printed = printed, .truth = made.truth};
    search.limit = row->limit;
    search.columns = made.columns;
    search.terms = TermsOf(made);
    search.text = text_;
    search.line = equation.line;
    search.end = equation.end;
    search.language = fs::path(file_).extension().string();
    search.parameters = parameter_units_;
    if (!made.rows.empty()) {
      for (const auto& [name, argument] : made.rows.front()) {
        // The quantity itself would make anything right.
        bool itself = true;
        for (size_t k = 0; k < made.rows.size(); ++k) {
          itself = itself && made.rows[k].at(name).values == made.truth[k];
        }
        if (!itself) search.arguments.push_back(name);
      }
    }
    const std::vector<ArgumentRow> few(
        made.rows.begin(),
        made.rows.begin() + static_cast<std::ptrdiff_t>(std::min(search.few, made.rows.size())));
    search.evaluate = [&](const std::string& text, bool only_few) -> std::optional<AuditValues> {
      auto values = equations_->EvaluateEdited(text, index, only_few ? few : made.rows, false);
      if (!values) return {};
      return std::move(*values.value);
    };
    for (const Slip& slip : FindSlips(search)) {
      row->slips.push_back(slip.edited.empty() ? slip.what : slip.what + ": " + slip.edited);
    }
  }

  // A closed form whose commands are the states' coordinates: drives' positions and forces. Rates
  // and accelerations are the derivatives of the positions.
  void AuditForm(size_t index, AuditTable* table) {
    const FormInfo& form = info_.forms[index];
    if (form.mechanism != mechanism_.name) return;
    std::vector<size_t> places;
    for (const std::string& command : form.commands) {
      const auto found =
          std::ranges::find_if(info_.states.coordinates, [&](const std::string& coordinate) {
            return coordinate == command || ShortName(coordinate) == command;
          });
      if (found == info_.states.coordinates.end()) return;
      places.push_back(static_cast<size_t>(found - info_.states.coordinates.begin()));
    }
    if (places.size() != info_.states.coordinates.size()) return;
    std::vector<Equations::FormState> states = form_states_;
    for (size_t k = 0; k < states.size(); ++k) {
      for (size_t i = 0; i < places.size(); ++i) {
        const auto to = static_cast<Eigen::Index>(i), from = static_cast<Eigen::Index>(places[i]);
        states[k].q[to] = form_states_[k].q[from];
        states[k].v[to] = form_states_[k].v[from];
        states[k].a[to] = form_states_[k].a[from];
      }
    }
    const bool right = AuditPart(index, states, false, table);
    if (form.has_forces && (form.takes_loads || loads_.empty())) {
      (void)AuditPart(index, states, true, table, right);
    }
  }

  // Whether it is right. `search`: for slips, where it is wrong.
  bool AuditPart(size_t index, const std::vector<Equations::FormState>& states, bool forces,
                 AuditTable* table, bool search = true) {
    const std::vector<std::string> drives = NamesOf(mechanism_.drives),
                                   bodies = NamesOf(mechanism_.bodies);
    Case made;
    AuditValues given;
    const FormInfo& form = info_.forms[index];
    AuditRow row{.equation = forces ? "drive forces" : "drive positions",
                 .printed = fmt::format("closed form, line {}", form.line),
                 .unit = "1"};
    for (size_t k = 0; k < states.size(); ++k) {
      const auto sample = equations_->Sample(index, states[k].q, states[k].v, states[k].a, loads_,
                                             bodies, drives, forces);
      using Kind = EquationFailure::Kind;
      if (!sample &&
          (sample.failure.kind == Kind::kUnreachable || sample.failure.kind == Kind::kSingular)) {
        // The reference has a pose there.
        row.note = "it cannot be evaluated: " + sample.failure.Text();
      } else if (!sample) {
        (void)Refused(sample.failure);
        return false;
      }
      std::vector<double> truth, values;
      if (sample) values = sample.value->forces;
      if (!sample) values.assign(drives.size(), kNan);
      if (sample && !forces) values.clear();
      for (size_t d = 0; sample && !forces && d < drives.size(); ++d) {
        values.push_back(sample.value->drives[d].value);
      }
      const VecX right = forces ? states_[k].drive_force : DriveValues(states_[k], 0);
      truth.assign(right.begin(), right.end());
      given.push_back(std::move(values));
      made.truth.push_back(std::move(truth));
    }
    Judge({}, made, &given, nullptr, kNan, &row);
    if (options_.search && search && row.verdict != AuditVerdict::kOk) {
      SlipSearch slips{.printed = given, .truth = made.truth};
      slips.limit = row.limit;
      if (forces) slips.terms = TermsOfForces();
      slips.text = text_;
      slips.line = 1;
      slips.end = 1 + static_cast<int>(std::ranges::count(text_, '\n'));
      slips.language = fs::path(file_).extension().string();
      slips.parameters = parameter_units_;
      slips.evaluate = [&](const std::string& text, bool few) -> std::optional<AuditValues> {
        const auto count = few ? std::min(slips.few, states.size()) : states.size();
        auto values = equations_->SampleEdited(
            text, index, forces,
            {states.begin(), states.begin() + static_cast<std::ptrdiff_t>(count)}, loads_, bodies,
            drives);
        if (!values) return {};
        return std::move(*values.value);
      };
      for (const Slip& slip : FindSlips(slips)) {
        row.slips.push_back(slip.edited.empty() ? slip.what : slip.what + ": " + slip.edited);
      }
    }
    const bool right = row.verdict == AuditVerdict::kOk;
    table->rows.push_back(std::move(row));
    return right;
  }

  // Of all drives' forces: their shares, and a parameter times rates or accelerations (a damper, a
  // rotor).
  Terms TermsOfForces() {
    Terms terms;
    for (size_t k = 0; k < states_.size(); ++k) {
      const Shares& shares = shares_[k];
      const auto add = [&](const std::string& name, const VecX& values, double factor = 1.0) {
        const VecX scaled = factor * values;
        AddTerm(name, {scaled.begin(), scaled.end()}, &terms);
      };
      add("the share of the weight", shares.gravity);
      add(kOfVelocities, shares.velocity);
      add("the share of the accelerations", shares.inertia);
      const VecX rates = DriveValues(states_[k], 1), accelerations = DriveValues(states_[k], 2);
      for (const Parameter& parameter : mechanism_.parameters) {
        add(parameter.name + " times each drive's rate", rates, parameter.value);
        add(parameter.name + " times each drive's acceleration", accelerations, parameter.value);
      }
    }
    return terms;
  }

  // Positions, rates or accelerations of all drives.
  [[nodiscard]] VecX DriveValues(const AuditState& state, int order) const {
    VecX values(static_cast<Eigen::Index>(mechanism_.drives.size()));
    for (Eigen::Index d = 0; d < values.size(); ++d) {
      const Coordinate drive{Coordinate::Kind::kDrive, static_cast<int>(d), 0};
      values[d] = AuditQuantity::OfCoordinate(drive, order).At(state).values.front();
    }
    return values;
  }

  struct Shares {
    VecX gravity, velocity, inertia, loads;
  };

  const std::string& file_;
  const FileAuditOptions& options_;
  Diagnostics* diagnostics_;
  std::shared_ptr<Equations> equations_;
  EquationsInfo info_;
  Mechanism mechanism_;
  std::map<std::string, std::string> parameter_units_;
  std::vector<Command> coordinates_;
  std::map<std::string, AuditQuantity> usual_;
  std::vector<LoadSample> loads_;
  std::vector<AuditState> states_, slow_;  // slow: without accelerations
  std::vector<Shares> shares_;             // of the drives' forces
  std::vector<Equations::FormState> form_states_;
  std::string text_;
  bool is_formula_ = false;  // which names what it uses by itself
};

}  // namespace

std::optional<AuditTable> AuditFile(const std::string& file, const FileAuditOptions& options,
                                    Diagnostics* diagnostics) {
  return FileAudit(file, options, diagnostics).Run();
}

}  // namespace mbv
