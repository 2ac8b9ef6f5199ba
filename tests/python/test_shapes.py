# SPDX-License-Identifier: BSD-3-Clause
import pickle
from types import SimpleNamespace

import numpy as np
import pytest

import dyop
from conftest import uv_sphere


def test_sphere_box_capsule_have_closed_forms():
    sphere = dyop.Sphere(2).compute_mass_properties(3)
    assert sphere.mass == pytest.approx(3 * 4 / 3 * np.pi * 8)
    np.testing.assert_allclose(sphere.I_BBcm, np.eye(3) * 0.4 * sphere.mass * 4)
    box = dyop.Box([1, 2, 3]).compute_mass_properties(1)
    assert box.mass == pytest.approx(48)
    np.testing.assert_allclose(np.diag(box.I_BBcm), [16 * 13, 16 * 10, 16 * 5])
    low, high = dyop.Capsule(1, 2).bounding_box()
    np.testing.assert_allclose(low, [-1, -1, -3], rtol=1e-15)
    np.testing.assert_allclose(high, [1, 1, 3], rtol=1e-15)
    assert dyop.with_mass(box, 2).mass == pytest.approx(2)


def test_kinds_and_radii(all_shapes):
    kinds = [shape.kind().name for shape in all_shapes]
    assert kinds == ["Convex"] * 4 + ["TriangleMesh", "Compound"]
    for shape in all_shapes:
        low, high = shape.bounding_box()
        assert np.all(low < high)
        assert shape.bounding_radius() <= np.linalg.norm(np.maximum(-low, high)) * (1 + 1e-12)
        assert repr(shape)


def test_support_of_a_hull_is_its_farthest_corner(generator):
    points = generator.normal(size=(50, 3))
    hull = dyop.ConvexHull(points)
    assert hull.dimension() == 3
    for direction in generator.normal(size=(20, 3)):
        unit = direction / np.linalg.norm(direction)
        assert hull.support(unit) @ unit == pytest.approx((points @ unit).max(), rel=1e-14)
    assert {tuple(v) for v in hull.vertices} <= {tuple(p) for p in points}


def test_mesh_is_closed_and_weighs_what_it_encloses():
    mesh = dyop.TriangleMesh(*uv_sphere(60, 80))
    assert mesh.is_closed()
    assert mesh.compute_mass_properties(1).mass == pytest.approx(4 / 3 * np.pi, rel=5e-3)
    assert mesh.compute_shell_mass_properties(1).mass == pytest.approx(4 * np.pi, rel=5e-3)
    assert dyop.winding_number(mesh, (0, 0, 0)) == 1
    assert dyop.contains(mesh, (0.5, 0.1, 0)) and not dyop.contains(mesh, (2, 0, 0))


def test_with_vertices_refits(ball_mesh):
    moved = ball_mesh.with_vertices(np.asarray(ball_mesh.vertices) + [10, 0, 0])
    np.testing.assert_array_equal(moved.triangles, ball_mesh.triangles)
    result = dyop.distance(moved, dyop.RigidPose(), dyop.Sphere(1), dyop.RigidPose())
    assert result.lower <= 8.0 <= result.upper + 0.1
    with pytest.raises(dyop.InvalidArgument, match="vertices"):
        ball_mesh.with_vertices(np.zeros((3, 3)))


def test_compound_names_its_children(ball_mesh):
    inner = dyop.CompoundShape([(dyop.Sphere(1), np.eye(4))])
    far = dyop.RigidPose(position=(5, 0, 0))
    compound = dyop.CompoundShape([(inner, np.eye(4)), (ball_mesh, far)])
    shapes = [shape for shape, _ in compound.children]
    assert isinstance(shapes[0], dyop.Sphere) and isinstance(shapes[1], dyop.TriangleMesh)
    result = dyop.distance(compound, np.eye(4), dyop.Sphere(1), ((1, 0, 0, 0), (8, 0, 0)))
    assert result.child_a == 1 and result.child_b is None
    with pytest.raises(dyop.InvalidArgument):
        dyop.CompoundShape([])


