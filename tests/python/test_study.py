# SPDX-License-Identifier: BSD-3-Clause
"""Studies with a real scheduler and real worker processes."""

import os
import random
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


def test_sets_are_the_same_case_in_every_process(tmp_path):
    program = tmp_path / "program.py"
    program.write_text(
        "from dyop import study\n"
        "class Names(frozenset): pass\n"
        "def count(case, others):\n"
        "    return len(case['names']) + len(others)\n"
        "words = ['base', 'arm', 'hand', 'tool', 'cup']\n"
        "case = {'names': set(words), 'pairs': Names(frozenset(words[k:]) for k in range(4))}\n"
        "if __name__ == '__main__':\n"
        "    print(study.map(count, [case], shared={'others': set(words)}, store='s.sqlite'))\n"
    )
    for seed in range(4):
        environment = dict(os.environ, PYTHONHASHSEED=str(seed))
        environment["PYTHONPATH"] = str(Path(dyop.__file__).parents[1])
        found = subprocess.run([sys.executable, program], capture_output=True, text=True,
                               timeout=120, cwd=tmp_path, env=environment)
        assert found.stdout == "[10]\n", found.stderr
    assert study._digest({"a", "b"}) != study._digest({"a", "c"})
    assert study._digest([{"a"}]) != study._digest([frozenset({"a"})])


def test_a_damaged_store_is_an_error_or_the_same_results(tmp_path):
    path = tmp_path / "study.sqlite"
    digests = [f"{k:064x}" for k in range(20)]
    results = [(1.5 * k, f"x{k}", [0.1 * k] * 5) for k in range(20)]
    store = study.Store(path, "f")
    store.save([(k, digests[k], results[k]) for k in range(20)])
    store.close()
    whole = path.read_bytes()
    generator = random.Random(3)
    errors = 0
    for _ in range(300):
        damaged = bytearray(whole)
        damaged[generator.randrange(len(whole))] ^= 1 << generator.randrange(8)
        path.write_bytes(damaged)
        try:
            store = study.Store(path, "f")
            assert all(results[k] == found for k, found in store.load(digests).items())
            store.close()
        except study.StudyError as error:
            errors += 1
            assert "study.sqlite" in str(error)
    assert errors > 30


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


def expect_five_failures(results):
    assert [results[k] for k in (0, 1, 7, 8)] == [0, 1, 49, 64]
    failures = study.failures(results)
    assert [failure.case for failure in failures] == [2, 3, 4, 5, 6]
    texts = [failure.error for failure in failures]
    assert texts[0] == "crashed: SIGSEGV"
    assert texts[1] == "took more than 1 s"
    assert "MemoryError" in texts[2]
    assert texts[3] == "ended its process with code 7"
    assert "pickle" in texts[4]


def test_cases_that_crash_hang_or_eat_memory_are_set_aside(tmp_path):
    store = tmp_path / "study.sqlite"
    options = dict(keep_failures=True, seconds=1, megabytes=1000, store=store)
    expect_five_failures(study.map(study_cases.misbehaves, range(9), **options))
    expect_five_failures(study.map(study_cases.misbehaves, range(9), **options))  # from the file


def test_workers_survive_cases_that_crash(cluster):
    for _ in range(2):
        cluster.add_worker()
    options = dict(client=cluster.client, seconds=1, megabytes=1000, chunk=2)
    expect_five_failures(study.map(study_cases.misbehaves, range(9), keep_failures=True, **options))
    with pytest.raises(study.StudyError, match="case 2 crashed: SIGSEGV"):
        study.map(study_cases.misbehaves, range(3), **options)
    assert len(cluster.client.scheduler_info()["workers"]) == 2


def test_a_case_that_ends_several_workers_is_found(cluster):
    # Without limits cases run in the worker itself; the scheduler gives up after so many workers.
    cluster.client.run_on_scheduler(lambda dask_scheduler: setattr(dask_scheduler, "allowed_failures", 0))
    workers = [cluster.add_worker() for _ in range(2)]
    results = study.imap(
        study_cases.misbehaves, [0, 1, 2, 7], client=cluster.client, keep_failures=True, chunk=4
    )
    found = dict(results)
    assert found == {0: 0, 1: 1, 2: study.Failure(2, "crashed: SIGSEGV"), 3: 49}
    assert sum(worker.poll() is None for worker in workers) == 1


