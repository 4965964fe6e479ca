#include "model_file/load_model.h"

#include "model_file/load_bodies.h"

#include <algorithm>
#include <filesystem>
#include <utility>

#include "model_file/model_bodies.h"
#include "model_file/model_checks.h"
#include "model_file/model_couplings.h"
#include "model_file/model_drives.h"
#include "model_file/model_elastic.h"
#include "model_file/model_elements.h"
#include "model_file/model_head.h"
#include "model_file/model_instances.h"
#include "model_file/model_joints.h"
#include "model_file/model_legs.h"
#include "model_file/model_meshes.h"
#include "model_file/model_motors.h"
#include "model_file/model_outputs.h"
#include "model_file/model_shapes.h"
#include "model_file/model_urdf.h"
#include "model_file/urdf_model.h"

namespace mbv {
namespace {

using internal::Block;

// The stages find things in their own order; people read files from the top.
Diagnostics InFileOrder(const Diagnostics& diagnostics) {
  std::vector<Finding> findings = diagnostics.findings();
  std::stable_sort(findings.begin(), findings.end(), [](const Finding& a, const Finding& b) {
    const bool a_placed = a.line > 0, b_placed = b.line > 0;
    if (a_placed != b_placed) return a_placed;
    return std::pair(a.line, a.column) < std::pair(b.line, b.column);
  });
  Diagnostics sorted;
  for (Finding& finding : findings) sorted.Add(std::move(finding));
  return sorted;
}

// Places in a model file that nobody wrote.
Diagnostics WithoutPlaces(const Diagnostics& diagnostics) {
  Diagnostics result;
  for (Finding finding : diagnostics.findings()) {
    finding.line = finding.column = 0;
    result.Add(std::move(finding));
  }
  return result;
}

// One model file on its way to a mechanism: what every stage reads with, nothing that it reads.
struct Reading {
  const LoadOptions& options;
  bool bare_urdf = false;  // the text stands for a URDF file
  YamlReader yaml;
  Diagnostics others;  // findings of other files: overrides, URDF, parameters
  internal::Literals literals;
  std::vector<ModelCaveat> caveats;
};

// What the sections of a model give.
struct ModelSections {
  internal::ModelHead head;
  std::vector<Parameter> parameters;
  internal::ModelBodies bodies;
  internal::ModelJoints joints;
  internal::SignalPlaces signals;
  std::vector<Drive> drives;
  std::vector<Prescribed> prescribed;
  std::vector<Output> outputs;
  std::vector<SpringDamper> springs;
  std::vector<Coupling> couplings;
  std::vector<Motor> motors;
  std::vector<Bushing> bushings;
  std::vector<ForceElement> elements;
  internal::ModelBeams beams;
  internal::UrdfSection urdf;
};

// Bodies with all their frames.
template <typename EachBlock>
void ReadBodies(const EachBlock& each_block, const internal::BodyNames& names,
                internal::ModelValues* values, internal::UrdfReader* urdf, ModelSections* sections,
                Diagnostics* others) {
  internal::FrameReader frames(values, &sections->bodies);
  internal::BodyReader bodies(values, &frames, &sections->bodies);
  each_block([&](const Block& block) {
    if (block.is_model()) {
      frames.ReadWorld(block);
      if (const YamlNode* node = block.Section("urdf")) {
        sections->urdf = urdf->Read(block, *node,
                                    {.bodies = &sections->bodies,
                                     .joints = &sections->joints,
                                     .places = &sections->signals,
                                     .drives = &sections->drives,
                                     .couplings = &sections->couplings,
                                     .elements = &sections->elements});
      }
    }
    bodies.Read(block);
  });
  each_block([&](const Block& block) { frames.ReadAttached(block, names); });
  internal::ShapeReader shapes(values, names, &sections->bodies);
  each_block([&](const Block& block) { shapes.Read(block); });
  const Finding place{
      .severity = Severity::kWarning, .file = values->yaml().file(), .message = {}, .hint = {}};
  internal::LoadMeshes(std::filesystem::path(place.file).parent_path(), place,
                       &sections->bodies.bodies, others);
}

// What is driven and watched, springs and couplings.
template <typename EachBlock>
void ReadSignals(const EachBlock& each_block, const internal::BodyNames& names,
                 internal::ModelValues* values, ModelSections* s) {
  YamlReader* yaml = &values->yaml();
  internal::DriveReader drives(values, names, s->joints, &s->signals, &s->drives);
  each_block([&](const Block& block) { drives.Read(block); });
  each_block([&](const Block& block) {
    internal::ReadPrescribed(block, s->joints, yaml, &s->signals, &s->prescribed);
  });
  each_block([&](const Block& block) {
    internal::ReadOutputs(block, names, yaml, &s->signals, &s->outputs);
  });
  each_block([&](const Block& block) { internal::ReadSprings(block, names, values, &s->springs); });
  internal::CouplingReader couplings(values, s->joints, &s->signals, &s->couplings);
  each_block([&](const Block& block) { couplings.Read(block); });
  couplings.TakeScrews();
}

template <typename EachBlock>
void ReadElastic(const EachBlock& each_block, const internal::BodyNames& names,
                 internal::ModelValues* values, ModelSections* s) {
  internal::Materials materials;
  internal::Sections sections;
  each_block([&](const Block& block) { internal::ReadMaterials(block, values, &materials); });
  each_block([&](const Block& block) { internal::ReadSections(block, values, &sections); });
  internal::BeamReader beams(values, names, s->bodies, materials, sections, &s->beams);
  each_block([&](const Block& block) { beams.Read(block); });
}

// No witness reads a motor's numbers, so they are none of those that mutate bends.
void ReadMotors(const Block& model, YamlReader* yaml, ModelSections* s) {
  const std::map<std::string, double> none;
  internal::Literals unbent(none);
  internal::ModelValues values(yaml, &unbent);
  internal::ReadMotors(model, s->drives, s->joints.joints, &values, &s->motors);
}

// Empty after a finding that leaves nothing to read.
std::optional<ModelSections> ReadModel(const YamlNode& root, Reading* reading) {
  YamlReader& yaml = reading->yaml;
  const YamlMap file(&yaml, &root, "", internal::kModelKeys);
  if (!file.valid()) return {};
  ModelSections s;
  internal::ModelValues values(&yaml, &reading->literals);
  internal::ModelBlocks blocks(&root);
  internal::ParameterReader parameters(reading->options, &yaml, &reading->others);
  s.head = internal::ReadTitle(file, &yaml);
  parameters.ReadModel(blocks.model(), file);
  internal::ReadSurroundings(blocks.model(), file, reading->options.gravity_W, &values, &s.head);
  if (!root.is_map()) return {};
  internal::InstanceReader(root, &values, &parameters, &blocks).Expand(blocks.model());
  internal::ExpandLegs(&values, &blocks);
  parameters.CheckOverrides();
  s.parameters = parameters.Take();

  // Each stage over all blocks, so that every name it refers to is there.
  const auto each_block = [&](const auto& stage) {
    for (const Block& block : blocks.blocks) {
      yaml.SetNote(block.Note());
      stage(block);
    }
    yaml.SetNote("");
  };
  const internal::BodyNames names(s.bodies, &values);
  internal::UrdfReader urdf(reading->bare_urdf, &values, &reading->literals, &reading->others);
  ReadBodies(each_block, names, &values, &urdf, &s, &reading->others);
  // A URDF file may state gravity; the model file's word and the caller's go before it.
  if (s.urdf.gravity_W && root.Find("gravity") == nullptr && !reading->options.gravity_W) {
    s.head.gravity_W = *s.urdf.gravity_W;
    const double g = s.head.gravity_W.norm();
    if (g > 0.0 && root.Find("up") == nullptr) s.head.up_W = -s.head.gravity_W / g;
  }
  internal::JointReader joints(&values, names, s.bodies, &s.joints);
  each_block([&](const Block& block) { joints.Read(block); });
  ReadSignals(each_block, names, &values, &s);
  ReadElastic(each_block, names, &values, &s);
  urdf.WeldRoot(s.urdf.root, s.bodies, &s.joints);
  internal::OrderDrives(root, &yaml, &s.drives);
  ReadMotors(blocks.model(), &yaml, &s);
  internal::ElementReader elements(
      &values, {.names = names, .joints = s.joints, .drives = s.drives}, &s.bushings, &s.elements);
  each_block([&](const Block& block) { elements.Read(block); });
  s.signals.Check(&yaml);
  internal::CheckDrivenOnce(s.drives, s.prescribed, s.joints.joints, s.signals, &yaml);
  return s;
}

// The mechanism that the sections describe; their places stay.
Mechanism Assembled(const std::string& file, ModelSections* s) {
  Mechanism mechanism;
  mechanism.name = std::move(s->head.name);
  mechanism.file = file;
  mechanism.description = std::move(s->head.description);
  mechanism.gravity_W = s->head.gravity_W;
  mechanism.up_W = s->head.up_W;
  mechanism.parameters = std::move(s->parameters);
  mechanism.bodies = std::move(s->bodies.bodies);
  mechanism.joints = std::move(s->joints.joints);
  mechanism.drives = std::move(s->drives);
  mechanism.prescribed = std::move(s->prescribed);
  mechanism.outputs = std::move(s->outputs);
  mechanism.springs = std::move(s->springs);
  mechanism.couplings = std::move(s->couplings);
  mechanism.motors = std::move(s->motors);
  mechanism.bushings = std::move(s->bushings);
  mechanism.elements = std::move(s->elements);
  mechanism.beams = std::move(s->beams.beams);
  return mechanism;
}

// Checks the whole and solves its home pose.
void Check(const ModelSections& s, Reading* reading, Mechanism* mechanism) {
  const internal::ModelPlaces places{.bodies = s.bodies.places,
                                     .joints = s.joints.places,
                                     .beams = s.beams.places,
                                     .signals = s.signals,
                                     .urdf_joints = s.urdf.joints};
  internal::ModelReport report(places, &reading->yaml, &reading->others, &reading->caveats);
  internal::CheckMasses(*mechanism, s.head.impossible_inertia_allowed, &report);
  if (s.beams.good) internal::CheckBeams(*mechanism, &report);
  // With a broken joint, findings about the graph would only be its consequences; with a broken
  // number, those about the loops.
  if (!s.joints.good || !internal::CheckTree(s.joints.hints, mechanism, &report)) return;
  if (report.has_errors()) return;
  internal::CloseLoops({.tolerance_m = s.head.closure_tolerance_m,
                        .bare_urdf = reading->bare_urdf,
                        .assembly = reading->options.assembly,
                        .guessed = s.joints.guessed},
                       mechanism, &report);
  if (report.has_own_errors()) return;
  internal::CheckHome(*mechanism, &report);
  internal::CheckIsostaticRule(*mechanism, &report);
  internal::CheckPlausible(*mechanism, &report);
}

// What was found, in the order of the file.
Diagnostics FindingsOf(const Reading& reading) {
  const Diagnostics& own = reading.yaml.diagnostics();
  Diagnostics findings;
  findings.Append(InFileOrder(reading.bare_urdf ? WithoutPlaces(own) : own));
  findings.Append(reading.others);
  return findings;
}

Reading ReadingOf(const std::string& file, const LoadOptions& options) {
  return {.options = options,
          .bare_urdf = internal::IsUrdfFile(file),
          .yaml = YamlReader(file),
          .others = {},
          .literals = internal::Literals(options.literals),
          .caveats = {}};
}

// The model file that a text is or, of a URDF file, stands for.
std::string ModelFileText(const std::string& text, const std::string& file) {
  return internal::IsUrdfFile(file) ? internal::UrdfModelText(file, text) : text;
}

LoadResult LoadFrom(const std::string& text, Reading reading) {
  LoadResult result;
  std::optional<Mechanism> mechanism;
  const YamlNodePtr root = reading.yaml.Parse(text);
  if (auto sections = root == nullptr ? std::nullopt : ReadModel(*root, &reading)) {
    for (const auto* more : {&sections->head.left_out, &sections->urdf.left_out}) {
      reading.caveats.insert(reading.caveats.end(), more->begin(), more->end());
    }
    mechanism = Assembled(reading.yaml.file(), &*sections);
    Check(*sections, &reading, &*mechanism);
  }
  result.diagnostics = FindingsOf(reading);
  result.literals = reading.literals.Take();
  result.caveats = std::move(reading.caveats);
  if (!result.diagnostics.has_errors()) result.mechanism = std::move(mechanism);
  return result;
}

}  // namespace

LoadResult LoadModelText(const std::string& text, const std::string& file,
                         const LoadOptions& options) {
  return LoadFrom(ModelFileText(text, file), ReadingOf(file, options));
}

LoadedBodies LoadBodiesText(const std::string& text, const std::string& file) {
  const LoadOptions options;
  Reading reading = ReadingOf(file, options);
  const YamlNodePtr root = reading.yaml.Parse(ModelFileText(text, file));
  auto sections = root == nullptr ? std::nullopt : ReadModel(*root, &reading);
  LoadedBodies loaded{.bodies = {}, .diagnostics = FindingsOf(reading)};
  if (sections && !loaded.diagnostics.has_errors()) loaded.bodies = sections->bodies.bodies;
  return loaded;
}

LoadedBodies LoadBodies(const std::string& file) {
  YamlReader reader(file);
  const auto text = reader.ReadFile();
  if (!text) return {.bodies = {}, .diagnostics = reader.diagnostics()};
  return LoadBodiesText(*text, file);
}

LoadResult LoadModel(const std::string& file, const LoadOptions& options) {
  YamlReader reader(file);
  const auto text = reader.ReadFile();
  if (!text) {
    return {.mechanism = {}, .diagnostics = reader.diagnostics(), .literals = {}, .caveats = {}};
  }
  return LoadModelText(*text, file, options);
}

}  // namespace mbv
