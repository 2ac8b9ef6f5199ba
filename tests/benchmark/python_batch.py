# SPDX-License-Identifier: BSD-3-Clause
"""What Python costs: a batch from numpy against the same batch in C++, and a single query.

Usage: PYTHONPATH=build/release/python python3 tests/benchmark/python_batch.py BASELINE [QUERIES]
BASELINE is the program python_batch_baseline of the build. Prints processor and wall seconds of
both, alternating; the least of each counts.
"""

import resource
import subprocess
import sys
import tempfile
import time
import timeit
from pathlib import Path

import numpy as np

import dyop

sys.path.insert(0, str(Path(__file__).parents[1] / "python"))
from conftest import random_quaternions, uv_sphere  # noqa: E402

THREADS = 2
ROUNDS = 3


def cpu_seconds(who):
    used = resource.getrusage(who)
    return used.ru_utime + used.ru_stime


def measure(run, who):
    wall, cpu = time.perf_counter(), cpu_seconds(who)
    run()
    return time.perf_counter() - wall, cpu_seconds(who) - cpu


def batch(baseline, count):
    generator = np.random.default_rng(5)
    vertices, triangles = uv_sphere(50, 50)  # 4,900 triangles
    vertices *= 1 + 0.1 * np.sin(9 * vertices[:, [1]]) * np.cos(7 * vertices[:, [2]])
    numbers = np.concatenate(
        [
            random_quaternions(generator, count),
            generator.normal(size=(count, 3)) * 0.7 + [4, 0, 0],
            np.tile([-2.0, 0, 0], (count, 1)),
            generator.normal(size=(count, 3)) * 2,
        ],
        axis=1,
    )
    q, p = np.ascontiguousarray(numbers[:, :4]), np.ascontiguousarray(numbers[:, 4:7])
    v, w = np.ascontiguousarray(numbers[:, 7:10]), np.ascontiguousarray(numbers[:, 10:])
    mesh, answers = dyop.TriangleMesh(vertices, triangles), []

    def in_python():
        motions = dyop.constant_twist_motions((q, p), v, w)
        rows = dyop.time_of_impact_batch(
            mesh, dyop.RestMotion(), mesh, motions, (0, 3), thread_count=THREADS
        )
        answers.append((np.sum(rows["status"] == 2), np.ascontiguousarray(rows["t_safe"]).view("u8").sum()))

    with tempfile.TemporaryDirectory() as folder:
        mesh.vertices.tofile(f"{folder}/vertices")
        mesh.triangles.tofile(f"{folder}/triangles")
        numbers.tofile(f"{folder}/numbers")

        def in_cpp():
            told = subprocess.run([baseline, folder, str(THREADS)], stdout=subprocess.PIPE, check=True)
            answers.append(told.stdout.decode().split())

        rounds = []
        for _ in range(ROUNDS):
            python = measure(in_python, resource.RUSAGE_SELF)
            in_cpp()
            hits, bits = map(int, answers[-1][:2])
            assert (hits, bits) == tuple(map(int, answers[-2])), "the answers differ"
            wall, cpu = map(float, answers[-1][2:])
            rounds.append((*python, wall, cpu))
    best = np.min(rounds, axis=0)
    print(f"{count} queries, {hits} hits, {THREADS} threads")
    print(f"wall: Python {best[0]:.3f} s, C++ {best[2]:.3f} s, ratio {best[0] / best[2]:.3f}")
    print(f"processor: Python {best[1]:.3f} s, C++ {best[3]:.3f} s, ratio {best[1] / best[3]:.3f}")


def single(baseline):
    a, b = dyop.Sphere(1), dyop.Sphere(0.5)
    here, there = dyop.RigidPose(), dyop.RigidPose(position=(3, 0, 0))
    rest = dyop.RestMotion()
    flight = dyop.ConstantTwistMotion(there, ((-1, 0, 0), (0, 0, 0)))
    interval, options = dyop.TimeInterval(0, 1), dyop.ToiOptions()
    told = subprocess.run([baseline], stdout=subprocess.PIPE, check=True).stdout.decode().split()
    for name, ask, cpp in (
        ("distance", lambda: dyop.distance(a, here, b, there), told[0]),
        ("time_of_impact", lambda: dyop.time_of_impact(a, rest, b, flight, interval, options), told[1]),
    ):
        seconds = timeit.repeat(ask, number=2000, repeat=60, timer=time.process_time)
        microseconds = min(seconds) / 2000 * 1e6
        print(f"{name} of two spheres: Python {microseconds:.2f} us, C++ {float(cpp):.2f} us")


if __name__ == "__main__":
    single(sys.argv[1])
    batch(sys.argv[1], int(sys.argv[2]) if len(sys.argv) > 2 else 100_000)
