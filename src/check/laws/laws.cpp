// SPDX-License-Identifier: BSD-3-Clause
#include "check/laws/laws.h"

#include <map>
#include <optional>
#include <set>
#include <sstream>

namespace dyop_check {
namespace {

constexpr std::size_t kMostFaults = 10;
constexpr double kNoise = 1e-13;  // literal: relative, of the sums of a few rounded numbers
constexpr double kSame = 1e-9;    // literal: unit vectors, coefficients

// Defaults of a World: rest offsets over target distances; target distances over radii; the part of
// the smaller radius by which a joint closes, or a pair that began too near opens, in a substep.
constexpr double kRestOffset = 4;        // literal: unitless
constexpr double kDefaultTarget = 1e-4;  // literal: unitless
constexpr double kRecoveredPart = 0.05;  // literal: unitless
// A gap near the middle of a body asks more of its ends. Of 10, healthy runs reach 3.
constexpr double kLevers = 10;  // literal: unitless

// Velocity of the centre of mass, and angular momentum about it.
struct Momentum {
  Vec v;
  Vec L;
};

Vec on_free_axes(const Vec& v, const std::array<bool, 3>& locked) {
  return {locked[0] ? 0 : v.x, locked[1] ? 0 : v.y, locked[2] ? 0 : v.z};
}

// The x of A x = b, by Cramer's rule; zero if A is singular.
Vec solve(const Mat& A, const Vec& b) {
  const auto& m = A.m;
  const Vec x{m[0], m[3], m[6]};
  const Vec y{m[1], m[4], m[7]};
  const Vec z{m[2], m[5], m[8]};
  const double determinant = dot(x, cross(y, z));
  if (determinant == 0) return {};
  return (1 / determinant) * Vec{dot(b, cross(y, z)), dot(x, cross(b, z)), dot(x, cross(y, b))};
}

// A dynamic body at an orientation.
class Inertia {
 public:
  Inertia(const BodyLaw& body, const Mat& R_WB) : body_(body) {
    in_world_ = R_WB * body.inertia * transpose(R_WB);
    for (std::size_t k = 0; k < 3; ++k) {
      if (!body.locked_rotation[k]) continue;
      for (std::size_t i = 0; i < 3; ++i) in_world_.m[3 * k + i] = in_world_.m[3 * i + k] = 0;
      in_world_.m[4 * k] = 1;
    }
  }
  Vec turn(const Vec& L) const { return solve(in_world_, on_free_axes(L, body_.locked_rotation)); }
  double energy(const Momentum& momentum) const {
    return (body_.mass * dot(momentum.v, momentum.v) + dot(turn(momentum.L), momentum.L)) / 2;
  }

