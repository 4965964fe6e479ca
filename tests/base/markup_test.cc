#include "base/markup.h"

#include <gtest/gtest.h>

namespace mbv {
namespace {

TEST(EscapeMarkup, FiveCharactersBecomeEntitiesAndNothingElseChanges) {
  EXPECT_EQ(EscapeMarkup("a<b & 'c' > \"d\""), "a&lt;b &amp; &#39;c&#39; &gt; &quot;d&quot;");
  EXPECT_EQ(EscapeMarkup("&amp;"), "&amp;amp;");
  EXPECT_EQ(EscapeMarkup("µ → 3\n"), "µ → 3\n");
  EXPECT_EQ(EscapeMarkup(""), "");
}

}  // namespace
}  // namespace mbv
