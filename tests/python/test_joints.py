# SPDX-License-Identifier: BSD-3-Clause
"""What joints measure, drive, couple and bear, against closed forms."""

import copy
import math
import pickle

import numpy as np
import pytest

import dyop
from conftest import fields_equal

G = 9.81
H = 0.01


def bench(**options):
    """A World that steps by H, and a body that stands still in it."""
    world = dyop.World(dyop.WorldOptions(max_step=H, **options))
    return world, world.add_body(
        name="ground", kind=dyop.BodyKind.Static, shape=dyop.Sphere(0.05)
    )


def box(world, half, p, name="box", **more):
    shape = dyop.Box(half)
    return world.add_body(
        name=name, shape=shape, initial=(((1, 0, 0, 0), p), ((0, 0, 0), (0, 0, 0))),
        mass_properties=shape.compute_mass_properties(1000), **more,
    )


def mass_of(world, body):
    return world.body(body).mass_properties.mass


def inertia_of(world, body):
    """About z, through the centre."""
    return world.body(body).mass_properties.I_BBcm[2, 2]


def on_axle(world, ground, p=(0, 0, 0), half=(0.3, 0.2, 0.1), **more):
    """A plank on a hinge about z through its middle, and the hinge."""
    body = box(world, half, p, name="plank")
    joint = world.add_joint(
        name="axle", kind=dyop.JointKind.Hinge, a=ground, b=body, X_AJ=((1, 0, 0, 0), p), **more
    )
    return body, joint


def run(world, time):
    for _ in range(round(time / H)):
        report = world.advance(H)
        assert report.status == dyop.AdvanceStatus.Completed
        assert report.work.stalls == report.work.unconverged == 0


def test_a_hinge_counts_the_turns_that_a_torque_drives():
    world, ground = bench()
    body, hinge = on_axle(world, ground)
    torque = 20 * inertia_of(world, body)
    world.set_wrench(body, lambda t, state: ((0, 0, 0), (0, 0, torque)))
    run(world, 1)
    values = world.joint_values(hinge)
    assert values.angle == pytest.approx(10, abs=1e-3)  # more than a turn
    assert values.angle_rate == pytest.approx(20, abs=1e-3)
    assert values.separation < 1e-6


@pytest.mark.parametrize("decay", [0.0, 0.3, 3.0])
def test_a_position_motor_swings_and_settles_as_its_gains_say(decay):
    frequency, goal = 1.5, 7.0  # beyond a turn
    world, ground = bench()
    body, hinge = on_axle(world, ground)
    inertia = inertia_of(world, body)
    motor = dyop.JointMotor(
        position=goal, stiffness=inertia * frequency**2, damping=2 * decay * inertia,
        strength=math.inf,
    )
    world.set_motor(hinge, motor)
    assert fields_equal(world.joint(hinge).motor, motor)
    root = np.sqrt(complex(frequency**2 - decay**2))
    for t in range(1, 5):
        run(world, 1)
        x = np.exp(-decay * t) * (np.cos(root * t) + decay / root * np.sin(root * t))
        # The phase lags by (w h)^2 / 12 of w t.
        assert world.joint_values(hinge).angle == pytest.approx(goal * (1 - x.real), abs=2e-3)
    world.set_motor(hinge, None)
    assert world.joint(hinge).motor is None


def test_a_motor_gives_no_more_than_its_strength():
    world, ground = bench()
    body, hinge = on_axle(world, ground)
    strength = 2 * inertia_of(world, body)
    world.set_motor(hinge, dyop.JointMotor(position=100, stiffness=1e3, strength=strength))
    run(world, 1)
    values = world.joint_values(hinge)
    assert values.angle == pytest.approx(1, abs=1e-3)
    assert values.drive == pytest.approx(strength, rel=1e-4)


