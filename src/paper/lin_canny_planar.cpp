// SPDX-License-Identifier: BSD-3-Clause
#include "dyop/core/error.h"
#include "dyop/paper/lin_canny.h"
#include "paper/planar_core.h"

// The walk in the plane. Edge k of a polygon goes from vertex k to the next one.
namespace dyop {
namespace {

using namespace paper_internal;
using Place = LinCannyCache::Place;

std::size_t number_of(const Feature& feature) {
  return static_cast<std::size_t>(feature.vertices[0]);
}

template <typename Polygon>
std::size_t before(const Polygon& polygon, std::size_t k) {
  return (k == 0 ? polygon.size() : k) - 1;
}

template <typename PolygonA, typename PolygonB>
PlanarWitness vertex_witness(const PolygonA& a, std::size_t i, const PolygonB& b, std::size_t j) {
  const Vector2 w = b[j] - a[i];
  return {w, w, w.squaredNorm(), a[i], b[j], planar_vertex(i), planar_vertex(j), w, w};
}

// Edges that do not cross are nearest at an end of one. (For edges that cross nothing is proven.)
template <typename PolygonA, typename PolygonB>
PlanarWitness edge_witness(const PolygonA& a, std::size_t i, const PolygonB& b, std::size_t j) {
  PlanarWitness best = edge_vertex_witness(a, i, b, j);
  for (const PlanarWitness& other :
       {edge_vertex_witness(a, i, b, after(b, j)), swapped(edge_vertex_witness(b, j, a, i)),
        swapped(edge_vertex_witness(b, j, a, after(a, i)))}) {
    if (other.length_sq < best.length_sq) best = other;
  }
  return best;
}

template <typename PolygonA, typename PolygonB>
PlanarWitness nearest(const PolygonA& a, FeatureKind kind_a, std::size_t i, const PolygonB& b,
                      FeatureKind kind_b, std::size_t j) {
  const bool is_edge_a = kind_a == FeatureKind::Edge;
  const bool is_edge_b = kind_b == FeatureKind::Edge;
  if (is_edge_a && is_edge_b) return edge_witness(a, i, b, j);
  if (is_edge_a) return edge_vertex_witness(a, i, b, j);
  if (is_edge_b) return swapped(edge_vertex_witness(b, j, a, i));
  return vertex_witness(a, i, b, j);
}

// Sign of the enclosed area: 1 for counterclockwise, 0 for none.
template <typename Polygon>
Scalar sense_of(const Polygon& polygon) {
  Scalar area = 0;
  for (std::size_t k = 2; k < polygon.size(); ++k) {
    area += cross(polygon[k - 1] - polygon[0], polygon[k] - polygon[0]);
  }
  return static_cast<Scalar>((area > 0) - (area < 0));
}

template <typename PolygonA, typename PolygonB>
class PlanarWalk {
 public:
  PlanarWalk(const PolygonA& a, const PolygonB& b, const PlanarWitness& start)
      : a_(a), b_(b), sense_a_(sense_of(a)), sense_b_(sense_of(b)), pair_(start) {}

  void run(int limit) {
    while (steps_ < limit) {
      ++steps_;
      if (is_behind(a_, sense_a_, pair_.feature_a, pair_.w) ||
          is_behind(b_, sense_b_, pair_.feature_b, -pair_.w)) {
        if (!jump()) return;
      } else if (!step()) {
        return;
      }
    }
  }

  const PlanarWitness& pair() const { return pair_; }
  int steps() const { return steps_; }

 private:
  // The edge at the vertex along which a step along w goes the most; nothing for an edge.
  template <typename Polygon>
  static bool has_steeper_edge(const Polygon& polygon, const Feature& feature, const Vector2& w,
                               std::size_t& edge) {
    if (feature.kind != FeatureKind::Vertex) return false;
    const std::size_t k = number_of(feature);
    const Vector2 forth = polygon[after(polygon, k)] - polygon[k];
    const Vector2 back = polygon[before(polygon, k)] - polygon[k];
    const Scalar along_forth = std::max(forth.dot(w), Scalar{0});
    const Scalar along_back = std::max(back.dot(w), Scalar{0});
    const bool is_forth = along_forth * along_forth * back.squaredNorm() >
                          along_back * along_back * forth.squaredNorm();
    edge = is_forth ? k : before(polygon, k);
    return along_forth > 0 || along_back > 0;
  }

  template <typename Polygon>
  static Vector2 outward(const Polygon& polygon, Scalar sense, std::size_t edge) {
    return sense * rotated_clockwise(polygon[after(polygon, edge)] - polygon[edge]);
  }

  template <typename Polygon>
  static bool is_behind(const Polygon& polygon, Scalar sense, const Feature& feature,
                        const Vector2& w) {
    return feature.kind == FeatureKind::Edge &&
           outward(polygon, sense, number_of(feature)).dot(w) < 0;
  }

  // The edge that p is farthest in front of; false if p is behind all edges.
  template <typename Polygon>
  static bool has_edge_in_front(const Polygon& polygon, Scalar sense, const Vector2& p,
                                std::size_t& edge) {
    Scalar farthest = 0;
    for (std::size_t k = 0; k < polygon.size(); ++k) {
      const Vector2 n = outward(polygon, sense, k);
      const Scalar height = n.dot(p - polygon[k]) / n.norm();
      if (!(height > farthest)) continue;
      farthest = height;
      edge = k;
    }
    return farthest > 0;
  }

