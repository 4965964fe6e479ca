# Finds every dependency and, when one is missing, names the Debian package that brings it.
include(Libraries)
if(MBV_BUILD_TESTS)
  mbv_find(GTest libgtest-dev)
  mbv_find(benchmark libbenchmark-dev)
endif()

# Only mbverify-read-sdf links it.
if(MBV_WITH_SDF)
  if(PKG_CONFIG_FOUND)
    pkg_check_modules(SDFORMAT QUIET IMPORTED_TARGET sdformat12)
  endif()
  if(NOT SDFORMAT_FOUND)
    message(STATUS "libsdformat-dev is not installed: mbverify reads no SDF")
    set(MBV_WITH_SDF OFF)
  else()
    # Its -std=c++17 would go before ours.
    set_target_properties(PkgConfig::SDFORMAT PROPERTIES INTERFACE_COMPILE_OPTIONS "")
  endif()
endif()

# The scripts of the pages (web/) are bundled with npm's packages, unless the sources are those of a
# release, which has the bundles in web/bundled; tests check their types.
find_program(NODE NAMES node nodejs)
find_program(NPM npm)
find_program(TSC tsc)
set(MBV_BUNDLED_WEB OFF)
if(IS_DIRECTORY ${CMAKE_CURRENT_SOURCE_DIR}/web/bundled)
  set(MBV_BUNDLED_WEB ON)
endif()
if(NOT NODE AND (MBV_BUILD_TESTS OR NOT MBV_BUNDLED_WEB))
  list(APPEND MBV_MISSING "Node.js (nodejs)")
endif()
if(NOT NPM AND NOT MBV_BUNDLED_WEB)
  list(APPEND MBV_MISSING "npm (npm)")
endif()
if(MBV_BUILD_TESTS AND NOT TSC)
  list(APPEND MBV_MISSING "TypeScript (node-typescript)")
endif()

if(MBV_MISSING)
  list(JOIN MBV_MISSING "\n  " missing_text)
  message(FATAL_ERROR "mbverify: missing dependencies (Debian package in brackets):\n"
                      "  ${missing_text}\nRun scripts/setup (with --tests for those of the tests) to install them.")
endif()
