// SPDX-License-Identifier: BSD-3-Clause
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <map>

#include "dyop/core/error.h"
#include "tissue/kerf_surface.h"
#include "tissue/lattice_cut.h"
#include "tissue/tissue_body.h"

namespace dyop {

void TissueKerf::require_valid() const {
  DYOP_REQUIRE(half_extents.allFinite() && half_extents.minCoeff() > 0,
               "TissueKerf: half_extents must be finite and > 0, not ", half_extents);
}

}  // namespace dyop

namespace dyop::tissue_internal {
namespace {

// Of the caps' points, in cubes: so that a cap bends with the cubes beside it.
constexpr Scalar kCapSpacing = 0.5;
// The least factor by which the stiffness of cut cubes is lowered to keep the elastic energy.
constexpr Scalar kLeastSoftening = 0.5;
constexpr int kMostMoves = 4;
constexpr Scalar kMostStrain = 3;  // lengths at rest, relative to those now, of what is one body

}  // namespace

// About where a point of a triangle is at rest.
Vector3 TissueBody::rest_place(std::int32_t triangle, const Vector3& p_W) const {
  const TriangleIndices& t = triangles_[std::size_t(triangle)];
  const auto now = [&](std::size_t k) { return vertices_[std::size_t(t[k])]; };
  const auto rest = [&](std::size_t k) {
    return lattice_.rest_place(lattice_.hosts()[std::size_t(t[k])]);
  };
  Eigen::Matrix<Scalar, 3, 2> edges;
  edges << now(1) - now(0), now(2) - now(0);
  const Eigen::Vector2d share = edges.colPivHouseholderQr().solve(p_W - now(0));
  return rest(0) + share[0] * (rest(1) - rest(0)) + share[1] * (rest(2) - rest(0));
}

NewPoint TissueBody::point_on(std::int32_t triangle, const Vector3& p_W) const {
  const TriangleIndices& corners = triangles_[std::size_t(triangle)];
  NewPoint point{p_W, Vector3::Zero(), 0, rest_place(triangle, p_W), {}};
  for (const std::int32_t corner : corners) {
    point.cubes_beside.push_back(lattice_.hosts()[std::size_t(corner)].cube);
  }
  point.part = lattice_.part_of_cube(std::size_t(point.cubes_beside[0]));
  return point;
}

class TissueSheets final : public BodySheets {
 public:
  TissueSheets(const TissueBody& body, const LatticeCut& cut) : body_(body), cut_(cut) {}

  std::optional<Host> on_surface(std::int32_t triangle, const Vector3& p_W) const override {
    return cut_.host_of(body_.point_on(triangle, p_W));
  }
  std::vector<Host> inside(std::int32_t part, const Vector3& p_W) const override {
    return cut_.places_at(p_W, part);
  }
  Scalar miss(const Host& from, const Vector3& from_W, const Host& to,
              const Vector3& to_W) const override {
    std::vector<std::int32_t> way;
    const std::optional<Host> end = cut_.follow(from, from_W, to_W, way);
    return end ? cut_.distance(*end, to) : kInfinity;
  }

 private:
  const TissueBody& body_;
  const LatticeCut& cut_;
};

namespace {

// Finds hosts of the added vertices: of those on the old surface by their triangles, then from there
// along the caps' edges, so that a cap stays on one side where the body lies over itself.
class AddedHosts {
 public:
  AddedHosts(const KerfSurface& surface, const LatticeCut& cut, std::span<const Vector3> vertices,
             std::vector<Host> old)
      : surface_(surface), cut_(cut), vertices_(vertices), hosts_(std::move(old)) {
    first_ = hosts_.size();
    hosts_.resize(vertices.size());
    has_come_.resize(vertices.size());
    beside_.resize(vertices.size());
    for (const TriangleIndices& t : surface.triangles) {
      for (std::size_t k = 0; k < 3; ++k) {
        const std::int32_t next = t[(k + 1) % 3];
        if (!is_on_old(std::size_t(next))) beside_[std::size_t(t[k])].push_back(next);
      }
    }
  }

  // @param point_on Of a triangle and a place: a point on the old surface.
  template <typename PointOn>
  std::vector<Host> find(const PointOn& point_on) {
    std::vector<std::size_t> known;
    for (std::size_t v = 0; v < hosts_.size(); ++v) {
      if (!is_on_old(v)) continue;
      if (v >= first_) add(v, point_on(surface_.sources[v - first_], vertices_[v]));
      known.push_back(v);
    }
    spread(known);
    for (std::size_t v = first_; v < hosts_.size(); ++v) {
      if (has_come_[v] || is_on_old(v)) continue;
      add(v, {});
      spread({v});
    }
    return std::move(hosts_);
  }

