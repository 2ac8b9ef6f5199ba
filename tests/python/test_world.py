# SPDX-License-Identifier: BSD-3-Clause
import os
import signal
import threading
import time

import numpy as np
import pytest

import dyop
from conftest import fields_equal

G = 9.81


def ball(world, p=(0, 0, 5), v=(0, 0, 0), radius=0.5, **more):
    shape = dyop.Sphere(radius)
    state = dyop.MotionState(X_WB=((1, 0, 0, 0), p), twist=(v, (0, 0, 0)))
    return world.add_body(
        name="ball", shape=shape, initial=state, mass_properties=shape.compute_mass_properties(1),
        **more,
    )


def floor(world, **more):
    state = dyop.MotionState(X_WB=((1, 0, 0, 0), (0, 0, -1)))
    return world.add_body(
        name="floor", kind=dyop.BodyKind.Static, shape=dyop.Box([10, 10, 1]), initial=state, **more
    )


def falling(**options):
    return dyop.World(dyop.WorldOptions(gravity_W=(0, 0, -G), max_step=0.01, **options))


def test_free_flight_is_a_parabola():
    world = falling()
    body = ball(world, v=(1, 0, 2))
    report = world.advance(1.5)
    assert report.status == dyop.AdvanceStatus.Completed and world.time() == 1.5
    state = world.state(body)
    np.testing.assert_allclose(state.X_WB.translation, [1.5, 0, 5 + 3 - G * 1.5**2 / 2], atol=1e-9)
    np.testing.assert_allclose(state.twist.v_WB, [1, 0, 2 - G * 1.5], atol=1e-9)
    assert world.kinetic_energy() > 0 and world.momentum().shape == (3,)


def test_the_first_bounce_comes_when_it_must():
    world = falling(target_distance=1e-4, policy=dyop.ImpactPolicy.Stop)
    body, ground = ball(world), floor(world)
    report = world.advance(2)
    assert report.status == dyop.AdvanceStatus.StoppedAtImpact
    event = report.impacts[0]
    # Between the times at which the gap is the rest gap, target and rest_offset, and the target.
    assert np.sqrt(2 * (4.5 - 5.1e-4) / G) <= event.t <= np.sqrt(2 * (4.5 - 1e-4) / G)
    assert {event.a, event.b} == {body, ground}
    assert event.toi.status == dyop.ToiStatus.Impact


def test_a_ball_comes_to_rest_and_the_report_says_so():
    world = falling(target_distance=1e-4)
    body, ground = ball(world, p=(0, 0, 0.6), restitution=0), floor(world)
    report = world.advance(2)
    assert 0.5 + 1e-4 < world.state(body).X_WB.translation[2] < 0.501
    assert report.work.pairs_by_bound + report.work.pairs_by_query > 0
    (record,) = world.contacts()
    assert {record.a, record.b} == {body, ground} and record.gap_lower >= 1e-4
    total = sum(contact.impulse_W for contact in record.contacts)
    mass = world.body(body).mass_properties.mass
    assert abs(total[2]) == pytest.approx(mass * G * 0.01, rel=1e-3) or world.is_asleep(body)


def test_steps_are_motions_through_the_committed_states():
    world = falling()
    body = ball(world, v=(1, 2, 3))
    report = world.advance(0.1)
    last = report.steps[-1]
    assert last.interval.end == pytest.approx(0.1)
    pose = last.motions[body.slot].pose(last.interval.end)
    np.testing.assert_allclose(pose.matrix, world.state(body).X_WB.matrix, atol=1e-12)


def test_a_wrench_in_python_drives_an_oscillator():
    # m x'' = -k x: after half a period x has changed its sign.
    world = dyop.World()
    states = []

    def spring(t, state):
        states.append(t)
        return (-4.0 * state.X_WB.translation, (0, 0, 0))

    shape = dyop.Sphere(0.1)
    mass = dyop.with_mass(shape.compute_mass_properties(1), 1)
    start = dyop.MotionState(X_WB=((1, 0, 0, 0), (1, 0, 0)))
    body = world.add_body(shape=shape, mass_properties=mass, initial=start, wrench=spring)
    assert world.body(body).wrench is spring
    world.advance(np.pi / 2)
    np.testing.assert_allclose(world.state(body).X_WB.translation, [-1, 0, 0], atol=1e-6)
    assert len(states) > 10
    world.set_wrench(body, None)
    assert world.body(body).wrench is None


def test_an_exception_of_a_wrench_leaves_the_last_committed_step():
    world = falling()

    def fail(t, state):
        if t > 0.055:
            raise LookupError("no force left")
        return ((0, 0, 0), (0, 0, 0))

    ball(world, wrench=fail)
    with pytest.raises(LookupError, match="no force"):
        world.advance(1)
    assert 0 < world.time() <= 0.06


def test_a_wrench_that_is_not_finite_is_an_integration_error():
    world = falling()
    ball(world, wrench=lambda t, state: ((float("nan"), 0, 0), (0, 0, 0)))
    with pytest.raises(dyop.IntegrationError, match="ball") as caught:
        world.advance(0.1)
    assert isinstance(caught.value, dyop.Error) and world.time() == 0


def test_an_impact_callback_changes_velocities():
    seen = []

    def reverse(event, states):
        seen.append(event.t)
        for name in "ab":
            state = getattr(states, name)
            setattr(states, name, (state.X_WB, (-state.twist.v_WB, (0, 0, 0))))

    world = dyop.World(dyop.WorldOptions(policy=dyop.ImpactPolicy.Callback, on_impact=reverse))
    body = ball(world, p=(0, 0, 2), v=(0, 0, -1))
    floor(world)
    world.advance(3)
    assert len(seen) == 1 and seen[0] == pytest.approx(1.5, abs=1e-3)
    np.testing.assert_allclose(world.state(body).twist.v_WB, [0, 0, 1])


