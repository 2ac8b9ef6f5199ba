// SPDX-License-Identifier: BSD-3-Clause
#include "tissue/lattice_cut.h"

#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <set>

#include "tissue/disjoint_sets.h"

namespace dyop::tissue_internal {
namespace {

// Samples that are no farther apart are neighbours: 16 around each, so that the samples of any
// convex piece are joined. In cubes.
constexpr Scalar kNeighbour = 0.33;
// What the kerf has taken must lie between two points by more than rounding: points on its walls
// see what is beside them.
constexpr Scalar kWall = 1 - 1e-6;  // literal: relative, far above the walls' rounding
constexpr Scalar kBeside = 0.25;  // cubes: how far from a cube a point may lie and still be its own
constexpr int kMostNewtons = 30;
constexpr Scalar kFound = 1e-14;  // literal: cubes; Newton's method ends some roundings beside it
constexpr Scalar kFar = 2;        // cubes: the distance of what is not seen
// How far a point is moved from the kerf to find its cube, in cubes, and what a cube costs that it
// is then outside of, per distance: more than any distance to a sample.
constexpr Scalar kAway = 1e-3;
constexpr Scalar kOutsideCost = kFar / kAway;
constexpr Scalar kMostOutside = 0.5;
// Where a line is followed, in cubes: the strides, what it costs that a place is outside of its cube,
// and how far apart two places are one.
constexpr Scalar kStride = 0.2;
constexpr int kMostStrides = 10'000;
constexpr Scalar kLeavingCost = 10;
constexpr Scalar kSamePlace = 0.25;
constexpr Scalar kCounts = 1e-6;  // literal: a weight that is more than rounding
// A part of a smaller volume is no body but what a blade takes along. Of a cube's.
constexpr Scalar kCrumb = 0.02;

// From a sample to a neighbour: its number, and the cube in which it lies.
struct SampleLink {
  std::size_t to;
  Cell cell;
};

std::array<std::vector<SampleLink>, kSamples> find_links() {
  std::array<std::vector<SampleLink>, kSamples> links;
  const Vector3 first = sample_place(0);
  for (std::size_t k = 0; k < kSamples; ++k) {
    for (std::size_t m = 1; m < kSamples; ++m) {
      // The samples of all cubes form one lattice.
      Vector3 way = sample_place(m) - first;
      way -= Vector3(way.array().round());
      if (way.norm() > kNeighbour) continue;
      const Vector3 cell = (sample_place(k) + way).array().floor();
      links[k].push_back({(k + m) % kSamples, cell.cast<int>()});
    }
  }
  return links;
}

const std::vector<SampleLink>& links_of(std::size_t sample) {
  static const std::array<std::vector<SampleLink>, kSamples> links = find_links();
  return links[sample];
}

// How far a place is from the unit cube.
Scalar outside_by(const Vector3& place) {
  return (place - place.cwiseMax(0).cwiseMin(1)).norm();
}

}  // namespace

LatticeCut::LatticeCut(const TissueLattice& lattice, const NodeVectors& x, const TissueKerf& kerf)
    : lattice_(lattice),
      x_(x),
      X_KW_(kerf.X_WK.inverse()),
      half_extents_(kerf.half_extents),
      cubes_at_(lattice.nodes().size()),
      number_(lattice.cubes().size(), -1),
      shapes_(lattice.cubes().size()) {
  const AlignedBox reach(-half_extents_, half_extents_);
  for (std::size_t cube = 0; cube < number_.size(); ++cube) {
    AlignedBox box;
    for (const std::int32_t node : lattice.cubes()[cube]) {
      box.extend(X_KW_ * Vector3(x.col(node)));
      cubes_at_[std::size_t(node)].push_back(std::int32_t(cube));
    }
    const Vector3 beside = kBeside * box.sizes();
    boxes_.emplace_back(box.min() - beside, box.max() + beside);
    if (!boxes_.back().intersects(reach)) continue;
    number_[cube] = std::int32_t(near_.size());
    near_.push_back(std::int32_t(cube));
  }
}

// The samples that stand for what the cube has of the body.
const Samples& LatticeCut::domain(std::int32_t cube) const {
  const Samples& material = lattice_.material(std::size_t(cube));
  return material.any() ? material : lattice_.light(std::size_t(cube));
}

const CubeShape& LatticeCut::shape(std::int32_t cube) const {
  std::unique_ptr<CubeShape>& shape = shapes_[std::size_t(cube)];
  if (shape) return *shape;
  shape = std::make_unique<CubeShape>();
  const Corners& nodes = lattice_.cubes()[std::size_t(cube)];
  for (std::size_t c = 0; c < 8; ++c) shape->corners[c] = X_KW_ * Vector3(x_.col(nodes[c]));
  for (std::size_t k = 0; k < kSamples; ++k) {
    const std::array<Scalar, 8> weights = weights_at(sample_place(k));
    Vector3& p = shape->samples[k];
    p.setZero();
    for (std::size_t c = 0; c < 8; ++c) p += weights[c] * shape->corners[c];
    shape->left[k] = domain(cube)[k] && !takes(p);
  }
  return *shape;
}

bool LatticeCut::takes(const Vector3& p_K) const {
  return (p_K.cwiseAbs().array() <= half_extents_.array()).all();
}

// Whether the segment crosses the kerf, somewhat thinner.
bool LatticeCut::lies_between(const Vector3& a_K, const Vector3& b_K) const {
  Scalar begin = 0, end = 1;
  for (int axis = 0; axis < 3; ++axis) {
    const Scalar way = b_K[axis] - a_K[axis], half = kWall * half_extents_[axis];
    if (way == 0) {
      if (std::abs(a_K[axis]) > half) return false;
      continue;
    }
    const Scalar s = (-half - a_K[axis]) / way, t = (half - a_K[axis]) / way;
    begin = std::max(begin, std::min(s, t));
    end = std::min(end, std::max(s, t));
  }
  return begin < end;
}

// By Newton's method on the trilinear map.
std::optional<Vector3> LatticeCut::place_in(std::int32_t cube, const Vector3& p_K) const {
  const CubeShape& own = shape(cube);
  Vector3 place = Vector3::Constant(0.5);
  for (int k = 0; k < kMostNewtons; ++k) {
    const std::array<Scalar, 8> weights = weights_at(place);
    const Gradients gradients = gradients_at(place);
    Vector3 error = -p_K;
    Matrix3 slope = Matrix3::Zero();
    for (std::size_t c = 0; c < 8; ++c) {
      error += weights[c] * own.corners[c];
      slope += own.corners[c] * gradients.col(Eigen::Index(c)).transpose();
    }
    const Vector3 step = slope.partialPivLu().solve(error);
    if (!step.allFinite()) return std::nullopt;
    place = (place - step).cwiseMax(-1).cwiseMin(2);
    if (step.norm() < kFound) break;
    if (k + 1 == kMostNewtons && step.norm() > kNeighbour * kNeighbour) return std::nullopt;
  }
  return place;
}

// From a point to the nearest sample on its side of the kerf, in cubes.
Scalar LatticeCut::distance_to_seen(std::int32_t cube, const Vector3& place,
                                    const Vector3& p_K) const {
  const CubeShape& own = shape(cube);
  Scalar nearest = kFar;
  for (std::size_t k = 0; k < kSamples; ++k) {
    if (!own.left[k]) continue;
    const Scalar distance = (sample_place(k) - place).norm();
    if (distance < nearest && !lies_between(p_K, own.samples[k])) nearest = distance;
  }
  return nearest;
}

// The cube that holds what is beside the point, so that a cut that ends between two cubes does not
// reach into both.
std::optional<Host> LatticeCut::host_of(const NewPoint& point) const {
  const Vector3 p_K = X_KW_ * point.p_W;
  const Vector3 beside_K = X_KW_ * (point.p_W + kAway * lattice_.edge() * point.away_W);
  std::optional<Host> best;
  Scalar least = kInfinity;
  for (std::int32_t cube = 0; std::size_t(cube) < boxes_.size(); ++cube) {
    if (!may_hold(cube, p_K, point.part)) continue;
    const std::optional<Vector3> place = place_in(cube, p_K), beside = place_in(cube, beside_K);
    if (!place || !beside) continue;
    // A point of the surface may lie beside its cube already: a triangle is flat, a cube is not.
    const Scalar outside = outside_by(*place);
    Scalar cost = kOutsideCost * std::max(Scalar{0}, outside_by(*beside) - outside) +
                  kLeavingCost * outside + distance_to_seen(cube, *place, p_K);
    const Host host{cube, *place};
    if (point.rest) cost += (lattice_.rest_place(host) - *point.rest).norm() / lattice_.edge();
    for (const std::int32_t beside_it : point.cubes_beside) {
      if (are_apart(cube, beside_it)) cost += kFar;
    }
    if (cost < least) {
      least = cost;
      best = host;
    }
  }
  return best;
}

// Those that have a node in common with a cube, and itself.
std::set<std::int32_t> LatticeCut::cubes_around(std::int32_t cube) const {
  std::set<std::int32_t> around;
  for (const std::int32_t node : lattice_.cubes()[std::size_t(cube)]) {
    around.insert(cubes_at_[std::size_t(node)].begin(), cubes_at_[std::size_t(node)].end());
  }
  return around;
}

bool LatticeCut::may_hold(std::int32_t cube, const Vector3& p_K, std::int32_t part) const {
  return boxes_[std::size_t(cube)].contains(p_K) &&
         lattice_.part_of_cube(std::size_t(cube)) == part;
}

Scalar LatticeCut::distance_to_material(std::int32_t cube, const Vector3& place) const {
  Scalar nearest_sq = kFar * kFar;
  for (std::size_t k = 0; k < kSamples; ++k) {
    if (!domain(cube)[k]) continue;
    nearest_sq = std::min(nearest_sq, (sample_place(k) - place).squaredNorm());
  }
  return std::sqrt(nearest_sq);
}

Scalar LatticeCut::distance(const Host& a, const Host& b) const {
  const Scalar at_rest = (lattice_.rest_place(a) - lattice_.rest_place(b)).norm();
  return at_rest / lattice_.edge() + (are_apart(a.cube, b.cube) ? kFar : 0);
}

std::optional<Host> LatticeCut::follow(const Host& from, const Vector3& from_W, const Vector3& to_W,
                                       std::vector<std::int32_t>& way) const {
  const Vector3 from_K = X_KW_ * from_W, to_K = X_KW_ * to_W;
  const Scalar wanted = (to_K - from_K).norm() / (kStride * lattice_.edge());
  const int strides = int(std::clamp(std::ceil(wanted), Scalar{1}, Scalar(kMostStrides)));
  std::optional<Host> at = from;
  way.push_back(from.cube);
  for (int k = 1; k <= strides && at; ++k) {
    at = next_place(*at, from_K + Scalar(k) / strides * (to_K - from_K), way);
    if (at && at->cube != way.back()) way.push_back(at->cube);
  }
  return at;
}

// After a short stride, which does not lead into another cube where one has been on the way.
std::optional<Host> LatticeCut::next_place(const Host& from, const Vector3& p_K,
                                           std::span<const std::int32_t> way) const {
  const auto is_other_side = [&](std::int32_t cube) {
    const Cell& cell = lattice_.cube_cell(std::size_t(cube));
    return std::any_of(way.begin(), way.end(), [&](std::int32_t one) {
      return one != cube && lattice_.cube_cell(std::size_t(one)) == cell;
    });
  };
  std::optional<Host> best;
  Scalar least = kInfinity;
  for (const std::int32_t cube : cubes_around(from.cube)) {
    if (!boxes_[std::size_t(cube)].contains(p_K) || is_other_side(cube)) continue;
    const std::optional<Vector3> place = place_in(cube, p_K);
    if (!place) continue;
    const Host host{cube, *place};
    const Scalar outside = outside_by(*place);
    const Scalar cost =
        kLeavingCost * outside + distance_to_material(cube, *place) +
        (lattice_.rest_place(host) - lattice_.rest_place(from)).norm() / lattice_.edge();
    if (outside > kMostOutside || cost >= least) continue;
    least = cost;
    best = host;
  }
  return best;
}

std::vector<Host> LatticeCut::places_at(const Vector3& p_W, std::int32_t part) const {
  const Vector3 p_K = X_KW_ * p_W;
  std::vector<std::pair<Scalar, Host>> found;
  for (const std::int32_t cube : near_) {
    if (!may_hold(cube, p_K, part)) continue;
    const std::optional<Vector3> place = place_in(cube, p_K);
    if (!place) continue;
    const Scalar cost = kLeavingCost * outside_by(*place) + distance_to_material(cube, *place);
    found.emplace_back(cost, Host{cube, *place});
  }
  std::stable_sort(found.begin(), found.end(),
                   [](const auto& a, const auto& b) { return a.first < b.first; });
  std::vector<Host> places;
  for (const auto& one : found) {
    const bool is_known = std::any_of(places.begin(), places.end(), [&](const Host& place) {
      return distance(place, one.second) < kSamePlace;
    });
    if (!is_known) places.push_back(one.second);
  }
  return places;
}

std::optional<Host> LatticeCut::host_among(std::span<const std::int32_t> cubes,
                                           const Vector3& p_W) const {
  std::optional<Host> best;
  Scalar least = kMostOutside;
  for (const std::int32_t cube : cubes) {
    const std::optional<Vector3> place = place_in(cube, X_KW_ * p_W);
    if (!place) continue;
    const Scalar outside = outside_by(*place);
    if (outside >= least) continue;
    least = outside;
    best = Host{cube, *place};
  }
  return best;
}

// Whether an earlier cut has parted two cubes that are at one place or beside each other.
bool LatticeCut::are_apart(std::int32_t a, std::int32_t b) const {
  if (a == b) return false;
  const Cell way = lattice_.cube_cell(std::size_t(b)) - lattice_.cube_cell(std::size_t(a));
  if (way.cwiseAbs().maxCoeff() > 1) return false;
  if (way.isZero()) return true;
  const Corners& of_a = lattice_.cubes()[std::size_t(a)];
  const Corners& of_b = lattice_.cubes()[std::size_t(b)];
  return std::find_first_of(of_a.begin(), of_a.end(), of_b.begin(), of_b.end()) == of_a.end();
}

// One call of divide(). Items are the samples of the near cubes, then the vertices.
class LatticeDivision {
 public:
  LatticeDivision(const LatticeCut& cut, std::span<const Vector3> vertices_W,
                  const std::vector<Host>& hosts, std::span<const TriangleIndices> triangles)
      : cut_(cut),
        lattice_(cut.lattice_),
        vertices_W_(vertices_W),
        hosts_(hosts),
        triangles_(triangles),
        items_(cut.near_.size() * kSamples + hosts.size()),
        is_used_(hosts.size(), false) {
    for (const TriangleIndices& t : triangles) {
      for (const std::int32_t vertex : t) is_used_[std::size_t(vertex)] = true;
    }
  }

