# SPDX-License-Identifier: BSD-3-Clause
# An overlay port that lies in the tree it builds: vcpkg install dyop --overlay-ports=src/packaging/recipes/vcpkg
get_filename_component(SOURCE_PATH "${CURRENT_PORT_DIR}/../../../.." ABSOLUTE)

vcpkg_check_features(OUT_FEATURE_OPTIONS feature_options FEATURES
  dynamics DYOP_BUILD_DYNAMICS
  dynamics DYOP_BUILD_C
  io DYOP_BUILD_IO
  io DYOP_WITH_ASSIMP)

vcpkg_cmake_configure(SOURCE_PATH "${SOURCE_PATH}" OPTIONS ${feature_options}
  -DDYOP_BUILD_HAPTICS=OFF -DDYOP_BUILD_PAPER=OFF -DDYOP_BUILD_CLI=OFF -DDYOP_BUILD_PYTHON=OFF
  -DDYOP_BUILD_OMPL=OFF -DDYOP_BUILD_TESTS=OFF -DDYOP_BUILD_EXAMPLES=OFF -DDYOP_WITH_HDF5=OFF)
vcpkg_cmake_install()
vcpkg_cmake_config_fixup(CONFIG_PATH lib/cmake/dyop)
vcpkg_fixup_pkgconfig()
file(REMOVE_RECURSE "${CURRENT_PACKAGES_DIR}/debug/include" "${CURRENT_PACKAGES_DIR}/debug/share")
vcpkg_install_copyright(FILE_LIST "${SOURCE_PATH}/LICENSE")