 private:
  const BodyLaw& body_;
  Mat in_world_;
};

// How a body's frame moves at an instant: its origin, and its angular velocity.
struct Velocity {
  Vec v;
  Vec w;
};

Curve rate_of(const Curve& curve) {
  Curve rate{Vec{}};
  if (curve.size() > 1) rate.clear();
  for (std::size_t k = 1; k < curve.size(); ++k) rate.push_back(double(k) * curve[k]);
  return rate;
}

// With a rotation vector theta the angular velocity is J theta', in the chart, where J = 1 + (1 -
// cos a) / a^2 [theta] + (a - sin a) / a^3 [theta]^2 and a = |theta|.
Velocity velocity_at(const Segment& g, double t) {
  const double x = t - g.t0;
  const Vec theta = value(g.turn, x);
  const Vec theta_rate = value(rate_of(g.turn), x);
  constexpr double kSmall = 1e-2;  // literal: radians; the next term of the series is below 1e-15
  const double a = norm(theta);
  const double a2 = a * a;
  const double half = a > 0 ? std::sin(a / 2) / (a / 2) : 1;
  const double square = a > kSmall ? (a - std::sin(a)) / (a * a2)
                                   : 1.0 / 6 - a2 / 120 * (1 - a2 / 42 * (1 - a2 / 72));
  const Vec across = cross(theta, theta_rate);
  const Vec w = g.R * (theta_rate + (half * half / 2) * across + square * cross(theta, across));
  const Mat axes = g.R * rotation(theta);
  const Velocity own{value(rate_of(g.place), x) - cross(w, axes * g.p_cm), w};
  if (!g.outer) return own;
  const Velocity outer = velocity_at(*g.outer, t);
  const Pose X = g.outer->pose(t);
  const Vec p = X.R * (value(g.place, x) - axes * g.p_cm);
  return {outer.v + cross(outer.w, p) + X.R * own.v, outer.w + X.R * own.w};
}

// The momenta of a body on its recorded motion.
Momentum momentum_at(const RecordedBody& body, const BodyLaw& law, const Segment& segment,
                     double t) {
  const Velocity velocity = velocity_at(segment, t);
  const Mat R = segment.pose(t).R;
  const Vec w = on_free_axes(velocity.w, law.locked_rotation);
  return {velocity.v + cross(velocity.w, R * body.center_of_mass),
          R * (law.inertia * transposed(R, w))};
}

double ratio(double part, double whole) {
  return part > 0 ? part / whole : part == 0 ? 0 : std::numeric_limits<double>::infinity();
}

// Momenta that a change left a body with.
struct Known {
  double t = 0;
  Momentum momentum;
};

// Flights.

class FlightChecker {
 public:
  FlightChecker(const Recording& recording, const LawData& data)
      : recording_(recording), data_(data), left_(recording.bodies.size()) {
    for (const Change& change : data.changes) {
      for (const MomentumRow& row : change.momenta) {
        if (!row.is_before) left_[row.body].push_back({change.time(), {row.v, row.L}});
      }
    }
  }

  FlightLaw run() {
    for (std::uint32_t k = 0; k < recording_.bodies.size(); ++k) {
      if (recording_.bodies[k].is_dynamic) check_body(k);
    }
    return law_;
  }

 private:
  void check_body(std::uint32_t k) {
    const RecordedBody& body = recording_.bodies[k];
    std::size_t next = 0;  // of left_[k]
    std::optional<Known> known;
    for (std::size_t s = 0; s < body.segments.size(); ++s) {
      const Segment& segment = body.segments[s];
      const double end = s + 1 < body.segments.size() ? body.segments[s + 1].begin : recording_.end;
      while (next < left_[k].size() && left_[k][next].t <= segment.begin) known = left_[k][next++];
      if (!segment.is_known() || !segment.is_flight() || !(segment.begin < end)) continue;
      ++law_.flights;
      if (data_.bodies[k].material(segment.begin).has_wrench) {
        ++law_.with_wrench;
        known.reset();
        continue;
      }
      check_flight(k, segment, end, known);
      known = Known{end, momentum_at(body, data_.bodies[k], segment, end)};
    }
  }

  void check_flight(std::uint32_t k, const Segment& segment, double end,
                    const std::optional<Known>& before) {
    const RecordedBody& body = recording_.bodies[k];
    const double begin = segment.begin;
    const double middle = begin + (end - begin) / 2;
    const std::array<double, 3> times{begin, middle, end};
    std::array<Momentum, 3> at;
    for (std::size_t i = 0; i < 3; ++i)
      at[i] = momentum_at(body, data_.bodies[k], segment, times[i]);
    if (before && before->t == begin) compare(k, before->momentum, at[0], begin, begin);
    compare(k, at[0], at[1], begin, middle);
    compare(k, at[1], at[2], middle, end);
  }

  void compare(std::uint32_t k, const Momentum& x, const Momentum& y, double begin, double end) {
    const BodyLaw& body = data_.bodies[k];
    const Vec fall = (end - begin) * data_.gravity(begin);
    const Vec dv = on_free_axes(y.v - x.v - fall, body.locked_translation);
    const Vec dL = on_free_axes(y.L - x.L, body.locked_rotation);
    law_.linear.take(ratio(norm(dv), std::max({norm(x.v), norm(y.v), norm(fall)})), begin, k, k);
    law_.angular.take(ratio(norm(dL), std::max({norm(x.L), norm(y.L), noise_of(k, x, fall)})),
                      begin, k, k);
  }

