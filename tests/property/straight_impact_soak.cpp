// SPDX-License-Identifier: BSD-3-Clause

// Times of impact in closed form, of balls and half-spaces on straight lines, against exact rational
// arithmetic and the general search:
//   straight_impact_soak COUNT [SEED]
// Sizes 1e-4 to 1e4, ratios of sizes up to 1e6, up to 1e6 sizes from the origin and from the time
// zero; passes through the middle, grazing to 1e-14, from as near as contact and as far as 1e6
// sizes, balls that spin, balls off their body's origin, points. Prints how many queries were
// answered in closed form and how; exit code 1 if any answer breaks its promise: t_safe before the
// true time, t_hit at or after it, status as from the search, witness points, bounds.

#include <gmpxx.h>

#include <array>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <memory>
#include <optional>
#include <random>

#include "dyop/geometry/half_space.h"
#include "dyop/geometry/primitives.h"
#include "dyop/motion/steady_motions.h"
#include "support/inputs/random_inputs.h"
#include "toi/rigid/straight_impact.h"

namespace dyop::testing {
namespace {

using Rational = mpq_class;
using toi_internal::ImpactBand;
using toi_internal::straight_impact;

// A ball about any point of its frame, of any radius, also zero.
class PlacedBall final : public ConvexShape {
 public:
  PlacedBall(const Vector3& center, Scalar radius)
      : ConvexShape({.kind = CoreKind::Point,
                     .is_centred = center.isZero(0),
                     .rounding_radius = radius,
                     .bounding_radius = (center.norm() + radius) * (1 + 0x1p-50),
                     .center = center}) {}

  SupportPoint core_support(const Vector3&) const override { return {simple_core().center, 0}; }
  Scalar rounding_radius() const override { return simple_core().rounding_radius; }
  Vector3 core_center() const override { return simple_core().center; }
  AlignedBox bounding_box() const override {
    const Vector3 reach = Vector3::Constant(rounding_radius());
    return {core_center() - reach, core_center() + reach};
  }
  Scalar bounding_radius() const override { return simple_core().bounding_radius; }
  MassProperties compute_mass_properties(Scalar) const override { return {}; }
};

using Exact = std::array<Rational, 3>;

Exact exact(const Vector3& v) {
  return {Rational(v[0]), Rational(v[1]), Rational(v[2])};
}
Exact operator+(const Exact& x, const Exact& y) {
  return {x[0] + y[0], x[1] + y[1], x[2] + y[2]};
}
Exact operator-(const Exact& x, const Exact& y) {
  return {x[0] - y[0], x[1] - y[1], x[2] - y[2]};
}
Exact operator*(const Rational& s, const Exact& x) {
  return {s * x[0], s * x[1], s * x[2]};
}
Rational dot(const Exact& x, const Exact& y) {
  return x[0] * y[0] + x[1] * y[1] + x[2] * y[2];
}
Exact turned(const Matrix3& R, const Vector3& p) {
  return {dot(exact(R.row(0)), exact(p)), dot(exact(R.row(1)), exact(p)),
          dot(exact(R.row(2)), exact(p))};
}

struct Side {
  std::shared_ptr<ConvexShape> shape;
  std::shared_ptr<ConstantTwistMotion> motion;

  bool is_plane() const { return shape->simple_core().kind == CoreKind::HalfSpace; }
  Rational radius() const { return Rational(shape->simple_core().rounding_radius); }
  Exact velocity() const { return exact(motion->twist(0).v_WB); }
  Exact origin(const Rational& t) const {
    return exact(motion->X_WB0().translation()) + (t - Rational(motion->t0())) * velocity();
  }
  // Of a ball; an eccentric one does not turn.
  Exact center(const Rational& t) const {
    const Vector3& p = shape->simple_core().center;
    return origin(t) + turned(motion->X_WB0().rotation(), p);
  }
};

struct Query {
  Side a;
  Side b;
  TimeInterval interval;
  ToiOptions options;
};

// How the gap runs, exactly.
class Truth {
 public:
  explicit Truth(const Query& query) : query_(query) {}

