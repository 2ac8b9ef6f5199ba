# Builds and runs a project that uses dyop the way KIND says: find_package, add_subdirectory or
# pkg_config. Arguments: KIND, SOURCE_DIR (of dyop), BINARY_DIR (of dyop), WORK_DIR, COMPILER.
function(run)
  execute_process(COMMAND ${ARGV} RESULT_VARIABLE code OUTPUT_VARIABLE output ERROR_VARIABLE output)
  if(NOT code EQUAL 0)
    list(JOIN ARGV " " command)
    message(FATAL_ERROR "failed (${code}): ${command}\n${output}")
  endif()
endfunction()

file(REMOVE_RECURSE ${WORK_DIR})
set(consumers ${SOURCE_DIR}/tests/consumer)
set(configure ${CMAKE_COMMAND} -G Ninja -DCMAKE_BUILD_TYPE=Release -DCMAKE_CXX_COMPILER=${COMPILER})
if(NOT KIND STREQUAL "add_subdirectory")
  run(${CMAKE_COMMAND} --install ${BINARY_DIR} --prefix ${WORK_DIR}/prefix)
endif()

if(KIND STREQUAL "find_package")
  run(${configure} -S ${consumers}/find_package -B ${WORK_DIR}/build
      -DCMAKE_PREFIX_PATH=${WORK_DIR}/prefix)
  run(${CMAKE_COMMAND} --build ${WORK_DIR}/build)
  run(${WORK_DIR}/build/stepping)
elseif(KIND STREQUAL "add_subdirectory")
  run(${configure} -S ${consumers}/add_subdirectory -B ${WORK_DIR}/build
      -DDYOP_SOURCE_DIR=${SOURCE_DIR})
  run(${CMAKE_COMMAND} --build ${WORK_DIR}/build --target consumer)
else()
  file(MAKE_DIRECTORY ${WORK_DIR}/build)
  file(GLOB_RECURSE pc ${WORK_DIR}/prefix/*/dyop.pc)
  get_filename_component(pc_dir ${pc} DIRECTORY)
  set(ENV{PKG_CONFIG_PATH} ${pc_dir})
  execute_process(COMMAND pkg-config --static --cflags --libs dyop OUTPUT_VARIABLE flags OUTPUT_STRIP_TRAILING_WHITESPACE
                  COMMAND_ERROR_IS_FATAL ANY)
  separate_arguments(flags UNIX_COMMAND "${flags}")
  run(${COMPILER} -std=c++20 ${consumers}/find_package/main.cpp -o ${WORK_DIR}/build/consumer ${flags})
endif()
run(${WORK_DIR}/build/consumer)
