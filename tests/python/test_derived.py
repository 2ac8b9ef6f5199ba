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

    class Giving(dyop.ConvexShape):
        def __init__(self, value):
            super().__init__()
            self.value = value

        def core_support(self, direction):
            return np.full(3, self.value)

    class Broken(Circle):
        def pose(self, t):
            raise RuntimeError("no pose today")

    with pytest.raises(TypeError, match="Empty must define the method core_support"):
        dyop.distance(Empty(), dyop.RigidPose(), dyop.Sphere(1), dyop.RigidPose())
    for value in (np.nan, np.inf):
        with pytest.raises(dyop.InvalidArgument, match="core_support must give a finite point"):
            dyop.distance(Giving(value), dyop.RigidPose(), dyop.Sphere(1), dyop.RigidPose())
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


class ZigZag(dyop.Motion):
    """Along x at speed 1, to and fro along y by 0.001: the twist jumps 1,000 times in a unit of time.

    It stays near the straight motion along x.
    """

    half = 1e-3  # of the time from one turn to the next but one
    speed = 1.0  # along y

    def offset(self, t):
        return self.speed * (self.half - abs(t % (2 * self.half) - self.half))

    def pose(self, t):
        return dyop.RigidPose(position=(t, self.offset(t), 0))

    def twist(self, t):
        return (1, self.speed if int(t // self.half) % 2 == 0 else -self.speed, 0), (0, 0, 0)

    def twist_bound(self, interval):
        is_smooth = interval.end <= self.smooth_until(interval.begin)
        return 1.5, 0, 0 if is_smooth else np.inf, 0

    def smooth_until(self, t):
        until = (t // self.half + 1) * self.half
        return until if until > t else until + self.half


class NearlyStraight(ZigZag):
    def stretch(self, t, after):
        return dyop.MotionStretch(
            end=np.inf, twist=((1, 0, 0), (0, 0, 0)), linear_deviation=self.speed * self.half
        )


def test_a_stretch_passes_many_jumps_at_once():
    # The ball of radius 1 comes from x = 0 and meets the one at x = 5 when x = 3 or a little later.
    ball, wall = dyop.Sphere(1), dyop.RestMotion(((1, 0, 0, 0), (5, 0, 0)))
    work = {}
    for motion in (ZigZag(), NearlyStraight()):
        assert dyop.check_motion(motion, (0, 5), sample_count=300).fault is None
        found = dyop.time_of_impact(ball, motion, ball, wall, (0, 5))
        assert found.status == dyop.ToiStatus.Impact
        gap = [
            np.linalg.norm(motion.pose(t).translation - (5, 0, 0)) - 2
            for t in np.linspace(0, found.t_safe, 2000)
        ]
        assert min(gap) > 0 and abs(found.t_hit - 3) < 1e-5
        # Along a floor 0.01 below.
        floor = dyop.RestMotion(((1, 0, 0, 0), (0, -2.01, 0)))
        missed = dyop.time_of_impact(ball, motion, dyop.Box([20, 1, 20]), floor, (0, 5))
        assert missed.status == dyop.ToiStatus.Separated
        work[type(motion).__name__] = missed.statistics.leaf_tests
    assert work["NearlyStraight"] < work["ZigZag"] / 20
    assert ZigZag().stretch(0, 1) is None and NearlyStraight().stretch(0, 1).end == np.inf


def deriving(**methods):
    return type("Odd", (NearlyStraight,), {k: lambda self, *_, v=v: v for k, v in methods.items()})()


@pytest.mark.parametrize(
    "methods,error,match",
    [
        ({"stretch": dyop.MotionStretch(end=-1)}, ValueError, "must end after .*, not at -1"),
        (
            {"stretch": dyop.MotionStretch(end=9, linear_deviation=np.nan)},
            ValueError,
            "linear deviation -?nan",
        ),
        (
            {"stretch": dyop.MotionStretch(end=9, twist=((np.inf, 0, 0), (0, 0, 0)))},
            ValueError,
            "twist of a stretch must be finite",
        ),
        ({"stretch": 5}, TypeError, "stretch must return a MotionStretch or None, not .* int"),
        ({"pose_scale": 5}, TypeError, "pose_scale must return a PoseScale, not .* int"),
        ({"pose_scale": dyop.PoseScale(length=np.nan)}, ValueError, "length -?nan"),
        ({"smooth_until": -1.0}, ValueError, "smooth_until .* not -1"),
        ({"twist_bound": (1, 0, -1, 0)}, ValueError, "linear acceleration -1"),
        ({"state": 3}, ValueError, "state must be a MotionState or a pair"),
    ],
)
def test_odd_answers_of_a_motion_are_named(methods, error, match):
    ball, wall = dyop.Sphere(1), dyop.RestMotion(((1, 0, 0, 0), (5, 0, 0)))
    with pytest.raises(error, match=match):
        dyop.time_of_impact(ball, deriving(**methods), ball, wall, (0, 5))


def test_a_stretch_that_is_left_is_found():
    low = dyop.MotionStretch(end=np.inf, twist=((1, 0, 0), (0, 0, 0)), linear_deviation=1e-4)
    found = dyop.check_motion(deriving(stretch=low), (0, 5), sample_count=300)
    assert found.fault == dyop.MotionFault.StretchExceeded and found.found > found.allowed


def test_a_motion_may_give_its_state_and_scale():
    class Both(Circle):
        calls = 0

        def state(self, t):
            type(self).calls += 1
            return self.pose(t), self.twist(t)

        def pose_scale(self, interval):
            own = super().pose_scale(interval)
            return dyop.PoseScale(length=1e4 * own.length, angle=own.angle)

    ball, wall = dyop.Sphere(0.5), dyop.RestMotion(((1, 0, 0, 0), (0, 3, 0)))
    plain = dyop.time_of_impact(ball, Circle(1.0), ball, wall, (0, 3))
    rough = dyop.time_of_impact(ball, Both(1.0), ball, wall, (0, 3))
    assert Both.calls > 2 and plain.status == rough.status == dyop.ToiStatus.Impact
    assert rough.rounding_allowance > 1e2 * plain.rounding_allowance
    assert Circle(1.0).pose_scale((0, 1)).length >= 2
