// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <tuple>
#include <unordered_map>
#include <vector>

#include "core/tolerance.h"
#include "distance/distance_traversal.h"
#include "distance/near_boxes.h"
#include "distance/near_features.h"
#include "distance/near_parts.h"
#include "distance/piece_distance.h"
#include "distance/point_search.h"
#include "dyop/core/error.h"
#include "dyop/core/types.h"
#include "dyop/distance/distance.h"
#include "dyop/distance/gjk.h"
#include "dyop/distance/triangle_distance.h"
#include "geometry/box_surface.h"
#include "geometry/compound_tree.h"
#include "geometry/shape_tree.h"
#include "hierarchy/box_gaps.h"

namespace dyop::distance_internal {

/// Numbered points in cubic cells, for finding points near each other.
class PointGrid {
 public:
  explicit PointGrid(Scalar cell_size)
      : cell_size_(std::max(cell_size, std::numeric_limits<Scalar>::min())) {}

  void add(const Vector3& p, std::size_t number) { cells_[cell_of(p, 0, 0, 0)].push_back(number); }

  /// Whether a point for which `is_sought(number)` is true lies in the cell of p or a neighbouring
  /// one. It is called for at least every point within one cell size of p.
  template <typename Predicate>
  bool any_near(const Vector3& p, const Predicate& is_sought) const {
    for (int dx = -1; dx <= 1; ++dx) {
      for (int dy = -1; dy <= 1; ++dy) {
        for (int dz = -1; dz <= 1; ++dz) {
          const auto cell = cells_.find(cell_of(p, dx, dy, dz));
          if (cell == cells_.end()) continue;
          if (std::any_of(cell->second.begin(), cell->second.end(), is_sought)) return true;
        }
      }
    }
    return false;
  }

 private:
  using Cell = std::tuple<std::int64_t, std::int64_t, std::int64_t>;
  struct CellHash {
    std::size_t operator()(const Cell& cell) const {
      // Unsigned, because the products may wrap.
      const auto mix = [](std::int64_t index, std::uint64_t prime) {
        return static_cast<std::uint64_t>(index) * prime;
      };
      const auto [x, y, z] = cell;
      return static_cast<std::size_t>(mix(x, 73856093) ^ mix(y, 19349663) ^ mix(z, 83492791));
    }
  };

  Cell cell_of(const Vector3& p, int dx, int dy, int dz) const {
    const auto index = [&](Scalar x, int shift) {
      // literal: beyond 2^52 cells neighbouring cells are the same number; clamp for the cast.
      return static_cast<std::int64_t>(std::clamp(std::floor(x / cell_size_), -4e15, 4e15)) + shift;
    };
    return Cell(index(p.x(), dx), index(p.y(), dy), index(p.z(), dz));
  }

  Scalar cell_size_;
  std::unordered_map<Cell, std::vector<std::size_t>, CellHash> cells_;
};

}  // namespace dyop::distance_internal

namespace dyop {
namespace {

using geometry_internal::kBoxEdges;
using geometry_internal::ShapeTree;

// The surface of a shape's core as a mesh, and the radius around it. A smooth core has no surface.
struct CoreSurface {
  explicit CoreSurface(const Shape& shape) {
    if (shape.kind() == ShapeKind::TriangleMesh) {
      mesh = static_cast<const TriangleMesh*>(&shape);
      is_mesh = true;
    } else {
      const auto& convex = static_cast<const ConvexShape&>(shape);
      mesh = convex.core_surface();
      radius = convex.rounding_radius();
    }
  }
  const TriangleMesh* mesh = nullptr;
  Scalar radius = 0;
  bool is_mesh = false;
};

// A mesh or convex shape that a shape consists of, in the shape's frame.
struct ContactPart {
  const Shape& shape;
  std::optional<std::int32_t> child;
};

ContactPart part_of(const Shape& shape, std::int32_t number) {
  if (shape.kind() != ShapeKind::Compound) return {shape, std::nullopt};
  return {geometry_internal::shape_part(shape, number), number};
}

// What is left of the limits of a search.
class ContactBudget {
 public:
  explicit ContactBudget(const ContactSearchLimits& limits) : limits_(limits) {}

