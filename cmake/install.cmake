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
  # Decks, scripts for the files of runs, and the pages with their pictures. Directories of their own would be installed empty.
  file(GLOB_RECURSE decks RELATIVE ${PROJECT_SOURCE_DIR} inputs/*.toml)
  file(GLOB pages RELATIVE ${PROJECT_SOURCE_DIR} README.md CHANGELOG.md CITATION.cff)
  foreach(folder engine inputs io parallel tools)
    file(GLOB_RECURSE found RELATIVE ${PROJECT_SOURCE_DIR} ${folder}/*.md ${folder}/*.png ${folder}/*.gif)
    list(APPEND pages ${found})
  endforeach()
  foreach(file ${decks})
    get_filename_component(folder ${file} DIRECTORY)
    install(FILES ${file} DESTINATION ${CMAKE_INSTALL_DATADIR}/carom/${folder})
  endforeach()
  foreach(file ${pages})
    get_filename_component(folder ${file} DIRECTORY)
    install(FILES ${file} DESTINATION ${CMAKE_INSTALL_DOCDIR}/${folder})
  endforeach()
  file(GLOB scripts tools/*.py)
  list(FILTER scripts EXCLUDE REGEX "/(soak|random_systems|run_page|view_cost)[.]py$")  # of the sources
  install(PROGRAMS ${scripts} DESTINATION ${CMAKE_INSTALL_DATADIR}/carom/tools)
endif()
install(FILES cmake/copyright DESTINATION ${CMAKE_INSTALL_DOCDIR})
install(TARGETS carom_engine EXPORT carom_targets ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR}
                                                  LIBRARY DESTINATION ${CMAKE_INSTALL_LIBDIR})
install(FILES engine/carom.h DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/carom)
install(DIRECTORY engine DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/carom
        FILES_MATCHING PATTERN "*.h" PATTERN carom.h EXCLUDE PATTERN "*_kernel.h" EXCLUDE PATTERN examples EXCLUDE PATTERN figures EXCLUDE)
install(EXPORT carom_targets NAMESPACE carom:: DESTINATION ${package_folder})

configure_package_config_file(cmake/carom-config.cmake.in ${PROJECT_BINARY_DIR}/carom-config.cmake
                              INSTALL_DESTINATION ${package_folder})
write_basic_package_version_file(${PROJECT_BINARY_DIR}/carom-config-version.cmake COMPATIBILITY SameMajorVersion)
install(FILES ${PROJECT_BINARY_DIR}/carom-config.cmake ${PROJECT_BINARY_DIR}/carom-config-version.cmake
        DESTINATION ${package_folder})
