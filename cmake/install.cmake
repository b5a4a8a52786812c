# cmake --install: the command, the engine's library and headers, and a package for find_package(carom), which gives the
# target carom::engine.
include(CMakePackageConfigHelpers)
set(package_folder ${CMAKE_INSTALL_LIBDIR}/cmake/carom)

install(TARGETS carom RUNTIME DESTINATION ${CMAKE_INSTALL_BINDIR})
install(TARGETS carom_engine EXPORT carom_targets ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR}
                                                  LIBRARY DESTINATION ${CMAKE_INSTALL_LIBDIR})
install(DIRECTORY engine DESTINATION ${CMAKE_INSTALL_INCLUDEDIR} FILES_MATCHING PATTERN "*.h")
install(EXPORT carom_targets NAMESPACE carom:: DESTINATION ${package_folder})

configure_package_config_file(cmake/carom-config.cmake.in ${PROJECT_BINARY_DIR}/carom-config.cmake
                              INSTALL_DESTINATION ${package_folder})
write_basic_package_version_file(${PROJECT_BINARY_DIR}/carom-config-version.cmake COMPATIBILITY SameMinorVersion)
install(FILES ${PROJECT_BINARY_DIR}/carom-config.cmake ${PROJECT_BINARY_DIR}/carom-config-version.cmake
        DESTINATION ${package_folder})
