// SPDX-License-Identifier: BSD-3-Clause

// Random worlds: 2 to 40 bodies of all shapes at three scales, stirrers, joints, springs.
//   random_worlds COUNT [SEED] [STEPS] [turning]
// With `turning` all bodies resist rolling and spinning.
// Every committed step is sampled and the distances measured by an oracle that shares nothing with
// the library; a pair nearer than its target, a stall, an unexpected end and energy from nowhere
// are faults. Each run is recorded: one that dyop-check does not prove, laws included, is one, too.
// Prints what was met and exits with 1 if there was a fault.
#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <map>
#include <memory>
#include <random>
#include <string>
#include <vector>

#include "dyop/dynamics/world.h"
#include "dyop/geometry/compound_shape.h"
#include "dyop/geometry/convex_hull.h"
#include "dyop/geometry/primitives.h"
#include "dyop/geometry/triangle_mesh.h"
#include "dyop/io/recording.h"
#include "dyop/motion/steady_motions.h"
#include "support/check_answer.h"
#include "support/inputs/mesh_generators.h"
#include "support/inputs/random_inputs.h"
#include "support/oracles/fast_distance_oracle.h"
#include "support/temporary_directory.h"

namespace dyop::testing {
namespace {

constexpr Scalar kGravity = 10;
constexpr int kSamples = 4;  // within each committed step, besides its start
// Energy a world without stirrers may gain: the residual of solves and the error of curved contact.
constexpr Scalar kEnergyBound = 2e-3;  // relative to what it began with

struct Tally {
  std::map<std::string, int> faults;
  std::map<AdvanceStatus, int> ends;
  std::int64_t bodies = 0;
  std::int64_t steps = 0;
  std::int64_t samples = 0;
  std::int64_t impacts = 0;
  std::int64_t stalls = 0;
  std::int64_t unconverged = 0;
  Scalar least_excess = kInfinity;
};

class RandomWorld {
 public:
  RandomWorld(std::uint64_t seed, bool has_turning)
      : random_(seed), turning_(seed), seed_(seed), has_turning_(has_turning) {
    constexpr Scalar kScales[] = {1, 1e-3, 1e3};  // literal: sizes of scenes
    scale_ = kScales[seed % 3];
    WorldOptions options;
    options.gravity_W = Vector3(0, 0, -kGravity * scale_);
    options.thread_count = 1;
    options.records_impulses = true;
    world_ = std::make_unique<World>(options);
    add_floor();
    const int stirrers = std::max(0, random_index(4, random_) - 1);
    for (int i = 0; i < stirrers; ++i) add_stirrer(i);
    is_stirred_ = stirrers > 0;
    // Small worlds are cheap and find as much: most are.
    const int most = random_index(4, random_) == 0 ? 39 : 10;
    const int count = 2 + random_index(most, random_);
    for (int i = 0; i < count; ++i) add_body(i);
    if (random_index(3, random_) == 0) add_spring();
    if (random_index(3, random_) == 0) add_joint();
  }

  std::size_t body_count() const { return bodies_.size(); }

  void run(int steps, Tally& tally) {
    const TemporaryDirectory directory;
    const std::filesystem::path file = directory.path() / "run.h5";
    RecordingWriter writer(file, {});
    run(steps, writer, tally);
    writer.finish();
    const Answer answer = testing::check(file);
    if (answer.code == kProven) return;
    std::printf("%s%s", answer.text.c_str(), answer.error.c_str());
    fault(tally, "not proven by dyop-check", -1);
  }

  void fault(Tally& tally, const std::string& kind, int step) const {
    if (tally.faults[kind]++ < 5) {
      std::printf("  fault: %s, seed %llu, step %d, %zu bodies\n", kind.c_str(),
                  static_cast<unsigned long long>(seed_), step, bodies_.size());
    }
  }

 private:
  struct Body {
    BodyId id;
    std::shared_ptr<const Shape> shape;
    std::vector<std::pair<OracleBody, RigidPose>> oracles;  // one per child, with its pose
    bool is_dynamic = false;
  };

