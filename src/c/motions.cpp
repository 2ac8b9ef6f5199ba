// SPDX-License-Identifier: BSD-3-Clause
#include "c/context.h"
#include "c/convert.h"
#include "dyop/motion/interpolated_motion.h"
#include "dyop/motion/motion.h"
#include "dyop/motion/sampled_motion.h"
#include "dyop/motion/steady_motions.h"

namespace {

using namespace dyop;  // NOLINT: nothing here is public
using dyop::c::guard;
using dyop::c::pose_from;
using dyop::c::require_given;

MotionState state_of(const dyop_motion_functions& functions, Scalar t) {
  dyop_state state{DYOP_POSE_IDENTITY, {}};
  functions.state(functions.user, t, &state);
  return dyop::c::state_from(state);
}

UserMotion::Functions functions_from(const dyop_motion_functions& given) {
  DYOP_REQUIRE(given.state && given.twist_bound,
               "a motion needs the functions state and twist_bound");
  UserMotion::Functions functions;
  functions.pose = [given](Scalar t) { return state_of(given, t).X_WB; };
  functions.twist = [given](Scalar t) { return state_of(given, t).twist; };
  functions.twist_bound = [given](const TimeInterval& interval) {
    dyop_twist_bound bound{kInfinity, kInfinity, kInfinity, kInfinity};
    given.twist_bound(given.user, {interval.begin, interval.end}, &bound);
    return TwistBound{bound.linear_speed, bound.angular_speed, bound.linear_acceleration,
                      bound.angular_acceleration};
  };
  return functions;
}

}  // namespace

dyop_status dyop_rest_create(dyop_context* context, const dyop_pose* pose, dyop_motion* motion) {
  return guard(context, [&] {
    context->add<RestMotion>(context->motions, motion, pose_from(*require_given(pose, "pose")));
  });
}

dyop_status dyop_constant_twist_create(dyop_context* context, const dyop_state* state, double time,
                                       dyop_motion* motion) {
  return guard(context, [&] {
    const MotionState start = dyop::c::state_from(*require_given(state, "state"));
    context->add<ConstantTwistMotion>(context->motions, motion, start.X_WB, start.twist, time);
  });
}

dyop_status dyop_interpolated_create(dyop_context* context, dyop_interval interval,
                                     const dyop_pose* from, const dyop_pose* to,
                                     dyop_motion* motion) {
  return guard(context, [&] {
    context->add<InterpolatedMotion>(context->motions, motion, dyop::c::interval_from(interval),
                                     pose_from(*require_given(from, "from")),
                                     pose_from(*require_given(to, "to")));
  });
}

dyop_status dyop_sampled_create(dyop_context* context, const double* times, const dyop_pose* poses,
                                size_t count, dyop_motion* motion) {
  return guard(context, [&] {
    DYOP_REQUIRE(count == 0 || (times && poses), "times and poses must not be null");
    std::vector<SampledMotion::Sample> samples;
    for (std::size_t i = 0; i < count; ++i) samples.push_back({times[i], pose_from(poses[i])});
    context->add<SampledMotion>(context->motions, motion, std::move(samples));
  });
}

dyop_status dyop_user_motion_create(dyop_context* context, const dyop_motion_functions* functions,
                                    dyop_motion* motion) {
  return guard(context, [&] {
    const auto given = dyop::c::read_struct<dyop_motion_functions>(
        require_given(functions, "functions"), DYOP_MOTION_FUNCTIONS_INIT, "dyop_motion_functions");
    context->add<UserMotion>(context->motions, motion, functions_from(given),
                             dyop::c::interval_from(given.domain));
  });
}

dyop_status dyop_motion_state(dyop_context* context, dyop_motion motion, double t,
                              dyop_state* state) {
  return guard(context, [&] {
    const auto object = context->motion(motion);
    require_defined(*object, {t, t}, "the motion");
    *require_given(state, "state") = dyop::c::to_c(object->state(t));
  });
}

dyop_status dyop_motion_destroy(dyop_context* context, dyop_motion motion) {
  return guard(context, [&] { context->remove(context->motions, motion, "the motion"); });
}
