// Inside of the model loader: the state shared by its stages. Include load_model.h instead.
//
// A "block" is a level of declarations: the model itself, or one instance of a part. Stages run
// over all blocks one after the other, so that every name exists before it is referred to:
// parameters (model_parameters.cc), head and blocks (model_parts.cc), bodies and frames, then
// shapes (model_bodies.cc), joints (model_joints.cc), drives, springs, outputs and order
// (model_signals.cc), materials, sections and beams (model_elastic.cc), then the checks on the
// whole (model_checks.cc, model_beam_checks.cc, model_plausibility.cc).
#pragma once

#include <deque>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "input/expressions.h"
#include "input/yaml_reader.h"
#include "kinematics/home.h"
#include "mechanism/mechanism.h"
#include "mechanism/spanning_tree.h"
#include "model_file/load_model.h"
#include "model_file/urdf.h"

namespace mbv {

/// One level of declarations.
struct Block {
  const YamlNode* node = nullptr;
  Scope* scope = nullptr;
  std::string path;                 ///< YAML path for messages: "" or "parts.limb"
  std::string prefix;               ///< "" or "limb1." or "limb1.left."
  std::vector<std::string> levels;  ///< prefixes in which a name is looked up, inner first
  std::vector<std::string> parts;   ///< names of the parts around, to find endless nesting

  [[nodiscard]] const YamlNode* Section(std::string_view key) const;
  [[nodiscard]] std::string Note() const;  ///< " (in limb1)" for messages
  [[nodiscard]] std::string PathOf(std::string_view key) const { return JoinPath(path, key); }
};

/// A frame on a body, as a joint or an output refers to it.
struct FrameRef {
  int body = 0;
  Pose X_BF = Pose::Identity();
};

class ModelReader {
 public:
  /// Bounds on what a file may ask for; beyond them the file is refused, not computed. The largest
  /// models take a gigabyte for their rank.
  static constexpr size_t kMaxBodies = 2000;
  static constexpr size_t kMaxBlocks = 4000;
  static constexpr size_t kMaxJoints = 4000;
  static constexpr size_t kMaxItems = 10000;  ///< of frames, shapes, drives, …

  ModelReader(std::string file, const LoadOptions& options)
      : yaml_(std::move(file)), options_(options) {}

  /// Runs all stages on the text.
  LoadResult Load(const std::string& text);
  /// The same with the text that stands for a URDF file: no finding points into it.
  LoadResult LoadBareUrdf(const std::string& text) {
    bare_urdf_ = true;
    return Load(text);
  }

 private:
  void ReadAll();

  // model_parts.cc
  void ReadHead();
  void ReadUp(const Block& model, const YamlNode* node);
  void ReadAllowances(const Block& model, const YamlMap& map);
  void ExpandInstances(const Block& block);
  void AddInstance(const Block& block, const YamlEntry& entry);
  void ReadInstance(const Block& block, const YamlEntry& entry, const YamlNode& part,
                    const std::string& part_name);
  [[nodiscard]] const YamlNode* FindPart(const std::string& name) const;

  // model_parameters.cc
  void ReadModelParameters(const Block& model, const YamlMap& map);
  void OpenParameterFiles(YamlReader* yaml, const YamlNode& root,
                          const std::vector<std::string>& chain);
  void ReadParameters(YamlReader* yaml, const Block& block, const YamlNode* node,
                      const std::string& path);
  void EvaluateParameters(YamlReader* yaml, const Block& block, const YamlNode* node,
                          const std::string& path, const std::set<std::string>& replaced = {});
  void ApplyOverrides(const Block& block);
  [[nodiscard]] Finding PlaceOfOverride(const std::string& name) const;
  void CheckOverrides();

  // model_bodies.cc
  void ReadBodies(const Block& block);
  void ReadBody(const Block& block, const YamlEntry& entry);
  void ReadMass(const Block& block, const YamlMap& map, Body* body);
  void ReadAttachedFrames(const Block& block);
  void ReadFrames(const Block& block, const YamlNode* node, const std::string& path,
                  const std::string& prefix, int body);
  void ReadShapes(const Block& block);
  void ReadShapes(const Block& block, const YamlNode& node, const std::string& path, int body);
  std::optional<Shape> ReadShape(const Block& block, const YamlNode& node, const std::string& path,
                                 int body);
  std::optional<Vec3> ShapePoint(const Block& block, const YamlMap& map, const std::string& key,
                                 int body);
  std::optional<double> Radius(const Block& block, const YamlMap& map);
  template <typename Rod>
  std::optional<Rod> ReadRod(const Block& block, const YamlNode& node, const std::string& path,
                             int body);
  std::optional<Box> ReadBox(const Block& block, const YamlNode& node, const std::string& path,
                             int body);
  std::optional<Ball> ReadBall(const Block& block, const YamlNode& node, const std::string& path,
                               int body);

