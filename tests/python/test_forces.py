# SPDX-License-Identifier: BSD-3-Clause
"""Springs, friction laws, materials and kinematic poses of a World, and the limits of an advance."""

import numpy as np
import pytest

import dyop
from conftest import fields_equal

STEP = 0.01


def at(x, y=0.0, z=0.0):
    return ((1, 0, 0, 0), (x, y, z))


def add(world, shape, pose, velocity=(0, 0, 0), **more):
    state = dyop.MotionState(X_WB=pose, twist=(velocity, (0, 0, 0)))
    return world.add_body(
        name="body", shape=shape, initial=state, mass_properties=shape.compute_mass_properties(1),
        **more,
    )


def x_of(world, body):
    return world.state(body).X_WB.translation[0]


@pytest.fixture
def ball_on_spring():
    """A ball at x = 0 on a spring to a wall at x = 3, stretched by 0.5; angular frequency 2."""
    world = dyop.World(dyop.WorldOptions(max_step=STEP))
    ball = add(world, dyop.Sphere(0.1), at(0))
    wall = add(world, dyop.Sphere(0.1), at(3), kind=dyop.BodyKind.Static)
    mass = dyop.Sphere(0.1).compute_mass_properties(1).mass
    spring = world.add_spring(name="s", a=ball, b=wall, rest_length=2.5, stiffness=4 * mass)
    return world, ball, spring


def test_a_spring_swings_as_it_must(ball_on_spring):
    world, ball, spring = ball_on_spring
    energy = world.spring_energy()
    assert energy == pytest.approx(world.spring(spring).stiffness * 0.5**2 / 2, rel=1e-12)
    for _ in range(3):
        world.advance(1)
        # The frequency of the midpoint rule is too low by (w h)^2 / 12.
        late = 2 * world.time() * (2 * STEP) ** 2 / 12
        expected = 0.5 - 0.5 * np.cos(2 * world.time())
        assert x_of(world, ball) == pytest.approx(expected, abs=0.5 * late + 1e-6)
        assert world.spring_energy() + world.kinetic_energy() == pytest.approx(energy, rel=1e-6)


def test_a_removed_spring_acts_no_longer(ball_on_spring):
    world, ball, spring = ball_on_spring
    world.advance(0.5)
    world.remove_spring(spring)
    speed, x = world.state(ball).twist.v_WB[0], x_of(world, ball)
    world.advance(0.5)
    assert speed > 0.1 and x_of(world, ball) == pytest.approx(x + 0.5 * speed, abs=1e-9)
    assert world.spring_energy() == 0
    with pytest.raises(dyop.InvalidArgument):
        world.spring(spring)


def test_spring_definitions_are_records(ball_on_spring):
    world, ball, spring = ball_on_spring
    kept = world.spring(spring)
    assert kept.name == "s" and kept.a == ball and kept.rest_length == 2.5 and kept.damping == 0
    assert {spring: 1}[spring] == 1 and repr(spring) == "SpringId(0)"
    again = dyop.SpringDefinition(**kept.asdict())
    assert fields_equal(again, kept)
    with pytest.raises(dyop.InvalidArgument, match="stiffness"):
        world.add_spring(a=kept.a, b=kept.b, stiffness=-1)


def sliding_box(**options):
    world = dyop.World(dyop.WorldOptions(gravity_W=(0, 0, -9.81), max_step=STEP, **options))
    add(world, dyop.Box([9, 9, 1]), at(0, 0, -1), kind=dyop.BodyKind.Static)
    return world, add(world, dyop.Box([0.2, 0.2, 0.1]), at(0, 0, 0.1001), velocity=(2, 0, 0))


def test_a_friction_law_decides():
    asked = []

    def law(a, b, sliding_W):
        asked.append((a, b, sliding_W.shape))
        return 0.25

    world, box = sliding_box(friction_law=law)
    world.advance(0.5)
    assert world.state(box).twist.v_WB[0] == pytest.approx(2 - 0.25 * 9.81 * 0.5, rel=0.02)
    assert {shape for _, _, shape in asked} == {(3,)} and asked[0][0] != asked[0][1]


def test_an_exception_of_a_friction_law_comes_out():
    def fail(a, b, sliding_W):
        raise LookupError("no such pair")

    world, _ = sliding_box(friction_law=fail)
    with pytest.raises(LookupError):
        world.advance(0.5)


def test_another_material_slides_on():
    world, box = sliding_box()
    world.set_material(box, dyop.Material(friction=0))
    world.advance(0.5)
    assert world.state(box).twist.v_WB[0] == pytest.approx(2, abs=1e-6)
    world.set_material(box, dyop.Material(friction=0.5))
    world.advance(1)
    assert world.state(box).twist.v_WB[0] == pytest.approx(0, abs=1e-3)
    with pytest.raises(dyop.InvalidArgument, match="restitution"):
        world.set_material(box, dyop.Material(restitution=7))


def test_a_hand_goes_from_pose_to_pose():
    world = dyop.World(dyop.WorldOptions(max_step=STEP))
    hand = world.add_body(
        name="hand", kind=dyop.BodyKind.Kinematic, shape=dyop.Sphere(0.1), motion=dyop.RestMotion()
    )
    world.set_next_pose(hand, at(1), 2.0)
    world.advance(1)
    assert x_of(world, hand) == pytest.approx(0.5, abs=1e-12)
    world.advance(2)
    assert x_of(world, hand) == pytest.approx(1, abs=1e-12)


def test_an_advance_of_so_many_steps():
    world, _ = sliding_box()
    report = world.advance(1, max_steps=3)
    assert report.status == dyop.AdvanceStatus.BudgetExhausted and report.work.steps == 3
    assert world.time() == pytest.approx(3 * STEP)
    with pytest.raises(dyop.InvalidArgument, match="max_steps"):
        world.advance(1, max_steps=0)


def test_reports_say_where_the_time_went_and_how_near_contacts_were():
    world, _ = sliding_box(measures_time=True, target_distance=1e-5)
    report = world.advance(0.5)
    times = report.times
    assert times.total > 0 and times.proofs > 0 and times.solve > 0 and times.ends > 0
    assert 1e-5 <= report.work.shortest_gap < 1e-3
    empty = dyop.World().advance(0.1)
    assert empty.times.total == 0 and empty.work.shortest_gap == np.inf
