/* SPDX-License-Identifier: BSD-3-Clause */

/* What a C99 program sees of dyop: built with a C compiler, run by the suite. Returns the number of
 * the first check that fails. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "dyop/dyop_c.h"

#define CHECK(condition)                             \
  do {                                               \
    if (!(condition)) {                              \
      printf("line %d: %s\n", __LINE__, #condition); \
      return __LINE__;                               \
    }                                                \
  } while (0)

static int log_count = 0;
static long allocated = 0;

/* Calls functions, one of which fails; that is not logged. */
static void log_error(void* user, dyop_log_level level, const char* message) {
  dyop_context* context = *(dyop_context**)user;
  const dyop_shape nothing = {0, 0};
  char text[200] = "";
  const int is_told = dyop_last_error(context, text, sizeof(text)) == DYOP_OK && text[0] != 0;
  const int is_stale = dyop_shape_destroy(context, nothing) == DYOP_STALE_HANDLE;
  log_count += is_told && is_stale && level == DYOP_LOG_ERROR && strlen(message) > 0;
}

static void* allocate(void* user, size_t size, size_t alignment) {
  (void)user;
  (void)alignment;
  allocated += (long)size;
  return malloc(size);
}

static void deallocate(void* user, void* memory, size_t size, size_t alignment) {
  (void)user;
  (void)alignment;
  allocated -= (long)size;
  free(memory);
}

/* Falls from z = 5 at speed 1. */
static void falling_state(void* user, double t, dyop_state* state) {
  (void)user;
  state->pose.position[2] = 5 - t;
  state->twist.v[2] = -1;
}

static void falling_bound(void* user, dyop_interval interval, dyop_twist_bound* bound) {
  const dyop_twist_bound steady = {1, 0, 0, 0};
  (void)user;
  (void)interval;
  *bound = steady;
}

static void lift(void* user, double t, const dyop_state* state, dyop_wrench* wrench) {
  (void)t;
  (void)state;
  wrench->force[2] = *(const double*)user;
}

static int stop_at_third(void* user, size_t done, size_t total) {
  (void)user;
  (void)total;
  return done >= 3;
}

static int check_queries(dyop_context* context) {
  dyop_shape ball, box, mesh;
  dyop_motion rest, fall, falling;
  const double half[3] = {1, 1, 1};
  const double vertices[12] = {0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1};
  const int32_t triangles[12] = {0, 2, 1, 0, 1, 3, 1, 2, 3, 0, 3, 2};
  const dyop_pose origin = DYOP_POSE_IDENTITY;
  dyop_state start = {{{0, 0, 5}, {1, 0, 0, 0}}, {{0, 0, -1}, {0, 0, 0}}};
  dyop_motion_functions functions = DYOP_MOTION_FUNCTIONS_INIT;
  dyop_toi_query query = {sizeof(dyop_toi_query), 0, {0, 0}, {0, 0}, {0, 0}, {0, 0}, {0, 10}};
  dyop_toi_result result = {sizeof(dyop_toi_result)};
  dyop_distance_query near = {sizeof(dyop_distance_query), 0, {0, 0}, {0, 0}, DYOP_POSE_IDENTITY,
                              DYOP_POSE_IDENTITY};
  dyop_distance_result gap = {sizeof(dyop_distance_result)};

  CHECK(dyop_sphere_create(context, 0.5, &ball) == DYOP_OK);
  CHECK(dyop_box_create(context, half, &box) == DYOP_OK);
  CHECK(dyop_mesh_create(context, vertices, 4, triangles, 4, &mesh) == DYOP_OK);
  CHECK(dyop_rest_create(context, &origin, &rest) == DYOP_OK);
  CHECK(dyop_constant_twist_create(context, &start, 0, &fall) == DYOP_OK);
  functions.state = falling_state;
  functions.twist_bound = falling_bound;
  functions.domain.begin = -HUGE_VAL;
  functions.domain.end = HUGE_VAL;
  CHECK(dyop_user_motion_create(context, &functions, &falling) == DYOP_OK);

  query.a = box;
  query.b = ball;
  query.motion_a = rest;
  query.motion_b = fall;
  CHECK(dyop_time_of_impact(context, &query, NULL, &result) == DYOP_OK);
  CHECK(result.status == DYOP_TOI_IMPACT);
  CHECK(fabs(result.t_safe - 3.5) < 1e-5);
  CHECK(result.has_contact == 1 && fabs(result.witness.normal[2] - 1) < 1e-9);
  CHECK(fabs(result.closing_speed - 1) < 1e-9);
  query.motion_b = falling;
  CHECK(dyop_time_of_impact(context, &query, NULL, &result) == DYOP_OK);
  CHECK(result.status == DYOP_TOI_IMPACT && fabs(result.t_safe - 3.5) < 1e-5);

  near.a = mesh;
  near.b = ball;
  near.pose_b.position[0] = 3;
  CHECK(dyop_compute_distance(context, &near, NULL, &gap) == DYOP_OK);
  CHECK(gap.status == DYOP_DISTANCE_SEPARATED);
  CHECK(gap.witness.lower <= 1.5 && 1.5 <= gap.witness.upper && gap.witness.upper < 1.5 + 1e-12);
  CHECK(gap.witness.triangle_a >= 0 && gap.witness.triangle_b == -1);

  /* A destroyed shape is stale, also after its slot is used again. */
  CHECK(dyop_shape_destroy(context, ball) == DYOP_OK);
  CHECK(dyop_shape_destroy(context, ball) == DYOP_STALE_HANDLE);
  {
    dyop_shape other;
    CHECK(dyop_sphere_create(context, 0.25, &other) == DYOP_OK);
    CHECK(other.index == ball.index && other.generation != ball.generation);
    CHECK(dyop_time_of_impact(context, &query, NULL, &result) == DYOP_STALE_HANDLE);
  }
  return 0;
}

static int check_batch(dyop_context* context) {
  enum { kCount = 8 };
  dyop_shape ball;
  dyop_motion rest, fall;
  const dyop_pose origin = DYOP_POSE_IDENTITY;
  dyop_toi_query queries[kCount];
  dyop_toi_result results[kCount];
  dyop_batch_options batch = DYOP_BATCH_OPTIONS_INIT;
  int i, not_run = 0;

  CHECK(dyop_sphere_create(context, 0.5, &ball) == DYOP_OK);
  CHECK(dyop_rest_create(context, &origin, &rest) == DYOP_OK);
  memset(queries, 0, sizeof(queries));
  for (i = 0; i < kCount; ++i) {
    const dyop_state start = {{{0, 0, 2.0 + i}, {1, 0, 0, 0}}, {{0, 0, -1}, {0, 0, 0}}};
    CHECK(dyop_constant_twist_create(context, &start, 0, &fall) == DYOP_OK);
    queries[i].size = sizeof(dyop_toi_query);
    queries[i].a = ball;
    queries[i].b = ball;
    queries[i].motion_a = rest;
    queries[i].motion_b = fall;
    queries[i].interval.end = 20;
  }
  results[0].size = sizeof(dyop_toi_result);
  CHECK(dyop_time_of_impact_batch(context, queries, kCount, NULL, NULL, results) == DYOP_OK);
  for (i = 0; i < kCount; ++i) {
    CHECK(results[i].size == sizeof(dyop_toi_result) && results[i].status == DYOP_TOI_IMPACT);
    CHECK(fabs(results[i].t_safe - (1.0 + i)) < 1e-5);
  }
  batch.thread_count = 1;
  batch.progress = stop_at_third;
  CHECK(dyop_time_of_impact_batch(context, queries, kCount, NULL, &batch, results) == DYOP_OK);
  for (i = 0; i < kCount; ++i) not_run += results[i].status == DYOP_TOI_NOT_RUN;
  CHECK(not_run == kCount - 3);
  /* Nothing runs if one query is wrong, and the message names it. */
  queries[5].interval.end = -1;
  CHECK(dyop_time_of_impact_batch(context, queries, kCount, NULL, NULL, results) ==
        DYOP_INVALID_ARGUMENT);
  {
    char text[200];
    CHECK(dyop_last_error(context, text, sizeof(text)) == DYOP_OK);
    CHECK(strstr(text, "5") != NULL && strstr(text, "-1") != NULL);
    CHECK(dyop_last_error(context, text, 6) == DYOP_OK && strlen(text) == 5);
  }
  queries[5].interval.end = 20;
  queries[6].size = 4;
  CHECK(dyop_time_of_impact_batch(context, queries, kCount, NULL, NULL, results) ==
        DYOP_INVALID_ARGUMENT);
  return 0;
}

