# SPDX-License-Identifier: BSD-3-Clause
# Installs the Python package of BINARY_DIR into PREFIX and runs EXAMPLE with it from there.
file(REMOVE_RECURSE ${PREFIX})
execute_process(COMMAND ${CMAKE_COMMAND} --install ${BINARY_DIR} --component python --prefix ${PREFIX}
                COMMAND_ERROR_IS_FATAL ANY OUTPUT_QUIET)
set(ENV{PYTHONPATH} ${PREFIX}/lib/python3/dist-packages)
execute_process(COMMAND ${PYTHON} -c "import dyop; print(dyop.__file__)" OUTPUT_VARIABLE file
                WORKING_DIRECTORY ${PREFIX} COMMAND_ERROR_IS_FATAL ANY)
if(NOT file MATCHES "^${PREFIX}/lib/python3/dist-packages/dyop/")
  message(FATAL_ERROR "imported from ${file}")
endif()
execute_process(COMMAND ${PYTHON} ${EXAMPLE} WORKING_DIRECTORY ${PREFIX} COMMAND_ERROR_IS_FATAL ANY)
