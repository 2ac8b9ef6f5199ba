# SPDX-License-Identifier: BSD-3-Clause
"""Looking at shapes, motions, robots and runs: in a notebook, in a browser, as a file."""

import html as _html
import os
import tempfile
import webbrowser
from pathlib import Path

from . import _dyop
from ._progress import is_notebook

# Larger pages are not put into a notebook by themselves: each display would store one.
_MOST_INLINE = 32_000_000


class Page:
    """A page that shows something (docs/player.md): one HTML file that needs no network.

    In a notebook it is the last value of a cell, or ``display(page)``.
    """

    def __init__(self, html, height=480):
        self.html = html  #: the whole page
        self.height = height  #: in a notebook, in pixels

    def save(self, file):
        """Writes the page to a file."""
        Path(file).write_text(self.html, encoding="utf-8")

    def show(self):
        """Shows the page: in a notebook below the cell, otherwise in the browser."""
        if is_notebook():
            from IPython.display import display

            display(self)
            return
        handle, name = tempfile.mkstemp(prefix="dyop-", suffix=".html")
        with os.fdopen(handle, "w", encoding="utf-8") as file:
            file.write(self.html)
        webbrowser.open(Path(name).as_uri())

    def _repr_html_(self):
        return (
            f'<iframe srcdoc="{_html.escape(self.html)}" width="100%" height="{self.height}" '
            'style="border: 0" allowfullscreen></iframe>'
        )

    def __repr__(self):
        return f"Page({len(self.html) / 1e6:.1f} MB)"


def _named(things):
    """Tuples (name, shape, pose or motion) of a dict, or of a sequence of shapes or pairs."""
    items = things.items() if isinstance(things, dict) else enumerate(things)
    for name, thing in items:
        shape, placed = thing if isinstance(thing, tuple) else (thing, _dyop.RigidPose())
        if not isinstance(shape, _dyop.Shape):
            shape = _dyop.TriangleMesh(shape)
        yield str(name), shape, placed


def _robot_bodies(robot, at):
    if isinstance(at, _dyop.JointPath):
        path = robot.expand(at)
        poses = robot.link_poses(at.position(at.domain().begin))
        placed = [
            X if robot.chain.is_fixed(k) else _dyop.LinkMotion(robot.chain, path, k)
            for k, X in enumerate(poses)
        ]
    else:
        if at is None:
            at = [min(max(0.0, low), high) for low, high in zip(robot.lower, robot.upper)]
        placed = robot.link_poses(at)
    return [
        (link.name, link.shape, X) for link, X in zip(robot.links, placed) if link.shape is not None
    ]


def _bodies_of(thing, at):
    if isinstance(thing, _dyop.Robot):
        return _robot_bodies(thing, at)
    if isinstance(thing, _dyop.Scene):
        return [(body.name, body.shape, body.initial.X_WB) for body in thing.bodies]
    if isinstance(thing, _dyop.World):
        bodies = [(thing.body(i), thing.state(i).X_WB) for i in thing.bodies()]
        return [(body.name, body.shape, X) for body, X in bodies]
    if isinstance(thing, _dyop.PlanningScene):
        return [(each.name, each.shape, each.X_WO) for each in thing.objects]
    if isinstance(thing, _dyop.ObstacleSet):
        obstacles = [(str(i), thing.obstacle(i)) for i in thing.ids()]
        return [(name, each.shape, each.X_WO) for name, each in obstacles]
    if isinstance(thing, (dict, list, tuple)) and not isinstance(thing, _dyop.Shape):
        return list(_named(thing))
    return list(_named([(thing, _dyop.RigidPose() if at is None else at)]))


def _interval_of(bodies, at):
    if isinstance(at, _dyop.JointPath):
        return at.domain()
    domains = [X.domain() for _, _, X in bodies if isinstance(X, _dyop.Motion)]
    begin = max([d.begin for d in domains], default=0.0)
    end = min([d.end for d in domains], default=0.0)
    begin = begin if begin > float("-inf") else min(0.0, end)
    return begin, end if end < float("inf") else begin + 1.0


def _title_of(thing):
    for name in ("title", "name"):
        if isinstance(getattr(thing, name, None), str):
            return getattr(thing, name)
    return "" if isinstance(thing, (dict, list, tuple)) else type(thing).__name__


def view(thing, at=None, *, among=None, interval=None, title=None, height=480):
    """The page that shows a shape, a mesh, a robot, a scene, a World, obstacles or a recorded run.

    thing: one of these; the name of a recording's file; a sequence or a dict, by name, of shapes or
    pairs (shape, pose or Motion); any mesh that TriangleMesh takes. at: the pose or Motion of one
    shape; the free coordinates or the JointPath of a robot. among: what stands around, of the same
    kinds. interval: (begin, end), the times that are shown; without it, where all motions are
    defined. height: in a notebook, in pixels. Returns a Page: show() it, save() it, or let a
    notebook show it as a cell's value.
    """
    if isinstance(thing, (str, os.PathLike)):
        return Page(_dyop.recorded_page_html(thing), height)
    if hasattr(_dyop, "RecordingReader") and isinstance(thing, _dyop.RecordingReader):
        return Page(_dyop.recorded_page_html(thing.file), height)
    bodies = _bodies_of(thing, at)
    if among is not None:
        bodies += _bodies_of(among, None)
    shown = _interval_of(bodies, at) if interval is None else interval
    return Page(_dyop.page_html(_title_of(thing) if title is None else title, bodies, shown), height)


def repr_html(thing):
    """What a notebook shows of a thing; None: its text."""
    if not _dyop.has_page():
        return None
    page = view(thing)
    return page._repr_html_() if len(page.html) < _MOST_INLINE else None
