# `cmake --install`: the program, its plugins, the library with its headers, and the data; find_package(tether) finds the library.
include(CMakePackageConfigHelpers)
set(package_folder ${CMAKE_INSTALL_LIBDIR}/cmake/tether)
install(TARGETS tether DESTINATION ${CMAKE_INSTALL_BINDIR})
install(EXPORT tether NAMESPACE tether:: DESTINATION ${package_folder})
configure_package_config_file(cmake/tetherConfig.cmake.in ${CMAKE_BINARY_DIR}/tetherConfig.cmake
                              INSTALL_DESTINATION ${package_folder})
write_basic_package_version_file(${CMAKE_BINARY_DIR}/tetherConfigVersion.cmake COMPATIBILITY SameMinorVersion)
install(FILES ${CMAKE_BINARY_DIR}/tetherConfig.cmake ${CMAKE_BINARY_DIR}/tetherConfigVersion.cmake cmake/mujoco.cmake
        DESTINATION ${package_folder})
install(DIRECTORY models scenarios DESTINATION ${CMAKE_INSTALL_DATADIR}/tether)
