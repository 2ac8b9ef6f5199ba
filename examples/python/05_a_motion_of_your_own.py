# SPDX-License-Identifier: BSD-3-Clause
"""5. A motion written in Python: a pendulum on a small arc, with the bounds that proofs rest on."""

import math

import dyop

length, swing, rate = 2.0, 0.3, 3.0


def angle(t: float) -> float:
    return swing * math.sin(rate * t)


def pose(t: float) -> dyop.RigidPose:
    a = angle(t)
    position = (length * math.sin(a), 0, -length * math.cos(a))
    return dyop.RigidPose(quaternion=(math.cos(a / 2), 0, -math.sin(a / 2), 0), position=position)


def twist(t: float) -> dyop.Twist:
    a, speed = angle(t), swing * rate * math.cos(rate * t)
    velocity = (length * speed * math.cos(a), 0, length * speed * math.sin(a))
    return dyop.Twist(v_WB=velocity, w_WB=(0, -speed, 0))


def twist_bound(interval: dyop.TimeInterval) -> dyop.TwistBound:
    w, alpha = swing * rate, swing * rate**2
    return dyop.TwistBound(
        linear_speed=length * w,
        angular_speed=w,
        linear_acceleration=length * (alpha + w * w),
        angular_acceleration=alpha,
    )


pendulum = dyop.UserMotion(pose, twist, twist_bound)
print("sound:", dyop.check_motion(pendulum, (0, 2)).fault is None)

# The bob, a ball of radius 0.2, meets a wall whose near side is at x = 0.7.
wall, bob = dyop.Box([0.1, 2, 2]), dyop.Sphere(0.2)
result = dyop.time_of_impact(
    bob, pendulum, wall, dyop.RestMotion(((1, 0, 0, 0), (0.8, 0, -2))), (0, 2)
)
exact = math.asin(math.asin(0.5 / length) / swing) / rate
print(f"{result.status.name} at t = {result.t_safe:.5f}, exact {exact:.5f}")
# Prints:
# sound: True
# Impact at t = 0.33383, exact 0.33383
