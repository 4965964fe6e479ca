// Equations in Python or Octave: a process that answers calls, one JSON text a line.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>

#include "base/files.h"
#include "base/json_document.h"
#include "base/json_text.h"
#include "base/scratch_folder.h"
#include "base/text.h"
#include "base/worker_pool.h"
#include "equations/equations.h"

namespace mbv {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::json;

constexpr double kLoad_s = 60.0, kCall_s = 30.0;
constexpr double kMemoryBytes = 4e9, kFileBytes = 1e8;
constexpr size_t kMostLog = 200;  // characters of what it said last

Json Array(const VecX& values) { return Json(std::vector<double>(values.begin(), values.end())); }
Json Array(const Vec3& values) { return Json{values[0], values[1], values[2]}; }

Json AsJson(const Argument& argument) {
  if (!argument.text.empty()) return Json(argument.text);
  if (argument.whole) return Json(static_cast<long>(argument.values.at(0)));
  if (argument.rows == 0) return Json(argument.values.at(0));
  if (argument.columns == 0) return Json(argument.values);
  Json rows = Json::array();
  for (int i = 0; i < argument.rows; ++i) {
    const auto begin = argument.values.begin() + std::ptrdiff_t{i} * argument.columns;
    rows.push_back(std::vector<double>(begin, begin + argument.columns));
  }
  return rows;
}

std::vector<double> Numbers(const JsonValue& list) {
  std::vector<double> numbers;
  for (const JsonValue& item : list.list()) numbers.push_back(item.NumberOrNan());
  return numbers;
}

// A number with its first and second Taylor coefficient.
Jet JetOf(const JsonValue& triple) {
  return {triple.at(size_t{0}).NumberOrNan(), triple.at(size_t{1}).NumberOrNan(),
          2.0 * triple.at(size_t{2}).NumberOrNan()};
}

std::map<std::string, double> NumberMap(const JsonValue& json, const std::string& key) {
  return json.value(key, std::map<std::string, double>{});
}

// An index of `each` may be written as a number or as a text.
std::string Word(const JsonValue& json) {
  const Json& value = json.json();
  return value.is_string() ? value.get<std::string>() : DumpLine(value);
}

FormInfo ReadForm(const JsonValue& json) {
  const std::vector<std::string> parts = json.at("parts");
  FormInfo form;
  form.mechanism = json.at("mechanism").get<std::string>();
  form.commands = json.at("commands").get<std::vector<std::string>>();
  form.line = json.at("line");
  form.covers_stated = Contains(parts, "covers");
  form.has_forces = Contains(parts, "forces");
  form.takes_loads = json.at("takes_loads");
  form.has_rates = Contains(parts, "rates") || Contains(parts, "jacobian");
  for (const JsonValue& output : json.at("outputs").list()) {
    form.outputs.emplace_back(output.at("channel"), output.at("unit"));
  }
  return form;
}

EquationInfo ReadEquation(const JsonValue& json) {
  EquationInfo equation;
  equation.number = json.at("number").get<std::string>();
  equation.gives = json.at("gives").get<std::string>();
  equation.arguments = json.at("arguments").get<std::vector<std::string>>();
  equation.given = json.at("given").get<std::map<std::string, std::string>>();
  for (const auto& [index, values] : json.at("each").items()) {
    for (const JsonValue& value : values.list()) equation.each[index].push_back(Word(value));
  }
  equation.erratum = json.value("erratum", "");
  equation.printed = json.value("printed", "");
  equation.corrected = json.value("corrected", "");
  equation.note = json.value("note", "");
  equation.unit = json.value("unit", "");
  equation.approximation = json.value("approximation", 0.0);
  equation.line = json.value("line", 0);
  equation.end = json.value("end", 0);
  equation.corrected_line = json.value("corrected_line", 0);
  equation.corrected_end = json.value("corrected_end", 0);
  equation.has_corrected = json.at("has_corrected");
  return equation;
}

Vec3 ReadVector(const JsonValue& json) {
  const std::vector<double> numbers = Numbers(json);
  if (numbers.size() != 3) json.Refuse("has not three numbers");
  return {numbers[0], numbers[1], numbers[2]};
}

StatesInfo ReadStates(const JsonValue& json) {
  StatesInfo states;
  if (!json.contains("model")) return states;
  states.model = json.at("model").get<std::string>();
  states.coordinates = json.at("coordinates").get<std::vector<std::string>>();
  for (const auto& [name, range] : json.at("ranges").items()) {
    const std::vector<double> ends = Numbers(range);
    if (ends.size() != 2 || !(ends[0] <= ends[1])) range.Refuse("is not [from, to]");
    states.ranges[name] = {ends[0], ends[1]};
  }
  states.rates = NumberMap(json, "rates");
  states.accelerations = NumberMap(json, "accelerations");
  states.parameters = NumberMap(json, "parameters");
  if (json.contains("gravity") && !json.at("gravity").is_null()) {
    states.gravity_W = ReadVector(json.at("gravity"));
  }
  for (const JsonValue& load : json.at("loads").list()) {
    StatesInfo::Load read{.body = load.at("body")};
    if (load.contains("point")) read.point_B = ReadVector(load.at("point"));
    if (load.contains("force")) read.force_W = ReadVector(load.at("force"));
    if (load.contains("moment")) read.moment_W = ReadVector(load.at("moment"));
    states.loads.push_back(std::move(read));
  }
  states.samples = json.value("samples", 40);
  if (states.samples < 2) json.at("samples").Refuse("is less than 2");
  return states;
}

// A map by names, or a list, in the order of `names`.
template <typename T, typename Read>
std::vector<T> InOrder(const JsonValue& answer, const char* list, const char* map,
                       const std::vector<std::string>& names, const char* what, const Read& read) {
  std::vector<T> values;
  if (answer.contains(list)) {
    for (const JsonValue& item : answer.at(list).list()) values.push_back(read(item));
    if (values.size() != names.size()) {
      answer.Refuse(fmt::format("{}: {} values where the mechanism has {} drives: {}", what,
                                values.size(), names.size(), Joined(names)));
    }
    return values;
  }
  const JsonValue named = answer.at(map);
  for (const auto& [name, item] : named.items()) {
    if (!Contains(names, name)) {
      answer.Refuse(fmt::format("{}: the mechanism has no drive '{}'", what, name),
                    DidYouMean(name, names));
    }
  }
  for (const std::string& name : names) {
    if (!named.contains(name)) answer.Refuse(fmt::format("{}: nothing for {}", what, name));
    values.push_back(read(named.at(name)));
  }
  return values;
}

Json LoadsJson(const std::vector<LoadSample>& loads, const std::vector<std::string>& bodies) {
  Json list = Json::array();
  for (const LoadSample& load : loads) {
    list.push_back({{"name", load.load == nullptr ? "" : load.load->name},
                    {"body", bodies.at(size_t(load.body))},
                    {"axes", load.in_body_axes ? "body" : "world"},
                    {"point", Array(load.p_BoQ_B)},
                    {"force", Array(load.force)},
                    {"moment", Array(load.moment)}});
  }
  return list;
}

class ProgramEquations final : public Equations {
 public:
  ProgramEquations(std::string file, EquationLanguage language)
      : file_(fs::absolute(file).string()), language_(language), folder_("equations") {}

