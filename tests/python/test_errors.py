# SPDX-License-Identifier: BSD-3-Clause
"""Every mistake ends in an exception of the right kind that says what is wrong."""

import _thread
import os
import threading
import time

import numpy as np
import pytest

import dyop
import fuzz_calls
from conftest import uv_sphere

LOADERS = [dyop.load_scene, dyop.load_mesh, dyop.load_chain, dyop.load_robot, dyop.QueryRecord]
if hasattr(dyop, "RecordingReader"):
    LOADERS.append(dyop.RecordingReader)


@pytest.mark.parametrize("load", LOADERS, ids=lambda load: load.__name__)
def test_a_missing_file_is_one_of_pythons_own_errors(load, tmp_path):
    with pytest.raises(FileNotFoundError, match="nothing.obj") as caught:
        load(tmp_path / "nothing.obj")
    error = caught.value
    assert isinstance(error, dyop.FileError) and isinstance(error, dyop.Error)
    assert error.file == str(tmp_path / "nothing.obj") and error.line is None
    assert type(error) is dyop.MissingFile and error.errno == 2


@pytest.mark.parametrize("load", LOADERS, ids=lambda load: load.__name__)
def test_a_binary_file_is_a_file_error(load, tmp_path):
    generator = np.random.default_rng(4)
    for number in range(20):
        for end in ("json", "obj", "urdf", "stl"):
            file = tmp_path / f"{number}.{end}"
            file.write_bytes(generator.bytes(400))
            with pytest.raises(dyop.FileError) as caught:
                load(file)
            assert not isinstance(caught.value, FileNotFoundError)
            assert str(caught.value)