def test_friction_holds_and_damping_slows():
    world, ground = bench()
    held, stiff = on_axle(world, ground, friction=3)
    world.set_wrench(held, lambda t, state: ((0, 0, 0), (0, 0, 2.9)))
    slowed, soft = on_axle(world, ground, p=(2, 0, 0), damping=inertia_of(world, held))
    world.set_state(slowed, (((1, 0, 0, 0), (2, 0, 0)), ((0, 0, 0), (0, 0, 5))))
    run(world, 1)
    assert world.joint_values(stiff).angle == pytest.approx(0, abs=1e-6)
    assert world.joint_values(stiff).drive == pytest.approx(-2.9, abs=1e-3)
    assert world.joint_values(soft).angle_rate == pytest.approx(5 * math.exp(-1), abs=2e-3)


def test_a_hinge_bears_the_weight():
    world, ground = bench(gravity_W=(0, 0, -G))
    body, hinge = on_axle(world, ground)
    run(world, 0.1)
    np.testing.assert_allclose(
        world.joint_values(hinge).force_W, [0, 0, mass_of(world, body) * G], atol=1e-6 * G
    )


def test_a_ball_joint_stops_at_its_cone_and_its_twist():
    world, ground = bench(gravity_W=(3, -2, -G))  # it falls over to where that points
    rod = box(world, (0.05, 0.08, 0.5), (0, 0, 0.5))
    limits = dyop.SwingTwistLimits(swing=0.6, twist_min=-0.4, twist_max=0.9)
    ball = world.add_joint(
        a=ground, b=rod, X_BJ=((1, 0, 0, 0), (0, 0, -0.5)), swing_twist=limits, damping=20
    )
    run(world, 3)
    z = world.state(rod).X_WB.rotation[:, 2]
    assert math.acos(z[2]) == pytest.approx(0.6, abs=1e-4)
    assert world.joint_values(ball).swing == pytest.approx(0.6, abs=1e-4)
    world.set_wrench(rod, lambda t, state: ((0, 0, 0), 90 * state.X_WB.rotation[:, 2]))
    run(world, 3)
    assert world.joint_values(ball).angle == pytest.approx(0.9, abs=1e-3)


def test_a_rope_is_slack_then_holds():
    world, ground = bench(gravity_W=(0, 0, -G))
    crate = box(world, (0.1, 0.2, 0.15), (0.6, 0, 0))
    rope = world.add_joint(
        kind=dyop.JointKind.Distance, a=ground, b=crate, limits=dyop.JointLimits(min=0, max=1)
    )
    taut = math.sqrt(2 * 0.8 / G)  # 0.8 down it is 1 away
    run(world, 0.9 * taut)
    assert world.joint_values(rope).position == pytest.approx(
        math.hypot(0.6, G * world.time() ** 2 / 2), abs=1e-3
    )
    longest = 0.0
    for _ in range(100):
        run(world, H)
        longest = max(longest, world.joint_values(rope).position)
    assert 0.999 < longest < 1 + 1e-4


def test_gears_turn_at_their_ratio():
    world, ground = bench()
    ratio = -2.5
    driving, first = on_axle(world, ground)
    driven, second = on_axle(world, ground, p=(2, 0, 0), half=(0.5, 0.4, 0.1))
    gear = world.add_joint(
        name="gear", kind=dyop.JointKind.Coupling, first=first, second=second, ratio=ratio
    )
    assert world.joints() == [first, second, gear]
    carried = inertia_of(world, driving) + inertia_of(world, driven) / ratio**2
    world.set_wrench(driving, lambda t, state: ((0, 0, 0), (0, 0, 10 * carried)))
    run(world, 1)
    assert world.joint_values(first).angle == pytest.approx(5, abs=1e-3)
    assert world.joint_values(second).angle == pytest.approx(-5 / ratio, abs=1e-3)
    assert world.joint_values(gear).position == pytest.approx(0, abs=1e-5)
    world.remove_joint(second)
    assert world.joints() == [first]


