// What replaces a hand-written stand-in, each with its verdict: code of the transmission and of
// what the serial model leaves out, a lookup table with bounds, and the serial robot as MJCF and
// URDF.
//
//   τ_m = J⁻ᵀ (τ_s + f_l + f_r)                                                             (1)
// τ_s: forces along the joints that the serial model needs; f_l + f_r: of loop bodies and rotors,
// in the code. With (1) nothing is left out.
#pragma once

#include <functional>
#include <string>
#include <utility>
#include <vector>

#include "features/code/code.h"
#include "features/standin/standin.h"

namespace mbv {

/// A file of the serial robot, read back as its users would.
struct SerialFile {
  std::string name;
  std::string not_judged = {};  ///< why; "": it was
  /// Largest difference of the forces along the joints from the serial model's with the best
  /// constant armature, by their largest value.
  double difference = kNan;

  static constexpr double kLimit = 1e-9;
  [[nodiscard]] bool agrees() const { return not_judged.empty() && difference <= kLimit; }
};

struct StandinExport {
  CodeResult code;  ///< its judgements are those of (1) against the full loop
  std::vector<SerialFile> serial;
  std::vector<std::pair<std::string, std::string>> files;  ///< name, content

  [[nodiscard]] bool agrees() const;
};

/// The robot without its loop bodies: the chosen joints are driven, with `armature` [kg m² or kg]
/// each.
[[nodiscard]] Mechanism SerialRobot(const Transmission& transmission, const VecX& armature);

/// `name`: of the files.
[[nodiscard]] StandinExport ExportStandin(const Mechanism& mechanism, const StandinResult& result,
                                          const std::string& name,
                                          const std::function<void(double)>& progress = {});

[[nodiscard]] std::string ToText(const StandinExport& made);
[[nodiscard]] nlohmann::ordered_json ToJson(const StandinExport& made, const std::string& model);

}  // namespace mbv
