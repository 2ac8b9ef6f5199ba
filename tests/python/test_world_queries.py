# SPDX-License-Identifier: BSD-3-Clause
"""Rays, casts, nearest and overlapping bodies of a World; filters, materials and contact events."""

import math
import pickle
import threading

import numpy as np
import pytest

import dyop
from conftest import fields_equal

G = 9.81


def still(world, shape, p, **more):
    state = (((1, 0, 0, 0), p), ((0, 0, 0), (0, 0, 0)))
    return world.add_body(kind=dyop.BodyKind.Static, shape=shape, initial=state, **more)


def ball(world, p, v=(0, 0, 0), **more):
    shape = dyop.Sphere(0.5)
    return world.add_body(
        shape=shape, initial=(((1, 0, 0, 0), p), (v, (0, 0, 0))),
        mass_properties=shape.compute_mass_properties(1), **more,
    )


@pytest.fixture
def crowd(generator):
    """A World of balls at random, with their centres."""
    world = dyop.World()
    centres = generator.uniform(-10, 10, size=(60, 3))
    return world, [still(world, dyop.Sphere(0.5), p) for p in centres], centres


def ray_on_balls(origin, direction, centres, length):
    """Distances to the first place of a ray in each ball of radius 0.5; inf where it passes."""
    along = direction / np.linalg.norm(direction)
    towards = centres - origin
    middle = towards @ along
    under = 0.25 - (np.sum(towards**2, axis=1) - middle**2)
    first = np.where(under > 0, middle - np.sqrt(np.maximum(under, 0)), np.inf)
    return np.where((first > 0) & (first < length), first, np.inf)


def test_rays_meet_the_ball_that_the_formula_says(crowd, generator):
    world, bodies, centres = crowd
    hits = 0
    for _ in range(100):
        origin = generator.uniform(-10, 10, size=3)
        if np.min(np.linalg.norm(centres - origin, axis=1)) < 0.51:
            continue
        direction = centres[generator.integers(60)] + generator.normal(size=3) / 2 - origin
        distances = ray_on_balls(origin, direction, centres, 15)
        hit = world.cast_ray(origin, direction, 15)
        if np.isinf(distances).all():
            assert hit.status == dyop.ToiStatus.Separated and hit.body is None
            assert hit.distance == 15
            continue
        hits += 1
        first = np.argmin(distances)
        assert hit.status == dyop.ToiStatus.Impact and hit.body == bodies[first]
        assert hit.distance <= distances[first] + 1e-9
        np.testing.assert_allclose(np.linalg.norm(hit.p_W - centres[first]), 0.5, atol=1e-9)
        assert hit.nhat_W @ direction < 0
    assert hits > 10


def test_the_nearest_and_the_overlapping_are_those_of_all_distances(crowd, generator):
    world, bodies, centres = crowd
    probe = dyop.Sphere(1.0)
    for _ in range(30):
        p = generator.uniform(-10, 10, size=3)
        gaps = np.linalg.norm(centres - p, axis=1) - 1.5
        found = world.nearest(probe, ((1, 0, 0, 0), p))
        assert found.body == bodies[np.argmin(gaps)]
        if gaps.min() > 0:
            assert found.distance.lower - 1e-9 <= gaps.min() <= found.distance.upper + 1e-9
        near = world.overlaps(probe, ((1, 0, 0, 0), p), max_distance=2)
        assert near.bodies == tuple(b for b, gap in zip(bodies, gaps) if gap <= 2)
        assert near.undecided == ()


def test_a_cast_shape_stops_where_the_formula_says(crowd):
    world, bodies, centres = crowd
    start = np.array([0.0, 0.0, 30.0])
    motion = dyop.ConstantTwistMotion(((1, 0, 0, 0), start), ((0, 0, -1), (0, 0, 3)))
    hit = world.cast_shape(dyop.Sphere(0.5), motion, (0, 60))
    # Two balls of radius 0.5 are one of radius 1 and a point.
    off = np.sum(centres[:, :2] ** 2, axis=1)
    times = np.where(off < 1, 30 - centres[:, 2] - np.sqrt(np.maximum(1 - off, 0)), np.inf)
    if np.isinf(times).all():
        assert hit.toi.status == dyop.ToiStatus.Separated and hit.free_fraction == 1
    else:
        assert hit.body == bodies[np.argmin(times)]
        assert hit.toi.t_safe == pytest.approx(times.min(), abs=1e-3)
    options = dyop.ToiOptions(target_distance=0.25)
    near = world.cast_shape(dyop.Sphere(0.5), motion, (0, 60), options)
    assert near.toi.t_safe < hit.toi.t_safe or np.isinf(times).all()


