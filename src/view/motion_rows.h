// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <vector>

#include "dyop/distance/distance.h"
#include "dyop/dynamics/advance_report.h"
#include "dyop/motion/interpolated_motion.h"
#include "dyop/motion/steady_motions.h"
#include "dyop/view/page_encoder.h"
#include "view/column_block.h"
#include "view/rounded_rows.h"

namespace dyop::view_internal {

struct RoundedMotions;

/// Motions of bodies over time intervals as columns of their parameters, one set of columns for
/// each kind of motion.
class MotionRows {
 public:
  /// @param tolerance Of cubics that stand in for other motions, see PageEncoder::kMotionTolerance.
  explicit MotionRows(Scalar tolerance) : tolerance_(tolerance) {}

  struct Body {
    std::uint32_t number = 0;
    Vector3 p_BoBcm = Vector3::Zero();  ///< what its motions may be about, besides its origin
    Scalar radius = 0;
  };

  /// A null motion: the body is absent.
  void add(const Body& body, const TimeInterval& interval, const Motion* motion);
  void add_to(ColumnBlock& block) const;
  /// For a chunk: rests, twists and cubics rounded, each as its difference from where the segment
  /// before it left the body; the others as they are. `bodies` are all of the scene, by number.
  void add_rounded_to(ColumnBlock& block, const Rounding& rounding, std::span<const Body> bodies,
                      const TimeTable& times) const;
  void add_times_to(TimeTable& times) const;

 private:
  // What all kinds have. `is_central`: the motion is that of the centre of mass, in the axes of B.
  struct Spans {
    std::vector<std::uint32_t> body;
    std::vector<double> begin;
    std::vector<double> end;
    std::vector<std::uint8_t> is_central;
    void add(const Body& the_body, const TimeInterval& interval, bool central);
    void add_to(ColumnBlock& block, const std::string& kind) const;
  };
  struct Poses {
    std::vector<Vector3> position;
    std::vector<Vector3> vector;  // of the quaternion
    std::vector<double> scalar;
    void add(const RigidPose& X);
    Quaternion quaternion(std::size_t row) const;
    void add_to(ColumnBlock& block, const std::string& kind) const;
  };

  // False if the kind of motion has no exact rows.
  bool add_exact(const Body& body, const TimeInterval& interval, const Motion& motion,
                 bool is_central);
  void add_cubics(const Body& body, const TimeInterval& interval, const Motion& motion);
  bool is_close(const Body& body, const HermiteMotion& cubic, const TimeInterval& interval,
                const Motion& motion) const;
  void add_rest(const Body& body, const TimeInterval& interval, const RigidPose& X,
                bool is_central);
  void add_twist(const Body& body, const TimeInterval& interval, const ConstantTwistMotion& motion,
                 bool is_central);
  void add_screw(const Body& body, const TimeInterval& interval, const ScrewMotion& motion,
                 bool is_central);
  void add_cubic(const Body& body, const TimeInterval& interval, const HermiteMotion& motion,
                 bool is_central);

  void add_motion(const Body& body, const TimeInterval& interval, const Motion& motion);
  void add_screws_to(ColumnBlock& block) const;

  enum class Kind : std::uint8_t { Rest = 0, Twist = 1, Cubic = 3 };  // as the page numbers them
  struct Entry {
    std::uint32_t body;
    double begin;
    Kind kind;
    std::size_t row;
  };
  std::vector<Entry> entries() const;
  const Spans& spans_of(Kind kind) const;
  void round_rest(std::size_t row, RoundedMotions& to) const;
  void round_twist(std::size_t row, RoundedMotions& to) const;
  void round_cubic(std::size_t row, RoundedMotions& to) const;
  HermiteNode cubic_at(std::size_t row, Scalar t) const;

  Scalar tolerance_;
  Spans absent_;
  struct {
    Spans spans;
    Poses poses;
  } rest_;
  struct {
    Spans spans;
    Poses poses;
    std::vector<double> t0;
    std::vector<Vector3> v_W, w_W;
  } twist_;
  struct {
    Spans spans;
    Poses poses;
    std::vector<double> t0, turn_rate, slide_rate;
    std::vector<Vector3> p_WA, axis_W;
  } screw_;
  struct {
    Spans spans;
    Poses charts;
    std::vector<double> domain_begin, domain_end;
    std::vector<Vector3> p0, v0, theta0, theta_rate0, p1, v1, theta1, theta_rate1;
  } cubic_;
};

/// Adds the gap and the contacts of a near pair at the end of a frame.
void add_pair(const PairRecord& pair, const TimeInterval& frame, PageSpan& span);

/// Computes witness points and tight bounds of a gap by one distance query.
void add_witness(PageGap& gap, const Shape& a, const RigidPose& X_WA, const Shape& b,
                 const RigidPose& X_WB, DistanceCache& cache);

/// Puts the witness points, normal and bounds of an impact where the shapes are at these poses, the
/// committed ones. Where a force acts, the poses of the impact's own query differ from them, and
/// its points would float beside the bodies. A pair that overlaps here keeps what it has.
void place_impact(ImpactEvent& event, const Shape& a, const RigidPose& X_WA, const Shape& b,
                  const RigidPose& X_WB);

/// The mark of an advance that did not reach its end, or null.
const char* undecided_words(AdvanceStatus status);

/// Why a run whose last advance had this status ended at time t, as a sentence.
const char* ending_words(AdvanceStatus status, Scalar t, Scalar planned_end);

}  // namespace dyop::view_internal
