#include "model_file/model_signals.h"

#include <fmt/format.h>

namespace mbv::internal {

void SignalPlaces::Check(YamlReader* yaml) const {
  for (const auto& [name, uses] : places_) {
    for (size_t i = 1; i < uses.size(); ++i) {
      yaml->AddAt(Severity::kError, uses[i].place.line, uses[i].place.column,
                  fmt::format("the {} '{}' has the name of the {} in line {}", uses[i].what, name,
                              uses[0].what, uses[0].place.line));
    }
  }
}

void CheckDrivenOnce(const std::vector<Drive>& drives, const std::vector<Prescribed>& prescribed,
                     const std::vector<Joint>& joints, const SignalPlaces& places,
                     YamlReader* yaml) {
  std::map<int, std::string> driven;
  const auto check = [&](int joint, int coordinate, const std::string& name) {
    const auto [it, fresh] = driven.emplace(joint * 6 + coordinate, name);
    if (fresh) return;
    const Place at = places.Of(name);
    yaml->AddAt(Severity::kError, at.line, at.column,
                fmt::format("'{}' moves the same coordinate of joint '{}' as '{}'", name,
                            joints[joint].name, it->second));
  };
  for (const Drive& drive : drives) {
    const auto* on_joint = std::get_if<JointDrive>(&drive.kind);
    if (on_joint != nullptr) check(on_joint->joint, on_joint->coordinate, drive.name);
  }
  for (const Prescribed& one : prescribed) check(one.joint, 0, one.name);
}

}  // namespace mbv::internal