  // Angular momentum that counts as none: where a body hardly turns, rounding is all there is.
  double noise_of(std::uint32_t k, const Momentum& x, const Vec& fall) const {
    constexpr double kTurn = 1e-6;  // literal: of the linear momentum times the radius
    return kTurn * data_.bodies[k].mass * recording_.bodies[k].bounding_radius *
           (norm(x.v) + norm(fall));
  }

  const Recording& recording_;
  const LawData& data_;
  FlightLaw law_;
  std::vector<std::vector<Known>> left_;  // by body
};

// Contacts, joints and springs.

class ContactChecker {
 public:
  ContactChecker(const Recording& recording, const LawData& data)
      : recording_(recording), data_(data), known_(recording.bodies.size()) {}

  ContactLaw run() {
    for (const Change& change : data_.changes) check(change);
    return law_;
  }

 private:
  // A dynamic body in a change.
  struct Member {
    Momentum before;
    Momentum after;
    Vec center;
    Inertia inertia;
    // Sums of impulses, and of their sizes.
    Vec impulse;
    Vec angular;
    double size = 0;
    double angular_size = 0;
    double kick = 0;  // largest speed that forces other than contacts and links gave a point of it
  };
  using Members = std::map<std::uint32_t, Member>;

  void check(const Change& change) {
    ++law_.changes;
    Members members = members_of(change);
    switch (change.kind) {
      case Change::Kind::Stall:
        ++law_.stalls;
        return;
      case Change::Kind::Set:
        ++law_.settings;
        return;
      case Change::Kind::Sleep:
        for (const auto& [k, member] : members)
          law_.sleep.take(norm(member.before.v), change.end, k, k);
        return;
      default:
        break;
    }
    add_forces(change, members);
    for (const ContactRow& contact : change.contacts) add_contact(change, contact, members);
    for (const LinkRow& link : change.links) add_link(change, link, members);
    for (const auto& [k, member] : members) check_balance(change, k, member);
    check_contacts_of(change, members);
    if (change.kind == Change::Kind::Move) check_moves(change, members);
  }

  Members members_of(const Change& change) {
    const double t = change.time();
    std::map<std::uint32_t, Momentum> before;
    Members members;
    for (const MomentumRow& row : change.momenta) {
      const RecordedBody& body = recording_.bodies[row.body];
      if (!body.is_dynamic) throw_fault("a change of a body that is not dynamic");
      if (row.is_before) {
        before[row.body] = {row.v, row.L};
        check_continuity(change, row);
        continue;
      }
      Momentum start{row.v, row.L};
      if (before.contains(row.body)) {
        start = before[row.body];
      } else if (known_[row.body]) {
        start = known_[row.body]->momentum;
      } else if (change.kind != Change::Kind::Set) {
        throw_fault("a change of a body whose velocity before it is not known");
      }
      known_[row.body] = Known{t, {row.v, row.L}};
      const Segment* segment = body.segment(t, change.ends_a_motion());
      if (segment == nullptr) continue;  // not there
      const Pose X = segment->pose(t);
      const double middle = change.begin + (change.end - change.begin) / 2;
      const Mat R = change.kind == Change::Kind::Move ? segment->pose(middle).R : X.R;
      members.insert({row.body, Member{start,
                                       {row.v, row.L},
                                       X * body.center_of_mass,
                                       Inertia(data_.bodies[row.body], R),
                                       {},
                                       {},
                                       0,
                                       0,
                                       0}});
    }
    return members;
  }

  // A velocity before a change that is not the last one is that of a flight in between.
  void check_continuity(const Change& change, const MomentumRow& row) {
    const RecordedBody& body = recording_.bodies[row.body];
    const double t = change.time();
    const Segment* segment = body.segment(t, true);
    const bool has_flown = segment != nullptr && segment->is_flight() &&
                           (!known_[row.body] || known_[row.body]->t < t);
    if (!has_flown) {
      if (known_[row.body]) fault(change, row.body, row.body, "its velocity jumps");
      return;
    }
    const BodyLaw& law = data_.bodies[row.body];
    if (law.material(t).has_wrench) return;
    const Momentum at = momentum_at(body, law, *segment, t);
    const double speed = std::max(norm(row.v), norm(at.v));
    law_.gap.take(ratio(norm(row.v - at.v), speed), t, row.body, row.body);
  }

