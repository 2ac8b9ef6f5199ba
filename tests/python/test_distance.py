# SPDX-License-Identifier: BSD-3-Clause
import pickle

import numpy as np
import pytest

import dyop
from conftest import random_quaternions, uv_sphere

HERE = dyop.RigidPose()


def at(x, y=0.0, z=0.0):
    return dyop.RigidPose(position=(x, y, z))


def test_two_spheres():
    result = dyop.distance(dyop.Sphere(1), HERE, dyop.Sphere(0.5), at(3, 4))
    assert result.status == dyop.DistanceStatus.Separated
    assert result.lower <= 3.5 <= result.upper and result.upper - result.lower < 1e-12
    np.testing.assert_allclose(result.nhat_AB_W, [0.6, 0.8, 0], atol=1e-15)
    np.testing.assert_allclose(result.p_WCa, [0.6, 0.8, 0], atol=1e-15)
    np.testing.assert_allclose(result.pivot_W(), (result.p_WCa + result.p_WCb) / 2)
    assert result.feature_a.kind == dyop.FeatureKind.Vertex  # of the core, a point
    assert result.triangle_a is None
    assert "Separated" in repr(result) and str(result)


@pytest.mark.parametrize("scale", [1e-4, 1.0, 1e4])
def test_turned_box_against_a_sphere_has_its_closed_form(generator, scale):
    # Distance of a point from a box, in the box's frame.
    box = dyop.Box(scale * np.array([1, 2, 0.5]))
    for q in random_quaternions(generator, 40):
        pose = dyop.RigidPose(quaternion=q, position=scale * generator.normal(size=3) * 10)
        center = scale * generator.normal(size=3) * 6
        radius = 0.1 * scale
        inner = np.abs(pose.inverse().transform(center)) - box.half_extents
        expected = np.linalg.norm(np.maximum(inner, 0)) - radius
        if expected < 0:
            continue
        result = dyop.distance(box, pose, dyop.Sphere(radius), dyop.RigidPose(position=center))
        rounding = 1e-14 * scale  # of `expected`
        assert result.lower <= expected + rounding and expected <= result.upper + rounding
        assert result.upper - result.lower <= 1e-11 * scale


def test_options_stop_early_and_find_depth():
    far = dyop.DistanceOptions(max_distance=1)
    result = dyop.distance(dyop.Sphere(1), HERE, dyop.Sphere(1), at(9), far)
    assert result.status == dyop.DistanceStatus.FartherThanMaxDistance and result.lower > 1
    deep = dyop.DistanceOptions(with_penetration=True)
    result = dyop.distance(dyop.Box([1, 1, 1]), HERE, dyop.Box([1, 1, 1]), at(1.5), deep)
    assert result.status == dyop.DistanceStatus.Overlapping
    assert result.penetration.depth == pytest.approx(0.5, abs=1e-3)
    alone = dyop.find_penetration(dyop.Box([1, 1, 1]), HERE, dyop.Box([1, 1, 1]), at(1.5))
    assert alone.depth == result.penetration.depth
    assert dyop.find_penetration(dyop.Sphere(1), HERE, dyop.Sphere(1), at(5)) is None


def test_a_body_inside_a_solid_overlaps(ball_mesh):
    small = dyop.Sphere(0.1)
    surface = dyop.distance(ball_mesh, HERE, small, HERE)
    assert surface.status == dyop.DistanceStatus.Separated and surface.triangle_a is not None
    solid = dyop.distance(ball_mesh, HERE, small, HERE, dyop.DistanceOptions(solid_a=True))
    assert solid.status == dyop.DistanceStatus.Overlapping


def test_a_cache_changes_nothing_but_the_work():
    mesh = dyop.TriangleMesh(*uv_sphere(40, 60))
    cache = dyop.DistanceCache()
    first = dyop.distance(mesh, HERE, mesh, at(3), cache=cache)
    again = dyop.distance(mesh, HERE, mesh, at(3), cache=cache)
    assert again.upper == pytest.approx(first.upper, rel=1e-14)
    assert again.statistics.leaf_tests <= first.statistics.leaf_tests


