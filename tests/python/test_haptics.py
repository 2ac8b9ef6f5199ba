# SPDX-License-Identifier: BSD-3-Clause
"""The haptic loop from Python."""

import copy
import os
import pickle
import subprocess
import threading
import time

import numpy as np
import pytest

import dyop

haptics = pytest.importorskip("dyop.haptics")

UP = np.array([1.0, 0, 0, 0])


def grid(n, size):
    x, y = np.meshgrid(np.linspace(-size, size, n), np.linspace(-size, size, n), indexing="ij")
    k = np.arange(n * n).reshape(n, n)[:-1, :-1].ravel()
    corners = np.concatenate(
        [np.stack([k, k + n, k + n + 1], 1), np.stack([k, k + n + 1, k + 1], 1)]
    )
    return np.column_stack([x.ravel(), y.ravel(), np.zeros(n * n)]), corners


VERTICES, TRIANGLES = grid(9, 20.0)


def make_session(friction=0.3, **options):
    scene = haptics.HapticScene(
        tool=[haptics.ToolPart(shape=dyop.Sphere(2.0))],
        obstacles=[
            haptics.ToolObstacle(
                name="sheet", vertices=VERTICES, triangles=TRIANGLES, friction=friction
            )
        ],
        X_WT=dyop.RigidPose(position=(0.3, 0.2, 5)),
    )
    values = haptics.HapticOptions(rest_offset=0.02, recovery_speed=50, **options)
    values.coupling.stiffness = [1, 1, 1]
    values.coupling.rotational_stiffness = [200, 200, 200]
    return haptics.HapticSession(scene, values)


def press(session, depth, ticks=150):
    for k in range(ticks):
        down = min(1.0, 1.5 * k / ticks)
        tick = session.update((UP, np.array([0.3, 0.2, 5 - (3 + depth) * down])), 1e-3)
    return tick


def test_pressing_gives_stiffness_times_depth():
    tick = press(make_session(), 1.5)
    assert tick.status == haptics.HapticStatus.Held
    assert tick.wrench.force_W[2] == pytest.approx(1.52, abs=0.01)
    assert tick.tool.X_WT.translation[2] == pytest.approx(2.02, abs=0.01)
    (contact,) = tick.contacts
    assert contact.state in (haptics.ContactState.Stick, haptics.ContactState.Slip)
    assert contact.force_W == pytest.approx(tick.wrench.force_W, abs=1e-6)
    corners = VERTICES[TRIANGLES[contact.surface.triangle]]
    assert np.array(contact.surface.weights) @ corners == pytest.approx(contact.p_WO, abs=1e-9)
    impulse = sum(i.impulse_W for i in tick.impulses)
    assert impulse == pytest.approx(1e-3 * tick.wrench.force_W, abs=1e-6)
    assert tick.clearances[0].lower <= tick.clearances[0].upper
    assert tick.latency > 0
    again = pickle.loads(pickle.dumps(tick))
    assert again.tool.X_WT.translation[2] == tick.tool.X_WT.translation[2]


def test_whatever_a_device_sends_is_a_status():
    session = make_session()
    bad = session.update((UP, np.array([np.nan, 0, 0])), 1e-3)
    assert bad.status == haptics.HapticStatus.InvalidInput
    assert session.update(dyop.RigidPose(position=(0, 0, 5)), 1e-3).status.name == "Free"
    assert session.update(haptics.DevicePose((UP, [0, 0, 6])), 1e-3).status.name == "Free"
    with pytest.raises(dyop.InvalidArgument, match="3 numbers"):
        session.update((UP, [1, 2]), 1e-3)
    with pytest.raises(dyop.InvalidArgument, match="hinges"):
        session.update((UP, [0, 0, 5]), 1e-3, angles=[0] * 5)


def test_snapshots_are_read_where_they_are():
    session = make_session()
    lifted = VERTICES + [0, 0, 1.0]
    assert session.give_snapshot(0, lifted, 0.01, copy=False)
    assert not session.give_snapshot(0, lifted, 0.01)  # not yet started on
    with pytest.raises(dyop.InvalidArgument, match="copy"):
        session.give_snapshot(0, lifted.astype(np.float32), 0.01, copy=False)
    for _ in range(5):
        tick = session.update((UP, [0, 0, 5]), 1e-3)
    assert session.tissue_vertices(0)[:, 2] == pytest.approx(0.5)
    assert (tick.progress[0].snapshot, tick.progress[0].fraction) == (1, pytest.approx(0.5))
    found = session.find_contacts(
        0, tick.progress[0], haptics.ToolPose(X_WT=dyop.RigidPose(position=(0, 0, 3))),
        haptics.ContactSearch(reach=1),
    )
    assert found[0].gap == pytest.approx(0.5)
    assert found[0].v_WO == pytest.approx([0, 0, 100])
    assert session.retarget(0, VERTICES, 0.01)
    for _ in range(12):
        session.update((UP, [0, 0, 5]), 1e-3)
    assert session.tissue_vertices(0)[:, 2] == pytest.approx(0)
    assert session.give_mesh(0, VERTICES[:20], [[0, 1, 9]])
    session.update((UP, [0, 0, 5]), 1e-3)
    assert len(session.tissue_vertices(0)) == 20


