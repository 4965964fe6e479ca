#include "pipeline/load_robot.h"

#include <fmt/format.h>

#include <optional>
#include <utility>
#include <vector>

#include "core/bytes.h"
#include "core/in_children.h"
#include "core/names.h"
#include "input/yaml_reader.h"
#include "model_file/write_model.h"
#include "simulation/read_mjcf.h"

namespace mbv {
namespace {

// A child's answer.
struct ModelAnswer {
  std::vector<Finding> findings;
  std::string model;  // "" after errors
  std::vector<ModelCaveat> left_out;
};
template <typename Visit>
void VisitMembers(Visit& visit, typename Visit::template Of<ModelAnswer>& answer) {
  visit(answer.findings), visit(answer.model), visit(answer.left_out);
}

ModelAnswer ModelAnswerOf(const std::string& text, const std::string& file) {
  Diagnostics findings;
  auto read = ReadMjcf(text, file, &findings);
  ModelAnswer answer{.findings = findings.findings(), .model = "", .left_out = {}};
  if (!read) return answer;
  Mechanism& mechanism = read->mechanism;
  mechanism.name = NearestName(mechanism.name);
  if (mechanism.name.empty()) mechanism.name = "robot";
  answer.model = WriteModel(mechanism);
  answer.left_out = std::move(read->left_out);
  return answer;
}

// The model file that an MJCF file stands for, "" after errors, and what it leaves out.
std::pair<std::string, std::vector<ModelCaveat>> ModelOfMjcf(const std::string& file,
                                                             Diagnostics* findings) {
  constexpr double kTimeout_s = 60.0;
  YamlReader reader(file);
  const auto text = reader.ReadFile();
  findings->Append(reader.diagnostics());
  if (!text) return {};
  const auto answers =
      InChildren(1, kTimeout_s, [&](size_t) { return ToBytes(ModelAnswerOf(*text, file)); });
  auto answer = answers[0] ? FromBytes<ModelAnswer>(*answers[0]) : std::nullopt;
  if (!answer) {
    findings->AddError(file, fmt::format("MuJoCo's compiler crashed on it, or took longer than "
                                         "{:g} s",
                                         kTimeout_s));
    return {};
  }
  for (const Finding& finding : answer->findings) findings->Add(finding);
  if (findings->has_errors()) return {};
  return {std::move(answer->model), std::move(answer->left_out)};
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
  auto [model, left_out] = ModelOfMjcf(file, &result.diagnostics);
  if (model.empty()) return result;
  LoadResult loaded = LoadModelText(model, file, options);
  AddWithoutPlaces(loaded.diagnostics, &result.diagnostics);
  result.mechanism = std::move(loaded.mechanism);
  result.literals = std::move(loaded.literals);
  result.caveats = std::move(left_out);
  for (ModelCaveat& caveat : loaded.caveats) result.caveats.push_back(std::move(caveat));
  return result;
}

}  // namespace

bool IsRobotFile(const std::string& file) {
  return file.ends_with(".urdf") || file.ends_with(".xml");
}

LoadedBodies LoadRobotBodies(const std::string& file) {
  if (!file.ends_with(".xml")) return LoadBodies(file);
  LoadedBodies result;
  const std::string model = ModelOfMjcf(file, &result.diagnostics).first;
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
