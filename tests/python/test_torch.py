# SPDX-License-Identifier: BSD-3-Clause
"""dyop.torch against central differences of torch's own, in double and single precision."""

import numpy as np
import pytest
from conftest import uv_sphere

import dyop

torch = pytest.importorskip("torch")
dt = pytest.importorskip("dyop.torch")

A, B = dyop.Box([0.8, 0.5, 0.3]), dyop.Capsule(0.2, 0.5)


def pose(parameters):
    """(..., 4, 4) from rotation vectors and positions (..., 6)."""
    w, p = parameters[..., :3], parameters[..., 3:]
    zero = torch.zeros_like(w[..., 0])
    rows = [zero, -w[..., 2], w[..., 1], w[..., 2], zero, -w[..., 0], -w[..., 1], w[..., 0], zero]
    R = torch.matrix_exp(torch.stack(rows, -1).reshape(*w.shape[:-1], 3, 3))
    last = torch.tensor([0.0, 0, 0, 1], dtype=p.dtype).expand(*p.shape[:-1], 1, 4)
    return torch.cat([torch.cat([R, p[..., None]], -1), last], -2)


def generic(count, generator, away=2.0):
    at = generator.normal(size=(count, 6))
    at[:, 3:] *= away / np.linalg.norm(at[:, 3:], axis=1, keepdims=True)
    return torch.tensor(at, requires_grad=True)


def test_a_distance_passes_the_gradient_check(generator):
    x, y = generic(6, generator, 0.1), generic(6, generator)
    found = dt.distance(A, pose(x), B, pose(y))
    assert found.value.shape == (6,) and found.is_proven.all()
    for k in range(6):
        plain = dyop.distance(A, pose(x)[k].detach().numpy(), B, pose(y)[k].detach().numpy())
        assert found.value[k].item() == pytest.approx(plain.upper, rel=1e-12)
    assert torch.autograd.gradcheck(lambda u, v: dt.distance(A, pose(u), B, pose(v)).value, (x, y), eps=1e-6, atol=1e-6)


def test_a_time_of_impact_passes_the_gradient_check(generator):
    start = torch.zeros(6, dtype=torch.float64, requires_grad=True)
    other = generic(4, generator)
    towards = torch.cat([-other[:, 3:], torch.tensor(generator.normal(size=(4, 3)))], -1)
    towards = towards.detach().requires_grad_()
    turning = torch.tensor([0.1, 0, 0, 0, 0, 0.3], dtype=torch.float64, requires_grad=True)
    options = dyop.ToiOptions(target_distance=0.01, distance_tolerance=1e-10)

    def times(u, v, w, z):
        return dt.time_of_impact(A, pose(u), v, B, pose(w), z, 5.0, options=options)

    found = times(start, turning, other, towards)
    assert found.value.shape == (4,) and found.is_proven.all() and (found.value < 2).all()
    assert torch.autograd.gradcheck(lambda *x: times(*x).value, (start, turning, other, towards), eps=1e-6, atol=1e-5)


def test_a_miss_is_infinite_and_moves_nothing():
    at = torch.tensor([0.0, 0, 0, 5, 0, 0], requires_grad=True)
    v = torch.tensor([1.0, 0, 0, 0, 0, 0], requires_grad=True)
    found = dt.time_of_impact(A, torch.eye(4), torch.zeros(6), B, pose(at), v, 3.0)
    assert found.value.item() == float("inf") and found.is_proven
    torch.where(torch.isfinite(found.value), found.value, torch.zeros(())).sum().backward()
    assert (at.grad == 0).all() and (v.grad == 0).all()


def test_corners_are_flagged():
    at = torch.tensor([0.0, 0, 0, 0, 0, 2], dtype=torch.float64, requires_grad=True)
    found = dt.distance(A, torch.eye(4, dtype=torch.float64), A, pose(at))  # face to face
    assert not found.is_proven and found.value.item() == pytest.approx(1.4)
    with pytest.raises(dt.FlaggedDerivative, match="number 0.*Tie"):
        found.value.backward()
    dt.distance(A, torch.eye(4, dtype=torch.float64), A, pose(at), use_flagged=True).value.backward()
    assert at.grad[5].item() == pytest.approx(1)


