# SPDX-License-Identifier: BSD-3-Clause
"""A study of scenes on one and on two worker processes, and on two of which one is killed midway: the
same bits, the speed-up, and what a task costs by itself. On a busy machine the processor time of the
workers says more than the clock: if two take as much as one, two free cores give a speed-up of 2.

Usage: PYTHONPATH=build/release/python python3 tests/benchmark/python_study.py [SCENES]
"""

import hashlib
import os
import signal
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

import dyop
from dyop import study

sys.path.insert(0, str(Path(__file__).parents[1] / "python"))
import study_cases  # noqa: E402
from test_study import Cluster  # noqa: E402

CHUNK = 200


def processor_seconds(workers):
    """Of the processes that still run."""
    ticks = 0
    for worker in workers:
        if worker.poll() is None:
            with open(f"/proc/{worker.pid}/stat") as file:
                ticks += sum(map(int, file.read().rsplit(")", 1)[1].split()[11:13]))
    return ticks / os.sysconf("SC_CLK_TCK")


def run(cluster, workers, count, shared, victim=None):
    """Wall and processor seconds, and a digest of the results; `victim` is killed a third of the way."""
    before, start = processor_seconds(workers), time.perf_counter()
    results = [None] * count
    options = {"shared": shared, "client": cluster.client, "chunk": CHUNK}
    finished = 0
    for number, result in study.imap(study_cases.pushed_stack, range(count), **options):
        assert results[number] is None, "a result came twice"
        results[number] = result
        finished += 1
        if victim is not None and finished == count // 3:
            os.kill(victim.pid, signal.SIGKILL)
    wall = time.perf_counter() - start
    assert finished == count, "results are missing"
    digest = hashlib.sha256(np.array(results).tobytes()).hexdigest()[:16]
    return wall, processor_seconds(workers) - before, digest


def main(count):
    generated = dyop.generate_scene("stack", 3)
    with tempfile.TemporaryDirectory() as folder:
        dyop.write_generated_scene(generated, f"{folder}/stack.json")
        shared = {"scene": dyop.load_scene(f"{folder}/stack.json")}
    workers, runs = [], []
    with tempfile.TemporaryDirectory() as folder:
        cluster = Cluster(Path(folder))
        try:
            for _ in range(2):
                workers.append(cluster.add_worker())
                study.map(study_cases.pushed_stack, range(4), shared=shared, client=cluster.client)
                runs.append(run(cluster, workers, count, shared))
            start = time.perf_counter()
            study.map(study_cases.nothing, range(1000), client=cluster.client)
            empty = time.perf_counter() - start
            killed = run(cluster, workers, count, shared, victim=workers[0])
        finally:
            cluster.close()
    (one, one_cpu, digest), (two, two_cpu, same) = runs
    print(f"{count} scenes, {CHUNK} a task: one worker {one:.2f} s ({one_cpu:.2f} s of processor), two "
          f"{two:.2f} s ({two_cpu:.2f} s), {one / two:.2f} times faster")
    print(f"one of two killed after {count // 3}: {killed[0]:.2f} s, nothing lost, nothing twice")
    print(f"results {digest} {same} {killed[2]}; an empty task: {empty:.2f} ms")
    assert digest == same == killed[2], "the results differ"


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 2000)
