// All elements and attributes of MJCF, of MuJoCo 2.2 and 3, and what becomes of each at import.
#pragma once

#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace mbv::mjcf {

enum class Fate {
  kTaken,    ///< the mechanism has it
  kNoForce,  ///< no force of a mechanism without contacts, driven by given motions, depends on it
  kLeftOut,  ///< forces depend on it, and the mechanism is without it: a caveat of every verdict
  kRefused   ///< without it the robot would be another one: an error
};

struct ForeignRow {
  /// "PARENT/TAG", or "TAG" of sections, bodies, frames and replicates; what stands in <frame> or
  /// <worldbody> stands in a body. "PARENT/*": every element below.
  const char* element;
  const char* attributes;  ///< separated by spaces; "*": all; "": the element itself. "2nd": a
                           ///< number beyond the first, of the attribute that stands as element
  Fate fate;
  const char* effect = "";   ///< of kLeftOut and kRefused: what it does
  const char* neutral = "";  ///< value without effect; numbers are compared as such
  /// Forces may need more than the attribute: found in the compiled model, not in the text.
  bool compiled = false;
};

[[nodiscard]] std::span<const ForeignRow> ForeignRows();

/// The row of an element's attribute ("": of the element itself); null if it is not known.
[[nodiscard]] const ForeignRow* FindForeignRow(std::string_view element,
                                               std::string_view attribute);

/// Whether there is a row of an element, whatever it is about.
[[nodiscard]] bool IsForeignElement(std::string_view element);

/// The element's name in the rows.
[[nodiscard]] std::string ForeignElement(std::string_view parent, std::string_view tag);

/// True for a value that does nothing.
[[nodiscard]] bool IsNeutral(const ForeignRow& row, const std::string& value);

}  // namespace mbv::mjcf
