# SPDX-License-Identifier: BSD-3-Clause
# cmake --install: the command, the engine's library and headers, and a package for find_package(carom), which gives the
# target carom::engine.
include(CMakePackageConfigHelpers)
set(package_folder ${CMAKE_INSTALL_LIBDIR}/cmake/carom)

if(NOT CAROM_ENGINE_ONLY)
  install(TARGETS carom RUNTIME DESTINATION ${CMAKE_INSTALL_BINDIR})
  set(about ${PROJECT_BINARY_DIR}/io/about)
  install(FILES ${about}/carom.1 DESTINATION ${CMAKE_INSTALL_MANDIR}/man1)
  install(FILES ${about}/carom.bash DESTINATION ${CMAKE_INSTALL_DATADIR}/bash-completion/completions RENAME carom)
  install(FILES ${about}/_carom DESTINATION ${CMAKE_INSTALL_DATADIR}/zsh/vendor-completions)
  install(FILES ${about}/carom.fish DESTINATION ${CMAKE_INSTALL_DATADIR}/fish/vendor_completions.d)
  install(DIRECTORY inputs/ DESTINATION ${CMAKE_INSTALL_DATADIR}/carom/inputs FILES_MATCHING PATTERN "*.toml" PATTERN figures EXCLUDE)
endif()
install(TARGETS carom_engine EXPORT carom_targets ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR}
                                                  LIBRARY DESTINATION ${CMAKE_INSTALL_LIBDIR})
install(FILES engine/carom.h DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/carom)
install(DIRECTORY engine DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/carom
        FILES_MATCHING PATTERN "*.h" PATTERN carom.h EXCLUDE PATTERN "*_kernel.h" EXCLUDE PATTERN examples EXCLUDE)
install(EXPORT carom_targets NAMESPACE carom:: DESTINATION ${package_folder})

configure_package_config_file(cmake/carom-config.cmake.in ${PROJECT_BINARY_DIR}/carom-config.cmake
                              INSTALL_DESTINATION ${package_folder})
write_basic_package_version_file(${PROJECT_BINARY_DIR}/carom-config-version.cmake COMPATIBILITY SameMinorVersion)
install(FILES ${PROJECT_BINARY_DIR}/carom-config.cmake ${PROJECT_BINARY_DIR}/carom-config-version.cmake
        DESTINATION ${package_folder})
