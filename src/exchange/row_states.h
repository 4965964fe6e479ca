// states.json and rows.json: states at which another version of MuJoCo is asked for a model's
// equality rows, and its answer (examples/witness/mujoco/rows.mjs).
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "core/engine_rows.h"

namespace mbv {

/// {"drives": [names of what is driven], "states": [{qpos, qvel, targets, applied}]}, 17 digits.
[[nodiscard]] std::string StatesJson(const std::vector<std::string>& driven,
                                     const std::vector<RowState>& states);

struct RowAnswer {
  std::vector<std::string> messages;    ///< what the engine says of the file that it accepted
  std::vector<std::string> equalities;  ///< per row: the name of its equality
  std::vector<RowMeasures> states;      ///< as many as were asked for
};
/// Empty, with one sentence of trouble, where the answer is none for `states` states, or its sizes
/// do not fit: rows of every state to `equalities`, forces to `driven`.
[[nodiscard]] std::optional<RowAnswer> ReadRowAnswer(std::string_view json, size_t states,
                                                     size_t driven, std::string* trouble);

}  // namespace mbv
