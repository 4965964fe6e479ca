// Equations of a user's own file: Python, Octave/MATLAB or formulas in YAML.
//
// A file declares closed forms (drive positions and forces of a mechanism, as functions of
// commands) and numbered equations to be audited. Its functions differentiate: given positions,
// rates and accelerations follow by truncated Taylor arithmetic through the functions themselves.
// Python and Octave run in a process of their own, started at the first call and kept; formulas are
// computed here. docs/how-to/equations.md is the users' page.
#pragma once

#include <array>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "analytic/closed_form.h"
#include "base/diagnostics.h"
#include "base/types.h"
#include "math/profile.h"
#include "mechanism/motion.h"

namespace mbv {

/// A closed form that a file declares.
struct FormInfo {
  std::string mechanism;              ///< Mechanism::name
  std::vector<std::string> commands;  ///< of a scenario, in the order of the function's arguments
  int line = 0;
  bool covers_stated = false;  ///< says what it takes for granted
  bool has_forces = false, takes_loads = false;
  bool has_rates = false;  ///< states rates or a Jacobian of its own
  std::vector<std::pair<std::string, std::string>> outputs;  ///< channel, unit
};

/// A numbered equation that a file declares.
struct EquationInfo {
  std::string number;                        ///< "(14)"
  std::string gives;                         ///< the quantity that it claims to be
  std::vector<std::string> arguments;        ///< also of the corrected form; without parameters
  std::map<std::string, std::string> given;  ///< the quantity that an argument is
  std::map<std::string, std::vector<std::string>> each;  ///< values of indices
  std::string erratum;                                   ///< "E2" or ""
  std::string printed, corrected, note, unit;            ///< to read
  double approximation = 0.0;  ///< how far it may be off as printed, in its unit
  int line = 0, end = 0;       ///< of the function as printed in the file
  int corrected_line = 0, corrected_end = 0;
  bool has_corrected = false;
};

/// The states at which a file's equations are audited.
struct StatesInfo {
  std::string model;  ///< empty: the file states none
  std::vector<std::string> coordinates;
  std::map<std::string, std::array<double, 2>> ranges;
  std::map<std::string, double> rates, accelerations, parameters;
  std::optional<Vec3> gravity_W;
  struct Load {
    std::string body;
    Vec3 point_B = Vec3::Zero(), force_W = Vec3::Zero(), moment_W = Vec3::Zero();
  };
  std::vector<Load> loads;
  int samples = 40;
};

struct EquationsInfo {
  std::vector<FormInfo> forms;
  std::vector<EquationInfo> equations;
  StatesInfo states;
};

/// Why a function of a file gave nothing.
struct EquationFailure {
  enum class Kind {
    kUnreachable,  ///< it has no pose there
    kSingular,     ///< it divided by zero
    kWrong,        ///< an exception, a wrong number of results, one that is not finite
    kLost,         ///< its program ended or took too long
    kNotStarted    ///< there is no such interpreter
  };
  Kind kind = Kind::kWrong;
  std::string message;
  std::string file = {};  ///< where; may be empty
  int line = 0;
  std::string function = {};
  std::vector<Finding> findings = {};  ///< instead of it, where there are several

  /// "message (file:line, in function)".
  [[nodiscard]] std::string Text() const;
  [[nodiscard]] std::vector<Finding> Findings() const;
};

template <typename T>
struct EquationResult {
  std::optional<T> value;
  EquationFailure failure = {};  ///< where there is no value

  explicit operator bool() const { return value.has_value(); }
};

/// Everything at one instant; NaN where a function gave no finite number.
struct FormSample {
  std::vector<Jet> drives;      ///< in the order of the names that were asked for
  std::vector<double> rates;    ///< as stated; empty without such a function
  std::vector<double> forces;   ///< empty without such a function, or where they were not asked for
  std::vector<double> outputs;  ///< in the order of FormInfo::outputs
};

/// Values of an argument: a number, a vector or a matrix (rows × columns, by rows).
struct Argument {
  int rows = 0, columns = 0;  ///< 0, 0: a number; n, 0: a vector
  bool whole = false;         ///< an index: a whole number
  std::string text = {};      ///< an index that is none: a word
  std::vector<double> values = {};
};
using ArgumentRow = std::map<std::string, Argument>;

/// The functions of one file. Not for two threads at once: see mutex().
class Equations {
 public:
  virtual ~Equations() = default;

