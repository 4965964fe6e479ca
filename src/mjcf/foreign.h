// MJCF files of others, made such as MuJoCo 2.2.2 compiles them from memory.
#pragma once

#include <filesystem>
#include <map>
#include <memory>
#include <string>
#include <utility>

#include "core/diagnostics.h"

namespace mbv::mjcf {

/// The two sites that a closure makes coincide, the first one on body1.
using SitePair = std::pair<std::string, std::string>;

/// An MJCF file on its way to the compiler. Included files are taken in; folders of assets become
/// absolute. What only serves pictures (mesh geoms of bodies that state their inertia, textures,
/// materials, meshes that nothing needs) is left out. Files outside the model's folder are refused.
/// What MuJoCo 3 says differently is translated: closures by two sites, ranges that hold without
/// being called limited.
class ForeignMjcf {
 public:
  ForeignMjcf(const std::string& text, const std::filesystem::path& file, Diagnostics* diagnostics);
  ~ForeignMjcf();
  ForeignMjcf(const ForeignMjcf&) = delete;
  ForeignMjcf& operator=(const ForeignMjcf&) = delete;

  /// False after an error.
  [[nodiscard]] bool ok() const;
  [[nodiscard]] std::string Text() const;
  [[nodiscard]] std::string ModelName() const;
  /// Closures by sites, by the equality's name: MuJoCo 2.2 would take their place from the pose of
  /// the file, where the sites may be apart.
  [[nodiscard]] const std::map<std::string, SitePair>& closures_by_sites() const;

  /// Removes what this compiler does not know, as its message says; one finding for each kind of
  /// thing. False if the message is about something else.
  [[nodiscard]] bool DropWhatIsUnknown(const std::string& message);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace mbv::mjcf
