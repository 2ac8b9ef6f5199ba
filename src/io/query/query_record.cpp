// SPDX-License-Identifier: BSD-3-Clause
#include "dyop/io/query_record.h"

#include <algorithm>
#include <memory>
#include <sstream>

#include "dyop/core/error.h"
#include "dyop/geometry/shape.h"
#include "dyop/io/result_text.h"
#include "geometry/shape_forms.h"
#include "io/file_bytes.h"
#include "io/json_reader.h"
#include "io/motion_json.h"
#include "io/result_json.h"

namespace dyop::io_internal {

/// The object "shape" of docs/formats.md.
/// @throws InvalidArgument for a shape that is not one of dyop's.
Json record_shape(const Shape& shape);

/// Throws FileError.
std::shared_ptr<const Shape> recorded_shape(const JsonNode& node);

}  // namespace dyop::io_internal

namespace dyop {
namespace {

using io_internal::hex_json;
using io_internal::hex_number;
using io_internal::Json;
using io_internal::JsonNode;

// Version of the format; readers reject others.
constexpr std::int64_t kFormat = 1;

Json body_json(const Shape& shape, const Motion& motion) {
  return {{"shape", io_internal::record_shape(shape)},
          {"motion", io_internal::record_motion(motion)}};
}

Json options_json(const ToiOptions& options, Scalar distance_tolerance) {
  return {{"target_distance", hex_json(options.target_distance)},
          {"distance_tolerance", hex_json(distance_tolerance)},
          {"max_node_pairs", options.max_node_pairs},
          {"with_contacts", options.with_contacts},
          {"solid_a", options.solid_a},
          {"solid_b", options.solid_b}};
}

Json query_json(const ToiQuery& query, const ToiOptions& options) {
  DYOP_REQUIRE(query.a && query.b && query.X_WA && query.X_WB,
               "a query without a shape or a motion cannot be recorded");
  Json json;
  json["dyop_query_record"] = kFormat;
  json["version"] = library_version();
  json["a"] = body_json(*query.a, *query.X_WA);
  json["b"] = body_json(*query.b, *query.X_WB);
  json["interval"] = Json::array({hex_json(query.interval.begin), hex_json(query.interval.end)});
  const Scalar tolerance = options.distance_tolerance
                               ? *options.distance_tolerance
                               : default_distance_tolerance(*query.a, *query.b);
  json["options"] = options_json(options, tolerance);
  return json;
}

Json answer_json(const ToiResult& result) {
  Json json = io_internal::with_hex_numbers(io_internal::to_json(result));
  json["X_WA"] = hex_json(result.X_WA);
  json["X_WB"] = hex_json(result.X_WB);
  json["contacts"] = io_internal::with_hex_numbers(io_internal::to_json(result.contacts));
  return json;
}

// The options as given, except that a query ended by a deadline must end at the same place again.
ToiOptions repeatable_options(const ToiOptions& options, const ToiResult& result) {
  DYOP_REQUIRE(result.status != ToiStatus::Cancelled && result.status != ToiStatus::NotRun,
               "a query that was ", name_of(result.status), " has no answer to record");
  ToiOptions repeatable = options;
  if (result.status == ToiStatus::BudgetExhausted) {
    repeatable.max_node_pairs = result.statistics.node_pairs;
  }
  DYOP_REQUIRE(repeatable.max_node_pairs > 0,
               "a query that its deadline ended before its first step cannot be recorded");
  return repeatable;
}

// Prints structures over several lines, vectors on one.
void print(std::ostream& out, const Json& json, const std::string& indent) {
  const bool has_lines =
      json.is_structured() && std::any_of(json.begin(), json.end(), [&](const Json& value) {
        return json.is_object() || value.is_structured();
      });
  if (!has_lines) {
    out << json.dump(-1, ' ', true, Json::error_handler_t::replace);
    return;
  }
  const std::string deeper = indent + " ";
  const char* separator = json.is_object() ? "{" : "[";
  for (const auto& [key, value] : json.items()) {
    out << separator << deeper;
    if (json.is_object()) out << Json(key).dump() << ": ";
    print(out, value, deeper);
    separator = ",";
  }
  out << indent << (json.is_object() ? '}' : ']');
}

void write(const std::filesystem::path& file, const Json& json) {
  std::ostringstream out;
  print(out, json, "\n");
  out << '\n';
  io_internal::write_whole_file(file, out.str());
}

void add_differences(const std::string& field, const Json* recorded, const Json* now,
                     std::vector<FieldDifference>& differences) {
  if (recorded != nullptr && now != nullptr && *recorded == *now) return;
  const auto text = [](const Json* json) {
    return json == nullptr ? "" : json->dump(-1, ' ', true, Json::error_handler_t::replace);
  };
  const bool are_objects = recorded && now && recorded->is_object() && now->is_object();
  const bool are_arrays = recorded && now && recorded->is_array() && now->is_array();
  if (!are_objects && !are_arrays) {
    differences.push_back({field, text(recorded), text(now)});
    return;
  }
  if (are_arrays) {
    for (std::size_t k = 0; k < std::max(recorded->size(), now->size()); ++k) {
      add_differences(field + "[" + std::to_string(k) + "]",
                      k < recorded->size() ? &(*recorded)[k] : nullptr,
                      k < now->size() ? &(*now)[k] : nullptr, differences);
    }
    return;
  }
  const std::string prefix = field.empty() ? "" : field + ".";
  for (const auto& [key, value] : recorded->items()) {
    add_differences(prefix + key, &value, now->contains(key) ? &(*now)[key] : nullptr, differences);
  }
  for (const auto& [key, value] : now->items()) {
    if (!recorded->contains(key)) add_differences(prefix + key, nullptr, &value, differences);
  }
}

// Whether arrays and objects are nested more deeply than the limit: printing a value is recursive,
// and the file decides the depth.
bool is_deeper_than(int limit, const Json& json) {
  if (!json.is_structured()) return false;
  if (limit == 0) return true;
  for (const Json& value : json) {
    if (is_deeper_than(limit - 1, value)) return true;
  }
  return false;
}

struct Body {
  std::shared_ptr<const Shape> shape;
  std::shared_ptr<const Motion> motion;
};

Body read_body(const JsonNode& node) {
  node.require_object({"shape", "motion"});
  return {io_internal::recorded_shape(node.at("shape")),
          io_internal::recorded_motion(node.at("motion"))};
}

TimeInterval read_interval(const JsonNode& node) {
  const std::vector<JsonNode> ends = node.items(2);
  const TimeInterval interval{hex_number(ends[0]), hex_number(ends[1])};
  node.guard([&] { require_valid(interval); });
  return interval;
}

ToiOptions read_options(const JsonNode& node) {
  node.require_object({"target_distance", "distance_tolerance", "max_node_pairs", "with_contacts",
                       "solid_a", "solid_b"});
  ToiOptions options;
  options.target_distance = hex_number(node.at("target_distance"));
  options.distance_tolerance = hex_number(node.at("distance_tolerance"));
  options.max_node_pairs = node.at("max_node_pairs").positive_integer();
  options.with_contacts = node.at("with_contacts").boolean();
  options.solid_a = node.at("solid_a").boolean();
  options.solid_b = node.at("solid_b").boolean();
  return options;
}

}  // namespace

struct QueryRecord::Data {
  std::string version;
  Body a;
  Body b;
  TimeInterval interval;
  ToiOptions options;
  std::string failure;
  Json result;  // null after a failure
};

void write_query_record(const std::filesystem::path& file, const ToiQuery& query,
                        const ToiResult& result) {
  Json json = query_json(query, repeatable_options(query.options, result));
  json["result"] = answer_json(result);
  write(file, json);
}

void write_failure_record(const std::filesystem::path& file, const ToiQuery& query,
                          const std::string& failure) {
  Json json = query_json(query, query.options);
  json["failure"] = failure;
  write(file, json);
}

QueryRecord::QueryRecord(const std::filesystem::path& file) {
  const Json json = io_internal::parse_json(file, io_internal::read_bytes(file));
  const JsonNode root(file, json);
  root.require_object(
      {"dyop_query_record", "version", "a", "b", "interval", "options", "result", "failure"});
  if (root.at("dyop_query_record").positive_integer() != kFormat) {
    root.at("dyop_query_record").fail_expected(std::to_string(kFormat));
  }
  if (root.has("result") == root.has("failure")) root.fail("expected either result or failure");
  Data data;
  data.version = root.at("version").text();
  data.a = read_body(root.at("a"));
  data.b = read_body(root.at("b"));
  data.interval = read_interval(root.at("interval"));
  data.options = read_options(root.at("options"));
  if (root.has("failure")) {
    data.failure = root.at("failure").text();
  } else {
    data.result = root.at("result").value();
    constexpr int kDeepest = 8;
    if (!data.result.is_object() || is_deeper_than(kDeepest, data.result)) {
      root.at("result").fail_expected("the fields of a result");
    }
  }
  data_ = std::make_unique<const Data>(std::move(data));
}

QueryRecord::~QueryRecord() = default;
QueryRecord::QueryRecord(QueryRecord&&) noexcept = default;
QueryRecord& QueryRecord::operator=(QueryRecord&&) noexcept = default;

const std::string& QueryRecord::version() const {
  return data_->version;
}

ToiQuery QueryRecord::query() const {
  return {data_->a.shape.get(),  data_->a.motion.get(), data_->b.shape.get(),
          data_->b.motion.get(), data_->interval,       data_->options};
}

const std::string& QueryRecord::failure() const {
  return data_->failure;
}

std::vector<FieldDifference> QueryRecord::differences(const ToiResult& now) const {
  std::vector<FieldDifference> differences;
  const Json json = answer_json(now);
  const Json& recorded = data_->result.is_null() ? Json::object() : data_->result;
  add_differences("", &recorded, &json, differences);
  return differences;
}

std::string library_version() {
  return DYOP_VERSION;
}

}  // namespace dyop

