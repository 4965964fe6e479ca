// `outputs` and `springs` of a model file. Internal to the model loader.
#pragma once

#include <vector>

#include "mechanism/mechanism.h"
#include "model_file/model_names.h"
#include "model_file/model_signals.h"
#include "model_file/model_values.h"

namespace mbv::internal {

/// Reads frames of known bodies that are commanded or watched.
void ReadOutputs(const Block& block, const BodyNames& names, YamlReader* yaml, SignalPlaces* places,
                 std::vector<Output>* outputs);

/// Reads springs between frames of known bodies.
void ReadSprings(const Block& block, const BodyNames& names, ModelValues* values,
                 std::vector<SpringDamper>* springs);

}  // namespace mbv::internal
