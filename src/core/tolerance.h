// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cmath>
#include <cstddef>
#include <limits>

#include "dyop/core/types.h"

/// All numerical constants of dyop. Three words are kept apart: *noise* is rounding and is
/// computed, *tolerance* is what the user asked for, *limit* is a count.
namespace DYOP_EXPORT dyop {

/// Unit roundoff u of double, 2^-53. All noise constants are multiples of it.
inline constexpr Scalar kUnitRoundoff = std::numeric_limits<Scalar>::epsilon() / 2;

/// How far a quaternion's norm or R^T R may be from one before a pose is refused (relative). Below
/// it the rotation is normalised. Larger: bad input passes; smaller: poses written with seven
/// digits are refused. Used by RigidPose.
inline constexpr Scalar kRotationTolerance = 1e-6;

/// How far from one the norm of a device's quaternion may be (relative); it is then normalised.
/// Larger: nonsense passes; smaller: numbers of three digits are refused. Used by HapticSession.
inline constexpr Scalar kDeviceRotationTolerance = 1e-2;

/// How far a motion's pose may be from a rotation in a query: with columns x, y, z the sum of |
/// |x|^2 - 1 |, | |y|^2 - 1 |, |x . y| and the entries of x cross y - z. Lengths then stretch by at
/// most twice as much; kStepNoise has 200u to spare. Larger: bounds may fail; smaller: products of
/// many rotations are refused. Used by guarded_state().
inline constexpr Scalar kEngineRotationNoise = 96 * kUnitRoundoff;

/// Rounding in one coordinate of a point transformed by a pose, as a multiple of the size of the
/// numbers involved (|translation| + |point|). A matrix-vector product and a sum err by at most
/// gamma_4 per coordinate, sqrt(3) gamma_4 < 8u in norm ([Higham2002] ch. 3); composing two poses
/// first triples it, and a rotation matrix that is orthonormal only to rounding adds as much again.
/// Used wherever points of two bodies are compared. Smaller: bounds may fail.
inline constexpr Scalar kPoseNoise = 64 * kUnitRoundoff;

/// Rounding in a gap between two moving pieces, relative to the size of the query: 312u for poses
/// and for support values along turning directions (toi/rigid/motion_bounds.h).
/// Smaller: bounds may fail. Used by time_of_impact and, for boxes, by distance.
inline constexpr Scalar kStepNoise = 512 * kUnitRoundoff;

/// Default tolerance of an impact, relative to the size of the smaller shape. Larger: looser
/// impacts; smaller: closer to rounding far from the origin. Used by
/// default_distance_tolerance().
inline constexpr Scalar kDefaultRelativeTolerance = 1e-6;

/// Time of impact divides the band of width distance_tolerance above the target, at these fractions
/// of it. Steps towards contact stop at kLeafTargetFraction: closer to one, slower convergence at
/// contact; closer to zero, less slack below. A query that starts below kGuaranteedFraction
/// guarantees nothing; the slack between the two covers the rounding of poses when a body is
/// restarted from a contact.
inline constexpr Scalar kGuaranteedFraction = 0.25;
inline constexpr Scalar kLeafTargetFraction = 0.5;

/// A pair of pieces above this fraction of the band is not yet an impact: it is advanced further
/// towards kLeafTargetFraction, which it may never reach, like an edge beside a face that slides
/// along a body. Closer to kLeafTargetFraction: more steps at contact; larger: more impacts that a
/// distance query must tell from sliding. Bounds of boxes aim at kBoxTargetFraction, above it, so
/// that pieces in contact are always examined. Used by time_of_impact.
inline constexpr Scalar kContactFraction = 0.625;
inline constexpr Scalar kBoxTargetFraction = 0.75;

/// GJK on polytopes has converged when the bounds on the distance of the cores, before rounding
/// outward, differ by less than this multiple of the size of the query (|translation| + both
/// bounding radii). The gap and the length of v are computed from the same points, so they differ
/// by the rounding of a few dot products. Larger: wider bounds; smaller: more queries repeated in
/// extended precision. Used by gjk_distance.
inline constexpr Scalar kGjkStopNoise = 8 * kUnitRoundoff;

/// GJK on smooth cores has converged when the bounds differ by this fraction of the distance. The
/// iteration never ends by repeating a vertex, and converges linearly. Used by gjk_distance.
inline constexpr Scalar kGjkSmoothConvergence = 1e-10;

/// Limit on the iterations of GJK in each of its two precisions. Polytopes take about 5, hulls of
/// thousands of vertices fewer than 30. Larger: slower worst case; smaller: wider bounds for smooth
/// cores.
inline constexpr int kGjkIterationLimit = 100;

/// Limit, per precision, on steps of GJK that bring the nearest point no closer but may turn the
/// normal. More than the three features a triangle can pass through. Larger: only time; smaller:
/// wider bounds where a vertex lies straight above the border of a face. Used by gjk_distance.
inline constexpr int kGjkTieLimit = 8;

/// Tolerance passed to libccd, relative to the size of the two shapes (the query is scaled to one).
/// Polytopes end exactly at a face; smooth cores stop this close to the surface of the difference.
/// Larger: poorer directions; smaller: libccd gets lost in rounding. Used by find_penetration.
inline constexpr Scalar kPenetrationTolerance = 1e-10;

/// Limit on the support points per shape that libccd may request; its own loops have none. Box
/// against box takes about 20. Larger: slower worst case (libccd's search is quadratic in it);
/// smaller: poorer directions for smooth cores. Used by find_penetration.
inline constexpr int kPenetrationSupportLimit = 300;

/// Limit on the steps of GJK that improve libccd's direction; the loop ends unless the depth
/// shrinks. Polytopes need one. Larger: slower for smooth cores; smaller: depths slightly too
/// large. Used by find_penetration.
inline constexpr int kPenetrationPolishLimit = 4;

/// Largest coordinate of a vertex, length. Products of four lengths must not overflow: 1e60^4 =
/// 1e240 leaves a margin. Used by TriangleMesh and the convex shapes.
inline constexpr Scalar kLargestCoordinate = 1e60;

/// How much the half extents of a hierarchy's box are rounded up, relative to |center| + |half
/// extents|: 56u |half extents| + 8u |center| is the sum of the errors from projecting the
/// vertices, from axes that are orthonormal only to 8u per entry, from placing the center, and from
/// a caller who evaluates center + axes * x in double. Used by MeshHierarchy. Smaller: boxes may
/// lose vertices.
inline constexpr Scalar kBoxNoise = 64 * kUnitRoundoff;

/// How much the half extents of a box are rounded up when it is stored in single precision,
/// relative to |center| + |half extents|. Axes off by 2^-25 per entry change coordinates along them
/// by 3/4 of 2^-23 |half extents|, rounding the center by 2^-24 |center| ([BoxGroup::set_box]); the
/// rest covers second-order terms. Smaller: boxes may lose vertices.
inline constexpr Scalar kSinglePrecisionBoxNoise = 0x1p-23;

/// How much the distance of a point to a box of a hierarchy is rounded down, relative to the
/// distance and to the sum of the half extents: axes in single precision are orthonormal to 2^-23
/// per entry, which changes coordinates along them by 3 x 2^-23 of the half extents and lengths by
/// 2^-22 (proof in distance/point_search.cpp). Used by point_distance and generate_contacts().
/// Smaller: the box that holds the nearest triangle may be skipped.
inline constexpr Scalar kPointBoxNoise = 0x1p-20;

/// Limit on the steps of Newton's method towards one piece along a ray. Head-on rays take 2, rays
/// that graze a curved surface halve what is left in each: about 50. Larger: only time; smaller:
/// hits without a proven gap. Used by ray_cast.
inline constexpr int kRayStepLimit = 128;

/// The largest gap of a RayHit that counts as a touch, relative to twice the size of the query
/// (translation, start, bounding radius, ball). GJK on smooth cores leaves kGjkSmoothConvergence of
/// a distance between its bounds. Larger: coarser hits; smaller: more NumericalLimit. Used by
/// ray_cast.
inline constexpr Scalar kRayGap = 0x1p-30;

/// Error of the determinant e1 x e2 . d of three differences of points in double, relative to the
/// product of their 1-norms: 2u per difference, 6u for the cross product, 4u for the dot product,
/// doubled. Used by the convex hull's filter and as the noise of a mesh's volume. Smaller: wrong
/// signs.
inline constexpr Scalar kDeterminantNoise = 32 * kUnitRoundoff;

/// Limit on the triangles of a mesh, so that eight times the node numbers of its hierarchy stay
/// below 2^31 with a bit to spare.
inline constexpr std::size_t kLargestTriangleCount = std::size_t{1} << 27;

/// Rounding of triangle_distance(), as multiples of u; proof in distance/triangle/triangle_pair.h.
/// The first times the computed length plus the second times the size of the pair
/// covers the rounding of a slab gap (6.6 and 6.1 u, with the final operation 7.6) and of a
/// witness's length (6.5 and 5.5 u, with the final operation 7.5). Smaller: nothing is proven;
/// larger: wider bounds.
inline constexpr Scalar kTriangleRelativeSlack = 8 * kUnitRoundoff;
inline constexpr Scalar kTriangleSizeSlack = 7 * kUnitRoundoff;

/// A triangle pair is certified when its bounds differ by at most this times the size of the pair.
/// The slacks above take 30u; the rest is for the rounding of the witness itself. Larger: wider
/// bounds are accepted; smaller: more pairs take the slow path. Used by triangle_noise().
inline constexpr Scalar kTriangleNoise = 64 * kUnitRoundoff;

/// Sizes of a triangle pair (length) between which it is solved as is; others are first scaled by a
/// power of two. Sixth powers of lengths occur: 2^(6*64) and 1e-60 of it stay within range.
inline constexpr Scalar kSmallestTriangleSize = 0x1p-64;
inline constexpr Scalar kLargestTriangleSize = 0x1p64;

/// Squared norm below which a direction certifies nothing, so that underflow (2^-1075 per product)
/// stays far below the slack u |m| size. Used by triangle_distance().
inline constexpr Scalar kSmallestSquaredDirection = 0x1p-900;

/// Squared sine below which two edges count as parallel when facets are ranked. Speed only: the
/// Gram determinant has no correct digit below 1e-15. Used by triangle_distance().
inline constexpr Scalar kTriangleParallelSquare = 1e-12;

/// Rounding of a slab gap of two triangles, relative to the 1-norm of the direction times the
/// largest coordinate of a vertex from the origin used, once per triangle: 4u for the two products,
/// u for their difference. Smaller: a near triangle may be skipped. Used by nearest_triangle().
inline constexpr Scalar kTriangleSlabNoise = 8 * kUnitRoundoff;

/// Squared sine of the angle at vertex 0 up to which a triangle counts as a segment when its first
/// candidate is chosen. Speed only: three collinear vertices are off their line by rounding, 2u of
/// its length. Used by triangle_distance().
inline constexpr Scalar kTriangleFlatSquare = 0x1p-96;

/// Limit on the steps of a walk to the supporting edges along a point, before everything is tried.
/// Speed only, found by measurement. Used by triangle_distance().
inline constexpr int kTriangleWalkLimit = 3;

/// Smallest squared norm by which the squared gap of a facet is divided when facets are ranked.
/// Below any that matters, and above 2^-640, so that the quotient is finite: squares are up to
/// 2^(6*64). Speed only; the determinant of nearly parallel edges may be negative. Used by
/// triangle_distance().
inline constexpr Scalar kSmallestFacetSquare = 0x1p-600;

/// Minus this is the squared gap of an edge pair that is not a facet, so that it never wins:
/// divided by the largest squared norm, 2^(4*64), it still exceeds any squared length in range, and
/// divided by the smallest it is finite. Used by triangle_distance().
inline constexpr Scalar kLargestFacetSquare = 0x1p400;

/// Limit on the convex combinations of witnesses in the proof of the upper bound. Two put a common
/// point between edges of thin triangles. Used by triangle_distance().
inline constexpr int kTriangleBlendLimit = 3;

/// How often the point where an edge pierces a face is solved for. The second solve removes the
/// error of the normal of a face as thin as 1e-7 of its length; blends handle thinner ones. Used by
/// triangle_distance().
inline constexpr int kTrianglePiercingSteps = 2;

/// A triangle pair is tried as a far one if the squared distance of the centroids exceeds this
/// times the sum of the squared edges. Speed only, found by measurement. Used by
/// triangle_distance().
inline constexpr Scalar kTriangleFarRatio = 1;

/// Fraction of the size of a triangle pair below which a gap may be contact: touching and crossing
/// are tested first. Speed only; the cube root of u squared. Used by triangle_distance().
inline constexpr Scalar kTriangleContactGap = 0x1p-36;

/// Sine of the angle below which the normal of two crossing edges is taken from a face beside them:
/// their cross product turns by the tilt of the faces divided by this. Used by generate_contacts().
inline constexpr Scalar kContactParallelSine = 0.1;

/// Sine of the angle below which two edges count as parallel: the ends of their common stretch are
/// contacts, not a crossing. The error of the crossing point is rounding divided by this. Used by
/// generate_contacts().
inline constexpr Scalar kContactNoCrossingSine = 1e-6;

/// Sine of the angle by which the faces at an edge must be bent for the edge to be a contact.
/// Vertices in single precision bend a flat area by about this. Larger: contacts of finely rounded
/// bodies are lost; smaller: only time. Used by ContactFeatures and generate_contacts().
inline constexpr Scalar kFlatEdgeSine = 0x1p-20;

/// How much more distance counts for a contact that carried load. Smaller: supports change from
/// step to step; larger: poorer spread. Used by reduce_contacts().
inline constexpr Scalar kContactLoadPreference = 1.5;

/// How much a motion's bounds are rounded up, relative to the largest coefficient they are computed
/// from. Restricting a cubic, its derivatives and a product of the two to a part of the interval
/// errs by at most 95u of it (motion/curve/chart_curve.h); a rotation matrix that is orthonormal
/// only to rounding stretches by 8u. Used by every Motion. Smaller: rounding may undercut a bound.
inline constexpr Scalar kMotionNoise = 128 * kUnitRoundoff;

/// Coordinates below this, relative to the largest one, count as zero in a convex hull. The last
/// bit of a product of three is then above 2^-760, so that neither the exact predicates nor their
/// error bound can underflow. Used by ConvexHull. Smaller: wrong signs; larger: points move more.
inline constexpr Scalar kSmallestHullCoordinate = 0x1p-200;

/// Shortest step given to a SUNDIALS solver, relative to |t| at both ends and to the last step.
/// SUNDIALS refuses a first step below 4u and regards a stop time within 200u (|t| + |step|) as
/// reached; this is five times as far. Shorter steps are a single explicit midpoint step, with
/// linear dense output that errs by h^2 |y''| / 8: below rounding unless rates exceed 1e4 / |t|.
/// Larger: that error; smaller: SUNDIALS may refuse. Used by SundialsIntegrator.
inline constexpr Scalar kShortestSolverStep = 2048 * kUnitRoundoff;

/// The same as a time, for t near zero: squares and reciprocals of a step must neither underflow
/// nor overflow, and no motion is that fast. Used by SundialsIntegrator.
inline constexpr Scalar kShortestSolverTime = 1e-100;

/// Limits on the steps of a walk over the features of two triangles, and of a hull or polygon per
/// vertex. Each step comes nearer, so a walk ends by itself; only rounding could hold it up. Random
/// triangles take up to 9. Smaller: more pairs take the slow path. Used by lin_canny_distance().
inline constexpr int kTriangleFeatureLimit = 16;
inline constexpr int kFeatureLimit = 4;

/// Limit on a walk's jumps away from behind a face; nothing else can lead a walk in a circle.
/// Smaller: more pairs take the slow path. Used by lin_canny_distance().
inline constexpr int kFeatureJumpLimit = 4;

/// Rounding of a slab gap and of a witness's length at the end of a walk, relative to a length that
/// no two points of the pair exceed. A difference and a scalar product of three components err by
/// 4u ([JeannerodRump2013]) on each side; subtraction, norm and division by 5u of the gap; the
/// witness, r + t f - s e, by 8u, its norm by 3u. Smaller: nothing is proven. Used by
/// lin_canny_distance().
inline constexpr Scalar kFeatureSlack = 16 * kUnitRoundoff;

/// Limit on the iterations of the textbook GJK. Two triangles have 9 differences of vertices and
/// rarely need more than 6. Used by textbook_gjk(), and by libccd_distance(), which has the same
/// loop.
inline constexpr int kTextbookGjkLimit = 32;

/// The textbook GJK has converged when the next support point is nearer along v than v itself by at
/// most this fraction of |v|^2 ([vandenBergen2003] suggests 1e-6 for single precision). Larger:
/// distances too large by that fraction; smaller: steps wasted on rounding. Used by textbook_gjk(),
/// and by libccd_distance().
inline constexpr Scalar kTextbookGjkConvergence = 1e-12;

/// Rounding of everything computed from the differences of the points of two linearly moving
/// elements, relative to the largest difference: a slab gap, its interpolation in time, the end of
/// a safe step, the length of a witness: 24u for steps and 36u for witnesses, added up in
/// toi/vertex_time_of_impact.cpp. Larger: coarser tolerances are needed; smaller: bounds
/// may fail. Used by time_of_impact of vertex paths.
inline constexpr Scalar kPathNoise = 64 * kUnitRoundoff;

/// Default lengths of World, relative to the smaller bounding radius of a pair: the target
/// distance, and how many targets above it bodies rest (as lengths where the target is zero).
/// Larger rest offsets need fewer solves and queries; smaller ones are less visible. Used by World.
inline constexpr Scalar kTargetRadiusFraction = 1e-4;
inline constexpr Scalar kRestOffsetTargets = 4;

/// Distance tolerance of a World's queries relative to the rest offset. Larger: the proven distance
/// is too close to where bodies rest; smaller: longer queries near contact. Used by World.
inline constexpr Scalar kCertifiedFraction = 0.3;

/// How far bodies may move, relative to their rest offset, while contacts are reused instead of
/// regenerated. Larger: wrong gaps of curved contacts; smaller: more generation. Used by World.
inline constexpr Scalar kContactDriftFraction = 0.2;

/// Up to which gap contacts are sought: this many rest offsets above the rest gap, plus how far the
/// bodies may approach in a step, but at most this fraction of the bounding radius. Larger: more
/// contacts; smaller: more hits that become contacts only after a query. Used by World.
inline constexpr Scalar kContactReachRestOffsets = 4;
inline constexpr Scalar kContactReachRadiusFraction = 0.02;

/// Contacts of a curved surface stand for others up to this fraction of the bounding radius away
/// with a normal within this cosine. Larger: small parts lose their support; smaller: fast rolling
/// loses energy. Used by reduce_contacts().
inline constexpr Scalar kContactMergedRadiusFraction = 0.15;
inline constexpr Scalar kContactMergedCosine = 0.9;

/// In World such a contact is at most so many rest offsets above the rest gap, and the body turns
/// by so many rest offsets over its radius. The gap at the end of a step is measured within so many
/// ways of the step. Used by World.
inline constexpr Scalar kContactMergedRestOffsets = 0.7;
inline constexpr Scalar kContactMergedChange = 0.01;
inline constexpr Scalar kContactMeasuredWays = 3;

/// Fraction of the missing rest gap that a step recovers. Larger: jitter. Used by World.
inline constexpr Scalar kGapRecovery = 0.3;

/// A contact solve is repeated if the predicted gap of a contact has changed by more than this,
/// relative to the rest offset. Larger: curved contact loses energy. Used by World.
inline constexpr Scalar kErrorChange = 0.02;

/// A solve with a residual above this multiple of its tolerance has contradictory constraints: gaps
/// are then not recovered in that step. Used by World.
inline constexpr Scalar kContradictionTolerances = 300;

/// Default of WorldOptions::separation_speed: this fraction of the smaller bounding radius per
/// step.
inline constexpr Scalar kSeparationRadiusFraction = 0.05;

/// Default of WorldOptions::sleep_speed: this fraction of the rest offset per step. Used by World.
inline constexpr Scalar kSleepRestOffsetFraction = 0.01;

/// Change of a wrench, relative to its size, that wakes a body. Used by World.
inline constexpr Scalar kWakeWrenchChange = 1e-9;

/// Residual to which an impact is solved, relative to the largest speed, and the energy that it may
/// therefore seem to create, relative to what its impulses exchange. Used by World.
inline constexpr Scalar kImpactSpeedNoise = 1e-11;
inline constexpr Scalar kImpactEnergyNoise = 1e-9;
/// Mobility (velocity per impulse) that counts as none, relative to the largest in the problem:
/// rounding of a 3x3 matrix product. Larger: light directions are locked; smaller: division by
/// noise. Used by the contact solvers.
inline constexpr Scalar kContactMobilityNoise = 64 * kUnitRoundoff;

/// A single sliding contact is solved until its tangential impulse is on the cone to within this
/// fraction, in at most so many steps of a bracketed Newton iteration (2 to 5 are usual). Larger:
/// sweeps stall at that fraction; smaller: steps wasted on rounding. Used by solve_contact().
inline constexpr Scalar kContactSlideNoise = 16 * kUnitRoundoff;
inline constexpr int kContactSlideLimit = 100;

/// Largest number of movable bodies that count as few: Newton solves them exactly in no time, also at
/// rest, without interior points. Found by measurement. Used by ContactCascade and World.
inline constexpr std::size_t kContactFewBodies = 2;

/// Contacts and rows from which a problem is worth several threads, which take some ten microseconds
/// to wake. Used by ContactSolver.
inline constexpr std::size_t kContactTeamBlocks = 400;

/// A warm start is good if its residual is below this part of that without impulses: then Newton's
/// method, which is fast near a solution, comes before Gauss-Seidel. Found by measurement. Used by
/// ContactCascade.
inline constexpr Scalar kContactGoodStart = 0.1;

/// Residual to which contacts are solved, by the largest way x of a body in a step; both in rest
/// offsets per step: the first times max(x, x^2), but at least the second and at most the third.
/// What is left of it every step may add up, at rest in 6,000 steps to 0.06 % of the rest offset.
/// Larger: stacks creep and never sleep, sliding bodies turn; smaller: rounding, and time. Used by
/// contact_tolerance().
inline constexpr Scalar kContactSpeedTolerance = 1e-6;
inline constexpr Scalar kContactRestTolerance = 1e-7;
inline constexpr Scalar kContactLooseTolerance = 0.1;

/// Penalty of Newton's augmented Lagrangian times a contact's mobility: where it begins, and the
/// largest. Larger: fewer outer iterations, but the inner ones have more corners and diverge from a
/// cold start; found by measurement. Used by NewtonSolver.
inline constexpr Scalar kContactPenalty = 300;
inline constexpr Scalar kContactLargestPenalty = 3e4;

/// Limit on the factorisations in one outer iteration of Newton: more mean that the penalty is too
/// large; the number up to which the penalty may grow. Limit on trials along a step. Used by
/// NewtonSolver.
inline constexpr int kContactInnerLimit = 20;
inline constexpr int kContactInnerFew = 4;
inline constexpr int kContactLineLimit = 20;

/// Initial penalty times mobility of the alternating direction method, which then adapts it. Used
/// by AdmmSolver.
inline constexpr Scalar kContactFirstPenalty = 1;

/// Limit on the rounds of constant coefficients by which a friction law is solved. Used by
/// ContactSolver.
inline constexpr int kContactFrictionRounds = 30;

}  // namespace dyop

namespace dyop::core_internal {

// Numbers in single precision on a chosen side of one in double precision; NaN stays NaN.
//
// GCC 12's SLP vectorizer can drop a conversion to float when several stand side by side, as in
// `return {float(x), float(y), float(z)}`, and go on with the doubles. The comparison below keeps
// the conversion alive; tests/core/float_bounds_test.cpp watches that it stays so.

/// The smallest float that is not below x.
inline float float_above(Scalar x) {
  const auto near = static_cast<float>(x);
  return Scalar(near) < x ? std::nextafter(near, std::numeric_limits<float>::infinity()) : near;
}

/// The largest float that is not above x.
inline float float_below(Scalar x) {
  return -float_above(-x);
}

}  // namespace dyop::core_internal
