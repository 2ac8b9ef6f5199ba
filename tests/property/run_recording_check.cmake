# SPDX-License-Identifier: BSD-3-Clause
# Runs a scene with 1, 2 and 3 threads and once more, demands that every recording says the same, and
# checks one of them by CGAL. Arguments: DYOP and CHECK (programs), SCENE, WORK_DIR, END (time; the
# scene's own if empty), MODELS (directories, separated by colons).
cmake_minimum_required(VERSION 3.24)

include(${CMAKE_CURRENT_LIST_DIR}/../support/run.cmake)

string(REPLACE ":" ";" directories "$ENV{DYOP_MESH_PATH}:${MODELS}")
find_file(bunny bunny.obj PATHS ${directories} NO_DEFAULT_PATH NO_CACHE)
if(NOT bunny)
  message("skipped: no bunny.obj (Debian package glmark2-data)")
  return()
endif()
get_filename_component(models ${bunny} DIRECTORY)

file(REMOVE_RECURSE ${WORK_DIR})
file(READ ${SCENE} scene)
if(END)
  string(JSON scene SET "${scene}" time end ${END})
endif()
file(WRITE ${WORK_DIR}/scene.json "${scene}")
foreach(threads 1 2 3 1)
  run(${DYOP} simulate ${WORK_DIR}/scene.json --mesh-path ${models} --threads ${threads}
      -o ${WORK_DIR}/${threads}.h5)
  run(${DYOP} info ${WORK_DIR}/${threads}.h5 --json-lines)
  string(SHA256 sum "${output}")
  if(NOT DEFINED expected)
    set(expected ${sum})
  elseif(NOT sum STREQUAL expected)
    message(FATAL_ERROR "the recording with --threads ${threads} differs from the first one")
  endif()
endforeach()
set(ENV{DYOP_MESH_PATH} ${models})
run(${CHECK} ${WORK_DIR}/scene.json ${WORK_DIR}/1.h5 4)
message("${output}")
