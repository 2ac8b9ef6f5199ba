# SPDX-License-Identifier: BSD-3-Clause
"""Reads a recording of `dyop simulate -o run.h5` with nothing but h5py and numpy.

    python3 read_recording.py run.h5          what happened
    python3 read_recording.py run.h5 T        and the pose of every body at the time T

docs/formats.md is the format. Motions that were given to kinematic bodies (kind 4) are JSON, which
this short reader leaves to dyop.
"""

import json
import sys

import h5py
import numpy as np

ABSENT, REST, TWIST, HERMITE, GIVEN, APPROXIMATE = range(6)
LENGTH = {ABSENT: 0, REST: 12, TWIST: 19, GIVEN: 2, APPROXIMATE: 35}
# Cubics that do not repeat what earlier rows hold: how many numbers they have for R_WC (one: its
# place) and for the start (the last ones of 13).
CUBICS = {3: (9, 13), 6: (9, 6), 7: (1, 13), 8: (1, 6), 9: (1, 0)}


def rotation(vector):
    """exp([vector]): a turn about the vector by its length."""
    angle = np.linalg.norm(vector)
    x, y, z = vector / angle if angle > 0 else vector
    K = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.eye(3) + np.sin(angle) * K + (1 - np.cos(angle)) * K @ K


def cubic(x0, rate0, x1, rate1, h, s):
    return ((2 * s**3 - 3 * s**2 + 1) * x0 + (s**3 - 2 * s**2 + s) * h * rate0
            + (3 * s**2 - 2 * s**3) * x1 + (s**3 - s**2) * h * rate1)


class Recording:
    """A recording, also of a run that is still going on or was killed."""

    def __init__(self, name):
        self.file = h5py.File(name, "r", swmr=True)
        self.frames = self.file["frames"][:]  # first: its last row says how long the others are
        last = self.frames[-1]
        self.header = json.loads(self.file.attrs["header"])
        lines = bytes(self.file["bodies"][: last["body_bytes"]]).decode().splitlines()
        self.bodies = {body["slot"]: body for body in map(json.loads, lines)}
        self.steps = self.file["steps"][: last["step_count"]]
        self.impacts = self.file["impacts"][: last["impact_count"]]
        self.segments = self.file["segments"][: last["segment_count"]]
        self.rows = {slot: np.flatnonzero(self.segments["body"] == slot) for slot in self.bodies}

    def numbers(self, row):
        """The numbers of a segment; those of a cubic made whole."""
        numbers, segment = self.file["numbers"], self.segments[row]
        first, kind = int(segment["first"]), int(segment["kind"])
        if kind not in CUBICS:
            return kind, numbers[first : first + LENGTH[kind]]
        chart_count, start_count = CUBICS[kind]
        x = numbers[first : first + chart_count + start_count + 13]
        place = first if chart_count == 9 else int(x[0])
        parts = [numbers[place : place + 9], x[chart_count:]]
        if start_count < 13:  # it starts where the row before ends
            mine = self.rows[int(segment["body"])]
            before = self.segments[mine[np.searchsorted(mine, row) - 1]]
            end = int(before["first"]) + sum(CUBICS[int(before["kind"])]) + 13
            parts.insert(1, numbers[end - 13 : end - start_count])
        return HERMITE, np.concatenate(parts)

    def pose(self, slot, t):
        """R_WB and p_WB of a body at a time, or None if it is absent."""
        mine = self.rows[slot]
        row = mine[np.searchsorted(self.segments["begin"][mine], t, side="right") - 1]
        kind, x = self.numbers(row)
        if kind == ABSENT:
            return None
        if kind == GIVEN:
            raise NotImplementedError("a given motion: read it with dyop")
        R, center = x[:9].reshape(3, 3), np.array(self.bodies[slot]["p_BoBcm"])
        if kind == REST:
            return R, x[9:12]
        if kind == TWIST:
            R, p = rotation((t - x[18]) * x[15:18]) @ R, x[9:12] + (t - x[18]) * x[12:15]
        else:
            t0, p0, v0, theta0, rate0 = x[9], x[10:13], x[13:16], x[16:19], x[19:22]
            t1, p1, v1, theta1, rate1 = x[22], x[23:26], x[26:29], x[29:32], x[32:35]
            h, s = t1 - t0, (t - t0) / (t1 - t0)
            R, p = R @ rotation(cubic(theta0, rate0, theta1, rate1, h, s)), cubic(p0, v0, p1, v1, h, s)
        return R, p if kind == APPROXIMATE else p - R @ center


if __name__ == "__main__":
    run = Recording(sys.argv[1])
    print(f"{run.header['title']}: {len(run.bodies)} bodies, {len(run.steps)} steps, "
          f"{len(run.segments)} segments, {len(run.impacts)} impacts, up to t = {run.frames[-1]['end']:g}")
    for t in map(float, sys.argv[2:]):
        for slot, body in run.bodies.items():
            R, p = run.pose(slot, t)
            print(json.dumps({"t": t, "body": body["name"], "R": R.ravel().tolist(), "p": p.tolist()}))
