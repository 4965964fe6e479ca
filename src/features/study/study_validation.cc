#include "features/study/study_validation.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "features/convergence/converge.h"
#include "features/study/study.h"

namespace mbv {
namespace {

// A witness' force of a drive at the study's times; empty where it records none.
std::vector<double> ForceAtTimes(const Trace& trace, const std::string& drive,
                                 const StudyForces& forces) {
  std::vector<double> values;
  const int column = trace.Find(Quantity::kForce, drive);
  for (size_t k = 0; k < forces.time_s.size() && column >= 0; ++k) {
    values.push_back(trace.values(forces.samples[k], column));
  }
  return values;
}

// The second witness that computes anything; the table does not.
const WitnessRecord* SecondWitness(const StudyRun& run) {
  for (size_t k = 1; k < run.witnesses.size(); ++k) {
    if (!(run.witnesses[k]->name == role::kReference)) return run.witnesses[k];
  }
  return nullptr;
}

double RmsDifference(const std::vector<double>& a, const std::vector<double>& b) {
  if (a.empty() || a.size() != b.size()) return 0.0;
  double sum = 0.0;
  for (size_t k = 0; k < a.size(); ++k) sum += (a[k] - b[k]) * (a[k] - b[k]);
  return std::sqrt(sum / static_cast<double>(a.size()));
}

// Rows of the table at the study's times.
std::vector<Eigen::Index> RowsOf(const Trace& table, const StudyForces& forces) {
  std::vector<Eigen::Index> rows;
  for (const double time : forces.time_s) {
    const auto found = std::lower_bound(table.time_s.begin(), table.time_s.end(), time);
    rows.push_back(found - table.time_s.begin());
  }
  return rows;
}

// Half the grid convergence index, which covers some 95 %, of the scenario's steps.
std::string FillFromSteps(const StudyBench& bench, std::vector<ForceComparison>* drives) {
  const ConvergeOutcome outcome = Converge(bench.study().scenario, {});
  if (outcome.exit_code > 1) {
    return "u_num: mbverify converge finds none" +
           (outcome.failure.empty() ? "" : ": " + outcome.failure) + "; state validation.u_num";
  }
  for (ForceComparison& forces : *drives) {
    const auto& found = outcome.report.extrapolation.drives;
    const auto drive = std::find_if(found.begin(), found.end(), [&](const ExtrapolatedDrive& d) {
      return d.drive == forces.drive;
    });
    if (drive == found.end() || !std::isfinite(drive->uncertainty)) {
      return fmt::format("u_num: mbverify converge finds none of {}; state validation.u_num",
                         forces.drive);
    }
    forces.u_num = drive->uncertainty / 2.0;
  }
  return "";
}

}  // namespace

AlignedTable TableOf(const Prepared& prepared) {
  return AlignTable(*prepared.scenario.reference.table, prepared.scenario.motion);
}

MeasuredForces MeasureForces(const AlignedTable& table, const StudyRun& run,
                             const StudyForces& forces, const StudyValidation& settings) {
  MeasuredForces measured{.table = table.name, .numerical = {}, .drives = {}, .places = {}};
  const WitnessRecord& first = *run.witnesses.front();
  const WitnessRecord* second = SecondWitness(run);
  measured.numerical = settings.u_num      ? "as stated"
                       : second == nullptr ? "0: no step, and no second witness"
                                           : "RMS difference of the first two witnesses";
  const std::vector<Eigen::Index> rows = RowsOf(table.trace, forces);
  for (size_t d = 0; d < forces.drives.size() && !rows.empty(); ++d) {
    const int column = table.trace.Find(Quantity::kForce, forces.drives[d]);
    if (column < 0) continue;
    ForceComparison drive;
    drive.drive = forces.drives[d];
    drive.unit = forces.units[d];
    drive.time_s = forces.time_s;
    drive.computed = ForceAtTimes(first.trace, drive.drive, forces);
    for (const Eigen::Index row : rows) {
      drive.measured.push_back(table.trace.values(row, column));
      drive.u_data.push_back(table.standard(row, column));
    }
    if (settings.u_num) {
      drive.u_num = *settings.u_num;
    } else if (second != nullptr) {
      drive.u_num = RmsDifference(drive.computed, ForceAtTimes(second->trace, drive.drive, forces));
    }
    measured.drives.push_back(std::move(drive));
    measured.places.push_back(d);
  }
  return measured;
}

StudyValidationResult ValidateStudy(const StudyBench& bench, const std::filesystem::path& file) {
  const MeasuredForces& measured = bench.measured();
  StudyValidationResult result{
      .drives = {}, .table = measured.table, .numerical = measured.numerical, .trouble = {}};
  std::vector<ForceComparison> drives = measured.drives;
  if (bench.steps() && !bench.study().validation->u_num) {
    result.numerical = "half the grid convergence index of mbverify converge";
    result.trouble = FillFromSteps(bench, &drives);
    if (!result.trouble.empty()) return result;
  }
  for (size_t k = 0; k < drives.size(); ++k) {
    const std::vector<std::vector<float>> records =
        DriveRecords(bench.forces(), measured.places[k], file);
    drives[k].u_input = DeviationsOverPoints(records, drives[k].time_s.size());
    result.drives.push_back(Validate(std::move(drives[k]), *bench.study().validation));
  }
  return result;
}

}  // namespace mbv
