// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <filesystem>

#include "c/context.h"
#include "c/convert.h"
#include "dyop/dyop_c_io.h"
#include "dyop/io/file_error.h"
#ifdef DYOP_HAS_RECORDING
#include "dyop/io/haptic_recorder.h"
#endif
#include "dyop/io/haptic_scene_file.h"
#include "dyop/io/mesh_file.h"
#include "dyop/io/motion_file.h"
#include "dyop/io/octree_file.h"
#include "dyop/io/planning_scene_file.h"
#include "dyop/io/robot_file.h"
#include "dyop/io/scene_file.h"

namespace dyop::c {
namespace {

static_assert(int(RobotBase::Planar) == DYOP_BASE_PLANAR);
static_assert(int(RobotBase::Floating) == DYOP_BASE_FLOATING);
static_assert(int(PathInterpolation::Cubic) == DYOP_INTERPOLATE_CUBIC);
static_assert(int(PathInterpolation::Quintic) == DYOP_INTERPOLATE_QUINTIC);

std::filesystem::path path_from(const char* name, const char* what) {
  const char* const given = require_given(name, what);
  return std::filesystem::path(reinterpret_cast<const char8_t*>(given));
}

// guard() for a call that uses files.
template <typename Call>
dyop_status use_files(dyop_context* context, const Call& call) {
  return guard(context, [&] {
    try {
      call();
    } catch (const FileError& error) {
      throw FileFailure(error.what());
    }
  });
}

template <typename Call>
dyop_status read_file(dyop_context* context, const char* file, const Call& call) {
  return use_files(context, [&] { call(path_from(file, "file")); });
}

#ifdef DYOP_HAS_RECORDING

void start_recording(HapticSession& session, const std::filesystem::path& file, bool waits) {
  record_session(session, file, {}, waits);
}

void stop_recording(HapticSession& session) {
  const auto recorder = std::dynamic_pointer_cast<HapticRecorder>(session.observer());
  DYOP_REQUIRE(recorder, "the session is not recorded");
  session.observe(nullptr);
  recorder->finish();
}

#else

void start_recording(HapticSession& /*session*/, const std::filesystem::path& file,
                     bool /*waits*/) {
  throw FileError(file, "cannot be written: this library was built without HDF5");
}

void stop_recording(HapticSession& /*session*/) {
  throw InvalidArgument("the session is not recorded");
}

#endif

RobotFileOptions options_from(const dyop_robot_file_options* given) {
  const auto c = read_struct<dyop_robot_file_options>(given, DYOP_ROBOT_FILE_OPTIONS_INIT,
                                                      "dyop_robot_file_options");
  DYOP_REQUIRE(c.base >= DYOP_BASE_FIXED && c.base <= DYOP_BASE_FLOATING,
               "base of a robot must be a dyop_robot_base, not ", c.base);
  DYOP_REQUIRE(c.package_paths || c.package_path_count == 0, "package_paths must not be null");
  RobotFileOptions options;
  options.base = static_cast<RobotBase>(c.base);
  options.trusts_never = c.trusts_never != 0;
  if (c.srdf) options.srdf = path_from(c.srdf, "srdf");
  for (std::size_t i = 0; i < c.package_path_count; ++i) {
    options.package_paths.push_back(path_from(c.package_paths[i], "a package path"));
  }
  return options;
}

// An object with nothing in it but a set.
std::shared_ptr<ObstacleObject> object_of(ObstacleSet set) {
  auto object = std::make_shared<ObstacleObject>();
  object->set = std::move(set);
  return object;
}

}  // namespace
}  // namespace dyop::c

using dyop::c::read_file;
using dyop::c::require_given;
using dyop::c::use_files;
using Path = std::filesystem::path;

dyop_status dyop_mesh_load(dyop_context* context, const char* file, double scale,
                           dyop_shape* shape) {
  return read_file(context, file, [&](const Path& path) {
    dyop::MeshPlacement placement;
    placement.scale = scale;
    context->add<dyop::TriangleMesh>(context->shapes, shape,
                                     dyop::place_mesh(dyop::load_mesh(path), placement));
  });
}

dyop_status dyop_octree_load(dyop_context* context, const char* file, dyop_shape* shape) {
  return read_file(context, file, [&](const Path& path) {
    context->add<dyop::CompoundShape>(context->shapes, shape,
                                      dyop::occupancy(dyop::load_octree(path)));
  });
}

dyop_status dyop_motion_load(dyop_context* context, const char* file, dyop_motion* motion) {
  return read_file(context, file, [&](const Path& path) {
    context->adopt(context->motions, motion, dyop::load_motion(path));
  });
}

