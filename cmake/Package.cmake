# Debian packages by `cpack` (scripts/package): mbverify with run-time dependencies only,
# libmbverify-dev with headers, libraries and the CMake package for own closed forms, and
# python3-mbverify.
set(CPACK_GENERATOR DEB)
set(CPACK_PACKAGE_NAME mbverify)
set(CPACK_PACKAGE_VENDOR mbverify)
set(CPACK_PACKAGE_CONTACT "mbverify developers <mbverify@users.noreply.github.com>")
set(CPACK_PACKAGING_INSTALL_PREFIX /usr)
set(CPACK_STRIP_FILES ON)
set(CPACK_COMPONENTS_ALL runtime development)
set(CPACK_DEB_COMPONENT_INSTALL ON)
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PACKAGE_RELEASE 1)
set(CPACK_DEBIAN_PACKAGE_CONTROL_STRICT_PERMISSION ON)
set(CPACK_INSTALL_DEFAULT_DIRECTORY_PERMISSIONS OWNER_READ OWNER_WRITE OWNER_EXECUTE
    GROUP_READ GROUP_EXECUTE WORLD_READ WORLD_EXECUTE)

set(CPACK_DEBIAN_RUNTIME_PACKAGE_NAME mbverify)
set(CPACK_DEBIAN_RUNTIME_PACKAGE_SECTION science)
set(CPACK_DEBIAN_RUNTIME_PACKAGE_SHLIBDEPS ON)
set(CPACK_DEBIAN_RUNTIME_PACKAGE_DEPENDS "libosmesa6")  # loaded with the first picture
set(CPACK_DEBIAN_RUNTIME_PACKAGE_RECOMMENDS "nodejs")  # of the witness by the newest MuJoCo
set(CPACK_DEBIAN_RUNTIME_PACKAGE_SUGGESTS "ffmpeg, libmbverify-dev")
set(CPACK_COMPONENT_RUNTIME_DESCRIPTION
"verifier of the dynamics of closed-loop mechanisms
 Computes the drive forces of a parallel or hybrid mechanism by closed form,
 by a generic Newton-Euler solver and by MuJoCo, and says whether they agree.
 Comes with models of four robots from papers and their scenarios.")

set(CPACK_DEBIAN_DEVELOPMENT_PACKAGE_NAME libmbverify-dev)
set(CPACK_DEBIAN_DEVELOPMENT_PACKAGE_SECTION libdevel)
set(linked ${MBV_DEBIAN_PACKAGES})
list(REMOVE_ITEM linked libgtest-dev libbenchmark-dev)
list(JOIN linked ", " linked)
set(CPACK_DEBIAN_DEVELOPMENT_PACKAGE_DEPENDS
    "mbverify (= ${PROJECT_VERSION}-1), cmake, ${linked}")
set(CPACK_COMPONENT_DEVELOPMENT_DESCRIPTION
"verifier of the dynamics of closed-loop mechanisms (development files)
 Headers, static libraries and the CMake package of mbverify, for programs with
 closed forms of their own mechanisms.")

set(packages "runtime mbverify" "development libmbverify-dev")
if(MBV_WITH_PYTHON)
  list(APPEND CPACK_COMPONENTS_ALL python)
  list(APPEND packages "python python3-mbverify")
  set(CPACK_DEBIAN_PYTHON_PACKAGE_NAME python3-mbverify)
  set(CPACK_DEBIAN_PYTHON_PACKAGE_SECTION python)
  set(CPACK_DEBIAN_PYTHON_PACKAGE_SHLIBDEPS ON)
  math(EXPR next "${Python3_VERSION_MINOR} + 1")
  set(CPACK_DEBIAN_PYTHON_PACKAGE_DEPENDS
      "mbverify (= ${PROJECT_VERSION}-1), python3 (>= 3.${Python3_VERSION_MINOR}~), python3 (<< 3.${next}~), python3-numpy")
  set(CPACK_DEBIAN_PYTHON_PACKAGE_SUGGESTS "python3-pandas")
  set(CPACK_COMPONENT_PYTHON_DESCRIPTION
"verifier of the dynamics of closed-loop mechanisms (Python 3)
 Poses, forces, Jacobians and mass matrices of closed-loop mechanisms as NumPy
 arrays, and the program's verdicts as objects.")
endif()

# What Debian asks of every package: copyright, changelog, manual pages (made by scripts/package).
string(TIMESTAMP date "%a, %d %b %Y 00:00:00 +0000" UTC)
file(WRITE ${CMAKE_BINARY_DIR}/package/changelog
"mbverify (${PROJECT_VERSION}-1) unstable; urgency=low

  * See the project's CHANGELOG.md.

 -- ${CPACK_PACKAGE_CONTACT}  ${date}
")
execute_process(COMMAND gzip -9nf ${CMAKE_BINARY_DIR}/package/changelog)
foreach(pair ${packages})
  separate_arguments(pair)
  list(GET pair 0 component)
  list(GET pair 1 package)
  install(FILES cmake/debian_copyright DESTINATION ${CMAKE_INSTALL_DATADIR}/doc/${package}
          RENAME copyright COMPONENT ${component})
  install(FILES ${CMAKE_BINARY_DIR}/package/changelog.gz
          DESTINATION ${CMAKE_INSTALL_DATADIR}/doc/${package} RENAME changelog.Debian.gz
          COMPONENT ${component})
endforeach()
install(DIRECTORY ${CMAKE_BINARY_DIR}/package/man1 DESTINATION ${CMAKE_INSTALL_MANDIR}
        COMPONENT runtime OPTIONAL)
include(CPack)
