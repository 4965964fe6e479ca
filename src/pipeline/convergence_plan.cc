#include "pipeline/convergence_plan.h"

#include <fmt/format.h>

#include <array>

#include "simulation/simulation.h"

namespace mbv {
namespace {

// Time constants in steps, halved.
constexpr std::array<double, 5> kCorrectedConstants = {400, 200, 100, 50, 25};
constexpr std::array<double, 5> kStockConstants = {32, 16, 8, 4, 2};

PlannedSeries OverConstants(const std::string& engine, bool stock, double step_s,
                            const std::array<double, 5>& constants) {
  PlannedSeries planned;
  planned.series = {.name = engine + "_time_constant",
                    .title = fmt::format("{} engine, time constant at step {:g} s", engine, step_s),
                    .stock = stock,
                    .knob = Knob::kTimeConstant};
  for (const double constant : constants) planned.grid.emplace_back(step_s, constant);
  return planned;
}

}  // namespace

std::vector<PlannedRun> RunsOf(const std::vector<PlannedSeries>& all) {
  std::vector<PlannedRun> runs;
  for (const PlannedSeries& planned : all) {
    for (const auto& [step_s, constant_steps] : planned.grid) {
      runs.push_back({fmt::format("{}, step {:g} s", planned.series.title, step_s),
                      planned.series.stock, step_s, constant_steps});
    }
  }
  return runs;
}

double CostOf(const std::vector<PlannedSeries>& all) {
  double cost = 0.0;
  for (const PlannedRun& run : RunsOf(all)) cost += run.cost();
  return cost;
}

std::vector<PlannedSeries> ConvergencePlan::UsualRefinement() const {
  const double usual = SimulationOptions{}.guidance_steps;
  return {{{.name = "corrected_both",
            .title = fmt::format("corrected engine, step and time constant = {:g} steps", usual)},
           Both(usual)}};
}

std::vector<PlannedSeries> ConvergencePlan::Others() const {
  const double guidance = SimulationOptions{}.guidance_steps;
  const double stock = SimulationOptions{}.stock_time_constant_steps;
  return {{{.name = "corrected_step",
            .title = fmt::format("corrected engine, step at time constant {:g} s",
                                 guidance * steps_s_.front()),
            .knob = Knob::kStep},
           StepAlone(guidance)},
          OverConstants("corrected", false, steps_s_[steps_s_.size() / 2], kCorrectedConstants),
          {{.name = "stock_both",
            .title = fmt::format("stock engine, step and time constant = {:g} steps", stock),
            .stock = true},
           Both(stock)},
          {{.name = "stock_step",
            .title =
                fmt::format("stock engine, step at time constant {:g} s", stock * steps_s_.front()),
            .stock = true,
            .knob = Knob::kStep},
           StepAlone(stock)},
          OverConstants("stock", true, steps_s_.back(), kStockConstants)};
}

ConvergencePlan::Grid ConvergencePlan::Both(double constant_steps) const {
  Grid grid;
  for (const double h : steps_s_) grid.emplace_back(h, constant_steps);
  return grid;
}

ConvergencePlan::Grid ConvergencePlan::StepAlone(double constant_steps) const {
  Grid grid;
  for (const double h : steps_s_) grid.emplace_back(h, constant_steps * steps_s_.front() / h);
  return grid;
}

}  // namespace mbv
