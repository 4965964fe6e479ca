# The script and style of report.html: packages by npm into the build folder (only when the lock
# file has changed), bundled and minified into one C++ source of mbv_report.
set(web ${CMAKE_CURRENT_SOURCE_DIR}/web)
set(web_build ${CMAKE_BINARY_DIR}/web)
file(MAKE_DIRECTORY ${web_build})

add_custom_command(
  OUTPUT ${web_build}/packages.stamp
  COMMAND ${CMAKE_COMMAND} -E copy ${web}/package.json ${web}/package-lock.json ${web_build}
  COMMAND ${NPM} ci --ignore-scripts --no-audit --no-fund --loglevel=error
  COMMAND ${CMAKE_COMMAND} -E touch ${web_build}/packages.stamp
  DEPENDS ${web}/package.json ${web}/package-lock.json
  WORKING_DIRECTORY ${web_build}
  COMMENT "Fetching the report page's packages (npm ci)"
  VERBATIM)

file(GLOB web_sources CONFIGURE_DEPENDS ${web}/src/*.js ${web}/src/*.css)
add_custom_command(
  OUTPUT ${web_build}/html_assets.cc
  COMMAND ${CMAKE_COMMAND} -E env NODE_PATH=${web_build}/node_modules
          ${NODE} ${web}/build.cjs ${web_build}/html_assets.cc
  DEPENDS ${web_build}/packages.stamp ${web}/build.cjs ${web_sources}
  COMMENT "Bundling the report page's script"
  VERBATIM)
target_sources(mbv_report PRIVATE ${web_build}/html_assets.cc)
