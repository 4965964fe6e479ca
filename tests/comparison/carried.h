// A drive that carries little on something heavy that others carry.
#pragma once

#include "tests/comparison/synthetic.h"

namespace mbv::synthetic {

/// The two sliders as a vehicle of 1e7 kg and a cart of 2 kg on it, both along z against gravity.
/// The vehicle is prescribed and at rest, or driven by d1; the cart's force is 19.62 N, all
/// witnesses agree.
struct OnVehicle : Case {
  explicit OnVehicle(bool prescribed) {
    mechanism.bodies[1].mass = 1e7;
    mechanism.bodies[2].mass = 2.0;
    motion.commands[0].profile = Constant(0.0);
    if (prescribed) {
      mechanism.drives.erase(mechanism.drives.begin());
      mechanism.prescribed = {{"vehicle", 0}};
      motion.commands[0].terms[0].coordinate.kind = Coordinate::Kind::kPrescribed;
      motion.commands[1].terms[0].coordinate.index = 0;
    }
    for (Trace* trace : {&analytic, &reference, &simulated}) {
      for (const char* signal : {"d1.position", "d1.velocity", "d1.acceleration"}) {
        Stretch(trace, signal, 0.0);
      }
      trace->values.col(trace->Find("d1.force")).setConstant(1e7 * 9.81);
      trace->values.col(trace->Find("d2.force")).setConstant(2.0 * 9.81);
    }
  }
};

/// A further channel with one value in all three traces.
inline void AddChannel(Case* c, const Channel& channel, double value) {
  for (Trace* trace : {&c->analytic, &c->reference, &c->simulated}) {
    trace->channels.push_back(channel);
    trace->values.conservativeResize(Eigen::NoChange, trace->values.cols() + 1);
    trace->values.rightCols(1).setConstant(value);
  }
}

}  // namespace mbv::synthetic
