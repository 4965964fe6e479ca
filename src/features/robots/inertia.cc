// Mass properties of a robot against its meshes.

#include <fmt/format.h>
#include <algorithm>
#include <cmath>
#include <memory>
#include <string>
#include <vector>

#include "base/diagnostics.h"
#include "base/json_text.h"
#include "base/text.h"
#include "cli/cli.h"
#include "cli/files.h"
#include "cli/options.h"
#include "cli/terminal.h"
#include "model_file/mesh/inertia_diagnosis.h"
#include "report/document.h"
#include "scenario/find_model.h"
#include "verify/model_text.h"

namespace mbv {
namespace {

// What `mbverify inertia` reports: stated mass properties against those of meshes.

using Json = nlohmann::ordered_json;

std::string Known(double value, double factor, const char* format) {
  return std::isfinite(value) ? fmt::format(fmt::runtime(format), factor * value) : "-";
}

std::string WordsOf(const BodyInertia& body) {
  std::vector<std::string> words;
  for (const InertiaFinding& finding : body.findings) {
    const std::string word = WordOf(finding.mistake);
    if (!Contains(words, word)) words.push_back(word);
  }
  return words.empty() ? "sound" : Joined(words);
}

Json NumberJson(double value) { return std::isfinite(value) ? Json(value) : Json(nullptr); }

Json PointJson(const Vec3& p) { return {NumberJson(p.x()), NumberJson(p.y()), NumberJson(p.z())}; }

// xx, yy, zz, xy, xz, yz
Json TensorJson(const Mat3& I) {
  Json json = Json::array();
  for (const auto& [i, j] : {std::pair(0, 0), std::pair(1, 1), std::pair(2, 2), std::pair(0, 1),
                             std::pair(0, 2), std::pair(1, 2)}) {
    json.push_back(NumberJson(I(i, j)));
  }
  return json;
}

Json BodyJson(const BodyInertia& body) {
  Json findings = Json::array();
  for (const InertiaFinding& finding : body.findings) {
    findings.push_back(
        {{"mistake", WordOf(finding.mistake)}, {"text", finding.text}, {"hint", finding.hint}});
  }
  return {{"name", body.body},
          {"meshes", body.meshes},
          {"closed", std::isfinite(body.solid.amount)},
          {"mass_kg", body.mass},
          {"volume_m3", NumberJson(body.solid.amount)},
          {"density_kg_m3", NumberJson(body.density)},
          {"stated", {{"com_m", PointJson(body.p_stated)}, {"inertia", TensorJson(body.I_stated)}}},
          {"mesh",
           {{"com_m", PointJson(body.solid.p_cm)},
            {"inertia", TensorJson(body.mass * body.solid.G_cm)}}},
          {"com_off", NumberJson(body.centre_off)},
          {"inertia_off", NumberJson(body.tensor_off)},
          {"findings", std::move(findings)}};
}

// A row per body with meshes, then each finding with its hint.
std::string InertiaTable(const std::vector<BodyInertia>& bodies) {
  Table table{.columns = {Text("body"), Digits("mass kg"), Digits("volume cm³"), Digits("kg/m³"),
                          Digits("centre off mm"), Digits("tensor off"), Text("finding")}};
  std::string details;
  size_t bad = 0;
  for (const BodyInertia& body : bodies) {
    table.rows.push_back({Printable(body.body), fmt::format("{:.4g}", body.mass),
                          Known(body.solid.amount, 1e6, "{:.4g}"),
                          Known(body.density, 1.0, "{:.4g}"),
                          Known(body.centre_off * body.r_m, 1e3, "{:.3g}"),
                          Known(body.tensor_off, 100.0, "{:.1f} %"), WordsOf(body)});
    bad += body.findings.empty() ? 0 : 1;
    for (const InertiaFinding& finding : body.findings) {
      details += fmt::format("{}: {}: {}\n  hint: {}\n", Printable(body.body),
                             WordOf(finding.mistake), Printable(finding.text), finding.hint);
    }
  }
  return fmt::format("{}{}{}{} of {} bodies with meshes are sound\n", ToText(table, {.indent = ""}),
                     details.empty() ? "" : "\n", details, bodies.size() - bad, bodies.size());
}

// The same for programs, with centres and tensors; numbers that are not known are null.
std::string InertiaJson(const std::vector<BodyInertia>& bodies, const std::string& file) {
  Json json = {{"file", file},
               {"limit", kInertiaLimit},
               {"tensor_order", {"xx", "yy", "zz", "xy", "xz", "yz"}},
               {"bodies", Json::array()}};
  for (const BodyInertia& body : bodies) json["bodies"].push_back(BodyJson(body));
  return Dump(json, 1);
}

}  // namespace
struct InertiaCheck {
  std::vector<BodyInertia> bodies;  ///< with meshes, in the file's order
  Diagnostics diagnostics;          ///< errors: nothing was checked
  [[nodiscard]] bool sound() const;
};

bool InertiaCheck::sound() const {
  return std::all_of(bodies.begin(), bodies.end(),
                     [](const BodyInertia& body) { return body.findings.empty(); });
}

// `file`: anything LoadRobotBodies() takes. Loops need not close, and tensors may be impossible.
InertiaCheck CheckInertia(const std::string& file) {
  LoadedBodies loaded = LoadRobotBodies(file);
  InertiaCheck check{.bodies = {}, .diagnostics = std::move(loaded.diagnostics)};
  if (check.diagnostics.has_errors()) return check;
  for (const Body& body : loaded.bodies) {
    const bool has_mesh = std::any_of(body.shapes.begin(), body.shapes.end(), [](const Shape& s) {
      return std::holds_alternative<Mesh>(s.geometry);
    });
    if (has_mesh && body.name != "world") check.bodies.push_back(DiagnoseInertia(body));
  }
  if (check.bodies.empty()) {
    check.diagnostics.Add({Severity::kError, file, 0, 0,
                           "no body has a mesh to compare its mass properties with",
                           "meshes stand in <visual> of URDF, geoms of MJCF, `shapes` of models"});
  }
  return check;
}

// mbverify inertia

namespace {

struct InertiaArguments {
  std::string model;
  JsonOption json;
};

int Inertia(const InertiaArguments& arguments) {
  const auto file = FindModelOrRefuse(arguments.model);
  if (!file) return 2;
  const InputWatch inputs;
  const InertiaCheck check = CheckInertia(*file);
  SayText(stderr, check.diagnostics.Text());
  if (check.diagnostics.has_errors()) return 2;
  SayText(arguments.json.text(), InertiaTable(check.bodies));
  return WorseExit(check.sound() ? 0 : 1,
                   arguments.json.Write(InertiaJson(check.bodies, *file), inputs.files()));
}

}  // namespace

void AddInertiaCommand(CLI::App* app, int* exit_code) {
  auto arguments = std::make_shared<InertiaArguments>();
  CLI::App* inertia = app->add_subcommand(
      "inertia", "Stated masses, centres and tensors against meshes: names the usual mistakes");
  inertia
      ->add_option("model", arguments->model,
                   "model name, model.yaml, .urdf, MJCF (.xml) or .sdf file")
      ->required();
  arguments->json.AddTo(inertia);
  SetFooter(inertia, {"inertia my_robot.urdf", "inertia my_robot.urdf --package arm=../arm_ws/arm"},
            "0 sound, 1 findings, 2 bad input");
  inertia->callback([arguments, exit_code] { *exit_code = Inertia(*arguments); });
}

}  // namespace mbv
