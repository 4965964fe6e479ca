// Which values of a model's parameters make its reachable set largest.
//
//   max μ(p),  p_low ≤ p ≤ p_high      μ: length, area or volume by the traced boundary; 0 where
//                                      the model has no such set                              (1)
//
// Without derivatives, since bounds of the set come and go: controlled random search with local
// mutation [Price 1983; Kaelo, Ali 2006], then Nelder and Mead's method in subspaces [Rowan 1990]
// from the best design, both of NLopt, on parameters that count from 0 to 1. A design is a function
// of its values alone, the search one of its seed: an interrupted one goes on from a ResultLog.
//
// A design counts as the best so far only where a lattice finds the same set. What is claimed is
// verified by that other way: it measures the best design once more, finer, designs beside it (a
// twentieth of the range along each parameter and in some directions), and of a global search some
// all over the box (Halton's points). None may be larger than the best one by more than both
// errors.
#pragma once

#include <functional>
#include <string>
#include <utility>
#include <vector>

#include "features/workspace/set_report.h"

namespace mbv {

struct DesignParameter {
  std::string name, unit;
  double low = 0.0, high = 1.0;  ///< SI
  double own = kNan;             ///< the model's value
};
struct DesignQuestion {
  std::vector<DesignParameter> parameters;
  bool global = true;   ///< else from the model's values, or the middle where they are outside
  int evaluations = 0;  ///< designs at most; 0: 100 for each parameter
  unsigned long seed = 1;
};

struct TriedDesign {
  VecX at;  ///< values of the parameters, SI
  double measure = 0.0, error = 0.0;
  std::string why;  ///< it has no set
};
/// See math/bytes.h.
template <typename Visit>
void VisitMembers(Visit& visit, typename Visit::template Of<TriedDesign>& design) {
  visit(design.at), visit(design.measure), visit(design.error), visit(design.why);
}

struct BestDesign {
  RunSummary summary;
  std::vector<TriedDesign> tried;      ///< by the boundary, in this order
  TriedDesign best;                    ///< of them
  ReachableSet set;                    ///< of it, both ways
  std::vector<TriedDesign> beside;     ///< by the lattice, near it
  std::vector<TriedDesign> elsewhere;  ///< by the lattice, all over the box
  bool agree = false;
  std::string verdict;
};

/// The model with these values of the parameters; empty where it cannot be built.
using ModelOfDesign = std::function<std::optional<Mechanism>(const VecX& values)>;

/// "r_mm=100:300" → parameters; all findings at once.
[[nodiscard]] std::vector<DesignParameter> ReadDesignParameters(
    const Mechanism& mechanism, const std::vector<std::string>& texts, Diagnostics* diagnostics);

[[nodiscard]] BestDesign FindBestDesign(const DesignQuestion& question, const ModelOfDesign& model,
                                        const SetArguments& arguments,
                                        const ProgressFunction& progress = {},
                                        const ResumeFolder* folder = nullptr);
/// The verdict on `best`, by both ways to it and by the lattice elsewhere.
void VerifyBestDesign(const DesignQuestion& question, const ModelOfDesign& model,
                      const SetArguments& arguments, BestDesign* result,
                      const ProgressFunction& progress = {}, const ResumeFolder* folder = nullptr);

/// What a page shows of it; `command` maps the best design.
[[nodiscard]] ReportSection SectionOf(const DesignQuestion& question, const BestDesign& design,
                                      const std::string& command);
[[nodiscard]] nlohmann::ordered_json ToJson(const DesignQuestion& question,
                                            const BestDesign& design);
/// The page and the designs that were tried as CSV.
[[nodiscard]] std::vector<std::pair<std::string, std::string>> DesignFiles(
    const std::string& mechanism, const DesignQuestion& question, const BestDesign& design,
    const std::string& command);

}  // namespace mbv
