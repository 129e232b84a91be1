# Warnings, sanitizers, and the faster tools where the machine has them.

add_library(sentree_options INTERFACE)
target_compile_options(sentree_options INTERFACE -Wall -Wextra -Wpedantic -Wshadow -Wconversion -Wno-sign-conversion -Wno-missing-field-initializers
  -Wnon-virtual-dtor -Woverloaded-virtual $<$<BOOL:${SENTREE_WERROR}>:-Werror>
  # One rounding on every machine: the same seed gives the same run.
  -ffp-contract=off)

if(SENTREE_SANITIZE)
  add_compile_options(-fsanitize=${SENTREE_SANITIZE} -fno-omit-frame-pointer -fno-sanitize-recover=all)
  add_link_options(-fsanitize=${SENTREE_SANITIZE})
endif()

find_program(SENTREE_CCACHE ccache)
if(SENTREE_CCACHE AND NOT CMAKE_CXX_COMPILER_LAUNCHER)
  # Without this, ccache does not keep what was compiled with a precompiled header.
  set(CMAKE_CXX_COMPILER_LAUNCHER ${CMAKE_COMMAND} -E env CCACHE_SLOPPINESS=pch_defines,time_macros ${SENTREE_CCACHE})
  if(CMAKE_CXX_COMPILER_ID STREQUAL "GNU")
    add_compile_options(-fpch-preprocess)
  endif()
endif()

# mold knows g++ 12 by -fuse-ld=mold; lld is the next best.
find_program(SENTREE_MOLD mold)
find_program(SENTREE_LLD ld.lld)
if(SENTREE_MOLD)
  add_link_options(-fuse-ld=mold)
elseif(SENTREE_LLD)
  add_link_options(-fuse-ld=lld)
endif()
