// Equations as formulas in YAML.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstring>

#include "base/text.h"
#include "equations/equations.h"
#include "equations/formula.h"
#include "model_file/yaml/yaml_reader.h"

namespace mbv {
namespace {

// A formula with its place, compiled when the parameters are known.
struct Written {
  std::string name;  // what it defines: a name, a drive, a channel
  std::string text, unit = {};
  const YamlNode* node = nullptr;
  DifferentiableFormula formula = {};
};

struct Form {
  FormInfo info;
  std::vector<std::string> arguments;
  std::vector<Written> define, drives, rates, forces, outputs;
  std::map<std::string, std::vector<double>> covers;
};

struct Equation {
  EquationInfo info;
  std::vector<Written> define;
  Written printed, corrected;
  std::vector<std::string> names;  // beside the parameters
};

std::string ShortName(const std::string& command) {
  const size_t dot = command.rfind('.');
  return dot == std::string::npos ? command : command.substr(dot + 1);
}

class FormulaEquations final : public Equations {
 public:
  FormulaEquations(std::string file, std::string text)
      : file_(std::move(file)), text_(std::move(text)) {}

  EquationResult<EquationsInfo> Load() override {
    if (!loaded_) Read();
    loaded_ = true;
    if (failed_) return {{}, *failed_};
    EquationsInfo info{.forms = {}, .equations = {}, .states = states_};
    for (const Form& form : forms_) info.forms.push_back(form.info);
    for (const Equation& equation : equations_) info.equations.push_back(equation.info);
    return {std::move(info)};
  }

  std::optional<EquationFailure> SetParameters(
      const std::map<std::string, double>& parameters) override {
    if (auto info = Load(); !info) return std::move(info.failure);
    if (compiled_ && parameters == parameters_) return {};
    std::vector<std::string> before, names;
    for (const auto& [name, value] : parameters_) before.push_back(name);
    for (const auto& [name, value] : parameters) names.push_back(name);
    const bool same_names = compiled_ && before == names;
    parameters_ = parameters;
    if (same_names) return {};
    parameter_names_ = std::move(names);
    used_.assign(parameter_names_.size(), false);
    if (auto failure = Compile()) return failure;
    compiled_ = true;
    return {};
  }

  std::vector<std::string> ReadParameters() override {
    std::vector<std::string> read;
    for (size_t k = 0; k < used_.size(); ++k) {
      if (used_[k]) read.push_back(parameter_names_[k]);
    }
    return read;
  }

  EquationResult<std::map<std::string, std::vector<double>>> Covers(size_t form) override {
    std::map<std::string, std::vector<double>> stated = forms_.at(form).covers;
    for (auto& [key, numbers] : stated) {
      for (size_t k = 0; k < numbers.size(); ++k) {
        const Written& written = covers_.at(form).at(key)[k];
        numbers[k] =
            written.text.empty() ? kNan : written.formula.At({.names = ParameterJets()}).value;
      }
    }
    return {std::move(stated)};
  }

  EquationResult<FormSample> Sample(size_t index, const VecX& q, const VecX& v, const VecX& a,
                                    const std::vector<LoadSample>&, const std::vector<std::string>&,
                                    const std::vector<std::string>& drives,
                                    bool with_forces) override {
    const Form& form = forms_.at(index);
    DifferentiableFormula::Values values{.names = ParameterJets()};
    const size_t first = values.names.size(), n = form.arguments.size();
    for (Eigen::Index k = 0; k < q.size(); ++k) values.names.push_back({q[k], v[k], a[k]});
    if (with_forces && !form.forces.empty()) AddPartials(form, values.names, first, n, &values);
    for (const Written& name : form.define) values.names.push_back(name.formula.At(values));
    FormSample sample;
    for (const auto& [list, what, jets, numbers] :
         {std::tuple{&form.drives, "positions", &sample.drives, (std::vector<double>*)nullptr},
          std::tuple{&form.rates, "rates", (std::vector<Jet>*)nullptr, &sample.rates},
          std::tuple{&form.forces, "forces", (std::vector<Jet>*)nullptr, &sample.forces}}) {
      if (list->empty() || (numbers == &sample.forces && !with_forces)) continue;
      for (const std::string& drive : drives) {
        const auto found = std::ranges::find(*list, drive, &Written::name);
        if (found == list->end()) {
          return {{}, Wrong(fmt::format("{}: nothing for {}", what, drive), list->front())};
        }
        const Jet value = found->formula.At(values);
        if (jets != nullptr) {
          jets->push_back(value);
        } else {
          numbers->push_back(value.value);
        }
        if (!std::isfinite(value.value)) return {{}, NotFinite(*found)};
      }
    }
    if (with_forces) {
      for (const Written& output : form.outputs) {
        sample.outputs.push_back(output.formula.At(values).value);
      }
    }
    return {std::move(sample)};
  }

