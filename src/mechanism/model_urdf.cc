// The `urdf:` key of a model file.
#include "mechanism/model_reader.h"

namespace mbv {

void ModelReader::ImportUrdf(const YamlNode& node) {
  yaml_.Error(node, "urdf: reading URDF files is not available");
}

}  // namespace mbv