  void add(Member& member, const Vec& impulse, const Vec& angular) {
    member.impulse = member.impulse + impulse;
    member.angular = member.angular + angular;
    member.size += norm(impulse);
    member.angular_size += norm(angular);
  }

  void add_forces(const Change& change, Members& members) {
    std::set<std::uint32_t> has_wrench;
    for (const WrenchRow& row : change.wrenches) {
      const auto member = members.find(row.body);
      if (member == members.end()) continue;
      has_wrench.insert(row.body);
      member->second.kick = norm(row.impulse) / data_.bodies[row.body].mass +
                            recording_.bodies[row.body].bounding_radius *
                                norm(member->second.inertia.turn(row.angular));
      add(member->second, row.impulse, row.angular);
    }
    if (change.kind == Change::Kind::Impact) return;
    const double half = (change.end - change.begin) / 2;
    const Vec gravity = data_.gravity(change.begin);
    for (auto& [k, member] : members) {
      const BodyLaw& body = data_.bodies[k];
      if (has_wrench.contains(k)) continue;
      if (body.material(change.begin).has_wrench)
        fault(change, k, k, "nothing says what its own wrench did");
      member.kick = half * norm(gravity);
      add(member, on_free_axes((half * body.mass) * gravity, body.locked_translation), {});
    }
  }

  // The member of a body on which something acts; null if it is not dynamic.
  Member* member_of(const Change& change, std::uint32_t k, Members& members) {
    if (!recording_.bodies[k].is_dynamic) return nullptr;
    const auto member = members.find(k);
    if (member != members.end()) return &member->second;
    fault(change, k, k, "an impulse acts on it, but its velocity does not change");
    return nullptr;
  }

  void add_contact(const Change& change, const ContactRow& row, Members& members) {
    ++law_.contacts;
    if (std::abs(norm(row.n) - 1) > kSame)
      fault(change, row.a, row.b, "a normal is no unit vector");
    if (Member* a = member_of(change, row.a, members))
      add(*a, -1.0 * row.impulse, cross(row.p - a->center, -1.0 * row.impulse));
    if (Member* b = member_of(change, row.b, members))
      add(*b, row.impulse, cross(row.p - b->center, row.impulse));
  }

  void add_link(const Change& change, const LinkRow& row, Members& members) {
    ++law_.links;
    if (Member* a = member_of(change, row.a, members)) add(*a, -1.0 * row.impulse, row.angular_a);
    if (Member* b = member_of(change, row.b, members)) add(*b, row.impulse, row.angular_b);
  }

  void check_balance(const Change& change, std::uint32_t k, const Member& member) {
    const BodyLaw& body = data_.bodies[k];
    const double t = change.time();
    const Vec dp = body.mass * (member.after.v - member.before.v) - member.impulse;
    const Vec dL = member.after.L - member.before.L - member.angular;
    // Beside the impulses, the rounding of the momenta themselves and of the time gravity acts for.
    const double fall = std::abs(t) * norm(data_.gravity(change.begin));
    const double p_noise =
        kNoise * body.mass * (norm(member.before.v) + norm(member.after.v) + fall);
    const double L_noise =
        kNoise * (norm(member.before.L) + norm(member.after.L) +
                  member.size * (norm(member.center) + recording_.bodies[k].bounding_radius));
    const double linear = norm(on_free_axes(dp, body.locked_translation)) - p_noise;
    const double angular = norm(on_free_axes(dL, body.locked_rotation)) - L_noise;
    law_.linear.take(linear <= 0 ? 0 : ratio(linear, member.size), t, k, k);
    law_.angular.take(angular <= 0 ? 0 : ratio(angular, member.angular_size), t, k, k);
  }

  // Velocities of a body before and after a change; none if its motion is not known.
  struct Twists {
    Vec center;  // of mass
    Velocity before;
    Velocity after;

