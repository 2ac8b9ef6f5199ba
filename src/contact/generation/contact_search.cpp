// SPDX-License-Identifier: BSD-3-Clause
#include "contact/generation/contact_search.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <numeric>
#include <tuple>

#include "contact/generation/flat_contacts.h"
#include "core/tolerance.h"
#include "distance/piece_distance.h"
#include "geometry/box_surface.h"

namespace dyop::contact_internal {
namespace {

using geometry_internal::kBoxEdges;

constexpr int kRankOfFace = 0;
constexpr int kRankOfCrossing = 1;
constexpr int kRankOfBorder = 2;

FeatureKey vertex_key(std::int32_t number) {
  return {FeatureKind::Vertex, 0, number};
}

// The axis along which a box is thinnest: of a piece of surface its normal, nearly.
Vector3 thin_axis(const OrientedBox& box) {
  Eigen::Index thinnest;
  box.half_extents.minCoeff(&thinnest);
  return box.axes.col(thinnest);
}

Scalar extent_along(const OrientedBox& box, const Vector3& n) {
  return (box.axes.transpose() * n).cwiseAbs().dot(box.half_extents);
}

// The corners of the feature that holds a foot.
std::span<const Vector3> foot_corners(const Triangle& t, const TriangleFoot& foot,
                                      std::array<Vector3, 2>& ends) {
  const auto k = std::size_t(foot.index);
  switch (foot.kind) {
    case FeatureKind::Vertex:
      ends[0] = t[k];
      return std::span(ends).first(1);
    case FeatureKind::Edge:
      ends = {t[k], t[(k + 1) % 3]};
      return ends;
    case FeatureKind::Face:
    case FeatureKind::Smooth:
      break;
  }
  return t;
}

}  // namespace

// Most pairs of a body that slides are apart across the surface, along which it does not close in.
bool matters(const ContactQuery& query, const ShapeTree& tree_a, const ShapeTree& tree_b,
             const BoxPair& pair) {
  const ExpectedApproach& approach = *query.approach_A;
  if (!(pair.gap > approach.least + approach.slack)) return true;
  const OrientedBox a = tree_a.box(pair.a);
  OrientedBox b = tree_b.box(pair.b);
  b.center = query.X_AB * b.center;
  b.axes = query.X_AB.rotation() * b.axes;
  const Vector3 apart = b.center - a.center;
  const Scalar radii = tree_a.rounding() + tree_b.rounding();
  const auto is_beyond = [&](Vector3 n) {
    if (n.dot(apart) < 0) n = -n;
    const Scalar gap = n.dot(apart) - extent_along(a, n) - extent_along(b, n) - radii;
    return gap > approach.needed_gap(n, b);
  };
  return !is_beyond(thin_axis(a)) && !is_beyond(thin_axis(b));
}

// Bounds: the slab gap along `proof` is at most the distance, the witness's length at least. The
// contact's points and normal must be set; the proof points from A to B and may have any length.
void FeaturePairs::keep(FoundContact& contact, std::span<const Vector3> feature_a,
                        std::span<const Vector3> feature_b, const Vector3& proof) {
  Scalar gap = kInfinity;
  for (const Vector3& a : feature_a) {
    for (const Vector3& b : feature_b) gap = std::min(gap, proof.dot(b - a));
  }
  const Scalar length = proof.norm();
  const Scalar rounding = 1 - 16 * kUnitRoundoff;
  contact.lower = length > 0 ? std::max(Scalar{0}, gap / length * rounding - query_.noise) : 0;
  contact.upper = (contact.p_b - contact.p_a).norm() / rounding + query_.noise;
  if (contact.lower <= query_.reach) found_.push_back(contact);
}

bool FeaturePairs::admits_foot(const VertexSide& vertex, std::int32_t triangle,
                               const TriangleFoot& foot, const Vector3& normal) const {
  const bool is_face = foot.kind == FeatureKind::Face;
  const Scalar strict = query_.options.border_tolerance;
  const bool of_a = vertex.is_of_a;
  return surface(!of_a).admits_at_foot(triangle, foot, own_point(!of_a, foot.point),
                                       outward(!of_a, normal), strict, query_.noise) &&
         surface(of_a).admits_at_vertex(vertex.vertex, outward(of_a, normal),
                                        is_face ? query_.options.cone_tolerance : strict,
                                        query_.noise);
}

void FeaturePairs::add_vertex(const VertexSide& vertex, std::int32_t triangle, const Triangle& t) {
  const std::optional<TriangleFoot> foot = find_foot(t, vertex.p, query_.reach + query_.noise,
                                                     query_.options.border_tolerance, query_.noise);
  if (!foot) return;
  const bool is_face = foot->kind == FeatureKind::Face;
  if (is_face && !foot->is_outer && surface(!vertex.is_of_a).is_solid) return;
  Vector3 towards_vertex = foot->normal;
  if (!is_face) {
    towards_vertex = vertex.p - foot->point;
    const Scalar length = towards_vertex.norm();
    if (!(length > 0)) return;
    towards_vertex /= length;
  }
  FoundContact contact;
  contact.p_a = vertex.is_of_a ? vertex.p : foot->point;
  contact.p_b = vertex.is_of_a ? foot->point : vertex.p;
  contact.normal = vertex.is_of_a ? Vector3(-towards_vertex) : towards_vertex;
  contact.normal_is_of_b = vertex.is_of_a;
  contact.rank = is_face ? kRankOfFace : kRankOfBorder;
  contact.triangle_a = vertex.is_of_a ? vertex.triangle : triangle;
  contact.triangle_b = vertex.is_of_a ? triangle : vertex.triangle;
  if (!admits_foot(vertex, triangle, *foot, contact.normal)) return;
  const FeatureKey foot_key = surface(!vertex.is_of_a).foot_key(triangle, *foot);
  contact.key.a = vertex.is_of_a ? vertex_key(vertex.vertex) : foot_key;
  contact.key.b = vertex.is_of_a ? foot_key : vertex_key(vertex.vertex);
  std::array<Vector3, 2> ends;
  const std::span<const Vector3> corners = foot_corners(t, *foot, ends);
  const std::span<const Vector3> point(&vertex.p, 1);
  keep(contact, vertex.is_of_a ? point : corners, vertex.is_of_a ? corners : point, contact.normal);
}

bool FeaturePairs::admits_crossing(const EdgeSide& a, const EdgeSide& b,
                                   const EdgeCrossing& crossing, const Vector3& n) const {
  const Scalar sine = query_.options.cone_tolerance;
  return query_.a.admits_at_edge(a.edge, crossing.p_a, n, sine, query_.noise) &&
         query_.b.admits_at_edge(b.edge, query_.X_BA * crossing.p_b, outward(false, n), sine,
                                 query_.noise);
}

// Picks, among the normals of all faces beside the two edges that both sides admit, the one nearest
// to the witness.
bool FeaturePairs::take_face_normal(const EdgeSide& a, const EdgeSide& b,
                                    const EdgeCrossing& crossing, FoundContact& contact) const {
  const Vector3 w = contact.p_b - contact.p_a;
  const Scalar least = w.norm() / 2;
  Scalar best = least;
  for (const bool of_a : {true, false}) {
    const ContactSurface& own = surface(of_a);
    for (const std::int32_t side : own.topology->sides_of_edge(of_a ? a.edge : b.edge)) {
      const Triangle t = own.mesh->triangle(side / 3);
      Vector3 n = (t[1] - t[0]).cross(t[2] - t[0]);
      const Scalar length = n.norm();
      if (!(length > 0)) continue;
      n /= length;
      if (!of_a) n = query_.X_AB.rotation() * n;
      if (n.dot(w) < 0) n = -n;
      if (!(n.dot(w) > best) || !admits_crossing(a, b, crossing, n)) continue;
      best = n.dot(w);
      contact.normal = n;
      contact.normal_is_of_b = !of_a;
    }
  }
  return best > least;
}

void FeaturePairs::add_edges(const EdgeSide& a, const EdgeSide& b, bool is_admitted) {
  const std::optional<EdgeCrossing> crossing =
      find_crossing(a.from, a.to, b.from, b.to, query_.reach + query_.noise, query_.noise);
  if (!crossing) return;
  FoundContact contact;
  contact.p_a = crossing->p_a;
  contact.p_b = crossing->p_b;
  contact.rank = kRankOfCrossing;
  contact.key = {{FeatureKind::Edge, 0, a.edge}, {FeatureKind::Edge, 0, b.edge}};
  contact.triangle_a = a.triangle;
  contact.triangle_b = b.triangle;
  Vector3 n = crossing->normal;
  const Scalar height = n.dot(contact.p_b - contact.p_a);
  if (height < 0) n = -n;
  const bool is_steep = crossing->sine >= kContactParallelSine;
  if (is_steep || !take_face_normal(a, b, *crossing, contact)) {
    contact.normal = n;
    if (!is_admitted && !admits_crossing(a, b, *crossing, n)) {
      // Touching edges do not give the normal's sign; the faces beside them do.
      if (std::abs(height) > query_.noise || !admits_crossing(a, b, *crossing, -n)) return;
      contact.normal = -n;
    }
  }
  const std::array<Vector3, 2> ends_a{a.from, a.to};
  const std::array<Vector3, 2> ends_b{b.from, b.to};
  keep(contact, ends_a, ends_b, n);
}

void FeaturePairs::add_triangles(std::int32_t triangle_a, const Triangle& a,
                                 std::int32_t triangle_b, const Triangle& b) {
  const std::uint8_t own_a = query_.a.features->owned_by(triangle_a);
  const std::uint8_t own_b = query_.b.features->owned_by(triangle_b);
  const TriangleIndices& indices_a = query_.a.indices(triangle_a);
  const TriangleIndices& indices_b = query_.b.indices(triangle_b);
  for (std::size_t k = 0; k < 3; ++k) {
    if (own_a >> k & 1) add_vertex({indices_a[k], triangle_a, a[k], true}, triangle_b, b);
    if (own_b >> k & 1) add_vertex({indices_b[k], triangle_b, b[k], false}, triangle_a, a);
  }
  if ((own_a & ContactFeatures::kSides) == 0 || (own_b & ContactFeatures::kSides) == 0) return;
  for (std::size_t i = 0; i < 3; ++i) {
    if ((own_a >> (3 + i) & 1) == 0) continue;
    const EdgeSide edge_a{*query_.a.topology->edge_of_side(3 * triangle_a + std::int32_t(i)),
                          triangle_a, a[i], a[(i + 1) % 3]};
    for (std::size_t j = 0; j < 3; ++j) {
      if ((own_b >> (3 + j) & 1) == 0) continue;
      add_edges(edge_a, {*query_.b.topology->edge_of_side(3 * triangle_b + std::int32_t(j)),
                         triangle_b, b[j], b[(j + 1) % 3]});
    }
  }
}

// A convex solid is touched from outside only, so a vertex needs the triangles whose planes it is
// above. Where another triangle shares the edge or corner that is nearest, it would give the same
// contact again.
void FeaturePairs::add_vertices(bool of_a, const NearFeatures& own, const NearFeatures& other) {
  const ContactFeatures& features = *surface(of_a).features;
  const MeshTopology& topology = *surface(of_a).topology;
  for (const std::int32_t v : own.vertices()) {
    if (!features.is_contact_vertex(v)) continue;
    const VertexSide vertex{v, topology.corners_of_vertex(v)[0] / 3, own.point(v), of_a};
    for (std::uint64_t below = own.triangles_below(v); below != 0; below &= below - 1) {
      const auto k = std::size_t(std::countr_zero(below));
      add_vertex(vertex, other.triangle(k), other.corners(k));
    }
  }
}

void FeaturePairs::add_convex(const NearFeatures& a, const NearFeatures& b) {
  add_vertices(true, a, b);
  add_vertices(false, b, a);
  const auto edge_side = [](const ContactSurface& surface, const NearFeatures& near,
                            std::int32_t side) {
    const TriangleIndices& t = surface.indices(side / 3);
    const auto k = std::size_t(side % 3);
    return EdgeSide{*surface.topology->edge_of_side(side), side / 3, near.point(t[k]),
                    near.point(t[k < 2 ? k + 1 : 0])};
  };
  std::array<EdgeSide, NearFeatures::kMostSides> edges;
  std::size_t count = 0;
  for (const std::int32_t side : b.sides()) {
    const EdgeSide edge = edge_side(query_.b, b, side);
    if (query_.b.features->is_contact_edge(edge.edge)) edges[count++] = edge;
  }
  for (const std::int32_t side : a.sides()) {
    const EdgeSide edge = edge_side(query_.a, a, side);
    if (!query_.a.features->is_contact_edge(edge.edge)) continue;
    for (const EdgeSide& other : std::span(edges).first(count)) add_edges(edge, other);
  }
}

void FeaturePairs::add_boxes(const NearBoxes& near) {
  const distance_internal::BoxCorners corners(*query_.a.mesh, *query_.b.mesh, query_.X_AB);
  near.visit_vertices([&](bool of_a, std::size_t vertex, std::size_t triangle) {
    const auto number = std::int32_t(vertex);
    const std::int32_t own = surface(of_a).topology->corners_of_vertex(number)[0] / 3;
    add_vertex({number, own, corners.point(of_a, vertex), of_a}, std::int32_t(triangle),
               corners.triangle(!of_a, triangle));
  });
  const auto edge_side = [&](bool of_a, std::uint8_t number) {
    const geometry_internal::BoxEdge& edge = kBoxEdges[number];
    return EdgeSide{number, edge.side / 3, corners.point(of_a, std::size_t(edge.from)),
                    corners.point(of_a, std::size_t(edge.to))};
  };
  for (const NearBoxes::EdgePair& pair : near.edge_pairs()) {
    add_edges(edge_side(true, pair.a), edge_side(false, pair.b), pair.is_admitted);
  }
}

bool search_convex(const ContactQuery& query, const ConvexShape& a, const ConvexShape& b,
                   std::vector<FoundContact>& found) {
  if (NearBoxes::serves(a, query.a.mesh, b, query.b.mesh)) {
    const ContactGeneratorOptions& options = query.options;
    const NearBoxes near(a, b, query.X_AB,
                         {.reach = query.reach,
                          .noise = query.noise,
                          .only_outside = true,
                          .sine = options.cone_tolerance});
    FeaturePairs(query, found).add_boxes(near);
    return true;
  }
  if (!NearFeatures::serves(query.a.mesh) || !NearFeatures::serves(query.b.mesh)) return false;
  const RigidPose at_origin;
  NearFeatures of_a(*query.a.mesh, at_origin);
  NearFeatures of_b(*query.b.mesh, query.X_AB);
  const NearSearch search =
      distance_internal::find_near_features(a, b, query.X_AB, query.reach, query.noise, of_a, of_b);
  if (search == NearSearch::Found) FeaturePairs(query, found).add_convex(of_a, of_b);
  return search != NearSearch::Unserved;
}

namespace {

// Whether the surface of `mesh` admits the normal at the foot of a smooth core's nearest point on
// this triangle. Everything is in the mesh's frame, the normal points outwards.
bool admits_smooth(const ContactQuery& query, const ContactSurface& mesh, std::int32_t triangle,
                   const Vector3& p_other, const Vector3& n, Scalar sine, FeatureKey& key) {
  const std::optional<TriangleFoot> foot =
      find_foot(mesh.mesh->triangle(triangle), p_other, kInfinity, query.options.border_tolerance,
                query.noise);
  if (!foot) return false;
  key = mesh.foot_key(triangle, *foot);
  return mesh.admits_at_foot(triangle, *foot, foot->point, n, sine, query.noise);
}

// Two shapes of which one has a smooth core.
class SmoothPair {
 public:
  SmoothPair(const ContactQuery& query, const Shape& a, const Shape& b)
      : query_(query),
        is_of_b_(as_half_space(b) || (query.b.is_mesh && !as_half_space(a))),
        tree_a_(a, extent_beside(a, b, query.X_AB.translation().norm())),
        tree_b_(b, extent_beside(b, a, query.X_AB.translation().norm())) {}