static int check_world(dyop_context* context) {
  dyop_shape ball, floor_shape;
  dyop_world world;
  dyop_body body, ground, bodies[2];
  dyop_world_options options = DYOP_WORLD_OPTIONS_INIT;
  dyop_body_definition definition = DYOP_BODY_DEFINITION_INIT;
  dyop_advance_report report = {sizeof(dyop_advance_report)};
  dyop_state states[2];
  const double half[3] = {5, 5, 0.5};
  double force = 0;
  size_t count = 0;
  dyop_impact impact = {sizeof(dyop_impact)};
  dyop_contact contacts[4] = {{sizeof(dyop_contact)}};
  int i;

  CHECK(dyop_sphere_create(context, 0.5, &ball) == DYOP_OK);
  CHECK(dyop_box_create(context, half, &floor_shape) == DYOP_OK);
  options.gravity[2] = -10;
  options.max_step = 0.01;
  CHECK(dyop_world_create(context, &options, &world) == DYOP_OK);
  definition.shape = ball;
  definition.initial.pose.position[2] = 2;
  definition.restitution = 0;
  definition.user = &force;
  definition.wrench = lift;
  CHECK(dyop_world_add_body(context, world, &definition, &body) == DYOP_OK);
  definition.kind = DYOP_STATIC;
  definition.shape = floor_shape;
  definition.initial.pose.position[2] = -0.5;
  CHECK(dyop_world_add_body(context, world, &definition, &ground) == DYOP_OK);
  bodies[0] = body;
  bodies[1] = ground;

  /* Free fall, until it meets the floor: z = 2 - 5 t^2. */
  CHECK(dyop_world_advance(context, world, 0.4, &report) == DYOP_OK);
  CHECK(report.status == DYOP_ADVANCE_COMPLETED && report.impact_count == 0);
  CHECK(dyop_world_states(context, world, bodies, 2, states) == DYOP_OK);
  CHECK(fabs(states[0].pose.position[2] - 1.2) < 1e-6);
  CHECK(dyop_world_advance(context, world, 0.6, &report) == DYOP_OK);
  CHECK(report.impact_count >= 1);
  CHECK(dyop_world_impacts(context, world, &impact, 1, &count) == DYOP_OK);
  CHECK(count == report.impact_count);
  CHECK(fabs(impact.t - sqrt(0.3)) < 1e-2);
  CHECK(dyop_world_states(context, world, bodies, 1, states) == DYOP_OK);
  CHECK(states[0].pose.position[2] > 0.5 && states[0].pose.position[2] < 0.51);
  CHECK(dyop_world_contacts(context, world, NULL, 0, &count) == DYOP_OK && count >= 1);
  CHECK(dyop_world_contacts(context, world, contacts, 4, &count) == DYOP_OK);
  /* One impulse holds it: weight times step. Which body is A is the world's choice. */
  CHECK(fabs(contacts[0].gap) < 0.01);

  /* The force of the callback lifts it: more than its weight. */
  force = 2 * 10 * 1000 * 4.0 / 3 * 3.141592653589793 * 0.125;
  for (i = 0; i < 2; ++i) {
    states[0].pose.position[2] = 3;
    memset(&states[0].twist, 0, sizeof(states[0].twist));
  }
  CHECK(dyop_world_set_state(context, world, body, &states[0]) == DYOP_OK);
  CHECK(dyop_world_advance(context, world, 0.5, &report) == DYOP_OK);
  CHECK(dyop_world_states(context, world, bodies, 1, states) == DYOP_OK);
  CHECK(fabs(states[0].pose.position[2] - 4.25) < 1e-4);

  CHECK(dyop_world_remove_body(context, world, body) == DYOP_OK);
  CHECK(dyop_world_states(context, world, bodies, 1, states) == DYOP_STALE_HANDLE);
  CHECK(dyop_world_destroy(context, world) == DYOP_OK);
  CHECK(dyop_world_advance(context, world, 1, &report) == DYOP_STALE_HANDLE);
  return 0;
}

/* A force that calls the interface again: changes are refused, reading is not. */
typedef struct meddler {
  dyop_context* context;
  dyop_world world;
  dyop_body body;
  int calls;
  int wrong;
} meddler;

static void meddle(void* user, double t, const dyop_state* state, dyop_wrench* wrench) {
  meddler* m = (meddler*)user;
  dyop_advance_report report = {sizeof(dyop_advance_report)};
  dyop_state now;
  dyop_body other;
  dyop_body_definition definition = DYOP_BODY_DEFINITION_INIT;
  (void)t;
  (void)wrench;
  ++m->calls;
  m->wrong += dyop_world_remove_body(m->context, m->world, m->body) != DYOP_INVALID_ARGUMENT;
  m->wrong += dyop_world_advance(m->context, m->world, 1, &report) != DYOP_INVALID_ARGUMENT;
  m->wrong += dyop_world_set_state(m->context, m->world, m->body, state) != DYOP_INVALID_ARGUMENT;
  m->wrong +=
      dyop_world_add_body(m->context, m->world, &definition, &other) != DYOP_INVALID_ARGUMENT;
  m->wrong += dyop_world_states(m->context, m->world, &m->body, 1, &now) != DYOP_OK;
  dyop_context_destroy(m->context);
}

static int check_calls_from_callbacks(dyop_context* context) {
  dyop_world_options options = DYOP_WORLD_OPTIONS_INIT;
  dyop_body_definition definition = DYOP_BODY_DEFINITION_INIT;
  dyop_advance_report report = {sizeof(dyop_advance_report)};
  meddler m = {context};
  CHECK(dyop_world_create(context, &options, &m.world) == DYOP_OK);
  CHECK(dyop_sphere_create(context, 0.5, &definition.shape) == DYOP_OK);
  definition.wrench = meddle;
  definition.user = &m;
  CHECK(dyop_world_add_body(context, m.world, &definition, &m.body) == DYOP_OK);
  CHECK(dyop_world_advance(context, m.world, 0.1, &report) == DYOP_OK);
  CHECK(m.calls > 0 && m.wrong == 0);
  CHECK(dyop_world_remove_body(context, m.world, m.body) == DYOP_OK);
  CHECK(dyop_world_destroy(context, m.world) == DYOP_OK);
  CHECK(dyop_shape_destroy(context, definition.shape) == DYOP_OK);
  return 0;
}

static int check_more_shapes(dyop_context* context) {
  const double up[3] = {0, 0, 2}, points[6] = {0, 0, 0, 0, 0, 2};
  dyop_shape shapes[3];
  int i;
  dyop_distance_query pair = {sizeof(dyop_distance_query), 0, {0, 0}, {0, 0}, DYOP_POSE_IDENTITY,
                              DYOP_POSE_IDENTITY};
  dyop_distance_result gap = {sizeof(dyop_distance_result)};
  CHECK(dyop_half_space_create(context, up, 1, &pair.a) == DYOP_OK);
  CHECK(dyop_half_space_create(context, NULL, 1, &pair.a) == DYOP_INVALID_ARGUMENT);
  {
    const double half_extents[3] = {1, 1, 1};
    const double factors[3] = {1, -2, 3};
    const double none[3] = {1, 0, 1};
    dyop_mass_properties box;
    dyop_shape cube;
    dyop_shape stretched;
    CHECK(dyop_box_create(context, half_extents, &cube) == DYOP_OK);
    CHECK(dyop_scaled_create(context, cube, factors, &stretched) == DYOP_OK);
    CHECK(dyop_shape_mass_properties(context, stretched, 1, &box) == DYOP_OK);
    CHECK(fabs(box.mass - 48) < 1e-12);
    CHECK(dyop_scaled_create(context, cube, none, &stretched) == DYOP_INVALID_ARGUMENT);
    CHECK(dyop_scaled_create(context, cube, NULL, &stretched) == DYOP_INVALID_ARGUMENT);
  }
  {
    const double heights[6] = {1, 2, 3, 1, 2, 3};
    dyop_mass_properties ground;
    CHECK(dyop_height_field_create(context, heights, 2, 3, 1, 2, 0, &shapes[0]) == DYOP_OK);
    CHECK(dyop_shape_mass_properties(context, shapes[0], 1, &ground) == DYOP_OK);
    CHECK(fabs(ground.mass - 8) < 1e-12);
    CHECK(dyop_height_field_create(context, NULL, 2, 3, 1, 2, 0, &shapes[0]) ==
          DYOP_INVALID_ARGUMENT);
    CHECK(dyop_height_field_create(context, heights, 2, 3, 1, 2, 1, &shapes[0]) ==
          DYOP_INVALID_ARGUMENT);
    CHECK(dyop_height_field_create(context, heights, (size_t)-1, 3, 1, 2, 0, &shapes[0]) ==
          DYOP_INVALID_ARGUMENT);
  }
  {
    const double sizes[2] = {1, 2};
    dyop_mass_properties mass;
    CHECK(dyop_occupancy_create(context, points, sizes, 2, &shapes[0]) == DYOP_OK);
    CHECK(dyop_shape_mass_properties(context, shapes[0], 1, &mass) == DYOP_OK);
    CHECK(fabs(mass.mass - 9) < 1e-12);
    CHECK(dyop_occupancy_create(context, points, NULL, 2, &shapes[0]) == DYOP_INVALID_ARGUMENT);
    CHECK(dyop_point_cloud_create(context, points, 2, 0.5, &shapes[0]) == DYOP_OK);
    CHECK(dyop_point_cloud_create(context, points, 0, 0.5, &shapes[0]) == DYOP_INVALID_ARGUMENT);
  }
  CHECK(dyop_sphere_create(context, 0.5, &pair.b) == DYOP_OK);
  pair.pose_b.position[0] = 1e4;
  pair.pose_b.position[2] = 4;
  CHECK(dyop_compute_distance(context, &pair, NULL, &gap) == DYOP_OK);
  CHECK(gap.witness.lower <= 2.5 && 2.5 <= gap.witness.upper);
  CHECK(fabs(gap.witness.upper - 2.5) < 1e-9);
  /* All reach up to z = 3. */
  pair.pose_b.position[0] = 0;
  pair.pose_b.position[2] = 5;
  CHECK(dyop_tapered_capsule_create(context, 0.5, 1, 2, &shapes[0]) == DYOP_OK);
  CHECK(dyop_rounded_cylinder_create(context, 0.5, 2, 1, &shapes[1]) == DYOP_OK);
  CHECK(dyop_rounded_hull_create(context, points, 2, 1, &shapes[2]) == DYOP_OK);
  for (i = 0; i < 3; ++i) {
    pair.a = shapes[i];
    CHECK(dyop_compute_distance(context, &pair, NULL, &gap) == DYOP_OK);
    CHECK(fabs(gap.witness.lower - 1.5) < 1e-6 && fabs(gap.witness.upper - 1.5) < 1e-6);
  }
  return 0;
}

