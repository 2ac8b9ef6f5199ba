// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "dyop/dynamics/advance_report.h"
#include "dyop/dynamics/rigid_body.h"

namespace DYOP_EXPORT dyop {

/// A body as a page shows it.
struct PageBody {
  std::string name;
  BodyKind kind = BodyKind::Dynamic;
  std::shared_ptr<const Shape> shape;  ///< bodies that share one are stored once
  std::string shape_name;              ///< for display; may be empty
  std::optional<MassProperties> mass_properties;
  std::string color = {};  ///< as in CSS; empty: the page's choice
  bool is_ghost = false;   ///< drawn see-through
};

/// How the mesh of a body deforms: its vertices in the body's frame, each plus the sum of all
/// weight x mode, with weights that are linear between the times and constant outside. A PageSpan
/// has the modes that are new, and for later times the weights of all modes up to then.
struct PageDeformation {
  BodyId body;
  std::vector<std::vector<Vector3>> modes;  ///< one displacement for each vertex
  std::vector<Scalar> times;                ///< ascending
  std::vector<Scalar> weights;              ///< all of the first time, then of the next ...
};

/// A diagram over time, of numbers in PageSpan::samples.
struct PageChart {
  std::string title;
  std::vector<std::string> series;
};

/// What a checker said of the recording that a page was made from.
struct PageVerdict {
  bool is_proven = false;
  std::string words;  ///< its output
};

/// The scene that a page shows before anything moves.
struct PageScene {
  std::string title;
  std::vector<PageBody> bodies;  ///< BodyId::slot is the place in this list
  Vector3 gravity_W = Vector3::Zero();
  /// JSON of the scene file (docs/formats.md), whose joints, springs and locked axes are
  /// drawn; may be empty.
  std::string scene_file;
  Scalar begin_time = 0;
  Scalar end_time = 0;  ///< as planned; the run may end earlier
  std::vector<PageDeformation> deformations = {};
  /// For a run that is not a World's: shown in place of energy, momentum and work.
  std::vector<PageChart> charts = {};
  std::string source = {};  ///< name of the recording; may be empty
  bool keeps_time = false;  ///< for a live page: the run keeps to the clock, and cannot be paused
  std::optional<PageVerdict> verdict = {};
};

/// The motion of one body over a span of time. A body stays where its last segment left it.
struct PageSegment {
  BodyId body;
  TimeInterval interval;
  std::shared_ptr<const Motion> motion;  ///< defined on `interval`; null: the body is absent
};

/// What was known after one advance of a World. Energies and momenta are those of the dynamic
/// bodies at the end: kinetic, in the uniform field of gravity, and about the world's origin.
struct PageFrame {
  TimeInterval interval;
  StepStatistics work;
  Scalar kinetic_energy = 0;
  Scalar potential_energy = 0;
  Vector3 momentum_W = Vector3::Zero();
  Vector3 angular_momentum_W = Vector3::Zero();
};

/// The gap of a pair at one time.
struct PageGap {
  Scalar t = 0;
  BodyId a;
  BodyId b;
  Scalar lower = 0;                     ///< proven
  Scalar upper = kInfinity;             ///< infinite: not computed
  bool is_resting = false;              ///< holds while both bodies stay where they are
  std::optional<ProofKind> proof = {};  ///< of the pair's distance over the step that ends at t
  std::optional<std::pair<Vector3, Vector3>> witness_W;  ///< points of A and B
  std::optional<Vector3> pivot_W;
};

/// A contact with an impulse from a step's solve.
struct PageContact {
  TimeInterval interval;
  BodyId a;
  BodyId b;
  bool is_resting = false;  ///< holds while both bodies stay where they are
  Vector3 p_WC = Vector3::Zero();
  Vector3 nhat_AB_W = Vector3::UnitX();
  Vector3 impulse_W = Vector3::Zero();  ///< on B
};

/// A pair comes into contact without an impact of its own.
struct PageTouch {
  Scalar t = 0;
  BodyId a;
  BodyId b;
};

/// The numbers of all charts at one time, chart by chart.
struct PageSample {
  Scalar t = 0;
  std::vector<Scalar> values;
};

/// A mark on the time axis.
struct PageMark {
  Scalar t = 0;
  std::string kind;  ///< asleep, woke, too_near, crossed, stalled, undecided, end
  std::string text;
  std::vector<BodyId> bodies;
};

/// A span of a run, in order of time within each list; lists may be empty.
struct PageSpan {
  std::vector<PageSegment> segments;
  std::vector<TimeInterval> steps;  ///< committed ones
  std::vector<PageFrame> frames;
  std::vector<ImpactEvent> impacts;
  std::vector<PageGap> gaps;
  std::vector<PageContact> contacts;
  std::vector<PageMark> marks;
  std::vector<PageSample> samples;
  std::vector<PageDeformation> deformations;  ///< of bodies that deform, one each
  /// Bodies that appear while the run goes on, numbered on from those that are there already.
  std::vector<PageBody> bodies = {};
  /// For runs in chunks: what the page of an ordinary run finds from its contacts.
  std::vector<PageTouch> touches;
  Scalar ordinary_impulse = 0;  ///< nine of ten contacts have none larger; 0: not known
};

/// Adds `part`, which follows `whole` in time, to its end.
void append(PageSpan& whole, PageSpan part);

/// Turns a run into the blocks of bytes that the page reads (docs/player.md). A block is a zlib
/// stream of columns. The first block holds the scene, every later block one span of time or, after
/// the letter D and its begin and end in double precision, a chunk.
///
/// Motions keep their exact parameters in double precision if they are at rest, of constant twist,
/// screws, or cubics (HermiteMotion), or made of these by SequenceMotion or ComposedMotion about
/// the centre of mass. Any other motion becomes cubics that follow it to kMotionTolerance. Shapes
/// are rounded to 2^-24 of their bounding box, and contacts to single precision, for drawing only.
/// Chunks are rounded more, see chunk().
class PageEncoder {
 public:
  /// Greatest error of a motion that is stored as cubics: of position, relative to the sum of the
  /// body's radius and distance from the origin, and of orientation, in radians.
  static constexpr Scalar kMotionTolerance = 1e-10;  // literal: a tenth of what the page promises

  /// @throws InvalidArgument if a body has no shape, or a deformation does not fit its body's mesh.
  explicit PageEncoder(PageScene scene);

  const PageScene& scene() const { return scene_; }
  std::string head() const;
  /// @throws InvalidArgument for a body that the scene does not have.
  std::string span(const PageSpan& span) const;
  /// Adds bodies to the scene, before the span that has them.
  /// @throws InvalidArgument if a body has no shape.
  void add_bodies(const std::vector<PageBody>& bodies);
  /// The segments, gaps and contacts of one stretch of time, which the page reads when that time is
  /// looked at, for runs too large to be held whole. It must say where every body is from its
  /// begin on, and what rests; the page's spans then hold only outlines. `span.frames` say how long
  /// a frame is. Rests, twists and cubics are rounded there: no point of a body is farther from its
  /// place than 4 x 2^-26 of the bounding radius of the smallest body that moves; contacts are
  /// rounded to 2^-18 of it, bounds of gaps outwards to 11 bits.
  std::string chunk(const TimeInterval& time, const PageSpan& span) const;

 private:
  PageScene scene_;
};

}  // namespace dyop
