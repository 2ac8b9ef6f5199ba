// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "dyop/core/rigid_pose.h"
#include "view/shape_surface.h"

namespace dyop::cli {

/// How the world is seen: without perspective, so that lengths can be compared.
struct Camera {
  Vector3 center_W = Vector3::Zero();  ///< in the middle of the image
  Vector3 right_W = Vector3::UnitX();  ///< unit, and so on: a right-handed frame
  Vector3 up_W = Vector3::UnitZ();
  Vector3 back_W = -Vector3::UnitY();  ///< towards the eye
  Scalar pixels_per_length = 1;
  int width = 1;  ///< pixels
  int height = 1;

  /// Pixels, x to the right and y down.
  Vector2 project(const Vector3& p_W) const;
};

struct Rgb {
  std::uint8_t red = 255;
  std::uint8_t green = 255;
  std::uint8_t blue = 255;
};

/// Surfaces in world, drawn with a depth for every pixel.
class ShadedImage {
 public:
  explicit ShadedImage(const Camera& camera);

  /// @param opacity 1: solid; less: where nothing solid is in front, blended into what is there.
  void draw(const view_internal::ShapeSurface& surface, const RigidPose& X_WB, Rgb colour,
            Scalar opacity);

  /// As a PNG file.
  std::string png() const;

 private:
  // What is seen at a pixel.
  struct Sample {
    float depth = -std::numeric_limits<float>::infinity();  // towards the eye
    float light = 0;
    bool is_there = false;
  };

  void draw_triangle(std::vector<Sample>& samples, const std::array<Vector3, 3>& corners) const;
  void blend(const std::vector<Sample>& samples, Rgb colour, Scalar opacity);

  Camera camera_;
  std::vector<Rgb> pixels_;
  std::vector<float> depth_;  // of what is solid
};

/// In base 64, for a data URL.
std::string base64(const std::string& bytes);

}  // namespace dyop::cli
