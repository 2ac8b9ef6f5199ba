# SPDX-License-Identifier: BSD-3-Clause
import copy
import json
import os
import pickle
import subprocess

import numpy as np
import pytest

import dyop
from conftest import fields_equal

COMMAND = os.environ.get("DYOP_COMMAND")


@pytest.fixture
def scene_file(tmp_path):
    dyop.write_generated_scene(dyop.generate_scene("chain-net", 2), tmp_path / "net.json")
    text = json.loads((tmp_path / "net.json").read_text())
    text["time"]["end"] = 4 * text["time"]["step"]
    (tmp_path / "net.json").write_text(json.dumps(text))
    return tmp_path / "net.json"


def test_kinds_are_known():
    assert "chain-net" in [kind.name for kind in dyop.scene_kinds()]
    with pytest.raises(dyop.InvalidArgument, match="castle"):
        dyop.generate_scene("castle", 3)


def test_a_scene_has_its_parts(scene_file):
    scene = dyop.load_scene(scene_file)
    assert scene.end_time > scene.step > 0 and len(scene.bodies) == len(scene.shape_names)
    assert scene.bodies[0].shape is not None
    assert json.loads(scene.source)["time"]["end"] == scene.end_time
    world = dyop.make_world(scene)
    assert world.body_count() == len(scene.bodies)


def test_options_replace_those_of_the_scene(scene_file):
    scene = dyop.load_scene(scene_file)
    options = copy.copy(scene.options)
    options.gravity_W = (0, 0, 0)
    world = dyop.make_world(scene, options)
    before = world.momentum()
    world.advance(scene.step)
    np.testing.assert_allclose(world.momentum(), before, atol=1e-9)


def lines_of(recording):
    """A recording as JSON lines."""
    return subprocess.run([COMMAND, "info", str(recording), "--json-lines"], check=True,
                          capture_output=True).stdout


def test_a_recording_says_what_ended_its_run(scene_file, tmp_path):
    scene = dyop.load_scene(scene_file)

    def interrupted(t, end):
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        dyop.simulate(scene, tmp_path / "run.h5", progress=interrupted)
    reader = dyop.RecordingReader(tmp_path / "run.h5")
    assert reader.end().error == "KeyboardInterrupt" and len(reader.frames) == 1
    assert repr(reader).endswith(f"run.h5', {len(reader.bodies)} bodies, t=0.0 to {scene.step})")
    with pytest.raises(TypeError, match="as load_scene.* not str"):
        dyop.simulate(str(scene_file))


def test_simulate_writes_the_recording_of_the_command(scene_file, tmp_path):
    scene = dyop.load_scene(scene_file)
    times = []
    run = dyop.simulate(scene, tmp_path / "run.h5", progress=lambda t, end: times.append(t))
    assert run.totals.status == dyop.AdvanceStatus.Completed and run.totals.end() == "Completed"
    assert len(times) == 4 and times[-1] == scene.end_time == run.world.time()
    assert "Completed" in dyop.summary(scene, run) or str(scene.end_time) in dyop.summary(scene, run)
    if COMMAND:
        subprocess.run(
            [COMMAND, "simulate", str(scene_file), "-o", str(tmp_path / "out.h5")], check=True,
            stdout=subprocess.DEVNULL,
        )
        assert lines_of(tmp_path / "run.h5") == lines_of(tmp_path / "out.h5")


def test_a_recording_holds_the_run(scene_file, tmp_path):
    scene = dyop.load_scene(scene_file)
    run = dyop.simulate(scene, tmp_path / "run.h5")
    recording = dyop.RecordingReader(tmp_path / "run.h5")
    assert recording.end().status == dyop.AdvanceStatus.Completed
    assert len(recording.steps) == run.totals.steps
    assert len(recording.bodies) == len(scene.bodies)
    for body in run.world.bodies():
        pose = run.world.state(body).X_WB
        recorded = recording.pose(body, scene.end_time)
        np.testing.assert_allclose(recorded.matrix, pose.matrix, atol=1e-12)
    copied = pickle.loads(pickle.dumps(run.totals))
    assert fields_equal(copied, run.totals)


