#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# Seeds deliberate mistakes into a copy of the sources, one at a time, and demands that a test fails
# for each. Not part of the suite: it builds the tests of some rooms, and parts of them again for
# every mistake.
# Usage: bash tests/mutation_check.sh [NAME...]      default: all mistakes below
# Prints which test caught each; exit code 1 if one survived or can no longer be seeded.
set -euo pipefail
cd "$(dirname "$0")/.."
source_dir=$PWD
work=$source_dir/build/mutation

# mistake NAME FILE ROOM FILTER OLD NEW: OLD, which occurs once in FILE, becomes NEW; then the tests
# of ROOM that match FILTER are run.
names=()
declare -A file room filter old new
mistake() {
  names+=("$1")
  file[$1]=$2 room[$1]=$3 filter[$1]=$4 old[$1]=$5 new[$1]=$6
}

mistake reference_time_forgotten src/motion/steady_motions.cpp motion 'PoseScale*' \
  $'longest_time(t0_, interval);\n  using motion_internal::times;\n  return {motion_internal::norm_of(X_WB0_' \
  $'longest_time(0, interval);\n  using motion_internal::times;\n  return {motion_internal::norm_of(X_WB0_'
mistake jumps_of_parts_forgotten src/motion/composed_motion.cpp motion 'PoseScale*' \
  '(after.length - before.length)' '0'
mistake coriolis_term_dropped src/motion/composed_motion.cpp motion '*Contract*' \
  '2 * outer.angular_speed * inner.linear_speed + ' ''
mistake turning_speed_not_bounded src/motion/curve/chart_curve.cpp motion '*Contract*' \
  'largest_norm({theta_rate.data(), degree_}) + theta_.rate_noise' \
  '0.999 * largest_norm({theta_rate.data(), degree_})'
mistake jump_of_the_twist_forgotten src/motion/sampled_motion.cpp motion '*' \
  'last == first ? 0 : kInfinity' '0'
mistake window_begins_on_its_chord src/motion/curve/chord_tree.cpp motion 'MotionStretch*' \
  '2 * round_up(window.linear_deviation' 'round_up(window.linear_deviation'
mistake turns_between_knots_forgotten src/motion/curve/chord_tree.cpp motion 'MotionStretch*' \
  '(turned + turns + way) / 2' '(turned + turns + 0 * way) / 2'
mistake bow_of_a_piece_forgotten src/motion/curve/chord_tree.cpp motion 'MotionStretch*' \
  '+ piece.bow' ''
mistake arm_of_a_stretch_forgotten src/motion/composed_motion.cpp motion 'MotionStretch*' \
  'outer->linear_deviation + outer->angular_deviation * arm' 'outer->linear_deviation'
mistake stretch_without_its_deviation src/toi/rigid/moving_pair.cpp toi 'PoseLogImpact*' \
  'instant.noise += follow(' 'instant.noise += 0 * follow('
mistake straying_joints_forgotten src/chain/link_motion.cpp chain '*Stretch*' \
  'strays * (turn.reach + slack)' '0'
mistake turns_of_followers_forgotten src/chain/link_pairs.cpp chain 'LinkPairs*' \
  'if (all_are_back) return turns;' 'if (all_are_back) return 1;'
mistake ray_step_not_supported src/distance/ray_cast.cpp distance 'RayCast*' \
  'const Scalar step = free / rate * (1 - 4 * kUnitRoundoff);' 'const Scalar step = 1.01 * free / rate;'
mistake ray_boxes_not_widened src/distance/ray_cast.cpp distance 'RayCast*' \
  'slack[k] = kPointBoxNoise * size + reach;' 'slack[k] = kPointBoxNoise * size;'
mistake corner_not_seen src/distance/distance_derivatives.cpp distance 'DistanceDerivatives*' \
  'const Scalar error = std::max(derivative - right, left - derivative) / reach;' \
  'const Scalar error = std::min(derivative - right, left - derivative) / reach / 1e3;'
mistake free_turn_of_second_order src/dynamics/step/free_turns.cpp dynamics 'MeanFreeVelocity*' \
  'tau / 6 * (2 * w_2' 'tau / 6 * (3 * w_2'
mistake free_turns_not_corrected src/dynamics/step/free_turns.cpp dynamics 'ThinBodies*' \
  '* L_W[i] + corrections_W_[i]' '* L_W[i]'
