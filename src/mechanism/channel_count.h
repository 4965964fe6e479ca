// How much a witness records.
#pragma once

#include "mechanism/mechanism.h"

namespace mbv {

/// Channels (mechanism/channels.h) that a witness records of a mechanism at most.
[[nodiscard]] size_t MostChannels(const Mechanism& mechanism);

}  // namespace mbv