def test_an_exception_in_a_process_of_its_own_is_the_same():
    with pytest.raises(ValueError, match="three is too many"):
        study.map(study_cases.fails_at_three, range(5), isolate=True)
    kept = study.map(study_cases.fails_at_three, range(5), isolate=True, keep_failures=True)
    assert kept[3] == study.Failure(3, "ValueError: three is too many")


def test_an_exception_that_does_not_unpickle_is_kept_by_its_message():
    kept = study.map(study_cases.gives_what_cannot_be_sent, range(5), isolate=True, keep_failures=True)
    assert [kept[0], kept[4]] == [0, 4]
    assert kept[1] == study.Failure(1, "SyntaxTrouble: bad token in line 7")
    assert kept[2] == study.Failure(2, "Numbered: bad token:7")
    assert kept[3].error.startswith("its result does not unpickle: ValueError")
    with pytest.raises(RuntimeError, match="SyntaxTrouble: bad token in line 7"):
        study.map(study_cases.gives_what_cannot_be_sent, range(5), isolate=True)


def test_one_process_runs_all_cases_and_keeps_what_is_shared(mesh):
    found = study.map(study_cases.process_of, range(5), shared={"mesh": mesh}, isolate=True)
    assert len(set(found)) == 1 and found[0][0] != os.getpid()


def test_functions_of_the_main_program_run_isolated(tmp_path):
    program = tmp_path / "program.py"
    program.write_text(
        "from dyop import study\n"
        "def twice(case):\n"
        "    return 2 * case\n"
        "if __name__ == '__main__':\n"
        "    print(study.map(twice, range(3), seconds=60))\n"
    )
    found = subprocess.run([sys.executable, program], capture_output=True, text=True, timeout=120)
    assert found.stdout == "[0, 2, 4]\n", found.stderr


@pytest.mark.parametrize("seconds", [0.2, 5])  # it answers; it is still at work
def test_a_process_whose_parent_was_killed_ends_in_silence(tmp_path, seconds):
    program = tmp_path / "program.py"
    program.write_text(
        "import time\n"
        "from dyop import study\n"
        "def slow(case):\n"
        "    print('at work', flush=True)\n"
        f"    time.sleep({seconds})\n"
        "if __name__ == '__main__':\n"
        "    study.map(slow, range(3), seconds=60)\n"
    )
    run = subprocess.Popen([sys.executable, program], text=True,
                           stdout=subprocess.PIPE, stderr=subprocess.PIPE)
    assert run.stdout.readline() == "at work\n"
    run.kill()
    said = run.stderr.read()  # until the process of the cases has ended as well
    run.wait()
    assert said == ""


def test_workers_keep_what_is_shared_between_calls(cluster, mesh):
    cluster.add_worker()
    options = dict(client=cluster.client, shared={"mesh": mesh})
    first = study.map(study_cases.process_of, range(2), **options)
    second = study.map(study_cases.process_of, range(2), **options)
    assert len(set(first + second)) == 1
    study.forget(cluster.client)
    assert len(study.map(study_cases.process_of, range(2), **options)) == 2


def test_a_dead_scheduler_is_an_error_not_a_wait(cluster):
    cluster.add_worker()
    results = study.imap(study_cases.slow, range(200), client=cluster.client, patience=5)
    next(results)
    cluster.processes[0].kill()
    with pytest.raises(study.StudyError):
        list(results)


def test_limits_are_checked():
    for limits in ({"seconds": 0}, {"megabytes": -1}, {"seconds": float("nan")}):
        with pytest.raises(ValueError, match=next(iter(limits))):
            study.map(study_cases.slow, [1], **limits)


def test_no_worker_is_an_error_not_a_wait(cluster):
    with pytest.raises(study.StudyError, match="no result"):
        study.map(study_cases.fails_at_three, range(2), client=cluster.client, patience=1)


def test_chunks_are_checked():
    with pytest.raises(ValueError, match="chunk"):
        study.map(study_cases.slow, [1], chunk=0)
