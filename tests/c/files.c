/* SPDX-License-Identifier: BSD-3-Clause */

/* Reads every kind of file through the C interface. Writes the files into the folder it runs in;
 * its arguments are a scene, a scene of a haptic tool, and a recording to make, if it can be.
 * Returns 1 if a check fails. */
#include <math.h>
#include <stdio.h>
#include <string.h>

#include "dyop/dyop_c_io.h"

#define CHECK(condition)                             \
  do {                                               \
    if (!(condition)) {                              \
      printf("line %d: %s\n", __LINE__, #condition); \
      return __LINE__;                               \
    }                                                \
  } while (0)

static int write_file(const char* name, const char* text) {
  FILE* file = fopen(name, "w");
  CHECK(file && fputs(text, file) >= 0 && fclose(file) == 0);
  return 0;
}

static int check_shapes(dyop_context* context) {
  dyop_shape mesh;
  dyop_mass_properties properties;
  dyop_motion motion;
  dyop_state state;
  char text[200];
  CHECK(write_file("corner.obj",
                   "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\n"
                   "f 1 3 2\nf 1 2 4\nf 2 3 4\nf 1 4 3\n") == 0);
  CHECK(dyop_mesh_load(context, "corner.obj", 2, &mesh) == DYOP_OK);
  CHECK(dyop_shape_mass_properties(context, mesh, 3, &properties) == DYOP_OK);
  CHECK(fabs(properties.mass - 3 * 8.0 / 6) < 1e-12);
  CHECK(dyop_mesh_load(context, "corner.obj", 0, &mesh) == DYOP_INVALID_ARGUMENT);
  CHECK(dyop_mesh_load(context, NULL, 1, &mesh) == DYOP_INVALID_ARGUMENT);
  CHECK(dyop_mesh_load(context, "missing.obj", 1, &mesh) == DYOP_FILE_ERROR);
  CHECK(dyop_last_error(context, text, sizeof(text)) == DYOP_OK && strstr(text, "missing.obj"));
  CHECK(strcmp(dyop_status_text(DYOP_FILE_ERROR), "file error") == 0);
  CHECK(write_file("bad.bt", "no octree") == 0);
  CHECK(dyop_octree_load(context, "bad.bt", &mesh) == DYOP_FILE_ERROR);
  CHECK(write_file("slide.json",
                   "{\"kind\": \"constant_twist\", \"pose\": {\"position\": [1, 0, 0]},"
                   " \"velocity\": {\"linear\": [0, 2, 0]}}") == 0);
  CHECK(dyop_motion_load(context, "slide.json", &motion) == DYOP_OK);
  CHECK(dyop_motion_state(context, motion, 3, &state) == DYOP_OK);
  CHECK(state.pose.position[0] == 1 && fabs(state.pose.position[1] - 6) < 1e-12);
  return 0;
}

/* One joint turns a bar with a mesh at its end, another one follows it. */
static int check_robot(dyop_context* context) {
  dyop_robot_file_options options;
  dyop_robot robot, placed;
  dyop_robot_info info = {sizeof(dyop_robot_info)};
  dyop_joint_path path, whole;
  dyop_obstacle_set set;
  dyop_chain chain;
  dyop_chain_result result = {sizeof(dyop_chain_result)};
  const char* folders[1] = {"."};
  double lower, upper, state = 0, at = 0.5, chain_at[2];
  CHECK(write_file("arm.urdf",
                   "<robot name=\"arm\"><link name=\"base\"/><link name=\"bar\"><collision>"
                   "<origin xyz=\"1 0 0\"/><geometry><sphere radius=\"0.1\"/></geometry>"
                   "</collision></link><link name=\"tip\"><collision><geometry>"
                   "<mesh filename=\"package://somewhere/corner.obj\" scale=\"0.1 0.1 0.1\"/>"
                   "</geometry></collision></link>"
                   "<joint name=\"turn\" type=\"revolute\"><parent link=\"base\"/>"
                   "<child link=\"bar\"/><axis xyz=\"0 0 1\"/>"
                   "<limit lower=\"-1\" upper=\"2\" effort=\"1\" velocity=\"1\"/></joint>"
                   "<joint name=\"follow\" type=\"continuous\"><parent link=\"bar\"/>"
                   "<child link=\"tip\"/><axis xyz=\"0 0 1\"/>"
                   "<mimic joint=\"turn\" multiplier=\"-2\"/></joint></robot>") == 0);
  CHECK(write_file("arm.srdf",
                   "<robot name=\"arm\"><disable_collisions link1=\"bar\" "
                   "link2=\"tip\" reason=\"Adjacent\"/></robot>") == 0);
  CHECK(dyop_robot_file_options_init(&options, sizeof(options)) == DYOP_OK);
  CHECK(dyop_robot_file_options_init(&options, 8) == DYOP_INVALID_ARGUMENT);
  options.srdf = "arm.srdf";
  options.package_paths = folders;
  options.package_path_count = 1;
  CHECK(dyop_robot_load(context, "arm.urdf", &options, &robot) == DYOP_OK);
  CHECK(dyop_robot_describe(context, robot, &info) == DYOP_OK);
  CHECK(info.link_count == 3 && info.coordinate_count == 2 && info.free_count == 1);
  CHECK(dyop_robot_limits(context, robot, &lower, &upper, 1) == DYOP_OK);
  CHECK(lower == -1 && upper == 2);
  CHECK(dyop_robot_expand(context, robot, &at, 1, chain_at, 2) == DYOP_OK);
  CHECK(chain_at[0] == 0.5 && chain_at[1] == -1);
  options.base = 5;
  CHECK(dyop_robot_load(context, "arm.urdf", &options, &robot) == DYOP_INVALID_ARGUMENT);
  options.base = DYOP_BASE_FIXED;
  options.srdf = "missing.srdf";
  CHECK(dyop_robot_load(context, "arm.urdf", &options, &robot) == DYOP_FILE_ERROR);

  /* A post at (0, 1, 0), met when the ball is 0.2 away: at pi/2 - 2 asin(0.1). */
  CHECK(write_file("plan.csv", "time,turn\n0,0\n1,2\n") == 0);
  CHECK(write_file("cell.yaml",
                   "world:\n  collision_objects:\n    - id: post\n      primitives:\n"
                   "        - {type: 2, dimensions: [0.1]}\n      primitive_poses:\n"
                   "        - position: [0, 1, 0]\n          orientation: [0, 0, 0, 1]\n"
                   "robot_state:\n  joint_state:\n    name: [turn]\n    position: [0.25]\n") == 0);
  CHECK(dyop_planning_scene_load(context, "cell.yaml", robot, &set, &placed, &state, 1) == DYOP_OK);
  CHECK(state == 0.25);
  CHECK(dyop_planning_scene_load(context, "cell.yaml", robot, &set, &placed, &state, 2) ==
        DYOP_INVALID_ARGUMENT);
  CHECK(dyop_joint_path_load(context, "plan.csv", placed, DYOP_INTERPOLATE_LINEAR, NULL, 0,
                             &path) == DYOP_OK);
  CHECK(dyop_joint_path_load(context, "plan.csv", placed, 9, NULL, 0, &path) ==
        DYOP_INVALID_ARGUMENT);
  CHECK(dyop_robot_expand_path(context, placed, path, &whole) == DYOP_OK);
  CHECK(dyop_robot_chain(context, placed, &chain) == DYOP_OK);
  CHECK(dyop_certify_batch(context, chain, &whole, 1, set, 0xFFFFFFFFu, 1, NULL, NULL, &result) ==
        DYOP_OK);
  CHECK(result.status == DYOP_TOI_IMPACT && result.link_a == 1);
  CHECK(fabs(2 * result.t_safe - (acos(0) - 2 * asin(0.1))) < 1e-4);
  return 0;
}

static int check_scenes(dyop_context* context, const char* scene, const char* tool) {
  dyop_world world;
  dyop_body bodies[2];
  dyop_state state;
  dyop_advance_report report = {sizeof(dyop_advance_report)};
  dyop_haptic_session session;
  dyop_haptic_tick tick = {sizeof(dyop_haptic_tick)};
  dyop_device_pose device = {DYOP_POSE_IDENTITY, {0, 0, 0, 0}};
  size_t count;
  double step, end_time, before;
  CHECK(dyop_world_load(context, scene, &world, bodies, 2, &count, &step, &end_time) == DYOP_OK);
  CHECK(count == 6 && step > 0 && end_time >= step);
  CHECK(dyop_world_states(context, world, &bodies[1], 1, &state) == DYOP_OK);
  before = state.pose.position[2];
  CHECK(dyop_world_advance(context, world, 10 * step, &report) == DYOP_OK);
  CHECK(report.status == DYOP_ADVANCE_COMPLETED && fabs(report.t - 10 * step) < 1e-9);
  CHECK(dyop_world_states(context, world, &bodies[1], 1, &state) == DYOP_OK);
  CHECK(state.pose.position[2] < before);
  CHECK(dyop_world_load(context, tool, &world, bodies, 2, &count, &step, &end_time) ==
        DYOP_FILE_ERROR);
  CHECK(dyop_haptic_session_load(context, tool, &session) == DYOP_OK);
  device.pose.position[2] = 80;
  CHECK(dyop_haptic_update(context, session, &device, 1e-3, 0, &tick) == DYOP_OK);
  CHECK(tick.status == DYOP_HAPTIC_FREE && fabs(tick.tool.position[2] - 80) < 1e-9);
  return 0;
}

/* The recording stays for the tests that replay and check it. Without HDF5 there is none. */
static int check_recording(dyop_context* context, const char* file) {
  const double plate[12] = {-9, -9, 0, 9, -9, 0, 9, 9, 0, -9, 9, 0};
  const double raised[12] = {-9, -9, 0.1, 9, -9, 0.1, 9, 9, 0.1, -9, 9, 0.1};
  const int32_t halves[6] = {0, 1, 2, 0, 2, 3};
  dyop_tool_part part = DYOP_TOOL_PART_INIT;
  dyop_tool_obstacle tissue = DYOP_TOOL_OBSTACLE_INIT;
  dyop_haptic_options options = DYOP_HAPTIC_OPTIONS_INIT;
  dyop_haptic_session session;
  dyop_device_pose device = {{{0, 0, 3}, {1, 0, 0, 0}}, {0, 0, 0, 0}};
  dyop_haptic_tick tick = {sizeof(dyop_haptic_tick)};
  int32_t is_taken = 0;
  int i;
  CHECK(dyop_sphere_create(context, 1, &part.shape) == DYOP_OK);
  CHECK(dyop_mesh_create(context, plate, 4, halves, 2, &tissue.shape) == DYOP_OK);
  tissue.is_deforming = 1;
  options.rest_offset = 0.01;
  options.recovery_speed = 1;
  for (i = 0; i < 3; ++i) {
    options.coupling.stiffness[i] = 100;
    options.coupling.rotational_stiffness[i] = 100;
  }
  CHECK(dyop_haptic_session_create(context, &part, 1, NULL, 0, &tissue, 1, &device.pose, &options,
                                   &session) == DYOP_OK);
  CHECK(dyop_haptic_session_stop_recording(context, session) == DYOP_INVALID_ARGUMENT);
  CHECK(dyop_haptic_session_record(context, session, NULL, 1) == DYOP_INVALID_ARGUMENT);
  CHECK(dyop_haptic_session_record(context, session, "none/run.h5", 1) == DYOP_FILE_ERROR);
  CHECK(dyop_haptic_session_record(context, session, file, 1) == DYOP_OK);
  CHECK(dyop_haptic_session_record(context, session, file, 1) == DYOP_INVALID_ARGUMENT);
  for (i = 0; i < 300; ++i) {
    device.pose.position[2] = fmax(0.5, 3 - 0.05 * (i % 150));
    if (i == 90) {
      CHECK(dyop_haptic_give_snapshot(context, session, 0, raised, 4, 0.1, &is_taken) == DYOP_OK);
    }
    options.coupling.stiffness[2] = 50;
    if (i == 120) CHECK(dyop_haptic_set_coupling(context, session, &options.coupling) == DYOP_OK);
    if (i == 150) CHECK(dyop_haptic_reset(context, session, &device) == DYOP_OK);
    CHECK(dyop_haptic_update(context, session, &device, 1e-3, 0, &tick) == DYOP_OK);
  }
  CHECK(dyop_haptic_session_stop_recording(context, session) == DYOP_OK);
  CHECK(dyop_haptic_session_stop_recording(context, session) == DYOP_INVALID_ARGUMENT);
  CHECK(dyop_haptic_update(context, session, &device, 1e-3, 0, &tick) == DYOP_OK);
  CHECK(dyop_haptic_session_record(context, session, file, 1) == DYOP_INVALID_ARGUMENT);
  return 0;
}

int main(int argc, char** argv) {
  dyop_context* context = NULL;
  int failed;
  CHECK(argc == 3 || argc == 4);
  CHECK(dyop_context_create(NULL, &context) == DYOP_OK);
  failed = check_shapes(context);
  if (!failed) failed = check_robot(context);
  if (!failed) failed = check_scenes(context, argv[1], argv[2]);
  if (!failed && argc == 4) failed = check_recording(context, argv[3]);
  dyop_context_destroy(context);
  return failed != 0;
}
