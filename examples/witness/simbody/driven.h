// What commanded drives are to Simbody: a coordinate that is prescribed, a distance that is.
#pragma once

#include <memory>

#include "basics.h"

namespace simbody_witness {

// The present motion of one drive, as a function of time that Simbody asks for.
class Driven : public SimTK::Function {
 public:
  explicit Driven(std::shared_ptr<const Sample> now) : now_(std::move(now)) {}
  SimTK::Real calcValue(const SimTK::Vector&) const override { return now_->position; }
  SimTK::Real calcDerivative(const SimTK::Array_<int>& order, const SimTK::Vector&) const override {
    return order.size() == 1 ? now_->velocity : now_->acceleration;
  }
  int getArgumentSize() const override { return 1; }
  int getMaxDerivativeOrder() const override { return 2; }
  Driven* clone() const override { return new Driven(now_); }

 private:
  std::shared_ptr<const Sample> now_;
};

// |b − a| − L = 0 between two points.
class Distance : public Constraint::Custom::Implementation {
 public:
  Distance(SimTK::SimbodyMatterSubsystem& matter, const MobilizedBody& from, const Vec3& a,
           const MobilizedBody& to, const Vec3& b, std::shared_ptr<const Sample> now)
      : Implementation(matter, 1, 0, 0), a_(a), b_(b), now_(std::move(now)) {
    from_ = addConstrainedBody(from);
    to_ = addConstrainedBody(to);
  }
  Implementation* clone() const override { return new Distance(*this); }

  void calcPositionErrors(const State&,
                          const SimTK::Array_<Transform, SimTK::ConstrainedBodyIndex>& X,
                          const SimTK::Array_<SimTK::Real, SimTK::ConstrainedQIndex>&,
                          SimTK::Array_<SimTK::Real>& error) const override {
    error[0] = (X[to_] * b_ - X[from_] * a_).norm() - now_->position;
  }
  void calcPositionDotErrors(const State& state,
                             const SimTK::Array_<SpatialVec, SimTK::ConstrainedBodyIndex>& V,
                             const SimTK::Array_<SimTK::Real, SimTK::ConstrainedQIndex>&,
                             SimTK::Array_<SimTK::Real>& error) const override {
    const Ends e = EndsOf(state);
    error[0] = SimTK::dot(e.u, Rate(V[to_], e.b) - Rate(V[from_], e.a)) - now_->velocity;
  }
  void calcPositionDotDotErrors(const State& state,
                                const SimTK::Array_<SpatialVec, SimTK::ConstrainedBodyIndex>& A,
                                const SimTK::Array_<SimTK::Real, SimTK::ConstrainedQIndex>&,
                                SimTK::Array_<SimTK::Real>& error) const override {
    const Ends e = EndsOf(state);
    const SpatialVec V_a = getBodyVelocityFromState(state, from_);
    const SpatialVec V_b = getBodyVelocityFromState(state, to_);
    const Vec3 v = Rate(V_b, e.b) - Rate(V_a, e.a);
    const Vec3 a_a = Rate(A[from_], e.a) + V_a[0] % (V_a[0] % e.a);
    const Vec3 a_b = Rate(A[to_], e.b) + V_b[0] % (V_b[0] % e.b);
    const double along = SimTK::dot(e.u, v);
    error[0] =
        SimTK::dot(e.u, a_b - a_a) + (v.normSqr() - along * along) / e.length - now_->acceleration;
  }
  void addInPositionConstraintForces(
      const State& state, const SimTK::Array_<SimTK::Real>& multipliers,
      SimTK::Array_<SpatialVec, SimTK::ConstrainedBodyIndex>& forces,
      SimTK::Array_<SimTK::Real, SimTK::ConstrainedQIndex>&) const override {
    const Ends e = EndsOf(state);
    const Vec3 f = multipliers[0] * e.u;
    forces[to_] += SpatialVec(e.b % f, f);
    forces[from_] -= SpatialVec(e.a % f, f);
  }

 private:
  struct Ends {
    Vec3 a, b;  // from the bodies' origins
    Vec3 u;
    double length;
  };
  [[nodiscard]] Ends EndsOf(const State& state) const {
    const Transform& X_a = getBodyTransformFromState(state, from_);
    const Transform& X_b = getBodyTransformFromState(state, to_);
    Ends e{X_a.R() * a_, X_b.R() * b_, Vec3(0), 0.0};
    const Vec3 d = X_b.p() + e.b - X_a.p() - e.a;
    e.length = d.norm();
    e.u = d / e.length;
    return e;
  }
  static Vec3 Rate(const SpatialVec& V, const Vec3& arm) { return V[1] + V[0] % arm; }

  Vec3 a_, b_;
  std::shared_ptr<const Sample> now_;
  SimTK::ConstrainedBodyIndex from_, to_;
};

}  // namespace simbody_witness