  const ShapeTree& tree_a() const { return tree_a_; }
  const ShapeTree& tree_b() const { return tree_b_; }
  void add(std::int32_t leaf_a, std::int32_t leaf_b, std::vector<FoundContact>& found) const;

 private:
  FacingPart part(bool of_a, std::int32_t leaf, const Vector3& n) const;
  bool add_flat(std::int32_t leaf_a, std::int32_t leaf_b, const PieceDistance& piece,
                std::vector<FoundContact>& found) const;
  bool admits(std::int32_t leaf_a, std::int32_t leaf_b, FoundContact& contact) const;

  const ContactQuery& query_;
  const bool is_of_b_;  // the normal of nearest points
  ShapeTree tree_a_;
  ShapeTree tree_b_;
};

// What faces along n, which is from A to B or back.
FacingPart SmoothPair::part(bool of_a, std::int32_t leaf, const Vector3& n) const {
  const ContactSurface& surface = of_a ? query_.a : query_.b;
  const RigidPose X_AS = of_a ? RigidPose() : query_.X_AB;
  const Scalar sine = query_.options.cone_tolerance;
  if (surface.is_mesh) {
    return facing_part(surface, (of_a ? tree_a_ : tree_b_).triangle(leaf), X_AS, n, sine);
  }
  const ConvexShape& convex = *(of_a ? tree_a_ : tree_b_).convex();
  FacingPart part = facing_part(convex, X_AS, n, sine, query_.noise);
  // A half-space has no middle but below the other shape.
  if (as_half_space(convex) && part.kind == FacingPart::Kind::Disc) {
    const Vector3 p = of_a ? query_.X_AB.translation() : Vector3::Zero();
    part.center = p - part.normal * part.normal.dot(p - part.center);
  }
  return part;
}

// Returns whether the nearest points need no contact of their own.
bool SmoothPair::add_flat(std::int32_t leaf_a, std::int32_t leaf_b, const PieceDistance& piece,
                          std::vector<FoundContact>& found) const {
  const bool a_is_smooth = query_.a.mesh == nullptr;
  const Vector3 n = a_is_smooth ? piece.nhat_AB : Vector3(-piece.nhat_AB);
  const std::int32_t leaf = a_is_smooth ? leaf_a : leaf_b;
  const std::int32_t other_leaf = a_is_smooth ? leaf_b : leaf_a;
  FacingPart smooth = part(a_is_smooth, leaf, n);
  if (smooth.kind == FacingPart::Kind::None) return false;
  const FacingPart other =
      part(!a_is_smooth, other_leaf, smooth.has_area() ? Vector3(-smooth.normal) : Vector3(-n));
  // For a side take the line that faces the other's face, not the one that faces its nearest point.
  if (!smooth.has_area() && other.has_area()) smooth = part(a_is_smooth, leaf, -other.normal);
  return add_flat_contacts(query_, a_is_smooth ? smooth : other, a_is_smooth ? other : smooth,
                           piece, found);
}

// The normal of a flat part is that of a face, which may lean against what lies on it.
bool SmoothPair::admits(std::int32_t leaf_a, std::int32_t leaf_b, FoundContact& contact) const {
  const bool is_flat = contact.key.a.number > 0;
  const Scalar sine = is_flat ? query_.options.cone_tolerance : query_.options.border_tolerance;
  if (query_.a.is_mesh) {
    contact.triangle_a = tree_a_.triangle(leaf_a);
    if (!admits_smooth(query_, query_.a, contact.triangle_a, contact.p_b, contact.normal, sine,
                       contact.key.a)) {
      return false;
    }
  }
  if (!query_.b.is_mesh) return true;
  contact.triangle_b = tree_b_.triangle(leaf_b);
  return admits_smooth(query_, query_.b, contact.triangle_b, query_.X_BA * contact.p_a,
                       -(query_.X_BA.rotation() * contact.normal), sine, contact.key.b);
}

void SmoothPair::add(std::int32_t leaf_a, std::int32_t leaf_b,
                     std::vector<FoundContact>& found) const {
  const PieceDistance piece =
      piece_distance(tree_a_, leaf_a, tree_b_, leaf_b, query_.X_AB, query_.noise);
  if (piece.is_overlapping || piece.lower > query_.reach) return;
  const std::size_t first = found.size();
  if (!add_flat(leaf_a, leaf_b, piece, found)) {
    FoundContact contact;
    contact.p_a = piece.p_a;
    contact.p_b = piece.p_b;
    contact.normal = piece.nhat_AB;
    contact.lower = piece.lower;
    contact.upper = piece.upper;
    contact.normal_is_of_b = is_of_b_;
    found.push_back(contact);
  }
  std::size_t kept = first;
  for (std::size_t k = first; k < found.size(); ++k) {
    if (admits(leaf_a, leaf_b, found[k])) found[kept++] = found[k];
  }
  found.resize(kept);
}

}  // namespace

void search_surfaces(const ContactQuery& query, BoxPairStack& stack,
                     std::vector<FoundContact>& found) {
  FeaturePairs pairs(query, found);
  const auto is_wanted = [](std::int32_t /*box_a*/) { return true; };
  visit_near_triangles(
      query, stack, is_wanted,
      [&](std::int32_t /*leaf_a*/, std::int32_t triangle_a, std::int32_t triangle_b) {
        Triangle b = query.b.mesh->triangle(triangle_b);
        for (Vector3& vertex : b) vertex = query.X_AB * vertex;
        pairs.add_triangles(triangle_a, query.a.mesh->triangle(triangle_a), triangle_b, b);
      });
}

void search_smooth(const ContactQuery& query, const Shape& a, const Shape& b, BoxPairStack& stack,
                   std::vector<FoundContact>& found) {
  const SmoothPair pair(query, a, b);
  const auto visit = [&](std::int32_t leaf_a, std::int32_t leaf_b) {
    pair.add(leaf_a, leaf_b, found);
  };
  visit_near_leaves(
      pair.tree_a(), pair.tree_b(), query, stack, [](const BoxPair&) { return true; }, visit);
}

namespace {

// More would take longer than the tree.
constexpr std::size_t kMostTriangles = 24;

// A convex shape's triangles, in its frame.
class SmallSurface {
 public:
  explicit SmallSurface(const TriangleMesh& mesh);