  void count_box_pair() {
    constexpr std::int64_t kPatience = 1024;  // box pairs between two looks at the stop token
    if (++box_pairs_ % kPatience == 0 && limits_.stop.stop_requested()) is_spent_ = true;
  }
  void count_triangle_pair() {
    if (++triangle_pairs_ > limits_.max_triangle_pairs) is_spent_ = true;
  }
  bool is_spent() const { return is_spent_; }

 private:
  const ContactSearchLimits& limits_;
  std::int64_t box_pairs_ = 0;
  std::int64_t triangle_pairs_ = 0;
  bool is_spent_ = false;
};

// A triangle of one of the two surfaces, in frame A.
struct PlacedTriangle {
  std::int32_t number;
  Triangle corners;
};

// A vertex of one of the two surfaces, in frame A, and a triangle at it.
struct PlacedVertex {
  std::int32_t number;
  std::int32_t triangle;
  Vector3 p;
};

// Likewise an edge, as a side of a triangle.
struct PlacedEdge {
  std::array<std::int32_t, 2> ends;
  std::int32_t triangle;
  Vector3 from;
  Vector3 along;
  bool is_inner;  // joins two coplanar triangles
};

// Collects the contacts of two triangle surfaces in frame A.
class ContactGathering {
 public:
  ContactGathering(const CoreSurface& a, const CoreSurface& b, const RigidPose& X_AB, Scalar noise,
                   Scalar max_distance, ContactBudget& budget)
      : a_(a), b_(b), X_AB_(X_AB), noise_(noise), max_distance_(max_distance), budget_(budget) {}

  /// Of the two shapes that have these surfaces.
  void run(const Shape& a, const Shape& b);
  std::vector<Contact> contacts;  // points and normals still in frame A

 private:
  // All pairs of triangles within reach, by the trees of the surfaces.
  void run_triangles();
  // The same for two convex polytopes, from the few features that are near; false: not served.
  bool run_convex(const ConvexShape& a, const ConvexShape& b);
  // Likewise for two boxes.
  bool run_boxes(const ConvexShape& a, const ConvexShape& b);
  bool are_apart(const ConvexShape& a, const ConvexShape& b) const;
  void add_triangle_pair(std::int32_t triangle_a, std::int32_t triangle_b);
  void add_crossing(const PlacedTriangle& a, const PlacedTriangle& b, const TriangleDistance& d);
  void add_vertex(bool of_a, const PlacedVertex& vertex, const PlacedTriangle& triangle);
  void add_edges(const PlacedEdge& a, const PlacedEdge& b);
  void add(const NearestPoints& cores, std::int32_t triangle_a, std::int32_t triangle_b,
           std::vector<Contact>& list);
  PlacedTriangle placed(bool of_a, std::int32_t triangle) const;
  PlacedEdge edge_of(bool of_a, const PlacedTriangle& triangle, std::size_t k) const;
  Scalar reach() const { return max_distance_ + a_.radius + b_.radius; }

