#include "report/own_file_words.h"

#include <fmt/format.h>

#include <cmath>
#include <filesystem>

#include "report/number_text.h"

namespace mbv {
namespace {

std::string Share(double share) {
  if (!std::isfinite(share)) return "-";
  if (share < 0.0) return "none";
  return fmt::format("{:.0f} %", 100.0 * share);
}

// A number of a run, or what became of it.
std::string OrUnsound(const OwnError& error, double value) {
  return error.sound() ? NumberCell(value) : "unsound";
}

// "solref 0.02 1" of the first closure; says where others differ.
std::string OfClosures(const std::vector<std::string>& values) {
  if (values.empty()) return "none";
  for (const std::string& value : values) {
    if (value != values[0]) return values[0] + " and others";
  }
  return values[0];
}

std::vector<std::string> CauseRowOf(const OwnFileAudit& audit, const std::string& title,
                                    const OwnError& without, const OwnError* alone) {
  const OwnError& own = audit.as_is;
  const bool both = own.sound() && without.sound();
  return {title,
          OrUnsound(without, without.force),
          both ? Share(Removed(own.force, without.force)) : "-",
          OrUnsound(without, without.gap_m),
          both ? Share(Removed(own.gap_m, without.gap_m)) : "-",
          alone == nullptr ? "" : OrUnsound(*alone, alone->force)};
}

}  // namespace

std::string SettingsLine(const OwnFileAudit& audit) {
  return fmt::format("{}: step {:g} ms, {}, solver {}, loops with solref {}, solimp {}",
                     std::filesystem::path(audit.file).filename().string(), 1e3 * audit.step_s,
                     audit.integrator, audit.solver, OfClosures(audit.solref),
                     OfClosures(audit.solimp));
}

std::vector<std::string> MeasuredLines(const OwnFileAudit& audit) {
  const OwnError& e = audit.as_is;
  if (!e.sound()) return {};
  std::vector<std::string> lines;
  if (std::isfinite(e.force)) {
    lines.push_back(fmt::format(
        "drive forces: error {:.1e} of their RMS from {:g} s on, {:.1e} with the start, in which "
        "soft loops take up the load",
        e.force, audit.later_s, e.force_all));
    if (!e.drive.empty()) {
      lines.back() += fmt::format("; most {:.3g} {} ({}, at {:.3g} s)", e.force_most, e.force_unit,
                                  e.drive, e.force_at_s);
    }
  }
  if (std::isfinite(e.joint_force)) {
    lines.push_back(fmt::format(
        "forces in the joints that close the loops: error {:.1e} of their RMS", e.joint_force));
  }
  return lines;
}

std::string CauseSentence(const OwnFileAudit& audit) {
  constexpr double kUnexplained = 0.2;
  const OwnError &own = audit.as_is, &mended = audit.mended;
  if (audit.causes.empty() || !mended.sound()) {
    return mended.sound() ? "" : "with everything mended it still is unsound: " + mended.failure;
  }
  if (!own.sound())
    return fmt::format("with everything mended {:.1e} of the force is error", mended.force);
  const std::vector<const OwnCause*> culprits = audit.Culprits();
  std::string text;
  if (culprits.empty()) {
    text = "No single thing makes most of the force error.";
  } else {
    std::string titles;
    for (const OwnCause* cause : culprits) titles += (titles.empty() ? "" : "; ") + cause->title;
    text = fmt::format("{}: {}. {}",
                       culprits.size() == 1
                           ? "Most of the force error is made by one thing"
                           : "Most of the force error is made by things that act together",
                       titles, culprits[0]->meaning);
  }
  if (mended.force > std::max(kUnexplained * own.force, OwnFileAudit::kGoodForce)) {
    text += fmt::format(
        " But {:.2g} % of the force stays wrong with all of them mended: that is no matter of "
        "settings, the file computes another mechanism than the reference.",
        100.0 * mended.force);
  }
  if (!audit.searched && audit.Good(audit.bare)) {
    text += fmt::format(
        " The settings need no change: with the drives led exactly, and without what the reference "
        "does not have, the force error is {:.1e}.",
        audit.bare.force);
  }
  return text;
}

std::vector<std::string> CauseHead() {
  return {"what makes it wrong", "force error", "removed",
          "loop gap [m]",        "removed",     "it alone leaves"};
}

std::vector<std::vector<std::string>> CauseCells(const OwnFileAudit& audit) {
  std::vector<std::vector<std::string>> cells;
  const OwnError& own = audit.as_is;
  cells.push_back(
      {"as your file is", OrUnsound(own, own.force), "", OrUnsound(own, own.gap_m), "", ""});
  for (const OwnCause& cause : audit.causes) {
    cells.push_back(CauseRowOf(audit, "without " + cause.title, cause.without, &cause.alone));
  }
  cells.push_back(CauseRowOf(audit, "without all of these", audit.mended, nullptr));
  return cells;
}

std::vector<std::string> SearchLines(const OwnFileAudit& audit) {
  if (!audit.searched) return {};
  std::vector<std::string> lines = {fmt::format(
      "{} of {} settings were run{}; of each the file's drives are led exactly, and what the "
      "reference does not have is left out, so that nothing but settings is judged",
      audit.trials.size(), audit.planned,
      std::isnan(audit.budget_s)
          ? ""
          : fmt::format(", which took the {:g} s that it may take", audit.budget_s))};
  for (const OwnTrial& trial : audit.trials) {
    if (trial.other.empty() || audit.trials.empty()) continue;
    const bool same = trial.error.force == audit.trials[0].error.force;
    lines.push_back(same ? trial.other + " changes nothing: it acts on the friction of contacts"
                         : trial.other + fmt::format(" gives {:.2e}", trial.error.force));
  }
  if (audit.recommended == 0) {
    lines.emplace_back("nothing that was tried does better than the file's own settings");
  }
  return lines;
}

std::vector<std::string> PastedLines(const OwnFileAudit& audit) {
  if (audit.lines.empty()) return {};
  std::vector<std::string> lines;
  if (!audit.stubborn.empty()) {
    std::string names;
    for (const std::string& name : audit.stubborn) names += (names.empty() ? "" : ", ") + name;
    lines.push_back(fmt::format(
        "these closures state settings of their own, or have a class: write solref and solimp "
        "there, too: {}",
        names));
  }
  lines.push_back(audit.pasted.sound()
                      ? fmt::format("run with these lines in it, the file gives a force error of "
                                    "{:.2e} and a loop gap of {:.1e} m",
                                    audit.pasted.force, audit.pasted.gap_m)
                      : "run with these lines in it, the file gives nothing: " +
                            audit.pasted.failure);
  return lines;
}

std::vector<std::string> TrialHead() {
  return {"step", "integrator", "solref", "solimp", "force error", "loop gap", "ms per s", ""};
}

std::vector<std::vector<std::string>> TrialCells(const OwnFileAudit& audit, bool all) {
  std::vector<std::vector<std::string>> cells;
  for (size_t i = 0; i < audit.trials.size(); ++i) {
    const OwnTrial& trial = audit.trials[i];
    const bool recommended = static_cast<int>(i) == audit.recommended;
    if (!all && i > 0 && !trial.front && !recommended) continue;
    std::string mark = recommended && i > 0 ? "recommended" : i == 0 ? "your file" : trial.other;
    if (trial.front && mark.empty()) mark = all ? "best for its cost" : "";
    cells.push_back({fmt::format("{:g} ms", 1e3 * trial.step_s), trial.integrator,
                     trial.solref.empty() ? "own" : trial.solref,
                     trial.solimp.empty() ? "own" : trial.solimp,
                     OrUnsound(trial.error, trial.error.force),
                     trial.error.sound() ? fmt::format("{:.1e} m", trial.error.gap_m) : "unsound",
                     trial.error.sound() ? fmt::format("{:.3g}", trial.error.cost_ms) : "-", mark});
  }
  return cells;
}

}  // namespace mbv
