// Events of a motion by forces: when force elements stick, slide, meet an end or are switched.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "math/trace.h"
#include "mechanism/mechanism.h"

namespace mbv {

/// What a law with corners does on this piece (PieceOf()).
[[nodiscard]] inline Happening HappeningOn(const ForceElement& element, int piece) {
  if (std::holds_alternative<ExpressionLaw>(element.law)) return Happening::kBranch;
  if (!std::holds_alternative<StopLaw>(element.law)) return Happening::kKnot;
  return piece == 0 ? Happening::kFree : piece <= 3 ? Happening::kUpperEnd : Happening::kLowerEnd;
}
/// What dry friction does that slides with this sign of its rate, 0: not at all.
[[nodiscard]] constexpr Happening HappeningAt(int sliding) {
  return sliding == 0  ? Happening::kRests
         : sliding > 0 ? Happening::kSlidesUp
                       : Happening::kSlidesDown;
}

/// Makes events of what elements do from node to node. No force follows from it.
class EventLog {
 public:
  /// `piece` distinguishes what a curve does on both sides of a knot, and an expression's branches.
  void Note(const ForceElement& element, double time_s, Happening now, int piece = 0) {
    Note(element.name, time_s, now, piece);
  }
  void Note(const std::string& name, double time_s, Happening now, int piece) {
    const auto [known, is_new] = last_.try_emplace(name, State{now, piece});
    State& last = known->second;
    const bool has_pieces = now == Happening::kKnot || now == Happening::kBranch;
    const bool same = last.what == now && (!has_pieces || last.piece == piece);
    last = {now, piece};
    if (!is_new && !same) events_.push_back({.time_s = time_s, .element = name, .what = now});
  }
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
  std::map<std::string, State> last_;
  std::vector<MotionEvent> events_;
};

}  // namespace mbv
