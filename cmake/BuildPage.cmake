# cmake -P: builds web/ and makes the C++ file that holds it. Without the packages of npm (no network), the program is
# built all the same, and says how to get the page.
# Variables: WEB (its folder), OUT (of the results), NPM, NODE, SCRIPT (embed_page.mjs).

function(give_up why)
  message(WARNING "The studio's web page is not built: ${why}. Everything else is; to try again, delete ${OUT}/page.cpp and build.")
  file(WRITE ${OUT}/page.cpp "#include \"sentree/studio/assets.h\"\n\nnamespace sentree::studio {\n\nstd::span<const Asset> embedded_assets() { return {}; }\n\n}  // namespace sentree::studio\n")
endfunction()

file(MAKE_DIRECTORY ${OUT})
# The packages lie beside the sources, where editors look for them; one build of several gets them.
file(LOCK ${OUT}/../page.lock GUARD PROCESS TIMEOUT 600)
set(installed ${WEB}/node_modules/.package-lock.json)
if(NOT EXISTS ${installed} OR ${WEB}/package-lock.json IS_NEWER_THAN ${installed})
  execute_process(COMMAND ${NPM} ci --no-audit --no-fund --prefer-offline WORKING_DIRECTORY ${WEB}
    RESULT_VARIABLE failed OUTPUT_VARIABLE said ERROR_VARIABLE said)
  if(failed)
    give_up("npm ci failed: ${said}")
    return()
  endif()
  file(TOUCH ${installed})
endif()
execute_process(COMMAND ${NPM} run --silent build -- --outDir ${OUT}/dist --emptyOutDir --logLevel warn
  WORKING_DIRECTORY ${WEB} RESULT_VARIABLE failed OUTPUT_VARIABLE said ERROR_VARIABLE said)
if(failed)
  message(FATAL_ERROR "npm run build failed in ${WEB}:\n${said}")
endif()
execute_process(COMMAND ${NODE} ${SCRIPT} ${OUT}/dist ${OUT} RESULT_VARIABLE failed)
if(failed)
  message(FATAL_ERROR "${SCRIPT} failed")
endif()
