# Measures generated code beside ours, so it needs the Thrift compiler.
find_package(PkgConfig REQUIRED)
pkg_check_modules(bench_thrift REQUIRED IMPORTED_TARGET thrift)
find_program(SENTREE_THRIFT_COMPILER thrift)
set(gen ${CMAKE_CURRENT_BINARY_DIR}/rpc_bench_gen)
file(MAKE_DIRECTORY ${gen})
set(generated ${gen}/Robot.cpp ${gen}/rpc_bench_types.cpp)
add_custom_command(OUTPUT ${generated}
  COMMAND ${SENTREE_THRIFT_COMPILER} --gen cpp:no_skeleton -out ${gen} ${CMAKE_CURRENT_SOURCE_DIR}/rpc_bench.thrift
  DEPENDS rpc_bench.thrift VERBATIM)
add_library(rpc_bench_generated OBJECT EXCLUDE_FROM_ALL ${generated})
target_include_directories(rpc_bench_generated SYSTEM PUBLIC ${gen})
target_link_libraries(rpc_bench_generated PUBLIC PkgConfig::bench_thrift)
target_include_directories(rpc_bench SYSTEM PRIVATE ${gen})
target_link_libraries(rpc_bench PRIVATE rpc_bench_generated PkgConfig::bench_thrift)
target_compile_definitions(rpc_bench PRIVATE SENTREE_BENCH_IDL="${CMAKE_CURRENT_SOURCE_DIR}/rpc_bench.thrift")