def test_rounded_and_tapered_shapes_reach_their_radius_beyond():
    box = dyop.ConvexHull([(x, y, z) for x in (-1, 1) for y in (-2, 2) for z in (-3, 3)], 0.5)
    assert box.rounding_radius() == 0.5
    alike = dyop.RoundedBox([1, 2, 3], 0.5).compute_mass_properties(2)
    assert box.compute_mass_properties(2).mass == pytest.approx(alike.mass, rel=1e-12)
    disc = dyop.RoundedCylinder(radius=1, half_length=2, edge_radius=0.5)
    cone = dyop.TaperedCapsule(bottom_radius=1.5, top_radius=0.5, half_length=2)
    assert repr(disc) == "RoundedCylinder(1.0, 2.0, 0.5)"
    for shape, reach in ((box, 3.5), (disc, 2.5), (cone, 2.5)):
        copied = pickle.loads(pickle.dumps(shape))
        assert type(copied) is type(shape)
        np.testing.assert_allclose(copied.support((0, 0, 1))[2], reach, rtol=1e-14)
    with pytest.raises(dyop.InvalidArgument, match="holds the other"):
        dyop.TaperedCapsule(3, 1, 1)


def test_half_space_has_no_end():
    floor = dyop.HalfSpace((0, 0, 3), 1)
    np.testing.assert_array_equal(floor.normal, [0, 0, 1])
    assert floor.offset == 1 and repr(floor) == "HalfSpace([0.0, 0.0, 1.0], 1.0)"
    copied = pickle.loads(pickle.dumps(floor))
    ball, place = dyop.Sphere(0.5), dyop.RigidPose(position=(1e5, -1e5, 4))
    result = dyop.distance(copied, dyop.RigidPose(), ball, place)
    assert result.lower <= 2.5 <= result.upper and result.upper - result.lower < 1e-8
    falling = dyop.ConstantTwistMotion(place, dyop.Twist(v_WB=(3, 0, -1)))
    impact = dyop.time_of_impact(dyop.HalfSpace(), dyop.RestMotion(), ball, falling, (0, 10))
    assert impact.status == dyop.ToiStatus.Impact
    assert impact.t_safe == pytest.approx(3.5, abs=1e-5)
    with pytest.raises(dyop.InvalidArgument, match="normal"):
        dyop.HalfSpace((0, 0, 0))


def test_scaled_shapes():
    egg = dyop.scaled(dyop.Sphere(1), (1, 2, 3))
    np.testing.assert_array_equal(egg.semi_axes, [1, 2, 3])
    assert dyop.scaled(dyop.Sphere(1), 2).radius == 2
    mirrored = dyop.scaled(dyop.Box((1, 2, 3)), [-2, 1, 1])
    np.testing.assert_array_equal(mirrored.half_extents, [2, 2, 3])
    with pytest.raises(dyop.InvalidArgument, match="cannot be scaled by"):
        dyop.scaled(dyop.Capsule(1, 2), (1, 1, 2))
    with pytest.raises(dyop.InvalidArgument, match="not zero"):
        dyop.scaled(egg, 0)


def test_height_field_is_closed_ground():
    x, y = np.meshgrid(np.arange(5) * 2.0, np.arange(3) * 0.5)
    slope = 0.25 * x - y  # rows along y, columns along x
    ground = dyop.height_field(slope, (2, 0.5), origin=(10, 20), base=-3)
    assert ground.is_closed() and ground.compute_mass_properties(1).mass == pytest.approx(8 * 3.5)
    np.testing.assert_array_equal(ground.vertices[:15, 2], slope.ravel())
    np.testing.assert_array_equal(ground.vertices[14], [18, 21, 1])
    hit = dyop.ray_cast(ground, dyop.RigidPose(), (10 + 5.1, 20 + 0.7, 9), (0, 0, -1))
    assert hit.p_WC[2] == pytest.approx(0.25 * 5.1 - 0.7, abs=1e-12)
    copied = pickle.loads(pickle.dumps(ground))
    np.testing.assert_array_equal(copied.vertices, ground.vertices)
    transposed = dyop.height_field(np.zeros((3, 2), dtype=np.float32).T)
    assert len(transposed.triangles) == 4 + 3 * 6
    with pytest.raises(dyop.InvalidArgument, match="row 0, column 1"):
        dyop.height_field([[0, np.nan], [0, 0]])
    with pytest.raises(dyop.InvalidArgument, match="not one of 1 dimensions"):
        dyop.height_field([0, 1])
    with pytest.raises(dyop.InvalidArgument, match="array of numbers"):
        dyop.height_field("hills")


