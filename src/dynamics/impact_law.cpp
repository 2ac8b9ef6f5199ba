#include "dynamics/impact_law.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "core/tolerance.h"

namespace dyop::internal {
namespace {

// One contact prepared for the solver. Both bodies feel the impulse at the middle of the gap, so
// that it makes no torque of its own.
struct Row {
  Vector3 r_a;  // from the centres of mass to the middle of the gap
  Vector3 r_b;
  Eigen::Matrix<Scalar, 3, 2> tangents;
  Scalar normal_mass = 0;  // speed along the normal per unit impulse, inverted
  Eigen::Matrix2d tangent_mass;
  Scalar target = 0;         // normal velocity wanted after the impact
  Scalar least_impulse = 0;  // along the normal
  Scalar normal_impulse = 0;
  Eigen::Vector2d tangent_impulse = Eigen::Vector2d::Zero();
};

Vector3 point_velocity(const ImpactBody& body, const Vector3& r) {
  return body.v_WBcm + body.w_WB.cross(r);
}

// Change of the relative velocity at the contact per unit impulse along `direction`.
Vector3 response(const ImpactBody& a, const ImpactBody& b, const Row& row,
                 const Vector3& direction) {
  const auto of = [&](const ImpactBody& body, const Vector3& r) -> Vector3 {
    return body.inverse_mass * direction + (body.inverse_inertia_W * r.cross(direction)).cross(r);
  };
  return of(a, row.r_a) + of(b, row.r_b);
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

 private:
  Vector3 relative_velocity(std::size_t i) const;
  void apply(std::size_t i, const Vector3& impulse);
  Scalar relax_normal(std::size_t i);
  Scalar relax_tangents(std::size_t i);
  int sweep(bool with_friction, Scalar speed);

  std::span<ImpactBody> bodies_;
  std::span<const ImpactPoint> points_;
  std::vector<ImpactBody> before_;
  std::vector<Scalar> normal_before_;
  std::vector<Row> rows_;
};

ImpactSolver::ImpactSolver(std::span<ImpactBody> bodies, std::span<const ImpactPoint> points)
    : bodies_(bodies), points_(points), before_(bodies.begin(), bodies.end()) {
  for (const ImpactPoint& point : points) {
    const ImpactBody& a = bodies[point.a];
    const ImpactBody& b = bodies[point.b];
    Row row;
    const Vector3 middle = (point.p_WCa + point.p_WCb) / 2;
    row.r_a = middle - a.p_WBcm;
    row.r_b = middle - b.p_WBcm;
    const Vector3& n = point.nhat_AB_W;
    row.tangents.col(0) = n.unitOrthogonal();
    row.tangents.col(1) = n.cross(row.tangents.col(0));
    const Scalar along = n.dot(response(a, b, row, n));
    row.normal_mass = along > 0 ? 1 / along : 0;  // two immovable bodies: nothing to do
    Eigen::Matrix2d across;
    for (Eigen::Index k = 0; k < 2; ++k) {
      across.col(k) = row.tangents.transpose() * response(a, b, row, row.tangents.col(k));
    }
    row.tangent_mass = along > 0 ? Eigen::Matrix2d(across.inverse()) : Eigen::Matrix2d::Zero();
    rows_.push_back(row);
    normal_before_.push_back(n.dot(relative_velocity(rows_.size() - 1)));
  }
}

Vector3 ImpactSolver::relative_velocity(std::size_t i) const {
  const ImpactPoint& point = points_[i];
  return point_velocity(bodies_[point.b], rows_[i].r_b) -
         point_velocity(bodies_[point.a], rows_[i].r_a);
}

void ImpactSolver::apply(std::size_t i, const Vector3& impulse) {
  const auto kick = [](ImpactBody& body, const Vector3& r, const Vector3& J) {
    body.v_WBcm += body.inverse_mass * J;
    body.w_WB += body.inverse_inertia_W * r.cross(J);
  };
  kick(bodies_[points_[i].a], rows_[i].r_a, -impulse);
  kick(bodies_[points_[i].b], rows_[i].r_b, impulse);
}

// Returns how much velocity the step changed, as a measure of convergence.
Scalar ImpactSolver::relax_normal(std::size_t i) {
  Row& row = rows_[i];
  if (row.normal_mass == 0) return 0;
  const Vector3& n = points_[i].nhat_AB_W;
  const Scalar missing = row.target - n.dot(relative_velocity(i));
  const Scalar impulse =
      std::max(row.least_impulse, row.normal_impulse + row.normal_mass * missing);
  const Scalar change = impulse - row.normal_impulse;
  row.normal_impulse = impulse;
  apply(i, change * n);
  return std::abs(change) / row.normal_mass;
}

Scalar ImpactSolver::relax_tangents(std::size_t i) {
  Row& row = rows_[i];
  if (row.normal_mass == 0 || points_[i].friction == 0) return 0;
  const Eigen::Vector2d sliding = row.tangents.transpose() * relative_velocity(i);
  Eigen::Vector2d impulse = row.tangent_impulse - row.tangent_mass * sliding;
  const Scalar limit = points_[i].friction * row.normal_impulse;
  const Scalar norm = impulse.norm();
  if (norm > limit) impulse *= limit / norm;
  const Eigen::Vector2d change = impulse - row.tangent_impulse;
  row.tangent_impulse = impulse;
  apply(i, row.tangents * change);
  return change.norm() / row.normal_mass;
}

int ImpactSolver::sweep(bool with_friction, Scalar speed) {
  for (int iteration = 1; iteration <= kImpactIterations; ++iteration) {
    Scalar change = 0;
    for (std::size_t i = 0; i < rows_.size(); ++i) {
      change = std::max(change, relax_normal(i));
      if (with_friction) change = std::max(change, relax_tangents(i));
    }
    if (change <= kImpactConvergence * speed) return iteration;
  }
  return kImpactIterations;
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
    speed = std::max(speed, relative_velocity(i).norm());
  }
  ImpactOutcome outcome;
  outcome.iterations = sweep(true, speed);
  // With friction the sweeps may circle. Pushing on along the normals only, until nothing closes,
  // is the projection on a convex cone: it converges, costs energy, and widens the friction cones.
  for (Row& row : rows_) {
    row.target = 0;
    row.least_impulse = row.normal_impulse;
  }
  outcome.iterations += sweep(false, speed);
  for (std::size_t i = 0; i < rows_.size(); ++i) {
    if (rows_[i].normal_mass == 0) continue;
    outcome.residual = std::max(outcome.residual, -points_[i].nhat_AB_W.dot(relative_velocity(i)));
  }
  return outcome;
}

Vector3 ImpactSolver::impulse(std::size_t i) const {
  return rows_[i].normal_impulse * points_[i].nhat_AB_W +
         rows_[i].tangents * rows_[i].tangent_impulse;
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
  constexpr int kHalvings = 20;
  Scalar bounce = 1;
  int iterations = outcome.iterations;
  for (int i = 0; i < kHalvings && !may_gain && bounce > 0; ++i) {
    if (solver.kinetic_energy() <= energy_before * (1 + kImpactConvergence)) break;
    bounce = i + 1 < kHalvings ? bounce / 2 : 0;
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
