#include <algorithm>
#include <array>
#include <string>

#include "mjcf/head_comment.h"
#include "mjcf/scene.h"
#include "mjcf/sections.h"

namespace mbv::mjcf {
namespace {

void Option(const Sections& s, const char* element, const char* name, const char* value) {
  s.xml->Open(element);
  s.xml->Set(name, value);
  s.xml->Close();
}

// MuJoCo has room for 500 constraint rows and leaves out the rest.
void WriteSizes(const Sections& s) {
  constexpr size_t kRoom = 500;
  size_t rows = s.mechanism.drives.size() + s.mechanism.prescribed.size();
  for (const PlannedClosure& closure : s.plan.closures) {
    rows += closure.type == PlannedClosure::Type::kConnect ? 3 : 6;
  }
  if (rows <= kRoom) return;
  s.xml->Open("size");
  s.xml->Set("njmax", std::to_string(rows));
  s.xml->Close();
}

void WriteSoftness(const Sections& s) {
  s.xml->Open("equality");
  s.xml->Set("solref",
             std::array<double, 2>{s.options.time_constant_steps * s.options.step_s, 1.0});
  s.xml->Set("solimp", std::array<double, 5>{kMjcfImpedance, kMjcfImpedance, 0.001, 0.5, 2.0});
  s.xml->Close();
}

void WriteDefaults(const Sections& s) {
  s.xml->Open("default");
  if (!s.options.default_softness) WriteSoftness(s);
  Option(s, "joint", "limited", "false");
  Option(s, "tendon", "limited", "false");
  // Of all actuators: MuJoCo keeps one default for them.
  s.xml->Open("motor");
  s.xml->Set("ctrllimited", "false");
  s.xml->Set("forcelimited", "false");
  s.xml->Close();
  s.xml->Open("geom");
  s.xml->Set("contype", "0");
  s.xml->Set("conaffinity", "0");
  s.xml->Close();
  s.xml->Open("site");
  s.xml->Set("group", "3");
  s.xml->Set("size", "0.005");
  s.xml->Close();
  s.xml->Close();
}

// From so many degrees of freedom on, MuJoCo's sparse constraint solver is faster.
constexpr int kSparseFrom = 40;

int FreedomsOfTree(const Mechanism& mechanism) {
  int freedoms = 0;
  for (const int j : mechanism.tree_joints) {
    freedoms += FreedomsOf(mechanism.joints[static_cast<size_t>(j)].kind);
  }
  return freedoms;
}

}  // namespace

void WriteHead(const Sections& s) {
  s.xml->Comment(HeadComment(s.mechanism, s.options));
  s.xml->Open("compiler");
  s.xml->Set("angle", "radian");
  s.xml->Set("autolimits", "false");
  s.xml->Set("inertiafromgeom", "false");
  s.xml->Close();
  s.xml->Open("option");
  s.xml->Set("timestep", s.options.step_s);
  s.xml->Set("gravity", s.mechanism.gravity_W);
  s.xml->Set("integrator", "Euler");
  s.xml->Set("solver", "Newton");
  s.xml->Set("tolerance", "1e-14");
  s.xml->Set("jacobian", FreedomsOfTree(s.mechanism) < kSparseFrom ? "dense" : "sparse");
  s.xml->Open("flag");
  s.xml->Set("contact", "disable");
  s.xml->Set("energy", "enable");
  s.xml->Close();
  s.xml->Close();
  WriteSizes(s);
  WriteDefaults(s);
  if (!s.options.pictures) return;
  s.xml->Open("visual");
  s.xml->Open("global");
  s.xml->Set("offwidth", "2560");
  s.xml->Set("offheight", "1920");
  s.xml->Close();
  s.xml->Close();
  WriteAssets(s.mechanism, s.surfaces, s.xml);
}

}  // namespace mbv::mjcf
