# SPDX-License-Identifier: BSD-3-Clause
# Install and export: one component per target, so that who needs queries only needs no SUNDIALS and
# no mesh files. find_package(dyop) gives dyop::dyop; COMPONENTS dynamics io ... adds those.
include(CMakePackageConfigHelpers)
set(dyop_cmake_dir ${CMAKE_INSTALL_LIBDIR}/cmake/dyop)
file(RELATIVE_PATH DYOP_PC_TO_PREFIX "/${CMAKE_INSTALL_LIBDIR}/pkgconfig" "/")  # can be moved

# dyop_install_component(<component> [NEEDS <component...>] [PACKAGES <CMake package...>]
#                        [PC_PACKAGES <pkg-config package...>] [PC_LIBRARIES <flag...>]
#                        [PC_PUBLIC <flag...>] [PC_CFLAGS <flag...>])
# What the component's static library links, once for CMake and once for pkg-config: a shared library
# brings its own. PC_PUBLIC and PC_CFLAGS are for what its headers include. A component that is not built is skipped. For a new library one call below is all.
function(dyop_install_component component)
  cmake_parse_arguments(ARG "" "" "NEEDS;PACKAGES;PC_PACKAGES;PC_LIBRARIES;PC_PUBLIC;PC_CFLAGS" ${ARGN})
  set(target dyop_${component})
  if(component STREQUAL "dyop")
    set(target dyop)
  endif()
  if(NOT TARGET ${target})
    return()
  endif()
  install(TARGETS ${target} EXPORT dyop-${component}
          ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR}
          LIBRARY DESTINATION ${CMAKE_INSTALL_LIBDIR}
          FILE_SET HEADERS DESTINATION ${CMAKE_INSTALL_INCLUDEDIR})
  install(EXPORT dyop-${component} FILE dyop-${component}.cmake NAMESPACE dyop::
          DESTINATION ${dyop_cmake_dir})

  if(BUILD_SHARED_LIBS)
    set(ARG_PACKAGES "")
  endif()
  set(lines "set(_dyop_${component}_needs ${ARG_NEEDS})\nset(_dyop_${component}_packages ${ARG_PACKAGES})\n")
  set_property(GLOBAL APPEND PROPERTY dyop_components ${component})
  set_property(GLOBAL APPEND_STRING PROPERTY dyop_component_lines "${lines}")

  # pkg-config wants the files of all packages that a file names, also of private ones: a shared
  # library, which brings what it links, names none.
  set(needs "")
  foreach(need ${ARG_NEEDS})
    if(need STREQUAL "dyop")
      list(APPEND needs dyop)
    else()
      list(APPEND needs dyop-${need})
    endif()
  endforeach()
  string(REPLACE "_" "-" DYOP_PC_NAME ${target})
  string(REPLACE "_" "-" needs "${needs}")
  set(DYOP_PC_LIBRARY ${target})
  if(component STREQUAL "dyop")
    list(APPEND needs eigen3)
  endif()
  set(flags ${ARG_PC_PUBLIC})
  if(NOT BUILD_SHARED_LIBS)
    list(APPEND needs ${ARG_PC_PACKAGES})
    list(APPEND flags ${ARG_PC_LIBRARIES})
  endif()
  list(JOIN needs " " DYOP_PC_REQUIRES)
  list(TRANSFORM flags PREPEND " ")
  list(JOIN flags "" DYOP_PC_LIBS)
  set(DYOP_PC_CFLAGS ${ARG_PC_CFLAGS})
  list(TRANSFORM DYOP_PC_CFLAGS PREPEND " ")
  list(JOIN DYOP_PC_CFLAGS "" DYOP_PC_CFLAGS)
  configure_file(${PROJECT_SOURCE_DIR}/src/dyop.pc.in ${PROJECT_BINARY_DIR}/${DYOP_PC_NAME}.pc @ONLY)
  install(FILES ${PROJECT_BINARY_DIR}/${DYOP_PC_NAME}.pc DESTINATION ${CMAKE_INSTALL_LIBDIR}/pkgconfig)
endfunction()

set(dyop_io_packages ZLIB tinyxml2 yaml-cpp)
set(dyop_io_pc_packages zlib tinyxml2 yaml-cpp)
if(DYOP_WITH_ASSIMP)
  list(APPEND dyop_io_packages assimp)
  list(APPEND dyop_io_pc_packages assimp)
