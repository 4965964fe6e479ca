#include "simulation/mjcf/foreign_rows.h"

#include <algorithm>
#include <array>
#include <optional>
#include <sstream>

namespace mbv::mjcf {
namespace {

using enum Fate;

constexpr const char* kFluid = "a fluid drags and lifts every body";
constexpr const char* kPlugin = "a plugin may exert forces of any kind";
constexpr const char* kActuatorLost = "the drive and its forces are missing";
constexpr const char* kFlex = "a flexible body with its mass and elasticity is missing";
constexpr const char* kMoreThanLinear = "the spring or damper is not linear";
constexpr const char* kShape = "the parts of the composite are somewhere else";

// clang-format off
const ForeignRow kRows[] = {
    {"mujoco", "model", kTaken},
    {"compiler", "autolimits boundmass boundinertia settotalmass balanceinertia coordinate angle "
                 "fitaabb eulerseq meshdir assetdir strippath fusestatic inertiafromgeom "
                 "inertiagrouprange exactmeshinertia", kTaken},
    {"compiler", "texturedir discardvisual convexhull usethread saveinertial alignfree conflict",
     kNoForce},
    {"compiler/lengthrange", "*", kNoForce},

    {"option", "gravity", kTaken},
    {"option", "density viscosity", kLeftOut, kFluid, "0", true},
    {"option", "wind", kLeftOut, kFluid, "0 0 0", true},
    // How MuJoCo steps and solves (`mbverify run` measures it), and contacts.
    {"option", "timestep apirate impratio tolerance ls_tolerance noslip_tolerance mpr_tolerance "
               "ccd_tolerance sleep_tolerance magnetic o_margin o_solref o_solimp o_friction "
               "integrator collision cone jacobian solver iterations ls_iterations "
               "noslip_iterations mpr_iterations ccd_iterations sdf_iterations sdf_initpoints "
               "actuatorgroupdisable", kNoForce},
    {"option/flag", "constraint equality frictionloss limit contact passive spring damper gravity",
     kTaken},
    {"option/flag", "clampctrl warmstart filterparent actuation refsafe sensor midphase eulerdamp "
                    "autoreset nativeccd island multiccd override energy fwdinv invdiscrete sleep "
                    "sensornoise diagexact", kNoForce},

    {"size", "*", kNoForce},
    {"statistic", "*", kNoForce},
    {"visual", "*", kNoForce},
    {"visual/*", "*", kNoForce},
    {"custom", "*", kNoForce},
    {"custom/*", "*", kNoForce},
    {"tuple/element", "*", kNoForce},
    {"sensor", "*", kNoForce},
    {"sensor/*", "*", kNoForce},
    {"extension", "*", kNoForce},  // says what a plugin is; where it is used, it acts
    {"extension/*", "*", kNoForce},
    {"plugin/instance", "*", kNoForce},
    {"instance/config", "*", kNoForce},
    {"keyframe", "", kTaken},
    {"keyframe/key", "name qpos", kTaken},
    {"keyframe/key", "time qvel act mpos mquat ctrl", kNoForce},  // motions are commanded

    {"default", "class", kTaken},
    {"default/equality", "active", kTaken},
    {"default/equality", "solref solimp", kNoForce},

    {"asset", "", kTaken},
    {"asset/mesh", "name class file vertex face refpos refquat scale", kTaken},
    {"asset/mesh", "normal texcoord content_type smoothnormal maxhullvert material", kNoForce},
    {"asset/mesh", "inertia", kLeftOut, "masses follow from the mesh in another way", "legacy"},
    {"asset/mesh", "builtin params", kLeftOut, "masses follow from a mesh that is missing", "none"},
    {"asset/texture", "*", kNoForce},
    {"asset/material", "*", kNoForce},
    {"asset/skin", "*", kNoForce},
    {"asset/hfield", "*", kNoForce},  // touches only
    {"asset/model", "name file", kTaken},
    {"asset/model", "content_type", kNoForce},
    {"skin/bone", "*", kNoForce},
    {"material/layer", "*", kNoForce},
    {"mesh/plugin", "", kLeftOut, "masses follow from a mesh that is missing"},
    {"mesh/plugin", "*", kNoForce},

    {"worldbody", "*", kTaken},
    {"body", "name childclass pos quat axisangle xyaxes zaxis euler gravcomp", kTaken},
    {"body", "mocap sleep simple user", kNoForce},
    {"frame", "name childclass pos quat axisangle xyaxes zaxis euler", kTaken},
    {"replicate", "count offset euler sep childclass", kTaken},
    {"body/attach", "model body frame prefix", kTaken},
    {"body/inertial", "pos quat mass diaginertia axisangle xyaxes zaxis euler fullinertia", kTaken},
    {"body/joint", "name class type pos axis springdamper limited range margin stiffness ref "
                   "springref armature damping frictionloss actuatorgravcomp actuatorfrclimited "
                   "actuatorfrcrange", kTaken},
    {"body/joint", "group solreflimit solimplimit solreffriction solimpfriction user", kNoForce},
    {"limit without room", "range", kLeftOut, "it pushes back at every pose", "", true},
    {"any joint", "damping", kLeftOut, "a negative damper drives the joint", "0", true},
    {"stiffness", "2nd", kLeftOut, kMoreThanLinear, "0"},
    {"springlength", "2nd", kLeftOut, "the tendon pulls outside a band of lengths"},
    {"damping", "2nd", kLeftOut, kMoreThanLinear, "0"},
    {"body/freejoint", "", kLeftOut, "the body is held where it is", "", true},
    {"body/freejoint", "name", kTaken},
    {"body/freejoint", "group align", kNoForce},
    {"body/geom", "name class type size group mass density shellinertia fromto pos quat axisangle "
                  "xyaxes zaxis euler mesh fitscale hfield rgba", kTaken},
    // Of contacts, whose row is "contact", and of the fluid.
    {"body/geom", "contype conaffinity condim priority material friction solmix solref solimp "
                  "margin gap surfacevel adhesion fluidshape fluidcoef user", kNoForce},
    {"body/site", "name class pos quat fromto axisangle xyaxes zaxis euler", kTaken},
    {"body/site", "type group material size rgba user", kNoForce},
    {"body/camera", "*", kNoForce},
    {"body/light", "*", kNoForce},
    {"body/plugin", "", kLeftOut, kPlugin},
    {"body/plugin", "*", kNoForce},
    {"geom/plugin", "", kLeftOut, kPlugin},
    {"geom/plugin", "*", kNoForce},
    {"plugin/config", "*", kNoForce},
    {"body/composite", "prefix type count spacing offset flatinertia solrefsmooth solimpsmooth",
     kTaken},
    {"body/composite", "vertex initial curve size quat", kLeftOut, kShape},
    {"composite/joint", "kind stiffness damping armature type axis limited range margin frictionloss",
     kTaken},
    {"composite/joint", "group solreffix solimpfix solreflimit solimplimit solreffriction "
                        "solimpfriction", kNoForce},
    {"composite/tendon", "kind stiffness damping limited range margin frictionloss", kTaken},
    {"composite/tendon", "group solreffix solimpfix solreflimit solimplimit solreffriction "
                         "solimpfriction material rgba width", kNoForce},
    {"composite/geom", "type group size mass density rgba", kTaken},
    {"composite/geom", "contype conaffinity condim priority material friction solmix solref solimp "
                       "margin gap surfacevel adhesion", kNoForce},
    {"composite/skin", "*", kNoForce},
    {"composite/site", "*", kNoForce},
    {"composite/pin", "coord", kTaken},
    {"composite/plugin", "", kLeftOut, kPlugin},
    {"composite/plugin", "*", kNoForce},
    {"body/flexcomp", "", kLeftOut, kFlex},
    {"body/flexcomp", "*", kNoForce},  // goes with it
    {"flexcomp/*", "*", kNoForce},
    {"deformable", "*", kNoForce},
    {"deformable/flex", "", kLeftOut, kFlex},
    {"deformable/flex", "*", kNoForce},
    {"deformable/skin", "*", kNoForce},
    {"flex/*", "*", kNoForce},

    // Where geoms are seen to touch.
    {"contact", "", kLeftOut, "geoms that touch push each other", "", true},
    {"contact/pair", "*", kNoForce},
    {"contact/exclude", "*", kNoForce},

    {"equality", "", kTaken},
    {"tendon", "", kTaken},
    {"actuator", "", kTaken},
    {"equality/connect", "name class body1 body2 anchor site1 site2 active", kTaken},
    {"equality/connect", "solref solimp", kNoForce},
    {"equality/weld", "name class body1 body2 relpose anchor site1 site2 active", kTaken},
    {"equality/weld", "solref solimp torquescale", kNoForce},
    {"equality/joint", "name class joint1 joint2 polycoef active", kTaken},
    {"equality/joint", "solref solimp", kNoForce},
    {"equality/joint", "", kLeftOut, "what it couples or holds is free", "", true},
    {"equality/tendon", "name class tendon1 tendon2 polycoef active", kTaken},
    {"equality/tendon", "solref solimp", kNoForce},
    {"equality/tendon", "", kLeftOut, "what it couples is free", "", true},
    {"equality/distance", "", kRefused, "MuJoCo has no such equality since 2.2.2"},
    {"equality/distance", "*", kNoForce},
    {"equality/flex", "*", kNoForce},  // goes with its flexible body
    {"equality/flexvert", "*", kNoForce},
    {"equality/flexstrain", "*", kNoForce},

    {"tendon/spatial", "name class springlength", kTaken},
    {"tendon/spatial", "group actuatorfrclimited actuatorfrcrange solreflimit solimplimit "
                       "solreffriction solimpfriction width material margin rgba user",
     kNoForce},
    {"tendon/spatial", "armature", kLeftOut, "the tendon's inertia takes part in every motion", "0"},
    {"tendon/fixed", "name class springlength", kTaken},
    {"tendon/fixed", "group actuatorfrclimited actuatorfrcrange solreflimit solimplimit "
                     "solreffriction solimpfriction margin user", kNoForce},
    {"tendon/fixed", "armature", kLeftOut, "the tendon's inertia takes part in every motion", "0"},
    {"tendon/spatial", "stiffness damping frictionloss", kLeftOut, "the tendon pulls", "0", true},
    {"tendon/fixed", "stiffness damping frictionloss", kLeftOut, "the tendon pulls", "0", true},
    {"tendon/spatial", "limited range", kLeftOut, "the tendon stops at its limit", "", true},
    {"tendon/fixed", "limited range", kLeftOut, "the tendon stops at its limit", "", true},
    {"default/tendon", "*", kNoForce},  // reported for the tendons
    {"spatial/site", "*", kNoForce},
    {"spatial/geom", "*", kNoForce},
    {"spatial/pulley", "*", kNoForce},
    {"fixed/joint", "joint coef", kTaken},

    // A drive is one, whatever its servo does: its motion is commanded, its force is the result.
    // What limits the force is a motor's limit, for sizing.
    {"actuator/*", "name class joint jointinparent gear ctrllimited ctrlrange forcelimited "
                   "forcerange kp gainprm gaintype biasprm biastype dyntype", kTaken},
    {"actuator/*", "damping armature", kLeftOut, "a damper or rotor acts on the driven joint", "0"},
    {"actuator/*", "tendon slidersite cranksite site refsite body", kLeftOut, kActuatorLost, "", true},
    {"actuator of a ball", "joint", kLeftOut, kActuatorLost, "", true},
    {"actuator/*", "group nsample interp delay actlimited actrange velrange ffrange posrange "
                   "lengthrange cranklength user actdim input dynprm actearly inheritrange kv ki dampratio timeconst imax slewmax area diameter bias "
                   "tausmooth range force scale lmin lmax vmax fpmax fvmax gain motorconst "
                   "resistance nominal saturation inductance cogging lugre controller thermal "
                   "plugin instance",
     kNoForce},
    {"actuator/orientation", "", kLeftOut, kActuatorLost},
    {"actuator/pid", "", kLeftOut, kActuatorLost},
    {"actuator/dcmotor", "", kLeftOut, kActuatorLost},
    {"actuator/plugin", "", kLeftOut, kActuatorLost},
};
// clang-format on

bool Lists(std::string_view names, std::string_view name) {
  if (names.empty() || name.empty()) return names == name;
  if (names == "*") return true;
  for (size_t at = names.find(name); at != std::string_view::npos; at = names.find(name, at + 1)) {
    const size_t end = at + name.size();
    if ((at == 0 || names[at - 1] == ' ') && (end == names.size() || names[end] == ' ')) {
      return true;
    }
  }
  return false;
}

bool IsOf(std::string_view row, std::string_view element) {
  if (!row.ends_with("/*")) return row == element;
  return element.starts_with(row.substr(0, row.size() - 1));
}

std::optional<std::vector<double>> Numbers(const std::string& text) {
  std::istringstream stream(text);
  stream.imbue(std::locale::classic());
  std::vector<double> numbers;
  std::string word;
  while (stream >> word) {
    char* end = nullptr;
    numbers.push_back(std::strtod(word.c_str(), &end));
    if (*end != '\0') return std::nullopt;
  }
  return numbers;
}

}  // namespace

std::span<const ForeignRow> ForeignRows() { return kRows; }

const ForeignRow* FindForeignRow(std::string_view element, std::string_view attribute) {
  const ForeignRow* found = nullptr;
  for (const ForeignRow& row : kRows) {
    if (!IsOf(row.element, element) || !Lists(row.attributes, attribute)) continue;
    // A row that names the attribute goes before one of all.
    const bool better = found == nullptr || std::string_view(found->attributes) == "*";
    if (better) found = &row;
  }
  return found;
}

bool IsForeignElement(std::string_view element) {
  return std::ranges::any_of(kRows,
                             [&](const ForeignRow& row) { return IsOf(row.element, element); });
}

std::string ForeignElement(std::string_view parent, std::string_view tag) {
  constexpr std::array<std::string_view, 3> kBodies = {"worldbody", "frame", "replicate"};
  constexpr std::array<std::string_view, 5> kPlain = {"mujoco", "body", "frame", "replicate",
                                                      "worldbody"};
  if (std::ranges::find(kPlain, tag) != kPlain.end() || parent.empty() || parent == "mujoco") {
    return std::string(tag);
  }
  if (tag == "default") return "default";
  if (std::ranges::find(kBodies, parent) != kBodies.end()) parent = "body";
  if (parent == "default") {
    for (const auto& [section, tags] :
         {std::pair<std::string_view, std::string_view>{"asset", "mesh material"},
          {"body", "joint geom site camera light"},
          {"contact", "pair"},
          {"default", "equality tendon"}}) {
      if (Lists(tags, tag)) return std::string(section) + "/" + std::string(tag);
    }
    return "actuator/" + std::string(tag);
  }
  return std::string(parent) + "/" + std::string(tag);
}

bool IsNeutral(const ForeignRow& row, const std::string& value) {
  if (*row.neutral == '\0') return false;
  if (value == row.neutral) return true;
  const auto numbers = Numbers(value), neutral = Numbers(row.neutral);
  if (!numbers || !neutral) return false;
  return std::ranges::all_of(*numbers, [&](double x) { return x == neutral->front(); });
}

}  // namespace mbv::mjcf