static int check_near_things(dyop_context* context) {
  dyop_shape shapes[4], box;
  const double axes[3] = {1, 2, 3}, half[3] = {1, 1, 1};
  const double points[6] = {3, 0, 0, 0, 0, 0.5};
  const dyop_pose origin = DYOP_POSE_IDENTITY;
  dyop_distance_query pair = {sizeof(dyop_distance_query), 0, {0, 0}, {0, 0}, DYOP_POSE_IDENTITY,
                              DYOP_POSE_IDENTITY};
  dyop_distance_result gap = {sizeof(dyop_distance_result)};
  const double exact[4] = {1.5, 1.5, 1, 0.75}; /* from x = 3 along x, less the ball's half */
  dyop_point_result near[2] = {{sizeof(dyop_point_result)}};
  dyop_witness contacts[8];
  size_t count = 0;
  int i;
  CHECK(dyop_cylinder_create(context, 1, 2, &shapes[0]) == DYOP_OK);
  CHECK(dyop_rounded_box_create(context, half, 0.5, &shapes[3]) == DYOP_OK);
  CHECK(dyop_ellipsoid_create(context, axes, &shapes[1]) == DYOP_OK);
  CHECK(dyop_cone_create(context, 2, 2, &shapes[2]) == DYOP_OK);
  CHECK(dyop_box_create(context, half, &box) == DYOP_OK);
  CHECK(dyop_sphere_create(context, 0.5, &pair.b) == DYOP_OK);
  pair.pose_b.position[0] = 3;
  for (i = 0; i < 4; ++i) {
    pair.a = shapes[i];
    CHECK(dyop_compute_distance(context, &pair, NULL, &gap) == DYOP_OK);
    if (i == 2) continue; /* the nearest point of the cone is not on the axis */
    CHECK(gap.witness.lower <= exact[i] + (i == 3 ? 0.25 : 0) + 1e-9);
    CHECK(gap.witness.upper >= exact[i] - 1e-9);
  }
  CHECK(dyop_point_distance(context, box, &origin, 1, points, 2, near) == DYOP_OK);
  CHECK(near[0].lower <= 2 && 2 <= near[0].upper && near[0].upper < 2 + 1e-12);
  CHECK(fabs(near[0].point[0] - 1) < 1e-12 && fabs(near[0].normal[0] - 1) < 1e-12);
  CHECK(fabs(near[1].upper + 0.5) < 1e-12 && near[1].size == sizeof(dyop_point_result));
  /* A box upon a box: four corners, however many are asked for. */
  pair.a = pair.b = box;
  pair.pose_b.position[0] = 0;
  pair.pose_b.position[2] = 2.01;
  CHECK(dyop_find_contacts(context, &pair, 0.02, contacts, 8, &count) == DYOP_OK);
  CHECK(count == 4 && fabs(contacts[3].lower - 0.01) < 1e-9);
  CHECK(dyop_find_contacts(context, &pair, 0.02, NULL, 0, &count) == DYOP_OK && count == 4);
  return 0;
}

static int check_obstacles(dyop_context* context) {
  dyop_shape ball;
  dyop_motion rest, far, fall;
  dyop_obstacle_set set;
  dyop_obstacle one, two, found;
  const dyop_pose origin = DYOP_POSE_IDENTITY, aside = {{9, 0, 0}, {1, 0, 0, 0}};
  const dyop_pose above = {{0, 0, 3}, {1, 0, 0, 0}};
  const dyop_state start = {{{0, 0, 5}, {1, 0, 0, 0}}, {{0, 0, -1}, {0, 0, 0}}};
  const dyop_interval interval = {0, 10};
  dyop_toi_result result = {sizeof(dyop_toi_result)};
  dyop_distance_result gap = {sizeof(dyop_distance_result)};
  CHECK(dyop_sphere_create(context, 0.5, &ball) == DYOP_OK);
  CHECK(dyop_rest_create(context, &origin, &rest) == DYOP_OK);
  CHECK(dyop_rest_create(context, &aside, &far) == DYOP_OK);
  CHECK(dyop_constant_twist_create(context, &start, 0, &fall) == DYOP_OK);
  CHECK(dyop_obstacle_set_create(context, &set) == DYOP_OK);
  CHECK(dyop_obstacle_add(context, set, ball, far, 1, 0, &one) == DYOP_OK);
  CHECK(dyop_obstacle_add(context, set, ball, rest, 2, 0, &two) == DYOP_OK);
  CHECK(dyop_first_impact(context, set, ball, fall, interval, 3, NULL, &result, &found) == DYOP_OK);
  CHECK(result.status == DYOP_TOI_IMPACT && fabs(result.t_safe - 4) < 1e-5);
  CHECK(found.number == two.number);
  CHECK(dyop_first_impact(context, set, ball, fall, interval, 1, NULL, &result, &found) == DYOP_OK);
  CHECK(result.status == DYOP_TOI_SEPARATED && found.number == 0);
  CHECK(dyop_nearest_obstacle(context, set, ball, &above, 0, 3, NULL, &gap, &found) == DYOP_OK);
  CHECK(found.number == two.number && fabs(gap.witness.upper - 2) < 1e-9);
  CHECK(dyop_obstacle_move(context, set, one, rest) == DYOP_OK);
  CHECK(dyop_obstacle_remove(context, set, two) == DYOP_OK);
  CHECK(dyop_obstacle_remove(context, set, two) == DYOP_STALE_HANDLE);
  CHECK(dyop_nearest_obstacle(context, set, ball, &above, 0, 3, NULL, &gap, &found) == DYOP_OK);
  CHECK(found.number == one.number);
  CHECK(dyop_obstacle_set_destroy(context, set) == DYOP_OK);
  CHECK(dyop_obstacle_remove(context, set, one) == DYOP_STALE_HANDLE);
  return 0;
}

/* An arm of length one that turns about z, with a ball at its end, and a ball in its way. */
static int check_chain(dyop_context* context) {
  dyop_chain_link links[3] = {DYOP_CHAIN_LINK_INIT, DYOP_CHAIN_LINK_INIT, DYOP_CHAIN_LINK_INIT};
  dyop_chain_joint joints[2] = {DYOP_CHAIN_JOINT_INIT, DYOP_CHAIN_JOINT_INIT};
  dyop_chain chain;
  dyop_obstacle_set set;
  dyop_obstacle post;
  dyop_motion rest;
  const dyop_pose place = {{0, 1, 0}, {1, 0, 0, 0}};
  dyop_pose poses[3];
  const double times[2] = {0, 1}, waypoints[2] = {0, 2}, quarter = 3.141592653589793 / 2;
  dyop_chain_result result = {sizeof(dyop_chain_result)};
  CHECK(dyop_sphere_create(context, 0.1, &links[2].shape) == DYOP_OK);
  joints[0].child = 1;
  joints[1].type = DYOP_CHAIN_FIXED;
  joints[1].parent = 1;
  joints[1].child = 2;
  joints[1].origin.position[0] = 1;
  CHECK(dyop_chain_create(context, links, 3, joints, 2, &chain) == DYOP_OK);
  CHECK(dyop_chain_poses(context, chain, &quarter, 1, poses, 3) == DYOP_OK);
  CHECK(fabs(poses[2].position[1] - 1) < 1e-12 && fabs(poses[2].position[0]) < 1e-12);
  CHECK(dyop_chain_poses(context, chain, &quarter, 1, poses, 2) == DYOP_INVALID_ARGUMENT);
  CHECK(dyop_rest_create(context, &place, &rest) == DYOP_OK);
  CHECK(dyop_obstacle_set_create(context, &set) == DYOP_OK);
  CHECK(dyop_certify(context, chain, DYOP_PATH_LINEAR, times, waypoints, 2, 1, set, NULL,
                     &result) == DYOP_OK);
  CHECK(result.status == DYOP_TOI_SEPARATED && result.free_fraction == 1 && result.link_a == -1);
  CHECK(dyop_obstacle_add(context, set, links[2].shape, rest, 1, 0, &post) == DYOP_OK);
  CHECK(dyop_certify(context, chain, DYOP_PATH_LINEAR, times, waypoints, 2, 1, set, NULL,
                     &result) == DYOP_OK);
  CHECK(result.status == DYOP_TOI_IMPACT && result.link_a == 2 && result.link_b == -1);
  CHECK(result.obstacle.number == post.number && result.has_contact == 1);
  CHECK(fabs(2 * result.t_safe - (quarter - 2 * asin(0.1))) < 1e-4);
  CHECK(dyop_certify(context, chain, 7, times, waypoints, 2, 1, set, NULL, &result) ==
        DYOP_INVALID_ARGUMENT);
  joints[1].child = 1;
  CHECK(dyop_chain_create(context, links, 3, joints, 2, &chain) == DYOP_INVALID_ARGUMENT);
  return 0;
}

