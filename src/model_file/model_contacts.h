// `contacts` of a model file: feet on the ground. Internal to the model loader.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "mechanism/mechanism.h"
#include "model_file/model_joints.h"
#include "model_file/model_names.h"
#include "model_file/model_values.h"

namespace mbv::internal {

/// A contact as it is described: where it is on the foot, and on the ground if that is stated.
struct ContactPlan {
  Contact contact;
  bool holds = true;
  int foot = 0;
  Pose X_BM = Pose::Identity();    ///< on the foot; without a place its axes are the frame's
  std::optional<FrameRef> ground;  ///< frame F; empty: where the foot stands at home
  std::optional<Vec3> normal_W;    ///< of the ground, unit; empty: up
  Vec3 along_M = Vec3::UnitX();    ///< what becomes x, unit
  bool along_stated = false;
  Place place = {};
};

/// Reads contacts between known bodies. Those that state their place on the ground become joints at
/// once, the others by PlantContacts().
class ContactReader {
 public:
  /// `judged` reads what no witness computes with. `holding`: names of those that hold; empty: all.
  ContactReader(ModelValues* values, ModelValues* judged, const BodyNames& names,
                const std::optional<std::vector<std::string>>& holding, ModelJoints* joints,
                std::vector<ContactPlan>* plans)
      : values_(*values),
        judged_(*judged),
        names_(names),
        holding_(holding),
        joints_(*joints),
        plans_(*plans) {}

  void Read(const Block& block);
  /// What --plant names: "BODY", "BODY:KIND@x,y,z", or "{on: BODY, …}" as in the file.
  void ReadOption(const Block& model, const std::string& text);

 private:
  void ReadContact(const Block& block, const std::string& name, const std::string& path,
                   const YamlNode& node, Place place);
  bool ReadShape(const Block& block, const YamlMap& map, Contact* contact);
  bool ReadFriction(const Block& block, const YamlMap& map, Contact* contact);
  bool ReadGround(const Block& block, const YamlMap& map, ContactPlan* plan);

  ModelValues& values_;
  ModelValues& judged_;
  const BodyNames& names_;
  const std::optional<std::vector<std::string>>& holding_;
  ModelJoints& joints_;
  std::vector<ContactPlan>& plans_;
};

/// Puts feet without a stated place on the ground where they are at the mechanism's home pose:
/// their joints become loop closures that are closed there. `findings`: an error for each line that
/// points into the ground.
struct ContactFinding {
  Place place;
  std::string message, hint;
};
[[nodiscard]] std::vector<ContactFinding> PlantContacts(const std::vector<ContactPlan>& plans,
                                                        Mechanism* mechanism);

/// The keys that describe a contact but for its places, without braces.
[[nodiscard]] std::string ContactText(const Contact& contact);

}  // namespace mbv::internal
