// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "check/trusted/recording.h"

/// What a recording says beyond its motions: masses, materials, and every impulse.
namespace dyop_check {

/// Holds from a time on.
struct Material {
  double from = 0;
  double restitution = 0;
  double friction = 0;
  bool has_wrench = false;
};

struct BodyLaw {
  double mass = 0;
  Mat inertia;  ///< about the centre of mass, axes of the body
  std::array<bool, 3> locked_translation{};
  std::array<bool, 3> locked_rotation{};
  std::vector<Material> materials;  ///< in order of time

  const Material& material(double t) const { return at_time(materials, t); }
};

/// How a coefficient of a pair follows from those of its bodies.
enum class Combine { GeometricMean, Mean, Product, Minimum, Maximum };

double combine(Combine rule, double a, double b);

/// Friction and restitution of one pair.
struct PairMaterial {
  double friction = 0;
  double restitution = 0;
};

/// What holds two bodies together.
struct JointLaw {
  std::string kind;
  std::uint32_t a = 0;  ///< slots
  std::uint32_t b = 0;
  Pose X_AJ;
  Pose X_BJ;
  double least = -kInfinity;  ///< of a distance
  double most = kInfinity;
  bool has_more = false;  ///< it holds what error() does not measure: a limit, a coupling

  /// How far it is from closed, a length, for bodies of a radius.
  double error(const Pose& X_WA, const Pose& X_WB, double radius) const;
};

/// Of a line of /rules.
struct RuleLaw {
  double from = 0;
  Vec gravity;
  double rest_offset = 0;                                    ///< 0: the default
  std::optional<double> separation_speed;                    ///< none: the default
  std::map<Pair, PairMaterial> materials;                    ///< by slots
  std::map<std::uint32_t, std::vector<JointLaw>> joints_at;  ///< by slot, each joint at both
  Combine friction = Combine::GeometricMean;
  Combine restitution = Combine::Minimum;
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
  double frame_begin = 0;  ///< of the advance in which it happened; callers act before
  std::vector<MomentumRow> momenta;
  std::vector<ContactRow> contacts;
  std::vector<LinkRow> links;
  std::vector<WrenchRow> wrenches;

  /// Impulses of a move act at its start, the others at the end of their time.
  double time() const { return kind == Kind::Move ? begin : end; }
  /// Whether bodies are then where their motion before that time ended, not where a new one begins.
  bool ends_a_motion() const { return kind != Kind::Move && end > frame_begin; }
};

struct LawData {
  std::vector<BodyLaw> bodies;  ///< as those of the recording
  std::vector<RuleLaw> rules;
  double longest_advance = 0;
  std::vector<Change> changes;  ///< for each body in order of time; empty: not recorded

  Vec gravity(double t) const { return at_time(rules, t).gravity; }
  PairMaterial pair_material(const Recording& recording, std::uint32_t a, std::uint32_t b,
                             double t) const;
};

/// @throws BadFile
LawData read_law_data(const Hdf5Reader& file, const Recording& recording);

}  // namespace dyop_check
