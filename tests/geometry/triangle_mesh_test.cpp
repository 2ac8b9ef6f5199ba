// SPDX-License-Identifier: BSD-3-Clause
#include "dyop/geometry/triangle_mesh.h"

#include <gtest/gtest.h>

#include <cstring>
#include <numbers>

#include "core/tolerance.h"
#include "dyop/core/error.h"
#include "dyop/core/rigid_pose.h"
#include "support/inputs/mesh_generators.h"
#include "support/message_of.h"

namespace dyop {
namespace {

using testing::box_mesh;
using testing::gear;
using testing::icosphere;
using testing::MeshArrays;
using testing::message_of;
using testing::needle;
using testing::plate_grid;
using testing::point_cloud;
using testing::torus;

#define EXPECT_MESSAGE(expression, part)                                                      \
  EXPECT_NE(message_of([&] { static_cast<void>(expression); }).find(part), std::string::npos) \
      << message_of([&] { static_cast<void>(expression); })

const std::vector<Vector3> kCorners{Vector3::Zero(), Vector3::UnitX(), Vector3::UnitY()};

TEST(TriangleMesh, FromArraysTakesEveryKindOfNumber) {
  const std::vector<float> x{0, 0, 0, 1, 0, 0, 0.5f, 2, 0.25f};
  const std::vector<double> y(x.begin(), x.end());
  const std::vector<std::int32_t> i{2, 0, 1};
  const std::vector<std::uint32_t> j(i.begin(), i.end());
  const StridedRows<float> floats{x.data(), 3};
  const StridedRows<double> doubles{y.data(), 3};
  const StridedRows<std::int32_t> with_sign{i.data(), 1};
  const StridedRows<std::uint32_t> without_sign{j.data(), 1};
  for (const TriangleMesh& mesh : {TriangleMesh::from_arrays(floats, with_sign),
                                   TriangleMesh::from_arrays(floats, without_sign),
                                   TriangleMesh::from_arrays(doubles, with_sign),
                                   TriangleMesh::from_arrays(doubles, without_sign)}) {
    EXPECT_EQ(mesh.triangle(0)[0], Vector3(0.5, 2, 0.25));
    EXPECT_EQ(mesh.triangle(0)[2], Vector3(1, 0, 0));
  }
}

TEST(TriangleMesh, RefusesNoTriangle) {
  EXPECT_MESSAGE(TriangleMesh(kCorners, {}), "at least one triangle, not 0 (with 3 vertices)");
}

TEST(TriangleMesh, NamesAnIndexOutOfRange) {
  EXPECT_MESSAGE(TriangleMesh(kCorners, {{0, 1, 2}, {0, 3, 1}}),
                 "triangle 1: vertex number 3 is out of range, the mesh has 3 vertices");
  EXPECT_MESSAGE(TriangleMesh(kCorners, {{0, -7, 1}}), "vertex number -7 is out of range");
  EXPECT_MESSAGE(TriangleMesh({}, {{0, 0, 0}}), "the mesh has 0 vertices");
}

TEST(TriangleMesh, NamesAVertexThatIsNotFinite) {
  EXPECT_MESSAGE(TriangleMesh({Vector3::Zero(), Vector3(1, std::nan(""), 2)}, {{0, 0, 0}}),
                 "vertex 1 is not finite: (1, nan, 2)");
  EXPECT_MESSAGE(TriangleMesh({Vector3(0, 0, -kInfinity)}, {{0, 0, 0}}),
                 "vertex 0 is not finite: (0, 0, -inf)");
}

TEST(TriangleMesh, NamesAVertexBeyondTheLargestCoordinate) {
  EXPECT_MESSAGE(TriangleMesh({Vector3(0, -1e61, 0)}, {{0, 0, 0}}),
                 "vertex 0 is beyond 1e+60: (0, -1e+61");
}

TEST(TriangleMesh, FromArraysReadsPackedDoubles) {
  const std::vector<double> vertices{0, 0, 0, 1, 0, 0, 0, 1, 0.1};
  const std::vector<std::int32_t> triangles{0, 1, 2};
  const TriangleMesh mesh = TriangleMesh::from_arrays(
      StridedRows<double>{vertices.data(), 3}, StridedRows<std::int32_t>{triangles.data(), 1});
  EXPECT_EQ(mesh.vertices()[2], Vector3(0, 1, 0.1));
  EXPECT_EQ(mesh.triangles()[0], (TriangleIndices{0, 1, 2}));
}

TEST(TriangleMesh, FromArraysReadsStridedFloatsAndUnsignedIndices) {
  struct RenderVertex {
    float position[3];
    float normal[3];
  };
  struct Face {
    std::uint32_t material;
    std::uint32_t corners[3];
  };
  const std::vector<RenderVertex> vertices{
      {{0, 0, 0}, {9, 9, 9}}, {{1, 0, 0.5F}, {9, 9, 9}}, {{0, 1, 0}, {9, 9, 9}}};
  const std::vector<Face> faces{{77, {0, 1, 2}}, {77, {2, 1, 0}}};
  const TriangleMesh mesh =
      TriangleMesh::from_arrays(StridedRows<float>{vertices[0].position, 3, sizeof(RenderVertex)},
                                StridedRows<std::uint32_t>{faces[0].corners, 2, sizeof(Face)});
  EXPECT_EQ(mesh.vertices()[1], Vector3(1, 0, 0.5));
  EXPECT_EQ(mesh.triangles()[1], (TriangleIndices{2, 1, 0}));
}

TEST(TriangleMesh, FromArraysReadsRowsWithoutAlignment) {
  const std::array<double, 3> p{1, 2, 3};
  std::vector<std::byte> bytes(1 + 25 + sizeof(p));
  std::memcpy(bytes.data() + 1, p.data(), sizeof(p));
  std::memcpy(bytes.data() + 26, p.data(), sizeof(p));
  const std::array<std::uint32_t, 3> t{0, 1, 1};
  // The cast makes a pointer that is never dereferenced as a double.
  const TriangleMesh mesh = TriangleMesh::from_arrays(
      StridedRows<double>{static_cast<const double*>(static_cast<const void*>(bytes.data() + 1)), 2,
                          25},
      StridedRows<std::uint32_t>{t.data(), 1});
  EXPECT_EQ(mesh.vertices()[1], Vector3(1, 2, 3));
}

TEST(TriangleMesh, FromArraysNamesWhatIsWrong) {
  const std::vector<float> vertices{0, 0, 0, 1, 0, 0};
  const std::vector<std::uint32_t> triangles{0, 1, 4000000000U};
  const StridedRows<float> rows{vertices.data(), 2};
  const StridedRows<std::uint32_t> faces{triangles.data(), 1};
  EXPECT_MESSAGE(TriangleMesh::from_arrays(rows, faces),
                 "triangle 0: vertex number 4000000000 is out of range");
  EXPECT_MESSAGE(TriangleMesh::from_arrays(StridedRows<float>{nullptr, 2}, faces),
                 "vertices: null data for 2 rows");
  EXPECT_MESSAGE(TriangleMesh::from_arrays(rows, StridedRows<std::uint32_t>{nullptr, 2}),
                 "triangles: null data for 2 rows");
  EXPECT_MESSAGE(TriangleMesh::from_arrays(StridedRows<float>{vertices.data(), 2, 8}, faces),
                 "vertices: stride of 8 bytes is less than a row of 12");
  EXPECT_MESSAGE(TriangleMesh::from_arrays(rows, StridedRows<std::uint32_t>{triangles.data(), 0}),
                 "at least one triangle");
  // Counts are checked before any row.
  EXPECT_MESSAGE(TriangleMesh::from_arrays(
                     rows, StridedRows<std::uint32_t>{triangles.data(), std::size_t{1} << 40}),
                 "a mesh has at most 134217728 triangles, not 1099511627776");
  EXPECT_MESSAGE(
      TriangleMesh::from_arrays(StridedRows<float>{vertices.data(), std::size_t{1} << 40}, faces),
      "a mesh has at most 2147483647 vertices");
}

TEST(TriangleMesh, KeepsNothingOfTheCallersMemory) {
  auto vertices = std::make_unique<std::vector<double>>(std::vector<double>{1, 2, 3});
  const std::array<std::int32_t, 3> t{0, 0, 0};
  const TriangleMesh mesh = TriangleMesh::from_arrays(StridedRows<double>{vertices->data(), 1},
                                                      StridedRows<std::int32_t>{t.data(), 1});
  vertices->assign(3, -1);
  vertices.reset();
  EXPECT_EQ(mesh.triangle(0)[2], Vector3(1, 2, 3));
}

TEST(TriangleMesh, CopiesShareTheData) {
  const auto mesh = std::make_unique<TriangleMesh>(icosphere(1).mesh());
  const TriangleMesh copy = *mesh;
  EXPECT_EQ(copy.vertices().data(), mesh->vertices().data());
  EXPECT_EQ(&copy.hierarchy(), &mesh->hierarchy());
}

TEST(TriangleMesh, IsClosedIfEveryEdgeIsUsedOnceEachWay) {
  EXPECT_TRUE(icosphere(2).mesh().is_closed());
  EXPECT_TRUE(torus(2, 0.5, 12, 8).mesh().is_closed());
  EXPECT_TRUE(gear(7, 0.8, 1, 0.3).mesh().is_closed());
  EXPECT_FALSE(plate_grid(1, 1, 3, 3).mesh().is_closed());

  MeshArrays hole = icosphere(1);
  hole.triangles.pop_back();
  EXPECT_FALSE(hole.mesh().is_closed());

  MeshArrays twisted = icosphere(1);
  std::swap(twisted.triangles[3][0], twisted.triangles[3][1]);
  EXPECT_FALSE(twisted.mesh().is_closed());

  // Every edge four times, twice each way.
  MeshArrays twice = icosphere(1);
  twice.triangles.insert(twice.triangles.end(), twice.triangles.begin(), twice.triangles.end());
  EXPECT_FALSE(twice.mesh().is_closed());
}

TEST(TriangleMesh, TrianglesThatRepeatAVertexDoNotDecideClosedness) {
  EXPECT_FALSE(needle(1, 5).mesh().is_closed());
  EXPECT_FALSE(point_cloud(5, 1).mesh().is_closed());
  MeshArrays box = box_mesh(Vector3(1, 1, 1));
  box.triangles.push_back({0, 7, 7});
  EXPECT_TRUE(box.mesh().is_closed());
  EXPECT_DOUBLE_EQ(box.mesh().compute_mass_properties(1).mass, 8);
}

TEST(TriangleMesh, BoundsHoldTheVerticesThatAreUsed) {
  MeshArrays mesh = icosphere(2);
  mesh.vertices.emplace_back(100, 100, 100);
  for (const Scalar scale : {1e-200, 1e-4, 1.0, 1e4, 1e57}) {
    const TriangleMesh moved =
        mesh.moved(Matrix3::Identity(), scale * Vector3(1, 0, 0), scale).mesh();
    const AlignedBox box = moved.bounding_box();
    EXPECT_LE(box.max().x(), 2 * scale);
    Scalar largest = 0;
    for (const TriangleIndices& t : moved.triangles()) {
      for (const std::int32_t v : t) {
        const Vector3& p = moved.vertices()[std::size_t(v)];
        EXPECT_TRUE(box.contains(p));
        // 80 bits and their range of exponents: the square is exact enough.
        const Eigen::Matrix<long double, 3, 1> wide = p.cast<long double>();
        const auto radius = static_cast<long double>(moved.bounding_radius());
        EXPECT_LE(wide.squaredNorm(), radius * radius);
        largest = std::max(largest, p.stableNorm());
      }
    }
    EXPECT_LE(moved.bounding_radius(), largest * (1 + 64 * kUnitRoundoff));
  }
}

TEST(TriangleMesh, OfThePointAtTheOriginHasNoExtent) {
  const TriangleMesh mesh({Vector3::Zero()}, {{0, 0, 0}});
  EXPECT_EQ(mesh.bounding_radius(), 0);
  EXPECT_EQ(mesh.bounding_box().sizes(), Vector3::Zero());
}

// Corner of the unit cube, rho = 6: m = 1, centre (1,1,1)/4. E[x^2] = 1/10, E[xy] = 1/20 over the
// tetrahedron, so the central ones are 1/10 - 1/16 = 3/80 and 1/20 - 1/16 = -1/80.
TEST(TriangleMesh, MassOfATetrahedron) {
  const TriangleMesh mesh({Vector3::Zero(), Vector3::UnitX(), Vector3::UnitY(), Vector3::UnitZ()},
                          {{0, 2, 1}, {0, 1, 3}, {1, 2, 3}, {2, 0, 3}});
  const MassProperties properties = mesh.compute_mass_properties(6);
  EXPECT_NEAR(properties.mass, 1, 1e-15);
  EXPECT_LE((properties.p_BoBcm - Vector3::Constant(0.25)).norm(), 1e-15);
  Matrix3 expected = Matrix3::Constant(1.0 / 80);
  expected.diagonal().setConstant(6.0 / 80);
  EXPECT_LE((properties.I_BBcm - expected).norm(), 1e-15);
}

// V = 2 pi^2 R r^2, I_z = m (R^2 + 3/4 r^2), I_x = m (R^2 / 2 + 5/8 r^2). The inscribed polygons
// miss about (2 pi / 200)^2 / 6 + (2 pi / 100)^2 / 6 of the area.
TEST(TriangleMesh, MassOfATorus) {
  const Scalar major = 2;
  const Scalar minor = 0.7;
  const MassProperties properties = torus(major, minor, 200, 100).mesh().compute_mass_properties(3);
  const Scalar mass = 3 * 2 * std::numbers::pi * std::numbers::pi * major * minor * minor;
  EXPECT_NEAR(properties.mass / mass, 1, 0.002);
  EXPECT_LE(properties.p_BoBcm.norm(), 1e-13);
  const Scalar axial = mass * (major * major + 0.75 * minor * minor);
  const Scalar transverse = mass * (major * major / 2 + 0.625 * minor * minor);
  EXPECT_NEAR(properties.I_BBcm(2, 2) / axial, 1, 0.004);
  EXPECT_NEAR(properties.I_BBcm(0, 0) / transverse, 1, 0.004);
  EXPECT_NEAR(properties.I_BBcm(1, 1) / transverse, 1, 0.004);
}

// Moving to 1e6 rounds coordinates by 6e-11, and with them the volume by at most area / volume =
// 2 / 0.7 times sqrt(3) times as much, 3e-10; nothing else may be lost.
TEST(TriangleMesh, MassFarFromTheOriginLosesOnlyTheRoundingOfTheCoordinates) {
  const MeshArrays arrays = torus(2, 0.7, 60, 30);
  const MassProperties expected = arrays.mesh().compute_mass_properties(3);
  const Matrix3 turn = rotation_from_vector(Vector3(0.3, -1.1, 0.6));
  for (const Scalar distance : {0.0, 1.0, 1e3, 1e6}) {
    const Vector3 place = distance * Vector3(1, -1, 0.5);
    const MassProperties found = arrays.moved(turn, place).mesh().compute_mass_properties(3);
    const Scalar loss = 1e-13 + 1e-15 * distance;
    EXPECT_NEAR(found.mass / expected.mass, 1, loss);
    EXPECT_LE((found.p_BoBcm - place).norm(), loss);
    EXPECT_LE((turn * expected.I_BBcm * turn.transpose() - found.I_BBcm).norm(),
              2 * loss * expected.I_BBcm.norm());
  }
}

// Lengths times s: mass times s^3, inertia times s^5.
TEST(TriangleMesh, TakesOtherVerticesAndStaysAsItIs) {
  const MeshArrays sphere = icosphere(2);
  const TriangleMesh mesh = sphere.mesh();
  const MeshArrays moved =
      sphere.moved(rotation_from_vector(Vector3(1, 2, 0)), Vector3(5, 0, 1), 3);
  const TriangleMesh refitted = mesh.with_vertices(moved.vertices);
  const TriangleMesh fresh = moved.mesh();
  EXPECT_TRUE(std::equal(refitted.vertices().begin(), refitted.vertices().end(),
                         moved.vertices.begin(), moved.vertices.end()));
  EXPECT_EQ(refitted.triangles().size(), mesh.triangles().size());
  EXPECT_EQ(refitted.bounding_radius(), fresh.bounding_radius());
  EXPECT_EQ(refitted.bounding_box().min(), fresh.bounding_box().min());
  EXPECT_EQ(refitted.bounding_box().max(), fresh.bounding_box().max());
  EXPECT_TRUE(refitted.is_closed());
  EXPECT_EQ(refitted.compute_mass_properties(2).mass, fresh.compute_mass_properties(2).mass);
  EXPECT_EQ(mesh.vertices()[0], sphere.vertices[0]);
}

TEST(TriangleMesh, TakesOtherVerticesFromStridedRows) {
  const TriangleMesh mesh(kCorners, {{0, 1, 2}});
  const std::vector<float> floats{1, 2, 3, -1, 4, 5, 6, -1, 7, 8, 10, -1};
  const std::vector<double> doubles(floats.begin(), floats.end());
  const TriangleMesh a = mesh.with_vertices(StridedRows<float>{floats.data(), 3, 16});
  const TriangleMesh b = mesh.with_vertices(StridedRows<double>{doubles.data(), 3, 32});
  for (const TriangleMesh& other : {a, b}) {
    EXPECT_EQ(other.vertices()[1], Vector3(4, 5, 6));
    EXPECT_EQ(other.vertices()[2], Vector3(7, 8, 10));
  }
}

TEST(TriangleMesh, RefusesOtherVerticesThatDoNotFit) {
  const TriangleMesh mesh(kCorners, {{0, 1, 2}});
  EXPECT_MESSAGE(mesh.with_vertices(std::vector<Vector3>(2, Vector3::Zero())),
                 "the mesh has 3 vertices, but got 2");
  EXPECT_MESSAGE(mesh.with_vertices({Vector3::Zero(), Vector3(0, kInfinity, 0), Vector3::Zero()}),
                 "vertex 1 is not finite: (0, inf, 0)");
  EXPECT_MESSAGE(mesh.with_vertices({Vector3::Zero(), Vector3::Zero(), Vector3(1e61, 0, 0)}),
                 "vertex 2 is beyond");
  EXPECT_MESSAGE(mesh.with_vertices(StridedRows<double>{nullptr, 3}), "vertices: null data");
  const double row[3] = {0, 0, 0};
  EXPECT_MESSAGE(mesh.with_vertices(StridedRows<double>{row, 3, 8}), "stride of 8 bytes");
}

TEST(TriangleMesh, MassScales) {
  const MeshArrays arrays = gear(11, 0.8, 1, 0.2);
  const MassProperties expected = arrays.mesh().compute_mass_properties(1);
  for (const Scalar s : {1e-4, 1e4}) {
    const MassProperties found =
        arrays.moved(Matrix3::Identity(), Vector3::Zero(), s).mesh().compute_mass_properties(1);
    EXPECT_NEAR(found.mass / (s * s * s) / expected.mass, 1, 1e-13);
    EXPECT_LE((found.I_BBcm / std::pow(s, 5) - expected.I_BBcm).norm(), 1e-13);
  }
}

TEST(TriangleMesh, RefusesMassWithoutAnInside) {
  EXPECT_MESSAGE(plate_grid(1, 1, 2, 2).mesh().compute_mass_properties(1), "is not closed");

  MeshArrays inverted = box_mesh(Vector3(1, 1, 1));
  for (TriangleIndices& t : inverted.triangles) std::swap(t[1], t[2]);
  EXPECT_MESSAGE(inverted.mesh().compute_mass_properties(1), "not -8");

  // Both sides of a triangle: closed, but the volume is nothing but rounding, wherever it lies.
  const TriangleMesh sheet({Vector3(0.1, 0.2, 0.3), Vector3(1.7, 0.4, 0.9), Vector3(0.6, 1.3, 2.1)},
                           {{0, 1, 2}, {0, 2, 1}});
  ASSERT_TRUE(sheet.is_closed());
  EXPECT_MESSAGE(sheet.compute_mass_properties(1), "signed volume must be > 0");
  EXPECT_MESSAGE(icosphere(0).mesh().compute_mass_properties(-2), "density must be finite and > 0");
}

// Hollow ball: m = 4 pi r^2 sigma, I = 2/3 m r^2.
TEST(TriangleMesh, ShellMassOfABall) {
  const MassProperties properties = icosphere(5, 2).mesh().compute_shell_mass_properties(3);
  const Scalar mass = 3 * 16 * std::numbers::pi;
  EXPECT_NEAR(properties.mass / mass, 1, 0.001);
  EXPECT_NEAR(properties.I_BBcm(1, 1) / (2.0 / 3 * mass * 4), 1, 0.002);
}

// Rectangle a x b: m = a b sigma, I_x = m b^2 / 12, I_y = m a^2 / 12, I_z their sum.
TEST(TriangleMesh, ShellMassOfAPlateFarFromTheOrigin) {
  const Vector3 place(1024, -4096, 512);
  MeshArrays plate = plate_grid(2, 4, 8, 4).moved(Matrix3::Identity(), place);
  plate.triangles.push_back({0, 1, 1});
  const MassProperties properties = plate.mesh().compute_shell_mass_properties(0.5);
  EXPECT_NEAR(properties.mass, 4, 1e-13);
  EXPECT_LE((properties.p_BoBcm - place).norm(), 1e-12);
  const Matrix3 expected = Vector3(16, 4, 20).asDiagonal().toDenseMatrix() / 3;
  EXPECT_LE((properties.I_BBcm - expected).norm(), 1e-12);
}

// A wire bent to a rectangle a x b: sides of length a at b / 2 from the centre, and the reverse.
TEST(TriangleMesh, ShellMassOfAWire) {
  const Scalar a = 2, b = 4, density = 0.5;
  const Vector3 place(1024, -4096, 512);
  std::vector<Vector3> corners;
  for (const auto& [x, y] : {std::pair(-1, -2), {1, -2}, {1, 2}, {-1, 2}}) {
    corners.push_back(place + Vector3(x, y, 0));
  }
  // The last side is a triangle with its third corner on it; a point has no mass.
  corners.push_back(place + Vector3(-1, 0, 0));
  const TriangleMesh wire(corners, {{0, 1, 1}, {1, 1, 2}, {3, 2, 3}, {3, 4, 0}, {2, 2, 2}});
  const MassProperties properties = wire.compute_shell_mass_properties(density);
  const Scalar m_a = density * a, m_b = density * b;
  EXPECT_NEAR(properties.mass, 2 * (m_a + m_b), 1e-12);
  EXPECT_LE((properties.p_BoBcm - place).norm(), 1e-12);
  const Scalar I_x = 2 * (m_a * b * b / 4 + m_b * b * b / 12);
  const Scalar I_y = 2 * (m_b * a * a / 4 + m_a * a * a / 12);
  const Matrix3 expected = Vector3(I_x, I_y, I_x + I_y).asDiagonal();
  EXPECT_LE((properties.I_BBcm - expected).norm(), 1e-11);
}

// A straight one turns about itself like a rod with a radius of a 200th of its length.
TEST(TriangleMesh, ShellMassOfAStraightWireAndOfPoints) {
  const Vector3 along = Vector3(1, 2, 2) / 3;
  const TriangleMesh rod({Vector3(5, 0, 0), 5 * Vector3::UnitX() + 6 * along}, {{0, 1, 0}});
  const MassProperties properties = rod.compute_shell_mass_properties(2);
  const Scalar about = 12 * 0.03 * 0.03 / 2;
  const Matrix3 expected = 12 * 36.0 / 12 * (Matrix3::Identity() - along * along.transpose()) +
                           about * along * along.transpose();
  EXPECT_NEAR(properties.mass, 12, 1e-12);
  EXPECT_LE((properties.I_BBcm - expected).norm(), 1e-11);
  const TriangleMesh cloud({{0, 0, 0}, {2, 0, 0}, {2, 2, 0}, {0, 2, 0}},
                           {{0, 0, 0}, {1, 1, 1}, {2, 2, 2}, {3, 3, 3}});
  const MassProperties points = cloud.compute_shell_mass_properties(3);
  EXPECT_EQ(points.mass, 12);
  EXPECT_EQ(points.p_BoBcm, Vector3(1, 1, 0));
  EXPECT_LE((points.I_BBcm - Matrix3(Vector3(12, 12, 24).asDiagonal())).norm(), 1e-12);
}

TEST(TriangleMesh, RefusesAShellWithoutExtent) {
  EXPECT_MESSAGE(needle(0, 3).mesh().compute_shell_mass_properties(1),
                 "a point has no inertia; give it a radius: Sphere");
  EXPECT_MESSAGE(icosphere(0).mesh().compute_shell_mass_properties(0),
                 "density must be finite and > 0, not 0");
}

TEST(TriangleMesh, MovedFromIsAnErrorToUseAndSafeToAssign) {
  const TriangleMesh whole = box_mesh({1, 1, 1}).mesh();
  TriangleMesh from = whole;
  const TriangleMesh to = std::move(from);
  EXPECT_EQ(to.triangles().size(), 12u);
  const std::string refusal = "this TriangleMesh was moved from and holds no triangles";
  EXPECT_EQ(message_of([&] { static_cast<void>(from.vertices()); }), refusal);
  EXPECT_EQ(message_of([&] { static_cast<void>(from.triangles()); }), refusal);
  EXPECT_EQ(message_of([&] { static_cast<void>(from.triangle(0)); }), refusal);
  EXPECT_EQ(message_of([&] { static_cast<void>(from.hierarchy()); }), refusal);
  EXPECT_EQ(message_of([&] { static_cast<void>(from.is_closed()); }), refusal);
  EXPECT_EQ(message_of([&] { static_cast<void>(from.part_vertices()); }), refusal);
  EXPECT_EQ(message_of([&] { static_cast<void>(from.bounding_box()); }), refusal);
  EXPECT_EQ(message_of([&] { static_cast<void>(from.bounding_radius()); }), refusal);
  EXPECT_EQ(message_of([&] { static_cast<void>(from.with_vertices(kCorners)); }), refusal);
  EXPECT_EQ(message_of([&] { static_cast<void>(from.compute_mass_properties(1)); }), refusal);
  EXPECT_EQ(message_of([&] { static_cast<void>(from.compute_shell_mass_properties(1)); }), refusal);
  from = to;
  EXPECT_EQ(from.triangles().size(), 12u);
}

}  // namespace
}  // namespace dyop
