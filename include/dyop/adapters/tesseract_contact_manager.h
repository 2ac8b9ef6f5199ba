// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <console_bridge/console.h>
#include <octomap/octomap.h>
#include <tesseract_collision/core/continuous_contact_manager.h>
#include <tesseract_collision/core/types.h>
#include <tesseract_common/contact_allowed_validator.h>
#include <tesseract_geometry/geometries.h>

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <exception>
#include <iterator>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "dyop/adapters/host_geometry.h"
#include "dyop/distance/distance.h"
#include "dyop/geometry/convex_hull.h"
#include "dyop/motion/composed_motion.h"
#include "dyop/motion/interpolated_motion.h"
#include "dyop/motion/steady_motions.h"
#include "dyop/toi/time_of_impact.h"

namespace dyop::adapters_internal {

// Faces are "3 a b c" one after another.
inline std::shared_ptr<const Shape> tesseract_mesh(const tesseract_geometry::PolygonMesh& mesh) {
  DYOP_REQUIRE(mesh.getFaces() != nullptr && mesh.getVertices() != nullptr,
               "the mesh has no faces or no vertices");
  const Eigen::VectorXi& faces = *mesh.getFaces();
  std::vector<TriangleIndices> triangles;
  for (Eigen::Index k = 0; k < faces.size(); k += 4) {
    DYOP_REQUIRE(faces[k] == 3 && k + 3 < faces.size(), "a face has ", faces[k], " corners, not 3");
    triangles.push_back({faces[k + 1], faces[k + 2], faces[k + 3]});
  }
  return std::make_shared<TriangleMesh>(
      std::vector<Vector3>(mesh.getVertices()->begin(), mesh.getVertices()->end()),
      std::move(triangles));
}

inline std::shared_ptr<const Shape> tesseract_hull(const tesseract_geometry::PolygonMesh& mesh) {
  DYOP_REQUIRE(mesh.getVertices() != nullptr, "the mesh has no vertices");
  return std::make_shared<ConvexHull>(
      std::vector<Vector3>(mesh.getVertices()->begin(), mesh.getVertices()->end()));
}

inline adapters::LeafShape leaf_shape_of(tesseract_geometry::OctreeSubType type) {
  using adapters::LeafShape;
  switch (type) {
    case tesseract_geometry::OctreeSubType::SPHERE_INSIDE:
      return LeafShape::InnerSphere;
    case tesseract_geometry::OctreeSubType::SPHERE_OUTSIDE:
      return LeafShape::OuterSphere;
    default:
      return LeafShape::Cube;
  }
}

}  // namespace dyop::adapters_internal

