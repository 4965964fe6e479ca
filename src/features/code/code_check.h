// Generated code against the reference: compiled, run at states, and compared. Internal to
// features/code/.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "features/code/code.h"
#include "reference/reduced_model.h"

namespace mbv {

/// The reference at states of a task.
class CodeReference {
 public:
  CodeReference(const Mechanism& mechanism, const CodeTask& task);

  /// Fills actuators and forces of a state with q, v and a, from home. False with `why` where it is
  /// not reached, or the actuators do not hold it.
  [[nodiscard]] bool Find(TestState* state, std::string* why);

 private:
  const Mechanism& mechanism_;
  const CodeTask& task_;
  ReducedModel model_;                       ///< of the whole
  std::optional<ReducedModel> own_, given_;  ///< of the parts
  VecX held_;
};

/// A loop counts as closed where its residual is below: what home leaves open, at least rounding.
[[nodiscard]] double CodeClosureTolerance(const MechanismFormulas& formulas);

/// A program for a header: without arguments it runs the self-test; with a file of states and one
/// to write, it computes there.
[[nodiscard]] std::string CheckProgram(const MechanismFormulas& formulas,
                                       const CodeTextOptions& options);

class CodeCheck {
 public:
  /// `states`: with what the reference found there. `open`: where it found nothing.
  CodeCheck(const MechanismFormulas& formulas, const CodeTextOptions& options,
            const std::vector<TestState>& states, const std::vector<TestState>& open);

  [[nodiscard]] CodeJudgement C(const std::string& header, bool from_table);
  /// At the first states.
  [[nodiscard]] CodeJudgement Python(const std::string& module, size_t most);
  /// What makes the difference of the last code that was judged, in words; "": not found out.
  [[nodiscard]] std::string Slip(CodeReference* reference) const;

 private:
  struct Found {
    bool reached = false;
    VecX actuators, rates, accelerations, forces, along, outputs;
    double back = kNan;
  };
  [[nodiscard]] std::string Run(const std::vector<std::string>& argv,
                                const std::filesystem::path& folder, size_t count,
                                CodeJudgement* judgement);
  /// `may_refuse`: the code need not reach all states.
  void Compare(CodeJudgement* judgement, bool may_refuse) const;
  [[nodiscard]] bool ClosesOtherwise(const VecX& q, const VecX& actuators) const;

  const MechanismFormulas& formulas_;
  const CodeTextOptions& options_;
  const std::vector<TestState>& states_;
  const std::vector<TestState>& open_;
  std::vector<Found> found_;  ///< at the first `compared_` states, then at open ones
  size_t compared_ = 0;
};

}  // namespace mbv
