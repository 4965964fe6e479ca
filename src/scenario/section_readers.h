// The sections of a scenario file: `motion:`, `loads:` and `forces:`, then the others.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "math/profile.h"
#include "math/quintic_spline.h"
#include "mechanism/mechanism.h"
#include "mechanism/motion.h"
#include "model_file/yaml/value_reader.h"
#include "plot/figure.h"
#include "scenario/scenario.h"

namespace mbv {

struct ProfileTables;

// Keys of `motion.path` with `blend`: polylines with rounded corners.

/// Everything but the points; empty after a finding.
[[nodiscard]] std::optional<PolylinePlan> ReadBlendedPlan(ValueReader* values, const YamlMap& map);

/// The motion of every axis; empty after a finding, at `node`.
[[nodiscard]] std::vector<Piecewise> PlanPath(YamlReader* yaml, const YamlNode& node,
                                              const PolylinePlan& plan);

// Numbers of a scenario that follow from time and from the mechanism's state.
//
//   "-k*(slider.position - 0.1) - c*slider.velocity + 5*sin(2*pi*t)"
// Names with dots are coordinates (StateCoordinates()) with .position or .velocity behind, t is the
// time [s]; other names are parameters, which are constants. SI units, radians.

/// Reads them, with the names that a scenario gives to parts of them and to time profiles
/// (`variables`).
class StateFunctions {
 public:
  /// `variables` may be null; `tables` are those that profiles name.
  StateFunctions(ValueReader* values, const Mechanism& mechanism, const YamlNode* variables,
                 ProfileTables* tables);

  /// True for a text that names the time, a coordinate or a variable.
  [[nodiscard]] bool Follows(const YamlNode& node) const;
  /// Empty after a finding.
  [[nodiscard]] std::optional<StateFunction> Read(const YamlNode& node, const std::string& path);

