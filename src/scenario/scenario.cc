#include "scenario/scenario.h"

namespace mbv {

Scenario::Scenario() = default;
Scenario::~Scenario() = default;
Scenario::Scenario(const Scenario&) = default;
Scenario& Scenario::operator=(const Scenario&) = default;
Scenario::Scenario(Scenario&&) noexcept = default;
Scenario& Scenario::operator=(Scenario&&) noexcept = default;

Overrides Merge(const Overrides& base, const Overrides& over) {
  Overrides merged = over;
  merged.insert(base.begin(), base.end());
  return merged;
}

}  // namespace mbv
