#include "pipeline/own_file_audit.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>

#include "core/text.h"
#include "mjcf/mjcf.h"
#include "pipeline/own_file_runs.h"
#include "pipeline/own_file_search.h"

namespace mbv {
namespace {

// What can make a file's forces wrong, and the remedy.
struct CauseRow {
  const char *key, *title, *meaning;
  bool (*applies)(const OwnFacts&);
  void (*mend)(const OwnFacts&, OwnSettings*);
};

bool Always(const OwnFacts& /*facts*/) { return true; }

constexpr const char* kVelocityMeaning =
    "A joint that closes a loop moves on a curved path, and to stay on a curve a body must be "
    "pulled sideways, as a stone on a string is. MuJoCo before 3.7 leaves this pull (J̇q̇ in its "
    "formulas) out of connect and weld: moving loops drift apart until their springs pull them "
    "back. Current versions have it for connect and weld, but not for tendon equalities and "
    "polynomial joint equalities.";
constexpr const char* kSoftMeaning =
    "To MuJoCo a loop is held together by springs and dampers. solref says how fast they pull it "
    "together (its first number is a time in s), solimp how much they give way under load.";

const std::vector<CauseRow>& Rows() {
  static const std::vector<CauseRow> kRows = {
      {"velocity_term", "the pull that keeps moving loops on their curve", kVelocityMeaning,
       &Always, [](const OwnFacts&, OwnSettings* s) { s->velocity_term = true; }},
      {"softness", "soft loops (solref, solimp)", kSoftMeaning, &Always,
       [](const OwnFacts& facts, OwnSettings* s) {
         s->time_constant_s = 2.0 * facts.step_s;
         s->impedance = kMjcfImpedance;
       }},
      {"friction", "soft friction losses (solreffriction, solimpfriction)",
       "To MuJoCo a joint that rubs is held by a damper that gives way where its force exceeds the "
       "friction loss: near rest it creeps, and the force is less than the loss.",
       [](const OwnFacts& facts) { return facts.rubs; },
       [](const OwnFacts&, OwnSettings* s) { s->stiff_friction = true; }},
      {"integration", "step and integrator",
       "How time is cut into steps: here against the Runge-Kutta method at a quarter of the step.",
       &Always,
       [](const OwnFacts&, OwnSettings* s) {
         s->integrator = OwnIntegrator::kRk4;
         s->step_factor = 0.25;
       }},
      {"drives", "drives that lag behind their command",
       "The file's own servos or equalities lead the drives; they follow with a delay, and their "
       "forces are those of another motion than the commanded one.",
       [](const OwnFacts& facts) {
         return std::any_of(facts.leads.begin(), facts.leads.end(),
                            [](DriveLead lead) { return lead != DriveLead::kAdded; });
       },
       [](const OwnFacts&, OwnSettings* s) { s->exact_drives = true; }},
      {"left_out", "what the reference does not have",
       "The file has it, the reference computes without it: not an error of the file.",
       [](const OwnFacts& facts) { return !facts.left_out.empty(); },
       [](const OwnFacts&, OwnSettings* s) { s->plain = true; }},
      {"solver", "a solver that stops early",
       "solver, iterations and tolerance say how well MuJoCo solves for the forces of one step.",
       [](const OwnFacts& facts) { return facts.rough_solver; },
       [](const OwnFacts&, OwnSettings* s) { s->exact_solver = true; }}};
  return kRows;
}

class Auditor {
 public:
  explicit Auditor(const OwnFileRequest& request) : request_(request), runs_(request) {}

  OwnFileAudit Run() {
    audit_.file = request_.file;
    audit_.duration_s = request_.prepared->scenario.motion.duration_s;
    audit_.length_m = runs_.length_m();
    audit_.declined = runs_.declined();
    if (audit_.declined.empty()) Audit();
    audit_.seconds = Seconds();
    return std::move(audit_);
  }

 private:
  void Audit() {
    Tell(0.0);
    const OwnFileRuns::Measured own = runs_.Run({});
    if (own.run.summary.stop == Stop::kUnsupported) {
      audit_.declined = own.run.summary.message;
      return;
    }
    audit_.as_is = own.error;
    audit_.notes = own.run.notes;
    TellFile(own.run.facts);
    Attribute(own.run.facts);
    if (audit_.Good(audit_.as_is)) return;
    // Settings are judged where nothing but them is wrong.
    OwnSettings base;
    base.exact_drives = true;
    base.plain = !own.run.facts.left_out.empty();
    base.stiff_friction = own.run.facts.rubs;
    const OwnFileRuns::Measured bare = runs_.Run(base);
    audit_.bare = bare.error;
    const bool comparable = !bare.error.sound() || std::isfinite(bare.error.force);
    if (comparable && !audit_.Good(bare.error))
      SearchSettings(request_, base, bare, &runs_, &audit_);
  }

