// SPDX-License-Identifier: BSD-3-Clause
#include "c/context.h"

#include <algorithm>
#include <atomic>
#include <cstring>
#include <new>

#include "core/deadline.h"
#include "dyop/core/error.h"
#include "dyop/dynamics/integrator.h"

namespace dyop::c {
namespace {

// In addition to core's own: the handler in a form that C can provide.
std::atomic<void (*)(const char*)> the_c_handler{nullptr};

void call_c_handler(const std::string& message) {
  if (const auto handler = the_c_handler.load()) handler(message.c_str());
}

void keep_error(dyop_context& context, const char* message) noexcept {
  const std::lock_guard lock(context.error_mutex);
  try {
    context.last_error = message;
  } catch (const std::bad_alloc&) {
    context.last_error.clear();
  }
}

void report(dyop_context& context, const char* message) noexcept {
  keep_error(context, message);
  if (!context.hooks.log) return;
  const std::lock_guard one_at_a_time(context.log_mutex);
  if (context.is_logging) return;  // a failure inside the log, which would go on for ever
  context.is_logging = true;
  context.hooks.log(context.hooks.user, DYOP_LOG_ERROR, message);
  context.is_logging = false;
  keep_error(context, message);  // not that of a call inside the log
}

template <typename Object, typename Handle>
std::shared_ptr<Object> find(const dyop_context& context, const HandleTable<Object>& table,
                             Handle handle, const char* what) {
  const std::shared_lock lock(context.mutex);
  std::shared_ptr<Object> object = table.find(handle);
  if (!object) {
    throw StaleHandle(core_internal::compose_message(what, " ", handle.index, " of generation ",
                                                     handle.generation, " is stale"));
  }
  return object;
}

}  // namespace

void* HookMemory::do_allocate(std::size_t size, std::size_t alignment) {
  if (!hooks_.allocate) return std::pmr::new_delete_resource()->allocate(size, alignment);
  void* const memory = hooks_.allocate(hooks_.user, size, alignment);
  if (!memory) throw std::bad_alloc();
  return memory;
}

void HookMemory::do_deallocate(void* memory, std::size_t size, std::size_t alignment) {
  if (hooks_.allocate) {
    hooks_.deallocate(hooks_.user, memory, size, alignment);
  } else {
    std::pmr::new_delete_resource()->deallocate(memory, size, alignment);
  }
}

namespace {

struct RunningCall {
  explicit RunningCall(dyop_context& the_context) : context(the_context) {
    ++context.running_calls;
  }
  ~RunningCall() { --context.running_calls; }
  RunningCall(const RunningCall&) = delete;
  RunningCall& operator=(const RunningCall&) = delete;