namespace dyop::adapters {

/// A geometry of Tesseract as one of dyop's. A convex mesh is its hull; other meshes are their
/// triangles, which are a solid if they are closed; behind a plane all is solid. Null for an octree
/// with nothing in it.
/// @throws InvalidArgument if the geometry is of a kind without a shape (a polygon mesh), empty, or
///         has a size of zero, of less or NaN.
inline std::shared_ptr<const Shape> tesseract_shape(const tesseract_geometry::Geometry& geometry) {
  using tesseract_geometry::GeometryType;
  switch (geometry.getType()) {
    case GeometryType::SPHERE:
      return std::make_shared<Sphere>(
          static_cast<const tesseract_geometry::Sphere&>(geometry).getRadius());
    case GeometryType::CYLINDER: {
      const auto& cylinder = static_cast<const tesseract_geometry::Cylinder&>(geometry);
      return std::make_shared<Cylinder>(cylinder.getRadius(), cylinder.getLength() / 2);
    }
    case GeometryType::CAPSULE: {
      const auto& capsule = static_cast<const tesseract_geometry::Capsule&>(geometry);
      return std::make_shared<Capsule>(capsule.getRadius(), capsule.getLength() / 2);
    }
    case GeometryType::CONE: {
      const auto& cone = static_cast<const tesseract_geometry::Cone&>(geometry);
      return std::make_shared<Cone>(cone.getRadius(), cone.getLength() / 2);
    }
    case GeometryType::BOX: {
      const auto& box = static_cast<const tesseract_geometry::Box&>(geometry);
      return std::make_shared<Box>(Vector3(box.getX(), box.getY(), box.getZ()) / 2);
    }
    case GeometryType::PLANE: {
      const auto& plane = static_cast<const tesseract_geometry::Plane&>(geometry);
      return plane_shape(plane.getA(), plane.getB(), plane.getC(), plane.getD());
    }
    case GeometryType::MESH:
    case GeometryType::SDF_MESH:
      return adapters_internal::tesseract_mesh(
          static_cast<const tesseract_geometry::PolygonMesh&>(geometry));
    case GeometryType::CONVEX_MESH:
      return adapters_internal::tesseract_hull(
          static_cast<const tesseract_geometry::PolygonMesh&>(geometry));
    case GeometryType::OCTREE: {
      const auto& tree = static_cast<const tesseract_geometry::Octree&>(geometry);
      DYOP_REQUIRE(tree.getOctree() != nullptr, "the octree is missing");
      return occupied_leaves(*tree.getOctree(),
                             adapters_internal::leaf_shape_of(tree.getSubType()));
    }
    case GeometryType::COMPOUND_MESH: {
      std::vector<CompoundChild> children;
      for (const auto& mesh :
           static_cast<const tesseract_geometry::CompoundMesh&>(geometry).getMeshes()) {
        DYOP_REQUIRE(mesh != nullptr, "a mesh of a compound is missing");
        children.push_back({tesseract_shape(*mesh), RigidPose()});
      }
      return std::make_shared<CompoundShape>(children);
    }
    default:
      throw InvalidArgument(core_internal::compose_message(
          "geometries of the type ", int(geometry.getType()), " have no shape"));
  }
}

/// Continuous contact tests for Tesseract by proof. Written for Tesseract 0.33; compiled against
/// stubs of its interface, not against Tesseract itself.
///
/// Between its two poses the origin of an object moves on a straight line, and the object turns
/// along the shortest arc at a constant rate. A pair without a result is proven to stay farther
/// apart than its margin all the way, rounding included. (Tesseract's Bullet managers test the
/// convex hull of both poses instead, which holds other points where an object turns.)
///
/// A result describes the first contact of two shapes: `cc_time` is the fraction of the motion that
/// is proven free, `cc_type` is Time0, Between or Time1 accordingly; points, normal and distance
/// are those at that time. Where a pair starts within its margin, it has one result, and the
/// distance is minus the penetration depth if convex shapes overlap (through libccd, without
/// proof). A search that ends undecided is logged and gives a result. CLOSEST gives the earliest
/// contact of a pair, ALL those of the first touch of each two shapes. If `is_valid` rejects a
/// contact, later ones of the same two shapes are not looked for. Negative margins count as zero.
///
/// An object that cannot be used is refused (false), and contactTest() throws until it is removed.
class TesseractContactManager final : public tesseract_collision::ContinuousContactManager {
 public:
  using UPtr = tesseract_collision::ContinuousContactManager::UPtr;

  explicit TesseractContactManager(std::string name = "DyopCastManager") : name_(std::move(name)) {}

  std::string getName() const override { return name_; }

  UPtr clone() const override {
    auto copy = std::make_unique<TesseractContactManager>(name_);
    copy->objects_ = objects_;
    copy->refused_ = refused_;
    copy->names_ = names_;
    copy->active_ = active_;
    copy->margins_ = margins_;
    copy->validator_ = validator_;
    return copy;
  }

  bool addCollisionObject(const std::string& name, const int& mask_id,
                          const tesseract_collision::CollisionShapesConst& shapes,
                          const tesseract_common::VectorIsometry3d& shape_poses,
                          bool enabled = true) override {
    removeCollisionObject(name);
    if (shapes.empty() && shape_poses.empty()) return false;
    Object object;
    object.mask_id = mask_id;
    object.is_enabled = enabled;
    object.geometries = shapes;
    object.poses = shape_poses;
    try {
      object.pieces = make_pieces(shapes, shape_poses);
    } catch (const std::exception& error) {
      CONSOLE_BRIDGE_logError("object \"%s\" is refused: %s", name.c_str(), error.what());
      refused_[name] = error.what();
      return false;
    }
    objects_[name] = std::move(object);
    names_.push_back(name);
    return true;
  }

