# Qt SCXML in the same run, where it is installed (qt6-scxml-dev).
find_package(Qt6 QUIET COMPONENTS Core Scxml)
if(Qt6Scxml_FOUND)
  target_sources(scxml_bench PRIVATE scxml_bench_qt.cpp)
  target_link_libraries(scxml_bench PRIVATE Qt6::Core Qt6::Scxml)
  target_compile_definitions(scxml_bench PRIVATE SENTREE_BENCH_QT)
endif()
