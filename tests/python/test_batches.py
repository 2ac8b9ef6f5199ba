# SPDX-License-Identifier: BSD-3-Clause
import os
import signal
import threading
import time

import numpy as np
import pytest

import dyop
from conftest import random_quaternions, uv_sphere

REST = dyop.RestMotion()


def flights(generator, count, w=4.0):
    """Bodies that start 4 to the right and fly to the left, turning."""
    poses = (random_quaternions(generator, count), generator.normal(size=(count, 3)) + [4, 0, 0])
    v = np.tile([-2.0, 0, 0], (count, 1))
    return dyop.constant_twist_motions(poses, v, generator.normal(size=(count, 3)) * w)


def test_rows_are_single_answers_in_the_same_bits(all_shapes, generator):
    motions = flights(generator, 48)
    shapes = [all_shapes[i % 6] for i in range(48)]
    rows = dyop.time_of_impact_batch(all_shapes[4], REST, shapes, motions, (0, 3), thread_count=2)
    assert rows.dtype == dyop.toi_row and rows.shape == (48,)
    statuses = set()
    for i, row in enumerate(rows):
        one = dyop.time_of_impact(all_shapes[4], REST, shapes[i], motions[i], (0, 3))
        statuses.add(one.status)
        assert dyop.ToiStatus(int(row["status"])) == one.status
        assert row["t_safe"] == one.t_safe
        assert row["node_pairs"] == one.statistics.node_pairs
        if one.contact is None:
            assert np.isnan(row["lower"]) and row["triangle_a"] == -1
        else:
            assert row["lower"] == one.contact.lower
            assert row["closing_speed"] == one.contact.closing_speed
            np.testing.assert_array_equal(row["nhat_AB_W"], one.contact.nhat_AB_W)
            np.testing.assert_array_equal(row["feature_a"][1:], one.contact.feature_a.vertices)
    assert {dyop.ToiStatus.Impact, dyop.ToiStatus.Separated} <= statuses


def test_equal_bytes_for_every_number_of_threads(generator):
    mesh = dyop.TriangleMesh(*uv_sphere(10, 12))
    motions = flights(generator, 300)
    answers = [
        dyop.time_of_impact_batch(mesh, REST, mesh, motions, (0, 3), thread_count=n).tobytes()
        for n in (1, 2, 3, 0)
    ]
    assert len(set(answers)) == 1


def test_arguments_of_every_form(generator):
    motions = flights(generator, 6)
    a, b = dyop.Sphere(1), dyop.Box([1, 1, 1])
    expected = dyop.time_of_impact_batch(a, REST, b, motions, (0, 3))
    listed = dyop.time_of_impact_batch([a] * 6, [REST] * 6, [b] * 6, list(motions), [(0, 3)] * 6)
    assert listed.tobytes() == expected.tobytes()
    one = dyop.time_of_impact_batch(a, REST, b, motions[-1], dyop.TimeInterval(0, 3))
    assert one.shape == (1,) and one[0].tobytes() == expected[-1].tobytes()
    with pytest.raises(IndexError):
        motions[6]


def test_interpolated_motions_take_poses_of_both_ends(generator):
    q, p = random_quaternions(generator, 4), generator.normal(size=(4, 3))
    motions = dyop.interpolated_motions((0, 1), np.eye(4), (q, p))
    assert len(motions) == 4
    np.testing.assert_allclose(motions[2].pose(1).translation, p[2])
    assert isinstance(motions[2], dyop.InterpolatedMotion)


def test_a_motion_outlives_its_array(generator):
    motion = flights(generator, 3)[1]
    assert np.isfinite(motion.pose(1).matrix).all()


def test_user_motions_run_in_several_threads(user_motion):
    wall = dyop.RestMotion(((1, 0, 0, 0), (5, 0, 0)))
    rows = dyop.time_of_impact_batch(
        dyop.Sphere(1), [user_motion] * 20, dyop.Sphere(2), wall, (0, 3), thread_count=2
    )
    np.testing.assert_allclose(rows["t_safe"], np.sqrt(2), atol=1e-5)