    Vec rate_before(const Vec& p) const { return before.v + cross(before.w, p - center); }
    Vec rate_after(const Vec& p) const { return after.v + cross(after.w, p - center); }
  };
  std::optional<Twists> twists(const Change& change, std::uint32_t k,
                               const Members& members) const {
    const auto found = members.find(k);
    if (found != members.end()) {
      const Member& member = found->second;
      return Twists{member.center,
                    {member.before.v, member.inertia.turn(member.before.L)},
                    {member.after.v, member.inertia.turn(member.after.L)}};
    }
    const RecordedBody& body = recording_.bodies[k];
    const double t = change.time();
    const Segment* segment = body.segment(t, change.ends_a_motion());
    if (segment == nullptr) return std::nullopt;
    // Prescribed: over a move the mean velocity.
    Velocity velocity = velocity_at(*segment, t);
    const Pose X = segment->pose(t);
    if (change.kind == Change::Kind::Move && !segment->rests()) {
      const Pose Y = segment->pose(change.end);
      const double tau = change.end - change.begin;
      velocity = {(1 / tau) * (Y.p - X.p), (1 / tau) * rotation_vector(Y.R * transpose(X.R))};
    }
    const Vec center = X * body.center_of_mass;
    velocity.v = velocity.v + cross(velocity.w, center - X.p);
    return Twists{center, velocity, velocity};
  }

  // Work of an impulse and an angular impulse about the centre of mass.
  static double work(const Twists& body, const Vec& impulse, const Vec& angular) {
    return (dot(impulse, body.before.v + body.after.v) +
            dot(angular, body.before.w + body.after.w)) /
           2;
  }

  // Of two points of a contact, relative.
  struct Rates {
    Vec before;
    Vec after;
  };

  void check_contacts_of(const Change& change, const Members& members) {
    double largest = 0;
    for (const ContactRow& row : change.contacts) largest = std::max(largest, norm(row.impulse));
    double fastest = 0;
    double energy = 0;
    for (const auto& [k, member] : members) {
      energy += member.inertia.energy(member.before);
      fastest = std::max({fastest, norm(member.before.v), norm(member.after.v),
                          ratio(member.size, data_.bodies[k].mass)});
    }
    double done = 0;  // work
    bool has_all = true;
    for (const ContactRow& row : change.contacts) {
      check_cone(change, row, largest);
      const auto a = twists(change, row.a, members);
      const auto b = twists(change, row.b, members);
      if (!a || !b) {
        ++law_.without_law;
        has_all = false;
        continue;
      }
      const Rates rate{b->rate_before(row.p) - a->rate_before(row.p),
                       b->rate_after(row.p) - a->rate_after(row.p)};
      done += dot(row.impulse, rate.before + rate.after) / 2;
      check_signorini(change, row, rate, fastest, largest);
    }
    for (const LinkRow& row : change.links) {
      const auto a = twists(change, row.a, members);
      const auto b = twists(change, row.b, members);
      has_all = has_all && a && b;
      if (a && b)
        done += work(*a, -1.0 * row.impulse, row.angular_a) + work(*b, row.impulse, row.angular_b);
    }
    if (has_all && change.kind == Change::Kind::Impact) {
      law_.energy.take(done <= 0 ? 0 : ratio(done, energy), change.end,
                       change.contacts.empty() ? 0 : change.contacts.front().a,
                       change.contacts.empty() ? 0 : change.contacts.front().b);
    }
  }

  void check_cone(const Change& change, const ContactRow& row, double largest) {
    const double normal = dot(row.impulse, row.n);
    const double tangential = norm(row.impulse - normal * row.n);
    const double t = change.time();
    law_.cone.take(ratio(std::max(-normal, 0.0), largest), t, row.a, row.b);
    if (std::isnan(row.friction)) {  // a function of the sliding velocity
      ++law_.without_law;
      return;
    }
    const double own = data_.pair_material(recording_, row.a, row.b, change.begin).friction;
    if (!(std::abs(row.friction - own) <= kSame * own))
      fault(change, row.a, row.b, "its coefficient of friction is not that of the pair");
    const double outside = tangential - row.friction * std::max(normal, 0.0);
    law_.cone.take(outside <= 0 ? 0 : ratio(outside, largest), t, row.a, row.b);
  }

