# SPDX-License-Identifier: BSD-3-Clause
"""Conan 2: conan create src/packaging/recipes/conan."""

import os

from conan import ConanFile
from conan.tools.cmake import CMake, CMakeDeps, CMakeToolchain, cmake_layout
from conan.tools.files import copy


class DyopConan(ConanFile):
    name = "dyop"
    version = "0.2.0"
    description = "Certified time of impact and stepping of rigid bodies"
    license = "BSD-3-Clause"
    package_type = "library"
    settings = "os", "arch", "compiler", "build_type"
    options = {"shared": [True, False], "io": [True, False]}
    default_options = {"shared": False, "io": True}

    def export_sources(self):
        root = os.path.join(self.recipe_folder, *[".."] * 4)
        for pattern in ("CMakeLists.txt", "LICENSE", "README.md", "include/*", "src/*", "docs/*"):
            copy(self, pattern, root, self.export_sources_folder)

    def layout(self):
        cmake_layout(self)

    def requirements(self):
        self.requires("eigen/3.4.0", transitive_headers=True)
        self.requires("libccd/2.1")
        self.requires("onetbb/2021.12.0")
        if self.options.io:
            self.requires("nlohmann_json/3.11.3")
            self.requires("tinyxml2/10.0.0")
            self.requires("yaml-cpp/0.8.0")
            self.requires("zlib/[>=1.2.11 <2]")

    def generate(self):
        CMakeDeps(self).generate()
        toolchain = CMakeToolchain(self)
        for option in ("DYNAMICS", "HAPTICS", "PAPER", "CLI", "C", "PYTHON", "OMPL", "TESTS", "EXAMPLES"):
            toolchain.variables[f"DYOP_BUILD_{option}"] = False
        toolchain.variables["DYOP_BUILD_IO"] = bool(self.options.io)
        toolchain.variables["DYOP_WITH_ASSIMP"] = False
        toolchain.variables["DYOP_WITH_HDF5"] = False
        toolchain.generate()

    def build(self):
        cmake = CMake(self)
        cmake.configure()
        cmake.build()

    def package(self):
        CMake(self).install()

    def package_info(self):
        # What is installed says itself what it needs.
        self.cpp_info.set_property("cmake_find_mode", "none")
        self.cpp_info.builddirs.append(os.path.join("lib", "cmake", "dyop"))