def test_progress_ends_at_the_total_and_its_exception_ends_the_batch(generator):
    seen = []
    motions = flights(generator, 50)
    dyop.time_of_impact_batch(
        dyop.Sphere(1), REST, dyop.Sphere(1), motions, (0, 3), progress=lambda *n: seen.append(n)
    )
    assert seen[-1] == (50, 50) and seen == sorted(seen)

    def fail(done, total):
        raise RuntimeError(f"enough after {done}")

    with pytest.raises(RuntimeError, match="enough after"):
        dyop.time_of_impact_batch(
            dyop.Sphere(1), REST, dyop.Sphere(1), motions, (0, 3), progress=fail
        )


def test_a_stop_leaves_rows_that_were_not_run(generator):
    source = dyop.StopSource()
    source.request_stop()
    rows = dyop.time_of_impact_batch(
        dyop.Sphere(1), REST, dyop.Sphere(1), flights(generator, 20), (0, 3), stop=source
    )
    assert set(rows["status"]) == {int(dyop.ToiStatus.NotRun)}


def test_ctrl_c_ends_a_batch():
    mesh = dyop.TriangleMesh(*uv_sphere(60, 80))
    motions = flights(np.random.default_rng(3), 200_000)
    threading.Timer(0.3, os.kill, (os.getpid(), signal.SIGINT)).start()
    before = time.monotonic()
    with pytest.raises(KeyboardInterrupt):
        dyop.time_of_impact_batch(mesh, REST, mesh, motions, (0, 3))
    assert time.monotonic() - before < 60  # alone it takes minutes


def test_other_threads_run_while_a_batch_does():
    mesh = dyop.TriangleMesh(*uv_sphere(30, 40))
    motions = flights(np.random.default_rng(3), 3000)
    counted = []
    finished = threading.Event()

    def count():
        while not finished.is_set():
            counted.append(1)
            time.sleep(0.001)

    thread = threading.Thread(target=count)
    thread.start()
    dyop.time_of_impact_batch(mesh, REST, mesh, motions, (0, 3), thread_count=1)
    finished.set()
    thread.join()
    assert len(counted) > 3


def test_batches_of_several_threads_do_not_disturb_one_another(generator):
    mesh = dyop.TriangleMesh(*uv_sphere(12, 16))
    motions = flights(generator, 200)
    alone = dyop.time_of_impact_batch(mesh, REST, mesh, motions, (0, 3), thread_count=1)
    same = []

    def run():
        rows = dyop.time_of_impact_batch(mesh, REST, mesh, motions, (0, 3), thread_count=2)
        same.append(rows.tobytes() == alone.tobytes())

    threads = [threading.Thread(target=run) for _ in range(40)]  # more than have a place at once
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert same == [True] * 40


def test_bad_batches_are_refused_with_the_index(generator):
    motions = list(flights(generator, 3))
    short = dyop.InterpolatedMotion((0, 1), np.eye(4), np.eye(4))
    a = dyop.Sphere(1)
    with pytest.raises(dyop.InvalidArgument, match="query 1"):
        dyop.time_of_impact_batch(a, REST, a, [motions[0], short, motions[2]], (0, 3))
    with pytest.raises(dyop.InvalidArgument, match=r"X_WB\[1\]"):
        dyop.time_of_impact_batch(a, REST, a, [motions[0], 7], (0, 3))
    with pytest.raises(dyop.InvalidArgument, match="X_WA holds 2 items"):
        dyop.time_of_impact_batch([a] * 3, [REST] * 2, a, motions, (0, 3))
    with pytest.raises(dyop.InvalidArgument, match="with_contacts"):
        dyop.time_of_impact_batch(a, REST, a, motions, options=dyop.ToiOptions(with_contacts=True))
    with pytest.raises(dyop.InvalidArgument, match="thread_count"):
        dyop.time_of_impact_batch(a, REST, a, motions, (0, 3), thread_count=-1)
