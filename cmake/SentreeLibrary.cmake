# More than half of the time of a build goes into reading the standard library and GoogleTest; both are read once.
# GCC wants equal flags where such a header is made and used, so programs (-fPIE) have one of their own.
function(sentree_precompile)
  set(standard <algorithm> <array> <atomic> <chrono> <cmath> <condition_variable> <cstdint> <deque> <filesystem> <functional>
    <map> <memory> <mutex> <optional> <set> <span> <string> <string_view> <thread> <unordered_map> <utility> <variant> <vector>
    <tl/expected.hpp>)
  file(CONFIGURE OUTPUT ${PROJECT_BINARY_DIR}/precompiled/empty.cpp CONTENT "" @ONLY)
  add_library(sentree_precompiled STATIC ${PROJECT_BINARY_DIR}/precompiled/empty.cpp)
  target_link_libraries(sentree_precompiled PRIVATE sentree_options tl::expected)
  target_precompile_headers(sentree_precompiled PRIVATE ${standard})
  if(SENTREE_TESTS)
    file(CONFIGURE OUTPUT ${PROJECT_BINARY_DIR}/precompiled/main.cpp CONTENT "int main() {}\n" @ONLY)
    add_executable(sentree_precompiled_tests ${PROJECT_BINARY_DIR}/precompiled/main.cpp)
    target_link_libraries(sentree_precompiled_tests PRIVATE sentree_options tl::expected GTest::gmock GTest::gtest)
    target_precompile_headers(sentree_precompiled_tests PRIVATE ${standard} <gmock/gmock.h> <gtest/gtest.h>)
    sentree_quickly_compiled(sentree_precompiled_tests)
  endif()
endfunction()

# More than half of what was compiled were tests, and more than half of that went into making them fast. What they test
# is optimized all the same.
function(sentree_quickly_compiled target)
  target_compile_options(${target} PRIVATE $<$<CONFIG:Release>:-O0>)
endfunction()

# Names in the anonymous namespaces of a target's sources differ, or this does not compile. That a source needs no other
# one before it is what the preset `dev` shows.
function(sentree_unite target batch)
  if(SENTREE_UNITY)
    set_target_properties(${target} PROPERTIES UNITY_BUILD ON UNITY_BUILD_BATCH_SIZE ${batch})
    # Said of headers, which the sources here are to the compiler.
    target_compile_options(${target} PRIVATE $<$<CXX_COMPILER_ID:GNU>:-Wno-subobject-linkage>)
  endif()
endfunction()

# sentree_library(NAME [DEPENDS sentree libraries…] [PUBLIC others…] [PRIVATE others…])
#
# The folder is the library: every x.cpp belongs to it, every x_test.cpp to its test program NAME_test
# (a ctest per TEST, labelled NAME), every x.h is public and must compile alone.
function(sentree_library name)
  cmake_parse_arguments(arg "" "" "DEPENDS;PUBLIC;PRIVATE" ${ARGN})
  file(GLOB sources CONFIGURE_DEPENDS *.cpp)
  file(GLOB headers CONFIGURE_DEPENDS *.h)
  file(GLOB tests CONFIGURE_DEPENDS *_test.cpp)
  list(FILTER sources EXCLUDE REGEX "_test\\.cpp$")

  add_library(sentree_${name} STATIC ${sources})
  add_library(sentree::${name} ALIAS sentree_${name})
  set_target_properties(sentree_${name} PROPERTIES EXPORT_NAME ${name})
  target_include_directories(sentree_${name} PUBLIC
    $<BUILD_INTERFACE:${PROJECT_SOURCE_DIR}/include> $<INSTALL_INTERFACE:${CMAKE_INSTALL_INCLUDEDIR}>)
  target_compile_features(sentree_${name} PUBLIC cxx_std_20)
  list(TRANSFORM arg_DEPENDS PREPEND sentree::)
  target_link_libraries(sentree_${name} PUBLIC ${arg_DEPENDS} ${arg_PUBLIC}
    PRIVATE ${arg_PRIVATE} $<BUILD_INTERFACE:sentree_options>)
  target_precompile_headers(sentree_${name} REUSE_FROM sentree_precompiled)
  sentree_unite(sentree_${name} 12)
  set_property(GLOBAL APPEND PROPERTY SENTREE_LIBRARIES ${name})

  if(SENTREE_TESTS)
    if(SENTREE_HEADERS_ALONE)
      sentree_headers_compile_alone(${name} ${headers})
    endif()
    if(tests)
      sentree_test(${name}_test SOURCES ${tests} LIBRARIES sentree::${name} ${arg_PRIVATE} LABEL ${name})
    endif()
  endif()
endfunction()

# sentree_test(NAME SOURCES … LIBRARIES … [LABEL …]): a GoogleTest program; each TEST is a ctest.
function(sentree_test name)
  cmake_parse_arguments(arg "" "LABEL" "SOURCES;LIBRARIES" ${ARGN})
  add_executable(${name} ${arg_SOURCES})
  target_link_libraries(${name} PRIVATE ${arg_LIBRARIES} GTest::gmock GTest::gtest_main sentree_options)
  sentree_unite(${name} 12)
  if(SENTREE_UNITY)
    target_compile_definitions(${name} PRIVATE
      SENTREE_SOURCE_DIR="${PROJECT_SOURCE_DIR}" SENTREE_BINARY_DIR="${PROJECT_BINARY_DIR}")
    set(arg_SOURCES)
  endif()
  # Only where they are used: objects that name no folder are the same in every clone, and so cached for all.
  foreach(source IN LISTS arg_SOURCES)
    get_filename_component(source ${source} ABSOLUTE)
    if(NOT EXISTS ${source})
      continue()  # objects of another target
    endif()
    file(STRINGS ${source} used REGEX "SENTREE_(SOURCE|BINARY)_DIR|_support\\.h|_fixture\\.h" LIMIT_COUNT 1)
    if(used)
      set_property(SOURCE ${source} APPEND PROPERTY COMPILE_DEFINITIONS
        SENTREE_SOURCE_DIR="${PROJECT_SOURCE_DIR}" SENTREE_BINARY_DIR="${PROJECT_BINARY_DIR}")
    endif()
  endforeach()
  sentree_quickly_compiled(${name})
  target_precompile_headers(${name} REUSE_FROM sentree_precompiled_tests)
  gtest_discover_tests(${name} PROPERTIES LABELS "${arg_LABEL}" TIMEOUT 600 DISCOVERY_TIMEOUT 300)
endfunction()

# A translation unit per header that includes nothing else: a header that leans on another's includes does not build.
function(sentree_headers_compile_alone name)
  set(units)
  foreach(header IN LISTS ARGN)
    get_filename_component(stem ${header} NAME_WE)
    set(unit ${CMAKE_CURRENT_BINARY_DIR}/alone/${stem}.cpp)
    file(CONFIGURE OUTPUT ${unit} CONTENT "#include \"sentree/${name}/${stem}.h\"\n" @ONLY)
    list(APPEND units ${unit})
  endforeach()
  if(units)
    add_library(sentree_${name}_headers OBJECT ${units})
    target_link_libraries(sentree_${name}_headers PRIVATE sentree::${name} sentree_options)
  endif()
endfunction()
