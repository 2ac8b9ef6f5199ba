/* SPDX-License-Identifier: BSD-3-Clause */
#ifndef DYOP_C_H
#define DYOP_C_H

/* dyop for C99 and every language that can call C. docs/c.md is the guide; docs/algorithms
 * states what a query promises, under the C++ names, which are also used here.
 *
 * - Every function returns a dyop_status. No exception leaves the library.
 * - Handles are an index and a generation: a handle whose object was destroyed is
 *   DYOP_STALE_HANDLE, never another object. Zero handles refer to nothing. Handles belong to
 *   their context; another one, also one made later, takes them for stale.
 * - Arrays belong to the caller, and are used only during the call.
 * - Structs for options, definitions and results begin with their `size`, so that they can grow:
 *   fill them from the DYOP_..._INIT macros, or in other languages by the dyop_..._init functions.
 *   Null options mean these defaults.
 * - Shapes and motions never change; objects that use them keep them alive. Queries may run in many
 *   threads at once; one world serves one thread at a time.
 * - Files are read by the functions of dyop_c_io.h, a library of its own.
 */
#include <math.h>
#include <stddef.h>
#include <stdint.h>

#if defined(__GNUC__)
#define DYOP_C_API __attribute__((visibility("default")))
#else
#define DYOP_C_API
#endif

