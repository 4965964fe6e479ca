// The sections of the MJCF beside its tree of bodies, each written whole. Internal to mjcf/.
#pragma once

#include "mechanism/mechanism.h"
#include "mesh/decimate.h"
#include "mjcf/mjcf.h"
#include "mjcf/plan.h"
#include "mjcf/writer.h"

namespace mbv::mjcf {

/// What sections are written from, and where to.
struct Sections {
  const Mechanism& mechanism;
  const MjcfOptions& options;
  const Plan& plan;
  const DrawnSurfaces& surfaces;  ///< of the meshes
  XmlWriter* xml;
};

/// Comment, <compiler>, <option>, <size>, <default> and what pictures need.
void WriteHead(const Sections& s);
/// Lines of distance drives, and springs.
void WriteTendons(const Sections& s);
/// Closures, and what can hold drives and prescribed joints.
void WriteEqualities(const Sections& s);
/// Drive positions and forces, gaps of closures, forces of split ones.
void WriteSensors(const Sections& s);

}  // namespace mbv::mjcf
