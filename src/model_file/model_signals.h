// The names by which scenarios command and watch a model: of drives, prescribed joints, outputs and
// couplings.
// Internal to the model loader.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "mechanism/mechanism.h"
#include "model_file/model_values.h"
#include "model_file/yaml/yaml_reader.h"

namespace mbv::internal {

/// Where each name is given. One name is one thing to command.
class SignalPlaces {
 public:
  /// `what`: "drive", …
  void Add(const std::string& name, const char* what, Place place) {
    places_[name].push_back({what, place});
  }
  /// Of the first one of this name, which exists.
  [[nodiscard]] Place Of(const std::string& name) const { return places_.at(name).front().place; }
  /// Findings about names that are given twice.
  void Check(YamlReader* yaml) const;

 private:
  struct Use {
    const char* what;
    Place place;
  };
  std::map<std::string, std::vector<Use>> places_;
};

/// Findings about coordinates of joints that two drives or prescribed joints move.
void CheckDrivenOnce(const std::vector<Drive>& drives, const std::vector<Prescribed>& prescribed,
                     const std::vector<Joint>& joints, const SignalPlaces& places,
                     YamlReader* yaml);

}  // namespace mbv::internal
