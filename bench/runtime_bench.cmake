# What recording a run costs.
target_link_libraries(runtime_bench PRIVATE sentree::replay)