  bool keep_if_nearer(const PlanarWitness& next) {
    if (!(next.length_sq < pair_.length_sq)) return false;
    pair_ = next;
    return true;
  }

  bool step() {
    std::size_t edge = 0;
    if (has_steeper_edge(a_, pair_.feature_a, pair_.w, edge) &&
        keep_if_nearer(nearest(a_, FeatureKind::Edge, edge, b_, pair_.feature_b.kind,
                               number_of(pair_.feature_b)))) {
      return true;
    }
    return has_steeper_edge(b_, pair_.feature_b, -pair_.w, edge) &&
           keep_if_nearer(nearest(a_, pair_.feature_a.kind, number_of(pair_.feature_a), b_,
                                  FeatureKind::Edge, edge));
  }

  // As in space: moves away from behind an edge, a limited number of times.
  bool jump() {
    if (++jumps_ > kFeatureJumpLimit) return false;
    std::size_t edge = 0;
    if (is_behind(a_, sense_a_, pair_.feature_a, pair_.w)) {
      if (!has_edge_in_front(a_, sense_a_, pair_.p_b, edge)) return false;
      pair_ = edge_vertex_witness(a_, edge, b_, number_of(pair_.feature_b));
    } else {
      if (!has_edge_in_front(b_, sense_b_, pair_.p_a, edge)) return false;
      pair_ = swapped(edge_vertex_witness(b_, edge, a_, number_of(pair_.feature_a)));
    }
    return true;
  }

  const PolygonA& a_;
  const PolygonB& b_;
  Scalar sense_a_;
  Scalar sense_b_;
  PlanarWitness pair_;
  int steps_ = 0;
  int jumps_ = 0;
};

template <typename Polygon>
Vector2 middle(const Polygon& polygon) {
  Vector2 sum = Vector2::Zero();
  for (std::size_t k = 0; k < polygon.size(); ++k) sum += polygon[k];
  return sum / static_cast<Scalar>(polygon.size());
}

template <typename Polygon>
std::size_t farthest_along(const Polygon& polygon, const Vector2& direction) {
  std::size_t best = 0;
  for (std::size_t k = 1; k < polygon.size(); ++k) {
    if (polygon[k].dot(direction) > polygon[best].dot(direction)) best = k;
  }
  return best;
}

template <typename Polygon>
bool has(const Polygon& polygon, const Place& place) {
  const bool is_feature = place.kind == FeatureKind::Vertex || place.kind == FeatureKind::Edge;
  return is_feature && place.number >= 0 && static_cast<std::size_t>(place.number) < polygon.size();
}

// From the last query, or from the vertices facing the other's middle.
template <typename PolygonA, typename PolygonB>
PlanarWitness start_of(const PolygonA& a, const PolygonB& b, const LinCannyCache* cache) {
  if (cache != nullptr && has(a, cache->a) && has(b, cache->b)) {
    return nearest(a, cache->a.kind, static_cast<std::size_t>(cache->a.number), b, cache->b.kind,
                   static_cast<std::size_t>(cache->b.number));
  }
  const Vector2 direction = middle(b) - middle(a);
  return vertex_witness(a, farthest_along(a, direction), b, farthest_along(b, -direction));
}

template <typename PolygonA, typename PolygonB>
PlanarDistance walk_and_prove(const PolygonA& a, const PolygonB& b, int limit,
                              LinCannyCache* cache) {
  PlanarWalk<PolygonA, PolygonB> walk(a, b, start_of(a, b, cache));
  walk.run(limit);
  const PlanarWitness& pair = walk.pair();
  const Scalar size = planar_size(a, b);
  const PlanarDistance result = proven_distance(a, b, size, pair);
  const bool is_proven = is_certified(result, size);
  if (cache != nullptr) {
    *cache = {{pair.feature_a.kind, pair.feature_a.vertices[0]},
              {pair.feature_b.kind, pair.feature_b.vertices[0]},
              walk.steps(),
              is_proven};
  }
  return is_proven ? result : resolve_polygons(a, b);
}

}  // namespace

PlanarDistance lin_canny_distance(const PlanarTriangle& a, const PlanarTriangle& b,
                                  LinCannyCache* cache) {
  return walk_and_prove(a, b, kTriangleFeatureLimit, cache);
}

PlanarDistance lin_canny_distance(std::span<const Vector2> a, std::span<const Vector2> b,
                                  LinCannyCache* cache) {
  DYOP_REQUIRE(!a.empty() && !b.empty(), "a polygon needs a vertex; these have ", a.size(), " and ",
               b.size());
  constexpr std::size_t kMost = kLargestTriangleCount;
  DYOP_REQUIRE(a.size() + b.size() <= kMost / kFeatureLimit, "at most ", kMost / kFeatureLimit,
               " vertices, not ", a.size() + b.size());
  return walk_and_prove(a, b, kFeatureLimit * static_cast<int>(a.size() + b.size()), cache);
}

}  // namespace dyop