mistake sliding_not_linearised src/contact/solver/interior_point_solver.cpp contact 'InteriorPointSolver*' \
  'rightCols<2>() += by_shift' 'rightCols<2>() += 0 * by_shift'
mistake best_impulses_not_polished src/contact/solver/interior_point_solver.cpp contact 'InteriorPointSolver*' \
  'if (has_shift_ && best_residual_ > options.tolerance) polish' 'if (false) polish'
mistake locked_turn_of_third_order src/dynamics/step/free_turns.cpp dynamics 'ThinBodies*' \
  '3 * k_4 + 2 * (k_2 + k_3) - k_1' '6 * k_3 + 0 * k_4 + k_1 * 0'
mistake energy_from_joints_not_noticed src/dynamics/step/free_turns.cpp dynamics 'ThinBodies*' \
  '? kMostJointGain :' '? 1e3 :'
mistake arms_of_the_middle src/dynamics/step/link_rows.cpp dynamics 'SpinningTop*' \
  'set_mean(start.X_WJb, end.X_WJb, middle.X_WJb);' ''
mistake turns_solved_too_coarsely src/dynamics/step/substep.cpp dynamics 'SpinningTop*' \
  'kMostJointSolves = 32' 'kMostJointSolves = 4'
mistake inexact_turn_accepted src/dynamics/step/free_turns.cpp dynamics 'SpinningTop*' \
  'kMostJointedEnergyChange = 1e-6' 'kMostJointedEnergyChange = 1e-1'
mistake bounced_corner_is_pushed src/dynamics/step/substep.cpp dynamics 'ThinBodies*' \
  'is_pushed ? speed : -std::abs(speed)' 'is_pushed ? speed : speed'
mistake hit_carried_without_its_turn src/dynamics/step/end_gap.cpp dynamics 'ThinBodies*:HitContacts*' \
  'rotation_from_vector(about_normal_W)' 'rotation_from_vector(0 * about_normal_W)'
mistake friction_taken_at_the_end src/dynamics/step/substep.cpp dynamics 'WorldDriving*' \
  'node.fix_friction(i, unforced' '(void)(unforced'
mistake hull_vertex_lost src/geometry/hull/quickhull.cpp geometry '*Hull*' \
  'if (p != apex) assign(p, cone_);' 'if (p > apex) assign(p, cone_);'
mistake leaf_range_one_short src/hierarchy/mesh_hierarchy.cpp hierarchy '*' \
  'first[end[std::size_t(child)]] - begin' 'first[end[std::size_t(child)]] - begin - 1'
mistake one_box_not_fitted src/hierarchy/mesh_hierarchy.cpp hierarchy '*' \
  'tbb::blocked_range<std::size_t>(1, ' 'tbb::blocked_range<std::size_t>(2, '
mistake refit_forgets_a_box src/hierarchy/mesh_hierarchy.cpp hierarchy '*' \
  'result.fit_boxes(vertices, triangles);' \
  'result.fit_boxes(vertices, triangles); result.nodes_.back() = nodes_.back();'
mistake stored_box_not_rounded_up src/hierarchy/mesh_hierarchy.cpp hierarchy '*' \
  'float_above(half_extents[i] + noise)' 'float_above(half_extents[i] - noise)'
mistake lower_bound_rounded_up src/distance/triangle/triangle_pair.h distance 'TriangleDistance*' \
  'middle + low_negated(slack)' 'middle + slack'
mistake height_rounded_up src/distance/core_distance.cpp distance 'HalfSpace*' \
  'result.lower = std::max(Scalar(0), height - noise);' 'result.lower = std::max(Scalar(0), height + noise);'
mistake slab_too_thin src/distance/near_features.cpp distance 'FindContacts*' \
  'const Scalar thickness = reach + 4 * noise;' 'const Scalar thickness = reach / 2;'
mistake planes_without_the_reach src/distance/near_features.cpp distance 'FindContacts*' \
  '(reach + slack) * length' 'slack * length'
mistake edges_need_both_ends src/distance/near_features.cpp distance 'FindContacts*' \
  '!is_near_[from] && !is_near_[to]' '!is_near_[from] || !is_near_[to]'
mistake faces_without_the_reach src/distance/near_boxes.cpp contact 'BoxContacts*' \
  'const Scalar reach_sq = reach_ * reach_;' 'const Scalar reach_sq = reach_ * reach_ / 4;'
