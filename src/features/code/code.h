// Verified code of a mechanism: inverse kinematics, Jacobians and inverse dynamics in C99 and
// Python, judged against the reference.
#pragma once

#include <filesystem>
#include <functional>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "base/diagnostics.h"
#include "features/code/code_text.h"
#include "mechanism/mechanism.h"
#include "reference/reduced_model.h"

namespace mbv {

struct CodeRange {
  std::string coordinate;
  double low = kNan, high = kNan;  ///< [rad or m]
};

struct CodeSettings {
  std::string name = {};               ///< before all names in C; "": of the mechanism
  std::vector<CodeRange> ranges = {};  ///< of all coordinates: with a table to start from
  int cells = 0;  ///< of the table per coordinate, a power of 2; 0: 512, 64 or 16 by their number
  const StartTable* table = nullptr;  ///< of these ranges and cells, made before; null: it is made
  size_t states = 10000;              ///< that it is judged by
  std::uint64_t seed = 1;
  std::string check = {};  ///< another header with the same functions, to be judged instead
  bool compile = true;
  std::string origin = {};  ///< for the head: how the model is called
};

/// How code compares with the reference.
struct CodeJudgement {
  std::string language;         ///< "C", "C, from the table", "Python"
  std::string compiler = {};    ///< its first line about itself
  std::string not_judged = {};  ///< why; "": it was
  bool broken = false;          ///< it does not compile or run
  size_t states = 0;            ///< that both reached
  size_t only_one = 0;          ///< that one of them reached
  double position = kNan;       ///< largest difference, by the largest value of its actuator
  double force = kNan;          ///< of actuators; NaN: there are none
  double along = kNan;          ///< of forces along the coordinates
  double output = kNan;         ///< of the outputs' poses [characteristic lengths, rad]
  double back = kNan;           ///< share of the states that the way by actuators leads back to
  double jacobian = kNan;       ///< by the largest entry
  double nanoseconds = kNan;    ///< per state: pose, Jacobian and forces
  std::string slip = {};        ///< what is wrong, where that is found out
  std::vector<std::string> warnings = {};  ///< of the compiler

  /// Limit of all differences.
  static constexpr double kLimit = 1e-9;
  [[nodiscard]] bool agrees() const;
};

struct CodeResult {
  std::string name;
  std::vector<std::string> coordinates, actuators, notes;
  size_t blocks = 0, largest_block = 0, unknowns = 0;
  std::vector<std::pair<std::string, std::string>> files;  ///< name, content
  std::vector<CodeJudgement> judgements;
  std::optional<StartTable> table = {};           ///< with ranges
  double table_bound = kNan, table_share = kNan;  ///< error left, share of the range that is proved
  std::optional<LookupTable> lookup = {};         ///< with ranges, where no other header is judged
  double lookup_share = kNan;                     ///< of its cells, that are proved
  VecX lookup_error = {};   ///< per actuator: largest that was found at the states
  Diagnostics diagnostics;  ///< errors: there is no code

  [[nodiscard]] bool agrees() const;
};

/// To read, the verdicts alone, and for programs.
[[nodiscard]] std::string ToText(const CodeResult& result);
[[nodiscard]] std::string JudgementsText(const CodeResult& result);
[[nodiscard]] nlohmann::ordered_json ToJson(const CodeResult& result, const std::string& model);

/// What code is made for.
struct CodeTask {
  std::vector<NamedCoordinate> coordinates;     ///< q
  std::vector<NamedCoordinate> held;            ///< at home
  std::vector<NamedCoordinate> actuators = {};  ///< drives and prescribed joints
  /// The mechanism is a part of `whole`, and the forces of another part, `given`, along the
  /// coordinates are inputs: together they need the actuators' forces of the whole.
  const Mechanism* whole = nullptr;
  const Mechanism* given = nullptr;
};

/// By names; the rest of `settings` is of no influence. Nothing after an error.
[[nodiscard]] std::optional<CodeTask> ChooseCodeTask(const Mechanism& mechanism,
                                                     const std::vector<std::string>& coordinates,
                                                     Diagnostics* diagnostics);

/// `progress` gets the share that is done.
[[nodiscard]] CodeResult MakeCode(const Mechanism& mechanism, const CodeTask& task,
                                  const CodeSettings& settings,
                                  const std::function<void(double)>& progress = {});

// A table that Newton's method starts from, with a proof of where a fixed number of steps does.
//
// For every cell of a box of q, with y what a block searches, c and G = ∂y/∂q at the cell's centre,
// and all functions by interval arithmetic (Boost.Interval):
//   y = c + G (q − q_c) + e,  K(E) = −A r(c + G (q − q_c)) + (1 − A J(Y)) E ⊂ E
//                                               one solution y*(q), e in E, for each q         (1)
//   e_0 <= |y_0(q_c) − c| + |E| + Σ_i |∂_i y_0 − G_i| h_i / 2                                  (2)
//   e_k+1 <= ½ β Λ (e_k + D ε)² + D ε                                                          (3)
// [Krawczyk 1969; Moore, Kearfott, Cloud 2009, ch. 8; Ortega 1968]. A: about J⁻¹; y_0: the table
// between its nodes, multilinear; β: bound of |J⁻¹|, Λ: of the second derivatives, on Y widened by
// e_0; ε: the error that the blocks before are left with, which end their steps first; D: bound of
// |J⁻¹ ∂r/∂y_before|. Cells are connected with the one at home by common solutions on their faces,
// so that the branch is that of home.

/// Over the box; cells (CodeSettings::cells) that are not proved are outside. At most three
/// coordinates. An empty table (no cells) with `why` where a proof is beyond it: balls that are
/// searched, large blocks.
[[nodiscard]] StartTable MakeStartTable(const MechanismFormulas& formulas, const VecX& low,
                                        const VecX& high, int cells, std::string* why,
                                        const std::function<void(double)>& progress);

/// Over the cells that `start` proves.
[[nodiscard]] LookupTable MakeLookupTable(const MechanismFormulas& formulas,
                                          const StartTable& start);

// Generated code against the reference: compiled, run at states, and compared. Internal to
// features/code/.

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
  ~CodeCheck();

  /// A header that is judged again is compiled once.
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
  struct Built;
  void Build(const std::string& header);

  const MechanismFormulas& formulas_;
  const CodeTextOptions& options_;
  const std::vector<TestState>& states_;
  const std::vector<TestState>& open_;
  std::vector<Found> found_;  ///< at the first `compared_` states, then at open ones
  size_t compared_ = 0;
  std::unique_ptr<Built> built_;  ///< the last program
};

}  // namespace mbv
