#pragma once

#include <array>
#include <bit>
#include <cstdint>
#include <cstring>
#include <sstream>
#include <string>
#include <vector>

namespace dyop::test {

/// The unit cube [0, 1]^3, faces outward: the same in every format, so that what is loaded can be
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

template <typename Number>
void append_raw(std::string& bytes, Number number) {
  std::array<char, sizeof(Number)> raw;
  std::memcpy(raw.data(), &number, sizeof(Number));
  bytes.append(raw.data(), raw.size());
}

/// @param prefix In front of the indices' lines, for tests of what else an OBJ may hold.
inline std::string cube_obj(const std::string& prefix = "") {
  std::ostringstream out;
  out << "# a cube\n" << prefix;
  for (const auto& v : kCubeVertices) out << "v " << v[0] << ' ' << v[1] << ' ' << v[2] << '\n';
  for (const auto& t : kCubeTriangles) {
    out << "f " << t[0] + 1 << ' ' << t[1] + 1 << ' ' << t[2] + 1 << '\n';
  }
  return out.str();
}

inline std::string cube_off() {
  std::ostringstream out;
  out << "OFF\n8 12 0\n";
  for (const auto& v : kCubeVertices) out << v[0] << ' ' << v[1] << ' ' << v[2] << '\n';
  for (const auto& t : kCubeTriangles) out << "3 " << t[0] << ' ' << t[1] << ' ' << t[2] << '\n';
  return out.str();
}

inline std::string cube_stl_ascii() {
  std::ostringstream out;
  out << "solid cube\n";
  for (const auto& t : kCubeTriangles) {
    out << "facet normal 0 0 0\nouter loop\n";
    for (const int k : t) {
      const auto& v = kCubeVertices[std::size_t(k)];
      out << "vertex " << v[0] << ' ' << v[1] << ' ' << v[2] << '\n';
    }
    out << "endloop\nendfacet\n";
  }
  out << "endsolid cube\n";
  return out.str();
}

inline std::string cube_stl_binary() {
  std::string bytes(80, ' ');
  append_raw(bytes, std::uint32_t(kCubeTriangles.size()));
  for (const auto& t : kCubeTriangles) {
    for (int axis = 0; axis < 3; ++axis) append_raw(bytes, 0.0f);
    for (const int k : t) {
      for (const int x : kCubeVertices[std::size_t(k)]) append_raw(bytes, float(x));
    }
    append_raw(bytes, std::uint16_t(0));
  }
  return bytes;
}

inline std::string ply_header(const std::string& format) {
  return "ply\nformat " + format +
         " 1.0\nelement vertex 8\nproperty float x\nproperty float y\nproperty float z\n"
         "element face 12\nproperty list uchar int vertex_indices\nend_header\n";
}

inline std::string cube_ply_ascii() {
  std::ostringstream out;
  out << ply_header("ascii");
  for (const auto& v : kCubeVertices) out << v[0] << ' ' << v[1] << ' ' << v[2] << '\n';
  for (const auto& t : kCubeTriangles) out << "3 " << t[0] << ' ' << t[1] << ' ' << t[2] << '\n';
  return out.str();
}

inline std::string cube_ply_binary() {
  std::string bytes = ply_header("binary_little_endian");
  for (const auto& v : kCubeVertices) {
    for (const int x : v) append_raw(bytes, float(x));
  }
  for (const auto& t : kCubeTriangles) {
    append_raw(bytes, std::uint8_t(3));
    for (const int k : t) append_raw(bytes, std::int32_t(k));
  }
  return bytes;
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
    for (const int x : v) append_raw(buffer, float(x));
  }
  const std::size_t vertex_bytes = buffer.size();
  for (const auto& t : kCubeTriangles) {
    for (const int k : t) append_raw(buffer, std::uint16_t(k));
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

}  // namespace dyop::test
