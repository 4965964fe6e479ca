// What a model file says of the whole: name, gravity, up, what it allows. Internal to the model
// loader.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "mechanism/model_caveat.h"
#include "model_file/model_block.h"
#include "model_file/model_values.h"

namespace mbv::internal {

struct ModelHead {
  std::string name, description;
  Vec3 gravity_W = Mechanism().gravity_W;  ///< [m/s²]
  Vec3 up_W = Mechanism().up_W;
  bool impossible_inertia_allowed = false;
  double closure_tolerance_m = 0.0;  ///< up to which rounded data are projected
  std::vector<ModelCaveat> left_out;
};

/// The keys of a model file.
extern const std::vector<std::string> kModelKeys;

/// Reads what needs no parameter.
[[nodiscard]] ModelHead ReadTitle(const YamlMap& file, YamlReader* yaml);
/// Reads the rest, which may use the model's parameters; `gravity_W` replaces what the file says.
void ReadSurroundings(const Block& model, const YamlMap& file, const std::optional<Vec3>& gravity_W,
                      ModelValues* values, ModelHead* head);

}  // namespace mbv::internal
