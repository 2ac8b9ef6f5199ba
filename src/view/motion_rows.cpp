// SPDX-License-Identifier: BSD-3-Clause
#include "view/motion_rows.h"

#include <algorithm>
#include <cmath>

#include "dyop/core/error.h"
#include "dyop/motion/composed_motion.h"
#include "dyop/motion/steady_motions.h"

namespace dyop::view_internal {
namespace {

TimeInterval meet(const TimeInterval& a, const TimeInterval& b) {
  return {std::max(a.begin, b.begin), std::min(a.end, b.end)};
}

// The motion of the centre of mass, if that is how `motion` is made (about_center() of dynamics).
const Motion* central_motion(const Motion& motion, const Vector3& p_BoBcm) {
  const auto* composed = dynamic_cast<const ComposedMotion*>(&motion);
  if (composed == nullptr) return nullptr;
  const auto* offset = dynamic_cast<const RestMotion*>(&composed->inner());
  if (offset == nullptr) return nullptr;
  const RigidPose X_MB = offset->pose(0);
  const bool is_central = X_MB.translation() == -p_BoBcm && X_MB.rotation().isIdentity(0);
  return is_central ? &composed->outer() : nullptr;
}

constexpr int kMostHalvings = 40;
constexpr Scalar kTightGap = 2;  // upper bound over lower one, beyond which a gap is not measured

// The rotation of a rotation vector, and back: as page/motion.js computes them.
Quaternion quaternion_of(const Vector3& turn) {
  const Scalar angle = turn.norm();
  const Scalar factor = angle > 1e-4  // literal: below, the series has all digits
                            ? std::sin(angle / 2) / angle
                            : 0.5 - angle * angle / 48;
  return {std::cos(angle / 2), factor * turn.x(), factor * turn.y(), factor * turn.z()};
}

Vector3 turn_of(const Quaternion& q) {
  const Scalar sine = q.vec().norm();
  const Scalar sign = q.w() < 0 ? -1 : 1;
  if (!(sine > 0)) return Vector3::Zero();
  return sign * 2 * std::atan2(sine, sign * q.w()) / sine * q.vec();
}

}  // namespace

void MotionRows::Spans::add(const Body& the_body, const TimeInterval& interval, bool central) {
  body.push_back(the_body.number);
  begin.push_back(interval.begin);
  end.push_back(interval.end);
  is_central.push_back(central ? 1 : 0);
}

void MotionRows::Spans::add_to(ColumnBlock& block, const std::string& kind) const {
  block.add(kind + ".body", std::span(body));
  block.add(kind + ".begin", std::span(begin));
  block.add(kind + ".end", std::span(end));
  block.add(kind + ".central", std::span(is_central));
}

void MotionRows::Poses::add(const RigidPose& X) {
  const Quaternion q = X.quaternion();
  position.push_back(X.translation());
  vector.push_back(q.vec());
  scalar.push_back(q.w());
}

Quaternion MotionRows::Poses::quaternion(std::size_t row) const {
  return {scalar[row], vector[row].x(), vector[row].y(), vector[row].z()};
}

void MotionRows::Poses::add_to(ColumnBlock& block, const std::string& kind) const {
  block.add(kind + ".p", std::span(position));
  block.add(kind + ".q", std::span(vector));
  block.add(kind + ".qw", std::span(scalar));
}

void MotionRows::add(const Body& body, const TimeInterval& interval, const Motion* motion) {
  if (motion == nullptr) {
    absent_.add(body, interval, false);
  } else {
    add_motion(body, interval, *motion);
  }
}

void MotionRows::add_motion(const Body& body, const TimeInterval& interval, const Motion& motion) {
  if (const auto* sequence = dynamic_cast<const SequenceMotion*>(&motion)) {
    for (const SequenceMotion::Part& part : sequence->parts()) {
      const TimeInterval common = meet(part.interval, interval);
      if (common.begin < common.end) add_motion(body, common, *part.motion);
    }
    return;
  }
  if (add_exact(body, interval, motion, false)) return;
  const Motion* central = central_motion(motion, body.p_BoBcm);
  if (central != nullptr && add_exact(body, interval, *central, true)) return;
  Scalar t = interval.begin;
  while (t < interval.end) {  // ends: smooth_until() is after t
    const Scalar next = std::min(interval.end, motion.smooth_until(t));
    add_cubics(body, {t, next}, motion);
    t = next;
  }
}

bool MotionRows::add_exact(const Body& body, const TimeInterval& interval, const Motion& motion,
                           bool is_central) {
  if (dynamic_cast<const RestMotion*>(&motion) != nullptr) {
    add_rest(body, interval, motion.pose(interval.begin), is_central);
  } else if (const auto* twist = dynamic_cast<const ConstantTwistMotion*>(&motion)) {
    add_twist(body, interval, *twist, is_central);
  } else if (const auto* screw = dynamic_cast<const ScrewMotion*>(&motion)) {
    add_screw(body, interval, *screw, is_central);
  } else if (const auto* cubic = dynamic_cast<const HermiteMotion*>(&motion)) {
    add_cubic(body, interval, *cubic, is_central);
  } else {
    return false;
  }
  return true;
}

// Halves the interval until the cubic through the states at its ends is close enough; parts wait on
// a stack, the next one last.
void MotionRows::add_cubics(const Body& body, const TimeInterval& interval, const Motion& motion) {
  struct Part {
    TimeInterval interval;
    int halvings;
  };
  std::vector<Part> waiting{{interval, 0}};
  while (!waiting.empty()) {
    const auto [part, halvings] = waiting.back();
    waiting.pop_back();
    MotionState end = motion.state(part.end);
    // The twist at the end is that of the next part, if it jumps there: use a time just before.
    if (part.end == interval.end) {
      end.twist = motion.twist(std::nextafter(part.end, part.begin));
    }
    const HermiteMotion cubic(part, motion.state(part.begin), end);
    const Scalar middle = part.begin + part.length() / 2;
    const bool is_divisible = part.begin < middle && middle < part.end && halvings < kMostHalvings;
    if (!is_divisible || is_close(body, cubic, part, motion)) {
      add_cubic(body, part, cubic, false);
    } else {
      waiting.push_back({{middle, part.end}, halvings + 1});
      waiting.push_back({{part.begin, middle}, halvings + 1});
    }
  }
}

bool MotionRows::is_close(const Body& body, const HermiteMotion& cubic,
                          const TimeInterval& interval, const Motion& motion) const {
  constexpr int kSamples = 8;
  for (int k = 1; k < kSamples; ++k) {
    const Scalar t = interval.begin + interval.length() * k / kSamples;
    const RigidPose X = motion.pose(t);
    const RigidPose Y = cubic.pose(t);
    const Scalar length = body.radius + X.translation().norm();
    if (!((X.translation() - Y.translation()).norm() <= tolerance_ * length)) return false;
    if (!(rotation_vector(X.rotation().transpose() * Y.rotation()).norm() <= tolerance_)) {
      return false;
    }
  }
  return true;
}

void MotionRows::add_rest(const Body& body, const TimeInterval& interval, const RigidPose& X,
                          bool is_central) {
  rest_.spans.add(body, interval, is_central);
  rest_.poses.add(X);
}

void MotionRows::add_twist(const Body& body, const TimeInterval& interval,
                           const ConstantTwistMotion& motion, bool is_central) {
  twist_.spans.add(body, interval, is_central);
  twist_.poses.add(motion.X_WB0());
  const Twist twist = motion.twist(motion.t0());
  twist_.t0.push_back(motion.t0());
  twist_.v_W.push_back(twist.v_WB);
  twist_.w_W.push_back(twist.w_WB);
}

void MotionRows::add_screw(const Body& body, const TimeInterval& interval,
                           const ScrewMotion& motion, bool is_central) {
  screw_.spans.add(body, interval, is_central);
  screw_.poses.add(motion.X_WB0());
  screw_.t0.push_back(motion.t0());
  screw_.turn_rate.push_back(motion.screw().turn_rate);
  screw_.slide_rate.push_back(motion.screw().slide_rate);
  screw_.p_WA.push_back(motion.screw().p_WA);
  screw_.axis_W.push_back(motion.screw().axis_W.stableNormalized());
}

void MotionRows::add_cubic(const Body& body, const TimeInterval& interval,
                           const HermiteMotion& motion, bool is_central) {
  cubic_.spans.add(body, interval, is_central);
  cubic_.charts.add(motion.X_WC());
  cubic_.domain_begin.push_back(motion.domain().begin);
  cubic_.domain_end.push_back(motion.domain().end);
  cubic_.p0.push_back(motion.begin().p_WB);
  cubic_.v0.push_back(motion.begin().v_WB);
  cubic_.theta0.push_back(motion.begin().theta);
  cubic_.theta_rate0.push_back(motion.begin().theta_rate);
  cubic_.p1.push_back(motion.end().p_WB);
  cubic_.v1.push_back(motion.end().v_WB);
  cubic_.theta1.push_back(motion.end().theta);
  cubic_.theta_rate1.push_back(motion.end().theta_rate);
}

void MotionRows::add_screws_to(ColumnBlock& block) const {
  screw_.spans.add_to(block, "screw");
  screw_.poses.add_to(block, "screw");
  block.add("screw.t0", std::span(screw_.t0));
  block.add("screw.turn_rate", std::span(screw_.turn_rate));
  block.add("screw.slide_rate", std::span(screw_.slide_rate));
  block.add("screw.point", std::span(screw_.p_WA));
  block.add("screw.axis", std::span(screw_.axis_W));
}

void MotionRows::add_to(ColumnBlock& block) const {
  absent_.add_to(block, "absent");
  rest_.spans.add_to(block, "rest");
  rest_.poses.add_to(block, "rest");
  twist_.spans.add_to(block, "twist");
  twist_.poses.add_to(block, "twist");
  block.add("twist.t0", std::span(twist_.t0));
  block.add("twist.v", std::span(twist_.v_W));
  block.add("twist.w", std::span(twist_.w_W));
  add_screws_to(block);
  cubic_.spans.add_to(block, "cubic");
  cubic_.charts.add_to(block, "cubic");
  block.add("cubic.domain_begin", std::span(cubic_.domain_begin));
  block.add("cubic.domain_end", std::span(cubic_.domain_end));
  block.add("cubic.p0", std::span(cubic_.p0));
  block.add("cubic.v0", std::span(cubic_.v0));
  block.add("cubic.theta0", std::span(cubic_.theta0));
  block.add("cubic.theta_rate0", std::span(cubic_.theta_rate0));
  block.add("cubic.p1", std::span(cubic_.p1));
  block.add("cubic.v1", std::span(cubic_.v1));
  block.add("cubic.theta1", std::span(cubic_.theta1));
  block.add("cubic.theta_rate1", std::span(cubic_.theta_rate1));
}

// What the columns of a chunk hold of one body after another, and where the page will have the
// body after the last segment: in page/chunk.js the same formulas lead to the same place.
struct RoundedMotions {
  explicit RoundedMotions(const Rounding& steps) : rounding(steps) {}

