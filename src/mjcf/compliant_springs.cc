#include "mjcf/compliant_springs.h"

#include <tinyxml2.h>

#include <map>
#include <string_view>

#include "core/demand.h"
#include "mjcf/mjcf.h"
#include "mjcf/writer.h"

namespace mbv::mjcf {
namespace {

using SpringsByJoint = std::map<std::string, const ElasticSpring*>;

void SetSprings(tinyxml2::XMLElement* element, const SpringsByJoint& on_joint) {
  for (auto* child = element->FirstChildElement(); child != nullptr;
       child = child->NextSiblingElement()) {
    const char* name = child->Attribute("name");
    const bool is_joint = std::string_view(child->Name()) == "joint";
    const auto spring = is_joint && name != nullptr ? on_joint.find(name) : on_joint.end();
    if (spring != on_joint.end() && child->Attribute("type") != nullptr) {
      child->SetAttribute("stiffness", NumberText(spring->second->stiffness).c_str());
      child->SetAttribute("springref", "0");
      for (const char* of_own_zero : {"ref", "range", "limited"}) {
        child->DeleteAttribute(of_own_zero);
      }
    }
    SetSprings(child, on_joint);
  }
}

}  // namespace

std::string TextWithSprings(const CompliantModel& model) {
  SpringsByJoint on_joint;
  for (const ElasticSpring& spring : model.springs) {
    if (!spring.is_tendon) on_joint[spring.object] = &spring;
  }
  tinyxml2::XMLDocument document;
  const std::string text = WriteMjcf(model.mechanism, {.pictures = false, .statics = true});
  MBV_DEMAND(document.Parse(text.c_str(), text.size()) == tinyxml2::XML_SUCCESS, text);
  SetSprings(document.RootElement(), on_joint);
  tinyxml2::XMLPrinter printer;
  document.Print(&printer);
  return printer.CStr();
}

}  // namespace mbv::mjcf
