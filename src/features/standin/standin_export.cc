#include "features/standin/standin.h"

#include <fmt/format.h>
#include <algorithm>
#include <cmath>
#include <random>

#include "base/files.h"
#include "base/scratch_folder.h"
#include "kinematics/command_rank.h"
#include "mechanism/joint_pose.h"
#include "mechanism/spanning_tree.h"
#include "model_file/load_model.h"
#include "model_file/urdf/urdf_import.h"
#include "reference/reduced_model.h"
#include "verify/model_text.h"

namespace mbv {
namespace {

constexpr size_t kJudged = 200;    // states of a serial file
constexpr size_t kStates = 10000;  // of the code

// Indices after some of a list are left out: −1 for these.
std::vector<int> Numbered(const std::vector<bool>& kept) {
  std::vector<int> number(kept.size(), -1);
  int next = 0;
  for (size_t i = 0; i < kept.size(); ++i) {
    if (kept[i]) number[i] = next++;
  }
  return number;
}

// Keeps the items for which take(item) is true; it may change them.
template <typename T, typename Take>
void KeepOnly(std::vector<T>* items, const Take& take) {
  std::vector<T> kept;
  for (T& item : *items) {
    if (take(&item)) kept.push_back(std::move(item));
  }
  *items = std::move(kept);
}

// The same coordinates in a mechanism that was written and read: names may have become such as its
// format has.
std::optional<std::vector<Coordinate>> SameCoordinates(const Mechanism& mechanism,
                                                       const std::vector<NamedCoordinate>& names,
                                                       std::string* missing) {
  const std::vector<NamedCoordinate> all = NamedMotionCoordinates(mechanism);
  std::vector<Coordinate> found;
  for (const NamedCoordinate& named : names) {
    std::string plain = named.name;
    std::ranges::replace(plain, '.', '_');
    const auto at = std::ranges::find_if(all, [&](const NamedCoordinate& one) {
      return one.name == named.name || one.name == plain;
    });
    if (at == all.end()) {
      *missing = named.name;
      return std::nullopt;
    }
    found.push_back(at->coordinate);
  }
  return found;
}

// Of the file's content against `serial` with armature.
SerialFile JudgeSerial(const std::string& name, const std::string& text,
                       const std::string& companion, const Mechanism& serial,
                       const Transmission& transmission, const StandinResult& result) {
  SerialFile file{.name = name};
  const ScratchFolder folder("standin");
  file.not_judged = folder.trouble();
  if (!file.not_judged.empty()) return file;
  const std::filesystem::path path = folder.path() / name;
  file.not_judged = WriteFile(path, text);
  if (file.not_judged.empty() && !companion.empty()) {
    file.not_judged = WriteFile(UrdfCompanionPath(path.string()), companion);
  }
  if (!file.not_judged.empty()) return file;
  const LoadResult loaded = LoadRobot(path.string(), {});
  if (!loaded.mechanism) {
    for (const Finding& finding : loaded.diagnostics.findings()) {
      if (finding.severity == Severity::kError) file.not_judged = "read back: " + finding.message;
    }
    return file;
  }
  // By the chosen joints' drives: formats may cut a joint in parts.
  const size_t joints = transmission.joints.size();
  const auto n = static_cast<Eigen::Index>(joints);
  std::vector<NamedCoordinate> names;
  for (size_t d = serial.drives.size() - joints; d < serial.drives.size(); ++d) {
    names.push_back({serial.drives[d].name, {Coordinate::Kind::kDrive, static_cast<int>(d), 0}});
  }
  // What is held in the loop may not exist in the serial robot.
  std::vector<Coordinate> own, theirs;
  std::string missing;
  const std::vector<NamedCoordinate> in_serial = NamedMotionCoordinates(serial);
  for (const NamedCoordinate& held : transmission.held) {
    if (std::ranges::find(in_serial, held.name, &NamedCoordinate::name) != in_serial.end()) {
      names.push_back(held);
    }
  }
  for (const auto& [mechanism, to] :
       {std::pair(&serial, &own), std::pair(&*loaded.mechanism, &theirs)}) {
    const auto same = SameCoordinates(*mechanism, names, &missing);
    if (!same) {
      file.not_judged = "it has no coordinate '" + missing + "'";
      return file;
    }
    *to = *same;
    if (const CoordinateChoice choice = ChooseCoordinates(*mechanism, *to, to->size());
        choice.chosen.size() != to->size() || choice.left() != 0) {
      file.not_judged = "its degrees of freedom are others";
      return file;
    }
  }
  ReducedModel a(serial, own), b(*loaded.mechanism, theirs);
  std::mt19937_64 random(1);  // NOLINT(cert-msc51-cpp): the same each time
  std::uniform_real_distribution<double> one(-1.0, 1.0);
  double worst = 0.0, largest = 0.0;
  for (size_t i = 0; i < kJudged; ++i) {
    VecX q = a.home(), v = VecX::Zero(q.size()), dv = v;
    for (Eigen::Index k = 0; k < n; ++k) {
      const StandinRange& range = result.ranges[static_cast<size_t>(k)];
      q[k] = range.low + 0.5 * (one(random) + 1.0) * (range.high - range.low);
      v[k] = one(random);
      dv[k] = 10.0 * one(random);
    }
    VecX forces[2];
    for (int m = 0; m < 2; ++m) {
      ReducedModel& model = m == 0 ? a : b;
      MatX T;
      RunSummary summary = model.Move(q, v, dv);
      if (summary.ok()) summary = model.Motions(&T);
      if (!summary.ok()) {
        file.not_judged = summary.message;
        return file;
      }
      forces[m] = model.Forces(T, {}).head(n);
    }
    worst = std::max(worst, (forces[0] - forces[1]).cwiseAbs().maxCoeff());
    largest = std::max(largest, forces[0].cwiseAbs().maxCoeff());
  }
  file.difference = largest > 0.0 ? worst / largest : worst;
  return file;
}

}  // namespace

Mechanism SerialRobot(const Transmission& transmission, const VecX& armature) {
  Mechanism robot = transmission.serial;
  std::vector<bool> body_kept(robot.bodies.size(), true);
  for (const int b : transmission.loop_bodies) body_kept[static_cast<size_t>(b)] = false;
  const std::vector<int> body = Numbered(body_kept);
  const auto rename_body = [&](int* index) {
    *index = body[static_cast<size_t>(*index)];
    return *index >= 0;
  };
  std::vector<bool> joint_kept;
  for (const Joint& joint : robot.joints) {
    joint_kept.push_back(body_kept[static_cast<size_t>(joint.parent)] &&
                         body_kept[static_cast<size_t>(joint.child)]);
  }
  const std::vector<int> joint = Numbered(joint_kept);
  const auto rename_joint = [&](int* index) {
    *index = joint[static_cast<size_t>(*index)];
    return *index >= 0;
  };
  std::vector<bool> drive_kept;
  for (size_t d = 0; d < robot.drives.size(); ++d) {
    const Drive& drive = robot.drives[d];
    bool kept =
        std::ranges::find(transmission.drives, static_cast<int>(d)) == transmission.drives.end();
    if (const auto* on = std::get_if<JointDrive>(&drive.kind)) {
      kept = kept && joint_kept[static_cast<size_t>(on->joint)];
    } else {
      const auto& leg = std::get<DistanceDrive>(drive.kind);
      kept = kept && body_kept[static_cast<size_t>(leg.body_from)] &&
             body_kept[static_cast<size_t>(leg.body_to)];
    }
    drive_kept.push_back(kept);
  }
  const std::vector<int> drive = Numbered(drive_kept);
  std::vector<bool> bushing_kept;
  for (const Bushing& bushing : robot.bushings) {
    bushing_kept.push_back(body_kept[static_cast<size_t>(bushing.parent)] &&
                           body_kept[static_cast<size_t>(bushing.child)]);
  }
  const std::vector<int> bushing = Numbered(bushing_kept);

  KeepOnly(&robot.joints,
           [&](Joint* at) { return rename_body(&at->parent) && rename_body(&at->child); });
  KeepOnly(&robot.prescribed, [&](Prescribed* at) { return rename_joint(&at->joint); });
  KeepOnly(&robot.outputs,
           [&](Output* at) { return rename_body(&at->body) && rename_body(&at->reference_body); });
  EraseSprings(&robot, [&](SpringDamper& at) {
    return !rename_body(&at.body_from) || !rename_body(&at.body_to);
  });
  KeepOnly(&robot.couplings, [&](Coupling* at) {
    return std::ranges::all_of(at->terms,
                               [&](Coupling::Term& term) { return rename_joint(&term.joint); });
  });
  KeepOnly(&robot.bushings,
           [&](Bushing* at) { return rename_body(&at->parent) && rename_body(&at->child); });
  KeepOnly(&robot.contacts, [&](Contact* at) { return at->joint < 0 || rename_joint(&at->joint); });
  KeepOnly(&robot.elements, [&](ForceElement* at) {
    if (at->joint >= 0 && !rename_joint(&at->joint)) return false;
    if (at->drive >= 0 && (at->drive = drive[static_cast<size_t>(at->drive)]) < 0) return false;
    if (at->bushing >= 0 && (at->bushing = bushing[static_cast<size_t>(at->bushing)]) < 0) {
      return false;
    }
    return true;
  });
  size_t d = 0;
  KeepOnly(&robot.drives, [&](Drive* at) {
    if (!drive_kept[d++]) return false;
    if (auto* on = std::get_if<JointDrive>(&at->kind)) return rename_joint(&on->joint);
    auto& leg = std::get<DistanceDrive>(at->kind);
    return rename_body(&leg.body_from) && rename_body(&leg.body_to);
  });
  for (size_t k = 0; k < transmission.joints.size(); ++k) {
    const NamedCoordinate& chosen = transmission.joints[k];
    int on = chosen.coordinate.index;
    if (!rename_joint(&on)) continue;
    std::string name = chosen.name;
    std::ranges::replace(name, '.', '_');
    while (robot.FindDrive(name) >= 0) name += "_joint";
    const int c = chosen.coordinate.component;
    robot.drives.push_back(
        {.name = name,
         .kind = JointDrive{on, c},
         .range = robot.joints[static_cast<size_t>(on)].range[static_cast<size_t>(c)]});
    robot.elements.push_back({.name = name + " armature",
                              .joint = on,
                              .coordinate = c,
                              .law = RotorLaw{.inertia = armature[static_cast<Eigen::Index>(k)]}});
  }
  std::vector<Pose> home;
  size_t b = 0;
  KeepOnly(&robot.bodies, [&](Body* /*at*/) {
    if (body_kept[b]) home.push_back(robot.X_WB_home[b]);
    return static_cast<bool>(body_kept[b++]);
  });
  robot.X_WB_home = std::move(home);
  robot.motors.clear();
  robot.beams.clear();
  robot.parameters.clear();
  robot.description = "Serial stand-in, made by mbverify";
  (void)BuildSpanningTree(&robot);
  return robot;
}

bool StandinExport::agrees() const {
  return code.agrees() && std::ranges::all_of(serial, [](const SerialFile& file) {
           return !file.not_judged.empty() || file.agrees();
         });
}

StandinExport ExportStandin(const Mechanism& mechanism, const StandinResult& result,
                            const std::string& name, const std::function<void(double)>& progress) {
  StandinExport made;
  Diagnostics found;
  const std::optional<Transmission> transmission =
      FindTransmission(mechanism, result.joints, &found);
  if (!transmission) {
    made.code.diagnostics = found;
    return made;
  }
  // What the serial model leaves out: loop bodies, rotors, and forces of the loops.
  Mechanism rest = transmission->full;
  std::vector<bool> in_loop(rest.bodies.size(), false);
  for (const int b : transmission->loop_bodies) in_loop[static_cast<size_t>(b)] = true;
  for (size_t b = 0; b < rest.bodies.size(); ++b) {
    if (in_loop[b]) continue;
    rest.bodies[b].mass = 0.0;
    rest.bodies[b].I_Bcm_B.setZero();
  }
  const auto without = [](auto* items, const auto& others) {
    std::erase_if(*items, [&](const auto& item) {
      return std::ranges::any_of(others,
                                 [&](const auto& other) { return other.name == item.name; });
    });
  };
  without(&rest.elements, transmission->serial.elements);
  EraseSprings(&rest, [&](const SpringDamper& spring) {
    return std::ranges::any_of(transmission->serial.springs, [&](const SpringDamper& other) {
      return other.name == spring.name;
    });
  });
  CodeTask task{.coordinates = transmission->joints,
                .held = transmission->held,
                .whole = &transmission->full,
                .given = &transmission->serial};
  for (const int d : transmission->drives) {
    task.actuators.push_back(
        {mechanism.drives[static_cast<size_t>(d)].name, {Coordinate::Kind::kDrive, d, 0}});
  }
  CodeSettings settings{.name = name, .states = kStates, .origin = mechanism.file};
  for (const StandinRange& range : result.ranges) {
    settings.ranges.push_back({range.joint, range.low, range.high});
  }
  made.code = MakeCode(rest, task, settings, progress);
  if (made.code.diagnostics.has_errors()) {
    // Without a table: from the pose at hand.
    settings.ranges.clear();
    const Diagnostics why = made.code.diagnostics;
    made.code = MakeCode(rest, task, settings, progress);
    for (const Finding& finding : why.findings()) made.code.notes.push_back(finding.message);
  }
  made.files = made.code.files;
  const Mechanism serial = SerialRobot(*transmission, result.armature);
  const MjcfText mjcf = MjcfFor(serial, ModelDrives::kFree);
  const auto add = [&](const std::string& file, const std::string& text,
                       const std::string& companion, const std::string& trouble) {
    if (!trouble.empty()) {
      made.serial.push_back({.name = file, .not_judged = trouble});
      return;
    }
    made.files.emplace_back(file, text);
    if (!companion.empty()) made.files.emplace_back(UrdfCompanionPath(file), companion);
    made.serial.push_back(JudgeSerial(file, text, companion, serial, *transmission, result));
  };
  add(name + "_serial.xml", mjcf.text, "", mjcf.trouble);
  const std::string urdf = name + "_serial.urdf";
  add(urdf, WriteUrdf(serial), WriteUrdfCompanion(serial, urdf), "");
  return made;
}

std::string ToText(const StandinExport& made) {
  std::string text =
      "\nWhat replaces the loop (serial model and code together need the full loop's "
      "motor forces)\n" +
      ToText(made.code);
  for (const SerialFile& file : made.serial) {
    text +=
        file.not_judged.empty()
            ? fmt::format("{}: {}, forces along the joints {:.2g} (limit {:.0e})\n", file.name,
                          file.agrees() ? "agrees" : "DIFFERS", file.difference, SerialFile::kLimit)
            : fmt::format("{}: not judged: {}\n", file.name, file.not_judged);
  }
  return text;
}

nlohmann::ordered_json ToJson(const StandinExport& made, const std::string& model) {
  nlohmann::ordered_json json = ToJson(made.code, model);
  json["agrees"] = made.agrees();
  json["serial"] = nlohmann::ordered_json::array();
  for (const SerialFile& file : made.serial) {
    json["serial"].push_back(
        {{"file", file.name},
         {"not_judged", file.not_judged},
         {"difference", std::isfinite(file.difference) ? nlohmann::ordered_json(file.difference)
                                                       : nlohmann::ordered_json(nullptr)}});
  }
  return json;
}

}  // namespace mbv
