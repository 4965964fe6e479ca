// Events of a motion by forces: when force elements stick, slide, meet an end or are switched.
#pragma once

#include <map>
#include <vector>

#include "math/trace.h"
#include "mechanism/mechanism.h"

namespace mbv {

/// What a law with corners does on this piece (PieceOf()).
[[nodiscard]] Happening HappeningOn(const ForceElement& element, int piece);
/// What dry friction does that slides with this sign of its rate, 0: not at all.
[[nodiscard]] Happening HappeningAt(int sliding);

/// Makes events of what elements do from node to node. No force follows from it.
class EventLog {
 public:
  /// `piece` distinguishes what a curve does on both sides of a knot.
  void Note(const ForceElement& element, double time_s, Happening now, int piece = 0);
  /// What happens at one instant only.
  void Add(const ForceElement& element, double time_s, Happening what) {
    events_.push_back({.time_s = time_s, .element = element.name, .what = what});
  }
  /// In the order of their times.
  [[nodiscard]] const std::vector<MotionEvent>& events() const { return events_; }

 private:
  struct State {
    Happening what = Happening::kRests;
    int piece = 0;
  };
  std::map<const ForceElement*, State> last_;
  std::vector<MotionEvent> events_;
};

}  // namespace mbv
