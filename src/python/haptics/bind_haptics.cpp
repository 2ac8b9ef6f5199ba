// SPDX-License-Identifier: BSD-3-Clause
#include <atomic>
#include <chrono>
#include <deque>
#include <exception>
#include <limits>
#include <memory>
#include <mutex>
#include <stop_token>
#include <thread>

#include "dyop/core/error.h"
#include "dyop/haptics/device_mapping.h"
#include "dyop/haptics/haptic_runner.h"
#include "dyop/haptics/haptic_session.h"
#ifdef DYOP_HAS_RECORDING
#include "dyop/io/haptic_recorder.h"
#endif
#include "python/bindings.h"
#include "python/glue/arguments.h"
#include "python/glue/record.h"
#include "python/haptics/mesh_fields.h"
#include "python/haptics/python_session.h"
#include "python/query/queries.h"

namespace dyop::python {
namespace {

// Numbers of any three or four, as a device sends them: unchecked.
template <typename Vector>
Vector numbers_of(py::handle source, const char* what) {
  const auto array = py::array_t<double, py::array::c_style | py::array::forcecast>::ensure(source);
  constexpr py::ssize_t kCount = Vector::SizeAtCompileTime;
  if (!array || array.size() != kCount) {
    PyErr_Clear();
    throw InvalidArgument(std::string(what) + " must be " + std::to_string(kCount) + " numbers");
  }
  return Eigen::Map<const Vector>(array.data());
}

}  // namespace

// A pair (quaternion, position) may hold anything; other poses are checked.
DevicePose device_of(py::handle pose, const std::vector<Scalar>& angles) {
  DevicePose device;
  if (py::isinstance<DevicePose>(pose)) {
    device = pose.cast<DevicePose>();
  } else if (py::isinstance<py::tuple>(pose) && py::len(pose) == 2) {
    const auto pair = py::reinterpret_borrow<py::tuple>(pose);
    const auto q = numbers_of<Eigen::Vector4d>(pair[0], "the quaternion of a pose");
    device.q_WD = Quaternion(q[0], q[1], q[2], q[3]);
    device.p_WD = numbers_of<Vector3>(pair[1], "the position of a pose");
  } else {
    device = DevicePose(pose_of(pose));
  }
  DYOP_REQUIRE(angles.size() <= kMostHinges, "a tool has at most ", kMostHinges, " hinges, not ",
               angles.size());
  std::copy(angles.begin(), angles.end(), device.angles.begin());
  return device;
}

std::vector<DevicePose> devices_of(const py::iterable& poses) {
  std::vector<DevicePose> devices;
  for (const py::handle pose : poses) devices.push_back(device_of(pose, {}));
  return devices;
}

namespace {

Scalar seconds(std::chrono::nanoseconds duration) {
  return std::chrono::duration<Scalar>(duration).count();
}

// --- a session and what runs it -----------------------------------------------------------------

#ifdef DYOP_HAS_RECORDING

// The recording of a session, which it keeps.
class PythonRecording {
 public:
  PythonRecording(std::shared_ptr<PythonSession> session, const std::filesystem::path& file,
                  const std::string& title, bool waits)
      : session_(std::move(session)) {
    session_->own();
    recorder_ = session_->give([&](HapticSession& session_of_it) {
      return record_session(session_of_it, file, {title, "", 0, ""}, waits);
    });
  }

  // The tick's thread must not be a runner's, and no other thread gives tissue meanwhile.
  void stop(const std::optional<std::string>& error) {
    if (is_over_) return;
    session_->own();
    is_over_ = true;
    session_->give([&](HapticSession& session) {
      if (session.observer() == recorder_) session.observe(nullptr);
      if (error) {
        recorder_->fail(*error);
      } else {
        recorder_->finish();
      }
    });
  }
  std::int64_t unlogged() const { return recorder_->unlogged(); }

 private:
  std::shared_ptr<PythonSession> session_;
  std::shared_ptr<HapticRecorder> recorder_;
  bool is_over_ = false;
};

#endif

// Runs a session in a thread of C++: its devices are the poses that Python has set last.
class PythonRunner {
 public:
  PythonRunner(std::shared_ptr<PythonSession> session, const RunnerOptions& options,
               std::size_t keep, const std::vector<TissueFeed>& tissue)
      : session_(std::move(session)), options_(options), keep_(keep), tissue_(tissue) {
    devices_ = session_->start();
    if (options_.ticks <= 0) options_.ticks = std::numeric_limits<std::int64_t>::max();
  }
  ~PythonRunner() { join(); }
  PythonRunner(const PythonRunner&) = delete;
  PythonRunner& operator=(const PythonRunner&) = delete;

