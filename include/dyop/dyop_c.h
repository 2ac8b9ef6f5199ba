/* SPDX-License-Identifier: BSD-3-Clause */
#ifndef DYOP_C_H
#define DYOP_C_H

/* dyop for C99 and every language that can call C. docs/c.md is the guide; docs/algorithms
 * states what a query promises, under the C++ names, which are also used here.
 *
 * - Every function returns a dyop_status. No exception leaves the library.
 * - Handles are an index and a generation: a handle whose object was destroyed is
 *   DYOP_STALE_HANDLE, never another object. Zero handles refer to nothing. Handles belong to
 *   their context.
 * - Arrays belong to the caller, and are used only during the call.
 * - Structs for options, definitions and results begin with their `size`, so that they can grow:
 *   fill them from the DYOP_..._INIT macros. Null options mean these defaults.
 * - Shapes and motions never change; objects that use them keep them alive. Queries may run in many
 *   threads at once; one world serves one thread at a time.
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
  DYOP_INTERNAL_ERROR = 6     /* an error in dyop; the message holds the data to reproduce it */
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
  /* Called on each failure, one call at a time. */
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
/* Of the process: called when an assumption of dyop fails, in builds that check them; then the
 * process aborts. Null prints to standard error. */
DYOP_C_API void dyop_set_assert_handler(void (*handler)(const char* message));

/* --- Shapes ----------------------------------------------------------------------------------- */

DYOP_C_API dyop_status dyop_sphere_create(dyop_context* context, double radius, dyop_shape* shape);
DYOP_C_API dyop_status dyop_box_create(dyop_context* context, const double half_extents[3],
                                       dyop_shape* shape);
/* About the z axis. */
DYOP_C_API dyop_status dyop_capsule_create(dyop_context* context, double radius, double half_length,
                                           dyop_shape* shape);
DYOP_C_API dyop_status dyop_hull_create(dyop_context* context, const double* points,
                                        size_t point_count, dyop_shape* shape);
/* Rows of three: coordinates, and vertex numbers. */
DYOP_C_API dyop_status dyop_mesh_create(dyop_context* context, const double* vertices,
                                        size_t vertex_count, const int32_t* triangles,
                                        size_t triangle_count, dyop_shape* shape);
/* The same triangles with as many new vertices: a new shape at a fraction of the cost. */
DYOP_C_API dyop_status dyop_mesh_refit(dyop_context* context, dyop_shape mesh,
                                       const double* vertices, size_t vertex_count,
                                       dyop_shape* shape);
DYOP_C_API dyop_status dyop_compound_create(dyop_context* context, const dyop_shape* children,
                                            const dyop_pose* poses, size_t child_count,
                                            dyop_shape* shape);
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
  double distance_tolerance; /* 0: the default, a millionth of the smaller bounding radius */
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
  double target_distance; /* kept, by proof; negative: the default, 1e-4 of the smallest radius */
  int32_t thread_count;   /* 0: all; never changes the result */
  int32_t reserved;
  void* user;
  void (*on_step)(void* user, double t); /* after each committed step; must not change the world */
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
  dyop_wrench_callback wrench; /* dynamic, may be null */
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

/* --- Defaults --------------------------------------------------------------------------------- */

/* clang-format off */
#define DYOP_POSE_IDENTITY {{0, 0, 0}, {1, 0, 0, 0}}
#define DYOP_BODY_DEFINITION_INIT \
  {sizeof(dyop_body_definition), DYOP_DYNAMIC, {0, 0}, {DYOP_POSE_IDENTITY, {{0, 0, 0}, {0, \
   0, 0}}}, 1000, {0, 0}, 0.5, 0.5, NULL, NULL}
#define DYOP_CONTEXT_OPTIONS_INIT {sizeof(dyop_context_options), 0, NULL, NULL, NULL, NULL}
#define DYOP_MOTION_FUNCTIONS_INIT {sizeof(dyop_motion_functions), 0, NULL, NULL, NULL, {0, 0}}
#define DYOP_DISTANCE_OPTIONS_INIT {sizeof(dyop_distance_options), 0, 0, {0, 0}, HUGE_VAL, 0, 0}
#define DYOP_TOI_OPTIONS_INIT {sizeof(dyop_toi_options), 0, 0, {0, 0}, 0, 0, 10000000}
#define DYOP_BATCH_OPTIONS_INIT {sizeof(dyop_batch_options), 0, NULL, NULL}
#define DYOP_WORLD_OPTIONS_INIT \
  {sizeof(dyop_world_options), DYOP_IMPACT_IMPULSE, {0, 0, 0}, 0, -1, 0, 0, NULL, NULL}
/* clang-format on */

#ifdef __cplusplus
}
#endif

#endif /* DYOP_C_H */