/* Two links of length one after the other: the last ball, and a base that it can reach. It touches
 * where 2 cos(q / 2) = 0.4. */
static int make_arm(dyop_context* context, double limit, dyop_robot* robot) {
  dyop_chain_link links[3] = {DYOP_CHAIN_LINK_INIT, DYOP_CHAIN_LINK_INIT, DYOP_CHAIN_LINK_INIT};
  dyop_chain_joint joints[2] = {DYOP_CHAIN_JOINT_INIT, DYOP_CHAIN_JOINT_INIT};
  dyop_chain chain;
  int i;
  CHECK(dyop_sphere_create(context, 0.2, &links[0].shape) == DYOP_OK);
  links[1].shape = links[2].shape = links[0].shape;
  for (i = 0; i < 2; ++i) {
    joints[i].parent = i;
    joints[i].child = i + 1;
    joints[i].origin.position[0] = 1;
    joints[i].has_limits = 1;
    joints[i].lower = -limit;
    joints[i].upper = limit;
  }
  CHECK(dyop_chain_create(context, links, 3, joints, 2, &chain) == DYOP_OK);
  CHECK(dyop_robot_create(context, chain, robot) == DYOP_OK);
  return 0;
}

typedef struct {
  dyop_context* context;
  dyop_obstacle_set set;
  dyop_shape ball;
  dyop_motion rest;
  int refused;
} obstacle_adder;

static int add_obstacle(void* user, size_t done, size_t total) {
  obstacle_adder* at = (obstacle_adder*)user;
  dyop_obstacle added;
  (void)done;
  (void)total;
  at->refused += dyop_obstacle_add(at->context, at->set, at->ball, at->rest, 1, 0, &added) ==
                 DYOP_INVALID_ARGUMENT;
  return 0;
}

static int check_robots(dyop_context* context) {
  enum { kPaths = 3 };
  dyop_robot robot, narrow, holding;
  dyop_robot_info info = {sizeof(dyop_robot_info)};
  dyop_link_pair_options options = DYOP_LINK_PAIR_OPTIONS_INIT;
  dyop_link_pair pairs[3] = {{sizeof(dyop_link_pair)}};
  dyop_chain chain;
  dyop_obstacle_set set;
  dyop_joint_path paths[kPaths], expanded;
  dyop_chain_result results[kPaths] = {{sizeof(dyop_chain_result)}};
  dyop_interval domain;
  dyop_shape ball;
  dyop_batch_options batch = DYOP_BATCH_OPTIONS_INIT;
  obstacle_adder adder = {NULL, {0, 0}, {0, 0}, {0, 0}, 0};
  const double times[2] = {0, 1}, touching = 2.7388768120091318; /* 2 acos(0.2) */
  double waypoints[4] = {0, 0, 0, 0}, lower[2], upper[2], at[2], witnesses[6];
  const dyop_pose tip = {{0.5, 0, 0}, {1, 0, 0, 0}};
  const size_t base = 0, none = 7;
  size_t count;
  char name[8];
  int i;
  CHECK(make_arm(context, 3, &robot) == 0 && make_arm(context, 2.7, &narrow) == 0);
  CHECK(dyop_robot_describe(context, robot, &info) == DYOP_OK);
  CHECK(info.link_count == 3 && info.coordinate_count == 2 && info.free_count == 2);
  CHECK(dyop_robot_link_name(context, robot, 2, name, sizeof(name)) == DYOP_OK);
  CHECK(strcmp(name, "2") == 0);
  CHECK(dyop_robot_link_name(context, robot, 3, name, sizeof(name)) == DYOP_INVALID_ARGUMENT);
  CHECK(dyop_robot_joint_name(context, robot, 1, name, sizeof(name)) == DYOP_OK);
  CHECK(dyop_robot_limits(context, robot, lower, upper, 2) == DYOP_OK);
  CHECK(lower[1] == -3 && upper[0] == 3);
  CHECK(dyop_robot_limits(context, robot, lower, upper, 1) == DYOP_INVALID_ARGUMENT);
  CHECK(dyop_robot_expand(context, robot, upper, 2, at, 2) == DYOP_OK && at[1] == 3);

  /* Pairs (0, 1), (0, 2), (1, 2): balls of neighbours stay one apart. */
  CHECK(dyop_decide_link_pairs(context, robot, &options, pairs, 3, &count, witnesses) == DYOP_OK);
  CHECK(count == 3 && pairs[0].verdict == DYOP_PAIR_NEVER && pairs[0].is_adjacent == 1);
  CHECK(pairs[1].first == 0 && pairs[1].second == 2 && pairs[1].verdict == DYOP_PAIR_CAN);
  CHECK(pairs[1].has_witness == 1 && fabs(witnesses[2]) >= touching - 1e-9);
  CHECK(fabs(witnesses[2]) <= 3 && pairs[2].verdict == DYOP_PAIR_NEVER);
  CHECK(dyop_decide_link_pairs(context, narrow, NULL, pairs, 3, &count, NULL) == DYOP_OK);
  CHECK(count == 3 && pairs[1].verdict == DYOP_PAIR_NEVER && pairs[1].has_witness == 0);

  /* One path ends before the base, one in it; one goes there without self-collision. */
  CHECK(dyop_obstacle_set_create(context, &set) == DYOP_OK);
  CHECK(dyop_robot_chain(context, robot, &chain) == DYOP_OK);
  for (i = 0; i < kPaths; ++i) {
    waypoints[2] = i == 0 ? 2.7 : 2.9;
    CHECK(dyop_joint_path_create(context, DYOP_PATH_LINEAR, times, waypoints, 2, 2, &paths[i]) ==
          DYOP_OK);
  }
  CHECK(dyop_joint_path_domain(context, paths[1], &domain, &count) == DYOP_OK);
  CHECK(domain.begin == 0 && domain.end == 1 && count == 2);
  CHECK(dyop_joint_path_position(context, paths[1], 0.5, at, 2) == DYOP_OK);
  CHECK(fabs(at[0] - 1.45) < 1e-15 && at[1] == 0);
  CHECK(dyop_robot_expand_path(context, robot, paths[1], &expanded) == DYOP_OK);
  paths[1] = expanded;
  CHECK(dyop_certify_batch(context, chain, paths, kPaths, set, 1, 1, NULL, NULL, results) ==
        DYOP_OK);
  CHECK(results[0].status == DYOP_TOI_SEPARATED && results[0].free_fraction == 1);
  CHECK(results[1].status == DYOP_TOI_IMPACT && results[1].link_a == 0 && results[1].link_b == 2);
  CHECK(fabs(2.9 * results[1].t_safe - touching) < 1e-4);
  CHECK(results[2].t_safe == results[1].t_safe);
  CHECK(dyop_certify_batch(context, chain, paths, kPaths, set, 1, 0, NULL, NULL, results) ==
        DYOP_OK);
  CHECK(results[1].status == DYOP_TOI_SEPARATED);
  /* Progress that would wait for the batch that calls it is refused. */
  adder.context = context;
  adder.set = set;
  batch.user = &adder;
  batch.progress = add_obstacle;
  CHECK(dyop_sphere_create(context, 0.1, &adder.ball) == DYOP_OK);
  CHECK(dyop_rest_create(context, &tip, &adder.rest) == DYOP_OK);
  CHECK(dyop_certify_batch(context, chain, paths, kPaths, set, 1, 1, NULL, &batch, results) ==
        DYOP_OK);
  CHECK(adder.refused == kPaths && results[1].status == DYOP_TOI_IMPACT);

  /* A ball held by the tip, which may touch the base. */
  CHECK(dyop_sphere_create(context, 0.1, &ball) == DYOP_OK);
  CHECK(dyop_robot_attach(context, robot, "cup", ball, 2, &tip, &base, 1, &holding) == DYOP_OK);
  CHECK(dyop_robot_describe(context, holding, &info) == DYOP_OK && info.link_count == 4);
  CHECK(dyop_robot_attach(context, robot, "cup", ball, 2, &tip, &none, 1, &holding) ==
        DYOP_INVALID_ARGUMENT);
  CHECK(dyop_joint_path_destroy(context, paths[0]) == DYOP_OK);
  CHECK(dyop_certify_batch(context, chain, paths, kPaths, set, 1, 0, NULL, NULL, results) ==
        DYOP_STALE_HANDLE);
  CHECK(dyop_robot_destroy(context, robot) == DYOP_OK);
  CHECK(dyop_chain_destroy(context, chain) == DYOP_OK);
  return 0;
}