  const tesseract_collision::CollisionShapesConst& getCollisionObjectGeometries(
      const std::string& name) const override {
    static const tesseract_collision::CollisionShapesConst kNone;
    const Object* object = find(name);
    return object != nullptr ? object->geometries : kNone;
  }
  const tesseract_common::VectorIsometry3d& getCollisionObjectGeometriesTransforms(
      const std::string& name) const override {
    static const tesseract_common::VectorIsometry3d kNone;
    const Object* object = find(name);
    return object != nullptr ? object->poses : kNone;
  }
  bool hasCollisionObject(const std::string& name) const override { return find(name) != nullptr; }
  bool removeCollisionObject(const std::string& name) override {
    refused_.erase(name);
    std::erase(names_, name);
    return objects_.erase(name) > 0;
  }
  bool enableCollisionObject(const std::string& name) override { return set_enabled(name, true); }
  bool disableCollisionObject(const std::string& name) override { return set_enabled(name, false); }
  bool isCollisionObjectEnabled(const std::string& name) const override {
    const Object* object = find(name);
    return object != nullptr && object->is_enabled;
  }

  // Names without an object are ignored, as Tesseract's own managers do: links without geometry.
  /// @throws InvalidArgument naming the object if a pose is not finite or no rotation; so do the
  ///         functions below.
  void setCollisionObjectsTransform(const std::string& name,
                                    const Eigen::Isometry3d& pose) override {
    setCollisionObjectsTransform(name, pose, pose);
  }
  void setCollisionObjectsTransform(const std::vector<std::string>& names,
                                    const tesseract_common::VectorIsometry3d& poses) override {
    setCollisionObjectsTransform(names, poses, poses);
  }
  void setCollisionObjectsTransform(const tesseract_common::TransformMap& transforms) override {
    for (const auto& [name, pose] : transforms) setCollisionObjectsTransform(name, pose);
  }
  void setCollisionObjectsTransform(const std::string& name, const Eigen::Isometry3d& pose1,
                                    const Eigen::Isometry3d& pose2) override {
    const auto found = objects_.find(name);
    if (found == objects_.end()) return;
    try {
      const RigidPose begin = pose_of(pose1);
      const RigidPose end = pose_of(pose2);
      found->second.X_WL0 = begin;
      found->second.X_WL1 = end;
    } catch (const InvalidArgument& error) {
      throw InvalidArgument("object \"" + name + "\": " + error.what());
    }
  }
  void setCollisionObjectsTransform(const std::vector<std::string>& names,
                                    const tesseract_common::VectorIsometry3d& pose1,
                                    const tesseract_common::VectorIsometry3d& pose2) override {
    DYOP_REQUIRE(names.size() == pose1.size() && names.size() == pose2.size(), names.size(),
                 " objects have ", pose1.size(), " and ", pose2.size(), " poses");
    for (std::size_t k = 0; k < names.size(); ++k)
      setCollisionObjectsTransform(names[k], pose1[k], pose2[k]);
  }
  void setCollisionObjectsTransform(const tesseract_common::TransformMap& pose1,
                                    const tesseract_common::TransformMap& pose2) override {
    for (const auto& [name, begin] : pose1) {
      const auto end = pose2.find(name);
      DYOP_REQUIRE(end != pose2.end(), "object \"", name, "\" has no second pose");
      setCollisionObjectsTransform(name, begin, end->second);
    }
  }

  const std::vector<std::string>& getCollisionObjects() const override { return names_; }
  /// All objects are active if there are no names.
  void setActiveCollisionObjects(const std::vector<std::string>& names) override {
    active_ = names;
  }
  const std::vector<std::string>& getActiveCollisionObjects() const override { return active_; }

