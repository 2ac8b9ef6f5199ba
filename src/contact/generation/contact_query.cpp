// SPDX-License-Identifier: BSD-3-Clause
#include "contact/generation/contact_query.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <tuple>

#include "distance/piece_distance.h"

namespace dyop::contact_internal {
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
  DoubleRemoval(const ContactQuery& query, std::vector<char>& is_double)
      : query_(query), window_(spread_of_doubles(query, query.reach)), is_double_(is_double) {}

  void run(std::vector<FoundContact>& found) const;

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
  std::vector<char>& is_double_;
};

// Of two at one place: on a finely faceted surface the tolerance reaches over several facets, and
// only the nearest has the surface's normal there. Two triangles with the same edge may both give
// it as the foot of a vertex; in whatever order they were visited, the same one counts.
bool DoubleRemoval::is_better(const FoundContact& x, const FoundContact& y) const {
  const Scalar unit = 8 * query_.noise;  // distances that rounding may swap are the same
  const Scalar x_upper = std::floor(x.upper / unit);
  const Scalar y_upper = std::floor(y.upper / unit);
  return std::tie(x.rank, x_upper, x.key, x.triangle_a, x.triangle_b) <
         std::tie(y.rank, y_upper, y.key, y.triangle_a, y.triangle_b);
}

// Marks the worse of any two contacts at one place; sweeps along x.
void DoubleRemoval::run(std::vector<FoundContact>& found) const {
  std::sort(found.begin(), found.end(), [](const FoundContact& x, const FoundContact& y) {
    return std::tie(x.p_a.x(), x.rank, x.key, x.triangle_a, x.triangle_b) <
           std::tie(y.p_a.x(), y.rank, y.key, y.triangle_a, y.triangle_b);
  });
  is_double_.assign(found.size(), 0);
  for (std::size_t i = 0; i < found.size(); ++i) {
    for (std::size_t j = i + 1; j < found.size(); ++j) {
      if (found[j].p_a.x() - found[i].p_a.x() > window_) break;
      if (!is_same_place(found[i], found[j])) continue;
      is_double_[is_better(found[i], found[j]) ? j : i] = 1;
    }
  }
  std::size_t kept = 0;
  for (std::size_t i = 0; i < found.size(); ++i) {
    if (!is_double_[i]) found[kept++] = found[i];
  }
  found.resize(kept);
  std::sort(found.begin(), found.end(),
            [](const FoundContact& x, const FoundContact& y) { return x.key < y.key; });
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
ContactPoint finished(const ContactQuery& query, const RigidPose& X_WA, const FoundContact& found) {
  ContactPoint contact;
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
  return contact;
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
                     std::vector<FoundContact>& found, ContactWorkspace& workspace,
                     std::vector<ContactPoint>& contacts, std::int32_t piece_a,
                     std::int32_t piece_b) {
  DoubleRemoval(query, workspace.impl().is_double).run(found);
  const std::optional<ContactRegion>& region = query.options.region;
  const auto is_wanted = [&](const ContactPoint& contact) {
    return !region ||
           (contact.p_WCa - region->center_W).squaredNorm() <= region->radius * region->radius;
  };
  for (const FoundContact& each : found) {
    const ContactPoint contact = finished(query, X_WA, each);
    if (!is_wanted(contact)) continue;
    contacts.push_back(contact);
    contacts.back().key.a.piece = piece_a;
    contacts.back().key.b.piece = piece_b;
  }
}

}  // namespace dyop::contact_internal