endif()
dyop_install_component(dyop PACKAGES ccd TBB Threads PC_PACKAGES ccd tbb PC_LIBRARIES -lpthread)
dyop_install_component(paper NEEDS dyop PACKAGES ccd PC_PACKAGES ccd)
dyop_install_component(chain NEEDS dyop)
# Its headers include those of OMPL, whose own file for pkg-config names a folder that is none.
# Its other folders are the compiler's own, and Eigen's.
set(dyop_ompl_cflags ${OMPL_INCLUDE_DIRS} ${OMPL_INCLUDE_DIR})
list(FILTER dyop_ompl_cflags INCLUDE REGEX "ompl")
list(REMOVE_DUPLICATES dyop_ompl_cflags)
list(TRANSFORM dyop_ompl_cflags PREPEND "-isystem ")
dyop_install_component(ompl NEEDS chain PC_PUBLIC -lompl PC_CFLAGS ${dyop_ompl_cflags})
dyop_install_component(contact NEEDS dyop)
dyop_install_component(haptics NEEDS contact)
dyop_install_component(tissue NEEDS haptics)
dyop_install_component(dynamics NEEDS contact PACKAGES SUNDIALS
                       PC_LIBRARIES -lsundials_arkode -lsundials_cvode -lsundials_nvecserial)
dyop_install_component(io NEEDS chain PACKAGES ${dyop_io_packages} PC_PACKAGES ${dyop_io_pc_packages})
set(dyop_recording_needs dynamics io)
if(TARGET dyop_haptics)
  list(APPEND dyop_recording_needs haptics)
endif()
dyop_install_component(recording NEEDS ${dyop_recording_needs} PC_PACKAGES hdf5-serial)
set(dyop_scene_io_needs dynamics io)
if(TARGET dyop_recording)
  list(APPEND dyop_scene_io_needs recording)
endif()
dyop_install_component(scene_io NEEDS ${dyop_scene_io_needs})
dyop_install_component(c NEEDS dynamics chain haptics PC_LIBRARIES -lstdc++ -lm)
set(dyop_view_libraries "")
if(DYOP_HTTPLIB_LIBRARY)
  list(APPEND dyop_view_libraries -lcpp-httplib)
endif()
set(dyop_haptics_io_needs tissue io)
if(TARGET dyop_recording)
  list(APPEND dyop_haptics_io_needs recording)
endif()
dyop_install_component(haptics_io NEEDS ${dyop_haptics_io_needs})
dyop_install_component(c_io NEEDS c scene_io haptics_io)
set(dyop_view_needs scene_io)
if(TARGET dyop_recording AND TARGET dyop_haptics_io)
  list(APPEND dyop_view_needs haptics_io)
endif()
dyop_install_component(view NEEDS ${dyop_view_needs} PACKAGES ZLIB Threads PC_PACKAGES zlib
                       PC_LIBRARIES ${dyop_view_libraries})

get_property(DYOP_COMPONENTS GLOBAL PROPERTY dyop_components)
get_property(DYOP_COMPONENT_LINES GLOBAL PROPERTY dyop_component_lines)
configure_package_config_file(${CMAKE_CURRENT_LIST_DIR}/dyopConfig.cmake.in
                              ${PROJECT_BINARY_DIR}/dyopConfig.cmake
                              INSTALL_DESTINATION ${dyop_cmake_dir})
write_basic_package_version_file(${PROJECT_BINARY_DIR}/dyopConfigVersion.cmake
                                 COMPATIBILITY SameMinorVersion)
install(FILES ${PROJECT_BINARY_DIR}/dyopConfig.cmake ${PROJECT_BINARY_DIR}/dyopConfigVersion.cmake
        DESTINATION ${dyop_cmake_dir})

if(TARGET dyop_cli)
  file(RELATIVE_PATH bin_to_lib "/${CMAKE_INSTALL_BINDIR}" "/${CMAKE_INSTALL_LIBDIR}")
  set_target_properties(dyop_cli PROPERTIES INSTALL_RPATH "$ORIGIN/${bin_to_lib}")
  install(TARGETS dyop_cli RUNTIME DESTINATION ${CMAKE_INSTALL_BINDIR})
  if(TARGET dyop_check)
    install(TARGETS dyop_check RUNTIME DESTINATION ${CMAKE_INSTALL_BINDIR})
  endif()
endif()
include(adapters/CMakeLists.txt)
if(PROJECT_IS_TOP_LEVEL)
  install(FILES ${PROJECT_SOURCE_DIR}/LICENSE ${PROJECT_SOURCE_DIR}/README.md
          DESTINATION ${CMAKE_INSTALL_DOCDIR})
  install(DIRECTORY ${PROJECT_SOURCE_DIR}/docs DESTINATION ${CMAKE_INSTALL_DOCDIR})
endif()
