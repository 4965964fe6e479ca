// A change of a model's text and what must be said about it.
#pragma once

#include <ostream>

namespace mbv {

struct Slip {
  const char* name;
  const char* from;
  const char* to;
  const char* said;
};
inline std::ostream& operator<<(std::ostream& out, const Slip& slip) { return out << slip.name; }

}  // namespace mbv
