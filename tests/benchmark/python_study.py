# SPDX-License-Identifier: BSD-3-Clause
"""A study of scenes on one and on two worker processes: the same bits, the speed-up, and what a task
costs by itself.

Usage: PYTHONPATH=build/release/python python3 tests/benchmark/python_study.py [SCENES]
"""

import hashlib
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

CHUNK = 50


def main(count):
    generated = dyop.generate_scene("stack", 3)
    with tempfile.TemporaryDirectory() as folder:
        dyop.write_generated_scene(generated, f"{folder}/stack.json")
        shared = {"scene": dyop.load_scene(f"{folder}/stack.json")}
    seconds, digests = [], []
    with tempfile.TemporaryDirectory() as folder:
        cluster = Cluster(Path(folder))
        try:
            for _ in range(2):
                cluster.add_worker()
                options = {"client": cluster.client, "chunk": CHUNK}
                study.map(study_cases.pushed_stack, range(4), shared=shared, client=cluster.client)
                start = time.perf_counter()
                results = study.map(study_cases.pushed_stack, range(count), shared=shared, **options)
                seconds.append(time.perf_counter() - start)
                digests.append(hashlib.sha256(np.array(results).tobytes()).hexdigest()[:16])
            start = time.perf_counter()
            study.map(study_cases.nothing, range(1000), client=cluster.client)
            empty = time.perf_counter() - start
        finally:
            cluster.close()
    print(f"{count} scenes, {CHUNK} a task: one worker {seconds[0]:.2f} s, two {seconds[1]:.2f} s, "
          f"{seconds[0] / seconds[1]:.2f} times faster; results {' '.join(digests)}")
    print(f"an empty task: {empty:.2f} ms")
    assert digests[0] == digests[1], "the results differ"


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 2000)
