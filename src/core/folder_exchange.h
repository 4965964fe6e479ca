// The steps of OutputFolder::Commit(), and how they are taken up again after a kill.
//
// A stage holds
//   new/     the new result; after the exchange what was there before
//   old/     what was there before, on file systems that cannot exchange
//   place    from here on the exchange may have happened: where to, and which old files are ours
#pragma once

#include <filesystem>
#include <set>
#include <string>

namespace mbv {

struct Exchange {
  std::filesystem::path stage;
  std::filesystem::path target;  ///< absolute, no link itself
  std::set<std::string> files;   ///< of the new result, its list included
};

/// Puts stage/new in place of the target; "" or what went wrong, and then the target is as before.
/// Call under the StateLock of the stage's folder.
[[nodiscard]] std::string ExchangeFolders(const Exchange& exchange);

/// Removes a stage. Files of the user that a kill left in it go back to where they were; what
/// cannot go back stays. Call under the StateLock.
void ClearStage(const std::filesystem::path& stage);

}  // namespace mbv
