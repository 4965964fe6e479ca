#include "core/diagnostics.h"

#include <gtest/gtest.h>

namespace mbv {
namespace {

TEST(Diagnostics, AFindingIsPrintedWithPlaceAndHint) {
  const Finding finding{Severity::kError,
                        "a.yaml",
                        3,
                        7,
                        "mass = -1 violates mass >= 0",
                        "leave the key out for a massless body"};
  EXPECT_EQ(ToText(finding),
            "a.yaml:3:7: error: mass = -1 violates mass >= 0\n"
            "  hint: leave the key out for a massless body");
}

TEST(Diagnostics, WarningsAreNotErrors) {
  Diagnostics list;
  list.Add({.severity = Severity::kWarning, .file = "a", .message = "odd", .hint = ""});
  EXPECT_FALSE(list.has_errors());
  list.Add({.severity = Severity::kError, .file = "a", .message = "bad", .hint = ""});
  EXPECT_TRUE(list.has_errors());
}

TEST(Diagnostics, ClosestWordFindsTheTypingSlipAndNothingElse) {
  EXPECT_EQ(ClosestWord("massa", {"mass", "com", "inertia"}), "mass");
  EXPECT_EQ(ClosestWord("velocity", {"mass", "com"}), "");
}

}  // namespace
}  // namespace mbv
