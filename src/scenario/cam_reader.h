// `cam` terms of profiles: rises, dwells and returns one after the other.
#pragma once

#include <string>
#include <vector>

#include "scenario/profile_reader.h"

namespace mbv {

/// Words of the laws from rest to rest.
[[nodiscard]] const std::vector<std::string>& StepLaws();

/// A step by the law of this word.
[[nodiscard]] ProfileTerm StepTerm(const std::string& law, double start_s, double duration_s,
                                   double delta);

/// Adds a cam's terms to the profile; findings for what does not fit.
void ReadCam(ValueReader* values, const YamlNode& node, const std::string& path,
             const ProfileContext& context, Profile* profile);

}  // namespace mbv