  // Whether the gap is at least `gap` at t, or at all times from the begin to t.
  bool is_apart(const Rational& gap, const Rational& t) const {
    if (plane()) return height(t) - ball().radius() >= gap;
    return is_beyond(gap, dot(between(t), between(t)));
  }
  bool was_apart(const Rational& gap, const Rational& t) const {
    const Rational begin(query_.interval.begin);
    if (!is_apart(gap, begin) || !is_apart(gap, t)) return false;
    if (plane()) return true;
    const Exact v = query_.b.velocity() - query_.a.velocity();
    const Rational speed_sq = dot(v, v);
    if (speed_sq == 0) return true;
    const Rational least = begin - dot(between(begin), v) / speed_sq;
    return least <= begin || least >= t || is_apart(gap, least);
  }
  bool is_closing(const Rational& t) const {
    if (plane()) return height(t + 1) < height(t);
    return dot(between(t), query_.b.velocity() - query_.a.velocity()) < 0;
  }
  Exact between(const Rational& t) const { return query_.b.center(t) - query_.a.center(t); }

 private:
  const Side* plane() const {
    return query_.a.is_plane() ? &query_.a : query_.b.is_plane() ? &query_.b : nullptr;
  }
  const Side& ball() const { return query_.a.is_plane() ? query_.b : query_.a; }
  Rational height(const Rational& t) const {
    const auto& half_space = static_cast<const HalfSpace&>(*plane()->shape);
    const Exact n = turned(plane()->motion->X_WB0().rotation(), half_space.normal());
    return dot(n, ball().center(t) - plane()->origin(t)) - Rational(half_space.offset());
  }
  bool is_beyond(const Rational& gap, const Rational& distance_sq) const {
    const Rational reach = gap + query_.a.radius() + query_.b.radius();
    return reach <= 0 || distance_sq >= reach * reach;
  }

  const Query& query_;
};

// --- random queries -----------------------------------------------------------------------------

class Draw {
 public:
  explicit Draw(std::mt19937_64& random) : random_(random) {}

  Query query() {
    const Scalar size = std::pow(10, Scalar(2 * index(5)) - 4);
    Query query;
    const bool is_plane = index(3) == 0;
    const std::shared_ptr<ConvexShape> ball_a = ball(size);
    const std::shared_ptr<ConvexShape> ball_b = ball(index(4) == 0 ? size * small() : size);
    const Scalar length = random_magnitude(-3, 3, random_);
    const Scalar begin = index(3) == 0   ? 0
                         : index(8) == 0 ? length * random_magnitude(2, 6, random_)
                                         : length * random_number(-3, 3, random_);
    query.interval = {begin, begin + length};
    query.options.distance_tolerance = size * random_magnitude(-9, -2, random_);
    if (index(2) == 0) query.options.target_distance = size * random_magnitude(-4, 1, random_);
    const Scalar half_space_offset = index(2) == 0 ? 0 : size * random_number(-3, 3, random_);
    const auto half_space =
        std::make_shared<HalfSpace>(random_direction(random_), half_space_offset);
    place(query, is_plane ? std::static_pointer_cast<ConvexShape>(half_space) : ball_a, ball_b,
          size);
    if (index(2) == 0) std::swap(query.a, query.b);
    return query;
  }

 private:
  int index(int count) { return random_index(count, random_); }
  Scalar small() { return random_magnitude(-6, 0, random_); }
  std::shared_ptr<ConvexShape> ball(Scalar size) {
    const Scalar radius = size * random_number(0.2, 1, random_);
    if (index(6) == 0) return std::make_shared<PlacedBall>(Vector3::Zero(), 0);
    if (index(4) == 0) {
      return std::make_shared<PlacedBall>(size * random_vector(3, random_), radius);
    }
    return std::make_shared<Sphere>(radius);
  }

  // How far off the middle the line of approach passes, in reaches.
  Scalar offset() {
    switch (index(5)) {
      case 0:
        return 0;
      case 1:
        return random_number(0, 1, random_);
      case 2:
        return 1 + (index(2) == 0 ? 1 : -1) * random_magnitude(-14, -2, random_);
      case 3:
        return random_number(1, 2, random_);
      default:
        return random_number(0, 1.05, random_);
    }
  }

