// SPDX-License-Identifier: BSD-3-Clause
#include "check/trusted/motion.h"

namespace dyop_check {
namespace {

constexpr double kUnit = 0x1p-53;
// Roundings in a pose and in a posed point, each of at most kUnit of a coordinate: fewer than 60 in
// a cubic, its rotation vector, Rodrigues' formula and two products; sin and cos err by at most 4.
constexpr double kPoseRoundings = 256;

// Bounds of a curve and its derivatives over |t - (t0 + x)| <= r.
struct Sizes {
  double value = 0;
  double rate = 0;
  double second = 0;
};

// The curve in powers of the distance from x, by repeated synthetic division, and then the triangle
// inequality.
Sizes sizes(const Curve& curve, double x, double r) {
  std::array<Vec, kMostTerms> terms;
  const std::size_t count = curve.size();
  std::copy(curve.begin(), curve.end(), terms.begin());
  for (std::size_t i = 0; i + 1 < count && x != 0; ++i) {
    for (std::size_t k = count - 1; k-- > i;) terms[k] = terms[k] + x * terms[k + 1];
  }
  Sizes sizes;
  for (std::size_t k = count; k-- > 0;) {
    const double size = norm(terms[k]);
    sizes.value = size + r * sizes.value;
    if (k > 0) sizes.rate = double(k) * size + r * sizes.rate;
    if (k > 1) sizes.second = double(k * (k - 1)) * size + r * sizes.second;
  }
  return sizes;
}

// The sum of the sizes of all terms.
double size(const Curve& curve, double x) {
  double sum = 0;
  for (std::size_t k = curve.size(); k-- > 0;) sum = norm(curve[k]) + x * sum;
  return sum;
}

double longest(const Segment& g, double begin, double end) {
  return std::max(std::abs(begin - g.t0), std::abs(end - g.t0));
}

// What rounding may add to the second derivative of a curve of so many terms.
double second_noise(const Segment& g, std::size_t terms, double rough) {
  if (rough == 0) return 0;
  return kPoseRoundings * kUnit * double(terms * terms) * rough / (g.length * g.length);
}

}  // namespace

Vec value(const Curve& curve, double x) {
  Vec sum;
  for (std::size_t k = curve.size(); k-- > 0;) sum = curve[k] + x * sum;
  return sum;
}

bool Segment::holds(double from, double to) const {
  const double spare = length / 100;
  return from >= t0 - spare && to <= t0 + length + spare && (!outer || outer->holds(from, to));
}

Pose Segment::pose(double t) const {
  const double x = t - t0;
  const Vec theta = value(turn, x);
  const Mat axes = dot(theta, theta) == 0 ? R : R * rotation(theta);
  const Pose X{axes, value(place, x) - axes * p_cm};
  return outer ? outer->pose(t) * X : X;
}

// With a rotation vector theta the angular speed is at most |theta'|, and the angular acceleration
// at most |theta''| + |theta'|^2 / pi (docs/algorithms/motions.md, lemma 2); none of the latter
// where the axis does not change.
//
// Seen through a frame that moves by itself, a point at d from that frame's centre, of the rate u
// and the acceleration a, accelerates by a_outer + w' x d + w x (w x d) + 2 w x u + a.
Bounds bounds(const Segment& g, double begin, double end) {
  if (g.rests()) return {};
  const double middle = begin + (end - begin) / 2;
  const double r = std::max(middle - begin, end - middle);
  const Sizes place = sizes(g.place, middle - g.t0, r);
  const Sizes angle = sizes(g.turn, middle - g.t0, r);
  const double angle_noise = second_noise(g, g.turn.size(), g.rough_turn);
  const double w = kUp * (angle.rate + (angle_noise > 0 ? angle_noise * g.length : 0));
  const bool turns_about_one_axis = g.turn.size() <= 2 && norm(g.turn[0]) == 0;
  Bounds all;
  all.speed = w;
  all.turn = kUp * (angle.second + angle_noise + w * w * (turns_about_one_axis ? 1 : 1 + 1 / kPi));
  all.center = kUp * (place.second + second_noise(g, g.place.size(), g.rough_place));
  if (g.outer) {
    const Bounds outer = bounds(*g.outer, begin, end);
    const double d = place.value + norm(g.outer->p_cm);
    all.center = kUp * (all.center + outer.center + outer.turn * d + 2 * outer.speed * place.rate);
    all.turn = kUp * (all.turn + outer.turn + 3 * outer.speed * all.speed);
    all.speed = kUp * (all.speed + outer.speed);
  }
  all.center += all.turn * g.lever;
  return all;
}

// Times are exact, so only differences of them and what is computed with these are rounded.
double pose_noise(const Segment& g, double body_size, double begin, double end) {
  const double x = longest(g, begin, end);
  const double place = size(g.place, x) + g.rough_place;
  const double turns = 1 + size(g.turn, x) + g.rough_turn;
  const double body = body_size + norm(g.p_cm);
  double noise = kPoseRoundings * kUnit * (place + (1 + turns) * body) + g.skew * turns * body;
  if (g.outer) noise += pose_noise(*g.outer, place + body, begin, end);
  return noise;
}

}  // namespace dyop_check
