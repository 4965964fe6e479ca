// Parameters of a model that a user sets.
#pragma once

#include <map>
#include <string>

namespace mbv {

/// Model parameters by name.
using Overrides = std::map<std::string, double>;

}  // namespace mbv
