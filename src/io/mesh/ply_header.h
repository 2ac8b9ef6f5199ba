// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "io/text_scanner.h"

namespace dyop::io_internal {

/// The header of a PLY file: which elements follow, and the properties of each.
enum class PlyEncoding { Ascii, LittleEndian, BigEndian };

struct PlyType {
  std::size_t bytes = 0;
  bool is_real = false;
  bool is_signed = false;
};

struct PlyProperty {
  std::string name;
  PlyType type;                       // type of the values
  std::optional<PlyType> count_type;  // type of the leading count, if the property is a list
};

struct PlyElement {
  std::string name;
  std::int64_t count = 0;
  std::vector<PlyProperty> properties;

  /// Index of the property; nothing if there is none of this name and kind.
  std::optional<std::size_t> find(std::string_view property, bool is_list) const;
  /// The list of vertices, for which two names are in use.
  std::optional<std::size_t> find_vertex_list() const;
};

struct PlyHeader {
  PlyEncoding encoding = PlyEncoding::Ascii;
  std::vector<PlyElement> elements;

  std::int64_t vertex_count() const;
};

/// Reads up to the line after `end_header`. Every element has properties; at most one is named
/// "vertex", with x, y and z; "face" and "tristrips" have a list of vertices.
/// @throws FileError with the line.
PlyHeader read_ply_header(TextScanner& scanner);

}  // namespace dyop::io_internal
