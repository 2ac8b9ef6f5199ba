// SPDX-License-Identifier: BSD-3-Clause
#include "dyop/adapters/tesseract_contact_manager.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "adapters/pose_at.h"
#include "dyop/distance/distance.h"
#include "support/message_of.h"

namespace dyop {
namespace {

using adapters::TesseractContactManager;
using tesseract_collision::ContactRequest;
using tesseract_collision::ContactResult;
using tesseract_collision::ContactResultMap;
using tesseract_collision::ContactTestType;
using tesseract_collision::ContinuousCollisionType;
using testing::at;
using testing::kNaN;
using testing::message_of;
using Geometry = std::shared_ptr<const tesseract_geometry::Geometry>;

template <typename Kind>
Geometry make(double a, double b, double c) {
  return std::make_shared<Kind>(a, b, c);
}
Geometry box_geometry(double x, double y, double z) {
  return make<tesseract_geometry::Box>(x, y, z);
}
Geometry sphere_geometry(double r) {
  return std::make_shared<tesseract_geometry::Sphere>(r);
}

/// A wall of a tenth of a millimetre at x = 0 and a ball of radius 0.1 that moves.
TesseractContactManager& with_wall_and_ball(TesseractContactManager& manager) {
  EXPECT_TRUE(manager.addCollisionObject("wall", 7, {box_geometry(1e-4, 1, 1)}, {at(0, 0, 0)}));
  EXPECT_TRUE(manager.addCollisionObject("ball", 8, {sphere_geometry(0.1)}, {at(0, 0, 0)}));
  manager.setActiveCollisionObjects({"ball"});
  return manager;
}

ContactResultMap test(TesseractContactManager& manager, const ContactRequest& request = {}) {
  ContactResultMap found;
  manager.contactTest(found, request);
  return found;
}

TEST(TesseractContactManager, FindsAThinWallBetweenTwoFreePoses) {
  TesseractContactManager manager;
  with_wall_and_ball(manager);
  manager.setCollisionObjectsTransform("ball", at(-1, 0, 0));
  EXPECT_TRUE(test(manager).empty());
  manager.setCollisionObjectsTransform("ball", at(1, 0, 0));
  EXPECT_TRUE(test(manager).empty());
  manager.setCollisionObjectsTransform("ball", at(-1, 0, 0), at(1, 0, 0));
  const ContactResultMap found = test(manager, ContactTestType::CLOSEST);
  ASSERT_EQ(found.count(), 1);
  const ContactResult& contact = found.at({"ball", "wall"}).front();
  EXPECT_EQ(contact.link_names[0], "ball");
  EXPECT_EQ(contact.link_names[1], "wall");
  EXPECT_EQ(contact.type_id, (std::array<int, 2>{8, 7}));
  EXPECT_EQ(contact.shape_id, (std::array<int, 2>{0, 0}));
  EXPECT_NEAR(contact.cc_time[0], (1 - 0.1 - 5e-5) / 2, 1e-5);
  EXPECT_LE(contact.cc_time[0], (1 - 0.1 - 5e-5) / 2);
  EXPECT_EQ(contact.cc_type[0], ContinuousCollisionType::CCType_Between);
  EXPECT_EQ(contact.cc_time[1], -1);
  EXPECT_EQ(contact.cc_type[1], ContinuousCollisionType::CCType_None);
  EXPECT_TRUE(contact.normal.isApprox(Vector3::UnitX(), 1e-9));
  EXPECT_NEAR(contact.distance, 0, 1e-5);
  EXPECT_TRUE(contact.nearest_points_local[0].isApprox(Vector3(0.1, 0, 0), 1e-4));
  EXPECT_TRUE(contact.transform[0].isApprox(at(-1, 0, 0)));
  EXPECT_TRUE(contact.cc_transform[0].isApprox(at(1, 0, 0)));
}

TEST(TesseractContactManager, TellsContactsAtTheStartFromOthers) {
  TesseractContactManager manager;
  with_wall_and_ball(manager);
  manager.setCollisionObjectsTransform("ball", at(0.02, 0, 0), at(1, 0, 0));
  const ContactResultMap found = test(manager, ContactTestType::FIRST);
  const ContactResult& contact = found.at({"ball", "wall"}).front();
  EXPECT_EQ(contact.cc_time[0], 0);
  EXPECT_EQ(contact.cc_type[0], ContinuousCollisionType::CCType_Time0);
  EXPECT_NEAR(contact.distance, -(0.1 - 0.02 + 5e-5), 1e-4);
  ContactRequest shallow(ContactTestType::FIRST);
  shallow.calculate_penetration = false;
  EXPECT_EQ(test(manager, shallow).at({"ball", "wall"}).front().distance, 0);
}

TEST(TesseractContactManager, KeepsMargins) {
  TesseractContactManager manager;
  with_wall_and_ball(manager);
  // Passes the wall's rim at y = 0.5 at a distance of 0.2.
  manager.setCollisionObjectsTransform("ball", at(-1, 0.8, 0), at(1, 0.8, 0));
  EXPECT_TRUE(test(manager).empty());
  manager.setDefaultCollisionMargin(0.19);
  EXPECT_TRUE(test(manager).empty());
  manager.setDefaultCollisionMargin(0.21);
  const ContactResultMap found = test(manager, ContactTestType::CLOSEST);
  ASSERT_EQ(found.count(), 1);
  EXPECT_LE(found.at({"ball", "wall"}).front().distance, 0.21);
  EXPECT_NEAR(found.at({"ball", "wall"}).front().distance, 0.21, 1e-6);
  manager.setCollisionMarginPair("wall", "ball", 0.1);
  EXPECT_TRUE(test(manager).empty());
  manager.incrementCollisionMargin(0.2);
  EXPECT_FALSE(test(manager).empty());
  manager.setCollisionMarginPairData({});
  manager.setDefaultCollisionMargin(-0.05);
  EXPECT_TRUE(test(manager).empty());
  manager.setCollisionObjectsTransform("ball", at(-1, 0, 0), at(1, 0, 0));
  EXPECT_FALSE(test(manager).empty());
}

struct Allows : tesseract_common::ContactAllowedValidator {
  bool operator()(const std::string& a, const std::string& b) const override {
    return (a == "ball" && b == "wall") || (a == "wall" && b == "ball");
  }
};

TEST(TesseractContactManager, LeavesOutWhatIsAllowedDisabledOrStatic) {
  TesseractContactManager manager;
  with_wall_and_ball(manager);
  manager.setCollisionObjectsTransform("ball", at(-1, 0, 0), at(1, 0, 0));
  EXPECT_FALSE(test(manager).empty());
  manager.setContactAllowedValidator(std::make_shared<Allows>());
  EXPECT_TRUE(test(manager).empty());
  EXPECT_TRUE(test(*dynamic_cast<TesseractContactManager*>(manager.clone().get())).empty());
  manager.setContactAllowedValidator(nullptr);
  EXPECT_TRUE(manager.disableCollisionObject("wall"));
  EXPECT_FALSE(manager.isCollisionObjectEnabled("wall"));
  EXPECT_TRUE(test(manager).empty());
  EXPECT_TRUE(manager.enableCollisionObject("wall"));
  EXPECT_FALSE(test(manager).empty());
  manager.addCollisionObject("other wall", 0, {box_geometry(1e-4, 1, 1)}, {at(0, 0, 0)});
  EXPECT_EQ(test(manager, ContactTestType::CLOSEST).count(), 2);  // not one wall against the other
  manager.setActiveCollisionObjects({});
  EXPECT_EQ(test(manager, ContactTestType::CLOSEST).count(), 3);
  EXPECT_TRUE(manager.removeCollisionObject("wall"));
  EXPECT_FALSE(manager.removeCollisionObject("wall"));
  EXPECT_EQ(manager.getCollisionObjects(), (std::vector<std::string>{"ball", "other wall"}));
  ContactRequest picky;
  picky.is_valid = [](const ContactResult& contact) { return contact.link_names[0] != "ball"; };
  EXPECT_TRUE(test(manager, picky).empty());
}

TEST(TesseractContactManager, ACloneIsIndependent) {
  TesseractContactManager manager("name");
  with_wall_and_ball(manager);
  manager.setDefaultCollisionMargin(0.01);
  manager.setCollisionObjectsTransform("ball", at(-1, 0, 0), at(1, 0, 0));
  const auto clone = manager.clone();
  EXPECT_EQ(clone->getName(), "name");
  EXPECT_EQ(clone->getActiveCollisionObjects(), std::vector<std::string>{"ball"});
  EXPECT_EQ(clone->getCollisionMarginData().getDefaultCollisionMargin(), 0.01);
  manager.removeCollisionObject("wall");
  EXPECT_TRUE(test(manager).empty());
  ContactResultMap found;
  clone->contactTest(found, {});
  EXPECT_FALSE(found.empty());
  EXPECT_EQ(clone->getCollisionObjectGeometries("wall").size(), 1U);
  EXPECT_TRUE(clone->getCollisionObjectGeometriesTransforms("nothing").empty());
}

// Along the arc that Tesseract's interpolation takes, and with distances from dyop::distance.
TEST(TesseractContactManager, IsFreeUntilTheFirstContact) {
  std::mt19937_64 random(9);
  std::uniform_real_distribution<double> number(-1, 1);
  const auto pose = [&](double size) {
    Eigen::Isometry3d X = at(size * number(random), size * number(random), size * number(random));
    X.linear() = rotation_from_vector(2 * Vector3(number(random), number(random), number(random)));
    return X;
  };
  int hits = 0;
  for (int run = 0; run < 60; ++run) {
    SCOPED_TRACE(run);
    TesseractContactManager manager;
    const Eigen::Isometry3d offset = pose(0.3);
    manager.addCollisionObject("a", 0, {box_geometry(0.6, 0.1, 0.1), sphere_geometry(0.1)},
                               {at(0.3, 0, 0), offset});
    manager.addCollisionObject("b", 0, {make<tesseract_geometry::Box>(0.2, 0.5, 0.3)},
                               {at(0, 0.1, 0)});
    const Eigen::Isometry3d a0 = pose(0.7);
    const Eigen::Isometry3d a1 = pose(0.7);
    const Eigen::Isometry3d b0 = pose(0.7);
    const Eigen::Isometry3d b1 = pose(0.7);
    manager.setCollisionObjectsTransform("a", a0, a1);
    manager.setCollisionObjectsTransform(tesseract_common::TransformMap{{"b", b0}},
                                         tesseract_common::TransformMap{{"b", b1}});
    const double margin = 0.03;
    manager.setDefaultCollisionMargin(margin);
    const ContactResultMap found = test(manager, ContactTestType::CLOSEST);
    double first = 1;
    if (!found.empty()) {
      ++hits;
      first = found.at({"a", "b"}).front().cc_time[0];
      EXPECT_EQ(first, found.at({"a", "b"}).front().cc_time[1]);
    }
    const auto between = [](const Eigen::Isometry3d& X, const Eigen::Isometry3d& Y, double t) {
      return RigidPose(Quaternion(X.linear()).slerp(t, Quaternion(Y.linear())),
                       (1 - t) * X.translation() + t * Y.translation());
    };
    for (int k = 0; k <= 200; ++k) {
      const double t = first * k / 200 - 1e-6;
      if (t < 0) continue;
      const RigidPose X_WA = between(a0, a1, t);
      const RigidPose X_WB = between(b0, b1, t) * RigidPose(Vector3(0, 0.1, 0));
      const Box b(Vector3(0.1, 0.25, 0.15));
      const double gap = std::min(
          distance(Box(Vector3(0.3, 0.05, 0.05)), X_WA * RigidPose(Vector3(0.3, 0, 0)), b, X_WB)
              .upper,
          distance(Sphere(0.1), X_WA * adapters::pose_of(offset), b, X_WB).upper);
      EXPECT_GT(gap, margin) << t;
    }
    if (!found.empty() && first > 0) {
      const ContactResult& contact = found.at({"a", "b"}).front();
      EXPECT_NEAR((contact.nearest_points[0] - contact.nearest_points[1]).norm(), margin, 1e-5);
      EXPECT_TRUE((between(a0, a1, first) * contact.nearest_points_local[0])
                      .isApprox(contact.nearest_points[0], 1e-9));
    }
  }
  EXPECT_GT(hits, 10);
  EXPECT_LT(hits, 55);
}

TEST(TesseractContactManager, AnswersEveryTypeOfTest) {
  TesseractContactManager manager;
  manager.addCollisionObject("cube", 0, {box_geometry(0.2, 0.2, 0.2)}, {at(0, 0, 0)});
  manager.addCollisionObject("floor", 0, {box_geometry(4, 4, 0.1), box_geometry(4, 4, 0.1)},
                             {at(0, 0, -0.05), at(0, 0, -0.06)});
  manager.addCollisionObject("wall", 0, {box_geometry(0.1, 4, 4)}, {at(0.5, 0, 0)});
  manager.setActiveCollisionObjects({"cube"});
  manager.setCollisionObjectsTransform({"cube"}, {at(0, 0, 0.5)}, {at(1, 0, -0.5)});
  EXPECT_EQ(test(manager, ContactTestType::FIRST).count(), 1);
  EXPECT_EQ(test(manager, ContactTestType::CLOSEST).count(), 2);
  EXPECT_EQ(test(manager, ContactTestType::CLOSEST).at({"cube", "floor"}).front().shape_id[1], 0);
  const ContactResultMap all = test(manager, ContactTestType::ALL);
  EXPECT_GE(all.at({"cube", "floor"}).size(), 8U);  // four corners on two slabs
  ContactRequest limited(ContactTestType::LIMITED);
  limited.contact_limit = 3;
  EXPECT_EQ(test(manager, limited).count(), 3);
}

TEST(TesseractContactManager, TakesEveryKindOfGeometry) {
  const auto vertices = std::make_shared<tesseract_common::VectorVector3d>(
      tesseract_common::VectorVector3d{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}});
  auto faces = std::make_shared<Eigen::VectorXi>(16);
  *faces << 3, 0, 2, 1, 3, 0, 1, 3, 3, 0, 3, 2, 3, 1, 2, 3;
  auto tree = std::make_shared<octomap::OcTree>(0.5);
  tree->updateNode(octomap::point3d(0.25F, 0.25F, 0.25F), true);
  const auto mesh = std::make_shared<tesseract_geometry::Mesh>(vertices, faces);
  const auto hull = std::make_shared<tesseract_geometry::ConvexMesh>(vertices, faces);
  using tesseract_geometry::OctreeSubType;
  const auto octree = [&](OctreeSubType type) {
    return std::make_shared<tesseract_geometry::Octree>(tree, type);
  };
  // Distances of a ball of radius 0.5 about (3, 0, 0).
  const std::vector<std::pair<Geometry, double>> kinds{
      {sphere_geometry(1), 1.5},
      {box_geometry(2, 2, 2), 1.5},
      {std::make_shared<tesseract_geometry::Cylinder>(1, 2), 1.5},
      {std::make_shared<tesseract_geometry::Capsule>(1, 2), 1.5},
      {std::make_shared<tesseract_geometry::Cone>(1, 2), std::hypot(2, 1) - 0.5},  // to the rim
      {std::make_shared<tesseract_geometry::Plane>(2, 0, 0, -2), 1.5},
      {mesh, 1.5},
      {hull, 1.5},
      {std::make_shared<tesseract_geometry::CompoundMesh>(
           std::vector<std::shared_ptr<tesseract_geometry::PolygonMesh>>{mesh, hull}),
       1.5},
      {octree(OctreeSubType::BOX), 2},
      {octree(OctreeSubType::SPHERE_INSIDE), Vector3(2.75, 0.25, 0.25).norm() - 0.75},
      {octree(OctreeSubType::SPHERE_OUTSIDE),
       Vector3(2.75, 0.25, 0.25).norm() - 0.5 - std::sqrt(3.0) / 4}};
  const Sphere probe(0.5);
  for (const auto& [geometry, expected] : kinds) {
    const std::shared_ptr<const Shape> shape = adapters::tesseract_shape(*geometry);
    const double found = distance(probe, RigidPose(Vector3(3, 0, 0)), *shape, RigidPose()).lower;
    EXPECT_NEAR(found, expected, 1e-9) << int(geometry->getType());
  }
  const auto empty = std::make_shared<octomap::OcTree>(0.5);
  EXPECT_EQ(adapters::tesseract_shape(tesseract_geometry::Octree(empty, OctreeSubType::BOX)),
            nullptr);
}

// So far from the origin numbers are too coarse for the tolerance.
TEST(TesseractContactManager, ReportsWhatItCannotDecide) {
  TesseractContactManager manager;
  with_wall_and_ball(manager);
  const double far = 1e10;
  manager.setCollisionObjectsTransform("wall", at(far, 0, 0));
  manager.setCollisionObjectsTransform("ball", at(far - 1, 0, 0), at(far + 1, 0, 0));
  console_bridge::stub::errors().clear();
  EXPECT_EQ(test(manager, ContactTestType::FIRST).count(), 1);
  ASSERT_EQ(console_bridge::stub::errors().size(), 1U);
  EXPECT_NE(console_bridge::stub::errors().front().find("\"wall\""), std::string::npos);
}

TEST(TesseractContactManager, RefusesWhatItCannotUse) {
  const auto vertices = std::make_shared<tesseract_common::VectorVector3d>(4, Vector3::Zero());
  auto square = std::make_shared<Eigen::VectorXi>(5);
  *square << 4, 0, 1, 2, 3;
  const std::vector<std::pair<Geometry, Eigen::Isometry3d>> rubbish{
      {std::make_shared<tesseract_geometry::PolygonMesh>(vertices, square), at(9, 9, 9)},
      {std::make_shared<tesseract_geometry::Mesh>(vertices, square), at(9, 9, 9)},
      {sphere_geometry(kNaN), at(9, 9, 9)},
      {sphere_geometry(-1), at(9, 9, 9)},
      {nullptr, at(9, 9, 9)},
      {sphere_geometry(1), at(kNaN, 9, 9)}};
  for (const auto& [geometry, pose] : rubbish) {
    TesseractContactManager manager;
    with_wall_and_ball(manager);
    console_bridge::stub::errors().clear();
    EXPECT_FALSE(manager.addCollisionObject("thing", 0, {geometry}, {pose}));
    EXPECT_FALSE(manager.hasCollisionObject("thing"));
    const std::vector<std::string>& errors = console_bridge::stub::errors();
    ASSERT_EQ(errors.size(), 1U);
    EXPECT_NE(errors.front().find("\"thing\""), std::string::npos);
    EXPECT_NE(message_of([&] { test(manager); }).find("\"thing\""), std::string::npos);
    const auto clone = manager.clone();
    ContactResultMap found;
    EXPECT_THROW(clone->contactTest(found, {}), InvalidArgument);
    manager.removeCollisionObject("thing");
    EXPECT_NO_THROW(test(manager));
  }
  TesseractContactManager manager;
  with_wall_and_ball(manager);
  EXPECT_FALSE(manager.addCollisionObject("frame", 0, {}, {}));
  EXPECT_NO_THROW(test(manager));
  EXPECT_NE(message_of([&] {
              manager.setCollisionObjectsTransform("ball", at(0, 0, 0), at(0, kNaN, 0));
            }).find("\"ball\""),
            std::string::npos);
  EXPECT_NE(message_of([&] {
              manager.setCollisionObjectsTransform(
                  tesseract_common::TransformMap{{"ball", at(0, 0, 0)}},
                  tesseract_common::TransformMap{});
            }).find("\"ball\""),
            std::string::npos);
  EXPECT_THROW(manager.setCollisionObjectsTransform({"ball"}, {at(0, 0, 0)}, {}), InvalidArgument);
  EXPECT_NO_THROW(manager.setCollisionObjectsTransform("unknown", at(0, 0, 0)));
  manager.setDefaultCollisionMargin(kNaN);
  EXPECT_NE(message_of([&] { test(manager); }).find("\"ball\""), std::string::npos);
}

}  // namespace
}  // namespace dyop