def test_names_of_files_may_be_any_bytes(tmp_path):
    name = os.path.join(os.fsencode(tmp_path), b"\xff\xfe.obj")
    with open(name, "wb") as file:
        file.write(b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
    assert len(dyop.load_mesh(name).triangles) == 1
    assert len(dyop.load_mesh(os.fsdecode(name)).triangles) == 1
    with pytest.raises(dyop.MissingFile) as caught:
        dyop.load_mesh(name + b"x")
    assert os.fsencode(caught.value.file) == name + b"x"
    with pytest.raises(dyop.InvalidArgument, match="zero byte"):
        dyop.load_mesh("a\0b")
    with pytest.raises(TypeError):
        dyop.load_mesh(3)


def message(call):
    with pytest.raises(TypeError) as caught:
        call()
    text = str(caught.value)
    assert "\n" not in text and "incompatible" not in text
    return text


def test_a_call_says_which_argument_does_not_fit():
    ball, pose = dyop.Sphere(1), dyop.RigidPose()
    assert message(lambda: dyop.distance(ball, pose, "ball", pose)) == (
        "distance(): argument 'b' must be Shape, not a value of type str"
    )
    assert message(lambda: dyop.distance(ball, pose, ball)) == (
        "distance(): argument 'X_WB' is missing"
    )
    assert "'colour'" in message(lambda: dyop.distance(ball, pose, ball, pose, colour=1))
    assert "given twice" in message(lambda: dyop.distance(ball, pose, ball, pose, b=ball))
    assert "too many" in message(lambda: dyop.distance(ball, pose, ball, pose, None, None, 3))
    assert message(lambda: dyop.Sphere("1")) == (
        "Sphere(): argument 'radius' must be a number, not a value of type str"
    )
    assert message(lambda: ball.support()) == "support(): argument 'unit_direction' is missing"
    assert "out of range: -1" in message(lambda: dyop.BodyId(-1))
    paths = [dyop.JointPath.linear([0, 1], [[0], [1]])]
    assert "'chain' must be Union[KinematicChain, Robot]" in message(
        lambda: dyop.certify_batch(ball, paths, dyop.ObstacleSet())
    )
    robot = dyop.make_robot("r", dyop.KinematicChain([dyop.Link(name="a")], []))
    assert "; or: " in message(lambda: robot.expand())
    assert "'only' must be List[Tuple[str, str]]" in message(
        lambda: dyop.decide_link_pairs(robot, only=[1])
    )
    # Of several forms only those of which most fits are told.
    rest = dyop.RestMotion()
    assert message(lambda: dyop.time_of_impact(ball, rest, ball, 3, (0, 1))) == (
        "time_of_impact(): argument 'X_WB' must be Motion, not a value of type int"
    )
    assert "Shape, not a value of type int; or: argument 'a' must be DeformingMesh" in message(
        lambda: dyop.time_of_impact(3, rest, ball, rest, (0, 1))
    )
    assert message(lambda: dyop.Twist((0, 0, 1), (0, 0, 0))) == (
        "Twist(): its fields are given by name: v_WB, w_WB"
    )
    assert message(lambda: dyop.Twist(v=(0, 0, 1))) == "there is no field 'v'; there are v_WB, w_WB"
    # Nothing but the message is another one.
    np.testing.assert_array_equal(robot.expand([]), [])


def test_a_function_that_returns_the_wrong_thing_is_named():
    motion = dyop.UserMotion(
        lambda t: dyop.RigidPose(), lambda t: ((0, 0, 0), (0, 0, 0)), lambda interval: "fast"
    )
    with pytest.raises(TypeError, match="twist_bound must return .* not a value of type str"):
        motion.twist_bound((0, 1))
    obstacles = dyop.ObstacleSet()
    obstacles.add(dyop.Sphere(1))
    with pytest.raises(TypeError, match="must return a bool"):
        obstacles.nearest(dyop.Sphere(1), np.eye(4), accepts=lambda id: "no")
    with pytest.raises(TypeError, match="definition must be a BodyDefinition"):
        dyop.World().add_body(dyop.Sphere(1))
    with pytest.raises(TypeError, match="deadline"):
        dyop.ToiOptions(deadline="soon")


def test_values_can_be_compared_with_anything():
    for value in (dyop.RigidPose(), dyop.TimeInterval(), dyop.BodyId(0), dyop.ToiStatus.Impact):
        assert value != "x" and not value == "x" and value == value


def test_records_compare_by_value():
    first, second = dyop.ToiOptions(target_distance=0.5), dyop.ToiOptions(target_distance=0.5)
    assert first == second and not first != second
    second.with_contacts = True
    assert first != second
    assert dyop.Twist(v_WB=(1, 2, 3)) == dyop.Twist(v_WB=(1, 2, 3)) != dyop.Twist()
    assert dyop.Twist() != dyop.Wrench() and dyop.Twist() != ((0, 0, 0), (0, 0, 0))
    result = dyop.distance(BALL, HERE, BALL, dyop.RigidPose(position=(4, 0, 0)))
    assert result == dyop.distance(BALL, HERE, BALL, dyop.RigidPose(position=(4, 0, 0)))
    assert result != dyop.distance(BALL, HERE, BALL, dyop.RigidPose(position=(5, 0, 0)))
    scene = dyop.Link(name="a"), dyop.Link(name="b")
    assert scene == (dyop.Link(name="a"), dyop.Link(name="b"))
    with pytest.raises(TypeError, match="unhashable"):
        hash(first)


@pytest.mark.parametrize("kind", [dyop.ConvexHull, dyop.World, dyop.ToiOptions, dyop.Motion])
def test_what_was_never_made_is_refused(kind):
    with pytest.raises(TypeError, match="__init__"):
        repr(kind.__new__(kind))
    shape = dyop.ConvexHull.__new__(dyop.ConvexHull)
    with pytest.raises(TypeError, match="__init__"):
        dyop.distance(shape, HERE, BALL, HERE)


def test_reports_of_links_that_are_none_are_refused():
    robot = dyop.make_robot("r", dyop.KinematicChain([dyop.Link(name="a")], []))
    with pytest.raises(dyop.InvalidArgument, match="link 7"):
        dyop.srdf_text(robot, [dyop.LinkPairReport(first=0, second=7)])


def test_find_contacts_has_a_budget_and_obeys_ctrl_c():
    ball = dyop.TriangleMesh(*uv_sphere(40, 60))
    beside = dyop.RigidPose(position=(2.01, 0, 0))
    near = dyop.find_contacts(ball, dyop.RigidPose(), ball, beside, 0.05)
    same = dyop.find_contacts(
        ball, dyop.RigidPose(), ball, beside, 0.05, max_triangle_pairs=10**9
    )
    assert len(near) == len(same) > 0
    with pytest.raises(dyop.InvalidArgument, match="more than 5 pairs of triangles"):
        dyop.find_contacts(ball, dyop.RigidPose(), ball, beside, 0.05, max_triangle_pairs=5)
    started = time.monotonic()
    timer = threading.Timer(0.3, _thread.interrupt_main)
    timer.start()
    with pytest.raises(KeyboardInterrupt):  # nine million pairs
        dyop.find_contacts(ball, dyop.RigidPose(), ball, beside, 100)
        timer.cancel()
    assert time.monotonic() - started < 10


def test_random_calls_do_no_harm():
    assert fuzz_calls.run(400, seed=7) == []


BALL, HERE = dyop.Sphere(1), dyop.RigidPose()
STILL = dyop.RestMotion()
TRIANGLE = [[0, 0, 0], [1, 0, 0], [0, 1, 0]]


@pytest.mark.parametrize(
    "call,error,message",
    [
        (lambda: dyop.RestMotion(None), ValueError, "X_WB: pose must be .*NoneType"),
        (lambda: dyop.distance(BALL, HERE, BALL, "x"), ValueError, "X_WB: pose must be .* str"),
        (lambda: dyop.distance(BALL, [1], BALL, X_WB=HERE), ValueError, "X_WA: pose must be .*list"),
        (lambda: dyop.Box(None), ValueError, "half_extents: vector must be three .*NoneType"),
        (lambda: dyop.Box(np.zeros((2, 3))), ValueError, r"half_extents: .*float64.*\(2, 3\)"),
        (lambda: dyop.point_distance(BALL, HERE, p_W=[1, 2]), ValueError, "p_W: vector must be"),
        (lambda: dyop.CompoundShape([(BALL, None)]), ValueError, "children: pose must be"),
        (lambda: dyop.ConstantTwistMotion(HERE, 5), ValueError, "twist_WB: twist must be .* int"),
        (
            lambda: dyop.ConstantTwistMotion(HERE, ((1, 2), (0, 0, 0))),
            ValueError,
            "v must be three numbers",
        ),
        (lambda: dyop.HermiteMotion((0, 1), None, 5), ValueError, "begin: state must be .*None"),
        (lambda: dyop.WorldOptions(gravity_W="x"), ValueError, "gravity_W: vector must be .* str"),
        (lambda: dyop.BodyDefinition(wrench=3), TypeError, "wrench: a function is wanted"),
        (lambda: dyop.BodyDefinition(kind="static"), TypeError, "kind must be BodyKind, not 'static'"),
        (lambda: dyop.ToiOptions(max_node_pairs=1e6), TypeError, "max_node_pairs must be int, not"),
        (lambda: dyop.Box(["1", "2", "3"]), ValueError, "half_extents: .* three numbers, .* list"),
        (lambda: dyop.ConvexHull([["0", "1", "2"]]), ValueError, "points must be"),
        (lambda: dyop.TimeInterval(np.nan, 1), ValueError, r"\[nan, 1\] needs two times"),
        (lambda: dyop.TriangleMesh(TRIANGLE, 10**30), ValueError, "triangles must be .* int"),
        (lambda: dyop.TriangleMesh(TRIANGLE, [[0, 1, np.inf]]), ValueError, "triangles must be"),
        (lambda: dyop.Sphere(np.zeros((0, 3))), TypeError, "'radius' must be a number, .*ndarray"),
        (
            lambda: dyop.check_motion(STILL, (0, 1), sample_count=np.zeros((3, 2))),
            TypeError,
            "'sample_count' must be an integer, .*ndarray",
        ),
        (lambda: dyop.TriangleMesh(TRIANGLE, [[0, 0.7, 2]]), ValueError, "triangles must be .* list"),
        (lambda: dyop.SampledMotion([0, 1], "xx"), ValueError, "poses: pose must be .* str"),
        (lambda: dyop.ToiStatus(77), ValueError, "77 is no ToiStatus"),
        (lambda: dyop.BodyKind(-1), (ValueError, TypeError), "-1"),
        (lambda: dyop.load_mesh(5), TypeError, "file must be a str or os.PathLike, .* int"),
        (lambda: dyop.UserMotion(1, 2, 3), TypeError, "pose must be a function, .* int"),
        (
            lambda: dyop.UserMotion(len, len, len, smooth_until="x"),
            TypeError,
            "smooth_until must be a function, .* str",
        ),
        (lambda: dyop.ComposedMotion(STILL, None), TypeError, "'X_MB' must be Motion"),
        (
            lambda: dyop.distance_batch(BALL, HERE, BALL, [HERE], progress="x"),
            TypeError,
            "progress must be a bool or a function, .* str",
        ),
    ],
)
def test_what_is_refused_is_named(call, error, message):
    with pytest.raises(error, match=message):
        call()


def test_a_refused_value_leaves_the_old_one():
    options = dyop.WorldOptions(on_step=print)
    with pytest.raises(TypeError, match="on_step"):
        options.on_step = 5
    assert options.on_step is print
    limits = dyop.ToiOptions(deadline=5.0)
    with pytest.raises(TypeError, match="deadline"):
        limits.deadline = "x"
    assert limits.deadline == pytest.approx(5)


def test_an_error_of_a_users_function_comes_out_as_it_is():
    mine = dyop.InvalidArgument("pose must be mine, not a value of type NoneType")

    def pose(t):
        raise mine

    motion = dyop.UserMotion(pose, lambda t: None, lambda i: None)
    with pytest.raises(dyop.InvalidArgument) as caught:
        motion.pose(0.0)
    assert caught.value is mine


def test_members_of_enums_are_made_from_their_numbers():
    assert all(type(one)(int(one)) == one for one in dyop.ToiStatus)
