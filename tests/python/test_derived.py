# SPDX-License-Identifier: BSD-3-Clause
"""Classes of Python that derive from Motion and ConvexShape."""

import gc
import pickle
import weakref

import numpy as np
import pytest

import dyop


class Circle(dyop.Motion):
    """Round the origin at distance 2, once in a time 2 pi / rate."""

    def __init__(self, rate, end=np.inf):
        super().__init__()
        self.rate, self.end = rate, end

    def pose(self, t):
        return dyop.RigidPose(position=(2 * np.cos(self.rate * t), 2 * np.sin(self.rate * t), 0))

    def twist(self, t):
        speed = 2 * self.rate
        return (-speed * np.sin(self.rate * t), speed * np.cos(self.rate * t), 0), (0, 0, 0)

    def twist_bound(self, interval):
        up = 1 + 1e-9
        return 2 * self.rate * up, 0, 2 * self.rate**2 * up, 0

    def domain(self):
        return 0, self.end


class Lens(dyop.ConvexShape):
    """The ball of radius 1 about the origin, squeezed to 0.2 along z."""

    axes = np.array([1, 1, 0.2])

    def core_support(self, direction):
        scaled = direction * self.axes
        return scaled * self.axes / max(np.linalg.norm(scaled), 1e-300)


class Pill(dyop.ConvexShape):
    """A capsule that says all there is to say."""

    def core_support(self, direction):
        return ((0, 0, 1.5), 1) if direction[2] > 0 else ((0, 0, -1.5), 0)

    def rounding_radius(self):
        return 0.25

    def core_center(self):
        return 0, 0, 0

    def bounding_radius(self):
        return 1.75

    def compute_mass_properties(self, density):
        return dyop.Capsule(0.25, 1.5).compute_mass_properties(density)


def test_a_motion_keeps_its_promises_and_meets_what_it_should():
    motion = Circle(1.0)
    assert dyop.check_motion(motion, (0, 3), sample_count=50).fault is None
    result = dyop.time_of_impact(
        dyop.Sphere(0.5), dyop.RestMotion(((1, 0, 0, 0), (0, 2, 0))), dyop.Sphere(0.5), motion, (0, 3)
    )
    # The centres are 1 apart on a circle of radius 2.
    exact = np.pi / 2 - 2 * np.arcsin(0.25)
    assert result.status == dyop.ToiStatus.Impact
    assert exact - 1e-5 < result.t_safe <= exact


def test_its_domain_counts():
    with pytest.raises(dyop.InvalidArgument, match="defined"):
        dyop.time_of_impact(
            dyop.Sphere(1), dyop.RestMotion(), dyop.Sphere(1), Circle(1.0, end=2), (0, 3)
        )


def test_shapes_are_those_that_they_describe(generator):
    lens, pill = Lens(), Pill()
    pairs = [(lens, dyop.Ellipsoid([1, 1, 0.2])), (pill, dyop.Capsule(0.25, 1.5))]
    for derived, known in pairs:
        low, high = derived.bounding_box()
        assert (low <= known.bounding_box()[0]).all() and (high >= known.bounding_box()[1]).all()
        assert known.bounding_radius() - 1e-12 <= derived.bounding_radius() < 1.8
        for _ in range(30):
            q = generator.normal(size=4)
            X = dyop.RigidPose(quaternion=q / np.linalg.norm(q), position=3 * generator.normal(size=3))
            found = dyop.distance(derived, dyop.RigidPose(), dyop.Box([0.3, 0.4, 0.5]), X)
            wanted = dyop.distance(known, dyop.RigidPose(), dyop.Box([0.3, 0.4, 0.5]), X)
            assert found.status == wanted.status
            assert found.lower <= wanted.upper + 1e-9 and wanted.lower <= found.upper + 1e-9


def test_batches_call_them_from_many_threads():
    motions = [Circle(1.0 + k) for k in range(20)]
    shape = Lens()
    rows = [
        dyop.time_of_impact_batch(
            dyop.Sphere(0.5), dyop.RestMotion(((1, 0, 0, 0), (0, 2, 0))), shape, motions, (0, 1),
            thread_count=n,
        )
        for n in (1, 3)
    ]
    assert (rows[0] == rows[1]).all() and set(rows[0]["status"]) == {int(dyop.ToiStatus.Impact)}


