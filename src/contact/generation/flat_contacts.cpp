// SPDX-License-Identifier: BSD-3-Clause
#include "contact/generation/flat_contacts.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <optional>

#include "core/tolerance.h"
#include "dyop/distance/distance.h"
#include "dyop/geometry/convex_shape.h"

namespace dyop::contact_internal {
namespace {

// Contacts on the rim of a disc that lies on a larger area: corners of a hexagon.
constexpr int kRimPoints = 6;
// A contact counts as near as the nearest points if its gap is larger by at most this part of the
// reach. Larger: bodies that lean are held a little too late; smaller: more contacts.
constexpr Scalar kAsNear = 1e-3;  // literal: below what a rest offset can be felt
// How far inside the rim the sides of the hexagon run, in radii.
constexpr Scalar kHexagonSagitta = 0.134;
// A side still counts as facing another shape, at the end of a step, if it leans by this sine.
constexpr Scalar kFlatEndSine = 0.2;
// The rims of two discs whose middles are nearer, in radii, have no nearest places.
constexpr Scalar kLeastOffset = 0.05;

Vector3 unit_or_zero(const Vector3& v) {
  const Scalar length = v.norm();
  return length > 0 ? Vector3(v / length) : Vector3::Zero();
}

// Finds, among the vertices that `visit` calls back with, the one whose line from `from` is most
// nearly perpendicular to d. None beyond the sine.
class LineSearch {
 public:
  LineSearch(const Vector3& from, const Vector3& d, Scalar sine)
      : from_(from), d_(d), least_(sine) {}

  void add(const Vector3& to) {
    const Vector3 along = to - from_;
    const Scalar length = along.norm();
    if (!(length > 0)) return;
    const Scalar sine = std::abs(along.dot(d_)) / length;
    if (sine > least_ || (is_found_ && sine == least_)) return;
    least_ = sine;
    to_ = to;
    is_found_ = true;
  }
  // Both ends are moved by a rounding radius, perpendicular to the line.
  FacingPart line(Scalar radius) const {
    FacingPart part;
    if (!is_found_) return part;
    const Vector3 along = (to_ - from_).normalized();
    const Vector3 out = radius * unit_or_zero(d_ - along * along.dot(d_));
    part.kind = FacingPart::Kind::Line;
    part.corners = {from_ + out, to_ + out};
    return part;
  }

