// SPDX-License-Identifier: BSD-3-Clause
#include "dynamics/step/gaps/curved_gap.h"

#include <algorithm>

#include "contact/generation/ball_fit.h"
#include "contact/generation/contact_workspace.h"
#include "contact/generation/facet_fit.h"
#include "core/tolerance.h"
#include "dynamics/step/gaps/rounded_core.h"

namespace dyop::internal {

bool is_on_curved_surface(const ContactPoint& point, const BodyRecord& a, const BodyRecord& b) {
  if (point.merged_way > 0) return true;
  const Shape& shape_a = *a.definition.shape;
  const Shape& shape_b = *b.definition.shape;
  return (rounding_radius(shape_a) > 0 && shape_b.kind() == ShapeKind::TriangleMesh) ||
         (rounding_radius(shape_b) > 0 && shape_a.kind() == ShapeKind::TriangleMesh);
}

std::optional<EndGap> measured_end_gap(const ContactPoint& point, const CurvedMove& move,
                                       const PairState& pair, const BodyRecord& a,
                                       const RigidPose& X_WA_end, const BodyRecord& b,
                                       const RigidPose& X_WB_end, ContactWorkspace& workspace) {
  const PairLengths& lengths = pair.lengths;
  const Scalar way = move.sliding + move.rolling * lengths.radius;
  if (!(way > kContactMergedChange * lengths.standoff)) return std::nullopt;
  // How far the surfaces beside the contact may come below it.
  const Scalar sagitta = std::max(way * way / lengths.radius, move.turn * point.merged_way);
  const Scalar lift = std::max(0.0, sagitta - move.end_gap);
  const Scalar reach = std::max(move.end_gap, lengths.rest_gap()) + lengths.standoff + sagitta;
  // A rim that leans moves its contact along itself much faster than any of its points.
  const Scalar migration =
      point.merged_way > 0 ? kContactMergedRadiusFraction * lengths.radius : Scalar{0};
  const Scalar near = std::max(kContactMeasuredWays * way, migration);
  const Vector3& n = point.nhat_AB_W;
  const RigidPose lifted =
      RigidPose::from_trusted(X_WB_end.rotation(), X_WB_end.translation() + lift * n);
  const Vector3 p_a = X_WA_end * point.p_ACa;
  const Vector3 p_b = X_WB_end * point.p_BCb;
  ContactGeneratorOptions options;
  options.region = {(p_a + p_b) / 2, near + (p_a - p_b).norm() / 2};
  std::vector<ContactPoint> found;
  const UseOfNeighbours use(workspace, pair.neighbours);
  generate_contacts(*a.definition.shape, X_WA_end, *b.definition.shape, lifted, reach + lift,
                    options, workspace, found);
  const Scalar most_sagitta = kContactFitStandoffs * lengths.standoff;
  const bool is_fitted = fit_ball_contacts(*a.definition.shape, X_WA_end, *b.definition.shape,
                                           lifted, most_sagitta, found);
  std::vector<const ContactPoint*> near_by;
  const ContactPoint* nearest = nullptr;
  const auto gap_of = [&](const ContactPoint& other) {
    return other.gap - lift * other.nhat_AB_W.dot(n);
  };
  for (const ContactPoint& other : found) {
    const Scalar cosine = other.nhat_AB_W.dot(n);
    const Scalar apart =
        std::min((other.p_WCa - p_a).squaredNorm(), (other.p_WCa - p_b).squaredNorm());
    if (cosine < kContactMergedCosine || apart > near * near) continue;
    const bool is_of_another = std::any_of(
        move.others_W.begin(), move.others_W.end(),
        [&](const Vector3& place) { return (other.p_WCa - place).squaredNorm() < apart; });
    if (is_of_another) continue;
    near_by.push_back(&other);
    if (!nearest || gap_of(other) < gap_of(*nearest)) nearest = &other;
  }
  if (!nearest) return std::nullopt;
  std::optional<ContactPoint> fitted;
  if (point.merged_way > 0) {
    fitted = fitted_contact(*nearest, near_by, most_sagitta);
  }
  const ContactPoint& found_at = fitted ? *fitted : *nearest;
  EndGap end{gap_of(found_at), Vector3((found_at.p_WCa + found_at.p_WCb - lift * n) / 2)};
  end.is_smooth = fitted || is_fitted;
  return end;
}

}  // namespace dyop::internal
