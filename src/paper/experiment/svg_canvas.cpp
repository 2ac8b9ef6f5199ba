// SPDX-License-Identifier: BSD-3-Clause
#include "paper/experiment/svg_canvas.h"

#include <cmath>
#include <cstdio>

namespace dyop::cli {
namespace {

template <typename... Parts>
void append(std::string& to, const Parts&... parts) {
  (to.append(std::string_view(parts)), ...);
}

template <typename... Parts>
std::string joined(const Parts&... parts) {
  std::string result;
  append(result, parts...);
  return result;
}

std::string number(Scalar x) {
  char buffer[32];
  // Without the sign that a zero rounded from below would keep.
  std::snprintf(buffer, sizeof buffer, "%.2f", std::abs(x) < 0.005 ? 0 : x);
  std::string text = buffer;
  while (text.back() == '0') text.pop_back();
  if (text.back() == '.') text.pop_back();
  return text;
}

std::string escaped(std::string_view words) {
  std::string result;
  for (const char c : words) {
    if (c == '<') {
      append(result, "&lt;");
    } else if (c == '&') {
      append(result, "&amp;");
    } else {
      result.push_back(c);
    }
  }
  return result;
}

std::string attribute(std::string_view name, std::string_view value) {
  return joined(" ", name, "=\"", value, "\"");
}

std::string attribute(std::string_view name, Scalar value) {
  return attribute(name, number(value));
}

std::string paint(const SvgStyle& style) {
  std::string result = attribute("fill", style.fill);
  if (style.stroke != "none") {
    append(result, attribute("stroke", style.stroke));
    if (style.stroke_width != 1) append(result, attribute("stroke-width", style.stroke_width));
    if (!style.dashes.empty()) append(result, attribute("stroke-dasharray", style.dashes));
  }
  if (style.opacity != 1) append(result, attribute("opacity", style.opacity));
  return result;
}

}  // namespace

SvgCanvas::SvgCanvas(int width, int height, std::string_view title)
    : width_(width), height_(height), title_(escaped(title)) {}

void SvgCanvas::line(const Vector2& from, const Vector2& to, const SvgStyle& style) {
  append(elements_, "<line", attribute("x1", from.x()), attribute("y1", from.y()),
         attribute("x2", to.x()), attribute("y2", to.y()), paint(style), "/>\n");
}

void SvgCanvas::rectangle(const Vector2& corner, const Vector2& size, const SvgStyle& style) {
  append(elements_, "<rect", attribute("x", corner.x()), attribute("y", corner.y()),
         attribute("width", size.x()), attribute("height", size.y()), paint(style), "/>\n");
}

void SvgCanvas::circle(const Vector2& center, Scalar radius, const SvgStyle& style) {
  append(elements_, "<circle", attribute("cx", center.x()), attribute("cy", center.y()),
         attribute("r", radius), paint(style), "/>\n");
}

void SvgCanvas::add_points(std::string_view element, const std::vector<Vector2>& points,
                           const SvgStyle& style) {
  std::string list;
  for (const Vector2& p : points) append(list, number(p.x()), ",", number(p.y()), " ");
  if (!list.empty()) list.pop_back();
  append(elements_, "<", element, attribute("points", list), attribute("stroke-linejoin", "round"),
         paint(style), "/>\n");
}

void SvgCanvas::polygon(const std::vector<Vector2>& corners, const SvgStyle& style) {
  add_points("polygon", corners, style);
}

void SvgCanvas::polyline(const std::vector<Vector2>& points, const SvgStyle& style) {
  add_points("polyline", points, style);
}

void SvgCanvas::text(const Vector2& at, std::string_view words, Scalar size, SvgAnchor anchor,
                     std::string_view colour, bool is_bold, Scalar outline) {
  append(elements_, "<text", attribute("x", at.x()), attribute("y", at.y()),
         attribute("font-size", size), attribute("fill", colour));
  if (anchor == SvgAnchor::Middle) append(elements_, attribute("text-anchor", "middle"));
  if (anchor == SvgAnchor::End) append(elements_, attribute("text-anchor", "end"));
  if (is_bold) append(elements_, attribute("font-weight", "bold"));
  if (outline > 0) {
    append(elements_, attribute("stroke", colour), attribute("stroke-width", outline),
           attribute("stroke-linejoin", "round"));
  }
  append(elements_, ">", escaped(words), "</text>\n");
}

void SvgCanvas::vertical_text(const Vector2& at, std::string_view words, Scalar size) {
  const std::string placing =
      joined("translate(", number(at.x()), ",", number(at.y()), ") rotate(-90)");
  append(elements_, "<text", attribute("transform", placing), attribute("font-size", size),
         attribute("fill", "#222222"), attribute("text-anchor", "middle"), ">", escaped(words),
         "</text>\n");
}

void SvgCanvas::image(const Vector2& corner, const Vector2& size, std::string_view png_base64) {
  append(elements_, "<image", attribute("x", corner.x()), attribute("y", corner.y()),
         attribute("width", size.x()), attribute("height", size.y()),
         attribute("href", joined("data:image/png;base64,", png_base64)), "/>\n");
}

std::string SvgCanvas::add_stripes(std::string_view colour) {
  const std::string name = joined("stripes", std::to_string(++stripes_));
  append(definitions_, "<pattern", attribute("id", name), attribute("width", 4),
         attribute("height", 4), attribute("patternUnits", "userSpaceOnUse"),
         attribute("patternTransform", "rotate(45)"), "><rect", attribute("width", 4),
         attribute("height", 4), attribute("fill", "#ffffff"), "/><rect", attribute("width", 2),
         attribute("height", 4), attribute("fill", colour), "/></pattern>\n");
  return joined("url(#", name, ")");
}

std::string SvgCanvas::str() const {
  const std::string width = std::to_string(width_);
  const std::string height = std::to_string(height_);
  return joined(
      "<svg xmlns=\"http://www.w3.org/2000/svg\"", attribute("width", width),
      attribute("height", height), attribute("viewBox", joined("0 0 ", width, " ", height)),
      attribute("font-family", "DejaVu Sans, Helvetica, Arial, sans-serif"), ">\n<title>", title_,
      "</title>\n<defs>\n", definitions_, "</defs>\n<rect", attribute("width", "100%"),
      attribute("height", "100%"), attribute("fill", "#ffffff"), "/>\n", elements_, "</svg>\n");
}

}  // namespace dyop::cli
