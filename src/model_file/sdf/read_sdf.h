// SDF files (Gazebo's SDFormat) as models.
//
// Two steps: the text with all that it includes is looked through here, element by element against
// a table, and only files of its folder are let in; then libsdformat reads it in mbverify-read-sdf,
// a program of its own, since the library is slow to load and may crash on hostile files.
//
// An SDF file states the poses of all links, so its loops are closed as it stands: joints are taken
// in the order of the file, the loader chooses which of them are cut. Joint coordinates are zero in
// the pose of the file.
#pragma once

#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "base/diagnostics.h"
#include "mechanism/mechanism.h"
#include "model_file/load_model.h"
#include "model_file/write_model.h"

namespace mbv {

/// What becomes of an element or an attribute of SDF.
enum class SdfFate {
  kTaken,    ///< the mechanism has it
  kNoForce,  ///< no force of a mechanism without contacts, driven by given motions, depends on it
  kLeftOut,  ///< forces depend on it, and the mechanism is without it: a caveat of every verdict
  kRefused   ///< without it the robot would be another one: an error
};

struct SdfRow {
  const char* element;  ///< "PARENT/TAG", or "TAG" below any parent
  /// Separated by blanks: attributes; "text": what stands in the element; "": the element itself;
  /// "**": it with all that it holds.
  const char* values;
  SdfFate fate;
  const char* effect = "";   ///< of kLeftOut and kRefused: what it does
  const char* neutral = "";  ///< values that do nothing, separated by |
  bool imported = false;     ///< found in what libsdformat read, not in the text
};

/// All elements of SDF up to 1.9, what later versions add, and Drake's.
[[nodiscard]] std::span<const SdfRow> SdfRows();
/// The row of one value of an element; null if it is not known.
[[nodiscard]] const SdfRow* FindSdfRow(std::string_view element, std::string_view value);
/// Left out by a row: `what` names it.
[[nodiscard]] ModelCaveat LeftOutOfSdf(std::string_view element, std::string_view value,
                                       const std::string& what);

/// An SDF file of which every include is known to lie in its folder. Goes to the reader as bytes.
struct SdfSource {
  struct Place {
    std::string name;  ///< "joint MODEL::NAME", "link MODEL::NAME"
    std::string file;
    int line = 0;
  };
  struct Include {
    std::string uri, file;  ///< as written; absolute
    std::string text;       ///< as SdfSource::text
  };
  std::string text;  ///< without what is of no use, such as sensors, which libsdformat may refuse
  std::string file;
  std::string folder;  ///< of the file, absolute
  FloatingBase base;   ///< by option
  std::vector<Include> includes;
  std::vector<std::string> packages;  ///< name, folder, …: where meshes may be
  std::vector<std::string> motors;    ///< joints that plugins control
  std::vector<Place> places;
  std::vector<ModelCaveat> left_out;
};
template <typename Visit>
void VisitMembers(Visit& visit, typename Visit::template Of<SdfSource::Place>& place) {
  visit(place.name), visit(place.file), visit(place.line);
}
template <typename Visit>
void VisitMembers(Visit& visit, typename Visit::template Of<SdfSource::Include>& include) {
  visit(include.uri), visit(include.file), visit(include.text);
}
template <typename Visit>
void VisitMembers(Visit& visit, typename Visit::template Of<SdfSource>& source) {
  visit(source.text), visit(source.file), visit(source.folder);
  visit(source.base.held), visit(source.base.free);
  visit(source.includes), visit(source.packages), visit(source.motors), visit(source.places);
  visit(source.left_out);
}

/// Empty after errors, which are findings; so are warnings of what is left out. Included files are
/// reported to NoteInput().
[[nodiscard]] std::optional<SdfSource> InspectSdf(const std::string& text, const std::string& file,
                                                  Diagnostics* diagnostics);

/// The model that an SDF file stands for.
[[nodiscard]] ForeignModel ReadSdf(const std::string& text, const std::string& file,
                                   const FloatingBase& base);

}  // namespace mbv