def test_bits_sensors_and_functions_leave_bodies_out():
    world = dyop.World()
    glass = still(world, dyop.Sphere(0.5), (2, 0, 0), filter=dyop.CollisionFilter(category=2))
    wall = still(world, dyop.Sphere(0.5), (4, 0, 0), filter=dyop.CollisionFilter(category=4))
    zone = still(world, dyop.Sphere(0.5), (1, 0, 0), is_sensor=True)

    def first(**fields):
        return world.cast_ray((0, 0, 0), (1, 0, 0), 9, dyop.BodyFilter(**fields)).body

    assert first() == glass and first(mask=4) == wall and first(mask=8) is None
    assert first(includes_sensors=True) == zone
    assert first(accepts=lambda body: body != glass) == wall
    assert first(category=0) is None
    world.set_enabled(glass, False)
    assert first() == wall
    # A function may look at its World and ask it, but not change it.
    assert first(accepts=lambda body: world.body(body).filter.category == 4 and
                 world.cast_ray((9, 0, 0), (-1, 0, 0), 9).body == wall) == wall
    with pytest.raises(dyop.InvalidArgument, match="while it answers a query"):
        first(accepts=lambda body: world.set_enabled(body, False))
    with pytest.raises(ZeroDivisionError):
        first(accepts=lambda body: 1 / 0)
    with pytest.raises(TypeError, match="must return a bool"):
        first(accepts=lambda body: "yes")
    assert first() == wall
    used = dyop.BodyFilter(mask=3)
    assert fields_equal(pickle.loads(pickle.dumps(used)), used) and used.accepts is None


def test_bad_queries_name_the_value():
    world = dyop.World()
    for arguments, message in [
        (((0, 0, math.nan), (1, 0, 0), 1), "origin must be finite, not .0 +0 +nan"),
        (((0, 0, 0), (0, 0, 0), 1), "direction must be finite and not zero"),
        (((0, 0, 0), (1, 0, 0), -2), "length must be finite and > 0, not -2"),
    ]:
        with pytest.raises(dyop.InvalidArgument, match=message):
            world.cast_ray(*arguments)
    with pytest.raises(dyop.InvalidArgument, match="not -1"):
        world.overlaps(dyop.Sphere(1), np.eye(4), max_distance=-1)
    with pytest.raises(TypeError, match="filter"):
        world.cast_ray((0, 0, 0), (1, 0, 0), 1, filter="all")


