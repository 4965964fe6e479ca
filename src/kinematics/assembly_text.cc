#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "kinematics/assembly.h"

namespace mbv {

std::string AssemblyText(const Mechanism& mechanism, const GroupAssemblies& found) {
  constexpr size_t kMostJoints = 4, kMostWays = 4;
  // The joints in which the ways differ most, or which moved most.
  std::vector<std::pair<double, size_t>> moved;
  for (size_t k = 0; k < found.group.joints.size(); ++k) {
    const Joint& joint = mechanism.joints[found.group.joints[k]];
    if (FreedomsOf(joint.kind) == 0) continue;
    double most = std::abs(found.assemblies.front().q[k][0] - joint.guess[0]);
    for (const Assembly& way : found.assemblies) {
      most = std::max(most, std::abs(way.q[k][0] - found.assemblies.front().q[k][0]));
    }
    moved.emplace_back(-most, k);
  }
  std::stable_sort(moved.begin(), moved.end());
  moved.resize(std::min(moved.size(), kMostJoints));
  const auto angles = [&](const Assembly& way) {
    std::string text;
    for (const auto& [change, k] : moved) {
      const Joint& joint = mechanism.joints[found.group.joints[k]];
      std::string values;
      for (int c = 0; c < FreedomsOf(joint.kind); ++c) {
        values += fmt::format("{}{:.4g}", c == 0 ? "" : " ", way.q[k][c]);
      }
      text += fmt::format("{}{} = {}", text.empty() ? "" : ", ", joint.name, values);
    }
    return text;
  };
  std::string text;
  for (size_t i = 0; i < std::min<size_t>(found.group.closures.size(), 3); ++i) {
    text += (i == 0 ? "" : ", ") + mechanism.joints[found.group.closures[i]].name;
  }
  if (found.group.closures.size() > 3) text += ", …";
  text += fmt::format(
      ": {} found, taken is {}",
      found.assemblies.size() == 1 ? "1 way to close"
                                   : fmt::format("{} ways to close", found.assemblies.size()),
      (found.assemblies.size() == 1 ? "" : "1: ") + angles(found.assemblies.front()));
  for (size_t i = 1; i < std::min(found.assemblies.size(), kMostWays); ++i) {
    text +=
        fmt::format("{}{}: {}", i == 1 ? "; others: " : " / ", i + 1, angles(found.assemblies[i]));
  }
  if (found.assemblies.size() > kMostWays) text += " / …";
  return text;
}

}  // namespace mbv
