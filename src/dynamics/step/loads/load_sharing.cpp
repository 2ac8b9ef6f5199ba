// SPDX-License-Identifier: BSD-3-Clause
#include "dynamics/step/loads/load_sharing.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <span>

namespace dyop::internal {
namespace {

// Cosine of the largest angle between normals of contacts on one plane.
constexpr Scalar kSamePlane = 0.9999;
// Contacts are on a line if their spread across it, squared, is this part of that along it.
constexpr Scalar kOnALine = 1e-12;  // literal: of a square

// Speed of sliding, in residuals, and friction, as a part of the most there can be, from which a
// contact slides.
constexpr Scalar kSliding = 10;
constexpr Scalar kOnTheCone = 0.99;

struct Load {
  std::size_t contact = 0;
  Scalar x = 0, y = 0;                // in the plane, from the mean place
  Scalar normal = 0;                  // impulse
  Scalar shared = 0;                  // impulse
  Vector3 slide_W = Vector3::Zero();  // unit, or zero: sticks
};

Vector3 velocity_at(const ContactProblem& problem, const PointContact& contact) {
  const ContactBody& a = problem.bodies[contact.body_a];
  const ContactBody& b = problem.bodies[contact.body_b];
  return b.v_W + b.w_W.cross(contact.r_b_W) - a.v_W - a.w_W.cross(contact.r_a_W);
}

// The unit vector along which a contact slides, or zero: velocities within the residual and impulses
// inside the cone of friction stick.
Vector3 slide_of(const PointContact& contact, const Vector3& u_W, Scalar residual) {
  const Vector3& nhat_W = contact.nhat_AB_W;
  const Vector3 u_t_W = u_W - u_W.dot(nhat_W) * nhat_W - contact.sticking_velocity_W;
  const Scalar normal = contact.impulse_W.dot(nhat_W);
  const Scalar across = (contact.impulse_W - normal * nhat_W).norm();
  const bool is_inside = across < kOnTheCone * contact.friction * normal;
  const Scalar speed = u_t_W.norm();
  if (!(contact.friction > 0 && speed > kSliding * residual) || is_inside) return Vector3::Zero();
  return u_t_W / speed;
}

// The closed contacts of a pair on the plane of its first contact; none if none of them slides.
void take_loads(const ContactProblem& problem, std::span<const std::size_t> pair,
                const std::vector<Vector3>& slides_W, Scalar residual, std::vector<Load>& loads) {
  loads.clear();
  bool slides = false;
  const Vector3& nhat_W = problem.contacts[pair.front()].nhat_AB_W;
  const Vector3 x_W = nhat_W.unitOrthogonal();
  const Vector3 y_W = nhat_W.cross(x_W);
  for (const std::size_t k : pair) {
    const PointContact& contact = problem.contacts[k];
    if (!(contact.nhat_AB_W.dot(nhat_W) > kSamePlane)) continue;
    Load load{k, contact.r_b_W.dot(x_W), contact.r_b_W.dot(y_W)};
    load.normal = contact.impulse_W.dot(contact.nhat_AB_W);
    const Scalar opening = contact.nhat_AB_W.dot(velocity_at(problem, contact)) - contact.target;
    if (!(load.normal > 0) && opening > residual) continue;
    load.slide_W = slides_W[k];
    slides = slides || !load.slide_W.isZero(0);
    loads.push_back(load);
  }
  if (!slides) loads.clear();
}

// Affine impulses with the force and the torque of the given ones: those of least squares.
void share(std::span<Load> loads) {
  const Scalar count = Scalar(loads.size());
  Scalar mean_x = 0, mean_y = 0, mean = 0;
  for (const Load& load : loads) {
    mean_x += load.x / count;
    mean_y += load.y / count;
    mean += load.normal / count;
  }
  Scalar xx = 0, xy = 0, yy = 0, x_load = 0, y_load = 0;
  for (Load& load : loads) {
    load.x -= mean_x;
    load.y -= mean_y;
    xx += load.x * load.x;
    xy += load.x * load.y;
    yy += load.y * load.y;
    x_load += load.x * load.normal;
    y_load += load.y * load.normal;
  }
  Scalar slope_x = 0, slope_y = 0;
  const Scalar determinant = xx * yy - xy * xy;
  const Scalar trace = xx + yy;
  if (determinant > kOnALine * trace * trace) {
    slope_x = (yy * x_load - xy * y_load) / determinant;
    slope_y = (xx * y_load - xy * x_load) / determinant;
  } else if (trace > 0) {  // the torque has no part across the line
    slope_x = x_load / trace;
    slope_y = y_load / trace;
  }
  for (Load& load : loads) load.shared = mean + slope_x * load.x + slope_y * load.y;
}

// How far, from 0 to 1, loads may be moved to the shared ones: none becomes negative or too small
// for the friction of a contact that sticks.
Scalar way_to_shared(const ContactProblem& problem, std::span<const Load> loads) {
  Scalar way = 1;
  for (const Load& load : loads) {
    const PointContact& contact = problem.contacts[load.contact];
    Scalar least = 0;
    if (load.slide_W.isZero(0) && contact.friction > 0) {
      const Vector3 J_t_W = contact.impulse_W - load.normal * contact.nhat_AB_W;
      least = J_t_W.norm() / contact.friction;
    }
    const Scalar change = load.shared - load.normal;
    if (load.shared < least)
      way = std::min(way, std::max<Scalar>(load.normal - least, 0) / -change);
  }
  return way;
}

}  // namespace

std::vector<Vector3> shared_loads(const ContactProblem& problem, Scalar residual) {
  std::vector<Vector3> impulses_W, slides_W;
  bool slides = false;
  for (const PointContact& contact : problem.contacts) {
    impulses_W.push_back(contact.impulse_W);
    slides_W.push_back(slide_of(contact, velocity_at(problem, contact), residual));
    slides = slides || !slides_W.back().isZero(0);
  }
  if (!slides) return impulses_W;
  const auto pair_of = [&](std::size_t k) {
    return std::pair(problem.contacts[k].body_a, problem.contacts[k].body_b);
  };
  std::vector<std::size_t> order(problem.contacts.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::stable_sort(order.begin(), order.end(),
                   [&](std::size_t i, std::size_t k) { return pair_of(i) < pair_of(k); });
  std::vector<Load> loads;
  for (std::size_t first = 0, end = 0; first < order.size(); first = end) {
    while (end < order.size() && pair_of(order[end]) == pair_of(order[first])) ++end;
    if (end - first < 3) continue;  // two share a load in one way only
    const auto pair = std::span(order).subspan(first, end - first);
    take_loads(problem, pair, slides_W, residual, loads);
    if (loads.size() < 3) continue;
    share(loads);
    const Scalar way = way_to_shared(problem, loads);
    for (const Load& load : loads) {
      const PointContact& contact = problem.contacts[load.contact];
      const Scalar change = way * (load.shared - load.normal);
      impulses_W[load.contact] += change * (contact.nhat_AB_W - contact.friction * load.slide_W);
    }
  }
  return impulses_W;
}

}  // namespace dyop::internal