  // Either the impulse is as good as none, or the contact has the velocity asked for.
  void check_signorini(const Change& change, const ContactRow& row, const Rates& rate,
                       double fastest, double largest) {
    const double t = change.time();
    const double after = dot(rate.after, row.n);
    law_.complementarity.take(std::min(ratio(std::abs(after - row.target), fastest),
                                       ratio(dot(row.impulse, row.n), largest)),
                              t, row.a, row.b);
    if (change.kind != Change::Kind::Impact || !(row.target > 0)) return;
    const double e = data_.pair_material(recording_, row.a, row.b, change.begin).restitution;
    const double approach = -dot(rate.before, row.n);
    const double more = row.target - e * std::max(approach, 0.0);
    law_.restitution.take(more <= 0 ? 0 : ratio(more, std::abs(approach)), t, row.a, row.b);
  }

  // The velocity of a body's centre of mass, and its angular one, on the twist that it follows in a
  // substep and as the change left it.
  struct Motions {
    Velocity moved;
    Velocity left;
  };
  std::optional<Motions> motions(const Change& change, std::uint32_t k,
                                 const Member& member) const {
    const RecordedBody& body = recording_.bodies[k];
    const Segment* segment = body.segment(change.begin);
    if (segment == nullptr) return std::nullopt;
    const Velocity moved = velocity_at(*segment, change.begin);
    const Vec arm = segment->pose(change.begin).R * body.center_of_mass;
    return Motions{
        {moved.v + cross(moved.w, arm), on_free_axes(moved.w, data_.bodies[k].locked_rotation)},
        {member.after.v, member.inertia.turn(member.after.L)}};
  }

  // Bodies move along twists that may also recover gaps and close joints.
  void check_moves(const Change& change, const Members& members) {
    const double tau = change.end - change.begin;
    const double most = most_recovery(change, members);
    for (const auto& [k, member] : members) {
      const auto motion = motions(change, k, member);
      if (!motion) continue;
      const RecordedBody& body = recording_.bodies[k];
      const Segment& segment = *body.segment(change.begin);
      if (segment.begin > change.begin || segment.is_flight())
        fault(change, k, k, "its motion is not that of a substep");
      const auto& [moved, left] = *motion;
      const double way =
          tau * (norm(moved.v - left.v) + body.bounding_radius * norm(moved.w - left.w));
      law_.recovery.take(ratio(way, most), change.begin, k, k);
      if (way <= most) continue;
      std::ostringstream text;
      text << "its way in a substep differs by " << way
           << " from what its velocity says, and gaps and joints need no more than " << most;
      fault(change, k, k, text.str());
    }
  }

  // The most that recovery may move one of the bodies of a substep: from one to the next each gap
  // opens by a rest offset, and each joint closes by its error.
  double most_recovery(const Change& change, const Members& members) const {
    double gaps = parting(change, members);
    double joints = 0;
    for (const auto& [k, member] : members) {
      gaps += rest_offset(k, change.begin) + bend(change, k, member);
      // What ended before the step that it was solved for has got too much of the forces' impulse.
      const double missing = data_.longest_advance - (change.end - change.begin);
      gaps += std::max(missing, 0.0) * member.kick;
      joints += joints_recovery(change, k, members);
    }
    return kLevers * gaps + joints;
  }

  double rest_offset(std::uint32_t k, double t) const {
    const double own = at_time(data_.rules, t).rest_offset;
    if (own > 0) return own;
    const double target = at_time(recording_.rules, t).target_distance.value_or(0);
    return kRestOffset * std::max(target, kDefaultTarget * recording_.bodies[k].bounding_radius);
  }

  // How far a turn bends the ways of a body's points: one that recovery neither made nor undid.
  double bend(const Change& change, std::uint32_t k, const Member& member) const {
    const auto motion = motions(change, k, member);
    if (!motion) return 0;
    const double tau = change.end - change.begin;
    const double turn = tau * std::min(norm(motion->moved.w), norm(motion->left.w));
    return turn * turn * recording_.bodies[k].bounding_radius;
  }

