// SPDX-License-Identifier: BSD-3-Clause
#include <tbb/info.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <cstdint>
#include <limits>
#include <memory>
#include <optional>
#include <string>

#include "dyop/chain/certify_chain.h"
#include "dyop/core/error.h"
#include "dyop/distance/distance.h"
#include "dyop/distance/distance_result.h"
#include "dyop/distance/point_distance.h"
#include "dyop/distance/ray_cast.h"
#include "dyop/motion/interpolated_motion.h"
#include "dyop/motion/steady_motions.h"
#include "dyop/toi/time_of_impact.h"
#include "dyop/toi/toi_result.h"
#include "python/bindings.h"
#include "python/glue/calls.h"
#include "python/query/queries.h"

namespace dyop::python {

/// Rows of structured arrays: plain numbers without gaps, so that equal answers are equal bytes.
/// What is not there is NaN (numbers) or -1 (indices).
struct WitnessRow {
  double lower;
  double upper;
  double p_WCa[3];
  double p_WCb[3];
  double nhat_AB_W[3];
  std::int32_t feature_a[4];  ///< kind, vertices
  std::int32_t feature_b[4];
  std::int32_t triangle_a;
  std::int32_t triangle_b;
  std::int32_t child_a;
  std::int32_t child_b;
};

struct ToiRow {
  double t_safe;
  double t_hit;
  WitnessRow contact;
  double closing_speed;
  double rounding_allowance;
  std::int64_t box_tests;
  std::int64_t leaf_tests;
  std::int64_t node_pairs;
  std::int64_t peak_queue;
  std::int64_t status;
};
static_assert(sizeof(WitnessRow) == 11 * 8 + 12 * 4);
static_assert(sizeof(ToiRow) == sizeof(WitnessRow) + 9 * 8);

struct DistanceRow {
  WitnessRow witness;
  double penetration_depth;
  double penetration_nhat_AB_W[3];
  double penetration_p_W[3];
  std::int64_t box_tests;
  std::int64_t leaf_tests;
  std::int64_t gjk_iterations;
  std::int64_t status;
};
static_assert(sizeof(DistanceRow) == sizeof(WitnessRow) + 11 * 8);

struct ChainRow {
  ToiRow toi;
  double free_fraction;
  std::int64_t link_a;
  std::int64_t link_b;
  std::int64_t obstacle;
};
static_assert(sizeof(ChainRow) == sizeof(ToiRow) + 4 * 8);

struct PointRow {
  double lower;
  double upper;
  double p_WC[3];
  double nhat_W[3];
  std::int32_t feature[4];
  std::int32_t triangle;
  std::int32_t child;
};
static_assert(sizeof(PointRow) == 8 * 8 + 6 * 4);

struct RayRow {
  double distance;
  double gap;
  double p_WC[3];
  double nhat_W[3];
  std::int32_t feature[4];
  std::int32_t triangle;
  std::int32_t child;
  std::int64_t status;
};
static_assert(sizeof(RayRow) == 9 * 8 + 6 * 4);

void fill_row(ToiRow& row, const ToiResult& result);
void fill_row(ChainRow& row, const ChainResult& result);
void fill_row(DistanceRow& row, const DistanceResult& result);
void fill_row(PointRow& row, const PointDistance& result);
void fill_row(RayRow& row, const RayHit& result);

namespace {

constexpr double kNone = std::numeric_limits<double>::quiet_NaN();

void fill(double (&out)[3], const Vector3& v) {
  std::copy_n(v.data(), 3, out);
}

void fill(std::int32_t (&out)[4], const Feature& feature) {
  out[0] = std::int32_t(feature.kind);
  std::copy_n(feature.vertices.begin(), 3, out + 1);
}

void fill_witness(WitnessRow& row, const WitnessPair& pair) {
  row.lower = pair.lower;
  row.upper = pair.upper;
  fill(row.p_WCa, pair.p_WCa);
  fill(row.p_WCb, pair.p_WCb);
  fill(row.nhat_AB_W, pair.nhat_AB_W);
  fill(row.feature_a, pair.feature_a);
  fill(row.feature_b, pair.feature_b);
  row.triangle_a = pair.triangle_a.value_or(-1);
  row.triangle_b = pair.triangle_b.value_or(-1);
  row.child_a = pair.child_a.value_or(-1);
  row.child_b = pair.child_b.value_or(-1);
}

// For a query without a contact.
WitnessPair no_witness() {
  WitnessPair pair;
  pair.lower = pair.upper = kNone;
  pair.p_WCa.setConstant(kNone);
  pair.p_WCb.setConstant(kNone);
  pair.nhat_AB_W.setConstant(kNone);
  return pair;
}

}  // namespace

void fill_row(ToiRow& row, const ToiResult& result) {
  row.t_safe = result.t_safe;
  row.t_hit = result.t_hit.value_or(kNone);
  fill_witness(row.contact,
               result.contact ? static_cast<const WitnessPair&>(*result.contact) : no_witness());
  row.closing_speed = result.contact ? result.contact->closing_speed : kNone;
  row.rounding_allowance = result.rounding_allowance;
  row.box_tests = result.statistics.box_tests;
  row.leaf_tests = result.statistics.leaf_tests;
  row.node_pairs = result.statistics.node_pairs;
  row.peak_queue = result.statistics.peak_queue;
  row.status = std::int64_t(result.status);
}

void fill_row(ChainRow& row, const ChainResult& result) {
  fill_row(row.toi, result.toi);
  row.free_fraction = result.free_fraction;
  row.link_a = result.link_a ? std::int64_t(*result.link_a) : -1;
  row.link_b = result.link_b ? std::int64_t(*result.link_b) : -1;
  row.obstacle = result.obstacle ? std::int64_t(*result.obstacle) : -1;
}

void fill_row(DistanceRow& row, const DistanceResult& result) {
  fill_witness(row.witness, result);
  row.penetration_depth = result.penetration ? result.penetration->depth : kNone;
  const Vector3 none = Vector3::Constant(kNone);
  fill(row.penetration_nhat_AB_W, result.penetration ? result.penetration->nhat_AB_W : none);
  fill(row.penetration_p_W, result.penetration ? result.penetration->p_W : none);
  row.box_tests = result.statistics.box_tests;
  row.leaf_tests = result.statistics.leaf_tests;
  row.gjk_iterations = result.statistics.gjk_iterations;
  row.status = std::int64_t(result.status);
}

void fill_row(PointRow& row, const PointDistance& result) {
  row.lower = result.lower;
  row.upper = result.upper;
  fill(row.p_WC, result.p_WC);
  fill(row.nhat_W, result.nhat_W);
  fill(row.feature, result.feature);
  row.triangle = result.triangle.value_or(-1);
  row.child = result.child.value_or(-1);
}

void fill_row(RayRow& row, const RayHit& result) {
  row.distance = result.distance;
  row.gap = result.gap;
  const bool is_miss = result.status == RayStatus::Miss;
  const Vector3 none = Vector3::Constant(kNone);
  fill(row.p_WC, is_miss ? none : result.p_WC);
  fill(row.nhat_W, is_miss ? none : result.nhat_W);
  fill(row.feature, result.feature);
  row.triangle = result.triangle.value_or(-1);
  row.child = result.child.value_or(-1);
  row.status = std::int64_t(result.status);
}

namespace {

using MotionPointer = std::shared_ptr<const Motion>;
using ShapePointer = std::shared_ptr<const Shape>;

constexpr const char* kWitnessFields =
    "('lower','f8'),('upper','f8'),('p_WCa','f8',3),('p_WCb','f8',3),('nhat_AB_W','f8',3),"
    "('feature_a','i4',4),('feature_b','i4',4),('triangle_a','i4'),('triangle_b','i4'),"
    "('child_a','i4'),('child_b','i4'),";

// The type of a row, fields in the order of the struct.
template <typename Row>
py::dtype row_type(const std::string& fields) {
  const auto read = py::module_::import("ast").attr("literal_eval");
  auto type = py::dtype::from_args(read("[" + fields + "]"));
  if (std::size_t(type.itemsize()) != sizeof(Row)) throw InternalError("a row has another size");
  return type;
}

using Arena = std::shared_ptr<tbb::task_arena>;

// Threads for batches. Each batch is run by a thread of its own (glue/interrupt.h), and oneTBB
// 2021.8 neither frees what such a thread used nor lets another have its workers: one arena serves
// all.
Arena make_arena() {
  constexpr int kCallers = 32;  // at once; more wait for one another
  return std::make_shared<tbb::task_arena>(tbb::info::default_concurrency() + kCallers,
                                           unsigned(kCallers + 1));
}

struct BatchKind {
  py::dtype row;
  Arena arena;
};

struct RowTypes {
  std::string toi_fields = std::string("('t_safe','f8'),('t_hit','f8'),") + kWitnessFields +
                           "('closing_speed','f8'),('rounding_allowance','f8'),"
                           "('box_tests','i8'),('leaf_tests','i8'),('node_pairs','i8'),"
                           "('peak_queue','i8'),('status','i8'),";
  py::dtype toi = row_type<ToiRow>(toi_fields);
  py::dtype chain = row_type<ChainRow>(
      toi_fields + "('free_fraction','f8'),('link_a','i8'),('link_b','i8'),('obstacle','i8')");
  py::dtype distance = row_type<DistanceRow>(
      std::string(kWitnessFields) +
      "('penetration_depth','f8'),('penetration_nhat_AB_W','f8',3),('penetration_p_W','f8',3),"
      "('box_tests','i8'),('leaf_tests','i8'),('gjk_iterations','i8'),('status','i8')");
  py::dtype point = row_type<PointRow>(
      "('lower','f8'),('upper','f8'),('p_WC','f8',3),('nhat_W','f8',3),"
      "('feature','i4',4),('triangle','i4'),('child','i4')");
  py::dtype ray = row_type<RayRow>(
      "('distance','f8'),('gap','f8'),('p_WC','f8',3),('nhat_W','f8',3),"
      "('feature','i4',4),('triangle','i4'),('child','i4'),('status','i8')");
};

/// Items of a batch: one for all queries, or one each.
template <typename Item>
struct ItemList {
  std::vector<Item> items;
  bool is_single = false;
  const Item& at(std::size_t i) const { return items[is_single ? 0 : i]; }
};

/// Motions that lie side by side in memory.
struct MotionArray {
  std::vector<MotionPointer> motions;
};

template <typename Pointer>
ItemList<Pointer> items_of(py::handle source, const char* what) {
  using Base = std::remove_const_t<typename Pointer::element_type>;
  if (py::isinstance<Base>(source)) return {{source.cast<Pointer>()}, true};
  if constexpr (std::is_same_v<Base, Motion>) {
    if (py::isinstance<MotionArray>(source)) return {source.cast<MotionArray&>().motions, false};
  }
  ItemList<Pointer> list;
  if (!py::isinstance<py::sequence>(source)) {
    // A mesh of another library, where a shape is wanted.
    py::detail::make_caster<Pointer> other;
    if (other.load(source, true)) return {{py::detail::cast_op<Pointer>(other)}, true};
    throw InvalidArgument(std::string(what) + " must be one object or a sequence of them");
  }
  for (const py::handle item : source) {
    DYOP_REQUIRE(py::isinstance<Base>(item), what, "[", list.items.size(),
                 "] is not what is asked for, but ", std::string(py::repr(item)));
    list.items.push_back(item.cast<Pointer>());
  }
  return list;
}

ItemList<TimeInterval> intervals_of(py::handle source) {
  const auto dimensions = py::module_::import("numpy").attr("ndim")(source).cast<int>();
  if (dimensions < 2) {
    return {{interval_of(source)}, true};
  }
  const auto rows = rows_of(source, 2, "interval", CopyRule::IfNeeded);
  ItemList<TimeInterval> list;
  for (py::ssize_t i = 0; i < rows.shape(0); ++i)
    list.items.push_back({rows.at(i, 0), rows.at(i, 1)});
  return list;
}

// The number of queries: that of all lists, single items standing for any number.
class BatchSize {
 public:
  template <typename List>
  void join(const List& list, std::size_t size, const char* what) {
    if (list.is_single) return;
    DYOP_REQUIRE(!size_ || *size_ == size, what, " holds ", size, " items, but ", name_, " ",
                 size_.value_or(0));
    size_ = size;
    name_ = what;
  }
  std::size_t get() const { return size_.value_or(1); }

