# mbv_layer(room [LIGHT] DEPS our layers… LIBS external targets…): the static library
# mbv_<room> of src/<room>/**.cc (mbv_features_<product> of a product). LIGHT layers compute nothing per sample or step.

function(mbv_compile_options target)
  # No fused multiply-add contraction: the same numbers on every machine. No path of the build in
  # what is built. Warnings as errors, hardening and unity build are the presets' (CMakePresets.json).
  target_compile_options(${target} PRIVATE
      -Wall -Wextra -Wpedantic -ffp-contract=off -ffile-prefix-map=${CMAKE_SOURCE_DIR}/=)
  # GCC collects its own garbage from 128 MB on, again and again where Eigen's templates fill 1 GB.
  # Without, a quarter of the compiler's time is saved for a fifth more memory (1.2 → 1.4 GB).
  # The four warnings left out are wrong in GCC 12 for std::string and Eigen at -O3 (GCC bugs 105651,
  # 105562, 105329).
  if(CMAKE_CXX_COMPILER_ID STREQUAL "GNU")
    target_compile_options(${target} PRIVATE
        -Wno-restrict -Wno-maybe-uninitialized -Wno-array-bounds -Wno-stringop-overflow
        "SHELL:--param ggc-min-expand=300" "SHELL:--param ggc-min-heapsize=1048576")
  endif()
endfunction()

# Code that runs once per file, page or test: -O3 would cost the compiler more than it saves.
function(mbv_light target)
  target_compile_options(${target} PRIVATE $<$<CONFIG:Release>:-O1>)
endfunction()

function(mbv_layer room)
  string(REPLACE / _ folder ${room})
  cmake_parse_arguments(ARG "LIGHT" "" "DEPS;LIBS" ${ARGN})
  file(GLOB_RECURSE sources CONFIGURE_DEPENDS ${CMAKE_CURRENT_SOURCE_DIR}/src/${room}/*.cc)
  list(TRANSFORM ARG_DEPS REPLACE / _)
  list(TRANSFORM ARG_DEPS PREPEND mbv_)
  if(sources)
    add_library(mbv_${folder} STATIC ${sources})
    mbv_compile_options(mbv_${folder})
    if(ARG_LIGHT)
      mbv_light(mbv_${folder})
      set_target_properties(mbv_${folder} PROPERTIES UNITY_BUILD_BATCH_SIZE 16)
      target_precompile_headers(mbv_${folder} REUSE_FROM mbv_light_pch)
    else()
      target_precompile_headers(mbv_${folder} REUSE_FROM mbv_pch)
    endif()
    set(scope PUBLIC)
  else()
    add_library(mbv_${folder} INTERFACE)
    set(scope INTERFACE)
  endif()
  target_include_directories(mbv_${folder} ${scope}
                             ${CMAKE_CURRENT_SOURCE_DIR}/src)
  target_link_libraries(mbv_${folder} ${scope} ${ARG_DEPS} ${ARG_LIBS})
  target_compile_features(mbv_${folder} ${scope} cxx_std_20)
  set_property(GLOBAL APPEND PROPERTY MBV_LIBRARIES mbv_${folder})
  set_property(GLOBAL APPEND PROPERTY MBV_EXTERNAL_LIBRARIES ${ARG_LIBS})
  if(room MATCHES "^features/")
    set(MBV_PRODUCTS ${MBV_PRODUCTS} mbv_${folder} PARENT_SCOPE)
  endif()
endfunction()
