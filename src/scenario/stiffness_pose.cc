// Poses and models of stiffness scenarios.
#include <fmt/format.h>

#include <algorithm>
#include <filesystem>

#include "core/demand.h"
#include "core/text.h"
#include "core/word_hints.h"
#include "kinematics/mobility.h"
#include "scenario/coordinate_names.h"
#include "scenario/find_model.h"
#include "scenario/motion_reader.h"
#include "scenario/stiffness_scenario.h"

namespace mbv {
namespace {

namespace fs = std::filesystem;

constexpr const char* kElasticFile = "elastic.yaml";

bool IsPath(const std::string& name) {
  return name.find('/') != std::string::npos || name.ends_with(".yaml");
}

std::string ElasticBeside(const std::string& model_file) {
  std::error_code error;
  const fs::path file = fs::path(model_file).parent_path() / kElasticFile;
  return fs::is_regular_file(file, error) ? file.string() : "";
}

}  // namespace

std::optional<std::string> FindElasticModel(const std::string& name, const std::string& start,
                                            std::string* why) {
  const auto model = FindModel(name, start);
  if (model && IsPath(name)) return model;
  if (const std::string elastic = model ? ElasticBeside(*model) : ""; !elastic.empty()) {
    return Shown(elastic);
  }
  std::vector<std::string> elastic_models;
  for (const std::string& known : ModelNames(start)) {
    const auto file = FindModel(known, start);
    if (file && !ElasticBeside(*file).empty()) elastic_models.push_back(known);
  }
  *why = model ? fmt::format("{} has no {} with its beams and servos", name, kElasticFile)
               : "there is no such model";
  const std::string hint =
      DidYouMean(name, elastic_models,
                 elastic_models.empty() ? "" : "elastic models: " + Joined(elastic_models));
  if (!hint.empty()) *why += "; " + hint;
  return std::nullopt;
}

Motion PoseMotion(const Mechanism& mechanism, const PoseValues& pose) {
  const std::vector<std::string> names = CoordinateNames(mechanism);
  Motion motion;
  for (const auto& [name, value] : pose) {
    const auto found = std::find(names.begin(), names.end(), name);
    MBV_DEMAND(found != names.end(), name);
    const Coordinate coordinate =
        CoordinateAt(mechanism, static_cast<size_t>(found - names.begin()));
    motion.commands.push_back(
        {.name = name, .terms = {{coordinate, 1.0}}, .profile = Constant(value)});
  }
  return motion;
}

PoseValues HomePose(const Mechanism& mechanism) {
  PoseValues pose;
  for (size_t i = 0; i < mechanism.drives.size(); ++i) {
    const Coordinate drive{Coordinate::Kind::kDrive, static_cast<int>(i), 0};
    pose[mechanism.drives[i].name] = HomeValue(mechanism, drive);
  }
  for (size_t i = 0; i < mechanism.prescribed.size(); ++i) {
    const Coordinate joint{Coordinate::Kind::kPrescribed, static_cast<int>(i), 0};
    pose[mechanism.prescribed[i].name] = HomeValue(mechanism, joint);
  }
  return pose;
}

PoseFault CheckPose(const Mechanism& mechanism, const PoseValues& pose) {
  const std::vector<std::string> names = CoordinateNames(mechanism);
  for (const auto& [name, value] : pose) {
    if (std::find(names.begin(), names.end(), name) != names.end()) continue;
    return {fmt::format("pose: {} has no coordinate '{}'", mechanism.name, name),
            DidYouMean(name, names, "known: drives, prescribed joints, and OUTPUT.x … OUTPUT.yaw")};
  }
  const int freedoms = CountFreedoms(mechanism);
  if (static_cast<int>(pose.size()) == freedoms) return {};
  return {fmt::format("pose gives {} coordinates, but {} has {} freedoms", pose.size(),
                      mechanism.name, freedoms),
          "give as many drives or output components (OUTPUT.x …) as there are freedoms"};
}

}  // namespace mbv
