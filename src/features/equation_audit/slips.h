// The usual slips of printed equations, searched where one is wrong.
//
// Two kinds: what turns the numbers that an equation gives into the right ones (a sign, a factor,
// exchanged or transposed elements, a missing term that is a known one), and what turns its text
// into a right one (a sign, sine for cosine, exchanged indices, a factor, a square, a transposed
// matrix, degrees, a term too much). A text is edited at one place, evaluated anew at all states,
// and named only where it is right at all of them.
#pragma once

#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

namespace mbv {

/// What an equation gave and should have given at many states, a row each.
using AuditValues = std::vector<std::vector<double>>;

/// A term that may be missing: of the same shape as what the equation gives.
struct KnownTerm {
  std::string name;  ///< "the weight of platform"
  AuditValues values;
};

struct SlipSearch {
  AuditValues printed, truth;
  double limit = 0.0;  ///< largest |difference| of a right one
  int columns = 0;     ///< of a matrix; 0: numbers or a vector
  std::vector<KnownTerm> terms = {};

  std::string text = {};      ///< the whole file
  int line = 0, end = 0;      ///< of the equation in it, from 1
  std::string language = {};  ///< its extension: ".py", ".m", ".yaml"
  /// Parameters with their units: those of one unit may be exchanged.
  std::map<std::string, std::string> parameters = {};
  std::vector<std::string> arguments = {};  ///< that are known of the state
  /// What an edited file gives; at a few states first (`few`), else at all. Empty where it fails.
  std::function<std::optional<AuditValues>(const std::string& text, bool few)> evaluate = {};
  size_t few = 1;  ///< states of it
};

struct Slip {
  std::string what;    ///< "line 12: '+' where '-' is printed"
  std::string edited;  ///< the line as it is right; "" of numbers
};

/// What makes it right, the simplest first; at most `most`.
[[nodiscard]] std::vector<Slip> FindSlips(const SlipSearch& search, size_t most = 5);

/// An edit of a text that FindSlips() tries.
struct TextEdit {
  enum class Kind { kSign, kName, kFactorSign, kOther };
  Kind kind = Kind::kOther;
  std::string what;
  int line = 0;
  size_t at = 0, size = 0;  ///< what it replaces
  std::string with;

  [[nodiscard]] std::string In(const std::string& text) const {
    return text.substr(0, at) + with + text.substr(at + size);
  }
};
[[nodiscard]] std::vector<TextEdit> EditsOf(const SlipSearch& search);

}  // namespace mbv
