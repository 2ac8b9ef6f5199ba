// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>

#include "dyop/core/types.h"

/// Every numerical constant of dyop. Three words, never mixed:
/// *noise* is rounding and is computed, *tolerance* is what the user asked for, *limit* is a count.
namespace DYOP_EXPORT dyop {

/// Unit roundoff u of double, 2^-53. All noise constants are multiples of it.
inline constexpr Scalar kUnitRoundoff = std::numeric_limits<Scalar>::epsilon() / 2;

/// How far a quaternion's norm or R^T R may be from one before a pose is refused (relative).
/// Below it the rotation is normalised. Larger: bad input passes; smaller: poses read from text
/// with seven digits are refused. Used by RigidPose.
inline constexpr Scalar kRotationTolerance = 1e-6;

/// How far a motion's pose may be from a rotation in a query: with columns x, y, z the sum of
/// | |x|^2 - 1 |, | |y|^2 - 1 |, |x . y| and the entries of x cross y - z. Lengths then stretch by at
/// most twice as much; kStepNoise has 200u to spare. Larger: bounds may fail; smaller: products of many
/// rotations are refused. Used by guarded_state().
inline constexpr Scalar kEngineRotationNoise = 96 * kUnitRoundoff;

/// Rounding allowance for one coordinate of a point carried through a pose, as a multiple of the
/// size of the numbers involved (|translation| + |point|). A matrix-vector product and a sum err
/// by at most gamma_4 per coordinate, sqrt(3) gamma_4 < 8u in norm ([Higham2002] ch. 3); composing
/// two poses first triples it, and a rotation matrix that is orthonormal to rounding only adds as
/// much again. Used by everything that compares points of two bodies. Smaller: bounds may fail.
inline constexpr Scalar kPoseNoise = 64 * kUnitRoundoff;

/// Rounding allowance of a gap between two moving pieces, relative to the size of the query: 312u
/// for poses and for support values along directions that turn (docs/algorithms/time_of_impact.md,
/// "Rounding"). Smaller: bounds may fail. Used by time_of_impact and for boxes by distance.
inline constexpr Scalar kStepNoise = 512 * kUnitRoundoff;

/// Default tolerance of an impact, relative to the smaller bounding radius. Larger: looser
/// impacts; smaller: closer to rounding far from the origin. Used by
/// default_distance_tolerance().
inline constexpr Scalar kDefaultRelativeTolerance = 1e-6;

/// Time of impact divides the band of width distance_tolerance above the target, at these fractions
/// of it. Steps towards contact stop at kFloorFraction: nearer to one, slower convergence at
/// contact; nearer to zero, less room below. A query that begins below kLostFraction guarantees
/// nothing; the room between the two is for the rounding of poses when a body is restarted from a
/// contact.
inline constexpr Scalar kLostFraction = 0.25;
inline constexpr Scalar kFloorFraction = 0.5;

/// A pair of pieces that is above this fraction of the band is not yet an impact: it is moved on
/// towards kFloorFraction, which it may never reach, as an edge beside the face that slides along a
/// body. Nearer to kFloorFraction: more steps at contact; larger: more impacts to be told from
/// sliding by a distance query. Bounds of boxes aim at kLookFraction, above it, so that what is in
/// contact is always looked at. Used by time_of_impact.
inline constexpr Scalar kContactFraction = 0.625;
inline constexpr Scalar kLookFraction = 0.75;

/// GJK on polytopes has converged when the bounds on the distance of the cores, before rounding
/// outward, differ by less than this multiple of the size of the query (|translation| + both
/// bounding radii). Gap and length of v share the points they come from, so they differ by the
/// rounding of a few dot products. Larger: wider bounds; smaller: more queries that are
/// repeated in wide arithmetic. Used by gjk_distance.
inline constexpr Scalar kGjkStopNoise = 8 * kUnitRoundoff;

/// GJK on smooth cores has converged when the bounds differ by this fraction of the distance.
/// Their iteration never ends by repeating a vertex and converges linearly. Used by gjk_distance.
inline constexpr Scalar kGjkSmoothConvergence = 1e-10;

/// Iterations of GJK, limit, in each of its two arithmetics. Polytopes take about 5, hulls of
/// thousands of vertices below 30. Larger: slower worst case; smaller: wider bounds for smooth
/// cores.
inline constexpr int kGjkIterationLimit = 100;

/// Steps of GJK that bring the nearest point no closer but may turn the normal, limit per
/// arithmetic. More than the three features a triangle can pass through. Larger: only time;
/// smaller: wider bounds where a vertex lies straight above the border of a face. Used by
/// gjk_distance.
inline constexpr int kGjkTieLimit = 8;

/// Tolerance handed to libccd, relative to the size of the two shapes (the query is scaled to one).
/// Polytopes end exactly at a face; smooth cores stop this near to the surface of the difference.
/// Larger: poorer directions; smaller: libccd gets lost in rounding. Used by find_penetration.
inline constexpr Scalar kPenetrationTolerance = 1e-10;

/// Support points per shape that libccd may ask for, limit; its own loops have none. Box against
/// box takes about 20. Larger: slower worst case (libccd's search is quadratic in it); smaller:
/// poorer directions for smooth cores. Used by find_penetration.
inline constexpr int kPenetrationSupportLimit = 300;

/// Steps of GJK that improve libccd's direction, limit; each ends the loop unless the depth
/// shrinks. Polytopes need one. Larger: slower for smooth cores; smaller: depths that are a little
/// too large. Used by find_penetration.
inline constexpr int kPenetrationPolishLimit = 4;

/// Largest coordinate of a vertex, length. Products of four lengths must not overflow: 1e60^4 =
/// 1e240 leaves room. Used by TriangleMesh and the convex shapes.
inline constexpr Scalar kLargestCoordinate = 1e60;

/// How much the half extents of a hierarchy's box are rounded up, relative to |center| + |half
/// extents|: 56u |half extents| + 8u |center| is the sum of the errors of projecting the vertices,
/// of axes that are orthonormal only to 8u an entry, of placing the center, and of a caller who
/// evaluates center + axes * x in double. Used by MeshHierarchy. Smaller: boxes may lose vertices.
inline constexpr Scalar kBoxNoise = 64 * kUnitRoundoff;

/// How much the half extents of a box are rounded up when it is stored in single precision,
/// relative to |center| + |half extents|. Axes off by 2^-25 an entry change coordinates along them
/// by 3/4 of 2^-23 |half extents|, rounding the center by 2^-24 |center| ([BoxGroup::set_box]); the
/// rest covers second-order terms. Smaller: boxes may lose vertices.
inline constexpr Scalar kSinglePrecisionBoxNoise = 0x1p-23;

/// How much the distance of a point to a box of a hierarchy is rounded down, relative to the distance
/// and to the sum of the half extents: axes in single precision are orthonormal to 2^-23 an entry,
/// which changes coordinates along them by 3 x 2^-23 of the half extents and lengths by 2^-22
/// (docs/algorithms/distance.md, "Points"). Used by point_distance. Smaller: a box may be left out
/// that holds the nearest triangle.
inline constexpr Scalar kPointBoxNoise = 0x1p-20;

/// Error of the determinant e1 x e2 . d of three differences of points in double, relative to the
/// product of their 1-norms: 2u a difference, 6u the cross product, 4u the dot product, doubled.
/// Used by the convex hull's filter and as the noise of a mesh's volume. Smaller: wrong signs.
inline constexpr Scalar kDeterminantNoise = 32 * kUnitRoundoff;

/// Most triangles of a mesh, so that eight times the node numbers of its hierarchy stay below 2^31
/// with a bit to spare (limit).
inline constexpr std::size_t kLargestTriangleCount = std::size_t{1} << 27;

/// Rounding of triangle_distance(), as multiples of u; docs/algorithms/dyop.md, "Rounding", has the
/// proof. The first times the computed length plus the second times the size of the pair covers the
/// rounding of a slab gap (6.6 and 6.1 u, with the final operation 7.6) and of a witness's length
/// (6.5 and 5.5 u, with the final operation 7.5). Smaller: nothing is proven; larger: wider bounds.
inline constexpr Scalar kTriangleRelativeSlack = 8 * kUnitRoundoff;
inline constexpr Scalar kTriangleSizeSlack = 7 * kUnitRoundoff;

/// A triangle pair is certified when its bounds differ by at most this times the size of the pair.
/// The slacks above take 30u; the rest is room for the rounding of the witness itself. Larger:
/// wider bounds are accepted; smaller: more pairs take the slow path. Used by triangle_noise().
inline constexpr Scalar kTriangleNoise = 64 * kUnitRoundoff;

/// Sizes of a triangle pair (length) between which it is solved as it is; others are first scaled
/// by a power of two. Sixth powers of lengths occur: 2^(6*64) and 1e-60 of it stay within range.
inline constexpr Scalar kSmallestTriangleSize = 0x1p-64;
inline constexpr Scalar kLargestTriangleSize = 0x1p64;

/// Squared norm below which a direction certifies nothing, so that underflow (2^-1075 a product)
/// stays far below the slack u |m| size. Used by triangle_distance().
inline constexpr Scalar kSmallestSquaredDirection = 0x1p-900;

/// Squared sine below which two edges count as parallel when facets are ranked. Speed only: the
/// Gram determinant has no correct digit below 1e-15. Used by triangle_distance().
inline constexpr Scalar kTriangleParallelSquare = 1e-12;

/// Rounding of a slab gap of two triangles over the 1-norm of the direction times the largest
/// coordinate of a vertex from the origin used, once for each triangle: 4u the two products, u
/// their difference. Smaller: a near triangle may be left out. Used by nearest_triangle().
inline constexpr Scalar kTriangleSlabNoise = 8 * kUnitRoundoff;

/// Squared sine of the angle at vertex 0 up to which a triangle counts as a segment when its first
/// candidate is chosen. Speed only: three collinear vertices are off their line by rounding, 2u of
/// its length. Used by triangle_distance().
inline constexpr Scalar kTriangleFlatSquare = 0x1p-96;

/// Steps of a walk to the edges that support along a point, before everything is tried (limit).
/// Speed only, found by measurement. Used by triangle_distance().
inline constexpr int kTriangleWalkLimit = 3;

/// Least squared norm by which the squared gap of a facet is divided when facets are ranked. Below
/// any that matters, and above 2^-640, so that the quotient is finite: squares are up to
/// 2^(6*64). Speed only; the determinant of nearly parallel edges may be negative. Used by
/// triangle_distance().
inline constexpr Scalar kSmallestFacetSquare = 0x1p-600;

/// Minus this is the squared gap of an edge pair that is no facet, so that it never wins: over the
/// largest squared norm, 2^(4*64), still more than any squared length in range, and finite over
/// the least. Used by triangle_distance().
inline constexpr Scalar kLargestFacetSquare = 0x1p400;

/// Convex combinations of witnesses that the proof of the upper bound has room for (limit). Two put
/// a common point between edges of thin triangles. Used by triangle_distance().
inline constexpr int kTriangleBlendLimit = 3;

/// Times that the point where an edge pierces a face is solved for. The second removes the error of
/// the normal of a face as thin as 1e-7 of its length; blends serve thinner ones. Used by
/// triangle_distance().
inline constexpr int kTrianglePiercingSteps = 2;

/// A triangle pair is tried as a far one if the squared distance of the centroids exceeds this
/// times the sum of the squared edges. Speed only, found by measurement. Used by
/// triangle_distance().
inline constexpr Scalar kTriangleFarRatio = 1;

/// Fraction of the size of a triangle pair below which a gap may be contact: touching and crossing
/// are looked for first. Speed only; the cube root of u squared. Used by triangle_distance().
inline constexpr Scalar kTriangleContactGap = 0x1p-36;

/// Sine of the angle below which the normal of two crossing edges is taken from a face beside them:
/// their cross product turns by the tilt of the faces over this. Used by generate_contacts().
inline constexpr Scalar kContactParallelSine = 0.1;

/// Sine of the angle below which two edges count as parallel: the ends of their common stretch are
/// contacts, not a crossing. Their crossing point is rounding over this. Used by
/// generate_contacts().
inline constexpr Scalar kContactNoCrossingSine = 1e-6;

/// Sine of the angle by which the faces at an edge must be bent for the edge to be a contact.
/// Vertices in single precision bend a flat area by about this. Larger: contacts of finely rounded bodies
/// are lost; smaller: only time. Used by ContactFeatures and generate_contacts().
inline constexpr Scalar kFlatEdgeSine = 0x1p-20;

/// How much farther a contact counts if it carried load. Smaller: supports change from step to
/// step; larger: poorer spread. Used by reduce_contacts().
inline constexpr Scalar kContactLoadPreference = 1.5;

/// How much a motion's bounds are rounded up, relative to the largest coefficient they are computed
/// from. Restricting a cubic, its derivatives and a product of the two to a part of the interval
/// errs by at most 95u of it (docs/algorithms/motions.md); a rotation matrix that is orthonormal to
/// rounding stretches by 8u. Used by every Motion. Smaller: a bound may be undercut by rounding.
inline constexpr Scalar kMotionNoise = 128 * kUnitRoundoff;

/// Coordinates below this count as zero when a convex hull is found, relative to the largest one.
/// The last bit of a product of three is then above 2^-760, so that neither the exact predicates
/// nor their error bound can underflow. Used by ConvexHull. Smaller: wrong signs; larger: points
/// are moved by more.
inline constexpr Scalar kSmallestHullCoordinate = 0x1p-200;

/// Shortest step that is handed to a SUNDIALS solver, relative to |t| at both ends and to the last
/// step. It refuses a first step below 4u and takes a stop time within 200u (|t| + |step|) for
/// reached; this is five times as far. Shorter ones are a single explicit midpoint step, with
/// linear dense output that errs by h^2 |y''| / 8: below rounding unless rates exceed 1e4 / |t|.
/// Larger: that error; smaller: SUNDIALS may refuse. Used by SundialsIntegrator.
inline constexpr Scalar kShortestSolverStep = 2048 * kUnitRoundoff;

/// The same as a time, for t near zero: squares and reciprocals of a step must neither underflow
/// nor overflow, and no motion is that fast. Used by SundialsIntegrator.
inline constexpr Scalar kShortestSolverTime = 1e-100;

/// Steps of a walk over the features of two triangles, and of a hull or polygon for each of its
/// vertices (limits). A walk comes nearer with each step, so it ends by itself; rounding is what
/// could hold it up. Random triangles take up to 9. Smaller: more pairs take the slow path. Used by
/// lin_canny_distance().
inline constexpr int kTriangleFeatureLimit = 16;
inline constexpr int kFeatureLimit = 4;

/// Times that a walk may jump away from behind a face, limit; nothing else can lead a walk in a
/// circle. Smaller: more pairs take the slow path. Used by lin_canny_distance().
inline constexpr int kFeatureJumpLimit = 4;

/// Rounding of a slab gap and of a witness's length at the end of a walk, relative to a length that
/// no two points of the pair exceed. A difference and a scalar product of three components err by
/// 4u
/// ([JeannerodRump2013]) on each side; subtraction, norm and division by 5u of the gap; the
/// witness, r + t f - s e, by 8u, its norm by 3u. Smaller: nothing is proven. Used by
/// lin_canny_distance().
inline constexpr Scalar kFeatureSlack = 16 * kUnitRoundoff;

/// Iterations of the textbook GJK, limit. Two triangles have 9 differences of vertices and rarely
/// need more than 6. Used by textbook_gjk(), and by libccd_distance(), which has the same loop.
inline constexpr int kTextbookGjkLimit = 32;

/// The textbook GJK has converged when the next support point is nearer along v than v itself by no
/// more than this fraction of |v|^2 ([vandenBergen2003] suggests 1e-6 for single precision).
/// Larger: distances too large by that fraction; smaller: steps that rounding wastes. Used by
/// textbook_gjk(), and by libccd_distance().
inline constexpr Scalar kTextbookGjkConvergence = 1e-12;

/// Rounding of everything that is computed from the differences of the points of two linearly
/// moving elements, relative to the largest difference: a slab gap, its interpolation in time, the
/// end of a safe step, the length of a witness. docs/algorithms/linear_vertex_motion.md,
/// "Rounding", adds up 24u for steps and 36u for witnesses. Larger: the tolerance that can be met
/// grows; smaller: bounds may fail. Used by time_of_impact of vertex paths.
inline constexpr Scalar kPathNoise = 64 * kUnitRoundoff;

/// Lengths of World by default, relative to the smaller bounding radius of a pair: the target
/// distance, and how many targets bodies rest above it (as lengths where the target is zero). Larger
/// standoffs need fewer solves and queries; smaller ones are seen less. Used by World.
inline constexpr Scalar kTargetRadiusFraction = 1e-4;
inline constexpr Scalar kStandoffTargets = 4;

/// Distance tolerance of the queries of a World relative to the standoff. Larger: what is proven is
/// too close to where bodies rest; smaller: longer queries near contact. Used by World.
inline constexpr Scalar kCertifiedFraction = 0.3;

/// How far bodies may move relative to their standoff while contacts are carried with them instead of
/// generated anew. Larger: wrong gaps of curved contacts; smaller: more generation. Used by World.
inline constexpr Scalar kContactDriftFraction = 0.2;

/// Up to which gap contacts are looked for: so many standoffs above the rest gap, and what moves in a
/// step but at most this fraction of the bounding radius. Larger: more contacts; smaller: more hits
/// that become contacts only after a query. Used by World.
inline constexpr Scalar kContactReachStandoffs = 4;
inline constexpr Scalar kContactReachRadiusFraction = 0.02;

/// Part of what is missing to the rest gap that a step recovers. Larger: jitter. Used by World.
inline constexpr Scalar kGapRecovery = 0.3;

/// A contact solve is repeated if the predicted gap of a contact has changed by more than this,
/// relative to the standoff. Larger: curved contact loses energy. Used by World.
inline constexpr Scalar kErrorChange = 0.02;

/// The same for the length and direction of a spring, whose energy shows it: smaller. Used by World.
inline constexpr Scalar kSpringErrorChange = 4e-4;

/// Weight of a spring's row across the spring where it has no stiffness, relative to that along it:
/// small, but the row stays solvable. Used by World.
inline constexpr Scalar kSpringLeastShare = 1e-9;

/// A solve with a residual above this multiple of its tolerance has constraints that contradict one
/// another: gaps are then not recovered in that step. Used by World.
inline constexpr Scalar kContradictionTolerances = 300;

/// Default of WorldOptions::separation_speed: this part of the smaller bounding radius per step.
inline constexpr Scalar kSeparationRadiusFraction = 0.05;

/// Approach slower than this part of the standoff per step never bounces: the solver's own error is a
/// tenth of it. Used by World.
inline constexpr Scalar kRestitutionStandoffFraction = 0.01;

/// Default of WorldOptions::sleep_speed: this part of the standoff per step. Used by World.
inline constexpr Scalar kSleepStandoffFraction = 0.01;

/// Change of a wrench, relative to its size, that wakes a body. Used by World.
inline constexpr Scalar kWakeWrenchChange = 1e-9;

/// Residual to which an impact is solved, relative to the largest speed, and the energy that it may
/// seem to create for it, relative to that before. Used by World.
inline constexpr Scalar kImpactSpeedNoise = 1e-11;
inline constexpr Scalar kImpactEnergyNoise = 1e-9;
/// Mobility (velocity per impulse) that counts as none, relative to the largest at hand: rounding of
/// a 3x3 matrix product. Larger: light directions are locked; smaller: noise divides. Used by the
/// contact solvers.
inline constexpr Scalar kContactMobilityNoise = 64 * kUnitRoundoff;

/// A sliding contact is solved by itself until its tangential impulse is on the cone to this
/// fraction, in at most so many steps of a bracketed Newton iteration (2 to 5 are usual). Larger:
/// sweeps stall at that fraction; smaller: steps that rounding wastes. Used by solve_contact().
inline constexpr Scalar kContactSlideNoise = 16 * kUnitRoundoff;
inline constexpr int kContactSlideLimit = 100;

/// Most movable bodies for which Newton's method is faster than Gauss-Seidel even from a good start;
/// found by measurement. Used by ContactCascade.
inline constexpr std::size_t kContactFewBodies = 2;

/// Penalty of Newton's augmented Lagrangian times a contact's mobility: where it begins, and the
/// largest. Larger: fewer outer iterations, but the inner ones have more corners and diverge from a
/// cold start; found by measurement. Used by NewtonSolver.
inline constexpr Scalar kContactPenalty = 300;
inline constexpr Scalar kContactLargestPenalty = 3e4;

/// Factorisations of one outer iteration of Newton (limit): more mean that the penalty is too large;
/// at most so few that it may grow. Trials along a step (limit). Used by NewtonSolver.
inline constexpr int kContactInnerLimit = 20;
inline constexpr int kContactInnerFew = 4;
inline constexpr int kContactLineLimit = 20;

/// Newton steps on the whole law with the same multipliers (limit; 2 to 4 are usual), and the largest
/// penalty there. Larger: fewer multipliers, more digits lost. Used by NewtonSolver.
inline constexpr int kContactPolishLimit = 6;
inline constexpr Scalar kContactPolishPenalty = 1e7;

/// Penalty times mobility with which alternating directions begin; they change it themselves. Used
/// by AdmmSolver.
inline constexpr Scalar kContactFirstPenalty = 1;

/// Rounds of constant coefficients by which a law of friction is solved (limit). Used by
/// ContactSolver.
inline constexpr int kContactFrictionRounds = 30;

}  // namespace dyop
