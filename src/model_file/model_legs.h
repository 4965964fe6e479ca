// `legs` of a model file: telescopic legs with two heavy halves, written in one line. Internal to
// the model loader.
//
//   legs: {leg1: {from: world.B1, to: platform.A1, length: 0.5, lower: {…}, upper: {…}}}
// stands for an instance of this part, with the z axis along the leg:
//   bodies: {lower: {mass, com: [0, 0, com], inertia: [across, across, along]}, upper: {…, −com}}
//   joints:
//     from:  {kind: universal, parent: FROM, child: lower, axis: y, axis2: x}
//     slide: {kind: prismatic, parent: lower, child: upper, axis: z, guess: LENGTH}
//     to:    {kind: spherical, parent: upper, child: TO}
//   (`ends` says which end is universal; both may be spherical)
//   drives: {length: {kind: joint, joint: slide}}
#pragma once

#include "model_file/model_block.h"
#include "model_file/model_values.h"

namespace mbv::internal {

/// Adds a block for each leg of the blocks that there are; findings go to the reader.
void ExpandLegs(ModelValues* values, ModelBlocks* blocks);

}  // namespace mbv::internal
