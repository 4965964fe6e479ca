// Closures and couplings of an MJCF file.
#include <algorithm>

#include "simulation/mjcf_import.h"

namespace mbv::simulation {
namespace {

Pose SitePose(const mjModel& m, const std::string& name) {
  const int s = IdOf(m, mjOBJ_SITE, name);
  return PoseAt(m.site_pos + 3 * s, m.site_quat + 4 * s);
}

void AddClosure(int e, const std::string& name, MjcfImport* in) {
  const mjModel& m = in->m;
  const mjtNum* data = m.eq_data + mjNEQDATA * e;
  const bool connect = m.eq_type[e] == mjEQ_CONNECT;
  Joint joint;
  joint.name = name;
  joint.closure = true;
  joint.kind = connect ? JointKind::kSpherical : JointKind::kFixed;
  joint.parent = in->body_of[static_cast<size_t>(m.eq_obj1id[e])];
  joint.child = in->body_of[static_cast<size_t>(m.eq_obj2id[e])];
  const auto sites = in->foreign.closures_by_sites().find(name);
  if (sites != in->foreign.closures_by_sites().end()) {
    joint.X_PF = SitePose(m, sites->second.first);
    joint.X_CM = SitePose(m, sites->second.second);
  } else if (connect) {
    joint.X_PF = Shifted(VecAt(data));
    joint.X_CM = Shifted(VecAt(data + 3));
  } else {
    joint.X_PF = PoseAt(data + 3, data + 6);
    joint.X_CM = Shifted(VecAt(data));
  }
  if (joint.parent == joint.child) {
    in->Say(fmt::format("equality '{}' connects a body with itself and is left out", name));
    return;
  }
  in->closure_of[static_cast<size_t>(e)] = static_cast<int>(in->mechanism.joints.size());
  in->mechanism.joints.push_back(joint);
}

// Adds P(q) of a joint; false if it has no such coordinate, or stands in the coupling twice.
bool AddTerm(const MjcfImport& in, int joint, const std::vector<double>& polynomial,
             Coupling* coupling) {
  const int type = in.m.jnt_type[joint];
  if (type != mjJNT_HINGE && type != mjJNT_SLIDE) return false;
  const int at = in.joint_of[static_cast<size_t>(joint)];
  const bool twice = std::ranges::any_of(
      coupling->terms, [at](const Coupling::Term& term) { return term.joint == at; });
  coupling->terms.push_back({.joint = at, .coordinate = 0, .polynomial = polynomial});
  return !twice;
}

// Adds c Σ c_k q_k of a fixed tendon.
bool AddTendon(int tendon, double factor, Coupling* coupling, MjcfImport* in) {
  const mjModel& m = in->m;
  const int first = m.tendon_adr[tendon];
  for (int w = first; w < first + m.tendon_num[tendon]; ++w) {
    if (m.wrap_type[w] != mjWRAP_JOINT) return false;
    if (!AddTerm(*in, m.wrap_objid[w], {factor * m.wrap_prm[w]}, coupling)) return false;
  }
  if (m.tendon_stiffness[tendon] == 0.0 && m.tendon_damping[tendon] == 0.0) {
    in->coupling_tendons.insert(tendon);
  }
  return true;
}

// q_1 = Σ_i a_i q_2^i of two joints or fixed tendons, all counted from the reference pose; of
// tendons only where it is linear.
bool AddSides(int e, Coupling* coupling, MjcfImport* in) {
  const mjModel& m = in->m;
  const mjtNum* a = m.eq_data + mjNEQDATA * e;
  const auto add = [&](int object, const std::vector<double>& polynomial) {
    if (m.eq_type[e] == mjEQ_JOINT) return AddTerm(*in, object, polynomial, coupling);
    return m.eq_type[e] == mjEQ_TENDON && polynomial.size() == 1 &&
           AddTendon(object, polynomial[0], coupling, in);
  };
  std::vector<double> polynomial(a + 1, a + 5);
  while (!polynomial.empty() && polynomial.back() == 0.0) polynomial.pop_back();
  coupling->constant = a[0];
  return add(m.eq_obj1id[e], {-1.0}) &&
         (m.eq_obj2id[e] < 0 || polynomial.empty() || add(m.eq_obj2id[e], polynomial));
}

void AddCoupling(int e, const std::string& name, MjcfImport* in) {
  Coupling coupling{.name = name, .terms = {}};
  if (!AddSides(e, &coupling, in)) {
    const char* element = in->m.eq_type[e] == mjEQ_JOINT ? "equality/joint" : "equality/tendon";
    in->LeaveOut(element, "",
                 fmt::format("equality '{}' (couplings are known of hinges and slides, by a "
                             "polynomial or by linear fixed tendons)",
                             name));
  } else if (coupling.terms.size() == 1) {
    // A drive holds it as well; without one it is another mechanism.
    const int joint = coupling.terms[0].joint;
    const std::string text = fmt::format("equality '{}', which holds joint '{}' alone,", name,
                                         in->mechanism.joints[static_cast<size_t>(joint)].name);
    bool driven = false;
    for (int u = 0; u < in->m.nu; ++u) {
      const int type = in->m.actuator_trntype[u];
      if (type != mjTRN_JOINT && type != mjTRN_JOINTINPARENT) continue;
      driven = driven || in->joint_of[static_cast<size_t>(in->m.actuator_trnid[2 * u])] == joint;
    }
    if (driven) {
      in->Say(text + " is left out: its drive holds the joint");
    } else {
      in->LeaveOut("equality/joint", "", text);
    }
  } else {
    in->mechanism.couplings.push_back(coupling);
  }
}

}  // namespace

void AddEqualities(MjcfImport* in) {
  const mjModel& m = in->m;
  in->closure_of.assign(static_cast<size_t>(m.neq), -1);
  for (int e = 0; e < m.neq; ++e) {
    const std::string name = in->NameOf(mjOBJ_EQUALITY, e, "equality");
    if (m.eq_active[e] == 0 || in->EqualitiesAreOff()) {
      in->Say(fmt::format("equality '{}' is switched off in the file, and left out", name));
    } else if (m.eq_type[e] == mjEQ_CONNECT || m.eq_type[e] == mjEQ_WELD) {
      AddClosure(e, name, in);
    } else {
      AddCoupling(e, name, in);
    }
  }
}

}  // namespace mbv::simulation
