target_link_libraries(yarp_bench PRIVATE sentree::runtime)
