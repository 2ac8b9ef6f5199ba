// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>

#include "dyop/core/types.h"

namespace DYOP_EXPORT dyop {

struct GltfOptions {
  /// How far the file's motion may be from the run's, besides rounding to single precision, as a
  /// part of the smallest bounding radius of the bodies that move; > 0.
  Scalar tolerance = 1e-4;  // literal: a fifth of the gap at which bodies rest
  /// The run's z is up, as glTF's y is. False: the run's y is up already.
  bool z_is_up = true;
};

/// Writes a recording of docs/formats.md as one binary glTF file (.glb): a node for every body,
/// animated by cubic splines whose tangents differ at an impact, so that every viewer shows the
/// exact kink.
///
/// Times, places and rotations are in single precision, as glTF wants it: events closer than its
/// resolution become one key.
/// @throws FileError if a file cannot be read or written, or this library was built without
///         tinygltf or HDF5; InvalidArgument if an option is out of its range.
void write_gltf(const std::filesystem::path& recording, const std::filesystem::path& out,
                const GltfOptions& options = {});

}  // namespace dyop
