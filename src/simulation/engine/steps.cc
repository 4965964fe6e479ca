#include "simulation/engine/steps.h"

#include <algorithm>
#include <cmath>

#include "mechanism/motion.h"

namespace mbv::simulation {
namespace {

// Breaks closer than this fraction of a step to a node are taken to lie on it.
constexpr double kSnap = 1e-6;

long StepsPerSample(const Motion& motion, double step_s) {
  return std::max(1L, std::lround(std::ceil(motion.sample_s / step_s - 1e-9)));
}

}  // namespace

double AdjustedStep(const Motion& motion, double step_s) {
  return motion.sample_s / static_cast<double>(StepsPerSample(motion, step_s));
}

std::vector<Step> MakeSteps(const Motion& motion, double step_s) {
  const long per_sample = StepsPerSample(motion, step_s);
  const double h = AdjustedStep(motion, step_s);
  const long samples = static_cast<long>(SampleTimes(motion.duration_s, motion.sample_s).size());
  const std::vector<double> breaks = BreakTimes(motion);
  auto next_break = breaks.begin();
  std::vector<Step> steps;
  int uniform = 1;
  for (long n = 0; n < (samples - 1) * per_sample; ++n) {
    const double from = static_cast<double>(n) * h, to = static_cast<double>(n + 1) * h;
    double at = from;
    // A break on the node before restarts the multistep history there.
    for (; next_break != breaks.end() && *next_break < to - kSnap * h; ++next_break) {
      if (*next_break < from - kSnap * h) continue;
      if (*next_break < at + kSnap * h) {
        if (at == from) uniform = 1;
        continue;
      }
      steps.push_back({.from_s = at, .to_s = *next_break});
      at = *next_break;
      uniform = 0;
    }
    const bool whole = at == from;
    steps.push_back({.from_s = at, .to_s = to, .uniform = whole ? uniform : 0});
    if ((n + 1) % per_sample == 0) steps.back().sample = (n + 1) / per_sample;
    uniform = whole ? std::min(uniform + 1, 4) : 1;
  }
  return steps;
}

}  // namespace mbv::simulation
