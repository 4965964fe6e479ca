// Cost of a study's point: the shipped platform at two samples (`study`: three), by the reference
// alone where nothing else is said. `anew` loads everything at each point, as `mbverify run --set`
// does; `memory` is what a study of other machines does, `study` all of a study of poses.
#include <benchmark/benchmark.h>
#include <fmt/format.h>

#include <string>
#include <vector>

#include "base/demand.h"
#include "features/study/study_bench.h"
#include "model_file/yaml/yaml_reader.h"
#include "tests/support/source_dir.h"
#include "verify/prepare.h"

namespace mbv {
namespace {

void PlatformPoint(benchmark::State& state, bool machine, bool in_memory) {
  const ParsedDocuments documents;
  const std::string file = SourcePath("/scenarios/stabilizing_platform/random.yaml");
  ScenarioMemory memory;
  double share = 0.0;
  for (auto _ : state) {
    share = share > 0.99 ? 0.0 : share + 0.0123456789;
    std::vector<SetValue> set = {{"motion.duration_s", "0.01"}, {"simulation", "off"}};
    const auto vary = [&](const std::string& key, double value) {
      set.emplace_back(key, fmt::format("{:.17g}", value));
    };
    for (const char* command : {"roll", "pitch", "heave"}) {
      vary(fmt::format("motion.commands.{}.sine.phase_deg", command), 360.0 * share);
    }
    if (machine) {
      vary("parameters.m_p", 50000.0 * (1.0 + 0.01 * share));
      vary("parameters.L4_mm", 785.0 + share);
    }
    Diagnostics diagnostics;
    const auto prepared =
        Prepare(LoadScenario(file, {.set = set}, in_memory ? &memory : nullptr), &diagnostics);
    MBV_DEMAND(prepared.has_value(), diagnostics.Text());
    const StudyRun run = RunStudyWitnesses(*prepared, {"reference"});
    if (!run.failure.empty()) state.SkipWithError(run.failure.c_str());
  }
}

// A point of a study that varies the pose alone, by one witness.
void PlatformPose(benchmark::State& state, const std::string& witness) {
  const ParsedDocuments documents;
  Study study;
  study.scenario = SourcePath("/scenarios/stabilizing_platform/random.yaml");
  for (const char* command : {"roll", "pitch", "heave"}) {
    study.factors.push_back({.name = command,
                             .key = fmt::format("motion.commands.{}.sine.phase_deg", command),
                             .axis = {0.0, Uniform{0.0, 360.0}}});
  }
  study.design = {.kind = DesignKind::kSobol, .count = 1 << 16};
  study.witnesses = {witness};
  study.quantities = {{.name = "limb1.drive.force.max", .channel = "limb1.drive.force"}};
  Diagnostics diagnostics;
  int exit_code = 0;
  const auto bench = StudyBench::Make(study, &diagnostics, &exit_code);
  MBV_DEMAND(bench != nullptr && bench->keeps(), diagnostics.Text());
  std::uint64_t number = kBandPoints;
  for (auto _ : state) {
    number = number + 1 < study.design.count ? number + 1 : kBandPoints;
    benchmark::DoNotOptimize(PointLine(bench->Run(number).row, study));
  }
}

BENCHMARK_CAPTURE(PlatformPose, study_analytic, "analytic")->Unit(benchmark::kMicrosecond);
BENCHMARK_CAPTURE(PlatformPose, study_reference, "reference")->Unit(benchmark::kMicrosecond);
BENCHMARK_CAPTURE(PlatformPoint, pose_anew, false, false)->Unit(benchmark::kMicrosecond);
BENCHMARK_CAPTURE(PlatformPoint, pose_memory, false, true)->Unit(benchmark::kMicrosecond);
BENCHMARK_CAPTURE(PlatformPoint, machine_anew, true, false)->Unit(benchmark::kMicrosecond);
BENCHMARK_CAPTURE(PlatformPoint, machine_memory, true, true)->Unit(benchmark::kMicrosecond);

}  // namespace
}  // namespace mbv
