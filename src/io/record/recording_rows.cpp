// SPDX-License-Identifier: BSD-3-Clause
#include "io/record/recording_rows.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstring>
#include <limits>
#include <type_traits>

#include "dyop/core/error.h"
#include "geometry/shape_forms.h"
#include "io/file_bytes.h"

namespace dyop::io_internal {
namespace {

template <typename Number>
hid_t number_type() {
  if constexpr (std::is_same_v<Number, double>) {
    return H5T_NATIVE_DOUBLE;
  } else if constexpr (std::is_same_v<Number, float>) {
    return H5T_NATIVE_FLOAT;
  } else if constexpr (std::is_same_v<Number, std::int32_t>) {
    return H5T_NATIVE_INT32;
  } else if constexpr (std::is_same_v<Number, std::uint32_t>) {
    return H5T_NATIVE_UINT32;
  } else if constexpr (std::is_same_v<Number, std::int64_t>) {
    return H5T_NATIVE_INT64;
  } else {
    static_assert(std::is_same_v<Number, std::uint64_t>);
    return H5T_NATIVE_UINT64;
  }
}

Hdf5RowType witness_type();

template <typename Member>
void add_member(Hdf5RowType& type, const char* name, std::size_t offset) {
  if constexpr (std::is_arithmetic_v<Member>) {
    type.add(name, offset, number_type<Member>());
  } else if constexpr (std::is_same_v<Member, WitnessRow>) {
    type.add(name, offset, witness_type().get());
  } else {
    type.add_array(name, offset, number_type<typename Member::value_type>(),
                   std::tuple_size_v<Member>);
  }
}

}  // namespace

// The name in the file is the name of the member.
#define DYOP_ROW_MEMBER(Row, member) \
  add_member<decltype(Row::member)>(type, #member, offsetof(Row, member))

namespace {

Hdf5RowType witness_type() {
  Hdf5RowType type(sizeof(WitnessRow));
  DYOP_ROW_MEMBER(WitnessRow, lower);
  DYOP_ROW_MEMBER(WitnessRow, upper);
  DYOP_ROW_MEMBER(WitnessRow, p_a);
  DYOP_ROW_MEMBER(WitnessRow, p_b);
  DYOP_ROW_MEMBER(WitnessRow, normal);
  DYOP_ROW_MEMBER(WitnessRow, triangle_a);
  DYOP_ROW_MEMBER(WitnessRow, triangle_b);
  DYOP_ROW_MEMBER(WitnessRow, child_a);
  DYOP_ROW_MEMBER(WitnessRow, child_b);
  DYOP_ROW_MEMBER(WitnessRow, feature_a);
  DYOP_ROW_MEMBER(WitnessRow, feature_b);
  return type;
}

}  // namespace

template <>
Hdf5RowType row_type<SegmentRow>() {
  Hdf5RowType type(sizeof(SegmentRow));
  DYOP_ROW_MEMBER(SegmentRow, begin);
  DYOP_ROW_MEMBER(SegmentRow, first);
  DYOP_ROW_MEMBER(SegmentRow, body);
  DYOP_ROW_MEMBER(SegmentRow, kind);
  return type;
}

template <>
Hdf5RowType row_type<StepRow>() {
  Hdf5RowType type(sizeof(StepRow));
  DYOP_ROW_MEMBER(StepRow, begin);
  DYOP_ROW_MEMBER(StepRow, end);
  return type;
}

template <>
Hdf5RowType row_type<ImpactRow>() {
  Hdf5RowType type(sizeof(ImpactRow));
  DYOP_ROW_MEMBER(ImpactRow, t);
  DYOP_ROW_MEMBER(ImpactRow, t_safe);
  DYOP_ROW_MEMBER(ImpactRow, t_hit);
  DYOP_ROW_MEMBER(ImpactRow, rounding_allowance);
  DYOP_ROW_MEMBER(ImpactRow, closing_speed);
  DYOP_ROW_MEMBER(ImpactRow, node_pairs);
  DYOP_ROW_MEMBER(ImpactRow, first_contact);
  DYOP_ROW_MEMBER(ImpactRow, contact_count);
  DYOP_ROW_MEMBER(ImpactRow, a);
  DYOP_ROW_MEMBER(ImpactRow, b);
  DYOP_ROW_MEMBER(ImpactRow, status);
  DYOP_ROW_MEMBER(ImpactRow, has_witness);
  DYOP_ROW_MEMBER(ImpactRow, witness);
  return type;
}

template <>
Hdf5RowType row_type<ContactRow>() {
  Hdf5RowType type(sizeof(ContactRow));
  DYOP_ROW_MEMBER(ContactRow, a);
  DYOP_ROW_MEMBER(ContactRow, b);
  DYOP_ROW_MEMBER(ContactRow, normal_velocity);
  DYOP_ROW_MEMBER(ContactRow, impulse);
  DYOP_ROW_MEMBER(ContactRow, witness);
  return type;
}

template <>
Hdf5RowType row_type<PairRow>() {
  Hdf5RowType type(sizeof(PairRow));
  DYOP_ROW_MEMBER(PairRow, frame);
  DYOP_ROW_MEMBER(PairRow, a);
  DYOP_ROW_MEMBER(PairRow, b);
  DYOP_ROW_MEMBER(PairRow, proof);
  DYOP_ROW_MEMBER(PairRow, gap_lower);
  DYOP_ROW_MEMBER(PairRow, gap_upper);
  DYOP_ROW_MEMBER(PairRow, pivot);
  DYOP_ROW_MEMBER(PairRow, normal);
  DYOP_ROW_MEMBER(PairRow, residual);
  DYOP_ROW_MEMBER(PairRow, advancement_steps);
  DYOP_ROW_MEMBER(PairRow, first_contact);
  DYOP_ROW_MEMBER(PairRow, contact_count);
  return type;
}

template <>
Hdf5RowType row_type<SnapshotRow>() {
  Hdf5RowType type(sizeof(SnapshotRow));
  DYOP_ROW_MEMBER(SnapshotRow, obstacle);
  DYOP_ROW_MEMBER(SnapshotRow, number);
  DYOP_ROW_MEMBER(SnapshotRow, duration);
  DYOP_ROW_MEMBER(SnapshotRow, first_vertex);
  DYOP_ROW_MEMBER(SnapshotRow, vertex_count);
  return type;
}

template <>
Hdf5RowType row_type<MeshRow>() {
  Hdf5RowType type(sizeof(MeshRow));
  DYOP_ROW_MEMBER(MeshRow, obstacle);
  DYOP_ROW_MEMBER(MeshRow, number);
  DYOP_ROW_MEMBER(MeshRow, first_triangle);
  DYOP_ROW_MEMBER(MeshRow, triangle_count);
  return type;
}

template <>
Hdf5RowType row_type<PairContactRow>() {
  Hdf5RowType type(sizeof(PairContactRow));
  DYOP_ROW_MEMBER(PairContactRow, from_pivot_a);
  DYOP_ROW_MEMBER(PairContactRow, from_pivot_b);
  DYOP_ROW_MEMBER(PairContactRow, normal);
  DYOP_ROW_MEMBER(PairContactRow, impulse);
  DYOP_ROW_MEMBER(PairContactRow, gap);
  DYOP_ROW_MEMBER(PairContactRow, lower);
  DYOP_ROW_MEMBER(PairContactRow, upper);
  return type;
}

template <>
Hdf5RowType row_type<EventRow>() {
  Hdf5RowType type(sizeof(EventRow));
  DYOP_ROW_MEMBER(EventRow, t);
  DYOP_ROW_MEMBER(EventRow, kind);
  DYOP_ROW_MEMBER(EventRow, a);
  DYOP_ROW_MEMBER(EventRow, b);
  return type;
}

template <>
Hdf5RowType row_type<VelocityChangeRow>() {
  Hdf5RowType type(sizeof(VelocityChangeRow));
  DYOP_ROW_MEMBER(VelocityChangeRow, begin);
  DYOP_ROW_MEMBER(VelocityChangeRow, end);
  DYOP_ROW_MEMBER(VelocityChangeRow, kind);
  DYOP_ROW_MEMBER(VelocityChangeRow, momentum_count);
  DYOP_ROW_MEMBER(VelocityChangeRow, contact_count);
  DYOP_ROW_MEMBER(VelocityChangeRow, link_count);
  DYOP_ROW_MEMBER(VelocityChangeRow, wrench_count);
  DYOP_ROW_MEMBER(VelocityChangeRow, first_momentum);
  DYOP_ROW_MEMBER(VelocityChangeRow, first_contact);
  DYOP_ROW_MEMBER(VelocityChangeRow, first_link);
  DYOP_ROW_MEMBER(VelocityChangeRow, first_wrench);
  return type;
}

template <>
Hdf5RowType row_type<MomentumRow>() {
  Hdf5RowType type(sizeof(MomentumRow));
  DYOP_ROW_MEMBER(MomentumRow, body);
  DYOP_ROW_MEMBER(MomentumRow, is_before);
  DYOP_ROW_MEMBER(MomentumRow, v);
  DYOP_ROW_MEMBER(MomentumRow, L);
  return type;
}

template <>
Hdf5RowType row_type<ContactImpulseRow>() {
  Hdf5RowType type(sizeof(ContactImpulseRow));
  DYOP_ROW_MEMBER(ContactImpulseRow, a);
  DYOP_ROW_MEMBER(ContactImpulseRow, b);
  DYOP_ROW_MEMBER(ContactImpulseRow, p);
  DYOP_ROW_MEMBER(ContactImpulseRow, normal);
  DYOP_ROW_MEMBER(ContactImpulseRow, impulse);
  DYOP_ROW_MEMBER(ContactImpulseRow, target);
  DYOP_ROW_MEMBER(ContactImpulseRow, friction);
  return type;
}

template <>
Hdf5RowType row_type<LinkImpulseRow>() {
  Hdf5RowType type(sizeof(LinkImpulseRow));
  DYOP_ROW_MEMBER(LinkImpulseRow, kind);
  DYOP_ROW_MEMBER(LinkImpulseRow, a);
  DYOP_ROW_MEMBER(LinkImpulseRow, b);
  DYOP_ROW_MEMBER(LinkImpulseRow, impulse);
  DYOP_ROW_MEMBER(LinkImpulseRow, angular_a);
  DYOP_ROW_MEMBER(LinkImpulseRow, angular_b);
  return type;
}

template <>
Hdf5RowType row_type<WrenchImpulseRow>() {
  Hdf5RowType type(sizeof(WrenchImpulseRow));
  DYOP_ROW_MEMBER(WrenchImpulseRow, body);
  DYOP_ROW_MEMBER(WrenchImpulseRow, impulse);
  DYOP_ROW_MEMBER(WrenchImpulseRow, angular);
  return type;
}

template <>
Hdf5RowType row_type<FrameRow>() {
  Hdf5RowType type(sizeof(FrameRow));
  DYOP_ROW_MEMBER(FrameRow, begin);
  DYOP_ROW_MEMBER(FrameRow, end);
  DYOP_ROW_MEMBER(FrameRow, status);
  DYOP_ROW_MEMBER(FrameRow, a);
  DYOP_ROW_MEMBER(FrameRow, b);
  DYOP_ROW_MEMBER(FrameRow, kinetic_energy);
  DYOP_ROW_MEMBER(FrameRow, momentum);
  DYOP_ROW_MEMBER(FrameRow, angular_momentum);
  DYOP_ROW_MEMBER(FrameRow, steps);
  DYOP_ROW_MEMBER(FrameRow, substeps);
  DYOP_ROW_MEMBER(FrameRow, islands);
  DYOP_ROW_MEMBER(FrameRow, rounds);
  DYOP_ROW_MEMBER(FrameRow, stalls);
  DYOP_ROW_MEMBER(FrameRow, contacts);
  DYOP_ROW_MEMBER(FrameRow, unconverged);
  DYOP_ROW_MEMBER(FrameRow, residual);
  DYOP_ROW_MEMBER(FrameRow, shortest_gap);
  DYOP_ROW_MEMBER(FrameRow, pairs_by_bound);
  DYOP_ROW_MEMBER(FrameRow, pairs_by_query);
  DYOP_ROW_MEMBER(FrameRow, pairs_at_rest);
  DYOP_ROW_MEMBER(FrameRow, pairs_excused);
  DYOP_ROW_MEMBER(FrameRow, integrator_steps);
  DYOP_ROW_MEMBER(FrameRow, rejected_steps);
  DYOP_ROW_MEMBER(FrameRow, function_evaluations);
  DYOP_ROW_MEMBER(FrameRow, box_tests);
  DYOP_ROW_MEMBER(FrameRow, leaf_tests);
  DYOP_ROW_MEMBER(FrameRow, node_pairs);
  DYOP_ROW_MEMBER(FrameRow, peak_queue);
  DYOP_ROW_MEMBER(FrameRow, step_count);
  DYOP_ROW_MEMBER(FrameRow, segment_count);
  DYOP_ROW_MEMBER(FrameRow, number_count);
  DYOP_ROW_MEMBER(FrameRow, impact_count);
  DYOP_ROW_MEMBER(FrameRow, contact_count);
  DYOP_ROW_MEMBER(FrameRow, pair_count);
  DYOP_ROW_MEMBER(FrameRow, pair_contact_count);
  DYOP_ROW_MEMBER(FrameRow, event_count);
  DYOP_ROW_MEMBER(FrameRow, body_bytes);
  DYOP_ROW_MEMBER(FrameRow, shape_bytes);
  DYOP_ROW_MEMBER(FrameRow, given_bytes);
  DYOP_ROW_MEMBER(FrameRow, vertex_count);
  DYOP_ROW_MEMBER(FrameRow, triangle_count);
  DYOP_ROW_MEMBER(FrameRow, change_count);
  DYOP_ROW_MEMBER(FrameRow, momentum_count);
  DYOP_ROW_MEMBER(FrameRow, contact_impulse_count);
  DYOP_ROW_MEMBER(FrameRow, link_impulse_count);
  DYOP_ROW_MEMBER(FrameRow, wrench_impulse_count);
  DYOP_ROW_MEMBER(FrameRow, rule_bytes);
  return type;
}

#undef DYOP_ROW_MEMBER

namespace {

KnownMomentum& known_of(std::vector<KnownMomentum>& known, std::size_t slot) {
  if (slot >= known.size()) known.resize(slot + 1);
  return known[slot];
}

}  // namespace

VelocityChangeRows rows_of(const VelocityChange& change, std::vector<KnownMomentum>& known,
                           const std::vector<bool>& has_wrench) {
  VelocityChangeRows rows;
  for (const MomentumChange& body : change.bodies) {
    const std::uint32_t slot = body.body.slot;
    KnownMomentum& last = known_of(known, slot);
    // What a Set found before it does not count.
    const bool is_last =
        change.kind == VelocityChangeKind::Set ||
        (last.is_known && last.v_W == body.v_before_W && last.L_W == body.L_before_W);
    if (!is_last)
      rows.momenta.push_back({slot, 1, row_of(body.v_before_W), row_of(body.L_before_W)});
    rows.momenta.push_back({slot, 0, row_of(body.v_W), row_of(body.L_W)});
    last = {true, body.v_W, body.L_W};
    if (slot < has_wrench.size() && has_wrench[slot]) {
      rows.wrenches.push_back({slot, 0, row_of(body.impulse_W), row_of(body.angular_impulse_W)});
    }
  }
  for (const ContactImpulse& contact : change.contacts) {
    rows.contacts.push_back({contact.a.slot, contact.b.slot, row_of(contact.p_W),
                             row_of(contact.nhat_AB_W), row_of(contact.impulse_W), contact.target,
                             contact.friction});
  }
  for (const LinkImpulse& link : change.links) {
    rows.links.push_back({static_cast<std::uint32_t>(link.kind), link.a.slot, link.b.slot, 0,
                          row_of(link.impulse_W), row_of(link.angular_a_W),
                          row_of(link.angular_b_W)});
  }
  return rows;
}

VelocityChange change_from(const VelocityChangeRow& row, const VelocityChangeRows& rows,
                           std::vector<KnownMomentum>& known) {
  VelocityChange change;
  DYOP_REQUIRE(row.kind <= static_cast<std::uint32_t>(VelocityChangeKind::Set),
               "a velocity change of the unknown kind ", row.kind);
  change.kind = static_cast<VelocityChangeKind>(row.kind);
  change.interval = {row.begin, row.end};
  for (const MomentumRow& momentum : rows.momenta) {
    KnownMomentum& last = known_of(known, momentum.body);
    if (momentum.is_before == 0) {
      MomentumChange& body = change.bodies.emplace_back();
      body.body = BodyId(momentum.body);
      body.v_before_W = last.v_W;
      body.L_before_W = last.L_W;
      body.v_W = vector_of(momentum.v);
      body.L_W = vector_of(momentum.L);
    }
    last = {true, vector_of(momentum.v), vector_of(momentum.L)};
  }
  for (const WrenchImpulseRow& wrench : rows.wrenches) {
    const auto body =
        std::find_if(change.bodies.begin(), change.bodies.end(),
                     [&](const MomentumChange& other) { return other.body.slot == wrench.body; });
    DYOP_REQUIRE(body != change.bodies.end(), "the wrench of a body that does not change");
    body->impulse_W = vector_of(wrench.impulse);
    body->angular_impulse_W = vector_of(wrench.angular);
  }
  for (const ContactImpulseRow& contact : rows.contacts) {
    change.contacts.push_back({BodyId(contact.a), BodyId(contact.b), vector_of(contact.p),
                               vector_of(contact.normal), vector_of(contact.impulse),
                               contact.target, contact.friction});
  }
  for (const LinkImpulseRow& link : rows.links) {
    DYOP_REQUIRE(link.kind <= static_cast<std::uint32_t>(LinkImpulse::Kind::Rolling),
                 "an impulse of the unknown kind ", link.kind);
    change.links.push_back({static_cast<LinkImpulse::Kind>(link.kind), BodyId(link.a),
                            BodyId(link.b), vector_of(link.impulse), vector_of(link.angular_a),
                            vector_of(link.angular_b)});
  }
  return change;
}

namespace {

using geometry_internal::FormedShape;
using geometry_internal::ShapeForm;
using geometry_internal::ShapeNumber;
using geometry_internal::ShapeSink;
using geometry_internal::visit_shape;

template <typename Number>
void put(std::string& bytes, std::span<const Number> numbers) {
  if (numbers.empty()) return;
  bytes.append(reinterpret_cast<const char*>(numbers.data()), numbers.size_bytes());
}

void put(std::string& bytes, const Vector3& v) {
  put(bytes, std::span<const Scalar>(v.data(), 3));
}

void put_mesh(std::string& bytes, std::span<const Vector3> vertices,
              std::span<const TriangleIndices> triangles) {
  for (const Vector3& v : vertices) put(bytes, v);
  for (const TriangleIndices& t : triangles) put(bytes, std::span<const std::int32_t>(t));
}

void put_pose(std::string& bytes, const RigidPose& X) {
  for (Eigen::Index i = 0; i < 3; ++i) put(bytes, Vector3(X.rotation().row(i)));
  put(bytes, X.translation());
}

// A key with all that defines a shape: equal for shapes that behave the same.
std::string content_of(const Shape& shape) {
  std::string bytes;
  visit_shape(shape, ShapeSink{[&](const TriangleMesh& mesh) {
                                 bytes = "mesh";
                                 put_mesh(bytes, mesh.vertices(), mesh.triangles());
                               },
                               [&](const ConvexHull& hull) {
                                 bytes = "hull";
                                 put_mesh(bytes, hull.vertices(), {});
                                 const Scalar radius = hull.rounding_radius();
                                 if (radius > 0) put(bytes, Vector3(radius, 0, 0));
                               },
                               [&](const CompoundShape& compound) {
                                 bytes = "compound";
                                 for (const CompoundChild& child : compound.children()) {
                                   bytes += content_of(*child.shape);
                                   put_pose(bytes, child.X_CS);
                                 }
                               },
                               [&](const FormedShape& formed) {
                                 bytes = formed.form->name;
                                 std::vector<Scalar> values = formed.values;
                                 values.resize(3 * ((values.size() + 2) / 3));  // whole vectors
                                 put(bytes, std::span<const Scalar>(values));
                               }});
  return bytes;
}

std::vector<Vector3> vertices_of(const Json& line, const ShapeRows& rows) {
  const auto first = line.at("first_vertex").get<std::size_t>();
  const auto count = line.at("vertex_count").get<std::size_t>();
  DYOP_REQUIRE(first <= rows.vertices.size() && count <= rows.vertices.size() - first,
               "the vertices of a shape are missing");
  std::vector<Vector3> vertices;
  vertices.reserve(count);
  for (std::size_t k = first; k < first + count; ++k) {
    vertices.emplace_back(rows.vertices[k][0], rows.vertices[k][1], rows.vertices[k][2]);
  }
  return vertices;
}

void put_form(Json& line, const FormedShape& formed) {
  line["kind"] = formed.form->name;
  formed.for_each_number([&](std::string_view name, std::span<const Scalar> values) {
    line[std::string(name)] = values.size() == 1
                                  ? Json(values[0])
                                  : Json(std::vector<Scalar>(values.begin(), values.end()));
  });
}

std::shared_ptr<const Shape> form_from(const ShapeForm& form, const Json& line) {
  std::vector<Scalar> values;
  for (const ShapeNumber& number : form.numbers) {
    const Json& json = line.at(std::string(number.name));
    for (std::size_t k = 0; k < number.count; ++k)
      values.push_back((number.count == 1 ? json : json.at(k)).get<Scalar>());
  }
  return form.make(values);
}

std::shared_ptr<const Shape> mesh_from(const Json& line, const ShapeRows& rows) {
  const auto first = line.at("first_triangle").get<std::size_t>();
  const auto count = line.at("triangle_count").get<std::size_t>();
  DYOP_REQUIRE(first <= rows.triangles.size() && count <= rows.triangles.size() - first,
               "the triangles of a shape are missing");
  std::vector<TriangleIndices> triangles(count);
  std::copy_n(rows.triangles.begin() + std::ptrdiff_t(first), count, triangles.begin());
  return std::make_shared<TriangleMesh>(vertices_of(line, rows), std::move(triangles));
}

}  // namespace

Json pose_numbers(const RigidPose& X) {
  Json json = Json::array();
  for (Eigen::Index i = 0; i < 3; ++i) {
    for (Eigen::Index j = 0; j < 3; ++j) json.push_back(X.rotation()(i, j));
  }
  for (const Scalar x : X.translation()) json.push_back(x);
  return json;
}

RigidPose pose_from_numbers(const Json& json) {
  const auto x = json.get<std::vector<Scalar>>();
  DYOP_REQUIRE(x.size() == 12, "a pose has 12 numbers, not ", x.size());
  Matrix3 R;
  for (std::size_t k = 0; k < 9; ++k) R(Eigen::Index(k / 3), Eigen::Index(k % 3)) = x[k];
  return RigidPose::from_trusted(R, Vector3(x[9], x[10], x[11]));
}

std::uint64_t content_hash(const Shape& shape) {
  return digest_of(content_of(shape));
}

std::size_t ShapeWriter::add(const std::shared_ptr<const Shape>& shape, std::string& lines,
                             ShapeRows& rows) {
  const auto same = std::find_if(stored_.begin(), stored_.end(),
                                 [&](const Stored& stored) { return stored.shape == shape; });
  if (same != stored_.end()) return std::size_t(same - stored_.begin());
  const std::string content = content_of(*shape);
  const std::uint64_t hash = digest_of(content);
  for (std::size_t k = 0; k < stored_.size(); ++k) {
    if (stored_[k].hash == hash && content_of(*stored_[k].shape) == content) return k;
  }
  Json line;
  line["hash"] = hex_digits(hash);
  const auto put_surface = [&](const char* kind, const TriangleMesh& surface) {
    line["kind"] = kind;
    line["first_vertex"] = vertex_count_;
    line["vertex_count"] = surface.vertices().size();
    line["first_triangle"] = triangle_count_;
    line["triangle_count"] = surface.triangles().size();
    for (const Vector3& v : surface.vertices()) rows.vertices.push_back({v.x(), v.y(), v.z()});
    rows.triangles.insert(rows.triangles.end(), surface.triangles().begin(),
                          surface.triangles().end());
    vertex_count_ += surface.vertices().size();
    triangle_count_ += surface.triangles().size();
  };
  visit_shape(
      *shape,
      ShapeSink{
          [&](const TriangleMesh& mesh) { put_surface("mesh", mesh); },
          [&](const ConvexHull& hull) {
            put_surface("hull", *hull.core_surface());
            if (hull.rounding_radius() > 0) line["radius"] = hull.rounding_radius();
          },
          [&](const CompoundShape& compound) {
            line["kind"] = "compound";
            line["children"] = Json::array();
            for (const CompoundChild& child : compound.children()) {
              const std::size_t number = add(child.shape, lines, rows);
              line["children"].push_back({{"shape", number}, {"X_CS", pose_numbers(child.X_CS)}});
            }
          },
          [&](const FormedShape& formed) { put_form(line, formed); }});
  lines += line.dump() + '\n';
  stored_.push_back({shape, hash});
  return stored_.size() - 1;
}

std::shared_ptr<const Shape> shape_from(const Json& line, const ShapeRows& rows,
                                        std::span<const std::shared_ptr<const Shape>> earlier) {
  const auto kind = line.at("kind").get<std::string>();
  if (kind == "mesh") return mesh_from(line, rows);
  if (kind == "hull") {
    return std::make_shared<ConvexHull>(vertices_of(line, rows), line.value("radius", 0.0));
  }
  if (const auto* form = geometry_internal::find_shape_form(kind)) return form_from(*form, line);
  DYOP_REQUIRE(kind == "compound", "unknown kind of shape ", kind);
  std::vector<CompoundChild> children;
  for (const Json& child : line.at("children")) {
    const auto number = child.at("shape").get<std::size_t>();
    DYOP_REQUIRE(number < earlier.size(), "a compound names the shape ", number,
                 ", which comes after it");
    children.push_back({earlier[number], pose_from_numbers(child.at("X_CS"))});
  }
  return std::make_shared<CompoundShape>(children);
}

namespace {

constexpr Scalar kNotThere = std::numeric_limits<Scalar>::quiet_NaN();

constexpr std::array<std::pair<BodyKind, std::string_view>, 3> kKinds{{
    {BodyKind::Dynamic, "dynamic"},
    {BodyKind::Kinematic, "kinematic"},
    {BodyKind::Static, "static"},
}};

FloatRow3 float_row(const Vector3& v) {
  return {static_cast<float>(v.x()), static_cast<float>(v.y()), static_cast<float>(v.z())};
}

// The value of an enumeration whose last is `last`.
template <typename Enum>
Enum value_of(std::uint32_t number, Enum last, const char* what) {
  DYOP_REQUIRE(number <= static_cast<std::uint32_t>(last), what, " ", number, " is unknown");
  return static_cast<Enum>(number);
}

BodyId body_of(std::uint32_t slot) {
  return slot == BodyId().slot ? BodyId() : BodyId(slot);
}

std::int32_t number_row(const std::optional<std::int32_t>& number) {
  return number.value_or(-1);
}

std::optional<std::int32_t> number_of(std::int32_t row) {
  if (row < 0) return std::nullopt;
  return row;
}

FeatureRow feature_row(const Feature& feature) {
  return {static_cast<std::int32_t>(feature.kind), feature.vertices[0], feature.vertices[1],
          feature.vertices[2]};
}

Feature feature_of(const FeatureRow& row) {
  const auto kind = value_of(static_cast<std::uint32_t>(row[0]), FeatureKind::Smooth, "feature");
  return {kind, {row[1], row[2], row[3]}};
}

WitnessRow witness_row(const WitnessPair& witness) {
  return {witness.lower,
          witness.upper,
          row_of(witness.p_WCa),
          row_of(witness.p_WCb),
          row_of(witness.nhat_AB_W),
          number_row(witness.triangle_a),
          number_row(witness.triangle_b),
          number_row(witness.child_a),
          number_row(witness.child_b),
          feature_row(witness.feature_a),
          feature_row(witness.feature_b)};
}

void read_witness(const WitnessRow& row, WitnessPair& witness) {
  witness.lower = row.lower;
  witness.upper = row.upper;
  witness.p_WCa = vector_of(row.p_a);
  witness.p_WCb = vector_of(row.p_b);
  witness.nhat_AB_W = vector_of(row.normal);
  witness.triangle_a = number_of(row.triangle_a);
  witness.triangle_b = number_of(row.triangle_b);
  witness.child_a = number_of(row.child_a);
  witness.child_b = number_of(row.child_b);
  witness.feature_a = feature_of(row.feature_a);
  witness.feature_b = feature_of(row.feature_b);
}

}  // namespace

std::string_view name_of_kind(BodyKind kind) {
  for (const auto& [value, name] : kKinds) {
    if (value == kind) return name;
  }
  return "dynamic";
}

BodyKind kind_of_name(std::string_view name) {
  for (const auto& [value, known] : kKinds) {
    if (known == name) return value;
  }
  throw InvalidArgument(compose_message("unknown kind of body '", name, "'"));
}

bool is_undecided(AdvanceStatus status) {
  switch (status) {
    case AdvanceStatus::NotRun:
    case AdvanceStatus::Completed:
    case AdvanceStatus::StoppedAtImpact:
      return false;
    case AdvanceStatus::BudgetExhausted:
    case AdvanceStatus::NumericalLimit:
    case AdvanceStatus::Blocked:
    case AdvanceStatus::Cancelled:
      return true;
  }
  return true;
}

ImpactRow impact_row(const ImpactEvent& impact) {
  ImpactRow row{};
  row.t = impact.t;
  row.t_safe = impact.toi.t_safe;
  row.t_hit = impact.toi.t_hit.value_or(kNotThere);
  row.rounding_allowance = impact.toi.rounding_allowance;
  row.closing_speed = kNotThere;
  row.node_pairs = impact.toi.statistics.node_pairs;
  row.a = impact.a.slot;
  row.b = impact.b.slot;
  row.status = static_cast<std::uint32_t>(impact.toi.status);
  row.has_witness = impact.toi.contact.has_value();
  row.witness = witness_row(impact.toi.contact.value_or(ImpactContact{}));
  if (impact.toi.contact) row.closing_speed = impact.toi.contact->closing_speed;
  return row;
}

ImpactEvent impact_from(const ImpactRow& row, std::span<const ContactRow> contacts) {
  ImpactEvent impact;
  impact.t = row.t;
  impact.a = body_of(row.a);
  impact.b = body_of(row.b);
  impact.toi.status = value_of(row.status, ToiStatus::NumericalLimit, "status of an impact");
  impact.toi.t_safe = row.t_safe;
  if (!std::isnan(row.t_hit)) impact.toi.t_hit = row.t_hit;
  impact.toi.rounding_allowance = row.rounding_allowance;
  impact.toi.statistics.node_pairs = row.node_pairs;
  if (row.has_witness != 0) {
    read_witness(row.witness, impact.toi.contact.emplace());
    impact.toi.contact->closing_speed = row.closing_speed;
  }
  for (const ContactRow& contact : contacts) {
    WorldContact& world_contact = impact.contacts.emplace_back();
    world_contact.a = body_of(contact.a);
    world_contact.b = body_of(contact.b);
    world_contact.normal_velocity = contact.normal_velocity;
    world_contact.impulse_W = vector_of(contact.impulse);
    read_witness(contact.witness, world_contact.contact);
  }
  return impact;
}

ContactRow contact_row(const WorldContact& contact) {
  return {contact.a.slot, contact.b.slot, contact.normal_velocity, row_of(contact.impulse_W),
          witness_row(contact.contact)};
}

PairRow pair_row(const PairRecord& record) {
  PairRow row{};
  row.a = record.a.slot;
  row.b = record.b.slot;
  row.proof = static_cast<std::uint32_t>(record.proof);
  row.gap_lower = record.gap_lower;
  row.gap_upper = record.gap_upper;
  row.pivot = row_of(record.pivot_W);
  row.normal = row_of(record.nhat_AB_W);
  row.residual = record.residual;
  row.advancement_steps = record.advancement_steps;
  return row;
}

PairRecord pair_from(const PairRow& row, std::span<const PairContactRow> contacts) {
  PairRecord record;
  record.a = body_of(row.a);
  record.b = body_of(row.b);
  record.proof = value_of(row.proof, ProofKind::Excused, "proof of a pair");
  record.gap_lower = row.gap_lower;
  record.gap_upper = row.gap_upper;
  record.pivot_W = vector_of(row.pivot);
  record.nhat_AB_W = vector_of(row.normal);
  record.residual = row.residual;
  record.advancement_steps = row.advancement_steps;
  for (const PairContactRow& contact : contacts) {
    PairContact& pair_contact = record.contacts.emplace_back();
    pair_contact.point.p_WCa = record.pivot_W + vector_of(contact.from_pivot_a);
    pair_contact.point.p_WCb = record.pivot_W + vector_of(contact.from_pivot_b);
    pair_contact.point.nhat_AB_W = vector_of(contact.normal);
    pair_contact.point.gap = contact.gap;
    pair_contact.point.lower = contact.lower;
    pair_contact.point.upper = contact.upper;
    pair_contact.impulse_W = vector_of(contact.impulse);
  }
  return record;
}

PairContactRow pair_contact_row(const PairContact& contact, const Vector3& pivot_W) {
  const ContactPoint& point = contact.point;
  return {float_row(point.p_WCa - pivot_W),
          float_row(point.p_WCb - pivot_W),
          float_row(point.nhat_AB_W),
          float_row(contact.impulse_W),
          point.gap,
          point.lower,
          point.upper};
}

EventRow event_row(const RunEvent& event) {
  return {event.t, static_cast<std::uint32_t>(event.kind), event.a.slot, event.b.slot, 0};
}

RunEvent event_from(const EventRow& row) {
  return {value_of(row.kind, RunEventKind::Placed, "kind of event"), row.t, body_of(row.a),
          body_of(row.b)};
}

void put_report(const AdvanceReport& report, FrameRow& row) {
  row.end = report.t;
  row.status = static_cast<std::uint32_t>(report.status);
  row.a = report.offending_pair.first.slot;
  row.b = report.offending_pair.second.slot;
  const StepStatistics& work = report.work;
  row.steps = work.steps;
  row.substeps = work.substeps;
  row.islands = work.islands;
  row.rounds = work.rounds;
  row.stalls = work.stalls;
  row.contacts = work.contacts;
  row.unconverged = work.unconverged;
  row.residual = work.residual;
  row.shortest_gap = work.shortest_gap;
  row.pairs_by_bound = work.pairs_by_bound;
  row.pairs_by_query = work.pairs_by_query;
  row.pairs_at_rest = work.pairs_at_rest;
  row.pairs_excused = work.pairs_excused;
  row.integrator_steps = report.integrator.steps;
  row.rejected_steps = report.integrator.rejected_steps;
  row.function_evaluations = report.integrator.function_evaluations;
  row.box_tests = report.toi.box_tests;
  row.leaf_tests = report.toi.leaf_tests;
  row.node_pairs = report.toi.node_pairs;
  row.peak_queue = report.toi.peak_queue;
}

RecordedFrame frame_from(const FrameRow& row) {
  RecordedFrame frame;
  frame.interval = {row.begin, row.end};
  frame.status = value_of(row.status, AdvanceStatus::Cancelled, "status of a frame");
  frame.offending_pair = {body_of(row.a), body_of(row.b)};
  frame.kinetic_energy = row.kinetic_energy;
  frame.momentum = vector_of(row.momentum);
  frame.angular_momentum = vector_of(row.angular_momentum);
  frame.work = {row.steps,        row.substeps,       row.islands,        row.rounds,
                row.stalls,       row.contacts,       row.unconverged,    row.residual,
                row.shortest_gap, row.pairs_by_bound, row.pairs_by_query, row.pairs_at_rest,
                row.pairs_excused};
  frame.integrator = {row.integrator_steps, row.rejected_steps, row.function_evaluations};
  frame.toi = {row.box_tests, row.leaf_tests, row.node_pairs, row.peak_queue};
  return frame;
}

}  // namespace dyop::io_internal