  const CoreSurface& a_;
  const CoreSurface& b_;
  const RigidPose& X_AB_;
  Scalar noise_;
  Scalar max_distance_;
  ContactBudget& budget_;
  std::vector<Contact> inner_contacts_;  // of edges inside a flat area
  bool are_far_ = false;                 // farther apart than is sought, by run_convex()
};

// Adds the witness pair of two features, given without the radii, if it is near enough.
void ContactGathering::add(const NearestPoints& cores, std::int32_t triangle_a,
                           std::int32_t triangle_b, std::vector<Contact>& list) {
  const Scalar radii = a_.radius + b_.radius;
  if (cores.lower - noise_ - radii > max_distance_) return;
  Contact contact;
  contact.nhat_AB_W = cores.nhat_AB;
  contact.p_WCa = cores.p_a + a_.radius * cores.nhat_AB;
  contact.p_WCb = cores.p_b - b_.radius * cores.nhat_AB;
  contact.lower = std::max(0.0, cores.lower - radii - noise_);
  contact.upper = std::max(0.0, cores.upper - radii) + noise_;
  contact.feature_a = cores.feature_a;
  contact.feature_b = cores.feature_b;
  if (a_.is_mesh) contact.triangle_a = triangle_a;
  if (b_.is_mesh) contact.triangle_b = triangle_b;
  list.push_back(contact);
}

void ContactGathering::add_vertex(bool of_a, const PlacedVertex& vertex,
                                  const PlacedTriangle& triangle) {
  const distance_internal::PointTriangleDistance d =
      distance_internal::point_triangle_distance(vertex.p, triangle.corners);
  if (d.lower - noise_ > reach()) return;
  const CoreSurface& other = of_a ? b_ : a_;
  const Feature corner{FeatureKind::Vertex, {vertex.number}};
  const Feature face{FeatureKind::Face, other.mesh->triangles()[std::size_t(triangle.number)]};
  NearestPoints found;
  found.lower = d.lower;
  found.upper = d.upper;
  found.p_a = of_a ? vertex.p : d.p_C;
  found.p_b = of_a ? d.p_C : vertex.p;
  found.nhat_AB = of_a ? Vector3(-d.nhat_C) : d.nhat_C;
  found.feature_a = of_a ? corner : face;
  found.feature_b = of_a ? face : corner;
  add(found, of_a ? vertex.triangle : triangle.number, of_a ? triangle.number : vertex.triangle,
      contacts);
}

// Counts only if both witness points are inside their edges: the ends are found as vertex-face
// pairs. The lower bound is the slab gap along the common normal; `noise_` covers the poses, and as
// much again what is computed here, of which each term is below 16u of the size.
void ContactGathering::add_edges(const PlacedEdge& a, const PlacedEdge& b) {
  const Vector3& e = a.along;
  const Vector3& f = b.along;
  const Vector3 r = b.from - a.from;
  const Vector3 n = e.cross(f);
  const Scalar n_sq = n.squaredNorm();
  const Scalar height = n.dot(r);
  const Scalar within = reach() + 2 * noise_;
  // literal: slightly farther than the reach; the bounds decide.
  if (height * height > 1.0625 * within * within * n_sq) return;
  const Scalar e_sq = e.squaredNorm();
  const Scalar f_sq = f.squaredNorm();
  if (!(n_sq > kContactNoCrossingSine * kContactNoCrossingSine * e_sq * f_sq)) return;
  const Scalar s = r.cross(f).dot(n) / n_sq;
  const Scalar t = r.cross(e).dot(n) / n_sq;
  if (!(s > 0 && s < 1 && t > 0 && t < 1)) return;
  const Scalar length = std::sqrt(n_sq);
  NearestPoints found;
  found.p_a = a.from + s * e;
  found.p_b = b.from + t * f;
  found.nhat_AB = height < 0 ? Vector3(n / -length) : Vector3(n / length);
  // From the ends, because rounding may have turned the normal.
  const Scalar along_a = found.nhat_AB.dot(e);
  const Scalar along_b = found.nhat_AB.dot(f);
  const Scalar gap = found.nhat_AB.dot(r) - std::max(0.0, along_a) + std::min(0.0, along_b);
  found.lower = std::max(0.0, gap - noise_);
  found.upper = (found.p_b - found.p_a).norm() + noise_;
  found.feature_a = {FeatureKind::Edge, {a.ends[0], a.ends[1]}};
  found.feature_b = {FeatureKind::Edge, {b.ends[0], b.ends[1]}};
  add(found, a.triangle, b.triangle, a.is_inner || b.is_inner ? inner_contacts_ : contacts);
}

// The point that two crossing triangles share.
void ContactGathering::add_crossing(const PlacedTriangle& a, const PlacedTriangle& b,
                                    const TriangleDistance& d) {
  NearestPoints found = d;
  found.feature_a = {FeatureKind::Face, a_.mesh->triangles()[std::size_t(a.number)]};
  found.feature_b = {FeatureKind::Face, b_.mesh->triangles()[std::size_t(b.number)]};
  add(found, a.number, b.number, contacts);
}

PlacedTriangle ContactGathering::placed(bool of_a, std::int32_t triangle) const {
  PlacedTriangle result{triangle, (of_a ? a_ : b_).mesh->triangle(triangle)};
  if (of_a) return result;
  for (Vector3& vertex : result.corners) vertex = X_AB_ * vertex;
  return result;
}

// Where another edge crosses it, an edge inside a flat area is not the border of the area.
PlacedEdge ContactGathering::edge_of(bool of_a, const PlacedTriangle& triangle,
                                     std::size_t k) const {
  const TriangleMesh& mesh = *(of_a ? a_ : b_).mesh;
  const TriangleIndices& t = mesh.triangles()[std::size_t(triangle.number)];
  const std::size_t next = k < 2 ? k + 1 : 0;
  const auto edge = mesh.topology().edge_of_side(3 * triangle.number + std::int32_t(k));
  return {{t[k], t[next]},
          triangle.number,
          triangle.corners[k],
          triangle.corners[next] - triangle.corners[k],
          edge && mesh.contact_features().edge_kind(*edge) == EdgeKind::Flat};
}

void ContactGathering::add_triangle_pair(std::int32_t triangle_a, std::int32_t triangle_b) {
  const PlacedTriangle a = placed(true, triangle_a);
  const PlacedTriangle b = placed(false, triangle_b);
  // Most pairs of neighbouring boxes are not in contact, so one test of the whole triangles first.
  const TriangleDistance d = triangle_distance(a.corners, b.corners);
  if (d.lower - noise_ > reach()) return;
  budget_.count_triangle_pair();
  if (d.is_overlapping) add_crossing(a, b, d);
  const TriangleIndices& indices_a = a_.mesh->triangles()[std::size_t(triangle_a)];
  const TriangleIndices& indices_b = b_.mesh->triangles()[std::size_t(triangle_b)];
  for (std::size_t k = 0; k < 3; ++k) {
    add_vertex(true, {indices_a[k], triangle_a, a.corners[k]}, b);
    add_vertex(false, {indices_b[k], triangle_b, b.corners[k]}, a);
  }
  const std::array<PlacedEdge, 3> edges_b{edge_of(false, b, 0), edge_of(false, b, 1),
                                          edge_of(false, b, 2)};
  for (std::size_t k = 0; k < 3; ++k) {
    const PlacedEdge edge = edge_of(true, a, k);
    for (const PlacedEdge& other : edges_b) add_edges(edge, other);
  }
}

bool ContactGathering::run_convex(const ConvexShape& a, const ConvexShape& b) {
  using distance_internal::NearFeatures;
  if (run_boxes(a, b)) return true;
  if (!NearFeatures::serves(a_.mesh) || !NearFeatures::serves(b_.mesh)) return false;
  const RigidPose at_origin;
  NearFeatures of_a(*a_.mesh, at_origin);
  NearFeatures of_b(*b_.mesh, X_AB_);
  const auto search =
      distance_internal::find_near_features(a, b, X_AB_, reach(), 2 * noise_, of_a, of_b);
  if (search != distance_internal::NearSearch::Found) {
    are_far_ = search == distance_internal::NearSearch::None;
    return are_far_;
  }
  contacts.reserve(16);
  for (const bool is_of_a : {true, false}) {
    const NearFeatures& own = is_of_a ? of_a : of_b;
    const NearFeatures& other = is_of_a ? of_b : of_a;
    for (std::size_t k = 0; k < other.triangle_count(); ++k) {
      if (!other.is_near(k)) continue;
      const PlacedTriangle triangle{other.triangle(k), other.corners(k)};
      for (const std::int32_t v : own.vertices()) {
        add_vertex(is_of_a, {v, -1, own.point(v)}, triangle);
      }
    }
  }
  const auto placed_edge = [&](bool of, const NearFeatures& near, std::int32_t side) {
    const TriangleIndices& t = (of ? a_ : b_).mesh->triangles()[std::size_t(side / 3)];
    return edge_of(of, {side / 3, {near.point(t[0]), near.point(t[1]), near.point(t[2])}},
                   std::size_t(side % 3));
  };
  std::array<PlacedEdge, NearFeatures::kMostSides> edges;
  std::size_t count = 0;
  for (const std::int32_t side : of_b.sides()) edges[count++] = placed_edge(false, of_b, side);
  for (const std::int32_t side : of_a.sides()) {
    const PlacedEdge edge = placed_edge(true, of_a, side);
    for (const PlacedEdge& other : std::span(edges).first(count)) add_edges(edge, other);
  }
  if (contacts.empty()) contacts = std::move(inner_contacts_);
  if (!contacts.empty()) budget_.count_triangle_pair();
  return true;
}

bool ContactGathering::run_boxes(const ConvexShape& a, const ConvexShape& b) {
  using distance_internal::NearBoxes;
  if (!NearBoxes::serves(a, a_.mesh, b, b_.mesh)) return false;
  const NearBoxes near(a, b, X_AB_, {.reach = reach(), .noise = 2 * noise_});
  are_far_ = !near.are_near();
  if (are_far_) return true;
  contacts.reserve(16);
  const distance_internal::BoxCorners corners(*a_.mesh, *b_.mesh, X_AB_);
  near.visit_vertices([&](bool of_a, std::size_t vertex, std::size_t triangle) {
    add_vertex(of_a, {std::int32_t(vertex), -1, corners.point(of_a, vertex)},
               {std::int32_t(triangle), corners.triangle(!of_a, triangle)});
  });
  const auto placed_edge = [&](bool of_a, std::size_t number) {
    const geometry_internal::BoxEdge& edge = kBoxEdges[number];
    const Vector3& from = corners.point(of_a, std::size_t(edge.from));
    const Vector3 along = corners.point(of_a, std::size_t(edge.to)) - from;
    return PlacedEdge{{edge.from, edge.to}, edge.side / 3, from, along, edge.is_diagonal()};
  };
  for (const NearBoxes::EdgePair& pair : near.edge_pairs()) {
    add_edges(placed_edge(true, pair.a), placed_edge(false, pair.b));
  }
  // Edges inside a flat area count only if nothing else does.
  for (std::size_t k = 0; contacts.empty() && k < kBoxEdges.size(); ++k) {
    const PlacedEdge edge = placed_edge(true, k);
    for (std::size_t m = 0; m < kBoxEdges.size(); ++m) {
      if (edge.is_inner || kBoxEdges[m].is_diagonal()) add_edges(edge, placed_edge(false, m));
    }
  }
  if (contacts.empty()) contacts = std::move(inner_contacts_);
  if (!contacts.empty()) budget_.count_triangle_pair();
  return true;
}

// Of solids that overlap only triangles that cross tell so.
void ContactGathering::run(const Shape& a, const Shape& b) {
  if (!distance_internal::are_convex(a, b)) return run_triangles();
  const auto& convex_a = static_cast<const ConvexShape&>(a);
  const auto& convex_b = static_cast<const ConvexShape&>(b);
  if (run_convex(convex_a, convex_b) && are_apart(convex_a, convex_b)) return;
  contacts.clear();
  inner_contacts_.clear();
  run_triangles();
}

// Whether the cores are, after run_convex(). Mostly the normal of a contact proves it.
bool ContactGathering::are_apart(const ConvexShape& a, const ConvexShape& b) const {
  if (are_far_) return true;
  const auto proves_it = [&](const Contact& contact) {
    const Vector3& n = contact.nhat_AB_W;
    const Vector3 p_b = X_AB_ * b.core_support(-(X_AB_.rotation().transpose() * n)).point;
    return n.dot(p_b - a.core_support(n).point) > 4 * noise_;
  };
  if (std::any_of(contacts.begin(), contacts.end(), proves_it)) return true;
  return !gjk_distance(a, b, X_AB_).is_overlapping;
}

void ContactGathering::run_triangles() {
  const ShapeTree tree_a(*a_.mesh);
  const ShapeTree tree_b(*b_.mesh);
  const RigidPose X_BA = X_AB_.inverse();
  const auto box_gaps = hierarchy_internal::box_gaps_kernel(core_internal::best_instruction_set());
  std::vector<std::pair<std::int32_t, std::int32_t>> stack{{ShapeTree::kRoot, ShapeTree::kRoot}};
  while (!stack.empty() && !budget_.is_spent()) {
    const auto [box_a, box_b] = stack.back();
    stack.pop_back();
    budget_.count_box_pair();
    if (tree_a.is_leaf(box_a) && tree_b.is_leaf(box_b)) {
      add_triangle_pair(tree_a.triangle(box_a), tree_b.triangle(box_b));
      continue;
    }
    const bool opens_a = geometry_internal::opens_first(tree_a, box_a, tree_b, box_b);
    const ShapeTree& tree = opens_a ? tree_a : tree_b;
    const std::int32_t child = tree.child(opens_a ? box_a : box_b);
    const int count = tree.node(child).count();
    std::array<Scalar, BoxGroup::kWidth> gaps;
    box_gaps(tree.rows(child), count,
             opens_a ? geometry_internal::facing_box(tree_b.box(box_b), X_AB_)
                     : geometry_internal::facing_box(tree_a.box(box_a), X_BA),
             noise_ * (kStepNoise / kPoseNoise), gaps.data());
    for (int column = count - 1; column >= 0; --column) {
      if (gaps[std::size_t(column)] > reach()) continue;
      const std::int32_t part = ShapeTree::box_number(child, column);
      stack.emplace_back(opens_a ? part : box_a, opens_a ? box_b : part);
    }
  }
  // Flatness has a tolerance: if the area's border is just out of reach, its inner edges count.
  if (contacts.empty()) contacts = std::move(inner_contacts_);
}

// How far apart, on either body, witness points of one place may be: in a right triangle with a gap
// of at most `max_distance` as hypotenuse, the substeps are the least gap and the distance along
// the surface.
Scalar place_radius(Scalar least_gap, Scalar max_distance) {
  return std::sqrt(std::max(0.0, max_distance - least_gap) * (max_distance + least_gap));
}

// Keeps the nearest contact of each place: drops those within `radius` of one already kept, on both
// bodies and with nearly its normal. Contacts must be sorted. Among many a grid of cells of that
// size finds neighbours.
std::vector<Contact> one_per_place(const std::vector<Contact>& contacts, Scalar radius) {
  constexpr Scalar kSameNormal = 0.99;  // cosine of 8 degrees
  constexpr std::size_t kFew = 32;
  std::vector<Contact> kept;
  kept.reserve(std::min(contacts.size(), kFew));
  const auto is_same_place = [&](const Contact& x, const Contact& y) {
    return (x.p_WCa - y.p_WCa).norm() <= radius && (x.p_WCb - y.p_WCb).norm() <= radius &&
           x.nhat_AB_W.dot(y.nhat_AB_W) >= kSameNormal;
  };
  if (contacts.size() <= kFew) {
    for (const Contact& contact : contacts) {
      const bool is_new = std::none_of(kept.begin(), kept.end(), [&](const Contact& other) {
        return is_same_place(other, contact);
      });
      if (is_new) kept.push_back(contact);
    }
    return kept;
  }
  distance_internal::PointGrid grid(radius);
  for (const Contact& contact : contacts) {
    const bool is_known = grid.any_near(
        contact.p_WCa, [&](std::size_t other) { return is_same_place(kept[other], contact); });
    if (is_known) continue;
    grid.add(contact.p_WCa, kept.size());
    kept.push_back(contact);
  }
  return kept;
}

bool comes_first(const Contact& x, const Contact& y) {
  if (x.lower != y.lower) return x.lower < y.lower;
  const auto key = [](const Contact& c) {
    return std::make_tuple(c.p_WCa.x(), c.p_WCa.y(), c.p_WCa.z(), c.p_WCb.x(), c.p_WCb.y(),
                           c.p_WCb.z(), c.feature_a.vertices, c.feature_b.vertices);
  };
  return key(x) < key(y);
}

// For cores without a surface: one contact, at the nearest points.
std::vector<Contact> nearest_contact(const ContactPart& a, const RigidPose& X_WA,
                                     const ContactPart& b, const RigidPose& X_WB,
                                     Scalar max_distance) {
  DistanceOptions options;
  options.max_distance = max_distance;
  const DistanceResult nearest = distance(a.shape, X_WA, b.shape, X_WB, options);
  if (nearest.status == DistanceStatus::FartherThanMaxDistance) return {};
  Contact contact;
  contact.p_WCa = nearest.p_WCa;
  contact.p_WCb = nearest.p_WCb;
  contact.nhat_AB_W = nearest.nhat_AB_W;
  contact.lower = nearest.lower;
  contact.upper = nearest.upper;
  contact.feature_a = nearest.feature_a;
  contact.feature_b = nearest.feature_b;
  contact.triangle_a = nearest.triangle_a;
  contact.triangle_b = nearest.triangle_b;
  contact.child_a = a.child;
  contact.child_b = b.child;
  return {contact};
}

// Merges both lists into one, sorted, in world.
std::vector<Contact> merged(std::vector<Contact> gathered_A, std::vector<Contact> nearest_W,
                            const RigidPose& X_WA, Scalar max_distance, Scalar noise) {
  if (gathered_A.empty()) {
    std::sort(nearest_W.begin(), nearest_W.end(), comes_first);
    return nearest_W;
  }
  std::sort(gathered_A.begin(), gathered_A.end(), comes_first);
  const Scalar radius = place_radius(gathered_A.front().lower, max_distance);
  std::vector<Contact> kept = one_per_place(gathered_A, radius + noise);
  for (Contact& contact : kept) {
    contact.p_WCa = X_WA * contact.p_WCa;
    contact.p_WCb = X_WA * contact.p_WCb;
    contact.nhat_AB_W = X_WA.rotation() * contact.nhat_AB_W;
  }
  if (nearest_W.empty()) return kept;
  kept.insert(kept.end(), nearest_W.begin(), nearest_W.end());
  std::sort(kept.begin(), kept.end(), comes_first);
  return kept;
}

}  // namespace

std::vector<Contact> find_contacts(const Shape& a, const RigidPose& X_WA, const Shape& b,
                                   const RigidPose& X_WB, Scalar max_distance) {
  return find_contacts(a, X_WA, b, X_WB, max_distance, ContactSearchLimits()).value();
}

std::optional<std::vector<Contact>> find_contacts(const Shape& a, const RigidPose& X_WA,
                                                  const Shape& b, const RigidPose& X_WB,
                                                  Scalar max_distance,
                                                  const ContactSearchLimits& limits) {
  DYOP_REQUIRE(limits.max_triangle_pairs >= 0,
               "find_contacts: max_triangle_pairs must be >= 0, not ", limits.max_triangle_pairs);
  DYOP_REQUIRE(max_distance >= 0 && max_distance < kInfinity,
               "find_contacts: max_distance must be finite and >= 0, not ", max_distance);
  const Scalar noise = distance_internal::pose_noise(a, X_WA, b, X_WB);
  const RigidPose X_AB = X_WA.inverse() * X_WB;
  ContactBudget budget(limits);
  std::vector<Contact> gathered;  // in frame A
  std::vector<Contact> nearest;   // in world, for parts without a surface
  distance_internal::BoxPairStack stack;
  std::vector<distance_internal::PartPair> parts;
  distance_internal::find_near_parts(a, X_WA, b, X_WB, noise, max_distance, stack, parts);
  for (const distance_internal::PartPair& pair : parts) {
    if (limits.stop.stop_requested()) return std::nullopt;
    const ContactPart part_a = part_of(a, pair.a);
    const ContactPart part_b = part_of(b, pair.b);
    const CoreSurface surface_a(part_a.shape);
    const CoreSurface surface_b(part_b.shape);
    if (!surface_a.mesh || !surface_b.mesh) {
      for (const Contact& contact : nearest_contact(part_a, X_WA, part_b, X_WB, max_distance)) {
        nearest.push_back(contact);
      }
      continue;
    }
    ContactGathering gathering(surface_a, surface_b, X_AB, noise, max_distance, budget);
    gathering.run(part_a.shape, part_b.shape);
    if (budget.is_spent() || limits.stop.stop_requested()) return std::nullopt;
    for (Contact& contact : gathering.contacts) {
      contact.child_a = part_a.child;
      contact.child_b = part_b.child;
    }
    if (gathered.empty()) {
      gathered = std::move(gathering.contacts);
    } else {
      gathered.insert(gathered.end(), gathering.contacts.begin(), gathering.contacts.end());
    }
  }
  return merged(std::move(gathered), std::move(nearest), X_WA, max_distance, 4 * noise);
}

}  // namespace dyop