 private:
  Vector3 from_, d_;
  Scalar least_;
  Vector3 to_ = Vector3::Zero();
  bool is_found_ = false;
};

Vector3 area_vector(const TriangleMesh& mesh, std::size_t triangle) {
  const Triangle t = mesh.triangle(std::int32_t(triangle));
  return (t[1] - t[0]).cross(t[2] - t[0]);
}

// All vertices in the plane of a face, anticlockwise about its normal m.
std::vector<Vector3> face_corners(const TriangleMesh& mesh, const Vector3& m, Scalar noise) {
  Scalar top = -kInfinity;
  for (const Vector3& v : mesh.vertices()) top = std::max(top, m.dot(v));
  std::vector<Vector3> corners;
  Vector3 middle = Vector3::Zero();
  for (const Vector3& v : mesh.vertices()) {
    if (m.dot(v) < top - noise) continue;
    corners.push_back(v);
    middle += v;
  }
  middle /= Scalar(corners.size());
  const Vector3 x = m.unitOrthogonal();
  const Vector3 y = m.cross(x);
  const auto angle = [&](const Vector3& v) {
    return std::atan2(y.dot(v - middle), x.dot(v - middle));
  };
  std::sort(corners.begin(), corners.end(),
            [&](const Vector3& v, const Vector3& w) { return angle(v) < angle(w); });
  return corners;
}

// The facing part of a convex shape whose core is a polytope, in its own frame.
FacingPart polytope_part(const ConvexShape& shape, const Vector3& d, Scalar sine, Scalar noise) {
  const TriangleMesh& mesh = *shape.core_surface();
  FacingPart part;
  Vector3 best = Vector3::Zero();
  Scalar best_cosine = 0;
  for (std::size_t k = 0; k < mesh.triangles().size(); ++k) {
    const Vector3 area = area_vector(mesh, k);
    const Scalar length = area.norm();
    if (!(length > 0) || !(area.dot(d) > best_cosine * length)) continue;
    best_cosine = area.dot(d) / length;
    best = area / length;
  }
  const bool is_face = mesh.is_closed() && best_cosine > 0 && best.cross(d).norm() <= sine;
  if (is_face) part.corners = face_corners(mesh, best, noise);
  if (part.corners.size() >= 3) {
    part.kind = FacingPart::Kind::Polygon;
    part.normal = best;
    part.center = part.corners.front() + shape.rounding_radius() * best;
    for (Vector3& corner : part.corners) corner += shape.rounding_radius() * best;
    return part;
  }
  const auto vertex = shape.core_support(d).vertex;
  if (!vertex) return {};
  LineSearch search(mesh.vertices()[std::size_t(*vertex)], d, sine);
  for (const TriangleIndices& t : mesh.triangles()) {
    if (std::find(t.begin(), t.end(), *vertex) == t.end()) continue;
    for (const std::int32_t other : t) search.add(mesh.vertices()[std::size_t(other)]);
  }
  return search.line(shape.rounding_radius());
}

FacingPart smooth_part(const ConvexShape& shape, const Vector3& d, Scalar sine) {
  const FlatPart flat = shape.flat_part(d, sine);
  FacingPart part;
  if (flat.kind == FlatPart::Kind::Disc) {
    part.kind = FacingPart::Kind::Disc;
    part.normal = flat.axis;
    part.center = flat.center + shape.rounding_radius() * flat.axis;
    part.across = flat.axis.unitOrthogonal();
    part.radius = flat.radius;
  } else if (flat.kind == FlatPart::Kind::Segment) {
    part.kind = FacingPart::Kind::Line;
    part.is_side = true;
    const Vector3 along = flat.axis.normalized();
    const Vector3 center =
        flat.center + shape.rounding_radius() * unit_or_zero(d - along * along.dot(d));
    part.corners = {center - flat.axis, center + flat.axis};
  }
  return part;
}

void move(FacingPart& part, const RigidPose& X) {
  part.normal = X.rotation() * part.normal;
  part.across = X.rotation() * part.across;
  part.center = X * part.center;
  for (Vector3& corner : part.corners) corner = X * corner;
}

// Where p lies above the plane of an area.
Vector3 foot_on(const FacingPart& area, const Vector3& p) {
  return p - area.normal * area.normal.dot(p - area.center);
}

// How far p is inside the side of a polygon that begins at corner k, times the side's length.
Scalar inside_side(const FacingPart& polygon, std::size_t k, const Vector3& p) {
  const Vector3& from = polygon.corners[k];
  const Vector3& to = polygon.corners[(k + 1) % polygon.corners.size()];
  return (to - from).cross(p - from).dot(polygon.normal);
}

bool is_above(const FacingPart& area, const Vector3& p, Scalar noise) {
  if (area.kind == FacingPart::Kind::Disc) {
    return (foot_on(area, p) - area.center).norm() <= area.radius + noise;
  }
  const std::size_t count = area.corners.size();
  for (std::size_t k = 0; k < count; ++k) {
    const Scalar length = (area.corners[(k + 1) % count] - area.corners[k]).norm();
    if (inside_side(area, k, p) < -noise * length) return false;
  }
  return true;
}

// The part of a segment, from 0 to 1, and the sides of a polygon that end it; -1: its own ends.
struct Stretch {
  std::array<Scalar, 2> at{0, 1};
  std::array<int, 2> sides{-1, -1};
  bool is_empty() const { return !(at[0] <= at[1]); }
  void end_at(int which, Scalar t, int side) {
    const auto k = std::size_t(which);
    if (which == 0 ? t <= at[k] : t >= at[k]) return;
    at[k] = t;
    sides[k] = side;
  }
};

// Where |p + t d| = r for points of a plane, in order; none if that is nowhere.
std::optional<std::array<Scalar, 2>> circle_crossings(const Vector3& p, const Vector3& d,
                                                      Scalar r) {
  const Scalar d_sq = d.squaredNorm();
  if (!(d_sq > 0)) return std::nullopt;
  const Scalar middle = -p.dot(d) / d_sq;
  const Scalar room = r * r - (p + middle * d).squaredNorm();
  if (!(room >= 0)) return std::nullopt;
  const Scalar half = std::sqrt(room / d_sq);
  return std::array<Scalar, 2>{middle - half, middle + half};
}

Stretch above_area(const FacingPart& area, const Vector3& from, const Vector3& to) {
  Stretch stretch;
  if (area.kind == FacingPart::Kind::Disc) {
    const Vector3 p = foot_on(area, from) - area.center;
    const auto ends = circle_crossings(p, foot_on(area, to) - area.center - p, area.radius);
    if (!ends) return {{1, 0}, {-1, -1}};
    stretch.end_at(0, (*ends)[0], 0);
    stretch.end_at(1, (*ends)[1], 0);
    return stretch;
  }
  for (std::size_t k = 0; k < area.corners.size(); ++k) {
    const Scalar at_from = inside_side(area, k, from);
    const Scalar at_to = inside_side(area, k, to);
    if (at_from < 0 && at_to < 0) return {{1, 0}, {-1, -1}};
    if (at_from < 0) stretch.end_at(0, at_from / (at_from - at_to), int(k));
    if (at_to < 0) stretch.end_at(1, at_from / (at_from - at_to), int(k));
  }
  return stretch;
}

// Finds the contacts of two parts.
class FlatPairs {
 public:
  FlatPairs(const ContactQuery& query, const FacingPart& a, const FacingPart& b,
            const NearestPoints& nearest, std::vector<FoundContact>& found)
      : query_(query), a_(a), b_(b), nearest_(nearest), found_(found) {}

