// SPDX-License-Identifier: BSD-3-Clause
#include "contact/generation/small_surface.h"

#include <algorithm>
#include <array>
#include <cmath>

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

}  // namespace dyop::contact_internal
