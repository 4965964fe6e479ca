// Tables of a stiffness run as CSV.
#include "report/stiffness_report.h"

#include <fmt/format.h>

#include <iterator>

namespace mbv {
namespace {

std::vector<const StiffnessWitness*> AllOf(const StiffnessReport& report) {
  std::vector<const StiffnessWitness*> all;
  for (const StiffnessWitness& witness : report.witnesses) all.push_back(&witness);
  for (const StiffnessWitness& witness : report.printed) all.push_back(&witness);
  return all;
}

}  // namespace

const StiffnessWitness* StiffnessReport::Shown() const {
  for (const StiffnessWitness& witness : witnesses) {
    if (witness.ran()) return &witness;
  }
  return nullptr;
}

const StiffnessWitness* StiffnessReport::WithShares() const {
  for (const StiffnessWitness& witness : witnesses) {
    if (!witness.result.shares.empty() && witness.result.C.allFinite()) return &witness;
  }
  return nullptr;
}

ResultView ViewOf(const StiffnessReport& report) {
  const StiffnessComparison& comparison = report.comparison;
  ResultView view = ViewOfComparison(report, comparison);
  view.kind = "stiffness";
  view.look = {
      .signs = false, .capitals = false, .margins = false, .steps = false, .title_width = 32};
  for (const StiffnessCheck& check : comparison.checks) {
    view.checks.push_back({.name = check.name,
                           .subject = check.subject,
                           .title = RowOf(check.metric).title,
                           .value = check.value,
                           .limit = check.limit,
                           .pass = check.pass,
                           .where = check.where});
  }
  for (const StiffnessWitness& witness : report.witnesses) {
    view.witnesses.emplace_back(witness.name, witness.result.summary);
  }
  if (const StiffnessPair* pair = comparison.MainPair()) {
    view.main_pair = fmt::format("K {} vs {}", pair->measured, pair->truth);
    view.main_check = pair->name() + ".stiffness_entry";
  }
  return view;
}

std::string StiffnessCsv(const StiffnessReport& report) {
  std::string text = "witness,matrix,row,column,unit,value\n";
  auto out = std::back_inserter(text);
  for (const StiffnessWitness* witness : AllOf(report)) {
    if (!witness->ran()) continue;
    for (const bool K : {true, false}) {
      const Mat6& M = K ? witness->result.K : witness->result.C;
      for (int i = 0; i < 6; ++i) {
        for (int j = 0; j < 6; ++j) {
          fmt::format_to(out, "{},{},{},{},{},{:.17g}\n", witness->name, K ? "K" : "C", AxisName(i),
                         AxisName(j), K ? StiffnessUnit(i, j) : ComplianceUnit(i, j), M(i, j));
        }
      }
    }
  }
  return text;
}

std::string LoadsCsv(const StiffnessReport& report) {
  std::string text = "load,mx_Nm,my_Nm,mz_Nm,fx_N,fy_N,fz_N";
  auto out = std::back_inserter(text);
  std::vector<const StiffnessWitness*> witnesses;
  for (const StiffnessWitness* witness : AllOf(report)) {
    if (witness->displacements.size() != report.loads.size() || report.loads.empty()) continue;
    witnesses.push_back(witness);
    for (int i = 0; i < 6; ++i) {
      fmt::format_to(out, ",{}_{}.{}", AxisName(i), i < 3 ? "rad" : "m", witness->name);
    }
  }
  text += "\n";
  for (size_t k = 0; k < report.loads.size(); ++k) {
    fmt::format_to(out, "{}", k + 1);
    for (int i = 0; i < 6; ++i) fmt::format_to(out, ",{:.17g}", report.loads[k][i]);
    for (const StiffnessWitness* witness : witnesses) {
      for (int i = 0; i < 6; ++i) fmt::format_to(out, ",{:.17g}", witness->displacements[k][i]);
    }
    text += "\n";
  }
  return text;
}

std::string ContributionsCsv(const StiffnessReport& report) {
  std::string text = "witness,element,weakest_translation,weakest_rotation,rx,ry,rz,x,y,z\n";
  auto out = std::back_inserter(text);
  for (const StiffnessWitness* witness : AllOf(report)) {
    for (const Contribution& row : Contributions(witness->result)) {
      fmt::format_to(out, "{},{},{:.17g},{:.17g}", witness->name, row.element, row.translation,
                     row.rotation);
      for (int i = 0; i < 6; ++i) fmt::format_to(out, ",{:.17g}", row.axis[i]);
      text += "\n";
    }
  }
  return text;
}

}  // namespace mbv
