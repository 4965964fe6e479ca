// Pictures in the MJCF: geoms, materials, lights and ground. Nothing here acts on the motion.
#pragma once

#include "mechanism/mechanism.h"
#include "mjcf/writer.h"

namespace mbv::mjcf {

/// <asset> with the materials that the shapes name.
void WriteMaterials(const Mechanism& mechanism, XmlWriter* xml);
/// Lights and ground, inside <worldbody>; up is against gravity.
void WriteSurroundings(const Mechanism& mechanism, XmlWriter* xml);
/// The shapes of a body, inside its <body>.
void WriteShapes(const Body& body, XmlWriter* xml);

}  // namespace mbv::mjcf
