// Findings about a model as a whole, at the places where its parts are described. Internal to the
// model loader.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "core/diagnostics.h"
#include "input/yaml_reader.h"
#include "mechanism/mechanism.h"
#include "mechanism/model_caveat.h"
#include "model_file/model_bodies.h"
#include "model_file/model_signals.h"

namespace mbv::internal {

/// Where the parts of a mechanism are described.
struct ModelPlaces {
  std::vector<BodyPlace> bodies;               ///< per body
  std::vector<Place> joints;                   ///< per joint
  std::vector<Place> beams;                    ///< per beam
  SignalPlaces signals;                        ///< drives, prescribed joints, outputs, couplings
  std::map<std::string, Finding> urdf_joints;  ///< of a URDF file, by name
};

class ModelReport {
 public:
  ModelReport(const ModelPlaces& places, YamlReader* yaml, Diagnostics* others,
              std::vector<ModelCaveat>* caveats)
      : places_(places), yaml_(*yaml), others_(*others), caveats_(*caveats) {}

  /// What the model makes acceptable; the warning that says it, and a caveat of every verdict.
  [[nodiscard]] std::string Allow(const std::string& text) {
    caveats_.push_back({.kind = ModelCaveat::Kind::kAllowed, .text = text});
    return "ALLOWED BY THE MODEL: " + text;
  }

  void At(Place place, Severity severity, const std::string& message, const std::string& hint = "");
  void AtBody(const Mechanism& mechanism, size_t body, Severity severity,
              const std::string& message, const std::string& hint);
  /// At the joint's line in the model file, or at none.
  void AtJoint(size_t joint, Severity severity, const std::string& message,
               const std::string& hint = "");
  /// About the file as a whole.
  void AtFile(Severity severity, const std::string& message, const std::string& hint = "");
  /// The same without a place, for what nobody wrote into the model file.
  void AddOther(Finding finding) { others_.Add(std::move(finding)); }

  /// Where a joint is described that stands in a URDF file; null for those of the model file.
  [[nodiscard]] const Finding* InUrdf(const Mechanism& mechanism, int joint) const;

  [[nodiscard]] const ModelPlaces& places() const { return places_; }
  [[nodiscard]] const std::string& file() const { return yaml_.file(); }
  [[nodiscard]] bool has_errors() const { return yaml_.has_errors() || others_.has_errors(); }
  /// Of these, findings with a place in the model file, or about it.
  [[nodiscard]] bool has_own_errors() const { return yaml_.has_errors(); }

 private:
  const ModelPlaces& places_;
  YamlReader& yaml_;
  Diagnostics& others_;
  std::vector<ModelCaveat>& caveats_;
};

}  // namespace mbv::internal
