// Steps a user's model along the commanded motion. Internal to simulation/.
#pragma once

#include <array>
#include <string>
#include <vector>

#include "simulation/own_model.h"

namespace mbv::simulation {

class OwnStepper {
 public:
  /// All outlive the stepper.
  OwnStepper(const OwnTask& task, const OwnModel& own, OwnRun* run);
  ~OwnStepper();
  OwnStepper(const OwnStepper&) = delete;
  OwnStepper& operator=(const OwnStepper&) = delete;

  [[nodiscard]] RunSummary Run();

 private:
  struct Point {  // of the commanded motion
    DrivenSample now, before, after;
  };

  static void OnControl(const mjModel* m, mjData* d);
  void Correct();
  void SupplyVelocityTerm();
  void LeadExactly();
  [[nodiscard]] RunSummary Command(long n);
  void LeadByActuators(const OwnDrive& drive, double position, double velocity);
  void FindRows();
  [[nodiscard]] RunSummary Start();
  [[nodiscard]] RunSummary Trouble(double t_s) const;
  void Record(long sample, double t_s);
  void RecordGaps(double t_s);
  void RecordForces(long sample);
  void Watch(double t_s);
  void Note(const std::string& what, double t_s);
  [[nodiscard]] double TargetRate(size_t k) const;
  [[nodiscard]] double TargetAcceleration(size_t k) const;

  const OwnTask& task_;
  const OwnModel& own_;
  OwnRun* const run_;
  const mjModel* const m_;
  const DataHandle d_, shifted_;  // the second one for differences
  const double h_;
  const bool staged_;  // forces are evaluated inside the step, too
  Point at_;
  std::vector<int> row_;              // first row per equality, or -1
  std::vector<mjtNum> forth_, back_;  // J(q ± εq̇) q̇
  std::vector<std::string> noted_;
};

}  // namespace mbv::simulation
