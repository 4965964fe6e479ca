# The files that `mbverify init` writes (starters/) as one C++ source of mbv_features_robots, so that the
# program needs no data beside it.

set(starter_rows "")
foreach(name four_bar slider_crank stewart)
  foreach(file model first)
    set(path ${CMAKE_CURRENT_SOURCE_DIR}/starters/${name}/${file}.yaml)
    set_property(DIRECTORY APPEND PROPERTY CMAKE_CONFIGURE_DEPENDS ${path})
    file(READ ${path} ${file})
  endforeach()
  string(APPEND starter_rows
         "{\"${name}\", R\"--(${model})--\",\nR\"--(${first})--\"},\n")
endforeach()
file(CONFIGURE OUTPUT ${CMAKE_BINARY_DIR}/starters.cc @ONLY CONTENT [[
#include "features/robots/init.h"

namespace mbv {

const std::vector<Starter>& Starters() {
  static const std::vector<Starter> starters = {
@starter_rows@  };
  return starters;
}

}  // namespace mbv
]])
target_sources(mbv_features_robots PRIVATE ${CMAKE_BINARY_DIR}/starters.cc)