  // Calls visit(leaf) for all triangles that may be at most `reach` from t.
  template <typename Visit>
  void visit_near(const Triangle& t, Scalar reach, const Visit& visit);

 private:
  using Row = std::array<Scalar, kMostTriangles>;

  void find_near_boxes(const Triangle& t, Scalar reach);

  std::size_t count_ = 0;
  std::array<std::int32_t, kMostTriangles> leaves_;
  std::array<Triangle, kMostTriangles> triangles_;
  std::array<Row, 3> low_, high_;  // their bounds along the axes
  Row distance_sq_;                // of their bounds to those of t
};

SmallSurface::SmallSurface(const TriangleMesh& mesh) {
  const ShapeTree tree(mesh);
  std::array<std::int32_t, kMostTriangles + BoxGroup::kWidth> open;
  std::size_t open_count = 0;
  open[open_count++] = ShapeTree::kRoot;
  while (open_count > 0) {
    const std::int32_t box = open[--open_count];
    if (!tree.is_leaf(box)) {
      const std::int32_t child = tree.child(box);
      for (int column = tree.node(child).count() - 1; column >= 0; --column) {
        open[open_count++] = ShapeTree::box_number(child, column);
      }
      continue;
    }
    const Triangle t = mesh.triangle(tree.triangle(box));
    leaves_[count_] = box;
    triangles_[count_] = t;
    for (Eigen::Index k = 0; k < 3; ++k) {
      const auto row = std::size_t(k);
      low_[row][count_] = std::min(std::min(t[0][k], t[1][k]), t[2][k]);
      high_[row][count_] = std::max(std::max(t[0][k], t[1][k]), t[2][k]);
    }
    ++count_;
  }
}

void SmallSurface::find_near_boxes(const Triangle& t, Scalar reach) {
  std::fill_n(distance_sq_.begin(), count_, 0);
  for (Eigen::Index k = 0; k < 3; ++k) {
    const Scalar low = std::min(std::min(t[0][k], t[1][k]), t[2][k]);
    const Scalar high = std::max(std::max(t[0][k], t[1][k]), t[2][k]);
    const Row& lows = low_[std::size_t(k)];
    const Row& highs = high_[std::size_t(k)];
    for (std::size_t i = 0; i < count_; ++i) {
      const Scalar away = std::max(std::max(lows[i] - high, low - highs[i]), Scalar{0});
      distance_sq_[i] += away * away;
    }
  }
  for (std::size_t i = 0; i < count_; ++i) {
    if (distance_sq_[i] > reach * reach) distance_sq_[i] = kInfinity;
  }
}

template <typename Visit>
void SmallSurface::visit_near(const Triangle& t, Scalar reach, const Visit& visit) {
  find_near_boxes(t, reach);
  // Beyond the sides of t. Its plane leaves out little of what its bounds do not.
  const Vector3 normal = (t[1] - t[0]).cross(t[2] - t[0]);
  std::array<Vector3, 3> outwards;
  std::array<Scalar, 3> limits;
  for (std::size_t k = 0; k < 3; ++k) {
    const Vector3& n = outwards[k] = (t[(k + 1) % 3] - t[k]).cross(normal);
    limits[k] = std::max(std::max(n.dot(t[0]), n.dot(t[1])), n.dot(t[2])) + reach * n.norm();
  }
  for (std::size_t i = 0; i < count_; ++i) {
    if (distance_sq_[i] == kInfinity) continue;
    const Triangle& own = triangles_[i];
    bool is_beyond = false;
    for (std::size_t k = 0; k < 3 && !is_beyond; ++k) {
      const Vector3& n = outwards[k];
      is_beyond =
          n.dot(own[0]) > limits[k] && n.dot(own[1]) > limits[k] && n.dot(own[2]) > limits[k];
    }
    if (!is_beyond) visit(leaves_[i]);
  }
}

bool is_small(const ContactSurface& surface) {
  return surface.is_solid && !surface.is_mesh && surface.mesh->triangles().size() <= kMostTriangles;
}

}  // namespace

bool has_small_surface(const ContactQuery& query) {
  return query.a.is_mesh != query.b.is_mesh && is_small(query.a.is_mesh ? query.b : query.a);
}

void split_small_surface(const ContactQuery& query, BoxPairStack& pairs) {
  pairs.clear();
  const bool is_mesh_a = query.a.is_mesh;
  SmallSurface small(is_mesh_a ? *query.b.mesh : *query.a.mesh);
  const TriangleMesh& mesh = is_mesh_a ? *query.a.mesh : *query.b.mesh;
  const ShapeTree tree(mesh);
  const RigidPose& X_SM = is_mesh_a ? query.X_BA : query.X_AB;
  for (const BoxPair& pair : query.first_pairs) {
    Triangle t = mesh.triangle(tree.triangle(is_mesh_a ? pair.a : pair.b));
    for (Vector3& corner : t) corner = X_SM * corner;
    small.visit_near(t, query.reach + query.noise, [&](std::int32_t leaf) {
      pairs.push_back(is_mesh_a ? BoxPair{pair.gap, pair.a, leaf}
                                : BoxPair{pair.gap, leaf, pair.b});
    });
  }
}

namespace {

// Duplicates: contacts found twice at one place, by rounding or the tolerance at triangle borders.
class DoubleRemoval {
 public:
  DoubleRemoval(const ContactQuery& query, const std::vector<FoundContact>& found)
      : query_(query), window_(spread_of_doubles(query, query.reach)), found_(found) {}

