// A catalogue of motors and gearboxes (docs/how-to/size_motors.md), from which `mbverify size`
// chooses, and the text of a motor.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "base/diagnostics.h"
#include "mechanism/mechanism.h"

namespace mbv {

struct CatalogueMotor {
  std::string name = {};
  Motor motor = {};                 ///< without drive and gear
  double mass = kNan, cost = kNan;  ///< [kg]; in any unit
  std::vector<int> gearboxes = {};  ///< that fit: indices into Catalogue::gearboxes; -1: none
};
struct CatalogueGearbox {
  std::string name = {};
  double ratio = 1.0, efficiency = 1.0;
  double inertia = 0.0;  ///< at its input [kg m²]
  double mass = kNan, cost = kNan;
  MotorGearbox limits = {};
};
struct Catalogue {
  std::string name;
  std::vector<CatalogueMotor> motors;
  std::vector<CatalogueGearbox> gearboxes;
};

/// Reads one catalogue file. Empty after findings.
[[nodiscard]] std::optional<Catalogue> LoadCatalogue(const std::string& file,
                                                     Diagnostics* diagnostics);
[[nodiscard]] Diagnostics CheckCatalogue(const std::string& file);

/// A motor of a catalogue in the place of a model's, whose drive, spindle and ambient temperature
/// it keeps; `gearbox` may be null.
[[nodiscard]] Motor InPlaceOf(const Motor& model, const CatalogueMotor& choice,
                              const CatalogueGearbox* gearbox);

/// A motor as a model file's map, without braces; reads back to the same numbers.
[[nodiscard]] std::string MotorText(const Motor& motor);

}  // namespace mbv
