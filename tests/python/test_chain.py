# SPDX-License-Identifier: BSD-3-Clause
"""Chains of links on joint paths: an arm of length 1 that turns in the plane, a ball at its tip."""

import json

import numpy as np
import pytest

import dyop

TURN = dyop.Joint(name="turn", parent="base", child="arm")
REACH = dyop.Joint(
    name="reach", type=dyop.JointType.Fixed, parent="arm", child="tip", X_PJ=((1, 0, 0, 0), (1, 0, 0))
)
LINKS = [dyop.Link(name="base"), dyop.Link(name="arm"), dyop.Link(name="tip", shape=dyop.Sphere(0.1))]


@pytest.fixture
def arm():
    return dyop.KinematicChain(LINKS, [TURN, REACH])


@pytest.fixture
def ball_above():
    obstacles = dyop.ObstacleSet()
    return obstacles, obstacles.add(dyop.Sphere(0.1), ((1, 0, 0, 0), (0, 1, 0)))


def turning(end):
    return dyop.JointPath.linear([0, 1], [[0], [end]])


def test_the_arm_hits_the_ball_when_it_must(arm, ball_above):
    obstacles, ball = ball_above
    result = dyop.certify(arm, turning(np.pi), obstacles)
    # The centres are 2 sin(angle / 2) apart.
    t = (np.pi / 2 - 2 * np.arcsin(0.1)) / np.pi
    assert result.toi.status == dyop.ToiStatus.Impact
    assert result.toi.t_safe <= t == pytest.approx(result.toi.t_safe, abs=1e-5)
    assert (result.link_a, result.link_b, result.obstacle) == (arm.find_link("tip"), None, ball)
    assert result.free_fraction == pytest.approx(t, abs=1e-5)


def test_what_is_left_out_is_not_hit(arm, ball_above):
    obstacles, ball = ball_above
    for free in (
        dyop.certify(arm, turning(1), obstacles),
        dyop.certify(arm, turning(3), obstacles, accepts=lambda id: id != ball),
        dyop.certify(arm, turning(3), obstacles, groups=2),
    ):
        assert free.toi.status == dyop.ToiStatus.Separated and free.free_fraction == 1
        assert free.link_a is None and free.obstacle is None


def test_links_hit_one_another():
    other = dyop.Joint(
        name="hold", type=dyop.JointType.Fixed, parent="base", child="post",
        X_PJ=((1, 0, 0, 0), (0, 1, 0)),
    )
    # Links with none but shapeless ones between them are neighbours.
    base = dyop.Link(name="base", shape=dyop.Sphere(0.05))
    links = [base, *LINKS[1:], dyop.Link(name="post", shape=dyop.Sphere(0.1))]
    joints = [TURN, REACH, other]
    two = dyop.KinematicChain(links, joints)
    assert two.self_pairs == ((2, 3),)
    hit = dyop.certify(two, turning(3), dyop.ObstacleSet())
    assert hit.toi.status == dyop.ToiStatus.Impact and {hit.link_a, hit.link_b} == {2, 3}
    off = dyop.certify(two, turning(3), dyop.ObstacleSet(), with_self_collision=False)
    assert off.toi.status == dyop.ToiStatus.Separated
    ignoring = dyop.KinematicChain(links, joints, ignored_pairs=[("tip", "post")])
    assert ignoring.self_pairs == ()