  LatticePieces run() {
    for (const std::int32_t cube : cut_.near_) join_samples(cube);
    for (std::size_t v = 0; v < hosts_.size(); ++v) join_to_seen(v);
    for_each_edge([&](std::int32_t u, std::int32_t v) {
      const std::int32_t cube = hosts_[std::size_t(u)].cube;
      if (cube == hosts_[std::size_t(v)].cube && is_near(cube)) {
        items_.join(vertex_item(std::size_t(u)), vertex_item(std::size_t(v)));
      }
    });
    make_cubes();
    join_corners();
    drop_crumbs();
    number_nodes();
    return std::move(pieces_);
  }

 private:
  bool is_near(std::int32_t cube) const {
    return cube >= 0 && cut_.number_[std::size_t(cube)] >= 0;
  }
  std::size_t item(std::int32_t cube, std::size_t sample) const {
    return std::size_t(cut_.number_[std::size_t(cube)]) * kSamples + sample;
  }
  std::size_t vertex_item(std::size_t vertex) const {
    return cut_.near_.size() * kSamples + vertex;
  }

  template <typename Visit>
  void for_each_edge(const Visit& visit) const {
    for (const TriangleIndices& t : triangles_) {
      for (std::size_t k = 0; k < 3; ++k) visit(t[k], t[(k + 1) % 3]);
    }
  }