  void start() {
    DYOP_REQUIRE(!thread_.joinable(), "the runner has been started already");
    // They stay for the next run, so that models keep their place.
    if (feeders_.size() != tissue_.size()) feeders_ = make_feeders(session_->own(), tissue_);
    HapticSession& session = session_->start_running();
    is_running_ = true;
    thread_ = std::jthread([this, &session](const std::stop_token& stop) { run(session, stop); });
  }
  /// True in the first call.
  bool marks_first_start() { return !std::exchange(was_started_, true); }
  void set_device(const DevicePose& device, std::size_t index) {
    DYOP_REQUIRE(index < devices_.size(), "there is no tool ", index, " of ", devices_.size());
    const std::lock_guard<std::mutex> one(mutex_);
    devices_[index] = device;
  }
  /// Those since the last call; of more than are kept the newest.
  std::vector<TickRecord> read_ticks() {
    const std::lock_guard<std::mutex> one(mutex_);
    std::vector<TickRecord> ticks(ticks_.begin(), ticks_.end());
    ticks_.clear();
    return ticks;
  }
  bool is_running() const { return is_running_; }
  /// Ends the thread. Shapes and models that Python defines need the interpreter's lock until then.
  void join() {
    if (!thread_.joinable()) return;
    const py::gil_scoped_release unlocked;
    thread_.request_stop();
    thread_.join();
  }
  RunnerReport stop() {
    DYOP_REQUIRE(!TissueCall::is_running(),
                 "a model of tissue cannot wait for a HapticRunner to stop; raise an exception");
    join();
    if (failure_) std::rethrow_exception(std::exchange(failure_, nullptr));
    return report_;
  }

 private:
  void run(HapticSession& session, const std::stop_token& stop) {
    try {
      report_ = run_session(
          session,
          [this](std::int64_t, std::span<DevicePose> devices) {
            const std::lock_guard<std::mutex> one(mutex_);
            std::copy(devices_.begin(), devices_.end(), devices.begin());
          },
          feeders_,
          [this](const TickRecord& record) {
            const std::lock_guard<std::mutex> one(mutex_);
            if (ticks_.size() >= keep_) ticks_.pop_front();
            ticks_.push_back(record);
          },
          options_, stop);
    } catch (...) {
      failure_ = std::current_exception();
    }
    session_->end_running();
    is_running_ = false;
  }

