// SPDX-License-Identifier: BSD-3-Clause
#include "python/bindings.h"
#include "python/glue/calls.h"
#include "python/glue/record.h"

namespace {

constexpr const char* kDoc =
    R"(Certified continuous collision detection and stepping of rigid bodies.

Lengths and times are in any consistent units. Arrays are float64; poses are a RigidPose, a (4, 4)
array, or a pair (quaternion (w, x, y, z), position). Normals point from A to B, in world W.)";

}  // namespace

PYBIND11_MODULE(_dyop, m) {
  m.doc() = kDoc;
  m.attr("__version__") = DYOP_VERSION;
  dyop::python::bind_core(m);
  dyop::python::bind_shapes(m);
  dyop::python::bind_meshes(m);
  dyop::python::bind_motions(m);
  dyop::python::bind_curves(m);
  dyop::python::bind_distance(m);
  dyop::python::bind_toi(m);
  dyop::python::bind_deforming(m);
  dyop::python::bind_obstacles(m);
  dyop::python::bind_chain(m);
  dyop::python::bind_robots(m);
  dyop::python::bind_batches(m);
  dyop::python::bind_contacts(m);
  dyop::python::bind_bodies(m);
  dyop::python::bind_reports(m);
  dyop::python::bind_world(m);
  dyop::python::bind_scenes(m);
  dyop::python::bind_records(m);
#ifdef DYOP_HAS_RECORDING
  dyop::python::bind_recordings(m);
#endif
#ifdef DYOP_HAS_HAPTICS
  dyop::python::bind_haptics(m);
#endif
  dyop::python::bind_view(m);
  dyop::python::seal_properties(m);
  dyop::python::explain_refused_calls(m);
  dyop::python::refuse_unmade_objects(m);
}