  bool are_joined(const CubeShape& a, std::size_t i, const CubeShape& b, std::size_t k) const {
    return a.left[i] && b.left[k] && !cut_.lies_between(a.samples[i], b.samples[k]);
  }

  // What was one before the cut without being joined is held together by the nearest samples.
  void join_samples(std::int32_t cube) {
    const CubeShape& own = cut_.shape(cube);
    const Samples& domain = cut_.domain(cube);
    DisjointSets before(kSamples);
    for (std::size_t k = 0; k < kSamples; ++k) {
      for (const SampleLink& link : links_of(k)) {
        if (!link.cell.isZero() || !domain[k] || !domain[link.to]) continue;
        before.join(k, link.to);
        if (are_joined(own, k, own, link.to)) items_.join(item(cube, k), item(cube, link.to));
      }
    }
    std::vector<std::size_t> known, rest;
    for (std::size_t k = 0; k < kSamples; ++k) {
      if (domain[k]) (known.empty() || before.find(k) == known[0] ? known : rest).push_back(k);
    }
    for (int parts = 0; parts < kSamples && !rest.empty(); ++parts) {
      const auto [i, k] = nearest(own, known, own, rest);
      if (are_joined(own, i, own, k)) items_.join(item(cube, i), item(cube, k));
      const std::size_t part = before.find(k);
      for (const std::size_t sample : rest) {
        if (before.find(sample) == part) known.push_back(sample);
      }
      std::erase_if(rest, [&](std::size_t sample) { return before.find(sample) == part; });
    }
  }

