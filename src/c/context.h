// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <atomic>
#include <chrono>
#include <functional>
#include <memory>
#include <memory_resource>
#include <mutex>
#include <shared_mutex>
#include <string>
#include <thread>
#include <type_traits>
#include <vector>

#include "c/handle_table.h"
#include "c/sized_struct.h"
#include "dyop/chain/kinematic_chain.h"
#include "dyop/chain/robot.h"
#include "dyop/core/export.h"
#include "dyop/dynamics/world.h"
#include "dyop/dyop_c.h"
#include "dyop/geometry/shape.h"
#include "dyop/haptics/haptic_session.h"
#include "dyop/motion/motion.h"
#include "dyop/toi/deforming_mesh.h"
#include "dyop/toi/obstacle_set.h"

namespace dyop::c {

/// A handle that refers to nothing.
class StaleHandle : public Error {
 public:
  using Error::Error;
};

/// A file that cannot be read: dyop_c_io's form of FileError, which dyop_c does not know.
class FileFailure : public Error {
 public:
  using Error::Error;
};

/// The caller's allocator, or operator new.
class DYOP_EXPORT HookMemory final : public std::pmr::memory_resource {
 public:
  explicit HookMemory(const dyop_context_options& hooks) : hooks_(hooks) {}

 private:
  void* do_allocate(std::size_t size, std::size_t alignment) override;
  void do_deallocate(void* memory, std::size_t size, std::size_t alignment) override;
  bool do_is_equal(const memory_resource& other) const noexcept override { return this == &other; }

  dyop_context_options hooks_;
};

/// What a world's last advance told, but for its motions.
struct AdvanceEvents {
  std::vector<ImpactEvent> impacts;
  std::vector<ContactEvent> contacts;
  std::vector<SensorEvent> sensors;
  std::vector<BrokenJoint> broken_joints;
};

/// A world, and what its last advance reported. While it advances, its callbacks may read it, in
/// the thread that advances it; nothing may change it.
class DYOP_EXPORT WorldObject {
 public:
  using OnStep = std::function<void(Scalar)>;
  explicit WorldObject(const WorldOptions& options);
  /// @param make  Makes the world, with the callback that it gets.
  WorldObject(const std::function<World(OnStep)>& make, OnStep on_step);

  /// @throws InvalidArgument while the world is advanced, but for reading by the advancing thread.
  World& to_change();
  const World& to_read() const;
  const AdvanceEvents& events() const;
  AdvanceReport advance(Scalar dt, const AdvanceLimits& limits = {});
  /// Calls query(world), one at a time: queries keep what they find out about the bodies. A
  /// filter of one may ask as well, and on_step.
  /// @throws InvalidArgument in other callbacks of an advance.
  void ask(const std::function<void(const World&)>& query) const;

 private:
  World world_;
  AdvanceEvents events_;
  mutable std::recursive_mutex asking_;
  mutable std::mutex mutex_;
  mutable int queries_ = 0;  // like what follows under the mutex
  bool is_advancing_ = false;
  bool is_between_steps_ = false;
  std::thread::id thread_;
};

/// An object that queries read at once, and that changes have for themselves.
struct ReadObject {
  mutable std::shared_mutex mutex;
};

/// Marks that this thread is in a query of an object, so that its callbacks cannot wait for it by
/// changing it. With `locks` it keeps others from changing it.
class Reading {
 public:
  explicit Reading(const ReadObject& object, bool locks = true);
  ~Reading() { innermost_ = outer_; }
  Reading(const Reading&) = delete;
  Reading& operator=(const Reading&) = delete;

  /// Waits for queries in other threads.
  /// @throws InvalidArgument inside a query of this thread.
  static std::unique_lock<std::shared_mutex> change(const ReadObject& object);

 private:
  static thread_local const Reading* innermost_;
  const ReadObject& object_;
  const Reading* outer_;
  std::shared_lock<std::shared_mutex> lock_;
};

struct ObstacleObject : ReadObject {
  ObstacleSet set;
};

struct DeformingObject : ReadObject {
  explicit DeformingObject(DeformingMesh the_mesh) : mesh(std::move(the_mesh)) {}
  DeformingMesh mesh;
};

/// The time `seconds` from now. @throws InvalidArgument unless it is > 0.
std::chrono::steady_clock::time_point deadline_after(double seconds);

/// Runs a call of the interface: turns exceptions into a status, and informs the log.
DYOP_EXPORT dyop_status guard(dyop_context* context, const std::function<void()>& call);

}  // namespace dyop::c

