// SPDX-License-Identifier: BSD-3-Clause
#include "dyop/tissue/soft_tissue.h"

#include "dyop/core/error.h"
#include "tissue/tissue_body.h"

namespace dyop {
namespace {

bool is_finite_above(Scalar value, Scalar least) {
  return value > least && value < kInfinity;
}
bool is_finite_from(Scalar value, Scalar least) {
  return value >= least && value < kInfinity;
}

void check(const TissueMaterial& material) {
  DYOP_REQUIRE(is_finite_above(material.youngs_modulus, 0),
               "SoftTissue: youngs_modulus must be finite and > 0, not ", material.youngs_modulus);
  DYOP_REQUIRE(material.poissons_ratio > -1 && material.poissons_ratio < 0.5,
               "SoftTissue: poissons_ratio must be between -1 and 0.5, not ",
               material.poissons_ratio);
  DYOP_REQUIRE(is_finite_above(material.density, 0),
               "SoftTissue: density must be finite and > 0, not ", material.density);
  DYOP_REQUIRE(is_finite_from(material.drag, 0), "SoftTissue: drag must be finite and >= 0, not ",
               material.drag);
  DYOP_REQUIRE(is_finite_from(material.viscosity, 0),
               "SoftTissue: viscosity must be finite and >= 0, not ", material.viscosity);
}

const SoftTissueOptions& checked(const SoftTissueOptions& options) {
  check(options.material);
  DYOP_REQUIRE(is_finite_above(options.cube_edge, 0),
               "SoftTissue: cube_edge must be finite and > 0, not ", options.cube_edge);
  DYOP_REQUIRE(is_finite_above(options.period, 0),
               "SoftTissue: period must be finite and > 0, not ", options.period);
  DYOP_REQUIRE(options.gravity_W.allFinite(), "SoftTissue: gravity must be finite, not ",
               options.gravity_W);
  DYOP_REQUIRE(options.tolerance > 0 && options.tolerance < 1,
               "SoftTissue: tolerance must be between 0 and 1, not ", options.tolerance);
  DYOP_REQUIRE(options.most_iterations >= 1, "SoftTissue: most_iterations must be >= 1, not ",
               options.most_iterations);
  for (const AlignedBox& box : options.fixed) {
    DYOP_REQUIRE(!box.min().hasNaN() && !box.max().hasNaN(),
                 "SoftTissue: a fixed box must not be NaN: ", box.min(), " to ", box.max());
  }
  return options;
}

}  // namespace

SoftTissue::SoftTissue(const TriangleMesh& surface_W, const SoftTissueOptions& options)
    : body_(std::make_unique<tissue_internal::TissueBody>(surface_W, checked(options))) {}

SoftTissue::~SoftTissue() = default;
SoftTissue::SoftTissue(SoftTissue&&) noexcept = default;
SoftTissue& SoftTissue::operator=(SoftTissue&&) noexcept = default;

const SoftTissueOptions& SoftTissue::options() const {
  return body_->options();
}
std::size_t SoftTissue::cube_count() const {
  return body_->lattice().cubes().size();
}
std::size_t SoftTissue::node_count() const {
  return body_->lattice().nodes().size();
}
std::span<const Vector3> SoftTissue::vertices() const {
  return body_->vertices();
}
std::span<const TriangleIndices> SoftTissue::triangles() const {
  return body_->triangles();
}
CutReport SoftTissue::cut(const TissueKerf& kerf) {
  return body_->cut(kerf);
}
TissueBalance SoftTissue::balance() const {
  return body_->balance();
}

int SoftTissue::step(std::span<const SurfaceForce> forces) {
  const tissue_internal::NodeVectors impulses = body_->impulses_of(forces);
  tissue_internal::NodeVectors v = body_->velocities();
  const tissue_internal::NodeVectors rhs = body_->begin_step() + impulses;
  const int iterations = body_->solve(rhs, v, options().most_iterations);
  body_->finish_step(std::move(v), impulses);
  return iterations;
}

Vector3 SoftTissue::velocity(std::int32_t triangle, const Vector3& weights) const {
  return body_->sum_of(body_->carried_point(triangle, weights), body_->velocities());
}

void SoftTissue::set_velocity(const Vector3& v_W, const Vector3& w_W) {
  DYOP_REQUIRE(v_W.allFinite() && w_W.allFinite(), "SoftTissue: a velocity must be finite, not ",
               v_W, " and ", w_W);
  tissue_internal::NodeVectors v = body_->velocities();
  for (Eigen::Index n = 0; n < v.cols(); ++n) {
    if (body_->is_free(std::int32_t(n))) v.col(n) = v_W + w_W.cross(body_->positions().col(n));
  }
  body_->set_velocities(v);
}

void SoftTissue::move(const RigidPose& X) {
  body_->move(X);
}

namespace tissue_internal {

TissueBody& body_of(SoftTissue& tissue) {
  return *tissue.body_;
}

}  // namespace tissue_internal
}  // namespace dyop
