# SPDX-License-Identifier: BSD-3-Clause
import os
import signal
import threading
import time

import numpy as np
import pytest

import dyop
from conftest import uv_sphere


def at(x, y=0.0, z=0.0):
    return ((1, 0, 0, 0), (x, y, z))


@pytest.fixture
def wall_of_balls():
    """Balls of radius 1 at x = 5, 10, ..., 50; ids in that order."""
    obstacles = dyop.ObstacleSet()
    ids = [obstacles.add(dyop.Sphere(1), at(5.0 * k), groups=1 + k % 2) for k in range(1, 11)]
    return obstacles, ids


def test_the_first_of_many_is_hit(wall_of_balls):
    obstacles, ids = wall_of_balls
    flight = dyop.ConstantTwistMotion(np.eye(4), ((2, 0, 0), (0, 0, 0)))
    hit = obstacles.first_impact(dyop.Sphere(0.5), flight, (0, 30))
    assert hit.obstacle == ids[0] and hit.toi.t_safe == pytest.approx(1.75, abs=1e-5)
    assert hit.free_fraction == pytest.approx(1.75 / 30, abs=1e-5)
    later = obstacles.first_impact(
        dyop.Sphere(0.5), flight, (0, 30), accepts=lambda id: id not in ids[:3]
    )
    assert later.obstacle == ids[3]
    grouped = obstacles.first_impact(dyop.Sphere(0.5), flight, (0, 30), groups=1)
    assert grouped.obstacle == ids[1]


def test_set_changes(wall_of_balls):
    obstacles, ids = wall_of_balls
    assert len(obstacles) == 10 and obstacles.ids() == sorted(ids) and ids[0] in obstacles
    obstacles.remove(ids[0])
    assert ids[0] not in obstacles
    with pytest.raises(dyop.InvalidArgument):
        obstacles.move(ids[0], at(1))
    obstacles.move(ids[5], at(0, 3))
    nearest = obstacles.nearest(dyop.Sphere(1), np.eye(4))
    assert nearest.obstacle == ids[5] and nearest.distance.upper == pytest.approx(1)
    obstacles.move(ids[5], dyop.ConstantTwistMotion(at(0, 3), ((0, 1, 0), (0, 0, 0))))
    assert obstacles.nearest(dyop.Sphere(1), np.eye(4), t=2).distance.upper == pytest.approx(3)


def test_clearance(wall_of_balls):
    obstacles, ids = wall_of_balls
    flight = dyop.ConstantTwistMotion(at(0, 4), ((2, 0, 0), (0, 0, 0)))
    result = obstacles.least_distance(dyop.Sphere(1), flight, (0, 8))
    assert result.distance.lower <= 2 <= result.distance.upper
    assert result.obstacle in ids


def test_an_empty_set_is_free():
    flight = dyop.ConstantTwistMotion(np.eye(4), ((2, 0, 0), (0, 0, 0)))
    hit = dyop.ObstacleSet().first_impact(dyop.Sphere(1), flight, (0, 1))
    assert hit.obstacle is None and hit.free_fraction == 1


def test_an_exception_of_a_filter_comes_out(wall_of_balls):
    def fail(id):
        raise LookupError("who is it")

    with pytest.raises(LookupError):
        wall_of_balls[0].nearest(dyop.Sphere(1), np.eye(4), accepts=fail)


def test_obstacles_are_what_was_added(wall_of_balls):
    obstacles, ids = wall_of_balls
    kept = obstacles.obstacle(ids[2])
    assert kept.shape.radius == 1 and kept.groups == 2 and not kept.is_solid
    np.testing.assert_array_equal(kept.X_WO.pose(0).translation, [15, 0, 0])
    with pytest.raises(dyop.InvalidArgument):
        obstacles.obstacle(10**6)


@pytest.mark.parametrize("query", ["first_impact", "least_distance"])
def test_ctrl_c_ends_a_long_query(query):
    # A ball of triangles spins within a shell of them: hours of work.
    vertices, triangles = uv_sphere(60, 80)
    ball = dyop.TriangleMesh(vertices, triangles)
    obstacles = dyop.ObstacleSet()
    obstacles.add(dyop.TriangleMesh(1.1 * vertices, triangles), at(0))
    spin = dyop.ConstantTwistMotion(at(0), ((0, 0, 0), (300, 200, 100)))
    options = dyop.ToiOptions() if query == "first_impact" else dyop.LeastDistanceOptions()
    options.max_node_pairs = 10**12
    threading.Timer(0.3, os.kill, (os.getpid(), signal.SIGINT)).start()
    before = time.monotonic()
    with pytest.raises(KeyboardInterrupt):
        getattr(obstacles, query)(ball, spin, (0, 1000), options)
    assert time.monotonic() - before < 60
    assert len(obstacles) == 1
    obstacles.add(ball, at(9))  # nobody reads it any more


def test_rays_meet_the_first_obstacle():
    obstacles = dyop.ObstacleSet()
    far = obstacles.add(dyop.Sphere(1), dyop.RigidPose(position=(9, 0, 0)), groups=2)
    near = obstacles.add(dyop.Box([1, 1, 1]), dyop.RigidPose(position=(4, 0, 0)))
    found = obstacles.ray_cast((0, 0, 0), (1, 0, 0), radius=0.5)
    assert found.obstacle == near and found.hit.distance == pytest.approx(2.5, abs=1e-11)
    assert obstacles.ray_cast((0, 0, 0), (1, 0, 0), groups=2).obstacle == far
    none = obstacles.ray_cast((0, 0, 0), (-1, 0, 0), length=7)
    assert none.obstacle is None and none.hit.status == dyop.RayStatus.Miss
