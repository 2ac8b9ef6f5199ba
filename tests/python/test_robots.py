# SPDX-License-Identifier: BSD-3-Clause
"""Robots from files: what is read, which links can touch, and whether paths are free."""

import json
import os
import pickle
from pathlib import Path

import numpy as np
import pytest

import dyop
from conftest import fields_equal
from dyop._view import _robot_bodies

BOX = '<collision><geometry><box size="0.2 0.2 0.2"/></geometry></collision>'
ROBOT = f"""<robot name="reacher">
  <link name="base">{BOX}<inertial><mass value="2"/><inertia ixx="1" iyy="1" izz="1" ixy="0"
    ixz="0" iyz="0"/></inertial></link>
  <link name="arm"/>
  <link name="hand">{BOX}</link>
  <link name="finger"><collision><geometry><cylinder radius="0.05" length="0.1"/></geometry>
    </collision></link>
  <joint name="turn" type="revolute"><parent link="base"/><child link="arm"/>
    <axis xyz="0 0 1"/><limit lower="-3" upper="3"/></joint>
  <joint name="reach" type="prismatic"><parent link="arm"/><child link="hand"/>
    <origin xyz="0.5 0 0"/><axis xyz="1 0 0"/><limit lower="-0.4" upper="0.5"/></joint>
  <joint name="grip" type="prismatic"><parent link="hand"/><child link="finger"/>
    <origin xyz="0.5 0 0"/><axis xyz="1 0 0"/><limit lower="-1" upper="1"/>
    <mimic joint="reach" multiplier="0.5" offset="0.1"/></joint>
</robot>"""
SRDF = """<robot name="reacher">
  <group name="all"><joint name="turn"/></group>
  <disable_collisions link1="base" link2="hand" reason="Never"/>
  <disable_collisions link1="hand" link2="finger" reason="User"/>
</robot>"""


@pytest.fixture
def robot(tmp_path):
    (tmp_path / "r.urdf").write_text(ROBOT)
    (tmp_path / "r.srdf").write_text(SRDF)
    return dyop.load_robot(tmp_path / "r.urdf", srdf=tmp_path / "r.srdf")


@pytest.fixture
def wall():
    """A ball that the hand meets where it is turned by 90 degrees."""
    obstacles = dyop.ObstacleSet()
    return obstacles, obstacles.add(dyop.Sphere(0.1), ((1, 0, 0, 0), (0, 0.5, 0)))


def turning(end, reach=0.0):
    return dyop.JointPath.linear([0, 1], [[0, reach], [end, reach]])


def test_what_a_robot_is(robot):
    assert robot.name == "reacher" and "4 links" in repr(robot)
    assert [link.name for link in robot.links] == ["base", "arm", "hand", "finger"]
    assert [robot.joints[k].name for k in robot.free_joints] == ["turn", "reach"]
    assert robot.free_count() == 2 and robot.chain.coordinate_count() == 3
    np.testing.assert_array_equal(robot.lower, [-3, -0.4])
    np.testing.assert_array_equal(robot.upper, [3, 0.5])
    assert robot.masses == (2, 0, 0, 0)
    assert robot.links[1].shape is None
    grip = robot.couplings[2]
    assert (grip.free, grip.multiplier, grip.offset) == (1, 0.5, 0.1)
    assert [(p.first, p.second, p.reason) for p in robot.disabled_pairs][1] == (
        "hand", "finger", "User",
    )
    assert robot.groups[0].name == "all" and robot.groups[0].joints == ("turn",)
    # The claim `Never` is checked; what the user wishes is left out.
    pairs = [(robot.links[a].name, robot.links[b].name) for a, b in robot.chain.self_pairs]
    assert ("hand", "finger") not in pairs and ("base", "finger") in pairs


def test_limits_of_a_joint_that_mimics_hold_what_it_mimics(tmp_path):
    mimic = '<limit lower="0.1" upper="0.2"/><mimic joint="reach" multiplier="0.5" offset="0.1"/></joint>'
    start = ROBOT.rindex("<limit")
    (tmp_path / "r.urdf").write_text(ROBOT[:start] + mimic + "</robot>")
    robot = dyop.load_robot(tmp_path / "r.urdf")
    np.testing.assert_array_equal(robot.lower, [-3, 0])
    np.testing.assert_allclose(robot.upper, [3, 0.2])
    assert robot.is_within_limits(robot.upper) and not robot.is_within_limits(robot.upper + 1e-9)
    for pair in dyop.decide_link_pairs(robot):
        assert pair.witness is None or robot.is_within_limits(pair.witness)