  void setCollisionMarginData(
      tesseract_collision::CollisionMarginData collision_margin_data) override {
    margins_ = std::move(collision_margin_data);
  }
  const tesseract_collision::CollisionMarginData& getCollisionMarginData() const override {
    return margins_;
  }
  void setCollisionMarginPairData(
      const tesseract_collision::CollisionMarginPairData& pair_margin_data,
      tesseract_collision::CollisionMarginPairOverrideType override_type =
          tesseract_collision::CollisionMarginPairOverrideType::REPLACE) override {
    margins_.apply(pair_margin_data, override_type);
  }
  void setDefaultCollisionMargin(double default_collision_margin) override {
    margins_.setDefaultCollisionMargin(default_collision_margin);
  }
  void setCollisionMarginPair(const std::string& name1, const std::string& name2,
                              double collision_margin) override {
    margins_.setCollisionMargin(name1, name2, collision_margin);
  }
  void incrementCollisionMargin(double increment) override { margins_.incrementMargins(increment); }

  void setContactAllowedValidator(
      std::shared_ptr<const tesseract_common::ContactAllowedValidator> validator) override {
    validator_ = std::move(validator);
  }
  std::shared_ptr<const tesseract_common::ContactAllowedValidator> getContactAllowedValidator()
      const override {
    return validator_;
  }

  /// @throws InvalidArgument naming an object that was refused, or a pair that cannot be tested.
  void contactTest(tesseract_collision::ContactResultMap& collisions,
                   const tesseract_collision::ContactRequest& request) override {
    for (const auto& [name, reason] : refused_)
      throw InvalidArgument("object \"" + name + "\" was refused: " + reason);
    long count = 0;
    for (auto first = objects_.begin(); first != objects_.end(); ++first) {
      for (auto second = std::next(first); second != objects_.end(); ++second) {
        const Pair pair = make_pair(*first, *second);
        if (!is_tested(pair)) continue;
        count += report(collisions, request, pair, contacts_of(pair, request), count);
        if (is_full(request, count)) return;
      }
    }
  }

 private:
  struct Piece {
    std::shared_ptr<const Shape> shape;
    RigidPose X_LS;
    int index = 0;
    bool is_solid = false;
  };
  struct Object {
    int mask_id = 0;
    bool is_enabled = true;
    tesseract_collision::CollisionShapesConst geometries;
    tesseract_common::VectorIsometry3d poses;
    std::vector<Piece> pieces;
    RigidPose X_WL0;
    RigidPose X_WL1;
  };
  struct Side {
    std::string name;
    const Object* object = nullptr;
    bool is_active = false;
    std::shared_ptr<const Motion> X_WL;
  };
  using Pair = std::array<Side, 2>;
  using Results = std::vector<tesseract_collision::ContactResult,
                              Eigen::aligned_allocator<tesseract_collision::ContactResult>>;

  static constexpr TimeInterval kUnit{0, 1};

  static std::vector<Piece> make_pieces(const tesseract_collision::CollisionShapesConst& shapes,
                                        const tesseract_common::VectorIsometry3d& poses) {
    DYOP_REQUIRE(shapes.size() == poses.size(), shapes.size(), " shapes have ", poses.size(),
                 " poses");
    std::vector<Piece> pieces;
    for (std::size_t k = 0; k < shapes.size(); ++k) {
      DYOP_REQUIRE(shapes[k] != nullptr, "shape ", k, " is missing");
      const std::shared_ptr<const Shape> shape = tesseract_shape(*shapes[k]);
      if (!shape) continue;  // an empty octree
      pieces.push_back({shape, pose_of(poses[k]), int(k), is_closed_mesh(*shape)});
    }
    return pieces;
  }

  const Object* find(const std::string& name) const {
    const auto found = objects_.find(name);
    return found == objects_.end() ? nullptr : &found->second;
  }
  bool set_enabled(const std::string& name, bool enabled) {
    const auto found = objects_.find(name);
    if (found == objects_.end()) return false;
    found->second.is_enabled = enabled;
    return true;
  }

