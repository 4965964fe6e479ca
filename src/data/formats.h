// Writers of the formats of data_file.h. Internal to data/.
#pragma once

#include "data/data_file.h"

namespace mbv::internal {

[[nodiscard]] std::string WriteMat(const std::string& path, const DataAbout& about,
                                   const std::vector<const Trace*>& traces);
[[nodiscard]] std::string WriteMat73(const std::string& path, const DataAbout& about,
                                     const std::vector<const Trace*>& traces);
[[nodiscard]] std::string WriteHdf5(const std::string& path, const DataAbout& about,
                                    const std::vector<const Trace*>& traces);

}  // namespace mbv::internal
