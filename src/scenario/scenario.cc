#include "scenario/scenario.h"

namespace mbv {

Overrides Merge(const Overrides& base, const Overrides& over) {
  Overrides merged = over;
  merged.insert(base.begin(), base.end());
  return merged;
}

}  // namespace mbv