  // By their places at rest, those that are left first.
  static std::pair<std::size_t, std::size_t> nearest(const CubeShape& a,
                                                     const std::vector<std::size_t>& from,
                                                     const CubeShape& b,
                                                     const std::vector<std::size_t>& to,
                                                     const Vector3& b_from_a = Vector3::Zero()) {
    std::pair<std::size_t, std::size_t> best{from[0], to[0]};
    Scalar least = kInfinity;
    for (const std::size_t i : from) {
      for (const std::size_t k : to) {
        Scalar distance = (sample_place(k) + b_from_a - sample_place(i)).norm();
        if (!a.left[i] || !b.left[k]) distance += kFar * kFar;
        if (distance >= least) continue;
        least = distance;
        best = {i, k};
      }
    }
    return best;
  }

  void join_to_seen(std::size_t vertex) {
    const Host& host = hosts_[vertex];
    if (!is_used_[vertex] || !is_near(host.cube)) return;
    const CubeShape& own = cut_.shape(host.cube);
    const Vector3 p_K = cut_.X_KW_ * vertices_W_[vertex];
    std::optional<std::size_t> nearest;
    Scalar least = kInfinity;
    for (std::size_t k = 0; k < kSamples; ++k) {
      const Scalar distance = (sample_place(k) - host.place).norm();
      if (!own.left[k] || distance >= least || cut_.lies_between(p_K, own.samples[k])) continue;
      least = distance;
      nearest = k;
    }
    if (nearest) items_.join(vertex_item(vertex), item(host.cube, *nearest));
  }

