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
void bind_batches(pybind11::module_& m);
void bind_deforming(pybind11::module_& m);
void bind_obstacles(pybind11::module_& m);

}  // namespace dyop::python
