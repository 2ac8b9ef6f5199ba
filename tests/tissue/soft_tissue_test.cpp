// SPDX-License-Identifier: BSD-3-Clause
#include "dyop/tissue/soft_tissue.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "dyop/core/error.h"
#include "support/inputs/random_inputs.h"
#include "support/inputs/tissue_bars.h"
#include "support/message_of.h"
#include "tissue/tissue_body.h"

namespace dyop {
namespace {

using testing::message_of;

constexpr Scalar kModulus = 3;
constexpr Scalar kRatio = 0.3;

SoftTissueOptions options_for(Scalar cube_edge, Scalar period = 0.01) {
  SoftTissueOptions options;
  options.material = {kModulus, kRatio, 2.0, 0, 0};
  options.cube_edge = cube_edge;
  options.period = period;
  options.tolerance = 1e-9;
  options.most_iterations = 200;
  return options;
}

TriangleMesh mesh_of(const testing::MeshArrays& arrays) {
  return TriangleMesh(arrays.vertices, arrays.triangles);
}

// A bar 8 long with a square section of 1, times `scale`, in the pose X, with vertices 1/4 apart.
class Bar {
 public:
  Bar(Scalar scale, const RigidPose& X)
      : scale_(scale),
        X_(X),
        arrays_(testing::divided_box(scale * Vector3(8, 1, 1), {32, 4, 4}, X)) {
    for (std::size_t t = 0; t < arrays_.triangles.size(); ++t) {
      for (std::size_t c = 0; c < 3; ++c) {
        corner_of_[arrays_.triangles[t][c]] = {std::int32_t(t), int(c)};
      }
    }
  }

  TriangleMesh mesh() const { return mesh_of(arrays_); }
  Scalar scale() const { return scale_; }
  Scalar length() const { return 8 * scale_; }

  Vector3 in_bar(std::size_t vertex, std::span<const Vector3> vertices) const {
    return X_.inverse() * vertices[vertex];
  }
  Vector3 rest(std::size_t vertex) const { return in_bar(vertex, arrays_.vertices); }
  std::size_t vertex_count() const { return arrays_.vertices.size(); }

  // Traction along the bar on both of its ends, (mean + slope z) away from the middle, z from -1/2
  // to 1/2: exact integrals over bilinear cells, so that they are in balance.
  std::vector<SurfaceForce> pull(Scalar mean, Scalar slope) const {
    std::vector<SurfaceForce> forces;
    const Scalar side = scale_ / 4;
    for (const auto& [vertex, corner] : corner_of_) {
      const Vector3 p = rest(std::size_t(vertex)) / scale_;
      const bool is_low = p.x()<1e-9, is_high = p.x()> 8 - 1e-9;
      if (!is_low && !is_high) continue;
      const bool is_edge_y = p.y() < 1e-9 || p.y() > 1 - 1e-9;
      const bool is_bottom = p.z()<1e-9, is_top = p.z()> 1 - 1e-9;
      // Integrals of a hat function, alone and times z.
      const Scalar y_share = is_edge_y ? 0.5 : 1;
      const Scalar z_share = is_bottom || is_top ? 0.5 : 1;
      const Scalar moment = (p.z() - 0.5) * z_share + (is_bottom ? 1 : is_top ? -1 : 0) / 24.0;
      const Scalar force = side * side * y_share * (mean * z_share + slope * moment);
      SurfaceForce pulled{corner.first, Vector3::Zero(), X_.rotation().col(0) * force};
      pulled.weights[corner.second] = 1;
      if (is_low) pulled.force_W *= -1;
      forces.push_back(pulled);
    }
    return forces;
  }

  // Least squares over all vertices of the field a + b q + c r, each per vertex in the bar's frame.
  template <typename Quantity, typename Along>
  Scalar slope_of(const Quantity& quantity, const Along& along) const {
    Eigen::MatrixXd a(Eigen::Index(vertex_count()), 7);
    Eigen::VectorXd b(a.rows());
    for (std::size_t k = 0; k < vertex_count(); ++k) {
      const Vector3 p = rest(k) / scale_ - Vector3(4, 0.5, 0.5);
      a.row(Eigen::Index(k)) << along(p), 1, p.x(), p.y(), p.z(), p.y() * p.y(), p.z() * p.z();
      b[Eigen::Index(k)] = quantity(k);
    }
    return a.colPivHouseholderQr().solve(b)[0];
  }