def test_shapes_that_touch_do_not_move_each_other():
    at = torch.zeros(6, dtype=torch.float64, requires_grad=True)
    dt.distance(A, torch.eye(4, dtype=torch.float64), B, pose(at), use_flagged=True).value.backward()
    assert (at.grad == 0).all()
    start = dt.time_of_impact(A, torch.eye(4), torch.zeros(6), B, pose(at), torch.ones(6), 1.0)
    assert start.value.item() == 0 and start.value.dtype == torch.float64 and not start.is_proven
    with pytest.raises(dt.FlaggedDerivative, match="Touching"):
        start.value.backward()


def test_an_answer_that_a_budget_cut_off_is_an_error():
    options = dyop.ToiOptions(max_node_pairs=1)
    sphere = dyop.TriangleMesh(*uv_sphere(8, 10))
    at = pose(torch.tensor([0.1, 0.2, 0, 2.5, 0, 0]))
    with pytest.raises(RuntimeError, match="number 0: BudgetExhausted"):
        towards = torch.tensor([-1.0, 0, 0, 0, 0, 3])
        dt.time_of_impact(sphere, torch.eye(4), torch.zeros(6), sphere, at, towards, 5.0, options=options)


def test_what_is_left_out_is_not_asked_for():
    at = torch.zeros(2, 6, dtype=torch.float64)
    at[0, 5], at[1, 3:] = 0.1, torch.tensor([1.0, 1.2, 1.5])
    at.requires_grad_()
    found = dt.distance(A, torch.eye(4, dtype=torch.float64), B, pose(at))
    assert found.is_proven.tolist() == [False, True] and found.value[0] == 0
    found.value[found.is_proven].sum().backward()
    assert (at.grad[0] == 0).all() and at.grad[1].norm() > 0.5


def test_single_precision_and_broadcasting(generator):
    x = generic(5, generator).detach().float().requires_grad_()
    found = dt.distance(A, torch.eye(4), B, pose(x))
    exact = x.detach().double().requires_grad_()
    double = dt.distance(A, torch.eye(4, dtype=torch.float64), B, pose(exact))
    assert found.value.dtype == torch.float32
    found.value.sum().backward()
    double.value.sum().backward()
    torch.testing.assert_close(x.grad.double(), exact.grad, rtol=1e-4, atol=1e-4)
    grid = dt.distance(A, torch.eye(4).expand(2, 1, 4, 4), B, pose(x.detach()))
    assert grid.value.shape == (2, 5)


def test_a_gradient_descent_comes_to_the_wanted_distance():
    at = torch.tensor([0.3, -0.2, 0.5, 2.0, 1.5, 1.0], dtype=torch.float64, requires_grad=True)
    optimiser = torch.optim.SGD([at], lr=0.2)
    for _ in range(60):
        optimiser.zero_grad()
        loss = 0.5 * (dt.distance(A, torch.eye(4, dtype=torch.float64), B, pose(at)).value - 0.5) ** 2
        loss.backward()
        optimiser.step()
    assert loss.item() < 1e-6


@pytest.mark.parametrize(
    "bad, said",
    [
        (torch.eye(3), r"X_WB must end in a shape of 4x4, not be \(3, 3\)"),
        (torch.diag(torch.tensor([1.0, 1, 2, 1])), "orthonormal"),
        (torch.full((4, 4), float("nan")), "number 0: .*nan"),
        (torch.eye(4, dtype=torch.int64), "X_WB must be float32 or float64, not torch.int64"),
    ],
)
def test_a_bad_pose_is_refused_with_its_reason(bad, said):
    with pytest.raises(dyop.InvalidArgument, match=said):
        dt.distance(A, torch.eye(4), B, bad)


def test_one_bad_pose_of_many_is_named(generator):
    poses = pose(generic(5, generator).detach()).float()
    poses[3, 0, 3] = float("nan")
    with pytest.raises(dyop.InvalidArgument, match="number 3: .*nan"):
        dt.distance(A, torch.eye(4), B, poses)
    with pytest.raises(TypeError, match="X_WA must be a tensor, not a value of type ndarray"):
        dt.distance(A, np.eye(4), B, poses)


def test_batches_that_do_not_fit_are_refused():
    with pytest.raises(dyop.InvalidArgument, match="do not broadcast"):
        dt.distance(A, torch.eye(4).expand(2, 4, 4), B, torch.eye(4).expand(3, 4, 4))
    with pytest.raises(dyop.InvalidArgument, match="V_WB must end in a shape of 6"):
        dt.time_of_impact(A, torch.eye(4), torch.zeros(6), B, torch.eye(4), torch.zeros(3), 1.0)
    none = dt.distance(A, torch.eye(4), B, torch.eye(4).expand(0, 4, 4))
    assert none.value.shape == (0,)
