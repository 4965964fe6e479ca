# mbv_layer(room [LIGHT] DEPS our layers… LIBS external targets…): the static library
# mbv_<room> of src/<room>/**.cc (mbv_features_<product> of a product). LIGHT layers compute nothing per sample or step.

function(mbv_compile_options target)
  # No fused multiply-add contraction: the same numbers on every machine. The four warnings left out
  # are wrong in GCC 12 for std::string and Eigen at -O3 (GCC bugs 105651, 105562, 105329).
  target_compile_options(${target} PRIVATE
      -Wall -Wextra -Wpedantic -Werror -ffp-contract=off
      -Wno-restrict -Wno-maybe-uninitialized -Wno-array-bounds -Wno-stringop-overflow)
  # Broken memory ends the program at once instead of going on with wrong numbers: overwritten stack
  # frames, indices beyond a container, overlong copies. No path of the build in what is built.
  target_compile_options(${target} PRIVATE
      -fstack-protector-strong -ffile-prefix-map=${CMAKE_SOURCE_DIR}/=
      $<$<CONFIG:Release>:-U_FORTIFY_SOURCE> $<$<CONFIG:Release>:-D_FORTIFY_SOURCE=2>)
  target_compile_definitions(${target} PRIVATE _GLIBCXX_ASSERTIONS)
  # GCC collects its own garbage from 128 MB on, again and again where Eigen's templates fill 1 GB.
  # Without, a quarter of the compiler's time is saved for a fifth more memory (1.2 → 1.4 GB).
  if(CMAKE_CXX_COMPILER_ID STREQUAL "GNU")
    target_compile_options(${target} PRIVATE
        "SHELL:--param ggc-min-expand=300" "SHELL:--param ggc-min-heapsize=1048576")
  endif()
  target_link_options(${target} PRIVATE LINKER:-z,relro,-z,now)
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
                             $<BUILD_INTERFACE:${CMAKE_CURRENT_SOURCE_DIR}/src>
                             $<INSTALL_INTERFACE:${CMAKE_INSTALL_INCLUDEDIR}/mbverify>)
  target_link_libraries(mbv_${folder} ${scope} ${ARG_DEPS} ${ARG_LIBS})
  target_compile_features(mbv_${folder} ${scope} cxx_std_20)
  set_target_properties(mbv_${folder} PROPERTIES EXPORT_NAME ${folder})
  if(room MATCHES "^features/")
    set(MBV_PRODUCTS ${MBV_PRODUCTS} mbv_${folder} PARENT_SCOPE)
  endif()
  install(TARGETS mbv_${folder} EXPORT mbverify ARCHIVE COMPONENT development)
endfunction()