  // The parts of every near cube, in the order of their first samples.
  void make_cubes() {
    std::vector<std::vector<std::size_t>> vertices(cut_.near_.size());
    for (std::size_t v = 0; v < hosts_.size(); ++v) {
      const std::int32_t cube = hosts_[v].cube;
      if (is_used_[v] && is_near(cube)) {
        vertices[std::size_t(cut_.number_[std::size_t(cube)])].push_back(v);
      }
    }
    cube_of_.assign(cut_.near_.size() * kSamples + hosts_.size(), -1);
    whole_.assign(lattice_.cubes().size(), -1);
    for (std::size_t cube = 0; cube < whole_.size(); ++cube) {
      const auto old = std::int32_t(cube);
      if (is_near(old)) {
        divide(old, vertices[std::size_t(cut_.number_[cube])]);
      } else {
        whole_[cube] = std::int32_t(pieces_.cubes.size());
        pieces_.cubes.push_back({old, {}, lattice_.material(cube), lattice_.light(cube), false});
      }
    }
  }

  void divide(std::int32_t old, const std::vector<std::size_t>& vertices) {
    const CubeShape& own = cut_.shape(old);
    const std::size_t first = pieces_.cubes.size();
    std::map<std::size_t, std::int32_t> cube_of_set;
    const auto add = [&](std::size_t item) {
      const auto [found, is_new] =
          cube_of_set.try_emplace(items_.find(item), std::int32_t(pieces_.cubes.size()));
      if (is_new) pieces_.cubes.push_back({old, {}, {}, {}, true});
      cube_of_[item] = found->second;
      return std::size_t(found->second);
    };
    const bool has_material = lattice_.material(std::size_t(old)).any();
    for (std::size_t k = 0; k < kSamples; ++k) {
      if (!own.left[k]) continue;
      LatticePieces::Cube& cube = pieces_.cubes[add(item(old, k))];
      (has_material ? cube.material : cube.light)[k] = true;
    }
    for (const std::size_t vertex : vertices) add(vertex_item(vertex));
    if (has_material) give_light(old, first);
    for (std::size_t k = first; k < pieces_.cubes.size(); ++k) {
      LatticePieces::Cube& cube = pieces_.cubes[k];
      if (cube.material.none() && cube.light.none()) cube.light.set();
      cube.is_changed = cube.material != lattice_.material(std::size_t(old)) ||
                        cube.light != lattice_.light(std::size_t(old));
    }
  }

