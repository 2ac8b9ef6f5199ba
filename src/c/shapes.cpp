// SPDX-License-Identifier: BSD-3-Clause
#include "c/context.h"
#include "c/convert.h"
#include "core/tolerance.h"
#include "dyop/geometry/compound_shape.h"
#include "dyop/geometry/convex_hull.h"
#include "dyop/geometry/half_space.h"
#include "dyop/geometry/height_field.h"
#include "dyop/geometry/occupancy.h"
#include "dyop/geometry/primitives.h"
#include "dyop/geometry/triangle_mesh.h"

using namespace dyop;  // NOLINT: nothing here is public
using dyop::c::guard;
using dyop::c::require_given;
using dyop::c::rows_from;

dyop_status dyop_sphere_create(dyop_context* context, double radius, dyop_shape* shape) {
  return guard(context, [&] { context->add<Sphere>(context->shapes, shape, radius); });
}

dyop_status dyop_box_create(dyop_context* context, const double half_extents[3],
                            dyop_shape* shape) {
  return guard(context, [&] {
    require_given(half_extents, "half_extents");
    context->add<Box>(context->shapes, shape,
                      Vector3(half_extents[0], half_extents[1], half_extents[2]));
  });
}

dyop_status dyop_capsule_create(dyop_context* context, double radius, double half_length,
                                dyop_shape* shape) {
  return guard(context,
               [&] { context->add<Capsule>(context->shapes, shape, radius, half_length); });
}

dyop_status dyop_cylinder_create(dyop_context* context, double radius, double half_length,
                                 dyop_shape* shape) {
  return guard(context,
               [&] { context->add<Cylinder>(context->shapes, shape, radius, half_length); });
}

dyop_status dyop_cone_create(dyop_context* context, double radius, double half_length,
                             dyop_shape* shape) {
  return guard(context, [&] { context->add<Cone>(context->shapes, shape, radius, half_length); });
}

dyop_status dyop_ellipsoid_create(dyop_context* context, const double semi_axes[3],
                                  dyop_shape* shape) {
  return guard(context, [&] {
    require_given(semi_axes, "semi_axes");
    context->add<Ellipsoid>(context->shapes, shape,
                            Vector3(semi_axes[0], semi_axes[1], semi_axes[2]));
  });
}

dyop_status dyop_rounded_box_create(dyop_context* context, const double half_extents[3],
                                    double radius, dyop_shape* shape) {
  return guard(context, [&] {
    require_given(half_extents, "half_extents");
    context->add<RoundedBox>(context->shapes, shape,
                             Vector3(half_extents[0], half_extents[1], half_extents[2]), radius);
  });
}

dyop_status dyop_rounded_cylinder_create(dyop_context* context, double radius, double half_length,
                                         double edge_radius, dyop_shape* shape) {
  return guard(context, [&] {
    context->add<RoundedCylinder>(context->shapes, shape, radius, half_length, edge_radius);
  });
}

dyop_status dyop_tapered_capsule_create(dyop_context* context, double bottom_radius,
                                        double top_radius, double half_length, dyop_shape* shape) {
  return guard(context, [&] {
    context->add<TaperedCapsule>(context->shapes, shape, bottom_radius, top_radius, half_length);
  });
}

dyop_status dyop_rounded_hull_create(dyop_context* context, const double* points,
                                     size_t point_count, double radius, dyop_shape* shape) {
  return guard(context, [&] {
    context->add<ConvexHull>(context->shapes, shape, rows_from(points, point_count, "points"),
                             radius);
  });
}

dyop_status dyop_half_space_create(dyop_context* context, const double normal[3], double offset,
                                   dyop_shape* shape) {
  return guard(context, [&] {
    require_given(normal, "normal");
    context->add<HalfSpace>(context->shapes, shape, Vector3(normal[0], normal[1], normal[2]),
                            offset);
  });
}

dyop_status dyop_scaled_create(dyop_context* context, dyop_shape original, const double factors[3],
                               dyop_shape* shape) {
  return guard(context, [&] {
    require_given(factors, "factors");
    const Vector3 each(factors[0], factors[1], factors[2]);
    context->adopt(context->shapes, shape, dyop::scaled(*context->shape(original), each));
  });
}

