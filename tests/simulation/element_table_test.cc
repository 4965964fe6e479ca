// docs/reference/robot_elements.md: what becomes of every element, from the tables of the readers.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cstdlib>
#include <fstream>
#include <sstream>

#include "model_file/sdf/read_sdf.h"
#include "model_file/urdf/urdf_closures.h"
#include "simulation/mjcf/foreign_rows.h"
#include "tests/support/source_dir.h"

namespace mbv {
namespace {

const char* const kTop = R"(# What becomes of every element of a robot's file

Written from the tables that the readers of MJCF, SDF and URDF look into. Do not edit: run
`MBV_UPDATE_GOLDEN=1 build/release/tests/test_simulation --gtest_filter='ElementTable.*'`.

* **taken**: the mechanism has it;
* **no force**: no force of a mechanism without contacts, whose motion is commanded, depends on it;
* **left out**: forces depend on it, and the mechanism is without it. It is a caveat of every
  verdict, unless the value is one that does nothing, which stands in brackets;
* **refused**: without it the robot would be another one. It is an error.

What is in none of the tables is left out as unknown. How robots' files are read:
`docs/how-to/robot_files.md`.
)";

// One line of a table: what it is about, and what becomes of it.
std::string Line(const std::string& element, const std::string& values, const std::string& fate) {
  return fmt::format("| `{}` | {} | {} |\n", element, values, fate);
}

std::string Words(std::string values) {
  if (values.empty()) return "the element";
  if (values == "*") return "all attributes";
  if (values == "**") return "all that it holds";
  return values;
}

// Fates of MJCF and of SDF have the same names.
template <typename Row, typename Fate>
std::string FateText(const Row& row, Fate of) {
  const std::string neutral = *row.neutral == '\0' ? "" : fmt::format(" (`{}`)", row.neutral);
  switch (of) {
    case Fate::kTaken:
      return "taken";
    case Fate::kNoForce:
      return "no force";
    case Fate::kLeftOut:
      return fmt::format("**left out**: {}{}", row.effect, neutral);
    case Fate::kRefused:
      return fmt::format("**refused**: {}{}", row.effect, neutral);
  }
  return "";
}

// | separates columns.
std::string Cell(std::string text) {
  for (size_t at = text.find('|'); at != std::string::npos; at = text.find('|', at + 2)) {
    text.insert(at, "\\");
  }
  return text;
}

std::string Page() {
  std::string text = kTop;
  const char* head = "| element | attributes | here |\n|---|---|---|\n";
  text += std::string(
              "\n## MJCF\n\nOf MuJoCo 2.2 and 3. `body/…`: also below `<worldbody>`, "
              "`<frame>` and `<replicate>`, and in\n`<default>`.\n\n") +
          head;
  for (const mjcf::ForeignRow& row : mjcf::ForeignRows()) {
    text += Line(row.element, Words(row.attributes), Cell(FateText(row, row.fate)));
  }
  text += std::string(
              "\n## SDF\n\nUp to 1.9, what later versions add to models, and Drake's. "
              "`text`: what stands in the element.\n\n") +
          head;
  for (const SdfRow& row : SdfRows()) {
    text += Line(row.element, Words(row.values), Cell(FateText(row, row.fate)));
  }
  text +=
      "\n## URDF\n\nURDF's own elements are taken (`docs/how-to/robot_files.md`, URDF), those of "
      "pictures and\ncontacts exert no force. What simulators add and forces depend on is left "
      "out:\n\n";
  text += "| below | element | attribute | effect |\n|---|---|---|---|\n";
  for (const internal::UrdfForceRow& row : internal::UrdfForceRows()) {
    const std::string neutral = *row.neutral == '\0' ? "" : fmt::format(" (`{}`)", row.neutral);
    text += fmt::format("| {} | `{}` | {} | {} |\n",
                        *row.section == '\0' ? "any" : fmt::format("`{}`", row.section),
                        row.element, Words(row.value), Cell(row.effect + neutral));
  }
  text +=
      "\n`<plugin>`s below `<gazebo>` are known by a part of their file or name; others may do "
      "anything and\nare left out.\n\n| part | effect |\n|---|---|\n";
  for (const internal::UrdfPluginRow& row : internal::UrdfPluginRows()) {
    text += fmt::format(
        "| `{}` | {} |\n", row.part,
        row.effect == nullptr ? "no force" : fmt::format("**left out**: {}", row.effect));
  }
  return text;
}

TEST(ElementTable, PageIsInStep) {
  const std::string path = std::string(kSourceDir) + "/docs/reference/robot_elements.md";
  const std::string text = Page();
  if (std::getenv("MBV_UPDATE_GOLDEN") != nullptr) std::ofstream(path) << text;
  std::ifstream file(path);
  std::ostringstream stored;
  stored << file.rdbuf();
  EXPECT_EQ(stored.str(), text) << "docs/reference/robot_elements.md is stale; rerun with "
                                   "MBV_UPDATE_GOLDEN=1";
}

}  // namespace
}  // namespace mbv
