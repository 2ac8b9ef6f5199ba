// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "dyop/core/types.h"

namespace dyop::cli {

/// How a shape is painted. Colours are CSS words or #rrggbb.
struct SvgStyle {
  std::string_view fill = "none";
  std::string_view stroke = "none";
  Scalar stroke_width = 1;
  std::string_view dashes = "";  ///< SVG dash array
  Scalar opacity = 1;
};

enum class SvgAnchor { Start, Middle, End };

/// An SVG file that grows by one element per call; pixels, x to the right and y down. White
/// background, one sans-serif font, coordinates with two decimals, so that files are small and look
/// the same everywhere.
class DYOP_EXPORT SvgCanvas {
 public:
  SvgCanvas(int width, int height, std::string_view title);

  void line(const Vector2& from, const Vector2& to, const SvgStyle& style);
  void rectangle(const Vector2& corner, const Vector2& size, const SvgStyle& style);
  void circle(const Vector2& center, Scalar radius, const SvgStyle& style);
  void polygon(const std::vector<Vector2>& corners, const SvgStyle& style);
  void polyline(const std::vector<Vector2>& points, const SvgStyle& style);
  /// @param outline Width of a line around the letters, in their colour: for a halo behind a text.
  void text(const Vector2& at, std::string_view words, Scalar size = 12,
            SvgAnchor anchor = SvgAnchor::Start, std::string_view colour = "#222222",
            bool is_bold = false, Scalar outline = 0);
  /// Rotated by a quarter turn to the left about its middle, for the name of a vertical axis.
  void vertical_text(const Vector2& at, std::string_view words, Scalar size = 12);

  /// A PNG file, in base 64, stretched over a rectangle.
  void image(const Vector2& corner, const Vector2& size, std::string_view png_base64);

  /// A fill of slanted stripes in this colour, for use as `fill`.
  std::string add_stripes(std::string_view colour);

  /// The whole file.
  std::string str() const;

 private:
  void add_points(std::string_view element, const std::vector<Vector2>& points,
                  const SvgStyle& style);

  int width_;
  int height_;
  std::string title_;
  std::string definitions_;
  std::string elements_;
  int stripes_ = 0;
};

}  // namespace dyop::cli
