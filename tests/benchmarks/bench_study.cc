// Cost of a study's point: the shipped platform at two samples, by the reference alone. `anew`
// loads everything at each point, as `mbverify run --set` does; `memory` is what a study does.
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

BENCHMARK_CAPTURE(PlatformPoint, pose_anew, false, false)->Unit(benchmark::kMicrosecond);
BENCHMARK_CAPTURE(PlatformPoint, pose_memory, false, true)->Unit(benchmark::kMicrosecond);
BENCHMARK_CAPTURE(PlatformPoint, machine_anew, true, false)->Unit(benchmark::kMicrosecond);
BENCHMARK_CAPTURE(PlatformPoint, machine_memory, true, true)->Unit(benchmark::kMicrosecond);

}  // namespace
}  // namespace mbv