def test_rack_screw_and_pulley():
    # With q1 + r q2 held, and masses or inertias m1, m2: q1'' = F / (m1 + m2 / r^2).
    world, ground = bench(gravity_W=(0, 0, -G))
    rack = box(world, (0.05, 0.1, 0.4), (0.5, 0, 0))
    wheel, hinge = on_axle(world, ground, half=(0.2, 0.2, 0.1))
    slider = world.add_joint(
        kind=dyop.JointKind.Slider, a=ground, b=rack, X_AJ=((1, 0, 0, 0), (0.5, 0, 0))
    )
    world.add_joint(kind=dyop.JointKind.Coupling, first=slider, second=hinge, ratio=0.25)

    nut = box(world, (0.2, 0.3, 0.1), (4, 0, 0))
    thread = world.add_joint(
        kind=dyop.JointKind.Cylindrical, a=ground, b=nut, X_AJ=((1, 0, 0, 0), (4, 0, 0))
    )
    world.add_joint(kind=dyop.JointKind.Coupling, first=thread, second=thread, ratio=20)

    lines = []
    for x, size in ((8, 0.1), (10, 0.15)):
        crate = box(world, (0.2, 0.1, size), (x, 0, -3))
        lines.append((mass_of(world, crate), world.add_joint(
            kind=dyop.JointKind.Distance, a=ground, b=crate, X_AJ=((1, 0, 0, 0), (x, 0, 0)),
            limits=dyop.JointLimits(max=100),
        )))
    (light, left), (heavy, right) = lines
    world.add_joint(kind=dyop.JointKind.Coupling, first=left, second=right)

    run(world, 1)
    fall = G * mass_of(world, rack) / (mass_of(world, rack) + inertia_of(world, wheel) / 0.25**2)
    assert world.joint_values(slider).position == pytest.approx(-fall / 2, rel=2e-3)
    fall = G / (1 + inertia_of(world, nut) / mass_of(world, nut) * 20**2)
    assert world.joint_values(thread).position == pytest.approx(-fall / 2, rel=2e-3)
    assert world.joint_values(thread).angle == pytest.approx(fall * 20 / 2, rel=2e-3)
    fall = G * (heavy - light) / (heavy + light)
    assert world.joint_values(right).position == pytest.approx(3 + fall / 2, abs=1e-3)
    assert world.joint_values(left).position == pytest.approx(3 - fall / 2, abs=1e-3)


def test_a_universal_joint_turns_a_shaft_unevenly():
    bend = 0.6
    world, ground = bench()
    turned = dyop.RigidPose(quaternion=(math.cos(bend / 2), math.sin(bend / 2), 0, 0))
    out_pose = dyop.RigidPose(
        quaternion=turned.quaternion, position=turned.rotation @ np.array([0, 0, 0.4])
    )
    driving_body = box(world, (0.05, 0.05, 0.3), (0, 0, -0.4))
    driven_body = box(world, (0.05, 0.05, 0.3), (0, 0, 0))
    world.set_state(driven_body, (out_pose, ((0, 0, 0), (0, 0, 0))))
    driving = world.add_joint(
        kind=dyop.JointKind.Hinge, a=ground, b=driving_body, X_AJ=((1, 0, 0, 0), (0, 0, -0.4)),
        motor=dyop.JointMotor(speed=2, strength=1e4),
    )
    driven = world.add_joint(kind=dyop.JointKind.Hinge, a=ground, b=driven_body, X_AJ=out_pose)
    cross = world.add_joint(
        kind=dyop.JointKind.Universal, a=driving_body, b=driven_body,
        X_AJ=((1, 0, 0, 0), (0, 0, 0.4)), X_BJ=((1, 0, 0, 0), (0, 0, -0.4)),
    )
    assert world.joint_values(cross).angle == pytest.approx(bend, abs=1e-9)
    for _ in range(100):
        run(world, H)
        angle = world.joint_values(driving).angle
        expected = math.atan2(math.sin(angle) * math.cos(bend), math.cos(angle))
        error = world.joint_values(driven).angle - expected
        assert abs(math.remainder(error, 2 * math.pi)) < 1e-3
    assert angle == pytest.approx(2, abs=0.05)


