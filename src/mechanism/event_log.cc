#include "mechanism/event_log.h"

namespace mbv {

Happening HappeningOn(const ForceElement& element, int piece) {
  if (!std::holds_alternative<StopLaw>(element.law)) return Happening::kKnot;
  return piece == 0 ? Happening::kFree : piece <= 3 ? Happening::kUpperEnd : Happening::kLowerEnd;
}

Happening HappeningAt(int sliding) {
  return sliding == 0  ? Happening::kRests
         : sliding > 0 ? Happening::kSlidesUp
                       : Happening::kSlidesDown;
}

void EventLog::Note(const ForceElement& element, double time_s, Happening now, int piece) {
  const auto [known, is_new] = last_.try_emplace(&element, State{now, piece});
  State& last = known->second;
  const bool same = last.what == now && (now != Happening::kKnot || last.piece == piece);
  last = {now, piece};
  if (!is_new && !same) events_.push_back({.time_s = time_s, .element = element.name, .what = now});
}

}  // namespace mbv