  Side make_side(const std::pair<const std::string, Object>& entry) const {
    const Object& object = entry.second;
    const bool is_active =
        active_.empty() || std::find(active_.begin(), active_.end(), entry.first) != active_.end();
    const bool rests = object.X_WL0.rotation() == object.X_WL1.rotation() &&
                       object.X_WL0.translation() == object.X_WL1.translation();
    Side side{entry.first, &object, is_active, nullptr};
    if (rests) {
      side.X_WL = std::make_shared<RestMotion>(object.X_WL0);
    } else {
      side.X_WL = std::make_shared<InterpolatedMotion>(kUnit, object.X_WL0, object.X_WL1);
    }
    return side;
  }
  Pair make_pair(const std::pair<const std::string, Object>& first,
                 const std::pair<const std::string, Object>& second) const {
    return {make_side(first), make_side(second)};
  }

  bool is_tested(const Pair& pair) const {
    const bool is_on = pair[0].object->is_enabled && pair[1].object->is_enabled;
    const bool has_active = pair[0].is_active || pair[1].is_active;
    return is_on && has_active && !(validator_ && (*validator_)(pair[0].name, pair[1].name));
  }

  Results contacts_of(const Pair& pair, const tesseract_collision::ContactRequest& request) const {
    Results results;
    try {
      for (const Piece& a : pair[0].object->pieces) {
        for (const Piece& b : pair[1].object->pieces) add_contacts(results, pair, a, b, request);
      }
    } catch (const std::exception& error) {
      throw InvalidArgument("objects \"" + pair[0].name + "\" and \"" + pair[1].name +
                            "\": " + error.what());
    }
    return results;
  }

  void add_contacts(Results& results, const Pair& pair, const Piece& a, const Piece& b,
                    const tesseract_collision::ContactRequest& request) const {
    using tesseract_collision::ContactTestType;
    const Scalar margin = margins_.getCollisionMargin(pair[0].name, pair[1].name);
    const ComposedMotion X_WA(pair[0].X_WL, std::make_shared<RestMotion>(a.X_LS));
    const ComposedMotion X_WB(pair[1].X_WL, std::make_shared<RestMotion>(b.X_LS));
    ToiOptions options;
    options.target_distance = margin < 0 ? 0 : margin;
    options.with_contacts =
        request.type == ContactTestType::ALL || request.type == ContactTestType::LIMITED;
    options.solid_a = a.is_solid;
    options.solid_b = b.is_solid;
    const ToiResult found = time_of_impact(*a.shape, X_WA, *b.shape, X_WB, kUnit, options);
    if (found.status == ToiStatus::Separated) return;
    if (found.status != ToiStatus::Impact && found.status != ToiStatus::InitiallyWithinTarget) {
      CONSOLE_BRIDGE_logError(
          "could not decide whether \"%s\" and \"%s\" stay apart, so they do not",
          pair[0].name.c_str(), pair[1].name.c_str());
    }
    for (const WitnessPair& contact : found.contacts) {
      const Scalar distance = std::min(contact.lower, options.target_distance);
      add(results, pair, a, b, contact, distance, found.t_safe, request);
    }
    if (!found.contacts.empty()) return;
    add_nearest(results, pair, a, b, found, request);
  }

  void add_nearest(Results& results, const Pair& pair, const Piece& a, const Piece& b,
                   const ToiResult& found,
                   const tesseract_collision::ContactRequest& request) const {
    DistanceOptions options;
    options.with_penetration = request.calculate_penetration;
    options.solid_a = a.is_solid;
    options.solid_b = b.is_solid;
    const DistanceResult nearest =
        dyop::distance(*a.shape, found.X_WA, *b.shape, found.X_WB, options);
    const Scalar margin = margins_.getCollisionMargin(pair[0].name, pair[1].name);
    WitnessPair contact = nearest;
    Scalar distance = std::min(nearest.lower, std::max<Scalar>(margin, 0));
    if (nearest.penetration) {
      distance = -nearest.penetration->depth;
      const Vector3 half = nearest.penetration->nhat_AB_W * (nearest.penetration->depth / 2);
      contact.nhat_AB_W = nearest.penetration->nhat_AB_W;
      contact.p_WCa = nearest.penetration->p_W + half;
      contact.p_WCb = nearest.penetration->p_W - half;
    }
    add(results, pair, a, b, contact, distance, found.t_safe, request);
  }