  EquationResult<std::vector<std::vector<double>>> SampleEdited(
      const std::string& text, size_t form, bool forces, const std::vector<FormState>& states,
      const std::vector<LoadSample>& loads, const std::vector<std::string>& bodies,
      const std::vector<std::string>& drives) override {
    FormulaEquations edited(file_, text);
    if (auto failure = edited.SetParameters(parameters_)) return {{}, std::move(*failure)};
    std::vector<std::vector<double>> rows;
    for (const FormState& state : states) {
      auto sample = edited.Sample(form, state.q, state.v, state.a, loads, bodies, drives, forces);
      if (!sample) return {{}, std::move(sample.failure)};
      rows.push_back(sample.value->forces);
      if (forces) continue;
      rows.back().clear();
      for (const Jet& drive : sample.value->drives) rows.back().push_back(drive.value);
    }
    return {std::move(rows)};
  }

  EquationResult<std::vector<std::vector<double>>> Evaluate(size_t index,
                                                            const std::vector<ArgumentRow>& rows,
                                                            bool corrected) override {
    const Equation& equation = equations_.at(index);
    std::vector<std::vector<double>> results;
    for (const ArgumentRow& row : rows) {
      DifferentiableFormula::Values values{.names = ParameterJets()};
      for (const std::string& name : equation.names) {
        const auto found = row.find(name);
        values.names.push_back(
            {found == row.end() ? kNan : found->second.values.at(0), kNan, kNan});
      }
      for (const Written& name : equation.define) {
        values.names.push_back(name.formula.At(values));
      }
      const Written& which = corrected ? equation.corrected : equation.printed;
      results.push_back({which.formula.At(values).value});
    }
    return {std::move(results)};
  }

  EquationResult<std::vector<std::vector<double>>> EvaluateEdited(
      const std::string& text, size_t equation, const std::vector<ArgumentRow>& rows,
      bool corrected) override {
    FormulaEquations edited(file_, text);
    if (auto failure = edited.SetParameters(parameters_)) return {{}, std::move(*failure)};
    return edited.Evaluate(equation, rows, corrected);
  }

 private:
  void Read() {
    YamlReader yaml(file_);
    root_ = yaml.Parse(text_);
    if (root_ != nullptr) {
      ReadAll(&yaml, *root_);
    }
    if (!yaml.has_errors()) return;
    failed_ = EquationFailure{.kind = EquationFailure::Kind::kWrong,
                              .message = "its formulas cannot be read",
                              .file = file_};
    failed_->findings = yaml.diagnostics().findings();
  }

  void ReadAll(YamlReader* yaml, const YamlNode& node) {
    YamlMap map(yaml, &node, "",
                {"equations_of", "commands", "define", "drives", "rates", "forces", "outputs",
                 "covers", "states", "audit"});
    if (!map.valid()) return;
    if (const YamlNode* states = map.Find("states")) ReadStates(yaml, *states);
    if (map.Has("drives") || map.Has("forces")) ReadForm(yaml, map);
    if (const YamlNode* audit = map.Find("audit")) ReadAudit(yaml, *audit);
    if (forms_.empty() && equations_.empty() && !yaml->has_errors()) {
      yaml->Error(node, "has neither a closed form nor an audit",
                  "`drives:` and `forces:` make a closed form, `audit:` lists equations");
    }
  }

  void ReadForm(YamlReader* yaml, const YamlMap& map) {
    Form form;
    if (const YamlNode* name = map.Required("equations_of")) {
      form.info.mechanism = yaml->Text(*name, "equations_of").value_or("");
    }
    if (const YamlNode* commands = map.Required("commands")) ReadCommands(yaml, *commands, &form);
    form.info.line = map.node()->line;
    form.define = ReadFormulas(yaml, map, "define");
    form.drives = ReadFormulas(yaml, map, "drives");
    form.rates = ReadFormulas(yaml, map, "rates");
    form.forces = ReadFormulas(yaml, map, "forces");
    form.outputs = ReadFormulas(yaml, map, "outputs");
    form.info.has_forces = !form.forces.empty();
    form.info.has_rates = !form.rates.empty();
    for (const Written& output : form.outputs) {
      form.info.outputs.emplace_back(output.name, output.unit);
    }
    std::map<std::string, std::vector<Written>> covers;
    if (const YamlNode* node = map.Find("covers"); node != nullptr && node->is_map()) {
      form.info.covers_stated = true;
      for (const YamlEntry& entry : yaml->Entries(*node, "covers")) {
        std::vector<const YamlNode*> items = {entry.value.get()};
        if (entry.value->is_sequence()) {
          items = *yaml->Items(*entry.value, JoinPath("covers", entry.key));
        }
        for (const YamlNode* item : items) {
          Written written{.name = entry.key, .text = "", .node = item};
          if (!item->is_null()) {
            written.text = yaml->Text(*item, JoinPath("covers", entry.key)).value_or("");
          }
          covers[entry.key].push_back(std::move(written));
          form.covers[entry.key].push_back(kNan);
        }
      }
    } else if (node != nullptr && node->text != "unchecked") {
      yaml->Error(*node, "covers is neither a map nor 'unchecked'");
    }
    covers_.push_back(std::move(covers));
    forms_.push_back(std::move(form));
  }

