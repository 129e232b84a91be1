# cmake -DBUILD_DIR=… -DSOURCE_DIR=… -DWORK_DIR=… -P run.cmake: installs BUILD_DIR, compiles its headers, builds SOURCE_DIR against it, runs the program.

function(run)
  execute_process(COMMAND ${ARGV} RESULT_VARIABLE result OUTPUT_VARIABLE output ERROR_VARIABLE output)
  if(NOT result EQUAL 0)
    list(JOIN ARGV " " command)
    message(FATAL_ERROR "${command}\nended with ${result}:\n${output}")
  endif()
  set(output "${output}" PARENT_SCOPE)
endfunction()

file(REMOVE_RECURSE ${WORK_DIR})
run(${CMAKE_COMMAND} --install ${BUILD_DIR} --prefix ${WORK_DIR}/prefix)
# Every header that is installed compiles with nothing but what is installed. One unit has them all: that each stands alone the
# tree's own sources show, which include theirs first.
file(GLOB_RECURSE headers RELATIVE ${WORK_DIR}/prefix/include ${WORK_DIR}/prefix/include/sentree/*.h)
list(TRANSFORM headers REPLACE "(.+)" "#include \"\\1\"\n")
list(JOIN headers "" headers)
file(WRITE ${WORK_DIR}/headers.cpp "${headers}")
run(${CXX} -std=c++20 -fsyntax-only -I${WORK_DIR}/prefix/include ${WORK_DIR}/headers.cpp)
set(sanitize_flag)
if(SANITIZE)
  set(sanitize_flag -fsanitize=${SANITIZE})
endif()
# Thrift, Duktape and Boost are made impossible to find: a program that only ticks trees must not ask for them.
run(${CMAKE_COMMAND} -S ${SOURCE_DIR} -B ${WORK_DIR}/build -G ${GENERATOR} -DCMAKE_PREFIX_PATH=${WORK_DIR}/prefix
  -DCMAKE_CXX_COMPILER=${CXX} "-DCMAKE_CXX_FLAGS=${CXX_FLAGS} ${sanitize_flag}"
  -DCMAKE_DISABLE_FIND_PACKAGE_Boost=ON -DCMAKE_DISABLE_FIND_PACKAGE_PkgConfig=ON -DCMAKE_DISABLE_FIND_PACKAGE_Thrift=ON)
run(${CMAKE_COMMAND} --build ${WORK_DIR}/build)
run(${WORK_DIR}/build/program)
if(NOT output STREQUAL "SUCCESS\n")
  message(FATAL_ERROR "the program printed: ${output}")
endif()

# The example with C++ nodes of every kind, as it was installed, and its plug-in.
set(example ${WORK_DIR}/prefix/share/sentree/examples/cpp-nodes)
run(${CMAKE_COMMAND} -S ${example} -B ${WORK_DIR}/example -G ${GENERATOR} -DCMAKE_PREFIX_PATH=${WORK_DIR}/prefix
  -DCMAKE_CXX_COMPILER=${CXX} "-DCMAKE_CXX_FLAGS=${CXX_FLAGS} ${sanitize_flag}"
  -DCMAKE_DISABLE_FIND_PACKAGE_Boost=ON -DCMAKE_DISABLE_FIND_PACKAGE_PkgConfig=ON -DCMAKE_DISABLE_FIND_PACKAGE_Thrift=ON)
run(${CMAKE_COMMAND} --build ${WORK_DIR}/example)
run(${WORK_DIR}/example/patrol ${example}/mission.xml ${WORK_DIR}/example/libwaving.so)
if(NOT output MATCHES "the path has 5[.0]* m\n.*driving to .3, 4.\n  waving\n  waving\n.*thank you\nSUCCESS\n$")
  message(FATAL_ERROR "the example printed: ${output}")
endif()
