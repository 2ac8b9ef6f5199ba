# SPDX-License-Identifier: BSD-3-Clause
"""Spack: spack repo add a repository that has this as packages/dyop/package.py."""

from spack.package import *


class Dyop(CMakePackage):
    """Certified time of impact and stepping of rigid bodies."""

    license("BSD-3-Clause")
    version("0.2.0")
    has_code = False  # spack dev-build dyop@0.2.0, in the tree

    variant("dynamics", default=True, description="Stepping of whole scenes, and the C interface")
    variant("io", default=True, description="Mesh, robot and scene files")
    variant("hdf5", default=False, when="+dynamics+io", description="Recordings")

    depends_on("cxx", type="build")
    depends_on("cmake@3.24:", type="build")
    depends_on("eigen@3.4:")
    depends_on("libccd")
    depends_on("intel-oneapi-tbb")
    depends_on("sundials@6.4:6", when="+dynamics")
    depends_on("nlohmann-json", when="+io")
    depends_on("tinyxml2", when="+io")
    depends_on("yaml-cpp", when="+io")
    depends_on("assimp", when="+io")
    depends_on("zlib-api", when="+io")
    depends_on("hdf5", when="+hdf5")

    def cmake_args(self):
        off = "HAPTICS PAPER CLI PYTHON OMPL TESTS EXAMPLES".split()
        return [self.define(f"DYOP_BUILD_{name}", False) for name in off] + [
            self.define_from_variant("DYOP_BUILD_DYNAMICS", "dynamics"),
            self.define_from_variant("DYOP_BUILD_C", "dynamics"),
            self.define_from_variant("DYOP_BUILD_IO", "io"),
            self.define_from_variant("DYOP_WITH_ASSIMP", "io"),
            self.define_from_variant("DYOP_WITH_HDF5", "hdf5"),
        ]