  void ReadCommands(YamlReader* yaml, const YamlNode& node, Form* form) {
    if (node.is_map()) {
      for (const YamlEntry& entry : yaml->Entries(node, "commands")) {
        form->arguments.push_back(entry.key);
        form->info.commands.push_back(
            yaml->Text(*entry.value, JoinPath("commands", entry.key)).value_or(""));
      }
      return;
    }
    const auto items = yaml->Items(node, "commands");
    for (const YamlNode* item : items ? *items : std::vector<const YamlNode*>{}) {
      const std::string name = yaml->Text(*item, "commands").value_or("");
      form->info.commands.push_back(name);
      form->arguments.push_back(ShortName(name));
    }
  }

  std::vector<Written> ReadFormulas(YamlReader* yaml, const YamlMap& map, const std::string& key) {
    std::vector<Written> all;
    const YamlNode* node = map.Find(key);
    if (node == nullptr) return all;
    for (const YamlEntry& entry : yaml->Entries(*node, map.PathOf(key))) {
      const std::string path = JoinPath(map.PathOf(key), entry.key);
      Written written{.name = entry.key, .text = "", .node = entry.value.get()};
      if (entry.value->is_map()) {
        const YamlMap parts(yaml, entry.value.get(), path, {"formula", "unit"});
        if (const YamlNode* unit = parts.Find("unit")) {
          written.unit = yaml->Text(*unit, parts.PathOf("unit")).value_or("");
        }
        written.node = parts.Required("formula");
        if (written.node == nullptr) continue;
      }
      written.text = yaml->Text(*written.node, path).value_or("");
      all.push_back(std::move(written));
    }
    return all;
  }

  void ReadStates(YamlReader* yaml, const YamlNode& node) {
    YamlMap map(yaml, &node, "states",
                {"model", "coordinates", "ranges", "rates", "accelerations", "parameters",
                 "gravity", "loads", "samples"});
    if (const YamlNode* model = map.Required("model")) {
      states_.model = yaml->Text(*model, map.PathOf("model")).value_or("");
    }
    if (const YamlNode* list = map.Required("coordinates")) {
      const auto items = yaml->Items(*list, map.PathOf("coordinates"));
      for (const YamlNode* item : items ? *items : std::vector<const YamlNode*>{}) {
        states_.coordinates.push_back(yaml->Text(*item, map.PathOf("coordinates")).value_or(""));
      }
    }
    const auto numbers = [&](const char* key, std::map<std::string, double>* into) {
      const YamlNode* values = map.Find(key);
      if (values == nullptr) return;
      for (const YamlEntry& entry : yaml->Entries(*values, map.PathOf(key))) {
        const auto number = yaml->Number(*entry.value, JoinPath(map.PathOf(key), entry.key));
        if (number) (*into)[entry.key] = *number;
      }
    };
    numbers("rates", &states_.rates);
    numbers("accelerations", &states_.accelerations);
    numbers("parameters", &states_.parameters);
    if (const YamlNode* ranges = map.Find("ranges")) {
      for (const YamlEntry& entry : yaml->Entries(*ranges, map.PathOf("ranges"))) {
        const std::string path = JoinPath(map.PathOf("ranges"), entry.key);
        const auto ends = Three(yaml, *entry.value, path, 2);
        if (ends) states_.ranges[entry.key] = {(*ends)[0], (*ends)[1]};
        if (ends && !((*ends)[0] <= (*ends)[1])) yaml->Error(*entry.value, path + " is empty");
      }
    }
    if (const YamlNode* gravity = map.Find("gravity")) {
      if (const auto g = Three(yaml, *gravity, map.PathOf("gravity"), 3)) states_.gravity_W = *g;
    }
    if (const YamlNode* samples = map.Find("samples")) {
      states_.samples = yaml->Integer(*samples, map.PathOf("samples")).value_or(40);
      if (states_.samples < 2) yaml->Error(*samples, "states.samples is less than 2");
    }
    if (const YamlNode* loads = map.Find("loads")) ReadLoads(yaml, *loads);
  }

