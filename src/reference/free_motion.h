// Integration of a free motion from sample to sample. Internal to reference/.
#pragma once

#include <memory>
#include <vector>

#include "core/run_summary.h"
#include "reference/forward.h"
#include "reference/free_dynamics.h"

namespace mbv::internal {

class FreeMotion {
 public:
  /// Mechanism and motion outlive the object.
  FreeMotion(const Mechanism& mechanism, const Motion& motion, double tolerance);
  ~FreeMotion();

  /// Puts `states` onto loops and commands at t = 0 and starts there.
  [[nodiscard]] RunSummary Start(const BodyStates& states);
  /// Integrates to `t_s`; states() then has accelerations too.
  [[nodiscard]] RunSummary AdvanceTo(double t_s);

  [[nodiscard]] const BodyStates& states() const { return now_.states; }
  [[nodiscard]] FreeDynamics& dynamics() { return dynamics_; }
  [[nodiscard]] long steps() const { return steps_; }
  [[nodiscard]] long evaluations() const { return evaluations_; }
  /// Passages found so far, in time order.
  [[nodiscard]] std::vector<SingularPassage> Passages() const;

 private:
  // A node of the integration.
  struct Node {
    double time_s = 0.0;
    double pivot = kNan;
    BodyStates states;
  };
  using State = std::vector<double>;

  void Rates(const State& x, State* rates, double t_s);
  [[nodiscard]] RunSummary Segment(double to_s);
  [[nodiscard]] RunSummary Accept(const State& x, double t_s);
  void Watch();
  [[nodiscard]] SingularPassage Closest(const Node& from, double first_s, double last_s);

  struct Stepper;
  const double duration_s_;
  FreeDynamics dynamics_;
  std::unique_ptr<Stepper> stepper_;
  std::vector<double> breaks_;
  Node before_, last_, now_;
  int nodes_ = 0;
  double dt_ = 0.0;
  BodyStates work_;
  RunSummary trouble_;  ///< of the last Rates()
  long steps_ = 0, evaluations_ = 0;
  double largest_pivot_ = 0.0;
  std::vector<SingularPassage> passages_;
};

}  // namespace mbv::internal
