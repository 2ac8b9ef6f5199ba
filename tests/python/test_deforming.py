# SPDX-License-Identifier: BSD-3-Clause
import numpy as np
import pytest

import dyop
from conftest import uv_sphere

SHEET = np.array([[-1.0, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]])
CORNERS = [[0, 1, 2], [0, 2, 3]]


def test_two_sheets_that_close_meet_at_gap_over_speed():
    low = dyop.DeformingMesh(SHEET, SHEET, CORNERS)
    high = dyop.DeformingMesh(SHEET + [0, 0, 2], SHEET - [0, 0, 2], CORNERS)
    result = dyop.time_of_impact(low, high, (0, 4))
    assert result.status == dyop.ToiStatus.Impact
    assert result.t_safe == pytest.approx(2, abs=1e-5)
    assert result.contact.triangle_a is not None


def test_a_sheet_that_rises_meets_a_rigid_mesh():
    sheet = dyop.DeformingMesh(SHEET, SHEET + [0, 0, 4], CORNERS)
    ball = dyop.TriangleMesh(*uv_sphere(10, 12))
    motion = dyop.ConstantTwistMotion(((1, 0, 0, 0), (0, 0, 5)), ((0, 0, -2), (0, 0, 0)))
    result = dyop.time_of_impact(sheet, ball, motion, (0, 1))
    assert result.t_safe == pytest.approx(4 / 6, abs=1e-5)


def test_refit_advance_and_snapshot():
    mesh = dyop.DeformingMesh(SHEET, SHEET + [0, 0, 1], CORNERS)
    np.testing.assert_array_equal(mesh.snapshot(0.5).vertices, SHEET + [0, 0, 0.5])
    mesh.advance(SHEET + [0, 0, 3])
    np.testing.assert_array_equal(mesh.begin, SHEET + [0, 0, 1])
    np.testing.assert_array_equal(mesh.end, SHEET + [0, 0, 3])
    mesh.refit(SHEET, SHEET)
    np.testing.assert_array_equal(mesh.end, SHEET)
    np.testing.assert_array_equal(mesh.triangles, CORNERS)
    with pytest.raises(dyop.InvalidArgument):
        mesh.refit(SHEET[:3], SHEET[:3])


def test_a_deforming_query_resumes():
    vertices, triangles = uv_sphere(20, 30)
    a = dyop.DeformingMesh(vertices, vertices * 1.2, triangles)
    b = dyop.DeformingMesh(vertices + [4, 0, 0], vertices + [1, 0, 0], triangles)
    whole = dyop.time_of_impact(a, b, (0, 1))
    workspace = dyop.ToiWorkspace()
    part = dyop.ToiOptions(max_node_pairs=20)
    result = dyop.time_of_impact(a, b, (0, 1), part, workspace)
    assert result.status == dyop.ToiStatus.BudgetExhausted
    while workspace.can_resume():
        result = dyop.resume_time_of_impact(a, b, (0, 1), part, workspace)
    assert result.t_safe == whole.t_safe and result.status == whole.status


def test_a_vertex_meets_a_triangle_and_an_edge_an_edge():
    begin = np.array([[0.2, 0.2, 3], [0, 0, 0], [1, 0, 0], [0, 1, 0]], dtype=float)
    end = begin - [[0, 0, 4], [0, 0, 0], [0, 0, 0], [0, 0, 0]]
    result = dyop.vertex_face_time_of_impact(begin, end, (0, 8))
    assert result.status == dyop.ToiStatus.Impact and result.t_safe == pytest.approx(6, abs=1e-4)
    begin = np.array([[-1, 0, 1], [1, 0, 1], [0, -1, 0], [0, 1, 0]], dtype=float)
    end = begin - [[0, 0, 2], [0, 0, 2], [0, 0, 0], [0, 0, 0]]
    result = dyop.edge_edge_time_of_impact(begin, end)
    assert result.t_safe == pytest.approx(0.5, abs=1e-5)


def test_exact_rule_tells_a_graze_from_a_miss():
    exact = dyop.VertexToiOptions(contact_rule=dyop.ContactRule.Exact)
    begin = np.array([[0, 0, 1], [0, 0, 0], [1, 0, 0], [0, 1, 0]], dtype=float)
    end = begin.copy()
    end[0] = [0, 0, -1]
    assert dyop.vertex_face_time_of_impact(begin, end, options=exact).status != (
        dyop.ToiStatus.Separated
    )
    missed = begin - [[1e-12, 1e-12, 0]] + 0
    missed[1:] = begin[1:]
    missed_end = missed.copy()
    missed_end[0, 2] = -1
    assert dyop.vertex_face_time_of_impact(missed, missed_end, options=exact).status == (
        dyop.ToiStatus.Separated
    )
    with pytest.raises(dyop.InvalidArgument, match="4 points"):
        dyop.vertex_face_time_of_impact(begin[:3], end[:3])
