# SPDX-License-Identifier: BSD-3-Clause
"""What numpy offers: types, strides, read-only, empty, not finite; and whose memory is read."""

import sys
import tracemalloc

import numpy as np
import pytest

import dyop
from conftest import uv_sphere


def same_mesh(mesh, vertices, triangles):
    np.testing.assert_array_equal(mesh.vertices, vertices)
    np.testing.assert_array_equal(mesh.triangles, triangles)


@pytest.mark.parametrize("vertex_type", [np.float64, np.float32, np.float16, ">f8", np.longdouble])
@pytest.mark.parametrize("index_type", [np.int32, np.uint32, np.int64, np.uint8, np.uint64])
def test_number_types(vertex_type, index_type):
    vertices, triangles = uv_sphere(4, 5)
    vertices = vertices.astype(np.float16).astype(vertex_type)
    offered = triangles.astype(index_type)
    if vertex_type is np.longdouble or index_type is np.uint64:  # float64, int64 cannot hold these
        with pytest.raises(dyop.InvalidArgument, match="must be an"):
            dyop.TriangleMesh(vertices, offered)
        return
    same_mesh(dyop.TriangleMesh(vertices, offered), vertices.astype(float), triangles)


def test_strides_and_order():
    vertices, triangles = uv_sphere(4, 5)
    wide = np.zeros((len(vertices), 7), dtype=np.float32)
    wide[:, 2:5] = vertices
    records = np.zeros(len(triangles), dtype=[("tag", "u1"), ("corners", "i4", 3)])  # unaligned
    records["corners"] = triangles
    same_mesh(
        dyop.TriangleMesh(wide[:, 2:5], records["corners"], copy=False), wide[:, 2:5], triangles
    )
    backward = dyop.TriangleMesh(vertices[::-1], triangles)
    np.testing.assert_array_equal(backward.vertices, vertices[::-1])
    same_mesh(dyop.TriangleMesh(np.asfortranarray(vertices), triangles), vertices, triangles)
    same_mesh(dyop.TriangleMesh(vertices.tolist(), triangles.tolist()), vertices, triangles)


def test_read_only_arrays_are_read():
    vertices, triangles = uv_sphere(4, 5)
    vertices.flags.writeable = triangles.flags.writeable = False
    same_mesh(dyop.TriangleMesh(vertices, triangles, copy=False), vertices, triangles)


@pytest.mark.parametrize(
    "change",
    [
        lambda v, t: (v.tolist(), t),
        lambda v, t: (np.asfortranarray(v), t),
        lambda v, t: (v[::-1], t),
        lambda v, t: (v.astype(">f8"), t),
        lambda v, t: (v, t.astype(np.int64)),
        lambda v, t: (v, t.tolist()),
    ],
)
def test_copy_false_refuses_what_must_be_copied(change):
    offered = change(*uv_sphere(4, 5))
    dyop.TriangleMesh(*offered)
    with pytest.raises(dyop.InvalidArgument, match="copy=False"):
        dyop.TriangleMesh(*offered, copy=False)


def test_views_of_a_mesh_are_its_memory_and_keep_it_alive():
    mesh = dyop.TriangleMesh(*uv_sphere(4, 5))
    vertices, again = mesh.vertices, mesh.vertices
    assert vertices.ctypes.data == again.ctypes.data and vertices.ctypes.data != 0
    assert not vertices.flags.owndata and not vertices.flags.writeable
    with pytest.raises(ValueError):
        vertices[0, 0] = 1
    expected = vertices.copy()
    holders = sys.getrefcount(mesh)
    del again
    assert sys.getrefcount(mesh) == holders - 1
    del mesh
    np.testing.assert_array_equal(vertices, expected)


def test_contiguous_points_are_read_where_they_are():
    points = np.ones((4, 3))
    assert dyop.as_rows(points).ctypes.data == points.ctypes.data
    assert dyop.as_rows(points, copy=False).ctypes.data == points.ctypes.data
    assert dyop.as_rows(points[1:3], copy=False).ctypes.data == points[1:3].ctypes.data
    other = points.astype(np.float32)
    assert dyop.as_rows(other).ctypes.data != other.ctypes.data
    for refused in (other, points[:, ::-1], np.ones((4, 6))[:, :3], [[1, 2, 3]]):
        with pytest.raises(dyop.InvalidArgument, match="copy=False"):
            dyop.as_rows(refused, copy=False)


def test_batches_copy_no_points():
    points = np.random.default_rng(1).normal(size=(100_000, 3))
    out = np.empty(len(points), dyop.point_row)
    tracemalloc.start()
    rows = dyop.point_distance_batch(
        dyop.Sphere(1), np.eye(4), points, copy=False, out=out, thread_count=1
    )
    peak = tracemalloc.get_traced_memory()[1]  # numpy reports its allocations
    tracemalloc.stop()
    assert rows is out
    assert peak < points.nbytes / 10
    expected = np.maximum(np.linalg.norm(points, axis=1) - 1, 0)
    np.testing.assert_allclose(out["upper"], expected, atol=1e-14)


def test_empty_arrays():
    none = np.zeros((0, 3))
    assert len(dyop.point_distance_batch(dyop.Sphere(1), np.eye(4), none)) == 0
    assert len(dyop.distance_batch(dyop.Sphere(1), np.zeros((0, 4, 4)), dyop.Sphere(1), np.eye(4))) == 0
    assert dyop.as_rows(none, copy=False).shape == (0, 3)
    with pytest.raises(dyop.InvalidArgument, match=r"\(N, 3\)"):
        dyop.point_distance_batch(dyop.Sphere(1), np.eye(4), [])


def test_numbers_that_are_not_finite_are_named():
    points = np.zeros((5, 3))
    points[3, 1] = np.nan
    with pytest.raises(dyop.InvalidArgument, match="3.*nan"):
        dyop.point_distance_batch(dyop.Sphere(1), np.eye(4), points)
    with pytest.raises(dyop.InvalidArgument, match="inf"):
        dyop.point_distance(dyop.Sphere(1), np.eye(4), (0, np.inf, 0))


@pytest.mark.parametrize("bad", [None, "x", [1, 2], [[1, 2, 3]], ["a", "b", "c"], [1, 2, 3j]])
def test_a_bad_vector_is_refused(bad):
    with pytest.raises((dyop.InvalidArgument, TypeError)):
        dyop.Box(bad)


def test_out_must_fit():
    points = np.zeros((3, 3))
    for out in (np.empty(2, dyop.point_row), np.empty(3, dyop.toi_row), np.empty(6, dyop.point_row)[::2]):
        with pytest.raises(dyop.InvalidArgument, match="out"):
            dyop.point_distance_batch(dyop.Sphere(1), np.eye(4), points, out=out)
