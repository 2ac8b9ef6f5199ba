# SPDX-License-Identifier: BSD-3-Clause
# Runs a generated scene, and checks by CGAL that no two bodies intersect where its page and its glTF
# file draw them. Arguments: DYOP, CHECK, NODE (programs), POSES (script), PAGE_SOURCES, KIND and SIZE
# of the scene, COUNT of times, WORK_DIR.
cmake_minimum_required(VERSION 3.24)

function(run)
  execute_process(COMMAND ${ARGV} RESULT_VARIABLE code OUTPUT_VARIABLE output ERROR_VARIABLE output)
  if(NOT code EQUAL 0)
    list(JOIN ARGV " " command)
    message(FATAL_ERROR "failed (${code}): ${command}\n${output}")
  endif()
  set(output "${output}" PARENT_SCOPE)
endfunction()

file(REMOVE_RECURSE ${WORK_DIR})
file(MAKE_DIRECTORY ${WORK_DIR})
set(scene ${WORK_DIR}/scene.json)
run(${DYOP} scene ${KIND} ${SIZE} --out ${scene})
run(${DYOP} simulate ${scene} --out ${WORK_DIR}/run --record ${WORK_DIR}/run.h5 --no-progress)
run(${DYOP} view ${WORK_DIR}/run.h5 -o ${WORK_DIR}/run.html)
run(${DYOP} export ${WORK_DIR}/run.h5 -o ${WORK_DIR}/run.glb)
foreach(drawn run.html run.glb)
  run(${NODE} ${POSES} ${PAGE_SOURCES} ${scene} ${WORK_DIR}/${drawn} ${COUNT}
      ${WORK_DIR}/${drawn}.poses.json)
  run(${CHECK} ${scene} ${WORK_DIR}/${drawn}.poses.json)
  message("${KIND} ${SIZE}, ${drawn}: ${output}")
endforeach()
