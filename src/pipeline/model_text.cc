#include "pipeline/model_text.h"

#include <fmt/format.h>

#include "mechanism/mobility.h"
#include "mechanism/urdf.h"
#include "mjcf/mjcf.h"

namespace mbv {
namespace {

std::string Joined(const std::vector<std::string>& words) {
  std::string text;
  for (const std::string& word : words) text += (text.empty() ? "" : ", ") + word;
  return text;
}

std::string UniqueText(const char* what, const std::vector<std::string>& not_unique) {
  if (not_unique.empty()) return fmt::format("  {}: all determined by statics\n", what);
  return fmt::format("  {}: not determined by statics alone: {}\n", what, Joined(not_unique));
}

}  // namespace

std::string MobilityText(const Mechanism& mechanism) {
  const Mobility m = AnalyseMobility(mechanism);
  size_t closures = 0;
  for (const Joint& joint : mechanism.joints) closures += joint.closure ? 1 : 0;
  std::string text =
      fmt::format("{}: {}\n  file: {}\n", mechanism.name, mechanism.description, mechanism.file);
  text += fmt::format("  {} bodies, {} joints ({} close loops), {} drives, {} prescribed joints\n",
                      mechanism.bodies.size() - 1, mechanism.joints.size(), closures, m.drives,
                      m.prescribed);
  text += fmt::format(
      "  freedoms: {} = {} body coordinates - rank {} of {} joint constraints "
      "(at the home pose)\n",
      m.freedoms, m.body_coordinates, m.constraint_rank, m.constraint_rows);
  text += fmt::format("  redundant constraints: {}; Kutzbach's count would give {} freedoms\n",
                      m.redundant, m.kutzbach);
  text += m.drives_determine_motion
              ? "  drives and prescribed joints determine the motion\n"
              : fmt::format("  {} freedoms are left when drives and prescribed joints are locked\n",
                            m.undriven);
  text += UniqueText("drive forces", m.drives_not_unique);
  text += UniqueText("joint reactions", m.joints_not_unique);
  text += fmt::format(
      "  rank decision: smallest singular value kept {:.2e}, largest dropped "
      "{:.2e}\n",
      m.smallest_kept, m.largest_dropped);
  text += "  drives:";
  for (const Drive& drive : mechanism.drives) text += " " + drive.name;
  text += "\n  outputs:";
  for (const Output& output : mechanism.outputs) text += " " + output.name;
  return text + "\n";
}

std::string ModelText(const Mechanism& mechanism, ModelFormat format) {
  switch (format) {
    case ModelFormat::kMjcf:
      return WriteMjcf(mechanism);
    case ModelFormat::kUrdf:
      return WriteUrdf(mechanism);
  }
  return "";
}

}  // namespace mbv
