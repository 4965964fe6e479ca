#include "pipeline/shared_forces.h"

#include <fmt/format.h>

#include <algorithm>

#include "core/text.h"
#include "mechanism/reach.h"

namespace mbv {
namespace {

std::string DrivesText(const Mechanism& mechanism, const std::vector<std::string>& drives) {
  bool moments = false, forces = false;
  for (const std::string& name : drives) {
    const Drive& drive = mechanism.drives[static_cast<size_t>(mechanism.FindDrive(name))];
    (ForceUnit(mechanism, drive) == "N" ? forces : moments) = true;
  }
  std::string text = "drive forces not unique: minimum norm over " + Joined(drives);
  if (moments && forces) {
    text += fmt::format(", moments divided by the characteristic length {:.4g} m",
                        CharacteristicLength(mechanism));
  }
  return text;
}

}  // namespace

std::vector<std::string> SharedDrives(const Mechanism& mechanism, const Motion& motion,
                                      const Mobility& mobility) {
  std::vector<std::string> shared;
  for (size_t d = 0; d < mechanism.drives.size(); ++d) {
    if (motion.FindForce(static_cast<int>(d)) >= 0) continue;
    const std::string& name = mechanism.drives[d].name;
    if (Contains(mobility.drives_not_unique, name)) shared.push_back(name);
  }
  if (shared.size() < 2) shared.clear();
  return shared;
}

std::vector<std::string> SharedForceTexts(const Mechanism& mechanism,
                                          const std::vector<std::string>& drives,
                                          const std::vector<std::string>& simulated) {
  std::vector<std::string> texts;
  if (!drives.empty()) texts.push_back(DrivesText(mechanism, drives));
  std::vector<std::string> more;
  for (const std::string& name : simulated) {
    if (!Contains(drives, name)) more.push_back(name);
  }
  if (!more.empty()) {
    texts.push_back(
        fmt::format("simulation: the force{} of {} {} not unique, a self-stress acts "
                    "there; of all that fit, those of least norm are recorded",
                    more.size() == 1 ? "" : "s", Joined(more), more.size() == 1 ? "is" : "are"));
  }
  return texts;
}

}  // namespace mbv