#ifdef __cplusplus
extern "C" {
#endif

typedef enum dyop_status {
  DYOP_OK = 0,
  DYOP_INVALID_ARGUMENT = 1, /* the message names the value */
  DYOP_STALE_HANDLE = 2,     /* the object was destroyed or never existed */
  DYOP_UNSUPPORTED = 3,      /* a struct has fields that this library does not know */
  DYOP_OUT_OF_MEMORY = 4,
  DYOP_INTEGRATION_ERROR = 5, /* a wrench is not finite or cannot be integrated */
  DYOP_INTERNAL_ERROR = 6,    /* an error in dyop; the message holds the data to reproduce it */
  DYOP_FILE_ERROR = 7         /* the message names the file, the place in it and the value */
} dyop_status;

typedef struct dyop_context dyop_context;
/* Distinct types, so that a compiler detects mixed-up handles. */
typedef struct dyop_shape {
  uint32_t index, generation;
} dyop_shape;
typedef struct dyop_motion {
  uint32_t index, generation;
} dyop_motion;
typedef struct dyop_world {
  uint32_t index, generation;
} dyop_world;
typedef struct dyop_body {
  uint32_t index, generation;
} dyop_body;

typedef struct dyop_obstacle_set {
  uint32_t index, generation;
} dyop_obstacle_set;
typedef struct dyop_chain {
  uint32_t index, generation;
} dyop_chain;
typedef struct dyop_joint_path {
  uint32_t index, generation;
} dyop_joint_path;
typedef struct dyop_robot {
  uint32_t index, generation;
} dyop_robot;
typedef struct dyop_deforming_mesh {
  uint32_t index, generation;
} dyop_deforming_mesh;
typedef struct dyop_haptic_session {
  uint32_t index, generation;
} dyop_haptic_session;
typedef struct dyop_snapshot {
  uint32_t index, generation;
} dyop_snapshot;
/* Names something in one obstacle set, or one world. Zero names nothing; none is used again. */
typedef struct dyop_obstacle {
  uint64_t number;
} dyop_obstacle;
typedef struct dyop_joint {
  uint64_t number;
} dyop_joint;
typedef struct dyop_spring {
  uint64_t number;
} dyop_spring;

/* Values, which will not grow. */
typedef struct dyop_pose {
  double position[3];
  double rotation[4]; /* unit quaternion w, x, y, z */
} dyop_pose;
typedef struct dyop_twist {
  double v[3]; /* of the body's origin, in world */
  double w[3]; /* angular, in world */
} dyop_twist;
typedef struct dyop_state {
  dyop_pose pose;
  dyop_twist twist;
} dyop_state;
typedef struct dyop_wrench {
  double force[3];
  double torque[3]; /* about the center of mass */
} dyop_wrench;
typedef struct dyop_interval {
  double begin, end;
} dyop_interval;
typedef struct dyop_mass_properties {
  double mass;       /* > 0 */
  double center[3];  /* of mass, in the body's frame */
  double inertia[9]; /* about it, rows, in the body's axes */
} dyop_mass_properties;
/* Two bodies of one group collide always (> 0) or never (< 0); others if the category of each, a
 * bit set, has a bit of the other's mask. */
typedef struct dyop_collision_filter {
  uint64_t category, mask;
  int32_t group; /* 0: none */
  int32_t reserved;
} dyop_collision_filter;
typedef struct dyop_material {
  double restitution, friction;
  double rolling_friction, torsional_friction; /* lengths */
} dyop_material;

/* --- Context ---------------------------------------------------------------------------------- */

typedef enum dyop_log_level { DYOP_LOG_ERROR = 0 } dyop_log_level;

typedef struct dyop_context_options {
  uint32_t size;
  uint32_t reserved;
  void* user; /* passed to all hooks */
  /* Memory of the context: its tables, and the shapes, motions and worlds themselves, but not what
   * these hold inside. Both or neither; must not return less aligned memory than asked for. */
  void* (*allocate)(void* user, size_t size, size_t alignment);
  void (*deallocate)(void* user, void* memory, size_t size, size_t alignment);
  /* Called on each failure, one call at a time. What fails inside it is not logged. */
  void (*log)(void* user, dyop_log_level level, const char* message);
} dyop_context_options;

DYOP_C_API dyop_status dyop_context_create(const dyop_context_options* options,
                                           dyop_context** context);
/* Destroys all objects left in it. Null is legal. Inside a callback of one of its functions it is
 * refused: the log tells it, and the context lives on. */
DYOP_C_API void dyop_context_destroy(dyop_context* context);
/* Copies the text of the context's last failure, truncated to fit and always zero-terminated. */
DYOP_C_API dyop_status dyop_last_error(const dyop_context* context, char* text, size_t capacity);
DYOP_C_API const char* dyop_status_text(dyop_status status);
/* major * 10000 + minor * 100 + patch */
DYOP_C_API uint32_t dyop_version(void);
/* Sets what is called, in the whole process, when an assumption of dyop fails in builds that check
 * them; then the process aborts. Null prints to standard error. */
DYOP_C_API void dyop_set_assert_handler(void (*handler)(const char* message));

/* --- Shapes ----------------------------------------------------------------------------------- */

DYOP_C_API dyop_status dyop_sphere_create(dyop_context* context, double radius, dyop_shape* shape);
DYOP_C_API dyop_status dyop_box_create(dyop_context* context, const double half_extents[3],
                                       dyop_shape* shape);
/* About the z axis. */
DYOP_C_API dyop_status dyop_capsule_create(dyop_context* context, double radius, double half_length,
                                           dyop_shape* shape);
/* About the z axis; the tip of a cone at z = half_length. */
DYOP_C_API dyop_status dyop_cylinder_create(dyop_context* context, double radius,
                                            double half_length, dyop_shape* shape);
DYOP_C_API dyop_status dyop_cone_create(dyop_context* context, double radius, double half_length,
                                        dyop_shape* shape);
DYOP_C_API dyop_status dyop_ellipsoid_create(dyop_context* context, const double semi_axes[3],
                                             dyop_shape* shape);
/* All points within a radius of a box. */
DYOP_C_API dyop_status dyop_rounded_box_create(dyop_context* context, const double half_extents[3],
                                               double radius, dyop_shape* shape);
/* All points within an edge radius of a cylinder about the z axis. */
DYOP_C_API dyop_status dyop_rounded_cylinder_create(dyop_context* context, double radius,
                                                    double half_length, double edge_radius,
                                                    dyop_shape* shape);
/* Convex hull of a ball about z = -half_length and one about z = half_length. */
DYOP_C_API dyop_status dyop_tapered_capsule_create(dyop_context* context, double bottom_radius,
                                                   double top_radius, double half_length,
                                                   dyop_shape* shape);
/* All points within a radius of the convex hull of points, rows of three. */
DYOP_C_API dyop_status dyop_rounded_hull_create(dyop_context* context, const double* points,
                                                size_t point_count, double radius,
                                                dyop_shape* shape);
/* All points p with normal . p <= offset; its bodies are static or kinematic. */
DYOP_C_API dyop_status dyop_half_space_create(dyop_context* context, const double normal[3],
                                              double offset, dyop_shape* shape);
DYOP_C_API dyop_status dyop_hull_create(dyop_context* context, const double* points,
                                        size_t point_count, dyop_shape* shape);
/* Rows of three: coordinates, and vertex numbers. */
DYOP_C_API dyop_status dyop_mesh_create(dyop_context* context, const double* vertices,
                                        size_t vertex_count, const int32_t* triangles,
                                        size_t triangle_count, dyop_shape* shape);
/* Ground as a closed mesh: heights row by row, rows along y and columns along x from the origin,
 * and the height of its bottom, below all others. */
DYOP_C_API dyop_status dyop_height_field_create(dyop_context* context, const double* heights,
                                                size_t rows, size_t columns, double spacing_x,
                                                double spacing_y, double base, dyop_shape* shape);
/* The shape stretched along its axes by three factors, none of them zero; negative ones mirror it.
 * A sphere may become an ellipsoid. DYOP_INVALID_ARGUMENT if the shape does not take factors. */
DYOP_C_API dyop_status dyop_scaled_create(dyop_context* context, dyop_shape original,
                                          const double factors[3], dyop_shape* shape);
/* The same triangles with as many new vertices: a new shape at a fraction of the cost. */
DYOP_C_API dyop_status dyop_mesh_refit(dyop_context* context, dyop_shape mesh,
                                       const double* vertices, size_t vertex_count,
                                       dyop_shape* shape);
DYOP_C_API dyop_status dyop_compound_create(dyop_context* context, const dyop_shape* children,
                                            const dyop_pose* poses, size_t child_count,
                                            dyop_shape* shape);
/* Balls of one radius about points, rows of three; cubes by their centres, rows of three, and the
 * lengths of their edges. Each is a compound. */
DYOP_C_API dyop_status dyop_point_cloud_create(dyop_context* context, const double* points,
                                               size_t point_count, double radius,
                                               dyop_shape* shape);
DYOP_C_API dyop_status dyop_occupancy_create(dyop_context* context, const double* centers,
                                             const double* sizes, size_t cube_count,
                                             dyop_shape* shape);
/* Of a closed shape with a density: mass per volume. */
DYOP_C_API dyop_status dyop_shape_mass_properties(dyop_context* context, dyop_shape shape,
                                                  double density, dyop_mass_properties* properties);
DYOP_C_API dyop_status dyop_shape_destroy(dyop_context* context, dyop_shape shape);

/* --- Motions ---------------------------------------------------------------------------------- */

typedef struct dyop_twist_bound {
  double linear_speed, angular_speed, linear_acceleration, angular_acceleration;
} dyop_twist_bound;

/* A motion of the caller: docs/algorithms/motions.md says what it promises. Called from the threads
 * of queries; must not leave by longjmp or an exception. */
typedef struct dyop_motion_functions {
  uint32_t size;
  uint32_t reserved;
  void* user;
  void (*state)(void* user, double t, dyop_state* state);
  /* Upper bounds over the interval; infinity is legal. */
  void (*twist_bound)(void* user, dyop_interval interval, dyop_twist_bound* bound);
  dyop_interval domain;
} dyop_motion_functions;

DYOP_C_API dyop_status dyop_rest_create(dyop_context* context, const dyop_pose* pose,
                                        dyop_motion* motion);
DYOP_C_API dyop_status dyop_constant_twist_create(dyop_context* context, const dyop_state* state,
                                                  double time, dyop_motion* motion);
/* The origin linearly, the rotation along the shortest arc. */
DYOP_C_API dyop_status dyop_interpolated_create(dyop_context* context, dyop_interval interval,
                                                const dyop_pose* from, const dyop_pose* to,
                                                dyop_motion* motion);
/* Through poses at increasing times, as above in between. */
DYOP_C_API dyop_status dyop_sampled_create(dyop_context* context, const double* times,
                                           const dyop_pose* poses, size_t count,
                                           dyop_motion* motion);
DYOP_C_API dyop_status dyop_user_motion_create(dyop_context* context,
                                               const dyop_motion_functions* functions,
                                               dyop_motion* motion);
DYOP_C_API dyop_status dyop_motion_state(dyop_context* context, dyop_motion motion, double t,
                                         dyop_state* state);
DYOP_C_API dyop_status dyop_motion_destroy(dyop_context* context, dyop_motion motion);

/* --- Queries ---------------------------------------------------------------------------------- */

typedef enum dyop_distance_status {
  DYOP_DISTANCE_NOT_RUN = 0,
  DYOP_DISTANCE_SEPARATED = 1,
  DYOP_DISTANCE_OVERLAPPING = 2,
  DYOP_DISTANCE_FARTHER_THAN_MAX = 3,
  DYOP_DISTANCE_INCONCLUSIVE = 4
} dyop_distance_status;

typedef enum dyop_toi_status {
  DYOP_TOI_NOT_RUN = 0,
  DYOP_TOI_SEPARATED = 1,
  DYOP_TOI_IMPACT = 2,
  DYOP_TOI_INITIALLY_WITHIN_TARGET = 3,
  DYOP_TOI_BUDGET_EXHAUSTED = 4, /* undecided after t_safe: NOT a miss; so are the next two */
  DYOP_TOI_CANCELLED = 5,
  DYOP_TOI_NUMERICAL_LIMIT = 6
} dyop_toi_status;

/* Nearest points, with bounds of their distance: lower <= d <= upper. */
typedef struct dyop_witness {
  double lower, upper;
  double point_a[3], point_b[3];  /* world */
  double normal[3];               /* unit, from A to B */
  int32_t triangle_a, triangle_b; /* -1: not a mesh */
  int32_t child_a, child_b;       /* -1: not a compound */
} dyop_witness;

typedef struct dyop_distance_options {
  uint32_t size;
  uint8_t solid_a, solid_b; /* treat a closed mesh as a solid: 1 or 0 */
  uint8_t reserved[2];
  double max_distance;
  double absolute_tolerance, relative_tolerance;
} dyop_distance_options;

typedef struct dyop_distance_result {
  uint32_t size;
  int32_t status; /* dyop_distance_status */
  dyop_witness witness;
} dyop_distance_result;

typedef struct dyop_toi_options {
  uint32_t size;
  uint8_t solid_a, solid_b;
  uint8_t reserved[2];
  double target_distance;
  double distance_tolerance; /* 0: a millionth of the smaller shape's size */
  int64_t max_node_pairs;
} dyop_toi_options;

typedef struct dyop_toi_result {
  uint32_t size;
  int32_t status; /* dyop_toi_status */
  double t_safe;  /* proven apart up to here */
  double t_hit;   /* NaN: none was found */
  double rounding_allowance;
  double closing_speed;
  dyop_pose pose_a, pose_b; /* at t_safe */
  int32_t has_contact;      /* 1 if witness and closing_speed are set */
  int32_t reserved;
  dyop_witness witness;
  int64_t node_pairs;
} dyop_toi_result;

typedef struct dyop_distance_query {
  uint32_t size;
  uint32_t reserved;
  dyop_shape a, b;
  dyop_pose pose_a, pose_b;
} dyop_distance_query;

typedef struct dyop_toi_query {
  uint32_t size;
  uint32_t reserved;
  dyop_shape a, b;
  dyop_motion motion_a, motion_b;
  dyop_interval interval;
} dyop_toi_query;

typedef struct dyop_batch_options {
  uint32_t size;
  int32_t thread_count; /* 0: all */
  void* user;
  /* Called after each query, one call at a time; a nonzero value stops the batch. */
  int (*progress)(void* user, size_t done, size_t total);
} dyop_batch_options;

DYOP_C_API dyop_status dyop_compute_distance(dyop_context* context,
                                             const dyop_distance_query* query,
                                             const dyop_distance_options* options,
                                             dyop_distance_result* result);
DYOP_C_API dyop_status dyop_time_of_impact(dyop_context* context, const dyop_toi_query* query,
                                           const dyop_toi_options* options,
                                           dyop_toi_result* result);
/* Arrays of `count` structs, all of the size of the first. Nothing runs unless all queries are
 * legal; results are the same for every number of threads. */
DYOP_C_API dyop_status dyop_distance_batch(dyop_context* context,
                                           const dyop_distance_query* queries, size_t count,
                                           const dyop_distance_options* options,
                                           const dyop_batch_options* batch,
                                           dyop_distance_result* results);
DYOP_C_API dyop_status dyop_time_of_impact_batch(dyop_context* context,
                                                 const dyop_toi_query* queries, size_t count,
                                                 const dyop_toi_options* options,
                                                 const dyop_batch_options* batch,
                                                 dyop_toi_result* results);

/* The same within so many seconds, > 0: then it is undecided after t_safe. */
DYOP_C_API dyop_status dyop_time_of_impact_within(dyop_context* context,
                                                  const dyop_toi_query* query,
                                                  const dyop_toi_options* options, double seconds,
                                                  dyop_toi_result* result);
/* All places at most `max_distance` apart, nearest first; `capacity` and `count` as for
 * dyop_world_impacts. Solids are treated as surfaces. */
DYOP_C_API dyop_status dyop_find_contacts(dyop_context* context, const dyop_distance_query* query,
                                          double max_distance, dyop_witness* contacts,
                                          size_t capacity, size_t* count);

typedef struct dyop_point_result {
  uint32_t size;
  int32_t triangle;    /* -1: not a mesh */
  double lower, upper; /* of the distance */
  double point[3];     /* of the surface, nearest, in world */
  double normal[3];    /* unit, along which the distance grows */
} dyop_point_result;

/* Distance of points, rows of three, in world. `is_signed`: 1 counts it as negative inside a closed
 * shape. `results`: structs of the size of the first. */
DYOP_C_API dyop_status dyop_point_distance(dyop_context* context, dyop_shape shape,
                                           const dyop_pose* pose, int32_t is_signed,
                                           const double* points, size_t count,
                                           dyop_point_result* results);

/* --- Deforming meshes ------------------------------------------------------------------------- */

/* Vertices, rows of three in world, move on straight lines from `begin` to `end` over the interval
 * of each query. Queries may run in many threads at once; changes wait for them. */
DYOP_C_API dyop_status dyop_deforming_mesh_create(dyop_context* context, const double* begin,
                                                  const double* end, size_t vertex_count,
                                                  const int32_t* triangles, size_t triangle_count,
                                                  dyop_deforming_mesh* mesh);
/* Other places of as many vertices. */
DYOP_C_API dyop_status dyop_deforming_mesh_refit(dyop_context* context, dyop_deforming_mesh mesh,
                                                 const double* begin, const double* end,
                                                 size_t vertex_count);
DYOP_C_API dyop_status dyop_deforming_mesh_destroy(dyop_context* context, dyop_deforming_mesh mesh);
/* A is the deforming mesh, B a rigid mesh on a motion, or another deforming mesh. */
DYOP_C_API dyop_status dyop_deforming_time_of_impact(dyop_context* context, dyop_deforming_mesh a,
                                                     dyop_shape b, dyop_motion motion_b,
                                                     dyop_interval interval,
                                                     const dyop_toi_options* options,
                                                     dyop_toi_result* result);
DYOP_C_API dyop_status dyop_deforming_pair_time_of_impact(
    dyop_context* context, dyop_deforming_mesh a, dyop_deforming_mesh b, dyop_interval interval,
    const dyop_toi_options* options, dyop_toi_result* result);
/* Of surfaces, with A at a fraction of its interval, 0 to 1. */
DYOP_C_API dyop_status dyop_deforming_distance(dyop_context* context, dyop_deforming_mesh a,
                                               double fraction, dyop_shape b,
                                               const dyop_pose* pose_b, double max_distance,
                                               dyop_distance_result* result);

/* --- Obstacles -------------------------------------------------------------------------------- */

/* Many placed shapes, for queries of one body against all of them. Queries may run in many threads
 * at once; changes wait for them. */
DYOP_C_API dyop_status dyop_obstacle_set_create(dyop_context* context, dyop_obstacle_set* set);
DYOP_C_API dyop_status dyop_obstacle_set_destroy(dyop_context* context, dyop_obstacle_set set);
/* `groups`: a bit set; queries select by it. `is_solid`: 1 treats a closed mesh as a solid. */
DYOP_C_API dyop_status dyop_obstacle_add(dyop_context* context, dyop_obstacle_set set,
                                         dyop_shape shape, dyop_motion motion, uint32_t groups,
                                         int32_t is_solid, dyop_obstacle* obstacle);
/* Onto another motion. */
DYOP_C_API dyop_status dyop_obstacle_move(dyop_context* context, dyop_obstacle_set set,
                                          dyop_obstacle obstacle, dyop_motion motion);
DYOP_C_API dyop_status dyop_obstacle_remove(dyop_context* context, dyop_obstacle_set set,
                                            dyop_obstacle obstacle);
/* The first impact of a moving body; A is the body, B the obstacle (zero: none). */
DYOP_C_API dyop_status dyop_first_impact(dyop_context* context, dyop_obstacle_set set,
                                         dyop_shape body, dyop_motion motion,
                                         dyop_interval interval, uint32_t groups,
                                         const dyop_toi_options* options, dyop_toi_result* result,
                                         dyop_obstacle* obstacle);
/* The nearest obstacle at time t, likewise. */
DYOP_C_API dyop_status dyop_nearest_obstacle(dyop_context* context, dyop_obstacle_set set,
                                             dyop_shape body, const dyop_pose* pose, double t,
                                             uint32_t groups, const dyop_distance_options* options,
                                             dyop_distance_result* result, dyop_obstacle* obstacle);

/* --- Chains of links -------------------------------------------------------------------------- */

typedef enum dyop_chain_joint_type {
  DYOP_CHAIN_FIXED = 0,
  DYOP_CHAIN_REVOLUTE = 1,
  DYOP_CHAIN_PRISMATIC = 2
} dyop_chain_joint_type;

typedef struct dyop_chain_link {
  uint32_t size;
  uint32_t groups;  /* obstacles that share none are ignored for it */
  dyop_shape shape; /* zero: none */
  int32_t is_solid;
  int32_t reserved;
} dyop_chain_link;

typedef struct dyop_chain_joint {
  uint32_t size;
  int32_t type;          /* dyop_chain_joint_type */
  int32_t parent, child; /* numbers of links */
  dyop_pose origin;      /* of the joint in the parent's frame */
  double axis[3];        /* in the joint's frame */
  int32_t has_limits;    /* 1 if set below */
  int32_t reserved;
  double lower, upper; /* radians or length; queries accept paths beyond */
} dyop_chain_joint;

typedef enum dyop_path_kind { DYOP_PATH_LINEAR = 0, DYOP_PATH_CUBIC = 1 } dyop_path_kind;

typedef struct dyop_chain_result {
  uint32_t size;
  int32_t status; /* dyop_toi_status */
  double t_safe;  /* proven free up to here */
  double free_fraction;
  int32_t link_a, link_b; /* -1: none; link_b: in self-collision */
  dyop_obstacle obstacle; /* zero: none */
  int32_t has_contact;    /* 1 if witness is set */
  int32_t reserved;
  dyop_witness witness; /* A is link_a */
} dyop_chain_result;

/* Links and joints, in structs of the size of the first; one link, the root, is no joint's child. A
 * coordinate for each joint that is not fixed, in their order. */
DYOP_C_API dyop_status dyop_chain_create(dyop_context* context, const dyop_chain_link* links,
                                         size_t link_count, const dyop_chain_joint* joints,
                                         size_t joint_count, dyop_chain* chain);
DYOP_C_API dyop_status dyop_chain_destroy(dyop_context* context, dyop_chain chain);
/* Poses of all links at coordinates, one per joint that moves. */
DYOP_C_API dyop_status dyop_chain_poses(dyop_context* context, dyop_chain chain,
                                        const double* coordinates, size_t coordinate_count,
                                        dyop_pose* poses, size_t link_count);
/* Proves that a path is free of obstacles and of self-collision, or finds what is hit first.
 * `kind`: dyop_path_kind, what runs through the waypoints, which are rows of `coordinate_count`
 * numbers, one for each time. */
DYOP_C_API dyop_status dyop_certify(dyop_context* context, dyop_chain chain, int32_t kind,
                                    const double* times, const double* waypoints,
                                    size_t waypoint_count, size_t coordinate_count,
                                    dyop_obstacle_set obstacles, const dyop_toi_options* options,
                                    dyop_chain_result* result);

/* A path to keep; arguments as for dyop_certify. */
DYOP_C_API dyop_status dyop_joint_path_create(dyop_context* context, int32_t kind,
                                              const double* times, const double* waypoints,
                                              size_t waypoint_count, size_t coordinate_count,
                                              dyop_joint_path* path);
DYOP_C_API dyop_status dyop_joint_path_destroy(dyop_context* context, dyop_joint_path path);
DYOP_C_API dyop_status dyop_joint_path_domain(dyop_context* context, dyop_joint_path path,
                                              dyop_interval* domain, size_t* coordinate_count);
DYOP_C_API dyop_status dyop_joint_path_position(dyop_context* context, dyop_joint_path path,
                                                double t, double* coordinates,
                                                size_t coordinate_count);
/* dyop_certify for many paths of one chain on several threads. `groups`: of obstacles that count.
 * `results`: structs of the size of the first, one for each path. */
DYOP_C_API dyop_status dyop_certify_batch(
    dyop_context* context, dyop_chain chain, const dyop_joint_path* paths, size_t path_count,
    dyop_obstacle_set obstacles, uint32_t groups, int32_t with_self_collision,
    const dyop_toi_options* options, const dyop_batch_options* batch, dyop_chain_result* results);

/* --- Robots ----------------------------------------------------------------------------------- */

/* A chain and what a robot's files say beyond it: names, and joints that follow others. Its free
 * coordinates are those of the joints that follow none. Files: dyop_c_io.h. */
typedef struct dyop_robot_info {
  uint32_t size;
  uint32_t reserved;
  uint64_t link_count;
  uint64_t coordinate_count; /* of its chain */
  uint64_t free_count;       /* of its free coordinates */
} dyop_robot_info;

/* Of a chain whose joints are all independent. */
DYOP_C_API dyop_status dyop_robot_create(dyop_context* context, dyop_chain chain,
                                         dyop_robot* robot);
DYOP_C_API dyop_status dyop_robot_destroy(dyop_context* context, dyop_robot robot);
/* A new handle of its chain, for dyop_certify_batch and others. */
DYOP_C_API dyop_status dyop_robot_chain(dyop_context* context, dyop_robot robot, dyop_chain* chain);
DYOP_C_API dyop_status dyop_robot_describe(dyop_context* context, dyop_robot robot,
                                           dyop_robot_info* info);
/* Names of a link, and of the joint of a free coordinate, as for dyop_last_error. */
DYOP_C_API dyop_status dyop_robot_link_name(dyop_context* context, dyop_robot robot, size_t link,
                                            char* text, size_t capacity);
DYOP_C_API dyop_status dyop_robot_joint_name(dyop_context* context, dyop_robot robot,
                                             size_t free_coordinate, char* text, size_t capacity);
/* Of the free coordinates and all that mimic them; infinite where there is none. */
DYOP_C_API dyop_status dyop_robot_limits(dyop_context* context, dyop_robot robot, double* lower,
                                         double* upper, size_t free_count);
/* The coordinates of its chain, and the path of them, at free ones. */
DYOP_C_API dyop_status dyop_robot_expand(dyop_context* context, dyop_robot robot,
                                         const double* free_coordinates, size_t free_count,
                                         double* coordinates, size_t coordinate_count);
DYOP_C_API dyop_status dyop_robot_expand_path(dyop_context* context, dyop_robot robot,
                                              dyop_joint_path free_path, dyop_joint_path* path);
/* The robot that holds an object, in the frame of a link; it may touch that link and
 * `touch_links`. */
DYOP_C_API dyop_status dyop_robot_attach(dyop_context* context, dyop_robot robot, const char* name,
                                         dyop_shape shape, size_t link, const dyop_pose* pose,
                                         const size_t* touch_links, size_t touch_count,
                                         dyop_robot* holding);

typedef enum dyop_pair_verdict {
  DYOP_PAIR_NEVER = 0,    /* proven: apart at all joint values */
  DYOP_PAIR_ALWAYS = 1,   /* proven: they touch at all joint values */
  DYOP_PAIR_CAN = 2,      /* they touch at the witness */
  DYOP_PAIR_UNDECIDED = 3 /* neither */
} dyop_pair_verdict;

typedef struct dyop_link_pair_options {
  uint32_t size;
  int32_t samples;   /* joint values to try per pair before the long search, >= 0 */
  int64_t max_boxes; /* boxes of joint values to examine per pair, >= 1 */
  double seconds;    /* after which the pairs that are left stay undecided; 0: no limit */
} dyop_link_pair_options;

typedef struct dyop_link_pair {
  uint32_t size;
  int32_t verdict;       /* dyop_pair_verdict */
  int32_t first, second; /* numbers of links */
  int32_t is_adjacent;   /* joined directly, or through links without shapes */
  int32_t has_witness;
  double touching_share;  /* of the sampled joint values */
  double undecided_share; /* of the box of joint values */
} dyop_link_pair;

/* Decides for every pair of links with shapes whether they can touch within the limits of the
 * joints; `capacity` and `count` as for dyop_world_impacts. `witnesses`: null, or for each pair
 * that is written a row of the robot's free coordinates, set if has_witness. */
DYOP_C_API dyop_status dyop_decide_link_pairs(dyop_context* context, dyop_robot robot,
                                              const dyop_link_pair_options* options,
                                              dyop_link_pair* pairs, size_t capacity, size_t* count,
                                              double* witnesses);

/* --- World ------------------------------------------------------------------------------------ */

typedef enum dyop_body_kind {
  DYOP_DYNAMIC = 0,
  DYOP_KINEMATIC = 1,
  DYOP_STATIC = 2
} dyop_body_kind;

typedef enum dyop_impact_policy {
  DYOP_IMPACT_STOP = 0,
  DYOP_IMPACT_IMPULSE = 1
} dyop_impact_policy;

/* How a coefficient of a pair follows from those of its bodies. */
typedef enum dyop_combine_rule {
  DYOP_COMBINE_GEOMETRIC_MEAN = 0,
  DYOP_COMBINE_MEAN = 1,
  DYOP_COMBINE_PRODUCT = 2,
  DYOP_COMBINE_MINIMUM = 3,
  DYOP_COMBINE_MAXIMUM = 4
} dyop_combine_rule;

typedef enum dyop_advance_status {
  DYOP_ADVANCE_NOT_RUN = 0,
  DYOP_ADVANCE_COMPLETED = 1,
  DYOP_ADVANCE_STOPPED_AT_IMPACT = 2,
  DYOP_ADVANCE_BUDGET_EXHAUSTED = 3,
  DYOP_ADVANCE_NUMERICAL_LIMIT = 4,
  DYOP_ADVANCE_BLOCKED = 5,
  DYOP_ADVANCE_CANCELLED = 6
} dyop_advance_status;

typedef struct dyop_world_options {
  uint32_t size;
  int32_t policy; /* dyop_impact_policy */
  double gravity[3];
  double max_step;        /* 0: one step per call of advance */
  double target_distance; /* kept, by proof; negative: the default, 1e-4 of the smaller size */
  int32_t thread_count;   /* 0: all; never changes the result */
  int32_t reserved;
  void* user;
  void (*on_step)(void* user, double t); /* after each committed step; must not change the world */
  int32_t combine_friction, combine_restitution; /* dyop_combine_rule */
  double rest_offset;       /* bodies rest so far above the target; 0: the default, 4 targets */
  double restitution_speed; /* slower approaches do not bounce; negative: the default */
  double sleep_speed;       /* slower bodies may fall asleep; negative: the default */
  int32_t sleep_steps;      /* after so many slow steps; 0: never */
  int32_t reserved_too;
} dyop_world_options;

/* Force and torque on a body, in world. */
typedef void (*dyop_wrench_callback)(void* user, double t, const dyop_state* state,
                                     dyop_wrench* wrench);

typedef struct dyop_body_definition {
  uint32_t size;
  int32_t kind; /* dyop_body_kind */
  dyop_shape shape;
  dyop_state initial; /* dynamic, static */
  double density;     /* dynamic: mass per volume, of a closed shape */
  dyop_motion motion; /* kinematic */
  double restitution, friction;
  void* user;
  dyop_wrench_callback wrench;                 /* dynamic, may be null */
  double rolling_friction, torsional_friction; /* lengths */
  dyop_collision_filter filter;
  int32_t is_sensor; /* 1: feels and gives no contact force */
  int32_t reserved;
} dyop_body_definition;

typedef struct dyop_advance_report {
  uint32_t size;
  int32_t status; /* dyop_advance_status */
  double t;       /* the world's time now */
  int64_t steps;
  uint64_t impact_count; /* of dyop_world_impacts */
} dyop_advance_report;

typedef struct dyop_impact {
  uint32_t size;
  uint32_t reserved;
  double t;
  dyop_body a, b; /* the first pair to meet */
  dyop_witness witness;
  double closing_speed;
} dyop_impact;

typedef struct dyop_contact {
  uint32_t size;
  uint32_t reserved;
  dyop_body a, b;
  double point_a[3], point_b[3]; /* world */
  double normal[3];              /* unit, from A to B */
  double gap;
  double impulse[3]; /* on B over the last step, world */
} dyop_contact;

DYOP_C_API dyop_status dyop_world_create(dyop_context* context, const dyop_world_options* options,
                                         dyop_world* world);
DYOP_C_API dyop_status dyop_world_destroy(dyop_context* context, dyop_world world);
DYOP_C_API dyop_status dyop_world_add_body(dyop_context* context, dyop_world world,
                                           const dyop_body_definition* definition, dyop_body* body);
DYOP_C_API dyop_status dyop_world_remove_body(dyop_context* context, dyop_world world,
                                              dyop_body body);
DYOP_C_API dyop_status dyop_world_set_state(dyop_context* context, dyop_world world, dyop_body body,
                                            const dyop_state* state);
DYOP_C_API dyop_status dyop_world_set_motion(dyop_context* context, dyop_world world,
                                             dyop_body body, dyop_motion motion);
DYOP_C_API dyop_status dyop_world_set_pair_enabled(dyop_context* context, dyop_world world,
                                                   dyop_body a, dyop_body b, int32_t is_enabled);
/* The states of `count` bodies, in the order of the array. */
DYOP_C_API dyop_status dyop_world_states(dyop_context* context, dyop_world world,
                                         const dyop_body* bodies, size_t count, dyop_state* states);
DYOP_C_API dyop_status dyop_world_advance(dyop_context* context, dyop_world world, double dt,
                                          dyop_advance_report* report);
/* What the last advance met, and what touches now. `count` is the number there are; at most
 * `capacity` are written, in structs of the size of the first. A capacity of 0 only counts. */
DYOP_C_API dyop_status dyop_world_impacts(dyop_context* context, dyop_world world,
                                          dyop_impact* impacts, size_t capacity, size_t* count);
DYOP_C_API dyop_status dyop_world_contacts(dyop_context* context, dyop_world world,
                                           dyop_contact* contacts, size_t capacity, size_t* count);

/* advance within so many seconds, > 0: what is proven by then is committed. */
DYOP_C_API dyop_status dyop_world_advance_within(dyop_context* context, dyop_world world, double dt,
                                                 double seconds, dyop_advance_report* report);
DYOP_C_API dyop_status dyop_world_set_gravity(dyop_context* context, dyop_world world,
                                              const double gravity[3]);
DYOP_C_API dyop_status dyop_world_set_material(dyop_context* context, dyop_world world,
                                               dyop_body body, double restitution, double friction);
DYOP_C_API dyop_status dyop_world_set_wrench(dyop_context* context, dyop_world world,
                                             dyop_body body, dyop_wrench_callback wrench,
                                             void* user);
DYOP_C_API dyop_status dyop_world_set_target_distance(dyop_context* context, dyop_world world,
                                                      dyop_body a, dyop_body b,
                                                      double target_distance);
/* A disabled body stays where it is; nothing collides with it. */
DYOP_C_API dyop_status dyop_world_set_body_enabled(dyop_context* context, dyop_world world,
                                                   dyop_body body, int32_t is_enabled);
/* A kinematic body moves there until the time t, then rests. */
DYOP_C_API dyop_status dyop_world_set_next_pose(dyop_context* context, dyop_world world,
                                                dyop_body body, const dyop_pose* pose, double t);
DYOP_C_API dyop_status dyop_world_wake(dyop_context* context, dyop_world world, dyop_body body);
DYOP_C_API dyop_status dyop_world_is_asleep(dyop_context* context, dyop_world world, dyop_body body,
                                            int32_t* is_asleep);

typedef enum dyop_joint_kind {
  DYOP_JOINT_BALL = 0,
  DYOP_JOINT_HINGE = 1,
  DYOP_JOINT_SLIDER = 2,
  DYOP_JOINT_FIXED = 3,
  DYOP_JOINT_DISTANCE = 4, /* with limits {0, L}: a rope */
  DYOP_JOINT_UNIVERSAL = 5,
  DYOP_JOINT_CYLINDRICAL = 6,
  DYOP_JOINT_COUPLING = 7 /* of two joints: gears, rack, screw, pulley */
} dyop_joint_kind;

/* Drives a hinge, a slider or a cylindrical joint's angle. Without gains it gives what it takes to
 * have the speed; with gains stiffness (position - q) + damping (speed - q'). */
typedef struct dyop_joint_motor {
  double speed;
  double strength;  /* largest torque or force, > 0; may be infinite with gains */
  double position;  /* counts if there is a stiffness */
  double stiffness; /* torque per radian or force per length, >= 0 */
  double damping;   /* torque or force per speed, >= 0 */
} dyop_joint_motor;

typedef struct dyop_joint_definition {
  uint32_t size;
  int32_t kind;                  /* dyop_joint_kind */
  dyop_body a, b;                /* not of a coupling */
  dyop_pose pose_a, pose_b;      /* of the joint's frame in each body's */
  int32_t has_limits, has_motor; /* 1 if set below */
  double limit_min, limit_max;   /* radians or length; of a coupling the sum */
  dyop_joint_motor motor;
  int32_t bodies_collide;  /* 0: the pair is not examined while joined */
  int32_t has_swing_twist; /* ball: 1 if set below; radians */
  double swing, twist_min, twist_max;
  double friction, damping;         /* of what a motor would drive; torque or force, per speed */
  double break_force, break_torque; /* above it breaks; infinite: never */
  dyop_joint first, second;         /* coupling: first's coordinate + ratio times second's */
  double ratio;
} dyop_joint_definition;

/* Where a joint is, how it moves and what it bears: force and torque on b, about the joint's frame
 * there, world axes, their mean over the last step. */
typedef struct dyop_joint_values {
  uint32_t size;
  int32_t reserved;
  double angle, angle_rate;         /* about z of the frame on a; turns are counted */
  double second_angle, second_rate; /* universal: about y of the frame on b */
  double swing;                     /* ball: between the z axes */
  double position, position_rate;   /* along z; the distance; the sum of a coupling */
  double separation;                /* of the places that are held together, length */
  double force[3], torque[3];
  double drive; /* the part that motor, friction and damping gave */
} dyop_joint_values;

typedef struct dyop_spring_definition {
  uint32_t size;
  int32_t reserved;
  dyop_body a, b;
  double point_a[3], point_b[3]; /* in each body's frame */
  double rest_length;            /* negative: the distance now */
  double stiffness, damping;
} dyop_spring_definition;

DYOP_C_API dyop_status dyop_world_add_joint(dyop_context* context, dyop_world world,
                                            const dyop_joint_definition* definition,
                                            dyop_joint* joint);
DYOP_C_API dyop_status dyop_world_remove_joint(dyop_context* context, dyop_world world,
                                               dyop_joint joint);
/* Null: none. */
DYOP_C_API dyop_status dyop_world_set_motor(dyop_context* context, dyop_world world,
                                            dyop_joint joint, const dyop_joint_motor* motor);
DYOP_C_API dyop_status dyop_world_joint_values(dyop_context* context, dyop_world world,
                                               dyop_joint joint, dyop_joint_values* values);
DYOP_C_API dyop_status dyop_world_add_spring(dyop_context* context, dyop_world world,
                                             const dyop_spring_definition* definition,
                                             dyop_spring* spring);
DYOP_C_API dyop_status dyop_world_remove_spring(dyop_context* context, dyop_world world,
                                                dyop_spring spring);
/* All that determines what the world will do; restored into the same world. */
DYOP_C_API dyop_status dyop_world_snapshot(dyop_context* context, dyop_world world,
                                           dyop_snapshot* snapshot);
DYOP_C_API dyop_status dyop_world_restore(dyop_context* context, dyop_world world,
                                          dyop_snapshot snapshot);
DYOP_C_API dyop_status dyop_snapshot_destroy(dyop_context* context, dyop_snapshot snapshot);

/* Changes a dynamic body's momentum at once, through a point in world; null: its center of mass. */
DYOP_C_API dyop_status dyop_world_apply_impulse(dyop_context* context, dyop_world world,
                                                dyop_body body, const double impulse[3],
                                                const double point[3]);
DYOP_C_API dyop_status dyop_world_apply_angular_impulse(dyop_context* context, dyop_world world,
                                                        dyop_body body,
                                                        const double angular_impulse[3]);
/* Pose and twist stay: the momentum changes. */
DYOP_C_API dyop_status dyop_world_set_mass_properties(dyop_context* context, dyop_world world,
                                                      dyop_body body,
                                                      const dyop_mass_properties* properties);
/* In the same frame; mass properties stay. */
DYOP_C_API dyop_status dyop_world_set_shape(dyop_context* context, dyop_world world, dyop_body body,
                                            dyop_shape shape);
DYOP_C_API dyop_status dyop_world_set_filter(dyop_context* context, dyop_world world,
                                             dyop_body body, const dyop_collision_filter* filter);
/* Of one pair; null: again what follows from its bodies. */
DYOP_C_API dyop_status dyop_world_set_pair_material(dyop_context* context, dyop_world world,
                                                    dyop_body a, dyop_body b,
                                                    const dyop_material* material);
DYOP_C_API dyop_status dyop_world_pair_material(dyop_context* context, dyop_world world,
                                                dyop_body a, dyop_body b, dyop_material* material);

/* Two bodies begin to touch or cease to; a body begins or ceases to overlap a sensor, a. */
typedef struct dyop_touch_event {
  uint32_t size;
  int32_t is_begin;
  dyop_body a, b;
  double t;
} dyop_touch_event;

typedef struct dyop_broken_joint {
  uint32_t size;
  uint32_t reserved;
  dyop_joint joint; /* that is no more */
  dyop_body a, b;
  double t;
  double force, torque; /* mean over the step */
} dyop_broken_joint;

/* Of the last advance; `capacity` and `count` as for dyop_world_impacts. */
DYOP_C_API dyop_status dyop_world_contact_events(dyop_context* context, dyop_world world,
                                                 dyop_touch_event* events, size_t capacity,
                                                 size_t* count);
DYOP_C_API dyop_status dyop_world_sensor_events(dyop_context* context, dyop_world world,
                                                dyop_touch_event* events, size_t capacity,
                                                size_t* count);
DYOP_C_API dyop_status dyop_world_broken_joints(dyop_context* context, dyop_world world,
                                                dyop_broken_joint* joints, size_t capacity,
                                                size_t* count);

/* Which bodies a query considers: enabled ones whose category has a bit of `mask` and whose mask
 * has one of `category`. */
typedef struct dyop_body_filter {
  uint32_t size;
  int32_t includes_sensors;
  uint64_t mask, category;
  void* user;
  /* Null: all. Leaves bodies out for which it gives 0; may read the world, not change it. */
  int (*accepts)(void* user, dyop_body body);
} dyop_body_filter;

typedef struct dyop_body_ray_hit {
  uint32_t size;
  int32_t status;   /* dyop_toi_status: impact, separated; others: undecided beyond `distance` */
  dyop_body body;   /* zero: none */
  double distance;  /* proven free up to here */
  double point[3];  /* impact: on the body, in world */
  double normal[3]; /* impact: against the ray, unit */
  int32_t triangle; /* -1: not a mesh */
  int32_t reserved;
} dyop_body_ray_hit;

/* Of the bodies as they stand, also in on_step. Closed meshes count as solids. A null filter is
 * none; `body` is zero if there is none. */
DYOP_C_API dyop_status dyop_world_cast_ray(dyop_context* context, dyop_world world,
                                           const double origin[3], const double direction[3],
                                           double length, const dyop_body_filter* filter,
                                           dyop_body_ray_hit* hit);
/* What a shape on a motion meets first. */
DYOP_C_API dyop_status dyop_world_cast_shape(dyop_context* context, dyop_world world,
                                             dyop_shape shape, dyop_motion motion,
                                             dyop_interval interval,
                                             const dyop_toi_options* options,
                                             const dyop_body_filter* filter,
                                             dyop_toi_result* result, dyop_body* body);
DYOP_C_API dyop_status dyop_world_nearest(dyop_context* context, dyop_world world, dyop_shape shape,
                                          const dyop_pose* pose,
                                          const dyop_distance_options* options,
                                          const dyop_body_filter* filter,
                                          dyop_distance_result* result, dyop_body* body);
/* All at most `max_distance` away, 0 for those that it touches: the first `proven` of them are; of
 * the others rounding does not tell. */
DYOP_C_API dyop_status dyop_world_overlaps(dyop_context* context, dyop_world world,
                                           dyop_shape shape, const dyop_pose* pose,
                                           double max_distance, const dyop_body_filter* filter,
                                           dyop_body* bodies, size_t capacity, size_t* count,
                                           size_t* proven);

/* --- Haptic tools ----------------------------------------------------------------------------- */

/* docs/haptics.md: a tool that follows a device as far as its path is proven free. */
typedef enum dyop_obstacle_role {
  DYOP_TISSUE = 0,      /* touched, with friction */
  DYOP_HARD_REGION = 1, /* the tool stays at least the margin away */
  DYOP_SOFT_REGION = 2, /* a force pushes back from the margin inwards */
  DYOP_MONITOR = 3      /* only the clearance is reported */
} dyop_obstacle_role;

typedef enum dyop_haptic_status {
  DYOP_HAPTIC_NOT_RUN = 0,
  DYOP_HAPTIC_FREE = 1,          /* the tool is where the device is */
  DYOP_HAPTIC_HELD = 2,          /* as near to it as contacts and regions allow */
  DYOP_HAPTIC_BLOCKED = 3,       /* stopped short by a limit of the tick */
  DYOP_HAPTIC_DEADLINE = 4,      /* the same, by the deadline or max_work */
  DYOP_HAPTIC_TRAPPED = 5,       /* tissue closes in from all sides: it was stopped too */
  DYOP_HAPTIC_RECOVERING = 6,    /* something was nearer than it may be, and is being left */
  DYOP_HAPTIC_OVERLAPPING = 7,   /* something crosses the tool: not proven, and is being left */
  DYOP_HAPTIC_INVALID_INPUT = 8, /* the tool stays, no wrench */
  DYOP_HAPTIC_OUTLIER = 9        /* no hand moves that fast: the last pose counts */
} dyop_haptic_status;

typedef enum dyop_tool_contact_state {
  DYOP_TOOL_CONTACT_OPEN = 0, /* near, without force */
  DYOP_TOOL_CONTACT_STICK = 1,
  DYOP_TOOL_CONTACT_SLIP = 2
} dyop_tool_contact_state;

/* A jaw turns about the z axis of a frame in the tool's. */
typedef struct dyop_tool_hinge {
  uint32_t size;
  uint32_t reserved;
  dyop_pose pose;
  double angle;     /* at the start, radians */
  double stiffness; /* torque per radian, > 0 */
} dyop_tool_hinge;

typedef struct dyop_tool_part {
  uint32_t size;
  int32_t hinge; /* number of its hinge; -1: fixed to the tool's frame */
  dyop_shape shape;
  dyop_pose pose; /* in the tool's frame while its hinge is at angle 0 */
} dyop_tool_part;

typedef struct dyop_tool_obstacle {
  uint32_t size;
  int32_t role; /* dyop_obstacle_role */
  dyop_shape shape;
  dyop_pose pose;
  int32_t is_deforming; /* 1: a mesh whose vertices start there and move by snapshots */
  int32_t reserved;
  double margin;         /* length, >= 0 */
  double friction;       /* tissue */
  double soft_stiffness; /* soft region: force per length */
} dyop_tool_obstacle;

/* Spring and damper between device and tool, per axis of the world. A value: it will not grow. */
typedef struct dyop_coupling {
  double stiffness[3], damping[3];                       /* force per length, per velocity */
  double rotational_stiffness[3], rotational_damping[3]; /* torque per radian, per rate */
  double largest_force, largest_torque;                  /* > 0, may be infinite */
  double device_damping, device_rotational_damping;
  double period; /* of the loop, seconds */
  int32_t bounds_energy;
  int32_t reserved;
} dyop_coupling;

typedef struct dyop_haptic_options {
  uint32_t size;
  int32_t max_rounds, max_attempts, max_contacts;
  double rest_offset;    /* gap of resting contacts, > 0 */
  double recovery_speed; /* at which the tool leaves what it starts in, > 0 */
  double clearance_tolerance;
  int32_t clearance_work;
  int32_t has_trocar; /* 1: the shaft passes a point */
  int64_t max_work;
  double largest_device_speed;
  dyop_coupling coupling;
  double trocar_point[3];               /* in world */
  double shaft_point[3], shaft_axis[3]; /* in the tool's frame */
} dyop_haptic_options;

/* One of several tools. Its parts and hinges are so many of the lists, after those of the tools
 * before it. */
typedef struct dyop_haptic_tool {
  uint32_t size;
  int32_t has_trocar;
  uint64_t part_count, hinge_count;
  dyop_pose start;
  int32_t has_coupling; /* 1: springs of its own, not those of the options */
  int32_t reserved;
  dyop_coupling coupling;
  double trocar_point[3];               /* in world */
  double shaft_point[3], shaft_axis[3]; /* in the tool's frame */
} dyop_haptic_tool;

/* What a device gives. A value. */
typedef struct dyop_device_pose {
  dyop_pose pose;
  double angles[4]; /* requested of the hinges */
} dyop_device_pose;

typedef struct dyop_haptic_tick {
  uint32_t size;
  int32_t status; /* dyop_haptic_status */
  dyop_pose tool;
  double angles[4];
  double force[3], torque[3]; /* on the hand, about the device's origin */
  double energy_returned;
  double tissue_stopped, tissue_lag; /* seconds */
  double time;                       /* at the end of the tick */
  double latency;                    /* of the call, seconds */
} dyop_haptic_tick;

/* A place where the tool is held back. */
typedef struct dyop_tool_contact {
  uint32_t size;
  int32_t obstacle; /* number of it */
  int32_t part;     /* 0: all fixed parts; then one per hinge */
  int32_t state;    /* dyop_tool_contact_state */
  double point[3];  /* on the tool, in world */
  double normal[3]; /* unit, from the obstacle to the tool */
  double gap;
  double force[3];          /* on the tool */
  double obstacle_point[3]; /* on the obstacle */
  int32_t triangle;         /* of a deforming mesh; -1: rigid */
  int32_t reserved;
  double weights[3]; /* of the triangle's corners in that point */
} dyop_tool_contact;

typedef struct dyop_tool_impulse {
  uint32_t size;
  int32_t obstacle;
  double obstacle_point[3];
  double impulse[3]; /* on the tool; the obstacle takes the opposite */
  int32_t triangle;  /* of a deforming mesh; -1: rigid */
  int32_t reserved;
  double weights[3];
} dyop_tool_impulse;

typedef struct dyop_tool_clearance {
  uint32_t size;
  int32_t is_breached; /* 1: upper is below the margin */
  double lower, upper; /* of the distance from one obstacle */
  double tool_point[3], obstacle_point[3];
  double time_to_breach; /* at least, at these velocities */
} dyop_tool_clearance;

/* `parts`, `hinges`, `obstacles`: structs of the size of the first; at most four hinges. */
DYOP_C_API dyop_status dyop_haptic_session_create(dyop_context* context,
                                                  const dyop_tool_part* parts, size_t part_count,
                                                  const dyop_tool_hinge* hinges, size_t hinge_count,
                                                  const dyop_tool_obstacle* obstacles,
                                                  size_t obstacle_count, const dyop_pose* start,
                                                  const dyop_haptic_options* options,
                                                  dyop_haptic_session* session);
DYOP_C_API dyop_status dyop_haptic_session_destroy(dyop_context* context,
                                                   dyop_haptic_session session);
/* One tick: follows the device to its new pose during dt, >= 0. What a device may do, jumps and
 * NaN, ends in a status of the tick. `seconds`: deadline; 0: none. From one thread, which also
 * calls what follows up to dyop_haptic_reset. */
DYOP_C_API dyop_status dyop_haptic_update(dyop_context* context, dyop_haptic_session session,
                                          const dyop_device_pose* device, double dt, double seconds,
                                          dyop_haptic_tick* tick);
/* Of the last tick; `capacity` and `count` as for dyop_world_impacts. Impulses are those of the
 * whole tick. */
DYOP_C_API dyop_status dyop_haptic_contacts(dyop_context* context, dyop_haptic_session session,
                                            dyop_tool_contact* contacts, size_t capacity,
                                            size_t* count);
DYOP_C_API dyop_status dyop_haptic_impulses(dyop_context* context, dyop_haptic_session session,
                                            dyop_tool_impulse* impulses, size_t capacity,
                                            size_t* count);
/* One for each obstacle. */
DYOP_C_API dyop_status dyop_haptic_clearances(dyop_context* context, dyop_haptic_session session,
                                              dyop_tool_clearance* clearances, size_t capacity,
                                              size_t* count);
/* Other springs, without giving energy to the hand. */
DYOP_C_API dyop_status dyop_haptic_set_coupling(dyop_context* context, dyop_haptic_session session,
                                                const dyop_coupling* coupling);
/* Puts the tool elsewhere, as when it is exchanged; nothing is proven in between. */
DYOP_C_API dyop_status dyop_haptic_reset(dyop_context* context, dyop_haptic_session session,
                                         const dyop_device_pose* tool);

/* Several tools, at most four, that move at once and are proven against each other; tool_margin,
 * length, and tool_friction, Coulomb's, are between them. The options must have no trocar. */
DYOP_C_API dyop_status dyop_haptic_session_create_tools(
    dyop_context* context, const dyop_haptic_tool* tools, size_t tool_count,
    const dyop_tool_part* parts, size_t part_count, const dyop_tool_hinge* hinges,
    size_t hinge_count, const dyop_tool_obstacle* obstacles, size_t obstacle_count,
    double tool_margin, double tool_friction, const dyop_haptic_options* options,
    dyop_haptic_session* session);
/* One tick: a device and a tick for each tool. */
DYOP_C_API dyop_status dyop_haptic_update_tools(dyop_context* context, dyop_haptic_session session,
                                                const dyop_device_pose* devices,
                                                size_t device_count, double dt, double seconds,
                                                dyop_haptic_tick* ticks);
/* The functions above are about the first tool; these about any. */
DYOP_C_API dyop_status dyop_haptic_contacts_of(dyop_context* context, dyop_haptic_session session,
                                               size_t tool, dyop_tool_contact* contacts,
                                               size_t capacity, size_t* count);
DYOP_C_API dyop_status dyop_haptic_impulses_of(dyop_context* context, dyop_haptic_session session,
                                               size_t tool, dyop_tool_impulse* impulses,
                                               size_t capacity, size_t* count);
DYOP_C_API dyop_status dyop_haptic_clearances_of(dyop_context* context, dyop_haptic_session session,
                                                 size_t tool, dyop_tool_clearance* clearances,
                                                 size_t capacity, size_t* count);
/* With the other tools: `obstacle` is the number of the other one. Clearances: one for each tool,
 * of which its own is infinite; none where there is one tool. */
DYOP_C_API dyop_status dyop_haptic_tool_contacts(dyop_context* context, dyop_haptic_session session,
                                                 size_t tool, dyop_tool_contact* contacts,
                                                 size_t capacity, size_t* count);
DYOP_C_API dyop_status dyop_haptic_tool_clearances(dyop_context* context,
                                                   dyop_haptic_session session, size_t tool,
                                                   dyop_tool_clearance* clearances, size_t capacity,
                                                   size_t* count);
DYOP_C_API dyop_status dyop_haptic_set_coupling_of(dyop_context* context,
                                                   dyop_haptic_session session, size_t tool,
                                                   const dyop_coupling* coupling);
DYOP_C_API dyop_status dyop_haptic_reset_of(dyop_context* context, dyop_haptic_session session,
                                            size_t tool, const dyop_device_pose* pose);

/* The vertices, rows of three, that a deforming obstacle shall reach so many seconds after those
 * given before; or another mesh, as after a cut. From one thread, which may be another one.
 * `is_taken`: 0 if the obstacle has not yet started on the last ones; then nothing happens. */
DYOP_C_API dyop_status dyop_haptic_give_snapshot(dyop_context* context, dyop_haptic_session session,
                                                 size_t obstacle, const double* vertices,
                                                 size_t vertex_count, double seconds,
                                                 int32_t* is_taken);
DYOP_C_API dyop_status dyop_haptic_give_mesh(dyop_context* context, dyop_haptic_session session,
                                             size_t obstacle, const double* vertices,
                                             size_t vertex_count, const int32_t* triangles,
                                             size_t triangle_count, int32_t* is_taken);

/* As dyop_haptic_give_snapshot, but the obstacle sets out from where it is, in place of what was
 * given before and not yet started on; it goes on for `lead` seconds first. `is_taken`: 0 if a tick
 * is just about to start on what was given before, or no tick has taken notice yet: call it again.
 */
DYOP_C_API dyop_status dyop_haptic_retarget(dyop_context* context, dyop_haptic_session session,
                                            size_t obstacle, const double* vertices,
                                            size_t vertex_count, double seconds, double lead,
                                            int32_t* is_taken);

/* --- Defaults --------------------------------------------------------------------------------- */

/* clang-format off */
#define DYOP_POSE_IDENTITY {{0, 0, 0}, {1, 0, 0, 0}}
#define DYOP_BODY_DEFINITION_INIT \
  {sizeof(dyop_body_definition), DYOP_DYNAMIC, {0, 0}, {DYOP_POSE_IDENTITY, {{0, 0, 0}, {0, \
   0, 0}}}, 1000, {0, 0}, 0.5, 0.5, NULL, NULL, 0, 0, {1, 0xFFFFFFFFFFFFFFFFu, 0, 0}, 0, 0}
#define DYOP_CONTEXT_OPTIONS_INIT {sizeof(dyop_context_options), 0, NULL, NULL, NULL, NULL}
#define DYOP_MOTION_FUNCTIONS_INIT {sizeof(dyop_motion_functions), 0, NULL, NULL, NULL, {0, 0}}
#define DYOP_DISTANCE_OPTIONS_INIT {sizeof(dyop_distance_options), 0, 0, {0, 0}, HUGE_VAL, 0, 0}
#define DYOP_TOI_OPTIONS_INIT {sizeof(dyop_toi_options), 0, 0, {0, 0}, 0, 0, 10000000}
#define DYOP_BATCH_OPTIONS_INIT {sizeof(dyop_batch_options), 0, NULL, NULL}
#define DYOP_WORLD_OPTIONS_INIT \
  {sizeof(dyop_world_options), DYOP_IMPACT_IMPULSE, {0, 0, 0}, 0, -1, 0, 0, NULL, NULL, \
   DYOP_COMBINE_GEOMETRIC_MEAN, DYOP_COMBINE_MINIMUM, 0, -1, -1, 50, 0}
#define DYOP_CHAIN_LINK_INIT {sizeof(dyop_chain_link), 0xFFFFFFFFu, {0, 0}, 0, 0}
#define DYOP_CHAIN_JOINT_INIT \
  {sizeof(dyop_chain_joint), DYOP_CHAIN_REVOLUTE, 0, 0, DYOP_POSE_IDENTITY, {0, 0, 1}, \
   0, 0, 0, 0}
#define DYOP_JOINT_DEFINITION_INIT \
  {sizeof(dyop_joint_definition), DYOP_JOINT_BALL, {0, 0}, {0, 0}, DYOP_POSE_IDENTITY, \
   DYOP_POSE_IDENTITY, 0, 0, 0, 0, {0, 0, 0, 0, 0}, 0, 0, 1.5707963267948966, \
   -3.1415926535897931, 3.1415926535897931, 0, 0, HUGE_VAL, HUGE_VAL, {0}, {0}, 1}
#define DYOP_BODY_FILTER_INIT \
  {sizeof(dyop_body_filter), 0, 0xFFFFFFFFFFFFFFFFu, 0xFFFFFFFFFFFFFFFFu, NULL, NULL}
#define DYOP_SPRING_DEFINITION_INIT \
  {sizeof(dyop_spring_definition), 0, {0, 0}, {0, 0}, {0, 0, 0}, {0, 0, 0}, -1, 0, 0}
#define DYOP_LINK_PAIR_OPTIONS_INIT {sizeof(dyop_link_pair_options), 3000, 1000000, 0}
#define DYOP_TOOL_HINGE_INIT {sizeof(dyop_tool_hinge), 0, DYOP_POSE_IDENTITY, 0, 0}
#define DYOP_TOOL_PART_INIT {sizeof(dyop_tool_part), -1, {0, 0}, DYOP_POSE_IDENTITY}
#define DYOP_TOOL_OBSTACLE_INIT \
  {sizeof(dyop_tool_obstacle), DYOP_TISSUE, {0, 0}, DYOP_POSE_IDENTITY, 0, 0, 0, 0, 0}
#define DYOP_COUPLING_INIT \
  {{0, 0, 0}, {0, 0, 0}, {0, 0, 0}, {0, 0, 0}, HUGE_VAL, HUGE_VAL, 0, 0, 1e-3, 0, 0}
#define DYOP_HAPTIC_OPTIONS_INIT \
  {sizeof(dyop_haptic_options), 4, 4, 24, 0, 0, 0.02, 100, 0, 20000, HUGE_VAL, \
   DYOP_COUPLING_INIT, {0, 0, 0}, {0, 0, 0}, {0, 0, 1}}
#define DYOP_HAPTIC_TOOL_INIT \
  {sizeof(dyop_haptic_tool), 0, 0, 0, DYOP_POSE_IDENTITY, 0, 0, DYOP_COUPLING_INIT, \
   {0, 0, 0}, {0, 0, 0}, {0, 0, 1}}
/* clang-format on */

/* The same for languages that have no macros. `size`: of the struct, as the caller knows it. A size
 * that no release had is DYOP_INVALID_ARGUMENT. */
DYOP_C_API dyop_status dyop_context_options_init(dyop_context_options* value, uint32_t size);
DYOP_C_API dyop_status dyop_motion_functions_init(dyop_motion_functions* value, uint32_t size);
DYOP_C_API dyop_status dyop_distance_options_init(dyop_distance_options* value, uint32_t size);
DYOP_C_API dyop_status dyop_toi_options_init(dyop_toi_options* value, uint32_t size);
DYOP_C_API dyop_status dyop_batch_options_init(dyop_batch_options* value, uint32_t size);
DYOP_C_API dyop_status dyop_world_options_init(dyop_world_options* value, uint32_t size);
DYOP_C_API dyop_status dyop_body_definition_init(dyop_body_definition* value, uint32_t size);
DYOP_C_API dyop_status dyop_joint_definition_init(dyop_joint_definition* value, uint32_t size);
DYOP_C_API dyop_status dyop_spring_definition_init(dyop_spring_definition* value, uint32_t size);
DYOP_C_API dyop_status dyop_body_filter_init(dyop_body_filter* value, uint32_t size);
DYOP_C_API dyop_status dyop_chain_link_init(dyop_chain_link* value, uint32_t size);
DYOP_C_API dyop_status dyop_chain_joint_init(dyop_chain_joint* value, uint32_t size);
DYOP_C_API dyop_status dyop_link_pair_options_init(dyop_link_pair_options* value, uint32_t size);
DYOP_C_API dyop_status dyop_tool_hinge_init(dyop_tool_hinge* value, uint32_t size);
DYOP_C_API dyop_status dyop_tool_part_init(dyop_tool_part* value, uint32_t size);
DYOP_C_API dyop_status dyop_tool_obstacle_init(dyop_tool_obstacle* value, uint32_t size);
DYOP_C_API dyop_status dyop_haptic_options_init(dyop_haptic_options* value, uint32_t size);
DYOP_C_API dyop_status dyop_haptic_tool_init(dyop_haptic_tool* value, uint32_t size);

#ifdef __cplusplus
}
#endif

#endif /* DYOP_C_H */
