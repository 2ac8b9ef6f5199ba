# SPDX-License-Identifier: BSD-3-Clause
import numpy as np
import pytest

import dyop


def test_pose_is_taken_as_matrix_pair_or_object():
    turn = np.sqrt(0.5)
    expected = np.array([[0, 0, 1, 4], [0, 1, 0, 5], [-1, 0, 0, 6], [0, 0, 0, 1]], dtype=float)
    pair = ((turn, 0, turn, 0), (4, 5, 6))
    for offered in (expected, pair, expected.tolist(), dyop.RigidPose(pair)):
        pose = dyop.RestMotion(offered).pose(0)
        np.testing.assert_allclose(pose.matrix, expected, atol=1e-15)
    np.testing.assert_allclose(dyop.RigidPose(expected).quaternion, pair[0], atol=1e-15)
    np.testing.assert_array_equal(np.asarray(dyop.RigidPose(pair)), dyop.RigidPose(pair).matrix)


def test_products_and_inverses_are_those_of_matrices():
    a = dyop.RigidPose(quaternion=(0.5, 0.5, 0.5, 0.5), position=(1, 2, 3))
    b = dyop.RigidPose(quaternion=(0, 1, 0, 0), position=(-1, 0, 2))
    np.testing.assert_allclose((a * b).matrix, a.matrix @ b.matrix, atol=1e-15)
    np.testing.assert_allclose(a.inverse().matrix, np.linalg.inv(a.matrix), atol=1e-15)
    points = np.arange(12.0).reshape(4, 3)
    expected = points @ a.rotation.T + a.translation
    np.testing.assert_allclose(a.transform(points), expected, atol=1e-14)
    np.testing.assert_allclose(a.transform(points[1]), expected[1], atol=1e-14)


def test_rotation_vectors_go_both_ways():
    w = np.array([0.3, -0.4, 1.2])
    rotation = dyop.rotation_from_vector(w)
    np.testing.assert_allclose(rotation @ w, w, atol=1e-15)
    np.testing.assert_allclose(dyop.rotation_vector(rotation), w, atol=1e-14)


@pytest.mark.parametrize(
    "bad, said",
    [
        (np.zeros((3, 4)), r"shape \(3, 4\)"),
        (np.diag([1.0, 1, 2, 1]), "orthonormal"),
        (np.diag([1.0, 1, -1, 1]), "mirror"),
        (np.diag([1.0, 1, 1, 2]), "last row"),
        (((1, 1, 0, 0), (0, 0, 0)), "norm"),
        (((1, 0, 0, 0), (np.nan, 0, 0)), "finite"),
        ("pose", "type str"),
        (np.eye(4) + 0j, "complex128"),
    ],
)
def test_a_bad_pose_is_refused_with_its_reason(bad, said):
    with pytest.raises(dyop.InvalidArgument, match=said):
        dyop.RestMotion(bad)


def test_an_interval_is_a_pair():
    interval = dyop.TimeInterval(1, 3)
    assert tuple(interval) == (1, 3)
    assert interval.length() == 2 and interval.contains(2) and not interval.contains(4)
    assert interval == dyop.TimeInterval(1, 3)


def test_rotations_of_others_make_poses():
    rotation = pytest.importorskip("scipy.spatial.transform").Rotation
    turn = rotation.from_euler("xyz", [0.3, -0.2, 1.1])
    xyzw, matrix = turn.as_quat(), turn.as_matrix()
    p = (1.0, 2.0, 3.0)
    wanted = np.eye(4)
    wanted[:3, :3], wanted[:3, 3] = matrix, p
    for pose in (
        dyop.RigidPose((turn, p)),
        dyop.RigidPose((matrix, p)),
        dyop.RigidPose(rotation=turn, position=p),
        dyop.RigidPose(rotation=matrix, position=p),
        dyop.RigidPose.from_xyzw(xyzw, p),
        dyop.RigidPose(quaternion=xyzw[[3, 0, 1, 2]], position=p),
        dyop.RestMotion((turn, p)).pose(0),
    ):
        np.testing.assert_allclose(pose.matrix, wanted, atol=1e-15)
    for pose in (dyop.RigidPose(turn), dyop.RigidPose(matrix), dyop.RestMotion(turn).pose(0)):
        np.testing.assert_allclose(pose.matrix[:3, :3], matrix, atol=1e-15)
        np.testing.assert_array_equal(pose.translation, 0)
    rows = dyop.distance_batch(dyop.Sphere(1), np.eye(4), dyop.Sphere(1), [(turn, p), (matrix, p)])
    assert rows["lower"][0] == rows["lower"][1] > 0
    with pytest.raises(dyop.InvalidArgument, match="not both"):
        dyop.RigidPose(rotation=turn, quaternion=(1, 0, 0, 0))
    with pytest.raises(dyop.InvalidArgument, match="rotation"):
        dyop.RigidPose((np.eye(2), p))
    with pytest.raises(dyop.InvalidArgument):
        dyop.RigidPose(2 * np.eye(3))
    for bad in ((1, 0, 0), (0, 0, 0, 2), "abcd"):
        with pytest.raises((dyop.InvalidArgument, TypeError)):
            dyop.RigidPose.from_xyzw(bad)


def test_a_pose_times_points_transforms_them():
    pose = dyop.RigidPose(quaternion=(0.5, 0.5, 0.5, 0.5), position=(1, 2, 3))  # x to y to z to x
    np.testing.assert_allclose(pose * (1, 0, 0), (1, 3, 3), atol=1e-15)
    np.testing.assert_allclose(pose * np.eye(3), pose.transform(np.eye(3)), atol=0)
    assert pose * dyop.RigidPose() == pose
    with pytest.raises(dyop.InvalidArgument, match="points"):
        pose * np.eye(4)


def test_enums_can_be_looped_over():
    assert [status.name for status in dyop.FeatureKind] == ["Vertex", "Edge", "Face", "Smooth"]
    assert len(dyop.FeatureKind) == 4 and dyop.FeatureKind.Edge in list(dyop.FeatureKind)
    assert dyop.FeatureKind(1) == dyop.FeatureKind.Edge


def test_a_repr_fills_one_screen_at_most():
    ball = dyop.Sphere(1)
    many = dyop.AdvanceReport(impacts=[dyop.ImpactEvent()] * 500)
    assert "of 500" in repr(many)
    for value in (many, dyop.WorldOptions(), dyop.ToiResult(), dyop.RunHeader(scene="{}" * 10**6)):
        assert len(repr(value)) < 2000 and repr(value).count("\n") < 40
    assert repr(dyop.ConstantTwistMotion(dyop.RigidPose(), ((1, 0, 0), (0, 0, 0)))).startswith(
        "ConstantTwistMotion(domain="
    )
    world = dyop.World()
    world.add_body(
        name="b", shape=ball, mass_properties=ball.compute_mass_properties(1)
    )
    assert repr(world) == "World(1 bodies, t=0.0)"
