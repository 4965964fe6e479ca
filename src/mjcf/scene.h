// Pictures in the MJCF: geoms, materials, lights and ground. Nothing here acts on the motion.
#pragma once

#include "mechanism/mechanism.h"
#include "mesh/decimate.h"
#include "mjcf/writer.h"

namespace mbv::mjcf {

/// Triangles of all meshes in a file together: others decimate them as they like.
inline constexpr size_t kMostTriangles = 20000;

/// <asset> with the materials that the shapes name, and the meshes as numbers, so that the file
/// needs no other.
void WriteAssets(const Mechanism& mechanism, const DrawnSurfaces& surfaces, XmlWriter* xml);
/// Lights and ground, inside <worldbody>; up is against gravity.
void WriteSurroundings(const Mechanism& mechanism, XmlWriter* xml);
/// The shapes of a body, inside its <body>.
void WriteShapes(const Body& body, const DrawnSurfaces& surfaces, XmlWriter* xml);

}  // namespace mbv::mjcf
