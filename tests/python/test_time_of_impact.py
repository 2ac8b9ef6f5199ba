# SPDX-License-Identifier: BSD-3-Clause
import time

import numpy as np
import pytest

import dyop
from conftest import fields_equal, random_quaternions, uv_sphere

REST = dyop.RestMotion()


def moving(p, v, w=(0, 0, 0)):
    return dyop.ConstantTwistMotion(((1, 0, 0, 0), p), (v, w))


@pytest.mark.parametrize("scale", [1e-4, 1.0, 1e4])
@pytest.mark.parametrize("tolerance", [1e-2, 1e-6, 1e-9])
def test_two_spheres_head_on_meet_at_gap_over_speed(scale, tolerance):
    flight = moving((5.5 * scale, 0, 0), (-2 * scale, 0, 0), (0, 0, 9))
    options = dyop.ToiOptions(distance_tolerance=tolerance * scale)
    result = dyop.time_of_impact(
        dyop.Sphere(scale), REST, dyop.Sphere(0.5 * scale), flight, (0, 10), options
    )
    assert result.status == dyop.ToiStatus.Impact
    assert 2 - tolerance <= result.t_safe <= 2
    assert result.t_safe < result.t_hit
    np.testing.assert_allclose(result.contact.nhat_AB_W, [1, 0, 0], atol=1e-12)
    assert result.contact.closing_speed == pytest.approx(2 * scale)
    assert result.X_WB == flight.pose(result.t_safe)


def test_a_miss_is_proven_and_a_target_makes_it_a_hit():
    flight = moving((-5, 2.5, 0), (1, 0, 0))
    ask = lambda **o: dyop.time_of_impact(
        dyop.Sphere(1), REST, dyop.Sphere(1), flight, (0, 10), dyop.ToiOptions(**o)
    )
    assert ask().status == dyop.ToiStatus.Separated and ask().t_safe == 10
    hit = ask(target_distance=0.6)
    assert hit.t_safe == pytest.approx(5 - np.sqrt(2.6**2 - 2.5**2), abs=1e-4)


@pytest.mark.parametrize("turn", [0.0, 0.4, 1.1])
def test_a_rod_that_turns_meets_a_ball_at_its_angle(turn):
    # Turning about z at rate 1, a thin rod along x reaches the direction of the ball; the ball of
    # radius r at distance d is touched asin((r + e) / d) before that, e the rod's half thickness.
    rod = dyop.Capsule(0.01, 2)
    half = np.sqrt(0.5)
    start = dyop.RigidPose(quaternion=(half, 0, half, 0))
    spin = dyop.ConstantTwistMotion(start, ((0, 0, 0), (0, 0, 1)))
    angle = 1.0 + turn
    ball = dyop.RestMotion(((1, 0, 0, 0), (1.5 * np.cos(angle), 1.5 * np.sin(angle), 0)))
    result = dyop.time_of_impact(rod, spin, dyop.Sphere(0.2), ball, (0, 3))
    assert result.t_safe == pytest.approx(angle - np.arcsin(0.21 / 1.5), abs=1e-5)


def test_meshes_agree_with_dense_sampling(generator):
    mesh = dyop.TriangleMesh(*uv_sphere(8, 10))
    box = dyop.Box([0.5, 0.2, 0.8])
    hits = 0
    for q in random_quaternions(generator, 25):
        toward = generator.normal(size=3) * 0.6
        start = np.array([4.0, 0, 0]) + toward
        motion = dyop.ConstantTwistMotion((q, start), ((-3, 0, 0), generator.normal(size=3) * 3))
        result = dyop.time_of_impact(mesh, REST, box, motion, (0, 3))
        times = np.linspace(0, 3, 301)
        gaps = [dyop.distance(mesh, REST.pose(0), box, motion.pose(t)).upper for t in times]
        if result.status == dyop.ToiStatus.Impact:
            hits += 1
            assert min(g for t, g in zip(times, gaps) if t < result.t_safe) > 0
            last = dyop.distance(mesh, REST.pose(0), box, motion.pose(result.t_safe))
            assert last.upper <= 1e-6
        else:
            assert result.status == dyop.ToiStatus.Separated and min(gaps) > 0
    assert 5 < hits


def test_a_budget_is_undecided_and_resumes_to_the_same_answer():
    mesh = dyop.TriangleMesh(*uv_sphere(30, 40))
    flight = moving((4, 0.3, 0), (-1, 0, 0), (1, 2, 3))
    whole = dyop.time_of_impact(mesh, REST, mesh, flight, (0, 4))
    workspace = dyop.ToiWorkspace()
    part = dyop.ToiOptions(max_node_pairs=20)
    result = dyop.time_of_impact(mesh, REST, mesh, flight, (0, 4), part, workspace)
    rounds = 0
    while workspace.can_resume():
        assert result.status == dyop.ToiStatus.BudgetExhausted and result.t_safe <= whole.t_safe
        result = dyop.resume_time_of_impact(mesh, REST, mesh, flight, (0, 4), part, workspace)
        rounds += 1
    assert rounds > 2
    assert result.t_safe == whole.t_safe and fields_equal(result.contact, whole.contact)
    with pytest.raises(dyop.InvalidArgument):
        dyop.resume_time_of_impact(mesh, REST, mesh, flight, (0, 4), part, workspace)


