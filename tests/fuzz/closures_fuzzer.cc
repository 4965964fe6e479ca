// Any text as the closure file of a URDF.
#include <string>

#include "model_file/load_model.h"
#include "tests/fuzz/fuzz.h"

namespace {

// Two bars on pivots; the closure file may join them.
constexpr const char* kUrdf = R"(<robot name="bars">
  <link name="base"/>
  <link name="left"><inertial><mass value="1"/><origin xyz="0.1 0 0"/>
    <inertia ixx="0.001" iyy="0.001" izz="0.001" ixy="0" ixz="0" iyz="0"/></inertial></link>
  <link name="right"><inertial><mass value="1"/><origin xyz="0.1 0 0"/>
    <inertia ixx="0.001" iyy="0.001" izz="0.001" ixy="0" ixz="0" iyz="0"/></inertial></link>
  <joint name="a" type="continuous"><parent link="base"/><child link="left"/><axis xyz="0 1 0"/></joint>
  <joint name="b" type="continuous"><parent link="base"/><child link="right"/>
    <origin xyz="0.2 0 0"/><axis xyz="0 1 0"/></joint>
</robot>)";

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const unsigned char* data, size_t size) {
  static const std::string urdf = mbv::WriteFile("bars.urdf", kUrdf);
  const std::string closures = mbv::WriteFile("closures.yaml", mbv::Text(data, size));
  const auto result = mbv::LoadModelText(
      "name: bars\nurdf: {file: " + urdf + ", closures: " + closures + "}\n", "fuzz.yaml");
  mbv::Require(result.mechanism.has_value() != result.diagnostics.has_errors());
  return 0;
}
