// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cstdint>
#include <memory>
#include <optional>
#include <utility>

#include "dyop/core/error.h"
#include "dyop/distance/distance.h"
#include "dyop/distance/distance_derivatives.h"
#include "dyop/distance/gjk.h"
#include "dyop/distance/near_triangles.h"
#include "dyop/distance/point_distance.h"
#include "dyop/distance/ray_cast.h"
#include "dyop/distance/triangle_distance.h"
#include "dyop/io/result_text.h"
#include "python/bindings.h"
#include "python/glue/calls.h"
#include "python/query/queries.h"

namespace dyop::python {
namespace {

// Few contacts in the calling thread; many once more, while Ctrl-C is served.
std::vector<Contact> contacts_within(const Shape& a, const RigidPose& X_WA, const Shape& b,
                                     const RigidPose& X_WB, Scalar max_distance,
                                     const ContactSearchLimits& limits) {
  constexpr std::int64_t kFew = 2000;  // some ten milliseconds
  std::optional<std::vector<Contact>> contacts;
  ContactSearchLimits used = limits;
  used.max_triangle_pairs = std::min(limits.max_triangle_pairs, kFew);
  {
    const py::gil_scoped_release unlocked;
    contacts = find_contacts(a, X_WA, b, X_WB, max_distance, used);
  }
  if (!contacts && limits.max_triangle_pairs > kFew) {
    used.max_triangle_pairs = limits.max_triangle_pairs;
    run_interruptible({}, [&](const std::stop_token& stop) {
      used.stop = stop;
      contacts = find_contacts(a, X_WA, b, X_WB, max_distance, used);
    });
  }
  DYOP_REQUIRE(contacts, "find_contacts: more than ", limits.max_triangle_pairs,
               " pairs of triangles are within max_distance = ", max_distance);
  return *std::move(contacts);
}

void bind_distance_results(py::module_& m) {
  py::enum_<DistanceStatus>(m, "DistanceStatus", "How a distance query ended.")
      .value("NotRun", DistanceStatus::NotRun)
      .value("Separated", DistanceStatus::Separated, "Proven apart.")
      .value("Overlapping", DistanceStatus::Overlapping, "They touch or intersect.")
      .value("FartherThanMaxDistance", DistanceStatus::FartherThanMaxDistance, "Stopped early.")
      .value("Inconclusive", DistanceStatus::Inconclusive, "Neither was proven.");
  Record<Penetration>(m, "Penetration", "How two overlapping shapes can move apart.")
      .field<&Penetration::depth>("depth", "float: length, > 0")
      .field<&Penetration::nhat_AB_W>("nhat_AB_W",
                                      "numpy.ndarray: (3,) moving B by depth along it separates")
      .field<&Penetration::p_W>("p_W", "numpy.ndarray: (3,) a point in the overlap")
      .finish();
  Record<DistanceStatistics>(m, "DistanceStatistics", "Work of a distance query.")
      .field<&DistanceStatistics::box_tests>("box_tests", "int: pairs of bounding boxes")
      .field<&DistanceStatistics::leaf_tests>("leaf_tests", "int: pairs of triangles or pieces")
      .field<&DistanceStatistics::gjk_iterations>("gjk_iterations", "int: of GJK")
      .finish();
  Record<WitnessPair> pair(m, "WitnessPair", "Two witness points, and bounds of the distance.");
  add_witness_fields(pair);
  pair.finish();
  m.attr("Contact") = pair.type;
  Record<DistanceResult, WitnessPair> result(m, "DistanceResult", "Result of distance().");
  result.field<&DistanceResult::status>("status", "DistanceStatus: how the query ended");
  add_witness_fields(result);
  result
      .field<&DistanceResult::penetration>("penetration",
                                           "Optional[Penetration]: if asked for and found")
      .field<&DistanceResult::statistics>("statistics", "DistanceStatistics: work")
      .finish();
  result.type.def("__str__", [](const DistanceResult& r) { return describe(r); });
}

void bind_distance_options(py::module_& m) {
  Record<DistanceOptions>(m, "DistanceOptions", "Options of distance().")
      .option<&DistanceOptions::max_distance>("max_distance",
                                              "float: stop when proven farther apart; length, >= 0")
      .option<&DistanceOptions::absolute_tolerance>(
          "absolute_tolerance", "float: how far apart the bounds may stay; length, >= 0")
      .option<&DistanceOptions::relative_tolerance>("relative_tolerance",
                                                    "float: the same times upper, in [0, 1)")
      .option<&DistanceOptions::with_penetration>("with_penetration",
                                                  "bool: depth of overlapping convex shapes")
      .option<&DistanceOptions::solid_a>("solid_a", "bool: A is a solid, not a surface")
      .option<&DistanceOptions::solid_b>("solid_b", "bool: B is a solid, not a surface")
      .finish();
  py::class_<DistanceCache>(m, "DistanceCache",
                            "What a distance query stores for the next one of the same shapes.")
      .def(py::init<>());
}

void bind_shape_queries(py::module_& m) {
  m.def(
      "distance",
      [](const Shape& a, const PoseArgument& X_WA, const Shape& b, const PoseArgument& X_WB,
         const DistanceOptions* options, DistanceCache* cache) {
        const DistanceOptions& used = options != nullptr ? *options : DistanceOptions();
        const py::gil_scoped_release unlocked;
        if (cache == nullptr) return distance(a, X_WA.X, b, X_WB.X, used);
        return distance(a, X_WA.X, b, X_WB.X, used, *cache);
      },
      py::arg("a"), py::arg("X_WA"), py::arg("b"), py::arg("X_WB"), py::arg("options") = py::none(),
      py::arg("cache") = py::none(),
      "The distance of two shapes at their poses, with proven bounds lower <= d <= upper and\n"
      "witness points, lengths. Meshes are surfaces, convex shapes solids. A cache, used by one\n"
      "thread at a time, makes the next query of the same shapes faster.");
  m.def(
      "find_contacts",
      [](const Shape& a, const PoseArgument& X_WA, const Shape& b, const PoseArgument& X_WB,
         Scalar max_distance, const std::optional<std::int64_t>& max_triangle_pairs) {
        ContactSearchLimits limits;
        if (max_triangle_pairs) limits.max_triangle_pairs = *max_triangle_pairs;
        return contacts_within(a, X_WA.X, b, X_WB.X, max_distance, limits);
      },
      py::arg("a"), py::arg("X_WA"), py::arg("b"), py::arg("X_WB"), py::arg("max_distance"),
      py::kw_only(), py::arg("max_triangle_pairs") = py::none(),
      "Every contact of two shapes at most max_distance (length) apart, nearest first.\n"
      "InvalidArgument if more than max_triangle_pairs pairs of triangles are so near.");
  m.def(
      "find_penetration",
      [](const ConvexShape& a, const PoseArgument& X_WA, const ConvexShape& b,
         const PoseArgument& X_WB) { return find_penetration(a, X_WA.X, b, X_WB.X); },
      py::arg("a"), py::arg("X_WA"), py::arg("b"), py::arg("X_WB"),
      "Depth and direction of two overlapping convex shapes; an estimate. None if no overlap.");
}

// Few pairs in the calling thread; many once more, while Ctrl-C is served.
template <typename Search>
NearTriangleList near_pairs(const std::optional<std::size_t>& max_pairs, const Search& search) {
  constexpr std::size_t kFew = 10'000;  // some ten milliseconds
  TrianglePairLimits limits;
  if (max_pairs) limits.max_pairs = *max_pairs;
  const std::size_t wanted = std::exchange(limits.max_pairs, std::min(limits.max_pairs, kFew));
  NearTriangleList list;
  {
    const py::gil_scoped_release unlocked;
    list = search(limits);
  }
  if (list.is_complete || wanted <= kFew) return list;
  limits.max_pairs = wanted;
  run_interruptible({}, [&](const std::stop_token& stop) {
    limits.stop = stop;
    list = search(limits);
  });
  return list;
}

// The pairs as a structured array.
Field pairs_field() {
  return {"pairs",
          [](const void* r, py::handle) {
            const auto& pairs = static_cast<const NearTriangleList*>(r)->pairs;
            return sealed(py::array_t<NearTriangles>(py::ssize_t(pairs.size()), pairs.data()));
          },
          [](void* r, py::handle value) {
            const auto array = value.cast<py::array_t<NearTriangles, py::array::c_style>>();
            static_cast<NearTriangleList*>(r)->pairs.assign(array.data(),
                                                            array.data() + array.size());
          }};
}

void bind_near_triangles(py::module_& m) {
  static_assert(sizeof(NearTriangles) == 24);  // no padding, which would be garbage
  PYBIND11_NUMPY_DTYPE(NearTriangles, a, b, lower, upper);
  m.attr("near_triangles_row") = py::dtype::of<NearTriangles>();
  Record<NearTriangleList>(m, "NearTriangleList", "Result of near_triangles().")
      .custom(pairs_field(),
              "numpy.ndarray: rows near_triangles_row: a, b, lower, upper; by a, then b", false)
      .field<&NearTriangleList::is_complete>("is_complete", "bool: max_pairs was enough")
      .finish();
  m.def(
      "near_triangles",
      [](const TriangleMesh& a, const PoseArgument& X_WA, const TriangleMesh& b,
         const PoseArgument& X_WB, Scalar max_distance,
         const std::optional<std::size_t>& max_pairs) {
        return near_pairs(max_pairs, [&](const TrianglePairLimits& limits) {
          return near_triangles(a, X_WA.X, b, X_WB.X, max_distance, limits);
        });
      },
      py::arg("a"), py::arg("X_WA"), py::arg("b"), py::arg("X_WB"), py::arg("max_distance"),
      py::kw_only(), py::arg("max_pairs") = py::none(),
      "Every pair of triangles of two meshes at most max_distance (length) apart; 0: all that "
      "touch\n"
      "or cross. A pair is left out only if it is proven farther apart.");
  m.def(
      "near_own_triangles",
      [](const TriangleMesh& mesh, Scalar max_distance,
         const std::optional<std::size_t>& max_pairs) {
        return near_pairs(max_pairs, [&](const TrianglePairLimits& limits) {
          return near_own_triangles(mesh, max_distance, limits);
        });
      },
      py::arg("mesh"), py::arg("max_distance"), py::kw_only(), py::arg("max_pairs") = py::none(),
      "The same for a mesh against itself: pairs a < b that have no vertex in common.");
}

void bind_distance_kernels(py::module_& m) {
  Record<NearestPoints>(m, "NearestPoints", "Nearest points of two pieces, in the query's frame.")
      .field<&NearestPoints::lower>("lower", "float: never above the distance")
      .field<&NearestPoints::upper>("upper", "float: never below the distance")
      .field<&NearestPoints::p_a>("p_a", "numpy.ndarray: (3,) witness point on a")
      .field<&NearestPoints::p_b>("p_b", "numpy.ndarray: (3,) witness point on b")
      .field<&NearestPoints::nhat_AB>("nhat_AB", "numpy.ndarray: (3,) unit, from a to b")
      .field<&NearestPoints::feature_a>("feature_a", "Feature: of a")
      .field<&NearestPoints::feature_b>("feature_b", "Feature: of b")
      .field<&NearestPoints::is_overlapping>("is_overlapping", "bool: found to touch")
      .finish();
  m.def(
      "gjk_distance",
      [](const ConvexShape& a, const ConvexShape& b, const PoseArgument& X_AB) -> NearestPoints {
        return gjk_distance(a, b, X_AB.X);
      },
      py::arg("a"), py::arg("b"), py::arg("X_AB"),
      "The distance of two convex shapes, in the frame of the first.");
  m.def(
      "triangle_distance",
      [](const py::object& a, const py::object& b) {
        const auto corners = [](const py::object& source) {
          const auto points = points_of(source, "triangle", CopyRule::IfNeeded);
          if (points.size() != 3) throw py::value_error("a triangle must be (3, 3)");
          for (const Vector3& p : points) {
            if (!p.allFinite()) throw py::value_error("a triangle must be finite");
          }
          return Triangle{points[0], points[1], points[2]};
        };
        return triangle_distance(corners(a), corners(b));
      },
      py::arg("a"), py::arg("b"), "The distance of two triangles (3, 3) in one frame.");
}

void bind_point_distance(py::module_& m) {
  Record<PointDistanceOptions>(m, "PointDistanceOptions", "Options of point_distance().")
      .option<&PointDistanceOptions::max_distance>(
          "max_distance", "float: stop when proven farther from the point; length, >= 0")
      .option<&PointDistanceOptions::is_signed>("is_signed",
                                                "bool: distances inside the shape are negative")
      .finish();
  Record<PointDistance>(m, "PointDistance", "Result of point_distance().")
      .field<&PointDistance::lower>("lower", "float: never above the distance")
      .field<&PointDistance::upper>("upper", "float: never below the distance")
      .field<&PointDistance::p_WC>("p_WC", "numpy.ndarray: (3,) nearest point of the surface")
      .field<&PointDistance::nhat_W>("nhat_W", "numpy.ndarray: (3,) unit, along which it grows")
      .field<&PointDistance::feature>("feature", "Feature: of the shape")
      .field<&PointDistance::triangle>("triangle", "Optional[int]: if the shape is a mesh")
      .field<&PointDistance::child>("child", "Optional[int]: if the shape is a compound")
      .finish();
  m.def(
      "point_distance",
      [](const Shape& shape, const PoseArgument& X_WS, const Vector3& p_W,
         const PointDistanceOptions* options) {
        return point_distance(shape, X_WS.X, p_W,
                              options != nullptr ? *options : PointDistanceOptions());
      },
      py::arg("shape"), py::arg("X_WS"), py::arg("p_W"), py::arg("options") = py::none(),
      "The distance of a point (3,) from a shape, with proven bounds.");
}

void bind_ray_cast(py::module_& m) {
  py::enum_<RayStatus>(m, "RayStatus", "How a ray ended.")
      .value("NotRun", RayStatus::NotRun)
      .value("Miss", RayStatus::Miss, "Proven: nothing is touched.")
      .value("Hit", RayStatus::Hit, "Touches, up to rounding.")
      .value("InitiallyTouching", RayStatus::InitiallyTouching, "Not proven apart at the start.")
      .value("NumericalLimit", RayStatus::NumericalLimit, "Undecided after `distance`.");
  Record<RayHit>(m, "RayHit", "Result of ray_cast().")
      .field<&RayHit::status>("status", "RayStatus: how the ray ended")
      .field<&RayHit::distance>("distance", "float: proven free until here; Miss: the length")
      .field<&RayHit::gap>("gap", "float: what is left to the shape there, at most")
      .field<&RayHit::p_WC>("p_WC", "numpy.ndarray: (3,) where the shape is touched")
      .field<&RayHit::nhat_W>("nhat_W", "numpy.ndarray: (3,) unit normal, from the shape")
      .field<&RayHit::feature>("feature", "Feature: of the shape")
      .field<&RayHit::triangle>("triangle", "Optional[int]: if the shape is a mesh")
      .field<&RayHit::child>("child", "Optional[int]: if the shape is a compound")
      .finish();
  m.def(
      "ray_cast",
      [](const Shape& shape, const PoseArgument& X_WS, const Vector3& p_W,
         const Vector3& direction_W, Scalar length, Scalar radius) {
        return ray_cast(shape, X_WS.X, {p_W, direction_W, length, radius});
      },
      py::arg("shape"), py::arg("X_WS"), py::arg("p_W"), py::arg("direction_W"),
      py::arg("length") = kInfinity, py::arg("radius") = 0.0,
      "Where a ray from p_W (3,), or a ball of this radius on its way along it, first touches a\n"
      "shape: never behind the true surface, never through an edge.");
}

void bind_gradients(py::module_& m) {
  Record<PoseGradient> gradient(m, "PoseGradient", "How a number changes with a body's pose.");
  gradient
      .field<&PoseGradient::translation>("translation",
                                         "numpy.ndarray: (3,) per length of its origin")
      .field<&PoseGradient::rotation>("rotation", "numpy.ndarray: (3,) per radian about its origin")
      .finish();
  gradient.type.def(
      "along",
      [](const PoseGradient& g, const TwistArgument& twist) { return g.along(twist.twist); },
      py::arg("twist"), "The rate of change while the body moves with a twist (v, w).");
  Record<PoseJacobian>(m, "PoseJacobian", "How a vector changes with a body's pose.")
      .field<&PoseJacobian::translation>("translation",
                                         "numpy.ndarray: (3, 3) a column per axis of the world")
      .field<&PoseJacobian::rotation>("rotation", "numpy.ndarray: (3, 3) per radian")
      .finish();
  Record<WitnessJacobians>(m, "WitnessJacobians", "How witness points and normal change.")
      .field<&WitnessJacobians::p_WCa_by_a>("p_WCa_by_a", "PoseJacobian: by the pose of A")
      .field<&WitnessJacobians::p_WCa_by_b>("p_WCa_by_b", "PoseJacobian: by the pose of B")
      .field<&WitnessJacobians::p_WCb_by_a>("p_WCb_by_a", "PoseJacobian: by the pose of A")
      .field<&WitnessJacobians::p_WCb_by_b>("p_WCb_by_b", "PoseJacobian: by the pose of B")
      .field<&WitnessJacobians::nhat_by_a>("nhat_by_a", "PoseJacobian: by the pose of A")
      .field<&WitnessJacobians::nhat_by_b>("nhat_by_b", "PoseJacobian: by the pose of B")
      .finish();
}

void bind_derivatives(py::module_& m) {
  py::enum_<DerivativeStatus>(m, "DerivativeStatus", "Whether derivatives may be used.")
      .value("NotRun", DerivativeStatus::NotRun)
      .value("Proven", DerivativeStatus::Proven, "No corner, within the tolerance.")
      .value("Unproven", DerivativeStatus::Unproven, "The error may be larger; no corner was seen.")
      .value("Tie", DerivativeStatus::Tie, "A corner: other features are as near.")
      .value("Touching", DerivativeStatus::Touching, "Not proven apart: no gradient.")
      .value("Grazing", DerivativeStatus::Grazing, "Of an impact: the bodies hardly approach.");
  bind_gradients(m);
  Record<DistanceDerivatives>(m, "DistanceDerivatives", "Result of distance_derivatives().")
      .field<&DistanceDerivatives::status>("status", "DerivativeStatus: whether to use them")
      .field<&DistanceDerivatives::by_a>("by_a", "PoseGradient: of the distance, by the pose of A")
      .field<&DistanceDerivatives::by_b>("by_b", "PoseGradient: of the distance, by the pose of B")
      .field<&DistanceDerivatives::error>("error", "float: of one-sided derivatives, proven")
      .field<&DistanceDerivatives::witness>("witness",
                                            "Optional[WitnessJacobians]: where features are flat")
      .field<&DistanceDerivatives::distance>("distance", "DistanceResult: at these poses")
      .finish();
  m.def(
      "distance_derivatives",
      [](const Shape& a, const PoseArgument& X_WA, const Shape& b, const PoseArgument& X_WB,
         Scalar tolerance) {
        const py::gil_scoped_release unlocked;
        return distance_derivatives(a, X_WA.X, b, X_WB.X, {.tolerance = tolerance});
      },
      py::arg("a"), py::arg("X_WA"), py::arg("b"), py::arg("X_WB"),
      py::arg("tolerance") = DerivativeOptions().tolerance,
      "The distance of two shapes and its derivatives by both poses, proven within a tolerance or\n"
      "flagged where features tie.");
}

}  // namespace

void bind_distance(py::module_& m) {
  bind_distance_results(m);
  bind_distance_options(m);
  bind_shape_queries(m);
  bind_near_triangles(m);
  bind_distance_kernels(m);
  bind_point_distance(m);
  bind_ray_cast(m);
  bind_derivatives(m);
}

}  // namespace dyop::python