def test_threads_take_turns_and_the_world_stays(crowd):
    world, bodies, centres = crowd
    expected = world.cast_ray((-20, 0, 0), (1, 0.01, 0.02), 50)
    answers = []

    def ask():
        for _ in range(20):
            answers.append(world.cast_ray((-20, 0, 0), (1, 0.01, 0.02), 50))
            world.nearest(dyop.Sphere(1), np.eye(4))

    threads = [threading.Thread(target=ask) for _ in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert len(answers) == 80 and all(fields_equal(answer, expected) for answer in answers)


def test_on_step_may_ask_and_other_callbacks_may_not():
    gaps = []

    def measure(t):
        hit = world.cast_ray((0, 0, -5), (0, 0, 1), 100)
        gaps.append((t, hit.distance - 4.5))

    world = dyop.World(dyop.WorldOptions(gravity_W=(0, 0, -G), max_step=0.05, on_step=measure))
    assert world.options().on_step is measure
    body = ball(world, (0, 0, 5))
    world.advance(0.5)
    assert len(gaps) == 10
    for t, gap in gaps:
        assert gap == pytest.approx(5 - G * t * t / 2, abs=1e-3)
    world.set_wrench(body, lambda t, state: world.nearest(dyop.Sphere(1), np.eye(4)))
    with pytest.raises(dyop.InvalidArgument, match="in on_step only"):
        world.advance(0.1)


def test_materials_combine_as_the_rule_says():
    rules = dyop.CombineRule
    expected = {
        rules.GeometricMean: 0.4, rules.Mean: 0.5, rules.Product: 0.16, rules.Minimum: 0.2,
        rules.Maximum: 0.8,
    }
    assert set(rules) == set(expected)
    for rule, value in expected.items():
        options = dyop.WorldOptions(combine_friction=rule, combine_restitution=rule)
        world = dyop.World(options)
        a = ball(world, (0, 0, 0), friction=0.2, restitution=0.2)
        b = ball(world, (3, 0, 0), friction=0.8, restitution=0.8)
        pair = world.pair_material(a, b)
        assert pair.friction == pytest.approx(value) == pytest.approx(pair.restitution)
        world.set_pair_material(a, b, dyop.Material(friction=0.7))
        assert world.pair_material(b, a).friction == 0.7
        world.set_pair_material(a, b, None)
        assert world.pair_material(a, b).friction == pytest.approx(value)
        assert world.options().combine_friction == rule


def test_filters_let_bodies_fall_through_and_events_tell_of_contacts():
    options = dyop.WorldOptions(gravity_W=(0, 0, -G), max_step=0.01)
    world = dyop.World(options)
    ghost_filter = dyop.CollisionFilter(category=2, mask=0)
    table = still(world, dyop.Box([5, 5, 0.5]), (0, 0, -0.5))
    solid = ball(world, (0, 0, 0.6), restitution=0)
    ghost = ball(world, (2, 0, 0.6), filter=ghost_filter)
    report = world.advance(1)
    begins = [event for event in report.contact_events if event.is_begin]
    assert {begins[0].a, begins[0].b} == {table, solid}
    # It falls 0.1.
    assert begins[0].t == pytest.approx(math.sqrt(2 * 0.1 / G), abs=0.011)
    assert world.state(ghost).X_WB.translation[2] == pytest.approx(0.6 - G / 2, abs=1e-6)
    world.set_filter(solid, ghost_filter)
    report = world.advance(0.5)
    assert world.state(solid).X_WB.translation[2] < -0.5
    world.set_filter(solid, dyop.CollisionFilter())
    assert fields_equal(world.body(solid).filter, dyop.CollisionFilter())


def test_a_shape_can_be_replaced():
    world = dyop.World()
    body = ball(world, (0, 0, 0))
    world.set_shape(body, dyop.Box([2, 1, 1]))
    assert world.cast_ray((9, 0, 0), (-1, 0, 0), 20).distance == pytest.approx(7, abs=1e-3)
    with pytest.raises(TypeError):
        world.set_shape(body, None)


def test_a_moving_sensor_reports_what_it_falls_through():
    world = dyop.World(dyop.WorldOptions(max_step=0.01))
    target = still(world, dyop.Sphere(0.5), (0, 0, 0))
    probe = ball(world, (-3, 0, 0), v=(2, 0, 0), is_sensor=True)
    report = world.advance(3)
    begin, end = report.sensors
    assert (begin.sensor, begin.body, begin.is_overlap) == (probe, target, True)
    assert begin.t == pytest.approx(1, abs=0.02) and end.t == pytest.approx(2, abs=0.02)
    assert not end.is_overlap and report.work.contacts == 0


def test_velocity_changes_add_up():
    options = dyop.WorldOptions(gravity_W=(0, 0, -G), max_step=0.01, records_impulses=True)
    world = dyop.World(options)
    still(world, dyop.Box([5, 5, 0.5]), (0, 0, -0.5))
    body = ball(world, (0, 0, 0.6), v=(1, 0, 0))
    mass = world.body(body).mass_properties.mass
    report = world.advance(0.3)
    assert report.velocity_changes
    kinds = {change.kind for change in report.velocity_changes}
    assert dyop.VelocityChangeKind.Impact in kinds
    for change in report.velocity_changes:
        (own,) = [entry for entry in change.bodies if entry.body == body]
        given = own.impulse_W + sum(
            (c.impulse_W if c.b == body else -c.impulse_W for c in change.contacts), np.zeros(3)
        )
        np.testing.assert_allclose(mass * (own.v_W - own.v_before_W), given, atol=1e-9)
    assert len(repr(report)) < 2000
    copied = pickle.loads(pickle.dumps(report.velocity_changes))
    assert fields_equal(copied, report.velocity_changes)


def test_a_world_names_its_pair_rules_and_gravity():
    world = dyop.World(dyop.WorldOptions(gravity_W=(0, 0, -1)))
    a, b, c = ball(world, (0, 0, 0)), ball(world, (3, 0, 0)), ball(world, (6, 0, 0))
    world.set_pair_enabled(a, b, False)
    world.set_target_distance(b, c, 0.25)
    rules = {(rule.a, rule.b): rule for rule in world.pair_rules()}
    assert not rules[a, b].is_enabled and rules[b, c].target_distance == 0.25
    world.set_gravity((0, 0, -2))
    np.testing.assert_array_equal(world.gravity(), [0, 0, -2])
    spring = world.add_spring(a=a, b=b, stiffness=1)
    assert world.springs() == [spring]