  // model_urdf.cc
  void ImportUrdf(const YamlNode& node);
  void ReadUrdfGuesses(const YamlMap& map, const std::vector<Joint>& joints);
  void TakeUrdfLiterals(Body* body);
  void AddUrdf(const UrdfTree& tree, const std::string& file);
  void AddUrdfDrives(const std::vector<std::string>& motors, const YamlNode* at);
  void WeldUrdfRoot();

  // model_urdf_closures.cc
  static void DropClosures(UrdfTree* tree);
  bool ReadClosureFile(const YamlNode& node, UrdfTree* tree, std::vector<std::string>* motors);

  // model_joints.cc
  void ReadJoints(const Block& block);
  void ReadJoint(const Block& block, const YamlEntry& entry);
  bool ReadAxes(const Block& block, const YamlMap& map, Joint* joint);
  void ReadGuess(const Block& block, const YamlNode& node, const std::string& path,
                 const UnitSuffix& unit, Joint* joint);
  void WarnAboutGuess(const YamlNode& node, const std::string& path, const UnitSuffix& unit,
                      const Joint& joint, int k);
  void ReadJointRange(const Block& block, const YamlMap& map, Joint* joint);
  bool ReadFreeChoices(const YamlMap& map, Joint* joint);

  // model_signals.cc
  void ReadDrives(const Block& block);
  void ReadDrive(const Block& block, const YamlEntry& entry);
  std::optional<JointDrive> ReadJointDrive(const Block& block, const YamlMap& map);
  template <typename Line>
  bool ReadEnds(const Block& block, const YamlMap& map, Line* line);
  void ReadPrescribed(const Block& block);
  void ReadOutputs(const Block& block);
  void ReadSprings(const Block& block);
  void OrderDrives(const YamlNode& root);
  void CheckCoordinateNames();
  double ReadDriveStiffness(const Block& block, const YamlMap& map);

  // model_elastic.cc
  void ReadMaterials(const Block& block);
  void ReadMaterial(const Block& block, const YamlEntry& entry);
  void ReadSections(const Block& block);
  std::optional<Section> ReadSection(const Block& block, const YamlNode& node,
                                     const std::string& path);
  std::optional<Section> ReadRectangle(const Block& block, const YamlNode& node,
                                       const std::string& path);
  std::optional<bool> PrintedTorsion(const Block& block, const YamlMap& map);
  std::optional<double> Positive(const Block& block, const YamlMap& map, const std::string& key,
                                 std::initializer_list<UnitSuffix> units);
  template <typename T>
  std::optional<T> Described(const Block& block, const YamlMap& map, const std::string& key,
                             const std::map<std::string, std::optional<T>>& known);
  void ReadBeams(const Block& block);
  void ReadBeam(const Block& block, const YamlEntry& entry, const std::string& path, int body,
                const std::string& name);
  std::optional<Mat3> BeamAxes(const Block& block, const YamlMap& map, const Vec3& along,
                               const Section& section);

  // model_beam_checks.cc
  void CheckBeams();
  void CheckFrameOfBeams(int body);
  void CheckEndsOnBeams();
  bool IsOnBeamEnd(int body, const Vec3& p) const;

  // model_checks.cc
  void CheckMasses();
  void AddBodyFinding(Severity severity, size_t b, const std::string& text,
                      const std::string& hint);
  void CheckImpossibleInertia(size_t b, const std::string& violation);
  bool CheckTree();
  void CloseLoops();
  void WarnAboutAssembly(const HomeResult& home);
  void WarnAboutMovedDrives();
  bool ProjectRoundedData(const HomeResult& home);
  // model_relax.cc
  bool TakeNamedBalls();
  [[nodiscard]] std::string WhatWouldClose(const HomeResult& home) const;
  void ReportGaps(const HomeResult& home, const std::string& hint);
  void ReportTree(const SpanningTreeResult& tree);
  void CheckAxes(bool closed_at_home);
  void CheckHome();
  void CheckIsostaticRule();

  // model_plausibility.cc
  void CheckPlausible();
  void WarnAboutBody(int body, const std::string& text, const std::string& hint);
  void WarnAboutLengths(const std::vector<int>& thin, double extent_m);
  void WarnAboutGravity();