/* A triangle in a plane that rises from z = 0 to z = 2, below a tetrahedron at z >= 1. */
static int check_deforming(dyop_context* context) {
  double low[9] = {-5, -5, 0, 5, -5, 0, 0, 9, 0}, high[9];
  const double corners[12] = {0, 0, 1, 1, 0, 2, 0, 1, 2, -1, -1, 2};
  const int32_t triangles[12] = {0, 2, 1, 0, 1, 3, 1, 2, 3, 0, 3, 2}, sheet[3] = {0, 1, 2};
  dyop_deforming_mesh rising, falling;
  dyop_shape tetrahedron, ball;
  dyop_motion rest;
  const dyop_pose origin = DYOP_POSE_IDENTITY;
  const dyop_interval interval = {0, 1};
  dyop_toi_result result = {sizeof(dyop_toi_result)};
  dyop_distance_result gap = {sizeof(dyop_distance_result)};
  int i;
  for (i = 0; i < 9; ++i) high[i] = low[i] + (i % 3 == 2 ? 2 : 0);
  CHECK(dyop_mesh_create(context, corners, 4, triangles, 4, &tetrahedron) == DYOP_OK);
  CHECK(dyop_sphere_create(context, 1, &ball) == DYOP_OK);
  CHECK(dyop_rest_create(context, &origin, &rest) == DYOP_OK);
  CHECK(dyop_deforming_mesh_create(context, low, high, 3, sheet, 1, &rising) == DYOP_OK);
  CHECK(dyop_deforming_mesh_create(context, high, low, 3, sheet, 1, &falling) == DYOP_OK);
  CHECK(dyop_deforming_time_of_impact(context, rising, tetrahedron, rest, interval, NULL,
                                      &result) == DYOP_OK);
  CHECK(result.status == DYOP_TOI_IMPACT && fabs(result.t_safe - 0.5) < 1e-5);
  CHECK(dyop_deforming_pair_time_of_impact(context, rising, falling, interval, NULL, &result) ==
        DYOP_OK);
  CHECK(result.status == DYOP_TOI_IMPACT && fabs(result.t_safe - 0.5) < 1e-5);
  CHECK(dyop_deforming_pair_time_of_impact(context, rising, rising, interval, NULL, &result) ==
        DYOP_OK);
  CHECK(result.status == DYOP_TOI_INITIALLY_WITHIN_TARGET);
  CHECK(dyop_deforming_distance(context, rising, 0.25, tetrahedron, &origin, HUGE_VAL, &gap) ==
        DYOP_OK);
  CHECK(gap.witness.lower <= 0.5 && 0.5 <= gap.witness.upper && gap.witness.upper < 0.5 + 1e-12);
  for (i = 2; i < 9; i += 3) high[i] = 0.5;
  CHECK(dyop_deforming_mesh_refit(context, rising, low, high, 3) == DYOP_OK);
  CHECK(dyop_deforming_time_of_impact(context, rising, tetrahedron, rest, interval, NULL,
                                      &result) == DYOP_OK);
  CHECK(result.status == DYOP_TOI_SEPARATED);
  CHECK(dyop_deforming_time_of_impact(context, rising, ball, rest, interval, NULL, &result) ==
        DYOP_INVALID_ARGUMENT);
  CHECK(dyop_deforming_mesh_refit(context, rising, low, high, 2) == DYOP_INVALID_ARGUMENT);
  CHECK(dyop_deforming_mesh_destroy(context, falling) == DYOP_OK);
  CHECK(dyop_deforming_pair_time_of_impact(context, rising, falling, interval, NULL, &result) ==
        DYOP_STALE_HANDLE);
  return 0;
}

static int make_octahedron(dyop_context* context, dyop_shape* shape) {
  const double corners[18] = {1, 0, 0, -1, 0, 0, 0, 1, 0, 0, -1, 0, 0, 0, 1, 0, 0, -1};
  const int32_t triangles[24] = {0, 2, 4, 2, 1, 4, 1, 3, 4, 3, 0, 4,
                                 2, 0, 5, 1, 2, 5, 3, 1, 5, 0, 3, 5};
  CHECK(dyop_mesh_create(context, corners, 6, triangles, 8, shape) == DYOP_OK);
  return 0;
}

/* Two octahedra of radius one whose hands, one unit apart, press them together: both feel the force
 * of two springs of 100 in series; the second one has a jaw that it does not use. */
static int check_two_tools(dyop_context* context) {
  dyop_tool_part parts[3] = {DYOP_TOOL_PART_INIT, DYOP_TOOL_PART_INIT, DYOP_TOOL_PART_INIT};
  dyop_tool_hinge hinge = DYOP_TOOL_HINGE_INIT;
  dyop_haptic_tool tools[2] = {DYOP_HAPTIC_TOOL_INIT, DYOP_HAPTIC_TOOL_INIT};
  dyop_haptic_options options = DYOP_HAPTIC_OPTIONS_INIT;
  dyop_haptic_session session;
  dyop_device_pose devices[2] = {{{{0, 0, -2}, {1, 0, 0, 0}}, {0, 0, 0, 0}},
                                 {{{0, 0, 2}, {1, 0, 0, 0}}, {0, 0, 0, 0}}};
  dyop_haptic_tick ticks[2] = {{sizeof(dyop_haptic_tick)}, {sizeof(dyop_haptic_tick)}};
  dyop_tool_contact contact = {sizeof(dyop_tool_contact)};
  dyop_tool_impulse impulse = {sizeof(dyop_tool_impulse)};
  dyop_tool_clearance clearances[2] = {{sizeof(dyop_tool_clearance)},
                                       {sizeof(dyop_tool_clearance)}};
  size_t count;
  double sum;
  int i;
  CHECK(make_octahedron(context, &parts[0].shape) == 0);
  parts[1].shape = parts[2].shape = parts[0].shape;
  parts[2].hinge = 0;
  parts[2].pose.position[2] = 5;
  hinge.stiffness = 100;
  options.rest_offset = 0.01;
  options.recovery_speed = 1;
  for (i = 0; i < 3; ++i) {
    options.coupling.stiffness[i] = 100;
    options.coupling.rotational_stiffness[i] = 1e4;
  }
  tools[0].part_count = 1;
  tools[1].part_count = 2;
  tools[0].start = devices[0].pose;
  tools[1].start = devices[1].pose;
  CHECK(dyop_haptic_session_create_tools(context, tools, 2, parts, 3, &hinge, 1, NULL, 0, 0, 0,
                                         &options, &session) == DYOP_INVALID_ARGUMENT);
  tools[1].hinge_count = 1;
  tools[1].has_coupling = 1;
  tools[1].coupling = options.coupling;
  CHECK(dyop_haptic_session_create_tools(context, tools, 2, parts, 3, &hinge, 1, NULL, 0, 0, 0.2,
                                         &options, &session) == DYOP_OK);
  CHECK(dyop_haptic_update(context, session, devices, 1e-3, 0, ticks) == DYOP_INVALID_ARGUMENT);
  for (i = 0; i < 100; ++i) {
    devices[1].pose.position[2] = fmax(0.5, 2 - 0.05 * i);
    devices[0].pose.position[2] = -devices[1].pose.position[2];
    CHECK(dyop_haptic_update_tools(context, session, devices, 2, 1e-3, 0, ticks) == DYOP_OK);
  }
  sum = ticks[0].force[2] + ticks[1].force[2];
  CHECK(ticks[1].status == DYOP_HAPTIC_HELD && fabs(sum) < 1e-6);
  CHECK(ticks[1].force[2] > 50 && ticks[1].force[2] < 52);
  CHECK(dyop_haptic_tool_contacts(context, session, 1, &contact, 1, &count) == DYOP_OK);
  CHECK(count >= 1 && contact.obstacle == 0 && contact.force[2] > 0);
  CHECK(dyop_haptic_tool_clearances(context, session, 1, clearances, 2, &count) == DYOP_OK);
  CHECK(count == 2 && clearances[0].upper < 0.03 && clearances[1].lower == HUGE_VAL);
  CHECK(dyop_haptic_contacts_of(context, session, 1, NULL, 0, &count) == DYOP_OK && count == 0);
  CHECK(dyop_haptic_impulses_of(context, session, 1, &impulse, 1, &count) == DYOP_OK && count == 0);
  CHECK(dyop_haptic_clearances_of(context, session, 2, NULL, 0, &count) == DYOP_INVALID_ARGUMENT);
  options.coupling.stiffness[2] = 50;
  CHECK(dyop_haptic_set_coupling_of(context, session, 1, &options.coupling) == DYOP_OK);
  devices[1].pose.position[2] = 9;
  CHECK(dyop_haptic_reset_of(context, session, 1, &devices[1]) == DYOP_OK);
  CHECK(dyop_haptic_update_tools(context, session, devices, 2, 1e-3, 0, ticks) == DYOP_OK);
  CHECK(ticks[1].status == DYOP_HAPTIC_FREE && ticks[1].tool.position[2] == 9);
  return dyop_haptic_session_destroy(context, session) == DYOP_OK ? 0 : 1;
}

/* An octahedron of radius one that a spring of 100 pulls half a unit into a floor, which then
 * rises. */