def test_free_coordinates_and_those_that_mimic(robot):
    np.testing.assert_allclose(robot.expand([1, 0.2]), [1, 0.2, 0.2])
    np.testing.assert_allclose(robot.expand_rates([1, 2]), [1, 2, 1])
    path = dyop.JointPath.cubic([0, 1, 3], [[0, 0], [1, 0.4], [2, -0.2]])
    whole = robot.expand(path)
    np.testing.assert_allclose(whole.position(0.7), robot.expand(path.position(0.7)), atol=1e-15)
    poses = robot.link_poses([np.pi / 2, 0.2])
    np.testing.assert_allclose(poses[2].translation, [0, 0.7, 0], atol=1e-15)
    np.testing.assert_allclose(poses[3].translation, [0, 1.4, 0], atol=1e-15)
    assert robot.is_within_limits([1, 0.4]) and not robot.is_within_limits([1, 0.6])
    with pytest.raises(dyop.InvalidArgument, match="2 free coordinates, not 3"):
        robot.expand([1, 2, 3])


def test_the_table_of_pairs_is_proven(robot):
    reports = {(robot.links[r.first].name, robot.links[r.second].name): r
               for r in dyop.decide_link_pairs(robot)}
    assert set(reports) == {("base", "hand"), ("base", "finger"), ("hand", "finger")}
    touching = reports["base", "hand"]
    assert touching.verdict == dyop.PairVerdict.Can and robot.is_within_limits(touching.witness)
    # At the witness the boxes do overlap: plain arithmetic on the poses.
    base, hand = (robot.link_poses(touching.witness)[k].translation for k in (0, 2))
    assert np.linalg.norm(hand - base) <= 0.2 * np.sqrt(2)
    assert reports["base", "finger"].verdict == dyop.PairVerdict.Never
    assert reports["base", "finger"].witness is None
    random = np.random.default_rng(1)
    for q in random.uniform(robot.lower, robot.upper, size=(300, 2)):
        poses = robot.link_poses(q)
        apart = dyop.distance(robot.links[0].shape, poses[0], robot.links[3].shape, poses[3])
        assert apart.lower > 0
    only = dyop.decide_link_pairs(robot, only=[("finger", "base")])
    assert len(only) == 1 and only[0].joints == 2
    text = dyop.srdf_text(robot, list(reports.values()))
    assert 'link1="base" link2="finger" reason="Never"' in text


def test_the_table_reports_progress_and_stops(robot):
    calls = []
    dyop.decide_link_pairs(robot, progress=lambda done, total: calls.append((done, total)))
    assert calls[-1] == (3, 3)
    stop = dyop.StopSource()
    stop.request_stop()
    for report in (*dyop.decide_link_pairs(robot, stop=stop),
                   *dyop.decide_link_pairs(robot, deadline=0)):
        assert report.verdict == dyop.PairVerdict.Undecided and report.undecided_share == 1

    def fail(done, total):
        raise KeyError("no")

    with pytest.raises(KeyError, match="no"):
        dyop.decide_link_pairs(robot, progress=fail)
    with pytest.raises(dyop.InvalidArgument, match="elbow"):
        dyop.decide_link_pairs(robot, only=[("elbow", "base")])
    with pytest.raises(dyop.InvalidArgument, match="max_boxes"):
        dyop.decide_link_pairs(robot, max_boxes=0)


def test_a_robot_is_certified_on_free_coordinates(robot, wall):
    obstacles, ball = wall
    hit = dyop.certify(robot, turning(3), obstacles)
    assert hit.toi.status == dyop.ToiStatus.Impact
    assert robot.links[hit.link_a].name == "hand" and hit.obstacle == ball
    same = dyop.certify(robot.chain, robot.expand(turning(3)), obstacles)
    assert fields_equal(hit, same)
    assert dyop.certify(robot, turning(0.5), obstacles).toi.status == dyop.ToiStatus.Separated
    with pytest.raises(dyop.InvalidArgument, match="free coordinates"):
        dyop.certify(robot, robot.expand(turning(3)), obstacles)
    with pytest.raises(TypeError):
        dyop.certify("robot", turning(3), obstacles)