/// All objects of one user of the interface. Exported, like guard(), to dyop_c_io only.
struct DYOP_EXPORT dyop_context {
  explicit dyop_context(const dyop_context_options& options)
      : hooks(options),
        memory(options),
        shapes(&memory),
        motions(&memory),
        worlds(&memory),
        obstacle_sets(&memory),
        chains(&memory),
        joint_paths(&memory),
        robots(&memory),
        deforming_meshes(&memory),
        haptic_sessions(&memory),
        snapshots(&memory) {}

  std::shared_ptr<const dyop::Shape> shape(dyop_shape handle) const;
  std::shared_ptr<const dyop::Motion> motion(dyop_motion handle) const;
  std::shared_ptr<dyop::c::WorldObject> world(dyop_world handle) const;
  std::shared_ptr<dyop::c::ObstacleObject> obstacle_set(dyop_obstacle_set handle) const;
  std::shared_ptr<const dyop::KinematicChain> chain(dyop_chain handle) const;
  std::shared_ptr<const dyop::JointPath> joint_path(dyop_joint_path handle) const;
  std::shared_ptr<const dyop::Robot> robot(dyop_robot handle) const;
  std::shared_ptr<dyop::c::DeformingObject> deforming_mesh(dyop_deforming_mesh handle) const;
  std::shared_ptr<dyop::HapticSession> haptic_session(dyop_haptic_session handle) const;
  std::shared_ptr<const dyop::WorldSnapshot> snapshot(dyop_snapshot handle) const;

  /// Makes an object in the memory of the hooks, which the handle then refers to.
  template <typename Concrete, typename Object, typename Handle, typename... Arguments>
  void add(dyop::c::HandleTable<Object>& table, Handle* handle, Arguments&&... arguments) {
    DYOP_REQUIRE(handle, "the pointer to the new handle must not be null");
    adopt(table, handle,
          std::allocate_shared<Concrete>(std::pmr::polymorphic_allocator<Concrete>(&memory),
                                         std::forward<Arguments>(arguments)...));
  }
  /// The same for an object that exists.
  template <typename Object, typename Handle>
  void adopt(dyop::c::HandleTable<Object>& table, Handle* handle,
             std::type_identity_t<std::shared_ptr<Object>> object) {
    DYOP_REQUIRE(handle, "the pointer to the new handle must not be null");
    const std::unique_lock lock(mutex);
    *handle = table.template add<Handle>(std::move(object));
  }
  template <typename Object, typename Handle>
  void remove(dyop::c::HandleTable<Object>& table, Handle handle, const char* what) {
    std::shared_ptr<Object> object;  // destroyed after the lock is gone: it may call hooks
    const std::unique_lock lock(mutex);
    object = table.find(handle);
    if (!table.remove(handle)) throw dyop::c::StaleHandle(std::string(what) + " is stale");
  }

  const dyop_context_options hooks;
  dyop::c::HookMemory memory;
  mutable std::shared_mutex mutex;  ///< of the tables
  dyop::c::HandleTable<const dyop::Shape> shapes;
  dyop::c::HandleTable<const dyop::Motion> motions;
  dyop::c::HandleTable<dyop::c::WorldObject> worlds;
  dyop::c::HandleTable<dyop::c::ObstacleObject> obstacle_sets;
  dyop::c::HandleTable<const dyop::KinematicChain> chains;
  dyop::c::HandleTable<const dyop::JointPath> joint_paths;
  dyop::c::HandleTable<const dyop::Robot> robots;
  dyop::c::HandleTable<dyop::c::DeformingObject> deforming_meshes;
  dyop::c::HandleTable<dyop::HapticSession> haptic_sessions;
  dyop::c::HandleTable<const dyop::WorldSnapshot> snapshots;
  std::atomic<int> running_calls{0};  ///< so that no callback destroys what its caller goes on with
  mutable std::mutex error_mutex;
  std::string last_error;
  std::recursive_mutex log_mutex;  ///< held while the log is called, which may call functions
  bool is_logging = false;
};