  EquationResult<EquationsInfo> Load() override {
    return Ask<EquationsInfo>({{"do", "load"}}, kLoad_s, [](const JsonValue& answer) {
      EquationsInfo info;
      for (const JsonValue& form : answer.at("forms").list()) info.forms.push_back(ReadForm(form));
      for (const JsonValue& equation : answer.at("equations").list()) {
        info.equations.push_back(ReadEquation(equation));
      }
      info.states = ReadStates(answer.at("states"));
      return info;
    });
  }

  std::optional<EquationFailure> SetParameters(
      const std::map<std::string, double>& parameters) override {
    if (program_ != nullptr && program_->running() && parameters_ && *parameters_ == parameters) {
      return {};
    }
    parameters_ = parameters;
    const auto done = Ask<bool>({{"do", "set"}, {"parameters", parameters}}, kCall_s,
                                [](const JsonValue&) { return true; });
    if (!done) return done.failure;
    return {};
  }

  std::vector<std::string> ReadParameters() override {
    const auto read = Ask<std::vector<std::string>>(
        {{"do", "read"}}, kCall_s,
        [](const JsonValue& answer) { return answer.at("names").get<std::vector<std::string>>(); });
    return read.value.value_or(std::vector<std::string>{});
  }

  EquationResult<std::map<std::string, std::vector<double>>> Covers(size_t form) override {
    return Ask<std::map<std::string, std::vector<double>>>(
        {{"do", "covers"}, {"form", form}}, kCall_s, [](const JsonValue& answer) {
          std::map<std::string, std::vector<double>> stated;
          for (const auto& [key, numbers] : answer.at("stated").items()) {
            stated[key] = Numbers(numbers);
          }
          return stated;
        });
  }