 private:
  [[nodiscard]] std::optional<std::string> Expanded(const YamlNode& node, const std::string& path,
                                                    const std::string& text, int depth) const;
  ValueReader& values_;
  const Mechanism& mechanism_;
  std::map<std::string, std::string> variables_;
  std::map<std::string, Profile> signals_;
  int branching_ = 0;  ///< functions with branches so far
};

/// Times for a motion that states none, from a table that it is compared with.
struct MotionTimes {
  std::optional<double> duration_s, sample_s;
};

/// What a phase of the scenario adds to its motion.
struct PhaseMotion {
  const YamlNode* commands = nullptr;  ///< null: none
  std::string path = {};               ///< of them: "phases[1].commands"
  const Mechanism* first = nullptr;    ///< PhaseStart::first
};

/// Sections of a scenario about motion; null: left out.
struct MotionSections {
  const YamlNode *motion = nullptr, *loads = nullptr, *forces = nullptr, *switches = nullptr,
                 *variables = nullptr;
};

/// Reads the sections (`motion` is there) against a mechanism, with the tables that profiles name.
/// Findings go to the reader, those about tables' files to `files`; the motion is complete only if
/// there was no error.
[[nodiscard]] Motion ReadMotion(ValueReader* values, const Mechanism& mechanism,
                                const MotionSections& sections, const MotionTimes& otherwise,
                                const PhaseMotion& phase, Diagnostics* files);

// The sections of a scenario file that do not concern motion.

/// A forward simulation takes at most this many steps; each needs about 200 bytes.
inline constexpr double kMaxSteps = 1e7;

[[nodiscard]] AnalyticSettings ReadAnalytic(ValueReader* values, const YamlNode* node);
[[nodiscard]] ReferenceSettings ReadReference(ValueReader* values, const YamlNode* node);
[[nodiscard]] SimulationSettings ReadSimulation(ValueReader* values, const YamlNode* node);
/// Findings if a gain leaves drives out or names what is none.
void CheckGain(const YamlNode& node, const std::string& path, const Gain& gain,
               const Mechanism& mechanism, YamlReader* yaml);
/// Limits that a scenario leaves out: those of lengths are in proportion to the characteristic
/// length, and not below what the distance from the origin rounds.
[[nodiscard]] CheckLimits DefaultLimits(const Mechanism& mechanism);
/// Limits, and `start_window_s` if it is given; without a mechanism (it could not be read) defaults
/// are those of a metre.
[[nodiscard]] CheckLimits ReadChecks(ValueReader* values, const YamlNode* node,
                                     const Mechanism* mechanism, double* start_window_s);
/// Limits of a stiffness at a pose.
[[nodiscard]] CheckLimits ReadStiffnessChecks(ValueReader* values, const YamlNode* node);
[[nodiscard]] Expectation ReadExpectation(ValueReader* values, const YamlNode* node);

// The section `snapshots` of a scenario file: what its pictures show and how they look.

/// Without the section: pictures at the start and half way.
[[nodiscard]] SnapshotSettings ReadSnapshots(ValueReader* values, const YamlNode* node,
                                             double duration_s, const Mechanism& mechanism);

// Reads `figures:` of a scenario. Channels, units and witnesses are checked where their names are
// known (plot/figure.h).

[[nodiscard]] std::vector<FigureSpec> ReadFigures(ValueReader* values, const YamlNode* node);
/// The list below `panels:` of a figure; `path` is its key's.
[[nodiscard]] std::vector<PanelSpec> ReadPanels(ValueReader* values, const YamlNode& node,
                                                const std::string& path);

// Time profiles in scenario files: a number, one term, or a list of terms that are added.

/// Tables that profiles name: loads them, and keeps what is known of them.
struct ProfileTables {
  const Mechanism* mechanism = nullptr;
  Diagnostics* files = nullptr;  ///< findings about the files
  std::vector<MotionTable> loaded = {};
  struct Place {
    const YamlNode* node;  ///< `csv`
    std::string path;
  };
  std::vector<Place> places = {};  ///< of loaded
  bool failed = false;             ///< some table could not be loaded
  /// Laws that come to an end.
  struct Law {
    const YamlNode* node;
    std::string path;
    double start_s, end_s;
  };
  std::vector<Law> laws = {};
};

/// What a profile's values are.
struct ProfileContext {
  std::string unit;            ///< "m", "rad" or another unit; "_deg" keys need "rad", "_mm" "m"
  std::optional<double> home;  ///< value of the word `home`; empty where it has no meaning
  std::string name = {};       ///< of what it is for: "crank.drive"
  bool moves = false;          ///< of a command: its derivatives count
  bool may_jump = false;       ///< of a force: it may jump, and its rate, too
  ProfileTables* tables = nullptr;  ///< null where a table has no meaning
};

/// Reads a profile; findings for what does not fit.
[[nodiscard]] Profile ReadProfile(ValueReader* values, const YamlNode& node,
                                  const std::string& path, const ProfileContext& context);

// Numbers of profiles in the unit of what they are for. Internal to the readers of profiles.

class AmountReader {
 protected:
  AmountReader(ValueReader* values, const ProfileContext& context)
      : values_(values), context_(context) {}

  /// A term's map; `amount` is the key that may be given in several units.
  YamlMap Map(const YamlNode* node, const std::string& path, const std::string& amount,
              std::vector<std::string> keys);
  /// A length or angle, or its rates; the unit must suit the coordinate. Empty when left out.
  YamlMap::InUnit FindAmount(const YamlMap& map, const std::string& key);
  std::optional<double> Amount(const YamlMap& map, const std::string& key);
  /// A required list.
  std::optional<std::vector<double>> Amounts(const YamlMap& map, const std::string& key);
  std::optional<double> PositiveAmount(const YamlMap& map, const std::string& key);
  std::optional<double> RequiredAmount(const YamlMap& map, const std::string& key);

  ValueReader* values_;
  const ProfileContext& context_;
};

// `cam` terms of profiles: rises, dwells and returns one after the other.

/// Words of the laws from rest to rest.
[[nodiscard]] const std::vector<std::string>& StepLaws();

/// A step by the law of this word.
[[nodiscard]] ProfileTerm StepTerm(const std::string& law, double start_s, double duration_s,
                                   double delta);

/// Adds a cam's terms to the profile; findings for what does not fit.
void ReadCam(ValueReader* values, const YamlNode& node, const std::string& path,
             const ProfileContext& context, Profile* profile);

}  // namespace mbv
