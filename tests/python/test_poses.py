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
