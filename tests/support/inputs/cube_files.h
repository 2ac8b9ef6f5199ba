// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstdint>
#include <sstream>
#include <string>
#include <string_view>

#include "support/inputs/mesh_writers.h"

namespace dyop::testing {

/// The unit cube [0, 1]^3, faces outward: the same in every format, so that loaded meshes can be
/// compared.
inline constexpr std::array<std::array<int, 3>, 8> kCubeVertices{
    {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}, {0, 0, 1}, {1, 0, 1}, {1, 1, 1}, {0, 1, 1}}};
inline constexpr std::array<std::array<int, 3>, 12> kCubeTriangles{{{0, 2, 1},
                                                                    {0, 3, 2},
                                                                    {4, 5, 6},
                                                                    {4, 6, 7},
                                                                    {0, 1, 5},
                                                                    {0, 5, 4},
                                                                    {1, 2, 6},
                                                                    {1, 6, 5},
                                                                    {2, 3, 7},
                                                                    {2, 7, 6},
                                                                    {3, 0, 4},
                                                                    {3, 4, 7}}};

inline Polygons cube_polygons() {
  Polygons cube;
  for (const auto& v : kCubeVertices) cube.vertices.emplace_back(v[0], v[1], v[2]);
  for (const auto& t : kCubeTriangles) cube.polygons.push_back({t[0], t[1], t[2]});
  return cube;
}

inline std::string cube_obj() {
  return obj_of(cube_polygons());
}
inline std::string cube_off() {
  return off_of(cube_polygons());
}
inline std::string cube_stl_ascii() {
  return stl_ascii_of(cube_polygons());
}
inline std::string cube_stl_binary() {
  return stl_binary_of(cube_polygons());
}
inline std::string cube_ply_ascii() {
  return ply_ascii_of(cube_polygons());
}
inline std::string cube_ply_binary() {
  return ply_binary_of<float>(cube_polygons());
}

inline std::string base64(const std::string& bytes) {
  constexpr std::string_view kDigits =
      "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string text;
  for (std::size_t k = 0; k < bytes.size(); k += 3) {
    std::uint32_t word = 0;
    for (std::size_t i = 0; i < 3; ++i) {
      word = word << 8 | (k + i < bytes.size() ? std::uint8_t(bytes[k + i]) : 0u);
    }
    for (std::size_t i = 0; i < 4; ++i) {
      const bool is_padding = k + i > bytes.size();
      text += is_padding ? '=' : kDigits[word >> (18 - 6 * i) & 63u];
    }
  }
  return text;
}

/// @param node JSON members of the only node besides its mesh, e.g. "\"scale\":[-1,1,1]".
inline std::string cube_gltf(const std::string& node = "\"name\":\"cube\"") {
  std::string buffer;
  for (const auto& v : kCubeVertices) {
    for (const int x : v) append_number(buffer, float(x));
  }
  const std::size_t vertex_bytes = buffer.size();
  for (const auto& t : kCubeTriangles) {
    for (const int k : t) append_number(buffer, std::uint16_t(k));
  }
  std::ostringstream out;
  out << R"({"asset":{"version":"2.0"},"scene":0,"scenes":[{"nodes":[0]}],"nodes":[{"mesh":0,)"
      << node << R"(}],"meshes":[{"primitives":[{"attributes":{"POSITION":0},"indices":1}]}],)"
      << R"("buffers":[{"byteLength":)" << buffer.size()
      << R"(,"uri":"data:application/octet-stream;base64,)" << base64(buffer) << R"("}],)"
      << R"("bufferViews":[{"buffer":0,"byteOffset":0,"byteLength":)" << vertex_bytes
      << R"(},{"buffer":0,"byteOffset":)" << vertex_bytes << R"(,"byteLength":)"
      << buffer.size() - vertex_bytes << R"(}],)"
      << R"("accessors":[{"bufferView":0,"componentType":5126,"count":8,"type":"VEC3",)"
      << R"("min":[0,0,0],"max":[1,1,1]},)"
      << R"({"bufferView":1,"componentType":5123,"count":36,"type":"SCALAR"}]})";
  return out.str();
}

}  // namespace dyop::testing