def test_a_held_object_is_carried_along(robot, wall):
    held = dyop.Link(name="stick", shape=dyop.Sphere(0.05))
    holding = robot.attach(held, "hand", ((1, 0, 0, 0), (0, 0.3, 0)), touch_links=["finger"])
    assert [link.name for link in holding.links][-1] == "stick" and len(robot.links) == 4
    before = dyop.certify(robot, turning(3), wall[0])
    after = dyop.certify(holding, turning(3), wall[0])
    assert after.link_a == 4 and after.toi.t_safe < before.toi.t_safe
    table = dyop.decide_link_pairs(holding, only=[("base", "stick")])
    assert table[0].verdict in (dyop.PairVerdict.Never, dyop.PairVerdict.Can)
    with pytest.raises(dyop.InvalidArgument, match="wrist"):
        robot.attach(held, "wrist")


def test_many_paths_at_once(robot, wall):
    random = np.random.default_rng(2)
    paths = [
        dyop.JointPath.linear([0, 1], random.uniform(robot.lower, robot.upper, size=(2, 2)))
        for _ in range(40)
    ]
    rows = dyop.certify_batch(robot, paths, wall[0], thread_count=1)
    assert rows.dtype == dyop.chain_row
    for row, path in zip(rows, paths):
        single = dyop.certify(robot, path, wall[0])
        assert row["status"] == int(single.toi.status) and row["t_safe"] == single.toi.t_safe
        assert row["link_a"] == (-1 if single.link_a is None else single.link_a)
        assert row["link_b"] == (-1 if single.link_b is None else single.link_b)
        assert row["obstacle"] == (-1 if single.obstacle is None else single.obstacle)
        assert row["free_fraction"] == single.free_fraction
    statuses = set(rows["status"])
    assert {int(dyop.ToiStatus.Impact), int(dyop.ToiStatus.Separated)} <= statuses
    assert dyop.certify_batch(robot, paths, wall[0]).tobytes() == rows.tobytes()
    out = np.empty(40, dyop.chain_row)
    assert dyop.certify_batch(robot, tuple(paths), wall[0], out=out) is out
    assert out.tobytes() == rows.tobytes()
    assert dyop.certify_batch(robot, [], wall[0]).shape == (0,)
    with pytest.raises(dyop.InvalidArgument, match=r"paths\[1\]"):
        dyop.certify_batch(robot, [paths[0], 3], wall[0])
    with pytest.raises(dyop.InvalidArgument, match="path 0"):
        dyop.certify_batch(robot.chain, paths, wall[0])


def test_a_batch_calls_the_filter_and_can_be_stopped(robot, wall):
    paths = [turning(3)] * 5
    free = dyop.certify_batch(robot, paths, wall[0], accepts=lambda id: id != wall[1])
    assert (free["status"] == int(dyop.ToiStatus.Separated)).all()
    stop = dyop.StopSource()
    stop.request_stop()
    stopped = dyop.certify_batch(robot, paths, wall[0], stop=stop)
    assert (stopped["status"] == int(dyop.ToiStatus.NotRun)).all()

    def refuse(id):
        raise KeyError("not this one")

    with pytest.raises(KeyError, match="not this one"):
        dyop.certify_batch(robot, paths, wall[0], accepts=refuse)


def test_paths_from_files(robot, tmp_path):
    (tmp_path / "p.csv").write_text("time,reach,turn\n0,0.1,0\n2,0.2,1\n")
    path = dyop.load_joint_path(tmp_path / "p.csv", robot)
    np.testing.assert_allclose(path.position(1), [0.5, 0.15])
    (tmp_path / "p.json").write_text(json.dumps({
        "joint_names": ["turn", "reach"],
        "points": [{"positions": [0, 0.1], "time_from_start": 0},
                   {"positions": [1, 0.2], "time_from_start": 2}],
    }))
    cubic = dyop.load_joint_path(tmp_path / "p.json", robot, dyop.PathInterpolation.Cubic)
    assert cubic.degree() == 3
    np.testing.assert_allclose(cubic.position(1), [0.5, 0.15])


def test_bad_files_are_named(tmp_path):
    (tmp_path / "bad.urdf").write_text('<robot name="x"><link name="a"/><link name="a"/></robot>')
    with pytest.raises(dyop.FileError, match="bad.urdf"):
        dyop.load_robot(tmp_path / "bad.urdf")
    with pytest.raises(dyop.FileError, match="none.urdf"):
        dyop.load_robot(tmp_path / "none.urdf")


