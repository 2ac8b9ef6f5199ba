// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <pybind11/pybind11.h>

namespace dyop::python {

/// Each adds one topic to the module. Order matters: what a signature names comes first.
void bind_core(pybind11::module_& m);
void bind_shapes(pybind11::module_& m);
void bind_meshes(pybind11::module_& m);
void bind_motions(pybind11::module_& m);
void bind_curves(pybind11::module_& m);
void bind_distance(pybind11::module_& m);
void bind_toi(pybind11::module_& m);
void bind_deforming(pybind11::module_& m);
void bind_obstacles(pybind11::module_& m);
void bind_chain(pybind11::module_& m);
void bind_robots(pybind11::module_& m);
void bind_batches(pybind11::module_& m);
void bind_contacts(pybind11::module_& m);
void bind_bodies(pybind11::module_& m);
void bind_reports(pybind11::module_& m);
void bind_world(pybind11::module_& m);
void bind_scenes(pybind11::module_& m);
void bind_records(pybind11::module_& m);
/// Where the library can write them (HDF5).
void bind_recordings(pybind11::module_& m);
void bind_haptics(pybind11::module_& m);
/// Called by bind_haptics().
void bind_tissue(pybind11::module_& m);
/// The last one: what is there can be shown.
void bind_view(pybind11::module_& m);

}  // namespace dyop::python
