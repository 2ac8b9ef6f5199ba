# SPDX-License-Identifier: BSD-3-Clause
"""Inputs that several test files share."""

import numpy as np
import pytest

import dyop


def uv_sphere(rows, columns, radius=1.0):
    """A closed mesh of a ball: vertices (N, 3) float64 and triangles (M, 3) int32."""
    heights = np.linspace(0, np.pi, rows + 1)[1:-1]
    turns = np.linspace(0, 2 * np.pi, columns, endpoint=False)
    ring = [
        (np.sin(h) * np.cos(t), np.sin(h) * np.sin(t), np.cos(h)) for h in heights for t in turns
    ]
    vertices = radius * np.array([(0.0, 0.0, 1.0)] + ring + [(0.0, 0.0, -1.0)])
    last = len(vertices) - 1
    triangles = []
    for k in range(columns):
        n = (k + 1) % columns
        triangles.append((0, 1 + k, 1 + n))
        for r in range(rows - 2):
            a, b = 1 + r * columns, 1 + (r + 1) * columns
            triangles += [(a + k, b + k, b + n), (a + k, b + n, a + n)]
        b = 1 + (rows - 2) * columns
        triangles.append((b + k, last, b + n))
    return vertices, np.array(triangles, dtype=np.int32)


def random_quaternions(generator, count):
    q = generator.normal(size=(count, 4))
    return q / np.linalg.norm(q, axis=1, keepdims=True)


@pytest.fixture
def ball_mesh():
    return dyop.TriangleMesh(*uv_sphere(12, 16))


@pytest.fixture
def generator():
    return np.random.default_rng(20240917)


@pytest.fixture
def all_shapes(ball_mesh, generator):
    hull = dyop.ConvexHull(generator.normal(size=(30, 3)))
    return [
        dyop.Sphere(0.5),
        dyop.Box([1, 2, 3]),
        dyop.Capsule(0.25, 1.5),
        hull,
        ball_mesh,
        dyop.CompoundShape([(dyop.Sphere(0.5), np.eye(4)), (ball_mesh, ((1, 0, 0, 0), (3, 0, 0)))]),
    ]


@pytest.fixture
def all_motions():
    turn = np.sqrt(0.5)
    start = dyop.RigidPose(position=(1, 2, 3))
    end = dyop.RigidPose(quaternion=(turn, 0, turn, 0), position=(2, 0, 1))
    twist = dyop.Twist(v_WB=(1, 0, 0), w_WB=(0, 2, 0))
    steady = dyop.ConstantTwistMotion(start, twist, 0.25)
    controls = [[0, 0, 0, 0, 0, 0], [1, 0, 0, 0, 1, 0], [1, 1, 0, 0, 1, 2]]
    between = dyop.InterpolatedMotion((0, 1), start, end)
    return [
        dyop.RestMotion(end),
        steady,
        dyop.ScrewMotion(start, p_WA=(0, 1, 0), axis_W=(1, 1, 0), turn_rate=2, slide_rate=0.5),
        between,
        dyop.InterpolatedMotion((0, 1), start, end, dyop.RotationPath.RotationVector),
        dyop.HermiteMotion((0, 1), (start, twist), (end, ((0, 1, 0), (1, 0, 0)))),
        dyop.BezierMotion((0, 1), np.eye(4), controls),
        dyop.bspline_motion(2, [0, 0, 0, 1, 1, 1], np.eye(4), controls),
        dyop.SampledMotion([0, 0.5, 1], [start, end, start]),
        dyop.smooth_sampled_motion([0, 0.5, 1], [start, end, start]),
        dyop.ComposedMotion(steady, between),
        dyop.SequenceMotion([((0, 1), between), ((1, 2), dyop.RestMotion(between.pose(1)))]),
    ]


def user_pose(t):
    return (1, 0, 0, 0), (t * t, 0, 0)


def user_twist(t):
    return (2 * t, 0, 0), (0, 0, 0)


def user_bound(interval):
    largest = 2 * max(abs(interval.begin), abs(interval.end))
    return dyop.TwistBound(linear_speed=largest, linear_acceleration=2)


@pytest.fixture
def user_motion():
    """x = t^2."""
    return dyop.UserMotion(user_pose, user_twist, user_bound)


def fields_equal(a, b):
    """Whether two records, or lists of them, hold the same bits."""
    if hasattr(a, "asdict"):
        a, b = a.asdict(), b.asdict()
        return a.keys() == b.keys() and all(fields_equal(a[key], b[key]) for key in a)
    if isinstance(a, (list, tuple)):
        return len(a) == len(b) and all(map(fields_equal, a, b))
    if isinstance(a, np.ndarray):
        return a.dtype == b.dtype and a.tobytes() == b.tobytes()
    return a == b or (a != a and b != b)