  void ReadLoads(YamlReader* yaml, const YamlNode& node) {
    const auto items = yaml->Items(node, "states.loads");
    for (const YamlNode* item : items ? *items : std::vector<const YamlNode*>{}) {
      const YamlMap map(yaml, item, "states.loads", {"body", "point", "force", "moment"});
      StatesInfo::Load load;
      if (const YamlNode* body = map.Required("body")) {
        load.body = yaml->Text(*body, map.PathOf("body")).value_or("");
      }
      for (const auto& [key, into] :
           {std::pair{"point", &load.point_B}, std::pair{"force", &load.force_W},
            std::pair{"moment", &load.moment_W}}) {
        if (const YamlNode* vector = map.Find(key)) {
          if (const auto three = Three(yaml, *vector, map.PathOf(key), 3)) *into = *three;
        }
      }
      states_.loads.push_back(std::move(load));
    }
  }

  static std::optional<Vec3> Three(YamlReader* yaml, const YamlNode& node, const std::string& path,
                                   int count) {
    const auto items = yaml->Items(node, path, count);
    if (!items) return {};
    Vec3 numbers = Vec3::Zero();
    for (size_t k = 0; k < items->size(); ++k) {
      const auto number = yaml->Number(*(*items)[k], path);
      if (!number) return {};
      numbers[static_cast<Eigen::Index>(k)] = *number;
    }
    return numbers;
  }

  void ReadAudit(YamlReader* yaml, const YamlNode& node) {
    const auto items = yaml->Items(node, "audit");
    for (const YamlNode* item : items ? *items : std::vector<const YamlNode*>{}) {
      const YamlMap map(yaml, item, "audit",
                        {"equation", "erratum", "gives", "given", "define", "printed", "corrected",
                         "note", "unit", "approximation"});
      Equation equation;
      const auto text = [&](const char* key, bool required) {
        const YamlNode* value = required ? map.Required(key) : map.Find(key);
        return value == nullptr ? std::string() : yaml->Text(*value, map.PathOf(key)).value_or("");
      };
      equation.info.number = text("equation", true);
      equation.info.erratum = text("erratum", false);
      equation.info.gives = text("gives", true);
      equation.info.printed = text("printed", true);
      equation.info.corrected = text("corrected", false);
      equation.info.note = text("note", false);
      equation.info.unit = text("unit", false);
      equation.info.has_corrected = !equation.info.corrected.empty();
      if (const YamlNode* near = map.Find("approximation")) {
        equation.info.approximation =
            yaml->Number(*near, map.PathOf("approximation")).value_or(0.0);
      }
      if (const YamlNode* given = map.Find("given")) {
        for (const YamlEntry& entry : yaml->Entries(*given, map.PathOf("given"))) {
          equation.info.given[entry.key] =
              yaml->Text(*entry.value, JoinPath(map.PathOf("given"), entry.key)).value_or("");
          equation.names.push_back(entry.key);
        }
      }
      equation.define = ReadFormulas(yaml, map, "define");
      equation.printed = {
          .name = equation.info.number, .text = equation.info.printed, .node = map.Find("printed")};
      equation.corrected = {.name = equation.info.number,
                            .text = equation.info.corrected,
                            .node = map.Find("corrected")};
      if (equation.printed.node == nullptr) continue;
      equation.info.line = equation.info.end = equation.printed.node->line;
      if (equation.corrected.node != nullptr) {
        equation.info.corrected_line = equation.info.corrected_end = equation.corrected.node->line;
      }
      for (const std::string& coordinate : states_.coordinates) {
        for (const char* suffix : {"", "_d", "_dd"}) {
          const std::string name = ShortName(coordinate) + suffix;
          if (!Contains(equation.names, name)) equation.names.push_back(name);
        }
      }
      equations_.push_back(std::move(equation));
    }
  }

