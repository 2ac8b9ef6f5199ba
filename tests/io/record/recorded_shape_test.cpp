// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include "dyop/geometry/compound_shape.h"
#include "dyop/geometry/convex_hull.h"
#include "dyop/geometry/primitives.h"
#include "io/record/recording_rows.h"
#include "motion/random_values.h"
#include "support/inputs/mesh_generators.h"
#include "support/message_of.h"
#include "support/same_bits.h"

namespace dyop {
namespace {

using io_internal::Json;
using io_internal::ShapeRows;
using io_internal::ShapeWriter;
using ShapePointer = std::shared_ptr<const Shape>;

std::vector<Vector3> some_points(unsigned seed) {
  testing::Random random(seed);
  std::vector<Vector3> points;
  for (int k = 0; k < 30; ++k) points.push_back(Vector3(1e3, 0, 0) + random.in_ball(1.0 / 3));
  return points;
}

std::vector<ShapePointer> all_shapes() {
  testing::Random random(1);
  const auto mesh = std::make_shared<TriangleMesh>(
      some_points(2), std::vector<TriangleIndices>{{0, 1, 2}, {3, 4, 5}, {7, 6, 1}});
  const auto hull = std::make_shared<ConvexHull>(some_points(3));
  const auto box = std::make_shared<Box>(Vector3(0.1, 1.0 / 3, 7e5));
  const auto sphere = std::make_shared<Sphere>(1e-4 / 3);
  const auto capsule = std::make_shared<Capsule>(0.1, 0.7);
  const auto compound = std::make_shared<CompoundShape>(std::vector<CompoundChild>{
      {mesh, random.pose(3)}, {box, random.pose(2)}, {std::make_shared<Sphere>(2), RigidPose()}});
  return {mesh, hull, box, sphere, capsule, compound};
}

std::vector<ShapePointer> read_back(const std::string& lines, const ShapeRows& rows) {
  std::vector<ShapePointer> shapes;
  for (std::size_t begin = 0; begin < lines.size();) {
    const std::size_t end = lines.find('\n', begin);
    shapes.push_back(
        io_internal::shape_from(Json::parse(lines.substr(begin, end - begin)), rows, shapes));
    begin = end + 1;
  }
  return shapes;
}

TEST(RecordedShape, ReadsBackWithEveryBit) {
  ShapeWriter writer;
  std::string lines;
  ShapeRows rows;
  std::vector<std::size_t> numbers;
  for (const ShapePointer& shape : all_shapes()) numbers.push_back(writer.add(shape, lines, rows));
  const std::vector<ShapePointer> read = read_back(lines, rows);
  ASSERT_EQ(read.size(), 7u);  // with the sphere of the compound
  const std::vector<ShapePointer> expected = all_shapes();
  for (std::size_t k = 0; k < expected.size(); ++k) {
    // The hash is that of every number in the shape.
    EXPECT_EQ(io_internal::content_hash(*read[numbers[k]]), io_internal::content_hash(*expected[k]))
        << k;
    EXPECT_EQ(read[numbers[k]]->kind(), expected[k]->kind());
    EXPECT_EQ(read[numbers[k]]->bounding_radius(), expected[k]->bounding_radius());
  }
  const auto& mesh = dynamic_cast<const TriangleMesh&>(*read[numbers[0]]);
  const auto& expected_mesh = dynamic_cast<const TriangleMesh&>(*expected[0]);
  ASSERT_EQ(mesh.vertices().size(), expected_mesh.vertices().size());
  for (std::size_t k = 0; k < mesh.vertices().size(); ++k) {
    EXPECT_TRUE(testing::has_same_bits(mesh.vertices()[k], expected_mesh.vertices()[k]));
  }
}

TEST(RecordedShape, IsStoredOnce) {
  ShapeWriter writer;
  std::string lines;
  ShapeRows rows;
  const std::vector<ShapePointer> first = all_shapes();
  const std::vector<ShapePointer> again = all_shapes();
  for (std::size_t k = 0; k < first.size(); ++k) {
    const std::size_t number = writer.add(first[k], lines, rows);
    const std::size_t bytes = lines.size();
    EXPECT_EQ(writer.add(first[k], lines, rows), number);
    EXPECT_EQ(writer.add(again[k], lines, rows), number);
    EXPECT_EQ(lines.size(), bytes);
  }
}

TEST(RecordedShape, HasAHashOfItsContent) {
  std::vector<std::uint64_t> hashes;
  for (const ShapePointer& shape : all_shapes())
    hashes.push_back(io_internal::content_hash(*shape));
  hashes.push_back(io_internal::content_hash(Box(Vector3(0.1, 1.0 / 3, 7e5 + 1e-9))));
  std::sort(hashes.begin(), hashes.end());
  EXPECT_EQ(std::adjacent_find(hashes.begin(), hashes.end()), hashes.end());
  // The hash of "sphere" and the numbers 1, 0, 0, by hand with another program.
  EXPECT_EQ(io_internal::content_hash(Sphere(1)), 0xb03e484dce51e445u);
}

TEST(RecordedShape, ThatIsUnknownIsRefused) {
  ShapeRows rows;
  const auto message = [&](const char* line) {
    return testing::message_of([&] { io_internal::shape_from(Json::parse(line), rows, {}); });
  };
  EXPECT_EQ(message(R"({"kind":"torus"})"), "unknown kind of shape torus");
  EXPECT_NE(message(R"({"kind":"mesh","first_vertex":0,"vertex_count":3,"first_triangle":0,
                        "triangle_count":1})")
                .find("missing"),
            std::string::npos);
  EXPECT_NE(message(R"({"kind":"compound","children":[{"shape":4,"X_CS":[]}]})").find("after it"),
            std::string::npos);
}

}  // namespace
}  // namespace dyop
