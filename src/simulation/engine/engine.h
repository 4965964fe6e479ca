// MuJoCo handles: ownership, errors and warnings.
//
// MuJoCo reports errors through a process-wide handler that must not return; ours throws
// EngineError, which the top level of Simulate() turns into Stop::kEngineFailure. Warnings are
// collected in the log that is current on the calling thread.
#pragma once

#include <mujoco/mujoco.h>
#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

namespace mbv::simulation {

/// An error reported by MuJoCo. Never leaves this layer.
struct EngineError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// While it lives, MuJoCo's errors on this thread throw EngineError and its warnings are appended
/// to `warnings`. Sessions may nest.
class EngineSession {
 public:
  explicit EngineSession(std::vector<std::string>* warnings);
  ~EngineSession();
  EngineSession(const EngineSession&) = delete;
  EngineSession& operator=(const EngineSession&) = delete;

 private:
  std::vector<std::string>* const previous_;
};

struct ModelDeleter {
  void operator()(mjModel* m) const { mj_deleteModel(m); }
};
struct DataDeleter {
  void operator()(mjData* d) const { mj_deleteData(d); }
};
using ModelHandle = std::unique_ptr<mjModel, ModelDeleter>;
using DataHandle = std::unique_ptr<mjData, DataDeleter>;

/// Compiles MJCF text from memory. Throws EngineError with MuJoCo's message when it is refused;
/// what MuJoCo says about a model it accepts goes to the session's warnings.
[[nodiscard]] ModelHandle CompileMjcf(const std::string& text);
[[nodiscard]] DataHandle MakeData(const mjModel& m);

/// The object's name, or one like "body_3".
[[nodiscard]] std::string NameAt(const mjModel& m, mjtObj type, int id, const char* kind);

/// Index of a named object; throws EngineError when there is none.
[[nodiscard]] int IdOf(const mjModel& m, mjtObj type, const std::string& name);

}  // namespace mbv::simulation

// Version of the MuJoCo library in use.

namespace mbv {

/// "2.2.2": of the library that is loaded, not of the header.
[[nodiscard]] std::string EngineVersion();

}  // namespace mbv
