// SPDX-License-Identifier: BSD-3-Clause
#include "dyop/geometry/compound_shape.h"

#include <algorithm>

#include "dyop/core/error.h"
#include "geometry/compound_tree.h"
#include "geometry/posed_convex.h"
#include "geometry/solid.h"

namespace dyop {
namespace {

std::vector<CompoundChild> flattened(const std::vector<CompoundChild>& children) {
  DYOP_REQUIRE(!children.empty(), "a compound needs at least one child");
  std::vector<CompoundChild> result;
  for (std::size_t i = 0; i < children.size(); ++i) {
    const CompoundChild& child = children[i];
    DYOP_REQUIRE(child.shape != nullptr, "child ", i, " of a compound has no shape");
    if (child.shape->kind() != ShapeKind::Compound) {
      result.push_back(child);
      continue;
    }
    for (const CompoundChild& inner : static_cast<const CompoundShape&>(*child.shape).children()) {
      result.push_back({inner.shape, child.X_CS * inner.X_CS});
    }
  }
  return result;
}

}  // namespace

CompoundShape::CompoundShape(const std::vector<CompoundChild>& children)
    : children_(flattened(children)),
      tree_(std::make_shared<const geometry_internal::CompoundTree>(children_)) {
  for (const geometry_internal::CompoundPart& part : tree_->parts) {
    bounding_box_.extend(part.shape().bounding_box());
    bounding_radius_ = std::max(bounding_radius_, part.shape().bounding_radius());
  }
}

// The parallel axis theorem about the common centre of mass.
MassProperties CompoundShape::compute_mass_properties(Scalar density) const {
  geometry_internal::require_density(density);
  std::vector<MassProperties> parts;
  MassProperties whole;
  Vector3 moment = Vector3::Zero();
  for (std::size_t i = 0; i < children_.size(); ++i) {
    try {
      parts.push_back(geometry_internal::posed(children_[i].shape->compute_mass_properties(density),
                                               children_[i].X_CS));
    } catch (const InvalidArgument& error) {
      throw InvalidArgument(
          core_internal::compose_message("child ", i, " of the compound: ", error.what()));
    }
    whole.mass += parts.back().mass;
    moment += parts.back().mass * parts.back().p_BoBcm;
  }
  whole.p_BoBcm = moment / whole.mass;
  for (const MassProperties& part : parts) {
    const Vector3 arm = part.p_BoBcm - whole.p_BoBcm;
    whole.I_BBcm +=
        part.I_BBcm + part.mass * (arm.squaredNorm() * Matrix3::Identity() - arm * arm.transpose());
  }
  return geometry_internal::require_representable(whole);
}

}  // namespace dyop
