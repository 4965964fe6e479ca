#include "kinematics/state_loads.h"

#include "kinematics/constraints.h"

namespace mbv {

LoadSample AtStates(const Mechanism& mechanism, const BodyStates& states,
                    const LoadSample& sample) {
  LoadSample at = sample;
  if (sample.load == nullptr) return at;
  std::vector<double> inputs;
  for (const Load::Following& part : sample.load->following) {
    inputs.clear();
    for (const StateFunction::Input& input : part.function.inputs) {
      const ScalarRow row = CoordinateRow(mechanism, input.coordinate, states, input.near);
      inputs.push_back(input.rate ? RateOf(row, states.V_WB) : row.value);
    }
    Vec3& vector = part.component < 3 ? at.force : at.moment;
    vector[part.component % 3] += part.function.value(sample.time_s, inputs);
  }
  return at;
}

}  // namespace mbv