  static int subshape(const std::optional<std::int32_t>& triangle,
                      const std::optional<std::int32_t>& child) {
    return triangle ? *triangle : child.value_or(-1);
  }
  static tesseract_collision::ContinuousCollisionType type_at(Scalar t) {
    using tesseract_collision::ContinuousCollisionType;
    if (t <= kUnit.begin) return ContinuousCollisionType::CCType_Time0;
    return t >= kUnit.end ? ContinuousCollisionType::CCType_Time1
                          : ContinuousCollisionType::CCType_Between;
  }

  static void add(Results& results, const Pair& pair, const Piece& a, const Piece& b,
                  const WitnessPair& contact, Scalar distance, Scalar t,
                  const tesseract_collision::ContactRequest& request) {
    tesseract_collision::ContactResult result;
    result.distance = distance;
    result.normal = contact.nhat_AB_W;
    result.nearest_points = {contact.p_WCa, contact.p_WCb};
    result.shape_id = {a.index, b.index};
    result.subshape_id = {subshape(contact.triangle_a, contact.child_a),
                          subshape(contact.triangle_b, contact.child_b)};
    for (std::size_t k = 0; k < 2; ++k) {
      const Side& side = pair[k];
      result.link_names[k] = side.name;
      result.type_id[k] = side.object->mask_id;
      result.transform[k] = isometry_of(side.object->X_WL0);
      result.nearest_points_local[k] = side.X_WL->pose(t).inverse() * result.nearest_points[k];
      if (!side.is_active) continue;
      result.cc_time[k] = t;
      result.cc_type[k] = type_at(t);
      result.cc_transform[k] = isometry_of(side.object->X_WL1);
    }
    if (!request.is_valid || request.is_valid(result)) results.push_back(result);
  }

  static bool is_earlier(const tesseract_collision::ContactResult& a,
                         const tesseract_collision::ContactResult& b) {
    const auto rank = [](const tesseract_collision::ContactResult& result) {
      return std::tuple(std::max(result.cc_time[0], result.cc_time[1]), result.distance);
    };
    return rank(a) < rank(b);
  }

  static bool is_full(const tesseract_collision::ContactRequest& request, long count) {
    using tesseract_collision::ContactTestType;
    if (request.type == ContactTestType::FIRST) return count > 0;
    return request.type == ContactTestType::LIMITED && request.contact_limit > 0 &&
           count >= request.contact_limit;
  }

  // Returns how many results were added.
  static long report(tesseract_collision::ContactResultMap& collisions,
                     const tesseract_collision::ContactRequest& request, const Pair& pair,
                     Results results, long count) {
    using tesseract_collision::ContactTestType;
    if (results.empty()) return 0;
    std::stable_sort(results.begin(), results.end(), is_earlier);
    const bool wants_one =
        request.type == ContactTestType::CLOSEST || request.type == ContactTestType::FIRST;
    if (wants_one) results.resize(1);
    long added = 0;
    for (const tesseract_collision::ContactResult& result : results) {
      if (is_full(request, count + added)) break;
      collisions.addContactResult({pair[0].name, pair[1].name}, result);
      ++added;
    }
    return added;
  }

  std::string name_;
  std::map<std::string, Object> objects_;
  std::map<std::string, std::string> refused_;  // why
  std::vector<std::string> names_;
  std::vector<std::string> active_;
  tesseract_collision::CollisionMarginData margins_;
  std::shared_ptr<const tesseract_common::ContactAllowedValidator> validator_;
};

}  // namespace dyop::adapters
