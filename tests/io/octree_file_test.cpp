// SPDX-License-Identifier: BSD-3-Clause

// Octrees that OctoMap writes, held against what OctoMap reads from them.

#include "dyop/io/octree_file.h"

#include <gtest/gtest.h>
#include <octomap/ColorOcTree.h>
#include <octomap/octomap.h>

#include <cmath>
#include <set>

#include "dyop/io/file_error.h"
#include "support/inputs/random_inputs.h"
#include "support/temporary_directory.h"

namespace dyop {
namespace {

// Twice the center and once the size, in units of the resolution.
using Leaf = std::array<long, 4>;

Leaf leaf_of(const Vector3& center, Scalar size, Scalar resolution) {
  const auto number = [&](Scalar x) { return std::lround(2 * x / resolution); };
  return {number(center.x()), number(center.y()), number(center.z()),
          std::lround(size / resolution)};
}

template <typename Tree>
std::set<Leaf> occupied_leaves(const Tree& tree) {
  std::set<Leaf> leaves;
  for (auto leaf = tree.begin_leafs(); leaf != tree.end_leafs(); ++leaf) {
    if (!tree.isNodeOccupied(*leaf)) continue;
    leaves.insert(leaf_of(Vector3(leaf.getX(), leaf.getY(), leaf.getZ()), leaf.getSize(),
                          tree.getResolution()));
  }
  return leaves;
}

// Single cells, free ones among them, and a block that prunes to larger leaves.
template <typename Tree>
void fill(Tree& tree, std::mt19937_64& random) {
  const Scalar size = tree.getResolution();
  const Scalar reach = size * std::pow(10, testing::random_number(0.5, 4.4, random));
  const auto place = [&] { return float(reach * testing::random_number(-1, 1, random)); };
  for (int k = 0; k < 60; ++k) {
    tree.updateNode(octomap::point3d(place(), place(), place()),
                    testing::random_index(3, random) != 0);
  }
  const int corner = testing::random_index(20, random) - 10;
  for (int k = 0; k < 12 * 12 * 12; ++k) {
    const octomap::point3d cell(float((corner + k % 12 + 0.5) * size),
                                float((k / 12 % 12 + 0.5) * size), float((k / 144 + 0.5) * size));
    tree.updateNode(cell, true, true);
  }
  tree.updateInnerOccupancy();
  tree.prune();
}

class OctreeFile : public ::testing::Test {
 protected:
  template <typename Tree>
  void expect_same(const Tree& tree, const std::filesystem::path& file) const {
    const std::vector<OccupiedCube> cubes = load_octree(file);
    std::set<Leaf> leaves;
    for (const OccupiedCube& cube : cubes) {
      leaves.insert(leaf_of(cube.center, cube.size, tree.getResolution()));
    }
    EXPECT_EQ(leaves.size(), cubes.size());
    EXPECT_EQ(leaves, occupied_leaves(tree));
  }
  void expect_refused(const std::string& bytes, const std::string& part) const {
    try {
      load_octree(directory_.write("bad.bt", bytes));
      ADD_FAILURE() << "no error; expected " << part;
    } catch (const FileError& error) {
      EXPECT_NE(std::string(error.what()).find(part), std::string::npos) << error.what();
    }
  }

  testing::TemporaryDirectory directory_;
};

TEST_F(OctreeFile, HoldsTheLeavesThatOctoMapReads) {
  std::mt19937_64 random(5);
  for (const Scalar resolution : {1e-3, 0.05, 0.1, 2.0}) {
    for (int k = 0; k < 5; ++k) {
      octomap::OcTree tree(resolution);
      fill(tree, random);
      const std::string full = (directory_.path() / "map.ot").string();
      const std::string binary = (directory_.path() / "map.bt").string();
      ASSERT_TRUE(tree.write(full));
      expect_same(tree, full);
      ASSERT_TRUE(tree.writeBinary(binary));
      const octomap::OcTree back(binary);
      expect_same(back, binary);
      octomap::ColorOcTree colors(resolution);
      fill(colors, random);
      ASSERT_TRUE(colors.write(full));
      expect_same(colors, full);
    }
  }
}

TEST_F(OctreeFile, NamesWhatIsWrong) {
  const std::string first = "# Octomap OcTree binary file\n";
  const std::string head = first + "# a comment\nid OcTree\nsize 2\nres 0.1\ndata\n";
  expect_refused("", "first line");
  expect_refused("OFF\n", ":1: expected the first line");
  expect_refused(first + "id OcTree\n", "expected the line `data`");
  expect_refused(first + "id OcTree\nres x\n", ":3: resolution: expected a finite number");
  expect_refused(first + "id\n", "expected a key and a value");
  expect_refused(first + "id OcTree\ndata\n__", "must be > 0, not 0");
  expect_refused(first + "id Stamped\nres 1\ndata\n__", "not 'Stamped'");
  expect_refused(head + "\x01", "truncated");
  expect_refused(head + "\x03" + std::string(1, '\0') + "\x02", "truncated");
  expect_refused(head + std::string(2, '\0'), "no occupied leaf");
  expect_refused(head + "\x02" + std::string(2, '\0'), "1 bytes before");
  std::string deep;
  for (int k = 0; k < 17; ++k) deep += std::string("\x03\0", 2);
  expect_refused(head + deep, "deeper than 16 levels");
}

// Cut off or damaged at any byte: an error or other leaves, never a crash.
TEST_F(OctreeFile, SurvivesDamage) {
  std::mt19937_64 random(6);
  octomap::OcTree tree(0.1);
  fill(tree, random);
  const std::string path = (directory_.path() / "map.bt").string();
  for (const bool is_binary : {true, false}) {
    ASSERT_TRUE(is_binary ? tree.writeBinary(path) : tree.write(path));
    const std::string whole = testing::TemporaryDirectory::read(path);
    for (int k = 0; k < 200; ++k) {
      std::string bytes = whole;
      const auto at = std::size_t(testing::random_index(int(bytes.size()), random));
      if (k % 2 == 0) {
        bytes.resize(at);
        EXPECT_THROW(load_octree(directory_.write("cut.bt", bytes)), FileError);
        continue;
      }
      bytes[at] = char(testing::random_index(256, random));
      try {
        for (const OccupiedCube& cube : load_octree(directory_.write("cut.bt", bytes))) {
          ASSERT_TRUE(cube.center.allFinite() && cube.size > 0);
        }
      } catch (const FileError& error) {
        EXPECT_FALSE(std::string(error.what()).empty());
      }
    }
  }
}

}  // namespace
}  // namespace dyop