  void Tell(double fraction) const {
    if (request_.progress) request_.progress("your own file", fraction);
  }

  void TellFile(const OwnFacts& facts) {
    audit_.step_s = facts.step_s;
    audit_.integrator = facts.integrator;
    audit_.solver = fmt::format("{}, {} iterations, tolerance {:g}", facts.solver, facts.iterations,
                                facts.tolerance);
    audit_.closures = facts.closures;
    audit_.solref = facts.solref;
    audit_.solimp = facts.solimp;
    TellLeads(facts);
    audit_.done.emplace_back("contacts are off: with them it would be another mechanism");
    const auto say = [&](const std::vector<std::string>& names, const char* what) {
      constexpr size_t kMost = 6;
      if (!names.empty()) audit_.done.push_back(fmt::format("{}: {}", what, Joined(names, kMost)));
    };
    say(facts.held, "free bodies are held where they are, by an inertia 1e12 times the robot's");
    say(facts.couplings, "couplings that the reference does not have are off");
    say(facts.damped, "servos whose kv is taken over by hand, as MuJoCo 2.2 does not know it");
    if (request_.prepared->scenario.simulation.ignore_ranges) {
      audit_.done.emplace_back("limits of joints are off: home is beyond one");
    }
    say(facts.pushers, "actuators that drive nothing here are off");
    say(facts.left_out, "the file has what the reference does not");
  }

  void TellLeads(const OwnFacts& facts) {
    std::vector<std::string> servos, equalities, motors, bare;
    for (size_t k = 0; k < facts.leads.size(); ++k) {
      const std::string& name = request_.prepared->base.drives[k].name;
      switch (facts.leads[k]) {
        case DriveLead::kServo:
          servos.push_back(name);
          break;
        case DriveLead::kEquality:
          equalities.push_back(name);
          break;
        case DriveLead::kAdded:
          (facts.motors[k].empty() ? bare : motors).push_back(name);
          break;
      }
    }
    const auto say = [&](const std::vector<std::string>& names, const std::string& how) {
      constexpr size_t kMost = 6;
      if (!names.empty()) audit_.done.push_back(Joined(names, kMost) + ": " + how);
    };
    say(servos, "led by the file's own position servos, which get the commanded positions");
    say(equalities,
        "led by the file's own equality on the joint, which gets the commanded position");
    const std::string exactly =
        "an added equality leads the joint, as stiff as MuJoCo allows and with the commanded "
        "acceleration, so that it adds no error of its own";
    say(motors, "motors in the file, which do not know where to go: " + exactly);
    say(bare, "no actuator in the file: " + exactly);
  }

  // A run, unless runs have taken too long already.
  OwnError Try(const OwnSettings& settings) {
    constexpr double kMost_s = 60.0;
    const double s = Seconds();
    if (s < kMost_s) return runs_.Run(settings).error;
    OwnError error;
    error.failure = fmt::format("left out: other runs had taken {:.0f} s", s);
    return error;
  }

  [[nodiscard]] double Seconds() const {
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - start_).count();
  }

  void Attribute(const OwnFacts& facts) {
    std::vector<const CauseRow*> rows;
    OwnSettings all;
    for (const CauseRow& row : Rows()) {
      if (!row.applies(facts)) continue;
      rows.push_back(&row);
      row.mend(facts, &all);
    }
    const double steps = 2.0 * static_cast<double>(rows.size()) + 2.0;
    double step = 0.0;
    audit_.mended = Try(all);
    for (const CauseRow* row : rows) {
      OwnSettings without, alone;
      row->mend(facts, &without);
      for (const CauseRow* other : rows) {
        if (other != row) other->mend(facts, &alone);
      }
      Tell((step += 1.0) / steps);
      OwnCause cause{.key = row->key, .title = row->title, .meaning = row->meaning};
      cause.without = Try(without);
      Tell((step += 1.0) / steps);
      cause.alone = Try(alone);
      audit_.causes.push_back(std::move(cause));
    }
    for (OwnCause& cause : audit_.causes) {
      if (cause.key == "left_out") cause.title += ": " + Joined(facts.left_out);
    }
  }

  const OwnFileRequest& request_;
  OwnFileRuns runs_;
  OwnFileAudit audit_;
  const std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
};

}  // namespace

OwnFileAudit AuditOwnFile(const OwnFileRequest& request) { return Auditor(request).Run(); }

}  // namespace mbv
