// Drives of an MJCF file.
#include <algorithm>
#include <utility>

#include "simulation/mjcf_import.h"

namespace mbv::simulation {
namespace {

void AddDrive(int u, MjcfImport* in) {
  const mjModel& m = in->m;
  const std::string name = in->NameOf(mjOBJ_ACTUATOR, u, "actuator");
  const int type = m.actuator_trntype[u];
  const bool on_joint = type == mjTRN_JOINT || type == mjTRN_JOINTINPARENT;
  const int j = on_joint ? in->joint_of[static_cast<size_t>(m.actuator_trnid[2 * u])] : -1;
  if (j < 0 || FreedomsOf(in->mechanism.joints[static_cast<size_t>(j)].kind) != 1) {
    constexpr std::pair<int, const char*> kOthers[] = {{mjTRN_SLIDERCRANK, "slidersite"},
                                                       {mjTRN_TENDON, "tendon"},
                                                       {mjTRN_SITE, "site"},
                                                       {mjTRN_BODY, "body"}};
    const char* attribute = "joint";  // of a ball or free body
    for (const auto& [other, word] : kOthers) {
      if (type == other) attribute = word;
    }
    in->LeaveOut(on_joint ? "actuator of a ball" : "actuator/general", attribute,
                 fmt::format("actuator '{}', which does not act on a hinge or slide,", name));
    return;
  }
  std::vector<Drive>& drives = in->mechanism.drives;
  const bool second = std::ranges::any_of(
      drives, [j](const Drive& drive) { return std::get<JointDrive>(drive.kind).joint == j; });
  if (second) return;
  if (m.actuator_gear[6 * u] != 1.0) in->geared.push_back(name);
  drives.push_back({.name = name,
                    .kind = JointDrive{j, 0},
                    .range = in->mechanism.joints[static_cast<size_t>(j)].range[0]});
}

}  // namespace

void AddDrives(MjcfImport* in) {
  for (int u = 0; u < in->m.nu; ++u) AddDrive(u, in);
}

}  // namespace mbv::simulation
