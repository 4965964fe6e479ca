#include "mechanism/channel_count.h"

#include "mechanism/channels.h"

namespace mbv {

size_t MostChannels(const Mechanism& mechanism) {
  constexpr size_t kPerReaction = 6;
  return DriveChannels(mechanism).size() + OutputChannels(mechanism).size() +
         PrescribedChannels(mechanism).size() + BandChannels(mechanism).size() +
         kPerReaction * mechanism.joints.size() + AuditChannels().size() + EnergyChannels().size() +
         WorkChannels(mechanism).size();
}

}  // namespace mbv