 private:
  bool is_on_old(std::size_t v) const { return v < first_ || surface_.sources[v - first_] >= 0; }

  void add(std::size_t v, NewPoint point) {
    point.p_W = vertices_[v];
    point.away_W = surface_.away_W[v - first_];
    point.part = surface_.parts[v - first_];
    hosts_[v] = cut_.host_of(point).value_or(Host{});
    has_come_[v] = true;
  }

  void spread(std::vector<std::size_t> known) {
    for (std::size_t k = 0; k < known.size(); ++k) {
      const std::size_t from = known[k];
      if (hosts_[from].cube < 0) continue;
      for (const std::int32_t next : beside_[from]) {
        const auto v = std::size_t(next);
        if (has_come_[v]) continue;
        NewPoint point;
        const auto host =
            cut_.follow(hosts_[from], vertices_[from], vertices_[v], point.cubes_beside);
        if (!host) continue;
        point.rest = cut_.rest_place(*host);
        add(v, std::move(point));
        known.push_back(v);
      }
    }
  }

  const KerfSurface& surface_;
  const LatticeCut& cut_;
  std::span<const Vector3> vertices_;
  std::vector<Host> hosts_;
  std::size_t first_ = 0;  // of the added ones
  std::vector<bool> has_come_;
  std::vector<std::vector<std::int32_t>> beside_;  // inside the caps, of each vertex
};

}  // namespace

// A point on the wall of an earlier cut may seem to belong to the wrong one of the cubes that are
// there: it goes to one of its neighbours'.
void TissueBody::move_torn(const LatticeCut& cut, std::span<const Vector3> vertices,
                           std::span<const TriangleIndices> triangles,
                           const std::vector<std::int32_t>& torn, std::vector<Host>& hosts) {
  std::map<std::int32_t, std::vector<std::int32_t>> cubes;
  for (const std::int32_t vertex : torn) cubes[vertex] = {};
  for (const TriangleIndices& t : triangles) {
    for (const std::int32_t vertex : t) {
      const auto found = cubes.find(vertex);
      if (found == cubes.end()) continue;
      for (const std::int32_t other : t) {
        if (!cubes.contains(other)) found->second.push_back(hosts[std::size_t(other)].cube);
      }
    }
  }
  for (const auto& [vertex, beside] : cubes) {
    const auto host = cut.host_among(beside, vertices[std::size_t(vertex)]);
    if (host) hosts[std::size_t(vertex)] = *host;
  }
}

// Whether a new edge is a web between sides that lie over each other: it would be drawn out when they
// part.
bool TissueBody::joins_distant(std::span<const Vector3> vertices,
                               std::span<const TriangleIndices> triangles,
                               const std::vector<Host>& hosts) const {
  const auto is_web = [&](std::int32_t u, std::int32_t v) {
    if (std::size_t(std::max(u, v)) < vertices_.size()) return false;
    const auto rest = [&](std::int32_t k) { return lattice_.rest_place(hosts[std::size_t(k)]); };
    const Scalar now = (vertices[std::size_t(u)] - vertices[std::size_t(v)]).norm();
    return (rest(u) - rest(v)).norm() > kMostStrain * now + options_.cube_edge;
  };
  return std::ranges::any_of(triangles, [&](const TriangleIndices& t) {
    return is_web(t[0], t[1]) || is_web(t[1], t[2]) || is_web(t[2], t[0]);
  });
}

CutReport TissueBody::cut(const TissueKerf& kerf) {
  kerf.require_valid();
  CutReport report{CutStatus::Missed, lattice_.part_count()};
  std::vector<std::int32_t> parts;
  for (const Host& host : lattice_.hosts()) {
    parts.push_back(host.cube < 0 ? 0 : lattice_.part_of_cube(std::size_t(host.cube)));
  }
  const LatticeCut cut(lattice_, x_, kerf);
  const TissueSheets sheets(*this, cut);
  const KerfSurface surface =
      take_kerf({vertices_, triangles_, parts}, kerf, kCapSpacing * options_.cube_edge, &sheets);
  report.status = surface.status;
  if (surface.status != CutStatus::Cut) return report;
  std::vector<Vector3> vertices = vertices_;
  vertices.insert(vertices.end(), surface.added_W.begin(), surface.added_W.end());
  std::vector<Host> hosts =
      AddedHosts(surface, cut, vertices, lattice_.hosts()).find([&](auto triangle, const auto& p) {
        return point_on(triangle, p);
      });
  const auto has_host = [&](std::int32_t vertex) { return hosts[std::size_t(vertex)].cube >= 0; };
  const bool has_all = std::all_of(
      surface.triangles.begin(), surface.triangles.end(),
      [&](const TriangleIndices& t) { return std::all_of(t.begin(), t.end(), has_host); });
  report.status = CutStatus::Unclear;
  if (!has_all) return report;
  LatticePieces pieces = cut.divide(vertices, hosts, surface.triangles);
  for (int k = 0; k < kMostMoves && !pieces.torn.empty(); ++k) {
    move_torn(cut, vertices, surface.triangles, pieces.torn, hosts);
    pieces = cut.divide(vertices, hosts, surface.triangles);
  }
  if (!pieces.torn.empty() || pieces.cubes.empty()) return report;
  if (joins_distant(vertices, surface.triangles, hosts)) return report;
  take_surface(surface, pieces);
  take(pieces);
  return {CutStatus::Cut, lattice_.part_count()};
}

// Only the vertices that triangles use.
void TissueBody::take_surface(const KerfSurface& surface, LatticePieces& pieces) {
  std::vector<std::int32_t> number(pieces.hosts.size(), -1);
  std::vector<Host> hosts;
  triangles_.clear();
  for (std::size_t t = 0; t < surface.triangles.size(); ++t) {
    if (!pieces.keeps_triangle[t]) continue;
    for (const std::int32_t vertex : surface.triangles[t]) number[std::size_t(vertex)] = 0;
    triangles_.push_back(surface.triangles[t]);
  }
  for (std::size_t v = 0; v < number.size(); ++v) {
    if (number[v] < 0) continue;
    number[v] = std::int32_t(hosts.size());
    hosts.push_back(pieces.hosts[v]);
  }
  for (TriangleIndices& t : triangles_) {
    for (std::int32_t& vertex : t) vertex = number[std::size_t(vertex)];
  }
  pieces.hosts = std::move(hosts);
  vertices_.resize(pieces.hosts.size());
}

// Nodes go on where and as fast as they were, so what is left keeps its momentum.
void TissueBody::take(const LatticePieces& pieces) {
  const Scalar energy = elastic_energy_;
  lattice_.become(pieces, options_.material);
  const auto of_nodes = [&](const NodeVectors& old) {
    NodeVectors now(3, Eigen::Index(pieces.old_nodes.size()));
    for (Eigen::Index n = 0; n < now.cols(); ++n) {
      now.col(n) = old.col(pieces.old_nodes[std::size_t(n)]);
    }
    return now;
  };
  rest_ = of_nodes(rest_);
  x_ = of_nodes(x_);
  v_ = of_nodes(v_);
  last_impulses_ = of_nodes(last_impulses_);
  std::vector<Quaternion> turns;
  for (const LatticePieces::Cube& cube : pieces.cubes)
    turns.push_back(turns_[std::size_t(cube.old)]);
  turns_ = std::move(turns);
  rotations_.resize(turns_.size());
  node_rotations_.resize(pieces.old_nodes.size());
  number_free_nodes();
  find_rotations();
  find_forces();
  bound_energy(energy, pieces);
  factorise();
  if (!surface_number_.empty()) number_surface_nodes();
  place_vertices();
}

// A cut cube is integrated over other points than a whole one and finds its rotation from them: by
// that part its energy could be more than before.
void TissueBody::bound_energy(Scalar most, const LatticePieces& pieces) {
  if (elastic_energy_ <= most) return;
  std::vector<std::size_t> changed;
  Scalar energy = 0;
  for (std::size_t k = 0; k < pieces.cubes.size(); ++k) {
    if (!pieces.cubes[k].is_changed) continue;
    changed.push_back(k);
    const Vector24 displacement = strained(k);
    energy += displacement.dot(lattice_.element(k).stiffness * displacement) / 2;
  }
  if (!(energy > 0)) return;
  const Scalar wanted = (energy - (elastic_energy_ - most)) / energy;
  lattice_.soften(changed, std::max(wanted, kLeastSoftening));
  find_forces();
}

}  // namespace dyop::tissue_internal