  void run(int steps, RecordingWriter& writer, Tally& tally) {
    const Scalar before = energy();
    constexpr Scalar kSteps[] = {0.005, 0.01, 1.0 / 60};
    const Scalar h = kSteps[random_index(3, random_)];
    for (int k = 0; k < steps; ++k) {
      const AdvanceReport report = world_->advance(h);
      writer.write(report, *world_);
      ++tally.steps;
      tally.impacts += std::int64_t(report.impacts.size());
      tally.stalls += report.work.stalls;
      tally.unconverged += report.work.unconverged;
      const bool is_blocked = report.status == AdvanceStatus::Blocked;
      for (const CommittedStep& step : report.steps) check(step, tally);
      if (report.work.stalls > 0) fault(tally, "stall", k);
      if (!report.too_near.empty()) fault(tally, "too near", k);
      if (!is_stirred_ && energy() > before * (1 + kEnergyBound)) {
        std::printf("  energy %.6g of %.6g at t = %g\n", energy(), before, report.t);
        fault(tally, "energy", k);
        return;
      }
      if (report.status == AdvanceStatus::Completed) continue;
      // Bodies may be jammed by a stirrer, which cannot give way; nothing else may end the run.
      ++tally.ends[report.status];
      std::printf("  seed %llu ended at t = %g between %u and %u\n",
                  static_cast<unsigned long long>(seed_), report.t,
                  report.offending_pair.first.slot, report.offending_pair.second.slot);
      if (!is_blocked || !is_stirred_) fault(tally, "ended", k);
      return;
    }
    ++tally.ends[AdvanceStatus::Completed];
  }

  Scalar number(Scalar low, Scalar high) { return random_number(low, high, random_); }

  // Kinetic, of gravity, of springs.
  Scalar energy() const {
    Scalar sum = world_->kinetic_energy() + world_->spring_energy();
    for (const Body& body : bodies_) {
      if (!body.is_dynamic) continue;
      const MassProperties& mass = world_->body(body.id).mass_properties;
      // From a little below the floor, so that it is positive and of the size of what happens.
      const Scalar height = (world_->state(body.id).X_WB * mass.p_BoBcm).z() + scale_;
      sum += mass.mass * kGravity * scale_ * height;
    }
    return sum;
  }

  void add(BodyDefinition definition) {
    if (has_turning_) {
      definition.rolling_friction = scale_ * random_number(0, 0.05, turning_);
      definition.torsional_friction = scale_ * random_number(0, 0.05, turning_);
    }
    Body body;
    body.id = world_->add_body(definition);
    body.shape = definition.shape;
    if (const auto* compound = dynamic_cast<const CompoundShape*>(body.shape.get())) {
      for (const CompoundChild& child : compound->children()) {
        body.oracles.emplace_back(OracleBody(*child.shape), child.X_CS);
      }
    } else {
      body.oracles.emplace_back(OracleBody(*body.shape), RigidPose());
    }
    body.is_dynamic = definition.kind == BodyKind::Dynamic;
    bodies_.push_back(std::move(body));
  }

  void add_floor() {
    BodyDefinition floor;
    floor.name = "floor";
    floor.kind = BodyKind::Static;
    floor.friction = number(0, 1);
    if (random_index(2, random_) == 0) {
      floor.shape = std::make_shared<Box>(Vector3(8, 8, 1) * scale_);
      floor.initial.X_WB = RigidPose(Vector3(0, 0, -scale_));
    } else {
      floor.shape = std::make_shared<TriangleMesh>(
          testing::plate_grid(16 * scale_, 16 * scale_, 12, 12).mesh());
    }
    add(floor);
  }

