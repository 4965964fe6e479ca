#include "verify/check_file.h"

#include <cstdlib>

#include "analytic/closed_form.h"
#include "base/demand.h"
#include "external/mechanism_json.h"
#include "model_file/load_model.h"
#include "model_file/yaml/yaml_reader.h"
#include "verify/model_text.h"
#include "verify/prepare.h"

namespace mbv {
namespace {

std::span<const DocumentKind> g_kinds;

// The node of a path, or the last one that there is on the way.
const YamlNode& NodeAt(const YamlNode& root, const std::vector<std::string>& path) {
  const YamlNode* at = &root;
  for (const std::string& step : path) {
    const YamlNode* next = at->Find(step);
    if (at->is_sequence()) {
      const size_t index = std::strtoul(step.c_str(), nullptr, 10);
      next = index < at->items.size() ? at->items[index].get() : nullptr;
    }
    if (next == nullptr) break;
    at = next;
  }
  return *at;
}

}  // namespace

void UseDocumentKinds(std::span<const DocumentKind> kinds) { g_kinds = kinds; }

const DocumentKind& KindOf(const std::string& file) {
  MBV_DEMAND(!g_kinds.empty(), file);
  const ScenarioHead head = file.ends_with(".json") ? ScenarioHead{} : ReadScenarioHead(file);
  for (const DocumentKind& kind : g_kinds.first(g_kinds.size() - 1)) {
    if (kind.is(file, head)) return kind;
  }
  return g_kinds.back();
}

std::optional<Mechanism> MotionMechanism(const std::string& file, const ScenarioOptions& options,
                                         Diagnostics* diagnostics) {
  std::vector<Prepared> phases = PreparePhases(file, options, diagnostics);
  return phases.empty() ? std::nullopt : std::optional(std::move(phases.front().base));
}

bool IsMechanismJson(const std::string& file, const ScenarioHead& /*head*/) {
  return file.ends_with(".json");
}

Diagnostics CheckMechanismFile(const std::string& file) {
  YamlReader reader(file), places(file);
  const auto text = reader.ReadFile();
  if (!text) return reader.diagnostics();
  const std::vector<JsonFinding> findings = CheckMechanismJson(*text);
  const YamlNodePtr root = findings.empty() ? nullptr : places.Parse(*text);
  for (const JsonFinding& finding : findings) {
    const std::string path = PathText(finding.path);
    const std::string message = (path.empty() ? "" : path + ": ") + finding.message;
    if (finding.line > 0 || !root) {
      reader.AddAt(Severity::kError, finding.line, finding.column, message, finding.hint);
    } else {
      reader.Error(NodeAt(*root, finding.path), message, finding.hint);
    }
  }
  return reader.diagnostics();
}

Diagnostics CheckModel(const std::string& file) {
  LoadResult loaded = LoadRobot(file);
  if (!loaded.mechanism) return std::move(loaded.diagnostics);
  for (Finding& finding : FindUncovered(*loaded.mechanism)) {
    finding.file = file;
    finding.message = "the closed form will not be applicable: " + finding.message;
    loaded.diagnostics.Add(std::move(finding));
  }
  return std::move(loaded.diagnostics);
}

Diagnostics CheckScenario(const std::string& file) {
  Diagnostics diagnostics;
  (void)PreparePhases(file, {}, &diagnostics, {.none = true});  // checking runs nothing
  return diagnostics;
}

}  // namespace mbv
