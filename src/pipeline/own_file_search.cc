#include "pipeline/own_file_search.h"

#include <fmt/format.h>

#include <sys/resource.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>

#include "mjcf/closure_settings.h"
#include "mjcf/mjcf.h"

namespace mbv {
namespace {

using Clock = std::chrono::steady_clock;

constexpr std::array<double, 3> kStepFactors = {1.0, 0.5, 0.2};
constexpr std::array<double, 3> kTimeConstantSteps = {0.0, 5.0, 2.0};  // 0: the file's own
constexpr std::array<double, 3> kImpedances = {0.0, 0.99, kMjcfImpedance};
constexpr double kImpratio = 10.0;
constexpr double kMostStretched = 10.0;  // wall time on a busy machine, over processor time

struct Candidate {
  OwnSettings settings;
  OwnTrial trial;
  double work = 0.0;  // force solutions per step of the file, about
};

const char* NameOf(OwnIntegrator integrator) {
  switch (integrator) {
    case OwnIntegrator::kEuler:
      return "Euler";
    case OwnIntegrator::kRk4:
      return "RK4";
    case OwnIntegrator::kImplicit:
      return "implicit";
    case OwnIntegrator::kOwn:
      break;
  }
  return "";
}

double StagesOf(const std::string& integrator) {
  return integrator == "RK4" ? 4.0 : integrator == "implicit" ? 1.3 : 1.0;
}

// Processor time of the child processes, which a busy machine does not stretch.
double ChildrenSeconds() {
  rusage usage{};
  getrusage(RUSAGE_CHILDREN, &usage);
  const auto seconds = [](const timeval& t) {
    return static_cast<double>(t.tv_sec) + 1e-6 * static_cast<double>(t.tv_usec);
  };
  return seconds(usage.ru_utime) + seconds(usage.ru_stime);
}

class Search {
 public:
  Search(const OwnFileRequest& request, const OwnSettings& base, const OwnFileRuns::Measured& own,
         OwnFileRuns* runs, OwnFileAudit* audit)
      : request_(request), base_(base), own_(own), runs_(*runs), audit_(*audit) {}

  void Run() {
    audit_.searched = true;
    candidates_.push_back(Make(base_));
    candidates_[0].trial.error = own_.error;
    MakeGrid();
    Try();
    MarkFront();
    Recommend();
    if (audit_.recommended > 0) Paste();
  }

 private:
  Candidate Make(const OwnSettings& settings) const {
    Candidate candidate{.settings = settings, .trial = {}};
    OwnTrial& trial = candidate.trial;
    trial.step_s = own_.run.facts.step_s * settings.step_factor;
    trial.integrator = settings.integrator == OwnIntegrator::kOwn ? own_.run.facts.integrator
                                                                  : NameOf(settings.integrator);
    if (settings.time_constant_s > 0.0)
      trial.solref = fmt::format("{:g} 1", settings.time_constant_s);
    if (settings.impedance > 0.0) {
      trial.solimp = fmt::format("{0:g} {0:g} 0.001 0.5 2", settings.impedance);
    }
    if (settings.impratio > 0.0) trial.other = fmt::format("impratio {:g}", settings.impratio);
    candidate.work = StagesOf(trial.integrator) / settings.step_factor;
    return candidate;
  }

  // All combinations, cheap ones first.
  void MakeGrid() {
    for (const double factor : kStepFactors) {
      for (const OwnIntegrator integrator :
           {OwnIntegrator::kEuler, OwnIntegrator::kRk4, OwnIntegrator::kImplicit}) {
        for (const double steps : kTimeConstantSteps) {
          for (const double impedance : kImpedances) Add(factor, integrator, steps, impedance);
        }
      }
    }
    OwnSettings friction = base_;
    friction.impratio = kImpratio;
    candidates_.push_back(Make(friction));
    std::stable_sort(candidates_.begin() + 1, candidates_.end(),
                     [](const Candidate& a, const Candidate& b) { return a.work < b.work; });
    audit_.planned = candidates_.size();
  }

  void Add(double factor, OwnIntegrator integrator, double steps, double impedance) {
    OwnSettings settings = base_;
    settings.step_factor = factor;
    if (own_.run.facts.integrator != NameOf(integrator)) settings.integrator = integrator;
    if (steps > 0.0) {
      // As it will be pasted.
      settings.time_constant_s =
          std::stod(fmt::format("{:g}", steps * factor * own_.run.facts.step_s));
    }
    if (impedance > 0.0) settings.impedance = impedance;
    if (factor == 1.0 && settings.integrator == OwnIntegrator::kOwn && steps == 0.0 &&
        impedance == 0.0) {
      return;  // the file's own
    }
    candidates_.push_back(Make(settings));
  }

  void Try() {
    const auto start = Clock::now();
    const double used_s = ChildrenSeconds();
    for (size_t i = 0; i < candidates_.size(); ++i) {
      Candidate& candidate = candidates_[i];
      if (i > 0) {
        const double wall_s = std::chrono::duration<double>(Clock::now() - start).count();
        if (ChildrenSeconds() - used_s > request_.search_s ||
            wall_s > kMostStretched * request_.search_s) {
          audit_.budget_s = request_.search_s;
          break;
        }
        if (request_.progress) {
          request_.progress("settings of your own file",
                            static_cast<double>(i) / static_cast<double>(candidates_.size()));
        }
        candidate.trial.error = runs_.Run(candidate.settings).error;
      }
      audit_.trials.push_back(candidate.trial);
    }
  }