  // Joints of one body that are not counted with another.
  double joints_recovery(const Change& change, std::uint32_t k, const Members& members) const {
    const RuleLaw& rules = at_time(data_.rules, change.begin);
    const auto joints = rules.joints_at.find(recording_.bodies[k].slot);
    if (joints == rules.joints_at.end()) return 0;
    double sum = 0;
    for (const JointLaw& joint : joints->second) {
      const std::uint32_t a = recording_.body_at(joint.a, change.begin);
      if (k != a && members.contains(a)) continue;
      sum += joint_recovery(joint, a, recording_.body_at(joint.b, change.begin), change.begin);
    }
    return sum;
  }

  // By pairs that began too near.
  double parting(const Change& change, const Members& members) const {
    const auto speed = at_time(data_.rules, change.begin).separation_speed;
    double sum = 0;
    for (const auto& [pair, spans] : recording_.uncertified) {
      const std::uint32_t a = recording_.body_at(pair.first, change.begin);
      const std::uint32_t b = recording_.body_at(pair.second, change.begin);
      if (!members.contains(a) && !members.contains(b)) continue;
      if (!recording_.is_uncertified(a, b, change.begin)) continue;
      sum += speed ? (change.end - change.begin) * *speed : kRecoveredPart * smaller_radius(a, b);
    }
    return sum;
  }

  // Links in a line give way sideways, by more than the error: two of length L by sqrt(2 error L).
  double joint_recovery(const JointLaw& joint, std::uint32_t a, std::uint32_t b, double t) const {
    double longest = 0;
    for (const std::uint32_t k : {a, b}) {
      const RecordedBody& body = recording_.bodies[k];
      if (body.is_dynamic) longest = std::max(longest, body.bounding_radius);
    }
    const double radius = smaller_radius(a, b);
    double error = kRecoveredPart * radius;
    const Segment* motion_a = recording_.bodies[a].segment(t);
    const Segment* motion_b = recording_.bodies[b].segment(t);
    if (motion_a != nullptr && motion_b != nullptr && !joint.has_more)
      error = std::min(error, joint.error(motion_a->pose(t), motion_b->pose(t), radius));
    return kLevers * error + std::sqrt(2 * error * longest);
  }

  double smaller_radius(std::uint32_t a, std::uint32_t b) const {
    return std::min(recording_.bodies[a].bounding_radius, recording_.bodies[b].bounding_radius);
  }

  void throw_fault(const char* what) const { throw BadFile(what); }

  void fault(const Change& change, std::uint32_t a, std::uint32_t b, const std::string& what) {
    if (law_.fault_count++ >= std::int64_t(kMostFaults)) return;
    std::string text = recording_.bodies[a].name;
    if (b != a) text += " and " + recording_.bodies[b].name;
    law_.faults.push_back(text + " at t = " + std::to_string(change.time()) + ": " + what);
  }

  const Recording& recording_;
  const LawData& data_;
  ContactLaw law_;
  std::vector<std::optional<Known>> known_;  // by body
};

// Residuals that count as rounding, or as what integrators and solvers leave.
constexpr double kBalanced = 1e-9;       // literal: of the impulses
constexpr double kFlightBalance = 1e-6;  // literal: of the momentum
constexpr double kTurnBalance = 1e-4;    // literal: of the angular momentum, between two nodes
constexpr double kInCone = 1e-6;         // literal: of the largest impulse

}  // namespace

bool FlightLaw::holds() const {
  return linear.value <= kFlightBalance && angular.value <= kTurnBalance;
}

bool ContactLaw::holds() const {
  return linear.value <= kBalanced && angular.value <= kBalanced && gap.value <= kFlightBalance &&
         cone.value <= kInCone && restitution.value <= kInCone && energy.value <= kInCone &&
         fault_count == 0;
}

FlightLaw check_flights(const Recording& recording, const LawData& data) {
  return FlightChecker(recording, data).run();
}

ContactLaw check_contacts(const Recording& recording, const LawData& data) {
  return ContactChecker(recording, data).run();
}

}  // namespace dyop_check
