// SPDX-License-Identifier: BSD-3-Clause
#include "support/inputs/path_inputs.h"

#include <cmath>

#include "support/inputs/random_inputs.h"

namespace dyop::testing {
namespace {

Vector3 whole_vector(std::mt19937_64& random) {
  const auto whole = [&] { return static_cast<Scalar>(random_index(5, random) - 2); };
  const Scalar x = whole();
  const Scalar y = whole();
  return {x, y, whole()};
}

Vector3 whole_vector_of(PathKind kind, std::mt19937_64& random) {
  Vector3 p = whole_vector(random);
  if (kind == PathKind::Coplanar) p.y() = p.x();
  if (kind == PathKind::Collinear) p = Vector3(1, 1, 2) * p.x();
  return p;
}

// Far below what sampling can resolve, but such that its square as a distance is still above the
// resolution of the oracle.
void nudge(double& x, std::mt19937_64& random) {
  constexpr std::array kExponents{-40, -36, -30, -20};
  const auto pick = static_cast<std::size_t>(random_index(kExponents.size(), random));
  x += std::ldexp((random() & 1U) != 0 ? 1.0 : -1.0, kExponents[pick]);
}

}  // namespace

FourPaths make_paths(PathKind kind, std::mt19937_64& random) {
  FourPaths paths;
  for (VertexPath& path : paths) {
    if (kind == PathKind::General || kind == PathKind::Slow) {
      path.begin = random_vector(1, random);
      path.end = path.begin + (kind == PathKind::Slow ? 0.01 : 1.0) * random_vector(1, random);
    } else {
      path.begin = whole_vector_of(kind, random);
      path.end = whole_vector_of(kind, random);
    }
  }
  if (kind == PathKind::Resting) {
    for (VertexPath& path : paths) path.end = path.begin;
  }
  if (kind == PathKind::Duplicate) {
    const std::size_t from = random() % 4;
    const std::size_t to = random() % 4;
    paths[to].begin = paths[from].begin;
    if (random() % 2 == 0) paths[to].end = paths[from].end;
  }
  if (kind == PathKind::Parallel) {
    paths[3].begin = paths[2].begin + paths[1].begin - paths[0].begin;
    paths[3].end = paths[2].end + paths[1].end - paths[0].end;
  }
  if (kind == PathKind::NearlyWhole) {
    VertexPath& path = paths[random() % 4];
    nudge((random() & 1U) != 0 ? path.begin[2] : path.end[1], random);
  }
  return paths;
}

FourPaths placed(const FourPaths& paths, double scale, const Vector3& offset) {
  FourPaths moved = paths;
  for (VertexPath& path : moved) {
    path.begin = scale * path.begin + offset;
    path.end = scale * path.end + offset;
  }
  return moved;
}

}  // namespace dyop::testing
