#include "report/source_model_report.h"

#include <fmt/format.h>
#include <algorithm>
#include <cmath>
#include <filesystem>

#include "base/json_text.h"
#include "base/text.h"
#include "report/page.h"

namespace mbv {

double Removed(double as_is, double without) { return 1.0 - without / as_is; }

// Corrected by itself it takes most of the error with it, or left by itself it makes most of it:
// where causes hide each other only one of the two shows.
std::vector<const SourceModelCause*> SourceModelAudit::Culprits() const {
  constexpr double kMost = 0.5;
  std::vector<const SourceModelCause*> culprits;
  if (!as_is.sound()) return culprits;
  const double rest = corrected.sound() ? corrected.force : 0.0;
  for (const SourceModelCause& cause : causes) {
    const bool removes = cause.without.sound() && Removed(as_is.force, cause.without.force) > kMost;
    const bool makes = cause.alone.sound() && cause.alone.force * cause.alone.force - rest * rest >
                                                  kMost * kMost * as_is.force * as_is.force;
    if (removes || makes) culprits.push_back(&cause);
  }
  return culprits;
}

std::string SourceModelSentence(const SourceModelAudit& audit) {
  if (!audit.not_run.empty()) return "the source model was not run: " + audit.not_run;
  const SourceModelError& e = audit.as_is;
  if (!e.sound()) {
    return fmt::format("with its own settings your file gives no forces that could be compared: {}",
                       e.failure);
  }
  std::string gap = fmt::format("its loops open by at most {:.1e} m", e.gap_m);
  if (!e.joint.empty()) gap += fmt::format(" ({}, at {:.3g} s)", e.joint, e.gap_at_s);
  if (!e.twisted.empty()) {
    gap += fmt::format(" and twist by {:.1e} rad ({}, at {:.3g} s)", e.gap_rad, e.twisted,
                       e.gap_rad_at_s);
  }
  if (std::isnan(e.force)) return gap + "; no drive forces could be compared";
  if (audit.Good(e)) {
    return fmt::format(
        "nothing is wrong with your file's settings: on this motion its drive forces agree with "
        "the reference to {:.1e}, and {}",
        e.force, gap);
  }
  if (e.force <= SourceModelAudit::kGoodForce) {
    return fmt::format("with its own settings your file's drive forces agree to {:.1e}, but {}",
                       e.force, gap);
  }
  return fmt::format("with its own settings your file's drive forces are off by {:.2g} %, and {}",
                     100.0 * e.force, gap);
}

namespace {

using Json = nlohmann::ordered_json;

Json ErrorJson(const SourceModelError& e) {
  if (!e.sound()) return {{"failure", e.failure}, {"time_s", Number(e.time_s)}};
  return {{"force_nrmse_later", Number(e.force)},
          {"force_nrmse", Number(e.force_all)},
          {"force_max",
           {{"value", Number(e.force_most)},
            {"unit", e.force_unit},
            {"drive", e.drive},
            {"time_s", Number(e.force_at_s)}}},
          {"joint_force_nrmse_later", Number(e.joint_force)},
          {"loop_gap_m", Number(e.gap_m)},
          {"loop_gap_joint", e.joint},
          {"loop_gap_time_s", Number(e.gap_at_s)},
          {"loop_twist_rad", Number(e.gap_rad)},
          {"loop_twist_joint", e.twisted},
          {"loop_twist_time_s", Number(e.gap_rad_at_s)},
          {"ms_per_s", Number(e.cost_ms)}};
}

}  // namespace

nlohmann::ordered_json SourceModelJson(const SourceModelAudit& audit) {
  Json json = {{"file", audit.file}, {"sentence", SourceModelSentence(audit)}};
  if (!audit.not_run.empty()) {
    json["declined"] = audit.not_run;
    return json;
  }
  json["good"] = audit.Good(audit.as_is);
  json["settings"] = {{"step_s", Number(audit.step_s)}, {"integrator", audit.integrator},
                      {"solver", audit.solver},         {"closures", audit.closures},
                      {"solref", audit.solref},         {"solimp", audit.solimp}};
  json["done"] = audit.done;
  json["notes"] = audit.notes;
  json["later_s"] = audit.later_s;
  json["as_is"] = ErrorJson(audit.as_is);
  json["causes"] = Json::array();
  for (const SourceModelCause& cause : audit.causes) {
    json["causes"].push_back({{"cause", cause.key},
                              {"title", cause.title},
                              {"removes", Number(Removed(audit.as_is.force, cause.without.force))},
                              {"without", ErrorJson(cause.without)},
                              {"alone", ErrorJson(cause.alone)}});
  }
  json["corrected"] = ErrorJson(audit.corrected);
  json["softer"] = ErrorJson(audit.softer);
  json["trials"] = Json::array();
  for (const SourceModelTrial& trial : audit.trials) {
    json["trials"].push_back({{"step_s", Number(trial.step_s)},
                              {"integrator", trial.integrator},
                              {"solref", trial.solref},
                              {"solimp", trial.solimp},
                              {"other", trial.other},
                              {"front", trial.front},
                              {"error", ErrorJson(trial.error)}});
  }
  json["recommended"] = audit.recommended;
  json["lines"] = audit.lines;
  json["closures_with_own_settings"] = audit.stubborn;
  json["settings_alone"] = ErrorJson(audit.bare);
  if (!audit.lines.empty()) {
    json["pasted"] = ErrorJson(audit.pasted);
    json["pasted_as_is"] = ErrorJson(audit.pasted_as_is);
  }
  json["seconds"] = Number(audit.seconds);
  return json;
}

namespace {

std::string Share(double share) {
  if (!std::isfinite(share)) return "-";
  if (share < 0.0) return "none";
  return fmt::format("{:.0f} %", 100.0 * share);
}

// A number of a run, or what became of it.
std::string OrUnsound(const SourceModelError& error, double value) {
  return error.sound() ? NumberOrDash(value) : "unsound";
}

// "solref 0.02 1" of the first closure; says where others differ.
std::string OfClosures(const std::vector<std::string>& values) {
  if (values.empty()) return "none";
  for (const std::string& value : values) {
    if (value != values[0]) return values[0] + " and others";
  }
  return values[0];
}

std::vector<Cell> CauseRowOf(const SourceModelAudit& audit, const std::string& title,
                             const SourceModelError& without, const SourceModelError* alone) {
  const SourceModelError& own = audit.as_is;
  const bool both = own.sound() && without.sound();
  return {title,
          OrUnsound(without, without.force),
          both ? Share(Removed(own.force, without.force)) : "-",
          OrUnsound(without, without.gap_m),
          both ? Share(Removed(own.gap_m, without.gap_m)) : "-",
          alone == nullptr ? "" : OrUnsound(*alone, alone->force)};
}

std::string SettingsLine(const SourceModelAudit& audit) {
  return fmt::format("{}: step {:g} ms, {}, solver {}, loops with solref {}, solimp {}",
                     std::filesystem::path(audit.file).filename().string(), 1e3 * audit.step_s,
                     audit.integrator, audit.solver, OfClosures(audit.solref),
                     OfClosures(audit.solimp));
}

std::vector<std::string> MeasuredLines(const SourceModelAudit& audit) {
  const SourceModelError& e = audit.as_is;
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
  if (audit.bare.sound()) {
    std::string text = fmt::format(
        "of it the file's settings alone, with its drives prescribed exactly and without what the "
        "reference does not have: {:.1e}",
        audit.bare.force);
    for (const SourceModelCause& cause : audit.causes) {
      if (cause.key != "left_out" || !cause.alone.sound()) continue;
      text += fmt::format("; {}, alone: {:.1e}", cause.title, cause.alone.force);
    }
    lines.push_back(text);
  }
  return lines;
}

}  // namespace

std::string CauseSentence(const SourceModelAudit& audit) {
  constexpr double kUnexplained = 0.2;
  const SourceModelError &own = audit.as_is, &corrected = audit.corrected;
  if (audit.causes.empty() || !corrected.sound()) {
    return corrected.sound()
               ? ""
               : "with all of them corrected it is still unsound: " + corrected.failure;
  }
  if (!own.sound())
    return fmt::format("with all of them corrected the force error is {:.1e}", corrected.force);
  const std::vector<const SourceModelCause*> culprits = audit.Culprits();
  std::string text;
  if (culprits.empty()) {
    text = "No single thing makes most of the force error.";
  } else {
    std::string titles;
    for (const SourceModelCause* cause : culprits) {
      titles += (titles.empty() ? "" : "; ") + cause->title;
    }
    text = fmt::format("{}: {}. {}",
                       culprits.size() == 1
                           ? "Most of the force error is made by one thing"
                           : "Most of the force error is made by things that act together",
                       titles, culprits[0]->meaning);
  }
  if (corrected.force > std::max(kUnexplained * own.force, SourceModelAudit::kGoodForce)) {
    // What is left of softness grows with it; another mechanism is as wrong with softer loops.
    constexpr double kGrows = 2.0;
    const bool soft = audit.softer.sound() && audit.softer.force > kGrows * corrected.force;
    text += fmt::format(" But {:.2g} % of the force stays wrong with all of them corrected: {}.",
                        100.0 * corrected.force,
                        soft ? fmt::format("loops as stiff as MuJoCo takes them still give way in "
                                           "this pose, ten times softer ones leave {:.2g} %",
                                           100.0 * audit.softer.force)
                             : "the cause is not settings, the file computes another mechanism "
                               "than the reference");
  }
  if (!audit.searched && audit.Good(audit.bare)) {
    text += fmt::format(
        " The settings need no change: with the drives prescribed exactly, and without what the "
        "reference does not have, the force error is {:.1e}.",
        audit.bare.force);
  }
  return text;
}

namespace {

Table CauseTable(const SourceModelAudit& audit) {
  Table table{.caption = "One setting corrected at a time",
              .columns = {Text("what makes it wrong"), Digits("force error"), Digits("removed"),
                          Digits("loop gap [m]"), Digits("removed"), Digits("it alone leaves")}};
  const SourceModelError& own = audit.as_is;
  table.rows.push_back(
      {"as your file is", OrUnsound(own, own.force), "", OrUnsound(own, own.gap_m)});
  for (const SourceModelCause& cause : audit.causes) {
    table.rows.push_back(CauseRowOf(audit, "without " + cause.title, cause.without, &cause.alone));
  }
  table.rows.push_back(CauseRowOf(audit, "without all of these", audit.corrected, nullptr));
  return table;
}

std::vector<std::string> SearchLines(const SourceModelAudit& audit) {
  if (!audit.searched) return {};
  std::vector<std::string> lines = {
      fmt::format("{} of {} settings were run{}; of each the file's drives are prescribed exactly, "
                  "and what the "
                  "reference does not have is left out, so that nothing but settings is judged",
                  audit.trials.size(), audit.planned,
                  std::isnan(audit.budget_s)
                      ? ""
                      : fmt::format(", which took the {:g} s that it may take", audit.budget_s))};
  for (const SourceModelTrial& trial : audit.trials) {
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

// What no line of settings takes away.
std::string RestOf(const SourceModelAudit& audit) {
  std::string rest;
  for (const SourceModelCause& cause : audit.causes) {
    if (!Contains({"drives", "friction", "left_out"}, cause.key)) continue;
    rest += (rest.empty() ? "" : "; ") + cause.title;
  }
  return rest.empty() ? "what is left is not known" : "what settings of loops leave: " + rest;
}

std::vector<std::string> PastedLines(const SourceModelAudit& audit) {
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
  if (!audit.pasted.sound()) {
    lines.push_back("run with these lines in it, the file gives nothing: " + audit.pasted.failure);
    return lines;
  }
  lines.push_back(
      fmt::format("run with these lines in it, its drives prescribed exactly and without what the "
                  "reference does not "
                  "have, the file gives a force error of {:.2e} and a loop gap of {:.1e} m",
                  audit.pasted.force, audit.pasted.gap_m));
  const SourceModelError& own = audit.pasted_as_is;
  lines.push_back(
      own.sound() ? fmt::format("run with these lines in it and nothing else changed: force "
                                "error {:.2e}, loop gap {:.1e} m{}",
                                own.force, own.gap_m, audit.Good(own) ? "" : "; " + RestOf(audit))
                  : "run with these lines in it and nothing else changed, the file gives "
                    "nothing: " +
                        own.failure);
  return lines;
}

// `all`: also those that are no better for their cost.
Table TrialTable(const SourceModelAudit& audit, bool all) {
  Table table{.caption = all ? "All settings" : "Settings: error against cost",
              .columns = {Text("step"), Text("integrator"), Text("solref"), Text("solimp"),
                          Digits("force error"), Digits("loop gap"), Digits("ms per s"), Text("")}};
  for (size_t i = 0; i < audit.trials.size(); ++i) {
    const SourceModelTrial& trial = audit.trials[i];
    const bool recommended = static_cast<int>(i) == audit.recommended;
    if (!all && i > 0 && !trial.front && !recommended) continue;
    std::string mark = recommended && i > 0 ? "recommended" : i == 0 ? "your file" : trial.other;
    if (trial.front && mark.empty()) mark = all ? "best for its cost" : "";
    table.rows.push_back(
        {fmt::format("{:g} ms", 1e3 * trial.step_s), trial.integrator,
         trial.solref.empty() ? "own" : trial.solref, trial.solimp.empty() ? "own" : trial.solimp,
         OrUnsound(trial.error, trial.error.force),
         trial.error.sound() ? fmt::format("{:.1e} m", trial.error.gap_m) : "unsound",
         trial.error.sound() ? fmt::format("{:.3g}", trial.error.cost_ms) : "-", mark});
  }
  return table;
}

}  // namespace

ReportSection SourceModelSection(const SourceModelAudit& audit, bool verbose) {
  ReportSection section{.title = "Your source file, run as it is", .link = "File"};
  section.Add(Paragraph{Sentence(SourceModelSentence(audit)), Paragraph::Look::kReason});
  if (!audit.not_run.empty()) return section;
  section.Add(Items{MeasuredLines(audit)});
  section.Add(Items{audit.notes});
  section.Add(Fold{"How it was run", {{Items{{SettingsLine(audit)}}}, {Items{audit.done}}}});
  section.Add(CauseTable(audit));
  if (!audit.Good(audit.as_is)) section.Add(Paragraph{CauseSentence(audit)});
  Items meanings;
  for (const SourceModelCause& cause : audit.causes) {
    meanings.texts.push_back(Sentence(cause.title) + " " + cause.meaning);
  }
  section.Add(Fold{"What these things are", {{std::move(meanings)}}}, On::kPage);
  if (audit.searched) {
    section.Add(TrialTable(audit, verbose));
    section.Add(Fold{"All settings that were run", {{TrialTable(audit, true)}}}, On::kPage);
    section.Add(Items{SearchLines(audit)});
  }
  if (!audit.lines.empty()) {
    section.Add(Paragraph{"Recommended settings, to be pasted before </mujoco>:"});
    section.Add(Verbatim{audit.lines});
    section.Add(Items{PastedLines(audit)});
  }
  section.Note(fmt::format("Every number is a run of MuJoCo on the file itself, in all {:.1f} s "
                           "(--no-own-file leaves it out). The verdict does not depend on it.",
                           audit.seconds),
               On::kAll);
  return section;
}

}  // namespace mbv
