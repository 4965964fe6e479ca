// Style and script of index.html.
#pragma once

namespace mbv {

extern const char* const kIndexStyle;
extern const char* const kIndexScript;

}  // namespace mbv
