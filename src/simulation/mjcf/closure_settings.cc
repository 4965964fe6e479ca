#include "simulation/mjcf/closure_settings.h"

#include <tinyxml2.h>

#include <algorithm>
#include <string_view>

namespace mbv::mjcf {

std::string WithLines(const std::string& text, const std::string& lines) {
  std::string with = text;
  return with.insert(std::min(with.rfind("</mujoco"), with.size()), lines);
}

std::string WithClosureSettings(const std::string& text, const std::string& solref,
                                const std::string& solimp) {
  tinyxml2::XMLDocument document;
  if (document.Parse(text.c_str(), text.size()) != tinyxml2::XML_SUCCESS ||
      document.RootElement() == nullptr) {
    return text;
  }
  for (auto* section = document.RootElement()->FirstChildElement("equality"); section != nullptr;
       section = section->NextSiblingElement("equality")) {
    for (auto* e = section->FirstChildElement(); e != nullptr; e = e->NextSiblingElement()) {
      const std::string_view tag = e->Name();
      if (tag != "connect" && tag != "weld") continue;
      if (!solref.empty()) e->SetAttribute("solref", solref.c_str());
      if (!solimp.empty()) e->SetAttribute("solimp", solimp.c_str());
    }
  }
  tinyxml2::XMLPrinter printer;
  document.Print(&printer);
  return printer.CStr();
}

std::map<std::string, double> ServoDampings(const std::string& text) {
  std::map<std::string, double> dampings;
  tinyxml2::XMLDocument document;
  if (document.Parse(text.c_str(), text.size()) != tinyxml2::XML_SUCCESS ||
      document.RootElement() == nullptr) {
    return dampings;
  }
  for (auto* section = document.RootElement()->FirstChildElement("actuator"); section != nullptr;
       section = section->NextSiblingElement("actuator")) {
    for (auto* e = section->FirstChildElement("position"); e != nullptr;
         e = e->NextSiblingElement("position")) {
      const char* name = e->Attribute("name");
      if (name == nullptr) name = e->Attribute("joint");
      const double kv = e->DoubleAttribute("kv");
      if (name != nullptr && kv > 0.0) dampings[name] = kv;
    }
  }
  return dampings;
}

}  // namespace mbv::mjcf
