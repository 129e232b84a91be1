# What a system wants of a program beside the program, and the Debian packages. scripts/package makes them.

set(share \$ENV{DESTDIR}\${CMAKE_INSTALL_PREFIX}/${CMAKE_INSTALL_DATADIR})
install(CODE "
  file(MAKE_DIRECTORY \"${share}/man/man1\" \"${share}/bash-completion/completions\" \"${share}/zsh/vendor-completions\"
    \"${share}/fish/vendor_completions.d\")
  file(GLOB old \"${share}/man/man1/sentree*.1.gz\")
  if(old)
    file(REMOVE \${old})
  endif()
  execute_process(COMMAND \"$<TARGET_FILE:sentree>\" __manual \"${share}/man/man1\" COMMAND_ERROR_IS_FATAL ANY)
  file(GLOB pages \"${share}/man/man1/sentree*.1\")
  execute_process(COMMAND gzip -9nf \${pages} COMMAND_ERROR_IS_FATAL ANY)
  foreach(shell IN ITEMS bash:bash-completion/completions/sentree zsh:zsh/vendor-completions/_sentree
      fish:fish/vendor_completions.d/sentree.fish)
    string(REPLACE \":\" \";\" shell \${shell})
    list(GET shell 1 file)
    list(GET shell 0 name)
    execute_process(COMMAND \"$<TARGET_FILE:sentree>\" completion \${name} OUTPUT_FILE \"${share}/\${file}\" COMMAND_ERROR_IS_FATAL ANY)
  endforeach()
" COMPONENT program)
install(DIRECTORY docs/tutorial DESTINATION ${CMAKE_INSTALL_DATADIR}/sentree COMPONENT program)
install(FILES packaging/sentree.desktop DESTINATION ${CMAKE_INSTALL_DATADIR}/applications COMPONENT program)
install(FILES packaging/sentree.xml DESTINATION ${CMAKE_INSTALL_DATADIR}/mime/packages COMPONENT program)
install(FILES web/public/icon.svg DESTINATION ${CMAKE_INSTALL_DATADIR}/icons/hicolor/scalable/apps RENAME sentree.svg COMPONENT program)

# All that the packages hold, without tests and benchmarks.
get_property(libraries GLOBAL PROPERTY SENTREE_LIBRARIES)
list(TRANSFORM libraries PREPEND sentree_)
add_custom_target(package_contents DEPENDS sentree ${libraries})
set(packages program:sentree development:libsentree-dev)
# What needs DDS is a package of its own: few have a robot with ROS 2, and it is larger than all else.
if(TARGET sentree_dds)
  add_dependencies(package_contents sentree_dds)
  list(APPEND packages ros:sentree-ros)
  install(TARGETS sentree_dds LIBRARY DESTINATION lib/sentree COMPONENT ros)
endif()

foreach(package IN LISTS packages)
  string(REPLACE ":" ";" package ${package})
  list(GET package 0 component)
  list(GET package 1 name)
  install(FILES packaging/copyright DESTINATION ${CMAKE_INSTALL_DATADIR}/doc/${name} COMPONENT ${component} EXCLUDE_FROM_ALL OPTIONAL)
  # scripts/package writes it; Debian's form, from the head of the clone.
  install(FILES ${PROJECT_BINARY_DIR}/packaging/changelog.gz DESTINATION ${CMAKE_INSTALL_DATADIR}/doc/${name}
    COMPONENT ${component} EXCLUDE_FROM_ALL OPTIONAL)
endforeach()

install(FILES ${PROJECT_BINARY_DIR}/packaging/page-notices DESTINATION ${CMAKE_INSTALL_DATADIR}/doc/sentree
  COMPONENT program EXCLUDE_FROM_ALL OPTIONAL)

set(CPACK_GENERATOR DEB)
set(CPACK_PACKAGE_NAME sentree)
set(CPACK_PACKAGE_VENDOR Sentree)
set(CPACK_PACKAGE_VERSION ${PROJECT_VERSION})
set(CPACK_PACKAGING_INSTALL_PREFIX /usr)
set(CPACK_STRIP_FILES ON)
set(CPACK_COMPONENTS_ALL program development)
if(TARGET sentree_dds)
  list(APPEND CPACK_COMPONENTS_ALL ros)
endif()
set(CPACK_INSTALL_DEFAULT_DIRECTORY_PERMISSIONS OWNER_READ OWNER_WRITE OWNER_EXECUTE GROUP_READ GROUP_EXECUTE WORLD_READ WORLD_EXECUTE)
set(CPACK_DEB_COMPONENT_INSTALL ON)
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_COMPRESSION_TYPE gzip)  # xz takes a minute longer, and saves a fifth
set(CPACK_DEBIAN_PACKAGE_CONTROL_STRICT_PERMISSION ON)
set(CPACK_DEBIAN_PROGRAM_PACKAGE_NAME sentree)
set(CPACK_DEBIAN_PROGRAM_PACKAGE_SECTION science)
set(CPACK_DEBIAN_PROGRAM_PACKAGE_SHLIBDEPS ON)
set(CPACK_DEBIAN_PROGRAM_PACKAGE_RECOMMENDS "xdg-utils")
set(CPACK_DEBIAN_ROS_PACKAGE_NAME sentree-ros)
set(CPACK_DEBIAN_ROS_PACKAGE_SECTION science)
set(CPACK_DEBIAN_ROS_PACKAGE_SHLIBDEPS ON)
set(CPACK_DEBIAN_ROS_PACKAGE_DEPENDS "sentree (= ${PROJECT_VERSION})")
set(CPACK_COMPONENT_ROS_DESCRIPTION "ROS 2 for Sentree
The command sentree with this package takes addresses ros:, the topics,
services and actions of robots with ROS 2, over Fast DDS. No ROS has to be
installed.")
set(CPACK_DEBIAN_PROGRAM_PACKAGE_SUGGESTS "librsvg2-bin, python3-thrift, sentree-ros")
set(CPACK_COMPONENT_PROGRAM_DESCRIPTION "design, execute, monitor and verify robot behaviours
Missions are Behavior Trees in the XML of Groot and BehaviorTree.CPP, skills
are state charts in W3C SCXML, and components are services defined in Thrift.
Monitors, written as charts or as sentences, watch every message between them.

The command runs missions in real or virtual time, in one process or several,
with a simulated robot or a real one; it shows them in a web page, records and
replays them, and tries every behaviour of a mission with models of its
components.")
set(CPACK_DEBIAN_DEVELOPMENT_PACKAGE_NAME libsentree-dev)
set(CPACK_DEBIAN_DEVELOPMENT_PACKAGE_SECTION libdevel)
set(CPACK_DEBIAN_DEVELOPMENT_PACKAGE_SUGGESTS "sentree (= ${PROJECT_VERSION})")
set(CPACK_COMPONENT_DEVELOPMENT_DESCRIPTION "C++ libraries of Sentree, for programs that embed it
Static libraries, headers and a CMake package of components: the Behavior Tree
engine with its executor, the state chart engine, monitors, the simulated
robot, recordings, and calls of Thrift services without generated code.

A program that only ticks trees links sentree::bt and needs none of the other
libraries.")
set(CPACK_PROJECT_CONFIG_FILE ${PROJECT_BINARY_DIR}/packaging/found.cmake)  # maintainer, dependencies: scripts/package
include(CPack)