static int check_haptics(dyop_context* context) {
  double plate[12] = {-9, -9, 0, 9, -9, 0, 9, 9, 0, -9, 9, 0};
  const int32_t halves[6] = {0, 1, 2, 0, 2, 3};
  dyop_tool_part part = DYOP_TOOL_PART_INIT;
  dyop_tool_obstacle floor_there = DYOP_TOOL_OBSTACLE_INIT;
  dyop_haptic_options options = DYOP_HAPTIC_OPTIONS_INIT;
  dyop_haptic_session session;
  dyop_device_pose device = {{{0, 0, 3}, {1, 0, 0, 0}}, {0, 0, 0, 0}};
  dyop_haptic_tick tick = {sizeof(dyop_haptic_tick)};
  dyop_tool_contact contact = {sizeof(dyop_tool_contact)};
  dyop_tool_impulse impulse = {sizeof(dyop_tool_impulse)};
  dyop_tool_clearance clearance = {sizeof(dyop_tool_clearance)};
  size_t count;
  int32_t is_taken = 0;
  int i;
  CHECK(make_octahedron(context, &part.shape) == 0);
  CHECK(dyop_mesh_create(context, plate, 4, halves, 2, &floor_there.shape) == DYOP_OK);
  floor_there.is_deforming = 1;
  CHECK(dyop_haptic_session_create(context, &part, 1, NULL, 0, &floor_there, 1, &device.pose,
                                   &options, &session) == DYOP_INVALID_ARGUMENT);
  options.rest_offset = 0.01;
  options.recovery_speed = 1;
  for (i = 0; i < 3; ++i) {
    options.coupling.stiffness[i] = 100;
    options.coupling.rotational_stiffness[i] = 100;
  }
  CHECK(dyop_haptic_session_create(context, &part, 1, NULL, 0, &floor_there, 1, &device.pose,
                                   &options, &session) == DYOP_OK);
  CHECK(dyop_haptic_update(context, session, &device, 1e-3, 0, &tick) == DYOP_OK);
  CHECK(tick.status == DYOP_HAPTIC_FREE && tick.force[2] == 0);
  for (i = 0; i < 100; ++i) {
    device.pose.position[2] = fmax(0.5, 3 - 0.05 * i);
    CHECK(dyop_haptic_update(context, session, &device, 1e-3, 0, &tick) == DYOP_OK);
  }
  CHECK(tick.status == DYOP_HAPTIC_HELD);
  CHECK(tick.tool.position[2] > 1 && tick.tool.position[2] < 1.03);
  CHECK(fabs(tick.force[2] - 100 * (tick.tool.position[2] - 0.5)) < 1e-6);
  CHECK(fabs(tick.time - 0.101) < 1e-9);
  CHECK(dyop_haptic_contacts(context, session, &contact, 1, &count) == DYOP_OK && count >= 1);
  CHECK(contact.normal[2] > 0.99 && contact.force[2] > 0 && contact.triangle >= 0);
  CHECK(fabs(contact.weights[0] + contact.weights[1] + contact.weights[2] - 1) < 1e-9);
  CHECK(dyop_haptic_impulses(context, session, &impulse, 1, &count) == DYOP_OK && count >= 1);
  CHECK(impulse.impulse[2] > 0 && fabs(impulse.obstacle_point[2]) < 1e-9);
  CHECK(dyop_haptic_clearances(context, session, &clearance, 1, &count) == DYOP_OK && count == 1);
  CHECK(clearance.lower > 0 && clearance.lower <= clearance.upper && clearance.upper < 0.03);

  /* The floor rises by 0.2 within 0.1 seconds, and takes the tool along. */
  for (i = 2; i < 12; i += 3) plate[i] = 0.2;
  CHECK(dyop_haptic_give_snapshot(context, session, 0, plate, 4, 0.1, &is_taken) == DYOP_OK);
  CHECK(is_taken == 1);
  for (i = 0; i < 200; ++i) {
    CHECK(dyop_haptic_update(context, session, &device, 1e-3, 0, &tick) == DYOP_OK);
  }
  CHECK(tick.tool.position[2] > 1.2 && tick.tool.position[2] < 1.23);
  /* Half of the way down it turns back. */
  for (i = 2; i < 12; i += 3) plate[i] = 0;
  CHECK(dyop_haptic_give_snapshot(context, session, 0, plate, 4, 0.1, &is_taken) == DYOP_OK);
  for (i = 0; i < 50; ++i) {
    CHECK(dyop_haptic_update(context, session, &device, 1e-3, 0, &tick) == DYOP_OK);
  }
  CHECK(tick.tool.position[2] > 1.1 && tick.tool.position[2] < 1.13);
  for (i = 2; i < 12; i += 3) plate[i] = 0.2;
  CHECK(dyop_haptic_retarget(context, session, 0, plate, 4, 0.1, 0, &is_taken) == DYOP_OK);
  CHECK(is_taken == 1);
  CHECK(dyop_haptic_retarget(context, session, 0, plate, 4, 0.1, -1, &is_taken) ==
        DYOP_INVALID_ARGUMENT);
  for (i = 0; i < 110; ++i) {
    CHECK(dyop_haptic_update(context, session, &device, 1e-3, 0, &tick) == DYOP_OK);
  }
  CHECK(tick.tool.position[2] > 1.2 && tick.tool.position[2] < 1.23);
  CHECK(dyop_haptic_give_mesh(context, session, 0, plate, 4, halves, 1, &is_taken) == DYOP_OK);
  CHECK(dyop_haptic_give_snapshot(context, session, 1, plate, 4, 0.1, &is_taken) ==
        DYOP_INVALID_ARGUMENT);

  /* Softer springs; what no device should give; and elsewhere. */
  options.coupling.stiffness[2] = 50;
  CHECK(dyop_haptic_set_coupling(context, session, &options.coupling) == DYOP_OK);
  CHECK(dyop_haptic_update(context, session, &device, 1e-3, 0, &tick) == DYOP_OK);
  CHECK(fabs(tick.force[2] - 50 * (tick.tool.position[2] - 0.5)) < 1e-6);
  device.pose.position[0] = NAN;
  CHECK(dyop_haptic_update(context, session, &device, 1e-3, 1, &tick) == DYOP_OK);
  CHECK(tick.status == DYOP_HAPTIC_INVALID_INPUT && tick.force[2] == 0);
  device.pose.position[0] = 0;
  device.pose.position[2] = 4;
  CHECK(dyop_haptic_reset(context, session, &device) == DYOP_OK);
  CHECK(dyop_haptic_update(context, session, &device, 1e-3, 0, &tick) == DYOP_OK);
  CHECK(tick.status == DYOP_HAPTIC_FREE && tick.tool.position[2] == 4);
  CHECK(dyop_haptic_session_destroy(context, session) == DYOP_OK);
  CHECK(dyop_haptic_update(context, session, &device, 1e-3, 0, &tick) == DYOP_STALE_HANDLE);
  return 0;
}

static int check_joints_and_snapshots(dyop_context* context) {
  dyop_world_options options;
  dyop_body_definition definition;
  dyop_joint_definition hinge;
  dyop_spring_definition pull;
  dyop_advance_report report = {sizeof(dyop_advance_report)};
  dyop_world world;
  dyop_body post, arm;
  dyop_joint joint;
  dyop_spring spring;
  dyop_snapshot snapshot;
  dyop_state first, again;
  int32_t asleep = 1;
  const double none[3] = {0, 0, 0};
  CHECK(dyop_world_options_init(&options, sizeof(options)) == DYOP_OK);
  CHECK(dyop_body_definition_init(&definition, sizeof(definition)) == DYOP_OK);
  CHECK(dyop_joint_definition_init(&hinge, sizeof(hinge)) == DYOP_OK);
  CHECK(dyop_spring_definition_init(&pull, sizeof(pull)) == DYOP_OK);
  CHECK(dyop_world_options_init(NULL, sizeof(options)) == DYOP_INVALID_ARGUMENT);
  CHECK(dyop_world_options_init(&options, 8) == DYOP_INVALID_ARGUMENT);
  options.max_step = 0.01;
  CHECK(dyop_world_create(context, &options, &world) == DYOP_OK);
  CHECK(dyop_sphere_create(context, 0.2, &definition.shape) == DYOP_OK);
  CHECK(dyop_world_add_body(context, world, &definition, &arm) == DYOP_OK);
  definition.kind = DYOP_STATIC;
  definition.initial.pose.position[0] = -1;
  CHECK(dyop_world_add_body(context, world, &definition, &post) == DYOP_OK);
  /* A pendulum of length one that a motor turns at one radian per unit of time. */
  hinge.kind = DYOP_JOINT_HINGE;
  hinge.a = post;
  hinge.b = arm;
  hinge.pose_b.position[0] = -1;
  hinge.has_motor = 1;
  hinge.motor.speed = 1;
  hinge.motor.strength = 1e6;
  CHECK(dyop_world_add_joint(context, world, &hinge, &joint) == DYOP_OK && joint.number > 0);
  CHECK(dyop_world_snapshot(context, world, &snapshot) == DYOP_OK);
  CHECK(dyop_world_advance_within(context, world, 1, 600, &report) == DYOP_OK);
  CHECK(report.status == DYOP_ADVANCE_COMPLETED);
  CHECK(dyop_world_states(context, world, &arm, 1, &first) == DYOP_OK);
  CHECK(fabs(first.pose.position[0] - (cos(1) - 1)) < 0.02);
  CHECK(fabs(fabs(first.pose.position[1]) - sin(1)) < 0.02);
  CHECK(dyop_world_restore(context, world, snapshot) == DYOP_OK);
  CHECK(dyop_world_advance(context, world, 1, &report) == DYOP_OK);
  CHECK(dyop_world_states(context, world, &arm, 1, &again) == DYOP_OK);
  CHECK(memcmp(&first, &again, sizeof(first)) == 0);
  CHECK(dyop_snapshot_destroy(context, snapshot) == DYOP_OK);
  CHECK(dyop_world_restore(context, world, snapshot) == DYOP_STALE_HANDLE);
  CHECK(dyop_world_set_motor(context, world, joint, NULL) == DYOP_OK);
  CHECK(dyop_world_remove_joint(context, world, joint) == DYOP_OK);
  CHECK(dyop_world_remove_joint(context, world, joint) == DYOP_STALE_HANDLE);
  CHECK(dyop_world_set_motor(context, world, joint, NULL) == DYOP_STALE_HANDLE);
  pull.a = post;
  pull.b = arm;
  pull.rest_length = 1;
  pull.stiffness = 10;
  CHECK(dyop_world_add_spring(context, world, &pull, &spring) == DYOP_OK && spring.number > 0);
  CHECK(dyop_world_remove_spring(context, world, spring) == DYOP_OK);
  pull.stiffness = -1;
  CHECK(dyop_world_add_spring(context, world, &pull, &spring) == DYOP_INVALID_ARGUMENT);
  CHECK(dyop_world_set_gravity(context, world, none) == DYOP_OK);
  CHECK(dyop_world_set_material(context, world, arm, 0, 0.3) == DYOP_OK);
  CHECK(dyop_world_set_material(context, world, arm, 2, 0.3) == DYOP_INVALID_ARGUMENT);
  CHECK(dyop_world_set_wrench(context, world, arm, NULL, NULL) == DYOP_OK);
  CHECK(dyop_world_set_target_distance(context, world, arm, post, 0.01) == DYOP_OK);
  CHECK(dyop_world_wake(context, world, arm) == DYOP_OK);
  CHECK(dyop_world_is_asleep(context, world, arm, &asleep) == DYOP_OK && asleep == 0);
  CHECK(dyop_world_set_body_enabled(context, world, arm, 0) == DYOP_OK);
  CHECK(dyop_world_set_next_pose(context, world, arm, &first.pose, 9) == DYOP_INVALID_ARGUMENT);
  CHECK(dyop_world_advance_within(context, world, 1, 0, &report) == DYOP_INVALID_ARGUMENT);
  CHECK(dyop_world_destroy(context, world) == DYOP_OK);
  return 0;
}

