#include "dynamics/impact_law.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "dyop/core/tolerance.h"

namespace dyop::internal {
namespace {

// Sweeps for rebounds. They are asked for, not owed: two bodies at rest that squeeze a third one
// leave no room for them, and then no number of sweeps converges.
constexpr int kReboundIterations = 100;

// A direction of an impulse at one contact.
struct Axis {
  Vector3 direction;
  Vector3 arm_a;  // lever arm of a unit impulse, r x direction
  Vector3 arm_b;
  Vector3 turn_a;  // angular velocity it gives
  Vector3 turn_b;
  Scalar response;  // speed along the direction that it gives
};

// One contact prepared for the solver. Both bodies feel the impulse at the middle of the gap, so
// that it makes no torque of its own.
struct Row {
  Axis normal;
  std::array<Axis, 2> tangents;
  Scalar normal_mass = 0;  // response along the normal, inverted
  Eigen::Matrix2d tangent_mass;
  Scalar target = 0;         // normal velocity wanted after the impact
  Scalar least_impulse = 0;  // along the normal
  Scalar normal_impulse = 0;
  Eigen::Vector2d tangent_impulse = Eigen::Vector2d::Zero();
};

Axis make_axis(const ImpactBody& a, const ImpactBody& b, const Vector3& middle,
               const Vector3& direction) {
  Axis axis;
  axis.direction = direction;
  axis.arm_a = (middle - a.p_WBcm).cross(direction);
  axis.arm_b = (middle - b.p_WBcm).cross(direction);
  axis.turn_a = a.inverse_inertia_W * axis.arm_a;
  axis.turn_b = b.inverse_inertia_W * axis.arm_b;
  axis.response =
      a.inverse_mass + b.inverse_mass + axis.arm_a.dot(axis.turn_a) + axis.arm_b.dot(axis.turn_b);
  return axis;
}

// Response along the first axis to a unit impulse along the second, two axes of one contact that
// are normal to one another.
Scalar cross_response(const Axis& along, const Axis& impulse) {
  return along.arm_a.dot(impulse.turn_a) + along.arm_b.dot(impulse.turn_b);
}

class ImpactSolver {
 public:
  ImpactSolver(std::span<ImpactBody> bodies, std::span<const ImpactPoint> points);

  /// Solves for restitution scaled by `bounce` in [0, 1], from the state before the impact.
  ImpactOutcome solve(Scalar bounce);

  Vector3 impulse(std::size_t i) const;
  Scalar kinetic_energy() const;
  Scalar energy_of_rebounds() const;
  Scalar initial_normal_velocity(std::size_t i) const { return normal_before_[i]; }
  bool asks_rebounds() const { return asks_rebounds_; }

 private:
  Scalar speed_along(std::size_t i, const Axis& axis) const;
  void apply(std::size_t i, const Axis& axis, Scalar impulse);
  Scalar relax_normal(std::size_t i);
  Scalar relax_tangents(std::size_t i);
  int sweep(bool with_friction, Scalar speed, int limit);

