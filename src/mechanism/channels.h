// The channels that every witness records, so that traces can be matched.
#pragma once

#include <string>
#include <vector>

#include "math/trace.h"
#include "mechanism/mechanism.h"
#include "mechanism/motion.h"

namespace mbv {

/// DRIVE.position, .velocity, .acceleration, .force for every drive in model order.
[[nodiscard]] std::vector<Channel> DriveChannels(const Mechanism& mechanism);
/// OUTPUT.x, .y, .z [m], .roll, .pitch, .yaw [rad] for every output in model order.
[[nodiscard]] std::vector<Channel> OutputChannels(const Mechanism& mechanism);
/// The same of one output, whose reference frame is that of body `frame`.
[[nodiscard]] std::vector<Channel> PoseChannels(const std::string& output,
                                                const std::string& frame);
/// OUTPUT.x.velocity … OUTPUT.yaw.velocity, then OUTPUT.x.acceleration … OUTPUT.yaw.acceleration:
/// first and second time derivatives of the components of one output.
[[nodiscard]] std::vector<Channel> OutputRateChannels(const Mechanism& mechanism,
                                                      const Output& output);
/// COORDINATE.position of a joint's coordinate and, with `rates`, .velocity and .acceleration.
[[nodiscard]] std::vector<Channel> JointChannels(const Mechanism& mechanism,
                                                 const Coordinate& coordinate, bool rates);
/// PRESCRIBED.force for every prescribed joint: the base reaction along its coordinate.
[[nodiscard]] std::vector<Channel> PrescribedChannels(const Mechanism& mechanism);
/// DRIVE.force.band for every drive, then PRESCRIBED.force.band: half-width of the band around the
/// force (its middle) within which friction at rest leaves it; 0 where everything slides. Empty of
/// a mechanism without dry friction.
[[nodiscard]] std::vector<Channel> BandChannels(const Mechanism& mechanism);
/// JOINT.reaction.fx … .mz: wrench of the parent on the child through the joint (drive forces
/// excluded), about M's origin, in F's axes.
[[nodiscard]] std::vector<Channel> ReactionChannels(const Joint& joint);
/// closure.position [m], closure.rotation [rad]: largest loop gap;
/// power.input [W]: Σ drive + base + load power − damping; power.energy_rate [W]: d/dt(kinetic +
/// gravity + springs); then the parts of both that are not drives: power.base (prescribed joints),
/// power.loads, power.dampers (≤ 0), power.gravity, power.springs (what they put in).
[[nodiscard]] std::vector<Channel> AuditChannels();
/// energy.kinetic, energy.gravity (from the world's origin) and energy.springs [J].
[[nodiscard]] std::vector<Channel> EnergyChannels();
/// Where a witness integrates the motion: work since the start [J] as NAME.work for every drive,
/// then every prescribed joint, then loads.work and dampers.work.
[[nodiscard]] std::vector<Channel> WorkChannels(const Mechanism& mechanism);

// How much a witness records.

/// Channels (mechanism/channels.h) that a witness records of a motion at most.
[[nodiscard]] size_t MostChannels(const Mechanism& mechanism, const Motion& motion);

}  // namespace mbv
