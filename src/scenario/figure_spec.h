// `figures:` of a scenario: figures that its author composes, as data.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "core/types.h"

namespace mbv {

/// A word of a file, with its place and the key that it stands under, for findings.
struct PlacedText {
  std::string text = {};
  std::string path = {};  ///< "figures[0].panels[1].unit"
  int line = 0, column = 0;

  [[nodiscard]] bool given() const { return !text.empty(); }
};

/// Signals over time, or over another signal.
struct PanelSpec {
  std::vector<PlacedText> signals = {};    ///< channels; '*' stands for any characters
  std::vector<PlacedText> witnesses = {};  ///< roles' names; empty: all that ran
  std::vector<PlacedText> marks = {};      ///< of the witnesses: those without lines
  PlacedText against = {};  ///< |signal − the same of this witness|; not given: the signal itself
  PlacedText x = {};        ///< a channel; not given: time
  PlacedText unit = {}, x_unit = {};              ///< not given: the usual one
  std::string label = {}, x_label = {};           ///< markup of figures; "": the names
  std::map<std::string, std::string> names = {};  ///< legend (markup), by channel
  bool log = false, legend = true;
  bool from_start = false;   ///< changes since the first sample
  bool equal_scale = false;  ///< one unit is as long on x as on y
  double share = 1.0;        ///< of the height, against the other panels
};

struct FigureSpec {
  PlacedText name;
  std::string caption = {};
  double width_mm = kNan, height_mm = kNan;  ///< NaN: the style's
  std::vector<PanelSpec> panels = {};
};

}  // namespace mbv