  const Rounding& rounding;
  MotionRows::Body body = {};
  bool is_central = false;
  Vector3 p = Vector3::Zero();
  Quaternion q = Quaternion::Identity();
  Vector3 v = Vector3::Zero();
  Vector3 w = Vector3::Zero();
  std::vector<std::uint32_t> count, begin, end;
  std::vector<std::uint8_t> kind;
  RoundedVectors places, turns, velocities, spins;
  // Of cubics only.
  RoundedVectors angles, next_velocities, next_rates, next_places, next_angles;

  void start(const MotionRows::Body& next) {
    body = next;
    is_central = false;
    p = v = w = Vector3::Zero();
    q = Quaternion::Identity();
  }

  // The point that moves is now the centre of mass, or the origin.
  void set_central(bool central) {
    if (central != is_central) p += (central ? 1.0 : -1.0) * (q * body.p_BoBcm);
    is_central = central;
  }

  // Of angular velocities, where that of velocities is `step`.
  Scalar spin_step(Scalar step) const { return step / rounding.place * rounding.turn(body.radius); }

  void pose(const Vector3& place, const Quaternion& orientation) {
    p = places.add(place, p, rounding.place);
    const Vector3 turn = turn_of(q.conjugate() * orientation);
    q = q * quaternion_of(turns.add(turn, Vector3(Vector3::Zero()), rounding.turn(body.radius)));
  }
};

std::vector<MotionRows::Entry> MotionRows::entries() const {
  std::vector<Entry> list;
  for (const Kind kind : {Kind::Rest, Kind::Twist, Kind::Cubic}) {
    const Spans& spans = spans_of(kind);
    for (std::size_t row = 0; row < spans.body.size(); ++row) {
      list.push_back({spans.body[row], spans.begin[row], kind, row});
    }
  }
  std::ranges::stable_sort(list, {},
                           [](const Entry& entry) { return std::pair(entry.body, entry.begin); });
  return list;
}

const MotionRows::Spans& MotionRows::spans_of(Kind kind) const {
  return kind == Kind::Rest ? rest_.spans : kind == Kind::Twist ? twist_.spans : cubic_.spans;
}

void MotionRows::round_rest(std::size_t row, RoundedMotions& to) const {
  to.pose(rest_.poses.position[row], rest_.poses.quaternion(row));
  to.v = to.w = Vector3::Zero();
}

void MotionRows::round_twist(std::size_t row, RoundedMotions& to) const {
  const Scalar begin = twist_.spans.begin[row];
  const Scalar since = begin - twist_.t0[row];
  const Scalar h = twist_.spans.end[row] - begin;
  const Vector3& v = twist_.v_W[row];
  const Vector3& w = twist_.w_W[row];
  to.pose(twist_.poses.position[row] + since * v,
          quaternion_of(since * w) * twist_.poses.quaternion(row));
  const Scalar step = to.rounding.velocity_over(h);
  to.v = to.velocities.add(v, to.v, step);
  to.w = to.spins.add(w, to.w, to.spin_step(step));
  to.p += h * to.v;
  to.q = quaternion_of(h * to.w) * to.q;
}

// The ends of the cubic over its own interval, which may be a part of its domain.
HermiteNode MotionRows::cubic_at(std::size_t row, Scalar t) const {
  const TimeInterval domain{cubic_.domain_begin[row], cubic_.domain_end[row]};
  const HermiteNode first{cubic_.p0[row], cubic_.v0[row], cubic_.theta0[row],
                          cubic_.theta_rate0[row]};
  const HermiteNode last{cubic_.p1[row], cubic_.v1[row], cubic_.theta1[row],
                         cubic_.theta_rate1[row]};
  if (t <= domain.begin) return first;
  if (t >= domain.end) return last;
  const Scalar h = domain.length();
  const Scalar s = (t - domain.begin) / h;
  const Scalar r = 1 - s;
  const auto value = [&](const Vector3& a, const Vector3& va, const Vector3& b,
                         const Vector3& vb) -> Vector3 {
    return a + s * s * (3 - 2 * s) * (b - a) + h * s * r * (r * va - s * vb);
  };
  const auto rate = [&](const Vector3& a, const Vector3& va, const Vector3& b,
                        const Vector3& vb) -> Vector3 {
    return 6 * s * r / h * (b - a) + r * (1 - 3 * s) * va + s * (3 * s - 2) * vb;
  };
  return {value(first.p_WB, first.v_WB, last.p_WB, last.v_WB),
          rate(first.p_WB, first.v_WB, last.p_WB, last.v_WB),
          value(first.theta, first.theta_rate, last.theta, last.theta_rate),
          rate(first.theta, first.theta_rate, last.theta, last.theta_rate)};
}

void MotionRows::round_cubic(std::size_t row, RoundedMotions& to) const {
  const Scalar h = cubic_.spans.end[row] - cubic_.spans.begin[row];
  const HermiteNode first = cubic_at(row, cubic_.spans.begin[row]);
  const HermiteNode last = cubic_at(row, cubic_.spans.end[row]);
  const Scalar turn = to.rounding.turn(to.body.radius);
  const Scalar velocity = to.rounding.velocity_over(h);
  const Scalar spin = to.spin_step(velocity);
  to.pose(first.p_WB, cubic_.charts.quaternion(row) * quaternion_of(first.theta));
  const Vector3 angle = to.angles.add(first.theta, Vector3(Vector3::Zero()), turn);
  const Quaternion chart = to.q * quaternion_of(-angle);
  const Vector3 v0 = to.velocities.add(first.v_WB, to.v, velocity);
  const Vector3 rate0 = to.spins.add(first.theta_rate, chart.conjugate() * to.w, spin);
  const Vector3 v1 = to.next_velocities.add(last.v_WB, v0, velocity);
  const Vector3 rate1 = to.next_rates.add(last.theta_rate, rate0, spin);
  to.p = to.next_places.add(last.p_WB, to.p + h / 2 * (v0 + v1), to.rounding.place);
  to.v = v1;
  const Vector3 next = to.next_angles.add(last.theta, angle + h / 2 * (rate0 + rate1), turn);
  to.q = chart * quaternion_of(next);
  to.w = chart * rate1;  // nearly: the next segment is expected to go on with it
}

void MotionRows::add_times_to(TimeTable& times) const {
  for (const Kind kind : {Kind::Rest, Kind::Twist, Kind::Cubic}) {
    for (const double t : spans_of(kind).begin) times.add(t);
    for (const double t : spans_of(kind).end) times.add(t);
  }
}

void MotionRows::add_rounded_to(ColumnBlock& block, const Rounding& rounding,
                                std::span<const Body> bodies, const TimeTable& times) const {
  RoundedMotions to(rounding);
  to.count.assign(bodies.size(), 0);
  const Entry* last = nullptr;
  std::uint32_t end = 0;
  const std::vector<Entry> list = entries();
  for (const Entry& entry : list) {
    if (last == nullptr || last->body != entry.body) {
      to.start(bodies[entry.body]);
      end = 0;
    }
    last = &entry;
    const Spans& spans = spans_of(entry.kind);
    const bool is_central = spans.is_central[entry.row] != 0;
    ++to.count[entry.body];
    to.kind.push_back(std::uint8_t(int(entry.kind) | (is_central ? 8 : 0)));
    const std::uint32_t begin = times.at(spans.begin[entry.row]);
    to.begin.push_back(begin - end);  // wraps, and so does the page
    end = times.at(spans.end[entry.row]);
    to.end.push_back(end - begin);
    to.set_central(is_central);
    if (entry.kind == Kind::Rest) round_rest(entry.row, to);
    if (entry.kind == Kind::Twist) round_twist(entry.row, to);
    if (entry.kind == Kind::Cubic) round_cubic(entry.row, to);
  }
  block.add("segment.count", std::span(to.count));
  block.add("segment.kind", std::span(to.kind));
  block.add("segment.begin", std::span(to.begin));
  block.add("segment.end", std::span(to.end));
  to.places.add_to(block, "segment.p");
  to.turns.add_to(block, "segment.turn");
  to.velocities.add_to(block, "segment.v");
  to.spins.add_to(block, "segment.w");
  to.angles.add_to(block, "segment.angle");
  to.next_velocities.add_to(block, "segment.next_v");
  to.next_rates.add_to(block, "segment.next_rate");
  to.next_places.add_to(block, "segment.next_p");
  to.next_angles.add_to(block, "segment.next_angle");
  absent_.add_to(block, "absent");
  add_screws_to(block);
}

void add_pair(const PairRecord& pair, const TimeInterval& frame, PageSpan& span) {
  const bool is_resting = pair.proof == ProofKind::AtRest;
  PageGap gap;
  gap.t = frame.end;
  gap.a = pair.a;
  gap.b = pair.b;
  gap.lower = pair.gap_lower;
  // A pair without contacts may not have been measured.
  if (pair.gap_upper >= pair.gap_lower) gap.upper = pair.gap_upper;
  gap.is_resting = is_resting;
  gap.proof = pair.proof;
  const auto nearest = std::ranges::min_element(
      pair.contacts, {}, [](const PairContact& contact) { return contact.point.gap; });
  if (nearest != pair.contacts.end()) {
    gap.witness_W = {nearest->point.p_WCa, nearest->point.p_WCb};
  } else if (!(gap.upper <= kTightGap * gap.lower)) {
    gap.upper = kInfinity;  // a bound, but no measure of the gap
  } else {
    gap.pivot_W = pair.pivot_W;  // where the gap is, as there are no witness points
  }
  span.gaps.push_back(gap);
  for (const PairContact& contact : pair.contacts) {
    const ContactPoint& point = contact.point;
    span.contacts.push_back({frame, pair.a, pair.b, is_resting, (point.p_WCa + point.p_WCb) / 2,
                             point.nhat_AB_W, contact.impulse_W});
  }
}

void add_witness(PageGap& gap, const Shape& a, const RigidPose& X_WA, const Shape& b,
                 const RigidPose& X_WB, DistanceCache& cache) {
  const DistanceResult result = distance(a, X_WA, b, X_WB, {}, cache);
  gap.lower = std::max(gap.lower, result.lower);
  gap.upper = result.upper;
  gap.witness_W = {result.p_WCa, result.p_WCb};
}

void place_impact(ImpactEvent& event, const Shape& a, const RigidPose& X_WA, const Shape& b,
                  const RigidPose& X_WB) {
  if (!event.toi.contact) return;
  const DistanceResult result = distance(a, X_WA, b, X_WB);
  if (result.status != DistanceStatus::Separated) return;
  static_cast<WitnessPair&>(*event.toi.contact) = result;
  event.toi.X_WA = X_WA;
  event.toi.X_WB = X_WB;
}

const char* undecided_words(AdvanceStatus status) {
  switch (status) {
    case AdvanceStatus::BudgetExhausted:
      return "budget exhausted";
    case AdvanceStatus::NumericalLimit:
      return "numerical limit";
    case AdvanceStatus::Blocked:
      return "blocked by bodies on prescribed motions";
    case AdvanceStatus::Cancelled:
      return "cancelled";
    case AdvanceStatus::NotRun:
    case AdvanceStatus::Completed:
    case AdvanceStatus::StoppedAtImpact:
      return nullptr;
  }
  return nullptr;
}

const char* ending_words(AdvanceStatus status, Scalar t, Scalar planned_end) {
  switch (status) {
    case AdvanceStatus::NotRun:
      return "nothing was run";
    case AdvanceStatus::Completed:
      return t >= planned_end ? "it reached its planned end"
                              : "it was ended before its planned end, with everything proven";
    case AdvanceStatus::StoppedAtImpact:
      return "it stops at impacts, as asked";
    case AdvanceStatus::BudgetExhausted:
      return "its budget or deadline was used up";
    case AdvanceStatus::NumericalLimit:
      return "rounding forbids the distances asked for";
    case AdvanceStatus::Blocked:
      return "bodies or friction left no way to go on";
    case AdvanceStatus::Cancelled:
      return "it was stopped by its user";
  }
  return "not known";
}

}  // namespace dyop::view_internal
