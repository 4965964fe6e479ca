#include "pipeline/load_robot.h"

#include <fmt/format.h>

#include <sstream>

#include "core/in_children.h"
#include "core/names.h"
#include "input/yaml_reader.h"
#include "model_file/write_model.h"
#include "simulation/read_mjcf.h"

namespace mbv {
namespace {

// A child's answer: findings, one per line group, then the model.
constexpr char kField = '\x1f', kRecord = '\x1e';

std::string AnswerOf(const std::string& text, const std::string& file) {
  Diagnostics findings;
  auto mechanism = ReadMjcf(text, file, &findings);
  std::string answer;
  const auto plain = [](std::string s) {
    std::erase(s, kField);
    std::erase(s, kRecord);
    return s;
  };
  for (const Finding& f : findings.findings()) {
    answer +=
        fmt::format("{1}{0}{2}{0}{3}{0}{4}{5}", kField, f.severity == Severity::kError ? 1 : 0,
                    f.line, plain(f.message), plain(f.hint), kRecord);
  }
  answer += kRecord;
  if (!mechanism) return answer;
  mechanism->name = NearestName(mechanism->name);
  if (mechanism->name.empty()) mechanism->name = "robot";
  return answer + WriteModel(*mechanism);
}

// Reads the findings; the rest is the model, empty after errors.
std::string ReadAnswer(const std::string& answer, const std::string& file, Diagnostics* findings) {
  size_t at = 0;
  while (at < answer.size() && answer[at] != kRecord) {
    const size_t end = std::min(answer.find(kRecord, at), answer.size());
    std::istringstream stream(answer.substr(at, end - at));
    std::string severity, line, message, hint;
    std::getline(stream, severity, kField);
    std::getline(stream, line, kField);
    std::getline(stream, message, kField);
    std::getline(stream, hint, kField);
    const int number = std::atoi(line.c_str());
    findings->Add({severity == "1" ? Severity::kError : Severity::kWarning, file, number,
                   number > 0 ? 1 : 0, message, hint});
    at = end + 1;
  }
  return at < answer.size() ? answer.substr(at + 1) : "";
}

// The model file that an MJCF file stands for; "" after errors.
std::string ModelOfMjcf(const std::string& file, Diagnostics* findings) {
  constexpr double kTimeout_s = 60.0;
  YamlReader reader(file);
  const auto text = reader.ReadFile();
  findings->Append(reader.diagnostics());
  if (!text) return "";
  const auto answers = InChildren(1, kTimeout_s, [&](size_t) { return AnswerOf(*text, file); });
  if (!answers[0]) {
    findings->AddError(file, fmt::format("MuJoCo's compiler crashed on it, or took longer than "
                                         "{:g} s",
                                         kTimeout_s));
    return "";
  }
  const std::string model = ReadAnswer(*answers[0], file, findings);
  return findings->has_errors() ? "" : model;
}

// Nobody wrote the lines that findings point to.
void AddWithoutPlaces(const Diagnostics& from, Diagnostics* to) {
  for (Finding finding : from.findings()) {
    finding.line = finding.column = 0;
    to->Add(std::move(finding));
  }
}

LoadResult LoadMjcf(const std::string& file, const LoadOptions& options) {
  LoadResult result;
  const std::string model = ModelOfMjcf(file, &result.diagnostics);
  if (model.empty()) return result;
  LoadResult loaded = LoadModelText(model, file, options);
  AddWithoutPlaces(loaded.diagnostics, &result.diagnostics);
  result.mechanism = std::move(loaded.mechanism);
  result.literals = std::move(loaded.literals);
  return result;
}

}  // namespace

bool IsRobotFile(const std::string& file) {
  return file.ends_with(".urdf") || file.ends_with(".xml");
}

LoadedBodies LoadRobotBodies(const std::string& file) {
  if (!file.ends_with(".xml")) return LoadBodies(file);
  LoadedBodies result;
  const std::string model = ModelOfMjcf(file, &result.diagnostics);
  if (model.empty()) return result;
  LoadedBodies loaded = LoadBodiesText(model, file);
  AddWithoutPlaces(loaded.diagnostics, &result.diagnostics);
  result.bodies = std::move(loaded.bodies);
  return result;
}

LoadResult LoadRobot(const std::string& file, const LoadOptions& options) {
  return file.ends_with(".xml") ? LoadMjcf(file, options) : LoadModel(file, options);
}

}  // namespace mbv