dyop_status dyop_hull_create(dyop_context* context, const double* points, size_t point_count,
                             dyop_shape* shape) {
  return guard(context, [&] {
    context->add<ConvexHull>(context->shapes, shape, rows_from(points, point_count, "points"));
  });
}

dyop_status dyop_mesh_create(dyop_context* context, const double* vertices, size_t vertex_count,
                             const int32_t* triangles, size_t triangle_count, dyop_shape* shape) {
  return guard(context, [&] {
    context->add<TriangleMesh>(
        context->shapes, shape,
        TriangleMesh::from_arrays(StridedRows<double>{vertices, vertex_count},
                                  StridedRows<std::int32_t>{triangles, triangle_count}));
  });
}

dyop_status dyop_height_field_create(dyop_context* context, const double* heights, size_t rows,
                                     size_t columns, double spacing_x, double spacing_y,
                                     double base, dyop_shape* shape) {
  return guard(context, [&] {
    require_given(heights, "heights");
    DYOP_REQUIRE(columns == 0 || rows <= kLargestTriangleCount / columns, "a height field of ",
                 rows, " rows and ", columns, " columns is too large");
    HeightGrid grid;
    grid.rows = rows;
    grid.columns = columns;
    grid.heights.assign(heights, heights + rows * columns);
    grid.spacing_x = spacing_x;
    grid.spacing_y = spacing_y;
    grid.base = base;
    context->add<TriangleMesh>(context->shapes, shape, height_field(grid));
  });
}

dyop_status dyop_mesh_refit(dyop_context* context, dyop_shape mesh, const double* vertices,
                            size_t vertex_count, dyop_shape* shape) {
  return guard(context, [&] {
    const auto old = std::dynamic_pointer_cast<const TriangleMesh>(context->shape(mesh));
    DYOP_REQUIRE(old, "shape ", mesh.index, " is not a mesh");
    context->add<TriangleMesh>(context->shapes, shape,
                               old->with_vertices(StridedRows<double>{vertices, vertex_count}));
  });
}

dyop_status dyop_compound_create(dyop_context* context, const dyop_shape* children,
                                 const dyop_pose* poses, size_t child_count, dyop_shape* shape) {
  return guard(context, [&] {
    DYOP_REQUIRE(child_count == 0 || (children && poses), "children and poses must not be null");
    std::vector<CompoundChild> list;
    for (std::size_t i = 0; i < child_count; ++i) {
      list.push_back({context->shape(children[i]), dyop::c::pose_from(poses[i])});
    }
    context->add<CompoundShape>(context->shapes, shape, list);
  });
}

dyop_status dyop_point_cloud_create(dyop_context* context, const double* points, size_t point_count,
                                    double radius, dyop_shape* shape) {
  return guard(context, [&] {
    context->add<CompoundShape>(context->shapes, shape,
                                point_cloud(rows_from(points, point_count, "points"), radius));
  });
}

dyop_status dyop_occupancy_create(dyop_context* context, const double* centers, const double* sizes,
                                  size_t cube_count, dyop_shape* shape) {
  return guard(context, [&] {
    DYOP_REQUIRE(sizes || cube_count == 0, "sizes must not be null");
    const std::vector<Vector3> points = rows_from(centers, cube_count, "centers");
    std::vector<OccupiedCube> cubes;
    for (std::size_t k = 0; k < cube_count; ++k) cubes.push_back({points[k], sizes[k]});
    context->add<CompoundShape>(context->shapes, shape, occupancy(cubes));
  });
}

dyop_status dyop_shape_mass_properties(dyop_context* context, dyop_shape shape, double density,
                                       dyop_mass_properties* properties) {
  return guard(context, [&] {
    *dyop::c::require_given(properties, "properties") =
        dyop::c::to_c(context->shape(shape)->compute_mass_properties(density));
  });
}

dyop_status dyop_shape_destroy(dyop_context* context, dyop_shape shape) {
  return guard(context, [&] { context->remove(context->shapes, shape, "the shape"); });
}