  // The largest part has the mass of what was light.
  void give_light(std::int32_t old, std::size_t first) {
    const CubeShape& own = cut_.shape(old);
    const auto largest = std::max_element(
        pieces_.cubes.begin() + std::ptrdiff_t(first), pieces_.cubes.end(),
        [](const auto& a, const auto& b) { return a.material.count() < b.material.count(); });
    if (largest == pieces_.cubes.end()) return;
    const Samples& light = lattice_.light(std::size_t(old));
    for (std::size_t k = 0; k < kSamples; ++k) {
      largest->light[k] = light[k] && !cut_.takes(own.samples[k]);
    }
  }

  std::int32_t piece_of(std::int32_t cube, std::size_t sample) const {
    return is_near(cube) ? cube_of_[item(cube, sample)] : whole_[std::size_t(cube)];
  }

  void join_corners() {
    corners_.emplace(8 * pieces_.cubes.size());
    for (const std::vector<std::int32_t>& around : cut_.cubes_at_) join_whole(around);
    for (const std::int32_t cube : cut_.near_) join_across(cube);
    for_each_edge([&](std::int32_t u, std::int32_t v) {
      const std::int32_t a = hosts_[std::size_t(u)].cube, b = hosts_[std::size_t(v)].cube;
      if (a == b || a < 0 || b < 0 || !(is_near(a) || is_near(b))) return;
      join_where(u, v);
    });
  }

  // What the kerf is not near keeps its nodes.
  void join_whole(const std::vector<std::int32_t>& around) {
    std::int32_t last = -1;
    for (const std::int32_t cube : around) {
      if (is_near(cube)) continue;
      if (last >= 0) join_common(whole_[std::size_t(last)], whole_[std::size_t(cube)]);
      last = cube;
    }
  }

  // Nodes that had the same number.
  void join_common(std::int32_t a, std::int32_t b) {
    if (a == b || !joined_.insert(std::minmax(a, b)).second) return;
    const Corners& of_a = lattice_.cubes()[std::size_t(pieces_.cubes[std::size_t(a)].old)];
    const Corners& of_b = lattice_.cubes()[std::size_t(pieces_.cubes[std::size_t(b)].old)];
    for (std::size_t i = 0; i < 8; ++i) {
      for (std::size_t k = 0; k < 8; ++k) {
        if (of_a[i] == of_b[k]) corners_->join(8 * std::size_t(a) + i, 8 * std::size_t(b) + k);
      }
    }
  }

