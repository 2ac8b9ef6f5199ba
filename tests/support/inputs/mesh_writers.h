// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <charconv>
#include <cstdint>
#include <cstring>
#include <string>
#include <vector>

#include "dyop/core/types.h"

namespace dyop::testing {

/// The mesh to write: polygons of vertices counted from 0, each with at least one corner.
struct Polygons {
  std::vector<Vector3> vertices;
  std::vector<std::vector<int>> polygons;
};

/// Variations that text formats allow and programs use.
struct TextStyle {
  std::string line_end = "\n";
  std::string blank = " ";
  bool has_comments = false;
  bool has_negative_indices = false;  ///< OBJ only
};

/// The shortest digits that read back to the same number.
inline std::string digits_of(Scalar value) {
  std::array<char, 64> digits;
  const auto end = std::to_chars(digits.data(), digits.data() + digits.size(), value);
  return std::string(digits.data(), end.ptr);
}

inline std::string row_of(const Vector3& p, const std::string& blank) {
  return digits_of(p.x()) + blank + digits_of(p.y()) + blank + digits_of(p.z());
}

inline std::string obj_of(const Polygons& mesh, const TextStyle& style = {}) {
  std::string text = style.has_comments ? "# made up" + style.line_end + "mtllib none.mtl" +
                                              style.line_end + "o thing" + style.line_end
                                        : "";
  for (const Vector3& p : mesh.vertices) {
    text += "v" + style.blank + row_of(p, style.blank) + (style.has_comments ? " # a vertex" : "") +
            style.line_end;
  }
  if (style.has_comments) text += "vn 0 0 1" + style.line_end + "vt 0 0" + style.line_end;
  for (std::size_t k = 0; k < mesh.polygons.size(); ++k) {
    if (style.has_comments) text += "g part" + std::to_string(k % 3) + style.line_end;
    text += "f";
    for (const int i : mesh.polygons[k]) {
      const int index = style.has_negative_indices ? i - int(mesh.vertices.size()) : i + 1;
      text += style.blank + std::to_string(index) + (style.has_comments ? "/1/1" : "");
    }
    text += style.line_end;
  }
  return text;
}

// The rows that OFF and PLY share.
inline std::string rows_of(const Polygons& mesh, const TextStyle& style) {
  std::string text;
  for (const Vector3& p : mesh.vertices) text += row_of(p, style.blank) + style.line_end;
  for (const std::vector<int>& polygon : mesh.polygons) {
    text += std::to_string(polygon.size());
    for (const int i : polygon) text += style.blank + std::to_string(i);
    text += style.line_end;
  }
  return text;
}

inline std::string off_of(const Polygons& mesh, const TextStyle& style = {}) {
  return "OFF" + style.line_end + (style.has_comments ? "# made up" + style.line_end : "") +
         std::to_string(mesh.vertices.size()) + style.blank + std::to_string(mesh.polygons.size()) +
         style.blank + "0" + style.line_end + rows_of(mesh, style);
}

template <typename Number>
constexpr const char* kPlyName = sizeof(Number) == 8 ? "double" : "float";

/// @param format As in the header; Number is the type of the coordinates.
template <typename Number>
std::string ply_header_of(const Polygons& mesh, const std::string& format,
                          const TextStyle& style = {}) {
  const std::string property = std::string("property ") + kPlyName<Number>;
  std::string text;
  for (const std::string& line :
       {std::string("ply"), "format " + format + " 1.0", std::string("comment made up"),
        "element vertex " + std::to_string(mesh.vertices.size()), property + " x", property + " y",
        property + " z", "element face " + std::to_string(mesh.polygons.size()),
        std::string("property list uchar int vertex_indices"), std::string("end_header")}) {
    text += line + style.line_end;
  }
  return text;
}

inline std::string ply_ascii_of(const Polygons& mesh, const TextStyle& style = {}) {
  return ply_header_of<double>(mesh, "ascii", style) + rows_of(mesh, style);
}

template <typename Number>
void append_number(std::string& bytes, Number number, bool is_big_endian = false) {
  std::array<char, sizeof(Number)> raw;
  std::memcpy(raw.data(), &number, sizeof(Number));
  if (is_big_endian != (std::endian::native == std::endian::big)) {
    std::reverse(raw.begin(), raw.end());
  }
  bytes.append(raw.data(), raw.size());
}

template <typename Number>
std::string ply_binary_of(const Polygons& mesh, bool is_big_endian = false) {
  const char* format = is_big_endian ? "binary_big_endian" : "binary_little_endian";
  std::string bytes = ply_header_of<Number>(mesh, format);
  for (const Vector3& p : mesh.vertices) {
    for (const Scalar x : p) append_number(bytes, Number(x), is_big_endian);
  }
  for (const std::vector<int>& polygon : mesh.polygons) {
    append_number(bytes, std::uint8_t(polygon.size()), is_big_endian);
    for (const int i : polygon) append_number(bytes, std::int32_t(i), is_big_endian);
  }
  return bytes;
}

/// Triangles only: STL supports nothing else.
inline std::string stl_ascii_of(const Polygons& mesh, const TextStyle& style = {}) {
  const std::string& end = style.line_end;
  std::string text = "solid made up" + end;
  for (const std::vector<int>& polygon : mesh.polygons) {
    text += "facet normal 0 0 0" + end + "  outer loop" + end;
    for (const int i : polygon) {
      text += "    vertex" + style.blank + row_of(mesh.vertices[std::size_t(i)], style.blank) + end;
    }
    text += "  endloop" + end + "endfacet" + end;
  }
  return text + "endsolid made up" + end;
}

/// Triangles only, in single precision.
inline std::string stl_binary_of(const Polygons& mesh) {
  std::string bytes(80, ' ');
  append_number(bytes, std::uint32_t(mesh.polygons.size()));
  for (const std::vector<int>& polygon : mesh.polygons) {
    for (int axis = 0; axis < 3; ++axis) append_number(bytes, 0.0f);
    for (const int i : polygon) {
      for (const Scalar x : mesh.vertices[std::size_t(i)]) append_number(bytes, float(x));
    }
    append_number(bytes, std::uint16_t(0));
  }
  return bytes;
}

}  // namespace dyop::testing
