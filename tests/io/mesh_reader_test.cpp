// SPDX-License-Identifier: BSD-3-Clause

// The readers of our own, held against what was written: every format, style and number.

#include "io/mesh/mesh_reader.h"

#include <gtest/gtest.h>
#include <zlib.h>

#include <bit>
#include <cmath>
#include <functional>

#include "dyop/io/file_error.h"
#include "dyop/io/mesh_file.h"
#include "support/inputs/cube_files.h"
#include "support/inputs/random_inputs.h"
#include "support/temporary_directory.h"

namespace dyop {
namespace {

using testing::Polygons;
using testing::TemporaryDirectory;
using testing::TextStyle;

// Coordinates of every magnitude and sign, with all their bits in use.
Polygons random_triangles(std::mt19937_64& random) {
  Polygons mesh;
  const int vertex_count = 3 + testing::random_index(40, random);
  const Scalar offset = testing::random_index(2, random) == 0 ? 0 : 1e6;
  const Scalar size = testing::random_magnitude(-4, 4, random);
  const auto coordinate = [&] { return offset + size * testing::random_number(-1, 1, random); };
  for (int k = 0; k < vertex_count; ++k) {
    mesh.vertices.emplace_back(coordinate(), coordinate(), coordinate());
  }
  const int repeated = testing::random_index(vertex_count, random);
  mesh.vertices[0] = mesh.vertices[std::size_t(repeated)];
  const int count = 1 + testing::random_index(60, random);
  for (int k = 0; k < count; ++k) {
    mesh.polygons.push_back({testing::random_index(vertex_count, random),
                             testing::random_index(vertex_count, random),
                             testing::random_index(vertex_count, random)});
  }
  return mesh;
}

void expect_same_bits(const TriangleMesh& mesh, const Polygons& written, const std::string& what) {
  ASSERT_EQ(mesh.triangles().size(), written.polygons.size()) << what;
  for (std::size_t k = 0; k < written.polygons.size(); ++k) {
    const Triangle triangle = mesh.triangle(std::int32_t(k));
    for (std::size_t i = 0; i < 3; ++i) {
      const Vector3& p = written.vertices[std::size_t(written.polygons[k][i])];
      for (int axis = 0; axis < 3; ++axis) {
        ASSERT_EQ(std::bit_cast<std::uint64_t>(triangle[i][axis]),
                  std::bit_cast<std::uint64_t>(p[axis]))
            << what << ", triangle " << k << ", corner " << i << ", axis " << axis;
      }
    }
  }
}

class MeshReader : public ::testing::Test {
 protected:
  TriangleMesh load(const std::string& name, const std::string& bytes) const {
    return load_mesh(directory_.write(name, bytes));
  }

