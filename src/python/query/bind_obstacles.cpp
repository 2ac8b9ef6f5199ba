// SPDX-License-Identifier: BSD-3-Clause
#include <functional>
#include <memory>
#include <string>
#include <tuple>

#include "dyop/motion/steady_motions.h"
#include "python/bindings.h"
#include "python/query/queries.h"

namespace dyop::python {
namespace {

using Id = std::uint64_t;

void bind_obstacle_results(py::module_& m) {
  Record<Obstacle>(m, "Obstacle", "A shape in the world, at rest or on a motion.")
      .field<&Obstacle::shape>("shape", "Optional[Shape]: in its frame O")
      .field<&Obstacle::X_WO>("X_WO", "Optional[Motion]: a RestMotion for one at rest")
      .field<&Obstacle::groups>("groups", "int: bit set; queries select by it")
      .field<&Obstacle::is_solid>("is_solid", "bool: a closed mesh is a solid")
      .finish();
  constexpr const char* kIdDoc = "Optional[int]: the obstacle that the result refers to";
  Record<ObstacleImpact>(m, "ObstacleImpact", "Result of ObstacleSet.first_impact().")
      .field<&ObstacleImpact::toi>("toi", "ToiResult: A is the body, B the obstacle")
      .custom(id_field<ObstacleImpact>(), kIdDoc, false)
      .field<&ObstacleImpact::free_fraction>("free_fraction",
                                             "float: part of the interval proven free")
      .finish();
  Record<NearestObstacle>(m, "NearestObstacle", "Result of ObstacleSet.nearest().")
      .field<&NearestObstacle::distance>("distance", "DistanceResult: least over all obstacles")
      .custom(id_field<NearestObstacle>(), kIdDoc, false)
      .finish();
  Record<ObstacleHit>(m, "ObstacleHit", "Result of ObstacleSet.ray_cast().")
      .field<&ObstacleHit::hit>("hit", "RayHit: of the first obstacle hit")
      .custom(id_field<ObstacleHit>(), kIdDoc, false)
      .finish();
  Record<ObstacleClearance>(m, "ObstacleClearance", "Result of ObstacleSet.least_distance().")
      .field<&ObstacleClearance::distance>("distance", "LeastDistanceResult: over all obstacles")
      .custom(id_field<ObstacleClearance>(), kIdDoc, false)
      .finish();
}

using SetClass = py::class_<SharedObstacleSet, std::shared_ptr<SharedObstacleSet>>;

// What is pickled: (id, shape, motion, groups, is_solid) of each obstacle.
py::list obstacles_by_id(const SharedObstacleSet& self) {
  py::list list;
  for (const ObstacleId id : self.set.ids()) {
    const Obstacle& obstacle = self.set.obstacle(id);
    list.append(py::make_tuple(Id(id), std::const_pointer_cast<Shape>(obstacle.shape),
                               std::const_pointer_cast<Motion>(obstacle.X_WO), obstacle.groups,
                               obstacle.is_solid));
  }
  return list;
}

std::shared_ptr<SharedObstacleSet> set_of_obstacles(const py::list& list) {
  auto result = std::make_shared<SharedObstacleSet>();
  for (const py::handle item : list) {
    const auto [id, shape, motion, groups, is_solid] = item.cast<
        std::tuple<Id, std::shared_ptr<Shape>, std::shared_ptr<Motion>, std::uint32_t, bool>>();
    result->set.add_as(ObstacleId(id), {shape, motion, groups, is_solid});
  }
  return result;
}

void bind_obstacle_changes(SetClass& type) {
  type.def(py::init<>(), "An empty set.")
      .def(
          "add",
          [](SharedObstacleSet& self, const std::shared_ptr<Shape>& shape, const py::object& X_WO,
             std::uint32_t groups, bool is_solid) {
            std::shared_ptr<const Motion> motion;
            if (py::isinstance<Motion>(X_WO)) {
              motion = X_WO.cast<std::shared_ptr<Motion>>();
            } else {
              motion = std::make_shared<RestMotion>(pose_of(X_WO));
            }
            return Id(self.change().add({shape, motion, groups, is_solid}));
          },
          py::arg("shape").none(false), py::arg("X_WO") = RigidPose(), py::arg("groups") = 1,
          py::arg("is_solid") = false,
          "Adds a shape at a pose or on a motion; returns its id. groups: bit set.")
      .def(
          "move",
          [](SharedObstacleSet& self, Id id, const py::object& X_WO) {
            if (py::isinstance<Motion>(X_WO)) {
              self.change().move(ObstacleId(id), X_WO.cast<std::shared_ptr<Motion>>());
            } else {
              self.change().move(ObstacleId(id), pose_of(X_WO));
            }
          },
          py::arg("id"), py::arg("X_WO"), "To another pose, or onto another motion.")
      .def(
          "remove", [](SharedObstacleSet& self, Id id) { self.change().remove(ObstacleId(id)); },
          py::arg("id"), "Takes the obstacle away.")
      .def(
          "obstacle",
          [](const SharedObstacleSet& self, Id id) {
            return Obstacle(self.set.obstacle(ObstacleId(id)));
          },
          py::arg("id"), "The obstacle of an id.")
      .def(
          "__contains__",
          [](const SharedObstacleSet& self, Id id) { return self.set.contains(ObstacleId(id)); },
          py::arg("id"))
      .def("__len__", [](const SharedObstacleSet& self) { return self.set.size(); })
      .def(
          "ids",
          [](const SharedObstacleSet& self) {
            std::vector<Id> ids;
            for (const ObstacleId id : self.set.ids()) ids.push_back(Id(id));
            return ids;
          },
          "Ids of all obstacles, in ascending order.")
      .def("__repr__",
           [](const SharedObstacleSet& self) {
             return "ObstacleSet(" + std::to_string(self.set.size()) + " obstacles)";
           })
      .def(py::pickle(&obstacles_by_id, &set_of_obstacles));
}

void bind_obstacle_queries(SetClass& type) {
  type.def(
          "first_impact",
          [](SharedObstacleSet& self, const Shape& body, const Motion& X_WB,
             const IntervalArgument& interval, const PythonToiOptions* options,
             std::uint32_t groups, const py::object& accepts) {
            const ToiOptions used = options_or_default(options);
            const ObstacleFilter filter = make_filter(groups, accepts);
            return self.read([&](const ObstacleSet& set) {
              const auto ask = [&](const ToiOptions& limited) {
                return set.first_impact(body, X_WB, interval.interval, limited, filter);
              };
              return answer_or_start_over(used, ask, std::mem_fn(&ObstacleImpact::toi));
            });
          },
          py::arg("body"), py::arg("X_WB"), py::arg("interval"), py::arg("options") = py::none(),
          py::arg("groups") = ~std::uint32_t{0}, py::arg("accepts") = py::none(),
          "The first time at which the body comes within the target distance of an obstacle, or a\n"
          "proof that it does not. accepts(id) leaves obstacles out.")
      .def(
          "nearest",
          [](SharedObstacleSet& self, const Shape& body, const PoseArgument& X_WB, Scalar t,
             const DistanceOptions* options, std::uint32_t groups, const py::object& accepts) {
            const DistanceOptions used = options != nullptr ? *options : DistanceOptions();
            const ObstacleFilter filter = make_filter(groups, accepts);
            return self.read([&](const ObstacleSet& set) {
              const py::gil_scoped_release unlocked;
              return set.nearest(body, X_WB.X, t, used, filter);
            });
          },
          py::arg("body"), py::arg("X_WB"), py::arg("t") = 0.0, py::arg("options") = py::none(),
          py::arg("groups") = ~std::uint32_t{0}, py::arg("accepts") = py::none(),
          "The obstacle nearest to the body at time t.")
      .def(
          "ray_cast",
          [](SharedObstacleSet& self, const Vector3& p_W, const Vector3& direction_W, Scalar length,
             Scalar radius, Scalar t, std::uint32_t groups, const py::object& accepts) {
            const ObstacleFilter filter = make_filter(groups, accepts);
            return self.read([&](const ObstacleSet& set) {
              const py::gil_scoped_release unlocked;
              return set.ray_cast({p_W, direction_W, length, radius}, t, filter);
            });
          },
          py::arg("p_W"), py::arg("direction_W"), py::arg("length") = kInfinity,
          py::arg("radius") = 0.0, py::arg("t") = 0.0, py::arg("groups") = ~std::uint32_t{0},
          py::arg("accepts") = py::none(),
          "The first obstacle that a ray, or a ball on its way along it, meets at time t.");
}

void bind_obstacle_clearance(SetClass& type) {
  type.def(
      "least_distance",
      [](SharedObstacleSet& self, const Shape& body, const Motion& X_WB,
         const IntervalArgument& interval, const PythonLeastDistanceOptions* options,
         std::uint32_t groups, const py::object& accepts) {
        LeastDistanceOptions used = options_or_default(options);
        const ObstacleFilter filter = make_filter(groups, accepts);
        return self.read([&](const ObstacleSet& set) {
          ObstacleClearance result;
          run_interruptible(used.stop, [&](const std::stop_token& stop) {
            used.stop = stop;
            result = set.least_distance(body, X_WB, interval.interval, used, filter);
          });
          return result;
        });
      },
      py::arg("body"), py::arg("X_WB"), py::arg("interval"), py::arg("options") = py::none(),
      py::arg("groups") = ~std::uint32_t{0}, py::arg("accepts") = py::none(),
      "The least distance of the body from any obstacle over an interval (begin, end).");
}

}  // namespace

void bind_obstacles(py::module_& m) {
  bind_obstacle_results(m);
  SetClass type(m, "ObstacleSet", "Many placed shapes, for queries of one body against all.");
  bind_obstacle_changes(type);
  bind_obstacle_queries(type);
  bind_obstacle_clearance(type);
}

}  // namespace dyop::python