  bool run();

 private:
  enum class Place : std::uint8_t { PointOfA, PointOfB, Crossing };

  const FacingPart& part(bool of_a) const { return of_a ? a_ : b_; }
  // Keeps a pair of points, p on the shape `p_is_of_a` says and q on the other one, along the
  // outward normal of one of them.
  struct Pair {
    bool p_is_of_a;
    Vector3 p, q;
    bool normal_is_of_a;
    Vector3 outwards;
  };
  void emit(const Pair& pair, Place place, int index, bool is_inner = false);
  void add_point(bool of_a, const Vector3& p, int index, bool is_inner = false);
  void add_points(bool of_a);
  void add_rim(bool of_a);
  void cross_circle_and_polygon(bool circle_is_of_a);
  void cross_circles();
  void add_line_on_area(bool line_is_of_a);
  void add_lines();

  const ContactQuery& query_;
  const FacingPart& a_;
  const FacingPart& b_;
  const NearestPoints& nearest_;
  std::vector<FoundContact>& found_;
  Scalar least_gap_ = kInfinity;
};

void FlatPairs::emit(const Pair& pair, Place place, int index, bool is_inner) {
  FoundContact contact;
  contact.p_a = pair.p_is_of_a ? pair.p : pair.q;
  contact.p_b = pair.p_is_of_a ? pair.q : pair.p;
  contact.normal = pair.normal_is_of_a ? pair.outwards : Vector3(-pair.outwards);
  contact.normal_is_of_b = !pair.normal_is_of_a;
  const Scalar gap = contact.normal.dot(contact.p_b - contact.p_a);
  if (gap > query_.reach || gap < -query_.noise) return;
  least_gap_ = std::min(least_gap_, gap);
  if (is_inner) return;
  contact.lower = nearest_.lower;
  contact.upper = std::max(nearest_.lower, (contact.p_b - contact.p_a).norm() + query_.noise);
  contact.key.a.number = contact.key.b.number = 1 + 3 * index + int(place);
  found_.push_back(contact);
}

void FlatPairs::add_point(bool of_a, const Vector3& p, int index, bool is_inner) {
  const FacingPart& other = part(!of_a);
  if (!is_above(other, p, query_.noise)) return;
  emit({of_a, p, foot_on(other, p), !of_a, other.normal}, of_a ? Place::PointOfA : Place::PointOfB,
       index, is_inner);
}

// Corners of a hexagon, and where the rim is lowest: else a disc that leans would first sink onto a
// side of the hexagon. Of two discs also the places nearest the middle of the other.
void FlatPairs::add_rim(bool of_a) {
  const FacingPart& disc = part(of_a);
  const FacingPart& other = part(!of_a);
  const Vector3 beside = disc.normal.cross(disc.across);
  for (int k = 0; k < kRimPoints; ++k) {
    const Scalar angle = 2 * std::numbers::pi * k / kRimPoints;
    const Vector3 out = std::cos(angle) * disc.across + std::sin(angle) * beside;
    add_point(of_a, disc.center + disc.radius * out, k);
  }
  const Vector3 down = -other.normal + disc.normal * disc.normal.dot(other.normal);
  const Scalar dip = kHexagonSagitta * disc.radius * down.norm();
  if (dip > kAsNear * query_.reach) {
    add_point(of_a, disc.center + disc.radius * down.normalized(), kRimPoints);
  }
  if (other.kind != FacingPart::Kind::Disc) return;
  const Vector3 offset = foot_on(disc, other.center) - disc.center;
  if (offset.norm() > kLeastOffset * disc.radius) {
    add_point(of_a, disc.center + disc.radius * offset.normalized(), kRimPoints + 1);
  }
}

void FlatPairs::add_points(bool of_a) {
  const FacingPart& own = part(of_a);
  if (own.kind == FacingPart::Kind::Disc) return add_rim(of_a);
  for (std::size_t k = 0; k < own.corners.size(); ++k) {
    add_point(of_a, own.corners[k], int(k), own.is_inner_corner(k));
  }
}

void FlatPairs::cross_circle_and_polygon(bool circle_is_of_a) {
  const FacingPart& disc = part(circle_is_of_a);
  const FacingPart& polygon = part(!circle_is_of_a);
  const std::size_t count = polygon.corners.size();
  for (std::size_t k = 0; k < count; ++k) {
    const Vector3& from = polygon.corners[k];
    const Vector3 along = polygon.corners[(k + 1) % count] - from;
    const Vector3 p = foot_on(disc, from) - disc.center;
    const Vector3 d = along - disc.normal * disc.normal.dot(along);
    const auto ends = circle_crossings(p, d, disc.radius);
    if (!ends) continue;
    for (std::size_t i = 0; i < 2; ++i) {
      const Scalar t = (*ends)[i];
      if (t < 0 || t > 1) continue;
      const Vector3 q = from + t * along;
      emit({circle_is_of_a, foot_on(disc, q), q, circle_is_of_a, disc.normal}, Place::Crossing,
           int(2 * k + i), polygon.is_inner_side(k));
    }
  }
}

void FlatPairs::cross_circles() {
  const Vector3 offset = foot_on(a_, b_.center) - a_.center;
  const Scalar apart = offset.norm();
  if (!(apart > std::abs(a_.radius - b_.radius)) || !(apart < a_.radius + b_.radius)) return;
  const Vector3 x = offset / apart;
  const Vector3 y = a_.normal.cross(x);
  // Where both circles have the same height above the line of their middles.
  const Scalar along = apart / 2 + (a_.radius - b_.radius) * ((a_.radius + b_.radius) / apart) / 2;
  const Scalar height = std::sqrt(std::max(Scalar{0}, (a_.radius - along) * (a_.radius + along)));
  for (int k = 0; k < 2; ++k) {
    const Vector3 p = a_.center + along * x + (k == 0 ? height : -height) * y;
    // Seen along A's normal, a disc that leans is an ellipse.
    const Vector3 out = foot_on(b_, p) - b_.center;
    const Vector3 q = b_.center + b_.radius * out.normalized();
    emit({true, p, q, true, a_.normal}, Place::Crossing, k);
  }
}

void FlatPairs::add_line_on_area(bool line_is_of_a) {
  const FacingPart& line = part(line_is_of_a);
  const FacingPart& area = part(!line_is_of_a);
  const Vector3& from = line.corners[0];
  const Vector3 along = line.corners[1] - from;
  const Stretch stretch = above_area(area, from, line.corners[1]);
  if (stretch.is_empty()) return;
  for (std::size_t k = 0; k < 2; ++k) {
    const Vector3 p = from + stretch.at[k] * along;
    const int side = stretch.sides[k];
    const bool is_inner = side >= 0 && area.is_inner_side(std::size_t(side));
    emit({line_is_of_a, p, foot_on(area, p), !line_is_of_a, area.normal},
         line_is_of_a ? Place::PointOfA : Place::PointOfB, int(k), is_inner);
  }
}

// The ends of the stretch that two nearly parallel lines share. The normal tilts with every shift
// sideways, so they must be more nearly parallel than a line is to an area.
void FlatPairs::add_lines() {
  const Vector3 u = a_.corners[1] - a_.corners[0];
  const Vector3 v = b_.corners[1] - b_.corners[0];
  if (!(u.cross(v).norm() <= query_.options.border_tolerance * u.norm() * v.norm())) return;
  const auto along_a = [&](const Vector3& p) { return u.dot(p - a_.corners[0]) / u.squaredNorm(); };
  const auto [low, high] = std::minmax({along_a(b_.corners[0]), along_a(b_.corners[1])});
  const std::array<Scalar, 2> ends{std::max(Scalar{0}, low), std::min(Scalar{1}, high)};
  if (!(ends[0] < ends[1])) return;
  const Vector3 n =
      unit_or_zero(nearest_.nhat_AB - u * (u.dot(nearest_.nhat_AB) / u.squaredNorm()));
  for (std::size_t k = 0; k < 2; ++k) {
    const Vector3 p = a_.corners[0] + ends[k] * u;
    const Scalar s = std::clamp(v.dot(p - b_.corners[0]) / v.squaredNorm(), 0.0, 1.0);
    const Vector3 q = b_.corners[0] + s * v;
    // The normal is that of a curved side.
    emit({true, p, q, a_.is_side, a_.is_side ? n : Vector3(-n)}, Place::Crossing, int(k));
  }
}

bool FlatPairs::run() {
  using Kind = FacingPart::Kind;
  if (a_.kind == Kind::None || b_.kind == Kind::None) return false;
  if (a_.has_area() && b_.has_area()) {
    add_points(true);
    add_points(false);
    if (a_.kind == Kind::Disc && b_.kind == Kind::Disc) {
      cross_circles();
    } else if (a_.kind == Kind::Disc || b_.kind == Kind::Disc) {
      cross_circle_and_polygon(a_.kind == Kind::Disc);
    }
  } else if (a_.has_area() || b_.has_area()) {
    add_line_on_area(b_.has_area());
  } else {
    add_lines();
  }
  return least_gap_ <= nearest_.upper + kAsNear * query_.reach;
}

bool is_smooth(const Shape& shape) {
  return shape.kind() == ShapeKind::Convex &&
         static_cast<const ConvexShape&>(shape).core_surface() == nullptr;
}

// The line of a shape's side that faces a direction; of none without one there.
FlatPart side_of(const Shape& shape, const RigidPose& X_W, const Vector3& direction_W) {
  if (!is_smooth(shape)) return {};
  const FlatPart part = static_cast<const ConvexShape&>(shape).flat_part(
      X_W.rotation().transpose() * direction_W, kFlatEndSine);
  return part.kind == FlatPart::Kind::Segment ? part : FlatPart{};
}

// A point of a shape that faced `from_W`, and faces `to_W` when the shape has moved. A rounded core
// is taken at its centre.
Vector3 moved_point(const Shape& shape, const Vector3& p_S, const Matrix3& R_WS,
                    const Vector3& from_W, const RigidPose& X_WS_end, const Vector3& to_W) {
  const Scalar radius = shape.kind() == ShapeKind::Convex
                            ? static_cast<const ConvexShape&>(shape).rounding_radius()
                            : Scalar{0};
  const FlatPart side = side_of(shape, X_WS_end, to_W);
  if (side.kind == FlatPart::Kind::Segment) {
    const Scalar along = side.axis.dot(p_S - side.center) / side.axis.squaredNorm();
    return X_WS_end * (side.center + std::clamp(along, Scalar{-1}, Scalar{1}) * side.axis) +
           radius * to_W;
  }
  return X_WS_end * (p_S - radius * (R_WS.transpose() * from_W)) + radius * to_W;
}

}  // namespace

FacingPart facing_part(const ConvexShape& shape, const RigidPose& X_AS, const Vector3& direction_A,
                       Scalar sine, Scalar noise) {
  const Vector3 d = X_AS.rotation().transpose() * direction_A;
  FacingPart part =
      shape.core_surface() ? polytope_part(shape, d, sine, noise) : smooth_part(shape, d, sine);
  move(part, X_AS);
  return part;
}

FacingPart facing_part(const ContactSurface& mesh, std::int32_t triangle, const RigidPose& X_AS,
                       const Vector3& direction_A, Scalar sine) {
  FacingPart part;
  Triangle t = mesh.mesh->triangle(triangle);
  for (Vector3& corner : t) corner = X_AS * corner;
  const Vector3 area = (t[1] - t[0]).cross(t[2] - t[0]);
  const Scalar length = area.norm();
  if (length > 0 && area.cross(direction_A).norm() <= sine * length) {
    const bool is_outer = area.dot(direction_A) > 0;
    part.kind = FacingPart::Kind::Polygon;
    part.normal = (is_outer ? area : Vector3(-area)) / length;
    part.center = t[0];
    // From the back its corners run the other way round: sides 2, 1 and 0.
    constexpr std::array<std::array<int, 3>, 2> kCorners{{{0, 2, 1}, {0, 1, 2}}};
    for (int k = 0; k < 3; ++k) {
      const auto corner = std::size_t(kCorners[is_outer ? 1 : 0][std::size_t(k)]);
      part.corners.push_back(t[corner]);
      const std::int32_t side = 3 * triangle + (is_outer ? k : 2 - k);
      const auto edge = mesh.topology->edge_of_side(side);
      const std::int32_t vertex = mesh.indices(triangle)[corner];
      if (!mesh.features->is_contact_vertex(vertex)) part.inner_corners |= std::uint8_t(1 << k);
      if (edge && !mesh.features->is_contact_edge(*edge)) part.inner_sides |= std::uint8_t(1 << k);
    }
    return part;
  }
  const auto height = [&](const Vector3& x, const Vector3& y) {
    return direction_A.dot(x) < direction_A.dot(y);
  };
  const Vector3 top = *std::max_element(t.begin(), t.end(), height);
  LineSearch search(top, direction_A, sine);
  for (const Vector3& corner : t) search.add(corner);
  return search.line(0);
}

bool add_flat_contacts(const ContactQuery& query, const FacingPart& a, const FacingPart& b,
                       const NearestPoints& nearest, std::vector<FoundContact>& found) {
  return FlatPairs(query, a, b, nearest, found).run();
}

FlatEnd flat_end(const ContactPoint& point, const MovedPieces& pieces) {
  const Vector3& n = point.nhat_AB_W;
  const bool is_of_b = point.normal_is_of_b;
  const FlatPart side =
      is_of_b ? side_of(pieces.b, pieces.X_WB, -n) : side_of(pieces.a, pieces.X_WA, n);
  FlatEnd end;
  if (side.kind == FlatPart::Kind::Segment) {
    // The normal of two lines does not turn with a body that rolls.
    end.nhat_AB_W = distance(pieces.a, pieces.X_WA_end, pieces.b, pieces.X_WB_end).nhat_AB_W;
  } else {
    const RigidPose& X_WS = is_of_b ? pieces.X_WB_end : pieces.X_WA_end;
    end.nhat_AB_W = X_WS.rotation() * point.nhat_AB_S;
  }
  const Vector3& n_end = end.nhat_AB_W;
  end.p_WCa = moved_point(pieces.a, point.p_ACa, pieces.X_WA.rotation(), n, pieces.X_WA_end, n_end);
  end.p_WCb =
      moved_point(pieces.b, point.p_BCb, pieces.X_WB.rotation(), -n, pieces.X_WB_end, -n_end);
  return end;
}

}  // namespace dyop::contact_internal
