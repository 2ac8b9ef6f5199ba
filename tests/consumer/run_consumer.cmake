# SPDX-License-Identifier: BSD-3-Clause
# Builds and runs projects that use dyop the way KIND says:
#   find_package      installed static libraries, with components; an unknown component is named
#   pkg_config        the same, through pkg-config
#   shared            both with shared libraries of their own; the installed command runs
#   add_subdirectory  queries only, built as Release without being told to
# Arguments: KIND, SOURCE_DIR (of dyop), BINARY_DIR (of dyop), WORK_DIR, COMPILER.
include(${CMAKE_CURRENT_LIST_DIR}/../support/run.cmake)

file(REMOVE_RECURSE ${WORK_DIR})
set(consumers ${SOURCE_DIR}/tests/consumer)
set(configure ${CMAKE_COMMAND} -G Ninja -DCMAKE_CXX_COMPILER=${COMPILER})

function(check_find_package prefix)
  run(${configure} -DCMAKE_BUILD_TYPE=Release -S ${consumers}/find_package -B ${WORK_DIR}/find_package
      -DCMAKE_PREFIX_PATH=${prefix})
  run(${CMAKE_COMMAND} --build ${WORK_DIR}/find_package)
  run(${WORK_DIR}/find_package/consumer)
  run(${WORK_DIR}/find_package/stepping)
  execute_process(COMMAND ${configure} -S ${consumers}/missing_component -B ${WORK_DIR}/missing
                          -DCMAKE_PREFIX_PATH=${prefix}
                  RESULT_VARIABLE code OUTPUT_QUIET ERROR_VARIABLE output)
  if(code EQUAL 0 OR NOT output MATCHES "without the component[ \n]+'gravity'")
    message(FATAL_ERROR "a missing component is not named: ${output}")
  endif()
endfunction()

# How pkg-config names the libraries of each program.
function(check_pkg_config prefix option)
  file(MAKE_DIRECTORY ${WORK_DIR}/pkg_config)
  file(GLOB_RECURSE pc ${prefix}/*/dyop.pc)
  get_filename_component(pc_dir ${pc} DIRECTORY)
  set(ENV{PKG_CONFIG_PATH} ${pc_dir})
  foreach(program_packages "main dyop" "stepping dyop-dynamics dyop-io" "main dyop-scene-io dyop-paper")
    separate_arguments(packages UNIX_COMMAND "${program_packages}")
    list(POP_FRONT packages program)
    run(pkg-config ${option} --cflags --libs ${packages})
    separate_arguments(flags UNIX_COMMAND "${output}")
    run(${COMPILER} -std=c++20 ${consumers}/find_package/${program}.cpp
        -o ${WORK_DIR}/pkg_config/${program} ${flags} -Wl,-rpath,${pc_dir}/..)
    run(${WORK_DIR}/pkg_config/${program})
  endforeach()
endfunction()

if(KIND STREQUAL "add_subdirectory")
  run(${configure} -S ${consumers}/add_subdirectory -B ${WORK_DIR}/build -DDYOP_SOURCE_DIR=${SOURCE_DIR}
      -DCMAKE_UNITY_BUILD=ON)
  if(NOT output MATCHES "dyop is built as Release")
    message(FATAL_ERROR "the build type is not named: ${output}")
  endif()
  file(READ ${WORK_DIR}/build/build.ninja rules)
  if(NOT rules MATCHES "-O3[^\n]*-ffp-contract=off")
    message(FATAL_ERROR "dyop is not optimised as a subproject without a build type")
  endif()
  run(${CMAKE_COMMAND} --build ${WORK_DIR}/build --target consumer)
  run(${WORK_DIR}/build/consumer)
  return()
endif()

set(prefix ${WORK_DIR}/prefix)
if(KIND STREQUAL "shared")
  # From the objects of this build, which are position-independent and hide the same symbols: what
  # counts here is what is linked and installed.
  file(STRINGS ${BINARY_DIR}/CMakeCache.txt unity REGEX "^CMAKE_UNITY_BUILD:")
  string(REGEX REPLACE ".*=" "" unity "${unity}")
  set(ENV{DYOP_REUSED_BUILD} ${BINARY_DIR})
  run(${configure} -S ${SOURCE_DIR} -B ${WORK_DIR}/dyop -DBUILD_SHARED_LIBS=ON -DDYOP_BUILD_TESTS=OFF
      -DCMAKE_BUILD_TYPE=Release -DCMAKE_UNITY_BUILD=${unity} -DDYOP_BUILD_EXAMPLES=OFF
      -DCMAKE_CXX_COMPILER_LAUNCHER=${CMAKE_CURRENT_LIST_DIR}/reuse_object.sh
      -DDYOP_BUILD_PYTHON=OFF -DCMAKE_INSTALL_PREFIX=${prefix})
  run(${CMAKE_COMMAND} --build ${WORK_DIR}/dyop)
  run(${CMAKE_COMMAND} --install ${WORK_DIR}/dyop)
  run(${prefix}/bin/dyop --version)
else()
  run(${CMAKE_COMMAND} --install ${BINARY_DIR} --prefix ${prefix})
endif()
if(KIND STREQUAL "find_package" OR KIND STREQUAL "shared")
  check_find_package(${prefix})
endif()
if(KIND STREQUAL "pkg_config" OR KIND STREQUAL "shared")
  check_pkg_config(${prefix} "")
endif()
if(KIND STREQUAL "pkg_config")
  check_pkg_config(${prefix} --static)
endif()
file(GLOB_RECURSE licence ${prefix}/*/LICENSE)
if(NOT licence)
  message(FATAL_ERROR "the licence is not installed")
endif()
