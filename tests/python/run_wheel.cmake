# SPDX-License-Identifier: BSD-3-Clause
# Makes a wheel of BINARY_DIR in WORK_DIR, unpacks it and runs EXAMPLE with it.
file(REMOVE_RECURSE ${WORK_DIR})
file(MAKE_DIRECTORY ${WORK_DIR}/site)
execute_process(COMMAND bash ${SCRIPT} ${BINARY_DIR} ${WORK_DIR} COMMAND_ERROR_IS_FATAL ANY)
file(GLOB wheels ${WORK_DIR}/dyop-*.whl)
list(LENGTH wheels count)
if(NOT count EQUAL 1)
  message(FATAL_ERROR "made ${count} wheels: ${wheels}")
endif()
execute_process(COMMAND ${PYTHON} -m zipfile -e ${wheels} ${WORK_DIR}/site COMMAND_ERROR_IS_FATAL ANY)
set(ENV{PYTHONPATH} ${WORK_DIR}/site)
execute_process(COMMAND ${PYTHON} ${EXAMPLE} WORKING_DIRECTORY ${WORK_DIR} COMMAND_ERROR_IS_FATAL ANY)
execute_process(COMMAND ${PYTHON} -c "from importlib.metadata import version; import dyop; assert version('dyop') == dyop.__version__"
                WORKING_DIRECTORY ${WORK_DIR} COMMAND_ERROR_IS_FATAL ANY)