def test_a_cube_on_a_face_has_four_contacts():
    cube = dyop.Box([1, 1, 1])
    contacts = dyop.find_contacts(cube, HERE, cube, at(0, 0, 2.001), 0.01)
    corners = sorted(tuple(np.round(c.p_WCb, 6)) for c in contacts)
    assert corners == [(x, y, 1.001) for x in (-1, 1) for y in (-1, 1)]
    assert all(c.upper == pytest.approx(0.001, abs=1e-12) for c in contacts)
    with pytest.raises(dyop.InvalidArgument, match="max_distance"):
        dyop.find_contacts(cube, HERE, cube, HERE, -1)


def test_points_have_signed_distances(ball_mesh):
    signed = dyop.PointDistanceOptions(is_signed=True)
    inside = dyop.point_distance(dyop.Box([1, 2, 3]), HERE, (0.75, 0, 0), signed)
    assert inside.upper == pytest.approx(-0.25) and inside.lower <= inside.upper
    np.testing.assert_allclose(inside.nhat_W, [1, 0, 0])
    outside = dyop.point_distance(ball_mesh, HERE, (3, 0, 0), signed)
    assert outside.triangle is not None and outside.lower <= 2 + 0.1


def test_kernels():
    a = [[0, 0, 0], [1, 0, 0], [0, 1, 0]]
    b = [[0.1, 0.1, 2], [1, 0, 2], [0, 1, 3]]
    result = dyop.triangle_distance(a, b)
    assert result.lower <= 2 <= result.upper and result.upper == pytest.approx(2)
    result = dyop.gjk_distance(dyop.Sphere(1), dyop.Sphere(1), at(5))
    assert result.upper == pytest.approx(3)
    with pytest.raises(ValueError):
        dyop.triangle_distance(a, np.full((3, 3), np.nan))


def test_batch_rows_are_single_answers(all_shapes, generator):
    count = 60
    a = [all_shapes[i % 6] for i in range(count)]
    b = [all_shapes[(i * 5 + 1) % 6] for i in range(count)]
    q, p = random_quaternions(generator, count), generator.normal(size=(count, 3)) * 4
    rows = dyop.distance_batch(a, HERE, b, (q, p), thread_count=2)
    for i, row in enumerate(rows):
        one = dyop.distance(a[i], HERE, b[i], dyop.RigidPose(quaternion=q[i], position=p[i]))
        assert row["lower"] == one.lower and row["upper"] == one.upper
        assert dyop.DistanceStatus(int(row["status"])) == one.status
        np.testing.assert_array_equal(row["p_WCa"], one.p_WCa)
        assert row["feature_b"][0] == int(one.feature_b.kind)
        assert row["triangle_a"] == (-1 if one.triangle_a is None else one.triangle_a)
        assert row["leaf_tests"] == one.statistics.leaf_tests
        assert np.isnan(row["penetration_depth"])


def test_batch_takes_poses_in_all_forms(generator):
    q, p = random_quaternions(generator, 5), generator.normal(size=(5, 3)) * 9
    poses = [dyop.RigidPose(quaternion=q[i], position=p[i]) for i in range(5)]
    matrices = np.array([pose.matrix for pose in poses])
    answers = [
        dyop.distance_batch(dyop.Box([1, 1, 1]), np.eye(4), dyop.Sphere(1), offered)
        for offered in ((q, p), poses, matrices, matrices.tolist())
    ]
    for rows in answers[1:]:
        np.testing.assert_allclose(rows["upper"], answers[0]["upper"], rtol=1e-13)
    with pytest.raises(dyop.InvalidArgument, match="5 quaternions but 4"):
        dyop.distance_batch(dyop.Sphere(1), np.eye(4), dyop.Sphere(1), (q, p[:4]))
    with pytest.raises(dyop.InvalidArgument, match="holds"):
        dyop.distance_batch([dyop.Sphere(1)] * 3, np.eye(4), dyop.Sphere(1), (q, p))


