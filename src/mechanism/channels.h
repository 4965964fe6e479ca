// Names of the channels that every witness records, so that traces can be matched by name.
#pragma once

#include <string>
#include <vector>

#include "core/trace.h"
#include "mechanism/mechanism.h"

namespace mbv {

/// DRIVE.position, .velocity, .acceleration, .force for every drive in model order.
[[nodiscard]] std::vector<Channel> DriveChannels(const Mechanism& mechanism);
/// OUTPUT.x, .y, .z [m], .roll, .pitch, .yaw [rad] for every output in model order.
[[nodiscard]] std::vector<Channel> OutputChannels(const Mechanism& mechanism);
/// PRESCRIBED.force for every prescribed joint: the base reaction along its coordinate.
[[nodiscard]] std::vector<Channel> PrescribedChannels(const Mechanism& mechanism);
/// JOINT.reaction.fx … .mz: wrench of the parent on the child through the joint (drive forces
/// excluded), about M's origin, in F's axes.
[[nodiscard]] std::vector<Channel> ReactionChannels(const Joint& joint);
/// closure.position [m], closure.rotation [rad]: largest loop gap;
/// power.input [W]: Σ drive + base + load power; power.energy_rate [W]: d/dt(kinetic + potential).
[[nodiscard]] std::vector<Channel> AuditChannels();
/// Free motion only: energy.kinetic and energy.potential [J] (gravity from the world's origin,
/// springs).
[[nodiscard]] std::vector<Channel> EnergyChannels();

}  // namespace mbv
