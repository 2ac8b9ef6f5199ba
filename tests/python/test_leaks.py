# SPDX-License-Identifier: BSD-3-Clause
"""A thousand rounds of making and dropping everything leave nothing behind."""

import gc
import pickle

import numpy as np
import pytest

import dyop
from conftest import uv_sphere

VERTICES, TRIANGLES = uv_sphere(12, 16)


def resident_bytes():
    with open("/proc/self/statm") as file:
        return int(file.read().split()[1]) * 4096


def shapes_and_queries():
    mesh = dyop.TriangleMesh(VERTICES, TRIANGLES)
    moved = mesh.with_vertices(VERTICES * 1.1)
    compound = dyop.CompoundShape([(mesh, np.eye(4)), (dyop.Box([1, 2, 3]), np.eye(4))])
    hull = dyop.ConvexHull(VERTICES)
    flight = dyop.ConstantTwistMotion(((1, 0, 0, 0), (5, 0, 0)), ((-2, 0, 0), (0, 1, 1)))
    result = dyop.time_of_impact(compound, dyop.RestMotion(), hull, flight, (0, 2))
    return moved.vertices, result.contact, pickle.loads(pickle.dumps([mesh, flight, result]))


def batches():
    mesh = dyop.TriangleMesh(VERTICES, TRIANGLES)
    poses = (np.tile([1.0, 0, 0, 0], (20, 1)), np.full((20, 3), 4.0))
    motions = dyop.constant_twist_motions(poses, -np.ones((20, 3)), np.ones((20, 3)))
    rows = dyop.time_of_impact_batch(
        mesh, dyop.RestMotion(), mesh, motions, progress=lambda done, total: None, thread_count=2
    )
    return motions[3], rows


def functions_and_errors():
    state = {"big": bytes(100_000)}
    motion = dyop.UserMotion(
        lambda t: ((1, 0, 0, 0), (t, 0, 0)),
        lambda t: ((1, 0, 0), (0, 0, 0)) if state else None,
        lambda interval: (1, 0, 0, 0),
    )
    wall = dyop.RestMotion(((1, 0, 0, 0), (3, 0, 0)))
    dyop.time_of_impact_batch(dyop.Sphere(1), [motion] * 4, dyop.Sphere(1), wall, thread_count=2)
    for bad in (lambda: dyop.Sphere(-1), lambda: dyop.RestMotion("here"), lambda: motion.pose("x")):
        with pytest.raises((dyop.InvalidArgument, TypeError)):
            bad()


def worlds():
    data = bytes(100_000)
    world = dyop.World(dyop.WorldOptions(gravity_W=(0, 0, -9.81), max_step=0.05, thread_count=2))
    shape = dyop.TriangleMesh(VERTICES, TRIANGLES)
    body = world.add_body(
        name="ball", shape=shape, mass_properties=shape.compute_mass_properties(1), user_data=data,
        wrench=lambda t, state: ((len(data), 0, 0), (0, 0, 0)),
    )
    apart = dyop.MotionState(X_WB=((1, 0, 0, 0), (9, 0, 0)))
    world.add_body(
        name="other", shape=shape, mass_properties=shape.compute_mass_properties(1), initial=apart
    )  # two to step: two threads
    world.add_spring(a=body, b=world.bodies()[1], stiffness=1)
    kept = world.snapshot()
    report = world.advance(0.1)
    world.restore(kept)
    return report.steps, world.state(body), world.pairs(), pickle.dumps(report)


@pytest.mark.parametrize("once", [shapes_and_queries, batches, functions_and_errors, worlds])
def test_rounds_leave_nothing(once):
    for _ in range(200):
        once()
    gc.collect()
    objects, before = len(gc.get_objects()), resident_bytes()
    for _ in range(1000):
        once()
    gc.collect()
    assert len(gc.get_objects()) - objects < 100
    # A mesh of a round alone takes 200 kB.
    assert resident_bytes() - before < 8_000_000
