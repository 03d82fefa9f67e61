# Installs the build, builds examples/outside against it, and runs both programs: cmake -DBUILD=… -DSOURCE=… -P this.
# The prefix is beside the build, not the one that was configured.
set(prefix ${BUILD}/install_test/prefix)
file(REMOVE_RECURSE ${BUILD}/install_test)

function(run)
  execute_process(COMMAND ${ARGN} RESULT_VARIABLE code OUTPUT_VARIABLE output ERROR_VARIABLE output)
  if(NOT code EQUAL 0)
    message(FATAL_ERROR "${ARGN}: ${code}\n${output}")
  endif()
  set(output "${output}" PARENT_SCOPE)
endfunction()

run(${CMAKE_COMMAND} --install ${BUILD} --prefix ${prefix})
# The installed program finds its data and its plugins beside itself.
run(${prefix}/bin/tether plan ${prefix}/share/tether/scenarios/hanoi.yaml --solver ipopt --max-plans 1)
run(${CMAKE_COMMAND} -S ${SOURCE}/examples/outside -B ${BUILD}/install_test/outside -DCMAKE_PREFIX_PATH=${prefix}
    -DCMAKE_BUILD_TYPE=Release)
run(${CMAKE_COMMAND} --build ${BUILD}/install_test/outside)
run(${CMAKE_COMMAND} -E env TETHER_DATA_DIR=${prefix}/share/tether ${BUILD}/install_test/outside/plan_scenario)
if(NOT output MATCHES "pick")
  message(FATAL_ERROR "examples/outside prints:\n${output}")
endif()