def test_kinematic_joints_pairs_and_sensors():
    world = falling()
    carried = ball(world, p=(0, 0, 3), radius=0.1)
    motion = dyop.ConstantTwistMotion(((1, 0, 0, 0), (0, 0, 4)), ((1, 0, 0), (0, 0, 0)))
    carrier = world.add_body(
        name="carrier", kind=dyop.BodyKind.Kinematic, shape=dyop.Sphere(0.1), motion=motion
    )
    joint = world.add_joint(kind=dyop.JointKind.Distance, a=carrier, b=carried, name="rod")
    state = dyop.MotionState(X_WB=((1, 0, 0, 0), (0, 0, 3)))
    sensor = world.add_body(
        name="gate", kind=dyop.BodyKind.Static, shape=dyop.Box([0.3, 1, 1]), initial=state,
        is_sensor=True,
    )
    report = world.advance(1)
    apart = world.state(carrier).X_WB.translation - world.state(carried).X_WB.translation
    assert np.linalg.norm(apart) == pytest.approx(1, abs=2e-3)
    assert any(e.sensor == sensor and e.body == carried for e in report.sensors)
    assert world.joint(joint).name == "rod"
    world.remove_joint(joint)
    world.set_pair_enabled(carrier, carried, False)
    world.set_motion(carrier, dyop.RestMotion(motion.pose(world.time())))
    world.remove_body(sensor)
    assert world.bodies() == [carried, carrier] and not world.has_body(sensor)
    with pytest.raises(dyop.InvalidArgument):
        world.state(sensor)


def test_snapshots_go_back_to_the_same_bits():
    world = falling()
    body = ball(world)
    floor(world)
    world.advance(0.5)
    kept = world.snapshot()
    first = [world.advance(0.5), world.state(body)]
    world.restore(kept)
    assert world.time() == 0.5
    again = [world.advance(0.5), world.state(body)]
    assert fields_equal(first[1], again[1]) and fields_equal(first[0].work, again[0].work)


def test_user_data_comes_back_as_it_is():
    world = dyop.World()
    thing = object()
    body = ball(world, user_data=thing)
    assert world.body(body).user_data is thing


def test_ctrl_c_ends_an_advance_at_a_committed_step():
    world = falling(records_motions=False)
    ball(world, wrench=lambda t, state: ((0, 0, 0.1), (0, 0, 0)))
    threading.Timer(0.3, os.kill, (os.getpid(), signal.SIGINT)).start()
    with pytest.raises(KeyboardInterrupt):
        world.advance(1e5)
    assert 0 < world.time() < 1e5
    assert world.advance(0.01).status == dyop.AdvanceStatus.Completed


def test_stop_and_deadline():
    world = falling()
    ball(world)
    source = dyop.StopSource()
    source.request_stop()
    assert world.advance(1, stop=source).status == dyop.AdvanceStatus.Cancelled
    late = world.advance(1e4, deadline=time.monotonic() + 0.05)
    assert late.status == dyop.AdvanceStatus.BudgetExhausted


def test_a_world_refuses_changes_while_it_advances():
    failures = []

    def on_step(t):
        assert world.time() == t  # reading is allowed
        try:
            world.set_gravity((0, 0, 0))
        except dyop.InvalidArgument as error:
            failures.append(str(error))

    world = falling(on_step=on_step)
    ball(world)
    world.advance(0.05)
    assert len(failures) == 5 and "being advanced" in failures[0]


def test_other_threads_are_refused_while_it_advances():
    world = falling(on_step=lambda t: time.sleep(0.01))
    body = ball(world)
    said = []

    def ask():
        time.sleep(0.1)
        try:
            world.state(body)
        except dyop.InvalidArgument as error:
            said.append(str(error))

    thread = threading.Thread(target=ask)
    thread.start()
    world.advance(0.5)
    thread.join()
    assert said and "another thread" in said[0]


def test_nested_options_are_set_in_place():
    options = dyop.WorldOptions()
    options.solver.newton_limit = 7
    options.integrator_options.max_step = 0.5
    assert options.solver.newton_limit == 7 and options.integrator_options.max_step == 0.5
    body = dyop.BodyDefinition()
    body.initial.twist.v_WB = (1, 2, 3)
    np.testing.assert_array_equal(body.initial.twist.v_WB, [1, 2, 3])


@pytest.mark.parametrize(
    "change, said",
    [
        (dict(shape=None), "shape"),
        (dict(restitution=2), "restitution"),
        (dict(mass_properties=dyop.MassProperties()), "mass"),
        (dict(kind=dyop.BodyKind.Kinematic), "motion"),
    ],
)
def test_bad_bodies_are_refused(change, said):
    world = dyop.World()
    shape = dyop.Sphere(1)
    good = dict(name="b", shape=shape, mass_properties=shape.compute_mass_properties(1))
    with pytest.raises(dyop.InvalidArgument, match=said):
        world.add_body(**{**good, **change})
    with pytest.raises(TypeError, match="colour"):
        world.add_body(**good, colour="red")


def test_generated_contacts_are_the_corners():
    cube = dyop.Box([1, 1, 1])
    contacts = dyop.generate_contacts(cube, np.eye(4), cube, ((1, 0, 0, 0), (0, 0, 2.001)), 0.01)
    assert len(contacts) == 4
    assert all(c.gap == pytest.approx(0.001, abs=1e-9) for c in contacts)