  TemporaryDirectory directory_;
};

TEST_F(MeshReader, KeepsEveryBitOfADouble) {
  const Scalar third = 1.0 / 3;
  const Scalar smallest = std::numeric_limits<Scalar>::denorm_min();
  const Polygons mesh{
      {Vector3(third, std::nextafter(third, 1.0), -third), Vector3(0.1, 1e-300, smallest),
       Vector3(1e6 + third, 123456789.123456789, 5)},
      {{0, 1, 2}}};
  expect_same_bits(load("a.obj", testing::obj_of(mesh)), mesh, "OBJ");
  expect_same_bits(load("a.off", testing::off_of(mesh)), mesh, "OFF");
  expect_same_bits(load("a.stl", testing::stl_ascii_of(mesh)), mesh, "STL");
  expect_same_bits(load("a.ply", testing::ply_ascii_of(mesh)), mesh, "PLY");
  expect_same_bits(load("b.ply", testing::ply_binary_of<double>(mesh, false)), mesh, "little PLY");
  expect_same_bits(load("c.ply", testing::ply_binary_of<double>(mesh, true)), mesh, "big PLY");
}

TEST_F(MeshReader, ReadsBackRandomMeshesInEveryFormatAndStyle) {
  std::mt19937_64 random(20260701);
  const std::vector<TextStyle> styles{
      {},
      {.line_end = "\r\n"},
      {.line_end = " \t\r\n\n", .blank = " \t "},
      {.has_comments = true},
      {.has_negative_indices = true},
      {.line_end = "\r\n", .blank = "  ", .has_comments = true, .has_negative_indices = true}};
  for (int round = 0; round < 30; ++round) {
    const Polygons mesh = random_triangles(random);
    for (std::size_t s = 0; s < styles.size(); ++s) {
      const std::string what = "round " + std::to_string(round) + ", style " + std::to_string(s);
      expect_same_bits(load("a.obj", testing::obj_of(mesh, styles[s])), mesh, what + ", OBJ");
      expect_same_bits(load("a.off", testing::off_of(mesh, styles[s])), mesh, what + ", OFF");
      expect_same_bits(load("a.stl", testing::stl_ascii_of(mesh, styles[s])), mesh, what + ", STL");
      expect_same_bits(load("a.ply", testing::ply_ascii_of(mesh, styles[s])), mesh, what + ", PLY");
    }
    for (const bool is_big : {false, true}) {
      expect_same_bits(load("b.ply", testing::ply_binary_of<double>(mesh, is_big)), mesh,
                       "binary PLY");
    }
    Polygons single = mesh;
    for (Vector3& p : single.vertices) {
      for (Scalar& x : p) {
        const volatile float rounded = float(x);  // g++ 12 drops a conversion there and back
        x = Scalar(rounded);
      }
    }
    expect_same_bits(load("b.stl", testing::stl_binary_of(single)), single, "binary STL");
    expect_same_bits(load("c.ply", testing::ply_binary_of<float>(single)), single, "float PLY");
  }
}

TEST_F(MeshReader, NumbersVerticesAsTheFileDoesAndJoinsThoseAtOnePlace) {
  Polygons mesh{{Vector3(0, 0, 0), Vector3(3, 0, 0), Vector3(9, 9, 9), Vector3(0, 3, 0)},
                {{3, 0, 1}}};
  for (const TriangleMesh& loaded :
       {load("a.obj", testing::obj_of(mesh)), load("a.off", testing::off_of(mesh)),
        load("a.ply", testing::ply_ascii_of(mesh))}) {
    ASSERT_EQ(loaded.vertices().size(), 4u);
    EXPECT_EQ(loaded.vertices()[2], Vector3(9, 9, 9));  // no triangle uses it
    EXPECT_EQ(loaded.triangles()[0], (TriangleIndices{3, 0, 1}));
  }
  mesh.vertices[2] = Vector3(-0.0, 0, 0);  // the same place as vertex 0
  const TriangleMesh joined = load("a.obj", testing::obj_of(mesh));
  ASSERT_EQ(joined.vertices().size(), 3u);
  EXPECT_EQ(joined.triangles()[0], (TriangleIndices{2, 0, 1}));
}

TEST_F(MeshReader, ReadsEveryFormatThroughGzip) {
  const Polygons cube = testing::cube_polygons();
  for (const auto& [name, bytes] : std::vector<std::pair<std::string, std::string>>{
           {"a.obj.gz", testing::obj_of(cube)},
           {"a.off.gz", testing::off_of(cube)},
           {"a.PLY.GZ", testing::ply_binary_of<double>(cube)},
           {"a.stl.gz", testing::stl_binary_of(cube)}}) {
    const std::filesystem::path file = directory_.path() / name;
    const gzFile out = gzopen(file.c_str(), "wb");
    ASSERT_EQ(gzwrite(out, bytes.data(), unsigned(bytes.size())), int(bytes.size()));
    ASSERT_EQ(gzclose(out), Z_OK);
    expect_same_bits(load_mesh(file), cube, name);
  }
}

TEST_F(MeshReader, LeavesAloneWhatIsNoGeometry) {
  const Polygons cube = testing::cube_polygons();
  expect_same_bits(
      load("a.obj", "usemtl x\ns off\n" + testing::obj_of(cube) + "vp 1 2\ncurv 0 1 1\n"), cube,
      "OBJ");
  expect_same_bits(load("w.obj", "v 0 0 0 7\nv 1 0 0 0.5 0.5 0.5\nv 0 +1.0e0 0 1\nf 1 2 3\n"),
                   {{Vector3(0, 0, 0), Vector3(1, 0, 0), Vector3(0, 1, 0)}, {{0, 1, 2}}},
                   "OBJ with weights and colours");
  expect_same_bits(load("a.off",
                        "COFF 3 1 0\n0 0 0 255 0 0\n1 0 0 0 255 0\n0 1 0 0 0 255\n"
                        "3 0 1 2 0.5 0.5 0.5\n"),
                   {{Vector3(0, 0, 0), Vector3(1, 0, 0), Vector3(0, 1, 0)}, {{0, 1, 2}}},
                   "OFF with colours");
  const std::string ply =
      "ply\nformat ascii 1.0\nobj_info made up\nelement material 1\nproperty list uchar int tags\n"
      "property uchar red\nelement vertex 3\nproperty float nx\nproperty float z\n"
      "property float y\nproperty list uchar int vertex_indices\nproperty short x\n"
      "element face 1\nproperty uchar flags\nproperty list uchar uint vertex_index\n"
      "element edge 1\nproperty int vertex1\nproperty int vertex2\nend_header\n"
      "2 5 6 255\n9 0 0 1 7 0\n9 0 0 0 1\n9 0 1 2 3 3 0\n1 3 0 1 2\n0 1\n";
  expect_same_bits(load("a.ply", ply),
                   {{Vector3(0, 0, 0), Vector3(1, 0, 0), Vector3(0, 1, 0)}, {{0, 1, 2}}},
                   "PLY with more properties");
}

TEST_F(MeshReader, ReadsTextWithAByteOrderMarkAndKeywordsInCapitals) {
  const Polygons cube = testing::cube_polygons();
  const std::string mark = "\xEF\xBB\xBF";
  // The mark once hid the first vertex, and with it which vertices later ones are.
  expect_same_bits(load("a.obj", mark + testing::obj_of(cube)), cube, "OBJ");
  expect_same_bits(load("a.off", mark + testing::off_of(cube)), cube, "OFF");
  std::string stl = testing::cube_stl_ascii();
  const TriangleMesh wanted = load("a.stl", stl);
  Polygons facets;
  for (std::size_t k = 0; k < wanted.triangles().size(); ++k) {
    const Triangle corners = wanted.triangle(std::int32_t(k));
    facets.vertices.insert(facets.vertices.end(), corners.begin(), corners.end());
    const auto first = std::int32_t(3 * k);
    facets.polygons.push_back({first, first + 1, first + 2});
  }
  expect_same_bits(load("b.stl", mark + stl), facets, "STL");
  for (char& c : stl) c = char(std::toupper(static_cast<unsigned char>(c)));
  expect_same_bits(load("c.stl", stl), facets, "STL in capitals");
}

TEST_F(MeshReader, ReadsStripsOfPly) {
  const std::string text =
      "ply\nformat ascii 1.0\nelement vertex 5\nproperty float x\nproperty float y\n"
      "property float z\nelement tristrips 1\nproperty list int int vertex_indices\nend_header\n"
      "0 0 0\n1 0 0\n0 1 0\n1 1 0\n5 5 5\n8 0 1 2 3 -1 4 0 1\n";
  const TriangleMesh mesh = load("a.ply", text);
  ASSERT_EQ(mesh.triangles().size(), 3u);
  EXPECT_EQ(mesh.triangles()[0], (TriangleIndices{0, 1, 2}));
  EXPECT_EQ(mesh.triangles()[1], (TriangleIndices{2, 1, 3}));
  EXPECT_EQ(mesh.triangles()[2], (TriangleIndices{4, 0, 1}));
}

// A damaged file is refused, or read as what is left of it; it never gives numbers that are not
// finite, and the message is one line that begins with the file.
struct Outcome {
  bool is_loaded = false;
  std::size_t triangles = 0;
};
Outcome load_damaged(const std::filesystem::path& file) {
  try {
    const TriangleMesh mesh = load_mesh(file);
    for (const Vector3& p : mesh.vertices()) EXPECT_TRUE(p.allFinite()) << file;
    return {true, mesh.triangles().size()};
  } catch (const FileError& error) {
    const std::string message = error.what();
    EXPECT_TRUE(message.starts_with(file.string() + ":")) << message;
    EXPECT_EQ(message.find('\n'), std::string::npos) << message;
    return {};
  }
}

struct Sample {
  const char* name;
  std::string bytes;
  std::size_t tail;  // so many bytes at the end may be missing
};
std::vector<Sample> samples() {
  const Polygons cube = testing::cube_polygons();
  return {{"a.off", testing::off_of(cube), 1},
          {"a.ply", testing::ply_ascii_of(cube), 1},
          {"b.ply", testing::ply_binary_of<double>(cube), 0},
          {"a.stl", testing::stl_ascii_of(cube), std::string(" made up\n").size()},
          {"b.stl", testing::stl_binary_of(cube), 0}};
}

TEST_F(MeshReader, RefusesEveryTruncatedFile) {
  for (const Sample& sample : samples()) {
    for (std::size_t size = 0; size < sample.bytes.size() - sample.tail; size += 1 + size / 32) {
      const auto file = directory_.write(sample.name, sample.bytes.substr(0, size));
      EXPECT_FALSE(load_damaged(file).is_loaded) << sample.name << " of " << size << " bytes";
    }
  }
}

TEST_F(MeshReader, ReadsOrRefusesFilesWithAWrongByte) {
  std::mt19937_64 random(20260702);
  int loaded = 0;
  int refused = 0;
  std::vector<Sample> all = samples();
  all.push_back({"a.obj", testing::obj_of(testing::cube_polygons()), 0});
  for (const Sample& sample : all) {
    for (int round = 0; round < 100; ++round) {
      std::string bytes = sample.bytes;
      const auto place = std::size_t(testing::random_index(int(bytes.size()), random));
      bytes[place] = char(testing::random_index(256, random));
      (load_damaged(directory_.write(sample.name, bytes)).is_loaded ? loaded : refused) += 1;
    }
  }
  EXPECT_GT(loaded, 50);
  EXPECT_GT(refused, 100);
}

TEST_F(MeshReader, NamesWhatIsWrong) {
  const std::string ply =
      "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\n"
      "property float y\n";
  const std::string faces =
      "element face 1\nproperty list uchar int vertex_indices\nend_header\n"
      "0 0 0\n1 0 0\n0 1 0\n";
  const std::vector<std::array<std::string, 3>> cases{
      {"a.obj", "v 0 0 0\nl 1\n", ":2: line: expected at least two vertices"},
      {"a.obj", "v 0 0 0\nf\n", ":2: face without vertices"},
      {"a.obj", "v 0 0 0\nf 1 7 2\nf 1 1 3\n", ":2: vertex index 7 is out of range"},
      {"a.off", "4OFF\n", ":1: only three coordinates per vertex are supported, not '4OFF'"},
      {"a.off", "OFF BINARY\n", ":1: binary OFF is not supported"},
      {"a.off", "OFF\n-1 2 0\n", ":2: counts must not be negative"},
      {"a.off", "OFF\n1 1 0\n0 0 0\n0\n", ":4: face: expected 0 vertex indices, found 0"},
      {"a.ply", ply + "property float z\nelement vertex 2\nend_header\n",
       "element 'vertex' occurs twice"},
      {"a.ply", ply + faces, "element 'vertex' has no number 'z'"},
      {"a.ply", ply + "property list uchar int z\n" + faces, "element 'vertex' has no number 'z'"},
      {"a.ply", ply + "property float z\nelement face 1\nproperty int a\nend_header\n",
       "element 'face' has no list 'vertex_indices'"},
      {"a.ply", ply + "property float z\n" + faces + "3 0 1 1.5\n",
       ":13: vertex index: expected an integer, found 1.5"},
      {"a.ply", ply + "property float z\n" + faces + "2.5 0 1 1\n",
       ":13: expected the length of a list, found 2.5"},
      {"a.ply", ply + "property float z\n" + faces + "3 0 1\n",
       ":13: expected more numbers on this line"},
      {"a.stl", "solid x\nvertex 0 0 0\nendfacet\n", ":2: vertex outside a facet"},
      {"a.stl", "solid x\nfacet normal 0 0 1\nendsolid\n", ":3: expected 'endfacet'"},
      {"a.stl", "solid x\nfacet normal 0 0 1\nfacet normal 0 0 1\n", ":3: expected 'endfacet'"},
      {"a.stl", "solid x\nfacet\nvertex 1 2 3\nendfacet\n",
       ":4: facet: expected 3 vertices, found 1"}};
  for (const auto& [name, bytes, part] : cases) {
    try {
      load(name, bytes);
      ADD_FAILURE() << "no error from " << bytes;
    } catch (const FileError& error) {
      EXPECT_NE(std::string(error.what()).find(part), std::string::npos)
          << error.what() << " from\n"
          << bytes;
    }
  }
}

}  // namespace
}  // namespace dyop
