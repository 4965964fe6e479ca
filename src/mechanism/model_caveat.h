// What verdicts on a model name, whatever the witnesses say: exceptions to the loader's rules that
// the model allows, and what its source has and it has not.
#pragma once

#include <string>
#include <vector>

namespace mbv {

struct ModelCaveat {
  enum class Kind {
    kAllowed,  ///< `allow:`, `closure_tolerance:`
    kLeftOut   ///< acts on forces in a URDF or MJCF file (`left_out:`)
  };
  Kind kind = Kind::kLeftOut;
  std::string text;         ///< a sentence without its subject's file
  std::string source = {};  ///< of kLeftOut: element and attribute, "body gravcomp"; may be empty
};

/// The texts of one kind, each once.
[[nodiscard]] inline std::vector<std::string> TextsOf(const std::vector<ModelCaveat>& caveats,
                                                      ModelCaveat::Kind kind) {
  std::vector<std::string> texts;
  for (const ModelCaveat& caveat : caveats) {
    bool known = caveat.kind != kind;
    for (const std::string& text : texts) known = known || text == caveat.text;
    if (!known) texts.push_back(caveat.text);
  }
  return texts;
}

/// See core/bytes.h.
template <typename Visit>
void VisitMembers(Visit& visit, typename Visit::template Of<ModelCaveat>& caveat) {
  visit(caveat.kind), visit(caveat.text), visit(caveat.source);
}

}  // namespace mbv
