// Stick and slip where freedoms move by forces, with the corrected engine.
//
// MuJoCo's frictionloss is a soft constraint: what rests creeps, and what slides stops over many
// steps. Here its rows hold what rests, as hard as all other rows (integrator.h). Where one would
// exceed its breakaway force, MuJoCo's solver decides with soft rows who gives way, also where
// several share a load, and hard ones correct that (Integrator::RefineFriction).
// What slides feels its law (element_forces.h) with the sign of its rate fixed. The times at which
// a rate leaves that sign, or a held coordinate accelerates, are found with Runge–Kutta steps from
// the node before; multistep history starts anew there. What is over between two nodes is not seen.
//
// Joints of one loop stop together, but for what the scheme leaves undone in the loops. With J the
// loops and commands, G_r what rests or stops, ẋ what is commanded, G_e has the rate
//   q̇_e = G_e (v − e),  (J; G_r) e = (J v − ẋ; G_r v), e of least norm                          (1)
// in which that is taken out: what (1) leaves is motion, however large the step.
#pragma once

#include <functional>

#include "simulation/integrator.h"
#include "simulation/steps.h"

namespace mbv::simulation {

class StickSlip {
 public:
  using CommandAt = std::function<RunSummary(double t_s, Commanded* at)>;
  /// All outlive the object.
  StickSlip(Session* session, Integrator* integrator, CommandAt command);

  /// True where something that rubs moves by forces.
  [[nodiscard]] bool acts() const { return !s_.engine.frictions.empty(); }
  /// Decides at the start, before Integrator::Start(): rates tell who slides.
  void FindSliding();
  /// Decides what rests at the start, after Integrator::Start().
  [[nodiscard]] RunSummary Begin();
  /// Takes a step with all its events, and its work.
  [[nodiscard]] RunSummary Advance(const Step& step);

 private:
  struct Event {
    double after_s = 0.0;
    std::vector<size_t> stops;
    std::vector<std::pair<size_t, int>> starts;  ///< elements and signs
  };
  [[nodiscard]] RunSummary Go(double from_s, double h, bool multistep);
  [[nodiscard]] RunSummary LetGo(double t_s);
  [[nodiscard]] RunSummary Jump(double t_s);
  [[nodiscard]] RunSummary FindRates(const Event& event, double t_s);
  [[nodiscard]] RunSummary Apply(const Event& event, double t_s);
  [[nodiscard]] bool Ended() const;
  [[nodiscard]] bool Stopped(size_t element) const;
  /// Sign of a held element's acceleration, 0 where MuJoCo holds it.
  [[nodiscard]] int Started(size_t element) const;
  [[nodiscard]] RunSummary Find(const Integrator::Node& node, double from_s, double h,
                                Event* event);
  [[nodiscard]] double StopTime(const Integrator::Node& node, size_t element, double from_s,
                                double h);
  [[nodiscard]] double StartTime(const Integrator::Node& node, size_t element, double from_s,
                                 double h, int* sign);
  [[nodiscard]] double RateAfter(const Integrator::Node& node, size_t element, double from_s,
                                 double h);
  [[nodiscard]] double Moving(size_t element) const;

  Session& s_;
  Integrator& integrator_;
  const CommandAt command_;
  std::vector<int> sliding_;
  std::vector<char> fresh_;  ///< slides since the present node
  std::vector<size_t> rubbing_;
  std::vector<double> rates_;  ///< of these, by (1)
  RunSummary trouble_ = RunSummary::Done();
  int uniform_ = 4;  ///< nodes since the last event, as in Step
};

}  // namespace mbv::simulation
