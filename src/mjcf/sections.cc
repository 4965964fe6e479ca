#include "mjcf/sections.h"

#include <algorithm>
#include <string>
#include <variant>

namespace mbv::mjcf {
namespace {

void WriteTendon(const Sections& s, const std::string& name, double width) {
  s.xml->Open("spatial");
  s.xml->Set("name", name);
  if (width > 0.0) s.xml->Set("width", width);
}

void WriteSpring(const Sections& s, double stiffness, double damping, double free_length_m) {
  s.xml->Set("stiffness", stiffness);
  s.xml->Set("damping", damping);
  s.xml->Set("springlength", free_length_m);
}

void FinishTendon(const Sections& s, const std::string& name) {
  for (const char* end : {".from", ".to"}) {
    s.xml->Open("site");
    s.xml->Set("site", name + end);
    s.xml->Close();
  }
  s.xml->Close();
}

void WriteClosure(const Sections& s, const PlannedClosure& closure) {
  const bool connect = closure.type == PlannedClosure::Type::kConnect;
  const Joint& joint = s.mechanism.joints[closure.joint];
  s.xml->Open(connect ? "connect" : "weld");
  s.xml->Set("name", closure.name);
  s.xml->Set("body1", s.plan.bodies[closure.body1].name);
  s.xml->Set("body2", s.plan.bodies[closure.body2].name);
  if (connect) {
    s.xml->Set("anchor", Vec3(joint.X_CM.translation()));
  } else {
    // A weld's anchor lies on its second body; the relative pose is taken from home.
    const bool split = closure.type == PlannedClosure::Type::kSplit;
    const bool on_child = split && !closure.split_parent;
    s.xml->Set("anchor", Vec3((on_child ? joint.X_CM : joint.X_PF).translation()));
  }
  s.xml->Close();
}

std::string NameOf(const Sections& s, const Coupling::Term& term) {
  return JointName(s.mechanism.joints[term.joint], term.coordinate);
}

void WriteFixedTendon(const Sections& s, const Coupling& coupling) {
  s.xml->Open("fixed");
  s.xml->Set("name", CouplingName(coupling));
  for (const Coupling::Term& term : coupling.terms) {
    s.xml->Open("joint");
    s.xml->Set("joint", NameOf(s, term));
    s.xml->Set("coef", term.polynomial[0]);
    s.xml->Close();
  }
  s.xml->Close();
}

void WriteCoupling(const Sections& s, const Coupling& coupling) {
  const PlannedCoupling plan = PlanCoupling(s.mechanism, coupling);
  if (plan.type == PlannedCoupling::Type::kUnknown) return;
  const bool joints = plan.type == PlannedCoupling::Type::kJoint;
  s.xml->Open(joints ? "joint" : "tendon");
  s.xml->Set("name", CouplingName(coupling));
  if (joints) {
    s.xml->Set("joint1", NameOf(s, coupling.terms[plan.first]));
    if (plan.second != plan.first) s.xml->Set("joint2", NameOf(s, coupling.terms[plan.second]));
  } else {
    s.xml->Set("tendon1", CouplingName(coupling));
  }
  s.xml->Set("polycoef", plan.polycoef);
  s.xml->Close();
}

// An equality or sensor on one object.
void WriteOn(const Sections& s, const char* element, const std::string& name,
             const char* object_key, const std::string& object, bool active = true) {
  s.xml->Open(element);
  s.xml->Set("name", name);
  if (!active) s.xml->Set("active", "false");
  s.xml->Set(object_key, object);
  s.xml->Close();
}

// The gap of every closure; its force only for split closures, where it is a tree force (MuJoCo
// 2.2.2 has no sensor for the force of a constraint).
void WriteClosureSensors(const Sections& s, const PlannedClosure& closure) {
  const std::string& name = s.mechanism.joints[closure.joint].name;
  s.xml->Open("framepos");
  s.xml->Set("name", name + ".gap");
  s.xml->Set("objtype", "site");
  s.xml->Set("objname", name + ".M");
  s.xml->Set("reftype", "site");
  s.xml->Set("refname", name + ".F");
  s.xml->Close();
  if (closure.type != PlannedClosure::Type::kSplit) return;
  WriteOn(s, "force", name + ".closure_force", "site", name + ".F");
  WriteOn(s, "torque", name + ".closure_torque", "site", name + ".F");
}

}  // namespace

void WriteTendons(const Sections& s) {
  const auto fixed = [&](const Coupling& coupling) {
    return PlanCoupling(s.mechanism, coupling).type == PlannedCoupling::Type::kTendon;
  };
  bool any = !s.mechanism.springs.empty() || std::ranges::any_of(s.mechanism.couplings, fixed);
  for (const Drive& drive : s.mechanism.drives) {
    any = any || std::holds_alternative<DistanceDrive>(drive.kind);
  }
  if (!any) return;
  s.xml->Open("tendon");
  for (const Drive& drive : s.mechanism.drives) {
    if (!std::holds_alternative<DistanceDrive>(drive.kind)) continue;
    WriteTendon(s, drive.name, drive.radius);
    const PlannedForces forces =
        ForcesOfDrive(s.mechanism, static_cast<int>(&drive - s.mechanism.drives.data()));
    if (forces.any()) WriteSpring(s, forces.stiffness, forces.damping, forces.free);
    FinishTendon(s, drive.name);
  }
  for (const SpringDamper& spring : s.mechanism.springs) {
    WriteTendon(s, spring.name, 0.0);
    WriteSpring(s, spring.stiffness, spring.damping, spring.free_length_m);
    FinishTendon(s, spring.name);
  }
  for (const Coupling& coupling : s.mechanism.couplings) {
    if (fixed(coupling)) WriteFixedTendon(s, coupling);
  }
  s.xml->Close();
}

void WriteEqualities(const Sections& s) {
  if (s.plan.closures.empty() && s.mechanism.drives.empty() && s.mechanism.prescribed.empty() &&
      s.mechanism.couplings.empty()) {
    return;
  }
  s.xml->Open("equality");
  for (const PlannedClosure& closure : s.plan.closures) WriteClosure(s, closure);
  for (const Coupling& coupling : s.mechanism.couplings) WriteCoupling(s, coupling);
  for (const Drive& drive : s.mechanism.drives) {
    const auto* driven = std::get_if<JointDrive>(&drive.kind);
    const std::string name = DriveEqualityName(drive);
    if (driven == nullptr) {
      WriteOn(s, "tendon", name, "tendon1", drive.name, s.options.guided);
    } else if (IsScalar(s.mechanism.joints[driven->joint].kind, driven->coordinate)) {
      WriteOn(s, "joint", name, "joint1",
              JointName(s.mechanism.joints[driven->joint], driven->coordinate), s.options.guided);
    }
  }
  for (const Prescribed& base : s.mechanism.prescribed) {
    WriteOn(s, "joint", BaseEqualityName(base), "joint1",
            JointName(s.mechanism.joints[base.joint], 0));
  }
  s.xml->Close();
}

void WriteSensors(const Sections& s) {
  if (s.mechanism.drives.empty() && s.plan.closures.empty()) return;
  s.xml->Open("sensor");
  for (const Drive& drive : s.mechanism.drives) {
    const auto* driven = std::get_if<JointDrive>(&drive.kind);
    if (driven == nullptr) {
      WriteOn(s, "tendonpos", drive.name + ".position", "tendon", drive.name);
    } else if (IsScalar(s.mechanism.joints[driven->joint].kind, driven->coordinate)) {
      WriteOn(s, "jointpos", drive.name + ".position", "joint",
              JointName(s.mechanism.joints[driven->joint], driven->coordinate));
    } else {
      continue;
    }
    WriteOn(s, "actuatorfrc", drive.name + ".force", "actuator", drive.name);
  }
  for (const PlannedClosure& closure : s.plan.closures) WriteClosureSensors(s, closure);
  s.xml->Close();
}

}  // namespace mbv::mjcf
