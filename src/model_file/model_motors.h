// `motors` of a model file. Internal to the model loader.
#pragma once

#include <string>
#include <vector>

#include "mechanism/mechanism.h"
#include "model_file/model_joints.h"
#include "model_file/model_values.h"

namespace mbv::internal {

/// Reads the motors of known drives (mechanism/motor.h). Only a model has them, parts do not: they
/// are named as the drives of the whole model.
void ReadMotors(const Block& model, const std::vector<Drive>& drives,
                const std::vector<Joint>& joints, ModelValues* values, std::vector<Motor>* motors);

/// A motor as a model file's map, without braces; reads back to the same numbers.
[[nodiscard]] std::string MotorText(const Motor& motor);

}  // namespace mbv::internal