  void MarkFront() {
    for (OwnTrial& trial : audit_.trials) {
      trial.front =
          trial.error.sound() &&
          std::none_of(audit_.trials.begin(), audit_.trials.end(), [&](const OwnTrial& o) {
            return o.error.sound() && o.error.cost_ms < trial.error.cost_ms &&
                   o.error.force < trial.error.force;
          });
    }
  }

  // The least work that is good enough; else the least work that is next to the best.
  void Recommend() {
    constexpr double kNearBest = 1.5;
    double force = std::numeric_limits<double>::infinity(), gap = force;
    for (const OwnTrial& trial : audit_.trials) {
      if (!trial.error.sound()) continue;
      force = std::min(force, trial.error.force);
      gap = std::min(gap, trial.error.gap_m);
    }
    const double most_force = std::max(OwnFileAudit::kGoodForce, kNearBest * force);
    const double most_gap = std::max(OwnFileAudit::kGoodGap * audit_.length_m, kNearBest * gap);
    for (size_t i = 0; i < audit_.trials.size(); ++i) {
      const OwnError& error = audit_.trials[i].error;
      if (!error.sound() || !(error.force <= most_force) || !(error.gap_m <= most_gap)) continue;
      const int best = audit_.recommended;
      const bool better = best < 0 || Work(i) < Work(static_cast<size_t>(best)) ||
                          (Work(i) == Work(static_cast<size_t>(best)) && best != 0 &&
                           Merit(i) < Merit(static_cast<size_t>(best)));
      if (better) audit_.recommended = static_cast<int>(i);
    }
  }

  [[nodiscard]] double Work(size_t trial) const { return candidates_[trial].work; }
  // The force error; what changes less may err a little more.
  [[nodiscard]] double Merit(size_t trial) const {
    constexpr double kPerChange = 1.5;
    const OwnTrial& t = audit_.trials[trial];
    return t.error.force * (t.solref.empty() ? 1.0 : kPerChange) *
           (t.solimp.empty() ? 1.0 : kPerChange);
  }

  [[nodiscard]] std::string Lines(const OwnTrial& trial) const {
    const OwnFacts& facts = own_.run.facts;
    std::string option, closures;
    if (trial.step_s != facts.step_s) option += fmt::format(" timestep=\"{:g}\"", trial.step_s);
    if (trial.integrator != facts.integrator) {
      option += fmt::format(" integrator=\"{}\"", trial.integrator);
    }
    if (!trial.solref.empty()) closures += fmt::format(" solref=\"{}\"", trial.solref);
    if (!trial.solimp.empty()) closures += fmt::format(" solimp=\"{}\"", trial.solimp);
    std::string lines;
    if (!option.empty()) lines += fmt::format("<option{}/>\n", option);
    if (!closures.empty()) lines += fmt::format("<default><equality{}/></default>\n", closures);
    return lines;
  }

  // Runs the file with the lines in it. Closures that state settings of their own take no defaults:
  // they are named, and changed where they stand.
  void Paste() {
    const OwnTrial& trial = audit_.trials[static_cast<size_t>(audit_.recommended)];
    audit_.lines = Lines(trial);
    std::string text = mjcf::WithLines(runs_.text(), audit_.lines);
    OwnFileRuns::Measured pasted = runs_.Run(base_, text);
    audit_.stubborn = Stubborn(pasted.run.facts, trial);
    if (!audit_.stubborn.empty() && pasted.run.summary.ok()) {
      text = mjcf::WithClosureSettings(text, trial.solref, trial.solimp);
      pasted = runs_.Run(base_, text);
      if (!Stubborn(pasted.run.facts, trial).empty()) {
        pasted.error.failure = "the closures stand in included files";
      }
    }
    audit_.pasted = pasted.error;
  }

  static std::vector<std::string> Stubborn(const OwnFacts& facts, const OwnTrial& trial) {
    std::vector<std::string> names;
    for (size_t c = 0; c < facts.closures.size(); ++c) {
      const bool ref = trial.solref.empty() || facts.solref[c] == trial.solref;
      const bool imp = trial.solimp.empty() || facts.solimp[c] == trial.solimp;
      if (!ref || !imp) names.push_back(facts.closures[c]);
    }
    return names;
  }

  const OwnFileRequest& request_;
  const OwnSettings base_;
  const OwnFileRuns::Measured& own_;
  OwnFileRuns& runs_;
  OwnFileAudit& audit_;
  std::vector<Candidate> candidates_;
};

}  // namespace

void SearchSettings(const OwnFileRequest& request, const OwnSettings& base,
                    const OwnFileRuns::Measured& own, OwnFileRuns* runs, OwnFileAudit* audit) {
  Search(request, base, own, runs, audit).Run();
}

}  // namespace mbv
