#include "comparison/not_compared.h"

#include <algorithm>

#include "comparison/drive_motion.h"
#include "comparison/driven.h"
#include "comparison/table_tube.h"
#include "mechanism/channels.h"

namespace mbv {
namespace {

// Quantities that one would expect to be judged but that the traces do not hold.
void AddMissingNotes(const ComparisonInput& input, Comparison* comparison) {
  const auto note = [&](const std::string& what, const char* why) {
    comparison->not_compared.push_back({what, why});
  };
  for (const PairComparison& pair : comparison->pairs) {
    if (!pair.compared) continue;
    if (!input.mechanism->outputs.empty() && !pair.metrics.contains(Metric::kPoseM)) {
      note(pair.name() + ".pose", "the outputs are not recorded by both");
    }
    if (pair.reactions.empty()) {
      note(pair.name() + ".reaction", "no unique joint reaction is recorded by both");
    }
  }
  for (const WitnessMetrics& witness : comparison->witnesses) {
    const Role* role = FindRole(witness.witness);
    if (role != nullptr && !role->has_bodies()) continue;
    if (IsTable(input, witness.witness)) continue;
    if (!witness.metrics.contains(Metric::kClosureM))
      note(witness.witness + ".closure", "not recorded");
    if (!witness.metrics.contains(Metric::kPower)) note(witness.witness + ".power", "not recorded");
    if (IsEngine(witness.witness) && IsTaskSpace(*input.motion) &&
        !witness.metrics.contains(Metric::kCommandVelocity)) {
      note(witness.witness + "." + RowOf(Metric::kCommandVelocity).key,
           "the rates of the commanded outputs are not recorded");
    }
  }
  for (const Witness& witness : input.witnesses) {
    if (!witness.foreign) continue;
    for (const auto& [what, why] : witness.foreign->declined) {
      note(witness.name + ": " + what, why.c_str());
    }
  }
  for (const WitnessMetrics& witness : comparison->witnesses) {
    if (witness.derivatives_gap.empty()) continue;
    note(witness.witness + ".derivatives", witness.derivatives_gap.c_str());
  }
}

// Reaction components that statics leaves open, joint by joint: "hinge.reaction (fz, mx, my)".
void AddReactionNotes(const ComparisonInput& input, Comparison* comparison) {
  for (const Joint& joint : input.mechanism->joints) {
    std::string components;
    size_t count = 0;
    for (const Channel& channel : ReactionChannels(joint)) {
      const auto& open = input.reactions_not_unique;
      if (std::find(open.begin(), open.end(), channel.name) == open.end()) continue;
      components += (count++ == 0 ? "" : ", ") + SignalWord(channel);
    }
    if (count == 0) continue;
    comparison->not_compared.push_back(
        {ChannelName(Quantity::kReaction, joint.name) + (count == 6 ? "" : " (" + components + ")"),
         "statics alone does not determine it (redundant constraints)"});
  }
}

// Prescribed motion is imposed; no witness records it as a signal.
void AddCommandNotes(const ComparisonInput& input, Comparison* comparison) {
  for (const Command& command : input.motion->commands) {
    for (const Command::Term& term : command.terms) {
      if (term.coordinate.kind != Coordinate::Kind::kPrescribed) continue;
      comparison->not_compared.push_back(
          {command.name, "a prescribed joint's motion is an input and is not measured back"});
    }
  }
}

// Given forces are the same in every witness.
void AddForceNotes(const ComparisonInput& input, Comparison* comparison) {
  if (input.drive_by == DriveBy::kForces) {
    comparison->not_compared.push_back(
        {role::kSimulated.name + std::string(" drive forces"),
         "they are the " + input.driven_by + " forces; the motion that they cause is compared"});
  }
  for (const DriveForce& force : input.motion->forces) {
    const std::string& drive = input.mechanism->drives[force.drive].name;
    comparison->not_compared.push_back({ChannelName(Quantity::kForce, drive),
                                        "it is given by the scenario; the motion it causes is "
                                        "compared"});
  }
}

}  // namespace

void AddNotCompared(const ComparisonInput& input, Comparison* comparison) {
  AddMissingNotes(input, comparison);
  AddReactionNotes(input, comparison);
  AddCommandNotes(input, comparison);
  AddForceNotes(input, comparison);
}

}  // namespace mbv