  dyop_context& context;
};

}  // namespace

WorldObject::WorldObject(const WorldOptions& options)
    : WorldObject(
          [&](OnStep on_step) {
            WorldOptions own = options;
            own.on_step = std::move(on_step);
            return World(own);
          },
          options.on_step) {}

WorldObject::WorldObject(const std::function<World(OnStep)>& make, OnStep on_step)
    : world_(make([this, on_step = std::move(on_step)](Scalar t) {
        if (!on_step) return;
        is_between_steps_ = true;
        on_step(t);
        is_between_steps_ = false;
      })) {}

World& WorldObject::to_change() {
  const std::lock_guard lock(mutex_);
  DYOP_REQUIRE(!is_advancing_, "a world cannot be changed while it is advanced");
  DYOP_REQUIRE(queries_ == 0, "a world cannot be changed while it answers a query");
  return world_;
}

const World& WorldObject::to_read() const {
  const std::lock_guard lock(mutex_);
  DYOP_REQUIRE(!is_advancing_ || thread_ == std::this_thread::get_id(),
               "a world that another thread advances cannot be read");
  return world_;
}

const AdvanceEvents& WorldObject::events() const {
  to_read();
  return events_;
}

void WorldObject::ask(const std::function<void(const World&)>& query) const {
  {
    const std::lock_guard lock(mutex_);
    DYOP_REQUIRE(!is_advancing_ || (thread_ == std::this_thread::get_id() && is_between_steps_),
                 "a world that is advanced answers queries in on_step only");
    ++queries_;
  }
  struct Ended {
    const WorldObject& object;
    ~Ended() {
      const std::lock_guard lock(object.mutex_);
      --object.queries_;
    }
  } const ended{*this};
  const std::lock_guard turn(asking_);
  query(world_);
}

AdvanceReport WorldObject::advance(Scalar dt, const AdvanceLimits& limits) {
  {
    const std::lock_guard lock(mutex_);
    DYOP_REQUIRE(!is_advancing_, "a world cannot be advanced while it is advanced");
    DYOP_REQUIRE(queries_ == 0, "a world cannot be advanced while it answers a query");
    is_advancing_ = true;
    thread_ = std::this_thread::get_id();
  }
  struct Ended {
    WorldObject& object;
    ~Ended() {
      const std::lock_guard lock(object.mutex_);
      object.is_advancing_ = false;
    }
  } const ended{*this};
  events_ = {};
  AdvanceReport report = world_.advance(dt, limits);
  events_ = {std::move(report.impacts), std::move(report.contact_events), std::move(report.sensors),
             std::move(report.broken_joints)};
  return report;
}

thread_local const Reading* Reading::innermost_ = nullptr;

Reading::Reading(const ReadObject& object, bool locks)
    : object_(object), outer_(innermost_), lock_(object.mutex, std::defer_lock) {
  if (locks) lock_.lock();
  innermost_ = this;
}

std::unique_lock<std::shared_mutex> Reading::change(const ReadObject& object) {
  for (const Reading* query = innermost_; query; query = query->outer_) {
    DYOP_REQUIRE(&query->object_ != &object,
                 "a callback cannot change what the query that calls it reads");
  }
  return std::unique_lock(object.mutex);
}

std::chrono::steady_clock::time_point deadline_after(double seconds) {
  DYOP_REQUIRE(seconds > 0, "seconds must be > 0, not ", seconds);
  return core_internal::deadline_after(seconds);
}

namespace {

template <typename Struct>
dyop_status write_defaults(const Struct& defaults, Struct* out, std::uint32_t size) {
  if (!out || size < kFirstSize<Struct>) return DYOP_INVALID_ARGUMENT;
  write_struct(defaults, size, out);
  return DYOP_OK;
}

}  // namespace

dyop_status guard(dyop_context* context, const std::function<void()>& call) {
  if (!context) return DYOP_INVALID_ARGUMENT;
  const auto fail = [context](dyop_status status, const char* message) {
    report(*context, message);
    return status;
  };
  const RunningCall running(*context);
  try {
    call();
    return DYOP_OK;
  } catch (const StaleHandle& error) {
    return fail(DYOP_STALE_HANDLE, error.what());
  } catch (const Unsupported& error) {
    return fail(DYOP_UNSUPPORTED, error.what());
  } catch (const FileFailure& error) {
    return fail(DYOP_FILE_ERROR, error.what());
  } catch (const InvalidArgument& error) {
    return fail(DYOP_INVALID_ARGUMENT, error.what());
  } catch (const IntegrationError& error) {
    return fail(DYOP_INTEGRATION_ERROR, error.what());
  } catch (const std::bad_alloc&) {
    return fail(DYOP_OUT_OF_MEMORY, "out of memory");
  } catch (const std::exception& error) {
    return fail(DYOP_INTERNAL_ERROR, error.what());
  } catch (...) {
    return fail(DYOP_INTERNAL_ERROR, "an exception that is not a standard one");
  }
}

}  // namespace dyop::c

std::shared_ptr<const dyop::Shape> dyop_context::shape(dyop_shape handle) const {
  return dyop::c::find(*this, shapes, handle, "shape");
}

std::shared_ptr<const dyop::Motion> dyop_context::motion(dyop_motion handle) const {
  return dyop::c::find(*this, motions, handle, "motion");
}

std::shared_ptr<dyop::c::WorldObject> dyop_context::world(dyop_world handle) const {
  return dyop::c::find(*this, worlds, handle, "world");
}

