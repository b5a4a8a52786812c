# SPDX-License-Identifier: BSD-3-Clause
# cpack -G DEB: one package with the command, the library and its headers, manual and completion (tools/package).
set(CPACK_PACKAGE_NAME carom)
set(CPACK_PACKAGE_VENDOR Carom)
set(CPACK_PACKAGE_CONTACT "The Carom developers <carom@localhost>")
set(CPACK_PACKAGE_DESCRIPTION_SUMMARY ${PROJECT_DESCRIPTION})
set(CPACK_PACKAGING_INSTALL_PREFIX /usr)
set(CPACK_STRIP_FILES ON)
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PACKAGE_SECTION science)
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS ON)  # from the libraries that the command is linked with
find_package(Python3 REQUIRED COMPONENTS Interpreter)
set(CPACK_DEBIAN_PACKAGE_DEPENDS
    "openmpi-bin, python3 (>= ${Python3_VERSION_MAJOR}.${Python3_VERSION_MINOR}), python3-numpy, python3-h5py")
set(CPACK_DEBIAN_PACKAGE_RECOMMENDS "libeigen3-dev, libboost-dev")
include(CPack)