dyop_status dyop_robot_file_options_init(dyop_robot_file_options* value, uint32_t size) {
  if (!value || size < sizeof(dyop_robot_file_options)) return DYOP_INVALID_ARGUMENT;
  const dyop_robot_file_options defaults = DYOP_ROBOT_FILE_OPTIONS_INIT;
  dyop::c::write_struct(defaults, size, value);
  return DYOP_OK;
}

dyop_status dyop_robot_load(dyop_context* context, const char* file,
                            const dyop_robot_file_options* options, dyop_robot* robot) {
  return read_file(context, file, [&](const Path& path) {
    context->add<dyop::Robot>(context->robots, robot,
                              dyop::load_robot(path, dyop::c::options_from(options)));
  });
}

dyop_status dyop_joint_path_load(dyop_context* context, const char* file, dyop_robot robot,
                                 int32_t interpolation, const double* rest, size_t free_count,
                                 dyop_joint_path* path) {
  return read_file(context, file, [&](const Path& from) {
    DYOP_REQUIRE(
        interpolation >= DYOP_INTERPOLATE_LINEAR && interpolation <= DYOP_INTERPOLATE_QUINTIC,
        "interpolation must be a dyop_path_interpolation, not ", interpolation);
    std::optional<dyop::JointVector> resting;
    if (rest) resting = Eigen::Map<const dyop::JointVector>(rest, Eigen::Index(free_count));
    context->add<dyop::JointPath>(
        context->joint_paths, path,
        dyop::load_joint_path(from, *context->robot(robot),
                              static_cast<dyop::PathInterpolation>(interpolation), resting));
  });
}

dyop_status dyop_planning_scene_load(dyop_context* context, const char* file, dyop_robot robot,
                                     dyop_obstacle_set* obstacles, dyop_robot* placed,
                                     double* state, size_t free_count) {
  return read_file(context, file, [&](const Path& path) {
    require_given(placed, "placed");
    const auto object = context->robot(robot);
    DYOP_REQUIRE(state && free_count == object->free_count(), "state must have room for ",
                 object->free_count(), " free coordinates, not ", free_count);
    const dyop::PlanningScene scene = dyop::load_planning_scene(path, *object);
    dyop::Robot holding = scene.place(*object);
    context->adopt(context->obstacle_sets, obstacles, dyop::c::object_of(scene.obstacles()));
    context->add<dyop::Robot>(context->robots, placed, std::move(holding));
    std::copy(scene.state.begin(), scene.state.end(), state);
  });
}

dyop_status dyop_world_load(dyop_context* context, const char* file, dyop_world* world,
                            dyop_body* bodies, size_t capacity, size_t* count, double* step,
                            double* end_time) {
  return read_file(context, file, [&](const Path& path) {
    DYOP_REQUIRE(count && step && end_time && (bodies || capacity == 0),
                 "count, step, end_time and bodies must not be null");
    dyop::Scene scene = dyop::load_scene(path);
    scene.options.records_motions = false;
    context->add<dyop::c::WorldObject>(
        context->worlds, world,
        [&](std::function<void(dyop::Scalar)> on_step) {
          scene.options.on_step = std::move(on_step);
          return dyop::make_world(scene);
        },
        std::function<void(dyop::Scalar)>());
    *count = scene.bodies.size();
    *step = scene.step;
    *end_time = scene.end_time;
    for (std::size_t i = 0; i < std::min(capacity, scene.bodies.size()); ++i) {
      bodies[i] = dyop::c::to_c(dyop::BodyId(std::uint32_t(i), 0));
    }
  });
}

dyop_status dyop_haptic_session_load(dyop_context* context, const char* file,
                                     dyop_haptic_session* session) {
  return read_file(context, file, [&](const Path& path) {
    const dyop::HapticRun run = dyop::load_haptic_run(path);
    context->add<dyop::HapticSession>(context->haptic_sessions, session, run.scene, run.options);
  });
}

dyop_status dyop_haptic_session_record(dyop_context* context, dyop_haptic_session session,
                                       const char* file, int32_t waits) {
  return read_file(context, file, [&](const Path& path) {
    dyop::c::start_recording(*context->haptic_session(session), path, waits != 0);
  });
}

dyop_status dyop_haptic_session_stop_recording(dyop_context* context, dyop_haptic_session session) {
  return use_files(context, [&] { dyop::c::stop_recording(*context->haptic_session(session)); });
}
