# SPDX-License-Identifier: BSD-3-Clause
# CAROM_PORTABLE, instead of find_package(): all libraries but glibc's become part of the command and the Python module.
find_path(LIBDEFLATE_INCLUDE_DIR libdeflate.h REQUIRED)
find_path(HDF5_C_INCLUDE_DIRS hdf5.h PATH_SUFFIXES hdf5/serial REQUIRED)
foreach(library hdf5_serial sz aec z deflate)
  find_library(CAROM_ARCHIVE_${library} NAMES lib${library}.a REQUIRED)
endforeach()
# Debian compiles HDF5's archive for programs. It fits a shared library, too, once it no longer names two variables of the C
# library, stdout and stderr: streams.cc has variables of its own with their values.
set(HDF5_C_LIBRARIES ${PROJECT_BINARY_DIR}/libhdf5.a)
execute_process(COMMAND ${CMAKE_OBJCOPY} --redefine-sym stdout=carom_stdout --redefine-sym stderr=carom_stderr
                        ${CAROM_ARCHIVE_hdf5_serial} ${HDF5_C_LIBRARIES} COMMAND_ERROR_IS_FATAL ANY)
add_library(carom_streams STATIC io/files/streams.cc)
set_target_properties(carom_streams PROPERTIES POSITION_INDEPENDENT_CODE ON)
list(APPEND HDF5_C_LIBRARIES carom_streams ${CAROM_ARCHIVE_sz} ${CAROM_ARCHIVE_aec} ${CAROM_ARCHIVE_z})
set(LIBDEFLATE_LIBRARY ${CAROM_ARCHIVE_deflate})
# Of spdlog Carom uses fmt alone, and of fmt and toml++ the headers are enough.
find_package(fmt REQUIRED)
add_library(spdlog::spdlog INTERFACE IMPORTED)
target_compile_definitions(spdlog::spdlog INTERFACE SPDLOG_FMT_EXTERNAL)
target_link_libraries(spdlog::spdlog INTERFACE fmt::fmt-header-only)
add_library(tomlplusplus::tomlplusplus INTERFACE IMPORTED)
# Nothing of the libraries is visible to other modules of Python, which may have the same ones.
target_link_options(carom_flags INTERFACE -static-libstdc++ -static-libgcc -Wl,--exclude-libs,ALL -Wl,-s)
