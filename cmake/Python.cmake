# mbv_module(product DEPS our layers… LIBS pybind11::module): the Python package mbverify of a product's
# folder, in build/…/python, where PYTHONPATH finds it, and as the component "python" of the
# installation.
option(MBV_WITH_PYTHON "The Python package mbverify by pybind11" ON)
set(MBV_PYTHON_SITE lib/python3/dist-packages CACHE STRING
    "Where Python finds packages, below the prefix")
if(MBV_WITH_PYTHON)
  # Debian's interpreter, which has Debian's NumPy, unless another one is named.
  if(NOT Python3_EXECUTABLE AND EXISTS /usr/bin/python3)
    set(Python3_EXECUTABLE /usr/bin/python3)
  endif()
  find_package(Python3 COMPONENTS Interpreter Development.Module)
  find_package(pybind11 2.10 CONFIG QUIET)
  if(NOT Python3_FOUND OR NOT pybind11_FOUND)
    message(STATUS "pybind11-dev or python3-dev is not installed: no Python package")
    set(MBV_WITH_PYTHON OFF)
  endif()
endif()

function(mbv_module product)
  cmake_parse_arguments(ARG "" "" "DEPS;LIBS" ${ARGN})
  if(NOT MBV_WITH_PYTHON)
    return()
  endif()
  set(package ${CMAKE_BINARY_DIR}/python/mbverify)
  pybind11_add_module(mbv_python MODULE NO_EXTRAS src/${product}/native.cc)
  mbv_compile_options(mbv_python)
  mbv_light(mbv_python)
  set_target_properties(mbv_python PROPERTIES OUTPUT_NAME _native UNITY_BUILD OFF
                                              LIBRARY_OUTPUT_DIRECTORY ${package})
  list(TRANSFORM ARG_DEPS REPLACE / _)
  list(TRANSFORM ARG_DEPS PREPEND mbv_)
  target_link_libraries(mbv_python PRIVATE ${ARG_DEPS} ${ARG_LIBS})
  file(GLOB files CONFIGURE_DEPENDS ${CMAKE_CURRENT_SOURCE_DIR}/src/${product}/mbverify/*.py*)
  file(COPY ${files} DESTINATION ${package})
  set_property(DIRECTORY APPEND PROPERTY CMAKE_CONFIGURE_DEPENDS ${files})
  install(FILES ${files} DESTINATION ${MBV_PYTHON_SITE}/mbverify COMPONENT python)
  install(TARGETS mbv_python LIBRARY DESTINATION ${MBV_PYTHON_SITE}/mbverify COMPONENT python)
endfunction()
