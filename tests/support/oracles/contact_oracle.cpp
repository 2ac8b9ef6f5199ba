// SPDX-License-Identifier: BSD-3-Clause
#include "support/oracles/contact_oracle.h"

#include <algorithm>
#include <cmath>
#include <sstream>

namespace dyop::testing {
namespace {

Matrix3 skew(const Vector3& r) {
  Matrix3 S;
  S << 0, -r[2], r[1], r[2], 0, -r[0], -r[1], r[0], 0;
  return S;
}

// Velocity of the contact's point per impulse there.
Matrix3 point_mobility(const ContactBody& body, const Vector3& r) {
  return body.inverse_mass_W - skew(r) * body.inverse_inertia_W * skew(r);
}

struct PointState {
  Vector3 n, u_t, J_t;
  Scalar u_n = 0, J_n = 0;
  Scalar w = 0;    // trace of the mobility
  Scalar w_n = 0;  // along the normal
};

// Isotropic contacts only.
PointState state_of(const ContactProblem& problem, const PointContact& contact) {
  const ContactBody& a = problem.bodies[contact.body_a];
  const ContactBody& b = problem.bodies[contact.body_b];
  const Vector3 u = b.v_W + b.w_W.cross(contact.r_b_W) - a.v_W - a.w_W.cross(contact.r_a_W);
  PointState state;
  state.n = contact.nhat_AB_W;
  const Scalar along = u.dot(state.n);
  state.u_t = u - along * state.n;
  const Vector3& sticking = contact.sticking_velocity_W;
  state.u_t -= sticking - state.n * state.n.dot(sticking);
  state.u_n = along - contact.target;
  state.J_n = contact.impulse_W.dot(state.n);
  state.J_t = contact.impulse_W - state.J_n * state.n;
  const Matrix3 W = point_mobility(a, contact.r_a_W) + point_mobility(b, contact.r_b_W);
  state.w = W.trace();
  state.w_n = state.n.dot(W * state.n);
  return state;
}

// Distance of w J from the nearest point of the cone to w J - u~.
Scalar contact_residual(const PointState& s, Scalar friction) {
  const Scalar n = s.w * s.J_n - (s.u_n + friction * s.u_t.norm());
  const Vector3 t = s.w * s.J_t - s.u_t;
  const Scalar length = t.norm();
  Scalar p_n = n;
  Vector3 p_t = t;
  if (length > friction * n) {  // outside: the nearest point of the cone's edge, or its tip
    p_n = std::max(Scalar{0}, (n + friction * length) / (1 + friction * friction));
    p_t = length > 0 ? Vector3(t * (friction * p_n / length)) : Vector3::Zero();
  }
  return std::hypot(p_n - s.w * s.J_n, (p_t - s.w * s.J_t).norm());
}

// The same for an impulse that opposes a velocity with at most `bound`.
Scalar bounded_residual(const Vector3& J, const Vector3& u, Scalar w, Scalar bound) {
  Vector3 x = w * J - u;
  const Scalar length = x.norm();
  if (length > w * bound) x *= w * bound / length;
  return (x - w * J).norm();
}

Scalar turning_residual(const ContactProblem& problem, const PointContact& contact) {
  const ContactBody& a = problem.bodies[contact.body_a];
  const ContactBody& b = problem.bodies[contact.body_b];
  const Vector3& n = contact.nhat_AB_W;
  const Vector3 turning = b.w_W - a.w_W;
  const Matrix3 mobility = a.inverse_inertia_W + b.inverse_inertia_W;
  const Vector3& L = contact.angular_impulse_W;
  const Scalar normal = std::max(contact.impulse_W.dot(n), Scalar{0});
  const Vector3 across = turning - n * n.dot(turning);
  const Vector3 L_across = L - n * n.dot(L);
  const Scalar along_mobility = n.dot(mobility * n);
  Scalar r = 0;
  if (const Scalar c = contact.rolling_friction; c > 0) {
    const Scalar w = c * c * (mobility.trace() - along_mobility);
    r = std::max(r, bounded_residual(L_across / c, across * c, w, normal));
  }
  if (const Scalar c = contact.torsional_friction; c > 0) {
    const Vector3 u = n * (n.dot(turning) * c);
    r = std::max(r, bounded_residual(n * (n.dot(L) / c), u, c * c * along_mobility, normal));
  }
  return r;
}

Scalar row_residual(const ContactProblem& problem, const JointRow& row) {
  const ContactBody& a = problem.bodies[row.body_a];
  const ContactBody& b = problem.bodies[row.body_b];
  const Scalar u = row.j_av_W.dot(a.v_W) + row.j_aw_W.dot(a.w_W) + row.j_bv_W.dot(b.v_W) +
                   row.j_bw_W.dot(b.w_W) - row.target + row.compliance * row.impulse;
  const Scalar w = row.j_av_W.dot(a.inverse_mass_W * row.j_av_W) +
                   row.j_aw_W.dot(a.inverse_inertia_W * row.j_aw_W) +
                   row.j_bv_W.dot(b.inverse_mass_W * row.j_bv_W) +
                   row.j_bw_W.dot(b.inverse_inertia_W * row.j_bw_W) + row.compliance;
  const Scalar x = w * row.impulse - u;
  return std::abs(std::clamp(x, w * row.lower, w * row.upper) - w * row.impulse);
}

}  // namespace

Scalar contact_residual(const ContactProblem& problem) {
  Scalar r = 0;
  for (const PointContact& contact : problem.contacts) {
    const PointState state = state_of(problem, contact);
    if (!(state.w_n > 1e-14 * state.w)) continue;
    r = std::max(
        {r, contact_residual(state, contact.friction), turning_residual(problem, contact)});
  }
  for (const JointRow& row : problem.rows) r = std::max(r, row_residual(problem, row));
  return r;
}

Scalar momentum_error(const ContactProblem& problem) {
  std::vector<ContactBody> bodies = problem.bodies;
  std::vector<Scalar> sizes(bodies.size(), 0);
  for (std::size_t i = 0; i < bodies.size(); ++i) {
    bodies[i].v_W = bodies[i].free_v_W;
    bodies[i].w_W = bodies[i].free_w_W;
    sizes[i] = bodies[i].free_v_W.norm() + bodies[i].free_w_W.norm();
  }
  const auto kick = [&](std::size_t i, const Vector3& J, const Vector3& L) {
    const Vector3 dv = bodies[i].inverse_mass_W * J;
    const Vector3 dw = bodies[i].inverse_inertia_W * L;
    bodies[i].v_W += dv;
    bodies[i].w_W += dw;
    sizes[i] += dv.norm() + bodies[i].inverse_inertia_W.norm() * L.norm();
  };
  for (const PointContact& c : problem.contacts) {
    kick(c.body_a, -c.impulse_W, -c.r_a_W.cross(c.impulse_W) - c.angular_impulse_W);
    kick(c.body_b, c.impulse_W, c.r_b_W.cross(c.impulse_W) + c.angular_impulse_W);
  }
  for (const JointRow& row : problem.rows) {
    kick(row.body_a, row.impulse * row.j_av_W, row.impulse * row.j_aw_W);
    kick(row.body_b, row.impulse * row.j_bv_W, row.impulse * row.j_bw_W);
  }
  Scalar error = 0;
  for (std::size_t i = 0; i < bodies.size(); ++i) {
    const Scalar difference = (bodies[i].v_W - problem.bodies[i].v_W).norm() +
                              (bodies[i].w_W - problem.bodies[i].w_W).norm();
    if (difference > 0) error = std::max(error, difference / sizes[i]);
  }
  return error;
}

std::string broken_contact_law(const ContactProblem& problem, Scalar r) {
  std::ostringstream text;
  for (std::size_t i = 0; i < problem.contacts.size(); ++i) {
    const Scalar mu = problem.contacts[i].friction;
    const PointState s = state_of(problem, problem.contacts[i]);
    if (!(s.w_n > 1e-14 * s.w)) continue;
    const Scalar noise = 1e-12 * problem.contacts[i].impulse_W.norm();
    const Scalar u_size = std::hypot(s.u_n + mu * s.u_t.norm(), s.u_t.norm());
    const Scalar J_size = problem.contacts[i].impulse_W.norm();
    const Scalar allowed = r * (J_size + (u_size + r) / s.w) + (1 + mu) * r * s.J_n;
    const Scalar missed = mu * s.J_n * s.u_t.norm() + s.J_t.dot(s.u_t);
    if (!(s.J_n >= -noise)) text << "contact " << i << " pulls: " << s.J_n << '\n';
    if (!(s.J_t.norm() <= mu * s.J_n + noise)) text << "contact " << i << " leaves the cone\n";
    if (!(s.u_n >= -(1 + mu) * r)) text << "contact " << i << " closes: " << s.u_n << '\n';
    if (!(s.J_n * s.u_n <= allowed)) text << "contact " << i << " pushes while it separates\n";
    if (!(missed <= allowed)) text << "contact " << i << " misses dissipation " << missed << '\n';
  }
  return text.str();
}

}  // namespace dyop::testing
