// What a person who opens a generated file has to know.
#pragma once

#include <string>

#include "mechanism/mechanism.h"
#include "mjcf/mjcf.h"

namespace mbv::mjcf {

/// The comment at the head of the MJCF: what it is, and the two ways to use it.
[[nodiscard]] std::string HeadComment(const Mechanism& mechanism, const MjcfOptions& options);

}  // namespace mbv::mjcf
