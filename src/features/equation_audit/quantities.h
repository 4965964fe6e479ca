// Quantities of a mechanism by name, as the reference gives them: what an equation of a file claims
// to be, and what its arguments are (docs/how-to/equations.md, Quantities).
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "equations/equations.h"
#include "mechanism/mechanism.h"
#include "mechanism/motion.h"
#include "reference/reduced_model.h"

namespace mbv {

/// A state of the reference, with what follows from it.
struct AuditState {
  const Mechanism* mechanism = nullptr;
  BodyStates states;
  ReferenceSample sample;
  VecX drive_force;
  MatX T;                  ///< ReducedModel::Motions()
  MatX mass, drive_rates;  ///< n × n, drives × n
  VecX bias, gravity;      ///< along the coordinates
};

/// A quantity that was found in a mechanism.
class AuditQuantity {
 public:
  /// Empty, with the reason and a hint, where the text names none.
  [[nodiscard]] static std::optional<AuditQuantity> Parse(const std::string& text,
                                                          const Mechanism& mechanism,
                                                          std::string* reason, std::string* hint);
  /// `order`: 0 its value, 1 its rate, 2 its acceleration.
  [[nodiscard]] static AuditQuantity OfCoordinate(const Coordinate& coordinate, int order);
  [[nodiscard]] Argument At(const AuditState& state) const;
  /// The drive whose force it is, by index; −1: none.
  [[nodiscard]] int drive_of_force() const { return kind_ == Kind::kDriveForce ? index_ : -1; }
  [[nodiscard]] bool is_acceleration() const {
    return (kind_ == Kind::kCoordinate && order_ == 2) ||
           (kind_ == Kind::kBody && (of_ == Of::kAcceleration || of_ == Of::kAngularAcceleration));
  }
  /// The equation is an identity that must vanish.
  [[nodiscard]] bool vanishes() const { return kind_ == Kind::kZero; }

 private:
  enum class Kind {
    kZero,
    kCoordinate,
    kDriveForce,
    kDriveJacobian,
    kBody,
    kAxis,
    kJointPosition,
    kReaction,
    kReactionComponent,
    kMass,
    kBias,
    kGravity,
    kStiffness,
    kCompliance
  };
  enum class Of {
    kPosition,
    kRotation,
    kVelocity,
    kAngularVelocity,
    kAcceleration,
    kAngularAcceleration,
    kJacobian,
    kInertiaForce,
    kInertiaMoment,
    kWeight
  };
  friend class QuantityParser;

  [[nodiscard]] MatX Whole(const AuditState& state) const;
  [[nodiscard]] MatX OfBody(const AuditState& state) const;

  Kind kind_ = Kind::kZero;
  Of of_ = Of::kPosition;
  Coordinate coordinate_;
  int order_ = 0;  // of a coordinate: 0, 1, 2 derivatives
  int index_ = 0;  // drive, body, joint
  int component_ = 0;
  Pose X_BF_ = Pose::Identity();
  int in_ = -1, from_ = -1;     // bodies
  int row_ = -1, column_ = -1;  // of an element, from 0
  bool element_ = false;
};

}  // namespace mbv
