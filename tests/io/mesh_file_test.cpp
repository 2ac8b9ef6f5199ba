// SPDX-License-Identifier: BSD-3-Clause
#include "dyop/io/mesh_file.h"

#include <gtest/gtest.h>
#include <zlib.h>

#include <algorithm>

#include "dyop/io/file_error.h"
#include "support/inputs/cube_files.h"
#include "support/temporary_directory.h"

namespace dyop {
namespace {

using testing::TemporaryDirectory;

std::string message_of(const std::filesystem::path& file) {
  try {
    load_mesh(file);
  } catch (const FileError& error) {
    EXPECT_EQ(error.file(), file);
    const std::string message = error.what();
    EXPECT_EQ(message.find('\n'), std::string::npos) << message;
    EXPECT_TRUE(message.starts_with(file.string())) << message;
    return message.substr(std::min(message.size(), file.string().size()));
  }
  return "no error";
}

// The message must hold the part.
#define EXPECT_MESSAGE(file, part)                                                   \
  do {                                                                               \
    const std::string message = message_of(file);                                    \
    EXPECT_NE(message.find(part), std::string::npos) << "the message is" << message; \
  } while (false)

// Corners of all triangles, each rotated to begin with its smallest corner, sorted: independent of
// the numbering, but not of the orientation.
std::vector<std::array<std::array<Scalar, 3>, 3>> sorted_corners(const TriangleMesh& mesh) {
  std::vector<std::array<std::array<Scalar, 3>, 3>> all;
  for (std::size_t k = 0; k < mesh.triangles().size(); ++k) {
    const Triangle triangle = mesh.triangle(std::int32_t(k));
    std::array<std::array<Scalar, 3>, 3> corners;
    for (std::size_t i = 0; i < 3; ++i) {
      corners[i] = {triangle[i].x(), triangle[i].y(), triangle[i].z()};
    }
    std::rotate(corners.begin(), std::min_element(corners.begin(), corners.end()), corners.end());
    all.push_back(corners);
  }
  std::sort(all.begin(), all.end());
  return all;
}

class MeshFile : public ::testing::Test {
 protected:
  void expect_cube(const std::filesystem::path& file) const {
    const TriangleMesh mesh = load_mesh(file);
    const TriangleMesh expected = load_mesh(directory_.write("expected.obj", testing::cube_obj()));
    EXPECT_EQ(mesh.vertices().size(), 8u) << file;
    EXPECT_EQ(sorted_corners(mesh), sorted_corners(expected)) << file;
    EXPECT_TRUE(mesh.is_closed()) << file;
    EXPECT_DOUBLE_EQ(mesh.compute_mass_properties(1).mass, 1) << file;
  }

