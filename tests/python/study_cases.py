# SPDX-License-Identifier: BSD-3-Clause
"""What the workers of test_study.py run; they import it by name."""

import os
import signal
import time
from pathlib import Path

import numpy as np

import dyop


def flight(case, mesh):
    """Time of impact of two turning meshes, the second one started by the case's number."""
    generator = np.random.default_rng(case)
    q = generator.normal(size=4)
    start = dyop.RigidPose(quaternion=q / np.linalg.norm(q), position=(4, *generator.normal(size=2)))
    motion = dyop.ConstantTwistMotion(start, ((-2, 0, 0), 3 * generator.normal(size=3)))
    result = dyop.time_of_impact(mesh, dyop.RestMotion(), mesh, motion, (0, 3))
    return int(result.status), result.t_safe.hex()


def path_of_an_arm(case, chain, obstacles):
    """Until when a path of two waypoints, drawn by the case's number, is free."""
    generator = np.random.default_rng(case)
    path = dyop.JointPath.linear([0, 1], generator.uniform(-3, 3, size=(2, 2)))
    result = dyop.certify(chain, path, obstacles)
    return int(result.toi.status), result.toi.t_safe.hex(), result.link_a, result.obstacle


def slow(case):
    time.sleep(0.05)
    return case * case


def counted(case, folder):
    """Leaves a file per run of each case."""
    time.sleep(0.02)
    file = Path(folder) / f"{case}-{os.getpid()}-{time.monotonic_ns()}"
    file.touch()
    return case


def fails_at_three(case):
    if case == 3:
        raise ValueError("three is too many")
    return case


class SyntaxTrouble(Exception):
    """Pickles, but does not unpickle: its constructor does not take its `args`."""

    def __init__(self, message, line):
        super().__init__(f"{message} in line {line}")


class Numbered(Exception):
    """Unpickles to another message."""

    def __init__(self, message, line=0):
        super().__init__(f"{message}:{line}")


class Unreadable:
    """A result that pickles, but does not unpickle."""

    def __reduce__(self):
        return int, ("x",)


def gives_what_cannot_be_sent(case):
    if case == 1:
        raise SyntaxTrouble("bad token", 7)
    if case == 2:
        raise Numbered("bad token", 7)
    return Unreadable() if case == 3 else case


def nothing(case):
    return case


def pushed_stack(case, scene):
    """Where the cubes of a stack are 0.2 later if the upper one is pushed; the push is the case's."""
    options = scene.options
    options.thread_count = 1
    options.records_motions = False
    world = dyop.make_world(scene, options)
    top = world.bodies()[-1]
    generator = np.random.default_rng(case)
    world.set_state(top, (world.state(top).X_WB, (0.5 * generator.normal(size=3), (0, 0, 0))))
    world.advance(0.2)
    return np.concatenate([world.state(id).X_WB.translation for id in world.bodies()])


def misbehaves(case):
    """Cases 2 to 6 crash, hang, eat memory, end their process and return what cannot travel."""
    if case == 2:
        os.kill(os.getpid(), signal.SIGSEGV)
    if case == 3:
        time.sleep(1000)
    if case == 4:
        np.ones(10**10)
    if case == 5:
        os._exit(7)
    if case == 6:
        return (k for k in range(3))
    return case * case


def process_of(case, mesh):
    """Which process ran it, and at which address its mesh stands."""
    return os.getpid(), mesh.vertices.__array_interface__["data"][0]
