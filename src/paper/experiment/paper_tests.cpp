// SPDX-License-Identifier: BSD-3-Clause
#include <numbers>

#include "dyop/core/rigid_pose.h"
#include "dyop/paper/distance_algorithm.h"
#include "paper/experiment/paper_experiment.h"

namespace dyop::cli {
namespace {

constexpr int kBisections = 80;  // more than the digits of a double
constexpr Scalar kFarAway = 20;  // farther than any two objects reach
constexpr Scalar kPathLength = 1;
constexpr Scalar kPathTurn = 1;  // radians

// The standard library's distributions differ between implementations; this one does not.
Scalar random_number(Scalar low, Scalar high, std::mt19937_64& random) {
  return low + (high - low) * (static_cast<Scalar>(random() >> 11) * 0x1p-53);
}

template <int dimension>
using Rotation = Eigen::Matrix<Scalar, dimension, dimension>;

Rotation<2> plane_rotation(Scalar angle) {
  return Eigen::Rotation2D<Scalar>(angle).toRotationMatrix();
}

template <int dimension>
PaperPoint<dimension> random_direction(std::mt19937_64& random) {
  // Uniform in the cube until it is in the ball: an unbiased direction.
  for (;;) {
    PaperPoint<dimension> p;
    for (Scalar& x : p) x = random_number(-1, 1, random);
    const Scalar norm = p.norm();
    if (norm > 0.1 && norm <= 1) return p / norm;
  }
}

template <int dimension>
Rotation<dimension> random_rotation(std::mt19937_64& random) {
  if constexpr (dimension == 2) {
    return plane_rotation(random_number(0, 2 * std::numbers::pi, random));
  } else {
    // [Shoemake1985]: a uniformly random rotation is a random point on the unit sphere in four
    // dimensions.
    const PaperPoint<4> q = random_direction<4>(random);
    return Quaternion(q[0], q[1], q[2], q[3]).toRotationMatrix();
  }
}

// The rotation about a random axis, for any fraction of its angle.
template <int dimension>
class Turn {
 public:
  explicit Turn(std::mt19937_64& random) : angle_(random_number(-kPathTurn, kPathTurn, random)) {
    if constexpr (dimension == 3) axis_ = random_direction<3>(random);
  }

  Rotation<dimension> part(Scalar fraction) const {
    if constexpr (dimension == 2) {
      return plane_rotation(fraction * angle_);
    } else {
      return rotation_from_vector(fraction * angle_ * axis_);
    }
  }

 private:
  Scalar angle_;
  Vector3 axis_ = Vector3::UnitX();
};

template <int dimension>
PaperPoint<dimension> centroid(const PaperTriangle<dimension>& t) {
  return (t[0] + t[1] + t[2]) / 3;
}

template <int dimension>
PaperTriangle<dimension> shifted(PaperTriangle<dimension> t, const PaperPoint<dimension>& by) {
  for (auto& p : t) p += by;
  return t;
}

// A rigid motion of the whole pair, and an order of the vertices.
template <int dimension>
class Copy {
 public:
  explicit Copy(std::mt19937_64& random)
      : R_(random_rotation<dimension>(random)),
        p_(random_direction<dimension>(random)),
        order_a_(random() % 6),
        order_b_(random() % 6) {}

  PaperPair<dimension> of(const PaperPair<dimension>& pair) const {
    return {moved(pair.a, order_a_), moved(pair.b, order_b_)};
  }

 private:
  PaperTriangle<dimension> moved(const PaperTriangle<dimension>& t, std::uint64_t order) const {
    static constexpr std::size_t kOrders[6][3] = {{0, 1, 2}, {1, 2, 0}, {2, 0, 1},
                                                  {0, 2, 1}, {2, 1, 0}, {1, 0, 2}};
    PaperTriangle<dimension> result;
    for (std::size_t k = 0; k < 3; ++k) result[k] = R_ * t[kOrders[order][k]] + p_;
    return result;
  }

