// SPDX-License-Identifier: BSD-3-Clause
#include "io/record/recording_rows.h"

#include <cstddef>
#include <type_traits>

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

}  // namespace dyop::io_internal