  void place(Query& query, const std::shared_ptr<ConvexShape>& a,
             const std::shared_ptr<ConvexShape>& b, Scalar size) {
    const SimpleCore& core_a = a->simple_core();
    const SimpleCore& core_b = b->simple_core();
    const bool is_plane = core_a.kind == CoreKind::HalfSpace;
    const Scalar reach = core_a.rounding_radius + core_b.rounding_radius +
                         query.options.target_distance + *query.options.distance_tolerance / 2;
    const Scalar length = query.interval.length();
    const Scalar start = reach * (1 + (index(2) == 0 ? random_magnitude(-8, 6, random_)
                                                     : random_number(0, 5, random_)));
    const Matrix3 R_WA(random_rotation(random_));
    const Vector3 n_W = is_plane ? Vector3(R_WA * static_cast<const HalfSpace&>(*a).normal())
                                 : random_direction(random_);
    const Vector3 across = n_W.unitOrthogonal() * (is_plane ? 1 : offset() * reach);
    const Vector3 apart = start * n_W + across;
    const Scalar speed = index(12) == 0 ? 0 : start / length * random_number(-0.5, 4, random_);
    Vector3 v_AB = -speed * n_W;
    if (is_plane || index(10) == 0)
      v_AB += speed * random_number(-3, 3, random_) * n_W.unitOrthogonal();
    const Vector3 v_WA = index(2) == 0 ? Vector3::Zero() : random_vector(3 * speed, random_);
    const Scalar far = index(2) == 0 ? 0 : size * random_magnitude(0, 6, random_);
    const Vector3 p_WA = far * random_direction(random_);
    const Matrix3 R_WB(random_rotation(random_));
    const Scalar foot = is_plane ? static_cast<const HalfSpace&>(*a).offset() : 0;
    const Vector3 center_a = p_WA + foot * n_W + R_WA * core_a.center;
    const Vector3 p_WB = center_a + apart - R_WB * core_b.center;
    query.a = {a, motion(core_a, R_WA, p_WA, v_WA, query.interval)};
    query.b = {b, motion(core_b, R_WB, p_WB, v_WA + v_AB, query.interval)};
  }

  // With this position at the begin of the interval, up to rounding.
  std::shared_ptr<ConstantTwistMotion> motion(const SimpleCore& core, const Matrix3& R,
                                              const Vector3& p, const Vector3& v,
                                              const TimeInterval& interval) {
    const Scalar before = index(2) == 0 ? 0 : interval.length() * random_number(-2, 2, random_);
    const bool may_turn = core.kind == CoreKind::Point && core.is_centred;
    const Vector3 w = may_turn && index(2) == 0
                          ? Vector3(random_vector(10 / interval.length(), random_))
                          : Vector3(Vector3::Zero());
    return std::make_shared<ConstantTwistMotion>(RigidPose(R, p - before * v), Twist{v, w},
                                                 interval.begin - before);
  }

