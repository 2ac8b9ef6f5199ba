# SPDX-License-Identifier: BSD-3-Clause
# Runs a generated scene, and checks by CGAL that no two bodies intersect where its page and its glTF
# file draw them. Arguments: DYOP, CHECK, NODE (programs), POSES (script), PAGE_SOURCES, KIND and SIZE
# of the scene, COUNT of times, WORK_DIR.
cmake_minimum_required(VERSION 3.24)

include(${CMAKE_CURRENT_LIST_DIR}/../support/run.cmake)

file(REMOVE_RECURSE ${WORK_DIR})
file(MAKE_DIRECTORY ${WORK_DIR})
set(scene ${WORK_DIR}/scene.json)
run(${DYOP} scene ${KIND} ${SIZE} --out ${scene})
run(${DYOP} simulate ${scene} -o ${WORK_DIR}/run.h5 --no-progress)
run(${DYOP} view ${WORK_DIR}/run.h5 -o ${WORK_DIR}/run.html)
run(${DYOP} export ${WORK_DIR}/run.h5 -o ${WORK_DIR}/run.glb)
foreach(drawn run.html run.glb)
  run(${NODE} ${POSES} ${PAGE_SOURCES} ${scene} ${WORK_DIR}/${drawn} ${COUNT}
      ${WORK_DIR}/${drawn}.poses.json)
  run(${CHECK} ${scene} ${WORK_DIR}/${drawn}.poses.json)
  message("${KIND} ${SIZE}, ${drawn}: ${output}")
endforeach()
