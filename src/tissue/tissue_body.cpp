// SPDX-License-Identifier: BSD-3-Clause
#include "tissue/tissue_body.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <iterator>

#include "core/assert.h"
#include "core/batch_run.h"
#include "dyop/core/error.h"

namespace dyop::tissue_internal {
namespace {

// Turns below this change no force beyond rounding.
constexpr Scalar kTurnNoise = 1e-12;  // literal: radians; Newton's method ends some 1e-16 beside it
constexpr int kMostTurns = 40;
// Averages of a node's rotation with those around it: over some cubes' length.
constexpr int kSmoothings = 10;
constexpr Scalar kTame = 1e6;  // condition that single precision bears
constexpr int kInverseIterations = 12;
// Part of the elastic energy that counts in a solve's scale: an error of the shape a tenth of the
// tolerance.
constexpr Scalar kStrainShare = 0.01;
// Part of the work of forces that a shortened step may exceed.
constexpr Scalar kForgiven = 0.5;
constexpr Scalar kStray = 0.5;  // and of the elastic energy
// Halvings of a step that would create energy; then the tissue stands.
constexpr int kMostShortenings = 6;
// Energies differ by rounding, in parts of themselves: that is not created.
constexpr Scalar kEnergyRounding = 1e-12;  // literal: some thousand roundings

Vector3 axial(const Matrix3& m) {
  return {m(2, 1) - m(1, 2), m(0, 2) - m(2, 0), m(1, 0) - m(0, 1)};
}

Scalar dot(const NodeVectors& a, const NodeVectors& b) {
  return a.cwiseProduct(b).sum();
}

// Quaternions as vectors: q and -q are the same rotation.
void add_rotation(const Eigen::Vector4d& turn, Eigen::Vector4d& sum) {
  sum += sum.dot(turn) < 0 ? Eigen::Vector4d(-turn) : turn;
}

}  // namespace

// With M = F R^T, a turn by w changes trace(R^T F), whose maximum is wanted, by w . axial(M) - w .
// (trace(M) I - sym M) w / 2.
Quaternion nearest_rotation(const Matrix3& f, Quaternion start) {
  for (int k = 0; k < kMostTurns; ++k) {
    const Matrix3 m = f * start.toRotationMatrix().transpose();
    const Vector3 slope = axial(m);
    const Matrix3 curvature = m.trace() * Matrix3::Identity() - (m + m.transpose()) / 2;
    const Scalar scale = m.norm();
    if (!(scale > 0)) return start;
    Vector3 turn = slope / (std::abs(m.trace()) + scale);
    const Eigen::LLT<Matrix3> factor(curvature);
    if (factor.info() == Eigen::Success) turn = factor.solve(slope);
    const Scalar angle = turn.norm();
    if (!(angle < kInfinity)) return start;
    if (angle < kTurnNoise) return start;
    const Scalar bounded = std::min(angle, Scalar{1});
    start = (Quaternion(Eigen::AngleAxisd(bounded, turn / angle)) * start).normalized();
  }
  return start;
}

TissueBody::TissueBody(const TriangleMesh& surface_W, const SoftTissueOptions& options)
    : options_(options),
      triangles_(surface_W.triangles().begin(), surface_W.triangles().end()),
      lattice_(surface_W, options) {
  const std::size_t count = lattice_.nodes().size();
  number_free_nodes();
  rest_.resize(3, Eigen::Index(count));
  for (std::size_t n = 0; n < count; ++n) rest_.col(Eigen::Index(n)) = lattice_.nodes()[n];
  x_ = rest_;
  v_ = NodeVectors::Zero(3, x_.cols());
  last_impulses_ = v_;
  turns_.assign(lattice_.cubes().size(), Quaternion::Identity());
  rotations_.assign(turns_.size(), Matrix3::Identity());
  node_rotations_.assign(count, Matrix3::Identity());
  vertices_.resize(surface_W.vertices().size());
  factorise();
  find_forces();
  place_vertices();
}

void TissueBody::number_free_nodes() {
  free_number_.clear();
  is_part_held_.assign(lattice_.part_count(), 0);
  std::int32_t next = 0;
  for (std::size_t n = 0; n < lattice_.nodes().size(); ++n) {
    const Vector3& p = lattice_.nodes()[n];
    const bool is_fixed = std::any_of(options_.fixed.begin(), options_.fixed.end(),
                                      [&](const AlignedBox& box) { return box.contains(p); });
    free_number_.push_back(is_fixed ? -1 : next++);
    if (is_fixed) is_part_held_[std::size_t(lattice_.part_of_node(std::int32_t(n)))] = 1;
  }
  free_count_ = next;
}

// Whether single precision suffices for a preconditioner. The largest eigenvalue is about that of
// the stiffest node; inverse iteration gives the smallest, somewhat too large.
bool TissueBody::is_tame(const BlockRows& rows) const {
  Scalar stiffest = 0;
  for (std::size_t n = 0; n < rows.size(); ++n) {
    stiffest = std::max(stiffest, rows[n].at(std::int32_t(n)).trace());
  }
  Eigen::VectorXd x = Eigen::VectorXd::LinSpaced(3 * free_count_, 1, 2).normalized();
  Scalar answer = 0;
  for (int k = 0; k < kInverseIterations && x.size() > 0; ++k) {
    factor_.solve_one(x);
    answer = x.norm();
    x /= answer;
  }
  return stiffest * answer < kTame;
}

// A of the body at rest.
void TissueBody::factorise() {
  const Scalar period = options_.period;
  const TissueMaterial& material = options_.material;
  std::vector<Cell> cells;
  BlockRows rows;
  for (std::size_t n = 0; n < free_number_.size(); ++n) {
    if (free_number_[n] < 0) continue;
    const Scalar mass = (1 + material.drag * period) * lattice_.masses()[n];
    rows.push_back({{free_number_[n], mass * Matrix3::Identity()}});
    cells.push_back(lattice_.cells()[n]);
  }
  const Scalar scale = period * (period + material.viscosity);
  for (std::size_t k = 0; k < lattice_.cubes().size(); ++k) {
    const Corners& corners = lattice_.cubes()[k];
    const Matrix24& stiffness = lattice_.element(k).stiffness;
    for (std::size_t i = 0; i < 8; ++i) {
      const std::int32_t row = free_number_[std::size_t(corners[i])];
      if (row < 0) continue;
      for (std::size_t j = 0; j < 8; ++j) {
        const std::int32_t column = free_number_[std::size_t(corners[j])];
        if (column < 0) continue;
        const auto [block, is_new] = rows[std::size_t(row)].try_emplace(column, Matrix3::Zero());
        block->second += scale * stiffness.block<3, 3>(3 * Eigen::Index(i), 3 * Eigen::Index(j));
      }
    }
  }
  try {
    factor_ = NestedCholesky(cells, rows);
  } catch (const InvalidArgument&) {  // the masses are lost in the rounding of the stiffness
    throw InvalidArgument(core_internal::compose_message(
        "SoftTissue: too stiff for double precision: youngs_modulus ", material.youngs_modulus,
        ", viscosity ", material.viscosity, ", density ", material.density, ", period ", period,
        ", cube_edge ", options_.cube_edge));
  }
  if (is_tame(rows)) factor_.round_to_single();
}

Vector24 TissueBody::corner_values(std::size_t cube, const NodeVectors& field) const {
  Vector24 values;
  const Corners& corners = lattice_.cubes()[cube];
  const Matrix3 back = rotations_[cube].transpose();
  for (std::size_t c = 0; c < 8; ++c) {
    values.segment<3>(3 * Eigen::Index(c)) = back * field.col(corners[c]);
  }
  return values;
}

// The corners' displacements in the cube's own frame: R^T x - X, about a corner, so that no
// precision is lost far from the origin.
Vector24 TissueBody::strained(std::size_t cube) const {
  Vector24 values;
  const Corners& corners = lattice_.cubes()[cube];
  const Matrix3 back = rotations_[cube].transpose();
  for (std::size_t c = 0; c < 8; ++c) {
    values.segment<3>(3 * Eigen::Index(c)) = back * (x_.col(corners[c]) - x_.col(corners[0])) -
                                             (rest_.col(corners[c]) - rest_.col(corners[0]));
  }
  return values;
}

void TissueBody::find_rotations() {
  for (std::size_t k = 0; k < turns_.size(); ++k) {
    const Corners& corners = lattice_.cubes()[k];
    const CubeElement& element = lattice_.element(k);
    Matrix3 f = Matrix3::Zero();
    for (std::size_t c = 1; c < 8; ++c) {
      f += (x_.col(corners[c]) - x_.col(corners[0])) *
           element.gradients.col(Eigen::Index(c)).transpose();
    }
    turns_[k] = nearest_rotation(f, turns_[k]);
    rotations_[k] = turns_[k].toRotationMatrix();
  }
  find_node_rotations();
}

// Those that turn the factor of the body at rest. They must change little from node to node: where
// they do not, a displacement common to all nodes strains the turned factor, which is then too stiff
// for the soft modes of thin parts by as much as those are softer than a cube, and the forces of a
// joint step overshoot.
void TissueBody::find_node_rotations() {
  std::vector<Eigen::Vector4d> of_cubes, of_nodes(node_rotations_.size());
  for (const Quaternion& turn : turns_) of_cubes.push_back(turn.coeffs());
  for (int pass = 0;; ++pass) {
    of_nodes.assign(of_nodes.size(), Eigen::Vector4d::Zero());
    for (std::size_t k = 0; k < of_cubes.size(); ++k) {
      for (const std::int32_t node : lattice_.cubes()[k]) {
        add_rotation(of_cubes[k], of_nodes[std::size_t(node)]);
      }
    }
    for (Eigen::Vector4d& turn : of_nodes) turn.normalize();
    if (pass == kSmoothings) break;
    for (std::size_t k = 0; k < of_cubes.size(); ++k) {
      of_cubes[k].setZero();
      for (const std::int32_t node : lattice_.cubes()[k]) {
        add_rotation(of_nodes[std::size_t(node)], of_cubes[k]);
      }
    }
  }
  for (std::size_t n = 0; n < of_nodes.size(); ++n) {
    node_rotations_[n] = Quaternion(of_nodes[n]).toRotationMatrix();
  }
}

void TissueBody::find_forces() {
  forces_.setZero(3, x_.cols());
  elastic_energy_ = 0;
  for (std::size_t k = 0; k < turns_.size(); ++k) {
    const Vector24 displacement = strained(k);
    const Vector24 force = lattice_.element(k).stiffness * displacement;
    elastic_energy_ += displacement.dot(force) / 2;
    const Corners& corners = lattice_.cubes()[k];
    for (std::size_t c = 0; c < 8; ++c) {
      forces_.col(corners[c]) -= rotations_[k] * force.segment<3>(3 * Eigen::Index(c));
    }
  }
}

NodeVectors TissueBody::begin_step() const {
  NodeVectors rhs(3, x_.cols());
  for (Eigen::Index n = 0; n < rhs.cols(); ++n) {
    const Scalar mass = lattice_.masses()[std::size_t(n)];
    rhs.col(n) = mass * v_.col(n) + options_.period * (forces_.col(n) + mass * options_.gravity_W);
  }
  return rhs;
}

NodeVectors TissueBody::apply(const NodeVectors& v) const {
  NodeVectors sum = NodeVectors::Zero(3, v.cols());
  for (std::size_t k = 0; k < turns_.size(); ++k) {
    const Vector24 force = lattice_.element(k).stiffness * corner_values(k, v);
    const Corners& corners = lattice_.cubes()[k];
    for (std::size_t c = 0; c < 8; ++c) {
      sum.col(corners[c]) += rotations_[k] * force.segment<3>(3 * Eigen::Index(c));
    }
  }
  const TissueMaterial& material = options_.material;
  const Scalar scale = options_.period * (options_.period + material.viscosity);
  const Scalar inertia = 1 + material.drag * options_.period;
  for (Eigen::Index n = 0; n < v.cols(); ++n) {
    if (!is_free(std::int32_t(n))) {
      sum.col(n).setZero();
    } else {
      sum.col(n) = scale * sum.col(n) + inertia * lattice_.masses()[std::size_t(n)] * v.col(n);
    }
  }
  return sum;
}

NodeVectors TissueBody::precondition(const NodeVectors& rhs) const {
  NodeVectors answer = NodeVectors::Zero(3, rhs.cols());
  Eigen::VectorXd turned(3 * free_count_);
  for (Eigen::Index n = 0; n < rhs.cols(); ++n) {
    const std::int32_t number = free_number_[std::size_t(n)];
    if (number < 0) continue;
    turned.segment<3>(3 * Eigen::Index(number)) =
        node_rotations_[std::size_t(n)].transpose() * rhs.col(n);
  }
  factor_.solve_one(turned);
  for (Eigen::Index n = 0; n < rhs.cols(); ++n) {
    const std::int32_t number = free_number_[std::size_t(n)];
    if (number < 0) continue;
    answer.col(n) = node_rotations_[std::size_t(n)] * turned.segment<3>(3 * Eigen::Index(number));
  }
  return answer;
}

// Conjugate gradients. With z = P r, r . z is about the square of the error's energy norm.
int TissueBody::solve(const NodeVectors& rhs, NodeVectors& v, int most) const {
  const NodeVectors applied = apply(v);
  NodeVectors rest = rhs - applied;
  for (Eigen::Index n = 0; n < rest.cols(); ++n) {
    if (!is_free(std::int32_t(n))) rest.col(n).setZero();
  }
  NodeVectors z = precondition(rest);
  Scalar error = dot(rest, z);
  // What is nearly at rest needs to be no more exact than its strain.
  const Scalar scale = dot(v, applied) + error + kStrainShare * elastic_energy_;
  const Scalar enough = options_.tolerance * options_.tolerance * scale;
  NodeVectors direction = z;
  int iteration = 0;
  while (iteration < most && error > enough) {
    const NodeVectors change = apply(direction);
    const Scalar step = error / dot(direction, change);
    v += step * direction;
    rest -= step * change;
    ++iteration;
    z = precondition(rest);
    const Scalar next = dot(rest, z);
    direction = z + next / error * direction;
    error = next;
  }
  keep_momentum(rest, v);
  return iteration;
}

// Of a part that is held nowhere the elastic forces sum to zero, so the residual's sum is the
// momentum that v lacks. A common velocity strains nothing and settles it.
void TissueBody::keep_momentum(const NodeVectors& rest, NodeVectors& v) const {
  const Scalar inertia = 1 + options_.material.drag * options_.period;
  v += common_velocity(rest) / inertia;
}

// Of the nodes of each part that is held nowhere: the sum of these impulses over its mass.
NodeVectors TissueBody::common_velocity(const NodeVectors& impulses) const {
  NodeVectors sums = NodeVectors::Zero(3, Eigen::Index(is_part_held_.size()));
  std::vector<Scalar> masses(is_part_held_.size(), 0);
  for (Eigen::Index n = 0; n < impulses.cols(); ++n) {
    const std::int32_t part = lattice_.part_of_node(std::int32_t(n));
    sums.col(part) += impulses.col(n);
    masses[std::size_t(part)] += lattice_.masses()[std::size_t(n)];
  }
  NodeVectors common = NodeVectors::Zero(3, impulses.cols());
  for (Eigen::Index n = 0; n < impulses.cols(); ++n) {
    const std::int32_t part = lattice_.part_of_node(std::int32_t(n));
    if (is_part_held_[std::size_t(part)] != 0) continue;
    common.col(n) = sums.col(part) / masses[std::size_t(part)];
  }
  return common;
}

Scalar TissueBody::kinetic_energy(const NodeVectors& v) const {
  Scalar twice = 0;
  for (Eigen::Index n = 0; n < v.cols(); ++n) {
    if (is_free(std::int32_t(n)))
      twice += lattice_.masses()[std::size_t(n)] * v.col(n).squaredNorm();
  }
  return twice / 2;
}

Scalar TissueBody::work_of_weight(const NodeVectors& change) const {
  Scalar work = 0;
  for (Eigen::Index n = 0; n < change.cols(); ++n) {
    work += lattice_.masses()[std::size_t(n)] * options_.gravity_W.dot(change.col(n));
  }
  return work;
}

// An implicit step dissipates as long as the rotations stay; finding them anew may give energy to
// what is stretched and turns, about strain times (turn)^2. Without forces from outside, what is too
// much is taken from the velocities relative to the mean one, or, if they have too little, the step
// is shortened. Under forces half of the step keeps contacts from swinging; what is still beyond a
// part of their work and of the elastic energy is wrong, and the step is shortened further.
void TissueBody::finish_step(NodeVectors v, const NodeVectors& impulses) {
  const NodeVectors start = x_;
  const Scalar elastic = elastic_energy_, kinetic = kinetic_energy(v_);
  const bool is_free_body = impulses.isZero(0);
  for (int part = 0; part <= kMostShortenings; ++part) {
    if (part == kMostShortenings && is_free_body) v = mean_velocity(v);
    x_ = start + options_.period * v;
    find_rotations();
    find_forces();
    const Scalar pushed = dot(impulses, v);
    const Scalar work = work_of_weight(x_ - start) + pushed;
    const Scalar excess = elastic_energy_ + kinetic_energy(v) - elastic - kinetic - work;
    const bool may_err = !is_free_body && part > 0;
    const Scalar forgiven = may_err ? kForgiven * std::abs(pushed) + kStray * elastic : 0;
    const Scalar rounding = kEnergyRounding * (kinetic + elastic_energy_ + std::abs(work));
    if (!(excess > forgiven + rounding)) break;
    const NodeVectors mean = mean_velocity(v);
    const Scalar spare = kinetic_energy(v - mean);
    if (is_free_body && spare > excess) {
      v = mean + std::sqrt(1 - excess / spare) * (v - mean);
      break;
    }
    // What the parts have in common is momentum.
    v = mean + (v - mean) / 2;
  }
  v_ = v;
  last_impulses_ = impulses;
  place_vertices();
}

// Of each part; none of those that are held.
NodeVectors TissueBody::mean_velocity(const NodeVectors& v) const {
  NodeVectors momenta(3, v.cols());
  for (Eigen::Index n = 0; n < v.cols(); ++n) {
    momenta.col(n) = lattice_.masses()[std::size_t(n)] * v.col(n);
  }
  return common_velocity(momenta);
}

void TissueBody::place_vertices() {
  for (std::size_t k = 0; k < vertices_.size(); ++k) {
    const Embedding& embedding = lattice_.embeddings()[k];
    Vector3 p = Vector3::Zero();
    for (std::size_t c = 0; c < 8; ++c) p += embedding.weights[c] * x_.col(embedding.nodes[c]);
    vertices_[k] = p;
  }
}

CarriedPoint TissueBody::carried_point(std::int32_t triangle, const Vector3& weights) const {
  DYOP_REQUIRE(triangle >= 0 && std::size_t(triangle) < triangles().size(), "SoftTissue: triangle ",
               triangle, " of ", triangles().size());
  DYOP_REQUIRE(weights.allFinite(), "SoftTissue: a point's weights must be finite, not ", weights);
  CarriedPoint point;
  for (int corner = 0; corner < 3; ++corner) {
    const std::int32_t vertex = triangles()[std::size_t(triangle)][std::size_t(corner)];
    const Embedding& embedding = lattice_.embeddings()[std::size_t(vertex)];
    for (std::size_t c = 0; c < 8; ++c) {
      const Scalar weight = weights[corner] * embedding.weights[c];
      const auto found = std::find(point.nodes.begin(), point.nodes.end(), embedding.nodes[c]);
      if (found == point.nodes.end()) {
        point.nodes.push_back(embedding.nodes[c]);
        point.weights.push_back(weight);
      } else {
        point.weights[std::size_t(found - point.nodes.begin())] += weight;
      }
    }
  }
  return point;
}

Vector3 TissueBody::sum_of(const CarriedPoint& point, const NodeVectors& field) {
  Vector3 sum = Vector3::Zero();
  for (std::size_t k = 0; k < point.nodes.size(); ++k) {
    sum += point.weights[k] * field.col(point.nodes[k]);
  }
  return sum;
}

void TissueBody::add_impulse(const CarriedPoint& point, const Vector3& impulse_W,
                             NodeVectors& sum) {
  for (std::size_t k = 0; k < point.nodes.size(); ++k) {
    sum.col(point.nodes[k]) += point.weights[k] * impulse_W;
  }
}

NodeVectors TissueBody::impulses_of(std::span<const SurfaceForce> forces) const {
  NodeVectors sum = NodeVectors::Zero(3, x_.cols());
  for (const SurfaceForce& force : forces) {
    DYOP_REQUIRE(force.force_W.allFinite(), "SoftTissue: a force must be finite, not ",
                 force.force_W);
    add_impulse(carried_point(force.triangle, force.weights), options_.period * force.force_W, sum);
  }
  return sum;
}

void TissueBody::prepare_response() {
  if (!surface_number_.empty()) return;
  number_surface_nodes();
  std::vector<std::int32_t> nodes;
  for (std::size_t n = 0; n < surface_number_.size(); ++n) {
    if (surface_number_[n] >= 0) nodes.push_back(std::int32_t(n));
  }
  std::sort(nodes.begin(), nodes.end(), [&](std::int32_t a, std::int32_t b) {
    return surface_number_[std::size_t(a)] < surface_number_[std::size_t(b)];
  });
  find_response(std::move(nodes));
}

void TissueBody::number_surface_nodes() {
  surface_number_.assign(free_number_.size(), -1);
  response_rows_.clear();
  for (const Embedding& embedding : lattice_.embeddings()) {
    for (const std::int32_t node : embedding.nodes) {
      Eigen::Index& number = surface_number_[std::size_t(node)];
      if (number >= 0 || !is_free(node)) continue;
      number = Eigen::Index(response_rows_.size());
      response_rows_.push_back(3 * Eigen::Index(free_number_[std::size_t(node)]));
    }
  }
  const auto count = Eigen::Index(response_rows_.size());
  response_.resize(3 * count, 3 * count);
  has_response_.assign(response_rows_.size(), 0);
}

// Columns of the response: what impulses on these nodes do.
void TissueBody::find_response(std::vector<std::int32_t> nodes) {
  std::erase_if(nodes, [&](std::int32_t node) {
    return has_response_[std::size_t(surface_number_[std::size_t(node)])] != 0;
  });
  const auto count = Eigen::Index(nodes.size());
  constexpr Eigen::Index kTogether = 16;  // nodes: enough for products of matrices
  const auto portion = [&](std::size_t index, std::size_t) {
    const Eigen::Index first = Eigen::Index(index) * kTogether;
    const Eigen::Index taken = std::min(kTogether, count - first);
    const auto number = [&](Eigen::Index k) {
      return surface_number_[std::size_t(nodes[std::size_t(first + k)])];
    };
    Eigen::MatrixXd columns = Eigen::MatrixXd::Zero(3 * free_count_, 3 * taken);
    for (Eigen::Index k = 0; k < taken; ++k) {
      columns.block<3, 3>(response_rows_[std::size_t(number(k))], 3 * k).setIdentity();
    }
    factor_.solve(columns);
    for (Eigen::Index k = 0; k < taken; ++k) {
      for (std::size_t n = 0; n < response_rows_.size(); ++n) {
        response_.block<3, 3>(3 * Eigen::Index(n), 3 * number(k)) =
            columns.block<3, 3>(response_rows_[n], 3 * k).cast<float>();
      }
    }
  };
  run_batch(std::size_t((count + kTogether - 1) / kTogether), {}, portion);
  for (const std::int32_t node : nodes) {
    has_response_[std::size_t(surface_number_[std::size_t(node)])] = 1;
  }
}

// The mean of both directions: single precision leaves the response not quite symmetric.
Matrix3 TissueBody::response(std::int32_t n, std::int32_t m) const {
  const Eigen::Index row = 3 * surface_number_[std::size_t(n)];
  const Eigen::Index column = 3 * surface_number_[std::size_t(m)];
  const Eigen::Matrix3f both =
      response_.block<3, 3>(row, column) + response_.block<3, 3>(column, row).transpose();
  return node_rotations_[std::size_t(n)] * (both.cast<Scalar>() / 2) *
         node_rotations_[std::size_t(m)].transpose();
}

// Impulses of a step before a cut may be on nodes that are inside now.
void TissueBody::add_response(const NodeVectors& impulses, std::span<const std::int32_t> at,
                              NodeVectors& v) {
  std::vector<std::int32_t> pushed;
  for (Eigen::Index n = 0; n < impulses.cols(); ++n) {
    if (is_free(std::int32_t(n)) && !impulses.col(n).isZero(0)) pushed.push_back(std::int32_t(n));
  }
  const auto is_inside = [&](std::int32_t n) { return !is_at_surface(n); };
  if (std::any_of(pushed.begin(), pushed.end(), is_inside)) {
    v += precondition(impulses);
    return;
  }
  find_response(pushed);
  for (const std::int32_t from : pushed) {
    const Eigen::Index column = 3 * surface_number_[std::size_t(from)];
    const Eigen::Vector3f impulse =
        (node_rotations_[std::size_t(from)].transpose() * impulses.col(from)).cast<float>();
    for (const std::int32_t n : at) {
      const Eigen::Index row = 3 * surface_number_[std::size_t(n)];
      const Eigen::Vector3f answer = response_.block<3, 3>(row, column) * impulse;
      v.col(n) += node_rotations_[std::size_t(n)] * answer.cast<Scalar>();
    }
  }
}

void TissueBody::move(const RigidPose& X) {
  for (Eigen::Index n = 0; n < x_.cols(); ++n) {
    x_.col(n) = X * Vector3(x_.col(n));
    v_.col(n) = X.rotation() * v_.col(n);
  }
  find_rotations();
  find_forces();
  place_vertices();
}

TissueBalance TissueBody::balance() const {
  TissueBalance balance;
  balance.kinetic_energy = kinetic_energy(v_);
  for (Eigen::Index n = 0; n < x_.cols(); ++n) {
    if (!is_free(std::int32_t(n))) continue;
    const Scalar mass = lattice_.masses()[std::size_t(n)];
    balance.mass += mass;
    balance.potential_energy -= mass * options_.gravity_W.dot(x_.col(n));
    balance.momentum_W += mass * v_.col(n);
    balance.angular_momentum_W += mass * x_.col(n).cross(v_.col(n));
  }
  balance.elastic_energy = elastic_energy_;
  return balance;
}

}  // namespace dyop::tissue_internal