  std::mt19937_64& random_;
};

// --- what an answer must keep -------------------------------------------------------------------

// What is wrong with an answer in closed form, or null.
const char* broken_impact(const Query& query, const Truth& truth, const ImpactBand& band,
                          const ToiResult& result) {
  const Rational noise(result.rounding_allowance);
  const Rational t(result.t_safe);
  if (!truth.is_closing(t)) return "the impact is not closing";
  if (truth.is_apart(Rational(band.contact) + 2 * noise, t)) return "the impact is too far apart";
  if (result.t_hit) {
    const Rational hit(*result.t_hit);
    if (!(result.t_safe < *result.t_hit && *result.t_hit <= query.interval.end))
      return "t_hit is off";
    if (truth.is_apart(Rational(band.leaf_target), hit)) return "t_hit is before the true time";
    const Rational nudge = Rational(std::nextafter(*result.t_hit, -kInfinity)) - hit;
    if (!truth.is_apart(Rational(band.leaf_target) - 3 * noise, hit + 4 * nudge))
      return "t_hit is late";
  }
  const ImpactContact& contact = *result.contact;
  if (!truth.is_apart(Rational(contact.lower), t)) return "the lower bound is too large";
  if (truth.is_apart(Rational(contact.upper) + Rational(1e-300), t))
    return "the upper bound is too small";
  const auto is_on = [&](const Side& side, const Vector3& p) {
    if (side.is_plane()) {
      const auto& half_space = static_cast<const HalfSpace&>(*side.shape);
      const Exact n = turned(side.motion->X_WB0().rotation(), half_space.normal());
      const Rational off = dot(n, exact(p) - side.origin(t)) - Rational(half_space.offset());
      return abs(off) <= noise;
    }
    const Exact from = exact(p) - side.center(t);
    const Rational inner = side.radius() - noise;
    const Rational outer = side.radius() + noise;
    return dot(from, from) <= outer * outer && (inner <= 0 || dot(from, from) >= inner * inner);
  };
  if (!is_on(query.a, contact.p_WCa) || !is_on(query.b, contact.p_WCb)) return "a witness is off";
  const Exact witness = exact(contact.p_WCb) - exact(contact.p_WCa);
  const Rational most = Rational(contact.upper) + noise;
  if (dot(witness, witness) > most * most) return "the witness points are too far apart";
  return nullptr;
}

const char* broken(const Query& query, const ImpactBand& band, const ToiResult& result) {
  const Truth truth(query);
  const Rational t(result.t_safe);
  if (!truth.was_apart(Rational(band.leaf_target), t)) return "t_safe is after the true time";
  const RigidPose X_WA = query.a.motion->pose(result.t_safe);
  if (X_WA.translation() != result.X_WA.translation()) return "the pose is not that at t_safe";
  if (result.status == ToiStatus::Impact) return broken_impact(query, truth, band, result);
  if (result.status != ToiStatus::Separated) return "the status is no answer";
  return result.t_safe == query.interval.end ? nullptr : "t_safe is not the end";
}

// Whether the shapes pass each other within the band, which may be reported or not; or the search
// found no answer for rounding.
bool is_grazing(const Query& query, const ImpactBand& band, const ToiResult& other) {
  if (other.status == ToiStatus::NumericalLimit) {
    return band.tolerance <= 4 * other.rounding_allowance;
  }
  const Truth truth(query);
  const Rational noise(other.rounding_allowance);
  const Rational end(query.interval.end);
  return truth.was_apart(Rational(band.guaranteed) - noise, end) &&
         !truth.was_apart(Rational(band.largest_impact) + noise, end);
}

struct Counts {
  long impacts = 0;
  long with_hit = 0;
  long separated = 0;
  long left = 0;  // to the search
  long same_bits = 0;
  long grazing = 0;  // in the band or within rounding, answered by only one of the two
  long wrong = 0;
};

// The same query by the search: a deadline is not for the closed form.
ToiResult searched(const Query& query) {
  ToiOptions options = query.options;
  options.deadline = std::chrono::steady_clock::time_point::max();
  return time_of_impact(*query.a.shape, *query.a.motion, *query.b.shape, *query.b.motion,
                        query.interval, options);
}

void check(const Query& query, Counts& counts) {
  const ImpactBand band(query.options.target_distance, *query.options.distance_tolerance);
  ToiResult result;
  if (!straight_impact({*query.a.shape, *query.a.motion, *query.b.shape, *query.b.motion,
                        query.interval, query.options, band},
                       result)) {
    ++counts.left;
    return;
  }
  ++(result.status == ToiStatus::Impact ? counts.impacts : counts.separated);
  counts.with_hit += result.t_hit.has_value();
  const char* wrong = broken(query, band, result);
  const ToiResult other = searched(query);
  counts.same_bits += other.t_safe == result.t_safe;
  if (other.status != result.status) {
    ++counts.grazing;
    if (!wrong && !is_grazing(query, band, other)) wrong = "the search has another status";
  }
  if (!wrong) return;
  if (++counts.wrong <= 20) {
    std::printf("%s: %s, t_safe %.17g, allowance %g, tolerance %g; by search %s, t_safe %.17g\n",
                wrong, name_of(result.status).data(), result.t_safe, result.rounding_allowance,
                band.tolerance, name_of(other.status).data(), other.t_safe);
  }
}

int run(long count, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  Draw draw(random);
  Counts counts;
  for (long k = 0; k < count; ++k) check(draw.query(), counts);
  std::printf(
      "%ld queries: %ld impacts (%ld with t_hit), %ld separated, %ld left to the search; "
      "t_safe of the search in %ld; %ld grazing, %ld wrong\n",
      count, counts.impacts, counts.with_hit, counts.separated, counts.left, counts.same_bits,
      counts.grazing, counts.wrong);
  const bool is_representative = counts.impacts > count / 5 && counts.separated > count / 5;
  return counts.wrong == 0 && is_representative ? 0 : 1;
}

}  // namespace
}  // namespace dyop::testing

int main(int argc, char** argv) {
  const long count = argc > 1 ? std::atol(argv[1]) : 0;
  const long seed = argc > 2 ? std::atol(argv[2]) : 1;
  if (count <= 0 || seed < 0) {
    std::fprintf(stderr, "usage: straight_impact_soak COUNT [SEED]\n");
    return 2;
  }
  return dyop::testing::run(count, static_cast<std::uint64_t>(seed));
}
