// Cost of a sample by a user's equations: motion and forces, the call included (real time).
#include <benchmark/benchmark.h>

#include "base/demand.h"
#include "equations/equations.h"
#include "scenario/load_scenario.h"
#include "tests/support/source_dir.h"

namespace mbv {
namespace {

void OwnEquations(benchmark::State& state, const std::string& scenario, const std::string& file) {
  const ScenarioResult loaded =
      LoadScenario(SourcePath("/examples/equations/" + scenario + ".yaml"));
  MBV_DEMAND(loaded.scenario && loaded.mechanism, loaded.diagnostics.Text());
  const Motion& motion = loaded.scenario->motion;
  Diagnostics found;
  const FileForm form =
      MakeFileForm(SourcePath("/examples/equations/" + file), *loaded.mechanism, motion, &found);
  if (form.closed_form == nullptr) return state.SkipWithError(found.Text().c_str());
  CommandSample command;
  ClosedFormSample sample;
  double t = 0.0;
  for (auto _ : state) {
    t += motion.sample_s;
    if (t > motion.duration_s) t = 0.0;
    EvaluateMotion(motion, t, &command);
    const RunSummary summary = form.closed_form->Dynamics(command, &sample);
    MBV_DEMAND(summary.ok(), summary.message);
  }
}
BENCHMARK_CAPTURE(OwnEquations, slider_crank_formulas, std::string("planar_slider_crank"),
                  std::string("planar_slider_crank.formulas.yaml"))
    ->UseRealTime();
BENCHMARK_CAPTURE(OwnEquations, slider_crank_python, std::string("planar_slider_crank"),
                  std::string("planar_slider_crank.py"))
    ->UseRealTime();
BENCHMARK_CAPTURE(OwnEquations, slider_crank_octave, std::string("planar_slider_crank"),
                  std::string("planar_slider_crank.m"))
    ->UseRealTime();
BENCHMARK_CAPTURE(OwnEquations, delta_python, std::string("delta"), std::string("delta.py"))
    ->UseRealTime();
BENCHMARK_CAPTURE(OwnEquations, delta_octave, std::string("delta"), std::string("delta.m"))
    ->UseRealTime();
BENCHMARK_CAPTURE(OwnEquations, rrr_python, std::string("planar_rrr"), std::string("planar_rrr.py"))
    ->UseRealTime();
BENCHMARK_CAPTURE(OwnEquations, tripod_python, std::string("spr_tripod"),
                  std::string("spr_tripod.py"))
    ->UseRealTime();

}  // namespace
}  // namespace mbv