def test_rays_meet_the_first_surface(ball_mesh):
    hit = dyop.ray_cast(dyop.Sphere(1), at(5), (0, 0.6, 0), (2, 0, 0))
    assert hit.status == dyop.RayStatus.Hit and hit.gap < 1e-11
    assert hit.distance == pytest.approx(4.2, abs=1e-11)
    np.testing.assert_allclose(hit.nhat_W, [-0.8, 0.6, 0], atol=1e-7)
    thick = dyop.ray_cast(dyop.Sphere(1), at(5), (0, 0.9, 0), (1, 0, 0), radius=0.5)
    assert thick.distance == pytest.approx(3.8, abs=1e-11)
    miss = dyop.ray_cast(ball_mesh, HERE, (0, 0, 5), (0, 0, -1), length=2)
    assert miss.status == dyop.RayStatus.Miss and miss.distance == 2
    assert dyop.ray_cast(dyop.Sphere(1), HERE, (0, 0, 0), (1, 0, 0)).status.name == "InitiallyTouching"
    with pytest.raises(dyop.InvalidArgument, match="direction_W"):
        dyop.ray_cast(dyop.Sphere(1), HERE, (0, 0, 0), (0, 0, 0))


def test_many_rays_give_rows(generator, ball_mesh):
    starts = 3 * generator.normal(size=(500, 3))
    rows = dyop.ray_cast_batch(ball_mesh, HERE, starts, -starts, radius=0.1)
    assert rows.dtype == dyop.ray_row
    for start, row in zip(starts[:20], rows):
        alone = dyop.ray_cast(ball_mesh, HERE, start, -start, radius=0.1)
        assert row["distance"] == alone.distance and row["status"] == int(alone.status)
    missed = dyop.ray_cast_batch(ball_mesh, HERE, starts + 100, starts + 100)
    assert np.all(missed["status"] == int(dyop.RayStatus.Miss))
    assert np.all(np.isnan(missed["p_WC"])) and np.all(missed["triangle"] == -1)
    with pytest.raises(dyop.InvalidArgument, match="ray 1"):
        dyop.ray_cast_batch(ball_mesh, HERE, starts[:2], [[1, 0, 0], [0, 0, 0]])
    with pytest.raises(dyop.InvalidArgument, match="directions_W 1"):
        dyop.ray_cast_batch(ball_mesh, HERE, starts[:2], [[1, 0, 0]])


def test_derivatives_are_central_differences():
    a, b = dyop.Box([1, 1, 1]), dyop.Capsule(0.2, 0.5)
    pose = dyop.RigidPose(quaternion=(0.8, 0.6, 0, 0), position=(0.3, 0.2, 3))
    found = dyop.distance_derivatives(a, HERE, b, pose)
    assert found.status == dyop.DerivativeStatus.Proven and found.error < 1e-4
    step = 1e-6
    for k in range(3):
        shift = step * np.eye(3)[k]
        plus, minus = (
            dyop.distance(a, HERE, b, dyop.RigidPose(rotation=pose.rotation, position=pose.translation + s)).upper
            for s in (shift, -shift)
        )
        assert found.by_b.translation[k] == pytest.approx((plus - minus) / (2 * step), abs=1e-7)
    assert found.by_b.along(((1, 0, 0), (0, 0, 0))) == found.by_b.translation[0]
    assert found.witness.nhat_by_b.translation.shape == (3, 3)
    flat = dyop.distance_derivatives(a, HERE, a, at(0.1, 0.2, 3))
    assert flat.status == dyop.DerivativeStatus.Tie and flat.witness is None
    with pytest.raises(dyop.InvalidArgument, match="tolerance"):
        dyop.distance_derivatives(a, HERE, b, pose, tolerance=0)


def all_distances(a, X_WA, b, X_WB):
    """Of every triangle of a from every one of b."""
    corners = [
        [X.rotation @ mesh.vertices[row].T + X.translation[:, None] for row in mesh.triangles]
        for mesh, X in ((a, X_WA), (b, X_WB))
    ]
    return {
        (i, j): dyop.triangle_distance(one.T, other.T)
        for i, one in enumerate(corners[0])
        for j, other in enumerate(corners[1])
    }


