# SPDX-License-Identifier: BSD-3-Clause
"""Studies with a real scheduler and real worker processes."""

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

import dyop
import study_cases
from conftest import uv_sphere
from dyop import study

distributed = pytest.importorskip("distributed")


class Cluster:
    """A scheduler and workers, each a process of its own."""

    def __init__(self, folder):
        self.folder = folder
        self.environment = dict(os.environ)
        self.environment["PYTHONPATH"] = os.pathsep.join(
            [str(Path(dyop.__file__).parents[1]), str(Path(__file__).parent)]
        )
        self.log = open(folder / "cluster.log", "w")
        address = folder / "scheduler.json"
        self.processes = []
        self.start("distributed.cli.dask_scheduler", "--host", "127.0.0.1", "--port", "0",
                   "--no-dashboard", "--scheduler-file", str(address))
        deadline = time.monotonic() + 60
        while not address.exists() and time.monotonic() < deadline:
            time.sleep(0.05)
        self.client = distributed.Client(scheduler_file=str(address), timeout="60s")

    def start(self, module, *arguments):
        process = subprocess.Popen(
            [sys.executable, "-m", module, *arguments], env=self.environment, cwd=self.folder,
            stdout=self.log, stderr=self.log,
        )
        self.processes.append(process)
        return process

    def add_worker(self):
        before = len(self.client.scheduler_info()["workers"])
        worker = self.start(
            "distributed.cli.dask_worker", self.client.scheduler.address, "--nthreads", "1",
            "--no-nanny", "--no-dashboard", "--local-directory", str(self.folder),
        )
        self.client.wait_for_workers(before + 1, timeout=60)
        return worker

    def close(self):
        self.client.close()
        for process in reversed(self.processes):
            process.terminate()
        for process in self.processes:
            try:
                process.wait(timeout=30)
            except subprocess.TimeoutExpired:  # a busy machine
                process.kill()
                process.wait()
        self.log.close()


@pytest.fixture
def cluster(tmp_path):
    cluster = Cluster(tmp_path)
    yield cluster
    cluster.close()


@pytest.fixture
def mesh():
    return dyop.TriangleMesh(*uv_sphere(12, 16))


def test_results_do_not_depend_on_the_workers(cluster, mesh):
    cases = list(range(120))
    here = study.map(study_cases.flight, cases, shared={"mesh": mesh})
    assert {status for status, _ in here} >= {int(dyop.ToiStatus.Impact)}
    for _ in range(2):
        cluster.add_worker()
        there = study.map(
            study_cases.flight, cases, client=cluster.client, shared={"mesh": mesh}, chunk=7
        )
        assert there == here


def test_paths_of_a_chain_are_a_study(cluster):
    bar = dyop.CompoundShape([(dyop.Box([0.5, 0.05, 0.05]), ((1, 0, 0, 0), (0.5, 0, 0)))])
    links = [dyop.Link(name="base"), *(dyop.Link(name=n, shape=bar) for n in ("upper", "lower"))]
    joints = [
        dyop.Joint(parent="base", child="upper", name="a"),
        dyop.Joint(parent="upper", child="lower", name="b", X_PJ=((1, 0, 0, 0), (1, 0, 0))),
    ]
    obstacles = dyop.ObstacleSet()
    obstacles.add(dyop.Sphere(0.2), ((1, 0, 0, 0), (0, 1.3, 0)))
    shared = {"chain": dyop.KinematicChain(links, joints), "obstacles": obstacles}
    here = study.map(study_cases.path_of_an_arm, range(60), shared=shared)
    assert len({result[0] for result in here}) > 1
    for _ in range(2):
        cluster.add_worker()
    there = study.map(
        study_cases.path_of_an_arm, range(60), client=cluster.client, shared=shared, chunk=7
    )
    assert there == here


def test_a_killed_worker_loses_nothing(cluster, tmp_path):
    victim = cluster.add_worker()
    cluster.add_worker()
    folder = tmp_path / "runs"
    folder.mkdir()
    seen = []
    results = study.imap(
        study_cases.counted, range(150), client=cluster.client, shared={"folder": str(folder)},
        chunk=3, store=tmp_path / "study.sqlite",
    )
    for number, result in results:
        assert number == result
        seen.append(number)
        if len(seen) == 30:
            os.kill(victim.pid, signal.SIGKILL)
    assert sorted(seen) == list(range(150)) and len(set(seen)) == len(seen)
    assert {int(f.name.split("-")[0]) for f in folder.iterdir()} == set(range(150))


def test_a_study_goes_on_from_its_file(tmp_path):
    folder = tmp_path / "runs"
    folder.mkdir()
    options = dict(shared={"folder": str(folder)}, store=tmp_path / "study.sqlite")
    first = study.imap(study_cases.counted, range(20), **options)
    for _ in range(8):
        next(first)
    first.close()  # as if it had been killed
    assert len(list(folder.iterdir())) == 8
    assert study.map(study_cases.counted, range(20), **options) == list(range(20))
    assert len(list(folder.iterdir())) == 20  # none was run twice
    assert study.map(study_cases.counted, range(20), **options) == list(range(20))
    assert len(list(folder.iterdir())) == 20
    assert len(study.map(study_cases.counted, range(25), **options)) == 25  # more cases may come


def test_a_file_of_another_study_is_refused(tmp_path):
    store = tmp_path / "study.sqlite"
    study.map(study_cases.slow, [1, 2], store=store)
    with pytest.raises(study.StudyError, match="case 1 is not the one it was"):
        study.map(study_cases.slow, [1, 3], store=store)
    with pytest.raises(study.StudyError, match="slow"):
        study.map(study_cases.fails_at_three, [1, 2], store=store)


def test_progress_counts_what_was_there(tmp_path):
    store = tmp_path / "study.sqlite"
    study.map(study_cases.slow, range(3), store=store)
    seen = []
    study.map(study_cases.slow, range(5), store=store, progress=lambda *n: seen.append(n))
    assert seen == [(3, 5), (4, 5), (5, 5)]


def test_an_exception_ends_the_study_or_is_kept(cluster):
    cluster.add_worker()
    for client in (None, cluster.client):
        with pytest.raises(ValueError, match="three"):
            study.map(study_cases.fails_at_three, range(5), client=client)
        kept = study.map(study_cases.fails_at_three, range(5), client=client, keep_failures=True)
        assert kept[3] == study.Failure(3, "ValueError: three is too many")
        assert kept[4] == 4


def test_no_worker_is_an_error_not_a_wait(cluster):
    with pytest.raises(study.StudyError, match="no result"):
        study.map(study_cases.fails_at_three, range(2), client=cluster.client, patience=1)


def test_chunks_are_checked():
    with pytest.raises(ValueError, match="chunk"):
        study.map(study_cases.slow, [1], chunk=0)
