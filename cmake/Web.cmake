# Scripts and styles of the pages: packages by npm into the build folder (only when the lock file has
# changed), bundled and minified into one C++ source for each page. A release has these sources in
# web/bundled (scripts/tarball): then neither npm nor Node.js is run.
if(MBV_BUNDLED_WEB)
  target_sources(mbv_report PRIVATE ${CMAKE_CURRENT_SOURCE_DIR}/web/bundled/html_assets.cc)
  target_sources(mbv_features_regress PRIVATE ${CMAKE_CURRENT_SOURCE_DIR}/web/bundled/index_assets.cc)
  return()
endif()
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
  COMMENT "Fetching the pages' packages (npm ci)"
  VERBATIM)
add_custom_target(web_packages DEPENDS ${web_build}/packages.stamp)

# The page of web/src/<page> as <output>, a source of mbv_<layer>.
function(mbv_page page output layer)
  file(GLOB sources CONFIGURE_DEPENDS ${web}/src/${page}/*.js ${web}/src/${page}/*.css
       ${web}/src/${page}/*.html)
  add_custom_command(
    OUTPUT ${web_build}/${output}
    COMMAND ${CMAKE_COMMAND} -E env NODE_PATH=${web_build}/node_modules
            ${NODE} ${web}/build.cjs ${page} ${web_build}/${output}
    DEPENDS web_packages ${web_build}/packages.stamp ${web}/build.cjs ${sources}
    COMMENT "Bundling the script of the ${page} page"
    VERBATIM)
  target_sources(mbv_${layer} PRIVATE ${web_build}/${output})
endfunction()

mbv_page(report html_assets.cc report)
mbv_page(regression index_assets.cc features_regress)
