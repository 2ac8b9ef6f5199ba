# SPDX-License-Identifier: BSD-3-Clause
import copy
import pickle

import numpy as np
import pytest

import dyop
from conftest import fields_equal, uv_sphere

PROTOCOLS = range(2, pickle.HIGHEST_PROTOCOL + 1)


def again(thing, protocol=pickle.HIGHEST_PROTOCOL):
    return pickle.loads(pickle.dumps(thing, protocol))


@pytest.mark.parametrize("protocol", PROTOCOLS)
def test_shapes(all_shapes, protocol):
    ball, pose = dyop.Sphere(0.1), dyop.RigidPose(position=(3, 4, 5))
    for shape in all_shapes:
        copied = again(shape, protocol)
        assert type(copied) is type(shape)
        before = dyop.distance(shape, dyop.RigidPose(), ball, pose)
        assert fields_equal(dyop.distance(copied, dyop.RigidPose(), ball, pose), before)


@pytest.mark.parametrize("protocol", PROTOCOLS)
def test_motions(all_motions, user_motion, protocol):
    for motion in [*all_motions, user_motion]:
        copied = again(motion, protocol)
        assert type(copied) is type(motion)
        for t in (0, 0.125, 0.7, 1):
            assert copied.pose(t) == motion.pose(t)
            assert fields_equal(copied.twist(t), motion.twist(t))
        bound = motion.twist_bound((0.25, 0.75))
        assert fields_equal(copied.twist_bound((0.25, 0.75)), bound)


def test_methods_called_by_hand_end_nothing(all_shapes, all_motions):
    things = [*all_shapes, *all_motions, dyop.RigidPose(), dyop.ToiOptions(), dyop.ObstacleSet()]
    for thing in things:
        make, arguments, *state = thing.__reduce__()
        copied = make(*arguments)
        if state:
            copied.__setstate__(state[0])
        assert type(copied) is type(thing)
    for thing in (dyop.World(), dyop.StopSource()):
        with pytest.raises(TypeError, match="cannot pickle"):
            thing.__reduce__()
    with pytest.raises(TypeError, match="another class"):
        dyop.RestMotion().__setstate__(None)
    with pytest.raises(TypeError, match="another class"):
        dyop.Motion.__init__(dyop.RestMotion())


def test_arrays_of_motions():
    points = np.arange(12.0).reshape(4, 3)
    ends = (np.tile([1.0, 0, 0, 0], (4, 1)), points)
    for motions in (
        dyop.constant_twist_motions(np.eye(4), points, -points),
        dyop.interpolated_motions((0, 1), np.eye(4), ends),
    ):
        for copied in (again(motions), copy.deepcopy(motions)):
            assert type(copied) is type(motions) and len(copied) == 4
            for k in range(4):
                assert type(copied[k]) is type(motions[k])
                assert copied[k].pose(0.7) == motions[k].pose(0.7)
            arguments = (dyop.Sphere(1), dyop.RestMotion(), dyop.Sphere(1))
            found = dyop.time_of_impact_batch(*arguments, copied, (0, 1)).tobytes()
            assert found == dyop.time_of_impact_batch(*arguments, motions, (0, 1)).tobytes()


def test_results_and_options(ball_mesh):
    rest = dyop.RestMotion()
    flight = dyop.ConstantTwistMotion(((1, 0, 0, 0), (4, 0, 0)), ((-1, 0, 0), (1, 1, 1)))
    options = dyop.ToiOptions(with_contacts=True, distance_tolerance=1e-5)
    things = [
        dyop.time_of_impact(ball_mesh, rest, ball_mesh, flight, (0, 4), options),
        dyop.distance(ball_mesh, np.eye(4), dyop.Sphere(1), flight.pose(0)),
        dyop.least_distance(ball_mesh, rest, ball_mesh, flight, (0, 1)),
        dyop.point_distance(ball_mesh, np.eye(4), (2, 2, 2)),
        dyop.check_motion(flight, (0, 1), sample_count=10),
        options,
        dyop.DistanceOptions(max_distance=3),
        dyop.Box([1, 2, 3]).compute_mass_properties(2),
        dyop.TimeInterval(1, 2),
        flight.pose(0.3),
    ]
    for thing in things:
        for copied in (again(thing), copy.deepcopy(thing), copy.copy(thing)):
            assert type(copied) is type(thing) and fields_equal(copied, thing), thing
    assert things[0].status == dyop.ToiStatus.Impact and things[0].contacts


def test_large_meshes_go_out_of_band():
    mesh = dyop.TriangleMesh(*uv_sphere(60, 80))
    buffers = []
    data = pickle.dumps(mesh, 5, buffer_callback=buffers.append)
    assert len(data) < 1000 and len(buffers) == 2
    copied = pickle.loads(data, buffers=buffers)
    np.testing.assert_array_equal(copied.vertices, mesh.vertices)


def test_a_stop_source_does_not_pickle():
    with pytest.raises(TypeError):
        pickle.dumps(dyop.ToiOptions(stop=dyop.StopSource()))


@pytest.mark.parametrize("thing", [dyop.World(), dyop.StopSource(), dyop.RigidPose()], ids=type)
def test_old_protocols_are_refused(thing):
    for protocol in (0, 1):
        with pytest.raises(TypeError, match="protocol 2"):
            pickle.dumps(thing, protocol)
