# SPDX-License-Identifier: BSD-3-Clause
"""Pages of what a reader has at hand, and bars of progress."""

import html
import io
import re
import sys
import types

import pytest

import dyop
from dyop import _progress, _view

needs_page = pytest.mark.skipif(not dyop.has_page(), reason="built without the page")


def page_of(thing, *args, **options):
    page = dyop.view(thing, *args, **options)
    assert page.html.startswith("<!") and "</html>" in page.html
    return page


@needs_page
def test_a_shape_shows_itself_in_a_notebook(ball_mesh, tmp_path):
    text = ball_mesh._repr_html_()
    frame = re.fullmatch(r'<iframe srcdoc="(.*)" width="100%" height="480" style.*></iframe>', text, re.S)
    assert html.unescape(frame[1]) == page_of(ball_mesh).html
    page_of(ball_mesh).save(tmp_path / "ball.html")
    assert (tmp_path / "ball.html").read_text(encoding="utf-8") == page_of(ball_mesh).html


@needs_page
def test_shapes_stand_and_move(ball_mesh):
    flight = dyop.ConstantTwistMotion(dyop.RigidPose(), ((1, 0, 0), (0, 0, 3)))
    both = {"ball": ball_mesh, "box": (dyop.Box([1, 1, 1]), flight)}
    page = page_of(both, interval=(0, 2), title="<Flight>")
    assert "&lt;Flight&gt;" in page.html and "<Flight>" not in page.html
    assert page_of([dyop.Sphere(1), dyop.Box([1, 1, 1])]).html != page.html
    short = dyop.SampledMotion([0, 1], [dyop.RigidPose()] * 2)
    with pytest.raises(dyop.InvalidArgument, match="defined from 0 to 1"):
        dyop.view(ball_mesh, short, interval=(2, 3))


@needs_page
def test_robots_show_a_state_a_path_and_what_is_around():
    bar = dyop.CompoundShape([(dyop.Box([0.5, 0.05, 0.05]), ((1, 0, 0, 0), (0.5, 0, 0)))])
    links = [dyop.Link(name="base"), dyop.Link(name="arm", shape=bar)]
    robot = dyop.make_robot(
        "r", dyop.KinematicChain(links, [dyop.Joint(parent="base", child="arm", name="turn")])
    )
    around = dyop.ObstacleSet()
    around.add(dyop.Sphere(0.2), ((1, 0, 0, 0), (0, 1.3, 0)))
    still = page_of(robot, [0.3])
    moving = page_of(robot, dyop.JointPath.linear([0, 2], [[0.0], [1.0]]), among=around)
    assert still.html != moving.html and "iframe" in robot._repr_html_()
    assert "iframe" in around._repr_html_()


@needs_page
def test_scenes_worlds_and_recordings_are_pages(tmp_path):
    dyop.write_generated_scene(dyop.generate_scene("stack", 2), tmp_path / "s.json")
    scene = dyop.load_scene(tmp_path / "s.json")
    assert "iframe" in scene._repr_html_()
    assert "iframe" in dyop.make_world(scene)._repr_html_()
    if not hasattr(dyop, "RecordingReader"):
        return
    dyop.simulate(scene, tmp_path / "run.h5", progress=True)
    reader = dyop.RecordingReader(tmp_path / "run.h5")
    assert reader.file == str(tmp_path / "run.h5")
    assert page_of(reader).html == page_of(tmp_path / "run.h5").html


def test_without_its_page_a_thing_is_text(monkeypatch):
    monkeypatch.setattr(_view._dyop, "has_page", lambda: False)
    assert dyop.Sphere(1)._repr_html_() is None


@needs_page
def test_show_opens_a_browser_or_the_notebook(monkeypatch, tmp_path):
    opened = []
    monkeypatch.setattr("webbrowser.open", opened.append)
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    dyop.Sphere(1).show(title="One")
    assert re.fullmatch(r"file://.*/dyop-.*\.html", opened[0])
    shown = []
    ipython = types.ModuleType("IPython")
    ipython.get_ipython = lambda: types.SimpleNamespace(kernel=None)
    display = types.ModuleType("IPython.display")
    display.display = shown.append
    monkeypatch.setitem(sys.modules, "IPython", ipython)
    monkeypatch.setitem(sys.modules, "IPython.display", display)
    dyop.Sphere(1).show()
    assert isinstance(shown[0], dyop.Page) and len(opened) == 1


def test_a_bar_is_drawn_on_a_terminal_only(monkeypatch):
    class Terminal(io.StringIO):
        def isatty(self):
            return True

    for stream, drawn in ((Terminal(), True), (io.StringIO(), False)):
        monkeypatch.setattr(sys, "stderr", stream)
        shapes = [dyop.Sphere(1)] * 5
        dyop.distance_batch(
            shapes, dyop.RigidPose(), dyop.Sphere(1), ((1, 0, 0, 0), (4, 0, 0)), progress=True
        )
        assert ("5/5" in stream.getvalue()) == drawn
    assert _progress.call_of(False) is None


def test_texts_take_one_screen_at_most(all_shapes, all_motions):
    result = dyop.time_of_impact(
        dyop.Sphere(1), dyop.RestMotion(), dyop.Sphere(1),
        dyop.ConstantTwistMotion(((1, 0, 0, 0), (5, 0, 0)), ((-1, 0, 0), (0, 0, 0))), (0, 9),
    )
    for thing in [*all_shapes, *all_motions, result]:
        assert len(repr(thing)) < 80 * 24, repr(thing)
