// What a build with sanitizers does otherwise.
#pragma once

namespace mbv::test {

#ifdef __SANITIZE_ADDRESS__
/// It takes several times the memory and reserves address space without end, so that limits of
/// either say nothing.
inline constexpr bool kSanitized = true;
#else
inline constexpr bool kSanitized = false;
#endif

}  // namespace mbv::test
