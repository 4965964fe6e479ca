#include "features/certify/certify.h"

#include <fmt/format.h>
#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <utility>
#include <vector>

#include "base/json_text.h"
#include "base/roles.h"
#include "base/text.h"
#include "report/document.h"
#include "report/page.h"
#include "scenario/checks.h"

namespace mbv {
namespace {

std::string Called(const std::string& witness) {
  const Role* role = FindRole(witness);
  return role == nullptr ? witness : role->called;
}

Table WitnessTable(const Certificate& certificate) {
  Table table{.name = "proved_errors",
              .caption = "How far each witness lies from what is proved, at most",
              .columns = {Text("witness"), Digits("forces"), Digits("proved digits"),
                          Digits("motion"), Digits("reactions"), Spare(Text("largest at"))},
              .rows = {}};
  for (const WitnessProof& w : certificate.witnesses) {
    table.rows.push_back(
        {Cell(Called(w.witness), w.wrong ? Mark::kFail : Mark::kOk),
         fmt::format("{:.1e}", w.force_error), fmt::format("{:.1f}", w.digits()),
         fmt::format("{:.1e}", w.motion_error),
         w.reactions == 0 ? std::string("–") : fmt::format("{:.1e}", w.reaction_error),
         w.channel.empty() ? "" : fmt::format("{}, t = {:g} s", w.channel, w.time_s)});
  }
  return table;
}

Table ForceTable(const Certificate& certificate) {
  Table table{.name = "proved_forces",
              .caption = "Proved values",
              .columns = {Digits("t [s]"), Text("force"), Digits("value"), Digits("± radius"),
                          Text("unit")},
              .rows = {}};
  for (const SampleProof& sample : certificate.samples) {
    for (const ProvedValue& value : sample.values) {
      if (!value.force) continue;
      table.rows.push_back({fmt::format("{:g}", sample.time_s), value.channel, value.text,
                            fmt::format("{:.1e}", value.radius), value.unit});
    }
  }
  return table;
}

Table SampleTable(const Certificate& certificate) {
  Table table{.name = "proofs",
              .caption = "What was proved where; distances to the nearest singular equations",
              .columns = {Digits("t [s]"), Text("result"), Digits("bits"), Digits("unique within"),
                          Digits("distance, closure"), Digits("distance, forces")},
              .rows = {}};
  for (const SampleProof& s : certificate.samples) {
    if (!s.proved()) {
      table.rows.push_back({fmt::format("{:g}", s.time_s), Cell(s.why_not, Mark::kWarn)});
      continue;
    }
    table.rows.push_back(
        {fmt::format("{:g}", s.time_s), Cell("proved", Mark::kOk), fmt::format("{}", s.bits),
         fmt::format("{:.0e}", s.unique_within),
         fmt::format("{:.3g} … {:.3g}", s.closure_distance_low, s.closure_distance_high),
         fmt::format("{:.3g} … {:.3g}", s.force_distance_low, s.force_distance_high)});
  }
  return table;
}

ReportSection SectionOf(const Certificate& certificate) {
  ReportSection section{.title = "Proved digits", .link = "Proof"};
  section.Add(Paragraph{Sentence(certificate.Sentence()), Paragraph::Look::kReason});
  if (!certificate.why_not.empty()) return section;
  if (const WitnessProof* wrong = certificate.FirstWrong(); wrong != nullptr) {
    section.Add(Paragraph{Sentence(wrong->Sentence()), Paragraph::Look::kOdd});
  }
  section.Add(WitnessTable(certificate));
  for (const SampleProof& sample : certificate.samples) {
    if (!sample.proved()) {
      section.Add(Items{{fmt::format("t = {:g} s: {}", sample.time_s, sample.why_not)}},
                  On::kTerminal);
    }
  }
  section.Add(Fold{"Proved forces", {{ForceTable(certificate)}}}, On::kPage);
  section.Add(Fold{"Where, and how near to a singular pose", {{SampleTable(certificate)}}},
              On::kPage);
  section.Add(Items{certificate.left_out}, On::kPage);
  section.Note(
      "Interval arithmetic of 113 bits or more: one and only one pose near the reference's, and "
      "bounds that hold its rates, forces and reactions, for the numbers of the model and of the "
      "commands as they stand in doubles.");
  return section;
}

nlohmann::ordered_json JsonOf(const Certificate& certificate) {
  nlohmann::ordered_json json;
  json["sentence"] = certificate.Sentence();
  if (!certificate.why_not.empty()) {
    json["why_not"] = certificate.why_not;
    return json;
  }
  json["proved_samples"] = certificate.proved();
  json["witnesses"] = nlohmann::ordered_json::array();
  for (const WitnessProof& w : certificate.witnesses) {
    json["witnesses"].push_back({{"witness", w.witness},
                                 {"force_error", Number(w.force_error)},
                                 {"force_error_at_least", Number(w.force_error_at_least)},
                                 {"digits", Number(w.digits())},
                                 {"motion_error", Number(w.motion_error)},
                                 {"reaction_error", Number(w.reaction_error)},
                                 {"limit", Number(w.limit)},
                                 {"wrong", w.wrong},
                                 {"channel", w.channel},
                                 {"time_s", Number(w.time_s)},
                                 {"values", w.values}});
  }
  json["samples"] = nlohmann::ordered_json::array();
  for (const SampleProof& s : certificate.samples) {
    nlohmann::ordered_json sample = {{"time_s", s.time_s}, {"proved", s.proved()}};
    if (!s.proved()) {
      sample["why_not"] = s.why_not;
      json["samples"].push_back(std::move(sample));
      continue;
    }
    sample["bits"] = s.bits;
    sample["unique_within"] = s.unique_within;
    sample["closure_distance"] = {s.closure_distance_low, s.closure_distance_high};
    sample["force_distance"] = {s.force_distance_low, s.force_distance_high};
    sample["left_open"] = s.left_open;
    sample["values"] = nlohmann::ordered_json::array();
    for (const ProvedValue& v : s.values) {
      sample["values"].push_back(
          {{"channel", v.channel}, {"value", v.text}, {"radius", v.radius}, {"unit", v.unit}});
    }
    json["samples"].push_back(std::move(sample));
  }
  json["left_out"] = certificate.left_out;
  return json;
}

}  // namespace

void AddCertificate(const Prepared& prepared, const CertifyOptions& options, Report* report) {
  // A closed form and the reference compute the commanded motion to the last digits; the limit of
  // the scenario counts where it is larger. Whoever else is there has its own limits.
  const auto limit = [&](const std::string& measured, const std::string& truth) {
    for (const CheckResult& check : report->comparison.checks) {
      const bool pair = check.measured == measured && (truth.empty() || check.truth == truth);
      if (pair && check.of_pair() && check.metric == Metric::kForceMax && check.limit) {
        return *check.limit;
      }
    }
    return kNan;
  };
  CertifyOptions with = options;
  if (const double own = limit(role::kReference.name, role::kAnalytic.name); own > with.limit) {
    with.limit = own;
  }
  std::vector<CertifiedTrace> traces;
  for (const WitnessRecord& record : report->witnesses) {
    if (!record.summary.ok() || record.trace.time_s.empty()) continue;
    const Role* role = FindRole(record.name);
    const bool table = record.name == role::kReference && prepared.has_table();
    const bool computed = role != nullptr && !role->is_engine() && !table;
    // Reached and perturbed runs have another motion than the commanded one.
    if (role != nullptr && role->kind == RoleKind::kAfterwards) continue;
    if (role != nullptr && role->is_engine() &&
        !PrescribesMotion(prepared.scenario.simulation.mode)) {
      continue;
    }
    traces.push_back({record.name, &record.trace, !computed,
                      computed ? kNan : limit(record.name, std::string())});
  }
  const Certificate certificate = Certify(prepared.base, prepared.scenario.motion, traces, with);
  Comparison& comparison = report->comparison;
  comparison.reason += "; " + certificate.Sentence();
  if (const WitnessProof* wrong = certificate.FirstWrong(); wrong != nullptr) {
    std::string& text = comparison.attribution.text;
    text = wrong->Sentence() + (text.empty() ? "" : "; " + text);
    comparison.attribution.odd_one_out = wrong->witness;
    if (comparison.verdict == Verdict::kAgree) {
      comparison.verdict = Verdict::kDisagree;
      comparison.reason = wrong->Sentence() + "; " + certificate.Sentence();
    }
  }
  report->parts.push_back({"certificate", SectionOf(certificate), Dump(JsonOf(certificate))});
}

}  // namespace mbv
