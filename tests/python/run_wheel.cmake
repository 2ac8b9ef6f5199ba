# SPDX-License-Identifier: BSD-3-Clause
# Installs SOURCE_DIR with pip, from the build in BINARY_DIR, into a fresh virtual environment in
# WORK_DIR, and runs EXAMPLE there. The wheel must bring the libraries that it loads. PYTHON's own
# packages stay visible: numpy cannot be fetched without a network.
file(REMOVE_RECURSE ${WORK_DIR})
file(MAKE_DIRECTORY ${WORK_DIR})
execute_process(COMMAND ${PYTHON} -m venv --system-site-packages ${WORK_DIR}/venv COMMAND_ERROR_IS_FATAL ANY)
execute_process(COMMAND ${WORK_DIR}/venv/bin/python -m pip wheel --no-deps --quiet
                        --disable-pip-version-check --wheel-dir ${WORK_DIR}
                        --config-settings build-dir=${BINARY_DIR} ${SOURCE_DIR}
                COMMAND_ERROR_IS_FATAL ANY)
file(GLOB wheels ${WORK_DIR}/dyop-*.whl)
list(LENGTH wheels count)
if(NOT count EQUAL 1)
  message(FATAL_ERROR "made ${count} wheels: ${wheels}")
endif()
execute_process(COMMAND ${WORK_DIR}/venv/bin/python -m pip install --no-index --quiet
                        --disable-pip-version-check ${wheels}
                COMMAND_ERROR_IS_FATAL ANY)
execute_process(COMMAND ${WORK_DIR}/venv/bin/python ${EXAMPLE} WORKING_DIRECTORY ${WORK_DIR} COMMAND_ERROR_IS_FATAL ANY)
execute_process(COMMAND ${WORK_DIR}/venv/bin/python -c
                        "from importlib.metadata import version; import dyop; assert version('dyop') == dyop.__version__; print(dyop._dyop.__file__)"
                WORKING_DIRECTORY ${WORK_DIR} COMMAND_ERROR_IS_FATAL ANY
                OUTPUT_VARIABLE module OUTPUT_STRIP_TRAILING_WHITESPACE)
if(NOT module MATCHES "^${WORK_DIR}/venv/")
  message(FATAL_ERROR "imported ${module}, which the wheel did not bring")
endif()

# Without patchelf a wheel cannot carry libraries, and its tag is that of this machine.
if(NOT wheels MATCHES "manylinux")
  message(STATUS "not checked: patchelf is missing, so the wheel carries no libraries")
  return()
endif()
execute_process(COMMAND ldd ${module} OUTPUT_VARIABLE loaded COMMAND_ERROR_IS_FATAL ANY)
string(REGEX MATCHALL "=> [^ ]+" paths "${loaded}")
foreach(path ${paths})
  if(NOT path MATCHES "^=> ${WORK_DIR}/venv/" AND
     NOT path MATCHES "/(libc|libm|libdl|libpthread|librt|libresolv|libgcc_s|libstdc\\+\\+)\\.so")
    message(FATAL_ERROR "the wheel loads ${path} of this machine")
  endif()
endforeach()
