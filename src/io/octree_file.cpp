// SPDX-License-Identifier: BSD-3-Clause
#include "dyop/io/octree_file.h"

#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <string>

#include "dyop/core/error.h"
#include "dyop/io/file_error.h"
#include "io/file_bytes.h"
#include "io/text_scanner.h"

namespace dyop {
namespace {

constexpr int kDepth = 16;  // of every tree of OctoMap
constexpr std::size_t kMostLeaves = std::size_t{1} << 24;

/// Walks through the nodes, each before its children. Places are counted in halves of the
/// resolution, so that neighbouring cubes have the same corners.
class NodeReader {
 public:
  NodeReader(const OctreeFormat& format, std::string_view bytes)
      : format_(format), rest_(bytes), extra_bytes_(format.id == "ColorOcTree" ? 3 : 0) {}

  std::vector<OccupiedCube> read() {
    const Node root{{0, 0, 0}, 0};
    if (format_.is_binary) {
      read_binary(root);
    } else {
      read_full(root);
    }
    DYOP_REQUIRE(rest_.empty(), "the octree ends ", rest_.size(), " bytes before its data");
    DYOP_REQUIRE(!cubes_.empty(), "the octree has no occupied leaf");
    return std::move(cubes_);
  }

 private:
  struct Node {
    std::array<std::int64_t, 3> center;  // in halves of the resolution
    int depth;

    std::int64_t half_size() const { return std::int64_t{1} << (kDepth - depth); }
    Node child(int number) const {
      Node result{center, depth + 1};
      for (int axis = 0; axis < 3; ++axis) {
        const bool is_upper = ((number >> axis) & 1) != 0;
        result.center[std::size_t(axis)] += is_upper ? result.half_size() : -result.half_size();
      }
      return result;
    }
  };

  unsigned byte() {
    DYOP_REQUIRE(!rest_.empty(), "the data of the octree are truncated");
    const auto value = static_cast<unsigned char>(rest_.front());
    rest_.remove_prefix(1);
    return value;
  }

  // Two bits a child: unknown, free, occupied, or a node of its own.
  void read_binary(const Node& node) {
    unsigned kinds = byte();
    kinds |= byte() << 8;
    for (int k = 0; k < 8; ++k) {
      if (((kinds >> (2 * k)) & 3) == 2) add(node.child(k));
    }
    for (int k = 0; k < 8; ++k) {
      if (((kinds >> (2 * k)) & 3) != 3) continue;
      require_inner(node);
      read_binary(node.child(k));
    }
  }

  // The log-odds, what a kind of tree stores besides, and a bit for each child.
  void read_full(const Node& node) {
    std::uint32_t bits = 0;
    for (int k = 0; k < 4; ++k) bits |= byte() << (8 * k);
    for (std::size_t k = 0; k < extra_bytes_; ++k) byte();
    const unsigned children = byte();
    if (children == 0 && std::bit_cast<float>(bits) >= 0) add(node);
    for (int k = 0; k < 8; ++k) {
      if (((children >> k) & 1) == 0) continue;
      DYOP_REQUIRE(node.depth < kDepth, "the octree is deeper than ", kDepth, " levels");
      read_full(node.child(k));
    }
  }

  static void require_inner(const Node& node) {
    DYOP_REQUIRE(node.depth + 1 < kDepth, "the octree is deeper than ", kDepth, " levels");
  }

  void add(const Node& leaf) {
    DYOP_REQUIRE(cubes_.size() < kMostLeaves, "the octree has more than ", kMostLeaves,
                 " occupied leaves");
    const Scalar half = format_.resolution / 2;
    cubes_.push_back(
        {half * Vector3(Scalar(leaf.center[0]), Scalar(leaf.center[1]), Scalar(leaf.center[2])),
         half * Scalar(2 * leaf.half_size())});
  }

  const OctreeFormat& format_;
  std::string_view rest_;
  std::size_t extra_bytes_;
  std::vector<OccupiedCube> cubes_;
};

// The lines before the data: a first one that tells the format, then keys and values.
OctreeFormat read_header(const std::filesystem::path& file, std::string_view& bytes) {
  io_internal::TextScanner scanner(file, bytes);
  OctreeFormat format;
  const bool has_line = scanner.next_line();
  const auto first = bytes.substr(0, bytes.find('\n'));
  format.is_binary = first == "# Octomap OcTree binary file";
  if (!has_line || (!format.is_binary && first != "# Octomap OcTree file")) {
    scanner.fail("expected the first line of a file of OctoMap");
  }
  while (scanner.next_line_with_words()) {
    const auto& words = scanner.words();
    if (words[0] == "data") {
      bytes = scanner.rest();
      return format;
    }
    if (words.size() != 2) scanner.fail("expected a key and a value");
    if (words[0] == "id") format.id = words[1];
    if (words[0] == "res") format.resolution = scanner.finite_number(words[1], "resolution");
  }
  scanner.fail("expected the line `data`");
}

}  // namespace

std::vector<OccupiedCube> read_octree(const OctreeFormat& format, std::string_view nodes) {
  DYOP_REQUIRE(format.id == "OcTree" || format.id == "ColorOcTree",
               "an OcTree or ColorOcTree is wanted, not ", io_internal::quote(format.id));
  DYOP_REQUIRE(format.resolution > 0 && std::isfinite(format.resolution),
               "the resolution of an octree must be > 0, not ", format.resolution);
  return NodeReader(format, nodes).read();
}

std::vector<OccupiedCube> load_octree(const std::filesystem::path& file) {
  const std::string bytes = io_internal::read_bytes(file);
  std::string_view rest = bytes;
  const OctreeFormat format = read_header(file, rest);
  try {
    return read_octree(format, rest);
  } catch (const InvalidArgument& error) {
    throw FileError(file, error.what());
  }
}

}  // namespace dyop