std::shared_ptr<dyop::c::ObstacleObject> dyop_context::obstacle_set(
    dyop_obstacle_set handle) const {
  return dyop::c::find(*this, obstacle_sets, handle, "obstacle set");
}

std::shared_ptr<const dyop::KinematicChain> dyop_context::chain(dyop_chain handle) const {
  return dyop::c::find(*this, chains, handle, "chain");
}

std::shared_ptr<const dyop::JointPath> dyop_context::joint_path(dyop_joint_path handle) const {
  return dyop::c::find(*this, joint_paths, handle, "joint path");
}

std::shared_ptr<const dyop::Robot> dyop_context::robot(dyop_robot handle) const {
  return dyop::c::find(*this, robots, handle, "robot");
}

std::shared_ptr<dyop::c::DeformingObject> dyop_context::deforming_mesh(
    dyop_deforming_mesh handle) const {
  return dyop::c::find(*this, deforming_meshes, handle, "deforming mesh");
}

std::shared_ptr<dyop::HapticSession> dyop_context::haptic_session(
    dyop_haptic_session handle) const {
  return dyop::c::find(*this, haptic_sessions, handle, "haptic session");
}

std::shared_ptr<const dyop::WorldSnapshot> dyop_context::snapshot(dyop_snapshot handle) const {
  return dyop::c::find(*this, snapshots, handle, "snapshot");
}

dyop_status dyop_context_create(const dyop_context_options* options, dyop_context** context) {
  if (!context) return DYOP_INVALID_ARGUMENT;
  *context = nullptr;
  try {
    const auto hooks = dyop::c::read_struct<dyop_context_options>(
        options, DYOP_CONTEXT_OPTIONS_INIT, "dyop_context_options");
    if ((hooks.allocate == nullptr) != (hooks.deallocate == nullptr)) return DYOP_INVALID_ARGUMENT;
    dyop::c::HookMemory memory(hooks);
    void* const place = memory.allocate(sizeof(dyop_context), alignof(dyop_context));
    *context = new (place) dyop_context(hooks);
    return DYOP_OK;
  } catch (const dyop::c::Unsupported&) {
    return DYOP_UNSUPPORTED;
  } catch (const dyop::InvalidArgument&) {
    return DYOP_INVALID_ARGUMENT;
  } catch (const std::exception&) {
    return DYOP_OUT_OF_MEMORY;
  }
}

void dyop_context_destroy(dyop_context* context) {
  if (!context) return;
  if (context->running_calls > 0) {
    dyop::c::report(*context, "a context cannot be destroyed while one of its functions runs");
    return;
  }
  dyop::c::HookMemory memory(context->hooks);
  context->~dyop_context();
  memory.deallocate(context, sizeof(dyop_context), alignof(dyop_context));
}

dyop_status dyop_last_error(const dyop_context* context, char* text, size_t capacity) {
  if (!context || !text || capacity == 0) return DYOP_INVALID_ARGUMENT;
  const std::lock_guard lock(context->error_mutex);
  const std::size_t length = std::min(capacity - 1, context->last_error.size());
  std::memcpy(text, context->last_error.data(), length);
  text[length] = '\0';
  return DYOP_OK;
}

const char* dyop_status_text(dyop_status status) {
  switch (status) {
    case DYOP_OK:
      return "ok";
    case DYOP_INVALID_ARGUMENT:
      return "invalid argument";
    case DYOP_STALE_HANDLE:
      return "stale handle";
    case DYOP_UNSUPPORTED:
      return "unsupported";
    case DYOP_OUT_OF_MEMORY:
      return "out of memory";
    case DYOP_INTEGRATION_ERROR:
      return "integration error";
    case DYOP_INTERNAL_ERROR:
      return "internal error";
    case DYOP_FILE_ERROR:
      return "file error";
  }
  return "unknown status";
}

uint32_t dyop_version(void) {
  return DYOP_VERSION_NUMBER;
}

void dyop_set_assert_handler(void (*handler)(const char* message)) {
  dyop::c::the_c_handler.store(handler);
  dyop::set_assert_handler(handler ? &dyop::c::call_c_handler : nullptr);
}