@pytest.mark.parametrize("scale", [1e-4, 1.0, 1e4])
@pytest.mark.parametrize("far", [0.0, 1e3])
def test_near_triangles_are_those_of_all_pairs(generator, scale, far):
    vertices, triangles = uv_sphere(5, 6)
    mesh = dyop.TriangleMesh(scale * vertices, triangles)
    for reach in (0.0, 0.3):
        q = random_quaternions(generator, 1)[0]
        place = scale * (np.array([1.7, 0.3, -0.2]) + far)
        X_WA = dyop.RigidPose(position=(scale * far,) * 3)
        X_WB = dyop.RigidPose(quaternion=q, position=place)
        found = dyop.near_triangles(mesh, X_WA, mesh, X_WB, reach * scale)
        listed = [(int(row["a"]), int(row["b"])) for row in found.pairs]
        assert found.is_complete and listed == sorted(set(listed)) and listed
        distances = all_distances(mesh, X_WA, mesh, X_WB)
        noise = 1e-9 * scale * (1 + far)
        for pair, gap in distances.items():
            if gap.upper <= reach * scale - noise:
                assert pair in set(listed)
            if gap.lower > reach * scale + noise:
                assert pair not in set(listed)
        for row in found.pairs:
            gap = distances[int(row["a"]), int(row["b"])]
            assert row["lower"] <= gap.upper + noise and gap.lower <= row["upper"] + noise


def test_near_triangles_end_at_a_limit_and_pickle(ball_mesh):
    pose = dyop.RigidPose(position=(1, 0, 0))
    everything = dyop.near_triangles(ball_mesh, np.eye(4), ball_mesh, pose, 10.0)
    count = len(ball_mesh.triangles) ** 2
    assert everything.is_complete and len(everything.pairs) == count > 10_000
    assert everything.pairs.dtype == dyop.near_triangles_row
    few = dyop.near_triangles(ball_mesh, np.eye(4), ball_mesh, pose, 10.0, max_pairs=7)
    assert not few.is_complete and len(few.pairs) <= 7
    copied = pickle.loads(pickle.dumps(everything))
    assert copied.pairs.tobytes() == everything.pairs.tobytes() and copied.is_complete
    assert len(repr(everything)) < 2000
    with pytest.raises(dyop.InvalidArgument, match="-1"):
        dyop.near_triangles(ball_mesh, np.eye(4), ball_mesh, pose, -1.0)
    with pytest.raises(TypeError, match="'a' must be TriangleMesh"):
        dyop.near_triangles(dyop.Sphere(1), np.eye(4), ball_mesh, pose, 1.0)


def test_a_mesh_meets_itself_where_it_was_folded(ball_mesh):
    assert len(dyop.near_own_triangles(ball_mesh, 0.0).pairs) == 0
    vertices = np.array(ball_mesh.vertices)
    vertices[0] = (0, 0, -2)  # the pole, pushed through the other one
    folded = dyop.TriangleMesh(vertices, ball_mesh.triangles)
    found = dyop.near_own_triangles(folded, 0.0)
    assert found.is_complete and len(found.pairs) > 0
    for row in found.pairs:
        one, other = (folded.triangles[row[side]] for side in "ab")
        assert row["a"] < row["b"] and not set(one) & set(other)
        assert dyop.triangle_distance(vertices[one], vertices[other]).lower == 0


@pytest.mark.parametrize("scale", [1e-3, 1.0, 1e3])
def test_a_separating_translation_is_proven(ball_mesh, scale):
    ball = dyop.Sphere(scale)
    aside = dyop.RigidPose(position=(1.2 * scale, 0.5 * scale, 0))
    way = dyop.separating_translation(ball, np.eye(4), ball, aside)
    assert way.depth == pytest.approx((2 - 1.3) * scale, rel=1e-3)
    mesh = dyop.TriangleMesh(scale * np.array(ball_mesh.vertices), ball_mesh.triangles)
    options = dyop.SeparationOptions(directions=24, tolerance=1e-3 * scale)
    way = dyop.separating_translation(mesh, np.eye(4), mesh, aside, options)
    moved = dyop.RigidPose(position=aside.translation + way.depth * way.nhat_AB_W)
    solid = dyop.DistanceOptions(solid_a=True, solid_b=True)
    there = dyop.distance(mesh, np.eye(4), mesh, moved, solid)
    assert there.status == dyop.DistanceStatus.Separated and there.upper < 3e-3 * scale
    beyond = dyop.RigidPose(position=(3 * scale, 0, 0))
    assert dyop.separating_translation(mesh, np.eye(4), mesh, beyond) is None
    with pytest.raises(dyop.InvalidArgument, match="0"):
        dyop.separating_translation(
            mesh, np.eye(4), mesh, aside, dyop.SeparationOptions(directions=0)
        )