/* A wheel that a motor with gains turns to 0.5, and one that follows over gears of 1 to 2. */
static int check_mechanisms(dyop_context* context) {
  dyop_world_options options = DYOP_WORLD_OPTIONS_INIT;
  dyop_body_definition definition = DYOP_BODY_DEFINITION_INIT;
  dyop_joint_definition hinge = DYOP_JOINT_DEFINITION_INIT, gear, clamp, cone;
  dyop_advance_report report = {sizeof(dyop_advance_report)};
  dyop_joint_values values = {sizeof(dyop_joint_values)};
  dyop_broken_joint broken = {sizeof(dyop_broken_joint)};
  dyop_mass_properties properties;
  dyop_joint_motor push = {0, 0, 2, 0, 0};
  dyop_world world;
  dyop_body post, wheels[2], board;
  dyop_joint joints[4];
  const double half[3] = {0.3, 0.2, 0.1};
  size_t count = 9;
  int i;
  options.max_step = 0.01;
  CHECK(dyop_world_create(context, &options, &world) == DYOP_OK);
  CHECK(dyop_sphere_create(context, 0.05, &definition.shape) == DYOP_OK);
  definition.kind = DYOP_STATIC;
  CHECK(dyop_world_add_body(context, world, &definition, &post) == DYOP_OK);
  definition.kind = DYOP_DYNAMIC;
  CHECK(dyop_box_create(context, half, &definition.shape) == DYOP_OK);
  CHECK(dyop_shape_mass_properties(context, definition.shape, 1000, &properties) == DYOP_OK);
  CHECK(fabs(properties.mass - 48) < 1e-9 && fabs(properties.inertia[8] - 48 * 0.13 / 3) < 1e-9);
  hinge.kind = DYOP_JOINT_HINGE;
  hinge.a = post;
  hinge.has_motor = 1;
  hinge.motor.position = 0.5;
  hinge.motor.stiffness = 100;
  hinge.motor.damping = 40;
  hinge.motor.strength = HUGE_VAL;
  for (i = 0; i < 2; ++i) {
    definition.initial.pose.position[0] = hinge.pose_a.position[0] = 2 * i;
    CHECK(dyop_world_add_body(context, world, &definition, &wheels[i]) == DYOP_OK);
    hinge.b = wheels[i];
    CHECK(dyop_world_add_joint(context, world, &hinge, &joints[i]) == DYOP_OK);
    hinge.has_motor = 0;
  }
  CHECK(dyop_joint_definition_init(&gear, sizeof(gear)) == DYOP_OK);
  gear.kind = DYOP_JOINT_COUPLING;
  gear.first = joints[0];
  gear.second = joints[1];
  gear.ratio = -2;
  CHECK(dyop_world_add_joint(context, world, &gear, &joints[2]) == DYOP_OK);
  CHECK(dyop_world_advance(context, world, 10, &report) == DYOP_OK);
  CHECK(dyop_world_joint_values(context, world, joints[0], &values) == DYOP_OK);
  CHECK(fabs(values.angle - 0.5) < 1e-3 && fabs(values.angle_rate) < 1e-3);
  CHECK(dyop_world_joint_values(context, world, joints[1], &values) == DYOP_OK);
  CHECK(fabs(values.angle - 0.25) < 1e-3 && values.separation < 1e-6);
  CHECK(dyop_world_joint_values(context, world, joints[2], &values) == DYOP_OK);
  CHECK(fabs(values.position) < 1e-5);
  CHECK(dyop_world_set_motor(context, world, joints[0], &push) == DYOP_INVALID_ARGUMENT);
  gear.second.number = 77;
  CHECK(dyop_world_add_joint(context, world, &gear, &joints[3]) == DYOP_STALE_HANDLE);
  CHECK(dyop_joint_definition_init(&cone, sizeof(cone)) == DYOP_OK);
  cone.a = post;
  cone.b = wheels[0];
  cone.has_swing_twist = 1;
  cone.swing = -1;
  CHECK(dyop_world_add_joint(context, world, &cone, &joints[3]) == DYOP_INVALID_ARGUMENT);

  /* A board at the end of a clamp that bears less than its weight. */
  definition.initial.pose.position[0] = 5;
  CHECK(dyop_world_add_body(context, world, &definition, &board) == DYOP_OK);
  CHECK(dyop_joint_definition_init(&clamp, sizeof(clamp)) == DYOP_OK);
  clamp.kind = DYOP_JOINT_FIXED;
  clamp.a = post;
  clamp.b = board;
  clamp.pose_a.position[0] = 5;
  clamp.break_force = 470;
  CHECK(dyop_world_add_joint(context, world, &clamp, &joints[3]) == DYOP_OK);
  CHECK(dyop_world_advance(context, world, 0.1, &report) == DYOP_OK);
  CHECK(dyop_world_broken_joints(context, world, NULL, 0, &count) == DYOP_OK && count == 0);
  options.gravity[2] = -10;
  CHECK(dyop_world_set_gravity(context, world, options.gravity) == DYOP_OK);
  CHECK(dyop_world_advance(context, world, 0.1, &report) == DYOP_OK);
  CHECK(dyop_world_broken_joints(context, world, &broken, 1, &count) == DYOP_OK && count == 1);
  CHECK(broken.joint.number == joints[3].number && fabs(broken.force - 480) < 5);
  CHECK(dyop_world_joint_values(context, world, joints[3], &values) == DYOP_STALE_HANDLE);
  CHECK(dyop_world_destroy(context, world) == DYOP_OK);
  return 0;
}

static int is_not_in(void* user, dyop_body body) {
  const dyop_body* other = (const dyop_body*)user;
  return body.index != other->index || body.generation != other->generation;
}