  // The nodes that count where an edge of the surface crosses from a cube into the next.
  void join_where(std::int32_t u, std::int32_t v) {
    const Host &from = hosts_[std::size_t(u)], &to = hosts_[std::size_t(v)];
    const Cell way =
        lattice_.cube_cell(std::size_t(to.cube)) - lattice_.cube_cell(std::size_t(from.cube));
    if (way.isZero() || way.cwiseAbs().maxCoeff() > 1) return;
    const Vector3 end = to.place + way.cast<Scalar>();
    Scalar sum = 0;
    for (int axis = 0; axis < 3; ++axis) {
      if (way[axis] == 0 || end[axis] == from.place[axis]) continue;
      const Scalar t = (Scalar(way[axis] > 0) - from.place[axis]) / (end[axis] - from.place[axis]);
      sum += std::clamp(t, Scalar{0}, Scalar{1});
    }
    const Scalar t = sum / Scalar(way.cwiseAbs().sum());
    Vector3 place = (from.place + t * (end - from.place)).cwiseMax(0).cwiseMin(1);
    for (int axis = 0; axis < 3; ++axis) {
      if (way[axis] != 0) place[axis] = way[axis] > 0 ? 1 : 0;
    }
    const std::array<Scalar, 8> weights = weights_at(place);
    const auto a = std::size_t(piece_of_vertex(u)), b = std::size_t(piece_of_vertex(v));
    for (std::size_t i = 0; i < 8; ++i) {
      if (weights[i] < kCounts) continue;
      for (std::size_t k = 0; k < 8; ++k) {
        const bool is_same = lattice_.cubes()[std::size_t(from.cube)][i] ==
                             lattice_.cubes()[std::size_t(to.cube)][k];
        if (is_same) corners_->join(8 * a + i, 8 * b + k);
      }
    }
  }

  // With the cubes that have a node in common with this one.
  void join_across(std::int32_t cube) {
    for (const std::int32_t other : cut_.cubes_around(cube)) {
      const Cell way =
          lattice_.cube_cell(std::size_t(other)) - lattice_.cube_cell(std::size_t(cube));
      if (way.isZero()) continue;
      const bool was_joined = join_samples(cube, other, way);
      const bool is_face = way.cwiseAbs().sum() == 1;
      if (!was_joined && is_face) join_nearest(cube, other, way.cast<Scalar>());
    }
  }

  // Returns whether they had neighbours in each other before the cut.
  bool join_samples(std::int32_t cube, std::int32_t other, const Cell& way) {
    const Samples &domain = cut_.domain(cube), &beyond = cut_.domain(other);
    bool was_joined = false;
    for (std::size_t k = 0; k < kSamples; ++k) {
      if (!domain[k]) continue;
      for (const SampleLink& link : links_of(k)) {
        if (link.cell != way || !beyond[link.to]) continue;
        was_joined = true;
        if (are_joined(cut_.shape(cube), k, cut_.shape(other), link.to)) {
          join_common(piece_of(cube, k), piece_of(other, link.to));
        }
      }
    }
    return was_joined;
  }

  void join_nearest(std::int32_t cube, std::int32_t other, const Vector3& way) {
    const auto numbers = [](const Samples& samples) {
      std::vector<std::size_t> set;
      for (std::size_t k = 0; k < kSamples; ++k) {
        if (samples[k]) set.push_back(k);
      }
      return set;
    };
    const CubeShape &a = cut_.shape(cube), &b = cut_.shape(other);
    const std::vector<std::size_t> from = numbers(cut_.domain(cube));
    const std::vector<std::size_t> to = numbers(cut_.domain(other));
    if (from.empty() || to.empty()) return;
    const auto [i, k] = nearest(a, from, b, to, way);
    if (are_joined(a, i, b, k)) join_common(piece_of(cube, i), piece_of(other, k));
  }

  // Of every piece; those that share a node are one.
  std::vector<std::size_t> find_parts() {
    DisjointSets parts(pieces_.cubes.size());
    std::map<std::size_t, std::size_t> first;
    for (std::size_t k = 0; k < 8 * pieces_.cubes.size(); ++k) {
      const auto [found, is_new] = first.try_emplace(corners_->find(k), k / 8);
      if (!is_new) parts.join(found->second, k / 8);
    }
    std::vector<std::size_t> numbers;
    for (std::size_t k = 0; k < pieces_.cubes.size(); ++k) numbers.push_back(parts.find(k));
    return numbers;
  }

  std::int32_t piece_of_vertex(std::int32_t vertex) const {
    const std::int32_t cube = hosts_[std::size_t(vertex)].cube;
    if (cube < 0) return -1;
    return is_near(cube) ? cube_of_[vertex_item(std::size_t(vertex))] : whole_[std::size_t(cube)];
  }