 private:
  Scalar scale_;
  RigidPose X_;
  testing::MeshArrays arrays_;
  std::map<std::int32_t, std::pair<std::int32_t, int>> corner_of_;
};

// Where the tissue rests under constant forces: with so long a period that inertia counts nothing.
void settle(SoftTissue& tissue, const std::vector<SurfaceForce>& forces) {
  for (int k = 0; k < 4; ++k) {
    tissue.step(forces);
    tissue.set_velocity(Vector3::Zero(), Vector3::Zero());
  }
}

RigidPose turned(Scalar scale) {
  return {Quaternion(Eigen::AngleAxisd(0.8, Vector3(1, 2, 3).normalized())),
          scale * Vector3(30, -20, 10)};
}

// Period and loads of a bar at rest: inertia counts nothing, and the load does not turn the bar.
constexpr Scalar kLongPeriod = 300;
constexpr Scalar kSmallStrain = 1e-6;

SoftTissueOptions options_at(Scalar scale) {
  SoftTissueOptions options = options_for(scale / 4);
  options.period = kLongPeriod * scale;  // a wave's time along the bar grows with the bar
  options.tolerance = 1e-6;
  return options;
}

// A couple M at both ends bends a bar to the curvature M / (E I): with a traction of slope s per
// height, s / (E height).
Scalar relative_curvature(Scalar scale, const RigidPose& X) {
  const Bar bar(scale, X);
  SoftTissue tissue(bar.mesh(), options_at(scale));
  settle(tissue, bar.pull(0, kModulus * kSmallStrain));
  const Scalar half = bar.slope_of(
      [&](std::size_t k) { return (bar.in_bar(k, tissue.vertices()) - bar.rest(k)).z() / scale; },
      [](const Vector3& p) { return p.x() * p.x(); });
  return -2 * half / kSmallStrain;
}

class BarsOfAllScales : public ::testing::TestWithParam<Scalar> {};

// Four cubes in the height.
TEST_P(BarsOfAllScales, BendLikeBernoullis) {
  EXPECT_NEAR(relative_curvature(GetParam(), RigidPose()), 1, 0.003);
}

TEST_P(BarsOfAllScales, BendLikeBernoullisAcrossTheLattice) {
  EXPECT_NEAR(relative_curvature(GetParam(), turned(GetParam())), 1, 0.03);
}

// The gradient of the displacement in the bar's frame, fitted where the ends are a height away.
Matrix3 mean_gradient(const Bar& bar, const SoftTissue& tissue) {
  const auto count = Eigen::Index(bar.vertex_count());
  Eigen::MatrixXd a = Eigen::MatrixXd::Zero(count, 4), b = Eigen::MatrixXd::Zero(count, 3);
  for (Eigen::Index k = 0; k < count; ++k) {
    const Vector3 p = bar.rest(std::size_t(k));
    if (std::abs(p.x() - bar.length() / 2) > bar.length() / 2 - bar.scale()) continue;
    a.row(k) << bar.scale(), p.transpose();
    b.row(k) = (bar.in_bar(std::size_t(k), tissue.vertices()) - p).transpose();
  }
  return a.colPivHouseholderQr().solve(b).bottomRows<3>().transpose();
}

TEST_P(BarsOfAllScales, StretchAndShrinkByHooke) {
  const auto expect = [](const RigidPose& X, Scalar sign) {
    const Bar bar(GetParam(), X);
    SoftTissue tissue(bar.mesh(), options_at(GetParam()));
    settle(tissue, bar.pull(sign * kModulus * kSmallStrain, 0));
    const Matrix3 gradient = mean_gradient(bar, tissue) / kSmallStrain;
    EXPECT_NEAR(gradient(0, 0), sign, 0.01);
    EXPECT_NEAR(gradient(1, 1), -sign * kRatio, 0.01);
    EXPECT_NEAR(gradient(2, 2), -sign * kRatio, 0.01);
  };
  expect(RigidPose(), 1);
  expect(RigidPose(), -1);
  expect(turned(GetParam()), 1);
}

INSTANTIATE_TEST_SUITE_P(SoftTissue, BarsOfAllScales, ::testing::Values(1e-4, 1.0, 1e4));

TriangleMesh lump(Scalar scale = 1) {
  testing::MeshArrays arrays = testing::icosphere(3, scale);
  for (Vector3& p : arrays.vertices) p = Vector3(p.x(), 0.6 * p.y(), 0.8 * p.z() + 0.2 * p.x());
  return mesh_of(arrays);
}

TEST(SoftTissue, HasTheMassOfItsMesh) {
  const TriangleMesh mesh = lump();
  const SoftTissue tissue(mesh, options_for(0.3));
  EXPECT_NEAR(tissue.balance().mass, mesh.compute_mass_properties(2).mass, 1e-12);
}

// Implicit Euler: after n steps v = g n T and the way is g T^2 n (n + 1) / 2.
TEST(SoftTissue, FallsFreely) {
  SoftTissueOptions options = options_for(0.3);
  options.gravity_W = Vector3(0, 1, -9);
  const TriangleMesh mesh = lump();
  SoftTissue tissue(mesh, options);
  constexpr int kSteps = 50;
  for (int n = 0; n < kSteps; ++n) tissue.step();
  const Vector3 way =
      options.gravity_W * (options.period * options.period * kSteps * (kSteps + 1) / 2);
  for (std::size_t k = 0; k < mesh.vertices().size(); ++k) {
    EXPECT_LE((tissue.vertices()[k] - mesh.vertices()[k] - way).norm(), 1e-9);
  }
  EXPECT_LE(tissue.balance().elastic_energy, 1e-15);
}

// A small force on some triangles, for some time: the body moves, turns and vibrates.
void disturb(SoftTissue& tissue, std::uint64_t seed, Scalar size) {
  std::mt19937_64 random(seed);
  std::vector<SurfaceForce> forces;
  for (const std::int32_t triangle : {0, 100, 500, 900}) {
    forces.push_back({triangle, Vector3(0.2, 0.3, 0.5), size * testing::random_direction(random)});
  }
  for (int k = 0; k < 20; ++k) tissue.step(forces);
}

TEST(SoftTissue, KeepsItsMomentum) {
  for (const Scalar tolerance : {1e-2, 1e-9}) {
    SoftTissueOptions options = options_for(0.3, 0.02);
    options.tolerance = tolerance;
    SoftTissue tissue(lump(), options);
    disturb(tissue, 7, 1);
    const TissueBalance before = tissue.balance();
    EXPECT_GT(before.elastic_energy, 0.001 * before.kinetic_energy);
    Scalar spin = before.angular_momentum_W.norm();
    for (int k = 0; k < 100; ++k) tissue.step();
    const TissueBalance after = tissue.balance();
    EXPECT_LE((after.momentum_W - before.momentum_W).norm(), 1e-12 * before.momentum_W.norm());
    // Implicit Euler brakes turning by about (w T)^2 a step; and the solve errs.
    EXPECT_NEAR(after.angular_momentum_W.norm(), spin, 0.02 * spin);
  }
}

// Nothing bends it: rounding in its energies is no reason to stop.
TEST(SoftTissue, FliesOnWithoutTurning) {
  for (const Scalar spin : {0., 1e-6}) {
    SoftTissue tissue(lump(), options_for(0.3, 0.02));
    tissue.set_velocity(Vector3(0, 0, 25), Vector3(0, 0, spin));
    const Vector3 before = tissue.balance().momentum_W;
    for (int k = 0; k < 50; ++k) tissue.step();
    EXPECT_LE((tissue.balance().momentum_W - before).norm(), 1e-9 * before.norm()) << spin;
  }
}

TEST(SoftTissue, AnImpulseBecomesMomentum) {
  SoftTissue tissue(lump(), options_for(0.3));
  const Vector3 force(0.3, -0.2, 0.1);
  for (int k = 0; k < 10; ++k) tissue.step(std::vector<SurfaceForce>{{3, {1, 0, 0}, force}});
  EXPECT_LE((tissue.balance().momentum_W - 10 * 0.01 * force).norm(), 1e-12);
}

TEST(SoftTissue, FeelsNoForceWhereItOnlyTurned) {
  std::mt19937_64 random(3);
  for (const Scalar scale : {1e-4, 1.0, 1e4}) {
    SoftTissue tissue(lump(scale), options_for(0.3 * scale, 0.1 * scale));
    for (int k = 0; k < 5; ++k) {
      tissue.move({testing::random_rotation(random), scale * Vector3(10, -5, 3)});
      const std::vector<Vector3> before(tissue.vertices().begin(), tissue.vertices().end());
      tissue.step();
      for (std::size_t v = 0; v < before.size(); ++v) {
        EXPECT_LE((tissue.vertices()[v] - before[v]).norm(), 1e-11 * scale);
      }
    }
  }
}

// The same load, turned and moved with the body, gives the same answer.
TEST(SoftTissue, DoesNotKnowWhereItIs) {
  std::mt19937_64 random(5);
  const RigidPose X(testing::random_rotation(random), Vector3(100, 200, -50));
  SoftTissue here(lump(), options_for(0.3)), there(lump(), options_for(0.3));
  there.move(X);
  const Vector3 force(0.5, 0.2, -0.4);
  for (int k = 0; k < 20; ++k) {
    here.step(std::vector<SurfaceForce>{{50, {0.2, 0.2, 0.6}, force}});
    there.step(std::vector<SurfaceForce>{{50, {0.2, 0.2, 0.6}, X.rotation() * force}});
  }
  for (std::size_t k = 0; k < here.vertices().size(); ++k) {
    EXPECT_LE((there.vertices()[k] - X * here.vertices()[k]).norm(), 1e-6);
  }
}

// What is pulled, let go and turning: without and with a fixed part, weight, loose solves.
TEST(SoftTissue, NeverCreatesEnergy) {
  for (const Scalar turning : {0.0, 0.3, 2.0}) {
    for (const Scalar period : {0.005, 0.05, 0.3}) {
      for (const bool is_fixed : {false, true}) {
        SoftTissueOptions options = options_for(0.4, period);
        options.tolerance = 1e-3;
        options.most_iterations = 10;
        options.gravity_W = Vector3(0.1, 0, -0.2);
        if (is_fixed) options.fixed.emplace_back(Vector3(-2, -2, -2), Vector3(-0.5, 2, 2));
        SoftTissue tissue(lump(), options);
        disturb(tissue, 11, 0.5);
        tissue.set_velocity(Vector3(0.1, 0, 0.2), turning * Vector3(0.3, 0.2, 1));
        TissueBalance last = tissue.balance();
        for (int k = 0; k < 60; ++k) {
          tissue.step();
          const TissueBalance next = tissue.balance();
          const Scalar size =
              next.kinetic_energy + next.elastic_energy + std::abs(next.potential_energy);
          EXPECT_LE(next.energy(), last.energy() + 1e-12 * size) << turning << ' ' << period;
          last = next;
        }
      }
    }
  }
}

TEST(SoftTissue, DampingEndsVibration) {
  SoftTissueOptions options = options_for(0.4, 0.05);
  options.fixed.emplace_back(Vector3(-2, -2, -2), Vector3(-0.5, 2, 2));
  options.material.viscosity = 0.3;
  options.material.drag = 0.5;
  SoftTissue tissue(lump(), options);
  disturb(tissue, 13, 0.5);
  const Scalar before = tissue.balance().elastic_energy;
  for (int k = 0; k < 800; ++k) tissue.step();
  EXPECT_GT(before, 0);
  EXPECT_LE(tissue.balance().energy(), 1e-6 * before);
}

TEST(SoftTissue, GivesTheSameBits) {
  SoftTissue a(lump(), options_for(0.3)), b(lump(), options_for(0.3));
  disturb(a, 1, 1);
  disturb(b, 1, 1);
  for (std::size_t k = 0; k < a.vertices().size(); ++k) EXPECT_EQ(a.vertices()[k], b.vertices()[k]);
}

TEST(SoftTissue, ComesBackFromADeepDent) {
  SoftTissueOptions options = options_for(0.4, 0.1);
  options.fixed.emplace_back(Vector3(-2, -2, -2), Vector3(-0.5, 2, 2));
  options.material.viscosity = 1;
  options.material.drag = 1;
  options.tolerance = 1e-3;
  const TriangleMesh mesh = lump();
  SoftTissue tissue(mesh, options);
  std::vector<SurfaceForce> forces;
  for (std::int32_t t = 0; t < std::int32_t(mesh.triangles().size()); t += 10) {
    forces.push_back({t, Vector3::Constant(1.0 / 3), Vector3(-0.02, 0, 0)});
  }
  for (int k = 0; k < 40; ++k) tissue.step(forces);
  Scalar deepest = 0;
  for (std::size_t k = 0; k < mesh.vertices().size(); ++k) {
    deepest = std::max(deepest, (tissue.vertices()[k] - mesh.vertices()[k]).norm());
  }
  EXPECT_GT(deepest, 0.5);
  for (int k = 0; k < 400; ++k) tissue.step();
  for (std::size_t k = 0; k < mesh.vertices().size(); ++k) {
    EXPECT_LE((tissue.vertices()[k] - mesh.vertices()[k]).norm(), 0.01);
  }
}

TEST(NearestRotation, AgreesWithTheSingularValueDecomposition) {
  std::mt19937_64 random(17);
  for (int k = 0; k < 2000; ++k) {
    Matrix3 f = testing::random_rotation(random).toRotationMatrix();
    for (int c = 0; c < 3; ++c)
      f += 0.4 * testing::random_direction(random) * Vector3::Unit(c).transpose();
    if (f.determinant() < 0.01) continue;
    const Eigen::JacobiSVD<Matrix3> svd(f, Eigen::ComputeFullU | Eigen::ComputeFullV);
    const Matrix3 expected = svd.matrixU() * svd.matrixV().transpose();
    const Matrix3 found =
        tissue_internal::nearest_rotation(f, testing::random_rotation(random)).toRotationMatrix();
    EXPECT_LE((found - expected).norm(), 1e-9) << f;
  }
}

TEST(NearestRotation, IsARotationAlsoOfNothingAndOfReflections) {
  std::mt19937_64 random(19);
  for (const Matrix3& f :
       {Matrix3(Matrix3::Zero()), Matrix3(-Matrix3::Identity()),
        Matrix3(Vector3(1, 1, -1).asDiagonal()), Matrix3(Vector3(1, 0, 0).asDiagonal()),
        Matrix3(Matrix3::Constant(kInfinity)), Matrix3(1e200 * Matrix3::Identity()),
        Matrix3(1e-200 * Matrix3::Identity())}) {
    const Quaternion found = tissue_internal::nearest_rotation(f, testing::random_rotation(random));
    EXPECT_NEAR(found.norm(), 1, 1e-12);
  }
}

TEST(SoftTissue, NamesWhatIsWrong) {
  const TriangleMesh mesh = lump();
  const auto message = [&](const auto& change) {
    SoftTissueOptions options = options_for(0.5);
    change(options);
    return message_of([&] { SoftTissue(mesh, options); });
  };
  const auto has = [](const std::string& text, const std::string& part) {
    EXPECT_NE(text.find(part), std::string::npos) << text;
  };
  has(message([](auto& o) { o.material.youngs_modulus = -3; }),
      "youngs_modulus must be finite and > 0, not -3");
  has(message([](auto& o) { o.material.poissons_ratio = 0.5; }),
      "poissons_ratio must be between -1 and 0.5, not 0.5");
  has(message([](auto& o) { o.material.density = std::nan(""); }),
      "density must be finite and > 0, not nan");
  has(message([](auto& o) { o.material.drag = -1; }), "drag must be finite and >= 0, not -1");
  has(message([](auto& o) { o.material.viscosity = kInfinity; }),
      "viscosity must be finite and >= 0, not inf");
  has(message([](auto& o) { o.cube_edge = 0; }), "cube_edge must be finite and > 0, not 0");
  has(message([](auto& o) { o.cube_edge = 1e-3; }), "cube_edge 0.001 divides");
  has(message([](auto& o) { o.period = -1; }), "period must be finite and > 0, not -1");
  has(message([](auto& o) { o.gravity_W.x() = std::nan(""); }),
      "gravity must be finite, not nan 0 0");
  has(message([](auto& o) { o.tolerance = 2; }), "tolerance must be between 0 and 1, not 2");
  has(message([](auto& o) { o.most_iterations = 0; }), "most_iterations must be >= 1, not 0");
  has(message([](auto& o) { o.fixed.emplace_back(Vector3(0, std::nan(""), 0), Vector3(1, 1, 1)); }),
      "a fixed box must not be NaN");
  has(message([](auto& o) {
        o.material.youngs_modulus = 1e30;
        o.fixed.clear();
      }),
      "too stiff for double precision: youngs_modulus 1e+30, viscosity ");
  const TriangleMesh open({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}, {{0, 1, 2}});
  has(message_of([&] { SoftTissue(open, options_for(0.5)); }), "closed");
  SoftTissue tissue(mesh, options_for(0.5));
  const auto stepped = [&](const SurfaceForce& force) {
    return message_of([&] { tissue.step(std::vector<SurfaceForce>{force}); });
  };
  has(stepped({-1, {1, 0, 0}, {}}), "triangle -1 of 1280");
  has(stepped({0, {kInfinity, 0, 0}, Vector3::Zero()}), "weights must be finite, not inf 0 0");
  has(stepped({0, {1, 0, 0}, {0, 0, std::nan("")}}), "a force must be finite, not 0 0 nan");
  has(message_of([&] {
        tissue.set_velocity({kInfinity, 0, 0}, {0, 0, 0});
      }),
      "a velocity must be finite");
}

}  // namespace
}  // namespace dyop
