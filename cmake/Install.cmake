# `cmake --install`: the program with its models and scenarios, and the package that
# find_package(mbverify) finds: headers, libraries and mbverify::main.
include(CMakePackageConfigHelpers)

install(TARGETS mbverify COMPONENT runtime)
install(DIRECTORY models scenarios DESTINATION ${CMAKE_INSTALL_DATADIR}/mbverify COMPONENT runtime)
install(FILES src/external/mechanism.schema.json DESTINATION ${CMAKE_INSTALL_DATADIR}/mbverify
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
                   COMMAND sh -c "\"$0\" man-page >'${CMAKE_BINARY_DIR}/mbverify.1'"
                           $<TARGET_FILE:mbverify>)
install(FILES ${CMAKE_BINARY_DIR}/mbverify.1 DESTINATION ${CMAKE_INSTALL_MANDIR}/man1
        COMPONENT runtime)
install(TARGETS mbv_main EXPORT mbverify ARCHIVE COMPONENT development)
install(DIRECTORY src/ DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/mbverify COMPONENT development
        FILES_MATCHING PATTERN "*.h")

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