mistake triangles_of_a_face_swapped src/distance/near_boxes.cpp contact 'BoxContacts*' \
  'pair[across > 0 ? 1 : 0]' 'pair[across > 0 ? 0 : 1]'
mistake edges_without_the_reach src/distance/near_boxes.cpp contact 'BoxContacts*' \
  '1.04 * reach_ * sine' '0.5 * reach_ * sine'
mistake edges_without_a_margin src/distance/near_boxes.cpp contact 'BoxContacts*' \
  '4 * search.noise * (1 + size / shortest)' '0 * (size / shortest)'
mistake cone_without_the_sine src/distance/near_boxes.cpp contact 'BoxContacts*' \
  'sine * (search_.sine + kSlack) + unsure' 'unsure'
mistake cone_admits_too_much src/distance/near_boxes.cpp contact 'BoxContacts*' \
  'sine * (search_.sine - kSlack) - unsure' '2 * sine * search_.sine'
mistake lean_edges_forgotten src/distance/near_boxes.cpp contact 'BoxContacts*' \
  'foremost + more < least' 'foremost + more / 1e6 < least'
mistake score_that_overflows src/distance/triangle/triangle_pair.h distance 'TriangleDistanceBatch*' \
  'LanePair(kSmallestFacetSquare)' 'LanePair(kSmallestSquaredDirection)'
mistake witness_outside_its_face src/paper/lin_canny.cpp paper '*LinCanny*' \
  'return Vector3((r - (u / normal_sq) * along) - (v / normal_sq) * across);' \
  'return Vector3(normal * (normal.dot(r) / normal_sq));'
mistake normal_swapped src/distance/piece_distance.cpp toi 'TimeOfImpact.*' \
  'pair.nhat_AB_W = X_WA.rotation() * piece.nhat_AB' \
  'pair.nhat_AB_W = -(X_WA.rotation() * piece.nhat_AB)'
mistake steps_too_long src/toi/impact_band.h toi 'TimeOfImpact.*' \
  'kLeafTargetFraction * distance_tolerance' '0.2 * distance_tolerance'
mistake edges_in_front_collide src/toi/best_first_search.cpp toi '*InitialState*' \
  'return !(nearer.best.middle() < piece.middle())' 'return true'
mistake edges_of_a_sheet_collide src/toi/deforming/deforming_pair.cpp toi 'DeformingContacts.*' \
  'closing * now_.remaining > loss' 'true'
mistake pairs_at_the_start_skipped src/toi/best_first_search.cpp toi '*AtTheStart*' \
  'pair_.time() > interval_.begin) return true;' 'pair_.time() >= interval_.begin) return true;'
mistake resumed_from_another_pose src/toi/best_first_search.cpp toi '*Workspace*' \
  'pair_.set_time(memory_.standing_time);' ''
mistake sign_in_the_coupled_bound src/toi/rigid/safe_step.h toi 'SafeStep*:*TimeOfImpact.*' \
  'const Vector3 k_W = relative_W.cross(n_W)' 'const Vector3 k_W = n_W.cross(relative_W)'
mistake acceleration_dropped src/toi/rigid/safe_step.h toi 'SafeStep*' \
  'rest.acceleration * (h * h / 2)' '0 * rest.acceleration'
mistake turn_of_the_normal_dropped src/toi/rigid/safe_step.h toi 'SafeStep*' \
  ' + 2 * rate_W.dot(v_AB_W)' ''
mistake third_order_of_the_origins_dropped src/toi/rigid/safe_step.h toi 'SafeStep*' \
  'turn * p_AB_W.norm() + 3 * v_AB_W.norm()' '3 * v_AB_W.norm()'
mistake third_order_of_a_fixed_normal src/toi/rigid/safe_step.h toi 'SafeStep*' \
  'third = turn_norm > 0 ? relative_W.norm() * rate * rate : w_norm * w_norm * k_W.norm()' \
  'third = w_norm * w_norm * k_W.norm()'
mistake third_order_term_dropped src/toi/rigid/box_steps_simd.h toi 'BoxSteps*:TurningBoxes*' \
  'bounds.jerk * (h_sq * h * L(1.0 / 6 + 0x1p-54))' 'bounds.jerk * L(0.0)'
