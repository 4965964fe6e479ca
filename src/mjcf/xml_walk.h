// Walks through XML. Internal to mjcf/.
#pragma once

#include <tinyxml2.h>

#include <string_view>

namespace mbv::mjcf {

// Calls visit(element) on all elements below, deepest last.
template <typename Visit>
void ForEach(tinyxml2::XMLElement* element, const Visit& visit) {
  for (tinyxml2::XMLElement* e = element->FirstChildElement(); e != nullptr;
       e = e->NextSiblingElement()) {
    visit(e);
    ForEach(e, visit);
  }
}

inline bool IsTag(const tinyxml2::XMLElement* element, const char* tag) {
  return std::string_view(element->Name()) == tag;
}

}  // namespace mbv::mjcf
