# `cmake --install`: the program with its models and scenarios, and the package that
# find_package(mbverify) finds: mbverify::mbverify and the headers of what programs may call.
include(CMakePackageConfigHelpers)

install(TARGETS mbverify COMPONENT runtime)
install(DIRECTORY models scenarios DESTINATION ${CMAKE_INSTALL_DATADIR}/mbverify COMPONENT runtime)
install(FILES src/external/mechanism.schema.json DESTINATION ${CMAKE_INSTALL_DATADIR}/mbverify
        COMPONENT runtime)
install(DIRECTORY docs/reference/schemas DESTINATION ${CMAKE_INSTALL_DATADIR}/mbverify
        COMPONENT runtime)
install(DIRECTORY examples docs DESTINATION ${CMAKE_INSTALL_DOCDIR} COMPONENT runtime)
# The program writes the scripts by which shells complete its commands.
set(completions ${CMAKE_BINARY_DIR}/completions)
add_custom_command(TARGET mbverify POST_BUILD COMMAND ${CMAKE_COMMAND} -E make_directory ${completions})
foreach(shell_file "bash mbverify bash-completion/completions" "zsh _mbverify zsh/vendor-completions"
                   "fish mbverify.fish fish/vendor_completions.d")
  separate_arguments(shell_file)
  list(POP_FRONT shell_file shell file folder)
  add_custom_command(TARGET mbverify POST_BUILD VERBATIM
                     COMMAND sh -c "\"$0\" completion ${shell} >'${completions}/${file}'"
                             $<TARGET_FILE:mbverify>)
  install(FILES ${completions}/${file} DESTINATION ${CMAKE_INSTALL_DATADIR}/${folder}
          COMPONENT runtime)
endforeach()
# So does the manual page.
add_custom_command(TARGET mbverify POST_BUILD VERBATIM
                   COMMAND sh -c "\"$0\" man-page | gzip -9n >'${CMAKE_BINARY_DIR}/mbverify.1.gz'"
                           $<TARGET_FILE:mbverify>)
install(FILES ${CMAKE_BINARY_DIR}/mbverify.1.gz DESTINATION ${CMAKE_INSTALL_MANDIR}/man1
        COMPONENT runtime)
install(TARGETS mbverify_library EXPORT mbverify ARCHIVE COMPONENT development)
target_include_directories(mbverify_library INTERFACE
                           $<INSTALL_INTERFACE:${CMAKE_INSTALL_INCLUDEDIR}>
                           $<INSTALL_INTERFACE:${CMAKE_INSTALL_INCLUDEDIR}/mbverify>)
install(DIRECTORY include/mbverify DESTINATION ${CMAKE_INSTALL_INCLUDEDIR} COMPONENT development)
# What programs with closed forms of their own include, and no other header.
set(waiting analytic/register_closed_form.h program.h)
set(public)
while(waiting)
  list(POP_FRONT waiting header)
  list(APPEND public ${header})
  set_property(DIRECTORY APPEND PROPERTY CMAKE_CONFIGURE_DEPENDS
               ${CMAKE_CURRENT_SOURCE_DIR}/src/${header})
  file(STRINGS src/${header} includes REGEX "^#include \"")
  foreach(line ${includes})
    string(REGEX REPLACE "^#include \"([^\"]+)\".*" "\\1" included ${line})
    if(NOT included IN_LIST public AND NOT included IN_LIST waiting)
      list(APPEND waiting ${included})
    endif()
  endforeach()
  get_filename_component(folder ${header} DIRECTORY)
  install(FILES src/${header} DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/mbverify/${folder}
          COMPONENT development)
endwhile()

set(package ${CMAKE_INSTALL_LIBDIR}/cmake/mbverify)
install(EXPORT mbverify NAMESPACE mbverify:: FILE mbverify-targets.cmake DESTINATION ${package}
        COMPONENT development)
configure_package_config_file(cmake/mbverify-config.cmake.in
                              ${CMAKE_BINARY_DIR}/mbverify-config.cmake
                              INSTALL_DESTINATION ${package})
write_basic_package_version_file(${CMAKE_BINARY_DIR}/mbverify-config-version.cmake
                                 COMPATIBILITY SameMinorVersion)
install(FILES ${CMAKE_BINARY_DIR}/mbverify-config.cmake
              ${CMAKE_BINARY_DIR}/mbverify-config-version.cmake cmake/Libraries.cmake
        DESTINATION ${package} COMPONENT development)
