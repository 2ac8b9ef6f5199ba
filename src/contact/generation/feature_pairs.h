// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "contact/generation/contact_search.h"
#include "contact/generation/feature_witness.h"

namespace dyop::contact_internal {

/// Tests single pairs of features of two surfaces and keeps those that are contacts.
class FeaturePairs {
 public:
  FeaturePairs(const ContactQuery& query, std::vector<FoundContact>& found)
      : query_(query), found_(found) {}

  /// All pairs of features owned by the two triangles. Corners of `b` in frame A.
  void add_triangles(std::int32_t triangle_a, const Triangle& a, std::int32_t triangle_b,
                     const Triangle& b);

 private:
  /// A vertex touching the other surface.
  struct VertexSide {
    std::int32_t vertex;
    std::int32_t triangle;
    Vector3 p;  // in frame A
    bool is_of_a;
  };
  struct EdgeSide {
    std::int32_t edge;
    std::int32_t triangle;
    Vector3 from;  // in frame A
    Vector3 to;
  };
  void add_vertex(const VertexSide& vertex, std::int32_t triangle, const Triangle& t);
  bool admits_foot(const VertexSide& vertex, std::int32_t triangle, const TriangleFoot& foot,
                   const Vector3& normal) const;
  void add_edges(const EdgeSide& a, const EdgeSide& b);
  bool admits_crossing(const EdgeSide& a, const EdgeSide& b, const EdgeCrossing& crossing,
                       const Vector3& n) const;
  bool take_face_normal(const EdgeSide& a, const EdgeSide& b, const EdgeCrossing& crossing,
                        FoundContact& contact) const;
  void keep(FoundContact& contact, std::span<const Vector3> feature_a,
            std::span<const Vector3> feature_b, const Vector3& proof);

  /// The normal towards the other shape, in the frame of the given shape.
  Vector3 outward(bool of_a, const Vector3& nhat_AB_A) const {
    return of_a ? nhat_AB_A : Vector3(-(query_.X_BA.rotation() * nhat_AB_A));
  }
  Vector3 own_point(bool of_a, const Vector3& p_A) const { return of_a ? p_A : query_.X_BA * p_A; }
  const ContactSurface& surface(bool of_a) const { return of_a ? query_.a : query_.b; }

  const ContactQuery& query_;
  std::vector<FoundContact>& found_;
};

}  // namespace dyop::contact_internal