/* Three balls in a row along x, seen from the origin, and a ball that falls past a sensor. */
static int check_world_queries(dyop_context* context) {
  dyop_world_options options = DYOP_WORLD_OPTIONS_INIT;
  dyop_body_definition definition = DYOP_BODY_DEFINITION_INIT;
  dyop_body_filter filter = DYOP_BODY_FILTER_INIT;
  dyop_body_ray_hit hit = {sizeof(dyop_body_ray_hit)};
  dyop_toi_result cast = {sizeof(dyop_toi_result)};
  dyop_distance_result gap = {sizeof(dyop_distance_result)};
  dyop_advance_report report = {sizeof(dyop_advance_report)};
  dyop_touch_event events[2] = {{sizeof(dyop_touch_event)}};
  dyop_collision_filter bits = {2, 0, 0, 0};
  dyop_material material = {0.1, 0.2, 0, 0}, found;
  dyop_mass_properties properties;
  dyop_state start = {{{-3, 0, 0}, {1, 0, 0, 0}}, {{1, 0, 0}, {0, 0, 0}}};
  dyop_state state;
  dyop_shape small;
  dyop_motion motion;
  dyop_world world;
  dyop_body balls[3], one, list[3];
  size_t count, proven;
  const double origin[3] = {0, 0, 0}, along[3] = {2, 0, 0}, aside[3] = {0, 1, 0};
  const double impulse[3] = {0, 48, 0}, up[3] = {3, 0, 1}, zero[3] = {0, 0, 0};
  const dyop_interval interval = {0, 10};
  int i;
  options.combine_friction = DYOP_COMBINE_PRODUCT;
  options.max_step = 0.01;
  CHECK(dyop_world_create(context, &options, &world) == DYOP_OK);
  CHECK(dyop_sphere_create(context, 0.5, &definition.shape) == DYOP_OK);
  CHECK(dyop_sphere_create(context, 0.1, &small) == DYOP_OK);
  for (i = 0; i < 3; ++i) {
    definition.initial.pose.position[0] = 3 + 3 * i;
    definition.filter.category = (uint64_t)1 << i;
    CHECK(dyop_world_add_body(context, world, &definition, &balls[i]) == DYOP_OK);
  }
  CHECK(dyop_world_cast_ray(context, world, origin, along, 20, NULL, &hit) == DYOP_OK);
  CHECK(hit.status == DYOP_TOI_IMPACT && hit.body.index == balls[0].index);
  CHECK(fabs(hit.distance - 2.5) < 1e-5 && fabs(hit.normal[0] + 1) < 1e-9 && hit.triangle == -1);
  filter.mask = 6;
  CHECK(dyop_world_cast_ray(context, world, origin, along, 20, &filter, &hit) == DYOP_OK);
  CHECK(hit.body.index == balls[1].index && fabs(hit.point[0] - 5.5) < 1e-5);
  filter.accepts = is_not_in;
  filter.user = &balls[1];
  CHECK(dyop_world_cast_ray(context, world, origin, along, 20, &filter, &hit) == DYOP_OK);
  CHECK(hit.body.index == balls[2].index);
  CHECK(dyop_world_cast_ray(context, world, origin, aside, 20, NULL, &hit) == DYOP_OK);
  CHECK(hit.status == DYOP_TOI_SEPARATED && hit.body.generation == 0 && hit.distance == 20);
  CHECK(dyop_world_cast_ray(context, world, origin, zero, 20, NULL, &hit) == DYOP_INVALID_ARGUMENT);
  CHECK(dyop_constant_twist_create(context, &start, 0, &motion) == DYOP_OK);
  CHECK(dyop_world_cast_shape(context, world, small, motion, interval, NULL, NULL, &cast, &one) ==
        DYOP_OK);
  CHECK(cast.status == DYOP_TOI_IMPACT && fabs(cast.t_safe - 5.4) < 1e-5);
  CHECK(one.index == balls[0].index);
  CHECK(dyop_world_nearest(context, world, small, &start.pose, NULL, NULL, &gap, &one) == DYOP_OK);
  CHECK(one.index == balls[0].index && fabs(gap.witness.upper - 5.4) < 1e-9);
  CHECK(dyop_world_overlaps(context, world, small, &start.pose, 8.5, NULL, list, 1, &count,
                            &proven) == DYOP_OK);
  CHECK(count == 2 && proven == 2 && list[0].index == balls[0].index);

  /* Impulses, masses and shapes: 48 through a mass of 96; an arm of 1 turns it. */
  CHECK(dyop_shape_mass_properties(context, definition.shape, 1, &properties) == DYOP_OK);
  properties.mass = 96;
  CHECK(dyop_world_set_mass_properties(context, world, balls[0], &properties) == DYOP_OK);
  CHECK(dyop_world_apply_impulse(context, world, balls[0], impulse, NULL) == DYOP_OK);
  CHECK(dyop_world_states(context, world, &balls[0], 1, &state) == DYOP_OK);
  CHECK(fabs(state.twist.v[1] - 0.5) < 1e-12 && state.twist.w[0] == 0);
  CHECK(dyop_world_apply_impulse(context, world, balls[0], impulse, up) == DYOP_OK);
  CHECK(dyop_world_states(context, world, &balls[0], 1, &state) == DYOP_OK);
  CHECK(fabs(state.twist.v[1] - 1) < 1e-12 && state.twist.w[0] < 0);
  CHECK(dyop_world_apply_angular_impulse(context, world, balls[0], along) == DYOP_OK);
  CHECK(dyop_world_set_shape(context, world, balls[0], small) == DYOP_OK);
  CHECK(dyop_world_set_filter(context, world, balls[0], &bits) == DYOP_OK);
  CHECK(dyop_world_pair_material(context, world, balls[0], balls[1], &found) == DYOP_OK);
  CHECK(fabs(found.friction - 0.25) < 1e-12 && found.restitution == 0.5);
  CHECK(dyop_world_set_pair_material(context, world, balls[0], balls[1], &material) == DYOP_OK);
  CHECK(dyop_world_pair_material(context, world, balls[1], balls[0], &found) == DYOP_OK);
  CHECK(found.friction == 0.2 && found.restitution == 0.1);
  CHECK(dyop_world_set_pair_material(context, world, balls[0], balls[1], NULL) == DYOP_OK);

  /* A sensor that flies through the second ball, and a ball that meets the third. */
  definition.filter.category = 1;
  definition.is_sensor = 1;
  definition.initial.pose.position[0] = 6;
  definition.initial.pose.position[1] = -2;
  definition.initial.twist.v[1] = 2;
  CHECK(dyop_world_add_body(context, world, &definition, &one) == DYOP_OK);
  definition.is_sensor = 0;
  definition.initial.pose.position[0] = 9;
  CHECK(dyop_world_add_body(context, world, &definition, &one) == DYOP_OK);
  CHECK(dyop_world_advance(context, world, 0.9, &report) == DYOP_OK);
  CHECK(dyop_world_sensor_events(context, world, events, 2, &count) == DYOP_OK);
  CHECK(count == 1 && events[0].is_begin == 1 && fabs(events[0].t - 0.5) < 0.02);
  CHECK(events[0].b.index == balls[1].index);
  CHECK(dyop_world_contact_events(context, world, events, 2, &count) == DYOP_OK);
  CHECK(count >= 1 && events[0].is_begin == 1 && fabs(events[0].t - 0.5) < 0.02);
  CHECK(dyop_world_destroy(context, world) == DYOP_OK);
  return 0;
}

static int check_refusals(dyop_context* context) {
  dyop_shape shape = {0, 0};
  const int before = log_count;
  dyop_toi_query query = {sizeof(dyop_toi_query), 0, {0, 0}, {0, 0}, {0, 0}, {0, 0}, {0, 1}};
  dyop_toi_result result = {sizeof(dyop_toi_result)};
  struct {
    dyop_toi_options options;
    double from_the_future;
  } newer = {DYOP_TOI_OPTIONS_INIT, 0};

  CHECK(dyop_sphere_create(context, -1, &shape) == DYOP_INVALID_ARGUMENT);
  CHECK(dyop_sphere_create(context, NAN, &shape) == DYOP_INVALID_ARGUMENT);
  CHECK(dyop_sphere_create(context, 1, NULL) == DYOP_INVALID_ARGUMENT);
  CHECK(dyop_sphere_create(NULL, 1, &shape) == DYOP_INVALID_ARGUMENT);
  CHECK(dyop_shape_destroy(context, shape) == DYOP_STALE_HANDLE);
  CHECK(dyop_time_of_impact(context, &query, NULL, &result) == DYOP_STALE_HANDLE);
  CHECK(dyop_time_of_impact(context, NULL, NULL, &result) == DYOP_INVALID_ARGUMENT);
  newer.options.size = sizeof(newer);
  CHECK(dyop_time_of_impact(context, &query, &newer.options, &result) == DYOP_STALE_HANDLE);
  newer.from_the_future = 1;
  CHECK(dyop_time_of_impact(context, &query, &newer.options, &result) == DYOP_UNSUPPORTED);
  newer.options.size = 0;
  CHECK(dyop_time_of_impact(context, &query, &newer.options, &result) == DYOP_INVALID_ARGUMENT);
  CHECK(log_count == before + 9);
  CHECK(strcmp(dyop_status_text(DYOP_STALE_HANDLE), "stale handle") == 0);
  return 0;
}

int main(void) {
  dyop_context_options options = DYOP_CONTEXT_OPTIONS_INIT;
  dyop_context* context = NULL;
  int failed;
  options.log = log_error;
  options.user = &context;
  options.allocate = allocate;
  CHECK(dyop_context_create(&options, &context) == DYOP_INVALID_ARGUMENT && !context);
  options.deallocate = deallocate;
  CHECK(dyop_context_create(&options, &context) == DYOP_OK);
  CHECK(dyop_version() >= 200);
  failed = check_queries(context);
  if (!failed) failed = check_batch(context);
  if (!failed) failed = check_world(context);
  if (!failed) failed = check_calls_from_callbacks(context);
  if (!failed) failed = check_near_things(context);
  if (!failed) failed = check_more_shapes(context);
  if (!failed) failed = check_obstacles(context);
  if (!failed) failed = check_chain(context);
  if (!failed) failed = check_robots(context);
  if (!failed) failed = check_deforming(context);
  if (!failed) failed = check_haptics(context);
  if (!failed) failed = check_two_tools(context);
  if (!failed) failed = check_joints_and_snapshots(context);
  if (!failed) failed = check_mechanisms(context);
  if (!failed) failed = check_world_queries(context);
  if (!failed) failed = check_refusals(context);
  if (failed) return 1;
  CHECK(allocated > 0);
  dyop_context_destroy(context);
  CHECK(allocated == 0);
  dyop_context_destroy(NULL);
  return 0;
}