@pytest.mark.parametrize("part", [0.99, 1.01])
def test_a_clamp_breaks_at_its_torque(part):
    world, ground = bench(gravity_W=(0, 0, -G))
    board = box(world, (0.5, 0.1, 0.05), (0.6, 0, 0))
    bends = mass_of(world, board) * G * 0.6
    clamp = world.add_joint(
        name="clamp", kind=dyop.JointKind.Fixed, a=ground, b=board,
        X_BJ=((1, 0, 0, 0), (-0.6, 0, 0)), break_torque=part * bends,
    )
    report = world.advance(0.2)
    if part > 1:
        assert not report.broken_joints and world.joints() == [clamp]
        return
    (broken,) = report.broken_joints
    assert (broken.joint, broken.name, broken.a, broken.b) == (clamp, "clamp", ground, board)
    assert broken.torque == pytest.approx(bends, rel=2e-2)
    assert world.joints() == []
    with pytest.raises(dyop.InvalidArgument, match="no joint"):
        world.joint_values(clamp)


REFUSED = [
    (dict(swing_twist=dyop.SwingTwistLimits(swing=0)), r"swing must be in \(0, pi\), not 0"),
    (dict(kind=dyop.JointKind.Fixed, friction=1.0), "joint that turns or slides"),
    (dict(kind=dyop.JointKind.Hinge, friction=-1.0), "friction must be finite and >= 0, not -1"),
    (dict(break_force=0.0), "at which it breaks must be > 0, not 0"),
    (
        dict(kind=dyop.JointKind.Hinge, motor=dyop.JointMotor(position=1, damping=1, strength=5)),
        "motor has a position with a stiffness",
    ),
]


@pytest.mark.parametrize("fields, message", REFUSED)
def test_what_cannot_be_is_refused(fields, message):
    world, ground = bench()
    body = box(world, (0.1, 0.1, 0.1), (0, 0, 0))
    with pytest.raises(dyop.InvalidArgument, match=f"'knee'.*{message}"):
        world.add_joint(name="knee", a=ground, b=body, **fields)
    with pytest.raises(dyop.InvalidArgument, match="no joint"):
        world.add_joint(kind=dyop.JointKind.Coupling)
    with pytest.raises(TypeError, match="there is no field 'colour'"):
        world.add_joint(colour=1)


def test_joints_and_their_values_are_records():
    world, ground = bench()
    body, hinge = on_axle(world, ground)
    values = world.joint_values(hinge)
    definition = copy.copy(world.joint(hinge))
    for thing in (values, definition, dyop.SwingTwistLimits(swing=1), dyop.JointMotor(speed=2)):
        assert fields_equal(pickle.loads(pickle.dumps(thing)), thing)
        assert fields_equal(copy.deepcopy(thing), thing)
        assert len(repr(thing)) < 2000
    assert repr(values).startswith("JointValues(angle=0.0, angle_rate=0.0")
    assert repr(hinge) == "JointId(0)" and repr(dyop.JointId()) == "JointId()"
    assert pickle.loads(pickle.dumps(hinge)) == hinge == dyop.JointId(0) < dyop.JointId(1)
    with pytest.raises(AttributeError):
        values.angle = 1
    definition.motor = dyop.JointMotor(speed=1, strength=2)
    assert definition.motor.strength == 2 and world.joint(hinge).motor is None


def test_impulses_and_mass_change_the_motion():
    world = dyop.World()
    body = box(world, (0.1, 0.2, 0.3), (0, 0, 0))
    properties = world.body(body).mass_properties
    world.apply_impulse(body, (properties.mass, 0, 0))
    np.testing.assert_allclose(world.state(body).twist.v_WB, [1, 0, 0])
    # Through a point 0.2 off: the angular momentum is that arm times the impulse.
    world.apply_impulse(body, (1, 0, 0), p_W=(0, 0.2, 0))
    np.testing.assert_allclose(world.momentum(), [properties.mass + 1, 0, 0])
    np.testing.assert_allclose(world.angular_momentum(), [0, 0, -0.2], atol=1e-12)
    world.apply_angular_impulse(body, (0, 0, 0.2))
    np.testing.assert_allclose(world.angular_momentum(), [0, 0, 0], atol=1e-12)
    speed = world.state(body).twist.v_WB[0]
    world.set_mass_properties(body, dyop.with_mass(properties, 5))
    assert world.momentum()[0] == pytest.approx(5 * speed)
    with pytest.raises(dyop.InvalidArgument, match="nan"):
        world.apply_impulse(body, (math.nan, 0, 0))