  // Puts the numbers of those that are kept into `order`, by their keys.
  void run(std::vector<std::uint32_t>& order, std::vector<char>& is_double) const;

 private:
  bool is_same_place(const FoundContact& x, const FoundContact& y) const {
    constexpr Scalar kSameNormal = 0.999;  // cosine of 2.6 degrees
    const Scalar apart = spread_of_doubles(query_, std::max(x.upper, y.upper));
    return (x.p_a - y.p_a).squaredNorm() <= apart * apart &&
           (x.p_b - y.p_b).squaredNorm() <= apart * apart && x.normal.dot(y.normal) >= kSameNormal;
  }

  bool is_better(const FoundContact& x, const FoundContact& y) const;

  const ContactQuery& query_;
  const Scalar window_;
  const std::vector<FoundContact>& found_;
};

// Decides between two at one place: on a finely faceted surface the tolerance reaches over several
// facets, and only the nearest has the surface's normal there. Two triangles with the same edge may
// both give it as the foot of a vertex; in whatever order they were visited, the same one counts.
bool DoubleRemoval::is_better(const FoundContact& x, const FoundContact& y) const {
  const Scalar unit = 8 * query_.noise;  // distances that rounding may swap are the same
  const Scalar x_upper = std::floor(x.upper / unit);
  const Scalar y_upper = std::floor(y.upper / unit);
  return std::tie(x.rank, x_upper, x.key, x.triangle_a, x.triangle_b) <
         std::tie(y.rank, y_upper, y.key, y.triangle_a, y.triangle_b);
}

// Marks the worse of any two contacts at one place; sweeps along x. Sorts numbers, as contacts are
// large.
void DoubleRemoval::run(std::vector<std::uint32_t>& order, std::vector<char>& is_double) const {
  order.resize(found_.size());
  std::iota(order.begin(), order.end(), std::uint32_t{0});
  std::sort(order.begin(), order.end(), [this](std::uint32_t i, std::uint32_t j) {
    const FoundContact& x = found_[i];
    const FoundContact& y = found_[j];
    return std::tie(x.p_a.x(), x.rank, x.key, x.triangle_a, x.triangle_b) <
           std::tie(y.p_a.x(), y.rank, y.key, y.triangle_a, y.triangle_b);
  });
  is_double.assign(order.size(), 0);
  for (std::size_t i = 0; i < order.size(); ++i) {
    const FoundContact& x = found_[order[i]];
    for (std::size_t j = i + 1; j < order.size(); ++j) {
      const FoundContact& y = found_[order[j]];
      if (y.p_a.x() - x.p_a.x() > window_) break;
      if (is_same_place(x, y)) is_double[is_better(x, y) ? j : i] = 1;
    }
  }
  std::size_t kept = 0;
  for (std::size_t i = 0; i < order.size(); ++i) {
    if (!is_double[i]) order[kept++] = order[i];
  }
  order.resize(kept);
  std::sort(order.begin(), order.end(),
            [this](std::uint32_t i, std::uint32_t j) { return found_[i].key < found_[j].key; });
}

// Translates a feature into the shape's own vertex numbers.
Feature named_feature(const ContactSurface& surface, const FeatureKey& key) {
  switch (key.kind) {
    case FeatureKind::Vertex:
      return {key.kind, {key.number}};
    case FeatureKind::Edge: {
      const auto& ends = surface.topology->edge(key.number);
      return {key.kind, {ends[0], ends[1]}};
    }
    case FeatureKind::Face:
      return {key.kind, surface.indices(key.number)};
    case FeatureKind::Smooth:
      break;
  }
  return {};
}

// Adds the rounding radii of the cores, and transforms to world.
void finish(const ContactQuery& query, const RigidPose& X_WA, const FoundContact& found,
            ContactPoint& contact) {
  const Scalar radii = query.a.radius + query.b.radius;
  const Matrix3& R_WA = X_WA.rotation();
  contact.p_ACa = found.p_a + query.a.radius * found.normal;
  const Vector3 p_ACb = found.p_b - query.b.radius * found.normal;
  contact.p_BCb = query.X_BA * p_ACb;
  contact.p_WCa = X_WA * contact.p_ACa;
  contact.p_WCb = X_WA * p_ACb;
  contact.nhat_AB_W = R_WA * found.normal;
  contact.gap = found.normal.dot(found.p_b - found.p_a) - radii;
  contact.lower = std::max(Scalar{0}, found.lower - radii);
  contact.upper = std::max(contact.lower, found.upper - radii);
  contact.normal_is_of_b = found.normal_is_of_b;
  contact.nhat_AB_S =
      found.normal_is_of_b ? Vector3(query.X_BA.rotation() * found.normal) : found.normal;
  contact.key = found.key;
  contact.feature_a = named_feature(query.a, found.key.a);
  contact.feature_b = named_feature(query.b, found.key.b);
  if (query.a.is_mesh) contact.triangle_a = found.triangle_a;
  if (query.b.is_mesh) contact.triangle_b = found.triangle_b;
}

}  // namespace

ContactQuery contact_query(const ContactSurface& surface_a, const Shape& a, const RigidPose& X_WA,
                           const ContactSurface& surface_b, const Shape& b, const RigidPose& X_WB,
                           Scalar reach, const ContactGeneratorOptions& options) {
  ContactQuery query{surface_a, surface_b, X_WA.inverse() * X_WB, {}, 0, 0, options};
  query.X_BA = query.X_AB.inverse();
  query.reach = reach + surface_a.radius + surface_b.radius;
  // The noise of the poses, and as much again for what is computed from posed points.
  query.noise = 2 * pose_noise(a, X_WA, b, X_WB);
  if (options.region) {
    const Vector3 center_A = X_WA.inverse() * options.region->center_W;
    const Scalar radius = options.region->radius + surface_a.radius + query.noise;
    query.place = {center_A, query.X_BA * center_A, radius};
  }
  return query;
}

void expect(const ExpectedApproach& approach, const RigidPose& X_WA, Scalar radii,
            ContactQuery& query) {
  const RigidPose X_AW = X_WA.inverse();
  ExpectedApproach& approach_A = query.approach_A.emplace(approach);
  approach_A.least += radii;
  approach_A.reach += radii;
  approach_A.v_W = X_AW.rotation() * approach.v_W;
  approach_A.w_W = X_AW.rotation() * approach.w_W;
  approach_A.origin_W = X_AW * approach.origin_W;
}

Scalar spread_of_doubles(const ContactQuery& query, Scalar distance) {
  return 2 * query.options.border_tolerance * distance + 8 * query.noise;
}

bool list_neighbours(ContactWorkspace& workspace, const Shape& a, const RigidPose& X_WA,
                     const Shape& b, const RigidPose& X_WB, Scalar reach) {
  NeighbourList* neighbours = workspace.impl().neighbours;
  if (!neighbours || !neighbours->is_built()) return false;
  const auto placement = neighbours->place(a, X_WA, b, X_WB);
  if (!neighbours->covers(placement, {reach})) return false;
  neighbours->collect(a, b, placement, {reach}, workspace.impl().first_pairs);
  return true;
}

void finish_contacts(const ContactQuery& query, const RigidPose& X_WA,
                     const std::vector<FoundContact>& found, ContactWorkspace& workspace,
                     std::vector<ContactPoint>& contacts, std::int32_t piece_a,
                     std::int32_t piece_b) {
  std::vector<std::uint32_t>& order = workspace.impl().order;
  DoubleRemoval(query, found).run(order, workspace.impl().is_double);
  const std::optional<ContactRegion>& region = query.options.region;
  const auto is_wanted = [&](const ContactPoint& contact) {
    return !region ||
           (contact.p_WCa - region->center_W).squaredNorm() <= region->radius * region->radius;
  };
  for (const std::uint32_t number : order) {
    ContactPoint& contact = contacts.emplace_back();
    finish(query, X_WA, found[number], contact);
    contact.key.a.piece = piece_a;
    contact.key.b.piece = piece_b;
    if (!is_wanted(contact)) contacts.pop_back();
  }
}

}  // namespace dyop::contact_internal