  // All formulas, with the names that each may use; every error is a finding.
  std::optional<EquationFailure> Compile() {
    YamlReader places(file_);
    const auto compile = [&](Written* written, const std::vector<std::string>& names,
                             const std::vector<std::string>& variables) {
      std::vector<FormulaError> errors;
      written->formula = DifferentiableFormula::Compile(written->text, names, variables, &errors);
      for (const FormulaError& error : errors) {
        places.Error(
            *written->node,
            fmt::format("{} = '{}': {}", written->name, QuotedValue(written->text), error.message),
            error.hint);
      }
      for (const int name : written->formula.used()) {
        if (static_cast<size_t>(name) < used_.size()) used_[static_cast<size_t>(name)] = true;
      }
    };
    for (size_t f = 0; f < forms_.size(); ++f) {
      Form& form = forms_[f];
      std::vector<std::string> names = parameter_names_;
      for (auto& [key, list] : covers_[f]) {
        for (Written& written : list) {
          if (!written.text.empty()) compile(&written, names, {});
        }
      }
      names.insert(names.end(), form.arguments.begin(), form.arguments.end());
      for (Written& written : form.define) {
        compile(&written, names, form.arguments);
        if (Contains(names, written.name)) {
          places.Error(*written.node, fmt::format("'{}' has a meaning already", written.name));
        }
        names.push_back(written.name);
      }
      for (auto* list : {&form.drives, &form.rates, &form.forces, &form.outputs}) {
        for (Written& written : *list) compile(&written, names, form.arguments);
      }
    }
    for (Equation& equation : equations_) {
      std::vector<std::string> names = parameter_names_;
      names.insert(names.end(), equation.names.begin(), equation.names.end());
      for (Written& written : equation.define) {
        compile(&written, names, {});
        names.push_back(written.name);
      }
      compile(&equation.printed, names, {});
      if (equation.info.has_corrected) compile(&equation.corrected, names, {});
      std::vector<int> used;
      for (const Written* written : {&equation.printed, &equation.corrected}) {
        used.insert(used.end(), written->formula.used().begin(), written->formula.used().end());
      }
      for (const Written& written : equation.define) {
        used.insert(used.end(), written.formula.used().begin(), written.formula.used().end());
      }
      equation.info.arguments.clear();
      for (size_t k = 0; k < equation.names.size(); ++k) {
        const int index = static_cast<int>(parameter_names_.size() + k);
        if (std::ranges::find(used, index) != used.end()) {
          equation.info.arguments.push_back(equation.names[k]);
        }
      }
    }
    if (!places.has_errors()) return {};
    EquationFailure failure{.message = "its formulas cannot be read", .file = file_};
    failure.findings = places.diagnostics().findings();
    return failure;
  }

  [[nodiscard]] std::vector<Jet> ParameterJets() const {
    std::vector<Jet> jets;
    for (const auto& [name, value] : parameters_) jets.push_back({value, 0.0, 0.0});
    return jets;
  }

  // Derivatives of all names by the commands.
  static void AddPartials(const Form& form, const std::vector<Jet>& known, size_t first, size_t n,
                          DifferentiableFormula::Values* values) {
    values->partial.assign(known.size() + form.define.size(), std::vector<double>(n, 0.0));
    for (size_t k = 0; k < n; ++k) {
      DifferentiableFormula::Values along{.names = known};
      for (size_t i = 0; i < n; ++i) {
        along.names[first + i] = {known[first + i].value, i == k ? 1.0 : 0.0, 0.0};
        values->partial[first + i][k] = i == k ? 1.0 : 0.0;
      }
      for (const Written& name : form.define) {
        along.names.push_back(name.formula.At(along));
        values->partial[along.names.size() - 1][k] = along.names.back().rate;
      }
    }
  }

  [[nodiscard]] EquationFailure Wrong(const std::string& message, const Written& at) const {
    return {.message = message, .file = file_, .line = at.node->line};
  }
  [[nodiscard]] EquationFailure NotFinite(const Written& at) const {
    return {.kind = EquationFailure::Kind::kUnreachable,
            .message = fmt::format("{} = '{}' has no value", at.name, QuotedValue(at.text)),
            .file = file_,
            .line = at.node->line};
  }

  std::string file_, text_;
  bool loaded_ = false, compiled_ = false;
  std::optional<EquationFailure> failed_;
  YamlNodePtr root_;
  std::vector<Form> forms_;
  std::vector<std::map<std::string, std::vector<Written>>> covers_;  // per form
  std::vector<Equation> equations_;
  StatesInfo states_;
  std::map<std::string, double> parameters_;
  std::vector<std::string> parameter_names_;
  std::vector<bool> used_;  // per parameter
};

}  // namespace

std::shared_ptr<Equations> MakeFormulaEquations(const std::string& file, const std::string& text) {
  return std::make_shared<FormulaEquations>(file, text);
}

}  // namespace mbv