def test_a_model_of_mujoco(tmp_path):
    (tmp_path / "m.xml").write_text("""<mujoco model="post"><worldbody>
      <geom name="floor" type="plane" size="0 0 1"/>
      <body name="post" pos="0 0 0.5"><joint name="turn" axis="0 1 0" range="-90 90"/>
        <geom type="capsule" size="0.1 0.3"/></body></worldbody></mujoco>""")
    robot = dyop.load_robot(tmp_path / "m.xml")
    again = pickle.loads(pickle.dumps(robot))
    for each in (robot, again):
        assert each.chain.checked_pairs == (("floor", "post"),)
        (pair,) = dyop.decide_link_pairs(each)
        assert pair.verdict == dyop.PairVerdict.Never
    path = dyop.JointPath.linear([0, 1], [[-1.0], [1.0]])
    floor, post = _robot_bodies(robot, path)
    assert isinstance(floor[2], dyop.RigidPose)  # what rests is drawn as ground
    assert isinstance(post[2], dyop.LinkMotion)


def test_a_moving_base(tmp_path):
    (tmp_path / "r.urdf").write_text(ROBOT)
    fixed, planar, floating = (
        dyop.load_robot(tmp_path / "r.urdf", base=base).free_count()
        for base in (dyop.RobotBase.Fixed, dyop.RobotBase.Planar, dyop.RobotBase.Floating)
    )
    assert (fixed, planar, floating) == (2, 5, 8)


def test_robots_chains_paths_and_obstacles_pickle(robot, wall):
    obstacles, ball = wall
    gone = obstacles.add(dyop.Sphere(1), ((1, 0, 0, 0), (9, 9, 9)))
    moving = obstacles.add(dyop.Box([0.1, 0.1, 0.1]), dyop.LinkMotion(robot.chain, robot.expand(
        turning(1, 0.4)), 3), groups=6)
    obstacles.remove(gone)
    path = dyop.JointPath.cubic([0, 0.3, 1], [[0, 0], [1, 0.1], [3, 0.3]])
    before = dyop.certify(robot, path, obstacles)
    for protocol in range(2, pickle.HIGHEST_PROTOCOL + 1):
        again, path_again, set_again = pickle.loads(
            pickle.dumps((robot, path, obstacles), protocol)
        )
        assert fields_equal(dyop.certify(again, path_again, set_again), before)
        assert set_again.ids() == [ball, moving] == obstacles.ids()
        assert set_again.obstacle(moving).groups == 6
        np.testing.assert_array_equal(path_again.controls(), path.controls())
        assert again.notes == robot.notes and fields_equal(again.groups, robot.groups)
        assert fields_equal(again.couplings, robot.couplings)
        assert again.chain.ignored_pairs == robot.chain.ignored_pairs
        assert fields_equal(
            dyop.decide_link_pairs(again), dyop.decide_link_pairs(robot)
        )
    added = set_again.add(dyop.Sphere(1))
    assert added not in (ball, moving)


def test_more_of_paths_and_chains(robot):
    path = dyop.JointPath.cubic([0, 1, 3], [[0, 0], [1, 0.4], [2, -0.2]])
    controls = path.controls()
    assert controls.shape == (2, 2, 4)
    np.testing.assert_allclose(controls[0, :, -1], controls[1, :, 0])
    speed, acceleration = path.bound(0, (0, 0.5))
    times = np.linspace(0, 0.5, 100)
    assert speed >= max(abs(path.velocity(t)[0]) for t in times) and np.isfinite(acceleration)
    assert path.bound(0)[1] == np.inf or path.bound(0)[0] >= speed
    assert path.largest_value(1) >= 0.4
    assert robot.chain.are_neighbours(0, 2) and not robot.chain.are_neighbours(0, 3)
    assert robot.chain.ignored_pairs == (("hand", "finger"),)
    for bad in (lambda: path.bound(0, (-1, 1)), lambda: path.bound(0, (0, np.nan))):
        with pytest.raises(dyop.InvalidArgument, match="domain"):
            bad()
    for bad in (lambda: path.bound(2), lambda: path.largest_value(2),
                lambda: robot.chain.are_neighbours(0, 9)):
        with pytest.raises(IndexError):
            bad()


@pytest.mark.skipif("DYOP_EXTERNAL_DATA" not in os.environ, reason="needs DYOP_EXTERNAL_DATA")
def test_a_public_robot():
    folder = Path(os.environ["DYOP_EXTERNAL_DATA"]) / "robots" / "ur5"
    robot = dyop.load_robot(folder / "ur5.urdf", srdf=folder / "ur5.srdf")
    names = [link.name for link in robot.links]
    claims = [(p.first, p.second) for p in robot.disabled_pairs if p.reason == "Never"]
    reports = dyop.decide_link_pairs(robot, only=[c for c in claims if set(c) <= set(names)])
    assert len(reports) == 62
    assert all(r.verdict == dyop.PairVerdict.Never for r in reports)
