#include "pipeline/free_motion_text.h"

#include <fmt/format.h>

#include <cmath>

namespace mbv {

std::string FreeMotionText(const Mechanism& mechanism, const Motion& motion) {
  constexpr size_t kMost = 4;
  std::string start;
  for (size_t i = 0; i < motion.initial.size() && i < kMost; ++i) {
    const InitialValue& value = motion.initial[i];
    start += fmt::format("{}{} = {:.6g}", i == 0 ? "" : ", ", value.name, value.position);
    if (value.rate != 0.0) start += fmt::format(" (rate {:.6g})", value.rate);
  }
  if (motion.initial.size() > kMost) start += ", …";
  std::string text = fmt::format("free motion of {} {} from {}", motion.initial.size(),
                                 motion.initial.size() == 1 ? "freedom" : "freedoms", start);
  for (size_t i = 0; i < motion.forces.size(); ++i) {
    text += (i == 0 ? ", forces given for " : ", ") +
            mechanism.drives[static_cast<size_t>(motion.forces[i].drive)].name;
  }
  return text;
}

std::string TrustLine(const ForwardRun& run) {
  if (std::isnan(run.uncertainty) || std::isnan(run.growth)) {
    return fmt::format("reference integrated in {} steps", run.steps);
  }
  return fmt::format(
      "reference integrated in {} steps to {:.1e} [rad, characteristic lengths]; a difference of "
      "the start grows up to {:.3g} times",
      run.steps, run.uncertainty, run.growth);
}

std::vector<std::string> PassageTexts(const ForwardRun& run, double duration_s) {
  constexpr size_t kMost = 5;
  std::vector<std::string> texts;
  for (const SingularPassage& passage : run.singular) {
    if (texts.size() == kMost) {
      texts.push_back(fmt::format("… and {} more singular poses within {:g} s",
                                  run.singular.size() - kMost, duration_s));
      break;
    }
    texts.push_back(fmt::format(
        "the motion {} a singular pose at t = {:.6g} s: the loops lose a constraint there, {} "
        "could move by itself (weakest constraint {:.1e} of its usual size); the motion is "
        "continued smoothly, reactions near it are large and uncertain",
        passage.passed ? "passes" : "comes close to", passage.time_s, passage.joint,
        passage.pivot));
  }
  return texts;
}

}  // namespace mbv
