// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "dyop/core/types.h"
#include "dyop/haptics/device_mapping.h"
#include "dyop/haptics/haptic_runner.h"
#include "dyop/haptics/haptic_session.h"

namespace DYOP_EXPORT dyop {

/// The device on a line from point to point.
struct DevicePoint {
  Scalar t = 0;  ///< since the start of the stroke, seconds
  DevicePose pose;
};

/// A named part of the surgeon's motion.
struct ToolStroke {
  std::string name;
  std::vector<DevicePoint> points;  ///< times ascend from 0
  /// Of the devices of further tools, each of which ends where its own points do.
  std::vector<std::vector<DevicePoint>> more_points = {};

  Scalar duration() const { return points.back().t; }
};

/// Everything `dyop tool` needs for a run: see docs/formats.md.
struct HapticRun {
  std::string title;  ///< for display; may be empty
  HapticScene scene;
  HapticOptions options;
  /// How a device's motions become the tool's; none: they are taken as they are. Not for strokes.
  std::optional<DeviceMappingOptions> mapping = {};
  RunnerOptions runner;
  std::vector<TissueFeed> tissue;
  std::vector<ToolStroke> strokes;  ///< one after the other, repeated
  std::string text;                 ///< of the file

  /// The stroke of a tick, and the pose of a tool's device at the end of the tick.
  std::size_t stroke_at(std::int64_t tick) const;
  DevicePose device(std::int64_t tick, std::size_t tool = 0) const;
};

/// Reads a scene of a tool.
/// @throws FileError naming the key that is missing, out of range or unknown.
HapticRun load_haptic_run(const std::filesystem::path& file);
/// The same from a string; meshes are searched for beside `file`.
HapticRun parse_haptic_run(const std::filesystem::path& file, const std::string& text);

/// The feed of an obstacle of a scene by its TissueFeed::formula.
/// @param file For messages.
/// @throws FileError if the formula is not one that a scene can hold.
TissueFeed feed_of_formula(const std::filesystem::path& file, const std::string& formula,
                           std::size_t obstacle, const HapticScene& scene);

/// Triangles of a made-up organ or instrument, in millimetres. Not taken from any body.
struct AnatomyMesh {
  std::vector<Vector3> vertices;
  std::vector<TriangleIndices> triangles;
};

/// A closed lumpy surface of about 160 x 110 x 70, like a liver, about the origin.
/// Its edges differ by a factor of 2.5 at most, and six triangles meet at nearly every vertex.
/// @param triangles The approximate number, >= 32: here the nearest 20 f^2; below a regular grid
///     determines it.
AnatomyMesh make_liver(std::size_t triangles);

/// A closed bent tube of radius 3, about 140 long, along x.
AnatomyMesh make_vessel(std::size_t triangles);

/// An open sheet of 240 x 240, domed by 40, like the inside of the abdominal wall; z upwards.
AnatomyMesh make_wall(std::size_t triangles);

/// A closed round rod along z from 0 to `length`.
AnatomyMesh make_shaft(std::size_t triangles, Scalar radius, Scalar length);

/// A closed tapered half of a grasper, from the origin along -z, its flat side towards +x.
AnatomyMesh make_jaw(std::size_t triangles, Scalar radius, Scalar length);

}  // namespace dyop
