#include "model_file/load_model.h"

#include <algorithm>
#include <utility>

#include "model_file/model_reader.h"
#include "model_file/urdf_model.h"

namespace mbv {
namespace {

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

}  // namespace

LoadResult ModelReader::Load(const std::string& text) {
  mechanism_.file = yaml_.file();
  mechanism_.bodies.push_back({.name = "world", .frames = {}, .shapes = {}});
  body_places_.push_back(nullptr);
  body_paths_.push_back("world");
  root_ = yaml_.Parse(text);
  if (root_ != nullptr) ReadAll();
  LoadResult result;
  result.diagnostics.Append(
      InFileOrder(bare_urdf_ ? WithoutPlaces(yaml_.diagnostics()) : yaml_.diagnostics()));
  result.diagnostics.Append(other_findings_);
  result.literals = std::move(literals_);
  if (!result.diagnostics.has_errors()) result.mechanism = std::move(mechanism_);
  return result;
}

void ModelReader::ReadAll() {
  blocks_.push_back({.node = root_.get(),
                     .scope = &scopes_.emplace_back(),
                     .path = "",
                     .prefix = "",
                     .levels = {""},
                     .parts = {}});
  ReadHead();
  if (!root_->is_map()) return;
  ExpandInstances(blocks_.front());
  CheckOverrides();

  // Each stage over all blocks, so that every name it refers to is there.
  using Stage = void (ModelReader::*)(const Block&);
  for (const Stage stage :
       {Stage{&ModelReader::ReadBodies}, Stage{&ModelReader::ReadAttachedFrames},
        Stage{&ModelReader::ReadShapes}, Stage{&ModelReader::ReadJoints},
        Stage{&ModelReader::ReadDrives}, Stage{&ModelReader::ReadPrescribed},
        Stage{&ModelReader::ReadOutputs}, Stage{&ModelReader::ReadSprings},
        Stage{&ModelReader::ReadMaterials}, Stage{&ModelReader::ReadSections},
        Stage{&ModelReader::ReadBeams}}) {
    for (const Block& block : blocks_) {
      yaml_.SetNote(block.Note());
      (this->*stage)(block);
    }
  }
  yaml_.SetNote("");
  WeldUrdfRoot();
  OrderDrives(*root_);
  CheckCoordinateNames();
  CheckMasses();
  CheckBeams();
  // With a broken joint, findings about the graph would only be its consequences; with a broken
  // number, those about the loops.
  if (!joints_good_ || !CheckTree()) return;
  if (yaml_.has_errors() || other_findings_.has_errors()) return;
  CloseLoops();
  if (yaml_.has_errors()) return;
  CheckHome();
  CheckIsostaticRule();
  CheckPlausible();
}

LoadResult LoadModelText(const std::string& text, const std::string& file,
                         const LoadOptions& options) {
  if (internal::IsUrdfFile(file)) {
    return ModelReader(file, options).LoadBareUrdf(internal::UrdfModelText(file, text));
  }
  return ModelReader(file, options).Load(text);
}

LoadResult LoadModel(const std::string& file, const LoadOptions& options) {
  YamlReader reader(file);
  const auto text = reader.ReadFile();
  if (!text) return {.mechanism = {}, .diagnostics = reader.diagnostics(), .literals = {}};
  return LoadModelText(*text, file, options);
}

}  // namespace mbv
