# cmake --install: every library as a component of the package Sentree, each with its own exported targets file, so that
# find_package(Sentree COMPONENTS bt) finds only what sentree::bt needs.

include(CMakePackageConfigHelpers)

set(config_dir ${CMAKE_INSTALL_LIBDIR}/cmake/Sentree)

# Which package a user's CMake has to find for a library that ours link. An unknown one stops the configuration here, not at the user's.
function(sentree_package_of target out)
  if(target MATCHES "^PkgConfig::(.*)$")
    set(package pkg-config:${CMAKE_MATCH_1})
  elseif(target MATCHES "^tl::")
    set(package tl-expected)
  elseif(target MATCHES "^(nlohmann_json|fmt|simdjson|Threads|OpenSSL|ZLIB|PNG|Boost)::")
    set(package ${CMAKE_MATCH_1})
  elseif(target STREQUAL yaml-cpp)
    set(package yaml-cpp)
  elseif(target MATCHES "::")
    message(FATAL_ERROR "cmake/Install.cmake does not know which package has ${target}; add it to sentree_package_of")
  else()
    set(package "")  # a plain library name, found by the linker
  endif()
  set(${out} ${package} PARENT_SCOPE)
endfunction()

get_property(libraries GLOBAL PROPERTY SENTREE_LIBRARIES)
list(REMOVE_ITEM libraries cli)
set(SENTREE_COMPONENT_DATA "set(_sentree_components ${libraries})\n")
foreach(library IN LISTS libraries)
  set(siblings)
  set(packages)
  get_target_property(linked sentree_${library} INTERFACE_LINK_LIBRARIES)
  foreach(item IN LISTS linked)
    string(REGEX REPLACE "^\\$<LINK_ONLY:(.*)>$" "\\1" item "${item}")
    if(item MATCHES "^sentree::(.*)$")
      list(APPEND siblings ${CMAKE_MATCH_1})
    elseif(item AND NOT item MATCHES "^\\$<")
      sentree_package_of(${item} package)
      list(APPEND packages ${package})
    endif()
  endforeach()
  list(REMOVE_DUPLICATES packages)
  string(APPEND SENTREE_COMPONENT_DATA "set(_sentree_${library}_libraries ${siblings})\nset(_sentree_${library}_packages ${packages})\n")

  install(TARGETS sentree_${library} EXPORT Sentree-${library} ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR} COMPONENT development)
  install(EXPORT Sentree-${library} NAMESPACE sentree:: DESTINATION ${config_dir} COMPONENT development)
  file(GLOB headers CONFIGURE_DEPENDS ${PROJECT_SOURCE_DIR}/src/${library}/*.h)
  list(FILTER headers EXCLUDE REGEX "/test_")  # helpers of our own tests
  install(FILES ${headers} DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/sentree/${library} COMPONENT development)
endforeach()
if(TARGET sentree)
  install(TARGETS sentree RUNTIME DESTINATION ${CMAKE_INSTALL_BINDIR} COMPONENT program)
  # What the command looks for beside itself: interfaces, skills, and the example that a new project starts from.
  install(DIRECTORY ${PROJECT_SOURCE_DIR}/interfaces ${PROJECT_SOURCE_DIR}/skills ${PROJECT_SOURCE_DIR}/examples DESTINATION ${CMAKE_INSTALL_DATADIR}/sentree COMPONENT program
    # What programs leave in a clone, which .gitignore names.
    REGEX "/(build|node_modules|runs|verify|campaign|__pycache__)$" EXCLUDE)
endif()

configure_package_config_file(${CMAKE_CURRENT_LIST_DIR}/SentreeConfig.cmake.in ${PROJECT_BINARY_DIR}/SentreeConfig.cmake
  INSTALL_DESTINATION ${config_dir})
write_basic_package_version_file(${PROJECT_BINARY_DIR}/SentreeConfigVersion.cmake COMPATIBILITY SameMinorVersion)
install(FILES ${PROJECT_BINARY_DIR}/SentreeConfig.cmake ${PROJECT_BINARY_DIR}/SentreeConfigVersion.cmake DESTINATION ${config_dir} COMPONENT development)