  std::span<ImpactBody> bodies_;
  std::span<const ImpactPoint> points_;
  std::vector<ImpactBody> before_;
  std::vector<Scalar> normal_before_;
  std::vector<Row> rows_;
  bool asks_rebounds_ = false;
};

ImpactSolver::ImpactSolver(std::span<ImpactBody> bodies, std::span<const ImpactPoint> points)
    : bodies_(bodies), points_(points), before_(bodies.begin(), bodies.end()) {
  for (const ImpactPoint& point : points) {
    const ImpactBody& a = bodies[point.a];
    const ImpactBody& b = bodies[point.b];
    const Vector3 middle = (point.p_WCa + point.p_WCb) / 2;
    Row row;
    row.normal = make_axis(a, b, middle, point.nhat_AB_W);
    const Vector3 across = point.nhat_AB_W.unitOrthogonal();
    row.tangents = {make_axis(a, b, middle, across),
                    make_axis(a, b, middle, point.nhat_AB_W.cross(across))};
    if (row.normal.response > 0) {  // else two immovable bodies: nothing to do
      row.normal_mass = 1 / row.normal.response;
      const Scalar coupling = cross_response(row.tangents[0], row.tangents[1]);
      Eigen::Matrix2d response;
      response << row.tangents[0].response, coupling, coupling, row.tangents[1].response;
      row.tangent_mass = response.inverse();
    }
    asks_rebounds_ = asks_rebounds_ || point.least_rebound > 0;
    rows_.push_back(row);
    normal_before_.push_back(speed_along(rows_.size() - 1, row.normal));
  }
}

// Of the contact point of B relative to that of A.
Scalar ImpactSolver::speed_along(std::size_t i, const Axis& axis) const {
  const ImpactBody& a = bodies_[points_[i].a];
  const ImpactBody& b = bodies_[points_[i].b];
  return axis.direction.dot(b.v_WBcm - a.v_WBcm) + axis.arm_b.dot(b.w_WB) - axis.arm_a.dot(a.w_WB);
}

void ImpactSolver::apply(std::size_t i, const Axis& axis, Scalar impulse) {
  ImpactBody& a = bodies_[points_[i].a];
  ImpactBody& b = bodies_[points_[i].b];
  a.v_WBcm -= (impulse * a.inverse_mass) * axis.direction;
  a.w_WB -= impulse * axis.turn_a;
  b.v_WBcm += (impulse * b.inverse_mass) * axis.direction;
  b.w_WB += impulse * axis.turn_b;
}

// Returns how much velocity the step changed, as a measure of convergence.
Scalar ImpactSolver::relax_normal(std::size_t i) {
  Row& row = rows_[i];
  if (row.normal_mass == 0) return 0;
  const Scalar missing = row.target - speed_along(i, row.normal);
  const Scalar impulse =
      std::max(row.least_impulse, row.normal_impulse + row.normal_mass * missing);
  const Scalar change = impulse - row.normal_impulse;
  row.normal_impulse = impulse;
  apply(i, row.normal, change);
  return std::abs(change) / row.normal_mass;
}

Scalar ImpactSolver::relax_tangents(std::size_t i) {
  Row& row = rows_[i];
  if (row.normal_mass == 0 || points_[i].friction == 0) return 0;
  const Eigen::Vector2d sliding(speed_along(i, row.tangents[0]), speed_along(i, row.tangents[1]));
  Eigen::Vector2d impulse = row.tangent_impulse - row.tangent_mass * sliding;
  const Scalar limit = points_[i].friction * row.normal_impulse;
  const Scalar norm = impulse.norm();
  if (norm > limit) impulse *= limit / norm;
  const Eigen::Vector2d change = impulse - row.tangent_impulse;
  row.tangent_impulse = impulse;
  apply(i, row.tangents[0], change[0]);
  apply(i, row.tangents[1], change[1]);
  return change.norm() / row.normal_mass;
}

int ImpactSolver::sweep(bool with_friction, Scalar speed, int limit) {
  for (int iteration = 1; iteration <= limit; ++iteration) {
    Scalar change = 0;
    for (std::size_t i = 0; i < rows_.size(); ++i) {
      change = std::max(change, relax_normal(i));
      if (with_friction) change = std::max(change, relax_tangents(i));
    }
    if (change <= kImpactConvergence * speed) return iteration;
  }
  return limit;
}

ImpactOutcome ImpactSolver::solve(Scalar bounce) {
  std::copy(before_.begin(), before_.end(), bodies_.begin());
  Scalar speed = 0;
  for (std::size_t i = 0; i < rows_.size(); ++i) {
    const Scalar before = normal_before_[i];
    rows_[i].normal_impulse = rows_[i].least_impulse = 0;
    rows_[i].tangent_impulse.setZero();
    rows_[i].target =
        std::max(bounce * points_[i].least_rebound, -bounce * points_[i].restitution * before);
    speed = std::max({speed, std::abs(before), rows_[i].target,
                      std::abs(speed_along(i, rows_[i].tangents[0])),
                      std::abs(speed_along(i, rows_[i].tangents[1]))});
  }
  ImpactOutcome outcome;
  outcome.iterations = sweep(true, speed, asks_rebounds_ ? kReboundIterations : kImpactIterations);
  // With friction the sweeps may circle. Pushing on along the normals only, until nothing closes,
  // is the projection on a convex cone: it converges, costs energy, and widens the friction cones.
  for (Row& row : rows_) {
    row.target = 0;
    row.least_impulse = row.normal_impulse;
  }
  outcome.iterations += sweep(false, speed, kImpactIterations);
  for (std::size_t i = 0; i < rows_.size(); ++i) {
    if (rows_[i].normal_mass == 0) continue;
    outcome.residual = std::max(outcome.residual, -speed_along(i, rows_[i].normal));
  }
  return outcome;
}

Vector3 ImpactSolver::impulse(std::size_t i) const {
  const Row& row = rows_[i];
  return row.normal_impulse * row.normal.direction +
         row.tangent_impulse[0] * row.tangents[0].direction +
         row.tangent_impulse[1] * row.tangents[1].direction;
}

// Of the movable bodies. Immovable ones have none that could change.
Scalar ImpactSolver::kinetic_energy() const {
  Scalar energy = 0;
  for (const ImpactBody& body : bodies_) {
    if (body.inverse_mass == 0) continue;
    energy += body.v_WBcm.squaredNorm() / body.inverse_mass +
              body.w_WB.dot(body.inverse_inertia_W.inverse() * body.w_WB);
  }
  return energy / 2;
}

// What the least rebounds may add.
Scalar ImpactSolver::energy_of_rebounds() const {
  Scalar energy = 0;
  for (std::size_t i = 0; i < rows_.size(); ++i) {
    energy += rows_[i].normal_mass * points_[i].least_rebound * points_[i].least_rebound / 2;
  }
  return energy;
}

// Work that bodies on given paths do is theirs to give: only bodies at rest are conservative.
bool has_moving_support(std::span<const ImpactBody> bodies) {
  return std::any_of(bodies.begin(), bodies.end(), [](const ImpactBody& body) {
    return body.inverse_mass == 0 && !(body.v_WBcm.isZero(0) && body.w_WB.isZero(0));
  });
}

}  // namespace

ImpactOutcome resolve_impact(std::span<ImpactBody> bodies, std::span<ImpactPoint> points) {
  ImpactSolver solver(bodies, points);
  const Scalar energy_before = solver.kinetic_energy() + solver.energy_of_rebounds();
  const bool may_gain = has_moving_support(bodies);
  ImpactOutcome outcome = solver.solve(1);
  // Newton's restitution together with friction can create energy ([Kane1984]); then bounce less.
  // Rebounds that cost more than they should are given up.
  constexpr int kHalvings = 20;
  Scalar bounce = 1;
  int iterations = outcome.iterations;
  for (int i = 0; i < kHalvings && !may_gain && bounce > 0; ++i) {
    if (solver.kinetic_energy() <= energy_before * (1 + kImpactConvergence)) break;
    bounce = i + 1 < kHalvings && !solver.asks_rebounds() ? bounce / 2 : 0;
    outcome = solver.solve(bounce);
    iterations += outcome.iterations;
  }
  outcome.iterations = iterations;
  for (std::size_t i = 0; i < points.size(); ++i) {
    points[i].normal_velocity = solver.initial_normal_velocity(i);
    points[i].impulse_W = solver.impulse(i);
  }
  return outcome;
}

}  // namespace dyop::internal
