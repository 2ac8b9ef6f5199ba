# SPDX-License-Identifier: BSD-3-Clause
"""What a property gives can be changed in place with effect, or not at all."""

import copy
import enum
import json
import pathlib
import pickle
import re
import time

import numpy as np
import pytest

import dyop
from conftest import user_bound, user_pose, user_twist, uv_sphere
from dyop import _dyop

REGRESSION = pathlib.Path(__file__).parents[1] / "regression"

PLAIN = (type(None), bool, int, float, str, bytes, enum.Enum)
CLASSES = {
    name: cls
    for name, cls in vars(_dyop).items()
    if isinstance(cls, type)
    and not hasattr(cls, "__members__")
    and not issubclass(cls, BaseException)
}


def is_record(cls):
    return "_fields" in vars(cls)


def properties(cls):
    return {
        name: value
        for base in cls.__mro__
        for name, value in vars(base).items()
        if isinstance(value, property)
    }


def filled(cls):
    """A record that has a record in every field that may hold some."""
    values = {}
    for name in cls._fields:
        doc = getattr(cls, name).__doc__
        found = re.match(r"(Optional\[|tuple\[)(\w+)(\]|, \.\.\.\]):", doc)
        inner = CLASSES.get(found[2]) if found else None
        if inner is not None and is_record(inner):
            one = filled(inner)
            values[name] = one if doc.startswith("Optional") else [one]
    return cls(**values)


def changed(value):
    """Another value of the same kind; None if this test knows none."""
    if isinstance(value, bool):
        return not value
    if isinstance(value, (int, float)):
        return 7 if value != 7 else 8
    if isinstance(value, str):
        return value + "?"
    if isinstance(value, np.ndarray):
        return value + 1 if value.size else np.ones((1, *value.shape[1:]), value.dtype)
    if isinstance(value, dyop.RigidPose):
        return dyop.RigidPose(position=value.translation + 1)
    return None


def lost_writes(read, place):
    """Writes that have no effect on what `read` gives, nor raise."""
    value = read()
    if isinstance(value, (list, dict, set, bytearray)):
        return [f"{place} is a {type(value).__name__}"]
    if isinstance(value, tuple):
        return [
            lost
            for k in range(len(value))
            for lost in lost_writes(lambda k=k: read()[k], f"{place}[{k}]")
        ]
    if isinstance(value, np.ndarray):
        if value.flags.writeable and value.size > 0:
            value[...] = value + 1
            return [] if np.array_equal(read(), value) else [place]
        return []
    if isinstance(value, PLAIN) or type(value).__name__ not in CLASSES:
        return []
    return [
        lost
        for name in properties(type(value))
        for lost in lost_in(read, name, f"{place}.{name}")
    ]


def lost_in(read, name, place):
    if name in ("stop", "user_data"):  # is what was assigned, not a copy
        return []
    lost = lost_writes(lambda: getattr(read(), name), place)
    other = changed(getattr(read(), name))
    before = repr(getattr(read(), name))
    if properties(type(read()))[name].fset is None or other is None:
        return lost
    try:
        setattr(read(), name, other)
    except AttributeError as error:
        assert name in str(error) and "copy.copy()" in str(error)
        return lost
    return lost if repr(getattr(read(), name)) != before else [*lost, f"{place} ="]


def lost_by(thing):
    return lost_writes(lambda: thing, type(thing).__name__)


@pytest.mark.parametrize("name", [name for name, cls in CLASSES.items() if is_record(cls)])
def test_no_write_into_a_record_is_lost(name):
    assert lost_by(filled(CLASSES[name])) == []


@pytest.fixture
def others(all_shapes, all_motions, tmp_path):
    """One object at least of each other class that has properties."""
    mesh = all_shapes[4]
    points = np.array(mesh.vertices)
    things = [
        *all_shapes, *all_motions, dyop.RigidPose(), dyop.TimeInterval(0, 1),
        dyop.Cylinder(1, 2), dyop.Cone(1, 2), dyop.Ellipsoid([1, 2, 3]),
        dyop.RoundedBox([1, 2, 3], 0.1), dyop.RoundedCylinder(1, 2, 0.1),
        dyop.TaperedCapsule(1, 0.5, 2), dyop.HalfSpace((0, 0, 1), 0),
        dyop.UserMotion(user_pose, user_twist, user_bound),
        dyop.DeformingMesh(points, points + 1, mesh.triangles),
    ]
    link = dyop.Link(name="a", shape=dyop.Sphere(1))
    hand = dyop.Link(name="b", shape=dyop.Sphere(1))
    joint = dyop.Joint(name="j", type=dyop.JointType.Prismatic, parent="a", child="b")
    things.append(dyop.KinematicChain([link, hand], [joint]))
    (tmp_path / "r.urdf").write_text('<robot name="r"><link name="a"/></robot>')
    things.append(dyop.load_robot(tmp_path / "r.urdf"))
    return things + of_stepping(tmp_path) + of_haptics(tmp_path)


