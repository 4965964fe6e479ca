# The headers that nearly every file includes, parsed once: mbv_pch for what computes, mbv_light_pch
# for the rest of the program, mbv_test_pch for the tests. All are libraries of one empty file; other targets reuse their headers.
function(mbv_precompiled target)
  cmake_parse_arguments(ARG "" "" "LIBS;HEADERS" ${ARGN})
  file(CONFIGURE OUTPUT ${CMAKE_BINARY_DIR}/${target}.cc CONTENT "")
  add_library(${target} STATIC ${CMAKE_BINARY_DIR}/${target}.cc)
  target_include_directories(${target} PRIVATE ${CMAKE_SOURCE_DIR}/src)
  target_link_libraries(${target} PUBLIC ${ARG_LIBS})
  mbv_compile_options(${target})
  target_precompile_headers(${target} PRIVATE ${ARG_HEADERS})
endfunction()

set(MBV_COMMON_HEADERS
    <algorithm> <array> <cmath> <filesystem> <functional> <map> <memory> <numbers> <optional> <set>
    <span> <string> <string_view> <variant> <vector> <fmt/format.h>
    <base/eigen_instances.h>)
mbv_precompiled(mbv_pch LIBS Eigen3::Eigen fmt::fmt HEADERS ${MBV_COMMON_HEADERS})
mbv_precompiled(mbv_light_pch LIBS Eigen3::Eigen fmt::fmt nlohmann_json::nlohmann_json
                CLI11::CLI11 HEADERS ${MBV_COMMON_HEADERS} <nlohmann/json.hpp> <CLI/CLI.hpp>)
mbv_light(mbv_light_pch)