  EquationResult<FormSample> Sample(size_t form, const VecX& q, const VecX& v, const VecX& a,
                                    const std::vector<LoadSample>& loads,
                                    const std::vector<std::string>& bodies,
                                    const std::vector<std::string>& drives,
                                    bool with_forces) override {
    Json call = {{"do", with_forces ? "sample" : "drives"},
                 {"form", form},
                 {"q", Array(q)},
                 {"qd", Array(v)},
                 {"qdd", Array(a)}};
    if (with_forces) call["load"] = LoadsJson(loads, bodies);
    return Ask<FormSample>(call, kCall_s, [&](const JsonValue& answer) {
      FormSample sample;
      sample.drives = InOrder<Jet>(answer, "values", "named", drives, "positions", &JetOf);
      const auto number = [](const JsonValue& json) { return json.NumberOrNan(); };
      for (const char* key : {"jacobian_rates", "rates"}) {
        if (!answer.contains(key)) continue;
        sample.rates = InOrder<double>(answer, key, "", drives, "rates", number);
      }
      if (answer.contains("forces") || answer.contains("named_forces")) {
        sample.forces = InOrder<double>(answer, "forces", "named_forces", drives, "forces", number);
      }
      if (answer.contains("outputs")) {
        for (const JsonValue& output : answer.at("outputs").list()) {
          sample.outputs.push_back(output.at(size_t{0}).NumberOrNan());
        }
      }
      return sample;
    });
  }

  EquationResult<std::vector<std::vector<double>>> SampleEdited(
      const std::string& text, size_t form, bool forces, const std::vector<FormState>& states,
      const std::vector<LoadSample>& loads, const std::vector<std::string>& bodies,
      const std::vector<std::string>& drives) override {
    Json rows = Json::array();
    for (const FormState& state : states) {
      rows.push_back({{"q", Array(state.q)}, {"qd", Array(state.v)}, {"qdd", Array(state.a)}});
      if (forces) rows.back()["load"] = LoadsJson(loads, bodies);
    }
    return AskTable({{"do", "try_form"},
                     {"source", text},
                     {"form", form},
                     {"part", forces ? "forces" : "drives"},
                     {"rows", std::move(rows)},
                     {"drives", drives}});
  }

  EquationResult<std::vector<std::vector<double>>> Evaluate(size_t equation,
                                                            const std::vector<ArgumentRow>& rows,
                                                            bool corrected) override {
    return AskRows({{"do", "equation"}, {"index", equation}, {"corrected", corrected}}, rows);
  }

  EquationResult<std::vector<std::vector<double>>> EvaluateEdited(
      const std::string& text, size_t equation, const std::vector<ArgumentRow>& rows,
      bool corrected) override {
    auto result = AskRows(
        {{"do", "try_source"}, {"source", text}, {"index", equation}, {"corrected", corrected}},
        rows);
    return result;
  }

 private:
  EquationResult<std::vector<std::vector<double>>> AskRows(Json call,
                                                           const std::vector<ArgumentRow>& rows) {
    Json list = Json::array();
    for (const ArgumentRow& row : rows) {
      Json arguments = Json::object();
      for (const auto& [name, argument] : row) arguments[name] = AsJson(argument);
      list.push_back(std::move(arguments));
    }
    call["rows"] = std::move(list);
    return AskTable(call);
  }

  EquationResult<std::vector<std::vector<double>>> AskTable(const Json& call) {
    return Ask<std::vector<std::vector<double>>>(call, kCall_s, [](const JsonValue& answer) {
      if (answer.contains("failed")) answer.Refuse(answer.at("failed"));
      std::vector<std::vector<double>> values;
      for (const JsonValue& row : answer.at("rows").list()) values.push_back(Numbers(row));
      return values;
    });
  }