mistake half_diagonal_without_root_three src/toi/rigid/box_steps_simd.h toi 'BoxSteps*:TurningBoxes*' \
  'radius = (sqrt(dot(box.center, box.center)) + sqrt(dot(box.half_extents, box.half_extents)))' \
  'radius = (sqrt(dot(box.center, box.center)) + box.half_extents[0])'
mistake nan_taken_for_safe src/toi/rigid/safe_step.cpp toi '*' \
  'if (!std::isfinite(discriminant)) return 0;' 'if (!std::isfinite(discriminant)) return kInfinity;'
mistake rounding_radius_forgotten src/toi/rigid/safe_step.h toi '*' \
  'return shape.core_reach(w) + (radius > 0 ? radius * w.norm() : 0);' \
  'return shape.core_reach(w) + 0 * radius;'
mistake swept_box_of_the_start_only src/toi/deforming/deforming_mesh.cpp toi 'Deforming*' \
  'node->at_end.extend(to);' 'node->at_end.extend(from);'
mistake boxes_of_tissue_do_not_grow src/check/trusted/shape.cpp check '*' \
  ', last.half() - node.half};' ', {}};'
mistake boxes_of_tissue_do_not_move src/check/trusted/shape.cpp check '*' \
  '{last.center() - node.center, ' '{{}, '
mistake corners_of_tissue_stay src/check/trusted/shape.cpp check '*' \
  'return from[corner] + part * moves[corner];' 'return from[corner] + 0 * part * moves[corner];'
mistake box_at_the_end_forgotten src/check/trusted/shape.cpp check '*' \
  'last.add(child_last);' 'last.add(child_first);'
mistake tissue_seen_from_a_turning_tool src/check/trusted/kernel.cpp check '*' \
  ' || O.body->deforms() || F.body->deforms()' ''
mistake sag_of_a_fixed_direction_dropped src/check/trusted/kernel.cpp check '*' \
  $'h * h / 8 * sum};\n}\n\n// With n' $'0 * h * sum};\n}\n\n// With n'
mistake hinge_does_not_turn src/check/trusted/haptic_prover.cpp check '*' \
  'R * Vec{0, 0, change}' 'R * Vec{0, 0, 0 * change}'
mistake tool_does_not_turn src/check/trusted/haptic_prover.cpp check '*' \
  'twist(X.R, X.p, way, turn, 0)' 'twist(X.R, X.p, way, 0.0 * turn, 0)'
mistake tissue_does_not_move src/check/trusted/haptic_prover.cpp check '*' \
  'part_rate = to.fraction - surface.at.fraction;' 'part_rate = 0;'
mistake proof_kept_for_another_mesh src/check/trusted/haptic_prover.cpp check '*' \
  'pairs_[{part, obstacle}] = {};' '(void)part;'
mistake any_tick_is_excused src/check/trusted/haptic_prover.cpp check '*' \
  'if (question.excuse != Excuse::None) {' 'if (true) {'
mistake place_after_missing_ticks_taken_for_known src/check/trusted/haptic_prover.cpp check '*' \
  'if (!a.is_known || !b.is_known)' 'if (!b.is_known)'
mistake any_turn_of_tissue_believed src/check/trusted/haptic_recording.cpp check '*' \
  'return !tells_turns_ || part ==' 'return !tells_turns_ || true || part =='
mistake missing_ticks_not_noticed src/check/trusted/haptic_prover.cpp check '*' \
  'recording_.is_whole(last_.tick, next.tick)' 'true'
mistake ends_of_ticks_not_compared src/check/trusted/haptic_recording.cpp check '*' \
  'throw BadFile("tick " + std::to_string(numbers[k]) + " ends elsewhere than its motions");' 'continue;'
mistake any_recovery_allowed src/check/laws/laws.cpp check '*' \
  'return kLevers * gaps + joints;' 'return kInfinity;'
mistake approach_goes_backwards src/contact/generation/contact_search.cpp contact '*ForAnApproach' \
  'approach_A.v_W = X_AW' 'approach_A.v_W = -1 * X_AW'
mistake turn_of_an_approach_forgotten src/toi/deforming/expected_approach.h toi 'ExpectedApproach*' \
  '+ n_W.cross(w_W).norm() * radius' '+ 0 * radius'
