// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <span>
#include <vector>

#include "python/glue/arguments.h"
#include "python/glue/record.h"

namespace dyop::python {

/// (N, 3) arrays of their own.
inline py::array_t<double> copy_of(std::span<const Vector3> points) {
  return py::array_t<double>({py::ssize_t(points.size()), py::ssize_t{3}},
                             points.empty() ? nullptr : points.data()->data());
}
inline py::array_t<std::int32_t> copy_of(std::span<const TriangleIndices> triangles) {
  return py::array_t<std::int32_t>({py::ssize_t(triangles.size()), py::ssize_t{3}},
                                   triangles.empty() ? nullptr : triangles.data()->data());
}

/// The members `vertices` and `triangles` of a struct as such arrays.
template <typename T>
Field vertices_field() {
  return {
      "vertices",
      [](const void* r, py::handle) { return sealed(copy_of(static_cast<const T*>(r)->vertices)); },
      [](void* r, py::handle value) {
        static_cast<T*>(r)->vertices = points_of(value, "vertices", CopyRule::IfNeeded);
      }};
}
template <typename T>
Field triangles_field() {
  return {"triangles",
          [](const void* r, py::handle) {
            return sealed(copy_of(static_cast<const T*>(r)->triangles));
          },
          [](void* r, py::handle value) {
            static_cast<T*>(r)->triangles = triangles_of(value, CopyRule::IfNeeded);
          }};
}

}  // namespace dyop::python