  std::shared_ptr<PythonSession> session_;
  RunnerOptions options_;
  std::size_t keep_;
  std::vector<TissueFeed> tissue_;
  std::vector<TissueFeeder> feeders_;
  std::mutex mutex_;  // of the devices and the ticks
  std::vector<DevicePose> devices_;
  std::deque<TickRecord> ticks_;
  RunnerReport report_;
  std::exception_ptr failure_;
  bool was_started_ = false;
  std::atomic<bool> is_running_{false};
  std::jthread thread_;
};

// --- records ------------------------------------------------------------------------------------

template <typename T, std::chrono::nanoseconds T::*kMember>
Field seconds_field(const char* name) {
  return {name,
          [](const void* r, py::handle) {
            return py::object(py::float_(seconds(static_cast<const T*>(r)->*kMember)));
          },
          [](void* r, py::handle value) {
            static_cast<T*>(r)->*kMember =
                std::chrono::nanoseconds(std::int64_t(value.cast<double>() * 1e9));  // nanoseconds
          }};
}

Field deadline_field() {
  return {"deadline",
          [](const void* r, py::handle) {
            const auto& deadline = static_cast<const RunnerOptions*>(r)->deadline;
            return deadline ? py::object(py::float_(seconds(*deadline))) : py::object(py::none());
          },
          [](void* r, py::handle value) {
            auto& deadline = static_cast<RunnerOptions*>(r)->deadline;
            const auto limit = value.cast<std::optional<double>>();
            deadline.reset();
            if (limit) deadline = std::chrono::nanoseconds(std::int64_t(*limit * 1e9));
          }};
}

void bind_scene(py::module_& m) {
  py::enum_<ObstacleRole>(m, "ObstacleRole", "How the tool treats an obstacle.")
      .value("Tissue", ObstacleRole::Tissue, "Touched, with friction; the hand feels it.")
      .value("HardRegion", ObstacleRole::HardRegion, "Forbidden within its margin.")
      .value("SoftRegion", ObstacleRole::SoftRegion, "Pushes back from its margin inwards.")
      .value("Monitor", ObstacleRole::Monitor, "Only the clearance is reported.");
  Record<ToolHinge>(m, "ToolHinge", "A jaw's hinge: its part turns about z of a frame J.")
      .option<&ToolHinge::X_TJ>("X_TJ", "RigidPose: of J in the tool frame T")
      .option<&ToolHinge::angle>("angle", "float: at the start, radians")
      .option<&ToolHinge::stiffness>("stiffness", "float: of its spring, torque per radian, > 0")
      .finish();
  Record<ToolPart>(m, "ToolPart", "One body of the tool.")
      .option<&ToolPart::shape>("shape", "Optional[Shape]: required")
      .option<&ToolPart::X_TP>("X_TP", "RigidPose: in the tool frame, its hinge at angle 0")
      .option<&ToolPart::hinge>("hinge", "Optional[int]: number among its tool's hinges")
      .finish();
  Record<ToolObstacle>(m, "ToolObstacle", "A rigid shape at rest, or a mesh that deforms.")
      .option<&ToolObstacle::name>("name", "str: for messages")
      .option<&ToolObstacle::role>("role", "ObstacleRole: how the tool treats it")
      .option<&ToolObstacle::shape>("shape", "Optional[Shape]: rigid; or vertices and triangles")
      .option<&ToolObstacle::X_WO>("X_WO", "RigidPose: pose of the shape")
      .custom(vertices_field<ToolObstacle>(),
              "numpy.ndarray: (N, 3) at the start, world; read-only")
      .custom(triangles_field<ToolObstacle>(), "numpy.ndarray: (M, 3) int32; read-only")
      .option<&ToolObstacle::margin>("margin", "float: distance that is kept, length, >= 0")
      .option<&ToolObstacle::friction>("friction", "float: Coulomb's, >= 0; Tissue only")
      .option<&ToolObstacle::soft_stiffness>("soft_stiffness",
                                             "float: force per length inside, SoftRegion only")
      .finish();
  Record<ToolTrocar>(m, "ToolTrocar", "A point of the world that the tool's shaft must pass.")
      .option<&ToolTrocar::p_W>("p_W", "numpy.ndarray: (3,), the point")
      .option<&ToolTrocar::p_T>("p_T", "numpy.ndarray: (3,), of the shaft's axis, tool frame")
      .option<&ToolTrocar::axis_T>("axis_T", "numpy.ndarray: (3,), along it, tool frame")
      .finish();
  Record<HapticTool>(m, "HapticTool", "A tool beside the first one of a scene, in another hand.")
      .option<&HapticTool::parts>("parts", "tuple[ToolPart, ...]: assign all of them")
      .option<&HapticTool::hinges>("hinges", "tuple[ToolHinge, ...]: at most four")
      .option<&HapticTool::X_WT>("X_WT", "RigidPose: where it starts")
      .option<&HapticTool::trocar>("trocar", "Optional[ToolTrocar]: that its shaft must pass")
      .option<&HapticTool::coupling>("coupling",
                                     "Optional[CouplingOptions]: None: HapticOptions.coupling")
      .finish();
  Record<HapticScene>(m, "HapticScene", "Everything a HapticSession needs; any consistent units.")
      .option<&HapticScene::tool>("tool", "tuple[ToolPart, ...]: assign all of them")
      .option<&HapticScene::hinges>("hinges", "tuple[ToolHinge, ...]: at most four")
      .option<&HapticScene::obstacles>("obstacles", "tuple[ToolObstacle, ...]: assign all of them")
      .option<&HapticScene::X_WT>("X_WT", "RigidPose: where the tool starts")
      .option<&HapticScene::trocar>("trocar", "Optional[ToolTrocar]: that its shaft must pass")
      .option<&HapticScene::more_tools>("more_tools", "tuple[HapticTool, ...]: at most three")
      .option<&HapticScene::tool_margin>("tool_margin", "float: distance between tools, >= 0")
      .option<&HapticScene::tool_friction>("tool_friction", "float: Coulomb's, between tools")
      .finish();
}

void bind_options(py::module_& m) {
  using C = CouplingOptions;
  Record<C>(m, "CouplingOptions", "Springs and dampers between device and tool, per world axis.")
      .option<&C::stiffness>("stiffness", "numpy.ndarray: (3,), force per length, > 0")
      .option<&C::damping>("damping", "numpy.ndarray: (3,), force per velocity, >= 0")
      .option<&C::rotational_stiffness>("rotational_stiffness",
                                        "numpy.ndarray: (3,), torque per radian, > 0")
      .option<&C::rotational_damping>("rotational_damping", "numpy.ndarray: (3,), >= 0")
      .option<&C::largest_force>("largest_force", "float: limit, > 0")
      .option<&C::largest_torque>("largest_torque", "float: limit, > 0")
      .option<&C::device_damping>("device_damping", "float: of the device itself, >= 0")
      .option<&C::device_rotational_damping>("device_rotational_damping", "float: >= 0")
      .option<&C::period>("period", "float: of the loop, seconds")
      .option<&C::bounds_energy>("bounds_energy", "bool: brakes the hand by returned energy")
      .finish();
  using O = HapticOptions;
  Record<O>(m, "HapticOptions", "Options of a HapticSession.")
      .option<&O::coupling>("coupling", "CouplingOptions: between device and tool")
      .option<&O::rest_offset>("rest_offset", "float: gap of a resting contact, length, > 0")
      .option<&O::recovery_speed>("recovery_speed", "float: out of what it starts in, > 0")
      .option<&O::max_rounds>("max_rounds", "int: motions per tick, >= 1")
      .option<&O::max_attempts>("max_attempts", "int: solves per motion, >= 1")
      .option<&O::max_contacts>("max_contacts", "int: per motion")
      .option<&O::clearance_tolerance>("clearance_tolerance", "float: relative, > 0")
      .option<&O::clearance_work>("clearance_work", "int: pieces of work a tick, >= 10")
      .option<&O::max_work>("max_work", "int: pieces of work that end a tick, >= 10")
      .option<&O::largest_device_speed>("largest_device_speed", "float: beyond it: an outlier")
      .finish();
}

void bind_contacts_of_ticks(py::module_& m) {
  py::enum_<ContactState>(m, "ContactState", "What a contact does.")
      .value("Open", ContactState::Open, "Near, but without force.")
      .value("Stick", ContactState::Stick, "The force is inside the friction cone.")
      .value("Slip", ContactState::Slip, "On the cone, or there is no friction.");
  Record<SurfacePoint>(m, "SurfacePoint", "A point of a deforming obstacle's mesh.")
      .option<&SurfacePoint::triangle>("triangle", "int: number")
      .option<&SurfacePoint::weights>("weights",
                                      "tuple[float, ...]: barycentric coordinates, three")
      .finish();
  using P = ToolContactPoint;
  Record<P>(m, "ToolContactPoint", "A place where the proxy is held back, or may soon be.")
      .field<&P::tool>("tool", "int: number")
      .field<&P::obstacle>("obstacle", "int: number; of tool_contacts: of the other tool")
      .field<&P::part>("part", "int: body of the tool")
      .field<&P::p_W>("p_W", "numpy.ndarray: (3,), on the tool")
      .field<&P::nhat_W>("nhat_W", "numpy.ndarray: (3,), unit, from obstacle to tool")
      .field<&P::gap>("gap", "float: at the start of the last motion")
      .field<&P::force_W>("force_W", "numpy.ndarray: (3,), on the tool")
      .field<&P::state>("state", "ContactState: what it does")
      .field<&P::hinge>("hinge", "Optional[int]: that turns the part")
      .field<&P::p_WO>("p_WO", "numpy.ndarray: (3,), on the obstacle")
      .field<&P::v_WO>("v_WO", "numpy.ndarray: (3,), velocity of the obstacle there")
      .field<&P::surface>("surface", "Optional[SurfacePoint]: p_WO on the mesh; None: rigid")
      .finish();
  Record<ToolImpulse>(m, "ToolImpulse", "What an obstacle did to the tool at a place in a tick.")
      .field<&ToolImpulse::obstacle>("obstacle", "int: number")
      .field<&ToolImpulse::p_WO>("p_WO", "numpy.ndarray: (3,), on the obstacle")
      .field<&ToolImpulse::surface>("surface", "Optional[SurfacePoint]: p_WO on the mesh")
      .field<&ToolImpulse::impulse_W>("impulse_W", "numpy.ndarray: (3,), force times time")
      .finish();
  Record<ObstacleProgress>(m, "ObstacleProgress", "Where an obstacle is between its snapshots.")
      .option<&ObstacleProgress::snapshot>("snapshot", "int: number that it moves to or reached")
      .option<&ObstacleProgress::fraction>("fraction", "float: of the way there, 0 to 1")
      .finish();
  Record<ContactSearch>(m, "ContactSearch", "Which contacts find_contacts() looks for.")
      .option<&ContactSearch::reach>("reach", "float: largest gap, > 0")
      .option<&ContactSearch::rise>("rise", "float: sine of slopes beside a contact, 0 to 1")
      .option<&ContactSearch::spread>("spread", "float: least distance of contacts, >= 0")
      .finish();
}

void bind_status(py::module_& m) {
  using S = HapticStatus;
  py::enum_<S> status(m, "HapticStatus", "How a tick ended.");
  for (const S value : {S::NotRun, S::Free, S::Held, S::Blocked, S::Deadline, S::Trapped,
                        S::Recovering, S::Overlapping, S::InvalidInput, S::Outlier}) {
    constexpr const char* kNames[] = {"NotRun",       "Free",    "Held",       "Blocked",
                                      "Deadline",     "Trapped", "Recovering", "Overlapping",
                                      "InvalidInput", "Outlier"};
    status.value(kNames[int(value)], value, words_of(value));
  }
}

void bind_poses_of_ticks(py::module_& m) {
  py::class_<DevicePose> device_class(m, "DevicePose",
                                      "Input from a device: raw numbers, unchecked.");
  show_properties(device_class, {"p_WD", "q_WD", "angles", "buttons"});
  device_class
      .def(py::init([](const py::object& pose, const std::vector<Scalar>& angles,
                       std::uint32_t buttons) {
             DevicePose device = device_of(pose, angles);
             device.buttons = buttons;
             return device;
           }),
           py::arg("pose"), py::arg("angles") = std::vector<Scalar>(), py::arg("buttons") = 0,
           "The pose of the device, what it asks of the hinges, radians, and its buttons.")
      .def_readonly("p_WD", &DevicePose::p_WD, "numpy.ndarray: (3,)")
      .def_property_readonly(
          "q_WD",
          [](const DevicePose& d) {
            return std::array<Scalar, 4>{d.q_WD.w(), d.q_WD.x(), d.q_WD.y(), d.q_WD.z()};
          },
          "tuple[float, ...]: w, x, y, z")
      .def_readonly("angles", &DevicePose::angles, "tuple[float, ...]: of four hinges")
      .def_readonly("buttons", &DevicePose::buttons, "int: one bit each, for the caller")
      .def(py::pickle(
          [](const DevicePose& d) {
            const std::array<Scalar, 4> q{d.q_WD.w(), d.q_WD.x(), d.q_WD.y(), d.q_WD.z()};
            return py::make_tuple(q, d.p_WD, d.angles, d.buttons);
          },
          [](const py::tuple& state) {
            DevicePose device =
                device_of(py::make_tuple(state[0], state[1]), state[2].cast<std::vector<Scalar>>());
            device.buttons = state[3].cast<std::uint32_t>();
            return device;
          }));
  Record<ToolPose>(m, "ToolPose", "Where the tool is: the proxy.")
      .option<&ToolPose::X_WT>("X_WT", "RigidPose: of the tool frame")
      .option<&ToolPose::angles>("angles", "tuple[float, ...]: of four hinges")
      .finish();
  Record<ToolWaypoint>(m, "ToolWaypoint", "The tool at a time of a tick.")
      .field<&ToolWaypoint::time>("time", "float: since the start of the tick")
      .field<&ToolWaypoint::tool>("tool", "ToolPose: then")
      .finish();
  Record<ToolWrench>(m, "ToolWrench", "On the hand, about the device's origin, world axes.")
      .field<&ToolWrench::force_W>("force_W", "numpy.ndarray: (3,)")
      .field<&ToolWrench::torque_W>("torque_W", "numpy.ndarray: (3,)")
      .finish();
  Record<ToolClearance>(m, "ToolClearance", "Certified distance of tool and obstacle.")
      .field<&ToolClearance::lower>("lower", "float: bound")
      .field<&ToolClearance::upper>("upper", "float: bound")
      .field<&ToolClearance::p_WT>("p_WT", "numpy.ndarray: (3,), on the tool when last measured")
      .field<&ToolClearance::p_WO>("p_WO", "numpy.ndarray: (3,), on the obstacle")
      .field<&ToolClearance::is_breached>("is_breached", "bool: upper is below the margin")
      .field<&ToolClearance::time_to_breach>("time_to_breach", "float: proven lower bound")
      .finish();
}

void bind_tick(py::module_& m) {
  bind_status(m);
  bind_contacts_of_ticks(m);
  bind_poses_of_ticks(m);
  Record<TickCutoff>(m, "TickCutoff", "Where a tick was cut off, for a replay.")
      .option<&TickCutoff::checkpoint>("checkpoint", "int: number within the tick")
      .option<&TickCutoff::node_pairs>("node_pairs", "int: of the query it fell in; 0: before it")
      .finish();
  using S = TickStatistics;
  Record<S>(m, "TickStatistics", "Work of a tick.")
      .field<&S::impact_queries>("impact_queries", "int: count")
      .field<&S::distance_queries>("distance_queries", "int: count")
      .field<&S::node_pairs>("node_pairs", "int: count")
      .field<&S::checkpoints>("checkpoints", "int: where a deadline can end the tick")
      .field<&S::solves>("solves", "int: count")
      .field<&S::pieces>("pieces", "int: motions committed")
      .field<&S::work>("work", "int: as HapticOptions.max_work counts it")
      .finish();
  using T = HapticTick;
  Record<T>(m, "HapticTick", "Result of HapticSession.update().")
      .field<&T::status>("status", "HapticStatus: how it ended")
      .field<&T::tool>("tool", "ToolPose: where the tool is")
      .field<&T::path>("path", "tuple[ToolWaypoint, ...]: the start, then the end of each motion")
      .field<&T::path_progress>(
          "path_progress", "tuple[ObstacleProgress, ...]: at each waypoint, one for each obstacle")
      .field<&T::wrench>("wrench", "ToolWrench: on the hand")
      .field<&T::contacts>("contacts", "tuple[ToolContactPoint, ...]: that held the tool")
      .field<&T::candidates>("candidates", "tuple[ToolContactPoint, ...]: near, without force")
      .field<&T::impulses>("impulses", "tuple[ToolImpulse, ...]: over the whole tick")
      .field<&T::trocar_force_W>("trocar_force_W", "numpy.ndarray: (3,), of a trocar on the tool")
      .field<&T::clearances>("clearances", "tuple[ToolClearance, ...]: one for each obstacle")
      .field<&T::tool_contacts>("tool_contacts", "tuple[ToolContactPoint, ...]: with other tools")
      .field<&T::tool_clearances>("tool_clearances", "tuple[ToolClearance, ...]: one for each tool")
      .field<&T::energy_returned>("energy_returned", "float: to the hand so far")
      .field<&T::tissue_stopped>("tissue_stopped", "float: time of this tick")
      .field<&T::tissue_lag>("tissue_lag", "float: behind the newest snapshot")
      .field<&T::tissue_behind>("tissue_behind", "float: behind the session's time")
      .field<&T::snapshots>("snapshots", "tuple[int, ...]: given to each obstacle before")
      .field<&T::progress>("progress", "tuple[ObstacleProgress, ...]: of each obstacle")
      .field<&T::time>("time", "float: at its end")
      .field<&T::cutoff>("cutoff", "Optional[TickCutoff]: if it was cut off")
      .custom(seconds_field<T, &T::latency>("latency"), "float: of the call, seconds", false)
      .field<&T::statistics>("statistics", "TickStatistics: its work")
      .finish();
}

// --- the session --------------------------------------------------------------------------------

using SessionClass = py::class_<PythonSession, std::shared_ptr<PythonSession>>;

void bind_giving(SessionClass& session) {
  session.def(
      "give_snapshot",
      [](PythonSession& self, std::size_t obstacle, const py::object& vertices, Scalar duration,
         const py::object& copy) {
        const Doubles rows = rows_of(vertices, 3, "vertices", copy_rule_of(copy));
        const auto points = points_in(rows);
        return self.give(
            [&](HapticSession& s) { return s.give_snapshot(obstacle, points, duration); });
      },
      py::arg("obstacle"), py::arg("vertices"), py::arg("duration"), py::arg("copy") = py::none(),
      "Vertices (N, 3) that a deforming obstacle shall reach, `duration` after those given "
      "before;\n"
      "read where they are if they are C-contiguous float64 (copy=False: or refused). May be "
      "called\n"
      "by another thread than update(). False: the last ones have not been started on yet.");
  session.def(
      "retarget",
      [](PythonSession& self, std::size_t obstacle, const py::object& vertices, Scalar duration,
         Scalar lead, const py::object& copy) {
        const Doubles rows = rows_of(vertices, 3, "vertices", copy_rule_of(copy));
        const auto points = points_in(rows);
        return self.give(
            [&](HapticSession& s) { return s.retarget(obstacle, points, duration, lead); });
      },
      py::arg("obstacle"), py::arg("vertices"), py::arg("duration"), py::arg("lead") = 0.0,
      py::arg("copy") = py::none(),
      "As give_snapshot(), from where the obstacle is `lead` from now.");
  session.def(
      "give_mesh",
      [](PythonSession& self, std::size_t obstacle, const py::object& vertices,
         const py::object& triangles) {
        const auto points = points_of(vertices, "vertices", CopyRule::IfNeeded);
        const auto corners = triangles_of(triangles, CopyRule::IfNeeded);
        return self.give([&](HapticSession& s) { return s.give_mesh(obstacle, points, corners); });
      },
      py::arg("obstacle"), py::arg("vertices"), py::arg("triangles"),
      "Another mesh instead of a next snapshot, as after a cut.");
  session.def(
      "find_contacts",
      [](PythonSession& self, std::size_t obstacle, const ObstacleProgress& progress,
         const ToolPose& tool, const ContactSearch& search, std::size_t index) {
        std::vector<ToolContactPoint> contacts;
        const bool is_there = self.give([&](HapticSession& s) {
          return s.find_contacts(obstacle, progress, tool, search, contacts, index);
        });
        return is_there ? std::optional(std::move(contacts)) : std::nullopt;
      },
      py::arg("obstacle"), py::arg("progress"), py::arg("tool"), py::arg("search"),
      py::arg("index") = 0,
      "The contacts that the tool would have in a pose, the nearest first. None: that mesh is no\n"
      "longer there.");
}

void bind_updates(SessionClass& session) {
  session
      .def(py::init([](const HapticScene& scene, const HapticOptions& options) {
             return std::make_shared<PythonSession>(scene, options);
           }),
           py::arg("scene"), py::arg("options"), "Everything is copied.")
      .def(
          "update",
          [](PythonSession& self, const py::object& pose, Scalar dt,
             const std::vector<Scalar>& angles, const py::object& deadline) {
            HapticSession::Deadline until;
            if (!deadline.is_none()) until = deadline_of(deadline);
            return self.own().update(device_of(pose, angles), dt, until);
          },
          py::arg("device"), py::arg("dt"), py::arg("angles") = std::vector<Scalar>(),
          py::arg("deadline") = py::none(),
          "One tick. A pair (quaternion, position) may hold anything, NaN too. angles: asked of\n"
          "the hinges. deadline: seconds of time.monotonic(). The interpreter's lock is held:\n"
          "other threads of Python wait until the tick is over.")
      .def(
          "replay",
          [](PythonSession& self, const py::object& pose, Scalar dt,
             const std::vector<Scalar>& angles, const std::optional<TickCutoff>& cutoff) {
            return self.own().replay(device_of(pose, angles), dt, cutoff);
          },
          py::arg("device"), py::arg("dt"), py::arg("angles") = std::vector<Scalar>(),
          py::arg("cutoff") = py::none(), "The same, cut off where an earlier run was.")
      .def(
          "update_all",
          [](PythonSession& self, const py::iterable& devices, Scalar dt,
             const py::object& deadline) {
            HapticSession::Deadline until;
            if (!deadline.is_none()) until = deadline_of(deadline);
            const auto ticks = self.own().update(devices_of(devices), dt, until);
            return std::vector<HapticTick>(ticks.begin(), ticks.end());
          },
          py::arg("devices"), py::arg("dt"), py::arg("deadline") = py::none(),
          "One tick of all tools: a pose for each, or a DevicePose where there are hinges; a\n"
          "HapticTick for each.")
      .def(
          "replay_all",
          [](PythonSession& self, const py::iterable& devices, Scalar dt,
             const std::optional<TickCutoff>& cutoff) {
            const auto ticks = self.own().replay(devices_of(devices), dt, cutoff);
            return std::vector<HapticTick>(ticks.begin(), ticks.end());
          },
          py::arg("devices"), py::arg("dt"), py::arg("cutoff") = py::none(),
          "The same, cut off where an earlier run was.")
      .def_property_readonly(
          "tool_count", [](PythonSession& self) { return self.own().tool_count(); },
          "int: of the scene")
      .def_property_readonly(
          "last", [](PythonSession& self) { return self.own().last(); },
          "HapticTick: of the first tool")
      .def_property_readonly(
          "time", [](PythonSession& self) { return self.own().time(); }, "float: elapsed");
}

void bind_springs(SessionClass& session) {
  session
      .def(
          "set_coupling",
          [](PythonSession& self, const CouplingOptions& coupling, std::size_t index) {
            self.own().set_coupling(coupling, index);
          },
          py::arg("coupling"), py::arg("index") = 0,
          "Other springs: lower stiffness at once, higher when the tool is where the device is.")
      .def_property_readonly(
          "coupling", [](PythonSession& self) { return self.own().coupling(); },
          "CouplingOptions: the first tool's springs that act now")
      .def(
          "reset",
          [](PythonSession& self, const ToolPose& tool, std::size_t index) {
            self.own().reset(tool, index);
          },
          py::arg("tool"), py::arg("index") = 0, "Puts a tool elsewhere, without a motion.")
      .def_property_readonly(
          "is_passive", [](PythonSession& self) { return self.own().is_passive(); },
          "bool: whether the device's damping suffices");
}

#ifdef DYOP_HAS_RECORDING
void bind_recording(py::module_& m, SessionClass& session) {
  py::class_<PythonRecording>(m, "HapticRecording", "What HapticSession.record() returns.")
      .def(
          "stop", [](PythonRecording& self) { self.stop({}); },
          "Writes what is left and closes the file. Not while a HapticRunner runs.")
      .def_property_readonly("unlogged", &PythonRecording::unlogged,
                             "int: ticks that the file was too slow for")
      .def(
          "__enter__", [](const py::object& self) { return self; }, "The recording.")
      .def(
          "__exit__",
          [](PythonRecording& self, const py::object& type, const py::object& error,
             const py::object& /*traceback*/) {
            if (type.is_none()) {
              self.stop({});
            } else {
              self.stop(py::str(error).cast<std::string>());
            }
          },
          py::arg("type"), py::arg("error"), py::arg("traceback"),
          "Stops; the file says which exception ended the run.");
  session.def(
      "record",
      [](const std::shared_ptr<PythonSession>& self, const py::object& file,
         const std::string& title, bool waits) {
        return std::make_unique<PythonRecording>(self, path_of(file), title, waits);
      },
      py::arg("file"), py::arg("title") = "", py::arg("waits") = true,
      "Records every input and every tick from the start until stop() or the end of a with block.\n"
      "waits: a tick waits for a file that is 2048 ticks behind; False: it is left out.");
}
#endif

void bind_session(py::module_& m) {
  SessionClass session(m, "HapticSession",
                       "A tool driven by a device among tissue and forbidden regions.");
  session.def("__repr__", [](const PythonSession& self) { return self.describe(); });
  bind_updates(session);
  bind_springs(session);
#ifdef DYOP_HAS_RECORDING
  bind_recording(m, session);
#endif
  session
      .def(
          "tissue_vertices",
          [](PythonSession& self, std::size_t obstacle) {
            return copy_of(self.own().tissue_vertices(obstacle));
          },
          py::arg("obstacle"), "Where a deforming obstacle is now: (N, 3), a copy.")
      .def(
          "snapshots_taken",
          [](PythonSession& self, std::size_t obstacle) {
            return self.give([&](HapticSession& s) { return s.snapshots_taken(obstacle); });
          },
          py::arg("obstacle"), "Snapshots and meshes that the obstacle has started on.");
  bind_giving(session);
}

void bind_report(py::module_& m) {
  py::class_<LatencyHistogram> histogram(m, "LatencyHistogram", "Durations in bins 9 % wide.");
  show_properties(histogram, {"count", "worst"});
  histogram.def_property_readonly("count", &LatencyHistogram::count, "int: of durations")
      .def_property_readonly(
          "worst", [](const LatencyHistogram& h) { return seconds(h.worst()); }, "float: seconds")
      .def(
          "quantile",
          [](const LatencyHistogram& h, double part) { return seconds(h.quantile(part)); },
          py::arg("part"), "Seconds that at least this part of all did not exceed.");
  using R = RunnerReport;
  py::class_<R> report(m, "RunnerReport", "What HapticRunner.stop() returns.");
  show_properties(report, {"ticks", "late_starts", "unlogged", "latency", "has_real_time_priority",
                           "has_locked_memory", "rights"});
  report.def_readonly("ticks", &R::ticks, "int: that were run")
      .def_readonly("late_starts", &R::late_starts, "int: later than a period")
      .def_readonly("unlogged", &R::unlogged, "int: lost before they could be kept")
      .def_readonly("latency", &R::latency, "LatencyHistogram: of the ticks")
      .def_readonly("has_real_time_priority", &R::has_real_time_priority, "bool: granted")
      .def_readonly("has_locked_memory", &R::has_locked_memory, "bool: granted")
      .def_readonly("rights", &R::rights, "str: what the system said");
  py::class_<TickRecord> record(m, "TickRecord", "One tick with its inputs.");
  show_properties(record, {"number", "dt", "device", "tick", "others"});
  record.def_readonly("number", &TickRecord::number, "int: of the tick")
      .def_readonly("device", &TickRecord::device, "DevicePose: its input")
      .def_readonly("dt", &TickRecord::dt, "float: seconds")
      .def_readonly("tick", &TickRecord::tick, "HapticTick: its result")
      .def_readonly("others", &TickRecord::others, "tuple[ToolRecord, ...]: of further tools");
  py::class_<ToolRecord> part(m, "ToolRecord", "A tool's part of a tick.");
  show_properties(part, {"device", "tick"});
  part.def_readonly("device", &ToolRecord::device, "DevicePose: its input")
      .def_readonly("tick", &ToolRecord::tick, "HapticTick: its result");
}

// A thread that waits for the interpreter's lock while the interpreter ends would be killed.
void start_runner(const py::object& self) {
  const auto runner = self.cast<std::shared_ptr<PythonRunner>>();
  runner->start();
  if (!runner->marks_first_start()) return;
  py::module_::import("weakref").attr("finalize")(
      self, py::cpp_function([weak = std::weak_ptr<PythonRunner>(runner)] {
        if (const auto left = weak.lock()) left->join();
      }));
}

void bind_runner(py::module_& m) {
  using O = RunnerOptions;
  Record<O>(m, "RunnerOptions", "Options of a HapticRunner.")
      .option<&O::period>("period", "float: of a tick, seconds")
      .option<&O::ticks>("ticks", "int: to run; 0: until stopped")
      .custom(deadline_field(), "Optional[float]: longest duration of a tick, seconds")
      .option<&O::is_paced>("is_paced", "bool: waits for the clock")
      .option<&O::wants_real_time>("wants_real_time", "bool: asks for real-time priority")
      .finish();
  bind_report(m);
  py::class_<PythonRunner, std::shared_ptr<PythonRunner>> runner(
      m, "HapticRunner",
      "Runs a session at a fixed rate in a thread of its own, which never waits for the\n"
      "interpreter; tissue in another one. Not paced by the clock, one thread does both.");
  show_properties(runner, {"is_running"});
  runner
      .def(
          py::init([](const std::shared_ptr<PythonSession>& session, const O* options,
                      std::size_t keep, const std::vector<TissueFeed>& tissue) {
            return std::make_shared<PythonRunner>(session, options != nullptr ? *options : O(),
                                                  keep, tissue);
          }),
          py::arg("session").none(false), py::arg("options") = py::none(), py::arg("keep") = 4096,
          py::arg("tissue") = std::vector<TissueFeed>(),
          "keep: so many ticks wait to be read, the newest. tissue: at most one TissueFeed for an\n"
          "obstacle, which then is given nothing else. They stay from one start to the next.")
      .def("start", &start_runner,
           "Starts the thread; InvalidArgument if a feed does not fit the session.")
      .def(
          "set_device",
          [](PythonRunner& self, const py::object& pose, const std::vector<Scalar>& angles,
             std::size_t index) { self.set_device(device_of(pose, angles), index); },
          py::arg("device"), py::arg("angles") = std::vector<Scalar>(), py::arg("index") = 0,
          "The pose of a tool's device from now on; before the first it is where the tool starts.")
      .def("read_ticks", &PythonRunner::read_ticks,
           "The ticks since the last call, at most as many as are kept.")
      .def_property_readonly("is_running", &PythonRunner::is_running, "bool: not yet ended")
      .def("stop", &PythonRunner::stop,
           "Ends the run and tells how it went, or raises what a model or a shape of yours has\n"
           "raised, which has ended it.")
      .def(
          "__enter__",
          [](const py::object& self) {
            start_runner(self);
            return self;
          },
          "Starts.")
      .def(
          "__exit__", [](PythonRunner& self, const py::args&) { self.stop(); }, "Stops.");
}

// --- the coupling -------------------------------------------------------------------------------

py::array_t<double> array_of(const Eigen::MatrixXd& matrix) {
  py::array_t<double> array({py::ssize_t(matrix.rows()), py::ssize_t(matrix.cols())});
  auto rows = array.mutable_unchecked<2>();
  for (Eigen::Index i = 0; i < matrix.rows(); ++i) {
    for (Eigen::Index j = 0; j < matrix.cols(); ++j) rows(i, j) = matrix(i, j);
  }
  return array;
}

void bind_mapping(py::module_& m) {
  using O = DeviceMappingOptions;
  Record<O>(m, "DeviceMappingOptions", "How a hand's motions become the tool's.")
      .option<&O::R_WV>("R_WV", "numpy.ndarray: (3, 3), from the device's axes to the world's")
      .option<&O::scale>("scale", "float: tool displacement per that of the hand, > 0")
      .option<&O::rotation_scale>("rotation_scale", "float: the same for turns, > 0")
      .finish();
  py::class_<DeviceMapping>(m, "DeviceMapping",
                            "Motion scaling and clutch, with the same power on both sides.")
      .def(py::init([](const O& options, const PoseArgument& start) {
             return DeviceMapping(options, start.X);
           }),
           py::arg("options"), py::arg("X_WT"), "X_WT: where the tool starts.")
      .def(
          "to_tool",
          [](DeviceMapping& self, const py::object& pose, bool is_clutch_open) {
            return self.to_tool(device_of(pose, {}), is_clutch_open);
          },
          py::arg("device"), py::arg("is_clutch_open") = false,
          "The pose of a device as HapticSession.update() takes it.")
      .def("to_hand", &DeviceMapping::to_hand, py::arg("wrench"),
           "What the hand shall feel of a tick's wrench, in the device's axes.")
      .def(
          "reset", [](DeviceMapping& self, const PoseArgument& X) { self.reset(X.X); },
          py::arg("X_WD"), "The tool is elsewhere.");
}

void bind_coupling(py::module_& m) {
  Record<ToolPoint>(m, "ToolPoint", "A point of the tool, fixed to it or turned by a hinge.")
      .option<&ToolPoint::p_W>("p_W", "numpy.ndarray: (3,)")
      .option<&ToolPoint::hinge>("hinge", "Optional[int]: that turns it")
      .finish();
  m.def(
      "tool_jacobian",
      [](const std::vector<ToolHinge>& hinges, const ToolPose& tool, const ToolPoint& point) {
        return array_of(tool_jacobian(hinges, tool, point));
      },
      py::arg("hinges"), py::arg("tool"), py::arg("point"),
      "(3, 6 + hinges): velocity of a point from those of T's origin, of turning and of the "
      "hinges.");
  m.def(
      "coupling_compliance",
      [](const CouplingOptions& coupling, const std::vector<ToolHinge>& hinges,
         const ToolPose& tool, const std::vector<ToolPoint>& points) {
        return array_of(coupling_compliance(coupling, hinges, tool, points));
      },
      py::arg("coupling"), py::arg("hinges"), py::arg("tool"), py::arg("points"),
      "(3n, 3n): how forces on n points of the tool displace them while the device stands.");
}

}  // namespace

void bind_haptics(py::module_& m) {
  bind_scene(m);
  bind_options(m);
  bind_tick(m);
  bind_session(m);
  bind_tissue(m);
  bind_mapping(m);
  bind_runner(m);
  bind_coupling(m);
}

}  // namespace dyop::python