@pytest.mark.parametrize(
    "make, said",
    [
        (lambda: dyop.Sphere(0), "0"),
        (lambda: dyop.Sphere(float("nan")), "nan"),
        (lambda: dyop.Box([1, -2, 1]), "-2"),
        (lambda: dyop.Capsule(1, -1), "-1"),
        (lambda: dyop.ConvexHull(np.zeros((0, 3))), "point"),
        (lambda: dyop.TriangleMesh(np.zeros((3, 3)), np.zeros((0, 3), np.int32)), "triangle"),
        (lambda: dyop.TriangleMesh(np.zeros((3, 3)), [[0, 1, 3]]), "3"),
        (lambda: dyop.TriangleMesh(np.zeros((3, 3)), [[0, 1, -1]]), "-1"),
        (lambda: dyop.TriangleMesh(np.full((3, 3), np.nan), [[0, 1, 2]]), "nan"),
    ],
)
def test_bad_shapes_are_refused_with_the_value(make, said):
    with pytest.raises(dyop.InvalidArgument, match=said):
        make()
    with pytest.raises(ValueError):
        make()


def test_mesh_files_are_read_and_placed(tmp_path):
    file = tmp_path / "triangle.obj"
    file.write_text("v 0 0 0\nv 2 0 0\nv 0 4 0\nf 1 2 3\n")
    mesh = dyop.load_mesh(file)
    np.testing.assert_array_equal(mesh.vertices, [[0, 0, 0], [2, 0, 0], [0, 4, 0]])
    placed = dyop.place_mesh(mesh, scale=2, center=dyop.MeshCenter.Bounds)
    np.testing.assert_array_equal(placed.vertices, [[-2, -4, 0], [2, -4, 0], [-2, 4, 0]])
    file.write_text("v 0 0 x\n")
    with pytest.raises(dyop.FileError, match="triangle.obj") as caught:
        dyop.load_mesh(str(file))
    assert caught.value.file == str(file) and caught.value.line == 1
    assert isinstance(caught.value, OSError) and isinstance(caught.value, dyop.Error)


class Cells:
    """A mesh as meshio has it."""

    def __init__(self, points, **cells):
        self.points = points
        self.cells_dict = cells


def test_meshes_of_other_libraries(ball_mesh):
    points, triangles = ball_mesh.vertices.copy(), ball_mesh.triangles.astype(np.int64)
    others = [
        SimpleNamespace(vertices=points, faces=triangles),  # trimesh
        SimpleNamespace(vertices=points.tolist(), triangles=triangles),  # Open3D
        SimpleNamespace(points=points, regular_faces=triangles, faces=triangles.ravel()),  # PyVista
        Cells(points, triangle=triangles, line=triangles[:, :2]),
        ball_mesh,
    ]
    for other in others:
        mesh = dyop.TriangleMesh(other)
        np.testing.assert_array_equal(mesh.vertices, points)
        np.testing.assert_array_equal(mesh.triangles, triangles)
    with pytest.raises(dyop.InvalidArgument, match="quad"):
        dyop.TriangleMesh(Cells(points, triangle=triangles, quad=triangles))
    with pytest.raises(dyop.InvalidArgument, match="triangle"):
        dyop.TriangleMesh(Cells(points))
    with pytest.raises(dyop.InvalidArgument, match="type int"):
        dyop.TriangleMesh(3)


def test_occupied_space(tmp_path):
    cubes = dyop.occupancy([(0, 0, 0), (3, 0, 0)], [1, 2])
    assert dyop.point_distance(cubes, dyop.RigidPose(), (0, 2, 0)).upper == pytest.approx(1.5)
    cloud = dyop.point_cloud(np.array([(0.0, 0, 0), (1, 0, 0)]), 0.25)
    assert dyop.point_distance(cloud, dyop.RigidPose(), (3, 0, 0)).lower == pytest.approx(1.75)
    file = tmp_path / "map.bt"
    head = b"# Octomap OcTree binary file\nid OcTree\nsize 2\nres 0.25\ndata\n"
    file.write_bytes(head + b"\x00\x80")
    tree = dyop.load_octree(file)
    np.testing.assert_allclose(tree.bounding_box(), [[0] * 3, [8192] * 3], atol=1e-8)
    with pytest.raises(dyop.InvalidArgument, match="2 centers and 1 sizes"):
        dyop.occupancy([(0, 0, 0), (3, 0, 0)], [1])
    with pytest.raises(dyop.FileError, match="truncated"):
        file.write_bytes(head + b"\x00")
        dyop.load_octree(file)