  Rotation<dimension> R_;
  PaperPoint<dimension> p_;
  std::uint64_t order_a_;
  std::uint64_t order_b_;
};

// How far along `away` the centroids must be for the gap. Both triangles contain their centroids,
// and the distance of convex sets is a convex function of a shift, so it grows all along.
template <int dimension>
PaperTest<dimension> place(const PaperTriangle<dimension>& object,
                           const PaperTriangle<dimension>& against, std::mt19937_64& random) {
  const DistanceAlgorithm& certified = *distance_algorithms()[0];
  PaperTest<dimension> test;
  test.away = random_direction<dimension>(random);
  const PaperPoint<dimension> onto = centroid<dimension>(against) - centroid<dimension>(object);
  const auto at = [&](Scalar distance) {
    return shifted<dimension>(object, onto + distance * test.away);
  };
  Scalar near = 0;
  Scalar far = kFarAway;
  for (int k = 0; k < kBisections; ++k) {
    const Scalar middle = (near + far) / 2;
    (certified.distance(at(middle), against).upper < kPaperGap ? near : far) = middle;
  }
  test.pair = {at(far), against};
  return test;
}

}  // namespace

template <int dimension>
PaperTriangle<dimension> random_paper_triangle(std::mt19937_64& random) {
  PaperTriangle<dimension> triangle;
  for (auto& p : triangle) {
    for (Scalar& x : p) x = random_number(-1, 1, random);
  }
  return triangle;
}

template <int dimension>
std::vector<PaperTest<dimension>> make_paper_tests(std::uint64_t seed) {
  std::mt19937_64 random(seed);
  std::array<PaperTriangle<dimension>, kObjectCount> objects;
  for (auto& object : objects) object = random_paper_triangle<dimension>(random);
  std::vector<PaperTest<dimension>> tests;
  for (std::size_t i = 0; i < objects.size(); ++i) {
    for (std::size_t j = 0; j < objects.size(); ++j) {
      if (i == j) continue;
      tests.push_back(place<dimension>(objects[i], objects[j], random));
      tests.back().object = static_cast<int>(i) + 1;
      tests.back().against = static_cast<int>(j) + 1;
    }
  }
  return tests;
}

template <int dimension>
PaperPair<dimension> rotated_copy(const PaperPair<dimension>& pair, std::mt19937_64& random) {
  return Copy<dimension>(random).of(pair);
}

template <int dimension>
void append_path(const PaperTest<dimension>& test, int steps, std::mt19937_64& random,
                 std::vector<PaperPair<dimension>>& pairs) {
  const Copy<dimension> copy(random);
  const Turn<dimension> turn(random);
  const PaperPoint<dimension> center = centroid<dimension>(test.pair.a);
  for (int k = 1; k <= steps; ++k) {
    const Scalar left = 1 - static_cast<Scalar>(k) / steps;
    const Rotation<dimension> R = turn.part(left);
    PaperPair<dimension> pair = test.pair;
    for (auto& p : pair.a) p = R * (p - center) + center + left * kPathLength * test.away;
    pairs.push_back(copy.of(pair));
  }
}

template PaperTriangle<2> random_paper_triangle<2>(std::mt19937_64&);
template PaperTriangle<3> random_paper_triangle<3>(std::mt19937_64&);
template std::vector<PaperTest<2>> make_paper_tests<2>(std::uint64_t);
template std::vector<PaperTest<3>> make_paper_tests<3>(std::uint64_t);
template PaperPair<2> rotated_copy<2>(const PaperPair<2>&, std::mt19937_64&);
template PaperPair<3> rotated_copy<3>(const PaperPair<3>&, std::mt19937_64&);
template void append_path<2>(const PaperTest<2>&, int, std::mt19937_64&,
                             std::vector<PaperPair<2>>&);
template void append_path<3>(const PaperTest<3>&, int, std::mt19937_64&,
                             std::vector<PaperPair<3>>&);

}  // namespace dyop::cli