  void add_stirrer(int i) {
    BodyDefinition body;
    body.name = "stirrer";
    body.kind = BodyKind::Kinematic;
    body.shape = std::make_shared<Box>(Vector3(2, 0.1, 0.3) * scale_);
    // The second runs the other way, above.
    const Scalar turn = number(-3, 3);
    body.motion = std::make_shared<ConstantTwistMotion>(
        RigidPose(Vector3(0, 0, (0.5 + i) * scale_)), Twist{Vector3::Zero(), Vector3(0, 0, turn)});
    body.friction = number(0, 1);
    body.restitution = number(0, 0.5);
    add(body);
  }

  std::shared_ptr<const Shape> make_shape() {
    const Scalar r = scale_ * number(0.15, 0.5);
    switch (random_index(9, random_)) {
      case 0:
        return std::make_shared<Box>(
            0.6 * Vector3(r, r * number(0.1, 1), r * number(0.1, 1)));  // apart at the start
      case 1:
        return std::make_shared<Sphere>(r);
      case 2:
        return std::make_shared<Capsule>(r / 3, r * number(0.2, 0.7));
      case 3: {
        std::vector<Vector3> points(12);
        for (Vector3& p : points) p = r * random_direction(random_);
        return std::make_shared<ConvexHull>(points);
      }
      case 4:
        return std::make_shared<TriangleMesh>(testing::box_mesh(Vector3(r, r / 2, r / 3)).mesh());
      case 5:
        return std::make_shared<TriangleMesh>(testing::torus(r, r / 3, 12, 8).mesh());
      case 6:
        return std::make_shared<TriangleMesh>(testing::gear(7, 0.7 * r, r, r / 2).mesh());
      case 7: {  // a dumbbell or a hammer
        const RigidPose X_CP(Vector3(0.6 * r, 0, 0));
        const bool is_hammer = random_index(2, random_) == 0;
        const auto sphere = std::make_shared<Sphere>(0.4 * r);
        const auto head = std::make_shared<Box>(Vector3(0.2, 0.4, 0.3) * r);
        const auto rod = std::make_shared<Box>(Vector3(0.5, 0.1, 0.1) * r);
        return std::make_shared<CompoundShape>(std::vector<CompoundChild>{
            {is_hammer ? std::shared_ptr<const Shape>(head) : sphere, X_CP},
            {rod, RigidPose()},
            {sphere, X_CP.inverse()}});
      }
      default:
        return std::make_shared<TriangleMesh>(testing::icosphere(1, r).mesh());
    }
  }

  void add_body(int i) {
    BodyDefinition body;
    body.name = "body " + std::to_string(i);
    body.shape = make_shape();
    body.mass_properties = body.shape->compute_mass_properties(number(100, 5000));
    const Vector3 place(1.4 * (i % 3) - 1.4, 1.4 * (i / 3 % 3) - 1.4, 2.6 + 1.4 * (i / 9));
    body.initial.X_WB = RigidPose(random_rotation(random_).toRotationMatrix(), scale_ * place);
    body.initial.twist = {random_vector(scale_ * number(0, 3), random_),
                          random_vector(number(0, 8), random_)};
    body.friction = number(0, 1);
    body.restitution = number(0, 1);
    add(body);
  }

  // Two dynamic bodies that are neighbours at the start.
  std::pair<const Body*, const Body*> neighbours() const {
    const std::size_t last = bodies_.size() - 1;
    return {&bodies_[last - 1], &bodies_[last]};
  }

  void add_spring() {
    const auto [a, b] = neighbours();
    SpringDefinition spring;
    spring.name = "spring";
    spring.a = a->id;
    spring.b = b->id;
    const Scalar mass = world_->body(a->id).mass_properties.mass;
    spring.stiffness = mass * random_magnitude(0, 4, random_);
    spring.damping = mass * number(0, 2);
    world_->add_spring(spring);
  }

  void add_joint() {
    const auto [a, b] = neighbours();
    JointDefinition joint;
    joint.name = "joint";
    joint.kind = JointKind::Distance;
    joint.a = a->id;
    joint.b = b->id;
    joint.bodies_collide = true;
    world_->add_joint(joint);
  }

