/* SPDX-License-Identifier: BSD-3-Clause */
#ifndef DYOP_C_IO_H
#define DYOP_C_IO_H

/* What of the C interface reads files: the library dyop_c_io. As in dyop_c.h; a file that cannot be
 * used is DYOP_FILE_ERROR, with a message of one line. Names are UTF-8. */
#include "dyop/dyop_c.h"

#ifdef __cplusplus
extern "C" {
#endif

/* A mesh from OBJ, OFF, PLY, STL (also gzipped) in double precision, from others through assimp, or
 * from an ESRI ASCII grid; scaled by `scale`, > 0. */
DYOP_C_API dyop_status dyop_mesh_load(dyop_context* context, const char* file, double scale,
                                      dyop_shape* shape);
/* The occupied leaves of an OctoMap file, as dyop_occupancy_create. */
DYOP_C_API dyop_status dyop_octree_load(dyop_context* context, const char* file, dyop_shape* shape);
/* A motion from JSON: docs/formats.md. */
DYOP_C_API dyop_status dyop_motion_load(dyop_context* context, const char* file,
                                        dyop_motion* motion);

/* --- Robots ----------------------------------------------------------------------------------- */

typedef enum dyop_robot_base {
  DYOP_BASE_FIXED = 0,
  DYOP_BASE_PLANAR = 1,
  DYOP_BASE_FLOATING = 2
} dyop_robot_base;

typedef struct dyop_robot_file_options {
  uint32_t size;
  int32_t base;     /* dyop_robot_base */
  const char* srdf; /* null: none */
  const char* const*
      package_paths; /* where package:// is searched for, besides the file's folder */
  size_t package_path_count;
  int32_t trusts_never; /* 1: leave out the pairs that the SRDF file claims never to meet */
  int32_t reserved;
} dyop_robot_file_options;

#define DYOP_ROBOT_FILE_OPTIONS_INIT \
  { sizeof(dyop_robot_file_options), DYOP_BASE_FIXED, NULL, NULL, 0, 0, 0 }
DYOP_C_API dyop_status dyop_robot_file_options_init(dyop_robot_file_options* value, uint32_t size);

/* A robot from URDF or MJCF: docs/robots.md. */
DYOP_C_API dyop_status dyop_robot_load(dyop_context* context, const char* file,
                                       const dyop_robot_file_options* options, dyop_robot* robot);

typedef enum dyop_path_interpolation {
  DYOP_INTERPOLATE_LINEAR = 0,
  DYOP_INTERPOLATE_CUBIC = 1,
  DYOP_INTERPOLATE_QUINTIC = 2
} dyop_path_interpolation;

/* The path of a robot's free coordinates from CSV or a joint-trajectory message. `rest`: null, or a
 * value for each free coordinate that the file does not name. */
DYOP_C_API dyop_status dyop_joint_path_load(dyop_context* context, const char* file,
                                            dyop_robot robot, int32_t interpolation,
                                            const double* rest, size_t free_count,
                                            dyop_joint_path* path);
/* A planning scene of MoveIt: what stands around the robot, the robot that holds what is held and
 * ignores what it may touch, and its state in free coordinates. */
DYOP_C_API dyop_status dyop_planning_scene_load(dyop_context* context, const char* file,
                                                dyop_robot robot, dyop_obstacle_set* obstacles,
                                                dyop_robot* placed, double* state,
                                                size_t free_count);

/* --- Scenes ----------------------------------------------------------------------------------- */

/* The world of a scene file (docs/formats.md) at time 0; meshes are sought beside it. `bodies` in
 * the order of the file; `capacity` and `count` as for dyop_world_impacts. `step`, `end_time`: the
 * length of one dyop_world_advance and the time to end at, which the file proposes. */
DYOP_C_API dyop_status dyop_world_load(dyop_context* context, const char* file, dyop_world* world,
                                       dyop_body* bodies, size_t capacity, size_t* count,
                                       double* step, double* end_time);
/* The session of a scene of a haptic tool (docs/formats.md). */
DYOP_C_API dyop_status dyop_haptic_session_load(dyop_context* context, const char* file,
                                                dyop_haptic_session* session);
/* Records all that a session is given and all of its ticks in a file (docs/formats.md), from its
 * start, so before it is given anything. `waits`: 1: where the file is 2048 ticks behind, a tick
 * waits for it; 0: it is left out. Stop it before the session is released, and from the thread of
 * the ticks; it says whether everything could be written. */
DYOP_C_API dyop_status dyop_haptic_session_record(dyop_context* context,
                                                  dyop_haptic_session session, const char* file,
                                                  int32_t waits);
DYOP_C_API dyop_status dyop_haptic_session_stop_recording(dyop_context* context,
                                                          dyop_haptic_session session);

#ifdef __cplusplus
}
#endif

#endif /* DYOP_C_IO_H */