def test_a_scene_pickles_with_its_meshes(scene_file, tmp_path):
    scene = dyop.load_scene(scene_file)
    data = pickle.dumps(scene)
    for file in scene_file.parent.glob("*.obj"):
        file.unlink()
    scene_file.unlink()
    copied = pickle.loads(pickle.dumps(pickle.loads(data)))  # twice: to and from another machine
    assert copied.source == scene.source
    a = dyop.simulate(scene, tmp_path / "a.h5")
    dyop.simulate(copied, tmp_path / "b.h5")
    if COMMAND:
        assert lines_of(tmp_path / "a.h5") == lines_of(tmp_path / "b.h5")
    assert a.totals.steps > 0


def test_a_broken_scene_is_named(tmp_path):
    (tmp_path / "bad.json").write_text('{"bodies": 3}')
    with pytest.raises(dyop.FileError, match="bad.json"):
        dyop.load_scene(tmp_path / "bad.json")


def test_reports_pickle(scene_file):
    world = dyop.make_world(dyop.load_scene(scene_file))
    report = world.advance(0.01)
    copied = pickle.loads(pickle.dumps(report))
    assert fields_equal(copied.work, report.work) and copied.t == report.t
    slot = world.bodies()[0].slot
    t = report.steps[-1].interval.end
    motion = report.steps[-1].motions[slot]
    assert motion is None or copied.steps[-1].motions[slot].pose(t) == motion.pose(t)
    for record in world.pairs()[:3]:
        assert fields_equal(pickle.loads(pickle.dumps(record)).pivot_W, record.pivot_W)


def test_a_query_record_replays_to_the_bit(tmp_path, ball_mesh):
    rest = dyop.RestMotion()
    flight = dyop.ConstantTwistMotion(((1, 0, 0, 0), (4, 0, 0)), ((-1, 0, 0), (1, 1, 1)))
    options = dyop.ToiOptions(target_distance=0.1)
    query = dict(a=ball_mesh, X_WA=rest, b=dyop.Sphere(1), X_WB=flight, interval=(0, 4))
    result = dyop.time_of_impact(**query, options=options)
    file = tmp_path / "query.json"
    dyop.write_query_record(file, **query, options=options, result=result)
    record = dyop.QueryRecord(file)
    assert record.version == dyop.__version__ and record.failure == ""
    again = record.query()
    del record  # its parts live on
    answer = dyop.time_of_impact(**again)
    assert fields_equal(answer, result)
    assert dyop.QueryRecord(file).differences(answer) == []
    changed = dyop.time_of_impact(**query)
    assert "t_safe" in [d.field for d in dyop.QueryRecord(file).differences(changed)]
    user = dyop.UserMotion(flight.pose, flight.twist, flight.twist_bound)
    with pytest.raises(dyop.InvalidArgument):
        dyop.write_query_record(file, **{**query, "X_WB": user}, options=options, result=result)


@pytest.mark.skipif(not hasattr(dyop, "RecordingReader"), reason="built without HDF5")
def test_a_binary_recording_gives_the_motions_of_the_run(scene_file, tmp_path):
    scene = dyop.load_scene(scene_file)
    world = dyop.make_world(scene)
    file = tmp_path / "run.dyop"
    writer = dyop.RecordingWriter(file, dyop.run_header(scene))
    reports = []
    for _ in range(3):
        reports.append(world.advance(scene.step))
        writer.write(reports[-1], world)
    writer.finish()
    reader = dyop.RecordingReader(file)
    assert reader.header.title == scene.title and len(reader.frames) == 3
    assert reader.end().status == dyop.AdvanceStatus.Completed
    assert reader.interval().end == world.time() and len(reader.bodies) == len(scene.bodies)
    step = reports[1].steps[0]
    t = (step.interval.begin + step.interval.end) / 2
    for body in world.bodies():
        motion = step.motions[body.slot]
        assert reader.pose(body, t) == motion.pose(t)
        segment = reader.segment(body, reader.segment_at(body, t))
        assert segment.motion.pose(t) == motion.pose(t)
    assert len(reader.pairs(2)) >= len(world.contacts()) and not reader.refresh()
