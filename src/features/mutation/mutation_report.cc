#include "features/mutation/mutation_report.h"

#include <fmt/format.h>
#include <algorithm>
#include <cmath>

#include "base/json_fields.h"
#include "base/markup.h"
#include "base/text.h"
#include "report/page.h"

namespace mbv {
namespace {

// By smallest error where it is known, else by the force change.
double Rank(const Detection& s) {
  if (!std::isnan(s.smallest)) return s.smallest;
  return s.detected && !std::isnan(s.force_change) ? 1.0 / (1.0 + s.force_change) : 10.0;
}

std::string SeenText(const Detection& s) {
  return !s.detected ? "no" : s.by_force ? "drive forces" : s.ran ? "yes" : "refused";
}

std::string NoteOf(const Mutation& m) {
  const Detection& s = m.own;
  std::string note;
  if (m.value == 0.0) {
    note = fmt::format("relative to {:g}{}{}; ", m.relative_to, m.unit.empty() ? "" : " ", m.unit);
  }
  if (!s.only.empty()) note += fmt::format("only {}, the model refuses the other way; ", s.only);
  if (!s.detected) {
    note += m.reason + (s.best_check.empty() ? "" : "; seen first by " + s.best_check);
  } else if (s.best_check == "model") {
    note += "the model is refused";
    if (!s.reason.empty()) note += ": " + s.reason;
  } else {
    note += s.best_check;
  }
  return note;
}

bool HasInverse(const MutationReport& report) {
  return std::any_of(report.mutations.begin(), report.mutations.end(),
                     [](const Mutation& m) { return m.inverse.has_value(); }) ||
         std::any_of(report.faults.begin(), report.faults.end(),
                     [](const FaultResult& f) { return f.inverse.has_value(); });
}

std::string SeenText(const FaultDetection& s) { return s.detected ? "yes" : "no"; }

// An instance's number of which forces know nothing: part of a long list, reported together.
bool IsIdle(const Mutation& m) {
  return m.kind == NumberKind::kInstance && !m.own.detected && !std::isnan(m.proved_to);
}

std::string Change(double value) { return NumberOrDash(value, "{:.1e}"); }

// `inverse`: also by inverse dynamics.
Table NumberTable(const MutationReport& report, bool inverse) {
  Table table{.columns = {Text("number"), Digits("value"), Text("detected"), Digits("force NRMSE"),
                          Digits("smallest, " + report.mode)}};
  if (inverse) table.columns.push_back(Digits("inverse"));
  table.columns.push_back(Text("seen first by, or why not"));
  for (const Mutation& m : report.mutations) {
    if (IsIdle(m)) continue;
    std::vector<Cell> row = {Code(m.name), fmt::format("{:g} {}", m.value, m.unit), SeenText(m.own),
                             Change(m.own.force_change), Change(m.own.smallest)};
    if (inverse) row.emplace_back(Change(m.inverse ? m.inverse->smallest : kNan));
    row.emplace_back(NoteOf(m));
    table.rows.push_back(std::move(row));
  }
  return table;
}

Table FaultTable(const MutationReport& report, bool inverse) {
  Table table{.columns = {Text("structural fault"), Text("where"), Text("detected")}};
  if (inverse) table.columns.push_back(Text("inverse"));
  table.columns.push_back(Text("how, or why not"));
  for (const FaultResult& f : report.faults) {
    std::string note = f.applicable ? f.own.reason : f.reason;
    if (f.applicable && f.own.ran && f.own.detected) {
      note = fmt::format("{} = {:.1e} (limit {:.0e})", f.own.check, f.own.value, f.own.limit);
    } else if (f.applicable && !f.own.ran) {
      note = "could not run: " + f.own.reason;
    }
    std::vector<Cell> row = {f.kind,
                             f.where + (f.alike > 0 ? fmt::format(" (and {} alike)", f.alike) : ""),
                             f.applicable ? SeenText(f.own) : "not applicable"};
    if (inverse) row.emplace_back(f.inverse ? SeenText(*f.inverse) : "–");
    row.emplace_back(note);
    table.rows.push_back(std::move(row));
  }
  return table;
}

std::string IdleText(const MutationReport& report, bool markdown) {
  std::string names;
  size_t count = 0;
  for (const Mutation& m : report.mutations) {
    if (!IsIdle(m)) continue;
    names += (count++ == 0 ? "" : ", ") + (markdown ? MarkdownCode(m.name) : OneLine(m.name));
  }
  if (count == 0) return "";
  return fmt::format("\n{}Numbers of instances that change no drive force ({}): {}.\n",
                     markdown ? "" : "  ", count, names);
}

std::string CountText(const MutationReport& report) {
  const auto of_kind = [&](NumberKind kind) {
    return std::count_if(report.mutations.begin(), report.mutations.end(),
                         [kind](const Mutation& m) { return m.kind == kind; });
  };
  const auto instance = of_kind(NumberKind::kInstance), literal = of_kind(NumberKind::kLiteral);
  std::string text = fmt::format("{} parameters", of_kind(NumberKind::kParameter));
  if (instance > 0) text += fmt::format(", {} of instances", instance);
  if (literal > 0) text += fmt::format(", {} written out in place", literal);
  return text;
}

std::string Head(const MutationReport& report, bool inverse, bool markdown) {
  const auto count = [&](auto predicate) {
    return std::count_if(report.mutations.begin(), report.mutations.end(), predicate);
  };
  const auto seen = count([](const Mutation& m) { return m.own.detected; });
  const auto by_force = count([](const Mutation& m) { return m.own.by_force; });
  std::string text = fmt::format(
      "{}: {} of {} numbers ({}), each {:g} % too large and too small on the simulated side, turn "
      "the verdict in {} mode; {} of them by the drive forces",
      markdown ? MarkdownText(report.scenario) : OneLine(report.scenario), seen,
      report.mutations.size(), CountText(report), 100 * report.size, report.mode, by_force);
  if (inverse) {
    text += fmt::format("; {} do in inverse mode",
                        count([](const Mutation& m) { return m.inverse && m.inverse->detected; }));
  }
  if (!report.faults.empty()) {
    size_t applicable = 0, detected = 0;
    for (const FaultResult& fault : report.faults) {
      applicable += fault.applicable ? 1 : 0;
      detected += fault.applicable && fault.own.detected ? 1 : 0;
    }
    text += fmt::format("; so do {} of {} structural faults in {} mode", detected, applicable,
                        report.mode);
  }
  return text + fmt::format(" ({} simulations in {:.1f} s)\n\n", report.runs, report.wall_s);
}

}  // namespace

void SortBySensitivity(MutationReport* report) {
  std::stable_sort(report->mutations.begin(), report->mutations.end(),
                   [](const Mutation& a, const Mutation& b) { return Rank(a.own) < Rank(b.own); });
}

std::string ToText(const MutationReport& report, bool markdown) {
  const bool inverse = HasInverse(report);
  const auto written = [&](const Table& table) {
    return markdown ? ToMarkdown(table) : ToText(table);
  };
  std::string text = Head(report, inverse, markdown) + written(NumberTable(report, inverse)) +
                     IdleText(report, markdown);
  text += fmt::format(
      "\n{}The smallest relative error is the smallest one that was detected both ways; one {:g} % "
      "smaller was not.\n",
      markdown ? "" : "  ", 100.0 * report.resolution);
  return report.faults.empty() ? text : text + "\n" + written(FaultTable(report, inverse));
}

// Mutation reports as JSON, and back: workers hand their parts over in this form.

namespace {

constexpr const char* kMutationSchema = "mbverify.mutate/2";
constexpr const char* kKinds[] = {"parameter", "instance", "literal"};

// Item k of part i is item k·n + i of all.
template <typename T>
std::vector<T> Interleave(std::vector<MutationReport>* parts,
                          std::vector<T> MutationReport::*items) {
  std::vector<T> all;
  bool any = true;
  for (size_t k = 0; any; ++k) {
    any = false;
    for (MutationReport& part : *parts) {
      if (k >= (part.*items).size()) continue;
      all.push_back(std::move((part.*items)[k]));
      any = true;
    }
  }
  return all;
}

}  // namespace

template <typename F, Is<Detection> T>
void Describe(F& field, T& detection) {
  field("ran", detection.ran);
  field("detected", detection.detected);
  field("by_force", detection.by_force);
  field("force_nrmse", detection.force_change);
  field("smallest", detection.smallest);
  field("check", detection.best_check);
  field("only", detection.only);
  field("reason", detection.reason);
}

template <typename F, Is<FaultDetection> T>
void Describe(F& field, T& detection) {
  field("ran", detection.ran);
  field("detected", detection.detected);
  field("check", detection.check);
  field("value", detection.value);
  field("limit", detection.limit);
  field("reason", detection.reason);
}

template <typename F, Is<Mutation> T>
void Describe(F& field, T& mutation) {
  field.Word("kind", mutation.kind, kKinds);
  field("name", mutation.name);
  field("unit", mutation.unit);
  field("value", mutation.value);
  field("relative_to", mutation.relative_to);
  field("unseen_up_to", mutation.proved_to);
  field("force_sensitivity", mutation.sensitivity);
  field("reason", mutation.reason);
  field("own", mutation.own);
  field("inverse", mutation.inverse);
}

template <typename F, Is<FaultResult> T>
void Describe(F& field, T& result) {
  field("fault", result.kind);
  field("where", result.where);
  field("applicable", result.applicable);
  field("alike", result.alike);
  field("reason", result.reason);
  field("own", result.own);
  field("inverse", result.inverse);
}

template <typename F, Is<MutationReport> T>
void Describe(F& field, T& report) {
  field("scenario", report.scenario);
  field("mode", report.mode);
  field("exit_code", report.exit_code);
  field("size", report.size);
  field("resolution", report.resolution);
  field("simulations", report.runs);
  field("wall_s", report.wall_s);
  field("numbers", report.mutations);
  field("faults", report.faults);
}

std::string ToJson(const MutationReport& report) {
  JsonFieldWriter field;
  field("schema", std::string(kMutationSchema));
  Describe(field, report);
  return Dump(field.json);
}

std::optional<MutationReport> MutationReportOf(const std::string& text) {
  return ReadJson(text, FromJson<MutationReport>, kMutationSchema).value;
}

MutationReport MergeParts(std::vector<MutationReport> parts) {
  MutationReport all = parts.front();
  all.mutations = Interleave(&parts, &MutationReport::mutations);
  all.faults = Interleave(&parts, &MutationReport::faults);
  all.runs = 0;
  for (const MutationReport& part : parts) {
    all.runs += part.runs;
    all.wall_s = std::max(all.wall_s, part.wall_s);
    all.exit_code = std::max(all.exit_code, part.exit_code);
  }
  SortBySensitivity(&all);
  return all;
}

}  // namespace mbv
