#include "simulation/engine/engine.h"

#include <mujoco/mujoco.h>
#include <array>

namespace mbv::simulation {
namespace {

thread_local std::vector<std::string>* current_warnings = nullptr;

[[noreturn]] void OnError(const char* message) { throw EngineError(message); }

void OnWarning(const char* message) {
  if (current_warnings != nullptr) current_warnings->emplace_back(message);
}

}  // namespace

EngineSession::EngineSession(std::vector<std::string>* warnings) : previous_(current_warnings) {
  mju_user_error = OnError;
  mju_user_warning = OnWarning;
  current_warnings = warnings;
}

EngineSession::~EngineSession() { current_warnings = previous_; }

ModelHandle CompileMjcf(const std::string& text) {
  // The virtual file system is large: keep it off the stack.
  const auto vfs = std::make_unique<mjVFS>();
  mj_defaultVFS(vfs.get());
  const char* name = "model.xml";
  if (mj_makeEmptyFileVFS(vfs.get(), name, static_cast<int>(text.size())) != 0) {
    throw EngineError("no room for the model text");
  }
  text.copy(static_cast<char*>(vfs->filedata[vfs->nfile - 1]), text.size());
  std::array<char, 1000> message{};
  ModelHandle model(mj_loadXML(name, vfs.get(), message.data(), static_cast<int>(message.size())));
  mj_deleteVFS(vfs.get());
  if (model == nullptr) throw EngineError(message.data());
  if (message[0] != '\0') OnWarning(message.data());
  return model;
}

DataHandle MakeData(const mjModel& m) {
  DataHandle data(mj_makeData(&m));
  if (data == nullptr) throw EngineError("could not make the simulation's data");
  return data;
}

std::string NameAt(const mjModel& m, mjtObj type, int id, const char* kind) {
  const char* name = mj_id2name(&m, type, id);
  return name != nullptr && name[0] != '\0' ? name : std::string(kind) + "_" + std::to_string(id);
}

int IdOf(const mjModel& m, mjtObj type, const std::string& name) {
  const int id = mj_name2id(&m, type, name.c_str());
  if (id < 0) throw EngineError("the compiled model has no object named '" + name + "'");
  return id;
}

}  // namespace mbv::simulation

namespace mbv {

std::string EngineVersion() { return mj_versionString(); }

}  // namespace mbv
