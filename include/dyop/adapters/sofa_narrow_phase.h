// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <sofa/component/collision/detection/algorithm/BVHNarrowPhase.h>
#include <sofa/component/collision/geometry/TriangleCollisionModel.h>
#include <sofa/core/collision/DetectionOutput.h>
#include <sofa/core/collision/Intersection.h>
#include <sofa/helper/logging/Messaging.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <exception>
#include <map>
#include <set>
#include <utility>
#include <vector>

#include "dyop/core/error.h"
#include "dyop/distance/distance.h"
#include "dyop/geometry/triangle_mesh.h"

namespace dyop::adapters {

/// SOFA's BVHNarrowPhase, with proven contacts of two triangle models: every contact within the
/// alarm distance of their surfaces, once per place, where they are at this step. `value` is never
/// above the true distance less the contact distances. Surfaces that cross have contacts where they
/// do, but no depth. Written for SOFA as of 2025, whose models have a contact distance; compiled
/// against stubs of its interface, not against SOFA itself.
///
/// All else is left to SOFA's own test: other models, an object against itself, and pairs that
/// cannot be tested, which are reported as errors by name. unproven_pairs() counts them.
///
/// A plugin registers it:
///     factory->registerObjects(sofa::core::ObjectRegistrationData("Proven contacts")
///                                  .add<dyop::adapters::SofaNarrowPhase>());
class SofaNarrowPhase : public sofa::component::collision::detection::algorithm::BVHNarrowPhase {
 public:
  SOFA_CLASS(SofaNarrowPhase, sofa::component::collision::detection::algorithm::BVHNarrowPhase);

  using Base = sofa::component::collision::detection::algorithm::BVHNarrowPhase;
  using CollisionModel = sofa::core::CollisionModel;
  using Triangles =
      sofa::component::collision::geometry::TriangleCollisionModel<sofa::defaulttype::Vec3Types>;

  SofaNarrowPhase() = default;

  void beginNarrowPhase() override {
    Base::beginNarrowPhase();
    up_to_date_.clear();
    unproven_pairs_ = 0;
  }

  void addCollisionPair(const std::pair<CollisionModel*, CollisionModel*>& pair) override {
    const bool is_free = (!pair.first->isSimulated() && !pair.second->isSimulated()) ||
                         pair.first->empty() || pair.second->empty();
    if (is_free) return;
    auto* a = dynamic_cast<Triangles*>(pair.first->getLast());
    auto* b = dynamic_cast<Triangles*>(pair.second->getLast());
    const bool is_ours =
        a != nullptr && b != nullptr && !isSelfCollision(a, b) && intersectionMethod != nullptr;
    if (is_ours && add_contacts(*a, *b)) return;
    ++unproven_pairs_;
    Base::addCollisionPair(pair);
  }

  /// Pairs that SOFA's own test has examined since beginNarrowPhase().
  std::size_t unproven_pairs() const { return unproven_pairs_; }

 private:
  using Outputs = sofa::core::collision::TDetectionOutputVector<Triangles, Triangles>;

  bool add_contacts(Triangles& a, Triangles& b) {
    try {
      const TriangleMesh& mesh_a = mesh_of(a);
      const TriangleMesh& mesh_b = mesh_of(b);
      const Scalar around = a.getContactDistance() + b.getContactDistance();
      const Scalar alarm = intersectionMethod->getAlarmDistance() + around;
      const Scalar contact = intersectionMethod->getContactDistance() + around;
      const std::vector<Contact> found =
          find_contacts(mesh_a, RigidPose(), mesh_b, RigidPose(), alarm);
      sofa::core::collision::DetectionOutputVector*& outputs = getDetectionOutputs(&a, &b);
      if (outputs == nullptr) outputs = new Outputs;  // released by the base class
      for (const Contact& witness : found)
        static_cast<Outputs*>(outputs)->push_back(output(a, b, witness, contact));
      return true;
    } catch (const std::exception& error) {
      msg_error() << "the models \"" << a.getName() << "\" and \"" << b.getName()
                  << "\" are left to SOFA's own test: " << error.what();
      return false;
    }
  }

  static sofa::core::collision::DetectionOutput output(Triangles& a, Triangles& b,
                                                       const Contact& witness,
                                                       Scalar contact_distance) {
    const auto index_a = static_cast<sofa::Index>(witness.triangle_a.value());
    const auto index_b = static_cast<sofa::Index>(witness.triangle_b.value());
    sofa::core::collision::DetectionOutput result;
    result.elem = {sofa::core::CollisionElementIterator(&a, index_a),
                   sofa::core::CollisionElementIterator(&b, index_b)};
    result.id = std::int64_t(index_a) * std::int64_t(b.getSize()) + std::int64_t(index_b);
    for (unsigned k = 0; k < 3; ++k) {
      result.point[0][k] = witness.p_WCa[int(k)];
      result.point[1][k] = witness.p_WCb[int(k)];
      result.normal[k] = witness.nhat_AB_W[int(k)];
    }
    result.value = witness.lower - contact_distance;
    return result;
  }

  // The model where it is now. As long as its triangles stay the same, boxes are only refitted.
  const TriangleMesh& mesh_of(const Triangles& model) {
    const auto known = meshes_.find(&model);
    if (known != meshes_.end() && up_to_date_.contains(&model)) return known->second;
    std::vector<Vector3> vertices;
    for (const auto& x : model.getX()) vertices.emplace_back(x[0], x[1], x[2]);
    std::vector<TriangleIndices> triangles;
    for (const auto& t : model.getTriangles()) {
      triangles.push_back({std::int32_t(t[0]), std::int32_t(t[1]), std::int32_t(t[2])});
    }
    const bool is_same = known != meshes_.end() &&
                         known->second.vertices().size() == vertices.size() &&
                         std::ranges::equal(known->second.triangles(), triangles);
    const TriangleMesh mesh = is_same ? known->second.with_vertices(std::move(vertices))
                                      : TriangleMesh(std::move(vertices), std::move(triangles));
    up_to_date_.insert(&model);
    return meshes_.insert_or_assign(&model, mesh).first->second;
  }

  std::map<const Triangles*, TriangleMesh> meshes_;
  std::set<const Triangles*> up_to_date_;
  std::size_t unproven_pairs_ = 0;
};

}  // namespace dyop::adapters