def test_poses_of_links(arm):
    assert arm.coordinate_count() == 1 and arm.joint_of(0) == 0
    assert [link.name for link in arm.links] == ["base", "arm", "tip"]
    assert arm.joints[1].type == dyop.JointType.Fixed and arm.find_link("hand") is None
    np.testing.assert_allclose(
        arm.link_poses([0.5])[2].translation, [np.cos(0.5), np.sin(0.5), 0], atol=1e-15
    )
    assert [arm.is_fixed(k) for k in range(3)] == [True, False, False]
    with pytest.raises(ValueError, match="no link 3"):
        arm.is_fixed(3)
    motion = dyop.LinkMotion(arm, turning(2), 2)
    np.testing.assert_allclose(
        motion.pose(0.25).translation, arm.link_poses([0.5])[2].translation, atol=1e-15
    )
    np.testing.assert_allclose(np.linalg.norm(motion.twist(0.3).v_WB), 2, atol=1e-14)
    seen_from_arm = dyop.LinkMotion(arm, turning(2), 2, base=1)
    np.testing.assert_allclose(seen_from_arm.pose(0.7).translation, [1, 0, 0], atol=1e-15)
    limited = dyop.KinematicChain(
        LINKS, [dyop.Joint(parent="base", child="arm", lower=-1, upper=1), REACH]
    )
    assert limited.is_within_limits([0.9]) and not limited.is_within_limits([1.1])


def test_paths():
    rows = np.array([[0.0, 1], [2, 3], [1, -1]])
    spline = dyop.JointPath.cubic([0, 1, 3], rows)
    for t, row in zip((0, 1, 3), rows):
        np.testing.assert_allclose(spline.position(t), row, atol=1e-14)
    np.testing.assert_allclose(spline.velocity(0), 0, atol=1e-14)
    hermite = dyop.JointPath.cubic([0, 1, 3], rows, velocities=np.ones((3, 2)))
    np.testing.assert_allclose(hermite.velocity(1), 1, atol=1e-14)
    assert (hermite.degree(), hermite.coordinate_count(), hermite.times()) == (3, 2, [0, 1, 3])
    curve = dyop.JointPath.bspline(2, [0, 0, 0, 1, 1, 1], rows)
    same = dyop.JointPath.bezier([0, 1], rows.T[np.newaxis])
    np.testing.assert_allclose(curve.position(0.5), rows.T @ [0.25, 0.5, 0.25], atol=1e-15)
    np.testing.assert_allclose(same.position(0.5), curve.position(0.5), atol=1e-15)
    assert curve.domain().end == 1


def test_bad_chains_and_paths_are_refused(arm, ball_above):
    with pytest.raises(dyop.InvalidArgument, match="elbow"):
        dyop.KinematicChain(LINKS, [TURN, dyop.Joint(parent="elbow", child="tip")])
    with pytest.raises(dyop.InvalidArgument, match="coordinates"):
        dyop.certify(arm, dyop.JointPath.linear([0, 1], [[0, 0], [1, 1]]), ball_above[0])
    with pytest.raises(dyop.InvalidArgument, match=r"\(N, K\)"):
        dyop.JointPath.linear([0, 1], [0, 1])
    with pytest.raises(dyop.InvalidArgument, match="array"):
        dyop.JointPath.linear([0, 1], [["a"], ["b"]])
    with pytest.raises(dyop.InvalidArgument):
        arm.link_poses([0, 0])
    with pytest.raises(IndexError):
        arm.joint_of(1)


def test_a_chain_from_a_file(tmp_path, arm, ball_above):
    ball = {"shape": {"sphere": {"radius": 0.1}}}
    (tmp_path / "arm.json").write_text(json.dumps({
        "links": [{"name": "base"}, {"name": "arm"}, {"name": "tip", "shapes": [ball]}],
        "joints": [
            {"name": "turn", "type": "revolute", "parent": "base", "child": "arm"},
            {"name": "reach", "type": "fixed", "parent": "arm", "child": "tip",
             "origin": {"position": [1, 0, 0]}},
        ],
    }))
    loaded = dyop.load_chain(tmp_path / "arm.json")
    here, there = (dyop.certify(c, turning(3), ball_above[0]) for c in (arm, loaded))
    assert there.toi.t_safe == pytest.approx(here.toi.t_safe, abs=1e-6)
    with pytest.raises(dyop.FileError, match="nothing.json"):
        dyop.load_chain(tmp_path / "nothing.json")
