# sentree_page(OUT): the files of the web page as C++: `std::array<Asset, n> kFiles`, written to OUT when the page's
# sources have changed. Where Node is missing or the packages cannot be fetched the list is empty, and the build says so.
set(SENTREE_PAGE ON CACHE BOOL "Build the web page of `sentree run --studio` into the program; needs Node and npm")

function(sentree_page out)
  set(web ${PROJECT_SOURCE_DIR}/web)
  set(work ${PROJECT_BINARY_DIR}/web)
  find_program(SENTREE_NPM npm)
  if(NOT SENTREE_PAGE OR NOT SENTREE_NPM)
    if(SENTREE_PAGE)
      message(WARNING "npm was not found: the program is built without its web page (packages nodejs, npm)")
    endif()
    file(CONFIGURE OUTPUT ${out} CONTENT "constexpr std::array<Asset, 0> kFiles = {};\n" @ONLY)
    return()
  endif()
  file(GLOB_RECURSE sources CONFIGURE_DEPENDS ${web}/src/* ${web}/public/* ${web}/build/*)
  list(APPEND sources ${web}/index.html ${web}/package.json ${web}/package-lock.json ${web}/tsconfig.json
    ${web}/vite.config.ts)
  add_custom_command(OUTPUT ${out}
    COMMAND ${CMAKE_COMMAND} -DWEB=${web} -DWORK=${work} -DOUT=${out} -DNPM=${SENTREE_NPM} -P ${web}/embed.cmake
    DEPENDS ${sources} ${web}/embed.cmake
    COMMENT "Building the web page" VERBATIM)
endfunction()