mistake recovery_needed_by_none src/check/laws/laws.cpp check '*' \
  'return kLevers * gaps + joints;' 'return kLevers * gaps;'
mistake mesh_within_a_tick_not_measured src/haptics/proxy.cpp haptics 'ToolCut*' \
  $'forget(k);\n      proofs_.measure_new(course_.pose, tick.work);' 'forget(k);'
mistake broken_joint_forgotten src/io/record/recording_writer.cpp check '*' \
  'found->second > from' 'found->second < from'

if [ $# -gt 0 ]; then names=("$@"); fi

# Those tests of a room; what failed is in the log.
run_tests() {
  local room=$1 filter=$2
  cmake --build "$work/build" --target "dyop_${room}_test" >"$work/build.log" 2>&1 || return 2
  "$work/build/tests/$room/dyop_${room}_test" --gtest_filter="$filter" --gtest_brief=1 \
    >"$work/test.log" 2>&1
}

# Replaces the one occurrence of the old text.
seed() {
  local path=$work/tree/${file[$1]} text rest
  text=$(cat "$path" && printf x)
  text=${text%x}
  rest=${text/"${old[$1]}"/}
  if [ "$rest" = "$text" ] || [[ $rest == *"${old[$1]}"* ]]; then
    echo "mutation_check.sh: $1: not exactly once in ${file[$1]}: ${old[$1]}" >&2
    return 1
  fi
  echo "${file[$1]}" >"$work/seeded"
  printf '%s' "${text/"${old[$1]}"/"${new[$1]}"}" >"$path"
}

# Takes the mistake out again; the new time stamp has it rebuilt.
restore() {
  cp "$source_dir/$1" "$work/tree/$1"
  rm "$work/seeded"
}

# Only what differs, so that time stamps tell what has to be built again.
mkdir -p "$work/tree"
find CMakeLists.txt CMakePresets.json include src tests -type f | while read -r path; do
  if cmp -s "$path" "$work/tree/$path"; then continue; fi
  mkdir -p "$work/tree/$(dirname "$path")"
  cp "$path" "$work/tree/$path"
done
if [ -f "$work/seeded" ]; then restore "$(cat "$work/seeded")"; fi  # of an interrupted run
cmake -S "$work/tree" -B "$work/build" -G Ninja -DCMAKE_BUILD_TYPE=Release \
  -DCMAKE_CXX_FLAGS_RELEASE=-O1 -DDYOP_BUILD_EXAMPLES=OFF -DDYOP_BUILD_CLI=OFF -DDYOP_BUILD_C=OFF \
  -DDYOP_BUILD_PYTHON=OFF -DDYOP_BUILD_OMPL=OFF >/dev/null

# A test that fails anyway catches nothing.
for name in "${names[@]}"; do echo "${room[$name]:-}"; done | sort -u | while read -r r; do
  if [ -z "$r" ]; then continue; fi
  if ! run_tests "$r" '*'; then
    echo "mutation_check.sh: tests of $r fail without a mistake, see $work/*.log" >&2
    exit 1
  fi
done

faults=0
row='| %s | %s | %s |\n'
printf "$row" mistake 'caught by' 'failed tests'
printf '|---|---|---|\n'
for name in "${names[@]}"; do
  if [ -z "${file[$name]:-}" ]; then
    echo "mutation_check.sh: unknown mistake '$name'" >&2
    exit 2
  fi
  if ! seed "$name"; then
    printf "$row" "$name" 'CANNOT BE SEEDED' ''
    faults=$((faults + 1))
    continue
  fi
  code=0
  run_tests "${room[$name]}" "${filter[$name]}" || code=$?
  restore "${file[$name]}"
  if [ $code -eq 2 ]; then
    tail -5 "$work/build.log" >&2
    printf "$row" "$name" 'DOES NOT BUILD' ''
    faults=$((faults + 1))
  elif [ $code -eq 0 ]; then
    printf "$row" "$name" SURVIVED 0
    faults=$((faults + 1))
  else
    failed=$(grep -E '^\[ *FAILED *\] [A-Za-z/]+\.' "$work/test.log" | sed -E 's/^\[ *FAILED *\] //; s/[ ,].*//' | sort -u)
    printf "$row" "$name" "$(head -1 <<<"${failed:-a crash}")" "$(grep -c . <<<"$failed")"
  fi
done
[ $faults -eq 0 ]
