#include "mechanism/body_states.h"

namespace mbv {

void BodyStates::Resize(size_t bodies) {
  X_WB.assign(bodies, Pose::Identity());
  V_WB.assign(bodies, Vec6::Zero());
  A_WB.assign(bodies, Vec6::Zero());
}

}  // namespace mbv