  TemporaryDirectory directory_;
};

TEST_F(MeshFile, LoadsTheCubeFromObjExactly) {
  const TriangleMesh mesh = load_mesh(directory_.write("cube.obj", testing::cube_obj()));
  ASSERT_EQ(mesh.triangles().size(), testing::kCubeTriangles.size());
  for (std::size_t k = 0; k < testing::kCubeTriangles.size(); ++k) {
    const Triangle triangle = mesh.triangle(std::int32_t(k));
    for (std::size_t i = 0; i < 3; ++i) {
      const auto& v = testing::kCubeVertices[std::size_t(testing::kCubeTriangles[k][i])];
      EXPECT_EQ(triangle[i], Vector3(v[0], v[1], v[2]));
    }
  }
}

TEST_F(MeshFile, LoadsTheSameCubeFromEveryFormat) {
  expect_cube(directory_.write("cube.off", testing::cube_off()));
  expect_cube(directory_.write("ascii.stl", testing::cube_stl_ascii()));
  expect_cube(directory_.write("binary.stl", testing::cube_stl_binary()));
  expect_cube(directory_.write("ascii.ply", testing::cube_ply_ascii()));
  expect_cube(directory_.write("binary.ply", testing::cube_ply_binary()));
  expect_cube(directory_.write("cube.gltf", testing::cube_gltf()));
}

TEST_F(MeshFile, LoadsGzippedPly) {
  const std::filesystem::path file = directory_.path() / "cube.ply.gz";
  const gzFile out = gzopen(file.c_str(), "wb");
  const std::string bytes = testing::cube_ply_binary();
  ASSERT_EQ(gzwrite(out, bytes.data(), unsigned(bytes.size())), int(bytes.size()));
  ASSERT_EQ(gzclose(out), Z_OK);
  expect_cube(file);

  const std::string compressed = TemporaryDirectory::read(file);
  const auto truncated =
      directory_.write("half.ply.gz", compressed.substr(0, compressed.size() / 2));
  EXPECT_MESSAGE(truncated, "damaged gzip data");
}

TEST_F(MeshFile, JoinsVerticesThatNormalsSplit) {
  // Each face has its own normal, so that assimp would split all vertices.
  std::ostringstream text;
  text << "vn 0 0 1\nvn 0 1 0\nvn 1 0 0\n";
  for (const auto& v : testing::kCubeVertices) {
    text << "v " << v[0] << ' ' << v[1] << ' ' << v[2] << '\n';
  }
  for (std::size_t k = 0; k < testing::kCubeTriangles.size(); ++k) {
    text << 'f';
    for (const int i : testing::kCubeTriangles[k]) text << ' ' << i + 1 << "//" << k % 3 + 1;
    text << '\n';
  }
  expect_cube(directory_.write("normals.obj", text.str()));
}

TEST_F(MeshFile, AppliesTheTransformOfANode) {
  const TriangleMesh mesh =
      load_mesh(directory_.write("moved.gltf", testing::cube_gltf("\"translation\":[10,20,30]")));
  EXPECT_EQ(mesh.bounding_box().min(), Vector3(10, 20, 30));
  EXPECT_EQ(mesh.bounding_box().max(), Vector3(11, 21, 31));
}

TEST_F(MeshFile, TurnsMirroredTrianglesOver) {
  const TriangleMesh mesh =
      load_mesh(directory_.write("mirrored.gltf", testing::cube_gltf("\"scale\":[-2,1,1]")));
  EXPECT_EQ(mesh.bounding_box().min(), Vector3(-2, 0, 0));
  EXPECT_DOUBLE_EQ(mesh.compute_mass_properties(1).mass, 2);
}

TEST_F(MeshFile, TriangulatesPolygonsAndKeepsLinesAndPoints) {
  const TriangleMesh mesh = load_mesh(directory_.write(
      "mixed.obj", "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 5 5 5\nf 1 2 3 4\nl 1 5\np 5\n"));
  std::size_t segments = 0;
  std::size_t points = 0;
  for (const TriangleIndices& t : mesh.triangles()) {
    const bool is_point = t[0] == t[1] && t[1] == t[2];
    points += is_point;
    segments += !is_point && (t[0] == t[1] || t[1] == t[2] || t[2] == t[0]);
  }
  EXPECT_EQ(mesh.triangles().size(), 4u);
  EXPECT_EQ(segments, 1u);
  EXPECT_EQ(points, 1u);
}

TEST_F(MeshFile, ReadsNegativeIndicesContinuedLinesAndForwardReferences) {
  const TriangleMesh mesh = load_mesh(directory_.write(
      "odd.obj", "f 1 2 3\nv 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf -4 -3 \\\n -1\n"));
  EXPECT_EQ(mesh.triangles().size(), 2u);
}

TEST_F(MeshFile, NamesAFileThatIsMissingOrADirectoryOrEmpty) {
  EXPECT_MESSAGE(directory_.path() / "none.obj", ": no such file");
  EXPECT_MESSAGE(directory_.path(), "expected a file, found a directory");
  EXPECT_MESSAGE(directory_.write("empty.obj", ""), ": the file is empty");
  EXPECT_MESSAGE(directory_.write("empty.stl", ""), ": the file is empty");
}

TEST_F(MeshFile, NamesLineAndValueOfDamagedObj) {
  EXPECT_MESSAGE(directory_.write("a.obj", "v 0 0 0\nv 1 nan 0\nv 0 1 0\nf 1 2 3\n"),
                 ":2: vertex y: expected a finite number, found 'nan'");
  EXPECT_MESSAGE(directory_.write("b.obj", "v 0 0 0\nv 1 1e999 0\nv 0 1 0\nf 1 2 3\n"),
                 ":2: vertex y: expected a finite number, found '1e999'");
  EXPECT_MESSAGE(directory_.write("c.obj", "v 0 0\n"),
                 ":1: vertex: expected three coordinates, found 2");
  EXPECT_MESSAGE(directory_.write("d.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 4\n"),
                 ":4: vertex index 4 is out of range: the file has 3 vertices, counted from 1");
  EXPECT_MESSAGE(directory_.write("e.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 0 1 2\n"),
                 ":4: vertex index 0 is out of range");
  EXPECT_MESSAGE(directory_.write("f.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 -4\n"),
                 ":4: vertex index -4 is out of range");
  EXPECT_MESSAGE(directory_.write("g.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 x\n"),
                 ":4: vertex index: expected an integer, found 'x'");
}

TEST_F(MeshFile, NamesWhatIsWrongWithOff) {
  EXPECT_MESSAGE(directory_.write("a.off", "OFF\n3 1 0\n0 0 0\n1 0 0\n0 inf 0\n3 0 1 2\n"),
                 ":5: vertex coordinate: expected a finite number, found 'inf'");
  EXPECT_MESSAGE(directory_.write("b.off", "OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 3\n"),
                 ":6: vertex index 3 is out of range: the file has 3 vertices, counted from 0");
  EXPECT_MESSAGE(directory_.write("c.off", "OFF\n3 1 0\n0 0 0\n1 0 0\n"),
                 "expected 3 vertices, found 2");
  EXPECT_MESSAGE(directory_.write("d.off", "OFF\n3 2 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n"),
                 "expected 2 faces, found 1");
  EXPECT_MESSAGE(directory_.write("e.off", "nonsense\n"), ":1: expected the word OFF");
}

constexpr const char* kGrid =
    "NCOLS 3\nnrows 2\nxllcorner 10\nyllcenter -5\ncellsize 2\nNODATA_value -9999\n"
    "4 5 6\n1 2\n3.5\n";

TEST_F(MeshFile, LoadsAGridOfHeightsFromNorthToSouth) {
  const TriangleMesh mesh = load_mesh(directory_.write("ground.asc", kGrid));
  EXPECT_TRUE(mesh.is_closed());
  EXPECT_EQ(mesh.triangles().size(), 4u + 3 * 6);
  EXPECT_EQ(mesh.vertices()[0], Vector3(11, -5, 1));
  EXPECT_EQ(mesh.vertices()[2], Vector3(15, -5, 3.5));
  EXPECT_EQ(mesh.vertices()[3], Vector3(11, -3, 4));
  EXPECT_EQ(mesh.bounding_box().min().z(), 1 - 5);
  EXPECT_DOUBLE_EQ(load_mesh(directory_.write("b.asc", "ncols 2\nnrows 2\ndx 1\ndy 3\n1 1 1 1"))
                       .bounding_box()
                       .sizes()
                       .y(),
                   3);
}

TEST_F(MeshFile, NamesWhatIsWrongWithAGridOfHeights) {
  const std::string head = "ncols 2\nnrows 2\ncellsize 1\n";
  EXPECT_MESSAGE(directory_.write("a.asc", head + "1 2\n3 x\n"), ":5: height: expected a finite");
  EXPECT_MESSAGE(directory_.write("b.asc", head + "1 2\n3\n"), "expected 4 heights, found 3");
  EXPECT_MESSAGE(directory_.write("c.asc", head + "1 2\n3 4 5\n"),
                 "expected 4 heights, found more");
  EXPECT_MESSAGE(directory_.write("d.asc", "nodata_value 7\n" + head + "1 7\n3 4\n"),
                 ":5: a cell without data, '7'");
  EXPECT_MESSAGE(directory_.write("e.asc", "ncols 2\n1 2\n"), "the header has no nrows");
  EXPECT_MESSAGE(directory_.write("f.asc", "ncols 2\nnrows 1.5\ncellsize 1\n1 2\n"),
                 "nrows must be an integer from 2");
  EXPECT_MESSAGE(directory_.write("g.asc", "ncols 2\nnrows 1e300\ncellsize 1\n1 2\n"),
                 "not 1e+300");
  EXPECT_MESSAGE(directory_.write("h.asc", "ncols 2\nncols 2\n"), ":2: a second ncols");
  EXPECT_MESSAGE(directory_.write("i.asc", "ncols 2 3\n"), ":1: ncols: expected one value");
  EXPECT_MESSAGE(directory_.write("j.asc", "color 2\n"), ":1: unknown key 'color'");
  EXPECT_MESSAGE(directory_.write("k.asc", head), "expected heights after the header");
  EXPECT_MESSAGE(directory_.write("l.asc", "ncols 2\nnrows 2\ncellsize -1\n1 2 3 4\n"),
                 "must be > 0, not -1");
}

TEST_F(MeshFile, NamesWhatIsWrongWithStl) {
  const std::string whole = testing::cube_stl_binary();
  EXPECT_MESSAGE(
      directory_.write("a.stl", whole.substr(0, whole.size() - 10)),
      "truncated or damaged: the header announces 12 facets, expected 684 bytes, found 674");
  EXPECT_MESSAGE(directory_.write("b.stl", whole.substr(0, 50)),
                 "truncated: expected at least 84 bytes");
  std::string with_nan = whole;
  const float nan = std::numeric_limits<float>::quiet_NaN();
  std::memcpy(with_nan.data() + 84 + 50 + 12 + 12, &nan, sizeof(nan));
  EXPECT_MESSAGE(directory_.write("c.stl", with_nan),
                 "facet 1, vertex 1: expected finite numbers, found nan");
  const std::string text = testing::cube_stl_ascii();
  EXPECT_MESSAGE(directory_.write("d.stl", text.substr(0, text.size() / 2)),
                 "truncated: expected 'endsolid'");
  EXPECT_MESSAGE(directory_.write("e.stl",
                                  "solid x\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\n"
                                  "vertex 1 0 nan\n"),
                 ":5: vertex coordinate: expected a finite number, found 'nan'");
}

TEST_F(MeshFile, NamesWhatIsWrongWithPly) {
  const std::string binary = testing::cube_ply_binary();
  EXPECT_MESSAGE(directory_.write("a.ply", binary.substr(0, binary.size() - 5)),
                 "face 11 of 12: truncated");
  std::string out_of_range = binary;
  const std::int32_t index = 8;
  std::memcpy(out_of_range.data() + out_of_range.size() - 4, &index, sizeof(index));
  EXPECT_MESSAGE(directory_.write("b.ply", out_of_range),
                 "face 11 of 12: vertex index 8 is out of range: the file has 8 vertices");
  std::string with_nan = binary;
  const float nan = std::numeric_limits<float>::quiet_NaN();
  std::memcpy(
      with_nan.data() +
          testing::ply_header_of<float>(testing::cube_polygons(), "binary_little_endian").size(),
      &nan, sizeof(nan));
  EXPECT_MESSAGE(directory_.write("c.ply", with_nan), "vertex 0 of 8: x: expected a finite number");
  const std::string text = testing::cube_ply_ascii();
  EXPECT_MESSAGE(directory_.write("d.ply", text.substr(0, text.size() - 16)),
                 "truncated: expected 12");
  EXPECT_MESSAGE(directory_.write("e.ply", "ply\nformat ascii 1.0\nelement vertex 3\n"),
                 "truncated: expected end_header");
  EXPECT_MESSAGE(directory_.write("f.ply", "rubbish"), ":1: expected the word ply");
}

TEST_F(MeshFile, RefusesAFaceWithoutVertices) {
  EXPECT_MESSAGE(directory_.write("a.ply",
                                  "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\n"
                                  "property float y\nproperty float z\nelement face 2\n"
                                  "property list uchar int vertex_indices\nend_header\n"
                                  "0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n0\n"),
                 ": face 1 has no vertices");
}

TEST_F(MeshFile, RefusesWhatHoldsNoTriangles) {
  EXPECT_MESSAGE(directory_.write("a.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\n"),
                 ": the file has no triangles");
  EXPECT_MESSAGE(directory_.write("a.txt", "hello"), "not a readable mesh");
  EXPECT_MESSAGE(directory_.write("a.gltf", "{\"asset\":"), "not a readable mesh");
  EXPECT_MESSAGE(directory_.write("a.gltf.gz", "x"),
                 "only as .asc.gz, .obj.gz, .off.gz, .ply.gz and .stl.gz");
}

TEST_F(MeshFile, PlacesAMesh) {
  const TriangleMesh cube = load_mesh(directory_.write("cube.obj", testing::cube_obj()));
  for (const MeshCenter center : {MeshCenter::Bounds, MeshCenter::Mass}) {
    const TriangleMesh placed = place_mesh(cube, {.scale = 4, .center = center, .is_shell = false});
    EXPECT_TRUE(placed.bounding_box().min().isApprox(Vector3(-2, -2, -2)));
    EXPECT_TRUE(placed.bounding_box().max().isApprox(Vector3(2, 2, 2)));
  }
  EXPECT_EQ(place_mesh(cube, {}).vertices()[6], cube.vertices()[6]);
  EXPECT_THROW(place_mesh(cube, {.scale = 0, .center = {}, .is_shell = false}), InvalidArgument);
}

}  // namespace
}  // namespace dyop