dyop_status dyop_context_options_init(dyop_context_options* value, uint32_t size) {
  return dyop::c::write_defaults<dyop_context_options>(DYOP_CONTEXT_OPTIONS_INIT, value, size);
}

dyop_status dyop_motion_functions_init(dyop_motion_functions* value, uint32_t size) {
  return dyop::c::write_defaults<dyop_motion_functions>(DYOP_MOTION_FUNCTIONS_INIT, value, size);
}

dyop_status dyop_distance_options_init(dyop_distance_options* value, uint32_t size) {
  return dyop::c::write_defaults<dyop_distance_options>(DYOP_DISTANCE_OPTIONS_INIT, value, size);
}

dyop_status dyop_toi_options_init(dyop_toi_options* value, uint32_t size) {
  return dyop::c::write_defaults<dyop_toi_options>(DYOP_TOI_OPTIONS_INIT, value, size);
}

dyop_status dyop_batch_options_init(dyop_batch_options* value, uint32_t size) {
  return dyop::c::write_defaults<dyop_batch_options>(DYOP_BATCH_OPTIONS_INIT, value, size);
}

dyop_status dyop_world_options_init(dyop_world_options* value, uint32_t size) {
  return dyop::c::write_defaults<dyop_world_options>(DYOP_WORLD_OPTIONS_INIT, value, size);
}

dyop_status dyop_body_definition_init(dyop_body_definition* value, uint32_t size) {
  return dyop::c::write_defaults<dyop_body_definition>(DYOP_BODY_DEFINITION_INIT, value, size);
}

dyop_status dyop_joint_definition_init(dyop_joint_definition* value, uint32_t size) {
  return dyop::c::write_defaults<dyop_joint_definition>(DYOP_JOINT_DEFINITION_INIT, value, size);
}

dyop_status dyop_spring_definition_init(dyop_spring_definition* value, uint32_t size) {
  return dyop::c::write_defaults<dyop_spring_definition>(DYOP_SPRING_DEFINITION_INIT, value, size);
}

dyop_status dyop_body_filter_init(dyop_body_filter* value, uint32_t size) {
  return dyop::c::write_defaults<dyop_body_filter>(DYOP_BODY_FILTER_INIT, value, size);
}

dyop_status dyop_chain_link_init(dyop_chain_link* value, uint32_t size) {
  return dyop::c::write_defaults<dyop_chain_link>(DYOP_CHAIN_LINK_INIT, value, size);
}

dyop_status dyop_chain_joint_init(dyop_chain_joint* value, uint32_t size) {
  return dyop::c::write_defaults<dyop_chain_joint>(DYOP_CHAIN_JOINT_INIT, value, size);
}

dyop_status dyop_link_pair_options_init(dyop_link_pair_options* value, uint32_t size) {
  return dyop::c::write_defaults<dyop_link_pair_options>(DYOP_LINK_PAIR_OPTIONS_INIT, value, size);
}

dyop_status dyop_tool_hinge_init(dyop_tool_hinge* value, uint32_t size) {
  return dyop::c::write_defaults<dyop_tool_hinge>(DYOP_TOOL_HINGE_INIT, value, size);
}

dyop_status dyop_tool_part_init(dyop_tool_part* value, uint32_t size) {
  return dyop::c::write_defaults<dyop_tool_part>(DYOP_TOOL_PART_INIT, value, size);
}

dyop_status dyop_tool_obstacle_init(dyop_tool_obstacle* value, uint32_t size) {
  return dyop::c::write_defaults<dyop_tool_obstacle>(DYOP_TOOL_OBSTACLE_INIT, value, size);
}

dyop_status dyop_haptic_tool_init(dyop_haptic_tool* value, uint32_t size) {
  return dyop::c::write_defaults<dyop_haptic_tool>(DYOP_HAPTIC_TOOL_INIT, value, size);
}

dyop_status dyop_haptic_options_init(dyop_haptic_options* value, uint32_t size) {
  return dyop::c::write_defaults<dyop_haptic_options>(DYOP_HAPTIC_OPTIONS_INIT, value, size);
}
