# Install and export: one component a target, so that who needs queries only needs no SUNDIALS and no
# mesh loader. find_package(dyop) gives dyop::dyop; COMPONENTS dynamics io adds those.
include(CMakePackageConfigHelpers)
set(dyop_cmake_dir ${CMAKE_INSTALL_LIBDIR}/cmake/dyop)

foreach(component dyop contact dynamics io)
  set(target dyop)
  if(NOT component STREQUAL "dyop")
    set(target dyop_${component})
  endif()
  if(NOT TARGET ${target})
    continue()
  endif()
  install(TARGETS ${target} EXPORT dyop-${component}
          ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR}
          LIBRARY DESTINATION ${CMAKE_INSTALL_LIBDIR}
          FILE_SET HEADERS DESTINATION ${CMAKE_INSTALL_INCLUDEDIR})
  install(EXPORT dyop-${component} FILE dyop-${component}.cmake NAMESPACE dyop::
          DESTINATION ${dyop_cmake_dir})
endforeach()

configure_package_config_file(${CMAKE_CURRENT_LIST_DIR}/dyopConfig.cmake.in
                              ${PROJECT_BINARY_DIR}/dyopConfig.cmake
                              INSTALL_DESTINATION ${dyop_cmake_dir})
write_basic_package_version_file(${PROJECT_BINARY_DIR}/dyopConfigVersion.cmake
                                 COMPATIBILITY SameMinorVersion)
install(FILES ${PROJECT_BINARY_DIR}/dyopConfig.cmake ${PROJECT_BINARY_DIR}/dyopConfigVersion.cmake
        DESTINATION ${dyop_cmake_dir})

# Relative, so that the installed tree can be moved.
file(RELATIVE_PATH DYOP_PC_TO_PREFIX "/${CMAKE_INSTALL_LIBDIR}/pkgconfig" "/")
configure_file(${CMAKE_CURRENT_LIST_DIR}/dyop.pc.in ${PROJECT_BINARY_DIR}/dyop.pc @ONLY)
install(FILES ${PROJECT_BINARY_DIR}/dyop.pc DESTINATION ${CMAKE_INSTALL_LIBDIR}/pkgconfig)
if(TARGET dyop_cli)
  install(TARGETS dyop_cli RUNTIME DESTINATION ${CMAKE_INSTALL_BINDIR})
endif()
