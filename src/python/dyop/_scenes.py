# SPDX-License-Identifier: BSD-3-Clause
"""Scenes in Python: stepping them through, and carrying them to another machine."""

import json
import math
import tempfile
import time
from pathlib import Path, PurePosixPath
from typing import NamedTuple

from . import _dyop
from ._progress import call_of

# A rest shorter than this part of a step is no step of its own: only rounding makes one.
_NO_STEP = 1e-6


class Simulation(NamedTuple):
    """Result of simulate()."""

    totals: "_dyop.RunTotals"  #: sums, and how the run ended
    impacts: list  #: all ImpactEvents, in order of time
    world: "_dyop.World"  #: as the run left it


def _recorder(scene, file):
    if not hasattr(_dyop, "RecordingWriter"):
        raise _dyop.FileError(f"{file}: this dyop was built without HDF5")
    return _dyop.RecordingWriter(file, _dyop.run_header(scene))


def simulate(scene, recording=None, *, options=None, progress=None):
    """Steps a scene from time 0 to its end.

    recording: file for the recording in HDF5, as ``dyop simulate -o`` writes it; None: no file.
    options: WorldOptions in place of ``scene.options``. progress(t, end_time) is called after each
    step; True draws a bar. Ends early where World.advance() does: see ``totals.status``.
    """
    if not isinstance(scene, _dyop.Scene):
        raise TypeError(f"scene must be a Scene, as load_scene() gives, not {type(scene).__name__}")
    progress = call_of(progress)
    world = _dyop.make_world(scene, options)
    recorder = None if recording is None else _recorder(scene, recording)
    totals = _dyop.RunTotals()
    impacts = []
    count = max(1, math.ceil(scene.end_time / scene.step - _NO_STEP))
    try:
        for k in range(1, count + 1):
            end = scene.end_time if k == count else k * scene.step
            report = world.advance(end - world.time())
            totals.add(report)
            impacts += report.impacts
            if recorder is not None:
                recorder.write(report, world)
            if progress is not None:
                progress(world.time(), scene.end_time)
            if report.status != _dyop.AdvanceStatus.Completed:
                break
    except BaseException as error:  # Ctrl-C and what progress raises, too
        if recorder is not None:
            recorder.fail(str(error) or type(error).__name__)
        raise
    if recorder is not None:
        recorder.finish()
    return Simulation(totals, impacts, world)


def summary(scene, simulation, started=None):
    """What happened in a simulate() run, for a person to read.

    started: time.monotonic() before the run, for the line that tells how long it took.
    """
    seconds = 0.0 if started is None else time.monotonic() - started
    return _dyop.describe_run(scene, simulation.impacts, simulation.totals, seconds)


def _mesh_names(node):
    """The mesh files that a scene names, wherever they stand."""
    if isinstance(node, dict):
        for key, value in node.items():
            if key == "mesh" and isinstance(value, str):
                yield value
            else:
                yield from _mesh_names(value)
    elif isinstance(node, list):
        for item in node:
            yield from _mesh_names(item)


def reduce_scene(scene):
    """What is pickled: the scene file and the mesh files it names."""
    carried = getattr(scene, "_carried", None)
    if carried is not None:
        return restore_scene, carried
    directories = [Path(scene.file).parent, *map(Path, scene.mesh_directories)]
    meshes = {}
    for name in sorted(set(_mesh_names(json.loads(scene.source)))):
        if not PurePosixPath(name).is_absolute():
            found = next((d / name for d in directories if (d / name).is_file()), None)
            if found is None:
                raise _dyop.FileError(f"{name}: cannot be pickled, it is gone from {directories[0]}")
            meshes[name] = found.read_bytes()
    return restore_scene, (Path(scene.file).name, scene.source, meshes)


def restore_scene(file_name, source, meshes):
    """The scene of what reduce_scene() gave."""
    depth = max([PurePosixPath(name).parts.count("..") for name in meshes], default=0)
    with tempfile.TemporaryDirectory() as directory:
        folder = Path(directory).joinpath(*["up"] * depth)  # so that ".." stays inside
        folder.mkdir(parents=True, exist_ok=True)
        (folder / file_name).write_text(source, encoding="utf-8")
        for name, data in meshes.items():
            (folder / name).parent.mkdir(parents=True, exist_ok=True)
            (folder / name).write_bytes(data)
        scene = _dyop.load_scene(folder / file_name)
    scene._carried = (file_name, source, meshes)  # its files are gone
    return scene