  // Samples the motions of a step.
  void check(const CommittedStep& step, Tally& tally) {
    for (int s = 1; s <= kSamples; ++s) {
      const Scalar t = s == kSamples ? step.interval.end
                                     : step.interval.begin + step.interval.length() * s / kSamples;
      std::vector<RigidPose> poses;
      for (const Body& body : bodies_) poses.push_back(step.motions[body.id.slot]->pose(t));
      for (std::size_t i = 0; i < bodies_.size(); ++i) {
        for (std::size_t k = 0; k < i; ++k)
          check_pair(bodies_[k], poses[k], bodies_[i], poses[i], tally);
      }
    }
  }

  void check_pair(const Body& a, const RigidPose& X_WA, const Body& b, const RigidPose& X_WB,
                  Tally& tally) {
    if (!a.is_dynamic && !b.is_dynamic) return;
    const Scalar between = (X_WA.translation() - X_WB.translation()).norm();
    if (between > a.shape->bounding_radius() + b.shape->bounding_radius() + scale_) return;
    const Scalar target =
        1e-4 * std::min(a.shape->bounding_radius(), b.shape->bounding_radius());  // the default
    const SearchGap gap{target / 1000, 0.5, target};
    Scalar nearest = kInfinity;
    for (const auto& [part_a, X_AP] : a.oracles) {
      for (const auto& [part_b, X_BP] : b.oracles) {
        PairSeed seed;
        const DistanceBracket bracket =
            fast_oracle_distance(part_a, X_WA * X_AP, part_b, X_WB * X_BP, gap, seed);
        nearest = std::min(nearest, bracket.upper);
      }
    }
    ++tally.samples;
    const Scalar excess = (nearest - target) / target;
    tally.least_excess = std::min(tally.least_excess, excess);
    if (excess < 0) fault(tally, "nearer than the target", -1);
  }

  std::mt19937_64 random_;
  std::mt19937_64 turning_;  // its own: worlds with and without it are otherwise the same
  std::uint64_t seed_;
  const bool has_turning_;
  Scalar scale_ = 1;
  bool is_stirred_ = false;
  std::unique_ptr<World> world_;
  std::vector<Body> bodies_;
};

void report(const Tally& tally, int count) {
  std::printf(
      "%d worlds, %lld bodies, %lld steps, %lld impacts, %lld stalls, %lld solves not "
      "converged\n",
      count, static_cast<long long>(tally.bodies), static_cast<long long>(tally.steps),
      static_cast<long long>(tally.impacts), static_cast<long long>(tally.stalls),
      static_cast<long long>(tally.unconverged));
  std::printf("%lld samples, least excess over the target %.3g targets\n",
              static_cast<long long>(tally.samples), tally.least_excess);
  for (const auto& [status, number] : tally.ends) {
    std::printf("ended with status %d: %d\n", static_cast<int>(status), number);
  }
  for (const auto& [kind, number] : tally.faults) {
    std::printf("FAULTS %s: %d\n", kind.c_str(), number);
  }
  if (tally.faults.empty()) std::printf("no faults\n");
}

}  // namespace
}  // namespace dyop::testing

int main(int argc, char** argv) {
  using namespace dyop::testing;
  const int count = argc > 1 ? std::atoi(argv[1]) : 20;
  const std::uint64_t first = argc > 2 ? std::strtoull(argv[2], nullptr, 10) : 1;
  const int steps = argc > 3 ? std::atoi(argv[3]) : 80;
  const bool has_turning = argc > 4 && std::string(argv[4]) == "turning";
  Tally tally;
  for (int i = 0; i < count; ++i) {
    RandomWorld world(first + std::uint64_t(i), has_turning);
    tally.bodies += std::int64_t(world.body_count());
    try {
      world.run(steps, tally);
    } catch (const std::exception& error) {
      std::printf("  %s\n", error.what());
      world.fault(tally, "exception", -1);
    }
  }
  report(tally, count);
  return tally.faults.empty() ? 0 : 1;
}