  // model_values.cc: one value each; empty after a finding.
  /// The value, or what LoadOptions::literals puts in its place.
  double LiteralAt(const std::string& place, double value);
  std::optional<double> Number(const Block& block, const YamlNode& node, const std::string& path,
                               const UnitSuffix& unit = kPlain);
  std::optional<Vec3> Vector(const Block& block, const YamlNode& node, const std::string& path,
                             const UnitSuffix& unit = kPlain);
  std::optional<double> Number(const Block& block, const YamlMap& map, const std::string& key,
                               std::initializer_list<UnitSuffix> units);
  std::optional<Vec3> Vector(const Block& block, const YamlMap& map, const std::string& key,
                             std::initializer_list<UnitSuffix> units);
  std::optional<Vec3> Axis(const Block& block, const YamlNode& node, const std::string& path);
  std::optional<Mat3> Rotation(const Block& block, const YamlNode& node, const std::string& path);
  std::optional<Mat3> RotationMatrix(const Block& block, const YamlNode& node,
                                     const std::string& path);
  std::optional<Mat3> RotationFromAxes(const Block& block, const YamlNode& node,
                                       const std::string& path);
  std::optional<Pose> PoseOf(const Block& block, const YamlNode& node, const std::string& path);
  std::optional<CoordinateRange> Range(const Block& block, const YamlNode& node,
                                       const std::string& path, const UnitSuffix& unit);

  // Names (model_values.cc). The resolvers look in the block, then outwards.
  bool CheckNewName(const YamlEntry& entry, const std::string& path);
  std::optional<int> BodyRef(const Block& block, const YamlNode& node, const std::string& path);
  std::optional<int> JointRef(const Block& block, const YamlNode& node, const std::string& path);
  std::optional<FrameRef> Frame(const Block& block, const YamlNode& node, const std::string& path);
  std::optional<Pose> FrameOn(const Block& block, int body, const std::string& name) const;
  /// False (after a finding, once) when a list has grown beyond `limit`.
  bool Room(const YamlNode& at, size_t size, size_t limit, const char* what);

  /// Young's and shear modulus [Pa].
  struct Material {
    double youngs = kNan, shear = kNan;
  };
  /// Another model file whose parameters this one takes.
  struct ParameterFile {
    YamlReader yaml;
    YamlNodePtr root;
  };

  YamlReader yaml_;
  const LoadOptions& options_;
  YamlNodePtr root_;
  std::deque<Scope> scopes_;  // stable addresses
  std::deque<Block> blocks_;  // blocks_[0] is the model itself
  Mechanism mechanism_;
  bool bare_urdf_ = false;  // the text stands for a URDF file
  bool impossible_inertia_allowed_ = false;
  double closure_tolerance_m_ = 0.0;            // up to which rounded data are projected
  ClosureHints hints_;                          // per joint
  std::vector<const YamlEntry*> body_places_;   // per body; null: the world, URDF links
  std::vector<const YamlEntry*> joint_places_;  // per joint
  std::vector<std::string> body_paths_;         // YAML path, or the URDF file
  std::set<std::string> refused_joints_;
  bool joints_good_ = true;  // false: the graph of joints is not worth checking
  struct SignalPlace {
    const char* what;  // "drive", …
    const YamlEntry* entry;
  };
  std::map<std::string, std::vector<SignalPlace>> signal_places_;
  // By full name; empty: badly described, which has its own finding.
  std::map<std::string, std::optional<Material>> materials_;
  std::map<std::string, std::optional<Section>> sections_;
  std::vector<const YamlEntry*> beam_places_;    // per beam
  bool beams_good_ = true;                       // false: their frame is not worth checking
  std::deque<ParameterFile> parameter_files_;    // stable addresses; innermost base first
  int urdf_root_ = -1;                           // body that needs a joint to the world
  std::map<std::string, FrameRef> urdf_frames_;  // links of the URDF that became frames
  std::map<std::string, Finding> urdf_places_;   // of the URDF's joints, closures included
  std::deque<YamlEntry> urdf_drives_;            // places of drives that a closure file names
  std::map<std::string, bool> override_used_;
  std::map<std::string, std::string> overridden_;  // full name of a parameter → name as given
  Diagnostics other_findings_;                     // of other files: overrides, URDF, parameters
  std::vector<std::string> known_parameters_;      // dotted names, for "did you mean"
  std::vector<Literal> literals_;
  std::set<std::string> literal_places_;
};

}  // namespace mbv