  // Of triangles that join different parts.
  void find_torn(const std::vector<std::size_t>& parts) {
    std::map<std::size_t, std::size_t> sizes;
    for (const std::size_t part : parts) ++sizes[part];
    std::set<std::int32_t> torn;
    const auto part_of = [&](std::int32_t v) { return parts[std::size_t(piece_of_vertex(v))]; };
    for_each_edge([&](std::int32_t u, std::int32_t v) {
      const std::size_t a = part_of(u), b = part_of(v);
      if (a != b) torn.insert(std::pair(sizes[a], a) < std::pair(sizes[b], b) ? u : v);
    });
    pieces_.torn.assign(torn.begin(), torn.end());
  }

  void drop_crumbs() {
    const std::vector<std::size_t> parts = find_parts();
    find_torn(parts);
    std::map<std::size_t, Scalar> volumes;
    for (const std::size_t part : parts) volumes[part] = 0;
    for (const TriangleIndices& t : triangles_) {
      const std::size_t part = parts[std::size_t(piece_of_vertex(t[0]))];
      const Vector3& base = vertices_W_[std::size_t(triangles_[0][0])];
      const auto at = [&](std::size_t k) { return vertices_W_[std::size_t(t[k])] - base; };
      volumes[part] += Vector3(at(0)).dot(Vector3(at(1)).cross(Vector3(at(2)))) / 6;
    }
    const Scalar least = kCrumb * std::pow(lattice_.edge(), 3);
    std::size_t largest = volumes.begin()->first;
    for (const auto& [part, volume] : volumes) {
      if (volume > volumes[largest]) largest = part;
    }
    std::set<std::size_t> changed;
    for (std::size_t k = 0; k < parts.size(); ++k) {
      if (pieces_.cubes[k].is_changed) changed.insert(parts[k]);
    }
    const auto is_kept = [&](std::size_t part) {
      return part == largest || volumes[part] >= least || !changed.contains(part);
    };
    pieces_.keeps_triangle.clear();
    for (const TriangleIndices& t : triangles_) {
      pieces_.keeps_triangle.push_back(is_kept(parts[std::size_t(piece_of_vertex(t[0]))]));
    }
    is_dropped_.clear();
    for (const std::size_t part : parts) is_dropped_.push_back(!is_kept(part));
  }

  void number_nodes() {
    std::map<std::size_t, std::int32_t> numbers;
    std::vector<LatticePieces::Cube> kept;
    std::vector<std::int32_t> place(pieces_.cubes.size(), -1);
    for (std::size_t k = 0; k < pieces_.cubes.size(); ++k) {
      if (is_dropped_[k]) continue;
      LatticePieces::Cube& cube = pieces_.cubes[k];
      for (std::size_t c = 0; c < 8; ++c) {
        const auto [found, is_new] =
            numbers.try_emplace(corners_->find(8 * k + c), std::int32_t(pieces_.old_nodes.size()));
        if (is_new) pieces_.old_nodes.push_back(lattice_.cubes()[std::size_t(cube.old)][c]);
        cube.nodes[c] = found->second;
      }
      place[k] = std::int32_t(kept.size());
      kept.push_back(cube);
    }
    pieces_.cubes = std::move(kept);
    for (std::size_t v = 0; v < hosts_.size(); ++v) {
      const std::int32_t piece = is_used_[v] ? piece_of_vertex(std::int32_t(v)) : -1;
      pieces_.hosts.push_back({piece < 0 ? -1 : place[std::size_t(piece)], hosts_[v].place});
    }
  }

  const LatticeCut& cut_;
  const TissueLattice& lattice_;
  std::span<const Vector3> vertices_W_;
  const std::vector<Host>& hosts_;
  std::span<const TriangleIndices> triangles_;
  DisjointSets items_;
  std::vector<bool> is_used_;
  std::vector<std::int32_t> cube_of_;    // of each item: a piece
  std::vector<std::int32_t> whole_;      // of each old cube that is not near: its piece
  std::optional<DisjointSets> corners_;  // of the pieces
  std::set<std::pair<std::int32_t, std::int32_t>> joined_;
  std::vector<bool> is_dropped_;  // by piece
  LatticePieces pieces_;
};

LatticePieces LatticeCut::divide(std::span<const Vector3> vertices_W,
                                 const std::vector<Host>& hosts,
                                 std::span<const TriangleIndices> triangles) const {
  return LatticeDivision(*this, vertices_W, hosts, triangles).run();
}

}  // namespace dyop::tissue_internal