def test_what_keeps_them_keeps_the_whole_object():
    obstacles = dyop.ObstacleSet()
    obstacles.add(Lens(), Circle(1.0))
    body = dyop.CompoundShape([(Pill(), dyop.RigidPose())])
    gc.collect()
    obstacle = obstacles.obstacle(obstacles.ids()[0])
    assert isinstance(obstacle.shape, Lens) and obstacle.X_WO.rate == 1.0
    result = obstacles.first_impact(body, dyop.RestMotion(((1, 0, 0, 0), (0, 2, 0))), (0, 3))
    assert result.toi.status == dyop.ToiStatus.Impact


def test_they_end_with_what_keeps_them():
    motion = Circle(1.0)
    ended = weakref.ref(motion)
    obstacles = dyop.ObstacleSet()
    obstacles.add(dyop.Sphere(1), motion)
    del motion
    gc.collect()
    assert ended() is not None
    del obstacles
    gc.collect()
    assert ended() is None


def test_they_pickle():
    motion = pickle.loads(pickle.dumps(Circle(2.0)))
    assert isinstance(motion, Circle) and motion.pose(0.5) == Circle(2.0).pose(0.5)
    pill = pickle.loads(pickle.dumps(Pill()))
    assert pill.bounding_radius() == 1.75


def test_a_method_that_is_missing_or_fails_is_named():
    class Empty(dyop.ConvexShape):
        pass

    class Broken(Circle):
        def pose(self, t):
            raise RuntimeError("no pose today")

    with pytest.raises(TypeError, match="Empty must define the method core_support"):
        dyop.distance(Empty(), dyop.RigidPose(), dyop.Sphere(1), dyop.RigidPose())
    with pytest.raises(TypeError, match="compute_mass_properties"):
        Lens().compute_mass_properties(1.0)
    with pytest.raises(RuntimeError, match="no pose today"):
        dyop.time_of_impact(dyop.Sphere(1), Broken(1.0), dyop.Sphere(1), dyop.RestMotion(), (0, 1))
    with pytest.raises(TypeError):
        dyop.Motion().pose(0.0)


class Faces:
    """A mesh as trimesh has it."""

    def __init__(self, mesh):
        self.vertices = np.array(mesh.vertices)
        self.faces = np.array(mesh.triangles)


class Cells:
    """A mesh as meshio has it."""

    def __init__(self, mesh):
        self.points = np.array(mesh.vertices)
        self.cells_dict = {"triangle": np.array(mesh.triangles)}


@pytest.mark.parametrize("kind", [Faces, Cells])
def test_meshes_of_other_libraries_are_shapes(kind, ball_mesh):
    other = kind(ball_mesh)
    X = ((1, 0, 0, 0), (4, 0, 0))
    wanted = dyop.distance(ball_mesh, dyop.RigidPose(), ball_mesh, X)
    assert dyop.distance(other, dyop.RigidPose(), other, X).lower == wanted.lower
    assert len(dyop.CompoundShape([(other, dyop.RigidPose())]).children) == 1
    obstacles = dyop.ObstacleSet()
    obstacles.add(other)
    assert isinstance(obstacles.obstacle(obstacles.ids()[0]).shape, dyop.TriangleMesh)
    rows = dyop.distance_batch(other, [dyop.RigidPose()] * 2, other, X)
    assert (rows["lower"] == wanted.lower).all()


def test_what_is_no_mesh_is_refused():
    class Quads:
        vertices = np.zeros((4, 3))
        faces = np.array([[0, 1, 2, 3]])

    with pytest.raises(dyop.InvalidArgument):
        dyop.distance(Quads(), dyop.RigidPose(), dyop.Sphere(1), dyop.RigidPose())
    with pytest.raises(TypeError, match="Shape"):
        dyop.distance("bunny.obj", dyop.RigidPose(), dyop.Sphere(1), dyop.RigidPose())
