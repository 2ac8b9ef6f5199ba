// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "check/motion.h"
#include "check/shape.h"

/// A recorded run as it is in the file (docs/formats.md, "Recordings"). TRUSTED.
namespace dyop_check {

using Pair = std::pair<std::uint32_t, std::uint32_t>;  ///< the smaller number first

/// What may change while a body is there; holds from a time on.
struct Material {
  double from = 0;
  double restitution = 0;
  double friction = 0;
  bool has_wrench = false;
};

/// How a coefficient of a pair follows from those of its bodies.
enum class Combine { GeometricMean, Mean, Product, Minimum, Maximum };

double combine(Combine rule, double a, double b);

/// Friction and restitution of one pair.
struct PairMaterial {
  double friction = 0;
  double restitution = 0;
};

/// A body with one shape and mass: with others it is another one here, that continues it.
struct RecordedBody {
  std::string name;
  std::uint32_t slot = 0;  ///< number in the file; after its end another body may have it
  double from = 0;         ///< time from which it exists
  std::optional<std::uint32_t> continues;  ///< the same body with what it was before
  bool is_dynamic = false;
  bool is_sensor = false;
  std::shared_ptr<const Body> shape;
  double bounding_radius = 0;     ///< for default distances
  std::vector<Segment> segments;  ///< in order of time
  std::set<double> placed;        ///< when the caller put it elsewhere
  // Dynamic.
  Vec center_of_mass;  ///< in the body's frame
  double mass = 0;
  Mat inertia;  ///< about the centre of mass, axes of the body
  std::array<bool, 3> locked_translation{};
  std::array<bool, 3> locked_rotation{};
  std::vector<Material> materials;  ///< in order of time

  const Material& material(double t) const;
  /// The segment followed at t; where two meet, the later one, or the one before. Null: absent.
  const Segment* segment(double t, bool before = false) const;
};

/// What holds between bodies from a time on. Pairs are of slots.
struct Rules {
  double from = 0;
  std::optional<double> target_distance;
  Vec gravity;
  std::map<Pair, double> target_distances;
  std::map<Pair, PairMaterial> materials;
  Combine friction = Combine::GeometricMean;
  Combine restitution = Combine::Minimum;
  std::set<Pair> untested;  ///< filters, joints
};

struct MomentumRow {
  std::uint32_t body = 0;
  bool is_before = false;
  Vec v;  ///< of the centre of mass
  Vec L;  ///< about it
};

struct ContactRow {
  std::uint32_t a = 0;
  std::uint32_t b = 0;
  Vec p;
  Vec n;
  Vec impulse;  ///< on B
  double target = 0;
  double friction = 0;
};

struct LinkRow {
  std::uint32_t a = 0;
  std::uint32_t b = 0;
  Vec impulse;    ///< on B
  Vec angular_a;  ///< about the centres of mass
  Vec angular_b;
};

struct WrenchRow {
  std::uint32_t body = 0;
  Vec impulse;
  Vec angular;
};

/// Velocities that changed together.
struct Change {
  enum class Kind { Move, End, Impact, Stall, Sleep, Set };
  Kind kind = Kind::Set;
  double begin = 0;
  double end = 0;
  std::vector<MomentumRow> momenta;
  std::vector<ContactRow> contacts;
  std::vector<LinkRow> links;
  std::vector<WrenchRow> wrenches;
};

struct Recording {
  std::vector<RecordedBody> bodies;
  std::vector<std::pair<double, double>> steps;
  double begin = 0;
  double end = 0;
  bool is_complete = false;  ///< the run has ended in order
  bool has_rules = false;    ///< without them, and without a scene, all pairs count
  std::vector<Rules> rules;  ///< in order of time, at least one
  /// Times from which, to which, the run itself calls a pair of slots uncertified: it began too
  /// near, or crossed.
  std::map<Pair, std::vector<std::pair<double, double>>> uncertified;
  std::vector<Change> changes;  ///< for each body in order of time; empty: not recorded

  const Rules& rules_at(double t) const;
  double target(std::uint32_t a, std::uint32_t b, const Rules& at) const;
  bool is_tested(std::uint32_t a, std::uint32_t b, const Rules& at) const;
  PairMaterial pair_material(std::uint32_t a, std::uint32_t b, double t) const;
  bool is_uncertified(std::uint32_t a, std::uint32_t b, double t) const;
};

/// @throws BadFile
Recording read_recording(const std::string& file);

}  // namespace dyop_check