def test_deadline_and_stop_end_a_query():
    mesh = dyop.TriangleMesh(*uv_sphere(30, 40))
    flight = moving((4, 0.3, 0), (-1, 0, 0), (1, 2, 3))
    late = dyop.ToiOptions(deadline=time.monotonic())
    result = dyop.time_of_impact(mesh, REST, mesh, flight, (0, 4), late)
    assert result.status == dyop.ToiStatus.BudgetExhausted
    source = dyop.StopSource()
    source.request_stop()
    stopped = dyop.ToiOptions(stop=source)
    result = dyop.time_of_impact(mesh, REST, mesh, flight, (0, 4), stopped)
    assert result.status == dyop.ToiStatus.Cancelled
    assert stopped.stop.stop_requested() and late.deadline <= time.monotonic()


def test_all_contacts_of_an_impact():
    cube = dyop.Box([1, 1, 1])
    options = dyop.ToiOptions(with_contacts=True)
    result = dyop.time_of_impact(cube, REST, cube, moving((0, 0, 4), (0, 0, -1)), (0, 4), options)
    assert result.t_safe == pytest.approx(2, abs=1e-5) and len(result.contacts) == 4


def test_least_distance_of_a_passing_sphere():
    flight = moving((-5, 3, 0), (1, 0, 0))
    options = dyop.LeastDistanceOptions(relative_tolerance=1e-4)
    result = dyop.least_distance(dyop.Sphere(1), REST, dyop.Sphere(1), flight, (0, 10), options)
    assert result.status == dyop.LeastDistanceStatus.Bounded
    assert result.lower <= 1 <= result.upper and result.upper - result.lower <= 1e-4
    assert result.t_upper == pytest.approx(5, abs=0.05)


@pytest.mark.parametrize(
    "change, said",
    [
        (dict(interval=(1, 0)), "reversed"),
        (dict(interval=(0, np.inf)), "finite"),
        (dict(options=dyop.ToiOptions(target_distance=-1)), "-1"),
        (dict(options=dyop.ToiOptions(distance_tolerance=0)), "0"),
        (dict(options=dyop.ToiOptions(distance_tolerance=np.nan)), "nan"),
        (dict(X_WB=dyop.InterpolatedMotion((0, 0.5), np.eye(4), np.eye(4))), "0.5"),
    ],
)
def test_bad_queries_are_refused_with_the_value(change, said):
    query = dict(a=dyop.Sphere(1), X_WA=REST, b=dyop.Sphere(1), X_WB=REST, interval=(0, 1))
    with pytest.raises(dyop.InvalidArgument, match=said):
        dyop.time_of_impact(**{**query, **change})


def test_wrong_types_and_fields_are_type_errors():
    with pytest.raises(TypeError):
        dyop.time_of_impact(dyop.Sphere(1), None, dyop.Sphere(1), REST, (0, 1))
    with pytest.raises(TypeError, match="max_pairs"):
        dyop.ToiOptions(max_pairs=3)
    with pytest.raises(TypeError, match="max_node_pairs"):
        dyop.ToiOptions(max_node_pairs="many")
    with pytest.raises(AttributeError):
        dyop.ToiResult().status = dyop.ToiStatus.Separated


def test_an_impact_has_derivatives():
    ball = dyop.Sphere(1)
    rest = dyop.RestMotion()
    flight = dyop.ConstantTwistMotion(dyop.RigidPose(position=(-5, 0.8, 0)), ((2, 0, 0), (0, 0, 0)))
    hit = dyop.time_of_impact(ball, rest, ball, flight, (0, 5))
    found = dyop.impact_derivatives(ball, rest, ball, flight, hit)
    assert found.status == dyop.DerivativeStatus.Proven
    assert found.by_b.translation[0] == pytest.approx(-0.5, abs=1e-5)
    faster = flight.pose_change(hit.t_safe, ((0, 0, 0), (0, 0, 0)), ((1, 0, 0), (0, 0, 0)))
    assert found.by_b.along(faster) == pytest.approx(-hit.t_safe / 2, abs=1e-5)
    miss = dyop.time_of_impact(ball, rest, ball, flight, (0, 0.1))
    with pytest.raises(dyop.InvalidArgument, match="Separated"):
        dyop.impact_derivatives(ball, rest, ball, flight, miss)
