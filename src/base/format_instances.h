// fmt's own formatting into buffers, compiled once (format_instances.cc): every file that calls
// fmt::format_to would instantiate it again.
#pragma once

#include <fmt/format.h>

#define MBV_FORMAT_INSTANCES(DECLARATION)                                          \
  DECLARATION void fmt::detail::vformat_to(buffer<char>&, basic_string_view<char>, \
                                           basic_format_args<buffer_context<char>>, locale_ref);

MBV_FORMAT_INSTANCES(extern template)