 private:
  std::optional<std::size_t> size_;
  std::string name_;
};

// The array for the results: the caller's, or a new one.
template <typename Row>
py::array output_of(const py::object& out, const py::dtype& type, std::size_t size) {
  if (out.is_none()) return {type, std::vector<py::ssize_t>{py::ssize_t(size)}};
  if (!py::isinstance<py::array>(out)) throw InvalidArgument("out must be an array");
  py::array array = out;
  const bool fits = array.ndim() == 1 && array.shape(0) == py::ssize_t(size) &&
                    array.dtype().equal(type) && array.writeable() &&
                    (size < 2 || array.strides(0) == py::ssize_t(sizeof(Row)));
  DYOP_REQUIRE(fits, "out must be a writeable, contiguous array of ", size,
               " rows of the type that the call returns");
  return array;
}

// What is the same for all batches: runs, and turns results into rows.
template <typename Row, typename Result, typename Run>
py::array run_rows(const BatchKind& kind, std::size_t size, const BatchOptions& given,
                   const py::object& out, const Run& run) {
  py::array rows = output_of<Row>(out, kind.row, size);
  std::vector<Result> results(size);
  auto* row = static_cast<Row*>(rows.mutable_data());
  BatchOptions options = given;
  run_interruptible(given.stop, [&](const std::stop_token& stop) {
    options.stop = stop;
    kind.arena->execute([&] { run(std::span<Result>(results), options); });
    for (std::size_t i = 0; i < size; ++i) fill_row(row[i], results[i]);
  });
  return rows;
}

BatchOptions batch_options(int thread_count, const std::stop_source* stop,
                           const py::object& progress) {
  BatchOptions options;
  options.thread_count = thread_count;
  if (stop != nullptr) options.stop = stop->get_token();
  options.progress = make_progress(progress);
  return options;
}

struct ToiBatchInput {
  ItemList<ShapePointer> a;
  ItemList<MotionPointer> X_WA;
  ItemList<ShapePointer> b;
  ItemList<MotionPointer> X_WB;
  ItemList<TimeInterval> intervals;
};

py::array toi_batch(const BatchKind& kind, const ToiBatchInput& input, const ToiOptions& options,
                    const BatchOptions& batch, const py::object& out) {
  DYOP_REQUIRE(!options.with_contacts,
               "with_contacts gives lists of contacts, which an array of rows cannot hold: call "
               "time_of_impact() for the queries that hit");
  BatchSize size;
  size.join(input.a, input.a.items.size(), "a");
  size.join(input.X_WA, input.X_WA.items.size(), "X_WA");
  size.join(input.b, input.b.items.size(), "b");
  size.join(input.X_WB, input.X_WB.items.size(), "X_WB");
  size.join(input.intervals, input.intervals.items.size(), "interval");
  const auto run = [&](std::span<ToiResult> results, const BatchOptions& used) {
    std::vector<ToiQuery> queries;
    queries.reserve(results.size());
    for (std::size_t i = 0; i < results.size(); ++i) {
      queries.push_back({input.a.at(i).get(), input.X_WA.at(i).get(), input.b.at(i).get(),
                         input.X_WB.at(i).get(), input.intervals.at(i), options});
    }
    time_of_impact_batch(queries, results, used);
  };
  return run_rows<ToiRow, ToiResult>(kind, size.get(), batch, out, run);
}

py::array distance_batch_rows(const BatchKind& kind, const ItemList<ShapePointer>& a,
                              const PoseList& X_WA, const ItemList<ShapePointer>& b,
                              const PoseList& X_WB, const DistanceOptions& options,
                              const BatchOptions& batch, const py::object& out) {
  BatchSize size;
  size.join(a, a.items.size(), "a");
  size.join(X_WA, X_WA.poses.size(), "X_WA");
  size.join(b, b.items.size(), "b");
  size.join(X_WB, X_WB.poses.size(), "X_WB");
  const auto run = [&](std::span<DistanceResult> results, const BatchOptions& used) {
    std::vector<DistanceQuery> queries;
    queries.reserve(results.size());
    for (std::size_t i = 0; i < results.size(); ++i) {
      queries.push_back({a.at(i).get(), X_WA.at(i), b.at(i).get(), X_WB.at(i), options, nullptr});
    }
    distance_batch(queries, results, used);
  };
  return run_rows<DistanceRow, DistanceResult>(kind, size.get(), batch, out, run);
}

// Motions of one class, stored together and shared one by one.
template <typename Kind, typename Make>
MotionArray motion_array(std::size_t size, const Make& make) {
  auto store = std::make_shared<std::vector<Kind>>();
  store->reserve(size);
  for (std::size_t i = 0; i < size; ++i) store->push_back(make(i));
  MotionArray array;
  array.motions.reserve(size);
  for (const Kind& motion : *store) array.motions.emplace_back(store, &motion);
  return array;
}

MotionArray constant_twist_motions(const py::object& X_WB0, const py::object& v_WB,
                                   const py::object& w_WB, Scalar t0) {
  const PoseList poses = poses_of(X_WB0, "X_WB0");
  const auto v = rows_of(v_WB, 3, "v_WB", CopyRule::IfNeeded);
  const auto w = rows_of(w_WB, 3, "w_WB", CopyRule::IfNeeded);
  const std::size_t size = points_in(v).size();
  DYOP_REQUIRE(points_in(w).size() == size && (poses.is_single || poses.poses.size() == size),
               "X_WB0, v_WB and w_WB must hold as many rows: ", poses.poses.size(), ", ", size,
               " and ", points_in(w).size());
  return motion_array<ConstantTwistMotion>(size, [&](std::size_t i) {
    return ConstantTwistMotion(poses.at(i), {points_in(v)[i], points_in(w)[i]}, t0);
  });
}

MotionArray interpolated_motions(const IntervalArgument& interval, const py::object& begin,
                                 const py::object& end) {
  const PoseList first = poses_of(begin, "X_WB0");
  const PoseList last = poses_of(end, "X_WB1");
  BatchSize size;
  size.join(first, first.poses.size(), "X_WB0");
  size.join(last, last.poses.size(), "X_WB1");
  return motion_array<InterpolatedMotion>(size.get(), [&](std::size_t i) {
    return InterpolatedMotion(interval.interval, first.at(i), last.at(i));
  });
}

void bind_motion_arrays(py::module_& m) {
  py::class_<MotionArray>(m, "MotionArray", "Many motions, for batches.")
      .def("__len__", [](const MotionArray& array) { return array.motions.size(); })
      .def(
          "__getitem__",
          [](const MotionArray& array, py::ssize_t i) {
            const auto size = py::ssize_t(array.motions.size());
            if (i < -size || i >= size) throw py::index_error();
            return std::const_pointer_cast<Motion>(
                array.motions[std::size_t(i < 0 ? i + size : i)]);
          },
          py::arg("index"))
      .def(py::pickle(
          [](const MotionArray& array) {
            py::list motions;
            for (const MotionPointer& motion : array.motions) {
              motions.append(std::const_pointer_cast<Motion>(motion));
            }
            return py::make_tuple(motions);
          },
          [](const py::tuple& state) {
            MotionArray array;
            for (const py::handle motion : state[0]) {
              array.motions.push_back(motion.cast<std::shared_ptr<Motion>>());
            }
            return array;
          }));
  m.def(
      "constant_twist_motions", &constant_twist_motions, py::arg("X_WB0"), py::arg("v_WB"),
      py::arg("w_WB"), py::arg("t0") = 0.0,
      "N ConstantTwistMotions from poses at time t0, v_WB (N, 3) and w_WB (N, 3). Poses: one for\n"
      "all, (N, 4, 4), or a pair of quaternions (N, 4) and positions (N, 3).");
  m.def("interpolated_motions", &interpolated_motions, py::arg("interval"), py::arg("X_WB0"),
        py::arg("X_WB1"), "N InterpolatedMotions over one interval, from poses at both ends.");
}

std::vector<JointPath> paths_of(const ChainArgument& chain, const py::iterable& source) {
  std::vector<JointPath> paths;
  for (const py::handle item : source) {
    DYOP_REQUIRE(py::isinstance<JointPath>(item), "paths[", paths.size(),
                 "] must be a JointPath, not ", std::string(py::repr(item)));
    paths.push_back(chain.expand(item.cast<const JointPath&>()));
  }
  return paths;
}

constexpr const char* kBatchDoc =
    "Each argument is one object for all queries, or a sequence of N. Returns a structured array\n"
    "of N rows (or fills `out`): the same bytes for every thread_count (0: all). Missing numbers\n"
    "are NaN, missing indices -1; status holds the integers of the enum. progress(done, total) is\n"
    "called at most ten times a second. Ctrl-C ends the batch.";

void bind_toi_batch(py::module_& m, const RowTypes& types, const Arena& arena) {
  m.def(
      "time_of_impact_batch",
      [kind = BatchKind{types.toi, arena}](
          const py::object& a, const py::object& X_WA, const py::object& b, const py::object& X_WB,
          const py::object& interval, const PythonToiOptions* options, int thread_count,
          const py::object& progress, const std::stop_source* stop, const py::object& out) {
        const ToiBatchInput input{items_of<ShapePointer>(a, "a"),
                                  items_of<MotionPointer>(X_WA, "X_WA"),
                                  items_of<ShapePointer>(b, "b"),
                                  items_of<MotionPointer>(X_WB, "X_WB"), intervals_of(interval)};
        return toi_batch(kind, input, options_or_default(options),
                         batch_options(thread_count, stop, progress), out);
      },
      py::arg("a"), py::arg("X_WA"), py::arg("b"), py::arg("X_WB"),
      py::arg("interval") = py::make_tuple(0.0, 1.0), py::arg("options") = py::none(),
      py::kw_only(), py::arg("thread_count") = 0, py::arg("progress") = py::none(),
      py::arg("stop") = py::none(), py::arg("out") = py::none(),
      (std::string("Many time_of_impact() queries on several threads. ") + kBatchDoc).c_str());
}

void bind_distance_batches(py::module_& m, const RowTypes& types, const Arena& arena) {
  m.def(
      "distance_batch",
      [kind = BatchKind{types.distance, arena}](
          const py::object& a, const py::object& X_WA, const py::object& b, const py::object& X_WB,
          const DistanceOptions* options, int thread_count, const py::object& progress,
          const std::stop_source* stop, const py::object& out) {
        return distance_batch_rows(kind, items_of<ShapePointer>(a, "a"), poses_of(X_WA, "X_WA"),
                                   items_of<ShapePointer>(b, "b"), poses_of(X_WB, "X_WB"),
                                   options != nullptr ? *options : DistanceOptions(),
                                   batch_options(thread_count, stop, progress), out);
      },
      py::arg("a"), py::arg("X_WA"), py::arg("b"), py::arg("X_WB"), py::arg("options") = py::none(),
      py::kw_only(), py::arg("thread_count") = 0, py::arg("progress") = py::none(),
      py::arg("stop") = py::none(), py::arg("out") = py::none(),
      (std::string("Many distance() queries on several threads. ") + kBatchDoc).c_str());
  m.def(
      "point_distance_batch",
      [kind = BatchKind{types.point, arena}](
          const Shape& shape, const PoseArgument& X_WS, const py::object& points,
          const PointDistanceOptions* options, int thread_count, const py::object& progress,
          const std::stop_source* stop, const py::object& copy, const py::object& out) {
        const auto rows = rows_of(points, 3, "points_W", copy_rule_of(copy));
        const PointDistanceOptions used = options != nullptr ? *options : PointDistanceOptions();
        const auto run = [&](std::span<PointDistance> results, const BatchOptions& batch) {
          point_distance_batch(shape, X_WS.X, points_in(rows), results, used, batch);
        };
        return run_rows<PointRow, PointDistance>(
            kind, points_in(rows).size(), batch_options(thread_count, stop, progress), out, run);
      },
      py::arg("shape"), py::arg("X_WS"), py::arg("points_W"), py::arg("options") = py::none(),
      py::kw_only(), py::arg("thread_count") = 0, py::arg("progress") = py::none(),
      py::arg("stop") = py::none(), py::arg("copy") = py::none(), py::arg("out") = py::none(),
      (std::string("The distance of many points (N, 3) from one shape. Contiguous float64 points\n"
                   "are read where they are; copy=False refuses others. ") +
       kBatchDoc)
          .c_str());
}

void bind_ray_batch(py::module_& m, const RowTypes& types, const Arena& arena) {
  m.def(
      "ray_cast_batch",
      [kind = BatchKind{types.ray, arena}](
          const Shape& shape, const PoseArgument& X_WS, const py::object& points,
          const py::object& directions, Scalar length, Scalar radius, int thread_count,
          const py::object& progress, const std::stop_source* stop, const py::object& out) {
        const auto starts = rows_of(points, 3, "points_W", CopyRule::IfNeeded);
        const auto ways = rows_of(directions, 3, "directions_W", CopyRule::IfNeeded);
        const std::span<const Vector3> p = points_in(starts);
        const std::span<const Vector3> d = points_in(ways);
        DYOP_REQUIRE(p.size() == d.size(), "points_W holds ", p.size(), " rows, but directions_W ",
                     d.size());
        const auto run = [&](std::span<RayHit> hits, const BatchOptions& batch) {
          std::vector<Ray> rays;
          rays.reserve(hits.size());
          for (std::size_t i = 0; i < hits.size(); ++i)
            rays.push_back({p[i], d[i], length, radius});
          ray_cast_batch(shape, X_WS.X, rays, hits, batch);
        };
        return run_rows<RayRow, RayHit>(kind, p.size(), batch_options(thread_count, stop, progress),
                                        out, run);
      },
      py::arg("shape"), py::arg("X_WS"), py::arg("points_W"), py::arg("directions_W"),
      py::arg("length") = kInfinity, py::arg("radius") = 0.0, py::kw_only(),
      py::arg("thread_count") = 0, py::arg("progress") = py::none(), py::arg("stop") = py::none(),
      py::arg("out") = py::none(),
      (std::string(
           "Many rays, from points_W (N, 3) along directions_W (N, 3), against one shape. ") +
       kBatchDoc)
          .c_str());
}

void bind_chain_batch(py::module_& m, const RowTypes& types, const Arena& arena) {
  m.def(
      "certify_batch",
      [kind = BatchKind{types.chain, arena}](
          const ChainArgument& chain, const py::iterable& paths, SharedObstacleSet& obstacles,
          const PythonToiOptions* options, std::uint32_t groups, const py::object& accepts,
          bool with_self_collision, int thread_count, const py::object& progress,
          const std::stop_source* stop, const py::object& out) {
        const std::vector<JointPath> expanded = paths_of(chain, paths);
        const ChainOptions used{options_or_default(options), make_filter(groups, accepts),
                                with_self_collision};
        return obstacles.read([&](const ObstacleSet& set) {
          const auto run = [&](std::span<ChainResult> results, const BatchOptions& batch) {
            certify_batch(*chain.chain, expanded, set, results, used, batch);
          };
          return run_rows<ChainRow, ChainResult>(
              kind, expanded.size(), batch_options(thread_count, stop, progress), out, run);
        });
      },
      py::arg("chain"), py::arg("paths"), py::arg("obstacles"), py::arg("options") = py::none(),
      py::arg("groups") = ~std::uint32_t{0}, py::arg("accepts") = py::none(),
      py::arg("with_self_collision") = true, py::kw_only(), py::arg("thread_count") = 0,
      py::arg("progress") = py::none(), py::arg("stop") = py::none(), py::arg("out") = py::none(),
      "certify() for many paths of one chain or robot, on several threads. Returns a structured\n"
      "array of a row for each path (or fills `out`): the same bytes for every thread_count (0:\n"
      "all). Missing numbers are NaN, missing indices -1; status holds the integers of the enum.\n"
      "progress(done, total) is called at most ten times a second. Ctrl-C ends the batch.");
}

}  // namespace

void bind_batches(py::module_& m) {
  bind_motion_arrays(m);
  const RowTypes types;
  const Arena arena = make_arena();
  bind_toi_batch(m, types, arena);
  bind_distance_batches(m, types, arena);
  bind_ray_batch(m, types, arena);
  bind_chain_batch(m, types, arena);
  m.attr("toi_row") = types.toi;
  m.attr("chain_row") = types.chain;
  m.attr("distance_row") = types.distance;
  m.attr("point_row") = types.point;
  m.attr("ray_row") = types.ray;
}

}  // namespace dyop::python
