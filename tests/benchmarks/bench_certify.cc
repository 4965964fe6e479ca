// Cost of a certified sample beside one of the reference: whole motions of both, per sample.
#include <benchmark/benchmark.h>
#include <fmt/format.h>

#include <optional>
#include <string>

#include "base/demand.h"
#include "features/certify/certify.h"
#include "reference/reference.h"
#include "tests/support/source_dir.h"
#include "verify/prepare.h"

namespace mbv {
namespace {

Prepared Loaded(const std::string& scenario) {
  Diagnostics found;
  std::optional<Prepared> prepared =
      Prepare(SourcePath(fmt::format("/scenarios/{}.yaml", scenario)), {}, &found);
  MBV_DEMAND(prepared.has_value(), found.Text());
  return *std::move(prepared);
}

void Reference(benchmark::State& state, const std::string& scenario) {
  const Prepared prepared = Loaded(scenario);
  size_t samples = 0;
  for (auto _ : state) {
    samples +=
        RunReference(prepared.mechanisms.reference, prepared.scenario.motion).trace.time_s.size();
  }
  state.counters["per_sample"] = benchmark::Counter(
      static_cast<double>(samples), benchmark::Counter::kIsRate | benchmark::Counter::kInvert);
}

void Certified(benchmark::State& state, const std::string& scenario) {
  const Prepared prepared = Loaded(scenario);
  size_t samples = 0;
  for (auto _ : state) {
    const Certificate certificate =
        Certify(prepared.mechanisms.reference, prepared.scenario.motion, {}, {.samples = 100});
    samples += certificate.proved();
  }
  state.counters["per_sample"] = benchmark::Counter(
      static_cast<double>(samples), benchmark::Counter::kIsRate | benchmark::Counter::kInvert);
}

#define MBV_BOTH(name, scenario)                                               \
  BENCHMARK_CAPTURE(Reference, name, scenario)->Unit(benchmark::kMillisecond); \
  BENCHMARK_CAPTURE(Certified, name, scenario)->Unit(benchmark::kMillisecond)
MBV_BOTH(platform, "stabilizing_platform/sea_state");
MBV_BOTH(tripod, "spr_tripod/default");
MBV_BOTH(cabin, "cabin_robot/default");
MBV_BOTH(scara, "scara_robot/default");

}  // namespace
}  // namespace mbv