  /// Reads the file and what it declares; the first call counts.
  [[nodiscard]] virtual EquationResult<EquationsInfo> Load() = 0;
  /// What functions get as parameters from now on.
  [[nodiscard]] virtual std::optional<EquationFailure> SetParameters(
      const std::map<std::string, double>& parameters) = 0;
  /// Of them, those that were read since they were set.
  [[nodiscard]] virtual std::vector<std::string> ReadParameters() = 0;
  /// What a form states about the mechanism: "crank.mass" and the like; NaN: of no influence.
  [[nodiscard]] virtual EquationResult<std::map<std::string, std::vector<double>>> Covers(
      size_t form) = 0;
  /// `q`, `v`, `a`: of the form's commands. `drives`: names, in the order that the sample has.
  [[nodiscard]] virtual EquationResult<FormSample> Sample(size_t form, const VecX& q, const VecX& v,
                                                          const VecX& a,
                                                          const std::vector<LoadSample>& loads,
                                                          const std::vector<std::string>& bodies,
                                                          const std::vector<std::string>& drives,
                                                          bool with_forces) = 0;
  /// A state in which a form is asked.
  struct FormState {
    VecX q, v, a;
  };
  /// Drives' positions, or their forces, of an edited text of the file at many states, a row each.
  [[nodiscard]] virtual EquationResult<std::vector<std::vector<double>>> SampleEdited(
      const std::string& text, size_t form, bool forces, const std::vector<FormState>& states,
      const std::vector<LoadSample>& loads, const std::vector<std::string>& bodies,
      const std::vector<std::string>& drives) = 0;
  /// What an equation gives at many states, a row each.
  [[nodiscard]] virtual EquationResult<std::vector<std::vector<double>>> Evaluate(
      size_t equation, const std::vector<ArgumentRow>& rows, bool corrected) = 0;
  /// The same of an edited text of the file.
  [[nodiscard]] virtual EquationResult<std::vector<std::vector<double>>> EvaluateEdited(
      const std::string& text, size_t equation, const std::vector<ArgumentRow>& rows,
      bool corrected) = 0;

  /// To be held by who calls while other threads may.
  [[nodiscard]] std::mutex& mutex() { return mutex_; }

 private:
  std::mutex mutex_;
};

/// Whether a file's equations run as a program, by its name; and the words that start it.
[[nodiscard]] bool IsEquationProgram(const std::string& file);
[[nodiscard]] std::vector<std::string> EquationCommand(const std::string& file);

/// The functions of a file: one object for one content, kept by this process. Null after a finding.
[[nodiscard]] std::shared_ptr<Equations> OpenEquations(const std::string& file,
                                                       Diagnostics* diagnostics);

/// The interpreters' sides as they are compiled in: equations.py; names and texts of Octave's.
[[nodiscard]] std::string EquationsPythonText();
[[nodiscard]] std::vector<std::pair<std::string, std::string>> EquationsOctaveFiles();

// A user's equations as the closed form of a scenario.

/// A closed form out of a file, or why there is none.
struct FileForm {
  std::unique_ptr<ClosedForm> closed_form;
  /// Why the equations do not apply: other commands, another mechanism, loads or masses that they
  /// do not cover. Empty where there is a closed form, and after errors.
  std::vector<Finding> uncovered;
  /// For every verdict: what they take for granted is not stated. "" where it is.
  std::string unchecked;
};

/// The form of the file whose commands are the scenario's. It is tried at the motion's first
/// instant: what does not work there is an error in `diagnostics`, with the file's own line; so are
/// stated rates that are not the derivatives of the positions.
[[nodiscard]] FileForm MakeFileForm(const std::string& file, const Mechanism& mechanism,
                                    const Motion& motion, Diagnostics* diagnostics);

// The languages of equations, one row each.

/// A language whose files run as a program.
struct EquationLanguage {
  const char* name;       ///< "Python"
  const char* extension;  ///< ".py"
  /// The interpreter's side: names and texts of files, which are put into a folder.
  std::vector<std::pair<std::string, std::string>> (*files)();
  /// Program and arguments that answer calls about `file`.
  std::vector<std::string> (*command)(const std::filesystem::path& folder, const std::string& file);
  /// What a user reads of it: program and file.
  std::vector<std::string> (*shown)(const std::string& file);
};

/// Of a file by its name; null: none.
[[nodiscard]] const EquationLanguage* FindEquationLanguage(const std::string& file);

[[nodiscard]] std::shared_ptr<Equations> MakeProgramEquations(const std::string& file,
                                                              const EquationLanguage& language);
/// Formulas of a YAML file.
[[nodiscard]] std::shared_ptr<Equations> MakeFormulaEquations(const std::string& file,
                                                              const std::string& text);

}  // namespace mbv