def test_the_runner_ticks_without_the_interpreter():
    session = make_session()
    runner = haptics.HapticRunner(session, haptics.RunnerOptions(period=1e-3), keep=50)
    with runner:
        runner.set_device((UP, [0.3, 0.2, 4]))
        with pytest.raises(dyop.InvalidArgument, match="HapticRunner"):
            session.update((UP, [0, 0, 5]), 1e-3)
        given = 0
        numbers = []
        while len(numbers) < 60 or given < 3:
            given += session.give_snapshot(0, VERTICES, 0.004)
            numbers += [record.number for record in runner.read_ticks()]
    report = runner.stop()
    assert not runner.is_running
    assert report.ticks > max(numbers)
    assert numbers == sorted(set(numbers))
    assert report.latency.count == report.ticks
    assert report.latency.worst >= report.latency.quantile(0.5)
    assert session.last.tool.X_WT.translation[2] == pytest.approx(4)
    assert session.update((UP, [0.3, 0.2, 4]), 1e-3).status.name == "Free"


def test_an_unpaced_run_ends_by_itself():
    session = make_session()
    runner = haptics.HapticRunner(session, haptics.RunnerOptions(ticks=30, is_paced=False))
    runner.start()
    while runner.is_running:
        time.sleep(0.001)
    report, records = runner.stop(), runner.read_ticks()
    assert report.ticks == 30
    assert [record.number for record in records] == list(range(30))
    assert repr(runner) == "HapticRunner(is_running=False)"
    assert repr(session).startswith("HapticSession(1 tool, time=")
    assert repr(report).startswith("RunnerReport(ticks=30, late_starts=0, unlogged=0, latency=Lat")
    assert repr(records[3]).startswith("TickRecord(number=3, dt=0.001, device=DevicePose(p_WD=")
    with pytest.raises(dyop.InvalidArgument, match="started"):
        runner.start()
        runner.start()


def test_snapshots_from_another_thread():
    session = make_session()
    is_done = threading.Event()

    def give():
        for k in range(20):
            session.give_snapshot(0, VERTICES + [0, 0, 0.01 * (k % 2)], 0.002)
        is_done.set()

    thread = threading.Thread(target=give)
    thread.start()
    while not is_done.is_set():
        session.update((UP, [0, 0, 5]), 1e-3)
    thread.join()


def test_springs_reset_and_mapping():
    session = make_session()
    press(session, 1)
    soft = copy.copy(session.coupling)
    soft.stiffness = [0.5, 0.5, 0.5]
    session.set_coupling(soft)
    tick = session.update((UP, [0.3, 0.2, 1]), 1e-3)
    assert tick.wrench.force_W[2] == pytest.approx(0.51, abs=0.01)
    session.reset(haptics.ToolPose(X_WT=dyop.RigidPose(position=(0, 0, 9))))
    assert session.update((UP, [0, 0, 9]), 1e-3).status.name == "Free"
    mapping = haptics.DeviceMapping(haptics.DeviceMappingOptions(scale=0.5), ((1, 0, 0, 0), (0, 0, 9)))
    mapping.to_tool((UP, [100, 0, 0]))
    moved = mapping.to_tool((UP, [102, 0, 0]))
    assert moved.p_WD == pytest.approx([1, 0, 9])
    felt = mapping.to_hand(haptics.ToolWrench(force_W=[0, 0, 4]))
    assert felt.force_W == pytest.approx([0, 0, 2])


def test_compliance_of_a_point_at_the_origin_is_that_of_the_springs():
    coupling = haptics.CouplingOptions(stiffness=[1, 2, 4], rotational_stiffness=[9, 9, 9])
    tool = haptics.ToolPose()
    points = [haptics.ToolPoint(p_W=[0, 0, 0])]
    C = haptics.coupling_compliance(coupling, [], tool, points)
    assert C == pytest.approx(np.diag([1, 0.5, 0.25]))
    assert haptics.tool_jacobian([], tool, points[0]).shape == (3, 6)


