// <frame> and <replicate> of MuJoCo 3 in foreign MJCF files. Internal to mjcf/.
#pragma once

#include <tinyxml2.h>

#include <string>

namespace mbv::mjcf {

/// What could not be dissolved; empty text: nothing.
struct FrameTrouble {
  int line = 0;
  std::string text, hint = {};
};

/// Writes out what <replicate> repeats, with the elements that refer to it, and moves what stands
/// in a <frame> to the body around it, posed as it was.
[[nodiscard]] FrameTrouble DissolveFrames(tinyxml2::XMLDocument* document);

}  // namespace mbv::mjcf