def of_stepping(tmp_path):
    dyop.write_generated_scene(dyop.generate_scene("chain-net", 2), tmp_path / "net.json")
    text = json.loads((tmp_path / "net.json").read_text())
    text["time"]["end"] = 4 * text["time"]["step"]
    (tmp_path / "net.json").write_text(json.dumps(text))
    scene = dyop.load_scene(tmp_path / "net.json")
    things = [scene, dyop.BodyId(), dyop.JointId(), dyop.SpringId()]
    things.append(dyop.QueryRecord(REGRESSION / "box_leaves_a_contact.json"))
    if hasattr(dyop, "RecordingReader"):
        dyop.simulate(scene, tmp_path / "run.h5")
        things.append(dyop.RecordingReader(tmp_path / "run.h5"))
    return things


def of_haptics(tmp_path):
    if not hasattr(dyop, "HapticSession"):
        return []
    import test_haptics
    import test_tissue

    one, two = (haptic_tool(x) for x in (-3, 3))
    scene = dyop.HapticScene(tool=one.parts, X_WT=one.X_WT, more_tools=[two])
    options = test_tissue.haptic_options()
    session = dyop.HapticSession(scene, options)
    ticks = dyop.RunnerOptions(ticks=2, is_paced=False)
    runner = dyop.HapticRunner(session, ticks)
    runner.start()
    while runner.is_running:
        time.sleep(0.001)
    records = runner.read_ticks()
    report = runner.stop()
    model = test_tissue.slab_model()
    things = [session, runner, report, report.latency, *records, records[0].others[0]]
    things += [test_tissue.slab_tissue(), model, dyop.TissueFeed(model)]
    things += [dyop.DevicePose(one.X_WT, buttons=3)]
    pressed = test_haptics.make_session()
    if hasattr(dyop, "RecordingReader"):
        things.append(pressed.record(tmp_path / "ticks.h5"))
    test_haptics.press(pressed, 1, 20)
    return [*things, pressed]


def haptic_tool(x):
    ball = dyop.ToolPart(shape=dyop.Sphere(2.0))
    return dyop.HapticTool(parts=[ball], X_WT=dyop.RigidPose(position=(x, 0, 0)))


def test_no_write_into_another_object_is_lost(others):
    assert [lost for thing in others for lost in lost_by(thing)] == []
    seen = {type(thing).__name__ for thing in others}
    want = {name for name, cls in CLASSES.items() if properties(cls) and not is_record(cls)}
    assert want - seen == set()


def test_what_is_frozen_thaws_in_a_copy():
    joint = dyop.JointDefinition(motor=dyop.JointMotor(position=1))
    with pytest.raises(AttributeError, match=r"cannot set position: this JointMotor .*copy\.copy"):
        joint.motor.position = 2
    assert joint.asdict()["motor"].position == joint.motor.position == 1
    for motor in (copy.copy(joint.motor), pickle.loads(pickle.dumps(joint.motor))):
        motor.position = 2
        joint.motor = motor
        motor.position = 3
        assert joint.motor.position == 2


def test_parts_of_records_are_changed_in_place():
    state = dyop.MotionState()
    v = state.twist.v_WB
    v[0] = 5
    state.twist.w_WB += (0, 0, 1)
    body = dyop.BodyDefinition(initial=state)
    body.mass_properties.I_BBcm[0, 2] = 4
    assert body.initial.twist.v_WB.tolist() == [5, 0, 0]
    assert body.initial.twist.w_WB.tolist() == [0, 0, 1]
    assert body.mass_properties.I_BBcm.tolist() == [[0, 0, 4], [0, 0, 0], [0, 0, 0]]
    del state  # the array keeps what it is a part of
    assert v.tolist() == [5, 0, 0]


def test_lists_of_records_are_tuples():
    scene = dyop.PlanningScene(objects=[dyop.PlanningObject(name="a", shape=dyop.Sphere(1))])
    with pytest.raises(AttributeError, match="append"):
        scene.objects.append(dyop.PlanningObject())
    scene.objects += (dyop.PlanningObject(name="b", shape=dyop.Sphere(1)),)
    assert [thing.name for thing in scene.objects] == ["a", "b"]


def test_what_a_world_tells_of_its_parts_is_frozen():
    world = dyop.World(dyop.WorldOptions(max_step=0.01))
    ball = dyop.Sphere(1)
    a = world.add_body(shape=ball, mass_properties=ball.compute_mass_properties(1))
    away = (((1, 0, 0, 0), (5, 0, 0)), ((0, 0, 0), (0, 0, 0)))
    b = world.add_body(shape=ball, kind=dyop.BodyKind.Static, initial=away)
    spring = world.add_spring(a=a, b=b, stiffness=1, rest_length=0)
    told = [world.body(a), world.spring(spring), world.options(), world.pair_material(a, b)]
    for record in told:
        for name in record._fields:
            with pytest.raises(AttributeError, match=name):
                setattr(record, name, getattr(record, name))
    definition = copy.copy(world.body(a))
    definition.friction = 0.25
    definition.initial.X_WB = dyop.RigidPose(position=(0, 5, 0))
    assert world.body(world.add_body(definition)).friction == 0.25