def test_two_tools_push_each_other_with_one_force():
    """The springs of both hands are in series; a runner serves both."""
    other = haptics.HapticTool(
        parts=[haptics.ToolPart(shape=dyop.Sphere(2.0))], X_WT=dyop.RigidPose(position=(3, 0, 0))
    )
    scene = haptics.HapticScene(
        tool=[haptics.ToolPart(shape=dyop.Sphere(2.0))],
        X_WT=dyop.RigidPose(position=(-3, 0, 0)),
        more_tools=[other],
        tool_friction=0.2,
    )
    options = haptics.HapticOptions(rest_offset=0.02, recovery_speed=50)
    options.coupling = haptics.CouplingOptions(stiffness=[1, 1, 1], rotational_stiffness=[200] * 3)
    session = haptics.HapticSession(scene, options)
    assert session.tool_count == 2
    for k in range(300):
        half = max(1.0, 3 - 0.01 * k)
        ticks = session.update_all([(UP, [-half, 0, 0]), (UP, [half, 0, 0])], 1e-3)
    for tool, side in ((0, -1), (1, 1)):
        assert ticks[tool].wrench.force_W[0] == pytest.approx(side * 1.01, rel=1e-3)
        contact, = ticks[tool].tool_contacts
        assert (contact.tool, contact.obstacle) == (tool, 1 - tool)
        assert ticks[tool].tool_clearances[1 - tool].upper < 0.03
    with pytest.raises(dyop.InvalidArgument):
        session.update((UP, [0, 0, 0]), 1e-3)
    with pytest.raises(dyop.InvalidArgument):
        session.reset(haptics.ToolPose(), index=2)
    session.set_coupling(options.coupling, index=1)
    session.reset(haptics.ToolPose(X_WT=dyop.RigidPose(position=(9, 0, 0))), index=1)
    runner = haptics.HapticRunner(session, haptics.RunnerOptions(ticks=30, is_paced=False))
    runner.set_device((UP, [9, 1, 0]), index=1)
    with pytest.raises(dyop.InvalidArgument):
        runner.set_device((UP, [9, 1, 0]), index=2)
    with runner:
        while runner.is_running:
            time.sleep(0.001)
    record = runner.read_ticks()[-1]
    assert record.others[0].tick.tool.X_WT.translation == pytest.approx([9, 1, 0])
    assert record.others[0].device.p_WD == pytest.approx([9, 1, 0])


# --- recordings ---------------------------------------------------------------------------------

COMMAND = os.environ.get("DYOP_COMMAND")
needs_recording = pytest.mark.skipif(
    not hasattr(haptics.HapticSession, "record") or not COMMAND, reason="built without HDF5 or cli"
)


def command(*words):
    return subprocess.run([COMMAND, *map(str, words)], capture_output=True, text=True)


def assert_is_complete(file, ticks):
    replay = command("tool", file, "--replay")
    assert f"{ticks} ticks, 0 different" in replay.stdout, replay.stdout + replay.stderr
    proof = command("check", file)
    assert proof.returncode == 0, proof.stdout + proof.stderr


@needs_recording
def test_a_loop_of_ones_own_is_recorded_with_all_its_inputs(tmp_path):
    file = tmp_path / "run.h5"
    session = make_session()
    softer = haptics.CouplingOptions(stiffness=[0.5] * 3, rotational_stiffness=[100] * 3)
    with session.record(file, title="pressing") as recording:
        session.give_snapshot(0, VERTICES + [0, 0, 1.0], 0.05)
        press(session, 0.5, 20)
        assert session.retarget(0, VERTICES - [0, 0, 0.5], 0.02)
        press(session, 0.5, 40)
        session.set_coupling(softer)
        session.reset(haptics.ToolPose(X_WT=dyop.RigidPose(position=(1, 0, 6))))
        session.give_mesh(0, VERTICES[:30], TRIANGLES[(TRIANGLES < 30).all(axis=1)])
        session.replay((UP, [0, 0, np.nan]), 1e-3)
        session.update_all([(UP, [0, 0, 5])], 1e-3)
        press(session, 0.5, 40)
    assert recording.unlogged == 0
    press(session, 0.5, 3)  # not recorded
    assert_is_complete(file, 102)
    assert "pressing" in command("info", file).stdout
    recording.stop()  # once more changes nothing


@needs_recording
@pytest.mark.parametrize("is_paced", [False, True])
def test_a_runner_is_recorded(tmp_path, is_paced):
    file = tmp_path / "run.h5"
    session = make_session()
    options = haptics.RunnerOptions(ticks=300, period=1e-3, is_paced=is_paced)
    with session.record(file, waits=not is_paced) as recording:
        with haptics.HapticRunner(session, options) as runner:
            if is_paced:
                with pytest.raises(dyop.InvalidArgument, match="HapticRunner"):
                    recording.stop()
            while runner.is_running:
                runner.set_device((UP, [0.3, 0.2, 1]))
                session.give_snapshot(0, VERTICES + [0, 0, 0.5], 0.004)
                session.retarget(0, VERTICES - [0, 0, 0.5], 0.004)
    assert_is_complete(file, 300)


@needs_recording
def test_what_cannot_be_recorded_is_an_error(tmp_path):
    session = make_session()
    with pytest.raises(dyop.FileError) as failure:
        session.record(tmp_path / "none" / "run.h5")
    assert isinstance(failure.value, OSError)
    with pytest.raises(ValueError):
        with session.record(tmp_path / "run.h5"):
            with pytest.raises(dyop.InvalidArgument, match="already"):
                session.record(tmp_path / "other.h5")
            press(session, 0.5, 5)
            raise ValueError("the device is gone")
    assert "the device is gone" in command("info", tmp_path / "run.h5").stdout
    with pytest.raises(dyop.InvalidArgument, match="start"):
        session.record(tmp_path / "late.h5")
    assert not (tmp_path / "late.h5").exists()