  // Puts the interpreter's side into the folder, once. "" or what went wrong.
  std::string Unpack() {
    if (!folder_.trouble().empty()) return folder_.trouble();
    for (const auto& [name, text] : language_.files()) {
      const fs::path path = folder_.path() / name;
      std::error_code error;
      if (fs::exists(path, error)) continue;
      if (std::string trouble = WriteFile(path, text, false); !trouble.empty()) return trouble;
    }
    return "";
  }

  template <typename T, typename Read>
  EquationResult<T> Ask(const Json& call, double timeout_s, const Read& read) {
    if (program_ == nullptr) {
      if (std::string trouble = Unpack(); !trouble.empty()) {
        return {{}, {EquationFailure::Kind::kNotStarted, std::move(trouble)}};
      }
      WorkerJob job{.argv = language_.command(folder_.path(), file_),
                    .log = folder_.path() / "log"};
      const auto found = FindProgram(job.argv.front());
      if (!found) {
        return {{},
                {EquationFailure::Kind::kNotStarted,
                 fmt::format("there is no program '{}' to run {}", job.argv.front(), file_)}};
      }
      job.argv.front() = *found;
      job.folder = folder_.path();
      job.data_bytes = kMemoryBytes;
      job.file_bytes = kFileBytes;
      job.environment = BareEnvironment();
      program_ = std::make_unique<Conversation>(std::move(job));
    }
    // A program that is started again knows nothing.
    const bool again = loaded_ && !program_->running();
    if (call.at("do") == "load") {
      if (!program_->running()) parameters_.reset();
      loaded_ = true;
    } else if (again || !loaded_) {
      const auto parameters = parameters_;
      if (auto info = Load(); !info) return {{}, std::move(info.failure)};
      parameters_ = parameters;
      if (parameters_ && call.at("do") != "set") {
        const Json set = {{"do", "set"}, {"parameters", *parameters_}};
        const auto done = Exchange<bool>(set, kCall_s, [](const JsonValue&) { return true; });
        if (!done) return {{}, done.failure};
      }
    }
    return Exchange<T>(call, timeout_s, read);
  }

  template <typename T, typename Read>
  EquationResult<T> Exchange(const Json& call, double timeout_s, const Read& read) {
    Conversation::Answer answer = program_->Call(DumpLine(call), timeout_s);
    if (answer.trouble != Conversation::Trouble::kNone) {
      const auto kind = answer.trouble == Conversation::Trouble::kNotStarted
                            ? EquationFailure::Kind::kNotStarted
                            : EquationFailure::Kind::kLost;
      return {{}, {kind, fmt::format("{} {}{}", language_.name, answer.how, LogTail()), file_}};
    }
    std::optional<EquationFailure> failure;
    auto result = ReadJson(answer.line, [&](const JsonValue& root) -> std::optional<T> {
      if (!root.contains("error")) return read(root);
      const JsonValue error = root.at("error");
      const std::string kind = error.at("kind");
      failure = EquationFailure{kind == "unreachable" ? EquationFailure::Kind::kUnreachable
                                : kind == "singular"  ? EquationFailure::Kind::kSingular
                                                      : EquationFailure::Kind::kWrong,
                                error.at("message"), error.at("file"), error.at("line"),
                                error.at("function")};
      return std::nullopt;
    });
    if (failure) return {{}, std::move(*failure)};
    if (!result.value) {
      const JsonRefusal& why = result.refusal;
      const std::string hint = why.hint.empty() ? "" : "; " + why.hint;
      return {{},
              {EquationFailure::Kind::kWrong, (why.key.empty() ? why.message : why.Text()) + hint,
               file_}};
    }
    return {std::move(*result.value)};
  }

  // The last line that the program printed, behind ": ".
  std::string LogTail() const {
    std::string log = ReadWholeFile(folder_.path() / "log").value_or("");
    while (!log.empty() && static_cast<unsigned char>(log.back()) <= ' ') log.pop_back();
    if (const size_t line = log.rfind('\n'); line != std::string::npos) log.erase(0, line + 1);
    return log.empty() ? "" : ": " + QuotedValue(log, kMostLog);
  }

  std::string file_;
  EquationLanguage language_;
  ScratchFolder folder_;
  std::unique_ptr<Conversation> program_;
  bool loaded_ = false;
  std::optional<std::map<std::string, double>> parameters_;
};

}  // namespace

std::shared_ptr<Equations> MakeProgramEquations(const std::string& file,
                                                const EquationLanguage& language) {
  return std::make_shared<ProgramEquations>(file, language);
}

}  // namespace mbv