namespace dyop::io_internal {
namespace {

using geometry_internal::FormedShape;
using geometry_internal::ShapeForm;
using geometry_internal::ShapeNumber;
using geometry_internal::ShapeSink;

Json points_json(std::span<const Vector3> points) {
  Json json = Json::array();
  for (const Vector3& p : points) json.push_back(hex_json(p));
  return json;
}

std::vector<Vector3> points_from(const JsonNode& node) {
  std::vector<Vector3> points;
  for (const JsonNode& item : node.items(1)) points.push_back(hex_vector(item));
  return points;
}

std::int32_t vertex_number(const Json& json, const JsonNode& node) {
  const bool fits = json.is_number_integer() && json >= 0 && json < (std::int64_t{1} << 31);
  if (!fits) node.fail_expected("three vertex numbers");
  return json.get<std::int32_t>();
}

TriangleIndices triangle_from(const JsonNode& node) {
  const Json& json = node.value();
  if (!json.is_array() || json.size() != 3) node.fail_expected("three vertex numbers");
  return {vertex_number(json[0], node), vertex_number(json[1], node), vertex_number(json[2], node)};
}

std::shared_ptr<const Shape> recorded_mesh(const JsonNode& node) {
  node.require_object({"kind", "vertices", "triangles"});
  std::vector<TriangleIndices> triangles;
  for (const JsonNode& item : node.at("triangles").items(1)) {
    triangles.push_back(triangle_from(item));
  }
  return std::make_shared<TriangleMesh>(points_from(node.at("vertices")), std::move(triangles));
}

std::shared_ptr<const Shape> recorded_hull(const JsonNode& node) {
  node.require_object({"kind", "points", "radius"});
  const Scalar radius = node.has("radius") ? hex_number(node.at("radius")) : 0;
  return std::make_shared<ConvexHull>(points_from(node.at("points")), radius);
}

Json form_json(const FormedShape& shape) {
  Json json{{"kind", shape.form->name}};
  shape.for_each_number([&](std::string_view name, std::span<const Scalar> values) {
    json[std::string(name)] = values.size() == 1
                                  ? hex_json(values[0])
                                  : hex_json(Vector3(values[0], values[1], values[2]));
  });
  return json;
}

std::shared_ptr<const Shape> recorded_form(const ShapeForm& form, const JsonNode& node) {
  std::vector<std::string_view> keys{"kind"};
  for (const ShapeNumber& number : form.numbers) keys.push_back(number.name);
  node.require_object(keys);
  std::vector<Scalar> values;
  for (const ShapeNumber& number : form.numbers) {
    if (number.count == 1) {
      values.push_back(hex_number(node.at(number.name)));
    } else {
      const Vector3 vector = hex_vector(node.at(number.name));
      values.insert(values.end(), vector.begin(), vector.end());
    }
  }
  return form.make(values);
}

}  // namespace

Json record_shape(const Shape& shape) {
  return geometry_internal::visit_shape(
      shape, ShapeSink{[](const TriangleMesh& mesh) {
                         Json json{{"kind", "mesh"}, {"vertices", points_json(mesh.vertices())}};
                         json["triangles"] = Json::array();
                         for (const TriangleIndices& t : mesh.triangles())
                           json["triangles"].push_back(Json(t));
                         return json;
                       },
                       [](const ConvexHull& hull) {
                         Json json{{"kind", "hull"}, {"points", points_json(hull.vertices())}};
                         if (hull.rounding_radius() > 0) {
                           json["radius"] = hex_json(hull.rounding_radius());
                         }
                         return json;
                       },
                       [](const CompoundShape&) -> Json {
                         throw InvalidArgument("a compound cannot be recorded in a query");
                       },
                       [](const FormedShape& formed) { return form_json(formed); }});
}

std::shared_ptr<const Shape> recorded_shape(const JsonNode& node) {
  const JsonNode kind = node.at("kind");
  const std::string name = kind.text();
  return node.guard([&]() -> std::shared_ptr<const Shape> {
    if (name == "mesh") return recorded_mesh(node);
    if (name == "hull") return recorded_hull(node);
    if (const ShapeForm* form = geometry_internal::find_shape_form(name))
      return recorded_form(*form, node);
    std::string names = "one of mesh, hull";
    for (const ShapeForm& form : geometry_internal::shape_forms())
      names.append(", ").append(form.name);
    kind.fail_expected(names);
  });
}

}  // namespace dyop::io_internal
